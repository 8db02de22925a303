#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""embed.py OUT.cpp FILES...: writes the files of the viewer as strings to a C++ source."""

import os
import sys


def literal(data):
    """Returns a string literal. Octal escapes have three digits, so that no following digit is part of one."""
    lines = []
    for start in range(0, len(data), 64):
        piece = data[start:start + 64]
        lines.append('"' + ''.join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f'\\{b:03o}' for b in piece) + '"')
    return '\n'.join(lines) or '""'


def main():
    out, *paths = sys.argv[1:]
    files = sorted((os.path.basename(path), path) for path in paths)
    entries = []
    for name, path in files:
        with open(path, 'rb') as file:
            data = file.read()
        entries.append(f'    {{"{name}", std::string_view({literal(data)}, {len(data)})}},')
    with open(out, 'w', encoding='ascii') as file:
        file.write('#include "serve/viewer_files.hpp"\n\n'
                   '// Longer than the standard asks compilers to take; GCC and Clang do.\n'
                   '#pragma GCC diagnostic ignored "-Woverlength-strings"\n\n'
                   'namespace terrace::tools {\n\n'
                   'std::span<const ViewerFile> viewer_files() {\n'
                   '  static constexpr ViewerFile kFiles[] = {\n' + '\n'.join(entries) + '\n  };\n'
                   '  return kFiles;\n}\n\n}  // namespace terrace::tools\n')


main()
