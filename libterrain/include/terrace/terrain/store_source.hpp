// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/stream/store.hpp>
#include <terrace/tri/multiresolution.hpp>

namespace terrace::terrain {

/// Lets libtri's multiresolution model read libstream's store, in stored coordinates; values are
/// the attributes, as records of the store's schema. In a view (stream::Store::where()) all points
/// come, as a model has no conditions. The two libraries do not know each other;
/// their cluster ids are the same numbers.
class StoreSource final : public tri::ClusterSource {
 public:
  /// The store must outlive the source.
  explicit StoreSource(const stream::Store& store) : store_(store) {}

  [[nodiscard]] unsigned top() const override { return store_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override;
  tri::ClusterRecord record(tri::ClusterId id) override;
  tri::ClusterMembers read(tri::ClusterId id) override;

 private:
  const stream::Store& store_;
  stream::ClusterPoints points_;  // what the last read() shows
};

}  // namespace terrace::terrain
