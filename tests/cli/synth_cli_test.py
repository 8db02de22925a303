#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the test inputs of terrace synth, and their conversion between formats.

TERRACE=path/to/terrace synth_cli_test.py
"""

import json
import shutil
import subprocess
import unittest

from cli_test import CommandTest, terrace


class DemTest(CommandTest):
    def test_the_rms_step_matches_the_roughness_at_every_size(self):
        for size in ('40x30', '300x200', '1000x1000', '3000x2000'):
            for roughness in (1.5, 2.65, 6):
                with self.subTest(size=size, roughness=roughness):
                    summary = self.json_of('synth', 'dem', '--size', size, '--roughness', roughness,
                                           '-o', self.path('a.tif'), '--force')
                    self.assertAlmostEqual(summary['rms_step'] / roughness, 1, delta=0.03)
                    self.assertGreater(summary['height']['min'], -1000)
                    self.assertLess(summary['height']['max'], 9000)

    def test_same_bytes_for_any_threads_and_memory(self):
        contents = set()
        for i, options in enumerate((['--threads', '1'], ['--threads', '5'],
                                     ['--threads', '2', '--memory', '64M'])):
            out = self.path(f'{i}.tif')
            self.run_ok('synth', 'dem', '--size', '2500x1100', '-o', out, *options)
            contents.add(open(out, 'rb').read())
        self.assertEqual(len(contents), 1)
        self.run_ok('synth', 'dem', '--size', '2500x1100', '-o', self.path('s.tif'), '--seed', '2')
        self.assertNotIn(open(self.path('s.tif'), 'rb').read(), contents)

    def test_the_raster_has_the_requested_properties(self):
        out = self.path('a.tif')
        self.run_ok('synth', 'dem', '--size', '300x200', '--cell', '10', '--type', 'float32',
                    '--crs', 'EPSG:25832', '--compress', 'deflate', '-o', out)
        info = self.json_of('info', out)
        self.assertEqual((info['columns'], info['rows'], info['points']), (300, 200, 60000))
        self.assertEqual(info['crs']['epsg'], 25832)
        self.assertEqual(info['channels'][2]['type'], 'float32')
        self.assertAlmostEqual(info['bounds']['max'][0] - info['bounds']['min'][0], 2990)
        self.assertEqual(info['format'], 'geotiff')

    def test_gdal_reads_it_the_same(self):
        gdalinfo = shutil.which('gdalinfo')
        if gdalinfo is None:
            self.skipTest('gdalinfo is not installed')
        out = self.path('a.tif')
        self.run_ok('synth', 'dem', '--size', '700x300', '-o', out)
        told = json.loads(subprocess.run([gdalinfo, '-json', '-stats', out], check=True,
                                         capture_output=True, text=True).stdout)
        height = self.json_of('info', out)['height']
        band = told['bands'][0]
        self.assertEqual(told['size'], [700, 300])
        self.assertEqual(band['type'], 'Int16')
        self.assertEqual((band['minimum'], band['maximum']), (height['min'], height['max']))
        self.assertAlmostEqual(band['mean'], height['mean'], places=3)

    def test_rejects_heights_that_do_not_fit(self):
        result = terrace('synth', 'dem', '--size', '64x64', '--roughness', '50', '-o', self.path('a.tif'))
        self.assert_one_line_error(result, 2)
        self.assertIn('float32', result.stderr)


class CloudTest(CommandTest):
    def points(self, *args):
        return self.run_ok('synth', *args, '-o', '-').stdout.splitlines()

    def test_every_kind_has_the_requested_number_of_points(self):
        for kind in ('surface', 'uniform', 'clusters'):
            for count in (1, 7, 2000):
                lines = self.points(kind, '--points', count)
                self.assertEqual(len(lines), count)
                for line in lines[:50]:
                    self.assertEqual(len(line.split()), 3)

    def test_shuffling_only_permutes_points(self):
        for kind in ('surface', 'uniform', 'clusters'):
            plain = self.points(kind, '--points', '3000')
            for how in ('all', 'pieces:1-1', 'pieces:10-50', 'pieces:5000-5000'):
                with self.subTest(kind=kind, how=how):
                    shuffled = self.points(kind, '--points', '3000', '--shuffle', how)
                    self.assertEqual(sorted(shuffled), sorted(plain))
                    self.assertEqual(shuffled == plain, how == 'pieces:5000-5000')

    def test_same_bytes_for_any_threads(self):
        self.assertEqual(self.points('surface', '--points', '70k', '--threads', '1'),
                         self.points('surface', '--points', '70k', '--threads', '7'))

    def test_surface_is_closed_and_dense(self):
        # Every direction has a point near it.
        points = [tuple(map(float, p.split())) for p in self.points('surface', '--points', '5000')]
        for axis in range(3):
            values = [p[axis] for p in points]
            self.assertLess(min(values), -60)
            self.assertGreater(max(values), 60)

    def test_formats_keep_every_bit(self):
        first = self.path('a.ply')
        self.run_ok('synth', 'surface', '--points', '500', '-o', first)
        self.run_ok('convert', first, '-o', self.path('b.csv'))
        self.run_ok('convert', self.path('b.csv'), '-o', self.path('c.xyz'))
        summary = self.json_of('convert', self.path('c.xyz'), '-o', self.path('d.ply'))
        self.assertEqual(summary['points'], 500)
        self.assertEqual(open(first, 'rb').read(), open(self.path('d.ply'), 'rb').read())

    def test_standard_input_and_output(self):
        result = self.run_ok('convert', '-', '-o', '-', input='1 2 3\n4 5 6.5\n')
        self.assertEqual(result.stdout, '1 2 3\n4 5 6.5\n')
        self.assert_one_line_error(terrace('convert', '-', '-o', '-', '--json', input='1 2 3\n'), 2)


if __name__ == '__main__':
    unittest.main()
