#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs README.md, the guides of the manual and the examples in READMEs as printed (pages.py has the rules).

TERRACE=path/to/terrace docs_guides_test.py [-v] [PageTest.test_docs_guides_python ...]

BUILD is the build whose libraries are installed for pages that compile programs. PYTHON is an interpreter that finds the
module `terrace` (by PYTHONPATH). Without it, blocks of Python are skipped and the output lists them.
"""

import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from pages import ROOT, Page

TERRACE = os.path.abspath(os.environ['TERRACE'])
PAGES = ['README.md', 'docs/get-started.md', *sorted(glob.glob('docs/guides/*.md', root_dir=ROOT)),
         *sorted(glob.glob('lib*/README.md', root_dir=ROOT)), 'tools/README.md', 'viewer/README.md', 'python/README.md']


def install(folder):
    """Installs the libraries of the build below the folder. Returns the variables by which other builds find them."""
    subprocess.run(['meson', 'install', '-C', os.environ['BUILD'], '--no-rebuild', '--quiet', '--tags', 'devel,runtime',
                    '--destdir', folder], check=True, stdout=subprocess.DEVNULL)
    prefix = os.path.dirname(os.path.dirname(glob.glob(os.path.join(folder, '**', 'include', 'terrace'), recursive=True)[0]))
    packages = glob.glob(os.path.join(prefix, '**', 'pkgconfig'), recursive=True)[0]
    return {'PKG_CONFIG_PATH': packages, 'CMAKE_PREFIX_PATH': prefix, 'LD_LIBRARY_PATH': os.path.dirname(packages)}


class PageTest(unittest.TestCase):
    """Has one case for each page."""

    @classmethod
    def setUpClass(cls):
        cls.home = tempfile.mkdtemp(prefix='terrace-docs-')
        cls.addClassCleanup(shutil.rmtree, cls.home)
        programs = os.path.join(cls.home, 'bin')
        os.mkdir(programs)
        os.symlink(TERRACE, os.path.join(programs, 'terrace'))
        # `terrace view` must not open a browser.
        os.symlink('/bin/true', os.path.join(programs, 'xdg-open'))
        # One Python for the commands of a page and its blocks.
        cls.python = os.environ.get('PYTHON')
        if cls.python:
            os.symlink(cls.python, os.path.join(programs, 'python3'))
        cls.environment = {**os.environ, 'PATH': programs + os.pathsep + os.environ['PATH'], 'LC_ALL': 'C.UTF-8', 'HOME': cls.home}

    def run_page(self, name):
        with open(os.path.join(ROOT, name), encoding='utf-8') as file:
            text = file.read()
        folder = tempfile.mkdtemp(prefix='page-', dir=self.home)
        if name.endswith('README.md'):  # its commands run in a clone
            os.mkdir(os.path.join(folder, 'libterrain'))
            os.symlink(os.path.join(ROOT, 'libterrain/examples'), os.path.join(folder, 'libterrain/examples'))
        environment = self.environment
        if '```cmake' in text:
            environment = {**environment, **install(os.path.join(folder, 'installed'))}
        print(f'{name}: {Page(text, folder, environment, self.python).run()}', file=sys.stderr)

    def test_all_guides_are_found(self):
        self.assertGreater(len(PAGES), 15)


for page in PAGES:
    def case(self, page=page):
        self.run_page(page)
    setattr(PageTest, 'test_' + re.sub(r'\W+', '_', page.removesuffix('.md')).lower(), case)

if __name__ == '__main__':
    unittest.main()
