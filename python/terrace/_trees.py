# SPDX-License-Identifier: Apache-2.0
"""Trees of repeated matching, and queries in bounding volume hierarchies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._arrays import as_integer, as_labels, as_numbered, as_numbers, as_rows
from ._call import thread_count
from ._types import Array, Float64Array, Int64Array, UInt32Array


@dataclass(frozen=True)
class MatchingTree:
    """The result of matching_tree().

    rows: float64, shape (n - 1, 4), numbered like SciPy's linkage but not sorted by distance: the two children of
        each node, the distance between their positions, and the number of points below.
    levels: the matching that made each row, from 1.
    positions: the (weighted) mean of the points below each row's node.
    """

    rows: Float64Array
    levels: UInt32Array
    positions: Float64Array

    def __repr__(self) -> str:
        depth = int(self.levels.max()) if len(self.levels) else 0
        return f'<terrace.MatchingTree: {len(self.rows)} rows, {depth} levels>'


def matching_tree(points: Array, *, weights: Array | None = None, labels: Array | None = None,
                  matcher: Callable[[Float64Array], Array] | None = None, threads: int | None = None) -> MatchingTree:
    """Builds the binary tree of repeated matching.

    Matches points, replaces each pair by a point, and repeats until one is left.

    points: shape (n, 2) or (n, 3), finite.
    weights: positive, one per point.
    labels: integers. The points of each label form a tree, then the roots are matched.
    matcher: a function that replaces matching(). matcher(points) is called for each level and returns the partner of
        each point, -1 for exactly one point if their number is odd. With halving_matching it gives the trees of
        halving.

    Returns: a MatchingTree. Takes about twice the time of one matching().
    Raises: ValueError.

    Source: J. Skala, 7.5.1.

    >>> matching_tree([[0, 0], [5, 0], [0, 1], [5, 1]]).rows
    array([[0., 2., 1., 2.],
           [1., 3., 1., 2.],
           [4., 5., 5., 4.]])
    """
    points = as_rows(points, 'points')
    weights = np.empty(0) if weights is None else as_numbers(weights, 'weights')
    if matcher is not None and not callable(matcher):
        raise TypeError('`matcher` must be a function')
    make = _core.matching_tree3 if points.shape[1] == 3 else _core.matching_tree2
    return MatchingTree(*make(points, weights, as_labels(labels),
                              None if matcher is None else lambda nodes: as_numbered(matcher(nodes), 'partners', least=-1),
                              thread_count(threads)))


def rotate_tree(tree: MatchingTree | Array, lower: Array, upper: Array | None = None, *,
                passes: int = 16) -> UInt32Array:
    """Makes the boxes of a tree smaller by rotations from the leaves upward.

    A rotation exchanges a child with a child of its sibling if that helps.

    tree: a MatchingTree or its rows, a linkage, or two columns of children.
    lower, upper: the corners of the leaves' boxes, shape (n, 2) or (n, 3). For points, give ``lower`` only.

    Returns: the children of each node, uint32, shape (n - 1, 2), which PointTree and TriangleTree accept. Takes about
        0.5 microseconds per box.
    Raises: ValueError.

    Source: A. Kensler, 2008.

    >>> points = np.random.default_rng(1).random((500, 2))
    >>> tree = matching_tree(points)
    >>> PointTree(points, rotate_tree(tree, points)).cost < PointTree(points, tree).cost
    True
    """
    lower = as_rows(lower, 'lower')
    upper = lower if upper is None else as_rows(upper, 'upper', lower.shape[1:])
    rotate = _core.rotate_tree3 if lower.shape[1] == 3 else _core.rotate_tree2
    return rotate(_children(tree, lower), lower, upper, as_integer(passes, 'passes', bits=32))


def _children(tree: MatchingTree | Array | None, points: Float64Array) -> Float64Array:
    """Returns the two columns of children of a tree in any accepted form; None gives a new matching_tree()."""
    if tree is None:
        tree = matching_tree(points) if len(points) else np.empty((0, 4))
    rows = as_rows(getattr(tree, 'rows', tree), 'the tree', (4, 2))
    return np.ascontiguousarray(rows[:, :2])


class _Tree:
    _core: Any
    _count: int
    _what: str

    @property
    def cost(self) -> float:
        """The expected cost of a random ray that hits the root's box, by the surface area heuristic with unit costs."""
        return self._core.cost()

    @property
    def depth(self) -> int:
        """The number of nodes above the deepest leaf."""
        return self._core.depth()

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f'<terrace.{type(self).__name__}: {self._count} {self._what}, depth {self.depth}>'


