// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "base/digest.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// Samples of a function on a lattice of longitudes and latitudes, for tests.
class AnalyticSurface final : public TileSurface {
 public:
  using Height = std::function<double(double longitude, double latitude)>;

  AnalyticSurface(double west, double south, double step, int columns, int rows, Height height)
      : west_(west),
        south_(south),
        step_(step),
        columns_(columns),
        rows_(rows),
        height_(std::move(height)) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        samples_.push_back(height_(longitude(column), latitude(row)));
      }
    }
  }

  [[nodiscard]] GeographicBox bounds() const override {
    return {west_, south_, longitude(columns_ - 1), latitude(rows_ - 1)};
  }
  [[nodiscard]] double spacing() const override { return step_; }
  void expect(const GeographicBox& /*box*/) override {}

  void samples(const GeographicBox& box, SurfaceSamples& out) override {
    out.clear();
    visit(box, [&](int column, int row, double height) {
      out.longitude.push_back(longitude(column));
      out.latitude.push_back(latitude(row));
      out.height.push_back(height);
    });
  }

  SurfacePart part(const GeographicBox& box) override {
    if (!in_rows) return TileSurface::part(box);
    SurfaceRows out;
    int row_before = -1;
    visit(box, [&](int column, int row, double height) {
      if (row != row_before) out.latitude.push_back(latitude(row));
      row_before = row;
      if (out.latitude.size() == 1) out.longitude.push_back(longitude(column));
      out.height.push_back(height);
    });
    return out;
  }

  std::optional<HeightRange> range(const GeographicBox& box) override {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    HeightRange range{kFar, -kFar, true};
    visit(box, [&](int, int, double height) {
      range.low = std::min(range.low, height);
      range.high = std::max(range.high, height);
    });
    if (range.low > range.high) return std::nullopt;
    return range;
  }

  void heights(std::span<const double> longitude, std::span<const double> latitude,
               std::span<double> out) override {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = height_(longitude[i], latitude[i]);
  }

  void water(std::span<const double> longitude, std::span<const double> latitude,
             std::span<std::uint8_t> out) override {
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = height_(longitude[i], latitude[i]) <= 0.0 ? 1 : 0;
    }
  }

  /// Hashes all samples; the surface between them is unknown.
  std::uint64_t digest(const GeographicBox& /*box*/) override {
    Digest digest;
    for (const double height : samples_) digest.add(height);
    for (const double number : {west_, south_, step_}) digest.add(number);
    digest.add(static_cast<std::uint64_t>(columns_));
    return digest.value();
  }

  void check_stop() const override {
    if (stop_check) stop_check();
  }

  bool in_rows = true;  ///< whether part() returns rows
  base::StopCheck stop_check;

 private:
  [[nodiscard]] double longitude(int column) const { return west_ + step_ * column; }
  [[nodiscard]] double latitude(int row) const { return south_ + step_ * row; }

  template <class Visit>
  void visit(const GeographicBox& box, const Visit& visit) const {
    const auto first = [&](double from, double start, int count) {
      return static_cast<int>(
          std::clamp(std::floor((from - start) / step_), 0.0, static_cast<double>(count)));
    };
    const int c0 = first(box.west, west_, columns_), r0 = first(box.south, south_, rows_);
    for (int row = r0; row < rows_ && latitude(row) <= box.north; ++row) {
      if (latitude(row) < box.south) continue;
      for (int column = c0; column < columns_ && longitude(column) <= box.east; ++column) {
        if (longitude(column) < box.west) continue;
        visit(column, row, samples_[static_cast<std::size_t>(row * columns_ + column)]);
      }
    }
  }

  double west_, south_, step_;
  int columns_, rows_;
  Height height_;
  std::vector<double> samples_;
};

inline double hills(double lon, double lat) {
  return 900 + 400 * std::sin(lon * 12) * std::cos(lat * 15) + 15 * std::sin(lon * 310 + lat * 270);
}

}  // namespace terrace::terrain
