#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests build --entities: triangles and lines survive a store unchanged.

TERRACE=path/to/terrace entities_cli_test.py
"""

import collections
import json
import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / 'libstream/tests'))
import decode_store  # noqa: E402

TERRACE = os.environ.get('TERRACE', 'terrace')


def triangles_of(path):
    """The vertices of an OBJ, and the number of each triangle of three corners in file order."""
    vertices, triangles = [], collections.Counter()
    with open(path, encoding='ascii') as file:
        for line in file:
            words = line.split()
            if words and words[0] == 'v':
                vertices.append(struct.pack('<3d', *map(float, words[1:])))
            elif words and words[0] == 'f':
                triangles[tuple(vertices[int(word) - 1] for word in words[1:])] += 1
    return vertices, triangles


class EntitiesCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @staticmethod
    def terrace(*args, **options):
        return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120, **options)

    @classmethod
    def run_ok(cls, *args, **options):
        result = cls.terrace(*args, **options)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, expected, *args):
        result = self.terrace(*args)
        self.assertIn(result.returncode, (1, 2))
        self.assertIn(expected, result.stderr)
        self.assertLessEqual(len(result.stderr.splitlines()), 2, result.stderr)

    @staticmethod
    def content(store):
        result = {}
        for name in sorted(os.listdir(store)):
            with open(os.path.join(store, name), 'rb') as file:
                result[name] = file.read()
        return result


class TrianglesTest(EntitiesCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        seed = 5
        print('seed', seed)
        rng = random.Random(seed)
        # Shared vertices, duplicates, triangles without area and a negative zero, in no order.
        cls.vertices = [(rng.uniform(-1e3, 1e3), rng.uniform(0, 2e3), rng.choice([-0.0, 0.0, rng.random()]))
                        for _ in range(4000)]
        near = sorted(range(len(cls.vertices)), key=lambda v: (cls.vertices[v][0] // 100, cls.vertices[v][1]))
        cls.faces = []
        for _ in range(9000):
            at = rng.randrange(len(near) - 3)
            cls.faces.append([near[at + rng.randrange(4)] for _ in range(3)])
        cls.faces += cls.faces[:10]
        cls.file = cls.path('soup.obj')
        with open(cls.file, 'w', encoding='ascii') as file:
            file.writelines('v %r %r %r\n' % v for v in cls.vertices)
            file.writelines('f %d %d %d\n' % tuple(v + 1 for v in f) for f in cls.faces)
        cls.store = cls.path('soup.st')
        cls.summary = json.loads(cls.run_ok('build', cls.file, '--entities', 'triangles', '-o', cls.store, '--block', 1000,
                                            '--crs', 'EPSG:25832', '--json'))

    def test_triangles_come_back_bit_for_bit(self):
        self.assertEqual(self.summary['points'], len(self.faces))
        self.assertGreater(self.summary['levels'], 1)
        self.run_ok('verify', self.store)
        out = self.path('out.obj')
        summary = json.loads(self.run_ok('mesh', self.store, '-o', out, '--json'))
        vertices, triangles = triangles_of(out)
        self.assertTrue(triangles == triangles_of(self.file)[1])
        self.assertEqual((summary['vertices'], summary['triangles']), (len(vertices), len(self.faces)))
        self.assertEqual(len(set(vertices)), len(vertices))
        # In a table the corners are columns, which do not keep the sign of a zero.
        unsigned = collections.Counter()
        for corners, count in triangles.items():
            unsigned[tuple(struct.pack('<3d', *(x + 0.0 for x in struct.unpack('<3d', c))) for c in corners)] += count
        lines = self.run_ok('points', self.store, '--format', 'csv', '-o', '-').splitlines()
        self.assertEqual(lines[0].split(',')[:9], ['x', 'y', 'z', 'x2', 'y2', 'z2', 'x3', 'y3', 'z3'])
        table = collections.Counter()
        for line in lines[1:]:
            values = list(map(float, line.split(',')[:9]))
            table[tuple(struct.pack('<3d', *(x + 0.0 for x in values[k:k + 3])) for k in (0, 3, 6))] += 1
        self.assertTrue(table == unsigned)

    def test_levels_and_regions_are_subsets(self):
        out = self.path('part.obj')
        whole = triangles_of(self.file)[1]
        self.run_ok('mesh', self.store, '--level', 1, '-o', out)
        coarse = triangles_of(out)[1]
        self.assertTrue(0 < sum(coarse.values()) < len(self.faces) / 10)
        self.assertEqual(sum((coarse - whole).values()), 0)
        self.run_ok('mesh', self.store, '--region', '-500,300,250,1200', '-o', out, '--force')
        inside = collections.Counter()
        for corners, count in whole.items():
            x, y, _ = struct.unpack('<3d', corners[0])
            if -500 <= x <= 250 and 300 <= y <= 1200:
                inside[corners] += count
        self.assertTrue(triangles_of(out)[1] == inside)
        self.assertGreater(len(inside), 100)

    def test_match_tree_builds_a_bounding_volume_hierarchy(self):
        out = self.path('tree.csv')
        summary = json.loads(self.run_ok('match', self.file, '--tree', '--entities', 'triangles', '-o', out, '--json',
                                         '--method', 'monotone', '--iterations', 3))
        with open(out, encoding='ascii') as file:
            self.assertEqual(file.readline().strip(), 'a,b,distance,size,level,minx,miny,minz,maxx,maxy,maxz')
            rows = [line.strip().split(',') for line in file]
        self.assertEqual((summary['pairs'], len(rows)), (len(self.faces) - 1,) * 2)
        # Every node is a child once, and its box bounds the triangles below exactly.
        below = [frozenset([t]) for t in range(len(self.faces))]
        seen = collections.Counter()
        for row in rows:
            a, b = int(row[0]), int(row[1])
            seen.update((a, b))
            below.append(below[a] | below[b])
            corners = [self.vertices[v] for t in below[-1] for v in self.faces[t]]
            if len(below[-1]) > 64 and len(below[-1]) < len(self.faces):
                continue
            box = [low(c[axis] for c in corners) for low in (min, max) for axis in range(3)]
            self.assertTrue(box == list(map(float, row[5:])))
            self.assertEqual(int(row[3]), len(below[-1]))
        self.assertTrue(all(count == 1 for count in seen.values()) and len(seen) == 2 * len(self.faces) - 2)
        self.assertEqual(len(below[-1]), len(self.faces))
        self.assertGreater(summary['surface_area_cost'], 1)
        self.assertGreater(summary['depth'], 10)
        self.run_ok('match', self.file, '--tree', '--entities', 'triangles', '-o', out, '--force', '--method', 'monotone',
                    '--iterations', 1)
        self.expect_error('--entities triangles is for --tree', 'match', self.file, '--entities', 'triangles',
                          '-o', self.path('x.csv'))

    def test_the_store_does_not_depend_on_threads_and_pipes(self):
        for name, source, options in (('threads.st', self.file, ['--threads', 1]),
                                      ('pipe.st', '-', ['--input-format', 'obj'])):
            with open(self.file, encoding='ascii') as file:
                self.run_ok('build', source, '--entities', 'triangles', '-o', self.path(name), '--block', 1000,
                            '--crs', 'EPSG:25832', *options,
                            stdin=file)
            self.assertTrue(self.content(self.path(name)) == self.content(self.store), name)

    def test_options_that_need_points_say_so(self):
        for args in (['mesh', self.store, '--max-error', 1, '-o', self.path('x.ply')],
                     ['raster', self.store, '--cell', 10, '-o', self.path('x.tif')],
                     ['contour', self.store, '--interval', 1, '-o', self.path('x.geojson')],
                     ['profile', self.store, '--line', '0,0,100,100', '-o', self.path('x.csv')],
                     ['surface', self.store, '-o', self.path('x.ply')],
                     ['tile', self.store, '--zoom', '5', '-o', self.path('tiles')]):
            with self.subTest(args[0]):
                self.expect_error('holds triangles', *args)
        self.expect_error('leave out --metric', 'mesh', self.store, '--smooth', 'taubin:2', '-o', self.path('x.ply'))

    def test_pictures_show_the_triangles(self):
        store = self.path('unplaced.st')
        self.run_ok('build', self.file, '--entities', 'triangles', '-o', store)
        for name in (self.store, store):
            summary = json.loads(self.run_ok('render', name, '-o', self.path('soup.png'), '--force', '--json'))
            self.assertEqual(summary['triangles'], len(self.faces))
            self.assertIn('(first corner of each entity)\n', self.run_ok('info', name))

    def test_unusable_inputs_say_so(self):
        out = self.path('no.st')
        triangles = ['--entities', 'triangles', '-o', out]
        for options in (['--metric', 'squared'], ['--outlier-price', 1]):
            self.expect_error('--entities triangles', 'build', self.file, *triangles, *options)
        self.expect_error('have no property "x2"; they have none: leave out --channel', 'build', self.file, *triangles,
                          '--channel', 'x2:1')
        self.expect_error('-k is for points: --entities triangles excludes it', 'build', self.file, *triangles, '-k', 5)
        self.expect_error('"z3"', 'build', self.file, *triangles, '--drop', 'z3')
        table = self.path('points.xyz')
        with open(table, 'w', encoding='ascii') as file:
            file.write('0 0 0\n1 1 1\n')
        self.expect_error('has no triangles', 'build', table, *triangles)
        self.expect_error('do not support the kd-tree search', 'build', self.file, *triangles, '--strategy', 'kd-tree')
        self.assertFalse(os.path.exists(out))


class LinesTest(EntitiesCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        seed = 7
        print('seed', seed)
        rng = random.Random(seed)
        cls.lines = []
        for _ in range(1200):
            x, y, z = rng.uniform(2.6e6, 2.61e6), rng.uniform(1.2e6, 1.21e6), 100 * rng.random()
            line, flat = [], rng.random() < 0.5
            for _ in range(rng.choice([2, 3, 4, 5, 30, 100])):
                line.append([x, y] if flat else [x, y, z])
                x, y, z = x + rng.uniform(-50, 50), y + rng.uniform(-50, 50), rng.choice([z, -0.0, z + 1])
            if len(line) > 3 and rng.random() < 0.3:
                line.append(line[0])
            cls.lines.append(line)
        cls.file = cls.path('lines.geojson')
        features = [{'type': 'Feature', 'properties': {}, 'geometry': {'type': 'LineString', 'coordinates': line}}
                    for line in cls.lines]
        features.insert(5, {'type': 'Feature', 'properties': {}, 'geometry': {'type': 'Point', 'coordinates': [1, 2]}})
        with open(cls.file, 'w', encoding='ascii') as file:
            json.dump({'type': 'FeatureCollection', 'crs': {'type': 'name', 'properties': {'name': 'EPSG:2056'}},
                       'features': features}, file)
        cls.stores = {}
        for entities in ('segments', 'polylines'):
            cls.stores[entities] = cls.path(entities + '.st')
            cls.run_ok('build', cls.file, '--entities', entities, '-o', cls.stores[entities], '--block', 1000)

    @staticmethod
    def lines_of(text):
        """Counts lines as text, so that zeros keep their sign."""
        features = json.loads(text)['features']
        return ([repr([list(map(float, p)) for p in feature['geometry']['coordinates']]) for feature in features],
                [feature['properties']['line'] for feature in features])

    def test_lines_come_back_bit_for_bit(self):
        for entities, store in self.stores.items():
            with self.subTest(entities):
                self.run_ok('verify', store)
                text = self.run_ok('points', store, '-o', '-', '--format', 'geojson')
                lines, numbers = self.lines_of(text)
                self.assertTrue(lines == [repr([list(map(float, p)) for p in line]) for line in self.lines])
                self.assertEqual(numbers, list(range(len(self.lines))))
                self.assertIn('EPSG::2056', text)
        # Reading them again gives the same store.
        again = self.path('again.geojson')
        self.run_ok('points', self.stores['segments'], '-o', again)
        self.run_ok('build', again, '--entities', 'segments', '-o', self.path('again.st'), '--block', 1000)
        first, second = (self.content(s) for s in (self.stores['segments'], self.path('again.st')))
        self.assertTrue({k: v for k, v in first.items() if k != 'manifest.json'} ==
                        {k: v for k, v in second.items() if k != 'manifest.json'})

    def test_a_region_has_the_segments_that_begin_in_it(self):
        box = (2603000, 1203000, 2607000, 1206000)
        lines, _ = self.lines_of(self.run_ok('points', self.stores['segments'], '-o', '-', '--format', 'geojson',
                                             '--region', ','.join(map(str, box))))
        expected = []
        for line in self.lines:
            run = []
            for a, b in zip(line, line[1:]):
                if box[0] <= a[0] <= box[2] and box[1] <= a[1] <= box[3]:
                    run = run + [b] if run else [a, b]
                elif run:
                    expected.append(repr([list(map(float, p)) for p in run]))
                    run = []
            if run:
                expected.append(repr([list(map(float, p)) for p in run]))
        self.assertTrue(lines == expected)
        self.assertGreater(len(lines), 50)

    def test_pictures_show_the_lines(self):
        light = []
        for lines, options in ((len(self.lines), []), (len(self.lines), ['--color', 'height']), (1, ['--level', 'top'])):
            picture = self.path('lines.png')
            summary = json.loads(self.run_ok('render', self.stores['polylines'], '-o', picture, '--size', '300x300',
                                             '--force', '--json', *options))
            self.assertGreaterEqual(summary['lines'], lines)
            # A larger value means a lighter picture.
            light.append(json.loads(self.run_ok('info', picture, '--rgb', 'mapbox', '--json'))['height']['mean'])
        self.assertLess(light[0], light[2])

    def test_levels_are_subsets(self):
        all_lines = [repr([list(map(float, p)) for p in line])[1:-1] for line in self.lines]
        lines, numbers = self.lines_of(self.run_ok('points', self.stores['polylines'], '-o', '-', '--format', 'geojson',
                                                   '--level', 'top'))
        self.assertGreater(len(lines), 10)
        for line, number in zip(lines, numbers):
            self.assertTrue(line[1:-1] in all_lines[number])

    def test_other_coordinates(self):
        text = self.run_ok('points', self.stores['segments'], '-o', '-', '--format', 'geojson', '--to-crs', 'EPSG:4326')
        self.assertNotIn('"crs"', text)
        x, y = json.loads(text)['features'][0]['geometry']['coordinates'][0][:2]
        self.assertTrue(7 < x < 8 and 46 < y < 47, (x, y))

    def test_the_store_does_not_depend_on_threads_and_pipes(self):
        with open(self.file, encoding='ascii') as file:
            self.run_ok('build', '-', '--entities', 'polylines', '-o', self.path('pipe.st'), '--block', 1000, '--threads', 1,
                        stdin=file)
        self.assertTrue(self.content(self.path('pipe.st')) == self.content(self.stores['polylines']))

    def test_unsupported_options_are_refused(self):
        store = self.stores['segments']
        self.expect_error('holds segments', 'mesh', store, '-o', self.path('x.ply'))
        self.expect_error('holds segments', 'raster', store, '--cell', 10, '-o', self.path('x.tif'))
        self.expect_error('GeoJSON is for the lines', 'points', self.path('points.st'), '-o', self.path('x.geojson'))
        self.expect_error('has no lines', 'build', self.points_file(), '--entities', 'segments', '-o', self.path('no.st'))
        self.expect_error('has no triangles', 'build', self.file, '--entities', 'triangles', '-o', self.path('no.st'))
        self.expect_error('its polylines have no property "part"', 'build', self.file, '--entities', 'polylines', '-o',
                          self.path('no.st'), '--channel', 'part:1')
        self.expect_error('exists already', 'points', store, '-o', self.file)

    def points_file(self):
        table = self.path('points.xyz')
        with open(table, 'w', encoding='ascii') as file:
            file.write('0 0 0\n1 1 1\n')
        return table

    def setUp(self):
        if not os.path.exists(self.path('points.st')):
            self.run_ok('build', self.points_file(), '-o', self.path('points.st'), '--crs', 'EPSG:2056')


class PropertiesTest(EntitiesCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        seed = 31
        print('seed', seed)
        rng = random.Random(seed)
        cls.features = []
        for number in range(400):
            x, y = rng.uniform(0, 1000), rng.uniform(0, 1000)
            lines = [[[x + rng.uniform(-9, 9), y + rng.uniform(-9, 9)] for _ in range(rng.choice([2, 3, 6]))]
                     for _ in range(rng.choice([1, 1, 2]))]
            properties = {'name': 'road', 'tags': {'lanes': 9, 'list': [1, 2]}, 'lanes': number % 2 * 3 + 1,
                          'width "m"': rng.uniform(2, 9), 'bridge': True, 'line': 1000 + number, 'x2': -number, '': 2 ** 40}
            if number % 7 == 0:
                properties['lanes'] = None
            if number % 5 == 0:
                del properties['width "m"']
            cls.features.append({'type': 'Feature', 'properties': properties, 'geometry': {
                'type': 'MultiLineString', 'coordinates': lines}})
        cls.features.insert(3, {'type': 'Feature', 'properties': {'height': 8}, 'geometry': {
            'type': 'Point', 'coordinates': [1, 2]}})
        cls.file = cls.path('roads.geojson')
        cls.write(cls.file, cls.features)

    @staticmethod
    def write(name, features):
        with open(name, 'w', encoding='ascii') as file:
            json.dump({'type': 'FeatureCollection', 'crs': {'type': 'name', 'properties': {'name': 'EPSG:2056'}},
                       'features': features}, file)

    @staticmethod
    def expected(features):
        """Coordinates and numeric properties of each line, as they are written."""
        names = {'lanes': 'lanes', 'width "m"': 'width "m"', 'line': 'line_2', 'x2': 'x2_2', '': 'property'}
        return [(line, {new: feature['properties'].get(old) for old, new in names.items()})
                for feature in features if feature['geometry']['type'] != 'Point'
                for line in feature['geometry']['coordinates']]

    def written(self, store, *options):
        features = json.loads(self.run_ok('points', store, '-o', '-', '--format', 'geojson', *options))['features']
        lines = []
        for feature in features:
            del feature['properties']['line']
            lines.append((feature['geometry']['coordinates'], feature['properties']))
        return lines

    def test_properties_of_lines_come_back(self):
        for entities in ('segments', 'polylines'):
            store = self.path(entities + '.st')
            result = self.terrace('build', self.file, '--entities', entities, '-o', store, '--block', 200)
            self.assertEqual(result.returncode, 0, result.stderr)
            # The missing values of a feature count once.
            self.assertIn('138 attributes have no value', result.stderr)
            self.run_ok('verify', store)
            self.assertEqual(self.written(store), self.expected(self.features))
            # Reading the output again gives the same store.
            again = self.path(entities + '.geojson')
            self.run_ok('points', store, '-o', again)
            self.run_ok('build', again, '--entities', entities, '-o', self.path('again.st'), '--block', 200, '--force')
            first, second = (self.content(s) for s in (store, self.path('again.st')))
            self.assertTrue({k: v for k, v in first.items() if k != 'manifest.json'} ==
                            {k: v for k, v in second.items() if k != 'manifest.json'})

    def test_a_table_has_properties_as_columns(self):
        store = self.path('table.st')
        self.run_ok('build', self.file, '--entities', 'segments', '-o', store)
        lines = self.run_ok('points', store, '--where', 'lanes > 3', '-o', '-', '--format', 'csv').splitlines()
        self.assertEqual(lines[0].split(',')[:10], ['x', 'y', 'z', 'x2', 'y2', 'z2', 'line', 'part', 'vertices', 'dimensions'])
        lanes = lines[0].split(',').index('lanes')
        self.assertEqual({line.split(',')[lanes] for line in lines[1:]}, {'4'})
        wide = [f for f in self.features if f['properties'].get('lanes') == 4]
        self.assertEqual(len(lines) - 1, sum(len(line) - 1 for f in wide for line in f['geometry']['coordinates']))

    def test_channels_separate_lines(self):
        def mixed(name, weight):
            self.run_ok('build', self.file, '--entities', 'segments', '--where', 'lanes >= 1', '-o', self.path(name),
                        '--block', 300, '--facility-cost', 0.5, '--channel', f'lanes:{weight}')
            store = decode_store.Store(self.path(name))
            at = [a['name'] for a in store.manifest['attributes']].index('lanes')
            return sum(len(set(c.attributes[at])) > 1 for c in store.levels[0].clusters if c)
        self.assertEqual(mixed('apart.st', 1e6), 0)
        self.assertGreater(mixed('together.st', 0), 5)
        self.assertIn('channel lanes 1e+06', self.run_ok('info', self.path('apart.st')))
        self.expect_error('"lanes" of a point is not finite', 'build', self.file, '--entities', 'segments', '-o',
                          self.path('no.st'), '--channel', 'lanes:1', '--block', 300)

    def test_files_share_their_properties(self):
        other = self.path('other.geojson')
        self.write(other, [{'type': 'Feature', 'properties': {'speed': 50}, 'geometry': {
            'type': 'LineString', 'coordinates': [[0, 0], [1, 1]]}}])
        store = self.path('both.st')
        self.run_ok('build', self.file, other, '--entities', 'segments', '-o', store)
        lines = self.written(store)
        self.assertEqual(lines[-1][1], {'lanes': None, 'width "m"': None, 'line_2': None, 'x2_2': None, 'property': None,
                                        'speed': 50})
        self.assertEqual([p['speed'] for _, p in lines[:-1]], [None] * (len(lines) - 1))
        self.run_ok('build', self.file, '--entities', 'segments', '-o', store, '--force', '--keep', 'lanes')
        self.assertEqual(self.written(store), [(line, {'lanes': p['lanes']}) for line, p in self.expected(self.features)])

    def test_a_property_that_begins_late_is_named_or_an_error(self):
        # The head of the file is the first 2 MiB.
        late = self.path('late.geojson')
        features = [{'type': 'Feature', 'properties': {'a': 1, 'text': 'x' * 4000}, 'geometry': {
            'type': 'LineString', 'coordinates': [[k, 0], [k, 1]]}} for k in range(600)]
        features[-1]['properties']['b'] = 7
        self.write(late, features)
        build = ['build', late, '--entities', 'segments', '-o', self.path('late.st'), '--force']
        self.expect_error("the number 'b' is not among the properties of the first features", *build)
        self.run_ok(*build, '--keep', 'a,b')
        values = [p for _, p in self.written(self.path('late.st'))]
        self.assertEqual((values[-1], values[0]), ({'a': 1, 'b': 7}, {'a': 1, 'b': None}))
        self.run_ok(*build, '--drop', 'b')
        self.assertEqual([p for _, p in self.written(self.path('late.st'))], [{'a': 1}] * 600)

    def test_properties_of_faces_come_back(self):
        rng = random.Random(37)
        vertices = [(rng.randrange(100) / 4, rng.randrange(100) / 4, rng.randrange(9) / 2) for _ in range(300)]
        faces = [([rng.randrange(300) for _ in range(rng.choice([3, 3, 4]))], rng.randrange(256), rng.randrange(-9, 9) / 4,
                  rng.randrange(-30000, 30000)) for _ in range(500)]
        header = ('ply\nformat %s 1.0\nelement vertex 300\nproperty double x\nproperty double y\nproperty double z\n'
                  'element face 500\nproperty uchar red\nproperty list uchar int vertex_indices\nproperty float x2\n'
                  'property list uchar short other\nproperty short part\nend_header\n')
        text, binary = self.path('text.ply'), self.path('binary.ply')
        with open(text, 'w', encoding='ascii') as file:
            file.write(header % 'ascii')
            file.writelines('%r %r %r\n' % v for v in vertices)
            file.writelines('%d %d %s %r 1 5 %d\n' % (red, len(f), ' '.join(map(str, f)), x, part) for f, red, x, part in faces)
        with open(binary, 'wb') as file:
            file.write((header % 'binary_big_endian').encode())
            for v in vertices:
                file.write(struct.pack('>3d', *v))
            for f, red, x, part in faces:
                file.write(struct.pack('>BB%difBhh' % len(f), red, len(f), *f, x, 1, 5, part))
        expected = collections.Counter()
        for f, red, x, part in faces:
            for k in range(2, len(f)):
                expected[(*vertices[f[0]], *vertices[f[k - 1]], *vertices[f[k]], red, x, part)] += 1
        for number, source in enumerate((text, binary)):
            store = self.path(f'faces{number}.st')
            self.run_ok('build', source, '--entities', 'triangles', '-o', store, '--block', 200, '--channel', 'red:0.1')
            self.assertIn('red uint8, x2_2 float32, part int16', self.run_ok('info', store))
            rows = self.run_ok('points', store, '-o', '-', '--format', 'csv').splitlines()
            self.assertEqual(rows[0].split(',')[9:], ['red', 'x2_2', 'part'])
            self.assertTrue(collections.Counter(tuple(map(float, row.split(','))) for row in rows[1:]) == expected)
        self.assertTrue({k: v for k, v in self.content(self.path('faces0.st')).items() if k != 'manifest.json'} ==
                        {k: v for k, v in self.content(self.path('faces1.st')).items() if k != 'manifest.json'})


if __name__ == '__main__':
    unittest.main()
