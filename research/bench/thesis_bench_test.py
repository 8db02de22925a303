#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs thesis_bench on small inputs and reads what it writes.

thesis_bench_test.py BENCH    every table must be a rectangle with rows, every plot SVG with curves
"""
import csv
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

TABLES = ['table-7.1', 'table-7.4', 'table-7.5', 'table-7.6', 'table-7.7', 'table-7.8', 'table-8.1', 'section-8.2',
          'figure-7.5', 'figure-7.5-histogram', 'figure-7.6', 'figure-7.12', 'figure-7.13', 'figure-7.13-course',
          'figure-7.14-facilities', 'figure-7.14-facilities-course', 'figure-7.14-kd-tree',
          'figure-7.14-kd-tree-course', 'figure-7.21', 'figure-7.22', 'figure-7.22-iterations',
          'figure-7.23', 'figure-7.23-course', 'figure-7.24', 'figure-7.24-decreases']
# The plots, and how many curves or groups of dots each has.
PLOTS = {'figure-7.5': 3, 'figure-7.6': 3, 'figure-7.12a': 3, 'figure-7.12b': 3, 'figure-7.13': 5,
         'figure-7.14-facilities': 5, 'figure-7.14-kd-tree': 5, 'figure-7.21': 4, 'figure-7.22': 3,
         'figure-7.23-100': 9, 'figure-7.23-500': 3, 'figure-7.24-monte_carlo': 4, 'figure-7.24-monotone': 4}
SVG = '{http://www.w3.org/2000/svg}'


def run(bench, *options):
    return subprocess.run([os.path.abspath(bench), '--threads', '2', *options], capture_output=True, text=True,
                          env={**os.environ, 'TERRACE_BENCH_SMALL': '1'})


def check_table(path):
    with open(path, newline='') as file:
        columns, *rows = csv.reader(file)
    assert rows, f'{path} has no rows'
    assert all(len(row) == len(columns) for row in rows), f'{path} is not a rectangle'


def check_plot(path, curves):
    root = xml.etree.ElementTree.parse(path).getroot()
    inside = next(group for group in root.iter(SVG + 'g') if 'clip-path' in group.attrib)
    drawn = [element for element in inside if element.get('d') or element.tag == SVG + 'g']
    assert len(drawn) == curves, f'{path} has {len(drawn)} curves, not {curves}'


def main(bench):
    with tempfile.TemporaryDirectory() as folder:
        done = run(bench, '--out', folder)
        assert done.returncode == 0, done.stderr
        expected = [f'{name}.csv' for name in TABLES] + [f'{name}.svg' for name in PLOTS]
        differing = set(os.listdir(folder)) ^ set(expected)
        assert not differing, f'missing or not expected: {sorted(differing)}'
        for name in os.listdir(folder):
            path = os.path.join(folder, name)
            check_table(path) if name.endswith('.csv') else check_plot(path, PLOTS[name[:-len('.svg')]])
    with tempfile.TemporaryDirectory() as folder:
        done = run(bench, '--out', folder, '--tables', 'figure7.21,table7.8')
        assert done.returncode == 0, done.stderr
        assert sorted(os.listdir(folder)) == ['figure-7.21.csv', 'figure-7.21.svg', 'table-7.8.csv']
    for wrong in (['--tables', 'table7.9'], ['--threads', '0'], ['--out'], ['--fast']):
        assert run(bench, *wrong).returncode == 2, wrong


if __name__ == '__main__':
    main(sys.argv[1])
