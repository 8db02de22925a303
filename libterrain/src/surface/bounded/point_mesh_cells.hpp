// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include <terrace/stream/point.hpp>
#include <terrace/tri/point_tin.hpp>

#include "terrace/terrain/region.hpp"

/// A kd-like division of the plane into cells of samples.

namespace terrace::terrain {

inline constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();

/// A half-open rectangle of the plane, with its lower borders but without its upper ones, so that
/// each sample is in one cell. May be infinite.
struct PlaneBox {
  Point2 min{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Point2 max{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool contains(const Point2& p) const {
    return p[0] >= min[0] && p[0] < max[0] && p[1] >= min[1] && p[1] < max[1];
  }
  [[nodiscard]] bool meets(const PlaneBox& other) const {
    return min[0] < other.max[0] && other.min[0] < max[0] && min[1] < other.max[1] &&
           other.min[1] < max[1];
  }
};

/// The plane, divided repeatedly by lines of equal x or y until every cell has few samples.
///
/// Unlike WindowTree, which halves closed boxes and whose windows only group work, these lines
/// become sides of the mesh. So they avoid samples, cells are nearly full, and each sample belongs
/// to one cell. Coordinates are those of the mesh's CRS.
struct PointMeshCuts {
  /// A line and its two sides.
  struct Node {
    unsigned axis = 0;  ///< 0: a line of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> next{};      ///< nodes, or kCell + a cell
    std::uint32_t first_cell = 0, cells = 0;  ///< cells on both sides
  };
  struct Cell {
    PlaneBox box;
    Point2 low{}, high{};  ///< approximate bounds of its samples
    double samples = 0.0;  ///< approximate
    double spacing = 0.0;  ///< approximate distance of neighbours
  };
  static constexpr std::uint32_t kCell = 0x80000000U;
  std::vector<Node> nodes;
  std::vector<Cell> cells;  ///< neighbours are mostly close in this order
  std::uint32_t root = kCell;

  [[nodiscard]] std::uint32_t cell_of(const Point2& p) const {
    std::uint32_t at = root;
    while (at < kCell) {
      const Node& node = nodes[at];
      at = node.next[p[node.axis] < node.line ? 0 : 1];
    }
    return at - kCell;
  }
};

/// Divides the plane into cells of slightly fewer than `max_per_cell` samples, unless too many
/// share a place. sample: every `period`-th sample of all.
///
/// Where possible, lines are between the given samples, in the widest gap near the ideal position.
/// Other samples may be on a line; they belong to the cell above. Depends only on the arguments.
/// O(n log n) for n given samples.
PointMeshCuts cut_for_point_mesh(std::vector<Point2> sample, std::uint64_t period,
                                 std::size_t max_per_cell);

/// Returns a number with few binary digits strictly between a and b, not close to either; a if
/// there is none between. Requires a < b.
double number_between(double a, double b);

/// Samples in the CRS's coordinates.
struct MeshSamples {
  std::vector<double> x, y, z;

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void reserve(std::size_t count) {
    for (std::vector<double>* axis : {&x, &y, &z}) axis->reserve(count);
  }
  void add(const stream::Point3& p) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
};

/// Appends the samples of some cells that are in the box, cell by cell. Of several samples at one
/// place, the one that represents them comes first. Several threads may call it at once.
using ReadCells = std::function<void(std::uint32_t first_cell, std::uint32_t cells,
                                     const PlaneBox& box, MeshSamples& out)>;

/// Returns the height that represents several samples at one place, as in tri::point_tin(). With
/// `error` it is that of the first, with `all` the middle between the lowest and the highest.
/// heights: in order, not empty.
double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates);

/// The places shared by several samples.
struct SharedPlaces {
  std::uint64_t places = 0;
  double range = 0.0;  ///< largest difference of heights at a place
  Point2 widest{};     ///< the place with that difference

  /// Adds the shared places of more samples, none of which shares a place with earlier samples. O(n
  /// log n).
  void add(const MeshSamples& samples);
};

}  // namespace terrace::terrain
