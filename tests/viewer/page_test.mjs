// SPDX-License-Identifier: GPL-3.0-or-later
// page_test.mjs PACKAGES: tests the viewer in headless Chromium over published stores and over
// `terrace view`. TERRACE names the command, FLIGHT_HASHES the native flight, CHROMIUM the browser.
// Pictures are kept in PACKAGES.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, describe, test} from 'node:test';

import {launch} from '../clients/globe.mjs';
import {packages} from '../clients/packages.mjs';
import {serveSite} from './site_server.mjs';
import {Sites} from './sites.mjs';

const sites = new Sites();
/// As in connection.ts.
const MAX_POINTS = 1_500_000;
let browser, site;

before(async () => {
  sites.build();
  site = await serveSite(sites.site);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await site?.close();
  sites.remove();
});

/// A context of the browser and a server that are closed when test `t` ends, also when it fails: what is left open keeps node
/// from exiting.
async function newContext(t, options) {
  const context = await browser.newContext(options);
  t.after(() => context.close());
  // Software rendering is slow, above all while other tests run.
  context.setDefaultTimeout(120_000);
  return context;
}
async function serve(t, folder) {
  const server = await serveSite(folder);
  t.after(() => server.close());
  return server;
}

/// Opens a page that must not request anything elsewhere; `errors` lists the errors on its console.
async function open(t, hash = '', {url = site.url, size = {width: 720, height: 450}, dark = false, settle = true} = {}) {
  const context = await newContext(t, {viewport: size, colorScheme: dark ? 'dark' : 'light'});
  const page = await context.newPage();
  const errors = [], outside = [];
  page.on('console', message => message.type() === 'error' && errors.push(message.text()));
  page.on('pageerror', error => errors.push(error.message));
  await context.route('**/*', route => {
    const {protocol, hostname} = new URL(route.request().url());
    if (hostname === '127.0.0.1' || protocol === 'data:' || protocol === 'blob:' || protocol === 'file:') return route.continue();
    outside.push(route.request().url());
    return route.abort();
  });
  await page.goto(url + hash);
  if (settle) await settled(page);
  return {page, errors, outside, close: () => context.close()};
}
async function settled(page) {
  try {
    await page.waitForFunction(() => window.terrace?.settled, null, {timeout: 120_000});
  } catch (error) {
    throw new Error(`${error.message} ${page.url()} ${JSON.stringify(await state(page))} ${await page.textContent('body')}`);
  }
}
const state = page => page.evaluate(() => window.terrace?.state);
/// The rows of the panel of a place, once the store has been read there.
async function place(page) {
  await page.waitForSelector('#place:not([hidden])');
  await page.waitForFunction(() => !/reading/.test(document.getElementById('place-text').textContent));
  return Object.fromEntries(await page.$$eval('#place-text dt', dts => dts.map(dt => [dt.textContent, dt.nextElementSibling.textContent])));
}
/// The labels and the path of the profile.
async function profile(page) {
  await page.waitForSelector('#profile:not([hidden])');
  return page.evaluate(() => [
    ...['low', 'length', 'high'].map(part => document.getElementById(`profile-${part}`).textContent),
    document.querySelector('#profile path').getAttribute('d')
  ]);
}

/// Colours of the picture at some positions, 0 to 255.
const pixels = (page, places) => page.evaluate(places => {
  const canvas = document.getElementById('picture'), gl = canvas.getContext('webgl2');
  return places.map(([x, y]) => {
    const pixel = new Uint8Array(4);
    gl.readPixels(Math.round(x * canvas.width), Math.round((1 - y) * canvas.height), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return Array.from(pixel.slice(0, 3));
  });
}, places);

test('a DEM: refines by range requests alone, like the native run', async t => {
  site.log.length = 0;
  const {page, errors, outside} = await open(t, '#s=alps&q=16');
  assert.equal(await page.title(), 'alps · terrace');
  for (const {path, range, status} of site.log) {
    if (range === null) {
      assert.match(path, /^\/($|index\.html|viewer\.(js|css)|worker\.js|core\.wasm|stores\.json|stores\/alps\.start)$/);
    } else {
      assert.equal(status, 206);
      assert.match(path, /^\/stores\/alps\/level-/);
    }
  }
  const data = site.log.filter(({path}) => path.startsWith('/stores/')).reduce((sum, {bytes}) => sum + bytes, 0);
  assert.equal((await state(page)).bytes, data);
  // Within its budget: a quarter of the store at this error, and each range once.
  assert.ok(data < 600_000, `${data} bytes`);
  const ranges = site.log.filter(({range}) => range !== null).map(({path, range}) => path + range);
  assert.equal(new Set(ranges).size, ranges.length);
  // Drawing a million triangles in software takes minutes; the worker's test flies the whole path.
  for (const stop of sites.flight('alps', {maxPoints: MAX_POINTS}).slice(0, 1)) {
    await page.evaluate(({eye, direction, error}) => window.terrace.fly(eye, direction, 1.5, 800, error), stop);
    await settled(page);
    assert.equal((await state(page)).points, stop.points);
    assert.equal(await page.evaluate(() => window.terrace.hash()), stop.hash);
  }
  assert.deepEqual(errors, []);
  assert.deepEqual(outside, []);
});

test('the picture: land in colour, sky around it, heights on click, a link that restores it', async t => {
  const {page, errors} = await open(t, '#s=alps&q=16', {size: {width: 960, height: 600}});
  await page.waitForTimeout(600);
  const land = await pixels(page, [[0.5, 0.5], [0.45, 0.6], [0.55, 0.4], [0.5, 0.7]]);
  const [sky] = await pixels(page, [[0.02, 0.5]]);
  assert.ok(sky.every(c => c > 200), `sky ${sky}`);
  for (const colour of land) {
    assert.ok(Math.hypot(...colour.map((c, i) => c - sky[i])) > 60, `land ${colour} is like the sky`);
  }
  assert.ok(new Set(land.map(String)).size >= 3, 'the land has too few colours');
  await page.screenshot({path: join(packages, 'viewer-light.png')});

  // A click on the land shows its position and height.
  await page.mouse.click(480, 330);
  const rows = () => place(page), first = await rows();
  assert.ok(Number(first.Longitude) > 8 && Number(first.Longitude) < 9, JSON.stringify(first));
  assert.ok(Number(first.Latitude) > 46 && Number(first.Latitude) < 47);
  assert.match(first.Height, /^\d+\.\d\d m$/);
  const height = parseFloat(first.Height);
  assert.ok(height >= 187 && height <= 4173);
  await page.mouse.click(500, 300);
  await page.waitForFunction(
      lon => [...document.querySelectorAll('#place-text dt')].some(dt => dt.textContent === 'From the last') &&
          document.querySelector('#place-text dd').textContent !== lon,
      first.Longitude);

  await page.mouse.move(480, 300);
  for (let i = 0; i < 4; ++i) await page.mouse.wheel(0, -240);
  await page.focus('#picture');
  await page.keyboard.press('e');
  await page.keyboard.press('ArrowUp');
  await page.click('text=Slope');
  await page.waitForTimeout(700);
  await settled(page);
  await page.mouse.click(400, 330);
  await page.waitForTimeout(200);
  // Expand a cluster manually, and collapse it again.
  for (let x = 400; (await rows()).Cluster[0] !== '0'; x += 7) {
    assert.ok(x < 600, 'no point of level 0 is shown');
    await page.mouse.click(x, 330);
    await page.waitForTimeout(100);
  }
  // The members of the cluster are outlined, and the profile between the two places is drawn.
  await page.waitForFunction(() => window.terrace.state.outlined >= 3);
  await page.waitForSelector('#profile:not([hidden])');
  const [drawn, lowest, highest] = await page.evaluate(() => [
    document.querySelector('#profile path').getAttribute('d').split(' ').length,
    parseFloat(document.getElementById('profile-low').textContent), parseFloat(document.getElementById('profile-high').textContent)
  ]);
  assert.ok(drawn > 6 && lowest >= 187 && highest <= 4173 && lowest < highest, `${drawn} ${lowest} ${highest}`);
  const before = (await state(page)).points;
  // Samples around the cluster replace the vertices of a window that is no longer complete.
  await page.click('#collapse');
  await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points !== points, before);
  await page.click('#release');
  await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points === points, before);

  const link = new URL(page.url()).hash;
  assert.match(link, /c=slope/);
  await page.screenshot({path: join(packages, 'viewer-slope.png')});
  const now = await state(page);
  const again = await open(t, link, {size: {width: 960, height: 600}, dark: true});
  const restored = await state(again.page);
  assert.ok(Math.abs(restored.camera.distance / now.camera.distance - 1) < 1e-4);
  assert.ok(Math.abs(restored.camera.azimuth - now.camera.azimuth) < 0.01);
  await again.page.click('text=Triangles');
  await again.page.click('text=Level');
  await again.page.waitForTimeout(800);
  await again.page.screenshot({path: join(packages, 'viewer-level-dark.png')});
  assert.deepEqual([...errors, ...again.errors], []);
});

