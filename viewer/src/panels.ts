// SPDX-License-Identifier: GPL-3.0-or-later
/// The panel of settings with the legend, and the line at the bottom.

import {bold, element, make, touch} from './page';
import {classColour, GREYS, gradient, heightStops, LEVELS, SLOPE, type Stop} from './ramps';
import {type Colour, COLOURS, FOLLOW} from './render';
import type {Scene} from './scene';
import {CLASSES, count, readable} from './text';

const counted = (n: number, what: string) => [bold(count(n)), ` ${what}${n === 1 ? '' : 's'}`];

/// What changes of the settings cause, apart from drawing.
export interface Effects {
  showAsPoints(points: boolean): void;
  turnUpright(): void;  ///< the upward axis of a scan has changed
  exaggerate(): void;    ///< the wanted exaggeration has changed
  picture(): void;       ///< saves what is shown
  writeLink(): void;
}

const COMPASS = ['north', 'north-east', 'east', 'south-east', 'south', 'south-west', 'west', 'north-west'];
const LIGHT_STEP = 15;

export class Panels {
  constructor(private readonly scene: Scene, private readonly effects: Effects) {
    this.bind();
  }

  /// Shows the settings that apply to the store.
  opened(): void {
    const {scene} = this;
    element<HTMLInputElement>('level').max = String(scene.top);
    element('with-level').hidden = scene.top < 1;
    element('with-wire').hidden = scene.kind === 'points';
    element('with-size').hidden = element('with-gaps').hidden = element('with-shading').hidden = scene.kind !== 'points';
    element('relief').hidden = scene.scan;
    element('with-light').hidden = element('with-elevation').hidden = scene.kind !== 'raster';
    element('as').hidden = element('upright').hidden = !scene.scan;
    element('keys').textContent = touch ?
        `Drag to ${scene.scan ? 'turn; with two fingers move and zoom' : 'move; with two fingers zoom, turn and tilt'}; tap for a point.` :
        `Drag to ${scene.scan ? 'turn' : 'move'}, right-drag or Ctrl-drag to ${scene.scan ? 'move' : 'turn'}, wheel to zoom, click for a point.`;
    element('keyboard').hidden = touch;
    for (const colour of COLOURS) element(`by-${colour}`).hidden = !scene.offers(colour);
    this.show();
  }
  /// Shows the values of the settings.
  show(): void {
    const {scene} = this;
    for (const input of document.querySelectorAll<HTMLInputElement>('input[name=colour]')) {
      input.checked = input.value === scene.look.colour;
    }
    element<HTMLInputElement>('wire').checked = scene.look.wire;
    element<HTMLInputElement>(scene.asPoints ? 'as-points' : 'as-surface').checked = true;
    element<HTMLInputElement>(scene.camera.yUp ? 'up-y' : 'up-z').checked = true;
    const {look} = scene, [from, elevation] = look.light;
    element<HTMLInputElement>('gaps').checked = look.fillGaps;
    element<HTMLInputElement>('shading').checked = look.depthShading;
    element<HTMLInputElement>('exaggeration').value = String(scene.exaggeration);
    element('exaggeration-text').textContent = `× ${scene.exaggeration}`;
    element<HTMLInputElement>('light').value = String(from === FOLLOW ? -LIGHT_STEP : from);
    element('light-text').textContent = from === FOLLOW ? 'the upper left' : from % 45 === 0 ? `the ${COMPASS[from / 45]}` : `${from}°`;
    element<HTMLInputElement>('elevation').value = String(elevation);
    element('elevation-text').textContent = `${elevation}°`;
    element<HTMLInputElement>('size').value = String(scene.look.pointSize);
    element<HTMLInputElement>('detail').value = String(4 - Math.log2(scene.error));
    element('detail-text').textContent = `within ${scene.error} px`;
    element<HTMLInputElement>('level').value = String(scene.level > scene.top ? 0 : scene.top - scene.level);
    element('level-text').textContent = scene.level >= scene.top ? 'the top' : `level ${scene.level}`;
    this.legend();
  }
  setDark(dark: boolean): void {
    this.scene.look.dark = dark;
    document.documentElement.classList.toggle('dark', dark);
    element('theme').textContent = dark ? 'Light' : 'Dark';
    this.scene.redraw = true;
  }
  legend(): void {
    const {scene} = this;
    if (!scene.manifest) return;
    const colour = scene.look.colour;
    const ramps: Partial<Record<Colour, Stop[]>> =
        {height: scene.scan ? heightStops(0, 1) : heightStops(scene.box[2], scene.box[5]), slope: SLOPE, level: LEVELS, intensity: GREYS};
    const ramp = ramps[colour];
    element('legend').hidden = !ramp;
    element('classes').hidden = colour !== 'class' && scene.look.hidden.size === 0;
    element('classes').replaceChildren(...scene.colours.classes.map(group => {
      const swatch = make('i', ''), box = document.createElement('input');
      swatch.style.background = `rgb(${classColour(group).join(' ')})`;
      box.type = 'checkbox';
      box.checked = !scene.look.hidden.has(group);
      box.addEventListener('change', () => {
        if (box.checked) {
          scene.look.hidden.delete(group);
        } else {
          scene.look.hidden.add(group);
        }
        scene.redraw = true;
        this.effects.writeLink();
      });
      return make('li', '', make('label', '', box, swatch, `${group} ${CLASSES[group] ?? ''}`));
    }));
    if (!ramp) return;
    const texts: Partial<Record<Colour, [string, string]>> = {
      height: scene.scan ? ['low', 'high'] : [scene.height(scene.box[2]), scene.height(scene.box[5])],
      slope: ['0°', '60°'],
      level: ['coarse', 'fine'],
      intensity: ['weak', 'strong']
    };
    [element('legend-low').textContent, element('legend-high').textContent] = texts[colour]!;
    element('legend-ramp').style.background = gradient(ramp);
  }
  /// Shows what is drawn; `frameTime` in milliseconds.
  status(frameTime: number): void {
    const {scene} = this, s = scene.status;
    if (!s) return;
    const what = scene.manifest?.parameters.find(({name}) => name === 'entities')?.value.replace(/s$/, '');
    const parts = what ? [...counted(s.state.points, what), ', the first corner of each'] : counted(s.state.points, 'point');
    if (scene.kind !== 'points') parts.push(' · ', ...counted(s.state.triangles, 'triangle'));
    parts.push(make('span', 'wide', ' · ', bold(readable(s.stats.bytes)), ' · ', ...counted(s.stats.requests, 'request'), ' · ', bold(frameTime.toFixed(0)), ' ms a frame'));
    const [brief, whole] = !scene.complete ? ['refining', ''] : s.state.worst > 1 ? ['full', 'as fine as memory allows'] : ['done', 'detail as requested'];
    parts.push(' · ', ...(whole ? [make('span', 'wide', whole), make('span', 'brief', brief)] : [brief]));
    element('status').replaceChildren(...parts);
  }

