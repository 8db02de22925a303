# SPDX-License-Identifier: Apache-2.0
"""Bounded-error meshes and interpolation, directly from arrays."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import _core
from ._arrays import as_integer, as_numbers, as_rows
from ._delaunay import Delaunay2
from ._mesh import BoundedMesh
from ._names import Duplicates, Interpolation, Quality
from ._sources import source_of
from ._types import Array, Float64Array, Int64Array


def _values(column: dict[str, Any]) -> Float64Array:
    return np.ascontiguousarray(column['array'] * column['scale'] + column['offset'], dtype=np.float64)


def bounded_mesh(samples: Any, max_error: float | None = None, *, max_points: int | None = None, quality: Quality = 'removal',
                 duplicates: Duplicates = 'all', min_angle: float = 5.0,
                 frame: Array | None = None, transform: Iterable[float] | None = None,
                 nodata: float | None = None) -> BoundedMesh:
    """Meshes an array with few triangles and within ``max_error`` of every sample, verified on each.

    Give either max_error or max_points. Store.bounded_mesh() handles data larger than memory.

    samples: points or a raster in memory, as in build(): shape (n, 3), or (rows, columns) with ``transform``, a
        Raster, an xarray.DataArray, or laspy's records. A raster must not be rotated and has at most 65,535 rows and
        columns. Cells with NaN or ``nodata``, and points with a NaN coordinate, are skipped.
    max_points: instead of bounding the error, makes the best mesh with at most this many vertices.
    quality: 'greedy', 'removal' or 'fitted'. Each has fewer triangles than the one before and takes longer.
    duplicates: the sample to use of several points at one place: 'all', 'min', 'max', 'mean', 'first' or 'error'.
    min_angle: for points; in degrees, up to 30. Removal makes no triangle with a smaller angle.
    frame: for points; shape (k, 3), a convex polygon, counter-clockwise, which replaces their hull and is kept
        exactly. Points outside it are ignored.

    Returns: a BoundedMesh, with errors in the unit of heights. Takes about 1 microsecond per inserted vertex.
    Raises: ValueError; TypeError for files.

    Source: M. Garland, P. Heckbert, CMU-CS-95-181.

    >>> y, x = np.mgrid[0:60, 0:80]
    >>> mesh = bounded_mesh(20 * np.sin(x / 9) * np.cos(y / 7), 0.5, transform=(10, 0, 0, 0, -10, 0))
    >>> mesh.max_error <= 0.5, len(mesh.vertices) < 500
    (True, True)
    """
    if (max_error is None) == (max_points is None):
        raise ValueError('bounded_mesh() needs either `max_error` or `max_points`')
    bound = 0.0 if max_error is None else float(max_error)
    if not 0 <= bound < math.inf:
        raise ValueError(f'`max_error` must be finite and not negative, not {bound}')
    most = 0 if max_points is None else as_integer(max_points, 'max_points', 4)
    source, _ = source_of(samples, transform=transform, nodata=nodata)
    if isinstance(source, list):
        raise TypeError('bounded_mesh() needs arrays; for files use build()')
    if 'columns' in source:
        frame = np.empty((0, 3)) if frame is None else as_rows(frame, 'frame', (3,))
        coordinates = [_values(column) for column in source['columns']]
        known = ~(np.isnan(coordinates[0]) | np.isnan(coordinates[1]) | np.isnan(coordinates[2]))
        if not known.all():
            coordinates = [column[known] for column in coordinates]
        return BoundedMesh(*_core.tin_of_points(*coordinates, bound, most, quality, duplicates, float(min_angle), frame))
    if frame is not None:
        raise ValueError('rasters do not support `frame`')
    a, b, c, d, e, f = source['transform']
    if b != 0 or d != 0:
        raise ValueError('the raster is rotated: build a store of it, or pass points')
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


def interpolate(samples: Array, places: Array, method: Interpolation = 'linear', *, threads: int | None = None) -> Float64Array:
    """Interpolates heights at places between scattered samples, as scipy.interpolate.griddata does.

    To compute gradients, or to interpolate repeatedly, use Delaunay2.heights().

    samples: shape (n, 3): x, y and the value. Of several samples at one place the last one is used.
    places: shape (m, 2).
    method: 'linear' (in Delaunay triangles), 'natural' (Sibson's natural neighbours) or 'nearest'.

    Returns: float64, shape (m,); NaN outside the hull, except with 'nearest'.
    Raises: ValueError.

    >>> interpolate([[0, 0, 1], [1, 0, 2], [0, 1, 3]], [[0.25, 0.5], [2, 2]])
    array([2.25,  nan])
    """
    samples = as_rows(samples, 'samples', (3,))
    mesh = Delaunay2(samples[:, :2])
    return mesh.heights(mesh.by_vertex(samples[:, 2]), places, method, threads=threads)


def simplify_line(t: Array, heights: Array, max_error: float) -> tuple[Int64Array, float]:
    """Selects few samples of a line so that the straight pieces between them are within ``max_error`` of all samples.

    It takes both ends, then repeatedly the sample with the largest error. The result depends only on these samples,
    so both sides of a border get the same chain.

    t: positions along the line, ascending, shape (n,). Of equal positions the first one is used.
    heights: one per position.

    Returns: (the indices of the selected samples, int64, ascending; the largest error). Usually O(n log n).
    Raises: ValueError.

    Source: D. Douglas, T. Peucker, 1973, with vertical distances.

    >>> simplify_line([0, 1, 2, 3], [0, 0.1, 0, 5], 0.5)
    (array([0, 2, 3]), 0.1)
    """
    return _core.simplify_line(as_numbers(t, 't'), as_numbers(heights, 'heights'), float(max_error))
