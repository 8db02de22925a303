# SPDX-License-Identifier: Apache-2.0
"""Meshes, interpolation, metrics and shapes of arrays: by their bounds, SciPy, mapped points and solids."""

import unittest

import numpy as np

import terrace

try:
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')


def corner_sets(points, simplices):
    return {tuple(sorted(map(tuple, points[corners]))) for corners in simplices}


class MeshesOfArrays(unittest.TestCase):
    def check_bound(self, mesh, samples, bound):
        """SciPy's interpolation in our triangles is not used: they need not be Delaunay."""
        worst = 0.0
        for a, b, c in mesh.vertices[mesh.triangles]:
            to_ab = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
            u, v = np.linalg.solve(to_ab, (samples[:, :2] - a[:2]).T)
            inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
            height = a[2] + u[inside] * (b[2] - a[2]) + v[inside] * (c[2] - a[2])
            worst = max(worst, float(np.abs(height - samples[inside, 2]).max(initial=0)))
            self.assertGreater(np.linalg.det(to_ab), 0)
        self.assertLessEqual(worst, bound + 1e-9)
        self.assertAlmostEqual(worst, mesh.max_error, delta=1e-6)

    def test_points_within_the_bound(self):
        random = np.random.default_rng(3)
        xy = random.random((2000, 2)) * 100
        samples = np.column_stack((xy, 10 * np.sin(xy[:, 0] / 20) + xy[:, 1] / 9))
        mesh = terrace.bounded_mesh(samples, 0.4)
        self.assertLess(len(mesh.vertices), 300)
        self.assertEqual((mesh.samples, mesh.uncovered), (2000, 0))
        self.check_bound(mesh, samples, 0.4)
        fewer = terrace.bounded_mesh(samples, max_points=30)
        self.assertLessEqual(len(fewer.vertices), 30)
        self.check_bound(fewer, samples, np.inf)

    def test_rasters_within_the_bound(self):
        y, x = np.mgrid[0:50, 0:60]
        heights = 20 * np.sin(x / 9) * np.cos(y / 7)
        transform = (10, 0, 500, 0, -5, 900)
        places = np.stack((500 + 10 * (x + 0.5), 900 - 5 * (y + 0.5)), axis=-1)
        samples = np.column_stack((places.reshape(-1, 2), heights.ravel()))
        for quality in ('greedy', 'removal', 'fitted'):
            mesh = terrace.bounded_mesh(heights, 0.5, quality=quality, transform=transform)
            self.assertEqual((mesh.samples, mesh.uncovered), (3000, 0))
            self.check_bound(mesh, samples, 0.5)
        few = terrace.bounded_mesh(heights, max_points=40, transform=transform)
        self.assertLessEqual(len(few.vertices), 40)
        # The raster class of the module, integers with a marker of missing data, and upside down.
        raster = terrace.Raster(heights.astype(np.float32), transform, None)
        self.check_bound(terrace.bounded_mesh(raster, 0.5), samples, 0.5 + 1e-5)
        marked = np.round(heights).astype(np.int16)
        marked[20:30, 20:30] = -999
        holed = terrace.bounded_mesh(marked, 0.5, transform=(10, 0, 500, 0, 5, 900), nodata=-999)
        self.assertEqual(holed.samples, 2900)
        middle = np.array([500 + 10 * 25.5, 900 + 5 * 25.5])
        for corners in holed.vertices[holed.triangles][:, :, :2]:
            u, v = np.linalg.solve((corners[1:] - corners[0]).T, middle - corners[0])
            self.assertFalse(u > 0 and v > 0 and u + v < 1, 'a triangle lies in the hole')

    def test_misuse(self):
        flat = np.zeros((9, 9))
        for wrong, options in ((flat, {}), (flat, {'max_error': 1, 'max_points': 9}), (flat, {'max_error': -1}),
                               (flat, {'max_error': np.nan}), (flat, {'max_points': 3}),
                               (flat, {'max_error': 1, 'quality': 'best'}),
                               (flat, {'max_error': 1, 'transform': (1, 1, 0, -1, 1, 0)}), ([[0, 0, np.nan]], {'max_error': 1})):
            with self.assertRaises(ValueError):
                terrace.bounded_mesh(wrong, **options)
        with self.assertRaises(TypeError):
            terrace.bounded_mesh('dem.tif', 1)


