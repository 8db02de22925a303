// SPDX-License-Identifier: GPL-3.0-or-later
// worker_test.mjs: tests the shipped viewer worker in node over published stores. TERRACE names the
// command, FLIGHT_HASHES the native flight.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {cpSync, existsSync, readFileSync, statSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';

import {dive, Flyer, shareOf} from './flyer.mjs';
import {MAX_POINTS, Sites} from './sites.mjs';
import {VirtualTime} from './virtual_time.mjs';
import {folderFetch, Worker} from './worker_host.mjs';

/// As in render.ts.
const SLIDE = 0.45;

const sites = new Sites();
before(() => sites.build());
after(() => sites.remove());

/// A site with a synthetic raster of 2048 x 2048 cells.
function made() {
  const site = join(sites.folder, 'made');
  if (!existsSync(site)) {
    sites.terrace('synth', 'dem', '--size', '2048x2048', '-o', 'made.tif', '-q');
    sites.terrace('build', 'made.tif', '-o', 'made.store', '-q');
    sites.terrace('publish', 'made.store', '-o', 'made', '-q');
  }
  return site;
}

/// A worker over a store of the site.
class Tested extends Flyer {
  constructor(name, {fault, latency, site = sites.site, maxPoints = MAX_POINTS, asPoints = false, choose = false, exaggeration = 1, haste = 1, changed = () => {}} = {}) {
    const {fetch, log} = folderFetch(site, fault, latency);
    const messages = [];
    let blocks = 0, broken = null;
    super(receive => new Worker(join(site, 'worker.js'), fetch, receive, haste), 'http://folder/', name, {
      maxPoints,
      choose,
      asPoints,
      exaggeration,
      receive: message => {
        messages.push(message.type);
        // The worker would report an exception from here as its own error.
        try {
          if (message.type === 'frame') changed(message);
        } catch (error) {
          broken ??= error;
        }
        if (message.type === 'frame') blocks += message.changes.vertexBlocks.length;
      }
    });
    Object.assign(this, {log, messages, blocks: () => blocks, broken: () => broken});
  }
  async settle({eye, direction, error, level}) {
    return (await this.view({eye, direction, up: [0, 0, 1], fov: 45, aspect: 1.5, height: 800, error, level})).state;
  }
  /// Sends a message and resolves to the answer of that type.
  async ask(message, type) {
    const done = this.until(m => m.type === type);
    this.worker.send(message);
    return done;
  }
  /// The sample of the store nearest to a position.
  async probe(stored, reach) {
    return (await this.ask({type: 'probe', id: 1, stored: [...stored], reach}, 'probed')).found;
  }
  async profile(from, to, axis) {
    const {metres, level, sampled, points} = (await this.ask({type: 'profile', id: 1, from, to, axis}, 'profiled')).profile;
    return {metres, level, sampled, points: Array.from(points, point => [...point])};
  }
  async hash() {
    const done = this.until(message => message.type === 'hashed');
    this.worker.send({type: 'hash', id: 1});
    return (await done).hash;
  }
  /// Waits until nothing outdated is drawn.
  async rest() {
    if (this.broken()) throw this.broken();
    if (this.last.state.waiting) await this.until(message => message.type === 'frame' && !message.state.waiting);
    if (this.broken()) throw this.broken();
  }
  async failed() {
    return (await this.until(message => message.type === 'failed')).message;
  }
}

const FLIGHTS = {alps: 'raster', flat: 'raster', joined: 'raster', cloud: 'points', ball: 'surface', bowl: 'surface', kept: 'surface', ...(process.env.TERRACE_DATA ? {bunny: 'surface'} : {})};
for (const [name, kind] of Object.entries(FLIGHTS)) {
  test(`a flight over ${name} gives the hashes of the native run`, {skip: name === 'bunny' && !sites.real.bunny}, async () => {
    // Close to the bunny this takes a minute, so only nightly runs continue.
    const stops = name === 'bunny' && !process.env.TERRACE_NIGHTLY ? 2 : 8;
    const flight = sites.flight(name, {kind}).slice(0, stops);
    assert.ok(new Set(flight.map(stop => stop.hash)).size >= Math.min(4, stops), 'the flight does not change what is shown');
    if (name === 'bowl') assert.deepEqual(new Set(flight.map(stop => stop.open)), new Set([false, true]));
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
    // The worker requests ranges of the store's files, each once, and whole files only of the
    // viewer and the start file.
    const seen = new Set();
    for (const {path, range} of flyer.log) {
      if (range === undefined) {
        assert.match(path, /^\/((core|body)\.wasm|stores\/\w+\.start)$/);
        continue;
      }
      assert.match(path, /^\/stores\/\w+\/(level-\d+\.[0-9a-f]+\.(clusters|index)|surface\.0)$/);
      assert.ok(!seen.has(path + range), `${path} ${range} twice`);
      seen.add(path + range);
    }
  });
}

