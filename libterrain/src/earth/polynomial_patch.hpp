// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "terrace/terrain/region.hpp"

/// Polynomials in place of an expensive function of the plane, such as a projection, a change of
/// datum or a geoid.
///
/// Every use follows one scheme: fit polynomials to the function over a box, compare them with the
/// function where their error is largest, and use them if the error is within a tolerance.
/// Otherwise divide the box, or evaluate the function itself. The tolerance is in the unit of the
/// function's values: degrees for longitudes and latitudes (BoxGeography, GridGeography), metres
/// for a geoid (add_smooth_offsets()) and for places in a map (StoredPlaces), samples for a mask of
/// water (RasterTileSurface).

namespace terrace::terrain {

/// Where polynomials of a degree meet the function, and where they are compared with it, in the
/// unit square.
template <std::size_t kDegree>
struct PolynomialRule;

/// Chebyshev's nodes in [0, 1], which spread the error of the interpolating polynomial evenly, with
/// extremes at (1 - cos(k pi / 6)) / 2. C. W. Clenshaw, A. R. Curtis 1960; L. N. Trefethen,
/// Approximation Theory and Approximation Practice (2013), chapter 2.
template <>
struct PolynomialRule<5> {
  static constexpr std::array<double, 6> kNodes{0.01703708685546585, 0.14644660940672624,
                                                0.37059047744873963, 0.62940952255126037,
                                                0.85355339059327376, 0.98296291314453415};
  static constexpr double kInner = 0.06698729810778066;
  /// Combinations of each sign of the error along both axes.
  static constexpr std::array<Point2, 6> kChecks{
      {{0, 0}, {1, kInner}, {1 - kInner, 1}, {kInner, 1 - kInner}, {0.5, 0.5}, {0, 1}}};
  /// Between the checked places the error may be a few times larger.
  static constexpr double kMargin = 8;
  /// Whether coefficients are of differences from the first value. Powers amplify rounding, so this
  /// keeps most of them small.
  static constexpr bool kOfDifferences = true;
};

/// Ends and middle. A quadratic is farthest from a cubic at the checked places, so the margin is 1.
template <>
struct PolynomialRule<2> {
  static constexpr std::array<double, 3> kNodes{0, 0.5, 1};
  static constexpr double kFarthest = 0.2113248654051871;
  static constexpr std::array<Point2, 4> kChecks{{{kFarthest, kFarthest},
                                                  {1 - kFarthest, kFarthest},
                                                  {kFarthest, 1 - kFarthest},
                                                  {1 - kFarthest, 1 - kFarthest}}};
  static constexpr double kMargin = 1;
  static constexpr bool kOfDifferences = false;
};

/// A function over a box as polynomials of this degree in s and t, its shares of the box's sides,
/// both from 0 to 1.
template <std::size_t kDegree, std::size_t kValues>
class PolynomialPatch {
  using Rule = PolynomialRule<kDegree>;
  static constexpr std::size_t kNodes = kDegree + 1;

 public:
  using Values = std::array<double, kValues>;
  /// Coefficients of a polynomial in one variable, the constant first.
  using Coefficients = std::array<double, kNodes>;
  /// The nodes, row by row, followed by the places to compare at.
  static constexpr std::size_t kPlaces = kNodes * kNodes + Rule::kChecks.size();

  /// Returns the places in a box at which values are needed.
  static std::array<Point2, kPlaces> places(const Point2& low, const Point2& size) {
    std::array<Point2, kPlaces> places{};
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const std::size_t check = i - kNodes * kNodes;
      const Point2 share = i < kNodes * kNodes
                               ? Point2{Rule::kNodes[i % kNodes], Rule::kNodes[i / kNodes]}
                               : Rule::kChecks[check];
      places[i] = {low[0] + share[0] * size[0], low[1] + share[1] * size[1]};
    }
    return places;
  }

  /// Returns the polynomials through the values at places(); nullopt if a value in the box could be
  /// off by more than `tolerance`, or if one is NaN.
  static std::optional<PolynomialPatch> through(std::span<const Values, kPlaces> values,
                                                double tolerance) {
    PolynomialPatch patch;
    for (std::size_t value = 0; value < kValues; ++value) {
      const double base = Rule::kOfDifferences ? values[0][value] : 0.0;
      patch.base_[value] = base;
      patch.coefficients_[value] = coefficients(values, value, base);
      for (std::size_t i = 0; i < Rule::kChecks.size(); ++i) {
        const Point2& at = Rule::kChecks[i];
        const double off = patch.at(value, at[0], at[1]) - values[kNodes * kNodes + i][value];
        // NaN fails this test.
        if (!(std::abs(off) <= tolerance / Rule::kMargin)) return std::nullopt;
      }
    }
    return patch;
  }

