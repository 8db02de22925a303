# SPDX-License-Identifier: Apache-2.0
"""Converts a GeoTIFF to a mesh with a bounded error, and to a picture: bounded_mesh.py DEM.tif METRES"""
import sys

import terrace

store = terrace.build(sys.argv[1], 'terrain.store', replace=True, progress=True)
mesh = store.bounded_mesh(max_error=float(sys.argv[2]))
print(store, mesh, f'within {mesh.max_error:.2f} m of {mesh.samples} samples')
mesh.save('terrain.svg', replace=True)
