# SPDX-License-Identifier: Apache-2.0
"""Random invalid arguments raise Python's exceptions and never crash: alone, in threads and after a fork.

Each seed runs in a separate process. TERRACE_PYTHON_SECONDS: run seeds one after another for this
much processor time.
"""

import os
import random
import resource
import subprocess
import sys
import tempfile
import traceback
import unittest
from concurrent.futures import ThreadPoolExecutor

import numpy as np

SECONDS = float(os.environ.get('TERRACE_PYTHON_SECONDS', '0'))
CALLS = 2500 if SECONDS else 250


class Odd:
    """An array interface without data. (numpy would read past the end of data that is too short.)"""

    __array_interface__ = {'shape': (3, 2), 'typestr': '<f8', 'version': 3}


class OddGeometry:
    __geo_interface__ = {'type': 'Polygon', 'coordinates': [[(0, 0), (1, 1)]]}


def arrays(luck):
    """Returns an array of a random shape, type and layout, with unusual numbers in it."""
    shape = luck.choice([(0,), (3,), (0, 2), (0, 3), (1, 2), (1, 3), (5, 2), (40, 2), (40, 3), (40, 4), (7, 7), (2, 3, 4), ()])
    numbers = np.random.default_rng(luck.randrange(2 ** 32)).normal(scale=luck.choice([1, 1e3, 1e300, 1e-300]), size=shape)
    if numbers.size and luck.random() < 0.3:
        flat = numbers.reshape(-1)
        flat[luck.randrange(flat.size)] = luck.choice([np.nan, np.inf, -np.inf, 1e308, -0.0, 5e-324])
    if luck.random() < 0.3:
        numbers = np.round(numbers)  # equal points
    with np.errstate(all='ignore'):
        kind = luck.choice(['f8', 'f8', 'f8', 'f4', 'f2', 'i4', 'u1', 'i8', '>f8', 'c16', '?', 'U5', 'O', 'M8[s]'])
        if kind == 'M8[s]':
            numbers = np.zeros(shape, kind)
        elif kind == 'i8' or kind == 'i4' or kind == 'u1':
            numbers = np.nan_to_num(numbers, posinf=0, neginf=0).clip(-100, 100).astype(kind)
        else:
            numbers = numbers.astype(kind)
    numbers = np.asarray(numbers)  # operations on arrays without dimensions return scalars
    if numbers.ndim == 2 and luck.random() < 0.3:
        numbers = luck.choice([np.asfortranarray(numbers), numbers[::-1], numbers[::2], np.flipud(numbers).T.T,
                               numbers[:, ::-1]])
    if luck.random() < 0.1:
        numbers = numbers.tolist()
    return numbers


def anything(luck):
    return luck.choice([
        lambda: arrays(luck), lambda: arrays(luck), lambda: arrays(luck), lambda: arrays(luck), lambda: None, lambda: -1,
        lambda: 0, lambda: 1, lambda: 2 ** 70, lambda: float('nan'), lambda: float('inf'), lambda: 0.5, lambda: '',
        lambda: 'linear', lambda: '\0', lambda: b'bytes', lambda: [], lambda: {}, lambda: {'type': 'Polygon'}, Odd,
        OddGeometry, object, lambda: (0, 0, 1, 1), lambda: (1, 1, 0, 0), lambda: [[0, 0], [1]], lambda: True,
        lambda: (0, 0, float('nan'), 1), lambda: range(4), lambda: 'z > 0', lambda: 'z >', lambda: lambda *_: 1 / 0,
        lambda: np.zeros(4, [('x', 'f8'), ('y', 'f4'), ('z', 'i2'), ('name', 'U3')]),
        lambda: np.lib.stride_tricks.as_strided(np.zeros(1), (50, 3), (0, 0)),
    ])()


