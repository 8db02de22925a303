// SPDX-License-Identifier: GPL-3.0-or-later
// first_picture_bench.mjs PACKAGES [STORE [ROUNDS]]: measures milliseconds from navigation until
// the first picture of a store is on the screen of headless Chromium, in a new browser and in one
// that has shown a page before; prints medians. TERRACE names the command, CHROMIUM the browser.
// Without STORE, uses a synthetic raster of 8192 x 8192 cells.
import {spawn, spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {launch} from '../clients/globe.mjs';

const folder = mkdtempSync(join(tmpdir(), 'terrace-first-picture-'));
function terrace(...args) {
  const {status, stderr} = spawnSync(process.env.TERRACE, args, {encoding: 'utf8'});
  if (status !== 0) throw new Error(`terrace ${args.join(' ')}: ${stderr}`);
}
function made() {
  terrace('synth', 'dem', '--size', '8192x8192', '-o', join(folder, 'made.tif'));
  terrace('build', join(folder, 'made.tif'), '-o', join(folder, 'made.terrace'));
  return join(folder, 'made.terrace');
}
const median = values => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];

/// Milliseconds until two frames after the first triangles or points arrived.
async function firstPicture(browser, url) {
  const context = await browser.newContext({viewport: {width: 960, height: 600}});
  const page = await context.newPage();
  await page.addInitScript(() => {
    const frame = () => new Promise(requestAnimationFrame);
    window.firstPicture = (async () => {
      while (!(window.terrace?.state.points > 0)) await frame();
      await frame();
      await frame();
      return performance.now();
    })();
  });
  await page.goto(url, {waitUntil: 'commit'});
  const milliseconds = await page.evaluate(() => window.firstPicture);
  await context.close();
  return milliseconds;
}

let server;
try {
  const store = process.argv[3] ?? made(), rounds = Number(process.argv[4] ?? 7);
  server = spawn(process.env.TERRACE, ['view', store, '--no-open']);
  const url = await new Promise(resolve => {
    let output = '';
    const hear = text => {
      output += text;
      const found = /http:\/\/\S+/.exec(output);
      if (found) resolve(found[0]);
    };
    server.stdout.on('data', hear);
    server.stderr.on('data', hear);
  });
  const fresh = [], warm = [];
  for (let i = 0; i < rounds; ++i) {
    const browser = await launch();
    fresh.push(await firstPicture(browser, url));
    warm.push(await firstPicture(browser, url));
    await browser.close();
  }
  console.log(`first picture after ${median(fresh).toFixed(0)} ms in a new browser, ${median(warm).toFixed(0)} ms later on (medians of ${rounds})`);
} finally {
  server?.kill();
  rmSync(folder, {recursive: true, force: true});
}
