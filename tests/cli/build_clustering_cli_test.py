#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""build --channel, --outlier-price, --strategy and -k, checked with the decoder of FORMAT.md's test.

TERRACE=path/to/terrace build_clustering_cli_test.py
"""

import json
import math
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

    def test_local_searches_take_a_batch_and_threads(self):
        def top(name):
            return [c.points for c in decode_store.Store(self.path(name)).levels[-1].clusters]
        self.run_ok('build', self.file, '-o', self.path('one.st'), '--block', 2000, '--order', 'stream',
                    '--strategy', 'facilities')
        one = top('one.st')
        self.run_ok('build', self.file, '-o', self.path('threads.st'), '--block', 2000, '--order', 'stream',
                    '--strategy', 'facilities', '--search-threads', 3)
        for level in os.listdir(self.path('one.st')):
            with open(os.path.join(self.path('one.st'), level), 'rb') as a, \
                    open(os.path.join(self.path('threads.st'), level), 'rb') as b:
                self.assertTrue(a.read() == b.read(), level)
        self.run_ok('build', self.file, '-o', self.path('batch.st'), '--block', 2000, '--order', 'stream',
                    '--strategy', 'facilities', '--batch', 8)
        self.assertNotEqual(top('batch.st'), one)
        self.assertIn('batch 8', self.run_ok('info', self.path('batch.st')))
        for option in ('--batch', '--search-threads'):
            self.expect_error('are for local searches: choose one by --strategy', 'build', self.file, '-o',
                              self.path('no.st'), option, 2)
            self.expect_error(option, 'build', self.file, '-o', self.path('no.st'), option, 0)
        self.expect_error('--batch', 'build', self.file, '-o', self.path('no.st'), '--batch', 'many')


class MediansTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    terrace = staticmethod(ClusteringOptionsTest.terrace)
    run_ok = ClusteringOptionsTest.run_ok
    expect_error = ClusteringOptionsTest.expect_error

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, points):
        name = self.path('points.csv')
        with open(name, 'w', encoding='ascii') as file:
            file.write('x,y,z\n')
            file.writelines('%r,%r,%r\n' % p for p in points)
        return name

    def inputs(self, rng, count):
        centres = [(rng.uniform(0, 1e4), rng.uniform(0, 1e4), rng.uniform(0, 100)) for _ in range(5)]
        yield 'uniform', [(rng.random(), rng.random(), rng.random()) for _ in range(count)]
        yield 'clustered', [tuple(rng.gauss(c, 20) for c in rng.choice(centres)) for _ in range(count)]
        yield 'collinear', [(t, 3 * t, -t) for t in (rng.uniform(0, 1e6) for _ in range(count))]
        yield 'duplicates', [(rng.randrange(9) / 2, rng.randrange(12) / 2, 1.5) for _ in range(count)]

    def test_cost_is_within_five_per_cent_of_that_in_memory(self):
        seed = 23
        print('seed', seed)
        for name, points in self.inputs(random.Random(seed), 3000):
            with self.subTest(name):
                file, store = self.write(points), self.path(name + '.st')
                summary = json.loads(self.run_ok('build', file, '-o', store, '--block', 800, '-k', 8, '--json'))
                self.assertGreaterEqual(summary['levels'], 3)
                self.run_ok('verify', store)
                memory = json.loads(self.run_ok('cluster', file, '--method', 'k-median', '-k', 8, '--bound-iterations', 0,
                                                '--labels', self.path('labels.txt'), '--json', '--force'))
                medians = [p for c in decode_store.Store(store).levels[-1].clusters for p in c.points]
                self.assertEqual(len(medians), 8)
                self.assertTrue(set(medians) <= set(points))
                cost = sum(min(math.dist(p, m) for m in medians) for p in points)
                self.assertLess(cost, 1.05 * memory['cost'])

    def test_medians_are_the_top_and_own_the_clusters_below(self):
        rng = random.Random(29)
        points = [(rng.uniform(0, 50) + 1000 * (i % 3), rng.uniform(0, 50), 0.0) for i in range(2100)]
        store = self.path('three.st')
        self.run_ok('build', self.write(points), '-o', store, '--block', 500, '-k', 3)
        top = [line.split(',')[:2] for line in
               self.run_ok('points', store, '--level', 'top', '-o', '-', '--format', 'csv').splitlines()[1:]]
        self.assertEqual(sorted(round(float(x) / 1000 - 0.025) for x, _ in top), [0, 1, 2])
        below = len(decode_store.Store(store).levels) - 2
        for number in range(3):
            xs = [float(line.split(',')[0]) // 1000 for line in
                  self.run_ok('points', store, '--cluster', f'{below}:{number}', '-o', '-', '--format', 'csv').splitlines()[1:]]
            self.assertEqual(len(set(xs)), 1)
        self.assertIn('k 3', self.run_ok('info', store))

    def test_few_points_and_many_medians(self):
        points = [(float(i), 0.0, 0.0) for i in range(5)]
        for k, expected in ((1, 1), (4, 4), (5, 5), (40, 5)):
            store = self.path(f'{k}.st')
            self.run_ok('build', self.write(points), '-o', store, '-k', k)
            self.run_ok('verify', store)
            self.assertEqual(len(decode_store.Store(store).levels[-1].clusters[0].points), expected)
        self.assertEqual(decode_store.Store(self.path('1.st')).levels[-1].clusters[0].points, [(2.0, 0.0, 0.0)])
        no = self.path('no.st')
        file = self.write(points)
        for options, reason in ((['--facility-cost', 1], 'give either -k or --facility-cost'),
                                (['--outlier-price', 1], 'give either -k or --outlier-price')):
            self.expect_error(reason, 'build', file, '-o', no, '-k', 2, *options)
        for k in (0, 10001):
            self.expect_error('-k', 'build', file, '-o', no, '-k', k)
        self.expect_error('lower -k', 'build', file, '-o', no, '-k', 5000, '--memory', '64M')


if __name__ == '__main__':
    unittest.main()
