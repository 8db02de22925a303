// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "terrace/tri/multiresolution.hpp"

/// Large hierarchies of compact clusters that are fast to make, and timers between the model and
/// the parts that it uses.

namespace terrace::tri::bench {

inline double unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

using Clock = std::chrono::steady_clock;

/// Adds the seconds of its lifetime to `sum`.
class Lap {
 public:
  explicit Lap(double& sum) : sum_(sum), begin_(Clock::now()) {}
  ~Lap() { sum_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
  Lap(const Lap&) = delete;
  Lap& operator=(const Lap&) = delete;

 private:
  double& sum_;
  Clock::time_point begin_;
};

/// All clusters in memory, with members in contiguous arrays.
class ArraySource : public ClusterSource {
 public:
  struct Level {
    std::vector<Point3> positions;
    std::vector<std::uint64_t> children;
    std::vector<std::uint32_t> first{0};  ///< start of each cluster, and the end
    std::vector<Box3> boxes;
    /// upper bound of the distance in the plane between the head and a descendant
    std::vector<double> errors;
  };
  std::vector<Level> levels;  ///< the last one has only the root
  mutable double seconds = 0.0;

  [[nodiscard]] unsigned top() const override { return static_cast<unsigned>(levels.size()) - 1; }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return levels[level].first.size() - 1;
  }
  ClusterRecord record(ClusterId id) override {
    const Lap lap(seconds);
    const Level& level = levels[level_of(id)];
    const std::size_t c = static_cast<std::size_t>(ordinal_of(id));
    return {level.boxes[c], level.errors[c], level.first[c + 1] - level.first[c]};
  }
  ClusterMembers read(ClusterId id) override {
    const Lap lap(seconds);
    const unsigned l = level_of(id);
    const Level& level = levels[l];
    const std::size_t c = static_cast<std::size_t>(ordinal_of(id));
    const std::size_t begin = level.first[c], size = level.first[c + 1] - begin;
    return {std::span(level.positions).subspan(begin, size),
            std::span(level.children).subspan(begin * l, size * l)};
  }
};

/// Makes one point a centre in each cell of about `cell_points` points. Each point joins the
/// nearest centre of the cells around its own. Members keep the order of `points`. Repeats this
/// `levels` times with the centres as points.
inline ArraySource make_hierarchy(std::vector<Point3> points, unsigned levels, double cell_points,
                                  std::mt19937_64& random) {
  struct Node {
    Point3 position;
    std::vector<std::uint64_t> children;
    Box3 box;
    double reach = 0.0;  // upper bound of the distance of descendants
  };
  std::vector<Node> nodes(points.size());
  double side = 1.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    nodes[i] = {points[i], {}, {points[i], points[i]}, 0.0};
    side = std::max({side, points[i][0] + 1.0, points[i][1] + 1.0});
  }
  ArraySource source;
  for (unsigned level = 0; level < levels; ++level) {
    const double cells_wanted = static_cast<double>(nodes.size()) / cell_points;
    const int cells = std::max(1, static_cast<int>(std::sqrt(cells_wanted)));
    const auto cell_of = [&](const Point3& p, int axis) {
      return std::min(cells - 1,
                      static_cast<int>(p[static_cast<std::size_t>(axis)] / side * cells));
    };
    const std::size_t all = static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells);
    const auto number = [&](int x, int y) {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(cells) +
             static_cast<std::size_t>(x);
    };
    // Chooses one of the cell's nodes at random, by reservoir sampling.
    constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    std::vector<std::uint32_t> centre(all, kNone), seen(all, 0);
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      const std::size_t c = number(cell_of(nodes[i].position, 0), cell_of(nodes[i].position, 1));
      if (unit(random) * ++seen[c] < 1.0) centre[c] = i;
    }
    std::vector<std::uint32_t> cluster(nodes.size()), ordinal(all, kNone);
    std::uint32_t count = 0;
    std::vector<std::uint32_t> centres;
    for (std::size_t c = 0; c < all; ++c) {
      if (centre[c] == kNone) continue;
      ordinal[c] = count++;
      centres.push_back(centre[c]);
    }
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      const int x = cell_of(nodes[i].position, 0), y = cell_of(nodes[i].position, 1);
      double least = std::numeric_limits<double>::infinity();
      for (int v = std::max(0, y - 1); v <= std::min(cells - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(cells - 1, x + 1); ++u) {
          const std::size_t c = number(u, v);
          if (centre[c] == kNone) continue;
          const Point3& q = nodes[centre[c]].position;
          const double dx = q[0] - nodes[i].position[0], dy = q[1] - nodes[i].position[1];
          if (dx * dx + dy * dy < least) {
            least = dx * dx + dy * dy;
            cluster[i] = ordinal[c];
          }
        }
      }
    }
    for (std::uint32_t c = 0; c < count; ++c) cluster[centres[c]] = kNone;  // not a member
    ArraySource::Level out;
    out.first.assign(count + 1, 0);
    for (const std::uint32_t c : cluster) {
      if (c != kNone) ++out.first[c + 1];
    }
    for (std::size_t c = 0; c < count; ++c) out.first[c + 1] += out.first[c];
    out.positions.resize(out.first.back());
    out.children.resize(std::size_t{out.first.back()} * level);
    std::vector<std::uint32_t> place(out.first.begin(), out.first.end() - 1);
    for (std::uint32_t c = 0; c < count; ++c) {
      out.boxes.push_back(nodes[centres[c]].box);
      out.errors.push_back(nodes[centres[c]].reach);
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (cluster[i] == kNone) continue;
      const std::size_t at = place[cluster[i]]++;
      out.positions[at] = nodes[i].position;
      std::copy(nodes[i].children.begin(), nodes[i].children.end(),
                out.children.begin() + static_cast<std::ptrdiff_t>(at * level));
      const Point3& head = nodes[centres[cluster[i]]].position;
      const Point3& p = nodes[i].position;
      double& error = out.errors[cluster[i]];
      error = std::max(error, std::hypot(p[0] - head[0], p[1] - head[1]) + nodes[i].reach);
      Box3& box = out.boxes[cluster[i]];
      for (std::size_t k = 0; k < 3; ++k) {
        box.min[k] = std::min(box.min[k], nodes[i].box.min[k]);
        box.max[k] = std::max(box.max[k], nodes[i].box.max[k]);
      }
    }
    std::vector<Node> up(count);
    for (std::uint32_t c = 0; c < count; ++c) {
      up[c] = std::move(nodes[centres[c]]);
      up[c].children.push_back(c);
      up[c].box = out.boxes[c];
      up[c].reach = out.errors[c];
    }
    nodes = std::move(up);
    source.levels.push_back(std::move(out));
  }
  ArraySource::Level root;
  for (const Node& node : nodes) {
    root.positions.push_back(node.position);
    root.children.insert(root.children.end(), node.children.begin(), node.children.end());
  }
  root.first.push_back(static_cast<std::uint32_t>(nodes.size()));
  root.boxes.emplace_back();
  root.errors.push_back(0.0);
  source.levels.push_back(std::move(root));
  return source;
}

