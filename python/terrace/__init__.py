# SPDX-License-Identifier: Apache-2.0
"""Terrain, scans and point sets larger than memory, from numpy.

``build`` streams rasters, point clouds and arrays into a *store*: an on-disk hierarchy of clusters, which
``open(path)`` or ``Store(path)`` opens again. A ``Store`` provides points, meshes, heights, contours, tiles and live
views at any level of detail.

Its building blocks also work without a store: ``Delaunay2`` and ``Delaunay3``, ``bounded_mesh``, ``interpolate``,
``linkage``, ``kmeans``, ``cluster``, ``stream_clusters``, ``assignment``, ``matching``, ``PointTree`` and
``TriangleTree``. So do ``read_points``, ``write_points`` and ``Transformation``.

Long calls release the interpreter's lock, use all cores unless ``threads`` limits them, and end soon after Ctrl-C.
Results depend only on the input and the options, not on the number of threads or the machine.

Errors: ``ValueError`` for invalid arguments, ``TypeError`` for unusable objects, ``OSError`` (such as
    ``FileNotFoundError``) for failed system calls, ``MemoryError``, and ``terrace.Error`` for bad data: one line with
    file, place, cause and remedy.

>>> import numpy as np, tempfile, terrace
>>> y, x = np.mgrid[0:60, 0:80]
>>> heights = 100 + 20 * np.sin(x / 9) * np.cos(y / 7)
>>> folder = tempfile.TemporaryDirectory()
>>> store = terrace.build(heights, folder.name + '/hills', transform=(10, 0, 500000, 0, -10, 5000000))
>>> store
<terrace.Store 'hills': 4800 points, 1 level, raster of 80 x 60>
>>> float(store.heights([[500005, 4999995]])[0])
100.0
>>> mesh = store.bounded_mesh(max_error=1.0)
>>> bool(mesh.max_error <= 1.0), bool(len(mesh.triangles) < 1500)
(True, True)
"""

from ._clustering import (ClusterBlock, Clusters, KMeans, cluster, clusters_of_size, entity_distances, facility_location,
                          flat_clusters, kmeans, linkage, spanning_tree, stream_clusters, tree_linkage)
from ._crs import Transformation
from ._delaunay import Delaunay2, Delaunay3, DynamicSurface, MeshChanges, Shape, ellipse, ellipsoid
from ._errors import Error
from ._geo import FeatureCollection
from ._matching import Assignment, HalvingMatching, Matching, assignment, edge_matching, halving_matching, matching
from ._mesh import BoundedMesh, Mesh
from ._points import PointReader, point_batches, read_points, write_points
from ._raster import Raster
from ._store import Store, build, merge, xyz
from ._tiles import verify_tiles
from ._tin import bounded_mesh, interpolate, simplify_line
from ._trees import MatchingTree, PointTree, TriangleTree, matching_tree, rotate_tree
from ._view import MeshDelta, Multiresolution, View, ViewDelta, VolumeDelta

open = Store.open
__version__ = '0.1.0'
# Without `open`, so that `from terrace import *` does not hide Python's.
__all__ = [
    'Assignment', 'BoundedMesh', 'ClusterBlock', 'Clusters', 'Delaunay2', 'Delaunay3', 'DynamicSurface', 'Error',
    'FeatureCollection', 'HalvingMatching', 'KMeans', 'Matching', 'MatchingTree', 'Mesh', 'MeshChanges',
    'MeshDelta', 'Multiresolution', 'PointReader', 'PointTree', 'Raster', 'Shape', 'Store', 'Transformation',
    'TriangleTree', 'View', 'ViewDelta', 'VolumeDelta', 'assignment', 'bounded_mesh', 'build', 'cluster', 'clusters_of_size',
    'edge_matching', 'ellipse', 'ellipsoid', 'entity_distances', 'facility_location', 'flat_clusters',
    'halving_matching', 'interpolate', 'kmeans', 'linkage', 'matching', 'matching_tree', 'merge', 'point_batches',
    'read_points', 'rotate_tree', 'simplify_line', 'spanning_tree', 'stream_clusters', 'tree_linkage',
    'verify_tiles', 'write_points', 'xyz',
]
