#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests pictures of the results of `match` end to end.

TERRACE=path/to/terrace match_picture_cli_test.py
"""

import json
import os
import random
import subprocess
import tempfile
import unittest

from cli_test import png_pixels

TERRACE = os.environ.get('TERRACE', 'terrace')


def terrace(*args, **more):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120,
                          **more)


class MatchPictureTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, *lines):
        with open(self.path(name), 'w') as file:
            file.writelines(line + '\n' for line in lines)
        return self.path(name)

    def render(self, *args):
        out = self.path('out.png')
        result = terrace('render', *args, '-o', out, '--json', '--force', '--size', '200x200')
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), png_pixels(out)[2]

    def refused(self, code, *args):
        out = self.path('none.png')
        result = terrace('render', *args, '-o', out)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual((result.stdout, len(result.stderr.splitlines())), ('', 1), result.stderr)
        self.assertFalse(os.path.exists(out))
        return result.stderr

    def square(self):
        """Writes four points on a square, two pairs, and their tree."""
        return (self.write('points.csv', 'x,y,z', '0,0,0', '10,0,0', '0,10,0', '10,10,0'),
                self.write('pairs.csv', 'a,b,distance', '0,1,10', '2,3,10'),
                self.write('tree.csv', 'a,b,distance,size,level', '0,1,10,2,1', '2,3,10,2,1',
                           '4,5,10,4,2'))

    def test_pairs_of_match_are_red_lines(self):
        points, pairs, _ = self.square()
        os.remove(pairs)
        result = terrace('match', points, '-o', pairs)
        self.assertEqual(result.returncode, 0, result.stderr)
        summary, rows = self.render(pairs, '--points', points)
        self.assertEqual((summary['points'], summary['lines'], summary['levels']), (4, 2, 1))
        red = sum(row[3 * x] > 200 and row[3 * x + 1] < 60 for row in rows for x in range(200))
        # Two sides of 192 pixels, a few pixels wide, without the dots at their ends.
        self.assertGreater(red, 2 * 180)
        self.assertLess(red, 2 * 192 * 6)
        self.assertEqual(bytes(rows[100][300:303]), b'\xff\xff\xff')

    def test_trees_go_from_red_to_black(self):
        points, _, tree = self.square()

        def colour(rows, x, y):
            return tuple(rows[y][3 * x:3 * x + 3])
        summary, whole = self.render(tree, '--points', points)
        self.assertEqual((summary['lines'], summary['levels']), (3, 2))
        self.assertEqual(colour(whole, 100, 100), (0, 0, 0))
        for y in (4, 196):
            self.assertGreater(colour(whole, 60, y)[0], 200)
            self.assertLess(colour(whole, 60, y)[1], 60)
        summary, lower = self.render(tree, '--points', points, '--level', 1)
        self.assertEqual((summary['lines'], summary['levels']), (2, 2))
        self.assertEqual(colour(lower, 100, 100), (255, 255, 255))
        self.assertEqual(colour(lower, 60, 4), colour(whole, 60, 4))
        summary, none = self.render(tree, '--points', points, '--level', 0)
        self.assertEqual(summary['lines'], 0)
        self.assertEqual(colour(none, 60, 4), (255, 255, 255))

    def test_from_the_side_and_with_any_threads(self):
        generator = random.Random(3)
        points = self.write('points.csv', 'x,y,z', *(
            ','.join(f'{generator.uniform(0, 9):.3f}' for _ in range(3)) for _ in range(501)))
        pairs = self.path('pairs.csv')
        self.assertEqual(terrace('match', points, '-o', pairs).returncode, 0)
        pictures = [self.render(pairs, '--points', points, '--view', view, '--threads', threads)[1]
                    for view, threads in (('30,20', 1), ('30,20', 3), ('top', 2))]
        self.assertEqual(pictures[0], pictures[1])
        self.assertNotEqual(pictures[0], pictures[2])
        with open(points) as file:
            out = self.path('stdin.png')
            result = terrace('render', pairs, '--points', '-', '-o', out, stdin=file)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_errors_name_the_problem(self):
        points, pairs, tree = self.square()
        self.assertIn('--points', self.refused(2, pairs))
        self.assertIn('--points', self.refused(2, points, '--points', points))
        for options in (['--wire'], ['--color', 'height'], ['--focus', '0,0,1,1:0'],
                        ['--level', '3'], ['--level', 'x']):
            self.refused(2, tree, '--points', points, *options)
        self.refused(1, pairs, '--points', self.path('nowhere.csv'))
        three = self.write('three.csv', 'x,y,z', '0,0,0', '10,0,0', '0,10,0')
        self.assertIn('line 3', self.refused(1, pairs, '--points', three))
        self.assertIn('--points', self.refused(1, tree, '--points', three))
        bad = self.write('bad.csv', 'a,b,distance', '0,1,10', '2,77,1')
        message = self.refused(1, bad, '--points', points)
        for part in ('bad.csv', 'line 3', '77', '4 points'):
            self.assertIn(part, message)
        nan = self.write('nan.csv', 'a,b,distance', '0,1,nan')
        self.assertIn('line 2', self.refused(1, nan, '--points', points))


if __name__ == '__main__':
    unittest.main()
