# SPDX-License-Identifier: Apache-2.0
"""Tiles on disk, and views that follow a camera."""

import gzip
import json
import os
import struct
import subprocess
import threading
import unittest

import numpy as np

import terrace
from python_case import COMMAND, TRANSFORM, StoreCase, sorted_rows


class Tiles(StoreCase):
    def test_writes_a_set_of_tiles(self):
        folder = self.path('tiles')
        report = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal')
        with open(os.path.join(folder, 'layer.json'), encoding='utf-8') as file:
            self.assertEqual(json.load(file)['format'], 'quantized-mesh-1.0')
        tiles = [os.path.join(root, name) for root, _, names in os.walk(folder) for name in names
                 if name.endswith('.terrain')]
        self.assertEqual(len(tiles), report['tiles'])
        self.assertEqual([zoom['zoom'] for zoom in report['zooms']], list(range(13)))
        with open(tiles[0], 'rb') as file:
            head = struct.unpack('<3d2f', file.read(32))
        self.assertTrue(all(abs(c) < 7e6 for c in head[:3]))
        again = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal', resume=True)
        self.assertEqual((again['made'], again['kept']), (0, report['tiles']))
        if COMMAND:
            subprocess.run([COMMAND, 'verify', folder, '--store', self.path('hills'), '--vertical', 'ellipsoidal', '-q'], check=True)
            other = self.path('tiles-of-command')
            subprocess.run([COMMAND, 'tile', self.path('hills'), '-o', other, '--zoom', '0-12', '--vertical',
                            'ellipsoidal', '-q'], check=True)
            for tile in tiles:
                with open(tile, 'rb') as ours, open(os.path.join(other, os.path.relpath(tile, folder)), 'rb') as theirs:
                    self.assertEqual(ours.read(), theirs.read())

    def test_verifies_a_set_of_tiles(self):
        folder = self.path('checked')
        report = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal', max_error=2)
        sound = terrace.verify_tiles(folder, self.raster, vertical='ellipsoidal')
        self.assertEqual((sound['faults'], sound['tiles'], sound['torn']), ([], report['tiles'], 0))
        deepest = sound['zooms'][-1]
        self.assertEqual(deepest['zoom'], 12)
        self.assertTrue(0 < deepest['max_error'] <= 2)
        self.assertGreaterEqual(sound['samples'], self.samples.size)
        self.assertEqual(terrace.verify_tiles(folder)['samples'], 0)
        strict = terrace.verify_tiles(folder, self.raster, vertical='ellipsoidal', max_error=deepest['max_error'] / 2)
        self.assertTrue(strict['faults'])
        tile = next(os.path.join(root, name) for root, _, names in os.walk(folder) for name in names
                    if name.endswith('.terrain'))
        with open(tile, 'r+b') as file:
            file.truncate(60)
        faults = terrace.verify_tiles(folder)['faults']
        self.assertTrue(any(os.path.relpath(tile, folder) in fault for fault in faults), faults)
        with self.assertRaises(ValueError):
            terrace.verify_tiles(self.path('nothing'))
        with self.assertRaises(TypeError):
            terrace.verify_tiles(folder, 'hills')
        with self.assertRaises(ValueError):
            terrace.verify_tiles(folder, vertical='sideways')

    def test_options(self):
        folder = self.path('zipped')
        self.raster.tiles(folder, zooms=(8, 9), vertical='ignore', gzip=True, normals=True, name='hills', fill='flat')
        tile = next(os.path.join(root, name) for root, _, names in os.walk(folder) for name in names
                    if name.endswith('.terrain'))
        with gzip.open(tile) as file:
            self.assertEqual(len(file.read(88)), 88)
        with self.assertRaises(terrace.Error):
            self.raster.tiles(folder, zooms=(8, 9), vertical='ignore')
        with self.assertRaises(ValueError):
            self.raster.tiles(self.path('none'), vertical='sideways')
        with self.assertRaises(TypeError):
            self.raster.tiles(self.path('none'), zoom=3)
        with self.assertRaises((ValueError, terrace.Error)):  # the vertical reference is unknown
            self.raster.tiles(self.path('none'), zooms=(0, 3))


