# SPDX-License-Identifier: Apache-2.0
"""Keeps a renderer's triangles up to date while a camera flies over a store: view_deltas.py STORE"""
import sys

import terrace

view = terrace.View(terrace.open(sys.argv[1]))
triangles = {}
for frame in range(120):
    delta = view.frame(position=(0, -20000 + 200 * frame, 4000), direction=(0, 1, -0.4), seconds=1 / 60)
    for number in delta.removed_triangles:
        del triangles[number]
    triangles.update(zip(delta.added_triangles, delta.added_corners))
print(len(triangles), 'triangles of', delta.points, 'points')
