# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the help of the command: its verbs, and the arguments and options of each."""

import re
import subprocess
from dataclasses import dataclass

# The column at which CLI11 begins descriptions, and on a line of its own after long names.
COLUMN = 30

# The sections of the help, in the order in which people look for them.
GROUPS = ['Positionals', 'Options', 'Common options']


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=60).stdout


@dataclass
class Option:
    """An option or a positional argument (operand) of a verb."""
    names: list  # '-o', '--output', or 'store'
    value: str  # the name of its value, or '' for a flag
    default: str
    choices: list  # the words that its value may be, if they are known
    required: bool
    many: bool
    excludes: list
    needs: list
    text: str
    group: str

    @property
    def operand(self):
        return not self.names[0].startswith('-')

    def description(self):
        """The text of the help, with what the heads of the help add to it."""
        parts = [self.text]
        if self.default:
            parts.append(f'Default: {self.default}')
        if self.required and not self.operand:
            parts.append('Required')
        for word, names in (('Excludes', self.excludes), ('Needs', self.needs)):
            if names:
                parts.append(f'{word} {", ".join(names)}')
        return '. '.join(parts) + '.'

    @property
    def takes_file(self):
        return self.operand or self.value.startswith('FILE') or self.value in ('LINE', 'METRIC', 'TEXT')


def entries_of(lines):
    """(head, description) of each entry of a section."""
    entries = []
    for index, line in enumerate(lines):
        following = lines[index + 1] if index + 1 < len(lines) else ''
        if not line.startswith('  '):
            continue
        if line.startswith(' ' * COLUMN):
            head, text = entries[-1]
            entries[-1] = (head, f'{text} {line.strip()}'.strip())
        elif len(line) > COLUMN and line[COLUMN - 1] == ' ' and not following.startswith(' ' * COLUMN):
            entries.append((line[:COLUMN].strip(), line[COLUMN:].strip()))
        else:
            entries.append((line.strip(), ''))
    return entries


def cut(head, word):
    """Removes `word: --a --b` from the end of a head; returns the rest and the names."""
    found = re.search(rf' {word}:((?: -\S+)+)$', head)
    return (head[:found.start()], found.group(1).split()) if found else (head, [])


def option_of(head, text, group):
    """Parses a head such as `-o,--output FILE REQUIRED Excludes: --cluster`.

    The value has a name, and may have a type with a range or the choices, and a default: `N:UINT in [1 - 9]=3`.
    """
    head, excludes = cut(head, 'Excludes')
    head, needs = cut(head, 'Needs')
    required = head.endswith(' REQUIRED')
    head = head.removesuffix(' REQUIRED')
    many = head.endswith(' ...')
    names, _, rest = head.removesuffix(' ...').partition(' ')
    value, kind, default = re.fullmatch(r'([^:=]*)(?::(\{[^}]*\}|\w+(?: in \[[^\]]*\])?))?(?:=(.*))?', rest).groups()
    choices = kind[1:-1].split(',') if kind and kind.startswith('{') else []
    return Option(names.split(','), value, default or '', choices, required, many, excludes, needs, text, group)


class Command:
    """The command: its version and its (verb, brief description) pairs."""

    def __init__(self, terrace):
        self.version = run(terrace, '--version').split()[1]
        section = re.search(r'\nVerbs:\n(.*?)\n\n', run(terrace, '--help'), re.DOTALL).group(1)
        self.verbs = [tuple(line.split(None, 1)) for line in section.split('\n')]


class Verb:
    """A verb: what it does in a line, its options and its example."""

    def __init__(self, terrace, name):
        self.name = name
        text = run(terrace, name, '--help')
        self.brief = re.match(rf'terrace {name}: (.*)\.\n', text).group(1)
        self.example = re.search(r'\nExample:\n  (.*)', text).group(1)
        sections = re.split(r'^([A-Z][^\n]*):\n', text[:text.index('\nExample:\n') + 1], flags=re.MULTILINE)
        self.options = [option_of(head, description, title)
                        for title, body in sorted(zip(sections[1::2], sections[2::2]), key=lambda part: GROUPS.index(part[0]))
                        for head, description in entries_of(body.split('\n'))]
