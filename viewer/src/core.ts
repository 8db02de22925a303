// SPDX-License-Identifier: GPL-3.0-or-later
/// The C++ core in WebAssembly (core/module.cpp): one store under one camera. It never waits: it names the bytes that it
/// lacks, and continues once it has been given them.

export interface ByteRange {
  file: string;
  offset: number;
  bytes: number;
}

export interface State {
  points: number;
  triangles: number;
  expanded: number;
  vertexSlots: number;
  triangleSlots: number;
  settled: boolean;
  worst: number;
  clusters: number;
  storedBytes: number;
  waiting: boolean;  ///< removed parts are still drawn until a later frame
}

/// Changed blocks of 64 slots: VERTEX_BYTES per vertex, three numbers per triangle. All are parts of `buffer`.
export interface Changes {
  buffer: ArrayBuffer;
  vertexBlocks: Uint32Array;
  vertices: Uint8Array;
  triangleBlocks: Uint32Array;
  triangles: Uint32Array;
}

export interface Camera {
  eye: number[];
  direction: number[];
  up: number[];
  fov: number;  ///< degrees, vertical
  aspect: number;
  height: number;  ///< pixels
  error: number;   ///< pixels
  level?: number;  ///< minimum detail everywhere, whatever the error
  region?: {level: number, box: number[]};  ///< minimum detail in a box of the view frame
}

export interface Cluster {
  level: number;
  ordinal: number;
}

/// The first part of the picture on a ray.
export interface Hit {
  stored: number[];
  place: number[];
  level: number;
  clusterLevel: number;
  clusterOrdinal: number;
  reach: number;         ///< metres to the nearest corner; 0 for a point itself
  expandable: Cluster|null;  ///< the cluster to expand here
  attributes: number[];  ///< stored values, in the manifest's order; empty if unknown
}

/// A place of the store, independent of the detail drawn.
export interface Found {
  stored: number[];
  place: number[];
  level: number;  ///< read from points of this level and above; 0: from all
  attributes: number[];
}

/// A profile of the store, independent of the detail drawn, see StoreProbe::Profile.
export interface Profile {
  metres: number;
  level: number;
  sampled: boolean;
  points: Array<[number, number]>;  ///< share of the distance, height in the store's unit
}

/// An answer, or the bytes needed for it.
export type Answer<T> = {missing: ByteRange[]}|{answer: T};

/// How a store is shown.
export type Kind = 'raster'|'points'|'surface';

/// The scene as a whole.
export interface Opened {
  box: number[];
  kind: Kind;
  scan: boolean;  ///< scan of a body, which can be shown by its surface
  /// The attributes that can colour points, and the classes that occur.
  colours: {rgb: boolean, intensity: boolean, classes: number[]};
}

export const BLOCK = 64;
export const VERTEX_BYTES: Record<Kind, number> = {
  raster: 24,
  points: 24,
  surface: 32
};

export class CoreError extends Error {}

/// Maximum number of change buffers kept for reuse, and minimum bytes of each.
const MOST_BUFFERS = 8, LEAST_BUFFER = 1 << 20;

const MISSING = 1;
const FAILED = 2;

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  input(bytes: number): number;
  text(): number;
  text_size(): number;
  numbers(): number;
  add_file(name: number, bytes: number): number;
  give(name: number, offset: number, bytes: number): number;
  forget(name: number): number;
  open(maxPoints: number): number;
  frame(): number;
  changes(): number;
  restore(time: number): number;
  hash(): number;
  pick(): number;
  probe(): number;
  profile(): number;
  outline(level: number, ordinal: number): number;
  pin(level: number, ordinal: number, pin: number): number;
}

export class Core {
  private readonly encoder = new TextEncoder();
  private readonly decoder = new TextDecoder();
  private lacking: ByteRange[] = [];  ///< bytes missing in the last frame
  private readonly buffers: ArrayBuffer[] = [];  ///< for later changes

  private constructor(private readonly wasm: Exports, private readonly kind?: Kind) {}

