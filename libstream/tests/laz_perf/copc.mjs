// SPDX-License-Identifier: Apache-2.0
// copc.mjs PACKAGES FILE.copc.laz...  reads files with npm's copc, node by node, and compares the
// records with those of FILE.las in any order. Exits with 1 if they differ or are outside their node.

import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [, , packages, ...files] = process.argv;
const require = createRequire(join(packages, 'package.json'));
const {createLazPerf} = require('laz-perf');
const {Copc} = require('copc');
const lazPerf = await createLazPerf();

function recordsOfLas(name) {
  const file = readFileSync(name);
  const offset = file.readUInt32LE(96), length = file.readUInt16LE(105), count = Number(file.readBigUInt64LE(247));
  return Array.from({length: count}, (_, i) => file.toString('latin1', offset + i * length, offset + (i + 1) * length));
}

/** Whether a point is in the cube of a node, to within a step of the lattice. */
function isInside(record, key, {info, header}) {
  const [depth, ...place] = key.split('-').map(Number);
  return place.every((at, axis) => {
    const side = (info.cube[axis + 3] - info.cube[axis]) / 2 ** depth;
    const value = record.readInt32LE(4 * axis) * header.scale[axis] + header.offset[axis];
    const low = info.cube[axis] + at * side;
    return value >= low - header.scale[axis] && value <= low + side + header.scale[axis];
  });
}

let faults = 0;
for (const name of files) {
  const copc = await Copc.create(name);
  const nodes = {}, pages = [copc.info.rootHierarchyPage];
  for (const page of pages) {  // the list grows
    const read = await Copc.loadHierarchyPage(name, page);
    Object.assign(nodes, read.nodes);
    pages.push(...Object.values(read.pages));
  }
  if ((pages.length > 1) !== name.includes('pages')) ++faults;
  const found = [];
  let outside = 0, depths = 0;
  for (const [key, node] of Object.entries(nodes)) {
    if (node.pointCount === 0) continue;
    depths = Math.max(depths, Number(key.split('-')[0]) + 1);
    const data = Buffer.from(await Copc.loadPointDataBuffer(name, copc.header, node, lazPerf));
    const length = copc.header.pointDataRecordLength;
    if (data.length !== node.pointCount * length) ++faults;
    for (let at = 0; at < data.length; at += length) {
      const record = data.subarray(at, at + length);
      if (!isInside(record, key, copc)) ++outside;
      found.push(record.toString('latin1'));
    }
  }
  const expected = recordsOfLas(name.replace(/\.copc\.laz$/, '.las'));
  found.sort();
  expected.sort();
  const same = found.length === expected.length && found.every((record, i) => record === expected[i]);
  const {cube, spacing, gpsTimeRange: [first, last]} = copc.info;
  const good = same && outside === 0 && copc.wkt.startsWith('LOCAL_CS') &&
    first === 1e8 && last === 1e8 + 0.001 * (found.length - 1) && Math.abs(spacing * 128 - (cube[3] - cube[0])) < 1e-6;
  if (!good) ++faults;
  console.log(`${name}: ${found.length} points, ${Object.keys(nodes).length} nodes, ${depths} depths, ${pages.length} pages` +
    (good ? '' : `, ${same ? 'the' : 'other'} records, ${outside} outside their nodes`));
}
process.exit(files.length > 0 && faults === 0 ? 0 : 1);
