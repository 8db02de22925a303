// SPDX-License-Identifier: GPL-3.0-or-later
/// The page: opens stores, passes the view to the worker, and draws the worker's results.

import {add, FOV, length, type Vec3} from './camera';
import {Connection, launch, NO_WORKER} from './connection';
import {VERTEX_BYTES} from './core';
import {Input} from './input';
import {exaggeration, Link} from './link';
import {MapTools} from './map';
import type {FromWorker} from './messages';
import {element, fail, notice, showPanels} from './page';
import {Panels} from './panels';
import {Places} from './place';
import {Renderer} from './render';
import {Scene} from './scene';
import type {Listed} from './store';
import {readable} from './text';

class Viewer {
  private readonly scene = new Scene(element<HTMLCanvasElement>('picture'));
  private readonly renderer = new Renderer(this.scene.canvas);
  private readonly link = new Link(this.scene);
  private readonly worker = new Connection(message => this.receive(message));
  private readonly places = new Places(this.scene, this.worker, this.renderer);
  private readonly map = new MapTools(this.scene, this.worker, this.places, () => this.change(true));
  private readonly input = new Input(this.scene, this.places, zoomed => this.change(zoomed));
  private readonly panels: Panels;
  private stores: Listed[] = [];
  private first = true;  ///< the store is the link's
  private lost = false;  ///< the WebGL context is lost
  private frameTime = 16;
  private lastDrawn = 0;
  private linkTimer = 0;
  private pivotTimer = 0;
  private exaggerateTimer = 0;
  private ticked = 0;  ///< time of the last tick

  /// `worker` was launched for the store in the link.
  constructor(worker: Worker) {
    this.link.read();
    this.worker.use(worker);
    this.panels = new Panels(this.scene, {
      showAsPoints: points => this.showAsPoints(points),
      turnUpright: () => void this.places.askProfile(),
      exaggerate: () => this.exaggerate(),
      picture: () => this.savePicture(),
      writeLink: () => this.link.write()
    });
    this.panels.setDark(matchMedia('(prefers-color-scheme: dark)').matches);
    this.panels.show();
    this.bind();
    requestAnimationFrame(() => this.tick());
  }

  /// For tests and debugging.
  hash(): Promise<string> {
    return this.worker.hash();
  }
  get settled(): boolean {
    const {moved, pivoting, status, serial, now} = this.scene;
    if (moved || pivoting || this.input.moving || this.stretching || status === null || status.serial !== serial) return false;
    return status.state.settled && !status.state.waiting && !this.renderer.sliding(now);
  }
  /// Waiting for the heights that the user wants.
  private get stretching(): boolean {
    const {scan, exaggeration, look} = this.scene;
    return !scan && exaggeration !== look.exaggeration;
  }
  get state(): object {
    const {store, camera, status, kind} = this.scene;
    return {
      store,
      settled: this.settled,
      complete: this.scene.complete,
      exaggeration: this.scene.look.exaggeration,
      camera: {target: camera.target, azimuth: camera.azimuth, tilt: camera.tilt, distance: camera.distance},
      points: status?.state.points ?? 0,
      triangles: status?.state.triangles ?? 0,
      bytes: status?.stats.bytes ?? 0,
      requests: status?.stats.requests ?? 0,
      outlined: this.renderer.outlined,
      paths: this.renderer.drawnPaths,
      kind
    };
  }
  /// For tests: sets the view of a recorded flight.
  fly(eye: Vec3, direction: Vec3, aspect: number, height: number, error: number): void {
    this.worker.send({
      type: 'view',
      serial: ++this.scene.serial,
      camera: {eye, direction, up: [0, 0, 1], fov: FOV, aspect, height, error}
    });
  }

  // ---- Stores ----------------------------------------------------------------------------------

