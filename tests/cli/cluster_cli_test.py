#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the verb `cluster` and its pictures end to end.

TERRACE=path/to/terrace cluster_cli_test.py
"""

import csv
import json
import math
import os
import random
import signal
import subprocess
import tempfile
import time
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
LINKAGE = ['single', 'complete', 'average', 'weighted', 'ward', 'centroid', 'median']
COUNTING = ['k-means', 'k-median', *LINKAGE]
METHODS = ['facility', 'primal-dual', *COUNTING]


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


def distance(a, b):
    return math.dist(a, b)


def diagonal(points):
    return math.dist([min(axis) for axis in zip(*points)], [max(axis) for axis in zip(*points)])


def mean(points):
    return [sum(axis) / len(points) for axis in zip(*points)]


def agglomerate(points, method):
    """Linkage heights, computed from the definitions of the methods."""
    def apart(a, b):
        if method == 'ward':
            return math.sqrt(2 * len(a) * len(b) / (len(a) + len(b))) * distance(mean(a), mean(b))
        if method == 'centroid':
            return distance(mean(a), mean(b))
        pairs = [distance(p, q) for p in a for q in b]
        return {'single': min, 'complete': max, 'average': lambda all_: sum(all_) / len(all_)}[method](pairs)

    # A cluster is a list of its points and the midpoint of its parts' centres.
    clusters, heights = [([p], p) for p in points], []
    between = {(j, i): distance(points[i], points[j]) for i in range(len(points)) for j in range(i)}
    while between:
        a, b = min(between, key=between.get)
        heights.append(between.pop((a, b)))
        new = len(clusters)
        clusters.append((clusters[a][0] + clusters[b][0], mean([clusters[a][1], clusters[b][1]])))
        for k in {other for pair in between for other in pair} - {a, b}:
            to_a, to_b = (between.pop((min(k, part), max(k, part))) for part in (a, b))
            if method == 'weighted':
                between[k, new] = (to_a + to_b) / 2
            elif method == 'median':
                between[k, new] = distance(clusters[k][1], clusters[new][1])
            else:
                between[k, new] = apart(clusters[k][0], clusters[new][0])
    return heights


class ClusterTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.blobs = cls.path('blobs.csv')
        generator = random.Random(5)
        cls.points = []
        for centre in ((0, 0, 0), (40, 5, 1), (10, 50, 3), (60, 60, 9)):
            for _ in range(60):
                cls.points.append([c + generator.gauss(0, 2) for c in centre])
        generator.shuffle(cls.points)
        cls.write(cls.blobs, ['x', 'y', 'z'], cls.points)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def write(path, header, rows):
        with open(path, 'w', newline='') as file:
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(rows)

    @staticmethod
    def read(path):
        with open(path, newline='') as file:
            return list(csv.DictReader(file))

    @staticmethod
    def run_ok(*args):
        result = terrace(*args)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, code, *args):
        result = terrace(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
        return result.stderr

    def clustered(self, *options, source=None):
        """Runs the command; returns its summary and the rows of the output."""
        out = self.path('out.csv')
        summary = json.loads(self.run_ok('cluster', source or self.blobs, '-o', out, '--json',
                                         '--force', *options))
        return summary, self.read(out)

    def test_facility_location_reports_consistent_costs_and_a_bound(self):
        summary, rows = self.clustered()
        self.assertLessEqual({'clusters', 'cost', 'opening_cost', 'connection_cost', 'lower_bound',
                              'seconds'}, set(summary))
        self.assertEqual(len(rows), len(self.points))
        connection, representatives = 0.0, {}
        for i, row in enumerate(rows):
            self.assertEqual([float(row[a]) for a in 'xyz'], self.points[i])
            chosen = int(row['representative'])
            self.assertEqual(representatives.setdefault(int(row['cluster']), chosen), chosen)
            self.assertEqual(rows[chosen]['cluster'], row['cluster'])
            connection += distance(self.points[i], self.points[chosen])
        self.assertEqual(len(representatives), summary['clusters'])
        nearest = sum(min(distance(p, self.points[r]) for r in representatives.values())
                      for p in self.points)
        self.assertAlmostEqual(summary['connection_cost'] / connection, 1, places=9)
        self.assertAlmostEqual(nearest / connection, 1, places=6)
        self.assertAlmostEqual(summary['opening_cost'] /
                               (len(representatives) * diagonal(self.points)), 1, places=9)
        self.assertAlmostEqual(summary['cost'],
                               summary['opening_cost'] + summary['connection_cost'], places=6)
        self.assertLessEqual(summary['lower_bound'], summary['cost'])
        self.assertGreater(summary['lower_bound'], 0.9 * summary['cost'])

    def test_every_method_finds_well_separated_blobs(self):
        for method in METHODS:
            options = ['-k', 4] if method in COUNTING else ['--facility-cost', 1]
            summary, rows = self.clustered('--method', method, *options)
            with self.subTest(method=method):
                self.assertEqual(summary['clusters'], 4)
                for i in range(0, len(rows), 7):
                    for j in range(0, len(rows), 5):
                        near = distance(self.points[i], self.points[j]) < 25
                        self.assertEqual(rows[i]['cluster'] == rows[j]['cluster'], near)

    def test_strategies_and_threads_give_the_same_bytes(self):
        outputs = set()
        for number, options in enumerate((
                ['full-scan'], ['quadtree'], ['octree'], ['kd-tree'], ['facilities'],
                ['facilities', '--threads', 3])):
            out = self.path(f'strategy{number}.csv')
            self.run_ok('cluster', self.blobs, '-o', out, '--facility-cost', 0.1, '--iterations',
                        'log10', '--strategy', *options)
            with open(out, 'rb') as file:
                outputs.add(file.read())
        self.assertEqual(len(outputs), 1)
        other = self.path('seed.csv')
        self.run_ok('cluster', self.blobs, '-o', other, '--facility-cost', 0.1, '--iterations',
                    'tenth', '--seed', 2)
        with open(other, 'rb') as file:
            self.assertNotIn(file.read(), outputs)

    def test_an_outlier_costs_its_price(self):
        path = self.path('outlier.csv')
        self.write(path, ['x', 'y', 'z'], self.points + [[1000, 1000, 0]])
        summary, rows = self.clustered('--facility-cost', 0.05, '--outlier-price', 0.04, source=path)
        self.assertEqual(summary['outliers'], 1)
        self.assertEqual((rows[-1]['cluster'], rows[-1]['representative']), ('-1', '-1'))
        self.assertAlmostEqual(summary['outlier_cost'] /
                               (0.04 * diagonal(self.points + [[1000, 1000, 0]])), 1, places=9)

    def test_dendrogram_heights_match_brute_force(self):
        few = self.path('few.csv')
        self.write(few, ['x', 'y', 'z'], self.points[:40])
        for method in LINKAGE:
            out = self.path(f'{method}-tree.csv')
            self.run_ok('cluster', few, '--method', method, '--dendrogram', out)
            rows = self.read(out)
            self.assertEqual(list(rows[0]), ['a', 'b', 'height', 'size'])
            heights = [float(row['height']) for row in rows]
            for ours, theirs in zip(heights, agglomerate(self.points[:40], method), strict=True):
                self.assertAlmostEqual(ours / theirs, 1, places=11)
            self.assertEqual(int(rows[-1]['size']), 40)
            picture = self.path(f'{method}.png')
            summary = json.loads(self.run_ok('render', out, '-o', picture, '--json', '--size',
                                             '300x200'))
            self.assertEqual(summary['merges'], 39)

    def test_dendrograms_with_inversions_are_drawn_and_cut(self):
        triangle = self.path('triangle.csv')
        self.write(triangle, ['x', 'y', 'z'], [[0, 0, 0], [2, 0, 0], [1, 1.75, 0], [50, 0, 0]])
        out, labels, picture = self.path('inversion.csv'), self.path('inversion.txt'), self.path('inversion.png')
        self.run_ok('cluster', triangle, '--method', 'centroid', '--dendrogram', out, '--labels', labels,
                    '--height', 1.9)
        self.assertEqual([float(row['height']) for row in self.read(out)][:2], [2, 1.75])
        with open(labels) as file:
            self.assertEqual(len(set(file.read().split())), 4)  # the pair is 2 apart
        self.run_ok('render', out, '-o', picture, '--size', '100x100')

    def test_average_linkage_supports_other_metrics(self):
        few = self.path('taxi.csv')
        self.write(few, ['x', 'y', 'z'], [[0, 0, 0], [1, 1, 0], [0, 5, 0]])
        for method, last in (('average', 5.0), ('weighted', 5.0)):
            out = self.path(f'taxi-{method}.csv')
            self.run_ok('cluster', few, '--method', method, '--metric', 'minkowski:1', '--dendrogram', out)
            self.assertEqual([float(row['height']) for row in self.read(out)], [2, last])

    def test_trees_are_cut_by_height_or_count(self):
        labels = self.path('labels.txt')
        self.run_ok('cluster', self.blobs, '--method', 'single', '--height', 15, '--labels', labels)
        with open(labels) as file:
            numbers = [int(line) for line in file]
        self.assertEqual(len(numbers), len(self.points))
        self.assertEqual(set(numbers), {0, 1, 2, 3})
        summary, _ = self.clustered('--method', 'complete', '-k', 9, '--single-precision')
        self.assertEqual(summary['clusters'], 9)
        self.assertIsNone(summary['cost'])

    def test_an_elliptical_metric_equals_scaled_coordinates(self):
        metric = self.path('ellipse.json')
        with open(metric, 'w') as file:
            json.dump({'regions': [{'semi_axes': [4, 1, 1], 'angle': 0}]}, file)
        scaled = self.path('scaled.csv')
        self.write(scaled, ['x', 'y', 'z'], [[x / 4, y, z] for x, y, z in self.points])
        options = ['--facility-cost', 0.2, '--iterations', 'log10', '--strategy', 'kd-tree']
        one, rows = self.clustered('--metric', f'elliptical:{metric}', *options)
        two, others = self.clustered(*options, source=scaled)
        self.assertEqual([row['cluster'] for row in rows], [row['cluster'] for row in others])
        self.assertAlmostEqual(one['cost'] / two['cost'], 1, places=9)

    def test_elliptical_regions_and_other_metrics_work(self):
        metric = self.path('field.json')
        with open(metric, 'w') as file:
            json.dump({'regions': [{'box': [-20, -20, 30, 30], 'semi_axes': [5, 0.5], 'angle': 45}]},
                      file)
        for name in (f'elliptical:{metric}', 'squared', 'minkowski:1', 'minkowski:inf'):
            with self.subTest(metric=name):
                summary, rows = self.clustered('--metric', name, '--facility-cost', 0.2)
                self.assertGreaterEqual(summary['clusters'], 2)
                self.assertLessEqual(summary['lower_bound'], summary['cost'])
                self.assertEqual(len(rows), len(self.points))

    def test_channels_and_weights_count(self):
        path = self.path('coloured.csv')
        self.write(path, ['x', 'y', 'z', 'intensity', 'mass'],
                   [[i % 10, i // 10, 0, 100 * (i % 2), 1 + 9 * (i == 55)] for i in range(100)])
        _, rows = self.clustered('--method', 'facility', '--channel', 'intensity:10', source=path)
        for row in rows:
            chosen = rows[int(row['representative'])]
            self.assertEqual(row['intensity'], chosen['intensity'])
        light, _ = self.clustered(source=path)
        heavy, _ = self.clustered('--weight', 'mass', '--facility-cost', 100, source=path)
        self.assertEqual(heavy['clusters'], 1)
        self.assertGreater(light['clusters'], 1)
        self.assertIn('intensity', self.expect_error(2, 'cluster', path, '--channel', 'colour:1',
                                                     '-o', self.path('none.csv')))

    def test_clustered_points_can_be_clustered_again_and_drawn(self):
        first = self.path('first.ply')
        self.run_ok('cluster', self.blobs, '-o', first)
        again = self.path('again.csv')
        self.run_ok('cluster', first, '-o', again, '--method', 'k-means', '-k', 7)
        rows = self.read(again)
        self.assertEqual(list(rows[0]), ['x', 'y', 'z', 'cluster', 'representative'])
        self.assertEqual(len({row['cluster'] for row in rows}), 7)
        picture = self.path('clusters.png')
        self.run_ok('render', first, '-o', picture, '--size', '200x200')
        self.assertGreater(os.path.getsize(picture), 1000)

    def test_standard_output_gets_only_the_result(self):
        result = terrace('cluster', self.blobs, '-o', '-', '--format', 'csv')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(result.stdout.splitlines()), len(self.points) + 1)
        self.assertIn('cost', result.stderr)
        result = terrace('cluster', self.blobs, '--labels', self.path('l.txt'))
        self.assertIn('lower bound', result.stdout)
        self.expect_error(2, 'cluster', self.blobs, '-o', '-', '--labels', '-')

    def test_equal_points_are_one_cluster(self):
        path = self.path('equal.csv')
        self.write(path, ['x', 'y', 'z'], [[1e6, 2e6, 3]] * 50)
        for method in METHODS:
            options = ['-k', 3] if method in COUNTING else []
            with self.subTest(method=method):
                summary, rows = self.clustered('--method', method, *options, source=path)
                self.assertEqual(len(rows), 50)
                self.assertGreaterEqual(summary['clusters'], 1)
                self.assertLessEqual(summary['clusters'], 3)
        one = self.path('one.csv')
        self.write(one, ['x', 'y', 'z'], [[1, 2, 3]])
        for method in METHODS:
            options = ['-k', 1] if method in COUNTING else []
            summary, rows = self.clustered('--method', method, *options, source=one)
            self.assertEqual((summary['clusters'], rows[0]['representative']), (1, '0'))

    def test_usage_errors_are_one_line_and_leave_no_files(self):
        none = self.path('none.csv')
        for options in (['--method', 'k-means'], ['--method', 'k-median'], ['--method', 'upgma'],
                        ['--method', 'ward'], ['--method', 'ward', '-k', 2, '--metric', 'minkowski:1'],
                        ['--method', 'average', '-k', 2, '--device', 'cuda'],
                        ['--method', 'single'], ['-k', 3], ['--method', 'k-means', '-k', 0],
                        ['--method', 'k-means', '-k', 1000], ['--height', 3],
                        ['--method', 'single', '-k', 2, '--height', 3],
                        ['--method', 'single', '-k', 2, '--metric', 'squared'],
                        ['--method', 'k-means', '-k', 2, '--metric', 'minkowski:1'],
                        ['--dendrogram', none], ['--facility-cost', 0], ['--metric', 'taxi'],
                        ['--strategy', 'magic'], ['--channel', 'x'], ['--iterations', 'many'],
                        ['--method', 'k-means', '-k', 2, '--batch', 4]):
            with self.subTest(options=options):
                self.expect_error(2, 'cluster', self.blobs, '-o', none, *options)
                self.assertFalse(os.path.exists(none))
        self.assertIn('no output given', self.expect_error(2, 'cluster', self.blobs))

    def test_bad_data_is_named(self):
        path = self.path('bad.csv')
        self.write(path, ['x', 'y', 'z', 'mass'], [[0, 0, 0, 1], [1, 1, 1, -1]])
        none = self.path('none.csv')
        self.assertIn('point 1', self.expect_error(1, 'cluster', path, '-o', none, '--weight', 'mass'))
        self.expect_error(1, 'cluster', self.path('nowhere.csv'), '-o', none)
        metric = self.path('bad.json')
        with open(metric, 'w') as file:
            json.dump({'regions': [{'semi_axes': [1, 0]}]}, file)
        self.assertIn('region 0', self.expect_error(1, 'cluster', self.blobs, '-o', none, '--metric',
                                                    f'elliptical:{metric}'))

    def test_too_little_memory_is_an_error_with_the_amount_needed(self):
        many = self.path('many.ply')
        self.run_ok('synth', 'uniform', '--points', 30000, '-o', many)
        for method in ('complete', 'average', 'weighted', 'primal-dual'):
            message = self.expect_error(1, 'cluster', many, '--method', method, '--labels',
                                        self.path('none.txt'), '--memory', '100M',
                                        *(['-k', 2] if method in LINKAGE else []))
            self.assertRegex(message, r'\d+ (bytes|MiB|GiB|B)')

    def test_ctrl_c_stops_long_work(self):
        many = self.path('interrupted.ply')
        self.run_ok('synth', 'uniform', '--points', 200000, '-o', many)
        tree = self.path('interrupted.csv')
        command = subprocess.Popen(
            [TERRACE, 'cluster', many, '--method', 'k-median', '-k', '50', '--labels', tree],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for_library(command, many)
        command.send_signal(signal.SIGINT)
        out, error = command.communicate(timeout=60)
        self.assertEqual(command.returncode, 130, error)
        self.assertEqual((out, error.count('\n')), ('', 1))
        self.assertFalse(os.path.exists(tree))

    @staticmethod
    def wait_for_library(command, path):
        """Waits until the input has been read and closed and a second thread works."""
        process = f'/proc/{command.pid}'
        while command.poll() is None:
            try:
                files = [os.readlink(f'{process}/fd/{fd}') for fd in os.listdir(process + '/fd')]
                threads = len(os.listdir(process + '/task'))
            except FileNotFoundError:
                continue  # it was closed meanwhile
            if threads > 1 and os.path.realpath(path) not in files:
                return
            time.sleep(0.001)

    def test_cuda_without_a_device_is_a_clear_error(self):
        tree = self.path('cuda.csv')
        result = terrace('cluster', self.blobs, '--method', 'complete', '--device', 'cuda',
                         '--dendrogram', tree)
        if result.returncode == 0:
            here = self.path('cpu.csv')
            self.run_ok('cluster', self.blobs, '--method', 'complete', '--dendrogram', here)
            self.assertEqual(self.read(tree), self.read(here))
        else:
            self.assertEqual(result.returncode, 1)
            self.assertIn('CUDA', result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1)
            self.assertFalse(os.path.exists(tree))

    def even(self, count):
        generator = random.Random(9)
        path = self.path(f'even{count}.csv')
        self.write(path, ['x', 'y', 'z'],
                   [[generator.uniform(0, 100) for _ in range(3)] for _ in range(count)])
        return path

    def test_more_effort_finds_cheaper_clusters(self):
        # Below 2500 points the search is exhaustive anyway.
        source = self.even(3000)
        standard, fine, full = (
            self.clustered('--effort', effort, '--bound-iterations', 0, source=source)[0]['cost']
            for effort in ('default', 'fine', 'full'))
        self.assertLess(fine, standard)
        self.assertLess(full, standard)

    def test_the_best_of_several_restarts_wins(self):
        source = self.even(400)
        for method in ('k-means', 'k-median'):
            costs = [self.clustered('--method', method, '-k', 12, '--restarts', restarts,
                                    source=source)[0]['cost'] for restarts in (1, 2, 4, 8)]
            self.assertEqual(costs, sorted(costs, reverse=True), method)
            self.assertLess(costs[-1], costs[0], method)

    def test_more_iterations_prove_a_higher_bound(self):
        bounds = []
        for iterations in (0, 2, 200):
            summary, _ = self.clustered('--facility-cost', 0.1, '--bound-iterations', iterations)
            bounds.append(summary['lower_bound'])
        self.assertIsNone(bounds[0])
        self.assertLess(bounds[1], bounds[2])
        self.assertLessEqual(bounds[2], summary['cost'])

    def test_a_bound_that_would_take_minutes_is_omitted_with_a_note(self):
        """One cluster of many points: a step of the bound examines all pairs of points."""
        source = self.even(30000)
        result = terrace('cluster', source, '--facility-cost', 1e6, '--labels', self.path('one.txt'), '--force')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('30,000 points, 1 cluster,', result.stdout)
        self.assertNotIn('lower bound', result.stdout)
        self.assertIn('no lower bound of the cost', result.stderr)
        summary, _ = self.clustered('--facility-cost', 1e6, '--bound-iterations', 1, source=source)
        self.assertLessEqual(summary['lower_bound'], summary['cost'])

    def test_z_weight_scales_the_influence_of_heights(self):
        generator = random.Random(11)
        points = [[generator.uniform(0, 100) for _ in range(3)] for _ in range(300)]
        heights = [p[2] for p in points]
        clouds = {'plain': points,
                  'mixed': [[x, y, z] for (x, y, _), z in zip(points, reversed(heights))],
                  'tall': [[x, y, 2 * z] for x, y, z in points],
                  'flat': [[x, y, 0] for x, y, _ in points]}

        def labels(name, *options):
            source = self.path(f'{name}.csv')
            self.write(source, ['x', 'y', 'z'], clouds[name])
            _, rows = self.clustered('--method', 'k-means', '-k', 9, *options, source=source)
            return [row['cluster'] for row in rows]

        self.assertNotEqual(labels('plain'), labels('flat'))
        self.assertEqual(labels('plain', '--z-weight', 0), labels('flat'))
        self.assertEqual(labels('mixed', '--z-weight', 0), labels('flat'))
        self.assertEqual(labels('plain', '--z-weight', 2), labels('tall'))


if __name__ == '__main__':
    unittest.main()
