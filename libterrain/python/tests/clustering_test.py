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


def some_points(most, width=2, least=2):
    return arrays.arrays(np.float64, st.tuples(st.integers(least, most), st.just(width)),
                         elements=st.floats(-100, 100, width=32))


class Linkage(unittest.TestCase):
    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(some_points(60), st.sampled_from(['single', 'complete']))
    def test_heights_are_scipys(self, points, method):
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # points may look like a matrix of distances
            made, expected = terrace.linkage(points, method), hierarchy.linkage(points, method)
        self.assertTrue(hierarchy.is_valid_linkage(made))
        if method == 'single' or len(np.unique(expected[:, 2])) == len(expected):
            np.testing.assert_allclose(made[:, 2], expected[:, 2], rtol=1e-9, atol=1e-9)

    def test_rows_and_cuts_are_scipys(self):
        points = np.random.default_rng(2).random((400, 3))
        for method in ('single', 'complete'):
            made = terrace.linkage(points, method)
            expected = hierarchy.linkage(points, method)
            np.testing.assert_array_equal(made[:, [0, 1, 3]], expected[:, [0, 1, 3]])
            for count in (1, 5, 40):
                ours = terrace.flat_clusters(made, count=count)
                theirs = hierarchy.fcluster(expected, count, 'maxclust')
                self.assertEqual(len({*zip(ours, theirs)}), count)
            height = float(np.median(made[:, 2]))
            ours = terrace.flat_clusters(made, height=height)
            theirs = hierarchy.fcluster(expected, height, 'distance')
            self.assertEqual(len({*zip(ours, theirs)}), len(set(theirs)))

    def test_misuse(self):
        self.assertEqual(terrace.linkage(np.zeros((1, 2))).shape, (0, 4))
        for wrong in ([[np.nan, 0], [0, 0]], [[1, 2, 3, 4]], [1, 2]):
            with self.assertRaises(ValueError):
                terrace.linkage(wrong)
        with self.assertRaises(ValueError):
            terrace.linkage([[0, 0], [1, 1]], 'average')
        for rows in ([[0, 0, 1, 2]], [[0, 5, 1, 2]], [[0, -1, 1, 2]], [[0, np.nan, 1, 2]], [[0, 1, -1, 2]]):
            with self.assertRaises(ValueError):
                terrace.flat_clusters(rows, count=1)
        rows = terrace.linkage([[0, 0], [1, 1]])
        for wrong in ({}, {'count': 1, 'height': 1}, {'count': 0}, {'count': 9}, {'height': np.nan}):
            with self.assertRaises(ValueError):
                terrace.flat_clusters(rows, **wrong)


    def test_of_distances(self):
        points = np.random.default_rng(12).random((150, 3))
        made = terrace.linkage(pdist(points, 'cityblock'), 'complete')
        expected = hierarchy.linkage(pdist(points, 'cityblock'), 'complete')
        np.testing.assert_array_equal(made[:, [0, 1, 3]], expected[:, [0, 1, 3]])
        np.testing.assert_allclose(made[:, 2], expected[:, 2], rtol=1e-12)
        for wrong, method in ((np.ones(4), 'complete'), (np.ones(3), 'single'), (-np.ones(3), 'complete'), ([np.nan], 'complete')):
            with self.assertRaises(ValueError):
                terrace.linkage(wrong, method)

    def test_spanning_tree_is_scipys(self):
        points = np.random.default_rng(13).random((400, 2))
        edges, lengths = terrace.spanning_tree(points)
        np.testing.assert_allclose(lengths, np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1), rtol=1e-12)
        expected = minimum_spanning_tree(cdist(points, points)).tocoo()
        self.assertEqual({tuple(sorted(edge)) for edge in edges.tolist()},
                         {tuple(sorted(edge)) for edge in zip(expected.row.tolist(), expected.col.tolist())})


