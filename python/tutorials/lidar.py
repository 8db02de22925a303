# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# # Laser scans: from points to ground and contours
#
# Any LAS, LAZ or COPC file will do: `terrace.build('scan.laz', ...)`. This tutorial uses an array instead, with the fields
# of a scanner's records: a hill with trees (class 5) and a house (class 6).

# %%
import numpy as np
import terrace

random = np.random.default_rng(7)
xy = random.random((150_000, 2)) * 400
ground = 120 + 25 * np.exp(-((xy - 200) ** 2).sum(axis=1) / 9000) + 0.03 * random.standard_normal(len(xy))
classes = np.full(len(xy), 2, np.uint8)
trees = (np.hypot(*(xy % 40 - 20).T) < 6) & (random.random(len(xy)) < 0.7)
house = (abs(xy[:, 0] - 90) < 12) & (abs(xy[:, 1] - 90) < 8)
classes[trees], classes[house] = 5, 6
z = ground + np.where(trees, 8 * random.random(len(xy)), 0) + np.where(house, 6, 0)
records = np.zeros(len(xy), [('x', 'f8'), ('y', 'f8'), ('z', 'f8'), ('classification', 'u1'), ('intensity', 'u2')])
records['x'], records['y'], records['z'] = xy[:, 0] + 500_000, xy[:, 1] + 5_200_000, z
records['classification'], records['intensity'] = classes, random.integers(0, 4096, len(xy))

# %%
scan = terrace.build(records, 'scan.store', crs='EPSG:32632', replace=True)
print(scan, [a['name'] for a in scan.info['attributes']])
print('near the house:', scan.query(near=(500_090, 5_200_090), k=5)['classification'])

# %% [markdown]
# Build the terrain model from the ground points only. A condition reads only the parts of the store that it needs.

# %%
ground = scan.points(where='classification == 2')
terrain = terrace.build(ground, 'ground.store', crs='EPSG:32632', replace=True)
mesh = terrain.bounded_mesh(max_error=0.5)
print(terrain)
mesh  # a notebook shows its picture

# %% [markdown]
# How tall is the vegetation? Subtract the height of the ground below each tree's points.

# %%
vegetation = scan.points(where='classification == 5')
above = vegetation['z'] - terrain.heights(terrace.xyz(vegetation)[:, :2])
print(f'{len(vegetation)} points of trees, up to {np.nanmax(above):.1f} m above ground')
assert 6.5 < np.nanmax(above) < 8.5

# %%
lines = terrain.contours(5)
print(lines, sorted({line['properties']['elev'] for line in lines['features']}))
height_model = terrain.raster(cell=2.0, path='ground.tif', replace=True)
print(height_model, height_model.crs)
lines
