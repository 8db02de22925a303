# SPDX-License-Identifier: Apache-2.0
"""Linkage, k-means, facility location, assignment and matching, against SciPy, brute force and their duals."""

import itertools
import unittest
import warnings

import numpy as np

import terrace

try:
    from hypothesis import given, settings, strategies as st
    from hypothesis.extra import numpy as arrays
    from scipy.cluster import hierarchy
    from scipy.optimize import linear_sum_assignment
    from scipy import sparse
    from scipy.sparse.csgraph import minimum_spanning_tree
    from scipy.spatial.distance import cdist, pdist
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')


try:
    import fastcluster
except ImportError:
    fastcluster = None

METHODS = ['single', 'complete', 'average', 'weighted', 'ward', 'centroid', 'median']


def combined(method, a, b, between, na, nb, n):
    """Returns the distances of clusters of n points to a merged cluster, from a and b to its parts (Lance, Williams)."""
    if method == 'single':
        return np.minimum(a, b)
    if method == 'complete':
        return np.maximum(a, b)
    if method == 'average':
        return (na * a + nb * b) / (na + nb)
    if method == 'weighted':
        return (a + b) / 2
    if method == 'ward':
        square = ((n + na) * a ** 2 + (n + nb) * b ** 2 - n * between ** 2) / (n + na + nb)
    elif method == 'centroid':
        square = (na * a ** 2 + nb * b ** 2) / (na + nb) - na * nb * between ** 2 / (na + nb) ** 2
    else:
        square = (a ** 2 + b ** 2) / 2 - between ** 2 / 4
    return np.sqrt(np.maximum(square, 0))


def runs(points, method):
    """Simulates a linkage whose merges the caller chooses.

    Yields the matrix of distances between clusters (infinite on the diagonal and for merged clusters) and receives the
    rows a and b to merge. Afterwards row b represents both.
    """
    distances, sizes = cdist(points, points), np.ones(len(points))
    np.fill_diagonal(distances, np.inf)
    for _ in range(len(points) - 1):
        a, b = yield distances
        with np.errstate(invalid='ignore'):
            new = combined(method, distances[a], distances[b], distances[a, b], sizes[a], sizes[b], sizes)
        new[~np.isfinite(distances[b])] = np.inf
        new[a] = new[b] = np.inf
        distances[b] = distances[:, b] = new
        distances[a] = distances[:, a] = np.inf
        sizes[b] += sizes[a]


def run_fault(rows, points, method):
    """Returns the first fault of a linkage, or None. Each row must merge two nearest clusters."""
    tolerance = 1e-9 * max(np.ptp(points), 1)
    place = list(range(len(points)))
    run = runs(points, method)
    distances = next(run)
    for number, (a, b, height, _) in enumerate(rows):
        a, b = place[int(a)], place[int(b)]
        if abs(height - distances[a, b]) > tolerance:
            return f'row {number}: height {height} should be {distances[a, b]}'
        if height > distances.min() + tolerance:
            return f'row {number}: others are nearer'
        place.append(b)
        if number < len(rows) - 1:
            distances = run.send((a, b))
    return None


def one_way(points, method):
    """Returns whether the linkage is unique because no two pairs are ever equally near."""
    run = runs(points, method)
    distances = next(run)
    for left in range(len(points) - 1, 0, -1):
        order = np.argsort(distances, axis=None)[:3]  # each pair occurs twice
        a, b = np.unravel_index(order[0], distances.shape)
        least, next_ = distances.flat[order[0]], distances.flat[order[2]]
        if next_ - least < 1e-6 * max(np.ptp(points), 1):
            return False
        if left > 1:
            distances = run.send((a, b))
    return True


def some_points(most, width=2, least=2):
    return arrays.arrays(np.float64, st.tuples(st.integers(least, most), st.just(width)),
                         elements=st.floats(-100, 100, width=32))


