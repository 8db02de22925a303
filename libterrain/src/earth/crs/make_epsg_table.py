#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes epsg_data.cpp: the EPSG codes that the command knows, from PROJ's database (proj-data).

make_epsg_table.py [/usr/share/proj/proj.db] > epsg_data.cpp

Taken are the geographic, projected, vertical and compound systems that are not deprecated, have a
method of projection.hpp, and axes that point east and north (up for heights). The EPSG dataset is
that of the International Association of Oil & Gas Producers (epsg.org).
"""

import sqlite3
import sys

METHODS = {9807: 'transverse_mercator', 9801: 'lambert_1sp', 9802: 'lambert_2sp', 9822: 'albers',
           9810: 'polar_stereographic_a', 9829: 'polar_stereographic_b',
           9820: 'lambert_azimuthal', 1024: 'web_mercator', 9804: 'mercator_a', 9805: 'mercator_b',
           9809: 'oblique_stereographic', 9812: 'hotine_a', 9815: 'hotine_b'}
# EPSG's parameters: their place in ProjectionParameters.
PLACES = {8801: 0, 8821: 0, 8811: 0, 8802: 1, 8822: 1, 8833: 1, 8812: 1, 8805: 2, 8815: 2,
          8823: 3, 8832: 3, 8824: 4, 8813: 5, 8814: 6, 8806: 7, 8826: 7, 8816: 7,
          8807: 8, 8827: 8, 8817: 8}
ALIGNED = ('World Geodetic System 1984 (', 'International Terrestrial Reference Frame',
           'European Terrestrial Reference Frame')

database = sqlite3.connect(sys.argv[1] if len(sys.argv) > 1 else '/usr/share/proj/proj.db')


def rows(sql):
    return database.execute(sql).fetchall()


UNITS = {code: factor for code, factor in rows(
    "SELECT code, conv_factor FROM unit_of_measure WHERE auth_name = 'EPSG'")}
RADIAN_DEGREES = 57.295779513082320877


def number(value):
    text = repr(float(value))
    return text[:-2] if text.endswith('.0') else text


def exact(value):
    """Angles and lengths with what the conversion from their unit left in the last digits cut."""
    return float(f'{value:.15g}')


def angle(value, unit):
    if unit == 9110:  # sexagesimal DDD.MMSSsss
        text = f'{abs(value):.12f}'
        degrees, rest = text.split('.')
        result = int(degrees) + int(rest[:2]) / 60 + float(rest[2:4] + '.' + rest[4:]) / 3600
        return exact(-result if value < 0 else result)
    if unit == 9102:
        return value
    return exact(value * UNITS[unit] * RADIAN_DEGREES)


def quoted(text):
    return '"' + text.replace('\\', '\\\\').replace('"', '\\"') + '"'


def axes():
    """Coordinate system -> ([orientations in order], unit)."""
    found = {}
    for system, orientation, name, unit in rows(
            "SELECT coordinate_system_code, orientation, name, uom_code FROM axis "
            "WHERE coordinate_system_auth_name = 'EPSG' "
            "ORDER BY coordinate_system_code, coordinate_system_order"):
        directions, _ = found.setdefault(system, ([], unit))
        # A polar system's axes point along meridians; they are named all the same.
        along = {'Easting': 'east', 'Northing': 'north'}
        directions.append(along.get(name, '') if ' along ' in orientation else orientation)
    return found


AXES = axes()


def geographic():
    ellipsoids, lines, kept = [], [], {}
    accuracy = dict(rows("""
        SELECT g.datum_code, min(h.accuracy) FROM helmert_transformation_table h
        JOIN geodetic_crs g ON g.auth_name = 'EPSG' AND g.code = h.source_crs_code
        WHERE h.auth_name = 'EPSG' AND h.target_crs_code = 4326 AND h.deprecated = 0
          AND h.tx = 0 AND h.ty = 0 AND h.tz = 0 AND coalesce(h.rx, 0) = 0
          AND coalesce(h.ry, 0) = 0 AND coalesce(h.rz, 0) = 0
          AND coalesce(h.scale_difference, 0) = 0 GROUP BY g.datum_code"""))
    for code, name, kind, system, datum, datum_name, ensemble, a, a_unit, inverse, b, meridian, m_unit in rows("""
            SELECT g.code, g.name, g.type, g.coordinate_system_code, d.code, d.name,
                   d.ensemble_accuracy, e.semi_major_axis, e.uom_code, e.inv_flattening,
                   e.semi_minor_axis, m.longitude, m.uom_code
            FROM geodetic_crs g
            JOIN geodetic_datum d ON d.auth_name = 'EPSG' AND d.code = g.datum_code
            JOIN ellipsoid e ON e.auth_name = 'EPSG' AND e.code = d.ellipsoid_code
            JOIN prime_meridian m ON m.auth_name = 'EPSG' AND m.code = d.prime_meridian_code
            WHERE g.auth_name = 'EPSG' AND g.deprecated = 0 AND g.type LIKE 'geographic%'
            ORDER BY g.code"""):
        directions, unit = AXES[system]
        if sorted(directions[:2]) != ['east', 'north'] or directions[2:] not in ([], ['up']):
            continue
        a *= UNITS[a_unit]
        flattening = inverse if inverse else 0 if b is None else a / (a - b * UNITS[a_unit])
        ellipsoid = (exact(a), exact(flattening))
        if ellipsoid not in ellipsoids:
            ellipsoids.append(ellipsoid)
        uncertainty = accuracy.get(datum, -1)
        if datum == 6326 or datum_name.startswith(ALIGNED):
            uncertainty = max(1.0, ensemble or 0)
        scale = 1 if unit in (9102, 9122) else UNITS[unit] * RADIAN_DEGREES
        kept[code] = name
        lines.append(f'{{{code}, {ellipsoids.index(ellipsoid)}, {number(angle(meridian, m_unit))}, '
                     f'{number(exact(scale))}, {number(uncertainty)}, '
                     f'{"true" if len(directions) == 3 else "false"}, {quoted(name)}, '
                     f'{quoted(datum_name)}}},')
    return ellipsoids, lines, kept


def conversions():
    lines, kept = [], {}
    columns = ', '.join(f'param{i}_code, param{i}_value, param{i}_uom_code' for i in range(1, 8))
    for code, name, method, *parameters in rows(
            f"SELECT code, name, method_code, {columns} FROM conversion_table "
            "WHERE auth_name = 'EPSG' AND deprecated = 0 ORDER BY code"):
        if method not in METHODS:
            continue
        values = [0.0, 0.0, 1.0] + [0.0] * 6
        for parameter, value, unit in zip(parameters[::3], parameters[1::3], parameters[2::3]):
            if parameter is None:
                continue
            place = PLACES[parameter]
            values[place] = (value * UNITS[unit] if place == 2 else
                             exact(value * UNITS[unit]) if place > 6 else angle(value, unit))
        kept[code] = (name, method,
                      f'{{{code}, ProjectionMethod::{METHODS[method]}, '
                      f'{{{", ".join(map(number, values))}}}, {quoted(name)}}},')
    return kept


def main():
    ellipsoids, geographic_lines, bases = geographic()
    known = conversions()
    used, projected, horizontal = set(), [], set(bases)
    for code, name, system, base, conversion in rows("""
            SELECT code, name, coordinate_system_code, geodetic_crs_code, conversion_code
            FROM projected_crs WHERE auth_name = 'EPSG' AND deprecated = 0 ORDER BY code"""):
        if conversion not in known or base not in bases:
            continue
        directions, unit = AXES[system]
        if sorted(directions) != ['east', 'north']:
            continue
        used.add(conversion)
        horizontal.add(code)
        usual = f'{bases[base]} / {known[conversion][0]}'
        projected.append(f'{{{code}, {base}, {conversion}, {number(UNITS[unit])}, '
                         f'{"nullptr" if name == usual else quoted(name)}}},')
    vertical, heights = [], set()
    for code, name, system in rows("SELECT code, name, coordinate_system_code FROM vertical_crs "
                                   "WHERE auth_name = 'EPSG' AND deprecated = 0 ORDER BY code"):
        directions, unit = AXES[system]
        if directions == ['up']:
            heights.add(code)
            vertical.append(f'{{{code}, {number(UNITS[unit])}, {quoted(name)}}},')
    compound = [f'{{{code}, {a}, {b}}},' for code, a, b in rows(
        "SELECT code, horiz_crs_code, vertical_crs_code FROM compound_crs "
        "WHERE auth_name = 'EPSG' AND deprecated = 0 ORDER BY code")
        if a in horizontal and b in heights]
    version = rows("SELECT value FROM metadata WHERE key = 'EPSG.VERSION'")[0][0]

    def table(kind, name, lines):
        print(f'constexpr {kind} {name}[] = {{')
        row = ''
        for line in lines:
            if row and len(row) + 1 + len(line) > 96:
                print('    ' + row)
                row = ''
            row += (' ' if row else '') + line
        print('    ' + row)
        print('};\n')

    print('// SPDX-License-Identifier: GPL-3.0-or-later')
    print(f'// Generated by make_epsg_table.py from the EPSG dataset {version} in PROJ\'s database.')
    print('// clang-format off')
    print('#include "epsg_table.hpp"\n\nnamespace terrace::terrain {\nnamespace {\n')
    table('Ellipsoid', 'kEllipsoids', [f'{{{number(a)}, {number(f)}}},' for a, f in ellipsoids])
    table('EpsgGeographic', 'kGeographic', geographic_lines)
    table('EpsgConversion', 'kConversions', [known[code][2] for code in sorted(used)])
    table('EpsgProjected', 'kProjected', projected)
    table('EpsgVertical', 'kVertical', vertical)
    table('EpsgCompound', 'kCompound', compound)
    print('}  // namespace\n')
    print('const EpsgTables& epsg_tables() {')
    print('  static constexpr EpsgTables tables{kEllipsoids, kGeographic, kConversions,')
    print('                                     kProjected, kVertical, kCompound};')
    print('  return tables;\n}\n')
    print('}  // namespace terrace::terrain')


main()
