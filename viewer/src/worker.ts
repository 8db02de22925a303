// SPDX-License-Identifier: GPL-3.0-or-later
/// The worker: runs the core, fetches the bytes that it lacks, and computes a frame whenever there is work.

import {type Answer, type ByteRange, type Camera, type Changes, Core, CoreError, type Kind, VERTEX_BYTES} from './core';
import type {FromWorker, ToWorker} from './messages';
import {FetchFault, fetchAll, NO_VIEW, Ranges} from './ranges';
import {type Listed, type Manifest, parseManifest, parseStart} from './store';

/// Milliseconds that a frame may take in the worker, and the part reserved for the unpredictable: garbage collection,
/// starting requests, other programs.
const FRAME = 10, IN_HAND = 3;
/// Work and memory of a point on a surface in space, relative to other points.
const SURFACE_COST = 4;
/// The same for a vertex of a raster, whose model knows samples that are not drawn.
const RASTER_COST = 2;
/// Maximum number of a scan's bytes kept for the other module.
const MOST_GIVEN = 64 << 20;
/// Milliseconds without changes after which the surface is recomputed from scratch.
const REST = 700;
/// Milliseconds after which a frame checks whether removed parts need no longer be drawn.
const EXCHANGE = 30;
/// Maximum number of frames sent that the page has not drawn yet.
const AHEAD = 6;

declare const self: {
  onmessage: ((event: {data: ToWorker}) => void)|null;
  postMessage(message: FromWorker, transfer: Transferable[]): void;
};

function post(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, transfer);
}

class Session {
  private core!: Core;
  private points!: Core;                ///< shows rasters and points
  private surface: Core|null = null;    ///< shows the surface of a scan
  private scan = false;
  private terrain = false;              ///< known not to be a scan
  private asPoints: boolean;
  private exaggeration: number;
  private restored = false;             ///< the surface was just recomputed
  private followed = false;             ///< the surface has changed since it was last recomputed
  private restTimer: ReturnType<typeof setTimeout>|undefined;
  private exchange: ReturnType<typeof setTimeout>|undefined;
  private given: Array<{file: string, offset: number, data: Uint8Array}> = [];  ///< bytes of a scan
  private givenBytes = 0;
  private ranges!: Ranges;
  private probing!: Ranges;  ///< fetches bytes for questions about the store
  /// Waiting questions; answer() tries to answer and returns the bytes that it lacks.
  private questions: Array<{type: string, answer: () => Answer<void>}> = [];
  private lacking: ByteRange[] = [];  ///< bytes missing for the first question
  private classes = new Set<number>();  ///< classes of the points found so far
  private classKind: Kind|null = null;  ///< the kind in which points have classes
  private manifest!: Manifest;
  private ground: number[] = [];
  private camera: Camera|null = null;
  private serial = 0;  ///< number of the view
  private opened = false;
  private failed = false;
  private damaged = 0;  ///< how often damaged bytes arrived
  private undrawn = 0;
  private scheduled = false;
  private idle = false;  ///< nothing to do until a message or bytes arrive
  /// Lets pending messages in between two frames; timers would add 4 ms in browsers.
  private readonly turns = new MessageChannel();

  constructor(private readonly request: ToWorker&{type: 'open'}) {
    this.asPoints = request.asPoints;
    this.exaggeration = request.exaggeration;
    this.turns.port1.onmessage = () => {
      this.scheduled = false;
      this.step();
    };
  }

