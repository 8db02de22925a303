#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Assignment beside SciPy, both on one thread, on the same matrices: Euclidean distances between
two sets of n uniform points in the unit square. Needs numpy and scipy.

assignment_peers.py BENCH [N...]
BENCH  the program matching_assignment_bench
N      sizes, 500 1000 2000 4000 if not given
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


def main(bench, *sizes):
    ratios = []
    for n in [int(size) for size in sizes] or [500, 1000, 2000, 4000]:
        for seed in (1, 2, 3):
            draw = numpy.random.default_rng(seed)
            costs = cdist(draw.random((n, 2)), draw.random((n, 2)))
            start = time.perf_counter()
            rows, columns = linear_sum_assignment(costs)
            theirs = time.perf_counter() - start
            optimum = costs[rows, columns].sum()
            with tempfile.TemporaryDirectory() as folder:
                name = os.path.join(folder, 'costs')
                costs.tofile(name)
                words = subprocess.run([bench, '--peer', name, str(n)], check=True, text=True,
                                       stdout=subprocess.PIPE).stdout.split()
            ours = statistics.median(float(word) for word in words[:3])
            cost = float(words[3])
            assert abs(cost - optimum) <= 1e-9 * optimum, (cost, optimum)
            ratios.append(theirs / ours)
            print(f'n {n}, seed {seed}: SciPy {theirs:.4f} s; terrace {ours:.4f} s, '
                  f'{theirs / ours:.1f} times as fast; cost {cost:.9g} ({cost / optimum - 1:+.1e})',
                  flush=True)
    return 0 if min(ratios) >= 1 else 1


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
