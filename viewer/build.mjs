// SPDX-License-Identifier: GPL-3.0-or-later
// build.mjs [FOLDER]: bundles the viewer's TypeScript into FOLDER (default: dist), next to the page and the core.
import {copyFileSync, mkdirSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

import {build} from 'esbuild';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, 'dist');
mkdirSync(out, {recursive: true});
await build({
  absWorkingDir: here,
  entryPoints: ['src/viewer.ts', 'src/worker.ts'],
  outdir: out,
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2022',
  legalComments: 'none',
  banner: {js: '// terrace viewer, GPL-3.0-or-later. Sources: viewer/ of terrace.'},
  logLevel: 'warning'
});
for (const name of ['index.html', 'viewer.css']) copyFileSync(join(here, 'src', name), join(out, name));
