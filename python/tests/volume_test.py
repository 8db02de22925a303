# SPDX-License-Identifier: Apache-2.0
"""Tetrahedra that follow expanded and collapsed clusters, compared with SciPy's and with those built from scratch."""

import os
import random
import unittest

import numpy as np

import terrace
from python_case import TRANSFORM, StoreCase, hills, sorted_rows

try:
    from scipy.spatial import ConvexHull, Delaunay
except ImportError:
    Delaunay = None


def sorted_cells(points, cells):
    """Returns the corners of cells of different points, shape (m, 4, 3), in an order that does not depend on numbers."""
    order = np.lexsort(points.T[::-1])
    number = np.empty(len(points), int)
    number[order] = np.arange(len(points))
    return points[order][sorted_rows(np.sort(number[cells.astype(int)], axis=1))]


def volumes(points, cells):
    a, b, c, d = (points[cells[:, i]] for i in range(4))
    return np.einsum('ij,ij->i', np.cross(b - a, c - a), d - a) / 6


class Volumes(StoreCase):
    @staticmethod
    def sets(seed):
        """Yields (name, points): in general position, on a lattice with repeated points, and in a plane."""
        numbers = np.random.default_rng(seed)
        yield 'random', numbers.random((700, 3)) * [900, 700, 500] + [300000, 5200000, 100]
        yield 'lattice', numbers.integers(0, 8, (700, 3)).astype(float)
        flat = numbers.integers(0, 30, (500, 3)).astype(float)
        flat[:, 2] = 7
        yield 'plane', flat

    def check(self, model, expected=None):
        """Compares with all present points at once: exactly, and with SciPy where that has one answer."""
        points, cells = model.tetrahedra
        expected = terrace.Delaunay3(points) if expected is None else expected
        np.testing.assert_array_equal(sorted_cells(points, cells), sorted_cells(expected.points, expected.simplices))
        if len(cells):
            self.assertGreater(volumes(points, cells).min(), 0)

    def walk(self, model, luck, steps):
        """Yields after each of some random changes, which it applies to the state of a renderer."""
        state = model.snapshot()
        vertices = dict(zip(state.added_vertices.tolist(), map(tuple, state.added_positions)))
        cells = dict(zip(state.added_tetrahedra.tolist(), map(tuple, state.added_corners)))
        for _ in range(steps):
            parents = [None, *map(tuple, model.expanded.tolist())]
            children = [tuple(child) for parent in parents for child in model.children(parent).tolist()]
            expanded = {*map(tuple, model.expanded.tolist())}
            chosen = luck.choice(children) if children else None
            low = [luck.choice(np.array([*vertices.values()])[:, i]) for i in range(3)]
            box = [*low, *(x + luck.random() * span for x, span in zip(low, np.ptp([*vertices.values()], axis=0) / 2))]
            kind = luck.randrange(5)
            if chosen and kind < 2:
                delta = model.collapse(chosen) if chosen in expanded else model.expand(chosen)
            elif kind == 2:
                delta = model.refine(box, 0)
            elif kind == 3:
                delta = model.coarsen(box, 1)
            else:
                delta = model.set_detail(luck.randrange(3), focus=[(box, 0)])
            for cell in delta.removed_tetrahedra.tolist():
                del cells[cell]
            for vertex in delta.removed_vertices.tolist():
                del vertices[vertex]
            for vertex, place in zip(delta.moved_vertices.tolist(), map(tuple, delta.moved_positions)):
                self.assertEqual(vertices[vertex], place)
            for numbers, rows, target in ((delta.added_vertices, delta.added_positions, vertices),
                                          (delta.added_tetrahedra, delta.added_corners, cells)):
                self.assertFalse(target.keys() & set(numbers.tolist()))
                target.update(zip(numbers.tolist(), map(tuple, rows)))
            now = model.snapshot()
            self.assertEqual(vertices, dict(zip(now.added_vertices.tolist(), map(tuple, now.added_positions))))
            self.assertEqual(cells, dict(zip(now.added_tetrahedra.tolist(), map(tuple, now.added_corners))))
            yield

    def test_follow_any_changes(self):
        for seed in (1, 2):
            for name, points in self.sets(seed):
                with self.subTest(name=name, seed=seed):
                    store = terrace.build(points, self.path(f'{name}{seed}'), block_points=100, facility_cost=0.05)
                    self.assertGreater(store.top, 1)
                    model = terrace.Multiresolution(store, kind='volume')
                    self.check(model)
                    start = sorted_cells(*model.tetrahedra)
                    for _ in self.walk(model, random.Random(seed), 10):
                        self.check(model)
                    model.set_detail(0)
                    np.testing.assert_array_equal(np.unique(points, axis=0), sorted_rows(model.tetrahedra[0]))
                    self.check(model)
                    model.set_detail(store.top)
                    np.testing.assert_array_equal(sorted_cells(*model.tetrahedra), start)

    def test_equal_a_model_built_at_the_same_detail(self):
        _, points = next(self.sets(3))
        store = terrace.build(points, self.path('built'), block_points=100, facility_cost=0.05)
        box = (300200, 5200100, 150, 300600, 5200400, 250)
        model = terrace.Multiresolution(store, 0, kind='volume')
        for level in range(store.top + 1):
            model.set_detail(level, focus=[(box, 0)])
            again = terrace.Multiresolution(store, level, focus=[(box, 0)], kind='volume')
            np.testing.assert_array_equal(sorted_cells(*model.tetrahedra), sorted_cells(*again.tetrahedra))
            np.testing.assert_array_equal(model.expanded, again.expanded)
        # A box of four numbers has all heights.
        flat = terrace.Multiresolution(store, focus=[((*box[:2], *box[3:5]), 0)], kind='volume')
        tall = terrace.Multiresolution(store, focus=[((*box[:2], 0, *box[3:5], 999), 0)], kind='volume')
        np.testing.assert_array_equal(sorted_cells(*flat.tetrahedra), sorted_cells(*tall.tetrahedra))
        self.assertLess(len(again), len(flat))

    @unittest.skipIf(Delaunay is None, 'SciPy is missing')
    def test_are_those_of_scipy(self):
        _, points = next(self.sets(4))
        points -= [300000, 5200000, 0]  # Qhull is not exact
        store = terrace.build(points, self.path('scipy'), block_points=100, facility_cost=0.05)
        model = terrace.Multiresolution(store, kind='volume')
        for cluster in model.children()[::6]:
            model.expand(cluster)
            places, cells = model.tetrahedra
            np.testing.assert_array_equal(sorted_cells(places, cells), sorted_cells(places, Delaunay(places).simplices))
            self.assertAlmostEqual(volumes(places, cells).sum() / ConvexHull(places).volume, 1, places=12)

    def test_are_delaunay_in_metres_on_the_ground(self):
        numbers = np.random.default_rng(5)
        points = numbers.random((800, 3)) * [0.02, 0.02, 900] + [14, 50, 0]
        store = terrace.build(points, self.path('degrees'), crs='EPSG:4326', block_points=200)
        model = terrace.Multiresolution(store, 0, kind='volume')
        middle = (points[:, 1].min() + points[:, 1].max()) / 2
        # Metres per degree of WGS 84.
        a, e2, latitude = 6378137.0, 0.0066943799901413165, np.radians(middle)
        w = 1 - e2 * np.sin(latitude) ** 2
        scale = np.radians([a / np.sqrt(w) * np.cos(latitude), a * (1 - e2) / w ** 1.5])
        self.check(model, terrace.Delaunay3(model.tetrahedra[0], metric=np.diag([*scale, 1])))
        in_degrees = terrace.Delaunay3(model.tetrahedra[0])
        self.assertFalse(np.array_equal(sorted_cells(*model.tetrahedra), sorted_cells(in_degrees.points, in_degrees.simplices)))

    def test_a_raster_has_a_volume_too(self):
        store = terrace.build(hills(20, 30), self.path('raster'), transform=TRANSFORM, block_points=100)
        model = terrace.Multiresolution(store, kind='volume')
        for _ in self.walk(model, random.Random(6), 8):
            points, cells = model.tetrahedra
            self.assertGreater(volumes(points, cells).min(), 0)
            if Delaunay is not None:
                self.assertAlmostEqual(volumes(points, cells).sum() / ConvexHull(points - points.mean(axis=0)).volume, 1, places=9)

    def test_kinds_do_not_mix(self):
        model = terrace.Multiresolution(self.scan, kind='volume')
        self.assertIn('tetrahedra', repr(model))
        self.assertIn('tetrahedra added', repr(model.snapshot()))
        self.assertIsNone(model._repr_png_())
        for wrong in (lambda: model.mesh, lambda: terrace.Multiresolution(self.scan).tetrahedra,
                      lambda: terrace.Multiresolution(self.scan, kind='surface'), lambda: model.refine((0, 0, 9, 1, 1, 8), 0)):
            with self.assertRaises(ValueError):
                wrong()

    @unittest.skipUnless('TERRACE_DATA' in os.environ and Delaunay is not None, 'TERRACE_DATA is not set or SciPy is missing')
    def test_a_scan(self):
        file = os.path.join(os.environ['TERRACE_DATA'], 'scan', 'bun_zipper.ply')
        if not os.path.exists(file):
            self.skipTest(file + ' is missing')
        store = terrace.build(file, self.path('bunny'))
        model = terrace.Multiresolution(store, kind='volume')
        start = sorted_cells(*model.tetrahedra)
        points = terrace.xyz(store.points())
        low, high = points.min(axis=0), points.max(axis=0)
        box = (*low, *(low + (high - low) / 2))
        model.refine(box, 0)
        inside = ((points >= box[:3]) & (points <= box[3:])).all(axis=1)
        places, cells = model.tetrahedra
        self.assertTrue({*map(tuple, points[inside])} <= {*map(tuple, places)})
        self.assertAlmostEqual(volumes(places, cells).sum() / ConvexHull(places).volume, 1, places=9)
        self.check(model)
        again = terrace.Multiresolution(store, focus=[(box, 0)], kind='volume')
        np.testing.assert_array_equal(sorted_cells(places, cells), sorted_cells(*again.tetrahedra))
        model.coarsen((*low, *high), store.top)
        np.testing.assert_array_equal(sorted_cells(*model.tetrahedra), start)


if __name__ == '__main__':
    unittest.main()
