#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares linkage of this library with fastcluster and SciPy, on the same machine in the same run.

    linkage_peers.py PROGRAM [single] [complete] [methods] [memory] [--full]

PROGRAM is cluster_linkage_bench. Without further arguments all parts run; `methods` are the other
five. Points are uniform in a cube. fastcluster's single linkage without a matrix is quadratic: it
is timed at 20 000 points and scaled to 100 000, or timed there with --full. Its complete linkage is
timed including the distances it needs (SciPy's pdist). Peak memory is that of the process minus its
previous memory. Times are the least of several.
"""
import json
import resource
import subprocess
import sys
import time


def counters(program, pattern, *options):
    output = subprocess.run(
        [program, f"--benchmark_filter={pattern}", "--benchmark_format=json", *options],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True, text=True).stdout
    return json.loads(output)["benchmarks"]


def ours(program, pattern):
    """Returns milliseconds by name of the benchmark, the least of the repetitions."""
    times = {}
    for run in counters(program, pattern, "--benchmark_repetitions=3", "--benchmark_min_time=0.2"):
        if run.get("run_type") == "iteration":
            name = run["run_name"]
            times[name] = min(times.get(name, float("inf")), run["real_time"])
    return times


def timed(runs, action):
    least = float("inf")
    for _ in range(runs):
        begin = time.perf_counter()
        action()
        least = min(least, time.perf_counter() - begin)
    return 1e3 * least


def peak_bytes():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def peer():
    try:
        import fastcluster
        import numpy
        from scipy.spatial.distance import pdist
    except ImportError as error:
        print(f"no comparison: {error}")
        return None
    return fastcluster, numpy, pdist


def compare_single(program, modules, full):
    times = ours(program, "single/cube")
    for name, value in times.items():
        print(f"{name:45} {value:9.1f} ms")
    if modules is None:
        return
    fastcluster, numpy, _ = modules
    count = 100000 if full else 20000
    points = numpy.random.default_rng(20).random((count, 3))
    value = timed(1 if full else 2, lambda: fastcluster.linkage_vector(points, method="single"))
    print(f"{f'fastcluster.linkage_vector single/{count}':45} {value:9.1f} ms")
    scaled = value * (100000 / count) ** 2
    for threads in 1, 2:
        own = times[f"single/cube/100000/{threads}/real_time"]
        note = "" if full else " (scaled)"
        print(f"100 000 points, {threads} threads: {scaled / own:.0f} times as fast{note}")


def compare_complete(program, modules):
    times = ours(program, "complete/.*/cube/10000")
    for name, value in times.items():
        print(f"{name:45} {value:9.1f} ms")
    if modules is None:
        return
    fastcluster, numpy, pdist = modules
    points = numpy.random.default_rng(20).random((10000, 3))
    value = timed(5, lambda: fastcluster.linkage(pdist(points), method="complete", preserve_input=False))
    print(f"{'pdist + fastcluster.linkage complete/10000':45} {value:9.1f} ms")
    for name, own in times.items():
        print(f"{name}: {value / own:.2f} times as fast")


def compare_methods(program, modules):
    for method in "average", "weighted", "ward", "centroid", "median":
        times = ours(program, f"{method}/cube")
        for name, value in times.items():
            print(f"{name:45} {value:9.1f} ms")
        if modules is None:
            continue
        from scipy.cluster import hierarchy
        fastcluster, numpy, _ = modules
        points = numpy.random.default_rng(20).random((10000, 3))
        fast = fastcluster.linkage if method in ("average", "weighted") else fastcluster.linkage_vector
        for name, run in (f"fastcluster.{fast.__name__}", fast), ("scipy.cluster.hierarchy.linkage", hierarchy.linkage):
            value = timed(2, lambda: run(points, method))
            print(f"{f'{name} {method}/10000':45} {value:9.1f} ms: {value / min(times.values()):.1f} times ours")


def compare_memory(program, modules):
    for entry in "float", "double":  # each in its own process
        peak = counters(program, f"complete/{entry}/cube/10000/1/")[0]["peak_MiB"]
        print(f"complete/{entry}, 10 000 points: {peak:.1f} MiB")
    if modules is None:
        return
    fastcluster, numpy, pdist = modules
    points = numpy.random.default_rng(20).random((10000, 3))
    small = points[:100]
    fastcluster.linkage(pdist(small), method="complete", preserve_input=False)
    before = peak_bytes()
    fastcluster.linkage(pdist(points), method="complete", preserve_input=False)
    print(f"pdist + fastcluster, 10 000 points: {(peak_bytes() - before) / (1 << 20):.1f} MiB")


def main():
    program = sys.argv[1]
    words = [word for word in sys.argv[2:] if word != "--full"]
    modules = peer()
    if "memory" in words or not words:  # first, because the peak of this process only rises
        compare_memory(program, modules)
    if "complete" in words or not words:
        compare_complete(program, modules)
    if "methods" in words or not words:
        compare_methods(program, modules)
    if "single" in words or not words:
        compare_single(program, modules, "--full" in sys.argv)


if __name__ == "__main__":
    main()
