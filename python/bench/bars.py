#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the module's speed with other packages.

Usage: bars.py HEIGHTS_SECONDS [WORD...]
HEIGHTS_SECONDS: the C++ program built with this module. WORD: measures only tasks whose names contain one of the words.
PYTHONPATH must contain the module.

Prints a row per task: seconds with all cores, with one thread and of the other package (each the least of several runs),
and the factor by which the module is faster with all cores. Tasks whose package is missing are skipped with a note.
"""

import math
import multiprocessing
import os
import platform
import subprocess
import sys
import tempfile
import time

import numpy as np

import terrace


def seconds(work, runs=3):
    least = math.inf
    for _ in range(runs):
        begin = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - begin)
    return least


def limited(work, limit):
    """Returns (seconds, whether it was stopped) for work() in a child process, stopped after `limit` seconds."""
    child = multiprocessing.get_context('fork').Process(target=work)
    begin = time.perf_counter()
    child.start()
    child.join(limit)
    late = child.is_alive()
    if late:
        child.kill()
        child.join()
    return time.perf_counter() - begin, late


def bar(what, needs, goal, run):
    try:
        __import__(needs)
    except ImportError as missing:
        print(f'{what}: {missing.name} is missing')
        return
    ours, one, theirs, *late = run()
    mark = '>' if any(late) else ' '
    print(f'{what:58} {ours:9.3f} {"" if one is None else format(one, ".3f"):>9} {mark}{theirs:9.3f} {mark}{theirs / ours:8.2f} x   '
          f'goal {goal}', flush=True)


def heights(program):
    random = np.random.default_rng(1)
    samples = np.cumsum(random.standard_normal((2000, 2000)), axis=0).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        store = terrace.build(samples, os.path.join(folder, 'dem'), transform=(10, 0, 500000, 0, -10, 5000000),
                              crs='EPSG:32632')
        places = random.random((1_000_000, 2)) * 19_000 + [500_500, 4_980_500]
        name = os.path.join(folder, 'places')
        places.tofile(name)
        cores = os.cpu_count() or 1

        def theirs(threads):
            printed = subprocess.run([program, os.path.join(folder, 'dem'), name, str(threads)], check=True, text=True,
                                     stdout=subprocess.PIPE).stdout.split()
            found = store.heights(places, threads=threads)
            assert math.isclose(math.fsum(found[~np.isnan(found)]), float(printed[1]), rel_tol=1e-9)
            return float(printed[0])

        # Alternately, because the machine's speed varies.
        turns = [(seconds(lambda: store.heights(places), 5), theirs(cores)) for _ in range(4)]
        return min(ours for ours, _ in turns), seconds(lambda: store.heights(places, threads=1), 5), min(other for _, other in turns)


def cloud():
    from scipy.interpolate import LinearNDInterpolator
    random = np.random.default_rng(2)
    points = random.random((1_000_000, 3)) * [1000, 1000, 50]
    places = random.random((1_000_000, 2)) * 980 + 10
    with tempfile.TemporaryDirectory() as folder:
        def ours(**options):
            store = terrace.build(points, os.path.join(folder, 'cloud'), replace=True, **options)
            return store.heights(places, **options)

        fast, one = seconds(ours, 2), seconds(lambda: ours(threads=1), 1)
        begin = time.perf_counter()
        expected = LinearNDInterpolator(points[:, :2], points[:, 2])(places)
        theirs = time.perf_counter() - begin
        np.testing.assert_allclose(ours(), expected, atol=1e-6)
    return fast, one, theirs


def linkage(method, peer='fastcluster'):
    points = np.random.default_rng(3).random((10_000, 2))
    if peer == 'scipy':
        from scipy.cluster import hierarchy
        theirs = seconds(lambda: hierarchy.linkage(points, method), 1)
    else:
        import fastcluster
        theirs = seconds(lambda: fastcluster.linkage_vector(points, method) if method in ('single', 'ward', 'centroid', 'median')
                         else fastcluster.linkage(points, method), 1)
    return (seconds(lambda: terrace.linkage(points, method)), seconds(lambda: terrace.linkage(points, method, threads=1)),
            theirs)


def matching():
    import networkx
    points = np.random.default_rng(4).random((2000, 2))

    def theirs():
        graph = networkx.Graph()
        distances = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
        graph.add_weighted_edges_from((i, j, distances[i, j]) for i in range(len(points)) for j in range(i))
        networkx.min_weight_matching(graph)

    lasted, late = limited(theirs, 60)
    return (seconds(lambda: terrace.matching(points)), seconds(lambda: terrace.matching(points, threads=1)), lasted, late)


def delaunay(kind, count, width):
    from scipy.spatial import Delaunay
    points = np.random.default_rng(5).random((count, width))
    theirs = seconds(lambda: Delaunay(points), 1)
    return seconds(lambda: kind(points).simplices), None, theirs


def k_means():
    from sklearn.cluster import KMeans
    random = np.random.default_rng(6)
    points = random.random((200_000, 3))
    start = points[:100]
    theirs = seconds(lambda: KMeans(100, init=start, n_init=1, max_iter=100, tol=0).fit(points), 1)
    ours = lambda **options: terrace.kmeans(points, start, max_iterations=100, **options)
    return seconds(ours), seconds(lambda: ours(threads=1)), theirs


def assignment(count, points):
    from scipy.optimize import linear_sum_assignment
    random = np.random.default_rng(7)
    if points:
        a, b = random.random((2, count, 2))
        costs = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
    else:
        costs = random.random((count, count))
    found = costs[linear_sum_assignment(costs)].sum()
    assert math.isclose(found, terrace.assignment(costs).cost, rel_tol=1e-9)
    return seconds(lambda: terrace.assignment(costs)), None, seconds(lambda: linear_sum_assignment(costs), 2)


def processor():
    with open('/proc/cpuinfo', encoding='utf-8') as file:
        return next((line.split(':')[1].strip() for line in file if line.startswith('model name')), platform.machine())


def main():
    print(f'{processor()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}')
    print(f'{"":58} {"ours":>9} {"1 thread":>9}  {"theirs":>9}  {"":8}')
    program, words = sys.argv[1], sys.argv[2:]
    for what, needs, goal, run in (
            ('heights, 1 M places of 4 M samples: C++', 'numpy', '0.9', lambda: heights(program)),
            ('heights, 1 M places in 1 M points, with build: SciPy', 'scipy', '10', cloud),
            ('linkage, single, 10,000 points: fastcluster', 'fastcluster', '3', lambda: linkage('single')),
            ('linkage, complete, 10,000 points: fastcluster', 'fastcluster', '3', lambda: linkage('complete')),
            *((f'linkage, {method}, 10,000 points: fastcluster', 'fastcluster', '-', lambda method=method: linkage(method))
              for method in ('average', 'weighted', 'ward', 'centroid', 'median')),
            ('linkage, average, 10,000 points: SciPy', 'scipy', '-', lambda: linkage('average', 'scipy')),
            ('linkage, ward, 10,000 points: SciPy', 'scipy', '-', lambda: linkage('ward', 'scipy')),
            ('linkage, centroid, 10,000 points: SciPy', 'scipy', '-', lambda: linkage('centroid', 'scipy')),
            ('matching, 2,000 points: networkx (60 s at most)', 'networkx', '100', matching),
            ('Delaunay2, 1 M points: SciPy', 'scipy', '5', lambda: delaunay(terrace.Delaunay2, 1_000_000, 2)),
            ('Delaunay3, 200,000 points: SciPy', 'scipy', '-', lambda: delaunay(terrace.Delaunay3, 200_000, 3)),
            ('kmeans, 200,000 points, k = 100, 100 rounds: scikit-learn', 'sklearn', '5', k_means),
            ('assignment, 4,000 x 4,000, uniform costs: SciPy', 'scipy', '2', lambda: assignment(4000, False)),
            ('assignment, 4,000 x 4,000, distances: SciPy', 'scipy', '2', lambda: assignment(4000, True))):
        if not words or any(word in what for word in words):
            bar(what, needs, goal, run)
    for before, what in (('time', 'including numpy'), ('numpy, time', 'after numpy')):
        code = f'import {before}; t = time.perf_counter(); import terrace; print(time.perf_counter() - t)'
        imported = min(float(subprocess.run([sys.executable, '-c', code], stdout=subprocess.PIPE, check=True).stdout)
                       for _ in range(5))
        print(f'import terrace, {what}: {imported:.3f} s   goal 0.2')


if __name__ == '__main__':
    main()