class Linkage(unittest.TestCase):
    @settings(max_examples=200, deadline=None, derandomize=True)
    @given(some_points(60), st.sampled_from(METHODS))
    def test_heights_match_scipy(self, points, method):
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # points may look like a matrix of distances
            result, expected = terrace.linkage(points, method), hierarchy.linkage(points, method)
        self.assertTrue(hierarchy.is_valid_linkage(result))
        if method in ('average', 'weighted'):
            np.testing.assert_array_equal(result, expected)
        elif method == 'single' or one_way(points, method):
            np.testing.assert_allclose(result[:, 2], expected[:, 2], rtol=1e-9, atol=1e-9)

    def test_ties_merge_a_nearest_pair(self):
        # Any of several equally near pairs may merge first, and later heights depend on the choice. So each row is
        # compared with the distances of the clusters at that moment.
        grid = np.array(np.meshgrid(range(5), range(4), range(3)), float).reshape(3, -1).T
        for points in (grid, np.repeat(grid, 2, axis=0), np.zeros((40, 2)), np.arange(50.0)[:, None] * (1, 1),
                       np.random.default_rng(5).integers(0, 4, (90, 2)).astype(float)):
            for method in METHODS:
                with self.subTest(method=method, points=len(points)):
                    self.assertEqual(run_fault(terrace.linkage(points, method), points, method), None)
                    self.assertEqual(run_fault(terrace.linkage(pdist(points), method), points, method), None)

    def test_rows_and_cuts_match_scipy(self):
        points = np.random.default_rng(2).random((400, 3))
        for method in METHODS:
            result = terrace.linkage(points, method)
            expected = hierarchy.linkage(points, method)
            np.testing.assert_array_equal(result[:, [0, 1, 3]], expected[:, [0, 1, 3]])
            np.testing.assert_allclose(result[:, 2], expected[:, 2], rtol=1e-9)
            np.testing.assert_allclose(terrace.linkage(pdist(points), method), expected, rtol=1e-9)
            if fastcluster is not None:
                np.testing.assert_allclose(fastcluster.linkage(points, method)[:, 2], result[:, 2], rtol=1e-9)
            height = float(np.median(result[:, 2]))
            ours = terrace.flat_clusters(result, height=height)
            theirs = hierarchy.fcluster(expected, height, 'distance')
            self.assertEqual(len({*zip(ours, theirs)}), len(set(theirs)))
            if method in ('centroid', 'median'):  # SciPy's count may be exceeded after an inversion
                self.assertLessEqual(len(set(terrace.flat_clusters(result, count=40))), 40)
                self.assertFalse(hierarchy.is_monotonic(result))
                continue
            self.assertTrue(hierarchy.is_monotonic(result))
            for count in (1, 5, 40):
                ours = terrace.flat_clusters(result, count=count)
                theirs = hierarchy.fcluster(expected, count, 'maxclust')
                self.assertEqual(len({*zip(ours, theirs)}), count)

    def test_rejects_invalid_arguments(self):
        self.assertEqual(terrace.linkage(np.zeros((1, 2))).shape, (0, 4))
        for wrong in ([[np.nan, 0], [0, 0]], [[1, 2, 3, 4]], [1, 2]):
            with self.assertRaises(ValueError):
                terrace.linkage(wrong)
        with self.assertRaises(ValueError):
            terrace.linkage([[0, 0], [1, 1]], 'mean')
        with self.assertRaisesRegex(ValueError, 'gpu'):
            terrace.linkage([[0, 0], [1, 1]], 'ward', gpu=True)
        for rows in ([[0, 0, 1, 2]], [[0, 5, 1, 2]], [[0, -1, 1, 2]], [[0, np.nan, 1, 2]], [[0, 1, -1, 2]]):
            with self.assertRaises(ValueError):
                terrace.flat_clusters(rows, count=1)
        rows = terrace.linkage([[0, 0], [1, 1]])
        for wrong in ({}, {'count': 1, 'height': 1}, {'count': 0}, {'count': 9}, {'height': np.nan}):
            with self.assertRaises(ValueError):
                terrace.flat_clusters(rows, **wrong)


    def test_linkage_of_distances_matches_scipy(self):
        points = np.random.default_rng(12).random((150, 3))
        for method in METHODS:
            result = terrace.linkage(pdist(points, 'cityblock'), method)
            expected = hierarchy.linkage(pdist(points, 'cityblock'), method)
            np.testing.assert_array_equal(result[:, [0, 1, 3]], expected[:, [0, 1, 3]])
            np.testing.assert_allclose(result[:, 2], expected[:, 2], rtol=1e-12)
        for wrong, method in ((np.ones(4), 'complete'), (np.ones(3), 'mean'), (-np.ones(3), 'complete'), ([np.nan], 'ward')):
            with self.assertRaises(ValueError):
                terrace.linkage(wrong, method)

    def test_spanning_tree_matches_scipy(self):
        points = np.random.default_rng(13).random((400, 2))
        edges, lengths = terrace.spanning_tree(points)
        np.testing.assert_allclose(lengths, np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1), rtol=1e-12)
        expected = minimum_spanning_tree(cdist(points, points)).tocoo()
        self.assertEqual({tuple(sorted(edge)) for edge in edges.tolist()},
                         {tuple(sorted(edge)) for edge in zip(expected.row.tolist(), expected.col.tolist())})


    def test_linkage_of_tree_edges_and_candidate_edges(self):
        points = np.random.default_rng(16).random((300, 2))
        expected = hierarchy.linkage(points, 'single')
        edges, lengths = terrace.spanning_tree(points)
        shuffled = np.random.default_rng(17).permutation(len(edges))
        triangulation = terrace.Delaunay2(points)
        number = triangulation.by_vertex(np.arange(300))
        sides = number[triangulation.simplices[:, [0, 1, 1, 2, 2, 0]]].astype(int).reshape(-1, 2)
        for result in (terrace.tree_linkage(edges[shuffled], lengths[shuffled]), terrace.linkage(points, edges=sides)):
            np.testing.assert_array_equal(result[:, [0, 1, 3]], expected[:, [0, 1, 3]])
            np.testing.assert_allclose(result[:, 2], expected[:, 2], rtol=1e-12)
        self.assertEqual(terrace.tree_linkage([], []).shape, (0, 4))
        for wrong in (lambda: terrace.tree_linkage([[0, 1], [1, 0]], [1, 1]), lambda: terrace.tree_linkage([[0, 1]], [1, 2]),
                      lambda: terrace.tree_linkage([[0, 9]], [1]), lambda: terrace.tree_linkage([[0, 1]], [np.nan]),
                      lambda: terrace.linkage(points, edges=[[0, 1]]), lambda: terrace.linkage(points, edges=[[0, 300]]),
                      lambda: terrace.linkage(points, 'complete', edges=edges), lambda: terrace.linkage(pdist(points), 'complete', edges=edges)):
            with self.assertRaises(ValueError):
                wrong()
        with self.assertRaises(TypeError):
            terrace.tree_linkage([[0.0, 1.0]], [1])

    def test_matrix_precision_and_memory_limit(self):
        points = np.random.default_rng(18).random((200, 3))
        for method in ('average', 'weighted', 'complete'):
            exact, rounded = (terrace.linkage(points, method, single_precision=single) for single in (False, True))
            np.testing.assert_allclose(rounded[:, 2], exact[:, 2], rtol=1e-6)
            self.assertTrue((rounded[:, 2] != exact[:, 2]).any())
            with self.assertRaisesRegex(ValueError, '160000'):
                terrace.linkage(points, method, memory=1000)
        with self.assertRaisesRegex(ValueError, '24000'):
            terrace.linkage(points, 'ward', memory=1000)
        try:
            np.testing.assert_allclose(terrace.linkage(points, 'complete', gpu=True)[:, 2], exact[:, 2])
        except RuntimeError as error:
            self.assertRegex(str(error), 'CUDA|GPU')


