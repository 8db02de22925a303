#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks the rules of ARCHITECTURE.md: who may know whom, licences, lists of files, portable sums.

check_layout.py ROOT [BUILD]    prints one line per breach; exit status 1 if there is one. BUILD is a folder that Meson
                                configured, whose lists of sources are checked too.
"""

import collections
import json
import os
import re
import sys

LIBRARIES = ['base', 'stream', 'cluster', 'matching', 'tri', 'terrain']
# The libraries that each may use besides libbase. All may use libbase, and it uses none.
SIBLINGS = {'terrain': ['stream', 'cluster', 'tri']}
# The rooms that use the libraries. No library uses them.
PROGRAMS = ['python', 'tools', 'viewer']
# Algorithms and experiments of the thesis that are not part of the product. They may use all libraries and their private headers.
RESEARCH = 'research'
# The files that contain the version, besides the meson.build of each library.
VERSIONED = ['CITATION.cff', 'python/terrace/__init__.py', 'python/qgis/terrace_processing/metadata.txt', 'viewer/package.json',
             'viewer/package-lock.json']
# The rooms of libterrain by rank: a room uses only those of lower rank.
TERRAIN_ROOMS = {'base': 0, 'earth': 1, 'build': 2, 'surface': 2, 'view': 2, 'sample': 3, 'contour': 3,
                 'mesh': 3, 'tile': 3}
# The rooms of libstream by rank. A room within a room (`store/read`) has its rank.
STREAM_ROOMS = {'io': 0, 'laz': 0, 'net': 1, 'order': 1, 'raster': 1, 'store': 2, 'format': 3}
# The largest number of sources in a folder that a newcomer can grasp at a glance.
MOST_SOURCES = 40
# The value of the option in meson.build.
UNITY_SIZE = 30
# A file with fewer lines, or a private header that one file includes, is usually part of another concept. The lists below
# give the reason for each exception.
FEWEST_LINES = 25
NVCC = 'joins a source that nvcc compiles to one that it does not'
EXPERIMENT = 'an algorithm that only tests and experiments use'
VECTORS = 'compiled with the flags of one instruction set'
INSTANTIATED = 'instantiates a template for one set of targets'
OPTION = 'an option of several public headers'
EXPANSION = 'names of folders, lists and patterns become names of files'
SHORT_FILES = {
    'libstream/src/net/byte_parts.hpp': 'plans requests; apart from the network',
    'libcluster/include/terrace/cluster/point.hpp': 'the type that all public headers share',
    'libcluster/src/cuda/probe.cu': 'compiled alone, when Meson looks for a CUDA compiler',
    'libcluster/src/cuda/rounds.hpp': NVCC,
    'libcluster/src/linkage/kernels_avx2.cpp': VECTORS,
    'libcluster/src/linkage/kernels_avx512.cpp': VECTORS,
    'libcluster/src/linkage/kernels_portable.cpp': VECTORS,
    'libmatching/include/terrace/matching/point.hpp': 'the type that all public headers share',
    'libmatching/src/assignment/scan_kernels_avx2.cpp': VECTORS,
    'libmatching/src/assignment/scan_kernels_avx512.cpp': VECTORS,
    'libmatching/src/assignment/scan_kernels_portable.cpp': VECTORS,
    'libstream/include/terrace/stream/point.hpp': 'the type that all public headers share',
    'libstream/src/format/input_files.hpp': EXPANSION,
    'libstream/src/format/mesh/triangles.hpp': 'the triangles of all mesh formats',
    'libstream/src/format/raster_points.hpp': 'how raster formats open files',
    'libstream/src/store/read/view.hpp': 'an interface that keeps conditions out of the core of the viewer',
    'libterrain/include/terrace/terrain/error.hpp': 'the error that all public functions throw',
    'libterrain/include/terrace/terrain/fill.hpp': OPTION,
    'libterrain/include/terrace/terrain/height_reference.hpp': OPTION,
    'libterrain/src/base/geojson_crs.hpp': 'the CRS of GeoJSON, for its readers and writers',
    'libterrain/src/base/point_spacing.hpp': 'one algorithm',
    'libterrain/src/base/stopwatch.hpp': 'a class that all rooms use',
    'libterrain/src/earth/crs/proj_reader.hpp': 'keeps PROJ out of definition.hpp',
    'libterrain/src/mesh/vtk_file.hpp': 'one file format',
    'libterrain/src/sample/raster_grid.hpp': 'the cells of a raster, apart from their heights',
    'libterrain/src/view/core.cpp': INSTANTIATED,
    'libterrain/src/view/core_surface.cpp': INSTANTIATED,
    'libtri/src/predicates.cpp': 'implements a public header',
    'libtri/src/tin/scan_impl.hpp': 'lists the scans that are compiled for each instruction set',
    'libtri/src/view/geomorph.cpp': INSTANTIATED,
    'libtri/src/view/surface.cpp': INSTANTIATED,
    'research/tri/ear_queue.hpp': EXPERIMENT,
    'tools/src/cli/option_names.hpp': 'one function, with its table',
    'tools/src/main.cpp': 'the entry point',
    'tools/src/pch/command.hpp': 'the precompiled header',
    'tools/src/scan/criterion.hpp': 'options that a fuzz target parses too',
    'tools/src/serve/viewer_files.hpp': 'the interface of a generated source',
    'tools/src/tables/label_file.hpp': 'one file format',
}
ENGINE = 'a step of the engine'
SLOTS = 'one kind of clusters that linkage.cpp agglomerates'
TESTED = 'a part that tests use alone'
ON_CPU = 'code for a GPU that tests run on the CPU'
SCAN = 'an inner loop that is compiled for each instruction set'
TEMPLATE = 'implements a public template for the sources that instantiate it'
BUILD = 'a step of the build'
SEARCH = 'a search structure, apart from what queries it'
WINDOW = 'the mesh of one window, apart from the loop over windows'
SINGLE_USER_HEADERS = {
    'libcluster/src/block/engine_gain.hpp': ENGINE,
    'libcluster/src/block/engine_seed.hpp': ENGINE,
    'libcluster/src/cuda/device.cuh': 'what only nvcc can compile',
    'libcluster/src/cuda/device_band.hpp': ON_CPU,
    'libcluster/src/cuda/device_complete.hpp': ON_CPU,
    'libcluster/src/cuda/device_dendrogram.hpp': ON_CPU,
    'libcluster/src/cuda/device_single.hpp': ON_CPU,
    'libstream/src/net/aws_account.hpp': 'finds settings and credentials',
    'libstream/src/net/aws_signature.hpp': 'signs requests; has its own test',
    'libstream/src/net/byte_parts.hpp': 'plans requests; apart from the network',
    'libstream/src/net/origin.hpp': 'URLs and signatures, apart from bytes',
    'libstream/src/net/remote_folder.hpp': 'files by ranges, apart from the store',
    'libstream/src/net/url.hpp': 'the parts of a URL',
    'libstream/src/format/copc/octree_builder.hpp': 'sorts points into an octree; has its own tests',
    'libstream/src/format/geojson/properties.hpp': 'the properties of features as columns',
    'libstream/src/format/geojson/items.hpp': 'cuts a stream of JSON into features',
    'libstream/src/format/geotiff/blocks.hpp': 'decodes tiles and strips',
    'libstream/src/format/geotiff/directory.hpp': 'the bytes of TIFF directories',
    'libstream/src/format/geotiff/georeference.hpp': 'tags to places; has its own tests',
    'libstream/src/format/geotiff/overviews.hpp': 'the pyramid of overviews',
    'libstream/src/format/input_files.hpp': EXPANSION,
    'libstream/src/format/text/xyz_layout.hpp': 'guesses separators and columns, before points are read',
    'libstream/src/io/gzip_stream.hpp': 'a decoder with its own tests',
    'libstream/src/laz/pointwise_v1.hpp': 'the oldest of three versions of a codec, one in each header',
    'libstream/src/store/write/level_writer.hpp': 'writes the files of one level',
    'libmatching/src/assignment/column_tree.hpp': 'a search structure, apart from the method that queries it',
    'libmatching/src/blossom/nesting_tree.hpp': 'a tree of the solution, apart from the search for violated edges',
    'libmatching/src/blossom/pricing.hpp': 'the search for violated edges, apart from the solver and its caller',
    'libmatching/src/windows/discs.hpp': 'the lower bound, apart from the matching',
    'libterrain/src/base/region_grid.hpp': SEARCH,
    'libterrain/src/build/mesh_input.hpp': BUILD,
    'libterrain/src/contour/lines.hpp': TESTED,
    'libterrain/src/contour/text.hpp': 'the output, apart from the lines',
    'libterrain/src/earth/line_distance.hpp': TESTED,
    'libterrain/src/mesh/bounded/point_mesh_samples.hpp': 'the samples on disk, apart from the meshes',
    'libterrain/src/mesh/bounded/raster_window_tin.hpp': WINDOW,
    'libterrain/src/mesh/height_grid.hpp': TESTED,
    'libterrain/src/mesh/vertex_heights.hpp': 'the change of heights, apart from the mesh',
    'libterrain/src/mesh/vtk_file.hpp': 'one file format',
    'libterrain/src/sample/place_file.hpp': TESTED,
    'libterrain/src/sample/raster_grid.hpp': 'the cells of a raster, apart from their heights',
    'libterrain/src/sample/sample_run.hpp': TESTED,
    'libterrain/src/sample/store_probe.hpp': TESTED,
    'libterrain/src/surface/cluster_frontier.hpp': SEARCH,
    'libterrain/src/surface/point_star.hpp': TESTED,
    'libterrain/src/tile/make/crowded_leaf.hpp': TESTED,
    'libterrain/src/tile/make/height_blocks.hpp': TESTED,
    'libterrain/src/tile/make/point_surface.hpp': TESTED,
    'libterrain/src/tile/make/tiled_raster.hpp': TESTED,
    'libterrain/src/tile/set/writer.hpp': 'the files of a tile set, apart from the choice of tiles',
    'libtri/src/interpolation/sampler.hpp': 'the answer to one query, apart from the threads that share the queries',
    'libtri/src/shape/extract_surface.hpp': 'the surface of a shape, which tests use alone',
    'libtri/src/shape/peel.hpp': 'the rules that peel, templates over criteria',
    'libtri/src/shape/surface_distance.hpp': 'a tree of boxes with its own tests',
    'libtri/src/tin/rows/padded_samples.hpp': 'the layout for the scans, which tests use alone',
    'libtri/src/tin/scan_check.hpp': SCAN,
    'libtri/src/tin/scan_grid.hpp': SCAN,
    'libtri/src/tin/scan_rows.hpp': SCAN,
    'libtri/src/view/cache.hpp': 'the cache, apart from the control that fills it',
    'libtri/src/view/control.hpp': TEMPLATE,
    'libtri/src/view/geomorph.hpp': TEMPLATE,
    'libtri/src/view/patches.hpp': 'a search structure, apart from the geomorph that queries it',
    'libtri/src/view/window_demand.hpp': 'the choice of tolerances, apart from the control that applies them',
    'libcluster/src/cuda/rounds.hpp': NVCC,
    'libcluster/src/facility/points/space_search.hpp': 'a template over the kinds of distances',
    'libcluster/src/hierarchy/block_clusterers.hpp': TESTED,
    'libcluster/src/hierarchy/block_pipeline.hpp': 'the threads, apart from what they do',
    'libcluster/src/hierarchy/engine.hpp': 'lets tests replace the clustering',
    'libcluster/src/k_means/filter.hpp': 'an algorithm, apart from its calls',
    'libcluster/src/linkage/cluster_means.hpp': SLOTS,
    'libcluster/src/linkage/complete_rounds.hpp': 'an algorithm, apart from its inputs',
    'libcluster/src/linkage/distance_triangle.hpp': SLOTS,
    'libcluster/src/linkage/spanning_tree.hpp': 'an algorithm, apart from its inputs',
    'research/cluster/lp_rounding.hpp': EXPERIMENT,
    'research/tri/ear_queue.hpp': EXPERIMENT,
    'tools/src/pch/command.hpp': 'the precompiled header, which the compiler includes',
    'tools/src/picture/picture_input.hpp': 'reads what a verb draws',
    'tools/src/scan/criterion.hpp': 'options that a fuzz target parses too',
    'tools/src/serve/server.hpp': 'hides Boost from the verb',
    'tools/src/synth/fractal.hpp': TESTED,
    'tools/src/synth/synth_cloud.hpp': TESTED,
    'tools/src/synth/synth_dem.hpp': 'a generator, apart from its verb',
    'tools/src/verbs/cluster_methods.hpp': 'the methods, apart from the options of their verb',
    'viewer/core/transitions.hpp': 'a part of the scene',
}
LICENCES = {
    'libbase': 'Apache-2.0',
    'libstream': 'Apache-2.0',
    'libcluster': 'Apache-2.0',
    'libmatching': 'Apache-2.0',
    'libtri': 'Apache-2.0',
    'libterrain': 'Apache-2.0',
    'python': 'Apache-2.0',
    'tools': 'GPL-3.0-or-later',
    'viewer': 'GPL-3.0-or-later',
    'docs': 'GPL-3.0-or-later',
    'research': 'GPL-3.0-or-later',
    'tests': 'GPL-3.0-or-later',
}

# Headers that only some places may include: a pattern of the name, and the folders and files that may include it.
# check_include() has stricter rules for public headers.
TESTS = ['tests', 'libbase/tests', 'libstream/tests', 'libcluster/tests', 'libmatching/tests', 'libtri/tests', 'libterrain/tests',
         RESEARCH]
BENCHES = ['tests/bench', 'libbase/bench', 'libstream/bench', 'libcluster/bench', 'libmatching/bench', 'libtri/bench',
           'libterrain/bench']
# The places that use CGAL. All code that computes on integers must compile without it.
IN_CGAL = ['libtri/src/delaunay2/double_kernel.cpp', 'libtri/src/delaunay2/elliptical_kernel.cpp', 'libtri/src/delaunay3',
           'libtri/src/interpolation', 'libtri/src/shape', 'libtri/tests', 'libtri/bench', 'tools/src/scan', 'tests/bench', RESEARCH]
IN_STREAM = ['libstream/src', 'libstream/tests', 'libstream/bench', 'libstream/fuzz']
RESTRICTED = [
    (r'CGAL/|gmp(xx)?\.h|mpfr\.h', IN_CGAL),
    (r'boost/', IN_CGAL + ['tools/src/serve']),
    (r'GeographicLib/|proj(_experimental)?\.h', ['libterrain/src/earth', 'libterrain/tests']),
    (r'geos(_c)?\.h|geos/', ['libterrain/src/base']),
    (r'tiff(io|io\.hxx|conf|vers)?\.h|png\.h|zip\.h|zstd\.h|libdeflate\.h', IN_STREAM),
    (r'zlib\.h', IN_STREAM + ['tools/src/serve']),
    (r'lemon/', ['libmatching/src', 'libmatching/tests', 'libmatching/bench']),
    (r'cuda_runtime|cuda\.h|cuda/(device|rounds)\.',
     ['libcluster/src', 'libcluster/tests', 'libcluster/bench']),
    (r'glpk\.h', [RESEARCH]),
    (r'CLI/', ['tools']),
    (r'curl/|openssl/', ['libstream/src/net']),
    (r'fmt/', ['libstream/src', 'libterrain/src', 'tools/src']),
    (r'pybind11/|Python\.h', ['python']),
    (r'nlohmann/', ['libterrain/src', 'libterrain/tests', 'libterrain/fuzz', 'tools', 'tests'] + IN_STREAM),
    (r'gtest/|gmock/', TESTS + ['tools', 'viewer/tests']),
    (r'benchmark/', BENCHES),
]

# The folders that build texts with {fmt}. Exceptions are headers, which would slow down every source, and the sources that
# the Makefile of the browser's core also compiles, because they have only the standard library.
FORMATTED = ['libstream/src', 'libterrain/src', 'tools/src']
CORE_MAKEFILE = 'viewer/core/Makefile'
# The list of the command's tests. It runs long files class by class.
CLI_TESTS = 'tests/cli/meson.build'

# Functions of the C library whose last bit differs between releases and processors. If bytes depended on them, the same
# input would give different bytes elsewhere. Sources use <terrace/base/portable_math.hpp> instead. The functions sqrt,
# fma, fmod, remquo, frexp and ldexp are exact.
INEXACT = (r'(?:acosh?|asinh?|atan[2h]?|cbrt|cosh?|erfc?|exp(?:2|m1)?|hypot|[lt]gamma|'
           r'log(?:10|1p|2)?|pow|sincos|sinh?|tanh?)')
INEXACT_USE = re.compile(rf'\bstd::{INEXACT}[fl]?\b|(?<![\w.>:]){INEXACT}[fl]?\(')
# The files that may use these functions, and why. GeographicLib, which only libterrain uses, consists of such functions too.
CAMERA = 'the camera: affects which clusters a view requests, never the bytes of a file'
EARTH = 'positions on the earth, whose formulas consist of such functions: ARCHITECTURE.md says what depends on them'
MAY_DIFFER = {
    'libbase/include/terrace/base/portable_math.hpp': 'defines functions of these names',
    'libtri/src/view/columns.cpp': CAMERA,
    'libtri/src/view/view.cpp': CAMERA,
    'libterrain/src/earth/crs/projection.cpp': EARTH,
    'libterrain/src/base/units.cpp': 'summaries for people, rounded; files have all digits',
}

# The parts of CGAL under the LGPL. All others count as GPL. Libraries, which are Apache-2.0, do not use those, and a
# test or benchmark that compares with one is GPL itself.
CGAL_LGPL = re.compile(r'CGAL/(Exact_(predicates|rational)|Gmpq|Mpzf|Simple_cartesian|hilbert_sort)')
COMPARES = re.compile(r'lib[a-z]+/(tests|bench)/')

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
USING_NAMESPACE = re.compile(r'\s*using\s+namespace\b')
SOURCE_ENDINGS = ('.cpp', '.hpp', '.h', '.cu', '.cpp.in', '.py', '.sh')
# Folders whose files must be in a Meson list: folder, ending of the files, the file with the list, and the ending that the
# list omits.
LISTED = [('include/terrace/{}', '.hpp', 'src/meson.build', ''),
          ('tests', '_test.cpp', 'tests/meson.build', ''),
          ('bench', '_bench.cpp', 'bench/meson.build', '_bench.cpp'),
          ('fuzz', '_fuzz.cpp', 'fuzz/meson.build', '.cpp'),
          ('examples', '.cpp', 'examples/meson.build', '.cpp')]


def files_below(root, folder):
    """Paths relative to root, without links, hidden folders and the build folders of root and its rooms."""
    for path, folders, names in os.walk(os.path.join(root, folder)):
        builds = re.compile('build(-.*)?$' if os.path.relpath(path, root).count('/') == 0 else '$.')
        folders[:] = sorted(f for f in folders
                            if not f.startswith('.') and f != '__pycache__' and not builds.match(f))
        for name in sorted(names):
            yield os.path.relpath(os.path.join(path, name), root)


def below(path, folder):
    return path.startswith(folder + '/')


def read(root, path):
    with open(os.path.join(root, path), encoding='utf-8') as file:
        return file.read()


def library_of(path):
    """'tri' for libtri/...; None elsewhere."""
    room = path.split('/')[0]
    return room[3:] if room[:3] == 'lib' and room[3:] in LIBRARIES else None


def is_gpl(name):
    return name.startswith('CGAL/') and not CGAL_LGPL.match(name)


def check_include(path, bracket, name):
    """Yields the breaches of one #include line."""
    library = library_of(path)
    if library:
        for other in LIBRARIES:
            if other not in ['base', library] + SIBLINGS.get(library, []) and name.startswith(f'terrace/{other}/'):
                yield f'includes its sibling\'s <{name}>'
        if bracket == '"':
            target = os.path.normpath(os.path.join(os.path.dirname(path), name))
            if target.startswith('..') or not below(target, f'lib{library}'):
                if '..' in name.split('/'):
                    yield f'includes "{name}", a file outside its library'
    here = re.match(r'lib(terrain|stream)/src/([a-z]+)/', path)
    if here:
        rooms = TERRAIN_ROOMS if here.group(1) == 'terrain' else STREAM_ROOMS
        room, own = name.split('/')[0], here.group(2)
        if room in rooms and room != own and rooms[room] >= rooms.get(own, -1):
            yield f'includes "{name}", whose room is not below its own'
    for pattern, folders in RESTRICTED:
        if re.match(pattern, name) and not any(path == place or below(path, place) for place in folders):
            yield f'includes <{name}>, which only {", ".join(folders)} may'
    if library and is_gpl(name) and not COMPARES.match(path):
        yield f'includes <{name}>, which is GPL; a library may not use it'
    if library and below(path, f'lib{library}/include'):
        own = name.startswith(tuple(f'terrace/{known}/' for known in ['base', library] + SIBLINGS.get(library, [])))
        if not own and not (bracket == '<' and re.fullmatch(r'[a-z_0-9]+', name)):
            yield f'is a public header and includes <{name}>; it may use the standard library only'


