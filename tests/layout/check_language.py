#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds words and patterns that make prose hard to read: in comments, string literals, docstrings and Markdown.

check_language.py ROOT [PATH ...]    prints one line per hit; exit status 1 if there is one.

Without PATHs it checks the whole tree. A correct use of a listed word goes into language_allowed.txt,
one per line: the file, a tab, and words of the line that contain it. CONTRIBUTING.md says how the project writes.
"""

import io
import os
import re
import sys
import tokenize

ROOMS = ['libbase', 'libstream', 'libcluster', 'libmatching', 'libtri', 'libterrain', 'python', 'tools', 'viewer', 'research', 'tests', 'cmake', 'docs', '.ci/run', 'dev',
         'meson.build', 'meson_options.txt', 'README.md', 'ARCHITECTURE.md', 'CONTRIBUTING.md', 'CHANGELOG.md', 'SECURITY.md']

# Patterns to avoid, and better words. Patterns of words with correct uses exclude these by the words that follow.
PATTERNS = [
    (r'(?<!there )\b(?:is|are|was|were) no\b(?! (?:longer|more|less|fewer|better|worse|larger|smaller|later|earlier|further|farther|nearer|wider|narrower|higher|lower|deeper|finer|coarser|shorter|longer|greater|tighter)\b)',
     'is not a ..., has no ...'),
    (r'(?:^|[.;]\s+)What (?:is|was|are|were|has|have|had|comes|came|lies|stands|follows|goes|a|an|the|it|they|of)\b(?![^.]*\?)',
     'name the thing: The leftovers of ...'),
    (r'\b(?:stand|stands|stood|standing)\b(?!-alone|-ins?\b| alone| out\b| for\b| in for\b)', 'is, are, exists'),
    (r'\b(?:lie|lies|lay|lying)\b(?! (?:exactly )?(?:on|in|inside|outside|within|between|above|below|beyond|strictly|left|right|to the|at)\b)', 'is, are'),
    (r'\bbeside\b', 'next to, alongside, besides'),
    (r'\bso (?:many|much)\b(?!(?:\W+\w+){0,9}?\W+(?:that|as)\b)', 'that many, N'),
    (r'\b(?:tells|is told|are told|was told|be told|told by)\b', 'reports, is given by, determined from'),
    (r'\banew\b', 'again, re-...'),
    (r'(?<!nothing )\bbehind\b', 'after'),
    (r'\bbut for\b', 'except for'),
    (r'\b(?:fit|fits|fitting) to\b', 'match'),
    (r'\bgo(?:es)? before\b', 'overrides, takes precedence over'),
    (r'\b(?:whoever|whosoever|nobody)\b', 'the caller, no one, nothing'),
    (r'\bas many as there are\b|\bwhat there is\b|\bthose there are\b|\bthat there (?:is|are)(?=[.,;)]|$)', 'all of them, the available ...'),
    (r'\b(?:is|are|was|were) to be\b', 'must be'),
    (r'\bof (?:its|their|his) own\b(?=[.,;:)]|$| (?:and|that|which|to|in|for|by|with|each|is|are|was|when|where|if|as)\b)', 'its own, separate'),
    (r'\babove 0\b', 'positive'),
    (r'^Lets\b', 'Sets X to Y'),
    (r'\b(?:is|are|be) there\b(?! (?:a|an|any)\b)', 'exists'),
    (r'\b(?:thereof|therein|whereof|wherein|whereupon|hereby|herein)\b', 'of it, in it, by this'),
    (r'\b(?:in silence|without a word)\b', 'silently'),
    (r'\bfor ever\b', 'forever'),
    (r'\b(?:goes|go) on\b(?! \w+ing\b)', 'continues'),
    (r'\bas good as\b(?! (?:with|if|the|those|that|any|in|when)\b)', 'nearly, almost'),
    (r'\b(?:of no use|is of use|are of use)\b', 'is not useful, helps'),
    (r'\b(?:come|comes|came) out of\b', 'is the result of, is thrown by'),
    (r'\bno (?:\w+ )?that (?:is|are) (?:none|no)\b|(?<!there )\b(?:is|are) (?-i:none)\b', 'is not one, there is none'),
    (r'\bones? of (?:one|two|three) kinds?\b|\bsuch as are\b', 'name the kinds'),
]
COMPILED = [(re.compile(pattern, re.IGNORECASE if not pattern.startswith('^Lets') else 0), advice)
            for pattern, advice in PATTERNS]

CPP = ('.cpp', '.hpp', '.h', '.cu', '.cuh', '.ts', '.js', '.mjs', '.in')
HASH = ('.build', '.sh', '.txt', 'dev', 'run', 'Makefile')
SKIPPED = re.compile(r'(^|/)(LICENSE|dist|node_modules|corpus|package-lock\.json|language_allowed\.txt|check_language(_test)?\.py)(/|$)|\.(golden|json|csv|xml|prj)$')
TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)\'|`(?:[^`\\]|\\.)*`', re.DOTALL)


def lines_of_cpp(text, script):
    """Yields (line number, prose) of comments and strings. Joins the lines of a comment."""
    joined, start, last = '', 0, -1
    for match in TOKEN.finditer(text):
        token, number = match.group(0), text.count('\n', 0, match.start()) + 1
        if token[0] == "'" or (token[0] == '`' and not script):
            continue
        if token.startswith('//'):
            words = token.lstrip('/').lstrip('<').strip()
            if number == last + 1 and joined:
                joined, last = joined + ' ' + words, number
                continue
            if joined:
                yield start, joined
            joined, start, last = words, number, number
        else:
            if joined:
                yield start, joined
                joined, last = '', -1
            yield number, re.sub(r'\s*\n\s*\*?\s*', ' ', token.strip('"`/* '))
    if joined:
        yield start, joined


def lines_of_python(text):
    """Yields (line number, prose) of comments and strings. Joins the lines of a comment."""
    joined, start, last = '', 0, -1
    try:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                words = token.string.lstrip('# ')
                if token.start[0] == last + 1 and joined:
                    joined, last = joined + ' ' + words, token.start[0]
                    continue
                if joined:
                    yield start, joined
                joined, start, last = words, token.start[0], token.start[0]
            elif token.type == tokenize.STRING:
                yield token.start[0], re.sub(r'\s+', ' ', token.string.strip('"\' rbf'))
    except (tokenize.TokenError, IndentationError):
        pass
    if joined:
        yield start, joined


def lines_of_paragraphs(text, comment):
    """Yields (line number, prose) of the paragraphs of Markdown or, if `comment` is true, of comments after a hash."""
    joined, start, fenced = '', 0, False
    for number, line in enumerate(text.split('\n') + [''], 1):
        if comment:
            match = re.match(r'\s*#(?!!)\s?(.*)', line)
            words = match.group(1).strip() if match else ''
        else:
            if line.startswith('```'):
                fenced = not fenced
            words = '' if fenced or line.startswith('```') else re.sub(r'`[^`]*`', 'X', line).strip()
        begins = re.match(r'[-*|#]|\d+\.', words) and not comment
        if (not words or begins) and joined:
            yield start, joined
            joined = ''
        if words:
            words = re.sub(r'^[-*#|]+\s*', '', words)
            joined, start = (joined + ' ' + words, start) if joined else (words, number)


def prose_of(path, text):
    if path.endswith(CPP):
        return lines_of_cpp(text, path.endswith(('.ts', '.js', '.mjs')))
    if path.endswith('.py') or path.endswith('.pyi'):
        return lines_of_python(text)
    if path.endswith('.md'):
        return lines_of_paragraphs(text, False)
    if path.endswith(HASH):
        return lines_of_paragraphs(text, True)
    return []


def files_of(root, path):
    full = os.path.join(root, path)
    if os.path.isfile(full):
        yield path
        return
    for folder, folders, names in os.walk(full):
        folders[:] = sorted(f for f in folders if not f.startswith('.') and f not in ('__pycache__', 'subprojects')
                            and not re.match('build(-|$)', f if folder == root else ''))
        for name in sorted(names):
            yield os.path.relpath(os.path.join(folder, name), root)


def allowed_uses(root):
    uses = {}
    with open(os.path.join(root, 'tests', 'layout', 'language_allowed.txt'), encoding='utf-8') as file:
        for line in file:
            if line.strip() and not line.startswith('#'):
                path, words = line.rstrip('\n').split('\t')
                uses.setdefault(path, []).append(words)
    return uses


def hits(root, paths, uses, used=None):
    """Yields a line per hit that is not in `uses`, {path: [words]}. Adds the uses that occur to the set `used`."""
    for path in (p for room in paths for p in files_of(root, room)):
        if SKIPPED.search(path) or os.path.islink(os.path.join(root, path)):
            continue
        try:
            with open(os.path.join(root, path), encoding='utf-8') as file:
                text = file.read()
        except UnicodeDecodeError:
            continue
        for number, prose in prose_of(path, text):
            for pattern, advice in COMPILED:
                for match in pattern.finditer(prose):
                    around = prose[max(0, match.start() - 60):match.end() + 60]
                    allowed = [words for words in uses.get(path, []) if words in around]
                    if allowed:
                        if used is not None:
                            used.update((path, words) for words in allowed)
                        continue
                    yield f'{path}:{number}: "{match.group(0).strip(" .;:")}" in "...{around}..."; write: {advice}'


def main():
    root, paths = sys.argv[1], sys.argv[2:]
    uses, used = allowed_uses(root), set()
    found = list(hits(root, paths or ROOMS, uses, used))
    if not paths:
        found += [f'language_allowed.txt: {path}: "{words}" is not used; delete the line'
                  for path, all_words in uses.items() for words in all_words if (path, words) not in used]
    for hit in found:
        print(hit)
    print(f'{len(found)} hits of the language check')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
