// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <terrace/base/hilbert.hpp>
#include <terrace/base/thread_team.hpp>

#include "store/write/raw_block.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/stored_surface.hpp"

namespace terrace::stream {

using namespace store;

namespace {

/// Points of a block. Boxes are coded in steps of their block's extent. A curve through space
/// leaves a surface and returns to it elsewhere, so blocks of clouds are wide unless they have few
/// points.
constexpr std::uint64_t kRasterBlock = 10'000, kCloudBlock = 2'000;
/// Number of blocks that are encoded in parallel.
constexpr std::size_t kBlocksAtOnce = 64;

/// New ordinals of clusters, by level and old ordinal.
using Ordinals = std::vector<std::vector<std::uint64_t>>;

/// Returns the position of a value between low and high, 0 to 1. Halves do not overflow.
double share_of(double value, double low, double high) {
  const double share = high > low ? (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low) : 0.0;
  return std::clamp(share, 0.0, 1.0);
}

/// Returns the ordinals of a level's clusters along the curve. Axes are scaled by the mean extents
/// of the boxes, so that units and steepness do not matter; heights of rasters are ignored.
std::vector<std::uint64_t> along_curve(const Store& store, unsigned level) {
  const std::size_t axes = store.schema().grid ? 2 : 3;
  const unsigned bits = axes == 2 ? 28 : 20;
  const std::uint64_t clusters = store.levels()[level].clusters;
  const Box3& bounds = store.bounds();
  const auto share = [&](double value, std::size_t axis) {
    return share_of(value, bounds.min[axis], bounds.max[axis]);
  };
  std::array<double, 3> extents{};
  for (std::uint64_t i = 0; i < clusters; ++i) {
    const Box3 box = store.record(cluster_id(level, i)).summary.box;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      extents[axis] += share(box.max[axis], axis) - share(box.min[axis], axis);
    }
  }
  double shortest = std::numeric_limits<double>::infinity();
  for (const double extent : extents) {
    if (extent > 0) shortest = std::min(shortest, extent);
  }

  // Keys with the position on the curve in the bits above the ordinal.
  const auto ordinal_bits = static_cast<unsigned>(std::bit_width(clusters));
  const unsigned curve_bits = bits * static_cast<unsigned>(axes);
  const unsigned dropped_bits = curve_bits + ordinal_bits > 64 ? curve_bits + ordinal_bits - 64 : 0;
  std::vector<std::uint64_t> order(clusters);
  for (std::uint64_t i = 0; i < clusters; ++i) {
    const Box3 box = store.record(cluster_id(level, i)).summary.box;
    std::array<std::uint32_t, 3> cell{};
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const double scale = extents[axis] > 0 ? shortest / extents[axis] : 1.0;
      const double position = share(0.5 * box.min[axis] + 0.5 * box.max[axis], axis) * scale;
      cell[axis] = static_cast<std::uint32_t>(position * static_cast<double>((1u << bits) - 1));
    }
    const std::uint64_t curve_index = axes == 2
                                          ? base::hilbert_index<28>(cell[0], cell[1])
                                          : base::hilbert_index<20>(cell[0], cell[1], cell[2]);
    order[i] = curve_index >> dropped_bits << ordinal_bits | i;
  }
  std::sort(order.begin(), order.end());
  for (std::uint64_t& key : order) key &= (std::uint64_t{1} << ordinal_bits) - 1;
  return order;
}

/// Adds a cluster with the new ordinals of the clusters that its points head.
void add(const Store& store, ClusterId id, const Ordinals& new_ordinals, RawBlock& block) {
  ClusterPoints points;
  store.read(id, points);
  for (auto* const children : {&points.children, &points.representative_children}) {
    for (std::size_t i = 0; i < children->size(); ++i) {
      (*children)[i] = new_ordinals[i % block.level][(*children)[i]];
    }
  }
  block.add(points);
  block.summaries.push_back(store.record(id).summary);
  // A box of points only is recomputed, so that it is not enlarged twice.
  if (block.level == 0) block.summaries.back().box = {};
}

