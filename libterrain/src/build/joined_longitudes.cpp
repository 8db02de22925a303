// SPDX-License-Identifier: Apache-2.0
#include "build/joined_longitudes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/units.hpp"
#include "earth/whole_turns.hpp"

namespace terrace::terrain {

JoinedLongitudes::JoinedLongitudes(const stream::Placement& placement, std::optional<double> middle)
    : degrees_(placement.crs.geographic && placement.crs.horizontal_unit == "degree" &&
               placement.world.xy[1] == 0 && placement.world.xy[0] != 0),
      scale_(placement.world.xy[0]),
      offset_(placement.world.xy[2]),
      middle_(middle) {}

void JoinedLongitudes::operator()(std::span<stream::Point3> stored) {
  if (!degrees_) return;
  if (middle_) {
    const WholeTurns turned(*middle_, 360);
    for (stream::Point3& p : stored) {
      const double longitude = p[0] * scale_ + offset_;
      const double turns = std::round((turned({longitude, 0})[0] - longitude) / 360);
      if (turns == 0) continue;
      // Keeps stored integers as integers if their scale divides a turn, as decimal scales do.
      const double step = 360 / scale_, rounded = std::round(step);
      p[0] += turns * (std::abs(step - rounded) < 1e-6 ? rounded : step);
    }
    return;
  }
  for (const stream::Point3& p : stored) {
    const double longitude = p[0] * scale_ + offset_;
    least_ = std::min(least_, longitude);
    most_ = std::max(most_, longitude);
    const double degree = std::floor(longitude - 360 * std::floor(longitude / 360));
    // NaN counts as the first degree.
    occupied_[degree > 0 ? std::min(static_cast<std::size_t>(degree), kBins - 1) : 0] = true;
  }
}

std::optional<JoinedLongitudes::Joint> JoinedLongitudes::joint() const {
  if (!(most_ - least_ > 180 && most_ - least_ <= 720)) return std::nullopt;
  // Finds the widest gap around the circle; a gap that continues past the last degree counts once.
  std::size_t gap = 0, gap_end = 0, run = 0;
  for (std::size_t i = 0; i < 2 * kBins; ++i) {
    run = occupied_[i % kBins] ? 0 : run + 1;
    if (run > gap) {
      gap = run;
      gap_end = i + 1;
    }
  }
  if (gap <= kBins / 2) return std::nullopt;
  const double width = static_cast<double>(kBins - gap);
  double middle = std::remainder(static_cast<double>(gap_end) + 0.5 * width, 360);
  const bool crosses = std::abs(middle) + 0.5 * width > 180;
  const bool from_zero = least_ >= 0 && most_ <= 360;
  if (middle < -90) middle += 360;
  Joint joint{.middle = middle, .reason = "are on both sides of the antimeridian"};
  if (!crosses && from_zero) joint.reason = "are on both sides of the meridian of 0";
  if (!crosses && !from_zero) {
    joint.reason = "have longitudes that are whole turns apart (" + readable_number(least_, 10) +
                   " to " + readable_number(most_, 10) + ")";
  }
  return joint;
}

}  // namespace terrace::terrain
