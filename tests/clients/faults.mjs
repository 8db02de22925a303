// SPDX-License-Identifier: GPL-3.0-or-later
// Faults of tile sets on servers, each of which a survey must find. A fault changes the response
// for a path of a set.

const zoomOf = path => /\.terrain$/.test(path) ? parseInt(path) : undefined;

/// The faults by name. fault(set) returns what tile_server.mjs expects; at least one complaint of
/// the survey must match `complaint`. of: the set, by default the plain one.
export const FAULTS = {
  'the deepest zoom is listed and missing': {
    drawn: true,
    complaint: /is (not drawn|drawn from its parent)/,
    fault: set => path => zoomOf(path) === set.deepest ? {status: 404} : {},
  },
  'tiles of the deepest zoom are truncated': {
    drawn: true,
    complaint: /is (not drawn|drawn from its parent)/,
    fault: set => (path, bytes) => zoomOf(path) === set.deepest ?
        {bytes: bytes.subarray(0, bytes.length * 0.7), encoding: undefined} :
        {},
  },
  'compressed tiles are sent without Content-Encoding': {
    of: 'extended',
    complaint: /sampleTerrainMostDetailed/,
    fault: () => () => ({encoding: undefined}),
  },
  'layer.json is missing': {
    complaint: /sampleTerrainMostDetailed/,
    fault: () => path => path === 'layer.json' ? {status: 404} : {},
  },
  'layer.json lists no available tiles': {
    complaint: /sampleTerrainMostDetailed/,
    fault: () => (path, bytes) => {
      if (path !== 'layer.json') return {};
      const {available, ...rest} = JSON.parse(bytes);
      return {bytes: Buffer.from(JSON.stringify(rest))};
    },
  },
  'heights are a metre off': {
    complaint: /^height .* off by/,
    fault: set => (path, bytes) => {
      if (zoomOf(path) !== set.deepest) return {};
      const higher = Buffer.from(bytes);
      for (const at of [24, 28]) higher.writeFloatLE(higher.readFloatLE(at) + 1, at);
      return {bytes: higher};
    },
  },
  'every other tile is a metre too high': {
    complaint: /^a gap of/,
    fault: set => (path, bytes) => {
      const [z, x, y] = path.split(/[/.]/).map(Number);
      if (z !== set.deepest || (x + y) % 2) return {};
      const higher = Buffer.from(bytes);
      for (const at of [24, 28]) higher.writeFloatLE(higher.readFloatLE(at) + 1, at);
      return {bytes: higher};
    },
  },
  'metadata omits the deepest zoom': {
    of: 'metadata',
    complaint: /^height .* off by/,
    fault: set => (path, bytes) => {
      if (zoomOf(path) !== set.deepest - 1) return {};
      const at = bytes.lastIndexOf('{"available"');
      const nothing = Buffer.from('{"available":[[]]}'.padEnd(bytes.length - at));
      return {bytes: Buffer.concat([bytes.subarray(0, at), nothing])};
    },
  },
};
