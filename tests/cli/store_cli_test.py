#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the verbs on stores end to end: build, info, verify, points, mesh.

TERRACE=path/to/terrace store_cli_test.py
"""

import filecmp
import itertools
import collections
import json
import math
import os
import random
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

from small_tiff import utm, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
SIZE = 600


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


class StoreTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dem = cls.path('dem.tif')
        cls.store = cls.path('dem.terrace')
        cls.run_ok('synth', 'dem', '--size', f'{SIZE}x{SIZE}', '-o', cls.dem)
        cls.run_ok('build', cls.dem, '-o', cls.store, '--block', 3000)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def run_ok(*args):
        result = terrace(*args)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def files(self, store):
        return sorted(os.listdir(store))

    def expect_error(self, code, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def test_build_reports_the_keys_of_the_contract_and_stays_within_memory(self):
        store = self.path('keys.terrace')
        summary = json.loads(self.run_ok('build', self.dem, '-o', store, '--json', '--memory', '200M'))
        self.assertEqual(set(summary), {'points', 'nodata', 'excluded', 'lost', 'outliers', 'empty_values',
                                        'withheld', 'seconds', 'points_per_second', 'peak_rss_bytes', 'store_points', 'store_bytes', 'levels', 'reordered',
                                        'spread', 'temporary_bytes'})
        self.assertEqual(summary['points'], SIZE * SIZE)
        self.assertLessEqual(summary['peak_rss_bytes'], 200 << 20)
        self.assertEqual(summary['store_bytes'],
                         sum(os.path.getsize(os.path.join(store, f)) for f in self.files(store)))

    def test_threads_and_memory_do_not_change_a_byte(self):
        for i, options in enumerate([('--threads', 1), ('--threads', 2, '--memory', '1G'),
                                     ('--threads', 5, '--memory', '190M')]):
            store = self.path(f'same{i}.terrace')
            self.run_ok('build', self.dem, '-o', store, '--block', 3000, *options)
            self.assertEqual(self.files(store), self.files(self.store))
            self.assertEqual(filecmp.cmpfiles(store, self.store, self.files(store), shallow=False)[1:],
                             ([], []))

    def test_an_existing_store_is_replaced_only_with_force(self):
        store = self.path('again.terrace')
        self.run_ok('build', self.dem, '-o', store)
        self.assertIn('--force', self.expect_error(1, 'build', self.dem, '-o', store))
        self.run_ok('build', self.dem, '-o', store, '--force')

    def test_force_keeps_files_that_terrace_did_not_write(self):
        folder = self.path('mine')
        os.mkdir(folder)
        open(os.path.join(folder, 'letter.txt'), 'w').close()
        self.expect_error(1, 'build', self.dem, '-o', folder, '--force')
        self.assertEqual(os.listdir(folder), ['letter.txt'])

    def test_a_dry_run_writes_nothing(self):
        before = sorted(os.listdir(self.folder.name))
        summary = json.loads(self.run_ok('build', self.dem, '-o', self.path('dry.terrace'),
                                         '--dry-run', '--json'))
        self.assertEqual(summary['points'], SIZE * SIZE)
        self.assertGreater(summary['store_bytes'], 0)
        self.assertEqual(sorted(os.listdir(self.folder.name)), before)

    def test_info_has_the_keys_of_the_contract(self):
        info = json.loads(self.run_ok('info', self.store, '--json'))
        for key in ('format', 'version', 'points', 'levels', 'bounds', 'crs', 'vertical', 'channels',
                    'parameters', 'bytes'):
            self.assertIn(key, info)
        self.assertEqual(info['levels'][0]['points'], SIZE * SIZE)
        for below, above in zip(info['levels'], info['levels'][1:]):
            self.assertEqual(above['points'], below['clusters'])
        self.assertEqual(info['crs']['epsg'], 32632)

    def test_verify_finds_a_flipped_bit(self):
        store = self.path('flipped.terrace')
        self.run_ok('build', self.dem, '-o', store)
        self.assertTrue(json.loads(self.run_ok('verify', store, '--json'))['ok'])
        name = os.path.join(store, 'level-0.0.clusters')
        with open(name, 'r+b') as file:
            file.seek(os.path.getsize(name) // 2)
            byte = file.read(1)[0]
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte ^ 4]))
        result = terrace('verify', store, '--json')
        self.assertEqual(result.returncode, 1)
        verdict = json.loads(result.stdout)
        self.assertFalse(verdict['ok'])
        self.assertIn('level-0.0.clusters', verdict['problems'][0]['file'])

    def test_every_verb_rejects_a_store_with_a_wrong_raster_size(self):
        """Points beyond the columns of the manifest, with correct checksums."""
        store = self.path('wrong.terrace')
        shutil.copytree(self.store, store)
        manifest = os.path.join(store, 'manifest.json')
        with open(manifest, encoding='utf-8') as file:
            values = json.load(file)
        values['columns'] = values['rows'] = 40
        values['bounds']['max'][0] = values['bounds']['max'][1] = 39
        values['checksum'] = '00000000'
        text = json.dumps(values, indent=2) + '\n'
        checksum = '%08x' % zlib.crc32(text.encode())
        with open(manifest, 'w', encoding='utf-8') as file:
            file.write(text.replace('"checksum": "00000000"', f'"checksum": "{checksum}"'))
        out = self.path('wrong')
        for verb in (('tile', '--vertical', 'ignore'),
                     ('tile', '--vertical', 'ignore', '--fill', 'flat'),
                     ('points', '--format', 'csv'), ('mesh', '--format', 'ply'), ('mesh', '--format', 'ply', '--max-error', 5),
                     ('raster',), ('contour', '--interval', 50)):
            output = out + {'tile': '', 'raster': '.tif', 'contour': '.geojson'}.get(verb[0], '.out')
            error = self.expect_error(1, *verb, store, '-o', output, '-q')
            self.assertIn('outside the bounds of the store', error, verb)
            self.assertFalse(os.path.exists(output), verb)
        result = terrace('verify', store)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('outside the bounds of the store', result.stdout + result.stderr)

    def test_points_of_every_level_match_the_counts_of_info(self):
        for level in json.loads(self.run_ok('info', self.store, '--json'))['levels']:
            out = self.path(f'level{level["level"]}.xyz')
            self.run_ok('points', self.store, '--level', level['level'], '-o', out)
            with open(out) as file:
                self.assertEqual(sum(1 for _ in file), level['points'])

    def test_a_region_selects_the_points_inside(self):
        low = json.loads(self.run_ok('info', self.store, '--json'))['bounds']['min']
        box = [low[0] + 300, low[1] + 600, low[0] + 1200, low[1] + 1800]
        text = self.run_ok('points', self.store, '--region', ','.join(map(str, box)), '-o', '-')
        points = [tuple(map(float, line.split())) for line in text.splitlines()]
        self.assertEqual(len(points), 31 * 41)
        for x, y, _ in points:
            self.assertTrue(box[0] <= x <= box[2] and box[1] <= y <= box[3])

    def test_points_near_a_position(self):
        low = json.loads(self.run_ok('info', self.store, '--json'))['bounds']['min']
        x, y = low[0] + 1234, low[1] + 777
        everything = [tuple(map(float, line.split()))
                      for line in self.run_ok('points', self.store, '-o', '-').splitlines()]

        def numbers(*args):
            return [tuple(map(float, row.split())) for row in self.run_ok(*args).splitlines()]

        flat = sorted(math.hypot(p[0] - x, p[1] - y) for p in everything)
        found = numbers('points', self.store, '-o', '-', '--near', f'{x},{y}', '-k', 20)
        self.assertEqual([row[3] for row in found], sorted(row[3] for row in found))
        scale = found[-1][3] / flat[19]
        self.assertAlmostEqual(scale, 1, delta=2e-3)  # metres on the ground, not of the projection
        for row, distance in zip(found, flat):
            self.assertIn(row[:3], everything)
            self.assertAlmostEqual(row[3], scale * distance, delta=1e-6)
        within = numbers('points', self.store, '-o', '-', '--near', f'{x},{y}', '--within', 100)
        self.assertEqual(len(within), sum(scale * distance <= 100 for distance in flat))
        z = everything[0][2]
        deep = numbers('points', self.store, '-o', '-', '--near', f'{x},{y},{z}', '-k', 3)
        self.assertAlmostEqual(deep[0][3], min(
            math.hypot(scale * math.hypot(p[0] - x, p[1] - y), p[2] - z) for p in everything),
            delta=1e-6)
        for place, said in ((f'{x},{y}', False), ('11,46.5', True)):
            result = terrace('points', self.store, '-o', '-', '--near', place, '-k', 1)
            self.assertEqual(result.returncode, 0)
            self.assertEqual('outside the store' in result.stderr, said, result.stderr)
        for wrong in (['--near', f'{x},{y}'], ['--near', f'{x}', '-k', 2], ['--near', f'{x},{y}', '-k', 0],
                      ['--near', f'{x},{y}', '-k', 2, '--within', 3],
                      ['--near', f'{x},{y}', '--within', -1], ['-k', 2], ['--within', 2],
                      ['--near', f'{x},{y}', '-k', 2, '--region', '0,0,1,1']):
            self.expect_error(2, 'points', self.store, '-o', '-', *wrong)

    def test_points_of_clusters(self):
        def lines(*args):
            return sorted(self.run_ok('points', self.store, '-o', '-', *args).splitlines())

        level = json.loads(self.run_ok('info', self.store, '--json'))['levels'][1]
        clusters = [lines('--cluster', f'1:{n}') for n in range(level['clusters'])]
        self.assertEqual(sorted(sum(clusters, [])), lines('--level', 1))
        below = sorted(self.run_ok('points', self.store, '-o', '-', '--cluster', '1:0', '--level', 0).splitlines())
        self.assertLess(set(clusters[0]), set(below))
        self.assertLess(set(below), set(lines()))
        for wrong in ('1', '1:x', 'x:1', '1:-1', '1:2:3', f'1:{level["clusters"]}', '77:0', '300:0'):
            self.expect_error(2, 'points', self.store, '-o', '-', '--cluster', wrong)
        self.expect_error(2, 'points', self.store, '-o', '-', '--cluster', '0:0', '--level', 1)
        self.expect_error(2, 'points', self.store, '-o', '-', '--cluster', '0:0', '--region', '0,0,1,1')

    def test_mesh_of_a_cluster(self):
        """The vertices are the points of the cluster, and the triangles cover their hull."""
        for cluster, *args in ('1:0',), ('1:0', '--level', 0), ('0:3',):
            out = self.path('cluster.obj')
            summary = json.loads(self.run_ok('mesh', self.store, '--cluster', cluster, *args, '-o', out, '--json', '--force'))
            points = {tuple(map(float, line.split()[:3]))
                      for line in self.run_ok('points', self.store, '--cluster', cluster, *args, '-o', '-').splitlines()}
            with open(out) as file:
                lines = [line.split() for line in file]
            vertices = [tuple(map(float, line[1:4])) for line in lines if line and line[0] == 'v']
            self.assertEqual(len(vertices), summary['vertices'])
            self.assertEqual(len(vertices), len(points))
            for got, expected in zip(sorted(vertices), sorted(points)):
                for a, b in zip(got, expected):
                    self.assertAlmostEqual(a, b, delta=1e-6 * max(1, abs(b)))
            self.assertGreater(summary['triangles'], 0)
            self.assertLess(summary['triangles'], 2 * len(vertices))
        for cluster, *args in (('77:0',), ('0:0', '--level', 1), ('0:0', '--region', '0,0,1,1'),
                               ('0:0', '--max-error', 1), ('0:0', '--smooth', 'laplacian')):
            self.expect_error(2, 'mesh', self.store, '-o', self.path('wrong.ply'), '--cluster', cluster, *args)

    def test_mesh_in_every_format(self):
        for ending in ('ply', 'obj', 'glb'):
            out = self.path(f'mesh.{ending}')
            summary = json.loads(self.run_ok('mesh', self.store, '--level', 'top', '-o', out, '--json'))
            self.assertEqual(set(summary), {'vertices', 'triangles', 'seconds', 'peak_rss_bytes'})
            self.assertGreater(summary['triangles'], summary['vertices'])
            self.assertGreater(os.path.getsize(out), 100)
            self.assertEqual(json.loads(self.run_ok('info', out, '--json'))['points'], summary['vertices'])
            drawn = self.run_ok('render', out, '-o', self.path(f'{ending}.png'), '--size', '64x48', '--json')
            self.assertEqual(json.loads(drawn)['triangles'], summary['triangles'])

    def heights(self, *options):
        """Heights by position of the mesh made with these options."""
        out = self.path('heights.obj')
        self.run_ok('mesh', self.store, '-o', out, '--force', *options)
        with open(out) as file:
            vertices = [line.split()[1:4] for line in file if line.startswith('v ')]
        return {(x, y): float(z) for x, y, z in vertices}

    def test_smoothing_changes_only_heights(self):
        def roughness(heights):
            values = [heights[place] for place in sorted(heights)]
            return sum((a - b) ** 2 for a, b in zip(values, values[1:]))

        raw = self.heights()
        for method in ('laplacian', 'taubin:5', 'bilateral:3'):
            smooth = self.heights('--smooth', method)
            self.assertEqual(smooth.keys(), raw.keys())
            self.assertLess(roughness(smooth), roughness(raw))
        low, high = min(raw.values()), max(raw.values())
        flat = self.heights('--smooth', 'laplacian:50')
        self.assertTrue(all(low <= z <= high for z in flat.values()))
        # Only inside the region, whose border stays fixed.
        xs, ys = sorted({float(x) for x, _ in raw}), sorted({float(y) for _, y in raw})
        box = (xs[len(xs) // 4], ys[len(ys) // 4], xs[len(xs) // 2], ys[len(ys) // 2])
        part = self.heights('--region', ','.join(map(str, box)), '--smooth', 'laplacian')
        moved = {place for place, z in part.items() if z != raw[place]}
        self.assertGreater(len(moved), len(part) // 2)
        for x, y in moved:
            self.assertTrue(box[0] < float(x) < box[2] and box[1] < float(y) < box[3], (x, y, box))
        self.expect_error(2, 'mesh', self.store, '-o', self.path('none.ply'), '--smooth', 'best')
        self.expect_error(2, 'mesh', self.store, '-o', self.path('none.ply'), '--smooth', 'taubin:0')

    def triangles(self, *options):
        out = self.path('triangles.obj')
        self.run_ok('mesh', self.store, '--level', 1, '-o', out, '--force', *options)
        with open(out) as file:
            lines = [line.split() for line in file]
        vertices = [tuple(map(float, line[1:3])) for line in lines if line[:1] == ['v']]
        return {frozenset(vertices[int(word.split('/')[0]) - 1] for word in line[1:4])
                for line in lines if line[:1] == ['f']}

    def test_an_elliptical_metric_changes_triangles_only_inside_its_region(self):
        plain = self.triangles()
        xs = sorted(x for triangle in plain for x, _ in triangle)
        ys = sorted(y for triangle in plain for _, y in triangle)
        box = [xs[len(xs) // 4], ys[len(ys) // 4], xs[3 * len(xs) // 4], ys[3 * len(ys) // 4]]
        regions = self.path('regions.json')
        with open(regions, 'w') as file:
            json.dump({'regions': [{'box': box, 'semi_axes': [6, 1], 'angle': 30}]}, file)
        slanted = self.triangles('--metric', f'elliptical:{regions}')
        self.assertEqual(len(slanted), len(plain))
        inside = lambda point: box[0] <= point[0] <= box[2] and box[1] <= point[1] <= box[3]
        changed = slanted - plain
        self.assertGreater(len(changed), len(plain) // 20)
        self.assertTrue(all(inside(point) for triangle in changed for point in triangle))

        def east(triangles):
            """Alignment of edges with 30 degrees from +x: the mean cosine of the doubled angle."""
            turns = [math.cos(2 * (math.atan2(q[1] - p[1], q[0] - p[0]) - math.radians(30)))
                     for triangle in triangles for p, q in itertools.combinations(triangle, 2)]
            return sum(turns) / len(turns)

        self.assertGreater(east(changed), east(plain - slanted) + 0.3)
        self.expect_error(2, 'mesh', self.store, '-o', self.path('none.ply'), '--metric', 'squared')

    @staticmethod
    def count_by_side(points, middle, half):
        """Returns the numbers of points in strips along the four sides of a box, {(side, 'in' or 'out'): number}."""
        count = collections.Counter()
        for x, y in points:
            offset = [(x - middle[0]) / half, (y - middle[1]) / half]
            distance = max(map(abs, offset))
            axis = 0 if abs(offset[0]) == distance else 1
            side = (axis, offset[axis] > 0)
            if 0.81 < distance < 0.99:
                count[side, 'in'] += 1
            elif 1.08 < distance < 1.25:
                count[side, 'out'] += 1
        return count

    def level_1(self, name, metric):
        """Builds a store of the raster `name` with a metric. Returns the positions of level 1."""
        store = self.path(f'{name}.terrace')
        self.run_ok('build', self.path(f'{name}.tif'), '-o', store, '--force', '--metric', metric,
                    '--facility-cost', 0.1, '--z-weight', 0)
        text = self.run_ok('points', store, '--level', 1, '-o', '-')
        return {tuple(map(float, line.split()[:2])) for line in text.splitlines()}

    def test_a_metric_affects_clusters_only_in_its_boxes_of_the_crs(self):
        """For a projection whose scale depends on the direction, and for a rotated raster."""
        columns, rows, cell = 500, 500, 2048.0
        noise = random.Random(1)
        heights = [noise.uniform(0, 100) for _ in range(columns * rows)]
        # Lambert's equal-area projection of Europe, 3,000 km off its centre. Lengths that are true
        # along x and y are 3 % longer along one diagonal than along the other.
        laea = {1024: 1, 1025: 1, 3072: 3035}
        rotated = [0.6 * cell, 0.8 * cell, 0, 6.5e6, 0.8 * cell, -0.6 * cell, 0, 2.2e6,
                   0, 0, 0, 0, 0, 0, 0, 1]
        for name, keys, west, north, matrix in (('utm', utm(32), 0, 5.2e6, None),
                                                ('laea', laea, 6.5e6, 2.2e6, None),
                                                ('rotated', laea, 6.5e6, 2.2e6, rotated)):
            with self.subTest(name):
                dem, regions = self.path(f'{name}.tif'), self.path(f'{name}.json')
                if matrix:
                    write_tiff(dem, columns, rows, heights, keys=keys, matrix=matrix)
                else:
                    write_tiff(dem, columns, rows, heights, (west, north), cell, keys)
                # A box in the CRS about a point far from the raster's corner, 160 cells wide.
                m = matrix or [cell, 0, 0, west, 0, -cell, 0, north]
                column = row = 380.8
                middle = (m[0] * column + m[1] * row + m[3], m[4] * column + m[5] * row + m[7])
                half = 80 * cell
                box = [middle[0] - half, middle[1] - half, middle[0] + half, middle[1] + half]
                with open(regions, 'w') as file:
                    json.dump({'regions': [{'box': box, 'semi_axes': [3, 3, 3]}]}, file)
                levels = [self.level_1(name, metric) for metric in ('euclidean', f'elliptical:{regions}')]
                plain, wider = (self.count_by_side(points, middle, half) for points in levels)
                self.assertEqual(len(plain), 8)
                for side, where in plain:
                    share = wider[side, where] / plain[side, where]
                    # A third of the distance gives 3^(-2/3) times as many clusters.
                    if where == 'in':
                        self.assertLess(share, 0.7, side)
                    else:
                        # About 1; a shifted box gives about 0.5 on one side.
                        self.assertGreater(share, 0.75, side)
                # Blocks that do not meet the box are unchanged.
                far = 225 * cell
                outside = [{p for p in points
                            if max(abs(p[0] - middle[0]), abs(p[1] - middle[1])) > far}
                           for points in levels]
                self.assertGreater(len(outside[0]), 3000)
                self.assertEqual(*outside)

    def test_missing_levels_are_usage_errors(self):
        self.assertIn('top', self.expect_error(2, 'mesh', self.store, '--level', 9, '-o',
                                               self.path('none.ply')))
        self.assertFalse(os.path.exists(self.path('none.ply')))

    def test_files_that_are_not_stores_are_errors(self):
        for verb in ('verify', 'info'):
            self.expect_error(1, verb, self.path('nothing'))
        self.expect_error(1, 'mesh', self.dem, '-o', self.path('none.ply'))


class BuildOptionTest(unittest.TestCase):
    """Tests options of build by their effect on the points of the levels."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, points):
        with open(self.path(name), 'w') as file:
            file.writelines(f'{x!r} {y!r} {z!r}\n' for x, y, z in points)
        return self.path(name)

    def build(self, *args, text=None):
        store = self.path(f'{len(os.listdir(self.folder))}.terrace')
        result = subprocess.run([TERRACE, 'build', '-o', store, *map(str, args)], timeout=120,
                                capture_output=True, text=True, input=text)
        self.assertEqual(result.returncode, 0, result.stderr)
        return store

    def points(self, store, level=0):
        result = terrace('points', store, '--level', level, '-o', '-')
        self.assertEqual(result.returncode, 0, result.stderr)
        return [tuple(map(float, line.split()[:3])) for line in result.stdout.splitlines()]

    @staticmethod
    def somewhere(seed, count):
        generator = random.Random(seed)
        return [tuple(generator.uniform(0, 100) for _ in range(3)) for _ in range(count)]

    def shuffled(self, count):
        """Writes a binary PLY of numbered grid positions in random order."""
        side = math.isqrt(count)
        numbers = list(range(side * side))
        random.Random(count).shuffle(numbers)
        with open(self.path('shuffled.ply'), 'wb') as file:
            file.write(b'ply\nformat binary_little_endian 1.0\nelement vertex %d\n'
                       b'property int x\nproperty int y\nproperty float z\nproperty uint number\n'
                       b'end_header\n' % len(numbers))
            pack = struct.Struct('<iifI').pack
            file.writelines(pack(n % side, n // side, n % 7, n) for n in numbers)
        return self.path('shuffled.ply'), side

    def test_unordered_points_are_sorted(self):
        cloud, side = self.shuffled(640000)
        stores, summaries = {}, {}
        for order in ('auto', 'stream', 'spatial'):
            stores[order] = self.path(f'{order}.terrace')
            result = terrace('build', cloud, '-o', stores[order], '--order', order, '--json',
                             '--memory', '200M', '--threads', 1 + len(summaries))
            self.assertEqual(result.returncode, 0, result.stderr)
            summary = summaries[order] = json.loads(result.stdout)
            self.assertEqual(summary['points'], side * side)
            self.assertLess(summary['peak_rss_bytes'], 200 << 20)
            self.assertEqual(summary['reordered'], order != 'stream')
            self.assertEqual('put in spatial order' in result.stderr, order != 'stream')
            self.assertEqual(terrace('verify', stores[order]).returncode, 0)
        self.assertEqual(summaries['stream']['temporary_bytes'], 0)
        self.assertGreater(summaries['auto']['spread'], 2)
        self.assertLessEqual(summaries['auto']['temporary_bytes'], 1.2 * 16 * side * side)
        self.assertLess(summaries['auto']['store_bytes'], summaries['stream']['store_bytes'])
        for name in os.listdir(stores['auto']):
            with open(os.path.join(stores['auto'], name), 'rb') as one, \
                    open(os.path.join(stores['spatial'], name), 'rb') as other:
                self.assertEqual(one.read(), other.read(), name)
        # Every point keeps its number, from a pipe as from the file.
        with open(cloud, 'rb') as file:
            piped = self.path('piped.terrace')
            result = subprocess.run([TERRACE, 'build', '-', '-o', piped], stdin=file,
                                    capture_output=True, timeout=120)
        self.assertEqual(result.returncode, 0, result.stderr)
        result = terrace('points', piped, '-o', '-', '--format', 'xyz')
        rows = sorted((tuple(map(float, line.split())) for line in result.stdout.splitlines()
                       if not line.startswith('#')), key=lambda row: row[3])
        self.assertEqual(rows, [(n % side, n // side, n % 7, n) for n in range(side * side)])

    def test_a_dry_run_reports_the_temporary_disk_space(self):
        cloud, side = self.shuffled(640000)
        result = terrace('build', cloud, '-o', self.path('no.terrace'), '--dry-run', '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreater(json.loads(result.stdout)['temporary_bytes'], 5 * side * side)
        result = terrace('build', cloud, '-o', self.path('no.terrace'), '--dry-run', '--json',
                         '--order', 'stream')
        self.assertEqual(json.loads(result.stdout)['temporary_bytes'], 0)

    def test_more_effort_finds_cheaper_clusters(self):
        cost = dict.fromkeys(('fast', 'default', 'fine', 'full'), 0.0)
        # Two blocks of one town each; blocks below 2500 points are searched exhaustively anyway.
        towns = [self.somewhere(1, 3000), [(x + 1e6, y, z) for x, y, z in self.somewhere(2, 2700)]]
        cloud = self.write('towns.xyz', towns[0] + towns[1])
        for effort in cost:
            store = self.build(cloud, '--effort', effort, '--block', 3000, '--facility-cost', 1)
            chosen = self.points(store, 1)
            for town in towns:
                diagonal = math.dist([min(axis) for axis in zip(*town)],
                                     [max(axis) for axis in zip(*town)])
                near = [p for p in chosen if abs(p[0] - town[0][0]) < 1000]
                cost[effort] += diagonal * len(near)
                cost[effort] += sum(min(math.dist(p, q) for q in near) for p in town)
        self.assertLess(cost['full'], cost['default'])
        self.assertLess(cost['default'], cost['fast'])

    def test_z_weight_scales_the_influence_of_heights(self):
        points = self.somewhere(1, 700)
        mixed = [(x, y, z) for (x, y, _), z in zip(points, reversed([p[2] for p in points]))]
        tall = [(x, y, 2 * z) for x, y, z in points]

        def chosen(cloud, *options):
            store = self.build(self.write('cloud.xyz', cloud), '--block', 400, *options)
            return sorted(p[:2] for p in self.points(store, 1))

        plain = chosen(points)
        self.assertNotEqual(chosen(mixed), plain)
        flat = chosen(points, '--z-weight', 0)
        self.assertNotEqual(flat, plain)
        self.assertEqual(chosen(mixed, '--z-weight', 0), flat)
        self.assertEqual(chosen(tall), chosen(points, '--z-weight', 2))

    def test_the_requested_band_gives_the_heights(self):
        raster = self.path('bands.tif')
        write_tiff(raster, 7, 5, [value for i in range(35) for value in (i, 1000 - i, 7)],
                   kind='h', bands=3, keys=utm(32))
        for options, height in (((), lambda i: i), (('--band', 1), lambda i: i),
                                (('--band', 2), lambda i: 1000 - i), (('--band', 3), lambda i: 7)):
            found = {(x, y): z for x, y, z in self.points(self.build(raster, *options))}
            self.assertEqual(found, {(500015.0 + 30 * (i % 7), 5199985.0 - 30 * (i // 7)): height(i)
                                     for i in range(35)})
        result = terrace('build', raster, '-o', self.path('none'), '--band', 4)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('band', result.stderr)
        points = self.path('no-bands.xyz')
        with open(points, 'w') as file:
            file.write('1 2 3\n')
        result = terrace('build', points, '-o', self.path('none'), '--band', 2)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('leave --band out', result.stderr)

    def test_input_format_names_an_unrecognised_format(self):
        points = self.somewhere(3, 40)
        cloud = self.path('cloud.dat')
        with open(cloud, 'w') as file:
            file.write('# as surveyed\n' * 1000)
            file.writelines(f'{x!r} {y!r} {z!r}\n' for x, y, z in points)
        for verb in ('build', 'convert', 'cluster', 'match'):
            out = self.path('out.terrace' if verb == 'build' else 'out.csv')
            result = terrace(verb, cloud, '-o', out)
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn('format', result.stderr)
            result = terrace(verb, cloud, '-o', out, '--input-format', 'ply')
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertFalse(os.path.exists(out))
            result = terrace(verb, cloud, '-o', out, '--input-format', 'xyz')
            self.assertEqual(result.returncode, 0, result.stderr)
            if verb == 'build':
                self.assertEqual(sorted(self.points(out)), sorted(points))
            else:
                with open(out) as file:
                    self.assertEqual(sum(1 for _ in file), 1 + (20 if verb == 'match' else 40))
                os.remove(out)

    def test_standard_input_gives_the_same_store_as_the_file(self):
        points = self.somewhere(4, 2000)
        cloud = self.write('cloud.xyz', points)
        with open(cloud) as file:
            text = file.read()
        piped, named = self.build('-', '--block', 300, text=text), self.build(cloud, '--block', 300)
        self.assertEqual(sorted(self.points(piped)), sorted(points))
        levels = [name for name in sorted(os.listdir(named)) if name != 'manifest.json']
        self.assertGreaterEqual(len(levels), 4)
        self.assertEqual(filecmp.cmpfiles(piped, named, levels, shallow=False)[1:], ([], []))


if __name__ == '__main__':
    unittest.main()
