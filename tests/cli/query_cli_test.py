#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests queries of a store end to end: sample, raster, profile, contour.

TERRACE=path/to/terrace query_cli_test.py
"""

import array
import csv
import filecmp
import io
import itertools
import json
import math
import os
import random
import re
import shutil
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
SIZE = 300
CELL = 30


def terrace(*args, text=None):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, input=text,
                          timeout=120)


def needs(*programs):
    missing = [p for p in programs if shutil.which(p) is None]
    return unittest.skipIf(missing, 'not installed: ' + ', '.join(missing))


class QueryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dem = cls.path('dem.tif')
        cls.store = cls.path('dem.terrace')
        cls.run_ok('synth', 'dem', '--size', f'{SIZE}x{SIZE}', '--cell', CELL, '--type', 'float32',
                   '-o', cls.dem)
        cls.run_ok('build', cls.dem, '-o', cls.store, '--block', 3000)
        info = json.loads(cls.run_ok('info', cls.store, '--json'))
        cls.low, cls.high = info['bounds']['min'], info['bounds']['max']

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def run_ok(*args, text=None):
        result = terrace(*args, text=text)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, code, *args, text=None):
        result = terrace(*args, text=text)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def samples(self, file):
        """The samples of a GeoTIFF by rows, read by GDAL."""
        raw = self.path('samples.raw')
        subprocess.run(['gdal_translate', '-q', '-of', 'ENVI', '-ot', 'Float32', file, raw], check=True)
        values = array.array('f')
        with open(raw, 'rb') as stream:
            values.frombytes(stream.read())
        return values

    def answers(self, lines, *options):
        return list(csv.reader(io.StringIO(self.run_ok('sample', self.store, *options, text=lines))))

    def somewhere(self, seed, count):
        generator = random.Random(seed)
        return [(generator.uniform(self.low[0], self.high[0]),
                 generator.uniform(self.low[1], self.high[1])) for _ in range(count)]


class SampleTest(QueryTest):
    def test_help_ends_with_an_example(self):
        for verb in 'sample', 'raster', 'profile', 'contour':
            self.assertIn('Example:\n  terrace ' + verb, self.run_ok(verb, '--help'))

    def test_lines_are_kept_and_answered_in_order(self):
        x, y = self.low[0] + 100, self.low[1] + 100
        text = (f'# places\nname,Lat,"Lon"\n"a, b",{y},{x}\n\nfar,{y - 1e6},{x}\n'
                f'no number,,{x}\r\nlast,{y},{x}')
        lines = self.run_ok('sample', self.store, text=text).split('\n')
        self.assertEqual(lines[0], '# places')
        self.assertEqual(lines[1], 'name,Lat,"Lon",height,gradient,slope,aspect')
        self.assertTrue(lines[2].startswith(f'"a, b",{y},{x},'))
        self.assertEqual(lines[3], '')
        self.assertEqual(lines[4], f'far,{y - 1e6},{x},,,,')
        self.assertEqual(lines[5], f'no number,,{x},,,,')
        self.assertEqual(lines[6].split(',')[-4:], lines[2].split(',')[-4:])
        self.assertEqual(lines[7:], [''])

    def test_column_names_are_unique(self):
        x, y = self.low[0] + 100, self.low[1] + 100
        places, answers = self.path('named.csv'), self.path('answered.csv')
        for head, due in (('x,y,Height,slope,slope_2', 'height_2,gradient,slope_3,aspect'),
                          ('x;y;aspect', 'height;gradient;slope;aspect_2')):
            with open(places, 'w', encoding='ascii') as file:
                file.write(head + '\n' + head[1].join(map(str, (x, y, 1, 2, 3)[:len(head.split(head[1]))])) + '\n')
            # Recognised as a table of terrace, which may be replaced.
            self.run_ok('sample', self.store, '--points', places, '-o', answers, '--force')
            with open(answers, encoding='ascii') as file:
                self.assertEqual(file.readline(), head + head[1] + due + '\n')

    def test_slope_and_aspect_match_the_gradient(self):
        for row in self.answers('\n'.join(f'{x},{y}' for x, y in self.somewhere(1, 200))):
            gradient, slope, aspect = map(float, row[3:])
            self.assertAlmostEqual(math.degrees(math.atan(gradient)), slope, places=5)
            self.assertTrue(0 <= aspect < 360)

    def test_the_gradient_matches_the_heights(self):
        step = 1e-3
        for x, y in self.somewhere(2, 60):
            text = '\n'.join(f'{x + dx},{y + dy}' for dx, dy in ((0, 0), (step, 0), (0, step)))
            rows = [[float(cell) for cell in row] for row in self.answers(text)]
            east, north = ((rows[i][2] - rows[0][2]) / step for i in (1, 2))
            # Heights have five decimals; a step across an edge of a triangle is rare.
            if abs(math.hypot(east, north) - rows[0][3]) > 0.02:
                continue
            if rows[0][3] > 0.3:
                downhill = math.degrees(math.atan2(-east, -north)) % 360
                turn = abs(downhill - rows[0][5])
                self.assertLess(min(turn, 360 - turn), 5)

    @needs('gdal_translate')
    def test_every_method_returns_the_sample_at_a_sample(self):
        values = self.samples(self.dem)
        cells = [(random.Random(3 + i).randrange(SIZE), random.Random(900 + i).randrange(SIZE))
                 for i in range(100)] + [(0, 0), (SIZE - 1, SIZE - 1)]
        text = '\n'.join(f'{self.low[0] + CELL * c},{self.high[1] - CELL * r}' for c, r in cells)
        for method in 'linear', 'nearest', 'natural':
            for (c, r), row in zip(cells, self.answers(text, '--method', method)):
                self.assertAlmostEqual(float(row[2]), values[r * SIZE + c], places=3)

    def test_threads_memory_and_batches_do_not_change_a_byte(self):
        text = 'x,y\n' + ''.join(f'{x},{y}\n' for x, y in self.somewhere(4, 30000))
        for method in 'linear', 'natural':
            one = self.run_ok('sample', self.store, '--method', method, '--threads', 1, text=text)
            self.assertEqual(one, self.run_ok('sample', self.store, '--method', method, '--threads', 3,
                                              '--memory', '64M', text=text))
            self.assertEqual(one.count('\n'), 30001)

    def test_positions_are_written_in_another_crs(self):
        places = self.somewhere(6, 50)
        text = 'easting;name;northing\n' + ''.join(f'{x:.4f};"a;b";{y:.4f}\n' for x, y in places)
        plain = [row.split(';') for row in self.run_ok('sample', self.store, text=text).splitlines()]
        degrees = self.run_ok('sample', self.store, '--to-crs', 'EPSG:4326', text=text)
        there = [row.split(';') for row in degrees.splitlines()]
        self.assertEqual(there[0], ['longitude', 'name', 'latitude', *plain[0][3:]])
        for row, other in zip(plain[1:], there[1:]):
            self.assertEqual(row[1:3] + row[4:], other[1:3] + other[4:])
            self.assertNotEqual(row[0], other[0])
        back = self.run_ok('sample', self.store, '--points-crs', 'EPSG:4326', '--to-crs', 'EPSG:32632',
                           text=''.join(f'{row[0]},{row[3]}\n' for row in there[1:]))
        for (x, y), line, row in zip(places, back.splitlines(), plain[1:]):
            east, north, height = map(float, line.split(',')[:3])
            self.assertAlmostEqual(east, x, delta=2e-4)
            self.assertAlmostEqual(north, y, delta=2e-4)
            self.assertAlmostEqual(height, float(row[4]), delta=1e-3)
        # Outside the area of the projection, there is neither a position nor a height.
        far = self.run_ok('sample', self.store, '--points-crs', 'EPSG:4326', '--to-crs', 'EPSG:3857',
                          text='0,90\n')
        self.assertEqual(far, ',,,,,\n')

    def test_positions_in_another_crs(self):
        inside = self.somewhere(5, 1)[0]
        there = self.answers('%f,%f\n' % inside)[0]
        lonlat = subprocess.run(['cs2cs', '-f', '%.12f', 'EPSG:32632', '+to', '+proj=longlat',
                                 '+datum=WGS84'],
                                input='%.6f %.6f\n' % inside, capture_output=True,
                                text=True).stdout.split() if shutil.which('cs2cs') else None
        if lonlat is None:
            self.skipTest('not installed: cs2cs')
        row = self.answers(f'lon,lat\n{lonlat[0]},{lonlat[1]}\n', '--points-crs', 'EPSG:4326')[1]
        self.assertAlmostEqual(float(row[2]), float(there[2]), places=3)

    def test_errors_name_the_line(self):
        self.assertIn('line 3', self.expect_error(1, 'sample', self.store, text='x,y\n1,2\n1,two\n'))
        self.assertIn('columns', self.expect_error(1, 'sample', self.store, text='x,y\n1\n'))
        self.assertIn('one column', self.expect_error(1, 'sample', self.store, text='just words\n'))
        self.expect_error(1, 'sample', self.store, '--points', self.path('nowhere.csv'))
        self.expect_error(2, 'sample', self.store, '--method', 'cubic', text='1,2\n')
        self.expect_error(2, 'sample', self.store, '--json', text='1,2\n')
        self.expect_error(2, 'sample', self.store, '--level', 99, text='1,2\n')

    def test_a_position_without_a_coordinate_has_no_height(self):
        for missing in ('', 'NA', 'nan', '"NA"'):
            lines = self.run_ok('sample', self.store, text=f'x,y\n{missing},2\n1,{missing}\n').split('\n')
            self.assertEqual(lines[1:3], [f'{missing},2,,,,', f'1,{missing},,,,'])

    def test_empty_input_gives_empty_output(self):
        self.assertEqual(self.run_ok('sample', self.store, text=''), '')

    def test_summary(self):
        out = self.path('answers.csv')
        x, y = self.somewhere(6, 1)[0]
        summary = json.loads(self.run_ok('sample', self.store, '--json', '-o', out,
                                         text=f'{x},{y}\n0,0\n'))
        self.assertEqual((summary['points'], summary['answered']), (2, 1))
        self.expect_error(1, 'sample', self.store, '-o', out, text='1,2\n')


class RasterTest(QueryTest):
    @needs('gdal_translate', 'gdalinfo')
    def test_the_default_lattice_is_the_rasters_own(self):
        out = self.path('same.tif')
        self.run_ok('raster', self.store, '-o', out)
        self.assertEqual(self.samples(out), self.samples(self.dem))
        ours, theirs = (json.loads(subprocess.run(['gdalinfo', '-json', f], capture_output=True,
                                                  text=True).stdout) for f in (out, self.dem))
        for key in 'size', 'geoTransform', 'cornerCoordinates':
            self.assertEqual(ours[key], theirs[key])
        self.assertIn('32632', ours['coordinateSystem']['wkt'])

    @needs('gdaldem', 'gdal_translate')
    def test_slope_aspect_and_hillshade_match_gdaldem(self):
        # gdaldem uses metres of the map, which differ from metres on the ground by the projection's
        # scale.
        for value, nodata, tolerance in (('slope', -9999, 0.03), ('aspect', -9999, 0.5),
                                         ('hillshade', 0, 1)):
            ours, theirs = self.path(value + '.tif'), self.path(value + '-gdal.tif')
            self.run_ok('raster', self.store, '--value', value, '-o', ours)
            subprocess.run(['gdaldem', value, '-q', self.dem, theirs], check=True)
            a, b = self.samples(ours), self.samples(theirs)
            self.assertEqual(sum(v == nodata for v in a), sum(v == nodata for v in b))
            off = 0
            for x, y in zip(a, b):
                d = abs(x - y)
                if value == 'aspect':
                    d = min(d, 360 - d)
                off += d > tolerance
            # On nearly level ground the aspect is arbitrary.
            self.assertLessEqual(off, SIZE * SIZE // 500 if value == 'aspect' else 0, value)

    @needs('gdallocationinfo')
    def test_cells_match_the_answers_of_sample(self):
        out = self.path('coarse.tif')
        self.run_ok('raster', self.store, '--cell', 97, '-o', out)
        text, cells = '', [(1, 1), (3, 5), (40, 17), (91, 91)]
        west = 97 * math.floor((self.low[0] - CELL / 2) / 97)
        north = 97 * math.ceil((self.high[1] + CELL / 2) / 97)
        for c, r in cells:
            text += f'{west + 97 * (c + 0.5)},{north - 97 * (r + 0.5)}\n'
        for (c, r), row in zip(cells, self.answers(text)):
            value = subprocess.run(['gdallocationinfo', '-valonly', out, str(c), str(r)],
                                   capture_output=True, text=True).stdout
            self.assertAlmostEqual(float(value), float(row[2]), places=3)

    def test_threads_and_memory_do_not_change_a_byte(self):
        one, two = self.path('one.tif'), self.path('two.tif')
        for value in 'height', 'hillshade':
            self.run_ok('raster', self.store, '--cell', 11, '--value', value, '--threads', 1, '--force',
                        '-o', one)
            self.run_ok('raster', self.store, '--cell', 11, '--value', value, '--threads', 3, '--force',
                        '--memory', '64M', '-o', two)
            self.assertTrue(filecmp.cmp(one, two, shallow=False))

    def test_regions_with_crossing_rings_are_refused(self):
        path = self.path('bow.geojson')
        with open(path, 'w') as file:
            json.dump({'type': 'Polygon', 'coordinates': [[[0, 0], [4, 4], [4, 0], [0, 4], [0, 0]]]}, file)
        for verb, output in ('points', 'out.xyz'), ('raster', 'out.tif'), ('mesh', 'out.ply'):
            text = self.expect_error(1, verb, self.store, '--region', path, '-o', self.path(output))
            for part in (path, 'polygon 1, outer ring', 'Self-intersection at 2, 2', 'Fix geometries'):
                self.assertIn(part, text)
            self.assertFalse(os.path.exists(self.path(output)))

    def test_regions(self):
        box = [self.low[0] + 300, self.low[1] + 600, self.low[0] + 1200, self.low[1] + 1800]
        summary = json.loads(self.run_ok('raster', self.store, '--region', ','.join(map(str, box)),
                                         '-o', self.path('region.tif'), '--json'))
        self.assertEqual((summary['columns'], summary['rows']), (31, 41))
        out = self.path('outside.tif')
        self.assertIn('is in the region; the points have x from', self.expect_error(1, 'raster', self.store, '--region',
                                                         '0,0,10,10', '-o', out))
        self.assertFalse(os.path.exists(out))
        self.expect_error(2, 'raster', self.store, '--cell', 0, '-o', out)
        self.expect_error(2, 'raster', self.store, '--value', 'mood', '-o', out)
        self.expect_error(2, 'raster', self.store, '--cell', 1e-9, '-o', out)

    @staticmethod
    def grid(path):
        """Origin, cell and size, as reported by GDAL."""
        info = json.loads(subprocess.run(['gdalinfo', '-json', path], capture_output=True, text=True, check=True).stdout)
        return info['geoTransform'], info['size']

    @needs('gdalwarp')
    def test_cells_begin_at_multiples_of_their_size(self):
        out, theirs = self.path('ours.tif'), self.path('theirs.tif')
        for cell in 7, 0.5, 12.1:
            box = [self.low[0] + 301.3, self.low[1] + 602.6, self.low[0] + 420.7, self.low[1] + 703.1]
            self.run_ok('raster', self.store, '--cell', cell, '--region', ','.join(map(str, box)), '-o', out, '--force')
            subprocess.run(['gdalwarp', '-q', '-overwrite', '-tap', '-tr', str(cell), str(cell), '-te', *map(str, box),
                            self.dem, theirs], check=True)
            (ours, size), (wanted, other) = self.grid(out), self.grid(theirs)
            self.assertEqual(size, other)
            for a, b in zip(ours, wanted):
                self.assertAlmostEqual(a, b, delta=1e-7)

    @needs('gdalinfo')
    def test_rasters_with_the_same_cell_size_are_aligned_for_any_selection(self):
        rng = random.Random(5)
        cloud, store = self.path('returns.csv'), self.path('returns.terrace')
        with open(cloud, 'w', encoding='ascii') as file:
            file.write('x,y,z,classification\n1000.013,2000.127,0,2\n1100.013,2100.127,0,2\n')
            for _ in range(3000):
                kind = rng.choice((2, 5))
                reach = 100 if kind == 2 else 97.3
                file.write(f'{1000.013 + rng.random() * reach},{2000.127 + rng.random() * reach},{rng.random()},{kind}\n')
        self.run_ok('build', cloud, '-o', store, '--force')
        grids = []
        for i, options in enumerate(((), ('--where', 'classification == 2'), ('--where', 'classification == 5'))):
            out = self.path(f'part{i}.tif')
            self.run_ok('raster', store, '--cell', 0.5, *options, '-o', out, '--force')
            grids.append(self.grid(out))
        self.assertEqual(grids[0], grids[1])
        self.assertEqual(grids[0], grids[2])
        self.assertEqual(grids[0][0][::3], [1000.0, 2100.5])
        part, aligned = self.path('corner.tif'), self.path('aligned.tif')
        self.run_ok('raster', store, '--cell', 0.5, '--region', '1020.2,2030.3,1040,2050', '-o', part, '--force')
        (x, _, _, y, _, _), _ = self.grid(part)
        self.assertEqual((x, y), (1020.0, 2050.0))
        self.run_ok('raster', store, '--align', part, '-o', aligned, '--force')
        self.assertEqual(self.grid(part), self.grid(aligned))
        self.assertEqual(self.samples(part), self.samples(aligned))
        self.run_ok('raster', store, '--align', self.path('part0.tif'), '--region', '1020,2030,1040,2050', '-o', aligned,
                    '--force')
        self.assertEqual(self.grid(aligned), grids[0])
        self.assertLessEqual(sum(z != -9999 for z in self.samples(aligned)), 41 * 41)
        out = self.path('none.tif')
        self.expect_error(2, 'raster', store, '--align', part, '--cell', 1, '-o', out)
        self.expect_error(1, 'raster', store, '--align', cloud, '-o', out)

    @needs('gdalinfo')
    def test_a_raster_can_be_aligned_with_one_in_another_crs(self):
        theirs, out = self.path('theirs-degrees.tif'), self.path('aligned-degrees.tif')
        self.run_ok('raster', self.store, '--to-crs', 'EPSG:4326', '--cell', 0.001, '-o', theirs, '--force')
        self.run_ok('raster', self.store, '--align', theirs, '-o', out, '--force')
        self.assertEqual(self.grid(theirs), self.grid(out))
        self.assertEqual(self.samples(theirs), self.samples(out))

    def test_align_says_which_crs_is_unknown(self):
        grid, cloud, store, out = map(self.path, ('no-crs.asc', 'no-crs.csv', 'no-crs.terrace', 'no-crs.tif'))
        with open(grid, 'w', encoding='ascii') as file:
            file.write(f'ncols 3\nnrows 2\nxllcorner {self.low[0]}\nyllcorner {self.low[1]}\ncellsize {CELL}\n1 2 3\n4 5 6\n')
        result = terrace('raster', self.store, '--align', grid, '-o', out, '--force')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("no-crs.asc: assuming that its grid is in the store's CRS, because the CRS of the file is unknown",
                      result.stderr)
        error = self.expect_error(2, 'raster', self.store, '--align', grid, '--to-crs', 'EPSG:4326', '-o', out, '--force')
        self.assertIn("no-crs.asc is unknown, so --align uses the store's: leave --to-crs out", error)
        with open(cloud, 'w', encoding='ascii') as file:
            file.write('x,y,z\n')
            for x, y in itertools.product((self.low[0], self.high[0]), (self.low[1], self.high[1])):
                file.write(f'{x},{y},1\n')
        self.run_ok('build', cloud, '-o', store, '--force')
        result = terrace('raster', store, '--align', self.dem, '-o', out, '--force')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("dem.tif: assuming that its grid is in the store's CRS, because the CRS of the store is unknown",
                      result.stderr)

    @needs('gdalinfo')
    def test_a_raster_in_another_crs(self):
        out = self.path('degrees.tif')
        self.run_ok('raster', self.store, '--to-crs', 'EPSG:4326', '-o', out)
        info = json.loads(subprocess.run(['gdalinfo', '-json', out], capture_output=True,
                                         text=True).stdout)
        self.assertIn('4326', info['coordinateSystem']['wkt'])


class ContourTest(QueryTest):
    def lines(self, *options):
        out = self.path('lines.geojson')
        self.run_ok('contour', self.store, '-o', out, '--force', *options)
        with open(out) as file:
            return json.load(file)['features']

    @needs('gdal_contour')
    def test_lengths_match_gdal_contour(self):
        # On smooth ground. On rough ground, lines across squares differ from lines across
        # triangles.
        smooth, store, theirs = (self.path(name) for name in ('smooth.tif', 'smooth.terrace',
                                                              'gdal.geojson'))
        box = [self.low[0] + 1000, self.low[1] + 1000, self.low[0] + 2800, self.low[1] + 2800]
        self.run_ok('raster', self.store, '--method', 'natural', '--cell', 6, '--region',
                    ','.join(map(str, box)), '-o', smooth)
        self.run_ok('build', smooth, '-o', store)
        out = self.path('smooth.geojson')
        self.run_ok('contour', store, '--interval', 10, '-o', out)
        with open(out) as file:
            lines = json.load(file)['features']
        subprocess.run(['gdal_contour', '-q', '-i', '10', '-a', 'elev', '-f', 'GeoJSON', smooth,
                        theirs], check=True)
        with open(theirs) as file:
            other = json.load(file)['features']

        def metres(points):
            # Computed on a sphere, to within half a per cent, like the map's scale.
            for (x0, y0), (x1, y1) in zip(points, points[1:]):
                degree = math.pi / 180 * 6371000
                yield math.hypot((x1 - x0) * degree * math.cos(math.radians((y0 + y1) / 2)),
                                 (y1 - y0) * degree)

        ours, gdal = {}, {}
        for feature in lines:
            elev = feature['properties']['elev']
            ours[elev] = ours.get(elev, 0) + sum(metres(feature['geometry']['coordinates']))
        for feature in other:
            elev, points = feature['properties']['elev'], feature['geometry']['coordinates']
            # GDAL writes the raster's CRS or degrees, depending on its version.
            length = (sum(metres(points)) if abs(points[0][0]) <= 180 else
                      sum(math.dist(p, q) for p, q in zip(points, points[1:])))
            gdal[elev] = gdal.get(elev, 0) + length
        self.assertEqual(set(ours), set(gdal))
        self.assertAlmostEqual(sum(ours.values()) / sum(gdal.values()), 1, delta=0.03)

    def test_lines_are_at_their_height_and_end_only_at_the_border(self):
        features = self.lines('--interval', 100)
        self.assertGreater(len(features), 5)
        for feature in features:
            points = feature['geometry']['coordinates']
            self.assertGreaterEqual(len(points), 2)
            text = 'lon,lat\n' + ''.join(f'{x},{y}\n' for x, y in points[:50])
            for row in self.answers(text, '--points-crs', 'EPSG:4326')[1:]:
                if row[2]:
                    self.assertAlmostEqual(float(row[2]), feature['properties']['elev'], delta=0.01)

    def test_levels_are_written_as_decimal_multiples(self):
        ramp, store = self.path('ramp.xyz'), self.path('ramp.terrace')
        with open(ramp, 'w', encoding='ascii') as file:
            file.writelines(f'{x} {y} {x * 0.31}\n' for x in range(12) for y in range(12))
        self.run_ok('build', ramp, '-o', store, '--force')
        for step, power in (1, 10), (7, 10), (5, 100), (3, 1000):
            text = self.run_ok('contour', store, '--interval', step / power, '--own-crs', '-o', '-')
            found = set(re.findall(r'"elev":([^}]*)', text))
            self.assertLessEqual(found, {repr(i * step / power).removesuffix('.0') for i in range(1200)})
            self.assertGreater(len(found), 3)
        # GeoJSON without a crs member is in longitude and latitude.
        self.assertIn('"crs":null', text)
        text = self.run_ok('contour', self.store, '--interval', 500, '--own-crs', '-o', '-')
        self.assertIn('"crs":{"type":"name","properties":{"name":"urn:ogc:def:crs:EPSG::', text)

    def test_threads_do_not_change_a_byte(self):
        one = self.run_ok('contour', self.store, '--interval', 20, '--threads', 1, '-o', '-')
        self.assertEqual(one, self.run_ok('contour', self.store, '--interval', 20, '--threads', 3,
                                          '--memory', '64M', '-o', '-'))

    def test_bad_values(self):
        out = self.path('none.geojson')
        self.expect_error(2, 'contour', self.store, '--interval', 0, '-o', out)
        self.expect_error(1, 'contour', self.store, '--interval', 9, '--region', '0,0,1,1', '-o', out)
        self.assertFalse(os.path.exists(out))


class ProfileTest(QueryTest):
    def rows(self, *options):
        text = self.run_ok('profile', self.store, '-o', '-', *options)
        return [[float(cell) if cell else None for cell in row.values()]
                for row in csv.DictReader(io.StringIO(text))]

    def test_rows_are_on_the_surface_and_distances_grow(self):
        (x0, y0), (x1, y1) = self.somewhere(8, 2)
        rows = self.rows('--line', f'{x0},{y0},{x1},{y1}')
        self.assertGreater(len(rows), 20)
        self.assertEqual(rows[0][:3], [0, x0, y0])
        self.assertEqual(rows[-1][1:3], [x1, y1])
        for a, b in zip(rows, rows[1:]):
            self.assertLess(a[0], b[0] + 1e-9)
        heights = self.answers(''.join(f'{r[1]!r},{r[2]!r}\n' for r in rows))
        for row, answer in zip(rows, heights):
            self.assertAlmostEqual(row[3], float(answer[2]), places=3)
        # Between rows the surface is straight.
        middles = [((a[1] + b[1]) / 2, (a[2] + b[2]) / 2, (a[3] + b[3]) / 2)
                   for a, b in zip(rows, rows[1:])]
        for (_, _, z), answer in zip(middles, self.answers(''.join(f'{x!r},{y!r}\n' for x, y, _ in middles))):
            self.assertAlmostEqual(z, float(answer[2]), places=3)

    def test_steps_are_metres_on_the_ground(self):
        (x0, y0), (x1, y1) = self.somewhere(9, 2)
        rows = self.rows('--line', f'{x0},{y0},{x1},{y1}', '--step', 100)
        for i, row in enumerate(rows[:-1]):
            self.assertAlmostEqual(row[0], 100 * i, places=3)
        # The scale of a UTM zone is within 0.1 per cent.
        self.assertAlmostEqual(rows[-1][0] / math.hypot(x1 - x0, y1 - y0), 1, delta=0.001)

    def test_lines_from_files_and_invalid_lines(self):
        (x0, y0), (x1, y1) = self.somewhere(10, 2)
        name = self.path('line.geojson')
        with open(name, 'w') as file:
            json.dump({'type': 'Feature', 'properties': {}, 'geometry': {
                'type': 'LineString', 'coordinates': [[x0, y0], [x1, y1]]}}, file)
        self.assertEqual(self.rows('--line', name), self.rows('--line', f'{x0},{y0},{x1},{y1}'))
        out = self.path('none.csv')
        self.expect_error(2, 'profile', self.store, '--line', '1,2,3', '-o', out)
        self.expect_error(1, 'profile', self.store, '--line', self.path('nowhere'), '-o', out)
        self.expect_error(2, 'profile', self.store, '--line', '1,2,3,4', '--step', 0, '-o', out)


class FocusTest(QueryTest):
    """Mixed levels are the mesh of mixed levels, level 0 inside the focus and level `top` far from it."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        middle = [0.5 * (low + high) for low, high in zip(cls.low, cls.high)]
        cls.box = [middle[0] - 1500, middle[1] - 1200, middle[0] + 1500, middle[1] + 1200]
        cls.mixed = '--level', 'top', '--focus', ','.join(map(str, cls.box)) + ':0'

    def is_inside(self, x, y, margin):
        return (self.box[0] + margin < x < self.box[2] - margin and
                self.box[1] + margin < y < self.box[3] - margin)

    def test_heights_are_those_of_a_level_inside_and_far_outside(self):
        places = self.somewhere(5, 3000)
        text = 'x,y\n' + ''.join(f'{x!r},{y!r}\n' for x, y in places)
        mixed = self.answers(text, *self.mixed)[1:]
        fine, coarse = self.answers(text)[1:], self.answers(text, '--level', 'top')[1:]
        inside = outside = 0
        for (x, y), got, exact, rough in zip(places, mixed, fine, coarse):
            if self.is_inside(x, y, 2 * CELL):
                self.assertEqual(got, exact)
                inside += 1
            elif not self.is_inside(x, y, -2000):
                outside += got == rough
        self.assertGreater(inside, 100)
        self.assertGreater(outside, 100)
        self.assertNotEqual(mixed, coarse)

    def test_heights_are_those_of_the_mesh(self):
        mesh = self.path('mixed.ply')
        self.run_ok('mesh', self.store, *self.mixed, '--format', 'ply-ascii', '-o', mesh)
        with open(mesh, encoding='utf-8') as file:
            header, body = file.read().split('end_header\n')
        count = int(re.search(r'element vertex (\d+)', header).group(1))
        vertices = [line.split()[:3] for line in body.splitlines()[:count]]
        text = 'x,y\n' + ''.join(f'{x},{y}\n' for x, y, _ in vertices)
        for (_, _, z), answer in zip(vertices, self.answers(text, *self.mixed)[1:]):
            self.assertAlmostEqual(float(answer[2]), float(z), places=3)

    @needs('gdal_translate')
    def test_rasters_have_the_cells_of_level_0_inside(self):
        fine, mixed = self.path('fine.tif'), self.path('mixed.tif')
        self.run_ok('raster', self.store, '-o', fine)
        self.run_ok('raster', self.store, *self.mixed, '-o', mixed)
        inside = other = 0
        for i, (got, exact) in enumerate(zip(self.samples(mixed), self.samples(fine))):
            x = self.low[0] + i % SIZE * CELL
            y = self.high[1] - i // SIZE * CELL
            if self.is_inside(x, y, 2 * CELL):
                self.assertEqual(got, exact)
                inside += 1
            else:
                other += got != exact
        self.assertGreater(inside, 1000)
        self.assertGreater(other, 1000)

    def test_contours_and_profiles_have_more_points_in_the_focus(self):
        ends = [self.low[0] + 10, self.low[1] + 20, self.high[0] - 30, self.high[1] - 10]
        for name, verb in ('lines.geojson', ('contour', '--interval', 20)), \
                          ('way.csv', ('profile', '--line', ','.join(map(str, ends)))):
            out = self.path(name)
            points = [json.loads(self.run_ok(verb[0], self.store, *verb[1:], *options, '--json', '--force',
                                             '-o', out))['points']
                      for options in (('--level', 'top'), self.mixed, ())]
            self.assertLess(points[0], points[1])
            self.assertLess(points[1], points[2])

    def test_summaries_name_the_levels(self):
        top = len(json.loads(self.run_ok('info', self.store, '--json'))['levels']) - 1
        out = self.path('summary.tif')
        verb = 'raster', self.store, '--cell', 300, '--force', '-o', out
        self.assertIn(f'level {top}, with focuses of level 0\n', terrace(*verb, *self.mixed).stderr)
        self.assertNotIn('focuses', terrace(*verb).stderr)
        for options, expected in ((), [0, []]), (('--level', 1), [1, []]), (self.mixed, [top, [0]]), \
                                 (self.mixed[2:], [top, [0]]):
            summary = json.loads(self.run_ok(*verb, *options, '--json'))
            self.assertEqual([summary['level'], summary['focus_levels']], expected)

    def test_focuses_are_read_as_by_mesh(self):
        x, y = self.low[0] + 500, self.low[1] + 500
        line = f'{x},{y},{x + 900},{y + 800}'
        verbs = [('sample', self.store, '--points', '-', '--focus'),
                 ('raster', self.store, '--cell', 100, '-o', self.path('x.tif'), '--force', '--focus'),
                 ('contour', self.store, '--interval', 20, '-o', self.path('x.geojson'), '--force', '--focus'),
                 ('profile', self.store, '--line', line, '-o', self.path('x.csv'), '--force', '--focus')]
        mesh = 'mesh', self.store, '-o', self.path('x.ply'), '--force', '--focus'
        for wrong in '1,2,3,4', '1,2,3:0', '3,2,1,4:0', f'{line}:99', f'{line}:x', 'none.geojson:0':
            expected = terrace(*mesh, wrong)
            self.assertNotEqual(expected.returncode, 0)
            for verb in verbs:
                result = terrace(*verb, wrong, text='1,2\n')
                self.assertEqual((result.returncode, result.stderr.replace(f'terrace {verb[0]}', 'terrace mesh')),
                                 (expected.returncode, expected.stderr))
        for verb in verbs:
            result = terrace(*verb, '0,0,1,1:0', text=f'{x},{y}\n')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('--focus is outside the store and adds no points', result.stderr)

    def test_focuses_are_in_the_reference_system_of_the_places(self):
        [(x, y)] = self.somewhere(8, 1)
        [[_, _, *expected]] = self.answers(f'{x},{y}\n')
        lonlat = self.run_ok('sample', self.store, '--to-crs', 'EPSG:4326', text=f'{x},{y}\n').split(',')[:2]
        box = ','.join(str(float(c) + d) for d in (-0.01, 0.01) for c in lonlat)
        got = self.run_ok('sample', self.store, '--points-crs', 'EPSG:4326', '--level', 'top', '--focus',
                          box + ':0', text=','.join(lonlat) + '\n').strip().split(',')
        self.assertAlmostEqual(float(got[2]), float(expected[0]), places=3)


