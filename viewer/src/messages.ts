// SPDX-License-Identifier: GPL-3.0-or-later
/// Messages between the page and the worker.

import type {Camera, Changes, Cluster, Found, Hit, Opened, Profile, State} from './core';
import type {Stats} from './ranges';
import type {Listed, Manifest} from './store';

export type ToWorker =
    /// base: URL of a published folder. query: appended to the URLs of its stores, with the token of "terrace view".
    /// name: a store in it. choose: reads stores.json, and opens its first store if it does not list the name.
    /// exaggeration: as below.
    |{type: 'open', base: string, query: string, name: string, choose: boolean, asPoints: boolean, exaggeration: number, maxPoints: number}
    |{type: 'show', asPoints: boolean}  ///< how to show a scan
    /// Opens the store again with its heights multiplied in the view frame. A scan ignores it.
    |{type: 'exaggerate', exaggeration: number}
    |{type: 'view', camera: Camera, serial: number}
    |{type: 'drawn', buffer: ArrayBuffer}  ///< returns the buffer of a frame's changes
    |{type: 'pick', id: number, origin: number[], direction: number[], angle: number}
    |{type: 'pin', cluster: Cluster, pin: number}  ///< as Core.pin() takes it
    /// Answered from the store, after fetching missing bytes. A profile replaces a waiting one.
    |{type: 'probe', id: number, stored: number[], reach: number}
    |{type: 'profile', id: number, from: number[], to: number[], axis: number}
    |{type: 'outline', level: number, ordinal: number}
    |{type: 'hash', id: number}
    |{type: 'retry'};

export type FromWorker =
    |{type: 'started'}  ///< the start file is on its way
    |{type: 'chosen', stores: Listed[], name: string}  ///< chosen from stores.json
    |{type: 'progress', bytes: number}
    /// ground: the linear map from stored coordinates to the view frame, with the exaggeration.
    |{type: 'opened', manifest: Manifest, scene: Opened, ground: number[], exaggeration: number}
    /// loading: a later frame will show more, or the surface of a scan as it is without its history.
    |{type: 'frame', serial: number, state: State, changes: Changes, stats: Stats, milliseconds: number, loading: boolean, time: number}
    |{type: 'picked', id: number, hit: Hit|null}
    |{type: 'probed', id: number, found: Found|null}
    |{type: 'profiled', id: number, profile: Profile}
    |{type: 'classes', classes: number[]}  ///< more classes were found
    |{type: 'outlined', lines: Uint32Array}
    |{type: 'hashed', id: number, hash: string}
    |{type: 'failed', message: string};
