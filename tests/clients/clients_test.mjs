// SPDX-License-Identifier: GPL-3.0-or-later
// clients_test.mjs PACKAGES: reads terrace's tiles in CesiumJS and in another decoder, and checks
// meshes with the glTF validator. TERRACE names the command, CHROMIUM the browser, TERRACE_DATA a
// folder with a DEM of the Alps; without it the DEM is synthetic. Pictures of the globe are kept in
// PACKAGES.

import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {existsSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';

import {FAULTS} from './faults.mjs';
import {launch, survey} from './globe.mjs';
import {load, packages} from './packages.mjs';
import {placesOf} from './places.mjs';
import {tileBytes, TileSet} from './quantized_mesh.mjs';
import {ARCTIC, GEOGRAPHIC, hills, writeRaster} from './raster.mjs';
import {serve} from './tile_server.mjs';

const ALPS = join(process.env.TERRACE_DATA ?? '', 'dem', 'N46E008_alps_point.tif');
const folder = mkdtempSync(join(tmpdir(), 'terrace-clients-'));
const here = dirname(fileURLToPath(import.meta.url));
const NAMES = ['plain', 'extended', 'metadata', 'dateline', 'pole'];
const sets = {};
let browser, server, base;

/// The extensions that the tiles of a set have.
const extensionsOf = name => ({
  normals: ['extended', 'dateline', 'pole'].includes(name),
  water: ['extended', 'dateline'].includes(name),
  metadata: ['metadata', 'dateline'].includes(name)
});

function terrace(...args) {
  const {status, stderr, error} =
      spawnSync(process.env.TERRACE, args, {cwd: folder, encoding: 'utf8'});
  assert.equal(status, 0, `terrace ${args.join(' ')}: ${error ?? stderr}`);
}

before(async () => {
  terrace(
      'synth', 'dem', '--size', '600x500', '--cell', '0.001', '--crs', 'EPSG:4326', '--roughness',
      '12', '--type', 'float32', '-o', 'synthetic.tif');
  terrace('build', 'synthetic.tif', '-o', 'synthetic.terrace', '-q');
  const real = process.env.TERRACE_DATA && existsSync(ALPS);
  if (real) terrace('build', ALPS, '-o', 'real.terrace', '-q');
  terrace('tile', 'synthetic.terrace', '--vertical', 'ignore', '-q', '-o', 'plain');
  terrace(
      'tile', real ? 'real.terrace' : 'synthetic.terrace', '--vertical', 'ignore', '--normals',
      '--water', 'nodata', '--gzip', '-q', '-o', 'extended');
  terrace(
      'tile', 'synthetic.terrace', '--vertical', 'ignore', '--metadata', '-q', '-o', 'metadata');
  // A degree across the antimeridian, with a lagoon; and 480 km around the pole.
  writeRaster(join(folder, 'dateline.tif'), {
    columns: 600,
    rows: 450,
    west: 179.4,
    north: -16,
    cell: 0.002,
    keys: GEOGRAPHIC,
    height: (i, j) => Math.hypot(i - 360, j - 190) < 70 ? NaN : hills(i, j)
  });
  writeRaster(join(folder, 'pole.tif'), {
    columns: 240,
    rows: 240,
    west: -230e3,
    north: 250e3,
    cell: 2000,
    keys: ARCTIC,
    height: hills
  });
  for (const [name, ...options] of [
           ['dateline', '--metadata', '--normals', '--water', 'nodata'],
           ['pole', '--normals', '--gzip']]) {
    terrace('build', `${name}.tif`, '-o', `${name}.terrace`, '-q');
    terrace('tile', `${name}.terrace`, '--vertical', 'ignore', ...options, '-q', '-o', name);
  }
  for (const name of NAMES) sets[name] = new TileSet(join(folder, name));
  const mounts = {
    page: {folder: here},
    cesium: {folder: join(packages, 'node_modules/cesium/Build/Cesium')},
    ...sets
  };
  Object.values(FAULTS).forEach(({fault, of = 'plain'}, i) => {
    const set = sets[of];
    mounts[`fault${i}`] = {folder: set.folder, fault: fault(set)};
  });
  server = await serve(mounts);
  base = `http://127.0.0.1:${server.address().port}/`;
  browser = await launch();
});

after(async () => {
  await browser?.close();
  server?.close();
  server?.closeAllConnections();
  rmSync(folder, {recursive: true, force: true});
});

for (const name of NAMES) {
  test(`the globe shows the ${name} tiles`, async () => {
    // On a border the client rounds twice: it may find the tile on one side through metadata and
    // then request the tile on the other. With metadata, only positions next to borders are
    // therefore sampled, one on each side; without it, positions on borders too.
    const places = [
      ...sets[name].layer.metadataAvailability ? [] : placesOf(sets[name], 80),
      ...placesOf(sets[name], 80, {offBorder: true})
    ];
    assert.ok(places.length >= 200, `${places.length} places`);
    // At the pole, the client's triangles are so large that they cut through the globe, so the
    // drawn picture does not show heights.
    const pictures = name === 'pole' ? undefined : join(packages, `globe-${name}`);
    // For the dateline set, look at the tile that begins at the antimeridian.
    const column = name === 'dateline' ? 0 : undefined;
    const {complaints, facts} =
        await survey(browser, base, name, sets[name], places, {pictures, column});
    console.log(`${name}: ${JSON.stringify(facts)}`);
    if (pictures) {
      console.log(
          `look at ${pictures}-heights.png${facts.extensions?.normals ? ' and -lit.png' : ''}`);
      assert.ok(facts.drawnVertices > 200);
    }
    assert.deepEqual(complaints, []);
    assert.deepEqual(facts.extensions, extensionsOf(name));
    assert.ok(facts.asked.there > 40 && facts.asked.missing > 20);
  });
}

Object.entries(FAULTS).forEach(([name, {complaint, drawn, of = 'plain'}], i) => {
  test(`the survey finds: ${name}`, async () => {
    const set = sets[of];
    const pictures = drawn ? join(packages, `globe-fault${i}`) : undefined;
    const places = placesOf(set, 20, {offBorder: true});
    const {complaints} = await survey(browser, base, `fault${i}`, set, places, {pictures});
    assert.match(complaints.join('\n'), new RegExp(complaint, 'm'));
  });
});

for (const name of NAMES) {
  test(`another decoder reads the same ${name} tiles`, () => {
    const decode = load('@here/quantized-mesh-decoder');
    const set = sets[name];
    for (const key of set.tiles.keys()) {
      const mine = set.tile(...key.split('/'));
      const bytes = tileBytes(join(set.folder, `${key}.terrain`));
      // The decoder works in place and needs a separate buffer.
      const theirs = (decode.default ?? decode)(new Uint8Array(bytes).buffer);
      assert.deepEqual(
          Object.values(theirs.header),
          [...mine.centre, mine.lowest, mine.highest, ...mine.sphere, ...mine.horizon], key);
      assert.deepEqual([...theirs.vertexData], [...mine.u, ...mine.v, ...mine.height], key);
      assert.deepEqual([...theirs.triangleIndices], mine.triangles, key);
      for (const side of ['west', 'south', 'east', 'north']) {
        assert.deepEqual([...theirs[`${side}Indices`]], mine[side], `${key} ${side}`);
      }
      const {vertexNormals, waterMask, metadata} = theirs.extensions;
      for (const [id, theirs] of [[1, vertexNormals], [2, waterMask]]) {
        const same =
            theirs ? mine.extensions[id]?.equals(new Uint8Array(theirs)) : !mine.extensions[id];
        assert.ok(same, `${key}: extension ${id}`);
      }
      assert.deepEqual(
          metadata, mine.extensions[4] && JSON.parse(mine.extensions[4].subarray(4)), key);
      const has = extensionsOf(name);
      assert.equal(vertexNormals?.length, has.normals ? 2 * mine.u.length : undefined, key);
      assert.equal(!!waterMask, has.water, key);
      assert.equal(!!metadata, has.metadata, key);
    }
    assert.ok(set.tiles.size > 100);
  });
}

for (const options
         of [['--max-error', '20'], ['--max-error', '20', '--quality', 'fitted'],
             ['--level', 'top'], ['--level', '0', '--to-crs', 'EPSG:32632']]) {
  test(`the glTF validator accepts mesh ${options.join(' ')}`, async () => {
    const {validateBytes} = load('gltf-validator');
    terrace('mesh', 'synthetic.terrace', ...options, '-o', 'mesh.glb', '--force', '-q');
    const glb = readFileSync(join(folder, 'mesh.glb'));
    const {issues, info} = await validateBytes(new Uint8Array(glb), {maxIssues: 20});
    assert.deepEqual(issues.messages.filter(({severity}) => severity < 2), []);
    assert.equal(issues.numErrors, 0);
    assert.ok(info.totalVertexCount > 100 && info.totalTriangleCount > 100, JSON.stringify(info));
    // A truncated file is rejected.
    const cut =
        await validateBytes(new Uint8Array(glb.subarray(0, glb.length - 8))).catch(error => error);
    assert.ok(cut instanceof Error || cut.issues.numErrors > 0);
  });
}
