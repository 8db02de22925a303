# SPDX-License-Identifier: Apache-2.0
"""Builds stores from files and arrays, and queries them."""

from __future__ import annotations

import errno
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, overload

import numpy as np

from . import _core
from ._arrays import as_integer, as_rows
from ._call import call_settings, notes
from ._errors import Error
from ._geo import CoreRegion, FeatureCollection, geojson, region as as_region
from ._mesh import BoundedMesh, Mesh, surface_smoothing
from ._names import Duplicates, Fill, Interpolation, Quality, RasterValue, Smoothing, SurfaceSmoothing
from ._raster import Raster, read_raster
from ._sources import crs_text, source_of
from ._types import Array, ClusterId, Crs, Float64Array, Focuses, GeoInterface, Int64Array, Path, Progress, Records, Region, UInt32Array

_BUILD_OPTIONS = {
    'append', 'replace', 'input_format', 'skip_damaged', 'vertical', 'block_points', 'facility_cost', 'z_weight', 'channels',
    'outlier_price', 'band', 'cell', 'seed', 'datum_shift', 'where', 'keep', 'drop', 'resolution', 'metric',
    'region', 'effort', 'order', 'entities', 'method', 'heights_of_colour', 'surface', 'k', 'batch', 'search_threads',
}
_TILE_OPTIONS = {
    'name', 'max_error', 'geoid', 'flat_height', 'water', 'water_height', 'normals', 'metadata', 'gzip', 'resume',
    'replace', 'quality', 'vertical', 'fill',
}


def checked(options: dict[str, Any], known: set[str], function: str) -> dict[str, Any]:
    for name in options:
        if name not in known:
            raise TypeError(f'{function}() has no option {name!r}; it has {", ".join(sorted(known))}')
    return {name: value for name, value in options.items() if value is not None}


def xyz(points: Records) -> Float64Array:
    """Returns the coordinates of a structured array of points as an array of shape (n, 3), without a copy.

    Raises: TypeError, ValueError.
    """
    if not isinstance(points, np.ndarray):
        raise TypeError('`points` must be a structured array')
    fields = points.dtype.fields
    wanted = {axis: (np.dtype(np.float64), 8 * i) for i, axis in enumerate('xyz')}
    if points.ndim != 1 or fields is None or any(axis not in fields or fields[axis][:2] != wanted[axis] for axis in wanted):
        raise ValueError('`points` must have one dimension and begin with the float64 fields x, y and z')
    return np.lib.stride_tricks.as_strided(points['x'], (len(points), 3), (points.strides[0], 8))


def real_values(records: Records, attributes: list[dict[str, Any]]) -> Records:
    """Converts attributes that are stored with a scale or offset to real values (float64)."""
    scaled = {a['name']: a for a in attributes if a['scale'] != 1 or a['offset'] != 0}
    if not scaled:
        return records
    names = records.dtype.names or ()
    real = np.empty(records.shape, [(name, 'f8' if name in scaled else records.dtype[name]) for name in names])
    for name in names:
        real[name] = records[name]
        if name in scaled:
            real[name] *= scaled[name]['scale']
            real[name] += scaled[name]['offset']
    return real


def _smoothing(method: str = 'laplacian', iterations: int = 10, strength: float = 0.5, pass_band: float = 0.1,
               edge_height: float = 0.0) -> tuple[str, int, float, float, float]:
    return method, as_integer(iterations, 'iterations', bits=32), float(strength), float(pass_band), float(edge_height)


def _surface_smoothing(smoothing: SurfaceSmoothing | Mapping[str, Any] | None) -> tuple[str, int, float | None] | None:
    if smoothing is None:
        return None
    return surface_smoothing(**({'method': smoothing} if isinstance(smoothing, str) else smoothing))


