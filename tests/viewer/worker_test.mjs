// SPDX-License-Identifier: GPL-3.0-or-later
// worker_test.mjs: the viewer's worker, as it is shipped, in node over published stores. TERRACE names the command,
// FLIGHT_HASHES the native flight.
import assert from 'node:assert/strict';
import {readFileSync, statSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {Flyer} from './flyer.mjs';
import {MAX_POINTS, Sites} from './sites.mjs';
import {folderFetch, Worker} from './worker_host.mjs';

const sites = new Sites();
before(() => sites.build());
after(() => sites.remove());

/// A worker over a store of the site.
class Tested extends Flyer {
  constructor(name, {fault, latency, site = sites.site, maxPoints = MAX_POINTS, asPoints = false, changed = () => {}} = {}) {
    const {fetch, log} = folderFetch(site, fault, latency);
    const messages = [];
    let blocks = 0;
    super(heard => new Worker(join(site, 'worker.js'), fetch, heard), 'http://folder/', name, {
      maxPoints,
      asPoints,
      heard: message => {
        messages.push(message.type);
        if (message.type === 'frame') changed(message);
        if (message.type === 'frame') blocks += message.changes.vertexBlocks.length;
      }
    });
    Object.assign(this, {log, messages, blocks: () => blocks});
  }
  async settle({eye, direction, error}) {
    return (await this.view({eye, direction, up: [0, 0, 1], fov: 45, aspect: 1.5, height: 800, error})).state;
  }
  async hash() {
    const done = this.until(message => message.type === 'hashed');
    this.worker.tell({type: 'hash', id: 1});
    return (await done).hash;
  }
  async failed() {
    return (await this.until(message => message.type === 'failed')).message;
  }
}

const FLIGHTS = {alps: 'raster', flat: 'raster', cloud: 'points', ball: 'surface', ...(process.env.TERRACE_DATA ? {bunny: 'surface'} : {})};
for (const [name, kind] of Object.entries(FLIGHTS)) {
  test(`a flight over ${name} gives the hashes of the native run`, {skip: name === 'bunny' && !sites.real.bunny}, async () => {
    const flight = sites.flight(name, {kind});
    assert.ok(new Set(flight.map(stop => stop.hash)).size >= 4, 'the flight does not change what is shown');
    const flyer = new Tested(name);
    const {scene} = await flyer.opened();
    assert.equal(scene.kind, kind);
    assert.equal(scene.scan, kind === 'surface');
    for (const [i, stop] of flight.entries()) {
      const state = await flyer.settle(stop);
      assert.deepEqual([i, state.points, state.expanded], [i, stop.points, stop.expanded]);
      assert.equal(await flyer.hash(), stop.hash, `stop ${i}`);
    }
    assert.ok(flyer.blocks() > 0);
    // Ranges of the store's files, none of them twice, and nothing but the viewer and the start file whole.
    const seen = new Set();
    for (const {path, range} of flyer.log) {
      if (range === undefined) {
        assert.match(path, /^\/((core|body)\.wasm|stores\/\w+\.start)$/);
        continue;
      }
      assert.match(path, /^\/stores\/\w+\/level-\d+\.0\.(clusters|index)$/);
      assert.ok(!seen.has(path + range), `${path} ${range} twice`);
      seen.add(path + range);
    }
  });
}

/// What a page has after changes: an array of vertices' bytes, and corners of triangles.
class Arrays {
  vertices = new Uint8Array();
  triangles = new Uint32Array();
  apply({state, changes}) {
    const grown = (old, size) => {
      if (size <= old.length) return old;
      const array = new old.constructor(size);
      array.set(old);
      return array;
    };
    this.vertices = grown(this.vertices, Math.ceil(state.vertexSlots / 64) * 64 * 24);
    this.triangles = grown(this.triangles, Math.ceil(state.triangleSlots / 64) * 64 * 3);
    changes.vertexBlocks.forEach((b, i) => this.vertices.set(changes.vertices.subarray(i * 1536, (i + 1) * 1536), b * 1536));
    changes.triangleBlocks.forEach((b, i) => this.triangles.set(changes.triangles.subarray(i * 192, (i + 1) * 192), b * 192));
  }
  vertex(slot) {
    return Buffer.from(this.vertices.subarray(24 * slot, 24 * slot + 24)).toString('hex');
  }
  /// The triangles by all that is known of their corners, in order.
  listed() {
    const list = [];
    for (let i = 0; i < this.triangles.length; i += 3) {
      const corners = [...this.triangles.subarray(i, i + 3)].map(slot => this.vertex(slot));
      if (this.triangles[i] === this.triangles[i + 1]) continue;
      const first = corners.indexOf([...corners].sort()[0]);
      list.push([...corners.slice(first), ...corners.slice(0, first)].join());
    }
    return list.sort();
  }
}

test('a surface: what changes have made of the arrays is what a new worker sends, closed and turned outward', async () => {
  const flight = sites.flight('ball', {kind: 'surface'});
  const arrays = new Arrays(), fresh = new Arrays();
  const flyer = new Tested('ball', {changed: message => arrays.apply(message)});
  await flyer.opened();
  for (const stop of flight) await flyer.settle(stop);
  await flyer.hash();
  const other = new Tested('ball', {changed: message => fresh.apply(message)});
  await other.opened();
  for (const stop of flight) await other.settle(stop);
  await other.hash();
  // One more: both ways to the same points, the second with restored surfaces between.
  const last = {...flight[0], error: 3};
  for (const stop of flight.slice(2, 6)) {
    await other.settle(stop);
    await other.hash();
  }
  for (const tested of [flyer, other]) {
    await tested.settle({...last, error: 1e6});
    await tested.settle(last);
    await tested.hash();
  }
  const list = arrays.listed();
  assert.ok(list.length > 1000);
  assert.equal(list.length, flyer.last.state.triangles);
  assert.deepEqual(list, fresh.listed());
  // Each edge is passed as often one way as the other, and normals point away from the middle.
  const edges = new Map(), view = new DataView(arrays.vertices.buffer);
  for (let i = 0; i < arrays.triangles.length; i += 3) {
    const c = arrays.triangles.subarray(i, i + 3);
    if (c[0] === c[1]) continue;
    for (let k = 0; k < 3; ++k) {
      const [a, b] = [c[k], c[(k + 1) % 3]];
      edges.set(`${Math.min(a, b)} ${Math.max(a, b)}`, (edges.get(`${Math.min(a, b)} ${Math.max(a, b)}`) ?? 0) + (a < b ? 1 : -1));
      const at = [0, 4, 8].map(o => view.getFloat32(24 * a + o, true)), n = [12, 13, 14].map(o => view.getInt8(24 * a + o));
      const size = Math.hypot(...at), steep = (at[0] * n[0] + at[1] * n[1] + at[2] * n[2]) / size / 127;
      assert.ok(steep > 0.5, `normal ${n} at ${at}`);
    }
  }
  assert.ok([...edges.values()].every(n => n === 0));
});

test('a scan as points and back, with the bytes that are there', async () => {
  const flyer = new Tested('ball', {asPoints: true});
  assert.equal((await flyer.opened()).scene.kind, 'points');
  const [stop] = sites.flight('ball');
  await flyer.settle(stop);
  assert.equal(await flyer.hash(), stop.hash);
  assert.ok(!flyer.log.some(request => request.path === '/body.wasm'));
  for (const kind of ['surface', 'points', 'surface']) {
    const opened = flyer.opened();
    flyer.worker.tell({type: 'show', asPoints: kind === 'points'});
    assert.equal((await opened).scene.kind, kind);
    await flyer.settle(stop);
    const [native] = sites.flight('ball', {kind});
    assert.equal(await flyer.hash(), native.hash);
  }
  const ranges = flyer.log.filter(({range}) => range).map(({path, range}) => path + range);
  assert.equal(new Set(ranges).size, ranges.length);
  assert.equal(flyer.log.filter(request => request.path === '/body.wasm').length, 1);
});

test('by hand: a cluster of a surface expands, collapses and is released; a point of it is met', async () => {
  const flyer = new Tested('ball');
  await flyer.opened();
  const answer = async (message, type) => {
    const done = flyer.until(m => m.type === type);
    flyer.worker.tell(message);
    return done;
  };
  const camera = {eye: [40, 0, 0], direction: [-1, 0, 0], error: 1e6};
  const before = (await flyer.settle(camera)).points;
  const {hit} = await answer({type: 'pick', id: 1, origin: [40, 0.1, 0.2], direction: [-1, 0, 0], angle: 0.01}, 'picked');
  assert.ok(hit.place[0] > 6 && hit.place[0] < 11, JSON.stringify(hit));
  flyer.worker.tell({type: 'pin', how: 1});
  const more = (await flyer.settle(camera)).points;
  assert.ok(more > before, `${before} ${more}`);
  const {lines} = await answer({type: 'outline', level: hit.clusterLevel, ordinal: hit.clusterOrdinal}, 'outlined');
  assert.equal(lines.length % 2, 0);
  assert.equal((await answer({type: 'profile', id: 2, from: [0, 0, 0], to: [5, 5, 5]}, 'profiled')).line.length, 0);
  flyer.worker.tell({type: 'pin', how: -1});
  assert.equal((await flyer.settle(camera)).points, before);
});

test('a module for bodies that cannot be fetched: a message, and a retry that helps', async () => {
  let bad = true;
  const flyer = new Tested('ball', {
    fault: (request, response) => bad && request.path === '/body.wasm' ? {status: 404, headers: {}, body: Buffer.alloc(0)} : response
  });
  assert.match(await flyer.failed(), /HTTP 404/);
  bad = false;
  const opened = flyer.opened();
  flyer.worker.tell({type: 'retry'});
  assert.equal((await opened).scene.kind, 'surface');
});

test('few requests: small ones wait for those under way, and an index comes in blocks', async () => {
  sites.terrace('synth', 'dem', '--size', '2048x2048', '-o', 'made.tif', '-q');
  sites.terrace('build', 'made.tif', '-o', 'made.store', '-q');
  sites.terrace('publish', 'made.store', '-o', 'made', '-q');
  const flyer = new Tested('made', {latency: 10, site: join(sites.folder, 'made')});
  const {scene: {box}} = await flyer.opened();
  const middle = [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2], high = box[4] - box[1];
  // All of it in sight, and the index of level 0 with it.
  await flyer.settle({eye: [middle[0], middle[1] - high, box[5] + high], direction: [0, Math.SQRT1_2, -Math.SQRT1_2], error: 4});
  let small = 0;
  const asked = [];  // parts of indices
  for (const {path, range, unanswered} of flyer.log.filter(request => request.range)) {
    const [first, last] = /(\d+)-(\d+)/.exec(range).slice(1).map(Number);
    if (path.endsWith('.index')) {
      for (const place of [first, last + 1]) {
        const known = asked.some(part => part.path === path && part.first <= place && place <= part.last + 1);
        assert.ok(place % 1024 === 0 || known || place === statSync(join(sites.folder, 'made', path)).size, `${path} ${range}`);
      }
      asked.push({path, first, last});
    }
    if (last - first + 1 >= 4096) continue;
    ++small;
    assert.equal(unanswered, 0, `${path} ${range}`);
  }
  assert.ok(small > 0);
  assert.ok(asked.length > 5);
});

test('the first picture needs the start file alone', async () => {
  const flyer = new Tested('alps');
  await flyer.opened();
  assert.deepEqual(flyer.log.map(request => request.path), ['/core.wasm', '/stores/alps.start']);
  const start = readFileSync(join(sites.site, 'stores', 'alps.start')).length;
  assert.ok(start <= 300_000, `${start} bytes`);
});

const CLOSE = {eye: [2000, -9000, 9000], direction: [0, 0.7071067811865476, -0.7071067811865476], error: 4};

/// The part of the message, and how the n-th range of a store is spoiled.
const FAULTS = {
  'a whole file instead of a part': [/whole files.*200/, request => ({status: 200, headers: {}, body: request.body})],
  'a missing file': [/no such file.*404/, () => ({status: 404, headers: {}, body: Buffer.alloc(0)})],
  'a shorter file': [/smaller.*416/, () => ({status: 416, headers: {}, body: Buffer.alloc(0)})],
  'a short body': [/bytes came where/, response => ({...response, body: response.body.subarray(1)})],
  'another part': [/another part/, response => ({...response, headers: {'Content-Range': 'bytes 0-1/2'}})],
  'a replaced file': [
    /replaced/,
    response => ({...response, headers: {'Content-Range': response.headers['Content-Range'].replace(/\d+$/, '99999999')}})
  ],
  'a broken server': [/HTTP 503/, () => ({status: 503, headers: {}, body: Buffer.alloc(0)})],
  'a dead server': [/does not answer/, () => null],
  'damaged bytes': [/checksum|damaged/i, response => ({...response, body: response.body.map(b => b ^ 0x5a)})]
};
for (const [name, [expected, spoil]] of Object.entries(FAULTS)) {
  test(`${name}: a message, no wrong picture, and a retry that helps`, async () => {
    let bad = true;
    const flyer = new Tested('alps', {fault: (request, response) => bad && request.range ? spoil(response) : response});
    await flyer.opened();
    const failed = flyer.failed();
    const settled = flyer.settle(CLOSE);
    assert.match(await failed, expected);
    assert.ok(!flyer.last?.state.settled);
    bad = false;
    flyer.worker.tell({type: 'retry'});
    await settled;
    const fine = new Tested('alps');
    await fine.opened();
    await fine.settle(CLOSE);
    assert.equal(await flyer.hash(), await fine.hash());
  });
}

test('one short body or damaged part is fetched again without a word', async () => {
  for (const spoil of [FAULTS['a short body'][1], FAULTS['damaged bytes'][1], FAULTS['a broken server'][1]]) {
    let left = 1;
    const flyer = new Tested('alps', {fault: (request, response) => request.range && left-- > 0 ? spoil(response) : response});
    await flyer.opened();
    await flyer.settle(CLOSE);
    assert.ok(!flyer.messages.includes('failed'));
  }
});

test('a start file that is missing or damaged', async () => {
  for (const [expected, spoil] of [
           [/HTTP 404/, () => ({status: 404, headers: {}, body: Buffer.alloc(0)})],
           [/start file.*damaged/, response => ({...response, body: response.body.subarray(0, -1)})],
           [/start file.*damaged/, response => ({...response, body: Buffer.from('<html>')})]]) {
    let bad = true;
    const flyer = new Tested('alps', {fault: (request, response) => bad && request.path.endsWith('.start') ? spoil(response) : response});
    assert.match(await flyer.failed(), expected);
    bad = false;
    const opened = flyer.opened();
    flyer.worker.tell({type: 'retry'});
    await opened;
  }
});
