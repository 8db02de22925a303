// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

/// What the multiresolution model needs to know of a hierarchy of clusters, whoever stores it.
///
/// Level 0 is full resolution; levels grow coarser upward to the top. A cluster of level L is
/// headed by one point whose highest level is above L and has as members points whose highest level
/// is exactly L. A point of highest level h heads one cluster on every level below h. The points of
/// the top level are the members of the root, which no point heads.

namespace terrace::tri {

/// x, y and a height. Which of them the triangulation uses is its dimension's matter.
using Point3 = std::array<double, 3>;

/// Names a cluster for the life of its source: level in the upper 8 bits, ordinal in the lower 56.
enum class ClusterId : std::uint64_t {};

constexpr ClusterId cluster_id(unsigned level, std::uint64_t ordinal) {
  return ClusterId{(std::uint64_t{level} << 56) | ordinal};
}
constexpr unsigned level_of(ClusterId id) {
  return static_cast<unsigned>(static_cast<std::uint64_t>(id) >> 56);
}
constexpr std::uint64_t ordinal_of(ClusterId id) {
  return static_cast<std::uint64_t>(id) & ((std::uint64_t{1} << 56) - 1);
}
/// For messages: "cluster 12 of level 3".
std::string to_string(ClusterId id);

/// Names a point for the life of its source: member `index` of `cluster`. Its highest level is
/// level_of(cluster).
struct PointId {
  ClusterId cluster{};
  std::uint32_t index = 0;
  friend auto operator<=>(const PointId&, const PointId&) = default;
};

/// Whether `a` stands for a vertex that both lie on: the higher level, then the smaller id.
constexpr bool stands_before(const PointId& a, const PointId& b) {
  const unsigned la = level_of(a.cluster), lb = level_of(b.cluster);
  return la != lb ? la > lb : a < b;
}

/// A closed box. Empty when min > max on any axis.
struct Box3 {
  Point3 min{}, max{};
  friend bool operator==(const Box3&, const Box3&) = default;
};

/// The box of a region in the plane: any height is inside.
constexpr Box3 box2(double min_x, double min_y, double max_x, double max_y) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {{min_x, min_y, -kInfinity}, {max_x, max_y, kInfinity}};
}
/// Whether the boxes have a point in common; false if a bound is not a number.
constexpr bool intersects(const Box3& a, const Box3& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(a.min[i] <= b.max[i] && b.min[i] <= a.max[i])) return false;
  }
  return true;
}
/// Whether all of `inner` lies in `outer`.
constexpr bool contains(const Box3& outer, const Box3& inner) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(outer.min[i] <= inner.min[i] && inner.max[i] <= outer.max[i])) return false;
  }
  return true;
}

/// What is known of a cluster before its members are read.
struct ClusterRecord {
  Box3 box;                   ///< of all descendants down to level 0, the head included
  double error = 0.0;         ///< ground metres; no descendant is farther from the head
  std::uint64_t members = 0;  ///< that read() will deliver
};

/// The members of a cluster, in the order that gives their ids. They are inserted in this order:
/// one in which neighbours follow each other (row by row for rasters, a k-d tree's for clouds)
/// is 1.2 to 1.6 times as fast as a random one, and about as fast as a Hilbert curve. A member of
/// level L has L `children`: the ordinals of the clusters that it heads on levels 0, 1, ... L - 1;
/// those of member i start at children[i * L]. What the spans show lives until the next call of
/// read().
struct ClusterMembers {
  std::span<const Point3> positions;
  std::span<const std::uint64_t> children;
};

/// Delivers clusters. Calls come from the thread that uses the model, one at a time. What it throws
/// passes through the model, which is then unchanged.
class ClusterSource {
 public:
  virtual ~ClusterSource() = default;

  /// The level of the root, cluster_id(top(), 0); 0 if the points are one level.
  [[nodiscard]] virtual unsigned top() const = 0;
  /// Number of clusters of a level below the top. Their ordinals are smaller.
  [[nodiscard]] virtual std::uint64_t cluster_count(unsigned level) const = 0;
  /// Never asked of the root.
  virtual ClusterRecord record(ClusterId id) = 0;
  virtual ClusterMembers read(ClusterId id) = 0;
  /// The ids that read() will be asked for next, in that order: a chance to fetch them at once.
  virtual void announce(std::span<const ClusterId> ids);
};

/// The source contradicts itself (or the triangulation cannot hold what it delivers). The message
/// names the cluster and the member.
class HierarchyError : public std::runtime_error {
 public:
  HierarchyError(ClusterId cluster, const std::string& what)
      : std::runtime_error(to_string(cluster) + ": " + what), cluster_(cluster) {}
  [[nodiscard]] ClusterId cluster() const { return cluster_; }

 private:
  ClusterId cluster_;
};

}  // namespace terrace::tri
