# SPDX-License-Identifier: Apache-2.0
"""Stores: built from files and arrays, and asked for what they hold."""

import errno
import json
import math
import os
import tempfile

import numpy as np

from . import _core
from ._arrays import as_rows, whole
from ._geo import FeatureCollection, geojson, region as as_region
from ._job import job, notes
from ._mesh import BoundedMesh, Mesh
from ._raster import read_raster
from ._sources import crs_text, source_of

_BUILD_OPTIONS = {
    'replace', 'input_format', 'skip_damaged', 'vertical', 'block_points', 'facility_cost', 'z_weight', 'channels',
    'outlier_price', 'band', 'cell', 'seed', 'datum_shift', 'where', 'keep', 'drop', 'resolution', 'metric',
    'region', 'effort', 'order', 'entities', 'method', 'heights_of_colour',
}
_TILE_OPTIONS = {
    'name', 'max_error', 'geoid', 'flat_height', 'water', 'water_height', 'normals', 'metadata', 'gzip', 'resume',
    'replace', 'quality', 'vertical', 'fill',
}


def checked(options, known, function):
    for name in options:
        if name not in known:
            raise TypeError(f'{function}() has no option {name!r}; it has {", ".join(sorted(known))}')
    return {name: value for name, value in options.items() if value is not None}


def xyz(points):
    """The coordinates of a structured array of points as an array of shape (n, 3), without a copy."""
    if not isinstance(points, np.ndarray):
        raise TypeError('points are a structured array')
    fields = points.dtype.fields or {}
    if points.ndim != 1 or any(fields.get(axis, ())[:2] != (np.dtype(np.float64), 8 * i) for i, axis in enumerate('xyz')):
        raise ValueError('points have one dimension and the fields x, y and z, of float64, first')
    return np.lib.stride_tricks.as_strided(points['x'], (len(points), 3), (points.strides[0], 8))


def real_values(records, attributes):
    """Attributes that are stored with a scale or offset, as real values (float64), like files written of them."""
    scaled = {a['name']: a for a in attributes if a['scale'] != 1 or a['offset'] != 0}
    if not scaled:
        return records
    kind = [(name, 'f8' if name in scaled else records.dtype[name]) for name in records.dtype.names]
    real = np.empty(records.shape, kind)
    for name in records.dtype.names:
        real[name] = records[name]
        if name in scaled:
            real[name] *= scaled[name]['scale']
            real[name] += scaled[name]['offset']
    return real


def _smoothing(method='laplacian', iterations=10, strength=0.5, pass_band=0.1, edge_height=0.0):
    return method, whole(iterations, 'iterations', bits=32), float(strength), float(pass_band), float(edge_height)


