// SPDX-License-Identifier: GPL-3.0-or-later
// A local server of static files: the client libraries, the page, and folders of tiles, some of
// them with a fault.

import {createReadStream, readFileSync, statSync} from 'node:fs';
import {createServer} from 'node:http';
import {extname, join, normalize} from 'node:path';

const TYPES = {
  '.css': 'text/css',
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.json': 'application/json',
  '.jpg': 'image/jpeg',
  '.png': 'image/png',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
  '.xml': 'text/xml',
  '.terrain': 'application/vnd.quantized-mesh'
};

const isGzip = bytes => bytes.length > 1 && bytes[0] === 0x1f && bytes[1] === 0x8b;

/// Serves mounts (/name/ to {folder, fault}) on a free port of 127.0.0.1; resolves to the server.
/// fault(path, bytes) returns the changes to the response, {status, bytes, encoding}.
export function serve(mounts) {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const name = path.split('/')[1];
    const mount = mounts[name];
    const file = mount && join(mount.folder, path.slice(name.length + 2));
    response.setHeader('Cache-Control', 'no-store');
    if (!file || path.includes('..') || !statSync(file, {throwIfNoEntry: false})?.isFile()) {
      response.writeHead(404).end();
      return;
    }
    response.setHeader('Content-Type', TYPES[extname(file)] ?? 'application/octet-stream');
    if (!/\.(terrain|json)$/.test(file)) {
      createReadStream(file).pipe(response);
      return;
    }
    const bytes = readFileSync(file);
    const sent = {
      status: 200,
      bytes,
      encoding: isGzip(bytes) ? 'gzip' : undefined,
      ...mount.fault?.(path.slice(name.length + 2), bytes)
    };
    if (sent.encoding) response.setHeader('Content-Encoding', sent.encoding);
    response.writeHead(sent.status).end(sent.status === 200 ? sent.bytes : undefined);
  });
  return new Promise(resolve => server.listen(0, '127.0.0.1', () => resolve(server)));
}
