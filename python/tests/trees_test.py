# SPDX-License-Identifier: Apache-2.0
"""Matching trees match their definition, queries in bounding volumes match brute force."""

import unittest

import numpy as np

import terrace

try:
    from scipy.spatial import cKDTree
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')


class MatchingTrees(unittest.TestCase):
    def check_tree(self, points, weights, result):
        n = len(points)
        mass, places, sizes = list(weights), list(points), [1] * n
        for row, (a, b, distance, size) in enumerate(result.rows):
            a, b = int(a), int(b)
            self.assertTrue(a < b < n + row)
            mass.append(mass[a] + mass[b])
            places.append((places[a] * mass[a] + places[b] * mass[b]) / mass[-1])
            sizes.append(sizes[a] + sizes[b])
            np.testing.assert_allclose(result.positions[row], places[-1], atol=1e-9)
            self.assertAlmostEqual(distance, np.linalg.norm(places[a] - places[b]), places=9)
            self.assertEqual(size, sizes[-1])
        self.assertEqual(len(set(result.rows[:, :2].ravel())), 2 * (n - 1))
        self.assertEqual(sizes[-1], n)

    def test_tree_is_repeated_matching(self):
        random = np.random.default_rng(1)
        for width in (2, 3):
            points = random.random((301, width))
            result = terrace.matching_tree(points)
            self.check_tree(points, np.ones(301), result)
            first = result.rows[result.levels == 1][:, :2].astype(int)
            self.assertEqual({*map(tuple, first)}, {*map(tuple, terrace.matching(points).pairs)})
            self.assertEqual(result.levels.max(), 9)  # the binary logarithm of 301, rounded up
            weights = random.random(301) + 0.1
            self.check_tree(points, weights, terrace.matching_tree(points, weights=weights, threads=2))

    def test_each_label_is_a_subtree(self):
        points, labels = np.random.default_rng(2).random((60, 2)), np.repeat([-7, 10 ** 12, 3], 20)
        result = terrace.matching_tree(points, labels=labels)
        below = [{label} for label in labels]
        for a, b in result.rows[:, :2].astype(int):
            below.append(below[a] | below[b])
        self.assertEqual(sum(len(mixed) == 1 for mixed in below[60:]), 3 * 19)

    def test_custom_matcher(self):
        points = np.random.default_rng(8).random((37, 2))
        sizes = []

        def halves(nodes):
            sizes.append(len(nodes))
            return terrace.halving_matching(nodes, iterations=50).mates

        result = terrace.matching_tree(points, matcher=halves)
        self.check_tree(points, np.ones(37), result)
        self.assertEqual(sizes, [37, 19, 10, 5, 3, 2])
        first = result.rows[result.levels == 1][:, :2].astype(int)
        self.assertEqual({*map(tuple, first)}, {*map(tuple, terrace.halving_matching(points, iterations=50).pairs)})

        class Enough(Exception):
            pass

        def raising(nodes):
            raise Enough

        for matcher, kind in ((raising, Enough), (lambda nodes: [0] * len(nodes), ValueError), (lambda nodes: [-1] * len(nodes), ValueError),
                              (lambda nodes: [99] * len(nodes), ValueError), (lambda nodes: [1, 0], ValueError), (lambda nodes: 'a', TypeError), (3, TypeError)):
            with self.assertRaises(kind):
                terrace.matching_tree(points, matcher=matcher)

    def test_rotations_shrink_boxes(self):
        random = np.random.default_rng(9)
        for width in (2, 3):
            lower = random.random((400, width)) ** 3
            for boxes in ((lower,), (lower, lower + 0.02 * random.random((400, width)))):
                tree = terrace.linkage(lower)
                rows = terrace.rotate_tree(tree, *boxes)
                self.assertEqual(sorted(rows.ravel()), [*range(798)])  # each node except the root has one parent
                self.assertTrue((rows.max(axis=1) < 400 + np.arange(399)).all())

                def area_sum(children):
                    low, high = [*boxes[0]], [*boxes[-1]]
                    total = 0
                    for a, b in children.astype(int):
                        low.append(np.minimum(low[a], low[b]))
                        high.append(np.maximum(high[a], high[b]))
                        side = high[-1] - low[-1]
                        total += side.sum() if width == 2 else side[0] * side[1] + side[1] * side[2] + side[2] * side[0]
                    return total

                self.assertLess(area_sum(rows), area_sum(tree[:, :2]))
            queries = random.random((50, width))
            for given, want in zip(terrace.PointTree(lower, rows).nearest(queries, 3), terrace.PointTree(lower, tree).nearest(queries, 3)):
                np.testing.assert_array_equal(given, want)
        self.assertAlmostEqual(terrace.PointTree(lower, terrace.rotate_tree(tree, lower, passes=0)).cost, terrace.PointTree(lower, tree).cost)
        for wrong in (lambda: terrace.rotate_tree(tree, lower[:5]), lambda: terrace.rotate_tree(tree, lower, lower[:5]),
                      lambda: terrace.rotate_tree(tree, lower, lower - 1), lambda: terrace.rotate_tree(tree, lower, lower[:, :2]),
                      lambda: terrace.rotate_tree([[0, 0]], lower[:2]), lambda: terrace.rotate_tree(tree, lower * np.nan)):
            with self.assertRaises(ValueError):
                wrong()

    def test_rejects_invalid_arguments(self):
        self.assertEqual(terrace.matching_tree(np.zeros((1, 2))).rows.shape, (0, 4))
        some = np.random.default_rng(3).random((5, 2))
        for wrong in (lambda: terrace.matching_tree([[np.nan, 0], [0, 0]]), lambda: terrace.matching_tree(some, labels=[1]),
                      lambda: terrace.matching_tree(some, weights=[1, 2]), lambda: terrace.matching_tree(some, weights=np.zeros(5))):
            with self.assertRaises(ValueError):
                wrong()
        with self.assertRaises(TypeError):
            terrace.matching_tree(some, labels=np.zeros(5))


