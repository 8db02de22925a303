# SPDX-License-Identifier: Apache-2.0
"""Notebooks show small PNGs, with the shape of the ground in metres, without noise and without holes."""

import re
import unittest

import numpy as np

import terrace
from python_case import StoreCase, hills, pixels_of

MOST_BYTES = 400_000


def grid_mesh(heights, x, y):
    """Two triangles for each cell. x, y: of columns and rows."""
    rows, columns = heights.shape
    vertices = np.column_stack((np.tile(x, rows), np.repeat(y, columns), heights.ravel()))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below, other = corner + columns, corner + 1
    return terrace.Mesh(vertices, np.concatenate((np.column_stack((corner, other, below)),
                                                  np.column_stack((other, below + 1, below)))).astype(np.uint32))


class Pictures(StoreCase):
    def test_tone_of_a_plane_follows_its_slope(self):
        x = np.linspace(0, 3000, 61)
        for east, north in ((0, 0), (0.5, 0), (-0.5, 0), (0, -0.5), (0.3, -0.4)):
            mesh = grid_mesh(east * x[None, :] + north * x[:, None], x, x)
            pixels = pixels_of(mesh._repr_png_())
            self.assertEqual(pixels.shape, (600, 600))
            light = (0.5 * east - 0.5 * north + 0.7071) / np.sqrt(1 + east ** 2 + north ** 2)
            self.assertLessEqual(np.abs(pixels - (30 + 215 * min(max(light, 0), 1))).max(), 1)

    def test_pictures_in_degrees_have_the_shape_of_the_ground(self):
        # The same hill in degrees at 60 degrees north and in metres.
        metres = np.linspace(0, 40_000, 200)
        heights = 3000 * np.exp(-((metres[None, :] - 20_000) ** 2 + (metres[:, None] - 20_000) ** 2) / 1e8)
        lon, lat = 10 + metres / 55_800.0, 60 + metres / 111_412.0
        terrace.build(grid_mesh(heights, lon, lat).vertices, self.path('degrees'), crs='EPSG:4326')
        with terrace.open(self.path('degrees')) as store:
            result = store.mesh(level=0)
            degrees = pixels_of(result._repr_png_())
            elsewhere = pixels_of(store.mesh(level=0, crs='EPSG:32632')._repr_png_())
            bounded = pixels_of(store.bounded_mesh(max_error=5)._repr_png_())
            model = pixels_of(terrace.Multiresolution(store, 0)._repr_png_())
            lines = pixels_of(store.contours(500)._repr_png_())
            result.save(self.path('degrees.svg'))
        flat = pixels_of(grid_mesh(heights, metres, metres)._repr_png_())
        for pixels, most in ((degrees, 4), (model, 4), (bounded, 15)):  # the sides of few triangles are drawn
            self.assertLess(abs(pixels.shape[0] / pixels.shape[1] - 1), 0.02)  # rather than twice as wide
            rows, columns = (min(sizes) for sizes in zip(pixels.shape, flat.shape))
            self.assertLess(np.abs(pixels[:rows, :columns] - flat[:rows, :columns]).mean(), most)
        self.assertLess(abs(lines.shape[0] / lines.shape[1] - 1), 0.02)
        self.assertGreater((elsewhere == 255).mean(), 0)  # meridians are not vertical there
        self.assertLess(abs(np.median(elsewhere[elsewhere < 255]) - np.median(flat)), 4)
        with open(self.path('degrees.svg'), encoding='ascii') as file:
            width, height = map(int, re.search(r'width="(\d+)" height="(\d+)"', file.read(300)).groups())
        self.assertLess(abs(width / height - 1), 0.02)

    def test_many_triangles_give_smooth_pictures_without_holes(self):
        y, x = np.mgrid[0:900, 0:1200]
        mesh = grid_mesh(60 * np.sin(x / 90) * np.cos(y / 70), np.arange(1200.0) * 5, np.arange(900.0) * 5)
        png = mesh._repr_png_()
        self.assertLess(len(png), MOST_BYTES)
        pixels = pixels_of(png)
        self.assertEqual(max(pixels.shape), 600)
        self.assertLess(pixels.max(), 255)  # a hole would be white
        self.assertLess(np.abs(np.diff(pixels, axis=1)).mean(), 3)
        self.assertGreater(np.ptp(pixels), 20)

    def test_sizes_are_bounded(self):
        random = np.random.default_rng(1)
        rough = terrace.Mesh(np.column_stack((random.random((60_000, 2)), random.random(60_000))),
                             random.integers(0, 60_000, (50_000, 3)).astype(np.uint32))  # each spans the whole picture
        flat = random.random((200_000, 2))
        for shown in (rough, terrace.Delaunay2(flat), terrace.Delaunay2(flat[:300]), terrace.Delaunay2(flat * (1, 1e-9)),
                      terrace.DynamicSurface(random.random((500, 3))), self.scan, self.raster, self.raster.contours(1)):
            png = shown._repr_png_()
            self.assertLess(len(png), MOST_BYTES)
            self.assertLessEqual(max(pixels_of(png).shape), 600)

    def test_store_and_its_mesh_look_alike(self):
        bounded, whole = (pixels_of(shown._repr_png_()) for shown in (self.raster.bounded_mesh(max_error=0.5), self.raster))
        self.assertEqual(bounded.shape, whole.shape)
        self.assertLess(np.abs(bounded - whole).mean(), 40)  # the sides of the mesh are drawn
        expected = grid_mesh(hills()[::-1], np.arange(150.0) * 10, np.arange(120.0) * 10)
        self.assertLess(np.abs(pixels_of(expected._repr_png_()) - whole).mean(), 2)

    def test_degenerate_meshes(self):
        none = np.empty((0, 3), np.uint32)
        for vertices, triangles in (([], none), ([[0, 0, 0]], none), ([[1, 2, 3]] * 3, [[0, 1, 2]]),
                                    ([[0, 0, 0], [1, 0, 0], [2, 0, 5]], [[0, 1, 2]]), ([[0, 0, 0], [0, 9, 0], [0, 0, 9]], [[0, 1, 2]]),
                                    ([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
                                    ([[np.inf, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
                                    ([[-1e308, 0, 0], [1e308, 0, 0], [0, 1e308, 0]], [[0, 1, 2]]),
                                    ([[0, 0, 0], [1e-300, 0, 1e149], [0, 1e-300, 0]], [[0, 1, 2]])):
            png = terrace.Mesh(np.reshape(np.array(vertices, float), (-1, 3)), np.array(triangles, np.uint32))._repr_png_()
            self.assertTrue(png.startswith(b'\x89PNG'))
        for points in ([], [[1, 1]], [[0, 0], [1, 1], [2, 2]]):
            self.assertTrue(terrace.Delaunay2(np.reshape(points, (-1, 2)))._repr_png_().startswith(b'\x89PNG'))
        self.assertTrue(terrace.FeatureCollection({'type': 'FeatureCollection', 'features': []})._repr_png_().startswith(b'\x89PNG'))


if __name__ == '__main__':
    unittest.main()
