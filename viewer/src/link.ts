// SPDX-License-Identifier: GPL-3.0-or-later
/// The link in the address, which keeps the view.

import {LIGHT} from './ramps';
import {type Colour, COLOURS, FOLLOW} from './render';
import type {Scene} from './scene';

/// The exaggeration of heights in a link, from 1 to 10.
export function exaggeration(part: string|null): number {
  const factor = Number(part);
  return factor >= 1 && factor <= 10 ? factor : 1;
}

export class Link {
  parts = new URLSearchParams();

  constructor(private readonly scene: Scene) {}

  get(name: string): string|null {
    return this.parts.get(name);
  }
  has(name: string): boolean {
    return this.parts.has(name);
  }
  /// The numbers of a part, if it has this many.
  private numbers(name: string, count: number): number[]|null {
    const numbers = (this.get(name) ?? '').split(',').map(Number);
    return numbers.length === count && numbers.every(Number.isFinite) ? numbers : null;
  }
  /// Longitude, latitude and zoom level of a link like #8.2,46.5,12 or #s=alps&at=8.2,46.5,12.
  get at(): number[]|null {
    return this.numbers('at', 3);
  }
  /// Reads the address, and the settings from it.
  read(): void {
    const {scene} = this;
    const hash = location.hash.slice(1);
    this.parts = new URLSearchParams(/^-?[\d.]+,-?[\d.]+,[\d.]+$/.test(hash) ? `at=${hash}` : hash);
    const colour = this.get('c');
    if (COLOURS.includes(colour as Colour)) scene.look.colour = colour as Colour;
    scene.look.wire = this.get('w') === '1';
    scene.asPoints = this.get('p') === '1';
    scene.camera.yUp = this.get('u') !== 'z';
    const level = this.get('l');
    scene.level = level !== null && /^\d{1,2}$/.test(level) ? Number(level) : 255;
    const error = Number(this.get('q'));
    scene.errorChosen = error >= 0.5 && error <= 32;
    if (scene.errorChosen) scene.error = error;
    const size = Number(this.get('r'));
    scene.setSize(size >= 1 && size <= 8 ? size : 0);
    scene.exaggeration = exaggeration(this.get('z'));
    const [from, elevation] = this.numbers('i', 2) ?? [FOLLOW, LIGHT.elevation];
    scene.look.light = [from >= 0 && from < 360 ? from : FOLLOW, Math.min(80, Math.max(20, elevation))];
    scene.look.fillGaps = this.get('g') !== '0';
    scene.look.depthShading = this.get('d') === '1';
    const classes = (this.get('h') ?? '').split('.').filter(text => /^\d{1,3}$/.test(text)).map(Number);
    scene.look.hidden = new Set(classes.filter(group => group < 256));
    const region = this.numbers('b', 5);
    const valid = region && region[0] < region[2] && region[1] < region[3] && region[4] >= 0 && region[4] < 255;
    scene.region = valid ? {corners: region.slice(0, 4), level: Math.floor(region[4])} : null;
  }
  /// Moves the camera to the place of the link, if that is valid for the store.
  apply(): void {
    const {camera, box} = this.scene;
    const numbers = this.numbers('v', 6);
    if (!numbers || numbers[5] <= 0) return;
    numbers[2] *= this.scene.look.exaggeration;
    // From farther away nothing would be visible.
    const {least, most} = camera, middle = [0, 1, 2].map(i => (box[i] + box[i + 3]) / 2);
    if (Math.hypot(...middle.map((c, i) => numbers[i] - c)) > most) return;
    camera.target = [numbers[0], numbers[1], numbers[2]];
    camera.azimuth = numbers[3];
    camera.tilt = camera.within(numbers[4]);
    camera.distance = Math.min(most, Math.max(least, numbers[5]));
    this.scene.fitted = false;
  }
  write(): void {
    const {scene} = this, c = scene.camera;
    const target = [c.target[0], c.target[1], c.target[2] / scene.look.exaggeration];
    const view = [...target.map(n => scene.plain(n, scene.scan ? 0 : 2)), c.azimuth.toFixed(2), c.tilt.toFixed(2), c.distance.toPrecision(6)];
    const parts = [`s=${encodeURIComponent(scene.store)}`, `v=${view.join(',')}`, `c=${scene.look.colour}`, `q=${scene.error}`];
    if (scene.look.wire) parts.push('w=1');
    if (scene.size > 0) parts.push(`r=${scene.size}`);
    if (scene.scan && scene.asPoints) parts.push('p=1');
    if (scene.scan) parts.push(`u=${c.yUp ? 'y' : 'z'}`);
    if (scene.level !== 255) parts.push(`l=${scene.level}`);
    const {look, region} = scene;
    if (scene.exaggeration !== 1) parts.push(`z=${scene.exaggeration}`);
    if (look.light[0] !== FOLLOW || look.light[1] !== LIGHT.elevation) parts.push(`i=${look.light.join(',')}`);
    if (!look.fillGaps) parts.push('g=0');
    if (look.depthShading) parts.push('d=1');
    if (look.hidden.size > 0) parts.push(`h=${[...look.hidden].sort((a, b) => a - b).join('.')}`);
    if (region) parts.push(`b=${[...region.corners.map(n => scene.plain(n, 2)), region.level].join(',')}`);
    history.replaceState(null, '', `#${parts.join('&')}`);
  }
}
