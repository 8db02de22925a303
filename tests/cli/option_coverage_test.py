#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every option of every verb is tested: for each verb by a golden command or a command-line test, and for at
least one verb by a test that checks the effect of the option and not only that bytes stay the same.

TERRACE=path/to/terrace option_coverage_test.py
"""

import ast
import glob
import os
import re
import shlex
import subprocess
import unittest

TERRACE = os.environ.get('TERRACE', 'terrace')
HERE = os.path.dirname(os.path.abspath(__file__))
GOLDEN = os.path.join(HERE, '..', 'golden', 'golden.txt')

# Options of verbs that need no test, with the reason.
EXCEPTIONS = {
    ('match', '--seconds'): 'the result of a time limit is not reproducible',
}
# Options that all verbs read in one place: a test with any verb counts.
COMMON = {'--threads', '--memory', '--seed', '--json', '--force', '--progress', '--quiet', '--verbose',
          '--help'}
# Other spellings of options.
SHORT = {'-o': '--output', '-q': '--quiet', '-v': '--verbose', '-h': '--help'}

OPTION = re.compile(r'--?[a-z][a-z0-9-]*')


def help_of(*verb):
    return subprocess.run([TERRACE, *verb, '--help'], capture_output=True, text=True, check=True,
                          timeout=60).stdout


def options_by_verb():
    verbs = re.search(r'\nVerbs:\n(.*?)\n\n', help_of(), re.DOTALL).group(1)
    found = {}
    for verb in re.findall(r'^  ([a-z]+) ', verbs, re.MULTILINE):
        names = re.findall(r'^ +((?:-[a-z],)?--?[a-z][a-z0-9-]*)', help_of(verb), re.MULTILINE)
        found[verb] = {name.split(',')[-1] for name in names}
    return found


def options_in(words):
    return {SHORT.get(word, word) for word in words if OPTION.fullmatch(word)}


def uses_in_golden_commands():
    with open(GOLDEN, encoding='utf-8') as file:
        for line in file:
            if line.startswith('$ terrace '):
                words = shlex.split(line[2:])
                for option in options_in(words[2:]):
                    yield words[1], option


def text(node):
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def verb_of(node, verbs):
    """The verb at the beginning of a call's arguments, a list or a tuple, or None."""
    parts = node.args if isinstance(node, ast.Call) else getattr(node, 'elts', [])
    if parts and isinstance(parts[0], ast.Name) and parts[0].id == 'TERRACE':
        parts = parts[1:]
    return text(parts[0]) if parts and text(parts[0]) in verbs else None


def uses_in_tests(verbs):
    """Yields (verb, option) for each call or list that has both, and (None, option) for each option found."""
    def words_below(node):
        if text(node) is not None:
            yield text(node)
        for child in ast.iter_child_nodes(node):
            if verb_of(child, verbs) is None:
                yield from words_below(child)

    for name in sorted(glob.glob(os.path.join(HERE, '*_test.py'))):
        if os.path.samefile(name, __file__):
            continue
        with open(name, encoding='utf-8') as file:
            tree = ast.parse(file.read())
        for node in ast.walk(tree):
            if text(node) is not None:
                for option in options_in([text(node)]):
                    yield None, option
            verb = verb_of(node, verbs)
            if verb is not None:
                for option in options_in(words_below(node)):
                    yield verb, option


class OptionCoverageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.options = options_by_verb()
        cls.uses = set(uses_in_tests(cls.options))
        cls.golden = set(uses_in_golden_commands())

    def test_help_lists_the_options(self):
        self.assertGreater(len(self.options), 14)
        self.assertIn('--band', self.options['build'])
        self.assertIn('-k', self.options['cluster'])
        self.assertIn('--output', self.options['cluster'])
        self.assertTrue(all(COMMON <= options for options in self.options.values()))

    def test_every_option_of_every_verb_is_tested(self):
        missing = [f'{verb} {option}' for verb, options in self.options.items()
                   for option in sorted(options - COMMON)
                   if (verb, option) not in self.uses | self.golden | set(EXCEPTIONS)]
        self.assertEqual(missing, [], 'add a golden command, or better a test of its effect')

    def test_the_effect_of_every_option_is_tested(self):
        known = set().union(*self.options.values())
        missing = sorted(option for option in known if (None, option) not in self.uses)
        self.assertEqual(missing, [], 'add a test in tests/cli that fails if the option does nothing')

    def test_exceptions_are_untested_options(self):
        for verb, option in EXCEPTIONS:
            self.assertIn(option, self.options[verb])
            self.assertNotIn((verb, option), self.uses | self.golden)


if __name__ == '__main__':
    unittest.main()
