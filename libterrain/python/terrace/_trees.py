# SPDX-License-Identifier: Apache-2.0
"""Trees of repeated matching, and queries in bounding volumes."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_numbers, as_rows, whole
from ._matching import _threads


@dataclass(frozen=True)
class MatchingTree:
    """rows: float64, shape (n - 1, 4), numbered as SciPy's linkage but not sorted by distance: the two children of each
    node, the distance of their positions, the points below. levels: the matching that made each row, from 1.
    positions: the (weighted) mean of the points below each row's node."""

    rows: np.ndarray
    levels: np.ndarray
    positions: np.ndarray

    def __repr__(self):
        depth = int(self.levels.max()) if len(self.levels) else 0
        return f'<terrace.MatchingTree: {len(self.rows)} rows, {depth} levels>'


def matching_tree(points, *, weights=None, labels=None, threads=None):
    """The binary tree of repeated matching: points are matched, each pair becomes a point, and so on until one is left.

    points: shape (n, 2) or (n, 3), finite. weights: positive, one for each point. labels: whole numbers; the points
    of each label become a tree, then the roots are matched. About twice the time of one matching(). Raises: ValueError. Source: J. Skala, 7.5.1.

    >>> matching_tree([[0, 0], [5, 0], [0, 1], [5, 1]]).rows
    array([[0., 2., 1., 2.],
           [1., 3., 1., 2.],
           [4., 5., 5., 4.]])
    """
    points = as_rows(points, 'points')
    if labels is None:
        labels = np.empty(0, np.uint32)
    else:
        labels = as_array(labels, 'labels')
        if labels.dtype.kind not in 'iu':
            raise TypeError(f'labels are whole numbers, not {labels.dtype}')
        labels = np.unique(labels, return_inverse=True)[1].reshape(labels.shape).astype(np.uint32)
    weights = np.empty(0) if weights is None else as_numbers(weights, 'weights')
    return MatchingTree(*_core.matching_tree(points, weights, labels, _threads(threads)))


def _children(tree, points):
    """The first two columns of a linkage, of a MatchingTree's rows, or of the tree that is made for want of one."""
    if tree is None:
        tree = matching_tree(points) if len(points) else np.empty((0, 4))
    rows = as_rows(getattr(tree, 'rows', tree), 'the tree', (4, 2))
    return np.ascontiguousarray(rows[:, :2])


class _Tree:
    @property
    def cost(self):
        """The expected cost of a random ray that meets the whole, by the surface area heuristic with unit costs."""
        return self._core.cost()

    @property
    def depth(self):
        """Nodes above the deepest leaf."""
        return self._core.depth()

    def __len__(self):
        return self._count

    def __repr__(self):
        return f'<terrace.{type(self).__name__}: {self._count} {self._what}, depth {self.depth}>'


class PointTree(_Tree):
    """Bounding volumes over points: the nearest ones, and the first along rays.

    points: shape (n, 2) or (n, 3), finite. tree: the rows of a MatchingTree or of any linkage over them; a
    matching_tree() by default. Results do not depend on it, ties go to the lowest number. Threads may share one.
    Source: J. Skala, 7.5.1; I. Wald, 2007.

    >>> tree = PointTree([[0, 0], [5, 0], [0, 1], [5, 2]])
    >>> tree.nearest([[1, 0]], k=2)
    (array([[0, 2]]), array([[1.        , 1.41421356]]))
    """

    _what = 'points'

    def __init__(self, points, tree=None):
        points = as_rows(points, 'points')
        self._count, self._width = points.shape
        kind = _core.PointTree3 if self._width == 3 else _core.PointTree2
        self._core = kind(_children(tree, points), points)

    def nearest(self, places, k=1):
        """The ``k`` nearest points of each place. Returns: (numbers, int64, and distances, float64), both of shape (m, k),
        nearest first; -1 and infinity where there are fewer. Raises: ValueError."""
        places, k = as_rows(places, 'places', (self._width,)), whole(k, 'k', 1)
        found, distances = self._core.nearest(places, min(k, self._count))
        shape = (len(places), min(k, self._count))
        more = ((0, 0), (0, k - shape[1]))
        return (np.pad(found.reshape(shape), more, constant_values=-1),
                np.pad(distances.reshape(shape), more, constant_values=np.inf))

    def hit(self, origins, directions, radius):
        """The first of the balls of this radius around the points of space that each ray meets.

        origins, directions: shape (m, 3). Returns: (numbers, int64, -1 for none; t, float64, infinity for none, in
        multiples of the direction's length, 0 inside a ball). Raises: ValueError."""
        if self._width != 3:
            raise ValueError('rays are for points of space')
        return self._core.hit(as_rows(origins, 'origins', (3,)), as_rows(directions, 'directions', (3,)), float(radius))


class TriangleTree(_Tree):
    """Bounding volumes over triangles in space: the first along rays, and the nearest.

    vertices: shape (n, 3). triangles: shape (m, 3), numbers of vertices. So ``TriangleTree(*mesh)`` takes a Mesh. tree: as of
    PointTree, over the triangles. Source: J. Skala, 7.5.1; S. Woop, C. Benthin, I. Wald, 2013.

    >>> tree = TriangleTree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> tree.hit([[0.2, 0.2, 5]], [[0, 0, -1]])
    (array([0]), array([5.]))
    """

    _what = 'triangles'

    def __init__(self, vertices, triangles, tree=None):
        vertices, triangles = as_rows(vertices, 'vertices', (3,)), as_array(triangles, 'triangles')
        if triangles.size == 0:
            triangles = np.empty((0, 3), np.uint32)
        if triangles.dtype.kind not in 'iu':
            raise TypeError(f'triangles are whole numbers, not {triangles.dtype}')
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            raise ValueError('triangles have corners that are no vertices')
        if triangles.ndim != 2 or triangles.shape[1] != 3:
            raise ValueError(f'triangles must have the shape (n, 3), not {triangles.shape}')
        self._count = len(triangles)
        middles = _core.centroids(vertices, triangles)
        self._core = _core.TriangleTree(_children(tree, middles), vertices, triangles)

    def nearest(self, places):
        """The nearest triangle of each place, shape (m, 3), of equally near ones the first. Returns: (numbers, int64, and
        distances, float64); -1 and infinity if there are no triangles. Raises: ValueError."""
        return self._core.nearest(as_rows(places, 'places', (3,)))

    def hit(self, origins, directions):
        """The first triangle along each ray, from either side; no ray slips between two that share an edge.

        origins, directions: shape (m, 3). Returns: (numbers, int64, -1 for none; t, float64, infinity for none, in multiples
        of the direction's length). Raises: ValueError for a direction without length and what is not finite."""
        return self._core.hit(as_rows(origins, 'origins', (3,)), as_rows(directions, 'directions', (3,)))
