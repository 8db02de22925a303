#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests stores made in several runs end to end: joined or appended to, they give what one built of the whole gives.

TERRACE=path/to/terrace merge_cli_test.py
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / 'libstream' / 'tests'))
import decode_store  # noqa: E402  (an independent reader of the format)

TERRACE = os.environ.get('TERRACE', 'terrace')
SIZE = 500
CELL = 30


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


class MergeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.dem = cls.path('dem.tif')
        cls.run_ok('synth', 'dem', '--size', f'{SIZE}x{SIZE}', '--cell', CELL, '-o', cls.dem)
        low, high = json.loads(cls.run_ok('info', cls.dem, '--json'))['bounds'].values()
        cls.whole = cls.path('whole')
        cls.run_ok('build', cls.dem, '-o', cls.whole, '--block', 2000)
        # Strips of samples, from west to east; the last one fits a block.
        cls.parts = []
        columns = [0, 120, 260, SIZE - 3, SIZE]
        for begin, end in zip(columns, columns[1:]):
            part = cls.path(f'part{begin}')
            west, east = low[0] + CELL * (begin - 0.5), low[0] + CELL * (end - 0.5)
            cls.run_ok('build', cls.dem, '-o', part, '--block', 2000, '--region', f'{west},{low[1]},{east},{high[1]}')
            cls.parts.append(part)
        cls.merged = cls.path('merged')
        cls.summary = json.loads(cls.run_ok('merge', *cls.parts, '-o', cls.merged, '--json'))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def run_ok(*args):
        result = terrace(*args)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, code, text, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn(text, result.stderr)

    def output(self, *args, ending):
        file = self.path('output.' + ending)
        self.run_ok(*args, '-o', file, '--force')
        with open(file, 'rb') as opened:
            return opened.read()

    def test_describes_and_verifies_the_store(self):
        info = json.loads(self.run_ok('info', self.merged, '--json'))
        self.assertEqual(info['points'], SIZE * SIZE)
        self.assertEqual(self.summary['points'], SIZE * SIZE)
        self.assertEqual(self.summary['stores'], len(self.parts))
        self.assertEqual(info['levels'][0]['segments'], len(self.parts))
        self.assertEqual(self.summary['segments'], sum(level['segments'] for level in info['levels']))
        self.assertEqual(self.summary['store_bytes'], info['bytes'])
        self.assertTrue(json.loads(self.run_ok('verify', self.merged, '--json'))['ok'])
        # Most of its clusters are those of the parts.
        taken = sum(json.loads(self.run_ok('info', part, '--json'))['levels'][0]['clusters'] for part in self.parts[:-1])
        self.assertGreaterEqual(self.summary['clusters'], taken)
        self.assertLess(self.summary['new_clusters'], self.summary['clusters'] / 20)

    def test_gives_what_the_whole_gives(self):
        points = [sorted(self.output('points', store, ending='xyz').splitlines()) for store in (self.whole, self.merged)]
        self.assertEqual(*points)
        for verb, ending in ((('raster', '--cell', 45), 'tif'), (('contour', '--interval', 20), 'geojson'),
                             (('mesh', '--max-error', 5), 'ply')):
            self.assertEqual(self.output(verb[0], self.whole, *verb[1:], ending=ending),
                             self.output(verb[0], self.merged, *verb[1:], ending=ending), verb)

    def test_is_read_by_an_independent_decoder(self):
        store = decode_store.Store(pathlib.Path(self.merged))
        expected = decode_store.Store(pathlib.Path(self.whole))
        self.assertEqual(sorted(point[2:] for point in store.points()), sorted(point[2:] for point in expected.points()))

    def test_does_not_depend_on_the_order_or_on_the_parts(self):
        parts = [self.path('copy' + os.path.basename(part)) for part in self.parts]
        for part, copy in zip(self.parts, parts):
            shutil.copytree(part, copy)
        again = self.path('again')
        self.run_ok('merge', *reversed(parts), '-o', again)
        for part in parts:
            shutil.rmtree(part)
        names = sorted(os.listdir(self.merged))
        self.assertEqual(sorted(os.listdir(again)), names)
        for name in names:
            self.assertEqual((pathlib.Path(again) / name).read_bytes(), (pathlib.Path(self.merged) / name).read_bytes())
        self.run_ok('verify', again)
        # Merged stores are stores: they can be replaced, published, and packed into one run per level.
        self.expect_error(1, 'exists already', 'merge', *self.parts, '-o', again)
        self.run_ok('merge', *self.parts[:2], '-o', again, '--force')
        self.assertTrue(json.loads(self.run_ok('verify', again, '--json'))['ok'])
        self.run_ok('publish', self.merged, '-o', self.path('site'))
        self.run_ok('publish', self.merged, '--repack', '-o', self.path('packed'))
        for site, runs in (('site', len(self.parts)), ('packed', 1)):
            published = os.path.join(self.path(site), 'stores', 'merged')
            self.run_ok('verify', published)
            self.assertEqual(json.loads(self.run_ok('info', published, '--json'))['levels'][0]['segments'], runs)

    def test_appends(self):
        store = self.path('appended')
        low, high = json.loads(self.run_ok('info', self.dem, '--json'))['bounds'].values()

        def strip(begin, end):  # with the first column of the next one
            return '--region', f'{low[0] + CELL * (begin - 0.5)},{low[1]},{low[0] + CELL * (end + 0.5)},{high[1]}'

        self.run_ok('build', self.dem, '-o', store, '--block', 2000, *strip(150, 300))
        east = json.loads(self.run_ok('build', self.dem, '-o', store, '--append', *strip(300, SIZE), '--json'))
        self.assertEqual(east['known'], SIZE)
        self.assertEqual(east['store_points'] - east['points'], 151 * SIZE)
        text = terrace('build', self.dem, '-o', store, '--append', *strip(0, 150)).stderr
        self.assertIn('that the store has left out', text)
        self.assertIn(f'{SIZE * SIZE:,} points', text)
        self.assertTrue(json.loads(self.run_ok('verify', store, '--json'))['ok'])
        for verb, ending in ((('raster', '--cell', 45), 'tif'), (('mesh', '--max-error', 5), 'ply')):
            self.assertEqual(self.output(verb[0], self.whole, *verb[1:], ending=ending),
                             self.output(verb[0], store, *verb[1:], ending=ending), verb)
        before = {name: (pathlib.Path(store) / name).read_bytes() for name in os.listdir(store)}
        self.expect_error(2, '--append clusters as the store: block is 2000, not 3000',
                          'build', self.dem, '-o', store, '--append', '--block', 3000)
        self.expect_error(2, 'give either --append or --force', 'build', self.dem, '-o', store, '--append', '--force')
        self.expect_error(2, '--append excludes', 'build', self.dem, '-o', store, '--append', '--dry-run')
        self.expect_error(2, '--append excludes', 'build', self.dem, '-o', store, '--append', '--surface')
        self.expect_error(1, 'there is no store here', 'build', self.dem, '-o', self.path('none'), '--append')
        other = self.path('other.tif')
        self.run_ok('synth', 'dem', '--size', '40x40', '--cell', CELL, '--seed', 5, '-o', other)
        self.expect_error(1, 'both have a value for the cell', 'build', other, '-o', store, '--append')
        # An overlay of the present points is not lost.
        self.run_ok('mesh', store, '--level', 'top', '--smooth', 'laplacian', '--save-overlay', os.path.join(store, 'smooth'),
                    '-o', self.path('smooth.ply'))
        self.expect_error(1, 'contains smooth, an overlay', 'build', self.dem, '-o', store, '--append')
        os.remove(os.path.join(store, 'smooth'))
        self.assertEqual({name: (pathlib.Path(store) / name).read_bytes() for name in os.listdir(store)}, before)

    def test_copies_from_another_file_system(self):
        if not os.path.isdir('/dev/shm') or os.stat('/dev/shm').st_dev == os.stat(self.folder.name).st_dev:
            self.skipTest('there is no second file system')
        with tempfile.TemporaryDirectory(dir='/dev/shm') as other:
            part = os.path.join(other, 'part')
            shutil.copytree(self.parts[0], part)
            target = self.path('from-another')
            self.run_ok('merge', part, *self.parts[1:], '-o', target)
            self.assertEqual((pathlib.Path(target) / 'manifest.json').read_bytes(),
                             (pathlib.Path(self.merged) / 'manifest.json').read_bytes())
            # A damaged copy is refused, and leaves nothing.
            with open(os.path.join(part, 'level-0.0.clusters'), 'r+b') as file:
                file.seek(1000)
                file.write(b'\xff\x00\xff')
            self.expect_error(1, 'the checksum of the file is wrong', 'merge', part, *self.parts[1:], '-o', self.path('bad'))
            self.assertFalse(os.path.exists(self.path('bad')))

    def test_refuses_what_does_not_fit(self):
        target = self.path('refused')
        self.expect_error(2, 'two or more', 'merge', self.parts[0], '-o', target)
        self.expect_error(2, 'cannot be both', 'merge', *self.parts, '-o', self.parts[0], '--force')
        self.expect_error(1, 'is the same store', 'merge', self.parts[0], self.parts[0], '-o', target)
        self.expect_error(1, 'both have a value for the cell', 'merge', self.whole, self.parts[0], '-o', target)
        self.expect_error(1, 'there is no store here', 'merge', self.parts[0], self.path('nowhere'), '-o', target)
        other = self.path('other')
        self.run_ok('build', self.dem, '-o', other, '--block', 1000)
        self.expect_error(1, 'block 1000', 'merge', self.parts[0], other, '-o', target)
        self.assertFalse(os.path.exists(target))


if __name__ == '__main__':
    unittest.main()
