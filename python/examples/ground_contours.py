# SPDX-License-Identifier: Apache-2.0
"""Writes the contours of a laser scan's ground as GeoJSON: ground_contours.py SCAN.laz INTERVAL"""
import json
import sys

import terrace

ground = terrace.build(sys.argv[1], 'ground.store', where='classification == 2', replace=True, progress=True)
lines = ground.contours(float(sys.argv[2]), max_edge=50)
print(ground, lines)
with open('contours.geojson', 'w', encoding='ascii') as file:
    json.dump(lines, file)
