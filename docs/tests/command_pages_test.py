#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the pages for man and the completion for shells against the help of the command.

TERRACE=path/to/terrace COMPLETION=folder/of/the/completion command_pages_test.py
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, 'docs/tools'))

import command_pages  # noqa: E402
from command_help import Command, Verb, option_of  # noqa: E402
from notes import read_notes, roff_text  # noqa: E402

TERRACE = os.path.abspath(os.environ['TERRACE'])
COMPLETION = os.environ['COMPLETION']
COMMAND = Command(TERRACE)
VERBS = [Verb(TERRACE, name) for name, _ in COMMAND.verbs]


def shell(name, script, *arguments):
    return subprocess.run([name, *arguments, script], capture_output=True, text=True, check=True, timeout=60).stdout


class HelpTest(unittest.TestCase):
    def test_parses_heads(self):
        option = option_of('-k K:UINT in [1 - 9] Needs: --near Excludes: --within -x', 'text', 'Options')
        self.assertEqual((option.names, option.value, option.needs, option.excludes), (['-k'], 'K', ['--near'], ['--within', '-x']))
        option = option_of('-o,--output FILE REQUIRED', 'text', 'Options')
        self.assertEqual((option.names, option.value, option.required, option.many), (['-o', '--output'], 'FILE', True, False))
        option = option_of('--progress MODE:{auto,json}=auto', 'text', 'Options')
        self.assertEqual((option.choices, option.default), (['auto', 'json'], 'auto'))
        option = option_of('--level TEXT=0; with --focus top ... Excludes: --cluster', 'text', 'Options')
        self.assertEqual((option.value, option.default, option.many), ('TEXT', '0; with --focus top', True))
        self.assertTrue(option_of('INPUT TEXT ... REQUIRED', 'text', 'Positionals').operand)

    def test_finds_every_option_of_the_help(self):
        for verb in VERBS:
            text = subprocess.run([TERRACE, verb.name, '--help'], capture_output=True, text=True, check=True, timeout=60).stdout
            printed = re.findall(r'^  ((?:-[a-z],)?--?[a-z][a-z0-9-]*)', text, re.MULTILINE)
            found = [','.join(option.names) for option in verb.options if not option.operand]
            self.assertEqual(sorted(printed), sorted(found), verb.name)
            for option in verb.options:
                self.assertTrue(option.text, f'{verb.name} {option.names}')


class NotesTest(unittest.TestCase):
    def test_every_verb_has_notes_and_no_other(self):
        names = {name[:-3] for name in os.listdir(os.path.join(ROOT, 'docs/commands'))}
        self.assertEqual(names, {verb.name for verb in VERBS} | {'terrace'})

    def test_examples_use_verbs_and_options_that_exist(self):
        known = {verb.name: {name for option in verb.options for name in option.names} for verb in VERBS}
        for name in [*known, 'terrace']:
            lines = [line for block in read_notes(command_pages.notes_path(ROOT, name))['Examples'] if block.kind == 'code'
                     for line in block.lines]
            self.assertGreater(len(lines), 0, name)
            for line in lines:
                words = shlex.split(line)
                self.assertEqual(words[0], 'terrace', line)
                for option in (word for word in words[2:] if re.fullmatch(r'--?[a-z][a-z-]*', word)):
                    self.assertIn(option, known[words[1]], line)

    def test_the_example_of_the_help_is_one_of_them(self):
        for verb in VERBS:
            lines = [line for block in read_notes(command_pages.notes_path(ROOT, verb.name))['Examples'] for line in block.lines]
            self.assertIn(verb.example, lines)


class ManTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='terrace-man-')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        command_pages.write_man(ROOT, TERRACE, cls.folder, [verb.name for verb in VERBS])

    def page(self, name):
        with open(os.path.join(self.folder, name), encoding='utf-8') as file:
            return file.read()

    def test_pages_have_all_sections(self):
        for verb in VERBS:
            headings = re.findall(r'^\.SH (.*)$', self.page(f'terrace-{verb.name}.1'), re.MULTILINE)
            self.assertEqual([heading for heading in headings if heading != 'FILES'],
                             ['NAME', 'SYNOPSIS', 'DESCRIPTION', 'OPTIONS', 'EXAMPLES', 'EXIT STATUS', 'SEE ALSO'])

    def test_pages_have_every_option(self):
        for verb in VERBS:
            text = self.page(f'terrace-{verb.name}.1').replace('\\-', '-')
            for option in verb.options:
                for name in option.names:
                    self.assertIn(f'\\fB{name}\\fR', text)

    def test_refuses_a_list_of_verbs_that_differs(self):
        with self.assertRaises(SystemExit) as refused:
            command_pages.write_man(ROOT, TERRACE, self.folder, ['build'])
        self.assertIn('docs/meson.build lists the verbs build', str(refused.exception))

    def test_text_cannot_become_a_macro(self):
        self.assertEqual(roff_text('.TH x'), '\\&.TH x')
        self.assertEqual(roff_text("a-b 'c' `--d` \\"), "a\\-b \\(aqc\\(aq \\fB\\-\\-d\\fR \\e")
        for name in os.listdir(self.folder):
            for line in self.page(name).split('\n'):
                self.assertRegex(line, r"^(?:\.(?:TH|SH|SS|TP|PP|IP|RS|RE|nf|fi|B|BR)\b|[^.']|$)", name)

    def test_man_accepts_the_pages(self):
        tool = shutil.which('mandoc')
        if not tool:
            self.skipTest('mandoc is missing')
        for name in sorted(os.listdir(self.folder)):
            result = subprocess.run([tool, '-T', 'lint', '-W', 'warning', os.path.join(self.folder, name)], capture_output=True,
                                    text=True, check=False, timeout=60)
            # The pages have no date, so that equal sources give equal bytes.
            lines = [line for line in result.stdout.splitlines() if 'missing date' not in line]
            self.assertEqual(lines, [])


class CompletionTest(unittest.TestCase):
    def bash(self, *words):
        script = (f'source {shlex.quote(os.path.join(COMPLETION, "terrace"))}; COMP_WORDS=({" ".join(map(shlex.quote, words))}); '
                  f'COMP_CWORD={len(words) - 1}; _terrace; printf "%s\\n" "${{COMPREPLY[@]}}"')
        return shell('bash', script, '-c').split()

    def test_bash_completes_verbs(self):
        self.assertEqual(self.bash('terrace', 'p'), ['points', 'profile', 'publish'])
        names = {verb.name for verb in VERBS}
        self.assertEqual(set(self.bash('terrace', '')), names | {'help', '--help', '--version'})
        self.assertEqual(set(self.bash('terrace', 'help', '')), names)

    def test_bash_completes_every_option(self):
        for verb in VERBS:
            names = [name for option in verb.options if not option.operand for name in option.names]
            self.assertEqual(self.bash('terrace', verb.name, '-'), names)

    def test_bash_completes_values(self):
        self.assertEqual(self.bash('terrace', 'mesh', '--progress', ''), ['auto', 'json', 'none'])
        self.assertEqual(self.bash('terrace', 'mesh', 'dem'), [])  # the shell completes files

    def test_zsh_accepts_the_file(self):
        if not shutil.which('zsh'):
            self.skipTest('zsh is missing')
        shell('zsh', os.path.join(COMPLETION, '_terrace'), '-n')

    def test_fish_completes(self):
        if not shutil.which('fish'):
            self.skipTest('fish is missing')

        def fish(line):
            found = shell('fish', f'source {shlex.quote(os.path.join(COMPLETION, "terrace.fish"))}; complete -C {shlex.quote(line)}',
                          '--no-config', '-c')
            return [entry.split('\t')[0] for entry in found.splitlines()]

        self.assertEqual(fish('terrace p'), ['points', 'profile', 'publish'])
        self.assertEqual(fish('terrace mesh --progress '), ['auto', 'json', 'none'])
        for verb in VERBS:
            names = {name for option in verb.options if not option.operand for name in option.names}
            self.assertLessEqual({name for name in names if name.startswith('--')}, set(fish(f'terrace {verb.name} --')), verb.name)


if __name__ == '__main__':
    unittest.main()