def calls(luck, terrace, shared, folder):
    """Calls a random public function with mostly invalid arguments. Returns whether it succeeded."""
    stores, view, shape2, shape3, surface, model = shared
    store = luck.choice(stores)
    some = lambda: anything(luck)  # noqa: E731
    points = lambda: np.random.default_rng(luck.randrange(99)).random((luck.randrange(1, 60), luck.choice([2, 3])))  # noqa: E731
    flat = lambda: points()[:, :2] * luck.choice([1, 400, 5e5])  # noqa: E731
    solid = lambda: np.random.default_rng(1).random((luck.randrange(60), 3))  # noqa: E731
    number = lambda: luck.randrange(1, 9)  # noqa: E731
    box = lambda: (0, 0, luck.random(), 1)  # noqa: E731
    place = lambda: tuple(luck.uniform(-300, 300) for _ in range(3))  # noqa: E731
    handles = lambda: np.arange(luck.randrange(5))  # noqa: E731
    targets = [  # (function, a valid value of each argument, names of options)
        (lambda a, **k: terrace.build(a, os.path.join(folder, str(luck.randrange(10 ** 9))), **k), [solid],
         ['transform', 'crs', 'nodata', 'attributes', 'progress', 'threads', 'memory', 'where', 'region', 'effort',
          'block_points', 'facility_cost', 'channels', 'outlier_price', 'seed', 'keep', 'order', 'metric', 'entities', 'k', 'batch']),
        (terrace.build, [lambda: os.path.join(folder, luck.choice(['dem', 'a.ply', 'none'])), lambda: os.path.join(folder, 'new')],
         ['replace', 'input_format', 'skip_damaged', 'vertical', 'band', 'cell', 'resolution', 'datum_shift', 'drop', 'z_weight']),
        (store.where, [lambda: luck.choice(['class == 1', 'z >', 'x < -1e9', 3, None])], []), (store.points, [box], ['level', 'where', 'focus', 'crs']), (store.points, [], ['cluster', 'level', 'where', 'region']),
        (lambda a: store.points(cluster=a), [lambda: (luck.randrange(3), luck.randrange(9))], []),
        (store.tiles, [lambda: os.path.join(folder, 'tiles'), lambda: (0, number())],
         ['max_error', 'quality', 'vertical', 'geoid', 'fill', 'flat_height', 'water', 'normals', 'gzip', 'name', 'resume', 'replace']),
        (lambda: (repr(store), store._repr_png_(), store.info, store.verify(), store.__geo_interface__), [], []),
        (lambda: (repr(view), view.snapshot(), view.traffic), [], []),
        (lambda a: terrace.Mesh(*a), [lambda: (solid(), handles())], []),
        (lambda a: store.mesh(max_points=a).save(os.path.join(folder, 'm.glb'), True), [lambda: 40], []),
        (store.query, [], ['box', 'near', 'k', 'radius', 'level']),
        (lambda p, k: store.query(near=p, k=k), [place, number], []),
        (store.heights, [flat], ['method', 'level', 'max_edge', 'crs', 'threads', 'memory']),
        (store.heights, [flat], []), (store.gradients, [flat], []),
        (store.raster, [lambda: 'height'], ['cell', 'region', 'crs', 'method', 'level']),
        (store.profile, [flat], ['step', 'method', 'level', 'max_edge']),
        (store.contours, [number], ['level', 'region', 'max_edge', 'lonlat']),
        (store.mesh, [lambda: 0], ['region', 'focus', 'where', 'metric', 'crs', 'max_points']),
        (store.lines, [], ['level', 'region', 'where', 'focus']), (store.surface, [], ['level', 'region', 'where', 'cluster', 'tetrahedra']), (lambda a, k: terrace.cluster(a, count=k), [points, number], []),
        (store.bounded_mesh, [luck.random], ['max_points', 'quality', 'region', 'where', 'fill', 'duplicates']),
        (view.frame, [place, place, place], ['fov', 'size', 'matrix', 'pixel_error', 'ground_error']),
        (terrace.View, [lambda: store, lambda: 'points'], ['reader', 'max_points']),
        (terrace.Store.open, [lambda: os.path.join(folder, 'dem')], []), (terrace.xyz, [stores[0].points], []),
        (lambda a, b: (shape2.insert(a), shape2.remove(b), shape2.simplices, shape2.neighbors), [flat, handles], []),
        (lambda a, b: (shape3.insert(a), shape3.remove(b), shape3.simplices, shape3.neighbors), [solid, handles], []),
        (lambda a, b: (shape2.insert(a), shape2.find_simplex(b), shape2.nearest(b)), [flat, flat], []),
        (lambda a, b: (shape3.insert(a), shape3.find_simplex(b), shape3.nearest(b)), [solid, solid], []),
        (lambda a: terrace.Delaunay2(a).digest(), [flat], []), (lambda a: terrace.Delaunay3(a).digest(), [solid], []),
        (terrace.linkage, [points], ['method', 'threads']), (terrace.linkage, [points], []),
        (terrace.flat_clusters, [lambda: terrace.linkage(points())], ['count', 'height']),
        (terrace.kmeans, [points, number], ['weights', 'seed', 'restarts', 'max_iterations', 'tolerance']),
        (lambda a: terrace.kmeans(a, 3), [points], []),
        (terrace.cluster, [points], ['facility_cost', 'method', 'effort', 'metric', 'weights', 'outlier_price', 'bound_steps']),
        (terrace.facility_location, [points, number], ['count', 'method', 'effort', 'bound_steps', 'threads']),
        (lambda a: terrace.linkage(a, 'complete'), [lambda: np.arange(luck.randrange(12))], []), (terrace.spanning_tree, [points], ['threads']),
        (terrace.edge_matching, [lambda: [[0, 1], [1, 2], [2, 3], [3, 0]], lambda: place() + (0,)], ['count']),
        (terrace.cluster, [points], []),
        (terrace.assignment, [points], []), (terrace.assignment, [flat, flat], []),
        (terrace.matching, [points], ['exact_limit', 'window', 'rounds']), (terrace.matching, [points], []),
        (lambda a, b: terrace.Delaunay2(a).heights(b, a), [flat, lambda: np.zeros(80)], []),
        (lambda a, b: (terrace.Delaunay2(a).gradients(b, a), terrace.Delaunay2(a).quality(b)), [flat, lambda: np.zeros(80)], []),
        (lambda a, b, **k: terrace.Delaunay2(a).smooth(b, **k), [flat, lambda: np.zeros(80)],
         ['method', 'vertices', 'iterations', 'strength', 'pass_band', 'edge_height']),
        (lambda a, m: terrace.Delaunay2(a, metric=m).simplices, [flat, lambda: terrace.ellipse(number(), number(), 30)], []),
        (lambda a, m: terrace.Delaunay3(a, metric=m).shape(), [solid, lambda: np.diag(place())], ['rule', 'lids', 'threads']),
        (lambda a, b, m: terrace.Delaunay2(a).adapted([(b, m)]), [flat, box, lambda: terrace.ellipse(3, 1, 20)], []),
        (lambda a, b, m: terrace.Delaunay3(a).adapted([(b, m)]), [solid, lambda: (0, 0, 0, 1, 1, 1), lambda: np.diag((1, 2, 3))], []),
        (terrace.ellipse, [number, number], ['angle']), (terrace.ellipsoid, [place], ['axes']),
        (terrace.bounded_mesh, [solid, luck.random], ['max_points', 'quality', 'duplicates', 'transform', 'nodata']),
        (terrace.bounded_mesh, [lambda: np.random.default_rng(2).random((9, 8)), luck.random], ['max_points', 'quality', 'transform', 'nodata']),
        (terrace.interpolate, [solid, flat], ['method', 'threads']),
        (terrace.matching_tree, [points], ['weights', 'labels', 'threads']),
        (lambda a, b, k: terrace.PointTree(a).nearest(b, k), [flat, flat, number], []),
        (lambda a, b: terrace.PointTree(a, b).cost, [points, lambda: terrace.linkage(points())], []),
        (lambda a, b, r: terrace.PointTree(a).hit(b, b, r), [solid, solid, luck.random], []),
        (lambda a, b, c: (terrace.TriangleTree(a, b).hit(c, c), terrace.TriangleTree(a, b).nearest(c)),
         [solid, lambda: [[0, 0, 0]], solid], []),
        (terrace.halving_matching, [points], ['method', 'distances', 'seconds', 'seed', 'threads']),
        (lambda a, i: terrace.halving_matching(a, iterations=i), [points, number], []),
        (lambda a, **k: terrace.matching(a, **k), [points], ['labels', 'tolerance', 'window', 'threads']),
        (lambda f, s: terrace.assignment(f, shape=s), [lambda: lambda row: [row, 1, 2], lambda: (number(), 3)], []),
        (terrace.matching_tree, [points], ['matcher']), (lambda a, m: terrace.matching_tree(a, matcher=lambda nodes: m), [points, handles], []),
        (lambda a, b, **k: terrace.rotate_tree(terrace.linkage(a), b, **k), [lambda: solid() + 1, solid], ['upper', 'passes']),
        (lambda a, **k: terrace.rotate_tree(a, **k), [lambda: terrace.linkage(solid())], ['lower']),
        (terrace.tree_linkage, [lambda: [[0, 1], [1, 2]], lambda: place()[:2]], []), (lambda a: terrace.tree_linkage(*terrace.spanning_tree(a)), [points], []),
        (terrace.linkage, [points], ['edges', 'single_precision', 'memory', 'gpu']),
        (lambda a: terrace.linkage(a, edges=terrace.spanning_tree(a)[0]), [points], []),
        (terrace.cluster, [points], ['channels', 'restarts', 'steps', 'start', 'assign_nearest', 'ordered']),
        (lambda a, k: terrace.cluster(np.reshape(a, (-1, k, 3)), 0.1), [solid, lambda: luck.choice([1, 2, 3, 4])], []),
        (terrace.entity_distances, [lambda: solid().reshape(-1, 1, 3)], ['b', 'ordered']),
        (lambda a, b: terrace.cluster(a, method='kd-tree', start=terrace.Clusters(b, a, 0, 0, 0, 0)), [points, handles], []),
        (terrace.clusters_of_size, [points, number], ['seed', 'progress', 'threads']),
        (terrace.stream_clusters, [lambda: [solid() + 1, solid()], lambda: lambda block: None],
         ['block_points', 'facility_cost', 'effort', 'method', 'metric', 'seed', 'threads']),
        (lambda a, b: terrace.stream_clusters([a, b], lambda block: block.points.sum(), block_points=20), [solid, solid], []),
        (lambda a, **k: terrace.Delaunay2(a).weights(a, **k), [flat], ['method']), (lambda a, b: terrace.Delaunay2(a).weights(b), [flat, flat], []),
        (lambda a, b, c, **k: terrace.Delaunay2(a).vertical_distances(b, c, **k), [flat, lambda: np.zeros(80), solid], ['method', 'threads']),
        (lambda a, b: (terrace.Delaunay2(a).triangle_quality(b), terrace.Delaunay2(a).vertex_neighbor_vertices), [flat, lambda: np.zeros(80)], []),
        (terrace.Delaunay2.of_grid, [number, number], ['origin', 'step']),
        (lambda a, b: (shape2.record(), shape2.insert(a), shape2.remove(b), shape2.changes()), [flat, handles], []),
        (lambda a, b: (shape3.record(), shape3.insert(a), shape3.remove(b), shape3.changes()), [solid, handles], []),
        (lambda a, b: (surface.record(), surface.insert(a), surface.remove(b), surface.changes(), surface.simplices, surface.digest()), [solid, handles], []),
        (lambda: (surface.restore(), repr(surface), surface.mesh().measures(), surface.points), [], []), (terrace.DynamicSurface, [solid], []),
        (lambda a, **k: terrace.Delaunay3(a).shape(**k), [solid], ['rule', 'criterion', 'edge_factor', 'keep_vertices']),
        (terrace.simplify_line, [lambda: np.arange(9), lambda: np.zeros(9), luck.random], []),
        (lambda a, b: (terrace.Mesh(a, b).measures(), terrace.Mesh(a, b).turned_outward()), [solid, lambda: [[0, 1, 2]]], []),
        (lambda a, b, c: terrace.Mesh(a, b).errors(c), [solid, lambda: [[0, 1, 2]], solid], []),
        (terrace.Mesh.read, [lambda: os.path.join(folder, luck.choice(['a.ply', 'm.glb', 'dem', 'none']))], []),
        (terrace.bounded_mesh, [solid, luck.random], ['min_angle', 'frame']),
        (lambda a, b, c: terrace.Transformation(a, b).forward(c), [lambda: luck.choice([4326, 32632, 'EPSG:3857']), lambda: luck.choice([4326, 32632, 'WGS 84']), flat], []),
        (terrace.Transformation, [lambda: 4326, lambda: 3857], ['area', 'datum_shift']),
        (lambda a, c: stores[0].own_region(a, c), [box, lambda: luck.choice([4326, 32632, 3857])], []), (store.clusters, [lambda: luck.randrange(3)], []),
        (store.count, [box], []), (store.mesh, [lambda: 0], ['cluster', 'smoothing', 'overlay', 'replace']),
        (lambda a: store.mesh(0, smoothing='laplacian', save_overlay=os.path.join(folder, 'heights'), replace=a), [lambda: True], []),
        (lambda a: store.mesh(0, overlay=a), [lambda: os.path.join(folder, 'heights')], []),
        (terrace.read_points, [solid], ['where', 'region', 'keep', 'drop', 'block_points', 'crs', 'attributes', 'transform', 'band', 'entities']),
        (terrace.read_points, [lambda: os.path.join(folder, luck.choice(['a.ply', 'w.laz', 'w.csv', 'none']))], ['where', 'region', 'resolution', 'skip_damaged']),
        (lambda n, a, **k: terrace.write_points(os.path.join(folder, n), a, replace=True, **k), [lambda: luck.choice(['w.laz', 'w.csv', 'w.ply', 'w.copc.laz']), solid],
         ['format', 'attributes', 'crs', 'where', 'progress', 'threads']),
        (view.frame, [place], ['focus', 'regions', 'ground_height']), (view.pin, [lambda: (0, number()), lambda: luck.choice([True, False, None])], []),
        (view.attributes, [handles], []), (view.to_metres, [solid], []), (view.restore, [], ['threads']),
        (lambda a: terrace.View(a, 'surface', reader='frame').frame(ground_error=0.0, seconds=0.01), [lambda: stores[1]], []),
        (terrace.View, [lambda: stores[1]], ['kind', 'metric', 'max_bytes', 'collapse_below', 'guard', 'silhouette']),
        (model.expand, [lambda: luck.choice(model.children())], []), (model.collapse, [lambda: (0, number())], []), (model.children, [lambda: (0, number())], []),
        (model.refine, [box, lambda: luck.randrange(2)], []), (model.coarsen, [box, lambda: luck.randrange(2)], []),
        (model.set_detail, [lambda: luck.randrange(3)], ['focus']), (model.cluster_info, [lambda: (0, number())], []),
        (lambda: (repr(model), model.snapshot(), model.mesh, model.expanded, len(model)), [], []),
        (terrace.Multiresolution, [lambda: store, lambda: 0], ['focus', 'kind', 'metric']),
        (lambda a, **k: terrace.Multiresolution(a, kind='volume', **k).refine(box(), 0), [lambda: store], ['level', 'focus']),
        (terrace.verify_tiles, [lambda: os.path.join(folder, 'tiles')], ['store', 'max_error', 'vertical', 'geoid']),
        (lambda a, b: terrace.Mesh(a, b).save(os.path.join(folder, 'a.ply'), True), [solid, lambda: [[0, 0, 0]]], []),
    ]
    call, fitting, options = luck.choice(targets)
    arguments = [fit() if luck.random() < 0.6 else some() for fit in fitting]
    given = {name: some() for name in options if luck.random() < 0.15}
    try:
        call(*arguments, **given)
        return True
    except (ValueError, TypeError, OverflowError, OSError, MemoryError, ZeroDivisionError, KeyError, AttributeError,
            IndexError, terrace.Error, np.exceptions.AxisError if hasattr(np, 'exceptions') else ValueError) as error:
        # These exceptions show a missing check in the module.
        if isinstance(error, (KeyError, AttributeError, IndexError)):
            traceback.print_exc()
            raise SystemExit(f'{call} with {arguments!r}, {given!r}') from error
        return False
    except RuntimeError as error:  # builds without a GPU
        if 'CUDA' not in str(error):
            raise
        return False