def check_sources(root):
    for room, licence in LICENCES.items():
        for path in files_below(root, room):
            name = os.path.basename(path)
            if not name.endswith(SOURCE_ENDINGS) and name not in ('meson.build', 'meson_options.txt'):
                continue
            lines = read(root, path).split('\n')
            includes = [(number, match.groups()) for number, match in enumerate(map(INCLUDE.match, lines), 1) if match]
            expected = licence
            if COMPARES.match(path) and any(is_gpl(included) for _, (_, included) in includes):
                expected = 'GPL-3.0-or-later'
            first = lines[1] if lines[0].startswith('#!') and len(lines) > 1 else lines[0]
            found = re.search(r'SPDX-License-Identifier: (\S+)', first)
            if not found:
                yield f'{path}: has no SPDX line at its head; expected {expected}'
            elif found.group(1) != expected:
                yield f'{path}: its SPDX line says {found.group(1)}, not {expected}'
            if not name.endswith(('.cpp', '.hpp', '.h', '.cu', '.cpp.in')):
                continue
            for number, included in includes:
                for breach in check_include(path, *included):
                    yield f'{path}:{number}: {breach}'
            if name.endswith(('.hpp', '.h')):
                for number, line in enumerate(lines, 1):
                    if USING_NAMESPACE.match(line):
                        yield f'{path}:{number}: a header has `using namespace`, which reaches all files that include it; qualify the names'


