# SPDX-License-Identifier: Apache-2.0
"""Models and views whose triangles follow regions of elliptical metrics, compared with Store.mesh()."""

import json
import random
import unittest

import numpy as np

import terrace
from python_case import TRANSFORM, StoreCase, hills, sorted_rows


def sorted_triangles(vertices, triangles):
    """Returns the corners of triangles, shape (m, 3, 3), in an order that does not depend on numbers."""
    order = np.lexsort(vertices.T[::-1])
    number = np.empty(len(vertices), int)
    number[order] = np.arange(len(vertices))
    rows = number[triangles.astype(int)]
    first = rows.argmin(axis=1)[:, None]
    return vertices[order][sorted_rows(np.take_along_axis(rows, (first + np.arange(3)) % 3, axis=1))]


class MetricModels(StoreCase):
    def metric(self, bounds, name='metric.json', boxes=True):
        low, size = np.array(bounds[:2]), np.array(bounds[3:5]) - bounds[:2]
        regions = [{'semi_axes': [40, 4], 'angle': 30}, {'semi_axes': [1, 9], 'angle': 75}]
        if boxes:
            regions[0]['box'] = [*(low + 0.1 * size), *(low + 0.6 * size)]
            regions[1]['box'] = [*(low + 0.3 * size), *(low + 0.9 * size)]
        with open(self.path(name), 'w', encoding='utf-8') as file:
            json.dump({'regions': regions}, file)
        return 'elliptical:' + self.path(name)

    def stores(self):
        """Yields (name, store): random points, repeated places on a lattice, a raster, and one with voids."""
        numbers = np.random.default_rng(1)
        options = {'block_points': 100, 'facility_cost': 0.05, 'replace': True}
        points = numbers.random((1500, 3)) * [1000, 800, 50]
        yield 'points', terrace.build(points, self.path('points'), **options)
        yield 'lattice', terrace.build(np.floor(points / 40) * 40, self.path('lattice'), **options)
        samples = hills(30, 40)
        yield 'raster', terrace.build(samples, self.path('raster'), transform=TRANSFORM, **options)
        samples[numbers.random(samples.shape) < 0.1] = np.nan
        yield 'voids', terrace.build(samples, self.path('voids'), transform=TRANSFORM, nodata=np.nan, **options)

    def test_models_equal_meshes_of_the_same_detail(self):
        for name, store in self.stores():
            with self.subTest(name=name):
                luck = random.Random(name)
                metric = self.metric(store.info['bounds'])
                model = terrace.Multiresolution(store, metric=metric)
                plain = terrace.Multiresolution(store)
                state = model.snapshot()
                triangles = dict(zip(state.added_triangles.tolist(), map(tuple, state.added_corners)))
                for step in range(16):
                    kind = luck.randrange(3)
                    children = [tuple(child) for parent in [None, *model.expanded.tolist()] for child in model.children(parent).tolist()]
                    chosen = luck.choice(children)
                    low, high = np.array(store.info['bounds']).reshape(2, 3)
                    corners = np.sort(np.array([[luck.random(), luck.random()] for _ in range(2)]), axis=0)
                    box = (low[:2] + corners * (high - low)[:2]).ravel()
                    for each in (model, plain):
                        if kind == 0:
                            delta = each.collapse(chosen) if [*chosen] in each.expanded.tolist() else each.expand(chosen)
                        elif kind == 1:
                            delta = each.refine(box, 0)
                        else:
                            delta = each.coarsen(box, 1 + step % 2)
                        if each is model:
                            for triangle in delta.removed_triangles.tolist():
                                del triangles[triangle]
                            triangles.update(zip(delta.added_triangles.tolist(), map(tuple, delta.added_corners)))
                    self.assertEqual(len(model), len(plain))
                    self.assertEqual(len(model.mesh.triangles), len(plain.mesh.triangles))
                    now = model.snapshot()
                    self.assertEqual(triangles, dict(zip(now.added_triangles.tolist(), map(tuple, now.added_corners))))
                    if step % 4 == 0:
                        focus = [(box, 0)]
                        delta = model.set_detail(step // 4 % 3, focus=focus)
                        plain.set_detail(step // 4 % 3, focus=focus)
                        for triangle in delta.removed_triangles.tolist():
                            del triangles[triangle]
                        triangles.update(zip(delta.added_triangles.tolist(), map(tuple, delta.added_corners)))
                        built = terrace.Multiresolution(store, step // 4 % 3, focus=focus, metric=metric)
                        ours = sorted_triangles(*model.mesh)
                        np.testing.assert_array_equal(ours, sorted_triangles(*built.mesh))
                        # A mesh leaves out triangles over voids before it flips the others.
                        if name != 'voids':
                            np.testing.assert_array_equal(ours, sorted_triangles(*store.mesh(step // 4 % 3, focus=focus, metric=metric)))
                model.set_detail(0)
                plain.set_detail(0)
                self.assertFalse(np.array_equal(sorted_triangles(*model.mesh), sorted_triangles(*plain.mesh)))

    def test_views_equal_meshes_of_the_same_detail(self):
        for name, store in self.stores():
            if name == 'voids':
                continue
            with self.subTest(name=name):
                metric = self.metric(store.info['bounds'])
                view = terrace.View(store, metric=metric, reader='frame')
                for _ in range(1000):
                    if view.frame(ground_error=0.0, seconds=0.1).settled:
                        break
                now = view.snapshot()
                if name != 'lattice':  # equal points are not needed
                    self.assertEqual(now.points, len(store))
                numbers = np.searchsorted(now.added_vertices, now.added_corners)
                mesh = store.mesh(0, metric=metric)
                metres = view.to_metres(mesh.vertices)
                np.testing.assert_array_equal(sorted_triangles(now.added_positions, numbers), sorted_triangles(metres, mesh.triangles))

    def test_metrics_that_do_not_fit(self):
        turned = terrace.build(self.samples, self.path('turned'), transform=(7, -7, 0, 7, 7, 0))
        boxed = self.metric(turned.info['bounds'])
        for kind in (terrace.Multiresolution, terrace.View):
            for metric in ('squared', 'minkowski:3', 'round', boxed):
                with self.assertRaises(ValueError):
                    kind(turned, metric=metric)
            with self.assertRaises(terrace.Error):
                kind(turned, metric='elliptical:' + self.path('none.json'))
            kind(turned, metric=self.metric(turned.info['bounds'], 'everywhere.json', boxes=False))
        for wrong in (lambda: terrace.View(self.scan, 'points', metric=boxed), lambda: terrace.View(self.scan, 'surface', metric=boxed),
                      lambda: terrace.Multiresolution(self.scan, kind='volume', metric=boxed)):
            with self.assertRaisesRegex(ValueError, '`metric`'):
                wrong()


if __name__ == '__main__':
    unittest.main()
