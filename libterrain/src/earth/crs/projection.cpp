// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <GeographicLib/AlbersEqualArea.hpp>
#include <GeographicLib/LambertConformalConic.hpp>
#include <GeographicLib/Math.hpp>
#include <GeographicLib/PolarStereographic.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <terrace/base/portable_math.hpp>

namespace terrace::terrain {
namespace {

using Parameters = ProjectionParameters;

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// Applies the formula for one place to many, with false origin (metres) and central meridian
/// (degrees). Formula has `Point2 forward(longitude difference, latitude) const` and `Point2
/// reverse(x, y) const`, its inverse.
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
      const Point2 geographic = formula_.reverse(place[0] - east_, place[1] - north_);
      place = {GeographicLib::Math::AngNormalize(geographic[0] + longitude_), geographic[1]};
      if (!std::isfinite(place[0]) || !std::isfinite(place[1])) place = {kNowhere, kNowhere};
    }
  }

 private:
  Formula formula_;
  double longitude_, east_, north_;
};

/// Converts a place to x, y with a projection of GeographicLib with a central meridian, and back.
template <class Library>
Point2 plane_of(const Library& library, double turn, double latitude) {
  Point2 plane{};
  library.Forward(0, latitude, turn, plane[0], plane[1]);
  return plane;
}
template <class Library>
Point2 place_of(const Library& library, double x, double y) {
  Point2 place{};
  library.Reverse(0, x, y, place[1], place[0]);
  return place;
}

/// Such a projection with y measured from `latitude`.
template <class Library>
class WithMeridian {
 public:
  WithMeridian(Library library, double latitude)
      : library_(std::move(library)), north_(plane_of(library_, 0, latitude)[1]) {}
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    const Point2 plane = plane_of(library_, turn, latitude);
    return {plane[0], plane[1] - north_};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    return place_of(library_, x, y + north_);
  }

 private:
  Library library_;
  double north_;
};

template <class Library>
std::unique_ptr<const Projection> with_meridian(Library library, const Parameters& p,
                                                double latitude) {
  return std::make_unique<ProjectionBatch<WithMeridian<Library>>>(
      WithMeridian<Library>(std::move(library), latitude), p);
}

/// Albers. Cones open to the south are computed mirrored at the equator, because the inverse in
/// GeographicLib 2.1.2 returns their latitudes with the wrong sign.
class Albers {
 public:
  Albers(const Parameters& p, const Ellipsoid& ellipsoid)
      : sign_(p.parallel1 + p.parallel2 < 0 ? -1.0 : 1.0),
        cone_(GeographicLib::AlbersEqualArea(ellipsoid.semi_major, ellipsoid.flattening(),
                                             sign_ * p.parallel1, sign_ * p.parallel2, p.scale),
              sign_ * p.latitude) {}
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    const Point2 plane = cone_.forward(turn, sign_ * latitude);
    return {plane[0], sign_ * plane[1]};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    const Point2 place = cone_.reverse(x, sign_ * y);
    return {place[0], sign_ * place[1]};
  }

 private:
  double sign_;
  WithMeridian<GeographicLib::AlbersEqualArea> cone_;
};

/// Lambert's conformal conic, and Mercator as the cone that is a cylinder. GeographicLib 2.1.2
/// treats a pole as a place slightly off it, which a flat cone maps thousands of kilometres away.
/// So the apex is computed here, and the other pole has no image.
class ConformalCone {
 public:
  ConformalCone(const GeographicLib::LambertConformalConic& library, const ProjectionParameters& p,
                double latitude)
      : library_(library) {
    for (const double parallel : {library.OriginLatitude(), p.parallel1, p.parallel2}) {
      if (std::abs(parallel) == 90) {
        throw std::invalid_argument("a parallel of a conformal cone is at a pole");
      }
    }
    double x = 0, y = 0, turned = 0, scale = 0;
    library_.Forward(0, library_.OriginLatitude(), 90, x, y, turned, scale);
    if (turned != 0) {
      pole_ = turned > 0 ? 90 : -90;
      apex_ = y + x / std::tan(turned * base::kRadiansPerDegree);
    }
    north_ = forward(0, latitude)[1];
    if (!std::isfinite(north_)) throw std::invalid_argument("its origin is the pole at infinity");
  }
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    if (latitude == pole_) return {0, apex_ - north_};
    if (std::abs(latitude) == 90) return {kNowhere, kNowhere};
    const Point2 plane = plane_of(library_, turn, latitude);
    return {plane[0], plane[1] - north_};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    return place_of(library_, x, y + north_);
  }

 private:
  GeographicLib::LambertConformalConic library_;
  double north_ = 0, pole_ = kNowhere, apex_ = kNowhere;
};

std::unique_ptr<const Projection> conformal_cone(
    const GeographicLib::LambertConformalConic& library, const Parameters& p, double latitude) {
  return std::make_unique<ProjectionBatch<ConformalCone>>(ConformalCone(library, p, latitude), p);
}

class Polar {
 public:
  Polar(const GeographicLib::PolarStereographic& library, bool north)
      : library_(library), north_(north) {}
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    // The other pole is at infinity.
    if (latitude == (north_ ? -90.0 : 90.0)) return {kNowhere, kNowhere};
    double x = 0, y = 0;
    library_.Forward(north_, latitude, turn, x, y);
    return {x, y};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    double latitude = 0, turn = 0;
    library_.Reverse(north_, x, y, latitude, turn);
    return {turn, latitude};
  }

 private:
  GeographicLib::PolarStereographic library_;
  bool north_;
};

