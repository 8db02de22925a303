# SPDX-License-Identifier: Apache-2.0
"""Stores return the points they were built from, all or in part."""

import errno
import json
import logging
import os
import pathlib
import subprocess
import tempfile
import threading
import time
import unittest

import numpy as np

import terrace
from python_case import ALPS, COMMAND, TRANSFORM, StoreCase, cell_centres, cloud, hills, sorted_rows


class Stores(StoreCase):
    def test_returns_every_point(self):
        got = self.scan.points()
        self.assertEqual(got.dtype.names, ('x', 'y', 'z', 'class'))
        self.assertEqual(got.dtype['class'], np.uint8)
        both = np.column_stack((self.points, self.classes))
        np.testing.assert_array_equal(sorted_rows(np.column_stack((terrace.xyz(got), got['class']))), sorted_rows(both))
        view = terrace.xyz(got)
        self.assertTrue(np.shares_memory(view, got))
        np.testing.assert_array_equal(terrace.xyz(got[::-3]), view[::-3])
        for wrong in (np.zeros(3), np.zeros(3, [('x', 'f4'), ('y', 'f8'), ('z', 'f8')]),
                      np.zeros(3, [('x', 'f8'), ('z', 'f8'), ('y', 'f8')]), np.zeros((2, 2), got.dtype)):
            with self.assertRaises(ValueError):
                terrace.xyz(wrong)

    def test_merges_parts_into_the_whole(self):
        options = {'crs': 'EPSG:32632', 'block_points': 500}
        a, _, c, d, e, f = TRANSFORM
        parts = []
        for begin, end in ((0, 60), (60, 61), (61, 150)):
            part = self.path(f'columns{begin}')
            moved = (a, 0, c + a * begin, d, e, f)
            terrace.build(self.samples[:, begin:end].copy(), part, transform=moved, **options).close()
            parts.append(part)
        with terrace.build(self.samples, self.path('columns'), transform=TRANSFORM, **options) as whole:
            with terrace.merge(reversed(parts), self.path('columns-merged'), threads=2) as merged:
                self.assertEqual(merged.verify(), [])
                self.assertEqual([level['segments'] for level in merged.info['levels']][0], 3)
                np.testing.assert_array_equal(sorted_rows(terrace.xyz(merged.points())),
                                              sorted_rows(terrace.xyz(whole.points())))
                places = np.random.default_rng(3).random((500, 2)) * [a * 149, e * 119] + [c + a / 2, f + e / 2]
                np.testing.assert_array_equal(merged.heights(places), whole.heights(places))
                bounded = [store.bounded_mesh(max_error=2.0) for store in (merged, whole)]
                np.testing.assert_array_equal(*(mesh.triangles for mesh in bounded))
        with self.assertRaises(FileExistsError):
            terrace.merge(parts, self.path('columns-merged'))
        terrace.merge(parts[:2], self.path('columns-merged'), replace=True).close()
        with self.assertRaises(FileNotFoundError):
            terrace.merge([parts[0], self.path('nowhere')], self.path('other'))
        with self.assertRaises(ValueError):
            terrace.merge(parts[:1], self.path('other'))
        with self.assertRaisesRegex(terrace.Error, 'both have a value for the cell'):
            terrace.merge([parts[0], self.path('columns')], self.path('other'))
        self.assertFalse(os.path.exists(self.path('other')))

    def test_appends_to_a_store(self):
        first, second = cloud(3000, seed=5), cloud(3000, seed=6)
        path = self.path('grows')
        terrace.build(first[0], path, attributes={'class': first[1]}, block_points=500).close()
        before = terrace.open(path)
        with terrace.build(second[0], path, attributes={'class': second[1]}, append=True) as store:
            self.assertEqual(store.verify(), [])
            np.testing.assert_array_equal(sorted_rows(terrace.xyz(store.points())),
                                          sorted_rows(np.concatenate((first[0], second[0]))))
            self.assertEqual(store.info['parameters'], before.info['parameters'])
        # A reader keeps the store that it has opened.
        np.testing.assert_array_equal(sorted_rows(terrace.xyz(before.points())), sorted_rows(first[0]))
        with self.assertRaisesRegex(terrace.Error, 'attributes'):
            terrace.build(second[0], path, append=True)
        with self.assertRaises(ValueError):
            terrace.build(second[0], path, attributes={'class': second[1]}, append=True, facility_cost=9)
        with self.assertRaises(ValueError):
            terrace.build(second[0], path, attributes={'class': second[1]}, append=True, replace=True)
        with self.assertRaises(FileNotFoundError):
            terrace.build(second[0], self.path('nowhere'), append=True)

    def test_returns_every_sample_at_its_cell_centre(self):
        got = terrace.xyz(self.raster.points())
        expected = np.column_stack((cell_centres(*self.samples.shape).reshape(-1, 2), self.samples.ravel()))
        np.testing.assert_array_equal(sorted_rows(got), sorted_rows(expected))

    def test_info(self):
        info = self.raster.info
        self.assertEqual((info['points'], info['columns'], info['rows']), (self.samples.size, 150, 120))
        self.assertEqual(info['crs']['epsg'], 32632)
        self.assertEqual(info['levels'][0]['points'], self.samples.size)
        self.assertEqual(len(self.raster), self.samples.size)
        low = cell_centres(*self.samples.shape)
        self.assertEqual(self.raster.bounds[:2], (low[..., 0].min(), low[..., 1].min()))
        self.assertEqual(self.raster.bounds[5], self.samples.max())
        self.assertIn('20000 points', repr(self.scan))
        self.assertIn('EPSG:32632', repr(self.scan))
        self.assertLess(len(self.scan._repr_png_()), 400_000)
        self.assertEqual(self.scan.verify(), [])

    def test_a_path_opens_a_store(self):
        path = self.scan.info['path']
        for opened in (terrace.Store(path), terrace.open(path), terrace.Store.open(path), terrace.Store(pathlib.Path(path))):
            with opened as store:
                self.assertEqual((len(store), store.bounds), (20000, self.scan.bounds))
                self.assertGreater(len(store.where('classification == 2')) if 'classification' in store.points().dtype.names else 1, 0)
        for wrong, kind in ((self.path('nothing'), FileNotFoundError), (self.folder, terrace.Error), (3, TypeError), (None, TypeError)):
            for opener in (terrace.Store, terrace.open):
                with self.assertRaises(kind):
                    opener(wrong)
        self.assertNotIn('open', terrace.__all__)  # `from terrace import *` must not hide Python's

    def test_rejects_misspelt_options(self):
        for wrong in (lambda: terrace.build(self.points, self.path('typo'), replce=True), lambda: self.raster.tiles(self.path('typo'), max_eror=1),
                      lambda: self.raster.heights([[0, 0]], level_=1), lambda: self.scan.mesh(smoothing={'methd': 'taubin'}),
                      lambda: self.raster.raster(cel=1)):
            with self.assertRaisesRegex(TypeError, 'replce|max_eror|level_|methd|cel'):
                wrong()
        self.assertFalse(os.path.exists(self.path('typo')))

    def test_regions_levels_and_conditions(self):
        box = (300100, 5200100, 300400, 5200300)
        x, y = self.points[:, 0], self.points[:, 1]
        inside = (x >= box[0]) & (x <= box[2]) & (y >= box[1]) & (y <= box[3])
        for got in (self.scan.points(region=box), self.scan.query(box=box)):
            np.testing.assert_array_equal(sorted_rows(terrace.xyz(got)), sorted_rows(self.points[inside]))
        both = inside & (self.classes == 3)
        self.assertEqual(len(self.scan.points(region=box, where='class == 3')), both.sum())
        for level in self.scan.info['levels']:
            self.assertEqual(len(self.scan.points(level=level['level'])), level['points'])
        # A triangle in GeoJSON.
        corners = [[300000, 5200000], [301000, 5200000], [300000, 5200800], [300000, 5200000]]
        got = self.scan.points(region={'type': 'Polygon', 'coordinates': [corners]})
        self.assertEqual(len(got), ((x - 300000) / 1000 + (y - 5200000) / 800 <= 1).sum())
        far = (-9e6, -9e6, -8e6, -8e6)
        for use in (self.scan.points, self.scan.mesh):
            with self.assertLogs('terrace', 'INFO') as log:
                use(level=self.scan.top, focus=[(far, 0)])
            self.assertIn('is outside the store and adds no points: they have x from ', log.output[0])
        focused = self.scan.points(level=self.scan.top, focus=[(box, 0)])
        self.assertGreaterEqual(len(focused), inside.sum())
        self.assertLess(len(focused), len(self.points))

    def test_view_with_a_condition_matches_a_store_of_its_points(self):
        condition, keeps = 'class == 3', self.classes == 3
        part = self.points[keeps]
        alone = terrace.build(part, self.path('alone'), crs=32632, block_points=500)
        self.addCleanup(alone.close)
        view = self.scan.where(condition)
        self.assertEqual(len(view), keeps.sum())
        self.assertEqual(view.bounds, alone.bounds)
        self.assertAlmostEqual(view.info['mean_height'], part[:, 2].mean(), 9)
        self.assertEqual(view.count(view.bounds), keeps.sum())
        np.testing.assert_array_equal(sorted_rows(terrace.xyz(view.points())), sorted_rows(part))
        for level in view.info['levels']:
            self.assertEqual(len(view.points(level=level['level'])), level['points'])
            self.assertEqual(len(self.scan.points(level=level['level'], where=condition)), level['points'])
        low, high = np.array(view.bounds[:2]), np.array(view.bounds[3:5])
        xy = np.random.default_rng(5).uniform(low - 20, high + 20, (500, 2))
        for method in ('linear', 'natural', 'nearest'):
            heights = view.heights(xy, method)
            np.testing.assert_array_equal(heights, alone.heights(xy, method))
            self.assertFalse(np.array_equal(heights, self.scan.heights(xy, method), equal_nan=True))
        np.testing.assert_array_equal(view.gradients(xy), alone.gradients(xy))
        line = np.array([low, high])
        np.testing.assert_array_equal(view.profile(line), alone.profile(line))
        one, other = view.raster(), alone.raster()
        np.testing.assert_array_equal(one.values, other.values)
        self.assertEqual(tuple(one.transform), tuple(other.transform))
        self.assertEqual(view.contours(20, lonlat=False), alone.contours(20, lonlat=False))

        def corners(mesh):
            triangles = mesh.vertices[mesh.triangles]
            return sorted(tuple(map(tuple, sorted(map(tuple, t)))) for t in triangles)

        triangles = corners(alone.mesh(level=0))
        self.assertEqual(corners(view.mesh(level=0)), triangles)
        self.assertEqual(corners(self.scan.mesh(level=0, where=condition)), triangles)
        self.assertEqual(view.level_within(keeps.sum()), 0)
        self.assertGreater(view.level_within(keeps.sum() - 1), 0)
        mesh = view.bounded_mesh(2, duplicates='mean')
        self.assertEqual(mesh.samples, keeps.sum())
        self.assertLessEqual(mesh.errors(part)['max_error'], 2 + 1e-9)
        self.assertLessEqual(self.scan.bounded_mesh(2, duplicates='mean', where=condition).errors(part)['max_error'], 2 + 1e-9)
        view.tiles(self.path('tiles'), (8, 12), max_error=5, vertical='ignore')
        checked = terrace.verify_tiles(self.path('tiles'), alone, vertical='ignore')
        self.assertEqual(checked['faults'], [])
        self.assertGreater(checked['samples'], keeps.sum())

        both = view.where('z > 60')
        self.assertEqual(len(both), (part[:, 2] > 60).sum())
        for condition in ('class == 77', 'class ==', 'colour == 1'):
            with self.assertRaises(terrace.Error):
                self.scan.where(condition)
        for kind in (terrace.View, terrace.Multiresolution):
            with self.assertRaisesRegex(ValueError, 'pass the store itself'):
                kind(view)
        view.close()
        with self.assertRaises(ValueError):
            view.points()
        self.assertEqual(len(self.scan.points()), len(self.points))

    def test_clusters(self):
        level = self.scan.info['levels'][1]
        parts = [self.scan.points(cluster=(1, number), level=0) for number in range(level['clusters'])]
        np.testing.assert_array_equal(sorted_rows(terrace.xyz(np.concatenate(parts))), sorted_rows(self.points))
        one = self.scan.points(cluster=(1, 0), where='class == 3')
        self.assertTrue((one['class'] == 3).all())
        if COMMAND:
            name = self.path('cluster.ply')
            subprocess.run([COMMAND, 'points', self.path('cloud'), '--cluster', '1:0', '-o', name, '-q'], check=True)
            theirs = terrace.build(name, self.path('cluster')).points()
            np.testing.assert_array_equal(sorted_rows(terrace.xyz(theirs)),
                                          sorted_rows(terrace.xyz(self.scan.points(cluster=(1, 0)))))
        for wrong in ((99, 0), (0, 10 ** 9), (0, 2 ** 60), (1,), (1, -1)):
            with self.assertRaises(ValueError):
                self.scan.points(cluster=wrong)
        with self.assertRaises(ValueError):
            self.scan.points(cluster=(1, 0), region=(0, 0, 1, 1))

    def test_table_of_clusters(self):
        for level in range(self.scan.top + 1):
            described = self.scan.clusters(level)
            self.assertEqual(len(described), self.scan.info['levels'][level]['clusters'])
            self.assertEqual(described['descendants'].sum() if level < self.scan.top else len(self.points), len(self.points))
            for number in range(0, len(described), 7):
                if level == self.scan.top:
                    continue
                below = terrace.xyz(self.scan.points(cluster=(level, number), level=0))
                self.assertEqual(len(below), described['descendants'][number])
                box = np.concatenate((below.min(axis=0), below.max(axis=0)))
                grown = (described['bounds'][number] - box) * [-1, -1, -1, 1, 1, 1]
                self.assertTrue((grown >= 0).all() and (grown < 0.05 * np.tile(np.ptp(self.points, axis=0), 2)).all())
                # The representative is last.
                farthest = np.linalg.norm(below - terrace.xyz(self.scan.points(cluster=(level, number)))[-1], axis=1).max()
                self.assertLessEqual(farthest, described['error'][number] * 1.001)
        with self.assertRaises(ValueError):
            self.scan.clusters(99)

    def test_counts(self):
        random = np.random.default_rng(30)
        for store, points in ((self.scan, self.points), (self.raster, terrace.xyz(self.raster.points()))):
            low, size = points.min(axis=0), np.ptp(points, axis=0)
            for _ in range(20):
                box = np.sort(random.random((2, 3)), axis=0) * size * 1.1 + low - 0.05 * size
                inside = ((points >= box[0]) & (points <= box[1])).all(axis=1)
                self.assertEqual(store.count(box.ravel()), inside.sum())
                flat = ((points >= box[0]) & (points <= box[1]))[:, :2].all(axis=1)
                self.assertEqual(store.count(box[:, :2].ravel()), flat.sum())
        turned = terrace.build(self.samples, self.path('turned'), transform=(7, -7, 0, 7, 7, 0))
        for store, wrong in ((turned, (0, 0, 1, 1)), (self.scan, (1, 1, 0, 0)), (self.scan, {'type': 'Polygon', 'coordinates': [[(0, 0), (1, 0), (0, 1)]]})):
            with self.assertRaises(ValueError):
                store.count(wrong)

    def test_regions_in_other_reference_systems(self):
        to_lonlat = terrace.Transformation(32632, 4326)
        corners = np.array([[300200, 5200100], [300800, 5200150], [300500, 5200700]], float)
        region = {'type': 'Polygon', 'coordinates': [to_lonlat.forward(corners).tolist()]}
        own = self.scan.own_region(region, 'EPSG:4326')
        got = self.scan.points(region=own)
        self.assertEqual(len(got), len(self.scan.points(region={'type': 'Polygon', 'coordinates': [corners.tolist()]})))
        self.assertEqual(own['type'], 'MultiPolygon')
        west, south = to_lonlat.forward(corners).min(axis=0)
        east, north = to_lonlat.forward(corners).max(axis=0)
        lonlat = to_lonlat.forward(self.points[:, :2])
        inside = ((lonlat >= [west, south]) & (lonlat <= [east, north])).all(axis=1)
        box = self.scan.own_region((west, south, east, north), 4326)
        self.assertAlmostEqual(len(self.scan.points(region=box)), inside.sum(), delta=2)
        same = self.scan.own_region((0, 0, 1, 1), 'EPSG:32632')['coordinates'][0][0]
        self.assertEqual({*map(tuple, same)} >= {(0, 0), (1, 1)} and same[0] == same[-1], True)
        for wrong in (lambda: self.scan.own_region(None, 4326), lambda: self.scan.own_region((0, 0, 1, 1), None), lambda: self.scan.own_region((0, 0, 1, 1), 'EPSG:1')):
            with self.assertRaises(ValueError):
                wrong()

    def test_geojson_is_in_its_crs_or_in_longitude_and_latitude(self):
        corners = np.array([[300200, 5200100], [300800, 5200150], [300500, 5200700], [300200, 5200100]], float)
        metres = {'type': 'Polygon', 'coordinates': [corners.tolist()]}
        degrees = {'type': 'Polygon', 'coordinates': [terrace.Transformation(32632, 4326).forward(corners).tolist()]}
        expected = len(self.scan.points(region=metres))
        self.assertGreater(expected, 1000)

        class Frame:
            """Imitates a geopandas object."""
            def __init__(self, geometry, crs):
                self.__geo_interface__ = {'type': 'FeatureCollection', 'features': [
                    {'type': 'Feature', 'geometry': None}, {'type': 'Feature', 'geometry': geometry}]}
                self.crs = crs

        named = {'crs': {'type': 'name', 'properties': {'name': 'urn:ogc:def:crs:OGC:1.3:CRS84'}}, **degrees}
        path = self.path('region.geojson')
        with open(path, 'w', encoding='utf-8') as file:
            json.dump(named, file)
        for region in (degrees, named, path, Frame(degrees, None), Frame(degrees, 4326), Frame(metres, 'EPSG:32632'),
                       {'crs': None, **metres}):
            self.assertAlmostEqual(len(self.scan.points(region=region)), expected, delta=2)
            self.assertAlmostEqual(len(terrace.build(self.points, self.path('part'), crs='EPSG:32632', region=region,
                                                     replace=True)), expected, delta=2)
        with self.assertLogs('terrace', 'INFO') as log:
            self.scan.points(region=metres)
        self.assertIn('they are not longitudes and latitudes', log.output[0])
        with self.assertRaises(ValueError):
            self.scan.points(region={'crs': {'type': 'link'}, **degrees})
        with self.assertRaises(terrace.Error):
            self.scan.points(region={'crs': {'type': 'name', 'properties': {'name': 'EPSG:0'}}, **degrees})
        line = {'type': 'LineString', 'coordinates': degrees['coordinates'][0][:2]}
        np.testing.assert_allclose(self.scan.profile(line)[[0, -1], 1:3], corners[:2], atol=1e-3)

    def test_nearest(self):
        place = (300500.0, 5200400.0)
        distances = np.hypot(*(self.points[:, :2] - place).T)
        got = self.scan.query(near=place, k=25)
        order = np.argsort(distances)[:25]
        np.testing.assert_array_equal(terrace.xyz(got), self.points[order])
        np.testing.assert_array_equal(got['class'], self.classes[order])
        # Distances are on the ground; the scale of the map differs by less than a thousandth.
        np.testing.assert_allclose(got['distance'], distances[order], rtol=1e-3)
        self.assertEqual(len(self.scan.query(near=place, k=10 ** 6)), len(self.points))
        with self.assertRaisesRegex(ValueError, '`k` must be at least 1'):
            self.scan.query(near=place, k=0)
        within = self.scan.query(near=place, radius=50.0)
        self.assertTrue((within['distance'] <= 50).all())
        self.assertAlmostEqual(len(within), (distances <= 50).sum(), delta=2)
        one = self.classes[0]
        some = self.scan.query(near=place, k=25, where=f'class == {one}')
        np.testing.assert_array_equal(terrace.xyz(some), self.points[order := np.argsort(
            np.where(self.classes == one, distances, np.inf))[:25]])
        self.assertTrue((self.classes[order] == one).all())
        with self.assertRaisesRegex(terrace.Error, "no 'height'"):
            self.scan.query(near=place, k=1, where='height of')

    def test_other_reference_systems(self):
        got = self.scan.points(crs='EPSG:4326')
        self.assertTrue(((got['x'] > 6) & (got['x'] < 7)).all())
        self.assertTrue(((got['y'] > 46) & (got['y'] < 48)).all())

    def test_closed_and_missing(self):
        with terrace.Store.open(self.path('cloud')) as store:
            self.assertFalse(store.closed)
        self.assertTrue(store.closed)
        self.assertIn('closed', repr(store))
        for use in (store.points, store.mesh, lambda: store.heights([[0, 0]]), lambda: store.query(near=(0, 0), k=1),
                    lambda: terrace.View(store)):
            with self.assertRaisesRegex(ValueError, 'the store is closed'):
                use()
        with self.assertRaises(FileNotFoundError):
            terrace.Store.open(self.path('nowhere'))
        with self.assertRaises(FileNotFoundError) as caught:
            terrace.build(self.path('nowhere.tif'), self.path('new'))
        self.assertEqual(caught.exception.errno, errno.ENOENT)
        self.assertIn('nowhere.tif', str(caught.exception))
        with self.assertRaises(FileExistsError):
            terrace.build(self.points, self.path('cloud'))
        with self.assertRaises(terrace.Error):
            terrace.Store.open(self.folder)

    def test_reports_damage(self):
        store = terrace.build(self.points, self.path('damaged'))
        files = [os.path.join(root, name) for root, _, names in os.walk(self.path('damaged')) for name in names]
        largest = max(files, key=os.path.getsize)
        with open(largest, 'r+b') as file:
            file.seek(os.path.getsize(largest) // 2)
            byte = file.read(1)
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte[0] ^ 0xff]))
        self.assertNotEqual(store.verify(), [])
        with self.assertRaisesRegex(terrace.Error, os.path.basename(largest)):
            store.points()

    def test_rejects_unknown_names(self):
        with self.assertRaisesRegex(TypeError, 'no option .blok_points'):
            terrace.build(self.points, self.path('new'), blok_points=3)
        with self.assertRaisesRegex(ValueError, 'effort.*fast, default, fine, full'):
            terrace.build(self.points, self.path('new'), effort='best')
        with self.assertRaisesRegex(terrace.Error, 'nonsense'):
            self.scan.points(where='nonsense == 1')
        with self.assertRaisesRegex(ValueError, 'no level 99'):
            self.scan.points(level=99)
        with self.assertRaises(ValueError):
            self.scan.points(region=(1, 2, 3))
        with self.assertRaises(ValueError):
            self.scan.points(region=(3, 3, 1, 1))
        with self.assertRaises(ValueError):
            terrace.build(self.points, self.path('new'), crs='EPSG:999999')

    def test_names_the_argument_with_a_too_large_number(self):
        for name, call in (('level', lambda: self.scan.points(level=2 ** 32)), ('cluster', lambda: self.scan.points(cluster=(2 ** 32, 0))),
                           ('cluster', lambda: self.scan.points(cluster=(0, 2 ** 64))), ('k', lambda: self.scan.query(near=(0, 0), k=2 ** 64)),
                           ('threads', lambda: self.scan.verify(threads=2 ** 32)), ('memory', lambda: self.scan.surface(memory=2 ** 64)),
                           ('most_points', lambda: self.scan.level_within(2 ** 64)), ('zooms', lambda: self.scan.tiles('', (0, 2 ** 32))),
                           ('iterations', lambda: self.scan.mesh(smoothing={'iterations': 2 ** 32})),
                           ('seed', lambda: terrace.kmeans(self.points, 3, seed=2 ** 64)), ('rounds', lambda: terrace.matching(self.points, rounds=2 ** 32)),
                           ('threads', lambda: terrace.linkage(self.points, threads=2 ** 32)),
                           ('passes', lambda: terrace.rotate_tree([[0, 1]], [[0, 0], [1, 1]], passes=2 ** 32))):
            with self.subTest(name), self.assertRaisesRegex(ValueError, f'`{name}` must be below 2\\^(32|64)'):
                call()

    def test_rejects_extensions_of_other_formats(self):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
        with tempfile.TemporaryDirectory() as folder:
            for ending, call in (
                    ('png', lambda path: self.raster.raster(path=path)),
                    ('stl', lambda path: self.raster.bounded_mesh(5, path=path)),
                    ('vtk', terrace.Mesh(corners, [[0, 1, 2]]).save),
                    ('tif', lambda path: self.raster.mesh(smoothing='taubin', save_overlay=path)),
                    ('gpkg', lambda path: terrace.write_points(path, self.points)),
                    ('las', lambda path: terrace.build(self.points, path)),
                    ('mbtiles', lambda path: self.raster.tiles(path, vertical='ignore'))):
                with self.subTest(ending), self.assertRaisesRegex(ValueError, f'cannot be written as .{ending}'):
                    call(os.path.join(folder, 'x.' + ending))
            self.assertEqual(os.listdir(folder), [])
            with self.assertRaisesRegex(ValueError, "`format` 'foo': a file of points can be xyz, csv"):
                terrace.write_points(os.path.join(folder, 'x'), self.points, format='foo')

    def test_rejects_endlessly_nested_regions(self):
        endless = {'type': 'GeometryCollection'}
        endless['geometries'] = [endless]
        with self.assertRaisesRegex(ValueError, 'not GeoJSON'):
            self.scan.points(endless)

    def test_messages_use_the_modules_parameter_names(self):
        for name, kind, call in (('radius', ValueError, lambda: self.scan.query(near=(0, 0), radius=-1)),
                                 ('memory', terrace.Error, lambda: terrace.build(self.points, self.path('small'), memory=1000)),
                                 ('zooms', ValueError, lambda: self.raster.tiles(self.path('deep'), (0, 99), vertical='ignore')),
                                 ('channels', (ValueError, terrace.Error), lambda: terrace.build(
                                     self.points, self.path('small'), channels=[('none', 1.0)]))):
            with self.subTest(name), self.assertRaisesRegex(kind, f'`{name}`'):
                call()

    def test_store_may_be_closed_while_other_threads_query_it(self):
        failures = []
        for _ in range(10):
            store = terrace.Store.open(self.path('cloud'))

            def ask():
                try:
                    for _ in range(20):
                        if len(store.points()) != len(self.points):
                            failures.append('other points')
                except ValueError as error:
                    if 'closed' not in str(error):
                        failures.append(error)

            threads = [threading.Thread(target=ask) for _ in range(3)]
            for thread in threads:
                thread.start()
            time.sleep(0.01)
            store.close()
            for thread in threads:
                thread.join()
        self.assertEqual(failures, [])

    def test_threads_and_forks_share_a_store(self):
        expected = self.scan.query(near=(300500, 5200400), k=9)
        failures = []

        def ask():
            for _ in range(10):
                if not np.array_equal(self.scan.query(near=(300500, 5200400), k=9), expected):
                    failures.append('other points')

        threads = [threading.Thread(target=ask) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])
        child = os.fork()
        if child == 0:
            os._exit(0 if np.array_equal(self.scan.query(near=(300500, 5200400), k=9), expected) else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)


