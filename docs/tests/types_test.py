#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks docs/reference/cpp/index.md: at most 40 types, which their headers declare, and examples that compile.

types_test.py --compiler COMMAND...
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
LIBRARIES = ['base', 'stream', 'cluster', 'matching', 'tri', 'terrain']
MOST_TYPES = 40
COMPILER = []


def page():
    with open(os.path.join(ROOT, 'docs/reference/cpp/index.md'), encoding='utf-8') as file:
        return file.read()


def entries():
    """(types, header) of each entry."""
    return [(re.findall(r'`([a-z]+::\w+)`', names), header)
            for names, header in re.findall(r'^((?:`[a-z]+::\w+`(?:, )?)+) \(`(\w+\.hpp)`\)$', page(), re.MULTILINE)]


class TypesTest(unittest.TestCase):
    def test_at_most_forty_types(self):
        types = [name for names, _ in entries() for name in names]
        self.assertGreater(len(types), 30)
        self.assertLessEqual(len(types), MOST_TYPES)
        self.assertEqual(len(types), len(set(types)))

    def test_headers_declare_the_types(self):
        for names, header in entries():
            for name in names:
                library, kind = name.split('::')
                path = os.path.join(ROOT, f'lib{library}/include/terrace/{library}/{header}')
                with open(path, encoding='utf-8') as file:
                    self.assertRegex(file.read(), rf'(?:class|struct|using) {kind}\b', name)

    def test_each_type_has_one_line_and_an_example(self):
        text = page()
        # A type, its one line, an example.
        parts = re.findall(r'^`[a-z]+::.*\n: (.*)\n\n```cpp\n', text, re.MULTILINE)
        self.assertEqual(len(parts), len(entries()))
        for line in parts:
            self.assertLessEqual(len(line), 100)

    def test_examples_compile(self):
        if not COMPILER:
            self.skipTest('no compiler was given')
        blocks = re.findall(r'^```cpp\n(.*?)^```$', page(), re.DOTALL | re.MULTILINE)
        headers = sorted({f'<terrace/{names[0].split("::")[0]}/{header}>' for names, header in entries()} |
                         {'<terrace/terrain/detail_mesh.hpp>', '<terrace/matching/matching_tree.hpp>', '<terrace/cluster/linkage.hpp>',
                          '<cstdio>'})
        code = ''.join(f'#include {header}\n' for header in headers)
        code += ''.join(f'namespace {library} = terrace::{library};\n' for library in LIBRARIES)
        # Variables are declared where the page explains them, which for two is after their first use.
        early = [block for block in blocks if block.startswith(('const stream::Store store', 'tri::View camera'))]
        self.assertEqual(len(early), 2)
        lines = ''.join(early + [block for block in blocks if block not in early])
        code += f'void examples() {{\n{lines}}}\n'
        with tempfile.NamedTemporaryFile('w', suffix='.cpp') as file:
            file.write(code)
            file.flush()
            includes = [f'-I{ROOT}/lib{library}/include' for library in LIBRARIES]
            result = subprocess.run([*COMPILER, '-std=c++20', '-fsyntax-only', *includes, file.name], capture_output=True, text=True,
                                    check=False, timeout=280)
        self.assertEqual(result.returncode, 0, result.stderr[:4000])


if __name__ == '__main__':
    if '--compiler' in sys.argv:
        at = sys.argv.index('--compiler')
        COMPILER = sys.argv[at + 1:]
        del sys.argv[at:]
    unittest.main()
