#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the verb `surface` end to end.

TERRACE=path/to/terrace surface_cli_test.py
"""

import collections
import json
import math
import os
import random
import struct
import subprocess
import tempfile
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
RADIUS = 10.0


def terrace(*args):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120)


def sphere(count):
    """Evenly spread points of a sphere, on a spiral."""
    points = []
    for k in range(count):
        z = 1 - (2 * k + 1) / count
        angle = k * math.pi * (3 - math.sqrt(5))
        r = math.sqrt(1 - z * z)
        points.append((RADIUS * r * math.cos(angle), RADIUS * r * math.sin(angle), RADIUS * z))
    return points


class SurfaceTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        with open(cls.path('ball.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x, y, z in sphere(3000))
        cls.store = cls.path('ball.terrace')
        result = terrace('build', cls.path('ball.xyz'), '-o', cls.store, '--block', 1000)
        assert result.returncode == 0, result.stderr

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    def surface(self, name, *options):
        out = self.path(name)
        result = terrace('surface', self.store, '-o', out, '--json', '--force', *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), out

    def read_obj(self, path):
        vertices, faces = [], []
        with open(path) as file:
            for line in file:
                words = line.split()
                if words[:1] == ['v']:
                    vertices.append(tuple(map(float, words[1:4])))
                elif words[:1] == ['f']:
                    faces.append([int(word.split('/')[0]) - 1 for word in words[1:4]])
        return vertices, faces

    def noisy_ball(self):
        """A store of the ball with noise of up to 0.3 along its radii."""
        store = self.path('noisy.terrace')
        if not os.path.exists(store):
            random_numbers = random.Random(1)
            with open(self.path('noisy.xyz'), 'w') as file:
                for place in sphere(3000):
                    factor = 1 + 0.03 * random_numbers.uniform(-1, 1)
                    file.write('{} {} {}\n'.format(*(factor * x for x in place)))
            self.assertEqual(terrace('build', self.path('noisy.xyz'), '-o', store).returncode, 0)
        return store

    def test_smoothing_removes_noise_within_the_limit(self):
        def surface(name, *options):
            result = terrace('surface', self.noisy_ball(), '-o', self.path(name), '--json', '--force', *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            return json.loads(result.stdout), *self.read_obj(self.path(name))

        summary, rough, faces = surface('rough.obj')
        self.assertNotIn('moves', summary)

        def error(vertices):
            return sum(abs(math.hypot(*v) - RADIUS) for v in vertices) / len(vertices)

        for options in (['taubin'], ['bilateral'], ['taubin:3', '--smooth-limit', 0.1], ['bilateral:2', '--smooth-limit', 0.05]):
            summary, smooth, same_faces = surface('smooth.obj', '--smooth', *options)
            self.assertEqual(same_faces, faces)
            moved = [math.dist(a, b) for a, b in zip(rough, smooth)]
            moves = summary['moves']
            self.assertAlmostEqual(moves['largest'], max(moved), places=9)
            self.assertAlmostEqual(moves['mean'], sum(moved) / len(moved), places=9)
            self.assertLessEqual(max(moved), moves['limit'])
            self.assertTrue(summary['closed'])
            if '--smooth-limit' in options:
                self.assertEqual(moves['limit'], options[2])
                self.assertEqual(moves['limited'], sum(m > options[2] - 1e-9 for m in moved))
                self.assertGreater(moves['limited'], 0)
            else:
                self.assertLess(error(smooth), 0.6 * error(rough))
                self.assertAlmostEqual(summary['volume'], 4 / 3 * math.pi * RADIUS ** 3, delta=50)
            # Threads do not change a byte.
            surface('one.obj', '--smooth', *options, '--threads', 1)
            with open(self.path('one.obj')) as one, open(self.path('smooth.obj')) as other:
                self.assertEqual(one.read(), other.read())
        result = terrace('surface', self.noisy_ball(), '-o', self.path('smooth.ply'), '--smooth', 'taubin', '--smooth-limit', 0.1)
        self.assertRegex(result.stderr, r'smoothed: vertices moved by 0\.\d+ m, at most 0\.1 m; [\d,]+ stopped at the limit of 0\.1 m')

    def test_normals_are_written_in_every_format(self):
        plain, _ = self.surface('plain.obj')
        summary, out = self.surface('normals.obj', '--normals')
        self.assertEqual(summary['vertices'], plain['vertices'])
        vertices, faces = self.read_obj(out)
        self.assertEqual((vertices, faces), self.read_obj(self.path('plain.obj')))
        with open(out) as file:
            normals = [tuple(map(float, line.split()[1:])) for line in file if line.startswith('vn ')]
        self.assertEqual(len(normals), len(vertices))

        def check(normals):
            for n, p in zip(normals, vertices):
                self.assertAlmostEqual(math.hypot(*n), 1, places=6)
                self.assertGreater(sum(x * y for x, y in zip(n, p)) / math.hypot(*p), 0.99)

        check(normals)
        _, out = self.surface('normals.ply', '--normals', '--format', 'ply-ascii')
        with open(out) as file:
            head, body = file.read().split('end_header\n')
        self.assertIn('property float level\nproperty float nx\nproperty float ny\nproperty float nz\n', head)
        rows = [line.split() for line in body.splitlines()[:len(vertices)]]
        self.assertEqual([tuple(map(float, row[4:])) for row in rows], normals)
        _, out = self.surface('normals.glb', '--normals')
        with open(out, 'rb') as file:
            data = file.read()
        size = struct.unpack_from('<I', data, 12)[0]
        scene = json.loads(data[20:20 + size])
        accessor = scene['accessors'][scene['meshes'][0]['primitives'][0]['attributes']['NORMAL']]
        self.assertEqual((accessor['type'], accessor['count']), ('VEC3', len(vertices)))
        stride = scene['bufferViews'][0]['byteStride']
        stored = [struct.unpack_from('<3f', data, 28 + size + accessor['byteOffset'] + i * stride) for i in range(len(vertices))]
        check([(x, -z, y) for x, y, z in stored])
        # A picture of the file does not change.
        self.assertEqual(terrace('render', self.path('normals.ply'), '-o', self.path('normals.png'), '--size', '64x64').returncode, 0)

    def test_the_surface_of_a_ball_is_closed_and_faces_outward(self):
        summary, out = self.surface('ball.obj')
        vertices, faces = self.read_obj(out)
        self.assertEqual((summary['vertices'], summary['triangles']), (len(vertices), len(faces)))
        self.assertEqual((len(vertices), len(faces)), (3000, 5996))
        self.assertTrue(summary['closed'])
        self.assertEqual((summary['components'], summary['euler_characteristic']), (1, 2))
        self.assertAlmostEqual(summary['area'], 4 * math.pi * RADIUS ** 2, delta=10)
        directed = collections.Counter()
        volume = 0.0
        for a, b, c in faces:
            directed.update([(a, b), (b, c), (c, a)])
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
            volume += (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6
        self.assertTrue(all(directed[b, a] == count for (a, b), count in directed.items()))
        self.assertAlmostEqual(volume, 4 / 3 * math.pi * RADIUS ** 3, delta=40)
        self.assertAlmostEqual(volume, summary['volume'], places=6)

    def test_a_simplified_surface_keeps_its_bound_and_stays_closed(self):
        full, _ = self.surface('full.obj')
        summary, out = self.surface('light.obj', '--max-error', 0.5)
        vertices, faces = self.read_obj(out)
        self.assertEqual((summary['vertices'], summary['triangles']), (len(vertices), len(faces)))
        self.assertLess(len(vertices), 200)
        self.assertEqual((summary['full_vertices'], summary['full_triangles']), (3000, 5996))
        self.assertEqual(summary['full_volume'], full['volume'])
        self.assertTrue(0 < summary['max_error'] <= 0.5)
        self.assertTrue(summary['closed'])
        self.assertEqual((summary['components'], summary['euler_characteristic']), (1, 2))
        # All vertices are on the ball, so a triangle is farthest from it at the foot of the perpendicular from its
        # centre. The full surface is within 0.01 of the ball.
        for a, b, c in faces:
            u = [q - p for p, q in zip(vertices[a], vertices[b])]
            v = [q - p for p, q in zip(vertices[a], vertices[c])]
            n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
            depth = RADIUS - sum(p * q for p, q in zip(vertices[a], n)) / math.hypot(*n)
            self.assertLess(depth, 0.75)  # that foot may be outside the triangle, and some places are measured only
        few, _ = self.surface('few.obj', '--max-points', 40)
        self.assertEqual(few['vertices'], 40)
        self.assertGreater(few['max_error'], summary['max_error'])
        result = terrace('surface', self.store, '-o', self.path('few.ply'), '--max-points', 40, '--normals')
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(self.path('few.ply'), 'rb') as file:
            header = file.read(400)
        self.assertIn(b'element vertex 40\n', header)
        self.assertIn(b' nx\n', header)
        result = terrace('surface', self.store, '-o', self.path('light.obj'), '--force', '--max-error', 0.5)
        self.assertIn(' m of the full surface with 3,000 vertices', result.stderr)
        for wrong, text in ((['--max-error', 1, '--max-points', 9], 'not both'), (['--max-points', 3], 'at least 4'),
                            (['--max-error', 1, '--level', 1], 'exclude --level'),
                            (['--max-error', 1, '--tetrahedra'], 'not for the tetrahedra')):
            ending = '.vtk' if '--tetrahedra' in wrong else '.obj'
            result = terrace('surface', self.store, '-o', self.path('wrong' + ending), *wrong)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(text, result.stderr)
            self.assertFalse(os.path.exists(self.path('wrong' + ending)))

    def test_an_open_scan_is_left_open_and_the_summary_says_so(self):
        with open(self.path('bowl.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x, y, z in sphere(6000) if z < 3)
        store = self.path('bowl.terrace')
        result = terrace('build', self.path('bowl.xyz'), '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        result = terrace('surface', store, '-o', self.path('bowl.obj'), '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        summary = json.loads(result.stdout)
        self.assertEqual((summary['open_scan'], summary['closed']), (True, False))
        self.assertEqual((summary['components'], summary['euler_characteristic']), (1, 1))
        self.assertLess(summary['samples_off'], 10)
        self.assertAlmostEqual(summary['area'], 2 * math.pi * RADIUS * 13, delta=20)
        result = terrace('surface', store, '-o', self.path('bowl.obj'), '--force')
        self.assertIn('open, 1 part, without the faces over the gaps of the scan', result.stderr)
        closed, _ = self.surface('ball.obj')
        self.assertEqual((closed['open_scan'], closed['samples_off'], closed['lids']), (False, 0, 0))
        # A small opening is closed, and the summary says so.
        with open(self.path('jar.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x, y, z in sphere(6000) if z < 9)
        self.assertEqual(terrace('build', self.path('jar.xyz'), '-o', self.path('jar.terrace')).returncode, 0)
        result = terrace('surface', self.path('jar.terrace'), '-o', self.path('jar.obj'))
        self.assertRegex(result.stderr, r'triangles \(\d+ over gaps of the scan\), closed, 1 part')

    def test_a_focus_makes_one_part_fine(self):
        coarse, _ = self.surface('coarse.ply', '--level', 'top')
        mixed, _ = self.surface('mixed.ply', '--level', 'top', '--focus', '0,0,0,11,11,11:0')
        fine, _ = self.surface('fine.ply')
        self.assertLess(coarse['vertices'], mixed['vertices'])
        self.assertLess(mixed['vertices'], fine['vertices'])

    def test_other_criteria_find_the_same_surface(self):
        for criterion in ('gabriel', 'edge:1', 'advancing-front', 'alpha-wrap', 'alpha-wrap:2'):
            summary, _ = self.surface('other.ply', '--criterion', criterion)
            self.assertGreater(summary['triangles'], 100)
            self.assertAlmostEqual(summary['area'], 4 * math.pi * RADIUS ** 2, delta=300)

    def test_tetrahedra_fill_the_volume(self):
        summary, out = self.surface('ball.vtk', '--tetrahedra')
        with open(out, 'rb') as file:
            data = file.read()
        head, data = data.split(b'POINTS ', 1)
        self.assertIn(b'BINARY\nDATASET UNSTRUCTURED_GRID', head)
        line, data = data.split(b'\n', 1)
        count = int(line.split()[0])
        points = [struct.unpack('>3d', data[24 * k:24 * k + 24]) for k in range(count)]
        line, data = data[24 * count:].split(b'CELLS ', 1)[1].split(b'\n', 1)
        cells, numbers = map(int, line.split())
        self.assertEqual((cells, numbers), (summary['tetrahedra'], 5 * summary['tetrahedra']))
        volume = 0.0
        for k in range(cells):
            four, a, b, c, d = struct.unpack('>5i', data[20 * k:20 * k + 20])
            self.assertEqual(four, 4)
            u, v, w = ([x - y for x, y in zip(points[p], points[a])] for p in (b, c, d))
            volume += (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                       u[2] * (v[0] * w[1] - v[1] * w[0])) / 6
        self.assertAlmostEqual(volume, summary['volume'], places=6)
        rest = data[20 * cells:]
        self.assertTrue(rest.startswith(f'\nCELL_TYPES {cells}\n'.encode()))
        self.assertIn(f'\nPOINT_DATA {count}\nSCALARS level unsigned_char 1\n'.encode(), rest)

    def test_a_cluster_is_as_a_store_of_its_points(self):
        levels = json.loads(terrace('info', self.store, '--json').stdout)['levels']
        self.assertGreater(len(levels), 1)
        part = self.path('part.terrace')
        samples = 0
        for number in range(levels[1]['clusters']):
            cluster = f'1:{number}'
            result = terrace('points', self.store, '--cluster', cluster, '--level', 0, '-o', self.path('part.ply'), '--json', '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            samples += json.loads(result.stdout)['vertices']
            if number % 5 > 0:
                continue
            result = terrace('build', self.path('part.ply'), '-o', part, '--force')
            self.assertEqual(result.returncode, 0, result.stderr)
            # A huge factor keeps all tetrahedra.
            for options in (['--tetrahedra'], ['--tetrahedra', '--criterion', 'edge:1e9'], []):
                ending = 'vtk' if options else 'obj'
                summaries = []
                for store, chosen in ((self.store, ['--cluster', cluster, '--level', 0]), (part, [])):
                    result = terrace('surface', store, *chosen, '-o', self.path('part.' + ending), '--json', '--force', *options)
                    self.assertEqual(result.returncode, 0, result.stderr)
                    summary = json.loads(result.stdout)
                    summaries.append({key: summary[key] for key in ('vertices', 'tetrahedra', 'triangles', 'area', 'volume',
                                                                    'components', 'samples_off') if key in summary})
                for key, value in summaries[0].items():
                    self.assertAlmostEqual(summaries[1][key], value, places=6, msg=f'{cluster} {options} {key}')
        self.assertEqual(samples, 3000)

    def test_a_cluster_excludes_what_it_replaces(self):
        out = self.path('none.ply')
        for code, message, options in (
                (2, '--region', ['--region', '0,0,1,1']), (2, '--focus', ['--focus', '0,0,1,1:0']),
                (2, 'give --level 0', ['--max-error', 0.1]),
                (2, 'a cluster of level 0 has no points of level 1', ['--level', 1]),
                (1, 'no point of the cluster meets the condition', ['--where', f'x < {-RADIUS} || x == 9.99 * y'])):
            cluster = '0:0' if '--level' in options else '1:0'
            result = terrace('surface', self.store, '-o', out, '--cluster', cluster, *options)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)
            self.assertFalse(os.path.exists(out))
        for cluster in ('0:99999', '9:0', '1'):
            self.assertNotEqual(terrace('surface', self.store, '-o', out, '--cluster', cluster).returncode, 0)
        light, _ = self.surface('light.ply', '--cluster', '1:0', '--level', 0, '--max-error', 1)
        self.assertGreater(light['full_vertices'], light['vertices'])

    def write_metric(self, name, **region):
        with open(self.path(name), 'w') as file:
            json.dump({'regions': [region]}, file)
        return 'elliptical:' + self.path(name)

    def test_samples_of_a_stretched_torus_need_its_metric(self):
        # Thirty times as far apart along one of the rotated axes.
        count, stretch, c, s = 3000, 30, 0.6, 0.8
        with open(self.path('torus.xyz'), 'w') as file:
            for i in range(count):
                u, v = 2 * math.pi * (i * 0.6180339887498949 % 1), 2 * math.pi * i / count
                r = 1 + 0.4 * math.cos(v)
                x, y, z = r * math.cos(u), stretch * r * math.sin(u), 0.4 * math.sin(v)
                file.write(f'{c * x - s * y} {s * x + c * y} {z}\n')
        store = self.path('torus.terrace')
        result = terrace('build', self.path('torus.xyz'), '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        volume = 2 * math.pi ** 2 * 0.16 * stretch
        by_angle = self.write_metric('angle.json', semi_axes=[1, stretch, 1],
                                     angle=math.degrees(math.atan2(s, c)))
        by_rotation = self.write_metric('rotation.json', semi_axes=[1, 1, stretch],
                                        rotation=[[c, s, 0], [0, 0, 1], [-s, c, 0]])
        for metric in (by_angle, by_rotation):
            for options in ([], ['--criterion', 'gabriel'], ['--tetrahedra']):
                out = self.path('torus.vtk' if '--tetrahedra' in options else 'torus.obj')
                result = terrace('surface', store, '-o', out, '--json', '--force', '--metric', metric,
                                 *options)
                self.assertEqual(result.returncode, 0, result.stderr)
                summary = json.loads(result.stdout)
                self.assertTrue(summary['closed'])
                self.assertAlmostEqual(summary['volume'], volume, delta=0.05 * volume)
                if options == []:
                    self.assertEqual((summary['vertices'], summary['euler_characteristic']), (count, 0))
        plain = terrace('surface', store, '-o', self.path('torus.obj'), '--json', '--force')
        self.assertGreater(abs(json.loads(plain.stdout)['volume'] - volume), 0.1 * volume)

    def test_the_metric_of_a_sphere_changes_nothing(self):
        metric = self.write_metric('sphere.json', semi_axes=[2, 2, 2], angle=0)
        self.surface('plain.obj')
        self.surface('metric.obj', '--metric', metric)
        with open(self.path('plain.obj')) as plain, open(self.path('metric.obj')) as other:
            self.assertEqual(plain.read(), other.read())

    def test_regions_and_outputs_in_another_crs(self):
        # The ball is on the central meridian of a UTM zone, at 47 degrees north.
        north, scale = 5205000.0, 111170.0
        with open(self.path('utm.xyz'), 'w') as file:
            file.writelines(f'{500000 + x} {north + y} {z}\n' for x, y, z in sphere(3000))
        store = self.path('utm.terrace')
        result = terrace('build', self.path('utm.xyz'), '-o', store, '--crs', 'EPSG:32632')
        self.assertEqual(result.returncode, 0, result.stderr)

        def surface(name, *options):
            out = self.path(name)
            result = terrace('surface', store, '-o', out, '--json', '--force', *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            return json.loads(result.stdout), out

        plain, out = surface('plane.obj')
        vertices, faces = self.read_obj(out)
        there, out = surface('degrees.ply', '--format', 'ply-ascii', '--to-crs', 'EPSG:4326')
        self.assertEqual({**plain, 'seconds': 0, 'peak_rss_bytes': 0},
                         {**there, 'seconds': 0, 'peak_rss_bytes': 0})
        with open(out) as file:
            lines = file.read().split('end_header\n')[1].splitlines()
        moved = [tuple(map(float, line.split()[:3])) for line in lines[:len(vertices)]]
        self.assertEqual([tuple(map(int, line.split()[1:4])) for line in lines[len(vertices):]],
                         [tuple(face) for face in faces])
        middle = sum(y for _, y, _ in moved) / len(moved)
        self.assertAlmostEqual(middle, 46.99, delta=0.1)
        for (x, y, z), (lon, lat, height) in zip(vertices, moved):
            self.assertAlmostEqual(height, z, delta=1e-5)
            self.assertAlmostEqual((lon - 9) * scale * math.cos(math.radians(middle)), x - 500000,
                                   delta=0.05)
            self.assertAlmostEqual((lat - middle) * scale, y - north, delta=0.05)
        # The eastern half, by longitude.
        half, out = surface('half.obj', '--region', '9,46,10,48', '--region-crs', 'EPSG:4326')
        self.assertTrue(all(x > 499999 for x, _, _ in self.read_obj(out)[0]))
        self.assertTrue(1400 < half['vertices'] < 1700, half)
        tetrahedra, _ = surface('degrees.vtk', '--tetrahedra', '--to-crs', 'EPSG:4326')
        self.assertAlmostEqual(tetrahedra['volume'], plain['volume'], places=6)
        own = ('GEOGCS["own",DATUM["own datum",SPHEROID["own",6377000,300]],PRIMEM["Greenwich",0],'
               'UNIT["degree",0.0174532925199433]]')
        result = terrace('surface', store, '-o', self.path('none.ply'), '--to-crs', own)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('--towgs84', result.stderr)

    def test_points_in_a_plane_enclose_nothing(self):
        with open(self.path('plane.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {x + 2 * y}\n' for x in range(20) for y in range(20))
        store = self.path('plane.terrace')
        result = terrace('build', self.path('plane.xyz'), '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name, options in (('plane.ply', []), ('plane.vtk', ['--tetrahedra'])):
            result = terrace('surface', store, '-o', self.path(name), *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn("the points enclose no volume, as if all were in one plane; 'terrace mesh'", result.stderr)

    def test_collinear_and_coincident_points_are_reported(self):
        for name, place, message in (('line', lambda i: (i / 10, -i / 10, i / 3), 'all are on a line'),
                                     ('place', lambda i: (0.1, 0.2, 0.3), 'all are at one place')):
            with open(self.path(name + '.xyz'), 'w') as file:
                file.writelines('{} {} {}\n'.format(*place(i)) for i in range(20))
            store = self.path(name + '.terrace')
            self.assertEqual(terrace('build', self.path(name + '.xyz'), '-o', store).returncode, 0)
            for ending, options in (('.ply', []), ('.vtk', ['--tetrahedra'])):
                result = terrace('surface', store, '-o', self.path(name + ending), *options)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn('the points enclose no volume, ' + message, result.stderr)

    def test_an_empty_surface_is_not_closed_and_its_samples_are_counted(self):
        with open(self.path('pair.xyz'), 'w') as file:
            file.write('0 0 0\n1 2 3\n1 2 3\n')
        self.assertEqual(terrace('build', self.path('pair.xyz'), '-o', self.path('pair.terrace')).returncode, 0)
        for criterion in ('poles', 'advancing-front'):
            result = terrace('surface', self.path('pair.terrace'), '-o', self.path('pair.ply'), '--force', '--criterion', criterion)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn('0 vertices, 0 triangles, 2 samples not on it in', result.stderr)
        result = terrace('render', self.path('pair.terrace'), '--where', 'x == 0', '-o', self.path('one.png'))
        self.assertIn('1 point, 0 triangles', result.stderr)

    def test_coincident_samples_count_once_for_every_criterion(self):
        with open(self.path('twice.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x, y, z in 2 * sphere(500))
        self.assertEqual(terrace('build', self.path('twice.xyz'), '-o', self.path('twice.terrace')).returncode, 0)
        for criterion in ('poles', 'advancing-front'):
            result = terrace('surface', self.path('twice.terrace'), '-o', self.path('twice.ply'), '--force', '--json',
                             '--criterion', criterion)
            self.assertEqual(json.loads(result.stdout)['samples_off'], 0, criterion)

    def test_a_factor_that_keeps_nothing_is_not_reported_as_a_plane(self):
        with open(self.path('block.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {z}\n' for x in range(5) for y in range(5) for z in range(5))
        self.assertEqual(terrace('build', self.path('block.xyz'), '-o', self.path('block.terrace')).returncode, 0)
        result = terrace('surface', self.path('block.terrace'), '-o', self.path('block.ply'), '--criterion', 'edge')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('--criterion edge keeps no tetrahedron', result.stderr)
        self.assertNotIn('plane', result.stderr)

    def test_mesh_of_a_scan_suggests_surface(self):
        result = terrace('mesh', self.store, '-o', self.path('over_xy.ply'))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("'terrace surface' makes the surface of a scan", result.stderr)

    def test_an_empty_selection_is_an_error(self):
        store = self.path('plane0.terrace')
        with open(self.path('plane0.xyz'), 'w') as file:
            file.writelines(f'{x} {y} {x * y % 7}\n' for x in range(20) for y in range(20))
        result = terrace('build', self.path('plane0.xyz'), '-o', store)
        self.assertEqual(result.returncode, 0, result.stderr)
        out = self.path('nothing.ply')
        for message, options in (
                ('no point is in the region; the points have x from 0 to 19, y from 0 to 19, z from 0 to 6',
                 ['--region', '50,50,60,60']),
                ("no point meets the condition 'z < 0'", ['--where', 'z < 0'])):
            for criterion in ('poles', 'advancing-front', 'alpha-wrap'):
                result = terrace('surface', store, '-o', out, '--criterion', criterion, *options)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn(message, result.stderr)
                self.assertFalse(os.path.exists(out))

    def test_errors_are_one_line(self):
        boxed = self.write_metric('boxed.json', box=[0, 0, 1, 1], semi_axes=[2, 1])
        round_one = self.write_metric('round.json', semi_axes=[1, 1])
        out = self.path('none.ply')
        for code, options in ((2, ['--criterion', 'best']), (2, ['--criterion', 'edge:-1']),
                              (2, ['--criterion', 'gabriel:1']), (2, ['--tetrahedra']),
                              (2, ['--smooth', 'laplacian']), (2, ['--smooth', 'taubin:0']),
                              (2, ['--smooth-limit', 1]), (2, ['--smooth', 'taubin', '--smooth-limit', -1]),
                              (2, ['--level', 9]), (1, ['--memory', '1M']), (2, ['--metric', boxed]),
                              (2, ['--metric', 'squared']), (1, ['--metric', 'elliptical:none']),
                              (2, ['--metric', round_one, '--criterion', 'alpha-wrap'])):
            result = terrace('surface', self.store, '-o', out, *options)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            self.assertFalse(os.path.exists(out))
        result = terrace('surface', self.store, '-o', self.path('none.vtk'))
        self.assertEqual(result.returncode, 2, result.stderr)
        for options in (['--criterion', 'alpha-wrap'], ['--smooth', 'taubin'], ['--normals']):
            result = terrace('surface', self.store, '-o', self.path('none.vtk'), '--tetrahedra', *options)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn('--tetrahedra', result.stderr)

    def test_stored_surface(self):
        store = self.path('kept.terrace')
        result = terrace('build', self.path('ball.xyz'), '-o', store, '--block', 1000, '--surface', '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        built = json.loads(result.stdout)['surface']
        self.assertEqual((built['vertices'], built['triangles']), (3000, 5996))
        self.assertLess(built['bytes'], 8 * 3000)
        self.assertEqual(built.pop('input_triangles'), 0)
        self.assertEqual(json.loads(terrace('info', store, '--json').stdout)['surface'], built)
        self.assertIn('surface:   3,000 vertices', terrace('info', store).stdout)
        self.assertEqual(terrace('verify', store).returncode, 0)
        restored, _ = self.surface('restored.obj')
        self.assertFalse(restored['stored'])
        summaries = {}
        for name, options in {'full': (), 'poles': ('--criterion', 'poles'), 'coarse': ('--level', '1'),
                              'near': ('--max-error', '0.5'), 'few': ('--max-points', '100'),
                              'mixed': ('--level', '1', '--focus', '-10,-10,0,0:0')}.items():
            out = self.path(f'stored-{name}.obj')
            result = terrace('surface', store, '-o', out, '--json', *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            summaries[name] = json.loads(result.stdout)
            self.assertEqual(summaries[name]['stored'], name != 'poles')
            self.assertTrue(summaries[name]['closed'], name)
            vertices, faces = self.read_obj(out)
            self.assertEqual((len(vertices), len(faces)), (summaries[name]['vertices'], summaries[name]['triangles']))
        for name in ('full', 'poles'):
            for key in ('vertices', 'triangles', 'area', 'volume', 'components', 'samples_off'):
                self.assertAlmostEqual(summaries[name][key], restored[key], 6, key)
        self.assertLess(summaries['coarse']['vertices'], summaries['mixed']['vertices'])
        self.assertLessEqual(summaries['few']['vertices'], 100)
        self.assertLessEqual(summaries['near']['max_error'], 0.5)
        self.assertEqual(summaries['near']['full_vertices'], 3000)
        self.assertIn('from the stored surface', terrace('surface', store, '-o', self.path('text.obj')).stderr)
        # Published stores have it too.
        for name, options in {'same': (), 'repacked': ('--repack',)}.items():
            self.assertEqual(terrace('publish', store, '-o', self.path(name), *options).returncode, 0)
            copy = self.path(f'{name}/stores/kept')
            self.assertEqual(terrace('verify', copy).returncode, 0)
            out = self.path(f'stored-{name}.obj')
            result = terrace('surface', copy, '-o', out, '--max-error', '0.5', '--json')
            self.assertEqual(result.returncode, 0, result.stderr)
            summary = json.loads(result.stdout)
            self.assertTrue(summary['stored'])
            for key in ('vertices', 'triangles', 'area', 'volume', 'max_error'):
                self.assertAlmostEqual(summary[key], summaries['near'][key], 9, key)

    def test_stored_surface_of_a_mesh_has_its_triangles(self):
        # A cube without one side, of quadrilaterals, with a vertex given twice and a degenerate face.
        corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        sides = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (9, 5, 7, 3)]
        with open(self.path('cube.obj'), 'w') as file:
            file.writelines('v {} {} {}\n'.format(*corner) for corner in corners + [corners[0]])
            file.writelines('f {} {} {} {}\n'.format(*side) for side in sides)
            file.write('f 1 9 2\n')

        def triangles(vertices, faces):
            out = []
            for face in faces:
                places = [tuple(map(float, vertices[corner])) for corner in face]
                least = places.index(min(places))
                out.append(tuple(places[least:] + places[:least]))
            return sorted(out)

        fans = [(side[0] - 1, side[k - 1] - 1, side[k] - 1) for side in sides for k in (2, 3)]
        expected = triangles(corners + [corners[0]], fans)
        store = self.path('cube.terrace')
        result = terrace('build', self.path('cube.obj'), '-o', store, '--surface', '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn('1 triangle has two corners at one place', result.stderr)
        built = json.loads(result.stdout)['surface']
        self.assertEqual((built['vertices'], built['triangles'], built['input_triangles']), (8, 10, 11))
        result = terrace('surface', store, '-o', self.path('cube-out.obj'), '--json')
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(triangles(*self.read_obj(self.path('cube-out.obj'))), expected)
        summary = json.loads(result.stdout)
        self.assertEqual((summary['stored'], summary['closed'], summary['samples_off']), (True, False, 0))
        self.assertEqual(terrace('verify', store).returncode, 0)
        # The same triangles on request, restored ones, or a clear error.
        for name, triangle_count in (('input', 10), ('restored', 12)):
            result = terrace('build', self.path('cube.obj'), '-o', store, '--surface', '--surface-from', name, '--force', '--json')
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(json.loads(result.stdout)['surface']['triangles'], triangle_count)
        for code, message, options in (
                (1, 'has no faces', [self.path('ball.xyz'), '--surface', '--surface-from', 'input']),
                (2, '--surface', [self.path('cube.obj'), '--surface-from', 'input']),
                (2, '--surface-from', [self.path('cube.obj'), '--surface', '--surface-from', 'points']),
                (1, 'not selected', [self.path('cube.obj'), '--surface', '--region', '0,0,0.5,0.5'])):
            out = self.path('none.terrace')
            result = terrace('build', *options, '-o', out)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)
            self.assertFalse(os.path.exists(out))
        with open(self.path('cube.obj')) as file:
            result = subprocess.run([TERRACE, 'build', '-', '--input-format', 'obj', '-o', self.path('none.terrace'), '--surface'],
                                    stdin=file, capture_output=True, text=True)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('pass a file', result.stderr)

    def test_stored_surface_needs_a_body(self):
        with open(self.path('flat.xyz'), 'w') as file:
            file.writelines(f'{i % 10} {i // 10} 0\n' for i in range(100))
        store = self.path('flat.terrace')
        result = terrace('build', self.path('flat.xyz'), '-o', store, '--surface')
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn('enclose no volume', result.stderr)
        self.assertFalse(os.path.exists(store))


if __name__ == '__main__':
    unittest.main()
