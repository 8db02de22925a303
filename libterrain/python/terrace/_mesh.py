# SPDX-License-Identifier: Apache-2.0
"""Meshes that a store gives."""

import os

import numpy as np

from . import _core
from ._arrays import as_array, as_rows
from ._pictures import light, triangles_svg


class Mesh:
    """Triangles between vertices; unpacks as ``vertices, triangles = mesh``.

    vertices: float64, shape (n, 3), in the CRS that was asked for. triangles: uint32, shape (m, 3), numbers of
    vertices, counter-clockwise seen from above. levels: uint8, the highest level of each vertex, or None.
    """

    def __init__(self, vertices, triangles, levels=None):
        self.vertices, self.triangles, self.levels = vertices, triangles, levels

    def __iter__(self):
        return iter((self.vertices, self.triangles))

    def save(self, path, replace=False):
        """Writes a mesh file by its ending: .ply, .obj, .glb, .vtk, whole or not at all; or .svg, a picture from above."""
        path = os.fspath(path)
        if path.endswith('.svg'):
            with open(path, 'w' if replace else 'x', encoding='ascii') as file:
                file.write(self._svg(len(self.triangles)))
            return
        triangles = as_array(self.triangles, 'triangles')
        if triangles.dtype.kind not in 'iu':
            raise TypeError(f'triangles are whole numbers, not {triangles.dtype}')
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(self.vertices)):
            raise ValueError('triangles have corners that are no vertices')
        _core.write_mesh(path, as_rows(self.vertices, 'vertices', (3,)), triangles, bool(replace))

    def area(self):
        """Of the surface, in square units of its coordinates."""
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    @property
    def __geo_interface__(self):
        """The triangles as a GeoJSON MultiPolygon with heights."""
        corners = self.vertices[self.triangles[:, [0, 1, 2, 0]]]
        return {'type': 'MultiPolygon',
                'coordinates': tuple((tuple(map(tuple, ring)),) for ring in corners.tolist())}

    def __repr__(self):
        return f'<terrace.{type(self).__name__}: {len(self.vertices)} vertices, {len(self.triangles)} triangles>'

    def _svg(self, *most):
        return triangles_svg(self.vertices[:, :2], self.triangles, light(self.vertices, self.triangles), *most)

    def _repr_svg_(self):
        return self._svg()


class BoundedMesh(Mesh):
    """A mesh whose vertical error was measured at every sample.

    max_error, rms_error: metres. samples: how many were measured; uncovered: of these, those on no triangle.
    """

    def __init__(self, vertices, triangles, measured):
        super().__init__(vertices, triangles)
        self.max_error, self.rms_error = measured['max_error'], measured['rms_error']
        self.samples, self.uncovered = measured['samples'], measured['uncovered']
