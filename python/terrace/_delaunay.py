# SPDX-License-Identifier: Apache-2.0
"""Dynamic Delaunay triangulations in the plane and in space."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from . import _core
from ._arrays import as_array, as_integer, as_numbers, as_rows
from ._call import thread_count
from ._mesh import Mesh
from ._names import GradientMethod, Interpolation, ShapeCriterion, ShapeRule, Smoothing
from ._pictures import plane_png
from ._types import Array, Float64Array, Int32Array, Int64Array, Records

T = TypeVar('T')


def ellipse(a: float, b: float, angle: float = 0.0) -> Float64Array:
    """Returns the metric of an ellipse, shape (2, 2), in which vectors from its centre to its border have length 1.

    Edges of a triangulation in this metric tend to follow the long axis.

    a: the semi-axis along ``angle``, in degrees counter-clockwise from +x.
    b: the semi-axis across it.

    Raises: ValueError.

    Source: J. Skala, 4.1.2.

    >>> ellipse(4, 1)
    array([[0.25, 0.  ],
           [0.  , 1.  ]])
    """
    return np.array(_core.ellipse_map(float(a), float(b), float(angle))).reshape(2, 2)


def ellipsoid(semi_axes: Array, axes: Array = ((1, 0, 0), (0, 1, 0), (0, 0, 1))) -> Float64Array:
    """Returns the metric of an ellipsoid, shape (3, 3).

    semi_axes: three lengths, each along the corresponding row of ``axes``.
    axes: three orthonormal rows.

    Raises: ValueError.
    """
    lengths, axes = as_numbers(semi_axes, 'semi_axes'), as_numbers(axes, 'axes')
    if lengths.shape != (3,) or axes.shape != (3, 3):
        raise ValueError('an ellipsoid needs three semi-axes, and axes of shape (3, 3)')
    return np.array(_core.ellipsoid_map(lengths.tolist(), axes.ravel().tolist())).reshape(3, 3)


def _map(metric: Array, width: int) -> list[float]:
    array = as_numbers(metric, 'metric')
    if array.shape != (width, width):
        raise ValueError(f'`metric` must have the shape ({width}, {width}), not {array.shape}')
    return array.ravel().tolist()


def _handles(value: Array) -> Int32Array:
    vertices = as_array(value, 'vertices')
    if vertices.dtype.kind not in 'iu' and vertices.size > 0:
        raise TypeError(f'vertices must be whole numbers, not {vertices.dtype}')
    vertices = np.atleast_1d(vertices)
    if vertices.size and (vertices.min() < 0 or vertices.max() > np.iinfo(np.int32).max):
        raise ValueError('a vertex number is negative or too large')
    return vertices.astype(np.int32)


@dataclass(frozen=True)
class MeshChanges:
    """The net changes of a triangulation between two moments.

    Simplices are given by their corners, as vertex numbers. Apply removals first: a reused number is in both lists.
    """

    added_vertices: Int32Array
    removed_vertices: Int32Array
    removed_points: Float64Array  #: the position of each of removed_vertices
    added_simplices: Int32Array  #: shape (n, 3), or (n, 4) for tetrahedra
    removed_simplices: Int32Array

    def __repr__(self) -> str:
        return (f'<terrace.MeshChanges: {len(self.added_vertices)} vertices and {len(self.added_simplices)} simplices added, '
                f'{len(self.removed_vertices)} and {len(self.removed_simplices)} removed>')


class _Numbers:
    """Maps vertex numbers, which users see, to slots of the core, which orders vertices differently.

    A reused slot keeps its number. The first points inserted are numbered by their rows, from 0. Of equal points the
    first one is the vertex; the others are copies, whose numbers belong to no vertex.
    """

    def __init__(self) -> None:
        self._of_slot = np.empty(0, np.int32)  # the number of each slot, -1 for none
        self._slots = np.empty(0, np.int32)  # the slot of each number, -1 for a copy
        self._copies = np.empty((0, 2), np.int32)  # pairs: the number of a copy, the number of its vertex

    def __len__(self) -> int:
        return len(self._slots)

    def take(self, slots: Int32Array) -> Int32Array:
        """Numbers slots that were just filled and returns the numbers, in the order of the points."""
        first_points = len(self._slots) == 0
        most = int(slots.max(initial=-1)) + 1
        if most > len(self._of_slot):
            self._of_slot = np.append(self._of_slot, np.full(max(most, 2 * len(self._of_slot)) - len(self._of_slot), -1, np.int32))
        if first_points:
            distinct, rows = np.unique(slots, return_index=True)
            self._slots = np.full(len(slots), -1, np.int32)
            self._slots[rows] = distinct
            self._of_slot[distinct] = rows
            copies = np.flatnonzero(self._slots < 0)
            self._copies = np.column_stack((copies, self._of_slot[slots[copies]])).astype(np.int32)
        else:
            distinct, rows = np.unique(slots[self._of_slot[slots] < 0], return_index=True)
            distinct = distinct[np.argsort(rows)]
            self._of_slot[distinct] = np.arange(len(self._slots), len(self._slots) + len(distinct))
            self._slots = np.append(self._slots, distinct)
        return self._of_slot[slots]

    def take_all(self, first: int, count: int) -> None:
        """Numbers ``count`` consecutive slots from 0, starting with slot ``first``."""
        self._slots = np.arange(first, first + count, dtype=np.int32)
        self._of_slot = np.append(np.full(first, -1, np.int32), np.arange(count, dtype=np.int32))

    def forget_copies(self, vertices: Int32Array) -> None:
        """Forgets the copies of vertices that were removed."""
        if len(self._copies):
            self._copies = self._copies[~np.isin(self._copies[:, 1], vertices)]

    def of(self, slots: Int32Array) -> Int32Array:
        """Returns the numbers of slots, in the same shape; -1 for a slot of -1."""
        filled = slots[slots >= 0]
        if filled.size and (filled.max() >= len(self._of_slot) or self._of_slot[filled].min() < 0):
            self.take(np.unique(filled))  # an insertion was interrupted before take()
        return np.where(slots < 0, np.int32(-1), self._of_slot[slots]) if filled.size else slots

    def all_slots(self) -> Int32Array:
        """Returns the slot of each number; -1 for a copy."""
        return self._slots

    def slots_of(self, numbers: Int32Array) -> Int32Array:
        """Returns the slots of numbers. Raises: ValueError for a number that never belonged to a vertex."""
        for number in numbers[(numbers >= len(self._slots)) | (numbers < 0)]:
            raise ValueError(f'there is no vertex {number}')
        slots = self._slots[numbers]
        for number in numbers[slots < 0]:
            raise ValueError(f'there is no vertex {number}: this point equals an earlier one, whose number is in `ids`')
        return slots

    def by_number(self, rows: Float64Array) -> Float64Array:
        """Reorders rows from slots to numbers; a copy gets the row of its vertex."""
        result = np.full((len(self._slots), *rows.shape[1:]), np.nan)
        used = (self._slots >= 0) & (self._slots < len(rows))
        result[used] = rows[self._slots[used]]
        result[self._copies[:, 0]] = result[self._copies[:, 1]]
        return result

    def by_slot(self, values: Float64Array) -> Float64Array:
        """Reorders values, shape (n,), from numbers to slots.

        Raises: ValueError unless there is one for each number.
        """
        if values.ndim != 1 or len(values) < len(self._slots):
            raise ValueError(f'there are `values` of the shape {values.shape} for {len(self._slots)} vertex numbers; '
                             'use by_vertex() to order them')
        result = np.full(max(len(self._of_slot), 1), np.nan)  # the core has one slot that is not a vertex
        used = self._slots >= 0
        result[self._slots[used]] = values[:len(self._slots)][used]
        return result


class _PointMesh:
    """A set of vertices that changes, and the simplices between them.

    Vertices have numbers. Points passed to the constructor are numbered by their rows, as in SciPy: 0, 1, ... Points
    inserted later get the numbers that follow, or reuse free ones. ``ids``, insert() and ``simplices`` return such
    numbers, remove() and all other methods accept them, and ``points`` has a row for each.
    """

    _width = 0
    _simplices = ''
    _core: Any

    def __init__(self) -> None:
        #: The vertex of each point passed to the constructor: its row, or the row of the first equal point.
        self.ids: Int32Array = np.empty(0, np.int32)
        self._numbers = _Numbers()
        self._lock = threading.RLock()  # keeps the core and the numbers consistent

    def insert(self, points: Array) -> Int32Array:
        """Inserts points, many in one call faster than one by one.

        points: shape (n, 2) in the plane or (n, 3) in space.

        Returns: int32, shape (n,): the vertex of each point, the same one for equal points.
        Raises: ValueError for a coordinate that is not finite; then nothing has changed. After Ctrl-C the points that
            were inserted before it stay.
        """
        points = as_rows(points, 'points', (self._width,))
        with self._lock:
            return self._numbers.take(self._core.insert(points))

    def remove(self, vertices: Array) -> None:
        """Removes vertices, all different.

        The result is the triangulation of the remaining vertices, independent of history.

        Raises: ValueError for a vertex that does not exist; then nothing has changed. After Ctrl-C the vertices that
            were removed before it are missing.
        """
        vertices = _handles(vertices)
        with self._lock:
            try:
                self._of_vertices(vertices, self._core.remove)
            except KeyboardInterrupt:
                stays = np.isin(self._numbers.slots_of(vertices), self._core.vertices())
                self._numbers.forget_copies(vertices[~stays])
                raise
            self._numbers.forget_copies(vertices)

    def _of_vertices(self, vertices: Int32Array, work: Callable[[Int32Array], T]) -> T:
        """Returns work(slots).

        Raises: ValueError, with the caller's number, for a vertex that is missing or named twice.
        """
        found, counts = np.unique(vertices, return_counts=True)
        for number in found[counts > 1]:
            raise ValueError(f'vertex {number} is named twice')
        slots = self._numbers.slots_of(vertices)
        try:
            return work(slots)
        except ValueError:
            for number in vertices[~np.isin(slots, self._core.vertices())]:
                raise ValueError(f'there is no vertex {number}') from None
            raise

    @property
    def points(self) -> Float64Array:
        """Coordinates by vertex number, float64, starting with the points of the constructor.

        Rows of removed vertices are NaN.
        """
        with self._lock:
            return self._numbers.by_number(self._core.points())

    @property
    def vertices(self) -> Int32Array:
        """The numbers of all current vertices, int32, ascending."""
        with self._lock:
            return np.sort(self._numbers.of(self._core.vertices()))

    @property
    def simplices(self) -> Int32Array:
        """The corners of all triangles or tetrahedra, int32, as vertex numbers.

        ``points[simplices]`` gives their coordinates, as in SciPy. Triangles are counter-clockwise; a tetrahedron (a,
        b, c, d) has a, b, c counter-clockwise seen from d.
        """
        with self._lock:
            return self._numbers.of(self._core.simplices())

    def record(self) -> None:
        """Starts recording for changes(). Anything recorded before is discarded."""
        self._core.start_journal()

    def changes(self) -> MeshChanges:
        """Returns the net MeshChanges since record() or the previous call, in time proportional to their number.

        Raises: ValueError unless record() was called.
        """
        with self._lock:
            changes = self._core.take_changes()
            return MeshChanges(**{name: rows if name == 'removed_points' else self._numbers.of(rows) for name, rows in changes.items()})

    def digest(self) -> int:
        """Returns a hash of the set of simplices by their coordinates, independent of history."""
        return self._core.hash()

    def __len__(self) -> int:
        return self._core.size()

    def __repr__(self) -> str:
        return f'<terrace.{type(self).__name__}: {len(self)} vertices, {self._core.count()} {self._simplices}>'


class _Delaunay(_PointMesh):
    _kind: Any
    _elliptical_kind: Any

    def __init__(self, points: Array | None = None, *, metric: Array | None = None) -> None:
        super().__init__()
        self._elliptical = metric is not None
        self._core = self._kind() if metric is None else self._elliptical_kind(_map(metric, self._width))
        if points is not None:
            self.ids = self.insert(points)

    @property
    def vertex_neighbor_vertices(self) -> tuple[Int64Array, Int32Array]:
        """The vertices joined to each vertex by an edge, as in SciPy, counter-clockwise in the plane.

        Returns: (begins, int64, the offset of each vertex's neighbours; vertices, int32).
        """
        with self._lock:
            begins, joined = self._core.adjacent()
            slots = self._numbers.all_slots()
            known = (slots >= 0) & (slots < len(begins) - 1)
            from_, counts = np.zeros(len(slots), np.int64), np.zeros(len(slots), np.int64)
            from_[known], counts[known] = begins[slots[known]], np.diff(begins)[slots[known]]
            ends = np.append(0, np.cumsum(counts))
            return ends, self._numbers.of(joined[np.repeat(from_ - ends[:-1], counts) + np.arange(ends[-1])])

    @property
    def neighbors(self) -> Int32Array:
        """The row in ``simplices`` of each simplex's neighbour opposite to each corner, -1 outside the hull."""
        return self._core.neighbours()

    def find_simplex(self, points: Array) -> Int32Array:
        """Returns the row in ``simplices`` of a simplex that contains each point, -1 outside the hull."""
        return self._core.find_simplex(as_rows(points, 'points', (self._width,)))

    def nearest(self, points: Array) -> Int32Array:
        """Returns the vertex nearest to each point, exactly; -1 if there are no vertices."""
        points = as_rows(points, 'points', (self._width,))
        with self._lock:
            return self._numbers.of(self._core.nearest(points))

    def by_vertex(self, values: Array) -> Float64Array:
        """Reorders values of the constructor's points by vertex number: float64, NaN for other vertices.

        Of several equal points the last one's value is used.

        Raises: ValueError unless there is one value for each point.
        """
        values = as_numbers(values, 'values')
        if values.shape != self.ids.shape:
            raise ValueError(f'there are `values` of the shape {values.shape} for {len(self.ids)} points')
        with self._lock:
            result = np.full(len(self._numbers), np.nan)
        result[self.ids] = values
        return result

    def _values(self, values: Array) -> Float64Array:
        """Returns values in the order that the core expects. The caller must hold the lock."""
        return self._numbers.by_slot(as_numbers(values, 'values'))

    def _euclidean(self) -> Any:
        if self._elliptical:
            raise ValueError('triangulations with a `metric` do not support this')
        return self._core

    def _regions(self, regions: Iterable[tuple[Array, Array]]) -> list[tuple[list[float], list[float], list[float]]]:
        checked = []
        for value, metric in regions:
            box = as_numbers(value, 'a box')
            if box.shape != (2 * self._width,):
                raise ValueError(f'a box must be {2 * self._width} numbers: the minima, then the maxima')
            checked.append((box[:self._width].tolist(), box[self._width:].tolist(), _map(metric, self._width)))
        return checked


class Delaunay2(_Delaunay):
    """The Delaunay triangulation of points in the plane: exact, dynamic, and determined by the point set alone.

    Ties between cocircular points are broken by a symbolic perturbation, so inserting a point and removing it again
    restores the same triangles. Takes about a microsecond per point. Threads may share one.

    metric: None, or an invertible map of shape (2, 2), such as ellipse(). Lengths are those of mapped vectors, and
        the triangles are exactly those of the points mapped without rounding.

    >>> d = Delaunay2([[0, 0], [1, 0], [0, 1], [1, 1]])
    >>> d
    <terrace.Delaunay2: 4 vertices, 2 triangles>
    >>> before = d.digest()
    >>> middle = d.insert([[0.5, 0.4]])
    >>> len(d.simplices)
    4
    >>> d.remove(middle)
    >>> d.digest() == before
    True
    """

    _width, _simplices = 2, 'triangles'
    _kind = _core.SharedDelaunay2
    _elliptical_kind = _core.EllipticalDelaunay2

    @classmethod
    def of_grid(cls, columns: int, rows: int, origin: Sequence[float] = (0.0, 0.0), step: float = 1.0) -> Delaunay2:
        """Returns the triangulation of a complete grid, written directly in O(n).

        The vertex of column i and row j has the number j * columns + i.

        origin: the position of column 0 and row 0.
        step: the positive distance between neighbours, along rows to +x and between rows to +y.

        Raises: ValueError unless all coordinates are exact in double precision.

        >>> Delaunay2.of_grid(3, 2)
        <terrace.Delaunay2: 6 vertices, 4 triangles>
        """
        x, y = map(float, origin)
        result = cls()
        columns, rows = as_integer(columns, 'columns'), as_integer(rows, 'rows')
        if columns * rows > 2 ** 29:
            raise ValueError('a triangulation can have at most 2^29 vertices')
        first = result._core.build_grid(x, y, float(step), columns, rows)
        if columns * rows:
            result._numbers.take_all(first, columns * rows)
            result.ids = np.arange(columns * rows, dtype=np.int32)
        return result

    def weights(self, places: Array, method: Interpolation = 'linear') -> tuple[Float64Array, Int32Array, Int64Array]:
        """Returns the weights with which heights() combines the values of vertices at places.

        places, method: as in heights().

        Returns: (weights, float64; vertices, int32; begins, int64, the offset of each place): the data of a
            ``scipy.sparse.csr_matrix`` of shape (len(places), len(points)). Weights are not negative and add up to 1.
            Places outside the hull have none, except with 'nearest'.
        Raises: ValueError.

        Source: R. Sibson, 1980.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> weights, vertices, begins = d.weights([[0.25, 0.5], [9, 9]])
        >>> weights @ d.points[vertices], begins
        (array([0.25, 0.5 ]), array([0, 3, 3]))
        """
        places = as_rows(places, 'places', (2,))
        with self._lock:
            weights, vertices, begins = _core.weights_at(self._euclidean(), places, method)
            return weights, self._numbers.of(vertices), begins

    def vertical_distances(self, values: Array, samples: Array, method: Interpolation = 'linear', *,
                           threads: int | None = None) -> dict[str, Any]:
        """Measures how far samples that are not in the triangulation are above or below its surface.

        values, method: as in heights().
        samples: shape (n, 3).

        Returns: a dict with count (samples measured), outside (samples outside the hull, or where a height is NaN),
            max, mean and rms of the absolute distances, bias (the mean of sample minus surface) and worst (the index
            of the sample at ``max``, -1 for none).
        Raises: ValueError.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> d.vertical_distances(d.by_vertex([1, 2, 3]), [[0.25, 0.5, 3]])['bias']
        0.75
        """
        with self._lock:
            return _core.vertical_distances(self._euclidean(), self._values(values), as_rows(samples, 'samples', (3,)), method,
                                            thread_count(threads))

    def heights(self, values: Array, places: Array, method: Interpolation = 'linear', *, threads: int | None = None) -> Float64Array:
        """Interpolates heights at places between vertices, in about 0.4 microseconds each.

        values: the height of each vertex by its number, see by_vertex().
        places: shape (n, 2).
        method: 'linear', 'natural' (Sibson's natural neighbours) or 'nearest'.

        Returns: float64, shape (n,); NaN outside the hull, except with 'nearest'.
        Raises: ValueError.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> d.heights(d.by_vertex([1, 2, 3]), [[0.25, 0.5]])
        array([2.25])
        """
        with self._lock:
            return _core.heights_at(self._euclidean(), self._values(values), as_rows(places, 'places', (2,)), method,
                                    thread_count(threads))

    def gradients(self, values: Array, places: Array, method: GradientMethod = 'linear', *,
                  threads: int | None = None) -> Float64Array:
        """Returns the slope towards +x and towards +y at places, shape (n, 2), as height per unit of length.

        method: 'linear' for the triangles' slope, or 'natural' for natural neighbours.

        Places outside the hull get NaN. Otherwise as heights().
        """
        with self._lock:
            return _core.gradients_at(self._euclidean(), self._values(values), as_rows(places, 'places', (2,)), method,
                                      thread_count(threads))

    def smooth(self, values: Array, method: Smoothing = 'laplacian', *, vertices: Array | None = None, iterations: int = 10,
               strength: float = 0.5, pass_band: float = 0.1, edge_height: float = 0.0) -> Float64Array:
        """Returns smoothed heights by vertex number, float64.

        values: as in heights().
        method: 'laplacian'; 'taubin', which keeps wide features (strength about 0.6, pass band between 0 and 1); or
            'bilateral', which keeps steps of at least ``edge_height``.
        vertices: those that may move, by default all. Vertices on the hull, and those with a neighbour outside this
            set, stay.

        Raises: ValueError.

        Source: G. Taubin, 1995; C. Tomasi, R. Manduchi, 1998.
        """
        def smoothed(slots: Int32Array | None) -> Float64Array:
            return self._numbers.by_number(_core.smooth(self._euclidean(), self._values(values), slots, method, iterations,
                                                        float(strength), float(pass_band), float(edge_height)))

        iterations = as_integer(iterations, 'iterations', bits=32)
        with self._lock:
            return smoothed(None) if vertices is None else self._of_vertices(_handles(vertices), smoothed)

    def quality(self, values: Array, datum: float = 0.0, *, bins: int = 16) -> dict[str, Any]:
        """Measures angles (degrees) and edges in the plane, areas, and the volumes between the surface and ``datum``.

        values: as in heights().

        Returns: a dict with triangles, min_angle, mean_min_angle, max_aspect, mean_aspect, edges, min_edge, max_edge,
            mean_edge, edge_histogram (counts in ``bins`` equal intervals from min_edge to max_edge), area,
            surface_area, volume_above and volume_below.
        """
        with self._lock:
            return _core.mesh_quality(self._euclidean(), self._values(values), float(datum), as_integer(bins, 'bins', 1))

    def triangle_quality(self, values: Array, datum: float = 0.0) -> Records:
        """Measures each triangle as quality() does, in the order of ``simplices``.

        Returns: a structured array with min_angle (degrees), aspect (1 for an equilateral triangle, larger for
            others), area, surface_area, volume_above and volume_below.
        """
        with self._lock:
            result = _core.triangle_quality(self._euclidean(), self._values(values), float(datum))
        names = ('min_angle', 'aspect', 'area', 'surface_area', 'volume_above', 'volume_below')
        return result.view([(name, 'f8') for name in names]).reshape(-1)

    def adapted(self, regions: Iterable[tuple[Array, Array]]) -> Int32Array:
        """Returns the triangles after edge flips that adapt them to a metric in each region.

        regions: pairs of a box (min x, min y, max x, max y; infinities are allowed) and a metric such as ellipse().
            The first box that contains a place decides; outside all boxes the metric is Euclidean. Triangles across
            several regions do not change.

        Returns: int32, shape (m, 3), vertex numbers, counter-clockwise.
        Raises: ValueError.

        Source: J. Skala, 7.4.
        """
        with self._lock:
            return self._numbers.of(self._euclidean().adapted(self._regions(regions)))

    def _repr_png_(self) -> bytes:
        with self._lock:
            return plane_png(self.points, self.simplices)


@dataclass(frozen=True)
class Shape:
    """A solid and its surface, as computed by Delaunay3.shape().

    tetrahedra: int32, shape (k, 4), rows of ``Delaunay3.points``.
    surface: a Mesh over ``Delaunay3.points``, counter-clockwise seen from outside.
    volume: of the tetrahedra.
    open: whether lids were left out of the surface.
    components, euler_characteristic: of the surface; the characteristic is 2 for a sphere, 0 for a torus.
    """

    tetrahedra: Int32Array
    surface: Mesh
    volume: float
    open: bool
    components: int
    euler_characteristic: int

    def __repr__(self) -> str:
        return (f'<terrace.Shape: {len(self.tetrahedra)} tetrahedra, {len(self.surface.triangles)} triangles, '
                f'volume {self.volume:g}>')


class Delaunay3(_Delaunay):
    """The Delaunay triangulation of points in space, with tetrahedra; otherwise as Delaunay2.

    metric: None, or an invertible map of shape (3, 3), such as ellipsoid().

    >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    <terrace.Delaunay3: 4 vertices, 1 tetrahedra>
    """

    _width, _simplices = 3, 'tetrahedra'
    _kind = _core.SharedDelaunay3
    _elliptical_kind = _core.EllipticalDelaunay3

    def adapted(self, regions: Iterable[tuple[Array, Array]]) -> tuple[Int32Array, int]:
        """Returns the tetrahedra after flips that adapt them to a metric in each region.

        regions: as in Delaunay2.adapted(), with boxes of six numbers.

        Returns: (int32, shape (m, 4); the number of facets that violate the Delaunay condition in their region's
            metric but cannot be flipped).
        """
        with self._lock:
            tetrahedra, stuck = self._euclidean().adapted(self._regions(regions))
            return self._numbers.of(tetrahedra), stuck

    def shape(self, rule: ShapeRule = 'poles', *,
              criterion: ShapeCriterion = 'gabriel', edge_factor: float = 0.5, keep_vertices: bool = True,
              lids: bool = False, threads: int | None = None) -> Shape:
        """Reconstructs the solid whose surface was scanned: the tetrahedra inside it, and their surface.

        rule: 'poles' decides by angles between circumspheres and suits samples of any density. 'flood' and
            'published' peel tetrahedra off the hull while facets violate the ``criterion``.
        criterion: 'gabriel', or 'edge-length' with ``edge_factor``.
        keep_vertices: whether 'flood' and 'published' must leave each vertex at least one tetrahedron.
        lids: whether the surface includes the facets that close an open scan.

        Returns: a Shape, empty if there are no tetrahedra. Takes about 0.3 s per 100,000 points.
        Raises: ValueError.

        Source: J. Skala, section 8.3; N. Amenta, M. Bern, 1999.

        >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).shape('flood')
        <terrace.Shape: 1 tetrahedra, 4 triangles, volume 0.166667>
        """
        with self._lock:
            tetrahedra, faces, *rest = _core.shape(self._core, rule, criterion, float(edge_factor), bool(keep_vertices), bool(lids),
                                                  thread_count(threads))
            surface = Mesh(self.points, self._numbers.of(faces))
            return Shape(self._numbers.of(tetrahedra), surface, *rest)


class DynamicSurface(_PointMesh):
    """The surface from which a changing set of points in space was scanned, by the poles rule of Delaunay3.shape().

    ``simplices`` are its triangles, counter-clockwise seen from outside. Insertions and removals update the surface
    only where tetrahedra change, in about 16 microseconds per point; restore() recomputes it. Open scans stay open,
    as with Delaunay3.shape(lids=False). Threads may share one.

    Raises: ValueError.

    Source: J. Skala, section 8.3; N. Amenta, M. Bern, 1999.

    >>> angles, heights = np.random.default_rng(1).random((2, 500))
    >>> radii = np.sqrt(1 - (2 * heights - 1) ** 2)
    >>> ball = DynamicSurface(np.column_stack((radii * np.cos(7 * angles), radii * np.sin(7 * angles), 2 * heights - 1)))
    >>> ball.remove(ball.ids[:50])
    >>> ball.mesh().measures()['euler_characteristic']
    2
    """

    _width, _simplices = 3, 'triangles'

    def __init__(self, points: Array | None = None) -> None:
        super().__init__()
        self._core = _core.SharedSurface()
        if points is not None:
            self.ids = self.insert(points)

    def restore(self, *, threads: int | None = None) -> None:
        """Recomputes the surface from scratch, as for a new object with the same points (3 microseconds per vertex)."""
        self._core.restore(thread_count(threads))

    def mesh(self) -> Mesh:
        """Returns the surface as an independent Mesh."""
        with self._lock:
            points, simplices = self.points, self.simplices
        used, corners = np.unique(simplices, return_inverse=True)
        return Mesh(points[used], corners.reshape(-1, 3).astype(np.uint32))

    def _repr_png_(self) -> bytes:
        return self.mesh()._repr_png_()
