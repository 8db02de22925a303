// SPDX-License-Identifier: GPL-3.0-or-later
/// What clicked places measure together: areas, angles, and boxes. All figures are those of the store, not of the picture.

import {dot, unit, type Vec3} from './camera';
import type {Place} from './place';
import type {Scene} from './scene';
import {areaOnEarth, inDegrees, lengthOnEarth, metresPerDegree, worldPoint} from './store';
import {rounded, squareMetres} from './text';

export const MEASURES = ['profile', 'area', 'angle', 'region'] as const;
export type Measure = typeof MEASURES[number];

export const HINTS: Record<Measure, string> = {
  profile: 'Two clicks show the profile between them.',
  area: 'Click the corners of an area, in order.',
  angle: 'Three clicks show the angle at the second.',
  region: 'Click two corners of a box, then choose its level.'
};

/// Returns rows for the panel: the border and the area of the polygon, on the map, or on the ellipsoid for degrees.
export function areaRows(scene: Scene, places: Place[]): Array<[string, string]> {
  if (places.length < 3) return [];
  const manifest = scene.manifest!, corners = places.map(({stored}) => worldPoint(manifest, stored));
  if (crossesItself(corners)) return [['Area', 'none, because the lines cross']];
  const next = <T>(list: T[], i: number) => list[(i + 1) % list.length];
  const border = places.reduce((sum, {place: from}, i) => {
    const {place: to} = next(places, i);
    return sum + (lengthOnEarth(manifest, corners[i], next(corners, i)) ?? Math.hypot(to[0] - from[0], to[1] - from[1]));
  }, 0);
  const [origin] = places;
  const area = inDegrees(manifest) ? areaOnEarth(corners) : Math.abs(places.reduce((sum, {place: a}, i) => {
    const {place: b} = next(places, i);
    return sum + ((a[0] - origin.place[0]) * (b[1] - origin.place[1]) - (b[0] - origin.place[0]) * (a[1] - origin.place[1])) / 2;
  }, 0));
  return [['Border', scene.ground(border)], ['Area', manifest.crs.horizontal_unit ? squareMetres(area) : rounded(area)]];
}

/// Returns a row with the angle in space at the last but one place.
export function angleRows(scene: Scene, places: Place[]): Array<[string, string]> {
  if (places.length < 3) return [];
  const [a, middle, b] = places.slice(-3);
  if ([a, middle, b].some(({state}) => state === 'none')) return [['Angle', 'none, because a place has no height']];
  if ([a, middle, b].some(({state}) => state === 'pending')) return [['Angle', 'reading']];
  const [to, from] = [a, b].map(place => offset(scene, middle, place));
  if (dot(to, to) === 0 || dot(from, from) === 0) return [];
  const angle = Math.acos(Math.min(1, Math.max(-1, dot(unit(to), unit(from))))) * 180 / Math.PI;
  return [['Angle', `${angle.toFixed(1)}°`]];
}

/// Returns the way between two places in metres, without the exaggeration of heights.
function offset(scene: Scene, from: Place, to: Place): Vec3 {
  const [x, y, z] = to.place.map((c, i) => c - from.place[i]), up = z / scene.look.exaggeration, manifest = scene.manifest!;
  if (!inDegrees(manifest)) return [x, y, up];
  // The view frame measures degrees at the middle of the store.
  const [a, b] = [from, to].map(({stored}) => worldPoint(manifest, stored)), [east, north] = metresPerDegree(a[1]);
  return [(b[0] - a[0]) * east, (b[1] - a[1]) * north, up];
}

function crossesItself(corners: number[][]): boolean {
  const side = (a: number[], b: number[], p: number[]) => Math.sign((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]));
  const count = corners.length;
  for (let i = 0; i < count; ++i) {
    for (let j = i + 2; j < count; ++j) {
      if (i === 0 && j === count - 1) continue;
      const [a, b, c, d] = [corners[i], corners[i + 1], corners[j], corners[(j + 1) % count]];
      if (side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0) return true;
    }
  }
  return false;
}

/// Returns the corners of the box between two places: west, south, east, north.
export function boxBetween({place: a}: Place, {place: b}: Place): number[] {
  return [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[0], b[0]), Math.max(a[1], b[1])];
}

/// Returns the edges of the region as lines, from the lowest to the highest point of the store.
export function regionEdges({region, box}: Scene): number[][][] {
  if (!region) return [];
  const [west, south, east, north] = region.corners, around = [[west, south], [east, south], [east, north], [west, north], [west, south]];
  return [
    ...[box[2], box[5]].map(z => around.map(([x, y]) => [x, y, z])),
    ...around.slice(1).map(([x, y]) => [[x, y, box[2]], [x, y, box[5]]])
  ];
}