def check_inexact(root):
    """Yields uses of inexact functions of the C library outside the files of MAY_DIFFER."""
    used = set()
    for folder in [f'lib{library}/{part}' for library in LIBRARIES for part in ('include', 'src')] + ['tools/src']:
        for path in files_below(root, folder):
            for number, line in enumerate(read(root, path).split('\n'), 1):
                found = INEXACT_USE.search(line.split('//')[0])
                if found and path in MAY_DIFFER:
                    used.add(path)
                elif found:
                    yield (f'{path}:{number}: {found.group(0).rstrip("(")} has other last bits on other machines; '
                           'use portable_math.hpp, or say in MAY_DIFFER why no output depends on it')
    for path in sorted(set(MAY_DIFFER) - used):
        yield f'{path}: is in MAY_DIFFER but uses no such function; delete the entry'


def core_sources(root):
    """The sources of libstream and libterrain that also compile to WebAssembly."""
    if not os.path.isfile(os.path.join(root, CORE_MAKEFILE)):
        return set()
    makefile = read(root, CORE_MAKEFILE).replace('\\\n', ' ')
    listed = {library: re.search(rf'^{library.upper()} := (.*)$', makefile, re.MULTILINE) for library in ('stream', 'terrain')}
    return {f'lib{library}/src/{name}.cpp' for library, names in listed.items() if names for name in names.group(1).split()}


