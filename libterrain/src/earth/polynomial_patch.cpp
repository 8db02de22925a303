// SPDX-License-Identifier: Apache-2.0
#include "earth/polynomial_patch.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/base/box.hpp>

namespace terrace::terrain {
namespace {

/// Below this number, polynomials cost more than they save.
constexpr std::size_t kFewestOffsets = 256;

using Exact = std::function<void(std::span<const Point2>, std::span<double>)>;
using OffsetPatch = PolynomialPatch<5, 1>;

/// Returns where to split a range of longitudes or latitudes: near its middle, on a common grid
/// line if there is one, so that the function may be smooth on either side.
double cut_between(double low, double high) {
  constexpr std::array<double, 4> kLinesPerDegree{4, 12, 24, 60};
  const double middle = low + (high - low) / 2.0;
  for (const double lines : kLinesPerDegree) {
    const double line = std::round(middle * lines) / lines;
    if (line > low && line < high) return line;
  }
  return middle;
}

class Adder {
 public:
  Adder(std::span<const Point2> places, std::span<double> heights, double tolerance,
        const Exact& exact)
      : places_(places), heights_(heights), tolerance_(tolerance), exact_(exact) {}

  /// Handles the places with these numbers, which it reorders.
  void add(std::span<std::uint32_t> numbers) {
    if (numbers.size() < kFewestOffsets) return add_exactly(numbers);
    base::Box2 box;
    for (const std::uint32_t i : numbers) box.include(places_[i]);
    if (add_by_polynomials(box, numbers)) return;
    const Point2 cut{cut_between(box.min[0], box.max[0]), cut_between(box.min[1], box.max[1])};
    const auto south = std::partition(numbers.begin(), numbers.end(),
                                      [&](std::uint32_t i) { return places_[i][1] < cut[1]; });
    for (const auto& [begin, end] : {std::pair(numbers.begin(), south), {south, numbers.end()}}) {
      const auto west =
          std::partition(begin, end, [&](std::uint32_t i) { return places_[i][0] < cut[0]; });
      for (const std::span<std::uint32_t> quarter :
           {std::span(begin, west), std::span(west, end)}) {
        // All places are equal.
        if (quarter.size() == numbers.size()) return add_exactly(quarter);
        if (!quarter.empty()) add(quarter);
      }
    }
  }

 private:
  void add_exactly(std::span<const std::uint32_t> numbers) {
    some_places_.clear();
    for (const std::uint32_t i : numbers) some_places_.push_back(places_[i]);
    some_heights_.assign(numbers.size(), 0.0);
    exact_(some_places_, some_heights_);
    for (std::size_t k = 0; k < numbers.size(); ++k) heights_[numbers[k]] += some_heights_[k];
  }
  bool add_by_polynomials(const base::Box2& box, std::span<const std::uint32_t> numbers) {
    const Point2 size{box.max[0] - box.min[0], box.max[1] - box.min[1]};
    const std::array<Point2, OffsetPatch::kPlaces> at = OffsetPatch::places(box.min, size);
    std::array<double, OffsetPatch::kPlaces> offsets{};
    exact_(at, offsets);
    std::array<OffsetPatch::Values, OffsetPatch::kPlaces> values{};
    for (std::size_t i = 0; i < offsets.size(); ++i) values[i] = {offsets[i]};
    const std::optional<OffsetPatch> patch = OffsetPatch::through(values, tolerance_);
    if (!patch) return false;
    // Along a single meridian or parallel the function has one variable.
    const double s = size[0] > 0 ? 1.0 / size[0] : 0.0, t = size[1] > 0 ? 1.0 / size[1] : 0.0;
    const auto add_all = [&](const auto& offset) {
      for (const std::uint32_t i : numbers) {
        heights_[i] += offset((places_[i][0] - box.min[0]) * s, (places_[i][1] - box.min[1]) * t);
      }
    };
    // Most grids are interpolated bilinearly.
    if (patch->is_bilinear(0, tolerance_ / 8)) {
      add_all([&](double u, double v) { return patch->bilinear_at(0, u, v); });
    } else {
      add_all([&](double u, double v) { return patch->at(0, u, v); });
    }
    return true;
  }

  std::span<const Point2> places_;
  std::span<double> heights_;
  double tolerance_;
  const Exact& exact_;
  std::vector<Point2> some_places_;
  std::vector<double> some_heights_;
};

}  // namespace

void add_smooth_offsets(
    std::span<const Point2> places, std::span<double> heights, double tolerance,
    const std::function<void(std::span<const Point2>, std::span<double>)>& exact) {
  assert(places.size() == heights.size());
  if (places.size() < kFewestOffsets) return exact(places, heights);
  std::vector<std::uint32_t> numbers;
  numbers.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    if (std::isfinite(places[i][0]) && std::isfinite(places[i][1])) {
      numbers.push_back(static_cast<std::uint32_t>(i));
    } else {
      heights[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  Adder(places, heights, tolerance, exact).add(numbers);
}

}  // namespace terrace::terrain
