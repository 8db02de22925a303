# SPDX-License-Identifier: Apache-2.0
"""Clustering in memory: facility location, linkage, k-means."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._arrays import as_array, as_integer, as_numbered, as_numbers, as_rows
from ._call import call_settings, thread_count
from ._names import ClusterMethod, Effort, LinkageMethod, MatrixMethod
from ._types import Array, Float64Array, Int64Array, Progress, Records, UInt8Array, UInt32Array, UInt64Array


def _weights(weights: Array | None) -> Float64Array:
    return np.empty(0) if weights is None else as_numbers(weights, 'weights')


def linkage(points: Array, method: LinkageMethod = 'single', *, edges: Array | None = None, single_precision: bool = False,
            memory: int | None = None, gpu: bool = False, threads: int | None = None) -> Float64Array:
    """Clusters hierarchically with the methods of scipy.cluster.hierarchy.linkage.

    points: shape (n, 2) or (n, 3), finite, compared by Euclidean distance; or a one-dimensional array with the
        distances of all pairs, in the order of scipy.spatial.distance.pdist.
    method: 'single', 'complete', 'average', 'weighted', 'ward', 'centroid' or 'median'. For distances the last three
        are meaningful only if the distances are Euclidean.
    edges: integers, shape (m, 2). Single linkage considers only these pairs, which is enough if they include the
        edges of a Delaunay triangulation.
    single_precision: halves the memory of the methods that need a matrix.
    memory: upper bound of that memory in bytes.
    gpu: runs 'single' or 'complete' on the first CUDA device, if the module was built with CUDA.

    Returns: float64, shape (n - 1, 4), as SciPy does: the two clusters of each merge, its height and its number of
        points. Heights ascend, except that with 'centroid' and 'median' a merge may be lower than its parts. Equal
        distances allow several results; 'average' and 'weighted' match SciPy's to the last bit.
    Raises: ValueError; RuntimeError if there is no CUDA device.

    Cost for points: 'single' takes O(n log n) time; 'ward', 'centroid' and 'median' take O(n^2) time and 120 n bytes.
    The other methods, and all methods for distances, take O(n^2) time and 4 n^2 bytes, or 2 n^2 bytes with
    ``single_precision``.

    Source: J. Skala, 4.2.1, 7.6; O. Boruvka, 1926, over a kD-tree; D. Muellner, 2011.

    >>> linkage([[0, 0], [1, 0], [5, 0]])
    array([[0., 1., 1., 2.],
           [2., 3., 4., 3.]])
    """
    array = as_numbers(points, 'points')
    options = {'threads': thread_count(threads), 'single_precision': bool(single_precision), 'gpu': bool(gpu),
               'memory': 0 if memory is None else as_integer(memory, 'memory', 1)}
    if gpu and method not in ('single', 'complete'):
        raise ValueError("`gpu` needs method='single' or 'complete'")
    if edges is not None:
        if method != 'single' or gpu:
            raise ValueError("`edges` need method='single' and no `gpu`")
        edges = as_numbered(edges, 'edges', 2)
    if array.ndim == 1 and array.size > 0:
        if edges is not None or gpu:
            raise ValueError('`edges` and `gpu` need points, not distances')
        count = (1 + math.isqrt(1 + 8 * array.size)) // 2
        if count * (count - 1) // 2 != array.size:
            raise ValueError(f'{array.size} distances do not match any number of points')
        return _core.linkage_of_distances(count, array, method, options)
    return _core.linkage(as_rows(array, 'points'), method, edges, options)


def tree_linkage(edges: Array, lengths: Array) -> Float64Array:
    """Returns the linkage that merges along the edges of a tree, given in any metric, in order of length.

    edges: integers, shape (n - 1, 2), in any order, connecting the points 0 .. n - 1.
    lengths: one per edge, not negative.

    Returns: rows as linkage() does. O(n log n).
    Raises: ValueError, which names the edge if one closes a cycle.

    >>> tree_linkage([[1, 2], [0, 1]], [4, 1])
    array([[0., 1., 1., 2.],
           [2., 3., 4., 3.]])
    """
    return _core.tree_linkage(as_numbered(edges, 'edges', 2), as_numbers(lengths, 'lengths'))


def spanning_tree(points: Array, *, threads: int | None = None) -> tuple[UInt32Array, Float64Array]:
    """Returns the minimum spanning tree of points: the edges of least total length that connect all points.

    points: shape (n, 2) or (n, 3), finite.

    Returns: (edges, uint32, shape (n - 1, 2), indices of points; lengths, float64), in no particular order.
    Raises: ValueError.

    Takes O(n log n) time. Source: O. Boruvka, 1926.

    >>> spanning_tree([[0, 0], [5, 0], [1, 0]])[1].sum()
    5.0
    """
    return _core.spanning_tree(as_rows(points, 'points'), thread_count(threads))


def flat_clusters(rows: Array, *, count: int | None = None, height: float | None = None) -> UInt32Array:
    """Cuts a linkage into flat clusters and returns the label of each point: 0, 1, ... in order of first appearance.

    count: cut into at most this many clusters.
    height: cut into the largest clusters that contain no merge above this height. Give exactly one of the two.

    Returns: uint32, shape (n,).
    Raises: ValueError.

    >>> flat_clusters(linkage([[0, 0], [1, 0], [5, 0]]), count=2)
    array([0, 0, 1], dtype=uint32)
    """
    if (count is None) == (height is None):
        raise ValueError('flat_clusters() needs either `count` or `height`')
    return _core.cut(as_rows(rows, 'the linkage', (4,)), None if count is None else as_integer(count, 'count', 1),
                     None if height is None else float(height))


@dataclass(frozen=True)
class KMeans:
    """The result of kmeans().

    centres: float64, shape (k, 2) or (k, 3).
    labels: the index of the centre nearest to each point.
    inertia: the sum of the (weighted) squared distances.
    """

    centres: Float64Array
    labels: UInt32Array
    inertia: float
    iterations: int
    converged: bool

    def __repr__(self) -> str:
        return f'<terrace.KMeans: {len(self.centres)} clusters, inertia {self.inertia:g}>'


def kmeans(points: Array, clusters: int | Array, *, weights: Array | None = None, seed: int = 1, restarts: int = 1,
           max_iterations: int = 300, tolerance: float = 0.0, threads: int | None = None) -> KMeans:
    """Runs k-means by Lloyd's iteration, exact, starting from greedy k-means++ seeds or from given centres.

    points: shape (n, 2) or (n, 3).
    clusters: the number of clusters, or the centres to start from.
    restarts: number of runs; the best one is returned.
    tolerance: a run ends when no centre moves by more than this fraction of the bounding box's diagonal; with 0, when
        no label changes.

    Returns: a KMeans.
    Raises: ValueError, TypeError.

    Source: S. Lloyd, 1982; D. Arthur, S. Vassilvitskii, 2007; T. Kanungo et al., 2002.

    >>> kmeans([[0, 0], [0, 1], [9, 0], [9, 1]], 2)
    <terrace.KMeans: 2 clusters, inertia 1>
    """
    points = as_rows(points, 'points')
    start, count, initial = None, 0, as_array(clusters, 'clusters')
    if initial.ndim == 0:
        count = as_integer(clusters, 'clusters', 1)
    else:
        start = as_rows(initial, 'clusters', points.shape[1:])
        if len(start) == 0:
            raise ValueError('`clusters` has no centres to start from')
    centres, labels, inertia, iterations, converged = _core.k_means(
        points, start, count, _weights(weights), as_integer(seed, 'seed'), as_integer(restarts, 'restarts', 1),
        as_integer(max_iterations, 'max_iterations'), float(tolerance), thread_count(threads))
    return KMeans(centres[:, :points.shape[1]], labels, inertia, iterations, converged)


@dataclass(frozen=True)
class Clusters:
    """The result of cluster() and facility_location().

    facilities: uint32, the indices of the points that represent clusters, ascending.
    labels: int64, the index of each point's cluster, -1 for an outlier.
    lower_bound: no solution costs less; 0 if not known.
    """

    facilities: UInt32Array
    labels: Int64Array
    opening_cost: float
    connection_cost: float
    outlier_cost: float
    lower_bound: float

    @property
    def cost(self) -> float:
        """The total cost that is minimised: opening, connection and outlier costs."""
        return self.opening_cost + self.connection_cost + self.outlier_cost

    def __repr__(self) -> str:
        return f'<terrace.Clusters: {len(self.facilities)} clusters of {len(self.labels)} points, cost {self.cost:g}>'


def _search(method: ClusterMethod, effort: Effort, count: int | None, seed: int, threads: int | None, bound_steps: int,
            restarts: int | None, **more: Any) -> dict[str, Any]:
    arguments: dict[str, Any] = {'method': method, 'effort': effort, 'seed': as_integer(seed, 'seed'), 'threads': thread_count(threads),
                             'bound_steps': as_integer(bound_steps, 'bound_steps')}
    if count is not None:
        arguments['count'] = as_integer(count, 'count', 1)
    if restarts is not None:
        arguments['restarts'] = as_integer(restarts, 'restarts', 1)
    return {**arguments, **more}


def cluster(points: Array, facility_cost: float = 1.0, *, count: int | None = None, method: ClusterMethod | None = None,
            effort: Effort = 'default', metric: str = 'euclidean', weights: Array | None = None, channels: Array | None = None,
            outlier_price: float = float('inf'), seed: int = 1, bound_steps: int = 0, restarts: int | None = None,
            steps: int | None = None, start: Clusters | None = None, assign_nearest: bool = False, ordered: bool = False,
            threads: int | None = None) -> Clusters:
    """Clusters points by facility location: each cluster has a cost, and the number of clusters follows from it.

    Each cluster costs ``facility_cost`` times the diagonal of the points' bounding box. Each point costs its
    (weighted) distance to its cluster's representative, which is one of the points. The sum is minimised. With
    ``count`` the problem is k-median instead: exactly ``count`` clusters, which cost nothing.

    points: shape (n, 2) or (n, 3); or entities with k corners each, shape (n, k, 2) or (n, k, 3): segments, triangles
        or polylines, compared by entity_distances().
    count: overrides facility_cost, method and effort. A round of exchanges takes O(n^2); the best of ``restarts`` is
        returned.
    method: 'fast', the default for points, which supports neither outliers nor channels; the local searches of the
        thesis 'automatic', 'full-scan', 'quadtree', 'octree', 'kd-tree' and 'facilities'; on the matrix of distances
        (8 n^2 bytes) 'interchange', 'jain-vazirani' and 'greedy-stars'.
    effort: 'fast', 'default', 'fine' or 'full'.
    metric: 'euclidean', 'squared', 'minkowski:P' or 'elliptical:FILE'.
    channels: shape (n, c): attributes that count as additional axes of distances and of the diagonal, in the unit of
        the coordinates.
    outlier_price: the cost of leaving a point out, as a multiple of the diagonal.
    bound_steps: subgradient steps of a search for lower_bound, about 100; 0 for no search. Not used with ``count``.
    steps: the number of candidates of a local search; overrides effort.
    start: Clusters from which a local search starts.
    assign_nearest: whether a local search ends by assigning each point to its nearest representative.
    ordered: whether entities with three corners are polylines instead of triangles.

    Returns: Clusters. Ctrl-C ends local searches soon.
    Raises: ValueError, TypeError.

    Source: J. Skala, 4.2.3, 7.1, 7.3, chapter 9; for k-median L. O'Callaghan et al., 2002.

    >>> found = cluster([[0, 0], [0, 1], [9, 0], [9, 1]], facility_cost=0.2)
    >>> found.labels
    array([0, 0, 1, 1])
    """
    array = as_numbers(points, 'points')
    entities = array.ndim == 3
    if method is None:
        method = 'automatic' if entities or channels is not None else 'fast'
    more: dict[str, Any] = {'assign_nearest': bool(assign_nearest)}
    if steps is not None:
        more['steps'] = as_integer(steps, 'steps')
    if start is not None:
        if not isinstance(start, Clusters):
            raise TypeError(f'`start` must be Clusters, not {type(start).__name__}')
        more['start'] = (start.facilities, start.labels)
    search = _search(method, effort, count, seed, threads, bound_steps, restarts, **more)
    if entities:
        if metric != 'euclidean' or channels is not None:
            raise ValueError('entities do not support `metric` and `channels`')
        return Clusters(*_core.entity_location(array, bool(ordered), float(facility_cost), _weights(weights), float(outlier_price), search))
    return Clusters(*_core.facility_location(as_rows(array, 'points'), float(facility_cost), metric, _weights(weights),
                                             None if channels is None else as_numbers(channels, 'channels'), float(outlier_price), search))


def entity_distances(a: Array, b: Array | None = None, *, ordered: bool = False) -> Float64Array:
    """Returns how far the corners of one entity must move to coincide with those of another.

    The distance is the root mean square of the moves under the best correspondence of corners.

    a: shape (n, k, 2) or (n, k, 3): segments (k = 2), triangles (k = 3), or polylines, whose corners keep their order
        or its reverse.
    b: entities with as many corners; ``a`` by default.
    ordered: whether entities with three corners are polylines.

    Returns: float64, shape (len(a), len(b)). It is a metric, which facility_location() and, from the part above the
        diagonal, linkage() accept.
    Raises: ValueError.

    Source: J. Skala, chapter 9.

    >>> entity_distances([[[0, 0], [1, 0]]], [[[1, 2], [0, 2]]])
    array([[2.]])
    """
    a = as_numbers(a, 'a')
    b = a if b is None else as_numbers(b, 'b')
    return _core.entity_distances(a, b, bool(ordered)).reshape(len(a), len(b))


def clusters_of_size(points: Array, size: float, *, seed: int = 1, progress: Progress | None = None,
                     threads: int | None = None) -> UInt32Array:
    """Divides a large set of points into compact clusters of about ``size`` points.

    A hierarchy is built, and the level whose mean cluster size is closest to ``size`` by ratio is returned. Levels
    have clusters of about 85 points, 7,000 points and so on; up to 10,000 points form one cluster.

    points: shape (n, 2) or (n, 3), finite.

    Returns: uint32, shape (n,): the cluster of each point, numbered from 0 without gaps. O(n log n); Ctrl-C ends it
        soon.
    Raises: ValueError.

    Source: J. Skala, 7.1.

    >>> labels = clusters_of_size(np.random.default_rng(1).random((20000, 2)), 100)
    >>> 150 < labels.max() < 300
    True
    """
    return _core.clusters_of_size(as_rows(points, 'points'), float(size), as_integer(seed, 'seed'), call_settings(progress, threads))


def facility_location(connection: Array, opening: Array | None = None, *, count: int | None = None,
                      method: MatrixMethod = 'interchange',
                      effort: Effort = 'default', seed: int = 1, bound_steps: int = 300, restarts: int | None = None,
                      seconds: float = float('inf'), threads: int | None = None) -> Clusters:
    """Solves facility location with arbitrary costs: which facilities to open, and which of them serves each client.

    connection: shape (facilities, clients), not negative. A matrix of distances clusters entities of any kind.
    opening: the cost of each facility, or one cost for all of them.
    count: opens exactly this many facilities, at no cost (k-median).
    method: 'interchange', 'jain-vazirani' or 'greedy-stars'.
    bound_steps: the steps of a search for lower_bound; 0 for no search.
    restarts: the number of independent searches; overrides effort.
    seconds: no search is perturbed after this time.

    Each step takes O(facilities * clients) time. Memory: 12 bytes per entry of the matrix.

    Returns: Clusters, whose facilities are rows and whose labels belong to the clients.
    Raises: ValueError.

    Source: J. Skala, 4.2.3, 7.3; D. Erlenkotter, 1978.

    >>> found = facility_location([[1, 9, 9], [9, 1, 2]], 3)
    >>> found.facilities, found.labels, found.cost, found.lower_bound > 9.9
    (array([0, 1], dtype=uint32), array([0, 1, 1]), 10.0, True)
    """
    connection = as_numbers(connection, 'connection')
    if connection.ndim != 2:
        raise ValueError(f'connection costs must have two dimensions, not {connection.ndim}')
    if opening is None:
        if count is None:
            raise ValueError('facility_location() needs `opening` or `count`')
        opening = 0
    costs = as_array(opening, 'opening')
    if costs.ndim == 0:
        costs = np.full(len(connection), costs)
    search = _search(method, effort, count, seed, threads, bound_steps, restarts, seconds=float(seconds))
    return Clusters(*_core.facility_matrix(connection, as_numbers(costs, 'opening'), search))


@dataclass(frozen=True)
class ClusterBlock:
    """A finished block of stream_clusters(). Points are numbered within the block."""

    level: int
    number: int  #: index of the block on its level
    points: Float64Array  #: float64, shape (n, 3)
    values: Records  #: structured, the other fields of the points; without fields if they have none
    children: UInt64Array  #: uint64, shape (n, level): the clusters that each point represents on levels 0, 1, ...
    first: UInt32Array  #: cluster c has the points order[first[c]:first[c + 1]], including its representative
    order: UInt32Array
    representatives: Int64Array  #: int64, the representative of each cluster, -1 for the root
    boxes: Float64Array  #: shape (clusters, 6), the box around all points below, minima first
    errors: Float64Array  #: no point below is farther from the representative
    descendants: UInt64Array  #: uint64, the number of points of level 0 below, including the representative

    def __repr__(self) -> str:
        return f'<terrace.ClusterBlock: {len(self.representatives)} clusters of {len(self.points)} points, level {self.level}>'


def stream_clusters(batches: Iterable[Array], sink: Callable[[ClusterBlock], object], *, block_points: int = 10000,
                    facility_cost: float = 3.0, k: int = 0, effort: Effort = 'default', method: ClusterMethod = 'automatic',
                    batch: int = 1, search_threads: int = 1, metric: str = 'euclidean', seed: int = 1,
                    threads: int | None = None) -> dict[str, Any]:
    """Builds a hierarchy of clusters as in a store, and passes its blocks to a function.

    Reads the points in one pass and in constant memory.

    batches: an iterable of arrays of shape (n, 2) or (n, 3), or of structured arrays with fields x, y and z (such as
        points of a Store), all of the same type. Other fields stay with their points. Points of a batch should be
        close together.
    sink: called as sink(block) with each ClusterBlock as soon as it is finished. The blocks of a level arrive in
        order, and their clusters are numbered consecutively from 0. The points of the top level arrive last, as one
        cluster without a representative.

    k: if positive, the top has that many points, the medians of all others, and facility_cost is not used. The cost is
        near that of k-median in memory if block_points is at least 100 k.

    The other options are those of build(); distances are those of the coordinates. An exception from the iterable or
    the sink ends the work. The number of threads does not change the result.

    Returns: a dict with points, top, level_points and level_clusters (the root counts as a cluster of the top level).
    Raises: ValueError, TypeError.

    Source: J. Skala, 4.3, 7.1.2, 7.2.

    >>> random, sizes = np.random.default_rng(1), []
    >>> made = stream_clusters((random.random((5000, 2)) for _ in range(4)), lambda block: sizes.append(len(block.points)))
    >>> made['points'], sum(sizes) > 20000, made['level_points'][0]
    (20000, True, 20000)
    """
    if not callable(sink):
        raise TypeError('`sink` must be a function')
    iterator = iter(batches)
    heads = [as_array(batch, 'a batch') for batch in itertools.islice(iterator, 1)]
    names = heads[0].dtype.names if heads else None
    fields = [name for name in names or () if name not in ('x', 'y', 'z')]
    kind = np.dtype([(name, heads[0].dtype[name]) for name in fields])
    if kind.hasobject:
        raise TypeError('the fields of points must be numbers, not objects')

    def pairs() -> Iterator[tuple[Float64Array, UInt8Array]]:
        for item in itertools.chain(heads, iterator):
            batch = as_array(item, 'a batch')
            if not batch.dtype.names:
                if fields:
                    raise ValueError('the batches do not have the same fields')
                rows = as_rows(batch, 'a batch')
                if rows.shape[1] == 2:
                    rows = np.column_stack((rows, np.zeros(len(rows))))
                yield rows, np.empty((len(rows), 0), np.uint8)
                continue
            if names is None or batch.dtype.names != names or any(batch.dtype[name] != kind[name] for name in fields):
                raise ValueError('the batches do not have the same fields')
            batch = batch.reshape(-1)
            missing = [axis for axis in 'xyz' if axis not in names]
            if missing:
                raise ValueError(f'points need x, y and z: {", ".join(missing)} is missing')
            values = np.empty(len(batch), kind)
            for name in fields:
                values[name] = batch[name]
            yield (np.column_stack([as_numbers(batch[axis], axis) for axis in 'xyz']),
                   values.view(np.uint8).reshape(len(batch), -1) if fields else np.empty((len(batch), 0), np.uint8))

    def take(block: dict[str, Any]) -> None:
        count, level = len(block['points']), block['level']
        block['values'] = block['values'].view(kind) if fields else np.empty(count, kind)
        block['children'] = block['children'].reshape(count, level)
        sink(ClusterBlock(**block))

    return _core.stream_clusters(pairs(), take, {
        'bytes': kind.itemsize, 'block_points': as_integer(block_points, 'block_points', 2), 'facility_cost': float(facility_cost),
        'k': as_integer(k, 'k', 0), 'batch': as_integer(batch, 'batch', 1),
        'search_threads': as_integer(search_threads, 'search_threads', 1), 'effort': effort, 'method': method, 'metric': metric, 'seed': as_integer(seed, 'seed'), 'threads': thread_count(threads)})