  private open(name: string, first: boolean): void {
    const {scene} = this;
    this.worker.close();
    this.renderer.clear();
    this.lastDrawn = 0;
    this.first = first;
    scene.store = name;
    scene.manifest = scene.status = null;
    if (!first) {
      // These belong to the previous store.
      scene.region = null;
      scene.look.hidden.clear();
    }
    clearTimeout(this.pivotTimer);
    this.pivotTimer = 0;
    scene.pivoting = false;
    this.places.close();
    element<HTMLSelectElement>('store').value = name;
    element('progress').hidden = false;
    element('message').hidden = true;
    document.title = `${name} · terrace`;
    this.worker.use(launch(name, this.stores.length === 0, scene.asPoints, scene.exaggeration));
  }
  /// Shows the list of stores, and which of them is open.
  private list(stores: Listed[], name: string): void {
    this.stores = stores;
    this.scene.store = name;
    const wanted = this.link.get('s');
    if (wanted !== null && wanted !== name) this.noSuchStore(wanted);
    document.title = `${name} · terrace`;
    const select = element<HTMLSelectElement>('store');
    select.replaceChildren(...stores.map(store => new Option(store.name, store.name)));
    select.disabled = stores.length === 1;
    select.value = name;
  }
  private noSuchStore(name: string): void {
    // The place and the region in the link belong to the missing store.
    this.link.parts = new URLSearchParams();
    this.scene.region = null;
    notice(`Store “${name}” not found; this is “${this.scene.store}”.`);
  }
  private showAsPoints(points: boolean): void {
    this.scene.asPoints = points;
    this.places.close();
    this.scene.status = null;
    this.lastDrawn = 0;
    this.worker.send({type: 'show', asPoints: points});
    this.link.write();
  }
  /// Once the slider rests, because the worker opens the store again.
  private exaggerate(): void {
    clearTimeout(this.exaggerateTimer);
    this.exaggerateTimer = window.setTimeout(() => {
      this.worker.send({type: 'exaggerate', exaggeration: this.scene.exaggeration});
      this.link.write();
    }, 150);
  }
  /// Saves the picture, without panels and marks, as a PNG file.
  private savePicture(): void {
    const {scene} = this;
    this.renderer.draw(scene.camera, scene.look, scene.now);
    scene.canvas.toBlob(blob => {
      if (!blob) return notice('The browser cannot save the picture.', 4);
      const link = document.createElement('a');
      link.href = URL.createObjectURL(blob);
      link.download = `${scene.store}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    }, 'image/png');
  }
  private receive(message: FromWorker): void {
    const {scene} = this;
    switch (message.type) {
      case 'chosen':
        this.list(message.stores, message.name);
        break;
      case 'progress':
        element('progress-text').textContent = `Loading, ${readable(message.bytes)}`;
        break;
      case 'opened':
        this.opened(message);
        break;
      case 'frame': {
        // The worker's clock has a different origin; slides start now.
        const shift = scene.now - message.time;
        if (scene.kind !== 'points' && message.changes.vertexBlocks.length > 0) this.shift(message.changes.vertices, message.time, shift);
        this.renderer.apply(message.state, message.changes, scene.now);
        scene.status = message;
        if (message.changes.vertexBlocks.length > 0) this.places.askOutline(400);
        element('progress').hidden = true;
        requestAnimationFrame(showPanels);
        scene.redraw = true;
        this.worker.send({type: 'drawn', buffer: message.changes.buffer}, [message.changes.buffer]);
        break;
      }
      case 'classes':
        scene.colours.classes = message.classes;
        this.panels.legend();
        break;
      case 'outlined':
        this.renderer.outline(this.places.hit ? message.lines : new Uint32Array());
        scene.redraw = true;
        break;
      case 'failed':
        fail(message.message);
        break;
    }
  }
  private opened(message: FromWorker&{type: 'opened'}): void {
    const {scene} = this;
    const again = scene.manifest !== null;  // the same store in another form
    const stretched = message.exaggeration / scene.look.exaggeration;
    scene.take(message);
    if (again && stretched !== 1) scene.camera.target[2] *= stretched;
    this.renderer.show(scene.box, scene.top, scene.kind, scene.scan);
    if (!again) {
      // Most scans have Y upward; objects that are tallest along Z have Z upward.
      const [x, y, z] = [0, 1, 2].map(i => scene.box[i + 3] - scene.box[i]);
      if (!this.first || !this.link.has('u')) scene.camera.yUp = z <= 1.2 * Math.max(x, y);
      scene.fit();
    }
    if (this.first && !again) this.link.apply();
    if (!scene.offers(scene.look.colour) || (!again && (scene.colours.rgb || scene.scan) && !this.link.has('c'))) {
      scene.look.colour = scene.colours.rgb ? 'rgb' : scene.kind === 'surface' ? 'grey' : 'height';
    }
    this.panels.opened();
    this.map.opened();
    this.places.opened();
    if (again) this.places.stretch(stretched);
    this.sendView();
    const {at} = this.link;
    if (this.first && !again && at) void this.map.goTo(at[0], at[1], at[2]);
  }
  /// Converts the vertices' start times of a frame from the worker's clock to the page's.
  private shift(vertices: Uint8Array, time: number, by: number): void {
    const floats = new Float32Array(vertices.buffer, vertices.byteOffset, vertices.byteLength / 4);
    const exact = Math.fround(time), to = Math.fround(time + by), words = VERTEX_BYTES[this.scene.kind] / 4;
    for (let i = words - 1; i < floats.length; i += words) {
      if (floats[i] === exact) {
        floats[i] = to;
      } else if (floats[i] > 0) {
        floats[i] += by;
      }
    }
  }

  // ---- The picture -----------------------------------------------------------------------------

  private tick(): void {
    requestAnimationFrame(() => this.tick());
    const {scene} = this;
    const now = scene.now;
    this.input.move(Math.min(0.2, now - this.ticked));
    this.ticked = now;
    if (this.renderer.resize()) {
      if (scene.fitted) scene.fit();
      scene.moved = true;
    }
    if (scene.moved) {
      scene.moved = false;
      scene.redraw = true;
      this.sendView();
    }
    const time = scene.now;
    if (!scene.redraw && !this.renderer.sliding(time)) return;
    if (!scene.status && this.lastDrawn > 0) return;  // nothing has changed
    scene.redraw = false;
    this.renderer.draw(scene.camera, scene.look, time);
    // Do not count a pause as a frame.
    if (time - this.lastDrawn < 0.5) this.frameTime = 0.9 * this.frameTime + 100 * (time - this.lastDrawn);
    this.lastDrawn = time;
    this.places.showMarks();
    this.map.show();
    this.panels.status(this.frameTime);
  }
  private sendView(): void {
    if (!this.scene.manifest) return;
    this.worker.send({type: 'view', serial: ++this.scene.serial, camera: this.scene.view()});
    clearTimeout(this.linkTimer);
    this.linkTimer = window.setTimeout(() => this.link.write(), 300);
  }
  /// The user has moved the camera.
  private change(zoomed: boolean): void {
    const {scene} = this;
    scene.moved = true;
    scene.fitted = false;
    // Orbit the middle of a body until the user zooms in.
    if (scene.scan && !zoomed) return;
    scene.pivoting = true;
    clearTimeout(this.pivotTimer);
    this.pivotTimer = window.setTimeout(() => void this.orbitVisiblePlace(), 250);
  }
  /// Once the camera rests, makes it orbit the ground in the middle of the picture.
  private async orbitVisiblePlace(): Promise<void> {
    const timer = this.pivotTimer, {camera} = this.scene;
    const eye = camera.eye, direction = camera.direction;
    const hit = await this.worker.pick(eye, direction, 0.02);
    if (timer !== this.pivotTimer) return;
    if (hit && length(add(camera.eye, eye, -1)) === 0) camera.retarget(length(add(hit.place as Vec3, eye, -1)));
    this.scene.pivoting = false;
    this.link.write();
  }
  private bind(): void {
    const {scene} = this;
    element('store').addEventListener('change', event => {
      const {value} = event.target as HTMLSelectElement;
      // The browser's Back returns to the previous store.
      this.link.write();
      history.pushState(null, '', `#s=${encodeURIComponent(value)}`);
      this.open(value, false);
    });
    element('retry').addEventListener('click', () => {
      if (this.lost) location.reload();
      element('message').hidden = true;
      if (scene.manifest) {
        this.worker.send({type: 'retry'});
      } else {
        this.open(this.stores.length === 0 ? this.link.get('s') ?? '' : scene.store, true);
      }
    });
    addEventListener('hashchange', () => {
      this.link.read();
      this.panels.show();
      const wanted = this.link.get('s');
      if (wanted !== null && wanted !== scene.store && this.stores.some(store => store.name === wanted)) {
        this.open(wanted, true);
      } else if (wanted !== null && wanted !== scene.store) {
        this.noSuchStore(wanted);
        this.link.write();
      } else if (scene.manifest) {
        this.exaggerate();
        this.link.apply();
        this.places.opened();
        scene.moved = true;
        const {at} = this.link;
        if (at) void this.map.goTo(at[0], at[1], at[2]);
      }
    });
    scene.canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      this.lost = true;
      if (scene.manifest) this.link.write();
      fail('The graphics driver failed; it may be short of memory.');
    });
    // Reloading restores the view from the link.
    scene.canvas.addEventListener('webglcontextrestored', () => location.reload());
  }
}

// The worker fetches while WebGL starts, which is slow and blocks the page, so start the worker first.
function start(): void {
  const link = new URLSearchParams(location.hash.slice(1));
  const first = launch(link.get('s') ?? '', true, link.get('p') === '1', exaggeration(link.get('z')));
  first.onmessage = () => {
    try {
      Object.assign(window, {terrace: new Viewer(first)});
    } catch (error) {
      first.terminate();
      fail((error as Error).message, false);
    }
  };
  first.onerror = event => fail(event.message || NO_WORKER, false);
}
if (location.protocol === 'file:') {
  fail('Browsers do not let pages read local files. Put this folder on a web server that supports range requests, or use "terrace view".', false);
} else {
  start();
}
