# SPDX-License-Identifier: Apache-2.0
"""Dynamic Delaunay triangulations of the plane and of space."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_numbers, as_rows, whole
from ._matching import _threads
from ._mesh import Mesh
from ._pictures import triangles_svg


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


class _Delaunay:
    _width = 0
    _kind = None
    _elliptical_kind = None

    def __init__(self, points=None, *, metric=None):
        self._elliptical = metric is not None
        self._core = self._elliptical_kind(_map(metric, self._width)) if self._elliptical else self._kind()
        #: The vertex of each point that was given here.
        self.ids = np.empty(0, np.int32) if points is None else self.insert(points)

    def insert(self, points):
        """Adds points: shape (n, 2) or (n, 3) of any finite numbers; together is faster than one by one.

        Returns: int32, shape (n,): the vertex of each point, the same one for equal points. Raises: ValueError for
        a coordinate that is not finite; then nothing has changed."""
        return self._core.insert(as_rows(points, 'points', (self._width,)))

    def remove(self, vertices):
        """Removes vertices, all different. The triangulation is then that of the rest, as if they had never been.
        Raises: ValueError for one that is not there; then nothing has changed."""
        self._core.remove(_handles(vertices))

    @property
    def points(self):
        """Coordinates by number of vertex, float64: rows of numbers that are free are NaN."""
        return self._core.points()

    @property
    def vertices(self):
        """The vertices there are, int32, ascending."""
        return self._core.vertices()

    @property
    def simplices(self):
        """Corners of the triangles or tetrahedra, int32: numbers of vertices, so ``points[simplices]`` are their
        coordinates. Counter-clockwise; of tetrahedra a, b, c counter-clockwise seen from d."""
        return self._core.simplices()

    @property
    def neighbors(self):
        """For each simplex the row of the one opposite to each corner, -1 beyond the hull."""
        return self._core.neighbours()

    def find_simplex(self, points):
        """The row of a simplex that holds each point, -1 outside the hull."""
        return self._core.find_simplex(as_rows(points, 'points', (self._width,)))

    def nearest(self, points):
        """The nearest vertex of each point, exactly; -1 if there is none."""
        return self._core.nearest(as_rows(points, 'points', (self._width,)))

    def by_vertex(self, values):
        """Values of the points that were given at first, by number of vertex: float64, NaN for other vertices; of equal
        points the last counts. Raises: ValueError unless there is one for each."""
        values = as_numbers(values, 'values')
        if values.shape != self.ids.shape:
            raise ValueError(f'there are values of the shape {values.shape} for {len(self.ids)} points')
        result = np.full(len(self._core.points()), np.nan)
        result[self.ids] = values
        return result

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

    def digest(self):
        """A hash of the set of simplices by coordinates: equal for equal point sets, whatever their history."""
        return self._core.hash()

    def __len__(self):
        return self._core.size()

    def __repr__(self):
        kind = {2: 'triangles', 3: 'tetrahedra'}[self._width]
        return f'<terrace.{type(self).__name__}: {len(self)} vertices, {self._core.count()} {kind}>'


class Delaunay2(_Delaunay):
    """The Delaunay triangulation of points in the plane: exact, dynamic, and a function of the point set alone.

    Ties of cocircular points are broken by a symbolic perturbation, so a removal after an insertion gives back the very
    triangles. About a microsecond per point. Threads may share one.

    metric: None, or an invertible map of shape (2, 2), such as ellipse(): lengths are those of mapped vectors, and the triangles
    exactly those of the points mapped without rounding.

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

    _width = 2
    _kind = _core.SharedDelaunay2
    _elliptical_kind = _core.EllipticalDelaunay2

    def heights(self, values, places, method='linear', *, threads=None):
        """Heights at places between vertices.

        values: the height of each vertex by its number, see by_vertex(). places: shape (n, 2). method: 'linear', 'natural'
        (Sibson's natural neighbours) or 'nearest'. Returns: float64, shape (n,); NaN outside the hull, but for 'nearest'.
        Raises: ValueError. About 0.4 us each.

        >>> d = Delaunay2([[0, 0], [1, 0], [0, 1]])
        >>> d.heights(d.by_vertex([1, 2, 3]), [[0.25, 0.5]])
        array([2.25])
        """
        return _core.heights_at(self._euclidean(), as_numbers(values, 'values'), as_rows(places, 'places', (2,)), method,
                                _threads(threads))

    def gradients(self, values, places, method='linear', *, threads=None):
        """Height gained per unit of length to +x and to +y, shape (n, 2): 'linear' of the triangles, 'natural' of natural
        neighbours. NaN outside the hull. Otherwise as heights()."""
        return _core.gradients_at(self._euclidean(), as_numbers(values, 'values'), as_rows(places, 'places', (2,)),
                                  method, _threads(threads))

    def smooth(self, values, method='laplacian', *, vertices=None, iterations=10, strength=0.5, pass_band=0.1, edge_height=0.0):
        """Smoothed heights by number of vertex, float64.

        values: as of heights(). method: 'laplacian'; 'taubin', which keeps wide features (strength about 0.6, with a pass
        band between 0 and 1); 'bilateral', which keeps steps of at least ``edge_height``. vertices: those that may move, all
        by default; those on the hull and with a neighbour beyond stay. Raises: ValueError. Sources: G. Taubin, 1995;
        C. Tomasi, R. Manduchi, 1998."""
        return _core.smooth(self._euclidean(), as_numbers(values, 'values'), None if vertices is None else _handles(vertices),
                            method, whole(iterations, 'iterations'), float(strength), float(pass_band), float(edge_height))

    def quality(self, values, datum=0.0):
        """Angles (degrees) and edges in the plane, areas, and the volumes between the surface and ``datum``.

        values: as of heights(). Returns: a dict: triangles, min_angle, mean_min_angle, max_aspect, mean_aspect, edges,
        min_edge, max_edge, mean_edge, area, surface_area, volume_above, volume_below."""
        return _core.mesh_quality(self._euclidean(), as_numbers(values, 'values'), float(datum))

    def adapted(self, regions):
        """The triangles after flips of edges to suit a metric in each region.

        regions: pairs of a box (min x, min y, max x, max y; infinities are allowed) and a metric such as ellipse(). Where
        boxes overlap the first counts; outside all of them the metric is Euclidean. Triangles across regions stay as
        they are. Returns: int32, shape (m, 3), numbers of vertices, counter-clockwise. Raises: ValueError. Source:
        J. Skala, 7.4."""
        return self._euclidean().adapted(self._regions(regions))

    def _repr_svg_(self):
        return triangles_svg(self.points, self.simplices)


