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
from python_case import COMMAND, StoreCase


class Tiles(StoreCase):
    def test_a_set_of_tiles(self):
        folder = self.path('tiles')
        told = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal')
        with open(os.path.join(folder, 'layer.json'), encoding='utf-8') as file:
            self.assertEqual(json.load(file)['format'], 'quantized-mesh-1.0')
        tiles = [os.path.join(root, name) for root, _, names in os.walk(folder) for name in names
                 if name.endswith('.terrain')]
        self.assertEqual(len(tiles), told['tiles'])
        self.assertEqual([zoom['zoom'] for zoom in told['zooms']], list(range(13)))
        with open(tiles[0], 'rb') as file:
            head = struct.unpack('<3d2f', file.read(32))
        self.assertTrue(all(abs(c) < 7e6 for c in head[:3]))
        again = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal', resume=True)
        self.assertEqual((again['made'], again['kept']), (0, told['tiles']))
        if COMMAND:
            subprocess.run([COMMAND, 'verify', folder, '--store', self.path('hills'), '--vertical', 'ellipsoidal', '-q'], check=True)
            other = self.path('tiles-of-command')
            subprocess.run([COMMAND, 'tile', self.path('hills'), '-o', other, '--zoom', '0-12', '--vertical',
                            'ellipsoidal', '-q'], check=True)
            for tile in tiles:
                with open(tile, 'rb') as ours, open(os.path.join(other, os.path.relpath(tile, folder)), 'rb') as theirs:
                    self.assertEqual(ours.read(), theirs.read())

    def test_the_check_of_a_set(self):
        folder = self.path('checked')
        told = self.raster.tiles(folder, zooms=(0, 12), vertical='ellipsoidal', max_error=2)
        sound = terrace.verify_tiles(folder, self.raster, vertical='ellipsoidal')
        self.assertEqual((sound['faults'], sound['tiles'], sound['torn']), ([], told['tiles'], 0))
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
        with self.assertRaises((ValueError, terrace.Error)):  # nothing says what heights refer to
            self.raster.tiles(self.path('none'), zooms=(0, 3))


class Views(StoreCase):
    def fly(self, view, frames=3000):
        """Applies deltas as a renderer does, until the view has settled."""
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

    def test_points_alone(self):
        vertices, triangles, _ = self.fly(terrace.View(self.scan, 'points'))
        self.assertEqual(triangles, {})
        self.assertGreater(len(vertices), 100)

    def test_everything_is_shown_where_no_error_is_allowed(self):
        view = terrace.View(self.scan, reader='frame')
        delta = view.frame(ground_error=0.0, seconds=10)
        while not delta.settled:
            delta = view.frame(ground_error=0.0, seconds=10)
        self.assertEqual(delta.points, len(self.scan))
        # Metres from the middle: as wide and as high as the cloud, within the map's scale.
        now = view.snapshot().added_positions
        np.testing.assert_allclose(np.ptp(now, axis=0), np.ptp(self.points, axis=0), rtol=1e-3)

    def test_matrix_cameras(self):
        # Orthographic, 4 km wide and high, from above.
        matrix = np.diag([1 / 2000, 1 / 2000, -1 / 5000, 1.0])
        view = terrace.View(self.scan, reader='frame')
        first = delta = view.frame(matrix=matrix, size=(1000, 1000), pixel_error=0.1, seconds=5)
        while not delta.settled:
            delta = view.frame(matrix=matrix, size=(1000, 1000), pixel_error=0.1, seconds=5)
        self.assertGreater(delta.points, first.points)

    def test_misuse(self):
        view = terrace.View(self.scan)
        for wrong in ({'position': (0, 0)}, {'position': (0, 0, np.nan)}, {'position': (0, 0, 1), 'direction': (0, 0, 0)},
                      {'position': (0, 0, 1), 'up': (0, 1, -0.5)}, {'position': (0, 0, 1), 'fov': 0},
                      {'position': (0, 0, 1), 'size': (0, 0)}, {'matrix': np.eye(3)}, {'matrix': np.zeros((4, 4))},
                      {'position': (0, 0, 1), 'pixel_error': -1}):
            with self.subTest(repr(wrong)):
                with self.assertRaises(ValueError):
                    view.frame(**wrong)
        for wrong in ({'kind': 'lines'}, {'reader': 'nobody'}, {'max_points': -1}):
            with self.assertRaises(ValueError):
                terrace.View(self.scan, **wrong)

    def test_a_fork_is_refused_and_ends(self):
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


if __name__ == '__main__':
    unittest.main()
