// SPDX-License-Identifier: GPL-3.0-or-later
// globe_picture.mjs PACKAGES FOLDER OUT [WIDTHxHEIGHT]: takes a picture of FOLDER/globe.html, the page
// of the guide to web globes, with the tiles in FOLDER/tiles and CesiumJS from PACKAGES.
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {launch} from '../../tests/clients/globe.mjs';
import {serve} from '../../tests/clients/tile_server.mjs';

const [, , packages, folder, out, size = '1000x560'] = process.argv;
const [width, height] = size.split('x').map(Number);
// The same page, with CesiumJS from here instead of from the internet.
const text = readFileSync(join(folder, 'globe.html'), 'utf8');
const local = text.replaceAll(/https:\/\/cesium\.com\/downloads\/cesiumjs\/releases\/[0-9.]+\/Build\/Cesium\//g, '/cesium/');
if (local === text) throw new Error('globe.html does not load CesiumJS');
writeFileSync(join(folder, 'local.html'), local.replace('<meta charset="utf-8">', "<meta charset=\"utf-8\"><script>CESIUM_BASE_URL = '/cesium/'</script>")
  .replace('const viewer =', 'const viewer = window.viewer ='));

const server = await serve({site: {folder}, cesium: {folder: join(packages, 'node_modules/cesium/Build/Cesium')}});
const browser = await launch();
try {
  const page = await browser.newPage({viewport: {width, height}});
  const errors = [];
  page.on('pageerror', error => errors.push(error.message));
  page.on('response', answer => answer.status() >= 400 && errors.push(`${answer.status()} ${answer.url()}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/site/local.html`);
  // Between two zooms everything that was asked for is loaded for a moment.
  await page.waitForFunction(() => {
    if (!window.viewer?.scene.globe.tilesLoaded) window.since = undefined;
    else window.since ??= performance.now();
    return performance.now() - window.since > 15_000;
  }, null, {timeout: 240_000, polling: 200});
  if (errors.length) throw new Error(errors.join('\n'));
  await page.screenshot({path: out, type: 'jpeg', quality: 82});
} finally {
  await browser.close();
  server.close();
  server.closeAllConnections();
}
