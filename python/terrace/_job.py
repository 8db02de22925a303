# SPDX-License-Identifier: Apache-2.0
"""Progress, notes, threads and memory of long calls."""

import logging
import sys

from ._arrays import as_integer

notes = logging.getLogger('terrace')


class _Line:
    """Shows progress on one terminal line that is overwritten."""

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
    """Shows progress with tqdm, which uses widgets in a notebook."""

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
    """Returns the (progress, note, threads, memory) tuple that the compiled half expects.

    progress: None, True for a bar, or a function called as progress(what, count, fraction, ended): the kind of items
        counted, their number so far, the fraction done (0 if not known), and whether this is the last call for them.

    Raises: TypeError, ValueError.
    """
    if progress is True:
        progress = _shown_progress()
    elif progress is False:
        progress = None
    if progress is not None and not callable(progress):
        raise TypeError('`progress` must be None, True or a function')
    return (progress, notes.info, 0 if threads is None else as_integer(threads, 'threads', 1, bits=32),
            0 if memory is None else as_integer(memory, 'memory', 1))