class KMeans(unittest.TestCase):
    @settings(max_examples=40, deadline=None, derandomize=True)
    @given(some_points(80, width=3, least=5), st.integers(1, 5))
    def test_is_a_fixed_point_of_lloyd(self, points, clusters):
        made = terrace.kmeans(points, clusters)
        self.assertTrue(made.converged)
        squares = cdist(points, made.centres, 'sqeuclidean')
        chosen = squares[np.arange(len(points)), made.labels]
        np.testing.assert_allclose(chosen, squares.min(axis=1), rtol=1e-6, atol=1e-6)
        self.assertAlmostEqual(made.inertia, chosen.sum(), delta=1e-6 * (1 + chosen.sum()))
        for label in np.unique(made.labels):
            np.testing.assert_allclose(made.centres[label], points[made.labels == label].mean(axis=0), rtol=0, atol=1e-6)

    def test_from_centres_and_with_weights(self):
        points = np.random.default_rng(3).random((500, 2))
        weights = np.random.default_rng(4).random(500) + 0.5
        made = terrace.kmeans(points, points[:7], weights=weights)
        for label in range(7):
            of = made.labels == label
            np.testing.assert_allclose(made.centres[label], np.average(points[of], axis=0, weights=weights[of]), atol=1e-9)
        self.assertEqual(made.centres.shape, (7, 2))
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
                made = terrace.cluster(points, 0.3, method=method, effort='full')
                cost = price * len(made.facilities) + distances[made.facilities[made.labels], np.arange(11)].sum()
                self.assertAlmostEqual(made.cost, cost, places=9)
                self.assertGreaterEqual(cost, best - 1e-9)
                self.assertLessEqual(cost, best * (1 + 1e-9 if method == 'interchange' else 1.9))
                self.assertLessEqual(made.lower_bound, best + 1e-9)

    def test_any_costs(self):
        for seed in range(6):
            random = np.random.default_rng(seed)
            connection, opening = random.random((9, 14)), random.random(9)

            def cost_of(chosen):
                return connection[list(chosen)].min(axis=0).sum()

            subsets = [chosen for size in range(1, 10) for chosen in itertools.combinations(range(9), size)]
            best = min(opening[list(chosen)].sum() + cost_of(chosen) for chosen in subsets)
            for method in ('interchange', 'jain-vazirani', 'greedy-stars'):
                made = terrace.facility_location(connection, opening, method=method, effort='full')
                cost = opening[made.facilities].sum() + connection[made.facilities[made.labels], np.arange(14)].sum()
                self.assertAlmostEqual(made.cost, cost, places=9)
                self.assertLessEqual(made.lower_bound, best + 1e-9)
                self.assertGreater(made.lower_bound, 0.8 * best)
                self.assertGreaterEqual(made.cost, best - 1e-9)
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

    def test_bounds(self):
        points = np.random.default_rng(6).random((300, 2))
        plain, bounded = terrace.cluster(points, 0.05), terrace.cluster(points, 0.05, bound_steps=100)
        self.assertEqual(plain.cost, bounded.cost)
        self.assertTrue(0.9 * bounded.cost < bounded.lower_bound <= bounded.cost)

    def test_k_median(self):
        points = np.random.default_rng(5).random((12, 2))
        distances = cdist(points, points)
        best = min(distances[list(chosen)].min(axis=0).sum() for chosen in itertools.combinations(range(12), 3))
        made = terrace.cluster(points, count=3)
        self.assertEqual(len(made.facilities), 3)
        self.assertAlmostEqual(made.cost, distances[made.facilities[made.labels], np.arange(12)].sum(), places=9)
        self.assertLessEqual(made.cost, 1.2 * best)
        for wrong in (0, 13):
            with self.assertRaises(ValueError):
                terrace.cluster(points, count=wrong)

    def test_outliers_and_metrics(self):
        points = np.vstack((np.random.default_rng(1).random((200, 2)), [[50, 50]]))
        made = terrace.cluster(points, 0.05, method='automatic', outlier_price=0.03)
        self.assertEqual(made.labels[200], -1)
        terrace.cluster(points, metric='minkowski:1', method='automatic')
        for wrong in ({'metric': 'minkowski:-1'}, {'method': 'best'}, {'facility_cost': 0}, {'facility_cost': np.nan},
                      {'weights': [1.0]}, {'outlier_price': 0.1}, {'effort': 'none'}):
            with self.subTest(repr(wrong)):
                with self.assertRaises(ValueError):
                    terrace.cluster(points, **wrong)
        with self.assertRaises(ValueError):
            terrace.cluster(np.zeros((0, 2)))


class Assignments(unittest.TestCase):
    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(arrays.arrays(st.sampled_from([np.float64, np.float32, np.int32, np.int64, np.uint8]),
                         st.tuples(st.integers(1, 12), st.integers(1, 12)),
                         elements={'min_value': 0, 'max_value': 100}))
    def test_is_scipys_optimum(self, costs):
        made = terrace.assignment(costs)
        rows, columns = made
        best = costs[linear_sum_assignment(costs)].astype(float).sum()
        self.assertEqual(len(rows), min(costs.shape))
        self.assertEqual(len(set(columns)), len(columns))
        self.assertAlmostEqual(made.cost, best, delta=1e-5 * (1 + best))
        slack = costs - np.add.outer(made.row_duals, made.column_duals)
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
            costs[np.arange(min(rows, columns)), np.arange(min(rows, columns))] = 1  # so that there is an assignment
            made = terrace.assignment(sparse.csc_matrix(costs))
            dear = np.where(costs > 0, costs, 1e6)
            self.assertAlmostEqual(made.cost, dear[linear_sum_assignment(dear)].sum(), places=6)
            self.assertTrue((costs[made.columns >= 0, made.columns[made.columns >= 0]] > 0).all())
        with self.assertRaises(ValueError):
            terrace.assignment(sparse.csr_matrix(([1.0, 1.0], ([0, 1], [0, 0])), shape=(2, 2)))

    def test_misuse(self):
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
    def test_is_optimal(self, pairs, width, seed):
        points = np.random.default_rng(seed).random((2 * pairs, width))
        made = terrace.matching(points)
        self.assertAlmostEqual(made.cost, self.brute(cdist(points, points)), places=9)
        self.assertAlmostEqual(made.cost, made.bound, places=9)
        self.assertTrue(made.optimal)
        np.testing.assert_array_equal(made.mates[made.mates], np.arange(2 * pairs))
        self.assertEqual(made.pairs.shape, (pairs, 2))

    def test_of_edges(self):
        random = np.random.default_rng(15)
        for _ in range(20):
            distances = np.round(random.normal(size=(8, 8)), 3)
            distances = np.minimum(distances, distances.T)
            edges = np.array([*itertools.combinations(range(8), 2)])
            made = terrace.edge_matching(edges, distances[tuple(edges.T)])
            self.assertAlmostEqual(made.cost, self.brute(distances), places=9)
            self.assertAlmostEqual(made.bound, made.cost, places=9)
            np.testing.assert_array_equal(made.mates[made.mates], np.arange(8))
        self.assertEqual(terrace.edge_matching([], []).pairs.shape, (0, 2))
        star = [[0, 1], [0, 2], [0, 3]]  # no perfect matching
        for wrong in ((star, [1, 1, 1]), ([[0, 1]], [1, 2]), ([[0, 0]], [1]), ([[0, -1]], [1]), ([[0, 1]], [np.nan]),
                      ([[0, 1]], [1], 3), ([[0, 1]], [1], 1), ([[0, 1, 2]], [1])):
            with self.assertRaises(ValueError):
                terrace.edge_matching(*wrong)

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
