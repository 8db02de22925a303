// SPDX-License-Identifier: Apache-2.0
#include "tile/make/crowded_leaf.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "tile/make/sample_parts.hpp"

namespace terrace::terrain {
namespace {

/// Number of parts of a unit, along each axis.
constexpr double kPartsOfUnit = 4.0;
constexpr unsigned kRounds = 8;

struct PlacesInUnits {
  std::vector<double> u, v, height;

  void add(double u_at, double v_at, double h) {
    u.push_back(u_at);
    v.push_back(v_at);
    height.push_back(h);
  }
};

PlacesInUnits on_units(const SurfaceSamples& samples, const LeafPlaces& units) {
  PlacesInUnits places;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    places.add(units.u(samples.longitude[i]), units.v(samples.latitude[i]), samples.height[i]);
  }
  return places;
}

/// The lowest and the highest sample of each cell of a leaf.
class Extremes {
 public:
  explicit Extremes(const LeafPlaces& units) : units_(units) {
    columns_ = static_cast<std::size_t>(units.width() * kPartsOfUnit) + 1;
    const std::size_t rows = static_cast<std::size_t>(units.height() * kPartsOfUnit) + 1;
    lowest_.resize(columns_ * rows);
    highest_.resize(columns_ * rows);
  }

  void add(const PlacesInUnits& places) {
    for (std::size_t i = 0; i < places.u.size(); ++i) {
      const auto column = static_cast<std::size_t>((places.u[i] - units_.west()) * kPartsOfUnit);
      const auto row = static_cast<std::size_t>((places.v[i] - units_.south()) * kPartsOfUnit);
      const Sample sample{places.u[i], places.v[i], places.height[i]};
      Sample& low = lowest_[row * columns_ + column];
      Sample& high = highest_[row * columns_ + column];
      // Ties in height are broken by place, so that the order of samples does not matter.
      const auto less = [](const Sample& a, const Sample& b) {
        return std::tie(a.height, a.u, a.v) < std::tie(b.height, b.u, b.v);
      };
      if (std::isnan(low.height) || less(sample, low)) low = sample;
      if (std::isnan(high.height) || less(high, sample)) high = sample;
    }
  }

  [[nodiscard]] PlacesInUnits places() const {
    PlacesInUnits places;
    for (std::size_t i = 0; i < lowest_.size(); ++i) {
      const Sample &low = lowest_[i], &high = highest_[i];
      if (std::isnan(low.height)) continue;
      places.add(low.u, low.v, low.height);
      if (high.height > low.height) places.add(high.u, high.v, high.height);
    }
    return places;
  }

 private:
  struct Sample {
    double u = 0.0, v = 0.0, height = std::numeric_limits<double>::quiet_NaN();
  };
  const LeafPlaces& units_;
  std::size_t columns_ = 0;
  std::vector<Sample> lowest_, highest_;
};

}  // namespace

tri::PointTin mesh_crowded_leaf(const TileAddress& tile, const TileLeaf& leaf,
                                std::span<const tri::Point3> frame,
                                const tri::PointTinOptions& options, TileSurface& surface) {
  const LeafPlaces units(tile, leaf);
  const GeographicBox box = box_of(tile, leaf);
  PlacesInUnits chosen;
  {
    Extremes extremes(units);
    for_each_part(box, surface,
                  [&](const SurfaceSamples& samples) { extremes.add(on_units(samples, units)); });
    chosen = extremes.places();
  }
  tri::PointTin best;
  double before = std::numeric_limits<double>::infinity();
  for (unsigned round = 0; round < kRounds; ++round) {
    tri::PointTin tin = tri::point_tin(chosen.u, chosen.v, chosen.height, frame, options);
    tri::TinErrors all;
    double squares = 0.0;
    for_each_part(box, surface, [&](const SurfaceSamples& samples) {
      const PlacesInUnits places = on_units(samples, units);
      const tri::TinErrors errors =
          tri::measure_surface(places.u, places.v, places.height, tin.vertices, tin.triangles);
      all.covered += errors.covered;
      all.uncovered += errors.uncovered;
      all.largest = std::max(all.largest, errors.largest);
      squares += errors.rms * errors.rms * static_cast<double>(errors.covered);
      if (errors.largest > options.max_error) {
        const std::size_t worst = errors.largest_at;
        chosen.add(places.u[worst], places.v[worst], places.height[worst]);
      }
    });
    if (all.covered > 0) all.rms = std::sqrt(squares / static_cast<double>(all.covered));
    tin.errors = all;
    if (all.largest < before) best = std::move(tin);
    // An error that more samples do not reduce is due to the resolution of places and heights.
    if (all.largest <= options.max_error || !(all.largest < before)) break;
    before = all.largest;
  }
  return best;
}

}  // namespace terrace::terrain
