#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that golden_test.py finds every kind of difference and names the command and the output.

TERRACE=path/to/terrace golden_check_test.py
"""

import contextlib
import io
import os
import re
import shutil
import tempfile
import unittest

import golden_test

LIST = '''# A comment stays unchanged.
$ inputs

$ terrace build twice.xyz -o twice.terrace --block 300
= --threads 1
$ terrace points twice.terrace --level 1 -o some.csv
$ terrace convert - --format csv -o - < twice.xyz
'''


class GoldenCheckTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        inputs = tempfile.TemporaryDirectory()
        cls.addClassCleanup(inputs.cleanup)
        names = golden_test.make_inputs(inputs.name)

        def copy(folder):
            shutil.copytree(inputs.name, folder, dirs_exist_ok=True)
            return names

        make = golden_test.make_inputs
        cls.addClassCleanup(setattr, golden_test, 'make_inputs', make)
        golden_test.make_inputs = copy

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.list = os.path.join(folder.name, 'list.txt')
        self.write(LIST)

    def write(self, text):
        with open(self.list, 'w', encoding='utf-8') as file:
            file.write(text)

    def read(self):
        with open(self.list, encoding='utf-8') as file:
            return file.read()

    def check(self, *options):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = golden_test.main(['--list', self.list, *options])
        return code, out.getvalue()

    def assert_differs(self, *words):
        code, out = self.check()
        self.assertEqual(code, 1, out)
        for word in words:
            self.assertIn(word, out)

    def test_an_updated_list_passes_and_stays_unchanged(self):
        self.assertEqual(self.check('--update')[0], 0)
        text = self.read()
        self.assertEqual([line for line in text.splitlines(True) if not line.startswith('  ')],
                         LIST.splitlines(True))
        for pattern in (r'\n  summary \{"points": ', r'\n  [0-9a-f]{64} twice\.terrace\n',
                        r'\n  [0-9a-f]{64} twice\.terrace/manifest\.json\n',
                        r'\n  [0-9a-f]{64} some\.csv\n', r'\n  [0-9a-f]{64} -\n'):
            self.assertRegex(text, pattern)
        self.assertEqual(self.check()[0], 0)
        self.assertEqual(self.check('--update')[0], 0)
        self.assertEqual(self.read(), text)

    def test_names_the_command_and_the_first_differing_output(self):
        self.check('--update')
        text = self.read()
        self.write(re.sub(r'[0-9a-f]{64} some\.csv', '0' * 64 + ' some.csv', text))
        self.assert_differs(': terrace points', '0' * 64 + ' some.csv', '--update', '1 of 4 commands')
        self.write(text.replace('"points": ', '"points": 1'))
        self.assert_differs('terrace build', '"points": 1')
        self.write(re.sub(r'  [0-9a-f]{64} -\n', '', text))
        self.assert_differs('terrace convert', 'new: ')
        self.write(re.sub(r'( [0-9a-f]{64} -\n)', r'\1  ' + 'f' * 64 + ' more\n', text))
        self.assert_differs('terrace convert', 'missing now: ' + 'f' * 64)
        self.write(re.sub(r'[0-9a-f]{64} ring\.ply', '0' * 64 + ' ring.ply', text))
        self.assert_differs('inputs', 'ring.ply')

    def test_checks_options_that_must_not_change_the_output(self):
        self.write(LIST.replace('= --threads 1', '= --seed 2'))
        self.assertEqual(self.check('--update')[0], 1)
        self.assert_differs('terrace build', 'with --seed 2')

    def test_rejects_a_failing_command(self):
        self.write(LIST.replace('--level 1', '--level 99'))
        before = self.read()
        code, out = self.check('--update')
        self.assertEqual(code, 1)
        self.assertIn('terrace points', out)
        self.assertIn('exit code 2', out)
        self.assertEqual(self.read(), before)


if __name__ == '__main__':
    unittest.main()
