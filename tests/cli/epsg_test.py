#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every EPSG code of the tools' table against PROJ, which is called as a library.

TRANSFORM=path/to/transform_places TABLE=path/to/epsg_data.cpp epsg_test.py
Skips where PROJ and its database are not installed.
"""

import ctypes
import os
import re
import subprocess
import sys
import unittest

SKIPPED = 77
PER_CODE = 9


class Area(ctypes.Structure):
    pass


def load_proj():
    for name in ('libproj.so.25', 'libproj.so.22', 'libproj.so'):
        try:
            proj = ctypes.CDLL(name)
        except OSError:
            continue
        pointer = ctypes.c_void_p
        text = ctypes.c_char_p
        proj.proj_context_create.restype = pointer
        proj.proj_context_create.argtypes = []
        proj.proj_create.restype = pointer
        proj.proj_create.argtypes = [pointer, text]
        proj.proj_crs_get_geodetic_crs.restype = pointer
        proj.proj_crs_get_geodetic_crs.argtypes = [pointer, pointer]
        proj.proj_create_crs_to_crs_from_pj.restype = pointer
        proj.proj_create_crs_to_crs_from_pj.argtypes = [pointer] * 5
        proj.proj_normalize_for_visualization.restype = pointer
        proj.proj_normalize_for_visualization.argtypes = [pointer] * 2
        proj.proj_get_area_of_use.argtypes = [pointer, pointer] + [
            ctypes.POINTER(ctypes.c_double)] * 4 + [pointer]
        size, doubles = ctypes.c_size_t, ctypes.POINTER(ctypes.c_double)
        proj.proj_trans_generic.restype = size
        proj.proj_trans_generic.argtypes = [pointer, ctypes.c_int] + [doubles, size, size] * 4
        proj.proj_destroy.argtypes = [pointer]
        proj.proj_log_level.argtypes = [pointer, ctypes.c_int]
        proj.proj_context_set_enable_network.argtypes = [pointer, ctypes.c_int]
        context = proj.proj_context_create()
        proj.proj_log_level(context, 0)
        crs = proj.proj_create(context, b'EPSG:4326')
        if crs:
            proj.proj_destroy(crs)
            return proj, context
    return None


LOADED = load_proj()


def table_codes():
    with open(os.environ['TABLE'], encoding='utf-8') as file:
        text = file.read()
    rows = {}
    for kind in ('Geographic', 'Projected'):
        part = re.search(r'kEllipsoids' if not kind else rf'constexpr Epsg{kind} .*?\n}};', text,
                         re.DOTALL).group(0)
        rows[kind] = [int(code) for code in re.findall(r'\{(\d+), \d', part)]
    return rows


class Proj:
    """A projected or geographic system, from its own longitude and latitude from Greenwich."""

    def __init__(self, code):
        self.proj, self.context = LOADED
        proj, context = LOADED
        self.crs = proj.proj_create(context, f'EPSG:{code}'.encode())
        values = [ctypes.c_double() for _ in range(4)]
        known = self.crs and proj.proj_get_area_of_use(context, self.crs,
                                                       *[ctypes.byref(v) for v in values], None)
        self.area = [v.value for v in values] if known else None
        self.base = proj.proj_crs_get_geodetic_crs(context, self.crs) if self.crs else None

    def transform(self, places):
        proj, context = LOADED
        operation = proj.proj_create_crs_to_crs_from_pj(context, self.base, self.crs, None, None)
        normal = proj.proj_normalize_for_visualization(context, operation)
        count = len(places)
        x = (ctypes.c_double * count)(*[p[0] for p in places])
        y = (ctypes.c_double * count)(*[p[1] for p in places])
        none = ctypes.POINTER(ctypes.c_double)()
        proj.proj_trans_generic(normal, 1, x, 8, count, y, 8, count, none, 0, 0, none, 0, 0)
        proj.proj_destroy(normal)
        proj.proj_destroy(operation)
        return list(zip(x, y))

    def close(self):
        for thing in (self.base, self.crs):
            if thing:
                self.proj.proj_destroy(thing)


def sample(area):
    """Places within the area of use, its corners a little inward."""
    west, south, east, north = area
    if east < west:
        east += 360
    steps = (0.01, 0.5, 0.99)
    return [((west + u * (east - west) + 180) % 360 - 180, south + v * (north - south))
            for u in steps for v in steps]


class EpsgTest(unittest.TestCase):
    def test_every_projected_code_is_within_a_millimetre_of_proj(self):
        codes = table_codes()['Projected']
        self.assertGreater(len(codes), 4000)
        meridians = prime_meridians()
        asked, expected, lines = [], [], []
        for code in codes:
            system = Proj(code)
            self.assertTrue(system.crs, f'PROJ does not know EPSG:{code}')
            if system.area is None:
                system.close()
                continue
            places = sample(system.area)
            meridian, unit = meridians[code]
            # PROJ's geographic system counts from its own meridian in its own unit.
            expected += system.transform([((p[0] - meridian) / unit, p[1] / unit) for p in places])
            asked += [(code, p) for p in places]
            lines += [f'EPSG:{code} {p[0]!r} {p[1]!r}' for p in places]
            system.close()
        result = subprocess.run([os.environ['TRANSFORM']], input='\n'.join(lines),
                                capture_output=True, text=True, timeout=200)
        self.assertEqual(result.returncode, 0, result.stderr)
        answers = result.stdout.splitlines()
        self.assertEqual(len(answers), len(asked))
        units = {code: unit for code, unit in projected_units()}
        worst, compared, bad, lost = 0.0, 0, {}, {}
        for (code, place), (x, y), answer in zip(asked, expected, answers):
            u, v, longitude, latitude = map(float, answer.split())
            if not abs(x) < 1e29:
                continue
            compared += 1
            difference = max(abs(x - u), abs(y - v)) * units[code]
            if not difference <= 1e-3:
                bad.setdefault(code, []).append((place, (x, y), (u, v)))
            worst = max(worst, difference)
            turn = (longitude - place[0] + 180) % 360 - 180
            # A millionth of a millimetre is 1e-14 degrees; 0.01 mm is asked.
            if abs(latitude - place[1]) > 1e-10 or (abs(place[1]) < 89 and abs(turn) > 1e-9):
                lost.setdefault(code, []).append((place, (longitude, latitude)))
        for code, cases in bad.items():
            print(code, len(cases), cases[0], file=sys.stderr)
        for code, cases in lost.items():
            print(code, 'there and back', len(cases), cases[0], file=sys.stderr)
        self.assertEqual(len(bad) + len(lost), 0)
        self.assertGreater(compared, 0.98 * PER_CODE * len(codes))
        print(f'{compared} places of {len(codes)} codes, at most {worst * 1e3:.6f} mm off')


def rows_of(kind):
    with open(os.environ['TABLE'], encoding='utf-8') as file:
        text = file.read()
    part = re.search(rf'constexpr Epsg{kind} .*?\n}};', text, re.DOTALL).group(0)
    return re.findall(r'\{(\d[^{}"]*)', part)


def projected_units():
    for row in rows_of('Projected'):
        fields = row.split(',')
        yield int(fields[0]), float(fields[3])


def prime_meridians():
    base = {}
    for row in rows_of('Geographic'):
        fields = row.split(',')
        base[int(fields[0])] = float(fields[2]), float(fields[3])
    return {int(r.split(',')[0]): base[int(r.split(',')[1])] for r in rows_of('Projected')}


if __name__ == '__main__':
    if LOADED is None:
        print('PROJ (libproj25, proj-data) is not installed: nothing is compared')
        sys.exit(SKIPPED)
    unittest.main()
