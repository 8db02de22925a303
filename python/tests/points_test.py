# SPDX-License-Identifier: Apache-2.0
"""Reading and writing points without a store."""

import os
import unittest

import numpy as np

import terrace
from python_case import ALPS, StoreCase


class Points(StoreCase):
    def records(self, count=5000):
        result = np.zeros(count, [('x', 'f8'), ('y', 'f8'), ('z', 'f8'), ('intensity', 'u2'), ('classification', 'u1')])
        places = np.round(self.points[:count], 2)
        for i, axis in enumerate('xyz'):
            result[axis] = places[:, i]
        result['intensity'], result['classification'] = np.arange(count) % 4000, np.arange(count) % 5
        return result

    def test_written_points_are_read_back(self):
        records = self.records()
        for ending in ('ply', 'csv', 'xyz', 'las', 'laz', 'copc.laz'):
            path = self.path('points.' + ending)
            written = terrace.write_points(path, records, crs='EPSG:32632')
            self.assertEqual(written['points'], len(records))
            self.assertLess(written['rounding'], 1e-9)
            back = terrace.read_points(path)
            if ending == 'copc.laz':
                back, records = np.sort(back, order=['x', 'y', 'z']), np.sort(records, order=['x', 'y', 'z'])
            np.testing.assert_allclose(terrace.xyz(back), terrace.xyz(records), rtol=0, atol=1e-9)
            if ending != 'xyz':
                for name in ('intensity', 'classification'):
                    np.testing.assert_array_equal(back[name], records[name])
            with self.assertRaises((FileExistsError, terrace.Error)):
                terrace.write_points(path, records)
            terrace.write_points(path, records[:10], replace=True)
            self.assertEqual(len(terrace.read_points(path)), 10)
        self.assertEqual(terrace.point_batches(self.path('points.laz')).crs['epsg'], 0)  # these points have no CRS
        terrace.write_points(self.path('points.laz'), records, crs='EPSG:32632', replace=True)
        self.assertEqual(terrace.build(self.path('points.laz'), self.path('of-laz')).info['crs']['epsg'], 32632)

    def test_notes_undeclared_voids_and_lost_units(self):
        path = self.path('voids.csv')
        with open(path, 'w', encoding='ascii') as file:
            file.write('x,y,z (ft)\n1,2,3\n2,3,-9999\n')
        with self.assertLogs('terrace') as notes:
            self.assertEqual(len(terrace.read_points(path)), 2)
        self.assertIn('1 point has the height -9999', notes.output[0])
        with self.assertLogs('terrace') as notes:
            terrace.write_points(self.path('voids.ply'), path)
        self.assertIn('heights are in feet', notes.output[0])
        self.assertIn('1 point has the height -9999', notes.output[1])
        terrace.write_points(self.path('voids.las'), path)
        self.assertEqual(terrace.point_batches(self.path('voids.las')).crs['vertical_unit'], 'foot')

    def test_reads_a_part(self):
        path = self.path('part.laz')
        records = self.records()
        terrace.write_points(path, records)
        wanted = records[(records['classification'] == 2) & (records['x'] <= 300500)]
        got = terrace.read_points(path, where='classification == 2', region=(0, 0, 300500, 1e7), keep=['intensity'])
        self.assertEqual(got.dtype.names, ('x', 'y', 'z', 'intensity'))
        np.testing.assert_array_equal(got['intensity'], wanted['intensity'])
        written = terrace.write_points(self.path('part.ply'), path, where='classification == 2', region=(0, 0, 300500, 1e7))
        self.assertEqual(written['points'], len(wanted))

    def test_longitudes_of_regions_may_be_whole_turns_away(self):
        samples, transform = np.arange(400, dtype=np.int16).reshape(20, 20), (1 / 1200, 0, 8.3, 0, -1 / 1200, 46.5)
        given = {'transform': transform, 'crs': 'EPSG:4326'}
        whole = terrace.build(samples, self.path('degrees'), **given)
        for turn in (0, -360, 360):
            box = (8.3 + 2.5 / 1200 + turn, 46.5 - 9.5 / 1200, 8.3 + 9.5 / 1200 + turn, 46.5 - 2.5 / 1200)
            for polygon in (False, True):
                region = box
                if polygon:  # slightly wider, because polygons are not rounded
                    west, south, east, north = (side + off for side, off in zip(box, (-1e-9, -1e-9, 1e-9, 1e-9)))
                    region = {'type': 'Polygon', 'coordinates': [[(west, south), (east, south), (east, north), (west, north)]]}
                self.assertEqual(len(whole.points(region=region)), 64)
                self.assertEqual(len(terrace.read_points(samples, region=region, **given)), 64)
                self.assertEqual(len(terrace.build(samples, self.path('part'), region=region, replace=True, **given)), 64)
        inf = float('inf')
        self.assertEqual(len(whole.points(region=(-inf, -inf, 8.3 + 9.5 / 1200, inf))), 200)

    def test_batches_have_a_constant_size(self):
        reader = terrace.point_batches(ALPS, block_points=3000)
        self.assertIn('x, y, z', repr(reader))
        self.assertEqual(reader.crs['epsg'], 4326)
        sizes, points = [], []
        for batch in reader:
            self.assertEqual(batch.dtype, reader.dtype)
            sizes.append(len(batch))
            points.append(terrace.xyz(batch))
        self.assertEqual(list(reader), [])
        store = terrace.build(ALPS, self.path('alps'))
        self.assertEqual(sum(sizes), len(store))
        self.assertLessEqual(max(sizes), 3000)
        np.testing.assert_array_equal(sorted(map(tuple, np.concatenate(points))), sorted(map(tuple, terrace.xyz(store.points()))))

    def test_streams_clusters_of_a_file(self):
        blocks = []
        result = terrace.stream_clusters(terrace.point_batches(self.records(20000)), blocks.append, block_points=2000)
        self.assertEqual(result['points'], 20000)
        total = sum(np.bincount(block.values['classification'], minlength=5) for block in blocks if block.level == 0)
        np.testing.assert_array_equal(total, [4000] * 5)

    def test_progress_and_invalid_arguments(self):
        seen = []
        terrace.write_points(self.path('seen.ply'), self.points, progress=lambda *at: seen.append(at))
        self.assertEqual(seen[-1], ('points', len(self.points), 1.0, True))

        class Enough(Exception):
            pass

        def stop(*at):
            raise Enough

        with self.assertRaises(Enough):
            terrace.write_points(self.path('stopped.ply'), self.points, progress=stop)
        self.assertFalse(os.path.exists(self.path('stopped.ply')))
        for call, kind in ((lambda: terrace.read_points(self.path('none.laz')), OSError), (lambda: terrace.read_points([]), (ValueError, TypeError)),
                           (lambda: terrace.read_points(self.points, where='z >'), terrace.Error),
                           (lambda: terrace.read_points(self.points, block_points=0), ValueError), (lambda: terrace.read_points(self.points, none=1), TypeError),
                           (lambda: terrace.write_points(self.path('a.what'), self.points), ValueError),
                           (lambda: terrace.write_points(self.path('no/a.ply'), self.points), OSError),
                           (lambda: terrace.write_points(self.path('a.laz'), self.points, format='shp'), (ValueError, terrace.Error)),
                           (lambda: terrace.read_points(self.points, crs='EPSG:1'), ValueError), (lambda: terrace.read_points(np.zeros((0, 3))), ValueError)):
            with self.assertRaises(kind):
                call()


if __name__ == '__main__':
    unittest.main()
