# SPDX-License-Identifier: Apache-2.0
"""Conversions between reference systems, compared with PROJ as called by GDAL."""

import unittest

import numpy as np

import terrace

try:
    from osgeo import osr
except ImportError:
    osr = None


class Transformations(unittest.TestCase):
    @unittest.skipIf(osr is None, 'GDAL for Python is missing')
    def test_coordinates_match_proj(self):
        random = np.random.default_rng(1)
        lonlat = random.random((2000, 2)) * [6, 8] + [6, 44]
        for code in (32632, 3035, 3857, 2056, 25832, 5514):
            result = terrace.Transformation('EPSG:4326', f'EPSG:{code}', area=(6, 44, 12, 52))
            from_, to = osr.SpatialReference(), osr.SpatialReference()
            from_.ImportFromEPSG(4326)
            to.ImportFromEPSG(code)
            for system in (from_, to):
                system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
            expected = np.array(osr.CoordinateTransformation(from_, to).TransformPoints(lonlat.tolist()))[:, :2]
            got = result.forward(lonlat)
            # Operations between datums may differ by their accuracy.
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-3 if code in (32632, 3035, 3857, 25832) else 3)
            np.testing.assert_allclose(result.reverse(got), lonlat, rtol=0, atol=5e-8)

    def test_heights_are_kept_and_places_out_of_range_are_nan(self):
        result = terrace.Transformation('EPSG:4326', 3857)
        got = result.forward([[10, 50, 7.5], [10, 90, 1], [np.nan, 0, 2]])
        self.assertEqual(got[:, 2].tolist(), [7.5, 1, 2])
        self.assertFalse(np.isnan(got[0]).any())
        self.assertTrue(np.isnan(got[2, :2]).all())
        self.assertEqual(result.forward([]).shape, (0, 2))
        np.testing.assert_array_equal(terrace.Transformation(4326, 4326).forward([[1, 2]]), [[1, 2]])
        self.assertIn('WGS 84', repr(result))

    def test_datum_shift_to_wgs84(self):
        class Wkt:
            def to_wkt(self):
                return ('GEOGCS["none",DATUM["none",SPHEROID["Bessel 1841",6377397.155,299.1528128]],PRIMEM["Greenwich",0],'
                        'UNIT["degree",0.0174532925199433]]')

        shift = (598.1, 73.7, 418.2, 0.202, 0.045, -2.455, 6.7)  # of DHDN
        near = terrace.Transformation(Wkt(), 'EPSG:4326', datum_shift=shift).forward([[10, 50]])
        dhdn = terrace.Transformation('EPSG:4314', 'EPSG:4326', area=(9, 49, 11, 51)).forward([[10, 50]])
        np.testing.assert_allclose(near, dhdn, rtol=0, atol=5e-5)
        self.assertGreater(np.abs(near - [10, 50]).max(), 3e-4)
        with self.assertRaises(terrace.Error):
            terrace.Transformation(Wkt(), 'EPSG:4326')

    def test_rejects_invalid_arguments(self):
        for wrong, kind in ((('EPSG:1', 'EPSG:4326'), ValueError), (('', 'EPSG:4326'), ValueError), ((None, 'EPSG:4326'), ValueError),
                            ((3.5, 'EPSG:4326'), TypeError)):
            with self.assertRaises(kind):
                terrace.Transformation(*wrong)
        for options in ({'area': (1, 1, 0, 0)}, {'datum_shift': (1, 2)}, {'area': (0, 0)}):
            with self.assertRaises(ValueError):
                terrace.Transformation('EPSG:4326', 'EPSG:3857', **options)
        result = terrace.Transformation('EPSG:4326', 'EPSG:3857')
        for wrong, kind in (([[1, 2, 3, 4]], ValueError), ([1, 2], ValueError), ('ab', TypeError)):
            with self.assertRaises(kind):
                result.forward(wrong)


if __name__ == '__main__':
    unittest.main()
