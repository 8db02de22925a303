#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the command as a process: pipes, closed descriptors, signals, full disks, names with control
characters, and resources that the system denies.

TERRACE=path/to/terrace process_cli_test.py [CLASS...]
"""

import fcntl
import json
import os
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import unittest

from small_tiff import utm, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
# A library to preload that makes every start of a thread fail.
NO_THREADS = os.environ.get('NO_THREADS')


def terrace(*args, **kwargs):
    """Runs the command; the output is text unless text=False."""
    kwargs.setdefault('text', True)
    kwargs.setdefault('stdout', subprocess.PIPE)
    kwargs.setdefault('stderr', subprocess.PIPE)
    return subprocess.run([TERRACE, *args], timeout=120, **kwargs)


def wait_until(condition):
    """Waits up to a minute until the condition is true; returns its value."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.005)
    raise TimeoutError('waited in vain')


def catches_signals(process):
    """Returns true once SIGTERM has a handler."""
    with open(f'/proc/{process.pid}/status') as status:
        caught = int(re.search(r'SigCgt:\s*(\w+)', status.read()).group(1), 16)
    return caught >> (signal.SIGTERM - 1) & 1


def unread_bytes(descriptor):
    return struct.unpack('i', fcntl.ioctl(descriptor, termios.FIONREAD, b'\0' * 4))[0]


class ProcessTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-process-')
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_ok(self, *args, **kwargs):
        result = terrace(*args, **kwargs)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def start(self, *args, **kwargs):
        """Starts a process; the test kills it if it does not end by itself."""
        kwargs.setdefault('stdout', subprocess.PIPE)
        kwargs.setdefault('stderr', subprocess.PIPE)
        process = subprocess.Popen([TERRACE, *args], **kwargs)

        def clean():
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout, process.stderr):
                if stream:
                    try:
                        stream.close()
                    except BrokenPipeError:
                        pass
        self.addCleanup(clean)
        return process

    def end_of(self, process):
        """Returns the exit code and the messages; keeps the process's input open."""
        try:
            code = process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.fail(f'{process.args} does not end')
        return code, process.stderr.read().decode()

    def points(self, count):
        return ''.join(f'{i * 7919 % 10007} {i * 104729 % 9973} {i % 97}\n' for i in range(count))

    def points_file(self, name='points.xyz', count=300):
        with open(self.path(name), 'w') as file:
            file.write(self.points(count))
        return self.path(name)

    def store(self):
        if not os.path.exists(self.path('store')):
            self.run_ok('build', self.points_file(), '-o', self.path('store'))
        return self.path('store')


