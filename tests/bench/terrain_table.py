#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Times error-bounded meshes, web-globe tiles and heights at points, each as a whole process.

Prints five Markdown tables, medians of the runs.
meshes: triangles, seconds of reading (decoding with checksums) and of meshing (with the check of every
sample; summed over threads), wall clock.
tiles: the raster in longitude and latitude, from zoom 0 to the one that shows every sample.
heights: a million random places in one call.
points: the samples of the tiled raster as irregular points.
passes: a scan in overlapping swaths, followed by as many points in random order.

usage: terrain_table.py TERRACE [--size 2049x2049] [--runs 3] [--errors 20,5,1] [--points 1000000]
                        [--pass 5000000] [--dem FILE.tif] [--tile-dem FILE.tif]
                        [--only meshes,tiles,heights,points,passes]
"""
import argparse
import json
import math
import os
import random
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time


def terrace(command, *args):
    """Runs a verb; returns its summary, with the wall and CPU seconds of the process."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    result = subprocess.run([command, *map(str, args), '--json', '-q'], capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(f"failed: terrace {' '.join(map(str, args))}\n{result.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    summary = json.loads(result.stdout)
    summary['wall'] = time.monotonic() - start
    summary['cpu'] = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return summary


def median(runs, key):
    return statistics.median(run[key] for run in runs)


def mesh_table(options, store, folder):
    print('| mesh | threads | triangles | max error | reading s | meshing s | wall s | peak MiB |')
    print('|---|---|---|---|---|---|---|---|')
    for error in options.errors.split(','):
        for quality in ('greedy', 'removal', 'fitted'):
            for threads in (1, 2):
                runs = [terrace(options.terrace, 'mesh', store, '-o', os.path.join(folder, 'm.ply'),
                                '--force', '--max-error', error, '--quality', quality, '--threads',
                                threads) for _ in range(options.runs)]
                print(f"| {quality}, {error} m | {threads} | {runs[0]['triangles']:,} "
                      f"| {runs[0]['max_error']:.5f} | {median(runs, 'reading_seconds'):.3f} "
                      f"| {median(runs, 'meshing_seconds'):.3f} | {median(runs, 'wall'):.2f} "
                      f"| {runs[0]['peak_rss_bytes'] / 2**20:.0f} |", flush=True)


def tile_table(options, store, folder):
    print('\n| tiles | threads | number | bytes | deepest zoom, error | CPU s | wall s | peak MiB |')
    print('|---|---|---|---|---|---|---|---|')
    for quality in ('greedy', 'removal'):
        for bound in ((), ('--max-error', '0.94')):
            for threads in (1, 2):
                runs = []
                for k in range(options.runs):
                    out = os.path.join(folder, f'tiles-{quality}-{len(bound)}-{threads}-{k}')
                    runs.append(terrace(options.terrace, 'tile', store, '-o', out, '--vertical',
                                        'ignore', '--quality', quality, '--threads', threads, *bound))
                last = runs[0]['zooms'][-1]
                print(f"| {quality}{', 0.94 m' if bound else ''} | {threads} | {runs[0]['tiles']:,} "
                      f"| {runs[0]['bytes']:,} | {last['zoom']}, {last['max_error']:.3f} m "
                      f"| {median(runs, 'cpu'):.2f} | {median(runs, 'wall'):.2f} "
                      f"| {runs[0]['peak_rss_bytes'] / 2**20:.0f} |", flush=True)


def sample_table(options, store, folder):
    box = terrace(options.terrace, 'info', store)['bounds']
    places = os.path.join(folder, 'places.csv')
    choice = random.Random(1)
    with open(places, 'w') as file:
        file.write('x,y\n')
        for _ in range(options.points):
            x, y = (choice.uniform(box['min'][k], box['max'][k]) for k in (0, 1))
            file.write(f'{x:.3f},{y:.3f}\n')
    print('\n| heights | threads | points | CPU s | wall s | M points/s |')
    print('|---|---|---|---|---|---|')
    for method in ('linear', 'natural', 'nearest'):
        for threads in (1, 2):
            runs = [terrace(options.terrace, 'sample', store, '--points', places, '--method', method,
                            '-o', os.path.join(folder, 'h.csv'), '--force', '--threads', threads)
                    for _ in range(options.runs)]
            print(f"| {method} | {threads} | {options.points:,} | {median(runs, 'cpu'):.2f} "
                  f"| {median(runs, 'wall'):.2f} | {options.points / median(runs, 'wall') / 1e6:.2f} |",
                  flush=True)


def cloud_table(options, store, folder):
    """Times the same verbs on the samples of a raster as irregular points."""
    points, cloud = os.path.join(folder, 'cloud.xyz'), os.path.join(folder, 'cloud.terrace')
    system = terrace(options.terrace, 'info', store)['crs']['epsg']
    terrace(options.terrace, 'points', store, '-o', points)
    terrace(options.terrace, 'build', points, '--crs', f'EPSG:{system}', '-o', cloud)
    bounds = terrace(options.terrace, 'info', store)['bounds']
    places = os.path.join(folder, 'cloud.csv')
    choice = random.Random(1)
    with open(places, 'w') as file:
        file.write('x,y\n')
        for _ in range(options.points):
            file.write(','.join(f"{choice.uniform(bounds['min'][k], bounds['max'][k]):.9f}"
                                for k in (0, 1)) + '\n')
    out = os.path.join(folder, 'cloud-out')
    jobs = [(f'mesh, {error} m', ('mesh', cloud, '-o', f'{out}.ply', '--force', '--max-error', error), 'triangles')
            for error in options.errors.split(',')]
    jobs += [('tiles', ('tile', cloud, '-o', out, '--force', '--vertical', 'ignore'), 'tiles')]
    jobs += [(f'heights, {method}', ('sample', cloud, '--points', places, '--method', method, '-o',
                                    f'{out}.csv', '--force'), 'answered')
             for method in ('linear', 'natural', 'nearest')]
    print('\n| irregular points | threads | number | CPU s | wall s | peak MiB |')
    print('|---|---|---|---|---|---|')
    for name, verb, key in jobs:
        for threads in (1, 2):
            runs = []
            for _ in range(options.runs):
                shutil.rmtree(out, ignore_errors=True)  # otherwise existing tiles are kept
                runs.append(terrace(options.terrace, *verb, '--threads', threads))
            print(f"| {name} | {threads} | {runs[0][key]:,} | {median(runs, 'cpu'):.2f} "
                  f"| {median(runs, 'wall'):.2f} | {runs[0]['peak_rss_bytes'] / 2**20:.0f} |", flush=True)


def write_passes(path, points):
    """Writes two passes of `points` points each over 10 km x 10 km: swaths of 1,000 m, of which half
    overlaps the next, then random positions."""
    side, swath, choice = 10000.0, 1000.0, random.Random(1)
    lines = [k * swath / 2 for k in range(int(2 * side / swath) - 1)]
    spacing = math.sqrt(len(lines) * swath * side / points)

    def row(x, y):
        z = 300 * math.sin(x / 900) * math.cos(y / 1300) + 40 * math.sin(x / 110 + y / 170)
        return f'{500000 + x:.2f} {5200000 + y:.2f} {1000 + z + choice.gauss(0, 0.05):.2f}\n'

    with open(path, 'w') as file:
        for west in lines:
            for along in range(int(side / spacing)):
                file.writelines(row(west + across * spacing, along * spacing + choice.uniform(0, spacing / 2))
                                for across in range(int(swath / spacing)))
        for _ in range(points):
            file.write(row(choice.uniform(0, side), choice.uniform(0, side)))


def passes_table(options, folder):
    points, cloud = os.path.join(folder, 'passes.xyz'), os.path.join(folder, 'passes.terrace')
    write_passes(points, options.in_pass)
    built = terrace(options.terrace, 'build', points, '--crs', 'EPSG:32632', '-o', cloud)
    os.remove(points)
    places, some = os.path.join(folder, 'passes.csv'), os.path.join(folder, 'some.csv')
    choice = random.Random(1)
    for path, count in ((places, options.points), (some, options.points // 10)):
        with open(path, 'w') as file:
            file.write('x,y\n')
            file.writelines(f'{choice.uniform(500000, 510000):.3f},{choice.uniform(5200000, 5210000):.3f}\n'
                            for _ in range(count))
    out = os.path.join(folder, 'passes-out')
    sample = ('sample', cloud, '-o', f'{out}.csv', '--force', '--points')
    jobs = (('heights', (*sample, places)), ('heights, nearest, a tenth', (*sample, some, '--method', 'nearest')),
            ('raster, 10 m', ('raster', cloud, '-o', f'{out}.tif', '--force', '--cell', 10)),
            ('contours, 20 m', ('contour', cloud, '-o', f'{out}.geojson', '--force', '--interval', 20)),
            ('tiles to full detail', ('tile', cloud, '-o', out, '--vertical', 'ignore')))
    print(f"\n| two passes, {built['points']:,} points | threads | CPU s | wall s | peak MiB |")
    print('|---|---|---|---|---|')
    for name, verb in jobs:
        for threads in (1, 2):
            runs = []
            for _ in range(options.runs):
                shutil.rmtree(out, ignore_errors=True)  # otherwise existing tiles are kept
                runs.append(terrace(options.terrace, *verb, '--threads', threads))
            print(f"| {name} | {threads} | {median(runs, 'cpu'):.2f} | {median(runs, 'wall'):.2f} "
                  f"| {runs[0]['peak_rss_bytes'] / 2**20:.0f} |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('terrace')
    parser.add_argument('--size', default='2049x2049')
    parser.add_argument('--runs', type=int, default=3)
    parser.add_argument('--errors', default='20,5,1')
    parser.add_argument('--points', type=int, default=1000000)
    parser.add_argument('--pass', type=int, default=5000000, dest='in_pass')
    parser.add_argument('--dem')
    parser.add_argument('--tile-dem')
    parser.add_argument('--only', default='meshes,tiles,heights,points,passes')
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        def store_of(raster, name):
            store = os.path.join(folder, f'{name}.terrace')
            if os.path.exists(store):
                return store
            if not raster:
                raster = os.path.join(folder, f'{name}.tif')
                terrace(options.terrace, 'synth', 'dem', '--size', options.size, '-o', raster)
            terrace(options.terrace, 'build', raster, '-o', store)
            return store

        tables = {
            'meshes': lambda: mesh_table(options, store_of(options.dem, 'plane'), folder),
            'tiles': lambda: tile_table(options, store_of(options.tile_dem, 'tiled'), folder),
            'heights': lambda: sample_table(options, store_of(options.dem, 'plane'), folder),
            'points': lambda: cloud_table(options, store_of(options.tile_dem, 'tiled'), folder),
            'passes': lambda: passes_table(options, folder)}
        for name in options.only.split(','):
            tables[name]()


if __name__ == '__main__':
    main()
