#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks that the command still writes the same bytes as before.

TERRACE=path/to/terrace golden_test.py [--update] [--keep FOLDER] [--list FILE] [--jobs N]

The list, golden.txt, has commands, each followed by its results:

    $ terrace build hills.tif -o hills.terrace --block 600
    = --threads 1 --memory 200M
      summary {"points": 7390, "nodata": 290, "levels": 2}
      5b1f... hills.terrace
      09ac... hills.terrace/manifest.json

A line with $ is run; `< FILE` at its end redirects standard input. Commands run in parallel, but after those
whose output they need. A line with = gives options with which the same command must write the same bytes.

Hashes are SHA-256: of a file's bytes, and of a folder's list of the lines below it. Of pictures, GeoTIFFs
and compressed tiles, the decompressed content is hashed, because the compressed bytes depend on system
libraries. Texts written with --to-crs are hashed with rounded numbers, because the last digits of
coordinates depend on the C library's sines. Bytes marked with `~` before the hash may change between
releases (pictures, the journal of a tile set). All others change only on purpose, and a release says so.

After such a change, golden_test.py --update runs all commands and rewrites the list. To add a command, add
its $ line and do the same.
"""

import argparse
import concurrent.futures
import gzip
import hashlib
import json
import os
import re
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, '..', 'cli'))

from cli_test import png_pixels  # noqa: E402
from golden_inputs import make_inputs  # noqa: E402
from small_tiff import tiff_content  # noqa: E402

# Absolute, because the commands run in another folder.
TERRACE = os.path.abspath(shutil.which(os.environ.get('TERRACE', 'terrace')) or 'terrace')
JOURNAL = '.terrace-tiles'

# The parts of summaries that are results. Times, memory and file sizes are not.
KEYS = ['format', 'ok', 'points', 'nodata', 'levels', 'vertices', 'triangles', 'tetrahedra', 'samples',
        'covered', 'uncovered', 'max_error', 'tiles', 'zooms', 'answered', 'lines', 'rows', 'columns',
        'clusters', 'cost', 'opening_cost', 'connection_cost', 'pairs', 'unmatched', 'bounds', 'crs',
        'vertical']


class Step:
    """A command of the list and the lines below it."""

    def __init__(self, number, command):
        self.number, self.command = number, command
        self.variants, self.expected = [], []
        words = shlex.split(command)
        assert words[0] == 'terrace', f'line {number}: a command must begin with "terrace"'
        self.input = None
        if '<' in words:
            self.input = words[words.index('<') + 1]
            del words[words.index('<'):]
        self.arguments = words[1:]
        options = {'-o', '--save-overlay', '--dendrogram'}
        if self.arguments[0] == 'cluster':
            options.add('--labels')
        self.output_positions = [i + 1 for i, word in enumerate(self.arguments[:-1]) if word in options]
        self.outputs = [self.arguments[i] for i in self.output_positions]

    def reads(self):
        """Returns the words that may be names of input files, also after a colon (elliptical:FILE)."""
        words = [w for i, w in enumerate(self.arguments) if i not in self.output_positions]
        return {self.input, *words, *(w.split(':', 1)[-1] for w in words)}

    def run(self, folder, options, prefix):
        """Runs the command with prefixed output names. Returns the lines for the list."""
        arguments = list(self.arguments)
        for i in self.output_positions:
            if arguments[i] != '-':
                arguments[i] = prefix + arguments[i]
        to_stdout = '-' in self.outputs
        if '--threads' not in arguments + options:
            options = [*options, '--threads', '2']
        if not to_stdout:
            options = [*options, '--json']
        standard_input = open(os.path.join(folder, self.input), 'rb') if self.input else None
        try:
            result = subprocess.run([TERRACE, *arguments, *options], cwd=folder, timeout=600,
                                    capture_output=True, stdin=standard_input or subprocess.DEVNULL)
        finally:
            if standard_input:
                standard_input.close()
        if result.returncode != 0:
            return [f'exit code {result.returncode}: ' + result.stderr.decode(errors='replace').strip()]
        lines = []
        if not to_stdout:
            summary = json.loads(result.stdout)
            summary = {key: summary[key] for key in KEYS if key in summary}
            lines.append('summary ' + json.dumps(summary))
        for name in self.outputs:
            if name == '-':
                lines.append(f'{hash_of(result.stdout)} -')
            else:
                lines += hash_lines(folder, prefix, name, rounded='--to-crs' in arguments)
        return lines


def hash_of(data):
    return hashlib.sha256(data).hexdigest()


def rounded_numbers(text):
    """Rounds the numbers in a text to a tenth of a millimetre."""
    def rounded(match):
        value = float(match.group())
        return f'{value:.{4 if abs(value) >= 1000 else 9}f}'

    return re.sub(rb'-?[0-9]+\.[0-9]+', lambda match: rounded(match).encode(), text)


def content_of(path):
    """Returns the reproducible content of a file: decompressed, because compressed bytes depend on a library."""
    if path.endswith('.png'):
        width, height, rows = png_pixels(path)
        return struct.pack('<II', width, height) + b''.join(rows)
    if path.endswith('.tif'):
        return tiff_content(path)
    with open(path, 'rb') as file:
        data = file.read()
    if os.path.basename(path) == JOURNAL:
        return data.split(b'\n', 1)[1]  # the first line names the version
    if data[:2] == b'\x1f\x8b':
        return gzip.decompress(data)
    return data


def hash_lines(folder, prefix, name, rounded):
    """Returns the lines for an output, which is a file or a folder."""
    path = os.path.join(folder, prefix + name)
    if os.path.isfile(path):
        mark = '~' if name.endswith('.png') else ''
        content = content_of(path)
        if rounded and not name.endswith('.tif'):
            content = rounded_numbers(content)
        return [f'{mark}{hash_of(content)} {name}']
    if not os.path.isdir(path):
        return [f'missing {name}']
    lines = []
    files = sorted(os.path.relpath(os.path.join(parent, file), path)
                   for parent, _, names in os.walk(path) for file in names)
    compressed = False
    for file in files:
        with open(os.path.join(path, file), 'rb') as stream:
            compressed = compressed or stream.read(2) == b'\x1f\x8b'
    for file in files:
        if file == JOURNAL and compressed:
            continue  # contains the sizes and checksums of the compressed tiles
        mark = '~' if file == JOURNAL else ''
        lines.append(f'{mark}{hash_of(content_of(os.path.join(path, file)))} {name}/{file}')
    stable = [line for line in lines if not line.startswith('~')]
    return [f'{hash_of(chr(10).join(stable).encode())} {name}'] + lines


class Inputs:
    """The line `$ inputs`, which stands for the files that golden_inputs.py writes. If these differ, the cause
    is Python, not terrace."""

    outputs = ()

    def __init__(self, number):
        self.number, self.command = number, 'inputs'
        self.variants, self.expected = [], []
        self.names = []

    def reads(self):
        return set()

    def run(self, folder, _options, _prefix):
        lines = []
        for name in self.names:
            with open(os.path.join(folder, name), 'rb') as file:
                lines.append(f'{hash_of(file.read())} {name}')
        return lines


def read_list(path):
    """Returns the steps, and all lines with each $ line replaced by its step."""
    steps, layout = [], []
    with open(path, encoding='utf-8') as file:
        for number, line in enumerate(file.read().splitlines(), 1):
            if line.startswith('$ '):
                steps.append(Inputs(number) if line == '$ inputs' else Step(number, line[2:]))
                layout.append(steps[-1])
            elif line.startswith('= '):
                steps[-1].variants.append(shlex.split(line[2:]))
            elif line.startswith('  '):
                steps[-1].expected.append(line.strip())
            else:
                layout.append(line)
    return steps, layout


def write_list(path, layout, results):
    text_lines = []
    for part in layout:
        if isinstance(part, str):
            text_lines.append(part)
            continue
        text_lines.append('$ ' + part.command)
        text_lines += ['= ' + shlex.join(options) for options in part.variants]
        text_lines += ['  ' + line for line in results[part][0][1]]
    text = '\n'.join(text_lines) + '\n'
    with open(path, 'w', encoding='utf-8') as file:
        file.write(text)


def run_all(steps, folder, jobs):
    """Returns {step: [(options, lines), ...]}, starting with the command as written."""
    producers = {}
    for step in steps:
        for name in step.outputs:
            assert name not in producers, f'line {step.number}: {name} is written by an earlier command'
            if name != '-':
                producers[name] = step
    running = {}

    def work(step):
        # The needed steps were submitted earlier, so this cannot wait forever.
        for needed in {producers[name] for name in step.reads() if name in producers}:
            running[needed].result()
        results = [('', step.run(folder, [], ''))]
        for i, options in enumerate(step.variants):
            prefix = f'again/{step.number}-{i}/'
            os.makedirs(os.path.join(folder, prefix))
            results.append((' '.join(options), step.run(folder, options, prefix)))
        return results

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for step in steps:
            for name in step.reads():
                assert name not in producers or producers[name] in running, (
                    f'line {step.number}: {name} is written by a later command')
            running[step] = pool.submit(work, step)
        return {step: running[step].result() for step in steps}


def first_difference(expected, found):
    for a, b in zip(expected, found):
        if a != b:
            return f'the list has  {a}\n      now it is   {b}'
    if len(expected) > len(found):
        return f'missing now: {expected[len(found)]}'
    return f'new: {found[len(expected)]}'


def complaints(steps, results):
    """Yields one text per command with different results, in the order of the list."""
    for step in steps:
        expected_lines = results[step][0][1]
        if expected_lines != step.expected:
            yield (f'  line {step.number}: {step.command}\n      '
                   + first_difference(step.expected, expected_lines))
            continue
        for options, lines in results[step][1:]:
            if lines != expected_lines:
                yield (f'  line {step.number}: {step.command}\n      with {options} it differs: '
                       + first_difference(expected_lines, lines))


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--update', action='store_true', help='rewrite the list')
    parser.add_argument('--keep', metavar='FOLDER', help='run in FOLDER, which must not exist, and keep all files')
    parser.add_argument('--list', default=os.path.join(HERE, 'golden.txt'))
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    options = parser.parse_args(arguments)
    steps, layout = read_list(options.list)
    with tempfile.TemporaryDirectory(prefix='terrace-golden-') as temporary:
        folder = options.keep or temporary
        if options.keep:
            os.makedirs(folder)
        steps[0].names = make_inputs(folder)
        results = run_all(steps, folder, options.jobs)
    runs = sum(len(result) for result in results.values())
    if options.update:
        failed = [step for step in steps if results[step][0][1][0].startswith('exit code')]
        for step in failed:
            print(f'line {step.number}: {step.command}\n  {results[step][0][1][0]}')
        if failed:
            return 1
        previous = {step: step.expected for step in steps}
        changed = sum(previous[step] != results[step][0][1] for step in steps)
        write_list(options.list, layout, results)
        for step in steps:
            step.expected = results[step][0][1]
        print(f'{changed} of {len(steps)} commands gave different results: see git diff')
    found = list(complaints(steps, results))
    if not found:
        print(f'{len(steps)} commands in {runs} runs: every output as listed')
        return 0
    print(f'{len(found)} of {len(steps)} commands do not match {options.list}.\n'
          'Look for the cause in the first; the others may follow from it.')
    print('\n'.join(found[:20]))
    if len(found) > 20:
        print(f'  and {len(found) - 20} more')
    print('If intended: golden_test.py --update, and say in the commit why the bytes changed.\n'
          'If not: golden_test.py --keep FOLDER keeps the files, to compare with those of a good build.')
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
