#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the rules of the command line for all verbs, and the verbs that need no store.

TERRACE=path/to/terrace cli_test.py [CLASS...]
"""

import array
import fcntl
import json
import math
import os
import random
import re
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')

# Every verb of the contract; verbs that may be unavailable are still known by name.
VERBS = ['build', 'info', 'verify', 'points', 'mesh', 'surface', 'tile', 'sample', 'raster',
         'profile', 'contour', 'cluster', 'match', 'render', 'view', 'publish', 'synth', 'convert']


def terrace(*args, **kwargs):
    """Runs the command; the output is text unless text=False."""
    kwargs.setdefault('text', True)
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, timeout=120, **kwargs)


def png_pixels(path):
    """Width, height and rows of an 8-bit RGB PNG without interlacing. Written here, so that the test
    does not share a library with the writer."""
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
    def test_version_lists_version_build_and_libraries(self):
        out = self.run_ok('--version').stdout
        self.assertRegex(out, r'^terrace \d+\.\d+\.\d+\nbuild: .+\nparts: .+\n$')

    def test_help_lists_all_verbs(self):
        for args in (['--help'], ['-h'], ['help']):
            out = self.run_ok(*args).stdout
            for verb in VERBS:
                self.assertIn(f'\n  {verb} ', out)

    def test_verb_help_ends_with_an_example(self):
        for verb in VERBS:
            last = self.run_ok(verb, '--help').stdout.rstrip().splitlines()
            self.assertEqual(last[-2], 'Example:')
            self.assertTrue(last[-1].startswith(f'  terrace {verb} '), last[-1])

    def test_wrong_usage_exits_with_2(self):
        for args in ([], ['no-such-verb'], ['--no-such-option'], ['info'], ['verify', 'a', 'b'],
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

    def test_unknown_formats_exit_with_2(self):
        self.assertEqual(terrace('synth', 'surface', '--points', '100', '-o', 's.ply', cwd=self.folder).returncode, 0)
        self.assertEqual(terrace('build', 's.ply', '-o', 's.store', cwd=self.folder).returncode, 0)
        before = sorted(os.listdir(self.folder))
        for args in (['build', 's.ply', '-o', 'z', '--input-format', 'foo'], ['convert', 's.ply', '-o', 'y', '--format', 'foo'],
                     ['convert', 's.ply', '-o', 'y.xyz', '--input-format', 'foo'], ['points', 's.store', '-o', 'y', '--format', 'foo'],
                     ['mesh', 's.store', '-o', 'y', '--format', 'foo'], ['surface', 's.store', '-o', 'y', '--format', 'foo'],
                     ['cluster', 's.ply', '-o', 'y.xyz', '--format', 'foo'],
                     ['match', 's.ply', '-o', 'y.csv', '--input-format', 'foo']):
            with self.subTest(args=args):
                result = terrace(*args, cwd=self.folder)
                self.assert_one_line_error(result, 2)
                self.assertRegex(result.stderr, 'known are|can be')
        self.assertEqual(sorted(os.listdir(self.folder)), before)

    def test_json_errors_leave_stdout_empty(self):
        result = terrace('info', 'no-such-file', '--json')
        self.assert_one_line_error(result, 1)

    def progress_of(self, *options):
        """Returns the standard error of a run that reads points until it has reported something or has
        got a million points."""
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
        # Not a terminal: no progress line, only the summary.
        self.assertEqual(self.progress_of().count('\n'), 1)


class ErrorTest(CommandTest):
    def test_missing_files(self):
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
                 'nohead.ply': b'ply\nformat ascii 1.0\n', 'inf.xyz': b'1 2 inf\n', 'two.xyz': b'1 2\n',
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

    def test_unsupported_formats_are_named_with_a_remedy(self):
        for content, name, remedy in (
                (b'\x89HDF\r\n\x1a\n', 'HDF5', 'gdalinfo'), (b'PK\x03\x04', 'zip', 'unzip'),
                (b'\x28\xb5\x2f\xfd', 'zstd', 'zstd -d')):
            path = self.path('file')
            with open(path, 'wb') as file:
                file.write(content)
            for args in (('info', path), ('build', path, '-o', self.path('a.terrace')),
                         ('render', path, '-o', self.path('a.png')),
                         ('cluster', path, '-o', self.path('a.ply')),
                         ('convert', path, '-o', self.path('a.ply'))):
                result = terrace(*args)
                self.assert_one_line_error(result, 1)
                self.assertIn(name, result.stderr, args)
                self.assertIn(remedy, result.stderr, args)
            result = subprocess.run([TERRACE, 'info', '-'], input=content, capture_output=True)
            self.assertEqual(result.returncode, 1)
            self.assertIn(name.encode(), result.stderr)

    def test_existing_output(self):
        out = self.path('a.xyz')
        self.run_ok('synth', 'uniform', '--points', '10', '-o', out)
        first = open(out).read()
        self.assert_one_line_error(terrace('synth', 'uniform', '--points', '9', '-o', out), 1)
        self.assertEqual(open(out).read(), first)
        self.run_ok('synth', 'uniform', '--points', '9', '-o', out, '--force')
        self.assertEqual(open(out).read().count('\n'), 9)
        foreign = self.path('letter.ply')
        open(foreign, 'w').write('Dear friend, this is not a point cloud.\n')
        result = terrace('synth', 'uniform', '--points', '9', '-o', foreign, '--force')
        self.assert_one_line_error(result, 1)
        self.assertIn('Dear friend', open(foreign).read())
        os.mkdir(self.path('folder.ply'))
        self.assert_one_line_error(
            terrace('synth', 'uniform', '--points', '9', '-o', self.path('folder.ply'), '--force'), 1)
        # --force would not help.
        os.mkfifo(self.path('pipe.xyz'))
        self.assertIn('- is standard output', terrace('synth', 'uniform', '--points', '9', '-o', self.path('pipe.xyz')).stderr)

    def test_every_output_can_be_replaced_with_force(self):
        dem, hills = self.path('in.tif'), self.path('in.terrace')
        self.run_ok('synth', 'dem', '--size', '40x30', '--crs', 'EPSG:32632', '-o', dem)
        self.run_ok('build', dem, '-o', hills, '--block', '200')
        clouds, scans, places = [], [], []
        for n in (0, 1):
            clouds.append(self.path(f'in{n}.ply'))
            self.run_ok('synth', 'surface', '--points', 300 + n, '-o', clouds[n])
            scans.append(self.path(f'in{n}.scan'))
            self.run_ok('build', clouds[n], '-o', scans[n])
            bounds = self.json_of('info', hills)['bounds']
            places.append(self.path(f'places{n}.csv'))
            with open(places[n], 'w') as file:
                file.write('# of interest\nname,x,y\n')
                for at in (0.4, 0.6):
                    x, y = (low + (at + n / 20) * (high - low)
                            for low, high in zip(bounds['min'][:2], bounds['max'][:2]))
                    file.write(f'here,{x},{y}\n')
        west, south, _ = bounds['min']
        east, north, _ = bounds['max']
        lines = (f'{west},{south},{east},{north}', f'{west},{north},{east},{south}')
        # Commands that write -o FILE, with different bytes for 0 and 1.
        outputs = {
            'raster.tif': lambda n: ['synth', 'dem', '--size', f'{20 + n}x20'],
            'numbers.xyz': lambda n: ['convert', clouds[n]],
            'numbers.csv': lambda n: ['convert', clouds[n]],
            'points.ply': lambda n: ['convert', clouds[n]],
            'text.ply': lambda n: ['convert', clouds[n], '--format', 'ply-ascii'],
            'points.las': lambda n: ['convert', clouds[n]],
            'points.laz': lambda n: ['convert', clouds[n]],
            'points.copc.laz': lambda n: ['convert', clouds[n]],
            'level.ply': lambda n: ['points', hills, '--level', n],
            'mesh.ply': lambda n: ['mesh', hills, '--level', n],
            'mesh.obj': lambda n: ['mesh', hills, '--level', n],
            'mesh.glb': lambda n: ['mesh', hills, '--level', n],
            'bound.ply': lambda n: ['mesh', hills, '--max-error', 5 + 20 * n],
            'surface.ply': lambda n: ['surface', scans[n]],
            'inside.vtk': lambda n: ['surface', scans[n], '--tetrahedra'],
            'clusters.csv': lambda n: ['cluster', clouds[n]],
            'pairs.csv': lambda n: ['match', clouds[n]],
            'tree.csv': lambda n: ['match', clouds[n], '--tree'],
            'heights.csv': lambda n: ['sample', hills, '--points', places[n]],
            'heights.tif': lambda n: ['raster', hills, '--cell', 30 + 10 * n],
            'profile.csv': lambda n: ['profile', hills, '--line', lines[n]],
            'lines.geojson': lambda n: ['contour', hills, '--interval', 20 + n],
            'picture.png': lambda n: ['render', dem, '--size', f'{64 + n}x48'],
            'store': lambda n: ['build', clouds[n]],
        }
        options = {'labels.txt': ('--labels', lambda n: ['cluster', clouds[n]]),
                   'dendrogram.csv': ('--dendrogram', lambda n: ['cluster', clouds[n], '--method',
                                                                 'complete', '-k', 2]),
                   'smooth.overlay': ('--save-overlay', lambda n: [
                       'mesh', hills, '--smooth', f'taubin:{2 + n}', '-o',
                       self.path(f'smooth{n}.ply'), '--force'])}
        cases = [(name, '-o', command) for name, command in outputs.items()]
        cases += [(name, option, command) for name, (option, command) in options.items()]
        for name, option, command in cases:
            with self.subTest(name):
                out, fresh = self.path(name), self.path('fresh-' + name)
                self.run_ok(*command(1), option, fresh)
                self.run_ok(*command(0), option, out)
                old, new = self.bytes_of(out), self.bytes_of(fresh)
                self.assertNotEqual(old, new)
                if '--force' not in command(0):
                    self.assert_one_line_error(terrace(*command(1), option, out), 1)
                self.assertEqual(self.bytes_of(out), old)
                self.run_ok(*command(1), option, out, '--force')
                self.assertEqual(self.bytes_of(out), new)
                if os.path.isdir(out):
                    continue
                if not self.is_marked(out):
                    # A text file without a mark, as another program may write it.
                    os.remove(out)
                    with open(out, 'wb') as file:
                        file.write(old)
                    result = terrace(*command(1), option, out, '--force')
                    self.assert_one_line_error(result, 1)
                    self.assertIn('not written by terrace', result.stderr)
                    self.assertEqual(self.bytes_of(out), old)
                with open(out, 'w') as file:
                    file.write('A terrace, written by terrace and by hand.\n')
                letter = self.bytes_of(out)
                result = terrace(*command(1), option, out, '--force')
                self.assert_one_line_error(result, 1)
                self.assertIn('not written by terrace', result.stderr)
                self.assertEqual(self.bytes_of(out), letter)

    @staticmethod
    def is_marked(path):
        """True if the format can mark files as written by terrace."""
        return not path.endswith(('.csv', '.txt', '.xyz'))

    @staticmethod
    def bytes_of(path):
        """The bytes of a file, or of all files in a folder by name."""
        if not os.path.isdir(path):
            with open(path, 'rb') as file:
                return file.read()
        return {name: ErrorTest.bytes_of(os.path.join(path, name)) for name in os.listdir(path)}

    def test_force_replaces_the_target_of_a_link(self):
        os.mkdir(self.path('elsewhere'))
        for name in ('a.ply', 'a.xyz'):
            real, link = self.path('elsewhere/' + name), self.path(name)
            os.symlink('elsewhere/' + name, link)
            # The target does not exist yet; the run creates it, like any write to a link.
            self.run_ok('synth', 'uniform', '--points', '10', '-o', link)
            first = self.bytes_of(real)
            self.assert_one_line_error(
                terrace('synth', 'uniform', '--points', '9', '-o', link), 1)
            self.run_ok('synth', 'uniform', '--points', '9', '-o', link, '--force')
            self.assertTrue(os.path.islink(link))
            self.assertNotEqual(self.bytes_of(real), first)
            with open(real, 'w') as file:
                file.write('a letter\n')
            self.assert_one_line_error(
                terrace('synth', 'uniform', '--points', '9', '-o', link, '--force'), 1)
            self.assertEqual(self.bytes_of(real), b'a letter\n')

    def test_a_full_disk_leaves_no_files(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        for args in (['synth', 'dem', '--size', '512x512', '-o', 'a.tif'],
                     ['synth', 'uniform', '--points', '100k', '-o', 'a.ply'],
                     ['synth', 'uniform', '--points', '100k', '-o', 'a.xyz']):
            with self.subTest(args=args):
                result = terrace(*args, cwd=self.folder, preexec_fn=small_files)
                self.assert_one_line_error(result, 1)
                self.assertEqual(os.listdir(self.folder), [])
                self.assertIn(f'terrace: {args[-1]}: ', result.stderr)

    def test_full_disk_errors_name_the_output_and_no_temporary_file(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
        dem, cloud, hills, scan = (self.path(name) for name in ('d.tif', 'c.ply', 'd.terrace', 'c.terrace'))
        self.run_ok('synth', 'dem', '--size', '200x200', '--crs', 'EPSG:32632', '-o', dem)
        self.run_ok('synth', 'surface', '--points', '20000', '-o', cloud)
        self.run_ok('synth', 'surface', '--points', '500', '-o', self.path('few.ply'))
        self.run_ok('build', dem, '-o', hills)
        self.run_ok('build', cloud, '-o', scan)
        inputs = sorted(os.listdir(self.folder))
        west, south, _ = self.json_of('info', hills)['bounds']['min']
        for name, *args in (['o.st', 'build', dem], ['o.st', 'build', cloud, '--order', 'spatial'],
                            ['o.site', 'publish', hills], ['o.site', 'publish', scan, '--repack'],
                            ['o.copc.laz', 'convert', cloud], ['o.laz', 'convert', cloud], ['o.csv', 'convert', cloud],
                            ['o.ply', 'mesh', hills, '--max-error', 1], ['o.glb', 'mesh', hills], ['o.obj', 'mesh', hills],
                            ['o.tif', 'raster', hills], ['o.geojson', 'contour', hills, '--interval', 1],
                            ['o.png', 'render', hills], ['o.ply', 'surface', scan], ['o.vtk', 'surface', scan, '--tetrahedra'],
                            ['o.csv', 'cluster', cloud], ['o.csv', 'match', self.path('few.ply')],
                            ['o.csv', 'profile', hills, '--line', f'{west},{south},{west + 3000},{south + 3000}', '--step', 1]):
            with self.subTest(name=name, args=args):
                result = terrace(*args, '-q', '-o', name, cwd=self.folder, preexec_fn=small_files)
                self.assert_one_line_error(result, 1)
                self.assertRegex(result.stderr, f'^terrace: (./)?{name}: .*File too large; raise the file size limit')
                self.assertNotIn('.tmp-', result.stderr)
                self.assertEqual(sorted(os.listdir(self.folder)), inputs)
        result = terrace('tile', hills, '-q', '-o', 'o.t', '--vertical', 'ellipsoidal', cwd=self.folder, preexec_fn=small_files)
        self.assert_one_line_error(result, 1)
        self.assertRegex(result.stderr, r'^terrace: o\.t(/\d+/\d+/\d+\.terrain)?: .*File too large')
        result = terrace('mesh', hills, '-q', '--max-error', 1, '-o', '-', cwd=self.folder, preexec_fn=small_files)
        self.assertEqual(result.returncode, 1)
        self.assertIn('terrace: standard output: ', result.stderr)

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

    def test_ctrl_c_exits_with_130_and_leaves_no_files(self):
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
    def test_the_rms_step_matches_the_roughness_at_every_size(self):
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

    def test_the_raster_has_the_requested_properties(self):
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
            self.skipTest('gdalinfo is not installed')
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

    def test_rejects_heights_that_do_not_fit(self):
        result = terrace('synth', 'dem', '--size', '64x64', '--roughness', '50', '-o', self.path('a.tif'))
        self.assert_one_line_error(result, 2)
        self.assertIn('float32', result.stderr)


class CloudTest(CommandTest):
    def points(self, *args):
        return self.run_ok('synth', *args, '-o', '-').stdout.splitlines()

    def test_every_kind_has_the_requested_number_of_points(self):
        for kind in ('surface', 'uniform', 'clusters'):
            for count in (1, 7, 2000):
                lines = self.points(kind, '--points', count)
                self.assertEqual(len(lines), count)
                for line in lines[:50]:
                    self.assertEqual(len(line.split()), 3)

    def test_shuffling_only_permutes_points(self):
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

    def test_json_has_the_keys_of_the_contract(self):
        open(self.path('a.xyz'), 'w').write('0 0 1\n1 2 3\n-1 5 2\n')
        info = self.json_of('info', self.path('a.xyz'))
        for key in self.KEYS:
            self.assertIn(key, info)
        self.assertEqual(info['points'], 3)
        self.assertEqual(info['bounds'], {'min': [-1, 0, 1], 'max': [1, 5, 3]})
        self.assertEqual(info['height'], {'min': 1, 'max': 3, 'mean': 2})
        self.assertEqual(info['bytes'], 19)
        # A pipe has no size.
        piped = subprocess.run([TERRACE, 'info', '-', '--json'], input=b'0 0 1\n', capture_output=True, check=True)
        self.assertIsNone(json.loads(piped.stdout)['bytes'])

    def test_text_goes_to_standard_output(self):
        open(self.path('a.xyz'), 'w').write('0 0 1\n')
        result = self.run_ok('info', self.path('a.xyz'))
        self.assertIn('points:', result.stdout)
        self.assertEqual(result.stderr, '')


class NumbersTest(CommandTest):
    def test_text_is_rounded_and_json_is_not(self):
        noise = random.Random(2)
        with open(self.path('cloud.xyz'), 'w') as file:
            for _ in range(3000):
                x, y = noise.uniform(0, 90), noise.uniform(0, 70)
                file.write(f'{x!r} {y!r} {10 * math.sin(x / 9) + y / 7!r}\n')
        with open(self.path('places.csv'), 'w') as file:
            file.write('x,y,z\n')
            file.writelines(f'{noise.uniform(5, 60)!r},{noise.uniform(5, 60)!r},0\n'
                            for _ in range(40))
        dem, store, cloud = self.path('dem.tif'), self.path('dem.store'), self.path('cloud.store')
        runs = [
            ('synth', 'dem', '--size', '700x300', '--type', 'float32', '-o', dem),
            ('synth', 'uniform', '--points', 500, '-o', self.path('some.ply')),
            ('build', dem, '-o', store), ('build', self.path('cloud.xyz'), '-o', cloud),
            ('build', dem, '-o', self.path('dry.store'), '--dry-run'),
            ('info', dem), ('info', store), ('info', cloud), ('info', self.path('cloud.xyz')),
            ('verify', store),
            ('points', store, '--level', 1, '-o', self.path('points.ply')),
            ('mesh', store, '--level', 1, '-o', self.path('mesh.ply')),
            ('mesh', store, '--max-error', 2.7, '-o', self.path('bounded.ply')),
            ('mesh', cloud, '--max-error', 0.123456, '-o', self.path('bounded.ply')),
            ('mesh', store, '--max-points', 300, '-o', self.path('few.ply')),
            ('mesh', store, '--smooth', 'taubin', '-o', self.path('smooth.ply'),
             '--save-overlay', self.path('overlay')),
            ('surface', cloud, '-o', self.path('surface.ply')),
            ('tile', store, '--vertical', 'ignore', '--zoom', '0-10', '-o', self.path('tiles')),
            ('verify', self.path('tiles'), '--store', store, '--vertical', 'ignore'),
            ('verify', self.path('tiles')),
            ('sample', cloud, '--points', self.path('places.csv'), '-o', self.path('heights.csv')),
            ('raster', store, '--value', 'slope', '-o', self.path('slope.tif')),
            ('contour', store, '--interval', 50, '-o', self.path('lines.geojson')),
            ('profile', cloud, '--line', '3.123,4,71.7,61.9', '-o', self.path('profile.csv')),
            ('cluster', self.path('cloud.xyz'), '-o', self.path('clusters.ply')),
            ('cluster', self.path('cloud.xyz'), '--method', 'k-means', '-k', 9, '-o',
             self.path('means.ply')),
            ('match', self.path('places.csv'), '-o', self.path('pairs.csv')),
            ('match', self.path('places.csv'), '--tree', '-o', self.path('tree.csv')),
            ('render', dem, '--view', '200,40', '-o', self.path('dem.png'), '--size', '90x60'),
            ('render', self.path('tree.csv'), '--points', self.path('places.csv'), '-o',
             self.path('tree.png'), '--size', '90x60'),
            ('convert', self.path('cloud.xyz'), '-o', self.path('cloud.csv')),
        ]
        digits = re.compile(r'(?<![\w.])-?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?')
        for args in runs:
            with self.subTest(args[:3]):
                result = self.run_ok(*args, '--force')
                text = (result.stdout + result.stderr).replace(self.folder, '')
                self.assertTrue(text)
                self.assertNotRegex(text, r'\d[eE][+-]?\d')
                for number in digits.findall(text):
                    significant = number.replace(',', '').replace('.', '').lstrip('-0')
                    whole = number.split('.')[0]
                    # Coordinates have ten digits, heights and totals six, all others four.
                    most = 10 if args[0] == 'info' else 6
                    if '.' in number:
                        self.assertLessEqual(len(significant), most, f'{number} in: {text}')
                    elif args[0] != 'info' and len(whole.replace(',', '')) > 4:
                        self.assertIn(',', whole, text)
        exact = self.json_of('mesh', cloud, '--max-error', 0.123456, '-o', self.path('b.ply'))
        self.assertGreater(len(repr(exact['max_error'])), 10)
        shown = self.run_ok('mesh', cloud, '--max-error', 0.123456, '-o', self.path('c.ply')).stderr
        bound = float(re.search(r'within ([\d.]+) m', shown)[1])
        self.assertLessEqual(exact['max_error'], bound)
        self.assertLess(bound, exact['max_error'] + 0.001)


class RenderTest(CommandTest):
    def test_mesh_colours_use_heights_by_area(self):
        """A mesh that is fine in one place has the same colours as the surface without the fine part."""
        def write(path, fine):
            vertices, faces = [], []

            def grid(x0, y0, x1, y1, cells, height):
                first = len(vertices)
                for row in range(cells + 1):
                    for column in range(cells + 1):
                        x, y = x0 + (x1 - x0) * column / cells, y0 + (y1 - y0) * row / cells
                        vertices.append((x, y, height(x, y)))
                for row in range(cells):
                    for column in range(cells):
                        a = first + row * (cells + 1) + column + 1
                        b = a + cells + 1
                        faces.extend(((a, a + 1, b + 1), (a, b + 1, b)))

            # A long slope whose upper end is fine.
            grid(0, 0, 90, 100, 10, lambda x, y: x)
            grid(90, 0, 100, 100, fine, lambda x, y: x)
            with open(path, 'w') as file:
                file.writelines('v %r %r %r\n' % v for v in vertices)
                file.writelines('f %d %d %d\n' % f for f in faces)

        pictures = []
        for fine in (1, 150):
            write(self.path('slope.obj'), fine)
            self.run_ok('render', self.path('slope.obj'), '-o', self.path('a.png'), '--size',
                        '100x100', '--color', 'height', '--force', '--exaggerate', 0.001)
            pictures.append(png_pixels(self.path('a.png'))[2])
        even, dense = ([rows[50][3 * x:3 * x + 3] for x in (10, 30, 50, 70, 85)]
                       for rows in pictures)
        for a, b in zip(even, dense):
            self.assertLess(max(abs(p - q) for p, q in zip(a, b)), 12, (even, dense))
        # From the green of the valley to the grey of the mountains.
        self.assertGreater(max(abs(p - q) for p, q in zip(even[0], even[-1])), 30)

    def test_cloud_colours_use_heights_by_area(self):
        noise = random.Random(3)
        with open(self.path('cloud.xyz'), 'w') as file:
            for _ in range(60000):
                x, y = noise.uniform(0, 100), noise.uniform(0, 100)
                file.write(f'{x!r} {y!r} {x!r}\n')
        store = self.path('cloud.store')
        self.run_ok('build', self.path('cloud.xyz'), '-o', store, '--block', 1000, '--z-weight', 0,
                    '--facility-cost', 1)
        pictures = []
        for options in ([], ['--focus', '90,0,100,100:0']):
            self.run_ok('render', store, '-o', self.path('a.png'), '--size', '100x100', '--color',
                        'height', '--force', '--exaggerate', 0.001, *options)
            pictures.append(png_pixels(self.path('a.png'))[2])
        even, dense = ([sum(rows[y][3 * x] for y in range(20, 80)) / 60 for x in (20, 40, 60, 80)]
                       for rows in pictures)
        for a, b in zip(even, dense):
            self.assertLess(abs(a - b), 30, (even, dense))

    def test_slopes_facing_the_light_are_brighter(self):
        # A roof: its north-western side is lit, the other one is in shadow.
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

    def test_heights_are_exaggerated_on_request(self):
        # A pyramid seen from the south at eye level: stretched twice, it is half as high as it is
        # wide.
        with open(self.path('pyramid.obj'), 'w') as file:
            file.write('v -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nv 0 0 10\n')
            file.write('f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n')
        for factor in (0.5, 1, 2, 4):
            out = self.path('a.png')
            summary = self.json_of('render', self.path('pyramid.obj'), '-o', out, '--force', '--size',
                                   '200x200', '--view', '180,0', '--exaggerate', factor)
            self.assertEqual(summary['exaggeration'], factor)
            _, _, rows = png_pixels(out)
            background = rows[0][:3]
            drawn = [[x for x in range(200) if row[3 * x:3 * x + 3] != background] for row in rows]
            height = sum(1 for row in drawn if row)
            width = max(max(row) for row in drawn if row) - min(min(row) for row in drawn if row) + 1
            self.assertAlmostEqual(height / width, factor / 4, delta=0.04)

    def test_same_picture_for_any_threads(self):
        self.run_ok('synth', 'dem', '--size', '300x300', '-o', self.path('a.tif'))
        pictures = set()
        for threads in (1, 4):
            out = self.path(f'{threads}.png')
            self.run_ok('render', self.path('a.tif'), '-o', out, '--size', '160x120', '--view',
                        '200,40', '--threads', threads)
            pictures.add(open(out, 'rb').read())
        self.assertEqual(len(pictures), 1)

    def test_empty_colours_are_not_shown(self):
        noise = random.Random(5)
        with open(self.path('black.csv'), 'w') as file:
            file.write('x,y,z,red,green,blue\n')
            for _ in range(2000):
                file.write(f'{noise.random() * 50:.2f},{noise.random() * 50:.2f},{noise.random():.2f},0,0,0\n')
        self.run_ok('build', self.path('black.csv'), '-o', self.path('black.store'), '--crs', 'EPSG:32632')
        pictures = []
        for options in ([], ['--color', 'height'], ['--color', 'rgb']):
            self.run_ok('render', self.path('black.store'), '-o', self.path('a.png'), '--size', '100x80',
                        '--force', *options)
            pictures.append(png_pixels(self.path('a.png'))[2])
        self.assertEqual(pictures[0], pictures[1])
        self.assertNotEqual(pictures[0], pictures[2])

    def test_rejects_missing_colours(self):
        self.run_ok('synth', 'uniform', '--points', '50', '-o', self.path('a.ply'))
        for what in ('rgb', 'level', 'class', 'slope'):
            result = terrace('render', self.path('a.ply'), '-o', self.path('a.png'), '--color', what)
            self.assert_one_line_error(result, 2)
            self.assertIn(what, result.stderr)


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], '-v', *sys.argv[1:]])
