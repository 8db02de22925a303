// SPDX-License-Identifier: GPL-3.0-or-later
// flight_bench.mjs [PACKAGES [STORE]]: measures the frames of the viewer's worker, in node and in headless Chromium,
// and the data that a flight fetches. TERRACE names the command, CHROMIUM the browser; without CHROMIUM and PACKAGES
// (npm's, with playwright-core) only node is measured. STORE is a store, or a published folder, whose first store is
// used; without it, a synthetic raster of 8192 x 8192 cells.
//
// The first flight keeps 500,000 points on average in 600 pictures at 60 per second. It is flown twice if
// TERRACE_BENCH_ERROR gives the pixel error that an earlier run found and printed. The worker measures its own times (the
// model's step, normals, slides, and copies of the changes). The second flight goes down from the whole to full detail of
// 268,000 samples, at 30 frames per second. In node its time is simulated, so that requests do not depend on the machine.
// Seconds count from the last view to full detail. Bytes are those of requests, start file included, compared with the
// stored bytes of all clusters read; the columns for the start file, the index and clusters are shares of that ratio.
import {existsSync, mkdtempSync, readFileSync, rmSync, statSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';
import {spawnSync} from 'node:child_process';

import {cruise, dive, shareOf} from './flyer.mjs';
import {serveSite} from './site_server.mjs';
import {VirtualTime} from './virtual_time.mjs';
import {folderFetch, Worker} from './worker_host.mjs';

const small = process.env.TERRACE_BENCH_SMALL !== undefined;
const FRAMES = small ? 60 : 600, POINTS = small ? 20_000 : 500_000, SAMPLES = small ? 20_000 : 268_000, PACE = 33;
const folder = mkdtempSync(join(tmpdir(), 'terrace-flight-'));
let site = join(folder, 'site');

function terrace(...args) {
  const {status, stderr} = spawnSync(process.env.TERRACE, args, {encoding: 'utf8'});
  if (status !== 0) throw new Error(`terrace ${args.join(' ')}: ${stderr}`);
}

/// Calls a function of flyer.mjs in a page of Chromium.
async function inChromium(browser, url, call, ...args) {
  const page = await browser.newPage();
  try {
    await page.goto(`${url}stores.json`);
    await page.addScriptTag({
      type: 'module',
      content: `${readFileSync(new URL('flyer.mjs', import.meta.url), 'utf8')}
        window.flights = {cruise, dive};
        window.connect = receive => {
          const worker = new Worker('worker.js');
          worker.onmessage = ({data}) => {
            receive(data);
            const buffer = data.changes?.buffer;
            if (buffer) worker.postMessage({type: 'drawn', buffer}, [buffer]);
          };
          return {send: message => worker.postMessage(message)};
        };`
    });
    return await page.evaluate(([call, ...args]) => window.flights[call](window.connect, ...args), [call, url, ...args]);
  } finally {
    await page.close();
  }
}

/// Bytes of the requests for files with this extension.
function fetched(log, ending) {
  let bytes = 0;
  for (const {path, range} of log.filter(request => request.path.endsWith(ending))) {
    const [first, last] = /(\d+)-(\d+)$/.exec(range ?? '')?.slice(1).map(Number) ?? [0, statSync(join(site, path)).size - 1];
    bytes += last - first + 1;
  }
  return bytes;
}

const quantile = (times, q) => times.toSorted((a, b) => a - b)[Math.min(times.length - 1, Math.floor(q * times.length))];
const ERROR = Number(process.env.TERRACE_BENCH_ERROR ?? 0);
const count = n => n.toLocaleString('en');

let browser, server;
try {
  let store = process.argv[3] && resolve(process.argv[3]);
  if (!store) {
    store = join(folder, 'dem.store');
    terrace('synth', 'dem', '--size', small ? '300x300' : '8192x8192', '-o', join(folder, 'dem.tif'), '-q');
    terrace('build', join(folder, 'dem.tif'), '-o', store, '-q');
  }
  if (existsSync(join(store, 'stores.json'))) {
    site = store;
  } else {
    terrace('publish', store, '-o', site, '-q');
  }
  const {name, points: all} = JSON.parse(readFileSync(join(site, 'stores.json'), 'utf8')).stores[0];

  // Each flight has its own log, because the previous flight's worker may continue for a while.
  let files;
  const inNode = (latency, time) => (fly, ...args) => {
    files = folderFetch(site, undefined, latency, time);
    return fly(receive => new Worker(join(site, 'worker.js'), files.fetch, receive, 1, time), 'http://folder/', name, ...args);
  };
  const simulated = latency => {
    const time = new VirtualTime();
    return [`node, simulated, answers after ${latency} ms`, (...args) => inNode(latency, time)(...args, time), () => files.log];
  };
  const hosts = [['node', inNode(1), () => files.log]];
  if (process.env.CHROMIUM && process.argv[2]) {
    const {launch} = await import('../clients/globe.mjs');
    server = await serveSite(site);
    browser = await launch();
    hosts.push(['Chromium', (fly, ...args) => inChromium(browser, server.url, fly.name, name, ...args), () => server.log]);
  }
  console.log('| frames of the worker | frames | p50, ms | p99, ms | worst, ms | points in the mean | pixels of error |\n|---|---|---|---|---|---|---|');
  for (const [host, fly] of hosts) {
    const {milliseconds, points, error} = await fly(cruise, POINTS, FRAMES, ERROR);
    console.log(`| ${host} | ${milliseconds.length} | ${quantile(milliseconds, 0.5).toFixed(1)} | ` +
                `${quantile(milliseconds, 0.99).toFixed(1)} | ${Math.max(...milliseconds).toFixed(1)} | ${count(points)} | ${error.toFixed(2)} |`);
  }
  hosts.splice(0, 1, ...[1, 30, 100].map(simulated));
  console.log(`\n| down to ${count(SAMPLES)} samples | points | requests | fetched | clusters read | ratio | start file | index | clusters | seconds |\n` +
              '|---|---|---|---|---|---|---|---|---|---|');
  for (const [host, fly, log] of hosts) {
    if (server) server.log.length = 0;
    const {state, stats, seconds} = await fly(dive, shareOf(SAMPLES, all), PACE);
    const share = ending => (fetched(log(), ending) / state.storedBytes).toFixed(2);
    console.log(`| ${host} | ${count(state.points)} | ${stats.requests} | ${count(stats.bytes)} | ${count(state.storedBytes)} | ` +
                `${(stats.bytes / state.storedBytes).toFixed(2)} | ${share('.start')} | ${share('.index')} | ${share('.clusters')} | ${seconds.toFixed(1)} |`);
  }
} finally {
  await browser?.close();
  await server?.close();
  rmSync(folder, {recursive: true, force: true});
}
process.exit(0);
