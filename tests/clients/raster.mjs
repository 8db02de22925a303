// SPDX-License-Identifier: GPL-3.0-or-later
// Writes elevation models at places for which the tests have no real data.

import {writeFileSync} from 'node:fs';

export const GEOGRAPHIC =
    [1, 1, 0, 4, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326, 2054, 0, 1, 9102];
/// Polar stereographic, EPSG:3413.
export const ARCTIC =
    [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 3413, 3076, 0, 1, 9001];

/// Writes a GeoTIFF of float32 in one strip with square cells, starting at its north-western
/// corner. height(column, row) returns NaN where there is no data.
export function writeRaster(path, {columns, rows, west, north, cell, keys, height}) {
  const heights = new Float32Array(columns * rows);
  for (let row = 0; row < rows; ++row) {
    for (let column = 0; column < columns; ++column) {
      const value = height(column, row);
      heights[row * columns + column] = Number.isNaN(value) ? -9999 : value;
    }
  }
  const body = Buffer.from(heights.buffer);
  const external = [];
  let end = 8 + body.length;
  const put = bytes => {
    const at = end;
    external.push(bytes);
    end += bytes.length;
    return at;
  };
  const doubles = list => put(Buffer.from(new Float64Array(list).buffer));
  const tags = [
    [256, 4, 1, columns], [257, 4, 1, rows], [258, 3, 1, 32], [259, 3, 1, 1], [262, 3, 1, 1],
    [273, 4, 1, 8], [277, 3, 1, 1], [278, 4, 1, rows], [279, 4, 1, body.length], [339, 3, 1, 3],
    [33550, 12, 3, doubles([cell, cell, 0])], [33922, 12, 6, doubles([0, 0, 0, west, north, 0])],
    [34735, 3, keys.length, put(Buffer.from(new Uint16Array(keys).buffer))],
    [42113, 2, 6, put(Buffer.from('-9999\0'))]
  ];
  const directory = Buffer.alloc(6 + 12 * tags.length);
  directory.writeUInt16LE(tags.length);
  tags.forEach(([tag, kind, count, value], i) => {
    directory.writeUInt16LE(tag, 2 + 12 * i);
    directory.writeUInt16LE(kind, 4 + 12 * i);
    directory.writeUInt32LE(count, 6 + 12 * i);
    directory.writeUInt32LE(value, 10 + 12 * i);
  });
  const head = Buffer.alloc(8);
  head.write('II');
  head.writeUInt16LE(42, 2);
  head.writeUInt32LE(end, 4);
  writeFileSync(path, Buffer.concat([head, body, ...external, directory]));
}

/// Hills and ridges some hundred metres high: the height at a column and row.
export function hills(column, row) {
  return 600 + 250 * Math.sin(column / 9 + row / 31) * Math.cos(row / 13) +
      120 * Math.sin(column / 3.7) * Math.sin(row / 4.3 + column / 50) +
      (column * 7 + row * 13) % 11;
}
