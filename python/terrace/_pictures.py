# SPDX-License-Identifier: Apache-2.0
"""Pictures for notebooks, made with numpy and zlib only."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from ._types import AnyArray, Float64Array, Int64Array

MOST_PIXELS = 600  #: length of the longer side, so a picture has at most 360 KB
MOST_SPANS = 8_000_000  #: pixel rows in triangles, and a quarter of the pixels in them; a picture with more is made smaller
MOST_FRAGMENTS = 1_000_000  #: pixels of triangles processed at a time
MOST_WIRES = 3000  #: sides are drawn up to this number of triangles
_SIDES = [[0, 1], [1, 2], [2, 0]]


def png(pixels: AnyArray) -> bytes:
    """Encodes bytes, shape (rows, columns) or (rows, columns, 3), as a PNG."""
    pixels = np.ascontiguousarray(pixels, dtype=np.uint8)
    rows, columns = pixels.shape[:2]
    lines = np.zeros((rows, 1 + pixels[0].size), np.uint8)
    lines[:, 1:] = pixels.reshape(rows, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))

    head = struct.pack('>IIBBBBB', columns, rows, 8, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', head) + chunk(b'IDAT', zlib.compress(lines.tobytes(), 6)) +
            chunk(b'IEND', b''))


def grey_png(values: AnyArray) -> bytes:
    """Draws values from dark to light, white where they are not finite. Large rasters are thinned."""
    step = max(1, -(-max(values.shape) // MOST_PIXELS))
    shown = np.asarray(values[::step, ::step], dtype=np.float64)
    some = np.isfinite(shown)
    if not some.any():
        return png(np.full(shown.shape, 255))
    low, high = np.percentile(shown[some], [1, 99])
    scaled = np.full(shown.shape, 255.0)
    scaled[some] = np.clip((shown[some] - low) / (high - low if high > low else 1) * 230, 0, 230)
    return png(scaled)


class _Frame:
    """Maps places, shape (n, 2), with y upwards, to the pixels of a picture."""

    def __init__(self, places: Float64Array, most: int = MOST_PIXELS) -> None:
        self.low = places.min(axis=0) if len(places) else np.zeros(2)
        size = places.max(axis=0) - self.low if len(places) else np.zeros(2)
        self.scale = most / max(*size, 1e-300) if max(size) > 0 else 1.0
        self.columns, self.rows = (min(max(1, math.ceil(side * self.scale)), most) for side in size)

    def __call__(self, places: Float64Array) -> Float64Array:
        """Returns columns and rows of places, in pixels from the upper left corner."""
        return np.column_stack(((places[:, 0] - self.low[0]) * self.scale, self.rows - (places[:, 1] - self.low[1]) * self.scale))


def _shown(places: Float64Array, parts: Int64Array) -> Int64Array:
    """Returns the rows of ``parts``, shape (n, k), whose places are all small enough to compute pixels."""
    with np.errstate(invalid='ignore'):
        good = (np.abs(places) < 1e150).all(axis=1)
    return parts[good[parts].all(axis=1)]


def _spans(corners: Float64Array) -> tuple[Int64Array, Int64Array]:
    """Returns, for each triangle, the first pixel row whose centre line it crosses and the number of such rows."""
    first = np.ceil(corners[:, :, 1].min(axis=1) - 0.5)
    return first.astype(np.int64), np.maximum(np.floor(corners[:, :, 1].max(axis=1) - 0.5) - first + 1, 0).astype(np.int64)


@np.errstate(over='ignore', invalid='ignore', divide='ignore')
def _depths(corners: Float64Array, heights: Float64Array, shape: tuple[int, int]) -> Float64Array:
    """Returns the greatest height of the triangles at each pixel's centre, -inf outside all triangles.

    corners: in pixels, shape (n, 3, 2).
    heights: shape (n, 3).
    """
    deep = np.full(shape[0] * shape[1], -np.inf)
    (x0, y0), (x1, y1), (x2, y2) = (corners[:, i].T for i in range(3))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    corners, heights, area = corners[area != 0], heights[area != 0], area[area != 0]
    (x0, y0), (x1, y1), (x2, y2) = (corners[:, i].T for i in range(3))
    z0, z1, z2 = heights.T
    # Slopes of each triangle's plane.
    along_x = ((z1 - z0) * (y2 - y0) - (z2 - z0) * (y1 - y0)) / area
    along_y = ((z2 - z0) * (x1 - x0) - (z1 - z0) * (x2 - x0)) / area
    first, count = _spans(corners)

    def fill(triangle: Int64Array, row: Int64Array) -> None:
        middle = row + 0.5
        left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            a, b = corners[triangle, i], corners[triangle, j]
            crosses = (a[:, 1] <= middle) != (b[:, 1] <= middle)
            x = a[:, 0] + (middle - a[:, 1]) * ((b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]))
            left = np.where(crosses, np.minimum(left, x), left)
            right = np.where(crosses, np.maximum(right, x), right)
        # Widened slightly, so that triangles that share a side leave no gap.
        begin = np.ceil(np.clip(left, 0, shape[1]) - 0.5 - 1e-9).clip(0)
        wide = (np.floor(np.clip(right, 0, shape[1]) - 0.5 + 1e-9).clip(None, shape[1] - 1) - begin + 1).clip(0)
        wide = np.where((right >= left) & (row >= 0) & (row < shape[0]), wide, 0).astype(np.int64)
        if wide.sum() > MOST_FRAGMENTS and len(row) > 1:
            half = len(row) // 2
            fill(triangle[:half], row[:half])
            fill(triangle[half:], row[half:])
            return
        of, at = _counted(wide)
        column = begin[of].astype(np.int64) + at
        own = triangle[of]
        z = z0[own] + along_x[own] * (column + 0.5 - x0[own]) + along_y[own] * (middle[of] - y0[own])
        np.maximum.at(deep, row[of] * shape[1] + column, z)

    ends = np.cumsum(count)
    begin = 0
    while begin < len(count):
        end = max(begin + 1, int(np.searchsorted(ends, (ends[begin - 1] if begin else 0) + MOST_FRAGMENTS)))
        of, at = _counted(count[begin:end])
        if len(of):
            fill(of + begin, first[begin:end][of] + at)
        begin = end
    return deep.reshape(shape)


def _counted(counts: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Returns the indices 0, 1, ..., each repeated by its count, and the position of each entry within its run."""
    of = np.repeat(np.arange(len(counts)), counts)
    return of, np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)


