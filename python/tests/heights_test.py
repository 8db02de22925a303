# SPDX-License-Identifier: Apache-2.0
"""Heights, gradients, rasters, profiles and contours match SciPy, known properties and the sampled function."""

import logging
import math
import os
import tempfile
import unittest

import numpy as np

import terrace
from python_case import TRANSFORM, StoreCase, cell_centres

try:
    from scipy.interpolate import LinearNDInterpolator, RegularGridInterpolator
    from scipy.spatial import Delaunay, cKDTree
except ImportError:
    LinearNDInterpolator = None


def places(count, seed=3):
    random = np.random.default_rng(seed)
    return random.random((count, 2)) * [1400, 1100] + [500050, 4998850]


class Heights(StoreCase):
    def test_samples_keep_their_heights(self):
        centres = cell_centres(*self.samples.shape).reshape(-1, 2)
        for method in ('linear', 'natural', 'nearest'):
            np.testing.assert_allclose(self.raster.heights(centres, method), self.samples.ravel(), rtol=0, atol=1e-9)
        np.testing.assert_array_equal(self.scan.heights(self.points[:500, :2]), self.points[:500, 2])

    @unittest.skipIf(LinearNDInterpolator is None, 'SciPy is missing')
    def test_linear_heights_of_points_match_scipy(self):
        random = np.random.default_rng(7)
        xy = random.random((5000, 2)) * [1100, 900] + [299950, 5199950]
        origin = self.points[:, :2].min(axis=0)  # SciPy loses digits far from the origin
        expected = LinearNDInterpolator(Delaunay(self.points[:, :2] - origin), self.points[:, 2])(xy - origin)
        got = self.scan.heights(xy)
        both = ~np.isnan(expected) & ~np.isnan(got)
        self.assertGreater(both.sum(), 4000)
        self.assertLess((np.isnan(expected) != np.isnan(got)).sum(), 5)  # places on the border of the hull
        np.testing.assert_allclose(got[both], expected[both], rtol=0, atol=1e-7)

    @unittest.skipIf(LinearNDInterpolator is None, 'SciPy is missing')
    def test_nearest_heights_match_scipy(self):
        xy = places(500) + [-199700, 201700]
        origin = self.points[:, :2].min(axis=0)
        _, order = cKDTree(self.points[:, :2] - origin).query(xy - origin)
        np.testing.assert_array_equal(self.scan.heights(xy, 'nearest'), self.points[order, 2])

    def test_gradient_of_a_plane(self):
        rows, columns = 60, 70
        centres = cell_centres(rows, columns)
        plane = 0.25 * (centres[..., 0] - 500000) - 0.5 * (centres[..., 1] - 5000000)
        store = terrace.build(plane, self.path('plane'), transform=TRANSFORM)
        xy = places(200)[:, :] * 0 + np.random.default_rng(1).random((200, 2)) * [500, -400] + [500100, 4999900]
        np.testing.assert_allclose(store.gradients(xy), np.tile([0.25, -0.5], (200, 1)), rtol=0, atol=1e-9)
        expected = 0.25 * (xy[:, 0] - 500000) - 0.5 * (xy[:, 1] - 5000000)
        np.testing.assert_allclose(store.heights(xy), expected, rtol=0, atol=1e-9)

    def test_heights_outside_the_surface_are_nan(self):
        outside = [[0, 0], [math.nan, 5000000], [math.inf, 0]]
        for store in (self.raster, self.scan):
            self.assertTrue(np.isnan(store.heights(outside)).all())
            self.assertTrue(np.isnan(store.gradients(outside)).all())
            self.assertEqual(store.heights([]).shape, (0,))

    def test_places_in_another_reference_system(self):
        here = places(50)
        there = self.raster.points(crs='EPSG:4326')
        lonlat = np.column_stack((there['x'], there['y']))[:200]
        np.testing.assert_allclose(self.raster.heights(lonlat, crs='EPSG:4326'), there['z'][:200], rtol=0, atol=1e-4)
        self.assertFalse(np.isnan(self.raster.heights(here)).any())

    def test_latitudes_beyond_a_pole_are_rejected(self):
        for method in self.raster.heights, self.raster.gradients:
            with self.assertRaisesRegex(terrace.Error, 'the latitude 95 is beyond a pole'):
                method([[9, 45], [9, 95]], crs='EPSG:4326')

    def test_masked_places_have_no_height(self):
        xy = np.ma.array(places(5))
        xy[2, 0] = np.ma.masked
        got = self.raster.heights(xy)
        np.testing.assert_array_equal(np.isnan(got), [False, False, True, False, False])
        np.testing.assert_array_equal(got[[0, 1, 3, 4]], self.raster.heights(places(5)[[0, 1, 3, 4]]))

    def test_both_longitudes_beyond_the_antimeridian(self):
        samples = np.arange(400.0).reshape(20, 20)
        with tempfile.TemporaryDirectory() as folder:
            with terrace.build(samples, folder + '/fiji', transform=(0.1, 0, 179, 0, -0.1, 0), crs='EPSG:4326') as fiji:
                np.testing.assert_allclose(fiji.heights([[-179.95, -0.05], [180.05, -0.05]]), 10, atol=1e-9)
                east = fiji.points(region=(-180, -1, -179.5, 0))
                self.assertEqual(len(east), 50)
                self.assertEqual(len(fiji.points(region=(180, -1, 180.5, 0))), 50)
                everywhere = np.inf
                for box, expected in (((-179.99, -1.09, -179.51, 0.01), 55), ((180.01, -1.09, 180.49, 0.01), 55),
                                 ((-180, -90, 180, 90), 400), ((0, -1.09, 360, 0.01), 220), ((-540, -90, 540, 90), 400),
                                 ((0, -90, 90, 90), 0), ((-everywhere, -everywhere, everywhere, everywhere), 400),
                                 ((-180, -everywhere, -179.51, everywhere), 100), ((180, -90, everywhere, 90), 200)):  # taken literally
                    self.assertEqual(fiji.count(box), expected, box)
                    self.assertEqual(len(fiji.points(region=box)), expected, box)

    def test_results_do_not_depend_on_threads_and_memory(self):
        xy = places(2000)
        expected = self.raster.heights(xy)
        for threads in (1, 3):
            np.testing.assert_array_equal(self.raster.heights(xy, threads=threads, memory=1 << 26), expected)

    def test_rejects_invalid_places(self):
        for wrong, kind in (([1, 2, 3], ValueError), ([[1, 2, 3]], ValueError), (['a'], TypeError),
                            (np.zeros((2, 2), complex), TypeError), ([[1, [2]]], ValueError)):
            with self.assertRaises(kind):
                self.raster.heights(wrong)
        with self.assertRaisesRegex(ValueError, 'linear, natural, nearest'):
            self.raster.heights([[0, 0]], 'cubic')
        with self.assertRaisesRegex(ValueError, 'max_edge'):
            self.raster.heights([[0, 0]], max_edge=3.0)

    def test_a_focus_has_the_heights_of_its_level(self):
        for store, middle in ((self.raster, (500700, 4999400)), (self.scan, (300500, 5200400))):
            (x, y) = middle
            box = (x - 200, y - 200, x + 200, y + 200)
            inside = np.random.default_rng(2).random((500, 2)) * 240 + [x - 120, y - 120]
            fine = store.heights(inside)
            self.assertFalse(np.isnan(fine).all())
            np.testing.assert_array_equal(store.heights(inside, focus=[(box, 0)]), fine)
            np.testing.assert_array_equal(store.gradients(inside, level=store.top, focus=[(box, 0)]), store.gradients(inside))
            self.assertFalse(np.array_equal(store.heights(inside, level=store.top), fine, equal_nan=True))
            # The surface is the mesh.
            mesh = store.mesh(level=store.top, focus=[(box, 0)])
            np.testing.assert_allclose(store.heights(mesh.vertices[:, :2], focus=[(box, 0)]), mesh.vertices[:, 2], rtol=0, atol=1e-6)

    def test_a_bound_holds_at_every_sample(self):
        for store in self.raster, self.scan:
            records = store.points()
            points = np.column_stack([records[axis] for axis in 'xyz'])
            exact = store.heights(points[:, :2])
            few = store.heights(points[:, :2], max_error=3)
            self.assertEqual(np.isnan(few).tolist(), np.isnan(exact).tolist())
            self.assertLessEqual(np.nanmax(np.abs(few - exact)), 3 + 1e-6)
            np.testing.assert_allclose(store.heights(points[:, :2], max_error=0), exact, rtol=0, atol=1e-6)
            np.testing.assert_array_equal(store.heights(points[5:9, :2], max_error=3), few[5:9])
            self.assertEqual(store.gradients(points[:9, :2], max_error=3).shape, (9, 2))
        line = [[500040, 4999100], [501300, 4999900]]
        for count in (lambda **options: len(self.raster.profile(line, **options)),
                      lambda **options: sum(len(f['geometry']['coordinates']) for f in self.raster.contours(5, **options)['features'])):
            self.assertLess(count(max_error=3), count())
        difference = np.abs(self.raster.raster(max_error=3).values - self.raster.raster().values)
        self.assertLessEqual(np.nanmax(difference), 3 + 1e-3)
        for wrong in ({'level': 1}, {'max_edge': 9}, {'method': 'natural'}, {'max_error': -1}):
            with self.assertRaises(ValueError):
                self.raster.heights(points[:3, :2], **{'max_error': 3, **wrong})

    def test_rasters_profiles_and_contours_take_a_focus(self):
        box = (500500, 4999200, 500900, 4999600)
        focus = [(box, 0)]
        mixed, fine = self.raster.raster(focus=focus), self.raster.raster()
        self.assertEqual(mixed.values.shape, fine.values.shape)
        here = cell_centres(*fine.values.shape)
        margin = 2.5 * TRANSFORM[0]
        inside = np.all((here > np.array(box[:2]) + margin) & (here < np.array(box[2:]) - margin), axis=-1)
        self.assertGreater(inside.sum(), 10)
        np.testing.assert_array_equal(mixed.values[inside], fine.values[inside])
        self.assertFalse(np.array_equal(mixed.values, fine.values))
        line = [(500100, 4999000), (501300, 4999800)]
        top = self.raster.top
        rows = [len(self.raster.profile(line, **options)) for options in ({'level': top}, {'focus': focus}, {})]
        self.assertTrue(rows[0] < rows[1] < rows[2], rows)
        counts = [sum(len(f['geometry']['coordinates']) for f in self.raster.contours(10, **options)['features'])
                  for options in ({'level': top}, {'focus': focus}, {})]
        self.assertTrue(counts[0] < counts[1] < counts[2], counts)
        for call in (lambda f: self.raster.heights([[0, 0]], focus=f), lambda f: self.raster.raster(focus=f),
                     lambda f: self.raster.profile(line, focus=f), lambda f: self.raster.contours(10, focus=f)):
            with self.assertRaisesRegex(ValueError, 'no level 99'):
                call([(box, 99)])