/// The state of a page after changes: an array of vertex bytes, and the corners of triangles.
class Arrays {
  vertices = new Uint8Array();
  triangles = new Uint32Array();
  /// bytes: per vertex.
  constructor(bytes) {
    this.bytes = bytes;
  }
  apply({state, changes}) {
    const grown = (old, size) => {
      if (size <= old.length) return old;
      const array = new old.constructor(size);
      array.set(old);
      return array;
    };
    const block = 64 * this.bytes;
    this.vertices = grown(this.vertices, Math.ceil(state.vertexSlots / 64) * block);
    this.triangles = grown(this.triangles, Math.ceil(state.triangleSlots / 64) * 64 * 3);
    changes.vertexBlocks.forEach((b, i) => this.vertices.set(changes.vertices.subarray(i * block, (i + 1) * block), b * block));
    changes.triangleBlocks.forEach((b, i) => this.triangles.set(changes.triangles.subarray(i * 192, (i + 1) * 192), b * 192));
  }
  /// All bytes of a vertex except its slide.
  vertex(slot) {
    return Buffer.from(this.vertices.subarray(this.bytes * slot, this.bytes * slot + (this.bytes === 32 ? 21 : 16))).toString('hex');
  }
  /// When the slide of a vertex began.
  began(slot) {
    return new DataView(this.vertices.buffer).getFloat32(this.bytes * (slot + 1) - 4, true);
  }
  /// The drawn position at a time, or the final one. As in render.ts.
  place(slot, time = Infinity) {
    const view = new DataView(this.vertices.buffer), at = this.bytes * slot;
    const place = [0, 4, 8].map(o => view.getFloat32(at + o, true));
    const t = Math.min(1, Math.max(0, (time - this.began(slot)) / SLIDE)), left = 1 - t * t * (3 - 2 * t);
    if (this.bytes === 24) return [place[0], place[1], place[2] + left * (view.getFloat32(at + 16, true) - place[2])];
    return place.map((c, k) => c + left * view.getInt16(at + 22 + 2 * k, true) * 2 ** view.getInt8(at + 21));
  }
  /// The corners of each drawn triangle.
  * drawn() {
    for (let i = 0; i < this.triangles.length; i += 3) {
      if (this.triangles[i] !== this.triangles[i + 1]) yield this.triangles.subarray(i, i + 3);
    }
  }
  /// The triangles as strings of their corners' bytes, sorted.
  listed() {
    const list = [];
    for (const slots of this.drawn()) {
      const corners = [...slots].map(slot => this.vertex(slot));
      const first = corners.indexOf([...corners].sort()[0]);
      list.push([...corners.slice(first), ...corners.slice(0, first)].join());
    }
    return list.sort();
  }
}

for (const name of ['ball', 'kept']) {
  test(`${name}: changed arrays equal those of a new worker, closed and facing outward`, async () => {
    const flight = sites.flight(name, {kind: 'surface'}).slice(0, 6);
    const arrays = new Arrays(32), fresh = new Arrays(32);
    const flyer = new Tested(name, {changed: message => arrays.apply(message)});
    await flyer.opened();
    for (const stop of flight) await flyer.settle(stop);
    await flyer.hash();
    const other = new Tested(name, {changed: message => fresh.apply(message)});
    await other.opened();
    for (const stop of flight) await other.settle(stop);
    await other.hash();
    // One more view: both workers reach the same points, the second with restored surfaces in
    // between.
    const last = {...flight[0], error: 3};
    for (const stop of flight.slice(2, 6)) {
      await other.settle(stop);
      await other.hash();
    }
    for (const tested of [flyer, other]) {
      await tested.settle({...last, error: 1e6});
      await tested.settle(last);
      await tested.hash();
      await tested.rest();
    }
    const list = arrays.listed();
    assert.ok(list.length > (name === 'ball' ? 1000 : 300), `${list.length} triangles`);
    assert.equal(list.length, flyer.last.state.triangles);
    assert.deepEqual(list, fresh.listed());
    // Each edge occurs equally often in both directions, and normals point away from the centre.
    const edges = new Map(), view = new DataView(arrays.vertices.buffer);
    for (const c of arrays.drawn()) {
      for (let k = 0; k < 3; ++k) {
        const [a, b] = [c[k], c[(k + 1) % 3]];
        edges.set(`${Math.min(a, b)} ${Math.max(a, b)}`, (edges.get(`${Math.min(a, b)} ${Math.max(a, b)}`) ?? 0) + (a < b ? 1 : -1));
        const at = [0, 4, 8].map(o => view.getFloat32(32 * a + o, true)), n = [12, 13, 14].map(o => view.getInt8(32 * a + o));
        const size = Math.hypot(...at), steep = (at[0] * n[0] + at[1] * n[1] + at[2] * n[2]) / size / 127;
        assert.ok(steep > 0.5, `normal ${n} at ${at}`);
      }
    }
    assert.ok([...edges.values()].every(n => n === 0));
  });
}

/// The distance from p to a triangle: to its plane if the foot is inside, otherwise to its nearest
/// edge.
function distanceTo(p, [a, b, c]) {
  const minus = (u, v) => u.map((x, k) => x - v[k]), dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const normal = cross(minus(b, a), minus(c, a)), edges = [[a, b], [b, c], [c, a]];
  if (edges.every(([u, v]) => dot(normal, cross(minus(v, u), minus(p, u))) >= 0)) {
    return Math.abs(dot(normal, minus(p, a))) / Math.hypot(...normal);
  }
  return Math.min(...edges.map(([u, v]) => {
    const way = minus(v, u), t = Math.min(1, Math.max(0, dot(way, minus(p, u)) / dot(way, way)));
    return Math.hypot(...minus(p, u).map((x, k) => x - t * way[k]));
  }));
}

/// Returns whether p is less than `reach` from a triangle.
function isNear(p, triangle, reach) {
  const [a, b, c] = triangle;
  const outside = k => p[k] < Math.min(a[k], b[k], c[k]) - reach || p[k] > Math.max(a[k], b[k], c[k]) + reach;
  return !outside(0) && !outside(1) && !outside(2) && distanceTo(p, triangle) < reach;
}

for (const name of ['ball', 'kept']) {
  test(`${name}: new vertices start on the previous surface`, async () => {
    const arrays = new Arrays(32);
    let came = 0, waited = false;
    const flyer = new Tested(name, {
      changed: message => {
        // After a wait, triangles are replaced at once, which changes the surface between vertices.
        const skip = waited;
        waited = message.state.waiting;
        if (skip) return arrays.apply(message);
        // A stored surface continues from where its vertices are on their way.
        const when = name === 'kept' ? message.time : undefined;
        // Slides are stored in 2^-14 of their length, and there they cross half the ball at first.
        const reach = name === 'kept' ? 2e-3 : 2e-4;
        const before = [...arrays.drawn()].map(corners => [...corners].map(slot => arrays.place(slot, when)));
        arrays.apply(message);
        if (before.length === 0) return;
        const slots = new Set([...arrays.drawn()].flatMap(corners => [...corners]));
        for (const slot of slots) {
          if (arrays.began(slot) !== Math.fround(message.time) || ++came % 60 !== 0) continue;
          const start = arrays.place(slot, message.time);
          assert.ok(before.some(triangle => isNear(start, triangle, reach)), `${start} is not on the previous surface`);
        }
      }
    });
    await flyer.opened();
    for (const stop of sites.flight(name, {kind: 'surface'}).slice(0, 4)) {
      await flyer.settle(stop);
      await flyer.rest();
    }
    assert.ok(came > (name === 'ball' ? 500 : 120), `${came} came`);
  });
}

