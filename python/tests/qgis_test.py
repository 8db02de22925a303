# SPDX-License-Identifier: Apache-2.0
"""QGIS runs the provider's algorithms without a display."""

import os
import sys
import unittest

import numpy as np

from python_case import ALPS, ROOT, StoreCase

os.environ.setdefault('QT_QPA_PLATFORM', 'offscreen')
try:
    from qgis.core import (QgsApplication, QgsMeshLayer, QgsProcessingContext, QgsProcessingException, QgsProcessingFeedback,
                           QgsVectorLayer)
except ImportError:
    raise unittest.SkipTest('QGIS is missing (python3-qgis, qgis-providers)') from None

sys.path.insert(0, os.path.join(ROOT, 'python', 'qgis'))


class Qgis(StoreCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.application = QgsApplication([], False)
        cls.application.initQgis()
        cls.addClassCleanup(cls.application.exitQgis)
        import terrace_processing
        cls.plugin = terrace_processing.classFactory(None)
        cls.plugin.initGui()
        cls.addClassCleanup(cls.plugin.unload)

    def run_algorithm(self, name, feedback=None, **parameters):
        algorithm = QgsApplication.processingRegistry().createAlgorithmById('terrace:' + name)
        context = QgsProcessingContext()
        right, why = algorithm.checkParameterValues(parameters, context)
        self.assertTrue(right, why)
        return algorithm.run(parameters, context, feedback or QgsProcessingFeedback(), {}, False)

    def test_builds_a_store_from_a_raster(self):
        results, done = self.run_algorithm('build', INPUT=[ALPS], OUTPUT=self.path('alps'))
        self.assertTrue(done)
        self.assertEqual(results['POINTS'], 1338658)

    def test_qgis_reads_the_mesh(self):
        path = self.path('hills.ply')
        _, done = self.run_algorithm('bounded_mesh', STORE=self.path('hills'), MAX_ERROR=2.0, OUTPUT=path)
        self.assertTrue(done)
        layer = QgsMeshLayer(path, 'hills', 'mdal')
        self.assertTrue(layer.isValid())
        self.assertEqual(layer.dataProvider().faceCount(), len(self.raster.bounded_mesh(2.0).triangles))

    def test_qgis_reads_the_contours(self):
        x0, y0, _, x1, y1, _ = self.raster.bounds
        for extent, region in ((None, None), (f'{x0},{(x0 + x1) / 2},{y0},{y1} [EPSG:32632]', (x0, y0, (x0 + x1) / 2, y1))):
            path = self.path(f'contours-{region is None}.gpkg')
            _, done = self.run_algorithm('contours', STORE=self.path('hills'), INTERVAL=20.0, EXTENT=extent, OUTPUT=path)
            self.assertTrue(done)
            layer = QgsVectorLayer(path, 'contours', 'ogr')
            self.assertEqual(layer.crs().authid(), 'EPSG:32632')
            ours = self.raster.contours(20, region=region, lonlat=False)['features']
            self.assertEqual(sorted(feature['elev'] for feature in layer.getFeatures()),
                             sorted(line['properties']['elev'] for line in ours))
            box = layer.extent()
            corners = np.concatenate([line['geometry']['coordinates'] for line in ours])
            np.testing.assert_allclose([box.xMinimum(), box.yMinimum(), box.xMaximum(), box.yMaximum()],
                                       [*corners.min(axis=0), *corners.max(axis=0)], rtol=0, atol=1e-5)

    def test_writes_tiles(self):
        _, done = self.run_algorithm('tiles', STORE=self.path('hills'), ZOOM=9, VERTICAL=3, OUTPUT=self.path('tiles'))
        self.assertTrue(done)
        self.assertTrue(os.path.exists(self.path('tiles/layer.json')))

    def test_reports_errors_and_cancels_jobs(self):
        with self.assertRaisesRegex(QgsProcessingException, 'there is no store here'):
            self.run_algorithm('tiles', STORE=self.path('nowhere'), OUTPUT=self.path('none'))
        feedback = QgsProcessingFeedback()
        feedback.cancel()
        self.run_algorithm('build', feedback, INPUT=[ALPS], OUTPUT=self.path('cancelled'))
        self.assertFalse(os.path.exists(self.path('cancelled')))


if __name__ == '__main__':
    unittest.main()
