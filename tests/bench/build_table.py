#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times `terrace build` as a whole process and compares the size of its store with a deflate GeoTIFF.

Prints one Markdown table. Per input: the median of the runs (wall clock, fsync included), points per
second, peak resident set, bytes of the store, and bytes of the same raster written by
    gdal_translate -co COMPRESS=DEFLATE -co PREDICTOR=2 -co TILED=YES
(predictor 3 for floats). Without gdal_translate that column says so.

usage: build_table.py TERRACE [--size 8192x8192] [--runs 5] [--threads 2] [RASTER ...]
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile


def run(command):
    """Runs the command; returns its stdout, wall seconds and peak resident bytes."""
    read, write = os.pipe()
    pid = os.fork()
    start = os.times().elapsed
    if pid == 0:
        os.close(read)
        os.dup2(write, 1)
        try:
            os.execvp(command[0], command)
        finally:
            os._exit(127)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        output = pipe.read()
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return output, os.times().elapsed - start, usage.ru_maxrss * 1024


def deflate_bytes(raster, folder, is_float):
    if shutil.which("gdal_translate") is None:
        return None
    out = os.path.join(folder, "deflate.tif")
    subprocess.run(["gdal_translate", "-q", "-co", "COMPRESS=DEFLATE", "-co",
                    f"PREDICTOR={3 if is_float else 2}", "-co", "TILED=YES", raster, out],
                   check=True, stderr=subprocess.DEVNULL)
    size = os.path.getsize(out)
    os.remove(out)
    return size


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("terrace")
    parser.add_argument("rasters", nargs="*")
    parser.add_argument("--size", default="8192x8192")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", default="2")
    options = parser.parse_args()

    print("| input | points | build, s | M points/s | peak MiB | store bytes | B/point | deflate bytes | ratio |")
    print("|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        synth = os.path.join(folder, "synth.tif")
        subprocess.run([options.terrace, "synth", "dem", "--size", options.size, "-o", synth, "-q"],
                       check=True)
        for raster in [synth] + options.rasters:
            store = os.path.join(folder, "store")
            walls, peaks, summary = [], [], {}
            for _ in range(options.runs + 1):  # the first run warms the cache
                output, wall, peak = run([options.terrace, "build", raster, "-o", store, "--force", "--json",
                                          "-q", "--threads", options.threads])
                summary = json.loads(output)
                walls.append(wall)
                peaks.append(peak)
            wall, peak = statistics.median(walls[1:]), max(peaks[1:])
            info = json.loads(run([options.terrace, "info", store, "--json"])[0])
            is_float = any(c["name"] == "z" and c["type"].startswith("float") for c in info["channels"])
            deflate = deflate_bytes(raster, folder, is_float)
            points, size = summary["points"], summary["store_bytes"]
            name = f"synth dem {options.size}" if raster == synth else os.path.basename(raster)
            print(f"| {name} | {points:,} | {wall:.2f} | {points / wall / 1e6:.1f} | {peak / 2**20:.0f} "
                  f"| {size:,} | {size / points:.3f} | " +
                  (f"{deflate:,} | {size / deflate:.3f} |" if deflate else "no gdal_translate | |"))


if __name__ == "__main__":
    main()
