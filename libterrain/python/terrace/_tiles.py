# SPDX-License-Identifier: Apache-2.0
"""Sets of tiles."""

import os

from . import _core
from ._job import job
from ._store import Store


def verify_tiles(folder, store=None, *, max_error=None, vertical='recorded', geoid=None, progress=None, threads=None,
                 memory=None):
    """Decodes and checks every tile of a set that Store.tiles() wrote: layer.json, bytes, meshes, shared sides, and
    with ``store`` the heights against each of its samples.

    max_error: the bound at the deepest zoom, metres, twice as much at each above; by default what layer.json states. vertical,
    geoid: as the tiles were made with. Returns: a dict: faults (a list of lines, empty if the set is sound), tiles, samples,
    torn (temporary files of a killed run, harmless), zooms (zoom, tiles, samples, uncovered, max_error). Raises:
    terrace.Error if layer.json cannot be read; ValueError for a folder without tiles."""
    if store is not None and not isinstance(store, Store):
        raise TypeError(f'`store` is a Store, not {store!r}')
    return _core.check_tiles(os.fsencode(folder), None if store is None else store._core,
                             None if max_error is None else float(max_error), vertical,
                             '' if geoid is None else os.fsencode(geoid), job(progress, threads, memory))
