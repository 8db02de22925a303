# SPDX-License-Identifier: Apache-2.0
"""Assignment and matching of least cost."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_numbers, as_rows, whole


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


def assignment(costs, columns=None):
    """The assignment of rows to columns of least cost (Kuhn-Munkres).

    costs: shape (rows, columns); float64, float32 and int32 are taken as they are. With two arguments: two sets of
    points, shape (n, 2) or (n, 3), by Euclidean distance, whose matrix is never made. Of a sparse matrix of
    scipy.sparse only the stored pairs may be chosen; if they allow no assignment, ValueError is raised. O(n^3) at worst.
    Source: J. Skala, 4.3.1; R. Jonker, A. Volgenant, 1987.

    >>> assignment([[4, 1, 3], [2, 0, 5], [3, 2, 2]])
    <terrace.Assignment: 3 pairs, cost 5>
    """
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
        return f'<terrace.Matching: {len(self.pairs)} pairs, cost {self.cost:g}{", optimal" if self.optimal else ""}>'


def matching(points, *, exact_limit=500_000, window=50_000, rounds=8, threads=None):
    """Pairs of points with the least sum of Euclidean distances; of an odd number one is left over.

    points: shape (n, 2) or (n, 3). Up to ``exact_limit`` points the optimum, beyond it windows of ``window`` points
    matched in ``rounds``, with a proven bound. About n^1.2. Source: J. Skala, 4.3.2, 7.5; J. Edmonds, 1965; W. Cook, A. Rohe, 1999.

    >>> matching([[0, 0], [5, 0], [0, 1], [5, 2]])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    return Matching(*_core.match_points(as_rows(points, 'points'), whole(exact_limit, 'exact_limit', 1), whole(window, 'window', 4),
                                        whole(rounds, 'rounds'), _threads(threads)))


def edge_matching(edges, weights, count=None):
    """The perfect matching of least weight of a graph.

    edges: whole numbers, shape (m, 2): vertices 0, 1, ..; parallel ones are allowed. weights: one for each edge, of any
    sign. count: the number of vertices, by default the largest named and one. Optimal for weights rounded to 2^-52 of the
    largest. Returns: a Matching. Raises: ValueError if there is no perfect matching. Source: J. Edmonds, 1965;
    V. Kolmogorov, 2009.

    >>> edge_matching([[0, 1], [1, 2], [2, 3], [3, 0]], [5, 1, 5, 2])
    <terrace.Matching: 2 pairs, cost 3, optimal>
    """
    edges = as_array(edges, 'edges')
    if edges.size == 0:
        edges = np.empty((0, 2), np.uint32)
    if edges.dtype.kind not in 'iu':
        raise TypeError(f'edges are whole numbers, not {edges.dtype}')
    largest = int(edges.max()) if edges.size else -1
    if edges.min(initial=0) < 0 or largest >= 2 ** 32 - 1:
        raise ValueError('edges have ends that are no vertices')
    count = largest + 1 if count is None else whole(count, 'count')
    if count > 2 * len(edges):
        raise ValueError(f'{len(edges)} edges cannot match {count} vertices')
    return Matching(*_core.match_edges(count, edges.astype(np.uint32), as_numbers(weights, 'weights')))


def _threads(threads):
    return 0 if threads is None else whole(threads, 'threads', 1)