class Views(StoreCase):
    def fly(self, view, frames=3000):
        """Applies deltas like a renderer until the view has settled."""
        vertices, triangles = {}, {}
        for number in range(frames):
            delta = view.frame((0.0, -3000.0, 1500.0), (0.0, 1.0, -0.4), seconds=0.02, pixel_error=1.0)
            for vertex in delta.removed_vertices:
                del vertices[vertex]
            for triangle in delta.removed_triangles:
                del triangles[triangle]
            for vertex, position in zip(delta.added_vertices, delta.added_positions):
                self.assertNotIn(vertex, vertices)
                vertices[vertex] = position
            for vertex, position in zip(delta.moved_vertices, delta.moved_positions):
                vertices[vertex] = position
            for triangle, corners in zip(delta.added_triangles, delta.added_corners):
                self.assertNotIn(triangle, triangles)
                triangles[triangle] = tuple(corners)
            if delta.settled:
                return vertices, triangles, number
        self.fail('the view does not settle')

    def test_deltas_add_up(self):
        for store in (self.raster, self.scan):
            for reader in ('thread', 'frame'):
                view = terrace.View(store, reader=reader)
                vertices, triangles, _ = self.fly(view)
                now = view.snapshot()
                self.assertEqual(set(now.added_vertices), set(vertices))
                self.assertEqual(dict(zip(now.added_triangles, map(tuple, now.added_corners))), triangles)
                for vertex, position in zip(now.added_vertices, now.added_positions):
                    np.testing.assert_array_equal(vertices[vertex], position)
                self.assertTrue(set(np.ravel(list(triangles.values()))) <= set(vertices))
                self.assertGreater(view.traffic['points'], 0)

    def test_view_of_points(self):
        vertices, triangles, _ = self.fly(terrace.View(self.scan, 'points'))
        self.assertEqual(triangles, {})
        self.assertGreater(len(vertices), 100)

    def test_zero_error_shows_everything(self):
        view = terrace.View(self.scan, reader='frame')
        delta = view.frame(ground_error=0.0, seconds=10)
        while not delta.settled:
            delta = view.frame(ground_error=0.0, seconds=10)
        self.assertEqual(delta.points, len(self.scan))
        # Metres from the centre: the size of the cloud, apart from the scale of the map.
        now = view.snapshot().added_positions
        np.testing.assert_allclose(np.ptp(now, axis=0), np.ptp(self.points, axis=0), rtol=1e-3)

    def test_raster_keeps_its_error_at_every_sample(self):
        rows, columns = self.samples.shape
        x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        a, b, c, d, e, f = TRANSFORM
        places = np.column_stack([(a * x + b * y + c).ravel(), (d * x + e * y + f).ravel(), self.samples.ravel()])
        before = self.samples.size
        for error in (1.0, 5.0, 25.0):
            view = terrace.View(self.raster, reader='frame')
            now = self.settled(view, ground_error=error)
            self.assertLess(len(now.added_vertices), before)
            before = len(now.added_vertices)
            ground = view.to_metres(places)
            number = np.searchsorted(now.added_vertices, now.added_corners)
            worst, found = 0.0, np.zeros(len(ground), bool)
            for a, b, c in now.added_positions[number]:
                low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
                near = np.flatnonzero(((ground[:, :2] >= low[:2] - 1e-6) & (ground[:, :2] <= high[:2] + 1e-6)).all(axis=1))
                weights = np.linalg.solve(np.array([[a[0], b[0], c[0]], [a[1], b[1], c[1]], [1, 1, 1]]),
                                          np.vstack([ground[near, :2].T, np.ones(len(near))]))
                inside = (weights >= -1e-9).all(axis=0)
                found[near[inside]] = True
                heights = np.array([a[2], b[2], c[2]]) @ weights[:, inside]
                worst = max(worst, np.abs(heights - ground[near[inside], 2]).max(initial=0.0))
            self.assertLessEqual(worst, error + 1e-6)
            self.assertGreater(worst, error / 4)
            self.assertTrue(found.all())

    def test_matrix_cameras(self):
        # Orthographic from above, 4 km wide and high.
        matrix = np.diag([1 / 2000, 1 / 2000, -1 / 5000, 1.0])
        view = terrace.View(self.scan, reader='frame')
        first = delta = view.frame(matrix=matrix, size=(1000, 1000), pixel_error=0.1, seconds=5)
        while not delta.settled:
            delta = view.frame(matrix=matrix, size=(1000, 1000), pixel_error=0.1, seconds=5)
        self.assertGreater(delta.points, first.points)

    def settled(self, view, **wish):
        delta = view.frame(seconds=10, **wish)
        while not delta.settled:
            delta = view.frame(seconds=10, **wish)
        return view.snapshot()

    def test_focuses_regions_and_pins(self):
        box = np.array([300300, 5200300, 300500, 5200500])
        corners = terrace.View(self.scan).to_metres([[*box[:2], 0], [*box[2:], 0]])[:, :2]
        x, y = self.points[:, 0], self.points[:, 1]
        inside = (x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])
        for wish in ({'focus': [(corners.ravel(), 0)]}, {'regions': [(corners.ravel(), 0.0)]}):
            view = terrace.View(self.scan, reader='frame')
            now = self.settled(view, **wish).added_positions
            self.assertLess(len(now), len(self.scan))
            shown = {tuple(place) for place in np.round(now, 3)}
            wanted = np.round(view.to_metres(self.points[inside]), 3)
            self.assertTrue(all(tuple(place) in shown for place in wanted))
        view = terrace.View(self.scan, reader='frame')
        few = len(self.settled(view, ground_error=np.inf).added_vertices)
        view.pin((self.scan.top - 1, 0), True)
        more = len(self.settled(view, ground_error=np.inf).added_vertices)
        self.assertGreater(more, few)
        view.pin((self.scan.top - 1, 0), None)
        self.assertEqual(len(self.settled(view, ground_error=np.inf).added_vertices), few)
        view.pin((self.scan.top - 1, 0), False)
        self.assertLess(len(self.settled(view, ground_error=0.0).added_vertices), len(self.scan))
        flat = terrace.View(self.scan, reader='frame')
        near = self.settled(flat, position=(0, 0, 900), direction=(0, 0, -1), up=(0, 1, 0), ground_height=100, size=(500, 500))
        self.assertGreater(len(near.added_vertices), few)

    def test_attributes_and_places(self):
        view = terrace.View(self.scan, 'points', reader='frame')
        delta = view.frame((0, -900, 500), seconds=5)
        report = view.attributes(delta.added_vertices)
        places = view.to_metres(self.points)
        classes = {tuple(place): number for place, number in zip(np.round(places, 6), self.classes)}
        self.assertEqual([classes[tuple(place)] for place in np.round(delta.added_positions, 6)], report['class'].tolist())
        # Metres from the centre, with the height upwards.
        np.testing.assert_allclose(places[:, 2], self.points[:, 2], rtol=0, atol=1e-9)
        np.testing.assert_allclose(np.ptp(places, axis=0), np.ptp(self.points, axis=0), rtol=1e-3)
        for wrong in ([10 ** 6], [-1], [2 ** 40]):
            with self.assertRaises(ValueError):
                view.attributes(wrong)
        with self.assertRaises(ValueError):
            terrace.View(self.raster).attributes([0])

    def test_view_of_a_scan_surface(self):
        random = np.random.default_rng(4)
        ball = random.normal(size=(3000, 3))
        ball *= 100 / np.linalg.norm(ball, axis=1)[:, None]
        store = terrace.build(ball, self.path('ball'), block_points=500)
        view = terrace.View(store, 'surface', reader='frame')
        vertices, triangles = {}, {}

        def take(delta):
            for triangle in delta.removed_triangles:
                del triangles[triangle]
            for vertex in delta.removed_vertices:
                del vertices[vertex]
            vertices.update(zip(delta.added_vertices.tolist(), delta.added_positions))
            triangles.update(zip(delta.added_triangles.tolist(), delta.added_corners.tolist()))

        delta = view.frame(ground_error=0.0, seconds=1)
        take(delta)
        while not delta.settled:
            delta = view.frame(ground_error=0.0, seconds=1)
            take(delta)
        take(view.restore())
        number = {vertex: at for at, vertex in enumerate(vertices)}
        mesh = terrace.Mesh(np.array([*vertices.values()]), np.array([[number[corner] for corner in row] for row in triangles.values()]))
        report = mesh.measures()
        self.assertEqual((report['euler_characteristic'], report['closed']), (2, True))
        self.assertAlmostEqual(report['volume'] / (4 / 3 * np.pi * 1e6), 1, delta=0.02)

    def test_rejects_invalid_arguments(self):
        view = terrace.View(self.scan)
        for wrong in ((self.scan.top + 1, 0), (0, 10 ** 9)):
            with self.assertRaises(ValueError):
                view.pin(wrong, True)
        for wrong in ({'focus': [((1, 1, 0, 0), 0)]}, {'regions': [((0, 0, 1, 1), np.nan)]}, {'position': (0, 0, 1), 'ground_height': 0}):
            with self.subTest(repr(wrong)):
                with self.assertRaises(ValueError):
                    view.frame(**wrong)
        for wrong in ({'position': (0, 0)}, {'position': (0, 0, np.nan)}, {'position': (0, 0, 1), 'direction': (0, 0, 0)},
                      {'position': (0, 0, 1), 'up': (0, 1, -0.5)}, {'position': (0, 0, 1), 'fov': 0},
                      {'position': (0, 0, 1), 'size': (0, 0)}, {'matrix': np.eye(3)}, {'matrix': np.zeros((4, 4))},
                      {'position': (0, 0, 1), 'pixel_error': -1}):
            with self.subTest(repr(wrong)):
                with self.assertRaises(ValueError):
                    view.frame(**wrong)
        for wrong in ({'kind': 'lines'}, {'reader': 'process'}, {'max_points': -1}):
            with self.assertRaises(ValueError):
                terrace.View(self.scan, **wrong)

    def test_view_of_a_stored_surface(self):
        random = np.random.default_rng(4).normal(size=(1500, 3))
        ball = 100 * random / np.linalg.norm(random, axis=1)[:, None]
        store = terrace.build(ball, self.path('stored'), surface=True, block_points=500)
        view = terrace.View(store, 'surface', collapse_below=1)
        vertices, triangles = {}, {}

        def settle(**wish):
            settled = False
            while not settled:
                delta = view.frame(seconds=1, **wish)
                for triangle in delta.removed_triangles:
                    del triangles[triangle]
                for vertex in delta.removed_vertices:
                    del vertices[vertex]
                vertices.update(zip(delta.added_vertices.tolist(), delta.added_positions))
                triangles.update(zip(delta.added_triangles.tolist(), delta.added_corners.tolist()))
                settled = delta.settled
            self.assertEqual(delta.points, len(vertices))

        for error in (1.0, 0.0, 5.0):
            settle(ground_error=error)
            cut = store.surface(max_error=error)
            self.assertEqual(len(vertices), len(cut.vertices))
            self.assertEqual(len(triangles), len(cut.triangles))
            ours = np.array([[vertices[corner] for corner in corners] for corners in triangles.values()])
            theirs = view.to_metres(cut.vertices)[cut.triangles]
            np.testing.assert_allclose(sorted_rows(ours.mean(axis=1)), sorted_rows(theirs.mean(axis=1)), atol=1e-9)
        view.pin((0, 0), True)
        before = len(vertices)
        settle(ground_error=5.0)
        self.assertGreater(len(vertices), before)
        self.assertEqual(len(view.restore().added_triangles), 0)
        self.assertEqual(view.traffic['points'], len(ball))
        tetrahedra = terrace.View(store, 'surface', stored=False)
        self.assertLess(tetrahedra.frame(ground_error=5.0, seconds=1).points, len(ball))

    def test_rejects_use_after_a_fork(self):
        view = terrace.View(self.scan)
        view.frame((0, -3000, 1500))
        child = os.fork()
        if child == 0:
            try:
                view.frame((0, -3000, 1500))
            except ValueError:
                del view
                os._exit(0)
            os._exit(1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_threads_share_a_view(self):
        view = terrace.View(self.scan)
        failures = []

        def look(seed):
            try:
                for _ in range(20):
                    view.frame((100.0 * seed, -2000, 900), seconds=0.002)
                    view.snapshot()
            except Exception as error:
                failures.append(error)

        threads = [threading.Thread(target=look, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])


    def test_triangles_are_counter_clockwise(self):
        # The rows of a raster run from north to south.
        for store in (self.raster, self.scan):
            view = terrace.View(store, reader='frame')
            view.frame(ground_error=1.0, seconds=0.1)
            now = view.snapshot()
            self.assertGreater(turns(now.added_positions, np.searchsorted(now.added_vertices, now.added_corners)).min(), 0)


class Models(StoreCase):
    """Compares expanded and collapsed clusters with the triangulation of the current points."""

    def check(self, model):
        vertices, triangles = model.mesh
        self.assertGreater(turns(vertices, triangles).min(), 0)
        expected = terrace.Delaunay2(self.flat(model, vertices))
        number = np.empty(len(expected.points), int)
        number[expected.ids] = np.arange(len(vertices))
        self.assertEqual({frozenset(row) for row in triangles.tolist()}, {frozenset(row) for row in number[expected.simplices].tolist()})

    def flat(self, model, vertices):
        if not self.grid:
            return vertices[:, :2]
        return np.round((vertices[:, :2] - [TRANSFORM[2], TRANSFORM[5]]) / [10, -10] - 0.5)

    def test_expands_and_collapses_clusters(self):
        for store in (self.scan, terrace.build(self.samples, self.path('small-blocks'), transform=TRANSFORM, block_points=500, replace=True)):
            self.grid = store.info['grid']
            model = terrace.Multiresolution(store)
            whole = [model.snapshot()]
            top = store.points(level=store.top)
            self.assertEqual(len(model), len(top))
            np.testing.assert_array_equal(sorted_rows(model.mesh.vertices), sorted_rows(terrace.xyz(top)))
            self.check(model)
            clusters = model.children()
            self.assertEqual(len(clusters), len(np.unique(clusters, axis=0)))
            chosen = clusters[::3]
            report = store.clusters(store.top - 1)
            for cluster in chosen:
                info = model.cluster_info(cluster)
                row = report[int(cluster[1])]
                np.testing.assert_allclose(info['bounds'], row['bounds'])
                self.assertEqual((info['error'], info['members']), (row['error'], row['members']))
                whole.append(model.expand(cluster))
            self.check(model)
            self.assertEqual({*map(tuple, model.expanded.tolist())}, {*map(tuple, chosen.tolist())})
            # The deltas add up to the mesh.
            vertices, triangles = {}, {}
            for delta in whole:
                for triangle in delta.removed_triangles:
                    del triangles[triangle]
                for vertex in delta.removed_vertices:
                    del vertices[vertex]
                vertices.update(zip(delta.added_vertices.tolist(), map(tuple, delta.added_positions)))
                vertices.update(zip(delta.moved_vertices.tolist(), map(tuple, delta.moved_positions)))
                triangles.update(zip(delta.added_triangles.tolist(), map(tuple, delta.added_corners)))
            now = model.snapshot()
            self.assertEqual(vertices, dict(zip(now.added_vertices.tolist(), map(tuple, now.added_positions))))
            self.assertEqual(triangles, dict(zip(now.added_triangles.tolist(), map(tuple, now.added_corners))))
            before = corner_sets(*model.mesh)
            more = model.children(chosen[0]) if store.top > 1 else []
            for cluster in more:
                model.expand(cluster)
            for cluster in more:
                model.collapse(cluster)
            self.assertEqual(corner_sets(*model.mesh), before)
            for cluster in chosen[::-1]:
                model.collapse(cluster)
            self.assertEqual(len(model), len(top))
            self.assertEqual(len(model.expand(chosen[0]).added_vertices), len(model.collapse(chosen[0]).removed_vertices))
            self.assertIn('clusters expanded', repr(model))
            self.assertLess(len(model._repr_png_()), 400_000)

    def test_refines_and_coarsens_boxes(self):
        box = (300300, 5200300, 300500, 5200500)
        x, y = self.points[:, 0], self.points[:, 1]
        inside = (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
        wanted = {*map(tuple, self.points[inside])}
        model = terrace.Multiresolution(self.scan)
        coarse = len(model)
        model.refine(box, 0)
        self.assertTrue(wanted <= {*map(tuple, model.mesh.vertices)})
        self.assertTrue(coarse < len(model) < len(self.scan))
        fine = len(model)
        model.coarsen((300000, 5200000, 301000, 5200800), self.scan.top)
        self.assertEqual(len(model), coarse)
        model.set_detail(self.scan.top, focus=[(box, 0)])
        self.assertEqual(len(model), fine)
        self.assertEqual(len(terrace.Multiresolution(self.scan, focus=[(box, 0)])), fine)
        model.set_detail(0)
        np.testing.assert_array_equal(sorted_rows(model.mesh.vertices), sorted_rows(self.points))
        self.assertEqual(model.mesh.levels.max(), self.scan.top)

    def test_rejects_invalid_arguments(self):
        model = terrace.Multiresolution(self.scan)
        for wrong in (lambda: model.expand((0, 0)) if self.scan.top > 1 else 1 / 0, lambda: model.expand((9, 0)), lambda: model.expand((0, 10 ** 12)),
                      lambda: model.children((0, 0)), lambda: model.cluster_info((self.scan.top, 0)), lambda: model.refine((1, 1, 0, 0), 0),
                      lambda: model.refine((0, 0, 1), 0), lambda: model.expand((1, 2, 3))):
            with self.assertRaises((ValueError, ZeroDivisionError)):
                wrong()
        for wrong in (lambda: model.expand(3), lambda: model.expand((0.5, 0)), lambda: terrace.Multiresolution('cloud')):
            with self.assertRaises(TypeError):
                wrong()

    def test_threads_share_a_model(self):
        model = terrace.Multiresolution(self.scan)
        clusters, failures, before = model.children(), [], corner_sets(*model.mesh)

        def work(seed):
            try:
                for cluster in clusters[seed::4]:
                    model.expand(cluster)
                    model.snapshot()
                    model.collapse(cluster)
            except Exception as error:
                failures.append(error)

        threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])
        self.assertEqual(corner_sets(*model.mesh), before)


def turns(vertices, triangles):
    """Returns twice the signed areas in x and y, positive for counter-clockwise triangles."""
    a, b, c = (vertices[triangles[:, i], :2] for i in range(3))
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def corner_sets(vertices, triangles):
    return {tuple(sorted(map(tuple, three))) for three in vertices[triangles]}


if __name__ == '__main__':
    unittest.main()
