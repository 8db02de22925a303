// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tile/format/address.hpp"

namespace terrace::terrain {

/// The contents of layer.json, the description of a tile set.
struct TileLayer {
  std::string name;
  GeographicBox bounds;
  unsigned first_zoom = 0, last_zoom = 0;
  /// The extensions that every tile has: "octvertexnormals", "watermask", "metadata".
  std::vector<std::string> extensions;
  /// The existing tiles per zoom, from 0 on.
  std::vector<std::vector<TileRange>> available;
  /// The error bound in metres, per zoom from 0 on; 0 for zooms without tiles.
  std::vector<double> max_errors;
  /// Identifies the store and the options: two runs with equal fingerprints make equal tiles.
  std::string fingerprint;
};

/// Merges tiles into large rectangles, row by row, that cover exactly the given tiles. tiles: of
/// one zoom, sorted by y, then x, without duplicates.
std::vector<TileRange> ranges_of(const std::vector<TileAddress>& tiles);

/// Returns the text of layer.json, with keys in documented order.
std::string layer_json(const TileLayer& layer);

/// Reads layer.json. Throws: stream::Error naming the file and what is missing or wrong.
TileLayer read_layer(const std::string& path);

}  // namespace terrace::terrain
