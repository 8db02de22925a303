// SPDX-License-Identifier: Apache-2.0
#include "control.hpp"

#include <string>
#include <utility>

#include "columns.hpp"

#ifndef TERRACE_TRI_CORE
#include "terrace/tri/regional_delaunay2.hpp"
#endif

namespace terrace::tri {
#ifdef TERRACE_TRI_CORE
namespace detail {

void check(const LoadedCluster& cluster, unsigned top) {
  const unsigned level = level_of(cluster.cluster);
  const std::size_t size = cluster.positions.size();
  if (level > top) {
    throw HierarchyError(cluster.cluster, "the top is level " + std::to_string(top));
  }
  if (cluster.children.size() != size * level) {
    throw HierarchyError(cluster.cluster,
                         std::to_string(size) + " members of level " + std::to_string(level) +
                             " came with " + std::to_string(cluster.children.size()) +
                             " child ordinals, not " + std::to_string(size * level) +
                             "; the source is damaged, verify it");
  }
  if (size == 0 ? !cluster.values.empty() : cluster.values.size() % size != 0) {
    throw HierarchyError(cluster.cluster, std::to_string(cluster.values.size()) +
                                              " bytes of values came for " + std::to_string(size) +
                                              " members");
  }
  const std::size_t records = level == 0 ? 0 : size + (level < top ? 1 : 0);
  if (cluster.child_records.size() != records) {
    throw HierarchyError(cluster.cluster, std::to_string(cluster.child_records.size()) +
                                              " child records came, " + std::to_string(records) +
                                              " are needed: one per member and one for the head");
  }
}

ViewOptions checked(ViewOptions options) {
  terrace::tri::check(options);
  return options;
}

}  // namespace detail

template class ViewControl<Delaunay2<std::int32_t>>;
template class ViewControl<ThinnedDelaunay2>;
template class ViewControl<PointCloud>;
#else
template class ViewControl<Delaunay2<double>>;
template class ViewControl<RegionalDelaunay2<std::int32_t>>;
template class ViewControl<RegionalDelaunay2<double>>;
template class ViewControl<DynamicSurface<double>>;
#endif

}  // namespace terrace::tri
