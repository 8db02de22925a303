// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <GeographicLib/Ellipsoid.hpp>

#include "base/portable_math.hpp"
#include "earth/crs/projection_batch.hpp"

// Formulas of IOGP Publication 373-7-2 (2019), "Guidance Note 7-2", under their method codes, and
// of Snyder (1987). What they write with the powers and logarithms of sines is GeographicLib's
// authalic, conformal and isometric latitude here, which loses nothing near the poles.
namespace terrace::terrain {
namespace {

struct SineCosine {
  explicit SineCosine(double degrees) { GeographicLib::Math::sincosd(degrees, sine, cosine); }
  double sine = 0, cosine = 0;
};

/// A place on the unit sphere as seen from a centre: east, north, up there.
struct Seen {
  double east, north, up;
};

Seen seen_from(const SineCosine& centre, double turn, double latitude) {
  const SineCosine place(latitude), around(turn);
  const double x = place.cosine * around.cosine, y = place.cosine * around.sine;
  return {y, place.sine * centre.cosine - x * centre.sine,
          place.sine * centre.sine + x * centre.cosine};
}

/// The inverse: longitude from the centre's and latitude, degrees.
Point2 place_of(const SineCosine& centre, const Seen& seen) {
  const double z = seen.up * centre.sine + seen.north * centre.cosine;
  const double x = seen.up * centre.cosine - seen.north * centre.sine;
  return {GeographicLib::Math::atan2d(seen.east, x),
          GeographicLib::Math::atan2d(z, std::hypot(x, seen.east))};
}

/// EPSG 9820; Snyder, equations 24-17 to 24-30.
class LambertAzimuthal {
 public:
  LambertAzimuthal(const ProjectionParameters& p, const Ellipsoid& ellipsoid)
      : earth_(ellipsoid.semi_major, ellipsoid.flattening()),
        centre_(earth_.AuthalicLatitude(p.latitude)),
        radius_(std::sqrt(earth_.Area() / (4 * kPi))),
        // The ratio of the parallel's radius on the ellipsoid and on the sphere; 1 at a pole.
        stretch_(std::abs(p.latitude) == 90
                     ? 1.0
                     : earth_.CircleRadius(p.latitude) / (radius_ * centre_.cosine)) {}

  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    const Seen seen = seen_from(centre_, turn, earth_.AuthalicLatitude(latitude));
    const double scale = radius_ * std::sqrt(2.0 / (1.0 + seen.up));
    return {scale * stretch_ * seen.east, scale / stretch_ * seen.north};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    const double east = x / (stretch_ * radius_), north = y * stretch_ / radius_;
    const double square = (east * east + north * north) / 4;  // sine squared of half the angle
    if (!(square <= 1)) return {kNowhere, kNowhere};
    const double scale = std::sqrt(1 - square);
    const Point2 place = place_of(centre_, {east * scale, north * scale, 1 - 2 * square});
    return {place[0], earth_.InverseAuthalicLatitude(place[1])};
  }

 private:
  GeographicLib::Ellipsoid earth_;
  SineCosine centre_;
  double radius_, stretch_;
};

/// EPSG 9809: the ellipsoid conformally onto a sphere, that onto the plane.
class ObliqueStereographic {
 public:
  ObliqueStereographic(const ProjectionParameters& p, const Ellipsoid& ellipsoid)
      : earth_(ellipsoid.semi_major, ellipsoid.flattening()) {
    const SineCosine origin(p.latitude);
    const double e2 = earth_.EccentricitySq();
    const double w2 = 1 - e2 * origin.sine * origin.sine;
    const double radius = ellipsoid.semi_major * std::sqrt(1 - e2) / w2;
    diameter_ = 2 * radius * p.scale;
    turns_ = std::sqrt(1 + e2 * std::pow(origin.cosine, 4) / (1 - e2));
    const double psi = turns_ * earth_.IsometricLatitude(p.latitude) * kDegree;
    const double sine = std::tanh(psi);
    offset_ =
        0.5 * std::log((turns_ + origin.sine) * (1 - sine) / ((turns_ - origin.sine) * (1 + sine)));
    centre_ = SineCosine(on_sphere(p.latitude));
  }

  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    const Seen seen = seen_from(centre_, turns_ * turn, on_sphere(latitude));
    const double scale = diameter_ / (1 + seen.up);
    return {scale * seen.east, scale * seen.north};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    const double east = x / diameter_, north = y / diameter_;
    const double square = east * east + north * north;  // tangent squared of half the angle
    const double scale = 2 / (1 + square);
    const Point2 place =
        place_of(centre_, {east * scale, north * scale, (1 - square) / (1 + square)});
    const double psi = (std::asinh(std::tan(place[1] * kDegree)) - offset_) / turns_;
    return {place[0] / turns_, earth_.InverseIsometricLatitude(psi / kDegree)};
  }

 private:
  [[nodiscard]] double on_sphere(double latitude) const {
    const double psi = turns_ * earth_.IsometricLatitude(latitude) * kDegree + offset_;
    return std::atan(std::sinh(psi)) / kDegree;
  }

