# SPDX-License-Identifier: Apache-2.0
"""Meshes are triangulations, match SciPy's and keep verified bounds."""

import os
import unittest

import numpy as np

import terrace
from python_case import StoreCase, hills, sorted_rows

try:
    from scipy.spatial import ConvexHull, Delaunay, cKDTree
except ImportError:
    Delaunay = None


def triangle_set(vertices, triangles):
    return {tuple(sorted(map(tuple, vertices[three, :2]))) for three in triangles}


class Meshes(StoreCase):
    def test_mesh_of_all_points_matches_scipy(self):
        vertices, triangles = mesh = self.scan.mesh(level=0)
        np.testing.assert_array_equal(sorted_rows(vertices), sorted_rows(self.points))
        a, b, c = (vertices[triangles[:, i], :2] for i in range(3))
        turns = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        self.assertTrue((turns > 0).all())
        if Delaunay is not None:
            hull = ConvexHull(self.points[:, :2])
            self.assertEqual(len(triangles), 2 * len(vertices) - 2 - len(hull.vertices))
            origin = self.points[:, :2].min(axis=0)
            same = Delaunay(vertices[:, :2] - origin)
            common = triangle_set(vertices, triangles) & triangle_set(vertices, same.simplices)
            self.assertGreater(len(common), 0.999 * len(triangles))
        self.assertEqual(len(mesh.levels), len(vertices))
        self.assertLess(len(mesh._repr_png_()), 400_000)
        self.assertEqual(len(mesh.__geo_interface__['coordinates']), len(triangles))

    def test_levels_regions_and_focuses(self):
        coarse = self.scan.mesh(max_points=1000)
        self.assertLessEqual(len(coarse.vertices), 1000)
        box = (300300, 5200300, 300500, 5200500)
        focused = self.scan.mesh(level=self.scan.top, focus=[(box, 0)])
        x, y = self.points[:, 0], self.points[:, 1]
        inside = (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
        have = {tuple(p) for p in focused.vertices}
        self.assertTrue(all(tuple(p) in have for p in self.points[inside]))
        part = self.scan.mesh(level=0, region=box)
        self.assertLess(len(part.triangles), 4 * inside.sum())
        with self.assertRaises(ValueError):
            self.scan.mesh(level=0, max_points=10)

    def test_mesh_of_a_cluster(self):
        below = terrace.xyz(self.scan.points(cluster=(1, 0), level=0))
        vertices, triangles = self.scan.mesh(level=0, cluster=(1, 0))
        np.testing.assert_array_equal(sorted_rows(vertices), sorted_rows(below))
        expected = terrace.Delaunay2(below[:, :2])
        self.assertEqual(triangle_set(vertices, triangles), triangle_set(expected.points, expected.simplices))
        self.assertEqual(len(self.scan.mesh(cluster=(1, 0)).vertices), len(self.scan.points(cluster=(1, 0))))
        for wrong in ({'region': (0, 0, 1, 1)}, {'focus': [((0, 0, 1, 1), 0)]}, {'level': 5}):
            with self.assertRaises(ValueError):
                self.scan.mesh(cluster=(1, 0), **wrong)

    def test_smoothed_heights_and_overlays(self):
        for store in (self.scan, self.raster):
            plain = store.mesh(level=0)
            saved = self.path(f'heights-{len(store)}')
            smooth = store.mesh(level=0, smoothing={'method': 'taubin', 'iterations': 4, 'strength': 0.6}, save_overlay=saved)
            np.testing.assert_array_equal(smooth.vertices[:, :2], plain.vertices[:, :2])
            moved = smooth.vertices[:, 2] != plain.vertices[:, 2]
            self.assertTrue(moved.any())
            again = store.mesh(level=0, overlay=saved)
            np.testing.assert_array_equal(again.vertices, smooth.vertices)
            # Compare with Delaunay2.smooth() on the same triangulation.
            flat = plain.vertices[:, :2] if store is self.scan else (plain.vertices[:, :2] - plain.vertices[:, :2].min(axis=0)) / 10
            triangulation = terrace.Delaunay2(flat)
            expected = triangulation.smooth(triangulation.by_vertex(plain.vertices[:, 2]), 'taubin', iterations=4, strength=0.6)
            if store is self.scan:
                np.testing.assert_allclose(smooth.vertices[:, 2], expected[triangulation.ids], rtol=0, atol=1e-6)
            with self.assertRaises((FileExistsError, terrace.Error)):
                store.mesh(level=0, smoothing='laplacian', save_overlay=saved)
            store.mesh(level=0, smoothing='laplacian', save_overlay=saved, replace=True)
            self.assertFalse((store.mesh(level=0, overlay=saved).vertices == smooth.vertices).all())
        for wrong, kind in (({'smoothing': 'best'}, ValueError), ({'smoothing': {'strength': 9}}, ValueError), ({'smoothing': {'much': 9}}, TypeError),
                            ({'overlay': self.path('none')}, (OSError, terrace.Error)), ({'overlay': saved}, terrace.Error)):
            with self.assertRaises(kind):
                self.scan.mesh(level=0, **wrong)

    def test_reads_mesh_files(self):
        mesh = self.scan.mesh(level=1)
        for ending in ('ply', 'obj', 'glb'):
            mesh.save(self.path('read.' + ending))
            back = terrace.Mesh.read(self.path('read.' + ending))
            np.testing.assert_array_equal(back.triangles, mesh.triangles)
            # GLB stores floats relative to the centre of the mesh.
            within = 2.0**-24 * np.ptp(mesh.vertices, axis=0).max() if ending == 'glb' else 0.0
            np.testing.assert_allclose(back.vertices, mesh.vertices, rtol=0, atol=within)
        with self.assertRaises(OSError):
            terrace.Mesh.read(self.path('none.ply'))
        with self.assertRaises(TypeError):
            terrace.Mesh.read(1)  # a file descriptor, not a file name

    def test_errors_stay_within_the_bound(self):
        for store, points in ((self.raster, None), (self.scan, self.points)):
            last = None
            for bound in (0.5, 2.0, 8.0):
                mesh = store.bounded_mesh(bound)
                self.assertLessEqual(mesh.max_error, bound)
                self.assertLessEqual(mesh.rms_error, mesh.max_error)
                self.assertEqual(mesh.samples, len(store))
                if last is not None:
                    self.assertLess(len(mesh.triangles), last)
                last = len(mesh.triangles)
        by_points = self.raster.bounded_mesh(max_points=300)
        self.assertLessEqual(len(by_points.vertices), 300)
        with self.assertRaises(ValueError):
            self.raster.bounded_mesh()
        with self.assertRaises(ValueError):
            self.raster.bounded_mesh(max_error=-1)
        with self.assertRaises(ValueError):
            self.raster.bounded_mesh(1, quality='superb')

    @unittest.skipIf(Delaunay is None, 'SciPy is missing')
    def test_bound_holds_at_every_sample_interpolated_by_scipy(self):
        from scipy.interpolate import LinearNDInterpolator
        mesh = self.raster.bounded_mesh(1.0)
        samples = terrace.xyz(self.raster.points())
        error = np.full(len(samples), np.inf)
        # Compare each triangle with the samples in it.
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        for i in range(len(mesh.triangles)):
            corners = np.vstack((a[i], b[i], c[i]))
            low, high = corners.min(axis=0), corners.max(axis=0)
            near = np.flatnonzero(((samples[:, :2] >= low[:2] - 1e-6) & (samples[:, :2] <= high[:2] + 1e-6)).all(axis=1))
            plane = np.linalg.solve(np.column_stack((corners[:, :2] - low[:2], np.ones(3))), np.eye(3))
            weights = np.column_stack((samples[near, :2] - low[:2], np.ones(len(near)))) @ plane
            covered = (weights >= -1e-9).all(axis=1)
            error[near[covered]] = np.minimum(error[near[covered]], abs(weights[covered] @ corners[:, 2] - samples[near[covered], 2]))
        self.assertLessEqual(error.max(), 1.0 + 1e-6)

    def test_store_without_triangles_has_an_empty_mesh(self):
        line = np.repeat(np.arange(5.0), 3).reshape(-1, 3)
        with terrace.build(line, self.path('line')) as store:
            for options in ({}, {'path': self.path('line.ply')}, {'path': self.path('line.glb')}):
                mesh = store.bounded_mesh(1, **options)
                self.assertEqual((mesh.vertices.shape, mesh.triangles.shape), ((0, 3), (0, 3)))
                self.assertEqual((mesh.samples, mesh.uncovered, mesh.max_error), (5, 5, 0))

    def test_points_with_a_nan_coordinate_are_ignored(self):
        points = np.random.default_rng(3).random((300, 3))
        holed = np.insert(points, [0, 7, 300], [[np.nan, 0, 0], [0, np.nan, 0], [0, 0, np.nan]], axis=0)
        mesh, expected = terrace.bounded_mesh(holed, 0.1), terrace.bounded_mesh(points, 0.1)
        np.testing.assert_array_equal(mesh.vertices, expected.vertices)
        self.assertEqual(mesh.samples, 300)
        with self.assertRaises(ValueError):
            terrace.bounded_mesh(np.where(holed > 0.99, np.inf, holed), 0.1)

    def test_surface_of_a_ball_is_closed(self):
        random = np.random.default_rng(4).normal(size=(5000, 3))
        ball = 100 * random / np.linalg.norm(random, axis=1)[:, None]
        surface = terrace.build(ball, self.path('ball')).surface()
        vertices, triangles = surface
        self.assertEqual((len(vertices), len(triangles)), (5000, 2 * 5000 - 4))  # Euler's formula for a closed surface
        self.assertAlmostEqual(surface.area(), 4 * np.pi * 100 ** 2, delta=300)
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        self.assertAlmostEqual(np.einsum('ij,ij', a, np.cross(b, c)) / 6, 4 / 3 * np.pi * 100 ** 3, delta=2e4)

        places, inside = terrace.Store.open(self.path('ball')).surface(tetrahedra=True)
        a, b, c, d = (places[inside[:, i]] for i in range(4))
        volumes = np.einsum('ij,ij->i', np.cross(b - a, c - a), d - a) / 6
        self.assertGreater(volumes.min(), 0)
        self.assertAlmostEqual(volumes.sum(), 4 / 3 * np.pi * 100 ** 3, delta=2e4)

    def test_surface_of_a_cluster_is_that_of_its_points(self):
        random = np.random.default_rng(9).normal(size=(3000, 3))
        store = terrace.build(100 * random / np.linalg.norm(random, axis=1)[:, None], self.path('parts'), block_points=500)

        def cells(corners, points):
            return {frozenset(map(tuple, points[row])) for row in corners}

        for number in (0, store.info['levels'][1]['clusters'] - 1):
            part = terrace.build(terrace.xyz(store.points(cluster=(1, number), level=0)), self.path('part'), replace=True)
            ours, theirs = store.surface(0, cluster=(1, number)), part.surface()
            self.assertEqual(cells(ours.triangles, ours.vertices), cells(theirs.triangles, theirs.vertices))
            (points, inside), (same, again) = store.surface(0, cluster=(1, number), tetrahedra=True), part.surface(tetrahedra=True)
            np.testing.assert_array_equal(sorted_rows(points), sorted_rows(same))
            self.assertEqual(cells(inside, points), cells(again, same))
            members, _ = store.surface(cluster=(1, number), tetrahedra=True)
            np.testing.assert_array_equal(sorted_rows(members), sorted_rows(terrace.xyz(store.points(cluster=(1, number)))))
        for wrong in ({'cluster': (1, 0), 'region': (0, 0, 1, 1)}, {'cluster': (9, 0)}, {'cluster': (1, 0), 'max_error': 1},
                      {'cluster': (0, 0), 'level': 1}):
            with self.assertRaises(ValueError):
                store.surface(**wrong)

    @unittest.skipIf(Delaunay is None, 'SciPy is missing')
    def test_a_simplified_surface_is_within_its_bound(self):
        random = np.random.default_rng(5).normal(size=(4000, 3))
        ball = 100 * random / np.linalg.norm(random, axis=1)[:, None]
        store = terrace.build(ball, self.path('light'))
        full, light = store.surface(), store.surface(max_error=3)
        self.assertLess(len(light.vertices), 400)
        a, b, c = (light.vertices[light.triangles[:, i]] for i in range(3))
        weights = [(i / 20, j / 20) for i in range(21) for j in range(21 - i)]
        places = np.concatenate([a + u * (b - a) + v * (c - a) for u, v in weights])
        step = max(np.linalg.norm(b - a, axis=1).max(), np.linalg.norm(c - a, axis=1).max()) / 20
        distances, _ = cKDTree(places).query(full.vertices)
        self.assertLessEqual(distances.max(), 3 + step)
        directed = {(int(t[i]), int(t[i - 1])) for t in light.triangles for i in range(3)}
        self.assertEqual(len(directed), 3 * len(light.triangles))
        self.assertTrue(all((q, p) in directed for p, q in directed))  # closed
        self.assertEqual(len(store.surface(max_points=60).vertices), 60)
        for wrong in ({'max_error': -1}, {'max_points': 3}, {'max_error': 1, 'max_points': 9}, {'max_error': float('nan')},
                      {'max_error': 1, 'tetrahedra': True}, {'max_error': 1, 'level': 1}, {'max_points': 0}):
            with self.assertRaises(ValueError):
                store.surface(**wrong)

    def test_a_stored_surface_is_cut(self):
        random = np.random.default_rng(6).normal(size=(4000, 3))
        ball = 100 * random / np.linalg.norm(random, axis=1)[:, None]
        store = terrace.build(ball, self.path('kept'), surface=True, block_points=1000)
        self.assertEqual({key: store.info['surface'][key] for key in ('vertices', 'triangles')},
                         {'vertices': 4000, 'triangles': 7996})
        full, restored = store.surface(), store.surface(stored=False)
        self.assertAlmostEqual(full.measures()['volume'], restored.measures()['volume'], 3)
        self.assertEqual({tuple(v) for v in full.vertices}, {tuple(v) for v in ball})
        self.assertEqual(sorted(map(tuple, full.vertices[full.triangles].min(axis=1))),
                         sorted(map(tuple, restored.vertices[restored.triangles].min(axis=1))))
        vertices = 4000
        for options in ({'max_error': 1}, {'max_points': 300}, {'level': 1}):
            cut = store.surface(**options)
            self.assertTrue(cut.measures()['closed'])
            self.assertLess(len(cut.vertices), vertices)
        self.assertLessEqual(len(store.surface(max_points=100).vertices), 100)
        with self.assertRaises(ValueError):
            terrace.build(ball, self.path('no'), surface=True, entities='triangles')
        self.assertIsNone(terrace.build(ball, self.path('without')).info['surface'])

    def test_a_stored_surface_has_the_triangles_of_a_mesh(self):
        from scipy.spatial import ConvexHull
        points = np.random.default_rng(8).normal(size=(500, 3))
        faces = ConvexHull(points).simplices[:-40]  # open, and oriented at random

        def triangles(mesh):
            vertices, corners = mesh
            corners = np.array([np.roll(t, -np.lexsort(vertices[t].T[::-1])[0]) for t in corners])
            return sorted(map(tuple, vertices[corners].reshape(-1, 9)))

        mesh = terrace.Mesh(points, faces)
        mesh.save(self.path('hull.ply'))
        for number, (source, surface) in enumerate(((mesh, True), (self.path('hull.ply'), True), (mesh, 'input'))):
            store = terrace.build(source, self.path(f'hull{number}'), surface=surface, block_points=100)
            self.assertEqual(triangles(store.surface()), triangles(mesh))
            self.assertEqual(len(store), 500)
        restored = terrace.build(mesh, self.path('restored'), surface='restored')
        self.assertGreater(len(restored.surface().vertices), len(store.surface().vertices))
        for wrong, error in (((points, 'input'), terrace.Error), ((mesh, 'faces'), ValueError),
                             ((terrace.Mesh(points, faces + 500), True), ValueError),
                             ((terrace.Mesh(points[:, :2], faces), True), ValueError)):
            with self.assertRaises(error):
                terrace.build(wrong[0], self.path('wrong'), surface=wrong[1])

    def test_files(self):
        mesh = self.raster.bounded_mesh(4, path=self.path('hills.ply'))
        from terrace import _core
        vertices, triangles, *_ = _core.read_mesh(self.path('hills.ply'))
        np.testing.assert_array_equal(vertices, mesh.vertices)
        np.testing.assert_array_equal(triangles, mesh.triangles)
        for name in ('hills.ply', 'hills.svg'):
            mesh.save(self.path(name), replace=True)
            with self.assertRaises(FileExistsError):
                mesh.save(self.path(name))
        with self.assertRaises(FileNotFoundError):
            mesh.save(self.path('nowhere/hills.ply'))
        mesh.save(self.path('hills.glb'))
        self.assertGreater(os.path.getsize(self.path('hills.glb')), 1000)
        with self.assertRaises(ValueError):
            terrace.Mesh(np.zeros((3, 3)), np.array([[0, 1, 3]])).save(self.path('wrong.ply'))

    def test_glb_converts_degrees_to_metres(self):
        store = terrace.build(hills(), self.path('degrees'), transform=(0.001, 0, 8, 0, -0.001, 46.1), crs='EPSG:4326')
        metres = np.array([77400, 111150])  # per degree at 46 degrees north
        path = self.path('degrees.glb')
        model = terrace.Multiresolution(store)
        model.set_detail(0)
        for result in (store.mesh(level=0), store.mesh(level=0).turned_outward(), store.bounded_mesh(2), store.bounded_mesh(2, crs=4326),
                     model.mesh):
            with self.assertLogs('terrace', 'INFO') as notes:
                result.save(path, replace=True)
            self.assertIn('in metres, as glTF requires', notes.output[0])
            self.check_metres(path, np.ptp(result.vertices[:, :2], axis=0) * metres, np.ptp(result.vertices[:, 2]))
        with self.assertLogs('terrace', 'INFO') as notes:
            store.bounded_mesh(2, path=path, replace=True)
            store.bounded_mesh(2, path=self.path('degrees.ply'))
        self.assertIn('in metres', notes.output[0])
        self.assertIn('x and y are degrees', notes.output[1])
        self.check_metres(path, np.array([149, 119]) * 0.001 * metres, np.ptp(hills()), delta=4)
        # In another CRS the bound holds there; vertices set by the caller are not converted.
        there = store.bounded_mesh(2, crs='EPSG:32632')
        self.assertLessEqual(there.max_error, 2)
        samples = terrace.xyz(store.points(crs='EPSG:32632'))
        measured = there.errors(samples)
        self.assertLessEqual(measured['max_error'], there.max_error + 1e-6)
        self.assertLess(measured['uncovered'], 2 * (120 + 150))
        mesh = store.mesh(level=0)
        mesh.vertices = mesh.vertices * [1000, 1000, 1]
        mesh.save(path, replace=True)
        self.check_metres(path, np.ptp(mesh.vertices[:, :2], axis=0), np.ptp(mesh.vertices[:, 2]))

    def check_metres(self, path, wide, high, delta=1e-2):
        vertices = terrace.Mesh.read(path).vertices
        np.testing.assert_allclose(np.ptp(vertices[:, :2], axis=0), wide, rtol=2e-3)
        self.assertAlmostEqual(np.ptp(vertices[:, 2]), high, delta=delta)


if __name__ == '__main__':
    unittest.main()
