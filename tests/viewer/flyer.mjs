// SPDX-License-Identifier: GPL-3.0-or-later
// Drives the viewer's worker: sends views, waits for answers, flies. It has no imports, so it runs in node and in a page.

/// Sends messages to a worker and waits for its answers.
export class Flyer {
  /// connect(receive): starts worker.js and returns {send(message)}; `receive` takes its messages.
  /// base: the URL of a published folder. name: a store in it. choose: as in messages.ts.
  constructor(connect, base, name, {maxPoints = 1_500_000, asPoints = false, choose = false, exaggeration = 1, receive = () => {}} = {}) {
    this.serial = 0;
    this.waiting = [];
    this.last = null;  ///< frame
    this.worker = connect(message => {
      if (message.type === 'frame') this.last = message;
      receive(message);
      this.waiting = this.waiting.filter(wait => !wait(message));
    });
    this.worker.send({
      type: 'open',
      base,
      query: '',
      name,
      choose,
      asPoints,
      exaggeration,
      maxPoints
    });
  }
  /// Resolves to the next message that fits.
  until(fits, seconds = 120) {
    return new Promise((resolve, reject) => {
      const timer =
          setTimeout(() => reject(new Error(`timed out waiting for a message; last frame: ${JSON.stringify(this.last?.state)}`)), seconds * 1000);
      this.waiting.push(message => {
        if (!fits(message)) return false;
        clearTimeout(timer);
        resolve(message);
        return true;
      });
    });
  }
  opened() {
    return this.until(message => message.type === 'opened');
  }
  /// Sends a view and waits for its first frame or, if `settled`, for the frame after which nothing
  /// changes.
  view(camera, settled = true) {
    const serial = ++this.serial;
    const done = this.until(m => m.type === 'frame' && m.serial === serial && (!settled || m.state.settled));
    this.worker.send({type: 'view', serial, camera});
    return done;
  }
}

const FOV = 45;
const HALF = Math.tan(FOV / 2 * Math.PI / 180);
const picture = {fov: FOV, aspect: 1.6, height: 1000, up: [0, 1, 0]};
const sizeOf = box => Math.hypot(box[3] - box[0], box[4] - box[1]);
const middleOf = box => [(box[0] + box[3]) / 2, (box[1] + box[4]) / 2];

/// Milliseconds between the pictures of a flight.
const PICTURE = 1000 / 60;

/// Flies level over the centre, looking ahead and down, back and forth. Each picture is 1/60 s
/// after the previous one and moves by 0.25 % of its width. Without `error`, trial flights find the
/// error at which `points` points are kept on average. Returns the milliseconds of the worker's
/// frames, the mean number of points, and the error in pixels.
export async function cruise(connect, base, name, points, frames, error) {
  let milliseconds = [];
  const flyer = new Flyer(connect, base, name, {
    receive: message => {
      if (message.type === 'frame') milliseconds.push(message.milliseconds);
    }
  });
  const {scene: {box}} = await flyer.opened();
  const size = sizeOf(box), middle = middleOf(box);
  const view = (share, error) => ({
    ...picture,
    eye: [middle[0] + share * size, middle[1] - 0.12 * size, box[5] + 0.12 * size],
    direction: [0, Math.SQRT1_2, -Math.SQRT1_2],
    error
  });
  const step = 0.0025 * 1.6 * 0.24 * HALF, turn = Math.min(200, frames / 2);
  const fly = async error => {
    await flyer.view(view(-0.2, error));
    milliseconds = [];
    let mean = 0;
    for (let i = 0, due = performance.now(); i < frames; ++i) {
      const steps = Math.min(i % (2 * turn), 2 * turn - i % (2 * turn));
      mean += (await flyer.view(view(-0.2 + step * steps, error), false)).state.points / frames;
      due = Math.max(due + PICTURE, performance.now());
      await new Promise(resume => setTimeout(resume, due - performance.now()));
    }
    return mean;
  };
  if (error) {
    await fly(error);  // compiles all code first
    return {points: Math.round(await fly(error)), milliseconds, error};
  }
  error = 64;
  let there = 0;
  while (there < points && error > 0.25) {
    error /= 1.05;
    there = (await flyer.view(view(-0.2, error))).state.points;
  }
  let mean = await fly(error);
  for (let trial = 0; trial < 5 && Math.abs(mean / points - 1.01) > 0.01; ++trial) {
    error *= Math.sqrt(mean / (1.01 * points));
    mean = await fly(error);
  }
  return {milliseconds, points: Math.round(mean), error};
}

/// Flies from above the whole store down to full detail of a part in 60 frames of at least `pace` milliseconds each. The last
/// picture is `share` of the box high. `time`: a VirtualTime, in which the flight then takes place. Returns the state and
/// statistics of the last frame, and the seconds from the last view to it.
export async function dive(connect, base, name, share, pace = 0, time = null) {
  const flyer = new Flyer(connect, base, name);
  const {scene: {box}} = await flyer.opened();
  const middle = middleOf(box), from = 1.2 * sizeOf(box), to = share * (box[4] - box[1]) / (2 * HALF);
  const now = () => time ? time.time : performance.now();
  let begin = 0;
  const fly = async () => {
    for (let i = 0; i <= 60; ++i) {
      const above = from * (to / from) ** (i / 60), paced = new Promise(resume => (time ?? globalThis).setTimeout(resume, pace));
      begin = now();
      await flyer.view(
          {...picture, eye: [...middle, box[5] + above], direction: [0, 0, -1], error: i < 60 ? 4 : 0.01}, i === 60);
      if (i < 60) await paced;
    }
  };
  await (time ? time.run(fly()) : fly());
  const {state, stats} = flyer.last;
  return {state, stats, seconds: (now() - begin) / 1000};
}

/// The `share` of dive() at which about this many points of a square raster are in the last picture.
export const shareOf = (points, all) => Math.min(1, Math.sqrt(points / all / picture.aspect));