/// The triangles drawn at a time as a set, with corners rounded to a thousandth of `unit`.
function pictureOf(arrays, time, unit) {
  return new Set([...arrays.drawn()].map(corners => {
    const places = [...corners].map(slot => arrays.place(slot, time).map(c => Math.round(c / unit * 1000)).join());
    return places.sort().join(' ');
  }));
}

for (const [name, kind] of [['alps', 'raster'], ['ball', 'surface']]) {
  test(`${name}: points that go are still drawn until they have slid, and then disappear`, async () => {
    const arrays = new Arrays(kind === 'raster' ? 24 : 32), unit = kind === 'raster' ? 10 : 0.01;
    let begin = Infinity, compared = 0, gone = 0, last = null;
    const flyer = new Tested(name, {
      changed: message => {
        const time = message.time, went = last === null ? 0 : last.points - message.state.points;
        last = message.state;
        if (begin === 0 && went > 0) begin = time;
        const before = time >= begin && time < begin + SLIDE ? pictureOf(arrays, time, unit) : null;
        arrays.apply(message);
        if (before === null) return;
        const after = pictureOf(arrays, time, unit);
        const changed = [...before].filter(triangle => !after.has(triangle)).length;
        // A few corners round the other way.
        assert.ok(changed <= 0.01 * before.size && Math.abs(after.size - before.size) <= 0.01 * before.size,
                  `${changed} of ${before.size} triangles change and ${after.size} exist ${time - begin} s after points began to go`);
        ++compared;
        gone += went;
      }
    });
    await flyer.opened();
    // Hundreds of points disappear; the space for waiting vertices suffices, however many go in a frame.
    const [stop] = sites.flight(name, {kind}), fine = {...stop, error: kind === 'raster' ? 1 : stop.error}, coarse = {...fine, error: 4 * fine.error};
    await flyer.settle(fine);
    await flyer.rest();
    begin = 0;
    await flyer.settle(coarse);
    await flyer.rest();
    assert.ok(compared > 0 && gone > 20, `${compared} frames, ${gone} points`);
    if (kind === 'surface') await flyer.hash();
    await flyer.rest();
    const fresh = new Arrays(arrays.bytes), other = new Tested(name, {changed: message => fresh.apply(message)});
    await other.opened();
    await other.settle(fine);
    await other.settle(coarse);
    if (kind === 'surface') await other.hash();
    await other.rest();
    assert.equal([...arrays.drawn()].length, flyer.last.state.triangles);
    assert.deepEqual(arrays.listed(), fresh.listed());
  });
}

/// Heights of the triangles drawn at a time over a grid of positions, NaN where there are none; and
/// how many positions are covered twice.
function heightsOf(arrays, time, box, side) {
  const heights = new Float64Array(side * side).fill(NaN), step = [0, 1].map(k => (box[3 + k] - box[k]) / side);
  let twice = 0;
  for (const corners of arrays.drawn()) {
    const [a, b, c] = [...corners].map(slot => arrays.place(slot, time));
    const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    // Positions are offset by half a step from the corners of the grid.
    const range = k => [Math.min(a[k], b[k], c[k]), Math.max(a[k], b[k], c[k])].map(x => (x - box[k]) / step[k] - 0.5);
    const [x0, x1] = range(0), [y0, y1] = range(1);
    for (let j = Math.max(0, Math.ceil(y0)); j <= Math.min(side - 1, y1); ++j) {
      for (let i = Math.max(0, Math.ceil(x0)); i <= Math.min(side - 1, x1); ++i) {
        const x = box[0] + (i + 0.5) * step[0], y = box[1] + (j + 0.5) * step[1];
        const v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area;
        const w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
        if (v < 0 || w < 0 || v + w > 1) continue;
        if (heights[j * side + i] >= -1e9) ++twice;
        heights[j * side + i] = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]);
      }
    }
  }
  return {heights, twice};
}

test('leaving a raster in a flight: no holes, no overlaps, and smaller jumps than without slides', async () => {
  const side = 60, arrays = new Arrays(24);
  let box = null, last = null, jumps = 0, slides = 0, worst = 0, most = 0;
  const flyer = new Tested('hills', {
    changed: message => {
      const moves = last !== null && last.points > message.state.points || last?.waiting;
      last = message.state;
      const before = moves && heightsOf(arrays, message.time, box, side).heights;
      const ended = moves && heightsOf(arrays, Infinity, box, side).heights;
      arrays.apply(message);
      if (!moves) return;
      const {heights, twice} = heightsOf(arrays, message.time, box, side);
      const rest = heightsOf(arrays, Infinity, box, side).heights;
      assert.ok(twice < 10, `${twice} positions are covered twice`);
      heights.forEach((z, i) => {
        assert.equal(Number.isNaN(z), Number.isNaN(before[i]), `place ${i}`);
        if (Number.isNaN(z)) return;
        const jump = Math.abs(z - before[i]), slide = Math.abs(rest[i] - ended[i]);
        jumps += jump, slides += slide;
        worst = Math.max(worst, jump), most = Math.max(most, slide);
      });
    }
  });
  ({scene: {box}} = await flyer.opened());
  const [stop] = sites.flight('hills', {kind: 'raster'}), close = {...stop, error: 1};
  await flyer.settle(close);
  await flyer.rest();
  // Fly away, so that points disappear from near to far.
  for (let i = 1; i <= 10; ++i) {
    const [x, y, z] = close.eye;
    await flyer.view({eye: [x, y, z * 1.08 ** i], direction: close.direction, up: [0, 0, 1], fov: 45, aspect: 1.5, height: 800, error: close.error}, false);
    await new Promise(resume => setTimeout(resume, 30));
  }
  await flyer.rest();
  assert.ok(slides > 0 && jumps < 0.5 * slides, `${jumps} of ${slides}`);
});

