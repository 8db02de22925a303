# SPDX-License-Identifier: Apache-2.0
"""Dynamic Delaunay triangulations of the plane and of space."""

from . import _core
from ._arrays import as_array, as_rows
from ._pictures import triangles_svg

import numpy as np


class _Delaunay:
    _width = 0
    _kind = None

    def __init__(self, points=None):
        self._core = self._kind()
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
        vertices = as_array(vertices, 'vertices')
        if vertices.dtype.kind not in 'iu' and vertices.size > 0:
            raise TypeError(f'vertices are whole numbers, not {vertices.dtype}')
        vertices = np.atleast_1d(vertices)
        if vertices.size and (vertices.min() < 0 or vertices.max() > np.iinfo(np.int32).max):
            raise ValueError('there is no such vertex')
        self._core.remove(vertices.astype(np.int32))

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

    def _repr_svg_(self):
        return triangles_svg(self.points, self.simplices)


class Delaunay3(_Delaunay):
    """The same for points in space, with tetrahedra.

    >>> Delaunay3([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    <terrace.Delaunay3: 4 vertices, 1 tetrahedra>
    """

    _width = 3
    _kind = _core.SharedDelaunay3