  GeographicLib::Ellipsoid earth_;
  SineCosine centre_{0};
  double diameter_ = 0, turns_ = 1, offset_ = 0;
};

/// EPSG 9812 and 9815; Guidance Note 7-2, section 3.2.4, whose letters these are.
class Hotine {
 public:
  Hotine(const ProjectionParameters& p, const Ellipsoid& ellipsoid, bool rectified_at_centre)
      : earth_(ellipsoid.semi_major, ellipsoid.flattening()) {
    const SineCosine centre(p.latitude), azimuth(p.azimuth), skew(p.skew);
    const double e2 = earth_.EccentricitySq();
    const double w2 = 1 - e2 * centre.sine * centre.sine;
    b_ = std::sqrt(1 + e2 * std::pow(centre.cosine, 4) / (1 - e2));
    a_ = ellipsoid.semi_major * b_ * p.scale * std::sqrt(1 - e2) / w2;
    const double d = std::max(1.0, b_ * std::sqrt(1 - e2) / (centre.cosine * std::sqrt(w2)));
    const double root = std::copysign(std::sqrt(d * d - 1), p.latitude);
    log_h_ = std::log(d + root) - b_ * isometric(p.latitude);
    const double sine = azimuth.sine / d;
    sine_ = sine;
    cosine_ = std::sqrt((1 - sine) * (1 + sine));
    // The equation of the aposphere's node; a centre line that runs due east is 90 degrees off it.
    const double node = azimuth.cosine == 0
                            ? std::copysign(90.0, root * azimuth.sine)
                            : std::asin(std::clamp(root * sine_ / cosine_, -1.0, 1.0)) / kDegree;
    node_ = -node / b_;
    skew_sine_ = skew.sine;
    skew_cosine_ = skew.cosine;
    if (rectified_at_centre) centre_ = along_across(0, p.latitude)[0];
  }

  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    const Point2 uv = along_across(turn, latitude);
    const double u = uv[0] - centre_, v = uv[1];
    return {v * skew_cosine_ + u * skew_sine_, u * skew_cosine_ - v * skew_sine_};
  }
  [[nodiscard]] Point2 reverse(double x, double y) const {
    const double v = x * skew_cosine_ - y * skew_sine_;
    const double u = y * skew_cosine_ + x * skew_sine_ + centre_;
    const double s = -std::sinh(b_ * v / a_), t = std::cosh(b_ * v / a_);
    const double along = b_ * u / a_;
    const double sine = (std::sin(along) * cosine_ + s * sine_) / t;
    if (!(std::abs(sine) < 1)) return {kNowhere, kNowhere};
    const double psi = (std::atanh(sine) - log_h_) / b_;
    const double turn =
        node_ * kDegree - std::atan2(s * cosine_ - std::sin(along) * sine_, std::cos(along)) / b_;
    return {turn / kDegree, earth_.InverseIsometricLatitude(psi / kDegree)};
  }

 private:
  [[nodiscard]] double isometric(double latitude) const {
    return earth_.IsometricLatitude(latitude) * kDegree;
  }
  /// u and v of the skew grid, metres.
  [[nodiscard]] Point2 along_across(double turn, double latitude) const {
    const double log_q = log_h_ + b_ * isometric(latitude);
    const double angle = b_ * (turn - node_) * kDegree;
    const double s = std::sinh(log_q), t = std::cosh(log_q), v = std::sin(angle);
    return {a_ / b_ * std::atan2(s * cosine_ + v * sine_, std::cos(angle)),
            -a_ / b_ * std::atanh((s * sine_ - v * cosine_) / t)};
  }

  GeographicLib::Ellipsoid earth_;
  double a_ = 0, b_ = 1, log_h_ = 0, sine_ = 0, cosine_ = 1;
  double node_ = 0;  ///< longitude from the centre's, degrees
  double skew_sine_ = 0, skew_cosine_ = 1, centre_ = 0;
};

}  // namespace

std::unique_ptr<const Projection> make_lambert_azimuthal(const ProjectionParameters& p,
                                                         const Ellipsoid& ellipsoid) {
  return std::make_unique<ProjectionBatch<LambertAzimuthal>>(LambertAzimuthal(p, ellipsoid), p);
}

std::unique_ptr<const Projection> make_oblique_stereographic(const ProjectionParameters& p,
                                                             const Ellipsoid& ellipsoid) {
  if (std::abs(p.latitude) == 90) {
    throw std::invalid_argument("an oblique stereographic projection is not centred on a pole");
  }
  return std::make_unique<ProjectionBatch<ObliqueStereographic>>(ObliqueStereographic(p, ellipsoid),
                                                                 p);
}

std::unique_ptr<const Projection> make_hotine(const ProjectionParameters& p,
                                              const Ellipsoid& ellipsoid,
                                              bool rectified_at_centre) {
  if (std::abs(p.latitude) == 90 || p.latitude == 0) {
    throw std::invalid_argument(
        "the centre of an oblique Mercator projection is a pole or lies "
        "on the equator");
  }
  return std::make_unique<ProjectionBatch<Hotine>>(Hotine(p, ellipsoid, rectified_at_centre), p);
}

}  // namespace terrace::terrain
