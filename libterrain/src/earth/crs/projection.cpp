// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/projection.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <GeographicLib/AlbersEqualArea.hpp>
#include <GeographicLib/LambertConformalConic.hpp>
#include <GeographicLib/PolarStereographic.hpp>
#include <GeographicLib/TransverseMercator.hpp>

#include "base/portable_math.hpp"
#include "earth/crs/projection_batch.hpp"

namespace terrace::terrain {
namespace {

using Parameters = ProjectionParameters;

/// One of GeographicLib's projections with a central meridian, y counted from `latitude`.
template <class Library>
class WithMeridian {
 public:
  WithMeridian(Library library, double latitude) : library_(std::move(library)) {
    double x = 0;
    library_.Forward(0, latitude, 0, x, north_);
  }
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    double x = 0, y = 0;
    library_.Forward(0, latitude, turn, x, y);
    return {x, y - north_};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    double latitude = 0, turn = 0;
    library_.Reverse(0, x, y + north_, latitude, turn);
    return {turn, latitude};
  }

 private:
  Library library_;
  double north_ = 0;
};

template <class Library>
std::unique_ptr<const Projection> with_meridian(Library library, const Parameters& p,
                                                double latitude) {
  return std::make_unique<ProjectionBatch<WithMeridian<Library>>>(
      WithMeridian<Library>(std::move(library), latitude), p);
}

/// Albers. Cones open to the south are computed in the mirror of the equator: the inverse of
/// GeographicLib 2.1.2 gives their latitudes with the wrong sign.
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
    return {radius_ * turn * kDegree, radius_ * std::asinh(std::tan(latitude * kDegree))};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    return {x / radius_ / kDegree, std::atan(std::sinh(y / radius_)) / kDegree};
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
      return make_conformal_cone(LambertConformalConic(a, f, p.latitude, p.scale), p, p.latitude);
    case ProjectionMethod::lambert_2sp:
      return make_conformal_cone(LambertConformalConic(a, f, p.parallel1, p.parallel2, p.scale), p,
                                 p.latitude);
    case ProjectionMethod::albers:
      return std::make_unique<ProjectionBatch<Albers>>(Albers(p, ellipsoid), p);
    case ProjectionMethod::mercator_a:
      // A cone that touches at the equator.
      return make_conformal_cone(LambertConformalConic(a, f, 0, p.scale), p, 0);
    case ProjectionMethod::mercator_b: {
      double x = 0, y = 0, convergence = 0, scale = 1;
      LambertConformalConic(a, f, 0, 1).Forward(0, p.parallel1, 0, x, y, convergence, scale);
      return make_conformal_cone(LambertConformalConic(a, f, 0, p.scale / scale), p, 0);
    }
    case ProjectionMethod::polar_stereographic_a:
      return polar_stereographic(p, ellipsoid, false);
    case ProjectionMethod::polar_stereographic_b:
      return polar_stereographic(p, ellipsoid, true);
    case ProjectionMethod::web_mercator:
      return std::make_unique<ProjectionBatch<WebMercator>>(WebMercator(a), p);
    case ProjectionMethod::lambert_azimuthal:
      return make_lambert_azimuthal(p, ellipsoid);
    case ProjectionMethod::oblique_stereographic:
      // On a pole, where its sphere has no size, it is the polar one.
      return std::abs(p.latitude) == 90 ? polar_stereographic(p, ellipsoid, false)
                                        : make_oblique_stereographic(p, ellipsoid);
    case ProjectionMethod::hotine_a:
      return make_hotine(p, ellipsoid, false);
    case ProjectionMethod::hotine_b:
      return make_hotine(p, ellipsoid, true);
  }
  throw std::invalid_argument("there is no such projection method");
}

}  // namespace

bool nearly_equal(const ProjectionParameters& one, const ProjectionParameters& other) {
  // Two parallels mean the same in either order.
  ProjectionParameters a = one, b = other;
  for (ProjectionParameters* const p : {&a, &b}) {
    if (p->parallel1 < p->parallel2) std::swap(p->parallel1, p->parallel2);
  }
  using P = ProjectionParameters;
  for (double P::*const member :
       {&P::latitude, &P::longitude, &P::scale, &P::parallel1, &P::parallel2, &P::azimuth, &P::skew,
        &P::false_easting, &P::false_northing}) {
    const double x = a.*member, y = b.*member;
    if (std::abs(x - y) > 1e-11 * std::max({1.0, std::abs(x), std::abs(y)})) return false;
  }
  return true;
}

std::unique_ptr<const Projection> make_projection(ProjectionMethod method,
                                                  const ProjectionParameters& parameters,
                                                  const Ellipsoid& ellipsoid) {
  const ProjectionParameters& p = parameters;
  for (const double value : {p.latitude, p.longitude, p.scale, p.parallel1, p.parallel2, p.azimuth,
                             p.skew, p.false_easting, p.false_northing}) {
    if (!std::isfinite(value)) throw std::invalid_argument("a parameter is not finite");
  }
  for (const double latitude : {p.latitude, p.parallel1, p.parallel2}) {
    if (std::abs(latitude) > 90) {
      throw std::invalid_argument("a latitude of its parameters lies beyond a pole");
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
