// SPDX-License-Identifier: GPL-3.0-or-later
/// What is shown: the open store, the camera, and the settings.

import {add, dot, FOV, OrbitCamera, type Vec3} from './camera';
import type {Camera, Kind, Opened} from './core';
import type {FromWorker} from './messages';
import {phone} from './page';
import {LIGHT} from './ramps';
import {type Colour, FOLLOW, type Look} from './render';
import {type Manifest, storedPoint} from './store';
import {metres, rounded, UNITS} from './text';

export class Scene {
  readonly camera = new OrbitCamera();
  readonly look: Look = {
    colour: 'height',
    wire: false,
    dark: false,
    pointSize: 2.5,
    fillGaps: true,
    depthShading: false,
    hidden: new Set(),
    light: [FOLLOW, LIGHT.elevation],
    exaggeration: 1,
    adaptiveSpacing: 0
  };
  store = '';
  manifest: Manifest|null = null;
  box: number[] = [];
  kind: Kind = 'raster';
  scan = false;      ///< the store is the scan of a body
  asPoints = false;  ///< show a scan as points
  heightUnit = 1;    ///< in the heights of the view frame: metres, times the exaggeration
  frame: number[] = [];    ///< the linear map from stored coordinates to the view frame
  exaggeration = 1;        ///< of heights, wanted; look.exaggeration is that of the view frame
  /// A box of the map, from west and south to east and north in the view frame, and the minimum level there.
  region: {corners: number[], level: number}|null = null;
  colours: Opened['colours'] = {rgb: false, intensity: false, classes: []};
  error = 4;            ///< tolerated, in pixels
  errorChosen = false;  ///< by the user or the link
  level = 255;          ///< minimum level everywhere; 255: none
  size = 0;             ///< point size in pixels set by the user or the link
  status: FromWorker&{type: 'frame'}|null = null;
  serial = 0;        ///< number of the last view
  redraw = true;
  moved = true;
  fitted = false;    ///< everything is visible, and stays so when the window changes
  pivoting = false;  ///< waiting for the ground in the middle of the picture

  constructor(readonly canvas: HTMLCanvasElement) {}

  /// Takes over the store that the worker has opened.
  take(message: FromWorker&{type: 'opened'}): void {
    this.manifest = message.manifest;
    this.box = message.scene.box;
    this.kind = message.scene.kind;
    this.frame = message.ground;
    this.heightUnit = message.ground[8] / message.manifest.coordinates[2].scale || 1;
    this.look.exaggeration = message.exaggeration;
    const [x, y] = [0, 1].map(i => this.box[i + 3] - this.box[i]);
    this.look.adaptiveSpacing = Math.sqrt(x * y / message.manifest.points);
    this.scan = this.camera.body = message.scene.scan;
    this.colours = message.scene.colours;
    this.setSize(this.size);
    // A raster has no more vertices than this needs.
    if (!this.errorChosen) this.error = this.kind === 'raster' ? 1 : 4;
    if (this.level !== 255) this.level = Math.min(this.level, this.top);
    if (this.scan) this.region = null;
    if (this.region) this.region.level = Math.min(this.region.level, this.top);
  }
  get top(): number {
    return (this.manifest?.levels.length ?? 1) - 1;
  }
  /// Whether the last frame is of the present view and nothing is left to do for it.
  get complete(): boolean {
    const {status} = this;
    return status !== null && !this.moved && status.serial === this.serial && !status.loading && !status.state.waiting;
  }
  get now(): number {
    return performance.now() / 1000;
  }

  // ---- The picture -----------------------------------------------------------------------------

