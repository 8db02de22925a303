# SPDX-License-Identifier: Apache-2.0
"""Pictures for notebooks, of numpy and zlib alone."""

import struct
import zlib

import numpy as np

MOST_PIXELS = 600
MOST_TRIANGLES = 20000


def png(pixels):
    """A PNG of bytes, shape (rows, columns) or (rows, columns, 3)."""
    pixels = np.ascontiguousarray(pixels, dtype=np.uint8)
    rows, columns = pixels.shape[:2]
    lines = np.zeros((rows, 1 + pixels[0].size), np.uint8)
    lines[:, 1:] = pixels.reshape(rows, -1)

    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))

    head = struct.pack('>IIBBBBB', columns, rows, 8, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', head) + chunk(b'IDAT', zlib.compress(lines.tobytes(), 6)) +
            chunk(b'IEND', b''))


def grey_png(values):
    """The values from dark to light, white where there are none; a large raster is thinned."""
    step = max(1, -(-max(values.shape) // MOST_PIXELS))
    shown = np.asarray(values[::step, ::step], dtype=np.float64)
    some = np.isfinite(shown)
    if not some.any():
        return png(np.full(shown.shape, 255))
    low, high = np.percentile(shown[some], [1, 99])
    scaled = np.full(shown.shape, 255.0)
    scaled[some] = np.clip((shown[some] - low) / (high - low if high > low else 1) * 230, 0, 230)
    return png(scaled)


def triangles_svg(xy, triangles, shade=None, most=MOST_TRIANGLES):
    """Triangles seen from above; shade: from 0 to 1, one per triangle. If there are more than `most`, only some of them."""
    step = max(1, -(-len(triangles) // most))
    corners = xy[triangles[::step]]
    tones = np.full(len(corners), 210) if shade is None else np.clip(60 + 190 * shade[::step], 0, 255)
    return _svg(corners, [f'<polygon fill="rgb({tone},{tone},{tone})"' for tone in tones.astype(int)])


def lines_svg(lines):
    """Lines seen from above."""
    return _svg([np.asarray(line)[:, :2] for line in lines], ['<polyline fill="none"'] * len(lines))


def _svg(parts, begins):
    """parts: places, shape (n, 2) each, of an element each. begins: how that begins."""
    places = np.concatenate(parts) if len(parts) else np.zeros((1, 2))
    low, size = np.nanmin(places, axis=0), np.ptp(places, axis=0)
    scale = MOST_PIXELS / max(*size, 1e-300)
    rows = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{max(size[0] * scale, 1):.0f}" height="{max(size[1] * scale, 1):.0f}" '
            'stroke="#345" stroke-width="0.3" stroke-linejoin="round">']
    for begin, part in zip(begins, parts):
        path = ' '.join(f'{x:.1f},{y:.1f}' for x, y in (part - low) * (scale, -scale) + (0, size[1] * scale))
        rows.append(f'{begin} points="{path}"/>')
    return '\n'.join(rows) + '\n</svg>'


def light(vertices, triangles):
    """How bright each triangle is under a light from the north-west, 0 to 1."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals[normals[:, 2] < 0] *= -1
    lengths = np.linalg.norm(normals, axis=1)
    lengths[lengths == 0] = 1
    return np.clip((normals @ np.array([-0.5, 0.5, 0.7071])) / lengths, 0, 1)
