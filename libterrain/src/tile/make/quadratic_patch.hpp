// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace terrace::terrain {

/// The polynomial of second degree in both directions through 3 x 3 values: row k of the
/// coefficients has those of t^k, in powers of s along the row.
struct QuadraticPatch {
  std::array<std::array<double, 3>, 3> coefficients{};

  /// Values at 0, 1/2 and 1 each way, row by row.
  explicit QuadraticPatch(const std::array<double, 9>& values) {
    const auto through = [](double a, double b, double c) {
      return std::array{a, 4.0 * b - 3.0 * a - c, 2.0 * (a - 2.0 * b + c)};
    };
    std::array<std::array<double, 3>, 3> along{};
    for (std::size_t j = 0; j < 3; ++j) {
      along[j] = through(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
    }
    for (std::size_t m = 0; m < 3; ++m) {
      const auto down = through(along[0][m], along[1][m], along[2][m]);
      for (std::size_t k = 0; k < 3; ++k) coefficients[k][m] = down[k];
    }
  }
  /// Coefficients along the row at t.
  [[nodiscard]] std::array<double, 3> at_row(double t) const {
    std::array<double, 3> row{};
    for (std::size_t m = 0; m < 3; ++m) {
      row[m] = (coefficients[2][m] * t + coefficients[1][m]) * t + coefficients[0][m];
    }
    return row;
  }
  static double value(const std::array<double, 3>& row, double s) {
    return (row[2] * s + row[1]) * s + row[0];
  }
  [[nodiscard]] double value(double s, double t) const { return value(at_row(t), s); }
};

}  // namespace terrace::terrain