/// Largest deviation of vertex normals, times 127, from the area-weighted normals of the triangles
/// around them.
function worstNormal(arrays) {
  const sums = new Map(), view = new DataView(arrays.vertices.buffer);
  for (const corners of arrays.drawn()) {
    const [a, b, c] = [...corners].map(slot => arrays.place(slot)), u = b.map((x, k) => x - a[k]), v = c.map((x, k) => x - a[k]);
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const slot of corners) {
      const sum = sums.get(slot) ?? [0, 0, 0];
      sums.set(slot, sum.map((x, k) => x + Math.sign(normal[2]) * normal[k]));
    }
  }
  return Math.max(...[...sums].flatMap(
      ([slot, sum]) => sum.map((x, k) => Math.abs(127 * x / Math.hypot(...sum) - view.getInt8(24 * slot + 12 + k)))));
}

test('a raster with voids: they are not drawn, picked or in profiles', async () => {
  const arrays = new Arrays(24), flyer = new Tested('coast', {changed: message => arrays.apply(message)});
  await flyer.opened();
  const above = {eye: [0, 0, 9000], direction: [0, 0.001, -1]};
  const longest = () => Math.max(...[...arrays.drawn()].flatMap(corners => {
    const places = [...corners].map(slot => arrays.place(slot));
    return places.map((p, i) => Math.hypot(p[0] - places[(i + 1) % 3][0], p[1] - places[(i + 1) % 3][1]));
  }));
  // From north to south across the bay; the centre is at column 74.5 and row 99.5.
  const middle = [-500, 0, 0], column = 74.5 - 500 / 30;
  const cut = () => flyer.profile([column, 2.5, 0], [column, 196.5, 0], 2);
  const meets = async (x, y) => (await flyer.ask({type: 'pick', id: 1, origin: [x, y, 3000], direction: [0, 0, -1], angle: 0.001}, 'picked')).hit !== null;
  for (const fine of [false, true, false, true]) {
    const view = {...above, error: 1e6, level: fine ? 0 : undefined};
    const state = await flyer.settle(view);
    await flyer.rest();
    assert.equal(state.points === 19_099, fine, `${state.points} points`);
    if (fine) assert.ok(longest() < 1.5 * 30, `${longest()} m`);
    assert.ok(fine || longest() < 2500, `${longest()} m`);
    assert.equal(await meets(...middle), false);
    assert.equal(await meets(middle[0], 2000), true);
    assert.ok(worstNormal(arrays) < 2, `${worstNormal(arrays)} of 127`);
    const {metres, points} = await cut();
    assert.ok(Math.abs(metres - 194 * 30) < 1e-6, `${metres} m`);
    for (const [share, height] of points) {
      const row = 2.5 + 194 * share;
      if (Math.abs(row - 49) > 1e-6 && Math.abs(row - 150) > 1e-6) assert.equal(Number.isNaN(height), row > 49 && row < 150, `row ${row}`);
    }
    const fresh = new Arrays(24), other = new Tested('coast', {changed: message => fresh.apply(message)});
    await other.opened();
    await other.settle(view);
    await other.rest();
    assert.deepEqual(arrays.listed(), fresh.listed());
  }
});

test('a raster whose samples have no neighbours is shown as points', async () => {
  const flyer = new Tested('sparse');
  await flyer.opened();
  const state = await flyer.settle({eye: [0, 0, 900], direction: [0, 0.001, -1], error: 1, level: 0});
  await flyer.rest();
  assert.deepEqual([state.points, flyer.last.state.triangles], [800, 0]);
  const {hit} = await flyer.ask({type: 'pick', id: 1, origin: [3, 4, 900], direction: [0, 0, -1], angle: 0.02}, 'picked');
  assert.ok(Math.hypot(hit.place[0] - 3, hit.place[1] - 4) < 10, JSON.stringify(hit));
});

test('a scan switches to points and back without further requests', async () => {
  const flyer = new Tested('ball', {asPoints: true});
  assert.equal((await flyer.opened()).scene.kind, 'points');
  const [stop] = sites.flight('ball');
  await flyer.settle(stop);
  assert.equal(await flyer.hash(), stop.hash);
  assert.ok(!flyer.log.some(request => request.path === '/body.wasm'));
  for (const kind of ['surface', 'points', 'surface']) {
    const opened = flyer.opened();
    flyer.worker.send({type: 'show', asPoints: kind === 'points'});
    assert.equal((await opened).scene.kind, kind);
    await flyer.settle(stop);
    const [native] = sites.flight('ball', {kind});
    assert.equal(await flyer.hash(), native.hash);
  }
  const ranges = flyer.log.filter(({range}) => range).map(({path, range}) => path + range);
  assert.equal(new Set(ranges).size, ranges.length);
  assert.equal(flyer.log.filter(request => request.path === '/body.wasm').length, 1);
});

test('exaggerated heights change the view frame and nothing that is read, without further requests', async () => {
  const flyer = new Tested('hills'), first = await flyer.opened(), {box} = first.scene;
  assert.equal(first.exaggeration, 1);
  const camera = {eye: [0, 0, box[5] + 20_000], direction: [0, 0.01, -1], error: 2};
  const {points} = await flyer.settle(camera);
  const stored = [421.25, 377.5], before = await flyer.probe([...stored, 0], 0), line = [[...stored, 0], [500, 300, 0], 2];
  const profile = await flyer.profile(...line);
  const opened = flyer.opened();
  flyer.worker.send({type: 'exaggerate', exaggeration: 3});
  const again = await opened;
  assert.equal(again.exaggeration, 3);
  const near = (a, b) => assert.ok(Math.abs(a - b) <= 1e-9 * Math.abs(b), `${a} for ${b}`);
  again.scene.box.forEach((c, i) => near(c, i % 3 === 2 ? 3 * box[i] : box[i]));
  // Errors are larger now.
  assert.ok((await flyer.settle(camera)).points > points);
  const after = await flyer.probe([...stored, 0], 0);
  assert.deepEqual([...after.stored], [...before.stored]);
  near(after.place[2], 3 * before.place[2]);
  assert.deepEqual(await flyer.profile(...line), profile);
  const ranges = flyer.log.filter(({range}) => range).map(({path, range}) => path + range);
  // Questions and the picture fetch separately.
  assert.ok(new Set(ranges).size > 0.8 * ranges.length);
  // A link opens it like this at once; a scan ignores it.
  const linked = new Tested('hills', {exaggeration: 3});
  assert.deepEqual(Array.from((await linked.opened()).scene.box), Array.from(again.scene.box));
  const scan = new Tested('ball', {exaggeration: 3}), plain = new Tested('ball');
  const [stretched, usual] = await Promise.all([scan.opened(), plain.opened()]);
  assert.equal(stretched.exaggeration, 1);
  assert.deepEqual(Array.from(stretched.scene.box), Array.from(usual.scene.box));
});

