// SPDX-License-Identifier: GPL-3.0-or-later
// Time for simulated flights that do not depend on the machine: only waiting and readings of the clock take time.

/// Milliseconds per reading of the clock, about the time of the work between two readings.
const READING = 0.03;

export class VirtualTime {
  constructor() {
    this.time = 0;
    this.events = [];  ///< ascending
    this.virtual = false;
    this.last = 0;
    this.performance = {now: () => this.time += READING};
    this.setTimeout = (work, delay = 0) => {
      if (!this.virtual) return setTimeout(work, delay);
      const event = {at: this.time + delay, work, id: `virtual ${++this.last}`};
      const place = this.events.findIndex(other => other.at > event.at);
      this.events.splice(place < 0 ? this.events.length : place, 0, event);
      return event.id;
    };
    this.clearTimeout = id => {
      clearTimeout(id);
      this.events = this.events.filter(event => event.id !== id);
    };
  }
  /// Time is virtual until the promise is fulfilled; before and afterwards, timers are real. Call it while no real timer
  /// runs that the work needs.
  async run(promise) {
    let done = false;
    promise.finally(() => done = true).catch(() => {});
    this.virtual = true;
    while (!done) {
      await new Promise(resume => setImmediate(resume));  // lets promises continue
      const event = this.events.shift();
      if (!event) continue;
      this.time = Math.max(this.time, event.at);
      event.work();
    }
    this.virtual = false;
    return promise;
  }
}