class Sources(StoreCase):
    """The same points and samples make the same store in every form."""

    def built(self, source, **options):
        self.count = getattr(self, 'count', 0) + 1
        return terrace.build(source, self.path(f'{self.id()}-{self.count}'), **options)

    def assert_same(self, source, reference, **options):
        self.assertEqual(self.built(source, **options).info['checksum'], reference.info['checksum'])

    def test_points(self):
        options = {'crs': 'EPSG:32632', 'block_points': 2000}
        kind = [('class', 'u1'), ('x', 'f8'), ('y', 'f8'), ('z', 'f8')]
        records = np.empty(len(self.points), kind)
        records['class'], (records['x'], records['y'], records['z']) = self.classes, self.points.T
        self.assert_same(records, self.scan, **options)
        columns = dict(zip('xyz', self.points.T), **{'class': self.classes})
        self.assert_same(columns, self.scan, **options)

        class Frame:  # like pandas.DataFrame, whose array form has all columns
            columns = ('class', 'x', 'y', 'z')

            def __getitem__(self, name):
                return records[name]

            def __array__(self, *_):
                return np.column_stack([self[name] for name in self.columns])
        self.assert_same(Frame(), self.scan, **options)
        for wrong in ({'attributes': {'more': self.classes}}, {'nodata': 0}, {'transform': TRANSFORM}):
            with self.assertRaisesRegex(ValueError, 'columns do not support'):
                self.built(columns, **wrong)
        wide = np.zeros((2 * len(self.points), 5))
        wide[::2, 1:4] = self.points
        more = {'class': self.classes}
        self.assert_same(wide[::2, 1:4], self.scan, attributes=more, **options)  # neither contiguous nor aligned
        self.assert_same(self.points[::-1][::-1], self.scan, attributes=more, **options)
        self.assert_same(np.asfortranarray(self.points), self.scan, attributes=more, **options)
        self.assert_same(self.points.astype('>f8'), self.scan, attributes=more, **options)
        self.assert_same(memoryview(self.points), self.scan, attributes=more, **options)
        self.assert_same(self.points.tolist(), self.scan, attributes=more, **options)

        class Interface:
            __array_interface__ = self.points.__array_interface__

        class Capsule:
            def __dlpack__(_, **how):
                return self.points.__dlpack__(**how)

            def __dlpack_device__(_):
                return self.points.__dlpack_device__()

        self.assert_same(Interface(), self.scan, attributes=more, **options)
        self.assert_same(Capsule(), self.scan, attributes=more, **options)

    def test_laspy_records(self):
        scales, offsets = np.array([0.01, 0.01, 0.001]), np.array([300000.0, 5200000.0, 0.0])
        raw = np.round((self.points - offsets) / scales).astype(np.int32)
        records = np.empty(len(raw), [('X', 'i4'), ('Y', 'i4'), ('Z', 'i4'), ('intensity', 'u2'), ('bits', 'u1'), ('rgb', 'u2', 3)])
        records['X'], records['Y'], records['Z'] = raw.T
        records['intensity'] = np.arange(len(raw)) % 1000
        records['bits'] = 0x20 | self.classes

        class Format:
            dimension_names = property(lambda _: iter(['X', 'Y', 'Z', 'intensity', 'classification', 'rgb']))

        class Points(dict):  # like laspy.ScaleAwarePointRecord, where bit fields have names
            def __init__(points, records):
                super().__init__({name: records[name] for name in records.dtype.names}, classification=records['bits'] & 31)
                points.scales, points.offsets, points.point_format = scales, offsets, Format()

        class Crs:
            to_wkt = lambda _: self.scan.info['crs']['wkt']  # noqa: E731

        class Data:  # like laspy.LasData
            points = Points(records)

            class header:
                parse_crs = Crs

        store = self.built(Data())
        got = store.points()
        np.testing.assert_allclose(sorted_rows(terrace.xyz(got)), sorted_rows(raw * scales + offsets), rtol=0, atol=1e-9)
        self.assertEqual(got.dtype.names[3:], ('intensity', 'classification', 'rgb_0', 'rgb_1', 'rgb_2'))
        self.assertEqual(got.dtype['intensity'], np.uint16)
        self.assertEqual(len(store.points(where='classification == 3')), (self.classes == 3).sum())
        self.assertEqual((store.info['format'], store.info['crs']['epsg']), ('array', 32632))
        with self.assertLogs('terrace', logging.INFO):  # points without a header
            self.assertEqual(len(self.built(Points(records[:100]))), 100)

    def test_rasters(self):
        options = {'transform': TRANSFORM, 'crs': 'EPSG:32632'}
        wide = np.full((121, 300), np.nan)
        wide[1:, ::2] = self.samples
        self.assert_same(wide[1:, ::2], self.raster, **options)
        self.assert_same(np.ma.masked_array(self.samples, np.zeros(self.samples.shape, bool)), self.raster, **options)

        class Affine:
            __array_interface__ = self.samples.__array_interface__
            transform, crs = TRANSFORM, 'EPSG:32632'

        self.assert_same(Affine(), self.raster)
        self.assert_same(terrace.Raster(self.samples, TRANSFORM, 'EPSG:32632'), self.raster)

        with_holes = self.samples.copy()
        with_holes[20:40, 30:60] = -9999
        store = self.built(with_holes, nodata=-9999, **options)
        self.assertEqual(len(store), self.samples.size - 600)
        self.assertEqual(store.info['nodata'], 600)
        masked = np.ma.masked_equal(with_holes, -9999)
        self.assertEqual(len(self.built(masked, **options)), self.samples.size - 600)

    def test_points_with_a_nan_coordinate_are_skipped_and_counted(self):
        points = self.points.copy()
        points[3, 0] = points[[3, 17, 4000], 1] = points[len(points) - 1, 2] = np.nan
        store = self.built(points, attributes={'number': np.arange(len(points))})
        self.assertEqual((len(store), store.info['nodata']), (len(points) - 4, 4))
        self.assertEqual(set(range(len(points))) - set(store.points()['number']), {3, 17, 4000, len(points) - 1})
        clusters = terrace.write_points(self.path('without.ply'), points)
        self.assertEqual((clusters['points'], clusters['nodata']), (len(points) - 4, 4))

    def test_masks_are_respected(self):
        points = np.ma.array(self.points[:100])
        points[3, 2] = np.ma.masked
        store = self.built(points)
        self.assertEqual((len(store), store.info['nodata']), (99, 1))
        numbers = np.ma.array(np.arange(100), mask=np.arange(100) == 7)
        with self.assertRaisesRegex(ValueError, 'masked'):
            self.built(self.points[:100], attributes={'number': numbers})

    def test_rejects_an_empty_list_of_sources(self):
        for nothing in ([], ()):
            with self.assertRaisesRegex(ValueError, 'no source'):
                self.built(nothing)

    def test_rejects_mixtures_of_files_and_arrays(self):
        for mixed in (['a.tif', 3], [self.points, 'a.tif'], ['a.tif', None]):
            with self.assertRaisesRegex(TypeError, 'source [01] is of type'):
                self.built(mixed)

    def test_rasters_of_other_packages(self):
        try:
            import rasterio
            import rioxarray
            from osgeo import gdal
        except ImportError as missing:
            self.skipTest(f'{missing.name} is missing')
        expected = self.built(ALPS)
        with rasterio.open(ALPS) as of_rasterio:
            of_xarray, of_gdal = rioxarray.open_rasterio(ALPS), gdal.Open(ALPS)
            for source in (of_rasterio, of_xarray, rioxarray.open_rasterio(ALPS, masked=True), of_gdal):
                with self.subTest(type(source).__module__):
                    store = self.built(source)
                    self.assertEqual((len(store), store.info['crs']['epsg']), (len(expected), 4326))
                    np.testing.assert_allclose(store.bounds, expected.bounds, rtol=1e-12)
        store = self.built(of_xarray, transform=TRANSFORM, crs='EPSG:32632', nodata=2000)  # arguments override the source
        self.assertEqual(store.info['crs']['epsg'], 32632)
        self.assertAlmostEqual(store.bounds[0], 500005, delta=10000)
        self.assertEqual(store.info['nodata'], int((of_xarray.values == 2000).sum()))

    def test_datasets_have_the_heights_of_their_file(self):
        """Includes files with a scale and offset, or with a mask instead of a nodata value."""
        try:
            import rasterio
            from osgeo import gdal
        except ImportError:
            self.skipTest('needs rasterio and gdal')
        file = self.path('heights.tif')
        values = np.arange(12, dtype=np.int16).reshape(3, 4)
        with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True), rasterio.open(
                file, 'w', driver='GTiff', width=4, height=3, count=1, dtype='int16',
                transform=rasterio.Affine(2, 0, 100, 0, -2, 200)) as dataset:
            dataset.scales, dataset.offsets = (0.5,), (100.0,)
            dataset.write(values, 1)
            dataset.write_mask(values % 5 != 0)
        expected = 100 + 0.5 * values[values % 5 != 0]
        gdal.UseExceptions()
        with rasterio.open(file) as of_rasterio:
            for i, source in enumerate((file, of_rasterio, gdal.Open(file))):
                with self.subTest(type(source)), terrace.build(source, self.path(f'{i}.terrace')) as store:
                    np.testing.assert_array_equal(np.sort(terrace.xyz(store.points())[:, 2]), expected)

    def test_xarray(self):
        try:
            import xarray
        except ImportError:
            self.skipTest('xarray is missing')
        centres = cell_centres(*self.samples.shape)
        array = xarray.DataArray(self.samples, dims=('y', 'x'),
                                 coords={'y': centres[:, 0, 1], 'x': centres[0, :, 0]})
        self.assert_same(array, self.raster, crs='EPSG:32632')
        grid = xarray.DataArray(0, attrs={'crs_wkt': self.raster.info['crs']['wkt'],
                                          'GeoTransform': '500000 10 0 5000000 0 -10'})
        described = xarray.DataArray(self.samples, dims=('y', 'x'), coords={'spatial_ref': grid})
        self.assertEqual(self.built(described).bounds, self.raster.bounds)

    def test_sample_types(self):
        for kind in ('i1', 'u1', 'i2', 'u2', 'i4', 'u4', 'i8', 'u8', 'f2', 'f4', 'f8', '>i2', '>f4', '?'):
            with self.subTest(kind):
                samples = (np.arange(48 * 41).reshape(48, 41) % 100).astype(kind)
                store = self.built(samples, transform=TRANSFORM)
                got = terrace.xyz(store.points())
                expected = np.column_stack((cell_centres(48, 41).reshape(-1, 2), samples.ravel().astype(float)))
                np.testing.assert_array_equal(sorted_rows(got), sorted_rows(expected))

    def test_rejects_invalid_sources(self):
        for wrong, kind in ((np.zeros((4, 3), complex), TypeError), (np.zeros((2, 2, 2)), ValueError),
                            (np.zeros(5), ValueError), (np.zeros((0, 3)), ValueError), (object(), TypeError),
                            (np.array([['a', 'b', 'c']]), TypeError), ({'x': [1.0], 'y': [2.0]}, ValueError),
                            ({'x': [1.0], 'y': [2.0], 'z': [3.0, 4.0]}, ValueError), ([], ValueError),
                            (np.zeros(3, [('a', 'f8')]), ValueError), (np.zeros((0, 7)), ValueError)):
            with self.subTest(repr(wrong)):
                with self.assertRaises(kind):
                    self.built(wrong)
        with self.assertRaisesRegex(terrace.Error, 'point 17: its y is infinite'):
            points = self.points.copy()
            points[17, 1] = -np.inf
            self.built(points)
        with self.assertRaisesRegex(terrace.Error, 'has no point with data'):
            self.built(np.full((5, 5), np.nan))
        with self.assertRaises(ValueError):
            self.built(hills(), transform=(1, 2, 3))
        with self.assertRaises(ValueError):
            self.built(hills(), transform=(0, 0, 0, 0, 0, 0))
        self.assertEqual([name for name in os.listdir(self.folder) if 'cannot' in name], [])

    def test_files(self):
        store = terrace.build(ALPS, self.path('alps'))
        self.assertGreater(len(store), 10 ** 6)
        self.assertEqual(store.info['format'], 'geotiff')
        text = self.path('points.xyz')
        np.savetxt(text, cloud(500)[0])
        self.assertEqual(len(terrace.build([text], self.path('text'))), 500)


    def test_medians_are_the_top_level(self):
        with self.built(self.points, k=6) as store:
            self.assertEqual(len(store.points(level=store.top)), 6)
        with self.built(self.points, method='facilities', batch=4, search_threads=2) as store:
            self.assertEqual(len(store.points()), len(self.points))
        for options, named in (({'k': 6, 'facility_cost': 1.0}, '`facility_cost`'), ({'k': 20000}, '`k` is at most 10,000'),
                               ({'k': 6, 'outlier_price': 1.0}, 'either `k` or `outlier_price`'),
                               ({'search_threads': 2}, '`batch` and `search_threads` are for local searches: choose one by `method`')):
            with self.assertRaisesRegex(ValueError, named):
                self.built(self.points, **options)


