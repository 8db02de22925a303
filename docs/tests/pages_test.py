#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests what of the manual needs no Sphinx: links, the pages of the Python module, and the docstrings as lists."""

import ast
import glob
import os
import re
import shutil
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, 'docs/tools'))

import assemble  # noqa: E402
import docstrings  # noqa: E402
import theme  # noqa: E402


def read(path):
    with open(os.path.join(ROOT, path), encoding='utf-8') as file:
        return file.read()


class LinksTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-manual-')
        self.addCleanup(shutil.rmtree, self.folder)

    def test_every_link_leads_somewhere(self):
        out = os.path.join(self.folder, 'manual')
        self.assertEqual(assemble.assemble(ROOT, out), [])
        # The links of the assembled pages lead to files there.
        checked = 0
        for path in glob.glob(os.path.join(out, '**/*.md'), recursive=True):
            if path.startswith(os.path.join(out, 'files')):
                continue
            with open(path, encoding='utf-8') as file:
                text = re.sub(r'^```.*?^```$|`[^`]*`', '', file.read(), flags=re.DOTALL | re.MULTILINE)
            for link in re.findall(r'\]\(([^)\s#]+)', text):
                if not re.match(r'[a-z]+:', link) and not link.endswith('commands/index.md'):
                    self.assertTrue(os.path.isfile(os.path.join(os.path.dirname(path), link)), f'{path}: {link}')
                    checked += 1
        self.assertGreater(checked, 50)

    def test_rewrites_links(self):
        links = assemble.Links(ROOT, assemble.pages(ROOT))
        text = ('[a](../libstream/FORMAT.md#x) `[b](c)` [d](https://e) [f](#g)\n```cpp\n[h](i)\n```\n'
                '[j](../libtri/examples/shape.cpp) [k](../libtri/examples) [`l`](missing.md)')
        self.assertEqual(links.rewrite('docs/index.md', 'index.md', text),
                         '[a](reference/store-format.md#x) `[b](c)` [d](https://e) [f](#g)\n```cpp\n[h](i)\n```\n'
                         '[j](files/libtri/examples/shape.cpp) k [`l`](missing.md)')
        self.assertEqual(links.broken, ['docs/index.md:5: the link to missing.md leads nowhere'])
        self.assertEqual(links.copies, {'libtri/examples/shape.cpp': 'files/libtri/examples/shape.cpp'})

    def test_contents_follow_the_links(self):
        pages = {'index.md': '# I\n[g](g/index.md) [a](a.md)\n\n```{toctree}\np/q\n```\n', 'a.md': '', 'g/index.md': '[y](y.md)\n',
                 'g/x.md': '', 'g/y.md': '', 'g/h/index.md': '', 'p/q.md': '', 'r/s.md': '', 'files/t.md': ''}
        for name, text in pages.items():
            os.makedirs(os.path.join(self.folder, os.path.dirname(name)), exist_ok=True)
            with open(os.path.join(self.folder, name), 'w', encoding='utf-8') as file:
                file.write(text)
        assemble.add_contents(self.folder)

        def contents(name):
            with open(os.path.join(self.folder, name), encoding='utf-8') as file:
                return list(assemble.listed(name, file.read()))

        self.assertEqual(contents('index.md'), ['g/index', 'a', 'p/q'])
        self.assertEqual(contents('g/index.md'), ['g/y', 'g/h/index', 'g/x'])
        self.assertEqual(contents('g/h/index.md'), [])

    def test_every_header_has_a_page(self):
        out = os.path.join(self.folder, 'manual')
        assemble.assemble(ROOT, out)
        headers = glob.glob(os.path.join(ROOT, 'lib*/include/terrace/*/*.hpp'))
        self.assertGreater(len(headers), 80)
        for header in headers:
            library, name = os.path.normpath(header).split(os.sep)[-2:]
            self.assertTrue(os.path.isfile(os.path.join(out, 'reference/cpp', library, name[:-4] + '.md')), header)


class PythonPagesTest(unittest.TestCase):
    def test_every_public_name_is_on_one_page(self):
        package = glob.glob(os.path.join(ROOT, '**/terrace/__init__.py'), recursive=True)
        sources = [path for path in package if not re.match(r'/(build|subprojects)', path[len(ROOT):])]
        self.assertEqual(len(sources), 1)
        with open(sources[0], encoding='utf-8') as file:
            tree = ast.parse(file.read())
        public = next(ast.literal_eval(node.value) for node in tree.body
                      if isinstance(node, ast.Assign) and getattr(node.targets[0], 'id', '') == '__all__')
        documented = [name for path in sorted(glob.glob(os.path.join(ROOT, 'docs/reference/python/*.md')))
                      for name in re.findall(r'^\.\. auto\w+:: terrace\.(\w+)', read(os.path.relpath(path, ROOT)), re.MULTILINE)]
        self.assertEqual(sorted(documented), sorted(public))


class ThemeTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-theme-')
        self.addCleanup(shutil.rmtree, self.folder)

    def mended(self, script, style):
        for name, text in (('scripts/furo.js', script), ('scripts/gumshoe-patched.js', 'gumshoe;\n'), ('styles/furo.css', style)):
            os.makedirs(os.path.dirname(os.path.join(self.folder, name)), exist_ok=True)
            with open(os.path.join(self.folder, name), 'w', encoding='utf-8') as file:
                file.write(text)
        theme.mend(self.folder)
        for name in ('scripts/furo.js', 'styles/furo.css'):
            with open(os.path.join(self.folder, name), encoding='utf-8') as file:
                yield file.read()

    def test_mends_what_is_broken(self):
        script, style = self.mended(theme.IMPORT + 'main;\n', 'a {}\nbody[data-theme="dark"] { --x: 1; }\n')
        self.assertEqual(script, 'gumshoe;\nmain;\n')
        self.assertTrue(style.startswith('a {}\nbody[data-theme="dark"] { --x: 1; }\n'))
        self.assertIn('@media (prefers-color-scheme: dark) {\n  body:not([data-theme="light"]) { --x: 1; }\n}', style)

    def test_leaves_other_releases_as_they_are(self):
        style = 'body[data-theme="dark"] {} @media (prefers-color-scheme: dark) {}'
        self.assertEqual(list(self.mended('bundled;\n', style)), ['bundled;\n', style])


class DocstringsTest(unittest.TestCase):
    def test_entries_become_a_list(self):
        self.assertEqual(
            docstrings.convert(['Does it.', '', 'a: the first,', '    continued.', 'b, c: others.', '', 'Note: text.', '',
                                'Returns: a number.'], {'a', 'b', 'c'}),
            ['Does it.', '', '``a``', '    the first,', '    continued.', '``b``, ``c``', '    others.', '', 'Note: text.', '',
             '**Returns**', '    a number.'])

    def test_text_and_entries_are_separated(self):
        self.assertEqual(docstrings.convert(['Text:', 'a: x.', 'More.'], {'a'}),
                         ['Text:', '', '``a``', '    x.', '', 'More.'])

    def test_parameters_of(self):
        def function(one, *, two=1, **three):
            return one, two, three

        self.assertEqual(docstrings.parameters_of(function), {'one', 'two', 'three'})
        self.assertEqual(docstrings.parameters_of(3), set())


if __name__ == '__main__':
    unittest.main()
