# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# # Terrain: from a GeoTIFF to a mesh with a verified error
#
# One pass over the raster builds a *store*: every sample once, in a hierarchy of clusters. The raster is a part of the Alps
# from this repository; any other file will do. (A notebook has no `__file__`, so start it in this folder.)

# %%
from pathlib import Path
import numpy as np
import terrace

folder = Path(__file__).parent if '__file__' in globals() else Path.cwd()
store = terrace.build(folder / '../../libterrain/examples/alps.tif', 'alps.store', replace=True, progress=True)
print(store, store.info['crs']['name'], f'{store.info["bytes"] / len(store):.2f} bytes per sample')
# Later, or elsewhere: terrace.open('alps.store')

# %% [markdown]
# Make a mesh within 50 m of every sample. The bound is verified at each of them.

# %%
mesh = store.bounded_mesh(max_error=50)
print(mesh, f'{len(store) / len(mesh.vertices):.0f} samples per vertex, at most {mesh.max_error:.1f} m off')
mesh.save('alps.ply', replace=True)
mesh  # a notebook shows its picture

# %% [markdown]
# Compute heights and slopes at places, a profile, contour lines and a shaded picture.

# %%
places = np.column_stack((np.linspace(8.2, 8.8, 7), np.full(7, 46.4)))
for (lon, lat), height, (east, north) in zip(places, store.heights(places), store.gradients(places)):
    print(f'{lon:.1f} {lat:.1f}: {height:6.1f} m, {np.degrees(np.arctan(np.hypot(east, north))):4.1f} degrees steep')
profile = store.profile(places[[0, -1]], step=500)
print(f'{profile[-1, 0] / 1000:.1f} km with {np.nansum(np.abs(np.diff(profile[:, 3]))):.0f} m up and down')

# %%
lines = store.contours(250, region=(8.4, 46.4, 8.6, 46.6))
print(lines, 'the highest at', max(line['properties']['elev'] for line in lines['features']), 'm')
shade = store.raster('hillshade', cell=0.004)
with open('alps.png', 'wb') as file:
    file.write(shade._repr_png_())

# %% [markdown]
# Mix levels of detail: coarse everywhere, but every sample in one box.

# %%
detail = store.mesh(level=store.top, focus=[((8.45, 46.45, 8.5, 46.5), 0)])
print(detail)

# %% [markdown]
# Fly a camera: the mesh follows by deltas. Positions are in metres from the store's centre.

# %%
view = terrace.View(store)
triangles = 0
for frame in range(200):
    delta = view.frame((-5000 + 100 * min(frame, 100), -20000, 6000), (0, 1, -0.4), pixel_error=4, seconds=0.02)
    triangles += len(delta.added_triangles) - len(delta.removed_triangles)
    if delta.settled and frame > 100:
        break
print(f'{triangles} triangles after {frame} frames, {view.traffic["bytes"]} bytes read')