class Paths(StoreCase):
    def test_empty_paths_raise_os_errors(self):
        with self.assertRaises((OSError, ValueError, terrace.Error)):
            terrace.build(self.points, '')
        here = os.getcwd()
        os.chdir(self.folder)
        try:
            with self.assertRaises((OSError, ValueError, terrace.Error)):
                terrace.build('cloud', '')
        finally:
            os.chdir(here)

    def test_file_names_need_not_be_utf_8(self):
        name = os.fsdecode(b'h\xf6he')
        path = self.path(name)
        with terrace.build(self.points, path) as store:
            self.assertEqual(store.info['path'], path)
            self.assertEqual(len(store), len(self.points))
            repr(store)
        with terrace.Store.open(path) as store:
            self.assertEqual(len(store), len(self.points))
        terrace.write_points(path + '.csv', self.points)
        self.assertEqual(len(terrace.read_points(path + '.csv')), len(self.points))
        mesh = self.raster.bounded_mesh(4, path=path + '.ply')
        mesh.save(path + '.obj')
        self.assertEqual(len(terrace.Mesh.read(path + '.obj').triangles), len(mesh.triangles))
        self.assertEqual(self.raster.raster(path=path + '.tif').shape, self.samples.shape)
        tiles = self.raster.tiles(path + '-tiles', (0, 8), vertical='ignore')
        self.assertEqual(terrace.verify_tiles(path + '-tiles', self.raster, vertical='ignore')['tiles'], tiles['tiles'])
        for missing in (terrace.Store.open, terrace.read_points, terrace.Mesh.read):
            with self.assertRaises(FileNotFoundError) as raised:
                missing(path + '-none')
            self.assertIn(name, raised.exception.filename or raised.exception.strerror)


