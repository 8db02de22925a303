// SPDX-License-Identifier: GPL-3.0-or-later
/// What the viewer knows of a store before the core reads it: its manifest, and the start file that `terrace publish` and
/// `terrace view` put next to the store.

import type {ByteRange} from './core';

/// A store of a published folder, from its stores.json.
export interface Listed {
  name: string;
  points: number;
}

export interface Channel {
  name: string;
  type: string;
  unit: string;
  scale: number;
  offset: number;
}

export interface Manifest {
  kind: 'grid'|'cloud';
  points: number;
  checksum: string;
  bounds: {min: number[], max: number[]};  ///< stored coordinates
  world: number[];
  coordinates: Channel[];
  attributes: Channel[];
  crs: {epsg: number, name: string, geographic: boolean, horizontal_unit: string, vertical_unit: string};
  levels: Array<{level: number, points: number}>;
  parameters: Array<{name: string, value: string}>;
  files: Map<string, number>;  ///< sizes by name
}

export function parseManifest(bytes: Uint8Array): Manifest {
  const json = JSON.parse(new TextDecoder().decode(bytes));
  if (json.format !== 'terrace-store') throw new Error('manifest.json: not a store manifest');
  const files = new Map<string, number>([['manifest.json', bytes.length]]);
  for (const level of json.levels) {
    for (const segment of level.segments) {
      for (const file of [segment.data, segment.index]) files.set(file.file, file.bytes);
    }
  }
  if (json.surface) files.set(json.surface.data.file, json.surface.data.bytes);
  return {...json, files};
}

/// The parts of a store that the first picture needs, in one file: a line of JSON, then the bytes of the parts in order,
/// compressed in zlib format.
export interface Start {
  ground: number[];    ///< from stored coordinates to metres
  classes?: number[];  ///< of all points, if known
  parts: Array<ByteRange&{data: Uint8Array}>;
}

export async function parseStart(bytes: Uint8Array<ArrayBuffer>): Promise<Start> {
  const end = bytes.indexOf(10);
  const head = end < 0 ? {} : JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  if (head.format !== 'terrace-start' || head.version !== 2) throw new Error('not a start file of this version');
  const unpacked = new Blob([bytes.subarray(end + 1)]).stream().pipeThrough(new DecompressionStream('deflate'));
  const body = new Uint8Array(await new Response(unpacked).arrayBuffer());
  const parts: Start['parts'] = [];
  let at = 0;
  for (const [file, offset, size] of head.parts as Array<[string, number, number]>) {
    parts.push({file, offset, bytes: size, data: body.subarray(at, at + size)});
    at += size;
  }
  if (at !== body.length) throw new Error(`${body.length} bytes received instead of ${at}`);
  return {ground: head.ground, classes: head.classes, parts};
}

/// Converts stored coordinates to CRS coordinates.
export function worldPoint(manifest: Manifest, stored: number[]): number[] {
  const w = manifest.world, z = manifest.coordinates[2];
  return [
    stored[0] * w[0] + stored[1] * w[1] + w[2], stored[0] * w[3] + stored[1] * w[4] + w[5],
    stored[2] * z.scale + z.offset
  ];
}

/// Converts a horizontal position in the CRS to stored coordinates.
export function storedPoint(manifest: Manifest, [x, y]: number[]): [number, number] {
  const [a, b, c, d, e, f] = manifest.world, det = a * e - b * d;
  return [((x - c) * e - (y - f) * b) / det, ((y - f) * a - (x - c) * d) / det];
}

const RADIUS = 6378137, SQUARE = 0.00669437999014;  // WGS 84: equatorial radius in metres, squared eccentricity
const DEGREE = Math.PI / 180;

/// Returns whether positions are longitudes and latitudes in degrees.
export function inDegrees({crs}: Manifest): boolean {
  return crs.geographic && crs.horizontal_unit === 'degree';
}
/// Returns metres on the WGS 84 ellipsoid per degree of longitude and of latitude.
export function metresPerDegree(latitude: number): [number, number] {
  const w = Math.sqrt(1 - SQUARE * Math.sin(latitude * DEGREE) ** 2);
  return [RADIUS / w * Math.cos(latitude * DEGREE) * DEGREE, RADIUS * (1 - SQUARE) / w ** 3 * DEGREE];
}
/// Returns the length in metres, on the WGS 84 ellipsoid, of the line between two places of the CRS that is straight in
/// longitude and latitude; null if coordinates are not degrees.
export function lengthOnEarth(manifest: Manifest, from: number[], to: number[]): number|null {
  if (!inDegrees(manifest)) return null;
  const PIECES = 256, east = (to[0] - from[0]) / PIECES, north = (to[1] - from[1]) / PIECES;
  let metres = 0;
  for (let i = 0; i < PIECES; ++i) {
    const [x, y] = metresPerDegree(from[1] + (i + 0.5) * north);
    metres += Math.hypot(y * north, x * east);
  }
  return metres;
}
/// Returns the area in square metres, on the WGS 84 ellipsoid, of a polygon whose edges are straight in longitude and latitude.
export function areaOnEarth(polygon: number[][]): number {
  const PIECES = 256, e = Math.sqrt(SQUARE);
  // The area between the equator and a latitude, per radian of longitude.
  const zone = (latitude: number) => {
    const s = Math.sin(latitude * DEGREE);
    return RADIUS ** 2 * (1 - SQUARE) / 2 * (s / (1 - SQUARE * s * s) + Math.atanh(e * s) / e);
  };
  // Differences from the first corner's zone keep digits of small polygons.
  const base = zone(polygon[0][1]);
  let area = 0;
  polygon.forEach((from, i) => {
    const to = polygon[(i + 1) % polygon.length];
    const east = (to[0] - from[0]) * DEGREE / PIECES, north = (to[1] - from[1]) / PIECES;
    for (let piece = 0.5; piece < PIECES; ++piece) area += (zone(from[1] + piece * north) - base) * east;
  });
  return Math.abs(area);
}
