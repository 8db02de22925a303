// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

/// Small hierarchies of clusters in memory for the tests, made by nearest-centre clustering. They
/// can simulate every fault of a source.

namespace terrace::tri::test {

inline double unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}
inline std::size_t below(std::mt19937_64& random, std::size_t count) {
  return static_cast<std::size_t>(unit(random) * static_cast<double>(count));
}
template <class T>
void shuffle(std::vector<T>& values, std::mt19937_64& random) {
  for (std::size_t i = values.size(); i > 1; --i) {
    std::swap(values[i - 1], values[below(random, i)]);
  }
}

struct SourceFailure : std::runtime_error {
  SourceFailure() : std::runtime_error("the disk is gone") {}
};

class MemorySource : public ClusterSource {
 public:
  struct Cluster {
    std::vector<Point3> positions;
    std::vector<std::uint64_t> children;
    ClusterRecord record;
  };
  std::vector<std::vector<Cluster>> levels;  ///< the last one is the root alone

  /// Number of calls of read() and record() that still succeed.
  std::size_t lives = std::numeric_limits<std::size_t>::max();
  std::vector<ClusterId> announced, was_read;

  [[nodiscard]] Cluster& at(ClusterId id) {
    return levels.at(level_of(id)).at(static_cast<std::size_t>(ordinal_of(id)));
  }
  [[nodiscard]] Cluster& root() { return levels.back().front(); }

  [[nodiscard]] unsigned top() const override { return static_cast<unsigned>(levels.size()) - 1; }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return levels.at(level).size();
  }
  ClusterRecord record(ClusterId id) override {
    spend();
    return at(id).record;
  }
  ClusterMembers read(ClusterId id) override {
    spend();
    was_read.push_back(id);
    // A copy that the next call overwrites, which the contract permits.
    last_ = at(id);
    return {last_.positions, last_.children};
  }
  void announce(std::span<const ClusterId> ids) override {
    announced.insert(announced.end(), ids.begin(), ids.end());
  }

 private:
  void spend() {
    if (lives == 0) throw SourceFailure();
    --lives;
  }
  Cluster last_;
};

/// Clusters the points level by level about random centres, assigning most points to the nearest
/// one. One point in `ratio` rises to the next level, `levels` times (fewer if one point is left).
inline MemorySource make_hierarchy(const std::vector<Point3>& points, unsigned levels, double ratio,
                                   std::mt19937_64& random) {
  struct Node {
    Point3 position;
    std::vector<std::uint64_t> children;  // level 0 first
    Box3 box;                             // of the points that it heads, including itself
  };
  std::vector<Node> nodes;
  for (const Point3& p : points) nodes.push_back({p, {}, {p, p}});

  MemorySource source;
  for (unsigned level = 0; level < levels && nodes.size() > 1; ++level) {
    shuffle(nodes, random);
    const std::size_t centres = std::max<std::size_t>(
        1, static_cast<std::size_t>(static_cast<double>(nodes.size()) / ratio));
    std::vector<MemorySource::Cluster> clusters(centres);
    std::vector<Box3> boxes(centres);
    for (std::size_t c = 0; c < centres; ++c) boxes[c] = nodes[c].box;
    for (std::size_t i = centres; i < nodes.size(); ++i) {
      std::size_t nearest = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t c = 0; c < centres; ++c) {
        const double dx = nodes[c].position[0] - nodes[i].position[0];
        const double dy = nodes[c].position[1] - nodes[i].position[1];
        if (dx * dx + dy * dy < least) {
          least = dx * dx + dy * dy;
          nearest = c;
        }
      }
      // Some are assigned elsewhere, so that clusters overlap and points with equal coordinates are
      // separated.
      if (below(random, 6) == 0) nearest = below(random, centres);
      MemorySource::Cluster& cluster = clusters[nearest];
      cluster.positions.push_back(nodes[i].position);
      cluster.children.insert(cluster.children.end(), nodes[i].children.begin(),
                              nodes[i].children.end());
      for (std::size_t k = 0; k < 3; ++k) {
        boxes[nearest].min[k] = std::min(boxes[nearest].min[k], nodes[i].box.min[k]);
        boxes[nearest].max[k] = std::max(boxes[nearest].max[k], nodes[i].box.max[k]);
      }
    }
    for (std::size_t c = 0; c < centres; ++c) {
      clusters[c].record = {boxes[c], 0.0, clusters[c].positions.size()};
      nodes[c].box = boxes[c];
      nodes[c].children.push_back(c);
    }
    nodes.resize(centres);
    source.levels.push_back(std::move(clusters));
  }
  MemorySource::Cluster root;
  for (const Node& node : nodes) {
    root.positions.push_back(node.position);
    root.children.insert(root.children.end(), node.children.begin(), node.children.end());
  }
  source.levels.push_back({std::move(root)});
  return source;
}

/// Kinds of point sets. Heights distinguish all points.
enum class Shape { random, grid, duplicates, line, one_place };

inline std::vector<Point3> make_points(Shape shape, std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  const std::size_t side = 1 + static_cast<std::size_t>(unit(random) * 20);
  for (std::size_t i = 0; i < count; ++i) {
    Point3& p = points[i];
    switch (shape) {
      case Shape::random:
        p = {static_cast<double>(below(random, 1 << 20)),
             static_cast<double>(below(random, 1 << 20)), 0.0};
        break;
      case Shape::grid:
        p = {static_cast<double>(i % side), static_cast<double>(i / side), 0.0};
        break;
      case Shape::duplicates:
        p = {static_cast<double>(below(random, 12)), static_cast<double>(below(random, 12)), 0.0};
        break;
      case Shape::line:
        p = {static_cast<double>(3 * below(random, 2 * count)), 0.0, 0.0};
        p[1] = 5.0 + 2.0 * p[0] / 3.0;
        break;
      case Shape::one_place:
        p = {7.0, 9.0, 0.0};
        break;
    }
    p[2] = static_cast<double>(i) + 0.5;
  }
  return points;
}

}  // namespace terrace::tri::test
