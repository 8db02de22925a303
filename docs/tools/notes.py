# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the notes of docs/commands: headings, paragraphs, lists and blocks of commands; writes them as roff for man."""

import re
from dataclasses import dataclass


@dataclass
class Block:
    """A paragraph, a list or a block of code: its kind, its source in Markdown, and its items or lines."""
    kind: str
    source: str
    lines: list


def joined(lines):
    return ' '.join(line.strip() for line in lines)


def block_of(lines):
    """The block of consecutive lines without an empty one."""
    source = '\n'.join(lines)
    if not lines[0].startswith('- '):
        return Block('text', source, [joined(lines)])
    items = []
    for line in lines:
        if line.startswith('- '):
            items.append([line[2:]])
        else:
            items[-1].append(line)
    return Block('list', source, [joined(item) for item in items])


def blocks_of(text):
    blocks, lines, code = [], [], False
    for line in text.split('\n') + ['']:
        if line.startswith('```'):
            if code:
                blocks.append(Block('code', '\n'.join(lines + [line]), lines[1:]))
                lines = []
            else:
                lines = [line]
            code = not code
        elif code or line.strip():
            lines.append(line)
        elif lines:
            blocks.append(block_of(lines))
            lines = []
    return blocks


def read_notes(path):
    """Maps each heading to its blocks; the text before the first heading is the description."""
    with open(path, encoding='utf-8') as file:
        parts = re.split(r'^## (.*)\n', '## Description\n' + file.read(), flags=re.MULTILINE)
    return {heading: blocks_of(body) for heading, body in zip(parts[1::2], parts[2::2])}


def roff_text(text):
    """One line of text for roff, with the escapes that it needs; `code` becomes bold."""
    text = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', text)
    text = text.replace('\\', '\\e').replace('-', '\\-').replace("'", '\\(aq')
    text = re.sub(r'`([^`]*)`', r'\\fB\1\\fR', text)
    text = re.sub(r'\*([^*]+)\*', r'\\fI\1\\fR', text)
    return '\\&' + text if text.startswith('.') else text


def roff_of(blocks):
    """The body of a section; the first paragraph needs no macro."""
    text = ''
    for index, block in enumerate(blocks):
        if block.kind == 'code':
            lines = '\n'.join(roff_text(line) for line in block.lines)
            text += f'.RS 4\n.nf\n{lines}\n.fi\n.RE\n'
        elif block.kind == 'list':
            text += ''.join(f'.IP \\(bu 3\n{roff_text(item)}\n' for item in block.lines)
        else:
            text += ('.PP\n' if index else '') + roff_text(block.lines[0]) + '\n'
    return text
