#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that the layout check finds every kind of breach, each in a small tree that is otherwise sound."""

import json
import os
import tempfile
import unittest
from unittest import mock

import check_layout


def write(root, path, text):
    os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
    with open(os.path.join(root, path), 'w', encoding='utf-8') as file:
        file.write(text)


def make_tree(root):
    os.mkdir(os.path.join(root, 'subprojects'))
    for library in check_layout.LIBRARIES:
        room = f'lib{library}'
        spdx = f'SPDX-License-Identifier: {check_layout.LICENCES[room]}\n'
        for name in ('LICENSE', 'README.md'):
            write(root, f'{room}/{name}', 'text\n')
        write(root, f'{room}/meson.build', f"# {spdx}project('{library}',\n  version : '1.2.3')\n")
        write(root, f'{room}/meson_options.txt', '# ' + spdx)
        write(root, f'{room}/src/meson.build', f"# {spdx}names = ['a.hpp']\n")
        write(root, f'{room}/tests/meson.build', f"# {spdx}files('a_test.cpp')\n")
        write(root, f'{room}/bench/meson.build', f"# {spdx}names = ['a']\n")
        write(root, f'{room}/include/terrace/{library}/a.hpp', f'// {spdx}#include <vector>\n')
        write(root, f'{room}/src/a.cpp', f'// {spdx}#include "terrace/{library}/a.hpp"\n')
        write(root, f'{room}/tests/a_test.cpp', f'// {spdx}#include <gtest/gtest.h>\n#include "../src/a.hpp"\n')
        write(root, f'{room}/bench/a_bench.cpp', f'// {spdx}#include <benchmark/benchmark.h>\n')
        os.symlink(f'../{room}', os.path.join(root, 'subprojects', f'terrace-{library}'))
    gpl = 'SPDX-License-Identifier: GPL-3.0-or-later\n'
    for room in check_layout.PROGRAMS:
        for name in ('LICENSE', 'README.md'):
            write(root, f'{room}/{name}', 'text\n')
    write(root, 'tools/src/main.cpp', f'// {gpl}#include <terrace/tri/a.hpp>\n#include <CLI/CLI.hpp>\n')
    write(root, 'VERSION', '1.2.3\n')
    write(root, 'CITATION.cff', 'cff-version: 1.2.0\nversion: 1.2.3\n')
    write(root, 'python/terrace/__init__.py', "# SPDX-License-Identifier: Apache-2.0\n__version__ = '1.2.3'\n")
    write(root, 'python/qgis/terrace_processing/metadata.txt', '[general]\nqgisMinimumVersion=3.22\nversion=1.2.3\n')
    write(root, 'viewer/package.json', '{\n  "version": "1.2.3"\n}\n')
    write(root, 'viewer/package-lock.json', '{\n  "version": "1.2.3",\n  "packages": {"": {"version": "2.0.0"}}\n}\n')
    write(root, 'tests/run.sh', f'#!/bin/sh\n# {gpl}')
    write(root, 'research/meson.build', f"# {gpl}executable('a', 'a.cpp')\n")
    write(root, 'research/ears.hpp', f'// {gpl}')
    write(root, 'research/a.cpp', f'// {gpl}#include <glpk.h>\n#include <terrace/tri/a.hpp>\n#include "ears.hpp"\n')


def head(path):
    return f"// SPDX-License-Identifier: {check_layout.LICENCES[path.split('/')[0]]}\n"


