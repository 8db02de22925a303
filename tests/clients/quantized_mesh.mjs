// SPDX-License-Identifier: GPL-3.0-or-later
// Reads tiles of quantized-mesh 1.0, written from the specification.

import {readdirSync, readFileSync} from 'node:fs';
import {join} from 'node:path';
import {gunzipSync} from 'node:zlib';

export const UNITS = 32767;

/// The bytes of a tile's file as a client receives them.
export function tileBytes(path) {
  const bytes = readFileSync(path);
  return bytes[0] === 0x1f && bytes[1] === 0x8b ? gunzipSync(bytes) : bytes;
}

export function decodeTile(bytes) {
  let at = 0;
  const take = (size, get) => {
    const value = get.call(bytes, at);
    at += size;
    return value;
  };
  const f64 = () => take(8, bytes.readDoubleLE);
  const f32 = () => take(4, bytes.readFloatLE);
  const u32 = () => take(4, bytes.readUInt32LE);
  const u16 = () => take(2, bytes.readUInt16LE);
  const list = (count, get) => Array.from({length: count}, get);

  const header = {
    centre: list(3, f64),
    lowest: f32(),
    highest: f32(),
    sphere: list(4, f64),
    horizon: list(3, f64)
  };
  const size = u32();
  const deltas = () => {
    let value = 0;
    return list(size, () => {
      const code = u16();
      value += code % 2 ? -(code + 1) / 2 : code / 2;
      return value;
    });
  };
  const tile = {...header, u: deltas(), v: deltas(), height: deltas()};
  const wide = size > 65536;
  if (wide && at % 4) at += 2;
  const index = wide ? u32 : u16;
  let next = 0;
  tile.triangles = list(3 * u32(), () => {
    const code = index();
    return code === 0 ? next++ : next - code;
  });
  for (const side of ['west', 'south', 'east', 'north']) tile[side] = list(u32(), index);
  tile.extensions = {};
  while (at < bytes.length) {
    const kind = bytes[at++];
    const length = u32();
    tile.extensions[kind] = bytes.subarray(at, at += length);
  }
  if (at !== bytes.length) throw new Error(`a tile of ${bytes.length} bytes ends at ${at}`);
  return tile;
}

/// The height at (u, v), between 0 and UNITS; undefined if no triangle covers it.
export function heightAt(tile, u, v) {
  const {triangles} = tile;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.slice(t, t + 3);
    const side = (i, j) =>
        (tile.u[j] - tile.u[i]) * (v - tile.v[i]) - (tile.v[j] - tile.v[i]) * (u - tile.u[i]);
    const [over, right, left] = [side(b, c), side(c, a), side(a, b)];
    const whole = over + right + left;
    // Rounding may put a point on an edge outside both triangles.
    if (Math.min(over, right, left) < -1e-9 * whole) continue;
    const height = (over * tile.height[a] + right * tile.height[b] + left * tile.height[c]) / whole;
    return tile.lowest + (tile.highest - tile.lowest) * height / UNITS;
  }
  return undefined;
}

/// A folder of tiles in the geographic tiling scheme, with two tiles at zoom 0.
export class TileSet {
  constructor(folder) {
    this.folder = folder;
    this.layer = JSON.parse(readFileSync(join(folder, 'layer.json'), 'utf8'));
    this.tiles = new Map();  // 'z/x/y' to the tile; undefined until read
    for (const name of readdirSync(folder, {recursive: true})) {
      if (name.endsWith('.terrain')) this.tiles.set(name.slice(0, -'.terrain'.length), undefined);
    }
    this.deepest = Math.max(...[...this.tiles.keys()].map(key => parseInt(key)));
  }

  has(z, x, y) {
    return this.tiles.has(`${z}/${x}/${y}`);
  }

  tile(z, x, y) {
    const key = `${z}/${x}/${y}`;
    if (!this.tiles.get(key))
      this.tiles.set(key, decodeTile(tileBytes(join(this.folder, `${key}.terrain`))));
    return this.tiles.get(key);
  }

  /// The x and y of the tiles at zoom z.
  at(z) {
    return [...this.tiles.keys()]
        .map(key => key.split('/').map(Number))
        .filter(([zoom]) => zoom === z)
        .map(([, x, y]) => [x, y]);
  }

  /// The deepest tile at a place.
  deepestAt(longitude, latitude) {
    for (let z = this.deepest; z >= 0; --z) {
      const side = 180 / 2 ** z;
      const x = Math.floor((longitude + 180) / side), y = Math.floor((latitude + 90) / side);
      if (this.has(z, x, y)) return {z, x, y};
    }
    throw new Error(`no tile at ${longitude}, ${latitude}`);
  }

  /// The height in tile z/x/y at a position in it, and half of its height step.
  height({z, x, y}, longitude, latitude) {
    const side = 180 / 2 ** z;
    const tile = this.tile(z, x, y);
    const within = value => Math.min(Math.max(value, 0), 1) * UNITS;
    const height =
        heightAt(tile, within((longitude + 180) / side - x), within((latitude + 90) / side - y));
    return {height, rounding: (tile.highest - tile.lowest) / UNITS / 2};
  }
}