  /// `kind` is what the module shows, if it supports only one kind.
  static async load(bytes: BufferSource, kind?: Kind): Promise<Core> {
    let memory: WebAssembly.Memory;
    const imports = {
      env: {
        emscripten_notify_memory_growth: () => {},
        number: (at: number, bytes: number) => Number(new TextDecoder().decode(new Uint8Array(memory.buffer, at, bytes)))
      },
      wasi_snapshot_preview1: {
        clock_time_get: (_clock: number, _precision: bigint, at: number) => {
          new DataView(memory.buffer).setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true);
          return 0;
        },
        proc_exit: (code: number) => {
          throw new CoreError(`the core exited with ${code}`);
        }
      }
    };
    const {instance} = await WebAssembly.instantiate(bytes, imports);
    const wasm = instance.exports as unknown as Exports;
    memory = wasm.memory;
    wasm._initialize();
    return new Core(wasm, kind);
  }

  addFile(name: string, bytes: number): void {
    this.check(this.wasm.add_file(this.write(name), bytes));
  }
  give(name: string, offset: number, bytes: Uint8Array): void {
    this.check(this.wasm.give(this.write(name, bytes), offset, bytes.length));
  }
  forget(name: string): void {
    this.check(this.wasm.forget(this.write(name)));
  }
  /// Opens the store. Returns the missing bytes, or the scene.
  open(ground: number[], maxPoints: number): {missing: ByteRange[]}|Opened {
    this.writeNumbers(ground);
    if (this.check(this.wasm.open(maxPoints)) === MISSING) return {missing: this.missing()};
    const n = this.numbers(12);
    return {
      box: n.slice(0, 6),
      kind: this.kind ?? (n[6] === 1 ? 'raster' : 'points'),
      scan: n[7] === 1,
      colours: {rgb: n[8] === 1, intensity: n[10] === 1, classes: this.numbers(12 + n[11]).slice(12)}
    };
  }
  /// Works for about `seconds`; `time` is the time of the picture. `same`: the missing
  /// bytes are those of the last frame.
  frame(camera: Camera, seconds: number, time: number): {state: State, missing: ByteRange[], same: boolean} {
    this.writeNumbers([
      ...camera.eye, ...camera.direction, ...camera.up, camera.fov, camera.aspect, camera.height, camera.error, seconds,
      time, camera.level ?? 255, camera.region?.level ?? 255, ...(camera.region?.box ?? [])
    ]);
    this.check(this.wasm.frame());
    const n = this.numbers(11);
    if (n[10] === 0) this.lacking = this.missing();
    return {
      state: {
        points: n[0],
        triangles: n[1],
        expanded: n[2],
        vertexSlots: n[3],
        triangleSlots: n[4],
        settled: n[5] === 1,
        worst: n[6],
        clusters: n[7],
        storedBytes: n[8],
        waiting: n[9] === 1
      },
      missing: this.lacking,
      same: n[10] === 1
    };
  }
  /// Returns copies of the changes since the last call.
  changes(): Changes {
    this.check(this.wasm.changes());
    const [vertexBlocks, vertexBlocksAt, verticesAt, triangleBlocks, triangleBlocksAt, trianglesAt] = this.numbers(6);
    const memory = new Uint8Array(this.wasm.memory.buffer);
    const vertexBytes = vertexBlocks * BLOCK * VERTEX_BYTES[this.kind ?? 'points'], triangleBytes = triangleBlocks * BLOCK * 12;
    const buffer = this.buffer(4 * (vertexBlocks + triangleBlocks) + vertexBytes + triangleBytes);
    let end = 0;
    const copy = (from: number, bytes: number) => {
      const at = end;
      new Uint8Array(buffer, at, bytes).set(memory.subarray(from, from + bytes));
      end += bytes;
      return at;
    };
    return {
      buffer,
      vertexBlocks: new Uint32Array(buffer, copy(vertexBlocksAt, 4 * vertexBlocks), vertexBlocks),
      vertices: new Uint8Array(buffer, copy(verticesAt, vertexBytes), vertexBytes),
      triangleBlocks: new Uint32Array(buffer, copy(triangleBlocksAt, 4 * triangleBlocks), triangleBlocks),
      triangles: new Uint32Array(buffer, copy(trianglesAt, triangleBytes), triangleBytes / 4)
    };
  }
  /// Takes back a buffer of processed changes, because allocating new ones is slow.
  recycle(buffer: ArrayBuffer): void {
    if (this.buffers.length < MOST_BUFFERS) this.buffers.push(buffer);
  }
  /// Recomputes the surface of a scan; the next changes include the result.
  restore(time: number): void {
    this.check(this.wasm.restore(time));
  }
  hash(): string {
    this.check(this.wasm.hash());
    return this.text();
  }
  pick(origin: number[], direction: number[], angle: number): Hit|null {
    this.writeNumbers([...origin, ...direction, angle]);
    this.check(this.wasm.pick());
    if (this.numbers(1)[0] === 0) return null;
    const n = this.numbers(14);
    return {
      stored: n.slice(1, 4),
      place: n.slice(4, 7),
      level: n[7],
      clusterLevel: n[8],
      clusterOrdinal: n[9],
      reach: n[10],
      expandable: n[11] === 255 ? null : {level: n[11], ordinal: n[12]},
      attributes: this.numbers(14 + n[13]).slice(14)
    };
  }
  /// Not available in the module for surfaces, nor is profile().
  probe(stored: number[], reach: number): Answer<Found|null> {
    this.writeNumbers([...stored, reach]);
    if (this.check(this.wasm.probe()) === MISSING) return {missing: this.missing()};
    if (this.numbers(1)[0] === 0) return {answer: null};
    const n = this.numbers(9);
    return {answer: {stored: n.slice(1, 4), place: n.slice(4, 7), level: n[7], attributes: this.numbers(9 + n[8]).slice(9)}};
  }
  /// Returns the profile between two stored places. `axis` is the upward coordinate.
  profile(from: number[], to: number[], axis: number): Answer<Profile> {
    this.writeNumbers([...from, ...to, axis]);
    if (this.check(this.wasm.profile()) === MISSING) return {missing: this.missing()};
    const [metres, level, sampled, count] = this.numbers(4), n = this.numbers(4 + 2 * count);
    const points = Array.from({length: count}, (_, i): [number, number] => [n[4 + 2 * i], n[5 + 2 * i]]);
    return {answer: {metres, level, sampled: sampled === 1, points}};
  }
  /// Returns the end slots of the lines around a cluster.
  outline(level: number, ordinal: number): Uint32Array {
    this.check(this.wasm.outline(level, ordinal));
    return Uint32Array.from(this.numbers(1 + 2 * this.numbers(1)[0]).slice(1));
  }
  /// 1 keeps a cluster expanded, 0 keeps it collapsed, -1 releases all pinned clusters.
  pin({level, ordinal}: Cluster, pin: number): void {
    this.check(this.wasm.pin(level, ordinal, pin));
  }

  private buffer(bytes: number): ArrayBuffer {
    const at = this.buffers.findIndex(buffer => buffer.byteLength >= bytes);
    if (at >= 0) return this.buffers.splice(at, 1)[0];
    this.buffers.shift();
    return new ArrayBuffer(Math.max(LEAST_BUFFER, 2 ** Math.ceil(Math.log2(bytes))));
  }
  private check(status: number): number {
    if (status === FAILED) throw new CoreError(this.text());
    return status;
  }
  private text(): string {
    return this.decoder.decode(new Uint8Array(this.wasm.memory.buffer, this.wasm.text(), this.wasm.text_size()));
  }
  private missing(): ByteRange[] {
    return this.text().split('\n').filter(line => line !== '').map(line => {
      const [file, offset, bytes] = line.split('\t');
      return {file, offset: Number(offset), bytes: Number(bytes)};
    });
  }
  private numbers(count: number): number[] {
    return Array.from(new Float64Array(this.wasm.memory.buffer, this.wasm.numbers(), count));
  }
  private write(name: string, bytes?: Uint8Array): number {
    const encoded = this.encoder.encode(name);
    const at = this.wasm.input(encoded.length + (bytes?.length ?? 0));
    const memory = new Uint8Array(this.wasm.memory.buffer);
    memory.set(encoded, at);
    if (bytes) memory.set(bytes, at + encoded.length);
    return encoded.length;
  }
  private writeNumbers(numbers: number[]): void {
    const at = this.wasm.input(8 * numbers.length);
    new Float64Array(this.wasm.memory.buffer, at, numbers.length).set(numbers);
  }
}