def _draw_lines(ends: Float64Array, shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    """Returns a bool array of ``shape`` that marks the pixels under lines.

    ends: in pixels, shape (n, 2, 2).
    """
    drawn = np.zeros(shape, bool)
    steps = np.minimum(np.ceil(np.abs(ends[:, 1] - ends[:, 0]).max(axis=1)), 2 * MOST_PIXELS).astype(np.int64) + 1
    for begin in range(0, len(ends), 2000):
        some, count = ends[begin:begin + 2000], steps[begin:begin + 2000]
        of, at = _counted(count)
        share = (at / np.maximum(count - 1, 1)[of])[:, None]
        places = (some[of, 0] * (1 - share) + some[of, 1] * share).astype(np.int64)
        drawn[places[:, 1].clip(0, shape[0] - 1), places[:, 0].clip(0, shape[1] - 1)] = True
    return drawn


def _slopes(heights: Float64Array, axis: int) -> Float64Array:
    """Returns the slope along an axis from the neighbours on both sides or on one; 0 without neighbours."""
    ahead = np.full(heights.shape, np.nan)
    behind = ahead.copy()
    steps = np.diff(heights, axis=axis)
    to = [slice(None)] * 2
    to[axis] = slice(None, -1)
    ahead[tuple(to)] = steps
    to[axis] = slice(1, None)
    behind[tuple(to)] = steps
    known = np.isfinite(ahead).astype(float) + np.isfinite(behind)
    return (np.nan_to_num(ahead) + np.nan_to_num(behind)) / np.maximum(known, 1)


@np.errstate(over='ignore', invalid='ignore')
def relief_png(vertices: Float64Array, triangles: AnyArray) -> bytes:
    """Draws triangles from above as shaded relief, lit from the north-west at 45 degrees.

    The sides of triangles are drawn if there are few.

    vertices: shape (n, 3), with the same unit on all axes. The picture is white outside the triangles.
    """
    vertices = np.asarray(vertices, np.float64)
    triangles = _shown(vertices, np.asarray(triangles).astype(np.int64).reshape(-1, 3))
    vertices = vertices[triangles].reshape(-1, 3)
    for halvings in range(7):
        frame = _Frame(vertices[:, :2], MOST_PIXELS >> halvings)
        corners = frame(vertices[:, :2]).reshape(-1, 3, 2)
        pixels = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum() / 2
        if _spans(corners)[1].sum() <= MOST_SPANS and pixels <= 4 * MOST_SPANS:
            break
    heights = vertices[:, 2].reshape(-1, 3) * frame.scale  # in pixels
    deep = _depths(corners, heights, (frame.rows, frame.columns))
    shown = np.isfinite(deep)
    deep[~shown] = np.nan
    east, south = _slopes(deep, 1), _slopes(deep, 0)
    light_ = (0.5 * east + 0.5 * south + 0.7071) / np.sqrt(east * east + south * south + 1)
    tones = 30 + 215 * light_.clip(0, 1)
    if 0 < len(triangles) <= MOST_WIRES:
        tones[_draw_lines(corners[:, _SIDES].reshape(-1, 2, 2), deep.shape)] *= 0.75
    return png(np.where(shown, tones, 255))


def plane_png(points: Float64Array, triangles: AnyArray) -> bytes:
    """Draws the sides of triangles in the plane or, if these would touch, the density of vertices (darker is denser).
    """
    triangles = _shown(points, triangles.astype(np.int64))
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    frame = _Frame(points[used])
    pixels = frame(points[used])
    shape = (frame.rows, frame.columns)
    if len(triangles) * 30 <= frame.rows * frame.columns:
        inside = np.isfinite(_depths(pixels[triangles], np.zeros((len(triangles), 3)), shape))
        tones = np.where(inside, 225.0, 255.0)
        tones[_draw_lines(pixels[triangles][:, _SIDES].reshape(-1, 2, 2), shape)] = 60
        return png(tones)
    pixels = pixels.astype(np.int64)
    counts = np.zeros(shape)
    np.add.at(counts, (pixels[:, 1].clip(0, shape[0] - 1), pixels[:, 0].clip(0, shape[1] - 1)), 1)
    return png(np.where(counts > 0, 225 - 165 * np.log1p(counts) / np.log1p(counts.max(initial=1)), 240))


def lines_png(lines: Iterable[Float64Array]) -> bytes:
    """Draws lines from above. lines: arrays of shape (n, 2)."""
    sides = [np.stack((line[:-1], line[1:]), axis=1) for line in lines if len(line) > 1]
    ends = np.concatenate(sides).reshape(-1, 2) if sides else np.zeros((0, 2))
    frame = _Frame(ends)
    drawn = _draw_lines(frame(ends).reshape(-1, 2, 2), (frame.rows, frame.columns))
    return png(np.where(drawn, 60, 255))


def triangles_svg(xy: Float64Array, triangles: AnyArray, shade: Float64Array) -> str:
    """Draws all triangles from above. shade: from 0 to 1, one per triangle."""
    tones = np.clip(60 + 190 * shade, 0, 255).astype(int)
    places = xy if len(xy) else np.zeros((1, 2))
    low, size = np.nanmin(places, axis=0), np.ptp(places, axis=0)
    scale = MOST_PIXELS / max(*size, 1e-300)
    rows = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{max(size[0] * scale, 1):.0f}" height="{max(size[1] * scale, 1):.0f}" '
            'stroke="#345" stroke-width="0.3" stroke-linejoin="round">']
    for tone, corners in zip(tones, xy[triangles]):
        path = ' '.join(f'{x:.1f},{y:.1f}' for x, y in (corners - low) * (scale, -scale) + (0, size[1] * scale))
        rows.append(f'<polygon fill="rgb({tone},{tone},{tone})" points="{path}"/>')
    return '\n'.join(rows) + '\n</svg>'


def light(vertices: Float64Array, triangles: AnyArray) -> Float64Array:
    """Returns the brightness of each triangle, 0 to 1, under a light from the north-west."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals[normals[:, 2] < 0] *= -1
    lengths = np.linalg.norm(normals, axis=1)
    lengths[lengths == 0] = 1
    return np.clip((normals @ np.array([-0.5, 0.5, 0.7071])) / lengths, 0, 1)