  /// The polynomials along the row at t.
  struct Row {
    Values base{};
    std::array<Coefficients, kValues> coefficients{};
    [[nodiscard]] double operator()(std::size_t value, double s) const {
      return base[value] + sum(coefficients[value], s);
    }
  };
  [[nodiscard]] Row row(double t) const {
    Row row{base_, {}};
    for (std::size_t value = 0; value < kValues; ++value) row.coefficients[value] = along(value, t);
    return row;
  }
  [[nodiscard]] double at(std::size_t value, double s, double t) const {
    return base_[value] + sum(along(value, t), s);
  }

  /// Whether all terms of a value except s, t and s t change it by at most `tolerance`.
  [[nodiscard]] bool is_bilinear(std::size_t value, double tolerance) const {
    double change = 0.0;
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t m = 0; m < kNodes; ++m) {
        if (k > 1 || m > 1) change += std::abs(coefficients_[value][k][m]);
      }
    }
    return change <= tolerance;
  }
  /// The value without those terms.
  [[nodiscard]] double bilinear_at(std::size_t value, double s, double t) const {
    const std::array<Coefficients, kNodes>& c = coefficients_[value];
    return base_[value] + (c[0][0] + c[0][1] * t + (c[1][0] + c[1][1] * t) * s);
  }

 private:
  using Matrix = std::array<Coefficients, kNodes>;

  static double sum(const Coefficients& c, double t) {
    double sum = c[kDegree];
    for (std::size_t k = kDegree; k-- > 0;) sum = sum * t + c[k];
    return sum;
  }
  [[nodiscard]] Coefficients along(std::size_t value, double t) const {
    Coefficients row;
    for (std::size_t k = 0; k < kNodes; ++k) row[k] = sum(coefficients_[value][k], t);
    return row;
  }

  /// Coefficients of the polynomial in t through values at the nodes: row k gives those of t^k.
  static Matrix monomials() {
    Matrix matrix{};
    for (std::size_t i = 0; i < kNodes; ++i) {
      // The product of (t - node) over the others, divided by its value at node i.
      Coefficients product{1};
      double scale = 1;
      std::size_t degree = 0;
      for (std::size_t j = 0; j < kNodes; ++j) {
        if (j == i) continue;
        ++degree;
        for (std::size_t k = degree + 1; k-- > 0;) {
          product[k] = (k > 0 ? product[k - 1] : 0.0) - Rule::kNodes[j] * product[k];
        }
        scale *= Rule::kNodes[i] - Rule::kNodes[j];
      }
      for (std::size_t k = 0; k < kNodes; ++k) matrix[k][i] = product[k] / scale;
    }
    return matrix;
  }
  /// Returns coefficients [k][m] of s^k t^m.
  static Matrix coefficients(std::span<const Values, kPlaces> values, std::size_t value,
                             double base) {
    static const Matrix matrix = monomials();
    Matrix along{}, both{};
    for (std::size_t j = 0; j < kNodes; ++j) {
      for (std::size_t k = 0; k < kNodes; ++k) {
        for (std::size_t i = 0; i < kNodes; ++i) {
          along[k][j] += matrix[k][i] * (values[j * kNodes + i][value] - base);
        }
      }
    }
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t m = 0; m < kNodes; ++m) {
        for (std::size_t j = 0; j < kNodes; ++j) both[k][m] += matrix[m][j] * along[k][j];
      }
    }
    return both;
  }

  Values base_{};
  std::array<Matrix, kValues> coefficients_{};
};

/// From two numbers to two, such as a projection.
using PlacePatch = PolynomialPatch<5, 2>;

