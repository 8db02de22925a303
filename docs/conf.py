# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's settings for Sphinx. docs/tools/build.py sets the environment variables."""

import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, 'tools'))

import docstrings

with open(os.path.join(HERE, '..', 'VERSION'), encoding='utf-8') as version_file:
    release = version = version_file.read().strip()
project = 'terrace'
author = copyright = 'the terrace developers'  # pylint: disable=redefined-builtin

extensions = ['breathe', 'myst_parser', 'sphinx.ext.autodoc']
exclude_patterns = ['files']
highlight_language = 'none'
smartquotes = False  # would change --option
myst_heading_anchors = 4
myst_enable_extensions = ['deflist']

breathe_projects = {'terrace': os.environ['TERRACE_DOXYGEN']}
breathe_default_project = 'terrace'
breathe_default_members = ('members', 'undoc-members')
breathe_show_include = False
cpp_index_common_prefix = [f'terrace::{name}::' for name in ('base', 'stream', 'cluster', 'matching', 'tri', 'terrain')]

autodoc_member_order = 'bysource'
autodoc_typehints = 'none'
add_module_names = False
python_use_unqualified_type_names = True

html_theme = 'furo'
html_title = f'terrace {release}'
html_show_copyright = False
html_show_sphinx = False
html_static_path = ['manual.css']
html_css_files = ['manual.css']
html_theme_options = {
    'light_css_variables': {'color-brand-primary': '#1f6f54', 'color-brand-content': '#1a6a8c'},
    'dark_css_variables': {'color-brand-primary': '#6cc9a5', 'color-brand-content': '#7cc3e0'},
}


def setup(app):
    app.connect('autodoc-process-docstring', docstrings.process)
