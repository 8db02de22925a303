# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and checks quantized-mesh tiles, independently of terrace's code."""

import gzip
import itertools
import json
import math
import os
import struct

UNITS = 32767
A, B = 6378137.0, 6356752.3142451793


def box_of(zoom, x, y):
    """Returns west, south, east and north of a tile in degrees."""
    width = 180 / 2 ** zoom
    return -180 + x * width, -90 + y * width, -180 + (x + 1) * width, -90 + (y + 1) * width


def geocentric(lon, lat, height):
    lon, lat = math.radians(lon), math.radians(lat)
    ratio = (B / A) ** 2
    n = A / math.sqrt(1 - (1 - ratio) * math.sin(lat) ** 2)
    return ((n + height) * math.cos(lat) * math.cos(lon),
            (n + height) * math.cos(lat) * math.sin(lon), (ratio * n + height) * math.sin(lat))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def zigzag(codes):
    return itertools.accumulate((code >> 1) ^ -(code & 1) for code in codes)


def sign(value):
    return -1.0 if value < 0 else 1.0


def oct_decode(a, b):
    x, y = a / 255 * 2 - 1, b / 255 * 2 - 1
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = (1 - abs(y)) * sign(x), (1 - abs(x)) * sign(y)
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


class Tile:
    """A tile: the fields of the format, with decoded vertices and triangles."""

    def __init__(self, data, zoom, x, y):
        self.zoom, self.x, self.y = zoom, x, y
        if data[:3] == b'\x1f\x8b\x08':
            data = gzip.decompress(data)
        self.data = data
        self.centre = struct.unpack_from('<3d', data, 0)
        self.low, self.high = struct.unpack_from('<2f', data, 24)
        self.sphere = struct.unpack_from('<3d', data, 32)
        self.radius, = struct.unpack_from('<d', data, 56)
        self.horizon = struct.unpack_from('<3d', data, 64)
        n, = struct.unpack_from('<I', data, 88)
        at = 92
        columns = []
        for _ in range(3):
            columns.append(list(zigzag(struct.unpack_from(f'<{n}H', data, at))))
            at += 2 * n
        self.u, self.v, self.h = columns
        size, code = (4, 'I') if n > 65536 else (2, 'H')
        at += -at % size
        self.triangles_at = at + 4
        count, = struct.unpack_from('<I', data, at)
        codes = struct.unpack_from(f'<{3 * count}{code}', data, at + 4)
        at += 4 + 3 * count * size
        highest, indices = 0, []
        for value in codes:
            indices.append(highest - value)
            highest += value == 0
        self.triangles = list(zip(indices[::3], indices[1::3], indices[2::3]))
        self.edges = []
        for _ in range(4):
            count, = struct.unpack_from('<I', data, at)
            self.edges.append(list(struct.unpack_from(f'<{count}{code}', data, at + 4)))
            at += 4 + count * size
        self.extensions = {}
        while at < len(data):
            name, length = struct.unpack_from('<BI', data, at)
            self.extensions[name] = data[at + 5:at + 5 + length]
            at += 5 + length
        assert at == len(data) and highest == n

    def metres(self, vertex):
        return self.low + (self.high - self.low) * self.h[vertex] / UNITS

    def place(self, vertex):
        west, south, east, north = box_of(self.zoom, self.x, self.y)
        return (west + (east - west) * self.u[vertex] / UNITS,
                south + (north - south) * self.v[vertex] / UNITS)

    def normals(self):
        codes = self.extensions[1]
        return [oct_decode(a, b) for a, b in zip(codes[::2], codes[1::2])]

    def side(self, name):
        """Returns the vertices of a side as sorted pairs (position along the side, height in metres)."""
        along, across, at = {'west': (self.v, self.u, 0), 'east': (self.v, self.u, UNITS),
                             'south': (self.u, self.v, 0), 'north': (self.u, self.v, UNITS)}[name]
        return sorted((along[i], self.metres(i)) for i in range(len(along)) if across[i] == at)

    def check(self):
        """Asserts the properties on which clients rely."""
        n = len(self.u)
        assert self.low <= self.high
        assert all(0 <= c <= UNITS for c in self.u + self.v + self.h)
        total, edges = 0, {}
        for t in self.triangles:
            a, b, c = t
            area = ((self.u[b] - self.u[a]) * (self.v[c] - self.v[a]) -
                    (self.u[c] - self.u[a]) * (self.v[b] - self.v[a]))
            assert area > 0, 'a triangle is turned or degenerate'
            total += area
            for edge in ((a, b), (b, c), (c, a)):
                assert edge not in edges
                edges[edge] = True
        assert total == 2 * UNITS * UNITS, 'the triangles do not fill the tile'
        for a, b in edges:
            if (b, a) not in edges:
                assert any(c[a] == c[b] and c[a] in (0, UNITS) for c in (self.u, self.v)), 'a hole'
        for listed, along, across, at in zip(self.edges, (self.v, self.u, self.v, self.u),
                                            (self.u, self.v, self.u, self.v),
                                            (0, 0, UNITS, UNITS)):
            expected = [i for i in range(n) if across[i] == at]
            assert listed == sorted(expected, key=lambda i: along[i])
            assert {0, UNITS} <= {along[i] for i in expected}
        points = [geocentric(*self.place(i), self.metres(i)) for i in range(n)]
        assert all(math.dist(p, self.sphere) <= self.radius + 1e-3 for p in points)
        assert math.dist(self.centre, self.sphere) <= self.radius + 1e-3
        for p in points:
            self.check_horizon(p)

    def check_horizon(self, point):
        """Asserts that an observer at the horizon point sees no vertex above the horizon. The rays from the horizon
        point that touch the ellipsoid form a cone, and so do those from a vertex. One cone must contain the other."""
        p = (point[0] / A, point[1] / A, point[2] / B)
        far, near = math.sqrt(dot(self.horizon, self.horizon)), math.sqrt(dot(p, p))
        angle = math.acos(max(-1.0, min(1.0, dot(p, self.horizon) / far / near)))
        reach = math.acos(1 / far) - math.acos(1 / max(near, 1))
        assert angle <= reach + 1e-7 or far > 1e5, 'a vertex is visible while the horizon point is hidden'


