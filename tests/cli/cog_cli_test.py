#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""raster writes Cloud Optimized GeoTIFFs (OGC 21-026, and the rules of GDAL's
validate_cloud_optimized_geotiff.py) whose overviews are means of the cells that have data.

TERRACE=path/to/terrace cog_cli_test.py
"""

import json
import os
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')
STRUCTURE = b'GDAL_STRUCTURAL_METADATA_SIZE='
TYPES = {2: ('c', 1), 3: ('H', 2), 4: ('I', 4), 12: ('d', 8), 16: ('Q', 8)}
SUBFILE, WIDTH, HEIGHT, COMPRESSION, PREDICTOR, SIDE, OFFSETS, SIZES, NODATA = (
    254, 256, 257, 259, 317, 322, 324, 325, 42113)


class Cog:
    """Reads a little-endian TIFF and checks its layout."""

    def __init__(self, path):
        with open(path, 'rb') as file:
            self.data = file.read()
        self.size = len(self.data)
        mark, magic = struct.unpack_from('<2sH', self.data)
        assert mark == b'II' and magic in (42, 43), 'no little-endian TIFF'
        self.big = magic == 43
        head = 16 if self.big else 8
        self.leaders = False
        if self.data[head:head + len(STRUCTURE)] == STRUCTURE:
            begin = head + len(STRUCTURE) + len('000000 bytes\n')
            size = int(self.data[head + len(STRUCTURE):][:6])
            self.structure = self.data[begin:begin + size].decode()
            assert self.structure.endswith('KNOWN_INCOMPATIBLE_EDITION=NO\n '), self.structure
            assert 'LAYOUT=IFDS_BEFORE_DATA\n' in self.structure
            self.leaders = 'BLOCK_LEADER=SIZE_AS_UINT4\n' in self.structure
            head = begin + size
        at, = struct.unpack_from('<Q' if self.big else '<I', self.data, 8 if self.big else 4)
        assert at == head + head % 2, 'the first directory is not at the beginning'
        self.levels, behind = [], at
        while at:
            assert at == behind, 'a directory does not follow the previous one'
            tags, at, behind = self.directory(at)
            self.levels.append(tags)
        self.check(behind)

    def directory(self, at):
        entries, = struct.unpack_from('<Q' if self.big else '<H', self.data, at)
        form, step, first = ('<HHQ8s', 20, 8) if self.big else ('<HHI4s', 12, 2)
        tags, behind, last = {}, at + first + entries * step + (8 if self.big else 4), -1
        for i in range(entries):
            tag, kind, count, value = struct.unpack_from(form, self.data, at + first + i * step)
            assert tag > last, 'tags are not in order'
            last = tag
            letter, width = TYPES[kind]
            if count * width > len(value):
                place, = struct.unpack('<Q' if self.big else '<I', value)
                value = self.data[place:place + count * width]
                behind = max(behind, place + count * width + count * width % 2)
            tags[tag] = value[:count - 1].decode() if kind == 2 else list(
                struct.unpack_from(f'<{count}{letter}', value))
        after, = struct.unpack_from('<Q' if self.big else '<I', self.data, at + first + entries * step)
        return tags, after, behind

    def check(self, behind):
        levels = self.levels
        assert SUBFILE not in levels[0]
        for finer, coarser in zip(levels, levels[1:]):
            assert coarser[SUBFILE] == [1]
            for side in (WIDTH, HEIGHT):
                assert coarser[side][0] == (finer[side][0] + 1) // 2
        assert max(levels[-1][WIDTH][0], levels[-1][HEIGHT][0]) <= 512
        end = behind
        for tags in reversed(levels):  # the smallest first, each by rows
            across, down = (-(-tags[side][0] // tags[SIDE][0]) for side in (WIDTH, HEIGHT))
            assert len(tags[OFFSETS]) == len(tags[SIZES]) == across * down
            for offset, size in zip(tags[OFFSETS], tags[SIZES]):
                if size == 0:
                    assert offset == 0
                    continue
                if self.leaders:
                    assert struct.unpack_from('<I', self.data, offset - 4) == (size,)
                    assert self.data[offset + size:][:4] == self.data[offset + size - 4:][:4]
                around = 4 if self.leaders else 0
                assert offset == end + around, 'tiles are not contiguous'
                end = offset + size + around
        assert end == self.size, 'there are bytes after the tiles'

    def cells(self, number):
        """The rows of a level: floats or bytes, None where there is no data."""
        tags = self.levels[number]
        width, height, side = tags[WIDTH][0], tags[HEIGHT][0], tags[SIDE][0]
        floats = tags[PREDICTOR] == [3]
        assert tags[COMPRESSION] == [8]
        nodata = float(tags[NODATA])
        across = -(-width // side)
        rows = [[None] * width for _ in range(height)]
        for i, (offset, size) in enumerate(zip(tags[OFFSETS], tags[SIZES])):
            if size == 0:
                continue
            tile = zlib.decompress(self.data[offset:offset + size])
            row_bytes = side * (4 if floats else 1)
            for r in range(min(side, height - i // across * side)):
                row, last = bytearray(tile[r * row_bytes:(r + 1) * row_bytes]), 0
                for k, difference in enumerate(row):
                    last = row[k] = (last + difference) & 255
                values = row
                if floats:
                    values = struct.unpack(f'>{side}f', bytes(row[b * side + k] for k in range(side) for b in range(4)))
                left = i % across * side
                rows[i // across * side + r][left:left + side] = [
                    None if v == nodata else v for v in values][:width - left]
        return rows


def single(value):
    return struct.unpack('f', struct.pack('f', value))[0]


class CogTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.run_ok('synth', 'dem', '-o', cls.path('dem.tif'), '--size', '1231x690', '--type', 'float32', '-q')
        cls.run_ok('build', cls.path('dem.tif'), '-o', cls.path('dem.st'), '--crs', 'EPSG:32632', '-q')
        corners = json.loads(cls.run_ok('info', cls.path('dem.st'), '--json'))['bounds']
        x, y, width = corners['min'][0], corners['min'][1], corners['max'][0] - corners['min'][0]
        # The lower left part has a hole, so some cells and tiles have no data.
        ring = [[x, y], [x + 0.45 * width, y], [x, y + 0.9 * width], [x, y]]
        hole = [[x + 0.1 * width + a * 3000, y + 0.1 * width + b * 3000] for a, b in ((0, 0), (1, 0), (1, 1), (0, 0))]
        with open(cls.path('part.geojson'), 'w', encoding='ascii') as file:
            json.dump({'type': 'Polygon', 'coordinates': [ring, hole]}, file)
        # Nearly the store's whole area, because the polygon's box bounds the raster.
        with open(cls.path('wide.geojson'), 'w', encoding='ascii') as file:
            json.dump({'type': 'MultiPolygon', 'coordinates': [
                [ring, hole], [[[x + width, y + width], [x + width, y + width - 1], [x + width - 1, y + width], [x + width, y + width]]]]}, file)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def run_ok(*args):
        result = subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=300)
        if result.returncode != 0:
            raise AssertionError(result.stderr)
        return result.stdout

    def raster(self, name, *options):
        self.run_ok('raster', self.path('dem.st'), '-o', self.path(name), '-q', '--force', *options)
        return Cog(self.path(name))

    def check_overviews(self, cog, choose):
        finer = cog.cells(0)
        for number in range(1, len(cog.levels)):
            coarser = cog.cells(number)
            for r, row in enumerate(coarser):
                for c, value in enumerate(row):
                    below = [v for line in finer[2 * r:2 * r + 2] for v in line[2 * c:2 * c + 2] if v is not None]
                    wanted = choose(below) if below else None
                    if value != wanted:
                        self.fail(f'overview {number}, column {c}, row {r}: {value}, not {wanted}')
            finer = coarser

    def test_overviews_are_means(self):
        cog = self.raster('heights.tif')
        self.assertEqual([t[WIDTH][0] for t in cog.levels], [1231, 616, 308])
        self.check_overviews(cog, lambda values: single(sum(values) / len(values)))

    def test_overviews_ignore_cells_without_data(self):
        cog = self.raster('part.tif', '--region', self.path('wide.geojson'))
        self.assertIn(0, cog.levels[0][SIZES])
        self.check_overviews(cog, lambda values: single(sum(values) / len(values)))

    def test_hillshade_is_averaged_and_aspect_is_not(self):
        cog = self.raster('shade.tif', '--value', 'hillshade', '--region', self.path('wide.geojson'))
        self.check_overviews(cog, lambda values: int(sum(values) / len(values) + 0.5))
        cog = self.raster('aspect.tif', '--value', 'aspect', '--region', self.path('wide.geojson'))
        self.check_overviews(cog, lambda values: values[0])

    def test_small_rasters_have_the_layout_too(self):
        self.assertEqual(len(self.raster('small.tif', '--cell', '500').levels), 1)

    def test_bytes_do_not_depend_on_memory_and_threads(self):
        self.raster('a.tif', '--memory', '2G', '--threads', '2')
        self.raster('b.tif', '--memory', '100M', '--threads', '1')
        with open(self.path('a.tif'), 'rb') as one, open(self.path('b.tif'), 'rb') as other:
            self.assertEqual(one.read(), other.read())

    @unittest.skipUnless(shutil.which('gdalinfo'), 'needs gdal-bin')
    def test_gdal_accepts_it_as_cloud_optimized(self):
        self.raster('heights.tif')
        info = json.loads(subprocess.run(['gdalinfo', '-json', self.path('heights.tif')], capture_output=True, check=True).stdout)
        self.assertEqual(info['metadata']['IMAGE_STRUCTURE']['LAYOUT'], 'COG')
        self.assertEqual([o['size'] for o in info['bands'][0]['overviews']], [[616, 345], [308, 173]])


if __name__ == '__main__':
    unittest.main()