class Interpolation(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(7)
        self.xy, self.asked = random.random((3000, 2)), random.random((2000, 2)) * 1.2 - 0.1
        self.z = np.sin(5 * self.xy[:, 0]) + self.xy[:, 1] ** 2
        self.samples = np.column_stack((self.xy, self.z))

    def test_as_scipy(self):
        linear = terrace.interpolate(self.samples, self.asked)
        np.testing.assert_allclose(linear, LinearNDInterpolator(self.xy, self.z)(self.asked), rtol=0, atol=1e-9)
        self.assertTrue(np.isnan(linear).any())
        np.testing.assert_array_equal(terrace.interpolate(self.samples, self.asked, 'nearest'),
                                      NearestNDInterpolator(self.xy, self.z)(self.asked))

    def test_natural_neighbours_and_gradients_reproduce_planes(self):
        mesh = terrace.Delaunay2(self.xy)
        plane = mesh.by_vertex(3 + 2 * self.xy[:, 0] - 5 * self.xy[:, 1])
        inside = mesh.find_simplex(self.asked) >= 0
        expected = np.where(inside, 3 + 2 * self.asked[:, 0] - 5 * self.asked[:, 1], np.nan)
        np.testing.assert_allclose(mesh.heights(plane, self.asked, 'natural'), expected, rtol=0, atol=1e-9)
        for method in ('linear', 'natural'):
            slopes = mesh.gradients(plane, self.asked, method)
            np.testing.assert_allclose(slopes[inside], np.broadcast_to([2.0, -5.0], slopes[inside].shape), atol=1e-6)
            self.assertTrue(np.isnan(slopes[~inside]).all())
        wavy = mesh.by_vertex(self.z)
        self.assertLess(np.nanmax(np.abs(mesh.heights(wavy, self.asked, 'natural') - mesh.heights(wavy, self.asked))), 0.1)
        for threads in (1, 2):
            np.testing.assert_array_equal(mesh.heights(wavy, self.asked, threads=threads), mesh.heights(wavy, self.asked))

    def test_smoothing(self):
        mesh = terrace.Delaunay2(self.xy)
        plane = mesh.by_vertex(1 + self.xy @ [2, 3])
        rough = plane + np.random.default_rng(8).normal(scale=0.1, size=len(plane))
        for method in ('laplacian', 'taubin'):
            np.testing.assert_allclose(mesh.smooth(plane, method), plane, rtol=0, atol=1e-9)
            noise, left = (np.abs((heights - plane)[mesh.vertices]).mean() for heights in (rough, mesh.smooth(rough, method)))
            self.assertLess(left, 0.6 * noise)
        step = mesh.by_vertex(np.where(self.xy[:, 0] < 0.5, 0.0, 10.0))
        np.testing.assert_array_equal(mesh.smooth(step, 'bilateral', edge_height=5), step)
        some = mesh.vertices[:500]
        moved = mesh.vertices[(mesh.smooth(rough, vertices=some) != rough)[mesh.vertices]]
        self.assertTrue(set(moved) <= set(some))
        self.assertTrue(0 < len(moved) < len(some))

    def test_quality(self):
        mesh = terrace.Delaunay2(self.xy)
        told = mesh.quality(mesh.by_vertex(np.full(3000, 2.0)), datum=0.5)
        a, b, c = (mesh.points[mesh.simplices[:, i]] for i in range(3))
        area = np.abs(np.cross(b - a, c - a)).sum() / 2
        self.assertEqual(told['triangles'], len(mesh.simplices))
        for name, expected in (('area', area), ('surface_area', area), ('volume_above', 1.5 * area), ('volume_below', 0)):
            self.assertAlmostEqual(told[name], expected, places=9)
        lengths = np.linalg.norm(np.concatenate((b - a, c - b, a - c)), axis=1)
        self.assertAlmostEqual(told['max_edge'], lengths.max(), places=12)
        self.assertAlmostEqual(told['min_edge'], lengths.min(), places=12)

    def test_misuse(self):
        mesh = terrace.Delaunay2(self.xy)
        z = mesh.by_vertex(self.z)
        for wrong in (lambda: mesh.by_vertex(self.z[:-1]), lambda: mesh.heights(z[:-5], self.asked),
                      lambda: mesh.heights(z, [[np.nan, 0]]), lambda: mesh.heights(z, self.asked, 'cubic'),
                      lambda: mesh.gradients(z, self.asked, 'nearest'), lambda: mesh.smooth(z, strength=2.0),
                      lambda: mesh.smooth(z, vertices=[10 ** 6]), lambda: mesh.smooth(np.full(len(z), np.nan)),
                      lambda: mesh.quality(z[:5]), lambda: terrace.interpolate(self.xy, self.asked),
                      lambda: terrace.Delaunay2(self.xy, metric=terrace.ellipse(2, 1)).heights(z, self.asked)):
            with self.assertRaises(ValueError):
                wrong()


class Metrics(unittest.TestCase):
    def test_triangles_are_those_of_mapped_points(self):
        random = np.random.default_rng(11)
        for kind, metric, count in ((terrace.Delaunay2, terrace.ellipse(4, 1, 30), 2000),
                                    (terrace.Delaunay3, terrace.ellipsoid([3, 1, 2]), 600)):
            points = random.random((count, len(metric)))
            made, mapped = kind(points, metric=metric), kind(points @ metric.T)
            expected = np.empty_like(made.points)
            expected[mapped.ids] = points  # handles of the two may differ
            self.assertEqual(corner_sets(made.points, made.simplices), corner_sets(expected, mapped.simplices))
            self.assertNotEqual(made.digest(), kind(points).digest())
            asked = random.random((200, len(metric)))
            closest = np.argmin((((asked[:, None] - points) @ metric.T) ** 2).sum(axis=2), axis=1)
            np.testing.assert_array_equal(made.nearest(asked), made.ids[closest])
            made.remove(made.insert(asked))
            self.assertEqual(made.digest(), kind(points, metric=metric).digest())

    def test_one_region_is_one_metric(self):
        random = np.random.default_rng(12)
        for kind, metric, count in ((terrace.Delaunay2, terrace.ellipse(3, 1, 45), 1000),
                                    (terrace.Delaunay3, terrace.ellipsoid([2, 1, 1]), 300)):
            points = random.random((count, len(metric)))
            made, expected = kind(points), kind(points, metric=metric)
            everywhere = [-np.inf] * len(metric) + [np.inf] * len(metric)
            simplices = made.adapted([(everywhere, metric)])
            if kind is terrace.Delaunay3:
                simplices, stuck = simplices
                self.assertEqual(stuck, 0)
            self.assertEqual(corner_sets(made.points, simplices), corner_sets(expected.points, expected.simplices))

    def test_regions_leave_the_rest(self):
        points = np.random.default_rng(13).random((2000, 2))
        made = terrace.Delaunay2(points)
        before = corner_sets(made.points, made.simplices)
        after = corner_sets(made.points, made.adapted([((0.5, -np.inf, np.inf, np.inf), terrace.ellipse(4, 1))]))
        changed = {corner for triangle in before ^ after for corner in triangle}
        self.assertGreater(len(changed), 100)
        self.assertGreaterEqual(min(x for x, _ in changed), 0.5)

    def test_misuse(self):
        for wrong in (lambda: terrace.ellipse(0, 1), lambda: terrace.ellipse(1, np.inf), lambda: terrace.ellipsoid([1, 1]),
                      lambda: terrace.ellipsoid([1, 1, 1], np.ones((3, 3))),
                      lambda: terrace.Delaunay2(metric=np.zeros((2, 2))), lambda: terrace.Delaunay2(metric=np.eye(3)),
                      lambda: terrace.Delaunay2().adapted([((0, 0, 1), np.eye(2))]),
                      lambda: terrace.Delaunay2().adapted([((1, 1, 0, 0), np.eye(2))]),
                      lambda: terrace.Delaunay2(metric=np.eye(2)).adapted([])):
            with self.assertRaises(ValueError):
                wrong()


class Shapes(unittest.TestCase):
    def test_sphere_and_torus(self):
        random = np.random.default_rng(14)
        ball = random.normal(size=(3000, 3))
        ball /= np.linalg.norm(ball, axis=1)[:, None]
        u, v = random.random((2, 6000)) * 2 * np.pi
        ring = np.column_stack(((2 + 0.7 * np.cos(v)) * np.cos(u), (2 + 0.7 * np.cos(v)) * np.sin(u), 0.7 * np.sin(v)))
        for points, volume, euler in ((ball, 4 / 3 * np.pi, 2), (ring, 2 * np.pi ** 2 * 2 * 0.7 ** 2, 0)):
            made = terrace.Delaunay3(points)
            shape = made.shape()
            self.assertEqual((shape.open, shape.components, shape.euler_characteristic), (False, 1, euler))
            self.assertAlmostEqual(shape.volume / volume, 1, delta=0.05)
            a, b, c, d = (made.points[shape.tetrahedra[:, i]] for i in range(4))
            inside = np.einsum('ij,ij->i', np.cross(b - a, c - a), d - a) / 6
            self.assertGreater(inside.min(), 0)
            self.assertAlmostEqual(inside.sum(), shape.volume, places=9)
            a, b, c = (shape.surface.vertices[shape.surface.triangles[:, i]] for i in range(3))
            enclosed = np.einsum('ij,ij->i', np.cross(a, b), c).sum() / 6  # the divergence theorem
            self.assertAlmostEqual(enclosed, shape.volume, places=9)
        stretched = terrace.Delaunay3(ball * [3, 1, 1], metric=terrace.ellipsoid([3, 1, 1]))
        self.assertAlmostEqual(stretched.shape().volume, 3 * terrace.Delaunay3(ball).shape().volume, delta=0.02)

    def test_open_scans(self):
        points = np.random.default_rng(15).normal(size=(4000, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        bowl = terrace.Delaunay3(points[points[:, 2] < 0.2])
        self.assertTrue(bowl.shape().open)
        self.assertFalse(bowl.shape(lids=True).open)

    def test_few_points(self):
        self.assertEqual(terrace.Delaunay3().shape().tetrahedra.shape, (0, 4))
        with self.assertRaises(ValueError):
            terrace.Delaunay3().shape('best')


if __name__ == '__main__':
    unittest.main()
