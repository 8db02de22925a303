// SPDX-License-Identifier: GPL-3.0-or-later
/// Clicked places: their panel, their marks, their clusters, and what they measure.

import {add, FOV, length, type Vec3} from './camera';
import type {Connection} from './connection';
import type {Cluster, Hit, Profile} from './core';
import {angleRows, areaRows, boxBetween, HINTS, type Measure, MEASURES, regionEdges} from './measure';
import {element, make, notice} from './page';
import {clearProfile, profileLines, showProfile} from './profile';
import type {Scene} from './scene';
import {lengthOnEarth, worldPoint} from './store';
import {CLASSES} from './text';

/// A clicked place, taken from the picture until the store has answered.
export interface Place extends Hit {
  state: 'pending'|'known'|'none';
  of: number;  ///< read from points of this level and above
}

/// What places draw into the picture.
export interface Drawing {
  outline(lines: Uint32Array): void;    ///< around a cluster, as slots of vertices
  setPaths(paths: number[][][]): void;  ///< lines in the view frame
}

export class Places {
  private trail: Place[] = [];  ///< clicked so far
  private measure: Measure = 'profile';
  private profile: {number: number, of: [Place, Place]|null, found: Profile|null} = {number: 0, of: null, found: null};
  private outlineTimer = 0;  ///< delays the outline until the surface is drawn
  private expandable: Cluster|null = null;
  private collapsible: Cluster|null = null;

  constructor(private readonly scene: Scene, private readonly worker: Connection, private readonly drawing: Drawing) {
    element('place-close').addEventListener('click', () => this.close());
    element('expand').addEventListener('click', () => this.expand());
    element('collapse').addEventListener('click', () => this.collapse());
    element('release').addEventListener('click', () => this.release());
    for (const measure of MEASURES) {
      element(`measure-${measure}`).addEventListener('change', () => {
        this.measure = measure;
        this.close();
        this.showMeasure();
      });
    }
    element('region-level').addEventListener('input', event => {
      if (scene.region) this.setRegion({...scene.region, level: scene.top - Number((event.target as HTMLInputElement).value)});
    });
    element('region-clear').addEventListener('click', () => this.setRegion(null));
  }

  get hit(): Place|null {
    return this.trail[this.trail.length - 1] ?? null;
  }
  private get before(): Place|null {
    return this.trail[this.trail.length - 2] ?? null;
  }
  /// Shows what applies to the open store.
  opened(): void {
    const {scan} = this.scene;
    element('by-area').hidden = element('by-region').hidden = scan;
    if (scan && (this.measure === 'area' || this.measure === 'region')) this.measure = 'profile';
    element<HTMLInputElement>(`measure-${this.measure}`).checked = true;
    this.showMeasure();
    this.draw();
  }
  pick(x: number, y: number, pixels: number): Promise<Hit|null> {
    const {camera, aspect, canvas} = this.scene;
    return this.worker.pick(camera.eye, camera.ray(x, y, aspect), pixels * Math.tan(FOV / 2 * Math.PI / 180) * 2 / canvas.clientHeight);
  }
  /// Shows the place of the picture under x, y.
  async click(x: number, y: number): Promise<void> {
    this.show(await this.pick(x, y, 12));
  }
  /// Expands or collapses the cluster under x, y.
  async pin(x: number, y: number, pin: number): Promise<void> {
    await this.click(x, y);
    if (!this.hit) return;
    if (pin === 1) {
      this.expand();
    } else {
      this.collapse();
    }
  }
  release(): void {
    const {hit} = this;
    this.worker.send({type: 'pin', cluster: {level: 0, ordinal: 0}, pin: -1});
    this.offer(hit?.expandable ?? null, hit ? this.clusterOf(hit) : null);
  }
  close(): void {
    this.trail = [];
    this.forgetProfile();
    element('place').hidden = true;
    this.drawing.outline(new Uint32Array());
    this.draw();
  }
  /// Requests the outline of the cluster after `delay` milliseconds, when the surface has changed.
  askOutline(delay: number): void {
    if (!this.hit || (this.outlineTimer !== 0 && delay > 0)) return;
    clearTimeout(this.outlineTimer);
    this.outlineTimer = window.setTimeout(() => {
      this.outlineTimer = 0;
      if (this.hit) this.worker.send({type: 'outline', level: this.hit.clusterLevel, ordinal: this.hit.clusterOrdinal});
    }, delay);
  }
  /// Requests the profile of the store between the places, which does not depend on the picture.
  async askProfile(): Promise<void> {
    const {hit, before, scene} = this;
    if (!hit || !before || this.measure !== 'profile') return;
    if (scene.kind === 'surface' && !(hit.state === 'known' && before.state === 'known')) return;
    const request = this.forgetProfile();
    const found = await this.worker.profile(before.stored, hit.stored, scene.scan && scene.camera.yUp ? 1 : 2);
    if (request !== this.profile.number) return;
    this.profile = {number: request, of: [before, hit], found};
    showProfile(scene, found, before.stored, hit.stored);
    this.draw();
  }
  /// Adapts to a new exaggeration of heights, for which the store was opened again, without the pinned clusters.
  stretch(factor: number): void {
    const {hit} = this;
    this.offer(hit?.expandable ?? null, hit ? this.clusterOf(hit) : null);
    for (const place of this.trail) place.place = [place.place[0], place.place[1], factor * place.place[2]];
    this.draw();
  }
  /// Moves the marks with the picture.
  showMarks(): void {
    this.showMark('mark', this.hit);
    this.showMark('mark-before', this.before);
  }

