# SPDX-License-Identifier: Apache-2.0
"""Meshes, interpolation, metrics and shapes of arrays, compared with bounds, SciPy, mapped points and solids."""

import unittest

import numpy as np

import terrace

try:
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.sparse import csr_matrix
    from scipy.spatial import ConvexHull
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')


def corner_sets(points, simplices):
    return {tuple(sorted(map(tuple, points[corners]))) for corners in simplices}


class MeshesOfArrays(unittest.TestCase):
    def check_bound(self, mesh, samples, bound):
        """Checks the bound without SciPy, whose interpolation needs Delaunay triangles."""
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

    def test_meshes_of_points_keep_the_bound(self):
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

    def test_meshes_of_rasters_keep_the_bound(self):
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
        # The module's Raster, integers with a nodata value, and a raster with rows to the north.
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

    def test_given_frame_replaces_the_hull(self):
        samples = np.column_stack((np.random.default_rng(4).random((500, 2)), np.zeros(500)))
        frame = [[0.2, 0.2, 1], [0.8, 0.2, 1], [0.8, 0.8, 1], [0.2, 0.8, 1]]
        mesh = terrace.bounded_mesh(samples, 0.5, frame=frame)
        np.testing.assert_array_equal(mesh.vertices[:4], frame)
        self.assertEqual(mesh.uncovered, 500 - ((samples[:, :2] >= 0.2) & (samples[:, :2] <= 0.8)).all(axis=1).sum())
        self.assertLessEqual(mesh.max_error, 0.5)
        self.assertLessEqual(len(terrace.bounded_mesh(self.wavy(), 0.05, min_angle=0).triangles), len(terrace.bounded_mesh(self.wavy(), 0.05, min_angle=30).triangles))
        for wrong in (lambda: terrace.bounded_mesh(samples, 1, frame=frame[::-1]), lambda: terrace.bounded_mesh(samples, 1, min_angle=90),
                      lambda: terrace.bounded_mesh(np.zeros((9, 9)), 1, frame=frame)):
            with self.assertRaises(ValueError):
                wrong()

    @staticmethod
    def wavy():
        xy = np.random.default_rng(5).random((3000, 2))
        return np.column_stack((xy, np.sin(9 * xy[:, 0]) * np.cos(7 * xy[:, 1])))

    def test_errors_of_any_mesh(self):
        samples = self.wavy()
        mesh = terrace.bounded_mesh(samples, 0.1)
        report = mesh.errors(samples)
        self.assertEqual((report['samples'], report['uncovered']), (3000, 0))
        self.assertAlmostEqual(report['max_error'], mesh.max_error, places=12)
        self.check_bound(mesh, samples, report['max_error'])
        above = samples + [0, 0, 10]
        self.assertAlmostEqual(mesh.errors(np.vstack((above, [[9, 9, 0]])))['rms_error'], 10, delta=0.1)
        self.assertEqual(mesh.errors([])['worst'], -1)
        with self.assertRaises(ValueError):
            terrace.Mesh(np.zeros((3, 3)), np.array([[0, 1, 3]])).errors(samples)

    def test_simplified_lines_keep_the_bound(self):
        random = np.random.default_rng(6)
        for count, bound in ((1, 0.1), (2, 0.1), (300, 0.3), (300, 0.0)):
            t, heights = np.sort(random.random(count)), np.cumsum(random.normal(size=count)) / 5
            kept, error = terrace.simplify_line(t, heights, bound)
            self.assertEqual((kept[0], kept[-1]), (0, count - 1))
            self.assertTrue((np.diff(kept) > 0).all())
            errors = np.abs(np.interp(t, t[kept], heights[kept]) - heights)
            self.assertAlmostEqual(errors.max(), error, places=12)
            self.assertLessEqual(error, bound)
            # Reproduce the greedy algorithm: add the sample with the largest error until the bound holds.
            chain = [0, count - 1]
            while True:
                errors = np.abs(np.interp(t, t[chain], heights[chain]) - heights)
                if errors.max() <= bound:
                    break
                chain = sorted({*chain, int(errors.argmax())})
            if bound > 0:
                self.assertEqual(kept.tolist(), sorted(set(chain)))
        self.assertEqual(terrace.simplify_line([], [], 1)[0].tolist(), [])
        for wrong in (([1, 0], [0, 0], 1), ([0, 1], [0], 1), ([0, np.nan], [0, 0], 1), ([0, 1], [0, 0], -1), ([[0, 1]], [0, 0], 1)):
            with self.assertRaises(ValueError):
                terrace.simplify_line(*wrong)

    def test_rejects_invalid_arguments(self):
        flat = np.zeros((9, 9))
        for wrong, options in ((flat, {}), (flat, {'max_error': 1, 'max_points': 9}), (flat, {'max_error': -1}),
                               (flat, {'max_error': np.nan}), (flat, {'max_points': 3}),
                               (flat, {'max_error': 1, 'quality': 'best'}),
                               (flat, {'max_error': 1, 'transform': (1, 1, 0, -1, 1, 0)}), ([[0, 0, np.inf]], {'max_error': 1})):
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

    def test_matches_scipy(self):
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

    def test_heights_are_weighted_sums_of_values(self):
        mesh = terrace.Delaunay2(self.xy)
        wavy = mesh.by_vertex(self.z)
        for method in ('linear', 'natural', 'nearest'):
            shares, vertices, begins = mesh.weights(self.asked, method)
            matrix = csr_matrix((shares, vertices, begins), shape=(len(self.asked), len(mesh.points)))
            some = np.diff(begins) > 0
            heights = mesh.heights(wavy, self.asked, method)
            np.testing.assert_array_equal(some, ~np.isnan(heights))
            np.testing.assert_allclose((matrix @ np.nan_to_num(wavy))[some], heights[some], rtol=0, atol=1e-12)
            self.assertGreaterEqual(shares.min(), 0)
            np.testing.assert_allclose(np.asarray(matrix.sum(axis=1)).ravel()[some], 1, rtol=1e-12)
            if method != 'nearest':
                np.testing.assert_allclose((matrix @ np.nan_to_num(mesh.points))[some], self.asked[some], rtol=0, atol=1e-12)
        self.assertEqual(terrace.Delaunay2().weights([[0, 0]])[2].tolist(), [0, 0])
        for wrong in (lambda: mesh.weights([[np.nan, 0]]), lambda: mesh.weights(self.asked, 'cubic'), lambda: mesh.weights([[1, 2, 3]])):
            with self.assertRaises(ValueError):
                wrong()

    def test_vertical_distances(self):
        mesh = terrace.Delaunay2(self.xy)
        wavy = mesh.by_vertex(self.z)
        samples = np.column_stack((self.asked, np.random.default_rng(9).random(len(self.asked))))
        for method in ('linear', 'natural', 'nearest'):
            apart = samples[:, 2] - mesh.heights(wavy, self.asked, method)
            measured = ~np.isnan(apart)
            report = mesh.vertical_distances(wavy, samples, method)
            self.assertEqual((report['count'], report['outside']), (measured.sum(), (~measured).sum()))
            for name, expected in (('max', np.nanmax(np.abs(apart))), ('mean', np.nanmean(np.abs(apart))), ('bias', np.nanmean(apart)),
                                   ('rms', np.sqrt(np.nanmean(apart ** 2)))):
                self.assertAlmostEqual(report[name], expected, places=12)
            self.assertEqual(report['worst'], np.nanargmax(np.abs(apart)))
        self.assertEqual(mesh.vertical_distances(wavy, [])['worst'], -1)
        for wrong in (lambda: mesh.vertical_distances(wavy[:9], samples), lambda: mesh.vertical_distances(wavy, self.asked)):
            with self.assertRaises(ValueError):
                wrong()

    def test_quality_of_each_triangle(self):
        mesh = terrace.Delaunay2(self.xy)
        wavy = mesh.by_vertex(self.z)
        each, all_ = mesh.triangle_quality(wavy, 0.3), mesh.quality(wavy, 0.3, bins=7)
        self.assertEqual(len(each), len(mesh.simplices))
        for name in ('area', 'surface_area', 'volume_above', 'volume_below'):
            self.assertAlmostEqual(each[name].sum(), all_[name], places=9)
        self.assertEqual((each['min_angle'].min(), each['aspect'].max()), (all_['min_angle'], all_['max_aspect']))
        a, b, c = (mesh.points[mesh.simplices[:, i]] for i in range(3))
        np.testing.assert_allclose(each['area'], np.cross(b - a, c - a) / 2, rtol=1e-9)
        sides = np.unique(np.sort(mesh.simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0)
        lengths = np.linalg.norm(mesh.points[sides[:, 0]] - mesh.points[sides[:, 1]], axis=1)
        np.testing.assert_array_equal(all_['edge_histogram'], np.histogram(lengths, 7)[0])
        for wrong in (lambda: mesh.triangle_quality(wavy[:9]), lambda: mesh.quality(wavy, bins=0)):
            with self.assertRaises(ValueError):
                wrong()

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
        some = mesh.vertices[np.hypot(*(self.xy[mesh.vertices] - 0.5).T) < 0.25]
        moved = mesh.vertices[(mesh.smooth(rough, vertices=some) != rough)[mesh.vertices]]
        self.assertTrue(set(moved) <= set(some))
        self.assertTrue(0 < len(moved) < len(some))

    def test_quality(self):
        mesh = terrace.Delaunay2(self.xy)
        report = mesh.quality(mesh.by_vertex(np.full(3000, 2.0)), datum=0.5)
        a, b, c = (mesh.points[mesh.simplices[:, i]] for i in range(3))
        area = np.abs(np.cross(b - a, c - a)).sum() / 2
        self.assertEqual(report['triangles'], len(mesh.simplices))
        for name, expected in (('area', area), ('surface_area', area), ('volume_above', 1.5 * area), ('volume_below', 0)):
            self.assertAlmostEqual(report[name], expected, places=9)
        lengths = np.linalg.norm(np.concatenate((b - a, c - b, a - c)), axis=1)
        self.assertAlmostEqual(report['max_edge'], lengths.max(), places=12)
        self.assertAlmostEqual(report['min_edge'], lengths.min(), places=12)

    def test_rejects_invalid_arguments(self):
        mesh = terrace.Delaunay2(self.xy)
        z = mesh.by_vertex(self.z)
        short, samples = z[:-5], np.zeros((1, 3))
        for wrong in (lambda: mesh.heights(short, self.asked), lambda: mesh.gradients(short, self.asked), lambda: mesh.smooth(short),
                      lambda: mesh.quality(short), lambda: mesh.triangle_quality(short), lambda: mesh.vertical_distances(short, samples)):
            with self.assertRaisesRegex(ValueError, '`values`.*by_vertex'):
                wrong()
        for wrong in (lambda: mesh.by_vertex(self.z[:-1]), lambda: mesh.heights(z[:-5], self.asked),
                      lambda: mesh.heights(z, [[np.nan, 0]]), lambda: mesh.heights(z, self.asked, 'cubic'),
                      lambda: mesh.gradients(z, self.asked, 'nearest'), lambda: mesh.smooth(z, strength=2.0),
                      lambda: mesh.smooth(z, vertices=[10 ** 6]), lambda: mesh.smooth(np.full(len(z), np.nan)),
                      lambda: mesh.quality(z[:5]), lambda: terrace.interpolate(self.xy, self.asked),
                      lambda: terrace.Delaunay2(self.xy, metric=terrace.ellipse(2, 1)).heights(z, self.asked)):
            with self.assertRaises(ValueError):
                wrong()


class Metrics(unittest.TestCase):
    def test_triangles_match_those_of_mapped_points(self):
        random = np.random.default_rng(11)
        for kind, metric, count in ((terrace.Delaunay2, terrace.ellipse(4, 1, 30), 2000),
                                    (terrace.Delaunay3, terrace.ellipsoid([3, 1, 2]), 600)):
            points = random.random((count, len(metric)))
            result, mapped = kind(points, metric=metric), kind(points @ metric.T)
            self.assertEqual(corner_sets(result.points, result.simplices), corner_sets(points, mapped.simplices))
            self.assertNotEqual(result.digest(), kind(points).digest())
            queries = random.random((200, len(metric)))
            closest = np.argmin((((queries[:, None] - points) @ metric.T) ** 2).sum(axis=2), axis=1)
            np.testing.assert_array_equal(result.nearest(queries), result.ids[closest])
            result.remove(result.insert(queries))
            self.assertEqual(result.digest(), kind(points, metric=metric).digest())

    def test_one_region_matches_one_metric(self):
        random = np.random.default_rng(12)
        for kind, metric, count in ((terrace.Delaunay2, terrace.ellipse(3, 1, 45), 1000),
                                    (terrace.Delaunay3, terrace.ellipsoid([2, 1, 1]), 300)):
            points = random.random((count, len(metric)))
            result, expected = kind(points), kind(points, metric=metric)
            everywhere = [-np.inf] * len(metric) + [np.inf] * len(metric)
            simplices = result.adapted([(everywhere, metric)])
            if kind is terrace.Delaunay3:
                simplices, stuck = simplices
                self.assertEqual(stuck, 0)
            self.assertEqual(corner_sets(result.points, simplices), corner_sets(expected.points, expected.simplices))

    def test_triangles_outside_regions_do_not_change(self):
        points = np.random.default_rng(13).random((2000, 2))
        result = terrace.Delaunay2(points)
        before = corner_sets(result.points, result.simplices)
        after = corner_sets(result.points, result.adapted([((0.5, -np.inf, np.inf, np.inf), terrace.ellipse(4, 1))]))
        changed = {corner for triangle in before ^ after for corner in triangle}
        self.assertGreater(len(changed), 100)
        self.assertGreaterEqual(min(x for x, _ in changed), 0.5)

    def test_rejects_invalid_arguments(self):
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
            result = terrace.Delaunay3(points)
            shape = result.shape()
            self.assertEqual((shape.open, shape.components, shape.euler_characteristic), (False, 1, euler))
            self.assertAlmostEqual(shape.volume / volume, 1, delta=0.05)
            a, b, c, d = (result.points[shape.tetrahedra[:, i]] for i in range(4))
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

    def test_criteria(self):
        result = terrace.Delaunay3(np.random.default_rng(16).random((300, 3)))
        wide, narrow = (len(result.shape('flood', criterion='edge-length', edge_factor=factor, keep_vertices=False).tetrahedra) for factor in (1.5, 0.4))
        self.assertGreater(wide, narrow)
        self.assertGreaterEqual(len(result.shape('flood', criterion='edge-length', edge_factor=0.4).tetrahedra), narrow)
        for wrong in ({'criterion': 'best'}, {'edge_factor': 0}, {'edge_factor': np.nan}):
            with self.assertRaises(ValueError):
                result.shape('flood', **wrong)

    def test_surface_follows_changes(self):
        random = np.random.default_rng(17)
        ball = random.normal(size=(2000, 3))
        ball /= np.linalg.norm(ball, axis=1)[:, None]
        result = terrace.DynamicSurface(ball)
        fixed = terrace.Delaunay3(ball).shape(lids=True).surface
        self.assertEqual(corner_sets(result.points, result.simplices), corner_sets(fixed.vertices, fixed.triangles))
        more = random.normal(size=(200, 3))
        more /= np.linalg.norm(more, axis=1)[:, None]
        result.remove(result.ids[:150])
        result.insert(more)
        report = result.mesh().measures()
        self.assertEqual((report['components'], report['euler_characteristic'], report['closed']), (1, 2, True))
        self.assertAlmostEqual(report['volume'], 4 / 3 * np.pi, delta=0.1)
        result.restore()
        self.assertEqual(result.digest(), terrace.DynamicSurface(np.vstack((ball[150:], more))).digest())
        self.assertIn('triangles', repr(result))
        self.assertLess(len(result._repr_png_()), 400_000)
        result.remove(result.vertices)
        self.assertEqual((len(result), result.simplices.shape, result.mesh().triangles.shape), (0, (0, 3), (0, 3)))
        for wrong in (lambda: result.insert([[np.nan, 0, 0]]), lambda: result.remove([3]), lambda: terrace.DynamicSurface([[1, 2]])):
            with self.assertRaises(ValueError):
                wrong()

    def test_measures_and_orientation(self):
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], float)
        hull = ConvexHull(corners)
        cube = terrace.Mesh(corners, hull.simplices).turned_outward()
        self.assertEqual({frozenset(row) for row in cube.triangles.tolist()}, {frozenset(row) for row in hull.simplices.tolist()})

        def signed(mesh):
            a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
            return np.einsum('ij,ij->i', np.cross(a, b), c).sum() / 6

        outward = terrace.Delaunay3(corners + np.random.default_rng(2).normal(scale=1e-3, size=(8, 3))).shape('flood').surface
        inside_out = terrace.Mesh(outward.vertices, outward.triangles[:, ::-1])
        report = inside_out.measures()
        self.assertAlmostEqual(report['volume'], signed(inside_out), places=12)
        self.assertLess(report['volume'], -5.9)
        turned = inside_out.turned_outward()
        self.assertAlmostEqual(turned.measures()['volume'], -report['volume'], places=12)
        self.assertAlmostEqual(turned.area(), report['area'], places=9)
        self.assertEqual((report['faces'], report['vertices'], report['edges'], report['euler_characteristic'], report['border_edges'], report['components']),
                         (12, 8, 18, 2, 0, 1))
        opened = terrace.Mesh(outward.vertices, outward.triangles[1:]).measures()
        self.assertEqual((opened['border_edges'], opened['closed']), (3, False))
        for wrong in (np.array([[0, 1, 8]]), np.array([[0, 0, 1]]), np.array([[-1, 0, 1]])):
            with self.assertRaises(ValueError):
                terrace.Mesh(corners, wrong).measures()

    def test_few_points(self):
        self.assertEqual(terrace.Delaunay3().shape().tetrahedra.shape, (0, 4))
        with self.assertRaises(ValueError):
            terrace.Delaunay3().shape('best')


if __name__ == '__main__':
    unittest.main()