/// The command's answer at a position in the CRS.
function sampled(store, x, y) {
  const {stdout} = spawnSync(process.env.TERRACE, ['sample', store, '-q'], {cwd: sites.folder, encoding: 'utf8', input: `x,y\n${x},${y}\n`});
  return number(stdout.split('\n')[1].split(',')[2]);
}
const number = text => text === '' ? NaN : Number(text);

test('a click reads the store, not the drawn surface: heights and profiles are exact and stay', async t => {
  for (const name of ['alps', 'hills']) {
    const {page, errors, close} = await open(t, `#s=${name}&q=12`, {size: {width: 960, height: 600}});
    const before = await state(page);
    const clicked = [];
    // Two consecutive places. Where there is no data, nothing is picked or the panel says so.
    for (let i = 0; clicked.length < 2; ++i) {
      assert.ok(i < 60, 'no places are picked');
      await page.mouse.click(400 + 13 * (i % 12), 280 + 37 * (i % 5));
      await page.waitForTimeout(250);
      if (!await page.isVisible('#place')) {
        clicked.length = 0;
        continue;
      }
      const rows = await place(page), east = rows.Longitude ?? rows.East, north = rows.Latitude ?? rows.North;
      // The panel shows positions to a tenth of a metre.
      const height = sampled(`${name}.store`, east, north);
      if (rows.Height === 'no data') {
        assert.ok(Number.isNaN(height), `no data at ${east} ${north}`);
        clicked.length = 0;
        continue;
      }
      assert.ok(Math.abs(parseFloat(rows.Height) - height) < 0.5, `${rows.Height} for ${height} at ${east} ${north}`);
      clicked.push([east, north]);
    }
    const shown = await profile(page), line = clicked.flat().join();
    const {stdout} = spawnSync(process.env.TERRACE, ['profile', `${name}.store`, '--line', line, '-o', '-', '-q'], {cwd: sites.folder, encoding: 'utf8'});
    const rows = stdout.trim().split('\n').slice(1).map(row => row.split(',').map(number));
    const heights = rows.map(row => row[3]).filter(height => !Number.isNaN(height));
    const metres = text => parseFloat(text) * (text.includes('km') ? 1000 : 1);
    assert.ok(Math.abs(metres(shown[1]) / rows.at(-1)[0] - 1) < 0.005, `${shown[1]} for ${rows.at(-1)[0]} m`);
    assert.ok(Math.abs(parseFloat(shown[0]) - Math.min(...heights)) < 1, `${shown[0]} for ${Math.min(...heights)}`);
    assert.ok(Math.abs(parseFloat(shown[2]) - Math.max(...heights)) < 1, `${shown[2]} for ${Math.max(...heights)}`);
    await page.mouse.move(480, 300);
    for (let i = 0; i < 12; ++i) await page.mouse.wheel(0, -240);
    await page.waitForTimeout(600);
    await settled(page);
    assert.notEqual((await state(page)).points, before.points);
    assert.deepEqual(await profile(page), shown);
    await page.screenshot({path: join(packages, `viewer-place-${name}.png`)});
    assert.deepEqual(errors, []);
    await close();
  }
});

test('texts of a store stay text: no markup gets into the page, and none would run', async t => {
  const name = '<img src=x onerror=document.title=1>';
  const points = Array.from({length: 3600}, (_, i) => `${i % 60},${Math.floor(i / 60)},0,${i}`);
  writeFileSync(join(sites.folder, 'marked.csv'), `x,y,z,${name}\n${points.join('\n')}\n`);
  sites.terrace('build', 'marked.csv', '-o', 'marked.store', '-q');
  sites.terrace('publish', 'marked.store', 'corners.store', '-o', 'marked', '-q');
  const server = await serve(t, join(sites.folder, 'marked'));
  const {page, errors, close} = await open(t, '#s=marked', {url: server.url, size: {width: 700, height: 600}});
  await page.waitForTimeout(300);
  await page.mouse.click(330, 300);
  assert.ok(name in await place(page));
  assert.equal(await page.$$eval('img', images => images.length), 0);
  assert.deepEqual(errors, []);
  await page.evaluate(() => {
    const made = document.createElement('div');
    made.innerHTML = '<img src="data:," onerror="document.title = 1"><b onclick="document.title = 1">x</b>';
    document.body.append(made);
    made.querySelector('b').click();
  });
  await page.waitForTimeout(300);
  assert.equal(await page.title(), 'marked · terrace');
  assert.ok(errors.some(error => /Content Security Policy/.test(error)), errors.join());
  await close();
  const corners = await open(t, '#s=corners', {url: server.url});
  assert.match(await corners.page.textContent('#status'), /^[\d,]+ triangles, the first corner of each · /);
});

test('lines have the colours of levels, from violet at the top to yellow', async t => {
  const warmth = async hash => {
    const {page, errors, close} = await open(t, `#${hash}`, {size: {width: 700, height: 600}});
    await page.waitForTimeout(300);
    const seen = await pixels(page, Array.from({length: 900}, (_, i) => [0.44 + 0.12 * (i % 30) / 30, 0.44 + 0.12 * Math.floor(i / 30) / 30]));
    assert.equal(/&w=1/.test(await page.evaluate(() => location.hash)), hash.includes('&w=1'));
    assert.deepEqual(errors, []);
    await close();
    return seen.reduce((sum, [r, , b]) => sum + r - b, 0) / seen.length;
  };
  // The first store shows coarse levels, the second all points.
  for (const [hash, turn] of [['s=alps&q=32&c=height', -1], [`s=${'bunny' in sites.real ? 'bunny' : 'ball'}&q=1&c=grey`, 1]]) {
    const plain = await warmth(hash), lines = await warmth(`${hash}&w=1`);
    assert.ok(turn * (lines - plain) > 3, `${hash}: red minus blue is ${plain} without lines, ${lines} with them`);
  }
});

