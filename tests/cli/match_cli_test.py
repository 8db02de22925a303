#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the verb `match` end to end.

TERRACE=path/to/terrace match_cli_test.py
"""

import csv
import json
import math
import os
import random
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


def optimum(points):
    """The least total distance, found by trying all pairings."""
    if not points:
        return 0.0
    first, rest = points[0], points[1:]
    return min(math.dist(first, other) + optimum(rest[:i] + rest[i + 1:])
               for i, other in enumerate(rest))


class MatchTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def points(self, count, seed=1):
        generator = random.Random(seed)
        points = [[generator.uniform(0, 100) for _ in range(3)] for _ in range(count)]
        with open(self.path('points.csv'), 'w', newline='') as file:
            writer = csv.writer(file)
            writer.writerow(['x', 'y', 'z'])
            writer.writerows(points)
        return points

    def match(self, *options):
        out = self.path('pairs.csv')
        result = terrace('match', self.path('points.csv'), '-o', out, '--json', '--force', *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(out, newline='') as file:
            return json.loads(result.stdout), list(csv.DictReader(file))

    def check(self, points, summary, rows):
        self.assertLessEqual({'pairs', 'cost', 'iterations', 'unmatched', 'seconds'}, set(summary))
        self.assertEqual(summary['pairs'], len(points) // 2)
        self.assertEqual(summary['unmatched'], len(points) % 2)
        ends = [int(row[end]) for row in rows for end in 'ab']
        self.assertEqual(len(set(ends)), len(ends))
        if summary['unmatched']:
            self.assertEqual(set(range(len(points))) - set(ends), {summary['left_over']})
        for row in rows:
            self.assertLess(int(row['a']), int(row['b']))
            self.assertAlmostEqual(float(row['distance']),
                                   math.dist(points[int(row['a'])], points[int(row['b'])]), places=9)
        self.assertAlmostEqual(summary['cost'], sum(float(row['distance']) for row in rows), places=6)

    def test_exact_is_the_optimum(self):
        for seed in range(5):
            points = self.points(10, seed)
            summary, rows = self.match()
            self.check(points, summary, rows)
            self.assertAlmostEqual(summary['cost'], optimum(points), places=6)
            self.assertAlmostEqual(summary['lower_bound'], summary['cost'], places=6)

    def test_an_odd_number_of_points_leaves_one_over(self):
        points = self.points(9)
        summary, rows = self.match('--method', 'exact')
        self.check(points, summary, rows)
        self.assertAlmostEqual(summary['cost'],
                               min(optimum(points[:i] + points[i + 1:]) for i in range(9)), places=6)
        self.points(1)
        summary, rows = self.match()
        self.assertEqual((summary['pairs'], summary['left_over'], rows), (0, 0, []))

    def test_halving_is_close_to_the_optimum_and_never_below(self):
        points = self.points(101)
        exact, _ = self.match()
        monotone, rows = self.match('--method', 'monotone')
        self.check(points, monotone, rows)
        published, rows = self.match('--method', 'monte-carlo', '--iterations', 50)
        self.check(points, published, rows)
        self.assertEqual(published['iterations'], 50)
        self.assertLessEqual(exact['cost'], monotone['cost'] + 1e-6)
        self.assertLess(monotone['cost'], 1.05 * exact['cost'])
        self.assertGreater(published['cost'], monotone['cost'])
        self.assertIsNone(published['lower_bound'])

    def test_threads_never_change_the_bytes(self):
        self.points(60)
        labels = self.labels(k % 3 for k in range(60))
        for options in (['--method', 'monte-carlo', '--iterations', 20],
                        ['--labels', labels], ['--labels', labels, '--tree']):
            outputs = set()
            for threads in (1, 3):
                self.match('--threads', threads, *options)
                with open(self.path('pairs.csv'), 'rb') as file:
                    outputs.add(file.read())
            self.assertEqual(len(outputs), 1)

    def labels(self, numbers):
        path = self.path('labels.txt')
        with open(path, 'w') as file:
            file.writelines(f'{number}\n' for number in numbers)
        return path

    def test_clusters_first_then_windows(self):
        points = self.points(301)
        exact, _ = self.match()
        self.assertTrue(exact['optimal'])
        # -1 means no cluster.
        labels = self.labels(-1 if x < 20 else int(x > 50) * 4000000000 for x, _, _ in points)
        summary, rows = self.match('--labels', labels)
        self.check(points, summary, rows)
        self.assertEqual(summary['clusters'], 3)
        self.assertAlmostEqual(summary['cost'], exact['cost'], places=6)

    def tree_of(self, points, *options):
        """Returns the rows of a tree after checking it: each node is used once, levels increase, midpoints are weighted."""
        summary, rows = self.match('--tree', *options)
        n = len(points)
        self.assertEqual(len(rows), n - 1)
        self.assertEqual(summary['pairs'], n - 1)
        nodes = [(point, 1, 0) for point in points]
        unused = set(range(n))
        for k, row in enumerate(rows):
            a, b = int(row['a']), int(row['b'])
            self.assertLess(a, b)
            unused -= {a, b}
            (p, p_size, p_level), (q, q_size, q_level) = nodes[a], nodes[b]
            size, level = int(row['size']), int(row['level'])
            self.assertEqual(size, p_size + q_size)
            self.assertGreater(level, max(p_level, q_level))
            self.assertAlmostEqual(float(row['distance']), math.dist(p, q), places=7)
            nodes.append(([(x * p_size + y * q_size) / size for x, y in zip(p, q)], size, level))
            unused.add(n + k)
        self.assertEqual(unused, {len(nodes) - 1})
        self.assertAlmostEqual(summary['cost'], sum(float(row['distance']) for row in rows), places=6)
        self.assertEqual(summary['levels'], max((int(row['level']) for row in rows), default=0))
        return summary, rows

    def test_the_tree_of_repeated_matching(self):
        points = self.points(90)
        _, pairs = self.match()
        for options in ([], ['--method', 'exact'], ['--method', 'monotone'],
                        ['--method', 'monte-carlo', '--iterations', 5]):
            summary, rows = self.tree_of(points, *options)
            # ceil(log2 90)
            self.assertEqual(summary['levels'], 7)
            if not options or options[1] == 'exact':
                lowest = [(row['a'], row['b']) for row in rows if row['level'] == '1']
                self.assertEqual(set(lowest), {(row['a'], row['b']) for row in pairs})
        self.tree_of(self.points(1))

    def test_a_cluster_is_a_subtree(self):
        points = self.points(77)
        labels = [int(x > 30) for x, _, _ in points]
        for options in ([], ['--method', 'monotone']):
            _, rows = self.tree_of(points, '--labels', self.labels(labels), *options)
            clusters = [{label} for label in labels]
            for row in rows[:-1]:
                both = clusters[int(row['a'])] | clusters[int(row['b'])]
                self.assertEqual(len(both), 1)
                clusters.append(both)

    def test_labels_must_match_the_points(self):
        self.points(4)
        out = self.path('none.csv')
        for text, where in (('0\n1\n', '2 labels for 4 points'), ('0\n1\nx\n1\n', 'line 3'),
                            ('0\n1\n\n1\n', 'line 3'), ('0\n1\n4294967295\n1\n', 'line 3'),
                            ('0\n1\n-2\n1\n', 'line 3'), ('0\n1\n2\n1\n1\n', 'line 5')):
            with open(self.path('labels.txt'), 'w') as file:
                file.write(text)
            result = terrace('match', self.path('points.csv'), '-o', out, '--labels',
                             self.path('labels.txt'))
            self.assertEqual(result.returncode, 1)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            self.assertIn('labels.txt', result.stderr)
            self.assertIn(where, result.stderr)
            self.assertFalse(os.path.exists(out))

    def test_too_little_memory_is_an_error_before_the_work(self):
        self.points(60000)
        result = terrace('match', self.path('points.csv'), '-o', self.path('none.csv'),
                         '--memory', '40M')
        self.assertEqual(result.returncode, 1)
        self.assertIn('takes about', result.stderr)
        self.assertIn('at least', terrace('match', self.path('points.csv'), '-o', self.path('none.csv'),
                                          '--memory', '8M').stderr)

    def test_errors_are_one_line(self):
        self.points(10)
        source, out = self.path('points.csv'), self.path('none.csv')
        for code, options in ((2, ['--method', 'best']), (2, ['--iterations', 3]),
                              (2, ['--seconds', 1]), (1, ['--labels', self.path('nowhere.txt')]),
                              (2, ['--method', 'exact', '--labels', source]),
                              (2, ['--method', 'monotone', '--iterations', 0])):
            result = terrace('match', source, '-o', out, *options)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            self.assertFalse(os.path.exists(out))
        self.assertEqual(terrace('match', self.path('nowhere.csv'), '-o', out).returncode, 1)
        result = terrace('match', source, '-o', '-')
        self.assertEqual(len(result.stdout.splitlines()), 6)
        self.assertIn('the optimum', result.stderr)

    def test_z_weight_scales_the_influence_of_heights(self):
        points = self.points(10, 3)
        for weight in (0, 0.5, 4):
            weighed = [[x, y, weight * z] for x, y, z in points]
            summary, rows = self.match('--z-weight', weight)
            self.check(weighed, summary, rows)
            self.assertAlmostEqual(summary['cost'], optimum(weighed), places=6)


if __name__ == '__main__':
    unittest.main()
