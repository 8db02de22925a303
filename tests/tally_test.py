#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests how tally.py counts the output of each kind of test program."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

TALLY = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'tally.py')

GTEST = '''[ RUN      ] Grid.Is
[       OK ] Grid.Is (3 ms)
[ RUN      ] Grid.HasData
../grid_test.cpp:17: Skipped
TERRACE_DATA is not set

[  SKIPPED ] Grid.HasData (0 ms)
[ RUN      ] Grid.Lemon
../grid_test.cpp:29: Skipped
LEMON is not installed

[  SKIPPED ] Grid.Lemon (0 ms)
[  FAILED  ] All/Grid.Of/3, where GetParam() = 7 (12 ms)
[  FAILED  ] All/Grid.Of/3, where GetParam() = 7
'''
UNITTEST = '''test_a (__main__.CaseTest.test_a) ... ok
test_b (__main__.CaseTest.test_b)
What it does. ... skipped 'not installed: cs2cs'
test_c (__main__.CaseTest.test_c) ... ok

----------------------------------------------------------------------
Ran 3 tests in 0.010s

OK (skipped=1)
'''
NODE = '# tests 4\n# pass 3\n# fail 0\n# cancelled 0\n# skipped 1\n'


def tally(*rows, required=False):
    """Returns (exit status, lines printed) for programs given as (result, output)."""
    with tempfile.NamedTemporaryFile('w', suffix='.json') as log:
        for number, (result, text) in enumerate(rows):
            log.write(json.dumps({'name': f'program{number}', 'result': result, 'stdout': text}) + '\n')
        log.flush()
        environment = {**os.environ, 'TERRACE_REQUIRE_ORACLES': '1' if required else ''}
        run = subprocess.run([sys.executable, '-B', TALLY, log.name], capture_output=True, text=True,
                             env=environment)
    return run.returncode, run.stdout.splitlines()


class TallyTest(unittest.TestCase):
    def test_counts_and_names_googletest_cases(self):
        status, lines = tally(('FAIL', GTEST))
        self.assertEqual(status, 1)
        self.assertEqual(lines[-1], '1 passed, 1 failed, 2 skipped')
        self.assertIn('left out: 1: TERRACE_DATA is not set (Grid.HasData)', lines)
        self.assertIn('FAIL: program0 All/Grid.Of/3', lines)
        self.assertIn('    ../grid_test.cpp:17: Skipped', lines)

    def test_counts_and_names_unittest_cases(self):
        status, lines = tally(('OK', UNITTEST))
        self.assertEqual((status, lines), (0, ['left out: 1: not installed: cs2cs (test_b)',
                                               '2 passed, 0 failed, 1 skipped']))

    def test_counts_node_cases(self):
        self.assertEqual(tally(('OK', NODE))[1][-1], '3 passed, 0 failed, 1 skipped')

    def test_counts_a_program_without_cases_as_one(self):
        status, lines = tally(('OK', 'done'), ('SKIP', 'npm is not installed\n'))
        self.assertEqual((status, lines[-1]), (0, '1 passed, 0 failed, 1 skipped'))
        self.assertIn('left out: 1: npm is not installed (program1)', lines)

    def test_fails_if_a_program_stops_before_naming_a_case(self):
        status, lines = tally(('OK', 'done'), ('TIMEOUT', '[       OK ] Grid.Is (3 ms)\n'))
        self.assertEqual((status, lines[-1]), (1, '2 passed, 1 failed, 0 skipped'))

    def test_fails_if_nothing_passed(self):
        self.assertEqual(tally(('SKIP', 'no browser'))[0], 1)

    def test_can_require_everything_that_can_be_installed(self):
        self.assertEqual(tally(('OK', UNITTEST))[0], 0)
        self.assertEqual(tally(('OK', UNITTEST), required=True)[0], 1)
        lacks_data = '[       OK ] A.B (0 ms)\n../a.cpp:1: Skipped\nTERRACE_DATA is not set\n\n' \
                     '[  SKIPPED ] A.C (0 ms)\n'
        self.assertEqual(tally(('OK', lacks_data), required=True)[0], 0)
        sanitized = lacks_data.replace('TERRACE_DATA is not set', "the sanitizer's memory is not an input's")
        self.assertEqual(tally(('OK', sanitized), required=True)[0], 0)


if __name__ == '__main__':
    unittest.main()
