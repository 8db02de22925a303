#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pictures modelled on those of the thesis with the command. Most show synthetic data; a scan of
Lucy, heights of the whole world and laser-scanned streets are used if TERRACE_DATA has them.

pictures.py TERRACE --out DIR [--small]
"""

import argparse
import json
import lzma
import os
import random
import struct
import subprocess
import tempfile

FIGURES = {
    '7.1': 'clusters with facility costs of 0.3, 1 and 3 times the default',
    '7.2': 'clusters of a cloud in its original order and shuffled (7.4)',
    '7.3': 'two blocks: an outlier that joins a distant cluster',
    '7.8': 'points of a scan: coarse, one part fine',
    '7.11': 'clusters of the whole world',
    '7.15': 'three regions with elliptical metrics: clusters and triangles',
    '7.16': 'the same on an elevation model',
    '8.1': 'an elevation model: coarse, finer round a focus, full resolution in its centre',
    '8.2': 'the tetrahedra of a scan: edges and their hull',
    '8.9': 'a scan with its shape restored: coarse, finer in one part (8.6)',
    'A.1': 'a laser-scanned place: the top, a finer part, full resolution in its centre (to A.3: closer)',
    'A.4': 'a larger one (to A.6: closer)',
}


class Maker:
    def __init__(self, terrace, out, small):
        self.terrace, self.out, self.small = terrace, out, small
        self.folder = tempfile.TemporaryDirectory()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run(self, *words):
        subprocess.run([self.terrace, *map(str, words), '--force', '-q'], check=True,
                       stdout=subprocess.DEVNULL)

    def picture(self, source, name, *options):
        size = '320x240' if self.small else '1600x1200'
        target = os.path.join(self.out, f'figure_{name}.png')
        self.run('render', source, '-o', target, '--size', size, *options)
        print(target, flush=True)

    def count(self, full):
        return full // 20 if self.small else full

    def bounds(self, store):
        result = subprocess.run([self.terrace, 'info', store, '--json'], check=True,
                                capture_output=True, text=True)
        info = json.loads(result.stdout)
        return info['bounds']['min'], info['bounds']['max'], max(l['level'] for l in info['levels'])

    def part(self, low, high, begin, end, axes):
        """The box between two fractions of the extent along `axes`, and the full extent along the others."""
        first = [l + begin[a] * (h - l) if a in axes else l for a, (l, h) in enumerate(zip(low, high))]
        last = [l + end[a] * (h - l) if a in axes else h for a, (l, h) in enumerate(zip(low, high))]
        return first, last

    def data(self, *names):
        """The path of a file in TERRACE_DATA, or None if it is missing."""
        path = os.path.join(os.environ.get('TERRACE_DATA', ''), *names)
        return path if os.path.exists(path) else None

    def box(self, low, high, begin, end, axes):
        return ','.join(map(str, sum(self.part(low, high, begin, end, axes), [])))

    def regions(self, low, high, ratio):
        """Three boxes in the plane with ellipses across, along and diagonal to them, as in figure 7.15."""
        list_ = []
        for begin, end, angle in (((.08, .55), (.42, .92), 45), ((.58, .55), (.92, .92), -45),
                                  ((.3, .08), (.7, .42), 0)):
            first, last = self.part(low[:2], high[:2], begin, end, (0, 1))
            list_.append({'box': first + last, 'semi_axes': [ratio, 1 / ratio], 'angle': angle})
        path = self.path('regions.json')
        with open(path, 'w') as file:
            json.dump({'regions': list_}, file)
        return f'elliptical:{path}'

    # ---- The figures ----------------------------------------------------------------------------

    def facility_costs(self):
        cloud = self.path('cloud.ply')
        self.run('synth', 'clusters', '--points', self.count(10000), '-o', cloud)
        for name, cost in (('a', .3), ('b', 1), ('c', 3)):
            clusters = self.path('clusters.ply')
            self.run('cluster', cloud, '-o', clusters, '--facility-cost', cost, '--z-weight', 0)
            self.picture(clusters, f'7_1_{name}')

    def orders(self):
        for name, options in (('7_2', []), ('7_4', ['--shuffle', 'all'])):
            cloud, store = self.path('ordered.ply'), self.path('ordered.store')
            self.run('synth', 'surface', '--points', self.count(400000), '-o', cloud, *options)
            self.run('build', cloud, '-o', store)
            for level in (0, 1):
                points = self.path('level.ply')
                self.run('points', store, '--level', level, '-o', points)
                self.picture(points, f'{name}_level{level}')

    def outlier(self):
        """Two clouds of one cluster each; a point of the right one is in the left one's block."""
        generator = random.Random(3)
        blocks = []
        for x, count in ((0, 200), (7, 199)):
            blocks.append([(x + generator.gauss(0, .7), generator.gauss(0, .7))
                           for _ in range(count)])
        blocks[0].append((6.2, .1))
        rows = []
        for number, block in enumerate(blocks):
            cloud, clusters = self.path('block.xyz'), self.path('block.csv')
            with open(cloud, 'w') as file:
                file.writelines(f'{x} {y} 0\n' for x, y in block)
            self.run('cluster', cloud, '-o', clusters, '--z-weight', 0, '--facility-cost', 20)
            with open(clusters) as file:
                head, *lines = file.read().split()
            for line in lines:
                x, y, z, cluster, representative = line.split(',')
                rows.append((x, y, z, 2 * int(cluster) + number,
                             int(representative) + number * len(blocks[0])))
        both = self.path('outlier.csv')
        with open(both, 'w') as file:
            file.write(head.replace('cluster', 'class') + '\n')
            file.writelines(','.join(map(str, row)) + '\n' for row in rows)
        self.picture(both, '7_3', '--color', 'class')

    def scan(self):
        """The store of Lucy, or of a synthetic surface, and the index of the vertical axis."""
        store = self.path('scan.store')
        if not os.path.exists(store):
            cloud = self.data('scan', 'lucy_100k.ply')
            if not cloud:
                cloud = self.path('scan.ply')
                self.run('synth', 'surface', '--points', self.count(100000), '-o', cloud)
            self.run('build', cloud, '-o', store, '--block', 5000)
        return store

    def selected_points(self):
        store = self.scan()
        low, high, top = self.bounds(store)
        first, last = self.part(low, high, (0, 0, .7), (1, 1, 1), (2,))
        points = self.path('selected.ply')
        self.run('points', store, '--level', min(1, top), '--focus',
                 ','.join(map(str, first + last)) + ':0', '-o', points)
        self.picture(points, '7_8', '--view', '20,10')

    def world(self):
        dem = self.data('dem', 'etopo1_1deg_f32.tif')
        if not dem or self.small:
            dem = self.path('world.tif')
            self.run('synth', 'dem', '--size', '60x30' if self.small else '360x180', '-o', dem)
        clusters = self.path('world.ply')
        self.run('cluster', dem, '-o', clusters, '--bound-iterations', 0)
        # Seen from above: with x and y in degrees, heights in metres would be walls.
        self.picture(clusters, '7_11', '--exaggerate', 1e-6)

    def elliptical_points(self):
        cloud, store = self.path('plane.xyz'), self.path('plane.store')
        generator = random.Random(1)
        with open(cloud, 'w') as file:
            file.writelines(f'{generator.random()} {generator.random()} 0\n'
                            for _ in range(self.count(6000)))
        self.run('build', cloud, '-o', store, '--z-weight', 0)
        low, high, _ = self.bounds(store)
        metric = self.regions(low, high, 2.5)
        clusters, mesh = self.path('plane_clusters.ply'), self.path('plane_mesh.ply')
        self.run('cluster', cloud, '-o', clusters, '--metric', metric, '--z-weight', 0)
        self.picture(clusters, '7_15_clusters')
        self.run('mesh', store, '-o', mesh, '--metric', metric)
        self.picture(mesh, '7_15_triangles', '--wire')

    def elliptical_terrain(self):
        dem, store = self.path('small.tif'), self.path('small.store')
        side = 60 if self.small else 700
        self.run('synth', 'dem', '--size', f'{side}x{side}', '-o', dem)
        self.run('build', dem, '-o', store, '--block', 1000 if self.small else 10000)
        low, high, _ = self.bounds(store)
        metric = self.regions(low, high, 2.2)
        clusters, mesh = self.path('dem_clusters.ply'), self.path('dem_mesh.ply')
        self.run('cluster', dem, '-o', clusters, '--metric', metric, '--facility-cost', 3,
                 '--z-weight', 0)
        self.picture(clusters, '7_16_clusters')
        self.run('mesh', store, '--level', 1, '-o', mesh, '--metric', metric)
        self.picture(mesh, '7_16_triangles', '--wire')

    def terrain_detail(self):
        dem, store, mesh = (self.path(name) for name in ('dem.tif', 'dem.store', 'focus.ply'))
        side = 400 if self.small else 4096
        self.run('synth', 'dem', '--size', f'{side}x{side}', '-o', dem)
        self.run('build', dem, '-o', store)
        low, high, top = self.bounds(store)
        around = sum(self.part(low[:2], high[:2], (.3, .3), (.6, .6), (0, 1)), [])
        centre = sum(self.part(low[:2], high[:2], (.42, .42), (.48, .48), (0, 1)), [])
        self.run('mesh', store, '--level', 'top', '--focus', ','.join(map(str, around)) + f':{min(1, top)}',
                 '--focus', ','.join(map(str, centre)) + ':0', '-o', mesh)
        self.picture(mesh, '8_1', '--wire')
        self.picture(mesh, '8_1_aslant', '--wire', '--view', '200,35')

    def tetrahedra(self):
        """Without an edge limit nothing is removed, so the tetrahedra fill the convex hull."""
        store = self.scan()
        low, high, top = self.bounds(store)
        hull, inside, wires = (self.path(name) for name in ('hull.ply', 'inside.vtk', 'wires.obj'))
        options = ('--level', min(1, top), '--criterion', 'edge:1e6')
        self.run('surface', store, '-o', hull, *options)
        self.run('surface', store, '-o', inside, '--tetrahedra', *options)
        width = .0005 * max(h - l for l, h in zip(low, high))
        with open(wires, 'w') as file:
            write_wires(*read_tetrahedra(inside), width, file)
        self.picture(wires, '8_2_wires', '--view', '20,10', '--exaggerate', 1)
        self.picture(hull, '8_2_hull', '--view', '20,10', '--wire')

    def restored_shape(self):
        store = self.scan()
        low, high, top = self.bounds(store)
        surface = self.path('surface.ply')
        coarse = min(1, top)
        parts = {'coarse': [], 'mixed': ['--focus', ','.join(map(str, sum(self.part(
            low, high, (0, 0, .62), (1, 1, 1), (2,)), []))) + ':0']}
        for name, options in parts.items():
            self.run('surface', store, '--level', coarse, '-o', surface, *options)
            self.picture(surface, f'8_9_{name}', '--view', '20,10')
            self.picture(surface, f'8_9_{name}_wire', '--view', '20,10', '--wire')
        self.run('surface', store, '-o', surface)
        self.picture(surface, '8_9_full', '--view', '20,10')

    def place(self, number, name, block, view):
        """A laser-scanned place: overview, the finer part, its centre."""
        cloud, store = self.path('place.ply'), self.path('place.store')
        las = self.data('lidar', name)
        if las and not self.small:
            las_to_ply(las, cloud)
        else:
            self.run('synth', 'surface', '--points', self.count(200000), '-o', cloud)
        self.run('build', cloud, '-o', store, '--block', block)
        low, high, top = self.bounds(store)
        part, centre, detail = ((a, b) for a, b in (((.3, .3), (.7, .7)), ((.44, .44), (.56, .56)),
                                                    ((.47, .47), (.53, .53))))
        focuses = ['--focus', self.box(low[:2], high[:2], *centre, (0, 1)) + ':0']
        if top > 1:
            focuses += ['--focus', self.box(low[:2], high[:2], *part, (0, 1)) + ':1']
        options = ['--level', 'top', '--color', 'level', '--exaggerate', 1, *focuses]
        self.picture(store, f'A_{number}', *options, '--view', view)
        for k, region in enumerate((part, detail), 1):
            self.picture(store, f'A_{number + k}', *options, '--view', view,
                         '--region', self.box(low[:2], high[:2], *region, (0, 1)))

    def street(self):
        self.place(1, 'autzen_trim.las', 2000, '200,35')

    def town(self):
        self.place(4, 'autzen_ept_depth0-2.las.xz', 5000, '200,35')