def build(sources: Any, store: Path, *, transform: Iterable[float] | None = None, crs: Crs | None = None,
          nodata: float | None = None, attributes: Mapping[str, Array] | None = None, progress: Progress | None = None,
          threads: int | None = None, memory: int | None = None, **options: Any) -> Store:
    """Streams points or rasters once, in constant memory, into a store, and opens it.

    sources: a file name or several (GeoTIFF, LAS, LAZ, COPC, PLY, text and others; several rasters form a mosaic), or
        data in memory:

    - an array of shape (n, 3): points, optionally with ``attributes``, a dict of columns;
    - a structured array with fields x, y, z (or X, Y, Z) and others, a dict of columns, a ``pandas.DataFrame`` with
      such columns, a ``laspy.LasData`` or all or some of its ``points``;
    - an array of shape (rows, columns), masked or not: a raster, with ``transform`` (six numbers a, b, c, d, e, f
      from columns and rows of cell corners to x and y, as in rasterio) and ``nodata``. An array with three columns is
      a raster if ``transform`` is given;
    - an ``xarray.DataArray`` with rioxarray's accessor or attributes, a dataset of rasterio or GDAL, a Raster, any
      array with a ``transform`` (and ``crs``, ``nodata``);
    - a Mesh, or another object with ``vertices`` and ``triangles`` (or ``faces``): its vertices as points, and its
      triangles for ``surface``;
    - any other object with numpy's array interface, the buffer protocol or DLPack.

    Arrays are read in place. Points with a NaN or masked coordinate, and samples that are not finite, are left out
    and counted as nodata. Infinite coordinates are an error.

    store: the folder to create. It appears only when complete.
    crs: the CRS of the source, which overrides the one it declares: 'EPSG:n', a name, WKT, or an object with
        to_wkt().
    progress: None, True for a bar (tqdm's if installed), or a function called as progress(what, count, fraction,
        ended).
    threads: the number of threads; all cores by default.
    memory: in bytes; 256 MiB by default.

    Options for all sources:

    - ``replace``: overwrite an existing store.
    - ``append``: add the points to the store, which exists. It keeps its clusters, except the root, and its options of
      clustering. The points must match it as in merge(); samples that it has with the same value are left out.
    - ``where`` (such as 'classification == 2'), ``region`` (a box or polygons), ``keep`` and ``drop`` (names of
      attributes): the part of the source to read.
    - ``block_points`` (10000): the number of points that are clustered together.
    - ``facility_cost`` (3.0, a multiple of a block's diagonal), ``effort`` ('fast', 'default', 'fine' or 'full'),
      ``z_weight`` (of heights), ``metric`` ('euclidean', 'squared', 'minkowski:P' or 'elliptical:FILE'), ``channels``
      (pairs of an attribute and metres per unit), ``outlier_price`` and ``method``: the clustering, as in cluster().
    - ``k``, instead of facility_cost: k-median over the stream. The top level has k points (at most 10,000), the
      medians, and the clusters of the level below are theirs. Other levels are finer, so the store is larger.
    - ``batch`` and ``search_threads`` (1): for local searches (another method or metric, channels, entities), the
      number of candidates evaluated at once, and of threads that share the work on one block.
    - ``order``: 'auto', 'stream' or 'spatial'.
    - ``vertical``: 'ellipsoidal' or 'orthometric'.
    - ``surface``: whether a surface is stored with the points, for surface(): True for the triangles of a mesh, whose
      file is read twice, or, without faces, the surface that surface() restores. 'input' demands triangles, 'restored'
      ignores them. All points are then held in memory.
    - ``seed``: of random choices.

    Options for files: ``input_format``, ``entities``, ``skip_damaged``, ``band``, ``cell``, ``heights_of_colour``
    ('mapbox' or 'terrarium'), ``resolution``, ``datum_shift``.

    The store depends only on the source, the options and the seed. Assumptions about the data are logged to
    ``logging.getLogger('terrace')``.

    Returns: the opened Store.
    Raises: Error for bad data, OSError, ValueError, TypeError; KeyboardInterrupt on Ctrl-C. A failed build leaves no
        partial store.

    Source: J. Skala, Algorithms for manipulating large geometric data, chapter 7.

    >>> import tempfile
    >>> points = np.random.default_rng(1).random((2000, 3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with build(points, folder + '/cube', attributes={'class': np.arange(2000) % 5}) as store:
    ...         print(len(store.points(where='class == 3')))
    400
    """
    arguments = checked(options, _BUILD_OPTIONS, 'build')
    if 'region' in arguments:
        arguments['region'] = as_region(arguments['region'])
    source, text = source_of(sources, transform, crs, nodata, attributes)
    if text is not None:
        arguments['crs'] = text
    path = os.fspath(store)
    if arguments.get('append'):
        if not os.path.lexists(path):
            raise FileNotFoundError(errno.ENOENT, 'there is no store here', path)
    elif os.path.lexists(path) and not arguments.get('replace'):
        raise FileExistsError(errno.EEXIST, 'already exists; pass another name or replace=True', path)
    _core.build(source, os.fsencode(path), arguments, call_settings(progress, threads, memory))
    return Store(path)


