# SPDX-License-Identifier: Apache-2.0
"""The module writes the same bytes as the command, as listed in its golden results."""

import json
import os
import shlex
import sys
import tempfile
import unittest

import terrace
from terrace import _core
from terrace._call import call_settings
from python_case import ROOT

GOLDEN = os.path.join(ROOT, 'tests', 'golden')
sys.path[:0] = [GOLDEN, os.path.join(ROOT, 'tests', 'cli')]
from golden_inputs import make_inputs  # noqa: E402
import golden_test  # noqa: E402


def golden_lines():
    """Returns the lines below each command of the list, without commands of other programs."""
    lines, below = {}, None
    with open(os.path.join(GOLDEN, 'golden.txt'), encoding='utf-8') as file:
        for line in file:
            if line.startswith('$ terrace '):
                below = lines.setdefault(line[2:].strip(), [])
            elif line.startswith('$'):
                below = None
            elif below is not None and line.startswith('  '):
                below.append(line.strip())
    return lines


class Golden(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.lines = golden_lines()
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.before = os.getcwd()
        os.chdir(cls.folder.name)
        cls.addClassCleanup(os.chdir, cls.before)
        make_inputs('.')
        cls.hills = terrace.build('hills.tif', 'hills.terrace', block_points=150)

    def check(self, command, *, summary=None):
        """Compares the output with the command's lines, or `summary` with its summary line."""
        expected = self.lines[command]
        name = shlex.split(command)[shlex.split(command).index('-o') + 1]
        if summary is not None:
            listed = json.loads(next(line for line in expected if line.startswith('summary '))[8:])
            self.assertEqual(summary, {key: listed[key] for key in summary}, command)
            return
        found = golden_test.hash_lines('.', '', name, rounded=False)
        # The journal of a set of tiles may change between releases.
        kept = [line for line in expected if not line.startswith(('summary ', '~', '='))]
        self.assertEqual([line for line in found if not line.startswith('~')], kept, command)

    def test_stores_match(self):
        self.check('terrace build hills.tif -o hills.terrace --block 150')
        terrace.build('bands.tif', 'bands.terrace', band=2, block_points=300)
        self.check('terrace build bands.tif -o bands.terrace --band 2 --block 300')
        terrace.build(['sheet-west.tif', 'sheet-east.tif'], 'sheets.terrace', block_points=800, facility_cost=2,
                      vertical='orthometric')
        self.check('terrace build sheet-west.tif sheet-east.tif -o sheets.terrace --block 800 --facility-cost 2 '
                   '--vertical orthometric')
        terrace.build('dateline.tif', 'dateline.terrace', seed=7)
        self.check('terrace build dateline.tif -o dateline.terrace --seed 7')
        terrace.build('hills.tif', 'hills-regions.terrace', metric='elliptical:regions.json', effort='full',
                      block_points=600)
        self.check('terrace build hills.tif -o hills-regions.terrace --metric elliptical:regions.json --effort full '
                   '--block 600')
        terrace.build('hills.tif', 'hills-squared.terrace', metric='squared', z_weight=0, block_points=600)
        self.check('terrace build hills.tif -o hills-squared.terrace --metric squared --z-weight 0 --block 600')

    def test_point_clouds_match(self):
        store = terrace.build('laser.csv', 'laser.terrace', crs='EPSG:32632', block_points=400)
        self.check('terrace build laser.csv -o laser.terrace --crs EPSG:32632 --block 400')
        mesh = store.bounded_mesh(5)
        self.check('terrace mesh laser.terrace --max-error 5 -o bound-laser.ply',
                   summary={'vertices': len(mesh.vertices), 'triangles': len(mesh.triangles), 'max_error': mesh.max_error})

    def test_meshes_match(self):
        for more, quality, name in (('', 'removal', 'bound.ply'), (' --quality greedy', 'greedy', 'bound-greedy.obj'),
                                    (' --quality fitted', 'fitted', 'bound-fitted.glb')):
            self.hills.bounded_mesh(20, quality=quality, path=name)
            self.check(f'terrace mesh hills.terrace --max-error 20{more} -o {name}')
        mesh = self.hills.mesh(level=1)
        self.check('terrace mesh hills.terrace --level 1 -o level.ply',
                   summary={'vertices': len(mesh.vertices), 'triangles': len(mesh.triangles)})

    def test_rasters_contours_and_tiles_match(self):
        self.hills.raster(path='same.tif')
        self.check('terrace raster hills.terrace -o same.tif')
        self.hills.raster('slope', cell=40, path='slope.tif')
        self.check('terrace raster hills.terrace --value slope --cell 40 -o slope.tif')
        with open('contour.geojson', 'w', encoding='ascii') as file:
            file.write(_core.contours(self.hills._core, 100, 0, [], None, None, None, None, call_settings())[0])
        self.check('terrace contour hills.terrace --interval 100 -o contour.geojson')
        coast = terrace.build('coast.tif', 'coast.terrace', block_points=500, vertical='ellipsoidal')
        coast.tiles('coast-tiles', (0, 11))
        self.check('terrace tile coast.terrace --format quantized-mesh --zoom 0-11 -o coast-tiles')


if __name__ == '__main__':
    unittest.main()
