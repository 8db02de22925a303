# SPDX-License-Identifier: Apache-2.0
"""How a job runs: its progress, notes, threads and memory."""

import logging
import sys

from ._arrays import whole

notes = logging.getLogger('terrace')


class _Line:
    """A line on a terminal that is written over."""

    def __init__(self):
        self._written = False

    def __call__(self, what, count, fraction, ended):
        if ended and not self._written:
            return
        share = f'{100 * fraction:3.0f} % ' if fraction > 0 else ''
        sys.stderr.write(f'\r{share}{count:,} {what}   ')
        if ended:
            sys.stderr.write('\n')
        sys.stderr.flush()
        self._written = not ended


class _Bars:
    """tqdm's bars, in a notebook its widgets."""

    def __init__(self, tqdm):
        self._tqdm, self._bar, self._what = tqdm, None, None

    def __call__(self, what, count, fraction, ended):
        if what != self._what:
            self._close()
            if ended:
                return
            self._bar, self._what = self._tqdm(unit=' ' + what, unit_scale=True), what
        if fraction > 0:
            self._bar.total = max(count, round(count / fraction))
        self._bar.n = count
        self._bar.refresh()
        if ended:
            self._close()

    def _close(self):
        if self._bar is not None:
            self._bar.close()
        self._bar = self._what = None


def _shown_progress():
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _Line()
    return _Bars(tqdm)


def job(progress=None, threads=None, memory=None):
    """What the compiled half takes. progress: None, True for a bar, or
    called as progress(what, count, fraction, ended): what is counted, how many so far, the share that is done
    (0: not known), and whether this is the last call of what is counted."""
    if progress is True:
        progress = _shown_progress()
    elif progress is False:
        progress = None
    if progress is not None and not callable(progress):
        raise TypeError('`progress` is None, True or a function')
    return (progress, notes.info, 0 if threads is None else whole(threads, 'threads', 1, bits=32),
            0 if memory is None else whole(memory, 'memory', 1))
