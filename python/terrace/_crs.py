# SPDX-License-Identifier: Apache-2.0
"""Converts coordinates between reference systems."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from . import _core
from ._arrays import as_rows
from ._geo import region as as_region
from ._sources import crs_text
from ._types import Array, Crs, Float64Array


class Transformation:
    """A conversion from one coordinate reference system to another, by one operation between their datums.

    source, target: 'EPSG:n', a name, WKT, PROJJSON, a .prj file, or an object with to_wkt(). x is always the
        longitude or easting, y the latitude or northing.
    area: a box in the source system that contains the coordinates; the operation is chosen for it.
    datum_shift: seven numbers in the order of TOWGS84, or three, that lead to WGS 84. They apply to the system whose
        datum has no known operation.

    Threads may share a Transformation. It converts 0.6 to 5 million places per second.

    Raises: ValueError for an unknown system; Error if no operation connects the two datums.

    Source: PROJ's definitions and operations, GeographicLib's projections.

    >>> Transformation('EPSG:4326', 'EPSG:32632').forward([[9, 48]]).round(2)
    array([[ 500000.  , 5316300.22]])
    """

    def __init__(self, source: Crs, target: Crs, *, area: Sequence[float] | None = None,
                 datum_shift: Iterable[float] | None = None) -> None:
        texts = [crs_text(crs) for crs in (source, target)]
        if None in texts:
            raise ValueError('a transformation needs two reference systems')
        shift = None if datum_shift is None else [float(number) for number in datum_shift]
        if shift is not None:
            if len(shift) not in (3, 7):
                raise ValueError(f'`datum_shift` must be three or seven numbers, not {len(shift)}')
            shift += [0.0] * (7 - len(shift))
        box = as_region(area)
        if isinstance(box, dict):
            raise ValueError('`area` must be a box')
        self._core = _core.Transformation(*texts, shift, box)

    def _convert(self, value: Array, back: bool) -> Float64Array:
        places = as_rows(value, 'places')
        result = self._core.convert(np.ascontiguousarray(places[:, :2]), back)
        return result if places.shape[1] == 2 else np.column_stack((result, places[:, 2]))

    def forward(self, places: Array) -> Float64Array:
        """Converts places from the source to the target system.

        places: shape (n, 2), or (n, 3), whose heights are kept.

        Returns: float64, the same shape; NaN for places that the target system cannot represent.
        Raises: ValueError.
        """
        return self._convert(places, False)

    def reverse(self, places: Array) -> Float64Array:
        """Converts places from the target to the source system; otherwise as forward()."""
        return self._convert(places, True)

    @property
    def note(self) -> str:
        """A remark on the operation, such as its accuracy; empty if the datum does not change."""
        return self._core.note()

    def __repr__(self) -> str:
        return f'<terrace.Transformation: {self._core.from_title()} to {self._core.to_title()}>'