def build(sources, store, *, transform=None, crs=None, nodata=None, attributes=None, progress=None, threads=None,
          memory=None, **options):
    """Streams points or rasters once into a store, in constant memory, and opens it.

    sources: the name of a file or several (GeoTIFF, LAS, LAZ, COPC, PLY, text and others; several rasters form
    a mosaic), or what is in memory:

    - an array of shape (n, 3): points, with ``attributes`` (a dict of columns) beside them;
    - a structured array with fields x, y, z (or X, Y, Z) and further ones, a dict of columns, a
      ``pandas.DataFrame`` with such columns, a ``laspy.LasData`` or its ``points``, also part of them;
    - an array of shape (rows, columns), masked or not: a raster, with ``transform`` (six numbers a, b, c, d, e, f from
      columns and rows of corners to x and y, as rasterio's) and ``nodata``. An array of three columns is a
      raster if ``transform`` is given;
    - an ``xarray.DataArray`` with rioxarray's accessor or attributes, a dataset of rasterio or GDAL, a Raster, any array
      with ``transform`` (and ``crs``, ``nodata``);
    - anything else with numpy's array interface, the buffer protocol or DLPack.

    Arrays are read in place. Points with a coordinate that is NaN or masked are left out and count as nodata, as
    samples that are not finite do; infinite coordinates are refused.

    store: the folder to make; it appears when it is whole. crs: of the source, in place of what it says: 'EPSG:n',
    a name, WKT, or an object with to_wkt().

    Options: ``replace`` an existing store; ``where`` ('classification == 2'), ``region`` (box, polygons), ``keep``,
    ``drop`` (names of attributes) say what is read; ``block_points`` (10000) are clustered together, at
    ``facility_cost`` (3.0, times a block's diagonal), with ``effort`` 'fast', 'default', 'fine' or 'full', ``z_weight``
    of heights, a ``metric`` ('euclidean', 'squared', 'minkowski:P', 'elliptical:FILE'), ``channels`` (pairs of an
    attribute and metres per unit) and ``outlier_price``, by a ``method`` of cluster(); ``order`` 'auto', 'stream' or
    'spatial'; ``vertical`` 'ellipsoidal' or 'orthometric'; ``seed``; of files ``input_format``, ``entities``,
    ``skip_damaged``, ``band``, ``cell``, ``heights_of_colour`` ('mapbox', 'terrarium'), ``resolution``,
    ``datum_shift``.

    progress: None, True for a bar (tqdm's where it is), or a function called as progress(what, count, fraction,
    ended). threads: all cores unless given. memory: bytes, 256 MiB unless given. The store depends on the source,
    the options and the seed alone.

    Returns: the opened Store. Raises: Error for bad data, OSError, ValueError, TypeError; KeyboardInterrupt on
    Ctrl-C. No store stands then. Notes of what was assumed go to ``logging.getLogger('terrace')``.

    Source: J. Skala, Algorithms for manipulating large geometric data, chapter 7.

    >>> import tempfile
    >>> points = np.random.default_rng(1).random((2000, 3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with build(points, folder + '/cube', attributes={'class': np.arange(2000) % 5}) as store:
    ...         print(len(store.points(where='class == 3')))
    400
    """
    given = checked(options, _BUILD_OPTIONS, 'build')
    if 'region' in given:
        given['region'] = as_region(given['region'])
    source, text = source_of(sources, transform, crs, nodata, attributes)
    if text is not None:
        given['crs'] = text
    path = os.fspath(store)
    if os.path.lexists(path) and not given.get('replace'):
        raise FileExistsError(errno.EEXIST, 'exists already; give another name or replace=True', path)
    _core.build(source, os.fsencode(path), given, job(progress, threads, memory))
    return Store(path)


