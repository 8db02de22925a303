# SPDX-License-Identifier: GPL-3.0-or-later
"""Mends the theme Furo as Debian packages it, with neither its bundled script nor the colours for a dark system.

The script of the package imports another, which a browser refuses outside a module. Without it there is no switch
between light and dark. The style sheet has dark colours for that switch alone, not for the system's setting.
"""

import os
import re

IMPORT = 'import Gumshoe from "./gumshoe-patched.js";\n'
DARK = re.compile(r'body\[data-theme="dark"\] \{([^}]*)\}')


def with_dark_system(style):
    """The style sheet with the dark colours for systems that are set to dark."""
    colours = DARK.search(style)
    if 'prefers-color-scheme' in style or not colours:
        return style
    return style + ('\n@media not print {\n@media (prefers-color-scheme: dark) {\n'
                    f'  body:not([data-theme="light"]) {{{colours.group(1)}}}\n}}\n}}\n')


def mend(static):
    """Mends the files of the theme in a site's folder of static files."""
    def read(name):
        with open(os.path.join(static, name), encoding='utf-8') as file:
            return file.read()

    script, style = read('scripts/furo.js'), with_dark_system(read('styles/furo.css'))
    if script.startswith(IMPORT):
        script = read('scripts/gumshoe-patched.js') + script[len(IMPORT):]
    for name, text in (('scripts/furo.js', script), ('styles/furo.css', style)):
        with open(os.path.join(static, name), 'w', encoding='utf-8') as file:
            file.write(text)
