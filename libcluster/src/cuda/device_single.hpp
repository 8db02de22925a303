// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "cuda/device_primitives.hpp"
#include "terrace/cluster/point.hpp"

/// Single linkage in rounds on a device (see device_primitives.hpp), by Borůvka's method: in each
/// round every cluster joins the one with the point nearest to any of its own points. That takes at
/// most log2 n rounds. (Merging only reciprocal pairs would take a round for every point that a
/// large cluster absorbs.) No matrix is kept: distances are recomputed in each round, which is
/// faster than reading them.

namespace terrace::cluster::device {

/// Points and, for each, the name of its cluster, which is the index of one of the cluster's
/// points.
struct Labelled {
  const double *x, *y, *z;
  std::uint32_t points;
  std::uint32_t* cluster;
};

/// each over parts times points: finds the nearest point of another cluster in a part of the
/// points.
struct NearestOther {
  Labelled p;
  std::uint32_t parts;
  double* value;  // one value per part and point
  std::uint32_t* index;

  /// Returns the number of parts: enough for all threads, and few enough for memory.
  static std::uint32_t parts_of(std::uint32_t points) {
    return points / 1024 < 64 ? points / 1024 + 1 : 64;
  }

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t number) const {
    const std::size_t part = number / p.points;
    const std::size_t i = number % p.points;
    const std::size_t first = part * p.points / parts;
    const std::size_t end = (part + 1) * p.points / parts;
    const std::uint32_t own = p.cluster[i];
    Best<double> best;
    for (std::size_t j = first; j < end; ++j) {
      if (p.cluster[j] == own) continue;
      best = nearer(best, {squared(p.x, p.y, p.z, i, j), static_cast<std::uint32_t>(j)});
    }
    value[number] = best.value;
    index[number] = best.index;
  }
};

/// The edges of a round. Edges are compared by length, then by their points. So no two are equal,
/// and the chosen ones form no cycle.
struct RoundEdges {
  std::uint64_t* least;   ///< by cluster: the bits of the squared length, ordered like the numbers
  std::uint64_t* ends;    ///< by cluster: the lower point, then the higher
  double* value;          ///< by point: squared distance of the nearest point of another cluster
  std::uint32_t* index;   ///< by point: that point
  std::uint32_t* parent;  ///< by cluster: the cluster that it joins, or itself
};

TERRACE_CLUSTER_HOST_DEVICE inline std::uint64_t bits_of(double value) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint64_t>(__double_as_longlong(value));
#else
  std::uint64_t bits = 0;
  __builtin_memcpy(&bits, &value, sizeof bits);
  return bits;
#endif
}

/// each over points: clears the edges.
struct ClearEdges {
  RoundEdges e;
  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t i) const {
    e.least[i] = UINT64_MAX;
    e.ends[i] = UINT64_MAX;
  }
};

/// each over points: finds the nearest point over all parts, and the shortest length for its
/// cluster.
struct ShortestLength {
  Labelled p;
  RoundEdges e;
  const double* value;
  const std::uint32_t* index;
  std::uint32_t parts;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t i) const {
    Best<double> best;
    for (std::size_t part = 0; part < parts; ++part) {
      best = nearer(best, {value[part * p.points + i], index[part * p.points + i]});
    }
    e.value[i] = best.value;
    e.index[i] = best.index;
    lower(&e.least[p.cluster[i]], bits_of(best.value));
  }
};

/// each over points: among the edges of that length, finds the one with the lowest points.
struct LowestEnds {
  Labelled p;
  RoundEdges e;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t index) const {
    const auto i = static_cast<std::uint32_t>(index);
    if (bits_of(e.value[i]) != e.least[p.cluster[i]]) return;
    const std::uint32_t j = e.index[i];
    const std::uint64_t ends = i < j ? std::uint64_t{i} << 32 | j : std::uint64_t{j} << 32 | i;
    lower(&e.ends[p.cluster[i]], ends);
  }
};

/// each over points: every cluster joins the one at the other end of its edge. Of two clusters with
/// the same edge, the lower one stays. Links are stored by the cluster that disappears.
struct JoinClusters {
  Labelled p;
  RoundEdges e;
  std::uint32_t round;
  std::uint32_t *link_i, *link_j, *link_round;
  double* link_square;
  std::uint32_t* joined;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t index) const {
    const auto c = static_cast<std::uint32_t>(index);
    e.parent[c] = c;
    if (p.cluster[c] != c) return;
    const auto i = static_cast<std::uint32_t>(e.ends[c] >> 32);
    const auto j = static_cast<std::uint32_t>(e.ends[c]);
    const std::uint32_t other = p.cluster[i] == c ? p.cluster[j] : p.cluster[i];
    if (e.ends[other] == e.ends[c] && c < other) return;
    e.parent[c] = other;
    link_i[c] = i;
    link_j[c] = j;
    link_round[c] = round;
    link_square[c] = squared(p.x, p.y, p.z, i, j);
    add(joined, 1);
  }
};

