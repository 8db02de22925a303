#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares assignment with SciPy on the same points, both on one thread.

The points are two sets of n uniform points in the unit square with Euclidean costs. The matrix and
the candidates (the 40 nearest columns of each row) are made before the clock starts; `points` makes
its own. Needs numpy and scipy. The exit status is 0 if `matrix` is never slower than SciPy and
`points` is at least 10 times as fast from n = 4000 on.

assignment_peers.py BENCH [N...]
BENCH  the program matching_assignment_bench
N      sizes; 500 1000 2000 4000 by default
"""

import os

for variable in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ[variable] = '1'

import statistics
import subprocess
import sys
import tempfile
import time

import numpy
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist


BARS = {'matrix': 1, 'points': 10}  # least speed-up over SciPy; for points from n = 4000 on


def main(bench, *sizes):
    met = True
    for n in [int(size) for size in sizes] or [500, 1000, 2000, 4000]:
        for seed in (1, 2, 3):
            points = numpy.random.default_rng(seed).random((2 * n, 2))
            costs = cdist(points[:n], points[n:])
            times = []
            for _ in range(3 if n < 4000 else 1):
                start = time.perf_counter()
                rows, columns = linear_sum_assignment(costs)
                times.append(time.perf_counter() - start)
            theirs = statistics.median(times)
            optimum = costs[rows, columns].sum()
            with tempfile.TemporaryDirectory() as folder:
                name = os.path.join(folder, 'points')
                points.tofile(name)
                lines = subprocess.run([bench, '--peer', name, str(n)], check=True, text=True,
                                       stdout=subprocess.PIPE).stdout.splitlines()
            print(f'n {n}, seed {seed}: SciPy {theirs:.4f} s')
            for line in lines:
                way, *numbers = line.split()
                ours, cost = statistics.median(map(float, numbers[:3])), float(numbers[3])
                print(f'    terrace, {way:10s} {ours:.4f} s, {theirs / ours:6.1f} times as fast; '
                      f'cost {cost:.9g} ({cost / optimum - 1:+.1e})', flush=True)
                if way in BARS:
                    assert abs(cost - optimum) <= 1e-9 * optimum, (cost, optimum)
                    met = met and (theirs / ours >= BARS[way] or (way == 'points' and n < 4000))
    return 0 if met else 1


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
