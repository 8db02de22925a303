#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The golden stores, decoded from FORMAT.md alone, have the points of the accompanying texts."""
import lzma
import pathlib
import unittest

import decode_store

STORES = pathlib.Path(__file__).parent / 'data' / 'stores'


def text(name):
    return sorted(lzma.decompress((STORES / f'{name}.txt.xz').read_bytes()).decode().splitlines())


def lines(rows):
    return sorted(' '.join(map(repr, row)) for row in rows)


class GoldenStoreTest(unittest.TestCase):
    def check_points(self, name):
        self.assertEqual(lines(decode_store.Store(STORES / name).points()), text(name))

    def test_raster_with_voids(self):
        self.check_points('grid')

    def test_signed_64_bit_samples(self):
        self.check_points('int64')

    def test_unsigned_64_bit_samples(self):
        self.check_points('uint64')

    def test_cloud_with_attributes_of_every_type(self):
        self.check_points('cloud')

    def test_raster_with_equal_blocks(self):
        self.check_points('island')

    def test_columns_of_points(self):
        self.check_points('survey')

    def test_columns_that_follow_scan_lines(self):
        self.check_points('swath')

    def test_store_without_points(self):
        self.check_points('empty')

    def test_overlay(self):
        store = decode_store.Store(STORES / 'grid')
        self.assertEqual(lines(decode_store.overlay(STORES / 'grid.overlay', store)), text('grid.overlay'))

    def test_points_head_their_clusters(self):
        """A point of highest level h heads a cluster on every level below, as its representative."""
        for name in ('grid', 'cloud', 'survey', 'island', 'swath', 'int64', 'uint64'):
            levels = decode_store.Store(STORES / name).levels
            headed = [set() for _ in levels]
            for number, level in enumerate(levels):
                for cluster in level.clusters:
                    for k in cluster.members():
                        for nearest, column in enumerate(cluster.children):
                            below = number - 1 - nearest
                            head = levels[below].clusters[column[k]]
                            self.assertNotIn(column[k], headed[below])
                            headed[below].add(column[k])
                            self.assertEqual(head.points[head.representative], cluster.points[k])
            for number, level in enumerate(levels[:-1]):
                self.assertEqual(len(headed[number]), len(level.clusters))


if __name__ == '__main__':
    unittest.main()
