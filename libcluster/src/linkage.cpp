// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/linkage.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include <terrace/base/stop_check.hpp>

#include "linkage/cluster_means.hpp"
#include "linkage/distance_triangle.hpp"

namespace terrace::cluster {
namespace {

template <class Clusters>
Dendrogram agglomerate(Clusters&& clusters, LinkageMethod method,
                       const base::StopCheck& check_stop) {
  const std::size_t points = clusters.size();
  if (method == LinkageMethod::centroid || method == LinkageMethod::median) {
    return make_dendrogram_in_order(points, nearest_pair_links(clusters), check_stop);
  }
  return make_dendrogram(points, chain_links(clusters), check_stop);
}

/// Memory per point for clusters, their nearest ones, links and the dendrogram.
constexpr std::uint64_t kBytesOfMean = 120;

void check_means(std::size_t points, std::uint64_t memory_limit) {
  const std::uint64_t bytes = kBytesOfMean * points;
  if (memory_limit == 0 || bytes <= memory_limit) return;
  throw std::invalid_argument("the linkage of " + std::to_string(points) + " points would need " +
                              std::to_string(bytes) + " bytes of memory, but the limit is " +
                              std::to_string(memory_limit) + "; use fewer points");
}

}  // namespace

std::optional<LinkageMethod> linkage_method_named(std::string_view name) {
  using enum LinkageMethod;
  constexpr std::pair<std::string_view, LinkageMethod> kNames[] = {
      {"single", single}, {"complete", complete}, {"average", average}, {"weighted", weighted},
      {"ward", ward},     {"centroid", centroid}, {"median", median}};
  for (const auto& [known, method] : kNames) {
    if (known == name) return method;
  }
  return std::nullopt;
}

Dendrogram linkage(std::span<const Point3> points, LinkageMethod method,
                   const LinkageOptions& options) {
  if (method == LinkageMethod::single) return single_linkage(points, options);
  if (method == LinkageMethod::complete) return complete_linkage(points, options);
  const LinkagePoints checked(points);
  if (method != LinkageMethod::average && method != LinkageMethod::weighted) {
    check_means(points.size(), options.memory_limit);
    return agglomerate(ClusterMeans(checked, method, options), method, options.check_stop);
  }
  if (options.entry == MatrixEntry::float32) {
    return agglomerate(DistanceTriangle<float>(checked, method, options), method,
                       options.check_stop);
  }
  return agglomerate(DistanceTriangle<double>(checked, method, options), method,
                     options.check_stop);
}

Dendrogram linkage(std::size_t count, const PairDistance& distance, LinkageMethod method,
                   const LinkageOptions& options) {
  if (method == LinkageMethod::complete) return complete_linkage(count, distance, options);
  if (options.entry == MatrixEntry::float32) {
    return agglomerate(DistanceTriangle<float>(count, distance, method, options), method,
                       options.check_stop);
  }
  return agglomerate(DistanceTriangle<double>(count, distance, method, options), method,
                     options.check_stop);
}

}  // namespace terrace::cluster
