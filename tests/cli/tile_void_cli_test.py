#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles of a raster with voids that lie across the borders of tiles keep their bound.

TERRACE=path/to/terrace tile_void_cli_test.py
"""

import array
import json
import os
import random
import struct
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
NODATA = -9999.0
CELL = 1 / 1200  # degrees; borders of tiles at 8.4375 and 46.40625 have columns and rows on them
WEST, NORTH = 8.4375 - 60 * CELL, 46.40625 + 60 * CELL
COUNT = 151


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=200)


def write_tiff(path, heights):
    """A GeoTIFF of float32 in one strip, WGS 84, samples on the corners of cells."""
    values = array.array('f', heights)
    extra = b''
    offset = 8 + len(values) * 4

    def put(data):
        nonlocal extra
        at = offset + len(extra)
        extra += data + b'\0' * (len(data) % 2)
        return at

    scale = put(struct.pack('<3d', CELL, CELL, 0))
    tie = put(struct.pack('<6d', 0, 0, 0, WEST, NORTH, 0))
    keys = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 2, 2048, 0, 1, 4326)
    key_at = put(struct.pack(f'<{len(keys)}H', *keys))
    mark = b'-9999\0'
    tags = [(256, 4, 1, COUNT), (257, 4, 1, COUNT), (258, 3, 1, 32), (259, 3, 1, 1),
            (262, 3, 1, 1), (273, 4, 1, 8), (277, 3, 1, 1), (278, 4, 1, COUNT),
            (279, 4, 1, len(values) * 4), (339, 3, 1, 3), (33550, 12, 3, scale),
            (33922, 12, 6, tie), (34735, 3, len(keys), key_at),
            (42113, 2, len(mark), put(mark))]
    directory = struct.pack('<H', len(tags))
    directory += b''.join(struct.pack('<HHII', *tag) for tag in tags) + struct.pack('<I', 0)
    with open(path, 'wb') as file:
        file.write(struct.pack('<2sHI', b'II', 42, offset + len(extra)))
        file.write(values.tobytes() + extra + directory)


def steep_with_voids(seed):
    """Ridges of some 1000 m, and discs without data, most of them on the borders of tiles."""
    rng = random.Random(seed)
    heights = [1500 + 30 * abs((3 * c + 5 * r) % 80 - 40) + rng.uniform(-2, 2)
               for r in range(COUNT) for c in range(COUNT)]
    for k in range(40):
        radius = rng.uniform(1, 7)
        at = [rng.uniform(0, COUNT), rng.uniform(0, COUNT)]
        if k % 4 != 3:
            at[k % 2] = 60 + rng.uniform(-radius, radius)
        for r in range(COUNT):
            for c in range(COUNT):
                if (c - at[0]) ** 2 + (r - at[1]) ** 2 < radius ** 2:
                    heights[r * COUNT + c] = NODATA
    return heights


class TileVoidTest(unittest.TestCase):
    def test_samples_beside_voids_are_kept(self):
        for seed in (1, 2, 3):
            for error in (20, 5):
                with self.subTest(seed=seed, error=error), tempfile.TemporaryDirectory() as folder:
                    dem, store = f'{folder}/dem.tif', f'{folder}/dem.terrace'
                    write_tiff(dem, steep_with_voids(seed))
                    self.assertEqual(terrace('build', dem, '-o', store, '-q').returncode, 0)
                    run = terrace('tile', store, '-o', f'{folder}/tiles', '--vertical', 'ignore',
                                  '--zoom', '10-12', '--max-error', error, '--json')
                    self.assertEqual(run.returncode, 0, run.stderr)
                    zooms = json.loads(run.stdout)['zooms']
                    self.assertEqual([zoom['zoom'] for zoom in zooms], [10, 11, 12])
                    for zoom in zooms:
                        self.assertLessEqual(zoom['max_error'], error * 2 ** (12 - zoom['zoom']))


if __name__ == '__main__':
    unittest.main()
