#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""--memory limits the peak of a run for any layout of the input; runs that cannot fit say so first.

TERRACE=path/to/terrace memory_cli_test.py
"""

import filecmp
import json
import os
import re
import resource
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')
MIB = 1 << 20
NODATA = -9999


def run(*args, limits=()):
    """Runs terrace; returns its exit code, both outputs, and its peak resident set in bytes."""
    def confine():
        for kind, size in limits:
            resource.setrlimit(kind, (size, size))

    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = subprocess.Popen([TERRACE, *map(str, args)], stdout=out, stderr=err,
                                 preexec_fn=confine if limits else None)
        # wait4() reports this child only; getrusage() would report the largest of all children.
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        return child.returncode, out.read().decode(), err.read().decode(), usage.ru_maxrss * 1024


def rows_with_few_heights(columns, rows, bands=1):
    """Rows of int16 samples, one in 40 with data in the first band; further bands are noise."""
    empty = struct.pack('<h', NODATA) * columns
    state = 1
    for row in range(rows):
        line = empty
        if row % 40 == 0:
            heights = []
            for _ in range(columns):
                state = (state * 1103515245 + 12345) & 0x7FFFFFFF
                heights.append(500 + row // 8 + (state >> 28))
            line = struct.pack(f'<{columns}h', *heights)
        if bands > 1:
            cells = bytearray(os.urandom(2 * columns * bands))
            for byte in (0, 1):
                cells[byte::2 * bands] = line[byte::2]
            line = bytes(cells)
        yield line


class Tiff:
    """Writes GeoTIFFs that differ only in position: the blocks are made once and shared."""

    def __init__(self, columns, rows, strip_rows=None, tile=None, deflate=True, bands=1):
        self.columns, self.rows, self.tile, self.deflate, self.bands = columns, rows, tile, deflate, bands
        self.strip_rows = strip_rows or rows
        lines = rows_with_few_heights(columns, rows, bands)
        if tile:
            self.blocks = self.tiles(lines)
        else:
            self.blocks = []
            for first in range(0, rows, self.strip_rows):
                count = min(self.strip_rows, rows - first)
                self.blocks.append(self.packed(next(lines) for _ in range(count)))

    def packed(self, parts):
        if not self.deflate:
            return b''.join(parts)
        packer = zlib.compressobj(1)
        return b''.join([*(packer.compress(part) for part in parts), packer.flush()])

    def tiles(self, lines):
        width = 2 * self.tile
        blocks = []
        for first in range(0, self.rows, self.tile):
            band = [next(lines) for _ in range(min(self.tile, self.rows - first))]
            for column in range(0, 2 * self.columns, width):
                parts = [line[column:column + width].ljust(width, b'\0') for line in band]
                parts += [bytes(width)] * (self.tile - len(band))
                blocks.append(self.packed(parts))
        return blocks

    def write(self, path, x, y):
        """Writes a file with its upper left corner at x, y and cells of 30 m in UTM zone 32N."""
        places, at = [], 8
        for block in self.blocks:
            places.append(at)
            at += len(block) + len(block) % 2
        nodata = str(NODATA).encode() + b'\0'
        fields = [(256, 'I', [self.columns]), (257, 'I', [self.rows]), (258, 'H', [16] * self.bands),
                  (259, 'H', [8 if self.deflate else 1]), (262, 'H', [1]), (277, 'H', [self.bands]),
                  (339, 'H', [2] * self.bands)]
        if self.tile:
            fields += [(322, 'I', [self.tile]), (323, 'I', [self.tile]), (324, 'I', places),
                       (325, 'I', [len(block) for block in self.blocks])]
        else:
            fields += [(273, 'I', places), (278, 'I', [self.strip_rows]),
                       (279, 'I', [len(block) for block in self.blocks])]
        fields += [(33550, 'd', [30.0, 30.0, 0.0]), (33922, 'd', [0.0, 0.0, 0.0, x, y, 0.0]),
                   (34735, 'H', [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32632]),
                   (42113, 's', nodata)]
        codes = {'I': 4, 'H': 3, 'd': 12, 's': 2}
        entries, behind = b'', b''
        start = at + 2 + 12 * len(fields) + 4
        for tag, kind, values in sorted(fields):
            data = values if kind == 's' else struct.pack(f'<{len(values)}{kind}', *values)
            if len(data) <= 4:
                place = data.ljust(4, b'\0')
            else:
                place = struct.pack('<I', start + len(behind))
                behind += data + b'\0' * (len(data) % 2)
            entries += struct.pack('<HHI', tag, codes[kind], len(values)) + place
        with open(path, 'wb') as file:
            file.write(struct.pack('<2sHI', b'II', 42, at))
            for block in self.blocks:
                file.write(block + b'\0' * (len(block) % 2))
            file.write(struct.pack('<H', len(fields)) + entries + bytes(4) + behind)


class MemoryCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @classmethod
    def mosaic(cls, name, count, columns, rows, across=6, **layout):
        """Writes `count` adjacent files, each overlapping its neighbours by a cell; returns their names."""
        tiff = Tiff(columns, rows, **layout)
        names = []
        for i in range(count):
            names.append(cls.path(f'{name}-{i}.tif'))
            tiff.write(names[-1], 400000 + i % across * 30 * (columns - 1),
                       5000000 - i // across * 30 * (rows - 1))
        return names

    def within(self, memory, *args):
        """Checks that the run succeeds within `memory` MiB, as reported by itself and by the system."""
        code, out, err, peak = run(*args, '--memory', f'{memory}M', '--json')
        self.assertEqual(code, 0, err)
        summary = json.loads(out)
        self.assertLessEqual(peak, memory * MIB, f'{peak >> 20} MiB')
        if args[0] != 'info':
            self.assertLessEqual(summary['peak_rss_bytes'], memory * MIB)
            self.assertGreater(summary['peak_rss_bytes'], 1 * MIB)
        return summary

    def needed(self, memory, output, *args):
        """Checks that the run is refused before it starts; returns the MiB that it says it needs."""
        code, out, err, peak = run(*args, '-o', output, '--memory', f'{memory}M', '--json')
        self.assertEqual((code, out), (1, ''), err)
        self.assertEqual(len(err.splitlines()), 1, err)
        self.assertLessEqual(peak, memory * MIB)
        self.assertFalse(os.path.exists(output))
        needs = int(re.search(r'needs? (?:about )?(\d+)\s?Mi?', err).group(1))
        self.assertGreater(needs, memory)
        return needs


class BuildMemoryTest(MemoryCase):
    MEMORY = 200

    def build(self, name, files, memory=MEMORY):
        return self.within(memory, 'build', *files, '-o', self.path(f'{name}.store'),
                           '--threads', 2)

    def test_mosaic_of_single_strips(self):
        # 24 files of 26 MB decoded each: 620 MB
        files = self.mosaic('strip', 24, 3601, 3601)
        summary = self.build('strip', files)
        self.assertEqual(summary['points'] + summary['nodata'], (6 * 3600 + 1) * (4 * 3600 + 1))
        # More memory keeps more files open but changes no byte.
        self.build('more', files, 700)
        for name in sorted(os.listdir(self.path('strip.store'))):
            with open(self.path(f'strip.store/{name}'), 'rb') as one, \
                    open(self.path(f'more.store/{name}'), 'rb') as other:
                self.assertEqual(one.read(), other.read(), name)

    def test_mosaic_of_strips(self):
        self.build('strips', self.mosaic('strips', 12, 3601, 3601, strip_rows=64))

    def test_mosaic_of_tiles(self):
        self.build('tiles', self.mosaic('tiles', 12, 3601, 3601, tile=512))

    def test_mosaic_without_compression(self):
        self.build('plain', self.mosaic('plain', 6, 3601, 3601, deflate=False))

    def test_mosaic_of_single_strips_that_do_not_compress(self):
        # The second band is noise, so the file is as large as its decoded data.
        files = self.mosaic('noise', 6, 2400, 2400, across=3, bands=2)
        self.assertGreater(os.path.getsize(files[0]), 8 * MIB)
        self.build('noise', files)

    def test_one_large_strip(self):
        # 288 MB decoded
        self.build('large', self.mosaic('large', 1, 12000, 12000))

    def test_tiles_that_do_not_fit_are_refused_with_the_memory_needed(self):
        # 128 MB each, decoded
        files = self.mosaic('wide', 2, 8192, 8192, across=2, tile=8192)
        store = self.path('wide.store')
        needs = self.needed(self.MEMORY, store, 'build', *files, '--threads', 1)
        self.within(needs, 'build', *files, '-o', store, '--threads', 1)
        self.within(needs, 'info', files[0], '--threads', 1)


class LongFeatureTest(MemoryCase):
    def test_a_long_feature_fits_into_enough_memory(self):
        """A million positions in one feature: 17 MB of text."""
        points = self.path('long.geojson')
        with open(points, 'w') as file:
            file.write('{"type":"Feature","properties":{},"geometry":{"type":"MultiPoint","coordinates":[')
            file.writelines(f'{"," if i else ""}[{i * 7919 % 9973},{i * 4729 % 9967}.5,{i % 97}.25]'
                            for i in range(1000000))
            file.write(']}}\n')
        for args in (['info', points], ['convert', points, '-o', self.path('long.ply')]):
            with self.subTest(args=args):
                code, out, err, peak = run(*args, '--memory', '64M')
                self.assertEqual((code, out), (1, ''), err)
                self.assertIn('raise --memory', err)
                self.assertLessEqual(peak, 64 * MIB)
                self.within(256, *args)


class ManyFilesTest(MemoryCase):
    def test_thousands_of_files_of_one_point(self):
        """While the order is being determined, memory depends on points and not on blocks."""
        folder = self.path('many')
        os.mkdir(folder)
        for i in range(2000):
            with open(os.path.join(folder, f'{i}.csv'), 'w') as file:
                file.write(f'x,y,z\n{i},{i % 7},1\n')
        for order in ('auto', 'spatial'):
            self.within(256, 'build', folder, '-o', self.path(f'{order}.store'), '--order', order)


class VirtualRasterTest(MemoryCase):
    def test_a_mosaic_of_many_files(self):
        """60,000 references to one file: a VRT of 13 MB."""
        Tiff(400, 400, tile=256).write(self.path('one.tif'), 400000, 5000000)
        vrt = self.path('many.vrt')
        with open(vrt, 'w') as file:
            file.write('<VRTDataset rasterXSize="400" rasterYSize="400">'
                       '<GeoTransform>0,1,0,0,0,-1</GeoTransform><VRTRasterBand dataType="Int16">')
            for i in range(60000):
                rect = f'xOff="{i % 400}" yOff="{i // 400}" xSize="1" ySize="1"'
                file.write('<SimpleSource><SourceFilename relativeToVRT="1">one.tif</SourceFilename>'
                           f'<SourceBand>1</SourceBand><SrcRect {rect}/><DstRect {rect}/>'
                           '</SimpleSource>')
            file.write('</VRTRasterBand></VRTDataset>')
        self.within(72, 'info', vrt)


class WidePointsTest(MemoryCase):
    """Unordered points of 18 columns take several times the memory of x, y and z."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scan, cls.points = cls.path('scan.las'), cls.path('wide.xyz')
        for args in (('synth', 'surface', '--points', 3000000, '-o', scan),
                     ('convert', scan, '-o', cls.points)):
            code, _, err, _ = run(*args)
            assert code == 0, err
        os.remove(scan)

    def test_build(self):
        store = self.path('wide.store')
        build = ('build', self.points, '--threads', 2)
        needs = self.needed(64, store, *build)
        summary = self.within(needs, *build, '-o', store)
        self.assertTrue(summary['reordered'])
        self.assertEqual(summary['points'], 3000000)

    def test_convert_to_laz(self):
        made = []
        for memory in (64, 256):
            made.append(self.path(f'{memory}.laz'))
            self.within(memory, 'convert', self.points, '-o', made[-1], '--threads', 8)
        self.assertTrue(filecmp.cmp(*made, shallow=False))
        code, _, err, _ = run('convert', self.points, '-o', self.path('none.laz'), '--memory', '40M')
        self.assertEqual(code, 1, err)
        self.assertIn('raise --memory', err)
        self.assertFalse(os.path.exists(self.path('none.laz')))


