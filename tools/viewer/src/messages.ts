// SPDX-License-Identifier: GPL-3.0-or-later
/// What the page and the worker tell each other.

import type {Camera, Changes, Found, Hit, Opened, Profile, State} from './core';
import type {Stats} from './ranges';
import type {Listed, Manifest} from './store';

export type ToWorker =
    /// base: the URL of a published folder; query: of the URLs of its stores, with the token of "terrace view";
    /// name: of a store in it. choose: stores.json is read, and if it does not have the name, its first store is opened.
    |{type: 'open', base: string, query: string, name: string, choose: boolean, asPoints: boolean, maxPoints: number}
    |{type: 'show', asPoints: boolean}  ///< how to show a scan
    |{type: 'view', camera: Camera, serial: number}
    |{type: 'drawn', buffer: ArrayBuffer}  ///< of the changes of a frame
    |{type: 'pick', id: number, origin: number[], direction: number[], angle: number}
    |{type: 'pin', how: number}
    /// Answered from the store, whose missing bytes are fetched. A profile replaces one that waits.
    |{type: 'probe', id: number, stored: number[], reach: number}
    |{type: 'profile', id: number, from: number[], to: number[], axis: number}
    |{type: 'outline', level: number, ordinal: number}
    |{type: 'hash', id: number}
    |{type: 'retry'};

export type FromWorker =
    |{type: 'started'}  ///< on the way to what is to be opened
    |{type: 'chosen', stores: Listed[], name: string}  ///< from stores.json
    |{type: 'progress', bytes: number}
    |{type: 'opened', manifest: Manifest, scene: Opened, heightUnit: number}  ///< heightUnit: of the store, in metres
    |{type: 'frame', serial: number, state: State, changes: Changes, stats: Stats, milliseconds: number, loading: boolean, time: number}
    |{type: 'picked', id: number, hit: Hit|null}
    |{type: 'probed', id: number, found: Found|null}
    |{type: 'profiled', id: number, profile: Profile}
    |{type: 'classes', classes: number[]}  ///< more have come
    |{type: 'outlined', lines: Uint32Array}
    |{type: 'hashed', id: number, hash: string}
    |{type: 'failed', message: string};
