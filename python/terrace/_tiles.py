# SPDX-License-Identifier: Apache-2.0
"""Checks sets of tiles."""

from __future__ import annotations

import os
from typing import Any

from . import _core
from ._call import call_settings
from ._names import Vertical
from ._store import Store
from ._types import Path, Progress


def verify_tiles(folder: Path, store: Store | None = None, *, max_error: float | None = None,
                 vertical: Vertical = 'recorded', geoid: Path | None = None,
                 progress: Progress | None = None, threads: int | None = None, memory: int | None = None) -> dict[str, Any]:
    """Decodes and checks every tile of a set written by Store.tiles(): layer.json, bytes, meshes and shared sides.

    store: also compares the tiles' heights with each sample of this store.
    max_error: the bound at the deepest zoom in metres, doubled for each zoom above it; by default the bound in
        layer.json.
    vertical, geoid: the values with which the tiles were made.

    Returns: a dict with faults (a list of lines, empty if the set is sound), tiles, samples, torn (temporary files of
        a killed run, harmless) and zooms (zoom, tiles, samples, uncovered, max_error).
    Raises: terrace.Error if layer.json cannot be read; ValueError for a folder without tiles.
    """
    if store is not None and not isinstance(store, Store):
        raise TypeError(f'`store` must be a Store, not {store!r}')
    return _core.check_tiles(os.fsencode(folder), None if store is None else store._core,
                             None if max_error is None else float(max_error), vertical,
                             '' if geoid is None else os.fsencode(geoid), call_settings(progress, threads, memory))