class BoundTest(QueryTest):
    """A surface of few triangles is within --max-error of every sample."""

    @needs('gdal_translate')
    def test_rasters_are_within_the_bound(self):
        fine, few, steep = self.path('fine.tif'), self.path('few.tif'), self.path('steep.tif')
        self.run_ok('raster', self.store, '-o', fine)
        text = terrace('raster', self.store, '--max-error', 5, '-o', few).stderr
        self.assertIn('within 5 m of every sample\n', text)
        errors = [abs(a - b) for a, b in zip(self.samples(few), self.samples(fine))]
        self.assertLessEqual(max(errors), 5.001)
        self.assertGreater(max(errors), 3)
        self.assertGreater(errors.count(0.0), 100)
        # A part of the raster has the same cells.
        box = [self.low[0] + 40 * CELL, self.low[1] + 50 * CELL, self.low[0] + 90 * CELL, self.low[1] + 80 * CELL]
        self.run_ok('raster', self.store, '--max-error', 5, '--region', ','.join(map(str, box)), '-o', steep)
        part, whole = list(self.samples(steep)), list(self.samples(few))
        self.assertEqual(len(part), 51 * 31)
        for row in range(31):
            begin = (SIZE - 1 - 80 + row) * SIZE + 40
            self.assertEqual(part[row * 51:row * 51 + 51], whole[begin:begin + 51])

    def test_samples_have_the_heights_and_slopes_of_the_triangles(self):
        places = self.somewhere(6, 500)
        text = 'x,y\n' + ''.join(f'{x!r},{y!r}\n' for x, y in places)
        exact, few = self.answers(text)[1:], self.answers(text, '--max-error', 5)[1:]
        self.assertLess(len({row[3] for row in few}), len({row[3] for row in exact}))
        self.assertNotEqual(exact, few)
        # Alone, places have the same answers.
        for i in (3, 77, 401):
            x, y = places[i]
            alone = self.run_ok('sample', self.store, '--max-error', 5, text=f'{x!r},{y!r}\n')
            self.assertEqual(alone.strip().split(','), few[i])
        [x, y], samples = self.low[:2], []
        for i in range(0, 40, 3):
            samples.append(f'{x + i * CELL!r},{y + (60 - i) * CELL!r}\n')
        for a, b in zip(self.answers(''.join(samples)), self.answers(''.join(samples), '--max-error', 5)):
            self.assertLessEqual(abs(float(a[2]) - float(b[2])), 5.001)

    def test_contours_and_profiles_have_few_points(self):
        ends = [self.low[0] + 10, self.low[1] + 20, self.high[0] - 30, self.high[1] - 10]
        for name, verb in ('few.geojson', ('contour', '--interval', 20)), \
                          ('few.csv', ('profile', '--line', ','.join(map(str, ends)))):
            out = self.path(name)
            summaries = [json.loads(self.run_ok(verb[0], self.store, *verb[1:], *options, '--json', '--force', '-o', out))
                         for options in ((), ('--max-error', 5), ('--max-error', 30))]
            points = [summary['points'] for summary in summaries]
            self.assertGreater(points[0], points[1])
            self.assertGreater(points[1], points[2])
            self.assertEqual([summary.get('max_error') for summary in summaries], [None, 5, 30])
        self.run_ok('contour', self.store, '--interval', 20, '--max-error', 5, '--own-crs', '-o', self.path('own.geojson'))
        self.run_ok('profile', self.store, '--line', ','.join(map(str, ends)), '--max-error', 5, '-o', self.path('own.csv'))
        with open(self.path('own.csv'), encoding='utf-8') as file:
            rows = list(csv.DictReader(file))
        got = self.answers('x,y\n' + ''.join(f"{row['x']},{row['y']}\n" for row in rows[1:-1]), '--max-error', 5)[1:]
        for row, answer in zip(rows[1:-1], got):
            self.assertAlmostEqual(float(row['height']), float(answer[2]), delta=0.01)
        with open(self.path('own.geojson'), encoding='utf-8') as file:
            lines = json.load(file)['features']
        for line in lines[:50]:
            [[x, y], *_] = line['geometry']['coordinates'][1:]
            [[_, _, height, *_]] = self.answers(f'{x},{y}\n', '--max-error', 5)
            self.assertAlmostEqual(float(height), line['properties']['elev'], delta=0.01)

    def test_the_bound_excludes_other_surfaces(self):
        out = self.path('none.tif')
        for wrong in ('--level', 1), ('--focus', '0,0,1,1:0'), ('--max-edge', 9), ('--method', 'natural'), ('--method', 'nearest'):
            error = self.expect_error(2, 'raster', self.store, '--max-error', 5, *wrong, '-o', out)
            self.assertIn('--max-error', error)
        self.expect_error(2, 'raster', self.store, '--max-error', -1, '-o', out)
        self.assertFalse(os.path.exists(out))


if __name__ == '__main__':
    unittest.main()
