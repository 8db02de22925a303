# SPDX-License-Identifier: Apache-2.0
"""Sources of a store: files, and arrays of numpy and other packages."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ._arrays import as_array, as_native, filled
from ._call import notes
from ._types import AnyArray


def crs_text(crs: Any) -> str | None:
    """Returns the name, code or WKT of a CRS object or text of any package; None if it is empty.

    Raises: TypeError for other objects.
    """
    if crs is None or isinstance(crs, str):
        return crs or None
    if isinstance(crs, (int, np.integer)):
        return f'EPSG:{crs}'
    if hasattr(crs, 'to_wkt'):
        return crs.to_wkt() or None
    raise TypeError(f'`crs` must be a text such as EPSG:32632, or have to_wkt(), unlike {crs!r}')


def _centred(transform: Iterable[float] | None) -> tuple[float, ...]:
    """Converts a transform of cell corners, as in rasterio and GDAL, to one of cell centres."""
    if transform is None:
        return (1.0, 0.0, 0.0, 0.0, -1.0, 0.0)
    numbers = [float(number) for number in tuple(transform)[:6]]
    if len(numbers) != 6 or not np.all(np.isfinite(numbers)) or numbers[0] * numbers[4] == numbers[1] * numbers[3]:
        raise ValueError('`transform` must be six numbers a, b, c, d, e, f with x = a * column + b * row + c and '
                         'y = d * column + e * row + f')
    a, b, c, d, e, f = numbers
    return (a, b, c + (a + b) / 2, d, e, f + (d + e) / 2)


def _raster(samples: AnyArray, transform: Iterable[float] | None, nodata: float | None, name: str, scale: float = 1.0,
            offset: float = 0.0) -> dict[str, Any]:
    samples = as_native(samples, 'the raster')
    if samples.ndim == 3 and samples.shape[0] == 1:
        samples = samples[0]
    if samples.ndim != 2:
        raise ValueError(f'a raster must have two dimensions, not {samples.ndim}')
    if samples.size == 0:
        raise ValueError('the raster is empty')
    return {'name': name, 'samples': samples, 'transform': _centred(transform),
            'nodata': None if nodata is None else float(nodata), 'scale': float(scale), 'offset': float(offset)}


def _column(name: str, array: AnyArray, scale: float = 1.0, offset: float = 0.0) -> dict[str, Any]:
    return {'name': name, 'array': as_native(array, f'"{name}"'), 'scale': float(scale), 'offset': float(offset)}


def _points(columns: list[dict[str, Any]], attributes: list[dict[str, Any]], name: str) -> dict[str, Any]:
    sizes = {column['array'].shape for column in columns + attributes}
    if len(sizes) != 1 or len(next(iter(sizes))) != 1:
        raise ValueError('the columns of points must have one dimension and the same length')
    if next(iter(sizes)) == (0,):
        raise ValueError('there are no points')
    return {'name': name, 'columns': columns, 'attributes': attributes}


def _records(array: Any, fields: Sequence[str], name: str, scales: Sequence[float] = (1, 1, 1),
             offsets: Sequence[float] = (0, 0, 0)) -> dict[str, Any]:
    """Returns a source for records with x, y and z, or with X, Y and Z as LAS stores them (with scales and offsets).

    Fields of several numbers become name_0, name_1, ...
    """
    for axes in ('xyz', 'XYZ'):
        if all(axis in fields for axis in axes):
            break
    else:
        raise ValueError(f'points need fields x, y and z, or X, Y and Z, not {", ".join(fields)}')
    columns = [_column(axis.lower(), np.asarray(array[axis]), scales[i], offsets[i]) for i, axis in enumerate(axes)]
    attributes = []
    for field in fields:
        values = np.asarray(array[field])
        if values.ndim == 1 and field not in axes:
            attributes.append(_column(field, values))
        for i in range(values.shape[1] if values.ndim == 2 else 0):
            attributes.append(_column(f'{field}_{i}', values[:, i]))
    return _points(columns, attributes, name)


def _mesh(source: Any, attributes: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """Returns a source for the vertices of a mesh, with its triangles as {'triangles': a source of their corners}."""
    vertices = as_array(filled(source.vertices), 'the vertices')
    triangles = np.asarray(source.triangles if hasattr(source, 'triangles') else source.faces)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f'the vertices of a mesh must have the shape (n, 3), not {vertices.shape}')
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in 'iu':
        raise ValueError('the triangles of a mesh must be integers of the shape (m, 3)')
    if triangles.size and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise ValueError(f'a triangle of the mesh has a corner that is not one of its {len(vertices)} vertices')
    out = _points([_column(axis, vertices[:, i]) for i, axis in enumerate('xyz')], attributes, name)
    if len(triangles):
        corners = vertices[triangles]
        out['triangles'] = _points([_column(axis, corners[:, 0, i]) for i, axis in enumerate('xyz')],
                                   [_column(f'{axis}{k + 1}', corners[:, k, i]) for k in (1, 2) for i, axis in enumerate('xyz')],
                                   name)
    return out


def _laspy_crs(data: Any) -> Any:
    """Returns the CRS of a laspy.LasData, which laspy reads with pyproj, or None."""
    try:
        return data.header.parse_crs()
    except (AttributeError, ImportError) as missing:
        notes.info('the CRS of the points is not known (%s); pass `crs`', missing)
        return None


def _xarray(array: Any, transform: Any, crs: Any, nodata: float | None) -> tuple[Any, Any, float | None]:
    """Returns transform, CRS and nodata of an xarray.DataArray.

    They come from rioxarray's accessor, or from the CF attributes that rioxarray writes, or from the coordinates.
    """
    if hasattr(array, 'rio'):
        rio = array.rio
        return (rio.transform() if transform is None else transform, rio.crs if crs is None else crs,
                rio.nodata if nodata is None else nodata)
    grid = array.coords.get('spatial_ref')
    described = dict(grid.attrs) if grid is not None else {}
    crs = crs or described.get('crs_wkt') or described.get('spatial_ref') or array.attrs.get('crs')
    if transform is None and 'GeoTransform' in described:
        c, a, b, f, d, e = (float(number) for number in described['GeoTransform'].split())
        transform = (a, b, c, d, e, f)
    if transform is None and 'transform' in array.attrs:
        transform = tuple(array.attrs['transform'])[:6]
    if transform is None:
        rows, columns = array.dims[-2:]
        x, y = (np.asarray(array.coords[name], dtype=np.float64) for name in (columns, rows))
        if len(x) < 2 or len(y) < 2:
            raise ValueError('a raster of one row or column needs `transform`')
        steps = (x[-1] - x[0]) / (len(x) - 1), (y[-1] - y[0]) / (len(y) - 1)
        for places, step in zip((x, y), steps):
            if not np.allclose(np.diff(places), step, rtol=1e-6, atol=0):
                raise ValueError('the coordinates of the raster are not evenly spaced')
        transform = (steps[0], 0, x[0] - steps[0] / 2, 0, steps[1], y[0] - steps[1] / 2)
    if nodata is None:
        nodata = array.attrs.get('_FillValue', array.attrs.get('nodata'))
    return transform, crs, nodata


def _alone(kind: str, transform: Any, nodata: float | None, attributes: Any) -> None:
    if transform is not None or nodata is not None or attributes is not None:
        raise ValueError(f'{kind} do not support `transform`, `nodata` and `attributes`')


def source_of(source: Any, transform: Iterable[float] | None = None, crs: Any = None, nodata: float | None = None,
              attributes: Mapping[str, Any] | None = None) -> tuple[dict[str, Any] | list[bytes], str | None]:
    """Returns (the source in the form that the core expects, its CRS as text or None).

    Raises: TypeError, ValueError.
    """
    if attributes is not None and not hasattr(attributes, 'items'):
        raise TypeError('`attributes` is a dict of columns')
    if isinstance(source, (str, os.PathLike)):
        source = [source]
    if isinstance(source, (list, tuple)) and not source:
        raise ValueError('there is no source: pass a file name or an array')
    if isinstance(source, (list, tuple)) and any(isinstance(name, (str, os.PathLike)) for name in source):
        for number, name in enumerate(source):
            if not isinstance(name, (str, os.PathLike)):
                raise TypeError(f'source {number} is of type {type(name).__name__}: files and arrays cannot be mixed')
    if isinstance(source, (list, tuple)) and all(isinstance(name, (str, os.PathLike)) for name in source):
        if transform is not None or nodata is not None or attributes is not None:
            raise ValueError('files do not support `transform`, `nodata` and `attributes`: they have their own')
        return [os.fsencode(name) for name in source], crs_text(crs)
    records = getattr(source, 'points', source)
    if hasattr(records, 'point_format') and hasattr(records, 'scales'):  # laspy.LasData, or its points
        return (_records(records, list(records.point_format.dimension_names), '<laspy>', records.scales, records.offsets),
                crs_text(_laspy_crs(source) if crs is None else crs))
    if hasattr(source, 'dims') and hasattr(source, 'coords') and hasattr(source, 'values'):  # xarray.DataArray
        transform, crs, nodata = _xarray(source, transform, crs, nodata)
        return _raster(np.asarray(source.values), transform, nodata, '<xarray>'), crs_text(crs)
    if hasattr(source, 'GetGeoTransform'):  # gdal.Dataset
        band = source.GetRasterBand(1)
        c, a, b, f, d, e = source.GetGeoTransform()
        samples = band.ReadAsArray()
        if band.GetMaskFlags() == 2:  # gdal.GMF_PER_DATASET: a mask, not an alpha band
            samples = filled(np.ma.array(samples, mask=band.GetMaskBand().ReadAsArray() == 0))
        return _raster(samples, (a, b, c, d, e, f) if transform is None else transform, band.GetNoDataValue() if nodata is None else nodata,
                       '<gdal>', band.GetScale() or 1.0, band.GetOffset() or 0.0), crs_text(crs or source.GetProjection())
    if hasattr(source, 'transform'):  # a rasterio dataset, a Raster, or another array with an affine transform
        samples, scale, offset = source, 1.0, 0.0
        if hasattr(source, 'read'):
            masked = [flag.name for flag in source.mask_flag_enums[0]] == ['per_dataset']
            samples = filled(source.read(1, masked=masked))
            scale, offset = source.scales[0], source.offsets[0]
        nodata = getattr(source, 'nodata', None) if nodata is None else nodata
        return (_raster(as_array(filled(samples), 'the raster'), source.transform if transform is None else transform, nodata,
                        '<raster>', scale, offset),
                crs_text(crs or getattr(source, 'crs', None)))
    if hasattr(source, 'vertices') and (hasattr(source, 'triangles') or hasattr(source, 'faces')):
        if transform is not None or nodata is not None:
            raise ValueError('meshes do not support `transform` and `nodata`')
        more = [] if attributes is None else [
            _column(column_name, as_array(column, f'"{column_name}"')) for column_name, column in attributes.items()]
        return _mesh(source, more, '<mesh>'), crs_text(crs)
    if hasattr(source, 'columns') and all(axis in source.columns for axis in 'xyz'):  # a pandas.DataFrame, or another frame
        source = {name: source[name] for name in source.columns}
    if isinstance(source, dict):
        _alone('columns', transform, nodata, attributes)
        wrong = [axis for axis in 'xyz' if axis not in source]
        if wrong:
            raise ValueError(f'points need x, y and z: {", ".join(wrong)} is missing')
        arrays = {name: as_array(column, f'"{name}"') for name, column in source.items()}
        return _points([_column(axis, arrays[axis]) for axis in 'xyz'],
                       [_column(name, column) for name, column in arrays.items() if name not in ('x', 'y', 'z')],
                       '<dict>'), crs_text(crs)
    array = as_array(filled(source), 'the source')
    if array.dtype.names:
        _alone('structured arrays', transform, nodata, attributes)
        return _records(array.reshape(-1), array.dtype.names, '<array>'), crs_text(crs)
    if array.ndim not in (2, 3):
        raise ValueError(f'a source array must have the shape (n, 3) for points or (rows, columns) for a raster, not {array.shape}')
    if array.ndim == 2 and array.shape[1] == 3 and transform is None:
        more = [] if attributes is None else [
            _column(name, as_array(column, f'"{name}"')) for name, column in attributes.items()]
        return _points([_column(axis, array[:, i]) for i, axis in enumerate('xyz')], more, '<array>'), crs_text(crs)
    if attributes is not None:
        raise ValueError('rasters do not support `attributes`')
    return _raster(array, transform, nodata, '<array>'), crs_text(crs)
