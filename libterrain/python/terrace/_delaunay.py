# SPDX-License-Identifier: Apache-2.0
"""Dynamic Delaunay triangulations of the plane and of space."""

import threading
from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_numbers, as_rows, whole
from ._matching import _threads
from ._mesh import Mesh
from ._pictures import plane_png


def ellipse(a, b, angle=0.0):
    """The metric of an ellipse, shape (2, 2): vectors from its centre to its border have length 1. So edges tend to follow the
    long axis.

    a: the semi-axis along ``angle``, degrees counter-clockwise from +x; b: the one across. Raises: ValueError.
    Source: J. Skala, 4.1.2.

    >>> ellipse(4, 1)
    array([[0.25, 0.  ],
           [0.  , 1.  ]])
    """
    return np.array(_core.ellipse_map(float(a), float(b), float(angle))).reshape(2, 2)


def ellipsoid(semi_axes, axes=((1, 0, 0), (0, 1, 0), (0, 0, 1))):
    """The metric of an ellipsoid, shape (3, 3). semi_axes: three lengths, each along its row of ``axes``, which are
    orthonormal. Raises: ValueError."""
    lengths, axes = as_numbers(semi_axes, 'semi_axes'), as_numbers(axes, 'axes')
    if lengths.shape != (3,) or axes.shape != (3, 3):
        raise ValueError('an ellipsoid has three semi-axes, and axes of shape (3, 3)')
    return np.array(_core.ellipsoid_map(lengths.tolist(), axes.ravel().tolist())).reshape(3, 3)


def _map(metric, width):
    array = as_numbers(metric, 'metric')
    if array.shape != (width, width):
        raise ValueError(f'a metric has the shape ({width}, {width}), not {array.shape}')
    return array.ravel().tolist()


def _handles(vertices):
    vertices = as_array(vertices, 'vertices')
    if vertices.dtype.kind not in 'iu' and vertices.size > 0:
        raise TypeError(f'vertices are whole numbers, not {vertices.dtype}')
    vertices = np.atleast_1d(vertices)
    if vertices.size and (vertices.min() < 0 or vertices.max() > np.iinfo(np.int32).max):
        raise ValueError('there is no such vertex')
    return vertices.astype(np.int32)


@dataclass(frozen=True)
class MeshChanges:
    """What came and went between two moments. Simplices are told by their corners, numbers of vertices. Apply removals first: a
    number that is used again is on both sides."""

    added_vertices: np.ndarray
    removed_vertices: np.ndarray
    removed_points: np.ndarray  #: where removed_vertices were, in parallel
    added_simplices: np.ndarray  #: shape (n, 3), or (n, 4) of tetrahedra
    removed_simplices: np.ndarray

    def __repr__(self):
        return (f'<terrace.MeshChanges: {len(self.added_vertices)} vertices and {len(self.added_simplices)} simplices came, '
                f'{len(self.removed_vertices)} and {len(self.removed_simplices)} went>')


class _Numbers:
    """The numbers of vertices for the caller, from 0, and the slots of the core, which counts in an order of its own.

    A slot that is used again keeps its number. The first points that are inserted have their rows as numbers; of equal
    ones the first is the vertex, and the others are copies, whose numbers no vertex has.
    """

    def __init__(self):
        self._of_slot = np.empty(0, np.int32)  # -1: none
        self._slots = np.empty(0, np.int32)  # by number, -1: a copy
        self._copies = np.empty((0, 2), np.int32)  # the number of a copy, that of its vertex

    def __len__(self):
        return len(self._slots)

    def take(self, slots):
        """The numbers of slots that were just filled, in the order of the points."""
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

    def take_all(self, first, count):
        """Numbers consecutive slots from 0."""
        self._slots = np.arange(first, first + count, dtype=np.int32)
        self._of_slot = np.append(np.full(first, -1, np.int32), np.arange(count, dtype=np.int32))

    def forget_copies(self, vertices):
        """Of vertices that are gone."""
        if len(self._copies):
            self._copies = self._copies[~np.isin(self._copies[:, 1], vertices)]

    def of(self, slots):
        """Numbers of slots, of any shape; -1 for a slot of -1."""
        filled = slots[slots >= 0]
        if filled.size and (filled.max() >= len(self._of_slot) or self._of_slot[filled].min() < 0):
            self.take(np.unique(filled))  # an insertion was interrupted before its numbers were taken
        return np.where(slots < 0, np.int32(-1), self._of_slot[slots]) if filled.size else slots

    def all_slots(self):
        """By number; -1 for a copy."""
        return self._slots

    def slots_of(self, numbers):
        """Raises: ValueError for a number that no vertex ever had."""
        for number in numbers[(numbers >= len(self._slots)) | (numbers < 0)]:
            raise ValueError(f'there is no vertex {number}')
        slots = self._slots[numbers]
        for number in numbers[slots < 0]:
            raise ValueError(f'there is no vertex {number}: this point equals an earlier one, whose number is in `ids`')
        return slots

    def by_number(self, rows):
        """Rows by slot in the order of numbers; copies have those of their vertices."""
        result = np.full((len(self._slots), *rows.shape[1:]), np.nan)
        used = (self._slots >= 0) & (self._slots < len(rows))
        result[used] = rows[self._slots[used]]
        result[self._copies[:, 0]] = result[self._copies[:, 1]]
        return result

    def by_slot(self, values):
        """The reverse, for values of shape (n,). Raises: ValueError unless there is one for each number."""
        if values.ndim != 1 or len(values) < len(self._slots):
            raise ValueError(f'there are `values` of the shape {values.shape} for {len(self._slots)} numbers of vertices; '
                             'by_vertex() puts them in order')
        result = np.full(max(len(self._of_slot), 1), np.nan)  # the core has a slot that is not a vertex
        used = self._slots >= 0
        result[self._slots[used]] = values[:len(self._slots)][used]
        return result