class Rasters(StoreCase):
    def test_raster_keeps_its_grid(self):
        got = self.raster.raster()
        np.testing.assert_array_equal(got.values, self.samples.astype(got.values.dtype))
        np.testing.assert_allclose(got.transform, TRANSFORM, rtol=0, atol=1e-6)
        self.assertEqual(got.crs, 'EPSG:32632')
        self.assertEqual(np.asarray(got).shape, self.samples.shape)
        self.assertTrue(got._repr_png_().startswith(b'\x89PNG'))
        # A store can be built from it.
        again = terrace.build(got.values, self.path('again'), transform=got.transform, crs=got.crs)
        np.testing.assert_allclose(again.bounds, self.raster.bounds, rtol=1e-7)

    def test_grids_of_points(self):
        path = self.path('scan.tif')
        got = self.scan.raster(cell=25, region=(300200, 5200200, 300700, 5200600), path=path)
        self.assertTrue(os.path.exists(path))
        self.assertEqual(got.shape, (16, 20))
        a, b, c, d, e, f = got.transform
        x, y = np.meshgrid(c + a * (np.arange(20) + 0.5), f + e * (np.arange(16) + 0.5))
        heights = self.scan.heights(np.column_stack((x.ravel(), y.ravel())))
        np.testing.assert_allclose(got.values.ravel(), heights, rtol=1e-6)
        with self.assertRaises(FileExistsError):
            self.scan.raster(cell=25, path=path)
        self.scan.raster(cell=25, path=path, replace=True)
        # Rasters of equal cells align; `align` aligns others.
        part = self.scan.raster(cell=25, region=(300110, 5200110, 300290, 5200190))
        np.testing.assert_array_equal(np.array(part.transform)[[2, 5]], (300100, 5200200))
        same = self.scan.raster(align=path)
        self.assertEqual((same.transform, same.shape), (self.scan.raster(cell=25).transform, self.scan.raster(cell=25).shape))
        shade = self.scan.raster('hillshade', cell=25)
        self.assertEqual(shade.values.dtype, np.uint8)
        with self.assertRaises(ValueError):
            self.scan.raster(cell=-1)


