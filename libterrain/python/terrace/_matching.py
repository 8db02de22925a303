# SPDX-License-Identifier: Apache-2.0
"""Assignment and matching of least cost."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_labels, as_numbered, as_numbers, as_rows, whole


@dataclass(frozen=True)
class Assignment:
    """columns: the column of each row, -1 for none. cost: their sum. row_duals, column_duals: labels that prove it,
    ``row_duals[i] + column_duals[j] <= costs[i, j]``, with equality for chosen pairs.

    Unpacks as (rows, columns) of the chosen pairs, as scipy.optimize.linear_sum_assignment returns.
    """

    columns: np.ndarray
    cost: float
    row_duals: np.ndarray
    column_duals: np.ndarray

    def __iter__(self):
        rows = np.flatnonzero(self.columns >= 0)
        return iter((rows, self.columns[rows]))

    def __repr__(self):
        return f'<terrace.Assignment: {int((self.columns >= 0).sum())} pairs, cost {self.cost:g}>'


def assignment(costs, columns=None, *, shape=None):
    """The assignment of rows to columns of least cost (Kuhn-Munkres).

    costs: shape (rows, columns); float64, float32 and int32 are taken as they are. With two arguments: two sets of
    points, shape (n, 2) or (n, 3), by Euclidean distance, whose matrix is never made. Of a sparse matrix of
    scipy.sparse only the stored pairs may be chosen; if they allow no assignment, ValueError is raised. With ``shape``, (rows,
    columns), ``costs(row)`` returns the costs of a row, always the same ones, and no matrix is held. O(n^3) at worst.
    Source: J. Skala, 4.3.1; R. Jonker, A. Volgenant, 1987.

    >>> assignment([[4, 1, 3], [2, 0, 5], [3, 2, 2]])
    <terrace.Assignment: 3 pairs, cost 5>
    """
    if shape is not None:
        if columns is not None or not callable(costs):
            raise TypeError('`shape` goes with a function that returns the costs of a row')
        rows, columns = shape
        return Assignment(*_core.assign_rows(whole(rows, 'shape'), whole(columns, 'shape'),
                                             lambda row: as_numbers(costs(row), 'a row of costs')))
    if columns is not None:
        a = as_rows(costs, 'the rows\' points')
        return Assignment(*_core.assign_points(a, as_rows(columns, 'the columns\' points', a.shape[1:])))
    if hasattr(costs, 'tocsr'):
        rows = costs.tocsr()
        return Assignment(*_core.assign_sparse(rows.indptr, rows.indices, as_numbers(rows.data, 'costs'), rows.shape[1]))
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
    """mates: the partner of each point, -1 for one that is left over. cost: the sum of the pairs' distances. bound: no
    matching costs less, up to rounding. optimal: whether this is the optimum."""

    mates: np.ndarray
    cost: float
    bound: float
    optimal: bool

    @property
    def pairs(self):
        """int64, shape (n // 2, 2), the smaller number first."""
        first = np.flatnonzero(self.mates > np.arange(len(self.mates)))
        return np.column_stack((first, self.mates[first]))

    def __repr__(self):
        return f'<terrace.{type(self).__name__}: {len(self.pairs)} pairs, cost {self.cost:g}{", optimal" if self.optimal else ""}>'


def matching(points, *, labels=None, exact_limit=500_000, window=50_000, rounds=8, tolerance=1e-3, threads=None):
    """Pairs of points with the least sum of Euclidean distances; of an odd number one is left over.

    points: shape (n, 2) or (n, 3). Up to ``exact_limit`` points the optimum, beyond it windows of ``window`` points
    matched in ``rounds``, with a proven bound, until a round gains less than the share ``tolerance``. labels: whole
    numbers; the points of each label are matched first, then those left over, then windows. About n^1.2. Source: J.
    Skala, 4.3.2, 7.5; J. Edmonds, 1965; W. Cook, A. Rohe, 1999.

    >>> matching([[0, 0], [5, 0], [0, 1], [5, 2]])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    points = as_rows(points, 'points')
    match = _core.match_points3 if points.shape[1] == 3 else _core.match_points2
    return Matching(*match(points, as_labels(labels), whole(exact_limit, 'exact_limit', 1), whole(window, 'window', 4),
                           whole(rounds, 'rounds', bits=32), float(tolerance), _threads(threads)))


@dataclass(frozen=True, repr=False)
class HalvingMatching(Matching):
    """iterations: how many were done. steps: shape (k, 2), the iterations that lowered the cost and the cost after each:
    a convergence curve."""

    iterations: int
    steps: np.ndarray


def halving_matching(points, *, method='monotone', distances=False, iterations=None, seconds=float('inf'), seed=1, threads=None):
    """Pairs by halving: the points are repeatedly divided into two halves at random, which are matched at the least
    total distance. Neither method is exact; matching() is.

    points: shape (n, 2) or (n, 3); with ``distances=True`` the symmetric matrix of distances of any things. method: 'monotone'
    divides each current pair, so no iteration makes the matching worse; 'monte-carlo', as published, takes the best of
    independent iterations. iterations: as many as points by default, each O(n^3) at worst; seconds: none begins after so long.
    Returns: a HalvingMatching, whose bound is 0: not known. Raises: ValueError. Source: J. Skala, 7.5.1.

    >>> halving_matching([[0, 0], [5, 0], [0, 1], [5, 2]])
    <terrace.HalvingMatching: 2 pairs, cost 3>
    """
    array = as_numbers(points, 'points') if distances else as_rows(points, 'points')
    mates, cost, done, steps = _core.match_by_halving(array, bool(distances), method,
                                                      0 if iterations is None else whole(iterations, 'iterations', 1),
                                                      float(seconds), whole(seed, 'seed'), _threads(threads))
    return HalvingMatching(mates, cost, 0.0, False, done, steps)


def edge_matching(edges, weights, count=None):
    """The perfect matching of least weight of a graph.

    edges: whole numbers, shape (m, 2): vertices 0, 1, ..; parallel ones are allowed. weights: one for each edge, of any
    sign. count: the number of vertices, by default the largest named and one. Optimal for weights rounded to 2^-52 of the
    largest. Returns: a Matching. Raises: ValueError if there is no perfect matching. Source: J. Edmonds, 1965;
    V. Kolmogorov, 2009.

    >>> edge_matching([[0, 1], [1, 2], [2, 3], [3, 0]], [5, 1, 5, 2])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    edges = as_numbered(edges, 'edges', 2)
    largest = int(edges.max()) if edges.size else -1
    count = largest + 1 if count is None else whole(count, 'count')
    if count > 2 * len(edges):
        raise ValueError(f'{len(edges)} edges cannot match {count} vertices')
    return Matching(*_core.match_edges(count, edges.astype(np.uint32), as_numbers(weights, 'weights')))


def _threads(threads):
    return 0 if threads is None else whole(threads, 'threads', 1, bits=32)