def main(seed, count):
    import terrace
    try:
        import tqdm
        tqdm.tqdm.monitor_interval = 0  # its thread could hold AddressSanitizer's locks during a fork
    except ImportError:
        pass
    luck = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        y, x = np.mgrid[0:40, 0:50]
        stores = [terrace.build(np.sin(x / 5) * 20 + y, os.path.join(folder, 'dem'), transform=(10, 0, 5e5, 0, -10, 5e6),
                                crs='EPSG:32632'),
                  terrace.build(np.random.default_rng(1).random((3000, 3)), os.path.join(folder, 'cloud'),
                                attributes={'class': np.arange(3000) % 5}, block_points=500)]
        closed = terrace.Store.open(os.path.join(folder, 'cloud'))
        closed.close()
        # Without a reading thread, which could hold AddressSanitizer's locks during a fork.
        shared = stores + [closed], terrace.View(stores[0], reader='frame'), terrace.Delaunay2(), terrace.Delaunay3(), \
            terrace.DynamicSurface(), terrace.Multiresolution(stores[1])
        worked = 0
        for _ in range(count):
            kind = luck.random()
            if kind < 0.03:  # several threads on shared objects
                with ThreadPoolExecutor(3) as threads:
                    for _ in threads.map(lambda own: calls(random.Random(own), terrace, shared, folder),
                                         [luck.randrange(2 ** 32) for _ in range(3)]):
                        pass
            elif kind < 0.06:  # a fork of this process
                child = os.fork()
                if child == 0:
                    calls(luck, terrace, shared, folder)
                    os._exit(0)
                if os.waitpid(child, 0)[1] != 0:
                    raise SystemExit('a fork crashed')
            else:
                worked += calls(luck, terrace, shared, folder)
        print('done', worked)


class Hostile(unittest.TestCase):
    def try_seeds(self, seeds):
        children = [(seed, subprocess.Popen([sys.executable, '-B', '-X', 'faulthandler', __file__, str(seed), str(CALLS)],
                                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))
                    for seed in seeds]
        for seed, child in children:
            output = child.communicate()[0]
            self.assertEqual(child.returncode, 0, f'seed {seed}: {output[-8000:]}')
            self.assertGreater(int(output.split('done')[1]), CALLS // 50, f'seed {seed}: hardly any call succeeded')

    def test_random_calls_do_not_crash(self):
        if SECONDS == 0:
            return self.try_seeds(range(4))
        first = seed = random.randrange(2 ** 30)
        while sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2]) < SECONDS:
            self.try_seeds([seed])
            seed += 1
        print(f'{seed - first} seeds from {first}, {CALLS * (seed - first)} calls')


if __name__ == '__main__':
    if len(sys.argv) == 3 and sys.argv[1].isdigit():
        main(int(sys.argv[1]), int(sys.argv[2]))
    else:
        unittest.main()
