#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the keys of docs/reference/json.md with those that the command prints.

TERRACE=path/to/terrace json_keys_test.py

Every printed key is documented for its verb, and every documented key is printed by one of the runs.
"""

import json
import os
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TERRACE = os.path.abspath(os.environ['TERRACE'])
COMMON = 'Every verb that makes something'
# Objects whose keys are data.
DATA = {'parameters'}


def documented():
    """The keys of each section."""
    with open(os.path.join(ROOT, 'docs/reference/json.md'), encoding='utf-8') as file:
        parts = re.split(r'^## (.*)\n', file.read(), flags=re.MULTILINE)
    sections = {}
    for heading, body in zip(parts[1::2], parts[2::2]):
        cells = re.findall(r'^\| ([^|]*) \|', body, re.MULTILINE)
        sections[heading] = {key for cell in cells for key in re.findall(r'`([^`]+)`', cell)}
    return sections


def keys_of(value, path=''):
    """The keys of all leaves: `a.b` in objects, `a[].b` in arrays of objects."""
    if isinstance(value, dict) and value and path not in DATA:
        for key, below in value.items():
            yield from keys_of(below, f'{path}.{key}' if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for element in value:
            yield from keys_of(element, path + '[]')
    else:
        yield path


class JsonKeysTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='terrace-json-')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.seen = {}
        cls.make_inputs()
        cls.run_all()

    @classmethod
    def run_command(cls, line, exit_code=0):
        result = subprocess.run([TERRACE, *line.split()], cwd=cls.folder, capture_output=True, text=True, timeout=300,
                                check=False)
        if result.returncode != exit_code:
            raise AssertionError(f'terrace {line}: exit code {result.returncode}\n{result.stderr}')
        return result

    @classmethod
    def write(cls, name, content):
        with open(os.path.join(cls.folder, name), 'wb' if isinstance(content, bytes) else 'w') as file:
            file.write(content)

    @classmethod
    def make_inputs(cls):
        for line in ('synth dem --size 129x129 -o dem.tif', 'build dem.tif -o dem.st', 'synth surface --points 2k -o scan.ply',
                     'build scan.ply -o scan.st', 'synth surface --points 1k --seed 2 -o other.ply', 'build other.ply -o other.st',
                     'build scan.ply -o body.st --surface', 'build scan.ply --crs EPSG:2225 -o feet.st', 'tile dem.st --vertical ignore --zoom 0-11 -o tiles',
                     'mesh dem.st --smooth laplacian -o smooth.ply --save-overlay heights.overlay',
                     'convert scan.ply -o scan.copc.laz', 'surface scan.st -o body.ply',
                     'cluster scan.ply --method single --dendrogram tree.csv', 'match scan.ply -o pairs.csv'):
            cls.run_command(line)
        shutil.copytree(os.path.join(cls.folder, 'dem.st'), os.path.join(cls.folder, 'damaged.st'))
        name = next(name for name in sorted(os.listdir(os.path.join(cls.folder, 'damaged.st'))) if not name.endswith('.json'))
        with open(os.path.join(cls.folder, 'damaged.st', name), 'r+b') as file:
            file.seek(100)
            byte = file.read(1)
            file.seek(100)
            file.write(bytes([byte[0] ^ 1]))
        cls.write('places.csv', 'x,y\n400100,5199900\n')
        cls.write('gaps.csv', 'x,y,z,a\n0,0,0,1\n1,0,0,\n0,1,1,2\n')
        cls.write('thirds.csv', 'x,y,z\n0.3333333333333,0,0\n1000000,0,0\n')
        cls.write('lines.geojson', json.dumps({'type': 'LineString', 'coordinates': [[7, 46], [7.1, 46], [7.1, 46.1]]}))
        # A LAS file of one point, of format 6, which is withheld.
        point = struct.pack('<iiiHBBBBhHd', 0, 0, 0, 0, 0x11, 4, 0, 0, 0, 0, 0.0)
        header = struct.pack('<4sHHIHH8sBB32s32sHHHIIBHI20s6d6dQQIQ15Q', b'LASF', 0, 16, 0, 0, 0, b'', 1, 4, b'', b'', 1, 2026, 375, 375,
                             0, 6, 30, 0, b'', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, *[0] * 14)
        cls.write('withheld.las', header + point)
        cls.write('line.geojson', json.dumps({'type': 'LineString', 'coordinates': [[400100, 5199900], [401000, 5199000]]}))

    @classmethod
    def run_all(cls):
        for line, exit_code in (
                ('build dem.tif -o a.st', 0), ('build dem.tif -o a.st --append', 0), ('merge scan.st other.st -o c.st', 0), ('build scan.ply -o b.st --surface', 0), ('info body.st', 0), ('info dem.tif', 0), ('info dem.st', 0), ('info scan.copc.laz', 0),
                ('info gaps.csv', 0), ('info withheld.las', 0), ('verify dem.st', 0), ('verify damaged.st', 1),
                ('verify tiles --store dem.st --vertical ignore', 0), ('points dem.st --level 1 -o a.csv', 0),
                ('points dem.st --near 400100,5199900 -k 3 -o b.csv', 0), ('points dem.st --overlay heights.overlay -o c.csv', 0),
                ('build lines.geojson -o lines.st --entities polylines', 0), ('points lines.st -o part.geojson', 0),
                ('points dem.st --to-crs EPSG:4326 -o d.las', 0),
                ('mesh dem.st --smooth laplacian -o e.ply --save-overlay e.overlay', 0), ('mesh dem.st --max-error 5 -o f.glb', 0),
                ('surface scan.st -o g.ply --smooth taubin', 0), ('surface scan.st -o g2.ply --max-error 1', 0),
                ('surface scan.st -o g.vtk --tetrahedra', 0), ('surface feet.st -o g.glb', 0), ('mesh feet.st -o f2.glb', 0),
                ('tile dem.st --vertical ignore --zoom 0-10 -o h', 0), ('sample dem.st --points places.csv -o i.csv', 0),
                ('raster dem.st -o j.tif', 0), ('profile dem.st --line 400100,5199900,401000,5199000 -o k.csv', 0),
                ('contour dem.st --interval 20 -o l.geojson', 0), ('contour dem.st --interval 20 --max-error 2 -o l2.geojson', 0),
                ('sample dem.st --points places.csv --max-error 2 -o i2.csv', 0), ('raster dem.st --max-error 2 -o j2.tif', 0),
                ('profile dem.st --line 400100,5199900,401000,5199000 --max-error 2 -o k2.csv', 0),
                ('cluster scan.ply -o m.ply', 0), ('match scan.ply -o n.csv', 0),
                ('match body.ply -o o.csv --tree --entities triangles', 0), ('render dem.tif -o p.png --size 64x64', 0),
                ('render line.geojson -o q.png --size 64x64', 0), ('render tree.csv -o r.png --size 64x64', 0),
                ('render pairs.csv --points scan.ply -o s.png --size 64x64', 0), ('publish dem.st -o t', 0),
                ('synth dem --size 9x9 -o u.tif', 0), ('synth uniform --points 9 -o v.ply', 0), ('convert thirds.csv -o w.las', 0)):
            result = cls.run_command(line + ' --json -q', exit_code)
            cls.seen.setdefault(line.split()[0], set()).update(keys_of(json.loads(result.stdout)))
        cls.seen['view'] = cls.view()

    @classmethod
    def view(cls):
        """Interrupts the viewer and returns the keys that it has printed."""
        with subprocess.Popen([TERRACE, 'view', 'dem.st', '--no-open', '--port', '0', '--json'], cwd=cls.folder,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as viewer:
            for line in viewer.stderr:
                if 'http://' in line:
                    break
            viewer.send_signal(signal.SIGINT)
            printed = viewer.communicate(timeout=60)[0]
        return set(keys_of(json.loads(printed)))

    def test_every_printed_key_is_documented(self):
        sections = documented()
        for verb, seen in self.seen.items():
            self.assertEqual(seen - sections[verb] - sections[COMMON], set(), verb)

    def test_every_documented_key_is_printed(self):
        sections = documented()
        for verb, seen in self.seen.items():
            self.assertEqual(sections[verb] - seen, set(), verb)
        self.assertEqual(sections[COMMON] - set().union(*self.seen.values()), set())

    def test_every_verb_has_a_section(self):
        text = subprocess.run([TERRACE, '--help'], capture_output=True, text=True, check=True, timeout=60).stdout
        verbs = re.findall(r'^  ([a-z]+) ', re.search(r'\nVerbs:\n(.*?)\n\n', text, re.DOTALL).group(1), re.MULTILINE)
        self.assertGreater(len(verbs), 15)
        self.assertEqual(set(documented()) - {COMMON, 'Progress'}, set(verbs))
        self.assertEqual(set(self.seen), set(verbs))

    def test_keys_of_progress(self):
        # A fast machine may make a small file before the first line is due.
        for side in 3000, 6000, 12000, 24000:
            result = self.run_command(f'synth dem --size {side}x{side} -o large.tif --progress json --force')
            lines = [json.loads(line) for line in result.stderr.splitlines() if line.startswith('{')]
            if lines:
                break
        self.assertGreater(len(lines), 0)
        wanted = {key for key in documented()['Progress'] if not key.startswith('_')} - {'points', 'tiles'}
        for line in lines:
            counted = [key for key in line if f'{key}_per_second' in line]
            self.assertEqual(len(counted), 1, line)
            self.assertEqual(set(line), wanted | {counted[0], f'{counted[0]}_per_second'})


if __name__ == '__main__':
    unittest.main()
