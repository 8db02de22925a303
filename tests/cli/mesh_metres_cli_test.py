#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests meshes in metres: GLB of stores in degrees and feet, and error-bounded meshes in another CRS.

TERRACE=path/to/terrace mesh_metres_cli_test.py
"""

import array
import json
import math
import os
import random
import subprocess
import tempfile
import unittest

from small_tiff import GEOGRAPHIC, utm, write_tiff

TERRACE = os.environ.get('TERRACE', 'terrace')
SURVEY_FOOT = 1200 / 3937
A, F = 6378137.0, 1 / 298.257223563
E2 = F * (2 - F)


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=200)


class Glb:
    """The single mesh of a file, read by the specification of glTF 2.0, with the node's translation applied."""

    def __init__(self, path):
        with open(path, 'rb') as file:
            data = file.read()
        size = int.from_bytes(data[12:16], 'little')
        self.json, body = json.loads(data[20:20 + size]), data[28 + size:]
        node = self.json['nodes'][0]
        self.translation = node.get('translation', [0, 0, 0])
        primitive = self.json['meshes'][0]['primitives'][0]
        self.raw = self._read(body, primitive['attributes']['POSITION'], 'f', 3)
        self.scene = [tuple(v + t for v, t in zip(p, self.translation)) for p in self.raw]
        corners = [c[0] for c in self._read(body, primitive['indices'], 'I', 1)]
        self.faces = [corners[i:i + 3] for i in range(0, len(corners), 3)]
        # East, north, up.
        self.vertices = [(x, -z, y) for x, y, z in self.scene]
        self.extras = self.json['asset'].get('extras')

    def _read(self, body, number, code, per_item):
        accessor = self.json['accessors'][number]
        view = self.json['bufferViews'][accessor['bufferView']]
        begin = view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
        stride = view.get('byteStride', 4 * per_item)
        return [tuple(array.array(code, body[at:at + 4 * per_item]))
                for at in range(begin, begin + stride * accessor['count'], stride)]

    def coordinates(self):
        """The coordinates in the CRS, computed as asset.extras prescribes."""
        origin, metres = self.extras['origin'], self.extras['metres_per_unit']
        return [(origin[0] + x / metres[0], origin[1] - z / metres[1], y / metres[2]) for x, y, z in self.scene]

    def to_enu(self, place):
        """Returns east, north and up of a place given in the CRS."""
        origin, metres = self.extras['origin'], self.extras['metres_per_unit']
        return tuple((p - o) * m for p, o, m in zip(place, origin, metres))


def read_ply(path):
    """Vertices and faces of an ASCII PLY file written by terrace."""
    with open(path, encoding='ascii') as file:
        head, body = file.read().split('end_header\n')
    lines, counts = body.splitlines(), {}
    for line in head.splitlines():
        words = line.split()
        if words[0] == 'element':
            counts[words[1]] = int(words[2])
    vertices = [tuple(map(float, line.split()[:3])) for line in lines[:counts['vertex']]]
    return vertices, [list(map(int, line.split()[1:4])) for line in lines[counts['vertex']:]]


def east_north_up(origin, place):
    """East, north and up of (longitude, latitude, height) about an origin, by EPSG 9602 and 9837."""
    def geocentric(longitude, latitude, height):
        longitude, latitude = math.radians(longitude), math.radians(latitude)
        n = A / math.sqrt(1 - E2 * math.sin(latitude) ** 2)
        return ((n + height) * math.cos(latitude) * math.cos(longitude),
                (n + height) * math.cos(latitude) * math.sin(longitude), (n * (1 - E2) + height) * math.sin(latitude))
    x, y, z = (p - o for p, o in zip(geocentric(*place), geocentric(*origin)))
    longitude, latitude = math.radians(origin[0]), math.radians(origin[1])
    sin_l, cos_l, sin_b, cos_b = (math.sin(longitude), math.cos(longitude), math.sin(latitude), math.cos(latitude))
    return (-sin_l * x + cos_l * y, -sin_b * cos_l * x - sin_b * sin_l * y + cos_b * z,
            cos_b * cos_l * x + cos_b * sin_l * y + sin_b * z)


