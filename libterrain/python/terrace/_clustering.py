# SPDX-License-Identifier: Apache-2.0
"""Clustering in memory: facility location, linkage, k-means."""

import math
from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_numbers, as_rows, whole


def _threads(threads):
    return 0 if threads is None else whole(threads, 'threads', 1)


def _weights(weights):
    return np.empty(0) if weights is None else as_numbers(weights, 'weights')


def linkage(points, method='single', *, threads=None):
    """Single or complete linkage of points with Euclidean distances, or complete linkage of given distances.

    points: shape (n, 2) or (n, 3), finite; or the distances of all pairs in one dimension, as
    scipy.spatial.distance.pdist. Returns: float64, shape (n - 1, 4), as scipy.cluster.hierarchy.linkage: the two clusters
    of each merge, its height and the number of points; the merges ascend. 'single' takes O(n log n); 'complete' O(n^2)
    and 4 n^2 bytes. Raises: ValueError. Source: J. Skala, 4.2.1, 7.6; O. Boruvka, 1926, over a kD-tree.

    >>> linkage([[0, 0], [1, 0], [5, 0]])
    array([[0., 1., 1., 2.],
           [2., 3., 4., 3.]])
    """
    array = as_numbers(points, 'points')
    if array.ndim == 1 and array.size > 0:
        if method != 'complete':
            raise ValueError("of distances there is only method='complete'")
        count = (1 + math.isqrt(1 + 8 * array.size)) // 2
        if count * (count - 1) // 2 != array.size:
            raise ValueError(f'{array.size} distances are not those of all pairs')
        return _core.linkage_of_distances(count, array, _threads(threads))
    return _core.linkage(as_rows(array, 'points'), method, _threads(threads))


def spanning_tree(points, *, threads=None):
    """The minimum spanning tree of points: the lines of least total length that connect all.

    points: shape (n, 2) or (n, 3), finite. Returns: (edges, uint32, shape (n - 1, 2), numbers of points; their lengths,
    float64), in no particular order. O(n log n). Raises: ValueError. Source: O. Boruvka, 1926.

    >>> spanning_tree([[0, 0], [5, 0], [1, 0]])[1].sum()
    5.0
    """
    return _core.spanning_tree(as_rows(points, 'points'), _threads(threads))


def flat_clusters(rows, *, count=None, height=None):
    """The label of each point, 0, 1, .. in the order of appearance, by a cut of a linkage: at most ``count``
    clusters, or all merges up to a ``height``.

    >>> flat_clusters(linkage([[0, 0], [1, 0], [5, 0]]), count=2)
    array([0, 0, 1], dtype=uint32)
    """
    if (count is None) == (height is None):
        raise ValueError('flat_clusters() needs either `count` or `height`')
    return _core.cut(as_rows(rows, 'the linkage', (4,)), None if count is None else whole(count, 'count', 1), height)


@dataclass(frozen=True)
class KMeans:
    """centres: shape (k, 2) or (k, 3). labels: the nearest centre of each point. inertia: the sum of (weighted)
    squared distances."""

    centres: np.ndarray
    labels: np.ndarray
    inertia: float
    iterations: int
    converged: bool

    def __repr__(self):
        return f'<terrace.KMeans: {len(self.centres)} clusters, inertia {self.inertia:g}>'


def kmeans(points, clusters, *, weights=None, seed=1, restarts=1, max_iterations=300, tolerance=0.0, threads=None):
    """k-means by Lloyd's iteration, exact, from seeds by greedy k-means++ or from given centres.

    points: shape (n, 2) or (n, 3). clusters: their number, or the centres to start from. tolerance: a run ends when no
    centre moves by more than this share of the bounding box's diagonal; 0: when no label changes. Of ``restarts`` the
    best counts. Sources: S. Lloyd, 1982; D. Arthur, S. Vassilvitskii, 2007; T. Kanungo et al., 2002.

    >>> kmeans([[0, 0], [0, 1], [9, 0], [9, 1]], 2)
    <terrace.KMeans: 2 clusters, inertia 1>
    """
    points = as_rows(points, 'points')
    start, count = None, 0
    if np.ndim(clusters) == 0:
        count = whole(clusters, 'clusters', 1)
    else:
        start = as_rows(clusters, 'clusters', points.shape[1:])
        if len(start) == 0:
            raise ValueError('there is not one centre to start from')
    centres, labels, inertia, iterations, converged = _core.k_means(
        points, start, count, _weights(weights), whole(seed, 'seed'), whole(restarts, 'restarts', 1),
        whole(max_iterations, 'max_iterations'), float(tolerance), _threads(threads))
    return KMeans(centres[:, :points.shape[1]], labels, inertia, iterations, converged)


