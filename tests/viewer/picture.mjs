// SPDX-License-Identifier: GPL-3.0-or-later
// picture.mjs PACKAGES STORE LINK OUT [WIDTHxHEIGHT [dark]]: takes a picture of a store in the
// viewer with headless Chromium once everything has loaded. TERRACE names the command, CHROMIUM the
// browser. docs/tools/pictures.py takes the manual's pictures of the viewer with it.
import {mkdtempSync, rmSync} from 'node:fs';
import {spawnSync} from 'node:child_process';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {launch} from '../clients/globe.mjs';
import {serveSite} from './site_server.mjs';

const [, , , store, link, out, size = '1200x680', theme = 'light'] = process.argv;
const [width, height] = size.split('x').map(Number);
const folder = mkdtempSync(join(tmpdir(), 'terrace-picture-'));
let server, browser;
try {
  const {status, stderr} = spawnSync(process.env.TERRACE, ['publish', store, '-o', join(folder, 'site'), '-q'], {encoding: 'utf8'});
  if (status !== 0) throw new Error(stderr);
  server = await serveSite(join(folder, 'site'));
  browser = await launch();
  const context = await browser.newContext({viewport: {width, height}, colorScheme: theme});
  const page = await context.newPage();
  await page.goto(server.url + link);
  await page.waitForFunction(() => window.terrace?.settled, null, {timeout: 120_000});
  await page.waitForTimeout(1200);
  await page.screenshot({path: out, ...(out.endsWith('.jpg') ? {type: 'jpeg', quality: 82} : {})});
} finally {
  await browser?.close();
  await server?.close();
  rmSync(folder, {recursive: true, force: true});
}
