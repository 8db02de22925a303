# SPDX-License-Identifier: Apache-2.0
"""Meshes with a bound of their error, and interpolation, straight from arrays."""

import math

import numpy as np

from . import _core
from ._arrays import as_numbers, as_rows, whole
from ._delaunay import Delaunay2
from ._mesh import BoundedMesh
from ._sources import source_of


def _values(column):
    return np.ascontiguousarray(column['array'] * column['scale'] + column['offset'], dtype=np.float64)


def bounded_mesh(samples, max_error=None, *, max_points=None, quality='removal', duplicates='all', min_angle=5.0, frame=None, transform=None,
                 nodata=None):
    """The mesh with few triangles that is within ``max_error`` of every sample, verified on each, or the best of at
    most ``max_points`` vertices: of an array, without a store.

    samples: points or a raster in memory, as build() takes them: shape (n, 3), or (rows, columns) with ``transform``, a
    Raster, an xarray.DataArray, laspy's records. A raster is not rotated and has at most 65,535 rows and columns; NaN
    and ``nodata`` in it are no samples, nor are points with a coordinate that is NaN. quality: 'greedy', 'removal' or
    'fitted', each with fewer triangles and more time. duplicates: which of several points at one place counts: 'all',
    'min', 'max', 'mean', 'first', 'error'. For points: ``min_angle``, degrees up to 30, below which removal makes no
    triangle; frame: shape (k, 3), a convex polygon, counter-clockwise, in place of their hull, kept exactly; points
    outside do not count.

    Returns: a BoundedMesh; its errors are in the unit of heights. Raises: ValueError; TypeError for files. About 1 us
    per vertex inserted. Source: M. Garland, P. Heckbert, CMU-CS-95-181. Store.bounded_mesh() is for what is larger than
    memory.

    >>> y, x = np.mgrid[0:60, 0:80]
    >>> mesh = bounded_mesh(20 * np.sin(x / 9) * np.cos(y / 7), 0.5, transform=(10, 0, 0, 0, -10, 0))
    >>> mesh.max_error <= 0.5, len(mesh.vertices) < 500
    (True, True)
    """
    if (max_error is None) == (max_points is None):
        raise ValueError('bounded_mesh() needs either `max_error` or `max_points`')
    bound = 0.0 if max_error is None else float(max_error)
    if not 0 <= bound < math.inf:
        raise ValueError(f'`max_error` is a number, not negative, not {bound}')
    most = 0 if max_points is None else whole(max_points, 'max_points', 4)
    source, _ = source_of(samples, transform=transform, nodata=nodata)
    if isinstance(source, list):
        raise TypeError('bounded_mesh() takes arrays; build() takes files')
    if 'columns' in source:
        frame = np.empty((0, 3)) if frame is None else as_rows(frame, 'frame', (3,))
        coordinates = [_values(column) for column in source['columns']]
        known = ~(np.isnan(coordinates[0]) | np.isnan(coordinates[1]) | np.isnan(coordinates[2]))
        if not known.all():
            coordinates = [column[known] for column in coordinates]
        return BoundedMesh(*_core.tin_of_points(*coordinates, bound, most, quality, duplicates, float(min_angle), frame))
    if frame is not None:
        raise ValueError('`frame` is for points')
    a, b, c, d, e, f = source['transform']
    if b != 0 or d != 0:
        raise ValueError('the raster is rotated: build a store of it, or give points')
    heights = source['samples']
    missing = None if source['nodata'] is None else heights == source['nodata']
    heights = np.array(heights, dtype=np.float32 if heights.dtype == np.float32 else np.float64)
    if source['scale'] != 1 or source['offset'] != 0:
        heights = heights.astype(np.float64) * source['scale'] + source['offset']
    if missing is not None:
        heights[missing] = np.nan
    vertices, triangles, measured = _core.tin_of_grid(np.ascontiguousarray(heights), a, e, bound, most, quality)
    vertices[:, 0] = a * vertices[:, 0] + c
    vertices[:, 1] = e * vertices[:, 1] + f
    return BoundedMesh(vertices, triangles, measured)


def interpolate(samples, places, method='linear', *, threads=None):
    """Heights at places between scattered samples, as scipy.interpolate.griddata.

    samples: shape (n, 3): x, y and the value; of samples at one place the last counts. places: shape (m, 2). method:
    'linear' (in Delaunay's triangles), 'natural' (Sibson's natural neighbours) or 'nearest'. Returns: float64, shape (m,);
    NaN outside the hull, but for 'nearest'. Raises: ValueError. For gradients, or to ask more than once, see
    Delaunay2.heights().

    >>> interpolate([[0, 0, 1], [1, 0, 2], [0, 1, 3]], [[0.25, 0.5], [2, 2]])
    array([2.25,  nan])
    """
    samples = as_rows(samples, 'samples', (3,))
    mesh = Delaunay2(samples[:, :2])
    return mesh.heights(mesh.by_vertex(samples[:, 2]), places, method, threads=threads)


def simplify_line(t, heights, max_error):
    """A chain of few of the samples along a line within ``max_error`` of each: the ends, then the sample of greatest
    error, and so on.

    t: positions along the line, ascending, shape (n,); of equal ones the first counts. heights: one for each. Returns:
    (the samples that are kept, int64, ascending; the largest error). It depends on these samples alone, so both sides
    of a border get the same chain. Usually O(n log n). Raises: ValueError. Source: D. Douglas, T. Peucker, 1973, with
    vertical distances.

    >>> simplify_line([0, 1, 2, 3], [0, 0.1, 0, 5], 0.5)
    (array([0, 2, 3]), 0.1)
    """
    return _core.simplify_line(as_numbers(t, 't'), as_numbers(heights, 'heights'), float(max_error))
