#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests tiles for web globes end to end with an independent reader.

TERRACE=path/to/terrace tile_cli_test.py
"""

import gzip
import json
import math
import os
import shutil
import struct
import subprocess
import unittest

from quantized_mesh import A, B, TileSet, box_of, dot
from tile_case import NODATA, Dem, TileTestCase, terrace, utm, utm_to_degrees, write_tiff


class TileTest(TileTestCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.dems = {'degrees': Dem(90, 70, 10.13, 46.71, 0.01),
                    'utm': Dem(80, 60, 480000, 5200000, 900, zone=32)}
        cls.stores = {name: cls.build(dem, name) for name, dem in cls.dems.items()}

    def test_every_sample_is_within_the_bound_at_every_zoom(self):
        for name, store in self.stores.items():
            samples = self.dems[name].samples()
            for label, options, bound in (
                    ('expected', (), lambda zoom, _: 77067.34 / 2 ** zoom),
                    ('fine', ('--max-error', 2), lambda zoom, last: 2 * 2 ** (last - zoom))):
                with self.subTest(f'{name} {label}'):
                    out = f'{name}-{label}'
                    summary = self.tile(store, out, *options)
                    tiles = TileSet(self.path(out))
                    tiles.check()
                    last = tiles.layer['maxzoom']
                    self.assertEqual(last, 9)
                    self.assertTrue({(0, 0, 0), (0, 1, 0)} <= set(tiles.tiles))
                    self.assertEqual(summary['tiles'], len(tiles.tiles))
                    stated = {line['zoom']: line for line in summary['zooms']}
                    errors = tiles.errors(samples)
                    for zoom, (error, missed) in errors.items():
                        self.assertEqual(missed, 0, zoom)
                        self.assertLessEqual(error, bound(zoom, last) * (1 + 1e-6))
                        self.assertLessEqual(error, stated[zoom]['max_error'] + 1e-5)
                        self.assertLessEqual(error, tiles.layer['terrace']['maxErrors'][zoom])
                        self.assertEqual(stated[zoom]['tiles'],
                                         sum(1 for z, _, _ in tiles.tiles if z == zoom))
                    verdict = self.verify(out, '--store', store, '--vertical', 'ellipsoidal')
                    self.assertEqual(verdict['problems'], [])
                    self.assertEqual(verdict['tiles'], len(tiles.tiles))
                    # A sample on a border is measured in both tiles.
                    self.assertGreaterEqual(verdict['samples'], len(samples) * (last + 1))
                    for line in verdict['zooms']:
                        self.assertAlmostEqual(line['max_error'], errors[line['zoom']][0],
                                               delta=1e-3)

    def test_layer_json_describes_the_tiles(self):
        self.tile(self.stores['degrees'], 'layer', '--zoom', '2-8', '--name', 'Alps')
        tiles = TileSet(self.path('layer'))
        layer, dem = tiles.layer, self.dems['degrees']
        self.assertEqual((layer['name'], layer['format'], layer['scheme'], layer['projection']),
                         ('Alps', 'quantized-mesh-1.0', 'tms', 'EPSG:4326'))
        self.assertEqual((layer['minzoom'], layer['maxzoom']), (2, 8))
        self.assertEqual(layer['available'][:2], [[], []])
        self.assertEqual(len(layer['available']), 9)
        places = [p[:2] for p in dem.samples()]
        lons, lats = [p[0] for p in places], [p[1] for p in places]
        box = (min(lons), min(lats), max(lons), max(lats))
        for got, right in zip(layer['bounds'], box):
            self.assertAlmostEqual(got, right, places=9)
        self.assertEqual(layer['tiles'], ['{z}/{x}/{y}.terrain?v={version}'])
        # Exactly the tiles that have samples.
        expected = set()
        for zoom in range(2, 9):
            width = 180 / 2 ** zoom
            expected |= {(zoom, math.floor((lon + 180) / width), math.floor((lat + 90) / width))
                         for lon, lat in places}
        self.assertEqual(set(tiles.tiles), expected)

    def test_bytes_do_not_depend_on_threads_and_memory(self):
        found = []
        for threads, memory in ((1, '1G'), (2, '1G'), (7, '300M')):
            name = f'threads{threads}'
            self.tile(self.stores['utm'], name, '--threads', threads, '--memory', memory,
                      '--normals', '--water', 'nodata')
            found.append(TileSet(self.path(name)).files())
        self.assertEqual(found[0], found[1])
        self.assertEqual(found[0], found[2])

    def test_holes_are_filled_and_empty_tiles_are_omitted(self):
        def height(column, row):
            hole = 20 <= column < 32 and 15 <= row < 30
            sea = column + row > 90
            return NODATA if hole or sea else 400 + 60 * math.sin(column / 8) + row

        for name, dem in (('holes', Dem(90, 70, 10.13, 46.71, 0.01, height=height)),
                          ('holes-utm', Dem(80, 60, 480000, 5200000, 900, 32, height=height))):
            with self.subTest(name):
                store = self.build(dem, name)
                self.tile(store, name, '--max-error', 4, '--water', 'nodata')
                tiles = TileSet(self.path(name))
                tiles.check()
                samples = dem.samples()
                for zoom, (error, missed) in tiles.errors(samples).items():
                    self.assertEqual(missed, 0)
                    self.assertLessEqual(error, 4 * 2 ** (9 - zoom) * (1 + 1e-6))
                width = 180 / 2 ** 9
                inside = {(9, math.floor((lon + 180) / width), math.floor((lat + 90) / width))
                          for lon, lat, _ in samples}
                deepest = {key for key in tiles.tiles if key[0] == 9}
                self.assertEqual(deepest, inside)
                # No spikes in voids, and no land beyond the outline.
                for key in deepest:
                    tile = tiles.tiles[key]
                    heights = [tile.metres(i) for i in range(len(tile.u))]
                    self.assertGreaterEqual(min(heights), -1)
                    self.assertLess(max(heights), 560)
                    self.assertEqual((tile.low, tile.high), (min(heights), max(heights)))
                hole = [(*dem.place(c, r), 430) for c in range(21, 31, 3) for r in range(16, 29, 4)]
                self.assertLess(tiles.errors(hole)[9][0], 130)
                for key in (0, 0, 0), (0, 1, 0):
                    tile = tiles.tiles[key]
                    for i in range(len(tile.u)):
                        if tile.u[i] in (0, 32767) and tile.v[i] in (0, 32767):
                            self.assertEqual(tile.metres(i), 0)
                self.assertEqual(self.verify(name, '--store', store, '--vertical',
                                             'ellipsoidal')['problems'], [])
                self.check_water(tiles, dem)
        self.tile(self.path('holes.terrace'), 'flat', '--max-error', 4, '--fill', 'flat:-20')
        tiles = TileSet(self.path('flat'))
        tiles.check()
        lowest = min(t.metres(i) for k, t in tiles.tiles.items() if k[0] == 9
                     for i in range(len(t.u)))
        self.assertAlmostEqual(lowest, -20, delta=4)

    def check_water(self, tiles, dem):
        """Each cell of a mask must match its nearest sample."""
        wet = dry = 0
        for (zoom, x, y), tile in tiles.tiles.items():
            mask = tile.extensions[2]
            self.assertIn(len(mask), (1, 65536))
            self.assertTrue(set(mask) <= {0, 255})
            if zoom != 9:
                continue
            west, south, east, north = box_of(zoom, x, y)
            for column in range(dem.columns):
                for row in range(dem.rows):
                    lon, lat = dem.place(column, row)
                    if not (west < lon < east and south < lat < north):
                        continue
                    i = int((lon - west) / (east - west) * 256)
                    j = int((north - lat) / (north - south) * 256)
                    cell = mask[256 * j + i] if len(mask) > 1 else mask[0]
                    water = dem.heights[row * dem.columns + column] == NODATA
                    self.assertEqual(cell, 255 if water else 0)
                    wet, dry = wet + water, dry + (not water)
        self.assertGreater(wet, 100)
        self.assertGreater(dry, 100)

    def test_normals_match_the_slope(self):
        # Rises by 500 m per sample eastward and by 300 m northward.
        dem = Dem(60, 60, 10.0, 46.6, 0.01, height=lambda c, r: 500 * c - 300 * r)
        self.tile(self.build(dem, 'slope'), 'slope', '--normals', '--max-error', 1, '--zoom', '9-9')
        tiles = TileSet(self.path('slope'))
        tiles.check()
        checked = 0
        for tile in tiles.tiles.values():
            for vertex, normal in enumerate(tile.normals()):
                lon, lat = tile.place(vertex)
                if not (10.03 < lon < 10.57 and 46.03 < lat < 46.57):
                    continue
                a, b = math.radians(lon), math.radians(lat)
                e2 = 1 - (B / A) ** 2
                root = math.sqrt(1 - e2 * math.sin(b) ** 2)
                degree = math.radians(1)
                east = 500 / 0.01 / (degree * A / root * math.cos(b))
                north = 300 / 0.01 / (degree * A * (1 - e2) / root ** 3)
                up = (math.cos(b) * math.cos(a), math.cos(b) * math.sin(a), math.sin(b))
                axes = ((-math.sin(a), math.cos(a), 0),
                        (-math.sin(b) * math.cos(a), -math.sin(b) * math.sin(a), math.cos(b)))
                expected = [u - east * e - north * n for u, e, n in zip(up, *axes)]
                length = math.sqrt(dot(expected, expected))
                self.assertGreater(dot(normal, expected) / length, math.cos(math.radians(1.2)))
                checked += 1
        self.assertGreater(checked, 10)

    def test_metadata_lists_the_tiles_below(self):
        self.tile(self.stores['degrees'], 'metadata', '--metadata', '--zoom', '0-9')
        TileSet(self.path('metadata')).check_metadata()

    def test_gzip_compresses_the_same_tiles(self):
        self.tile(self.stores['degrees'], 'plain')
        summary = self.tile(self.stores['degrees'], 'packed', '--gzip')
        plain, packed = (TileSet(self.path(name)).files() for name in ('plain', 'packed'))
        self.assertEqual({name: gzip.decompress(data) for name, data in packed.items()}, plain)
        self.assertTrue(all(data[:2] == b'\x1f\x8b' for data in packed.values()))
        self.assertLess(sum(map(len, packed.values())), sum(map(len, plain.values())))
        self.assertEqual(summary['bytes'], sum(map(len, packed.values())) +
                         os.path.getsize(self.path('packed/layer.json')))
        self.assertEqual(self.verify('packed')['problems'], [])

    def test_force_rewrites_only_changed_tiles(self):
        dem = Dem(90, 70, 10.13, 46.71, 0.01)
        store = self.build(dem, 'again')
        first = self.tile(store, 'again', '--max-error', 2)

        def times():
            return {name: os.stat(os.path.join(self.path('again'), name)).st_mtime_ns
                    for name in TileSet(self.path('again')).files()}

        before = times()
        again = self.tile(store, 'again', '--max-error', 2, '--force')
        self.assertEqual(times(), before)
        self.assertEqual((again['kept'], again['tiles']), (first['tiles'], first['tiles']))
        dem.heights[35 * 90 + 45] += 40
        store = self.build(dem, 'again')
        changed = self.tile(store, 'again', '--max-error', 2, '--force')
        touched = [name for name, at in times().items() if at != before[name]]
        self.assertEqual(changed['tiles'] - changed['kept'], len(touched))
        # The height step of a zoom must not change with a single sample.
        self.assertTrue(0 < len([t for t in touched if t.startswith('9/')]) <= 4, touched)
        fewer = self.tile(store, 'again', '--max-error', 2, '--zoom', '0-5', '--force')
        self.assertGreater(fewer['removed'], 0)
        self.assertFalse(os.path.exists(self.path('again/9')))
        TileSet(self.path('again')).check()

    def test_force_keeps_foreign_files_in_the_folder(self):
        store, folder = self.stores['degrees'], self.path('shared')
        self.tile(store, 'shared')
        zoom = max(int(name) for name in os.listdir(folder) if name.isdigit())
        stranger = f'{zoom}/0/0.terrain'
        for name in ('index.html', '0/notes.txt', stranger):
            path = os.path.join(folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, 'w') as file:
                file.write('precious')
        for option in ('--force', '--resume'):
            self.refuse(1, f'contains {stranger}, which terrace did not write', 'tile', store, '-o', folder, '--vertical',
                        'ellipsoidal', option)
        os.remove(os.path.join(folder, stranger))
        self.tile(store, 'shared', '--max-error', 30, '--zoom', '0-3', '--force')
        for name in ('index.html', '0/notes.txt'):
            with open(os.path.join(folder, name)) as file:
                self.assertEqual(file.read(), 'precious')

    def test_unsuitable_stores_and_folders_are_refused(self):
        store, out = self.stores['degrees'], self.path('none')
        tile = ('tile', store, '-o', out)
        vertical = ('--vertical', 'ellipsoidal')
        self.refuse(2, '--vertical', *tile)
        for text, *options in (('--zoom', '--zoom', '5-3'), ('--zoom', '--zoom', '0-31'),
                               ('--zoom', '--zoom', 'all'), ('--max-error', '--max-error', 0),
                               ('--max-error', '--max-error', 'nan'), ('--fill', '--fill', 'sea'),
                               ('--format', '--format', 'png'), ('--water', '--water', 'deep'),
                               ('--quality', '--quality', 'best'),
                               ('--metadata', '--metadata', '--zoom', '3-9')):
            with self.subTest(options):
                self.refuse(2, text, *tile, *vertical, *options)
        self.refuse(1, '--memory', *tile, *vertical, '--memory', '20M')
        self.assertFalse(os.path.exists(out))
        # No CRS.
        heights = [1.0] * 100
        write_tiff(self.path('bare.tif'), 10, 10, heights, 0, 0, 1, None)
        self.assertEqual(terrace('build', self.path('bare.tif'), '-o',
                                 self.path('bare.terrace')).returncode, 0)
        self.refuse(1, '--crs', 'tile', self.path('bare.terrace'), '-o', out, *vertical)
        self.assertFalse(os.path.exists(out))
        # Folders that terrace did not write.
        os.mkdir(self.path('full'))
        with open(self.path('full/letter.txt'), 'w') as file:
            file.write('dear')
        for options in ((), ('--force',), ('--resume',)):
            self.refuse(1, 'not empty', 'tile', store, '-o', self.path('full'), *vertical, *options)
        self.assertEqual(os.listdir(self.path('full')), ['letter.txt'])
        self.refuse(1, 'letter.txt', 'tile', store, '-o', self.path('full/letter.txt/x'), *vertical)
        self.refuse(2, 'which is a folder', 'tile', store, '-o', self.path('full/letter.txt'), *vertical)
        with open(self.path('full/layer.json'), 'w') as file:
            json.dump({'format': 'quantized-mesh-1.0', 'bounds': [0, 0, 1, 1],
                       'available': [[]]}, file)
        self.refuse(1, 'did not write', 'tile', store, '-o', self.path('full'), *vertical,
                    '--force')
        self.tile(store, 'once')
        self.refuse(1, '--force', 'tile', store, '-o', self.path('once'), *vertical)

    def test_impossible_heights_are_refused(self):
        dem = Dem(20, 20, 10, 46, 0.01, height=lambda c, r: -3e38 if c == r else 300.0)
        store = self.build(dem, 'far')
        result = terrace('tile', store, '--vertical', 'ellipsoidal', '-o', self.path('far'))
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('10,000 km', result.stderr)
        self.assertIn('nodata', result.stderr)
        self.assertFalse(os.path.exists(self.path('far')))
        self.tile(store, 'near', '--where', 'z > -9000')
        result = terrace('tile', store, '--vertical', 'ellipsoidal', '--where', 'z > -9000', '--fill',
                         'flat:1e300', '-o', self.path('far'))
        self.assertEqual(result.returncode, 2, result.stderr)

    def test_zooms_deeper_than_the_data_give_a_note(self):
        result = terrace('tile', self.stores['degrees'], '-o', self.path('deep'), '--vertical',
                         'ellipsoidal', '--zoom', '10-10')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('zoom 9 already shows every sample', result.stderr)
        self.assertEqual(self.verify('deep', '--store', self.stores['degrees'], '--vertical',
                                     'ellipsoidal')['problems'], [])

    def test_a_bound_below_the_height_steps_gives_a_note(self):
        result = terrace('tile', self.stores['degrees'], '-o', self.path('tiny'), '--vertical',
                         'ellipsoidal', '--zoom', '9-9', '--max-error', '1e-6')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('finer than the 15 bits', result.stderr)
        self.assertEqual(self.verify('tiny', '--store', self.stores['degrees'], '--vertical',
                                     'ellipsoidal')['problems'], [])

    def write_geoid(self, name, undulation):
        """Writes a grid in GeographicLib's format, five degrees apart; undulation(lat) in hundredths."""
        with open(self.path(name), 'wb') as file:
            file.write(b'P5\n# Description test\n# DateTime 2020-01-01 00:00:00\n'
                       b'# MaxBilinearError 0.1\n# RMSBilinearError 0.1\n# MaxCubicError 0.1\n'
                       b'# RMSCubicError 0.1\n# Offset -100\n# Scale 0.01\n72 37\n65535\n')
            for row in range(37):
                file.write(struct.pack('>H', 10000 + undulation(90 - 5 * row)) * 72)
        return self.path(name)

    def test_a_geoid_is_added_to_the_heights(self):
        # Linear in latitude, so that every interpolation of the grid gives the same.
        geoid = self.write_geoid('slope.pgm', lambda lat: 5000 + 40 * lat)
        other = self.write_geoid('level.pgm', lambda lat: 5000)
        for name, store in self.stores.items():
            with self.subTest(name):
                out = f'{name}-geoid'
                result = terrace('tile', store, '-o', self.path(out), '--geoid', geoid, '--max-error', 2)
                self.assertEqual(result.returncode, 0, result.stderr)
                tiles = TileSet(self.path(out))
                tiles.check()
                samples = [(lon, lat, z + 50 + 0.4 * lat)
                           for lon, lat, z in self.dems[name].samples()]
                for zoom, (error, missed) in tiles.errors(samples).items():
                    self.assertEqual(missed, 0)
                    self.assertLessEqual(error, 2 * 2 ** (tiles.layer['maxzoom'] - zoom) * 1.000001)
                self.assertTrue(self.verify(out, '--store', store, '--geoid', geoid)['ok'])
                self.assertFalse(self.verify(out, '--store', store, '--geoid', other)['ok'])
                self.assertFalse(self.verify(out, '--store', store, '--vertical', 'ignore')['ok'])

    def test_tiles_continue_beyond_the_edge_of_a_map(self):
        side, cell, west, north = 40, 10000.0, 20037508 - 200000, -1.9e6
        heights = [500 + 200 * math.sin(i % side / 7) * math.cos(i // side / 5) for i in range(side * side)]
        write_tiff(self.path('edge.tif'), side, side, heights, west, north, cell, {1024: 1, 1025: 1, 3072: 3857})
        self.assertEqual(terrace('build', self.path('edge.tif'), '-o', self.path('edge.terrace')).returncode, 0)
        samples = []
        for i, height in enumerate(heights):
            x, y = west + cell * (i % side + 0.5), north - cell * (i // side + 0.5)
            longitude = math.degrees(x / 6378137)
            samples.append((longitude - 360 if longitude > 180 else longitude,
                            math.degrees(math.atan(math.sinh(y / 6378137))), height))
        self.tile(self.path('edge.terrace'), 'edge', '--max-error', 2)
        tiles = TileSet(self.path('edge'))
        tiles.check()
        for zoom, (error, missed) in tiles.errors(samples).items():
            self.assertEqual(missed, 0)
            self.assertLessEqual(error, 2 * 2 ** (tiles.layer['maxzoom'] - zoom) * 1.000001)
        verdict = self.verify('edge', '--store', self.path('edge.terrace'), '--vertical', 'ellipsoidal')
        self.assertEqual(verdict['problems'], [])

    def test_longitudes_may_go_around_the_globe_many_times(self):
        side, cell, west, north = 40, 0.1, 1000, 10
        heights = [500 + 200 * math.sin(i % side / 7) * math.cos(i // side / 5) for i in range(side * side)]
        write_tiff(self.path('many.tif'), side, side, heights, west, north, cell, {1024: 2, 1025: 1, 2048: 4326})
        self.assertEqual(terrace('build', self.path('many.tif'), '-o', self.path('many.terrace')).returncode, 0)
        samples = [(west - 1080 + cell * (i % side + 0.5), north - cell * (i // side + 0.5), height)
                   for i, height in enumerate(heights)]
        self.tile(self.path('many.terrace'), 'many', '--max-error', 2)
        tiles = TileSet(self.path('many'))
        tiles.check()
        for zoom, (error, missed) in tiles.errors(samples).items():
            self.assertEqual(missed, 0)
            self.assertLessEqual(error, 2 * 2 ** (tiles.layer['maxzoom'] - zoom) * 1.000001)
        verdict = self.verify('many', '--store', self.path('many.terrace'), '--vertical', 'ellipsoidal')
        self.assertEqual(verdict['problems'], [])

    def test_normals_at_the_poles_point_upward(self):
        result = terrace('tile', self.stores['degrees'], '-o', self.path('poles'), '--vertical', 'orthometric',
                         '--normals', '--zoom', '0-2')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.verify('poles')['problems'], [])

    def test_orthometric_heights_go_to_the_ellipsoid_by_egm96(self):
        if not shutil.which('cs2cs'):
            self.skipTest('cs2cs is not installed')
        store, dem = self.stores['degrees'], list(self.dems['degrees'].samples())
        result = terrace('tile', store, '-o', self.path('sea'), '--vertical', 'orthometric', '--max-error', 2)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('EGM96', result.stderr)
        answer = subprocess.run(['cs2cs', '-f', '%.6f', 'EPSG:4326+5773', '+to', 'EPSG:4979'],
                                input='\n'.join(f'{lat!r} {lon!r} {z!r}' for lon, lat, z in dem),
                                capture_output=True, text=True, check=True).stdout
        samples = [(lon, lat, float(line.split()[2])) for (lon, lat, _), line in zip(dem, answer.splitlines())]
        self.assertEqual(len(samples), len(dem))
        self.assertGreater(samples[0][2] - dem[0][2], 30)
        tiles = TileSet(self.path('sea'))
        tiles.check()
        for zoom, (error, missed) in tiles.errors(samples).items():
            self.assertEqual(missed, 0)
            self.assertLessEqual(error, 2 * 2 ** (tiles.layer['maxzoom'] - zoom) * 1.000001)
        self.assertTrue(self.verify('sea', '--store', store, '--vertical', 'orthometric')['ok'])
        self.assertFalse(self.verify('sea', '--store', store, '--vertical', 'ignore')['ok'])

    def test_rotated_rasters(self):
        dem = Dem(70, 50, 0, 0, 1)
        angle, cell = math.radians(30), 900.0
        matrix = (cell * math.cos(angle), cell * math.sin(angle), 0, 470000,
                  cell * math.sin(angle), -cell * math.cos(angle), 0, 5200000,
                  0, 0, 0, 0, 0, 0, 0, 1)
        write_tiff(self.path('turned.tif'), 70, 50, dem.heights, 0, 0, 1, utm(32), matrix)
        store = self.path('turned.terrace')
        self.assertEqual(terrace('build', self.path('turned.tif'), '-o', store).returncode, 0)
        self.tile(store, 'turned', '--max-error', 3)
        tiles = TileSet(self.path('turned'))
        tiles.check()
        samples = []
        for row in range(50):
            for column in range(70):
                c, r = column + 0.5, row + 0.5
                x = 470000 + matrix[0] * c + matrix[1] * r
                y = 5200000 + matrix[4] * c + matrix[5] * r
                samples.append((*utm_to_degrees(x, y, 32), dem.heights[row * 70 + column]))
        for zoom, (error, missed) in tiles.errors(samples).items():
            self.assertEqual(missed, 0)
            self.assertLessEqual(error, 3 * 2 ** (tiles.layer['maxzoom'] - zoom) * (1 + 1e-6))

    def test_the_antimeridian_and_longitudes_to_360(self):
        for name, west in (('fiji', 179.6), ('pacific', -180.4), ('greenwich', 359.7)):
            with self.subTest(name):
                dem = Dem(80, 60, west, -16.2, 0.01)
                store = self.build(dem, name)
                self.tile(store, name, '--max-error', 2)
                tiles = TileSet(self.path(name))
                tiles.check()
                samples = [((lon + 180) % 360 - 180, lat, z) for lon, lat, z in dem.samples()]
                for zoom, (error, missed) in tiles.errors(samples).items():
                    self.assertEqual(missed, 0)
                    self.assertLessEqual(error, 2 * 2 ** (tiles.layer['maxzoom'] - zoom) * 1.000001)
                self.assertLess(len(tiles.tiles), 200)


if __name__ == '__main__':
    unittest.main()
