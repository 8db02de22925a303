# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes and reads small GeoTIFFs without a library: inputs whose bytes do not depend on installed
software, and samples of outputs regardless of their compression."""

import array
import struct
import zlib

# GeoKeys of WGS 84 in degrees, with samples at the centres of cells.
GEOGRAPHIC = {1024: 2, 1025: 1, 2048: 4326, 2054: 9102}

# By type code of `array`: the bits of a sample and TIFF's number of the sample format.
SAMPLE_FORMATS = {'B': (8, 1), 'H': (16, 1), 'h': (16, 2), 'i': (32, 2), 'f': (32, 3), 'd': (64, 3)}
# By TIFF's number of a type: the bytes of a value.
VALUE_BYTES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 12: 8}
STRIP_AND_TILE_TAGS = (273, 279, 324, 325)


def utm(zone):
    """GeoKeys of a northern UTM zone."""
    return {1024: 1, 1025: 1, 3072: 32600 + zone}


def write_tiff(path, columns, rows, samples, corner=(500000.0, 5200000.0), cell=30.0, keys=None,
               matrix=None, kind='f', bands=1, nodata=None):
    """Writes a raster in one strip.

    samples: by rows, with interleaved bands. corner: the upper left corner of the raster; cell: side of
    a cell. matrix: the sixteen numbers of a transformation, instead of both. keys: {GeoKey: integer, float
    or text}. kind: type code of `array`. nodata: the value as text.
    """
    pixels = array.array(kind, samples).tobytes()
    bits, sample_format = SAMPLE_FORMATS[kind]
    assert len(pixels) == columns * rows * bands * bits // 8
    shorts, doubles, text = [], [], ''
    for key, value in sorted((keys or {}).items()):
        if isinstance(value, str):
            shorts += [key, 34737, len(value) + 1, len(text)]
            text += value + '|'
        elif isinstance(value, float):
            shorts += [key, 34736, 1, len(doubles)]
            doubles.append(value)
        else:
            shorts += [key, 0, 1, value]
    entries = [(256, 4, [columns]), (257, 4, [rows]), (258, 3, [bits] * bands), (259, 3, [1]),
               (262, 3, [1]), (273, 4, [8]), (277, 3, [bands]), (278, 4, [rows]),
               (279, 4, [len(pixels)]), (339, 3, [sample_format] * bands)]
    if matrix:
        entries.append((34264, 12, matrix))
    else:
        entries.append((33550, 12, [cell, cell, 0.0]))
        entries.append((33922, 12, [0.0, 0.0, 0.0, *map(float, corner), 0.0]))
    if shorts:
        entries.append((34735, 3, [1, 1, 0, len(keys)] + shorts))
    if doubles:
        entries.append((34736, 12, doubles))
    if text:
        entries.append((34737, 2, text))
    if nodata is not None:
        entries.append((42113, 2, nodata))
    directory, extra = b'', b''
    start = 8 + len(pixels) + len(pixels) % 2
    extra_start = start + 2 + 12 * len(entries) + 4
    for tag, number, values in sorted(entries):
        if number == 2:
            data = values.encode() + b'\0'
        else:
            data = struct.pack(f'<{len(values)}' + {3: 'H', 4: 'I', 12: 'd'}[number], *values)
        count = len(data) // VALUE_BYTES[number]
        if len(data) <= 4:
            value = data.ljust(4, b'\0')
        else:
            value = struct.pack('<I', extra_start + len(extra))
            extra += data + b'\0' * (len(data) % 2)
        directory += struct.pack('<HHI', tag, number, count) + value
    with open(path, 'wb') as file:
        file.write(struct.pack('<2sHI', b'II', 42, start) + pixels + b'\0' * (len(pixels) % 2))
        file.write(struct.pack('<H', len(entries)) + directory + struct.pack('<I', 0) + extra)


def read_directory(data):
    """Returns {tag: (type, bytes of its values)} of the first directory of a little-endian TIFF."""
    mark, magic, at = struct.unpack('<2sHI', data[:8])
    assert (mark, magic) == (b'II', 42), 'not a little-endian TIFF'
    tags = {}
    for i in range(struct.unpack_from('<H', data, at)[0]):
        tag, number, count = struct.unpack_from('<HHI', data, at + 2 + 12 * i)
        size, position = count * VALUE_BYTES[number], at + 10 + 12 * i
        if size > 4:
            position = struct.unpack_from('<I', data, position)[0]
        tags[tag] = (number, data[position:position + size])
    return tags


def tiff_content(path):
    """Returns the content of a GeoTIFF: its tags except the offsets and sizes of strips and tiles, then the
    decompressed bytes of each strip or tile."""
    with open(path, 'rb') as file:
        data = file.read()
    tags = read_directory(data)

    def numbers(tag):
        kind, values = tags[tag]
        return struct.unpack(f'<{len(values) // VALUE_BYTES[kind]}' + {3: 'H', 4: 'I'}[kind], values)

    content = b''.join(struct.pack('<HHI', tag, kind, len(values)) + values
                       for tag, (kind, values) in sorted(tags.items()) if tag not in STRIP_AND_TILE_TAGS)
    offsets, sizes = (324, 325) if 324 in tags else (273, 279)
    unpack = {1: bytes, 8: zlib.decompress, 32946: zlib.decompress}[numbers(259)[0]]
    return content + b''.join(unpack(data[at:at + size])
                              for at, size in zip(numbers(offsets), numbers(sizes)))
