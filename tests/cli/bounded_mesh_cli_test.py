#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests error-bounded meshes end to end and checks every sample with independent code.

TERRACE=path/to/terrace bounded_mesh_cli_test.py
"""

import array
import collections
import json
import math
import os
import random
import re
import subprocess
import tempfile
import unittest

import small_tiff
from small_tiff import utm

TERRACE = os.environ.get('TERRACE', 'terrace')
CELL, WEST, NORTH = 30.0, 500000.0, 5100000.0
NODATA = -9999.0


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=200)


def write_tiff(path, columns, rows, heights, nodata=True):
    small_tiff.write_tiff(path, columns, rows, heights, (WEST, NORTH), CELL, utm(32),
                          nodata='-9999' if nodata else None)


def read_obj(path):
    vertices, faces = [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if words[:1] == ['v']:
                vertices.append(tuple(map(float, words[1:4])))
            elif words[:1] == ['f']:
                faces.append([int(word.split('/')[0]) - 1 for word in words[1:4]])
    return vertices, faces


def read_glb(path):
    """Vertices and faces of the single mesh in a GLB file of terrace, with z up."""
    with open(path, 'rb') as file:
        data = file.read()
    size = int.from_bytes(data[12:16], 'little')
    head, body = json.loads(data[20:20 + size]), data[28 + size:]
    east, up, south = head['nodes'][0]['translation']

    def values(number, code, per_item):
        accessor = head['accessors'][number]
        begin = head['bufferViews'][accessor['bufferView']].get('byteOffset', 0)
        flat = array.array(code, body[begin:begin + 4 * per_item * accessor['count']])
        return [flat[i:i + per_item] for i in range(0, len(flat), per_item)]
    primitive = head['meshes'][0]['primitives'][0]
    vertices = [(x + east, -(z + south), y + up)
                for x, y, z in values(primitive['attributes']['POSITION'], 'f', 3)]
    corners = [c[0] for c in values(primitive['indices'], 'I', 1)]
    return vertices, [corners[i:i + 3] for i in range(0, len(corners), 3)]


class Raster:
    """Samples of a raster, and an exact check of meshes against them in integers."""

    def __init__(self, columns, rows, heights):
        self.columns, self.rows = columns, rows
        self.heights = array.array('f', heights)

    def valid(self, column, row):
        return self.heights[row * self.columns + column] != NODATA

    def inner(self, column, row):
        """True if a sample and its neighbours have data."""
        return all(self.valid(c, r)
                   for r in range(max(row - 1, 0), min(row + 2, self.rows))
                   for c in range(max(column - 1, 0), min(column + 2, self.columns)))

    def measure(self, vertices, faces):
        """Returns the largest error, the number of inner samples that no triangle covers, and twice the
        area. Fails if a triangle covers a sample without data, or if triangles overlap or are turned."""
        places = []
        for x, y, z in vertices:
            column, row = (x - WEST) / CELL - 0.5, (NORTH - y) / CELL - 0.5
            assert abs(column - round(column)) < 1e-6 and abs(row - round(row)) < 1e-6
            places.append((round(column), round(row), z))
        largest, twice_area, covered = 0.0, 0, bytearray(self.columns * self.rows)
        box = [math.inf, math.inf, -math.inf, -math.inf]
        for face in faces:
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (places[v] for v in face)
            # Rows grow southward, so counter-clockwise triangles on the ground have a clockwise
            # order here.
            area = (cx - ax) * (by - ay) - (bx - ax) * (cy - ay)
            assert area > 0, 'a triangle is degenerate or turned'
            twice_area += area
            for row in range(min(ay, by, cy), max(ay, by, cy) + 1):
                for column in range(min(ax, bx, cx), max(ax, bx, cx) + 1):
                    u = (cx - bx) * (row - by) - (column - bx) * (cy - by)
                    v = (ax - cx) * (row - cy) - (column - cx) * (ay - cy)
                    w = (bx - ax) * (row - ay) - (column - ax) * (by - ay)
                    if u > 0 or v > 0 or w > 0:
                        continue
                    assert self.valid(column, row), f'covers nodata at {column},{row}'
                    place = row * self.columns + column
                    covered[place] = 1
                    height = -(u * az + v * bz + w * cz) / area
                    largest = max(largest, abs(height - self.heights[place]))
        for x, y, _ in places:
            box = [min(box[0], x), min(box[1], y), max(box[2], x), max(box[3], y)]
        self.covered = covered
        missed = sum(1 for row in range(self.rows) for column in range(self.columns)
                     if not covered[row * self.columns + column] and self.inner(column, row))
        return largest, missed, twice_area


def border_edges(faces):
    edges = collections.Counter()
    for face in faces:
        for k in range(3):
            edges[face[k], face[(k + 1) % 3]] += 1
    assert max(edges.values()) == 1, 'an edge has two triangles on one side'
    return [edge for edge in edges if edge[::-1] not in edges]


def hills(columns, rows, seed):
    """Heights of waves and noise with a flat lake."""
    noise = random.Random(seed)
    heights = []
    for row in range(rows):
        for column in range(columns):
            z = 200 + 120 * math.sin(column / 37) * math.cos(row / 53) + noise.uniform(-2, 2)
            heights.append(max(z, 180.0))
    return heights


class BoundedMeshTest(unittest.TestCase):
    COLUMNS, ROWS = 1100, 800  # four windows

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.raster = Raster(cls.COLUMNS, cls.ROWS, hills(cls.COLUMNS, cls.ROWS, 1))
        write_tiff(cls.path('dem.tif'), cls.COLUMNS, cls.ROWS, cls.raster.heights)
        cls.store = cls.build('dem.tif')

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @classmethod
    def build(cls, name):
        store = cls.path(name.rsplit('.', 1)[0] + '.terrace')
        result = terrace('build', cls.path(name), '-o', store)
        assert result.returncode == 0, result.stderr
        return store

    def mesh(self, store, name, *options):
        out = self.path(name)
        result = terrace('mesh', store, '-o', out, '--json', '--force', *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), out

    def refuse(self, code, text, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn(text, result.stderr)

    def test_every_sample_is_within_the_bound(self):
        counts = {}
        for quality in ('greedy', 'removal', 'fitted'):
            with self.subTest(quality):
                summary, out = self.mesh(self.store, f'{quality}.obj', '--max-error', 3,
                                         '--quality', quality)
                vertices, faces = read_obj(out)
                self.assertEqual((summary['vertices'], summary['triangles']),
                                 (len(vertices), len(faces)))
                self.assertEqual(summary['samples'], self.COLUMNS * self.ROWS)
                largest, missed, twice_area = self.raster.measure(vertices, faces)
                self.assertLessEqual(largest, 3 * (1 + 1e-9))
                self.assertAlmostEqual(summary['max_error'], largest, places=6)
                self.assertGreater(summary['rms_error'], 0)
                self.assertLess(summary['rms_error'], largest)
                self.assertEqual(missed, 0)
                self.assertEqual(twice_area, 2 * (self.COLUMNS - 1) * (self.ROWS - 1))
                # One piece without cracks has only the raster's border.
                for a, b in border_edges(faces):
                    x = {vertices[a][0], vertices[b][0]}
                    y = {vertices[a][1], vertices[b][1]}
                    self.assertTrue(len(x) == 1 or len(y) == 1)
                    place = (min(x) - WEST) / CELL if len(x) == 1 else (NORTH - min(y)) / CELL
                    ends = (0.5, (self.COLUMNS if len(x) == 1 else self.ROWS) - 0.5)
                    self.assertIn(place, ends)
                counts[quality] = len(faces)
        self.assertLess(counts['removal'], 0.85 * counts['greedy'])
        self.assertLess(counts['fitted'], counts['removal'])

    def test_bytes_do_not_depend_on_threads_and_memory(self):
        texts = set()
        for threads, memory in ((1, '1G'), (2, '4G'), (5, '400M')):
            _, out = self.mesh(self.store, 'same.ply', '--max-error', 2, '--threads', threads,
                               '--memory', memory)
            with open(out, 'rb') as file:
                texts.add(file.read())
        self.assertEqual(len(texts), 1)
        self.assertEqual(sorted(name for name in os.listdir(self.folder.name) if 'tmp' in name), [])

    def test_max_points_is_a_limit_that_is_used(self):
        summary, out = self.mesh(self.store, 'few.obj', '--max-points', '5k')
        vertices, faces = read_obj(out)
        self.assertLessEqual(len(vertices), 5000)
        self.assertGreater(len(vertices), 4000)
        largest, missed, _ = self.raster.measure(vertices, faces)
        self.assertAlmostEqual(summary['max_error'], largest, places=6)
        self.assertEqual(missed, 0)
        summary, _ = self.mesh(self.store, 'few.obj', '--max-points', 4)
        self.assertEqual(summary['vertices'], 4)

    def test_a_region_is_covered(self):
        box = [WEST + 200.3 * CELL, NORTH - 500.2 * CELL, WEST + 700.9 * CELL, NORTH - 300.4 * CELL]
        summary, out = self.mesh(self.store, 'part.obj', '--max-error', 3, '--region',
                                 ','.join(map(str, box)))
        vertices, faces = read_obj(out)
        largest, _, twice_area = self.raster.measure(vertices, faces)
        self.assertLessEqual(largest, 3)
        self.assertGreaterEqual(twice_area / 2, 500 * 199)
        self.assertLess(summary['samples'], 510 * 210)
        xs, ys = [v[0] for v in vertices], [v[1] for v in vertices]
        self.assertTrue(min(xs) <= box[0] and max(xs) >= box[2])
        self.assertTrue(min(ys) <= box[1] and max(ys) >= box[3])
        self.refuse(2, '--region', 'mesh', self.store, '-o', self.path('none.obj'),
                    '--max-error', 3, '--region', '0,0,1,1')

    def test_glb_keeps_the_bound_after_rounding(self):
        summary, _ = self.mesh(self.store, 'mesh.glb', '--max-error', 3)
        self.assertLessEqual(summary['max_error'], 3)
        self.refuse(1, 'write PLY', 'mesh', self.store, '-o', self.path('fine.glb'),
                    '--max-error', '1e-7')

    def test_holes_stay_open(self):
        columns, rows = 640, 560
        heights = hills(columns, rows, 2)
        noise = random.Random(3)
        for row in range(rows):
            for column in range(columns):
                island = math.hypot(column - 300, row - 250) < 60
                sea = math.hypot(column - 320, row - 260) < 150 + 8 * math.sin(row / 5)
                if (sea and not island) or noise.random() < 0.0005:
                    heights[row * columns + column] = NODATA
        raster = Raster(columns, rows, heights)
        write_tiff(self.path('sea.tif'), columns, rows, heights)
        store = self.build('sea.tif')
        for quality in ('greedy', 'removal', 'fitted'):
            with self.subTest(quality):
                summary, out = self.mesh(store, 'sea.obj', '--max-error', 4, '--quality', quality)
                largest, missed, _ = raster.measure(*read_obj(out))
                self.assertLessEqual(largest, 4 * (1 + 1e-9))
                self.assertEqual(missed, 0)
                self.assertEqual(summary['samples'], columns * rows - heights.count(NODATA))
                self.assertEqual(summary['covered'], sum(raster.covered))
                self.assertEqual(summary['covered'] + summary['uncovered'], summary['samples'])
        # The shores need many points for any error.
        refused = terrace('mesh', store, '-o', self.path('none.obj'), '--max-points', 9)
        self.assertEqual(refused.returncode, 1)
        said = re.search(r'--max-points 9 is too few: .* takes (\d+); .*--fill', refused.stderr)
        self.assertIsNotNone(said, refused.stderr)
        self.assertFalse(os.path.exists(self.path('none.obj')))
        summary, _ = self.mesh(store, 'least.obj', '--max-points', said[1])
        self.assertLessEqual(summary['vertices'], int(said[1]))
        for fill in ('flat', 'interpolate'):
            with self.subTest(fill):
                summary, out = self.mesh(store, 'filled.obj', '--max-error', 4, '--fill', fill)
                vertices, faces = read_obj(out)
                self.assertLessEqual(summary['max_error'], 4)
                self.assertEqual((summary['covered'], summary['uncovered']),
                                 (summary['samples'], 0))
                area = sum((vertices[b][0] - vertices[a][0]) * (vertices[c][1] - vertices[a][1]) -
                           (vertices[c][0] - vertices[a][0]) * (vertices[b][1] - vertices[a][1])
                           for a, b, c in faces) / 2
                self.assertAlmostEqual(area, (columns - 1) * (rows - 1) * CELL ** 2, delta=1)
                low, high = min(v[2] for v in vertices), max(v[2] for v in vertices)
                self.assertGreaterEqual(low, 179)
                self.assertLessEqual(high, 330)

    def test_uncovered_samples_are_counted_and_reported(self):
        """Next to voids, also on the sides of windows, and with a polygon as the region."""
        noise = random.Random(6)
        heights = list(self.raster.heights)
        for row in range(self.ROWS):
            for column in range(self.COLUMNS):
                # The windows share sides near the middle.
                near = min(abs(column - self.COLUMNS // 2), abs(row - self.ROWS // 2)) < 4
                hole = math.hypot(column - 300, row - 200) < 90
                if noise.random() < (0.3 if near else 0.0005) or hole:
                    heights[row * self.COLUMNS + column] = NODATA
        raster = Raster(self.COLUMNS, self.ROWS, heights)
        write_tiff(self.path('holes.tif'), self.COLUMNS, self.ROWS, heights)
        store = self.build('holes.tif')
        out = self.path('holes.obj')
        summary, _ = self.mesh(store, 'holes.obj', '--max-error', 3)
        raster.measure(*read_obj(out))
        self.assertEqual(summary['samples'], len(heights) - heights.count(NODATA))
        self.assertEqual(summary['covered'], sum(raster.covered))
        self.assertEqual(summary['covered'] + summary['uncovered'], summary['samples'])
        self.assertGreater(summary['uncovered'], 1000)
        text = terrace('mesh', store, '-o', out, '--max-error', 3, '--force').stderr
        self.assertIn(f"of {summary['covered']:,} of {summary['samples']:,} samples", text)
        self.assertIn(f"{summary['uncovered']:,} samples are on no triangle", text)
        self.assertNotIn('of all', text)

        triangle = [(100.25, 90.25), (1000.25, 300.25), (350.25, 700.25)]  # columns and rows
        ring = [[WEST + (c + 0.5) * CELL, NORTH - (r + 0.5) * CELL] for c, r in triangle]
        with open(self.path('part.geojson'), 'w') as file:
            json.dump({'type': 'Polygon', 'coordinates': [ring + ring[:1]]}, file)
        summary, _ = self.mesh(store, 'holes.obj', '--max-error', 3, '--region',
                               self.path('part.geojson'))
        raster.measure(*read_obj(out))
        inside = set()
        for row in range(self.ROWS):
            for column in range(self.COLUMNS):
                # Exact. Regions are closed, and ten samples are on a side.
                turns = [(bx - ax) * (row - ay) - (column - ax) * (by - ay)
                         for (ax, ay), (bx, by) in zip(triangle, triangle[1:] + triangle[:1])]
                within = min(turns) >= 0 or max(turns) <= 0
                if within and raster.valid(column, row):
                    inside.add(row * self.COLUMNS + column)
        self.assertEqual(summary['samples'], len(inside))
        self.assertEqual(summary['covered'], sum(raster.covered[i] for i in inside))
        self.assertEqual(summary['uncovered'], len(inside) - summary['covered'])
        self.assertGreater(summary['uncovered'], 100)

    @staticmethod
    def pulses():
        """Returns points as in laser data: some positions have several samples, up to 0.7 m apart."""
        noise = random.Random(7)
        points = []
        for _ in range(3000):
            x, y = noise.randrange(4000) / 10, noise.randrange(3000) / 10
            z = 20 * math.sin(x / 60) * math.cos(y / 50)
            points.append((x, y, z))
            if noise.random() < 0.3:
                points.extend((x, y, z + noise.uniform(0, 0.7)) for _ in range(noise.randrange(3)))
        return points

    def build_points(self, name, points):
        with open(self.path(name + '.xyz'), 'w') as file:
            file.writelines(f'{x!r} {y!r} {z!r}\n' for x, y, z in points)
        return self.build(name + '.xyz')

    @staticmethod
    def largest_error(points, vertices, faces):
        """Returns the largest vertical distance of points from a mesh, and the number of points on it."""
        largest, covered = 0.0, 0
        for x, y, z in points:
            for a, b, c in faces:
                (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
                u = (bx - x) * (cy - y) - (cx - x) * (by - y)
                v = (cx - x) * (ay - y) - (ax - x) * (cy - y)
                w = (ax - x) * (by - y) - (bx - x) * (ay - y)
                if u >= -1e-9 and v >= -1e-9 and w >= -1e-9:
                    covered += 1
                    largest = max(largest, abs((u * az + v * bz + w * cz) / (u + v + w) - z))
                    break
        return largest, covered

    def test_each_of_several_samples_at_one_position_is_within_the_bound(self):
        points = self.pulses()
        store = self.build_points('pulses', points)
        summary, out = self.mesh(store, 'pulses.obj', '--max-error', 1)
        largest, covered = self.largest_error(points, *read_obj(out))
        self.assertEqual((summary['samples'], covered), (len(points), len(points)))
        self.assertEqual((summary['covered'], summary['uncovered']), (covered, 0))
        self.assertEqual(summary['duplicates'], len(points) - len({p[:2] for p in points}))
        self.assertLessEqual(largest, 1 + 1e-9)
        self.assertAlmostEqual(summary['max_error'], largest, places=6)
        text = terrace('mesh', store, '-o', out, '--max-error', 1, '--force').stderr
        self.assertIn(f"within {math.ceil(summary['max_error'] * 1000) / 1000:g} m of all "
                      f"{len(points):,} samples", text)
        self.assertIn(f"{summary['duplicates']:,} samples share the place of another: the bound "
                      "holds for each", text)
        # GLB rounds, which must not affect the check.
        self.assertLessEqual(self.mesh(store, 'pulses.glb', '--max-error', 1)[0]['max_error'], 1)
        text = terrace('mesh', store, '-o', out, '--max-error', 1, '--force', '--duplicates',
                       'max').stderr
        self.assertIn('the bound holds for the highest of each place', text)
        self.assertEqual(self.mesh(store, 'pulses.obj', '--max-points', 200)[0]['uncovered'], 0)
        self.refuse(2, '--max-error', 'mesh', store, '-o', out, '--force', '--max-points', 200,
                    '--duplicates', 'all')

    def test_samples_at_one_position_farther_apart_than_the_bound_need_a_rule(self):
        """The top of a tree and the ground below it."""
        points = self.pulses()
        x, y, z = points[0]
        points.append((x, y, z + 17.25))
        store = self.build_points('tree', points)
        result = terrace('mesh', store, '-o', self.path('tree.obj'), '--max-error', 1)
        self.assertEqual(result.returncode, 1, result.stderr)
        heights = collections.defaultdict(list)
        for *place, height in points:
            heights[tuple(place)].append(height)
        count = sum(1 for values in heights.values() if len(values) > 1)
        self.assertIn(f'{count} places have several samples', result.stderr)
        self.assertRegex(result.stderr, r'differ by up to 1[78]\.?\d* m \(at ')
        self.assertIn('set --duplicates to min, max, mean or first', result.stderr)
        self.assertFalse(os.path.exists(self.path('tree.obj')))

        # The error is measured on the file as readers see it, at the samples that the rule selects.
        for rule, select in (('max', max), ('min', min)):
            summary, out = self.mesh(store, 'tree.glb', '--max-error', 1, '--duplicates', rule)
            selected = [(*place, select(values)) for place, values in heights.items()]
            largest, covered = self.largest_error(selected, *read_glb(out))
            self.assertEqual(covered, summary['covered'] - summary['duplicates'], rule)
            self.assertGreater(covered, 0.98 * len(selected))
            self.assertLessEqual(largest, 1 + 1e-9)
            self.assertAlmostEqual(summary['max_error'], largest, places=6)

    def test_irregular_points(self):
        noise = random.Random(4)
        points = [(noise.uniform(0, 1000), noise.uniform(0, 800)) for _ in range(20000)]
        with open(self.path('points.xyz'), 'w') as file:
            for x, y in points:
                file.write(f'{x} {y} {50 * math.sin(x / 90) * math.cos(y / 70)}\n')
        store = self.build('points.xyz')
        counts = {}
        for quality in ('greedy', 'removal'):
            summary, out = self.mesh(store, 'points.obj', '--max-error', 1, '--quality', quality)
            self.assertLessEqual(summary['max_error'], 1)
            self.assertEqual(summary['samples'], len(points))
            counts[quality] = summary['triangles']
        self.assertLess(counts['removal'], counts['greedy'])
        self.assertLess(counts['greedy'], 10000)
        with open(self.path('points.xyz'), 'a') as file:
            file.write('500 400 10\n500 400 20\n')
        store = self.path('twice.terrace')
        self.assertEqual(terrace('build', self.path('points.xyz'), '-o', store).returncode, 0)
        for duplicates in ((), ('--duplicates', 'error')):
            self.refuse(1, '--duplicates', 'mesh', store, '-o', self.path('twice.obj'),
                        '--max-error', 1, *duplicates)
        summary, _ = self.mesh(store, 'twice.obj', '--max-error', 1, '--duplicates', 'max')
        self.assertEqual(summary['duplicates'], 1)
        self.refuse(2, '--fill', 'mesh', store, '-o', self.path('none.obj'), '--max-error', 1,
                    '--fill', 'flat')

    def test_irregular_points_in_windows(self):
        """More points than fit into one window: out of core, one piece, for any number of threads."""
        noise = random.Random(5)
        columns, rows = 640, 450  # a jittered lattice
        points = array.array('d')
        for row in range(rows):
            for column in range(columns):
                x, y = column + noise.uniform(-0.4, 0.4), row + noise.uniform(-0.4, 0.4)
                points.extend((x, y, 80 * math.sin(x / 61) * math.cos(y / 47) + noise.uniform(-1, 1)))
        count = columns * rows
        with open(self.path('many.ply'), 'wb') as file:
            file.write(b'ply\nformat binary_little_endian 1.0\nelement vertex %d\n' % count +
                       b'property double x\nproperty double y\nproperty double z\nend_header\n')
            file.write(points.tobytes())
        store = self.build('many.ply')
        texts = set()
        for threads, memory in ((1, '256M'), (2, '256M'), (3, '2G')):
            summary, out = self.mesh(store, 'many.obj', '--max-error', 4, '--threads', threads,
                                     '--memory', memory)
            self.assertLessEqual(summary['max_error'], 4)
            self.assertEqual(summary['samples'], count)
            self.assertLess(summary['peak_rss_bytes'], 256 << 20)
            with open(out, 'rb') as file:
                texts.add(file.read())
        self.assertEqual(len(texts), 1)
        vertices, faces = read_obj(out)
        edges = border_edges(faces)
        following = dict(edges)
        self.assertEqual(len(following), len(edges))
        at, around = edges[0][0], 0
        while around == 0 or at != edges[0][0]:
            at, around = following[at], around + 1
        self.assertEqual(around, len(edges))
        area = sum(vertices[a][0] * vertices[b][1] - vertices[b][0] * vertices[a][1]
                   for a, b in edges) / 2
        inside = sum((vertices[b][0] - vertices[a][0]) * (vertices[c][1] - vertices[a][1]) -
                     (vertices[c][0] - vertices[a][0]) * (vertices[b][1] - vertices[a][1])
                     for a, b, c in faces) / 2
        self.assertAlmostEqual(area, inside, delta=1e-6 * area)
        self.refuse(1, '--memory', 'mesh', store, '-o', self.path('none.obj'), '--max-error', 4,
                    '--memory', '40M')
        summary, _ = self.mesh(store, 'many.obj', '--max-points', 2000)
        self.assertLessEqual(summary['vertices'], 2000)
        self.assertGreater(summary['vertices'], 1900)
        left = [name for name in os.listdir(self.folder.name) if 'tmp' in name or 'samples' in name]
        self.assertEqual(left, [])

    def test_a_point_limit_above_the_samples_works_in_formats_that_round(self):
        # No bound was requested, so rounding cannot break it; the summary gives the error that
        # readers see.
        write_tiff(self.path('raster.tif'), 40, 30, hills(40, 30, 2))
        scattered = random.Random(3)
        with open(self.path('cloud.xyz'), 'w', encoding='utf-8') as file:
            file.writelines(f'{scattered.uniform(5e5, 5.1e5)} {scattered.uniform(5e6, 5.1e6)} {scattered.uniform(0, 9)}\n'
                            for _ in range(500))
        for name in ('raster.tif', 'cloud.xyz'):
            with self.subTest(name):
                store = self.build(name)
                samples = self.mesh(store, 'all.ply', '--max-error', 0)[0]['samples']
                exact, _ = self.mesh(store, 'exact.ply', '--max-points', 2 * samples)
                rounded, _ = self.mesh(store, 'rounded.glb', '--max-points', 2 * samples)
                self.assertEqual(exact['max_error'], 0)
                self.assertEqual(rounded['vertices'], exact['vertices'])
                self.assertLess(rounded['max_error'], 1e-3)

    def test_bound_0_allows_rounding_of_heights_in_doubles(self):
        # Errors that are mathematically 0 need not be 0 when computed in doubles.
        slopes = random.Random(4)
        for steep in (1, 1e6):
            heights = [steep * (c * 100 / 3 + r * 700 / 9) if slopes.random() < 0.9 else steep * slopes.uniform(0, 900)
                       for r in range(37) for c in range(53)]
            name = f'slopes{int(steep)}'
            with open(self.path(f'{name}.asc'), 'w', encoding='utf-8') as file:
                file.write('ncols 53\nnrows 37\nxllcorner 0\nyllcorner 0\ncellsize 1\n')
                file.write(' '.join(map(repr, heights)))
            with self.subTest(steep):
                summary, _ = self.mesh(self.build(f'{name}.asc'), f'{name}.ply', '--max-error', 0)
                self.assertLess(summary['max_error'], 1e-10 * steep)
                self.assertLess(summary['vertices'], 53 * 37)

    def test_wrong_usage(self):
        mesh = ('mesh', self.store, '-o', self.path('none.obj'))
        for text, *options in (('not both', '--max-error', 1, '--max-points', 10),
                               ('at least 0', '--max-error', -1),
                               ('not a number', '--max-error', 'nan'),
                               ('at least 4', '--max-points', 3),
                               ('--level', '--max-error', 1, '--level', 1),
                               ('greedy', '--max-error', 1, '--quality', 'best'),
                               ('flat', '--max-error', 1, '--fill', 'water'),
                               ('need --max-error', '--quality', 'greedy')):
            with self.subTest(options):
                self.refuse(2, text, *mesh, *options)
        self.refuse(1, '--memory', *mesh, '--max-error', 1, '--memory', '20M')
        self.assertFalse(os.path.exists(self.path('none.obj')))

    def test_flat_land_needs_few_triangles(self):
        write_tiff(self.path('flat.tif'), 700, 700, [5.0] * 490000)
        summary, _ = self.mesh(self.build('flat.tif'), 'flat.obj', '--max-error', 0)
        self.assertEqual(summary['max_error'], 0)
        self.assertLessEqual(summary['triangles'], 20)


if __name__ == '__main__':
    unittest.main()
