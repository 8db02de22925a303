// SPDX-License-Identifier: GPL-3.0-or-later
/// The map's tools: scale bar, north arrow, coordinates under the pointer, and going to a place.

import {add, length, type Vec3} from './camera';
import type {Connection} from './connection';
import {lonLat} from './lonlat';
import {element, notice} from './page';
import type {Places} from './place';
import type {Scene} from './scene';
import {inDegrees, worldPoint} from './store';

/// Longest scale bar, in pixels.
const LONGEST = 110;
/// Metres per pixel of a web map at the equator at zoom level 0.
const ZOOM_0 = 156543.034;

export class MapTools {
  private hovering = false;
  private at: {clientX: number, clientY: number}|null = null;  ///< the pointer, until it is looked up

  /// `change` is called after the camera has been moved.
  constructor(
      private readonly scene: Scene, private readonly worker: Connection, private readonly places: Places,
      private readonly change: () => void) {
    element('north').addEventListener('click', () => {
      scene.camera.azimuth = 0;
      change();
    });
    scene.canvas.addEventListener('pointermove', event => {
      if (event.pointerType !== 'mouse' || event.buttons !== 0) return;
      this.at = event;
      void this.hover();
    });
    scene.canvas.addEventListener('pointerleave', () => {
      this.at = null;
      element('coordinates').textContent = '';
    });
    element('go').addEventListener('submit', event => {
      event.preventDefault();
      void this.goToText(element<HTMLInputElement>('go-place').value);
    });
  }

  opened(): void {
    const {scan, manifest} = this.scene;
    element('north').hidden = element('go').hidden = scan;
    element('coordinates').textContent = '';
    element<HTMLInputElement>('go-place').placeholder = lonLat(manifest!) ? 'longitude, latitude' : 'east, north';
  }
  /// Shows scale and north as in the picture.
  show(): void {
    const {scene} = this;
    // In the middle of the picture, across it.
    const pixel = scene.metresPerPixel(scene.camera.distance), longest = LONGEST * pixel, power = 10 ** Math.floor(Math.log10(longest));
    const shown = power * [5, 2, 1].find(factor => factor * power <= longest)!;
    element('scale-bar').style.width = `${shown / pixel}px`;
    element('scale-text').textContent = shown >= 1000 && scene.manifest?.crs.horizontal_unit ? `${shown / 1000} km` :
        `${Number(shown.toPrecision(1))}${scene.manifest?.crs.horizontal_unit ? ' m' : ''}`;
    element('north-arrow').style.transform = `rotate(${-scene.camera.azimuth}deg)`;
  }

  /// Goes to a longitude and latitude at the zoom level of web maps.
  async goTo(longitude: number, latitude: number, zoom: number): Promise<void> {
    const {scene} = this, conversion = lonLat(scene.manifest!), {crs} = scene.manifest!;
    const distance = ZOOM_0 * Math.cos(latitude * Math.PI / 180) / 2 ** zoom / scene.metresPerPixel(1);
    if (!conversion) {
      const name = crs.epsg ? `, EPSG:${crs.epsg}` : '';
      return notice(`Longitudes and latitudes cannot be converted to the CRS of this store${name}.`);
    }
    await this.go(scene.within(conversion.from([longitude, latitude])), distance);
  }
  /// Goes to a place that the user has entered: longitude and latitude, or coordinates of the store.
  private async goToText(text: string): Promise<void> {
    const {scene} = this, {manifest} = scene;
    const match = /^\s*([-−]?\d+(?:\.\d+)?)\s*°?\s*([NSEW])?[\s,;]+([-−]?\d+(?:\.\d+)?)\s*°?\s*([NSEW])?\s*$/i.exec(text);
    if (!manifest) return;
    if (!match) return notice('Enter two numbers, such as 8.25, 46.5 or 46.5 N 8.25 E.', 6);
    const numbers = [match[1], match[3]].map(number => Number(number.replace('−', '-')));
    const letters = [match[2], match[4]].map(letter => (letter ?? '').toUpperCase());
    const signed = numbers.map((number, i) => 'SW'.includes(letters[i] || '-') ? -number : number);
    const turned = 'NS'.includes(letters[0] || '-') ? [signed[1], signed[0]] : signed;
    const conversion = lonLat(manifest), lettered = letters.some(letter => letter !== '');
    if (lettered && !conversion) {
      return notice('Longitudes and latitudes cannot be converted to the CRS of this store; enter its coordinates.', 6);
    }
    await this.go((lettered ? null : scene.within(turned)) ?? (conversion && scene.within(conversion.from(turned))), 0);
  }
  /// Moves the camera to stored coordinates; distance 0 keeps that of the camera.
  private async go(stored: [number, number]|null, distance: number): Promise<void> {
    const {scene, worker} = this, {camera, box} = scene;
    if (!stored) return notice('That place is outside the store.', 6);
    scene.pivoting = true;
    const place = scene.place([...stored, 0]) as Vec3;
    place[2] = (box[2] + box[5]) / 2;
    // A raster's height is read from the store, that of points from the picture.
    const height = scene.kind === 'raster' ? (await worker.probe([...stored, 0], 0))?.stored[2] : undefined;
    if (height !== undefined) {
      place[2] = scene.place([...stored, height])[2];
    } else if (scene.kind !== 'raster') {
      const above: Vec3 = [place[0], place[1], box[5] + 2 * length([box[3] - box[0], box[4] - box[1], box[5] - box[2]])];
      place[2] = (await worker.pick(above, [0, 0, -1], 0.01))?.place[2] ?? place[2];
    }
    camera.target = place;
    if (distance > 0) camera.distance = distance;
    camera.distance = Math.min(camera.most, Math.max(camera.least, camera.distance));
    this.change();
    this.places.close();
  }
  /// Shows the coordinates under the pointer, of the surface as drawn, to the precision of a pixel.
  private async hover(): Promise<void> {
    const {scene} = this;
    if (this.hovering || !scene.manifest || !scene.status) return;
    this.hovering = true;
    while (this.at && scene.manifest) {
      const event = this.at, began = performance.now();
      this.at = null;
      const hit = await this.places.pick(...scene.at(event), 12), {manifest} = scene;
      element('coordinates').textContent = hit && manifest ? this.describe(hit.place, hit.stored) : '';
      // Looking up takes the worker's time, so most of it is left to other work.
      await new Promise(resolve => setTimeout(resolve, Math.max(30, 3 * (performance.now() - began))));
    }
    this.hovering = false;
  }
  private describe(place: number[], stored: number[]): string {
    const {scene} = this, manifest = scene.manifest!, world = worldPoint(manifest, stored);
    const pixel = scene.metresPerPixel(length(add(place as Vec3, scene.camera.eye, -1)));
    const text = (numbers: number[], metres: number) =>
        numbers.map(n => n.toFixed(Math.min(9, Math.max(0, Math.ceil(-Math.log10(pixel / metres))))));
    const degrees = (numbers: number[]) => text(numbers, 111_000).map(n => `${n}°`).join(', ');
    if (scene.scan) return text(world, 1).join(', ');
    if (inDegrees(manifest)) return degrees(world.slice(0, 2));
    const conversion = lonLat(manifest), local = text(world.slice(0, 2), 1).join(', ');
    return conversion ? `${local} · ${degrees(conversion.to(world))}` : local;
  }
}
