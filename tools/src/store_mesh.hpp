// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "region.hpp"
#include "scene.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::tools {

/// What part of a store is wanted, and how finely.
struct StoreSelection {
  std::optional<unsigned> level;  ///< everywhere; nothing: the top
  std::vector<Focus> focuses;     ///< finer there
};

/// The points of a store's selection as a cloud: positions in *stored* coordinates, levels filled
/// (the highest level of each point). Clusters are expanded as a whole, so some points outside the
/// focuses come along. Throws: stream::Error on damage; UsageError for a level that is not there.
TriangleMesh points_of_store(const stream::Store& store, const StoreSelection& selection);

/// The same points triangulated in the plane of stored coordinates 0 and 1 (2D Delaunay).
TriangleMesh mesh_of_store(const stream::Store& store, const StoreSelection& selection);

/// The finest level with at most `most_points` points; the top if none has so few.
unsigned level_within(const stream::Store& store, std::uint64_t most_points);

}  // namespace terrace::tools
