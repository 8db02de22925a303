# SPDX-License-Identifier: Apache-2.0
"""Reads points from files and writes them, without a store."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from . import _core
from ._call import call_settings, thread_count
from ._geo import region as as_region
from ._sources import source_of
from ._store import checked, real_values
from ._types import Array, Crs, Path, Progress, Records

_READ_OPTIONS = {
    'input_format', 'where', 'region', 'keep', 'drop', 'resolution', 'skip_damaged', 'band', 'cell', 'heights_of_colour', 'entities',
    'block_points',
}


def _reading(sources: Any, transform: Iterable[float] | None, crs: Crs | None, nodata: float | None,
             attributes: Mapping[str, Array] | None, options: dict[str, Any], function: str) -> tuple[Any, dict[str, Any]]:
    arguments = checked(options, _READ_OPTIONS, function)
    if 'region' in arguments:
        arguments['region'] = as_region(arguments['region'])
    source, text = source_of(sources, transform, crs, nodata, attributes)
    if text is not None:
        arguments['crs'] = text
    return source, arguments


class PointReader:
    """An iterator over batches of points, made by point_batches(). Threads may share one.

    dtype: the type of the batches.
    crs: a dict that describes the CRS of the source, as in Store.info.
    """

    def __init__(self, core: Any) -> None:
        self._core = core
        self._attributes = core.attributes()
        self.dtype = real_values(np.empty(0, core.type()), self._attributes).dtype
        self.crs = core.crs()

    def __iter__(self) -> PointReader:
        return self

    def __next__(self) -> Records:
        batch = self._core.next()
        if batch is None:
            raise StopIteration
        return real_values(batch, self._attributes)

    def __repr__(self) -> str:
        return f'<terrace.PointReader: {", ".join(self.dtype.names or ())}>'


def point_batches(sources: Any, *, transform: Iterable[float] | None = None, crs: Crs | None = None, nodata: float | None = None,
                  attributes: Mapping[str, Array] | None = None, threads: int | None = None, **options: Any) -> PointReader:
    """Reads points of files or arrays in batches, in constant memory.

    Points that are close together in the source share a batch.

    sources, transform, crs, nodata, attributes: as in build().
    options: ``where``, ``region``, ``keep``, ``drop``, ``resolution``, ``input_format``, ``entities``,
        ``skip_damaged``, ``band``, ``cell``, ``heights_of_colour`` as in build(); ``block_points`` (10000), the
        largest size of a batch.

    Returns: a PointReader, an iterator of structured arrays: x, y, z in the CRS, then the attributes as in
        Store.points().
    Raises: Error for bad data, OSError, ValueError.

    >>> [len(batch) for batch in point_batches(np.zeros((25000, 3)))]
    [10000, 10000, 5000]
    """
    source, arguments = _reading(sources, transform, crs, nodata, attributes, options, 'point_batches')
    return PointReader(_core.PointReader(source, arguments, thread_count(threads)))


def read_points(sources: Any, *, transform: Iterable[float] | None = None, crs: Crs | None = None, nodata: float | None = None,
                attributes: Mapping[str, Array] | None = None, threads: int | None = None, **options: Any) -> Records:
    """Reads all points of files or arrays into one structured array.

    Arguments and errors are those of point_batches().

    >>> read_points(np.arange(6.0).reshape(2, 3), where='z > 3')
    array([(3., 4., 5.)], dtype=[('x', '<f8'), ('y', '<f8'), ('z', '<f8')])
    """
    reader = point_batches(sources, transform=transform, crs=crs, nodata=nodata, attributes=attributes, threads=threads, **options)
    return np.concatenate([np.empty(0, reader.dtype), *reader])


def write_points(path: Path, points: Any, *, transform: Iterable[float] | None = None, crs: Crs | None = None,
                 nodata: float | None = None, attributes: Mapping[str, Array] | None = None, format: str | None = None,
                 replace: bool = False, progress: Progress | None = None, threads: int | None = None,
                 **options: Any) -> dict[str, Any]:
    """Writes points to a file in the format of its extension: .laz, .las, .copc.laz, .ply, .csv or .xyz.

    The file appears only when complete.

    points, transform, crs, nodata, attributes, options: as in point_batches(). Files are converted in constant
        memory.
    format: overrides the extension: 'xyz', 'csv', 'ply', 'ply-ascii', 'las', 'laz' or 'copc'.

    Returns: a dict with points, nodata (cells without data, and points left out because a coordinate is NaN) and
        rounding (the largest distance by which a coordinate was moved to the grid of LAS).
    Raises: FileExistsError or another OSError; Error; ValueError; KeyboardInterrupt on Ctrl-C, which leaves no file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_points(folder + '/cube.laz', np.arange(6.0).reshape(2, 3))
    {'points': 2, 'nodata': 0, 'rounding': 0.0}
    """
    source, arguments = _reading(points, transform, crs, nodata, attributes, options, 'write_points')
    written, missing, rounding = _core.write_points(source, arguments, os.fsencode(path), format or '', bool(replace),
                                                    call_settings(progress, threads))
    return {'points': written, 'nodata': missing, 'rounding': rounding}