test('a region has at least its level, and the rest of the store keeps its own', async () => {
  const flyer = new Tested('cloud'), {scene: {box}} = await flyer.opened();
  const view = region => flyer.view({eye: [0, 0, 300], direction: [0, 0.01, -1], up: [0, 1, 0], fov: 45, aspect: 1.5, height: 800, error: 1e6, region});
  const coarse = (await view()).state.points;
  const corner = [box[0], box[1], -1e30, box[0] + 20, box[1] + 20, 1e30];
  const fine = (await view({level: 0, box: corner})).state.points;
  // The corner has 5 % of the 40,000 points; clusters reach over its border.
  assert.ok(fine > coarse + 1800 && fine < coarse + 10_000, `${coarse} ${fine}`);
  assert.ok((await view({level: 1, box: corner})).state.points < fine);
  assert.equal((await view()).state.points, coarse);
});

for (const name of ['ball', 'kept']) {
  test(`manual control of ${name}: a cluster of a surface expands, collapses and is released; a point of it is picked`, async () => {
    const flyer = new Tested(name);
    await flyer.opened();
    // Without any detail a stored surface has only a few vertices.
    const camera = {eye: [40, 0, 0], direction: [-1, 0, 0], error: name === 'kept' ? 30 : 1e6};
    const before = (await flyer.settle(camera)).points;
    const {hit} = await flyer.ask({type: 'pick', id: 1, origin: [40, 0.1, 0.2], direction: [-1, 0, 0], angle: 0.01}, 'picked');
    assert.ok(hit.place[0] > 6 && hit.place[0] < 11, JSON.stringify(hit));
    flyer.worker.send({type: 'pin', cluster: hit.expandable, pin: 1});
    const more = (await flyer.settle(camera)).points;
    assert.ok(more > before, `${before} ${more}`);
    const {lines} = await flyer.ask({type: 'outline', level: hit.clusterLevel, ordinal: hit.clusterOrdinal}, 'outlined');
    assert.equal(lines.length % 2, 0);
    // Both ways by the same name.
    flyer.worker.send({type: 'pin', cluster: hit.expandable, pin: 0});
    assert.equal((await flyer.settle(camera)).points, before);
    flyer.worker.send({type: 'pin', cluster: hit.expandable, pin: 1});
    assert.equal((await flyer.settle(camera)).points, more);
    flyer.worker.send({type: 'pin', cluster: hit.expandable, pin: -1});
    assert.equal((await flyer.settle(camera)).points, before);
  });
}

test('a cluster of points expands manually, and its outline lists its points', async () => {
  const flyer = new Tested('cloud');
  await flyer.opened();
  const camera = {eye: [0, 0, 300], direction: [0, 0.01, -1], error: 1e6};
  const before = (await flyer.settle(camera)).points;
  const outline = async hit => (await flyer.ask({type: 'outline', level: hit.clusterLevel, ordinal: hit.clusterOrdinal}, 'outlined')).lines;
  const pick = async () => (await flyer.ask({type: 'pick', id: 1, origin: [0, 0, 300], direction: [0, 0, -1], angle: 0.05}, 'picked')).hit;
  const coarse = await pick();
  assert.equal((await outline(coarse)).length, 0, 'a cluster of the top is expanded');
  flyer.worker.send({type: 'pin', cluster: coarse.expandable, pin: 1});
  const more = (await flyer.settle(camera)).points - before;
  assert.ok(more > 0);
  let lines = new Uint32Array();
  // A member of the new cluster is somewhere near the head.
  for (let i = 0; i < 400 && lines.length === 0; ++i) {
    const at = [coarse.place[0] + (i % 20 - 10) / 5, coarse.place[1] + (Math.floor(i / 20) - 10) / 5];
    const {hit} = await flyer.ask({type: 'pick', id: 1, origin: [...at, 300], direction: [0, 0, -1], angle: 0.001}, 'picked');
    if (hit && hit.clusterLevel < coarse.clusterLevel) lines = await outline(hit);
  }
  // Each of the members and the head occurs twice, as both ends of a line.
  assert.equal(lines.length, 2 * (more + 1));
  for (let i = 0; i < lines.length; i += 2) assert.equal(lines[i], lines[i + 1]);
});

/// The answer of the command as rows of numbers.
function command(...args) {
  const {status, stdout, stderr} = spawnSync(process.env.TERRACE, [...args, '-q'], {cwd: sites.folder, encoding: 'utf8'});
  assert.equal(status, 0, `terrace ${args.join(' ')}: ${stderr}`);
  return stdout.trim().split('\n').slice(1).map(line => line.split(',').map(text => text === '' ? NaN : Number(text)));
}
/// Converts between the CRS and stored coordinates; neither store has a rotation.
const inStored = ({world: w}, [x, y]) => [(x - w[2]) / w[0], (y - w[5]) / w[4]];
const inWorld = ({world: w, coordinates: [, , z]}, s) => [w[0] * s[0] + w[2], w[4] * s[1] + w[5], s[2] * z.scale + z.offset];

