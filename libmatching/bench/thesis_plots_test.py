#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of a small run twice. All four must exist and have the same bytes.

thesis_plots_test.py BENCH    exits with status 77 (skipped) if matplotlib is missing
"""
import importlib.util
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

if importlib.util.find_spec('matplotlib') is None:
    print('matplotlib is not installed')
    sys.exit(77)

PLOTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'thesis_plots.py')
FIGURES = [f'figure_7_{number}.svg' for number in (21, 22, 23, 24)]


def draw(folder):
    subprocess.run([sys.executable, '-B', PLOTS, folder], check=True)
    pictures = []
    for name in FIGURES:
        with open(os.path.join(folder, name), 'rb') as file:
            pictures.append(file.read())
    return pictures


with tempfile.TemporaryDirectory() as folder:
    empty = subprocess.run([sys.executable, '-B', PLOTS, folder], capture_output=True)
    assert empty.returncode == 1, 'a folder without figures was accepted'
    subprocess.run([os.path.abspath(sys.argv[1]), '--out', folder], check=True,
                   stdout=subprocess.DEVNULL, env={**os.environ, 'TERRACE_BENCH_SMALL': '1'})
    pictures = draw(folder)
    assert draw(folder) == pictures, 'a second run wrote different bytes'
    for name, picture in zip(FIGURES, pictures):
        curves = [element for element in xml.etree.ElementTree.fromstring(picture).iter()
                  if element.get('id', '').startswith('line2d')]
        assert len(curves) > 5, name + ' has no curves'
