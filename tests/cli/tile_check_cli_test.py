#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests interrupted, damaged and verified tile sets.

TERRACE=path/to/terrace tile_check_cli_test.py
"""

import json
import os
import random
import re
import shutil
import signal
import struct
import subprocess
import time
import unittest

from quantized_mesh import UNITS, Tile, TileSet
from tile_case import TERRACE, Dem, TileTestCase, terrace

VERTICAL = ('--vertical', 'ellipsoidal')


class ResumeTest(TileTestCase):
    OPTIONS = ('--max-error', '0.5', '--quality', 'fitted', '--threads', '1')

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.store = cls.build(Dem(420, 300, 10.13, 46.71, 0.0005), 'dem')

    def interrupt(self, name, number):
        """Starts a run and stops it by a signal when some tiles are finished. Returns the exit code and the
        names of the finished tiles."""
        run = subprocess.Popen([TERRACE, 'tile', self.store, '-o', self.path(name), *VERTICAL,
                                *self.OPTIONS], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        journal = self.path(name + '/.terrace-tiles')
        end = time.monotonic() + 100
        while time.monotonic() < end and run.poll() is None:
            try:
                with open(journal, 'rb') as file:
                    if file.read().count(b'\n') > 8:
                        break
            except FileNotFoundError:
                pass
            time.sleep(0.002)
        run.send_signal(number)
        self.errors = run.communicate()[1].decode()
        with open(journal, 'rb') as file:
            lines = file.read().decode().splitlines()[1:]
        self.assertGreater(len(lines), 5)
        self.assertFalse(os.path.exists(self.path(name + '/layer.json')))
        return run.returncode, ['/'.join(line.split()[:3]) + '.terrain' for line in lines
                                if line.endswith(' .')]

    def resume(self, name):
        return self.tile(self.store, name, *self.OPTIONS, '--resume')

    def test_a_killed_run_can_be_resumed(self):
        whole = self.tile(self.store, 'whole', *self.OPTIONS)
        code, finished = self.interrupt('killed', signal.SIGKILL)
        self.assertEqual(code, -signal.SIGKILL)
        # A half-written set is not a set for any verb and is not overwritten by accident.
        self.refuse(1, '--resume', 'verify', self.path('killed'))
        self.refuse(1, '--resume', 'tile', self.store, '-o', self.path('killed'), *VERTICAL)
        # Damage: a truncated tile, one with a flipped bit, a missing one, a journal that ends in a
        # truncated line, and a temporary file.
        def name(i):
            return os.path.join(self.path('killed'), finished[i])

        os.truncate(name(0), os.path.getsize(name(0)) // 2)
        with open(name(1), 'r+b') as file:
            file.seek(200)
            byte = file.read(1)[0]
            file.seek(200)
            file.write(bytes([byte ^ 1]))
        os.remove(name(2))
        with open(self.path('killed/.terrace-tiles'), 'a') as file:
            file.write('9 542 38')
        summary = self.resume('killed')
        self.assertEqual(TileSet(self.path('killed')).files(),
                         TileSet(self.path('whole')).files())
        self.assertEqual(summary['tiles'], whole['tiles'])
        self.assertGreaterEqual(summary['kept'], len(finished) - 3)
        self.assertLess(summary['kept'], whole['tiles'])
        self.assertEqual(summary['zooms'], whole['zooms'])
        with open(self.path('killed/layer.json')) as a, open(self.path('whole/layer.json')) as b:
            left, right = json.load(a), json.load(b)
        left['name'] = right['name']
        self.assertEqual(left, right)
        self.assertEqual(self.verify('killed', '--store', self.store, *VERTICAL)['problems'], [])

    def test_a_stopped_run_says_how_to_resume(self):
        code, finished = self.interrupt('stopped', signal.SIGINT)
        self.assertEqual(code, 130, self.errors)
        # With other options the finished tiles are useless.
        summary = self.tile(self.store, 'stopped', '--max-error', 4, '--resume')
        self.assertLess(summary['kept'], len(finished))
        self.assertEqual(self.verify('stopped', '--store', self.store, *VERTICAL)['problems'], [])
        again = self.tile(self.store, 'stopped', '--max-error', 4, '--resume')
        self.assertEqual(again['kept'], again['tiles'])


class VerifyTest(TileTestCase):
    OPTIONS = ('--max-error', '4', '--normals', '--metadata', '--water', 'nodata', '--zoom', '0-9')

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.store = cls.build(Dem(90, 70, 10.13, 46.71, 0.01), 'dem')
        result = terrace('tile', cls.store, '-o', cls.path('sound'), *VERTICAL, *cls.OPTIONS)
        assert result.returncode == 0, result.stderr
        cls.set = TileSet(cls.path('sound'))

    def setUp(self):
        self.dir = self.path('damaged')
        shutil.copytree(self.path('sound'), self.dir)
        # Remove the journal, which knows every byte, to test the other checks.
        os.remove(os.path.join(self.dir, '.terrace-tiles'))

    def tearDown(self):
        shutil.rmtree(self.dir)

    def inner_tile(self):
        """A tile of the deepest zoom with neighbours on all sides."""
        for key in sorted(self.set.tiles, reverse=True):
            zoom, x, y = key
            if zoom == 9 and all((zoom, x + i, y + j) in self.set.tiles
                                 for i in (-1, 0, 1) for j in (-1, 0, 1)):
                return key
        raise AssertionError('no such tile')

    def change(self, key, data):
        path = os.path.join(self.dir, '/'.join(map(str, key)) + '.terrain')
        with open(path, 'wb') as file:
            file.write(data)
        return path

    def found(self, *texts, also=(), store=False):
        """Asserts that every text is in a problem, and that every problem has one of them or of `also`."""
        options = ('--store', self.store, *VERTICAL) if store else ()
        problems = self.verify('damaged', *options)['problems']
        words = [f'{problem["file"]}: {problem["what"]}' for problem in problems]
        for text in texts:
            self.assertTrue(any(text in word for word in words), (text, words))
        for word in words:
            self.assertTrue(any(text in word for text in (*texts, *also)), word)
        for problem in problems:
            self.assertEqual(set(problem), {'file', 'offset', 'what'})
        return problems

    def columns(self, tile, u=None, v=None, h=None):
        """The bytes of a tile with other vertices."""
        data = bytearray(tile.data)
        n, at = len(tile.u), 92
        for values in (u or tile.u, v or tile.v, h or tile.h):
            last = 0
            for value in values:
                delta = value - last
                struct.pack_into('<H', data, at, delta * 2 if delta >= 0 else -delta * 2 - 1)
                last, at = value, at + 2
        assert at == 92 + 6 * n
        return bytes(data)

    def test_a_valid_set_has_no_problems(self):
        self.set.check()
        for threads in (1, 4):
            verdict = self.verify('damaged', '--store', self.store, *VERTICAL, '--threads', threads)
            self.assertEqual(verdict['problems'], [])
            self.assertEqual(verdict['tiles'], len(self.set.tiles))
            self.assertEqual([line['zoom'] for line in verdict['zooms']], list(range(10)))
            self.assertEqual(verdict['samples'], sum(line['samples'] for line in verdict['zooms']))

    def test_a_tile_may_start_like_gzip(self):
        key = self.inner_tile()
        # The last bits of the centre: less than a millionth of a metre.
        self.change(key, b'\x1f\x8b\x08' + self.set.tiles[key].data[3:])
        self.found()
        self.change(key, b'\x1f\x8b\x08' + self.set.tiles[key].data[3:-4])
        self.assertFalse(self.verify('damaged')['ok'])

    def test_the_journal_knows_every_byte(self):
        shutil.copy(self.path('sound/.terrace-tiles'), self.dir)
        self.found()
        key = self.inner_tile()
        data = bytearray(self.set.tiles[key].data)
        data[3] ^= 1  # a byte of the centre, which no other check can find
        self.change(key, bytes(data))
        problems = self.found('/'.join(map(str, key)) + '.terrain: the file was changed after it was written')
        self.assertEqual(len(problems), 1)

    def test_a_step_at_the_antimeridian_is_found(self):
        tile = self.set.tiles[0, 0, 0]
        # Flat, far from the data.
        self.assertEqual((tile.low, tile.high), (0, 0))
        data = bytearray(self.columns(tile, h=[UNITS if u == 0 else 0 for u in tile.u]))
        struct.pack_into('<f', data, 28, 20)
        self.change((0, 0, 0), data)
        self.found('0/1/0.terrain: its eastern side and that of 0/0/0.terrain have heights',
                   also=('sphere', 'horizon'))

    def test_missing_and_stray_tiles_are_found(self):
        key = self.inner_tile()
        os.remove(os.path.join(self.dir, '/'.join(map(str, key)) + '.terrain'))
        stray = os.path.join(self.dir, '9', '0')
        os.mkdir(stray)
        shutil.copy(os.path.join(self.dir, '0/0/0.terrain'), os.path.join(stray, '7.terrain'))
        shutil.copy(os.path.join(self.dir, '0/0/0.terrain'), os.path.join(stray, '07.terrain'))
        open(os.path.join(stray, '.8.terrain.tmp'), 'w').close()
        problems = self.found('/'.join(map(str, key)) + '.terrain: layer.json lists this tile',
                              '9/0/7.terrain: a tile that layer.json does not list',
                              '9/0/07.terrain: its path does not name a tile',
                              also=('9/0/7.terrain: ',))
        self.assertGreaterEqual(len(problems), 3)
        # The temporary files of a killed run are not part of the set.
        self.assertEqual(self.verify('damaged')['left_over'], 1)

    def test_an_absent_tile_with_samples_is_found(self):
        key = self.inner_tile()
        os.remove(os.path.join(self.dir, '/'.join(map(str, key)) + '.terrain'))
        path = os.path.join(self.dir, 'layer.json')
        with open(path) as file:
            layer = json.load(file)
        layer['available'][9] = [{'startX': x, 'startY': y, 'endX': x, 'endY': y}
                                 for z, x, y in self.set.tiles if z == 9 and (z, x, y) != key]
        with open(path, 'w') as file:
            json.dump(layer, file)
        self.found()
        self.found('no tile where the store has', store=True)

    def test_layers_that_claim_too_much_are_found(self):
        path = os.path.join(self.dir, 'layer.json')
        with open(path) as file:
            layer = json.load(file)
        good = json.dumps(layer)
        layer['available'].append([{'startX': 0, 'startY': 0, 'endX': 2 ** 11 - 1, 'endY': 1023}])
        layer['available'] += [[] for _ in range(19)]
        layer['available'].append([{'startX': 0, 'startY': 0, 'endX': 2 ** 31 - 1,
                                    'endY': 2 ** 30 - 1}])
        layer['maxzoom'] = 30
        with open(path, 'w') as file:
            json.dump(layer, file)
        words = [p['what'] for p in self.verify('damaged')['problems']]
        self.assertTrue(any('claims 2,305,843,009,213,693,952 tiles' in word for word in words))
        self.assertTrue(any('more listed tiles do not exist' in word for word in words))
        for key, value in (('bounds', [20, 46, 10, 47]), ('available', [[], []]),
                           ('available', [layer['available'][0] * 2] + layer['available'][1:10]),
                           ('extensions', [])):
            changed = json.loads(good)
            changed[key] = value
            with open(path, 'w') as file:
                json.dump(changed, file)
            self.assertFalse(self.verify('damaged')['ok'], key)
        for text in ('', '{', '[]', '{"format": "other"}'):
            with open(path, 'w') as file:
                file.write(text)
            self.refuse(1, 'layer.json', 'verify', self.dir)

    def test_turned_triangles_are_found(self):
        key = self.inner_tile()
        tile = self.set.tiles[key]
        data = bytearray(tile.data)
        turned = 0
        for number in range(len(tile.triangles)):
            at = tile.triangles_at + 6 * number
            codes = struct.unpack_from('<3H', data, at)
            if 0 not in codes and turned < 2:  # no vertex occurs first here
                struct.pack_into('<3H', data, at, codes[0], codes[2], codes[1])
                first = at if turned == 0 else first
                turned += 1
        self.assertEqual(turned, 2)
        self.change(key, data)
        problems = self.found('not counter-clockwise', 'times the area',
                              'two triangles on one side', also=('only one triangle',))
        places = {p['what'].split()[0]: p['offset'] for p in problems}
        self.assertEqual(places['triangle'], first)

    def test_moved_border_vertices_are_found(self):
        key = self.inner_tile()
        tile = self.set.tiles[key]
        vertex = next(i for i in range(len(tile.u)) if tile.u[i] == UNITS and 0 < tile.v[i] < UNITS)
        v = list(tile.v)
        v[vertex] += 1
        self.change(key, self.columns(tile, v=v))
        problems = self.found('vertices at other places')
        east = f'{key[0]}/{key[1] + 1}/{key[2]}.terrain'
        self.assertTrue(problems[0]['file'].endswith(east))
        u = list(tile.u)
        u[vertex] -= 1
        self.change(key, self.columns(tile, u=u))
        self.found('list of vertices on the east side', 'vertices at other places',
                   'times the area', 'only one triangle')

    def test_shifted_heights_are_found(self):
        key = self.inner_tile()
        tile = self.set.tiles[key]
        vertex = next(i for i in range(len(tile.u)) if tile.v[i] == 0 and 0 < tile.u[i] < UNITS)
        h = list(tile.h)
        step = round(1 / ((tile.high - tile.low) / UNITS))
        h[vertex] += step if h[vertex] + step < UNITS else -step
        self.change(key, self.columns(tile, h=h))
        header = ('bounding sphere', 'horizon occlusion')
        problems = self.found('its southern side', also=header)
        self.assertIn('heights that differ by up to', problems[-1]['what'])
        # In the interior, only the samples show it.
        vertex = next(i for i in range(len(tile.u)) if 0 < tile.u[i] < UNITS
                      and 0 < tile.v[i] < UNITS and 100 / 150 * UNITS > tile.h[i])
        step = (tile.high - tile.low) / UNITS
        h = list(tile.h)
        h[vertex] += round(-9 / step) if h[vertex] * step > 9 else round(9 / step)
        self.change(key, self.columns(tile, h=h))
        self.found('m off the tile, more than 4 m', also=header, store=True)

    def test_a_header_must_have_the_tiles_heights(self):
        key = self.inner_tile()
        tile = self.set.tiles[key]
        self.assertEqual((min(tile.h), max(tile.h)), (0, UNITS))
        for scaled, text in (([h // 2 for h in tile.h], 'its highest height is'),
                             ([(h + UNITS) // 2 for h in tile.h], 'its lowest height is')):
            self.change(key, self.columns(tile, h=scaled))
            self.found(text, also=('bounding sphere', 'horizon occlusion', 'heights that differ', 'the centre'))

    def test_wrong_headers_are_found(self):
        key = self.inner_tile()
        tile = self.set.tiles[key]
        for at, code, value, text in (
                (0, '<d', tile.centre[0] + 1e6, 'the centre is outside'),
                (24, '<f', tile.high + 1, 'lowest and highest'),
                (28, '<f', tile.high + 900, 'differ by up to'),
                (24, '<f', tile.low - 1, 'differ by up to'),
                (32, '<d', tile.sphere[0] + 500, 'bounding sphere'),
                (56, '<d', tile.radius - 5, 'leaves out vertices'),
                (56, '<d', tile.radius * 2, 'as wide as'),
                (64, '<d', float('nan'), 'horizon occlusion point is not finite'),
                (64, '<d', tile.horizon[0] * 0.99, 'is hidden while a vertex is not'),
                (64, '<d', tile.horizon[0] * 1.01, 'are needed'),
                # Both numbers are slightly above 1, and their difference is found.
                (64, '<d', tile.horizon[0] * (1 - 1e-5), re.compile(r'is (1\.\d+) radii out, (?!\1)1\.\d+ are'))):
            with self.subTest(f'{text} at byte {at}'):
                data = bytearray(tile.data)
                struct.pack_into(code, data, at, value)
                self.change(key, data)
                words = [p['what'] for p in self.verify('damaged')['problems']]
                self.assertTrue(any(re.search(text, word) for word in words), words)

    def test_every_truncation_is_found(self):
        key = self.inner_tile()
        data = self.set.tiles[key].data
        chance = random.Random(7)
        for length in [0, 1, 87, 91, 92, *(chance.randrange(len(data)) for _ in range(25))]:
            with self.subTest(length):
                path = self.change(key, data[:length])
                problems = self.verify('damaged')['problems']
                self.assertIn(path, [p['file'] for p in problems])
                self.assertLessEqual(problems[0]['offset'], length)

    def test_flipped_bits_do_not_crash_verify(self):
        key = self.inner_tile()
        data = self.set.tiles[key].data
        chance, found = random.Random(8), 0
        for _ in range(60):
            at, bit = chance.randrange(len(data)), chance.randrange(8)
            with self.subTest(f'byte {at}, bit {bit}'):
                changed = bytearray(data)
                changed[at] ^= 1 << bit
                self.change(key, changed)
                found += not self.verify('damaged', '--store', self.store, *VERTICAL)['ok']
        self.assertGreater(found, 10)

    def test_a_tighter_bound_is_violated(self):
        verdict = self.verify('sound', '--store', self.store, *VERTICAL, '--max-error', '0.5')
        self.assertGreater(len(verdict['problems']), 5)
        self.assertTrue(all('m off the tile' in p['what'] for p in verdict['problems']))
        again = self.verify('sound', '--store', self.store, *VERTICAL, '--max-error', '0.5',
                            '--threads', '3')
        self.assertEqual(again, verdict)

    def test_wrong_usage(self):
        sound = self.path('sound')
        self.refuse(2, '--vertical', 'verify', sound, '--store', self.store)
        self.refuse(2, '--store', 'verify', sound, '--max-error', 3)
        self.refuse(2, '--max-error', 'verify', sound, '--store', self.store, *VERTICAL,
                    '--max-error', -1)
        self.refuse(2, 'tile sets', 'verify', self.store, '--store', self.store)
        self.refuse(1, '--memory', 'verify', sound, '--memory', '10M')
        self.refuse(1, 'nothing', 'verify', self.path('nothing'))


if __name__ == '__main__':
    unittest.main()
