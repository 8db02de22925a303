#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests bodies in space, coarse in one part and fine in another, with `points`, `mesh` and `render`.
surface_cli_test.py tests `surface`.

TERRACE=path/to/terrace scan_cli_test.py
"""

import json
import math
import os
import subprocess
import tempfile
import unittest

from cli_test import png_pixels
from surface_cli_test import RADIUS, sphere

TERRACE = os.environ.get('TERRACE', 'terrace')
POINTS = 20000


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


class ScanTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.all = sphere(POINTS)
        with open(cls.path('ball.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x, y, z in cls.all)
        cls.store = cls.path('ball.terrace')
        # Small clusters, so that coarse levels also have enough points for a spherical surface.
        cls.run_ok('build', cls.path('ball.xyz'), '-o', cls.store, '--block', 2000, '--facility-cost', 1)

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

    def points(self, *options):
        text = self.run_ok('points', self.store, '-o', '-', '--format', 'xyz', '-q', *options)
        return {tuple(map(float, line.split()[:3])) for line in text.splitlines()}

    def mesh_points(self, *options):
        out = self.path('mesh.obj')
        self.run_ok('mesh', self.store, '-o', out, '--force', *options)
        with open(out) as file:
            return {tuple(map(float, line.split()[1:4])) for line in file if line.startswith('v ')}

    def test_a_focus_in_space_has_all_points_inside_and_few_outside(self):
        # One eighth of the ball; the opposite side with the same x and y stays coarse.
        box = (0, 0, 0, 11, 11, 11)
        inside = {p for p in self.all if min(p) >= 0}
        opposite = {p for p in self.all if p[0] > 4 and p[1] > 4 and p[2] < -4}
        focus = ','.join(map(str, box)) + ':0'
        top = self.points('--level', 'top')
        found = self.points('--level', 'top', '--focus', focus)
        self.assertTrue(inside <= found)
        self.assertTrue(top <= found)
        self.assertLess(len(found & opposite), len(opposite) // 10)
        self.assertLess(len(found), POINTS // 3)
        # A mesh has the same points.
        self.assertEqual(self.mesh_points('--level', 'top', '--focus', focus), found)

    def test_a_focus_without_a_level_starts_from_the_top(self):
        focus = ('--focus', '0,0,0,11,11,11:0')
        top = self.points('--level', 'top', *focus)
        self.assertLess(len(top), POINTS // 3)
        self.assertEqual(self.points(*focus), top)
        self.assertEqual(self.mesh_points(*focus), top)
        summary = json.loads(self.run_ok('surface', self.store, '-o', self.path('focus.ply'),
                                         '--json', '--force', *focus))
        self.assertEqual(summary['vertices'], len(top))
        summary, _ = self.picture(*focus)
        self.assertEqual(summary['vertices'], len(top))
        # Without a focus, or with a level, nothing changes.
        self.assertEqual(len(self.points()), POINTS)
        self.assertEqual(self.points('--level', 0, *focus), self.points())

    def test_focuses_of_several_levels_are_nested(self):
        focuses = ['--focus', '0,0,0,11,11,11:0', '--focus', '-11,-11,0,11,11,11:1']
        one = self.points('--level', 1)
        found = self.points('--level', 'top', *focuses)
        self.assertTrue({p for p in one if p[2] >= 0} <= found)
        self.assertTrue({p for p in self.all if min(p) >= 0} <= found)
        self.assertEqual(found, self.points('--level', 'top', *focuses[2:], *focuses[:2]))

    def picture(self, *options):
        out = self.path('out.png')
        summary = json.loads(self.run_ok('render', self.store, '-o', out, '--size', '300x300',
                                         '--view', '45,20', '--json', '--force', *options))
        _, _, rows = png_pixels(out)
        return summary, rows

    def covered(self, rows, share):
        """Asserts that the ball has no gaps within a share of its radius; returns the number of colours
        there."""
        background = rows[0][:3]
        reach = share * 150 * 0.96
        colours = set()
        for y in range(300):
            for x in range(300):
                if math.hypot(x - 149.5, y - 149.5) > reach:
                    continue
                colour = tuple(rows[y][3 * x:3 * x + 3])
                self.assertNotEqual(colour, tuple(background), (x, y))
                colours.add(colour)
        return len(colours)

    def test_discs_close_the_gaps_of_every_level(self):
        whole, rows = self.picture()
        self.assertEqual((whole['vertices'], whole['triangles']), (POINTS, 0))
        self.covered(rows, 0.95)
        mixed, rows = self.picture('--focus', '0,0,0,11,11,11:0')
        self.assertLess(mixed['vertices'], POINTS // 3)
        self.covered(rows, 0.9)
        # Fine points keep their size and do not extend beyond the silhouette.
        background = rows[0][:3]
        self.assertTrue(all(rows[y][3 * x:3 * x + 3] == background
                            for x, y in ((5, 5), (294, 5), (5, 294), (294, 294))))
        coarse, rows = self.picture('--level', 1)
        self.assertLess(coarse['vertices'], POINTS // 20)
        self.covered(rows, 0.85)

    def test_discs_of_few_points_are_not_cut_off(self):
        cloud, out = self.path('few.xyz'), self.path('few.png')
        for count in (2, 30, 1000):
            with open(cloud, 'w') as file:
                file.writelines(f'{i % 32} {i * 7 % 31} {i % 5}\n' for i in range(count))
            result = terrace('render', cloud, '-o', out, '--size', '300x240', '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            _, _, rows = png_pixels(out)
            background = rows[0][:3]
            rim = [rows[0], rows[-1]] + [row[:3] + row[-3:] for row in rows]
            self.assertTrue(all(row[x:x + 3] == background for row in rim for x in range(0, len(row), 3)), count)

    def test_a_region_shows_only_its_inside(self):
        summary, _ = self.picture('--region', '0,0,0,11,11,11')
        self.assertEqual(summary['vertices'], sum(min(p) >= 0 for p in self.all))
        result = terrace('render', self.path('ball.xyz'), '-o', self.path('none.png'), '--region',
                         '0,0,0,11,11,11')
        self.assertEqual(result.returncode, 2, result.stderr)
        result = terrace('render', self.store, '-o', self.path('none.png'), '--where', 'z > 99')
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('no point is selected; give another --where', result.stderr)

    def test_wire_draws_the_edges_of_the_surface(self):
        summary, rows = self.picture('--wire')
        self.assertEqual((summary['vertices'], summary['triangles']), (POINTS, 2 * POINTS - 4))
        mixed, _ = self.picture('--wire', '--focus', '0,0,0,11,11,11:0')
        self.assertEqual(mixed['triangles'], 2 * mixed['vertices'] - 4)
        self.assertLess(mixed['vertices'], POINTS // 3)

    def test_a_sheet_is_drawn_as_a_height_field(self):
        with open(self.path('sheet.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {math.sin(x / 5) + math.cos(y / 7)}\n'
                            for x in range(60) for y in range(60))
        store = self.path('sheet.terrace')
        self.run_ok('build', self.path('sheet.xyz'), '-o', store, '--block', 1000)
        result = terrace('render', store, '-o', self.path('sheet.png'), '--wire', '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn('not a height field', result.stderr)
        self.assertEqual(json.loads(result.stdout)['vertices'], 3600)


if __name__ == '__main__':
    unittest.main()
