// SPDX-License-Identifier: GPL-3.0-or-later
/// Draws the scene with WebGL 2 from buffers indexed by the core's slots.

import {BLOCK, type Changes, type Kind, type State, VERTEX_BYTES} from './core';
import {add, dot, FOV, type OrbitCamera, unit, type Vec3} from './camera';
import {DepthShading, link} from './depth_shading';
import {classColour, GREYS, heightStops, LEVELS, LIGHT, PLAIN, SLOPE, type Stop, texels} from './ramps';

export const COLOURS = ['height', 'slope', 'level', 'rgb', 'class', 'intensity', 'grey'] as const;
export type Colour = typeof COLOURS[number];

export interface Look {
  colour: Colour;
  wire: boolean;
  dark: boolean;
  pointSize: number;         ///< in CSS pixels
  fillGaps: boolean;         ///< enlarge points that are far from each other in the picture
  depthShading: boolean;     ///< darken points next to nearer ones
  hidden: Set<number>;       ///< classes
  light: [number, number];   ///< on rasters: degrees clockwise from north, FOLLOW: from the upper left of the picture; elevation
  exaggeration: number;      ///< of the heights of the scene
  adaptiveSpacing: number;   ///< metres between points at full resolution
}

/// The light that turns with the viewer.
export const FOLLOW = -1;

/// Colour of the lines around the cluster of a place, and of measured lines.
const OUTLINE = [214, 40, 110];
/// Largest points that fill gaps, in CSS pixels.
const LARGEST_POINT = 16;

const SLIDE_SECONDS = 0.45;

const VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in float level;
layout(location = 3) in vec3 start;      // of a raster: z; of a surface: from the place, in units of 2^exponent
layout(location = 4) in vec3 rgb;        // of points and surfaces, in the bytes of the start
layout(location = 5) in vec2 attributes; // likewise: class, intensity
layout(location = 6) in float began;     // the slide
layout(location = 7) in float exponent;
uniform mat4 matrix;
uniform int slides;  // 0 not, 1 up and down, 2 in space
uniform float time, pointSize;
uniform vec2 spacing;      // of points: pixels at a distance of 1, and the largest size
uniform uint hidden[8];    // classes, a bit for each
uniform vec2 nudge;        // in the picture
out vec3 at;
out vec3 up;
out float levelOf;
out vec3 own;
out vec2 attributesOf;
void main() {
  at = place;
  if (slides > 0) {
    float t = clamp((time - began) / ${SLIDE_SECONDS.toFixed(2)}, 0.0, 1.0), left = 1.0 - t * t * (3.0 - 2.0 * t);
    at += left * (slides == 1 ? vec3(0.0, 0.0, start.x - place.z) : start * exp2(exponent));
  }
  up = normal;
  own = rgb;
  attributesOf = attributes;
  levelOf = level * 255.0;
  uint group = uint(attributes.x * 255.0 + 0.5);
  bool shown = levelOf < 254.5 && (hidden[group >> 5] >> (group & 31u) & 1u) == 0u;
  gl_Position = shown ? matrix * vec4(at, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_Position.xy += nudge * gl_Position.w;
  gl_PointSize = max(pointSize, min(spacing.x / gl_Position.w, spacing.y));
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at;
in vec3 up;
in float levelOf;
in vec3 own;
in vec2 attributesOf;
uniform sampler2D ramp;
uniform int mode;  // as in COLOURS; -1 for lines, -2 for lines by level
uniform vec2 heights;
uniform float top;
uniform int lit;   // 0 not, 1 as a map, 2 as a body
uniform vec3 axis;  // upward
uniform float flatLight;  // on what faces the eye
uniform vec4 wire;
uniform vec3 sun;
uniform vec3 sky;
uniform vec3 eye;
uniform float haze;
uniform float exaggeration;
uniform bool rounded;  // points
out vec4 colour;
void main() {
  if (rounded && distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;
  if (mode == -1) {
    colour = wire;
    return;
  }
  vec3 n = lit > 0 ? normalize(up) : vec3(0.0, 0.0, 1.0);
  float share = mode == 0 ? (dot(at, axis) - heights.x) / max(heights.y - heights.x, 1e-30)
      : mode == 1 ? degrees(atan(length(n.xy), exaggeration * n.z)) / 60.0  // without the exaggeration
      : abs(mode) == 2 ? 1.0 - levelOf / max(top, 1.0)
      : mode == 4 ? (floor(attributesOf.x * 255.0 + 0.5) + 0.5) / 256.0
      : attributesOf.y;
  vec3 base = mode == 3 ? own : texture(ramp, vec2(clamp(share, 0.0, 1.0), 0.5)).rgb;
  if (mode == -2) {
    colour = vec4(0.6 * base, 0.4);
    return;
  }
  if (lit > 0) {
    // As the command's pictures have it: what faces the eye (the ground of a map) keeps its tint, slopes toward the light grow
    // paler, the others darker. A body has two sides.
    if (lit == 2 && dot(n, eye - at) < 0.0) n = -n;
    float light = ${LIGHT.ambient.toFixed(2)} + ${((1 - LIGHT.ambient) * LIGHT.strength).toFixed(4)} * max(dot(n, sun), 0.0) / flatLight;
    base = light <= 1.0 ? base * light : base + (1.0 - base) * min(light - 1.0, 1.0);
  }
  float far = 1.0 - exp(-pow(distance(at, eye) / haze, 2.0));
  colour = vec4(mix(base, sky, 0.55 * far), 1.0);
}`;

class GrowingBuffer {
  mirror = new Uint8Array(0);
  readonly buffer: WebGLBuffer;
  constructor(
      private readonly gl: WebGL2RenderingContext, private readonly target: number, private readonly bytes: number) {
    this.buffer = gl.createBuffer()!;
  }
  /// Uploads blocks of BLOCK items; adjacent blocks are uploaded together.
  put(blocks: Uint32Array, data: Uint8Array, slots: number): void {
    const size = BLOCK * this.bytes, needed = Math.ceil(slots / BLOCK) * size;
    const grown = needed > this.mirror.length;
    if (grown) {
      const mirror = new Uint8Array(Math.max(needed, Math.ceil(this.mirror.length * 1.5 / size) * size));
      mirror.set(this.mirror);
      this.mirror = mirror;
    }
    blocks.forEach((block, i) => this.mirror.set(data.subarray(i * size, (i + 1) * size), block * size));
    const gl = this.gl;
    gl.bindVertexArray(null);
    gl.bindBuffer(this.target, this.buffer);
    if (grown) {
      gl.bufferData(this.target, this.mirror, gl.DYNAMIC_DRAW);
      return;
    }
    for (let i = 0; i < blocks.length;) {
      let end = i + 1;
      while (end < blocks.length && blocks[end] - blocks[end - 1] <= 2) ++end;
      const from = blocks[i] * size, to = (blocks[end - 1] + 1) * size;
      gl.bufferSubData(this.target, from, this.mirror, from, to - from);
      i = end;
    }
  }
}

export class Renderer {
  readonly gl: WebGL2RenderingContext;
  private readonly program: WebGLProgram;
  private readonly uniforms = new Map<string, WebGLUniformLocation|null>();
  private readonly ramps: Record<Colour, WebGLTexture>;
  private vertices!: GrowingBuffer;
  private triangles!: GrowingBuffer;
  private lines!: WebGLBuffer;
  private surface!: WebGLVertexArrayObject;
  private wires!: WebGLVertexArrayObject;
  private rim!: WebGLBuffer;
  private rims!: WebGLVertexArrayObject;
  private rimCount = 0;
  private readonly depthShading: DepthShading;
  private paths: Array<{buffer: WebGLBuffer, array: WebGLVertexArrayObject, count: number}> = [];
  private linesStale = true;
  private state: State|null = null;
  private box = [0, 0, 0, 1, 1, 1];
  private top = 1;
  private kind: Kind = 'raster';
  private slidingUntil = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.resize();  // first, because resizing is slow once there is a context
    const gl = canvas.getContext('webgl2', {antialias: true, alpha: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error('This browser has no WebGL 2, which the viewer needs.');
    this.gl = gl;
    this.program = link(gl, VERTEX, FRAGMENT);
    this.ramps = {
      height: gl.createTexture()!,
      slope: this.ramp(SLOPE),
      level: this.ramp(LEVELS),
      rgb: this.ramp(GREYS),
      class: this.ramp(Array.from({length: 256}, (_, group) => [group, ...classColour(group)])),
      intensity: this.ramp(GREYS),
      grey: this.ramp(PLAIN)
    };
    gl.enable(gl.DEPTH_TEST);
    this.depthShading = new DepthShading(gl);
    this.clear();
  }

  /// Discards the scene.
  clear(): void {
    const gl = this.gl;
    this.vertices = new GrowingBuffer(gl, gl.ARRAY_BUFFER, VERTEX_BYTES[this.kind]);
    this.triangles = new GrowingBuffer(gl, gl.ELEMENT_ARRAY_BUFFER, 12);
    this.lines = gl.createBuffer()!;
    this.surface = this.array(this.triangles.buffer);
    this.wires = this.array(this.lines);
    this.rim = gl.createBuffer()!;
    this.rims = this.array(this.rim);
    this.rimCount = 0;
    this.linesStale = true;
    this.state = null;
    this.setPaths([]);
  }
  show(box: number[], top: number, kind: Kind, scan: boolean): void {
    this.box = box;
    this.top = top;
    this.kind = kind;
    this.clear();
    this.fill(this.ramps.height, scan ? heightStops(0, 1) : heightStops(box[2], box[5]));
  }
  apply(state: State, changes: Changes, time: number): void {
    this.state = state;
    if (changes.vertexBlocks.length > 0) {
      this.vertices.put(changes.vertexBlocks, changes.vertices, state.vertexSlots);
      if (this.kind !== 'points') this.slidingUntil = time + SLIDE_SECONDS;
    }
    if (changes.triangleBlocks.length > 0) {
      const bytes = new Uint8Array(changes.triangles.buffer, changes.triangles.byteOffset, changes.triangles.byteLength);
      this.triangles.put(changes.triangleBlocks, bytes, state.triangleSlots);
      this.linesStale = true;
    }
  }
  get outlined(): number {
    return this.rimCount / 2;
  }
  /// Sets the lines around a cluster, as slots of their ends.
  outline(lines: Uint32Array): void {
    const gl = this.gl;
    this.rimCount = lines.length;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.rim);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, lines, gl.DYNAMIC_DRAW);
  }
  /// Sets the measured lines, as places of the view frame.
  setPaths(paths: number[][][]): void {
    const gl = this.gl;
    for (const {buffer, array} of this.paths) {
      gl.deleteBuffer(buffer);
      gl.deleteVertexArray(array);
    }
    const middle = this.middleHeight;
    this.paths = paths.map(path => {
      const buffer = gl.createBuffer()!, array = gl.createVertexArray()!;
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(path.flatMap(([x, y, z]) => [x, y, z - middle])), gl.STATIC_DRAW);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
      gl.enableVertexAttribArray(0);
      gl.bindVertexArray(null);
      return {buffer, array, count: path.length};
    });
  }
  get drawnPaths(): number[] {
    return this.paths.map(path => path.count);
  }
  /// Heights of vertices are relative to the middle of the box.
  private get middleHeight(): number {
    return (this.box[2] + this.box[5]) / 2;
  }
  /// Returns whether any vertices are still sliding.
  sliding(time: number): boolean {
    return time < this.slidingUntil;
  }
  resize(): boolean {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width === width && this.canvas.height === height) return false;
    this.canvas.width = width;
    this.canvas.height = height;
    return true;
  }

  draw(camera: OrbitCamera, look: Look, time: number): void {
    const gl = this.gl;
    const sky = look.dark ? [0.075, 0.09, 0.115] : [0.86, 0.90, 0.94];
    const shaded = look.depthShading && this.kind === 'points' && this.state !== null;
    if (shaded) this.depthShading.begin(this.canvas.width, this.canvas.height);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(sky[0], sky[1], sky[2], 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.state) return;
    const aspect = this.canvas.width / this.canvas.height;
    const middleHeight = this.middleHeight;
    const eye = add(camera.eye, [0, 0, middleHeight], -1), box = this.box.map((c, i) => i % 3 === 2 ? c - middleHeight : c);
    const extent = Math.hypot(box[3] - box[0], box[4] - box[1], box[5] - box[2]) || 1;
    let farthest = 0;
    for (let i = 0; i < 8; ++i) {
      farthest = Math.max(farthest, Math.hypot(box[i & 1 ? 3 : 0] - eye[0], box[i & 2 ? 4 : 1] - eye[1],
                                               box[i & 4 ? 5 : 2] - eye[2]));
    }
    const far = farthest * 1.01 + camera.distance * 0.01;
    const near = Math.max(far * 2e-5, camera.distance * 0.02);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.uniform('matrix'), false, camera.matrix(aspect, near, far, eye));
    gl.uniform1f(this.uniform('time'), time);
    const pointSize = look.pointSize * this.canvas.width / this.canvas.clientWidth;
    gl.uniform1f(this.uniform('pointSize'), pointSize);
    const dense = look.fillGaps && this.kind === 'points' ? look.adaptiveSpacing * this.canvas.height / 2 / Math.tan(FOV / 2 * Math.PI / 180) : 0;
    gl.uniform2f(this.uniform('spacing'), dense, LARGEST_POINT * this.canvas.width / this.canvas.clientWidth);
    gl.uniform1i(this.uniform('rounded'), dense > 0 ? 1 : 0);
    const hidden = new Uint32Array(8);
    if (this.kind === 'points') for (const group of look.hidden) hidden[group >> 5] |= 1 << (group & 31);
    gl.uniform1uiv(this.uniform('hidden'), hidden);
    gl.uniform2f(this.uniform('nudge'), 0, 0);
    gl.uniform1f(this.uniform('exaggeration'), look.exaggeration);
    const yUp = camera.body && camera.yUp;
    gl.uniform3f(this.uniform('axis'), 0, yUp ? 1 : 0, yUp ? 0 : 1);
    // A flat scene has the middle colour; differences from rounding are ignored.
    const low = yUp ? box[1] : box[2], high = yUp ? box[4] : box[5], middle = (low + high) / 2;
    const reach = Math.max((high - low) / 2, 1e-9 * Math.abs(yUp ? middle : middleHeight));
    gl.uniform2f(this.uniform('heights'), middle - reach, middle + reach);
    gl.uniform1f(this.uniform('top'), this.top);
    gl.uniform1i(this.uniform('lit'), {points: 0, raster: 1, surface: 2}[this.kind]);
    // Cartographic light from the upper left that turns with the viewer, or a direction; for a body, from next to the eye.
    const turn = (look.light[0] === FOLLOW ? camera.azimuth + LIGHT.turn : look.light[0]) * Math.PI / 180;
    const elevation = look.light[1] * Math.PI / 180;
    const toward = add([0, 0, 0], camera.direction, -1), surface = this.kind === 'surface';
    const sun: Vec3 = surface ? unit(add(add(toward, camera.up, 0.45), camera.right, -0.45)) :
                                [Math.sin(turn) * Math.cos(elevation), Math.cos(turn) * Math.cos(elevation), Math.sin(elevation)];
    gl.uniform3f(this.uniform('sun'), ...sun);
    gl.uniform1f(this.uniform('flatLight'), surface ? dot(sun, toward) : sun[2]);
    gl.uniform3f(this.uniform('sky'), sky[0], sky[1], sky[2]);
    gl.uniform3f(this.uniform('eye'), eye[0], eye[1], eye[2]);
    gl.uniform1f(this.uniform('haze'), extent * (camera.body ? 100 : 2.5));
    gl.uniform4f(this.uniform('wire'), 0.02, 0.03, 0.05, 0.28);
    gl.uniform1i(this.uniform('slides'), {points: 0, raster: 1, surface: 2}[this.kind]);
    gl.uniform1i(this.uniform('mode'), COLOURS.indexOf(look.colour));
    gl.bindTexture(gl.TEXTURE_2D, this.ramps[look.colour]);
    // Points on one line have no triangles.
    if (this.kind === 'points' || this.state.triangles === 0) {
      gl.uniform1i(this.uniform('lit'), 0);
      gl.bindVertexArray(this.surface);
      gl.drawArrays(gl.POINTS, 0, this.state.vertexSlots);
      gl.uniform1i(this.uniform('mode'), -1);
      if (this.rimCount > 0) {
        gl.uniform1f(this.uniform('pointSize'), pointSize + 2);
        gl.depthFunc(gl.LEQUAL);
        this.drawRim(gl.POINTS);
        gl.depthFunc(gl.LESS);
      }
      if (shaded) this.depthShading.end(near, far);
      this.drawPaths();
      return;
    }
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.bindVertexArray(this.surface);
    gl.drawElements(gl.TRIANGLES, this.state.triangleSlots * 3, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.uniform1i(this.uniform('mode'), -1);
    if (look.wire) {
      if (this.linesStale) this.makeLines();
      // Colour lines by level if the surface shows something else.
      if (look.colour !== 'level') {
        gl.uniform1i(this.uniform('mode'), -2);
        gl.bindTexture(gl.TEXTURE_2D, this.ramps.level);
      }
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(false);
      gl.bindVertexArray(this.wires);
      gl.drawElements(gl.LINES, this.lineCount, gl.UNSIGNED_INT, 0);
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
    gl.uniform1i(this.uniform('mode'), -1);
    if (this.rimCount > 0) this.drawRim(gl.LINES);
    this.drawPaths();
  }
  /// Draws the measured lines three pixels wide, faintly where something is in front of them.
  private drawPaths(): void {
    if (this.paths.length === 0) return;
    const gl = this.gl, ratio = this.canvas.width / this.canvas.clientWidth;
    gl.useProgram(this.program);
    gl.uniform1i(this.uniform('rounded'), 0);
    gl.uniform1i(this.uniform('slides'), 0);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const infront of [false, true]) {
      gl.uniform4f(this.uniform('wire'), OUTLINE[0] / 255, OUTLINE[1] / 255, OUTLINE[2] / 255, infront ? 1 : 0.12);
      // The drawn surface is coarser than the store, so the lines are a bit above or below it.
      gl.depthRange(0, infront ? 0.9999 : 1);
      if (!infront) gl.disable(gl.DEPTH_TEST);
      for (const [x, y] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) {
        gl.uniform2f(this.uniform('nudge'), 2 * x * ratio / this.canvas.width, 2 * y * ratio / this.canvas.height);
        for (const {array, count} of this.paths) {
          gl.bindVertexArray(array);
          gl.drawArrays(gl.LINE_STRIP, 0, count);
        }
      }
      gl.enable(gl.DEPTH_TEST);
    }
    gl.depthRange(0, 1);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  private drawRim(what: number): void {
    const gl = this.gl;
    gl.uniform4f(this.uniform('wire'), OUTLINE[0] / 255, OUTLINE[1] / 255, OUTLINE[2] / 255, 1);
    gl.bindVertexArray(this.rims);
    gl.drawElements(what, this.rimCount, gl.UNSIGNED_INT, 0);
  }
  private lineCount = 0;
  /// Lists each edge once: from the triangle whose edge has ascending slots, or the only triangle.
  private makeLines(): void {
    const gl = this.gl;
    const corners = new Uint32Array(this.triangles.mirror.buffer, 0, (this.state?.triangleSlots ?? 0) * 3);
    const lines = new Uint32Array(corners.length * 2);
    let count = 0;
    for (let i = 0; i < corners.length; i += 3) {
      const a = corners[i], b = corners[i + 1], c = corners[i + 2];
      if (a === b) continue;
      // This omits hull edges with descending slots, which is not noticeable.
      if (a < b) lines[count++] = a, lines[count++] = b;
      if (b < c) lines[count++] = b, lines[count++] = c;
      if (c < a) lines[count++] = c, lines[count++] = a;
    }
    this.lineCount = count;
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.lines);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, lines.subarray(0, count), gl.DYNAMIC_DRAW);
    this.linesStale = false;
  }
  private array(elements: WebGLBuffer): WebGLVertexArrayObject {
    const gl = this.gl, array = gl.createVertexArray()!;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.vertices.buffer);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, elements);
    // Per attribute: number of components, their type, whether they are normalised, and their first byte.
    const attributes: Array<[number, number, number, boolean, number]> =
        [[0, 3, gl.FLOAT, false, 0], [1, 3, gl.BYTE, true, 12], [2, 1, gl.UNSIGNED_BYTE, true, 15]];
    if (this.kind === 'raster') {
      attributes.push([3, 1, gl.FLOAT, false, 16], [6, 1, gl.FLOAT, false, 20]);
    } else {
      attributes.push([4, 3, gl.UNSIGNED_BYTE, true, 16], [5, 2, gl.UNSIGNED_BYTE, true, 19]);
    }
    if (this.kind === 'surface') {
      attributes.push([3, 3, gl.SHORT, false, 22], [6, 1, gl.FLOAT, false, 28], [7, 1, gl.BYTE, false, 21]);
    }
    for (const [at, size, type, share, first] of attributes) {
      gl.vertexAttribPointer(at, size, type, share, VERTEX_BYTES[this.kind], first);
      gl.enableVertexAttribArray(at);
    }
    gl.bindVertexArray(null);
    return array;
  }
  private ramp(stops: Stop[]): WebGLTexture {
    const texture = this.gl.createTexture()!;
    this.fill(texture, stops);
    return texture;
  }
  private fill(texture: WebGLTexture, stops: Stop[]): void {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels(stops, 256));
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
  }
  private uniform(name: string): WebGLUniformLocation|null {
    if (!this.uniforms.has(name)) this.uniforms.set(name, this.gl.getUniformLocation(this.program, name));
    return this.uniforms.get(name)!;
  }
}
