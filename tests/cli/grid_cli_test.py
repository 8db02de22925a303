#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests info and build on elevation grids of every format.

TERRACE=path/to/terrace grid_cli_test.py
"""

import array
import gzip
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')
# WGS 84 / UTM zone 32N as written by ESRI's programs.
PRJ = ('PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",'
       '6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],'
       'PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],'
       'PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",9.0],'
       'PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]')


def height(column, row):
    return (37 * column + 11 * row * row) % 500


def png(path, columns, rows, bits, colour, lines):
    def chunk(kind, body):
        return struct.pack('>I', len(body)) + kind + body + struct.pack('>I', zlib.crc32(kind + body))
    with open(path, 'wb') as file:
        file.write(b'\x89PNG\r\n\x1a\n' +
                   chunk(b'IHDR', struct.pack('>IIBBBBB', columns, rows, bits, colour, 0, 0, 0)) +
                   chunk(b'IDAT', zlib.compress(b''.join(b'\0' + line for line in lines))) +
                   chunk(b'IEND', b''))


class GridTest(unittest.TestCase):
    columns, rows = 40, 30

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-grids-')
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def terrace(self, *args, **kwargs):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, timeout=120, **kwargs)

    def json_of(self, *args, **kwargs):
        result = self.terrace(*args, '--json', **kwargs)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def heights(self, kind='h'):
        return array.array(kind, [height(c, r) for r in range(self.rows) for c in range(self.columns)])

    def ascii_grid(self, x=500000, y=5200000, cell=25):
        with open(self.path('a.asc'), 'w') as file:
            file.write(f'ncols {self.columns}\nnrows {self.rows}\nxllcorner {x}\nyllcorner {y}\n'
                       f'cellsize {cell}\nnodata_value 0\n')
            file.write(' '.join(map(str, self.heights())) + '\n')
        return self.path('a.asc')

    def check(self, path, form, *options, world=True, nodata=True):
        """Checks info and build on a file with the expected heights."""
        info = self.json_of('info', path, *options)
        self.assertEqual(info['format'], form)
        values = list(self.heights())
        self.assertEqual(info['points'], sum(v != 0 for v in values) if nodata else len(values))
        self.assertAlmostEqual(info['height']['max'], max(values), 9)
        self.assertEqual((info['columns'], info['rows']), (self.columns, self.rows))
        if world:
            for found, due in zip(info['transform'], [25, 0, 500012.5, 0, -25, 5200737.5]):
                self.assertAlmostEqual(found, due, 6)
        store = path + '.terrace'
        built = self.json_of('build', path, '-o', store, *options)
        self.assertEqual(built['points'], info['points'])
        stored = self.json_of('info', store)
        self.assertEqual(stored['height']['max'], info['height']['max'])
        return info, stored

    def test_ascii_grids(self):
        path = self.ascii_grid()
        with open(self.path('a.prj'), 'w') as file:
            file.write(PRJ)
        info, stored = self.check(path, 'ascii-grid')
        self.assertEqual(info['crs']['epsg'], 32632)
        self.assertEqual(stored['crs']['epsg'], 32632)

    def test_ascii_grids_from_pipes_give_the_same_store(self):
        # In degrees, so cells are not square on the ground, which determines the order of the
        # points.
        path = self.ascii_grid(8, 60, 0.01)
        self.json_of('build', path, '-o', self.path('file.terrace'), '--crs', 'EPSG:4326')
        with open(path, 'rb') as file:
            text = file.read()
        self.json_of('build', '-', '-o', self.path('pipe.terrace'), '--crs', 'EPSG:4326', input=text)
        for name in sorted(os.listdir(self.path('file.terrace'))):
            with open(self.path(f'file.terrace/{name}'), 'rb') as a, \
                    open(self.path(f'pipe.terrace/{name}'), 'rb') as b:
                if name != 'manifest.json':
                    self.assertEqual(a.read(), b.read(), name)
        self.assertEqual(self.json_of('info', '-', input=text)['format'], 'ascii-grid')

    def test_binary_grids(self):
        for name, kind, header in (
                ('a.flt', 'f', 'xllcorner 500000\nyllcorner 5200000\ncellsize 25\nNODATA_value 0\n'
                               f'byteorder {"LSBFIRST" if sys.byteorder == "little" else "MSBFIRST"}\n'),
                ('b.bil', 'h', 'nbits 16\npixeltype signedint\nulxmap 500012.5\nulymap 5200737.5\n'
                               'xdim 25\nydim 25\nnodata 0\n')):
            with open(self.path(name), 'wb') as file:
                file.write(self.heights(kind).tobytes())
            with open(os.path.splitext(self.path(name))[0] + '.hdr', 'w') as file:
                file.write(f'ncols {self.columns}\nnrows {self.rows}\n{header}')
            self.check(self.path(name), 'binary-grid')

    def test_height_maps(self):
        samples = self.heights('H')
        if sys.byteorder == 'little':
            samples.byteswap()
        lines = [samples[r * self.columns:(r + 1) * self.columns].tobytes() for r in range(self.rows)]
        png(self.path('a.png'), self.columns, self.rows, 16, 0, lines)
        self.check(self.path('a.png'), 'png', world=False, nodata=False)
        with open(self.path('a.pgw'), 'w') as file:
            file.write('25\n0\n0\n-25\n500012.5\n5200737.5\n')
        shutil.rmtree(self.path('a.png.terrace'))
        self.check(self.path('a.png'), 'png', nodata=False)

    def test_gdal_aux_xml_files_are_read(self):
        samples = self.heights('H')
        if sys.byteorder == 'little':
            samples.byteswap()
        half = self.columns // 2

        def side(name, first, zone):
            lines = [samples[r * self.columns + first:r * self.columns + first + half].tobytes()
                     for r in range(self.rows)]
            png(self.path(name), half, self.rows, 16, 0, lines)
            wkt = PRJ.replace('Zone_32N', f'Zone_{zone}N').replace('",9.0', f'",{zone * 6 - 183}.0')
            with open(self.path(name + '.aux.xml'), 'w') as file:
                file.write(f'<PAMDataset><SRS>{wkt}</SRS><GeoTransform>{500000 + 25 * first},25,0,5200750,0,-25'
                           '</GeoTransform><PAMRasterBand band="1"><NoDataValue>0</NoDataValue><Scale>0.1</Scale>'
                           '<Offset>5</Offset><UnitType>m</UnitType></PAMRasterBand></PAMDataset>')
            return self.path(name)
        left, right = side('left.png', 0, 32), side('right.png', half, 32)
        store = self.path('both.terrace')
        built = self.json_of('build', left, right, '-o', store)
        values = list(self.heights())
        self.assertEqual(built['points'], sum(v != 0 for v in values))
        info = self.json_of('info', store)
        self.assertEqual(info['crs']['epsg'], 32632)
        self.assertAlmostEqual(info['height']['max'], max(values) / 10 + 5, 6)
        for found, due in zip(info['transform'], [25, 0, 500012.5, 0, -25, 5200737.5]):
            self.assertAlmostEqual(found, due, 6)
        self.assertEqual(info['channels'][2]['unit'], 'metre')
        # Both have their own CRS.
        side('right.png', half, 33)
        result = self.terrace('build', left, right, '-o', self.path('none.terrace'))
        self.assertEqual(result.returncode, 1)
        self.assertIn(b'33N', result.stderr)
        # An unreadable file is reported.
        with open(left + '.aux.xml', 'w') as file:
            file.write('<PAMDataset><SRS>')
        told = self.terrace('info', left)
        self.assertEqual(told.returncode, 0)
        self.assertIn(b'left.png.aux.xml', told.stdout + told.stderr)

    def test_an_empty_prj_gives_no_crs(self):
        path = self.ascii_grid()
        for content in (b'', b' \r\n', b'\xef\xbb\xbf'):
            with open(self.path('a.prj'), 'wb') as file:
                file.write(content)
            result = self.terrace('build', path, '-o', self.path('a.terrace'), '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(b'a.prj is empty', result.stderr)
        self.assertIsNone(self.json_of('info', self.path('a.terrace'))['crs'])
        with open(self.path('a.prj'), 'w') as file:
            file.write('not a CRS')
        self.assertEqual(self.terrace('build', path, '-o', self.path('b.terrace')).returncode, 1)

    def test_indistinguishable_cells_are_an_error(self):
        for x, cell in ((0, 1e-300), (500000, 1e-12), (0, 1e200)):
            path = self.ascii_grid(x, 0, cell)
            result = self.terrace('build', path, '-o', self.path('a.terrace'))
            self.assertEqual(result.returncode, 1)
            self.assertIn(b'a.asc: the places of its cells', result.stderr)
            self.assertNotIn(b'tmp', result.stderr.replace(self.folder.encode(), b''))
            self.assertEqual(sorted(os.listdir(self.folder)), ['a.asc'])

    def test_rendering_tiny_cells_terminates(self):
        for cell in (1e-160, 1e-155, 1e-300):
            path = self.ascii_grid(0, 0, cell)
            result = self.terrace('render', path, '-o', self.path('tiny.png'), '--size', '40x30', '--force')
            self.assertIn(result.returncode, (0, 1), result.stderr)

    def test_undeclared_voids_are_noted(self):
        with open(self.path('a.asc'), 'w') as file:
            file.write('ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 -3.4028235e+38\n3 -3.4028235e+38\n')
        for verb, name in (('build', 'a.terrace'), ('convert', 'a.csv')):
            result = self.terrace(verb, self.path('a.asc'), '-o', self.path(name))
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn(b'2 cells have heights beyond 1e30', result.stderr)
            self.assertIn(b'NODATA_value -3.4028235e+38', result.stderr)
        self.assertIn('2 cells', self.json_of('info', self.path('a.asc'))['comments'][-1])
        result = self.terrace('convert', self.path('a.csv'), '-o', self.path('b.csv'))
        self.assertIn(b"--where 'z > -1e30'", result.stderr)
        self.assertEqual(self.json_of('convert', self.path('a.csv'), '-o', self.path('c.csv'), '--where',
                                      'z > -1e30')['points'], 2)
        # Common nodata values far from all other heights are noted; -9999 among similar depths is
        # not.
        for void, others, noted in (('-9999', '1 2', True), ('-32768', '1 2', True), ('-99999', '1 2', True),
                                    ('-9999', '-9998 -9600', False)):
            with open(self.path('v.asc'), 'w') as file:
                file.write(f'ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n{others}\n{void} 3\n')
            for verb, name in (('build', 'v.terrace'), ('convert', 'v.ply'), ('cluster', 'v.csv'), ('match', 'm.csv'),
                               ('render', 'v.png')):
                result = self.terrace(verb, self.path('v.asc'), '-o', self.path(void + others[:2] + name))
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(f'1 cell has the height {void}'.encode() in result.stderr, noted, (verb, void))
        # The remedy in the note removes them.
        with open(self.path('a.asc')) as file:
            text = file.read()
        with open(self.path('a.asc'), 'w') as file:
            file.write('NODATA_value -3.4028235e+38\n' + text)
        result = self.terrace('build', self.path('a.asc'), '-o', self.path('b.terrace'))
        self.assertNotIn(b'1e30', result.stderr)

    def same_store(self, one, other):
        for name in sorted(os.listdir(self.path(one))):
            with open(self.path(f'{one}/{name}'), 'rb') as a, open(self.path(f'{other}/{name}'), 'rb') as b:
                if name != 'manifest.json':
                    self.assertEqual(a.read(), b.read(), name)

    def test_cell_gives_the_cell_size_of_height_maps_without_one(self):
        samples = self.heights('H')
        if sys.byteorder == 'little':
            samples.byteswap()
        lines = [samples[r * self.columns:(r + 1) * self.columns].tobytes() for r in range(self.rows)]
        png(self.path('a.png'), self.columns, self.rows, 16, 0, lines)
        summary = self.json_of('build', self.path('a.png'), '-o', self.path('a.terrace'), '--cell', 25)
        self.assertEqual(summary['points'], self.columns * self.rows)
        self.assertEqual(self.json_of('info', self.path('a.terrace'))['transform'], [25, 0, 0, 0, -25, 0])
        self.json_of('convert', self.path('a.png'), '-o', self.path('a.csv'), '--cell', 0.5)
        with open(self.path('a.csv')) as file:
            rows = [tuple(map(float, line.split(',')[:2])) for line in file.readlines()[1:]]
        self.assertEqual((min(rows)[0], max(rows)[0]), (0, 0.5 * (self.columns - 1)))
        self.assertEqual(min(y for _, y in rows), -0.5 * (self.rows - 1))
        # A pipe has no world file, and its content is copied to a temporary file.
        with open(self.path('a.png'), 'rb') as file:
            result = self.terrace('build', '-', '-o', self.path('pipe.terrace'), '--cell', 25, input=file.read())
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(b'were copied to a temporary file', result.stderr)
        self.same_store('a.terrace', 'pipe.terrace')
        with open(self.path('a.pgw'), 'w') as file:
            file.write('25\n0\n0\n-25\n500012.5\n5200737.5\n')
        with open(self.path('a.obj'), 'w') as file:
            file.write('v 1 2 3\nv 2 3 4\n')
        for name in ('a.png', 'a.csv', 'a.obj'):
            result = self.terrace('build', self.path(name), '-o', self.path('no.terrace'), '--cell', 25)
            self.assertEqual(result.returncode, 1)
            self.assertIn(b'leave --cell out', result.stderr)

    def test_gzip_and_pipes_give_the_same_store(self):
        self.json_of('build', self.ascii_grid(), '-o', self.path('plain.terrace'))
        self.json_of('raster', self.path('plain.terrace'), '-o', self.path('a.tif'), '--cell', 25)
        for name in ('a.asc', 'a.tif'):
            with open(self.path(name), 'rb') as file:
                content = file.read()
            with gzip.open(self.path(name + '.gz'), 'wb') as file:
                file.write(content)
            self.json_of('build', self.path(name), '-o', self.path('file.terrace'), '--force')
            self.json_of('build', self.path(name + '.gz'), '-o', self.path('gzip.terrace'), '--force')
            self.same_store('file.terrace', 'gzip.terrace')
            for given in (content, gzip.compress(content)):
                self.json_of('build', '-', '-o', self.path('pipe.terrace'), '--force', input=given)
                self.same_store('file.terrace', 'pipe.terrace')
        # Errors about truncated input name the user's input and not its copy.
        result = self.terrace('build', '-', '-o', self.path('no.terrace'), input=content[:len(content) // 2])
        self.assertEqual(result.returncode, 1)
        self.assertTrue(result.stderr.startswith(b'terrace: standard input: '), result.stderr)
        self.assertFalse(os.path.exists(self.path('no.terrace')))
        result = self.terrace('build', '-', '-o', self.path('no.terrace'), input=b'\x1f\x8b' + b'z' * 100)
        self.assertEqual(result.returncode, 1)
        self.assertIn(b'damaged gzip', result.stderr)
        # SRTM tiles are recognised by name.
        result = self.terrace('build', '-', '-o', self.path('no.terrace'), '--input-format', 'hgt',
                              input=bytes(2 * 1201 * 1201))
        self.assertEqual(result.returncode, 1)
        self.assertIn(b'hgt cannot be read from a pipe', result.stderr)

    def test_colours_that_encode_heights(self):
        for name, number in (('mapbox', lambda z: (z + 10000) * 10),
                             ('terrarium', lambda z: (z + 32768) * 256)):
            path = self.path(name + '.png')
            lines = [b''.join(number(height(c, r)).to_bytes(3, 'big') for c in range(self.columns))
                     for r in range(self.rows)]
            png(path, self.columns, self.rows, 8, 2, lines)
            result = self.terrace('info', path)
            self.assertEqual(result.returncode, 1)
            self.assertEqual(result.stderr.count(b'\n'), 1)
            self.assertIn(b'--rgb', result.stderr)
            self.check(path, 'png', '--rgb', name, world=False, nodata=False)
            out = self.path(name + '.xyz')
            self.json_of('convert', path, '-o', out, '--rgb', name)
            with open(out) as file:
                points = {tuple(map(float, line.split()[:2])): float(line.split()[2]) for line in file}
            for c in range(self.columns):
                for r in range(self.rows):
                    self.assertAlmostEqual(points[c, -r], height(c, r), 9)
            self.json_of('render', path, '-o', self.path(name + '-picture.png'), '--rgb', name,
                         '--size', '64x64')
        grid = self.ascii_grid()
        for args in (('info', grid, '--rgb', 'mapbox'),
                     ('build', grid, '-o', self.path('x.terrace'), '--rgb', 'mapbox')):
            result = self.terrace(*args)
            self.assertEqual(result.returncode, 1)
            self.assertIn(b'--rgb', result.stderr)
        self.assertEqual(self.terrace('info', path, '--rgb', 'cmyk').returncode, 2)
        store = path + '.terrace'
        for args in (('info', store), ('render', store, '-o', self.path('b.png'))):
            self.assertEqual(self.terrace(*args, '--rgb', 'mapbox').returncode, 2)

    def test_tiles_of_srtm_in_archives(self):
        side = 121
        tiles = []
        for latitude in (46, 47):
            # Rows from the north; neighbours share a row.
            rows = range((47 - latitude) * (side - 1), (47 - latitude) * (side - 1) + side)
            samples = array.array('h', [height(c, r) for r in rows for c in range(side)])
            samples[5] = -32768
            if sys.byteorder == 'little':
                samples.byteswap()
            tiles.append(self.path(f'N{latitude}E008.SRTMGL1.hgt.zip'))
            with zipfile.ZipFile(tiles[-1], 'w', zipfile.ZIP_DEFLATED) as archive:
                archive.writestr(f'N{latitude}E008.hgt', samples.tobytes())
        info = self.json_of('info', tiles[0])
        self.assertEqual(info['format'], 'hgt')
        self.assertEqual(info['crs']['epsg'], 4326)
        self.assertEqual(info['vertical'], 'orthometric')
        self.assertEqual(info['nodata'], 1)
        built = self.json_of('build', *tiles, '-o', self.path('both.terrace'))
        # Where the shared row has no sample in one tile, the other tile's sample is used.
        self.assertEqual((built['points'], built['nodata']), (side * (2 * side - 1) - 1, 1))
        stored = self.json_of('info', self.path('both.terrace'))
        self.assertEqual((stored['columns'], stored['rows']), (side, 2 * side - 1))
        self.assertEqual(stored['bounds']['min'][:2], [8.0, 46.0])
        self.assertEqual([round(v, 9) for v in stored['bounds']['max'][:2]], [9.0, 48.0])

    def test_a_region_includes_the_row_at_its_edge(self):
        side = 1201
        samples = array.array('h', [1]) * (side * side)
        with open(self.path('N46E008.hgt'), 'wb') as file:
            file.write(samples.tobytes())
        for box in ('8.1,46.1,8.2,46.2', '8.25,46.35,8.35,46.45', '8.7,46.3,8.8,46.4'):
            built = self.json_of('build', self.path('N46E008.hgt'), '--region', box, '-o', self.path('part.terrace'),
                                 '--force')
            self.assertEqual(built['points'], 121 * 121, box)

    def test_grids_on_both_sides_of_the_antimeridian_are_joined(self):
        for name, west in (('west', 178), ('east', -180)):
            with open(self.path(name + '.asc'), 'w') as file:
                file.write(f'ncols 4\nnrows 2\nxllcorner {west}\nyllcorner -17\ncellsize 0.5\n1 2 3 4 5 6 7 8\n')
            with open(self.path(name + '.prj'), 'w') as file:
                file.write('GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137,298.257223563]],'
                           'PRIMEM["Greenwich",0],UNIT["Degree",0.017453292519943295]]')
        self.json_of('build', self.path('west.asc'), self.path('east.asc'), '-o', self.path('fiji.terrace'))
        info = self.json_of('info', self.path('fiji.terrace'))
        self.assertEqual((info['columns'], info['points']), (8, 16))
        self.assertEqual([info['bounds'][end][0] for end in ('min', 'max')], [178.25, 181.75])

    def test_virtual_rasters_of_other_formats(self):
        side = 121
        tile = array.array('h', [height(c, r) for r in range(side) for c in range(side)])
        if sys.byteorder == 'little':
            tile.byteswap()
        with open(self.path('N46E008.hgt'), 'wb') as file:
            file.write(tile.tobytes())
        with open(self.path('real.asc'), 'w') as file:
            file.write('ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n0.5 1 2 3 4 5\n')
        with open(self.path('whole.asc'), 'w') as file:
            file.write('ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\nnodata_value -9\n-7 16777215\n-9 4\n')
        for file, columns, rows, kind in (('N46E008.hgt', side, side, 'Int16'), ('real.asc', 3, 2, 'Float32'),
                                          ('whole.asc', 2, 2, 'Int32')):
            with open(self.path('a.vrt'), 'w') as vrt:
                vrt.write(f'<VRTDataset rasterXSize="{columns}" rasterYSize="{rows}"><GeoTransform>0,1,0,0,0,-1'
                          f'</GeoTransform><VRTRasterBand dataType="{kind}" band="1"><SimpleSource>'
                          f'<SourceFilename relativeToVRT="1">{file}</SourceFilename></SimpleSource>'
                          '</VRTRasterBand></VRTDataset>')
            one, other = self.json_of('info', self.path(file)), self.json_of('info', self.path('a.vrt'))
            for key in ('points', 'height', 'columns', 'rows'):
                self.assertEqual(one[key], other[key], file)

    def test_dems_of_the_usgs(self):
        def real(value):
            return f'{value:24.15E}'.replace('E', 'D')
        record = bytearray(b' ' * 1024)

        def put(at, text):
            record[at:at + len(text)] = text.encode()
        west, south = 500000, 5200000
        north, east = south + 25 * (self.rows - 1), west + 25 * (self.columns - 1)
        put(144, f'{1:6}{1:6}{1:6}{32:6}')
        put(528, f'{2:6}{2:6}{4:6}')
        for i, value in enumerate((west, south, west, north, east, north, east, south)):
            put(546 + 24 * i, real(value))
        put(816, f'{25:12.6E}{25:12.6E}{1:12.6E}')
        put(852, f'{1:6}{self.columns:6}')
        put(888, ' 1 3')
        text = bytes(record)
        for c in range(self.columns):
            profile = f'{1:6}{c + 1:6}{self.rows:6}{1:6}' + ''.join(map(real, (west + 25 * c, south, 0, 0, 999)))
            profile += ''.join(f'{height(c, r) or -32767:6}' for r in reversed(range(self.rows)))
            text += profile.ljust(1024).encode()
        with open(self.path('a.dem'), 'wb') as file:
            file.write(text)
        info = self.json_of('info', self.path('a.dem'))
        self.assertEqual((info['format'], info['crs']['epsg']), ('usgs-dem', 32632))
        self.assertEqual(info['transform'], [25, 0, west, 0, -25, north])
        self.assertEqual(info['points'], sum(v != 0 for v in self.heights()))
        self.json_of('build', self.path('a.dem'), '-o', self.path('a.terrace'))
        self.json_of('build', '-', '-o', self.path('b.terrace'), input=text)

    def test_truncated_grids_give_a_one_line_error(self):
        cases = {'a.asc': b'ncols 1000000000\nnrows 1000000000\ncellsize 1\n1 2 3\n',
                 'b.asc': b'ncols 3\nnrows 3\ncellsize 1\n1 2 3\n',
                 'N46E008.hgt': bytes(1000), 'N46E008.hgt.gz': b'\x1f\x8b\x08\0' + bytes(30),
                 'c.flt': bytes(100), 'd.png': b'\x89PNG\r\n\x1a\n' + bytes(40)}
        for name, content in cases.items():
            with open(self.path(name), 'wb') as file:
                file.write(content)
            for args in (('info', self.path(name)),
                         ('build', self.path(name), '-o', self.path('x.terrace'))):
                result = self.terrace(*args)
                self.assertEqual(result.returncode, 1, name)
                self.assertEqual(result.stderr.count(b'\n'), 1, result.stderr)
                self.assertIn(name.encode(), result.stderr)


if __name__ == '__main__':
    unittest.main()