for (const name of ['alps', 'hills', 'coast']) {
  test(`${name}: heights and profiles match the store, whatever is drawn`, async () => {
    const flyer = new Tested(name);
    const {manifest, scene} = await flyer.opened(), [x0, y0, , x1, y1] = scene.box;
    let off = 0, voids = 0;
    const profiles = [];
    for (const error of [1e6, 30, 1e6]) {
      const eye = [(x0 + x1) / 2, (y0 + y1) / 2, 2 * (x1 - x0)];
      await flyer.settle({eye, direction: [0, 0.001, -1], error});
      const asked = [];
      for (let i = 0; i < 24; ++i) {
        const [s, t] = [0.04 + 0.92 * ((i * 0.618) % 1), 0.04 + 0.92 * i / 24];
        const origin = [x0 + s * (x1 - x0), y0 + t * (y1 - y0), 2e4];
        const {hit} = await flyer.ask({type: 'pick', id: i, origin, direction: [0, 0, -1], angle: 0.001}, 'picked');
        if (hit) asked.push({hit, found: await flyer.probe(hit.stored, hit.reach)});
      }
      assert.ok(asked.length > 12, `${asked.length} places met`);
      writeFileSync(join(sites.folder, 'clicked.csv'), `x,y\n${asked.map(({hit}) => inWorld(manifest, hit.stored).slice(0, 2).join()).join('\n')}\n`);
      command('sample', `${name}.store`, '--points', 'clicked.csv').forEach(([x, y, height], i) => {
        const {hit, found} = asked[i];
        if (found === null) {
          ++voids;
          assert.ok(Number.isNaN(height), `the height ${height} at ${x} ${y} is not found`);
          return;
        }
        const [, , shown] = inWorld(manifest, found.stored);
        assert.ok(Math.abs(shown - height) < 1e-4, `${shown} m for ${height} m at ${x} ${y}`);
        assert.deepEqual([...found.stored].slice(0, 2), [...hit.stored].slice(0, 2));
        off = Math.max(off, Math.abs(inWorld(manifest, hit.stored)[2] - height));
      });
      const ends = [[0.12345, 0.13579], [0.81234, 0.77321]].map(([s, t]) => {
        const {world: w} = manifest;
        return [w[2] + s * w[0] * manifest.columns, w[5] + t * w[4] * manifest.rows];
      });
      profiles.push({ends, profile: await flyer.profile(...ends.map(end => [...inStored(manifest, end), 0]), 2)});
    }
    // The drawn surface must be far from the answers for this to test much.
    if (name !== 'coast') assert.ok(off > 5, `the drawn surface is off by ${off} m at most`);
    if (name === 'hills') assert.equal(voids, 0);
    const [{ends, profile}] = profiles;
    for (const other of profiles) assert.deepEqual(other, profiles[0]);
    assert.deepEqual([profile.level, profile.sampled], [0, false]);
    command('profile', `${name}.store`, '--line', ends.flat().join(), '-o', '-').forEach(([distance, , , height], i, rows) => {
      const [share, shown] = profile.points[i];
      assert.equal(Number.isNaN(shown), Number.isNaN(height), `row ${i}: ${shown} for ${height}`);
      if (!Number.isNaN(height)) assert.ok(Math.abs(shown - height) < 1e-4, `row ${i}: ${shown} m for ${height} m`);
      assert.ok(Math.abs(share - distance / rows.at(-1)[0]) < 0.01);
      assert.equal(rows.length, profile.points.length);
    });
  });
}

test('a long profile is sampled, and its samples are correct', async () => {
  const row = Array.from({length: 9000}, (_, column) => (500 + 300 * Math.sin(column / 40)).toFixed(2)).join(' ');
  writeFileSync(join(sites.folder, 'strip.asc'), `ncols 9000\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n${`${row}\n`.repeat(3)}`);
  sites.terrace('build', 'strip.asc', '-o', 'strip.store', '-q');
  sites.terrace('publish', 'strip.store', '-o', 'strip', '-q');
  const flyer = new Tested('strip', {site: join(sites.folder, 'strip')});
  await flyer.opened();
  const {metres, level, sampled, points} = await flyer.profile([0, 0.2, 0], [8999, 1.9, 0], 2);
  assert.deepEqual([level, sampled, points.length], [0, true, 1025]);
  assert.ok(Math.abs(metres - Math.hypot(8999, 1.7)) < 1e-6);
  for (const [share, height] of points) assert.ok(Math.abs(height - (500 + 300 * Math.sin(8999 * share / 40))) < 0.2, `${height} at ${share}`);
});

test('profiles of points and of scans show all points of a strip, whatever is drawn', async () => {
  for (const [name, from, to, axis] of [['cloud', [10, 30, 0], [90, 50, 3], 2], ['ball', [-15, -2, 0], [15, 2, 0], 2], ['ball', [-15, 0, -2], [15, 0, 2], 1]]) {
    const flyer = new Tested(name);
    await flyer.opened();
    const seen = [];
    for (const error of [1e6, 0.01]) {
      await flyer.settle({eye: [40, 0, 300], direction: [0, 0.01, -1], error});
      seen.push(await flyer.profile(from, to, axis));
    }
    assert.deepEqual(seen[0], seen[1]);
    const [{metres, level, points}] = seen, aside = axis === 2 ? 1 : 2;
    const length = Math.hypot(to[0] - from[0], to[aside] - from[aside]);
    assert.ok(Math.abs(metres - length) < 1e-9, `${metres} for ${length}`);
    assert.equal(level, 0);
    // All points of the store, one by one.
    const [dx, dy] = [(to[0] - from[0]) / length, (to[aside] - from[aside]) / length];
    const expected = readFileSync(join(sites.folder, `${name}.csv`), 'utf8').trim().split('\n').slice(1).flatMap(line => {
      const p = line.split(',').map(Number), [u, v] = [p[0] - from[0], p[aside] - from[aside]];
      const along = u * dx + v * dy, off = Math.abs(v * dx - u * dy);
      return along >= 0 && along <= length && off <= 0.01 * length ? [[along / length, p[axis]]] : [];
    }).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    assert.ok(expected.length > 200, `${expected.length} points`);
    assert.equal(points.length, expected.length);
    points.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    points.forEach(([share, height], i) => assert.ok(Math.hypot(share - expected[i][0], height - expected[i][1]) < 1e-9));
  }
});

