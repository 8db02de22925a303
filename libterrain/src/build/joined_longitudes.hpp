// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include <terrace/stream/schema.hpp>

namespace terrace::terrain {

/// Finds points that are on both sides of the antimeridian (or of the meridian of 0 or 360, where
/// longitudes are counted from 0), and joins them: longitudes go on beyond 180 degrees then, as
/// those of rasters do.
class JoinedLongitudes {
 public:
  /// middle: see Joint; nullopt: points stay as they are.
  JoinedLongitudes(const stream::Placement& placement, std::optional<double> middle);

  /// Looks at stored points, and moves them by whole turns to half a turn on either side of the
  /// middle.
  void operator()(std::span<stream::Point3> stored);

  /// Longitudes as they are joined: to half a turn on either side of the middle.
  struct Joint {
    double middle = 0;
    std::string what;  ///< "are on both sides of the antimeridian", or what else is wrong with them
  };
  /// The joint of the longitudes seen, if they span less than half the globe, but more than that as
  /// they are written.
  [[nodiscard]] std::optional<Joint> joint() const;

 private:
  static constexpr std::size_t kBins = 360;

  bool degrees_;  ///< x is a longitude
  double scale_, offset_;
  std::optional<double> middle_;
  std::array<bool, kBins> seen_{};  ///< by the degree from 0
  double least_ = std::numeric_limits<double>::infinity(), most_ = -least_;
};

}  // namespace terrace::terrain