class TileSet:
    """A folder of tiles with its layer.json."""

    def __init__(self, folder):
        self.folder = folder
        with open(os.path.join(folder, 'layer.json')) as file:
            self.layer = json.load(file)
        self.tiles = {}
        for zoom, ranges in enumerate(self.layer['available']):
            for r in ranges:
                for y in range(r['startY'], r['endY'] + 1):
                    for x in range(r['startX'], r['endX'] + 1):
                        assert (zoom, x, y) not in self.tiles
                        self.tiles[zoom, x, y] = Tile(self.read(zoom, x, y), zoom, x, y)

    def path(self, zoom, x, y):
        return os.path.join(self.folder, str(zoom), str(x), f'{y}.terrain')

    def read(self, *tile):
        with open(self.path(*tile), 'rb') as file:
            return file.read()

    def files(self):
        """Returns {name: bytes} of all files in the folder except layer.json and the journal."""
        found = {}
        for folder, _, names in os.walk(self.folder):
            for name in names:
                path = os.path.join(folder, name)
                if name not in ('layer.json', '.terrace-tiles'):
                    with open(path, 'rb') as file:
                        found[os.path.relpath(path, self.folder)] = file.read()
        return found

    def check(self):
        for tile in self.tiles.values():
            tile.check()
        assert set(self.files()) == {f'{z}/{x}/{y}.terrain' for z, x, y in self.tiles}
        self.check_sides()

    def check_metadata(self):
        """Asserts that the metadata of each tile lists the existing tiles below it at the next zoom."""
        for (zoom, x, y), tile in self.tiles.items():
            text = tile.extensions[4]
            assert struct.unpack_from('<I', text)[0] == len(text) - 4
            ranges = json.loads(text[4:])['available']
            below = {(zoom + 1, i, j) for r in (ranges[0] if ranges else ())
                     for i in range(r['startX'], r['endX'] + 1)
                     for j in range(r['startY'], r['endY'] + 1)}
            children = {(zoom + 1, 2 * x + i, 2 * y + j) for i in (0, 1) for j in (0, 1)}
            assert below == children & set(self.tiles), (zoom, x, y)

    def check_sides(self):
        for (zoom, x, y), tile in self.tiles.items():
            for there, own, other in (((zoom, (x + 1) % 2 ** (zoom + 1), y), 'east', 'west'),
                                      ((zoom, x, y + 1), 'north', 'south')):
                if there not in self.tiles:
                    continue
                a, b = tile.side(own), self.tiles[there].side(other)
                assert [p[0] for p in a] == [p[0] for p in b], 'a crack'
                # Each tile rounds its heights to 15 bits between its lowest and its highest.
                rounding = sum((t.high - t.low) / UNITS / 2 for t in (tile, self.tiles[there]))
                assert all(abs(p[1] - q[1]) < 1e-3 + rounding for p, q in zip(a, b)), 'a step'

    def errors(self, samples):
        """Returns, by zoom, the largest distance of samples (lon, lat, height) from the tiles, and the
        number of samples that no tile covers."""
        result = {}
        for zoom in range(self.layer['minzoom'], self.layer['maxzoom'] + 1):
            by_tile, uncovered_count, largest = {}, 0, 0.0
            width = 180 / 2 ** zoom
            for lon, lat, height in samples:
                x, y = (lon + 180) / width, (lat + 90) / width
                key = zoom, math.floor(x), math.floor(y)
                if key in self.tiles:
                    by_tile.setdefault(key, []).append(
                        ((x - key[1]) * UNITS, (y - key[2]) * UNITS, height))
                else:
                    uncovered_count += 1
            for key, places in by_tile.items():
                error, uncovered = measure(self.tiles[key], places)
                largest, uncovered_count = max(largest, error), uncovered_count + uncovered
            result[zoom] = largest, uncovered_count
        return result


def measure(tile, places):
    """Returns the largest vertical distance of (u, v, height) from a tile's triangles, in metres, and the number
    of places on no triangle."""
    cells = {}
    for i, (u, v, _) in enumerate(places):
        cells.setdefault((int(u) >> 10, int(v) >> 10), []).append(i)
    largest, seen = 0.0, bytearray(len(places))
    for t in tile.triangles:
        us, vs, hs = ([c[i] for i in t] for c in (tile.u, tile.v, tile.h))
        (ax, bx, cx), (ay, by, cy) = us, vs
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        heights = [tile.metres(i) for i in t]
        for column in range(min(us) >> 10, (max(us) >> 10) + 1):
            for row in range(min(vs) >> 10, (max(vs) >> 10) + 1):
                for i in cells.get((column, row), ()):
                    u, v, height = places[i]
                    wa = (cx - bx) * (v - by) - (u - bx) * (cy - by)
                    wb = (ax - cx) * (v - cy) - (u - cx) * (ay - cy)
                    wc = (bx - ax) * (v - ay) - (u - ax) * (by - ay)
                    if min(wa, wb, wc) < -1e-6 * area ** 0.5:
                        continue
                    seen[i] = 1
                    there = (wa * heights[0] + wb * heights[1] + wc * heights[2]) / area
                    largest = max(largest, abs(there - height))
    return largest, seen.count(0)
