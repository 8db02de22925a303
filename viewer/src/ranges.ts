// SPDX-License-Identifier: GPL-3.0-or-later
/// Fetches byte ranges of a store from a static web server, and never delivers wrong ones.

import type {ByteRange} from './core';

/// Fetching a gap smaller than this is cheaper than another request.
const GAP = 600;
/// The same if part of the gap has been requested already.
const SMALL_GAP = 200;
const MOST_BYTES = 256 * 1024;
/// A camera at rest that lacks more parts of an index than this will need most of it, so larger gaps are fetched.
const MANY_PARTS = 64, PARTS_GAP = 8192;
/// Smaller ranges of a view wait for the requests in progress, and for PAUSE milliseconds after the last request started. By
/// then more nearby ranges are known and can share a request. While more ranges become known in every frame, they wait up to
/// MORE milliseconds longer. A vertex slides for 450 ms, so this is hardly visible.
const SMALL = 16384, PAUSE = 120, MORE = 150;
/// The same without a view: nothing else is known that could share the request.
const SMALL_ALONE = 4096, PAUSE_ALONE = 20;
const MOST_REQUESTS = 3;
const TRIES = 4;
const FORBIDDEN = 'access denied (HTTP 403). Open the full address that "terrace view" printed, with its token.';
/// Milliseconds a server may be silent, before its answer starts and until the bytes arrive; tried twice.
const SILENCE = 10_000;
/// Milliseconds until a request that the current view no longer needs is cancelled.
const PATIENCE = 700;

/// A fault described for the user. `fatal`: the same request would fail again.
export class FetchFault extends Error {
  constructor(message: string, readonly fatal: boolean) {
    super(message);
  }
}

class SilentFault extends FetchFault {}

/// Cancels a request if nothing arrives for too long.
class Watch {
  private readonly abort = new AbortController();
  private timer: ReturnType<typeof setTimeout>|undefined;
  private silent = false;

  constructor(signal?: AbortSignal) {
    signal?.addEventListener('abort', () => this.abort.abort());
    this.restart();
  }
  get signal(): AbortSignal {
    return this.abort.signal;
  }
  restart(): void {
    this.end();
    this.timer = setTimeout(() => {
      this.silent = true;
      this.abort.abort();
    }, SILENCE);
  }
  end(): void {
    clearTimeout(this.timer);
  }
  /// Returns the fault to report for an error of fetch() or of reading its answer.
  fault(what: string, error: unknown): unknown {
    if (this.silent) return new SilentFault(`${what}: the server has been silent for ${SILENCE / 1000} seconds.`, false);
    return error instanceof FetchFault ? error : new FetchFault(`${what}: the server does not answer.`, false);
  }
}

/// Returns the bytes at a URL, which messages call `what`.
export async function fetchAll(url: string, what: string): Promise<Uint8Array<ArrayBuffer>> {
  const watch = new Watch();
  try {
    const response = await fetch(url, {signal: watch.signal});
    watch.restart();
    if (response.status === 403) throw new FetchFault(`${what}: ${FORBIDDEN}`, false);
    if (!response.ok) throw new FetchFault(`${what}: the server returned HTTP ${response.status}.`, false);
    return new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    throw watch.fault(what, error);
  } finally {
    watch.end();
  }
}

export interface Stats {
  requests: number;
  bytes: number;
}

interface Flight extends ByteRange {
  abort: AbortController;
  wanted: number;  ///< when it was last needed
  view: number;    ///< the view that needed it
}

/// The bytes of files that have been requested.
export class Requested {
  private readonly extents = new Map<string, Array<[number, number]>>();  ///< ascending, apart

