// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>
#include <utility>

#include <GeographicLib/Math.hpp>

#include "earth/crs/projection.hpp"

namespace GeographicLib {
class LambertConformalConic;
}

namespace terrace::terrain {

inline constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// A formula for one place, with false origin (metres) and central meridian (degrees), as a
/// Projection: Formula has `Point2 forward(longitude difference, latitude) const` and
/// `Point2 reverse(x, y) const`, which gives those.
template <class Formula>
class ProjectionBatch final : public Projection {
 public:
  ProjectionBatch(Formula formula, const ProjectionParameters& p)
      : formula_(std::move(formula)),
        longitude_(p.longitude),
        east_(p.false_easting),
        north_(p.false_northing) {}

  void forward(std::span<Point2> places) const override {
    for (Point2& place : places) {
      const double turn = GeographicLib::Math::AngDiff(longitude_, place[0]);
      if (!(std::abs(place[1]) <= 90.0) || !std::isfinite(turn)) {
        place = {kNowhere, kNowhere};
        continue;
      }
      const Point2 plane = formula_.forward(turn, place[1]);
      place = {plane[0] + east_, plane[1] + north_};
      if (!std::isfinite(place[0]) || !std::isfinite(place[1])) place = {kNowhere, kNowhere};
    }
  }

  void reverse(std::span<Point2> places) const override {
    for (Point2& place : places) {
      const Point2 found = formula_.reverse(place[0] - east_, place[1] - north_);
      place = {GeographicLib::Math::AngNormalize(found[0] + longitude_), found[1]};
      if (!std::isfinite(place[0]) || !std::isfinite(place[1])) place = {kNowhere, kNowhere};
    }
  }

 private:
  Formula formula_;
  double longitude_, east_, north_;
};

/// y counts from `latitude`. Throws: std::invalid_argument where a parallel lies at a pole, or the
/// origin at infinity.
std::unique_ptr<const Projection> make_conformal_cone(
    const GeographicLib::LambertConformalConic& library, const ProjectionParameters& p,
    double latitude);
std::unique_ptr<const Projection> make_lambert_azimuthal(const ProjectionParameters& p,
                                                         const Ellipsoid& ellipsoid);
std::unique_ptr<const Projection> make_oblique_stereographic(const ProjectionParameters& p,
                                                             const Ellipsoid& ellipsoid);
/// rectified_at_centre: variant B.
std::unique_ptr<const Projection> make_hotine(const ProjectionParameters& p,
                                              const Ellipsoid& ellipsoid, bool rectified_at_centre);

}  // namespace terrace::terrain