def check_texts(root):
    """Texts are built with {fmt}, or with std::to_string where {fmt} is not available."""
    core = core_sources(root)
    for path in sorted(core):
        if not os.path.isfile(os.path.join(root, path)):
            yield f'{path}: is in {CORE_MAKEFILE} but does not exist'
    for folder in FORMATTED:
        for path in files_below(root, folder):
            if not path.endswith(('.cpp', '.hpp')):
                continue
            plain = path in core or path.endswith('.hpp')
            for number, line in enumerate(read(root, path).split('\n'), 1):
                if plain and (re.search(r'\bfmt::', line) or re.match(r'\s*#\s*include\s*<fmt/', line)):
                    yield f'{path}:{number}: uses {{fmt}}, which neither headers nor the sources in {CORE_MAKEFILE} may'
                if not plain and re.search(r'\bstd::to_string\b', line.split('//')[0]):
                    yield f'{path}:{number}: uses std::to_string; build the text with fmt::format'


def strings_of(line):
    """The string literals of a line, without those in a comment after it."""
    return re.findall(r'"(?:[^"\\]|\\.)*"', re.sub(r'("(?:[^"\\]|\\.)*")|//.*', lambda m: m.group(1) or '', line))


def check_command(root):
    """The libraries know neither the command's options nor the signals of a process."""
    table = os.path.join('tools', 'src', 'cli', 'option_names.cpp')
    known = set(re.findall(r'\{"([a-z_]+)", "--?[a-z]', read(root, table)) if os.path.isfile(os.path.join(root, table)) else [])
    for folder in [f'lib{library}/{part}' for library in LIBRARIES for part in ('include', 'src')]:
        for path in files_below(root, folder):
            if not path.endswith(('.cpp', '.hpp', '.h', '.cu')):
                continue
            source = read(root, path)
            for number, line in enumerate(source.split('\n'), 1):
                if re.search(r'\bsigaction\b|\bstd::signal\b', line):
                    yield f'{path}:{number}: handles signals of the process, which only tools may'
                for text in strings_of(line):
                    if re.search(r'--[a-z]', text):
                        yield f'{path}:{number}: names an option of the command; name the parameter with message()'
                    for name in re.findall(r'`([a-z_]+)`', text):
                        yield f'{path}:{number}: names `{name}` in a text; name the parameter with message("{{{name}}}")'
            for pattern in re.finditer(r'\bmessage\(\s*((?:"(?:[^"\\]|\\.)*"\s*)+)', source):
                number = source.count('\n', 0, pattern.start()) + 1
                for name in re.findall(r'\{([^{}]+)\}', re.sub(r'"\s*"', '', pattern.group(1))):
                    if name not in known:
                        yield f'{path}:{number}: names the parameter {name}, which {table} does not know'


