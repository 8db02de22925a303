#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares linkage with SciPy's on real data.

    linkage_scipy_vectors.py PROGRAM [DATA]

PROGRAM is examples/linkage. DATA, or the environment variable TERRACE_DATA, names a folder with
clustering/linkage/SET_NAME.METHOD.Z.gz (linkage matrices of SciPy) and clustering/SET/NAME.data.gz
(the points). Needs only the standard library.

If no heights are equal, the rows must be the same; with average and weighted linkage, always. If
some heights are equal, SciPy's dendrogram is one of several. Single linkage still has the same
heights. For the other methods each row is checked against the points: the height must be the
distance of the two clusters, and no two clusters may be nearer at that moment. Exits with 77
(skipped) if there are no vectors.
"""
import gzip
import math
import os
import pathlib
import subprocess
import sys

TOLERANCE = 1e-12
FLOAT_TOLERANCE = 1e-7
SQUARES_TOLERANCE = 1e-9  # SciPy subtracts squares


def rows_of(text):
    rows = [line.replace(",", " ").split() for line in text.splitlines() if line.strip()]
    return [(int(float(a)), int(float(b)), float(h), int(float(s))) for a, b, h, s in rows]


def read(path):
    with gzip.open(path, "rt") as stream:
        return stream.read()


def close(x, y, tolerance):
    return abs(x - y) <= tolerance * max(abs(x), abs(y))


def combined(method, a, b, between, na, nb, n):
    """Returns the distance to a cluster of two parts (G. Lance, W. Williams)."""
    if method == "complete":
        return max(a, b)
    if method == "ward":
        square = ((n + na) * a * a + (n + nb) * b * b - n * between * between) / (n + na + nb)
    elif method == "centroid":
        square = (na * a * a + nb * b * b) / (na + nb) - na * nb * between * between / (na + nb) ** 2
    else:
        square = (a * a + b * b) / 2 - between * between / 4
    return math.sqrt(max(square, 0.0))


def run_fault(points, rows, method, tolerance):
    """Returns the first fault of the rows as a run of linkage, or None."""
    count = len(points)
    size = {i: 1 for i in range(count)}
    distance = {i: {} for i in range(count)}
    for i in range(count):
        for j in range(i):
            distance[i][j] = distance[j][i] = math.dist(points[i], points[j])
    nearest = {i: min(distance[i].values()) for i in distance}
    # Differences of squares lose digits.
    slack = 0.0 if method == "complete" else 1e-9 * max(map(max, map(dict.values, distance.values())))
    for r, (a, b, height, points_) in enumerate(rows):
        if abs(height - distance[a][b]) > tolerance * height + slack:
            return f"row {r}: height {height} is not {distance[a][b]}"
        if min(nearest.values()) < height * (1 - tolerance) - slack:
            return f"row {r}: others are nearer"
        first, second = distance.pop(a), distance.pop(b)
        new = {k: combined(method, first[k], second[k], first[b], size[a], size[b], size[k])
               for k in first if k != b}
        size[count + r] = points_
        for k, value in new.items():
            row = distance[k]
            gone = min(row.pop(a), row.pop(b))
            row[count + r] = value
            if nearest[k] >= gone:
                nearest[k] = min(row.values())
            else:
                nearest[k] = min(nearest[k], value)
        del nearest[a], nearest[b]
        distance[count + r] = new
        nearest[count + r] = min(new.values(), default=math.inf)
    return None


def fault(points, expected, rows, method, tolerance):
    if len(rows) != len(expected):
        return f"{len(rows)} rows instead of {len(expected)}"
    heights = sorted(row[2] for row in expected)
    ties = any(heights[r] * (1 + 4 * tolerance) >= heights[r + 1] for r in range(len(heights) - 1))
    if not ties or method in ("average", "weighted"):
        for r, (x, y) in enumerate(zip(expected, rows)):
            if {x[0], x[1]} != {y[0], y[1]} or x[3] != y[3] or not close(x[2], y[2], tolerance):
                return f"row {r}: {y} instead of {x}"
        return None
    if method == "single":
        for r, (x, y) in enumerate(zip(expected, rows)):
            if not close(x[2], y[2], tolerance):
                return f"row {r}: height {y[2]} instead of {x[2]}"
        return None
    return run_fault(points, rows, method, tolerance)


def main():
    folder = sys.argv[2] if len(sys.argv) > 2 else os.environ.get("TERRACE_DATA")
    if not folder:
        print("TERRACE_DATA names no folder")
        return 77
    program, data = sys.argv[1], pathlib.Path(folder) / "clustering"
    vectors = sorted(data.glob("linkage/*.*.Z.gz"))
    if not vectors:
        print(f"no vectors in {data}")
        return 77
    failures = 0
    for path in vectors:
        name, method = path.name.split(".")[:2]
        group, points_name = name.split("_", 1)
        text = read(data / group / (points_name + ".data.gz"))
        points = [tuple(map(float, line.split())) for line in text.splitlines() if line.strip()]
        expected = rows_of(read(path))
        entries = [(method, TOLERANCE)]
        if method == "complete":
            entries.append(("complete-float", FLOAT_TOLERANCE))
        elif method in ("ward", "centroid", "median"):
            entries = [(method, SQUARES_TOLERANCE)]
        for entry, tolerance in entries:
            for threads in "1", "2":
                output = subprocess.run([program, entry, threads], input=text, text=True,
                                        stdout=subprocess.PIPE, check=True).stdout
                wrong = fault(points, expected, rows_of(output), method, tolerance)
                print(f"{name} {entry}, {threads} threads: {wrong or 'as SciPy'}")
                failures += wrong is not None
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