  get aspect(): number {
    return Math.max(1e-3, this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight));
  }
  /// Returns the place of the picture; x and y are from -1 to 1, right and up.
  at(event: {clientX: number, clientY: number}): [number, number] {
    return [2 * event.clientX / this.canvas.clientWidth - 1, 1 - 2 * event.clientY / this.canvas.clientHeight];
  }
  /// Returns the pixel at which a place is seen; null if it is not in front of the eye.
  pixel(place: number[]): [number, number]|null {
    const {camera} = this, t = Math.tan(FOV / 2 * Math.PI / 180);
    const to = add(place as Vec3, camera.eye, -1), depth = dot(to, camera.direction);
    if (depth <= 0) return null;
    return [
      (1 + dot(to, camera.right) / depth / t / this.aspect) / 2 * this.canvas.clientWidth,
      (1 - dot(to, camera.up) / depth / t) / 2 * this.canvas.clientHeight
    ];
  }
  /// Returns the metres that a pixel shows at this distance from the eye.
  metresPerPixel(distance: number): number {
    return 2 * distance * Math.tan(FOV / 2 * Math.PI / 180) / this.canvas.clientHeight;
  }
  view(): Camera {
    const {eye, direction, up} = this.camera, {region} = this;
    const camera = {eye, direction, up, fov: FOV, aspect: this.aspect, height: this.canvas.clientHeight, error: this.error, level: this.level};
    if (!region) return camera;
    const [west, south, east, north] = region.corners;
    return {...camera, region: {level: region.level, box: [west, south, -1e30, east, north, 1e30]}};
  }
  /// Converts stored coordinates to the view frame.
  place(stored: number[]): number[] {
    const {frame: f, manifest} = this, {min, max} = manifest!.bounds, {offset, scale} = manifest!.coordinates[2];
    const v = [stored[0] - (min[0] + max[0]) / 2, stored[1] - (min[1] + max[1]) / 2, stored[2] + offset / scale];
    return [0, 3, 6].map(i => f[i] * v[0] + f[i + 1] * v[1] + f[i + 2] * v[2]);
  }
  /// Returns the stored coordinates of a position in the CRS if it is in the store's box, otherwise null.
  within(position: number[]): [number, number]|null {
    const {min, max} = this.manifest!.bounds, stored = storedPoint(this.manifest!, position);
    return stored.every((c, i) => c >= min[i] && c <= max[i]) ? stored : null;
  }
  /// Shows the whole store.
  fit(): void {
    if (!this.manifest) return;
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const across = (pixels: number) => 2 * pixels / width, down = (pixels: number) => 2 * pixels / height;
    // The area between the panels.
    const narrow = phone.matches, edge = across(narrow ? 16 : 24), tools = narrow || width < 900 ? 0 : across(256);
    this.camera.fit(
        this.box, this.aspect, -1 + edge, 1 - Math.max(edge, tools), -1 + down(52), 1 - down(narrow ? 72 : 24));
    this.fitted = this.moved = true;
  }

  // ---- Settings --------------------------------------------------------------------------------

  /// Returns whether the store can be coloured by it.
  offers(colour: Colour): boolean {
    const {rgb, intensity, classes} = this.colours;
    const raster = this.kind === 'raster', grey = this.kind === 'surface';
    return {height: true, slope: raster, level: true, rgb, class: classes.length > 0, intensity, grey}[colour];
  }
  /// Sets the point size; 0 selects one that suits the store. A few small points would be hard to see.
  setSize(size: number): void {
    this.size = size;
    this.look.pointSize = size || ((this.manifest?.points ?? 0) < 1000 ? 6 : 2.5);
  }

  // ---- Texts -----------------------------------------------------------------------------------

  /// Formats a number to a hundred-thousandth of the store's size, with at least `least` digits.
  plain(n: number, least = 0): string {
    const size = Math.max(...[0, 1, 2].map(i => this.box[i + 3] - this.box[i]));
    return n.toFixed(Math.min(12, Math.max(least, 5 - Math.floor(Math.log10(size || 1)))));
  }
  /// The unit of heights, if known.
  get unit(): string {
    const unit = this.manifest?.coordinates[2].unit || this.manifest?.crs.vertical_unit;
    return unit ? ` ${UNITS[unit] ?? unit}` : '';
  }
  /// Formats a height of the view frame, or a difference of two, in the store's unit.
  height(metres: number): string {
    return `${rounded(metres / this.heightUnit)}${this.unit}`;
  }
  /// Formats a distance over ground.
  ground(n: number): string {
    return this.manifest?.crs.horizontal_unit ? metres(n) : rounded(n);
  }
}