/// side x side points, row by row, as in a raster's cluster.
inline std::vector<Point3> grid_points(int side) {
  std::vector<Point3> points;
  points.reserve(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      points.push_back({static_cast<double>(x), static_cast<double>(y), 0.0});
    }
  }
  return points;
}

/// Random integers of 26 bits, in the order of a k-d tree, as in a cloud's cluster.
inline std::vector<Point3> random_points(std::size_t count, std::mt19937_64& random) {
  std::vector<Point3> points(count);
  for (Point3& p : points) {
    p = {std::floor(unit(random) * 0x1p26), std::floor(unit(random) * 0x1p26), 0.0};
  }
  const auto split = [](auto&& self, std::span<Point3> part, std::size_t axis) -> void {
    if (part.size() < 3) return;
    const auto middle = part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2);
    std::nth_element(part.begin(), middle, part.end(),
                     [axis](const Point3& a, const Point3& b) { return a[axis] < b[axis]; });
    self(self, part.first(part.size() / 2), 1 - axis);
    self(self, part.subspan(part.size() / 2), 1 - axis);
  };
  split(split, points, 0);
  return points;
}

/// A triangulation wrapped in a timer, which measures the time that the model spends in it and on
/// the journal.
template <class T>
class Timed {
 public:
  using Point = typename T::Point;
  using Insertion = typename T::Insertion;
  using Changes = typename T::Changes;

  std::vector<VertexId> build(std::span<const Point> points) {
    const Lap lap(seconds());
    return inner_.build(points);
  }
  void insert(std::span<const Point> points, std::span<Insertion> results, VertexId hint) {
    const Lap lap(seconds());
    inner_.insert(points, results, hint);
  }
  void remove(std::span<const VertexId> vertices) {
    const Lap lap(seconds());
    inner_.remove(vertices);
  }
  void reserve(std::size_t vertices) {
    const Lap lap(seconds());
    inner_.reserve(vertices);
  }
  void start_journal() { inner_.start_journal(); }
  void take_changes(Changes& changes) {
    const Lap lap(journal_seconds());
    inner_.take_changes(changes);
  }
  [[nodiscard]] std::size_t vertex_count() const { return inner_.vertex_count(); }
  [[nodiscard]] bool alive(VertexId vertex) const { return inner_.alive(vertex); }
  [[nodiscard]] const T& inner() const { return inner_; }

  static double& seconds() {
    static double sum = 0.0;
    return sum;
  }
  static double& journal_seconds() {
    static double sum = 0.0;
    return sum;
  }

 private:
  T inner_;
};

}  // namespace terrace::tri::bench
