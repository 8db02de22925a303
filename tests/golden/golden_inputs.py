# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the inputs of the golden commands from integers alone. It uses no library's random numbers and no
function whose rounding may vary, so the bytes are the same everywhere.

The inputs are small: with --block 600 they make stores of two to four levels.
"""

import json
import os
import struct

from small_tiff import GEOGRAPHIC, utm, write_tiff


def pseudo_random(*key):
    """Returns a pseudo-random number from 0 to 2^32 - 1 that depends only on the integers of the key."""
    value = 0x9E3779B9
    for part in key:
        value = (value ^ (part & 0xFFFFFFFF)) * 0x85EBCA6B & 0xFFFFFFFF
        value = (value ^ value >> 13) * 0xC2B2AE35 & 0xFFFFFFFF
        value ^= value >> 16
    return value


def hills(seed, column, row):
    """Returns the height of a cell in sixteenths, from 0 to about 19000: lattices of 48, 16 and 5 cells, and noise."""
    height = pseudo_random(seed, 0, column, row) % 40
    for step, amplitude in ((48, 12000), (16, 5000), (5, 1800)):
        i, u = divmod(column, step)
        k, v = divmod(row, step)
        corners = [pseudo_random(seed, step, i + x, k + y) % amplitude for y in (0, 1) for x in (0, 1)]
        west = corners[0] * (step - v) + corners[2] * v
        east = corners[1] * (step - v) + corners[3] * v
        height += (west * (step - u) + east * u) // (step * step)
    return height


def table(seed, columns, rows, height=lambda sixteenths, column, row: sixteenths / 16):
    return [height(hills(seed, c, r), c, r) for r in range(rows) for c in range(columns)]


def without_data(column, row):
    """Returns true for the cells of a lake, of a corner and for single ones."""
    return ((column - 60) ** 2 + (row - 30) ** 2 < 90 or column + row < 14 or
            pseudo_random(5, column, row) % 500 == 0)


def make_rasters():
    write_tiff('hills.tif', 96, 80,
               table(1, 96, 80, lambda h, c, r: -9999.0 if without_data(c, r) else h / 16),
               (690000.0, 5202000.0), 25.0, utm(32), nodata='-9999')
    # A coast: whole metres, the sea at 0, no data outside the surveyed area.
    coast = table(2, 90, 70, lambda h, c, r: -32768 if c > 84 and r > 40 else max(0, h // 8 - 700))
    write_tiff('coast.tif', 90, 70, coast, (8.4, 46.42), 0.0009765625, GEOGRAPHIC, kind='h',
               nodata='-32768')
    # Rows from south to north.
    transform = [20.0, 0.0, 0.0, 400000.0, 0.0, 20.0, 0.0, 300000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    write_tiff('south-up.tif', 70, 60, table(3, 70, 60), matrix=transform, keys=utm(33))
    # Two sheets of one map; the second is ten rows lower.
    sheet = [hills(4, c, r) // 16 for r in range(60) for c in range(100)]
    cell = 0.00390625
    write_tiff('sheet-west.tif', 52, 50, [sheet[100 * r + c] for r in range(50) for c in range(52)],
               (14.0, 50.0), cell, GEOGRAPHIC, kind='h', nodata='-32768')
    write_tiff('sheet-east.tif', 48, 50,
               [sheet[100 * r + c] for r in range(10, 60) for c in range(52, 100)],
               (14.0 + 52 * cell, 50.0 - 10 * cell), cell, GEOGRAPHIC, kind='h', nodata='-32768')
    # The second band contains the heights.
    write_tiff('bands.tif', 40, 30,
               [value for c in range(40 * 30) for value in (c % 7, hills(5, c % 40, c // 40) // 8)],
               (500000.0, 5300000.0), 10.0, utm(31), kind='H', bands=2)
    write_tiff('dateline.tif', 64, 48, table(6, 64, 48, lambda h, c, r: h // 16), (179.9, -16.4),
               0.00390625, GEOGRAPHIC, kind='h')
    # A projection whose ground map is not diagonal: Lambert azimuthal equal area, far from its
    # centre.
    write_tiff('laea.tif', 72, 64, table(7, 72, 64), (2800000.0, 1800000.0), 500.0,
               {1024: 1, 1025: 1, 3072: 3035})


def laser_points():
    """Yields the points of a laser scan strip: x, y, z in centimetres, intensity, class, time."""
    for i in range(2600):
        x = 40000 * (i % 65) // 64 + pseudo_random(8, i) % 500
        y = 30000 * (i // 65) // 40 + pseudo_random(9, i) % 700
        tree = pseudo_random(10, i) % 5 == 0
        z = 40000 + hills(8, x // 400, y // 400) // 4 + (pseudo_random(11, i) % 1500 if tree else 0)
        yield x, y, z, pseudo_random(12, i) % 4096, 5 if tree else 2, i * 25


def decimal(hundredths):
    return f'{hundredths // 100}.{hundredths % 100:02}'


def make_clouds():
    with open('laser.csv', 'w', encoding='ascii') as file:
        file.write('x,y,z,intensity,class,time\n')
        for x, y, z, intensity, kind, time in laser_points():
            file.write(f'{decimal(69000000 + x)},{decimal(519000000 + y)},{decimal(z)},{intensity},'
                       f'{kind},{decimal(time)}\n')
    with open('laser.ply', 'wb') as file:
        points = list(laser_points())
        names = (('double', 'x'), ('double', 'y'), ('double', 'z'), ('ushort', 'intensity'),
                 ('uchar', 'class'), ('float', 'time'), ('uchar', 'red'), ('uchar', 'green'),
                 ('uchar', 'blue'))
        file.write(b'ply\nformat binary_little_endian 1.0\nelement vertex %d\n' % len(points))
        file.write(''.join(f'property {kind} {name}\n' for kind, name in names).encode())
        file.write(b'end_header\n')
        for x, y, z, intensity, kind, time in reversed(points):
            file.write(struct.pack('<3dHBf3B', 690000 + x / 100, 5190000 + y / 100, z / 100,
                                   intensity, kind, time / 128, intensity >> 4, z >> 8, kind * 40))
    # Three samples at every seventh place, two at every fifth; heights differ by at most 4 cm.
    with open('twice.xyz', 'w', encoding='ascii') as file:
        for i in range(900):
            x, y = i % 30 * 100 + pseudo_random(13, i) % 60, i // 30 * 100 + pseudo_random(14, i) % 60
            z = hills(9, x // 80, y // 80)
            for copy in range(3 if i % 7 == 0 else 2 if i % 5 == 0 else 1):
                file.write(f'{decimal(x)} {decimal(y)} {decimal(z + 2 * copy)}\n')
    # A ring, which is a body with a hole. Its circles have rational points, so no sine is needed.
    with open('ring.ply', 'wb') as file:
        file.write(b'ply\nformat binary_little_endian 1.0\nelement vertex 1200\n'
                   b'property float x\nproperty float y\nproperty float z\nend_header\n')
        for i in range(1200):
            a, b = circle_point(i // 24, 50, pseudo_random(15, i)), circle_point(i % 24, 24, pseudo_random(16, i))
            radius = 3.0 + b[0]
            file.write(struct.pack('<3f', radius * a[0], radius * a[1], b[1]))
    with open('places.csv', 'w', encoding='ascii') as file:
        file.write('x,y,z,weight\n')
        for i in range(240):
            town = i % 6
            x = 10000 * (town % 3) + pseudo_random(17, i) % 4000
            y = 9000 * (town // 3) + pseudo_random(18, i) % 4000
            file.write(f'{decimal(x)},{decimal(y)},{decimal(pseudo_random(19, i) % 2000)},{1 + i % 4}\n')


def circle_point(i, count, jitter):
    """Returns the i-th of `count` points of the unit circle, evenly spaced except for the jitter."""
    quarter, t = divmod(4 * i, count)
    t = (t + (jitter % 1000) / 1250) / count
    x, y = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
    for _ in range(quarter):
        x, y = -y, x
    return x, y


def make_other_files():
    def write(name, value):
        with open(name, 'w', encoding='ascii') as file:
            json.dump(value, file)

    write('regions.json', {'regions': [
        {'box': [690400, 5200500, 691200, 5201300], 'semi_axes': [60, 15], 'angle': 40},
        {'box': [691300, 5200500, 692000, 5201300], 'semi_axes': [60, 15], 'angle': -40}]})
    write('everywhere.json', {'regions': [{'semi_axes': [4, 1, 1], 'rotation': [
        [0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]}]})
    write('laea-regions.json', {'regions': [
        {'box': [2805000, 1775000, 2825000, 1795000], 'semi_axes': [2000, 500], 'angle': 30}]})
    write('region.geojson', {'type': 'Polygon', 'coordinates': [[
        [690500, 5200300], [692000, 5200600], [691500, 5201700], [690800, 5201200],
        [690500, 5200300]]]})
    write('line.geojson', {'type': 'LineString', 'coordinates': [
        [690100, 5200100], [691000, 5201000], [692200, 5201800]]})
    with open('ask.csv', 'w', encoding='ascii') as file:
        file.write('name,x,y\n')
        for i in range(200):
            file.write(f'p{i},{decimal(69000000 + pseudo_random(20, i) % 240000)},'
                       f'{decimal(520000000 + pseudo_random(21, i) % 200000)}\n')
    with open('ask-lonlat.csv', 'w', encoding='ascii') as file:
        file.write('lon;lat\n')
        for i in range(60):
            file.write(f'11.{4980 + pseudo_random(22, i) % 280:04};46.{9270 + pseudo_random(23, i) % 160:04}\n')
    with open('ask-laser.csv', 'w', encoding='ascii') as file:
        for i in range(150):
            file.write(f'{decimal(69000000 + pseudo_random(24, i) % 40000)},'
                       f'{decimal(519000000 + pseudo_random(25, i) % 30000)}\n')
    with open('ask-britain.csv', 'w', encoding='ascii') as file:
        file.write('longitude,latitude\n')
        for i in range(40):
            file.write(f'-1.{9820 + pseudo_random(26, i) % 180:04},52.{5985 + pseudo_random(27, i) % 90:04}\n')
    # A geoid of 30 to 60 m in GeographicLib's format, five degrees apart.
    with open('geoid.pgm', 'wb') as file:
        file.write(b'P5\n# Description made for tests\n# DateTime 2020-01-01 00:00:00\n'
                   b'# MaxBilinearError 0.1\n# RMSBilinearError 0.1\n# MaxCubicError 0.1\n'
                   b'# RMSCubicError 0.1\n# Offset -100\n# Scale 0.004\n72 37\n65535\n')
        for row in range(37):
            for column in range(72):
                file.write(struct.pack('>H', 32500 + 300 * abs(18 - row) + 40 * abs(36 - column)))
    with open('nine.obj', 'w', encoding='ascii') as file:
        for i in range(9):
            file.write(f'v {i % 3} {i // 3} {i * i % 5}\n')
        for i in (0, 1, 3, 4):
            file.write(f'f {i + 1} {i + 2} {i + 5}\nf {i + 1} {i + 5} {i + 4}\n')


def make_inputs(folder):
    """Writes all inputs into the folder. Returns their names."""
    here = os.getcwd()
    os.chdir(folder)
    try:
        make_rasters()
        make_clouds()
        make_other_files()
        return sorted(os.listdir('.'))
    finally:
        os.chdir(here)