  private bind(): void {
    const {scene, effects} = this;
    const looks = () => {
      scene.redraw = true;
      this.legend();
      effects.writeLink();
    };
    for (const input of document.querySelectorAll<HTMLInputElement>('input[name=colour]')) {
      input.addEventListener('change', () => {
        scene.look.colour = input.value as Colour;
        looks();
      });
    }
    element('wire').addEventListener('change', event => {
      scene.look.wire = (event.target as HTMLInputElement).checked;
      looks();
    });
    for (const points of [false, true]) {
      element(points ? 'as-points' : 'as-surface').addEventListener('change', () => effects.showAsPoints(points));
    }
    for (const yUp of [false, true]) {
      element(yUp ? 'up-y' : 'up-z').addEventListener('change', () => {
        scene.camera.yUp = yUp;
        scene.fit();
        effects.turnUpright();
        this.legend();
      });
    }
    element('detail').addEventListener('input', event => {
      scene.errorChosen = true;
      scene.error = Math.round(100 * 2 ** (4 - Number((event.target as HTMLInputElement).value))) / 100;
      this.show();
      scene.moved = true;
    });
    element('level').addEventListener('input', event => {
      const value = Number((event.target as HTMLInputElement).value);
      scene.level = value === 0 ? 255 : scene.top - value;
      this.show();
      scene.moved = true;
    });
    element('size').addEventListener('input', event => {
      scene.setSize(Number((event.target as HTMLInputElement).value));
      looks();
    });
    for (const [id, set] of [['gaps', 'fillGaps'], ['shading', 'depthShading']] as const) {
      element(id).addEventListener('change', event => {
        scene.look[set] = (event.target as HTMLInputElement).checked;
        looks();
      });
    }
    element('exaggeration').addEventListener('input', event => {
      scene.exaggeration = Number((event.target as HTMLInputElement).value);
      this.show();
      effects.exaggerate();
    });
    const light = () => {
      const [from, elevation] = ['light', 'elevation'].map(id => Number(element<HTMLInputElement>(id).value));
      scene.look.light = [from < 0 ? FOLLOW : from, elevation];
      this.show();
      looks();
    };
    element('light').addEventListener('input', light);
    element('elevation').addEventListener('input', light);
    element('full').hidden = !document.fullscreenEnabled;
    element('full').addEventListener('click', () => {
      void (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());
    });
    document.addEventListener('fullscreenchange', () => {
      element('full').textContent = document.fullscreenElement ? 'Leave full screen' : 'Full screen';
    });
    element('save').addEventListener('click', () => effects.picture());
    element('fit').addEventListener('click', () => scene.fit());
    element('theme').addEventListener('click', () => this.setDark(!scene.look.dark));
    element('link').addEventListener('click', () => {
      effects.writeLink();
      void navigator.clipboard?.writeText(location.href);
      element('link').textContent = 'Copied';
      setTimeout(() => element('link').textContent = 'Copy link', 1500);
    });
    element('menu').addEventListener('click', () => {
      const open = element('tools').classList.toggle('open');
      element('menu').setAttribute('aria-expanded', String(open));
    });
  }
}
