# SPDX-License-Identifier: Apache-2.0
"""Trees of repeated matching, and queries in bounding volumes."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_labels, as_numbered, as_numbers, as_rows, whole
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


def matching_tree(points, *, weights=None, labels=None, matcher=None, threads=None):
    """The binary tree of repeated matching: points are matched, each pair becomes a point, and so on until one is left.

    points: shape (n, 2) or (n, 3), finite. weights: positive, one for each point. labels: whole numbers; the points
    of each label become a tree, then the roots are matched. matcher: in place of matching(), called as matcher(points) for each
    level, returns the partner of each point, -1 for exactly one if their number is odd; so halving_matching gives the trees
    of halving. About twice the time of one matching(). Raises: ValueError. Source: J. Skala, 7.5.1.

    >>> matching_tree([[0, 0], [5, 0], [0, 1], [5, 1]]).rows
    array([[0., 2., 1., 2.],
           [1., 3., 1., 2.],
           [4., 5., 5., 4.]])
    """
    points = as_rows(points, 'points')
    weights = np.empty(0) if weights is None else as_numbers(weights, 'weights')
    if matcher is not None and not callable(matcher):
        raise TypeError('`matcher` is a function')
    make = _core.matching_tree3 if points.shape[1] == 3 else _core.matching_tree2
    return MatchingTree(*make(points, weights, as_labels(labels),
                              None if matcher is None else lambda nodes: as_numbered(matcher(nodes), 'partners', least=-1),
                              _threads(threads)))


def rotate_tree(tree, lower, upper=None, *, passes=16):
    """A tree whose boxes are smaller, by rotations from the leaves upward: a child changes places with a child of its
    sibling where that helps.

    tree: the rows of a MatchingTree, of any linkage, or two columns of children. lower, upper: the corners of the boxes
    of its leaves, shape (n, 2) or (n, 3); for points ``lower`` alone. Returns: the children of each node, uint32, shape
    (n - 1, 2), which PointTree and TriangleTree take. Raises: ValueError. About 0.5 us a box. Source: A. Kensler, 2008.

    >>> points = np.random.default_rng(1).random((500, 2))
    >>> tree = matching_tree(points)
    >>> PointTree(points, rotate_tree(tree, points)).cost < PointTree(points, tree).cost
    True
    """
    lower = as_rows(lower, 'lower')
    upper = lower if upper is None else as_rows(upper, 'upper', lower.shape[1:])
    rotate = _core.rotate_tree3 if lower.shape[1] == 3 else _core.rotate_tree2
    return rotate(_children(tree, lower), lower, upper, whole(passes, 'passes', bits=32))


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
        vertices = as_rows(vertices, 'vertices', (3,))
        triangles = as_numbered(triangles, 'triangles', 3, most=len(vertices) - 1)
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
