#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pages of the command from its --help and the notes in docs/commands: for the manual, and for man.

command_pages.py man ROOT TERRACE OUT VERB...        OUT/terrace.1 and OUT/terrace-VERB.1; VERBs must be all verbs
command_pages.py markdown ROOT TERRACE OUT           OUT/VERB.md and OUT/index.md
"""

import os
import re
import sys

from command_help import Command, Verb
from notes import read_notes, roff_of, roff_text

EXIT_CODES = [('0', 'The work is done.'), ('1', 'The work failed. One line says why.'), ('2', 'The usage is wrong.'),
              ('130', 'The work was interrupted.')]


def capital(text):
    return text[:1].upper() + text[1:]


def sentence(text):
    """A line of the help as a sentence."""
    return capital(text) + ('' if text.endswith(('.', ':')) else '.')


def synopsis(verb):
    """What to type: the operands, the options that are required, and a place for the others."""
    words = ['terrace', verb.name]
    for option in verb.options:
        if option.required and option.operand:
            words.append(option.names[0] + ('...' if option.many else ''))
    for option in verb.options:
        if option.required and not option.operand:
            words += [option.names[0], option.value] if option.value else [option.names[0]]
    for option in verb.options:
        if option.operand and not option.required:
            words.append(f'[{option.names[0]}{"..." if option.many else ""}]')
    return ' '.join(words + ['[OPTIONS]'])


def notes_path(root, name):
    return os.path.join(root, 'docs', 'commands', f'{name}.md')


def man_page(title, brief, parts):
    """A page of section 1; parts are (heading, roff)."""
    version = title[1]
    text = f'.TH {title[0].upper()} 1 "" "terrace {version}" "User Commands"\n'
    text += f'.SH NAME\n{title[0]} \\- {roff_text(brief)}\n'
    for heading, body in parts:
        text += f'.SH {heading.upper()}\n{body}'
    return text


def roff_options(verb):
    text, group = '', None
    for option in verb.options:
        if option.group != group:
            group = option.group
            if group not in ('Options', 'Positionals'):
                text += f'.SS {roff_text(group)}\n'
        names = ', '.join(f'\\fB{roff_text(name)}\\fR' for name in option.names)
        value = f' \\fI{roff_text(option.value)}\\fR' if option.value and not option.operand else ''
        text += f'.TP\n{names}{value}\n{roff_text(option.description())}\n'
    return text


def roff_exit_codes():
    return ''.join(f'.TP\n.B {code}\n{roff_text(meaning)}\n' for code, meaning in EXIT_CODES)


def verb_man_page(root, version, verb):
    notes = read_notes(notes_path(root, verb.name))
    parts = [('Synopsis', f'\\fB{roff_text(synopsis(verb))}\\fR\n'),
             ('Description', roff_of(notes['Description'])),
             ('Options', roff_options(verb)),
             ('Examples', roff_of(notes['Examples']))]
    if 'Files' in notes:
        parts.append(('Files', roff_of(notes['Files'])))
    parts += [('Exit status', roff_exit_codes()), ('See also', '.BR terrace (1)\n')]
    return man_page((f'terrace-{verb.name}', version), verb.brief, parts)


def command_man_page(root, command):
    notes = read_notes(notes_path(root, 'terrace'))
    verbs = ''.join(f'.TP\n.BR terrace\\-{name} (1)\n{roff_text(capital(brief))}.\n' for name, brief in command.verbs)
    parts = [('Synopsis', '\\fBterrace\\fR \\fIVERB\\fR [\\fIOPTIONS\\fR]\n'),
             ('Description', roff_of(notes['Description'])), ('Verbs', verbs)]
    parts += [(heading, roff_of(blocks)) for heading, blocks in notes.items() if heading not in ('Description', 'Files')]
    parts += [('Files', roff_of(notes['Files'])), ('Exit status', roff_exit_codes())]
    return man_page(('terrace', command.version), 'turn large point sets into a store, and serve any part of it', parts)


def write_man(root, terrace, out, names):
    command = Command(terrace)
    found = [name for name, _ in command.verbs]
    if sorted(names) != sorted(found):
        sys.exit(f'docs/meson.build lists the verbs {" ".join(names)}, but the command has {" ".join(found)}')
    pages = {'terrace.1': command_man_page(root, command)}
    for name in names:
        pages[f'terrace-{name}.1'] = verb_man_page(root, command.version, Verb(terrace, name))
    for name, text in pages.items():
        with open(os.path.join(out, name), 'w', encoding='utf-8') as file:
            file.write(text)


def markdown_text(text):
    """Text of the help in Markdown; names of options become code."""
    text = re.sub(r'([\\*_<\[\]|`])', r'\\\1', text)
    return re.sub(r'(?<![\w-])(--[a-z0-9][a-z0-9-]*|-[a-z]\b)', r'`\1`', text)


def markdown_options(verb):
    text, group = f'```{{program}} terrace {verb.name}\n```\n', None
    for option in verb.options:
        if option.group != group:
            group = option.group
            text += f'\n## {"Arguments" if group == "Positionals" else group}\n'
        if option.operand:
            text += f'\n`{option.names[0]}`\n: {markdown_text(option.description())}\n'
        else:
            value = f' <{option.value}>' if option.value else ''
            names = ', '.join(name + value for name in option.names)
            text += f'\n```{{option}} {names}\n{markdown_text(option.description())}\n```\n'
    return text


def markdown_of(blocks):
    return '\n\n'.join(block.source for block in blocks) + '\n'


def verb_markdown(root, verb):
    notes = read_notes(notes_path(root, verb.name))
    text = f'# terrace {verb.name}\n\n{sentence(verb.brief)}\n\n```text\n{synopsis(verb)}\n```\n\n'
    text += markdown_of(notes['Description'])
    text += '\n' + markdown_options(verb)
    text += '\n## Examples\n\n' + markdown_of(notes['Examples'])
    if 'Files' in notes:
        text += '\n## Files\n\n' + markdown_of(notes['Files'])
    return text + '\n## Exit status\n\n[As for every verb](index.md#exit-status).\n'


def index_markdown(root, command):
    notes = read_notes(notes_path(root, 'terrace'))
    text = '# Command line\n\n```text\nterrace VERB [OPTIONS]\n```\n\n' + markdown_of(notes['Description'])
    text += '\n## Verbs\n\n| verb | does |\n|---|---|\n'
    text += ''.join(f'| [{name}]({name}.md) | {brief} |\n' for name, brief in command.verbs)
    for heading, blocks in notes.items():
        if heading != 'Description':
            text += f'\n## {heading}\n\n' + markdown_of(blocks)
    text += '\n## Exit status\n\n| code | meaning |\n|---|---|\n'
    text += ''.join(f'| {code} | {meaning} |\n' for code, meaning in EXIT_CODES)
    entries = '\n'.join(f'{name} <{name}>' for name, _ in command.verbs)
    return text + f'\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{entries}\n```\n'


def write_markdown(root, terrace, out):
    command = Command(terrace)
    os.makedirs(out, exist_ok=True)
    pages = {'index': index_markdown(root, command)}
    for name, _ in command.verbs:
        pages[name] = verb_markdown(root, Verb(terrace, name))
    for name, text in pages.items():
        with open(os.path.join(out, f'{name}.md'), 'w', encoding='utf-8') as file:
            file.write(text)


def main():
    kind, root, terrace, out, *names = sys.argv[1:]
    if kind == 'man':
        write_man(root, terrace, out, names)
    else:
        write_markdown(root, terrace, out)


if __name__ == '__main__':
    main()
