#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Plots figures 7.21 to 7.24 of the thesis from the CSV files of matching_thesis_bench.

J. Skála, Algorithms for manipulating large geometric data, section 7.5.2. Each of the four
figure_7_*.csv in the folder becomes an .svg next to it. The same numbers give the same bytes.
Needs matplotlib.

usage: thesis_plots.py DIR
"""
import csv
import os
import re
import sys

import matplotlib

matplotlib.use('svg')
from matplotlib import pyplot
from matplotlib.ticker import LogLocator, NullFormatter

# Makes ids in the files depend on this string instead of on the time.
matplotlib.rcParams.update({
    'svg.hashsalt': 'terrace-matching', 'svg.fonttype': 'path', 'font.size': 10.5,
    'axes.spines.top': False, 'axes.spines.right': False, 'axes.grid': True,
    'axes.titlesize': 11.5, 'axes.titlelocation': 'left', 'axes.axisbelow': True,
    'grid.color': '#e4e4e4', 'grid.linewidth': 0.7, 'legend.frameon': False,
    'figure.constrained_layout.use': True})

# The thesis's colours: blue, purple and brown for its sets of 100 points, green for the set of 500.
COLOURS = {'100a': '#2563b0', '100b': '#8e3fa8', '100c': '#96602a', '500': '#1f8a4c'}


def rows_of(folder, figure):
    with open(os.path.join(folder, f'figure_{figure}.csv'), newline='') as file:
        return list(csv.DictReader(file))


def column(rows, name):
    return [float(row[name]) for row in rows]


def chosen(rows, **values):
    return [row for row in rows if all(row[key] == value for key, value in values.items())]


def names(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def figure_7_21(rows):
    figure, axes = pyplot.subplots(figsize=(7.2, 4.6))
    kinds = {'euclidean': ('#2563b0', 'distances of uniform points'),
             'product': ('#b5462f', 'cost(i, j) = i j, a hard matrix')}
    for kind, (colour, label) in kinds.items():
        mine = chosen(rows, matrix=kind)
        axes.plot(column(mine, 'n'), column(mine, 'seconds'), 'o-', color=colour, markersize=4.5,
                  label=f'{label}: ' rf'$n^{{{float(mine[0]["fitted_exponent"]):.2f}}}$')
        axes.plot(column(mine, 'n'), column(mine, 'cubic_seconds'), ':', color=colour,
                  label=r'$n^3$, as in the thesis' if kind == 'product' else None)
    axes.set(xscale='log', yscale='log', xlabel='n rows, n columns', ylabel='seconds',
             title='Figure 7.21: running time of the Kuhn-Munkres algorithm')
    sizes = sorted({int(row['n']) for row in rows})
    axes.set_xticks(sizes, [str(n) for n in sizes])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.minorticks_off()
    axes.legend(loc='upper left')
    axes.text(0.99, 0.02, rows[0]['machine'], transform=axes.transAxes, ha='right', va='bottom',
              fontsize=7.5, color='#777')
    return figure


def figure_7_22(rows):
    figure, axes = pyplot.subplots(figsize=(7.2, 4.2))
    iterations = column(rows, 'iteration')
    axes.plot(iterations, column(rows, 'cost'), 'o-', color='#2563b0', markersize=3, linewidth=0.9,
              label='cost of the iteration')
    axes.step(iterations, column(rows, 'least_so_far'), where='post', color='#b5462f',
              linewidth=1.4, label='least so far')
    axes.axhline(float(rows[0]['optimum']), color='#222', linestyle='--', linewidth=1.2,
                 label='the optimum')
    axes.set(xlabel='iteration', ylabel='sum of distances', xlim=(0, iterations[-1] + 1),
             title='Figure 7.22: iterations of the Monte Carlo method, 100 points')
    axes.set_ylim(0, 1.22 * max(column(rows, 'cost')))
    axes.legend(loc='upper left', ncols=3)
    return figure


def log_iterations(axes, **more):
    axes.set(xscale='log', xlabel='iterations', **more)
    axes.xaxis.set_major_locator(LogLocator(numticks=12))


def figure_7_23(rows):
    figure, panels = pyplot.subplots(1, 2, figsize=(9.6, 4.6), width_ratios=[1, 1])
    figure.suptitle('Figure 7.23: the least cost after N iterations', x=0.01, ha='left',
                    fontsize=11.5)
    for axes, points in zip(panels, names(rows, 'points')):
        for name in names(chosen(rows, points=points), 'set'):
            colour = COLOURS[name]
            for method, style, width in (('monte_carlo', '-', 1.9), ('monotone', '-', 0.9),
                                         ('optimum', '--', 1.1)):
                mine = chosen(rows, set=name, method=method)
                axes.step(column(mine, 'iteration'), column(mine, 'cost'), style, where='post',
                          color=colour, linewidth=width)
        log_iterations(axes, title=f'{points} points')
        axes.set_ylim(bottom=0)
    panels[0].set_ylabel('sum of distances')
    grey = '#444'
    for style, width, label in (('-', 1.9, 'Monte Carlo, as published'),
                                ('-', 0.9, 'monotone, our extension'),
                                ('--', 1.1, 'the optimum')):
        panels[1].plot([], [], style, color=grey, linewidth=width, label=label)
    panels[1].legend(loc='lower left')
    return figure


def figure_7_24(rows):
    figure, panels = pyplot.subplots(1, 2, figsize=(9.6, 4.6), sharey=True)
    figure.suptitle('Figure 7.24: decrease of the least cost, per cent of the previous one', x=0.01,
                    ha='left', fontsize=11.5)
    titles = {'monte_carlo': 'Monte Carlo, as published', 'monotone': 'monotone'}
    for axes, (method, title) in zip(panels, titles.items()):
        for name in names(rows, 'set'):
            mine = chosen(rows, set=name, method=method)
            axes.plot(column(mine, 'iteration'), column(mine, 'decrease_percent'), 'o-',
                      color=COLOURS[name], markersize=3.5, linewidth=0.9,
                      label=re.sub('([abc]?)$', r' points \1', name, count=1))
        log_iterations(axes, title=title, yscale='log')
        axes.yaxis.set_major_formatter('{x:g}')
    panels[0].set_ylabel('per cent')
    panels[0].legend(loc='lower left')
    return figure


def main(folder):
    drawn = 0
    for figure, draw in (('7_21', figure_7_21), ('7_22', figure_7_22), ('7_23', figure_7_23),
                         ('7_24', figure_7_24)):
        if not os.path.exists(os.path.join(folder, f'figure_{figure}.csv')):
            continue
        # No date, so that the bytes depend on the numbers only.
        draw(rows_of(folder, figure)).savefig(os.path.join(folder, f'figure_{figure}.svg'),
                                              metadata={'Date': None})
        drawn += 1
    if drawn == 0:
        sys.exit(f'{folder}: no figure_7_21.csv to figure_7_24.csv; run matching_thesis_bench '
                 '--out there first')


if __name__ == '__main__':
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