def las_to_ply(path, target):
    """Converts the records of an uncompressed LAS file to PLY, with coordinates as stored."""
    with (lzma.open if path.endswith('.xz') else open)(path, 'rb') as file:
        data = file.read()
    begin, _, _, length, count = struct.unpack('<IIBHI', data[96:111])
    columns = ['int x', 'int y', 'int z', 'ushort intensity']
    columns += [f'uchar other{k}' for k in range(length - 14)]
    header = ['ply', 'format binary_little_endian 1.0', f'element vertex {count}',
              *(f'property {column}' for column in columns), 'end_header', '']
    with open(target, 'wb') as file:
        file.write('\n'.join(header).encode())
        file.write(data[begin:begin + count * length])


def read_tetrahedra(path):
    """Reads the points and quadruples of a binary VTK file."""
    with open(path, 'rb') as file:
        data = file.read().split(b'POINTS ', 1)[1]
    line, data = data.split(b'\n', 1)
    count = int(line.split()[0])
    points = list(struct.iter_unpack('>3d', data[:24 * count]))
    line, data = data[24 * count:].split(b'CELLS ', 1)[1].split(b'\n', 1)
    cells = int(line.split()[0])
    return points, [cell[1:] for cell in struct.iter_unpack('>5i', data[:20 * cells])]


