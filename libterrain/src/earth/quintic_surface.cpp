// SPDX-License-Identifier: Apache-2.0
#include "earth/quintic_surface.hpp"

#include <cmath>

namespace terrace::terrain {
namespace {

constexpr std::size_t kNodes = QuinticSurface::kNodes;

/// Chebyshev's nodes in [0, 1], which spread the error of the interpolating polynomial evenly, with
/// extremes at (1 - cos(k pi / 6)) / 2. C. W. Clenshaw, A. R. Curtis 1960; L. N. Trefethen,
/// Approximation Theory and Approximation Practice (2013), chapter 2.
constexpr std::array<double, kNodes> kNode{0.01703708685546585, 0.14644660940672624,
                                           0.37059047744873963, 0.62940952255126037,
                                           0.85355339059327376, 0.98296291314453415};
constexpr double kInner = 0.06698729810778066;
/// Places to check the polynomials at: combinations of each sign of the error along both axes.
constexpr std::array<Point2, 6> kChecks{
    {{0, 0}, {1, kInner}, {1 - kInner, 1}, {kInner, 1 - kInner}, {0.5, 0.5}, {0, 1}}};

/// Coefficients of the polynomial in t through values at the nodes: row k gives those of t^k.
using NodeMatrix = std::array<std::array<double, kNodes>, kNodes>;
NodeMatrix monomials() {
  NodeMatrix matrix{};
  for (std::size_t i = 0; i < kNodes; ++i) {
    // The product of (t - node) over the others, divided by its value at node i.
    std::array<double, kNodes> product{1};
    double scale = 1;
    std::size_t degree = 0;
    for (std::size_t j = 0; j < kNodes; ++j) {
      if (j == i) continue;
      ++degree;
      for (std::size_t k = degree + 1; k-- > 0;) {
        product[k] = (k > 0 ? product[k - 1] : 0.0) - kNode[j] * product[k];
      }
      scale *= kNode[i] - kNode[j];
    }
    for (std::size_t k = 0; k < kNodes; ++k) matrix[k][i] = product[k] / scale;
  }
  return matrix;
}

/// Returns coefficients [k][m] of s^k t^m, from values[j * kNodes + i] at node i of s and j of t.
std::array<QuinticSurface::Quintic, kNodes> coefficients(
    const std::array<double, kNodes * kNodes>& values, const NodeMatrix& matrix) {
  std::array<QuinticSurface::Quintic, kNodes> along{}, both{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    for (std::size_t k = 0; k < kNodes; ++k) {
      for (std::size_t i = 0; i < kNodes; ++i) along[k][j] += matrix[k][i] * values[j * kNodes + i];
    }
  }
  for (std::size_t k = 0; k < kNodes; ++k) {
    for (std::size_t m = 0; m < kNodes; ++m) {
      for (std::size_t j = 0; j < kNodes; ++j) both[k][m] += matrix[m][j] * along[k][j];
    }
  }
  return both;
}

std::array<Point2, QuinticSurface::kPlaces> all_places() {
  std::array<Point2, QuinticSurface::kPlaces> places{};
  for (std::size_t j = 0; j < kNodes; ++j) {
    for (std::size_t i = 0; i < kNodes; ++i) places[j * kNodes + i] = {kNode[i], kNode[j]};
  }
  for (std::size_t k = 0; k < kChecks.size(); ++k) places[kNodes * kNodes + k] = kChecks[k];
  return places;
}

}  // namespace

const std::array<Point2, QuinticSurface::kPlaces>& QuinticSurface::places() {
  static const std::array<Point2, kPlaces> places = all_places();
  return places;
}

bool QuinticSurface::is_bilinear(double tolerance) const {
  double most = 0.0;
  for (std::size_t k = 0; k < kNodes; ++k) {
    for (std::size_t m = 0; m < kNodes; ++m) {
      if (k > 1 || m > 1) most += std::abs(coefficients_[k][m]);
    }
  }
  return most <= tolerance;
}

std::optional<QuinticSurface> QuinticSurface::through(const std::array<double, kPlaces>& values,
                                                      double tolerance) {
  static const NodeMatrix matrix = monomials();
  QuinticSurface surface;
  surface.base_ = values[0];
  std::array<double, kNodes * kNodes> differences{};
  for (std::size_t i = 0; i < differences.size(); ++i) differences[i] = values[i] - surface.base_;
  surface.coefficients_ = coefficients(differences, matrix);
  for (std::size_t k = 0; k < kChecks.size(); ++k) {
    const double off = surface.at(kChecks[k][0], kChecks[k][1]) - values[kNodes * kNodes + k];
    // Between the checked places the error may be a few times larger. NaN fails this test.
    if (!(std::abs(off) <= tolerance / 8)) return std::nullopt;
  }
  return surface;
}

}  // namespace terrace::terrain