class Lines(StoreCase):
    def test_profile(self):
        line = [[500050, 4999500], [501400, 4999100]]
        got = self.raster.profile(line, step=25)
        self.assertEqual(got.shape[1], 4)
        np.testing.assert_allclose(np.diff(got[:-1, 0]), 25, rtol=0, atol=1e-6)
        self.assertAlmostEqual(got[-1, 0], math.hypot(1350, 400), delta=1.0)
        np.testing.assert_allclose(self.raster.heights(got[:, 1:3]), got[:, 3], rtol=0, atol=1e-6)
        exact = self.raster.profile(line)
        middle = (exact[1:, 1:] + exact[:-1, 1:]) / 2  # straight between the rows
        np.testing.assert_allclose(self.raster.heights(middle[:, :2]), middle[:, 2], rtol=0, atol=1e-6)
        with self.assertRaises(ValueError):
            self.raster.profile([[0, 0]])
        for wrong in ({'step': 0}, {'step': -1}, {'step': np.nan}):
            with self.assertRaises(ValueError):
                self.raster.profile(line, **wrong)
        for far in (1e300, np.inf, np.nan):
            with self.assertRaises(ValueError):
                self.raster.profile([[0, 0], [far, 5]])

    def test_contours_are_at_their_height(self):
        lines = self.raster.contours(20)
        self.assertEqual(lines.__geo_interface__['type'], 'FeatureCollection')
        self.assertLess(len(lines._repr_png_()), 400_000)
        self.assertGreater(len(lines['features']), 5)
        for feature in lines['features']:
            elev = feature['properties']['elev']
            self.assertEqual(elev % 20, 0)
            heights = self.raster.heights(feature['geometry']['coordinates'], crs='EPSG:4326')
            # On the border rounding may move places outside.
            np.testing.assert_allclose(heights[~np.isnan(heights)], elev, rtol=0, atol=1e-3)

    def test_contours_in_the_stores_own_coordinates(self):
        def heights_on(store, lines):
            for line in lines['features']:
                heights = store.heights(line['geometry']['coordinates'])
                np.testing.assert_allclose(heights[~np.isnan(heights)], line['properties']['elev'], rtol=0, atol=1e-4)

        known = self.raster.contours(20, lonlat=False)
        heights_on(self.raster, known)
        unknown = terrace.build(self.samples, self.path('no-crs'), transform=TRANSFORM)
        with self.assertLogs('terrace', logging.INFO):
            self.assertEqual(unknown.contours(20)['features'], known['features'])  # GeoJSON without a CRS
        with self.assertRaisesRegex(terrace.Error, 'no CRS'):
            unknown.contours(20, lonlat=True)
        # A datum without an operation to WGS 84.
        datum = ('PROJCS["site",GEOGCS["site",DATUM["site",SPHEROID["ball",6370000,0]],PRIMEM["Greenwich",0],'
                 'UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["central_meridian",9],'
                 'PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],UNIT["metre",1]]')
        apart = terrace.build(self.samples, self.path('apart'), transform=TRANSFORM, crs=datum)
        self.assertEqual(len(apart.contours(20)['features']), len(known['features']))

    def test_shapely_reads_contours(self):
        try:
            from shapely.geometry import shape
        except ImportError:
            self.skipTest('shapely is missing')
        lines = self.scan.contours(10, region=(300200, 5200200, 300800, 5200600))
        for feature in lines['features']:
            self.assertTrue(shape(feature['geometry']).is_valid)
        area = shape(self.scan)
        self.assertAlmostEqual(area.area, 1000 * 800, delta=1000)
        mesh = shape(self.scan.bounded_mesh(5))
        self.assertAlmostEqual(sum(triangle.area for triangle in mesh.geoms), area.area, delta=1000)

    def test_points_in_polygons_match_shapely(self):
        try:
            from hypothesis import given, settings, strategies as st
            from shapely.geometry import MultiPoint, Polygon
        except ImportError as missing:
            self.skipTest(f'{missing.name} is missing')
        few = self.points[:2000]
        store = terrace.build(few, self.path('few'), crs='EPSG:32632', block_points=200)
        points = MultiPoint(few[:, :2])

        @settings(max_examples=50, deadline=None, derandomize=True)
        @given(st.lists(st.floats(50, 600), min_size=3, max_size=30), st.floats(0.1, 0.9), st.floats(0, 1000), st.floats(0, 800))
        def check(radii, inner, x, y):
            angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
            ring = np.asarray(radii)[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
            middle = few[:, :2].min(axis=0) + (x, y)
            star = Polygon(ring + middle, [ring * inner + middle])
            inside = points.intersection(star)
            self.assertEqual(len(store.points(region=star)), len(getattr(inside, 'geoms', () if inside.is_empty else (inside,))))

        check()


if __name__ == '__main__':
    unittest.main()
