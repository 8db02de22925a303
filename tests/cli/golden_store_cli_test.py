#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the golden stores with the command and compares every digit with the text files next to them.

TERRACE=path/to/terrace STORES=libstream/tests/data/stores golden_store_cli_test.py
"""
import collections
import json
import lzma
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
STORES = pathlib.Path(os.environ['STORES'])


def terrace(*args):
    result = subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    return result.stdout


def value(text, kind):
    """Parses a value; float32 is written with fewer digits than its double."""
    if not kind.startswith('float'):
        return text
    number = float(text)
    return repr(struct.unpack('f', struct.pack('f', number))[0] if kind == 'float32' else number)


class GoldenStoreTest(unittest.TestCase):
    def expected(self, name, level):
        """The points of `level` and above in coordinates of the CRS."""
        manifest = json.loads((STORES / name / 'manifest.json').read_text())
        xy, z = manifest['world'], manifest['coordinates'][2]
        for line in lzma.decompress((STORES / f'{name}.txt.xz').read_bytes()).decode().splitlines():
            fields = line.split()
            if int(fields[0]) < level:
                continue
            a, b, c = map(float, fields[2:5])
            place = (xy[0] * a + xy[1] * b + xy[2], xy[3] * a + xy[4] * b + xy[5],
                     c * z['scale'] + z['offset'])
            yield (*map(repr, place), *map(value, fields[5:], self.types(name)))

    def check(self, name, levels):
        self.assertEqual(json.loads(terrace('verify', STORES / name, '--json'))['ok'], True)
        with tempfile.TemporaryDirectory() as folder:
            for level in range(levels):
                file = pathlib.Path(folder) / f'{level}.csv'
                terrace('points', STORES / name, '--level', level, '-o', file, '-q')
                types = ['float64'] * 3 + self.types(name)
                got = collections.Counter(
                    tuple(value(v, t) for v, t in zip(line.split(','), types, strict=True))
                    for line in file.read_text().splitlines()[1:])
                self.assertEqual(got, collections.Counter(self.expected(name, level)))

    @staticmethod
    def types(name):
        manifest = json.loads((STORES / name / 'manifest.json').read_text())
        return [attribute['type'] for attribute in manifest['attributes']]

    def test_a_raster_with_voids(self):
        self.check('grid', 3)

    def test_64_bit_samples(self):
        self.check('int64', 2)
        self.check('uint64', 2)

    def test_a_cloud_with_attributes_of_every_type(self):
        self.check('cloud', 3)

    def test_columns_of_points(self):
        self.check('survey', 2)

    def test_a_store_without_points(self):
        self.check('empty', 1)

    def test_an_overlay(self):
        """With the overlay, as many heights differ as the overlay has."""
        with tempfile.TemporaryDirectory() as folder:
            rows = []
            for more in ((), ('--overlay', STORES / 'grid.overlay')):
                file = pathlib.Path(folder) / f'{len(more)}.csv'
                terrace('points', STORES / 'grid', *more, '-o', file, '-q')
                rows.append(file.read_text().splitlines()[1:])
            text = lzma.decompress((STORES / 'grid.overlay.txt.xz').read_bytes()).decode()
            values = collections.Counter(repr(float(line.split()[3])) for line in text.splitlines())
            changed = collections.Counter(
                repr(float(new.split(',')[2])) for old, new in zip(*rows, strict=True) if old != new)
            self.assertEqual(changed, values)


if __name__ == '__main__':
    unittest.main()
