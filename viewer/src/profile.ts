// SPDX-License-Identifier: GPL-3.0-or-later
/// The plot of the profile between two places.

import type {Profile} from './core';
import {element} from './page';
import type {Scene} from './scene';
import {lengthOnEarth, worldPoint} from './store';
import {rounded} from './text';

export function clearProfile(): void {
  element('profile').hidden = true;
}

/// Returns the line of a raster's profile in the view frame, in parts between voids.
export function profileLines(scene: Scene, profile: Profile, from: number[], to: number[]): number[][][] {
  const lines: number[][][] = [[]];
  const [a, b] = [from, to].map(stored => scene.place(stored));
  for (const [t, height] of profile.points) {
    if (Number.isNaN(height)) {
      if (lines[lines.length - 1].length > 0) lines.push([]);
    } else {
      lines[lines.length - 1].push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), height * scene.heightUnit]);
    }
  }
  return lines.filter(line => line.length > 1);
}

/// Plots the profile between two stored places.
export function showProfile(scene: Scene, profile: Profile, from: number[], to: number[]): void {
  const {manifest} = scene;
  const heights = profile.points.map(point => point[1]).filter(h => !Number.isNaN(h));
  element('profile').hidden = heights.length < 2;
  if (heights.length < 2 || !manifest) return;
  const low = heights.reduce((a, b) => Math.min(a, b)), high = heights.reduce((a, b) => Math.max(a, b)), rise = high - low || 1;
  const at = ([t, h]: [number, number]) => `${(256 * t).toFixed(2)},${(80 - 76 * (h - low) / rise).toFixed(2)}`;
  // Fill the ground down to the bottom, in parts between voids; or plot the points.
  let path = '', part: Array<[number, number]> = [];
  const close = () => {
    if (part.length > 1) path += `M${(256 * part[0][0]).toFixed(2)},84 L${part.map(at).join(' ')} L${(256 * part[part.length - 1][0]).toFixed(2)},84 Z`;
    part = [];
  };
  for (const point of profile.points) {
    if (scene.kind !== 'raster') {
      path += `M${at(point)}h0`;
    } else if (Number.isNaN(point[1])) {
      close();
    } else {
      part.push(point);
    }
  }
  close();
  const shape = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  shape.setAttribute('class', scene.kind === 'raster' ? 'raster' : 'points');
  shape.setAttribute('d', path);
  element('profile-plot').replaceChildren(shape);
  // Enough digits to distinguish the lowest from the highest.
  const digits = Math.min(12, Math.max(0, 2 - Math.floor(Math.log10(rise))));
  const about = profile.level > 0 || profile.sampled ? 'about ' : '';
  const label = (h: number) => `${about}${scene.scan ? h.toFixed(digits) : `${rounded(h)}${scene.unit}`}`;
  const metres = lengthOnEarth(manifest, worldPoint(manifest, from), worldPoint(manifest, to)) ?? profile.metres;
  element('profile-low').textContent = `${label(low)} lowest`;
  element('profile-length').textContent = scene.scan ? `${Number(metres.toPrecision(4))}` : scene.ground(metres);
  element('profile-high').textContent = `${label(high)} highest`;
}
