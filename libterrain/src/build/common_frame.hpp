// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

/// The stored coordinates that points of different origin have in one store.

namespace terrace::terrain {

/// Points that share a store with others: those of a store, or of a source.
struct FramedPoints {
  stream::StoreSchema schema;
  stream::Box3 bounds;  ///< in stored coordinates; empty if unknown
  std::string name;     ///< in messages
};

[[nodiscard]] FramedPoints framed_points(const stream::Store& store);

struct CommonFrame {
  /// The first one's, with the columns and rows of all rasters, the cells without data of all, and
  /// the formats of all.
  stream::StoreSchema schema;
  /// What to add to the stored coordinates of each, in their order.
  std::vector<std::array<std::int64_t, 3>> shifts;
};

/// Returns the frame of points that have the same meaning, were clustered with the same options
/// except the seed, and are on one lattice. Throws: stream::Error that names two of them otherwise.
[[nodiscard]] CommonFrame common_frame(std::span<const FramedPoints> points);

/// The error of two of them that do not fit together.
[[nodiscard]] stream::Error misfit(const std::string& first, const std::string& second,
                                   const std::string& cause);

}  // namespace terrace::terrain
