# SPDX-License-Identifier: Apache-2.0
# %% [markdown]
# # Clustering, matching and triangulations of arrays
#
# The methods of J. Skala's thesis also work on arrays, without a store.

# %%
import numpy as np
import terrace

random = np.random.default_rng(3)
middles = random.random((12, 2)) * 100
points = np.concatenate([middle + 2 * random.standard_normal((400, 2)) for middle in middles])

# %% [markdown]
# Facility location needs the cost of a cluster instead of the number of clusters. Points of the input represent clusters.

# %%
for cost in (0.02, 0.1, 0.5):
    print(f'facility cost {cost}:', terrace.cluster(points, cost))
found = terrace.cluster(points, 0.1)
exact = terrace.cluster(points[::20], 0.1, method='jain-vazirani')
print(f'every 20th point: cost {exact.cost:.0f}, no solution below {exact.lower_bound:.0f}')

# %% [markdown]
# Linkage has SciPy's methods and returns rows like SciPy's, so SciPy can draw them as dendrograms. k-means can start from
# the representatives.

# %%
for method in ('complete', 'average', 'ward'):
    labels = terrace.flat_clusters(terrace.linkage(points, method), count=12)
    print(f'{method} linkage:', np.bincount(labels))
print('k-means:', terrace.kmeans(points, 12), 'from representatives:', terrace.kmeans(points, points[found.facilities]))

# %% [markdown]
# Pair points with the least total distance, with a proof, or assign the points of one set to another.

# %%
pairs = terrace.matching(points)
print(pairs, f'no matching below {pairs.bound:.3f}')
moved = points + random.standard_normal(points.shape)
chosen = terrace.assignment(points, moved)
print(chosen, f'{(chosen.columns == np.arange(len(points))).mean():.0%} of the points get their own copy')

# %% [markdown]
# Stores consist of a hierarchy of clusters, built in one pass from any number of points. Here a function counts its clusters.

# %%
clusters = {}


def count(block):
    clusters[block.level] = clusters.get(block.level, 0) + len(block.representatives)


made = terrace.stream_clusters((random.random((10000, 3)) for _ in range(30)), count)
print(f'{made["points"]} points, clusters by level: {dict(sorted(clusters.items()))}')

# %% [markdown]
# Triangulations can change. Points that are inserted and removed again leave no trace.

# %%
triangulation = terrace.Delaunay2(points)
print('corners of the first triangle:', points[triangulation.simplices[0]])
before = triangulation.digest()
added = triangulation.insert(random.random((1000, 2)) * 100)
print(triangulation)
triangulation.remove(np.unique(added))
assert triangulation.digest() == before
triangulation  # a notebook shows its picture