class Queries(unittest.TestCase):
    def test_nearest_points_match_scipy_on_any_tree(self):
        random = np.random.default_rng(4)
        for width in (2, 3):
            points, queries = random.random((2000, width)), random.random((500, width)) * 2 - 0.5
            expected = cKDTree(points).query(queries, 5)
            for tree in (None, terrace.linkage(points), terrace.matching_tree(points)):
                result = terrace.PointTree(points, tree)
                found, distances = result.nearest(queries, 5)
                np.testing.assert_array_equal(found, expected[1])
                np.testing.assert_allclose(distances, expected[0], rtol=1e-12)
        self.assertLess(terrace.PointTree(points).cost, terrace.PointTree(points, terrace.linkage(points)).cost)
        few = terrace.PointTree([[0, 0], [1, 0]])
        self.assertEqual(few.nearest([[2, 0]], 3)[0].tolist(), [[1, 0, -1]])
        self.assertEqual(terrace.PointTree(np.empty((0, 2))).nearest([[0, 0]])[0].tolist(), [[-1]])

    def test_first_balls_along_rays(self):
        random = np.random.default_rng(5)
        points, origins = random.random((300, 3)), random.random((200, 3)) * 3 - 1
        directions = random.random((200, 3)) - 0.3 * origins - 0.4
        found, t = terrace.PointTree(points).hit(origins, directions, 0.05)
        towards = points - origins[:, None]
        along = np.einsum('rd,rpd->rp', directions, towards)
        square = (directions ** 2).sum(axis=1)[:, None]
        under = along ** 2 - square * ((towards ** 2).sum(axis=2) - 0.05 ** 2)
        with np.errstate(invalid='ignore'):
            enter, leave = (along - np.sqrt(under)) / square, (along + np.sqrt(under)) / square
        meets = np.where((under >= 0) & (leave >= 0), np.maximum(enter, 0), np.inf)
        np.testing.assert_allclose(t, meets.min(axis=1), rtol=0, atol=1e-9)
        some = np.isfinite(t)
        self.assertTrue(some.any() and not some.all())
        np.testing.assert_array_equal(found, np.where(some, meets.argmin(axis=1), -1))

    def test_first_triangles_along_rays(self):
        random = np.random.default_rng(6)
        vertices = random.random((300, 3))
        triangles = np.array([random.choice(300, 3, replace=False) for _ in range(200)])
        origins = random.random((300, 3)) * 3 - 1
        directions = 0.5 - origins + random.random((300, 3)) * 0.2
        result = terrace.TriangleTree(vertices, triangles)
        found, t = result.hit(origins, directions)
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        across = np.cross(b - a, c - a)
        steep = directions @ across.T
        times = np.einsum('td,rtd->rt', across, a - origins[:, None]) / steep
        places = origins[:, None] + times[..., None] * directions[:, None]
        inside = times >= 0
        for from_, to in ((a, b), (b, c), (c, a)):
            inside &= np.einsum('rtd,td->rt', np.cross(to - from_, places - from_), across) >= 0
        times = np.where(inside, times, np.inf)
        np.testing.assert_array_equal(found >= 0, np.isfinite(times).any(axis=1))
        np.testing.assert_allclose(t, times.min(axis=1), rtol=0, atol=1e-9)
        self.assertGreater((found >= 0).sum(), 50)

        near, distances = result.nearest(origins)
        weights = random.dirichlet([1, 1, 1], 4000)
        for place, triangle, distance in zip(origins[:40], near, distances):
            on = np.einsum('wk,tkd->twd', weights, vertices[triangles])
            sampled = np.linalg.norm(on - place, axis=2).min(axis=1)
            self.assertLessEqual(distance, sampled.min() + 1e-12)
            self.assertAlmostEqual(distance, sampled[triangle], delta=0.03)

    def test_accepts_a_mesh(self):
        y, x = np.mgrid[0:20, 0:20]
        mesh = terrace.bounded_mesh(np.sin(x / 3.0) + y / 9, 0.1)
        tree = terrace.TriangleTree(*mesh)
        found, t = tree.hit([[10.3, -10.4, 100]], [[0, 0, -1]])
        samples = np.column_stack((x.ravel() + 0.5, -y.ravel() - 0.5, (np.sin(x / 3.0) + y / 9).ravel()))
        height = terrace.interpolate(samples, [[10.3, -10.4]])
        self.assertAlmostEqual(100 - t[0], height[0], delta=0.2)
        self.assertIn('triangles', repr(tree))

    def test_rejects_invalid_arguments(self):
        points = np.random.default_rng(7).random((5, 3))
        tree, triangles = terrace.PointTree(points), terrace.TriangleTree(points, [[0, 1, 2]])
        for wrong in (lambda: terrace.PointTree(points, [[0, 1]]), lambda: terrace.PointTree(points, [[0, 9], [1, 2], [3, 4], [5, 6]]),
                      lambda: terrace.PointTree(points, [[0, -1], [1, 2], [3, 4], [5, 6]]),
                      lambda: terrace.PointTree([[0, np.nan]]), lambda: tree.nearest([[0, 0]]),
                      lambda: tree.nearest(points, 0), lambda: tree.nearest([[np.nan, 0, 0]]),
                      lambda: tree.hit(points, points[:2], 1), lambda: tree.hit(points, points, -1),
                      lambda: terrace.PointTree([[0, 0]]).hit([[0, 0, 0]], [[0, 0, 1]], 1),
                      lambda: terrace.TriangleTree(points, [[0, 1, 5]]), lambda: terrace.TriangleTree(points, [[0, 1]]),
                      lambda: triangles.hit([[0, 0, 0]], [[0, 0, 0]]), lambda: triangles.nearest([[0, 0, np.inf]])):
            with self.assertRaises(ValueError):
                wrong()


if __name__ == '__main__':
    unittest.main()
