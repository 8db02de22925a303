// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

/// Map projections of an ellipsoid: longitude and latitude in degrees, plane coordinates in metres.

namespace terrace::terrain {

using Point2 = std::array<double, 2>;

struct Ellipsoid {
  double semi_major = 6378137.0;              ///< metres
  double inverse_flattening = 298.257223563;  ///< 0: a sphere

  [[nodiscard]] double flattening() const {
    return inverse_flattening == 0 ? 0.0 : 1.0 / inverse_flattening;
  }
  friend bool operator==(const Ellipsoid&, const Ellipsoid&) = default;
};

/// The methods that GeographicLib computes, with their codes in the EPSG dataset.
enum class ProjectionMethod : std::uint8_t {
  transverse_mercator,    ///< 9807
  lambert_1sp,            ///< 9801, conformal conic
  lambert_2sp,            ///< 9802
  albers,                 ///< 9822
  polar_stereographic_a,  ///< 9810: latitude of origin +-90 and scale
  polar_stereographic_b,  ///< 9829: parallel1 is the latitude of true scale
  web_mercator,           ///< 1024: a sphere's formulas on the ellipsoid's latitude
  mercator_a,             ///< 9804: scale on the equator
  mercator_b,             ///< 9805: parallel1 is the latitude of true scale
};

/// In degrees and metres. The method determines which of them are used.
struct ProjectionParameters {
  double latitude = 0.0;   ///< latitude of the (false) origin or the centre
  double longitude = 0.0;  ///< its longitude, from the system's prime meridian
  double scale = 1.0;
  double parallel1 = 0.0, parallel2 = 0.0;
  double false_easting = 0.0, false_northing = 0.0;

  friend bool operator==(const ProjectionParameters&, const ProjectionParameters&) = default;
};

/// Whether both are equal except for the last digits, which texts and units change: micrometres on
/// the ground.
bool nearly_equal(const ProjectionParameters& a, const ProjectionParameters& b);

/// A projection. Several threads may call const members at once.
class Projection {
 public:
  virtual ~Projection() = default;
  /// Converts (longitude, latitude) to (x, y), in place. A place without an image (a pole of
  /// Mercator, the antipode of an azimuthal projection, a latitude beyond 90, NaN) becomes NaN.
  virtual void forward(std::span<Point2> places) const = 0;
  /// Converts (x, y) to (longitude in [-180, 180], latitude), in place; NaN where (x, y) is not the
  /// image of a place.
  virtual void reverse(std::span<Point2> places) const = 0;
};

/// Makes a projection that GeographicLib computes to a few nanometres. Web Mercator follows IOGP
/// Publication 373-7-2, Geomatics Guidance Note 7 part 2 (2019). Forward and reverse agree within a
/// micrometre in the area of use. Throws: std::invalid_argument for invalid parameters.
std::unique_ptr<const Projection> make_projection(ProjectionMethod method,
                                                  const ProjectionParameters& parameters,
                                                  const Ellipsoid& ellipsoid);

}  // namespace terrace::terrain
