# SPDX-License-Identifier: Apache-2.0
"""Clustering in memory: facility location, linkage, k-means."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_array, as_numbered, as_numbers, as_rows, whole
from ._job import job


def _threads(threads):
    return 0 if threads is None else whole(threads, 'threads', 1, bits=32)


def _weights(weights):
    return np.empty(0) if weights is None else as_numbers(weights, 'weights')


def linkage(points, method='single', *, edges=None, single_precision=False, memory=None, gpu=False, threads=None):
    """Hierarchical clustering by the methods of scipy.cluster.hierarchy.linkage.

    points: shape (n, 2) or (n, 3), finite, with Euclidean distances; or the distances of all pairs in one dimension, as
    scipy.spatial.distance.pdist. method: 'single', 'complete', 'average', 'weighted', 'ward', 'centroid', 'median'; of
    distances the last three are meaningful only if these are Euclidean. Returns: float64, shape (n - 1, 4), as SciPy: the
    two clusters of each merge, its height and the number of points. Heights ascend, except with 'centroid' and
    'median', where a merge may be lower than its parts. Equal distances allow several results; 'average' and
    'weighted' give SciPy's, to the last bit.

    Of points 'single' takes O(n log n) time; 'ward', 'centroid' and 'median' O(n^2), and 120 n bytes; 'complete',
    'average' and 'weighted', and all of distances, O(n^2) and 4 n^2 bytes, half of that with ``single_precision``.
    memory: the most bytes they may take. edges: whole numbers, shape (m, 2): single linkage looks at these pairs alone,
    which suffices if those of a Delaunay triangulation are among them. gpu: 'single' or 'complete' on the first CUDA
    device, if the module was built with CUDA. Raises: ValueError; RuntimeError without such a device. Source: J. Skala,
    4.2.1, 7.6; O. Boruvka, 1926, over a kD-tree; D. Muellner, 2011.

    >>> linkage([[0, 0], [1, 0], [5, 0]])
    array([[0., 1., 1., 2.],
           [2., 3., 4., 3.]])
    """
    array = as_numbers(points, 'points')
    how = {'threads': _threads(threads), 'single_precision': bool(single_precision), 'gpu': bool(gpu),
           'memory': 0 if memory is None else whole(memory, 'memory', 1)}
    if gpu and method not in ('single', 'complete'):
        raise ValueError("`gpu` is for method='single' or 'complete'")
    if edges is not None:
        if method != 'single' or gpu:
            raise ValueError("`edges` are for method='single', not on a GPU")
        edges = as_numbered(edges, 'edges', 2)
    if array.ndim == 1 and array.size > 0:
        if edges is not None or gpu:
            raise ValueError('`edges` and `gpu` are for points')
        count = (1 + math.isqrt(1 + 8 * array.size)) // 2
        if count * (count - 1) // 2 != array.size:
            raise ValueError(f'{array.size} distances are not those of all pairs')
        return _core.linkage_of_distances(count, array, method, how)
    return _core.linkage(as_rows(array, 'points'), method, edges, how)


def tree_linkage(edges, lengths):
    """The linkage whose merges are the edges of a tree by ascending length, as of spanning_tree() in any metric.

    edges: whole numbers, shape (n - 1, 2), in any order, that connect the points 0 .. n - 1. lengths: not negative.
    Returns: rows as linkage(). O(n log n). Raises: ValueError, naming an edge that closes a cycle.

    >>> tree_linkage([[1, 2], [0, 1]], [4, 1])
    array([[0., 1., 1., 2.],
           [2., 3., 4., 3.]])
    """
    return _core.tree_linkage(as_numbered(edges, 'edges', 2), as_numbers(lengths, 'lengths'))


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
    clusters, or the largest clusters inside which no merge is higher than ``height``.

    >>> flat_clusters(linkage([[0, 0], [1, 0], [5, 0]]), count=2)
    array([0, 0, 1], dtype=uint32)
    """
    if (count is None) == (height is None):
        raise ValueError('flat_clusters() needs either `count` or `height`')
    return _core.cut(as_rows(rows, 'the linkage', (4,)), None if count is None else whole(count, 'count', 1),
                     None if height is None else float(height))


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


def _search(method, effort, count, seed, threads, bound_steps, restarts, **more):
    given = {'method': method, 'effort': effort, 'seed': whole(seed, 'seed'), 'threads': _threads(threads),
             'bound_steps': whole(bound_steps, 'bound_steps')}
    if count is not None:
        given['count'] = whole(count, 'count', 1)
    if restarts is not None:
        given['restarts'] = whole(restarts, 'restarts', 1)
    return {**given, **more}


