// SPDX-License-Identifier: GPL-3.0-or-later
// A static web server with range requests for a published folder, with faults on request.
import {createServer} from 'node:http';
import {createReadStream, existsSync, statSync} from 'node:fs';
import {join, normalize} from 'node:path';

const TYPES = {html: 'text/html', js: 'text/javascript', css: 'text/css', json: 'application/json', wasm: 'application/wasm'};

/// Serves `folder` on a free port. `fault(request)` may return 'whole', 'short', 'packed', 'missing', 'error',
/// 'replaced', 'damaged' or 'dead' for a request {path, range, method}, or 'held': it is answered when the test calls release().
/// log lists all requests.
export async function serveSite(folder) {
  const log = [];
  const site = {log, fault: () => null};
  const released = new Promise(resolve => site.release = resolve);
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname));
    const entry = {path, range: request.headers.range ?? null, method: request.method, status: 0, bytes: 0};
    log.push(entry);
    const fault = site.fault(entry);
    const file = join(folder, path === '/' ? 'index.html' : path);
    const send = (status, headers, begin, end) => {
      entry.status = status;
      response.writeHead(status, headers);
      if (request.method === 'HEAD') return response.end();
      if (begin === undefined || end < begin) return response.end();
      entry.bytes = end - begin + 1;
      const stream = createReadStream(file, {start: begin, end});
      if (fault === 'damaged') {
        stream.on('data', data => {
          for (let i = 0; i < data.length; i += 7) data[i] ^= 0x55;
          response.write(data);
        });
        stream.on('end', () => response.end());
      } else {
        stream.pipe(response);
      }
      return undefined;
    };
    if (fault === 'held') return released.then(answer);
    return answer();

    function answer() {
      if (fault === 'dead') return request.socket.destroy();
      if (fault === 'error') return send(500, {});
      if (fault === 'missing' || !existsSync(file) || !statSync(file).isFile()) return send(404, {});
      const {size} = statSync(file);
      const type = {'Content-Type': TYPES[file.split('.').pop()] ?? 'application/octet-stream', ETag: fault === 'replaced' ? '"b"' : '"a"'};
      const range = /^bytes=(\d+)-(\d+)$/.exec(entry.range ?? '');
      if (!range || fault === 'whole') return send(200, {...type, 'Content-Length': size}, 0, size - 1);
      const first = Number(range[1]), last = Math.min(Number(range[2]), size - 1);
      if (first >= size) return send(416, {'Content-Range': `bytes */${size}`});
      const total = fault === 'replaced' ? size + 1 : size;
      const headers = {...type, 'Content-Range': `bytes ${first}-${last}/${total}`, 'Cache-Control': 'no-store'};
      if (fault === 'packed') headers['Content-Encoding'] = 'gzip';
      if (fault === 'short') {
        // The connection ends in the middle of the announced content.
        response.writeHead(206, {...headers, 'Content-Length': last - first + 1});
        entry.status = 206;
        response.write(Buffer.alloc(Math.floor((last - first + 1) / 2)), () => request.socket.destroy());
        return undefined;
      }
      return send(206, {...headers, 'Content-Length': last - first + 1}, first, last);
    }
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  site.url = `http://127.0.0.1:${server.address().port}/`;
  site.close = () => new Promise(resolve => {
    server.closeAllConnections();
    server.close(resolve);
  });
  return site;
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  console.log((await serveSite(process.argv[2])).url);
}