def check_meson(root):
    for library in LIBRARIES:
        room = f'lib{library}'
        for path in files_below(root, room):
            if os.path.basename(path) != 'meson.build':
                continue
            for name in re.findall(r"(?:dependency|subproject)\(\s*'([^']+)'", read(root, path)):
                sibling = name.startswith('terrace-') and name[8:] not in ['base', library] + SIBLINGS.get(library, [])
                if sibling or (name in ('geographiclib', 'proj', 'geos') and library != 'terrain') or (name in ('gmp', 'mpfr') and library != 'tri'):
                    yield f'{path}: depends on {name}'
        for folder, ending, list_path, cut in LISTED:
            folder = folder.format(library)
            if not os.path.isdir(os.path.join(root, room, folder)):
                continue
            # libbase has headers alone, listed at its top.
            list_path = list_path if os.path.isfile(os.path.join(root, room, list_path)) else 'meson.build'
            listed = read(root, f'{room}/{list_path}')
            for name in sorted(os.listdir(os.path.join(root, room, folder))):
                if name.endswith(ending):
                    entry = name[:-len(cut)] if cut else name
                    if f"'{entry}'" not in listed and f"'{name}'" not in listed:
                        yield f'{room}/{folder}/{name}: is not in the list of {room}/{list_path}'


