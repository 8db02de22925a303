#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the command on stores at URLs, which a server of the test serves and counts.

TERRACE=path/to/terrace network_cli_test.py
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.append(os.path.join(ROOT, 'libstream', 'tests'))
from range_server import RangeServer  # noqa: E402

TERRACE = os.environ.get('TERRACE', 'terrace')
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith('AWS_') and 'proxy' not in name.lower()}
ENVIRONMENT.update(AWS_EC2_METADATA_DISABLED='true', HOME='/nonexistent')


def terrace(*args, **environment):
    return subprocess.run([TERRACE, *map(str, args)], capture_output=True, text=True, timeout=120,
                          env={**ENVIRONMENT, **environment})


def has_network():
    return 'cannot read over the network' not in terrace('info', 'http://127.0.0.1:1/x').stderr


@unittest.skipUnless(has_network(), 'this build has no network')
class NetworkTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.store = cls.path('dem.terrace')
        cls.run_ok('synth', 'dem', '--size', '1500x1500', '-o', cls.path('dem.tif'))
        cls.run_ok('build', cls.path('dem.tif'), '-o', cls.store)
        cls.cloud = cls.path('cloud.terrace')
        cls.run_ok('synth', 'surface', '--points', '60000', '-o', cls.path('cloud.ply'))
        cls.run_ok('build', cls.path('cloud.ply'), '-o', cls.cloud)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        files = {}
        for store in (self.store, self.cloud):
            for name in os.listdir(store):
                with open(os.path.join(store, name), 'rb') as file:
                    files[f'/{os.path.basename(store)}/{name}'] = file.read()
        self.server = RangeServer(files)
        self.addCleanup(self.server.close)
        self.url = self.server.url + '/dem.terrace'

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @staticmethod
    def run_ok(*args, **environment):
        result = terrace(*args, **environment)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def expect_error(self, code, *args, **environment):
        result = terrace(*args, **environment)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, '')
        return result.stderr

    def test_info_reads_the_index_only(self):
        local = self.run_ok('info', self.store, '--json')
        self.assertEqual(json.loads(self.run_ok('info', self.url, '--json')), json.loads(local))
        self.assertEqual([path for path, *_ in self.server.requests if path.endswith('level-0.0.clusters')], [])
        self.assertLess(len(self.server.requests), 20)

    def test_output_of_every_verb_is_as_from_a_folder(self):
        for store in (self.store, self.cloud):
            places = self.path('places.csv')
            box = json.loads(self.run_ok('info', store, '--json'))['bounds']
            with open(places, 'w') as file:
                file.write('x,y\n')
                for share in (0.1, 0.3, 0.5, 0.52, 0.9):
                    x, y = (box['min'][i] + (box['max'][i] - box['min'][i]) * share for i in (0, 1))
                    file.write(f'{x},{y}\n')
            url = f'{self.server.url}/{os.path.basename(store)}'
            for verb in (['points', '--level', '0'], ['points', '--level', '1'], ['mesh', '--level', '1'], ['verify'],
                         ['sample', '--points', places], ['render', '--size', '200x150']):
                suffix = {'points': '.xyz', 'sample': '.csv', 'mesh': '.ply', 'render': '.png'}.get(verb[0])
                outputs = []
                for name in (store, url):
                    command = [verb[0], name, *verb[1:]]
                    if suffix is None:
                        outputs.append([line for line in self.run_ok(*command).splitlines()
                                        if ' in ' not in line and name not in line])
                        continue
                    file = self.path('out' + suffix)
                    self.run_ok(*command, '-o', file)
                    with open(file, 'rb') as written:
                        outputs.append(written.read())
                    os.remove(file)
                with self.subTest(store=os.path.basename(store), verb=verb):
                    self.assertEqual(outputs[0], outputs[1])

    def test_a_small_region_needs_a_small_part(self):
        box = json.loads(self.run_ok('info', self.store, '--json'))['bounds']
        low, high = box['min'], box['max']
        region = ','.join(str(low[i % 2] + (high[i % 2] - low[i % 2]) * share) for i, share in enumerate((0.4, 0.4, 0.5, 0.5)))
        local, remote = self.path('local.xyz'), self.path('remote.xyz')
        self.run_ok('points', self.store, '--region', region, '-o', local)
        self.run_ok('points', self.url, '--region', region, '-o', remote)
        with open(local) as expected, open(remote) as written:
            self.assertEqual(written.read(), expected.read())
        whole = sum(len(data) for path, data in self.server.files.items() if path.startswith('/dem.terrace/'))
        self.assertLess(self.server.sent, whole / 3)
        self.assertLess(len(self.server.requests), 25)

    def test_the_other_schemes(self):
        text = self.run_ok('info', 's3://dem.terrace', AWS_ENDPOINT_URL=self.server.url)
        self.assertIn('2,250,000', text)
        self.assertIn('s3://dem.terrace/manifest.json: the server has no such file',
                      self.expect_error(1, 'info', 's3://dem.terrace', AWS_ENDPOINT_URL=self.server.url + '/none'))

    def test_damage_on_the_server_is_found(self):
        path = '/dem.terrace/level-0.0.clusters'
        data = bytearray(self.server.files[path])
        data[len(data) // 2] ^= 1
        self.server.files[path] = bytes(data)
        result = terrace('verify', self.url)
        self.assertEqual(result.returncode, 1)
        self.assertIn('checksum', result.stdout + result.stderr)
        self.server.files[path] = bytes(data)[:-1]
        self.assertIn('the manifest says', terrace('verify', self.url).stderr)

    def test_faults_of_the_server(self):
        self.server.answers = [503, 'cut', 'reset']
        self.run_ok('info', self.url)
        self.server.access = lambda handler: 403
        host = self.server.url.partition('//')[2]
        error = self.expect_error(1, 'info', f'http://someone:hush@{host}/dem.terrace?key=hidden')
        self.assertIn(self.url + '/manifest.json: the server denies access', error)
        for secret in ('someone', 'hush', 'hidden'):
            self.assertNotIn(secret, error)

    def test_sources_and_outputs_are_not_urls(self):
        self.assertIn('over the network', self.expect_error(1, 'build', self.server.url + '/dem.tif', '-o', self.path('x')))
        self.assertIn('over the network', self.expect_error(1, 'build', self.path('dem.tif'), '-o', self.server.url + '/new'))


if __name__ == '__main__':
    unittest.main()
