#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles of a raster whose voids cross the borders of tiles keep their bound.

TERRACE=path/to/terrace tile_void_cli_test.py
"""

import json
import os
import random
import subprocess
import tempfile
import unittest

import small_tiff
from quantized_mesh import TileSet

TERRACE = os.environ.get('TERRACE', 'terrace')
NODATA = -9999.0
CELL = 1 / 1200  # degrees; the tile borders at 8.4375 and 46.40625 coincide with a column and a row
WEST, NORTH = 8.4375 - 60 * CELL, 46.40625 + 60 * CELL
COUNT = 151


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=200)


def write_tiff(path, heights):
    """Writes WGS 84 with samples on the corners of cells."""
    keys = {1024: 2, 1025: 2, 2048: 4326}
    small_tiff.write_tiff(path, COUNT, COUNT, heights, (WEST, NORTH), CELL, keys, nodata='-9999')


def steep_with_voids(seed):
    """Ridges of some 1000 m, with discs without data, most of them on borders of tiles."""
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
    def test_samples_next_to_voids_are_within_the_bound(self):
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

    def test_fill_may_exceed_the_height_range_of_a_tiles_samples(self):
        """Separated plateaus: tiles are rewritten with larger height steps and still list the tiles
        below them."""
        heights = [0.0 if c < 40 else 3000.0 if c > 80 else NODATA
                   for r in range(COUNT) for c in range(COUNT)]
        with tempfile.TemporaryDirectory() as folder:
            dem, store = f'{folder}/dem.tif', f'{folder}/dem.terrace'
            write_tiff(dem, heights)
            self.assertEqual(terrace('build', dem, '-o', store, '-q').returncode, 0)
            sets = []
            for threads in (1, 3):
                tiles = f'{folder}/tiles{threads}'
                run = terrace('tile', store, '-o', tiles, '--vertical', 'ignore', '--zoom', '0-12',
                              '--metadata', '--threads', threads)
                self.assertEqual(run.returncode, 0, run.stderr)
                sets.append(TileSet(tiles))
                sets[-1].check()
                sets[-1].check_metadata()
            self.assertEqual(sets[0].files(), sets[1].files())
            self.assertGreater(len(sets[0].tiles), 40)


if __name__ == '__main__':
    unittest.main()
