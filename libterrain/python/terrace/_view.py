# SPDX-License-Identifier: Apache-2.0
"""Live views: a camera in, changes of the mesh out."""

from dataclasses import dataclass

import numpy as np

from . import _core
from ._arrays import as_numbers, whole
from ._store import Store


@dataclass(frozen=True)
class ViewDelta:
    """What came and went since the last frame. Apply removals first: a reused number is on both sides.

    Numbers of vertices and triangles are int32, small, and stay the same as long as the thing is there.
    """

    added_vertices: np.ndarray  #: shape (n,)
    added_positions: np.ndarray  #: shape (n, 3), metres east, north and up from the middle of the store
    removed_vertices: np.ndarray
    moved_vertices: np.ndarray  #: stand for another point now
    moved_positions: np.ndarray
    added_triangles: np.ndarray  #: shape (m,)
    added_corners: np.ndarray  #: shape (m, 3), numbers of vertices, counter-clockwise
    removed_triangles: np.ndarray
    expanded: int  #: clusters
    collapsed: int
    missing: int  #: clusters that are wanted and not read yet
    pending: int  #: read, but the time was up
    points: int  #: that there are now
    settled: bool  #: another frame with the same camera would change nothing

    def __repr__(self):
        return (f'<terrace.ViewDelta: {len(self.added_triangles)} triangles came, {len(self.removed_triangles)} went, '
                f'{self.points} points{", settled" if self.settled else ""}>')


class View:
    """A store under a camera: finer where it looks, coarser where it has been, under budgets of time and memory.

    Frames are in metres east, north and up, with the origin above the middle of the store at height 0. The first
    frame's delta has all that there is.

    kind: 'mesh', or 'points' for a cloud without triangles. reader: 'thread' reads ahead while frames go on, 'frame'
    within the frames' time. max_points: the most points at a time.

    Threads may share a view, one works on it at a time. After a fork it is of no use: ValueError.

    Source: J. Skala, Algorithms for manipulating large geometric data, section 8.4.
    """

    def __init__(self, store, kind='mesh', *, reader='thread', max_points=1 << 22):
        if not isinstance(store, Store):
            raise TypeError(f'a view is of a terrace.Store, not of {type(store).__name__}')
        if not isinstance(kind, str) or kind not in ('mesh', 'points'):
            raise ValueError(f'`kind` is one of mesh, points, not {kind!r}')
        if not isinstance(reader, str) or reader not in ('thread', 'frame'):
            raise ValueError(f'`reader` is one of thread, frame, not {reader!r}')
        self._core = _core.SharedView(store._core, kind == 'points', reader == 'frame', whole(max_points, 'max_points'))
        self._first = True
        self._points = 0

    def frame(self, position=None, direction=(0.0, 1.0, -0.5), up=(0.0, 0.0, 1.0), *, fov=60.0, size=(1920, 1080),
              matrix=None, pixel_error=2.0, ground_error=float('inf'), seconds=0.01):
        """Brings the mesh nearer to what a camera asks for, in about ``seconds`` at most.

        position, direction, up: of the eye, three numbers each. fov: degrees from bottom to top. size: of the picture in
        pixels, width and height. matrix: in place of these, shape (4, 4), from metres to clip coordinates, row-major.
        pixel_error: the most that an error may measure in the picture. ground_error: metres, everywhere.

        Returns: a ViewDelta. Raises: Error if a cluster is damaged.
        """
        width, height = size
        if not (width > 0 and height > 0):
            raise ValueError('`size` is the width and height of a picture in pixels')
        position, direction, up, matrix = (
            None if given is None else as_numbers(given, what) for what, given in
            (('position', position), ('direction', direction), ('up', up), ('matrix', matrix)))
        if direction is None or up is None:
            raise TypeError('`direction` and `up` are three numbers each')
        delta = self._core.frame(
            {'position': position, 'direction': direction, 'up': up, 'fov': fov, 'width': width, 'height': height,
             'matrix': matrix, 'pixel_error': pixel_error, 'ground_error': ground_error}, float(seconds))
        if self._first:
            whole_mesh = self._core.whole()
            for name in ('expanded', 'collapsed', 'missing', 'pending'):
                whole_mesh[name] = delta[name]
            delta, self._first = whole_mesh, False
        self._points = delta['points']
        return ViewDelta(**delta)

    def snapshot(self):
        """All that there is now, as a ViewDelta that adds it."""
        return ViewDelta(**self._core.whole())

    @property
    def traffic(self):
        """What has been read so far: a dict of clusters, points and bytes."""
        return dict(zip(('clusters', 'points', 'bytes'), self._core.traffic()))

    def __repr__(self):
        return f'<terrace.View: {self._points} points>'
