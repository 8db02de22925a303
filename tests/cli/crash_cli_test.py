#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills the command at each write, sync, rename and removal in turn; the old or the new output must remain.

TERRACE=path/to/terrace FAULT_SHIM=path/to/libfault_shim.so crash_cli_test.py [CLASS...]
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

from tile_case import TERRACE, NODATA, Dem, terrace

SHIM = os.environ['FAULT_SHIM']
ENDLESS = 2000  # more steps than any command here has


def files_below(folder):
    """Returns {name: bytes} of all files below a folder."""
    found = {}
    for path, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(path, name), 'rb') as file:
                found[os.path.relpath(os.path.join(path, name), folder)] = file.read()
    return found


class CrashCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = tempfile.mkdtemp(prefix='terrace-crash-')
        cls.addClassCleanup(shutil.rmtree, cls.root)
        # Inputs that no test changes.
        cls.run_ok('synth', 'dem', '--size', '24x20', '-o', cls.input('a.tif'))
        cls.run_ok('synth', 'dem', '--size', '24x20', '--seed', '2', '-o', cls.input('b.tif'))
        Dem(8, 6, 10.13, 46.71, 0.01, height=lambda c, r: NODATA).write(cls.input('void.tif'))

    def setUp(self):
        self.folder = tempfile.mkdtemp(dir=self.root)

    @classmethod
    def input(cls, name):
        return os.path.join(cls.root, name)

    def path(self, name):
        return os.path.join(self.folder, name)

    @classmethod
    def run_ok(cls, *args):
        result = terrace(*args)
        assert result.returncode == 0, (args, result.stderr)
        return result

    def environment(self, step=0, kind='kill', exchange=True):
        env = dict(os.environ, LD_PRELOAD=SHIM, FAULT_STEP=str(step), FAULT_KIND=kind,
                   FAULT_LOG=self.input('steps'))
        if not exchange:
            env['FAULT_NO_EXCHANGE'] = '1'
        return env

    def die_everywhere(self, start, command, check, exchange=True, least=8):
        """Kills `command` at each step in turn, each time in a copy of the folder `start`, and calls
        check(step) there. Asserts that it has more than `least` steps, of all kinds."""
        for kind in ('kill', 'power'):
            for step in range(1, ENDLESS):
                shutil.rmtree(self.folder)
                shutil.copytree(start, self.folder, symlinks=True)
                if os.path.exists(self.input('steps')):
                    os.remove(self.input('steps'))
                result = terrace(*command, cwd=self.folder,
                                 env=self.environment(step, kind, exchange))
                if result.returncode == 0:
                    break
                self.assertEqual(result.returncode, -signal.SIGKILL, result.stderr)
                with self.subTest(kind=kind, step=step):
                    check(step)
            self.assertGreater(step - 1, least)
            with open(self.input('steps'), encoding='ascii') as file:
                steps = file.read().split()
            self.assertEqual(len(steps), step - 1)
            self.assertLessEqual({'create', 'write', 'sync'}, set(steps))
            self.assertTrue({'rename', 'link'} & set(steps), steps)

    def start(self):
        """Returns an empty folder for the files that exist before the command runs."""
        return tempfile.mkdtemp(dir=self.root)