  // ---- Clusters --------------------------------------------------------------------------------

  private clusterOf(hit: Hit): Cluster|null {
    // The top stays expanded.
    return hit.clusterLevel < this.scene.top ? {level: hit.clusterLevel, ordinal: hit.clusterOrdinal} : null;
  }
  /// Names the clusters that the buttons expand and collapse.
  private offer(expandable: Cluster|null, collapsible: Cluster|null): void {
    this.expandable = expandable;
    this.collapsible = collapsible;
    for (const [id, text, cluster] of [['expand', 'Expand', expandable], ['collapse', 'Collapse', collapsible]] as const) {
      const button = element<HTMLButtonElement>(id);
      button.textContent = cluster ? `${text} ${cluster.level}:${cluster.ordinal}` : text;
      button.disabled = !cluster;
    }
  }
  private expand(): void {
    const cluster = this.expandable;
    if (!cluster) return;
    this.worker.send({type: 'pin', cluster, pin: 1});
    this.offer(null, cluster);
  }
  private collapse(): void {
    const cluster = this.collapsible;
    if (!cluster) return;
    this.worker.send({type: 'pin', cluster, pin: 0});
    this.offer(cluster, null);
  }

  // ---- Measuring -------------------------------------------------------------------------------

  private showMeasure(): void {
    const {region, top} = this.scene;
    element('measure-hint').textContent = HINTS[this.measure];
    element('with-region').hidden = !region;
    if (!region) return;
    element<HTMLInputElement>('region-level').max = String(top);
    element<HTMLInputElement>('region-level').value = String(top - region.level);
    element('region-text').textContent = `level ${region.level}`;
  }
  private setRegion(region: Scene['region']): void {
    this.scene.region = region;
    this.scene.moved = true;
    this.showMeasure();
    this.draw();
  }
  private forgetProfile(): number {
    this.profile = {number: this.profile.number + 1, of: null, found: null};
    return this.profile.number;
  }
  /// Draws the measured lines.
  private draw(): void {
    const {scene, trail} = this, paths = regionEdges(scene), corners = trail.map(({place}) => place);
    const {of, found} = this.profile;
    if (of && found && scene.kind === 'raster') {
      paths.push(...profileLines(scene, found, of[0].stored, of[1].stored));
    } else if (this.measure === 'profile' && scene.kind !== 'raster') {
      paths.push(corners.slice(-2));
    } else if (this.measure === 'area') {
      paths.push(corners.length > 2 ? [...corners, corners[0]] : corners);
    } else if (this.measure === 'angle') {
      paths.push(corners.slice(-3));
    }
    this.drawing.setPaths(paths.filter(path => path.length > 1));
    scene.redraw = true;
  }
  private measured(): Array<[string, string]> {
    const {scene, trail} = this;
    return this.measure === 'area' ? areaRows(scene, trail) : this.measure === 'angle' ? angleRows(scene, trail) : [];
  }

