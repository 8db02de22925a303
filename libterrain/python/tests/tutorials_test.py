# SPDX-License-Identifier: Apache-2.0
"""The tutorials run as they stand, cell by cell as in a notebook, and their objects have pictures."""

import contextlib
import io
import os
import re
import sys
import tempfile
import unittest
from unittest import mock

from python_case import ALPS, ROOT

FOLDER = os.path.join(ROOT, 'libterrain', 'python', 'tutorials')


def run(name):
    """What the script prints, its names at the end, and how many cells end in an object with a picture."""
    with open(os.path.join(FOLDER, name), encoding='utf-8') as file:
        text = file.read()
    names, printed, pictures = {}, io.StringIO(), 0
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(printed), \
            contextlib.redirect_stderr(io.StringIO()), mock.patch.object(sys, 'argv', [name, ALPS]):
        before = os.getcwd()
        os.chdir(folder)
        try:
            for cell in re.split(r'^# %%.*\n', text, flags=re.MULTILINE):
                exec(compile(cell, name, 'exec'), names)
                last = cell.strip().splitlines()[-1] if cell.strip() else ''
                if re.match(r'[a-z_]+ *(#.*)?$', last):
                    shown = eval(last, names)
                    pictures += '<polygon' in shown._repr_svg_()
            files = sorted(os.listdir('.'))
        finally:
            os.chdir(before)
    return printed.getvalue(), files, pictures


class Tutorials(unittest.TestCase):
    def test_terrain(self):
        printed, files, pictures = run('terrain.py')
        self.assertIn('1338658 points', printed)
        self.assertEqual(files, ['alps.ply', 'alps.png', 'alps.store'])
        self.assertEqual(pictures, 1)

    def test_lidar(self):
        printed, files, _ = run('lidar.py')
        self.assertIn('150000 points', printed)
        self.assertEqual(files, ['ground.store', 'ground.tif', 'scan.store'])

    def test_clustering(self):
        printed, _, pictures = run('clustering.py')
        self.assertIn('optimal', printed)
        self.assertEqual(pictures, 1)

    def test_all_are_here(self):
        scripts = {name for name in os.listdir(FOLDER) if name.endswith('.py')}
        self.assertEqual(scripts, {'terrain.py', 'lidar.py', 'clustering.py'})


if __name__ == '__main__':
    unittest.main()
