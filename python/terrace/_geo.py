# SPDX-License-Identifier: Apache-2.0
"""Regions and GeoJSON."""

from __future__ import annotations

import json
import math
import os
from typing import Any, Dict, List, Tuple, Union

import numpy as np

from ._mesh import metres_per_unit
from ._pictures import lines_png
from ._sources import crs_text
from ._types import Float64Array

Box = Tuple[float, ...]  #: six numbers, minima first
Polygon = List[Float64Array]  #: rings
CoreRegion = Union[Box, Dict[str, Any]]  #: a region in the form that the core expects


class FeatureCollection(Dict[str, Any]):
    """A GeoJSON FeatureCollection, which shapely, geopandas and others accept through ``__geo_interface__``."""

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        return dict(self)

    _units: Any = None  #: from the core, to draw pictures

    def _repr_png_(self) -> bytes:
        lines = [np.asarray(line['geometry']['coordinates'], np.float64)[:, :2] for line in self['features']]
        ends = np.array([end for line in lines for end in (line.min(axis=0), line.max(axis=0))]).reshape(-1, 2)
        metres = metres_per_unit(np.column_stack((ends, np.zeros(len(ends)))), self._units)[:2]
        return lines_png([line * metres for line in lines])

    def __repr__(self) -> str:
        return f'<terrace.FeatureCollection of {len(self["features"])} features>'


def _rings(polygon: Any) -> Polygon:
    return [np.ascontiguousarray([place[:2] for place in ring], dtype=np.float64).reshape(-1, 2) for ring in polygon]


def _polygons(geometry: Any) -> list[Polygon]:
    kind = geometry.get('type')
    if kind == 'Polygon':
        return [_rings(geometry['coordinates'])]
    if kind == 'MultiPolygon':
        return [_rings(polygon) for polygon in geometry['coordinates']]
    if kind == 'Feature':
        return _polygons(geometry['geometry']) if geometry['geometry'] is not None else []
    parts = {'GeometryCollection': 'geometries', 'FeatureCollection': 'features'}.get(kind)
    if parts is None:
        raise ValueError(f'`region` must be a box or polygons, not a {kind}')
    return [polygon for part in geometry[parts] for polygon in _polygons(part)]


def geojson(value: Any) -> tuple[Any, str | None]:
    """Returns (a GeoJSON dict, the name of its CRS) for a dict, an object with ``__geo_interface__`` or a file name.

    The name comes from the object's ``crs``, as in geopandas, or from the dict's ``crs``. It is '' if neither is
    given, None if the dict says that the CRS is unknown.
    """
    crs: Any = None
    if isinstance(value, (str, os.PathLike)):
        with open(value, encoding='utf-8') as file:
            value = json.load(file)
    if hasattr(value, '__geo_interface__'):
        crs = crs_text(getattr(value, 'crs', None))
        value = value.__geo_interface__
    if not isinstance(value, dict) or crs is not None:
        return value, crs or ''
    crs = value.get('crs', '')
    if isinstance(crs, dict):
        crs = (crs.get('properties') or {}).get('name')
        if not isinstance(crs, str) or not crs:
            raise ValueError('the `crs` of GeoJSON does not name a CRS')
    return value, crs


def region(value: Any) -> CoreRegion | None:
    """Returns a region in the form that the core expects; None, for everywhere, stays None.

    given: a box of four or six numbers, (min x, min y[, min z], max x, max y[, max z]), in the CRS of the store or
        source; or polygons as an object with ``__geo_interface__``, a GeoJSON dict or the name of a GeoJSON file, in
        the CRS that they name. Polygons that name no CRS are in longitude and latitude, as GeoJSON is, if the CRS of
        the store or source is known and the numbers are in range; otherwise in the CRS of the store or source.

    Raises: ValueError, TypeError.
    """
    if value is None:
        return None
    name = os.fspath(value) if isinstance(value, (str, os.PathLike)) else '`region`'
    value, crs = geojson(value)
    if isinstance(value, dict):
        try:
            polygons = _polygons(value)
        except (KeyError, IndexError, TypeError, AttributeError, RecursionError) as fault:
            raise ValueError('`region` is not GeoJSON of polygons') from fault
        if not polygons:
            raise ValueError('`region` has no polygons')
        return {'polygons': polygons, 'crs': crs, 'name': name}
    try:
        numbers = [float(number) for number in value]
    except TypeError:
        raise TypeError('`region` must be a box of four or six numbers, or polygons') from None
    if len(numbers) not in (4, 6):
        raise ValueError(f'`region` must be a box of four or six numbers, not {len(numbers)}')
    half = len(numbers) // 2
    if any(not low <= high for low, high in zip(numbers, numbers[half:])):
        raise ValueError('`region` must be a box with its minima first')
    if half == 2:
        return (*numbers[:2], -math.inf, *numbers[2:], math.inf)
    return tuple(numbers)