def check_rooms(root):
    for library in LIBRARIES:
        link = os.path.join(root, 'subprojects', f'terrace-{library}')
        if not os.path.islink(link) or os.readlink(link) != f'../lib{library}':
            yield f'subprojects/terrace-{library}: is not a link to ../lib{library}'
        for name in ('LICENSE', 'README.md', 'meson.build', 'meson_options.txt'):
            if not os.path.isfile(os.path.join(root, f'lib{library}', name)):
                yield f'lib{library}/{name}: is missing'
    for room in PROGRAMS:
        for name in ('LICENSE', 'README.md'):
            if not os.path.isfile(os.path.join(root, room, name)):
                yield f'{room}/{name}: is missing'


def check_research(root):
    """Nothing uses research/, nothing of it is installed, and its lists of sources are complete."""
    own = [path for path in files_below(root, RESEARCH) if path.endswith(SOURCE_ENDINGS)]
    headers = {os.path.relpath(path, RESEARCH) for path in own if path.endswith('.hpp')}
    for room in LICENCES:
        for path in files_below(root, room) if room != RESEARCH else []:
            name = os.path.basename(path)
            if name == 'meson.build' and re.search(r'\bresearch', read(root, path)):
                yield f'{path}: names research, which only the workspace\'s meson.build may'
            if not path.endswith(('.cpp', '.hpp', '.h', '.cu')):
                continue
            for number, line in enumerate(read(root, path).split('\n'), 1):
                included = INCLUDE.match(line)
                if 'terrace::research' in line or (included and re.sub(r'^(\.\./)*research/', '', included.group(2)) in headers):
                    yield f'{path}:{number}: uses research, which nothing may'
    for path in files_below(root, RESEARCH):
        if os.path.basename(path) == 'meson.build' and re.search(r'\binstall(_\w+)?\s*[:(]', read(root, path)):
            yield f'{path}: installs something of research'
    for path in own:
        listed = os.path.join(os.path.dirname(path), 'meson.build')
        if path.endswith('.cpp') and f"'{os.path.basename(path)}'" not in read(root, listed):
            yield f'{path}: is not in {listed}'


