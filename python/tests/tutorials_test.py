# SPDX-License-Identifier: Apache-2.0
"""The tutorials run cell by cell, as in a notebook, and show pictures. The examples run as scripts."""

import contextlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np

import terrace
from python_case import ALPS, COMMAND, ROOT, StoreCase

FOLDER = os.path.join(ROOT, 'python', 'tutorials')


def run(name):
    """Runs a tutorial. Returns (printed text, files written, number of cells that end in an object with a picture)."""
    with open(os.path.join(FOLDER, name), encoding='utf-8') as file:
        text = file.read()
    names, printed, pictures = {'__file__': os.path.join(FOLDER, name)}, io.StringIO(), 0
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(printed), \
            contextlib.redirect_stderr(io.StringIO()), mock.patch.object(sys, 'argv', [name]):
        before = os.getcwd()
        os.chdir(folder)
        try:
            for cell in re.split(r'^# %%.*\n', text, flags=re.MULTILINE):
                exec(compile(cell, name, 'exec'), names)
                last = cell.strip().splitlines()[-1] if cell.strip() else ''
                if re.match(r'[a-z_]+ *(#.*)?$', last):
                    shown = eval(last, names)
                    pictures += shown._repr_png_().startswith(b'\x89PNG')
            files = sorted(os.listdir('.'))
        finally:
            os.chdir(before)
    return printed.getvalue(), files, pictures


class Tutorials(unittest.TestCase):
    def test_terrain(self):
        printed, files, pictures = run('terrain.py')
        self.assertIn('1338658 points', printed)
        self.assertEqual(files, ['alps.ply', 'alps.png', 'alps.store'])
        self.assertEqual(pictures, 1)

    def test_lidar(self):
        printed, files, pictures = run('lidar.py')
        self.assertIn('150000 points', printed)
        self.assertEqual(pictures, 2)
        self.assertEqual(files, ['ground.store', 'ground.tif', 'scan.store'])

    def test_clustering(self):
        printed, _, pictures = run('clustering.py')
        self.assertIn('optimal', printed)
        self.assertEqual(pictures, 1)

    def test_all_tutorials_are_tested(self):
        scripts = {name for name in os.listdir(FOLDER) if name.endswith('.py')}
        self.assertEqual(scripts, {'terrain.py', 'lidar.py', 'clustering.py'})


    def test_tutorials_run_as_scripts_without_arguments(self):
        for name in sorted(os.listdir(FOLDER)):
            if name.endswith('.py'):
                with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                    subprocess.run([sys.executable, os.path.join(FOLDER, name)], cwd=folder, check=True, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)


class Examples(StoreCase):
    """The examples are scripts of at most 15 lines."""

    def run_script(self, name, *arguments):
        path = os.path.join(ROOT, 'python', 'examples', name)
        with open(path, encoding='utf-8') as file:
            self.assertLessEqual(len(file.readlines()), 15)
        return subprocess.run([sys.executable, path, *arguments], cwd=self.folder, check=True, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE).stdout

    def test_bounded_mesh(self):
        self.assertIn('of 1338658 samples', self.run_script('bounded_mesh.py', ALPS, '100'))
        with open(self.path('terrain.svg'), encoding='ascii') as file:
            self.assertGreater(file.read().count('<polygon'), 1000)

    def contours_of(self, scan, interval):
        self.run_script('ground_contours.py', scan, interval)
        with open(self.path('contours.geojson'), encoding='ascii') as file:
            return json.load(file)['features']

    @unittest.skipIf(COMMAND is None, 'TERRACE_BIN is missing, which writes the LAZ file')
    def test_ground_contours(self):
        classes = np.where(np.arange(len(self.points)) % 3 == 0, 5, 2).astype('u1')
        heights = self.points + (classes == 5)[:, None] * [0, 0, 30]
        terrace.build(heights, self.path('trees'), crs='EPSG:32632', attributes={'classification': classes})
        scan = self.path('trees.laz')
        subprocess.run([COMMAND, 'points', self.path('trees'), '-o', scan, '-q'], check=True)
        lines = self.contours_of(scan, '5')
        for line in lines:  # contours of the ground, which is smooth
            there = self.scan.heights(line['geometry']['coordinates'], crs='EPSG:4326')
            np.testing.assert_allclose(there[~np.isnan(there)], line['properties']['elev'], rtol=0, atol=0.3)
        self.assertGreater(len(lines), 4)

    @unittest.skipIf('TERRACE_DATA' not in os.environ, 'TERRACE_DATA is not set')
    def test_ground_contours_of_a_real_scan(self):
        lines = self.contours_of(os.path.join(os.environ['TERRACE_DATA'], 'lidar', 'lidR_Topography.laz'), '5')
        self.assertEqual({line['properties']['elev'] for line in lines}, set(range(790, 815, 5)))

    def test_view_deltas(self):
        terrace.build(ALPS, self.path('alps'))
        self.assertRegex(self.run_script('view_deltas.py', self.path('alps')), r'\d{4,} triangles of \d{4,} points')


if __name__ == '__main__':
    unittest.main()