class Streams(unittest.TestCase):
    """Checks the hierarchy of blocks against its definition."""

    def check(self, batches, **options):
        blocks = []
        result = terrace.stream_clusters(batches, blocks.append, **options)
        rows = np.concatenate(batches)
        fields = [name for name in rows.dtype.names or () if name not in 'xyz']
        places = np.column_stack([rows[axis] for axis in 'xyz']) if rows.dtype.names else rows
        tops = {0: np.arange(len(rows))}
        below, error = {}, {}  # the points that each cluster represents
        counts = [0] * (result['top'] + 1)
        by_place = {tuple(place): at for at, place in enumerate(places)}
        seen = []
        for block in sorted(blocks, key=lambda block: (block.level, block.number)):
            ids = [by_place[tuple(place)] for place in block.points]
            if fields:
                for name in fields:
                    np.testing.assert_array_equal(block.values[name], rows[name][ids])
            self.assertEqual(block.children.shape, (len(ids), block.level))
            for c, (first, last) in enumerate(zip(block.first, block.first[1:])):
                members = block.order[first:last]
                expected = []
                for member in members:
                    expected += below[block.level - 1, block.children[member, -1]] if block.level else [ids[member]]
                below[block.level, counts[block.level]] = expected
                counts[block.level] += 1
                np.testing.assert_array_equal(block.boxes[c], np.concatenate((places[expected].min(axis=0), places[expected].max(axis=0))))
                self.assertEqual(block.descendants[c], len(expected))
                head = block.representatives[c]
                if head >= 0:
                    self.assertIn(head, members)
                    farthest = np.linalg.norm(places[expected] - places[ids[head]], axis=1).max()
                    self.assertLessEqual(farthest, block.errors[c] * (1 + 1e-12))
                seen += [ids[member] for member in members if member != head]
        self.assertEqual(sorted(seen), sorted(tops[0]))  # each point is a non-representative member exactly once
        self.assertEqual((result['points'], result['level_clusters']), (len(rows), counts))
        return blocks

    def test_blocks_form_a_hierarchy(self):
        random = np.random.default_rng(20)
        batches = [random.random((700, 3)) + [i % 4, i // 4, 0] for i in range(12)]
        blocks = self.check(batches, block_points=500)
        again = self.check(batches, block_points=500, threads=1)
        self.assertGreater(max(block.level for block in blocks), 0)
        key = lambda block: (block.level, block.number)  # noqa: E731
        for one, other in zip(sorted(blocks, key=key), sorted(again, key=key)):
            np.testing.assert_array_equal(one.order, other.order)
            np.testing.assert_array_equal(one.points, other.points)
        self.assertIn('clusters of', repr(blocks[0]))

    def test_medians_cost_little_more_than_those_in_memory(self):
        random = np.random.default_rng(24)
        points = random.normal(size=(3000, 3)) + random.integers(0, 4, (3000, 1)) * 5
        blocks = self.check(np.split(points, 30), block_points=800, k=8)
        cost = cdist(points, blocks[-1].points).min(axis=1).sum()
        self.assertEqual(len(blocks[-1].points), 8)
        self.assertLess(cost, 1.05 * terrace.cluster(points, count=8, restarts=1).cost)
        with self.assertRaises(ValueError):
            terrace.stream_clusters([points], lambda block: None, block_points=10, k=10)

    def test_a_batch_is_another_search(self):
        points = np.random.default_rng(25).random((900, 2))
        tops = []
        for options in ({}, {'search_threads': 3}, {'batch': 8}):
            blocks = []
            terrace.stream_clusters([points], blocks.append, block_points=300, method='facilities', **options)
            tops.append(sorted(map(tuple, blocks[-1].points)))
        self.assertEqual(tops[0], tops[1])
        self.assertNotEqual(tops[0], tops[2])

    def test_fields_stay_with_their_points(self):
        records = np.zeros(3000, [('x', 'f8'), ('y', 'f4'), ('z', 'i4'), ('class', 'u1'), ('name', 'S3')])
        random = np.random.default_rng(21)
        records['x'], records['y'], records['z'] = random.random(3000), random.random(3000), np.arange(3000)
        records['class'], records['name'] = np.arange(3000) % 7, b'abc'
        self.check(np.split(records, 3), block_points=400, facility_cost=1.0, effort='fast')

    def test_rejects_invalid_arguments(self):
        points = np.random.default_rng(22).random((900, 3))
        self.assertEqual(terrace.stream_clusters([], lambda block: None)['points'], 0)

        class Enough(Exception):
            pass

        def raising(*_):
            raise Enough

        def broken():
            yield points
            raise Enough

        for batches, sink in (([points] * 9, raising), (broken(), lambda block: None)):
            with self.assertRaises(Enough):
                terrace.stream_clusters(batches, sink, block_points=100)
        for wrong, options, kind in (([points, points[:, :2] * np.nan], {}, ValueError), ([[1, 2]], {}, ValueError),
                                     ([points], {'block_points': 1}, ValueError), ([points], {'facility_cost': 0}, ValueError),
                                     ([points], {'metric': 'far'}, ValueError), ([points, np.zeros(2, [('x', 'f8')])], {}, ValueError),
                                     ([np.zeros(2, [('x', 'f8'), ('y', 'f8'), ('z', 'f8'), ('o', object)])], {}, TypeError),
                                     ([np.zeros(2, [('x', 'f8')])], {}, ValueError), ([['a']], {}, TypeError), (3, {}, TypeError)):
            with self.subTest(repr(options)):
                with self.assertRaises(kind):
                    terrace.stream_clusters(wrong, lambda block: None, **options)
        with self.assertRaises(TypeError):
            terrace.stream_clusters([points], None)

    def test_clusters_have_about_the_given_size(self):
        points = np.random.default_rng(23).random((30000, 2))
        seen = []
        labels = terrace.clusters_of_size(points, 80, progress=lambda *at: seen.append(at))
        sizes = np.bincount(labels)
        self.assertTrue(sizes.min() > 0 and 40 < sizes.mean() < 160)
        spread = [np.ptp(points[labels == label], axis=0).max() for label in range(0, len(sizes), 20)]
        self.assertLess(np.median(spread), 0.2)
        self.assertEqual(seen[-1], ('points', 30000, 1.0, True))
        np.testing.assert_array_equal(labels, terrace.clusters_of_size(points, 80, threads=1))
        self.assertEqual(terrace.clusters_of_size(np.zeros((0, 2)), 5).shape, (0,))
        with self.assertRaises(ValueError):
            terrace.clusters_of_size([[np.nan, 0]], 5)
        for size in (0, -80, np.nan):
            with self.assertRaises(ValueError):
                terrace.clusters_of_size(points, size)


class KMeans(unittest.TestCase):
    @settings(max_examples=40, deadline=None, derandomize=True)
    @given(some_points(80, width=3, least=5), st.integers(1, 5))
    def test_result_is_a_fixed_point_of_lloyd(self, points, clusters):
        result = terrace.kmeans(points, clusters)
        self.assertTrue(result.converged)
        squares = cdist(points, result.centres, 'sqeuclidean')
        chosen = squares[np.arange(len(points)), result.labels]
        np.testing.assert_allclose(chosen, squares.min(axis=1), rtol=1e-6, atol=1e-6)
        self.assertAlmostEqual(result.inertia, chosen.sum(), delta=1e-6 * (1 + chosen.sum()))
        for label in np.unique(result.labels):
            np.testing.assert_allclose(result.centres[label], points[result.labels == label].mean(axis=0), rtol=0, atol=1e-6)

    def test_given_centres_and_weights(self):
        points = np.random.default_rng(3).random((500, 2))
        weights = np.random.default_rng(4).random(500) + 0.5
        result = terrace.kmeans(points, points[:7], weights=weights)
        for label in range(7):
            of = result.labels == label
            np.testing.assert_allclose(result.centres[label], np.average(points[of], axis=0, weights=weights[of]), atol=1e-9)
        self.assertEqual(result.centres.shape, (7, 2))
        for wrong, kind in ((0, ValueError), (501, ValueError), ([], ValueError), (1.5, TypeError)):
            with self.assertRaises((kind, ValueError)):
                terrace.kmeans(points, wrong)
        with self.assertRaises(ValueError):
            terrace.kmeans(points, 3, weights=[1, 2])


class Facilities(unittest.TestCase):
    def test_small_problems_are_nearly_optimal(self):
        for seed in range(6):
            points = np.random.default_rng(seed).random((11, 2))
            price = 0.3 * np.hypot(*np.ptp(points, axis=0))
            distances = cdist(points, points)
            best = min(price * size + distances[list(chosen)].min(axis=0).sum()
                       for size in range(1, 12) for chosen in itertools.combinations(range(11), size))
            for method in ('interchange', 'automatic', 'fast', 'jain-vazirani', 'greedy-stars'):
                result = terrace.cluster(points, 0.3, method=method, effort='full')
                cost = price * len(result.facilities) + distances[result.facilities[result.labels], np.arange(11)].sum()
                self.assertAlmostEqual(result.cost, cost, places=9)
                self.assertGreaterEqual(cost, best - 1e-9)
                self.assertLessEqual(cost, best * (1 + 1e-9 if method == 'interchange' else 1.9))
                self.assertLessEqual(result.lower_bound, best + 1e-9)

    def test_arbitrary_costs(self):
        for seed in range(6):
            random = np.random.default_rng(seed)
            connection, opening = random.random((9, 14)), random.random(9)

            def cost_of(chosen):
                return connection[list(chosen)].min(axis=0).sum()

            subsets = [chosen for size in range(1, 10) for chosen in itertools.combinations(range(9), size)]
            best = min(opening[list(chosen)].sum() + cost_of(chosen) for chosen in subsets)
            for method in ('interchange', 'jain-vazirani', 'greedy-stars'):
                result = terrace.facility_location(connection, opening, method=method, effort='full')
                cost = opening[result.facilities].sum() + connection[result.facilities[result.labels], np.arange(14)].sum()
                self.assertAlmostEqual(result.cost, cost, places=9)
                self.assertLessEqual(result.lower_bound, best + 1e-9)
                self.assertGreater(result.lower_bound, 0.8 * best)
                self.assertGreaterEqual(result.cost, best - 1e-9)
            self.assertAlmostEqual(terrace.facility_location(connection, opening, effort='full').cost, best, places=9)
            median = terrace.facility_location(connection, count=3)
            self.assertEqual(len(median.facilities), 3)
            self.assertAlmostEqual(median.cost, min(cost_of(chosen) for chosen in subsets if len(chosen) == 3), places=9)
        for wrong in (lambda: terrace.facility_location(connection), lambda: terrace.facility_location(connection, opening[:3]),
                      lambda: terrace.facility_location(-connection, 1), lambda: terrace.facility_location(opening, 1),
                      lambda: terrace.facility_location(connection, 1, method='kd-tree '),
                      lambda: terrace.facility_location(connection, count=10)):
            with self.assertRaises(ValueError):
                wrong()

    def test_lower_bounds(self):
        points = np.random.default_rng(6).random((300, 2))
        plain, bounded = terrace.cluster(points, 0.05), terrace.cluster(points, 0.05, bound_steps=100)
        self.assertEqual(plain.cost, bounded.cost)
        self.assertTrue(0.9 * bounded.cost < bounded.lower_bound <= bounded.cost)

    def test_k_median(self):
        points = np.random.default_rng(5).random((12, 2))
        distances = cdist(points, points)
        best = min(distances[list(chosen)].min(axis=0).sum() for chosen in itertools.combinations(range(12), 3))
        result = terrace.cluster(points, count=3)
        self.assertEqual(len(result.facilities), 3)
        self.assertAlmostEqual(result.cost, distances[result.facilities[result.labels], np.arange(12)].sum(), places=9)
        self.assertLessEqual(result.cost, 1.2 * best)
        for wrong in (0, 13):
            with self.assertRaises(ValueError):
                terrace.cluster(points, count=wrong)

    def test_outliers_and_metrics(self):
        points = np.vstack((np.random.default_rng(1).random((200, 2)), [[50, 50]]))
        result = terrace.cluster(points, 0.05, method='automatic', outlier_price=0.03)
        self.assertEqual(result.labels[200], -1)
        terrace.cluster(points, metric='minkowski:1', method='automatic')
        for wrong in ({'metric': 'minkowski:-1'}, {'method': 'best'}, {'facility_cost': 0}, {'facility_cost': np.nan},
                      {'weights': [1.0]}, {'outlier_price': 0.1}, {'effort': 'none'}):
            with self.subTest(repr(wrong)):
                with self.assertRaises(ValueError):
                    terrace.cluster(points, **wrong)
        with self.assertRaises(ValueError):
            terrace.cluster(np.zeros((0, 2)))


    def test_entities(self):
        random = np.random.default_rng(24)
        for corners, ordered in ((2, False), (3, False), (3, True), (5, True), (1, False)):
            entities = random.random((9, corners, 3))
            if corners in (2, 3) and not ordered:
                orders = [*itertools.permutations(range(corners))]
            else:
                orders = [tuple(range(corners)), tuple(range(corners))[::-1]]
            expected = np.array([[min(np.sqrt(((a[list(order)] - b) ** 2).sum(axis=1).mean()) for order in orders) for b in entities]
                                 for a in entities])
            np.testing.assert_allclose(terrace.entity_distances(entities, ordered=ordered), expected, rtol=1e-12, atol=1e-12)
            result = terrace.cluster(entities, 0.1, ordered=ordered, effort='full')
            price = 0.1 * np.linalg.norm(np.ptp(entities.reshape(-1, 3), axis=0))
            self.assertAlmostEqual(result.opening_cost, price * len(result.facilities), places=9)
            self.assertAlmostEqual(result.connection_cost, expected[result.facilities[result.labels], np.arange(9)].sum(), places=9)
        flat = random.random((4, 2, 2))
        np.testing.assert_allclose(terrace.entity_distances(flat, flat[:2]), terrace.entity_distances(np.dstack((flat, np.zeros((4, 2)))))[:, :2])
        for wrong in (lambda: terrace.entity_distances(flat, np.zeros((1, 3, 2))), lambda: terrace.entity_distances([[1, 2]]),
                      lambda: terrace.entity_distances(np.zeros((2, 2, 4))), lambda: terrace.entity_distances(np.zeros((2, 0, 3))),
                      lambda: terrace.cluster(flat, count=2), lambda: terrace.cluster(flat, metric='squared'),
                      lambda: terrace.cluster(flat, method='fast'), lambda: terrace.cluster(flat * np.nan),
                      lambda: terrace.cluster(np.zeros((0, 2, 3)))):
            with self.assertRaises(ValueError):
                wrong()
        flat[2, 1, 0] = np.nan
        for wrong in (lambda: terrace.entity_distances(flat), lambda: terrace.cluster(flat)):
            with self.assertRaisesRegex(ValueError, 'entity 2 has a coordinate'):
                wrong()

    def test_channels_count_as_axes(self):
        points = np.random.default_rng(25).random((200, 3))
        solid = terrace.cluster(points, 0.05, method='kd-tree')
        flat = terrace.cluster(points[:, :2], 0.05, method='kd-tree', channels=points[:, 2:])
        np.testing.assert_array_equal(solid.labels, flat.labels)
        self.assertAlmostEqual(solid.cost, flat.cost, places=9)
        terrace.cluster(points[:, :2], channels=points)
        for wrong in (points[:5], points[:, 0], points * np.nan):
            with self.assertRaises(ValueError):
                terrace.cluster(points, channels=wrong)
        with self.assertRaises(ValueError):
            terrace.cluster(points, channels=points, method='fast')

    def test_searches_continue_from_a_solution(self):
        points = np.random.default_rng(26).random((400, 2))
        short = terrace.cluster(points, 0.05, method='kd-tree', steps=3)
        longer = terrace.cluster(points, 0.05, method='kd-tree', steps=300, start=short, seed=2, assign_nearest=True)
        self.assertLess(longer.cost, short.cost)
        distances = cdist(points, points[longer.facilities])
        np.testing.assert_array_equal(longer.labels, distances.argmin(axis=1))
        still = terrace.cluster(points, 0.05, method='kd-tree', steps=0, start=longer)
        np.testing.assert_array_equal(still.facilities, longer.facilities)
        self.assertLessEqual(terrace.cluster(points, count=9, restarts=4).cost, terrace.cluster(points, count=9).cost)
        broken = terrace.Clusters(short.facilities, short.labels + 1, 0, 0, 0, 0)
        for wrong in ({'start': broken}, {'start': terrace.cluster(points[:50])}, {'restarts': 0}):
            with self.assertRaises(ValueError):
                terrace.cluster(points, method='kd-tree', **wrong)
        with self.assertRaises(TypeError):
            terrace.cluster(points, method='kd-tree', start=3)


class Assignments(unittest.TestCase):
    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(arrays.arrays(st.sampled_from([np.float64, np.float32, np.int32, np.int64, np.uint8]),
                         st.tuples(st.integers(1, 12), st.integers(1, 12)),
                         elements={'min_value': 0, 'max_value': 100}))
    def test_cost_matches_scipy(self, costs):
        result = terrace.assignment(costs)
        rows, columns = result
        best = costs[linear_sum_assignment(costs)].astype(float).sum()
        self.assertEqual(len(rows), min(costs.shape))
        self.assertEqual(len(set(columns)), len(columns))
        self.assertAlmostEqual(result.cost, best, delta=1e-5 * (1 + best))
        slack = costs - np.add.outer(result.row_duals, result.column_duals)
        self.assertGreater(slack.min(), -1e-4)

    def test_points(self):
        for width in (2, 3):
            a, b = (np.random.default_rng(seed).random((60 + seed, width)) for seed in (1, 2))
            costs = cdist(a, b)
            self.assertAlmostEqual(terrace.assignment(a, b).cost, costs[linear_sum_assignment(costs)].sum(), places=9)

    def test_sparse_costs(self):
        random = np.random.default_rng(14)
        for rows, columns in ((40, 60), (60, 40), (50, 50)):
            costs = np.where(random.random((rows, columns)) < 0.2, random.random((rows, columns)) + 0.1, 0)
            costs[np.arange(min(rows, columns)), np.arange(min(rows, columns))] = 1  # guarantees an assignment
            result = terrace.assignment(sparse.csc_matrix(costs))
            dear = np.where(costs > 0, costs, 1e6)
            self.assertAlmostEqual(result.cost, dear[linear_sum_assignment(dear)].sum(), places=6)
            self.assertTrue((costs[result.columns >= 0, result.columns[result.columns >= 0]] > 0).all())
        with self.assertRaises(ValueError):
            terrace.assignment(sparse.csr_matrix(([1.0, 1.0], ([0, 1], [0, 0])), shape=(2, 2)))

    def test_costs_from_a_function_of_rows(self):
        costs = np.random.default_rng(27).random((40, 60))
        result = terrace.assignment(lambda row: costs[row], shape=costs.shape)
        np.testing.assert_array_equal(result.columns, terrace.assignment(costs).columns)
        self.assertEqual(result.cost, terrace.assignment(costs).cost)

        class Enough(Exception):
            pass

        def raising(row):
            raise Enough

        for function, shape, kind in ((raising, (2, 2), Enough), (lambda row: [1], (2, 2), ValueError), (lambda row: 'ab', (2, 2), TypeError),
                                      (lambda row: [np.nan] * 2, (2, 2), ValueError), (costs, (2, 2), TypeError),
                                      (lambda row: [1], (-1, 2), ValueError), (lambda row: [1], (1.5, 2), TypeError)):
            with self.assertRaises(kind):
                terrace.assignment(function, shape=shape)

    def test_rejects_invalid_arguments(self):
        for wrong, kind in (([[1, np.nan]], ValueError), ([1, 2], ValueError), ([['a']], TypeError),
                            (np.zeros((2, 2), complex), TypeError), ([[np.inf]], ValueError)):
            with self.assertRaises(kind):
                terrace.assignment(wrong)
        with self.assertRaises(ValueError):
            terrace.assignment([[0, 0]], [[0, 0, 0]])
        self.assertEqual(terrace.assignment(np.zeros((0, 5))).columns.shape, (0,))


class Matchings(unittest.TestCase):
    def brute(self, distances):
        def best(left):
            if len(left) < 2:
                return 0
            return min(distances[left[0], other] + best([i for i in left[1:] if i != other]) for other in left[1:])
        return best(list(range(len(distances))))

    @settings(max_examples=40, deadline=None, derandomize=True)
    @given(st.integers(1, 4), st.sampled_from([2, 3]), st.integers(0, 10 ** 6))
    def test_matching_is_optimal(self, pairs, width, seed):
        points = np.random.default_rng(seed).random((2 * pairs, width))
        result = terrace.matching(points)
        self.assertAlmostEqual(result.cost, self.brute(cdist(points, points)), places=9)
        self.assertAlmostEqual(result.cost, result.bound, places=9)
        self.assertTrue(result.optimal)
        np.testing.assert_array_equal(result.mates[result.mates], np.arange(2 * pairs))
        self.assertEqual(result.pairs.shape, (pairs, 2))

    def test_matching_of_a_graph(self):
        random = np.random.default_rng(15)
        for _ in range(20):
            distances = np.round(random.normal(size=(8, 8)), 3)
            distances = np.minimum(distances, distances.T)
            edges = np.array([*itertools.combinations(range(8), 2)])
            result = terrace.edge_matching(edges, distances[tuple(edges.T)])
            self.assertAlmostEqual(result.cost, self.brute(distances), places=9)
            self.assertAlmostEqual(result.bound, result.cost, places=9)
            np.testing.assert_array_equal(result.mates[result.mates], np.arange(8))
        self.assertEqual(terrace.edge_matching([], []).pairs.shape, (0, 2))
        star = [[0, 1], [0, 2], [0, 3]]  # no perfect matching
        for wrong in ((star, [1, 1, 1]), ([[0, 1]], [1, 2]), ([[0, 0]], [1]), ([[0, -1]], [1]), ([[0, 1]], [np.nan]),
                      ([[0, 1]], [1], 3), ([[0, 1]], [1], 1), ([[0, 1, 2]], [1])):
            with self.assertRaises(ValueError):
                terrace.edge_matching(*wrong)

    def test_halving_approximates_the_optimum(self):
        for width, count in ((2, 40), (3, 31)):
            points = np.random.default_rng(count).random((count, width))
            best = terrace.matching(points)
            result = terrace.halving_matching(points, iterations=400)
            self.assertLess(result.cost, 1.2 * best.cost)
            self.assertGreaterEqual(result.cost, best.cost - 1e-9)
            self.assertAlmostEqual(result.cost, np.linalg.norm(points[result.pairs[:, 0]] - points[result.pairs[:, 1]], axis=1).sum(), places=9)
            self.assertEqual((result.mates == -1).sum(), count % 2)
            self.assertTrue((np.diff(result.steps, axis=0) * [1, -1] > 0).all())
            self.assertEqual((result.steps[-1, 1], result.iterations), (result.cost, 400))
            by_matrix = terrace.halving_matching(cdist(points, points), distances=True, iterations=400)
            np.testing.assert_allclose(by_matrix.cost, result.cost, rtol=1e-9)
            random = terrace.halving_matching(points, method='monte-carlo', iterations=50, threads=3)
            self.assertGreater(random.cost, result.cost)
            np.testing.assert_array_equal(random.mates, terrace.halving_matching(points, method='monte-carlo', iterations=50, threads=1).mates)
        self.assertEqual(terrace.halving_matching(np.zeros((0, 2))).pairs.shape, (0, 2))
        self.assertLess(terrace.halving_matching(np.random.default_rng(1).random((200, 2)), iterations=10 ** 9, seconds=0.1).iterations, 10 ** 6)
        for wrong, options in (([[0, np.nan], [1, 1]], {}), ([[1, 2, 3], [1, 2, 3]], {'distances': True}), ([[0, 0]], {'method': 'fast'}),
                               ([[0, np.inf], [np.inf, 0]], {'distances': True}), ([0], {'distances': True}), ([[0, 0]], {'iterations': 0})):
            with self.assertRaises(ValueError):
                terrace.halving_matching(wrong, **options)

    def test_labels_are_matched_first(self):
        points, labels = np.random.default_rng(28).random((90, 2)), np.repeat([5, -2, 10 ** 12], [31, 29, 30])
        result = terrace.matching(points, labels=labels, rounds=0)
        apart = sum(labels[a] != labels[b] for a, b in result.pairs)
        self.assertEqual(apart, 1)  # the points left over from the two odd clusters
        self.assertLessEqual(terrace.matching(points, labels=labels).cost, result.cost)
        for wrong, options, kind in ((points, {'labels': labels[:3]}, ValueError), (points, {'labels': labels * 0.5}, TypeError),
                                     (points, {'tolerance': -1}, ValueError)):
            with self.assertRaises(kind):
                terrace.matching(wrong, **options)

    def test_sizes(self):
        odd = terrace.matching(np.random.default_rng(1).random((101, 2)))
        self.assertEqual((odd.mates == -1).sum(), 1)
        large = terrace.matching(np.random.default_rng(1).random((3000, 2)), exact_limit=1000, window=500)
        self.assertFalse(large.optimal)
        self.assertLessEqual(large.bound, large.cost)
        self.assertEqual(terrace.matching(np.zeros((0, 2))).pairs.shape, (0, 2))
        with self.assertRaises(ValueError):
            terrace.matching([[0, np.nan], [1, 1]])


if __name__ == '__main__':
    unittest.main()