def check_versions(root):
    """These files contain the version of the file VERSION. All other files read that one."""
    version = read(root, 'VERSION').strip()
    for path in [f'lib{library}/meson.build' for library in LIBRARIES] + VERSIONED:
        # In a lock file the first version is that of the project.
        found = re.search(r"""^\s*["_]*version["_]*\s*[:=]\s*["']?([^"',\s]*)""", read(root, path), re.MULTILINE)
        if not found or found.group(1) != version:
            yield f'{path}: does not have the version {version} of the file VERSION'


def check_folders(root):
    for folder in [f'lib{library}/src' for library in LIBRARIES] + ['python/src', 'tools/src', 'viewer/core', RESEARCH]:
        sources = collections.Counter(os.path.dirname(path) for path in files_below(root, folder)
                                      if path.endswith(('.cpp', '.hpp', '.h', '.cu')))
        for place, count in sorted(sources.items()):
            if count > MOST_SOURCES:
                yield f'{place}: has {count} sources, more than {MOST_SOURCES}'


def check_test_classes(root):
    """Yields test classes that tests/cli/meson.build omits, although it lists the classes of their file."""
    listed = read(root, CLI_TESTS) if os.path.isfile(os.path.join(root, CLI_TESTS)) else ''
    for name, classes in re.findall(r"'(\w+)' : \[([^\]]+)\]", listed):
        path = f'{os.path.dirname(CLI_TESTS)}/{name}.py'
        for found in re.findall(r'^class (\w+)\(.*\n(?:(?:[ #].*)?\n)*?    def test_', read(root, path), re.MULTILINE):
            if f"'{found}'" not in classes:
                yield f'{path}: {found} is not in the list of {CLI_TESTS}, so it never runs'


