# SPDX-License-Identifier: Apache-2.0
# The types of the public names; the docstrings are with the sources.
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, Protocol, Union

import numpy as np
import numpy.typing as npt

__version__: str
__all__ = [
    'Assignment', 'BoundedMesh', 'Clusters', 'Delaunay2', 'Delaunay3', 'Error', 'FeatureCollection', 'KMeans',
    'Matching', 'Mesh', 'Raster', 'Store', 'View', 'ViewDelta', 'assignment', 'build', 'cluster',
    'flat_clusters', 'kmeans', 'linkage', 'matching', 'xyz',
]

class _GeoInterface(Protocol):
    @property
    def __geo_interface__(self) -> Any: ...

class _Dlpack(Protocol):
    def __dlpack__(self, *, stream: Any = ...) -> Any: ...

class _Wkt(Protocol):
    def to_wkt(self) -> str: ...

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int32]
_Indices = npt.NDArray[np.int64]
_Array = Union[npt.ArrayLike, _Dlpack]
_Path = Union[str, os.PathLike[str]]
_Crs = Union[str, int, _Wkt]
_Region = Union[Sequence[float], _GeoInterface, Mapping[str, Any], _Path]
_Progress = Union[bool, Callable[[str, int, float, bool], object]]
_Method = Literal['linear', 'natural', 'nearest']
_Quality = Literal['greedy', 'removal', 'fitted']
_Effort = Literal['fast', 'default', 'fine', 'full']

class Error(Exception): ...

class FeatureCollection(dict[str, Any]):
    @property
    def __geo_interface__(self) -> dict[str, Any]: ...

class Raster:
    values: npt.NDArray[Any]
    transform: tuple[float, float, float, float, float, float]
    crs: str | None
    def __init__(self, values: npt.NDArray[Any], transform: tuple[float, float, float, float, float, float],
                 crs: str | None) -> None: ...
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def bounds(self) -> tuple[float, float, float, float]: ...
    def __array__(self, dtype: Any = ...) -> npt.NDArray[Any]: ...

class Mesh:
    vertices: _Floats
    triangles: npt.NDArray[np.uint32]
    levels: npt.NDArray[np.uint8] | None
    def __init__(self, vertices: _Floats, triangles: npt.NDArray[Any],
                 levels: npt.NDArray[np.uint8] | None = ...) -> None: ...
    def __iter__(self) -> Iterator[npt.NDArray[Any]]: ...
    def save(self, path: _Path, replace: bool = ...) -> None: ...
    def area(self) -> float: ...
    @property
    def __geo_interface__(self) -> dict[str, Any]: ...

class BoundedMesh(Mesh):
    max_error: float
    rms_error: float
    samples: int
    uncovered: int
    def __init__(self, vertices: _Floats, triangles: npt.NDArray[Any], measured: Mapping[str, Any]) -> None: ...

def xyz(points: npt.NDArray[Any]) -> _Floats: ...

def build(sources: Any, store: _Path, *, transform: Iterable[float] | None = ..., crs: _Crs | None = ...,
          nodata: float | None = ..., attributes: Mapping[str, _Array] | None = ..., progress: _Progress | None = ...,
          threads: int | None = ..., memory: int | None = ..., **options: Any) -> Store: ...

