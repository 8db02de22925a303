#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs every verb on degenerate stores and files: without points, with one point, with points on one line,
at one position, or so far apart that squares overflow. Each run must end by itself with a result or a
one-line error. Sanitizer builds run this too, to find invalid casts and indices.

TERRACE=path/to/terrace STORES=libstream/tests/data/stores degenerate_cli_test.py
"""

import os
import shutil
import subprocess
import tempfile
import unittest

from small_tiff import utm, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
STORES = os.environ.get('STORES')

POINTS = {
    'one': [(500000, 5200000, 7)],
    'two': [(500000, 5200000, 7), (500001, 5200000, 8)],
    'line': [(500000 + i, 5200000 + 2 * i, i) for i in range(30)],
    'east': [(500000 + i, 5200000, 0) for i in range(30)],
    'upright': [(500000, 5200000, i) for i in range(30)],
    'same': [(500000, 5200000, 7)] * 30,
    'far': [(1e300, -1e300, 1e300), (-1e300, 1e300, -1e300), (1e300, 1e300, 0), (0, 0, 0)],
    'tiny': [(0, 0, 0), (1e-300, 0, 1e-300), (0, 1e-300, 0), (5e-324, 5e-324, 1)],
}
CRITERIA = ['poles', 'gabriel', 'edge', 'advancing-front', 'alpha-wrap']
PLACES = 'x,y\n500000,5200000\n500003.5,5200007\n0,0\n1e300,-1e300\nnan,5\n-1e-300,\n'


def on_store(store):
    """Arguments for each verb up to -o, and the endings of its outputs."""
    yield '', 'info', store
    yield '', 'info', store, '--json'
    yield '', 'verify', store
    for ending in ('.xyz', '.las', '.ply', '.copc.laz'):
        yield ending, 'points', store
    yield '.csv', 'points', store, '--level', 'top'
    yield '.csv', 'points', store, '--where', 'z > 1'
    yield '.csv', 'points', store, '--cluster', '0:0'
    yield '.csv', 'points', store, '--region', '499999,5199999,500002,5200002'
    yield '.csv', 'points', store, '--near', '500000,5200000', '-k', '3'
    yield '.csv', 'points', store, '--near', '1e300,0,0', '--within', '1e9'
    for more in ([], ['--level', 'top'], ['--max-error', '0.5'], ['--max-error', '0'],
                 ['--max-error', '1', '--quality', 'fitted'], ['--max-points', '10'],
                 ['--focus', '499999,5199999,500002,5200002:0'], ['--smooth', 'taubin']):
        yield '.ply', 'mesh', store, *more
    for criterion in CRITERIA:
        yield '.ply', 'surface', store, '--criterion', criterion
    yield '.tiles', 'tile', store, '--vertical', 'ellipsoidal', '--zoom', '0-3'
    for method in ('linear', 'natural', 'nearest'):
        yield '.csv', 'sample', store, '--points', 'places.csv', '--method', method
        yield '.tif', 'raster', store, '--cell', '0.7', '--method', method
    yield '.csv', 'sample', store, '--points', 'places.csv', '--level', 'top', '--max-edge', '5'
    for cell in ('1e-300', '1e9', '4e274', '1.7e308'):
        yield '.tif', 'raster', store, '--cell', cell
    for value in ('slope', 'aspect', 'hillshade'):
        yield '.tif', 'raster', store, '--value', value
    yield '.tif', 'raster', store, '--region', '499999,5199999,500002,5200002', '--cell', '1'
    yield '.csv', 'profile', store, '--line', '499999,5199999,500009,5200012'
    yield '.csv', 'profile', store, '--line', '499999,5199999,500009,5200012', '--step', '0.3'
    yield '.geojson', 'contour', store, '--interval', '0.9', '--own-crs'
    yield '.geojson', 'contour', store, '--interval', '1e-300', '--own-crs'
    yield '.png', 'render', store, '--size', '64x64'
    yield '.png', 'render', store, '--size', '64x64', '--view', '30,40', '--wire'
    yield '.png', 'render', store, '--size', '64x64', '--view', '1e300,-1e-300', '--level', 'top'
    yield '.site', 'publish', store


def on_points(file):
    yield '', 'info', file
    for ending in ('.xyz', '.las', '.laz', '.ply', '.copc.laz'):
        yield ending, 'convert', file
    for method in ('facility', 'primal-dual', 'k-means', 'k-median', 'single', 'complete'):
        more = ['-k', '1'] if method not in ('facility', 'primal-dual') else []
        yield '.csv', 'cluster', file, '--method', method, *more
    for method in ('auto', 'monotone', 'exact'):
        yield '.csv', 'match', file, '--method', method
    yield '.csv', 'match', file, '--tree'
    yield '.png', 'render', file, '--size', '64x64', '--view', '30,40'


class DegenerateTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-degenerate-')
        self.addCleanup(shutil.rmtree, self.folder)
        with open(self.path('places.csv'), 'w') as file:
            file.write(PLACES)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_verb(self, ending, *args):
        """Checks that the run ends by itself, with success or a one-line error."""
        output = ['-o', 'out' + ending] if ending else []
        with self.subTest(args=args):
            result = subprocess.run([TERRACE, *args, *output, '-q'], capture_output=True, text=True,
                                    errors='replace', timeout=600, cwd=self.folder)
            self.assertIn(result.returncode, (0, 1, 2), result.stderr)
            for word in ('runtime error', 'Sanitizer', 'ssertion'):
                self.assertNotIn(word, result.stderr)
            if result.returncode != 0 and args[0] != 'verify':
                self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
        for name in os.listdir(self.folder):
            if name.startswith('out'):
                path = self.path(name)
                (shutil.rmtree if os.path.isdir(path) else os.remove)(path)
        return result.returncode

    def try_store(self, store):
        for command in on_store(store):
            self.run_verb(*command)

    def test_points(self):
        for name, points in POINTS.items():
            file = name + '.xyz'
            with open(self.path(file), 'w') as out:
                out.writelines(f'{x!r} {y!r} {z!r}\n' for x, y, z in points)
            for command in on_points(file):
                self.run_verb(*command)
            crs = ['--crs', 'EPSG:32632'] if abs(points[0][0]) == 500000 else []
            if self.run_verb('', 'build', file, '-o', name, *crs) == 0:
                self.try_store(name)

    @unittest.skipUnless(STORES, 'STORES is not set')
    def test_a_store_without_points(self):
        self.try_store(os.path.abspath(os.path.join(STORES, 'empty')))

    def test_rasters(self):
        void = -9999.0
        for name, heights, columns in (('cell', [5.0], 1), ('row', [1.0, 2.0, 3.0, 5.0], 4),
                                       ('column', [1.0, 2.0, 3.0, 5.0], 1), ('void', [void] * 12, 4),
                                       ('few', [void] * 5 + [7.0] + [void] * 6, 4),
                                       ('high', [1e38, -1e38, 0.0, 3e38], 2)):
            write_tiff(self.path(name + '.tif'), columns, len(heights) // columns, heights, keys=utm(32),
                       nodata='-9999')
            for ending in ('', '.xyz', '.las'):
                self.run_verb(ending, *(['convert'] if ending else ['info']), name + '.tif')
            self.run_verb('.png', 'render', name + '.tif', '--size', '64x64')
            if self.run_verb('', 'build', name + '.tif', '-o', name) == 0:
                self.try_store(name)


if __name__ == '__main__':
    unittest.main()
