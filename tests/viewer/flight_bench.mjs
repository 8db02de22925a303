// SPDX-License-Identifier: GPL-3.0-or-later
// flight_bench.mjs [STORE]: what a frame takes in the viewer's worker, in node, and what a flight fetches. TERRACE names
// the command. Without STORE a made raster of 8192 x 8192 cells is flown over.
//
// The first flight keeps some 500,000 points: 600 frames, each 1 % of the picture's width further. The second goes down
// from the whole to full detail of 1 % of the area. Times are of the worker (the model's step, normals, slides and copies
// of what has changed), bytes those of requests, the start file included, against the stored bytes of all clusters read.
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {basename, join, resolve} from 'node:path';
import {spawnSync} from 'node:child_process';

import {folderFetch, Worker} from './worker_host.mjs';

const FRAMES = 600, POINTS = 500_000;
const small = process.env.TERRACE_BENCH_SMALL !== undefined;
const folder = mkdtempSync(join(tmpdir(), 'terrace-flight-'));

function terrace(...args) {
  const {status, stderr} = spawnSync(process.env.TERRACE, args, {encoding: 'utf8'});
  if (status !== 0) throw new Error(`terrace ${args.join(' ')}: ${stderr}`);
}

class Flyer {
  constructor(name, maxPoints) {
    const site = join(folder, 'site');
    this.serial = 0;
    this.waiting = [];
    this.times = [];
    this.worker = new Worker(join(site, 'worker.js'), folderFetch(site).fetch, message => {
      if (message.type === 'failed') throw new Error(message.message);
      if (message.type === 'frame') {
        this.last = message;
        this.times.push(message.milliseconds);
      }
      this.waiting = this.waiting.filter(wait => !wait(message));
    });
    this.worker.tell({
      type: 'open',
      wasm: 'http://folder/core.wasm',
      store: `http://folder/stores/${name}/`,
      start: `http://folder/stores/${name}.start`,
      maxPoints
    });
  }
  until(is) {
    return new Promise(done => this.waiting.push(message => is(message) && (done(message), true)));
  }
  /// The first frame of a view, or the last.
  async view(camera, settled) {
    const serial = ++this.serial;
    const done = this.until(m => m.type === 'frame' && m.serial === serial && (!settled || m.state.settled));
    this.worker.tell({type: 'view', serial, camera: {...camera, up: [0, 1, 0], fov: 45, aspect: 1.6, height: 1000}});
    return done;
  }
}

const quantile = (times, q) => [...times].sort((a, b) => a - b)[Math.min(times.length - 1, Math.floor(q * times.length))];

try {
  let store = process.argv[2] && resolve(process.argv[2]);
  if (!store) {
    store = join(folder, 'dem.store');
    terrace('synth', 'dem', '--size', small ? '300x300' : '8192x8192', '-o', join(folder, 'dem.tif'), '-q');
    terrace('build', join(folder, 'dem.tif'), '-o', store, '-q');
  }
  terrace('publish', store, '-o', join(folder, 'site'), '-q');
  const name = basename(store).replace(/\.(store|terrace)$/, '');

  // Level flight over the middle, looking ahead and down.
  const flyer = new Flyer(name, 1_500_000);
  const {scene: {box}} = await flyer.until(m => m.type === 'opened');
  const size = Math.hypot(box[3] - box[0], box[4] - box[1]);
  const middle = [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2];
  const along = share => ({
    eye: [middle[0] + share * size, middle[1] - 0.12 * size, box[5] + 0.12 * size],
    direction: [0, Math.SQRT1_2, -Math.SQRT1_2]
  });
  // There is more to see further on.
  let error = 64;
  for (let points = 0; points < 0.8 * POINTS && error > 0.25;) {
    error /= 1.1;
    points = (await flyer.view({...along(-0.2), error}, true)).state.points;
  }
  flyer.times = [];
  let points = 0;
  const width = 1.6 * 0.24 * size * Math.tan(22.5 * Math.PI / 180);
  for (let i = 0; i < FRAMES; ++i) {
    const step = Math.min(i % 400, 400 - i % 400);  // there and back
    points += (await flyer.view({...along(-0.2 + 0.01 * width / size * step), error}, false)).state.points / FRAMES;
  }
  const {times} = flyer;
  console.log('| frames of the worker | p50, ms | p99, ms | worst, ms | points in the mean | pixels of error |\n|---|---|---|---|---|---|');
  console.log(`| ${times.length} | ${quantile(times, 0.5).toFixed(1)} | ${quantile(times, 0.99).toFixed(1)} | ` +
              `${Math.max(...times).toFixed(1)} | ${Math.round(points).toLocaleString('en')} | ${error.toFixed(2)} |`);

  // Down to 1 % of the area.
  const diver = new Flyer(name, 1_500_000);
  await diver.until(m => m.type === 'opened');
  const from = 1.2 * size, to = 0.1 * (box[4] - box[1]) / (2 * Math.tan(22.5 * Math.PI / 180));
  for (let i = 0; i <= 60; ++i) {
    const above = from * (to / from) ** (i / 60);
    await diver.view({eye: [...middle, box[5] + above], direction: [0, 0, -1], error: i < 60 ? 4 : 0.01}, i === 60);
  }
  const {state, stats} = diver.last;
  console.log('\n| down to 1 % of the area | requests | fetched | clusters read | ratio |\n|---|---|---|---|---|');
  console.log(`| ${state.points.toLocaleString('en')} points | ${stats.requests} | ${stats.bytes.toLocaleString('en')} | ` +
              `${state.storedBytes.toLocaleString('en')} | ${(stats.bytes / state.storedBytes).toFixed(2)} |`);
} finally {
  rmSync(folder, {recursive: true, force: true});
}
process.exit(0);
