# SPDX-License-Identifier: Apache-2.0
"""The types of arguments and results."""

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Callable, Protocol, Tuple, Union

import numpy as np
import numpy.typing as npt


class GeoInterface(Protocol):
    """A shape of shapely, geopandas or another package."""

    @property
    def __geo_interface__(self) -> Any: ...


class Dlpack(Protocol):
    """An array of another package that shares its memory."""

    def __dlpack__(self, *, stream: Any = ...) -> Any: ...


class SparseMatrix(Protocol):
    """A sparse matrix of scipy.sparse."""

    def tocsr(self) -> Any: ...


class CrsObject(Protocol):
    """A reference system of pyproj, rasterio or another package."""

    def to_wkt(self) -> str: ...


AnyArray = npt.NDArray[Any]
Records = npt.NDArray[Any]  #: a structured array
Float64Array = npt.NDArray[np.float64]
Int32Array = npt.NDArray[np.int32]
Int64Array = npt.NDArray[np.int64]
UInt8Array = npt.NDArray[np.uint8]
UInt32Array = npt.NDArray[np.uint32]
UInt64Array = npt.NDArray[np.uint64]

Array = Union[npt.ArrayLike, Dlpack]
Path = Union[str, os.PathLike[str]]
Crs = Union[str, int, CrsObject]
Region = Union[Sequence[float], GeoInterface, Mapping[str, Any], Path]
Focuses = Iterable[Tuple[Region, int]]
ClusterId = Union[Tuple[int, int], npt.NDArray[Any]]
Progress = Union[bool, Callable[[str, int, float, bool], object]]
