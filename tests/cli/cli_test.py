#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The rules of the command line that hold for all verbs, and the verbs that need no store.

TERRACE=path/to/terrace cli_test.py [CLASS...]
"""

import json
import os
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')

# Every verb of the contract; those that may be refused are still known by name.
VERBS = ['build', 'info', 'verify', 'points', 'mesh', 'surface', 'tile', 'sample', 'raster',
         'profile', 'contour', 'cluster', 'match', 'render', 'view', 'publish', 'synth', 'convert']


def terrace(*args, **kwargs):
    """Runs the command; output is text unless text=False."""
    kwargs.setdefault('text', True)
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, timeout=120, **kwargs)


def png_pixels(path):
    """Width, height, rows of an 8-bit RGB PNG without interlace: a reader of our own, so that the
    test does not share its writer's library."""
    data = open(path, 'rb').read()
    assert data[:8] == b'\x89PNG\r\n\x1a\n'
    place, packed = 8, b''
    while place < len(data):
        length, kind = struct.unpack('>I4s', data[place:place + 8])
        body = data[place + 8:place + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack('>I', data[place + 8 + length:][:4])[0]
        if kind == b'IHDR':
            width, height, depth, colour = struct.unpack('>IIBB', body[:10])
            assert (depth, colour) == (8, 2)
        elif kind == b'IDAT':
            packed += body
        place += 12 + length
    raw = zlib.decompress(packed)
    stride = 3 * width
    rows, above = [], bytes(stride)
    for y in range(height):
        method = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left = row[i - 3] if i >= 3 else 0
            up, corner = above[i], above[i - 3] if i >= 3 else 0
            if method == 1:
                row[i] = (row[i] + left) & 255
            elif method == 2:
                row[i] = (row[i] + up) & 255
            elif method == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif method == 4:
                p = left + up - corner
                near = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))
                row[i] = (row[i] + near[2]) & 255
        rows.append(bytes(row))
        above = row
    return width, height, rows


class CommandTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-cli-')
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def assert_one_line_error(self, result, code):
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
        self.assertTrue(result.stderr.startswith('terrace: '), result.stderr)

    def run_ok(self, *args, **kwargs):
        result = terrace(*args, **kwargs)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def json_of(self, *args):
        result = self.run_ok(*args, '--json')
        self.assertEqual(result.stdout.count('\n'), 1)
        return json.loads(result.stdout)


