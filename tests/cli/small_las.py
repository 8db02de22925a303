# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes and reads small LAS files without a library (ASPRS, LAS specification 1.4 - R15)."""

import random
import struct

# The fields after X, Y and Z in a record: (name, format), or (((part, bits), ...), 'B') for bit
# fields, starting at the lowest bit.
OLD_RETURNS = ((('return_number', 3), ('number_of_returns', 3), ('scan_direction_flag', 1),
                ('edge_of_flight_line', 1)), 'B')
OLD_CLASS = ((('classification', 5), ('synthetic', 1), ('key_point', 1), ('withheld', 1)), 'B')
OLD = [('intensity', 'H'), OLD_RETURNS, OLD_CLASS, ('scan_angle_rank', 'b'), ('user_data', 'B'),
       ('point_source_id', 'H')]
NEW = [('intensity', 'H'), ((('return_number', 4), ('number_of_returns', 4)), 'B'),
       ((('synthetic', 1), ('key_point', 1), ('withheld', 1), ('overlap', 1), ('scanner_channel', 2),
         ('scan_direction_flag', 1), ('edge_of_flight_line', 1)), 'B'),
       ('classification', 'B'), ('user_data', 'B'), ('scan_angle', 'h'), ('point_source_id', 'H'),
       ('gps_time', 'd')]
TIME = [('gps_time', 'd')]
COLOUR = [('red', 'H'), ('green', 'H'), ('blue', 'H')]
NIR = [('nir', 'H')]
WAVE = [('wavepacket_index', 'B'), ('wavepacket_offset', 'Q'), ('wavepacket_size', 'I'),
        ('return_point_wave_location', 'f'), ('x_t', 'f'), ('y_t', 'f'), ('z_t', 'f')]
FORMATS = [OLD, OLD + TIME, OLD + COLOUR, OLD + TIME + COLOUR, OLD + TIME + WAVE,
           OLD + TIME + COLOUR + WAVE, NEW, NEW + COLOUR, NEW + COLOUR + NIR, NEW + WAVE,
           NEW + COLOUR + NIR + WAVE]


def record_format(point_format):
    return '<iii' + ''.join(kind for _, kind in FORMATS[point_format])


def names_of(point_format):
    names = []
    for name, _ in FORMATS[point_format]:
        names += [part for part, _ in name] if isinstance(name, tuple) else [name]
    return names


def unpack_record(point_format, record):
    """Returns {name: value} of a record, with bit fields separated and without extra bytes."""
    size = struct.calcsize(record_format(point_format))
    values = list(struct.unpack(record_format(point_format), record[:size]))
    out = dict(zip('XYZ', values[:3]))
    for (name, _), value in zip(FORMATS[point_format], values[3:]):
        if isinstance(name, tuple):
            for part, bits in name:
                out[part] = value & (1 << bits) - 1
                value >>= bits
        else:
            out[name] = value
    return out


def random_records(point_format, count, seed=1):
    """Returns random records, whose floats have few digits."""
    source = random.Random(seed * 100 + point_format)

    def record():
        values = [source.randrange(-1000, 1000) for _ in range(3)]
        for _, kind in FORMATS[point_format]:
            if kind in 'fd':
                values.append(source.randrange(-80000, 80000) / 8)
            else:
                bits = 8 * struct.calcsize('<' + kind)
                values.append(source.getrandbits(bits) - (2**(bits - 1) if kind.islower() else 0))
        return struct.pack(record_format(point_format), *values)
    return [record() for _ in range(count)]


def vlr(user, number, data):
    return struct.pack('<H16sHH32s', 0, user, number, len(data), b'') + data


def evlr(user, number, data):
    return struct.pack('<H16sHQ32s', 0, user, number, len(data), b'') + data


