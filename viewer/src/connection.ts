// SPDX-License-Identifier: GPL-3.0-or-later
/// The worker that reads the open store.

import type {Found, Hit, Profile} from './core';
import type {FromWorker, ToWorker} from './messages';
import {fail, phone} from './page';

/// Maximum number of points drawn. Phones can draw fewer without effort.
const MOST_POINTS = phone.matches ? 400_000 : 1_500_000;
/// The token of "terrace view", for the stores; published folders need none.
const TOKEN = new URLSearchParams(location.search).get('token');

export const NO_WORKER = 'The viewer\'s worker cannot be loaded. Reload the page.';

/// Starts a worker, which starts fetching a store. `choose` is as in ToWorker.
export function launch(name: string, choose: boolean, asPoints: boolean, exaggeration: number): Worker {
  const worker = new Worker('worker.js'), base = new URL('.', document.baseURI).href;
  const query = TOKEN === null ? '' : `?token=${encodeURIComponent(TOKEN)}`;
  worker.postMessage({type: 'open', base, query, name, choose, asPoints, exaggeration, maxPoints: MOST_POINTS} satisfies ToWorker);
  return worker;
}

export class Connection {
  private worker: Worker|null = null;
  private next = 0;
  private waiting = new Map<number, (answer: never) => void>();  ///< for answers

  /// `receive` gets the messages that are not answers.
  constructor(private readonly receive: (message: FromWorker) => void) {}

  /// Replaces the worker. Questions to the previous one stay without answers.
  use(worker: Worker): void {
    this.close();
    this.worker = worker;
    worker.onmessage = event => this.dispatch(event.data as FromWorker);
    worker.onerror = event => fail(event.message || NO_WORKER);
  }
  close(): void {
    this.worker?.terminate();
    this.worker = null;
    this.waiting.clear();
  }
  send(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker?.postMessage(message, transfer);
  }
  pick(origin: number[], direction: number[], angle: number): Promise<Hit|null> {
    return this.ask(id => ({type: 'pick', id, origin, direction, angle}));
  }
  probe(stored: number[], reach: number): Promise<Found|null> {
    return this.ask(id => ({type: 'probe', id, stored, reach}));
  }
  /// A profile replaces a waiting one, which stays without an answer.
  profile(from: number[], to: number[], axis: number): Promise<Profile> {
    return this.ask(id => ({type: 'profile', id, from, to, axis}));
  }
  hash(): Promise<string> {
    return this.ask(id => ({type: 'hash', id}));
  }

  private ask<T>(question: (id: number) => ToWorker): Promise<T> {
    return new Promise(resolve => {
      const id = ++this.next;
      this.waiting.set(id, resolve);
      this.send(question(id));
    });
  }
  private dispatch(message: FromWorker): void {
    switch (message.type) {
      case 'picked':
        return this.answer(message.id, message.hit);
      case 'probed':
        return this.answer(message.id, message.found);
      case 'profiled':
        return this.answer(message.id, message.profile);
      case 'hashed':
        return this.answer(message.id, message.hash);
      default:
        this.receive(message);
    }
  }
  private answer(id: number, answer: unknown): void {
    this.waiting.get(id)?.(answer as never);
    this.waiting.delete(id);
  }
}
