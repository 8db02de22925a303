#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests file names that imply another format, and the answers to typing mistakes.

TERRACE=path/to/terrace FAULT_SHIM=path/to/libfault_shim.so outputs_cli_test.py
"""

import json
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

from tile_case import TERRACE, Dem, terrace


class OutputCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='terrace-outputs-')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        Dem(40, 30, 10.13, 46.71, 0.02).write(cls.path('a.tif'))
        cls.ok('build', cls.path('a.tif'), '-o', cls.path('a.terrace'))
        cls.ok('synth', 'uniform', '--points', '50', '-o', cls.path('p.ply'))
        cls.store, cls.points = cls.path('a.terrace'), cls.path('p.ply')
        with open(cls.path('places.csv'), 'w', encoding='ascii') as file:
            file.write('lon,lat\n10.3,46.5\n')

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @classmethod
    def ok(cls, *args):
        result = terrace(*args)
        assert result.returncode == 0, (args, result.stderr)
        return result

    def refuse(self, code, words, *args, **more):
        before = sorted(os.listdir(self.folder))
        result = terrace(*args, **more)
        with self.subTest(args):
            self.assertEqual(result.returncode, code, result.stderr)
            for word in words.split('|'):
                self.assertIn(word, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            self.assertEqual(sorted(os.listdir(self.folder)), before)


class FormatNameTest(OutputCase):
    def test_an_ending_that_a_verb_cannot_write_is_refused(self):
        line = ('--line', '10.2,46.5,10.4,46.5')
        wrong = ['gpkg', 'jpg', 'shp', 'kml', 'stl', 'JSON5', 'gz', 'pdf']
        for words, endings, command in (
                ('.xyz|.copc.laz', ['tif', 'e57'], ('points', self.store)),
                ('.ply, .obj or .glb', ['json', 'tif', 'vtk'], ('mesh', self.store)),
                ('.ply, .obj or .glb', ['json', 'las'], ('mesh', self.store, '--max-error', '5')),
                ('.ply, .obj or .glb', ['vtk'], ('surface', self.store)),
                ('.vtk', ['ply'], ('surface', self.store, '--tetrahedra')),
                ('.tif or .tiff', ['png', 'asc', 'vrt', 'img'], ('raster', self.store)),
                ('.geojson or .json', ['csv', 'fgb'], ('contour', self.store, '--interval', '9')),
                ('.csv or .txt', ['json', 'xlsx'], ('profile', self.store, *line)),
                ('.csv, .txt, .tsv or .tab', ['json'], ('sample', self.store, '--points', self.path('places.csv'))),
                ('.png', ['tif', 'svg'], ('render', self.store)),
                ('.xyz|.las', ['geojson', 'vtk'], ('convert', self.points)),
                ('.xyz|.las', ['geojson', 'png'], ('cluster', self.points)),
                ('.csv or .txt', ['json'], ('match', self.points)),
                ('.tif or .tiff', ['png'], ('synth', 'dem', '--size', '8x8')),
                ('.xyz|.las', ['tif', 'obj'], ('synth', 'uniform', '--points', '9')),
                ('a folder', ['tif', 'las', 'zip'], ('build', self.path('a.tif'))),
                ('a folder', ['mbtiles', 'pmtiles'], ('tile', self.store, '--vertical', 'ellipsoidal')),
                ('a folder', ['zip', 'html'], ('publish', self.store))):
            for ending in endings + (wrong if 'folder' not in words else wrong[:4]):
                self.refuse(2, words, *command, '-o', self.path('x.' + ending))

    def test_the_other_outputs_of_a_run_are_checked_too(self):
        cluster = ('cluster', self.points, '--method', 'single', '--height', '1')
        self.refuse(2, '.txt', *cluster, '--labels', self.path('l.png'))
        self.refuse(2, '.csv or .txt', *cluster, '-o', self.path('o.csv'), '--dendrogram', self.path('t.json'))
        self.refuse(2, '.overlay', 'mesh', self.store, '-o', self.path('m.ply'), '--smooth', 'taubin',
                    '--save-overlay', self.path('o.tif'))

    def test_a_format_that_contradicts_the_ending_is_refused(self):
        self.refuse(2, '--format csv', 'convert', self.points, '-o', self.path('x.las'), '--format', 'csv')
        self.refuse(2, '--format|xyz', 'convert', self.points, '-o', self.path('x.las'), '--format', 'foo')
        self.refuse(2, '--format glb', 'mesh', self.store, '-o', self.path('x.ply'), '--format', 'glb')
        self.refuse(2, 'no ending', 'convert', self.points, '-o', self.path('x'))

    def test_standard_output_is_only_for_formats_that_stream(self):
        for command in (('raster', self.store), ('synth', 'dem', '--size', '8x8'), ('build', self.path('a.tif')),
                        ('surface', self.store, '--tetrahedra'), ('publish', self.store)):
            self.refuse(2, 'standard output', *command, '-o', '-')

    def test_names_without_a_known_ending_are_accepted(self):
        for number, command in enumerate((('raster', self.store), ('render', self.store, '--size', '9x9'),
                                          ('contour', self.store, '--interval', '9'))):
            self.ok(*command, '-o', self.path(f'plain{number}'))
        self.ok('build', self.path('a.tif'), '-o', self.path('area.2024'))


class InputTest(OutputCase):
    def put(self, name, data):
        with open(self.path(name), 'wb') as file:
            file.write(data)
        return self.path(name)

    def test_points_files_that_are_not_tables(self):
        point = {'type': 'Feature', 'properties': {}, 'geometry': {'type': 'Point', 'coordinates': [10.3, 46.5]}}
        text = json.dumps({'type': 'FeatureCollection', 'features': [point, point]}).encode()
        self.refuse(2, '.geojson|.csv', 'sample', self.store, '--points', self.put('p.geojson', text))
        for data, words in ((text, 'JSON'), (b'<kml>,\n</kml>', 'XML'), (b'SQLite format 3\0\x10,\0\n', 'not text')):
            self.refuse(1, words + '|ogr2ogr -f CSV', 'sample', self.store, '--points', self.put('p.csv', data))

    def test_regions_lines_and_metrics_that_are_not_json(self):
        package = self.put('r.gpkg', b'SQLite format 3\0' + bytes(100))
        self.refuse(1, 'r.gpkg|is not JSON|ogr2ogr -f GeoJSON', 'points', self.store, '--region', package, '-o', '-')
        self.refuse(1, 'r.gpkg|is not JSON|ogr2ogr -f GeoJSON', 'convert', self.points, '--region', package, '-o', '-')
        self.refuse(1, 'r.gpkg|is not JSON|ogr2ogr -f GeoJSON', 'profile', self.store, '--line', package, '-o', '-')
        self.refuse(1, 'r.gpkg|is not JSON|semi_axes', 'cluster', self.points, '--metric', 'elliptical:' + package,
                    '-o', '-')
        broken = self.put('r.geojson', b'{"type": "Polygon",\n "coordinates": [[[0, 0], [1, 0]')
        self.refuse(1, 'line 2, column|cut off', 'points', self.store, '--region', broken, '-o', '-')

    def test_an_endless_region_is_refused(self):
        result = subprocess.run(f'yes "[" | {TERRACE} points {self.store} --region /dev/stdin -o -', shell=True,
                                capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn('is larger than', result.stderr)


class AnswerTest(OutputCase):
    def test_an_empty_value_is_named(self):
        source = self.path('a.tif')
        self.refuse(2, '--output is empty', 'build', source, '-o', '')
        self.refuse(2, '--crs is empty', 'build', source, '--crs', '', '-o', self.path('n.st'))
        self.refuse(2, '--region is empty', 'points', self.store, '--region', '', '-o', '-')
        self.refuse(2, '--labels is empty', 'cluster', self.points, '--labels', '')
        self.refuse(2, ' is empty', 'info', '')

    def test_typing_mistakes_are_answered_with_the_nearest_name(self):
        self.refuse(2, "'--regoin': no such argument or option; did you mean --region?", 'points', self.store, '--regoin', '1,2',
                    '-o', '-')
        self.refuse(2, 'did you mean --max-error?', 'mesh', self.store, '--maxerror=5', '-o', '-')
        self.refuse(2, 'did you mean --interval?', 'contour', self.store, '--interv', '5', '-o', '-')
        self.refuse(2, 'did you mean contour?', 'contuor', self.store)
        result = terrace('frobnicate', self.store)
        self.assertEqual(result.returncode, 2)
        self.assertNotIn('did you mean', result.stderr)

    def test_errors_in_data_exit_with_1(self):
        Dem(9, 1, 10.13, 46.71, 0.02).write(self.path('row.tif'))
        self.ok('build', self.path('row.tif'), '-o', self.path('row.terrace'))
        self.refuse(1, 'row.terrace: the raster is one line of samples', 'mesh', self.path('row.terrace'),
                    '--max-error', '1', '-o', self.path('none.ply'))

    def test_the_version_names_no_driver(self):
        self.assertNotIn('driver', self.ok('--version').stdout)

    @unittest.skipUnless(shutil.which('gdal_translate'), 'needs gdal-bin')
    def test_force_keeps_the_copies_that_gdal_makes_of_a_raster(self):
        """GDAL copies the Software tag. Strips, tiles, a COG, and one tile whose values all fit into the directory."""
        for ours, command in (('cog.tif', ('raster', self.store)), ('plain.tif', ('synth', 'dem', '--size', '300x20'))):
            ours = self.path(ours)
            self.ok(*command, '-o', ours)
            self.ok(*command, '-o', ours, '--force')
            copy = self.path('copy.tif')
            for more in ([], ['-co', 'TILED=YES'], ['-co', 'TILED=YES', '-a_nodata', 'none'], ['-of', 'COG'],
                         ['-of', 'COG', '-a_nodata', 'none', '-co', 'BLOCKSIZE=128', '-co', 'PREDICTOR=YES']):
                subprocess.run(['gdal_translate', '-q', *more, ours, copy], check=True)
                with open(copy, 'rb') as file:
                    self.assertIn(b'terrace', file.read())
                self.refuse(1, 'not written by terrace', *command, '-o', copy, '--force')
            if shutil.which('gdal_edit.py'):
                shutil.copy(ours, copy)
                subprocess.run(['gdal_edit.py', '-mo', 'AUTHOR=someone', copy], check=True, stderr=subprocess.DEVNULL)
                self.refuse(1, 'not written by terrace', *command, '-o', copy, '--force')
            os.remove(copy)

    def test_interrupted_tiles_name_the_option_that_resumes(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        env = dict(os.environ, LD_PRELOAD=os.environ['FAULT_SHIM'], FAULT_STEP='8', FAULT_KIND='pause')
        process = subprocess.Popen([TERRACE, 'tile', self.store, '-o', 't', '--vertical', 'ellipsoidal', '--zoom',
                                    '0-12'], cwd=folder, env=env, stderr=subprocess.PIPE, text=True)
        _, status = os.waitpid(process.pid, os.WUNTRACED)
        self.assertTrue(os.WIFSTOPPED(status))
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        _, error = process.communicate()
        self.assertEqual(process.returncode, 130, error)
        self.assertIn('with --resume to continue', error)


if __name__ == '__main__':
    unittest.main()
