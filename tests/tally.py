#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the cases of a run of `meson test`, rather than its programs.

tally.py LOG...   reads meson-logs/testlog.json of each build. Lists skipped cases by reason, and
                  failed programs with the end of their output. The last line is
                  "N passed, N failed, N skipped". The exit status is 1 if a case failed, if none
                  passed or, with TERRACE_REQUIRE_ORACLES=1, if a case was skipped for lack of a
                  program or library that can be installed.
"""

import collections
import json
import os
import re
import sys

# Acceptable reasons to skip a case. No installation can provide hardware, privileges, the data or an
# unreachable registry. Emscripten and QGIS take half a gigabyte or more.
ACCEPTED_REASONS = re.compile(r'AVX|GPU|CUDA|nvidia|driver|privileges|sanitizer|Emscripten|QGIS|cannot be downloaded|TERRACE_DATA', re.IGNORECASE)

GTEST = re.compile(r'^\[ +(OK|FAILED|SKIPPED) +\] ([\w/.]+)(?:, where .*)? \(\d+ ms\)', re.MULTILINE)
GTEST_REASON = re.compile(r': Skipped\n(.*)\n')
UNITTEST = re.compile(r'^Ran (\d+) tests? in .*\n\n(?:OK|FAILED)(?: \((.*)\))?', re.MULTILINE)
UNITTEST_SKIP = re.compile(r"^(\w+) \([\w.]+\)(?:\n.*)? \.\.\. skipped ['\"](.*)['\"]$", re.MULTILINE)
NODE = re.compile(r'^(?:#|ℹ) (pass|fail|skipped) (\d+)$', re.MULTILINE)


class Tally:
    """Counts of passed and failed cases, and the names of skipped ones by reason."""

    def __init__(self):
        self.passed = self.failed = self.skipped = 0
        self.skipped_by_reason = collections.defaultdict(list)
        self.failures = []

    def skip(self, reason, name):
        self.skipped += 1
        self.skipped_by_reason[reason].append(name)

    def add(self, row):
        """Adds one line of testlog.json: a program and its output."""
        text = (row.get('stdout') or '') + '\n' + (row.get('stderr') or '')
        failed = self.failed
        known = self.gtest(text) or self.unittest(text, row['name']) or self.node(text, row['name'])
        kind = row['result']
        if kind == 'SKIP':
            self.skip((text.strip().splitlines() or ['no reason given'])[-1], row['name'])
        elif kind not in ('OK', 'EXPECTEDFAIL'):
            # Count the program as one case if it stopped before it named one.
            self.failed += self.failed == failed
            cases = [case[2] for case in GTEST.finditer(text) if case[1] == 'FAILED']
            self.failures.append((row['name'], kind, cases, text.strip().splitlines()[-30:]))
        elif not known:
            self.passed += 1

    # Each of the following adds the cases that one test framework reports and returns true if there are any.

    def gtest(self, text):
        at = 0
        for case in GTEST.finditer(text):
            if case[1] == 'OK':
                self.passed += 1
            elif case[1] == 'FAILED':
                self.failed += 1
            else:
                reasons = GTEST_REASON.findall(text, at, case.start())
                self.skip(reasons[-1] if reasons else 'no reason given', case[2])
            at = case.end()
        return at > 0

    def unittest(self, text, name):
        runs = UNITTEST.findall(text)
        for ran, counts in runs:
            count = collections.Counter({k: int(v) for k, v in re.findall(r'([a-z ]+)=(\d+)', counts or '')})
            failed = count['failures'] + count['errors'] + count['unexpected successes']
            failed += count[' errors'] + count[' unexpected successes']
            skipped = count['skipped'] + count[' skipped']
            self.failed += failed
            self.passed += max(0, int(ran) - failed - skipped)
            reasons = UNITTEST_SKIP.findall(text)
            for case, reason in reasons:
                self.skip(reason, case)
            for _ in range(skipped - len(reasons)):
                self.skip('no reason given', name)
        return bool(runs)

    def node(self, text, name):
        count = {kind: int(number) for kind, number in NODE.findall(text)}
        self.passed += count.get('pass', 0)
        self.failed += count.get('fail', 0)
        for _ in range(count.get('skipped', 0)):
            self.skip('no reason given', name)
        return bool(count)


def main(logs):
    tally = Tally()
    for log in logs:
        with open(log, encoding='utf-8') as file:
            for line in file:
                tally.add(json.loads(line))
    missing = 0
    for reason, names in sorted(tally.skipped_by_reason.items()):
        listed = ', '.join(names[:4]) + (f' and {len(names) - 4} more' if len(names) > 4 else '')
        print(f'left out: {len(names)}: {reason} ({listed})')
        missing += 0 if ACCEPTED_REASONS.search(reason) else len(names)
    for name, kind, cases, lines in tally.failures:
        print(f'{kind}: {name}', *cases)
        print(*('    ' + line for line in lines), sep='\n')
    required = os.environ.get('TERRACE_REQUIRE_ORACLES') == '1'
    if required and missing:
        print(f'TERRACE_REQUIRE_ORACLES=1, but {missing} cases lack packages that ./dev oracles installs')
    print(f'{tally.passed} passed, {tally.failed} failed, {tally.skipped} skipped')
    return tally.failed != 0 or tally.passed == 0 or (required and missing != 0)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
