// SPDX-License-Identifier: Apache-2.0
// laz_perf.mjs PACKAGES FILE.laz...  decodes files with npm's laz-perf and prints the speed. Compares
// the records with FILE.records if it exists. Exits with 1 if they differ.

import {existsSync, readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [, , packages, ...files] = process.argv;
const {createLazPerf} = createRequire(join(packages, 'package.json'))('laz-perf');
const lazPerf = await createLazPerf();

let different = 0;
for (const name of files) {
  const file = readFileSync(name);
  const bytes = lazPerf._malloc(file.length);
  lazPerf.HEAPU8.set(file, bytes);
  const reader = new lazPerf.LASZip();
  reader.open(bytes, file.length);
  const count = reader.getCount();
  const length = reader.getPointLength();
  const record = lazPerf._malloc(length);
  const expected = name.replace(/\.laz$/, '.records');
  const records = existsSync(expected) ? Buffer.alloc(count * length) : null;
  const begin = process.cpuUsage();
  for (let i = 0; i < count; ++i) {
    reader.getPoint(record);
    records?.set(lazPerf.HEAPU8.subarray(record, record + length), i * length);
  }
  const {user, system} = process.cpuUsage(begin);
  reader.delete();
  lazPerf._free(record);
  lazPerf._free(bytes);

  const same = records?.equals(readFileSync(expected)) ?? true;
  if (!same) ++different;
  const speed = count / (user + system);
  console.log(`${name}: ${count} points, ${speed.toFixed(2)} M points/s${same ? '' : ', other records'}`);
}
process.exit(files.length > 0 && different === 0 ? 0 : 1);
