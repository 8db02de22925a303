# SPDX-License-Identifier: Apache-2.0
"""The types and names in the sources: complete, those of the compiled half, and a check of users' scripts."""

import inspect
import os
import subprocess
import sys
import tempfile
import typing
import unittest

import terrace
from terrace import _core, _names

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
result = terrace.stream_clusters([points], lambda block: print(block.points.shape, block.level), effort='fast')
model = terrace.Multiresolution(terrace.open('x'))
print(model.expand(model.children()[0]).added_triangles)
volume = terrace.Multiresolution(terrace.open('x'), kind='volume')
print(volume.expand(volume.children()[0]).added_tetrahedra, volume.tetrahedra[1].shape)
lonlat = terrace.Transformation('EPSG:32632', 4326).forward(terrace.xyz(points)[:, :2])
clusters = terrace.cluster(lonlat, 0.1, method='kd-tree', start=terrace.cluster(lonlat, 0.1))
tree = terrace.PointTree(lonlat, terrace.rotate_tree(terrace.linkage(lonlat), lonlat))
mates = terrace.halving_matching(lonlat, iterations=9).mates
print(delta.added_corners.shape, terrace.kmeans(inside, 3).centres, terrace.Delaunay2([[0, 0]]).simplices)
surface: terrace.Mesh = store.surface()
corners, tetrahedra = store.surface(tetrahedra=True)
try:
    surface.save('x.ply')
except terrace.Error as error:
    print(error.args)
'''
# The compiled half and parts of numpy have no types.
PACKAGE = ['--strict', '--no-warn-return-any', '--allow-untyped-calls']


def mypy(folder, *arguments):
    """Runs mypy in a folder. Errors in the package do not count unless it is checked."""
    environment, found = dict(os.environ), os.path.dirname(terrace.__path__[0])
    if not found.endswith('-packages'):  # the interpreter's own packages are found anyway
        environment.update(MYPYPATH=found, PYTHONPATH=found)
    with open(os.path.join(folder, 'mypy.ini'), 'w', encoding='utf-8') as file:
        file.write('[mypy]\n[mypy-tqdm.*]\nignore_missing_imports = True\n')
    return subprocess.run([sys.executable, '-m', 'mypy', '--no-error-summary', *arguments], cwd=folder, stdout=subprocess.PIPE, text=True,
                          stderr=subprocess.STDOUT, env=environment)


def parts_of(name, item):
    """Returns the functions of a public function or class, with their names."""
    if not isinstance(item, type):
        return [(name, item)]
    found = []
    for base in item.__mro__:
        for member, value in vars(base).items() if base.__module__.startswith('terrace.') else ():
            value = value.fget if isinstance(value, property) else getattr(value, '__func__', value)
            if inspect.isfunction(value) and os.path.isfile(value.__code__.co_filename):  # not made by dataclass
                found.append((f'{name}.{member}', value))
    return found


class Types(unittest.TestCase):
    def test_everything_public_has_types(self):
        count = 0
        for public in terrace.__all__:
            for name, function in parts_of(public, getattr(terrace, public)):
                hints = typing.get_type_hints(function, include_extras=True)
                for parameter in list(inspect.signature(function).parameters)[1 if '.' in name else 0:]:
                    self.assertIn(parameter, hints, name)
                self.assertIn('return', hints, name)
                count += 1
        self.assertGreater(count, 150)

    def test_names_are_those_of_the_compiled_half(self):
        known = _core.names()
        subsets = {'MatrixMethod': 'ClusterMethod'}
        literals = {name: typing.get_args(value) for name, value in vars(_names).items() if typing.get_origin(value) is typing.Literal}
        for name, whole in subsets.items():
            self.assertLess(set(literals.pop(name)), set(literals[whole]))
        self.assertEqual(literals, known)


class Mypy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            import mypy as _
        except ImportError:
            raise unittest.SkipTest('mypy is missing') from None

    def test_scripts_of_users(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text, faults in (('right.py', SCRIPT, 0),
                                       ('wrong.py', SCRIPT.replace("'natural'", "'cubic'"), 1),
                                       ('also.py', SCRIPT.replace('max_error=', 'maximum='), 1),
                                       ('solid.py', SCRIPT.replace("kind='volume'", ''), 1),
                                       ('other.py', SCRIPT.replace('error.args', 'error.place'), 1)):
                with open(os.path.join(folder, name), 'w', encoding='utf-8') as file:
                    file.write(text)
                result = mypy(folder, '--strict', '--follow-imports=silent', name)
                self.assertEqual(result.returncode, faults, result.stdout)

    def test_the_package(self):
        with tempfile.TemporaryDirectory() as folder:
            result = mypy(folder, *PACKAGE, '-p', 'terrace')
            self.assertEqual(result.returncode, 0, result.stdout)


if __name__ == '__main__':
    unittest.main()