class Store:
    """A store opened for reading: ``Store('alps.store')``; ``terrace.open`` and ``Store.open`` are the same. Any number of
    threads may use it at once; a fork of the process may too.

    Close it, or use it as a context manager; a closed store raises ValueError. Raises: FileNotFoundError; Error if the
    store is damaged or of a newer version.
    """

    def __init__(self, path):
        if isinstance(path, _core.OpenStore):  # a view of another store
            self._core = path
        else:
            path = os.fspath(path)
            try:
                self._core = _core.OpenStore(os.fsencode(path))
            except _core.Error as error:
                if not os.path.lexists(path):
                    raise FileNotFoundError(errno.ENOENT, 'there is no store here', path) from error
                raise
        self._info = self._core.info()

    @classmethod
    def open(cls, path):
        """Opens the store in a folder, as ``Store(path)`` does."""
        return cls(path)

    def close(self):
        """Work that other threads are at goes on to its end."""
        self._core.close()

    @property
    def closed(self):
        """Whether close() has been called."""
        return self._core.closed()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __len__(self):
        return self._info['points']

    def __repr__(self):
        info, name = self._info, os.path.basename(os.path.normpath(self._info['path']))
        levels = info['top'] + 1
        kind = f'raster of {info["columns"]} x {info["rows"]}' if info['grid'] else 'points'
        if info['crs']['epsg']:
            kind += f', EPSG:{info["crs"]["epsg"]}'
        return (f'<terrace.Store {name!r}: {info["points"]} points, {levels} level{"s" if levels > 1 else ""}, {kind}'
                f'{", closed" if self.closed else ""}>')

    def _repr_png_(self):
        if self.closed:
            return None
        try:
            return self.mesh(level=self.level_within(100_000))._repr_png_()
        except _core.Error:
            return None

    @property
    def info(self):
        """A dict: points, bytes, bounds (six numbers in the CRS, least first), crs, vertical, attributes, levels
        (level 0 first; points are those of that level and above), top, grid, columns and rows, transform (to the
        centres of cells), nodata (cells left out), parameters, checksum."""
        return json.loads(json.dumps(self._info))

    @property
    def bounds(self):
        """(min x, min y, min z, max x, max y, max z) in the CRS."""
        return tuple(self._info['bounds'])

    @property
    def top(self):
        """The coarsest level; level 0 has all points."""
        return self._info['top']

    def where(self, condition):
        """A view of the store: a Store that has only the points that meet a condition on attributes, x, y and z, such
        as 'classification == 2 && return_number == last'. What a store can answer a view answers for these points, as
        a store built of them alone would at level 0; a coarser level has those of its points that meet the condition.
        Only clusters(), models and views under a camera know nothing of conditions.

        The points are counted once, for which the clusters that may have some are read, with all attributes: 0.2 us for
        each of their points from a laser survey. A view reads the files of its store, but each of the two is closed by
        itself. Raises: Error for a bad condition, or if no point meets it.

        >>> import tempfile
        >>> points = np.random.default_rng(1).random((2000, 3))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with build(points, folder + '/cube', attributes={'class': np.arange(2000) % 5}) as store:
        ...         len(store.where('class == 3')), len(store.where('class == 3').where('z < 0.5'))
        (400, 181)
        """
        return Store(self._core.where(condition))

    def level_within(self, most_points):
        """The finest level of at most so many points; the top if none has so few."""
        return _core.level_within(self._core, whole(most_points, 'most_points'))

    def points(self, region=None, level=None, where=None, *, focus=(), cluster=None, crs=None, progress=None,
               threads=None):
        """The points of a level and above, inside a region, that meet a condition.

        region: a box of four or six numbers in the store's CRS, polygons (an object with ``__geo_interface__``, a
        GeoJSON dict or file) in the CRS that they name, or None. Polygons that name none are in longitude and latitude, as
        GeoJSON is, if the store's CRS is known and the numbers can be that; else in the store's. where: a condition on
        attributes, x, y and z, such as 'classification == 2 && z < 100'. focus: pairs (region, level) with finer levels.
        cluster: in place of region and focus, a pair (L, N): the points that cluster N of level L stands for. level: 0
        unless given; with a cluster, its own. crs: that the coordinates
        are wanted in.

        Returns: a structured array: x, y, z (float64), then the attributes with their types (float64 where they have
        a scale). ``xyz()`` gives its coordinates as an array (n, 3). Order: coarser levels first.
        """
        focus = list(focus)
        focuses, cluster = self._focuses(focus), self._cluster(cluster, region, focus)
        if level is None:
            level = cluster[0] if cluster else 0
        records = self._core.points(whole(level, 'level', bits=32), as_region(region), focuses, where or '', cluster,
                                    (crs_text(crs) or ''), job(progress, threads))
        return real_values(records, self._info['attributes'])

    @staticmethod
    def _cluster(cluster, region, focus):
        if cluster is None:
            return None
        if region is not None or len(focus):
            raise ValueError('give either `cluster` or `region` and `focus`')
        cluster = tuple(cluster)
        if len(cluster) != 2:
            raise ValueError('`cluster` is a pair of its level and its number there')
        return whole(cluster[0], 'cluster', bits=32), whole(cluster[1], 'cluster')

    @staticmethod
    def _focuses(focus):
        return [(as_region(place), whole(level, 'level', bits=32)) for place, level in focus]

    def clusters(self, level=0, *, progress=None, threads=None):
        """What is known of each cluster of a level. Returns: a structured array: bounds (six numbers in the CRS that
        hold all points below, a little more than they need), error (metres; no point below is farther from the
        representative), descendants (points of level 0 below), members. The number of a row is that of
        ``points(cluster=(level, number))``."""
        made = self._core.clusters(whole(level, 'level', bits=32), job(progress, threads))
        return made.view([('bounds', 'f8', 6), ('error', 'f8'), ('descendants', 'f8'), ('members', 'f8')]).reshape(-1)

    def count(self, box):
        """The number of points in a box of four or six numbers, of which only the border is read. Points within
        rounding of the border may count or not. Raises: ValueError for a rotated raster."""
        box = as_region(box)
        if not isinstance(box, tuple):
            raise ValueError('count() takes a box')
        return self._core.count(box)

    def own_region(self, region, crs):
        """A region of another CRS in that of the store: a GeoJSON dict of a MultiPolygon that names its CRS, with enough
        corners to keep outlines within a millionth of their length; without the heights of a box. Raises: Error if no operation
        converts from there."""
        text = crs_text(crs)
        if region is None or text is None:
            raise ValueError('own_region() needs a region and its CRS')
        polygons, name = _core.own_region(self._core, as_region(region), text)
        return {'type': 'MultiPolygon', 'crs': {'type': 'name', 'properties': {'name': name}},
                'coordinates': [[ring + ring[:1] for ring in polygon] for polygon in polygons]}

    def query(self, *, box=None, near=None, k=None, radius=None, level=0, where=''):
        """The points in a box, or near a place: the ``k`` nearest, or all within a ``radius`` in metres.

        near: (x, y) or (x, y, z) in the store's CRS; without z heights do not count in distances, which are in metres
        on the ground. where: a condition as in points(). Returns: a structured array as points() does; near a place
        the nearest first, with a field ``distance``.
        """
        if (box is None) == (near is None):
            raise ValueError('query() needs either `box` or `near`')
        level = whole(level, 'level', bits=32)
        if box is not None:
            if k is not None or radius is not None:
                raise ValueError('`k` and `radius` go with `near`')
            return self.points(region=box, level=level, where=where)
        if (k is None) == (radius is None):
            raise ValueError('`near` needs either `k` or `radius`')
        place = [float(number) for number in near]
        if k is not None:
            k = whole(k, 'k', 1)
        return real_values(self._core.near(place, k, radius, level, where), self._info['attributes'])

    def _sample(self, xy, method, level, max_edge, crs, progress, threads, memory):
        return _core.sample(self._core, as_rows(xy, 'xy', (2,)), method, whole(level, 'level', bits=32), max_edge, (crs_text(crs) or ''),
                            job(progress, threads, memory))

    def heights(self, xy, method='linear', *, level=0, max_edge=None, crs=None, progress=None, threads=None,
                memory=None):
        """Heights of the surface at places.

        xy: shape (n, 2), in the store's CRS or in ``crs``. method: 'linear' on the triangulated samples or the Delaunay
        triangulation of the points, 'natural' neighbours (Sibson), or 'nearest'. level: of the points that count.
        max_edge: metres; triangles with a longer side do not count (not for rasters at level 0).

        Returns: float64, shape (n,), in the store's vertical unit; NaN where there is no surface. Give many places
        at once: about a microsecond each, and the parts of the store around them are read.
        """
        return self._sample(xy, method, level, max_edge, crs, progress, threads, memory)[:, 0]

    def gradients(self, xy, method='linear', *, level=0, max_edge=None, crs=None, progress=None, threads=None,
                  memory=None):
        """Gradients of the surface at places, as heights(): float64, shape (n, 2), metres of height gained per metre
        on the ground going east and north (of the store's CRS)."""
        return self._sample(xy, method, level, max_edge, crs, progress, threads, memory)[:, 1:]

    def raster(self, value='height', *, cell=None, align=None, region=None, crs=None, method='linear', level=0, max_edge=None,
               path=None, replace=False, progress=None, threads=None, memory=None):
        """The surface on a grid: 'height', 'slope' (degrees), 'aspect' (degrees clockwise from north, downhill) or
        'hillshade' (1 to 255, 0 where there is none).

        cell: side of a cell in units of the output's CRS, at whose multiples cells begin, so that rasters of one cell size
        fit each other; by default a raster's own. align: in its place, the name of a raster whose cells, all of them, and
        CRS are taken. region: box or polygons. crs: of the output. path: where to write it as a Cloud Optimized GeoTIFF,
        with ``replace`` over what is there.

        Returns: a Raster: ``values``, ``transform``, ``crs``.
        """
        def make(name):
            _core.write_raster(self._core, os.fsencode(name), value, cell, b'' if align is None else os.fsencode(align),
                               as_region(region), (crs_text(crs) or ''), method, whole(level, 'level', bits=32),
                               max_edge, replace, job(progress, threads, memory))
            return read_raster(name)

        if path is not None:
            return make(os.fspath(path))
        with tempfile.TemporaryDirectory() as folder:
            return make(os.path.join(folder, 'raster.tif'))

    def profile(self, line, step=None, *, method='linear', level=0, max_edge=None, progress=None, threads=None):
        """The surface along a line.

        line: shape (n, 2), in the store's CRS, or a GeoJSON dict or an object with ``__geo_interface__`` of a LineString,
        in the CRS that points() takes a region in. step: metres;
        without it the line's own places and every place where the linear surface bends.

        Returns: float64, shape (m, 4): metres from the line's begin (geodesic where the CRS is known), x, y, height
        (NaN where there is none).
        """
        crs = None
        if hasattr(line, '__geo_interface__') or isinstance(line, dict):
            line, crs = geojson(line)
            line = np.asarray([place[:2] for place in line['coordinates']])
        return _core.profile(self._core, as_rows(line, 'line', (2,)), crs, step, method, whole(level, 'level', bits=32), max_edge,
                             job(progress, threads))

    def contours(self, interval, *, level=0, max_edge=None, region=None, lonlat=None, progress=None, threads=None,
                 memory=None):
        """Lines of equal height, every ``interval`` in the store's vertical unit.

        lonlat: True for longitude and latitude of WGS 84, as GeoJSON has them; False for the store's own x and y; by
        default the first where its CRS leads there, else the second, which is logged.

        Returns: a FeatureCollection (a dict, with ``__geo_interface__``) of LineStrings, each with its height as the
        property ``elev``; higher ground is on a line's right. Raises: Error if longitudes and latitudes are not known.
        """
        text, own = _core.contours(self._core, float(interval), whole(level, 'level', bits=32), max_edge, as_region(region),
                                   None if lonlat is None else bool(lonlat), job(progress, threads, memory))
        if own and lonlat is None:
            notes.info('contours are in the store\'s own x and y: nothing leads from its CRS to WGS 84')
        lines = FeatureCollection(json.loads(text))
        lines._units = _core.units(self._core) if own else _core.lonlat_units()
        return lines

    def mesh(self, level=None, region=None, *, focus=(), where=None, cluster=None, metric='euclidean', crs=None, max_points=None,
             smoothing=None, overlay=None, save_overlay=None, replace=False, progress=None, threads=None, memory=None):
        """The Delaunay triangulation of a level, with finer detail in focuses.

        Where a raster has no data there are no triangles, but for gaps narrower than the clusters beside them.

        level: by default the finest of at most ``max_points`` (100,000). region, focus, where, cluster, crs: as
        points(); the triangles that reach into the region come whole. metric: 'elliptical:FILE' lets triangles follow
        it. smoothing: a method of Delaunay2.smooth(), or a dict of ``method`` and its options; with a region inside it
        only. overlay: a file of other heights, which ``save_overlay`` writes: those that are not the store's, which
        never changes; with ``replace`` over what is there.

        Returns: a Mesh, which unpacks as (vertices, triangles).
        """
        focus = list(focus)
        cluster = self._cluster(cluster, region, focus)
        if level is None and cluster is not None and max_points is None:
            level = cluster[0]
        if level is None:
            level = self.level_within(100_000 if max_points is None else max_points)
        elif max_points is not None:
            raise ValueError('mesh() takes either `level` or `max_points`')
        heights = {'replace': bool(replace)}
        if smoothing is not None:
            heights['smoothing'] = _smoothing(**({'method': smoothing} if isinstance(smoothing, str) else smoothing))
        for name, path in (('overlay', overlay), ('save', save_overlay)):
            if path is not None:
                heights[name] = os.fsencode(path)
        return Mesh._of(_core.mesh(self._core, whole(level, 'level', bits=32), as_region(region), self._focuses(focus), where or '',
                                   cluster, metric, heights, (crs_text(crs) or ''), job(progress, threads, memory)))

    def lines(self, level=0, region=None, where=None, *, focus=(), progress=None, threads=None, memory=None):
        """The lines of a store that was built with ``entities`` 'segments' or 'polylines', of mixed levels of detail.

        level, region, where, focus: as points(); a piece is where its first vertex is. Returns: (lines, a list of
        float64 arrays of shape (n, 3), n >= 2; the number of each in the order in which they were read, int64): a line of which
        something is not wanted comes in several. Raises: ValueError for a store of something else. All in memory.
        """
        vertices, begins, numbers = _core.lines(self._core, whole(level, 'level', bits=32), as_region(region), self._focuses(focus),
                                                where or '', job(progress, threads, memory))
        return np.split(vertices, begins[1:-1]) if len(numbers) else [], numbers

    def surface(self, level=0, region=None, where=None, *, tetrahedra=False, progress=None, threads=None, memory=None):
        """The surface that a scan was taken from: of any shape, in space, through its points. All in memory.

        level, region, where: as points(). Returns: a Mesh, whose triangles are counter-clockwise seen from outside. Where
        the scan does not go all round, the surface is open. With ``tetrahedra`` (vertices, float64, shape (n, 3);
        those inside the closed surface, uint32, shape (m, 4)). Source: J. Skala, section 8.3.
        """
        made = _core.surface(self._core, whole(level, 'level', bits=32), as_region(region), where or '', bool(tetrahedra),
                             job(progress, threads, memory))
        return made if tetrahedra else Mesh._of(made)

    def bounded_mesh(self, max_error=None, *, max_points=None, quality='removal', duplicates='all', fill='none',
                     region=None, where=None, crs=None, path=None, replace=False, progress=None, threads=None, memory=None):
        """The mesh with the fewest triangles that is within ``max_error`` metres of every sample, verified on each,
        or the best of at most ``max_points`` vertices.

        quality: 'greedy', 'removal' or 'fitted', each with fewer triangles and more time. duplicates: which of samples
        at one place counts: 'all', 'min', 'max', 'mean', 'first', 'error'. fill: of a raster's cells without data:
        'none' leaves holes, 'flat', 'interpolate'. path: where to write it (.ply, .obj, .glb); other formats than PLY round
        numbers in their own way and get a mesh that is verified as they have it. crs: of the vertices, in place of the
        store's; the bound holds over its x and y. In .glb the coordinates are metres, see Mesh.save().

        Returns: a BoundedMesh: ``vertices``, ``triangles``, ``max_error``, ``rms_error``. It is made window by window
        in constant memory, but for the arrays.
        """
        if (max_error is None) == (max_points is None):
            raise ValueError('bounded_mesh() needs either `max_error` or `max_points`')
        options = {'quality': quality, 'duplicates': duplicates, 'fill': fill, 'region': as_region(region),
                   'where': where or '', 'replace': replace, 'crs': crs_text(crs) or ''}
        if max_error is not None:
            max_error = float(max_error)
            if not 0 <= max_error < math.inf:
                raise ValueError(f'`max_error` is a number of metres, not {max_error}')
            options['max_error'] = max_error
        else:
            options['max_points'] = whole(max_points, 'max_points', 3)
        how = job(progress, threads, memory)

        def make(name, say=None):
            measured = _core.bounded_mesh(self._core, os.fsencode(name), options, how)
            if say and measured['note']:
                say(measured['note'])
            if measured['triangles'] == 0:  # such a file is not read as a mesh
                return BoundedMesh(np.empty((0, 3)), np.empty((0, 3), np.uint32), measured)
            return BoundedMesh(*_core.read_mesh(os.fsencode(name))[:2], measured)

        if path is not None:
            path = os.fspath(path)
            if path.endswith('.ply'):
                return make(path, say=notes.info)
            note = _core.bounded_mesh(self._core, os.fsencode(path), options, how)['note']
            if note:
                notes.info(note)
        with tempfile.TemporaryDirectory() as folder:
            return make(os.path.join(folder, 'mesh.ply'))

    def tiles(self, folder, zooms=None, *, progress=None, threads=None, memory=None, **options):
        """Writes quantized-mesh tiles for web globes, and layer.json.

        zooms: (first, last); by default from 0 to the zoom that shows every sample. Options: ``max_error`` (metres at
        the deepest zoom), ``quality``, ``vertical`` ('recorded', 'ellipsoidal', 'orthometric', 'ignore'), ``geoid`` (a
        file), ``fill`` ('interpolate', 'flat' with ``flat_height``), ``water``, ``water_height``, ``normals``,
        ``metadata``, ``gzip``, ``name``, ``resume`` (keep what is up to date), ``replace``.

        Returns: a dict: tiles, bytes, made, kept, removed, zooms (zoom, tiles, max_error).
        """
        given = checked(options, _TILE_OPTIONS, 'tiles')
        if zooms is not None:
            given['first_zoom'], given['last_zoom'] = (whole(zoom, 'zooms', bits=32) for zoom in zooms)
        return _core.write_tiles(self._core, os.fsencode(folder), given, job(progress, threads, memory))

    def verify(self, *, progress=None, threads=None):
        """Checks every byte and invariant. Returns: a list of faults, empty if the store is sound."""
        return self._core.verify(job(progress, threads))

    @property
    def __geo_interface__(self):
        """The bounds in the CRS as a GeoJSON Polygon."""
        x0, y0, _, x1, y1, _ = self.bounds
        return {'type': 'Polygon', 'coordinates': (((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)),)}