def utm_32(longitude, latitude):
    """UTM zone 32 by Krueger's series in the third flattening, to a millimetre (EPSG Guidance Note 7-2)."""
    n = F / (2 - F)
    radius = A / (1 + n) * (1 + n ** 2 / 4 + n ** 4 / 64)
    alpha = (n / 2 - 2 * n ** 2 / 3 + 5 * n ** 3 / 16 + 41 * n ** 4 / 180, 13 * n ** 2 / 48 - 3 * n ** 3 / 5 + 557 * n ** 4 / 1440,
             61 * n ** 3 / 240 - 103 * n ** 4 / 140, 49561 * n ** 4 / 161280)
    sine, e = math.sin(math.radians(latitude)), math.sqrt(E2)
    t = math.sinh(math.atanh(sine) - e * math.atanh(e * sine))
    turn = math.radians(longitude - 9)
    xi, eta = math.atan2(t, math.cos(turn)), math.atanh(math.sin(turn) / math.sqrt(1 + t * t))
    terms = list(enumerate(alpha, 1))
    return (500000 + 0.9996 * radius * (eta + sum(a * math.cos(2 * j * xi) * math.sinh(2 * j * eta) for j, a in terms)),
            0.9996 * radius * (xi + sum(a * math.sin(2 * j * xi) * math.cosh(2 * j * eta) for j, a in terms)))


def measure(vertices, faces, samples):
    """Returns the largest vertical distance of samples from a mesh, and the samples that are on no triangle.
    Finds triangles through a grid over x and y."""
    low = [min(v[k] for v in vertices) for k in (0, 1)]
    high = [max(v[k] for v in vertices) for k in (0, 1)]
    side = 64

    def cell(value, k):
        return min(side - 1, max(0, int((value - low[k]) / (high[k] - low[k]) * side)))
    lists = {}
    for face in faces:
        corners = [vertices[i] for i in face]
        ranges = [range(cell(min(c[k] for c in corners), k), cell(max(c[k] for c in corners), k) + 1) for k in (0, 1)]
        for i in ranges[0]:
            for j in ranges[1]:
                lists.setdefault((i, j), []).append(corners)
    largest, uncovered = 0.0, []
    for x, y, z in samples:
        found = False
        for a, b, c in lists.get((cell(x, 0), cell(y, 1)), ()):
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
            v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
            if min(u, v, 1 - u - v) < -1e-9:
                continue
            found = True
            largest = max(largest, abs(u * a[2] + v * b[2] + (1 - u - v) * c[2] - z))
        if not found:
            uncovered.append((x, y, z))
    return largest, uncovered


def hill(x, y):
    return round(800 + 300 * math.sin(x / 9) * math.cos(y / 13) + 40 * math.sin(x * y / 90), 2)


class MetresTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def raster(self, keys, corner, cell, columns=90, rows=80, void=lambda x, y: False, name='dem'):
        """Builds a store of hills; returns it and its samples in the CRS."""
        heights = [-9999.0 if void(x, y) else hill(x, y) for y in range(rows) for x in range(columns)]
        write_tiff(self.path(name + '.tif'), columns, rows, heights, corner, cell, keys, nodata='-9999')
        result = terrace('build', self.path(name + '.tif'), '-o', self.path(name), '--block', 500, '-q')
        self.assertEqual(result.returncode, 0, result.stderr)
        # Heights rounded to float32.
        heights = array.array('f', heights)
        samples = [(corner[0] + (x + 0.5) * cell, corner[1] - (y + 0.5) * cell, heights[y * columns + x])
                   for y in range(rows) for x in range(columns) if not void(x, y)]
        return self.path(name), samples

    def mesh(self, store, name, *args, verb='mesh'):
        """Makes a mesh; returns the summary, the messages and the path."""
        out = self.path(name)
        quiet = terrace(verb, store, '-o', out, *args, '--force', '--json')
        self.assertEqual(quiet.returncode, 0, quiet.stderr)
        return json.loads(quiet.stdout), quiet.stderr, out

    KINDS = (('--level', 0), ('--level', 1), ('--focus', '8.02,46.02,8.04,46.04:0'), ('--max-error', 4),
             ('--max-points', 600), ('--max-error', 4, '--region', '8.02,46.02,8.06,46.06'))

    def test_glb_from_degrees_is_in_metres_about_its_centre(self):
        store, samples = self.raster(GEOGRAPHIC, (8, 46.1), 0.001)
        places = {(round(x, 6), round(y, 6)): z for x, y, z in samples}
        for how in self.KINDS:
            with self.subTest(how):
                summary, notes, path = self.mesh(store, 'dem.glb', *how)
                self.assertIn('in metres, as glTF requires, east and north of 8.0', notes)
                glb = Glb(path)
                self.assertEqual(glb.extras['crs'], 'EPSG:4326')
                self.assertEqual(summary['frame'], {k: glb.extras[k] for k in ('crs', 'origin', 'metres_per_unit')})
                origin = glb.extras['origin']
                self.assertTrue(8 < origin[0] < 8.09 and 46.02 < origin[1] < 46.1 and origin[2] == 0, origin)
                self.assertEqual([glb.translation[k] for k in (0, 2)], [0, 0])
                for (x, y, z), back in zip(glb.vertices, glb.coordinates()):
                    # Samples keep their heights; positions are within a millimetre on the ground.
                    self.assertLess(abs(places[round(back[0], 6), round(back[1], 6)] - z), 1e-3)
                    self.assertLess(abs(back[0] - round(back[0], 6)), 1e-8)
                    # Compared with the ellipsoid: away from the central parallel, lengths change by
                    # 0.1 %.
                    e, n, u = east_north_up(origin, back)
                    self.assertLess(abs(x - e), 4)
                    self.assertLess(abs(y - n), 4)
                    self.assertLess(abs(z - u), 4)
                width = max(v[0] for v in glb.vertices) - min(v[0] for v in glb.vertices)
                if how in (('--level', 0), ('--max-error', 4)):
                    self.assertAlmostEqual(width, 6884, delta=10)

    def test_the_bound_holds_for_the_rounded_file(self):
        store, samples = self.raster(GEOGRAPHIC, (8, 46.1), 0.001)
        for bound in 0.02, 4, 60:
            summary, _, path = self.mesh(store, 'dem.glb', '--max-error', bound)
            glb = Glb(path)
            largest, uncovered = measure(glb.vertices, glb.faces, [glb.to_enu(s) for s in samples])
            self.assertLessEqual(largest, bound * (1 + 1e-6))
            self.assertLessEqual(largest, summary['max_error'] + 1e-3)
            self.assertLess(len(uncovered), 300)  # at the border, by rounding

    def test_feet_become_metres_in_place(self):
        feet = {1024: 1, 1025: 1, 3072: 2229}
        store, samples = self.raster(feet, (6400000, 1900000), 30.0)
        for how in ('--level', 0), ('--max-error', 4):
            _, notes, path = self.mesh(store, 'dem.glb', *how)
            self.assertIn('in place of US survey feet', notes)
            glb = Glb(path)
            self.assertEqual(glb.extras['origin'], [0, 0, 0])
            for got, wanted in zip(glb.extras['metres_per_unit'], [SURVEY_FOOT] * 3):
                self.assertAlmostEqual(got, wanted, delta=1e-12)
            places = {(round(x), round(y)): z for x, y, z in samples}
            for (x, y, z), back in zip(glb.vertices, glb.coordinates()):
                self.assertLess(abs(places[round(back[0]), round(back[1])] - back[2]), 1e-3)
                self.assertAlmostEqual(x, back[0] * SURVEY_FOOT, delta=1e-6)
                self.assertAlmostEqual(z, back[2] * SURVEY_FOOT, delta=1e-6)

    def test_a_map_that_stretches_lengths_is_scaled_to_metres(self):
        store, _ = self.raster({1024: 1, 1025: 1, 3072: 3857}, (1000000, 8400000), 60.0)
        _, notes, path = self.mesh(store, 'dem.glb', '--max-error', 4)
        self.assertIn('in metres', notes)
        glb = Glb(path)
        # At 60 degrees north, a metre on the map is half a metre on the ground.
        self.assertAlmostEqual(glb.extras['metres_per_unit'][0], 0.5, delta=0.02)
        _, notes, _ = self.mesh(store, 'dem.ply', '--max-error', 4)
        self.assertIn('a map that stretches lengths to', notes)

    def test_metres_and_data_without_a_crs_are_unchanged(self):
        for name, keys in ('utm', utm(32)), ('none', None):
            store, samples = self.raster(keys, (500000, 5100000), 30.0, name=name)
            places = {(x, y): z for x, y, z in samples}
            for how in ('--level', 0), ('--max-error', 4):
                summary, notes, path = self.mesh(store, 'dem.glb', *how)
                self.assertEqual(notes, '')
                self.assertNotIn('frame', summary)
                glb = Glb(path)
                self.assertIsNone(glb.extras)
                for x, y, z in glb.vertices:
                    self.assertLess(abs(places[round(x), round(y)] - z), 1e-3)

    def test_across_the_antimeridian(self):
        store, _ = self.raster(GEOGRAPHIC, (179.97, -16), 0.001)
        for how in ('--max-error', 4), ('--level', 0):
            glb = Glb(self.mesh(store, 'dem.glb', *how)[2])
            self.assertLess(max(abs(v[0]) for v in glb.vertices), 5000)
            self.assertAlmostEqual(glb.extras['origin'][0], 180.015, delta=1e-3)
        # A store in metres, written in degrees.
        store, _ = self.raster(utm(60), (815000, 1700000), 100.0, name='fiji')
        for how in ('--max-error', 4), ('--level', 0):
            glb = Glb(self.mesh(store, 'dem.glb', '--to-crs', 'EPSG:4326', *how)[2])
            self.assertEqual(glb.extras['crs'], 'EPSG:4326')
            self.assertLess(max(abs(v[0]) for v in glb.vertices), 5000)

    def test_clouds_and_scans(self):
        luck = random.Random(1)
        with open(self.path('cloud.xyz'), 'w', encoding='ascii') as file:
            for _ in range(6000):
                x, y = luck.uniform(0, 90), luck.uniform(0, 80)
                file.write(f'{8 + x / 1000!r} {46.1 - y / 1000!r} {hill(x, y)!r}\n')
        cloud = self.path('cloud')
        self.assertEqual(terrace('build', self.path('cloud.xyz'), '--crs', 'EPSG:4326', '-o', cloud, '-q').returncode, 0)
        for verb, how in ('mesh', ('--max-error', 20)), ('mesh', ('--level', 0)), ('surface', ()):
            _, notes, path = self.mesh(cloud, 'cloud.glb', *how, verb=verb)
            self.assertIn('in metres, as glTF requires', notes)
            glb = Glb(path)
            self.assertAlmostEqual(max(v[0] for v in glb.vertices) - min(v[0] for v in glb.vertices), 6960, delta=40)
            self.assertLess(max(v[2] for v in glb.vertices), 1200)
        with open(self.path('cloud.xyz'), encoding='ascii') as file:
            samples = [tuple(map(float, line.split())) for line in file]
        summary, _, path = self.mesh(cloud, 'cloud.glb', '--max-error', 20)
        glb = Glb(path)
        largest, _ = measure(glb.vertices, glb.faces, [glb.to_enu(s) for s in samples])
        self.assertLessEqual(largest, 20.0001)
        self.assertAlmostEqual(largest, summary['max_error'], delta=1e-3)
        # With another CRS they are meshed in that CRS.
        there = [(*utm_32(x, y), z) for x, y, z in samples]
        for name in 'cloud.ply', 'cloud.glb':
            summary, _, path = self.mesh(cloud, name, '--max-error', 20, '--to-crs', 'EPSG:32632', '--format',
                                         'ply-ascii' if name.endswith('ply') else 'glb')
            glb = Glb(path) if name.endswith('glb') else None
            vertices, faces = (glb.vertices, glb.faces) if glb else read_ply(path)
            largest, uncovered = measure(vertices, faces, there)
            self.assertLessEqual(largest, 20.0001)
            self.assertAlmostEqual(largest, summary['max_error'], delta=1e-3)
            self.assertLess(len(uncovered), 30 if glb else 5)

    def test_heights_become_metres(self):
        """Heights in feet become metres, for a map in metres and without a CRS."""
        rows = '\n'.join(f'{i % 20 * 50},{i // 20 * 50},{i % 7 * 10}' for i in range(400))
        for unit, crs, most, note in (('ft', 'EPSG:32632', 60 * 0.3048, 'heights are converted from feet to metres'),
                                      ('ft', '', 60 * 0.3048, 'heights are converted from feet to metres'),
                                      ('m', 'EPSG:32632', 60, '')):
            with open(self.path('feet.csv'), 'w', encoding='ascii') as file:
                file.write(f'x,y,z ({unit})\n{rows}\n')
            store = self.path(unit + crs[-1:])
            self.assertEqual(terrace('build', self.path('feet.csv'), '-o', store, *(('--crs', crs) if crs else ()))
                             .returncode, 0)
            for how in ('--level', 0), ('--max-error', 0.01):
                _, notes, path = self.mesh(store, 'feet.glb', *how)
                self.assertAlmostEqual(max(v[2] for v in Glb(path).vertices), most, delta=1e-3)
                self.assertIn(note, notes)

    def test_an_unknown_unit_of_heights_is_noted(self):
        dem = self.path('strange.tif')
        write_tiff(dem, 8, 8, range(64), corner=(500000, 5200000), cell=10.0, keys=utm(32))
        with open(dem + '.aux.xml', 'w', encoding='ascii') as file:
            file.write('<PAMDataset><PAMRasterBand band="1"><UnitType>furlong</UnitType></PAMRasterBand></PAMDataset>')
        store = self.path('strange')
        self.assertEqual(terrace('build', dem, '-o', store).returncode, 0)
        for verb, how in ('mesh', ('--level', 0)), ('mesh', ('--max-error', 1)), ('surface', ()):
            for name in 'strange.glb', 'strange.ply':
                notes = self.mesh(store, name, *how, verb=verb)[1]
                self.assertEqual(notes.count('the unit of heights, "furlong", is not known'), 1, (verb, how, notes))

    def test_other_formats_note_that_units_differ(self):
        store, _ = self.raster(GEOGRAPHIC, (8, 46.1), 0.001)
        for name in 'dem.ply', 'dem.obj':
            for how in ('--level', 1), ('--max-error', 4):
                summary, notes, _ = self.mesh(store, name, *how)
                self.assertIn('x and y are degrees and heights metres', notes)
                self.assertIn('pass --to-crs EPSG:32632', notes)
                self.assertNotIn('frame', summary)
                _, notes, _ = self.mesh(store, name, *how, '--to-crs', 'EPSG:32632')
                self.assertEqual(notes, '')

    def test_a_bound_in_another_crs(self):
        def void(x, y):
            return math.hypot(x - 60, y - 30) < 12 or (x * 7 + y * 13) % 97 == 0
        # Rasters 0.13 and 2.6 degrees wide. In the wide one, rows of samples are curved in UTM.
        for cell in 0.001, 0.02:
            for holes in False, True:
                store, samples = self.raster(GEOGRAPHIC, (8, 60), cell, 130, 120, void if holes else lambda x, y: False,
                                             name=f'dem{cell}{holes}')
                there = [(*utm_32(x, y), z) for x, y, z in samples]
                for name, how in (('dem.ply', ('--max-error', 4)), ('dem.ply', ('--max-error', 60)),
                                  ('dem.glb', ('--max-error', 4)), ('dem.ply', ('--max-points', 3000))):
                    with self.subTest(cell=cell, holes=holes, name=name, how=how):
                        summary, _, path = self.mesh(store, name, *how, '--to-crs', 'EPSG:32632', '--format',
                                                     'ply-ascii' if name.endswith('ply') else 'glb')
                        glb = Glb(path) if name.endswith('glb') else None
                        vertices, faces = (glb.vertices, glb.faces) if glb else read_ply(path)
                        largest, uncovered = measure(vertices, faces, there)
                        if how[0] == '--max-error':
                            self.assertLessEqual(largest, how[1] + 1e-3)
                        self.assertLessEqual(largest, summary['max_error'] + 1e-3)
                        # Only samples at the border are not covered, because mesh edges are straight.
                        edge = {i for i, (x, y, _) in enumerate(samples)
                                if not (8 + cell < x < 8 + 129 * cell and 60 - 119 * cell < y < 60 - cell)}
                        missed_places = set(uncovered)
                        missed = {i for i, place in enumerate(there) if place in missed_places}
                        if not holes:
                            self.assertLessEqual(missed, edge)
                        # All triangles face up. With holes, none covers the middle of the lake.
                        middle = (*utm_32(8 + 60.5 * cell, 60 - 30.5 * cell), 0)
                        for face in faces:
                            a, b, c = (vertices[i] for i in face)
                            self.assertGreater((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0)
                        on_lake = len(measure(vertices, faces, [middle])[1]) == 0
                        self.assertEqual(on_lake, not holes)


if __name__ == '__main__':
    unittest.main()
