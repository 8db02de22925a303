#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names the commits whose messages do not follow CONTRIBUTING.md.

check_commits.py ROOT [RANGE]    prints one line per commit; exit status 1 if there is one.

RANGE defaults to the commits since this script was added.
"""

import re
import subprocess
import sys

TITLE = re.compile(r'[a-z0-9][a-z0-9_./+-]*(?:, [a-z0-9_./+-]+)*: [A-Z].*[^.\s]$|Merge |Revert "')
MOST_LETTERS = 72
# Words that begin a statement or a report instead of saying what the commit does.
NO_IMPERATIVE = re.compile(r': (?:The|A|An|It|What|Some|All|Now|Fixed|Fixes|Adds|Added|Changes|Changed|Adding|Fixing) ')


def faults_of(message):
    """Yields the faults of a commit message, in words."""
    title, _, body = message.partition('\n')
    if title.startswith(('Merge ', 'Revert ')):
        return
    if len(title) > MOST_LETTERS:
        yield f'the title has {len(title)} letters; at most {MOST_LETTERS}'
    if not TITLE.match(title) or NO_IMPERATIVE.search(title):
        yield 'the title is not "area: Imperative summary"'
    if body and not body.startswith('\n'):
        yield 'the second line is not empty'
    if not body.strip():
        yield 'has no body that says why'


def commits(root, revisions):
    """Yields (hash, message) of the commits of a range, or of those since this script was added."""
    def git(*arguments):
        return subprocess.run(['git', '-C', root, *arguments], check=True, capture_output=True, text=True).stdout
    if not revisions:
        added = git('log', '--diff-filter=A', '--format=%H', '--', 'tests/layout/check_commits.py').split()
        if not added:
            return
        revisions = f'{added[-1]}..HEAD'
    for entry in git('log', '--no-merges', '--format=%h%x01%B%x02', revisions).split('\x02'):
        if entry.strip():
            name, message = entry.strip().split('\x01', 1)
            yield name, message.strip()


def main():
    found = 0
    for name, message in commits(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else ''):
        for fault in faults_of(message):
            print(f'{name} {message.splitlines()[0]}: {fault}')
            found += 1
    print(f'{found} faults in commit messages')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
