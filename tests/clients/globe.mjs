// SPDX-License-Identifier: GPL-3.0-or-later
// Loads a set of tiles in CesiumJS in headless Chromium and reports in words what is wrong.
//
// tilesLoaded of the globe proves nothing, because it is true even if every tile fails. Instead, checks
// interpolated heights, errors, requests, the tiles that the client draws, and pixels.

import {join} from 'node:path';

import {available, draw, extensionsOf, light, look, open, sample} from './globe_page.mjs';
import {load} from './packages.mjs';
import {tilesToAskFor, viewOf} from './places.mjs';
import {UNITS} from './quantized_mesh.mjs';

const {chromium} = load('playwright-core');

const SIZE = {
  width: 800,
  height: 450
};

export function launch() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM,
    headless: true,
    args: [
      '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--disable-background-networking', '--disable-component-update', '--disable-sync',
      '--no-first-run'
    ],
  });
}

/// Events of a page: requests outside this machine, refused requests, errors, and addresses that
/// were answered.
class Record {
  constructor() {
    this.outside = [];
    this.refused = [];
    this.errors = [];
    this.answered = new Set();
  }

  /// Returns whether a tile was answered.
  has(name, set, {z, x, y}) {
    return this.answered.has(join(name, `${z}/${x}/${y}.terrain?v=${set.layer.version}`));
  }

  async watch(context, page, base) {
    await context.route('**/*', route => {
      const url = route.request().url();
      if (url.startsWith(base) || /^(data|blob):/.test(url)) return route.continue();
      this.outside.push(url);
      return route.abort();
    });
    page.on('response', response => {
      const path = response.url().slice(base.length);
      if (response.status() >= 400)
        this.refused.push(`${path} (${response.status()})`);
      else
        this.answered.add(path);
    });
    page.on('console', message => message.type() === 'error' && this.errors.push(message.text()));
    page.on('pageerror', error => this.errors.push(error.message));
  }
}

/// Returns the complaints about the set as served from base + name. places: [longitude, latitude]
/// with the tiles that may answer. pictures: path of the screenshots without extension; without it
/// nothing is drawn. column: the x of the tile to look at.
export async function survey(browser, base, name, set, places, {pictures, column} = {}) {
  const context = await browser.newContext({viewport: SIZE});
  const page = await context.newPage();
  const record = new Record();
  const complaints = [], facts = {};
  const complain = text => complaints.length < 20 && complaints.push(text);
  try {
    await record.watch(context, page, base);
    await page.goto(`${base}page/globe.html`);
    try {
      facts.extensions = await page.evaluate(open, `${base}${name}`);
    } catch (error) {
      complain(`the provider: ${error.message}`);
      return {complaints, facts};
    }
    const heights = await page.evaluate(sample, places.map(({place}) => place));
    if (typeof heights === 'string')
      complain(heights);
    else
      compareSamples(set, places, heights, complain, facts);
    await compareAvailability(page, name, set, record, complain, facts);
    await compareExtensions(page, set, complain, facts);
    if (pictures) await surveyView(page, set, {pictures, column}, complain, facts);
    for (const error of await page.evaluate(() => window.providerErrors))
      complain(`provider: ${error}`);
    compareRequests(name, set, places, record, complain);
    return {complaints, facts};
  } finally {
    await context.close();
  }
}

function compareSamples(set, places, heights, complain, facts) {
  facts.sampled = heights.length;
  facts.furthest = 0;
  facts.widest = 0;
  const borders = new Map();
  places.forEach(({place, tiles, border}, i) => {
    if (border !== undefined) {
      const rounding = Math.max(...tiles.map(tile => set.height(tile, ...place).rounding));
      const here = {height: heights[i], rounding};
      const first = borders.get(border) ?? borders.set(border, here).get(border);
      const gap = Math.abs(first.height - here.height);
      facts.widest = Math.max(facts.widest, gap);
      // Each tile rounds the height that both share. The tolerance adds a millimetre and the effect
      // of the slope next to the border.
      if (!(gap <= 2e-3 + first.rounding + rounding)) {
        complain(`a gap of ${gap} m at the border at ${place}`);
      }
    }
    // On a border, any of the tiles may answer; the client's interpolation also rounds.
    const off = tiles.map(tile => {
      const {height, rounding} = set.height(tile, ...place);
      return {off: Math.abs(heights[i] - height), allowed: rounding + 1e-6};
    });
    if (!off.some(({off, allowed}) => off <= allowed)) {
      complain(`height ${heights[i]} at ${place}, off by ${off.map(({off}) => off)}`);
    } else {
      facts.furthest = Math.max(facts.furthest, Math.min(...off.map(({off}) => off)));
    }
  });
}

/// The tile with its row counted from the north, like the client's.
const fromNorth = ({z, x, y}) => ({z, x, row: 2 ** z - 1 - y});