test('a scan: its surface from all sides, switching to points and back, a link that restores it', async t => {
  const name = 'bunny' in sites.real ? 'bunny' : 'ball';
  const {page, errors, outside} = await open(t, `#s=${name}&q=2`, {size: {width: 900, height: 600}});
  const first = await state(page);
  assert.equal(first.kind, 'surface');
  assert.ok(first.triangles > 1.8 * first.points && first.triangles < 2.1 * first.points, JSON.stringify(first));
  assert.equal(await page.isChecked('input[value=grey]'), true);
  assert.ok(!await page.isVisible('#by-slope'));
  const [sky] = await pixels(page, [[0.02, 0.5]]);
  // Many shades of grey from every side, also from below.
  for (const drag of [[0, 0], [250, 0], [250, 0], [0, -260], [0, 500]]) {
    await page.mouse.move(450, 300);
    await page.mouse.down();
    await page.mouse.move(450 + drag[0] / 2, 300 + drag[1] / 2);
    await page.mouse.move(450 + drag[0], 300 + drag[1]);
    await page.mouse.up();
    await settled(page);
    await page.waitForTimeout(100);
    await page.screenshot({path: join(packages, `viewer-scan-${drag.join('_')}.png`)});
    const body = await pixels(page, Array.from({length: 64}, (_, i) => [0.44 + 0.12 * (i % 8) / 8, 0.44 + 0.12 * Math.floor(i / 8) / 8]));
    const shown = body.filter(colour => Math.hypot(...colour.map((c, i) => c - sky[i])) > 25);
    assert.ok(shown.length > 40, `${shown.length} of 64 after ${drag}`);
    assert.ok(new Set(shown.map(String)).size > 10, `one shade after ${drag}`);
    const coloured = shown.filter(([r, g, b]) => Math.abs(r - g) > 8 || Math.abs(g - b) > 12);
    assert.ok(coloured.length <= 6, `not grey: ${coloured.join(' | ')} after ${drag}`);
  }
  assert.ok((await state(page)).camera.tilt > 60, 'it cannot be tilted that far');
  await page.mouse.click(450, 300);
  await page.waitForSelector('#place:not([hidden])');
  assert.deepEqual(await page.$$eval('#place-text dt', dts => dts.slice(0, 5).map(dt => dt.textContent)), ['X', 'Y', 'Z', 'Level', 'Cluster']);
  const before = (await state(page)).points;
  if ((await page.textContent('#place-text dd:nth-of-type(5)'))[0] === '0') {
    await page.click('#collapse');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points < points, before);
    await page.click('#release');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points === points, before);
  }
  await page.click('text=Triangles');
  await page.click('text=Level');
  await page.waitForTimeout(300);
  await page.screenshot({path: join(packages, 'viewer-scan-level.png')});
  const link = new URL(page.url()).hash, now = await state(page);
  await page.click('text=Points');
  await page.waitForFunction(() => window.terrace.settled && window.terrace.state.kind === 'points');
  await page.screenshot({path: join(packages, 'viewer-scan-points.png')});
  await page.waitForFunction(() => /p=1/.test(location.hash));
  await page.click('text=Surface');
  await page.waitForFunction(() => window.terrace.settled && window.terrace.state.kind === 'surface');
  const again = await open(t, link, {size: {width: 390, height: 760}, dark: true});
  assert.ok(Math.abs((await state(again.page)).camera.tilt - now.camera.tilt) < 0.01);
  await again.page.screenshot({path: join(packages, 'viewer-scan-phone.png')});
  await again.page.click('#menu');
  assert.ok(await again.page.isVisible('#as') && await again.page.isVisible('#upright'));
  await again.page.screenshot({path: join(packages, 'viewer-scan-phone-tools.png')});
  assert.deepEqual([...errors, ...again.errors, ...outside], []);
});

