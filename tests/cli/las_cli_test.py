#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests LAS and LAZ with `info`, `convert`, `build` and `points`, record by record.

TERRACE=path/to/terrace las_cli_test.py [CLASS...]
"""

import csv
import json
import os
import random
import re
import shutil
import struct
import subprocess
import tempfile
import time
import unittest

import small_las
from small_las import Las, evlr, extra_bytes, geo_keys, las, random_records, unpack_record, vlr, wkt

TERRACE = os.environ.get('TERRACE', 'terrace')
DATA = os.environ.get('TERRACE_DATA', '')
UTM = {1024: 1, 3072: 32632, 3076: 9001}
UTM_WKT = ('PROJCS["WGS 84 / UTM zone 33N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,'
           '298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION['
           '"Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",15],'
           'PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER['
           '"false_northing",0],UNIT["metre",1],AUTHORITY["EPSG","32633"]]')


def terrace(*args, **more):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, timeout=120, **more)


class LasCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def put(self, name, data):
        with open(self.path(name), 'wb') as file:
            file.write(data)
        return self.path(name)

    def run_ok(self, *args, **more):
        result = terrace(*args, **more)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def info(self, *args):
        return json.loads(self.run_ok('info', *args, '--json'))

    def refused(self, *args, **more):
        """Runs a failing command and returns its one-line error."""
        result = terrace(*args, **more)
        self.assertEqual(result.returncode, 1, result.stderr)
        lines = result.stderr.decode().splitlines()
        self.assertEqual(len(lines), 1, lines)
        return lines[0]

    def through_store(self, *files):
        self.run_ok('build', *files, '-o', self.path('s.st'), '--force', '-q')
        self.run_ok('points', self.path('s.st'), '-o', self.path('back.las'), '--force', '-q')
        return Las(self.path('back.las'))


class LasFormatTest(LasCase):
    """Synthetic files of every point format."""

    def test_every_point_format_survives_a_store(self):
        for point_format in range(11):
            records = random_records(point_format, 3000)
            path = self.put('in.las', las(point_format, records, scale=(0.01, 0.25, 0.001),
                                          offset=(500000, 5200000, 100), vlrs=[geo_keys(UTM)]))
            with self.subTest(point_format=point_format):
                self.run_ok('convert', path, '-o', self.path('out.csv'), '--force')
                with open(self.path('out.csv'), newline='') as file:
                    rows = list(csv.DictReader(file))
                self.assertEqual(list(rows[0])[3:], small_las.names_of(point_format))
                for record, row in zip(records, rows, strict=True):
                    values = unpack_record(point_format, record)
                    x, y, z = (values.pop(axis) for axis in 'XYZ')
                    self.assertEqual([float(row[axis]) for axis in 'xyz'],
                                     [x * 0.01 + 500000, y * 0.25 + 5200000, z * 0.001 + 100])
                    for name, value in values.items():
                        wanted = value * 0.006 if name == 'scan_angle' else value
                        self.assertEqual(type(wanted)(row[name]), wanted)
                # Waveform data is not stored, so the fields of waveform packets become extra bytes.
                plain = {4: 1, 5: 3, 9: 6, 10: 8}.get(point_format, point_format)
                self.run_ok('convert', path, '-o', self.path('out.laz'), '--force')
                self.assertEqual(self.info(self.path('out.laz'))['format'], 'laz')
                self.run_ok('convert', self.path('out.laz'), '-o', self.path('out.las'), '--force')
                for copy in (Las(self.path('out.las')), self.through_store(path)):
                    self.assertEqual(copy.minor, 4)
                    self.assertEqual(copy.point_format, plain)
                    self.assertEqual(copy.software, b'terrace')
                    self.assertEqual((copy.scale, copy.offset),
                                     ((0.01, 0.25, 0.001), (500000, 5200000, 100)))
                    self.assertEqual(sorted(copy.records), sorted(records))
                    text = copy.vlrs['LASF_Projection', 2112].decode()
                    self.assertTrue(text.startswith('PROJCS['), text)
                    self.assertIn('"32632"]]', text)
                    self.assertEqual(copy.encoding & 16, 16)
                    for axis, name in enumerate('XYZ'):
                        steps = [unpack_record(point_format, record)[name] for record in records]
                        self.assertEqual(copy.min[axis], min(steps) * copy.scale[axis] + copy.offset[axis])
                        self.assertEqual(copy.max[axis], max(steps) * copy.scale[axis] + copy.offset[axis])
                    returns = [unpack_record(point_format, record)['return_number'] for record in records]
                    self.assertEqual(list(copy.returns), [returns.count(n) for n in range(1, 16)])
                    self.assertEqual(copy.old_count, 3000 if plain < 6 else 0)

    def test_extra_bytes_become_attributes_of_their_type(self):
        rows = [('count', 1, 0, 0, 0), ('height', 4, 8 + 16, 0.25, -10), ('double', 10, 0, 0, 0),
                ('big', 7, 0, 0, 0), ('pair', 16, 0, 0, 0), ('opaque', 0, 2, 0, 0)]
        records = [record + struct.pack('<BhdQiibbB', 7 + i, -3 * i, i / 7, 2**64 - 1 - i, i, -i, 1, 2, 200)
                   for i, record in enumerate(random_records(6, 50))]
        path = self.put('extra.las', las(6, records, vlrs=[extra_bytes(rows[:3]), vlr(b'other', 4, b'x'),
                                                           extra_bytes(rows[3:])]))
        self.run_ok('convert', path, '-o', self.path('out.csv'))
        with open(self.path('out.csv'), newline='') as file:
            table = list(csv.DictReader(file))
        for i, row in enumerate(table):
            self.assertEqual(int(row['count']), 7 + i)
            self.assertEqual(float(row['height']), -0.75 * i - 10)
            self.assertEqual(float(row['double']), i / 7)
            self.assertEqual(int(row['big']), 2**64 - 1 - i)
            # A pair is type 16, which LAS 1.4 deprecates: two values of type 6.
            self.assertEqual((int(row['pair_0']), int(row['pair_1'])), (i, -i))
            self.assertEqual((int(row['opaque_0']), int(row['opaque_1']), int(row['extra_0'])), (1, 2, 200))
        copy = self.through_store(path)
        self.assertEqual(sorted(copy.records), sorted(records))
        names = [row[4:36].rstrip(b'\0').decode() for row in
                 map(bytes, zip(*[iter(copy.vlrs['LASF_Spec', 4])] * 192))]
        self.assertEqual(names, ['count', 'height', 'double', 'big', 'pair_0', 'pair_1', 'opaque_0', 'opaque_1',
                                 'extra_0'])
        self.assertEqual(struct.unpack_from('<d16xd', copy.vlrs['LASF_Spec', 4], 192 + 112), (0.25, -10))

    def test_week_time_and_adjusted_time_are_not_mixed(self):
        records = random_records(6, 20)
        week, adjusted = (self.put(f'{bit}.las', las(6, records, encoding=bit)) for bit in (0, 1))
        self.assertEqual(self.through_store(week).encoding & 1, 0)
        self.assertEqual(self.through_store(adjusted).encoding & 1, 1)
        self.assertIn('GPS week', self.refused('build', week, adjusted, '-o', self.path('two.st')))

    def test_withheld_points_are_kept_and_counted(self):
        records = random_records(1, 200)
        withheld = sum(unpack_record(1, record)['withheld'] for record in records)
        path = self.put('w.las', las(1, records))
        self.assertEqual(self.info(path)['withheld'], withheld)
        self.assertIn(f'withheld:  {withheld} point', self.run_ok('info', path).decode())
        result = terrace('build', path, '-o', self.path('w.st'), '--json')
        self.assertIn(f'{withheld} points are marked as withheld', result.stderr.decode())
        self.assertEqual(json.loads(result.stdout)['withheld'], withheld)
        self.assertEqual(self.info(self.path('w.st'))['points'], 200)

    def test_withheld_points_of_different_formats_are_counted(self):
        due = {'': 0, 'intensity < 30000': 0}
        paths = []
        for point_format in (1, 3):
            records = random_records(point_format, 200)
            paths.append(self.put(f'format{point_format}.las', las(point_format, records)))
            for record in records:
                fields = unpack_record(point_format, record)
                due[''] += fields['withheld']
                due['intensity < 30000'] += fields['withheld'] if fields['intensity'] < 30000 else 0
        for where, withheld in due.items():
            self.assertGreater(withheld, 0)
            result = terrace('build', *paths, '-o', self.path('differ.st'), '--force', '--keep', 'intensity',
                             *(['--where', where] if where else []))
            self.assertIn(f'{withheld} points are marked as withheld', result.stderr.decode())

    def test_the_wkt_bit_decides_between_keys_and_wkt(self):
        records = random_records(1, 20)
        for bit, code in ((0, 32632), (16, 32633)):
            path = self.put('two.las', las(1, records, encoding=bit, vlrs=[geo_keys(UTM), wkt(UTM_WKT)]))
            self.assertEqual(self.info(path)['crs']['epsg'], code)
        only = self.put('only.las', las(1, records, vlrs=[wkt(UTM_WKT)]))
        self.assertEqual(self.info(only)['crs']['epsg'], 32633)

    def test_the_unit_of_heights_is_kept(self):
        """From the header of a CSV file to a store, LAS, LAZ and COPC, with and without a CRS."""
        def metres(path):
            return {'metre': 1, None: 1, 'foot': 0.3048, 'US survey foot': 1200 / 3937}[
                (self.info(path)['crs'] or {'vertical_unit': None})['vertical_unit']]
        header = {'foot': 'z (ft)', 'US survey foot': 'elev_us_ft', 'metre': 'height [m a.s.l.]'}
        for unit, name in header.items():
            rows = '\n'.join(f'{i},{40 + i / 5},{i * i / 4}' for i in range(50))
            table = self.put('table.csv', f'x,y,{name}\n{rows}\n'.encode())
            expected = {'foot': 0.3048, 'US survey foot': 1200 / 3937, 'metre': 1}[unit]
            for crs, heights in (('', None), ('EPSG:32632', None), ('EPSG:2263', None), ('EPSG:4326', None),
                                 ('EPSG:4979', 'ellipsoidal'), ('EPSG:4326+5773', 'orthometric')):
                store = self.path('unit.store')
                shutil.rmtree(store, ignore_errors=True)
                self.run_ok('build', table, *(('--crs', crs) if crs else ()), '-o', store)
                for ending in '.las', '.laz', '.copc.laz':
                    file = self.path('unit' + ending)
                    self.run_ok('points', store, '-o', file, '--force')
                    self.assertEqual(metres(file), expected, (unit, crs, ending))
                    told = self.info(file)
                    self.assertEqual(told['vertical'], heights, (unit, crs, ending))
                    if crs == 'EPSG:2263':
                        self.assertEqual(told['crs']['vertical_unit'], unit)
                        self.assertEqual(told['crs']['epsg'], 2263)
                if crs:
                    self.run_ok('points', store, '--to-crs', 'EPSG:3857', '-o', file, '--force')
                    self.assertEqual(metres(file), expected, (unit, crs))
            copy = self.path('copy.laz')
            self.run_ok('convert', table, '-o', copy, '--force')
            self.assertEqual(metres(copy), expected)
            # A horizontal CRS from the user says nothing of heights.
            shutil.rmtree(store, ignore_errors=True)
            self.run_ok('build', copy, '--crs', 'EPSG:32632', '-o', store)
            self.run_ok('points', store, '-o', file, '--force')
            self.assertEqual(metres(file), expected, unit)
            for ending in '.xyz', '.ply':
                result = terrace('convert', copy, '-o', self.path('lost' + ending), '--force')
                self.assertEqual(b'no place for a unit' in result.stderr, unit != 'metre', result.stderr)
            # CSV names the unit in its header.
            head = {'foot': 'x,y,z (ft)', 'US survey foot': 'x,y,z (ftUS)', 'metre': 'x,y,z'}[unit]
            for verb, source in (('convert', copy), ('points', store)):
                text = self.path('kept.csv')
                result = terrace(verb, source, '-o', text, '--force')
                self.assertNotIn(b'no place', result.stderr)
                with open(text, encoding='ascii') as rows:
                    self.assertTrue(rows.readline().startswith(head), head)
                self.assertEqual(metres(text), expected, (verb, unit))
        # Nor does it if the file's own CRS is WKT.
        feet = (f'COMPD_CS["c",{UTM_WKT},VERT_CS["h",VERT_DATUM["d",2005],'
                'UNIT["US survey foot",0.304800609601219]]]')
        own = self.put('own.las', las(6, random_records(6, 20), encoding=16, vlrs=[wkt(feet)]))
        for crs in ((), ('--crs', 'EPSG:32632')):
            shutil.rmtree(store, ignore_errors=True)
            self.run_ok('build', own, *crs, '-o', store)
            self.assertEqual(self.info(store)['crs']['vertical_unit'], 'US survey foot', crs)
        inches = self.put('inches.csv', b'x,y,z (in)\n1,2,3\n2,3,4\n')
        self.assertIn(b'heights are in inches', terrace('convert', inches, '-o', self.path('inches.las')).stderr)
        strange = self.put('strange.csv', b'x,y,z (NAVD88)\n1,2,3\n2,3,4\n')
        self.assertIn(b"unit 'NAVD88' of z in the header", terrace('convert', strange, '-o', self.path('strange.las')).stderr)

    def test_csv_names_the_units_of_all_coordinates(self):
        """Otherwise x and y in feet would be read as metres next to heights in feet."""
        for header, expected in (('x (ft),y (ft),z (ft)', 'x (ft),y (ft),z (ft)'), ('x (ft),y (ft),z (m)', 'x (ft),y (ft),z (m)'),
                                 ('x (ft),y (ft),z', 'x (ft),y (ft),z'), ('x (m),y (m),z (m)', 'x,y,z'), ('x,y,z (ft)', 'x,y,z (ft)')):
            source = self.put('units.csv', f'{header}\n0,0,0\n100,0,50\n0,100,20\n100,100,70\n'.encode())
            copy, store = self.path('copy.csv'), self.path('units.store')
            self.run_ok('convert', source, '-o', copy, '--force')
            with open(copy, encoding='ascii') as rows:
                self.assertEqual(rows.readline().strip(), expected)
            slopes = []
            for file in source, copy:
                shutil.rmtree(store, ignore_errors=True)
                self.run_ok('build', file, '-o', store)
                slopes.append(terrace('sample', store, input=b'50,10\n').stdout)
            self.assertEqual(slopes[0], slopes[1], header)

    def test_ellipsoidal_heights_are_kept(self):
        """Also if only --vertical says so, and after a conversion of x and y."""
        for unit, name in (None, 'z'), ('metre', 'z (m)'), ('foot', 'z (ft)'):
            rows = '\n'.join(f'{i},{40 + i / 5},{i * i / 4}' for i in range(50))
            table = self.put('table.csv', f'x,y,{name}\n{rows}\n'.encode())
            for crs, options in (('EPSG:32632', ('--vertical', 'ellipsoidal')), ('EPSG:4326', ('--vertical', 'ellipsoidal')),
                                 ('EPSG:4326+5773', ('--vertical', 'ellipsoidal')), ('EPSG:4979', ())):
                store = self.path('ellipsoidal.store')
                shutil.rmtree(store, ignore_errors=True)
                self.run_ok('build', table, '--crs', crs, *options, '-o', store)
                for file, to in (('own.las', ()), ('own.laz', ()), ('other.laz', ('--to-crs', 'EPSG:3857'))):
                    self.run_ok('points', store, *to, '-o', self.path(file), '--force')
                    info = self.info(self.path(file))
                    self.assertEqual(info['vertical'], 'ellipsoidal', (unit, crs, file))
                    if unit == 'foot':
                        self.assertEqual(info['crs']['vertical_unit'], 'foot', (crs, file))
                self.run_ok('convert', self.path('own.las'), '-o', self.path('copy.las'), '--force')
                self.assertEqual(self.info(self.path('copy.las'))['vertical'], 'ellipsoidal', (unit, crs))

    def test_wkt_after_the_points_is_read_from_files_and_requested_for_pipes(self):
        records = random_records(6, 20)
        data = las(6, records, encoding=16, evlrs=[
            evlr(b'other', 1, bytes(1000)), evlr(b'LASF_Projection', 2112, UTM_WKT.encode())])
        path = self.put('evlr.las', data)
        self.assertEqual(self.info(path)['crs']['epsg'], 32633)
        error = self.refused('build', '-', '-o', self.path('p.st'), input=data)
        self.assertIn('follows the points', error)
        self.assertIn('--crs EPSG:n', error)
        self.run_ok('build', '-', '-o', self.path('p.st'), '--crs', 'EPSG:32633', input=data)
        self.assertEqual(self.info(self.path('p.st'))['points'], 20)

    def test_a_pipe_gives_the_same_store_as_the_file(self):
        data = las(3, random_records(3, 30000), vlrs=[geo_keys(UTM)])
        self.run_ok('build', self.put('a.las', data), '-o', self.path('a.st'))
        self.run_ok('build', '-', '-o', self.path('b.st'), input=data)
        for name in os.listdir(self.path('a.st')):
            with open(os.path.join(self.path('a.st'), name), 'rb') as a, \
                    open(os.path.join(self.path('b.st'), name), 'rb') as b:
                self.assertEqual(a.read(), b.read(), name)


class LasOctreeTest(LasCase):
    """COPC as output."""

    def test_records_come_back_in_any_order(self):
        for point_format in (6, 7, 8):
            records = random_records(point_format, 50000)
            path = self.put('in.las', las(point_format, records, scale=(0.01, 0.01, 0.001), vlrs=[wkt(UTM_WKT)]))
            with self.subTest(point_format=point_format):
                self.run_ok('convert', path, '-o', self.path('out.copc.laz'), '--force')
                info = self.info(self.path('out.copc.laz'))
                self.assertEqual((info['format'], info['points'], info['crs']['epsg']), ('copc', 50000, 32633))
                self.assertGreater(info['octree']['nodes'], 4)
                self.run_ok('convert', self.path('out.copc.laz'), '-o', self.path('back.las'), '--force')
                back = Las(self.path('back.las'))
                self.assertEqual((back.point_format, back.scale), (point_format, (0.01, 0.01, 0.001)))
                self.assertEqual(sorted(back.records), sorted(records))
                coarse = json.loads(self.run_ok('convert', self.path('out.copc.laz'), '-o', self.path('coarse.las'),
                                                '--force', '--json', '--resolution', info['octree']['spacing']))
                self.assertLess(coarse['points'], 50000)

    def test_points_of_a_store(self):
        """COPC is chosen by the ending or by name; the bytes do not depend on threads and memory."""
        self.run_ok('synth', 'surface', '--points', 50000, '-o', self.path('s.ply'))
        self.run_ok('build', self.path('s.ply'), '-o', self.path('s.st'))
        self.run_ok('points', self.path('s.st'), '-o', self.path('a.copc.laz'), '--threads', 1)
        self.run_ok('points', self.path('s.st'), '-o', self.path('b.laz'), '--format', 'copc', '--threads', 3)
        with open(self.path('a.copc.laz'), 'rb') as a, open(self.path('b.laz'), 'rb') as b:
            self.assertEqual(a.read(), b.read())
        self.assertEqual(self.info(self.path('b.laz'))['format'], 'copc')
        self.assertEqual(self.info(self.path('b.laz'))['points'], 50000)
        # Files of other programs are not replaced, and COPC cannot go to a pipe.
        with open(self.path('b.laz'), 'r+b') as file:
            file.seek(58)
            file.write(b'other')
        self.refused('points', self.path('s.st'), '-o', self.path('b.laz'), '--format', 'copc', '--force')
        self.assertIn('pipe', self.refused('points', self.path('s.st'), '-o', '-', '--format', 'copc'))


class LasSurveyTest(LasCase):
    """Several files, and other formats to LAS."""

    def test_files_with_other_offsets_move_to_the_first_files_lattice(self):
        first, second = random_records(1, 2000), random_records(1, 2000, seed=2)
        a = self.put('a.las', las(1, first, offset=(500000, 5200000, 0)))
        b = self.put('b.las', las(1, second, offset=(500012.34, 5199000, -7)))
        copy = self.through_store(a, b)
        self.assertEqual(copy.offset, (500000, 5200000, 0))

        def moved(record):
            x, y, z = struct.unpack_from('<iii', record)
            return struct.pack('<iii', x + 1234, y - 100000, z - 700) + record[12:]
        self.assertEqual(sorted(copy.records), sorted(first + [moved(record) for record in second]))

    def test_files_of_any_scale_and_offset_make_a_store(self):
        records = random_records(1, 50)
        first = self.put('a.las', las(1, records))
        for name, more, scale in (('b.las', {'offset': (0, 0.005, 0)}, (0.005, 0.005, 0.01)),
                                  ('c.las', {'scale': (0.01, 0.01, 0.001)}, (0.01, 0.01, 0.001))):
            second = self.put(name, las(1, records, **more))
            copy = self.through_store(first, second)
            self.assertEqual(copy.scale, scale)
            self.assertEqual(copy.places(), sorted(Las(first).places() + Las(second).places()))
        odd = self.put('odd.las', las(1, records, scale=(0.0123456789, 0.01, 0.01)))
        run = terrace('build', first, odd, '-o', self.path('odd.st'))
        self.assertIn('kept as doubles', run.stderr.decode())
        self.run_ok('points', self.path('odd.st'), '-o', self.path('odd.csv'))
        with open(self.path('odd.csv')) as file:
            rows = sorted(tuple(round(float(value), 6) for value in line.split(',')[:3]) for line in list(file)[1:])
        self.assertEqual(rows, sorted(Las(first).places() + Las(odd).places()))

    def test_files_with_different_spellings_of_a_crs_make_one_store(self):
        records = random_records(1, 20)
        esri = re.sub(r',AUTHORITY\[[^]]*\]', '', UTM_WKT)
        names = [self.put(f'{i}.las', las(1, records, vlrs=vlrs)) for i, vlrs in enumerate((
            [geo_keys({1024: 1, 3072: 32633})], [geo_keys({1024: 1, 1025: 1, 3072: 32633, 3076: 9001})],
            [wkt(UTM_WKT)], [wkt(esri)]))]
        for first in names:
            with self.subTest(first=first):
                self.run_ok('build', first, *names, '-o', self.path('all.st'), '--force', '-q')
                self.assertEqual(self.info(self.path('all.st'))['crs']['epsg'], 32633)
                self.run_ok('convert', first, *names, '-o', self.path('all.xyz'), '--force', '-q')
        other = self.put('other.las', las(1, records, vlrs=[geo_keys({1024: 1, 3072: 32632})]))
        self.assertIn('reference system differs from that of', self.refused('build', names[0], other, '-o', self.path('no.st')))

    def test_text_becomes_las_with_its_number_of_decimals(self):
        with open(self.path('p.csv'), 'w') as file:
            file.write('x,y,z,intensity,red,green,blue,classification,quality\n')
            for i in range(100):
                file.write(f'{691000 + i / 1000:.3f},5338000.25,{i / 10:.1f},{i},{i},{2 * i},{3 * i},2,{i / 3}\n')
        self.run_ok('convert', self.path('p.csv'), '-o', self.path('p.las'))
        copy = Las(self.path('p.las'))
        self.assertEqual((copy.point_format, copy.record_bytes), (7, 36 + 8))
        self.assertEqual(copy.scale, (0.001, 0.001, 0.001))
        for i, record in enumerate(copy.records):
            values = unpack_record(7, record)
            self.assertAlmostEqual(values['X'] * 0.001 + copy.offset[0], 691000 + i / 1000, places=9)
            self.assertEqual([values[name] for name in ('intensity', 'red', 'green', 'blue', 'classification')],
                             [i, i, 2 * i, 3 * i, 2])
            # Missing return fields mean a single return.
            self.assertEqual((values['return_number'], values['number_of_returns']), (1, 1))
            self.assertEqual(struct.unpack_from('<d', record, 36), (i / 3,))

    def test_the_summary_reports_rounding(self):
        with open(self.path('p.xyz'), 'w') as file:
            file.writelines(f'{i / 7} {1e6 + i * 3000 + 1 / 3} 0\n' for i in range(1000))
        result = terrace('convert', self.path('p.xyz'), '-o', self.path('p.las'), '--json')
        copy = Las(self.path('p.las'))
        rounding = json.loads(result.stdout)['rounding']
        self.assertLessEqual(rounding, copy.scale[0] / 2 * (1 + 1e-6))
        self.assertGreater(rounding, 0)
        self.run_ok('convert', self.path('p.las'), '-o', self.path('q.las'))
        with open(self.path('p.las'), 'rb') as a, open(self.path('q.las'), 'rb') as b:
            self.assertEqual(a.read(), b.read())

    def test_values_outside_a_fields_range_are_refused(self):
        with open(self.path('p.csv'), 'w') as file:
            file.write('x,y,z,intensity\n1,2,3,4\n1,2,3,70000\n')
        error = self.refused('convert', self.path('p.csv'), '-o', self.path('p.las'))
        self.assertIn('point 1', error)
        self.assertIn('intensity', error)
        self.assertFalse(os.path.exists(self.path('p.las')))

    def test_force_replaces_only_files_written_by_terrace(self):
        records = random_records(1, 50)
        a = self.put('a.las', las(1, records))
        self.run_ok('convert', a, '-o', self.path('b.las'))
        self.run_ok('convert', a, '-o', self.path('b.las'), '--force')
        self.refused('convert', self.path('b.las'), '-o', a, '--force')

    def test_other_verbs_write_las_too(self):
        records = random_records(1, 500)
        a = self.put('a.las', las(1, records, vlrs=[geo_keys(UTM)], offset=(500000, 5200000, 0)))
        self.run_ok('cluster', a, '-o', self.path('c.las'))
        self.assertEqual(len(Las(self.path('c.las')).records), 500)
        self.run_ok('build', a, '-o', self.path('a.st'))
        self.run_ok('points', self.path('a.st'), '-o', self.path('near.las'), '--near', '500000,5200000', '-k', 9)
        near = Las(self.path('near.las'))
        self.assertEqual(near.record_bytes, 28 + 8)
        self.assertTrue({record[:28] for record in near.records} <= set(records))
        self.run_ok('points', self.path('a.st'), '-o', self.path('geo.las'), '--to-crs', 'EPSG:4326')
        geo = Las(self.path('geo.las'))
        self.assertLess(abs(geo.min[0] - 9), 0.1)
        self.assertIn('4326', geo.vlrs['LASF_Projection', 2112].decode())
        self.assertLessEqual(geo.scale[0], 1e-7)


class LasTwinTest(LasCase):
    """A store of integer coordinates and a store of the same positions as doubles are the same terrain."""

    @staticmethod
    def triangles(file):
        """The triangles of an OBJ file in canonical order, with positions rounded to a micrometre."""
        places, found = [], []
        for line in file:
            kind, *words = line.split()
            if kind == b'v':
                places.append(tuple(round(float(word), 6) for word in words))
            elif kind == b'f':
                corners = [places[int(word) - 1] for word in words]
                least = corners.index(min(corners))
                found.append(corners[least:] + corners[:least])
        return sorted(found)

    def test_integer_and_double_coordinates_give_the_same_results(self):
        source = random.Random(7)
        places = {(source.randrange(1600), source.randrange(1200)) for _ in range(3000)}
        points = [(x, y, (x * x // 900 + 3 * y) // 8) for x, y in sorted(places)]
        self.put('a.las', las(0, [struct.pack('<iii8x', x, y, z - 400) for x, y, z in points],
                              scale=(0.25,) * 3, offset=(690000, 5190000, 100), vlrs=[geo_keys(UTM)]))
        with open(self.path('b.xyz'), 'w') as file:
            file.writelines(f'{690000 + x / 4} {5190000 + y / 4} {z / 4}\n' for x, y, z in points)
        with open(self.path('ask.csv'), 'w') as file:
            file.write('x,y\n')
            file.writelines(f'{690000 + 7.3 * i},{5190000 + 5.1 * i}\n' for i in range(55))
        with open(self.path('metric.json'), 'w') as file:
            json.dump({'regions': [{'box': [690050, 5190050, 690200, 5190200], 'semi_axes': [6, 2],
                                    'angle': 40}]}, file)
        self.run_ok('build', self.path('a.las'), '-o', self.path('a.st'), '--block', 400)
        self.run_ok('build', self.path('b.xyz'), '-o', self.path('b.st'), '--block', 400, '--crs', 'EPSG:32632')
        box = '690100,5190050,690250,5190200'
        for verb, ending, *options in (
                ('mesh', 'obj', '--region', box), ('mesh', 'obj', '--max-error', 5, '--quality', 'fitted'),
                ('mesh', 'obj', '--max-points', 200), ('mesh', 'obj', '--smooth', 'bilateral:3'),
                ('mesh', 'obj', '--metric', 'elliptical:' + self.path('metric.json')),
                ('sample', 'csv', '--points', self.path('ask.csv'), '--method', 'natural', '--max-edge', 40),
                ('sample', 'csv', '--points', self.path('ask.csv'), '--method', 'nearest'),
                ('contour', 'json', '--interval', 20), ('raster', 'tif', '--value', 'slope'),
                ('raster', 'tif', '--to-crs', 'EPSG:4326', '--cell', 0.0001)):
            with self.subTest(verb=verb, options=options):
                texts = []
                for store in ('a.st', 'b.st'):
                    out = self.path(f'out.{ending}')
                    self.run_ok(verb, self.path(store), *options, '-o', out, '--force')
                    with open(out, 'rb') as file:
                        texts.append(self.triangles(file) if ending == 'obj' else file.read())
                self.assertEqual(*texts)
        for options in (('--region', box), ('--near', '690200,5190100', '--within', 20)):
            found = []
            for store in ('a.st', 'b.st'):
                text = self.run_ok('points', self.path(store), '-o', '-', '--format', 'xyz', *options).decode()
                found.append(sorted(line.split()[:3] for line in text.splitlines()))
            self.assertEqual(*found)
            self.assertGreater(len(found[0]), 10)


class LasHostileTest(LasCase):
    """Damaged files give a one-line error, at once and in little memory."""

    def refused_at_once(self, data, *parts):
        path = self.put('h.las', data)
        started = time.monotonic()
        for error in (self.refused('info', path), self.refused('info', '-', input=data)):
            for part in parts:
                self.assertIn(part, error)
        self.assertLess(time.monotonic() - started, 4)

    def test_headers_that_announce_missing_data(self):
        records = random_records(1, 10)
        good = las(1, records)
        self.refused_at_once(good[:100], 'ends in its header')
        self.refused_at_once(good[:-1], 'byte')
        self.refused_at_once(las(1, records, points=2**32 - 1), 'byte')
        self.refused_at_once(las(6, random_records(6, 1), points=2**63), 'byte')
        self.refused_at_once(las(1, records, record_bytes=27), 'take 28 bytes, not 27')
        self.refused_at_once(las(1, [bytes(65535)] * 2), '65507 extra bytes')
        self.refused_at_once(las(1, records, scale=(0.01, 0, 0.01)), 'not positive')
        self.refused_at_once(las(1, records, offset=(0, float('nan'), 0)), 'not finite')
        self.refused_at_once(good[:104] + b'\x0b' + good[105:], 'point format 11')
        self.refused_at_once(good[:25] + b'\x05' + good[26:], 'LAS 1.5', '1.0 to 1.4')
        self.refused_at_once(good[:94] + b'\x10\x00' + good[96:], '16 bytes')
        self.refused_at_once(good[:96] + b'\xff\xff\xff\xff' + good[100:], 'byte')
        self.refused_at_once(good[:96] + b'\x00\x00\x00\x00' + good[100:], 'begin inside')

    def test_a_damaged_chunk_is_named(self):
        records = random_records(6, 120000)
        self.run_ok('convert', self.put('a.las', las(6, records)), '-o', self.path('a.laz'))
        with open(self.path('a.laz'), 'rb') as file:
            good = file.read()
        first, = struct.unpack_from('<I', good, 96)
        table, = struct.unpack_from('<Q', good, first)
        middle = (first + table) // 2
        damaged = good[:middle] + bytes(64) + good[middle + 64:]
        for threads in (1, 2):
            self.put('b.laz', damaged)
            error = self.refused('build', self.path('b.laz'), '-o', self.path('b.st'), '--threads', threads)
            self.assertRegex(error, r'b\.laz: chunk 1, byte [0-9]+: ')
            self.assertFalse(os.path.exists(self.path('b.st')))
            # On request, the other chunks are kept and the loss is reported.
            built = terrace('build', self.path('b.laz'), '-o', self.path('b.st'), '--threads', threads, '--skip-damaged',
                            '--json')
            self.assertEqual(built.returncode, 0, built.stderr)
            summary = json.loads(built.stdout)
            self.assertEqual((summary['points'], summary['lost']), (70000, 50000))
            self.assertRegex(built.stderr.decode(), r'b\.laz: chunk 1, byte [0-9]+: .* \(50,000 points left out\)')
            shutil.rmtree(self.path('b.st'))
            summary = json.loads(self.run_ok('convert', self.path('b.laz'), '-o', self.path('b.las'), '--force',
                                             '--threads', threads, '--skip-damaged', '--json'))
            self.assertEqual((summary['points'], summary['lost']), (70000, 50000))
            self.assertEqual(Las(self.path('b.las')).records, records[:50000] + records[100000:])
        # Each of several files is opened twice, but its damage is reported once.
        self.put('e.laz', good[:first] + struct.pack('<Q', 2**62) + good[first + 8:])
        result = terrace('convert', self.path('e.laz'), self.path('a.laz'), '-o', self.path('two.las'), '--skip-damaged')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stderr.count(b'chunk table is outside'), 1, result.stderr)
        self.assertIn('chunk 1', self.refused('info', '-', input=damaged))
        self.refused_at_once(good[:middle], 'a')
        lost = self.put('l.laz', good[:first] + struct.pack('<Q', 2**62) + good[first + 8:])
        self.assertIn('chunk table is outside', self.refused('info', lost))
        self.refused_at_once(good[:247] + struct.pack('<Q', 2**60) + good[255:], 'chunk')
        # Without a chunk table, as when the writer was a pipe, the chunks give their sizes.
        streamed = good[:first] + struct.pack('<Q', first) + good[first + 8:]
        self.assertEqual(self.info(self.put('s.laz', streamed))['points'], 120000)
        for data in (good, streamed, good[:first] + b'\xff' * 8 + good[first + 8:] + struct.pack('<Q', table)):
            self.run_ok('convert', '-', '-o', self.path('p.las'), '--force', input=data)
            self.assertEqual(Las(self.path('p.las')).records, records)

    def test_a_wrong_number_of_vlrs_is_tolerated(self):
        records = random_records(1, 10)
        good = las(1, records, vlrs=[geo_keys(UTM)])
        for count in (0, 2, 2**32 - 1):
            path = self.put('c.las', good[:100] + struct.pack('<I', count) + good[104:])
            self.assertEqual(self.info(path)['points'], 10)


@unittest.skipUnless(DATA, 'no TERRACE_DATA')
class LasDataTest(LasCase):
    """Real surveys."""

    def test_surveys_survive_a_store_record_by_record(self):
        for name in ('1.2-with-color.las', '4_6_crop.las', 'autzen_trim_7.las', 'extrabytes.las',
                     'coromandel_points_test.las', 'hexbin-crop.las', 'laspy_simple1_3.las', 'mvk-thin.las'):
            with self.subTest(name=name):
                path = os.path.join(DATA, 'lidar', name)
                options = ['--crs', 'EPSG:2903'] if name in ('4_6_crop.las', 'mvk-thin.las',
                                                              'laspy_simple1_3.las') else []
                before = Las(path)
                self.run_ok('build', path, '-o', self.path('s.st'), '--force', '-q', *options)
                self.run_ok('points', self.path('s.st'), '-o', self.path('b.las'), '--force', '-q')
                after = Las(self.path('b.las'))
                self.assertEqual((after.scale, after.offset), (before.scale, before.offset))
                self.assertEqual(sorted(after.records), sorted(before.records))

    def test_colour_and_intensity_are_written_to_ply_and_csv(self):
        path = os.path.join(DATA, 'lidar', '1.2-with-color.las')
        self.run_ok('build', path, '-o', self.path('s.st'))
        self.run_ok('points', self.path('s.st'), '-o', self.path('p.csv'))
        self.run_ok('points', self.path('s.st'), '-o', self.path('p.ply'))
        self.run_ok('convert', self.path('p.ply'), '-o', self.path('q.csv'))
        before = Las(path)
        wanted = []
        for record in before.records:
            values = unpack_record(3, record)
            # Text from LAS has the decimals of its scale; text from the doubles of a PLY file has
            # all digits.
            wanted.append([*(round(values[axis] * s + o, 2) for axis, s, o in zip('XYZ', before.scale, before.offset)),
                           *(values[name] for name in ('intensity', 'red', 'green', 'blue', 'gps_time'))])
        for name in ('p.csv', 'q.csv'):
            with open(self.path(name), newline='') as file:
                found = [[float(row[column]) for column in ('x', 'y', 'z', 'intensity', 'red', 'green', 'blue',
                                                            'gps_time')] for row in csv.DictReader(file)]
            if name == 'q.csv':
                found = [[*(round(value, 2) for value in row[:3]), *row[3:]] for row in found]
            self.assertTrue(sorted(found) == sorted(wanted), name)

    def test_laz_and_las_of_the_same_points_make_the_same_store(self):
        for kind, crs in (('las', 'EPSG:2994'), ('laz', 'EPSG:2994')):
            self.run_ok('build', os.path.join(DATA, 'lidar', f'autzen_trim.{kind}'), '-o', self.path(kind),
                        '--crs', crs, '--threads', 2)
        for name in os.listdir(self.path('las')):
            if name != 'manifest.json':  # the manifest names the format
                with open(os.path.join(self.path('las'), name), 'rb') as a, \
                        open(os.path.join(self.path('laz'), name), 'rb') as b:
                    self.assertEqual(a.read(), b.read())

    def test_cloud_optimised_files_are_read(self):
        copc = os.path.join(DATA, 'lidar', '1.2-with-color.copc.laz')
        info = self.info(copc)
        self.assertEqual((info['points'], info['format']), (1065, 'copc'))
        self.run_ok('build', copc, '-o', self.path('c.st'))
        self.run_ok('points', self.path('c.st'), '-o', self.path('c.laz'))
        self.assertEqual(self.info(self.path('c.laz'))['points'], 1065)

    def test_region_and_resolution_of_cloud_optimised_files(self):
        """The counts match those that Python reads from the hierarchy's nodes."""
        copc = os.path.join(DATA, 'lidar', 'lone-star.copc.laz')
        with open(copc, 'rb') as file:
            data = file.read()
        spacing, offset, size = struct.unpack_from('<dQQ', data, 375 + 54 + 32)
        pages, nodes = [(offset, size)], []
        while pages:
            offset, size = pages.pop()
            for depth, _, _, _, at, count, points in struct.iter_unpack('<iiiiQii', data[offset:offset + size]):
                if points == -1:
                    pages.append((at, count))
                elif points > 0:
                    nodes.append((depth, points))
        depths = max(depth for depth, _ in nodes) + 1
        self.assertEqual(self.info(copc)['octree'], {'spacing': spacing, 'depths': depths, 'nodes': len(nodes)})
        self.assertIn(b'octree: ', self.run_ok('info', copc))
        for deepest in range(depths):
            wanted = sum(points for depth, points in nodes if depth <= deepest)
            summary = json.loads(self.run_ok('convert', copc, '-o', self.path('r.las'), '--force', '--json',
                                             '--resolution', spacing / 2 ** deepest))
            self.assertEqual((summary['points'], summary['excluded']), (wanted, 518862 - wanted))

        box = (515375.0, 4918350.0, 515385.5, 4918360.25)
        self.run_ok('convert', copc, '-o', self.path('all.csv'), '--keep', 'none')
        with open(self.path('all.csv'), newline='', encoding='ascii') as file:
            wanted = sorted(row for row in ([float(v) for v in row.values()] for row in csv.DictReader(file))
                            if box[0] <= row[0] <= box[2] and box[1] <= row[1] <= box[3])
        region = ','.join(map(str, box))
        summary = json.loads(self.run_ok('convert', copc, '-o', self.path('part.csv'), '--keep', 'none', '--json',
                                         '--region', region))
        self.assertEqual(summary['excluded'], 518862 - len(wanted))
        with open(self.path('part.csv'), newline='', encoding='ascii') as file:
            found = sorted([float(v) for v in row.values()] for row in csv.DictReader(file))
        self.assertGreater(len(found), 1000)
        self.assertEqual(found, wanted)
        summary = json.loads(self.run_ok('build', copc, '-o', self.path('part.st'), '--json', '--region', region,
                                         '--resolution', spacing, '--crs', 'EPSG:32612'))
        self.assertEqual(summary['points'] + summary['excluded'], 518862)
        self.assertLess(summary['points'], len(wanted))

    def test_entwine_folders(self):
        """A folder of EPT is one input; Python counts its nodes."""
        folder = os.path.join(DATA, 'lidar', 'ept-lone-star')
        nodes = {}
        for name in os.listdir(os.path.join(folder, 'ept-hierarchy')):
            with open(os.path.join(folder, 'ept-hierarchy', name), encoding='utf-8') as file:
                nodes.update((node, points) for node, points in json.load(file).items() if points >= 0)
        spacing = 44 / 128
        for name in (folder, os.path.join(folder, 'ept.json')):
            info = self.info(name)
            self.assertEqual((info['format'], info['points'], info['crs']['epsg']), ('ept', sum(nodes.values()), 26912))
            self.assertEqual(info['octree'], {'spacing': spacing, 'depths': 4, 'nodes': len(nodes)})
            self.assertEqual(info['bytes'], sum(os.path.getsize(os.path.join(at, file))
                                                for at, _, files in os.walk(folder) for file in files))
        for deepest in range(4):
            wanted = sum(points for node, points in nodes.items() if int(node[0]) <= deepest)
            summary = json.loads(self.run_ok('convert', folder, '-o', self.path('r.las'), '--force', '--json',
                                             '--resolution', spacing / 2 ** deepest, '--threads', 1 + deepest % 2))
            self.assertEqual((summary['points'], summary['excluded']), (wanted, 518862 - wanted))
        box = '515375,4918350,515385.5,4918360.25'
        copc = os.path.join(DATA, 'lidar', 'lone-star.copc.laz')
        parts = [json.loads(self.run_ok('build', name, '-o', self.path(f'part{i}.st'), '--json', '--region', box,
                                        '--crs', 'EPSG:26912'))
                 for i, name in enumerate((folder, copc))]
        self.assertGreater(parts[0]['points'], 1000)
        self.assertEqual(parts[0]['points'], parts[1]['points'])
        # A damaged folder gives an error at once.
        shutil.copytree(folder, self.path('damaged'))
        os.truncate(os.path.join(self.path('damaged'), 'ept-data', '2-2-2-1.laz'), 1000)
        self.assertIn('2-2-2-1.laz', self.refused('build', self.path('damaged'), '-o', self.path('d.st')))
        with open(os.path.join(self.path('damaged'), 'ept.json'), 'w', encoding='ascii') as file:
            file.write('{' * 100000)
        self.assertIn('ept.json', self.refused('info', self.path('damaged')))

    def test_cloud_optimised_files_among_others(self):
        """From a pipe and together with LAZ; excluded points are counted over all files."""
        copc = os.path.join(DATA, 'lidar', '1.2-with-color.copc.laz')
        box = '636000,849500,637800,852000'
        with open(copc, 'rb') as pipe:
            data = pipe.read()
        summaries = [json.loads(self.run_ok('convert', name, '-o', self.path('o.las'), '--force', '--json',
                                            '--region', box, **more))
                     for name, more in ((copc, {}), ('-', {'input': data}))]
        inside, outside = summaries[0]['points'], summaries[0]['excluded']
        self.assertEqual((summaries[1]['points'], summaries[1]['excluded']), (inside, outside))
        self.assertEqual(inside + outside, 1065)
        self.assertGreater(min(inside, outside), 100)
        self.run_ok('convert', copc, '-o', self.path('plain.laz'))
        both = json.loads(self.run_ok('build', copc, self.path('plain.laz'), '-o', self.path('both.st'), '--json',
                                      '--region', box, '--crs', 'EPSG:2994'))
        self.assertEqual((both['points'], both['excluded']), (2 * inside, 2 * outside))
        self.assertIn('no octree', self.refused('convert', '-', '-o', self.path('p.las'), '--resolution', '1',
                                                 input=data))
        self.assertIn('plain.laz', self.refused('build', copc, self.path('plain.laz'), '-o', self.path('r.st'),
                                                 '--resolution', '1', '--crs', 'EPSG:2994'))
        self.assertIn('none of its 1,065 points', self.refused('convert', self.path('plain.laz'), '-o', self.path('none.csv'),
                                                               '--region', '0,0,1,1'))
        self.assertFalse(os.path.exists(self.path('none.csv')))

    def test_copies_as_copc(self):
        """The copy has the records of the scan in any order and is not much larger than the original."""
        copc = os.path.join(DATA, 'lidar', 'lone-star.copc.laz')
        self.run_ok('convert', copc, '-o', self.path('all.las'))
        self.run_ok('convert', self.path('all.las'), '-o', self.path('made.copc.laz'))
        info = self.info(self.path('made.copc.laz'))
        self.assertEqual((info['format'], info['points']), ('copc', 518862))
        self.run_ok('convert', self.path('made.copc.laz'), '-o', self.path('back.las'))
        self.assertEqual(sorted(Las(self.path('back.las')).records), sorted(Las(self.path('all.las')).records))
        self.assertLess(os.path.getsize(self.path('made.copc.laz')), 1.2 * os.path.getsize(copc))

    def test_damaged_files_give_an_error_at_once(self):
        folder = os.path.join(DATA, 'lidar', 'hostile')
        for name in sorted(os.listdir(folder)):
            with self.subTest(name=name):
                started = time.monotonic()
                result = terrace('info', os.path.join(folder, name))
                self.assertLess(time.monotonic() - started, 2)
                self.assertIn(result.returncode, (0, 1))
                if result.returncode == 1:
                    self.assertEqual(result.stderr.count(b'\n'), 1)


if __name__ == '__main__':
    unittest.main()