class Lines(StoreCase):
    def test_returns_every_line(self):
        random = np.random.default_rng(21)
        given = [np.round(random.random((random.integers(2, 9), 3)).cumsum(axis=0) * 100, 2) for _ in range(60)]
        with open(self.path('lines.geojson'), 'w', encoding='ascii') as file:
            json.dump({'type': 'FeatureCollection', 'crs': None, 'features': [
                {'type': 'Feature', 'properties': {'lanes': number} if number % 3 else {},
                 'geometry': {'type': 'LineString', 'coordinates': line.tolist()}}
                for number, line in enumerate(given)]}, file)
        store = terrace.build(self.path('lines.geojson'), self.path('lines'), entities='segments', block_points=60)
        lines, numbers = store.lines()
        np.testing.assert_array_equal(numbers, np.arange(60))
        for line, expected in zip(lines, given):
            np.testing.assert_array_equal(line, expected)
        expected = [number if number % 3 else np.nan for number in range(60)]
        np.testing.assert_array_equal(store.lines(properties=True)[2]['lanes'], expected)
        self.assertEqual(store.points(where='lanes == 4')['line'].tolist(), [4] * (len(given[4]) - 1))
        half = np.median([line[0, 0] for line in given])
        pieces = [tuple(map(tuple, piece)) for line in store.lines(region=(-1, -1, half, 1e9))[0] for piece in zip(line, line[1:])]
        expected = [tuple(map(tuple, piece)) for line in given for piece in zip(line, line[1:]) if piece[0][0] <= half]
        self.assertEqual(sorted(pieces), sorted(expected))
        self.assertGreater(store.top, 0)
        self.assertLess(sum(map(len, store.lines(level=1)[0])), sum(map(len, given)))
        with self.assertRaises(ValueError):
            self.scan.lines()


if __name__ == '__main__':
    unittest.main()
