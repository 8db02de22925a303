// SPDX-License-Identifier: GPL-3.0-or-later
/// The page: passes user input to the camera and the worker, and the worker's results to the renderer.

import {add, FOV, length, OrbitCamera, type Vec3} from './camera';
import {type Hit, type Kind, type Opened, type Profile, VERTEX_BYTES} from './core';
import type {FromWorker, ToWorker} from './messages';
import {classColour, GREYS, gradient, heightStops, LEVELS, SLOPE, type Stop} from './ramps';
import {type Colour, COLOURS, type Look, Renderer} from './render';
import {lengthOnEarth, type Listed, type Manifest, worldPoint} from './store';

const phone = matchMedia('(max-width: 640px)');
const touch = matchMedia('(pointer: coarse)').matches;
/// Maximum number of points drawn. Phones can draw fewer without effort.
const MOST_POINTS = phone.matches ? 400_000 : 1_500_000;
/// The standard classes of ASPRS LAS 1.4.
const CLASSES = ['never classified', 'unclassified', 'ground', 'low vegetation', 'medium vegetation', 'high vegetation',
                 'building', 'low point', 'model key', 'water', 'rail', 'road', 'overlap', 'wire guard', 'wire conductor',
                 'transmission tower', 'wire connector', 'bridge deck', 'high noise', 'overhead structure', 'ignored ground', 'snow',
                 'temporal exclusion'];
/// The token of "terrace view", for the stores; published folders need none.
const TOKEN = new URLSearchParams(location.search).get('token');

