// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tile/format/tile_address.hpp"

namespace terrace::terrain {

/// What layer.json, the description of a tile set, says.
struct TileLayer {
  std::string name;
  GeographicBox bounds;
  unsigned first_zoom = 0, last_zoom = 0;
  /// Extensions that every tile has: "octvertexnormals", "watermask", "metadata".
  std::vector<std::string> extensions;
  /// Per zoom from 0 on: the tiles that are there.
  std::vector<std::vector<TileRange>> available;
  /// The bound in metres that the tiles of a zoom keep, per zoom from 0 on; of zooms without tiles
  /// 0.
  std::vector<double> max_errors;
  /// What made the tiles what they are: two runs with equal text make equal tiles.
  std::string fingerprint;
};

/// The largest rectangles of present tiles, found row by row: covers exactly the given ones.
/// tiles: of one zoom, sorted by y, then x, without repetition.
std::vector<TileRange> ranges_of(const std::vector<TileAddress>& tiles);

/// The text of layer.json, in the order in which its keys are documented.
std::string layer_json(const TileLayer& layer);

/// Reads it back. Throws: stream::Error naming the file and what is missing or wrong.
TileLayer read_layer(const std::string& path);

}  // namespace terrace::terrain
