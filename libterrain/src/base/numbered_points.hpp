// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/stored_surface.hpp>

namespace terrace::terrain {

/// Reads all points of a store. visit(number, position, values) receives the number of each point
/// in the order of the clusters, its stored coordinates and its attributes, a record of the schema.
template <class Visit>
void for_each_numbered_point(const stream::Store& store, const stream::ClusterOrder& order,
                             const Visit& visit) {
  // By the ordinals of the clusters of level 0.
  std::vector<std::uint32_t> begins(static_cast<std::size_t>(store.levels()[0].clusters));
  const auto begin_of = [&](stream::ClusterId id) -> std::uint32_t& {
    return begins[static_cast<std::size_t>(stream::ordinal_of(id))];
  };
  for (const auto& cluster : order.clusters) {
    if (stream::level_of(cluster.id) == 0) begin_of(cluster.id) = cluster.begin;
  }
  const std::size_t bytes = store.schema().payload_size();
  store.for_each(0, [&](stream::ClusterId id, const stream::ClusterRecord&,
                        const stream::ClusterPoints& points) {
    std::uint32_t number = begin_of(id);
    for (std::size_t i = 0; i < points.size(); ++i) {
      visit(number++, points.positions[i], std::span(points.payload).subspan(i * bytes, bytes));
    }
    if (points.has_representative) {
      visit(number, points.representative, std::span(points.representative_payload));
    }
  });
}

}  // namespace terrace::terrain