class ClosedPipeTest(ProcessTest):
    def run_without_reader(self, *args):
        read_end, write_end = os.pipe()
        os.close(read_end)
        try:
            return terrace(*args, stdout=write_end)
        finally:
            os.close(write_end)

    def test_errors_keep_their_exit_code(self):
        store = self.store()
        for args in (['info', self.path('none')], ['info', self.path('none'), '--json'],
                     ['points', store, '-o', self.path('missing/x.xyz')],
                     ['convert', self.path('none.xyz'), '-o', '-'],
                     ['sample', self.path('none')], ['verify', self.path('none')]):
            with self.subTest(args=args):
                result = self.run_without_reader(*args)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertEqual(result.stderr.count('\n'), 1, result.stderr)

    def test_verify_names_both_kinds_of_folders_that_it_checks(self):
        for path in self.path('none'), self.folder:
            result = terrace('verify', path)
            self.assertEqual(result.returncode, 1)
            self.assertEqual(result.stderr, f'terrace: {path}: there is neither a store nor a tile set here; '
                             'give a folder written by terrace build or terrace tile\n')

    def test_problems_found_by_verify_keep_their_exit_code(self):
        store = self.store()
        level = os.path.join(store, sorted(n for n in os.listdir(store) if 'manifest' not in n)[0])
        data = bytearray(open(level, 'rb').read())
        data[len(data) // 2] ^= 1
        open(level, 'wb').write(data)
        self.assertEqual(self.run_without_reader('verify', store, '--json').returncode, 1)

    def test_output_to_a_closed_pipe_ends_quietly(self):
        points, store = self.points_file(), self.store()
        places = self.path('places.csv')
        open(places, 'w').write('x,y\n5,5\n')
        for args in (['--version'], ['info', points], ['info', points, '--json'],
                     ['convert', points, '-o', '-'], ['points', store, '-o', '-'],
                     ['mesh', store, '-o', '-'], ['sample', store, '--points', places],
                     ['match', points, '-o', '-'], ['cluster', points, '--labels', '-'],
                     ['render', store, '-o', '-', '--size', '64x64'],
                     ['cluster', points, '--method', 'single', '--dendrogram', '-']):
            with self.subTest(args=args):
                result = self.run_without_reader(*args)
                self.assertEqual((result.returncode, result.stderr), (0, ''))

    def test_standard_output_on_a_full_disk_is_an_error(self):
        points, store = self.points_file(), self.store()
        for args in (['--version'], ['info', points], ['info', points, '--json'],
                     ['convert', points, '-o', '-'], ['points', store, '-o', '-'],
                     ['match', points, '-o', '-'], ['cluster', points, '--labels', '-'],
                     ['render', store, '-o', '-', '--size', '64x64'],
                     ['cluster', points, '--method', 'single', '--dendrogram', '-']):
            with self.subTest(args=args), open('/dev/full', 'w') as full:
                result = terrace(*args, stdout=full)
                self.assertEqual(result.returncode, 1)
                self.assertIn('standard output: cannot write: No space left', result.stderr)

    def test_pictures_can_go_to_standard_output(self):
        result = self.run_ok('render', self.store(), '-o', '-', '--size', '64x64', text=False,
                             cwd=self.folder)
        self.assertTrue(result.stdout.startswith(b'\x89PNG'))
        self.assertNotIn('-', os.listdir(self.folder))


class ClosedDescriptorTest(ProcessTest):
    def test_no_file_uses_the_descriptor_of_a_standard_stream(self):
        fifo = self.path('fifo')
        os.mkfifo(fifo)
        for closed in ((0,), (1,), (2,), (0, 1), (1, 2), (0, 1, 2)):
            with self.subTest(closed=closed):
                def close(which=closed):
                    for descriptor in which:
                        os.close(descriptor)
                process = self.start('convert', fifo, '-o', self.path('out.ply'), '--force',
                                     '--progress', 'json', stdout=None, stderr=None,
                                     preexec_fn=close)
                with open(fifo, 'w') as producer:
                    producer.write(self.points(3000))
                    producer.flush()
                    # From here on the output is open.
                    wait_until(lambda: any('.tmp-' in name for name in os.listdir(self.folder)))
                    for descriptor in closed:
                        self.assertEqual(os.readlink(f'/proc/{process.pid}/fd/{descriptor}'),
                                         '/dev/null')
                self.assertEqual(process.wait(timeout=60), 0)

    def test_using_a_closed_stream_is_an_error(self):
        points, store = self.points_file(), self.store()
        for args in (['info', points], ['info', points, '--json'], ['--version'],
                     ['convert', points, '-o', '-'], ['points', store, '-o', '-'],
                     ['render', store, '-o', '-', '--size', '64x64'],
                     ['match', points, '-o', '-']):
            with self.subTest(args=args):
                result = terrace(*args, stdout=None, preexec_fn=lambda: os.close(1))
                self.assertEqual((result.returncode, result.stderr.split(';')[0]),
                                 (1, 'terrace: standard output: is closed'))
        for args in (['info', '-'], ['convert', '-', '-o', self.path('x.xyz')], ['sample', store]):
            with self.subTest(args=args):
                result = terrace(*args, preexec_fn=lambda: os.close(0))
                self.assertEqual((result.returncode, result.stderr.split(';')[0]),
                                 (1, 'terrace: standard input: is closed'))


class WaitTest(ProcessTest):
    """A wait for another program ends at once on a signal or on an error elsewhere."""

    def readers(self, source):
        store = self.store()
        return (['info', source], ['convert', source, '-o', self.path('out.ply')],
                ['build', source, '-o', self.path('built')],
                ['cluster', source, '-o', self.path('out.csv')],
                ['match', source, '-o', self.path('out.csv')],
                ['render', source, '-o', self.path('out.png')],
                ['sample', store, '--points', source])

    def assert_interrupted(self, process):
        code, error = self.end_of(process)
        self.assertEqual(code, 130, error)
        self.assertEqual(error.count('\n'), 1, error)
        self.assertIn('again', error)
        self.assertFalse([n for n in os.listdir(self.folder) if n.startswith(('out', 'built', '.'))])

    def test_a_signal_ends_the_wait_for_an_idle_producer(self):
        for args in self.readers('-'):
            for stop in (signal.SIGINT, signal.SIGTERM):
                with self.subTest(args=args, signal=stop):
                    process = self.start(*args, stdin=subprocess.PIPE)
                    wait_until(lambda: catches_signals(process))
                    process.stdin.write(self.points(3000).encode())
                    process.stdin.flush()
                    wait_until(lambda: unread_bytes(process.stdin) == 0)
                    process.send_signal(stop)
                    self.assert_interrupted(process)

    def test_a_signal_ends_the_wait_for_a_writer(self):
        fifo = self.path('fifo')
        os.mkfifo(fifo)
        for args in self.readers(fifo):
            if args[0] == 'render':
                continue  # render detects a pipe's format from its content; see the test with data
            with self.subTest(args=args):
                process = self.start(*args)
                wait_until(lambda: catches_signals(process))
                process.send_signal(signal.SIGTERM)
                self.assert_interrupted(process)

    def test_a_signal_ends_the_wait_for_the_reader_of_standard_output(self):
        for args in (['synth', 'uniform', '--points', '1M', '-o', '-'],
                     ['convert', self.points_file(count=100000), '-o', '-']):
            with self.subTest(args=args):
                process = self.start(*args)
                # The pipe is full, so the process waits for space.
                wait_until(lambda: unread_bytes(process.stdout) >= 60000)
                process.send_signal(signal.SIGTERM)
                self.assert_interrupted(process)

    def test_a_named_pipe_is_read_from_its_first_writer_to_its_last(self):
        fifo = self.path('fifo')
        os.mkfifo(fifo)
        process = self.start('convert', fifo, '-o', self.path('out.xyz'))
        wait_until(lambda: catches_signals(process))
        with open(fifo, 'w') as producer:
            producer.write('1 2 3\n')
            producer.flush()
            wait_until(lambda: unread_bytes(producer) == 0)
            producer.write('4 5 6\n')
        code, error = self.end_of(process)
        self.assertEqual(code, 0, error)
        self.assertEqual(open(self.path('out.xyz')).read(), '1 2 3\n4 5 6\n')

    def test_a_non_blocking_pipe_is_waited_for(self):
        read_end, write_end = os.pipe()
        os.set_blocking(read_end, False)
        process = self.start('convert', '-', '-o', self.path('out.xyz'), stdin=read_end)
        os.close(read_end)
        wait_until(lambda: catches_signals(process))
        with open(write_end, 'w') as producer:
            producer.write('1 2 3\n')
        code, error = self.end_of(process)
        self.assertEqual(code, 0, error)

    def test_a_full_disk_is_reported_while_the_producer_is_idle(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (40000, 40000))
        for args in (['convert', '-', '-o', self.path('out.ply')],
                     ['build', '-', '-o', self.path('built'), '--block', '1000', '--threads', '2']):
            with self.subTest(args=args):
                process = self.start(*args, stdin=subprocess.PIPE, preexec_fn=small_files)

                def feed():
                    try:
                        process.stdin.write(self.points(400000).encode())
                        process.stdin.flush()
                    except BrokenPipeError:
                        pass
                feeder = threading.Thread(target=feed)
                feeder.start()
                code, error = self.end_of(process)
                feeder.join()
                self.assertEqual(code, 1, error)
                self.assertIn('File too large', error)
                self.assertFalse([n for n in os.listdir(self.folder)
                                  if n.startswith(('out', 'built', '.'))])

    def test_a_raster_in_a_pipe_is_copied_to_a_temporary_file(self):
        raster, fifo = self.path('dem.tif'), self.path('fifo')
        self.run_ok('synth', 'dem', '--size', '64x64', '-o', raster)
        os.mkfifo(fifo)
        process = self.start('info', fifo)
        with open(fifo, 'wb') as producer, open(raster, 'rb') as file:
            producer.write(file.read())
        code, error = self.end_of(process)
        self.assertEqual(code, 0, error)
        # A signal ends the wait for the rest of it.
        process = self.start('info', fifo)
        with open(fifo, 'wb') as producer, open(raster, 'rb') as file:
            producer.write(file.read(1000))
            producer.flush()
            wait_until(lambda: unread_bytes(producer) == 0)
            process.send_signal(signal.SIGINT)
            code, error = self.end_of(process)
        self.assertEqual(code, 130, error)


class StopTest(ProcessTest):
    """Long work ends soon after a signal, in any loop, and leaves no files."""

    def cloud(self):
        if not os.path.exists(self.path('cloud')):
            self.run_ok('synth', 'clusters', '--points', '200000', '-o', self.path('cloud.las'))
            self.run_ok('build', self.path('cloud.las'), '-o', self.path('cloud'))
        return self.path('cloud')

    def extent(self):
        box = json.loads(self.run_ok('info', self.cloud(), '--json').stdout)['bounds']
        return box['min'], box['max']

    def dem(self):
        if not os.path.exists(self.path('dem')):
            self.run_ok('synth', 'dem', '--size', '200x200', '-o', self.path('dem.tif'))
            self.run_ok('build', self.path('dem.tif'), '-o', self.path('dem'))
        return self.path('dem')

    def sparse(self):
        """Builds a store of two small rasters far apart: 400 million cells, nearly all without data."""
        if not os.path.exists(self.path('sparse')):
            for name, away in (('a.tif', 0), ('b.tif', 19900)):
                write_tiff(self.path(name), 100, 100, [float(i % 97) for i in range(10000)],
                           corner=(500000 + away, 5200000 - away), cell=1, keys=utm(32))
            self.run_ok('build', self.path('a.tif'), self.path('b.tif'), '-o', self.path('sparse'))
        return self.path('sparse')

    def assert_stopped(self, output, *args):
        with self.subTest(args=args):
            process = self.start(*args, '-o', self.path(output), '-q')
            wait_until(lambda: any(name.startswith('.' + output) for name in os.listdir(self.folder)))
            time.sleep(0.5)  # until it is at work
            self.assertIsNone(process.poll(), 'it ended by itself')
            process.send_signal(signal.SIGTERM)
            code, error = self.end_of(process)
            self.assertEqual(code, 130, error)
            self.assertEqual(error.count('\n'), 1, error)
            self.assertFalse([name for name in os.listdir(self.folder) if output in name])

    def test_a_raster_of_a_cloud_in_memory(self):
        low, high = self.extent()
        for method in ('linear', 'natural', 'nearest'):
            self.assert_stopped('out.tif', 'raster', self.cloud(), '--method', method, '--cell',
                                str((high[0] - low[0]) / 50000))

    def test_heights_at_places_of_a_cloud_in_memory(self):
        low, high = self.extent()
        with open(self.path('places.csv'), 'w') as file:
            file.write('x,y\n')
            for i in range(2000000):
                at = (i * 0.7548776662466927 % 1, i * 0.5698402909980532 % 1)
                file.write('%f,%f\n' % tuple(low[k] + at[k] * (high[k] - low[k]) for k in (0, 1)))
        self.assert_stopped('out.csv', 'sample', self.cloud(), '--method', 'natural', '--points',
                            self.path('places.csv'))

    def test_a_raster_of_voids(self):
        self.assert_stopped('out.tif', 'raster', self.sparse())
        self.assert_stopped('out.tif', 'raster', self.sparse(), '--method', 'natural')

    def test_contours_of_many_levels(self):
        self.assert_stopped('out.geojson', 'contour', self.dem(), '--interval', '0.001', '--own-crs')
        low, high = self.extent()
        self.assert_stopped('out.geojson', 'contour', self.cloud(), '--own-crs', '--interval',
                            str((high[2] - low[2]) / 1e6))

    def test_a_profile_of_many_steps(self):
        self.assert_stopped('out.csv', 'profile', self.dem(), '--line', '400000,5200000,405000,5195000',
                            '--step', '0.00001')

    def test_endless_work_is_refused(self):
        line = ['--line', '400000,5200000,405000,5195000']
        for args, what in ((['profile', self.dem(), *line, '--step', '1e-17'], '--step is too small'),
                           (['profile', self.dem(), *line, '--step', '1e-300'], '--step is too small'),
                           (['profile', self.dem(), '--line', '0,0,1e12,1e12'], 'the line is too long'),
                           (['contour', self.dem(), '--interval', '1e-6'], 'levels of 0.000001'),
                           (['raster', self.dem(), '--cell', '0.0003'], 'of memory')):
            with self.subTest(args=args):
                result = terrace(*args, '-o', self.path('out'))
                self.assertIn(result.returncode, (1, 2))
                self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
                self.assertIn(what, result.stderr)
                self.assertFalse([name for name in os.listdir(self.folder) if 'out' in name])

    def test_a_long_linkage_is_cut_short(self):
        """Single linkage of three million points runs as one step."""
        cloud = self.path('large.las')
        self.run_ok('synth', 'uniform', '--points', '3M', '-o', cloud)
        process = self.start('cluster', cloud, '--method', 'single', '-o', self.path('out.csv'), '-k', '2')
        wait_until(lambda: catches_signals(process))
        time.sleep(3)
        self.assertIsNone(process.poll(), 'it ended by itself')
        process.send_signal(signal.SIGTERM)
        code, error = self.end_of(process)
        self.assertEqual(code, 130, error)
        self.assertEqual(error.count('\n'), 1, error)


class OptionTest(ProcessTest):
    """Every option of every verb, as listed in its help."""

    def setUp(self):
        super().setUp()
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)  # an option may take its value for the name of an output

    def commands(self):
        """Each verb with valid arguments, except its output."""
        points, store, dem = self.points_file(), self.store(), self.path('dem.tif')
        self.run_ok('synth', 'dem', '--size', '64x64', '-o', dem)
        self.run_ok('build', dem, '-o', self.path('raster'))
        self.run_ok('build', self.points_file('others.xyz', 200), '-o', self.path('others'))
        places = self.path('places.csv')
        with open(places, 'w') as file:
            file.write('x,y\n5,5\n')
        out = lambda name: ['-o', self.path(name)]
        return {'build': ['build', points, *out('built')],
                'merge': ['merge', store, self.path('others'), *out('merged')], 'info': ['info', points],
                'verify': ['verify', store], 'points': ['points', store, *out('out.xyz')],
                'mesh': ['mesh', store, *out('out.ply')],
                'surface': ['surface', store, *out('out.ply')],
                'tile': ['tile', self.path('raster'), *out('tiles'), '--vertical', 'ignore'],
                'sample': ['sample', store, '--points', places, *out('out.csv')],
                'raster': ['raster', store, *out('out.tif')],
                'profile': ['profile', store, '--line', '1,1,90,90', *out('out.csv')],
                'contour': ['contour', store, '--interval', '10', *out('out.json')],
                'cluster': ['cluster', points, *out('out.csv')],
                'match': ['match', points, *out('out.csv')],
                'render': ['render', store, *out('out.png'), '--size', '64x64'],
                'synth dem': ['synth', 'dem', '--size', '64x64', *out('out.tif')],
                'synth uniform': ['synth', 'uniform', '--points', '10', *out('out.xyz')],
                'publish': ['publish', store, *out('out.site')],
                'convert': ['convert', points, *out('out.ply')]}

    def options_of(self, verb):
        for line in self.run_ok(verb, '--help').stdout.splitlines():
            found = re.match(r'  (?:-\w,)?(--?[\w-]+) \S', line)
            if found:
                yield found.group(1)

    def test_every_verb_is_covered(self):
        listed = re.findall(r'^  (\w+) +\S', self.run_ok('--help').stdout.split('Verbs:')[1], re.M)
        tried = {name.split()[0] for name in self.commands()}
        # `view` serves until it is stopped; view_cli_test.py tests it.
        self.assertEqual(set(listed) - {'terrace', 'view'}, tried)

    def test_nan_and_infinity_are_refused(self):
        numeric = set()
        for name, command in self.commands().items():
            for option in self.options_of(command[0]):
                # Options that reject a word take numbers or fixed names.
                word = terrace(*command, f'{option}=bogus' if option[1] == '-' else option + 'bogus')
                if word.returncode != 2:
                    for out in ('out', 'built', 'tiles'):
                        for made in os.listdir(self.folder):
                            if made.startswith(out):
                                (shutil.rmtree if os.path.isdir(self.path(made)) else os.remove)(
                                    self.path(made))
                    continue
                numeric.add(option)
                for value in ('nan', 'inf', '-inf'):
                    with self.subTest(name=name, option=option, value=value):
                        given = f'{option}={value}' if option[1] == '-' else option + value
                        result = terrace(*command, given)
                        self.assertEqual(result.returncode, 2, result.stderr)
                        if not option.endswith(('crs', 'weight', 'iterations')):
                            self.assertIn(option.lstrip('-').replace('input-', 'input '), result.stderr)
        self.assertLessEqual({'--facility-cost', '--z-weight', '--outlier-price', '--height',
                              '--max-error', '--cell', '--step', '--interval', '--exaggerate',
                              '--max-edge', '--seconds', '--hurst', '--roughness', '--threads',
                              '--memory', '--seed', '-k', '--band', '--block'}, numeric)

    def test_negative_and_zero_counts_are_refused(self):
        counts = {'-k', '--band', '--batch', '--block', '--threads'}
        tried = set()
        for name, command in self.commands().items():
            for option in set(self.options_of(command[0])) & counts:
                tried.add(option)
                for value in ('0', '-1', '18446744073709551615'):
                    with self.subTest(name=name, option=option, value=value):
                        given = f'{option}={value}' if option[1] == '-' else option + value
                        result = terrace(*command, given)
                        self.assertEqual(result.returncode, 2, result.stderr)
                        self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
        self.assertEqual(tried, counts)
        for value in ('-1', '18446744073709551615'):
            result = terrace('points', self.store(), '-o', self.path('out.xyz'), '--near', '5,5',
                             '-k' + value)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn('-k: Value', result.stderr)

    def test_json_is_refused_if_the_output_goes_to_standard_output(self):
        for name, command in self.commands().items():
            if '-o' not in command:
                continue
            with self.subTest(name=name):
                at = command.index('-o')
                there = [*command[:at + 1], '-', *command[at + 2:], '--json']
                result = terrace(*there)
                self.assertEqual((result.returncode, result.stdout), (2, ''))
                self.assertEqual(result.stderr.count('\n'), 1, result.stderr)
        # Without -o, the lines go to standard output.
        self.assertEqual(terrace('sample', self.store(), '--json').returncode, 2)
        for option in ('--labels', '--dendrogram'):
            result = terrace('cluster', self.points_file(), '--method', 'single', '-k', '3', option,
                             '-', '--json')
            self.assertEqual((result.returncode, result.stdout), (2, ''))


    def test_planned_features_are_not_available_yet(self):
        for args in (['compact', 'a.terrace'], ['build', 'a.xyz', '-o', 'b', '--plan', 'c.json'],
                     ['build', 'a.xyz', '-o', 'b', '--part=1/2'], ['build', 'a.xyz', '-o', 'b', '--resume'],
                     ['mesh', 'a.terrace', '--base', '-o', 'b.ply'],
                     ['points', 'a.terrace', '--max-points', '5', '-o', 'b.ply']):
            with self.subTest(args=args):
                result = subprocess.run([TERRACE, *args], capture_output=True, text=True, timeout=60)
                self.assertEqual((result.returncode, result.stdout), (2, ''))
                self.assertIn('is not available yet', result.stderr)