/// Checks the client's list of available tiles. With metadata it knows only the tiles below those
/// that it has loaded.
async function compareAvailability(page, name, set, record, complain, facts) {
  const loaded = ({z, x, y}) => z === 0 || record.has(name, set, {z: z - 1, x: x >> 1, y: y >> 1});
  const tiles = tilesToAskFor(set, 300).filter(tile => !facts.extensions.metadata || loaded(tile));
  const answers = await page.evaluate(available, tiles.map(fromNorth));
  facts.asked = {there: 0, missing: 0};
  tiles.forEach((tile, i) => {
    const there = set.has(tile.z, tile.x, tile.y);
    ++facts.asked[there ? 'there' : 'missing'];
    if (answers[i] !== there)
      complain(
          `tile ${tile.z}/${tile.x}/${tile.y} ${there ? 'exists' : 'does not exist'}; the client ` +
          `considers it available: ${answers[i]}`);
  });
}

/// Checks that normals and water masks arrive as stored in the files.
async function compareExtensions(page, set, complain, facts) {
  if (!facts.extensions.normals && !facts.extensions.water) return;
  const tiles = set.at(set.deepest)
                    .filter((_, i) => i % 7 === 0)
                    .slice(0, 40)
                    .map(([x, y]) => ({z: set.deepest, x, y}));
  let theirs;
  try {
    theirs = await page.evaluate(extensionsOf, tiles.map(fromNorth));
  } catch (error) {
    return complain(`extensions: ${error.message}`);
  }
  const same = (bytes, numbers) => numbers ? bytes?.equals(new Uint8Array(numbers)) : !bytes;
  tiles.forEach(({z, x, y}, i) => {
    const {extensions} = set.tile(z, x, y);
    for (const [what, id] of [['normals', 1], ['water', 2]]) {
      if (!same(extensions[id], theirs[i][what])) complain(`tile ${z}/${x}/${y}: other ${what}`);
    }
  });
  facts.extended = tiles.length;
}

async function surveyView(page, set, {pictures, column}, complain, facts) {
  const view = viewOf(set, column);
  if (!await page.evaluate(draw, view)) complain('the tiles in view did not load within a minute');
  const seen = await page.evaluate(look, view);
  await page.screenshot({path: `${pictures}-heights.png`});
  if (facts.extensions.normals) {
    await page.evaluate(light);
    await page.screenshot({path: `${pictures}-lit.png`});
  }

  // The client counts rows from the north.
  for (const tile of seen.tiles) tile.y = 2 ** tile.z - 1 - tile.row;
  const mine = seen.tiles.find(({z, x, y}) => z === view.z && x === view.x && y === view.y);
  if (!mine)
    complain(`tile ${view.z}/${view.x}/${view.y} in the middle of the view is not drawn`);
  else if (mine.upsampled)
    complain(`tile ${view.z}/${view.x}/${view.y} is drawn from its parent`);
  facts.drawn = seen.tiles.length;
  const deepest = seen.tiles.filter(({vertices}) => vertices);
  facts.drawnDeepest = deepest.length;
  facts.drawnVertices = 0;
  for (const {z, x, y, vertices} of deepest) {
    const {u, v, height, lowest, highest} = set.tile(z, x, y);
    if (vertices.length !== u.length) {
      complain(`tile ${z}/${x}/${y} is drawn with ${vertices.length} vertices of ${u.length}`);
      continue;
    }
    facts.drawnVertices += u.length;
    // The client keeps at least 12 bits.
    const bad = vertices.findIndex((vertex, i) => {
      const mine = [u[i] / UNITS, v[i] / UNITS, height[i] / UNITS];
      const theirs = [vertex[0], vertex[1], (vertex[2] - lowest) / (highest - lowest)];
      return !mine.every((value, k) => Math.abs(value - theirs[k]) <= 1 / 4095);
    });
    if (bad >= 0) complain(`tile ${z}/${x}/${y}: vertex ${bad} is drawn at ${vertices[bad]}`);
  }

  const step = (view.highest - view.lowest) / 256;
  // Skip pixels where the height changes by more than two colours from pixel to pixel.
  const flat = seen.pixels.filter(({spread}) => spread < 2 * step);
  facts.pixels = flat.length;
  if (flat.length < 15)
    complain(`only ${flat.length} pixels of ${seen.pixels.length} show terrain`);
  for (const {x, y, byRay, byColour} of flat) {
    if (Math.abs(byRay - byColour) > 3 * step) {
      complain(`pixel ${x}, ${y} has the colour of ${byColour} m; the ray meets ${byRay} m`);
    }
  }
}

function compareRequests(name, set, places, record, complain) {
  for (const url of record.outside) complain(`request outside: ${url}`);
  for (const url of record.refused) complain(`refused: ${url}`);
  for (const text of record.errors) complain(`console: ${text}`);
  for (const {tiles} of places) {
    if (!tiles.some(tile => record.has(name, set, tile)))
      complain(`tile ${tiles.map(({z, x, y}) => `${z}/${x}/${y}`)} was not requested`);
  }
}