@dataclass(frozen=True)
class Clusters:
    """facilities: the points that represent clusters, ascending. labels: the cluster of each point, -1 for an outlier.
    cost: the sum of the three that follow it. lower_bound: no solution costs less; 0: not known."""

    facilities: np.ndarray
    labels: np.ndarray
    opening_cost: float
    connection_cost: float
    outlier_cost: float
    lower_bound: float

    @property
    def cost(self):
        """What is minimised."""
        return self.opening_cost + self.connection_cost + self.outlier_cost

    def __repr__(self):
        return f'<terrace.Clusters: {len(self.facilities)} clusters of {len(self.labels)} points, cost {self.cost:g}>'


def cluster(points, facility_cost=1.0, *, count=None, method='fast', effort='default', metric='euclidean', weights=None,
            outlier_price=float('inf'), seed=1, bound_steps=0, threads=None):
    """Facility location: clusters whose number is not given but costs; or, with ``count``, k-median: exactly so many.

    Each cluster costs ``facility_cost`` times the diagonal of the points' bounding box, each point its (weighted) distance
    to its cluster's representative, which is one of the points; the sum is minimised.

    points: shape (n, 2) or (n, 3). count: in place of facility_cost, method and effort; O(n^2) for a round of exchanges.
    method: 'fast' (not with outliers); the thesis's local searches 'automatic',
    'full-scan', 'quadtree', 'octree', 'kd-tree', 'facilities'; on the matrix of distances (8 n^2 bytes) 'interchange',
    'jain-vazirani', 'greedy-stars'. effort: 'fast', 'default', 'fine', 'full'. metric: 'euclidean', 'squared',
    'minkowski:P', 'elliptical:FILE'. outlier_price: what leaving a point out costs, times the diagonal.
    bound_steps: subgradient steps of a search for lower_bound, some 100; 0: none. Not used with ``count``.

    Sources: J. Skala, 4.2.3, 7.1, 7.3; of k-median L. O'Callaghan et al., 2002.

    >>> found = cluster([[0, 0], [0, 1], [9, 0], [9, 1]], facility_cost=0.2)
    >>> found.labels
    array([0, 0, 1, 1])
    """
    count = None if count is None else whole(count, 'count', 1)
    return Clusters(*_core.facility_location(as_rows(points, 'points'), float(facility_cost), count, method, effort, metric,
                                             _weights(weights), float(outlier_price), whole(seed, 'seed'),
                                             whole(bound_steps, 'bound_steps'), _threads(threads)))


def facility_location(connection, opening=None, *, count=None, method='interchange', effort='default', seed=1, bound_steps=300,
                      threads=None):
    """Facility location with any costs: which facilities to open, and which of them serves each client.

    connection: shape (facilities, clients), not negative; a matrix of distances for entities of any kind. opening: the
    cost of each facility, or one for all. With ``count`` exactly so many open, at no cost (k-median). method:
    'interchange', 'jain-vazirani', 'greedy-stars'. bound_steps: the steps of a search for lower_bound; 0: none. Each takes
    O(facilities * clients); 12 bytes per entry of the matrix.

    Returns: Clusters, whose facilities are rows and whose labels are of clients. Raises: ValueError. Sources: J. Skala,
    4.2.3, 7.3; D. Erlenkotter, 1978.

    >>> found = facility_location([[1, 9, 9], [9, 1, 2]], 3)
    >>> found.facilities, found.labels, found.cost, found.lower_bound > 9.9
    (array([0, 1], dtype=uint32), array([0, 1, 1]), 10.0, True)
    """
    connection = as_numbers(connection, 'connection')
    if connection.ndim != 2:
        raise ValueError(f'connection costs have two dimensions, not {connection.ndim}')
    if opening is None:
        if count is None:
            raise ValueError('facility_location() needs `opening` or `count`')
        opening = 0
    if np.ndim(opening) == 0:
        opening = np.full(len(connection), opening)
    opening = as_numbers(opening, 'opening')
    return Clusters(*_core.facility_matrix(connection, opening, None if count is None else whole(count, 'count', 1), method, effort,
                                           whole(seed, 'seed'), whole(bound_steps, 'bound_steps'), _threads(threads)))
