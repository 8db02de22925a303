// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <terrace/stream/store.hpp>
#include <terrace/tri/multiresolution.hpp>

namespace terrace::terrain {

/// Connects libtri's multiresolution model to libstream's store, in stored coordinates. Values are
/// the attributes, as records of the store's schema. Also delivers all points of a view
/// (stream::Store::where()), because a model does not support conditions.
class StoreSource final : public tri::ClusterSource {
 public:
  /// The store must outlive the source.
  explicit StoreSource(const stream::Store& store) : store_(store) {}

  [[nodiscard]] unsigned top() const override { return store_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return store_.levels()[level].clusters;
  }
  tri::ClusterRecord record(tri::ClusterId id) override {
    const stream::ClusterRecord record = store_.record(id);
    return {.box = record.summary.box, .error = record.summary.error, .members = record.points};
  }
  tri::ClusterMembers read(tri::ClusterId id) override {
    store_.read(id, points_);
    return {
        .positions = points_.positions, .children = points_.children, .values = points_.payload};
  }

 private:
  const stream::Store& store_;
  stream::ClusterPoints points_;  // result of the last read()
};

}  // namespace terrace::terrain