def cluster(points, facility_cost=1.0, *, count=None, method=None, effort='default', metric='euclidean', weights=None, channels=None,
            outlier_price=float('inf'), seed=1, bound_steps=0, restarts=None, steps=None, start=None, assign_nearest=False,
            ordered=False, threads=None):
    """Facility location: clusters whose number is not given but costs; or, with ``count``, k-median: exactly so many.

    Each cluster costs ``facility_cost`` times the diagonal of the points' bounding box, each point its (weighted) distance
    to its cluster's representative, which is one of the points; the sum is minimised.

    points: shape (n, 2) or (n, 3); or entities of k corners each, shape (n, k, 2) or (n, k, 3): segments, triangles,
    polylines, by entity_distances(). count: in place of facility_cost, method and effort; O(n^2) for a round of
    exchanges, the best of ``restarts``. method: 'fast', the default for points (not with outliers or channels); the
    thesis's local searches 'automatic', 'full-scan', 'quadtree', 'octree', 'kd-tree', 'facilities'; on the matrix of
    distances (8 n^2 bytes) 'interchange', 'jain-vazirani', 'greedy-stars', and 'lp-rounding' where GLPK was built in.
    effort: 'fast', 'default', 'fine', 'full'. metric: 'euclidean', 'squared', 'minkowski:P', 'elliptical:FILE'.
    outlier_price: what leaving a point out costs, times the diagonal. channels: shape (n, c): attributes as further
    axes of distances, in the unit of the coordinates; the diagonal has them too. bound_steps: subgradient steps of a
    search for lower_bound, some 100; 0: none. Not used with ``count``. Local searches: ``steps`` candidates in place of
    what effort says; start: Clusters to begin with; assign_nearest: at the end each point goes to its nearest
    representative. ordered: entities of three corners are polylines, not triangles. Ctrl-C ends local searches soon.

    Returns: Clusters. Raises: ValueError. Sources: J. Skala, 4.2.3, 7.1, 7.3, chapter 9; for k-median L. O'Callaghan et al., 2002.

    >>> found = cluster([[0, 0], [0, 1], [9, 0], [9, 1]], facility_cost=0.2)
    >>> found.labels
    array([0, 0, 1, 1])
    """
    array = as_numbers(points, 'points')
    entities = array.ndim == 3
    if method is None:
        method = 'automatic' if entities or channels is not None else 'fast'
    more = {'assign_nearest': bool(assign_nearest)}
    if steps is not None:
        more['steps'] = whole(steps, 'steps')
    if start is not None:
        if not isinstance(start, Clusters):
            raise TypeError(f'`start` is Clusters, not {type(start).__name__}')
        more['start'] = (start.facilities, start.labels)
    how = _search(method, effort, count, seed, threads, bound_steps, restarts, **more)
    if entities:
        if metric != 'euclidean' or channels is not None:
            raise ValueError('entities have no `metric` and no `channels`')
        return Clusters(*_core.entity_location(array, bool(ordered), float(facility_cost), _weights(weights), float(outlier_price), how))
    return Clusters(*_core.facility_location(as_rows(array, 'points'), float(facility_cost), metric, _weights(weights),
                                             None if channels is None else as_numbers(channels, 'channels'), float(outlier_price), how))


def entity_distances(a, b=None, *, ordered=False):
    """How far the corners of one entity must move to coincide with those of another: the root mean square under the
    best correspondence.

    a, b: shape (n, k, 2) or (n, k, 3): segments (k = 2), triangles (3), or polylines, whose corners keep their order or
    its reverse; of three corners if ``ordered``. b: ``a`` itself by default. Returns: float64, shape (len(a), len(b)):
    a metric, which facility_location() and, above the diagonal, linkage() take. Raises: ValueError. Source: J. Skala,
    chapter 9.

    >>> entity_distances([[[0, 0], [1, 0]]], [[[1, 2], [0, 2]]])
    array([[2.]])
    """
    a = as_numbers(a, 'a')
    b = a if b is None else as_numbers(b, 'b')
    return _core.entity_distances(a, b, bool(ordered)).reshape(len(a), len(b))


def clusters_of_size(points, size, *, seed=1, progress=None, threads=None):
    """Cuts a large set into compact parts: the clusters of that level of a hierarchy whose mean size is nearest to
    ``size`` (as a factor). Levels have clusters of some 85 points, 7,000, and so on; up to 10,000 points are one cluster.

    points: shape (n, 2) or (n, 3), finite. Returns: uint32, shape (n,): the cluster of each point, from 0 without gaps.
    O(n log n); Ctrl-C ends it soon. Raises: ValueError. Source: J. Skala, 7.1.

    >>> labels = clusters_of_size(np.random.default_rng(1).random((20000, 2)), 100)
    >>> 150 < labels.max() < 300
    True
    """
    return _core.clusters_of_size(as_rows(points, 'points'), float(size), whole(seed, 'seed'), job(progress, threads))


