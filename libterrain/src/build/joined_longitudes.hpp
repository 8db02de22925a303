// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include <terrace/stream/schema.hpp>

namespace terrace::terrain {

/// Finds points on both sides of the antimeridian and joins them. Where longitudes are counted from
/// 0, it does the same at the meridian of 0 or 360. Longitudes then continue beyond 180 degrees, as
/// in rasters.
class JoinedLongitudes {
 public:
  /// middle: from joint(); nullopt: points are left unchanged.
  JoinedLongitudes(const stream::Placement& placement, std::optional<double> middle);

  /// Records the longitudes of stored points. With a middle, shifts them by whole turns to within
  /// half a turn of it.
  void operator()(std::span<stream::Point3> stored);

  /// How to join longitudes: shift each to within half a turn of the middle.
  struct Joint {
    double middle = 0;
    std::string reason;  ///< "are on both sides of the antimeridian" or similar
  };
  /// Returns the joint of the recorded longitudes if they span less than half the globe but their
  /// numbers span more; otherwise nullopt.
  [[nodiscard]] std::optional<Joint> joint() const;

 private:
  static constexpr std::size_t kBins = 360;

  bool degrees_;  ///< whether x is a longitude
  double scale_, offset_;
  std::optional<double> middle_;
  std::array<bool, kBins> occupied_{};  ///< by degree, starting at 0
  double least_ = std::numeric_limits<double>::infinity(), most_ = -least_;
};

}  // namespace terrace::terrain
