// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_source.hpp"

namespace terrace::terrain {
namespace {

stream::ClusterId stored(tri::ClusterId id) {
  return stream::cluster_id(tri::level_of(id), tri::ordinal_of(id));
}

}  // namespace

std::uint64_t StoreSource::cluster_count(unsigned level) const {
  return store_.levels()[level].clusters;
}

tri::ClusterRecord StoreSource::record(tri::ClusterId id) {
  const stream::ClusterRecord record = store_.record(stored(id));
  return {.box = {record.summary.box.min, record.summary.box.max},
          .error = record.summary.error,
          .members = record.points};
}

tri::ClusterMembers StoreSource::read(tri::ClusterId id) {
  store_.read(stored(id), points_);
  return {.positions = points_.positions, .children = points_.children, .values = points_.payload};
}

}  // namespace terrace::terrain