class _PointMesh:
    """Vertices that come and go, and simplices between them.

    Vertices have numbers. The points that are given to the constructor have their rows as numbers, as in SciPy: 0, 1, ..;
    points that are inserted later have the numbers that follow, or some that are free again. ``ids``, insert() and
    ``simplices`` give such numbers, remove() and all others take them, and ``points`` has a row for each.
    """

    _width = 0

    def __init__(self):
        #: The vertex of each point that was given to the constructor: its row, or that of the first equal one.
        self.ids = np.empty(0, np.int32)
        self._numbers = _Numbers()
        self._lock = threading.RLock()  # the core and the numbers change together

    def insert(self, points):
        """Adds points: shape (n, 2) or (n, 3) of any finite numbers; together is faster than one by one.

        Returns: int32, shape (n,): the vertex of each point, the same one for equal points. Raises: ValueError for
        a coordinate that is not finite; then nothing has changed."""
        points = as_rows(points, 'points', (self._width,))
        with self._lock:
            return self._numbers.take(self._core.insert(points))

    def remove(self, vertices):
        """Removes vertices, all different. The triangulation is then that of the rest, as if they had never been.
        Raises: ValueError for one that is not there; then nothing has changed."""
        vertices = _handles(vertices)
        with self._lock:
            self._of_vertices(vertices, self._core.remove)
            self._numbers.forget_copies(vertices)

    def _of_vertices(self, vertices, work):
        """work(slots). Raises: ValueError, with the caller's number, for a vertex that is not there or is named twice."""
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
    def points(self):
        """Coordinates by number of vertex, float64: first the points of the constructor. Rows of vertices that were
        removed are NaN."""
        with self._lock:
            return self._numbers.by_number(self._core.points())

    @property
    def vertices(self):
        """The vertices there are, int32, ascending."""
        with self._lock:
            return np.sort(self._numbers.of(self._core.vertices()))

    @property
    def simplices(self):
        """Corners of the triangles or tetrahedra, int32: numbers of vertices, so ``points[simplices]`` are their
        coordinates, as in SciPy: the rows of the points that were given to the constructor. Counter-clockwise; of
        tetrahedra a, b, c counter-clockwise seen from d."""
        with self._lock:
            return self._numbers.of(self._core.simplices())

    def record(self):
        """From here on changes() tells what changes; what was recorded before is dropped."""
        self._core.start_journal()

    def changes(self):
        """The net MeshChanges since record() or the last call. Raises: ValueError unless record() was called before.
        O(what changed)."""
        with self._lock:
            changes = self._core.take_changes()
            return MeshChanges(**{name: rows if name == 'removed_points' else self._numbers.of(rows) for name, rows in changes.items()})

    def digest(self):
        """A hash of the set of simplices by coordinates: equal for equal sets, whatever their history."""
        return self._core.hash()

    def __len__(self):
        return self._core.size()

    def __repr__(self):
        return f'<terrace.{type(self).__name__}: {len(self)} vertices, {self._core.count()} {self._simplices}>'


