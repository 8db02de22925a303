// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/cluster/point.hpp>

/// Point sets of any size in constant memory that stand in for those of the thesis. Points are
/// generated when they are read, anywhere in the stream, and are the same each time.

namespace terrace::research {

using cluster::Point3;

class PointSet {
 public:
  explicit PointSet(std::uint64_t size) : size_(size) {}
  virtual ~PointSet() = default;
  PointSet(const PointSet&) = delete;
  PointSet& operator=(const PointSet&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Reads the points first, first + 1, ... Requires: first + points.size() <= size().
  virtual void read(std::uint64_t first, std::span<Point3> points) = 0;

 private:
  std::uint64_t size_;
};

/// Makes a fractal elevation model on a square lattice, in tiles of 100 x 100 points, tile after
/// tile, in patches of 4 x 4 tiles, patch after patch. Neighbours in a row are `cell` apart and
/// differ by `step` in height (root mean square). Heights are integers. Patches are independent
/// fractals on a common undulating base.
std::unique_ptr<PointSet> make_terrain(std::uint64_t size, double cell, double step,
                                       std::uint64_t seed);

/// Makes a bumpy closed surface as seen by a laser scanner: swaths from pole to pole, one after
/// another, at most 500 points wide, with about the same density along and across.
std::unique_ptr<PointSet> make_scan(std::uint64_t size, std::uint64_t seed);

/// Makes a plant full of pipes instead of a surface: rings of 12 points, 40 per pipe, 64 pipes per
/// cell of a cubic lattice, cell after cell.
std::unique_ptr<PointSet> make_plant(std::uint64_t size, std::uint64_t seed);

/// Returns uniform random points in the unit square, with z = 0.
[[nodiscard]] std::vector<Point3> uniform_points(std::size_t count, std::uint64_t seed);

/// A point set of the thesis and how it is generated here.
struct NamedSet {
  enum class Kind : std::uint8_t { terrain, scan, plant };
  std::string_view thesis_name;
  std::uint64_t thesis_points;
  Kind kind;
  double cell = 0.0, step = 0.0;  ///< for terrains only

  /// Returns for example "terrain, as Grand Canyon".
  [[nodiscard]] std::string name() const;
  [[nodiscard]] std::unique_ptr<PointSet> make(std::uint64_t size) const;
};

/// Returns the eight sets of tables 7.2, 7.3, 7.6 and 7.7, in that order.
std::span<const NamedSet> large_sets();
/// Returns the four sets of table 7.4.
std::span<const NamedSet> single_sets();

}  // namespace terrace::research
