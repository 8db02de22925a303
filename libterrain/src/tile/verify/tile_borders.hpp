// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tile/format/quantized_mesh.hpp"

namespace terrace::terrain {

/// Vertices on a side of a tile: place along it in units of the tile, and metres.
using BorderSide = std::vector<std::pair<std::uint16_t, double>>;

struct TileBorders {
  BorderSide west, south, east, north;
};
TileBorders borders_of(const TileMesh& mesh);

/// What is wrong between the sides of two neighbours; empty if they fit.
std::string misfit(const BorderSide& a, const BorderSide& b);

/// Decodes the bytes of a tile's file, compressed or not. Throws: stream::Error, with `name`.
DecodedTile unpack_tile(const std::vector<std::byte>& bytes, const std::string& name);

}  // namespace terrace::terrain