class _Delaunay(_PointMesh):
    _kind = None
    _elliptical_kind = None

    def __init__(self, points=None, *, metric=None):
        super().__init__()
        self._elliptical = metric is not None
        self._core = self._elliptical_kind(_map(metric, self._width)) if self._elliptical else self._kind()
        if points is not None:
            self.ids = self.insert(points)

    @property
    def vertex_neighbor_vertices(self):
        """The vertices joined to each by an edge, as SciPy's: (where those of each number of vertex begin, int64;
        vertices, int32). In the plane counter-clockwise."""
        with self._lock:
            begins, joined = self._core.adjacent()
            slots = self._numbers.all_slots()
            known = (slots >= 0) & (slots < len(begins) - 1)
            from_, counts = np.zeros(len(slots), np.int64), np.zeros(len(slots), np.int64)
            from_[known], counts[known] = begins[slots[known]], np.diff(begins)[slots[known]]
            ends = np.append(0, np.cumsum(counts))
            return ends, self._numbers.of(joined[np.repeat(from_ - ends[:-1], counts) + np.arange(ends[-1])])

    @property
    def neighbors(self):
        """For each simplex the row in ``simplices`` of the one opposite to each corner, -1 beyond the hull."""
        return self._core.neighbours()

    def find_simplex(self, points):
        """The row in ``simplices`` of one that holds each point, -1 outside the hull."""
        return self._core.find_simplex(as_rows(points, 'points', (self._width,)))

    def nearest(self, points):
        """The nearest vertex of each point, exactly; -1 if there is none."""
        points = as_rows(points, 'points', (self._width,))
        with self._lock:
            return self._numbers.of(self._core.nearest(points))

    def by_vertex(self, values):
        """Values of the points that were given at first, by number of vertex: float64, NaN for other vertices; of equal
        points the last counts. Raises: ValueError unless there is one for each."""
        values = as_numbers(values, 'values')
        if values.shape != self.ids.shape:
            raise ValueError(f'there are values of the shape {values.shape} for {len(self.ids)} points')
        with self._lock:
            result = np.full(len(self._numbers), np.nan)
        result[self.ids] = values
        return result

    def _values(self, values):
        """As the core wants them; hold the lock."""
        return self._numbers.by_slot(as_numbers(values, 'values'))

    def _euclidean(self):
        if self._elliptical:
            raise ValueError('this is for triangulations without `metric`')
        return self._core

    def _regions(self, regions):
        checked = []
        for box, metric in regions:
            box = as_numbers(box, 'a box')
            if box.shape != (2 * self._width,):
                raise ValueError(f'a box is {2 * self._width} numbers: the least coordinates, then the largest')
            checked.append((box[:self._width].tolist(), box[self._width:].tolist(), _map(metric, self._width)))
        return checked


