// SPDX-License-Identifier: GPL-3.0-or-later
// A set of tiles in CesiumJS in headless Chromium: what of it is wrong, in words.
//
// tilesLoaded of the globe proves nothing: it is true while every tile fails. What counts: heights
// that the client interpolates, its errors, its requests, the tiles that it draws, and pixels.

import {join} from 'node:path';

import {load} from './packages.mjs';
import {tilesToAskFor} from './places.mjs';
import {UNITS} from './quantized_mesh.mjs';

const {chromium} = load('playwright-core');

const SIZE = {
  width: 800,
  height: 450
};
const EARTH = 6371000;

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

/// What a page did: requests outside this machine, refusals, errors, addresses that were answered.
class Record {
  constructor() {
    this.outside = [];
    this.refused = [];
    this.errors = [];
    this.answered = new Set();
  }

  /// Whether a tile was answered.
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

/// In the page: a provider of the tiles.
async function open(url) {
  Cesium.Ion.defaultAccessToken = '';
  const provider = await Cesium.CesiumTerrainProvider.fromUrl(
      url, {requestVertexNormals: true, requestWaterMask: true});
  window.provider = provider;
  window.providerErrors = [];
  provider.errorEvent.addEventListener(error => window.providerErrors.push(error.message));
  return {
    normals: provider.hasVertexNormals,
    water: provider.hasWaterMask,
    metadata: provider.hasMetadata
  };
}

/// In the page: heights at places, [longitude, latitude] in degrees; a text where it failed.
async function sample(places) {
  try {
    const points = places.map(place => Cesium.Cartographic.fromDegrees(...place));
    await Cesium.sampleTerrainMostDetailed(window.provider, points, true);
    return points.map(point => point.height);
  } catch (error) {
    return `sampleTerrainMostDetailed: ${error.message ?? error}`;
  }
}

/// In the page: whether the client thinks that tiles are there: true, false or undefined. Tiles by
/// zoom, column and row from the north.
function available(tiles) {
  return tiles.map(({z, x, row}) => window.provider.getTileDataAvailable(x, row, z) ?? 'unknown');
}

/// In the page: the extensions of tiles as the client has them, in numbers.
async function extensionsOf(tiles) {
  return Promise.all(tiles.map(async ({z, x, row}) => {
    const {_encodedNormals: normals, _waterMask: water} =
        await window.provider.requestTileGeometry(x, row, z);
    return {normals: normals && Array.from(normals), water: water && Array.from(water)};
  }));
}

/// In the page: draws the globe seen towards a place; resolves when its tiles have been there for
/// some frames.
async function draw({target, range, lowest, highest}) {
  const widget = new Cesium.CesiumWidget('globe', {
    terrainProvider: window.provider,
    baseLayer: false,
    skyBox: false,
    skyAtmosphere: false,
    msaaSamples: 1,
    creditContainer: 'credits',
    contextOptions: {webgl: {preserveDrawingBuffer: true}},
  });
  window.widget = widget;
  const {scene} = widget;
  const {globe} = scene;
  scene.fog.enabled = false;
  scene.highDynamicRange = false;
  scene.backgroundColor = Cesium.Color.fromCssColorString('#aac4dd');
  globe.showGroundAtmosphere = false;
  globe.showWaterEffect = false;
  // Red tells the height, from 0 to 255.
  const ramp = document.createElement('canvas');
  ramp.width = 256;
  ramp.height = 1;
  const paint = ramp.getContext('2d');
  for (let i = 0; i < 256; ++i) {
    paint.fillStyle = `rgb(${i}, ${Math.round(90 + 0.6 * i)}, ${Math.round(70 + 0.7 * i)})`;
    paint.fillRect(i, 0, 1, 1);
  }
  globe.material = Cesium.Material.fromType(
      'ElevationRamp', {image: ramp, minimumHeight: lowest, maximumHeight: highest});
  widget.camera.lookAt(
      Cesium.Cartesian3.fromDegrees(...target),
      new Cesium.HeadingPitchRange(Cesium.Math.toRadians(20), Cesium.Math.toRadians(-35), range));
  let still = 0;
  const start = performance.now();
  return new Promise(resolve => scene.postRender.addEventListener(() => {
    still = globe.tilesLoaded ? still + 1 : 0;
    if (still > 5)
      resolve(true);
    else if (performance.now() - start > 60000)
      resolve(false);
  }));
}

/// In the page: what was drawn: tiles, with the vertices of the deepest zoom's as the client has
/// them (u and v to 1, metres), and at pixels the height by the colour and by the ray.
function look({z, lowest, highest}) {
  const {scene, camera} = window.widget;
  const {globe} = scene;
  const tiles = globe._surface._tilesToRender.map(tile => {
    const drawn = {z: tile.level, x: tile.x, row: tile.y, upsampled: tile.upsampledFromParent};
    if (tile.level !== z || tile.upsampledFromParent) return drawn;
    const {vertices, encoding, vertexCountWithoutSkirts} = tile.data.renderedMesh;
    drawn.vertices = Array.from({length: vertexCountWithoutSkirts}, (_, i) => {
      const place = encoding.decodeTextureCoordinates(vertices, i, new Cesium.Cartesian2());
      return [place.x, place.y, encoding.decodeHeight(vertices, i)];
    });
    return drawn;
  });
  const copy = document.createElement('canvas');
  copy.width = scene.canvas.width;
  copy.height = scene.canvas.height;
  const paint = copy.getContext('2d', {willReadFrequently: true});
  paint.drawImage(scene.canvas, 0, 0);
  const pick = (x, y) => {
    const ray = camera.getPickRay(new Cesium.Cartesian2(x + 0.5, y + 0.5));
    const hit = globe.pick(ray, scene);
    return hit && Cesium.Cartographic.fromCartesian(hit).height;
  };
  const pixels = [];
  for (let x = 60; x < copy.width; x += 85) {
    for (let y = 40; y < copy.height; y += 52) {
      const around = [pick(x, y), pick(x - 1, y), pick(x + 1, y), pick(x, y - 1), pick(x, y + 1)];
      if (around.some(height => height === undefined)) continue;
      const red = paint.getImageData(x, y, 1, 1).data[0];
      pixels.push({
        x,
        y,
        byRay: around[0],
        spread: Math.max(...around) - Math.min(...around),
        byColour: lowest + (highest - lowest) * (red + 0.5) / 256
      });
    }
  }
  return {tiles, pixels};
}

/// In the page: the same view lit from the side, for eyes.
async function light() {
  const {scene} = window.widget;
  scene.globe.enableLighting = true;
  scene.globe.dynamicAtmosphereLighting = false;
  scene.globe.lambertDiffuseMultiplier = 1.2;
  const {directionWC: down, rightWC: right} = scene.camera;
  scene.light = new Cesium.DirectionalLight({
    direction: Cesium.Cartesian3.normalize(
        Cesium.Cartesian3.add(
            Cesium.Cartesian3.multiplyByScalar(right, 1.5, new Cesium.Cartesian3()), down,
            new Cesium.Cartesian3()),
        new Cesium.Cartesian3())
  });
  let frames = 0;
  return new Promise(resolve => scene.postRender.addEventListener(() => ++frames > 4 && resolve()));
}

/// A tile of the deepest zoom, all tiles around it there, with the most relief; and its peak.
/// column: its x.
function viewOf(set, column) {
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

/// The complaints about set as it comes from base + name. places: [longitude, latitude] with the
/// tiles that may answer. pictures: a path without ending for the views; without it nothing is
/// drawn. column: of the tile that is looked at.
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
      const first = borders.get(border) ?? borders.set(border, heights[i]).get(border);
      const gap = Math.abs(first - heights[i]);
      facts.widest = Math.max(facts.widest, gap);
      // A millimetre, and what a slope makes of the place beside the border.
      if (!(gap <= 2e-3)) complain(`a gap of ${gap} m beside the border at ${place}`);
    }
    // On a border any of the tiles may answer; interpolation has roundings of its own.
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

/// A tile's row from the north, as the client counts.
const fromNorth = ({z, x, y}) => ({z, x, row: 2 ** z - 1 - y});

/// What the client knows of tiles must be so. With metadata it knows those below the tiles that it
/// has loaded.
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
          `tile ${tile.z}/${tile.x}/${tile.y} is ${there ? '' : 'not '}there; the client ` +
          `takes it for ${answers[i]}`);
  });
}

/// Normals and water masks must come as they stand in the files.
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
  if (!await page.evaluate(draw, view)) complain('the tiles in view were not loaded in a minute');
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
    // The client keeps 12 bits at least.
    const bad = vertices.findIndex((vertex, i) => {
      const mine = [u[i] / UNITS, v[i] / UNITS, height[i] / UNITS];
      const theirs = [vertex[0], vertex[1], (vertex[2] - lowest) / (highest - lowest)];
      return !mine.every((value, k) => Math.abs(value - theirs[k]) <= 1 / 4095);
    });
    if (bad >= 0) complain(`tile ${z}/${x}/${y}: vertex ${bad} is drawn at ${vertices[bad]}`);
  }

  const step = (view.highest - view.lowest) / 256;
  // Where the height changes by more than two colours from pixel to pixel, nothing can be told.
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
      complain(`tile ${tiles.map(({z, x, y}) => `${z}/${x}/${y}`)} was not asked for`);
  }
}