class CheckLayout(unittest.TestCase):
    def breaches(self, change, allowed=()):
        with tempfile.TemporaryDirectory() as root:
            make_tree(root)
            change(root)
            # The files of these small trees are short, and nothing includes some of them.
            with mock.patch.dict(check_layout.MAY_DIFFER, allowed, clear=True), mock.patch.object(check_layout, 'check_sizes', lambda root: []):
                return list(check_layout.breaches(root))

    def test_finds_the_numbers_of_sources_that_break_unity_builds(self):
        with tempfile.TemporaryDirectory() as build:
            targets = [{'name': f'library{count}', 'type': 'static library', 'defined_in': 'meson.build',
                        'target_sources': [{'sources': ['a.cpp'] * count}, {'linker': ['ar']}]} for count in (0, 29, 30, 31, 60)]
            write(build, 'meson-info/intro-targets.json', json.dumps(targets))
            found = list(check_layout.check_unity(build))
        self.assertEqual([breach.split()[1] for breach in found], ['library30', 'library60'])

    def test_a_sound_tree_has_no_breaches(self):
        self.assertEqual(self.breaches(lambda root: None), [])
        # Build folders and their contents are not sources.
        self.assertEqual(self.breaches(lambda root: write(root, 'libtri/build-x/a.cpp', '')), [])

    def test_versions_are_equal(self):
        for path, text in (('libtri/meson.build', "version : '1.2.4'"), ('CITATION.cff', 'version: 1.2'), ('viewer/package.json', '"version": "1.2"'),
                           ('viewer/package-lock.json', '  "version": "1.2.30",\n"version": "1.2.3"'), ('python/terrace/__init__.py', "__version__ = '1'"),
                           ('python/qgis/terrace_processing/metadata.txt', 'version=')):
            found = self.breaches(lambda root: write(root, path, f'# SPDX-License-Identifier: Apache-2.0\n{text}\n'))
            self.assertEqual(found, [f'{path}: does not have the version 1.2.3 of the file VERSION'])

    def test_python_may_use_every_library(self):
        text = head('python') + '#include <pybind11/numpy.h>\n#include <terrace/matching/a.hpp>\n#include <terrace/terrain/a.hpp>\n'
        self.assertEqual(self.breaches(lambda root: write(root, 'python/src/b.cpp', text)), [])

    def test_texts_are_built_in_one_way(self):
        makefile = 'STREAM := io/core \\\n  io/more\nTRI := delaunay2\nTERRAIN := view\n'

        def found(path, line, listed=('io/core', 'io/more')):
            def change(root):
                write(root, check_layout.CORE_MAKEFILE, makefile)
                for name in listed:
                    write(root, f'libstream/src/{name}.cpp', head('libstream'))
                write(root, 'libterrain/src/view.cpp', head('libterrain'))
                write(root, path, head(path) + line)
            return self.breaches(change)

        uses_fmt, uses_to_string = '#include <fmt/core.h>\n', 'auto text = std::to_string(1);\n'
        for path in ('libstream/src/b.cpp', 'libstream/src/io/b.cpp', 'libterrain/src/b.cpp', 'tools/src/b.cpp'):
            self.assertEqual(found(path, uses_fmt), [])
            self.assertEqual(found(path, uses_to_string), [f'{path}:2: uses std::to_string; build the text with fmt::format'])
        for path in ('libstream/src/io/more.cpp', 'libstream/src/io/b.hpp', 'libterrain/src/view.cpp', 'tools/src/b.hpp'):
            self.assertEqual(found(path, uses_to_string), [])
            for line in (uses_fmt, 'auto text = fmt::format("{}", 1);\n'):
                self.assertEqual(found(path, line), [f'{path}:2: uses {{fmt}}, which neither headers nor the sources in '
                                                     f'{check_layout.CORE_MAKEFILE} may'])
        self.assertEqual(found('libstream/src/b.cpp', '', listed=['io/core']),
                         [f'libstream/src/io/more.cpp: is in {check_layout.CORE_MAKEFILE} but does not exist'])

    def test_headers_have_no_using_namespace(self):
        directive = 'namespace terrace::tri {\n  using  namespace base;\nusing base::Box3;  // not: using namespace base\n}\n'
        for path in ('libtri/include/terrace/tri/b.hpp', 'libtri/src/b.hpp', 'libtri/tests/oracle.hpp', 'tools/src/b.hpp', 'viewer/core/b.h'):
            found = self.breaches(lambda root: write(root, path, head(path) + directive))
            self.assertEqual([breach for breach in found if 'using namespace' in breach],
                             [f'{path}:3: a header has `using namespace`, which reaches all files that include it; qualify the names'])
        self.assertEqual(self.breaches(lambda root: write(root, 'tools/src/b.cpp', head('tools') + directive)), [])

    def test_each_breach_is_found(self):
        apache = '// SPDX-License-Identifier: Apache-2.0\n'
        gpl = '// SPDX-License-Identifier: GPL-3.0-or-later\n'
        cases = [
            ('libcluster/src/b.cpp', apache + '#include "terrace/stream/a.hpp"\n', 'sibling'),
            ('libterrain/src/base/b.cpp', head('libterrain') + '#include <terrace/matching/a.hpp>\n', 'sibling'),
            ('libterrain/src/base/b.cpp', head('libterrain') + '#include "earth/ground.hpp"\n', 'room is not below'),
            ('libterrain/src/mesh/b.cpp', head('libterrain') + '#include "tile/set.hpp"\n', 'room is not below'),
            ('libstream/src/io/b.cpp', head('libstream') + '#include "store/manifest.hpp"\n', 'room is not below'),
            ('libtri/tests/b.cpp', head('libtri') + '#  include <terrace/stream/a.hpp>\n', 'sibling'),
            ('libtri/src/b.cpp', head('libtri') + '#include "../../tools/src/units.hpp"\n', 'outside its library'),
            ('libtri/include/terrace/tri/a.hpp', head('libtri') + '#include <CGAL/Gmpq.h>\n', 'which only'),
            ('libtri/include/terrace/tri/a.hpp', head('libtri') + '#include <nlohmann/json.hpp>\n', 'public header'),
            ('libstream/src/b.cpp', apache + '#include <gmpxx.h>\n', 'which only'),
            ('tools/src/b.cpp', gpl + '#include <tiffio.h>\n', 'which only'),
            ('libtri/src/b.cpp', head('libtri') + '#include <GeographicLib/UTMUPS.hpp>\n', 'which only'),
            ('tools/src/b.cpp', gpl + '#include <proj.h>\n', 'which only'),
            ('libterrain/src/base/b.cpp', apache + '#include <pybind11/numpy.h>\n', 'which only'),
            ('libterrain/src/earth/b.cpp', gpl + '#include <geos_c.h>\n', 'which only'),
            ('libcluster/src/b.cpp', apache + '#include <lemon/matching.h>\n', 'which only'),
            ('libcluster/src/base/b.cpp', apache + '#include <fmt/core.h>\n', 'which only'),
            ('libcluster/src/b.cpp', '#include <vector>\n', 'no SPDX line'),
            ('libcluster/src/b.cpp', gpl, 'not Apache-2.0'),
            ('libtri/src/b.cpp', head('libtri') + '#include <CGAL/Alpha_wrap_3/internal/gate_comparator.h>\n', 'is GPL'),
            ('libtri/src/b.hpp', head('libtri') + '#include <CGAL/Delaunay_triangulation_2.h>\n', 'is GPL'),
            ('libtri/include/terrace/tri/a.hpp', head('libtri') + '#include <CGAL/Surface_mesh.h>\n', 'is GPL'),
            ('libtri/src/delaunay2/int_kernel.hpp', head('libtri') + '#include <CGAL/Mpzf.h>\n', 'which only'),
            ('libtri/tests/b.cpp', apache + '#include <CGAL/Surface_mesh.h>\n', 'not GPL-3.0-or-later'),
            ('tools/src/verbs/b.cpp', gpl + '#include <CGAL/Surface_mesh.h>\n', 'which only'),
            ('tests/b.py', '#!/usr/bin/env python3\n\n# SPDX-License-Identifier: GPL-3.0-or-later\n',
             'no SPDX line'),
            ('libtri/include/terrace/tri/b.hpp', head('libtri'), 'is not in the list'),
            ('libtri/tests/b_test.cpp', head('libtri'), 'is not in the list'),
            ('libtri/bench/b_bench.cpp', head('libtri'), 'is not in the list'),
            ('libtri/meson.build', head('libtri').replace('//', '#') + "dependency('terrace-stream')\n", 'depends on'),
            ('libcluster/meson.build', apache.replace('//', '#') + "dependency('gmp')\n", 'depends on'),
            ('libcluster/src/b.cpp', apache + '#include <glpk.h>\n', 'which only'),
            ('libtri/src/b.cpp', head('libtri') + '#include "ears.hpp"\n', 'uses research'),
            ('tools/src/b.cpp', gpl + '#include "../../research/ears.hpp"\n', 'uses research'),
            ('tests/b.cpp', gpl + 'using namespace terrace::research;\n', 'uses research'),
            ('tests/meson.build', gpl.replace('//', '#') + 'a = research_dep\n', 'names research'),
            ('research/b.cpp', gpl, 'is not in research/meson.build'),
            ('research/b/meson.build', gpl.replace('//', '#') + "executable('b', install : true)\n", 'installs'),
        ]
        for path, text, expected in cases:
            with self.subTest(path=path, expected=expected):
                found = self.breaches(lambda root: write(root, path, text))
                self.assertTrue(any(path in b and expected in b for b in found), found)

    def test_a_test_class_that_never_runs_is_found(self):
        text = ('# SPDX-License-Identifier: GPL-3.0-or-later\nclass Base(TestCase):\n    def setUp(self):\n        pass\n\n\n'
                'class ATest(Base):\n    def test_a(self):\n        pass\n\n\nclass BTest(Base):\n    """Has a docstring."""\n\n'
                '    # A comment.\n    LIST = (1,\n            2)\n\n    def test_b(self):\n        pass\n')

        def found(classes):
            def change(root):
                write(root, 'tests/cli/a_cli_test.py', text)
                write(root, 'tests/cli/meson.build', f"# SPDX-License-Identifier: GPL-3.0-or-later\n  'a_cli_test' : [{classes}],\n")
            return self.breaches(change)

        self.assertEqual(found(''), [])
        self.assertEqual(found("'ATest', 'BTest'"), [])
        self.assertEqual(found("'ATest'"), ['tests/cli/a_cli_test.py: BTest is not in the list of tests/cli/meson.build, so it never runs'])

    def test_a_folder_of_many_sources_is_found(self):
        def fill(root):
            for number in range(41):
                write(root, f'libtri/src/b/{number}.cpp', head('libtri'))
        self.assertEqual(self.breaches(fill), ['libtri/src/b: has 41 sources, more than 40'])

    def sizes(self, files, short=(), single=()):
        """Returns the breaches of check_sizes() in a tree of these files, where these files have a reason."""
        with tempfile.TemporaryDirectory() as root:
            for path, text in files.items():
                write(root, path, text)
            with mock.patch.multiple(check_layout, SHORT_FILES=dict.fromkeys(short, 'a reason'),
                                     SINGLE_USER_HEADERS=dict.fromkeys(single, 'a reason')):
                return list(check_layout.check_sizes(root))

    def test_short_files_need_a_reason(self):
        at_limit = {'libtri/src/a.cpp': '\n' * 25, 'libtri/src/tests/b.cpp': '', 'libtri/tests/c.cpp': '', 'tests/d.cpp': ''}
        self.assertEqual(self.sizes(at_limit), [])
        files = {'libtri/src/a.cpp': '\n' * 24, 'libtri/include/terrace/tri/b.hpp': '', 'libbase/src/a.cpp': '\n' * 30}
        both = ['libtri/src/a.cpp', 'libtri/include/terrace/tri/b.hpp']
        self.assertEqual(self.sizes(files, short=both), [])
        found = self.sizes(files, short=both[:1])
        self.assertEqual(len(found), 1)
        self.assertIn('libtri/include/terrace/tri/b.hpp: has fewer than 25 lines', found[0])
        found = self.sizes(files, short=both + ['libbase/src/a.cpp'])
        self.assertEqual(len(found), 1)
        self.assertIn('libbase/src/a.cpp: has a reason in check_layout.py that does not apply', found[0])

    def test_private_headers_with_one_user_need_a_reason(self):
        long = '\n' * 30

        def found(includes, **allowed):
            files = {'libtri/src/b/a.hpp': long} | {path: line + long for path, line in includes.items()}
            return self.sizes(files, **allowed)

        # The source of the same name, tests, and a second include in the same file do not count.
        own = {'libtri/src/b/a.cpp': '#include "b/a.hpp"\n', 'libtri/src/c.cpp': '#include "b/a.hpp"\n#include "b/a.hpp"\n',
               'libtri/tests/d.cpp': '#include "b/a.hpp"\n'}
        self.assertEqual(len(found(own)), 1)
        self.assertIn('libtri/src/b/a.hpp: is a private header with one user', found(own)[0])
        self.assertEqual(found(own, single=['libtri/src/b/a.hpp']), [])
        # Names relative to the file count as well as those relative to src/, also from research.
        for path, name in (('libtri/src/b/d.cpp', 'a.hpp'), ('libtri/src/d.cpp', 'b/a.hpp'), ('research/d.cpp', 'b/a.hpp')):
            with self.subTest(path=path):
                self.assertEqual(found(own | {path: f'#include "{name}"\n'}), [])
        two = own | {'libtri/src/d.cpp': '#include "b/a.hpp"\n'}
        self.assertEqual(len(found(two, single=['libtri/src/b/a.hpp'])), 1)
        # A public header may have any number of users.
        self.assertEqual(self.sizes({'libtri/include/terrace/tri/a.hpp': long}), [])

    def test_tests_may_compare_with_gpl_libraries(self):
        gpl = '// SPDX-License-Identifier: GPL-3.0-or-later\n'
        for path in ('libtri/tests/b.cpp', 'libtri/bench/b.hpp', 'tools/src/scan/b.cpp'):
            for include in ('#include <CGAL/Surface_mesh.h>\n', '#include <CGAL/alpha_wrap_3.h>\n'):
                with self.subTest(path=path):
                    self.assertEqual(self.breaches(lambda root: write(root, path, gpl + include)), [])
        lgpl = head('libtri') + '#include <CGAL/Mpzf.h>\n'
        for path in ('libtri/src/shape/b.cpp', 'libtri/src/delaunay2/double_kernel.cpp', 'libtri/tests/b.cpp'):
            self.assertEqual(self.breaches(lambda root: write(root, path, lgpl)), [])

    def test_inexact_functions_need_a_reason(self):
        for line in ('double s = std::sin(x);', 'return 2 * pow(x, 3);', 'f(std::atan2, y, x);', 'std::log1pf(x);',
                     'double d = std::hypot(x, y, z);  // fast'):
            with self.subTest(line=line):
                change = lambda root: write(root, 'tools/src/b.cpp', head('tools') + line + '\n')
                found = self.breaches(change)
                self.assertEqual(len(found), 1)
                self.assertIn('tools/src/b.cpp:2: ', found[0])
                self.assertEqual(self.breaches(change, {'tools/src/b.cpp': 'a reason'}), [])
        for line in ('double r = std::sqrt(std::fma(x, y, z));', '// O(n log(n)), as std::exp(x)', 'portable_sin(x);',
                     'clock.log(x); list->exp(2); GeographicLib::Math::atan2d(y, x);', 'int exponent = std::ilogb(x);',
                     'std::fmod(x, 360.0); std::remquo(x, y, &n); std::frexp(x, &e);'):
            with self.subTest(line=line):
                self.assertEqual(self.breaches(lambda root: write(root, 'libtri/src/b.cpp', head('libtri') + line + '\n')), [])
        # Tests and benchmarks may use all functions. An unused permission is a breach.
        self.assertEqual(self.breaches(lambda root: write(root, 'libtri/tests/b.cpp', head('libtri') + 'std::sin(x);\n')), [])
        self.assertEqual(len(self.breaches(lambda root: None, {'tools/src/main.cpp': 'a reason'})), 1)

    def test_libraries_do_not_know_the_command(self):
        table = '// SPDX-License-Identifier: GPL-3.0-or-later\n    {"level", "--level"},\n'
        for text, word in [('const char* a = "give --level";\n', 'option'),
                           ('auto a = message("give "\n"{levels}");\n', 'levels'),
                           ('const char* a = "give `level`";\n', 'message("{level}")'),
                           ('struct sigaction action;\n', 'signals'),
                           ('auto a = message("give {level}, a \\" {}", b);  // or --level, `level`\n', None)]:
            def change(root, text=text):
                write(root, 'tools/src/cli/option_names.cpp', table)
                write(root, 'libterrain/src/b.cpp', head('libterrain') + text)
            found = self.breaches(change)
            self.assertEqual(len(found), 0 if word is None else 1, found)
            if word:
                self.assertIn(word, found[0])

    def test_rooms_are_complete(self):
        found = self.breaches(lambda root: os.remove(os.path.join(root, 'libtri/LICENSE')))
        self.assertEqual(found, ['libtri/LICENSE: is missing'])
        found = self.breaches(lambda root: os.remove(os.path.join(root, 'subprojects/terrace-tri')))
        self.assertEqual(len(found), 1)


if __name__ == '__main__':
    unittest.main()