  add({file, offset, bytes}: ByteRange): void {
    const list = this.extents.get(file) ?? [], end = offset + bytes;
    const first = Requested.after(list, offset), last = Requested.after(list, end + 1, 0);
    const merged: [number, number] = last > first ? [Math.min(offset, list[first][0]), Math.max(end, list[last - 1][1])] : [offset, end];
    list.splice(first, last - first, merged);
    this.extents.set(file, list);
  }
  /// Returns whether any of the bytes in between have been requested.
  meets(file: string, from: number, to: number): boolean {
    const list = this.extents.get(file) ?? [], at = Requested.after(list, from + 1);
    return at < list.length && list[at][0] < to;
  }
  /// Returns the first extent that ends (1) or begins (0) at or after `place`.
  private static after(list: Array<[number, number]>, place: number, side = 1): number {
    let low = 0, high = list.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (list[middle][side] < place) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

function isIndex({file}: ByteRange): boolean {
  return file.endsWith('.index');
}

/// Joins nearby ranges, in the order of their first parts. Across more than a small gap, joins only if none of it has been
/// requested. `rests`: the view is not new.
export function joined(ranges: ByteRange[], requested = new Requested(), rests = false): ByteRange[] {
  const many = rests && ranges.filter(isIndex).length > MANY_PARTS;
  const rank = new Map(ranges.map((range, i) => [range, i]));
  const sorted =
      [...ranges].sort((a, b) => a.file < b.file ? -1 : a.file > b.file ? 1 : a.offset - b.offset);
  const result: Array<ByteRange&{rank: number}> = [];
  for (const range of sorted) {
    const last = result[result.length - 1], gap = many && isIndex(range) ? PARTS_GAP : GAP;
    const end = range.offset + range.bytes;
    if (last && last.file === range.file && range.offset <= last.offset + last.bytes + gap &&
        Math.max(end, last.offset + last.bytes) - last.offset <= MOST_BYTES &&
        (range.offset <= last.offset + last.bytes + SMALL_GAP || !requested.meets(range.file, last.offset + last.bytes, range.offset))) {
      last.bytes = Math.max(last.bytes, end - last.offset);
      last.rank = Math.min(last.rank, rank.get(range)!);
    } else {
      result.push({...range, rank: rank.get(range)!});
    }
  }
  return result.sort((a, b) => a.rank - b.rank).map(({file, offset, bytes}) => ({file, offset, bytes}));
}

/// Orders joined ranges for the next requests: the first, then by size, because small ones may grow until their turn comes.
/// Parts of an index come after the others, in their order, because less of it is needed as the view comes closer.
function chosen([first, ...others]: ByteRange[]): ByteRange[] {
  const weight = (range: ByteRange) => isIndex(range) && range.bytes < PARTS_GAP ? 0 : range.bytes;
  return first ? [first, ...others.sort((a, b) => weight(b) - weight(a))] : [];
}

function contains(outer: ByteRange, inner: ByteRange): boolean {
  return outer.file === inner.file && outer.offset <= inner.offset && inner.offset + inner.bytes <= outer.offset + outer.bytes;
}

/// For ranges that no view asks for.
export const NO_VIEW = 0;

export class Ranges {
  readonly stats: Stats = {requests: 0, bytes: 0};
  private flights: Flight[] = [];
  private readonly tags = new Map<string, string>();
  private readonly requested = new Requested();
  private fresh = false;
  /// What frames of `view` have lacked and no request has covered. A frame may lack time to list everything.
  private readonly listed = new Map<string, ByteRange>();
  private view = NO_VIEW;
  private viewed = -PAUSE;  ///< since when it is this view
  private begun = -PAUSE;  ///< start of the last request
  private pause: ReturnType<typeof setTimeout>|undefined;

  /// query: appended to each URL. sizes: of the files, by name. `give`: receives the bytes. `failed`: receives faults.
  /// `ended`: called after each request, successful or not.
  constructor(
      private readonly base: string, private readonly query: string, private readonly sizes: Map<string, number>,
      private readonly give: (range: ByteRange, bytes: Uint8Array) => void,
      private readonly failed: (fault: FetchFault) => void, private readonly ended: () => void) {}

  get waiting(): boolean {
    return this.flights.length > 0 || this.pause !== undefined;
  }
  /// Bypasses caches from now on, because the received bytes were damaged.
  distrust(): void {
    this.fresh = true;
    this.tags.clear();
  }
  /// Sets the ranges that a view lacks, most important first. Others requested for an earlier view are cancelled after a
  /// while. `view`: its number, or NO_VIEW. `stable`: the list is as long as it will get before more bytes arrive.
  want(ranges: ByteRange[], view: number, now: number, stable = true): void {
    const left: ByteRange[] = [];
    if (view !== this.view) this.viewed = now;
    for (const range of this.extended(ranges, view)) {
      const flight = this.flights.find(f => contains(f, range));
      if (flight) {
        flight.wanted = now;
        flight.view = view;
      } else {
        left.push(range);
      }
    }
    for (const flight of this.flights) {
      if (flight.view !== view && now - flight.wanted > PATIENCE) flight.abort.abort();
    }
    const [small, pause] = view === NO_VIEW ? [SMALL_ALONE, PAUSE_ALONE] : [SMALL, PAUSE];
    const due = Math.min(this.begun, this.viewed) + pause;
    const all = this.flights.length === 0 && now >= (stable ? due : this.begun + pause + MORE);
    const ready = chosen(joined(left, this.requested, now >= this.viewed + PAUSE).filter(({bytes}) => bytes >= small || all));
    for (const range of ready.slice(0, Math.max(0, MOST_REQUESTS - this.flights.length))) {
      this.begun = now;
      void this.start({...range, abort: new AbortController(), wanted: now, view});
    }
    if (left.length > 0 && this.flights.length === 0) {
      this.pause ??= setTimeout(() => {
        this.pause = undefined;
        this.ended();
      }, Math.max(0, due - now));
    }
  }
  stop(): void {
    for (const flight of this.flights) flight.abort.abort();
    this.flights = [];
    clearTimeout(this.pause);
    this.pause = undefined;
  }

  /// Appends to the ranges what earlier frames of the view have listed, unless it has been requested since.
  private extended(ranges: ByteRange[], view: number): ByteRange[] {
    if (view === NO_VIEW || view !== this.view) this.listed.clear();
    this.view = view;
    const all = new Map(ranges.map(range => [`${range.file} ${range.offset}`, range]));
    for (const [place, range] of this.listed) {
      if (!all.has(place)) all.set(place, range);
    }
    this.listed.clear();
    for (const [place, range] of all) {
      if (!this.flights.some(flight => contains(flight, range))) this.listed.set(place, range);
    }
    return [...all.values()];
  }
  private async start(flight: Flight): Promise<void> {
    this.flights.push(flight);
    this.requested.add(flight);
    for (const [place, range] of this.listed) {
      if (contains(flight, range)) this.listed.delete(place);
    }
    let bytes: Uint8Array|null = null, fault: FetchFault|null = null;
    try {
      bytes = await this.patiently(flight, flight.abort.signal);
    } catch (error) {
      if (!flight.abort.signal.aborted) {
        fault = error instanceof FetchFault ? error : new FetchFault(String(error), true);
      }
    }
    this.flights = this.flights.filter(f => f !== flight);
    if (bytes) this.give(flight, bytes);
    if (fault) this.failed(fault);
    this.ended();
  }
  private async patiently(range: ByteRange, signal: AbortSignal): Promise<Uint8Array> {
    for (let turn = 1;; ++turn) {
      try {
        return await this.once(range, signal);
      } catch (error) {
        if (signal.aborted) throw error;
        if ((error as FetchFault).fatal || turn === (error instanceof SilentFault ? 2 : TRIES)) throw error;
        await new Promise(resume => setTimeout(resume, 250 * 2 ** turn));
      }
    }
  }
  private async once(range: ByteRange, signal: AbortSignal): Promise<Uint8Array> {
    const watch = new Watch(signal);
    try {
      return await this.answer(range, watch);
    } catch (error) {
      // Browsers do not say why reading failed, and they do not read a part that is compressed.
      if (!(error instanceof FetchFault) &&
          await fetch(this.url(range), {method: 'HEAD', signal: watch.signal}).then(() => true, () => false)) {
        throw new FetchFault(
            `${range.file}: the server answers, but part of the file cannot be read: the connection was lost, or the server ` +
                'compresses parts (Content-Encoding). Turn off compression for files of stores.',
            false);
      }
      throw watch.fault(range.file, error);
    } finally {
      watch.end();
    }
  }
  private url({file}: ByteRange): string {
    return this.base + encodeURIComponent(file) + this.query;
  }
  private async answer(range: ByteRange, watch: Watch): Promise<Uint8Array> {
    const last = range.offset + range.bytes - 1;
    ++this.stats.requests;
    const response = await fetch(this.url(range), {
      headers: {Range: `bytes=${range.offset}-${last}`},
      cache: this.fresh ? 'reload' : 'default',
      signal: watch.signal
    });
    watch.restart();
    const fault = (what: string, fatal: boolean) => {
      response.body?.cancel().catch(() => {});
      return new FetchFault(`${range.file}: ${what}`, fatal);
    };
    if (response.status === 200) {
      throw fault(
          'the server sent the whole file instead of a part (HTTP 200, not 206). ' +
              'It must support range requests, as "terrace view" and most web servers do.',
          true);
    }
    if (response.status === 403) throw fault(FORBIDDEN, true);
    if (response.status === 404) throw fault('file not found (HTTP 404).', true);
    if (response.status === 416) throw fault('the file on the server is smaller than the store says (HTTP 416).', true);
    if (response.status !== 206) {
      throw fault(`the server returned HTTP ${response.status}.`, response.status < 500 && response.status !== 429);
    }
    const placed = response.headers.get('Content-Range');
    if (placed !== null) {  // servers of another origin may hide it
      const [, first, end, size] = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(placed) ?? [];
      if (Number(first) !== range.offset || Number(end) !== last) {
        throw fault('the server sent the wrong part.', true);
      }
      if (size !== '*' && Number(size) !== this.sizes.get(range.file)) {
        throw fault('the store on the server has been replaced. Reload it.', true);
      }
    }
    const tag = response.headers.get('ETag');
    if (tag !== null) {
      const known = this.tags.get(range.file);
      if (known !== undefined && known !== tag) {
        throw fault('the store on the server has been replaced. Reload it.', true);
      }
      this.tags.set(range.file, tag);
    }
    const bytes = new Uint8Array(await response.arrayBuffer());
    this.stats.bytes += bytes.length;
    if (bytes.length !== range.bytes) {
      throw fault(`${bytes.length} bytes received instead of ${range.bytes}.`, false);
    }
    return bytes;
  }
}
