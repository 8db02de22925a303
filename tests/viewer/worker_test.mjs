// SPDX-License-Identifier: GPL-3.0-or-later
// worker_test.mjs: the viewer's worker, as it is shipped, in node over published stores. TERRACE names the command,
// FLIGHT_HASHES the native flight.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
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
  constructor(name, {fault, maxPoints = MAX_POINTS} = {}) {
    const {fetch, log} = folderFetch(sites.site, fault);
    const messages = [];
    let blocks = 0;
    super(heard => new Worker(join(sites.site, 'worker.js'), fetch, heard), 'http://folder/', name, {
      maxPoints,
      heard: message => {
        messages.push(message.type);
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

for (const name of ['alps', 'flat', 'cloud']) {
  test(`a flight over ${name} gives the hashes of the native run`, async () => {
    const flight = sites.flight(name);
    assert.ok(new Set(flight.map(stop => stop.hash)).size >= 4, 'the flight does not change what is shown');
    const flyer = new Tested(name);
    const {scene} = await flyer.opened();
    assert.equal(scene.triangles, name !== 'cloud');
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
        assert.match(path, /^\/(core\.wasm|stores\/\w+\.start)$/);
        continue;
      }
      assert.match(path, /^\/stores\/\w+\/level-\d+\.0\.(clusters|index)$/);
      assert.ok(!seen.has(path + range), `${path} ${range} twice`);
      seen.add(path + range);
    }
  });
}

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
