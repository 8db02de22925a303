#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests sample and profile on irregular points and on coarser levels.

TERRACE=path/to/terrace cloud_query_cli_test.py
"""

import csv
import io
import json
import math
import os
import random
import struct
import subprocess
import sys
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
DATA = os.environ.get('TERRACE_DATA')

# Reads points.xyz and places.csv; writes the heights of Qhull's Delaunay triangulation.
ORACLE = '''
import sys
import numpy
import scipy.interpolate
points = numpy.loadtxt(sys.argv[1])
places = numpy.loadtxt(sys.argv[2], delimiter=',', ndmin=2)
middle = points[:, :2].mean(axis=0)
surface = scipy.interpolate.LinearNDInterpolator(points[:, :2] - middle, points[:, 2])
numpy.savetxt(sys.argv[3], surface(places - middle), fmt='%.17g')
'''


def python_with_scipy():
    for python in (sys.executable, '/usr/bin/python3'):
        try:
            if subprocess.run([python, '-c', 'import numpy, scipy.interpolate'],
                              capture_output=True).returncode == 0:
                return python
        except OSError:
            pass
    return None


SCIPY = python_with_scipy()


def terrace(*args, text=None):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, input=text,
                          timeout=120)


class CloudQueryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        rng = random.Random(3)
        cls.points = []
        while len(cls.points) < 6000:
            x, y = 500000 + 2000 * rng.random(), 5200000 + 1500 * rng.random()
            # A lake.
            if math.hypot(x - 501000, y - 5200700) > 300:
                cls.points.append((x, y, cls.height(x, y)))
        cls.cloud = cls.path('cloud.xyz')
        with open(cls.cloud, 'w') as file:
            for p in cls.points:
                file.write('%.17g %.17g %.17g\n' % p)
        cls.store = cls.path('cloud.terrace')
        cls.run_ok('build', cls.cloud, '-o', cls.store, '--block', 100, '--crs', 'EPSG:32633')

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def height(x, y):
        return 300 + 0.05 * (x - 500000) + 20 * math.sin(x / 150) * math.cos(y / 200)

    @staticmethod
    def run_ok(*args, text=None):
        result = terrace(*args, text=text)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def places(self, count, seed=5):
        rng = random.Random(seed)
        return [(499950 + 2100 * rng.random(), 5199950 + 1600 * rng.random())
                for _ in range(count)]

    def sample(self, places, *args, store=None):
        text = 'x,y\n' + ''.join('%.17g,%.17g\n' % tuple(p) for p in places)
        out = self.run_ok('sample', store or self.store, *args, text=text)
        return list(csv.DictReader(io.StringIO(out)))

    def scipy_heights(self, points, places):
        names = [self.path(n) for n in ('oracle.xyz', 'oracle.csv', 'oracle.txt')]
        for name, rows, separator in ((names[0], points, ' '), (names[1], places, ',')):
            with open(name, 'w') as file:
                for row in rows:
                    file.write(separator.join('%.17g' % v for v in row) + '\n')
        subprocess.run([SCIPY, '-c', ORACLE, *names], check=True)
        with open(names[2]) as file:
            return [float(line) for line in file]

    @unittest.skipIf(SCIPY is None, 'SciPy is not installed')
    def test_linear_matches_scipy(self):
        places = self.places(3000)
        expected = self.scipy_heights(self.points, places)
        self.compare(self.sample(places), expected, 2e-6)

    def compare(self, rows, expected, tolerance):
        self.assertEqual(len(rows), len(expected))
        answered = 0
        for row, height in zip(rows, expected):
            self.assertEqual(row['height'] == '', math.isnan(height), row)
            if row['height']:
                self.assertAlmostEqual(float(row['height']), height, delta=tolerance)
                answered += 1
        self.assertGreater(answered, len(rows) // 2)

    def test_nearest_returns_the_nearest_point(self):
        places = self.places(300)
        for place, row in zip(places, self.sample(places, '--method', 'nearest')):
            best = min(self.points, key=lambda p: math.hypot(p[0] - place[0], p[1] - place[1]))
            self.assertAlmostEqual(float(row['height']), best[2], delta=1e-5)

    def test_natural_is_smooth_and_linear_for_a_plane(self):
        points = [(p[0], p[1], 0.25 * (p[0] - 5e5) - 0.5 * (p[1] - 52e5)) for p in self.points]
        cloud, store = self.path('plane.xyz'), self.path('plane.terrace')
        with open(cloud, 'w') as file:
            for p in points:
                file.write('%.17g %.17g %.17g\n' % p)
        self.run_ok('build', cloud, '-o', store, '--block', 100, '--crs', 'EPSG:32633')
        places = self.places(800)
        rows = self.sample(places, '--method', 'natural', store=store)
        answered = 0
        for (x, y), row in zip(places, rows):
            if not row['height']:
                continue
            answered += 1
            self.assertAlmostEqual(float(row['height']), 0.25 * (x - 5e5) - 0.5 * (y - 52e5),
                                   delta=2e-5)
            # Metres of UTM differ from metres on the ground by the projection's scale.
            self.assertAlmostEqual(float(row['gradient']), math.hypot(0.25, 0.5), delta=1e-3)
        self.assertGreater(answered, 600)

    def test_the_result_does_not_depend_on_threads_memory_and_order(self):
        places = self.places(2500)
        shuffled = list(enumerate(places))
        random.Random(1).shuffle(shuffled)
        for method in ('linear', 'natural', 'nearest'):
            one = self.sample(places, '--method', method, '--threads', 1)
            two = self.sample([p for _, p in shuffled], '--method', method, '--threads', 3,
                              '--memory', '64M')
            for (number, _), row in zip(shuffled, two):
                self.assertEqual(row, one[number])

    def test_triangles_with_long_edges_have_no_height(self):
        lake = [(501000 + 80 * math.cos(a), 5200700 + 80 * math.sin(a)) for a in range(20)]
        land = [(500300 + 13 * i, 5200100 + 7 * i) for i in range(20)]
        for method in ('linear', 'natural', 'nearest'):
            rows = self.sample(lake + land, '--method', method)
            self.assertTrue(all(row['height'] for row in rows))
            rows = self.sample(lake + land, '--method', method, '--max-edge', 150)
            self.assertFalse(any(row['height'] for row in rows[:20]))
            self.assertTrue(all(row['height'] for row in rows[20:]))

    def test_to_crs_converts_only_the_positions(self):
        places = self.places(50)
        text = 'name,y,x,note\n' + ''.join('p%d,%.17g,%.17g,"a, b"\n' % (i, p[1], p[0])
                                           for i, p in enumerate(places)) + '# end\nq,,,\n'
        plain = self.run_ok('sample', self.store, text=text)
        there = self.run_ok('sample', self.store, '--to-crs', 'EPSG:4326', text=text)
        rows = list(csv.reader(io.StringIO(there)))
        self.assertEqual(rows[0][:4], ['name', 'latitude', 'longitude', 'note'])
        for before, after in zip(list(csv.reader(io.StringIO(plain)))[1:51], rows[1:51]):
            self.assertEqual(before[0], after[0])
            self.assertEqual(before[3:], after[3:])
            self.assertTrue(46.9 < float(after[1]) < 47.1 and 14.9 < float(after[2]) < 15.1, after)
        self.assertEqual(rows[51], ['# end'])
        self.assertEqual(rows[52], ['q', '', '', '', '', '', '', ''])
        # And back: positions in another CRS, written in the store's CRS.
        back = list(csv.reader(io.StringIO(self.run_ok(
            'sample', self.store, '--points-crs', 'EPSG:4326', '--to-crs', 'EPSG:32633',
            text=''.join(','.join([r[2], r[1]]) + '\n' for r in rows[1:51])))))
        for place, row in zip(places, back):
            self.assertAlmostEqual(float(row[0]), place[0], delta=0.001)
            self.assertAlmostEqual(float(row[1]), place[1], delta=0.001)

    def profile(self, *args):
        out = self.run_ok('profile', self.store, '-o', '-', *args)
        return [(float(r['distance']), float(r['x']), float(r['y']),
                 float(r['height']) if r['height'] else math.nan)
                for r in csv.DictReader(io.StringIO(out))]

    @unittest.skipIf(SCIPY is None, 'SciPy is not installed')
    def test_a_profile_without_step_follows_the_surface(self):
        line = (500100, 5200100, 501800, 5201300)
        rows = self.profile('--line', ','.join(map(str, line)))
        # About the square root of the number of points, three edges each.
        self.assertGreater(len(rows), 100)
        self.assertEqual(rows[0][:3], (0, line[0], line[1]))
        self.assertTrue(all(a[0] < b[0] for a, b in zip(rows, rows[1:])))
        heights = self.scipy_heights(self.points, [r[1:3] for r in rows])
        for row, height in zip(rows, heights):
            self.assertAlmostEqual(row[3], height, delta=1e-4)
        # Straight between the rows.
        middles = [((a[1] + b[1]) / 2, (a[2] + b[2]) / 2) for a, b in zip(rows, rows[1:])]
        heights = self.scipy_heights(self.points, middles)
        for a, b, height in zip(rows, rows[1:], heights):
            self.assertAlmostEqual((a[3] + b[3]) / 2, height, delta=1e-4)

    def test_profiles_end_at_the_hull_and_at_long_edges(self):
        rows = self.profile('--line', '499000,5200700,503000,5200700')
        known = [r for r in rows if not math.isnan(r[3])]
        self.assertTrue(math.isnan(rows[0][3]) and math.isnan(rows[-1][3]))
        self.assertEqual(len(known), len(rows) - 2)
        some = self.profile('--line', '499000,5200700,503000,5200700', '--max-edge', 150)
        self.assertEqual(len(some), len(rows))
        lake = [r for r in some if abs(r[1] - 501000) < 200]
        self.assertTrue(lake and all(math.isnan(r[3]) for r in lake))
        for method in ('natural', 'nearest'):
            other = self.profile('--line', '499000,5200700,503000,5200700', '--method', method)
            self.assertEqual([r[:3] for r in other], [r[:3] for r in rows])

    def test_profiles_with_steps(self):
        rows = self.profile('--line', '500100,5200100,501800,5201300', '--step', 10)
        sampled = self.sample([r[1:3] for r in rows])
        for row, other in zip(rows, sampled):
            self.assertAlmostEqual(row[3], float(other['height']), delta=1e-4)

    def test_coarser_levels_of_rasters_and_errors(self):
        dem, store = self.path('dem.tif'), self.path('dem.terrace')
        self.run_ok('synth', 'dem', '--size', '200x150', '--cell', 30, '--type', 'float32',
                    '-o', dem)
        self.run_ok('build', dem, '-o', store, '--block', 1000)
        out = self.run_ok('points', store, '--level', 1, '-o', self.path('level1.xyz'))
        with open(self.path('level1.xyz')) as file:
            points = [tuple(map(float, line.split()[:3])) for line in file
                      if line.strip() and line[0] not in '#/']
        rows = self.sample([p[:2] for p in points], '--level', 1, store=store)
        for p, row in zip(points, rows):
            self.assertAlmostEqual(float(row['height']), p[2], delta=1e-3)
        for args in (('--max-edge', 5), ('--max-edge', -1), ('--level', 77)):
            result = terrace('sample', store, *args, text='1,2\n')
            self.assertEqual(result.returncode, 2, result.stderr)
        result = terrace('sample', self.store, '--to-crs', 'EPSG:99999', text='1,2\n')
        self.assertIn('99999', result.stderr)

    def test_positions_far_outside_have_no_height(self):
        rows = self.sample([(0, 0), (1e9, 1e9)])
        self.assertEqual([r['height'] for r in rows], ['', ''])

    @unittest.skipIf(DATA is None or SCIPY is None, 'TERRACE_DATA is not set or SciPy is not installed')
    def test_real_lidar(self):
        with open(os.path.join(DATA, 'lidar', 'autzen_trim.las'), 'rb') as file:
            las = file.read()
        offset, = struct.unpack('<I', las[96:100])
        size, count = struct.unpack('<HI', las[105:111])
        scale = struct.unpack('<6d', las[131:179])
        # Returns of one pulse may share x and y, and SciPy does not define which of them counts.
        points = {}
        for i in range(count):
            raw = struct.unpack('<3i', las[offset + i * size:offset + i * size + 12])
            p = tuple(raw[k] * scale[k] + scale[3 + k] for k in range(3))
            points.setdefault(p[:2], []).append(p)
        points = [p[0] for p in points.values() if len(p) == 1]
        self.assertGreater(len(points), 50000)
        cloud, store = self.path('real.xyz'), self.path('real.terrace')
        with open(cloud, 'w') as file:
            for p in points:
                file.write('%.17g %.17g %.17g\n' % p)
        self.run_ok('build', cloud, '-o', store, '--block', 2000)
        low = [min(p[k] for p in points) for k in range(2)]
        high = [max(p[k] for p in points) for k in range(2)]
        rng = random.Random(2)
        places = [tuple(low[k] + rng.random() * (high[k] - low[k]) for k in range(2))
                  for _ in range(3000)]
        expected = self.scipy_heights(points, places)
        rows = self.sample(places, store=store)
        # Coordinates are multiples of 0.01, so sets of four points lie on a circle; either diagonal
        # is valid.
        wrong = sum((row['height'] == '') != math.isnan(height) or
                    (row['height'] != '' and abs(float(row['height']) - height) > 1e-4)
                    for row, height in zip(rows, expected))
        self.assertLess(wrong, 15)


class NothingSelectedTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def build(self, lines):
        store, text = self.path('s.terrace'), self.path('s.xyz')
        with open(text, 'w') as file:
            file.writelines(lines)
        result = terrace('build', text, '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        return store

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def test_an_empty_selection_is_an_error(self):
        store = self.build(f'{x} {y} {x * y % 7}\n' for x in range(20) for y in range(20))
        extent = 'have x from 0 to 19, y from 0 to 19, z from 0 to 6'
        region, where = ['--region', '50,50,60,60'], ['--where', 'z < 0']
        for options in (region, where, [*where, '--near', '1,1', '-k', '3']):
            result = terrace('points', store, *options, '-o', self.path('none.csv'), '--force')
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertFalse(os.path.exists(self.path('none.csv')))
            if '--near' not in options:
                self.assertIn(extent, result.stderr)
        for bound in ([], ['--max-error', '1']):
            for options, message in ((region, extent), (where, "no point meets the condition 'z < 0'")):
                result = terrace('mesh', store, *options, *bound, '-o', self.path('none.ply'))
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn(message, result.stderr)
                self.assertFalse(os.path.exists(self.path('none.ply')))

    def test_a_focus_outside_the_points_gives_a_note(self):
        store = self.build(f'{x} {y} {x * y % 7}\n' for x in range(20) for y in range(20))
        note = 'is outside the store and adds no points: they have x from 0 to 19, y from 0 to 19'
        outside, inside = ('--focus', '100,100,110,110:0'), ('--focus', '3,3,9,9:0')
        for verb, out in (('points', 'f.csv'), ('mesh', 'f.ply'), ('render', 'f.png')):
            for options, named in ((outside, '--focus ' + note), ((*inside, *outside), '--focus 2 ' + note), (inside, None)):
                result = terrace(verb, store, *options, '-o', self.path(out), '--force')
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(named or self.path(out), result.stderr)
                self.assertEqual(note in result.stderr, named is not None, result.stderr)

    def test_errors_about_a_focus_name_it(self):
        store = self.build(f'{x} {y} 1\n' for x in range(20) for y in range(20))
        for focus, message in (('1,2,3:0', "the box '1,2,3' has 3 numbers"), ('9,8,7,6:0', "the box '9,8,7,6' has a minimum"),
                               ('none.json:0', 'neither a box nor a file'), ('1,2,3,4:x', "'x' is not a level"),
                               ('1,2,3,4', 'names no level'), ('1,2,3,4:99', 'the store has no level 99')):
            for verb, out in (('points', 'none.csv'), ('mesh', 'none.ply'), ('render', 'none.png')):
                result = terrace(verb, store, '--focus', '0,0,1,1:0', '--focus', focus, '-o', self.path(out))
                self.assertIn(result.returncode, (1, 2), result.stderr)
                self.assertIn(f'terrace: --focus {focus}: {message}', result.stderr)

    def test_asking_for_zero_nearest_points_is_an_error(self):
        store = self.build(f'{x} {x} 1\n' for x in range(9))
        result = terrace('points', store, '--near', '1,1', '-k', '0', '-o', self.path('none.csv'))
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn('-k', result.stderr)
        self.assertFalse(os.path.exists(self.path('none.csv')))

    def test_messages_use_the_singular_for_one(self):
        store = self.build(['500000 1 2\n'])
        for args in (('points', '-o', self.path('one.csv')), ('mesh', '-o', self.path('one.ply')), ('info',), ('verify',)):
            result = terrace(args[0], store, *args[1:])
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertNotRegex(result.stdout + result.stderr, r'\b1 (points|vertices|samples|lines|cells|levels|clusters|files)\b')
        result = terrace('convert', self.path('s.xyz'), '-o', self.path('copy.xyz'))
        self.assertIn('1 point', result.stderr)
        result = terrace('points', store, '--near', '1500000,1', '-k', '1', '-o', self.path('near.csv'))
        self.assertNotIn('e+', result.stderr)
        self.assertIn('500000', result.stderr)

    def test_a_mesh_without_triangles_gives_the_reason(self):
        for lines, why in ((['1 2 3\n', '1 2 4\n'], 'all points have the same x and y'),
                           ([f'{i} {2 * i} {i * i}\n' for i in range(9)], 'all points are on one line over x and y')):
            store = self.build(lines)
            result = terrace('mesh', store, '-o', self.path('line.ply'), '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('there are no triangles, because ' + why, result.stderr)
            os.rename(store, store + why.replace(' ', '_'))


if __name__ == '__main__':
    unittest.main()
