// SPDX-License-Identifier: GPL-3.0-or-later
/// Colours and light. ramps.json has those of `terrace render`, and a test compares them with it.

import ramps from './ramps.json';

/// A place and the red, green and blue there, 0 to 255.
export type Stop = number[];

export const SLOPE: Stop[] = ramps.slope;
/// From the coarsest level to level 0.
export const LEVELS: Stop[] = ramps.levels;
export const GREYS: Stop[] = [[0, 28, 30, 34], [1, 245, 245, 240]];
/// Surfaces without other colours, as `terrace render` draws them.
export const PLAIN: Stop[] = [[0, 205, 205, 200], [1, 205, 205, 200]];
/// The colour of a class: of the standard ones of ASPRS LAS 1.4 the customary one.
export function classColour(group: number): number[] {
  return ramps.classes[group] ?? ramps.categories[group % ramps.categories.length];
}
export const LIGHT = ramps.light;

/// The tint of heights from low to high as shares of these: with a shore at 0 where there is land and sea.
export function heightStops(low: number, high: number): Stop[] {
  if (!(low < 0 && high > 0 && -low > 0.05 * high)) return ramps.land;
  const shore = -low / (high - low);
  return [
    ...ramps.sea.map(([place, ...rgb]) => [place * shore, ...rgb]),
    ...ramps.land.map(([place, ...rgb]) => [shore + place * (1 - shore), ...rgb])
  ];
}

/// `count` colours from the first stop to the last, as bytes of RGBA.
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

/// The same for a style sheet.
export function gradient(stops: Stop[]): string {
  const last = stops[stops.length - 1][0];
  return `linear-gradient(90deg,${stops.map(([place, ...rgb]) => `rgb(${rgb.join(' ')}) ${(100 * place / last).toFixed(1)}%`).join(',')})`;
}