class StoreCrashTest(CrashCase):
    BLOCK = ('--block', '100', '--threads', '1')

    def folder_after_build(self, dem):
        folder = self.start()
        self.run_ok('build', self.input(dem), '-o', os.path.join(folder, 's'), *self.BLOCK)
        return folder

    def build(self, *options):
        return ('build', self.input('b.tif'), '-o', 's', *self.BLOCK, *options)

    def test_a_killed_build_leaves_a_complete_store_or_none(self):
        new = files_below(self.folder_after_build('b.tif'))

        def check(_):
            there = os.path.exists(self.path('s'))
            if there:
                self.assertEqual(files_below(self.path('s')),
                                 {name[2:]: data for name, data in new.items()})
            result = terrace(*self.build(*(['--force'] if there else [])), cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(files_below(self.folder), new)
            self.assertEqual(os.listdir(self.folder), ['s'])

        self.die_everywhere(self.start(), self.build(), check)

    def test_a_killed_dry_run_leaves_no_files(self):
        def check(_):
            result = terrace(*self.build('--dry-run'), cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(os.listdir(self.folder), [])

        trial = self.build('--dry-run')
        for step in range(1, ENDLESS):
            result = terrace(*trial, cwd=self.folder, env=self.environment(step))
            if result.returncode == 0:
                break
            self.assertEqual(result.returncode, -signal.SIGKILL, result.stderr)
            with self.subTest(step=step):
                check(step)
        self.assertGreater(step, 8)

    def replace(self, exchange):
        """With `exchange`, the name always refers to a store. Without it, opening the store or starting the
        next writer, even one that fails, restores the old store under its name."""
        start = self.folder_after_build('a.tif')
        old, new = files_below(start), files_below(self.folder_after_build('b.tif'))
        missing = []

        def check(step):
            if exchange:
                self.assertTrue(os.path.exists(self.path('s')))
            elif not os.path.exists(self.path('s')):
                missing.append(step)
                # First readers, in copies, then a writer that fails.
                for reader in (['info', 's'], ['verify', 's'], ['points', 's', '-o', '-'],
                               ['render', 's', '-o', 'p.png', '--size', '16x16']):
                    copy = os.path.join(self.start(), 'copy')
                    shutil.copytree(self.folder, copy)
                    result = terrace(*reader, cwd=copy)
                    self.assertEqual(result.returncode, 0, result.stderr)
                result = terrace('build', self.input('void.tif'), '-o', 's', '--force',
                                 cwd=self.folder)
                self.assertEqual(result.returncode, 1)
                self.assertIn('has no point', result.stderr)
            found = {name: data for name, data in files_below(self.folder).items()
                     if name.startswith('s/')}
            self.assertIn(found, (old, new))
            result = terrace(*self.build('--force'), cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(files_below(self.folder), new)
            self.assertEqual(os.listdir(self.folder), ['s'])

        self.die_everywhere(start, self.build('--force'), check, exchange)
        self.assertEqual(len(missing), 0 if exchange else 2)

    def test_a_killed_replacement_leaves_the_old_or_the_new_store(self):
        self.replace(exchange=True)

    def test_a_killed_replacement_without_exchange_leaves_the_old_or_the_new_store(self):
        self.replace(exchange=False)

    def test_force_on_a_link_replaces_the_linked_store(self):
        start = self.folder_after_build('a.tif')
        new = files_below(self.folder_after_build('b.tif'))
        os.mkdir(self.path('elsewhere'))
        shutil.move(os.path.join(start, 's'), self.path('elsewhere/s'))
        os.symlink('elsewhere/s', self.path('s'))
        result = terrace(*self.build(), cwd=self.folder)
        self.assertEqual(result.returncode, 1)
        self.assertIn('exists already', result.stderr)
        result = terrace(*self.build('--force'), cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(os.path.islink(self.path('s')))
        self.assertEqual(files_below(self.path('elsewhere')), new)
        self.assertEqual(os.listdir(self.path('elsewhere')), ['s'])
        # If the target of a link does not exist, the store is created there.
        shutil.rmtree(self.path('elsewhere/s'))
        result = terrace(*self.build(), cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(os.path.islink(self.path('s')))
        self.assertEqual(files_below(self.path('elsewhere')), new)

    def test_a_manifest_that_only_names_the_format_is_not_a_store(self):
        os.mkdir(self.path('s'))
        for text in ('terrace-store', '{"note": "terrace-store"}', '{"format": ["terrace-store"]}',
                     '["format", "terrace-store"]'):
            with open(self.path('s/manifest.json'), 'w') as file:
                file.write(text)
            result = terrace(*self.build('--force'), cwd=self.folder)
            self.assertEqual(result.returncode, 1, text)
            self.assertIn('was not written by terrace', result.stderr)
            self.assertEqual(os.listdir(self.path('s')), ['manifest.json'])


class FileCrashTest(CrashCase):
    def one_file(self, name, old_command, command, **expected):
        """Checks two commands that write the file `name`; the second replaces the file of the first."""
        both = []
        for arguments in (old_command, command):
            folder = self.start()
            result = terrace(*arguments, cwd=folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(os.listdir(folder), [name])
            both.append(files_below(folder))
        old, new = both
        self.assertNotEqual(old, new)
        start = self.start()
        with open(os.path.join(start, name), 'wb') as file:
            file.write(old[name])

        def check(_):
            with open(self.path(name), 'rb') as file:
                self.assertIn(file.read(), (old[name], new[name]))
            self.next_run(command, new)

        def check_first(_):
            if os.path.exists(self.path(name)):
                with open(self.path(name), 'rb') as file:
                    self.assertEqual(file.read(), new[name])
            self.next_run(command, new)

        self.die_everywhere(start, (*command, '--force'), check, **expected)
        self.die_everywhere(self.start(), command, check_first, **expected)

    def next_run(self, command, new):
        result = terrace(*command, '--force', cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(files_below(self.folder), new)

    def test_points(self):
        self.one_file('p.ply', ('synth', 'uniform', '--points', '50', '-o', 'p.ply'),
                      ('synth', 'uniform', '--points', '60', '-o', 'p.ply'), least=3)

    def test_a_raster(self):
        self.one_file('d.tif', ('synth', 'dem', '--size', '20x20', '-o', 'd.tif'),
                      ('synth', 'dem', '--size', '30x20', '-o', 'd.tif'), least=4)

    def test_a_mesh_with_a_bound(self):
        store = self.input('bound.terrace')
        self.run_ok('build', self.input('a.tif'), '-o', store)
        self.one_file('m.ply', ('mesh', store, '-o', 'm.ply', '--max-error', '20'),
                      ('mesh', store, '-o', 'm.ply', '--max-error', '10'), least=6)

    def test_an_overlay(self):
        store = self.input('smooth.terrace')
        self.run_ok('build', self.input('a.tif'), '-o', store)

        def smooth(steps):
            return ('mesh', store, '-o', self.input(f'smooth{steps}.ply'), '--force', '--smooth',
                    f'taubin:{steps}', '--save-overlay', 'o.overlay')

        old, new = self.start(), self.start()
        for steps, folder in ((2, old), (3, new)):
            result = terrace(*smooth(steps), cwd=folder)
            self.assertEqual(result.returncode, 0, result.stderr)
        before, after = files_below(old), files_below(new)
        self.assertNotEqual(before, after)

        def check(_):
            with open(self.path('o.overlay'), 'rb') as file:
                self.assertIn(file.read(), (before['o.overlay'], after['o.overlay']))
            result = terrace(*smooth(3), cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(files_below(self.folder), after)

        self.die_everywhere(old, smooth(3), check, least=6)


class TogetherTest(CrashCase):
    """A run that fails at any step leaves every output unchanged; a successful run replaces all of them."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_ok('build', cls.input('a.tif'), '-o', cls.input('a.terrace'))
        with open(cls.input('p.xyz'), 'w', encoding='ascii') as file:
            file.writelines(f'{i % 15} {i // 15} {i % 3}\n' for i in range(100))

    def cluster(self, height):
        return ('cluster', self.input('p.xyz'), '--method', 'single', '--height', height, '-o', 'o.csv',
                '--labels', 'l.txt', '--dendrogram', 't.csv')

    def mesh(self, steps):
        return ('mesh', self.input('a.terrace'), '--smooth', f'taubin:{steps}', '-o', 'm.ply',
                '--save-overlay', 'm.overlay')

    def build(self, dem):
        return ('build', self.input(dem), '-o', 's', '--block', '100', '--threads', '1')

    COMMANDS = {
        'points': (('synth', 'uniform', '--points', '50', '-o', 'p.ply'),
                   ('synth', 'uniform', '--points', '60', '-o', 'p.ply')),
        'raster': (('synth', 'dem', '--size', '20x20', '-o', 'd.tif'),
                   ('synth', 'dem', '--size', '30x20', '-o', 'd.tif')),
    }

    def commands(self):
        return {**self.COMMANDS, 'cluster': (self.cluster('1.1'), self.cluster('3')),
                'mesh': (self.mesh(2), self.mesh(3)), 'build': (self.build('a.tif'), self.build('b.tif'))}

    def folder_after(self, command):
        folder = self.start()
        result = terrace(*command, cwd=folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return folder

    def fail_everywhere(self, start, command, new, exchange=True):
        before = files_below(start)
        failed = 0
        for step in range(1, ENDLESS):
            shutil.rmtree(self.folder)
            shutil.copytree(start, self.folder)
            if os.path.exists(self.input('steps')):
                os.remove(self.input('steps'))
            result = terrace(*command, cwd=self.folder, env=self.environment(step, 'fail', exchange))
            with open(self.input('steps'), encoding='ascii') as file:
                steps = file.read().split()
            if len(steps) < step:
                break
            with self.subTest(step=step, name=steps[step - 1]):
                if steps[step - 1] in ('sync', 'rename', 'link'):
                    self.assertNotEqual(result.returncode, 0)
                    self.assertIn('Input/output error', result.stderr)
                if result.returncode == 0:
                    self.assertEqual(files_below(self.folder), new)
                else:
                    failed += 1
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertEqual(files_below(self.folder), before)
        self.assertGreater(failed, 2)

    def test_a_failed_sync_or_rename_changes_nothing(self):
        for name, (old, command) in self.commands().items():
            new = files_below(self.folder_after(command))
            with self.subTest(name):
                self.fail_everywhere(self.start(), command, new)
            with self.subTest(name + ' --force'):
                self.fail_everywhere(self.folder_after(old), (*command, '--force'), new)

    def test_the_next_run_cleans_up_after_a_killed_one(self):
        for name in ('cluster', 'mesh'):
            old, command = self.commands()[name]
            start = self.folder_after(old)
            before, new = files_below(start), files_below(self.folder_after(command))

            def check(_):
                for output, data in files_below(self.folder).items():
                    if not output.startswith('.'):
                        self.assertIn(data, (before[output], new[output]))
                self.assertLessEqual(set(before), set(files_below(self.folder)))
                result = terrace(*command, '--force', cwd=self.folder)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(files_below(self.folder), new)

            with self.subTest(name):
                self.die_everywhere(start, (*command, '--force'), check, least=6)

    def test_two_outputs_cannot_have_the_same_name(self):
        result = terrace('cluster', self.input('p.xyz'), '-o', 'o.csv', '--labels', 'o.csv', cwd=self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("'o.csv' is named twice", result.stderr)


class StrangerTest(CrashCase):
    """--force checks the output when it is replaced, not only when the run begins."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_ok('build', cls.input('a.tif'), '-o', cls.input('a.terrace'))
        with open(cls.input('p.xyz'), 'w', encoding='ascii') as file:
            file.writelines(f'{i % 15} {i // 15} {i % 3}\n' for i in range(100))
        with open(cls.input('places.csv'), 'w', encoding='ascii') as file:
            file.write('x,y\n1,1\n')

    def before_the_names(self, command):
        """The number of the first step that renames a file."""
        if os.path.exists(self.input('steps')):
            os.remove(self.input('steps'))
        result = terrace(*command, cwd=self.folder, env=self.environment())
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(self.input('steps'), encoding='ascii') as file:
            steps = file.read().split()
        return next(i + 1 for i, step in enumerate(steps) if step == 'rename')

    def run_while(self, command, change, fresh=False):
        """Pauses a command before it renames and calls change() then; with `fresh`, in an empty folder."""
        step = self.before_the_names(command)
        if fresh:
            shutil.rmtree(self.folder)
            os.mkdir(self.folder)
        process = subprocess.Popen([TERRACE, *command], cwd=self.folder, text=True,
                                   env=self.environment(step, 'pause'),
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        _, status = os.waitpid(process.pid, os.WUNTRACED)
        self.assertTrue(os.WIFSTOPPED(status))
        change()
        process.send_signal(signal.SIGCONT)
        _, error = process.communicate()
        return process.returncode, error

    def commands(self):
        store, points = self.input('a.terrace'), self.input('p.xyz')
        return {
            'p.ply': ('points', store, '-o', 'p.ply'),
            'm.obj': ('mesh', store, '-o', 'm.obj'),
            'b.ply': ('mesh', store, '-o', 'b.ply', '--max-error', '20'),
            'r.tif': ('raster', store, '-o', 'r.tif'),
            'c.geojson': ('contour', store, '-o', 'c.geojson', '--interval', '50', '--own-crs'),
            'l.csv': ('profile', store, '-o', 'l.csv', '--line', '1,1,200,-200'),
            's.csv': ('sample', store, '-o', 's.csv', '--points', self.input('places.csv')),
            'r.png': ('render', store, '-o', 'r.png', '--size', '32x32'),
            'k.csv': ('cluster', points, '-o', 'k.csv'),
            'k.txt': ('cluster', points, '--labels', 'k.txt'),
            'pairs.csv': ('match', points, '-o', 'pairs.csv'),
            'd.tif': ('synth', 'dem', '--size', '20x20', '-o', 'd.tif'),
            'v.las': ('convert', points, '-o', 'v.las'),
        }

    def test_another_file_under_the_name_is_kept(self):
        for name, command in self.commands().items():
            result = terrace(*command, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            for kind in ('same file', 'new file', 'folder'):
                def change():
                    path = self.path(name)
                    if kind != 'same file':
                        os.rename(path, self.path('kept'))
                    if kind == 'folder':
                        os.mkdir(path)
                        path = os.path.join(path, 'photo')
                    with open(path, 'w', encoding='ascii') as file:
                        file.write('precious')

                with self.subTest(name, kind=kind):
                    code, error = self.run_while((*command, '--force'), change)
                    self.assertEqual(code, 1, error)
                    self.assertIn('was not written by terrace', error)
                    found = files_below(self.folder)
                    self.assertEqual(found.pop(name + '/photo' if kind == 'folder' else name), b'precious')
                    self.assertLessEqual(set(found), {'kept'})
                shutil.rmtree(self.folder)
                os.mkdir(self.folder)
                terrace(*command, cwd=self.folder)
            shutil.rmtree(self.folder)
            os.mkdir(self.folder)

    def test_another_folder_under_the_name_is_kept(self):
        command = ('build', self.input('b.tif'), '-o', 's', '--block', '100', '--threads', '1')
        result = terrace(*command, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)

        def change():
            os.rename(self.path('s'), self.path('old'))
            os.makedirs(self.path('s/photos'))
            with open(self.path('s/photos/1'), 'w', encoding='ascii') as file:
                file.write('precious')

        code, error = self.run_while((*command, '--force'), change)
        self.assertEqual(code, 1, error)
        self.assertIn('was not written by terrace', error)
        self.assertEqual(sorted(os.listdir(self.folder)), ['old', 's'])
        self.assertEqual(files_below(self.path('s')), {'photos/1': b'precious'})

    def test_a_store_with_a_foreign_file_is_kept(self):
        command = ('build', self.input('b.tif'), '-o', 's', '--block', '100', '--threads', '1')
        self.assertEqual(terrace(*command, cwd=self.folder).returncode, 0)
        before = files_below(self.folder)

        def change():
            for name in ('s/notes.txt', 's/letter.txt'):
                with open(self.path(name), 'w', encoding='ascii') as file:
                    file.write('precious')

        before.update({'s/notes.txt': b'precious', 's/letter.txt': b'precious'})
        # The file is created during the run, or exists from the beginning.
        for code, error in (self.run_while((*command, '--force'), change),
                            (lambda run: (run.returncode, run.stderr))(terrace(*command, '--force', cwd=self.folder))):
            self.assertEqual(code, 1, error)
            self.assertIn('contains letter.txt, which terrace did not write', error)
            self.assertIn('move it away', error)
            self.assertEqual(files_below(self.folder), before)
        for name in ('s/notes.txt', 's/letter.txt'):
            os.remove(self.path(name))
        self.assertEqual(terrace(*command, '--force', cwd=self.folder).returncode, 0)

    def test_tiles_are_not_removed_from_another_folder_under_the_name(self):
        command = ('tile', self.input('tiles.terrace'), '-o', 't', '--vertical', 'ellipsoidal', '--threads', '1',
                   '--zoom', '7-8')
        Dem(40, 30, 10.13, 46.71, 0.02).write(self.input('tiles.tif'))
        self.run_ok('build', self.input('tiles.tif'), '-o', self.input('tiles.terrace'))
        precious = 't/0/0/0.terrain'

        def change():
            os.rename(self.path('t'), self.path('old'))
            os.makedirs(os.path.dirname(self.path(precious)))
            with open(self.path(precious), 'w', encoding='ascii') as file:
                file.write('precious')

        code, error = self.run_while(command, change, fresh=True)
        self.assertEqual(code, 1, error)
        with open(self.path(precious), encoding='ascii') as file:
            self.assertEqual(file.read(), 'precious')


class DescriptorTest(CrashCase):
    def test_runs_out_of_descriptors_leave_no_files_and_name_a_file(self):
        store = self.input('a.terrace')
        self.run_ok('build', self.input('a.tif'), '-o', store)
        os.mkdir(self.input('many'))
        for i in range(30):
            shutil.copy(self.input('a.tif'), self.input(f'many/{i}.tif'))
        for command in (('build', self.input('many'), '-o', 's'), ('points', store, '-o', 'p.ply'),
                        ('tile', store, '-o', 't', '--vertical', 'ignore', '--zoom', '0-2'),
                        ('mesh', store, '-o', 'm.ply', '--max-error', '5')):
            for limit in range(6, 24):
                shutil.rmtree(self.folder)
                os.mkdir(self.folder)
                result = subprocess.run(['sh', '-c', f'ulimit -n {limit}; exec "$@"', 'sh', TERRACE, *command],
                                        cwd=self.folder, capture_output=True, text=True, check=False)
                with self.subTest(command[0], limit=limit):
                    if result.returncode == 0 or 'loading shared libraries' in result.stderr:
                        continue
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertRegex(result.stderr.splitlines()[-1], r'^terrace: [^:]')
                    left = [name for name in os.listdir(self.folder) if command[0] != 'tile' or name != 't']
                    self.assertEqual(left, [], result.stderr)


class TileCrashTest(CrashCase):
    OPTIONS = ('--vertical', 'ellipsoidal', '--threads', '1', '--zoom', '7-9')

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.stores = []
        for name, bump in (('old', 0), ('new', 90)):
            dem = Dem(40, 30, 10.13, 46.71, 0.02)
            for column in range(30, 36):
                dem.heights[8 * 40 + column] += bump
            dem.write(cls.input(name + '.tif'))
            cls.stores.append(cls.input(name + '.terrace'))
            cls.run_ok('build', cls.input(name + '.tif'), '-o', cls.stores[-1])

    def tile(self, store, *options):
        return ('tile', store, '-o', 't', '--name', 'set', *self.OPTIONS, *options)

    def folder_after(self, store):
        folder = self.start()
        result = terrace(*self.tile(store), cwd=folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        return folder

    @staticmethod
    def served_files(folder):
        """Returns {name: bytes} of the files that a web server would serve."""
        return {name: data for name, data in files_below(folder).items()
                if not os.path.basename(name).startswith('.')}

    def check_set(self, complete_sets, new):
        """Asserts that a published set is complete, and that an unpublished one can be completed by resuming."""
        result = terrace('verify', 't', cwd=self.folder)
        if os.path.exists(self.path('t/layer.json')):
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            self.assertIn(self.served_files(self.folder), complete_sets)
            option = '--force'
        else:
            self.assertEqual(result.returncode, 1)
            option = '--resume'
        result = terrace(*self.tile(self.stores[1], option), cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(files_below(self.folder), new)

    def test_a_set_is_published_as_a_whole(self):
        new = files_below(self.folder_after(self.stores[1]))
        self.assertGreater(len(new), 8)
        complete_set = {name: data for name, data in new.items() if '/.' not in name}
        self.die_everywhere(self.start(), self.tile(self.stores[1]),
                            lambda _: self.check_set((complete_set,), new), least=30)

    def test_a_changed_set_is_complete_or_not_published(self):
        old, new = self.folder_after(self.stores[0]), files_below(self.folder_after(self.stores[1]))
        complete_sets = self.served_files(old), {name: data for name, data in new.items() if '/.' not in name}
        self.assertNotEqual(*complete_sets)
        self.die_everywhere(old, self.tile(self.stores[1], '--force'),
                            lambda _: self.check_set(complete_sets, new), least=10)

    def test_a_second_run_is_refused_while_the_first_is_running(self):
        new = files_below(self.folder_after(self.stores[0]))
        steps = 0
        for step in range(1, ENDLESS, 7):
            shutil.rmtree(self.folder)
            os.mkdir(self.folder)
            first = subprocess.Popen([TERRACE, *self.tile(self.stores[0])], cwd=self.folder,
                                     env=self.environment(step, 'pause'),
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            _, status = os.waitpid(first.pid, os.WUNTRACED)
            if os.WIFEXITED(status):
                first.communicate()
                break
            steps += 1
            self.assertTrue(os.WIFSTOPPED(status))
            if step > 2:  # the folder and its lock exist
                second = terrace(*self.tile(self.stores[1], '--force'), cwd=self.folder)
                self.assertEqual(second.returncode, 1)
                self.assertIn('another run is writing', second.stderr)
            first.send_signal(signal.SIGCONT)
            _, error = first.communicate()
            self.assertEqual(first.returncode, 0, error)
            self.assertEqual(files_below(self.folder), new)
        self.assertGreater(steps, 5)

    def test_leftovers_of_killed_runs_are_not_damage_and_are_removed(self):
        start = self.folder_after(self.stores[0])
        new = files_below(start)
        shutil.rmtree(self.folder)
        shutil.copytree(start, self.folder)
        tile = next(name for name in new if name.endswith('.terrain'))
        beside, name = os.path.split(tile)
        torn = [os.path.join(beside, f'.{name}.tmp'), os.path.join(beside, f'.{name}.tmp-4711'),
                't/.layer.json.tmp-4711', 't/.terrace-tiles.lock']
        strangers = [os.path.join(beside, f'.{name}.tmp-notes'), 't/notes.tmp']
        for left in torn + strangers:
            with open(self.path(left), 'w') as file:
                file.write('half')
        result = terrace('verify', 't', cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('2 files left over', result.stderr)
        result = terrace(*self.tile(self.stores[0], '--resume'), cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        for left in strangers:
            os.remove(self.path(left))
        self.assertEqual(files_below(self.folder), new)

    def test_tiles_are_written_to_the_target_of_a_link(self):
        new = files_below(os.path.join(self.folder_after(self.stores[0]), 't'))
        os.symlink('real', self.path('t'))
        for options in ((), ('--force',)):
            result = terrace(*self.tile(self.stores[0], *options), cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(files_below(self.path('real')), new)
            self.assertTrue(os.path.islink(self.path('t')))

    def test_a_failed_run_leaves_no_folder(self):
        result = terrace('tile', self.stores[0], '-o', 't', '--geoid', 'none.pgm', cwd=self.folder)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(os.listdir(self.folder), [])


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], '-v', *sys.argv[1:]])