/// Returns the positions of a cluster's members in ascending order, with their numbers in it.
std::vector<std::pair<Point3, std::uint32_t>> sorted_members(const Store& store, ClusterId id) {
  ClusterPoints points;
  store.read(id, points);
  std::vector<std::pair<Point3, std::uint32_t>> members;
  for (const Point3& position : points.positions) {
    members.emplace_back(position, static_cast<std::uint32_t>(members.size()));
  }
  std::sort(members.begin(), members.end());
  return members;
}

/// Returns a store's surface by the numbers of the repacked store's points. Clusters have the same
/// points in another order. ordinals: new ones of the clusters of level 0.
StoredSurface renumbered_surface(const Store& store, const Store& repacked,
                                 const ClusterOrder& new_order,
                                 const std::vector<std::uint64_t>& ordinals) {
  const ClusterOrder order = cluster_order(store);
  const StoredSurface old = store.read_surface(order);
  std::vector<std::uint32_t> new_begins(ordinals.size());
  for (const ClusterOrder::Cluster& cluster : new_order.clusters) {
    if (level_of(cluster.id) == 0) new_begins[ordinal_of(cluster.id)] = cluster.begin;
  }
  std::vector<std::uint32_t> new_number(order.points());
  for (const ClusterOrder::Cluster& cluster : order.clusters) {
    if (level_of(cluster.id) > 0) continue;
    const std::uint64_t ordinal = ordinals[ordinal_of(cluster.id)];
    const auto from = sorted_members(store, cluster.id);
    const auto to = sorted_members(repacked, cluster_id(0, ordinal));
    for (std::size_t i = 0; i < from.size(); ++i) {
      new_number[cluster.begin + from[i].second] = new_begins[ordinal] + to[i].second;
    }
    // The representative comes last.
    if (cluster.representative != kNoNumber) {
      new_number[cluster.representative] =
          new_begins[ordinal] + static_cast<std::uint32_t>(to.size());
    }
  }
  StoredSurface out(order.points());
  for (std::uint32_t v = 0; v < order.points(); ++v) {
    const std::uint32_t number = new_number[v];
    if (old.parents[v] != kNoNumber) out.parents[number] = new_number[old.parents[v]];
    out.errors[number] = old.errors[v];
    out.levels[number] = old.levels[v];
  }
  for (const auto& [a, b, c] : old.triangles) {
    out.triangles.push_back({new_number[a], new_number[b], new_number[c]});
  }
  return out;
}

}  // namespace

std::uint64_t repack(const Store& store, const std::filesystem::path& path, bool replace,
                     unsigned threads) {
  StoreWriter writer(path, store.schema(), replace, threads);
  base::ThreadTeam team(threads);
  const std::uint64_t block_points = store.schema().grid ? kRasterBlock : kCloudBlock;
  Ordinals new_ordinals;
  for (unsigned level = 0; level < store.top(); ++level) {
    const std::vector<std::uint64_t> order = along_curve(store, level);
    for (std::uint64_t next = 0; next < order.size();) {
      std::vector<std::uint64_t> begins{next};
      while (begins.size() <= kBlocksAtOnce && next < order.size()) {
        std::uint64_t points = 0;
        while (points < block_points && next < order.size()) {
          points += store.record(cluster_id(level, order[next++])).points;
        }
        begins.push_back(next);
      }
      std::vector<StoreWriter::EncodedPtr> blocks(begins.size() - 1);
      team.run(blocks.size(), [&](std::size_t b, std::size_t) {
        RawBlock block;
        block.level = level;
        for (std::uint64_t i = begins[b]; i < begins[b + 1]; ++i) {
          add(store, cluster_id(level, order[i]), new_ordinals, block);
        }
        blocks[b] = writer.encode(block.view());
      });
      for (StoreWriter::EncodedPtr& block : blocks) writer.append(std::move(block));
    }
    std::vector<std::uint64_t>& ordinals = new_ordinals.emplace_back(order.size());
    for (std::uint64_t i = 0; i < order.size(); ++i) ordinals[order[i]] = i;
  }
  RawBlock root;
  root.level = store.top();
  add(store, store.root(), new_ordinals, root);
  StoreWriter::MakeSurface surface;
  if (store.surface()) {
    surface = [&](const Store& repacked, const ClusterOrder& order) {
      return renumbered_surface(store, repacked, order, new_ordinals[0]);
    };
  }
  return writer.finish(root.view(), /*publish=*/true, surface);
}

}  // namespace terrace::stream