test('a place on a scan gives the nearest point of the store', async () => {
  const flyer = new Tested('ball');
  await flyer.opened();
  const all = readFileSync(join(sites.folder, 'ball.csv'), 'utf8').trim().split('\n').slice(1).map(line => line.split(',').map(Number));
  for (const error of [1e6, 4]) {
    await flyer.settle({eye: [40, 0, 0], direction: [-1, 0, 0], error});
    for (const y of [-6, -2.5, 0, 3, 7]) {
      const {hit} = await flyer.ask({type: 'pick', id: 1, origin: [40, y, 0.2], direction: [-1, 0, 0], angle: 0.01}, 'picked');
      const far = p => Math.hypot(...p.map((c, k) => c - hit.stored[k]));
      const found = await flyer.probe(hit.stored, hit.reach), least = Math.min(...all.map(far));
      assert.ok(least <= hit.reach);
      assert.ok(Math.abs(far([...found.stored]) - least) < 1e-9, `${far([...found.stored])} for ${least}`);
      assert.equal(found.level, 0);
    }
  }
});

test('a query fetches missing data in few rounds, and again after damage', async () => {
  let damaged = 0;
  const flyer = new Tested('hills', {
    fault: (request, response) => {
      if (request.cache === 'reload' || !request.range || !flyer?.questioned || damaged > 0) return response;
      ++damaged;
      return {...response, body: Buffer.from(response.body.map(byte => byte ^ 0x55))};
    }
  });
  const {manifest} = await flyer.opened();
  await flyer.settle({eye: [0, 0, 1e6], direction: [0, 0.001, -1], error: 1e6});
  const before = flyer.log.length;
  const {points} = await flyer.profile([10, 20, 0], [900, 950, 0], 2);
  const waves = flyer.log.slice(before).filter(({unanswered}) => unanswered === 0).length;
  assert.ok(points.every(([, height]) => Number.isFinite(height)) && points.length > 1000);
  assert.ok(waves <= 60, `${waves} waves of requests`);
  flyer.questioned = true;
  const found = await flyer.probe([501.25, 17.5, 0], 0);
  assert.equal(damaged, 1);
  assert.equal(manifest.kind, 'grid');
  assert.ok(found !== null);
});

test('the legend lists the classes of all points, or as they load if the start file has none', async () => {
  const known = new Tested('cloud');
  assert.deepEqual([...(await known.opened()).scene.colours.classes], [2, 9]);
  // As for a store with too many points.
  const site = join(sites.folder, 'unsaid');
  cpSync(sites.site, site, {recursive: true});
  const start = readFileSync(join(site, 'stores', 'rare.start')), end = start.indexOf(10);
  const {classes, ...head} = JSON.parse(start.subarray(0, end).toString());
  assert.deepEqual(classes, [2, 7, 9]);
  writeFileSync(join(site, 'stores', 'rare.start'), Buffer.concat([Buffer.from(JSON.stringify(head)), start.subarray(end)]));
  const flyer = new Tested('rare', {site});
  assert.deepEqual([...(await flyer.opened()).scene.colours.classes], [2, 9]);
  const told = flyer.until(message => message.type === 'classes');
  await flyer.settle({eye: [0, 0, 300], direction: [0, 0.01, -1], error: 0.01});
  assert.deepEqual([...(await told).classes], [2, 7, 9]);
});

test('an open scan: a ray through its opening meets the far side', async () => {
  const flyer = new Tested('bowl');
  await flyer.opened();
  await flyer.settle({eye: [40, 0, 0], direction: [-1, 0, 0], error: 0.5});
  await flyer.hash();  // computes the surface from scratch
  const picked = flyer.until(message => message.type === 'picked');
  flyer.worker.send({type: 'pick', id: 1, origin: [40, 0.1, 0.2], direction: [-1, 0, 0], angle: 0.01});
  const {hit} = await picked;
  assert.ok(hit.place[0] < -6, JSON.stringify(hit));
});

test('the module for bodies cannot be fetched: a message, and a retry succeeds', async () => {
  let bad = true;
  const flyer = new Tested('ball', {
    fault: (request, response) => bad && request.path === '/body.wasm' ? {status: 404, headers: {}, body: Buffer.alloc(0)} : response
  });
  assert.match(await flyer.failed(), /HTTP 404/);
  bad = false;
  const opened = flyer.opened();
  flyer.worker.send({type: 'retry'});
  assert.equal((await opened).scene.kind, 'surface');
});

test('few requests: small ones wait for open ones', async () => {
  const flyer = new Tested('made', {latency: 10, site: made()});
  const {scene: {box}} = await flyer.opened();
  const middle = [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2], high = box[4] - box[1];
  // The whole store in view, which needs the index of level 0.
  await flyer.settle({eye: [middle[0], middle[1] - high, box[5] + high], direction: [0, Math.SQRT1_2, -Math.SQRT1_2], error: 1});
  let small = 0;
  for (const {path, range, unanswered} of flyer.log.filter(request => request.range)) {
    const [first, last] = /(\d+)-(\d+)/.exec(range).slice(1).map(Number);
    if (last - first + 1 >= 16384) continue;
    ++small;
    assert.equal(unanswered, 0, `${path} ${range}`);
  }
  assert.ok(small > 0);
});

