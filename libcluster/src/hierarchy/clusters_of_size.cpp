// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "terrace/cluster/hierarchy.hpp"

namespace terrace::cluster {
namespace {

/// Records parents: on level 0 the cluster of each point, on higher levels the cluster that
/// contains each cluster of the level below.
class ParentSink final : public HierarchySink {
 public:
  explicit ParentSink(std::size_t points) : parents_(1) { parents_[0].resize(points); }

  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    auto clusters = std::make_unique<Clusters>();
    clusters->count = block.representatives.size();
    for (std::size_t c = 0; c < clusters->count; ++c) {
      for (std::uint32_t k = block.first[c]; k < block.first[c + 1]; ++k) {
        clusters->members.emplace_back(child(block, block.order[k]), c);
      }
    }
    return clusters;
  }

  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override {
    const auto& clusters = static_cast<const Clusters&>(*prepared);
    if (counts_.size() <= level) counts_.resize(level + std::size_t{1}, 0);
    if (parents_.size() <= level) parents_.resize(level + std::size_t{1});
    auto& parents = parents_[level];
    for (const auto& [child, cluster] : clusters.members) {
      if (parents.size() <= child) parents.resize(child + 1);
      parents[child] = static_cast<std::uint32_t>(counts_[level] + cluster);
    }
    counts_[level] += clusters.count;
  }

  void root(const ClusteredBlock&) override {}

  /// Returns the number of clusters on each level below the root.
  [[nodiscard]] const std::vector<std::size_t>& counts() const { return counts_; }
  [[nodiscard]] const std::vector<std::uint32_t>& parents(std::size_t level) const {
    return parents_[level];
  }

 private:
  struct Clusters final : Prepared {
    std::vector<std::pair<std::size_t, std::size_t>> members;
    std::size_t count = 0;
  };

  // Returns the number of the point on level 0, which is its payload, or of the cluster that the
  // point heads on the level below.
  static std::size_t child(const ClusteredBlock& block, std::uint32_t point) {
    if (block.level > 0) {
      return block.children[point * std::size_t{block.level} + block.level - 1];
    }
    std::uint32_t index = 0;
    std::memcpy(&index, block.payload.data() + point * sizeof index, sizeof index);
    return index;
  }

  std::vector<std::vector<std::uint32_t>> parents_;
  std::vector<std::size_t> counts_;
};

/// Sorts `order` into consecutive ranges of at most `max_size` points, each compact in space.
/// Returns the ends of the ranges.
std::vector<std::size_t> compact_ranges(std::span<const Point3> points, std::size_t max_size,
                                        std::vector<std::uint32_t>& order,
                                        const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  std::vector<std::size_t> ends;
  std::vector<std::pair<std::size_t, std::size_t>> pending{{0, order.size()}};
  while (!pending.empty()) {
    const auto [begin, end] = pending.back();
    pending.pop_back();
    if (end - begin <= max_size) {
      ends.push_back(end);
      continue;
    }
    Point3 extent{};
    for (std::size_t d = 0; d < 3; ++d) {
      double low = points[order[begin]][d], high = low;
      for (std::size_t k = begin; k < end; ++k) {
        ticks(4);
        low = std::min(low, points[order[k]][d]);
        high = std::max(high, points[order[k]][d]);
      }
      extent[d] = high - low;
    }
    const auto axis =
        static_cast<std::size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
    // Splits at whole blocks.
    const std::size_t blocks = (end - begin + max_size - 1) / max_size;
    const std::size_t middle = begin + blocks / 2 * max_size;
    const auto at = [&](std::size_t k) { return order.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      ticks(4);
      return std::tie(points[a][axis], a) < std::tie(points[b][axis], b);
    });
    pending.emplace_back(middle, end);
    pending.emplace_back(begin, middle);
  }
  return ends;
}

}  // namespace

std::vector<std::uint32_t> clusters_of_size(std::span<const Point3> points, double size,
                                            std::uint64_t seed, unsigned threads,
                                            const std::function<void(std::uint64_t)>& progress,
                                            const base::StopCheck& check_stop) {
  if (!(size > 0)) throw std::invalid_argument("the cluster size must be positive");
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  HierarchyOptions options;
  options.payload_size = sizeof(std::uint32_t);
  options.threads = threads;
  options.block.seed = seed;
  options.block.check_stop = check_stop;
  const std::vector<std::size_t> ends =
      compact_ranges(points, options.block_size, order, check_stop);
  ParentSink sink(points.size());
  {
    HierarchyBuilder builder(options, sink);
    std::vector<Point3> block;
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      // Restores the input order within a block, which the selection has changed.
      const auto at = [&](std::size_t k) { return order.begin() + static_cast<std::ptrdiff_t>(k); };
      std::sort(at(begin), at(end));
      block.clear();
      for (std::size_t k = begin; k < end; ++k) block.push_back(points[order[k]]);
      builder.push(block, std::as_bytes(std::span(order).subspan(begin, end - begin)));
      if (progress) progress(end);
      begin = end;
    }
    builder.finish();
  }
  // If all points fit one block, the root is the only cluster.
  std::vector<std::uint32_t> labels(points.size(), 0);
  // Returns the factor by which a mean size is too large or too small.
  const auto ratio = [size](double mean) { return std::max(mean / size, size / mean); };
  double nearest = ratio(static_cast<double>(std::max<std::size_t>(points.size(), 1)));
  std::size_t levels = 0;
  for (std::size_t level = 0; level < sink.counts().size(); ++level) {
    const double mean =
        static_cast<double>(points.size()) / static_cast<double>(sink.counts()[level]);
    if (ratio(mean) >= nearest) continue;
    nearest = ratio(mean);
    levels = level + 1;
  }
  if (levels == 0) return labels;
  base::StopTicks ticks(check_stop);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    ticks(8 * levels);
    std::uint32_t cluster = sink.parents(0)[i];
    for (std::size_t level = 1; level < levels; ++level) cluster = sink.parents(level)[cluster];
    labels[i] = cluster;
  }
  return labels;
}

}  // namespace terrace::cluster
