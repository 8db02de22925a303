// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the shipped viewer worker in node; a folder of published files replaces the web server.
import {closeSync, existsSync, fstatSync, openSync, readFileSync, readSync} from 'node:fs';
import {join} from 'node:path';
import vm from 'node:vm';

/// Returns fetch() for the files of a folder under http://folder/, with ranges. `fault(request,
/// response)` may change the response (undefined: never answers; null: the request fails; a null
/// body: the response breaks off). Responses come `latency` milliseconds after the request. `log`
/// lists all requests. Its `unanswered` counts the earlier requests that were still open, except
/// those made at the same time. `time`: a VirtualTime.
export function folderFetch(folder, fault = (_, response) => response, latency = 1, time = globalThis) {
  const log = [];
  let batch = 0;
  const waiting = new Map();  // batches by request
  const answer = (url, request) => {
    const path = join(folder, decodeURIComponent(new URL(url).pathname)), {range} = request;
    if (!existsSync(path)) return fault(request, {status: 404, headers: {}, body: Buffer.alloc(0)});
    if (!range) return fault(request, {status: 200, headers: {}, body: readFileSync(path)});
    const file = openSync(path, 'r');
    const {size} = fstatSync(file);
    const [first, last] = /^bytes=(\d+)-(\d+)$/.exec(range).slice(1).map(Number);
    const body = Buffer.alloc(Math.max(0, Math.min(last + 1, size) - first));
    readSync(file, body, 0, body.length, first);
    closeSync(file);
    return fault(
        request,
        first >= size ? {status: 416, headers: {}, body: Buffer.alloc(0)} :
                        {status: 206, headers: {'Content-Range': `bytes ${first}-${first + body.length - 1}/${size}`}, body});
  };
  const fetch = async (url, options = {}) => {
    const request = {path: new URL(url).pathname, range: options.headers?.Range, method: options.method ?? 'GET', cache: options.cache};
    request.unanswered = [...waiting.values()].filter(other => other !== batch).length;
    log.push(request);
    waiting.set(request, batch);
    queueMicrotask(() => ++batch);
    await new Promise(resume => time.setTimeout(resume, latency));
    waiting.delete(request);
    if (options.signal?.aborted) throw new DOMException('aborted', 'AbortError');
    const response = answer(url, request);
    if (response === null) throw new TypeError('fetch failed');
    if (response === undefined) {
      await new Promise((_, reject) => options.signal.addEventListener('abort', () => reject(new DOMException('aborted', 'AbortError'))));
    }
    return {
      status: response.status,
      ok: response.status >= 200 && response.status < 300,
      headers: new Headers(response.headers),
      body: null,
      arrayBuffer: async () => {
        if (response.body === null) throw new TypeError('terminated');
        return Uint8Array.from(response.body).buffer;
      }
    };
  };
  return {fetch, log};
}

/// Starts `script` (worker.js) with timeouts `haste` times as fast. Its messages go to `said`. `time`: a VirtualTime.
export class Worker {
  constructor(script, fetch, said, haste = 1, time = globalThis) {
    this.self = {
      postMessage: message => {
        if (message.type === 'frame') queueMicrotask(() => this.send({type: 'drawn', buffer: message.changes.buffer}));
        said(message);
      }
    };
    vm.runInNewContext(readFileSync(script, 'utf8'), {
      self: this.self,
      fetch,
      WebAssembly,
      TextEncoder,
      TextDecoder,
      AbortController,
      Blob,
      DecompressionStream,
      Response,
      performance: time.performance,
      // A MessageChannel of node would keep the process alive.
      MessageChannel: class {
        port1 = {};
        port2 = {postMessage: () => (time === globalThis ? setImmediate : time.setTimeout)(() => this.port1.onmessage())};
      },
      setTimeout: (work, delay) => time.setTimeout(work, (delay ?? 0) / haste),
      clearTimeout: time.clearTimeout,
      ArrayBuffer,
      Uint8Array,
      Uint32Array,
      Float64Array,
      DataView,
      Map,
      Math
    });
  }
  send(data) {
    this.self.onmessage({data});
  }
}
