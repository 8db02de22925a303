#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares k-means with scikit-learn from the same centres until no assignment changes.

Both run on one thread. Needs numpy and scikit-learn. The exit status is 0 if this library is at
least as fast with every seed.

k_means_peers.py BENCH DATA [K]
BENCH  the program cluster_k_means_bench
DATA   text, one point per line (two or three numbers), gzipped or not, for example the set birch1
K      number of centres, 100 by default; they are points drawn with the seeds 1, 2 and 3
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
from sklearn.cluster import KMeans


def main(bench, data, k=100):
    points = numpy.loadtxt(data)
    flat = numpy.zeros((len(points), 3))
    flat[:, :points.shape[1]] = points
    ratios = []
    for seed in (1, 2, 3):
        places = numpy.random.default_rng(seed).choice(len(points), int(k), replace=False)
        model = KMeans(int(k), init=points[places], n_init=1, algorithm='elkan', tol=0,
                       max_iter=100000)
        start = time.perf_counter()
        model.fit(points)
        theirs = time.perf_counter() - start
        with tempfile.TemporaryDirectory() as folder:
            names = [os.path.join(folder, name) for name in ('points', 'centres')]
            flat.tofile(names[0])
            flat[places].tofile(names[1])
            words = subprocess.run([bench, '--peer', *names], check=True, text=True,
                                   stdout=subprocess.PIPE).stdout.split()
        times = [float(word) for word in words[:-2]]
        ours = statistics.median(times)
        sse, iterations = float(words[-2]), int(words[-1])
        ratios.append(theirs / ours)
        print(f'seed {seed}: scikit-learn {theirs:.4f} s, SSE {model.inertia_:.8g}, '
              f'{model.n_iter_} iterations; terrace {ours:.4f} s [{min(times):.4f}..'
              f'{max(times):.4f}], SSE {sse:.8g} ({sse / model.inertia_ - 1:+.1e}), '
              f'{iterations} iterations; {ratios[-1]:.1f} times as fast')
    return 0 if min(ratios) >= 1 else 1


if __name__ == '__main__':
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
