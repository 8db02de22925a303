// SPDX-License-Identifier: GPL-3.0-or-later
// Published stores for the tests of the viewer, and the hashes of a flight over each.
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {existsSync, mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

export const ROOT = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
export const MAX_POINTS = 300_000;

export class Sites {
  constructor() {
    this.flights = new Map();
    this.folder = mkdtempSync(join(tmpdir(), 'terrace-viewer-'));
    this.site = join(this.folder, 'site');
  }
  /// A scan and a laser cloud, if the real data are available.
  get real() {
    const files = {bunny: 'scan/bun_zipper.ply', autzen: 'lidar/autzen_trim.laz'};
    const there = Object.values(files).every(file => existsSync(join(process.env.TERRACE_DATA ?? '', file)));
    return process.env.TERRACE_DATA && there ? files : {};
  }
  terrace(...args) {
    const {status, stderr, error} = spawnSync(process.env.TERRACE, args, {cwd: this.folder, encoding: 'utf8'});
    assert.equal(status, 0, `terrace ${args.join(' ')}: ${error ?? stderr}`);
  }
  /// Builds a DEM of the Alps with voids, hills without voids, a coast, a raster whose points are
  /// cocircular everywhere, a cloud, scans, and small stores.
  build() {
    this.terrace('build', join(ROOT, 'libterrain', 'examples', 'alps.tif'), '-o', 'alps.store', '-q');
    const flat = ['ncols 200', 'nrows 180', 'xllcorner 0', 'yllcorner 0', 'cellsize 30'];
    for (let row = 0; row < 180; ++row) {
      flat.push(Array.from({length: 200}, (_, column) => (column * 7 + row * 3) % 5 < 2 ? 10 : 11).join(' '));
    }
    writeFileSync(join(this.folder, 'flat.asc'), `${flat.join('\n')}\n`);
    this.terrace('build', 'flat.asc', '-o', 'flat.store', '--block', '1000', '-q');
    // The same joined from two halves.
    for (const [half, region] of [['west', '0,0,3000,5400'], ['east', '3000,0,6000,5400']]) {
      this.terrace('build', 'flat.asc', '--region', region, '-o', `${half}.store`, '--block', '1000', '-q');
    }
    this.terrace('merge', 'west.store', 'east.store', '-o', 'joined.store', '-q');
    this.terrace('synth', 'dem', '--size', '1000x1000', '-o', 'hills.tif', '-q');
    this.terrace('build', 'hills.tif', '-o', 'hills.store', '-q');
    // Land in the west with a bay 3 km wide and a lake of one cell.
    const coast = ['ncols 200', 'nrows 200', 'xllcorner 0', 'yllcorner 0', 'cellsize 30', 'nodata_value -9999'];
    for (let row = 0; row < 200; ++row) {
      coast.push(Array.from({length: 200}, (_, column) => {
        const land = column < 150 && !(column > 40 && row >= 50 && row < 150) && (column !== 20 || row !== 100);
        return land ? (100 + 20 * Math.sin(column / 9) * Math.cos(row / 7)).toFixed(2) : -9999;
      }).join(' '));
    }
    writeFileSync(join(this.folder, 'coast.asc'), `${coast.join('\n')}\n`);
    this.terrace('build', 'coast.asc', '-o', 'coast.store', '--block', '1000', '-q');
    let cloud = 'x,y,z,red,green,blue,classification,intensity\n', state = 12345;
    const random = () => (state = (state * 1103515245 + 12345) % 2147483648) / 2147483648;
    for (let i = 0; i < 40_000; ++i) {
      const x = 100 * random(), y = 80 * random();
      // Red ground on the left, blue water on the right.
      const tree = i % 5 === 0, colours = x < 50 ? '60000,2570,0' : '0,2570,60000';
      cloud += `${x},${y},${3 * Math.sin(x / 9) + (tree ? 4 * random() : 0)},${colours},${x < 50 ? 2 : 9},${i % 1000}\n`;
    }
    writeFileSync(join(this.folder, 'cloud.csv'), cloud);
    this.terrace('build', 'cloud.csv', '-o', 'cloud.store', '--block', '2000', '-q');
    // One noise point, deep in the hierarchy.
    const rare = cloud.split('\n');
    rare[20_001] = rare[20_001].replace(/,[29],/, ',7,');
    writeFileSync(join(this.folder, 'rare.csv'), rare.join('\n'));
    this.terrace('build', 'rare.csv', '-o', 'rare.store', '--block', '2000', '-q');
    // Scans: a ball with bumps, and one without a cap in the east.
    let ball = 'x,y,z\n', bowl = ball, high = ball;
    for (let i = 0; i < 12_000; ++i) {
      const z = 1 - (2 * i + 1) / 12_000, turn = i * 2.399963229728653, r = Math.sqrt(1 - z * z);
      const size = 10 + 0.5 * Math.sin(5 * z) + 0.4 * Math.sin(6 * r * Math.cos(turn));
      const point = `${size * r * Math.cos(turn)},${size * r * Math.sin(turn)},${size * z}\n`;
      ball += point;
      // As small as the spacing of floats at its height.
      if (i % 4 === 0) high += `${0.01 * r * Math.cos(turn)},${0.01 * r * Math.sin(turn)},${1e6 + 0.01 * z}\n`;
      if (r * Math.cos(turn) < 0.4) bowl += point;
    }
    for (const [name, points] of Object.entries({ball, bowl, high})) {
      writeFileSync(join(this.folder, `${name}.csv`), points);
      this.terrace('build', `${name}.csv`, '-o', `${name}.store`, '--block', '1000', '-q');
    }
    this.terrace('build', 'ball.csv', '-o', 'kept.store', '--block', '1000', '--surface', '-q');
    this.terrace('surface', 'high.store', '-o', 'high.ply', '-q');
    this.terrace('build', 'high.ply', '--entities', 'triangles', '-o', 'corners.store', '-q');
    // Few points, and stores without triangles.
    const grid = (columns, rows, value) => [`ncols ${columns}`, `nrows ${rows}`, 'xllcorner 0', 'yllcorner 0', 'cellsize 10', 'nodata_value -9999',
      ...Array.from({length: rows}, (_, row) => Array.from({length: columns}, (_, column) => value(column, row)).join(' '))].join('\n');
    const small = {
      'point.csv': 'x,y,z\n500000,5000000,100\n',
      'three.csv': 'x,y,z\n500000,5000000,100\n500010,5000000,105\n500000,5000010,99\n',
      'long.csv': `x,y,z,${'attribute_with_a_long_name_'.repeat(3)}\n0.1234,0.2,0,1\n0.2345,0.3,0,1\n0.3,0.2,0.01,1\n`,
      'cell.asc': grid(50, 40, (column, row) => column === 25 && row === 20 ? 123.5 : -9999),
      'row.asc': grid(60, 1, column => column % 7),
      'plain.asc': grid(60, 60, () => 7),
      'sparse.asc': grid(40, 40, (column, row) => (column + row) % 2 === 0 ? column : -9999)
    };
    for (const [name, text] of Object.entries(small)) {
      writeFileSync(join(this.folder, name), text);
      this.terrace('build', name, '-o', `${name.split('.')[0]}.store`, '-q');
    }
    const stores = ['alps.store', 'hills.store', 'coast.store', 'flat.store', 'joined.store', 'cloud.store', 'rare.store', 'ball.store', 'bowl.store', 'high.store', 'kept.store', 'corners.store', ...Object.keys(small).map(name => `${name.split('.')[0]}.store`)];
    for (const [name, file] of Object.entries(this.real)) {
      this.terrace('build', join(process.env.TERRACE_DATA, file), '-o', `${name}.store`, '-q');
      stores.push(`${name}.store`);
    }
    this.terrace('publish', ...stores, '-o', 'site', '-q');
  }
  /// kind: how the store is shown. The worker allows a quarter of the points for surfaces, and half
  /// of them for rasters.
  flight(name, {maxPoints = MAX_POINTS, kind = 'points'} = {}) {
    const key = `${name} ${maxPoints} ${kind}`, known = this.flights.get(key);
    if (known) return known;
    const surface = kind === 'surface', cost = {points: 1, raster: 2, surface: 4}[kind];
    const out = execFileSync(process.env.FLIGHT_HASHES,
                             [join(this.folder, `${name}.store`), String(maxPoints / cost), ...(surface ? [kind] : [])],
                             {encoding: 'utf8', maxBuffer: 1 << 24});
    const stops = out.trim().split('\n').map(line => JSON.parse(line));
    this.flights.set(key, stops);
    return stops;
  }
  remove() {
    rmSync(this.folder, {recursive: true, force: true});
  }
}