/// A grid of patches over a box, for places in any order: the result for a place does not depend on
/// the other places. Several threads may call const members at once.
class PatchGrid {
 public:
  /// Without patches.
  PatchGrid() = default;
  /// longest: the longest side of a patch; exceeded if the box would need more than 64 patches
  /// along a side. fit(low, size): returns the patch of a box, or nullopt.
  template <class Fit>
  PatchGrid(const Point2& low, const Point2& high, const Point2& longest, const Fit& fit)
      : low_(low) {
    constexpr double kMaxPatches = 64;
    Point2 size{};
    std::array<std::size_t, 2> count{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double extent = high[axis] - low[axis];
      if (!(extent > 0) || !std::isfinite(extent / longest[axis])) return;
      const double patches = std::clamp(std::ceil(extent / longest[axis]), 1.0, kMaxPatches);
      size[axis] = extent / patches;
      per_unit_[axis] = patches / extent;
      count[axis] = static_cast<std::size_t>(patches);
    }
    columns_ = count[0];
    rows_ = count[1];
    for (std::size_t i = 0; i < columns_ * rows_; ++i) {
      const Point2 corner{low_[0] + static_cast<double>(i % columns_) * size[0],
                          low_[1] + static_cast<double>(i / columns_) * size[1]};
      patches_.push_back(fit(corner, size));
    }
  }

  /// Converts in place. finish(values) turns the values of polynomials into the result of a place.
  /// exact(places) converts a span in place, where polynomials are not accurate enough.
  template <class Exact, class Finish>
  void convert(std::span<Point2> places, const Exact& exact, const Finish& finish) const {
    std::size_t done = 0;  // the places before this index
    for (std::size_t i = 0; i < places.size(); ++i) {
      Point2 values = places[i];
      if (!approximate(values)) continue;
      if (done < i) exact(places.subspan(done, i - done));
      places[i] = finish(values);
      done = i + 1;
    }
    if (done < places.size()) exact(places.subspan(done));
  }

 private:
  /// Returns false and leaves the place unchanged where there is no patch.
  bool approximate(Point2& place) const {
    const double s = (place[0] - low_[0]) * per_unit_[0];
    const double t = (place[1] - low_[1]) * per_unit_[1];
    if (patches_.empty() || !(s >= 0 && s <= static_cast<double>(columns_) && t >= 0 &&
                              t <= static_cast<double>(rows_))) {
      return false;
    }
    const std::size_t column = std::min(static_cast<std::size_t>(s), columns_ - 1);
    const std::size_t row = std::min(static_cast<std::size_t>(t), rows_ - 1);
    const std::optional<PlacePatch>& patch = patches_[row * columns_ + column];
    if (!patch) return false;
    const PlacePatch::Row along = patch->row(t - static_cast<double>(row));
    const double across = s - static_cast<double>(column);
    place = {along(0, across), along(1, across)};
    return true;
  }

  Point2 low_{}, per_unit_{};  ///< of the box; patches per unit of the coordinates
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<std::optional<PlacePatch>> patches_;
};

/// A rectangle of the cells or samples of a lattice.
struct LatticePart {
  std::size_t column = 0, row = 0, columns = 0, rows = 0;
};

/// Calls handle(part); where that returns false, does the same with the part's quarters.
template <class Handle>
void divide(const LatticePart& part, const Handle& handle) {
  if (handle(part)) return;
  const std::size_t left = part.columns / 2, upper = part.rows / 2;
  divide(LatticePart{part.column, part.row, left, upper}, handle);
  divide(LatticePart{part.column + left, part.row, part.columns - left, upper}, handle);
  divide(LatticePart{part.column, part.row + upper, left, part.rows - upper}, handle);
  divide(LatticePart{part.column + left, part.row + upper, part.columns - left, part.rows - upper},
         handle);
}

/// Adds to each height, to within `tolerance`, what exact(places, heights) would add. The offsets
/// must be smooth except along some lines, as geoids are along the lines of their grids. Uses
/// PolynomialPatch in boxes around places. A box where it is not accurate enough is quartered along
/// common grid lines. NaN heights stay NaN. Both spans must have the same size. The same places
/// give the same heights; a place among other places may get a height that differs by the
/// tolerance. 66 to 240 million heights per second and core for EGM96 at neighbouring places, 4
/// million one by one (tests/bench/geography_bench).
void add_smooth_offsets(
    std::span<const Point2> places, std::span<double> heights, double tolerance,
    const std::function<void(std::span<const Point2>, std::span<double>)>& exact);

}  // namespace terrace::terrain
