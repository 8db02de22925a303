#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""build --channel, --outlier-price and --strategy, checked with the decoder of FORMAT.md's test.

TERRACE=path/to/terrace build_clustering_cli_test.py
"""

import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / 'libstream/tests'))
import decode_store  # noqa: E402

TERRACE = os.environ.get('TERRACE', 'terrace')
BIRDS = [(3.0, 4.0, 90.0), (40.0, 10.0, 120.0), (25.0, 25.0, -70.0)]


class ClusteringOptionsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        seed = 11
        print('seed', seed)
        rng = random.Random(seed)
        # Two kinds of points on top of each other on a plain, and birds above and below it.
        cls.points = [(rng.randrange(5000) / 100, rng.randrange(5000) / 100, rng.randrange(100) / 100, k % 2)
                      for k in range(6000)]
        for k, bird in enumerate(BIRDS):
            cls.points.insert(1500 * k + 7, (*bird, 0))
        cls.file = cls.path('points.csv')
        with open(cls.file, 'w', encoding='ascii') as file:
            file.write('x,y,z,kind\n')
            file.writelines('%r,%r,%r,%d\n' % p for p in cls.points)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def terrace(*args):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)

    def run_ok(self, *args):
        result = self.terrace(*args)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def expect_error(self, expected, *args):
        result = self.terrace(*args)
        self.assertIn(result.returncode, (1, 2))
        self.assertIn(expected, result.stderr)
        self.assertLessEqual(len(result.stderr.splitlines()), 2, result.stderr)

    def build(self, name, *options):
        summary = json.loads(self.run_ok('build', self.file, '-o', self.path(name), '--block', 2000, '--order', 'stream',
                                         '--json', *options))
        self.run_ok('verify', self.path(name))
        return summary, decode_store.Store(self.path(name))

    def test_outliers_are_kept_and_marked(self):
        summary, store = self.build('outliers.st', '--outlier-price', 0.5)
        self.assertEqual((summary['points'], summary['outliers']), (len(self.points), len(BIRDS)))
        self.assertEqual([a['name'] for a in store.manifest['attributes']], ['kind', 'outlier'])
        self.assertEqual(sorted(p[2:5] for p in store.points() if p[6]), sorted(BIRDS))
        self.assertEqual(sorted(p[2:6] for p in store.points()), sorted(self.points))
        # Outliers are members and never the representative of a cluster.
        for level in store.levels[:-1]:
            for cluster in level.clusters:
                self.assertEqual(cluster.attributes[1][cluster.representative], 0)
        plain, without = self.build('plain.st')
        self.assertEqual(plain['outliers'], 0)
        self.assertEqual([a['name'] for a in without.manifest['attributes']], ['kind'])
        result = self.terrace('build', self.file, '-o', self.path('again.st'), '--outlier-price', 0.2)
        # A single block has outliers too, although it is not clustered.
        self.assertIn('3 of them are marked: outlier = 1', result.stderr)
        self.assertIn('outlier_price 0.2', self.run_ok('info', self.path('again.st')))

    def test_an_attribute_named_outlier_is_an_error(self):
        named = self.path('named.csv')
        with open(named, 'w', encoding='ascii') as file:
            file.write('x,y,z,outlier\n1,2,3,0\n2,3,4,1\n')
        self.expect_error('--drop outlier', 'build', named, '-o', self.path('no.st'), '--outlier-price', 0.5)
        self.run_ok('build', named, '-o', self.path('dropped.st'), '--outlier-price', 0.5, '--drop', 'outlier')
        self.expect_error('--outlier-price', 'build', named, '-o', self.path('no.st'), '--outlier-price', 0)

    def test_channels_count_in_distances(self):
        def mixed(store):
            clusters = [c for c in store.levels[0].clusters if c]
            return sum(len(set(c.attributes[0])) > 1 for c in clusters), len(clusters)
        options = ['--facility-cost', 0.5]
        apart, clusters = mixed(self.build('apart.st', '--channel', 'kind:1000', *options)[1])
        self.assertEqual(apart, 0)
        together, _ = mixed(self.build('together.st', '--channel', 'kind:0', *options)[1])
        self.assertGreater(together, clusters // 4)
        self.expect_error('kind', 'build', self.file, '-o', self.path('no.st'), '--channel', 'colour:1')
        for bad in ('kind', ':1', 'kind:'):
            self.expect_error('--channel', 'build', self.file, '-o', self.path('no.st'), '--channel', bad)
        for weight, reason in (('-1', '--channel kind:-1: the weight must not be negative'),
                               ('inf', "'inf' is not a number in the weight of --channel kind:inf"),
                               ('nan', "'nan' is not a number in the weight of --channel kind:nan")):
            self.expect_error(reason, 'build', self.file, '-o', self.path('no.st'), '--channel', 'kind:' + weight)

    def test_a_channel_with_nan_is_an_error(self):
        holes = self.path('holes.csv')
        with open(holes, 'w', encoding='ascii') as file:
            file.write('x,y,z,gloss\n' + ''.join('%d,%d,3,%s\n' % (k % 60, k // 60, 'nan' if k == 77 else k)
                                                 for k in range(3000)))
        self.expect_error('"gloss" of a point is not finite', 'build', holes, '-o', self.path('no.st'),
                          '--channel', 'gloss:1', '--block', 1000)
        self.assertFalse(os.path.exists(self.path('no.st')))
        self.run_ok('build', holes, '-o', self.path('whole.st'), '--channel', 'gloss:1', '--block', 1000,
                    '--where', 'gloss >= 0')

    def test_searches_of_the_thesis_find_the_same_solution(self):
        names = ['full-scan', 'quadtree', 'octree', 'kd-tree', 'facilities']
        levels = {}
        for name in names + ['automatic']:
            self.run_ok('build', self.file, '-o', self.path(name + '.st'), '--block', 2000, '--order', 'stream',
                        '--strategy', name, '--facility-cost', 1)
            store = decode_store.Store(self.path(name + '.st'))
            levels[name] = [[c.points for c in level.clusters if c] for level in store.levels]
        for name in names:
            self.assertEqual(levels[name], levels['full-scan'], name)
        self.assertNotEqual(levels['automatic'], levels['full-scan'])
        self.expect_error('best', 'build', self.file, '-o', self.path('no.st'), '--strategy', 'best')


if __name__ == '__main__':
    unittest.main()
