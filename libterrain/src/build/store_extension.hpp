// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "build/common_frame.hpp"
#include "terrace/terrain/build.hpp"

/// Stores that become part of another one.

namespace terrace::terrain {

/// Passes the points of a store's root to the builder of a store of which it becomes a part.
/// offsets: of its ordinals in those of the new store, by level.
void push_root(const stream::StorePart& part, std::span<const std::uint64_t> offsets,
               cluster::HierarchyBuilder& builder);

/// The store to which a build appends points. It keeps its clusters, with their ordinals, except
/// the root.
class StoreExtension {
 public:
  /// Throws: stream::Error if it is not a store, or has overlays, which would be lost.
  explicit StoreExtension(const BuildRequest& request);

  /// Returns a request that clusters as the store records. Throws: UsageError if the request asks
  /// for another clustering.
  [[nodiscard]] BuildRequest clustering_as_before(const BuildRequest& request) const;
  /// Sets the frame for points of a source. Throws: stream::Error if they do not fit.
  void set_source(const stream::SourceInfo& info, const stream::StoreSchema& schema);

  /// The schema of the extended store.
  [[nodiscard]] const stream::StoreSchema& schema() const { return frame_.schema; }
  [[nodiscard]] std::span<const stream::StorePart> parts() const { return {&part_, 1}; }
  /// Moves points to the frame. Leaves out cells that the store has with the same value. Throws:
  /// stream::Error for a cell with another value, or a coordinate that exceeds its type.
  void place(stream::PointBlock& block);
  /// The number of cells left out by place().
  [[nodiscard]] std::uint64_t known_cells() const { return known_cells_; }
  /// The clusters of the store below its root, by level.
  [[nodiscard]] std::vector<std::uint64_t> clusters() const;
  void push_root(cluster::HierarchyBuilder& builder) const;

 private:
  void leave_out_known(stream::PointBlock& block);

  stream::StorePart part_;
  stream::StoreQuery query_;
  CommonFrame frame_;
  std::string name_;  ///< of the source
  std::uint64_t known_cells_ = 0;
};

}  // namespace terrace::terrain
