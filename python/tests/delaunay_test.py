# SPDX-License-Identifier: Apache-2.0
"""Triangulations match SciPy's, have empty circumcircles, and are restored by removals."""

import threading
import unittest

import numpy as np

import terrace

try:
    from hypothesis import given, settings, strategies as st
    from hypothesis.extra import numpy as arrays
    from scipy.spatial import Delaunay
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')


def corner_sets(points, simplices):
    return {tuple(sorted(map(tuple, points[corners]))) for corners in simplices}


def few_places(width):
    """Generates points on a small lattice, where equal, collinear and cocircular points are common."""
    return arrays.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(width)),
                         elements=st.integers(0, 6).map(float))


class Triangulations(unittest.TestCase):
    def test_matches_scipy(self):
        for kind, width, count in ((terrace.Delaunay2, 2, 20000), (terrace.Delaunay3, 3, 3000)):
            points = np.random.default_rng(5).random((count, width))
            result = kind(points)
            expected = Delaunay(points)
            self.assertEqual(corner_sets(result.points, result.simplices), corner_sets(points, expected.simplices))
            np.testing.assert_array_equal(result.points[result.ids], points)
            queries = np.random.default_rng(6).random((500, width)) * 1.2 - 0.1
            rows, theirs = result.find_simplex(queries), expected.find_simplex(queries)
            np.testing.assert_array_equal(rows >= 0, theirs >= 0)
            for row, other in zip(rows[rows >= 0], theirs[rows >= 0]):
                self.assertEqual(corner_sets(result.points, result.simplices[[row]]),
                                 corner_sets(points, expected.simplices[[other]]))

    def test_neighbours_share_a_side(self):
        for kind, width in ((terrace.Delaunay2, 2), (terrace.Delaunay3, 3)):
            result = kind(np.random.default_rng(8).random((300, width)))
            simplices, neighbors = result.simplices, result.neighbors
            for row, around in zip(simplices, neighbors):
                for corner, other in enumerate(around):
                    if other >= 0:
                        side = set(np.delete(row, corner))
                        self.assertTrue(side <= set(simplices[other]))
                        self.assertNotIn(row[corner], simplices[other])

    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(few_places(2), st.integers(0, 40), st.randoms(use_true_random=False))
    def test_removal_restores_triangles(self, points, kept, random):
        self.check_removal(terrace.Delaunay2, points, kept, random)

    @settings(max_examples=40, deadline=None, derandomize=True)
    @given(few_places(3), st.integers(0, 40), st.randoms(use_true_random=False))
    def test_removal_restores_tetrahedra(self, points, kept, random):
        self.check_removal(terrace.Delaunay3, points, kept, random)

    def check_removal(self, kind, points, kept, random):
        points = np.unique(points, axis=0)
        order = list(range(len(points)))
        random.shuffle(order)
        points = points[order]
        kept = min(kept, len(points))
        only = kind(points[:kept])
        both = kind(points[:kept])
        added = both.insert(points[kept:])
        self.assertEqual(len(both), len(points))
        self.assertEqual(both.digest(), kind(points[::-1]).digest())
        both.remove(added)
        self.assertEqual(both.digest(), only.digest())
        self.assertEqual(len(both), kept)

    def test_equal_points_share_a_vertex(self):
        result = terrace.Delaunay2([[0, 0], [1, 0], [0, 0], [0, 1], [-0.0, 1]])
        self.assertEqual(len(result), 3)
        self.assertEqual(result.ids[0], result.ids[2])
        self.assertEqual(result.insert([[1, 0]])[0], result.ids[1])

    def test_simplices_index_the_callers_points(self):
        for kind, width in ((terrace.Delaunay2, 2), (terrace.Delaunay3, 3), (terrace.DynamicSurface, 3)):
            with self.subTest(kind=kind.__name__):
                points = np.random.default_rng(21).random((500, width))
                result = kind(points)
                np.testing.assert_array_equal(result.points, points)
                np.testing.assert_array_equal(result.ids, np.arange(500))
                np.testing.assert_array_equal(result.vertices, np.arange(500))
                self.assertEqual((result.simplices.min(), result.simplices.max()), (0, 499))
                if kind is not terrace.DynamicSurface:
                    theirs = Delaunay(points).simplices
                    self.assertEqual({frozenset(row) for row in result.simplices.tolist()}, {frozenset(row) for row in theirs.tolist()})
                # Later points get free numbers first, then the numbers that follow.
                more = result.insert(points[:40] + 2)
                np.testing.assert_array_equal(more, np.arange(500, 540))
                result.remove(more[::2])
                result.remove([7])
                self.assertTrue(np.isnan(result.points[[7, *more[::2]]]).all())
                self.assertNotIn(7, result.simplices)
                again = result.insert(points[:10] + 4)
                self.assertLess(again.max(), 540)
                np.testing.assert_array_equal(result.points[again], points[:10] + 4)
                kept = np.setdiff1d(np.arange(500), [7, *again])
                np.testing.assert_array_equal(result.points[kept], points[kept])
                self.assertEqual(len(result), len(result.vertices))

    def test_copies_refer_to_the_first_equal_point(self):
        points = np.array([[0, 0], [1, 0], [0, 0], [0, 1], [1, 0], [1, 1]], float)
        result = terrace.Delaunay2(points)
        self.assertEqual(result.ids.tolist(), [0, 1, 0, 3, 1, 5])
        np.testing.assert_array_equal(result.points, points)
        self.assertEqual(set(result.simplices.ravel().tolist()), {0, 1, 3, 5})
        self.assertEqual(result.vertices.tolist(), [0, 1, 3, 5])
        with self.assertRaisesRegex(ValueError, 'no vertex 4'):
            result.remove([4])
        for wrong, text in (([9], 'no vertex 9'), ([-1], 'negative or too large'), ([3, 3], 'vertex 3 is named twice')):
            with self.assertRaisesRegex(ValueError, text):
                result.remove(wrong)
        result.remove([1])
        with self.assertRaisesRegex(ValueError, 'no vertex 1'):
            result.remove([1])
        self.assertTrue(np.isnan(result.points[[1, 4]]).all())
        number = result.insert([[1, 0], [5, 5]])[0]
        np.testing.assert_array_equal(result.points[number], (1, 0))
        self.assertEqual(result.insert(points).tolist(), [0, number, 0, 3, number, 5])

    def test_values_are_ordered_by_number(self):
        points = np.random.default_rng(22).random((300, 2))
        result = terrace.Delaunay2(points)
        values = points @ (2, 3)
        inside = points[:50] * 0.2 + 0.4
        np.testing.assert_allclose(result.heights(values, inside), inside @ (2, 3), rtol=1e-12)
        np.testing.assert_allclose(result.gradients(values, inside), np.broadcast_to((2, 3), (50, 2)), rtol=1e-9)
        shares, vertices, begins = result.weights(inside)
        np.testing.assert_allclose(np.add.reduceat(shares * values[vertices], begins[:-1]), inside @ (2, 3), rtol=1e-12)
        np.testing.assert_array_equal(result.nearest(points), np.arange(300))
        np.testing.assert_allclose(result.smooth(values, vertices=[5])[np.arange(300) != 5], values[np.arange(300) != 5])
        with self.assertRaisesRegex(ValueError, 'values` of the shape'):
            result.heights(values[:-1], inside)
        self.assertEqual(terrace.Delaunay2.of_grid(4, 3).simplices.min(), 0)
        np.testing.assert_array_equal(terrace.Delaunay2.of_grid(4, 3).points[5], (1, 1))

    def test_nearest(self):
        points = np.random.default_rng(9).random((1000, 2))
        queries = np.random.default_rng(10).random((300, 2)) * 2 - 0.5
        result = terrace.Delaunay2(points)
        closest = np.argmin(((queries[:, None] - points) ** 2).sum(axis=2), axis=1)
        np.testing.assert_array_equal(result.nearest(queries), result.ids[closest])
        self.assertEqual(terrace.Delaunay2().nearest([[0, 0]])[0], -1)

    def test_changes_add_up(self):
        for kind, width in ((terrace.Delaunay2, 2), (terrace.Delaunay3, 3), (terrace.DynamicSurface, 3)):
            random = np.random.default_rng(11)
            result = kind(random.random((200, width)))
            with self.assertRaises(ValueError):
                result.changes()
            result.record()
            places = dict(zip(result.vertices.tolist(), map(tuple, result.points[result.vertices])))
            simplices = {frozenset(row) for row in result.simplices.tolist()}
            for step in range(6):
                added = result.insert(random.random((40, width)))
                result.remove(random.choice(result.vertices, 30, replace=False))
                if step % 2:
                    result.insert(random.random((5, width)))
                changes = result.changes()
                for vertex, place in zip(changes.removed_vertices.tolist(), changes.removed_points):
                    self.assertEqual(places.pop(vertex), tuple(place))
                places.update(zip(changes.added_vertices.tolist(), map(tuple, result.points[changes.added_vertices])))
                gone = {frozenset(row) for row in changes.removed_simplices.tolist()}
                self.assertTrue(gone <= simplices)
                simplices = (simplices - gone) | {frozenset(row) for row in changes.added_simplices.tolist()}
                self.assertEqual(simplices, {frozenset(row) for row in result.simplices.tolist()})
                self.assertEqual(places, dict(zip(result.vertices.tolist(), map(tuple, result.points[result.vertices]))))
            self.assertEqual(len(added), 40)
            before = result.changes()
            self.assertEqual((len(before.added_vertices), before.added_simplices.shape[1:]), (0, changes.added_simplices.shape[1:]))
            both = result.insert(random.random((4, width)))
            result.remove(both)
            self.assertEqual(len(result.changes().added_vertices), 0)  # inserted and removed
            self.assertIn('added', repr(changes))

    def test_vertex_neighbours_match_scipy(self):
        for kind, width in ((terrace.Delaunay2, 2), (terrace.Delaunay3, 3)):
            points = np.random.default_rng(12).random((400, width))
            result, expected = kind(points), Delaunay(points)
            result.remove(result.insert(points[:3] + 7))  # leaves free numbers
            begins, joined = result.vertex_neighbor_vertices
            self.assertEqual(len(begins), len(result.points) + 1)
            theirs, other = expected.vertex_neighbor_vertices
            for i, vertex in enumerate(result.ids):
                np.testing.assert_array_equal(np.sort(joined[begins[vertex]:begins[vertex + 1]]),
                                              np.sort(result.ids[other[theirs[i]:theirs[i + 1]]]))
        self.assertEqual(len(terrace.Delaunay2().vertex_neighbor_vertices[1]), 0)

    def test_grid_matches_its_points(self):
        result = terrace.Delaunay2.of_grid(30, 20, (-4, 8), 0.5)
        y, x = np.mgrid[0:20, 0:30]
        points = np.column_stack((x.ravel() * 0.5 - 4, y.ravel() * 0.5 + 8))
        np.testing.assert_array_equal(result.points[result.ids], points)
        self.assertEqual(result.digest(), terrace.Delaunay2(points).digest())
        self.assertEqual(len(terrace.Delaunay2.of_grid(0, 5)), 0)
        for wrong in ((4, 3, (0, 0), 0.1), (3, 3, (0, 0), -1), (3, 3, (0, np.nan)), (-1, 3), (2 ** 20, 2 ** 20), (3, 3, (1,))):
            with self.assertRaises(ValueError):
                terrace.Delaunay2.of_grid(*wrong)

    def test_rejects_invalid_arguments(self):
        result = terrace.Delaunay2(np.random.default_rng(1).random((50, 2)))
        before = result.digest()
        for wrong, kind in (([[np.nan, 0]], ValueError), ([[np.inf, 0]], ValueError), ([[1, 2, 3]], ValueError),
                            ([1, 2], ValueError), ('ab', TypeError), (np.zeros((2, 2), complex), TypeError)):
            with self.assertRaises(kind):
                result.insert(wrong)
        for wrong, kind in (([result.ids[0], result.ids[0]], ValueError), ([-1], ValueError), ([10 ** 6], ValueError),
                            ([2 ** 40], ValueError), ([0.5], TypeError)):
            with self.assertRaises(kind):
                result.remove(wrong)
        self.assertEqual(result.digest(), before)
        result.remove([])
        result.remove(result.vertices)
        self.assertEqual((len(result), result.simplices.shape), (0, (0, 3)))
        self.assertEqual(terrace.Delaunay3().simplices.shape, (0, 4))
        self.assertEqual(result.find_simplex([[0, 0], [np.nan, 1]]).tolist(), [-1, -1])

    def test_threads_share_a_triangulation(self):
        result = terrace.Delaunay2(np.random.default_rng(1).random((5000, 2)))
        failures = []

        def change(seed):
            random = np.random.default_rng(seed)
            try:
                for _ in range(20):
                    ids = np.unique(result.insert(random.random((300, 2)) + seed))
                    self.assertLess(result.simplices.max(), len(result.points) + 10 ** 6)
                    result.remove(ids)
            except Exception as error:
                failures.append(error)

        threads = [threading.Thread(target=change, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])
        self.assertEqual(result.digest(), terrace.Delaunay2(np.random.default_rng(1).random((5000, 2))).digest())


if __name__ == '__main__':
    unittest.main()
