// SPDX-License-Identifier: GPL-3.0-or-later
// Places at which the heights of a set of tiles are compared.

/// Numbers in [0, 1), always the same.
export function* numbers(seed) {
  for (let state = seed >>> 0;;) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state / 2 ** 32;
  }
}

/// count places anywhere in the set's bounds, count / 2 on borders between tiles of the deepest
/// zoom, and count / 2 where four of them meet: {place: [longitude, latitude], tiles}, the tiles
/// that touch it. Without borders where `borders` is false.
export function placesOf(set, count, borders = true) {
  const random = numbers(7);
  const next = () => random.next().value;
  const z = set.deepest, side = 180 / 2 ** z;
  const deepest = set.at(z).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const anyTile = () => deepest[Math.floor(next() * deepest.length)];
  const [west, south, east, north] = set.layer.bounds;
  const places = [];
  while (places.length < count) {
    const place = [west + next() * (east - west), south + next() * (north - south)];
    places.push({place, tiles: [set.deepestAt(...place)]});
  }
  if (!borders) return places;
  const touching = (x, y, i, j) => {
    const tiles = [];
    for (const tx of i ? [x] : [x - 1, x]) {
      for (const ty of j ? [y] : [y - 1, y]) tiles.push({z, x: tx, y: ty});
    }
    return tiles;
  };
  const add = (wanted, fractions) => {
    for (let tries = 0; wanted > 0 && tries < 100000; ++tries) {
      const [x, y] = anyTile();
      const [i, j] = fractions();
      const tiles = touching(x, y, i, j);
      if (!tiles.every(tile => set.has(tile.z, tile.x, tile.y))) continue;
      places.push({place: [-180 + (x + i) * side, -90 + (y + j) * side], tiles});
      --wanted;
    }
  };
  add(Math.ceil(count / 2),
      () => next() < 0.5 ? [0, 0.001 + 0.998 * next()] : [0.001 + 0.998 * next(), 0]);
  add(Math.ceil(count / 2), () => [0, 0]);
  return places;
}