def geo_keys(keys):
    """Returns the VLR of GeoKeys, {key: number}."""
    shorts = [1, 1, 0, len(keys)]
    for key, value in sorted(keys.items()):
        shorts += [key, 0, 1, value]
    return vlr(b'LASF_Projection', 34735, struct.pack(f'<{len(shorts)}H', *shorts))


def wkt(text):
    return vlr(b'LASF_Projection', 2112, text.encode() + b'\0')


def extra_bytes(rows):
    """Returns the VLR of extra bytes, [(name, type, options, scale, offset)], with types as in the specification."""
    data = b''
    for name, kind, options, scale, offset in rows:
        data += struct.pack('<2xBB32s4x24x24x24xd16xd16x32s', kind, options, name.encode(), scale,
                            offset, b'')
    assert len(data) == 192 * len(rows)
    return vlr(b'LASF_Spec', 4, data)


def las(point_format, records, minor=None, scale=(0.01, 0.01, 0.01), offset=(0.0, 0.0, 0.0), vlrs=(),
        evlrs=(), encoding=0, points=None, record_bytes=None):
    """Returns the bytes of a file. All parts are used unchanged, even if they contradict each other."""
    if minor is None:
        minor = 4 if point_format >= 6 else 2
    header_bytes = 375 if minor == 4 else 235 if minor == 3 else 227
    vlr_bytes = b''.join(vlrs)
    record_data = b''.join(records)
    count = len(records) if points is None else points
    if record_bytes is None:
        record_bytes = len(records[0]) if records else struct.calcsize(record_format(point_format))
    old_count = count if point_format < 6 else 0
    header = struct.pack('<4sHH16xBB32s32sHHHIIBHI20x', b'LASF', 0, encoding, 1, minor, b'', b'', 1, 2026,
                         header_bytes, header_bytes + len(vlr_bytes), len(vlrs), point_format, record_bytes,
                         old_count)
    header += struct.pack('<6d48x', *scale, *offset)
    if minor >= 3:
        header += bytes(8)
    if minor == 4:
        header += struct.pack('<QIQ120x', header_bytes + len(vlr_bytes) + len(record_data) if evlrs else 0,
                              len(evlrs), count)
    assert len(header) == header_bytes
    return header + vlr_bytes + record_data + b''.join(evlrs)


class Las:
    """A file read from disk: header, VLRs and raw records."""

    def __init__(self, path):
        with open(path, 'rb') as file:
            data = file.read()
        assert data[:4] == b'LASF'
        self.encoding, = struct.unpack_from('<H', data, 6)
        self.minor = data[25]
        self.software = data[58:90].rstrip(b'\0')
        self.header_bytes, first, vlrs, self.point_format, self.record_bytes, count = \
            struct.unpack_from('<HIIBHI', data, 94)
        self.scale = struct.unpack_from('<3d', data, 131)
        self.offset = struct.unpack_from('<3d', data, 155)
        bounds = struct.unpack_from('<6d', data, 179)
        self.max, self.min = bounds[::2], bounds[1::2]
        self.old_count = count
        self.returns = struct.unpack_from('<5I', data, 111)
        if self.minor == 4:
            count, = struct.unpack_from('<Q', data, 247)
            self.returns = struct.unpack_from('<15Q', data, 255)
        self.vlrs = {}
        at = self.header_bytes
        for _ in range(vlrs):
            user, number, size = struct.unpack_from('<2x16sHH', data, at)
            self.vlrs[user.split(b'\0')[0].decode('latin-1'), number] = data[at + 54:at + 54 + size]
            at += 54 + size
        assert at <= first
        self.records = [data[first + i * self.record_bytes:first + (i + 1) * self.record_bytes]
                        for i in range(count)]
        assert len(data) >= first + count * self.record_bytes

    def places(self):
        """Returns the positions of the records in the CRS, rounded to a millionth and sorted."""
        return sorted(tuple(round(step * scale + offset, 6) for step, scale, offset
                            in zip(struct.unpack_from('<iii', record), self.scale, self.offset))
                      for record in self.records)