def merge(stores: Iterable[Path], store: Path, *, replace: bool = False, progress: Progress | None = None,
          threads: int | None = None, memory: int | None = None) -> Store:
    """Joins stores into one that holds the points of all, without building them again, and opens it.

    Only the points of their top levels are read and clustered again. All other clusters are taken over as they are, by
    links to their files, or by copies on another file system, so the stores may be removed afterwards.

    stores: at least two folders, in any order, with the same kind of points, attributes, CRS and options (except the
        seed), and coordinates on one lattice. Rasters must not have values for the same cell.
    store: the folder to create. It appears only when complete.
    replace: overwrite an existing store.
    progress, threads, memory: as for build().

    The surface of a scan is left out.

    Returns: the opened Store.
    Raises: Error, naming both stores, if they do not fit together or are damaged; FileNotFoundError,
        FileExistsError; ValueError for fewer than two stores.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     parts = [folder + '/west', folder + '/east']
    ...     for x, part in enumerate(parts):
    ...         build(np.random.default_rng(1).random((2000, 3)) + [x, 0, 0], part).close()
    ...     with merge(parts, folder + '/all') as store:
    ...         print(store)
    <terrace.Store 'all': 4000 points, 1 level, points>
    """
    paths = [os.fspath(path) for path in stores]
    for path in paths:
        if not os.path.lexists(path):
            raise FileNotFoundError(errno.ENOENT, 'there is no store here', path)
    path = os.fspath(store)
    if os.path.lexists(path) and not replace:
        raise FileExistsError(errno.EEXIST, 'already exists; pass another name or replace=True', path)
    _core.merge([os.fsencode(part) for part in paths], os.fsencode(path), replace,
                call_settings(progress, threads, memory))
    return Store(path)