class NameTest(ProcessTest):
    ESCAPE = '\x1b[31m'

    def assert_plain(self, text):
        self.assertNotRegex(text, '[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]')

    def test_control_characters_in_names_are_escaped(self):
        name = f'a{self.ESCAPE}\r\u009b2J\u202e.xyz'
        points = self.points_file(name)
        for args in (['info', points], ['info', points + 'x'], ['cluster', points, '-o', 'x.csv', '-v'],
                     ['convert', points, '-o', self.path('b' + name)], ['points', points, '-o', self.path('x.xyz')],
                     ['info', points, '--no-such' + self.ESCAPE], ['info', points, '--memory', self.ESCAPE],
                     ['build', points, '-o', self.path('s' + self.ESCAPE), '--crs', self.ESCAPE],
                     [self.ESCAPE]):
            with self.subTest(args=args):
                result = terrace(*args, cwd=self.folder)
                self.assert_plain(result.stdout)
                self.assert_plain(result.stderr)
                if result.stderr:
                    self.assertIn('\\x', result.stderr)

    def test_standard_input_is_named_in_words(self):
        for text, cause in (('', 'the file is empty'),
                            ('This is prose.\n', 'neither content nor name shows its format')):
            with self.subTest(text=text):
                result = terrace('info', '-', input=text)
                self.assertEqual(result.returncode, 1)
                self.assertTrue(result.stderr.startswith(f'terrace: standard input: {cause}; '),
                                result.stderr)

    def test_a_newline_in_a_name_does_not_start_a_line(self):
        result = terrace('info', self.path('none\nterrace: all is well'))
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.count('\n'), 1, result.stderr)

    def test_control_characters_in_file_contents_are_escaped(self):
        hostile = self.path('hostile.ply')
        with open(hostile, 'w') as file:
            file.write(f'ply\nformat ascii 1.0\ncomment {self.ESCAPE}red\x07\u009b\n'
                       'element vertex 3\nproperty double x\nproperty double y\nproperty double z\n'
                       f'property float co{self.ESCAPE}l\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n')
        wkt = self.path('crs.prj')
        with open(wkt, 'w') as file:
            file.write(f'LOCAL_CS["{self.ESCAPE}",UNIT["metre",1]]')
        store = self.path('hostile-store')
        for args in (['info', hostile], ['build', hostile, '-o', store], ['info', store],
                     ['cluster', hostile, '-o', self.path('o.ply'), '--weight', 'none'],
                     ['build', hostile, '-o', self.path('p'), '--crs', wkt]):
            with self.subTest(args=args):
                result = terrace(*args)
                self.assert_plain(result.stdout)
                self.assert_plain(result.stderr)
        self.assertIn(self.ESCAPE, ' '.join(
            json.loads(self.run_ok('info', hostile, '--json').stdout)['comments']))

    def test_names_that_are_not_utf_8(self):
        name = os.fsencode(self.folder) + b'/caf\xe9.xyz'
        with open(name, 'w') as file:
            file.write('1 2 3\n')
        self.assertIn('"points":1', self.run_ok('info', name, '--json').stdout)
        result = terrace('info', name + b'x')
        self.assertEqual(result.returncode, 1)
        self.assertIn('caf\\xe9', result.stderr)

    def test_names_of_255_bytes_can_be_written(self):
        store = self.store()
        for ending, args in (('.tif', ['synth', 'dem', '--size', '64x64']),
                             ('.xyz', ['synth', 'uniform', '--points', '10']),
                             ('.ply', ['mesh', store]), ('.obj', ['mesh', store, '--max-error', '50',
                                                                 '--duplicates', 'mean']),
                             ('.png', ['render', store, '--size', '64x64']),
                             ('', ['build', self.points_file()])):
            for length in (240, 241, 255):
                with self.subTest(ending=ending, length=length):
                    out = self.path('n' * (length - len(ending)) + ending)
                    self.run_ok(*args, '-o', out)
                    self.assertTrue(os.path.exists(out))
        self.assertFalse([n for n in os.listdir(self.folder) if n.startswith('.')])