// Far away more becomes known while answers travel, so that small ranges wait less.
for (const [latency, most] of [[1, 75], [30, 75], [100, 90]]) {
  test(`a flight to full detail takes few requests and not twice the clusters read, answers after ${latency} ms`, async () => {
    const time = new VirtualTime(), {fetch, log} = folderFetch(made(), undefined, latency, time);
    const connect = receive => new Worker(join(made(), 'worker.js'), fetch, receive, 1, time);
    const {state, stats} = await dive(connect, 'http://folder/', 'made', shareOf(60_000, 2048 ** 2), 33, time);
    assert.ok(state.settled && state.points > 60_000, `${state.points} points`);
    const twice = new Set();  // bytes are fetched once
    for (const {path, range} of log.filter(request => request.range)) {
      assert.ok(!twice.has(`${path} ${range}`), `${path} ${range}`);
      twice.add(`${path} ${range}`);
    }
    assert.equal(stats.requests, twice.size + 1);
    const figures = `${stats.requests} requests, ${stats.bytes} bytes, ${state.storedBytes} of clusters`;
    console.log(figures);
    assert.ok(stats.requests <= most, figures);
    assert.ok(stats.bytes <= 2 * state.storedBytes, figures);  // a seventh of it is the start file
  });
}

test('the first picture needs only the start file', async () => {
  const flyer = new Tested('alps');
  await flyer.opened();
  assert.deepEqual(flyer.log.map(request => request.path), ['/core.wasm', '/stores/alps.start']);
  const start = readFileSync(join(sites.site, 'stores', 'alps.start')).length;
  assert.ok(start <= 300_000, `${start} bytes`);
});

const CLOSE = {eye: [2000, -9000, 9000], direction: [0, 0.7071067811865476, -0.7071067811865476], error: 4};

/// A pattern of the message, and how responses to range requests are spoiled.
const FAULTS = {
  'a whole file instead of a part': [/whole file.*200/, request => ({status: 200, headers: {}, body: request.body})],
  'a missing file': [/not found.*404/, () => ({status: 404, headers: {}, body: Buffer.alloc(0)})],
  'a shorter file': [/smaller.*416/, () => ({status: 416, headers: {}, body: Buffer.alloc(0)})],
  'a short body': [/bytes received/, response => ({...response, body: response.body.subarray(1)})],
  'a body that breaks off': [/connection was lost/, response => ({...response, body: null})],
  'compressed parts': [/compresses parts.*Turn/, (response, {method}) => method === 'HEAD' ? response : null],
  'another part': [/wrong part/, response => ({...response, headers: {'Content-Range': 'bytes 0-1/2'}})],
  'a replaced file': [
    /replaced/,
    response => ({...response, headers: {'Content-Range': response.headers['Content-Range'].replace(/\d+$/, '99999999')}})
  ],
  'a broken server': [/HTTP 503/, () => ({status: 503, headers: {}, body: Buffer.alloc(0)})],
  'a dead server': [/does not answer/, () => null],
  'damaged bytes': [/checksum|damaged/i, response => ({...response, body: response.body.map(b => b ^ 0x5a)})]
};
for (const [name, [expected, spoil]] of Object.entries(FAULTS)) {
  test(`${name}: a message, no wrong picture, and a retry succeeds`, async () => {
    let bad = true;
    const flyer = new Tested('alps', {
      fault: (request, response) => bad && (request.range || request.method === 'HEAD') ? spoil(response, request) : response
    });
    await flyer.opened();
    const failed = flyer.failed();
    const settled = flyer.settle(CLOSE);
    assert.match(await failed, expected);
    assert.ok(!flyer.last?.state.settled);
    bad = false;
    flyer.worker.send({type: 'retry'});
    await settled;
    const fine = new Tested('alps');
    await fine.opened();
    await fine.settle(CLOSE);
    assert.equal(await flyer.hash(), await fine.hash());
  });
}

test('a single short body or damaged part is fetched again silently', async () => {
  for (const spoil of [FAULTS['a short body'][1], FAULTS['damaged bytes'][1], FAULTS['a broken server'][1]]) {
    let left = 1;
    const flyer = new Tested('alps', {fault: (request, response) => request.range && left-- > 0 ? spoil(response) : response});
    await flyer.opened();
    await flyer.settle(CLOSE);
    assert.ok(!flyer.messages.includes('failed'));
  }
});

test('a server stops answering: a message after two tries, and a retry succeeds', async () => {
  let silent = range => range;
  const flyer = new Tested('alps', {haste: 100, fault: ({range}, response) => silent(range) ? undefined : response});
  await flyer.opened();
  const failed = flyer.failed(), stop = sites.flight('alps')[1];
  flyer.worker.send({type: 'view', serial: 1, camera: {...stop, up: [0, 0, 1], fov: 45, aspect: 1.5, height: 800}});
  assert.match(await failed, /silent for 10 seconds/);
  const tries = flyer.log.filter(({range}) => range).map(({path, range}) => path + range);
  assert.ok(tries.some(range => tries.filter(other => other === range).length === 2));
  silent = () => false;
  flyer.worker.send({type: 'retry'});
  const state = await flyer.settle(stop);
  assert.equal(state.points, stop.points);

  const dead = new Tested('alps', {haste: 100, fault: () => undefined});
  assert.match(await dead.failed(), /silent/);
});

test('opens the store of the link, or else the first of stores.json', async () => {
  for (const [name, chosen] of [['cloud', 'cloud'], ['', 'alps'], ['nothing', 'alps']]) {
    const flyer = new Tested(name, {choose: true});
    const message = await flyer.until(message => message.type === 'chosen');
    assert.equal(message.name, chosen);
    assert.ok(message.stores.length >= 5);
    await flyer.opened();
    assert.ok(flyer.log.some(({path}) => path === `/stores/${chosen}.start`));
  }
});

test('a missing or damaged start file: a message, and a retry succeeds', async () => {
  for (const [expected, spoil] of [
           [/HTTP 404/, () => ({status: 404, headers: {}, body: Buffer.alloc(0)})],
           [/start file.*damaged/, response => ({...response, body: response.body.subarray(0, -1)})],
           [/start file.*damaged/, response => ({...response, body: Buffer.from('<html>')})]]) {
    let bad = true;
    const flyer = new Tested('alps', {fault: (request, response) => bad && request.path.endsWith('.start') ? spoil(response) : response});
    assert.match(await flyer.failed(), expected);
    bad = false;
    const opened = flyer.opened();
    flyer.worker.send({type: 'retry'});
    await opened;
  }
});
