#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests overlays end to end: mesh --save-overlay, and --overlay of mesh and points.

TERRACE=path/to/terrace overlay_cli_test.py
"""

import json
import os
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
SIZE = 200


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


def read(path):
    with open(path, 'rb') as file:
        return file.read()


class OverlayTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.store = cls.make_store('dem', 1)
        cls.raw = cls.heights('raw.obj')
        xs, ys = sorted({x for x, _ in cls.raw}), sorted({y for _, y in cls.raw})
        quarter = SIZE // 4
        cls.box = (xs[quarter], ys[quarter], xs[3 * quarter], ys[3 * quarter])
        cls.region = ','.join(map(repr, cls.box))
        cls.overlay = cls.path('smooth.overlay')
        cls.smoothed = cls.path('smooth.obj')
        cls.before = cls.bytes_of_store()
        cls.summary = json.loads(cls.run_ok(
            'mesh', cls.store, '--smooth', 'taubin', '--region', cls.region, '--save-overlay',
            cls.overlay, '-o', cls.smoothed, '--json'))

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

    @classmethod
    def make_store(cls, name, seed):
        dem, store = cls.path(f'{name}.tif'), cls.path(f'{name}.terrace')
        cls.run_ok('synth', 'dem', '--size', f'{SIZE}x{SIZE}', '--seed', seed, '-o', dem)
        cls.run_ok('build', dem, '-o', store, '--block', 2000)
        return store

    @classmethod
    def bytes_of_store(cls):
        return {name: read(os.path.join(cls.store, name)) for name in os.listdir(cls.store)}

    @staticmethod
    def heights_in(path):
        with open(path) as file:
            vertices = [map(float, line.split()[1:4]) for line in file if line.startswith('v ')]
        return {(x, y): z for x, y, z in vertices}

    @classmethod
    def heights(cls, name, *options):
        cls.run_ok('mesh', cls.store, '-o', cls.path(name), '--force', *options)
        return cls.heights_in(cls.path(name))

    def expect_error(self, code, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def changed(self):
        """Heights that the overlay changes, by position, taken from the smoothed mesh."""
        smooth = self.heights_in(self.smoothed)
        return {place: z for place, z in smooth.items() if z != self.raw[place]}

    def test_the_overlay_gives_the_smoothed_mesh_and_the_store_is_unchanged(self):
        again = self.path('again.obj')
        self.run_ok('mesh', self.store, '--region', self.region, '--overlay', self.overlay, '-o', again)
        self.assertEqual(read(again), read(self.smoothed))
        self.assertEqual(self.bytes_of_store(), self.before)
        changed = self.changed()
        self.assertGreater(len(changed), SIZE * SIZE // 8)
        # Positions in text have fewer digits than heights in the overlay.
        self.assertGreaterEqual(self.summary['overlay_values'], len(changed))
        self.assertLessEqual(self.summary['overlay_values'], (SIZE // 2 + 1) ** 2)

    def test_without_a_region_the_rest_keeps_the_heights_of_the_store(self):
        self.assertEqual(self.heights('all.obj', '--overlay', self.overlay),
                         {**self.raw, **self.changed()})

    def test_at_other_levels_and_with_focuses(self):
        changed = self.changed()
        for options in [('--level', 1), ('--level', 'top'),
                        ('--level', 1, '--focus', f'{self.region}:0'),
                        ('--level', 1, '--region', self.region)]:
            plain = self.heights('plain.obj', *options)
            over = self.heights('over.obj', '--overlay', self.overlay, *options)
            self.assertEqual(over, {place: changed.get(place, z) for place, z in plain.items()})
            self.assertNotEqual(over, plain)

    def test_smoothing_continues_from_an_overlay(self):
        second = self.path('second.overlay')
        both = self.heights('both.obj', '--overlay', self.overlay, '--smooth', 'laplacian:3',
                            '--region', self.region, '--save-overlay', second)
        self.assertEqual(self.heights('back.obj', '--overlay', second, '--region', self.region), both)
        self.assertNotEqual(both, self.heights_in(self.smoothed))
        single = self.heights('single.obj', '--smooth', 'laplacian:3', '--region', self.region)
        self.assertNotEqual(both, single)

    def test_threads_do_not_change_a_byte(self):
        for threads in (1, 4):
            out = self.path(f'threads{threads}.overlay')
            self.run_ok('mesh', self.store, '--smooth', 'taubin', '--region', self.region,
                        '--save-overlay', out, '-o', self.path('threads.ply'), '--force',
                        '--threads', threads)
            self.assertEqual(read(out), read(self.overlay))

    def test_clouds(self):
        points, store = self.path('cloud.xyz'), self.path('cloud.terrace')
        with open(points, 'w') as file:
            for k in range(3000):
                x, y = (k * 0.6180339887) % 1 * 100, (k * 0.7548776662) % 1 * 100
                file.write(f'{x:.6f} {y:.6f} {(k * 7919) % 13 / 4}\n')
        self.run_ok('build', points, '-o', store, '--block', 500)
        smooth, over, file = self.path('c.ply'), self.path('d.ply'), self.path('c.overlay')
        self.run_ok('mesh', store, '--smooth', 'laplacian', '--save-overlay', file, '-o', smooth)
        self.run_ok('mesh', store, '--overlay', file, '-o', over)
        self.assertEqual(read(over), read(smooth))
        self.run_ok('mesh', store, '-o', over, '--force')
        self.assertNotEqual(read(over), read(smooth))

    def points(self, *options):
        out = self.path('points.xyz')
        summary = json.loads(self.run_ok('points', self.store, '-o', out, '--force', '--json', *options))
        with open(out) as file:
            rows = [tuple(map(float, line.split()[:3])) for line in file]
        return {(x, y): z for x, y, z in rows}, summary

    def test_points_have_the_heights_of_the_overlay(self):
        plain, summary = self.points()
        self.assertEqual(len(plain), SIZE * SIZE)
        self.assertNotIn('overlay_values', summary)
        over, summary = self.points('--overlay', self.overlay)
        self.assertEqual(summary['overlay_values'], self.summary['overlay_values'])
        changed = {place for place in plain if plain[place] != over[place]}
        self.assertEqual(len(changed), summary['overlay_values'])
        smooth = self.heights_in(self.smoothed)
        self.assertLessEqual(set(self.changed()), changed)
        for place in changed:
            # The mesh is text with fewer digits.
            self.assertAlmostEqual(over[place], smooth[place], delta=1e-3)
        for options in [('--level', 1), ('--region', self.region), ('--level', 'top'),
                        ('--level', 1, '--focus', f'{self.region}:0')]:
            part, summary = self.points('--overlay', self.overlay, *options)
            raw, _ = self.points(*options)
            self.assertEqual(part, {place: over[place] for place in raw})
            self.assertEqual(summary['overlay_values'], len(changed & set(raw)))

    def test_another_store_is_refused(self):
        other = self.make_store('other', 2)
        out = self.path('none.ply')
        text = self.expect_error(1, 'mesh', other, '--overlay', self.overlay, '-o', out)
        for store in (self.store, other):
            with open(os.path.join(store, 'manifest.json')) as file:
                self.assertIn(json.load(file)['checksum'], text)
        self.assertEqual(text, self.expect_error(1, 'points', other, '--overlay', self.overlay, '-o', out))
        self.assertIn('no overlay', self.expect_error(
            1, 'mesh', self.store, '--overlay', self.path('missing'), '-o', out))
        damaged = self.path('damaged.overlay')
        data = bytearray(read(self.overlay))
        data[len(data) // 2] ^= 4
        with open(damaged, 'wb') as file:
            file.write(data)
        self.assertIn('checksum', self.expect_error(
            1, 'mesh', self.store, '--overlay', damaged, '-o', out))
        self.assertFalse(os.path.exists(out))

    def test_an_existing_file_is_replaced_only_with_force(self):
        mesh = ('mesh', self.store, '--level', 1, '--smooth', 'laplacian')
        file, out = self.path('kept.overlay'), self.path('kept.ply')
        self.run_ok(*mesh, '--save-overlay', file, '-o', out)
        before = read(file)
        os.remove(out)
        self.assertIn('--force', self.expect_error(1, *mesh, '--save-overlay', file, '-o', out))
        self.assertFalse(os.path.exists(out))
        self.assertEqual(read(file), before)
        self.run_ok('mesh', self.store, '--level', 1, '--smooth', 'taubin:2', '--save-overlay', file,
                    '-o', out, '--force')
        self.assertNotEqual(read(file), before)
        stranger = self.path('stranger.bin')
        with open(stranger, 'w') as letter:
            letter.write('Dear reader, this is a letter and not an overlay.\n')
        self.assertIn('not written by', self.expect_error(
            1, *mesh, '--save-overlay', stranger, '-o', out, '--force'))

    def test_usage(self):
        out = self.path('usage.ply')
        self.assertIn('--smooth', self.expect_error(
            2, 'mesh', self.store, '-o', out, '--save-overlay', self.path('u.overlay')))
        self.assertIn('same file', self.expect_error(
            2, 'mesh', self.store, '-o', out, '--smooth', 'taubin', '--save-overlay', out))
        self.assertIn('--overlay', self.expect_error(
            2, 'mesh', self.store, '-o', out, '--max-error', 1, '--overlay', self.overlay))
        self.assertFalse(os.path.exists(out))


if __name__ == '__main__':
    unittest.main()
