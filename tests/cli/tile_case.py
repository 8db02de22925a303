# SPDX-License-Identifier: GPL-3.0-or-later
"""Small rasters with known positions, and helpers shared by the tests of tiles."""

import array
import json
import math
import os
import random
import subprocess
import tempfile
import unittest

import small_tiff
from quantized_mesh import A, B
from small_tiff import GEOGRAPHIC, utm

TERRACE = os.environ.get('TERRACE', 'terrace')
NODATA = -9999.0


def terrace(*args, **kwargs):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=250,
                          **kwargs)


def write_tiff(path, columns, rows, heights, west, north, cell, keys, matrix=None):
    small_tiff.write_tiff(path, columns, rows, heights, (west, north), cell, keys, matrix,
                          nodata='-9999')


def utm_to_degrees(x, y, zone):
    """Converts northern UTM coordinates by Krueger's series to n^4."""
    f = (A - B) / A
    n = f / (2 - f)
    radius = A / (1 + n) * (1 + n * n / 4 + n ** 4 / 64)
    beta = (n / 2 - 2 / 3 * n ** 2 + 37 / 96 * n ** 3 - n ** 4 / 360,
            n ** 2 / 48 + n ** 3 / 15 - 437 / 1440 * n ** 4,
            17 / 480 * n ** 3 - 37 / 840 * n ** 4, 4397 / 161280 * n ** 4)
    xi, eta = y / 0.9996 / radius, (x - 500000) / 0.9996 / radius
    xi0 = xi - sum(b * math.sin(2 * k * xi) * math.cosh(2 * k * eta) for k, b in enumerate(beta, 1))
    eta0 = eta - sum(b * math.cos(2 * k * xi) * math.sinh(2 * k * eta)
                     for k, b in enumerate(beta, 1))
    lon = math.atan2(math.sinh(eta0), math.cos(xi0))
    tau_prime = math.sin(xi0) / math.hypot(math.sinh(eta0), math.cos(xi0))
    e = math.sqrt(f * (2 - f))
    tau = tau_prime
    for _ in range(6):
        sigma = math.sinh(e * math.atanh(e * tau / math.hypot(1, tau)))
        now = tau * math.hypot(1, sigma) - sigma * math.hypot(1, tau)
        slope = (1 - e * e) * math.hypot(1, now) * math.hypot(1, tau) / (1 + (1 - e * e) * tau ** 2)
        tau += (tau_prime - now) / slope
    return math.degrees(lon) + 6 * zone - 183, math.degrees(math.atan(tau))


class Dem:
    """A small raster with cells in degrees or in metres of UTM."""

    def __init__(self, columns, rows, west, north, cell, zone=None, height=None, seed=1):
        self.columns, self.rows, self.west, self.north = columns, rows, west, north
        self.cell, self.zone = cell, zone
        noise = random.Random(seed)

        def hills(column, row):
            z = 300 + 150 * math.sin(column / 9) * math.cos(row / 7) + noise.uniform(-20, 20)
            return max(z, 250.0)

        height = height or hills
        self.heights = array.array('f', (height(c, r) for r in range(rows) for c in range(columns)))

    def write(self, path):
        keys = utm(self.zone) if self.zone else GEOGRAPHIC
        write_tiff(path, self.columns, self.rows, self.heights, self.west, self.north, self.cell,
                   keys)

    def place(self, column, row):
        x = self.west + (column + 0.5) * self.cell
        y = self.north - (row + 0.5) * self.cell
        return utm_to_degrees(x, y, self.zone) if self.zone else (x, y)

    def samples(self):
        return [(*self.place(c, r), self.heights[r * self.columns + c])
                for r in range(self.rows) for c in range(self.columns)
                if self.heights[r * self.columns + c] != NODATA]


class TileTestCase(unittest.TestCase):
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
    def build(cls, dem, name):
        dem.write(cls.path(name + '.tif'))
        store = cls.path(name + '.terrace')
        result = terrace('build', cls.path(name + '.tif'), '-o', store, '--force')
        assert result.returncode == 0, result.stderr
        return store

    def tile(self, store, name, *options):
        result = terrace('tile', store, '-o', self.path(name), '--vertical', 'ellipsoidal',
                         '--json', *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def verify(self, name, *options):
        result = terrace('verify', self.path(name), '--json', *options)
        self.assertIn(result.returncode, (0, 1), result.stderr)
        verdict = json.loads(result.stdout)
        self.assertEqual(verdict['ok'], result.returncode == 0)
        self.assertEqual(verdict['ok'], verdict['problems'] == [])
        return verdict

    def refuse(self, code, text, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertIn(text, result.stderr)
