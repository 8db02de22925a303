#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the rules of pages.py: it finds each fault of a page."""

import os
import sys
import tempfile
import unittest
from unittest import mock

import pages
from pages import MOST_SKIPPED, Fault, Page


class PagesTest(unittest.TestCase):
    def run_text(self, *lines):
        with tempfile.TemporaryDirectory() as folder:
            return Page('\n'.join(lines) + '\n', folder, dict(os.environ), sys.executable).run()

    def assert_fault(self, reason, *lines):
        with self.assertRaisesRegex(Fault, reason):
            self.run_text(*lines)

    def test_output_is_compared(self):
        self.assertEqual(self.run_text('```sh', 'echo a; echo b >&2', '```', 'Prints:', '```text', 'a', 'b', '```'),
                         '1 blocks ran, 1 outputs compared')
        self.assert_fault(r'line 4: the output differs:\n(.*\n)*-b\n\+a', '```sh', 'echo a', '```', '```text', 'b', '```')
        self.assert_fault('differs', '```sh', 'echo a; echo b', '```', '```text', 'a', '```')
        self.assert_fault('differs', '```sh', 'echo a', '```', '```text', 'a', 'b', '```')

    def test_output_may_be_shortened(self):
        show = ['```sh', 'printf "a 1\\nb\\nc\\nd 2\\n"', '```', '```text']
        self.run_text(*show, 'a 1', '...', 'd 2', '```')
        self.run_text(*show, 'a ...', 'b', 'c', 'd 2', '```')
        self.assert_fault('differs', *show, 'a 1', '...', 'c', '```')
        self.assert_fault('differs', *show, '...', 'a 1', 'd 2', '```')
        self.assert_fault('shows no output', *show, '...', '```')

    def test_text_within_a_line_may_be_left_out(self):
        show = ['```sh', 'echo "7 points in 0.25 s, 4 MiB"', '```', '```text']
        self.run_text(*show, '7 points in ..., 4 MiB', '```')
        self.assert_fault('differs', *show, '8 points in ..., 4 MiB', '```')
        self.assert_fault('differs', *show, '7 points in ..., 5 MiB', '```')
        self.assert_fault('differs', *show, '7 points in 0.26 s, 4 MiB', '```')

    def test_failures_are_found(self):
        self.assert_fault('exit status 1', '```sh', 'false', 'true', '```')
        self.assert_fault('exit status 1', '```sh', 'false | true', '```')
        self.assert_fault('exit status 0', '<!-- test: exit 2 -->', '```sh', 'true', '```')
        self.run_text('<!-- test: exit 2 -->', '```sh', 'exit 2', '```')
        self.assert_fault('ZeroDivisionError', '```python', '1 / 0', '```')
        self.assert_fault('ended without an address', '<!-- test: serves -->', '```sh', 'echo no', '```')

    def test_a_block_without_end_is_stopped(self):
        with mock.patch.object(pages, 'SECONDS', 0.3):
            self.assert_fault('not done after 0.3 s', '```sh', 'sleep 60 | cat', '```')

    def test_blocks_share_a_folder_and_python_its_names(self):
        self.run_text('<!-- test: file a/b.txt -->', '```json', '{}', '```', '```python', 'x = open("a/b.txt").read()', '```',
                      '```python', 'print(x)', '```', '```text', '{}', '...', '```', '```sh', 'test -f a/b.txt', '```')

    def test_every_block_says_how_it_is_tested(self):
        self.assert_fault('must say how', '```json', '{}', '```')
        self.assert_fault('must say how', '```', 'x', '```')
        self.assert_fault('unknown mark', '<!-- test: skip -->', '```sh', 'x', '```')
        self.assert_fault('unknown mark', '<!-- test: ignore it -->', '```sh', 'x', '```')
        self.assert_fault('text between', '<!-- test: skip why -->', 'Text', '```sh', 'x', '```')
        self.assert_fault('must start its line', '  ```sh', '  x', '  ```')
        self.assert_fault('not closed', '```sh', 'x')
        self.assert_fault('without a block before', '```text', 'x', '```')

    def test_skipped_blocks_are_counted(self):
        block = ['<!-- test: skip it stays up -->', '```sh', 'exit 1', '```', '```text', 'not compared', '```']
        self.assertEqual(self.run_text(*block), '0 blocks ran, 0 outputs compared; skipped: it stays up')
        self.assert_fault('blocks are skipped', *block * (MOST_SKIPPED + 1))
        self.assertIn('no-such-program is not installed',
                      self.run_text('<!-- test: needs no-such-program -->', '```sh', 'no-such-program', '```'))

    def test_a_server_is_interrupted(self):
        serve = 'python3 -c "import time; print(\'http://127.0.0.1:1/\', flush=True); time.sleep(99)" 2>/dev/null'
        self.assertIn('1 blocks ran, 1 outputs compared',
                      self.run_text('<!-- test: serves -->', '```sh', serve, '```', '```text', 'http://...', '```'))

    def test_excerpts_are_those_of_a_file(self):
        mark = '<!-- test: excerpt tests/docs/pages_test.py -->'
        self.run_text(mark, '```python', 'class PagesTest(unittest.TestCase):', '...', '    unittest.main()', '```')
        self.assert_fault('not in tests/docs', mark, '```python', 'class Other:', '```')
        self.assert_fault('not in tests/docs', mark, '```python', 'import os', 'import tempfile', '```')


if __name__ == '__main__':
    unittest.main()
