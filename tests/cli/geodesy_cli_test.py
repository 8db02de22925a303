#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests reference systems end to end: build, info, points, mesh and others.

TERRACE=path/to/terrace geodesy_cli_test.py
Comparisons with PROJ (cs2cs) or GDAL are skipped if they are not installed.
"""

import json
import math
import os
import random
import shutil
import subprocess
import tempfile
import unittest

from small_tiff import GEOGRAPHIC, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
ESRI_UTM = ('PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",'
            'SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],'
            'UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
            'PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],'
            'PARAMETER["Central_Meridian",9.0],PARAMETER["Scale_Factor",0.9996],'
            'PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]')


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


# A CRS on an unknown datum.
OWN_DATUM = ('PROJCS["own grid",GEOGCS["own",DATUM["own datum",SPHEROID["Airy 1830",6377563.396,299.3249646]],'
             'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
             'PARAMETER["latitude_of_origin",49],PARAMETER["central_meridian",-2],'
             'PARAMETER["scale_factor",0.9996012717],PARAMETER["false_easting",400000],'
             'PARAMETER["false_northing",-100000],UNIT["metre",1]]')


class GeodesyTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def ok(self, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def refused(self, code, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def build(self, *args):
        store = self.path(f'store{len(os.listdir(self.folder.name))}')
        self.ok('build', *args, '-o', store, '-q')
        return store

    def info(self, path):
        return json.loads(self.ok('info', path, '--json'))

    def points(self, *args):
        text = self.ok('points', *args, '-o', '-', '--format', 'xyz', '-q')
        return [tuple(map(float, line.split()[:3])) for line in text.splitlines()]

    def raster(self, keys, name='dem.tif', corner=(500000, 5200000), cell=10.0, matrix=None):
        """Writes a raster of six by six samples, 0 to 35."""
        write_tiff(self.path(name), 6, 6, range(36), corner, cell, keys, matrix)
        return self.path(name)

    def cloud(self, places, name='points.xyz'):
        with open(self.path(name), 'w', encoding='utf-8') as file:
            for i, (x, y) in enumerate(places):
                file.write(f'{x!r} {y!r} {i}\n')
        return self.path(name)

    def test_the_store_records_code_name_and_wkt(self):
        store = self.build(self.raster({1024: 1, 1025: 1, 3072: 32632, 3076: 9001}))
        crs = self.info(store)['crs']
        self.assertEqual(crs['epsg'], 32632)
        self.assertEqual(crs['name'], 'WGS 84 / UTM zone 32N')
        self.assertIn('METHOD["Transverse Mercator"', crs['wkt'])
        if shutil.which('projinfo'):
            result = subprocess.run(['projinfo', crs['wkt'], '-o', 'PROJ', '-q'],
                                    capture_output=True, text=True, check=False)
            self.assertIn('+proj=utm +zone=32', result.stdout, result.stderr)
            self.assertNotIn('arning', result.stderr)

    def test_user_defined_parameters_are_used(self):
        own = {1024: 1, 1025: 1, 2048: 4258, 3072: 32767, 3074: 32767, 3075: 1, 3076: 9001,
               3080: 10.5, 3081: 40.0, 3082: 200000.0, 3083: 1000.0, 3092: 0.99995}
        store = self.build(self.raster(own, corner=(210000, 500000)))
        self.assertIsNone(self.info(store)['crs']['epsg'])
        self.compare_with_proj(store, '+proj=tmerc +lon_0=10.5 +lat_0=40 +k=0.99995 +x_0=200000 '
                                      '+y_0=1000 +ellps=GRS80')

    def compare_with_proj(self, store, proj):
        if not shutil.which('cs2cs'):
            self.skipTest('cs2cs is not installed')
        plane = self.points(store)
        result = subprocess.run(
            ['cs2cs', '-f', '%.12f', *proj.split(), '+type=crs', '+to', '+proj=longlat',
             '+ellps=GRS80', '+type=crs'],
            input='\n'.join(f'{x!r} {y!r}' for x, y, _ in plane), capture_output=True, text=True,
            check=True)
        expected = [tuple(map(float, line.split()[:2])) for line in result.stdout.splitlines()]
        found = self.points(store, '--to-crs', 'EPSG:4258')
        self.assertEqual(len(found), len(expected))
        for (x, y, _), (a, b) in zip(found, expected):
            self.assertAlmostEqual(x, a, delta=1e-9)
            self.assertAlmostEqual(y, b, delta=1e-9)

    def test_a_prj_file_next_to_the_source_is_used(self):
        raster = self.raster({1025: 1})
        with open(self.path('dem.prj'), 'w', encoding='utf-8') as file:
            file.write(ESRI_UTM)
        self.assertEqual(self.info(self.build(raster))['crs']['epsg'], 32632)
        places = self.cloud([(500000 + 3 * i, 5200000 + i * i) for i in range(20)])
        shutil.copy(self.path('dem.prj'), self.path('points.prj'))
        self.assertEqual(self.info(self.build(places))['crs']['epsg'], 32632)
        # --crs overrides it.
        self.assertEqual(self.info(self.build(places, '--crs', 'EPSG:25832'))['crs']['epsg'], 25832)
        # It must not contradict the file's own keys.
        other = self.raster({1024: 1, 1025: 1, 3072: 32633, 3076: 9001}, name='dem.tif')
        error = self.refused(1, 'build', other, '-o', self.path('none'))
        self.assertIn('EPSG:32633', error)
        self.assertIn('dem.prj', error)
        with open(self.path('points.prj'), 'w', encoding='utf-8') as file:
            file.write(ESRI_UTM[:60])
        error = self.refused(1, 'build', places, '-o', self.path('none'))
        self.assertIn('points.prj', error)
        self.assertEqual(error.count('--crs'), 1, error)

    def test_a_local_system_has_a_unit_but_no_position_on_the_earth(self):
        local = 'LOCAL_CS["site",UNIT["foot",0.3048]]'
        raster = self.raster({1025: 1})
        stores = [self.build(raster, '--crs', local)]
        with open(self.path('dem.prj'), 'w', encoding='utf-8') as file:
            file.write(local)
        stores.append(self.build(raster))
        os.remove(self.path('dem.prj'))
        with open(self.path('dem.vrt'), 'w', encoding='utf-8') as file:
            file.write(f'<VRTDataset rasterXSize="6" rasterYSize="6"><SRS>{local}</SRS><GeoTransform>0,1,0,0,0,-1'
                       '</GeoTransform><VRTRasterBand dataType="Float32" band="1"><SimpleSource>'
                       '<SourceFilename relativeToVRT="1">dem.tif</SourceFilename></SimpleSource>'
                       '</VRTRasterBand></VRTDataset>')
        stores.append(self.build(self.path('dem.vrt')))
        written = self.path('written.tif')
        self.ok('raster', stores[-1], '-o', written)
        stores.append(self.build(written))
        for store in stores:
            self.assertEqual(self.info(store)['crs']['name'], 'site')
            line = self.info(store)['bounds']
            west, south = line['min'][:2]
            profile = self.ok('profile', store, f'--line={west},{south},{line["max"][0]},{south}', '-o', '-')
            self.assertAlmostEqual(float(profile.splitlines()[-1].split(',')[0]),
                                   (line['max'][0] - west) * 0.3048, delta=1e-3)
            error = self.refused(1, 'tile', store, '-o', self.path('tiles'), '--vertical', 'ellipsoidal')
            self.assertIn('"site", which has no place on the earth', error)
        degrees = self.build(self.cloud([(10, 10), (20, 20)]), '--crs', 'EPSG:4326')
        self.assertIn('local', self.refused(2, 'points', degrees, '-o', '-', '--to-crs', local))

    def test_contradictory_keys_are_named_in_the_error(self):
        for keys, words in (
                ({1024: 1, 3072: 32632, 3076: 9002}, ['EPSG:32632', 'metres', '--crs']),
                ({1024: 1, 2048: 4269, 3072: 32632, 3076: 9001}, ['EPSG:4269', '--crs']),
                ({1024: 1, 3072: 32632, 3076: 9001, 3092: 0.5}, ['3092', '--crs'])):
            raster = self.raster({1025: 1, **keys})
            error = self.refused(1, 'build', raster, '-o', self.path('none'))
            for word in words + ['dem.tif']:
                self.assertIn(word, error)
            self.assertFalse(os.path.exists(self.path('none')))
            self.build(raster, '--crs', 'EPSG:32632')

    def test_an_unknown_system_is_named_and_never_guessed(self):
        error = self.refused(2, 'build', self.raster({1025: 1}), '-o', self.path('none'), '--crs',
                             'EPSG:32299')
        self.assertIn('EPSG:32299', error)
        # An unknown projection method; distances can still be measured in its unit.
        unknown = {1024: 1, 1025: 1, 2048: 4326, 3072: 32767, 3075: 2}
        metres = self.raster({**unknown, 3076: 9001})
        result = terrace('build', metres, '-o', self.path('unknown'))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('method 2 ', result.stderr)
        error = self.refused(1, 'points', self.path('unknown'), '-o', '-', '--to-crs', 'EPSG:4326')
        self.assertIn('no CRS', error)
        error = self.refused(1, 'build', self.raster(unknown), '-o', self.path('none'))
        self.assertIn('unit', error)

    def test_national_grids_go_to_wgs84_by_one_named_operation(self):
        for code, x, y in ((5514, -742000, -1043000), (27700, 530000, 180000), (28992, 155000, 463000),
                           (2056, 2600000, 1200000), (31370, 150000, 170000)):
            raster = self.raster({1024: 1, 1025: 1, 3072: code, 3076: 9001}, corner=(x, y))
            store = self.build(raster)
            self.assertEqual(self.info(store)['crs']['epsg'], code)
            text = self.ok('info', store)
            self.assertRegex(text, f'EPSG:{code} .*, to WGS 84 by ".*" within [12] m')
            result = terrace('points', store, '-o', '-', '--to-crs', 'EPSG:4326', '--format', 'xyz')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertRegex(result.stderr, f'EPSG:{code} .* to EPSG:4326 .* by ".*" within [12] m')

    def test_rasters_keep_their_crs_for_gdal(self):
        if not shutil.which('gdalsrsinfo'):
            self.skipTest('gdalsrsinfo is not installed')
        cloud = self.cloud([(i % 7 * 10.0, i // 7 * 10.0) for i in range(49)])
        degrees = self.cloud([(10 + i % 7 * 0.001, 45 + i // 7 * 0.001) for i in range(49)], 'degrees.xyz')
        with open(self.path('own.prj'), 'w', encoding='utf-8') as file:
            file.write(ESRI_UTM.replace('9.0]', '10.25]'))
        with open(self.path('own-degrees.prj'), 'w', encoding='utf-8') as file:
            file.write('GEOGCS["own",DATUM["own datum",SPHEROID["own",6377000,300]],PRIMEM["Greenwich",0],'
                       'UNIT["degree",0.0174532925199433]]')
        for points, crs, expected in (
                *((cloud, f'EPSG:{code}', f'EPSG:{code}') for code in (5514, 27700, 28992, 2056, 31370, 3035)),
                (degrees, 'EPSG:4258', 'EPSG:4258'),
                (cloud, self.path('own.prj'), '+proj=tmerc +lat_0=0 +lon_0=10.25 +k=0.9996 +x_0=500000'),
                (cloud, 'ESRI:54030', '+proj=robin +lon_0=0'),
                (degrees, self.path('own-degrees.prj'), '+proj=longlat +a=6377000 +rf=300')):
            store, out = self.build(points, '--crs', crs), self.path('out.tif')
            self.ok('raster', store, '-o', out, '--force')
            wanted = 'epsg' if expected.startswith('EPSG') else 'proj4'
            result = subprocess.run(['gdalsrsinfo', '-o', wanted, out], capture_output=True, text=True)
            self.assertIn(expected, result.stdout, crs)
            # Our own reader accepts it too.
            again, name = self.build(out), self.path('again.tif')
            self.ok('raster', again, '-o', name, '--force')
            result = subprocess.run(['gdalsrsinfo', '-o', wanted, name], capture_output=True, text=True)
            self.assertIn(expected, result.stdout, crs)

    def test_the_command_line_accepts_codes_names_and_files(self):
        cloud = self.cloud([(500000 + 3 * i, 5200000 + i * i) for i in range(20)])
        json_file = self.path('utm.json')
        if shutil.which('projinfo'):
            text = subprocess.run(['projinfo', 'EPSG:32632', '-o', 'PROJJSON', '-q'], capture_output=True,
                                  text=True, check=True).stdout
            with open(json_file, 'w', encoding='utf-8') as file:
                file.write(text)
            self.assertEqual(self.info(self.build(cloud, '--crs', json_file))['crs']['epsg'], 32632)
        for crs in ('WGS 84 / UTM zone 32N', ESRI_UTM, 'urn:ogc:def:crs:EPSG::32632'):
            self.assertEqual(self.info(self.build(cloud, '--crs', crs))['crs']['epsg'], 32632)
        error = self.refused(2, 'build', cloud, '-o', self.path('none'), '--crs', 'UTM')
        self.assertIn('EPSG:n', error)

    def test_a_missing_proj_db_is_an_error_with_a_remedy(self):
        cloud = self.cloud([(1, 2), (3, 4)])
        environment = {**os.environ, 'PROJ_DATA': self.folder.name, 'PROJ_LIB': self.folder.name}
        result = subprocess.run([TERRACE, 'build', cloud, '--crs', 'EPSG:32632', '-o', self.path('none')],
                                capture_output=True, text=True, env=environment)
        if result.returncode == 0:
            self.skipTest('PROJ finds its database elsewhere')
        self.assertIn('proj.db', result.stderr)
        self.assertIn('PROJ_DATA', result.stderr)

    def test_an_unreadable_database_is_an_error(self):
        """A failed read must not be reported as an unknown CRS."""
        database = '/usr/share/proj/proj.db'
        if not os.path.exists(database):
            self.skipTest('proj.db is elsewhere')
        raster = self.raster({1024: 1, 1025: 1, 3072: 32632, 3076: 9001})
        folder = self.path('proj')
        os.mkdir(folder)
        environment = {**os.environ, 'PROJ_DATA': folder, 'PROJ_LIB': folder}
        size = os.path.getsize(database)
        for kept in (size // 20, size // 3, size // 2, 3 * size // 4):
            with self.subTest(kept=kept), open(database, 'rb') as whole, \
                    open(os.path.join(folder, 'proj.db'), 'wb') as part:
                part.write(whole.read(kept) + bytes(size - kept))
                part.flush()
                result = subprocess.run([TERRACE, 'build', raster, '-o', self.path('none'), '--force', '-q'],
                                        capture_output=True, text=True, env=environment, timeout=120)
                if result.returncode == 0:  # the remaining part contains all that is needed
                    self.assertEqual(self.info(self.path('none'))['crs']['epsg'], 32632)
                    self.assertIn('Transverse Mercator', self.info(self.path('none'))['crs']['wkt'])
                    continue
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn('proj.db', result.stderr)
                self.assertIn('cannot be read', result.stderr)

    def test_a_geocentric_cloud_supports_only_queries_in_space(self):
        cloud = self.cloud([(4027893.75 + 3 * i, 307041.99 + 2 * i) for i in range(50)])
        store = self.path('space')
        result = terrace('build', cloud, '--crs', 'EPSG:4978', '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('geocentric', result.stderr + result.stdout)
        self.assertIn('GEODCRS', self.info(store)['crs']['wkt'])
        self.assertEqual(len(self.points(store)), 50)
        self.ok('verify', store)
        las = self.path('space.las')
        self.ok('points', store, '-o', las)
        self.assertEqual(len(self.points(self.build(las))), 50)
        for args in (['raster', store, '--cell', 1, '-o', self.path('a.tif')],
                     ['contour', store, '--interval', 1, '-o', self.path('a.geojson')],
                     ['tile', store, '-o', self.path('tiles')],
                     ['profile', store, '--line', '4027893,307041,4027900,307050', '-o', self.path('a.csv')],
                     ['mesh', store, '-o', self.path('a.ply')],
                     ['mesh', store, '--max-error', 1, '-o', self.path('a.ply')],
                     ['sample', store, '--points', self.places()]):
            with self.subTest(args=args):
                self.assertIn('geocentric', self.refused(1, *args))

    def places(self):
        with open(self.path('places.csv'), 'w', encoding='utf-8') as file:
            file.write('x,y\n4027893,307041\n')
        return self.path('places.csv')

    def test_info_says_which_systems_count_as_wgs84(self):
        etrs = self.raster({1024: 1, 1025: 1, 3072: 25832, 3076: 9001, 4096: 5783})
        self.assertIn('within 1 m of WGS 84', self.ok('info', etrs))
        self.assertEqual(self.info(etrs)['vertical'], 'orthometric')
        self.assertIn('within 1 m of WGS 84', self.ok('info', self.build(etrs)))
        with open(self.path('own.prj'), 'w', encoding='utf-8') as file:
            file.write(OWN_DATUM)
        own = self.raster({1025: 1}, name='own.tif')
        self.assertIn('without a transformation to WGS 84', self.ok('info', own))
        wrong = self.raster({1024: 1, 1025: 1, 3072: 32632, 3076: 9002})
        self.assertIn('contradict', self.ok('info', wrong))

    def test_data_without_a_crs_cannot_be_converted(self):
        store = self.build(self.raster({1025: 1}))
        self.assertIsNone(self.info(store)['crs'])
        for option in (('--to-crs', 'EPSG:4326'),
                       ('--region', '0,0,1,1', '--region-crs', 'EPSG:4326')):
            error = self.refused(1, 'points', store, '-o', '-', *option)
            self.assertIn('no CRS', error)
            self.assertIn('--crs', error)

    def test_another_datum_needs_its_shift(self):
        shift = '446.448,-125.157,542.060,0.1502,0.2470,0.8421,-20.4894'
        random.seed(1)
        cloud = self.cloud([(random.uniform(2e5, 6e5), random.uniform(1e5, 9e5))
                            for _ in range(50)])
        with open(self.path('own.prj'), 'w', encoding='utf-8') as file:
            file.write(OWN_DATUM)
        unknown = self.build(cloud, '--crs', self.path('own.prj'))
        error = self.refused(1, 'points', unknown, '-o', '-', '--to-crs', 'EPSG:4326')
        self.assertIn('--towgs84', error)
        self.assertIn('own grid', error)
        bare = self.build(cloud, '--crs', 'EPSG:27700')
        shifted = self.build(cloud, '--crs', 'EPSG:27700', f'--towgs84={shift}')
        self.assertIn('BOUNDCRS', self.info(shifted)['crs']['wkt'])
        found = self.points(shifted, '--to-crs', 'EPSG:4326')
        self.assertEqual(len(found), 50)
        self.refused(1, 'build', cloud, '-o', self.path('none'), '--crs', 'EPSG:32632',
                     f'--towgs84={shift}')
        self.refused(2, 'build', cloud, '-o', self.path('none'), '--crs', 'EPSG:27700',
                     '--towgs84', '1,2')
        # The shift may be given later, together with the other CRS.
        late = f'--towgs84={shift}'
        self.assertEqual(self.points(bare, '--to-crs', 'EPSG:4326', late), found)
        x, y, _ = found[7]
        box = f'--region={x - 1e-6},{y - 1e-6},{x + 1e-6},{y + 1e-6}'
        self.assertEqual(self.points(bare, box, '--region-crs', 'EPSG:4326', late),
                         self.points(bare)[7:8])
        self.query_with_shift(late)
        if not shutil.which('cs2cs'):
            self.skipTest('cs2cs is not installed')
        result = subprocess.run(
            ['cs2cs', '-f', '%.12f', '+proj=tmerc', '+lat_0=49', '+lon_0=-2', '+k=0.9996012717',
             '+x_0=400000', '+y_0=-100000', '+ellps=airy', f'+towgs84={shift}', '+type=crs', '+to',
             '+proj=longlat', '+datum=WGS84', '+type=crs'],
            input='\n'.join(f'{x!r} {y!r}' for x, y, _ in self.points(bare)), capture_output=True,
            text=True, check=True)
        for (x, y, _), line in zip(found, result.stdout.splitlines()):
            a, b = map(float, line.split()[:2])
            self.assertAlmostEqual(x, a, delta=1e-8)
            self.assertAlmostEqual(y, b, delta=1e-8)

    def query_with_shift(self, late):
        with open(self.path('own.prj'), 'w', encoding='utf-8') as file:
            file.write(OWN_DATUM)
        raster = self.raster({1025: 1}, corner=(400000, 300000), name='plain.tif')
        store = self.build(raster, '--crs', self.path('own.prj'))
        found = self.points(store, '--to-crs', 'EPSG:4326', late)
        with open(self.path('places.csv'), 'w', encoding='utf-8') as file:
            file.write('lon,lat\n' + ''.join(f'{x!r},{y!r}\n' for x, y, _ in found))
        places = ('--points', self.path('places.csv'), '--points-crs', 'EPSG:4326', '--method', 'nearest')
        lines = self.ok('sample', store, *places, late).splitlines()[1:]
        heights = [float(line.split(',')[2]) for line in lines]
        self.assertEqual(heights, [z for _, _, z in found])
        self.assertIn('--towgs84', self.refused(1, 'sample', store, *places))
        line = ('--line', ','.join(f'{v!r}' for place in (found[7], found[28]) for v in place[:2]), '--line-crs',
                'EPSG:4326', '--step', '50', '-o', '-')
        rows = self.ok('profile', store, *line, late).splitlines()[1:]
        plane = self.points(store)
        for row, (x, y, _) in ((rows[0], plane[7]), (rows[-1], plane[28])):
            self.assertAlmostEqual(float(row.split(',')[1]), x, delta=0.01)
            self.assertAlmostEqual(float(row.split(',')[2]), y, delta=0.01)
        self.assertIn('--towgs84', self.refused(1, 'profile', store, *line))
        late_raster, early_raster = self.path('late.tif'), self.path('early.tif')
        grid = ('raster', store, '--to-crs', 'EPSG:4326')
        self.assertIn('--towgs84', self.refused(1, *grid, '-o', late_raster))
        self.ok(*grid, late, '-o', late_raster)
        early = self.build(raster, '--crs', self.path('own.prj'), late)
        self.ok('raster', early, '--to-crs', 'EPSG:4326', '-o', early_raster)
        with open(late_raster, 'rb') as a, open(early_raster, 'rb') as b:
            self.assertEqual(a.read(), b.read())

    def test_contours_of_a_region_on_another_datum(self):
        store = self.build(self.raster({1024: 1, 1025: 1, 3072: 32632, 3076: 9001}))
        # A shift of a few hundred metres.
        shift = '-87,-98,-121'
        own = ('GEOGCS["own",DATUM["own datum",SPHEROID["International 1924",6378388,297]],'
               'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]')
        region = ('--region', '9,46,9.0013,47.5', '--region-crs', own)
        contour = ('contour', store, '--interval', '1', '-o', '-')
        self.assertIn('--towgs84', self.refused(1, *contour, *region))
        whole = json.loads(self.ok(*contour))['features']
        part = json.loads(self.ok(*contour, *region, f'--towgs84={shift}'))['features']
        self.assertTrue(0 < len(part) <= len(whole))
        east = max(x for f in part for x, *_ in f['geometry']['coordinates'])
        most = max(x for f in whole for x, *_ in f['geometry']['coordinates'])
        self.assertLess(east, most)

    def test_the_vertical_reference_comes_from_keys_or_options(self):
        utm = {1024: 1, 1025: 1, 3072: 25832, 3076: 9001}
        self.assertIsNone(self.info(self.build(self.raster(utm)))['vertical'])
        raster = self.raster({**utm, 4096: 5783, 4099: 9001})
        info = self.info(self.build(raster))
        self.assertEqual(info['vertical'], 'orthometric')
        self.assertEqual(info['crs']['vertical_epsg'], 5783)
        info = self.info(self.build(raster, '--vertical', 'ellipsoidal'))
        self.assertEqual(info['vertical'], 'ellipsoidal')
        self.assertIsNone(info['crs']['vertical_epsg'])
        info = self.info(self.build(self.raster({**utm, 4096: 5030})))
        self.assertEqual(info['vertical'], 'ellipsoidal')
        geographic = self.raster({1024: 2, 1025: 1, 2048: 4979}, corner=(8, 47), cell=0.001)
        self.assertEqual(self.info(self.build(geographic))['vertical'], 'ellipsoidal')
        store = self.build(self.raster(utm), '--crs', 'EPSG:25832+7837')
        self.assertEqual(self.info(store)['vertical'], 'orthometric')

    def test_a_rotated_raster_is_placed_like_in_gdal(self):
        matrix = [8.0, 6.0, 0.0, 500000.0, 6.0, -8.0, 0.0, 5200000.0, 0.0, 0.0, 0.0, 0.0,
                  0.0, 0.0, 0.0, 1.0]
        raster = self.raster({1024: 1, 1025: 1, 3072: 32632, 3076: 9001}, matrix=matrix)
        found = self.points(self.build(raster), '--to-crs', 'EPSG:4326')
        if not shutil.which('gdaltransform'):
            self.skipTest('gdaltransform is not installed')
        cells = [(z % 6, z // 6) for _, _, z in found]
        result = subprocess.run(
            ['gdaltransform', '-t_srs', 'EPSG:4326', raster],
            input='\n'.join(f'{column + 0.5} {row + 0.5}' for column, row in cells),
            capture_output=True, text=True, check=True)
        for (x, y, _), line in zip(found, result.stdout.splitlines()):
            a, b = map(float, line.split()[:2])
            self.assertAlmostEqual(x, a, delta=1e-9)
            self.assertAlmostEqual(y, b, delta=1e-9)

    def test_regions_in_another_system(self):
        random.seed(2)
        cloud = self.cloud([(random.uniform(3e5, 7e5), random.uniform(5e6, 6e6))
                            for _ in range(3000)])
        store = self.build(cloud, '--crs', 'EPSG:32632', '--block', 500)
        degrees = {z: (x, y) for x, y, z in self.points(store, '--to-crs', 'EPSG:4326')}
        inside = {z for z, (x, y) in degrees.items() if 8 <= x <= 10 and 46 <= y <= 49}
        found = self.points(store, '--region', '8,46,10,49', '--region-crs', 'EPSG:4326')
        self.assertEqual({z for _, _, z in found}, inside)
        self.assertGreater(len(inside), 100)
        error = self.refused(1, 'points', store, '--region', '100,46,101,49', '--region-crs', 'EPSG:4326', '-o', '-')
        self.assertIn('no point is in the region', error)
        for box in ('8,46,10,95', '-170,-80,170,80'):
            error = self.refused(1, 'points', store, f'--region={box}', '--region-crs', 'EPSG:4326',
                                 '-o', '-')
            self.assertIn('region', error)
        mesh = self.path('mesh.ply')
        self.ok('mesh', store, '--region', '8,46,10,49', '--region-crs', 'EPSG:4326', '--to-crs',
                'EPSG:4326', '-o', mesh, '--format', 'ply-ascii')
        with open(mesh, encoding='utf-8') as file:
            lines = file.read().split('end_header\n')[1].splitlines()
        x, y, _ = map(float, lines[0].split()[:3])
        self.assertTrue(5 < x < 13 and 44 < y < 55)

    def test_across_the_antimeridian(self):
        cloud = self.cloud([(179 + 0.1 * i if i < 11 else -181 + 0.1 * i, -20 + 0.1 * j)
                            for i in range(21) for j in range(10)])
        store = self.build(cloud, '--crs', 'EPSG:4326')
        there = self.points(store, '--to-crs', 'EPSG:32660')
        self.assertTrue(all(6e5 < x < 9.5e5 for x, _, _ in there))
        box = self.points(store, '--region', '179.45,-21,180.45,-10', '--region-crs', 'EPSG:4326')
        self.assertEqual(len(box), 100)
        self.assertEqual(sorted({round(x, 1) for x, _, _ in box}), [round(179.5 + 0.1 * i, 1) for i in range(10)])

    def test_clouds_are_joined_across_the_antimeridian(self):
        random.seed(3)
        cloud = self.cloud([(west + random.random() / 10, -17 + random.random() / 10)
                            for west in (179.9, -180) for _ in range(300)])
        store = self.path('joined.terrace')
        result = terrace('build', cloud, '--crs', 'EPSG:4326', '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('on both sides of the antimeridian', result.stderr)
        low, high = (self.info(store)['bounds'][end][0] for end in ('min', 'max'))
        self.assertTrue(179.9 <= low < 179.91 and 180.09 < high <= 180.1)
        # The nearest points of a position on the antimeridian are on both sides, for both
        # longitudes.
        for place in '180,-16.95', '-180,-16.95':
            near = self.points(store, f'--near={place}', '-k', 20)
            self.assertEqual({x > 180 for x, _, _ in near}, {True, False})
        places = self.path('places.csv')
        with open(places, 'w', encoding='utf-8') as file:
            file.write('0,-16.95\n180,-16.95\n-179.95,-16.95\n')
        heights = [line.split(',')[2] for line in self.ok('sample', store, '--points', places).splitlines()]
        self.assertEqual([height != '' for height in heights], [False, True, True])
        # With longitudes from 0 to 360, the seam is at Greenwich.
        cloud = self.cloud([(west + random.random(), 50 + random.random()) for west in (0, 359) for _ in range(99)])
        low, high = (self.info(self.build(cloud, '--crs', 'EPSG:4326'))['bounds'][end][0] for end in ('min', 'max'))
        self.assertTrue(-1 <= low < high <= 1)
        # A cloud that surrounds the globe is not changed.
        cloud = self.cloud([(random.uniform(-180, 180), random.uniform(-60, 60)) for _ in range(900)])
        low, high = (self.info(self.build(cloud, '--crs', 'EPSG:4326'))['bounds'][end][0] for end in ('min', 'max'))
        self.assertTrue(-180 <= low < -170 and 170 < high <= 180)
        with open(self.path('cloud.xyz'), 'w', encoding='utf-8') as file:
            file.write('179.5 1 2\n-179.5 1 3\n179.6 2 3\n')
        with open(file.name, encoding='utf-8') as given:
            result = subprocess.run([TERRACE, 'build', '-', '--crs', 'EPSG:4326', '-o', self.path('once.terrace')],
                                    capture_output=True, text=True, timeout=120, stdin=given)
        self.assertEqual(result.returncode, 1)
        self.assertIn('on both sides of the antimeridian', result.stderr)

    def test_unusual_longitudes_are_noted(self):
        for longitudes, words in (((15, 415), 'whole turns apart (15 to 415)'), ((179.5, -179.5), 'sides of the antimeridian'),
                                  ((0.5, 359.5), 'both sides of the meridian of 0')):
            cloud = self.cloud([(x, 10 + i / 100) for i in range(100) for x in longitudes])
            store = self.path('turns.store')
            shutil.rmtree(store, ignore_errors=True)
            result = terrace('build', cloud, '--crs', 'EPSG:4326', '-o', store)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(words, result.stderr)
            bounds = self.info(store)['bounds']
            self.assertLess(bounds['max'][0] - bounds['min'][0], 41)

    def test_latitudes_beyond_a_pole_are_refused(self):
        random.seed(1)
        swapped = [(-12 + random.random() / 100, 130 + random.random() / 100) for _ in range(200)]
        error = self.refused(1, 'build', self.cloud(swapped), '--crs', 'EPSG:4326', '-o', self.path('swapped'))
        for word in 'the latitude 130.', 'is beyond a pole', 'pass the longitude as x', '--crs':
            self.assertIn(word, error)
        self.assertFalse(os.path.exists(self.path('swapped')))
        dem = self.path('metres.tif')
        write_tiff(dem, 4, 4, range(16), corner=(500000, 5200000), cell=10.0, keys=GEOGRAPHIC)
        self.assertIn('is beyond a pole', self.refused(1, 'build', dem, '-o', self.path('metres')))
        # The pole itself is valid, within the rounding of the input.
        self.build(self.cloud([(i, 89 + j / 9) for i in range(9) for j in range(10)] + [(3, 90.0000000001)]),
                   '--crs', 'EPSG:4326')
        store = self.build(self.cloud([(5e5 + i, 5.2e6 + i * i) for i in range(9)]), '--crs', 'EPSG:32632')
        places = self.path('places.csv')
        with open(places, 'w', encoding='utf-8') as file:
            file.write('lon,lat\n9,46.9\n8,146.9\n')
        error = self.refused(1, 'sample', store, '--points', places, '--points-crs', 'EPSG:4326')
        self.assertIn('line 3: the latitude 146.9 is beyond a pole', error)

    def test_queries_beyond_a_pole_are_refused(self):
        random.seed(2)
        degrees = self.build(self.cloud([(9 + random.random(), 45 + random.random()) for _ in range(200)]),
                             '--crs', 'EPSG:4326')
        metres = self.build(self.cloud([(5e5 + random.random(), 5e6 + random.random()) for _ in range(200)]),
                            '--crs', 'EPSG:32632')
        shape = self.geojson('beyond.json', [[9, 45], [10, 45], [10, 95], [9, 45]])
        box, line = '9,45,10,95', '9,45,9,95'
        requests = [('points', '--near', '9,95', '-k', 3), ('points', '--near', '9,-95', '--within', 3),
                    ('points', '--region', box), ('points', '--focus', box + ':0'), ('points', '--region', shape),
                    ('mesh', '--region', box), ('raster', '--region', box, '--cell', '0.1'),
                    ('profile', '--line', line), ('render', '--region', box)]
        elsewhere = [('points', '--region', box, '--region-crs', 'EPSG:4326'),
                     ('profile', '--line', line, '--line-crs', 'EPSG:4326')]
        outputs = {'points': 'o.ply', 'mesh': 'o.ply', 'raster': 'o.tif', 'profile': 'o.csv', 'render': 'o.png'}
        for store, wanted in (degrees, requests), (metres, elsewhere):
            for verb, *how in wanted:
                error = self.refused(1, verb, store, *how, '-o', self.path(outputs[verb]))
                self.assertRegex(error, 'the latitude -?95 is beyond a pole', (verb, how))
                if '--focus' in how:
                    self.assertIn(f'--focus {box}:0: the latitude', error)
        # A global raster may extend beyond the poles by half a cell.
        self.ok('points', degrees, '--region', '-180.5,-90.5,180.5,90.5', '-o', self.path('all.ply'))

    def geojson(self, name, ring, **members):
        path = self.path(name)
        with open(path, 'w', encoding='utf-8') as file:
            json.dump({'type': 'FeatureCollection', **members, 'features': [
                {'type': 'Feature', 'properties': {}, 'geometry': None},
                {'type': 'Feature', 'properties': {},
                 'geometry': {'type': 'Polygon', 'coordinates': [ring + ring[:1]]}}]}, file)
        return path

    def test_geojson_is_in_its_named_crs_or_in_longitude_and_latitude(self):
        random.seed(4)
        places = [(random.uniform(3e5, 7e5), random.uniform(5e6, 6e6)) for _ in range(3000)]
        cloud = self.cloud(places)
        store = self.build(cloud, '--crs', 'EPSG:32632', '--block', 500)
        degrees = {z: (x, y) for x, y, z in self.points(store, '--to-crs', 'EPSG:4326')}
        ring = [[8, 46], [10, 46], [10, 49], [8, 49]]
        inside = {z for z, (x, y) in degrees.items() if 8 <= x <= 10 and 46 <= y <= 49}
        metres = [[4e5, 5.2e6], [6e5, 5.2e6], [6e5, 5.4e6], [4e5, 5.4e6]]
        within = {i for i, (x, y) in enumerate(places) if 4e5 <= x <= 6e5 and 5.2e6 <= y <= 5.4e6}

        def crs(name):
            return {'type': 'name', 'properties': {'name': name}}
        mercator = [[x / 180 * 20037508.342789244, math.log(math.tan(math.radians(45 + y / 2))) * 6378137]
                    for x, y in ring]
        for region, expected in (
                (self.geojson('plain.geojson', ring), inside),
                (self.geojson('84.geojson', ring, crs=crs('urn:ogc:def:crs:OGC:1.3:CRS84')), inside),
                (self.geojson('4326.geojson', ring, crs=crs('urn:ogc:def:crs:EPSG::4326')), inside),
                (self.geojson('url.geojson', ring, crs=crs('http://www.opengis.net/def/crs/EPSG/0/4326')), inside),
                (self.geojson('3857.geojson', mercator, crs=crs('EPSG:3857')), inside),
                (self.geojson('own.geojson', metres, crs=crs('urn:ogc:def:crs:EPSG::32632')), within),
                (self.geojson('null.geojson', metres, crs=None), within),
                (self.geojson('metres.geojson', metres), within)):
            with self.subTest(region):
                self.assertEqual({z for _, _, z in self.points(store, '--region', region)}, expected)
                part, text = self.path('part.terrace'), self.path('part.csv')
                self.ok('build', cloud, '--crs', 'EPSG:32632', '--region', region, '-o', part, '--force')
                self.assertEqual({z for _, _, z in self.points(part)}, expected)
                las = self.path('cloud.las')
                if not os.path.exists(las):
                    self.ok('points', store, '-o', las)
                self.ok('convert', las, '--region', region, '-o', text, '--force')
                with open(text, encoding='utf-8') as file:
                    self.assertEqual(len(file.read().splitlines()) - 1, len(expected))
        result = terrace('points', store, '--region', self.path('metres.geojson'), '-o', self.path('m.csv'))
        self.assertIn('has no crs, and its places are read in the CRS of the data, EPSG:32632', result.stderr)
        # --region-crs overrides the file.
        self.assertEqual({z for _, _, z in self.points(store, '--region', self.geojson('wrong.geojson', metres,
                                                       crs=crs('EPSG:4326')), '--region-crs', 'EPSG:32632')}, within)
        for members, words in (({'crs': crs('EPSG:0')}, 'its crs "EPSG:0" is not known'),
                               ({'crs': crs('/etc/hostname')}, 'its crs "/etc/hostname" is not known'),
                               ({'crs': {'type': 'link'}}, 'its crs does not name a CRS')):
            error = self.refused(1, 'points', store, '--region', self.geojson('bad.geojson', ring, **members), '-o', '-')
            self.assertIn(words, error)
        without = self.build(self.cloud([(random.uniform(0, 20), random.uniform(40, 50)) for _ in range(500)]))
        self.assertEqual(len(self.points(without, '--region', self.path('plain.geojson'))),
                         len(self.points(without, '--region', '8,46,10,49')))
        self.assertIn('the CRS of the data is not known', self.refused(
            1, 'points', without, '--region', self.path('84.geojson'), '-o', '-'))

    def test_a_geojson_line_is_in_longitude_and_latitude(self):
        dem = self.path('dem.tif')
        write_tiff(dem, 30, 30, [i % 30 for i in range(900)], corner=(500000, 5200000), cell=30.0,
                   keys={1024: 1, 1025: 1, 3072: 32632})
        store = self.build(dem)
        rows = []
        for name, places in (('degrees', [[9.001, 46.952], [9.008, 46.952]]),
                             ('metres', [[500100.0, 5199900.0], [500800.0, 5199900.0]])):
            with open(self.path(name), 'w', encoding='utf-8') as file:
                json.dump({'type': 'LineString', 'coordinates': places}, file)
            rows.append([line.split(',') for line in
                         self.ok('profile', store, '--line', self.path(name), '-o', '-').splitlines()[1:]])
        for profile in rows:
            self.assertTrue(all(500000 < float(row[1]) < 501000 and row[3] for row in profile))

    def test_an_empty_selection_is_an_error(self):
        cloud = self.cloud([(5e5 + i, 5.2e6 + i % 7) for i in range(50)])
        store = self.build(cloud, '--crs', 'EPSG:32632')
        las = self.path('cloud.las')
        self.ok('points', store, '-o', las)
        far = self.geojson('far.geojson', [[8, 56], [8.1, 56], [8.1, 56.1]])
        for args in (('points', store), ('mesh', store), ('mesh', store, '--max-error', 1), ('raster', store),
                     ('contour', store, '--interval', 1), ('convert', las), ('build', las), ('convert', cloud)):
            verb = args[0]
            out = self.path({'mesh': 'o.ply', 'raster': 'o.tif', 'contour': 'o.geojson', 'build': 'o.st',
                             'convert': 'o.laz', 'points': 'o.laz'}[verb])
            for option in ('--region', '1,2,3,4'), ('--region', far), ('--where', 'z < -1000'):
                if args == ('convert', cloud) and option[1] == far:
                    continue  # a file without a CRS
                with self.subTest(args=args, option=option):
                    self.refused(1, *args, *option, '-o', out)
                    self.assertFalse(os.path.exists(out))
        error = self.refused(1, 'points', store, '--near', '500001.5,5200004', '--within', 0.01, '-o', '-')
        self.assertIn('within 0.01 m of 500001.5,5200004', error)

    def test_rasters_joined_at_the_antimeridian_answer_for_both_longitudes(self):
        west, east = self.path('west.tif'), self.path('east.tif')
        for path, left in (west, 179), (east, -180):
            write_tiff(path, 10, 10, [left + i % 10 for i in range(100)], corner=(left, -17), cell=0.1,
                       keys=GEOGRAPHIC)
        store = self.build(west, east)
        self.assertAlmostEqual(self.info(store)['bounds']['max'][0], 180.95)
        places = self.path('places.csv')
        with open(places, 'w', encoding='utf-8') as file:
            file.write('179.75,-17.5\n-179.75,-17.5\n180.25,-17.5\n')
        lines = self.ok('sample', store, '--points', places).splitlines()
        self.assertEqual([float(line.split(',')[2]) for line in lines], [186, -178, -178])
        for box in '-180,-17.5,-179.5,-17.3', '180,-17.5,180.5,-17.3':
            self.assertEqual(len(self.points(store, f'--region={box}')), 10)
        self.assertEqual(self.points(store, '--near=-179.95,-17.05', '-k', 1)[0][2], -180)
        part = self.path('part.terrace')
        self.ok('build', west, east, '--region=-180,-17.5,-179.5,-17.3', '-o', part)
        self.assertEqual(sorted(z for _, _, z in self.points(part)),
                         sorted(z for _, _, z in self.points(store, '--region=-180,-17.5,-179.5,-17.3')))
        line = self.ok('profile', store, '--line=179.5,-17.5,-179.5,-17.5', '-o', '-').splitlines()
        self.assertAlmostEqual(float(line[-1].split(',')[1]), 180.5)
        self.assertNotIn('', [row.split(',')[3] for row in line])
        error = self.refused(2, 'points', store, '--region=179,-18,-179,-17', '-o', '-')
        self.assertIn('170 to 190', error)

    def test_outputs_across_the_antimeridian_stay_together(self):
        dem = self.path('fiji.tif')
        write_tiff(dem, 40, 40, [(i % 40) * (i // 40) for i in range(1600)], corner=(800000, 8240000), cell=1000.0,
                   keys={1024: 1, 1025: 1, 3072: 32760})
        store = self.build(dem)
        self.ok('contour', store, '--interval', 300, '-o', self.path('lines.geojson'))
        with open(self.path('lines.geojson'), encoding='utf-8') as file:
            lines = [line['geometry'] for line in json.load(file)['features']]
        # Only GeoJSON requires lines to be cut there (RFC 7946, 3.1.9).
        kinds = {line['type'] for line in lines}
        self.assertEqual(kinds, {'LineString', 'MultiLineString'})
        for line in lines:
            parts = line['coordinates'] if line['type'] == 'MultiLineString' else [line['coordinates']]
            for part in parts:
                self.assertGreater(len(part), 1)
                self.assertLess(max(abs(x - part[0][0]) for x, _ in part), 1)
                self.assertLessEqual(max(abs(x) for x, _ in part), 180)
            for (x, y), (on_x, on_y) in zip((part[-1] for part in parts), (part[0] for part in parts[1:])):
                self.assertEqual((abs(x), on_x, on_y), (180, -x, y))
        mesh = self.path('mesh.ply')
        self.ok('mesh', store, '--to-crs', 'EPSG:4326', '-o', mesh, '--format', 'ply-ascii')
        with open(mesh, encoding='utf-8') as file:
            vertices = file.read().split('end_header\n')[1].splitlines()[:1600]
        longitudes = [float(line.split()[0]) for line in vertices]
        self.assertTrue(min(longitudes) < 180 < max(longitudes) < 181)
        for crs in 'EPSG:4326', 'EPSG:3857':
            raster = self.path('raster.tif')
            self.ok('raster', store, '--to-crs', crs, '-o', raster, '--force')
            info = self.info(raster)
            self.assertLess(info['columns'], 60)
            self.assertGreater(info['rows'], 30)
            self.assertGreater(info['points'], 1200)
        self.ok('raster', store, '--to-crs', 'EPSG:4326', '-o', raster, '--region', '179.9,-17,180.1,-15',
                '--region-crs', 'EPSG:4326', '--force')
        self.assertGreater(self.info(raster)['points'], 300)

    def test_an_operation_without_a_grid_is_used_outside_the_area_of_all_operations(self):
        # South of Germany, beyond the grid of DHDN.
        store = self.build(self.cloud([(500000 + i, 5100000 + i * i) for i in range(9)]), '--crs', 'EPSG:32632')
        x, y, _ = self.points(store, '--to-crs', 'EPSG:31467')[0]
        self.assertAlmostEqual(x, 3500000, delta=200)
        self.assertAlmostEqual(y, 5100000 / 0.9996, delta=1200)
        self.assertIn('geocentric', self.refused(2, 'points', store, '--to-crs', 'EPSG:4978', '-o', '-'))

    def test_heights_keep_an_assumed_unit_in_another_crs(self):
        """Heights without a unit use the unit of the store's own x and y, or metres, in any output CRS."""
        rows = [100 + 3 * (i % 40) + (i // 40) % 7 for i in range(1600)]
        for own, other, corner in ((32611, 2229, (380000, 3760000)), (2229, 32611, (6500000, 1800000))):
            dem = self.path(f'unit{own}.tif')
            write_tiff(dem, 40, 40, rows, corner=corner, cell=30.0, keys={1024: 1, 1025: 1, 3072: own})
            store = self.build(dem)
            slopes, heights = [], []
            for to in ((), ('--to-crs', f'EPSG:{other}')):
                raster, mesh = self.path('slope.tif'), self.path('slope.glb')
                self.ok('raster', store, '--value', 'slope', *to, '-o', raster, '--force')
                self.ok('convert', raster, '-o', self.path('slope.xyz'), '--force')
                with open(self.path('slope.xyz'), encoding='ascii') as file:
                    values = sorted(float(line.split()[2]) for line in file)
                slopes.append(values[len(values) // 2])
                self.ok('mesh', store, *to, '-o', mesh, '--force')
                with open(mesh, 'rb') as file:
                    data = file.read()
                accessor = json.loads(data[20:20 + int.from_bytes(data[12:16], 'little')])['accessors'][0]
                heights.append(accessor['max'][1] - accessor['min'][1])
            # A raster in the other CRS names the unit that its own x and y no longer imply.
            self.ok('raster', store, '--to-crs', f'EPSG:{other}', '-o', raster, '--force')
            self.ok('mesh', self.build(raster), '-o', mesh, '--force')
            with open(mesh, 'rb') as file:
                data = file.read()
            accessor = json.loads(data[20:20 + int.from_bytes(data[12:16], 'little')])['accessors'][0]
            self.assertAlmostEqual(accessor['max'][1] - accessor['min'][1], heights[0], delta=0.03 * heights[0])
            self.assertAlmostEqual(slopes[0], slopes[1], delta=0.02 * slopes[0])
            self.assertAlmostEqual(heights[0], heights[1], delta=0.01 * heights[0])
            self.assertAlmostEqual(heights[0], 123 * (1 if own == 32611 else 1200 / 3937), delta=0.1)

    def test_a_point_that_cannot_be_converted_is_named(self):
        cloud = self.cloud([(10, 10), (20, 20), (30, 90), (40, 40)])
        store = self.build(cloud, '--crs', 'EPSG:4326')
        error = self.refused(1, 'points', store, '--to-crs', 'EPSG:3857', '-o', '-')
        self.assertIn('30 90', error)
        self.assertIn('EPSG:3857', error)


if __name__ == '__main__':
    unittest.main()