@unittest.skipUnless(NO_THREADS, 'NO_THREADS is not set')
class NoThreadTest(ProcessTest):
    """If the system denies new threads, the main thread does all the work."""

    def test_results_are_the_same(self):
        points, dem, raster = self.points_file(count=4000), self.path('dem.tif'), self.path('raster')
        self.run_ok('synth', 'dem', '--size', '600x600', '-o', dem)
        self.run_ok('build', dem, '-o', raster)
        scan, store = self.path('scan.ply'), self.path('scan')
        self.run_ok('synth', 'surface', '--points', '30000', '-o', scan)
        self.run_ok('build', scan, '-o', store)
        commands = {'d.tif': ['synth', 'dem', '--size', '600x600'],
                    'p.ply': ['synth', 'surface', '--points', '10000'], 's': ['build', points],
                    'c.csv': ['cluster', points], 'k.csv': ['cluster', points, '--method', 'k-means', '-k', '9'],
                    'l.csv': ['cluster', self.points_file('few.xyz', 2000), '--method', 'complete', '-k', '9'],
                    'm.csv': ['match', points], 't.csv': ['match', points, '--tree'],
                    'h.csv': ['match', self.path('few.xyz'), '--method', 'monte-carlo', '--iterations', '9'],
                    'a.ply': ['mesh', raster, '--max-error', '5'],
                    'f.ply': ['surface', store], 'e.tif': ['raster', raster, '--cell', '50'],
                    'r.png': ['render', dem, '--size', '300x300'],
                    'v.json': ['contour', raster, '--interval', '50'],
                    'x.ply': ['convert', points]}
        for name, command in commands.items():
            with self.subTest(command=command):
                contents = []
                for kind, more in (('with', {}), ('without', {'LD_PRELOAD': NO_THREADS})):
                    out = self.path(kind + name)
                    self.run_ok(*command, '-o', out, '--threads', '4', env={**os.environ, **more})
                    files = ([out] if os.path.isfile(out) else
                             sorted(os.path.join(out, n) for n in os.listdir(out)))
                    contents.append([open(file, 'rb').read() for file in files])
                self.assertEqual(contents[0], contents[1])


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], '-v', *sys.argv[1:]])