class Store:
    def __init__(self, core: Any) -> None: ...
    @classmethod
    def open(cls, path: _Path) -> Store: ...
    def close(self) -> None: ...
    @property
    def closed(self) -> bool: ...
    def __enter__(self) -> Store: ...
    def __exit__(self, *_: object) -> None: ...
    def __len__(self) -> int: ...
    @property
    def info(self) -> dict[str, Any]: ...
    @property
    def bounds(self) -> tuple[float, float, float, float, float, float]: ...
    @property
    def top(self) -> int: ...
    @property
    def __geo_interface__(self) -> dict[str, Any]: ...
    def level_within(self, most_points: int) -> int: ...
    def points(self, region: _Region | None = ..., level: int | None = ..., where: str | None = ..., *,
               focus: Iterable[tuple[_Region, int]] = ..., cluster: tuple[int, int] | None = ..., crs: _Crs | None = ..., progress: _Progress | None = ...,
               threads: int | None = ...) -> npt.NDArray[Any]: ...
    def query(self, *, box: Sequence[float] | None = ..., near: Sequence[float] | None = ..., k: int | None = ...,
              radius: float | None = ..., level: int = ...) -> npt.NDArray[Any]: ...
    def heights(self, xy: _Array, method: _Method = ..., *, level: int = ..., max_edge: float | None = ...,
                crs: _Crs | None = ..., progress: _Progress | None = ..., threads: int | None = ...,
                memory: int | None = ...) -> _Floats: ...
    def gradients(self, xy: _Array, method: _Method = ..., *, level: int = ..., max_edge: float | None = ...,
                  crs: _Crs | None = ..., progress: _Progress | None = ..., threads: int | None = ...,
                  memory: int | None = ...) -> _Floats: ...
    def raster(self, value: Literal['height', 'slope', 'aspect', 'hillshade'] = ..., *, cell: float | None = ...,
               region: _Region | None = ..., crs: _Crs | None = ..., method: _Method = ..., level: int = ...,
               max_edge: float | None = ..., path: _Path | None = ..., replace: bool = ...,
               progress: _Progress | None = ..., threads: int | None = ..., memory: int | None = ...) -> Raster: ...
    def profile(self, line: _Array | _GeoInterface, step: float | None = ..., *, method: _Method = ..., level: int = ...,
                max_edge: float | None = ..., progress: _Progress | None = ..., threads: int | None = ...) -> _Floats: ...
    def contours(self, interval: float, *, level: int = ..., max_edge: float | None = ..., region: _Region | None = ...,
                 lonlat: bool | None = ..., progress: _Progress | None = ..., threads: int | None = ...,
                 memory: int | None = ...) -> FeatureCollection: ...
    def mesh(self, level: int | None = ..., region: _Region | None = ..., *, focus: Iterable[tuple[_Region, int]] = ...,
             where: str | None = ..., metric: str = ..., crs: _Crs | None = ..., max_points: int | None = ...,
             progress: _Progress | None = ..., threads: int | None = ..., memory: int | None = ...) -> Mesh: ...
    def surface(self, level: int = ..., region: _Region | None = ..., where: str | None = ..., *,
                progress: _Progress | None = ..., threads: int | None = ..., memory: int | None = ...) -> Mesh: ...
    def bounded_mesh(self, max_error: float | None = ..., *, max_points: int | None = ..., quality: _Quality = ...,
                     duplicates: Literal['all', 'min', 'max', 'mean', 'first', 'error'] = ...,
                     fill: Literal['none', 'flat', 'interpolate'] = ..., region: _Region | None = ...,
                     where: str | None = ..., path: _Path | None = ..., replace: bool = ...,
                     progress: _Progress | None = ..., threads: int | None = ...,
                     memory: int | None = ...) -> BoundedMesh: ...
    def tiles(self, folder: _Path, zooms: tuple[int, int] | None = ..., *, progress: _Progress | None = ...,
              threads: int | None = ..., memory: int | None = ..., **options: Any) -> dict[str, Any]: ...
    def verify(self, *, progress: _Progress | None = ..., threads: int | None = ...) -> list[str]: ...

class ViewDelta:
    added_vertices: _Ints
    added_positions: _Floats
    removed_vertices: _Ints
    moved_vertices: _Ints
    moved_positions: _Floats
    added_triangles: _Ints
    added_corners: _Ints
    removed_triangles: _Ints
    expanded: int
    collapsed: int
    missing: int
    pending: int
    points: int
    settled: bool
    def __init__(self, added_vertices: _Ints, added_positions: _Floats, removed_vertices: _Ints, moved_vertices: _Ints,
                 moved_positions: _Floats, added_triangles: _Ints, added_corners: _Ints, removed_triangles: _Ints,
                 expanded: int, collapsed: int, missing: int, pending: int, points: int, settled: bool) -> None: ...

