# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a page of Markdown, runs its blocks of code in order, and compares the output it shows.

Every fenced block of a page is tested. A comment before it determines how, unless its language does:

| block | what happens |
|---|---|
| `sh` | runs with `bash -eu` in the page's folder, which is empty at first |
| `python` | runs in the page's one Python session |
| `text` | must be the output (both streams) of the block before it |
| `<!-- test: file NAME -->` | is written to NAME in the page's folder |
| `<!-- test: excerpt PATH -->` | must be consecutive lines of PATH in the repository, except for the indentation; PATH is compiled and run by its own test |
| `<!-- test: exit N -->` | runs and must end with exit status N |
| `<!-- test: serves -->` | must print an address; is then interrupted and must end |
| `<!-- test: needs PROGRAM -->` | runs only where PROGRAM is installed |
| `<!-- test: skip REASON -->` | is not run; at most MOST_SKIPPED of a page |

Output may be shortened: a line `...` stands for any lines, and `...` within a line for any text. Values that differ
between runs (times, rates, peak memory, ports) must be shortened.
"""

import difflib
import json
import os
import re
import select
import shutil
import signal
import subprocess
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MOST_SKIPPED = 3
SECONDS = 300

FENCE = re.compile(r'^```(\w*)\s*$')
MARK = re.compile(r'^<!-- test: (\w+)(?: (.+?))? -->$')
WITH_ARGUMENT = {'file', 'excerpt', 'exit', 'needs', 'skip'}
WITHOUT_ARGUMENT = {'serves'}


class Fault(Exception):
    """A block fails, prints other output than the page shows, or does not say how it is tested."""


class Block:
    """One fenced block: language, text, the number of its first line, and its marks."""

    def __init__(self, language, line, marks):
        self.language, self.line, self.marks, self.lines = language, line, marks, []

    @property
    def text(self):
        return '\n'.join(self.lines) + '\n' if self.lines else ''


def blocks_of(text):
    """Returns the fenced blocks of a page. Marks count for the block that follows them."""
    blocks, marks, open_block = [], {}, None
    for number, line in enumerate(text.splitlines(), 1):
        fence, mark = FENCE.match(line), MARK.match(line)
        if open_block:
            if line == '```':
                open_block = None
            else:
                open_block.lines.append(line)
        elif fence:
            open_block = Block(fence[1], number, marks)
            blocks.append(open_block)
            marks = {}
        elif mark:
            word, argument = mark[1], mark[2]
            if word not in WITH_ARGUMENT | WITHOUT_ARGUMENT or (word in WITH_ARGUMENT) != bool(argument):
                raise Fault(f'line {number}: unknown mark: {line}')
            marks[word] = argument or ''
        elif line.startswith('```{'):  # a directive of Sphinx is not code
            open_block = Block('', number, {})
        elif line.lstrip().startswith(('```', '<!-- test', '~~~')):
            raise Fault(f'line {number}: a block or a mark must start its line as in tests/docs/pages.py: {line}')
        elif line.strip() and marks:
            raise Fault(f'line {number}: text between a mark and its block')
    if open_block or marks:
        raise Fault('the last block is not closed, or a mark has no block')
    return blocks


def pattern_of(shown):
    """Returns the regular expression that the output must match as a whole."""
    lines = shown.splitlines()
    if not any(line.strip(' .') for line in lines):
        raise Fault('a block of output shows no output')
    parts = []
    for line in lines:
        if line.strip() == '...':
            parts.append(r'(?:[^\n]*\n)*?')
        else:
            parts.append(r'[^\n]*'.join(re.escape(chunk) for chunk in line.rstrip().split('...')) + r'[ ]*\n')
    return re.compile(''.join(parts))


def compare(shown, output):
    """Raises Fault with a diff if the output is not the one shown."""
    if output and not output.endswith('\n'):
        output += '\n'
    if not pattern_of(shown).fullmatch(output):
        diff = difflib.unified_diff(shown.splitlines(), output.splitlines(), 'shown', 'printed', lineterm='', n=100)
        raise Fault('the output differs:\n' + '\n'.join(diff))


# Executes blocks that come as lines of JSON. The last line of a block's output is END and the exit status.
SESSION = r'''
import json, sys, traceback
names = {'__name__': '__main__'}
for line in sys.stdin:
    code, name = json.loads(line)
    status = 0
    try:
        exec(compile(code, name, 'exec'), names)
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stderr.flush()
    print(f'\x00END {status}', flush=True)
'''


class Session:
    """One Python process for the blocks of a page."""

    def __init__(self, python, folder, environment):
        self.process = subprocess.Popen([python, '-B', '-u', '-c', SESSION], cwd=folder, env=environment, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def run(self, code, name):
        self.process.stdin.write(json.dumps([code, name]) + '\n')
        self.process.stdin.flush()
        output = []
        for line in self.process.stdout:
            if line.startswith('\0END '):
                return ''.join(output), int(line.split()[1])
            output.append(line)
        return ''.join(output), self.process.wait()

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(timeout=60)
        finally:
            self.process.kill()
            self.process.stdout.close()


def run_shell(code, folder, environment):
    """Returns (output, exit status)."""
    shell = subprocess.Popen(['bash', '-eu', '-o', 'pipefail', '-c', code], cwd=folder, env=environment, text=True,
                             stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    try:
        output, _ = shell.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(shell.pid, signal.SIGKILL)
        shell.communicate()
        raise Fault(f'not done after {SECONDS} s:\n{code}') from None
    return output, shell.returncode


def run_server(code, folder, environment):
    """Starts a command that serves, waits for its address and interrupts it. Returns its output."""
    server = subprocess.Popen(['bash', '-eu', '-c', code], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    output, until = b'', time.monotonic() + SECONDS
    try:
        while b'http://' not in output or not output.endswith(b'\n'):
            if not select.select([server.stdout], [], [], max(0.0, until - time.monotonic()))[0]:
                raise Fault('no address was printed')
            chunk = os.read(server.stdout.fileno(), 65536)
            if not chunk:
                raise Fault('the command ended without an address:\n' + output.decode())
            output += chunk
        os.killpg(server.pid, signal.SIGINT)
        output += server.stdout.read()
        server.wait(timeout=60)
    finally:
        server.kill()
        server.wait()
        server.stdout.close()
    return output.decode()


def without_indent(lines):
    return [line.strip() for line in lines if line.strip()]


def check_excerpt(block, path):
    """Raises Fault if the excerpt differs from the file. A line `...` stands for omitted lines."""
    with open(os.path.join(ROOT, path), encoding='utf-8') as file:
        source = without_indent(file.read().splitlines())
    at = 0
    for chunk in re.split(r'(?m)^ *(?:// )?\.\.\.$', block.text):
        expected = without_indent(chunk.splitlines())
        found = next((i for i in range(at, len(source) - len(expected) + 1) if source[i:i + len(expected)] == expected), None)
        if found is None or not expected:
            raise Fault(f'the excerpt is not in {path} (from "{expected[0] if expected else ""}")')
        at = found + len(expected)


class Page:
    """One page. run() runs its blocks and returns a line with their number and the reasons for skipped ones."""

    def __init__(self, text, folder, environment, python=None):
        self.blocks, self.folder, self.environment, self.python = blocks_of(text), folder, environment, python
        self.session, self.output = None, None
        self.ran = self.compared = 0
        self.skipped, self.unavailable = [], []

    def run(self):
        try:
            for block in self.blocks:
                try:
                    self.run_block(block)
                except Fault as fault:
                    raise Fault(f'line {block.line}: {fault}') from None
        finally:
            if self.session:
                self.session.close()
        if len(self.skipped) > MOST_SKIPPED:
            raise Fault(f'{len(self.skipped)} blocks are skipped; at most {MOST_SKIPPED} may be')
        remarks = [f'skipped: {reason}' for reason in self.skipped] + sorted(set(self.unavailable))
        return f'{self.ran} blocks ran, {self.compared} outputs compared' + ''.join(f'; {reason}' for reason in remarks)

    def run_block(self, block):
        previous_output, self.output = self.output, None
        if 'skip' in block.marks:
            self.skipped.append(block.marks['skip'])
            self.output = False  # unknown
        elif 'file' in block.marks:
            path = os.path.join(self.folder, block.marks['file'])
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, 'w', encoding='utf-8') as file:
                file.write(block.text)
        elif 'excerpt' in block.marks:
            check_excerpt(block, block.marks['excerpt'])
            self.ran += 1
        elif block.language == 'text':
            if previous_output is None:
                raise Fault('output without a block before it')
            if previous_output is not False:
                compare(block.text, previous_output)
                self.compared += 1
        elif 'needs' in block.marks and not shutil.which(block.marks['needs'], path=self.environment['PATH']):
            self.unavailable.append(f"{block.marks['needs']} is not installed")
            self.output = False
        elif block.language == 'python' and not self.python:
            self.unavailable.append('the Python module is not built')
            self.output = False
        elif block.language in ('sh', 'python'):
            self.execute(block)
        else:
            raise Fault(f'a block of "{block.language}" must say how it is tested (tests/docs/pages.py)')

    def execute(self, block):
        if 'serves' in block.marks:
            self.output, status = run_server(block.text, self.folder, self.environment), 0
        elif block.language == 'sh':
            self.output, status = run_shell(block.text, self.folder, self.environment)
        else:
            self.session = self.session or Session(self.python, self.folder, self.environment)
            self.output, status = self.session.run(block.text, f'line {block.line}')
        if status != int(block.marks.get('exit', 0)):
            raise Fault(f'exit status {status}:\n{block.text}--- output:\n{self.output}')
        self.ran += 1