class Store:
    """A store opened for reading: ``Store('alps.store')``. ``terrace.open`` and ``Store.open`` do the same.

    ``path`` is a folder, or a URL of http, https or s3, of which only the bytes that are used are requested.

    Any number of threads may use it at once, and so may a fork of the process. Close it, or use it as a context
    manager; a closed store raises ValueError.

    Raises: FileNotFoundError; Error if the store is damaged or was written by a newer version.
    """

    def __init__(self, path: Path) -> None:
        if isinstance(path, _core.OpenStore):  # a view of another store
            self._core = path
        else:
            path = os.fspath(path)
            try:
                self._core = _core.OpenStore(os.fsencode(path))
            except Error as error:
                if not os.path.lexists(path) and '://' not in os.fsdecode(path):
                    raise FileNotFoundError(errno.ENOENT, 'there is no store here', path) from error
                raise
        self._info = self._core.info()

    @classmethod
    def open(cls, path: Path) -> Store:
        """Opens the store in a folder or at a URL, like ``Store(path)``."""
        return cls(path)

    def close(self) -> None:
        """Closes the store. Calls that are running in other threads still finish."""
        self._core.close()

    @property
    def closed(self) -> bool:
        """Whether close() has been called."""
        return self._core.closed()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self._info['points']

    def __repr__(self) -> str:
        info, name = self._info, os.path.basename(os.path.normpath(self._info['path']))
        levels = info['top'] + 1
        kind = f'raster of {info["columns"]} x {info["rows"]}' if info['grid'] else 'points'
        if info['crs']['epsg']:
            kind += f', EPSG:{info["crs"]["epsg"]}'
        return (f'<terrace.Store {name!r}: {info["points"]} points, {levels} level{"s" if levels > 1 else ""}, {kind}'
                f'{", closed" if self.closed else ""}>')

    def _repr_png_(self) -> bytes | None:
        if self.closed:
            return None
        try:
            return self.mesh(level=self.level_within(100_000))._repr_png_()
        except Error:
            return None

    @property
    def info(self) -> dict[str, Any]:
        """A dict that describes the store.

        points, bytes, top, checksum, parameters: of the whole store.
        bounds: six numbers in the CRS, minima first.
        crs, vertical, attributes: as recorded when it was built.
        levels: level 0 first; ``points`` counts the points on that level and above, ``segments`` the runs that wrote it.
        grid, columns, rows, transform: of a raster; the transform is to the centres of cells.
        nodata: the number of samples left out.
        surface: the numbers of vertices, triangles and bytes of the stored surface of a scan, or None.
        """
        return json.loads(json.dumps(self._info))

    @property
    def bounds(self) -> tuple[float, float, float, float, float, float]:
        """The bounding box (min x, min y, min z, max x, max y, max z) in the CRS."""
        x0, y0, z0, x1, y1, z1 = self._info['bounds']
        return x0, y0, z0, x1, y1, z1

    @property
    def top(self) -> int:
        """The coarsest level; level 0 has all points."""
        return self._info['top']

    def where(self, condition: str) -> Store:
        """Returns a view of the store: a Store with only the points that meet a condition.

        The view answers queries as a store built from these points alone would at level 0; a coarser level has those
        of its points that meet the condition. clusters(), Multiresolution and View do not support conditions.

        condition: on attributes, x, y and z, such as 'classification == 2 && return_number == last'.

        The points are counted once. For this the clusters that may contain some are read, with all attributes: 0.2
        microseconds for each of their points in a laser scan. A view reads the files of its store, but each is closed
        separately.

        Raises: Error for an invalid condition, or if no point meets it.

        >>> import tempfile
        >>> points = np.random.default_rng(1).random((2000, 3))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     with build(points, folder + '/cube', attributes={'class': np.arange(2000) % 5}) as store:
        ...         len(store.where('class == 3')), len(store.where('class == 3').where('z < 0.5'))
        (400, 181)
        """
        return Store(self._core.where(condition))

    def level_within(self, most_points: int) -> int:
        """Returns the finest level with at most ``most_points`` points; the top level if all have more."""
        return _core.level_within(self._core, as_integer(most_points, 'most_points'))

    def points(self, region: Region | None = None, level: int | None = None, where: str | None = None, *,
               focus: Focuses = (), cluster: ClusterId | None = None, crs: Crs | None = None,
               progress: Progress | None = None, threads: int | None = None) -> Records:
        """Returns the points of a level and above that are in a region and meet a condition.

        region: a box of four or six numbers in the store's CRS, polygons (an object with ``__geo_interface__``, a
            GeoJSON dict or file) in the CRS that they name, or None. Polygons without a CRS are in longitude and
            latitude, as GeoJSON is, if the store's CRS is known and the numbers are in range; otherwise in the
            store's CRS.
        level: 0 by default; with ``cluster``, the cluster's level.
        where: a condition on attributes, x, y and z, such as 'classification == 2 && z < 100'.
        focus: pairs (region, level) with finer levels.
        cluster: a pair (level, number): the points that this cluster represents. It replaces region and focus.
        crs: of the returned coordinates; by default the store's.

        Returns: a structured array: x, y, z (float64), then the attributes in their types (float64 if they have a
            scale). Coarser levels come first. ``xyz()`` returns its coordinates as an array of shape (n, 3).
        """
        focus = list(focus)
        focuses, cluster = self._focuses(focus), self._cluster(cluster, region, focus)
        if level is None:
            level = cluster[0] if cluster else 0
        records = self._core.points(as_integer(level, 'level', bits=32), as_region(region), focuses, where or '', cluster,
                                    crs_text(crs) or '', call_settings(progress, threads))
        return real_values(records, self._info['attributes'])

    @staticmethod
    def _cluster(cluster: ClusterId | None, region: Region | None, focus: list[tuple[Region, int]]) -> tuple[int, int] | None:
        if cluster is None:
            return None
        if region is not None or len(focus):
            raise ValueError('pass either `cluster` or `region` and `focus`')
        pair = tuple(cluster)
        if len(pair) != 2:
            raise ValueError('`cluster` must be a pair of a level and a number')
        return as_integer(pair[0], 'cluster', bits=32), as_integer(pair[1], 'cluster')

    @staticmethod
    def _focuses(focus: Focuses) -> list[tuple[CoreRegion | None, int]]:
        return [(as_region(place), as_integer(level, 'level', bits=32)) for place, level in focus]

    def clusters(self, level: int = 0, *, progress: Progress | None = None, threads: int | None = None) -> Records:
        """Describes each cluster of a level.

        Returns: a structured array with bounds (six numbers in the CRS: a slightly enlarged box around all points
            below), error (metres; no point below is farther from the representative), descendants (the number of
            points of level 0 below) and members. Row N describes the cluster ``points(cluster=(level, N))``.
        """
        result = self._core.clusters(as_integer(level, 'level', bits=32), call_settings(progress, threads))
        return result.view([('bounds', 'f8', 6), ('error', 'f8'), ('descendants', 'f8'), ('members', 'f8')]).reshape(-1)

    def count(self, box: Sequence[float]) -> int:
        """Counts the points in a box of four or six numbers, reading only clusters on its border.

        Points within rounding of the border may or may not count.

        Raises: ValueError for a rotated raster.
        """
        checked_box = as_region(box)
        if not isinstance(checked_box, tuple):
            raise ValueError('count() needs a box')
        return self._core.count(checked_box)

    def own_region(self, region: Region, crs: Crs) -> dict[str, Any]:
        """Converts a region from another CRS to the store's CRS.

        Corners are added so that outlines deviate by at most a millionth of their length. The heights of a box are
        dropped.

        Returns: a GeoJSON dict of a MultiPolygon that names its CRS.
        Raises: ValueError; Error if no operation connects the two systems.
        """
        text = crs_text(crs)
        if region is None or text is None:
            raise ValueError('own_region() needs a region and its CRS')
        polygons, name = _core.own_region(self._core, as_region(region), text)
        return {'type': 'MultiPolygon', 'crs': {'type': 'name', 'properties': {'name': name}},
                'coordinates': [[ring + ring[:1] for ring in polygon] for polygon in polygons]}

    def query(self, *, box: Sequence[float] | None = None, near: Sequence[float] | None = None, k: int | None = None,
              radius: float | None = None, level: int = 0, where: str = '') -> Records:
        """Returns the points in a box, or near a place: the ``k`` nearest, or all within a ``radius``.

        near: (x, y) or (x, y, z) in the store's CRS. Distances are in metres on the ground; they include heights only
            if z is given.
        radius: in metres.
        where: a condition as in points().

        Returns: a structured array as in points(). Near a place it is sorted by distance and has a field
            ``distance``.
        """
        if (box is None) == (near is None):
            raise ValueError('query() needs either `box` or `near`')
        level = as_integer(level, 'level', bits=32)
        if near is None:
            if k is not None or radius is not None:
                raise ValueError('`k` and `radius` need `near`')
            return self.points(region=box, level=level, where=where)
        if (k is None) == (radius is None):
            raise ValueError('`near` needs either `k` or `radius`')
        place = [float(number) for number in near]
        if k is not None:
            k = as_integer(k, 'k', 1)
        return real_values(self._core.near(place, k, radius, level, where), self._info['attributes'])

    def _surface(self, level: int | None, focus: Focuses) -> tuple[int, list[tuple[CoreRegion | None, int]]]:
        focuses = self._focuses(focus)
        if level is None:
            level = self.top if focuses else 0
        return as_integer(level, 'level', bits=32), focuses

    def _sample(self, xy: Array, method: Interpolation, level: int | None, focus: Focuses, max_error: float | None,
                max_edge: float | None, crs: Crs | None, progress: Progress | None, threads: int | None,
                memory: int | None) -> Float64Array:
        return _core.sample(self._core, as_rows(xy, 'xy', (2,)), method, *self._surface(level, focus), max_error, max_edge,
                            crs_text(crs) or '', call_settings(progress, threads, memory))

    def heights(self, xy: Array, method: Interpolation = 'linear', *, level: int | None = None, focus: Focuses = (),
                max_error: float | None = None, max_edge: float | None = None, crs: Crs | None = None,
                progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> Float64Array:
        """Returns the heights of the surface at places.

        Pass many places at once: each takes about a microsecond, and only the parts of the store around them are
        read.

        xy: shape (n, 2), in the store's CRS or in ``crs``.
        method: 'linear' on the triangulated samples of a raster or the Delaunay triangulation of points, 'natural'
            neighbours (Sibson), or 'nearest'.
        level: the points to use: those of this level and above. By default 0, or with ``focus`` the coarsest.
        focus: pairs (region, level) with finer levels, as in mesh(), which returns this surface. Inside a focus the
            heights are those of its level, up to about one point from its border; in a raster and for level 0, to the
            last bit where all samples within two columns and rows are inside.
        max_error: instead of a level: a surface of few triangles that is within this many metres of every sample,
            vertically. It needs the method 'linear' and excludes max_edge. Each window of about 512 x 512 samples with a
            place is triangulated.
        max_edge: in metres; triangles with a longer side are left out (not for rasters at level 0).

        Returns: float64, shape (n,), in the store's vertical unit; NaN where there is no surface.
        """
        return self._sample(xy, method, level, focus, max_error, max_edge, crs, progress, threads, memory)[:, 0]

    def gradients(self, xy: Array, method: Interpolation = 'linear', *, level: int | None = None, focus: Focuses = (),
                  max_error: float | None = None, max_edge: float | None = None, crs: Crs | None = None,
                  progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> Float64Array:
        """Returns the gradients of the surface at places, east and north in the store's CRS.

        The arguments are those of heights().

        Returns: float64, shape (n, 2), in metres of height per metre on the ground; NaN where there is no surface.
        """
        return self._sample(xy, method, level, focus, max_error, max_edge, crs, progress, threads, memory)[:, 1:]

    def raster(self, value: RasterValue = 'height', *, cell: float | None = None,
               align: Path | None = None, region: Region | None = None, crs: Crs | None = None, method: Interpolation = 'linear',
               level: int | None = None, focus: Focuses = (), max_error: float | None = None, max_edge: float | None = None,
               path: Path | None = None, replace: bool = False, progress: Progress | None = None, threads: int | None = None,
               memory: int | None = None) -> Raster:
        """Computes the surface, or a value derived from it, on a grid.

        value: 'height', 'slope' (degrees), 'aspect' (degrees clockwise from north, downhill) or 'hillshade' (1 to
            255, 0 where there is no surface).
        cell: the side of a cell in units of the output's CRS; a raster's own by default. Cells begin at multiples of
            it, so rasters with equal cells align.
        align: a raster file whose grid and CRS to use; replaces ``cell``.
        region: a box or polygons, as in points().
        crs: of the output; the store's by default.
        level, focus, max_error, max_edge: as in heights(). A raster with a focus of level 0 has the store's own cells by default.
        path: a Cloud Optimized GeoTIFF to write.
        replace: whether an existing file is overwritten.

        Returns: a Raster: ``values``, ``transform``, ``crs``.
        """
        def make(name: str) -> Raster:
            _core.write_raster(self._core, os.fsencode(name), value, cell, b'' if align is None else os.fsencode(align),
                               as_region(region), crs_text(crs) or '', method, *self._surface(level, focus), max_error, max_edge,
                               replace, call_settings(progress, threads, memory))
            return read_raster(name)

        if path is not None:
            return make(os.fspath(path))
        with tempfile.TemporaryDirectory() as folder:
            return make(os.path.join(folder, 'raster.tif'))

    def profile(self, line: Array | GeoInterface | Mapping[str, Any], step: float | None = None, *,
                method: Interpolation = 'linear', level: int | None = None, focus: Focuses = (), max_error: float | None = None,
                max_edge: float | None = None, progress: Progress | None = None, threads: int | None = None) -> Float64Array:
        """Returns the surface along a line.

        line: shape (n, 2), in the store's CRS; or a LineString as a GeoJSON dict or an object with
            ``__geo_interface__``, with the CRS rules of a region in points().
        step: in metres. By default the profile has the line's own vertices and every place where the linear surface
            bends.
        level, focus, max_error, max_edge: as in heights().

        Returns: float64, shape (m, 4): metres from the start of the line (geodesic if the CRS is known), x, y, height
            (NaN where there is no surface).
        """
        places: Any = line
        crs = None
        if hasattr(line, '__geo_interface__') or isinstance(line, dict):
            arguments, crs = geojson(line)
            places = np.asarray([place[:2] for place in arguments['coordinates']])
        return _core.profile(self._core, as_rows(places, 'line', (2,)), crs, step, method, *self._surface(level, focus), max_error,
                             max_edge, call_settings(progress, threads))

    def contours(self, interval: float, *, level: int | None = None, focus: Focuses = (), max_error: float | None = None,
                 max_edge: float | None = None, region: Region | None = None, lonlat: bool | None = None,
                 progress: Progress | None = None, threads: int | None = None,
                 memory: int | None = None) -> FeatureCollection:
        """Returns contour lines of the surface.

        interval: the height between contours, in the store's vertical unit.
        level, focus, max_error, max_edge: as in heights().
        lonlat: True for longitude and latitude in WGS 84, as GeoJSON requires; False for the store's x and y. By
            default longitude and latitude if the CRS can be converted to them; otherwise x and y, which is logged.

        Returns: a FeatureCollection (a dict, with ``__geo_interface__``) of LineStrings, each with its height in the
            property ``elev``. Higher ground is to the right of a line.
        Raises: Error if longitude and latitude are requested but not known.
        """
        text, own = _core.contours(self._core, float(interval), *self._surface(level, focus), max_error, max_edge,
                                   as_region(region), None if lonlat is None else bool(lonlat), call_settings(progress, threads, memory))
        if own and lonlat is None:
            notes.info('contours are in the store\'s own x and y: its CRS cannot be converted to WGS 84')
        lines = FeatureCollection(json.loads(text))
        lines._units = _core.units(self._core) if own else _core.lonlat_units()
        return lines

    def mesh(self, level: int | None = None, region: Region | None = None, *, focus: Focuses = (),
             where: str | None = None, cluster: ClusterId | None = None, metric: str = 'euclidean', crs: Crs | None = None,
             max_points: int | None = None, smoothing: Smoothing | Mapping[str, Any] | None = None, overlay: Path | None = None,
             save_overlay: Path | None = None, replace: bool = False, progress: Progress | None = None,
             threads: int | None = None, memory: int | None = None) -> Mesh:
        """Returns the Delaunay triangulation of a level, with finer detail in focuses.

        Areas of a raster without data have no triangles, unless they are narrower than the clusters next to them.

        level: by default the finest level with at most ``max_points`` points (100,000).
        region, focus, where, cluster, crs: as in points(). Triangles that reach into the region are not cut.
        metric: 'elliptical:FILE' adapts the triangles to a metric.
        smoothing: a method of Delaunay2.smooth(), or a dict of ``method`` and its options. With a region, only
            heights inside it are smoothed.
        overlay: a file of heights that replace the store's.
        save_overlay: a file to write, with the heights that differ from the store's. The store never changes.
        replace: whether an existing overlay file is overwritten.

        Returns: a Mesh, which unpacks as (vertices, triangles).
        """
        focus = list(focus)
        cluster = self._cluster(cluster, region, focus)
        if level is None and cluster is not None and max_points is None:
            level = cluster[0]
        if level is None:
            level = self.level_within(100_000 if max_points is None else max_points)
        elif max_points is not None:
            raise ValueError('mesh() accepts either `level` or `max_points`')
        heights: dict[str, Any] = {'replace': bool(replace)}
        if smoothing is not None:
            heights['smoothing'] = _smoothing(**({'method': smoothing} if isinstance(smoothing, str) else smoothing))
        for name, path in (('overlay', overlay), ('save', save_overlay)):
            if path is not None:
                heights[name] = os.fsencode(path)
        return Mesh._of(_core.mesh(self._core, as_integer(level, 'level', bits=32), as_region(region), self._focuses(focus), where or '',
                                   cluster, metric, heights, crs_text(crs) or '', call_settings(progress, threads, memory)))

    @overload
    def lines(self, level: int = 0, region: Region | None = None, where: str | None = None, *,
              properties: Literal[False] = False, focus: Focuses = (), progress: Progress | None = None,
              threads: int | None = None, memory: int | None = None) -> tuple[list[Float64Array], Int64Array]: ...

    @overload
    def lines(self, level: int = 0, region: Region | None = None, where: str | None = None, *,
              properties: Literal[True], focus: Focuses = (), progress: Progress | None = None,
              threads: int | None = None, memory: int | None = None
              ) -> tuple[list[Float64Array], Int64Array, dict[str, Float64Array]]: ...

    def lines(self, level: int = 0, region: Region | None = None, where: str | None = None, *,
              properties: bool = False, focus: Focuses = (), progress: Progress | None = None,
              threads: int | None = None, memory: int | None = None) -> tuple[Any, ...]:
        """Returns the lines of a store built with ``entities`` 'segments' or 'polylines', at mixed levels of detail.

        All lines are held in memory. A line is divided where parts of it are left out.

        level, region, where, focus: as in points(). A piece belongs to the region that contains its first vertex.

        properties: whether the numeric properties of the lines are returned too.

        Returns: (lines, a list of float64 arrays of shape (n, 3), n >= 2; numbers, int64, the position of each line
            in the input), followed by a dict of the properties' names and values (NaN if a line has none) if wanted.
        Raises: ValueError if the store has no lines.
        """
        vertices, begins, numbers, values = _core.lines(
            self._core, as_integer(level, 'level', bits=32), as_region(region), self._focuses(focus), where or '',
            call_settings(progress, threads, memory))
        lines = np.split(vertices, begins[1:-1]) if len(numbers) else []
        return (lines, numbers, values) if properties else (lines, numbers)

    @overload
    def surface(self, level: int | None = None, region: Region | None = None, where: str | None = None, *,
                cluster: ClusterId | None = None, tetrahedra: Literal[False] = False,
                smoothing: SurfaceSmoothing | Mapping[str, Any] | None = None,
                max_error: float | None = None, max_points: int | None = None, stored: bool = True,
                progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> Mesh: ...

    @overload
    def surface(self, level: int | None = None, region: Region | None = None, where: str | None = None, *,
                cluster: ClusterId | None = None, tetrahedra: Literal[True],
                max_error: None = None, max_points: None = None, stored: bool = True,
                progress: Progress | None = None, threads: int | None = None,
                memory: int | None = None) -> tuple[Float64Array, UInt32Array]: ...

    def surface(self, level: int | None = None, region: Region | None = None, where: str | None = None, *,
                cluster: ClusterId | None = None, tetrahedra: bool = False,
                smoothing: SurfaceSmoothing | Mapping[str, Any] | None = None,
                max_error: float | None = None, max_points: int | None = None, stored: bool = True,
                progress: Progress | None = None, threads: int | None = None,
                memory: int | None = None) -> Mesh | tuple[Float64Array, UInt32Array]:
        """Reconstructs the surface in space that a scan was taken from, through its points.

        The surface is open where the scan does not go all the way round. All points are held in memory.

        level, region, where: as in points().
        cluster: a pair (level, number): uses only the points of ``level`` (by default the cluster's; 0 for all) that
            this cluster represents. Not with a region.
        tetrahedra: whether to return the solid inside the closed surface instead.
        smoothing: removes noise: a method of Mesh.smoothed(), or a dict of ``method``, ``iterations`` and ``limit``,
            here in metres on the ground. Not with ``tetrahedra``.
        max_error: simplifies the surface through all points (level 0) within this distance in metres, measured from
            all vertices of the full surface and from about as many places on the triangles. Parts, holes and handles
            stay.
        max_points: instead of bounding the error, simplifies to at most this many vertices, as far as that is possible.
        stored: whether a surface that build(surface=True) has stored is used, without ``region``, ``where``, ``cluster``
            and ``tetrahedra``. Coarse levels of it do not tear; max_error and max_points leave more vertices than without.

        Returns: a Mesh with triangles counter-clockwise seen from outside; with ``tetrahedra`` (vertices, float64,
            shape (n, 3); tetrahedra, uint32, shape (m, 4)).

        Source: J. Skala, section 8.3.
        """
        cluster = self._cluster(cluster, region, [])
        if level is None:
            level = cluster[0] if cluster else 0
        result = _core.surface(self._core, as_integer(level, 'level', bits=32), as_region(region), where or '', cluster, bool(tetrahedra),
                             _surface_smoothing(smoothing),
                             None if max_error is None else float(max_error),
                             None if max_points is None else as_integer(max_points, 'max_points'),
                             bool(stored), call_settings(progress, threads, memory))
        return result if tetrahedra else Mesh._of(result)

    def bounded_mesh(self, max_error: float | None = None, *, max_points: int | None = None, quality: Quality = 'removal',
                     duplicates: Duplicates = 'all',
                     fill: Fill = 'none', region: Region | None = None,
                     where: str | None = None, crs: Crs | None = None, path: Path | None = None, replace: bool = False,
                     progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> BoundedMesh:
        """Returns a mesh with few triangles that is within ``max_error`` metres of every sample, verified on each.

        Give either max_error or max_points. The mesh is computed window by window; memory is constant apart from the
        result.

        max_points: instead of bounding the error, makes the best mesh with at most this many vertices.
        quality: 'greedy', 'removal' or 'fitted'. Each has fewer triangles than the one before and takes longer.
        duplicates: the sample to use of several at one place: 'all', 'min', 'max', 'mean', 'first' or 'error'.
        fill: a raster's cells without data: 'none' leaves holes; 'flat' and 'interpolate' fill them.
        region, where: as in points().
        crs: of the vertices; the store's by default. The bound holds over x and y in that CRS.
        path: a file to write: .ply, .obj or .glb. Formats other than PLY round numbers, and the mesh is verified as
            the file has it. Coordinates in .glb are in metres, see Mesh.save().

        Returns: a BoundedMesh: ``vertices``, ``triangles``, ``max_error``, ``rms_error``.
        """
        if (max_error is None) == (max_points is None):
            raise ValueError('bounded_mesh() needs either `max_error` or `max_points`')
        options: dict[str, Any] = {'quality': quality, 'duplicates': duplicates, 'fill': fill, 'region': as_region(region),
                   'where': where or '', 'replace': replace, 'crs': crs_text(crs) or ''}
        if max_error is not None:
            max_error = float(max_error)
            if not 0 <= max_error < math.inf:
                raise ValueError(f'`max_error` must be a number of metres, not {max_error}')
            options['max_error'] = max_error
        else:
            options['max_points'] = as_integer(max_points, 'max_points', 3)
        context = call_settings(progress, threads, memory)

        def make(name: str, say: Callable[[str], object] | None = None) -> BoundedMesh:
            measured = _core.bounded_mesh(self._core, os.fsencode(name), options, context)
            if say and measured['note']:
                say(measured['note'])
            if measured['triangles'] == 0:  # Mesh.read() refuses such a file
                return BoundedMesh(np.empty((0, 3)), np.empty((0, 3), np.uint32), measured)
            vertices, triangles, *_ = _core.read_mesh(os.fsencode(name))
            return BoundedMesh(vertices, triangles, measured)

        if path is not None:
            path = os.fspath(path)
            if path.endswith('.ply'):
                return make(path, say=notes.info)
            note = _core.bounded_mesh(self._core, os.fsencode(path), options, context)['note']
            if note:
                notes.info(note)
        with tempfile.TemporaryDirectory() as folder:
            return make(os.path.join(folder, 'mesh.ply'))

    def tiles(self, folder: Path, zooms: tuple[int, int] | None = None, *, progress: Progress | None = None,
              threads: int | None = None, memory: int | None = None, **options: Any) -> dict[str, Any]:
        """Writes quantized-mesh tiles for web globes, and layer.json.

        zooms: (first, last); by default from 0 to the zoom that shows every sample.
        options: ``max_error`` (metres at the deepest zoom), ``quality``, ``vertical`` ('recorded', 'ellipsoidal',
            'orthometric' or 'ignore'), ``geoid`` (a file), ``fill`` ('interpolate', or 'flat' with ``flat_height``),
            ``water``, ``water_height``, ``normals``, ``metadata``, ``gzip``, ``name``, ``resume`` (keep tiles that
            are up to date), ``replace``.

        Returns: a dict with tiles, bytes, made, kept, removed and zooms (zoom, tiles, max_error).
        """
        arguments = checked(options, _TILE_OPTIONS, 'tiles')
        if zooms is not None:
            arguments['first_zoom'], arguments['last_zoom'] = (as_integer(zoom, 'zooms', bits=32) for zoom in zooms)
        return _core.write_tiles(self._core, os.fsencode(folder), arguments, call_settings(progress, threads, memory))

    def verify(self, *, progress: Progress | None = None, threads: int | None = None) -> list[str]:
        """Checks every byte and invariant. Returns: a list of faults, empty if the store is sound."""
        return self._core.verify(call_settings(progress, threads))

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The bounds in the store's CRS as a GeoJSON Polygon."""
        x0, y0, _, x1, y1, _ = self.bounds
        return {'type': 'Polygon', 'coordinates': (((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)),)}
