// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <stdexcept>

#include <GeographicLib/LambertConformalConic.hpp>

#include "base/portable_math.hpp"
#include "earth/crs/projection_batch.hpp"

namespace terrace::terrain {
namespace {

/// Lambert's conformal conic, and Mercator's as the cone that is a cylinder. GeographicLib 2.1.2
/// takes a pole for a place a little beside it, which a flat cone shows thousands of kilometres
/// away: the apex is put where it belongs, and the other pole nowhere.
class ConformalCone {
 public:
  ConformalCone(const GeographicLib::LambertConformalConic& library, const ProjectionParameters& p,
                double latitude)
      : library_(library) {
    for (const double parallel : {library.OriginLatitude(), p.parallel1, p.parallel2}) {
      if (std::abs(parallel) == 90) {
        throw std::invalid_argument("a parallel of a conformal cone lies at a pole");
      }
    }
    double x = 0, y = 0, turned = 0, scale = 0;
    library_.Forward(0, library_.OriginLatitude(), 90, x, y, turned, scale);
    if (turned != 0) {
      pole_ = turned > 0 ? 90 : -90;
      apex_ = y + x / std::tan(turned * kDegree);
    }
    north_ = forward(0, latitude)[1];
    if (!std::isfinite(north_)) throw std::invalid_argument("its origin is the pole at infinity");
  }
  [[nodiscard]] Point2 forward(double turn, double latitude) const {
    if (latitude == pole_) return {0, apex_ - north_};
    if (std::abs(latitude) == 90) return {kNowhere, kNowhere};
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
  GeographicLib::LambertConformalConic library_;
  double north_ = 0, pole_ = kNowhere, apex_ = kNowhere;
};

}  // namespace

std::unique_ptr<const Projection> make_conformal_cone(
    const GeographicLib::LambertConformalConic& library, const ProjectionParameters& p,
    double latitude) {
  return std::make_unique<ProjectionBatch<ConformalCone>>(ConformalCone(library, p, latitude), p);
}

}  // namespace terrace::terrain
