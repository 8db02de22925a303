#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that the checks of language and of commit messages find each fault, and nothing in plain text."""

import os
import tempfile
import unittest

import check_commits
import check_language


def hits_in(name, text, uses=None):
    with tempfile.TemporaryDirectory() as root:
        with open(os.path.join(root, name), 'w', encoding='utf-8') as file:
            file.write(text)
        return list(check_language.hits(root, [name], uses or {}))


class CheckLanguage(unittest.TestCase):
    def test_finds_patterns_in_comments_and_strings(self):
        for text in ('// A box that lies behind it.\n', '/// Lets x be y.\nint x;\n', 'f("a row is no number");\n',
                     '/* What is left of a run. */\n', '// One of\n// its own.\n'):
            self.assertTrue(hits_in('a.cpp', text), text)

    def test_ignores_code(self):
        self.assertEqual(hits_in('a.cpp', 'int behind = anew(beside);\nchar c = \'"\';\n'), [])

    def test_finds_a_pattern_across_lines(self):
        self.assertEqual(len(hits_in('a.cpp', '// The points are told\n// by the header.\n')), 1)

    def test_reads_python_markdown_and_build_files(self):
        self.assertEqual(len(hits_in('a.py', '"""Made anew."""\nanew = 1  # beside it\n')), 2)
        self.assertEqual(len(hits_in('a.md', 'Made\nanew.\n\n```\nanew\n```\nand `anew`\n')), 1)
        self.assertEqual(len(hits_in('meson.build', "# Made anew.\nanew = 'anew'\n")), 1)

    def test_accepts_plain_english(self):
        for text in ('// There is no room.\n', '// The point lies inside the triangle.\n', '// The box is no longer used.\n',
                     '// Ids stand for clusters.\n', '// What is a cluster?\n'):
            self.assertEqual(hits_in('a.cpp', text), [], text)

    def test_allowed_uses_are_no_hits(self):
        text = '// The sun is behind the hill.\n'
        self.assertEqual(len(hits_in('a.cpp', text)), 1)
        self.assertEqual(hits_in('a.cpp', text, {'a.cpp': ['behind the hill']}), [])


class CheckCommits(unittest.TestCase):
    def test_accepts_the_form(self):
        self.assertEqual(list(check_commits.faults_of('geotiff: Read world files\n\nGDAL does.')), [])

    def test_names_each_fault(self):
        for message in ('Fixed it\n\nBecause.', 'geotiff: read world files\n\nBecause.', 'geotiff: Read world files',
                        'geotiff: The reader knows world files\n\nBecause.', 'geotiff: ' + 70 * 'A' + '\n\nBecause.',
                        'geotiff: Read world files\nBecause.'):
            self.assertTrue(list(check_commits.faults_of(message)), message)


if __name__ == '__main__':
    unittest.main()
