# SPDX-License-Identifier: Apache-2.0
"""Stores shared by several tests."""

import os
import shutil
import struct
import tempfile
import unittest
import zlib

import numpy as np

import terrace

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..'))
ALPS = os.path.join(ROOT, 'libterrain', 'examples', 'alps.tif')
COMMAND = os.environ.get('TERRACE_BIN')
TRANSFORM = (10, 0, 500000, 0, -10, 5000000)  # corners of cells, UTM zone 32


def hills(rows=120, columns=150):
    """Returns samples of a smooth function at the positions of cell_centres()."""
    y, x = np.mgrid[0:rows, 0:columns]
    return 400 + 60 * np.sin(x / 11) * np.cos(y / 13) + 0.2 * x


def cell_centres(rows, columns):
    a, _, c, _, e, f = TRANSFORM
    y, x = np.mgrid[0:rows, 0:columns]
    return np.stack((c + a * (x + 0.5), f + e * (y + 0.5)), axis=-1)


def cloud(count=20000, seed=1):
    """Returns points on the graph of a function, (x, y, z), and their classes."""
    random = np.random.default_rng(seed)
    xy = random.random((count, 2)) * [1000, 800] + [300000, 5200000]
    z = 50 + 10 * np.sin(xy[:, 0] / 90) + (xy[:, 1] - 5200000) / 40
    return np.column_stack((xy, z)), (np.arange(count) % 7).astype(np.uint8)


def pixels_of(png):
    """Returns the grey pixels of a PNG without interlacing or filters, shape (rows, columns)."""
    columns, rows = struct.unpack('>II', png[16:24])
    data, at = b'', 8
    while at < len(png):
        size, kind = struct.unpack('>I4s', png[at:at + 8])
        data += png[at + 8:at + 8 + size] if kind == b'IDAT' else b''
        at += size + 12
    lines = np.frombuffer(zlib.decompress(data), np.uint8).reshape(rows, -1)
    assert lines.shape[1] == columns + 1 and not lines[:, 0].any()
    return lines[:, 1:].astype(int)


class StoreCase(unittest.TestCase):
    """Base class with a folder, a store of hills() and a store of cloud(), both in UTM zone 32."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='terrace-python-')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.samples = hills()
        cls.raster = terrace.build(cls.samples, cls.path('hills'), transform=TRANSFORM, crs='EPSG:32632')
        cls.points, cls.classes = cloud()
        cls.scan = terrace.build(cls.points, cls.path('cloud'), crs='EPSG:32632', attributes={'class': cls.classes},
                                 block_points=2000)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)


def sorted_rows(array):
    return array[np.lexsort(array.T[::-1])]