class FrameTest(CommandTest):
    def test_version_names_version_build_and_parts(self):
        out = self.run_ok('--version').stdout
        self.assertRegex(out, r'^terrace \d+\.\d+\.\d+\nbuild: .+\nparts: .+\n$')

    def test_help_lists_available_verbs_only(self):
        for args in (['--help'], ['-h'], ['help']):
            out = self.run_ok(*args).stdout
            for verb in VERBS:
                refused = 'not available yet' in terrace(verb).stderr
                self.assertEqual(f'\n  {verb} ' in out, not refused, verb)

    def test_verb_help_ends_with_an_example(self):
        for verb in VERBS:
            result = terrace(verb, '--help')
            if result.returncode == 2:
                self.assertIn('not available yet', result.stderr)
                continue
            last = result.stdout.rstrip().splitlines()
            self.assertEqual(last[-2], 'Example:')
            self.assertTrue(last[-1].startswith(f'  terrace {verb} '), last[-1])
            self.assertNotIn('not available', result.stdout)

    def test_wrong_usage_is_2(self):
        for args in ([], ['no-such-verb'], ['--no-such-option'], ['info'], ['info', 'a', 'b'],
                     ['info', 'a', '--no-such-option'], ['info', 'a', '--threads', '0'],
                     ['info', 'a', '--threads', 'x'], ['info', 'a', '--memory', 'lots'],
                     ['info', 'a', '--seed', '-1'], ['info', 'a', '--progress', 'maybe'],
                     ['synth', 'dem'], ['synth', 'nothing', '-o', 'x'],
                     ['synth', 'dem', '-o', 'x.tif', '--points', '5'],
                     ['synth', 'uniform', '-o', 'x.ply', '--size', '5x5'],
                     ['synth', 'dem', '-o', 'x.tif', '--size', '5'],
                     ['synth', 'dem', '-o', 'x.tif', '--hurst', '1'],
                     ['synth', 'dem', '-o', 'x.tif', '--crs', '32632'],
                     ['synth', 'uniform', '-o', 'x.ply', '--shuffle', 'pieces:5-2'],
                     ['render', 'a', '-o', 'x.png', '--size', '0x1'],
                     ['render', 'a', '-o', 'x.png', '--view', 'up'],
                     ['render', 'a', '-o', 'x.png', '--color', 'plaid']):
            with self.subTest(args=args):
                self.assert_one_line_error(terrace(*args, cwd=self.folder), 2)
        self.assertEqual(os.listdir(self.folder), [])

    def test_refused_verbs_and_flags_are_2_and_hidden(self):
        refused = [['surface', 's', '-o', 'x'], ['mesh', 's', '-o', 'x', '--max-error', '1'],
                   ['mesh', 's', '-o', 'x', '--base'], ['build', 'a', '-o', 's', '--resume'],
                   ['build', 'a', '-o', 's', '--order', 'spatial'], ['points', 's', '-o', 'x', '--max-points=5']]
        for args in refused:
            with self.subTest(args=args):
                result = terrace(*args)
                if 'not available yet' not in result.stderr:
                    continue  # it has come since
                self.assert_one_line_error(result, 2)
                if len(args) > 4 and terrace(args[0], '--help').returncode == 0:
                    flag = args[4].split('=')[0]
                    self.assertNotIn(flag, terrace(args[0], '--help').stdout)

    def test_json_fails_silently_on_stdout(self):
        result = terrace('info', 'no-such-file', '--json')
        self.assert_one_line_error(result, 1)

    def progress_of(self, *options):
        """What the command says on standard error while it reads points from us, until it has said
        something or the million is full."""
        command = subprocess.Popen([TERRACE, 'convert', '-', '-o', self.path('a.ply'), '--force', *options],
                                   stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        points = b'1 2 3\n' * 10000
        for _ in range(100):
            command.stdin.write(points)
            if select.select([command.stderr], [], [], 0.01)[0]:
                break
        error = command.communicate(timeout=60)[1].decode()
        self.assertEqual(command.returncode, 0, error)
        return error

    def test_quiet_and_progress(self):
        lines = self.progress_of('--progress', 'json', '-q').splitlines()
        self.assertGreater(len(lines), 0)
        for line in lines:
            progress = json.loads(line)
            self.assertTrue(0 <= progress['progress'] <= 1)
            self.assertGreater(progress['points'], 0)
            self.assertGreater(progress['points_per_second'], 0)
            self.assertIn('seconds_left', progress)
        self.assertEqual(self.progress_of('-q'), '')
        # Not on a terminal: no progress line, only the summary.
        self.assertEqual(self.progress_of().count('\n'), 1)


class ErrorTest(CommandTest):
    def test_files_that_are_not_there(self):
        for args in (['info', 'none.tif'], ['convert', 'none.ply', '-o', 'x.xyz'],
                     ['render', 'none.ply', '-o', 'x.png'], ['info', '.']):
            with self.subTest(args=args):
                self.assert_one_line_error(terrace(*args, cwd=self.folder), 1)
        self.assertEqual(os.listdir(self.folder), [])

    def test_hostile_files(self):
        cases = {'empty.ply': b'', 'noise.tif': bytes(range(256)) * 4, 'cut.tif': b'II*\0\x08\0\0\0',
                 'huge.ply': b'ply\nformat ascii 1.0\nelement vertex 99999999999\n'
                             b'property float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n',
                 'face.ply': b'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n'
                             b'property float y\nproperty float z\nelement face 1\n'
                             b'property list uchar int vertex_indices\nend_header\n0 0 0\n3 0 1 2\n',
                 'nohead.ply': b'ply\nformat ascii 1.0\n', 'nan.xyz': b'1 2 nan\n', 'two.xyz': b'1 2\n',
                 'bad.obj': b'v 1 2 3\nv 1 2 4\nf 1 2 9\n'}
        for name, content in cases.items():
            with open(self.path(name), 'wb') as file:
                file.write(content)
        for name in cases:
            for verb in ('info', 'render', 'convert'):
                if name in ('face.ply', 'bad.obj') and verb != 'render':
                    continue
                with self.subTest(name=name, verb=verb):
                    output = [] if verb == 'info' else ['-o', self.path('out.png' if verb == 'render' else 'o.xyz')]
                    result = terrace(verb, self.path(name), *output)
                    self.assert_one_line_error(result, 1)
                    self.assertIn(name, result.stderr)
        self.assertEqual(sorted(os.listdir(self.folder)), sorted(cases))

    def test_existing_output(self):
        out = self.path('a.xyz')
        self.run_ok('synth', 'uniform', '--points', '10', '-o', out)
        first = open(out).read()
        self.assert_one_line_error(terrace('synth', 'uniform', '--points', '9', '-o', out), 1)
        self.assertEqual(open(out).read(), first)
        self.run_ok('synth', 'uniform', '--points', '9', '-o', out, '--force')
        self.assertEqual(open(out).read().count('\n'), 9)
        foreign = self.path('letter.ply')
        open(foreign, 'w').write('Dear friend, this is no cloud of points.\n')
        result = terrace('synth', 'uniform', '--points', '9', '-o', foreign, '--force')
        self.assert_one_line_error(result, 1)
        self.assertIn('Dear friend', open(foreign).read())
        os.mkdir(self.path('folder.ply'))
        self.assert_one_line_error(
            terrace('synth', 'uniform', '--points', '9', '-o', self.path('folder.ply'), '--force'), 1)

    def test_every_output_can_be_replaced_with_force(self):
        dem, cloud = self.path('d.tif'), self.path('c.ply')
        for _ in range(2):
            self.run_ok('synth', 'dem', '--size', '64x64', '-o', dem, '--force')
            self.run_ok('synth', 'surface', '--points', '500', '-o', cloud, '--force')
            self.run_ok('convert', cloud, '-o', self.path('c.csv'), '--force')
            self.run_ok('render', dem, '-o', self.path('p.png'), '--size', '64x48', '--force')

    def test_full_disk_leaves_nothing(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        for args in (['synth', 'dem', '--size', '512x512', '-o', 'a.tif'],
                     ['synth', 'uniform', '--points', '100k', '-o', 'a.ply'],
                     ['synth', 'uniform', '--points', '100k', '-o', 'a.xyz']):
            with self.subTest(args=args):
                result = terrace(*args, cwd=self.folder, preexec_fn=small_files)
                self.assert_one_line_error(result, 1)
                self.assertEqual(os.listdir(self.folder), [])

    def test_a_closed_pipe_ends_quietly(self):
        command = subprocess.Popen(
            [TERRACE, 'synth', 'uniform', '--points', '300k', '-o', '-'],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        command.stdout.read(100)
        command.stdout.close()
        error = command.stderr.read()
        command.stderr.close()
        command.wait(timeout=60)
        self.assertEqual(error, b'')


class InterruptTest(CommandTest):
    def wait_until(self, condition):
        end = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.005)

    def catches_signals(self, command):
        with open(f'/proc/{command.pid}/status') as status:
            caught = next(line for line in status if line.startswith('SigCgt:'))
        return int(caught.split()[1], 16) >> (signal.SIGINT - 1) & 1

    def test_ctrl_c_is_130_and_leaves_nothing(self):
        command = subprocess.Popen(
            [TERRACE, 'synth', 'dem', '--size', '60000x60000', '-o', self.path('big.tif'),
             '--threads', '2'], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_until(lambda: os.listdir(self.folder))
        command.send_signal(signal.SIGINT)
        out, error = command.communicate(timeout=60)
        self.assertEqual(command.returncode, 130, error)
        self.assertEqual(out, '')
        self.assertEqual(error.count('\n'), 1)
        self.assertIn('again', error)
        self.assertEqual(os.listdir(self.folder), [])

    def test_ctrl_c_ends_a_wait_for_standard_input(self):
        command = subprocess.Popen([TERRACE, 'info', '-'], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_until(lambda: self.catches_signals(command))
        command.send_signal(signal.SIGINT)
        try:
            command.wait(timeout=60)
        finally:
            command.kill()
            out, error = command.communicate()
        self.assertEqual((command.returncode, out), (130, ''), error)
        self.assertEqual(error.count('\n'), 1, error)


class DemTest(CommandTest):
    def test_step_holds_at_every_size(self):
        for size in ('40x30', '300x200', '1000x1000', '3000x2000'):
            for roughness in (1.5, 2.65, 6):
                with self.subTest(size=size, roughness=roughness):
                    summary = self.json_of('synth', 'dem', '--size', size, '--roughness', roughness,
                                           '-o', self.path('a.tif'), '--force')
                    self.assertAlmostEqual(summary['rms_step'] / roughness, 1, delta=0.03)
                    self.assertGreater(summary['height']['min'], -1000)
                    self.assertLess(summary['height']['max'], 9000)

    def test_same_bytes_for_any_threads_and_memory(self):
        contents = set()
        for i, options in enumerate((['--threads', '1'], ['--threads', '5'],
                                     ['--threads', '2', '--memory', '64M'])):
            out = self.path(f'{i}.tif')
            self.run_ok('synth', 'dem', '--size', '2500x1100', '-o', out, *options)
            contents.add(open(out, 'rb').read())
        self.assertEqual(len(contents), 1)
        self.run_ok('synth', 'dem', '--size', '2500x1100', '-o', self.path('s.tif'), '--seed', '2')
        self.assertNotIn(open(self.path('s.tif'), 'rb').read(), contents)

    def test_is_a_raster_as_asked(self):
        out = self.path('a.tif')
        self.run_ok('synth', 'dem', '--size', '300x200', '--cell', '10', '--type', 'float32',
                    '--crs', 'EPSG:25832', '--compress', 'deflate', '-o', out)
        info = self.json_of('info', out)
        self.assertEqual((info['columns'], info['rows'], info['points']), (300, 200, 60000))
        self.assertEqual(info['crs']['epsg'], 25832)
        self.assertEqual(info['channels'][2]['type'], 'float32')
        self.assertAlmostEqual(info['bounds']['max'][0] - info['bounds']['min'][0], 2990)
        self.assertEqual(info['format'], 'geotiff')

    def test_gdal_reads_it_the_same(self):
        gdalinfo = shutil.which('gdalinfo')
        if gdalinfo is None:
            self.skipTest('gdalinfo is not there')
        out = self.path('a.tif')
        self.run_ok('synth', 'dem', '--size', '700x300', '-o', out)
        told = json.loads(subprocess.run([gdalinfo, '-json', '-stats', out], check=True,
                                         capture_output=True, text=True).stdout)
        height = self.json_of('info', out)['height']
        band = told['bands'][0]
        self.assertEqual(told['size'], [700, 300])
        self.assertEqual(band['type'], 'Int16')
        self.assertEqual((band['minimum'], band['maximum']), (height['min'], height['max']))
        self.assertAlmostEqual(band['mean'], height['mean'], places=3)

    def test_refuses_heights_that_cannot_fit(self):
        result = terrace('synth', 'dem', '--size', '64x64', '--roughness', '50', '-o', self.path('a.tif'))
        self.assert_one_line_error(result, 2)
        self.assertIn('float32', result.stderr)


class CloudTest(CommandTest):
    def points(self, *args):
        return self.run_ok('synth', *args, '-o', '-').stdout.splitlines()

    def test_kinds_have_the_points_asked_for(self):
        for kind in ('surface', 'uniform', 'clusters'):
            for count in (1, 7, 2000):
                lines = self.points(kind, '--points', count)
                self.assertEqual(len(lines), count)
                for line in lines[:50]:
                    self.assertEqual(len(line.split()), 3)

    def test_shuffling_permutes(self):
        for kind in ('surface', 'uniform', 'clusters'):
            plain = self.points(kind, '--points', '3000')
            for how in ('all', 'pieces:1-1', 'pieces:10-50', 'pieces:5000-5000'):
                with self.subTest(kind=kind, how=how):
                    shuffled = self.points(kind, '--points', '3000', '--shuffle', how)
                    self.assertEqual(sorted(shuffled), sorted(plain))
                    self.assertEqual(shuffled == plain, how == 'pieces:5000-5000')

    def test_same_bytes_for_any_threads(self):
        self.assertEqual(self.points('surface', '--points', '70k', '--threads', '1'),
                         self.points('surface', '--points', '70k', '--threads', '7'))

    def test_surface_is_closed_and_dense(self):
        # Every direction has a point near it.
        points = [tuple(map(float, p.split())) for p in self.points('surface', '--points', '5000')]
        for axis in range(3):
            values = [p[axis] for p in points]
            self.assertLess(min(values), -60)
            self.assertGreater(max(values), 60)

    def test_formats_keep_every_bit(self):
        first = self.path('a.ply')
        self.run_ok('synth', 'surface', '--points', '500', '-o', first)
        self.run_ok('convert', first, '-o', self.path('b.csv'))
        self.run_ok('convert', self.path('b.csv'), '-o', self.path('c.xyz'))
        summary = self.json_of('convert', self.path('c.xyz'), '-o', self.path('d.ply'))
        self.assertEqual(summary['points'], 500)
        self.assertEqual(open(first, 'rb').read(), open(self.path('d.ply'), 'rb').read())

    def test_standard_input_and_output(self):
        result = self.run_ok('convert', '-', '-o', '-', input='1 2 3\n4 5 6.5\n')
        self.assertEqual(result.stdout, '1 2 3\n4 5 6.5\n')
        self.assert_one_line_error(terrace('convert', '-', '-o', '-', '--json', input='1 2 3\n'), 2)


class InfoTest(CommandTest):
    KEYS = ['format', 'version', 'points', 'levels', 'bounds', 'crs', 'vertical', 'channels',
            'parameters', 'bytes']

    def test_keys_of_the_contract(self):
        open(self.path('a.xyz'), 'w').write('0 0 1\n1 2 3\n-1 5 2\n')
        info = self.json_of('info', self.path('a.xyz'))
        for key in self.KEYS:
            self.assertIn(key, info)
        self.assertEqual(info['points'], 3)
        self.assertEqual(info['bounds'], {'min': [-1, 0, 1], 'max': [1, 5, 3]})
        self.assertEqual(info['height'], {'min': 1, 'max': 3, 'mean': 2})
        self.assertEqual(info['bytes'], 19)

    def test_text_goes_to_standard_output(self):
        open(self.path('a.xyz'), 'w').write('0 0 1\n')
        result = self.run_ok('info', self.path('a.xyz'))
        self.assertIn('points:', result.stdout)
        self.assertEqual(result.stderr, '')


class RenderTest(CommandTest):
    def test_slope_to_the_light_is_brighter(self):
        # A roof: its north-western side is lit, the other in shadow.
        with open(self.path('roof.obj'), 'w') as file:
            file.write('v -10 -10 0\nv 10 10 0\nv -10 10 -5\nv 10 -10 -5\n')
            file.write('f 1 2 3\nf 1 4 2\n')
        self.run_ok('render', self.path('roof.obj'), '-o', self.path('a.png'), '--size', '100x100',
                    '--color', 'grey')
        width, height, rows = png_pixels(self.path('a.png'))
        self.assertEqual((width, height), (100, 100))
        north_west, south_east = rows[25][3 * 25], rows[75][3 * 75]
        self.assertGreater(north_west, south_east + 20)

    def test_wire_draws_the_edges(self):
        with open(self.path('square.obj'), 'w') as file:
            file.write('v 0 0 0\nv 8 0 0\nv 8 8 0\nv 0 8 0\nf 1 2 3 4\n')
        for name, options in (('plain.png', []), ('wire.png', ['--wire'])):
            self.run_ok('render', self.path('square.obj'), '-o', self.path(name), '--size', '80x80',
                        '--color', 'grey', *options)
        plain, wire = (png_pixels(self.path(n))[2] for n in ('plain.png', 'wire.png'))
        diagonal, face = 3 * 40, 3 * 25
        self.assertLess(wire[39][diagonal], plain[39][diagonal] - 40)
        self.assertEqual(wire[20][face + 3 * 5], plain[20][face + 3 * 5])

    def test_a_cloud_has_no_gaps(self):
        self.run_ok('synth', 'uniform', '--points', '4000', '-o', self.path('a.ply'))
        self.run_ok('render', self.path('a.ply'), '-o', self.path('a.png'), '--size', '200x200')
        _, _, rows = png_pixels(self.path('a.png'))
        background = rows[0][:3]
        empty = sum(rows[y][3 * x:3 * x + 3] == background for y in range(20, 180) for x in range(20, 180))
        self.assertLess(empty, 0.08 * 160 * 160)
        self.assertEqual(rows[199][-3:], background)

    def test_same_picture_for_any_threads(self):
        self.run_ok('synth', 'dem', '--size', '300x300', '-o', self.path('a.tif'))
        pictures = set()
        for threads in (1, 4):
            out = self.path(f'{threads}.png')
            self.run_ok('render', self.path('a.tif'), '-o', out, '--size', '160x120', '--view',
                        '200,40', '--threads', threads)
            pictures.add(open(out, 'rb').read())
        self.assertEqual(len(pictures), 1)

    def test_refuses_colours_that_are_not_there(self):
        self.run_ok('synth', 'uniform', '--points', '50', '-o', self.path('a.ply'))
        for what in ('rgb', 'level', 'class', 'slope'):
            result = terrace('render', self.path('a.ply'), '-o', self.path('a.png'), '--color', what)
            self.assert_one_line_error(result, 2)
            self.assertIn(what, result.stderr)


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], '-v', *sys.argv[1:]])
