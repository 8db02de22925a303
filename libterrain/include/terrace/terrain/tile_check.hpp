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
  /// The bound at the deepest zoom, metres, twice as much at each zoom above; without, what
  /// layer.json states, or else what globes expect of each zoom.
  std::optional<double> max_error{};
  /// Where the samples come from with which heights are compared; without, they are not.
  const stream::Store* store = nullptr;
  HeightReference vertical = HeightReference::recorded;  ///< of the store
  std::string geoid{};                                   ///< as the tiles were made with
};

struct ZoomCheck {
  unsigned zoom = 0;
  std::uint64_t tiles = 0;      ///< existing files
  std::uint64_t samples = 0;    ///< in its tiles; those on borders of tiles in each of them
  std::uint64_t uncovered = 0;  ///< of these, those on no triangle: they have no error
  double max_error = 0.0;       ///< metres; 0 if none was measured
};

struct TileCheckResult {
  std::vector<stream::Problem> problems;  ///< of layer.json, then by zoom, row, column
  std::uint64_t tiles = 0, samples = 0;
  std::uint64_t torn = 0;  ///< temporary files of a killed run: harmless
  std::vector<ZoomCheck> zooms;
};

/// Whether `folder` holds a tile set, finished or not.
bool is_tile_folder(const std::string& folder);

/// Decodes and checks every tile of a set: layer.json against the files, each tile's bytes and
/// mesh by itself, its bytes against the checksum in the journal where there is one, the sides that
/// neighbours share, across the antimeridian too, and the heights against every sample of
/// the store if one is given. The result does not depend on the number of threads. Memory: of one
/// row of tiles' borders, and of a tile and a part of its samples per thread; at least 176 MiB.
/// Throws: stream::Error if there is no set, layer.json cannot be read, the store is damaged or the
/// memory does not suffice; UsageError as write_tiles(); stream::Stopped.
TileCheckResult check_tiles(const TileCheckRequest& request, const Context& context = {});

}  // namespace terrace::terrain
