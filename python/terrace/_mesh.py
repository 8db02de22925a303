# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from . import _core
from ._arrays import as_integer, as_numbered, as_rows
from ._call import notes, thread_count
from ._names import SurfaceSmoothing
from ._pictures import light, relief_png, triangles_svg
from ._types import AnyArray, Array, Float64Array, Path, UInt8Array


def metres_per_unit(places: Float64Array, units: Any) -> Float64Array:
    """Returns the metres per unit of x, y and z at the centre of places, shape (n, 3).

    units: the units from the core, or None if unknown, which gives ones.
    """
    known = places[np.isfinite(places).all(axis=1)]
    if units is None or len(known) == 0:
        return np.ones(3)
    return np.array(_core.metres_per_unit(units, *known.min(axis=0), *known.max(axis=0)))


def surface_smoothing(method: str = 'taubin', iterations: int = 10, limit: float | None = None) -> tuple[str, int, float | None]:
    """Returns the options of a smoothing as the compiled half expects them."""
    return method, as_integer(iterations, 'iterations', bits=32), None if limit is None else float(limit)


class Mesh:
    """A triangle mesh; unpacks as ``vertices, triangles = mesh``.

    A notebook shows it from above as shaded relief, in metres on the ground if the units are known.

    vertices: float64, shape (n, 3), in the requested CRS.
    triangles: uint32, shape (m, 3), rows of ``vertices``, counter-clockwise seen from above.
    levels: uint8, the highest level of each vertex in its store, or None.
    """

    def __init__(self, vertices: Float64Array, triangles: AnyArray, levels: UInt8Array | None = None) -> None:
        self.vertices, self.triangles, self.levels = vertices, triangles, levels

    @classmethod
    def _of(cls, result: Any) -> Mesh:
        """Wraps what the core returns: the arrays, and the units of the coordinates."""
        mesh = Mesh(*result[:3])
        mesh._units = result[3]
        return mesh

    @property
    def vertices(self) -> Float64Array:
        """Coordinates, float64, shape (n, 3). Setting them discards the units."""
        return self._vertices

    @vertices.setter
    def vertices(self, vertices: Float64Array) -> None:
        self._vertices, self._units = vertices, None

    def __iter__(self) -> Iterator[AnyArray]:
        return iter((self.vertices, self.triangles))

    @classmethod
    def read(cls, path: Path) -> Mesh:
        """Reads a mesh file: .ply, .glb, .obj, .off or .stl. Polygons are divided into fans of triangles.

        Raises: ValueError for a file without triangles; OSError; Error.
        """
        path = os.fspath(path)
        with open(path, 'rb'):  # raises OSError if there is no such file
            return Mesh._of(_core.read_mesh(os.fsencode(path)))

    def save(self, path: Path, replace: bool = False, *, normals: bool = False) -> None:
        """Writes a mesh file in the format of its extension: .ply, .obj or .glb, or .svg for a picture from above.

        .ply, .obj and .glb files appear only when complete. glTF knows only metres, so .glb files of a store in
        degrees or feet are converted to metres (see "Meshes in metres" in the manual), and ``asset.extras`` in
        the file describes how to convert back. A mesh made of arrays, or whose ``vertices`` have been set, is written
        unconverted. A note of the conversion goes to ``logging.getLogger('terrace')``.

        path: the file to write.
        replace: whether an existing file is overwritten.
        normals: whether the file gets a normal for each vertex, as of normals(), for shading. Not in .svg.
        """
        path = os.fspath(path)
        if path.endswith('.svg'):
            with open(path, 'w' if replace else 'x', encoding='ascii') as file:
                vertices = self._in_metres()
                file.write(triangles_svg(vertices[:, :2], self.triangles, light(vertices, self.triangles)))
            return
        note = _core.write_mesh(os.fsencode(path), *self._parts(), bool(normals), bool(replace), self._units)
        if note:
            notes.info(note)

    def _parts(self) -> tuple[Float64Array, AnyArray]:
        vertices = as_rows(self.vertices, 'vertices', (3,))
        return vertices, as_numbered(self.triangles, 'triangles', 3, most=len(vertices) - 1)

    def measures(self) -> dict[str, Any]:
        """Measures the mesh as a surface in space, in O(n log n) time.

        Returns: a dict with faces, vertices (that have a face), edges, area, volume (enclosed, negative if inside
            out), components, euler_characteristic (2 for a sphere, 2 less for each handle), border_edges,
            non_manifold_edges and closed.
        Raises: ValueError.
        """
        return _core.measure(*self._parts())

    def turned_outward(self) -> Mesh:
        """Returns the mesh with components of negative volume turned inside out. Raises: ValueError."""
        return Mesh._of((self.vertices, _core.turned_outward(*self._parts()), self.levels, self._units))

    def smoothed(self, method: SurfaceSmoothing = 'taubin', *, iterations: int = 10, limit: float | None = None,
                 threads: int | None = None) -> Mesh:
        """Returns the mesh with noise removed: a surface in space with the same triangles and moved vertices.

        Vertices on the border of an open surface stay. Non-manifold edges, coincident vertices and triangles without
        area are allowed.

        method: 'taubin' keeps the volume and rounds edges; 'bilateral' filters the normals of the triangles and keeps
            edges.
        iterations: pairs of steps, or passes over the normals.
        limit: no vertex moves farther than this, in the unit of the vertices; by default the median length of the
            triangles' sides.

        Raises: ValueError.

        Source: G. Taubin, 1995; Y. Zheng, H. Fu, O. Au, C. Tai, 2011.
        """
        moved = _core.smoothed(*self._parts(), surface_smoothing(method, iterations, limit), thread_count(threads))
        return Mesh._of((moved, self.triangles, self.levels, self._units))

    def normals(self, threads: int | None = None) -> Float64Array:
        """Returns a unit normal for each vertex, float64, shape (n, 3).

        It is the mean of the normals of the triangles around the vertex, weighted by their angles there; zero if they
        have no area or cancel out.

        Raises: ValueError.
        """
        return _core.vertex_normals(*self._parts(), thread_count(threads))

    def errors(self, samples: Array) -> dict[str, Any]:
        """Measures the vertical distances of samples from the mesh, in O(n) time.

        Seen from above, the triangles of the mesh must not overlap.

        samples: shape (n, 3).

        Returns: a dict with samples, uncovered (samples on no triangle, not measured), max_error, rms_error and worst
            (the index of the sample with the largest error, -1 for none).
        Raises: ValueError.

        >>> flat = Mesh(np.array([[0., 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
        >>> flat.errors([[0.2, 0.2, 3], [1, 1, 0]])
        {'max_error': 3.0, 'rms_error': 3.0, 'samples': 2, 'uncovered': 1, 'worst': 0}
        """
        columns = np.ascontiguousarray(as_rows(samples, 'samples', (3,)).T)
        return _core.measure_surface(*columns, *self._parts())

    def area(self) -> float:
        """Returns the area of the surface in space, in square units of its coordinates."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    @property
    def __geo_interface__(self) -> dict[str, Any]:
        """The triangles as a GeoJSON MultiPolygon with heights."""
        corners = self.vertices[self.triangles[:, [0, 1, 2, 0]]]
        return {'type': 'MultiPolygon',
                'coordinates': tuple((tuple(map(tuple, ring)),) for ring in corners.tolist())}

    def __repr__(self) -> str:
        return f'<terrace.{type(self).__name__}: {len(self.vertices)} vertices, {len(self.triangles)} triangles>'

    def _in_metres(self) -> Float64Array:
        vertices = np.asarray(self.vertices, np.float64)
        return vertices * metres_per_unit(vertices, self._units)

    def _repr_png_(self) -> bytes:
        return relief_png(self._in_metres(), self.triangles)


class BoundedMesh(Mesh):
    """A mesh whose vertical error was measured at every sample.

    max_error, rms_error: in metres.
    samples: the number of samples measured.
    uncovered: the number of samples on no triangle.
    """

    def __init__(self, vertices: Float64Array, triangles: AnyArray, measured: Mapping[str, Any]) -> None:
        super().__init__(vertices, triangles)
        self._units = measured.get('units')
        self.max_error, self.rms_error = measured['max_error'], measured['rms_error']
        self.samples, self.uncovered = measured['samples'], measured['uncovered']