// Most of the time these wait for servers and for software rendering.
describe('pages side by side', {concurrency: 3}, () => {
  test('a flight over a raster of cocircular points gives the hashes of the native run', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32');
    for (const stop of sites.flight('flat', {maxPoints: MAX_POINTS})) {
      await page.evaluate(({eye, direction, error}) => window.terrace.fly(eye, direction, 1.5, 800, error), stop);
      await settled(page);
      assert.equal((await state(page)).points, stop.points);
      assert.equal(await page.evaluate(() => window.terrace.hash()), stop.hash);
    }
    assert.deepEqual(errors, []);
  });

  test('a fixed level is shown everywhere, and the link keeps it', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32');
    const coarse = (await state(page)).points;
    await page.focus('#level');
    await page.keyboard.press('End');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points > points, coarse);
    assert.equal((await state(page)).points, 200 * 180);
    assert.equal(await page.textContent('#level-text'), 'level 0');
    await page.waitForFunction(() => /l=0/.test(location.hash));
    const again = await open(t, new URL(page.url()).hash);
    assert.equal((await state(again.page)).points, 200 * 180);
    await page.focus('#level');
    await page.keyboard.press('Home');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points === points, coarse);
    assert.deepEqual([...errors, ...again.errors], []);
  });

  for (const name of ['bunny', 'autzen']) {
    test(`real data: ${name}`, {skip: name in sites.real ? false : 'TERRACE_DATA has no such file'}, async t => {
      const {page, errors, outside} = await open(t, `#s=${name}&q=32`);
      // The worker's test flies further over the bunny.
      const stops = name === 'bunny' && !process.env.TERRACE_NIGHTLY ? 1 : 3;
      const flight = sites.flight(name, {maxPoints: MAX_POINTS, kind: name === 'bunny' ? 'surface' : 'points'}).slice(0, stops);
      // The native flight starts with no cluster expanded.
      for (const stop of [{...flight[0], error: 1e6, points: null}, ...flight]) {
        await page.evaluate(({eye, direction, error}) => window.terrace.fly(eye, direction, 1.5, 800, error), stop);
        await settled(page);
        if (stop.points === null) continue;
        assert.equal((await state(page)).points, stop.points);
        assert.equal(await page.evaluate(() => window.terrace.hash()), stop.hash);
      }
      const spots = await pixels(page, Array.from({length: 900}, (_, i) => [0.3 + 0.4 * (i % 30) / 30, 0.3 + 0.4 * Math.floor(i / 30) / 30]));
      assert.ok(new Set(spots.map(String)).size > 20, 'no points are drawn');
      await page.screenshot({path: join(packages, `viewer-${name}.png`)});
      assert.deepEqual([errors, outside], [[], []]);
    });
  }

  test('a slow server: never blank, no message, and complete in the end', async t => {
    const server = await serve(t, sites.site);
    server.fault = ({range}) => range === null ? null : 'held';
    const {page, errors} = await open(t, '#s=alps&q=8', {url: server.url, settle: false});
    await page.waitForFunction(() => window.terrace?.state.points > 100);
    const drawn = async () => {
      const [middle, sky] = await pixels(page, [[0.5, 0.5], [0.02, 0.3]]);
      return Math.hypot(...middle.map((c, i) => c - sky[i])) > 60;
    };
    for (let tries = 0; !await drawn(); ++tries) {
      assert.ok(tries < 600, 'nothing is drawn');
      await page.waitForTimeout(100);
    }
    assert.equal((await state(page)).settled, false);
    assert.match(await page.textContent('#status'), /refining/);
    await page.waitForTimeout(1800);
    assert.ok(!await page.isVisible('#message'));
    server.release();
    await settled(page);
    assert.ok(!await page.isVisible('#message'));
    assert.deepEqual(errors, []);
  });

  test('the panels wait for the first picture, but not for long', async t => {
    const context = await newContext(t);
    const page = await context.newPage();
    let answer;
    const wanted = new Promise(resolve => answer = resolve);
    await context.route(/\.start$/, async route => {
      await wanted;
      await route.continue();
    });
    await page.addInitScript(() => addEventListener('DOMContentLoaded', () => {
      window.atFirst = getComputedStyle(document.getElementById('head')).visibility;
    }));
    await page.goto(`${site.url}#s=alps&q=8`);
    assert.equal(await page.evaluate(() => window.atFirst), 'hidden');
    await page.waitForSelector('#progress');  // waits until it is visible
    assert.ok(await page.isVisible('#head'));
    assert.equal(await page.evaluate(() => window.terrace?.state.points ?? 0), 0);
    answer();
    await settled(page);
    assert.ok(!await page.isVisible('#progress'));
    await context.close();

    const quick = await open(t, '#s=alps&q=8');
    assert.equal(await quick.page.evaluate(() => document.body.className), '');
  });

  test('a cloud on a phone', async t => {
    const {page, errors} = await open(t, '#s=cloud', {size: {width: 390, height: 760}});
    assert.equal((await state(page)).triangles, 0);
    assert.ok((await state(page)).points > 1000);
    await page.waitForTimeout(600);
    const spots = await pixels(page, Array.from({length: 60}, (_, i) => [0.3 + 0.4 * (i % 10) / 10, 0.4 + 0.2 * Math.floor(i / 10) / 6]));
    assert.ok(new Set(spots.map(String)).size > 5, 'no points are drawn');
    assert.ok(!await page.isVisible('#tools'));
    await page.click('#menu');
    assert.ok(await page.isVisible('#tools'));
    assert.ok(!await page.isVisible('#with-wire'));
    await page.fill('#size', '6');
    assert.match(await page.evaluate(() => location.hash), /&r=6(&|$)/);
    await page.screenshot({path: join(packages, 'viewer-phone.png')});
    assert.deepEqual(errors, []);
  });

  test('the worker starts before WebGL', async t => {
    const context = await newContext(t);
    const page = await context.newPage();
    await page.addInitScript(() => {
      window.order = [];
      const {Worker} = window, {getContext} = HTMLCanvasElement.prototype;
      window.Worker = class extends Worker {
        constructor(url) {
          super(url);
          this.addEventListener('message', ({data}) => window.order.push(data.type));
        }
      };
      HTMLCanvasElement.prototype.getContext = function(...args) {
        window.order.push('webgl');
        return getContext.apply(this, args);
      };
    });
    await page.goto(`${site.url}#s=flat&q=32`);
    await settled(page);
    const order = await page.evaluate(() => window.order);
    assert.deepEqual(order.slice(0, 2), ['started', 'webgl'], order.slice(0, 5).join());
  });

  test('the first view shows everything between the panels, at any size', async t => {
    for (const size of [{width: 1100, height: 500}, {width: 700, height: 700}, {width: 390, height: 760}]) {
      for (const name of ['flat', 'ball']) {
        const {page, errors, close} = await open(t, `#s=${name}&q=32`, {size});
        const rim = Array.from({length: 40}, (_, i) => (i + 0.5) / 40).flatMap(t => [[t, 0.003], [t, 0.97], [0.003, t], [size.width > 900 ? 0.8 : 0.996, t]]);
        const seen = await pixels(page, rim);
        assert.equal(new Set(seen.map(String)).size, 1, `${name} is cut off at ${JSON.stringify(size)}`);
        const inside = await pixels(page, Array.from({length: 900}, (_, i) => [(i % 30) / 30, Math.floor(i / 30) / 30]));
        assert.ok(inside.filter(colour => String(colour) !== String(seen[0])).length > 90, `${name} is small at ${JSON.stringify(size)}`);
        assert.deepEqual(errors, []);
        await close();
      }
    }
  });

  test('few points, one row of cells, a single cell: visible, and picked by a click', async t => {
    for (const [name, points] of Object.entries({point: 1, three: 3, cell: 1, row: 60})) {
      const {page, errors, close} = await open(t, `#s=${name}`, {size: {width: 600, height: 400}});
      assert.equal((await state(page)).points, points);
      assert.match(await page.textContent('#status'), points === 1 ? /^1 point ·/ : /^\d+ points ·/);
      const shown = await page.evaluate(() => {
        const canvas = document.getElementById('picture'), gl = canvas.getContext('webgl2');
        const all = new Uint8Array(4 * canvas.width * canvas.height), found = [];
        gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, all);
        for (let i = 0; i < all.length; i += 4) {
          if (Math.hypot(...[0, 1, 2].map(c => all[i + c] - all[c])) > 12) found.push([(i / 4) % canvas.width, canvas.height - 1 - Math.floor(i / 4 / canvas.width)]);
        }
        return found;
      });
      assert.ok(shown.length >= 2 * points, `${name}: ${shown.length} pixels`);
      const [x, y] = shown[Math.floor(shown.length / 2)];
      await page.mouse.click(x, y);
      await page.waitForSelector('#place:not([hidden])');
      assert.deepEqual(errors, []);
      await close();
    }
  });

  test('a plain without relief has one colour', async t => {
    const {page, errors} = await open(t, '#s=plain', {size: {width: 600, height: 400}});
    const shown = await pixels(page, Array.from({length: 400}, (_, i) => [0.4 + 0.2 * (i % 20) / 20, 0.45 + 0.2 * Math.floor(i / 20) / 20]));
    const spread = Math.max(...[0, 1, 2].map(c => Math.max(...shown.map(colour => colour[c])) - Math.min(...shown.map(colour => colour[c]))));
    // Except for the haze.
    assert.ok(spread < 12, `colours differ by ${spread}`);
    assert.deepEqual(errors, []);
  });

  test('a small scan at a great height is drawn, and its profile has enough digits', async t => {
    const {page, errors} = await open(t, '#s=high&q=1', {size: {width: 700, height: 600}});
    assert.equal((await state(page)).kind, 'surface');
    const [sky, ...body] = await pixels(page, [[0.02, 0.5], ...Array.from({length: 100}, (_, i) => [0.45 + 0.1 * (i % 10) / 10, 0.45 + 0.1 * Math.floor(i / 10) / 10])]);
    const shown = body.filter(colour => Math.hypot(...colour.map((c, i) => c - sky[i])) > 12);
    assert.ok(shown.length > 95, `${shown.length} of 100`);
    await page.click('#upright span:text-is("Z")');
    await settled(page);
    await page.mouse.click(300, 300);
    await page.waitForSelector('#place:not([hidden])');
    await page.mouse.click(390, 330);
    await page.waitForSelector('#profile:not([hidden])');
    const [low, high] = await page.evaluate(() => ['low', 'high'].map(end => parseFloat(document.getElementById(`profile-${end}`).textContent)));
    assert.ok(high - low > 0.001 && high - low < 0.021, `${low} ${high}`);
    assert.deepEqual(errors, []);
  });

  test('places in a small cloud have enough digits, also in links, and long names leave room for them', async t => {
    const {page, errors} = await open(t, '#s=long', {size: {width: 900, height: 600}});
    await page.focus('#picture');
    for (let i = 0; i < 9; ++i) await page.keyboard.press('+');
    await page.keyboard.press('ArrowLeft');
    await page.waitForTimeout(1000);
    await settled(page);
    const {target, distance} = (await state(page)).camera;
    const again = await open(t, new URL(page.url()).hash, {size: {width: 900, height: 600}});
    const there = (await state(again.page)).camera.target;
    assert.ok(Math.hypot(...target.map((c, i) => c - there[i])) < 0.01 * distance, page.url());
    await page.keyboard.press('Home');
    await settled(page);
    const [x, y] = await page.evaluate(() => {
      const {width, height} = document.getElementById('picture'), gl = document.getElementById('picture').getContext('webgl2');
      const all = new Uint8Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, all);
      for (let y = 0.15; y < 0.9; y += 1 / height) {
        for (let x = 0.03; x < 0.7; x += 1 / width) {
          const at = 4 * (Math.round((1 - y) * height) * width + Math.round(x * width));
          if (Math.hypot(...[0, 1, 2].map(i => all[at + i] - all[i])) > 60) return [x * innerWidth, y * innerHeight];
        }
      }
      return [0, 0];
    });
    await page.mouse.click(x, y);
    await page.waitForSelector('#place:not([hidden])');
    const first = page.locator('#place-text dd').first();
    assert.match(await first.textContent(), /^0\.(1234|2345|3000)\d+$/);
    assert.ok((await first.boundingBox()).height < 30, 'a number wraps');
    assert.deepEqual([...errors, ...again.errors], []);
  });

  test('links to a missing store say so, links to nowhere show everything, and Back returns to the previous store', async t => {
    const {page, errors} = await open(t, '#s=gone&v=0,0,0,0,42,1&q=32', {size: {width: 600, height: 400}});
    assert.match(await page.textContent('#notice'), /“gone”/);
    const {camera} = await state(page);
    assert.ok(camera.distance > 1000, `${camera.distance}`);
    await page.selectOption('#store', 'three');
    await page.waitForFunction(() => window.terrace.settled && window.terrace.state.store === 'three');
    await page.goBack();
    await page.waitForFunction(() => window.terrace.settled && window.terrace.state.store === 'alps');
    assert.equal(new URL(page.url()).hash.split('&')[0], '#s=alps');
    const far = await open(t, '#s=three&v=1e300,0,0,0,42,1');
    assert.ok(Math.abs((await state(far.page)).camera.target[0]) < 100);
    assert.deepEqual([...errors, ...far.errors], []);
  });

  test('the view is restored with the graphics context', async t => {
    const {page} = await open(t, '#s=three', {size: {width: 600, height: 400}});
    await page.keyboard.press('Tab');
    await page.keyboard.press('e');
    await settled(page);
    const {azimuth} = (await state(page)).camera;
    await page.evaluate(() => {
      window.before = true;
      window.lose = document.getElementById('picture').getContext('webgl2').getExtension('WEBGL_lose_context');
      window.lose.loseContext();
    });
    await page.waitForSelector('#message:not([hidden])');
    await page.evaluate(() => window.lose.restoreContext());
    await page.waitForFunction(() => !window.before && window.terrace?.settled);
    assert.ok(!await page.isVisible('#message'));
    assert.ok(azimuth >= 6);
    assert.ok(Math.abs((await state(page)).camera.azimuth - azimuth) < 0.01);
  });

  test('everything stays in view when the window is resized, until the user moves', async t => {
    const {page} = await open(t, '#s=cloud', {size: {width: 900, height: 500}});
    const before = (await state(page)).camera.distance;
    await page.setViewportSize({width: 400, height: 500});
    await page.waitForFunction(distance => window.terrace.settled && window.terrace.state.camera.distance > 1.3 * distance, before);
    await page.focus('#picture');
    await page.keyboard.press('+');
    await settled(page);
    const near = (await state(page)).camera.distance;
    await page.setViewportSize({width: 900, height: 500});
    await page.waitForTimeout(500);
    await settled(page);
    assert.equal((await state(page)).camera.distance, near);
  });

  test('a store of triangles is not a scan: it shows a point for each, and the status says so', async t => {
    const {page, errors} = await open(t, '#s=corners');
    assert.equal((await state(page)).kind, 'points');
    assert.match(await page.textContent('#status'), /triangles, the first corner of each/);
    assert.deepEqual(errors, []);
  });

  test('a page opened from the disk says what it needs', async t => {
    const {page} = await open(t, '', {url: `file://${sites.site}/index.html`, settle: false});
    await page.waitForSelector('#message:not([hidden])');
    assert.match(await page.textContent('#message-text'), /web server/);
  });

  test('keyboard alone moves the view, reads the centre, expands and collapses a cluster', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32', {size: {width: 800, height: 600}});
    await page.keyboard.press('Tab');
    assert.equal(await page.evaluate(() => document.activeElement.id), 'picture');
    assert.ok(await page.isVisible('#cross'));
    const before = await state(page);
    for (const key of ['ArrowUp', 'e', 'r', '+']) await page.keyboard.press(key);
    await settled(page);
    const now = await state(page);
    for (const what of ['azimuth', 'tilt', 'distance']) assert.notEqual(now.camera[what], before.camera[what], what);
    await page.keyboard.press('Home');
    await settled(page);
    const coarse = (await state(page)).points;
    await page.keyboard.press('Enter');
    await page.waitForSelector('#place:not([hidden])');
    await page.keyboard.press('x');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points > points, coarse);
    await page.keyboard.press('v');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points === points, coarse);
    await page.keyboard.press('Escape');
    assert.ok(!await page.isVisible('#place'));
    assert.deepEqual(errors, []);
  });

  test('two fingers zoom, one finger moves, a tap reads a point', async t => {
    const context = await newContext(t, {viewport: {width: 390, height: 760}, hasTouch: true, isMobile: true});
    const page = await context.newPage();
    await page.goto(`${site.url}#s=flat&q=32`);
    await settled(page);
    const touches = await context.newCDPSession(page);
    const touch = (type, ...points) => touches.send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([x, y], id) => ({x, y, id}))});
    const before = (await state(page)).camera;
    await touch('touchStart', [170, 380], [220, 380]);
    for (let i = 1; i <= 10; ++i) await touch('touchMove', [170 - 5 * i, 380], [220 + 5 * i, 380]);
    await touch('touchEnd');
    await settled(page);
    const near = (await state(page)).camera;
    assert.ok(near.distance < 0.6 * before.distance, `${before.distance} ${near.distance}`);
    await touch('touchStart', [200, 400]);
    for (let i = 1; i <= 10; ++i) await touch('touchMove', [200 - 6 * i, 400]);
    await touch('touchEnd');
    await settled(page);
    assert.ok((await state(page)).camera.target[0] > near.target[0]);
    assert.ok(!await page.isVisible('#place'));
    await page.touchscreen.tap(195, 380);
    await page.waitForSelector('#place:not([hidden])');
  });

  test('a cloud in its colours, classes and intensities', async t => {
    const {page, errors} = await open(t, '#s=cloud', {size: {width: 900, height: 600}});
    const spots = Array.from({length: 400}, (_, i) => [0.3 + 0.4 * (i % 20) / 20, 0.4 + 0.25 * Math.floor(i / 20) / 20]);
    const seen = async () => {
      await page.waitForTimeout(400);
      return pixels(page, spots);
    };
    const kinds = shown => {
      const red = [], blue = [];
      shown.forEach(([r, , b], i) => {
        if (r > 150 && b < 60) red.push(spots[i][0]);
        if (b > 150 && r < 60) blue.push(spots[i][0]);
      });
      return {red, blue};
    };
    // It opens in its own colours: red in the west, blue in the east.
    assert.equal(await page.isChecked('input[value=rgb]'), true);
    assert.ok(!await page.isVisible('#by-slope'));
    const {red, blue} = kinds(await seen());
    assert.ok(red.length > 20 && blue.length > 20, `${red.length} red, ${blue.length} blue`);
    assert.ok(Math.max(...red) < Math.min(...blue) + 0.05);
    await page.screenshot({path: join(packages, 'viewer-cloud.png')});
    await page.click('text=Class');
    assert.deepEqual(await page.$$eval('#classes li', items => items.map(item => item.textContent)), ['2 ground', '9 water']);
    const rare = await open(t, '#s=rare&c=class&q=32');
    assert.deepEqual(await rare.page.$$eval('#classes li', items => items.map(item => item.textContent)), ['2 ground', '7 low point', '9 water']);
    await rare.close();
    const classed = await seen(), of = (colour, near) => classed.filter(c => Math.hypot(...c.map((v, i) => v - colour[i])) < near).length;
    assert.equal(kinds(classed).red.length, 0);
    // Ground is brown, water is blue.
    assert.ok(of([152, 104, 64], 40) > 20 && of([48, 112, 208], 40) > 20, 'classes have the wrong colours');
    await page.click('text=Intensity');
    const greys = await seen();
    assert.ok(greys.filter(([r, g, b]) => Math.abs(r - g) < 12 && Math.abs(g - b) < 16 && r < 200).length > 40);
    for (let x = 400; !await page.isVisible('#place'); x += 7) {
      assert.ok(x < 600, 'no point is picked');
      await page.mouse.click(x, 320);
      await page.waitForTimeout(100);
    }
    const rows = await page.$$eval('#place-text dt', dts => dts.map(dt => dt.textContent));
    for (const name of ['red', 'green', 'blue', 'classification', 'intensity']) assert.ok(rows.includes(name), rows.join());
    // The profile between two places shows the points of a strip and marks those of the cluster.
    await page.mouse.click(330, 330);
    await page.waitForSelector('#profile:not([hidden])');
    const dots = await page.getAttribute('#profile path', 'd');
    assert.ok(dots.split('M').length > 4, dots);
    await page.screenshot({path: join(packages, 'viewer-cloud-profile.png')});
    const drawn = await profile(page);
    await page.mouse.move(450, 300);
    for (let i = 0; i < 3; ++i) await page.mouse.wheel(0, -240);
    await page.waitForTimeout(600);
    await settled(page);
    assert.deepEqual(await profile(page), drawn);
    assert.match(page.url(), /c=intensity/);
    assert.deepEqual(errors, []);
  });

  for (const [fault, expected] of Object.entries({
         whole: /whole file/, short: /connection was lost|bytes received/, packed: /compresses parts/, missing: /not found/, replaced: /replaced/, damaged: /checksum|damaged/,
         error: /HTTP 500/, dead: /does not answer/
       })) {
    test(`a faulty server (${fault}): a message, and a retry succeeds`, async t => {
      const server = await serve(t, sites.site);
      server.fault = ({range, method}) => range !== null || (fault === 'dead' && method === 'HEAD') ? fault : null;
      const {page} = await open(t, '#s=alps&q=4', {url: server.url, size: {width: 480, height: 320}, settle: false});
      await page.waitForSelector('#message:not([hidden])');
      assert.match(await page.textContent('#message-text'), expected);
      assert.ok(!(await state(page)).settled);
      if (fault === 'whole') await page.screenshot({path: join(packages, 'viewer-message.png')});
      server.fault = () => null;
      await page.click('#retry');
      await settled(page);
      assert.ok(!await page.isVisible('#message'));
    });
  }

  test('terrace view serves the viewer', async t => {
    const server = spawn(process.env.TERRACE, ['view', 'alps.store', 'cloud.store', '--no-open'],
                         {cwd: sites.folder, stdio: ['ignore', 'ignore', 'pipe']});
    try {
      const url = await new Promise(
          resolve => server.stderr.on('data', data => /http:\S+/.test(data) && resolve(/http:\S+/.exec(data)[0])));
      const {page, errors, outside, close} = await open(t, '#q=16', {url});
      assert.equal((await state(page)).store, 'alps');
      await page.selectOption('#store', 'cloud');
      await page.waitForFunction(() => window.terrace.settled && window.terrace.state.store === 'cloud');
      await page.reload();
      await settled(page);
      assert.equal((await state(page)).store, 'cloud');
      assert.deepEqual([errors, outside], [[], []]);
      await close();
      // Without the token in the address, the page says what to do.
      const stranger = await open(t, '', {url: new URL(url).origin + '/', settle: false});
      await stranger.page.waitForSelector('#message:not([hidden])');
      assert.match(await stranger.page.textContent('#message-text'), /full address .* token/);
      await stranger.close();
    } finally {
      server.kill('SIGINT');
    }
    assert.equal(await new Promise(resolve => server.on('exit', resolve)), 0);
  });
});

