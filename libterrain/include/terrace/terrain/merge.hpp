// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// The stores to join, and the store to make of them.
struct MergeRequest {
  std::vector<std::filesystem::path> stores{};  ///< at least two, in any order
  std::filesystem::path store{};                ///< the folder to create
  bool replace = false;
};

struct MergeOutcome {
  std::uint64_t points = 0;
  std::size_t segments = 0;        ///< of all levels
  std::uint64_t clusters = 0;      ///< taken over unread from the stores
  std::uint64_t new_clusters = 0;  ///< made of the points of their top levels, with the root
  std::uint64_t store_bytes = 0;
  unsigned top = 0;
};

/// Joins stores into one that holds the points of all, as if they had been built together. Only the
/// points of their top levels are read and clustered again, with the options that the stores
/// record; all other clusters are taken over as they are. Their files are linked (hard links), or
/// copied from another file system, so the stores may be removed afterwards. The result does not
/// depend on the order of the stores. Time and memory: those of building a store of the top levels'
/// points, plus that of copying.
///
/// The stores must have the same kind of points, attributes, CRS and heights, and the same options
/// of clustering except the seed; the first one's is used. Their coordinates must be on one
/// lattice: cells of rasters that line up, or integers with the same scale, whose offsets differ by
/// whole steps. Rasters must not have values for the same cell. Surfaces
/// are left out, with a note, and overlays of the stores do not apply to the new one.
/// Throws: UsageError for fewer than two stores; stream::Error, naming both stores, if they do not
/// fit together; and as build_store().
MergeOutcome merge_stores(const MergeRequest& request, const Context& context = {});

}  // namespace terrace::terrain