class StoreMemoryTest(MemoryCase):
    """The verbs on a store whose points take more memory than allowed."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.dem, cls.store = cls.path('dem.tif'), cls.path('dem.store')
        for args in (('synth', 'dem', '--size', '1500x1500', '-o', cls.dem),
                     ('build', cls.dem, '-o', cls.store, '--facility-cost', 1)):
            code, _, err, _ = run(*args)
            assert code == 0, err

    def test_points(self):
        # 2.25 million points: 54 MB or more in memory, 50 MB as text
        self.within(40, 'points', self.store, '-o', self.path('all.xyz'))
        self.within(40, 'points', self.store, '-o', self.path('all.ply'))

    def test_convert(self):
        text = self.path('converted.xyz')
        needs = self.needed(24, text, 'convert', self.dem)
        self.within(needs, 'convert', self.dem, '-o', text)

    def test_info_of_a_raster(self):
        code, out, err, peak = run('info', self.dem, '--memory', '24M', '--json')
        self.assertEqual((code, out), (1, ''), err)
        self.assertIn('gdal_translate', err)
        self.assertLessEqual(peak, 24 * MIB)
        needs = int(re.search(r'needs (\d+)M', err).group(1))
        code, out, err, peak = run('info', self.dem, '--memory', f'{needs}M', '--json')
        self.assertEqual(code, 0, err)
        self.assertLessEqual(peak, needs * MIB)

    def test_an_octree(self):
        """Points on a surface, and as many points in space, whose octree nodes are the largest."""
        points = self.path('many.las')
        code, _, err, _ = run('synth', 'surface', '--points', 1000000, '-o', points)
        self.assertEqual(code, 0, err)
        needs = self.needed(48, self.path('tight.copc.laz'), 'convert', points)
        self.assertLess(needs, 80)
        cube = self.path('cube.las')
        code, _, err, _ = run('synth', 'uniform', '--points', 2500000, '-o', cube)
        self.assertEqual(code, 0, err)
        for points in (points, cube):
            self.within(needs, 'convert', points, '-o', self.path('tight.copc.laz'), '--threads', 2, '--force')
            self.within(256, 'convert', points, '-o', self.path('wide.copc.laz'), '--threads', 2, '--force')
            self.assertTrue(filecmp.cmp(self.path('tight.copc.laz'), self.path('wide.copc.laz'), shallow=False))

    def test_raster(self):
        self.within(64, 'raster', self.store, '-o', self.path('all.tif'), '--threads', 2)

    def test_mesh(self):
        needs = self.needed(64, self.path('all.obj'), 'mesh', self.store)
        self.within(needs, 'mesh', self.store, '-o', self.path('all.obj'))
        self.within(64, 'mesh', self.store, '--level', 1, '-o', self.path('coarse.obj'))

    def test_mesh_with_a_bound(self):
        mesh = self.path('bounded.ply')
        needs = self.needed(64, mesh, 'mesh', self.store, '--max-error', 2)
        self.within(needs, 'mesh', self.store, '--max-error', 2, '-o', mesh)

    def test_surface(self):
        scan, store = self.path('scan.las'), self.path('scan.store')
        for args in (('synth', 'surface', '--points', 200000, '-o', scan), ('build', scan, '-o', store)):
            code, _, err, _ = run(*args)
            self.assertEqual(code, 0, err)
        for criterion in ('poles', 'gabriel'):
            surface = ('surface', store, '--criterion', criterion, '--threads', 2)
            needs = self.needed(64, self.path(f'{criterion}.ply'), *surface)
            self.within(needs, *surface, '-o', self.path(f'{criterion}.ply'))

    def test_tiles(self):
        tiles = self.path('tiles')
        tile = ('tile', self.store, '--zoom', '0-9', '--threads', 2, '--vertical', 'ellipsoidal')
        needs = self.needed(32, tiles, *tile)
        self.within(needs, *tile, '-o', tiles)

    def test_a_table_of_points(self):
        points = self.path('table.xyz')
        code, _, err, _ = run('points', self.store, '--level', 1, '-o', points)
        self.assertEqual(code, 0, err)
        code, _, err, peak = run('cluster', points, '-o', self.path('none.xyz'), '--memory', '1M')
        self.assertEqual(code, 1, err)
        self.assertIn('--memory', err)
        # The output counts in addition to the table.
        octree = self.path('table.copc.laz')
        clustering = ('cluster', points, '--method', 'k-means', '-k', '5', '--threads', 2)
        needs = self.needed(64, octree, *clustering)
        self.within(needs, *clustering, '-o', octree)


class PromiseTest(MemoryCase):
    """Every verb keeps within --memory, or says what it needs before it starts."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.dem, cls.raster = cls.path('dem.tif'), cls.path('dem.store')
        cls.las, cls.cloud = cls.path('cloud.las'), cls.path('cloud.store')
        cls.places, cls.mesh = cls.path('places.csv'), cls.path('mesh.ply')
        for args in (('synth', 'dem', '--size', '2048x2048', '-o', cls.dem),
                     ('build', cls.dem, '-o', cls.raster),
                     ('synth', 'clusters', '--points', 1000000, '-o', cls.las),
                     ('build', cls.las, '-o', cls.cloud),
                     ('mesh', cls.raster, '--level', 1, '-o', cls.mesh)):
            code, _, err, _ = run(*args)
            assert code == 0, err
        with open(cls.places, 'w') as file:
            file.write('x,y\n')
            file.writelines(f'{400000 + i * 7919 % 61440},{5138560 + i * 4729 % 61440}\n'
                            for i in range(200000))

    def commands(self):
        out = lambda name: ['-o', self.path(name)]
        line = '401000,5150000,460000,5190000'
        small = ['--size', '640x480']
        return [['info', self.raster], ['info', self.dem], ['info', self.las],
                ['verify', self.raster], ['verify', self.cloud],
                ['points', self.raster, '--level', 1, *out('out.xyz')],
                ['points', self.cloud, *out('out.las')],
                ['points', self.cloud, '--near', '0,0', '-k', 9, *out('out.csv')],
                ['mesh', self.raster, '--level', 2, *out('out.ply')],
                ['mesh', self.raster, '--max-error', 20, *out('out.ply')],
                ['surface', self.cloud, '--level', 'top', *out('out.ply')],
                ['tile', self.raster, '--zoom', '0-8', '--vertical', 'ellipsoidal', *out('out')],
                ['sample', self.raster, '--points', self.places, *out('out.csv')],
                ['sample', self.raster, '--points', self.places, '--method', 'natural', *out('out.csv')],
                ['sample', self.cloud, '--points', self.places, *out('out.csv')],
                ['raster', self.raster, '--cell', 60, *out('out.tif')],
                ['raster', self.raster, '--cell', 0.0003, *out('out.tif')],
                ['raster', self.cloud, *out('out.tif')],
                ['profile', self.raster, '--line', line, *out('out.csv')],
                ['profile', self.cloud, '--line', '0,0,1,1', *out('out.csv')],
                ['contour', self.raster, '--interval', 500, *out('out.geojson')],
                ['contour', self.cloud, '--interval', 0.5, '--own-crs', *out('out.geojson')],
                ['cluster', self.las, '--method', 'k-means', '-k', 5, *out('out.csv')],
                ['match', self.las, *out('out.csv')],
                ['render', self.raster, *out('out.png')],
                ['render', self.raster, '--level', 0, *out('out.png')],
                ['render', self.raster, *small, '--level', 1, *out('out.png')],
                ['render', self.cloud, *small, '--level', 'top', *out('out.png')],
                ['render', self.dem, *out('out.png')], ['render', self.las, *small, *out('out.png')],
                ['render', self.mesh, *small, *out('out.png')],
                ['publish', self.raster, *out('out')],
                ['synth', 'dem', '--size', '2048x2048', *out('out.tif')],
                ['synth', 'dem', '--size', '4000000x4000000', *out('out.tif')],
                ['synth', 'uniform', '--points', 1000000, *out('out.las')],
                ['convert', self.las, *out('out.xyz')], ['convert', self.dem, *out('out.laz')],
                ['build', self.las, *out('out')], ['build', self.dem, *out('out')]]

    def test_every_verb_keeps_the_limit_or_refuses(self):
        for command in self.commands():
            for memory in (1, 8, 32, 64, 128):
                with self.subTest(command=command, memory=memory):
                    code, _, err, peak = run(*command, '--memory', f'{memory}M', '--threads', 2, '-q')
                    made = [name for name in os.listdir(self.folder.name) if name.startswith(('out', '.out'))]
                    if code == 0:
                        self.assertLessEqual(peak, memory * MIB * 1.05, f'{peak >> 20} MiB')
                    else:
                        self.assertEqual((code, made), (1, []), err)
                        self.assertEqual(len(err.splitlines()), 1, err)
                        self.assertRegex(err, r'--memory|memory limit|\d ?Mi?B? ')
                        self.assertLessEqual(peak, max(memory, 24) * MIB * 1.05, err)
                    for name in made:
                        path = self.path(name)
                        (shutil.rmtree if os.path.isdir(path) else os.remove)(path)


