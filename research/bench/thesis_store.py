#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reruns tables 7.2 and 7.3 of the thesis with files and stores.

J. Skála, Algorithms for manipulating large geometric data. Blocks of 10,000 points, facility cost
twice the diagonal. For each of the thesis's eight sets a file is made (`terrace synth`), built into
a store (`terrace build`), and clustered once more without files (hierarchy_time). Values are
medians of the runs. The thesis's figures follow in brackets. They come from other data and from the
plain search, and nothing is tested against them. Some files of the real-data folder that
TERRACE_DATA names are run too.

usage: thesis_store.py TERRACE HIERARCHY_TIME [--most 4000000] [--full] [--runs 3] [--threads 2]
                       [--data DIR] [--out DIR]
Give - as TERRACE to take the environment variable of that name.
"""
import argparse
import csv
import gzip
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile

BLOCK, FACILITY_COST = "10000", "2"

# Name, points, kind of `terrace synth`, its ending; seconds with and without I/O, share of I/O;
# points on levels 1, 2 and 3, megabytes.
THESIS = [
    ("Grand Canyon", 8_400_000, "dem", "tif", "26:55", "25:11", "6%", "37 991", "318", "", "89"),
    ("Puget Sound", 268_500_000, "dem", "tif", "14:15:24", "13:22:55", "6%", "1 173 166", "10 054", "144", "163"),
    ("Earth", 309_400_000, "dem", "tif", "16:09:24", "15:16:07", "6%", "1 065 485", "8 085", "", "87"),
    ("Lucy", 10_100_000, "surface", "ply", "33:03", "30:36", "7%", "64 978", "802", "", "81"),
    ("Power Plant", 11_100_000, "clusters", "ply", "36:22", "33:13", "9%", "52 084", "350", "", "83"),
    ("David", 28_200_000, "surface", "ply", "1:31:29", "1:24:12", "8%", "115 033", "867", "", "85"),
    ("St. Matthew", 187_000_000, "surface", "ply", "10:01:11", "9:14:39", "8%", "689 944", "6 610", "", "84"),
    ("David (2011)", 468_600_000, "surface", "ply", "25:52:53", "23:12:01", "10%", "1 861 811", "17 140", "187", "97"),
]
REAL = ["dem/gb_srtm3_mosaic_6001x4801.tif", "scan/armadillo_tm.ply", "scan/dragon_vrip_res2.ply.gz",
        "scan/lucy_100k.ply"]


def json_of(command):
    run = subprocess.run(command, stdout=subprocess.PIPE)
    if run.returncode != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return json.loads(run.stdout)


def unpacked(path, folder):
    """The file itself, or its decompressed copy if it is compressed by gzip."""
    if not path.endswith(".gz"):
        return path
    plain = os.path.join(folder, os.path.basename(path)[:-len(".gz")])
    with gzip.open(path) as packed, open(plain, "wb") as file:
        shutil.copyfileobj(packed, file)
    return plain


def quoted(figures):
    """Formats figures of the thesis."""
    return [f"[{figure}]" if figure else "" for figure in figures]


def synth(options, folder, kind, ending, points, seed):
    """Makes a file of about `points` points; a surface has its rows in order, like a scan."""
    path = os.path.join(folder, f"input.{ending}")
    size = ["--points", str(points)]
    if kind == "dem":
        side = math.isqrt(points)
        size = ["--size", f"{side}x{side}"]
    subprocess.run([options.terrace, "synth", kind, *size, "--seed", str(seed), "-o", path, "--force", "-q"],
                   check=True)
    return path


def measure(options, path, folder):
    """Builds and clusters a file; returns its rows of both tables without the name and the thesis's figures."""
    store = os.path.join(folder, "store")
    builds, bare = [], []
    for _ in range(options.runs):
        builds.append(json_of([options.terrace, "build", path, "-o", store, "--block", BLOCK, "--facility-cost",
                               FACILITY_COST, "--threads", str(options.threads), "--force", "--json", "-q"]))
        bare.append(json_of([options.io_bench, path, BLOCK, FACILITY_COST, str(options.threads)]))
    points = builds[0]["points"]
    if any(run["points"] != points for run in builds + bare):
        sys.exit(f"{path}: the runs disagree on the number of points")
    levels = [level["points"] for level in json_of([options.terrace, "info", store, "--json"])["levels"]]
    if levels[0] != points or any(a <= b for a, b in zip(levels, levels[1:])):
        sys.exit(f"{path}: {points} points, but levels of {levels}")
    total = statistics.median(run["seconds"] for run in builds)
    without = statistics.median(run["seconds"] for run in bare)
    peak = max(run["peak_rss_bytes"] for run in builds)
    on_level = [f"{levels[i]:,}".replace(",", " ") if i < len(levels) else "" for i in (1, 2, 3)]
    size = f"{points:,}".replace(",", " ")
    return ([size, f"{total:.3f}", f"{without:.3f}", f"{1 - without / total:.0%}"],
            [size, *on_level, f"{peak / 1e6:.0f}"])


def show(options, name, title, columns, rows):
    widths = [max(len(row[i]) for row in [columns] + rows) for i in range(len(columns))]
    print(f"\n{title}")
    for row in [columns] + rows:
        print("  ".join(cell.ljust(w) if i == 0 else cell.rjust(w)
                        for i, (cell, w) in enumerate(zip(row, widths))))
    if options.out:
        with open(os.path.join(options.out, f"{name}.csv"), "w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([columns] + rows)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("terrace")
    parser.add_argument("io_bench")
    parser.add_argument("--most", type=int, default=4_000_000, help="points per set")
    parser.add_argument("--full", action="store_true",
                        help="as many points as the thesis: files of up to 11.2 GB, one at a time")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--data", default=os.environ.get("TERRACE_DATA"), help="folder of real data")
    parser.add_argument("--out", help="folder for CSV files")
    options = parser.parse_args()
    if options.terrace == "-":
        options.terrace = os.environ["TERRACE"]
    if options.out:
        os.makedirs(options.out, exist_ok=True)

    times, counts = [], []
    for seed, (name, size, kind, ending, *thesis) in enumerate(THESIS, start=1):
        size = size if options.full else min(size, options.most)
        with tempfile.TemporaryDirectory() as folder:
            time, count = measure(options, synth(options, folder, kind, ending, size, seed), folder)
        times.append([f"{kind}, as {name}", *time, *quoted(thesis[:3])])
        counts.append([f"{kind}, as {name}", *count, *quoted(thesis[3:])])
    for file in REAL if options.data else []:
        with tempfile.TemporaryDirectory() as folder:
            time, count = measure(options, unpacked(os.path.join(options.data, file), folder), folder)
        times.append([file, *time, "", "", ""])
        counts.append([file, *count, "", "", "", ""])

    with_threads = f"Blocks of {BLOCK}, facility cost {FACILITY_COST} x diagonal, {options.threads} threads"
    show(options, "table-7.2",
         f"Table 7.2: time with and without I/O. {with_threads}; seconds, medians of {options.runs}.\n"
         "The fast clustering is used instead of the thesis's, so the share of I/O is greater. [..] the thesis.",
         ["set", "points", "with I/O", "without", "share of I/O", "[with I/O]", "[without]", "[share]"], times)
    show(options, "table-7.3",
         f"Table 7.3: points per level, and memory of the whole process. {with_threads}. [..] the thesis, more points.",
         ["set", "points", "level 1", "level 2", "level 3", "MB", "[level 1]", "[level 2]", "[level 3]", "[MB]"],
         counts)


if __name__ == "__main__":
    main()
