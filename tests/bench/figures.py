#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures after those of the thesis, made by the command: of made data, and of the scan of Lucy where
TERRACE_DATA names a folder that has it.

figures.py TERRACE --out DIR [--small]
"""

import argparse
import json
import os
import random
import subprocess
import tempfile

FIGURES = {
    '7.1': 'clusters with facility costs of 0.3, 1 and 3 times the default',
    '7.2': 'clusters of a cloud in its order, and of the same shuffled (7.4)',
    '7.8': 'points of a scan: all levels coarse, one part fine',
    '7.15': 'three regions with elliptical metrics: clusters and triangles',
    '7.16': 'the same on an elevation model',
    '8.1': 'an elevation model: coarse, finer round a focus, full resolution in its centre',
    '8.9': 'a scan with its shape restored: coarse, finer in one part (8.6)',
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
        """The box between two shares of the sides along some axes; all of the others."""
        first = [l + begin[a] * (h - l) if a in axes else l for a, (l, h) in enumerate(zip(low, high))]
        last = [l + end[a] * (h - l) if a in axes else h for a, (l, h) in enumerate(zip(low, high))]
        return first, last

    def regions(self, low, high, ratio):
        """Three boxes in the plane with ellipses across, along and aslant, as in figure 7.15."""
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

    def scan(self):
        """The store of Lucy, or of a made surface, and which axis points up."""
        store = self.path('scan.store')
        if not os.path.exists(store):
            cloud = os.path.join(os.environ.get('TERRACE_DATA', ''), 'scan', 'lucy_100k.ply')
            if not os.path.exists(cloud):
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('terrace')
    parser.add_argument('--out', required=True)
    parser.add_argument('--small', action='store_true', help='quickly, to see that it works')
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    maker = Maker(options.terrace, options.out, options.small)
    works = (maker.facility_costs, maker.orders, maker.selected_points, maker.elliptical_points,
             maker.elliptical_terrain, maker.terrain_detail, maker.restored_shape)
    for (figure, what), work in zip(FIGURES.items(), works, strict=True):
        print(f'{figure}: {what}')
        work()


if __name__ == '__main__':
    main()
