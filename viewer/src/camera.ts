// SPDX-License-Identifier: GPL-3.0-or-later
/// A camera that orbits a place on the ground, or a body from any side. Metres east, north and up; angles in degrees.

export type Vec3 = [number, number, number];

export const FOV = 45;
const RADIANS = Math.PI / 180;
const LEAST_TILT = 2, MOST_TILT = 89.9;

export const add = (a: Vec3, b: Vec3, s = 1): Vec3 => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 =>
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vec3): number => Math.sqrt(dot(a, a));
export const unit = (a: Vec3): Vec3 => {
  const l = length(a);
  return [a[0] / l, a[1] / l, a[2] / l];
};

export class OrbitCamera {
  target: Vec3 = [0, 0, 0];
  azimuth = 0;   ///< direction of view, clockwise from north
  tilt = 40;     ///< below the horizon
  distance = 1;
  least = 1;     ///< range of distances
  most = 1e9;
  body = false;  ///< no ground: it also turns below, and moves in the picture's plane
  yUp = false;   ///< body: north is up, and east stays

  private turned(v: Vec3): Vec3 {
    return this.body && this.yUp ? [v[0], v[2], -v[1]] : v;
  }

  get direction(): Vec3 {
    const a = this.azimuth * RADIANS, t = this.tilt * RADIANS;
    return this.turned([Math.sin(a) * Math.cos(t), Math.cos(a) * Math.cos(t), -Math.sin(t)]);
  }
  get eye(): Vec3 {
    return add(this.target, this.direction, -this.distance);
  }
  get right(): Vec3 {
    const a = this.azimuth * RADIANS;
    return this.turned([Math.cos(a), -Math.sin(a), 0]);
  }
  get up(): Vec3 {
    return cross(this.right, this.direction);
  }

  /// Looks from the south, from the nearest distance that shows the whole box between these edges of the picture (from -1 to
  /// 1, right and up).
  fit(box: number[], aspect: number, left = -1, right = 1, bottom = -1, top = 1): void {
    // A single point is viewed from a metre away.
    const extent = length([box[3] - box[0], box[4] - box[1], box[5] - box[2]]) || 1;
    const middle: Vec3 = [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2, (box[2] + box[5]) / 2];
    this.azimuth = 0;
    this.tilt = this.body ? 12 : 42;
    this.least = extent * 1e-5;
    this.most = extent * 8;
    const t = Math.tan(FOV / 2 * RADIANS);
    const corners = Array.from({length: 8}, (_, i) => add([box[i & 1 ? 3 : 0], box[i & 2 ? 4 : 1], box[i & 4 ? 5 : 2]], middle, -1));
    const axes: Array<[Vec3, number, number]> = [[this.right, left * t * aspect, right * t * aspect], [this.up, bottom * t, top * t]];
    // Find the distance at which no corner is outside either edge. Edges are lines from the eye, and the corners that touch
    // them stay the same along the axis.
    this.distance = extent / 2;
    for (const [axis, low, high] of axes) {
      const beyondHigh = Math.max(...corners.map(c => dot(c, axis) - high * dot(c, this.direction)));
      const beyondLow = Math.max(...corners.map(c => low * dot(c, this.direction) - dot(c, axis)));
      this.distance = Math.max(this.distance, (beyondHigh + beyondLow) / (high - low));
    }
    // Then move the eye along each axis until the margins at both edges are equal.
    this.target = middle;
    for (const [axis, low, high] of axes) {
      let at = 0;
      for (let step = 0; step < 8; ++step) {
        const seen = corners.map(c => (dot(c, axis) - at) / (dot(c, this.direction) + this.distance));
        at += this.distance * (Math.max(...seen) + Math.min(...seen) - high - low) / 2;
      }
      this.target = add(this.target, axis, at);
    }
    // On a ground, orbit the point of mean height in the middle of the picture.
    if (!this.body) this.retarget(this.distance + (middle[2] - this.target[2]) / this.direction[2]);
  }
  orbit(turn: number, tilt: number): void {
    this.azimuth = (this.azimuth + turn + 360) % 360;
    this.tilt = this.within(this.tilt + tilt);
  }
  /// Returns the nearest valid tilt.
  within(tilt: number): number {
    return Math.min(MOST_TILT, Math.max(this.body ? -MOST_TILT : LEAST_TILT, tilt));
  }
  /// Moves by pixels of a picture of this height; the ground follows the pointer.
  pan(right: number, down: number, height: number): void {
    const metres = 2 * this.distance * Math.tan(FOV / 2 * RADIANS) / height;
    if (this.body) {
      this.target = add(add(this.target, this.right, -right * metres), this.up, down * metres);
      return;
    }
    const a = this.azimuth * RADIANS;
    const forward: Vec3 = [Math.sin(a), Math.cos(a), 0];
    const steep = Math.max(0.25, Math.sin(this.tilt * RADIANS));
    this.target = add(add(this.target, this.right, -right * metres), forward, down * metres / steep);
  }
  /// Returns the ray through a place of the picture; x and y are from -1 to 1, right and up.
  ray(x: number, y: number, aspect: number): Vec3 {
    const t = Math.tan(FOV / 2 * RADIANS);
    return unit(add(add(this.direction, this.right, x * t * aspect), this.up, y * t));
  }
  /// Zooms by the factor, with the point under x, y staying there.
  zoom(factor: number, x: number, y: number, aspect: number): void {
    const before = this.distance;
    this.distance = Math.min(this.most, Math.max(this.least, this.distance * factor));
    const share = 1 - this.distance / before;
    const ray = this.ray(x, y, aspect);
    const old = add(this.target, this.direction, -before);
    // Where the ray meets the level of the target, or for a body the plane through it; at the horizon, straight ahead.
    const drop = this.body ? before / dot(ray, this.direction) : (this.target[2] - old[2]) / ray[2];
    if (!(drop > 0) || drop > 6 * before) return;
    const place = add(old, ray, drop);
    this.target = add(this.target, add(place, this.target, -1), share);
  }
  /// Sets the target at this distance without changing the picture, so that the camera orbits the visible place.
  retarget(distance: number): void {
    const eye = this.eye;
    this.distance = Math.min(this.most, Math.max(this.least, distance));
    this.target = add(eye, this.direction, this.distance);
  }

  /// Returns view and projection from an eye, column by column as WebGL expects.
  matrix(aspect: number, near: number, far: number, e: Vec3): Float32Array {
    const f = 1 / Math.tan(FOV / 2 * RADIANS);
    const r = this.right, u = this.up, d = this.direction;
    const view = [
      [r[0], r[1], r[2], -dot(r, e)], [u[0], u[1], u[2], -dot(u, e)], [-d[0], -d[1], -d[2], dot(d, e)], [0, 0, 0, 1]
    ];
    const rows = [
      view[0].map(v => v * f / aspect), view[1].map(v => v * f),
      view[2].map((v, i) => v * (far + near) / (near - far) + view[3][i] * 2 * far * near / (near - far)),
      view[2].map(v => -v)
    ];
    return new Float32Array([0, 1, 2, 3].flatMap(column => rows.map(row => row[column])));
  }
}
