// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// The data of clusters that a view needs, in columns, so that thousands can be measured per step:
/// box, error, level and, for outlines, the cone. 57 bytes per cluster, 89 with cones.
class ViewColumns {
 public:
  /// Columns 0..2 hold the minima of the boxes in x, y, z, columns 3..5 the maxima, 6 the errors.
  /// With cones 7..9 hold the axes, 10 the sines of the half angles.
  static constexpr std::size_t kError = 6, kAxis = 7, kSine = 10, kColumns = 11;

  explicit ViewColumns(bool cones = false) : cones_(cones) {}
  [[nodiscard]] std::size_t size() const { return levels_.size(); }
  [[nodiscard]] bool cones() const { return cones_; }
  [[nodiscard]] const double* column(std::size_t c) const { return columns_[c].data(); }
  [[nodiscard]] const std::uint8_t* levels() const { return levels_.data(); }
  [[nodiscard]] double error(std::size_t i) const { return columns_[kError][i]; }

  void resize(std::size_t size) {
    for (std::size_t c = 0; c < (cones_ ? kColumns : kAxis); ++c) columns_[c].resize(size);
    levels_.resize(size);
  }
  /// A box that is empty or has a NaN bound is never in view. A NaN or negative error counts as
  /// infinite.
  void set(std::size_t i, const ClusterRecord& record, unsigned level);
  /// Sets the box and the error alone.
  void set_bounds(std::size_t i, const ClusterRecord& record);
  void set_cone(std::size_t i, const NormalCone& cone);
  void set_error(std::size_t i, double error) { columns_[kError][i] = error; }
  void copy(std::size_t i, const ViewColumns& from, std::size_t j);
  /// Extends the box of entry i to contain the box of entry j.
  void join(std::size_t i, const ViewColumns& from, std::size_t j);
  [[nodiscard]] std::size_t memory() const;

 private:
  bool cones_;
  std::array<std::vector<double>, kColumns> columns_;
  std::vector<std::uint8_t> levels_;
};

/// How urgently clusters are wanted: error over tolerance. A cluster should be expanded if this is
/// above 1.
struct ViewDemand {
  /// Minimum demand of a cluster requested by a level or by name.
  static constexpr double kForced = 1e300;

  std::vector<double> want;      ///< by the view itself
  std::vector<double> keep;      ///< by the view widened by the guard; not less than want
  std::vector<double> distance;  ///< distance of the box from the camera, or 0 without a camera

  void resize(std::size_t size) {
    want.resize(size);
    keep.resize(size);
    distance.resize(size);
  }
};

/// Measures entries from `first` to `last`. If a cluster is inside the box of another and has no
/// greater error, neither of its demands is greater, including rounding. Outlines can violate that.
/// O(entries * (7 + focuses + regions)).
void measure(const View& view, const ViewOptions& options, const ViewColumns& columns,
             std::size_t first, std::size_t last, ViewDemand& demand);

/// Throws std::invalid_argument if a tolerance is negative or NaN.
void check(const View& view);
/// The same for options.
void check(const ViewOptions& options);

}  // namespace terrace::tri
