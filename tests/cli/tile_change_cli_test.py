#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests updates of tile sets after changes: they equal fresh sets and touch few tiles.

TERRACE=path/to/terrace tile_change_cli_test.py
"""

import math
import os
import random
import shutil
import unittest

from tile_case import NODATA, Dem, TileTestCase, terrace

VERTICAL = ('--vertical', 'ellipsoidal')


def everything(folder):
    """The bytes of every file in a folder, by name."""
    found = {}
    for path, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(path, name), 'rb') as file:
                found[os.path.relpath(os.path.join(path, name), folder)] = file.read()
    return found


def smooth(column, row):
    return 700 + 300 * math.sin(column / 31) * math.cos(row / 23) + 8 * math.sin(column * row / 900)


class ChangeTest(TileTestCase):
    """After any change, the folder equals that of a fresh run byte for byte, journal included."""
    COLUMNS, ROWS = 200, 150

    def dem(self, *place):
        return Dem(self.COLUMNS, self.ROWS, *place, height=smooth)

    def fresh(self, store, *options):
        shutil.rmtree(self.path('fresh'), ignore_errors=True)
        self.tile(store, 'fresh', *options)
        return everything(self.path('fresh'))

    def again(self, store, *options):
        """Tiles into the folder 'set' again; returns the summary and the tiles touched."""
        def times():
            return {name: os.stat(os.path.join(self.path('set'), name)).st_mtime_ns
                    for name in everything(self.path('set')) if name.endswith('.terrain')}

        before = times()
        summary = self.tile(store, 'set', '--name', 'fresh', '--force', *options)
        after = times()
        touched = [name for name in after if after[name] != before.get(name)]
        self.assertEqual(len(touched), summary['tiles'] - summary['kept'])
        self.assertGreaterEqual(summary['made'], len(touched))
        found, expected = everything(self.path('set')), self.fresh(store, '--name', 'fresh',
                                                                   *options)
        self.assertEqual(sorted(found), sorted(expected))
        for name, data in expected.items():
            self.assertEqual(found[name], data, name)
        return summary

    def check_changes(self, dem, name, options):
        """Applies changes of all kinds one after another."""
        store = self.build(dem, name)
        shutil.rmtree(self.path('set'), ignore_errors=True)
        first = self.tile(store, 'set', '--name', 'fresh', *options)
        self.assertEqual((first['made'], first['kept']), (first['tiles'], 0))
        few = first['tiles'] // 2
        self.assertGreater(few, 20)
        summary = self.again(store, *options)
        self.assertEqual((summary['made'], summary['kept']), (0, summary['tiles']))

        def change(what, most, touch):
            with self.subTest(what):
                touch()
                summary = self.again(self.build(dem, name), *options)
                self.assertGreater(summary['made'], 0)
                self.assertLessEqual(summary['made'], most, what)

        def put(columns, rows, height):
            for row in rows:
                for column in columns:
                    at = row * self.COLUMNS + column
                    z = dem.heights[at]
                    dem.heights[at] = height(z) if callable(height) else height

        every = first['tiles'] + 40
        change('a sample', few, lambda: put([90], [60], lambda z: z + 7))
        change('a patch', few, lambda: put(range(30, 40), range(15, 25), lambda z: z + 5))
        change('a row', every, lambda: put(range(self.COLUMNS), [104], lambda z: z + 3))
        change('a hole', few, lambda: put(range(120, 127), range(90, 96), NODATA))
        change('beside the hole', few, lambda: put([128], [92], lambda z: z + 9))
        change('the hole closed', few, lambda: put(range(120, 127), range(90, 96), 320.0))
        change('a corner', few, lambda: put(range(5), range(5), lambda z: z + 11))
        change('a corner gone', few, lambda: put(range(188, 200), range(140, 150), NODATA))
        # The lattice of heights becomes coarser.
        change('a peak', every, lambda: put([150], [30], 9000.0))

        # With other options all tiles change.
        for other in (('--quality', 'greedy'), ('--fill', 'flat'), ('--gzip',), ()):
            with self.subTest(other):
                summary = self.again(store, *options, *other)
                self.assertEqual(summary['made'], summary['tiles'])
        # The bound is the last option.
        summary = self.again(store, *options[:-1], '6')
        self.assertEqual(summary['made'], summary['tiles'])

    def test_degrees(self):
        dem = self.dem(10.13, 46.71, 0.002)
        self.check_changes(dem, 'degrees', ('--zoom', '0-12', '--max-error', '4'))

    def test_metres(self):
        dem = self.dem(652000, 5210000, 160, 32)
        self.check_changes(dem, 'metres', ('--zoom', '0-12', '--normals', '--water', 'nodata',
                                           '--max-error', '4'))

    def test_voids_across_the_antimeridian(self):
        dem = self.dem(179.86, -16.2, 0.002)
        noise = random.Random(3)
        for _ in range(25):
            column, row, size = noise.randrange(190), noise.randrange(140), noise.randrange(2, 14)
            for r in range(row, row + size):
                for c in range(column, min(column + size, self.COLUMNS)):
                    dem.heights[r * self.COLUMNS + c] = NODATA
        self.check_changes(dem, 'voids', ('--zoom', '0-12', '--metadata',
                                          '--max-error', '4'))
        verdict = self.verify('set', '--store', self.path('voids.terrace'), *VERTICAL)
        self.assertEqual(verdict['problems'], [])

    def test_a_small_change_rewrites_few_of_many_tiles(self):
        dem = Dem(480, 400, 10.13, 46.71, 0.002, height=smooth)
        options = ('--zoom', '0-12', '--max-error', '20')
        store = self.build(dem, 'many')
        shutil.rmtree(self.path('set'), ignore_errors=True)
        first = self.tile(store, 'set', '--name', 'fresh', *options)
        self.assertGreater(first['tiles'], 500)
        for row in range(200, 208):
            for column in range(240, 248):
                dem.heights[row * 480 + column] += 60
        summary = self.again(self.build(dem, 'many'), *options)
        self.assertLessEqual(summary['made'], 40)
        self.assertGreaterEqual(summary['made'], 13)

    def test_extents_and_zooms(self):
        store = self.build(self.dem(10.13, 46.71, 0.002), 'wide')
        options = ('--zoom', '0-10')
        shutil.rmtree(self.path('set'), ignore_errors=True)
        first = self.tile(store, 'set', '--name', 'fresh', *options)
        # Unless it is given, each zoom has its own bound, so tiles of both sets are kept.
        summary = self.again(store, '--zoom', '0-9')
        self.assertEqual(summary['made'], 0)
        self.assertEqual(summary['removed'], first['zooms'][10]['tiles'])
        summary = self.again(store, '--zoom', '2-10')
        self.assertEqual(summary['made'], first['zooms'][10]['tiles'])
        for size in ((180, 150, 10.15, 46.71, 0.002), (60, 48, 10.15, 46.71, 0.005),
                     (150, 120, 652000, 5210000, 160, 32)):
            self.again(self.build(Dem(*size, height=smooth), 'wide'), *options)

    def test_damage_is_repaired(self):
        store = self.build(self.dem(10.13, 46.71, 0.002), 'damage')
        options = ('--max-error', '2')
        shutil.rmtree(self.path('fresh'), ignore_errors=True)
        whole = self.tile(store, 'fresh', *options)
        expected = everything(self.path('fresh'))
        names = sorted(name for name in expected if name.endswith('.terrain'))

        def damage():
            folder = self.path('fresh')
            os.remove(os.path.join(folder, names[3]))
            os.truncate(os.path.join(folder, names[20]), 100)
            with open(os.path.join(folder, names[-1]), 'r+b') as file:
                file.seek(150)
                file.write(b'\xff\xfe')
            os.truncate(os.path.join(folder, names[-5]), 0)

        for mend in ('--force', '--resume'):
            damage()
            summary = self.tile(store, 'fresh', mend, *options)
            self.assertEqual((summary['made'], summary['kept']), (4, whole['tiles'] - 4))
            self.assertEqual(everything(self.path('fresh')), expected)
        # Without a journal, or with an unreadable one, nothing is known about the tiles.
        for text in (None, '', 'terrace tiles 1\n'):
            if text is None:
                os.remove(self.path('fresh/.terrace-tiles'))
            else:
                with open(self.path('fresh/.terrace-tiles'), 'w') as file:
                    file.write(text)
            summary = self.tile(store, 'fresh', '--force', *options)
            self.assertEqual((summary['made'], summary['kept']), (whole['tiles'], whole['tiles']))
            self.assertEqual(everything(self.path('fresh')), expected)

    def test_resume_of_a_finished_set(self):
        dem = Dem(90, 70, 10.13, 46.71, 0.01)
        store = self.build(dem, 'done')
        whole = self.tile(store, 'done', '--max-error', 2)
        time = os.stat(self.path('done/layer.json')).st_mtime_ns
        summary = self.tile(store, 'done', '--max-error', 2, '--resume')
        self.assertEqual((summary['made'], summary['kept']), (0, whole['tiles']))
        self.assertEqual(os.stat(self.path('done/layer.json')).st_mtime_ns, time)
        command = ('tile', store, '-o', self.path('done'), *VERTICAL, '--resume')
        before = everything(self.path('done'))
        self.refuse(1, '--force', *command, '--max-error', 3)
        dem.heights[2000] += 5
        self.build(dem, 'done')
        self.refuse(1, '--force', *command, '--max-error', 2)
        self.assertEqual(everything(self.path('done')), before)
        # An interrupted run continues with the current samples.
        os.remove(self.path('done/layer.json'))
        summary = self.tile(store, 'done', '--max-error', 2, '--resume')
        self.assertTrue(0 < summary['made'] < whole['tiles'], summary)
        self.tile(store, 'again/done', '--max-error', 2)
        self.assertEqual(everything(self.path('done')), everything(self.path('again/done')))

    def test_stores_with_other_clusters(self):
        dem = self.dem(10.13, 46.71, 0.002)
        store = self.build(dem, 'clusters')
        self.tile(store, 'set', '--name', 'fresh', '--force')
        for options in (('--block', '3000'), ('--seed', '5', '--facility-cost', '2')):
            result = terrace('build', self.path('clusters.tif'), '-o', store, '--force', *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            summary = self.again(store)
            # The fill beyond the border is made from some of the samples, which are now others.
            self.assertLess(summary['made'], summary['tiles'])


if __name__ == '__main__':
    unittest.main()
