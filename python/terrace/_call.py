# SPDX-License-Identifier: Apache-2.0
"""Progress, notes, threads and memory of long calls."""

from __future__ import annotations

import logging
import sys
from typing import Any, Tuple

from ._arrays import as_integer
from ._types import Progress

CallSettings = Tuple[Any, Any, int, int]  #: progress, notes, threads, memory in bytes

notes = logging.getLogger('terrace')


class _Line:
    """Shows progress on one terminal line that is overwritten."""

    def __init__(self) -> None:
        self._written = False

    def __call__(self, what: str, count: int, fraction: float, ended: bool) -> None:
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

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None
        self._what = ''

    def __call__(self, what: str, count: int, fraction: float, ended: bool) -> None:
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

    def _close(self) -> None:
        if self._bar is not None:
            self._bar.close()
        self._bar, self._what = None, ''


def _shown_progress() -> _Line | _Bars:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _Line()
    return _Bars(tqdm)


def thread_count(threads: int | None) -> int:
    """Returns a number of threads for the core, 0 for one per processor core. Raises: TypeError, ValueError."""
    return 0 if threads is None else as_integer(threads, 'threads', 1, bits=32)


def call_settings(progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> CallSettings:
    """Returns the (progress, note, threads, memory) tuple that the compiled half expects.

    progress: None, True for a bar, or a function called as progress(what, count, fraction, ended): the kind of items
        counted, their number so far, the fraction done (0 if not known), and whether this is the last call for them.

    Raises: TypeError, ValueError.
    """
    shown = _shown_progress() if progress is True else None if progress is False else progress
    if shown is not None and not callable(shown):
        raise TypeError('`progress` must be None, True or a function')
    return (shown, notes.info, thread_count(threads), 0 if memory is None else as_integer(memory, 'memory', 1))
