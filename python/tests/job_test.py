# SPDX-License-Identifier: Apache-2.0
"""Progress, Ctrl-C and threads of long calls."""

import logging
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import unittest
from importlib.util import find_spec

import numpy as np

import terrace
from python_case import ALPS, TRANSFORM, StoreCase


class Jobs(StoreCase):
    def test_progress(self):
        seen = []
        terrace.build(ALPS, self.path('alps'), progress=lambda *at: seen.append(at))
        self.assertTrue(all(at[0] == 'points' for at in seen))
        self.assertTrue(seen[-1][3])
        self.assertEqual(seen[-1][1:3], (1338658, 1.0))
        counts = [at[1] for at in seen if not at[3]]
        self.assertEqual(counts, sorted(counts))
        with self.assertRaises(TypeError):
            terrace.build(ALPS, self.path('alps2'), progress=3)

    def test_exception_from_progress_ends_the_job(self):
        class Enough(Exception):
            pass

        def stop(*at):
            raise Enough

        with self.assertRaises(Enough):
            terrace.build(ALPS, self.path('stopped'), progress=stop)
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith('stopped')], [])

    def test_ctrl_c_ends_a_build_soon_without_leftovers(self):
        code = textwrap.dedent('''
            import sys, time, numpy as np, terrace
            def tell(*at):
                print('working', flush=True)
            try:
                terrace.build(np.random.default_rng(1).random((6_000_000, 3)), sys.argv[1], progress=tell)
            except KeyboardInterrupt:
                print('interrupted', flush=True)
                sys.exit(7)
        ''')
        store = self.path('interrupted')
        with subprocess.Popen([sys.executable, '-c', code, store], stdout=subprocess.PIPE, text=True) as child:
            child.stdout.readline()
            began = time.monotonic()
            child.send_signal(signal.SIGINT)
            self.assertIn('interrupted', child.stdout.read())
            self.assertEqual(child.wait(), 7)
            self.assertLess(time.monotonic() - began, 10)
        self.assertEqual([name for name in os.listdir(self.folder) if 'interrupted' in name], [])

    def test_ctrl_c_ends_other_calls(self):
        code = textwrap.dedent('''
            import os, signal, sys, threading, numpy as np, terrace
            store = terrace.Store.open(sys.argv[1])
            points = np.random.default_rng(1).random((400_000, 2))
            for call in (lambda: store.bounded_mesh(0.0), lambda: store.heights(points * 1e3 + [300000, 5200000], 'natural'),
                         lambda: store.tiles(sys.argv[2], (0, 20), vertical='ignore'), lambda: terrace.Delaunay3(np.c_[points, points[::-1, 0]]),
                         lambda: terrace.linkage(points), lambda: terrace.kmeans(points, 200), lambda: terrace.matching(points[:50_000]),
                         # These would never end on their own.
                         lambda: terrace.halving_matching(points[:300], iterations=10 ** 12),
                         lambda: terrace.cluster(points[:2000], method='kd-tree', steps=10 ** 15),
                         lambda: terrace.stream_clusters((points for _ in iter(int, 1)), lambda block: None),
                         lambda: [0 for _ in iter(int, 1) if len(terrace.read_points(points[:9], crs='EPSG:4326')) == 0],
                         lambda: terrace.write_points(sys.argv[2] + '.laz', np.c_[points, points[:, 0]].repeat(5, axis=0))):
                timer = threading.Timer(0.03, os.kill, (os.getpid(), signal.SIGINT))
                timer.start()
                try:
                    call()
                    print('went on')
                except KeyboardInterrupt:
                    print('interrupted')
        ''')
        output = subprocess.run([sys.executable, '-c', code, self.path('cloud'), self.path('interrupted-tiles')],
                              stdout=subprocess.PIPE, text=True, check=True).stdout
        self.assertEqual(output.split(), ['interrupted'] * 12)
        self.assertFalse(os.path.exists(self.path('interrupted-tiles.laz')))

    def test_ctrl_c_ends_long_work_in_memory(self):
        code = textwrap.dedent('''
            import os, signal, threading, numpy as np, terrace
            random = np.random.default_rng(1)
            plane, space = random.random((6_000_000, 2)), random.random((3_000_000, 3))
            noise, pairs = random.random((2000, 2000)), random.integers(0, 1_000_000, (8_000_000, 2))
            for call in (lambda: terrace.Delaunay2(plane), lambda: terrace.Delaunay3(space), lambda: terrace.DynamicSurface(space),
                         lambda: terrace.linkage(space[:60_000], 'ward'), lambda: terrace.linkage(space[:20_000], 'average'),
                         lambda: terrace.linkage(space[:20_000], 'complete'), lambda: terrace.kmeans(space, 100_000),
                         lambda: terrace.cluster(space[:4000], method='greedy-stars'), lambda: terrace.cluster(space[:40_000], count=1000),
                         lambda: terrace.matching(space[:400_000]), lambda: terrace.assignment(space[:200_000], space[200_000:400_000]),
                         lambda: terrace.bounded_mesh(space, 0.0), lambda: terrace.bounded_mesh(noise, 0.0, transform=(1, 0, 0, 0, -1, 0)),
                         lambda: terrace.linkage(space[:1_000_000], edges=pairs)):
                timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
                timer.start()
                try:
                    call()
                    print('went on')
                except KeyboardInterrupt:
                    print('interrupted')
        ''')
        with subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True) as child:
            output, _ = child.communicate(timeout=600)
        self.assertEqual(output.split(), ['interrupted'] * 14)

    def test_ctrl_c_ends_an_insertion_between_portions(self):
        code = textwrap.dedent('''
            import os, signal, threading, numpy as np, terrace
            given = np.random.default_rng(1).random((6_000_000, 2))
            mesh = terrace.Delaunay2(given[:1000])
            threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
            try:
                mesh.insert(given)
            except KeyboardInterrupt:
                vertices, points = mesh.vertices, mesh.points
                print(1000 <= len(mesh) < len(given), len(vertices) == len(mesh), terrace.Delaunay2(points[vertices]).digest() == mesh.digest())
        ''')
        output = subprocess.run([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True, timeout=600).stdout
        self.assertEqual(output.split(), ['True'] * 3)

    def test_ctrl_c_ends_a_removal_between_portions(self):
        code = textwrap.dedent('''
            import os, signal, threading, numpy as np, terrace
            mesh = terrace.Delaunay2(np.random.default_rng(1).random((2_000_000, 2)))
            threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
            try:
                mesh.remove(np.arange(1_999_000))
            except KeyboardInterrupt:
                vertices, points = mesh.vertices, mesh.points
                print(1000 < len(mesh) <= 2_000_000, len(vertices) == len(mesh), terrace.Delaunay2(points[vertices]).digest() == mesh.digest())
        ''')
        output = subprocess.run([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True, timeout=600).stdout
        self.assertEqual(output.split(), ['True'] * 3)

    def test_other_threads_keep_running(self):
        turns, stop = [0], threading.Event()

        def count():
            while not stop.is_set():
                turns[0] += 1
                time.sleep(0.0005)

        thread = threading.Thread(target=count)
        thread.start()
        points = np.random.default_rng(1).random((400_000, 3))
        store = terrace.build(points, self.path('busy'))
        turned = []
        for call in (lambda: terrace.build(points, self.path('busy'), replace=True), lambda: store.mesh(level=0),
                     lambda: terrace.Delaunay3(points), lambda: terrace.linkage(points[:100_000]),
                     lambda: terrace.kmeans(points, 99, max_iterations=9), lambda: terrace.cluster(points),
                     lambda: terrace.matching(points[:5000]), lambda: terrace.DynamicSurface(points[:50_000]),
                     lambda: terrace.read_points(points), lambda: terrace.halving_matching(points[:300], iterations=100),
                     lambda: terrace.stream_clusters([points], lambda block: None), lambda: terrace.Delaunay2(points[:, :2]).weights(points[:, :2]), lambda: terrace.assignment(points[:2000], points[2000:4000])):
            before, began = turns[0], time.monotonic()
            call()
            turned.append((turns[0] - before) / (time.monotonic() - began))
        stop.set()
        thread.join()
        self.assertGreater(min(turned), 10, turned)  # within a second

    def test_notes_are_logged(self):
        with self.assertLogs('terrace', logging.INFO) as logs:
            terrace.build(np.random.default_rng(1).random((300_000, 3)), self.path('shuffled'))
        self.assertIn('spatial order', ' '.join(logs.output))

    def test_stores_do_not_depend_on_threads(self):
        one = terrace.build(self.points, self.path('one'), threads=1)
        many = terrace.build(self.points, self.path('many'), threads=5)
        self.assertEqual(one.info['checksum'], many.info['checksum'])
        with self.assertRaises(ValueError):
            terrace.build(self.points, self.path('none'), threads=0)
        with self.assertRaises(terrace.Error):
            terrace.build(self.points, self.path('little'), memory=1000)

    def shown(self, hidden):
        code = f'import sys; sys.modules[{hidden!r}] = None; import terrace; terrace.build({ALPS!r}, sys.argv[1], progress=True)'
        output = subprocess.run([sys.executable, '-c', code, self.path(f'without-{hidden}')], stderr=subprocess.PIPE, text=True,
                              check=True).stderr
        self.assertTrue(output.endswith('\n'))
        return output

    def test_progress_line_without_tqdm(self):
        self.assertRegex(self.shown(hidden='tqdm'), r'\d+ % [\d,]+ points')

    @unittest.skipIf(find_spec('tqdm') is None, 'tqdm is missing')
    def test_progress_bar_with_tqdm(self):
        self.assertRegex(self.shown(hidden='nothing'), r'%\|.*/1.\d+M \[.* points/s')

    def test_import_is_quick_and_needs_only_numpy(self):
        code = ('import sys, time, numpy; before = set(sys.modules); began = time.process_time(); import terrace; '
                'print(time.process_time() - began, *{name.split(".")[0] for name in set(sys.modules) - before})')
        best = min((subprocess.run([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True,
                                   check=True).stdout.split() for _ in range(3)), key=lambda row: float(row[0]))
        self.assertLess(float(best[0]), 0.2)
        others = set(best[1:]) - set(sys.stdlib_module_names) - {'terrace', 'numpy'}
        self.assertEqual({name for name in others if not name.startswith('_')}, set())


if __name__ == '__main__':
    unittest.main()
