# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns the docstrings of the Python module into reStructuredText: `name: text` becomes an entry of a list."""

import inspect
import re

# The words that begin a paragraph as parameters do.
RESULTS = {'Returns', 'Yields', 'Raises', 'Errors', 'Source', 'Cost'}
ENTRY = re.compile(r'(\*{0,2}[A-Za-z_]\w*(?:, \*{0,2}[A-Za-z_]\w*)*): (\S.*)$')


def parameters_of(item):
    """Names of the parameters of a function, or of a class's constructor, which includes a dataclass's fields."""
    try:
        return set(inspect.signature(item).parameters)
    except (TypeError, ValueError):
        return set()


def term_of(names, parameters):
    """The term of an entry in reStructuredText, or None if the words are ordinary text."""
    if names in RESULTS:
        return f'**{names}**'
    if all(name.lstrip('*') in parameters for name in names.split(', ')):
        return ', '.join(f'``{name}``' for name in names.split(', '))
    return None


def convert(lines, parameters):
    """Returns the lines with a definition list for the entries. Blank lines separate it from ordinary text."""
    result, in_entry = [], False
    for line in lines:
        entry = ENTRY.match(line)
        term = term_of(entry.group(1), parameters) if entry else None
        if term:
            if result and result[-1].strip() and not in_entry:
                result.append('')
            result += [term, f'    {entry.group(2)}']
            in_entry = True
            continue
        if in_entry and line.strip() and not line.startswith('    '):
            if result[-1].strip():
                result.append('')
            in_entry = False
        result.append(line)
    return result


def process(_app, _what, _name, item, _options, lines):
    """A handler of autodoc-process-docstring."""
    lines[:] = convert(lines, parameters_of(item))