class MachineMemoryTest(MemoryCase):
    def test_a_limit_of_the_process_is_the_available_memory(self):
        points = self.path('points.csv')
        with open(points, 'w') as file:
            file.write('x,y,z\n')
            for i in range(300000):
                file.write(f'{i % 600},{i // 600},0\n')
        args = ('match', points, '--method', 'exact', '-o', self.path('pairs.csv'))
        # An exact matching needs 240 MB; half of the available memory is 200.
        for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA):
            code, _, err, _ = run(*args, limits=[(kind, 400 * MIB)])
            self.assertEqual(code, 1, err)
            self.assertIn('takes about', err)
            self.assertIn('--memory is 200 MiB', err)

    def test_matching_takes_no_more_than_it_says(self):
        points, pairs = self.path('points.csv'), self.path('pairs.csv')
        with open(points, 'w') as file:
            file.write('x,y,z\n')
            for i in range(20000):
                file.write(f'{i % 150},{i // 150},{i % 7}\n')
        args = ('match', points, '-o', pairs, '--threads', 1, '--memory')
        code, _, err, _ = run(*args, '40M')
        self.assertEqual(code, 1, err)
        said = float(re.search(r'takes about ([\d.]+) MiB', err).group(1)) + 1  # it is rounded
        code, _, err, peak = run(*args, int(said * MIB))
        self.assertEqual(code, 0, err)
        self.assertLessEqual(peak, said * MIB)
        # Nor does a picture of it.
        args = ('render', pairs, '--points', points, '-o', self.path('pairs.png'), '--size', '100x100', '--memory')
        code, _, err, _ = run(*args, '34M')
        self.assertEqual(code, 1, err)
        said = int(re.search(r'needs (\d+) MiB', err).group(1))
        code, _, err, peak = run(*args, f'{said}M')
        self.assertEqual(code, 0, err)
        self.assertLessEqual(peak, said * MIB)

    def test_a_picture_of_a_dendrogram_takes_no_more_than_it_says(self):
        tree = self.path('tree.csv')
        points = 200_000
        with open(tree, 'w') as file:
            file.write('a,b,height,size\n0,1,1,2\n')
            for i in range(2, points):
                file.write(f'{i},{points + i - 2},{i},{i + 1}\n')
        args = ('render', tree, '-o', self.path('tree.png'), '--force', '--size', '100x100', '--memory')
        low, high = 34, 200
        code, _, err, _ = run(*args, f'{low}M')
        self.assertEqual(code, 1, err)
        while high - low > 1:  # it reads only as far as the memory goes
            middle = (low + high) // 2
            code, _, err, peak = run(*args, f'{middle}M')
            low, high = (low, middle) if code == 0 else (middle, high)
        code, _, err, peak = run(*args, f'{high}M')
        self.assertEqual(code, 0, err)
        self.assertLessEqual(peak, high * MIB)


if __name__ == '__main__':
    unittest.main()
