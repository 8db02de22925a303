// SPDX-License-Identifier: GPL-3.0-or-later
/// Colours and light. ramps.json matches `terrace render`, which a test checks.

import ramps from './ramps.json';

/// A position, and red, green and blue from 0 to 255.
export type Stop = number[];

export const SLOPE: Stop[] = ramps.slope;
/// Colours from the coarsest level to level 0.
export const LEVELS: Stop[] = ramps.levels;
export const GREYS: Stop[] = [[0, 28, 30, 34], [1, 245, 245, 240]];
/// Surfaces without other colours, as in `terrace render`.
export const PLAIN: Stop[] = [[0, 205, 205, 200], [1, 205, 205, 200]];
/// Returns the colour of a class, the customary one for the standard classes of ASPRS LAS 1.4.
export function classColour(classCode: number): number[] {
  return ramps.classes[classCode] ?? ramps.categories[classCode % ramps.categories.length];
}
export const LIGHT = ramps.light;

/// Returns the colours of heights, at positions from 0 (`low`) to 1 (`high`). If the sea is deeper than 5 % of the highest
/// land, its colours end at height 0.
export function heightStops(low: number, high: number): Stop[] {
  if (!(low < 0 && high > 0 && -low > 0.05 * high)) return ramps.land;
  const shore = -low / (high - low);
  return [
    ...ramps.sea.map(([place, ...rgb]) => [place * shore, ...rgb]),
    ...ramps.land.map(([place, ...rgb]) => [shore + place * (1 - shore), ...rgb])
  ];
}

/// Returns `count` colours from the first stop to the last, as RGBA bytes. `count` must be at least 2. The first stop must be
/// at 0.
export function texels(stops: Stop[], count: number): Uint8Array {
  const result = new Uint8Array(4 * count), last = stops[stops.length - 1][0];
  for (let i = 0; i < count; ++i) {
    const place = i / (count - 1) * last;
    const next = Math.max(1, stops.findIndex(stop => stop[0] >= place));
    const a = stops[next - 1], b = stops[next], t = b[0] > a[0] ? (place - a[0]) / (b[0] - a[0]) : 1;
    for (let c = 1; c < 4; ++c) result[4 * i + c - 1] = Math.round((1 - t) * a[c] + t * b[c]);
    result[4 * i + 3] = 255;
  }
  return result;
}

/// Returns the stops as a CSS linear gradient. The first stop must be at 0.
export function gradient(stops: Stop[]): string {
  const last = stops[stops.length - 1][0];
  return `linear-gradient(90deg,${stops.map(([place, ...rgb]) => `rgb(${rgb.join(' ')}) ${(100 * place / last).toFixed(1)}%`).join(',')})`;
}