class View:
    def __init__(self, store: Store, kind: Literal['mesh', 'points'] = ..., *, reader: Literal['thread', 'frame'] = ...,
                 max_points: int = ...) -> None: ...
    def frame(self, position: Sequence[float] | None = ..., direction: Sequence[float] = ...,
              up: Sequence[float] = ..., *, fov: float = ..., size: tuple[int, int] = ..., matrix: _Array | None = ...,
              pixel_error: float = ..., ground_error: float = ..., seconds: float = ...) -> ViewDelta: ...
    def snapshot(self) -> ViewDelta: ...
    @property
    def traffic(self) -> dict[str, int]: ...

class _Delaunay:
    ids: _Ints
    def __init__(self, points: _Array | None = ...) -> None: ...
    def insert(self, points: _Array) -> _Ints: ...
    def remove(self, vertices: _Array) -> None: ...
    @property
    def points(self) -> _Floats: ...
    @property
    def vertices(self) -> _Ints: ...
    @property
    def simplices(self) -> _Ints: ...
    @property
    def neighbors(self) -> _Ints: ...
    def find_simplex(self, points: _Array) -> _Ints: ...
    def nearest(self, points: _Array) -> _Ints: ...
    def digest(self) -> int: ...
    def __len__(self) -> int: ...

class Delaunay2(_Delaunay): ...
class Delaunay3(_Delaunay): ...

def linkage(points: _Array, method: Literal['single', 'complete'] = ..., *, threads: int | None = ...) -> _Floats: ...
def flat_clusters(rows: _Array, *, count: int | None = ..., height: float | None = ...) -> npt.NDArray[np.uint32]: ...

class KMeans:
    centres: _Floats
    labels: npt.NDArray[np.uint32]
    inertia: float
    iterations: int
    converged: bool
    def __init__(self, centres: _Floats, labels: npt.NDArray[np.uint32], inertia: float, iterations: int,
                 converged: bool) -> None: ...

def kmeans(points: _Array, clusters: int | _Array, *, weights: _Array | None = ..., seed: int = ..., restarts: int = ...,
           max_iterations: int = ..., tolerance: float = ..., threads: int | None = ...) -> KMeans: ...

class Clusters:
    facilities: npt.NDArray[np.uint32]
    labels: _Indices
    opening_cost: float
    connection_cost: float
    outlier_cost: float
    lower_bound: float
    @property
    def cost(self) -> float: ...
    def __init__(self, facilities: npt.NDArray[np.uint32], labels: _Indices, opening_cost: float, connection_cost: float,
                 outlier_cost: float, lower_bound: float) -> None: ...

def cluster(points: _Array, facility_cost: float = ..., *, count: int | None = ...,
            method: Literal['fast', 'automatic', 'full-scan', 'quadtree', 'octree', 'kd-tree', 'facilities',
                            'interchange', 'jain-vazirani', 'greedy-stars'] = ...,
            effort: _Effort = ..., metric: str = ..., weights: _Array | None = ..., outlier_price: float = ...,
            seed: int = ..., threads: int | None = ...) -> Clusters: ...

class Assignment:
    columns: _Indices
    cost: float
    row_duals: npt.NDArray[Any]
    column_duals: npt.NDArray[Any]
    def __init__(self, columns: _Indices, cost: float, row_duals: npt.NDArray[Any],
                 column_duals: npt.NDArray[Any]) -> None: ...
    def __iter__(self) -> Iterator[_Indices]: ...

def assignment(costs: _Array, columns: _Array | None = ...) -> Assignment: ...

class Matching:
    mates: _Indices
    cost: float
    bound: float
    optimal: bool
    @property
    def pairs(self) -> _Indices: ...
    def __init__(self, mates: _Indices, cost: float, bound: float, optimal: bool) -> None: ...

def matching(points: _Array, *, exact_limit: int = ..., window: int = ..., rounds: int = ...,
             threads: int | None = ...) -> Matching: ...
