# SPDX-License-Identifier: Apache-2.0
"""Live views: a camera in, changes of the mesh out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar, overload

import numpy as np

from . import _core
from ._arrays import as_integer, as_numbered, as_numbers, as_rows
from ._call import thread_count
from ._geo import region as as_region
from ._mesh import Mesh
from ._names import ModelKind, ViewKind, ViewReader
from ._store import Store
from ._types import Array, ClusterId, Float64Array, Int32Array, Records, UInt32Array, UInt64Array


def _box(box: Array) -> list[float]:
    region = as_region(as_numbers(box, 'a box').ravel())
    return [float(number) for number in region or ()]


@dataclass(frozen=True)
class MeshDelta:
    """The changes of a mesh of mixed levels. Apply removals first: a reused number is in both lists.

    Numbers of vertices and triangles are small int32 values. Each stays the same while its vertex or triangle exists.
    """

    added_vertices: Int32Array  #: shape (n,)
    added_positions: Float64Array  #: shape (n, 3)
    removed_vertices: Int32Array
    moved_vertices: Int32Array  #: now represent another point
    moved_positions: Float64Array
    added_triangles: Int32Array  #: shape (m,)
    added_corners: Int32Array  #: shape (m, 3), vertex numbers, counter-clockwise
    removed_triangles: Int32Array

    def __repr__(self) -> str:
        return (f'<terrace.MeshDelta: {len(self.added_triangles)} triangles added, {len(self.removed_triangles)} removed, '
                f'{len(self.added_vertices)} and {len(self.removed_vertices)} vertices>')


@dataclass(frozen=True)
class VolumeDelta:
    """The changes of tetrahedra of mixed levels. Apply removals first: a reused number is in both lists.

    Numbers are as in MeshDelta.
    """

    added_vertices: Int32Array  #: shape (n,)
    added_positions: Float64Array  #: shape (n, 3)
    removed_vertices: Int32Array
    moved_vertices: Int32Array  #: now represent another point, at the same place
    moved_positions: Float64Array
    added_tetrahedra: Int32Array  #: shape (m,)
    added_corners: Int32Array  #: shape (m, 4), vertex numbers a, b, c, d with (b - a) x (c - a) . (d - a) > 0
    removed_tetrahedra: Int32Array

    def __repr__(self) -> str:
        return (f'<terrace.VolumeDelta: {len(self.added_tetrahedra)} tetrahedra added, {len(self.removed_tetrahedra)} removed, '
                f'{len(self.added_vertices)} and {len(self.removed_vertices)} vertices>')


Delta = TypeVar('Delta', MeshDelta, VolumeDelta)


@dataclass(frozen=True)
class ViewDelta(MeshDelta):
    """The MeshDelta since the last frame, in metres east, north and up from the centre of the store."""

    expanded: int  #: clusters
    collapsed: int
    missing: int  #: clusters that are needed but not read yet
    pending: int  #: clusters that were read but not shown for lack of time
    points: int  #: number of points now
    settled: bool  #: another frame with the same camera would change nothing

    def __repr__(self) -> str:
        return (f'<terrace.ViewDelta: {len(self.added_triangles)} triangles added, {len(self.removed_triangles)} removed, '
                f'{self.points} points{", settled" if self.settled else ""}>')


class View:
    """A store under a camera: finer where the camera looks, coarser elsewhere, within budgets of time and memory.

    Frames are in metres east, north and up, with the origin above the centre of the store at height 0. The first
    frame's delta contains the whole mesh.

    kind: 'mesh'; 'points', a cloud without triangles; or 'surface', for scans: the surface in space through the
        points.
    metric: 'elliptical:FILE' adapts the triangles of a mesh to a metric, as in Store.mesh(). A raster's mesh then shows
        all samples of each expanded cluster.
    reader: 'thread' reads ahead in the background; 'frame' reads within the time of a frame.
    max_points: the largest number of points at a time.
    max_bytes: the size of the cache of clusters.
    collapse_below: a cluster collapses when its error is below this fraction of the error at which it expands.
    guard: how far outside the picture clusters are kept, as a fraction of their distance.
    silhouette: the fraction of the allowed error to which outlines are held.
    stored: whether kind 'surface' shows the surface that is stored with the points (``build(surface=True)``), if there
        is one and ``silhouette`` is 1. It has only the vertices that the error needs, and its errors are distances from
        the full surface, exact for a ``ground_error`` with ``collapse_below=1``. The store is read at once, into about
        220 bytes per vertex. False: the points of expanded clusters are triangulated in space.

    Threads may share a view, one at a time. After a fork it raises ValueError.

    Source: J. Skala, Algorithms for manipulating large geometric data, section 8.4.
    """

    def __init__(self, store: Store, kind: ViewKind = 'mesh', *,
                 metric: str = 'euclidean', reader: ViewReader = 'thread', max_points: int = 1 << 22, max_bytes: int = 1 << 28,
                 collapse_below: float = 0.75, guard: float = 0.05, silhouette: float = 1.0,
                 stored: bool = True) -> None:
        if not isinstance(store, Store):
            raise TypeError(f'a view needs a terrace.Store, not {type(store).__name__}')
        options = {'max_points': as_integer(max_points, 'max_points'), 'max_bytes': as_integer(max_bytes, 'max_bytes'),
                   'collapse_below': float(collapse_below), 'guard': float(guard), 'silhouette': float(silhouette),
                   'stored': bool(stored)}
        self._core = _core.SharedView(store._core, kind, reader, metric, options)
        self._first = True
        self._points = 0

    def frame(self, position: Sequence[float] | None = None, direction: Sequence[float] = (0.0, 1.0, -0.5),
              up: Sequence[float] = (0.0, 0.0, 1.0), *, fov: float = 60.0, size: tuple[int, int] = (1920, 1080),
              ground_height: float | None = None, matrix: Array | None = None, pixel_error: float = 2.0,
              ground_error: float = float('inf'), focus: Iterable[tuple[Array, int]] = (),
              regions: Iterable[tuple[Array, float]] = (), seconds: float = 0.01) -> ViewDelta:
        """Moves the mesh towards what a camera needs, in at most about ``seconds``.

        position, direction, up: of the eye, three numbers each.
        fov: the vertical field of view in degrees.
        size: width and height of the picture in pixels.
        ground_height: the height of the picture in metres, for a camera without perspective.
        matrix: shape (4, 4), from metres to clip coordinates, row-major; replaces the arguments above except
            ``size``.
        pixel_error: the largest error in the picture, in pixels.
        ground_error: the largest error anywhere, in metres.
        focus: pairs of a box (four or six numbers in metres, minima first) and the level required in it.
        regions: pairs of a box and the largest error in it, in metres.

        Errors of a raster's mesh without a ``metric`` are vertical. Once the view has settled, ``ground_error`` and ``regions`` hold at every
        sample, for which all samples are read; ``pixel_error`` holds wherever the samples are read, and elsewhere the
        ranges of heights of clusters are estimates. Errors of other views are distances of the points left out from
        points that are shown.

        Returns: a ViewDelta.
        Raises: Error if a cluster is damaged.
        """
        width, height = size
        if not (width > 0 and height > 0):
            raise ValueError('`size` must be the width and height of a picture in pixels')
        if direction is None or up is None:
            raise TypeError('`direction` and `up` must be three numbers each')
        arrays = {'position': position, 'direction': direction, 'up': up, 'matrix': matrix}
        camera: dict[str, Any] = {name: None if value is None else as_numbers(value, name) for name, value in arrays.items()}
        delta = self._core.frame(
            {**camera, 'fov': fov, 'width': width, 'height': height,
             'ground_height': None if ground_height is None else float(ground_height), 'pixel_error': pixel_error,
             'ground_error': ground_error,
             'focus': [(_box(box), as_integer(level, 'level', bits=32)) for box, level in focus],
             'regions': [(_box(box), float(error)) for box, error in regions]}, float(seconds))
        if self._first:
            everything = self._core.snapshot()
            for name in ('expanded', 'collapsed', 'missing', 'pending'):
                everything[name] = delta[name]
            delta, self._first = everything, False
        self._points = delta['points']
        return ViewDelta(**delta)

    def restore(self, *, threads: int | None = None) -> ViewDelta:
        """Recomputes the surface of a scan, which frames only update locally. Call it when the camera rests.

        Returns: the ViewDelta to the new surface; an empty one for other kinds.
        """
        return ViewDelta(**self._core.restore(thread_count(threads)))

    def pin(self, cluster: ClusterId, expanded: bool | None) -> None:
        """Keeps a cluster, (level, number), expanded (True) or collapsed (False); None returns control to the camera.

        Raises: ValueError for a cluster that the store does not have.
        """
        level, number = cluster
        self._core.pin(as_integer(level, 'cluster', bits=32), as_integer(number, 'cluster'), None if expanded is None else bool(expanded))

    def attributes(self, vertices: Array) -> Records:
        """Returns the stored attributes of vertices as a structured array.

        The attributes of vertices that a frame added are available until the next frame.

        Raises: ValueError for a vertex that does not exist or whose attributes were dropped.
        """
        return self._core.attributes(as_numbered(vertices, 'vertices', most=2 ** 31 - 1))

    def to_metres(self, points: Array) -> Float64Array:
        """Converts points, shape (n, 3), from the store's CRS to metres in the frame of the view and its cameras."""
        return self._core.to_metres(as_rows(points, 'points', (3,)))

    def snapshot(self) -> ViewDelta:
        """Returns the whole current mesh as a ViewDelta that adds it."""
        return ViewDelta(**self._core.snapshot())

    @property
    def traffic(self) -> dict[str, int]:
        """A dict of the numbers of clusters, points and bytes read so far."""
        return dict(zip(('clusters', 'points', 'bytes'), self._core.traffic()))

    def __repr__(self) -> str:
        return f'<terrace.View: {self._points} points>'