/// Opens the sections of the settings.
const openSections = page => page.$$eval('#tools details', sections => sections.forEach(section => section.open = true));
/// Sets a slider as a user does.
const slide = (page, id, value) => page.fill(`#${id}`, String(value));
/// Clicks places around a position until one is read, and returns its rows.
async function clickPlace(page, x, y) {
  for (let i = 0; i < 30; ++i) {
    await page.evaluate(() => document.getElementById('place-text').replaceChildren());
    await page.mouse.click(x + 5 * i, y + 3 * (i % 4));
    await page.waitForTimeout(300);
    if (!await page.isVisible('#place') || !await page.$('#place-text dt')) continue;
    const rows = await place(page);
    if (rows.Height !== 'no data') return rows;
  }
  throw new Error('no place is picked');
}
/// Publishes another store, built from a text file, and returns its server.
async function publish(t, name, text, ...options) {
  writeFileSync(join(sites.folder, `${name}.asc`), text);
  sites.terrace('build', `${name}.asc`, '-o', `${name}.store`, '-q', ...options);
  sites.terrace('publish', `${name}.store`, '-o', `${name}.site`, '-q');
  return serve(t, join(sites.folder, `${name}.site`));
}

describe('tools', {concurrency: 2}, () => {
  test('exaggerated heights are drawn higher, and all heights that are shown stay true', async t => {
    const {page, errors} = await open(t, '#s=hills&q=16', {size: {width: 900, height: 600}});
    const legend = () => page.textContent('#legend'), before = await legend();
    const first = await clickPlace(page, 400, 300);
    const last = await clickPlace(page, 450, 360), shown = await profile(page);
    await openSections(page);
    const spots = Array.from({length: 300}, (_, i) => [0.2 + 0.5 * (i % 20) / 20, 0.2 + 0.6 * Math.floor(i / 20) / 15]);
    const flat = await pixels(page, spots);
    await slide(page, 'exaggeration', 4);
    await page.waitForFunction(() => window.terrace.settled && window.terrace.state.exaggeration === 4);
    await page.waitForTimeout(600);
    await page.screenshot({path: join(packages, 'viewer-exaggerated.png')});
    const differences = (await pixels(page, spots)).filter((c, i) => Math.hypot(...c.map((v, k) => v - flat[i][k])) > 20).length;
    assert.ok(differences > 30, `only ${differences} of 300 pixels differ`);
    assert.equal(await legend(), before);
    assert.deepEqual(await place(page), last);
    assert.deepEqual(await profile(page), shown);
    // A place that is read afterwards, and the way to it.
    const next = await clickPlace(page, 420, 330), east = next.Longitude ?? next.East, north = next.Latitude ?? next.North;
    assert.ok(Math.abs(parseFloat(next.Height) - sampled('hills.store', east, north)) < 0.5, JSON.stringify(next));
    const rise = parseFloat(next['From the last'].split(', ')[1].replace('−', '-'));
    assert.ok(Math.abs(rise - (parseFloat(next.Height) - parseFloat(last.Height))) < 0.06, `${rise} from ${last.Height} to ${next.Height}`);
    assert.ok(first.Height);
    const link = new URL(page.url()).hash;
    assert.match(link, /z=4/);
    const again = await open(t, link, {size: {width: 900, height: 600}});
    assert.equal((await state(again.page)).exaggeration, 4);
    const [now, restored] = [(await state(page)).camera, (await state(again.page)).camera];
    assert.ok(Math.abs(restored.target[2] - now.target[2]) < 1 + 1e-3 * Math.abs(now.target[2]), `${restored.target} ${now.target}`);
    assert.deepEqual([...errors, ...again.errors], []);
  });

  test('the light comes from where it is asked, and the colours of slopes ignore the exaggeration', async t => {
    // A plane that rises half a metre per metre eastward, like a roof: 26.6 degrees.
    const row = Array.from({length: 80}, (_, column) => 5 * column).join(' ');
    const text = ['ncols 80', 'nrows 80', 'xllcorner 0', 'yllcorner 0', 'cellsize 10', ...Array(80).fill(row)].join('\n');
    const server = await publish(t, 'slope', text);
    const middle = async hash => {
      const {page, close} = await open(t, hash, {url: server.url});
      await page.waitForTimeout(600);
      const [colour] = await pixels(page, [[0.5, 0.5]]);
      await close();
      return colour;
    };
    const seen = '#s=slope&v=0,0,197,0,80,1500';
    const [east, west] = [await middle(`${seen}&c=height&i=90,45`), await middle(`${seen}&c=height&i=270,45`)];
    assert.ok(Math.max(...west) > 1.3 * Math.max(...east), `${west} in light from the west, ${east} from the east`);
    // Light from the north falls on both alike, apart from its strength.
    const [true1, true4] = [await middle(`${seen}&c=slope&i=0,45`), await middle(`${seen}&c=slope&i=0,45&z=4`)];
    for (const channel of [1, 2]) {
      assert.ok(Math.abs(true1[channel] / true1[0] - true4[channel] / true4[0]) < 0.06, `${true1} ${true4}`);
    }
    const {page, errors} = await open(t, seen, {url: server.url});
    await openSections(page);
    await slide(page, 'light', 90);
    await slide(page, 'elevation', 30);
    assert.equal(await page.textContent('#light-text'), 'the east');
    assert.match(await page.evaluate(() => location.hash), /&i=90,30(&|$)/);
    assert.deepEqual(errors, []);
  });

  test('scale bar, north arrow and coordinates under the pointer agree with each other', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32&v=0,0,10,0,60,4000', {size: {width: 900, height: 600}});
    const [bar, text] = await page.evaluate(() => [document.getElementById('scale-bar').offsetWidth, document.getElementById('scale-text').textContent]);
    const at = async (x, y) => {
      await page.mouse.move(x, y);
      await page.waitForTimeout(700);
      return (await page.textContent('#coordinates')).split(', ').map(Number);
    };
    const left = await at(400, 300), right = await at(500, 300);
    assert.ok(Math.abs(right[1] - left[1]) < 20, `${left} ${right}`);
    const metres = (right[0] - left[0]) * bar / 100;
    assert.ok(Math.abs(metres / parseFloat(text) - 1) < 0.04, `${text} for ${metres}`);
    await page.focus('#picture');
    for (let i = 0; i < 5; ++i) await page.keyboard.press('e');
    await settled(page);
    const {azimuth} = (await state(page)).camera;
    assert.ok(azimuth > 29.9);
    assert.equal(await page.evaluate(() => Math.round(-parseFloat(document.getElementById('north-arrow').style.transform.slice(7)))), Math.round(azimuth));
    await page.click('#north');
    await settled(page);
    assert.equal((await state(page)).camera.azimuth, 0);
    assert.deepEqual(errors, []);
  });

  test('goes to longitude and latitude, in the field and in a link, and refuses places outside', async t => {
    const {page, errors} = await open(t, '#s=alps&q=32', {size: {width: 900, height: 600}});
    await openSections(page);
    const middle = async page => {
      await settled(page);
      await page.focus('#picture');
      await page.keyboard.press('Enter');
      return place(page);
    };
    await page.fill('#go-place', '46.6 N, 8.55 E');
    await page.press('#go-place', 'Enter');
    await page.waitForTimeout(300);
    const rows = await middle(page);
    const off = rows => Math.hypot((Number(rows.Longitude) - 8.55) * 76_500, (Number(rows.Latitude) - 46.6) * 111_200);
    assert.ok(off(rows) < 0.05 * (await state(page)).camera.distance, JSON.stringify(rows));
    const before = (await state(page)).camera.target;
    await page.fill('#go-place', '9.8, 46.6');
    await page.press('#go-place', 'Enter');
    await page.waitForSelector('#notice:not([hidden])');
    assert.match(await page.textContent('#notice'), /outside the store/);
    assert.deepEqual((await state(page)).camera.target, before);

    // A link from coordinates: a pixel of a web map at zoom level 11 and this latitude is 52.6 m.
    await page.evaluate(() => location.hash = '#8.4,46.6,11');
    await page.waitForFunction(before => window.terrace.state.camera.target[0] !== before[0], before);
    const there = await middle(page), {camera} = await state(page);
    assert.ok(Math.hypot((Number(there.Longitude) - 8.4) * 76_500, (Number(there.Latitude) - 46.6) * 111_200) < 1000, JSON.stringify(there));
    const pixel = 2 * camera.distance * Math.tan(Math.PI / 8) / 600;
    assert.ok(Math.abs(pixel / 52.52 - 1) < 0.05, `${pixel} m per pixel`);

    // In UTM, positions are converted. PROJ: 9.02 E 46.5 N is 501534.638 5149603.556 in EPSG:32632.
    const flat = ['ncols 100', 'nrows 100', 'xllcorner 500000', 'yllcorner 5149000', 'cellsize 20', ...Array(100).fill(Array(100).fill(8).join(' '))].join('\n');
    const utm = await open(t, '#at=9.02,46.5,16', {url: (await publish(t, 'utm', flat, '--crs', 'EPSG:32632')).url, size: {width: 900, height: 600}});
    const rows32 = await middle(utm.page);
    assert.ok(Math.hypot(Number(rows32.East) - 501534.638, Number(rows32.North) - 5149603.556) < 2, JSON.stringify(rows32));
    await utm.page.mouse.move(440, 305);
    await utm.page.waitForFunction(() => document.getElementById('coordinates').textContent !== '');
    assert.match(await utm.page.textContent('#coordinates'), /^\d{6}.*, \d{7}.* · 9\.0\d+°, 46\.\d+°$/);
    assert.deepEqual([...errors, ...utm.errors], []);
  });

  test('a held key moves smoothly and stops, and a click on nothing says so', async t => {
    const {page, errors} = await open(t, '#s=coast&q=32', {size: {width: 700, height: 500}});
    await page.focus('#picture');
    await page.evaluate(() => {
      window.seen = [];
      const note = () => {
        const [x] = window.terrace.state.camera.target;
        if (x !== window.seen.at(-1)) window.seen.push(x);
        requestAnimationFrame(note);
      };
      note();
    });
    await page.keyboard.down('ArrowRight');
    await page.waitForFunction(() => window.seen.length > 5);
    assert.equal(await page.evaluate(() => window.terrace.settled), false);
    await page.keyboard.up('ArrowRight');
    await settled(page);
    const seen = await page.evaluate(() => window.seen);
    assert.ok(seen.every((x, i) => i === 0 || x > seen[i - 1] - 1e-6 * Math.abs(x)), seen.join());
    const [stopped] = (await state(page)).camera.target;
    await page.waitForTimeout(300);
    assert.equal((await state(page)).camera.target[0], stopped);
    // A press makes a whole step, however short it is.
    const before = (await state(page)).camera;
    await page.evaluate(() => {
      const picture = document.getElementById('picture');
      for (const type of ['keydown', 'keyup']) picture.dispatchEvent(new KeyboardEvent(type, {key: 'e', cancelable: true}));
    });
    await settled(page);
    assert.ok(Math.abs((await state(page)).camera.azimuth - before.azimuth - 6) < 1e-6);
    await page.mouse.click(5, 250);
    await page.waitForSelector('#notice:not([hidden])');
    assert.match(await page.textContent('#notice'), /nothing at this place/);
    assert.ok(!await page.isVisible('#place'));
    assert.deepEqual(errors, []);
  });

  test('saves the picture, and fills the screen', async t => {
    const {page, errors} = await open(t, '#s=cloud');
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#save')]);
    assert.equal(download.suggestedFilename(), 'cloud.png');
    const bytes = readFileSync(await download.path());
    assert.equal(bytes.subarray(1, 4).toString(), 'PNG');
    assert.deepEqual([bytes.readUInt32BE(16), bytes.readUInt32BE(20)], [720, 450]);
    await page.click('#full');
    await page.waitForFunction(() => document.fullscreenElement === document.documentElement);
    assert.equal(await page.textContent('#full'), 'Leave full screen');
    await page.click('#full');
    await page.waitForFunction(() => document.fullscreenElement === null);
    assert.deepEqual(errors, []);
  });

  test('areas and angles are those of the store, and measured lines are drawn on the ground', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32', {size: {width: 900, height: 600}});
    await openSections(page);
    const clicked = async spots => {
      const rows = [];
      for (const [x, y] of spots) rows.push(await clickPlace(page, x, y));
      return rows;
    };
    await page.click('#measure-area + span');
    const corners = await clicked([[300, 250], [500, 260], [480, 400], [310, 380]]);
    const xy = corners.map(rows => [Number(rows.East), Number(rows.North)]);
    const twice = xy.reduce((sum, [x, y], i) => sum + x * xy[(i + 1) % 4][1] - xy[(i + 1) % 4][0] * y, 0);
    assert.ok(Math.abs(parseFloat(corners[3].Area) / Math.abs(twice / 2) - 1) < 1e-3, `${corners[3].Area} for ${twice / 2}`);
    assert.deepEqual((await state(page)).paths, [5]);
    const [crossing] = await clicked([[400, 200]]);
    assert.ok(crossing.Area, JSON.stringify(crossing));
    await page.click('#measure-angle + span');
    const three = await clicked([[300, 300], [420, 300], [430, 400]]);
    const [a, b, c] = three.map(rows => [Number(rows.East), Number(rows.North), parseFloat(rows.Height)]);
    const way = (from, to) => to.map((n, i) => n - from[i]), dot = (u, v) => u.reduce((sum, n, i) => sum + n * v[i], 0);
    const [u, v] = [way(b, a), way(b, c)], angle = Math.acos(dot(u, v) / Math.sqrt(dot(u, u) * dot(v, v))) * 180 / Math.PI;
    assert.ok(Math.abs(parseFloat(three[2].Angle) - angle) < 0.1, `${three[2].Angle} for ${angle}`);
    await page.click('#measure-profile + span');
    assert.ok(!await page.isVisible('#place'));
    await clicked([[300, 300], [450, 330]]);
    await profile(page);
    const [points] = (await state(page)).paths;
    assert.ok(points > 20, `${points} points on the ground`);
    await page.screenshot({path: join(packages, 'viewer-measure.png')});

    // In degrees, on the ellipsoid: next to the middle of a small polygon, a degree has nearly the same length everywhere.
    const earth = await open(t, '#s=alps&q=32', {size: {width: 900, height: 600}});
    await openSections(earth.page);
    await earth.page.click('#measure-area + span');
    const places = [];
    for (const [x, y] of [[400, 300], [440, 300], [430, 330]]) places.push(await clickPlace(earth.page, x, y));
    const lonLat = places.map(rows => [Number(rows.Longitude), Number(rows.Latitude)]);
    const middle = lonLat.reduce((sum, [, lat]) => sum + lat / 3, 0) * Math.PI / 180, w = Math.sqrt(1 - 0.00669437999014 * Math.sin(middle) ** 2);
    const degree = Math.PI / 180 * 6378137, square = degree / w * Math.cos(middle) * degree * (1 - 0.00669437999014) / w ** 3;
    const expected = Math.abs(lonLat.reduce((sum, [x, y], i) => sum + x * lonLat[(i + 1) % 3][1] - lonLat[(i + 1) % 3][0] * y, 0)) / 2 * square;
    const area = parseFloat(places[2].Area) * (/km²/.test(places[2].Area) ? 1e6 : 1e4);
    assert.ok(Math.abs(area / expected - 1) < 0.01, `${places[2].Area} for ${expected} m²`);
    assert.deepEqual([...errors, ...earth.errors], []);
  });

  test('classes can be hidden, points fill gaps, eye-dome lighting shades them, and the link keeps all', async t => {
    const {page, errors} = await open(t, '#s=cloud&c=class', {size: {width: 900, height: 600}});
    const spots = Array.from({length: 400}, (_, i) => [0.3 + 0.4 * (i % 20) / 20, 0.4 + 0.25 * Math.floor(i / 20) / 20]);
    const seen = async () => {
      await page.waitForTimeout(500);
      return pixels(page, spots);
    };
    const blue = colours => colours.filter(([r, , b]) => b > 150 && r < 90).length;
    const whole = await seen();
    assert.ok(blue(whole) > 20);
    await page.click('text=9 water');
    const dry = await seen();
    assert.equal(blue(dry), 0);
    await page.waitForFunction(() => /&h=9(&|$)/.test(location.hash));
    // The filter stays, and stays visible, with other colours.
    await page.click('text=Intensity');
    assert.ok(await page.isVisible('#classes'));
    await page.click('text=9 water');
    await page.click('#by-class');
    assert.deepEqual(await seen(), whole);
    // From nearby the points are far from each other in the picture.
    await page.focus('#picture');
    for (let i = 0; i < 6; ++i) await page.keyboard.press('+');
    await settled(page);
    const filled = await seen(), sky = colours => colours.filter(colour => Math.hypot(...colour.map((c, i) => c - [219, 230, 240][i])) < 40).length;
    await page.check('#shading');
    const shaded = await seen(), sum = colours => colours.flat().reduce((a, b) => a + b, 0);
    assert.ok(sum(shaded) < 0.998 * sum(filled), `${sum(shaded)} for ${sum(filled)}`);
    await page.screenshot({path: join(packages, 'viewer-shaded.png')});
    await page.uncheck('#gaps');
    const gaps = await seen();
    assert.ok(sky(filled) < sky(gaps), `${sky(filled)} and ${sky(gaps)} of 400 are sky`);
    assert.match(await page.evaluate(() => location.hash), /&g=0&d=1(&|$)/);
    const again = await open(t, `${new URL(page.url()).hash}&h=2`, {size: {width: 900, height: 600}});
    assert.equal(await again.page.isChecked('#gaps'), false);
    assert.equal(await again.page.isChecked('#shading'), true);
    assert.equal(await again.page.isChecked('text=2 ground'), false);
    assert.deepEqual([...errors, ...again.errors], []);
  });

  test('expand and collapse are a pair for one cluster, which the buttons name', async t => {
    const {page, errors} = await open(t, '#s=flat&q=32', {size: {width: 900, height: 600}});
    const coarse = (await state(page)).points, points = n => page.waitForFunction(
        ([n, same]) => window.terrace.settled && (window.terrace.state.points === n) === same, n);
    for (let x = 400; !/\d/.test(await page.textContent('#expand')); x += 9) {
      assert.ok(x < 700, 'nothing to expand');
      await clickPlace(page, x, 300);
    }
    const cluster = /\d+:\d+/.exec(await page.textContent('#expand'))[0];
    await page.click('#expand');
    await points([coarse, false]);
    const fine = (await state(page)).points;
    assert.ok(fine > coarse);
    for (let i = 0; i < 2; ++i) {
      assert.equal(await page.textContent('#collapse'), `Collapse ${cluster}`);
      assert.ok(await page.isDisabled('#expand'));
      await page.click('#collapse');
      await points([coarse, true]);
      assert.equal(await page.textContent('#expand'), `Expand ${cluster}`);
      await page.click('#expand');
      await points([fine, true]);
    }
    await page.click('#release');
    await points([coarse, true]);
    assert.deepEqual(errors, []);
  });

  test('a region has at least its level, and the link keeps it', async t => {
    const {page, errors} = await open(t, '#s=hills&q=32', {size: {width: 900, height: 600}});
    const coarse = (await state(page)).points;
    await openSections(page);
    await page.click('#measure-region + span');
    await clickPlace(page, 350, 280);
    await clickPlace(page, 450, 340);
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points > points + 100, coarse);
    const fine = (await state(page)).points;
    assert.ok(fine < 500_000, `${fine} points`);
    assert.equal(await page.textContent('#region-text'), 'level 0');
    await page.screenshot({path: join(packages, 'viewer-region.png')});
    await page.waitForFunction(() => /&b=[-\d.]+(,[-\d.]+){3},0(&|$)/.test(location.hash));
    const again = await open(t, new URL(page.url()).hash, {size: {width: 900, height: 600}});
    assert.equal((await state(again.page)).points, fine);
    await page.focus('#region-level');
    await page.keyboard.press('Home');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points < points, fine);
    await page.click('#region-clear');
    await page.waitForFunction(points => window.terrace.settled && window.terrace.state.points === points, coarse);
    assert.ok(!await page.isVisible('#with-region'));
    assert.deepEqual([...errors, ...again.errors], []);
  });

  test('the status says that the detail is as requested only when it is', async t => {
    const {page} = await open(t, '#s=hills&q=8', {size: {width: 700, height: 500}});
    assert.match(await page.textContent('#status'), /detail as requested/);
    // Notes the status in the frame after each change of the view.
    const texts = await page.evaluate(async () => {
      const frame = () => new Promise(resolve => requestAnimationFrame(resolve)), noted = [];
      const picture = document.getElementById('picture');
      for (let i = 0; i < 8; ++i) {
        picture.dispatchEvent(new WheelEvent('wheel', {deltaY: -200, clientX: 350, clientY: 300, cancelable: true}));
        await frame();
        await frame();
        if (!window.terrace.state.complete) noted.push(document.getElementById('status').textContent);
      }
      return noted;
    });
    assert.ok(texts.length > 0);
    for (const text of texts) assert.doesNotMatch(text, /as requested/);
    await settled(page);
    await page.waitForFunction(() => /detail as requested/.test(document.getElementById('status').textContent));
  });
});
