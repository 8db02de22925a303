# SPDX-License-Identifier: Apache-2.0
"""The type stubs match the module and check users' scripts."""

import os
import subprocess
import sys
import tempfile
import textwrap
import unittest

import terrace

SCRIPT = '''
import numpy as np
import terrace

store: terrace.Store = terrace.build(np.zeros((9, 3)), 'x', crs='EPSG:32632', progress=True)
heights = store.heights([[0.0, 1.0]], 'natural', threads=2)
highest: float = float(heights.max())
vertices, triangles = store.bounded_mesh(max_error=1.0)
inside = store.points(region=(0, 0, 1, 1), where='z > 3')
delta = terrace.View(store).frame((0, 0, 1), pixel_error=1)
points = terrace.read_points('scan.laz', where='class == 2')
made = terrace.stream_clusters([points], lambda block: print(block.points.shape, block.level), effort='fast')
model = terrace.Multiresolution(terrace.open('x'))
model.expand(model.children()[0])
lonlat = terrace.Transformation('EPSG:32632', 4326).forward(terrace.xyz(points)[:, :2])
clusters = terrace.cluster(lonlat, 0.1, method='kd-tree', start=terrace.cluster(lonlat, 0.1))
tree = terrace.PointTree(lonlat, terrace.rotate_tree(terrace.linkage(lonlat), lonlat))
mates = terrace.halving_matching(lonlat, iterations=9).mates
print(delta.added_corners.shape, terrace.kmeans(inside, 3).centres, terrace.Delaunay2([[0, 0]]).simplices)
'''


def mypy(folder, *arguments):
    environment, found = dict(os.environ), os.path.dirname(terrace.__path__[0])
    if not found.endswith('-packages'):  # the interpreter's own packages are found anyway
        environment.update(MYPYPATH=found, PYTHONPATH=found)
    return subprocess.run([sys.executable, '-m', *arguments], cwd=folder, stdout=subprocess.PIPE, text=True,
                          stderr=subprocess.STDOUT, env=environment)


class Stubs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            import mypy as _
        except ImportError:
            raise unittest.SkipTest('mypy is missing') from None

    def test_mypy_checks_scripts(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text, faults in (('right.py', SCRIPT, 0),
                                       ('wrong.py', SCRIPT.replace("'natural'", "'cubic'"), 1),
                                       ('also.py', SCRIPT.replace('max_error=', 'maximum='), 1)):
                with open(os.path.join(folder, name), 'w', encoding='utf-8') as file:
                    file.write(textwrap.dedent(text))
                result = mypy(folder, 'mypy', '--strict', '--no-error-summary', name)
                self.assertEqual(result.returncode, faults, result.stdout)

    def test_stubs_match_the_module(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, 'mypy.ini'), 'w', encoding='utf-8') as file:
                file.write('[mypy]\nignore_missing_imports = True\n')
                for name in os.listdir(terrace.__path__[0]):
                    if name.startswith('_') and name.endswith('.py') and name != '__init__.py':
                        file.write(f'[mypy-terrace.{name[:-3]}]\nignore_errors = True\n')
            result = mypy(folder, 'mypy.stubtest', 'terrace', '--ignore-missing-stub', '--mypy-config-file', 'mypy.ini')
            self.assertEqual(result.returncode, 0, result.stdout)


if __name__ == '__main__':
    unittest.main()
