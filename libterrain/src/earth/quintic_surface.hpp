// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {

/// A function of s and t, both from 0 to 1, as a polynomial of fifth degree in each of them.
class QuinticSurface {
 public:
  static constexpr std::size_t kNodes = 6;
  /// Coefficients of a polynomial of fifth degree, the constant first.
  using Quintic = std::array<double, kNodes>;
  /// The nodes that the polynomial passes through, followed by places to check it at.
  static constexpr std::size_t kPlaces = kNodes * kNodes + 6;

  /// s and t of the places at which values are needed.
  static const std::array<Point2, kPlaces>& places();
  /// Fits the function to its values at places(). Returns nullopt if it could be off by more than
  /// `tolerance`: checks where the polynomial's error has its extremes, with a margin of eight.
  static std::optional<QuinticSurface> through(const std::array<double, kPlaces>& values,
                                               double tolerance);

  /// The function is the sum of base() and these polynomials.
  [[nodiscard]] double base() const { return base_; }
  [[nodiscard]] Quintic along(double t) const {
    Quintic row;
    for (std::size_t k = 0; k < kNodes; ++k) row[k] = value(coefficients_[k], t);
    return row;
  }
  [[nodiscard]] double at(double s, double t) const { return base_ + value(along(t), s); }
  /// Whether all terms except s, t and s t change the function by at most `tolerance`.
  [[nodiscard]] bool is_bilinear(double tolerance) const;
  /// The function without those terms.
  [[nodiscard]] double bilinear_at(double s, double t) const {
    const std::array<Quintic, kNodes>& c = coefficients_;
    return base_ + (c[0][0] + c[0][1] * t + (c[1][0] + c[1][1] * t) * s);
  }
  static double value(const Quintic& c, double t) {
    return ((((c[5] * t + c[4]) * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
  }

 private:
  /// One of the values. Powers of t amplify rounding, so the other coefficients are kept small.
  double base_ = 0.0;
  std::array<Quintic, kNodes> coefficients_{};  ///< [k][m]: of s^k t^m
};

}  // namespace terrace::terrain
