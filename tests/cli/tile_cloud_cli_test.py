#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests tiles of irregular points with an independent reader.

TERRACE=path/to/terrace tile_cloud_cli_test.py
"""

import math
import os
import random
import struct
import unittest

from quantized_mesh import TileSet, box_of
from tile_case import TileTestCase, terrace, utm_to_degrees

VERTICAL = ('--vertical', 'ellipsoidal')
DATA = os.environ.get('TERRACE_DATA')


def hills(x, y):
    """A smooth surface over metres."""
    return 400 + 60 * math.sin(x / 130) * math.cos(y / 90) + 0.05 * x


class Cloud:
    """Points in degrees or in metres of UTM."""

    def __init__(self, points, zone=None, block=200):
        self.points, self.zone, self.block = points, zone, block

    @classmethod
    def scattered(cls, count, width, height, seed, west=480000, south=5200000, zone=32, noise=0.5):
        chance = random.Random(seed)
        points = []
        for _ in range(count):
            x, y = chance.uniform(0, width), chance.uniform(0, height)
            points.append((round(west + x, 2), round(south + y, 2),
                           round(hills(x, y) + chance.uniform(-noise, noise), 3)))
        return cls(points, zone)

    def write(self, path):
        with open(path, 'w') as file:
            for x, y, z in self.points:
                file.write(f'{x!r} {y!r} {z!r}\n')

    def crs(self):
        return f'EPSG:{32600 + self.zone}' if self.zone else 'EPSG:4326'

    def place(self, x, y):
        if self.zone:
            x, y = utm_to_degrees(x, y, self.zone)
        return (x + 180) % 360 - 180 if not -180 <= x <= 180 else x, y

    def samples(self, nudge=0.0):
        """nudge: degrees inward, for points on the northern and eastern outline that are on borders of
        tiles, because the tiles beyond do not exist."""
        found = [(*self.place(x, y), z) for x, y, z in self.points]
        east, north = max(p[0] for p in found), max(p[1] for p in found)
        return [(lon - nudge * (lon == east), lat - nudge * (lat == north), z)
                for lon, lat, z in found]


def read_las(path):
    """The points of a LAS file of any point format."""
    with open(path, 'rb') as file:
        data = file.read()
    at, = struct.unpack_from('<I', data, 96)
    size, count = struct.unpack_from('<HI', data, 105)
    if count == 0:
        count, = struct.unpack_from('<Q', data, 247)
    scales, offsets = struct.unpack_from('<3d', data, 131), struct.unpack_from('<3d', data, 155)
    places = (struct.unpack_from('<3i', data, at + i * size) for i in range(count))
    return [tuple(round(c * s + o, 7) for c, s, o in zip(place, scales, offsets))
            for place in places]


class TileCloudTest(TileTestCase):
    @classmethod
    def build(cls, dem, name, *options):
        dem.write(cls.path(name + '.xyz'))
        store = cls.path(name + '.terrace')
        result = terrace('build', cls.path(name + '.xyz'), '-o', store, '--force', '--crs',
                         dem.crs(), '--block', dem.block, *options)
        assert result.returncode == 0, result.stderr
        return store

    def check(self, cloud, name, *options, bound=None, nudge=0.0, order='auto'):
        """Tiles a cloud and checks every sample at every zoom. Returns the set."""
        store = self.build(cloud, name, '--order', order)
        limit = () if bound is None else ('--max-error', bound)
        summary = self.tile(store, name, *limit, *options)
        tiles = TileSet(self.path(name))
        tiles.check()
        last = tiles.layer['maxzoom']
        stated = {line['zoom']: line['max_error'] for line in summary['zooms']}
        samples = cloud.samples(nudge)
        for zoom, (error, missed) in tiles.errors(samples).items():
            self.assertEqual(missed, 0, zoom)
            self.assertLessEqual(error, stated[zoom] + 1e-4)
            self.assertLessEqual(stated[zoom], tiles.layer['terrace']['maxErrors'][zoom])
            promised = 77067.34 / 2 ** zoom if bound is None else bound * 2 ** (last - zoom)
            self.assertLessEqual(error, promised * (1 + 1e-6), zoom)
        verdict = self.verify(name, '--store', store, *VERTICAL)
        self.assertEqual(verdict['problems'], [])
        self.assertEqual(verdict['tiles'], len(tiles.tiles))
        self.assertGreaterEqual(verdict['samples'], len(set(p[:2] for p in cloud.points)))
        return tiles

    def test_every_sample_is_within_the_bound_at_every_zoom(self):
        cloud = Cloud.scattered(3000, 640, 500, 1)
        tiles = self.check(cloud, 'expected')
        # A 64th of a tile is about the distance of the points: 10 m.
        self.assertIn(tiles.layer['maxzoom'], (14, 15))
        self.check(cloud, 'fine', bound=1)
        self.check(cloud, 'fitted', '--quality', 'fitted', '--zoom', '11-14', bound=2)

    def test_clouds_in_degrees(self):
        chance = random.Random(5)
        points = []
        for _ in range(2000):
            x, y = chance.uniform(0, 0.02), chance.uniform(0, 0.015)
            points.append((round(10.993 + x, 7), round(45.693 + y, 7),
                           round(hills(x * 80000, y * 110000), 2)))
        self.check(Cloud(points), 'degrees', bound=1)

    def test_bytes_do_not_depend_on_threads_and_memory(self):
        cloud = Cloud.scattered(5000, 800, 800, 2)
        store = self.build(cloud, 'same')
        found = []
        for threads, memory in ((1, '1G'), (2, '1G'), (5, '700M')):
            name = f'same{threads}'
            self.tile(store, name, '--threads', threads, '--memory', memory, '--normals',
                      '--max-error', 1)
            found.append(TileSet(self.path(name)).files())
        self.assertEqual(found[0], found[1])
        self.assertEqual(found[0], found[2])

    def test_points_on_the_borders_of_tiles(self):
        # A lattice of points as a cloud. At 11.25 degrees and on its own outline they are on
        # borders of tiles.
        step = 180 / 2 ** 13 / 16
        points = [(11.25 + i * step, 45 + j * step,
                   round(300 + 40 * math.sin(i / 5) + 30 * math.cos(j / 4) + (i * j % 7), 2))
                  for i in range(-32, 33) for j in range(0, 65)]
        self.check(Cloud(points), 'borders', bound=0.5, nudge=1e-12)
        self.check(Cloud(points[:65]), 'line', bound=0.5, nudge=1e-12)

    def test_few_points(self):
        for name, points in (
                ('one', [(500000, 5200000, 123.0)]),
                ('two', [(500000, 5200000, 123.0), (500100, 5200050, 150.0)]),
                ('three', [(500000, 5200000, 123.0), (500100, 5200050, 150.0),
                           (500030, 5200090, 90.0)]),
                ('collinear', [(500000 + 3 * i, 5200000 + 2 * i, 100 + i % 5) for i in range(300)]),
                ('parallel', [(500000 + 3 * i, 5200000, 100 + i % 5) for i in range(300)])):
            with self.subTest(name):
                self.check(Cloud(points, 32), name, bound=0.5)

    def test_one_of_several_points_at_a_position_counts(self):
        cloud = Cloud.scattered(1500, 500, 500, 3)
        tops = [(x, y, z + 30) for x, y, z in cloud.points[::3]]
        both = Cloud(cloud.points + tops + cloud.points[:400], 32)
        random.Random(4).shuffle(both.points)
        store = self.build(both, 'twice')
        summary = self.tile(store, 'twice', '--max-error', 1)
        tiles = TileSet(self.path('twice'))
        tiles.check()
        heights = {}
        for x, y, z in both.points:
            heights.setdefault((x, y), set()).add(z)
        self.assertEqual(len(heights), 1500)
        last = tiles.layer['maxzoom']
        tiles.tiles = {key: tile for key, tile in tiles.tiles.items() if key[0] == last}
        tiles.layer['minzoom'] = last
        # Each position is within the stated bound of one of its heights. On slopes this steep,
        # rounding the positions takes part of the bound.
        stated = summary['zooms'][-1]['max_error']
        self.assertLess(stated, 3)
        twice = [(place, values) for place, values in heights.items() if len(values) > 1][:60]
        for place, values in twice:
            errors = [tiles.errors([(*both.place(*place), z)])[last][0] for z in values]
            self.assertLessEqual(min(errors), stated + 1e-4)
        once = [(*both.place(*place), min(values)) for place, values in heights.items()
                if len(values) == 1]
        self.assertEqual(len(once), 1000)
        self.assertLessEqual(tiles.errors(once)[last][0], stated + 1e-4)
        self.assertEqual(self.verify('twice', '--store', store, *VERTICAL)['problems'], [])

    def test_a_void_in_the_middle_is_spanned(self):
        cloud = Cloud.scattered(3000, 1200, 1000, 6)
        cloud.points = [p for p in cloud.points
                        if math.hypot(p[0] - 480600, p[1] - 5200500) > 250]
        tiles = self.check(cloud, 'void', bound=1)
        # The triangles of the points around it, without spikes.
        for key, tile in tiles.tiles.items():
            if key[0] == tiles.layer['maxzoom']:
                # 0 is the height beyond the outline.
                metres = [tile.metres(i) for i in range(len(tile.u)) if tile.metres(i) != 0]
                self.assertGreater(min(metres, default=400), 330)
                self.assertLess(max(metres, default=400), 530)

    def test_clusters_far_apart(self):
        near = Cloud.scattered(2000, 60, 60, 8, noise=0.05)
        far = Cloud.scattered(1000, 60, 60, 9, west=630000, south=5290000, noise=0.05)
        tiles = self.check(Cloud(near.points + far.points, 32), 'apart', bound=0.5)
        # There are no tiles in between.
        self.assertLess(len(tiles.tiles), 200)

    def test_more_points_than_fit_a_leaf(self):
        # All within one unit of the tiles of zoom 0, and many within one unit of a tile of zoom 4;
        # the bound requires all of them to be read.
        chance = random.Random(11)
        points = []
        for _ in range(300000):
            x, y = chance.gauss(0, 150), chance.gauss(0, 150)
            points.append((round(500000 + x, 2), round(5200000 + y, 2), round(hills(x, y), 2)))
        cloud = Cloud(points, 32, block=4000)
        store = self.build(cloud, 'crowd')
        # The command's own check reads all of them.
        samples = [(*cloud.place(x, y), z) for x, y, z in points[::10]]
        for zooms, bound in (('0-0', 300), ('5-5', 70), ('10-10', 20)):
            with self.subTest(zooms):
                summary = self.tile(store, 'crowd', '--zoom', zooms, '--max-error', bound,
                                    '--force', '--memory', '300M')
                self.assertLess(summary['peak_rss_bytes'], 300 << 20)
                tiles = TileSet(self.path('crowd'))
                tiles.check()
                (error, missed), = tiles.errors(samples).values()
                self.assertEqual(missed, 0)
                self.assertLessEqual(error, summary['zooms'][0]['max_error'] + 1e-4)
                self.assertLessEqual(error, bound * (1 + 1e-6))
                verdict = self.verify('crowd', '--store', store, *VERTICAL)
                self.assertEqual(verdict['problems'], [])
                self.assertGreaterEqual(verdict['samples'], len(set(p[:2] for p in points)))

    def test_the_antimeridian(self):
        chance = random.Random(12)
        points = []
        for _ in range(2000):
            x, y = chance.uniform(0, 0.03), chance.uniform(0, 0.02)
            points.append((round(179.985 + x, 7), round(-16.51 + y, 7),
                           round(hills(x * 100000, y * 110000), 2)))
        self.check(Cloud(points), 'east', bound=1)
        self.check(Cloud([(x - 360, y, z) for x, y, z in points]), 'west', bound=1)
        # In spatial order, different clusters leave 74 m instead of 64 at zoom 7, which the summary
        # states: there, samples are within a step of 15 bits of each other.
        self.check(Cloud([(x - 360 if x > 180 else x, y, z) for x, y, z in points]), 'both',
                   bound=1, order='stream')
        # UTM zone 1 begins there.
        chance = random.Random(13)
        points = [(round(chance.uniform(165000, 168000), 2), round(chance.uniform(5e5, 502000), 2),
                   round(chance.uniform(0, 3), 2)) for _ in range(2000)]
        tiles = self.check(Cloud(points, 1), 'utm', bound=1)
        last = tiles.layer['maxzoom']
        columns = {x for z, x, _ in tiles.tiles if z == last}
        self.assertTrue({0, 2 ** (last + 1) - 1} <= columns)

    def test_around_the_pole(self):
        chance = random.Random(14)
        points = []
        for _ in range(2000):
            x, y = chance.uniform(-900, 900), chance.uniform(-900, 900)
            points.append((round(2000000 + x, 2), round(2000000 + y, 2), round(hills(x, y), 2)))
        cloud = Cloud(points)
        cloud.crs = lambda: 'EPSG:32661'
        store = self.build(cloud, 'pole')
        summary = self.tile(store, 'pole', '--max-error', 16, '--zoom', '0-6')
        tiles = TileSet(self.path('pole'))
        tiles.check()
        verdict = self.verify('pole', '--store', store, *VERTICAL)
        self.assertEqual(verdict['problems'], [])
        for line in summary['zooms']:
            self.assertLessEqual(line['max_error'], 16 * 2 ** (summary['zooms'][-1]['zoom'] -
                                                              line['zoom']))
        self.assertEqual(verdict['zooms'][0]['samples'], 2000)
        # All around the globe at its last row.
        self.assertEqual({x for z, x, _ in tiles.tiles if z == 3}, set(range(16)))

    def test_water_is_where_the_surface_has_a_height(self):
        chance = random.Random(15)
        points = []
        for _ in range(2000):
            x, y = round(chance.uniform(0, 400), 2), round(chance.uniform(0, 400), 2)
            lake = math.hypot(x - 200, y - 200) < 100
            points.append((480000 + x, 5200000 + y, 312.5 if lake else 320 + x / 20))
        cloud = Cloud(points, 32)
        store = self.build(cloud, 'lake')
        self.refuse(2, '--water nodata is for rasters', 'tile', store, '-o', self.path('none'),
                    *VERTICAL, '--water', 'nodata')
        self.assertFalse(os.path.exists(self.path('none')))
        self.tile(store, 'lake', '--water', '312.5')
        tiles = TileSet(self.path('lake'))
        tiles.check()
        last = tiles.layer['maxzoom']
        wet = dry = 0
        for dx, dy, water in ((0, 0, 255), (60, 40, 255), (-80, 10, 255), (130, 0, 0),
                              (-90, -90, 0), (0, 150, 0), (0, 260, 0)):
            lon, lat = cloud.place(480200 + dx, 5200200 + dy)
            width = 180 / 2 ** last
            key = last, math.floor((lon + 180) / width), math.floor((lat + 90) / width)
            if key not in tiles.tiles:
                continue
            mask = tiles.tiles[key].extensions[2]
            west, _, east, north = box_of(*key)
            i, j = (int(256 * d / width) for d in (lon - west, north - lat))
            self.assertEqual(mask[256 * j + i] if len(mask) > 1 else mask[0], water, (dx, dy))
            wet, dry = wet + (water > 0), dry + (water == 0)
        self.assertEqual(wet, 3)
        self.assertGreater(dry, 2)

    def test_fill_flat_is_flat_beyond_the_hull(self):
        cloud = Cloud.scattered(500, 300, 300, 16)
        store = self.build(cloud, 'flat')
        self.tile(store, 'flat', '--fill', 'flat:-40', '--max-error', 1)
        tiles = TileSet(self.path('flat'))
        tiles.check()
        low = min(tile.low for tile in tiles.tiles.values())
        self.assertAlmostEqual(low, -40, delta=0.01)
        for zoom, (error, missed) in tiles.errors(cloud.samples()).items():
            self.assertEqual(missed, 0)
            self.assertLessEqual(error, 2 ** (tiles.layer['maxzoom'] - zoom) * (1 + 1e-6))
        self.assertEqual(self.verify('flat', '--store', store, *VERTICAL)['problems'], [])

    @unittest.skipUnless(DATA, 'TERRACE_DATA is not set')
    def test_laser_scans(self):
        for file, crs, filtered in (('epsg_4326.las', 'EPSG:4326', True),
                                    ('autzen_trim.las', 'EPSG:2994', False),
                                    ('hexbin-crop.las', 'EPSG:26911', False)):
            with self.subTest(file):
                points = read_las(os.path.join(DATA, 'lidar', file))
                cloud = Cloud(points, block=3000)
                cloud.crs = lambda crs=crs: crs
                store = self.build(cloud, 'laser')
                summary = self.tile(store, 'laser', '--force', '--zoom', '9-17')
                tiles = TileSet(self.path('laser'))
                tiles.check()
                verdict = self.verify('laser', '--store', store, *VERTICAL)
                self.assertEqual(verdict['problems'], [])
                self.assertGreaterEqual(verdict['zooms'][0]['samples'],
                                        0.99 * len(set(p[:2] for p in points)))
                for stated, line in zip(summary['zooms'], verdict['zooms']):
                    self.assertLessEqual(line['max_error'], stated['max_error'] + 1e-4)
                    if filtered:
                        # One return per position.
                        self.assertLessEqual(stated['max_error'], 77067.34 / 2 ** stated['zoom'])
                if filtered:
                    for zoom, (error, missed) in tiles.errors(cloud.samples()).items():
                        self.assertEqual(missed, 0)
                        self.assertLessEqual(error, 77067.34 / 2 ** zoom)


if __name__ == '__main__':
    unittest.main()