std::unique_ptr<const Projection> polar_stereographic(const Parameters& p,
                                                      const Ellipsoid& ellipsoid, bool true_scale) {
  const double latitude = true_scale ? p.parallel1 : p.latitude;
  if (true_scale ? latitude == 0 : std::abs(latitude) != 90) {
    throw std::invalid_argument("a polar stereographic projection is centred on a pole");
  }
  GeographicLib::PolarStereographic library(ellipsoid.semi_major, ellipsoid.flattening(),
                                            true_scale ? 1.0 : p.scale);
  if (true_scale) library.SetScale(std::abs(latitude), p.scale);
  return std::make_unique<ProjectionBatch<Polar>>(Polar(library, latitude > 0), p);
}

/// EPSG 1024; Guidance Note 7-2, section 3.2.1.2.
class WebMercator {
 public:
  explicit WebMercator(double radius) : radius_(radius) {}
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    if (std::abs(latitude) == 90) return {kNowhere, kNowhere};
    return {radius_ * turn * base::kRadiansPerDegree,
            radius_ * std::asinh(std::tan(latitude * base::kRadiansPerDegree))};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    return {x / radius_ / base::kRadiansPerDegree,
            std::atan(std::sinh(y / radius_)) / base::kRadiansPerDegree};
  }

 private:
  double radius_;
};

std::unique_ptr<const Projection> make(ProjectionMethod method, const Parameters& p,
                                       const Ellipsoid& ellipsoid) {
  const double a = ellipsoid.semi_major, f = ellipsoid.flattening();
  using GeographicLib::LambertConformalConic;
  switch (method) {
    case ProjectionMethod::transverse_mercator:
      return with_meridian(GeographicLib::TransverseMercator(a, f, p.scale), p, p.latitude);
    case ProjectionMethod::lambert_1sp:
      return conformal_cone(LambertConformalConic(a, f, p.latitude, p.scale), p, p.latitude);
    case ProjectionMethod::lambert_2sp:
      return conformal_cone(LambertConformalConic(a, f, p.parallel1, p.parallel2, p.scale), p,
                            p.latitude);
    case ProjectionMethod::albers:
      return std::make_unique<ProjectionBatch<Albers>>(Albers(p, ellipsoid), p);
    case ProjectionMethod::mercator_a:
      // The cone that touches the equator, a cylinder.
      return conformal_cone(LambertConformalConic(a, f, 0, p.scale), p, 0);
    case ProjectionMethod::mercator_b: {
      double x = 0, y = 0, convergence = 0, scale = 1;
      LambertConformalConic(a, f, 0, 1).Forward(0, p.parallel1, 0, x, y, convergence, scale);
      return conformal_cone(LambertConformalConic(a, f, 0, p.scale / scale), p, 0);
    }
    case ProjectionMethod::polar_stereographic_a:
      return polar_stereographic(p, ellipsoid, false);
    case ProjectionMethod::polar_stereographic_b:
      return polar_stereographic(p, ellipsoid, true);
    case ProjectionMethod::web_mercator:
      return std::make_unique<ProjectionBatch<WebMercator>>(WebMercator(a), p);
  }
  throw std::invalid_argument("unknown projection method");
}

}  // namespace

bool nearly_equal(const ProjectionParameters& one, const ProjectionParameters& other) {
  // Two parallels may be in either order.
  ProjectionParameters a = one, b = other;
  for (ProjectionParameters* const p : {&a, &b}) {
    if (p->parallel1 < p->parallel2) std::swap(p->parallel1, p->parallel2);
  }
  using P = ProjectionParameters;
  for (double P::*const member : {&P::latitude, &P::longitude, &P::scale, &P::parallel1,
                                  &P::parallel2, &P::false_easting, &P::false_northing}) {
    const double x = a.*member, y = b.*member;
    if (std::abs(x - y) > 1e-11 * std::max({1.0, std::abs(x), std::abs(y)})) return false;
  }
  return true;
}

std::unique_ptr<const Projection> make_projection(ProjectionMethod method,
                                                  const ProjectionParameters& parameters,
                                                  const Ellipsoid& ellipsoid) {
  const ProjectionParameters& p = parameters;
  for (const double value : {p.latitude, p.longitude, p.scale, p.parallel1, p.parallel2,
                             p.false_easting, p.false_northing}) {
    if (!std::isfinite(value)) throw std::invalid_argument("a parameter is not finite");
  }
  for (const double latitude : {p.latitude, p.parallel1, p.parallel2}) {
    if (std::abs(latitude) > 90) {
      throw std::invalid_argument("a latitude of its parameters is beyond a pole");
    }
  }
  if (!(p.scale > 0)) throw std::invalid_argument("its scale factor is not positive");
  if (!(ellipsoid.semi_major > 0 && std::isfinite(ellipsoid.semi_major) &&
        ellipsoid.flattening() >= 0 && ellipsoid.flattening() < 0.5)) {
    throw std::invalid_argument("its ellipsoid is impossible");
  }
  try {
    return make(method, p, ellipsoid);
  } catch (const GeographicLib::GeographicErr& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace terrace::terrain