  // ---- A place ---------------------------------------------------------------------------------

  /// The picture is coarser than the store, so the height of a raster's place, or the point nearest to a scan's place, is
  /// read from the store. Neither is shown before the answer.
  private show(hit: Hit|null): void {
    const {scene} = this;
    if (!scene.manifest) return;
    if (!hit) {
      notice('There is nothing at this place.', 4);
      // A slip must not lose the corners clicked so far.
      if (this.measure === 'profile') this.close();
      return;
    }
    const group = scene.manifest.attributes.findIndex(({name}) => name === 'classification');
    if (scene.kind === 'points' && scene.look.hidden.has(hit.attributes[group])) {
      return notice('The nearest point is of a hidden class.', 4);
    }
    const place: Place = {...hit, state: scene.kind === 'points' ? 'known' : 'pending', of: 0};
    if (this.measure === 'region' && this.trail.length > 1) this.trail = [];
    this.trail.push(place);
    if (this.measure === 'profile') this.trail = this.trail.slice(-2);
    if (place.state === 'pending') void this.probe(place);
    element('place').hidden = false;
    this.offer(hit.expandable, this.clusterOf(hit));
    clearProfile();
    this.forgetProfile();
    if (this.measure === 'region' && this.trail.length === 2) {
      this.setRegion({corners: boxBetween(this.trail[0], place), level: scene.region?.level ?? 0});
    }
    this.describe();
    this.draw();
    this.askOutline(0);
    void this.askProfile();
  }
  private async probe(place: Place): Promise<void> {
    const found = await this.worker.probe(place.stored, place.reach);
    place.state = found ? 'known' : 'none';
    // The answer may have been under way while the exaggeration changed.
    if (found) {
      const {stored, level: of, attributes} = found;
      Object.assign(place, {stored, place: this.scene.place(stored), of, attributes});
    }
    this.describe();
    this.draw();
    if (this.scene.kind === 'surface') void this.askProfile();
  }
  private describe(): void {
    const {hit, before, scene} = this, {manifest} = scene;
    if (!hit || !manifest) return;
    const crs = manifest.crs, known = hit.state === 'known', waits = hit.state === 'none' ? 'no data' : 'reading';
    const about = hit.of > 0 ? 'about ' : '';
    const world = worldPoint(manifest, hit.stored);
    const place = (n: number) => crs.geographic ? n.toFixed(6) : scene.plain(n, 2);
    const rows: Array<[string, string]> =
        scene.scan ? world.map((c, i): [string, string] => ['XYZ'[i], known ? `${about}${scene.plain(c)}` : waits]) : [
          [crs.geographic ? 'Longitude' : 'East', place(world[0])],
          [crs.geographic ? 'Latitude' : 'North', place(world[1])],
          ['Height', known ? `${about}${scene.plain(world[2], 2)}${scene.unit}` : waits]
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
    rows.push(...this.measured());
    if (before && before.state !== 'pending' && hit.state !== 'pending') {
      const way = add(hit.place as Vec3, before.place as Vec3, -1), both = known && before.state === 'known';
      const over = lengthOnEarth(manifest, worldPoint(manifest, before.stored), world) ?? Math.hypot(way[0], way[1]);
      const rise = both ? `, ${way[2] < 0 ? '−' : '+'}${scene.height(Math.abs(way[2]))}` : '';
      rows.push(['From the last', scene.scan ? scene.plain(length(way)) : scene.ground(over) + rise]);
    }
    element('place-text').replaceChildren(...rows.flatMap(([name, value]) => [make('dt', '', name), make('dd', '', value)]));
    scene.redraw = true;
  }
  private showMark(id: string, hit: Hit|null): void {
    const mark = element(id), at = hit && this.scene.pixel(hit.place);
    mark.hidden = !at;
    if (!at) return;
    mark.style.left = `${at[0]}px`;
    mark.style.top = `${at[1]}px`;
  }
}