class PointTree(_Tree):
    """A bounding volume hierarchy over points, for nearest neighbours and ray queries. Threads may share one.

    points: shape (n, 2) or (n, 3), finite.
    tree: the rows of a MatchingTree or of any linkage over the points; a matching_tree() by default. Results do not
        depend on it; ties go to the lowest index.

    Source: J. Skala, 7.5.1; I. Wald, 2007.

    >>> tree = PointTree([[0, 0], [5, 0], [0, 1], [5, 2]])
    >>> tree.nearest([[1, 0]], k=2)
    (array([[0, 2]]), array([[1.        , 1.41421356]]))
    """

    _what = 'points'

    def __init__(self, points: Array, tree: MatchingTree | Array | None = None) -> None:
        points = as_rows(points, 'points')
        self._count, self._width = points.shape
        kind = _core.PointTree3 if self._width == 3 else _core.PointTree2
        self._core = kind(_children(tree, points), points)

    def nearest(self, places: Array, k: int = 1) -> tuple[Int64Array, Float64Array]:
        """Finds the ``k`` points nearest to each place.

        Returns: (indices, int64; distances, float64), both of shape (m, k), nearest first; -1 and infinity if there
            are fewer points.
        Raises: ValueError.
        """
        places, k = as_rows(places, 'places', (self._width,)), as_integer(k, 'k', 1)
        found, distances = self._core.nearest(places, min(k, self._count))
        shape = (len(places), min(k, self._count))
        more = ((0, 0), (0, k - shape[1]))
        return (np.pad(found.reshape(shape), more, constant_values=-1),
                np.pad(distances.reshape(shape), more, constant_values=np.inf))

    def hit(self, origins: Array, directions: Array, radius: float) -> tuple[Int64Array, Float64Array]:
        """Finds the first ball along each ray, among balls of one radius around the points, which must be in space.

        origins, directions: shape (m, 3).

        Returns: (indices, int64, -1 for none; t, float64, in multiples of the direction's length, 0 inside a ball,
            infinity for none).
        Raises: ValueError.
        """
        if self._width != 3:
            raise ValueError('rays need points in space')
        return self._core.hit(as_rows(origins, 'origins', (3,)), as_rows(directions, 'directions', (3,)), float(radius))


class TriangleTree(_Tree):
    """A bounding volume hierarchy over triangles in space, for ray queries and nearest triangles.

    vertices: shape (n, 3).
    triangles: shape (m, 3), rows of ``vertices``, so ``TriangleTree(*mesh)`` accepts a Mesh.
    tree: as in PointTree, over the triangles.

    Source: J. Skala, 7.5.1; S. Woop, C. Benthin, I. Wald, 2013.

    >>> tree = TriangleTree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> tree.hit([[0.2, 0.2, 5]], [[0, 0, -1]])
    (array([0]), array([5.]))
    """

    _what = 'triangles'

    def __init__(self, vertices: Array, triangles: Array, tree: MatchingTree | Array | None = None) -> None:
        vertices = as_rows(vertices, 'vertices', (3,))
        triangles = as_numbered(triangles, 'triangles', 3, most=len(vertices) - 1)
        self._count = len(triangles)
        middles = _core.centroids(vertices, triangles)
        self._core = _core.TriangleTree(_children(tree, middles), vertices, triangles)

    def nearest(self, places: Array) -> tuple[Int64Array, Float64Array]:
        """Finds the triangle nearest to each place, shape (m, 3). Ties go to the lowest index.

        Returns: (indices, int64; distances, float64); -1 and infinity if there are no triangles.
        Raises: ValueError.
        """
        return self._core.nearest(as_rows(places, 'places', (3,)))

    def hit(self, origins: Array, directions: Array) -> tuple[Int64Array, Float64Array]:
        """Finds the first triangle along each ray, from either side.

        No ray slips between triangles that share an edge.

        origins, directions: shape (m, 3).

        Returns: (indices, int64, -1 for none; t, float64, in multiples of the direction's length, infinity for none).
        Raises: ValueError for a direction of length zero and for numbers that are not finite.
        """
        return self._core.hit(as_rows(origins, 'origins', (3,)), as_rows(directions, 'directions', (3,)))
