// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/height_reference.hpp"

namespace terrace::terrain {

struct TileCheckRequest {
  std::string folder;
  /// The bound at the deepest zoom in metres, doubled at each zoom above. If not given, the bound
  /// in layer.json or, failing that, what globes expect at each zoom.
  std::optional<double> max_error{};
  /// The store of samples to compare heights with; null: heights are not compared.
  const stream::Store* store = nullptr;
  HeightReference vertical = HeightReference::recorded;  ///< reference of the store's heights
  std::string geoid{};                                   ///< the same as when the tiles were made
};

struct ZoomCheck {
  unsigned zoom = 0;
  std::uint64_t tiles = 0;      ///< existing files
  std::uint64_t samples = 0;    ///< in its tiles; samples on tile borders count in each tile
  std::uint64_t uncovered = 0;  ///< samples on no triangle, included in `samples`: they have no
                                ///< error
  double max_error = 0.0;       ///< in metres; 0 if there is none
};

struct TileCheckResult {
  std::vector<stream::Problem> problems;  ///< in layer.json, then by zoom, row, column
  std::uint64_t tiles = 0, samples = 0;
  std::uint64_t torn = 0;  ///< leftover temporary files of a killed run, which are harmless
  std::vector<ZoomCheck> zooms;
};

/// Whether `folder` contains a tile set, finished or not.
bool is_tile_folder(const std::string& folder);

/// Decodes and checks every tile of a set. Compares layer.json with the files, and the bytes of
/// each tile with the checksum in the journal, if there is one. Checks the mesh of each tile and
/// the sides that neighbours share, also across the antimeridian. If a store is given, compares the
/// heights with every sample. The result does not depend on the number of threads. Memory: the
/// borders of one row of tiles, and a tile and a part of its samples per thread; at least 176 MiB.
/// Throws: stream::Error if there is no set, layer.json cannot be read, the store is damaged or
/// memory does not suffice; UsageError as write_tiles(); stream::Stopped.
TileCheckResult check_tiles(const TileCheckRequest& request, const Context& context = {});

}  // namespace terrace::terrain
