# SPDX-License-Identifier: Apache-2.0
"""Live views: a camera in, changes of the mesh out."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_numbered, as_numbers, as_rows, whole
from ._geo import region as as_region
from ._matching import _threads
from ._mesh import Mesh
from ._store import Store


def _box(box):
    box = as_region(as_numbers(box, 'a box').ravel())
    return [float(number) for number in box]


@dataclass(frozen=True)
class MeshDelta:
    """What came and went in a mesh of mixed levels. Apply removals first: a reused number is on both sides.

    Numbers of vertices and triangles are int32, small, and stay the same as long as the thing is there.
    """

    added_vertices: np.ndarray  #: shape (n,)
    added_positions: np.ndarray  #: shape (n, 3)
    removed_vertices: np.ndarray
    moved_vertices: np.ndarray  #: stand for another point now
    moved_positions: np.ndarray
    added_triangles: np.ndarray  #: shape (m,)
    added_corners: np.ndarray  #: shape (m, 3), numbers of vertices, counter-clockwise
    removed_triangles: np.ndarray

    def __repr__(self):
        return (f'<terrace.MeshDelta: {len(self.added_triangles)} triangles came, {len(self.removed_triangles)} went, '
                f'{len(self.added_vertices)} and {len(self.removed_vertices)} vertices>')


@dataclass(frozen=True)
class ViewDelta(MeshDelta):
    """The MeshDelta since the last frame, in metres east, north and up from the middle of the store."""

    expanded: int  #: clusters
    collapsed: int
    missing: int  #: clusters that are wanted and not read yet
    pending: int  #: read, but the time was up
    points: int  #: that there are now
    settled: bool  #: another frame with the same camera would change nothing

    def __repr__(self):
        return (f'<terrace.ViewDelta: {len(self.added_triangles)} triangles came, {len(self.removed_triangles)} went, '
                f'{self.points} points{", settled" if self.settled else ""}>')


class View:
    """A store under a camera: finer where it looks, coarser where it has been, under budgets of time and memory.

    Frames are in metres east, north and up, with the origin above the middle of the store at height 0. The first
    frame's delta has all that there is.

    kind: 'mesh'; 'points' for a cloud without triangles; 'surface' for scans: the surface in space that the points lie
    on. reader: 'thread' reads ahead while frames go on, 'frame' within the frames' time. max_points: the most points at
    a time; max_bytes: of clusters that are kept in memory. collapse_below: a cluster collapses below this share of the
    error at which it expands. guard: how far outside the picture clusters stay, as a share of their distance.
    silhouette: outlines are held to this share of the error.

    Threads may share a view, one works on it at a time. After a fork it is of no use: ValueError.

    Source: J. Skala, Algorithms for manipulating large geometric data, section 8.4.
    """

    def __init__(self, store, kind='mesh', *, reader='thread', max_points=1 << 22, max_bytes=1 << 28, collapse_below=0.75, guard=0.05,
                 silhouette=1.0):
        if not isinstance(store, Store):
            raise TypeError(f'a view is of a terrace.Store, not of {type(store).__name__}')
        if not isinstance(kind, str) or kind not in ('mesh', 'points', 'surface'):
            raise ValueError(f'`kind` is one of mesh, points, surface, not {kind!r}')
        if not isinstance(reader, str) or reader not in ('thread', 'frame'):
            raise ValueError(f'`reader` is one of thread, frame, not {reader!r}')
        options = {'max_points': whole(max_points, 'max_points'), 'max_bytes': whole(max_bytes, 'max_bytes'),
                   'collapse_below': float(collapse_below), 'guard': float(guard), 'silhouette': float(silhouette)}
        self._core = _core.SharedView(store._core, kind, reader == 'frame', options)
        self._first = True
        self._points = 0

    def frame(self, position=None, direction=(0.0, 1.0, -0.5), up=(0.0, 0.0, 1.0), *, fov=60.0, size=(1920, 1080),
              ground_height=None, matrix=None, pixel_error=2.0, ground_error=float('inf'), focus=(), regions=(), seconds=0.01):
        """Brings the mesh nearer to what a camera asks for, in about ``seconds`` at most.

        position, direction, up: of the eye, three numbers each. fov: degrees from bottom to top. size: of the picture
        in pixels, width and height. ground_height: of the picture in metres, for a camera without perspective. matrix:
        in place of these, shape (4, 4), from metres to clip coordinates, row-major. pixel_error: the most that an error
        may measure in the picture. ground_error: metres, everywhere. focus: pairs of a box (four or six numbers,
        metres, least first) and the level that is wanted there. regions: pairs of a box and the most metres of error
        there.

        Returns: a ViewDelta. Raises: Error if a cluster is damaged.
        """
        width, height = size
        if not (width > 0 and height > 0):
            raise ValueError('`size` is the width and height of a picture in pixels')
        position, direction, up, matrix = (
            None if given is None else as_numbers(given, what) for what, given in
            (('position', position), ('direction', direction), ('up', up), ('matrix', matrix)))
        if direction is None or up is None:
            raise TypeError('`direction` and `up` are three numbers each')
        delta = self._core.frame(
            {'position': position, 'direction': direction, 'up': up, 'fov': fov, 'width': width, 'height': height,
             'ground_height': None if ground_height is None else float(ground_height), 'matrix': matrix, 'pixel_error': pixel_error,
             'ground_error': ground_error, 'focus': [(_box(box), whole(level, 'level', bits=32)) for box, level in focus],
             'regions': [(_box(box), float(error)) for box, error in regions]}, float(seconds))
        if self._first:
            whole_mesh = self._core.whole()
            for name in ('expanded', 'collapsed', 'missing', 'pending'):
                whole_mesh[name] = delta[name]
            delta, self._first = whole_mesh, False
        self._points = delta['points']
        return ViewDelta(**delta)

    def restore(self, *, threads=None):
        """Computes the surface of a scan afresh, which frames only follow, for a camera that rests. Returns: the
        ViewDelta that leads there; for other kinds an empty one."""
        return ViewDelta(**self._core.restore(_threads(threads)))

    def pin(self, cluster, expanded):
        """Keeps a cluster, (level, number), expanded (True) or collapsed (False) whatever the camera asks; None leaves
        it to the camera. Raises: ValueError for one that the store does not have."""
        level, number = cluster
        self._core.pin(whole(level, 'cluster', bits=32), whole(number, 'cluster'), None if expanded is None else bool(expanded))

    def attributes(self, vertices):
        """The attributes of vertices as they are stored, a structured array. Raises: ValueError for a vertex that is
        not there or whose attributes are no longer kept; those of what a frame has added are there until the next."""
        return self._core.attributes(as_numbered(vertices, 'vertices', most=2 ** 31 - 1))

    def to_metres(self, points):
        """Points of the store's CRS, shape (n, 3), as metres in the view's frame: where a camera is put."""
        return self._core.to_metres(as_rows(points, 'points', (3,)))

    def snapshot(self):
        """All that there is now, as a ViewDelta that adds it."""
        return ViewDelta(**self._core.whole())

    @property
    def traffic(self):
        """What has been read so far: a dict of clusters, points and bytes."""
        return dict(zip(('clusters', 'points', 'bytes'), self._core.traffic()))

    def __repr__(self):
        return f'<terrace.View: {self._points} points>'


class Multiresolution:
    """The triangulation of a store's points at mixed levels, cluster by cluster: expand() adds the members of a
    cluster, collapse() takes them out again and restores exactly the triangles that were there before. Positions are in
    the store's CRS; points are triangulated in x and y, rasters in column and row. A View does this for a camera.

    level: of the start, the top by default. focus: as set_detail(). Every change returns a MeshDelta; the first one
    follows snapshot(). Threads may share one. Clusters are pairs (level, number). Raises: ValueError; Error for a
    damaged store, and then nothing has changed. Source: J. Skala, chapter 8.

    >>> import tempfile, terrace
    >>> folder = tempfile.TemporaryDirectory()
    >>> store = terrace.build(np.random.default_rng(1).random((4000, 3)), folder.name + '/cube', block_points=500)
    >>> model = Multiresolution(store)
    >>> delta = model.expand(model.children()[0])
    >>> len(delta.added_vertices) > 0, len(model.expanded)
    (True, 1)
    """

    def __init__(self, store, level=None, *, focus=()):
        if not isinstance(store, Store):
            raise TypeError(f'a model is of a terrace.Store, not of {type(store).__name__}')
        self._top, self._units = store.top, _core.units(store._core)
        kind = _core.GridModel if store.info['grid'] else _core.PointModel
        self._core = kind(store._core, store.top if level is None else whole(level, 'level', bits=32), self._focuses(focus))

    @staticmethod
    def _flat(box):
        box = _box(box)
        return box[:2] + box[3:5]

    @classmethod
    def _focuses(cls, focus):
        return [(cls._flat(box), whole(level, 'level', bits=32)) for box, level in focus]

    @staticmethod
    def _cluster(cluster):
        level, number = cluster
        return whole(level, 'cluster', bits=32), whole(number, 'cluster')

    def expand(self, cluster):
        """Adds the members of a cluster that is below an expanded one or the root."""
        return MeshDelta(**self._core.expand(self._cluster(cluster)))

    def collapse(self, cluster):
        """Takes them out, and first those of expanded clusters below."""
        return MeshDelta(**self._core.collapse(self._cluster(cluster)))

    def refine(self, box, level):
        """Afterwards all points of ``level`` and above inside a box (min x, min y, max x, max y) are there."""
        return MeshDelta(**self._core.set_region(self._flat(box), whole(level, 'level', bits=32), True, False))

    def coarsen(self, box, level):
        """Collapses the clusters below ``level`` that lie inside a box."""
        return MeshDelta(**self._core.set_region(self._flat(box), whole(level, 'level', bits=32), False, True))

    def set_detail(self, level, *, focus=()):
        """All points of ``level`` and above, and in each focus, a pair (box, level), those of its level; and no others
        but those that share their clusters."""
        return MeshDelta(**self._core.set_detail(whole(level, 'level', bits=32), self._focuses(focus)))

    def snapshot(self):
        """All that there is now, as a MeshDelta that adds it."""
        return MeshDelta(**self._core.whole())

    @property
    def mesh(self):
        """What there is now, as a Mesh."""
        whole_mesh = self._core.whole()
        corners = np.searchsorted(whole_mesh['added_vertices'], whole_mesh['added_corners'])
        return Mesh._of((whole_mesh['added_positions'], corners.astype(np.uint32), self._core.levels(), self._units))

    @property
    def expanded(self):
        """The expanded clusters, without the root: uint64, shape (n, 2), of level and number."""
        return self._core.expanded()

    def children(self, cluster=None):
        """The clusters directly below an expanded one, by default the root: shape (n, 2)."""
        return self._core.children((self._top, 0) if cluster is None else self._cluster(cluster))

    def cluster_info(self, cluster):
        """A dict of what is known of a cluster that is, or can be, expanded: bounds (six numbers in the CRS that hold
        all points below), error (metres; no point below is farther from its representative), members."""
        return dict(zip(('bounds', 'error', 'members'), self._core.record(self._cluster(cluster))))

    def __len__(self):
        return self._core.count()[0]

    def __repr__(self):
        points, triangles = self._core.count()
        return f'<terrace.Multiresolution: {points} points, {triangles} triangles, {len(self.expanded)} clusters expanded>'

    def _repr_png_(self):
        return self.mesh._repr_png_()
