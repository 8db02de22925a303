#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests contour lines and rasters of points and of coarser levels end to end.

TERRACE=path/to/terrace contour_cloud_cli_test.py
"""

import array
import filecmp
import json
import math
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')

# Reads points and answers from SciPy's triangulation.
ORACLE = '''
import json, sys
import numpy
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay
task = json.load(sys.stdin)
points = numpy.array(task['points'])
if 'cells' in task:
    heights = LinearNDInterpolator(points[:, :2] - points[0, :2], points[:, 2])(
        numpy.array(task['cells']) - points[0, :2])
    print(json.dumps([None if numpy.isnan(h) else h for h in heights]))
else:
    segments = []
    for simplex in Delaunay(points[:, :2] - points[0, :2]).simplices:
        corners = sorted(points[simplex].tolist())
        heights = [z for _, _, z in corners]
        level = int(min(heights) // task['interval']) - 1
        while level * task['interval'] < max(heights):
            h = level * task['interval']
            ends = []
            for (ax, ay, az), (bx, by, bz) in (corners[0:2], corners[1:3], corners[0::2]):
                if (az > h) != (bz > h):
                    t = (h - az) / (bz - az)
                    ends.append((ax + t * (bx - ax), ay + t * (by - ay)))
            if ends:
                segments.append([level, *ends])
            level += 1
    print(json.dumps(segments))
'''


def python_with_scipy():
    for python in sys.executable, '/usr/bin/python3':
        try:
            if subprocess.run([python, '-c', 'import scipy'], capture_output=True).returncode == 0:
                return python
        except OSError:
            pass
    return None


SCIPY = python_with_scipy()


def needs(*programs):
    missing = [p for p in programs if shutil.which(p) is None]
    return unittest.skipIf(missing, 'not installed: ' + ', '.join(missing))


def smooth(x, y):
    return 300 + 120 * math.sin(x / 150) * math.cos(y / 190) + 30 * math.sin((x + y) / 37)


class CloudTestCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        generator = random.Random(7)
        cls.points = []
        while len(cls.points) < 4000:
            x, y = generator.uniform(0, 1000), generator.uniform(0, 700)
            # A lake.
            if math.hypot(x - 600, y - 300) > 120:
                cls.points.append((x, y, smooth(x, y)))
        # Coordinates written to the file read back as the same numbers.
        cls.metres = cls.build('metres', [(500000 + x, 5200000 + y, z) for x, y, z in cls.points],
                               '--crs', 'EPSG:32632')

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @classmethod
    def build(cls, name, points, *options):
        cloud, store = cls.path(name + '.xyz'), cls.path(name + '.terrace')
        with open(cloud, 'w') as file:
            file.writelines(f'{x!r} {y!r} {z!r}\n' for x, y, z in points)
        # Small clusters and blocks give several levels.
        cls.run_ok('build', cloud, '-o', store, '--block', 200, '--facility-cost', 1, *options)
        return store

    @staticmethod
    def terrace(*args):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)

    @classmethod
    def run_ok(cls, *args):
        result = cls.terrace(*args)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, code, *args):
        result = self.terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def oracle(self, **task):
        return json.loads(subprocess.run([SCIPY, '-c', ORACLE], input=json.dumps(task), text=True,
                                         capture_output=True, check=True).stdout)


class NoContourTest(CloudTestCase):
    def test_the_note_on_no_lines_gives_the_reason(self):
        flat = self.build('flat', [(x, y, 5.5) for x in range(9) for y in range(9)])
        line = self.build('line', [(i, 2 * i, 7 * i) for i in range(9)])
        pair = self.build('pair', [(0, 0, 0), (9, 9, 99)])
        one = self.build('one', [(3, 4, 5)])
        for store, interval, why in ((flat, 1, 'no multiple of --interval 1 is between the heights, 5.5 to 5.5'),
                                     (one, 1, 'is between the heights, 5 to 5'),
                                     (line, 10, 'the points are on one line, so they span no triangles'),
                                     (pair, 10, 'the points are on one line, so they span no triangles')):
            result = self.terrace('contour', store, '--own-crs', '--interval', interval, '-o', self.path('none.geojson'), '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('there are no lines: ', result.stderr)
            self.assertIn(why, result.stderr)
            self.assertIn('0 lines', result.stderr)
        result = self.terrace('contour', self.metres, '--interval', 50, '--max-edge', 0.001, '-o', self.path('none.geojson'), '--force')
        self.assertIn('there are no lines: no triangle with sides of up to 0.001 m crosses', result.stderr)
        result = self.terrace('contour', self.metres, '--interval', 50, '-o', self.path('some.geojson'))
        self.assertNotIn('there are no lines', result.stderr)


class CloudContourTest(CloudTestCase):
    def lines(self, store, *options):
        return json.loads(self.run_ok('contour', store, '-o', '-', *options))['features']

    @unittest.skipIf(SCIPY is None, 'no SciPy')
    def test_lines_match_another_triangulation(self):
        # In degrees, which are written unchanged.
        points = [(7 + x / 1e5, 46 + y / 1e5, z) for x, y, z in self.points]
        store = self.build('degrees', points, '--crs', 'EPSG:4326')

        def named(level, a, b):
            return (level, *sorted((f'{x:.9f}', f'{y:.9f}') for x, y in (a, b)))

        expected = {named(*s) for s in self.oracle(points=points, interval=10)}
        got = set()
        for feature in self.lines(store, '--interval', 10):
            level = round(feature['properties']['elev'] / 10)
            places = feature['geometry']['coordinates']
            got |= {named(level, a, b) for a, b in zip(places, places[1:])}
        self.assertGreater(len(expected), 3000)
        # A last digit may round differently.
        self.assertLessEqual(len(got ^ expected), 8)

    @unittest.skipIf(SCIPY is None, 'no SciPy')
    def test_lines_in_stored_coordinates_need_no_crs(self):
        store = self.build('local', self.points)
        refused = self.expect_error(1, 'contour', store, '--interval', 10, '-o', self.path('none.geojson'))
        self.assertIn('--own-crs', refused)

        def named(level, a, b):
            return (level, *sorted(tuple(f'{c:.6f}' for c in p) for p in (a, b)))

        expected = {named(*s) for s in self.oracle(points=self.points, interval=10)}
        got = set()
        for feature in json.loads(self.run_ok('contour', store, '--own-crs', '--interval', 10, '-o', '-'))['features']:
            level = round(feature['properties']['elev'] / 10)
            places = feature['geometry']['coordinates']
            got |= {named(level, a, b) for a, b in zip(places, places[1:])}
        self.assertGreater(len(expected), 3000)
        # A last digit may round differently.
        self.assertLessEqual(len(got ^ expected), 8)

    def test_higher_ground_is_on_the_right_as_for_rasters(self):
        # A hill, as points and as a raster.
        hill = [(500000 + 30 * i, 5200000 + 30 * j, 100 - math.hypot(i - 10.3, j - 9.6))
                for i in range(20) for j in range(20)]
        cloud = self.build('hill', hill, '--crs', 'EPSG:32632')
        raster = self.path('hill.tif')
        self.run_ok('raster', cloud, '--cell', 10, '-o', raster)
        grid = self.path('hill-grid.terrace')
        self.run_ok('build', raster, '-o', grid, '--block', 200)
        self.assertIn('--max-edge', self.expect_error(2, 'contour', grid, '--interval', 3, '--max-edge',
                                                      9, '-o', self.path('none.geojson')))
        for store, options in (cloud, ()), (grid, ()), (grid, ('--level', 1)):
            lines = [f['geometry']['coordinates'] for f in self.lines(store, '--interval', 3, *options)]
            closed = [p for p in lines if p[0] == p[-1]]
            self.assertTrue(closed)
            for p in closed:
                area = sum(a[0] * b[1] - b[0] * a[1] for a, b in
                           zip([(x - p[0][0], y - p[0][1]) for x, y in p],
                               [(x - p[0][0], y - p[0][1]) for x, y in p[1:]]))
                self.assertLess(area, 0)

    def test_threads_and_memory_do_not_change_a_byte(self):
        one = self.run_ok('contour', self.metres, '--interval', 2, '--threads', 1, '-o', '-')
        self.assertEqual(one, self.run_ok('contour', self.metres, '--interval', 2, '--threads', 3,
                                          '--memory', '64M', '-o', '-'))

    def test_levels_and_regions(self):
        all_lines = self.lines(self.metres, '--interval', 10)
        coarse = self.lines(self.metres, '--interval', 10, '--level', 1)
        count = lambda lines: sum(len(f['geometry']['coordinates']) for f in lines)
        self.assertTrue(0 < count(coarse) < count(all_lines))
        part = self.lines(self.metres, '--interval', 10, '--region', '500100,5200100,500400,5200500')
        self.assertTrue(0 < count(part) < count(all_lines))
        out = self.path('none.geojson')
        self.assertIn('has no level', self.expect_error(2, 'contour', self.metres, '--interval', 1,
                                                        '--level', 99, '-o', out))
        self.assertIn('is in the region', self.expect_error(1, 'contour', self.metres, '--interval', 1,
                                                         '--region', '0,0,9,9', '-o', out))
        self.assertFalse(os.path.exists(out))

    def test_triangles_with_long_edges_have_no_lines(self):
        count = lambda lines: sum(len(f['geometry']['coordinates']) for f in lines)
        without, far, near = (count(self.lines(self.metres, '--interval', 10, *options))
                              for options in ((), ('--max-edge', 1e6), ('--max-edge', 30)))
        self.assertEqual(without, far)
        self.assertTrue(0 < near < without)
        out = self.path('none.geojson')
        self.expect_error(2, 'contour', self.metres, '--interval', 1, '--max-edge', 0, '-o', out)

    def test_few_flat_and_collinear_points_have_no_lines(self):
        for number, points in enumerate((
                [(1, 2, 3)],
                [(1, 2, 3), (4, 5, 60)],
                [(1, 2, 3), (1, 2, 30), (1, 2, 60)],
                [(i, 2 * i, 10 * i) for i in range(50)],
                [(i % 9, i // 9, 40) for i in range(50)])):
            store = self.build(f'few{number}', points, '--crs', 'EPSG:32632')
            for interval in 1e-4, 10, 1e9:
                self.assertEqual(self.lines(store, '--interval', interval), [])

    def test_too_many_levels_are_an_error(self):
        out = self.path('none.geojson')
        self.assertIn('too many levels', self.expect_error(1, 'contour', self.metres, '--interval',
                                                           1e-14, '-o', out))
        self.assertIn('more than 10,000,000', self.expect_error(1, 'contour', self.metres, '--interval', 1e-6, '-o', out))
        self.assertIn('too many for --memory', self.expect_error(
            1, 'contour', self.metres, '--interval', 1e-4, '--memory', '64M', '-o', out))
        self.assertEqual(self.lines(self.metres, '--interval', 1e12), [])
        nowhere = self.build('nowhere', self.points)
        self.assertIn('--crs', self.expect_error(1, 'contour', nowhere, '--interval', 1, '-o', out))
        self.assertFalse(os.path.exists(out))


class CloudRasterTest(CloudTestCase):
    def samples(self, file):
        """The samples of a GeoTIFF by rows, read by GDAL."""
        raw = self.path('samples.raw')
        subprocess.run(['gdal_translate', '-q', '-of', 'ENVI', '-ot', 'Float32', file, raw], check=True)
        values = array.array('f')
        with open(raw, 'rb') as stream:
            values.frombytes(stream.read())
        return values

    def frame(self, file):
        info = json.loads(subprocess.run(['gdalinfo', '-json', file], capture_output=True,
                                         text=True).stdout)
        x, dx, _, y, _, dy = info['geoTransform']
        columns, rows = info['size']
        return [(x + dx * (i + 0.5), y + dy * (j + 0.5)) for j in range(rows) for i in range(columns)]

    @unittest.skipIf(SCIPY is None, 'no SciPy')
    @needs('gdal_translate', 'gdalinfo')
    def test_cells_match_another_triangulation(self):
        out = self.path('cells.tif')
        self.run_ok('raster', self.metres, '--cell', 7, '-o', out)
        points = [(500000 + x, 5200000 + y, z) for x, y, z in self.points]
        expected = self.oracle(points=points, cells=self.frame(out))
        got = self.samples(out)
        self.assertEqual(len(got), len(expected))
        self.assertGreater(len(got), 10000)
        differing = 0
        for ours, theirs in zip(got, expected):
            if theirs is None:
                self.assertEqual(ours, -9999)
            elif not abs(ours - theirs) < 1e-3:
                differing += 1
        # SciPy's hull is not quite convex there.
        self.assertLessEqual(differing, 3)

    @needs('gdal_translate', 'gdalinfo')
    def test_a_raster_and_its_samples_as_points_give_the_same_surface(self):
        # The heights are such that both diagonals of a square give the same surface.
        points = [(500000 + 30 * i, 5200000 + 30 * j, 200 + 40 * math.sin(i / 7) + 25 * math.cos(j / 5))
                  for j in range(60) for i in range(80)]
        cloud = self.build('lattice', points, '--crs', 'EPSG:32632')
        asc = self.path('lattice.asc')
        with open(asc, 'w') as file:
            file.write('ncols 80\nnrows 60\nxllcenter 500000\nyllcenter 5200000\ncellsize 30\n')
            for j in reversed(range(60)):
                file.write(' '.join(repr(points[80 * j + i][2]) for i in range(80)) + '\n')
        dem, grid = self.path('lattice.tif'), self.path('lattice-grid.terrace')
        subprocess.run(['gdal_translate', '-q', '-ot', 'Float64', '-a_srs', 'EPSG:32632', asc, dem],
                       check=True)
        self.run_ok('build', dem, '-o', grid, '--block', 200)
        box = '500010,5200005,502365,5201760'  # multiples of the cell
        outs = []
        for name, store in ('of-points', cloud), ('of-raster', grid):
            outs.append(self.path(name + '.tif'))
            self.run_ok('raster', store, '--cell', 15, '--region', box, '-o', outs[-1])
        a, b = map(self.samples, outs)
        self.assertEqual(len(a), 157 * 117)
        self.assertNotIn(-9999, a)
        for x, y in zip(a, b):
            self.assertAlmostEqual(x, y, delta=2e-4)

    @needs('gdaldem', 'gdal_translate')
    def test_slope_aspect_and_hillshade_match_gdaldem(self):
        # gdaldem uses metres of the map, which differ from metres on the ground by the projection's
        # scale.
        heights = self.path('heights.tif')
        self.run_ok('raster', self.metres, '--cell', 10, '-o', heights)
        for value, nodata, tolerance in (('slope', -9999, 0.05), ('aspect', -9999, 0.5),
                                         ('hillshade', 0, 1)):
            ours, theirs = self.path(value + '.tif'), self.path(value + '-gdal.tif')
            self.run_ok('raster', self.metres, '--cell', 10, '--value', value, '-o', ours)
            subprocess.run(['gdaldem', value, '-q', heights, theirs], check=True)
            a, b = self.samples(ours), self.samples(theirs)
            self.assertEqual(sum(v == nodata for v in a), sum(v == nodata for v in b))
            off = 0
            for x, y in zip(a, b):
                d = abs(x - y)
                off += (min(d, 360 - d) if value == 'aspect' else d) > tolerance
            self.assertLessEqual(off, len(a) // 500, value)

    def test_threads_and_memory_do_not_change_a_byte(self):
        one, two = self.path('one.tif'), self.path('two.tif')
        for value in 'height', 'slope':
            self.run_ok('raster', self.metres, '--cell', 0.9, '--value', value, '--threads', 1, '--force',
                        '-o', one)
            self.run_ok('raster', self.metres, '--cell', 0.9, '--value', value, '--threads', 3, '--force',
                        '--memory', '80M', '-o', two)
            self.assertTrue(filecmp.cmp(one, two, shallow=False))

    @needs('gdalinfo')
    def test_the_default_cell_size_gives_about_one_cell_per_point(self):
        for level in 0, 1:
            out = self.path(f'level{level}.tif')
            summary = json.loads(self.run_ok('raster', self.metres, '--level', level, '--json', '-o', out))
            info = json.loads(self.run_ok('info', self.metres, '--json'))
            points = info['levels'][level]['points']
            self.assertAlmostEqual(summary['cells'] / points, 1, delta=0.2)
            self.assertLess(summary['nodata'], 0.4 * summary['cells'])

    @needs('gdal_translate', 'gdalinfo')
    def test_max_edge_leaves_lakes_open(self):
        out, open_out = self.path('closed.tif'), self.path('open.tif')
        self.run_ok('raster', self.metres, '--cell', 10, '-o', out)
        self.run_ok('raster', self.metres, '--cell', 10, '--max-edge', 60, '-o', open_out)
        seen = set()
        for (x, y), closed, opened in zip(self.frame(out), self.samples(out), self.samples(open_out)):
            distance = math.hypot(x - 500600, y - 5200300)
            if distance < 60:
                self.assertEqual(opened, -9999)
                self.assertNotEqual(closed, -9999)
                seen.add('lake')
            elif opened != -9999:
                self.assertEqual(opened, closed)
                seen.add('land')
        self.assertEqual(seen, {'lake', 'land'})

    @unittest.skipIf(SCIPY is None, 'no SciPy')
    @unittest.skipIf('TERRACE_DATA' not in os.environ, 'TERRACE_DATA is not set')
    @needs('gdal_translate', 'gdalinfo')
    def test_laser_data(self):
        with open(os.path.join(os.environ['TERRACE_DATA'], 'lidar/4_6_crop.las'), 'rb') as file:
            data = file.read()
        first, = struct.unpack_from('<I', data, 96)
        size, count = struct.unpack_from('<HI', data, 105)
        scale, offset = struct.unpack_from('<3d', data, 131), struct.unpack_from('<3d', data, 155)
        points = {}
        for i in range(count):
            raw = struct.unpack_from('<3i', data, first + i * size)
            p = [round(c * s + o, 3) for c, s, o in zip(raw, scale, offset)]
            points.setdefault(tuple(p[:2]), p)
        self.assertGreater(len(points), 20000)
        points = list(points.values())
        store, out = self.build('laser', points), self.path('laser.tif')
        self.run_ok('raster', store, '--cell', 1, '-o', out)
        expected = self.oracle(points=points, cells=self.frame(out))
        got = self.samples(out)
        without = sum(e is None for e in expected)
        self.assertLess(without, len(got) // 10)
        self.assertLessEqual(abs(without - sum(z == -9999 for z in got)), 2)
        # Four points on a circle have two triangulations.
        differing = sum(e is not None and abs(z - e) > 2e-3 for z, e in zip(got, expected))
        self.assertLess(differing, len(got) // 100)

    def test_few_points(self):
        out = self.path('few.tif')
        one = self.build('one', [(5, 6, 7)], '--crs', 'EPSG:32632')
        self.assertIn('--cell', self.expect_error(1, 'raster', one, '-o', out))
        summary = json.loads(self.run_ok('raster', one, '--cell', 1, '--json', '-o', out))
        self.assertEqual((summary['cells'], summary['nodata']), (1, 1))
        line = self.build('line', [(i, 0, i) for i in range(20)], '--crs', 'EPSG:32632')
        summary = json.loads(self.run_ok('raster', line, '--cell', 1, '--json', '--force', '-o', out))
        self.assertEqual(summary['nodata'], summary['cells'])
        self.assertIn('is in the region', self.expect_error(1, 'raster', self.metres, '--region', '0,0,9,9',
                                                         '--force', '-o', out))
        self.expect_error(2, 'raster', self.metres, '--level', 77, '--force', '-o', out)


if __name__ == '__main__':
    unittest.main()
