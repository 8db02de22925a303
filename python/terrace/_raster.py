# SPDX-License-Identifier: Apache-2.0
"""Rasters computed from a store."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from . import _core
from ._pictures import grey_png
from ._types import AnyArray, Path


class Raster:
    """Samples on a grid, NaN where there is no surface.

    values: shape (rows, columns), float32, as in a GeoTIFF, or uint8 for a hillshade.
    transform: six numbers a, b, c, d, e, f from columns and rows of the cells' *corners* to x and y, as in rasterio's
        and GDAL's affine transforms.
    crs: 'EPSG:n' or WKT, None if unknown.
    """

    def __init__(self, values: AnyArray, transform: tuple[float, float, float, float, float, float],
                 crs: str | None) -> None:
        self.values, self.transform, self.crs = values, transform, crs

    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns."""
        rows, columns = self.values.shape
        return rows, columns

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The box around all cells: min x, min y, max x, max y."""
        a, b, c, d, e, f = self.transform
        rows, columns = self.shape
        x = [c + a * i + b * j for i in (0, columns) for j in (0, rows)]
        y = [f + d * i + e * j for i in (0, columns) for j in (0, rows)]
        return min(x), min(y), max(x), max(y)

    def __array__(self, dtype: Any = None) -> AnyArray:
        return self.values if dtype is None else self.values.astype(dtype)

    def __repr__(self) -> str:
        return f'<terrace.Raster: {self.shape[1]} x {self.shape[0]} cells>'

    def _repr_png_(self) -> bytes:
        return grey_png(self.values)


def read_raster(path: Path) -> Raster:
    samples, valid, centres, crs = _core.read_geotiff(os.fsencode(path))
    if samples.dtype.kind == 'f':
        samples[valid == 0] = np.nan
    a, b, c, d, e, f = centres
    return Raster(samples, (a, b, c - (a + b) / 2, d, e, f - (d + e) / 2), crs or None)
