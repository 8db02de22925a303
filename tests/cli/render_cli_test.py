#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the pictures of terrace render: colours, light, wire, exaggeration.

TERRACE=path/to/terrace render_cli_test.py
"""

import random
import unittest

from cli_test import CommandTest, png_pixels, terrace


class RenderTest(CommandTest):
    def test_mesh_colours_use_heights_by_area(self):
        """A mesh that is fine in one place has the same colours as the surface without the fine part."""
        def write(path, fine):
            vertices, faces = [], []

            def grid(x0, y0, x1, y1, cells, height):
                first = len(vertices)
                for row in range(cells + 1):
                    for column in range(cells + 1):
                        x, y = x0 + (x1 - x0) * column / cells, y0 + (y1 - y0) * row / cells
                        vertices.append((x, y, height(x, y)))
                for row in range(cells):
                    for column in range(cells):
                        a = first + row * (cells + 1) + column + 1
                        b = a + cells + 1
                        faces.extend(((a, a + 1, b + 1), (a, b + 1, b)))

            # A long slope whose upper end is fine.
            grid(0, 0, 90, 100, 10, lambda x, y: x)
            grid(90, 0, 100, 100, fine, lambda x, y: x)
            with open(path, 'w') as file:
                file.writelines('v %r %r %r\n' % v for v in vertices)
                file.writelines('f %d %d %d\n' % f for f in faces)

        pictures = []
        for fine in (1, 150):
            write(self.path('slope.obj'), fine)
            self.run_ok('render', self.path('slope.obj'), '-o', self.path('a.png'), '--size',
                        '100x100', '--color', 'height', '--force', '--exaggerate', 0.001)
            pictures.append(png_pixels(self.path('a.png'))[2])
        even, dense = ([rows[50][3 * x:3 * x + 3] for x in (10, 30, 50, 70, 85)]
                       for rows in pictures)
        for a, b in zip(even, dense):
            self.assertLess(max(abs(p - q) for p, q in zip(a, b)), 12, (even, dense))
        # From the green of the valley to the grey of the mountains.
        self.assertGreater(max(abs(p - q) for p, q in zip(even[0], even[-1])), 30)

    def test_cloud_colours_use_heights_by_area(self):
        noise = random.Random(3)
        with open(self.path('cloud.xyz'), 'w') as file:
            for _ in range(60000):
                x, y = noise.uniform(0, 100), noise.uniform(0, 100)
                file.write(f'{x!r} {y!r} {x!r}\n')
        store = self.path('cloud.store')
        self.run_ok('build', self.path('cloud.xyz'), '-o', store, '--block', 1000, '--z-weight', 0,
                    '--facility-cost', 1)
        pictures = []
        for options in ([], ['--focus', '90,0,100,100:0']):
            self.run_ok('render', store, '-o', self.path('a.png'), '--size', '100x100', '--color',
                        'height', '--force', '--exaggerate', 0.001, *options)
            pictures.append(png_pixels(self.path('a.png'))[2])
        even, dense = ([sum(rows[y][3 * x] for y in range(20, 80)) / 60 for x in (20, 40, 60, 80)]
                       for rows in pictures)
        for a, b in zip(even, dense):
            self.assertLess(abs(a - b), 30, (even, dense))

    def test_slopes_facing_the_light_are_brighter(self):
        # A roof: its north-western side is lit, the other one is in shadow.
        with open(self.path('roof.obj'), 'w') as file:
            file.write('v -10 -10 0\nv 10 10 0\nv -10 10 -5\nv 10 -10 -5\n')
            file.write('f 1 2 3\nf 1 4 2\n')
        self.run_ok('render', self.path('roof.obj'), '-o', self.path('a.png'), '--size', '100x100',
                    '--color', 'grey')
        width, height, rows = png_pixels(self.path('a.png'))
        self.assertEqual((width, height), (100, 100))
        north_west, south_east = rows[25][3 * 25], rows[75][3 * 75]
        self.assertGreater(north_west, south_east + 20)

    def test_wire_draws_the_edges(self):
        with open(self.path('square.obj'), 'w') as file:
            file.write('v 0 0 0\nv 8 0 0\nv 8 8 0\nv 0 8 0\nf 1 2 3 4\n')
        for name, options in (('plain.png', []), ('wire.png', ['--wire'])):
            self.run_ok('render', self.path('square.obj'), '-o', self.path(name), '--size', '80x80',
                        '--color', 'grey', *options)
        plain, wire = (png_pixels(self.path(n))[2] for n in ('plain.png', 'wire.png'))
        diagonal, face = 3 * 40, 3 * 25
        self.assertLess(wire[39][diagonal], plain[39][diagonal] - 40)
        self.assertEqual(wire[20][face + 3 * 5], plain[20][face + 3 * 5])

    def test_a_cloud_has_no_gaps(self):
        self.run_ok('synth', 'uniform', '--points', '4000', '-o', self.path('a.ply'))
        self.run_ok('render', self.path('a.ply'), '-o', self.path('a.png'), '--size', '200x200')
        _, _, rows = png_pixels(self.path('a.png'))
        background = rows[0][:3]
        empty = sum(rows[y][3 * x:3 * x + 3] == background for y in range(20, 180) for x in range(20, 180))
        self.assertLess(empty, 0.08 * 160 * 160)
        self.assertEqual(rows[199][-3:], background)

    def test_heights_are_exaggerated_on_request(self):
        # A pyramid seen from the south at eye level: stretched twice, it is half as high as it is
        # wide.
        with open(self.path('pyramid.obj'), 'w') as file:
            file.write('v -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nv 0 0 10\n')
            file.write('f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n')
        for factor in (0.5, 1, 2, 4):
            out = self.path('a.png')
            summary = self.json_of('render', self.path('pyramid.obj'), '-o', out, '--force', '--size',
                                   '200x200', '--view', '180,0', '--exaggerate', factor)
            self.assertEqual(summary['exaggeration'], factor)
            _, _, rows = png_pixels(out)
            background = rows[0][:3]
            drawn = [[x for x in range(200) if row[3 * x:3 * x + 3] != background] for row in rows]
            height = sum(1 for row in drawn if row)
            width = max(max(row) for row in drawn if row) - min(min(row) for row in drawn if row) + 1
            self.assertAlmostEqual(height / width, factor / 4, delta=0.04)

    def test_same_picture_for_any_threads(self):
        self.run_ok('synth', 'dem', '--size', '300x300', '-o', self.path('a.tif'))
        pictures = set()
        for threads in (1, 4):
            out = self.path(f'{threads}.png')
            self.run_ok('render', self.path('a.tif'), '-o', out, '--size', '160x120', '--view',
                        '200,40', '--threads', threads)
            pictures.add(open(out, 'rb').read())
        self.assertEqual(len(pictures), 1)

    def test_empty_colours_are_not_shown(self):
        noise = random.Random(5)
        with open(self.path('black.csv'), 'w') as file:
            file.write('x,y,z,red,green,blue\n')
            for _ in range(2000):
                file.write(f'{noise.random() * 50:.2f},{noise.random() * 50:.2f},{noise.random():.2f},0,0,0\n')
        self.run_ok('build', self.path('black.csv'), '-o', self.path('black.store'), '--crs', 'EPSG:32632')
        pictures = []
        for options in ([], ['--color', 'height'], ['--color', 'rgb']):
            self.run_ok('render', self.path('black.store'), '-o', self.path('a.png'), '--size', '100x80',
                        '--force', *options)
            pictures.append(png_pixels(self.path('a.png'))[2])
        self.assertEqual(pictures[0], pictures[1])
        self.assertNotEqual(pictures[0], pictures[2])

    def test_rejects_missing_colours(self):
        self.run_ok('synth', 'uniform', '--points', '50', '-o', self.path('a.ply'))
        for what in ('rgb', 'level', 'class', 'slope'):
            result = terrace('render', self.path('a.ply'), '-o', self.path('a.png'), '--color', what)
            self.assert_one_line_error(result, 2)
            self.assertIn(what, result.stderr)


if __name__ == '__main__':
    unittest.main()
