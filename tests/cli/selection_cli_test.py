#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares --where, --region, --keep and --drop with filters in Python.

TERRACE=path/to/terrace selection_cli_test.py
"""

import csv
import json
import os
import random
import subprocess
import tempfile
import unittest

from small_tiff import GEOGRAPHIC, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
NAMES = ['x', 'y', 'z', 'classification', 'return_number', 'number_of_returns', 'red', 'green']


def last_on_the_ground(p):
    return p['classification'] == 2 and p['return_number'] == p['number_of_returns']


UTM_32 = ('PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
          'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
          'PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],'
          'PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]')
LAST_ON_THE_GROUND = 'classification == 2 && return_number == last'


class SelectionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        seed = 7
        print('seed', seed)
        rng = random.Random(seed)
        cls.points = []
        for _ in range(20000):
            returns = rng.randint(1, 4)
            cls.points.append(dict(zip(NAMES, [
                rng.randrange(100000) / 100, rng.randrange(100000) / 100, rng.randrange(3000) / 100,
                rng.choice([1, 2, 2, 5]), rng.randint(1, returns), returns,
                rng.randrange(256), rng.randrange(256)])))
        cls.file = cls.path('all.csv')
        with open(cls.file, 'w', newline='', encoding='ascii') as file:
            writer = csv.writer(file)
            writer.writerow(NAMES)
            writer.writerows(p.values() for p in cls.points)
        cls.run_ok('build', cls.file, '-o', cls.path('all.st'), '--block', '1000', '-q')

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def terrace(*args):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)

    @classmethod
    def run_ok(cls, *args):
        result = cls.terrace(*args)
        if result.returncode != 0:
            raise AssertionError(result.stderr)
        return result.stdout

    def rows(self, name):
        with open(self.path(name), newline='', encoding='ascii') as file:
            reader = csv.DictReader(file)
            return reader.fieldnames, sorted(tuple(map(float, row.values())) for row in reader)

    def expect(self, name, selected, columns):
        names, rows = self.rows(name)
        self.assertEqual(names, columns)
        self.assertEqual(rows, sorted(tuple(float(p[c]) for c in columns)
                                      for p in self.points if selected(p)))

    def test_points_with_nan_are_skipped_and_counted(self):
        def write(name, text):
            with open(self.path(name), 'w', encoding='ascii') as file:
                file.write(text)
            return self.path(name)

        ply = 'ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n'
        rows = '0 0 1\nnan 1 2\n5 0 2\n0 7 3\n1 2 NaN\n'
        for file in (write('holes.xyz', rows), write('holes.csv', 'x,y,z\n' + rows.replace(' ', ',')),
                     write('holes.ply', ply.format(5) + rows)):
            store = file + '.st'
            result = self.terrace('build', file, '-o', store)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('3 points (2 without a coordinate left out)', result.stderr)
            self.assertEqual(json.loads(self.run_ok('info', store, '--json'))['nodata'], 2)
            self.assertIn('3, and 2 without coordinates', self.run_ok('info', file))
            for keep in ('x > -1', 'z < 3'):
                built = json.loads(self.run_ok('build', file, '--where', keep, '-o', store, '--force', '--json'))
                self.assertEqual((built['points'] + built['excluded'], built['nodata']), (3, 2))
            result = self.terrace('match', file, '-o', self.path('pairs.csv'), '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('2 points without a coordinate are left out', result.stderr)
        for file, words in ((write('none.xyz', 'nan 1 2\n'), 'has no point (1 point, all without a coordinate)'),
                            (write('inf.ply', ply.format(1) + '1 2 inf\n'), 'a coordinate is infinite')):
            result = self.terrace('build', file, '-o', self.path('none.st'))
            self.assertEqual(result.returncode, 1)
            self.assertIn(words, result.stderr)

    def test_empty_attributes_of_text_are_nan_and_counted(self):
        rows = ['x y z intensity colour', '0 0 1 7 ', '5 0 2  NA', '0  3  8', '0 7 3  4']
        for name, separator in (('empty.csv', ','), ('empty.tsv', '\t')):
            with open(self.path(name), 'w', encoding='ascii') as file:
                file.write('\n'.join(rows).replace(' ', separator) + '\n')
            store = self.path(name + '.st')
            result = self.terrace('build', self.path(name), '-o', store)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('3 points (1 without a coordinate left out)', result.stderr)
            self.assertIn('4 attributes have no value in their file; they are NaN', result.stderr)
            self.assertIn('4 attributes without a value', self.run_ok('info', self.path(name)))
            self.assertEqual(json.loads(self.run_ok('info', self.path(name), '--json'))['empty_values'], 4)
            result = self.terrace('convert', self.path(name), '-o', self.path(name + '.ply'))
            self.assertIn('4 attributes without a value are NaN', result.stderr)
            out = self.run_ok('points', store, '--level', '0', '--where', 'colour == 4', '-o', '-', '--format', 'xyz')
            self.assertEqual(out, '0 7 3 nan 4\n')
            # A dropped attribute does not count as lost.
            result = self.terrace('build', self.path(name), '-o', store, '--force', '--drop', 'colour')
            self.assertIn('2 attributes have no value', result.stderr)

    def test_build_accepts_folders_lists_and_patterns(self):
        folder = self.path('parts')
        os.makedirs(os.path.join(folder, 'more'))
        with open(self.file, encoding='ascii') as file:
            head, *lines = file.readlines()
        for name, part in (('1.csv', lines[:9000]), ('more/2.csv', lines[9000:])):
            with open(os.path.join(folder, name), 'w', encoding='ascii') as file:
                file.writelines([head, *part])
        with open(self.path('parts.lst'), 'w', encoding='ascii') as file:
            file.write('# of the survey\nparts/1.csv\nparts/more\n')
        for number, names in enumerate(([folder], ['@' + self.path('parts.lst')],
                                        [folder + '/*.csv', folder + '/more/?.csv'],
                                        [folder + '/**/*.csv'], [self.path('p*ts/**')])):
            store = self.path(f'parts{number}.st')
            self.run_ok('build', *names, '-o', store, '--block', '1000', '-q')
            self.assertEqual(json.loads(self.run_ok('verify', store, '--json'))['points'], 20000)
            for name in os.listdir(store):
                with open(os.path.join(store, name), 'rb') as one, \
                        open(self.path(f'all.st/{name}'), 'rb') as other:
                    self.assertEqual(one.read(), other.read(), name)
            told = json.loads(self.run_ok('info', *names, '--json'))
            self.assertEqual((told['points'], told['files']), (20000, 2))
            # One file with all of them gives the same points.
            self.run_ok('convert', *names, '-o', self.path(f'parts{number}.csv'))
            with open(self.file, encoding='ascii') as one, \
                    open(self.path(f'parts{number}.csv'), encoding='ascii') as other:
                first, second = list(csv.reader(one)), list(csv.reader(other))
                self.assertEqual(first[0], second[0])
                self.assertEqual([list(map(float, row)) for row in first[1:]],
                                 [list(map(float, row)) for row in second[1:]])
        # A folder with several formats.
        self.run_ok('convert', self.file, '-o', os.path.join(folder, 'more', 'all.ply'))
        self.assertIn('or select files of a folder by --input-format', self.terrace('info', folder).stderr)
        told = json.loads(self.run_ok('info', folder, '--input-format', 'ply', '--json'))
        self.assertEqual((told['points'], told['files'], told['format']), (20000, 1, 'ply'))
        result = self.terrace('build', folder + '/*.las', '-o', self.path('none.st'))
        self.assertEqual(result.returncode, 1)
        self.assertIn('no file matches', result.stderr)

    def test_names_with_commas_can_be_quoted(self):
        with open(self.path('names.csv'), 'w') as file:
            file.write('x,y,z,"c,d",e\r1,2,3,4,5\r6,7,9,8,9\r')
        for options in (['--keep', '"c,d"'], ['--drop', 'e'], ['--keep', '"c,d",e', '--drop', 'e']):
            self.run_ok('build', self.path('names.csv'), '-o', self.path('names.st'), '--force', '-q', *options)
            channels = json.loads(self.run_ok('info', self.path('names.st'), '--json'))['channels']
            self.assertEqual([c['name'] for c in channels], ['x', 'y', 'z', 'c,d'])
        result = self.terrace('build', self.path('names.csv'), '-o', self.path('n.st'), '--keep', '"c,d"e')
        self.assertEqual(result.returncode, 2, result.stderr)

    def test_build_selects_points_and_attributes(self):
        summary = json.loads(self.run_ok(
            'build', self.file, '-o', self.path('ground.st'), '--block', '1000', '--json',
            '--where', LAST_ON_THE_GROUND, '--keep', 'classification,red'))
        ground = sum(map(last_on_the_ground, self.points))
        self.assertEqual((summary['points'], summary['excluded']), (ground, 20000 - ground))
        self.run_ok('points', self.path('ground.st'), '-o', self.path('ground.csv'), '-q')
        self.expect('ground.csv', last_on_the_ground, ['x', 'y', 'z', 'classification', 'red'])
        self.run_ok('build', self.file, '-o', self.path('bare.st'), '--drop', 'red,green', '-q')
        self.run_ok('points', self.path('bare.st'), '-o', self.path('bare.csv'), '-q')
        self.expect('bare.csv', lambda p: True, NAMES[:-2])

    def test_convert_selects_points_and_attributes(self):
        summary = json.loads(self.run_ok(
            'convert', self.file, '-o', self.path('c.csv'), '--json',
            '--where', 'not (z < 12.5 or x >= 300) and red > 1.5 * green', '--keep', 'red,green',
            '--drop', 'green'))
        selected = lambda p: not (p['z'] < 12.5 or p['x'] >= 300) and p['red'] > 1.5 * p['green']
        self.expect('c.csv', selected, ['x', 'y', 'z', 'red'])
        self.assertEqual(summary['excluded'], 20000 - sum(map(selected, self.points)))
        self.run_ok('convert', self.file, '-o', self.path('none.csv'), '--keep', 'none', '-q')
        self.expect('none.csv', lambda p: True, ['x', 'y', 'z'])

    def test_region_selects_points_of_files(self):
        selected = lambda p: 100 <= p['x'] <= 400 and 100 <= p['y'] <= 500.5 and 5 <= p['z'] <= 25
        summary = json.loads(self.run_ok('convert', self.file, '-o', self.path('r.csv'), '--json',
                                         '--region', '100,100,5,400,500.5,25'))
        self.expect('r.csv', selected, NAMES)
        self.assertEqual(summary['excluded'], 20000 - sum(map(selected, self.points)))
        selected = lambda p: 100 <= p['x'] <= 400 and 100 <= p['y'] <= 500.5 and p['red'] > 100
        self.run_ok('build', self.file, '-o', self.path('r.st'), '-q', '--region', '100,100,400,500.5',
                    '--where', 'red > 100', '--drop', 'green')
        self.run_ok('points', self.path('r.st'), '-o', self.path('r2.csv'), '-q')
        self.expect('r2.csv', selected, NAMES[:-1])

    def raster(self, name, side=10, prj=None):
        """Writes 40 x 30 cells from the origin, one row void; returns the cells by their centres."""
        with open(self.path(name), 'w', encoding='ascii') as file:
            file.write(f'ncols 40\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize {side}\nNODATA_value -9\n')
            for row in range(30):
                file.write(' '.join(str(-9 if row == 20 else row * 40 + column) for column in range(40)) + '\n')
        if prj:
            with open(self.path(os.path.splitext(name)[0] + '.prj'), 'w', encoding='ascii') as file:
                file.write(prj)
        return [((column + 0.5) * side, (29.5 - row) * side, row * 40 + column)
                for row in range(30) if row != 20 for column in range(40)]

    def geojson(self, name, *polygons):
        with open(self.path(name), 'w', encoding='ascii') as file:
            json.dump({'type': 'MultiPolygon', 'coordinates': [
                [ring + ring[:1] for ring in polygon] for polygon in polygons]}, file)
        return self.path(name)

    def test_region_of_a_raster_selects_the_cells_with_centres_inside(self):
        centres = self.raster('r.asc')
        selected = sorted(c for c in centres if 95 <= c[0] <= 201 and 50 <= c[1] <= 165)
        summary = json.loads(self.run_ok('convert', self.path('r.asc'), '-o', self.path('cells.csv'), '--json',
                                         '--region', '95,50,201,165'))
        self.assertEqual(self.rows('cells.csv')[1], selected)
        # Whether cells that are not read have data is unknown.
        self.assertEqual(summary['points'] + summary['nodata'] + summary['excluded'], 40 * 30)
        self.assertTrue(11 <= summary['nodata'] <= 15, summary)
        # The store of a part gives the raster of that part.
        summary = json.loads(self.run_ok('build', self.path('r.asc'), '-o', self.path('cropped.st'), '--json',
                                         '--region', '95,50,201,165'))
        self.assertEqual(summary['points'] + summary['nodata'] + summary['excluded'], 40 * 30)
        self.run_ok('points', self.path('cropped.st'), '-o', self.path('cropped.csv'), '-q')
        self.assertEqual(self.rows('cropped.csv')[1], selected)
        summary = json.loads(self.run_ok('raster', self.path('cropped.st'), '-o', self.path('cropped.tif'), '--json'))
        self.assertTrue(11 <= summary['columns'] <= 15 and 12 <= summary['rows'] <= 16, summary)
        self.assertEqual(summary['cells'] - summary['nodata'], len(selected))
        trial = json.loads(self.run_ok('build', self.path('r.asc'), '-o', self.path('trial.st'), '--json',
                                       '--dry-run', '--region', '95,50,201,165'))
        self.assertEqual(trial['points'], len(selected))

    def test_region_of_polygons(self):
        """Regions are closed, as for stores: points on a ring are inside, also on the ring of a hole."""
        box = lambda x, y, side: [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
        # A square with a hole, two overlapping triangles, and a square outside.
        region = self.geojson('region.geojson', [box(55, 55, 200), box(105, 105, 50)],
                              [[[205, 205], [395, 205], [205, 395]]], [[[205, 205], [395, 205], [395, 395]]],
                              [box(5000, 5000, 10)])

        def inside(x, y):
            return (55 <= x <= 255 and 55 <= y <= 255 and not (105 < x < 155 and 105 < y < 155) or
                    x >= 205 and y >= 205 and x + y <= 600 or y >= 205 and x <= 395 and y <= x)

        centres = self.raster('polygons.asc')
        for name, among in (('polygons.asc', [(c, inside(*c[:2])) for c in centres]),
                            ('all.csv', [(tuple(map(float, p.values())), inside(p['x'], p['y'])) for p in self.points])):
            with self.subTest(name=name):
                selected = sorted(c for c, chosen in among if chosen)
                self.assertTrue(100 < len(selected) < len(among) / 2)
                self.run_ok('convert', self.path(name), '-o', self.path('c.csv'), '--force', '-q', '--region', region)
                self.assertEqual(self.rows('c.csv')[1], selected)
                self.run_ok('build', self.path(name), '-o', self.path('p.st'), '--force', '-q', '--region', region)
                self.run_ok('points', self.path('p.st'), '-o', self.path('p.csv'), '--force', '-q')
                self.assertEqual(self.rows('p.csv')[1], selected)
                # The same region of a store of everything.
                self.run_ok('build', self.path(name), '-o', self.path('w.st'), '--force', '-q')
                self.run_ok('points', self.path('w.st'), '-o', self.path('p.csv'), '--force', '-q', '--region', region)
                self.assertEqual(self.rows('p.csv')[1], selected)

    def test_region_in_another_crs(self):
        """A region selects the same points of a file and of its store."""
        self.raster('utm.asc', 1000, UTM_32)
        corners = [[4.52, 0.02], [4.77, 0.05], [4.83, 0.21], [4.6, 0.26]]
        hole = [[4.6, 0.1], [4.7, 0.12], [4.66, 0.17]]
        polygon = self.geojson('lonlat.geojson', [corners, hole])
        self.run_ok('build', self.path('utm.asc'), '-o', self.path('utm.st'), '-q')
        self.run_ok('convert', self.path('utm.asc'), '-o', self.path('utm.csv'), '-q')
        for file in ('utm.asc', 'utm.csv'):
            crs = ['--crs', 'EPSG:32632'] if file == 'utm.csv' else []
            for region in (polygon, '4.6,0.05,4.7,0.2'):
                with self.subTest(file=file, region=region):
                    args = ['--region', region, '--region-crs', 'EPSG:4326', '-q', '--force', '-o']
                    self.run_ok('points', self.path('utm.st'), *args, self.path('wanted.csv'))
                    selected = self.rows('wanted.csv')[1]
                    self.assertGreater(len(selected), 100)
                    self.run_ok('build', self.path(file), *crs, *args, self.path('part.st'))
                    self.run_ok('points', self.path('part.st'), '-o', self.path('found.csv'), '-q', '--force')
                    self.assertEqual(self.rows('found.csv')[1], selected)
                    if not crs:
                        self.run_ok('convert', self.path(file), '-o', self.path('found.csv'), '-q', '--force',
                                    '--region', region, '--region-crs', 'EPSG:4326')
                        self.assertEqual(self.rows('found.csv')[1], selected)

    def test_border_cells_are_selected_for_longitudes_in_any_turn(self):
        """A box whose sides run through rows and columns of cells includes them, for each verb, in files and stores."""
        write_tiff(self.path('degrees.tif'), 60, 60, range(3600), (8.1, 46.6), 1 / 1200, GEOGRAPHIC, kind='h')
        whole, part = self.path('degrees.st'), self.path('degrees-part.st')
        self.run_ok('build', self.path('degrees.tif'), '-o', whole, '-q')
        west, east = (8.1 + (c + 0.5) / 1200 for c in (10, 46))
        south, north = (46.6 - (r + 0.5) / 1200 for r in (46, 10))
        lost = 0
        for turns in (0, -1, 1, 2):
            with self.subTest(turns=turns):
                box = f'--region={west + 360 * turns},{south},{east + 360 * turns},{north}'
                lost += west + 360 * turns - 360 * turns != west
                self.run_ok('build', self.path('degrees.tif'), box, '-o', part, '-q', '--force')
                commands = [['convert', self.path('degrees.tif')], ['points', whole], ['points', part],
                            ['points', whole, '--region-crs', 'EPSG:4326']]
                for command in commands:
                    self.run_ok(*command, box, '-o', self.path('border.csv'), '-q', '--force')
                    self.assertEqual(len(self.rows('border.csv')[1]), 37 * 37, command)
                said = json.loads(self.run_ok('raster', whole, box, '-o', self.path('border.tif'), '--json', '--force'))
                self.assertEqual((said['columns'], said['rows']), (37, 37))
        self.assertGreater(lost, 0)

    def test_longitudes_of_points_may_differ_by_whole_turns(self):
        places = [(lon, lat) for lon in range(0, 360, 5) for lat in range(-80, 81, 5)]
        with open(self.path('globe.csv'), 'w', encoding='ascii') as file:
            file.write('lon,lat,height\n' + ''.join(f'{lon},{lat},{lon + lat}\n' for lon, lat in places))
        self.run_ok('build', self.path('globe.csv'), '-o', self.path('globe.st'), '-q')
        for west, east in ((-10, 10), (350, 370), (-180, 180), (-180, -100), (100, 200)):
            selected = sorted((x, y, x + y) for x, y in places
                            if abs(y) <= 30 and any(west <= x + turn <= east for turn in (-360, 0, 360)))
            self.assertGreater(len(selected), 10)
            box = f'--region={west},-30,{east},30'
            for command in (['convert', self.path('globe.csv')], ['points', self.path('globe.st')]):
                self.run_ok(*command, box, '-o', self.path('lon.csv'), '-q', '--force')
                self.assertEqual(sorted(self.rows('lon.csv')[1]), selected, (command, box))

    def test_points_of_a_store_are_selected(self):
        self.run_ok('points', self.path('all.st'), '-o', self.path('p.csv'), '-q',
                    '--where', 'classification != 2', '--region', '100,100,400,500.5')
        self.expect('p.csv', lambda p: p['classification'] != 2 and 100 <= p['x'] <= 400 and
                    100 <= p['y'] <= 500.5, NAMES)

    def test_near_finds_the_nearest_points_that_meet_a_condition(self):
        """The nearest points that meet a condition are the nearest in a store of only these points."""
        self.run_ok('build', self.file, '-o', self.path('n.st'), '-q', '--where', 'classification == 2')
        for how in (['-k', '12'], ['--within', '60']):
            for store, more in (('n.st', []), ('all.st', ['--where', 'classification == 2'])):
                self.run_ok('points', self.path(store), '-o', self.path(f'near-{store}.csv'), '-q', '--force',
                            '--near', '300,400', *how, *more)
            selected = self.rows('near-n.st.csv')
            self.assertGreaterEqual(len(selected[1]), 5)
            self.assertEqual(self.rows('near-all.st.csv'), selected)

    def test_mesh_of_a_part_equals_the_mesh_of_its_store(self):
        """Points that do not meet the condition have no influence."""
        self.run_ok('build', self.file, '-o', self.path('part.st'), '-q', '--where', 'return_number == first')
        found = [json.loads(self.run_ok('mesh', self.path(store), '-o', self.path(name), '--max-error', '2',
                                        '--duplicates', 'mean', '--json', *more))
                 for store, name, more in (('part.st', 'part.ply', []),
                                           ('all.st', 'where.ply', ['--where', 'return_number == first']))]
        self.assertEqual(found[0]['samples'], sum(p['return_number'] == 1 for p in self.points))
        for key in ('samples', 'max_error', 'duplicates'):
            self.assertEqual(found[0][key], found[1][key], key)

    def bytes_of(self, name):
        with open(self.path(name), 'rb') as file:
            return file.read()

    def test_every_query_of_a_part_equals_the_query_of_its_store(self):
        """Points that do not meet the condition have no influence."""
        self.run_ok('build', self.file, '-o', self.path('ground.alone.st'), '-q', '--where', LAST_ON_THE_GROUND,
                    '--crs', 'EPSG:32632', '--block', '1000')
        self.run_ok('build', self.file, '-o', self.path('ground.all.st'), '-q', '--crs', 'EPSG:32632', '--block', '1000')
        with open(self.path('places.csv'), 'w', encoding='ascii') as file:
            file.write('x,y\n' + ''.join(f'{x},{y}\n' for x in range(-50, 1050, 37) for y in range(-50, 1050, 41)))
        where = LAST_ON_THE_GROUND
        queries = {'s.csv': ['sample', '--points', self.path('places.csv'), '--where', where],
                   'n.csv': ['sample', '--points', self.path('places.csv'), '--method', 'natural', '--max-edge', '90',
                             '--where', where],
                   'p.csv': ['profile', '--line', '0,0,999,999', '--where', where],
                   'r.tif': ['raster', '--where', where],
                   'h.tif': ['raster', '--value', 'hillshade', '--region', '200,200,800,700', '--where', where],
                   'c.geojson': ['contour', '--interval', '5', '--own-crs', '--where', where],
                   'p.png': ['render', '--size', '200x150', '--where', where],
                   'w.png': ['render', '--size', '200x150', '--wire', '--where', where]}
        for name, (verb, *options) in queries.items():
            with self.subTest(query=name):
                for kind, given in (('alone', options[:-2]), ('all', options)):
                    self.run_ok(verb, self.path(f'ground.{kind}.st'), '-o', self.path(kind + name), '-q', *given)
                self.assertGreater(len(self.bytes_of('all' + name)), 200)
                self.assertEqual(self.bytes_of('all' + name), self.bytes_of('alone' + name))
                self.run_ok(verb, self.path('ground.all.st'), '-o', self.path('whole' + name), '-q', *options[:-2])
                self.assertNotEqual(self.bytes_of('whole' + name), self.bytes_of('all' + name))

    def test_tiles_of_a_part_are_valid_for_its_store(self):
        self.run_ok('build', self.file, '-o', self.path('t.alone.st'), '-q', '--where', LAST_ON_THE_GROUND,
                    '--crs', 'EPSG:32632')
        self.run_ok('build', self.file, '-o', self.path('t.all.st'), '-q', '--crs', 'EPSG:32632')
        where = LAST_ON_THE_GROUND
        options = ['--zoom', '10-15', '--max-error', '0.5', '--vertical', 'ignore']
        made = json.loads(self.run_ok('tile', self.path('t.all.st'), '-o', self.path('tiles'), '--json', *options,
                                      '--where', where))
        self.assertGreater(made['tiles'], 6)
        for check in (['verify', self.path('tiles'), '--store', self.path('t.alone.st')],
                      ['verify', self.path('tiles'), '--store', self.path('t.all.st'), '--where', where]):
            checked = json.loads(self.run_ok(*check, '--json', '--vertical', 'ignore'))
            self.assertTrue(checked['ok'])
            self.assertGreater(checked['samples'], sum(map(last_on_the_ground, self.points)))
            self.assertEqual(sum(zoom['uncovered'] for zoom in checked['zooms']), 0)
        self.assertEqual(self.terrace('verify', self.path('tiles'), '--vertical', 'ignore',
                                      '--store', self.path('t.all.st')).returncode, 1)
        # The same tiles are up to date; for another condition they are not.
        again = json.loads(self.run_ok('tile', self.path('t.all.st'), '-o', self.path('tiles'), '--json', '--force',
                                       *options, '--where', where))
        self.assertEqual(again['made'], 0)
        other = json.loads(self.run_ok('tile', self.path('t.all.st'), '-o', self.path('tiles'), '--json', '--force',
                                       *options, '--where', 'classification == 2'))
        self.assertGreater(other['made'], 0)

    def test_mesh_with_detail_selects_points(self):
        """At level 0 the triangles equal those of the part's store; a coarser level has its points that qualify."""
        where = 'classification == 2'
        self.run_ok('build', self.file, '-o', self.path('d.st'), '-q', '--where', where)
        counts = [json.loads(self.run_ok(*query, '-o', self.path('d.ply'), '--json', '--force'))
                  for query in (['mesh', self.path('d.st')], ['mesh', self.path('all.st'), '--where', where])]
        for key in ('vertices', 'triangles'):
            self.assertEqual(counts[0][key], counts[1][key])
        for level in ('1', 'top'):
            self.run_ok('points', self.path('all.st'), '-o', self.path('d.csv'), '-q', '--force', '--level', level,
                        '--where', where)
            mesh = json.loads(self.run_ok('mesh', self.path('all.st'), '-o', self.path('d.ply'), '--json', '--force',
                                          '--level', level, '--where', where))
            self.assertEqual(mesh['vertices'], len(self.rows('d.csv')[1]))
            self.assertGreater(mesh['vertices'], 10)

    def test_surface_of_a_part(self):
        rng = random.Random(3)
        with open(self.path('ball.csv'), 'w', encoding='ascii') as file:
            file.write('x,y,z,part\n')
            for i in range(4000):
                v = [rng.gauss(0, 1) for _ in range(3)]
                size = sum(c * c for c in v) ** 0.5 / (1 + i % 2)
                file.write(','.join(f'{c / size:.6f}' for c in v) + f',{i % 2}\n')
        self.run_ok('build', self.path('ball.csv'), '-o', self.path('ball.st'), '-q', '--block', '500')
        self.run_ok('build', self.path('ball.csv'), '-o', self.path('ball.alone.st'), '-q', '--where', 'part == 1')
        found = [json.loads(self.run_ok(*query, '-o', self.path('ball.ply'), '--json', '--force'))
                 for query in (['surface', self.path('ball.alone.st')],
                               ['surface', self.path('ball.st'), '--where', 'part == 1'])]
        self.assertEqual(found[0]['vertices'], 2000)
        for key in ('vertices', 'triangles'):
            self.assertEqual(found[0][key], found[1][key])

    def test_a_condition_on_a_raster_can_only_use_heights(self):
        self.raster('h.asc')
        self.run_ok('build', self.path('h.asc'), '-o', self.path('h.st'), '-q')
        self.run_ok('build', self.path('h.asc'), '-o', self.path('h.alone.st'), '-q', '--where', 'z > 600')
        for store, more in (('h.alone.st', []), ('h.st', ['--where', 'z > 600'])):
            self.run_ok('raster', self.path(store), '-o', self.path(store + '.tif'), '-q', *more)
            self.run_ok('mesh', self.path(store), '-o', self.path(store + '.ply'), '-q', '--max-error', '3', *more)
        for ending in ('.tif', '.ply'):
            self.assertEqual(self.bytes_of('h.st' + ending), self.bytes_of('h.alone.st' + ending))
        result = self.terrace('raster', self.path('h.st'), '-o', self.path('none.tif'), '--where', 'classification == 2')
        self.assertEqual(result.returncode, 1)
        self.assertIn("no 'classification'; known are x, y, z", result.stderr)

    def test_errors_name_the_problem(self):
        for args, code, text in (
                (['build', self.file, '-o', self.path('e.st'), '--where', 'klass == 2'], 1, "no 'klass'; known are x, y, z, classification"),
                (['build', self.file, '-o', self.path('e.st'), '--where', 'classification = 2'], 1, 'for equality write =='),
                (['build', self.file, '-o', self.path('e.st'), '--where', 'z > 1000'], 1, 'none of its 20000 points is selected; give another --where or --region'),
                (['build', self.file, '-o', self.path('e.st'), '--keep', 'blue'], 1, "no attribute 'blue'"),
                (['convert', self.file, '-o', self.path('e.csv'), '--drop', 'red,,green'], 2, 'a name is empty'),
                (['build', self.file, '-o', self.path('e.st'), '--region', '-9,-9,-8,-8'], 1, 'none of its 20000 points is selected'),
                (['build', self.file, '-o', self.path('e.st'), '--region', '1,2,3'], 2, 'minx,miny,maxx,maxy'),
                (['build', self.file, '-o', self.path('e.st'), '--region', '1,2,3,4', '--region-crs', 'EPSG:4326'], 1, 'has no known CRS'),
                (['build', '-', '-o', self.path('e.st'), '--region', '1,2,3,4', '--region-crs', 'EPSG:4326'], 2, 'name a file'),
                (['build', self.file, '-o', self.path('e.st'), '--region-crs', 'EPSG:4326'], 2, '--region'),
                (['convert', self.file, '-o', self.path('e.csv'), '--region', 'nowhere.geojson'], 1, 'neither a box nor a file'),
                (['convert', self.file, '-o', self.path('e.csv'), '--resolution', '1'], 1, 'has no octree'),
                (['convert', self.file, '-o', self.path('e.csv'), '--resolution', '0'], 2, '--resolution'),
                (['raster', self.path('all.st'), '-o', self.path('e.tif'), '--where', 'z > 1000'], 1, "no point meets the condition 'z > 1000'; give another --where"),
                (['contour', self.path('all.st'), '-o', self.path('e.geojson'), '--interval', '1', '--where', 'class == 2'], 1, "no 'class'; known are x, y, z, classification"),
                (['verify', self.path('all.st'), '--where', 'z > 1'], 2, 'are for tile sets'),
                (['points', self.path('all.st'), '-o', self.path('e.csv'), '--where', 'class == 2'], 1, "no 'class'; known are x, y, z, classification"),
                (['info', self.path('all.st'), self.file], 2, 'is a store: pass it alone'),
                (['info', self.path('all.st'), '--input-format', 'ply'], 2, '--input-format do not apply'),
                (['mesh', self.path('all.st'), 'a', 'b', 'c', '-o', 'e.ply'], 2, "'a' and 2 more: no such argument or option"),
                (['render', self.file, '-o', self.path('e.png'), '--where', 'z > 1'], 2, 'is not a store')):
            with self.subTest(args=args):
                result = self.terrace(*args)
                self.assertEqual(result.returncode, code, result.stderr)
                self.assertIn(text, result.stderr)
                self.assertEqual(len(result.stderr.splitlines()), 1)
        self.assertFalse(os.path.exists(self.path('e.st')))


if __name__ == '__main__':
    unittest.main()