@dataclass(frozen=True)
class Shape:
    """The inside of a shape and its surface. tetrahedra: int32, shape (k, 4), and surface: a Mesh over
    ``Delaunay3.points``, counter-clockwise seen from outside. volume: of the tetrahedra. open: lids were left out of the surface.
    components, euler_characteristic: of the surface; 2 for a sphere, 0 for a torus."""

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

    _width = 3
    _kind = _core.SharedDelaunay3
    _elliptical_kind = _core.EllipticalDelaunay3

    def adapted(self, regions):
        """The tetrahedra after flips to suit a metric in each region; a box is six numbers, otherwise as
        Delaunay2.adapted(). Returns: (int32, shape (m, 4); the number of facets that are not Delaunay in their region's
        metric although no flip is possible)."""
        return self._euclidean().adapted(self._regions(regions))

    def shape(self, rule='poles', *, lids=False, threads=None):
        """The shape from whose surface the points were scanned: which tetrahedra are inside, and their surface.

        rule: 'poles', by angles between circumspheres, for samples of any density; 'flood' and 'published' peel from the
        hull. lids: whether what closes an open scan is part of the surface. Returns: a Shape, empty if there are no
        tetrahedra. Raises: ValueError. About 0.3 s per 100,000 points. Source: J. Skala, section 8.3; N. Amenta, M. Bern, 1999.

        >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]).shape('flood')
        <terrace.Shape: 1 tetrahedra, 4 triangles, volume 0.166667>
        """
        tetrahedra, faces, *rest = _core.shape(self._core, rule, bool(lids), _threads(threads))
        return Shape(tetrahedra, Mesh(self.points, faces), *rest)