def write_wires(points, tetrahedra, width, file):
    """Writes every edge as two thin crossed strips."""
    edges = {tuple(sorted((cell[i], cell[j]))) for cell in tetrahedra
             for i in range(4) for j in range(i)}
    vertices = 0
    for a, b in sorted(edges):
        p, q = points[a], points[b]
        along = [y - x for x, y in zip(p, q)]
        least = min(range(3), key=lambda axis: abs(along[axis]))
        one = cross(along, [float(axis == least) for axis in range(3)], width)
        for offset in (one, cross(along, one, width)):
            for end in (p, q):
                for sign in (-1, 1):
                    file.write('v ' + ' '.join(str(x + sign * o) for x, o in zip(end, offset)) + '\n')
            k = vertices
            file.write(f'f {k + 1} {k + 2} {k + 4}\nf {k + 1} {k + 4} {k + 3}\n')
            vertices += 4


def cross(a, b, length):
    """A vector of the given length, perpendicular to both."""
    c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    size = sum(x * x for x in c) ** .5
    return [length * x / size for x in c]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('terrace')
    parser.add_argument('--out', required=True)
    parser.add_argument('--small', action='store_true', help='small inputs, as a smoke test')
    parser.add_argument('--only', metavar='LIST', help='only these figures, such as 7.3,A.1')
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    maker = Maker(options.terrace, options.out, options.small)
    works = (maker.facility_costs, maker.orders, maker.outlier, maker.selected_points, maker.world,
             maker.elliptical_points, maker.elliptical_terrain, maker.terrain_detail,
             maker.tetrahedra, maker.restored_shape, maker.street, maker.town)
    for (figure, what), work in zip(FIGURES.items(), works, strict=True):
        if options.only and figure not in options.only.split(','):
            continue
        print(f'{figure}: {what}', flush=True)
        work()


if __name__ == '__main__':
    main()
