# SPDX-License-Identifier: Apache-2.0
"""Assignment and matching with minimum cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_integer, as_labels, as_numbered, as_numbers, as_rows
from ._call import thread_count
from ._names import HalvingMethod
from ._types import AnyArray, Array, Float64Array, Int64Array, SparseMatrix


@dataclass(frozen=True)
class Assignment:
    """The result of assignment().

    It unpacks as (rows, columns) of the chosen pairs, like the result of scipy.optimize.linear_sum_assignment.

    columns: the column assigned to each row, -1 for none.
    cost: the sum of the chosen costs.
    row_duals, column_duals: labels that prove the optimum: ``row_duals[i] + column_duals[j] <= costs[i, j]``, with
        equality for chosen pairs.
    """

    columns: Int64Array
    cost: float
    row_duals: AnyArray
    column_duals: AnyArray

    def __iter__(self) -> Iterator[Int64Array]:
        rows = np.flatnonzero(self.columns >= 0)
        return iter((rows, self.columns[rows]))

    def __repr__(self) -> str:
        return f'<terrace.Assignment: {int((self.columns >= 0).sum())} pairs, cost {self.cost:g}>'


def assignment(costs: Array | SparseMatrix | Callable[[int], Array], columns: Array | None = None, *,
               shape: tuple[int, int] | None = None) -> Assignment:
    """Assigns rows to columns with minimum total cost (Kuhn-Munkres).

    costs: one of these:

    - a matrix, shape (rows, columns); float64, float32 and int32 are used without conversion;
    - a sparse matrix of scipy.sparse, of which only stored pairs may be chosen;
    - a set of points, shape (n, 2) or (n, 3), with ``columns`` as a second set: costs are Euclidean distances, and no
      matrix is made;
    - with ``shape``, (rows, columns), a function costs(row) that returns the costs of a row, the same ones at every
      call; no matrix is kept.

    Returns: an Assignment. O(n^3) time in the worst case.
    Raises: ValueError, also if a sparse matrix allows no assignment; TypeError.

    Source: J. Skala, 4.3.1; R. Jonker, A. Volgenant, 1987.

    >>> assignment([[4, 1, 3], [2, 0, 5], [3, 2, 2]])
    <terrace.Assignment: 3 pairs, cost 5>
    """
    if shape is not None:
        if columns is not None or not callable(costs):
            raise TypeError('`shape` needs a function that returns the costs of a row')
        rows, columns = shape
        return Assignment(*_core.assign_rows(as_integer(rows, 'shape'), as_integer(columns, 'shape'),
                                             lambda row: as_numbers(costs(row), 'a row of costs')))
    if columns is not None:
        a = as_rows(costs, 'the rows\' points')
        return Assignment(*_core.assign_points(a, as_rows(columns, 'the columns\' points', a.shape[1:])))
    if hasattr(costs, 'tocsr'):
        matrix = costs.tocsr()
        return Assignment(*_core.assign_sparse(matrix.indptr, matrix.indices, as_numbers(matrix.data, 'costs'), matrix.shape[1]))
    array = as_array(costs, 'costs')
    if array.ndim != 2:
        raise ValueError(f'costs must have two dimensions, not {array.ndim}')
    if array.dtype.kind not in 'iufb':
        raise TypeError(f'costs have the type {array.dtype}; real numbers are needed')
    if array.dtype not in (np.float64, np.float32, np.int32):
        array = array.astype(np.float64)
    return Assignment(*_core.assign(np.ascontiguousarray(array)))


@dataclass(frozen=True)
class Matching:
    """The result of matching() and edge_matching().

    mates: the partner of each point, -1 for one without a partner.
    cost: the sum of the pairs' distances.
    bound: no matching costs less, up to rounding.
    optimal: whether the cost is proven to be minimal.
    """

    mates: Int64Array
    cost: float
    bound: float
    optimal: bool

    @property
    def pairs(self) -> Int64Array:
        """The pairs, int64, shape (n // 2, 2), with the smaller number first."""
        first = np.flatnonzero(self.mates > np.arange(len(self.mates)))
        return np.column_stack((first, self.mates[first]))

    def __repr__(self) -> str:
        return f'<terrace.{type(self).__name__}: {len(self.pairs)} pairs, cost {self.cost:g}{", optimal" if self.optimal else ""}>'


def matching(points: Array, *, labels: Array | None = None, exact_limit: int = 500_000, window: int = 50_000, rounds: int = 8,
             tolerance: float = 1e-3, threads: int | None = None) -> Matching:
    """Pairs points so that the sum of Euclidean distances is minimal.

    Of an odd number of points, one stays without a partner.

    points: shape (n, 2) or (n, 3).
    exact_limit: up to this number of points the result is optimal. Larger sets are matched in windows, with a proven
        bound.
    window: the number of points in a window.
    rounds, tolerance: windows are matched at most ``rounds`` times, until a round lowers the cost by less than the
        fraction ``tolerance``.
    labels: integers. Points with the same label are matched first, then those left over, then windows.

    Returns: a Matching, in about n^1.2 time.
    Raises: ValueError, TypeError.

    Source: J. Skala, 4.3.2, 7.5; J. Edmonds, 1965; W. Cook, A. Rohe, 1999.

    >>> matching([[0, 0], [5, 0], [0, 1], [5, 2]])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    points = as_rows(points, 'points')
    match = _core.match_points3 if points.shape[1] == 3 else _core.match_points2
    return Matching(*match(points, as_labels(labels), as_integer(exact_limit, 'exact_limit', 1), as_integer(window, 'window', 4),
                           as_integer(rounds, 'rounds', bits=32), float(tolerance), thread_count(threads)))


@dataclass(frozen=True, repr=False)
class HalvingMatching(Matching):
    """The result of halving_matching().

    iterations: the number of iterations that ran.
    steps: shape (k, 2), a convergence curve: the iterations that lowered the cost, and the cost after each.
    """

    iterations: int
    steps: Float64Array


def halving_matching(points: Array, *, method: HalvingMethod = 'monotone', distances: bool = False,
                     iterations: int | None = None, seconds: float = float('inf'), seed: int = 1,
                     threads: int | None = None) -> HalvingMatching:
    """Pairs points by repeatedly dividing them into two random halves, which are matched at the least total distance.

    The result is approximate; matching() finds the optimum.

    points: shape (n, 2) or (n, 3).
    distances: whether ``points`` is a symmetric matrix of distances, shape (n, n), between things of any kind.
    method: 'monotone' divides each current pair, so no iteration makes the matching worse. 'monte-carlo', as
        published, keeps the best of independent iterations.
    iterations: as many as points by default, each O(n^3) in the worst case.
    seconds: no iteration begins after this time.

    Returns: a HalvingMatching. Its bound is 0 because none is known.
    Raises: ValueError.

    Source: J. Skala, 7.5.1.

    >>> halving_matching([[0, 0], [5, 0], [0, 1], [5, 2]])
    <terrace.HalvingMatching: 2 pairs, cost 3>
    """
    array = as_numbers(points, 'points') if distances else as_rows(points, 'points')
    mates, cost, done, steps = _core.match_by_halving(array, bool(distances), method,
                                                      0 if iterations is None else as_integer(iterations, 'iterations', 1),
                                                      float(seconds), as_integer(seed, 'seed'), thread_count(threads))
    return HalvingMatching(mates, cost, 0.0, False, done, steps)


def edge_matching(edges: Array, weights: Array, count: int | None = None) -> Matching:
    """Returns the perfect matching of a graph with minimum total weight.

    edges: integers, shape (m, 2): vertices 0, 1, ...; parallel edges are allowed.
    weights: one per edge, of any sign. The result is optimal for weights rounded to 2^-52 of the largest.
    count: the number of vertices, by default the largest named number plus one.

    Returns: a Matching.
    Raises: ValueError if there is no perfect matching.

    Source: J. Edmonds, 1965; V. Kolmogorov, 2009.

    >>> edge_matching([[0, 1], [1, 2], [2, 3], [3, 0]], [5, 1, 5, 2])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    edges = as_numbered(edges, 'edges', 2)
    largest = int(edges.max()) if edges.size else -1
    count = largest + 1 if count is None else as_integer(count, 'count')
    if count > 2 * len(edges):
        raise ValueError(f'{len(edges)} edges cannot match {count} vertices')
    return Matching(*_core.match_edges(count, edges.astype(np.uint32), as_numbers(weights, 'weights')))