def facility_location(connection, opening=None, *, count=None, method='interchange', effort='default', seed=1, bound_steps=300,
                      restarts=None, seconds=float('inf'), threads=None):
    """Facility location with any costs: which facilities to open, and which of them serves each client.

    connection: shape (facilities, clients), not negative; a matrix of distances for entities of any kind. opening: the
    cost of each facility, or one for all. With ``count`` exactly so many open, at no cost (k-median). method:
    'interchange', 'jain-vazirani', 'greedy-stars', and 'lp-rounding' where GLPK was built in. restarts: independent
    searches in place of what effort says; seconds: none is perturbed after so long. bound_steps: the steps of a search
    for lower_bound; 0: none. Each takes O(facilities * clients); 12 bytes per entry of the matrix.

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
    return Clusters(*_core.facility_matrix(connection, opening, _search(method, effort, count, seed, threads, bound_steps, restarts,
                                                                        seconds=float(seconds))))


@dataclass(frozen=True)
class ClusterBlock:
    """A finished block of stream_clusters(). Points are numbered within the block."""

    level: int
    number: int  #: of the block on its level
    points: np.ndarray  #: float64, shape (n, 3)
    values: np.ndarray  #: structured, the other fields of the points; without fields if they have none
    children: np.ndarray  #: uint64, shape (n, level): the clusters that each point heads on levels 0, 1, ..
    first: np.ndarray  #: cluster c has the points order[first[c]:first[c + 1]], its representative among them
    order: np.ndarray
    representatives: np.ndarray  #: int64, the point of each cluster, -1 for the root
    boxes: np.ndarray  #: shape (clusters, 6), of all points below, least coordinates first
    errors: np.ndarray  #: no point below is farther from the representative
    descendants: np.ndarray  #: uint64, the points of level 0 below, with the representative

    def __repr__(self):
        return f'<terrace.ClusterBlock: {len(self.representatives)} clusters of {len(self.points)} points, level {self.level}>'


def stream_clusters(batches, sink, *, block_points=10000, facility_cost=3.0, effort='default', method='automatic',
                    metric='euclidean', seed=1, threads=None):
    """Builds the hierarchy of clusters that stores are made of, from any number of points in one pass and constant
    memory, and hands it to the caller's sink.

    batches: an iterable of arrays of shape (n, 2) or (n, 3), or of structured arrays with x, y, z (such as points of a
    Store), all of one type; further fields travel with the points. At best those of a batch lie together. sink: called
    as sink(block) with each ClusterBlock as soon as it is finished, those of a level in order: their clusters are
    numbered consecutively from 0. The points of the top level come last, as one cluster without a representative. Options: as of
    build(); distances are those of the coordinates.

    Returns: a dict: points, top, level_points, level_clusters (the root counts as a cluster of the top). What the
    iterable or the sink raises ends the work. Raises: ValueError, TypeError. Threads do not change the result. Source:
    J. Skala, 4.3, 7.1.2, 7.2.

    >>> random, sizes = np.random.default_rng(1), []
    >>> made = stream_clusters((random.random((5000, 2)) for _ in range(4)), lambda block: sizes.append(len(block.points)))
    >>> made['points'], sum(sizes) > 20000, made['level_points'][0]
    (20000, True, 20000)
    """
    if not callable(sink):
        raise TypeError('`sink` is a function')
    batches = iter(batches)
    head = next(batches, None)
    fields = []
    if head is not None:
        head = as_array(head, 'a batch')
        if head.dtype.names:
            fields = [name for name in head.dtype.names if name not in ('x', 'y', 'z')]
    kind = np.dtype([(name, head.dtype[name]) for name in fields])
    if kind.hasobject:
        raise TypeError('the fields of points are numbers, not objects')

    def pairs():
        for batch in [] if head is None else itertools.chain([head], batches):
            batch = as_array(batch, 'a batch')
            if not batch.dtype.names:
                if fields:
                    raise ValueError('the batches have not the same fields')
                rows = as_rows(batch, 'a batch')
                if rows.shape[1] == 2:
                    rows = np.column_stack((rows, np.zeros(len(rows))))
                yield rows, np.empty((len(rows), 0), np.uint8)
                continue
            if batch.dtype.names != head.dtype.names or any(batch.dtype[name] != head.dtype[name] for name in fields):
                raise ValueError('the batches have not the same fields')
            batch = batch.reshape(-1)
            missing = [axis for axis in 'xyz' if axis not in batch.dtype.names]
            if missing:
                raise ValueError(f'points have x, y and z: {", ".join(missing)} is missing')
            values = np.empty(len(batch), kind)
            for name in fields:
                values[name] = batch[name]
            yield (np.column_stack([as_numbers(batch[axis], axis) for axis in 'xyz']),
                   values.view(np.uint8).reshape(len(batch), -1) if fields else np.empty((len(batch), 0), np.uint8))

    def take(block):
        count, level = len(block['points']), block['level']
        block['values'] = block['values'].view(kind) if fields else np.empty(count, kind)
        block['children'] = block['children'].reshape(count, level)
        sink(ClusterBlock(**block))

    return _core.stream_clusters(pairs(), take, {
        'bytes': kind.itemsize, 'block_points': whole(block_points, 'block_points', 2), 'facility_cost': float(facility_cost),
        'effort': effort, 'method': method, 'metric': metric, 'seed': whole(seed, 'seed'), 'threads': _threads(threads)})