/// each over points: finds the cluster at the end of the chain.
struct FollowParents {
  Labelled p;
  RoundEdges e;

  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t i) const {
    std::uint32_t c = p.cluster[i];
    while (e.parent[c] != c) c = e.parent[c];
    p.cluster[i] = c;
  }
};

/// each over points: makes each point its own cluster.
struct OwnClusters {
  std::uint32_t* cluster;
  TERRACE_CLUSTER_HOST_DEVICE void operator()(std::size_t i) const {
    cluster[i] = static_cast<std::uint32_t>(i);
  }
};

/// Returns the memory that single_rounds() takes on the device, in bytes.
[[nodiscard]] inline std::uint64_t single_rounds_bytes(std::uint64_t points) {
  return points * (12 * NearestOther::parts_of(static_cast<std::uint32_t>(points)) + 80) +
         kSmallMemory;
}

/// Returns the links in no particular order, one fewer than points.
/// points: at least two, fewer than 2^31, as scaled by LinkagePoints.
/// Throws: whatever the device throws.
template <class Device>
std::vector<RoundLink> single_rounds(Device& device, std::span<const Point3> points) {
  using u32 = std::uint32_t;
  const auto n = static_cast<u32>(points.size());
  typename Device::template Memory<double> axes[3];
  std::vector<double> host(n);
  for (unsigned axis = 0; axis < 3; ++axis) {
    for (u32 i = 0; i < n; ++i) host[i] = points[i][axis];
    axes[axis] = device.template allocate<double>(n);
    device.upload(axes[axis].data(), host.data(), n);
  }
  const u32 parts = NearestOther::parts_of(n);
  auto part_value = device.template allocate<double>(std::size_t{parts} * n);
  auto part_index = device.template allocate<u32>(std::size_t{parts} * n);
  auto cluster = device.template allocate<u32>(n);
  auto least = device.template allocate<std::uint64_t>(n);
  auto ends = device.template allocate<std::uint64_t>(n);
  auto value = device.template allocate<double>(n);
  auto index = device.template allocate<u32>(n);
  auto parent = device.template allocate<u32>(n);
  auto link_i = device.template allocate<u32>(n);
  auto link_j = device.template allocate<u32>(n);
  auto link_round = device.template allocate<u32>(n);
  auto link_square = device.template allocate<double>(n);
  auto joined = device.template allocate<u32>(1);
  const Labelled p{axes[0].data(), axes[1].data(), axes[2].data(), n, cluster.data()};
  const RoundEdges e{least.data(), ends.data(), value.data(), index.data(), parent.data()};

  device.each(n, OwnClusters{cluster.data()});
  u32 clusters = n;
  for (u32 round = 0; clusters > 1; ++round) {
    device.clear(joined.data(), 1);
    device.each(std::size_t{parts} * n,
                NearestOther{p, parts, part_value.data(), part_index.data()});
    device.each(n, ClearEdges{e});
    device.each(n, ShortestLength{p, e, part_value.data(), part_index.data(), parts});
    device.each(n, LowestEnds{p, e});
    device.each(n, JoinClusters{p, e, round, link_i.data(), link_j.data(), link_round.data(),
                                link_square.data(), joined.data()});
    device.each(n, FollowParents{p, e});
    u32 count = 0;
    device.download(&count, joined.data(), 1);
    if (count == 0 || count >= clusters) {
      throw std::runtime_error("the device joined no clusters, or too many");
    }
    clusters -= count;
  }

  std::vector<u32> i(n), j(n), round(n), last(1);
  std::vector<double> square(n);
  device.download(i.data(), link_i.data(), n);
  device.download(j.data(), link_j.data(), n);
  device.download(round.data(), link_round.data(), n);
  device.download(square.data(), link_square.data(), n);
  device.download(last.data(), cluster.data(), 1);
  std::vector<RoundLink> links;
  links.reserve(n - 1);
  for (u32 c = 0; c < n; ++c) {
    if (c != last[0]) links.push_back({i[c], j[c], square[c], round[c]});
  }
  return links;
}

}  // namespace terrace::cluster::device
