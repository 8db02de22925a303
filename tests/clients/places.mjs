// SPDX-License-Identifier: GPL-3.0-or-later
// Positions at which the heights of a set of tiles are compared, tiles that a client is asked
// about, and the camera's target.

const EARTH = 6371000;

/// Pseudo-random numbers in [0, 1), the same for each seed.
export function* numbers(seed) {
  for (let state = seed >>> 0;;) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state / 2 ** 32;
  }
}

/// Distance in degrees from a border to a position next to it: a hundredth of a millimetre.
const OFF_BORDER = 1e-10;

/// Returns `count` random positions in tiles of the deepest zoom, count / 2 on borders between
/// them, and count / 2 where four of them meet: {place: [longitude, latitude], tiles}, with the
/// tiles that touch it. With `offBorder`, each position on a border is replaced by one in each of its
/// tiles, at the very edge. These share a `border` number, because their heights must be equal.
export function placesOf(set, count, {offBorder = false} = {}) {
  const random = numbers(7);
  const next = () => random.next().value;
  const z = set.deepest, side = 180 / 2 ** z, around = 2 ** (z + 1);
  const deepest = set.at(z).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const anyTile = () => deepest[Math.floor(next() * deepest.length)];
  const places = [];
  while (places.length < count) {
    const [x, y] = anyTile();
    const [i, j] = [0.001 + 0.998 * next(), 0.001 + 0.998 * next()];
    places.push({place: [-180 + (x + i) * side, -90 + (y + j) * side], tiles: [{z, x, y}]});
  }
  // Tiles that touch a position of tile x/y, each with that corner or side in its own coordinates.
  const touching = (x, y, i, j) => {
    const tiles = [];
    for (const [tx, ti] of i ? [[x, i]] : [[(x - 1 + around) % around, 1], [x, 0]]) {
      for (const [ty, tj] of j ? [[y, j]] : [[y - 1, 1], [y, 0]])
        tiles.push({z, x: tx, y: ty, i: ti, j: tj});
    }
    return tiles;
  };
  let border = 0;
  const add = (wanted, fractions) => {
    for (let tries = 0; wanted > 0 && tries < 100000; ++tries) {
      const [x, y] = anyTile();
      const [i, j] = fractions();
      const tiles = touching(x, y, i, j);
      if (!tiles.every(tile => set.has(tile.z, tile.x, tile.y))) continue;
      --wanted;
      ++border;
      if (!offBorder) {
        places.push({place: [-180 + (x + i) * side, -90 + (y + j) * side], tiles});
        continue;
      }
      const inward = fraction => fraction === 0 ? OFF_BORDER : fraction === 1 ? -OFF_BORDER : 0;
      for (const tile of tiles) {
        const longitude = -180 + (tile.x + tile.i) * side + inward(tile.i);
        const latitude = -90 + (tile.y + tile.j) * side + inward(tile.j);
        places.push({place: [longitude, latitude], tiles: [tile], border});
      }
    }
  };
  add(Math.ceil(count / 2),
      () => next() < 0.5 ? [0, 0.001 + 0.998 * next()] : [0.001 + 0.998 * next(), 0]);
  add(Math.ceil(count / 2), () => [0, 0]);
  return places;
}

/// Existing tiles and missing tiles next to them, at every zoom; at most `count` of each.
export function tilesToAskFor(set, count) {
  const random = numbers(11);
  const some = list => {
    const chosen = new Map();
    for (let i = 0; i < count && list.length > 0; ++i) {
      const tile = list[Math.floor(random.next().value * list.length)];
      chosen.set(`${tile.z}/${tile.x}/${tile.y}`, tile);
    }
    return [...chosen.values()];
  };
  const there = [], missing = [];
  for (let z = 0; z <= set.deepest; ++z) {
    for (const [x, y] of set.at(z)) {
      there.push({z, x, y});
      for (const [i, j] of [[-1, 0], [1, 0], [0, -1], [0, 1]]) {
        const tile = {z, x: x + i, y: y + j};
        const inside = tile.x >= 0 && tile.y >= 0 && tile.x < 2 ** (z + 1) && tile.y < 2 ** z;
        if (inside && !set.has(z, tile.x, tile.y)) missing.push(tile);
      }
    }
  }
  return [...some(there), ...some(missing)];
}

/// A view of the tile of the deepest zoom with the most relief that is surrounded by other tiles.
/// column: its x.
export function viewOf(set, column) {
  const z = set.deepest, around = 2 ** (z + 1);
  let best;
  for (const [x, y] of set.at(z)) {
    let whole = column === undefined || x === column;
    for (let i = -2; i <= 2; ++i)
      for (let j = -2; j <= 2; ++j) whole &&= set.has(z, (x + i + around) % around, y + j);
    if (!whole) continue;
    const tile = set.tile(z, x, y);
    if (best && tile.highest - tile.lowest <= best.tile.highest - best.tile.lowest) continue;
    best = {z, x, y, tile};
  }
  const {x, y, tile} = best;
  const side = 180 / 2 ** z;
  const [longitude, latitude] = [-180 + (x + 0.5) * side, -90 + (y + 0.5) * side];
  const deepest = set.at(z).map(([i, j]) => set.tile(z, i, j));
  return {
    z,
    x,
    y,
    target: [longitude, latitude, (tile.lowest + tile.highest) / 2],
    range: side * Math.PI / 180 * EARTH * 1.7,
    lowest: Math.min(...deepest.map(({lowest}) => lowest)),
    highest: Math.max(...deepest.map(({highest}) => highest))
  };
}