  async open(): Promise<void> {
    try {
      const fetched = this.choose().then(name => fetchAll(this.at(`stores/${encodeURIComponent(name)}.start`) + this.request.query, 'the store'));
      const [core, bytes] = await Promise.all([this.load('core.wasm'), fetched]);
      this.core = this.points = core;
      let start;
      try {
        start = await parseStart(bytes);
      } catch (error) {
        throw new FetchFault(`the start file of the store is damaged: ${(error as Error).message}`, false);
      }
      const manifest = start.parts.find(part => part.file === 'manifest.json');
      if (!manifest) throw new FetchFault('the start file of the store is damaged: it has no manifest', false);
      this.manifest = parseManifest(manifest.data);
      this.ground = start.ground;
      for (const [name, size] of this.manifest.files) this.core.addFile(name, size);
      for (const part of start.parts) this.give(part.file, part.offset, part.data);
      const ranges = (give: (file: string, offset: number, data: Uint8Array) => void, ended: () => void) => new Ranges(
          this.at(`stores/${encodeURIComponent(this.request.name)}/`), this.request.query, this.manifest.files,
          (range, data) => give(range.file, range.offset, data), fault => this.fail(fault.message), ended);
      this.ranges = ranges((file, offset, data) => this.give(file, offset, data), () => this.wake());
      this.probing = ranges(
          (file, offset, data) => {
            this.points.give(file, offset, data);
            const end = offset + data.length;
            this.lacking = this.lacking.filter(range => range.file !== file || range.offset < offset || range.offset + range.bytes > end);
          },
          () => this.lacking.length > 0 ? this.fetchLacking() : this.reply());
      for (const group of start.classes ?? []) this.classes.add(group);
      this.ranges.stats.requests = 1;
      this.ranges.stats.bytes = bytes.length;
      post({type: 'progress', bytes: bytes.length});
      this.schedule();
    } catch (error) {
      this.fail((error as Error).message);
    }
  }
  private at(path: string): string {
    return this.request.base + path;
  }
  private async load(module: string, kind?: Kind): Promise<Core> {
    return Core.load(await fetchAll(this.at(module), 'the viewer') as BufferSource, kind);
  }
  /// Returns the store to open.
  private async choose(): Promise<string> {
    if (this.request.choose) {
      let stores: Listed[];
      try {
        stores = JSON.parse(new TextDecoder().decode(await fetchAll(this.at('stores.json') + this.request.query, 'stores.json'))).stores;
      } catch (error) {
        throw error instanceof FetchFault ? error : new FetchFault(`stores.json: ${(error as Error).message}`, false);
      }
      if (stores.length === 0) throw new FetchFault('stores.json: it lists no stores.', false);
      this.request.name = (stores.find(store => store.name === this.request.name) ?? stores[0]).name;
      this.request.choose = false;
      post({type: 'chosen', stores, name: this.request.name});
    }
    return this.request.name;
  }
  /// Retries after a fault.
  retry(): void {
    this.failed = false;
    if (!this.ranges) {
      void this.open();
      return;
    }
    this.damaged = 0;
    this.distrust();
    this.wake();
    this.reply();
  }
  view(camera: Camera, serial: number): void {
    clearTimeout(this.restTimer);
    this.camera = camera;
    this.serial = serial;
    this.wake();
  }
  drawn(buffer: ArrayBuffer): void {
    this.core.recycle(buffer);
    this.undrawn = Math.max(0, this.undrawn - 1);
    if (!this.idle) this.schedule();
  }
  pick(request: ToWorker&{type: 'pick'}): void {
    const hit = this.opened ? this.core.pick(request.origin, request.direction, request.angle) : null;
    post({type: 'picked', id: request.id, hit});
  }
  probe({id, stored, reach}: ToWorker&{type: 'probe'}): void {
    this.ask('probe', () => this.points.probe(stored, reach), found => post({type: 'probed', id, found}));
  }
  profile({id, from, to, axis}: ToWorker&{type: 'profile'}): void {
    this.ask('profile', () => this.points.profile(from, to, axis), profile => post({type: 'profiled', id, profile}));
  }
  outline(request: ToWorker&{type: 'outline'}): void {
    if (this.opened) post({type: 'outlined', lines: this.core.outline(request.level, request.ordinal)});
  }
  pin({cluster, pin}: ToWorker&{type: 'pin'}): void {
    if (this.opened) this.core.pin(cluster, pin);
    this.wake();
  }
  /// Shows a scan as a surface or as points.
  async show(asPoints: boolean): Promise<void> {
    if (asPoints === this.asPoints || !this.scan) return;
    this.asPoints = asPoints;
    if (this.opened) await this.change();
  }
  exaggerate(exaggeration: number): void {
    if (exaggeration === this.exaggeration) return;
    this.exaggeration = exaggeration;
    if (!this.terrain) return;  // not open yet, or a scan
    this.opened = false;
    this.wake();
  }
  hash(id: number): void {
    if (this.opened && this.showsSurface) {
      this.restore();
      this.frame();
    }
    post({type: 'hashed', id, hash: this.opened ? this.core.hash() : ''});
  }