class Delaunay2(_Delaunay):
    """The Delaunay triangulation of points in the plane: exact, dynamic, and a function of the point set alone.

    Ties of cocircular points are broken by a symbolic perturbation, so a removal after an insertion gives back the very
    triangles. About a microsecond per point. Threads may share one.

    metric: None, or an invertible map of shape (2, 2), such as ellipse(): lengths are those of mapped vectors, and the
    triangles exactly those of the points mapped without rounding.

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
    def of_grid(cls, columns, rows, origin=(0.0, 0.0), step=1.0):
        """The triangulation of a complete grid, written directly: O(n). The vertex of column i and row j is j * columns + i.

        origin: of column 0 and row 0; step: between neighbours, positive, also to the next row, to +y. Raises:
        ValueError unless doubles hold all coordinates exactly.

        >>> Delaunay2.of_grid(3, 2)
        <terrace.Delaunay2: 6 vertices, 4 triangles>
        """
        x, y = map(float, origin)
        made = cls()
        columns, rows = whole(columns, 'columns'), whole(rows, 'rows')
        if columns * rows > 2 ** 29:
            raise ValueError('a triangulation has at most 2^29 vertices')
        first = made._core.build_grid(x, y, float(step), columns, rows)
        if columns * rows:
            made._numbers.take_all(first, columns * rows)
            made.ids = np.arange(columns * rows, dtype=np.int32)
        return made

    def weights(self, places, method='linear'):
        """The weights of the vertices that interpolate at places: heights() is their sum of products with values.

        places, method: as of heights(). Returns: (weights, float64; vertices, int32; where those of each place begin,
        int64): the data of a ``scipy.sparse.csr_matrix`` of shape (len(places), len(points)). Weights are not negative
        and add up to 1; outside the hull there are none, but for 'nearest'. Raises: ValueError. Source: R. Sibson,
        1980.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> weights, vertices, begins = d.weights([[0.25, 0.5], [9, 9]])
        >>> weights @ d.points[vertices], begins
        (array([0.25, 0.5 ]), array([0, 3, 3]))
        """
        places = as_rows(places, 'places', (2,))
        with self._lock:
            weights, vertices, begins = _core.weights_at(self._euclidean(), places, method)
            return weights, self._numbers.of(vertices), begins

    def vertical_distances(self, values, samples, method='linear', *, threads=None):
        """How far samples that are not in the triangulation lie above or below its surface.

        values, method: as of heights(). samples: shape (n, 3). Returns: a dict: count (of those measured), outside (the
        hull, or where a height is NaN), max, mean and rms of distances without sign, bias (the mean of sample minus
        surface), worst (the sample at ``max``, -1 for none). Raises: ValueError.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> d.vertical_distances(d.by_vertex([1, 2, 3]), [[0.25, 0.5, 3]])['bias']
        0.75
        """
        with self._lock:
            return _core.vertical_distances(self._euclidean(), self._values(values), as_rows(samples, 'samples', (3,)), method,
                                            _threads(threads))

    def heights(self, values, places, method='linear', *, threads=None):
        """Heights at places between vertices.

        values: the height of each vertex by its number, see by_vertex(). places: shape (n, 2). method: 'linear', 'natural'
        (Sibson's natural neighbours) or 'nearest'. Returns: float64, shape (n,); NaN outside the hull, but for 'nearest'.
        Raises: ValueError. About 0.4 us each.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> d.heights(d.by_vertex([1, 2, 3]), [[0.25, 0.5]])
        array([2.25])
        """
        with self._lock:
            return _core.heights_at(self._euclidean(), self._values(values), as_rows(places, 'places', (2,)), method,
                                    _threads(threads))

    def gradients(self, values, places, method='linear', *, threads=None):
        """Height gained per unit of length to +x and to +y, shape (n, 2): 'linear' of the triangles, 'natural' of natural
        neighbours. NaN outside the hull. Otherwise as heights()."""
        with self._lock:
            return _core.gradients_at(self._euclidean(), self._values(values), as_rows(places, 'places', (2,)), method,
                                      _threads(threads))

    def smooth(self, values, method='laplacian', *, vertices=None, iterations=10, strength=0.5, pass_band=0.1, edge_height=0.0):
        """Smoothed heights by number of vertex, float64.

        values: as of heights(). method: 'laplacian'; 'taubin', which keeps wide features (strength about 0.6, with a pass
        band between 0 and 1); 'bilateral', which keeps steps of at least ``edge_height``. vertices: those that may move, all
        by default; those on the hull and with a neighbour beyond stay. Raises: ValueError. Sources: G. Taubin, 1995;
        C. Tomasi, R. Manduchi, 1998."""
        def smoothed(slots):
            return self._numbers.by_number(_core.smooth(self._euclidean(), self._values(values), slots, method, iterations,
                                                        float(strength), float(pass_band), float(edge_height)))

        iterations = whole(iterations, 'iterations', bits=32)
        with self._lock:
            return smoothed(None) if vertices is None else self._of_vertices(_handles(vertices), smoothed)

    def quality(self, values, datum=0.0, *, bins=16):
        """Angles (degrees) and edges in the plane, areas, and the volumes between the surface and ``datum``.

        values: as of heights(). Returns: a dict: triangles, min_angle, mean_min_angle, max_aspect, mean_aspect, edges,
        min_edge, max_edge, mean_edge, edge_histogram (counts in ``bins`` equal intervals from min_edge to max_edge),
        area, surface_area, volume_above, volume_below."""
        with self._lock:
            return _core.mesh_quality(self._euclidean(), self._values(values), float(datum), whole(bins, 'bins', 1))

    def triangle_quality(self, values, datum=0.0):
        """The same of each triangle, in the order of simplices. Returns: a structured array: min_angle (degrees),
        aspect (1 for an equilateral triangle, otherwise larger), area, surface_area, volume_above, volume_below."""
        with self._lock:
            made = _core.triangle_quality(self._euclidean(), self._values(values), float(datum))
        names = ('min_angle', 'aspect', 'area', 'surface_area', 'volume_above', 'volume_below')
        return made.view([(name, 'f8') for name in names]).reshape(-1)

    def adapted(self, regions):
        """The triangles after flips of edges to suit a metric in each region.

        regions: pairs of a box (min x, min y, max x, max y; infinities are allowed) and a metric such as ellipse(). Where
        boxes overlap the first counts; outside all of them the metric is Euclidean. Triangles across regions stay as
        they are. Returns: int32, shape (m, 3), numbers of vertices, counter-clockwise. Raises: ValueError. Source:
        J. Skala, 7.4."""
        with self._lock:
            return self._numbers.of(self._euclidean().adapted(self._regions(regions)))

    def _repr_png_(self):
        with self._lock:
            return plane_png(self.points, self.simplices)


@dataclass(frozen=True)
class Shape:
    """The inside of a shape and its surface. tetrahedra: int32, shape (k, 4), and surface: a Mesh over
    ``Delaunay3.points``, counter-clockwise seen from outside. volume: of the tetrahedra. open: lids were left out of
    the surface. components, euler_characteristic: of the surface; 2 for a sphere, 0 for a torus."""

    tetrahedra: np.ndarray
    surface: Mesh
    volume: float
    open: bool
    components: int
    euler_characteristic: int

    def __repr__(self):
        return (f'<terrace.Shape: {len(self.tetrahedra)} tetrahedra, {len(self.surface.triangles)} triangles, '
                f'volume {self.volume:g}>')


class Delaunay3(_Delaunay):
    """The same for points in space, with tetrahedra. metric: of shape (3, 3), such as ellipsoid().

    >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    <terrace.Delaunay3: 4 vertices, 1 tetrahedra>
    """

    _width, _simplices = 3, 'tetrahedra'
    _kind = _core.SharedDelaunay3
    _elliptical_kind = _core.EllipticalDelaunay3

    def adapted(self, regions):
        """The tetrahedra after flips to suit a metric in each region; a box is six numbers, otherwise as
        Delaunay2.adapted(). Returns: (int32, shape (m, 4); the number of facets that are not Delaunay in their region's
        metric although no flip is possible)."""
        with self._lock:
            tetrahedra, stuck = self._euclidean().adapted(self._regions(regions))
            return self._numbers.of(tetrahedra), stuck

    def shape(self, rule='poles', *, criterion='gabriel', edge_factor=0.5, keep_vertices=True, lids=False, threads=None):
        """The shape from whose surface the points were scanned: which tetrahedra are inside, and their surface.

        rule: 'poles', by angles between circumspheres, for samples of any density; 'flood' and 'published' peel from
        the hull where facets do not meet the ``criterion``: 'gabriel', or 'edge-length' with ``edge_factor``; no vertex
        then loses all its tetrahedra unless ``keep_vertices`` is false. lids: whether what closes an open scan is part
        of the surface. Returns: a Shape, empty if there are no tetrahedra. Raises: ValueError. About 0.3 s per 100,000
        points. Source: J. Skala, section 8.3; N. Amenta, M. Bern, 1999.

        >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).shape('flood')
        <terrace.Shape: 1 tetrahedra, 4 triangles, volume 0.166667>
        """
        with self._lock:
            tetrahedra, faces, *rest = _core.shape(self._core, rule, criterion, float(edge_factor), bool(keep_vertices), bool(lids),
                                                  _threads(threads))
            surface = Mesh(self.points, self._numbers.of(faces))
            return Shape(self._numbers.of(tetrahedra), surface, *rest)


class DynamicSurface(_PointMesh):
    """The surface from which a changing set of points in space was scanned, by the poles rule of Delaunay3.shape():
    ``simplices`` are its triangles, counter-clockwise seen from outside.

    It follows insertions and removals, about 16 us per point, where tetrahedra are new; restore() computes it afresh.
    Open scans are left open, as by Delaunay3.shape(lids=False). Threads may share one. Raises: ValueError. Source: J. Skala,
    section 8.3; N. Amenta, M. Bern, 1999.

    >>> angles, heights = np.random.default_rng(1).random((2, 500))
    >>> radii = np.sqrt(1 - (2 * heights - 1) ** 2)
    >>> ball = DynamicSurface(np.column_stack((radii * np.cos(7 * angles), radii * np.sin(7 * angles), 2 * heights - 1)))
    >>> ball.remove(ball.ids[:50])
    >>> ball.mesh().measures()['euler_characteristic']
    2
    """

    _width, _simplices = 3, 'triangles'

    def __init__(self, points=None):
        super().__init__()
        self._core = _core.SharedSurface()
        if points is not None:
            self.ids = self.insert(points)

    def restore(self, *, threads=None):
        """Computes the surface from scratch, as of a new object of the same points; 3 us per vertex."""
        self._core.restore(_threads(threads))

    def mesh(self):
        """The surface as a Mesh of its own."""
        with self._lock:
            points, simplices = self.points, self.simplices
        used, corners = np.unique(simplices, return_inverse=True)
        return Mesh(points[used], corners.reshape(-1, 3).astype(np.uint32))

    def _repr_png_(self):
        return self.mesh()._repr_png_()