function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}
const count = (n: number) => Math.round(n).toLocaleString('en');
const readable = (bytes: number) =>
    bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} KB` : `${(bytes / 1e6).toFixed(1)} MB`;
const rounded = (n: number) => n.toFixed(Math.abs(n) < 10 ? 2 : Math.abs(n) < 1000 ? 1 : 0);
const metres = (n: number) => Math.abs(n) < 10_000 ? `${rounded(n)} m` : `${(n / 1000).toFixed(2)} km`;
/// Inserts texts from a store as text, never as markup.
function make(tag: string, kind: string, ...content: Array<Node|string>): HTMLElement {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  made.append(...content);
  return made;
}
const bold = (text: string) => make('b', '', text);
const counted = (n: number, what: string) => [bold(count(n)), ` ${what}${n === 1 ? '' : 's'}`];
/// Short names of units.
const UNITS: Record<string, string> = {metre: 'm', foot: 'ft', 'US survey foot': 'ft'};

/// Shows the panels over the picture. They wait at first, because a browser that renders in software needs longer to start
/// with them than to show the picture. The style sheet limits the wait.
const showPanels = () => document.body.classList.remove('starting');

const NO_WORKER = 'The viewer\'s worker cannot be loaded. Reload the page.';
function fail(message: string, again = true): void {
  showPanels();
  element('progress').hidden = true;
  element('message').hidden = false;
  element('message-text').textContent = message;
  element('retry').hidden = !again;
}

/// A clicked place, taken from the picture until the store has answered.
interface Place extends Hit {
  state: 'pending'|'known'|'none';
  of: number;  ///< read from points of this level and above
}

/// Starts a worker, which starts fetching a store. `choose` is as in ToWorker.
function launch(name: string, choose: boolean, asPoints: boolean): Worker {
  const worker = new Worker('worker.js'), base = new URL('.', document.baseURI).href;
  const query = TOKEN === null ? '' : `?token=${encodeURIComponent(TOKEN)}`;
  worker.postMessage({type: 'open', base, query, name, choose, asPoints, maxPoints: MOST_POINTS} satisfies ToWorker);
  return worker;
}

class Viewer {
  private readonly canvas = element<HTMLCanvasElement>('picture');
  private readonly renderer: Renderer;
  private readonly camera = new OrbitCamera();
  private readonly look: Look = {colour: 'height', wire: false, dark: false, pointSize: 2.5};
  private error = 4;
  private stores: Listed[] = [];
  private store = '';
  private worker: Worker|null = null;
  private manifest: Manifest|null = null;
  private box: number[] = [];
  private kind: Kind = 'raster';
  private heightUnit = 1;   ///< in metres
  private lost = false;     ///< the WebGL context is lost
  private scan = false;     ///< the store is the scan of a body
  private asPoints = false; ///< show a scan as points
  private colours: Opened['colours'] = {rgb: false, intensity: false, classes: []};
  private picks = new Map<number, (hit: Hit|null) => void>();
  private hashes = new Map<number, (hash: string) => void>();
  private probes = new Map<number, Place>();  ///< waiting for answers from the store
  private profile = 0;  ///< the last one requested
  private level = 255;  ///< minimum level everywhere; 255: none
  private size = 0;     ///< point size in pixels set by the user or the link
  private outlineTimer = 0;  ///< delays the outline until the surface is drawn
  private next = 0;
  private serial = 0;  ///< number of the last view
  private redraw = true;
  private moved = true;
  private status: FromWorker&{type: 'frame'}|null = null;
  private frameTime = 16;
  private lastDrawn = 0;
  private hit: Place|null = null;
  private before: Place|null = null;
  private pointer: [number, number] = [0, 0];  ///< position over the picture, or its middle
  private linkTimer = 0;
  private pivotTimer = 0;
  private fitted = false;    ///< everything is visible, and stays so when the window changes
  private pivoting = false;  ///< waiting for the ground in the middle of the picture

  /// `first` is a worker launched for the store in the link.
  constructor(first: Worker) {
    this.renderer = new Renderer(this.canvas);
    this.readLink();
    this.listen(first, true);
    this.setDark(matchMedia('(prefers-color-scheme: dark)').matches);
    this.bind();
    requestAnimationFrame(() => this.tick());
  }

  /// For tests and debugging.
  async hash(): Promise<string> {
    return new Promise(resolve => {
      const id = ++this.next;
      this.hashes.set(id, resolve);
      this.send({type: 'hash', id});
    });
  }
  get settled(): boolean {
    if (this.moved || this.pivoting || this.status === null || this.status.serial !== this.serial) return false;
    return this.status.state.settled && !this.status.state.waiting && !this.renderer.sliding(this.now);
  }
  get state(): object {
    return {
      store: this.store,
      settled: this.settled,
      camera: {target: this.camera.target, azimuth: this.camera.azimuth, tilt: this.camera.tilt, distance: this.camera.distance},
      points: this.status?.state.points ?? 0,
      triangles: this.status?.state.triangles ?? 0,
      bytes: this.status?.stats.bytes ?? 0,
      requests: this.status?.stats.requests ?? 0,
      outlined: this.renderer.outlined,
      kind: this.kind
    };
  }
  /// For tests: sets the view of a recorded flight.
  fly(eye: Vec3, direction: Vec3, aspect: number, height: number, error: number): void {
    this.send({
      type: 'view',
      serial: ++this.serial,
      camera: {eye, direction, up: [0, 0, 1], fov: FOV, aspect, height, error}
    });
  }

  // ---- The worker ------------------------------------------------------------------------------

  private open(name: string, first: boolean): void {
    this.worker?.terminate();
    this.renderer.clear();
    this.lastDrawn = 0;
    this.store = name;
    this.manifest = null;
    this.status = null;
    clearTimeout(this.pivotTimer);
    this.pivotTimer = 0;
    this.pivoting = false;
    this.closePlace();
    element<HTMLSelectElement>('store').value = name;
    element('progress').hidden = false;
    element('message').hidden = true;
    document.title = `${name} · terrace`;
    this.listen(launch(name, this.stores.length === 0, this.asPoints), first);
  }
  private listen(worker: Worker, first: boolean): void {
    this.worker = worker;
    worker.onmessage = event => this.receive(event.data as FromWorker, first);
    worker.onerror = event => fail(event.message || NO_WORKER);
  }
  /// Shows the list of stores, and which of them is open.
  private list(stores: Listed[], name: string): void {
    this.stores = stores;
    this.store = name;
    const wanted = this.link.get('s');
    if (wanted !== null && wanted !== name) this.noSuchStore(wanted);
    document.title = `${name} · terrace`;
    const select = element<HTMLSelectElement>('store');
    select.replaceChildren(...stores.map(store => new Option(store.name, store.name)));
    select.disabled = stores.length === 1;
    select.value = name;
  }
  private noSuchStore(name: string): void {
    // The place in the link belongs to the missing store.
    this.link = new URLSearchParams();
    element('notice').textContent = `Store “${name}” not found; this is “${this.store}”.`;
    element('notice').hidden = false;
    setTimeout(() => element('notice').hidden = true, 10_000);
  }
  private send(message: ToWorker): void {
    this.worker?.postMessage(message);
  }
  private receive(message: FromWorker, first: boolean): void {
    switch (message.type) {
      case 'chosen':
        this.list(message.stores, message.name);
        break;
      case 'progress':
        element('progress-text').textContent = `Loading, ${readable(message.bytes)}`;
        break;
      case 'opened': {
        const again = this.manifest !== null;  // the same scan in another form
        this.manifest = message.manifest;
        this.box = message.scene.box;
        this.kind = message.scene.kind;
        this.heightUnit = message.heightUnit;
        this.scan = this.camera.body = message.scene.scan;
        this.colours = message.scene.colours;
        element<HTMLInputElement>('level').max = String(message.manifest.levels.length - 1);
        element('with-level').hidden = message.manifest.levels.length < 2;
        this.setSize(this.size);
        if (this.level !== 255) this.level = Math.min(this.level, message.manifest.levels.length - 1);
        this.renderer.show(this.box, message.manifest.levels.length - 1, this.kind, this.scan);
        if (!again) {
          // Most scans have Y upward; objects that are tallest along Z have Z upward.
          const [x, y, z] = [0, 1, 2].map(i => this.box[i + 3] - this.box[i]);
          if (!first || !this.link.has('u')) this.camera.yUp = z <= 1.2 * Math.max(x, y);
          this.fit();
        }
        if (first && !again) this.applyLink();
        element('with-wire').hidden = this.kind === 'points';
        element('with-size').hidden = this.kind !== 'points';
        element('as').hidden = element('upright').hidden = !this.scan;
        element('keys').textContent = touch ?
            `Drag to ${this.scan ? 'turn; with two fingers move and zoom' : 'move; with two fingers zoom, turn and tilt'}; tap for a point.` :
            `Drag to ${this.scan ? 'turn' : 'move'}, right-drag or Ctrl-drag to ${this.scan ? 'move' : 'turn'}, wheel to zoom, click for a point.`;
        element('keyboard').hidden = touch;
        if (!this.offers(this.look.colour) || (!again && (this.colours.rgb || this.scan) && !this.link.has('c'))) {
          this.look.colour = this.colours.rgb ? 'rgb' : this.kind === 'surface' ? 'grey' : 'height';
        }
        for (const colour of COLOURS) element(`by-${colour}`).hidden = !this.offers(colour);
        this.showControls();
        this.sendView();
        break;
      }
      case 'frame': {
        // The worker's clock has a different origin; slides start now.
        const shift = this.now - message.time;
        if (this.kind !== 'points' && message.changes.vertexBlocks.length > 0) this.shift(message.changes.vertices, message.time, shift);
        this.renderer.apply(message.state, message.changes, this.now);
        this.status = message;
        if (this.hit && message.changes.vertexBlocks.length > 0) this.askOutline(400);
        element('progress').hidden = true;
        requestAnimationFrame(showPanels);
        this.redraw = true;
        this.worker?.postMessage({type: 'drawn', buffer: message.changes.buffer} satisfies ToWorker, [message.changes.buffer]);
        break;
      }
      case 'picked':
        this.picks.get(message.id)?.(message.hit);
        this.picks.delete(message.id);
        break;
      case 'probed': {
        const place = this.probes.get(message.id), found = message.found;
        this.probes.delete(message.id);
        if (!place) break;
        place.state = found ? 'known' : 'none';
        if (found) Object.assign(place, {stored: found.stored, place: found.place, of: found.level, attributes: found.attributes});
        this.describePlace();
        if (this.kind === 'surface') this.askProfile();
        break;
      }
      case 'profiled':
        if (message.id === this.profile) this.showProfile(message.profile);
        break;
      case 'classes':
        this.colours.classes = message.classes;
        this.legend();
        break;
      case 'outlined':
        this.renderer.outline(this.hit ? message.lines : new Uint32Array());
        this.redraw = true;
        break;
      case 'hashed':
        this.hashes.get(message.id)?.(message.hash);
        this.hashes.delete(message.id);
        break;
      case 'failed':
        fail(message.message);
        break;
    }
  }
  /// Converts the vertices' start times of a frame from the worker's clock to the page's.
  private shift(vertices: Uint8Array, time: number, by: number): void {
    const floats = new Float32Array(vertices.buffer, vertices.byteOffset, vertices.byteLength / 4);
    const exact = Math.fround(time), to = Math.fround(time + by), words = VERTEX_BYTES[this.kind] / 4;
    for (let i = words - 1; i < floats.length; i += words) {
      if (floats[i] === exact) {
        floats[i] = to;
      } else if (floats[i] > 0) {
        floats[i] += by;
      }
    }
  }
  private pick(x: number, y: number, pixels: number): Promise<Hit|null> {
    const ray = this.camera.ray(x, y, this.aspect);
    return this.pickRay(this.camera.eye, ray, pixels * Math.tan(FOV / 2 * Math.PI / 180) * 2 / this.canvas.clientHeight);
  }
  private pickRay(origin: Vec3, direction: Vec3, angle: number): Promise<Hit|null> {
    return new Promise(resolve => {
      const id = ++this.next;
      this.picks.set(id, resolve);
      this.send({type: 'pick', id, origin, direction, angle});
    });
  }

  // ---- The picture -----------------------------------------------------------------------------

  private get now(): number {
    return performance.now() / 1000;
  }
  private get aspect(): number {
    return Math.max(1e-3, this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight));
  }
  private tick(): void {
    requestAnimationFrame(() => this.tick());
    if (this.renderer.resize()) {
      if (this.fitted) this.fit();
      this.moved = true;
    }
    if (this.moved) {
      this.moved = false;
      this.redraw = true;
      this.sendView();
    }
    const time = this.now;
    if (!this.redraw && !this.renderer.sliding(time)) return;
    if (!this.status && this.lastDrawn > 0) return;  // nothing has changed
    this.redraw = false;
    this.renderer.draw(this.camera, this.look, time);
    // Do not count a pause as a frame.
    if (time - this.lastDrawn < 0.5) this.frameTime = 0.9 * this.frameTime + 100 * (time - this.lastDrawn);
    this.lastDrawn = time;
    this.showMark();
    this.showStatus();
  }
  private sendView(): void {
    if (!this.manifest) return;
    this.send({
      type: 'view',
      serial: ++this.serial,
      camera: {
        eye: this.camera.eye,
        direction: this.camera.direction,
        up: this.camera.up,
        fov: FOV,
        aspect: this.aspect,
        height: this.canvas.clientHeight,
        error: this.error,
        level: this.level
      }
    });
    clearTimeout(this.linkTimer);
    this.linkTimer = window.setTimeout(() => this.writeLink(), 300);
  }
  private showStatus(): void {
    const s = this.status;
    if (!s) return;
    const what = this.manifest?.parameters.find(({name}) => name === 'entities')?.value.replace(/s$/, '');
    const parts = what ? [...counted(s.state.points, what), ', the first corner of each'] : counted(s.state.points, 'point');
    if (this.kind !== 'points') parts.push(' · ', ...counted(s.state.triangles, 'triangle'));
    parts.push(' · ', bold(readable(s.stats.bytes)));
    parts.push(make('span', 'wide', ' · ', ...counted(s.stats.requests, 'request'), ' · ', bold(this.frameTime.toFixed(0)), ' ms a frame'));
    const [brief, whole] = !s.state.settled ? ['refining', ''] : s.state.worst > 1 ? ['full', 'as fine as memory allows'] : ['done', 'detail as requested'];
    parts.push(' · ', ...(whole ? [make('span', 'wide', whole), make('span', 'brief', brief)] : [brief]));
    element('status').replaceChildren(...parts);
  }
  /// Returns whether the store can be coloured by it.
  private offers(colour: Colour): boolean {
    const {rgb, intensity, classes} = this.colours;
    const raster = this.kind === 'raster', grey = this.kind === 'surface';
    return {height: true, slope: raster, level: true, rgb, class: classes.length > 0, intensity, grey}[colour];
  }
  private legend(): void {
    if (!this.manifest) return;
    const colour = this.look.colour;
    const ramps: Partial<Record<Colour, Stop[]>> =
        {height: this.scan ? heightStops(0, 1) : heightStops(this.box[2], this.box[5]), slope: SLOPE, level: LEVELS, intensity: GREYS};
    const ramp = ramps[colour];
    element('legend').hidden = !ramp;
    element('classes').hidden = colour !== 'class';
    element('classes').replaceChildren(...this.colours.classes.map(group => {
      const swatch = make('i', '');
      swatch.style.background = `rgb(${classColour(group).join(' ')})`;
      return make('li', '', swatch, `${group} ${CLASSES[group] ?? ''}`);
    }));
    if (!ramp) return;
    const texts: Partial<Record<Colour, [string, string]>> = {
      height: this.scan ? ['low', 'high'] : [this.height(this.box[2]), this.height(this.box[5])],
      slope: ['0°', '60°'],
      level: ['coarse', 'fine'],
      intensity: ['weak', 'strong']
    };
    [element('legend-low').textContent, element('legend-high').textContent] = texts[colour]!;
    element('legend-ramp').style.background = gradient(ramp);
  }

  // ---- A place ---------------------------------------------------------------------------------

  /// The picture is coarser than the store, so the height of a raster's place, or the point nearest to a scan's place, is
  /// read from the store. Neither is shown before the answer.
  private showPlace(hit: Hit|null): void {
    this.before = this.hit;
    if (!hit || !this.manifest) return this.closePlace();
    this.hit = {...hit, state: this.kind === 'points' ? 'known' : 'pending', of: 0};
    if (this.hit.state === 'pending') {
      const id = ++this.next;
      this.probes.set(id, this.hit);
      this.send({type: 'probe', id, stored: hit.stored, reach: hit.reach});
    }
    element('place').hidden = false;
    element('profile').hidden = true;
    this.describePlace();
    this.askOutline(0);
    this.askProfile();
  }
  private describePlace(): void {
    const {hit, before, manifest} = this;
    if (!hit || !manifest) return;
    const crs = manifest.crs, known = hit.state === 'known', waits = hit.state === 'none' ? 'no data' : 'reading';
    const about = hit.of > 0 ? 'about ' : '';
    const world = worldPoint(manifest, hit.stored);
    const place = (n: number) => crs.geographic ? n.toFixed(6) : this.plain(n, 2);
    const rows: Array<[string, string]> =
        this.scan ? world.map((c, i): [string, string] => ['XYZ'[i], known ? `${about}${this.plain(c)}` : waits]) : [
          [crs.geographic ? 'Longitude' : 'East', place(world[0])],
          [crs.geographic ? 'Latitude' : 'North', place(world[1])],
          ['Height', known ? `${about}${this.plain(world[2], 2)}${this.unit}` : waits]
        ];
    // In the command's notation: --cluster L:N.
    rows.push(['Level', `${hit.level}`], ['Cluster', `${hit.clusterLevel}:${hit.clusterOrdinal}`]);
    if (crs.epsg) rows.push(['CRS', `EPSG:${crs.epsg}`]);
    manifest.attributes.forEach((channel, i) => {
      if (!known || i >= hit.attributes.length) return;
      const value = hit.attributes[i] * channel.scale + channel.offset;
      const named = channel.name === 'classification' && CLASSES[value] ? ` ${CLASSES[value]}` : '';
      rows.push([channel.name.replaceAll('_', ' '), `${Number(value.toPrecision(channel.type === 'float32' ? 7 : 12))}${named}`]);
    });
    if (before && before.state !== 'pending' && hit.state !== 'pending') {
      const way = add(hit.place as Vec3, before.place as Vec3, -1), both = known && before.state === 'known';
      const over = lengthOnEarth(manifest, worldPoint(manifest, before.stored), world) ?? Math.hypot(way[0], way[1]);
      const rise = both ? `, ${way[2] < 0 ? '−' : '+'}${this.height(Math.abs(way[2]))}` : '';
      rows.push(['From the last', this.scan ? this.plain(length(way)) : this.ground(over) + rise]);
    }
    element('place-text').replaceChildren(...rows.flatMap(([name, value]) => [make('dt', '', name), make('dd', '', value)]));
    this.redraw = true;
  }
  /// Formats a number to a hundred-thousandth of the store's size, with at least `least` digits.
  private plain(n: number, least = 0): string {
    const size = Math.max(...[0, 1, 2].map(i => this.box[i + 3] - this.box[i]));
    return n.toFixed(Math.min(12, Math.max(least, 5 - Math.floor(Math.log10(size || 1)))));
  }
  /// Sets the point size; 0 selects one that suits the store. A few small points would be hard to see.
  private setSize(size: number): void {
    this.size = size;
    this.look.pointSize = size || ((this.manifest?.points ?? 0) < 1000 ? 6 : 2.5);
  }
  /// The unit of heights, if known.
  private get unit(): string {
    const unit = this.manifest?.coordinates[2].unit || this.manifest?.crs.vertical_unit;
    return unit ? ` ${UNITS[unit] ?? unit}` : '';
  }
  /// Formats a height of the view frame, or a difference of two, in the store's unit.
  private height(metres: number): string {
    return `${rounded(metres / this.heightUnit)}${this.unit}`;
  }
  /// Formats a distance over ground.
  private ground(n: number): string {
    return this.manifest?.crs.horizontal_unit ? metres(n) : rounded(n);
  }
  private closePlace(): void {
    this.hit = this.before = null;
    this.probes.clear();
    this.profile = 0;
    element('place').hidden = true;
    this.renderer.outline(new Uint32Array());
    this.redraw = true;
  }
  /// Requests the outline of the cluster after `delay` milliseconds, when the surface has changed.
  private askOutline(delay: number): void {
    if (this.outlineTimer !== 0 && delay > 0) return;
    clearTimeout(this.outlineTimer);
    this.outlineTimer = window.setTimeout(() => {
      this.outlineTimer = 0;
      if (this.hit) this.send({type: 'outline', level: this.hit.clusterLevel, ordinal: this.hit.clusterOrdinal});
    }, delay);
  }
  /// Requests the profile of the store between the places, which does not depend on the picture.
  private askProfile(): void {
    const {hit, before} = this;
    if (!hit || !before || (this.kind === 'surface' && !(hit.state === 'known' && before.state === 'known'))) return;
    this.profile = ++this.next;
    this.send({type: 'profile', id: this.profile, from: before.stored, to: hit.stored, axis: this.scan && this.camera.yUp ? 1 : 2});
  }
  private showProfile(profile: Profile): void {
    const {hit, before, manifest} = this;
    const heights = profile.points.map(point => point[1]).filter(h => !Number.isNaN(h));
    element('profile').hidden = heights.length < 2 || !before;
    if (heights.length < 2 || !hit || !before || !manifest) return;
    const low = heights.reduce((a, b) => Math.min(a, b)), high = heights.reduce((a, b) => Math.max(a, b)), rise = high - low || 1;
    const at = ([t, h]: [number, number]) => `${(256 * t).toFixed(2)},${(80 - 76 * (h - low) / rise).toFixed(2)}`;
    // Fill the ground down to the bottom, in parts between voids; or plot the points.
    let path = '', part: Array<[number, number]> = [];
    const close = () => {
      if (part.length > 1) path += `M${(256 * part[0][0]).toFixed(2)},84 L${part.map(at).join(' ')} L${(256 * part[part.length - 1][0]).toFixed(2)},84 Z`;
      part = [];
    };
    for (const point of profile.points) {
      if (this.kind !== 'raster') {
        path += `M${at(point)}h0`;
      } else if (Number.isNaN(point[1])) {
        close();
      } else {
        part.push(point);
      }
    }
    close();
    const shape = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    shape.setAttribute('class', this.kind === 'raster' ? 'raster' : 'points');
    shape.setAttribute('d', path);
    element('profile-plot').replaceChildren(shape);
    // Enough digits to distinguish the lowest from the highest.
    const digits = Math.min(12, Math.max(0, 2 - Math.floor(Math.log10(rise))));
    const about = profile.level > 0 || profile.sampled ? 'about ' : '';
    const label = (h: number) => `${about}${this.scan ? h.toFixed(digits) : `${rounded(h)}${this.unit}`}`;
    const metres = lengthOnEarth(manifest, worldPoint(manifest, before.stored), worldPoint(manifest, hit.stored)) ?? profile.metres;
    element('profile-low').textContent = `${label(low)} lowest`;
    element('profile-length').textContent = this.scan ? `${Number(metres.toPrecision(4))}` : this.ground(metres);
    element('profile-high').textContent = `${label(high)} highest`;
  }
  private showMark(): void {
    this.showMarkAt('mark', this.hit);
    this.showMarkAt('mark-before', this.hit ? this.before : null);
  }
  private showMarkAt(id: string, hit: Hit|null): void {
    const mark = element(id);
    if (!hit) {
      mark.hidden = true;
      return;
    }
    const to = add(hit.place as Vec3, this.camera.eye, -1);
    const t = Math.tan(FOV / 2 * Math.PI / 180);
    const part = (axis: Vec3) => to[0] * axis[0] + to[1] * axis[1] + to[2] * axis[2];
    const depth = part(this.camera.direction);
    mark.hidden = depth <= 0;
    mark.style.left = `${(1 + part(this.camera.right) / depth / t / this.aspect) / 2 * this.canvas.clientWidth}px`;
    mark.style.top = `${(1 - part(this.camera.up) / depth / t) / 2 * this.canvas.clientHeight}px`;
  }

  // ---- The link --------------------------------------------------------------------------------

  private link = new URLSearchParams();
  private readLink(): void {
    this.link = new URLSearchParams(location.hash.slice(1));
    const colour = this.link.get('c');
    if (COLOURS.includes(colour as Colour)) this.look.colour = colour as Colour;
    this.look.wire = this.link.get('w') === '1';
    this.asPoints = this.link.get('p') === '1';
    this.camera.yUp = this.link.get('u') !== 'z';
    const level = this.link.get('l');
    this.level = level !== null && /^\d{1,2}$/.test(level) ? Number(level) : 255;
    const error = Number(this.link.get('q'));
    if (error >= 0.5 && error <= 32) this.error = error;
    const size = Number(this.link.get('r'));
    this.setSize(size >= 1 && size <= 8 ? size : 0);
  }
  private applyLink(): void {
    const numbers = (this.link.get('v') ?? '').split(',').map(Number);
    if (numbers.length !== 6 || !numbers.every(Number.isFinite) || numbers[5] <= 0) return;
    // From farther away nothing would be visible.
    const {least, most} = this.camera, middle = [0, 1, 2].map(i => (this.box[i] + this.box[i + 3]) / 2);
    if (Math.hypot(...middle.map((c, i) => numbers[i] - c)) > most) return;
    this.camera.target = [numbers[0], numbers[1], numbers[2]];
    this.camera.azimuth = numbers[3];
    this.camera.tilt = this.camera.within(numbers[4]);
    this.camera.distance = Math.min(most, Math.max(least, numbers[5]));
    this.fitted = false;
  }
  private writeLink(): void {
    const c = this.camera;
    const view = [...c.target.map(n => this.plain(n, this.scan ? 0 : 2)), c.azimuth.toFixed(2), c.tilt.toFixed(2), c.distance.toPrecision(6)];
    const parts = [`s=${encodeURIComponent(this.store)}`, `v=${view.join(',')}`, `c=${this.look.colour}`, `q=${this.error}`];
    if (this.look.wire) parts.push('w=1');
    if (this.size > 0) parts.push(`r=${this.size}`);
    if (this.scan && this.asPoints) parts.push('p=1');
    if (this.scan) parts.push(`u=${c.yUp ? 'y' : 'z'}`);
    if (this.level !== 255) parts.push(`l=${this.level}`);
    history.replaceState(null, '', `#${parts.join('&')}`);
  }

  // ---- What the user does ----------------------------------------------------------------------

  private setDark(dark: boolean): void {
    this.look.dark = dark;
    document.documentElement.classList.toggle('dark', dark);
    element('theme').textContent = dark ? 'Light' : 'Dark';
    this.redraw = true;
  }
  private showControls(): void {
    for (const input of document.querySelectorAll<HTMLInputElement>('input[name=colour]')) {
      input.checked = input.value === this.look.colour;
    }
    element<HTMLInputElement>('wire').checked = this.look.wire;
    element<HTMLInputElement>(this.asPoints ? 'as-points' : 'as-surface').checked = true;
    element<HTMLInputElement>(this.camera.yUp ? 'up-y' : 'up-z').checked = true;
    element<HTMLInputElement>('size').value = String(this.look.pointSize);
    element<HTMLInputElement>('detail').value = String(4 - Math.log2(this.error));
    element('detail-text').textContent = `within ${this.error} px`;
    const top = (this.manifest?.levels.length ?? 1) - 1;
    element<HTMLInputElement>('level').value = String(this.level > top ? 0 : top - this.level);
    element('level-text').textContent = this.level >= top ? 'the top' : `level ${this.level}`;
    this.legend();
  }
  private change(zoomed = false): void {
    this.moved = true;
    this.fitted = false;
    // Orbit the middle of a body until the user zooms in.
    if (this.scan && !zoomed) return;
    this.pivoting = true;
    clearTimeout(this.pivotTimer);
    this.pivotTimer = window.setTimeout(() => void this.orbitVisiblePlace(), 250);
  }
  /// Once the camera rests, makes it orbit the ground in the middle of the picture.
  private async orbitVisiblePlace(): Promise<void> {
    const timer = this.pivotTimer;
    const eye = this.camera.eye, direction = this.camera.direction;
    const hit = await this.pickRay(eye, direction, 0.02);
    if (timer !== this.pivotTimer) return;
    if (hit && length(add(this.camera.eye, eye, -1)) === 0) this.camera.retarget(length(add(hit.place as Vec3, eye, -1)));
    this.pivoting = false;
    this.writeLink();
  }
  private at(event: {clientX: number, clientY: number}): [number, number] {
    return [2 * event.clientX / this.canvas.clientWidth - 1, 1 - 2 * event.clientY / this.canvas.clientHeight];
  }
  private bind(): void {
    this.showControls();
    const canvas = this.canvas;
    const pointers = new Map<number, {x: number, y: number}>();
    let travelled = 0, turning = false;
    canvas.addEventListener('contextmenu', event => event.preventDefault());
    canvas.addEventListener('pointerdown', event => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
      turning = (event.button === 2 || event.button === 1 || event.ctrlKey || event.shiftKey) !== this.scan;
      travelled = pointers.size > 1 ? 1e9 : 0;
    });
    canvas.addEventListener('pointermove', event => {
      this.pointer = this.at(event);
      const last = pointers.get(event.pointerId);
      if (!last) return;
      const dx = event.clientX - last.x, dy = event.clientY - last.y;
      travelled += Math.abs(dx) + Math.abs(dy);
      if (pointers.size === 2) {
        const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)![1];
        const before = Math.hypot(last.x - other.x, last.y - other.y);
        const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
        const turn = Math.atan2(event.clientY - other.y, event.clientX - other.x) - Math.atan2(last.y - other.y, last.x - other.x);
        const middle = {clientX: (event.clientX + other.x) / 2, clientY: (event.clientY + other.y) / 2};
        this.camera.zoom(before / Math.max(after, 1), ...this.at(middle), this.aspect);
        const degrees = (turn * 180 / Math.PI + 540) % 360 - 180;
        if (this.scan) {
          this.camera.pan(dx / 2, dy / 2, canvas.clientHeight);
        } else {
          this.camera.orbit(-degrees, 0);
          this.camera.pan(dx / 2, 0, canvas.clientHeight);
          this.camera.orbit(0, dy * 0.08);
        }
      } else if (turning && travelled > 4) {
        this.camera.orbit(dx * 0.3, dy * 0.25);
      } else if (travelled > 4) {
        this.camera.pan(dx, dy, canvas.clientHeight);
      }
      last.x = event.clientX;
      last.y = event.clientY;
      if (travelled > 4) this.change(pointers.size === 2);
    });
    const up = (event: PointerEvent) => {
      pointers.delete(event.pointerId);
      if (event.type === 'pointerup' && travelled <= 4 && pointers.size === 0 && turning === this.scan && this.manifest) {
        void this.pick(...this.at(event), 12).then(hit => this.showPlace(hit));
      }
    };
    canvas.addEventListener('pointerup', up);
    canvas.addEventListener('pointerleave', () => this.pointer = [0, 0]);
    canvas.addEventListener('pointercancel', up);
    canvas.addEventListener('wheel', event => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.camera.zoom(Math.exp(Math.max(-240, Math.min(240, event.deltaY * lines)) * 0.0016), ...this.at(event), this.aspect);
      this.change(true);
    }, {passive: false});
    canvas.addEventListener('dblclick', event => {
      this.camera.zoom(0.5, ...this.at(event), this.aspect);
      this.change(true);
    });
    canvas.addEventListener('keydown', event => this.key(event));

    for (const input of document.querySelectorAll<HTMLInputElement>('input[name=colour]')) {
      input.addEventListener('change', () => {
        this.look.colour = input.value as Colour;
        this.changeLook();
      });
    }
    element('wire').addEventListener('change', event => {
      this.look.wire = (event.target as HTMLInputElement).checked;
      this.changeLook();
    });
    for (const points of [false, true]) {
      element(points ? 'as-points' : 'as-surface').addEventListener('change', () => {
        this.asPoints = points;
        this.closePlace();
        this.status = null;
        this.lastDrawn = 0;
        this.send({type: 'show', asPoints: points});
        this.writeLink();
      });
    }
    for (const yUp of [false, true]) {
      element(yUp ? 'up-y' : 'up-z').addEventListener('change', () => {
        this.camera.yUp = yUp;
        this.fit();
        this.askProfile();
        this.legend();
      });
    }
    element('detail').addEventListener('input', event => {
      this.error = Math.round(100 * 2 ** (4 - Number((event.target as HTMLInputElement).value))) / 100;
      this.showControls();
      this.moved = true;
    });
    element('level').addEventListener('input', event => {
      const top = (this.manifest?.levels.length ?? 1) - 1, value = Number((event.target as HTMLInputElement).value);
      this.level = value === 0 ? 255 : top - value;
      this.showControls();
      this.moved = true;
    });
    element('size').addEventListener('input', event => {
      this.setSize(Number((event.target as HTMLInputElement).value));
      this.changeLook();
    });
    element('store').addEventListener('change', event => {
      const {value} = event.target as HTMLSelectElement;
      // The browser's Back returns to the previous store.
      this.writeLink();
      history.pushState(null, '', `#s=${encodeURIComponent(value)}`);
      this.open(value, false);
    });
    element('fit').addEventListener('click', () => this.fit());
    element('theme').addEventListener('click', () => this.setDark(!this.look.dark));
    element('link').addEventListener('click', () => {
      this.writeLink();
      void navigator.clipboard?.writeText(location.href);
      element('link').textContent = 'Copied';
      setTimeout(() => element('link').textContent = 'Copy link', 1500);
    });
    element('menu').addEventListener('click', () => {
      const open = element('tools').classList.toggle('open');
      element('menu').setAttribute('aria-expanded', String(open));
    });
    element('place-close').addEventListener('click', () => this.closePlace());
    element('expand').addEventListener('click', () => this.send({type: 'pin', pin: 1}));
    element('collapse').addEventListener('click', () => this.send({type: 'pin', pin: 0}));
    element('release').addEventListener('click', () => this.send({type: 'pin', pin: -1}));
    element('retry').addEventListener('click', () => {
      if (this.lost) location.reload();
      element('message').hidden = true;
      if (this.manifest) {
        this.send({type: 'retry'});
      } else {
        this.open(this.stores.length === 0 ? this.link.get('s') ?? '' : this.store, true);
      }
    });
    addEventListener('hashchange', () => {
      this.readLink();
      this.showControls();
      const wanted = this.link.get('s');
      if (wanted !== null && wanted !== this.store && this.stores.some(store => store.name === wanted)) {
        this.open(wanted, true);
      } else if (wanted !== null && wanted !== this.store) {
        this.noSuchStore(wanted);
        this.writeLink();
      } else {
        this.applyLink();
        this.moved = true;
      }
    });
    canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      this.lost = true;
      if (this.manifest) this.writeLink();
      fail('The graphics driver failed; it may be short of memory.');
    });
    // Reloading restores the view from the link.
    canvas.addEventListener('webglcontextrestored', () => location.reload());
  }
  private changeLook(): void {
    this.redraw = true;
    this.legend();
    this.writeLink();
  }
  private fit(): void {
    if (!this.manifest) return;
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const across = (pixels: number) => 2 * pixels / width, down = (pixels: number) => 2 * pixels / height;
    // The area between the panels.
    const narrow = phone.matches, edge = across(narrow ? 16 : 24), tools = narrow || width < 900 ? 0 : across(256);
    this.camera.fit(
        this.box, this.aspect, -1 + edge, 1 - Math.max(edge, tools), -1 + down(52), 1 - down(narrow ? 72 : 24));
    this.fitted = this.moved = true;
  }
  /// Expands or collapses the cluster under the pointer.
  private async pinPointed(pin: number): Promise<void> {
    this.showPlace(await this.pick(...this.pointer, 12));
    if (this.hit) this.send({type: 'pin', pin});
  }
  private key(event: KeyboardEvent): void {
    const step = event.shiftKey ? 180 : 60;
    const height = this.canvas.clientHeight;
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.camera.pan(step, 0, height),
      ArrowRight: () => this.camera.pan(-step, 0, height),
      ArrowUp: () => this.camera.pan(0, step, height),
      ArrowDown: () => this.camera.pan(0, -step, height),
      '+': () => this.camera.zoom(0.8, 0, 0, this.aspect),
      '=': () => this.camera.zoom(0.8, 0, 0, this.aspect),
      '-': () => this.camera.zoom(1.25, 0, 0, this.aspect),
      q: () => this.camera.orbit(-6, 0),
      e: () => this.camera.orbit(6, 0),
      r: () => this.camera.orbit(0, 4),
      f: () => this.camera.orbit(0, -4),
      x: () => void this.pinPointed(1),
      c: () => void this.pinPointed(0),
      v: () => this.send({type: 'pin', pin: -1}),
      Home: () => this.fit(),
      Escape: () => this.closePlace(),
      Enter: () => void this.pick(0, 0, 12).then(hit => this.showPlace(hit))
    };
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    act();
    if (!['x', 'c', 'v', 'enter', 'escape'].includes(event.key.toLowerCase())) this.change('+=-'.includes(event.key));
  }
}

// The worker fetches while WebGL starts, which is slow and blocks the page, so start the worker first.
function start(): void {
  const link = new URLSearchParams(location.hash.slice(1));
  const first = launch(link.get('s') ?? '', true, link.get('p') === '1');
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
