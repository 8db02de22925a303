#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Reads stores and overlays. Written from FORMAT.md alone, and must stay so: if it and the library
differ, one of the three is wrong.


    decode_store.py STORE            every point: its cluster's level and ordinal, coordinates, attributes
    decode_store.py STORE OVERLAY    every value of the overlay: level, ordinal, index, value
"""
import json
import pathlib
import struct
import sys
import zlib

WORD = 1 << 64
ESCAPE = 136
STEPS = (0, 2, 4, 8, 15, 21, 29)  # the last class of steps 0 to 6


def require(condition, what):
    if not condition:
        raise ValueError(what)


def signed(value, bits=64):
    value %= 1 << bits
    return value - (1 << bits) if value >> (bits - 1) else value


def unzigzag(value):
    return (value >> 1) ^ -(value & 1)


def clamp(value, low, high):
    return max(low, min(high, value))


def step_of(number_class):
    return sum(number_class > last for last in STEPS)


def crc8(data):
    state = 0
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = (state << 1 ^ (0x107 if state & 0x80 else 0)) & 0xFF
    return state


def crc16(data):
    state = 0xFFFF
    for byte in data:
        state ^= byte << 8
        for _ in range(8):
            state = (state << 1 ^ (0x1021 if state & 0x8000 else 0)) & 0xFFFF
    return state ^ 0xFFFF


def real(form, k):
    """Returns the double represented by integer `k` in a number form."""
    if form < 20:
        value = float(k) / 10 ** (form % 10)
        return value if form < 10 else struct.unpack("<f", struct.pack("<f", value))[0]
    bits, code = (32, "f") if form == 20 else (64, "d")
    k = k if k >= 0 else k ^ ((1 << (bits - 1)) - 1)
    return struct.unpack("<" + code, (k % (1 << bits)).to_bytes(bits // 8, "little"))[0]


class Bytes:
    """Reads numbers of a byte string whose last four bytes are the CRC-32 of the rest."""

    def __init__(self, data, what):
        require(len(data) >= 4 and zlib.crc32(data[:-4]) == struct.unpack("<I", data[-4:])[0], what)
        self.data, self.at = data[:-4], 0

    def take(self, count):
        require(count <= len(self.data) - self.at, "too short")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, count):
        return int.from_bytes(self.take(count), "little")

    def varint(self):
        value = shift = 0
        while True:
            byte = self.number(1)
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    def signed_varint(self):
        return unzigzag(self.varint())

    def done(self):
        require(self.at == len(self.data), "bytes left over")


class Tables:
    def __init__(self, data, schema):
        columns = len(schema) + 3
        self.border = 148 + 18 * columns
        contexts = self.border + 50 + 96 + 1 + 2 * len(schema)
        source = Bytes(data + struct.pack("<I", zlib.crc32(data)), "tables")
        fitted = source.number(8)
        self.coefficients = {}
        for pattern in range(64):
            neighbours = [bit for bit in range(6) if pattern >> bit & 1]
            if fitted >> pattern & 1:
                rest = [source.signed_varint() for _ in neighbours[1:]]
                self.coefficients[pattern] = dict(zip(neighbours, [256 - sum(rest)] + rest))
            elif pattern & 7 == 7:
                self.coefficients[pattern] = {0: 256, 1: 256, 2: -256}
            elif pattern:
                self.coefficients[pattern] = {neighbours[0]: 256}
        self.guide = source.varint() - 1
        require(self.guide < len(schema), "guide")
        self.kinds = [source.number(1) for _ in range(columns)]
        integers = [not channel['type'].startswith('float') for channel in schema]
        for k, kind in enumerate(self.kinds):
            possible = (10 if k != self.guide else 2) if self.guide >= 0 else 3
            after_integers = 0 < k < len(schema) and integers[k] and integers[k - 1]
            require(kind < possible and (kind % 5 != 2 or after_integers), "kind")
        self.symbols = []  # per context: the (symbol, start, frequency) of every slot
        while len(self.symbols) < contexts:
            slots, symbol = [], 0
            used = source.varint()
            if used == 0:
                self.symbols += [[(ESCAPE, 0, 2048)] * 2048] * (1 + source.varint())
                continue
            for _ in range(used):
                symbol += source.varint()
                frequency = source.varint()
                slots += [(symbol, len(slots), frequency)] * frequency
            missing = 2048 - len(slots)
            require(symbol < ESCAPE and missing >= 0, "frequencies")
            self.symbols.append(slots + [(ESCAPE, len(slots), missing)] * missing)
        require(len(self.symbols) == contexts, "contexts")
        source.done()


class Symbols:
    """Reads symbols and raw bits from the two ends of a cluster's bytes."""

    def __init__(self, data, tables):
        require(len(data) >= 1, "too few bytes")
        self.data, self.tables = data, tables
        self.front = min(4, len(data))
        self.state = int.from_bytes(data[:self.front], "little")
        self.bits, self.left = int.from_bytes(data[::-1], "big"), 8 * len(data)

    def raw(self, count):
        if count > 56:
            upper = self.raw(count - 32)
            return upper << 32 | self.raw(32)
        self.left -= count
        require(self.left >= 8 * self.front, "bits run out")
        return self.bits >> self.left & ((1 << count) - 1)

    def symbol(self, context):
        symbol, start, frequency = self.tables.symbols[context][self.state % 2048]
        self.state = frequency * (self.state // 2048) + self.state % 2048 - start
        if self.state < 65536 and self.front < len(self.data):
            self.state = self.state * 65536 + struct.unpack_from("<H", self.data, self.front)[0]
            self.front += 2
        return self.raw(8) if symbol == ESCAPE else symbol

    def number(self, context):
        """Returns a number and its class."""
        c = self.symbol(context)
        require(c < ESCAPE, "class")
        if c < 16:
            return c, c
        e = 4 + (c - 16) // 2
        return ((2 + c % 2) << (e - 1)) + self.raw(e - 1), c

    def uniform(self, size):
        b = size.bit_length() - 1
        value, s = self.raw(b), (2 << b) - size
        return value if value < s else 2 * value + self.raw(1) - s

    def end(self):
        rest = self.left - 8 * self.front
        require(0 <= rest < 8 and self.bits >> 8 * self.front & ((1 << rest) - 1) == 0, "the two ends do not meet")
        if self.left == 8 * len(self.data):
            require(self.state < 65536, "rANS state")
            return self.state
        require(65536 <= self.state < 131072, "rANS state")
        return self.state - 65536


def magnitude(number_class):
    c = number_class
    base = c if c < 16 else (2 + c % 2) << (3 + (c - 16) // 2)
    m = abs(unzigzag(base))
    return (0, 2)[m] if m < 2 else 2 * (m.bit_length() - 1) + 2 + (m >> (m.bit_length() - 2) & 1)


def rows(source, size, points):
    """Returns the cells (column, row) of the box, row by row, then their heights."""
    cells, above = [], 0
    begin = end = None
    steps = [0, 0]

    def outwards(step, row, room):
        half = 25 if 2 * row >= size[1] else 0
        return unzigzag(source.number(source.tables.border + half + 5 * (2 + clamp(step, -2, 2)) + min(room, 4))[0])

    for row in range(size[1]):
        count = source.number(1 + min(2, above))[0]
        at = None
        for run in range(count):
            if run:
                first = at + 1 + source.number(16)[0]
                at = first + 1 + source.number(17)[0]
            elif begin is None:
                first = source.number(9)[0]
                at = first + 1 + source.number(15)[0]
            else:
                steps[0] = outwards(steps[0], row, begin)
                first = begin - steps[0]
                if row == size[1] - 1 and count == 1:
                    at = first + points - len(cells)
                else:
                    steps[1] = outwards(steps[1], row, size[0] - end)
                    at = end + steps[1]
            if run == 0:
                begin, end = first, at
            require(0 <= first < at <= size[0], "runs")
            cells += [(column, row) for column in range(first, at)]
        above = count
    return cells


def heights(source, size, cells):
    known, magnitudes, out = {}, {}, []
    last = min(size - 1, (1 << 63) - 1) // 2
    for column, row in cells:
        if size == 1:
            out.append(0)
            continue
        places = [(column - 1, row), (column, row - 1), (column - 1, row - 1), (column + 1, row - 1), (column - 2, row),
                  (column, row - 2)]
        there = [place in known for place in places]
        pattern = sum(bit << k for k, bit in enumerate(there))
        prediction = last
        if pattern:
            coefficients = source.tables.coefficients[pattern]
            total = sum(factor * known[places[k]] for k, factor in coefficients.items())
            prediction = signed(total + 128) >> 8
        prediction = clamp(prediction, 0, size - 1)
        factors = [factor * bit for factor, bit in zip((2, 2, 1, 1), there)]
        weight = sum(factors)
        total = sum(factor * magnitudes.get(place, 0) for factor, place in zip(factors, places))
        step = min(30, total * (1024 // weight) >> 10) if weight else 31
        value, c = source.number(84 + step + (0 if there[0] and there[1] else 32))
        last = (prediction + unzigzag(value)) % WORD
        known[column, row], magnitudes[column, row] = last, magnitude(c)
        out.append(last)
    return out


def split(source, low, size, n, out):
    if n == 0:
        return
    if n == 1:
        out.append(tuple(a + (source.uniform(s) if s > 1 else 0) for a, s in zip(low, size)))
        return
    axis = max(range(3), key=lambda k: (size[k], -k))
    if size[axis] == 1:
        out += [tuple(low)] * n
        return
    if n < 32:
        lower = source.symbol(30 + n - 2)
    else:
        lower = n // 2 + unzigzag(source.number(60 + min(23, n.bit_length() - 6))[0])
    require(0 <= lower <= n, "split")
    half = size[axis] - size[axis] // 2
    for start, length, count in ((0, half, lower), (half, size[axis] // 2, n - lower)):
        part_low, part_size = list(low), list(size)
        part_low[axis] += start
        part_size[axis] = length
        split(source, part_low, part_size, count, out)


class Recent:
    """Reads differences that are often one of the most recent ones."""

    def __init__(self, source, context, count):
        self.source, self.context, self.count = source, context, count
        self.list, self.place, self.last = [0, 1, -1, 2, -2, 3, -3][:count], 0, 0

    def difference(self):
        self.place = self.source.symbol(self.context + 2 + min(3, self.place))
        require(self.place <= self.count, "place")
        if self.place == self.count:
            number, self.last = self.source.number(self.context + 6 + step_of(self.last) // 2)
            self.list.append(unzigzag(number))
        difference = self.list.pop(self.place)
        self.list = [difference] + self.list[:self.count - 1]
        return difference


def head(source, c, floating):
    """Returns the number form (None except for floats), whether there are several values, the first, its class, the divisor."""
    symbol = source.symbol(c)
    form = symbol % 22 if floating else None
    symbol = symbol // 22 if floating else symbol
    require(symbol < 3, "head")
    first, last = source.number(c + 1)
    divisor = source.number(c + 1)[0] if symbol == 2 else 1
    require(symbol < 2 or divisor > 1, "divisor")
    return form, symbol > 0, signed(unzigzag(first)), last, divisor


ALONG, SAME, BEGINS = range(3)


def guide(source, number, count, floating):
    """Returns the number form and the integers of the guide, and the step to each point from the previous one."""
    c = 148 + 18 * number
    form, several, value, last, divisor = head(source, c, floating)
    values, steps = [value], [BEGINS]
    recent = Recent(source, c, 7) if source.tables.kinds[number] == 1 else None
    step, jump, jump_class = ALONG, 0, 0
    for _ in range(1, count):
        difference = 0
        step = source.symbol(c + 14 + step) if several else SAME
        require(step < 3, "step")
        if step == BEGINS:
            residual, jump_class = source.number(c + 10 + step_of(jump_class) // 2)
            difference = jump = jump + unzigzag(residual)
        elif step == ALONG and recent:
            difference = recent.difference()
        elif step == ALONG:
            residual, last = source.number(c + 2 + step_of(last))
            difference = unzigzag(residual)
        values.append(signed(values[-1] + difference * divisor))
        steps.append(step)
    return form, values, steps


def column(source, number, count, floating, before, steps=None):
    """Returns the number form (None except for floats) and the integers of a column. steps: of the guide."""
    c, kind = 148 + 18 * number, source.tables.kinds[number]
    form, several, value, last, divisor = head(source, c, floating)
    values, recent = [value], Recent(source, c, 3)
    line, along = 0, [0, 0, 0]
    for k in range(1, count):
        if not several:
            values.append(values[0])
            continue
        step = steps[k] if steps else ALONG
        if kind % 5 == 1 and step == ALONG:
            difference = recent.difference()
        else:
            context = c + 2 + step_of(last) if step == ALONG else c + (14 if step == SAME else 10) + step_of(last) // 2
            difference, last = source.number(context)
            difference = unzigzag(difference)
        if kind % 5 in (3, 4) and step == ALONG:
            difference += along[0] if kind % 5 == 3 else sorted(along)[1]
            along = [signed(difference)] + along[:2]
        origin = line if kind >= 5 and step == BEGINS else k - 1
        expected = before[k] - before[origin] if kind % 5 == 2 else 0
        values.append(signed(values[origin] + expected + difference * divisor))
        line = k if step == BEGINS else line
    return form, values


def typed(kind, form, values):
    if form is not None:
        return [real(form, value) for value in values]
    bits = int(kind.lstrip("uint"))
    return [value % (1 << bits) if kind.startswith("u") else signed(value, bits) for value in values]


def columns(source, count, schema, guided):
    out, before = [], None
    for a, channel in enumerate(schema):
        if guided and a == source.tables.guide:
            form, before, _ = guided
        else:
            steps = guided[2] if guided else None
            form, before = column(source, a, count, channel["type"].startswith("float"), before, steps)
        out.append(typed(channel["type"], form, before))
    return out


def ordinals(source, nearest, count):
    values, value, c = [], 0, None
    for _ in range(count):
        step = 0 if c is None else step_of(c)
        context = 24 if c is None else 25 + max(0, min(2, step - 4)) if nearest else 28 + (step == 7)
        difference, c = source.number(context)
        value = (value + unzigzag(difference)) % WORD
        values.append(value)
    return values


def key(kind, value):
    """Returns an unsigned number for an attribute's value, in the order of the values."""
    if kind.startswith("float"):
        bits = int.from_bytes(struct.pack("<d", value), "little")
        return bits + (1 << 63) if bits >> 63 == 0 else bits ^ (WORD - 1)
    return value if kind == "uint64" else value + (1 << 63)


class Cluster:
    """A decoded cluster: `points` (three doubles), `attributes` (a column each), `children` (per level below, from the
next), and the position of the representative (None in the root)."""

    def __init__(self, data, entry, tables, schema, level, root, grid):
        small = grid and level == 0
        require((crc8 if small else crc16)(data) == entry["checksum"], "cluster checksum")
        source = Symbols(data, tables)
        count = entry["points"]
        form = source.symbol(0)
        require(form < 4, "cluster form")
        low, size = list(entry["low"]), [s or WORD for s in entry["size"]]
        if form & 2:
            for axis in range(3):
                inside = [source.number(18 + 2 * axis + side)[0] for side in range(2)]
                low[axis] += inside[0]
                size[axis] -= sum(inside)
                require(size[axis] > 0, "own box")
        guided, follow = None, lambda: guide(source, tables.guide, count, schema[tables.guide]["type"].startswith("float"))
        if form & 1:
            places = []
            split(source, (0, 0, 0), size, count, places)
        elif not small:
            guided = follow() if tables.guide >= 0 else None
            distances = [column(source, len(schema) + axis, count, False, None, guided and guided[2])[1] for axis in range(3)]
            places = [tuple(value % WORD for value in place) for place in zip(*distances)]
        else:
            cells = rows(source, size, count)
            places = [(c, r, h) for (c, r), h in zip(cells, heights(source, size[2], cells))]
        require(len(places) == count, "number of points")
        require(all(0 <= p[axis] < size[axis] for p in places for axis in range(3)), "a point outside of its box")
        forms = (entry["forms"] // 484, entry["forms"] // 22 % 22, entry["forms"] % 22)
        self.points = [tuple(real(f, signed(a + k)) for f, a, k in zip(forms, low, p)) for p in places]
        guided = guided or (follow() if tables.guide >= 0 else None)
        self.attributes = columns(source, count, schema, guided)
        for (lowest, highest), channel, values in zip(entry["ranges"], schema, self.attributes):
            require(all(lowest <= key(channel["type"], value) <= highest for value in values), "range")
        self.children = [ordinals(source, below == level - 1, count) for below in reversed(range(level))]
        upper = source.raw(16) if count >= 65536 else 0
        place = upper << 16 | source.end()
        require(place < count and (not root or place == 0), "representative")
        self.representative = None if root else count // 2 + unzigzag(place)

    def move(self, base, shift):
        self.points = [tuple(c + by if by else c for c, by in zip(p, shift)) for p in self.points]
        self.children = [[below + by for below in level] for level, by in zip(self.children, reversed(base))]

    def members(self):
        return [k for k in range(len(self.points)) if k != self.representative]


class Level:
    def __init__(self, folder, number, levels, manifest):
        schema, grid = manifest["attributes"], manifest["kind"] == "grid"
        self.entries, self.clusters = [], []
        for segment in levels[number]["segments"]:
            self.segment(folder, number, levels, manifest, segment, schema, grid)
        require(len(self.clusters) == levels[number]["clusters"], "clusters of the segments")

    def segment(self, folder, number, levels, manifest, segment, schema, grid):
        files = {}
        for part in ("data", "index"):
            files[part] = (folder / segment[part]["file"]).read_bytes()
            require(len(files[part]) == segment[part]["bytes"], "file size")
            require("%08x" % zlib.crc32(files[part]) == segment[part]["crc32"], "file checksum")
        index, data = files["index"], files["data"]
        directory = Bytes(index[-segment["directory_bytes"]:], "directory checksum")
        total, entries = segment["clusters"], []
        each = 4 if number > 0 else 16 if grid else 64
        pages = (total + each - 1) // each
        offsets, boxes, at = self.chapters(index, directory, pages, segment.get("bounds", manifest["bounds"]))
        sets = []
        for _ in range(directory.varint()):
            first, size = directory.varint(), directory.varint()
            sets.append((first, Tables(Bytes(index[at:at + size + 4], "tables checksum").data, schema)))
            at += size + 4
        require(at == len(index) - segment["directory_bytes"], "tables")
        directory.done()
        for page in range(pages):
            data_of, count = index[offsets[page]:offsets[page + 1]], min(each, total - each * page)
            tables = [tables for first, tables in sets if first <= each * page][-1]
            entries += self.page(data_of, count, tables, len(schema), grid and number == 0)
        clusters = []
        for ordinal, entry in enumerate(entries):
            tables = [each for first, each in sets if first <= ordinal]
            body = data[entry["offset"]:entry["offset"] + entry["bytes"]]
            root = number == len(levels) - 1
            clusters.append(Cluster(body, entry, tables[-1], schema, number, root, grid) if entry["points"] else None)

        for ordinal, cluster in enumerate(clusters):
            if cluster:
                for box in boxes[ordinal // each]:
                    require(all(low <= place <= high for point in cluster.points
                                for place, low, high in zip(point, *box)), "a page's box")
                cluster.move(segment.get("base", [0] * number), segment.get("shift", [0] * 3))
        self.entries += entries
        self.clusters += clusters

    @staticmethod
    def chapters(index, directory, pages, bounds):
        """Returns the offsets of the pages, the boxes of each page and of its chapter, and where the tables begin."""
        def box(source, size, outer):
            most = 256 ** size - 1
            ends = [source.number(size) for _ in range(6)]
            return [[low * (1 - q / most) + high * (q / most) for low, high, q in zip(*outer, ends[side::2])]
                    for side in range(2)]

        outer = (bounds["min"], bounds["max"]) if bounds else ([0] * 3, [0] * 3)
        chapters = [(directory.varint(), directory.varint(), box(directory, 2, outer)) for _ in range((pages + 63) // 64)]
        at = sum(size for size, _, _ in chapters)
        offsets, boxes = [0], []
        for number, (size, of_contents, chapter) in enumerate(chapters):
            contents = Bytes(index[at:at + of_contents], "contents of a chapter")
            at += of_contents
            end = offsets[-1] + size
            for _ in range(min(64, pages - 64 * number)):
                offsets.append(offsets[-1] + contents.varint())
                boxes.append((box(contents, 1, chapter), chapter))
            contents.done()
            require(offsets[-1] == end, "the end of a chapter")
        return offsets, boxes, at

    @staticmethod
    def page(data, count, tables, attributes, raster):
        require(len(data) > 2 and crc16(data[:-2]) == int.from_bytes(data[-2:], "little"), "page checksum")
        source = Bytes(data[:-2] + struct.pack("<I", zlib.crc32(data[:-2])), "a page")
        offset = source.varint() << 16
        of_ranges = source.varint() if attributes else 0
        symbols = Symbols(source.take(len(source.data) - source.at - of_ranges), tables)
        first = tables.border + 50
        rows = [None] * 11 + [[0] * count]

        def numbers(column, contexts=None):
            """Returns the numbers of a column and their steps."""
            values, steps = [], [0]
            for k in range(count):
                value, c = symbols.number(first + 8 * column + (contexts[k] if contexts else steps[-1]))
                values.append(value)
                steps.append(step_of(c))
            return values, steps[1:]

        def sums(differences, value=0):
            values = []
            for difference in differences:
                value = signed(value + unzigzag(difference))
                values.append(value)
            return values

        def guessed(column, guess):
            rows[column] = []
            for k, difference in enumerate(numbers(column)[0]):
                rows[column].append((guess(k) + unzigzag(difference)) % WORD)

        def shift():
            s = symbols.number(first + 96)[0]
            require(s < 64, "shift")
            return s

        steps = None
        for axis in range(3):
            s = shift()
            sizes, size_steps = numbers(axis)
            rows[axis] = [(size + 1 << s) % WORD for size in sizes]
            lows, steps = numbers(3 + axis, (None, steps, size_steps)[axis])
            rows[3 + axis] = [signed(low << s) for low in sums(lows)]
        area = [x * y % WORD for x, y in zip(rows[0], rows[1])]
        guessed(7, lambda k: area[k] * 45 % WORD >> 6 if raster else rows[7][k - 1] if k else 0)
        guessed(6, lambda k: rows[6][k - 1] * rows[7][k] % WORD // max(rows[7][k - 1], 1) if k else 0)
        rows[9] = numbers(9)[0]

        def extent(k):
            double = struct.pack("<d", (rows[0][k] + rows[1][k]) % WORD)
            return int.from_bytes(double, "little") + (1 << 47) - 1 >> 47

        guessed(8, lambda k: rows[8][k - 1] + extent(k) - extent(k - 1) if k else extent(k))
        rows[10] = sums(numbers(10)[0])
        if raster:
            rows[11] = sums(numbers(11)[0])
        checksums = [symbols.raw(8 if raster else 16) for _ in range(count)]
        offset += symbols.end()
        ends = []
        symbols = Symbols(source.take(of_ranges), tables) if attributes else symbols
        for end in range(2 * attributes):
            s = shift()
            ones = (1 << s) - 1 if end % 2 else 0
            keys = sums([symbols.number(first + 97 + end)[0] for _ in range(count)], -(1 << 63) >> s)
            ends.append([(key << s | ones) % WORD for key in keys])
        require(not attributes or symbols.end() == 0, "end of the ranges")
        entries = []
        for k in range(count):
            offset += rows[11][k]
            entries.append({"offset": offset, "bytes": rows[6][k], "points": rows[7][k], "forms": rows[10][k],
                            "low": [rows[3 + axis][k] for axis in range(3)], "size": [rows[axis][k] for axis in range(3)],
                            "error": struct.unpack("<d", (rows[8][k] << 47).to_bytes(8, "little"))[0],
                            "descendants": rows[9][k], "checksum": checksums[k],
                            "ranges": [(low[k], high[k]) for low, high in zip(ends[::2], ends[1::2])]})
            offset += rows[6][k]
        return entries


class Store:
    def __init__(self, folder):
        folder = pathlib.Path(folder)
        text = (folder / "manifest.json").read_bytes()
        self.manifest = json.loads(text)
        require(self.manifest["format"] == "terrace-store" and self.manifest["version"] == 1, "not a store")
        self.checksum = self.manifest["checksum"]
        require(text[-12:] == b"%s\"\n}\n" % self.checksum.encode(), "end of the manifest")
        self.checksum = int(self.checksum, 16)
        require(zlib.crc32(text[:-12] + b"00000000\"\n}\n") == self.checksum, "manifest checksum")
        levels = self.manifest["levels"]
        self.levels = [Level(folder, k, levels, self.manifest) for k in range(len(levels))]

    def points(self):
        """Returns level and ordinal of its cluster, coordinates and attributes of every point."""
        for number, level in enumerate(self.levels):
            for ordinal, cluster in enumerate(level.clusters):
                for k in cluster.members() if cluster else ():
                    yield (number, ordinal) + cluster.points[k] + tuple(column[k] for column in cluster.attributes)


def overlay(path, store):
    data = pathlib.Path(path).read_bytes()
    require(data[:16] == b"terrace overlay\n", "not an overlay")
    length = struct.unpack_from("<I", data, 40)[0]
    header = Bytes(data[:44 + length + 4], "overlay header")
    header.take(16)
    require(header.number(4) == 1 and header.number(4) == store.checksum, "of another store or version")
    pages, directory_at = header.number(8), header.number(8)
    directory = Bytes(data[directory_at:], "overlay directory")
    places = [(directory.number(8), directory.number(8), directory.number(4)) for _ in range(pages)] + [(0, directory_at, 0)]
    directory.done()
    for (first, begin, total), (_, end, _) in zip(places, places[1:]):
        page = Bytes(data[begin:end], "overlay page")
        ids, cluster = [], 0
        for _ in range(page.number(4)):
            cluster += page.varint()
            index = -1
            for _ in range(page.varint()):
                index += page.varint() + (1 if index >= 0 else 1)
                ids.append((cluster >> 56, cluster & ((1 << 56) - 1), index))
        require(len(ids) == total and first == ids[0][0] << 56 | ids[0][1], "overlay page")
        for place in ids:
            yield place + struct.unpack("<d", page.take(8))
        page.done()


if __name__ == "__main__":
    store = Store(sys.argv[1])
    for row in overlay(sys.argv[2], store) if len(sys.argv) > 2 else store.points():
        print(*(repr(value) for value in row))