class Multiresolution(Generic[Delta]):
    """The triangulation of a store's points at mixed levels, controlled cluster by cluster.

    expand() adds the members of a cluster; collapse() removes them and restores exactly the triangles that were there
    before. Every change returns a MeshDelta; the first one follows snapshot(). Clusters are pairs (level, number).
    Positions are in the store's CRS; points are triangulated in x and y, rasters in column and row. Threads may share
    one. A View controls such a triangulation with a camera.

    level: to start from, the top level by default.
    focus: as in set_detail().
    kind: 'mesh', or 'volume' for the Delaunay tetrahedra of the points in space, in metres on the ground (as if all of
        the store had the scale of its middle). Changes are then of the type VolumeDelta, and boxes of six numbers
        limit heights too.
    metric: 'elliptical:FILE' adapts the triangles of a mesh to a metric, as in Store.mesh().

    Triangles also cover areas of a raster without data, which those of Store.mesh() leave out.

    Raises: ValueError; Error for a damaged store, and then nothing has changed.

    Source: J. Skala, chapter 8.

    >>> import tempfile, terrace
    >>> folder = tempfile.TemporaryDirectory()
    >>> store = terrace.build(np.random.default_rng(1).random((4000, 3)), folder.name + '/cube', block_points=500)
    >>> model = Multiresolution(store)
    >>> delta = model.expand(model.children()[0])
    >>> len(delta.added_vertices) > 0, len(model.expanded)
    (True, 1)
    >>> volume = Multiresolution(store, kind='volume')
    >>> delta = volume.expand(volume.children()[0])
    >>> delta.added_corners.shape == (len(delta.added_tetrahedra), 4)
    True
    """

    @overload
    def __init__(self: Multiresolution[MeshDelta], store: Store, level: int | None = None, *,
                 focus: Iterable[tuple[Array, int]] = (), kind: Literal['mesh'] = 'mesh',
                 metric: str = 'euclidean') -> None: ...

    @overload
    def __init__(self: Multiresolution[VolumeDelta], store: Store, level: int | None = None, *,
                 focus: Iterable[tuple[Array, int]] = (), kind: Literal['volume']) -> None: ...

    def __init__(self, store: Store, level: int | None = None, *, focus: Iterable[tuple[Array, int]] = (),
                 kind: ModelKind = 'mesh', metric: str = 'euclidean') -> None:
        if not isinstance(store, Store):
            raise TypeError(f'a model needs a terrace.Store, not {type(store).__name__}')
        self._top, self._units = store.top, _core.units(store._core)
        self._core = _core.model(store._core, store.top if level is None else as_integer(level, 'level', bits=32),
                                 self._focuses(focus), kind, metric)
        self._cells = 'tetrahedra' if kind == 'volume' else 'triangles'
        self._delta: Any = VolumeDelta if kind == 'volume' else MeshDelta

    @staticmethod
    def _focuses(focus: Iterable[tuple[Array, int]]) -> list[tuple[list[float], int]]:
        return [(_box(box), as_integer(level, 'level', bits=32)) for box, level in focus]

    @staticmethod
    def _cluster(cluster: ClusterId) -> tuple[int, int]:
        level, number = cluster
        return as_integer(level, 'cluster', bits=32), as_integer(number, 'cluster')

    def expand(self, cluster: ClusterId) -> Delta:
        """Adds the members of a cluster whose parent is the root or an expanded cluster."""
        return self._delta(**self._core.expand(self._cluster(cluster)))

    def collapse(self, cluster: ClusterId) -> Delta:
        """Removes the members of a cluster, after those of the expanded clusters below it."""
        return self._delta(**self._core.collapse(self._cluster(cluster)))

    def refine(self, box: Array, level: int) -> Delta:
        """Expands clusters until a box (min x, min y, max x, max y) has all its points of ``level`` and above."""
        return self._delta(**self._core.set_region(_box(box), as_integer(level, 'level', bits=32), True, False))

    def coarsen(self, box: Array, level: int) -> Delta:
        """Collapses the clusters below ``level`` that are inside a box."""
        return self._delta(**self._core.set_region(_box(box), as_integer(level, 'level', bits=32), False, True))

    def set_detail(self, level: int, *, focus: Iterable[tuple[Array, int]] = ()) -> Delta:
        """Shows all points of ``level`` and above, and in each focus those of the focus's level and above.

        Other points are shown only if they share a cluster with these.

        focus: pairs (box, level).
        """
        return self._delta(**self._core.set_detail(as_integer(level, 'level', bits=32), self._focuses(focus)))

    def snapshot(self) -> Delta:
        """Returns everything as a delta that adds it."""
        return self._delta(**self._core.snapshot())

    @property
    def tetrahedra(self) -> tuple[Float64Array, UInt32Array]:
        """The current vertices, float64, shape (n, 3), and tetrahedra, uint32, shape (m, 4).

        Raises: ValueError for a mesh.
        """
        if self._cells != 'tetrahedra':
            raise ValueError("a mesh has no tetrahedra: pass kind='volume'")
        everything = self._core.snapshot()
        corners = np.searchsorted(everything['added_vertices'], everything['added_corners'])
        return everything['added_positions'], corners.astype(np.uint32)

    @property
    def mesh(self) -> Mesh:
        """The current triangulation as a Mesh.

        Raises: ValueError for a volume.
        """
        if self._cells != 'triangles':
            raise ValueError('a volume has no mesh: read `tetrahedra`')
        everything = self._core.snapshot()
        corners = np.searchsorted(everything['added_vertices'], everything['added_corners'])
        return Mesh._of((everything['added_positions'], corners.astype(np.uint32), self._core.levels(), self._units))

    @property
    def expanded(self) -> UInt64Array:
        """The expanded clusters, without the root: uint64, shape (n, 2), pairs of level and number."""
        return self._core.expanded()

    def children(self, cluster: ClusterId | None = None) -> UInt64Array:
        """Returns the clusters directly below an expanded one, by default the root: shape (n, 2)."""
        return self._core.children((self._top, 0) if cluster is None else self._cluster(cluster))

    def cluster_info(self, cluster: ClusterId) -> dict[str, Any]:
        """Describes a cluster that is expanded or can be.

        Returns: a dict with bounds (six numbers in the CRS: a box around all points below), error (metres; no point
            below is farther from the representative) and members.
        """
        return dict(zip(('bounds', 'error', 'members'), self._core.record(self._cluster(cluster))))

    def __len__(self) -> int:
        return self._core.count()[0]

    def __repr__(self) -> str:
        points, cells = self._core.count()
        return f'<terrace.Multiresolution: {points} points, {cells} {self._cells}, {len(self.expanded)} clusters expanded>'

    def _repr_png_(self) -> bytes | None:
        return self.mesh._repr_png_() if self._cells == 'triangles' else None
