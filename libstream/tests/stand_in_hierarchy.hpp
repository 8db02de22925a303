// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <span>
#include <vector>

#include "terrace/stream/store.hpp"

namespace terrace::stream::testing {

/// A simple substitute for the hierarchy builder. Clusters blocks by the nearest of evenly strided
/// seeds and passes them on, level by level, the root last. The hierarchy is valid, but the
/// clusters are not good.
class StandInHierarchy {
 public:
  struct Options {
    std::size_t block_points = 10000;
    std::size_t cluster_points = 142;
    std::array<double, 3> scale{1, 1, 1};  ///< ground units per unit of each coordinate
  };

  using Sink = std::function<void(const ClusteredBlock&)>;

  StandInHierarchy(std::size_t payload_size, Options options, Sink sink)
      : sink_(std::move(sink)), options_(options), stride_(payload_size) {}

  StandInHierarchy(StoreWriter& writer, Options options)
      : StandInHierarchy(writer.schema().payload_size(), options,
                         [&writer, this](const ClusteredBlock& block) {
                           if (block.representatives[0] == kNoRepresentative) {
                             bytes_ = writer.finish(block);
                           } else {
                             writer.append(writer.encode(block));
                           }
                         }) {}

  /// Adds a block of level 0.
  void push(std::span<const Point3> positions, std::span<const std::byte> payload = {}) {
    Points points;
    points.positions.assign(positions.begin(), positions.end());
    points.payload.assign(payload.begin(), payload.end());
    for (const Point3& p : positions) points.below.push_back({{p, p}, 0.0, 1});
    add(0, std::move(points));
  }

  /// Ends the hierarchy. Returns the size of the store in bytes, if it wrote one.
  std::uint64_t finish() {
    if (levels_.empty()) levels_.resize(1), closed_.resize(1);
    // The top is the first level that was never closed.
    unsigned top = 0;
    for (; closed_[top] > 0; ++top) {
      if (!levels_[top].positions.empty()) cluster(top);
    }
    Points& points = levels_[top];
    const auto n = static_cast<std::uint32_t>(points.positions.size());
    std::vector<std::uint32_t> order(n);
    for (std::uint32_t i = 0; i < n; ++i) order[i] = i;
    const std::uint32_t none = kNoRepresentative;
    const std::vector<std::uint32_t> first{0, n};
    ClusterSummary all;
    for (const ClusterSummary& s : points.below) {
      all.box.include(s.box);
      all.descendants += s.descendants;
    }
    sink_({.level = top,
           .positions = points.positions,
           .payload = points.payload,
           .children = points.children,
           .first = first,
           .order = order,
           .representatives = {&none, 1},
           .summaries = {&all, 1}});
    return bytes_;
  }

 private:
  struct Points {
    std::vector<Point3> positions;
    std::vector<std::byte> payload;
    std::vector<std::uint64_t> children;
    std::vector<ClusterSummary> below;
  };

  void add(unsigned level, Points points) {
    if (levels_.size() <= level) {
      levels_.resize(level + 1);
      closed_.resize(level + 1);
    }
    Points& current = levels_[level];
    if (current.positions.size() + points.positions.size() > options_.block_points &&
        !current.positions.empty()) {
      cluster(level);
    }
    Points& next = levels_[level];
    const auto join = [](auto& target, const auto& source) {
      target.insert(target.end(), source.begin(), source.end());
    };
    join(next.positions, points.positions);
    join(next.payload, points.payload);
    join(next.children, points.children);
    join(next.below, points.below);
  }

  double distance(const Point3& a, const Point3& b) const {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double d = (a[i] - b[i]) * options_.scale[i];
      sum += d * d;
    }
    return sum;
  }

  void cluster(unsigned level) {
    const Points points = std::move(levels_[level]);
    levels_[level] = {};
    ++closed_[level];
    const std::size_t n = points.positions.size();
    const std::size_t k = std::max<std::size_t>(1, n / options_.cluster_points);
    std::vector<Point3> seeds;
    for (std::size_t s = 0; s < k; ++s)
      seeds.push_back(points.positions[(2 * s + 1) * n / (2 * k)]);
    std::vector<std::uint32_t> assigned(n);
    for (int round = 0; round < 3; ++round) {
      // Assigns points to the nearest seed, then moves the seeds to the means.
      for (std::size_t i = 0; i < n; ++i) {
        double best = std::numeric_limits<double>::infinity();
        for (std::size_t s = 0; s < k; ++s) {
          const double d = distance(points.positions[i], seeds[s]);
          if (d < best) {
            best = d;
            assigned[i] = static_cast<std::uint32_t>(s);
          }
        }
      }
      std::vector<Point3> sums(k, Point3{});
      std::vector<double> counts(k);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t a = 0; a < 3; ++a) sums[assigned[i]][a] += points.positions[i][a];
        counts[assigned[i]] += 1;
      }
      for (std::size_t s = 0; s < k && round < 2; ++s) {
        for (std::size_t a = 0; a < 3 && counts[s] > 0; ++a) seeds[s][a] = sums[s][a] / counts[s];
      }
    }
    std::vector<std::vector<std::uint32_t>> clusters(k);
    for (std::uint32_t i = 0; i < n; ++i) clusters[assigned[i]].push_back(i);
    std::erase_if(clusters, [](const auto& c) { return c.empty(); });

    std::vector<std::uint32_t> first{0}, order, representatives;
    std::vector<ClusterSummary> summaries;
    for (std::size_t c = 0; c < clusters.size(); ++c) {
      const auto nearest = *std::min_element(
          clusters[c].begin(), clusters[c].end(), [&](std::uint32_t a, std::uint32_t b) {
            const Point3& seed = seeds[assigned[a]];
            return distance(points.positions[a], seed) < distance(points.positions[b], seed);
          });
      ClusterSummary summary;
      for (const std::uint32_t i : clusters[c]) {
        const ClusterSummary& below = points.below[i];
        summary.box.include(below.box);
        summary.descendants += below.descendants;
        summary.error = std::max(
            summary.error,
            std::sqrt(distance(points.positions[i], points.positions[nearest])) + below.error);
      }
      order.insert(order.end(), clusters[c].begin(), clusters[c].end());
      first.push_back(static_cast<std::uint32_t>(order.size()));
      representatives.push_back(nearest);
      summaries.push_back(summary);
    }
    const std::uint64_t ordinal = clusters_[level];
    clusters_[level] += clusters.size();
    sink_({.level = level,
           .positions = points.positions,
           .payload = points.payload,
           .children = points.children,
           .first = first,
           .order = order,
           .representatives = representatives,
           .summaries = summaries});

    Points up;
    for (std::size_t c = 0; c < representatives.size(); ++c) {
      const std::uint32_t r = representatives[c];
      up.positions.push_back(points.positions[r]);
      const std::byte* const payload = points.payload.data() + r * stride_;
      up.payload.insert(up.payload.end(), payload, payload + stride_);
      const std::uint64_t* const children = points.children.data() + std::size_t{r} * level;
      up.children.insert(up.children.end(), children, children + level);
      up.children.push_back(ordinal + c);
      up.below.push_back(summaries[c]);
    }
    add(level + 1, std::move(up));
  }

  Sink sink_;
  std::array<std::uint64_t, 64> clusters_{};
  std::uint64_t bytes_ = 0;
  Options options_;
  std::size_t stride_;
  std::vector<Points> levels_;
  std::vector<std::uint64_t> closed_;
};

}  // namespace terrace::stream::testing
