#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the rules of the command line for all verbs: help, errors, --force, signals, numbers in texts.

TERRACE=path/to/terrace cli_test.py [CLASS...]
"""

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
import time
import unittest
import zlib

TERRACE = os.environ.get('TERRACE', 'terrace')

# All verbs, in the order of --help.
VERBS = ['build', 'merge', 'info', 'verify', 'points', 'mesh', 'surface', 'tile', 'sample', 'raster',
         'profile', 'contour', 'cluster', 'match', 'render', 'view', 'publish', 'synth', 'convert']


def terrace(*args, **kwargs):
    """Runs the command; the output is text unless text=False."""
    kwargs.setdefault('text', True)
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, timeout=120, **kwargs)


def png_pixels(path):
    """Returns width, height and rows of an 8-bit RGB PNG without interlacing. Uses no library that the writer
    uses too."""
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
        """Returns the standard error of a run that receives points until it has printed something, at most a
        million."""
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

    def commands_by_output(self):
        """Makes inputs. Returns {output: (option, command)}, where command(0) and command(1) return arguments that
        write different bytes to the output that follows the option."""
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
        return {**{name: ('-o', command) for name, command in outputs.items()}, **options}

    def assert_not_replaced(self, command, option, out):
        """Asserts that --force does not replace a file that terrace did not write."""
        before = self.bytes_of(out)
        result = terrace(*command(1), option, out, '--force')
        self.assert_one_line_error(result, 1)
        self.assertIn('not written by terrace', result.stderr)
        self.assertEqual(self.bytes_of(out), before)

    def test_every_output_can_be_replaced_with_force(self):
        for name, (option, command) in self.commands_by_output().items():
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
                    self.assert_not_replaced(command, option, out)
                with open(out, 'w') as file:
                    file.write('A terrace, written by terrace and by hand.\n')
                self.assert_not_replaced(command, option, out)

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
    def runs(self, store, cloud):
        """Makes inputs. Returns the arguments of commands; they write a raster's store and a cloud's store to these paths."""
        noise = random.Random(2)
        with open(self.path('cloud.xyz'), 'w') as file:
            for _ in range(3000):
                x, y = noise.uniform(0, 90), noise.uniform(0, 70)
                file.write(f'{x!r} {y!r} {10 * math.sin(x / 9) + y / 7!r}\n')
        with open(self.path('places.csv'), 'w') as file:
            file.write('x,y,z\n')
            file.writelines(f'{noise.uniform(5, 60)!r},{noise.uniform(5, 60)!r},0\n'
                            for _ in range(40))
        dem = self.path('dem.tif')
        return [
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

    def test_text_is_rounded_and_json_is_not(self):
        store, cloud = self.path('dem.store'), self.path('cloud.store')
        digits = re.compile(r'(?<![\w.])-?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?')
        for args in self.runs(store, cloud):
            with self.subTest(args[:3]):
                result = self.run_ok(*args, '--force')
                text = (result.stdout + result.stderr).replace(self.folder, '')
                self.assertTrue(text)
                self.assertNotRegex(text, r'\d[eE][+-]?\d')
                for number in digits.findall(text):
                    significant = number.replace(',', '').replace('.', '').lstrip('-0')
                    integer_part = number.split('.')[0]
                    # Coordinates have ten digits, heights and totals six, all others four.
                    max_digits = 10 if args[0] == 'info' else 6
                    if '.' in number:
                        self.assertLessEqual(len(significant), max_digits, f'{number} in: {text}')
                    elif args[0] != 'info' and len(integer_part.replace(',', '')) > 4:
                        self.assertIn(',', integer_part, text)
        exact = self.json_of('mesh', cloud, '--max-error', 0.123456, '-o', self.path('b.ply'))
        self.assertGreater(len(repr(exact['max_error'])), 10)
        shown = self.run_ok('mesh', cloud, '--max-error', 0.123456, '-o', self.path('c.ply')).stderr
        bound = float(re.search(r'within ([\d.]+) m', shown)[1])
        self.assertLessEqual(exact['max_error'], bound)
        self.assertLess(bound, exact['max_error'] + 0.001)


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], '-v', *sys.argv[1:]])