  private ask<T>(type: string, attempt: () => Answer<T>, give: (answer: T) => void): void {
    if (type === 'profile') this.questions = this.questions.filter(question => question.type !== type);
    this.questions.push({
      type,
      answer: () => {
        const result = attempt();
        if ('missing' in result) return result;
        give(result.answer);
        return {answer: undefined};
      }
    });
    this.reply();
  }
  /// Answers questions in order, and fetches the bytes that the next answer lacks.
  private reply(): void {
    while (this.questions.length > 0 && !this.failed) {
      try {
        const result = this.questions[0].answer();
        if ('missing' in result) {
          this.lacking = result.missing;
          return this.fetchLacking();
        }
        this.questions.shift();
      } catch (error) {
        this.suspect(error as Error);
      }
    }
  }
  private fetchLacking(): void {
    if (!this.failed) this.probing.want(this.lacking, NO_VIEW, performance.now());
  }
  private distrust(): void {
    this.ranges.distrust();
    this.probing.distrust();
  }
  private fail(message: string): void {
    if (this.failed) return;
    this.failed = true;
    this.ranges?.stop();
    this.probing?.stop();
    post({type: 'failed', message});
  }
  private wake(): void {
    this.idle = false;
    this.schedule();
  }
  private schedule(): void {
    if (this.scheduled || this.failed || !this.ranges) return;
    this.scheduled = true;
    this.turns.port2.postMessage(null);
  }
  private step(): void {
    if (this.failed || this.undrawn >= AHEAD) return;
    try {
      if (this.opened) {
        this.frame();
      } else {
        this.tryToOpen();
      }
    } catch (error) {
      this.suspect(error as Error);
    }
  }
  /// Fetches bytes with a wrong checksum once more, bypassing all caches.
  private suspect(error: Error): void {
    if (!(error instanceof CoreError) || ++this.damaged > 1) return this.fail(error.message);
    this.dropGiven();
    for (const name of this.manifest.files.keys()) {
      this.points.forget(name);
      this.surface?.forget(name);
    }
    this.distrust();
    this.schedule();
  }
  private give(file: string, offset: number, data: Uint8Array): void {
    // It is known whether a store is a scan once the scene is open; few bytes arrive before that.
    if (!this.opened || this.scan) {
      this.given.push({file, offset, data});
      this.givenBytes += data.length;
      while (this.givenBytes > MOST_GIVEN && this.given.length > 1) this.givenBytes -= this.given.shift()!.data.length;
    }
    this.core.give(file, offset, data);
  }
  private tryToOpen(): void {
    const cost = this.showsSurface ? SURFACE_COST : this.manifest.kind === 'grid' ? RASTER_COST : 1;
    const maxPoints = Math.round(this.request.maxPoints / cost);
    // Heights do not decide any more whether it is a scan.
    const exaggeration = this.terrain ? this.exaggeration : 1, ground = this.ground.map((n, i) => i < 6 ? n : n * exaggeration);
    const result = this.core.open(ground, maxPoints);
    if ('missing' in result) {
      post({type: 'progress', bytes: this.ranges.stats.bytes});
      this.ranges.want(result.missing, NO_VIEW, performance.now());
      return;
    }
    if (!this.terrain) this.scan ||= result.scan;
    if (!this.scan && !this.terrain) {
      this.terrain = true;
      if (this.exaggeration !== 1) return this.tryToOpen();
    }
    if (this.scan && this.showsSurface === this.asPoints) {
      void this.change();
      return;
    }
    if (!this.scan) this.dropGiven();
    this.opened = true;
    if (result.colours.classes.length > 0) this.classKind = result.kind;
    for (const group of result.colours.classes) this.classes.add(group);
    result.colours.classes = this.listed();
    post({type: 'opened', manifest: this.manifest, scene: {...result, scan: this.scan}, ground, exaggeration});
    this.schedule();
  }
  private listed(): number[] {
    return [...this.classes].sort((a, b) => a - b);
  }
  /// Reports classes not seen before: a large store's start file may not list them all.
  private noteClasses({vertices}: Changes): void {
    if (this.classKind === null) return;
    const before = this.classes.size;
    // ScenePoint of scene.hpp: the level, 255 for none, and the class.
    for (let at = 0; at < vertices.length; at += VERTEX_BYTES[this.classKind]) {
      if (vertices[at + 15] !== 255) this.classes.add(vertices[at + 19]);
    }
    if (this.classes.size > before) post({type: 'classes', classes: this.listed()});
  }
  private dropGiven(): void {
    this.given = [];
    this.givenBytes = 0;
  }
  private get showsSurface(): boolean {
    return this.core === this.surface;
  }
  /// Switches to the module for the form in which a scan is shown, and passes on the available bytes.
  private async change(): Promise<void> {
    this.opened = false;
    clearTimeout(this.restTimer);
    const asPoints = this.asPoints;
    try {
      if (!asPoints && this.surface === null) {
        const core = await this.load('body.wasm', 'surface');
        for (const [name, size] of this.manifest.files) core.addFile(name, size);
        this.surface ??= core;
      }
    } catch (error) {
      return this.fail((error as Error).message);
    }
    if (asPoints !== this.asPoints) return;
    this.core = asPoints ? this.points : this.surface!;
    for (const {file, offset, data} of this.given) this.core.give(file, offset, data);
    this.wake();
  }
  private restore(): void {
    this.core.restore(performance.now() / 1000);
    this.followed = false;
    this.restored = true;
  }
  /// Recomputes the surface of a scan, so that it depends on the points alone, once the camera rests.
  private settle(settled: boolean, changed: boolean): void {
    clearTimeout(this.restTimer);
    this.followed ||= changed;
    if (!settled || !this.followed) return;
    this.restTimer = setTimeout(() => {
      if (!this.opened || !this.showsSurface || this.failed) return;
      this.restore();
      this.wake();
    }, REST);
  }
  private frame(): void {
    if (!this.camera) return;
    const begin = performance.now();
    const {state, missing, same} = this.core.frame(this.camera, (FRAME - IN_HAND) / 1000, begin / 1000);
    const changes = this.core.changes();
    this.noteClasses(changes);
    const changed = changes.vertexBlocks.length > 0 || changes.triangleBlocks.length > 0;
    this.ranges.want(missing, this.serial, begin, same);
    const milliseconds = performance.now() - begin;
    if (this.showsSurface) this.settle(state.settled, changed && !this.restored);
    this.restored = false;
    // Missing bytes wake it again when they arrive.
    this.idle = state.settled || (!changed && same && this.ranges.waiting && missing.length > 0);
    clearTimeout(this.exchange);
    if (this.idle && state.waiting) this.exchange = setTimeout(() => this.wake(), EXCHANGE);
    ++this.undrawn;
    post(
        {
          type: 'frame',
          serial: this.serial,
          state,
          changes,
          stats: {
            requests: this.ranges.stats.requests + this.probing.stats.requests,
            bytes: this.ranges.stats.bytes + this.probing.stats.bytes
          },
          milliseconds,
          loading: !state.settled || (this.showsSurface && this.followed),
          time: begin / 1000
        },
        [changes.buffer]);
    if (!this.idle) this.schedule();
  }
}

let session: Session|null = null;
self.onmessage = event => {
  const message = event.data;
  switch (message.type) {
    case 'open':
      session = new Session(message);
      post({type: 'started'});
      void session.open();
      break;
    case 'view':
      session?.view(message.camera, message.serial);
      break;
    case 'drawn':
      session?.drawn(message.buffer);
      break;
    case 'pick':
      session?.pick(message);
      break;
    case 'probe':
      session?.probe(message);
      break;
    case 'profile':
      session?.profile(message);
      break;
    case 'outline':
      session?.outline(message);
      break;
    case 'pin':
      session?.pin(message);
      break;
    case 'show':
      void session?.show(message.asPoints);
      break;
    case 'exaggerate':
      session?.exaggerate(message.exaggeration);
      break;
    case 'hash':
      session?.hash(message.id);
      break;
    case 'retry':
      session?.retry();
      break;
  }
};