def is_production(path):
    return path.endswith(('.cpp', '.hpp', '.h', '.cu', '.cuh')) and not re.search(r'(^|/)(tests|bench|fuzz|examples)/', path)


def users_of_headers(texts):
    """The production files that include each file, without the source of the same name."""
    users = collections.defaultdict(set)
    for path, text in texts.items():
        room = path.split('/')[0]
        for line in text.split('\n'):
            included = INCLUDE.match(line)
            if not included:
                continue
            name = included.group(2)
            # A file may include headers of its own room, and, in research and the viewer's core, private headers of a library.
            folders = [os.path.dirname(path), f'{room}/src', room] + [f'lib{library}/src' for library in LIBRARIES] + ['']
            for target in (os.path.normpath(os.path.join(folder, name)) for folder in folders):
                if target in texts:
                    if os.path.splitext(target)[0] != os.path.splitext(path)[0]:
                        users[target].add(path)
                    break
    return users


def check_sizes(root):
    """Short files and private headers with one user, each of which needs a reason. Tests are not users."""
    texts = {path: read(root, path) for room in LICENCES for path in files_below(root, room) if is_production(path)}
    users = users_of_headers(texts)
    short = {path for path, text in texts.items() if text.count('\n') < FEWEST_LINES}
    single = {path for path in texts if path.endswith(('.hpp', '.h', '.cuh')) and '/include/' not in path and len(users[path]) < 2}
    for found, reasons, what in ((short, SHORT_FILES, f'has fewer than {FEWEST_LINES} lines'),
                                 (single, SINGLE_USER_HEADERS, 'is a private header with one user')):
        for path in sorted(found - set(reasons)):
            yield f'{path}: {what}; merge it into its user or into the concept it belongs to, or give check_layout.py a reason'
        for path in sorted(set(reasons) - found):
            yield f'{path}: has a reason in check_layout.py that does not apply: no such file {what}'


def check_unity(build):
    """Meson 1.0 expects one object too many if a unity build joins a multiple of unity_size sources and another target
    uses their objects."""
    for target in json.loads(read(build, 'meson-info/intro-targets.json')):
        for group in target['target_sources']:
            count = len(group.get('sources', []))
            if target['type'] == 'static library' and count > 0 and count % UNITY_SIZE == 0:
                yield f"{target['defined_in']}: {target['name']} has {count} sources, a multiple of unity_size: join or split two files"


def breaches(root):
    yield from check_rooms(root)
    yield from check_sources(root)
    yield from check_inexact(root)
    yield from check_command(root)
    yield from check_texts(root)
    yield from check_meson(root)
    yield from check_research(root)
    yield from check_versions(root)
    yield from check_folders(root)
    yield from check_test_classes(root)
    yield from check_sizes(root)


def main():
    found = list(breaches(sys.argv[1]))
    for build in sys.argv[2:]:
        found += check_unity(build)
    for breach in found:
        print(breach)
    print(f'{len(found)} breaches of the layout')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
