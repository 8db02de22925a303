#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""build --entities: triangles go into a store and come out again.

TERRACE=path/to/terrace entities_cli_test.py
"""

import collections
import json
import os
import random
import struct
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')


def triangles_of(path):
    """How often each triangle, three corners in the order of the file, is in an OBJ."""
    vertices, triangles = [], collections.Counter()
    with open(path, encoding='ascii') as file:
        for line in file:
            words = line.split()
            if words and words[0] == 'v':
                vertices.append(struct.pack('<3d', *map(float, words[1:])))
            elif words and words[0] == 'f':
                triangles[tuple(vertices[int(word) - 1] for word in words[1:])] += 1
    return vertices, triangles


class EntitiesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        seed = 5
        print('seed', seed)
        rng = random.Random(seed)
        # Shared vertices, twins, triangles without area and a zero with a sign, in no order.
        cls.vertices = [(rng.uniform(-1e3, 1e3), rng.uniform(0, 2e3), rng.choice([-0.0, 0.0, rng.random()]))
                        for _ in range(4000)]
        near = sorted(range(len(cls.vertices)), key=lambda v: (cls.vertices[v][0] // 100, cls.vertices[v][1]))
        cls.faces = []
        for _ in range(9000):
            at = rng.randrange(len(near) - 3)
            cls.faces.append([near[at + rng.randrange(4)] for _ in range(3)])
        cls.faces += cls.faces[:10]
        cls.file = cls.path('soup.obj')
        with open(cls.file, 'w', encoding='ascii') as file:
            file.writelines('v %r %r %r\n' % v for v in cls.vertices)
            file.writelines('f %d %d %d\n' % tuple(v + 1 for v in f) for f in cls.faces)
        cls.store = cls.path('soup.st')
        cls.summary = json.loads(cls.run_ok('build', cls.file, '--entities', 'triangles', '-o', cls.store, '--block', 1000,
                                            '--crs', 'EPSG:25832', '--json'))

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def terrace(*args, **options):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120, **options)

    @classmethod
    def run_ok(cls, *args, **options):
        result = cls.terrace(*args, **options)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, wanted, *args):
        result = self.terrace(*args)
        self.assertIn(result.returncode, (1, 2))
        self.assertIn(wanted, result.stderr)
        self.assertLessEqual(len(result.stderr.splitlines()), 2, result.stderr)

    @staticmethod
    def content(store):
        result = {}
        for name in sorted(os.listdir(store)):
            with open(os.path.join(store, name), 'rb') as file:
                result[name] = file.read()
        return result

    def test_all_come_back_to_the_last_bit(self):
        self.assertEqual(self.summary['points'], len(self.faces))
        self.assertGreater(self.summary['levels'], 1)
        self.run_ok('verify', self.store)
        out = self.path('out.obj')
        summary = json.loads(self.run_ok('mesh', self.store, '-o', out, '--json'))
        vertices, triangles = triangles_of(out)
        self.assertTrue(triangles == triangles_of(self.file)[1])
        self.assertEqual((summary['vertices'], summary['triangles']), (len(vertices), len(self.faces)))
        self.assertEqual(len(set(vertices)), len(vertices))
        # As a table, corners are columns; a zero loses its sign there.
        unsigned = collections.Counter()
        for corners, count in triangles.items():
            unsigned[tuple(struct.pack('<3d', *(x + 0.0 for x in struct.unpack('<3d', c))) for c in corners)] += count
        lines = self.run_ok('points', self.store, '--format', 'csv', '-o', '-').splitlines()
        self.assertEqual(lines[0].split(',')[:9], ['x', 'y', 'z', 'x2', 'y2', 'z2', 'x3', 'y3', 'z3'])
        table = collections.Counter()
        for line in lines[1:]:
            values = list(map(float, line.split(',')[:9]))
            table[tuple(struct.pack('<3d', *(x + 0.0 for x in values[k:k + 3])) for k in (0, 3, 6))] += 1
        self.assertTrue(table == unsigned)

    def test_levels_and_regions_are_parts(self):
        out = self.path('part.obj')
        whole = triangles_of(self.file)[1]
        self.run_ok('mesh', self.store, '--level', 1, '-o', out)
        coarse = triangles_of(out)[1]
        self.assertTrue(0 < sum(coarse.values()) < len(self.faces) / 10)
        self.assertEqual(sum((coarse - whole).values()), 0)
        self.run_ok('mesh', self.store, '--region', '-500,300,250,1200', '-o', out, '--force')
        inside = collections.Counter()
        for corners, count in whole.items():
            x, y, _ = struct.unpack('<3d', corners[0])
            if -500 <= x <= 250 and 300 <= y <= 1200:
                inside[corners] += count
        self.assertTrue(triangles_of(out)[1] == inside)
        self.assertGreater(len(inside), 100)

    def test_threads_and_pipes_change_nothing(self):
        for name, source, options in (('threads.st', self.file, ['--threads', 1]),
                                      ('pipe.st', '-', ['--input-format', 'obj'])):
            with open(self.file, encoding='ascii') as file:
                self.run_ok('build', source, '--entities', 'triangles', '-o', self.path(name), '--block', 1000,
                            '--crs', 'EPSG:25832', *options,
                            stdin=file)
            self.assertTrue(self.content(self.path(name)) == self.content(self.store), name)

    def test_what_needs_points_says_so(self):
        for args in (['mesh', self.store, '--max-error', 1, '-o', self.path('x.ply')],
                     ['raster', self.store, '--cell', 10, '-o', self.path('x.tif')],
                     ['contour', self.store, '--interval', 1, '-o', self.path('x.geojson')],
                     ['profile', self.store, '--line', '0,0,100,100', '-o', self.path('x.csv')],
                     ['tile', self.store, '--zoom', '5', '-o', self.path('tiles')]):
            with self.subTest(args[0]):
                self.expect_error('holds triangles', *args)
        self.expect_error('without --metric', 'mesh', self.store, '--smooth', 'taubin:2', '-o', self.path('x.ply'))

    def test_what_cannot_be_built_says_so(self):
        out = self.path('no.st')
        triangles = ['--entities', 'triangles', '-o', out]
        for options in (['--metric', 'squared'], ['--channel', 'x2:1'], ['--outlier-price', 1]):
            self.expect_error('--entities triangles', 'build', self.file, *triangles, *options)
        self.expect_error('"z3"', 'build', self.file, *triangles, '--drop', 'z3')
        table = self.path('points.xyz')
        with open(table, 'w', encoding='ascii') as file:
            file.write('0 0 0\n1 1 1\n')
        self.expect_error('has no triangles', 'build', table, *triangles)
        self.expect_error('no kd-tree search', 'build', self.file, *triangles, '--strategy', 'kd-tree')
        self.assertFalse(os.path.exists(out))


if __name__ == '__main__':
    unittest.main()
