// SPDX-License-Identifier: GPL-3.0-or-later
/// Pointers, wheel and keys over the picture.

import type {Places} from './place';
import type {Scene} from './scene';

/// Seconds in which a key makes a step, and after which a held key makes further ones at this pace.
const STEP_SECONDS = 0.15, HOLD_SECONDS = 0.25;
const reducedMotion = matchMedia('(prefers-reduced-motion: reduce)');

interface HeldKey {
  act: (steps: number) => void;
  zooms: boolean;
  pressed: number;        ///< time
  released: number|null;  ///< time; null while it is down
  made: number;           ///< steps so far; negative if earlier ones are left
}

/// Returns the steps of a key that has been down for this long.
function stepsAfter(seconds: number): number {
  return seconds < HOLD_SECONDS ? Math.min(1, seconds / STEP_SECONDS) : 1 + (seconds - HOLD_SECONDS) / STEP_SECONDS;
}
/// Returns the steps of a key until `now`. A short press makes a whole one.
function wanted({pressed, released}: HeldKey, now: number): number {
  return released === null ? stepsAfter(now - pressed) : Math.max(1, stepsAfter(released - pressed));
}

export class Input {
  private held = new Map<string, HeldKey>();
  private pointer: [number, number] = [0, 0];  ///< position over the picture, or its middle

  /// `change` is called after each change of the camera, with whether the user zoomed.
  constructor(private readonly scene: Scene, private readonly places: Places, private readonly change: (zoomed: boolean) => void) {
    this.bindPointers();
    scene.canvas.addEventListener('keydown', event => this.key(event));
    scene.canvas.addEventListener('keyup', event => this.letGo(event.key.toLowerCase()));
    scene.canvas.addEventListener('blur', () => [...this.held.keys()].forEach(key => this.letGo(key)));
  }
  /// Whether a key moves the camera.
  get moving(): boolean {
    return this.held.size > 0;
  }
  /// Moves the camera by the keys that are held, or were pressed. `seconds` have passed since the last call.
  move(seconds: number): void {
    if (this.held.size === 0) return;
    const {now} = this.scene;
    let zoomed = false;
    for (const [name, key] of this.held) {
      const left = wanted(key, now) - key.made, steps = Math.min(left, seconds / STEP_SECONDS);
      key.act(steps);
      key.made += steps;
      zoomed ||= key.zooms;
      if (key.released !== null && steps === left) this.held.delete(name);
    }
    this.change(zoomed);
  }
  private letGo(name: string): void {
    const key = this.held.get(name);
    if (key) key.released ??= this.scene.now;
  }

  private bindPointers(): void {
    const {scene, places} = this, {canvas, camera} = scene;
    const pointers = new Map<number, {x: number, y: number}>();
    let travelled = 0, turning = false;
    canvas.addEventListener('contextmenu', event => event.preventDefault());
    canvas.addEventListener('pointerdown', event => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
      turning = (event.button === 2 || event.button === 1 || event.ctrlKey || event.shiftKey) !== scene.scan;
      travelled = pointers.size > 1 ? 1e9 : 0;
    });
    canvas.addEventListener('pointermove', event => {
      this.pointer = scene.at(event);
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
        camera.zoom(before / Math.max(after, 1), ...scene.at(middle), scene.aspect);
        const degrees = (turn * 180 / Math.PI + 540) % 360 - 180;
        if (scene.scan) {
          camera.pan(dx / 2, dy / 2, canvas.clientHeight);
        } else {
          camera.orbit(-degrees, 0);
          camera.pan(dx / 2, 0, canvas.clientHeight);
          camera.orbit(0, dy * 0.08);
        }
      } else if (turning && travelled > 4) {
        camera.orbit(dx * 0.3, dy * 0.25);
      } else if (travelled > 4) {
        camera.pan(dx, dy, canvas.clientHeight);
      }
      last.x = event.clientX;
      last.y = event.clientY;
      if (travelled > 4) this.change(pointers.size === 2);
    });
    const up = (event: PointerEvent) => {
      pointers.delete(event.pointerId);
      if (event.type === 'pointerup' && travelled <= 4 && pointers.size === 0 && turning === scene.scan && scene.manifest) {
        void places.click(...scene.at(event));
      }
    };
    canvas.addEventListener('pointerup', up);
    canvas.addEventListener('pointerleave', () => this.pointer = [0, 0]);
    canvas.addEventListener('pointercancel', up);
    canvas.addEventListener('wheel', event => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      camera.zoom(Math.exp(Math.max(-240, Math.min(240, event.deltaY * lines)) * 0.0016), ...scene.at(event), scene.aspect);
      this.change(true);
    }, {passive: false});
    canvas.addEventListener('dblclick', event => {
      camera.zoom(0.5, ...scene.at(event), scene.aspect);
      this.change(true);
    });
  }
  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const {scene, places} = this, {camera} = scene, name = event.key.toLowerCase();
    const pixels = event.shiftKey ? 180 : 60, height = scene.canvas.clientHeight;
    const moves: Record<string, (steps: number) => void> = {
      arrowleft: steps => camera.pan(steps * pixels, 0, height),
      arrowright: steps => camera.pan(-steps * pixels, 0, height),
      arrowup: steps => camera.pan(0, steps * pixels, height),
      arrowdown: steps => camera.pan(0, -steps * pixels, height),
      '+': steps => camera.zoom(0.8 ** steps, 0, 0, scene.aspect),
      '=': steps => camera.zoom(0.8 ** steps, 0, 0, scene.aspect),
      '-': steps => camera.zoom(1.25 ** steps, 0, 0, scene.aspect),
      q: steps => camera.orbit(-6 * steps, 0),
      e: steps => camera.orbit(6 * steps, 0),
      r: steps => camera.orbit(0, 4 * steps),
      f: steps => camera.orbit(0, -4 * steps)
    };
    const acts: Record<string, () => void> = {
      x: () => void places.pin(...this.pointer, 1),
      c: () => void places.pin(...this.pointer, 0),
      v: () => places.release(),
      home: () => scene.fit(),
      escape: () => places.close(),
      enter: () => void places.click(0, 0)
    };
    const move = moves[name];
    if (!move && !acts[name]) return;
    event.preventDefault();
    if (!move) {
      acts[name]();
    } else if (reducedMotion.matches) {
      move(1);
      this.change('+=-'.includes(name));
    } else if (!event.repeat) {
      const {now} = scene, last = this.held.get(name), left = last ? wanted(last, now) - last.made : 0;
      this.held.set(name, {act: move, zooms: '+=-'.includes(name), pressed: now, released: null, made: -left});
    }
  }
}
