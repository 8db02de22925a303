// SPDX-License-Identifier: Apache-2.0
#include "tile/make/stored_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/stream/error.hpp>

#include "earth/crs/definition.hpp"

namespace terrace::terrain {
namespace {

constexpr double kFarPlace = std::numeric_limits<double>::infinity();
/// Generous bounds on the error of converting a place there and back, with a datum shift.
constexpr double kMarginMetres = 0.02;
constexpr double kMarginDegrees = 2e-7;
/// Number of steps across a box in which its image is sampled.
constexpr unsigned kPlaceSteps = 24;
/// Fewer steps suffice for boxes up to the first size in degrees, where second differences bound
/// the bulge. They also suffice for boxes up to the second size if that bound is below what many
/// steps would allow.
constexpr double kSmall = 1.0, kMayBeSmooth = 8.0;
constexpr unsigned kSmallSteps = 6;
constexpr unsigned kBoundsSteps = 64;
/// The size of a patch with polynomials in place of a projection, and their largest error in
/// metres.
constexpr double kPatchDegrees = 0.18;
constexpr double kPlaneTolerance = 1e-5;

void include(StoredBox& box, const Point2& p) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    box.min[axis] = std::min(box.min[axis], p[axis]);
    box.max[axis] = std::max(box.max[axis], p[axis]);
  }
}

StoredBox nothing() { return {{kFarPlace, kFarPlace}, {-kFarPlace, -kFarPlace}}; }

Point2 between(const Point2& low, const Point2& high, unsigned i, unsigned j, unsigned steps) {
  return {low[0] + (high[0] - low[0]) * i / steps, low[1] + (high[1] - low[1]) * j / steps};
}

/// Places in a box, by rows, a number of steps apart along each axis.
struct PlaceGrid {
  Point2 low, high;
  std::array<unsigned, 2> steps;

  [[nodiscard]] std::vector<Point2> places() const {
    std::vector<Point2> places;
    for (unsigned j = 0; j <= steps[1]; ++j) {
      for (unsigned i = 0; i <= steps[0]; ++i) {
        places.push_back({low[0] + (high[0] - low[0]) * i / steps[0],
                          low[1] + (high[1] - low[1]) * j / steps[1]});
      }
    }
    return places;
  }
  /// Returns the largest second difference of a coordinate of the converted places; infinite if one
  /// has no image. Between places, a quadratic function deviates from a line by an eighth of it.
  [[nodiscard]] double second_difference(std::span<const Point2> converted,
                                         std::size_t axis) const {
    double largest = 0.0;
    const auto look = [&](std::size_t at, std::size_t step) {
      const double difference = std::abs(converted[at - step][axis] - 2.0 * converted[at][axis] +
                                         converted[at + step][axis]);
      largest = difference <= largest ? largest : difference;
      if (std::isnan(difference)) largest = kFarPlace;
    };
    for (std::size_t j = 0; j <= steps[1]; ++j) {
      for (std::size_t i = 0; i <= steps[0]; ++i) {
        const std::size_t at = j * (steps[0] + 1) + i;
        if (i > 0 && i < steps[0]) look(at, 1);
        if (j > 0 && j < steps[1]) look(at, steps[0] + 1);
      }
    }
    return largest;
  }
};

/// The bounds of the points; for a raster, of its whole lattice, because it is filled where it has
/// no data.
StoredBox stored_box(const stream::Store& store) {
  const stream::StoreSchema& schema = store.schema();
  if (!schema.grid) return flat(store.bounds());
  return {{0.0, 0.0},
          {static_cast<double>(schema.columns - 1), static_cast<double>(schema.rows - 1)}};
}

}  // namespace

double wrapped_longitude(double longitude) {
  if (longitude >= -180.0 && longitude <= 180.0) return longitude;
  return longitude - 360.0 * std::floor((longitude + 180.0) / 360.0);
}

StoredPlaces::StoredPlaces(const stream::Store& store, CoordinateSystem system)
    : crs_(std::move(system)), placement_(store.schema()), stored_(stored_box(store)) {
  const bool degrees = crs_.is_geographic();
  const double margin = degrees ? kMarginDegrees : kMarginMetres / crs_.metres_per_unit();
  const std::array<double, 6>& xy = placement_.world.xy;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    margin_[axis] = margin / base::hypot(xy[axis], xy[3 + axis]);
  }
  if (crs_.turn() > 0) {
    turn_ = crs_.turn();
    StoredBox all = nothing();
    for (unsigned k = 0; k < 4; ++k) {
      include(all, world(between(stored_.min, stored_.max, k & 1, k >> 1, 1)));
    }
    first_longitude_ = all.min[0];
    last_longitude_ = all.max[0];
    for (const double x : {all.min[0], all.max[0]}) {
      const Point2 back = crs_.from_geographic(crs_.to_geographic(Point2{x, all.min[1]}));
      goes_around_ = goes_around_ || (!degrees && std::abs(back[0] - x) > 0.5 * turn_);
    }
  }
  find_bounds(store.path().string(), store.schema().grid);
  fit_polynomials(store);
}

void StoredPlaces::fit_polynomials(const stream::Store& store) {
  world_bounds_ = world_box(store.schema(), {{stored_.min[0], stored_.min[1], 0.0},
                                             {stored_.max[0], stored_.max[1], 0.0}});
  // Samples of rasters are converted window by window.
  if (!store.schema().grid) geography_.emplace(crs_, world_bounds_);
  const Point2 size{world_bounds_.max[0] - world_bounds_.min[0],
                    world_bounds_.max[1] - world_bounds_.min[1]};
  const bool turns = bounds_.west == -180.0 || bounds_.east == 180.0;
  if (crs_.is_geographic() || turns || !(std::min(size[0], size[1]) > 0.0)) return;
  const double tolerance = kPlaneTolerance / (std::max(size[0], size[1]) * crs_.metres_per_unit());
  plane_ = PatchGrid({bounds_.west, bounds_.south}, {bounds_.east, bounds_.north},
                     {kPatchDegrees, kPatchDegrees}, [&](const Point2& low, const Point2& sides) {
                       auto places = PlacePatch::places(low, sides);
                       crs_.from_geographic(places);
                       for (Point2& p : places) {
                         for (std::size_t k = 0; k < 2; ++k) {
                           p[k] = (p[k] - world_bounds_.min[k]) / size[k];
                         }
                       }
                       return PlacePatch::through(places, tolerance);
                     });
}

void StoredPlaces::from_geographic(std::span<Point2> places) const {
  plane_.convert(
      places, [this](std::span<Point2> batch) { crs_.from_geographic(batch); },
      [this](Point2 place) {
        for (std::size_t k = 0; k < 2; ++k) {
          const double low = world_bounds_.min[k];
          place[k] = low + place[k] * (world_bounds_.max[k] - low);
        }
        return place;
      });
}

Point2 StoredPlaces::world(const Point2& stored) const {
  const stream::Point3 p = world_point(placement_, {stored[0], stored[1], 0.0});
  return {p[0], p[1]};
}

double StoredPlaces::lattice_spacing() const {
  return std::min(shortest_steps_[0] * kBoundsSteps / stored_.max[0],
                  shortest_steps_[1] * kBoundsSteps / stored_.max[1]);
}

void StoredPlaces::find_bounds(const std::string& file, bool is_lattice) {
  std::vector<Point2> places;
  for (unsigned j = 0; j <= kBoundsSteps; ++j) {
    for (unsigned i = 0; i <= kBoundsSteps; ++i) {
      places.push_back(between(stored_.min, stored_.max, i, j, kBoundsSteps));
    }
  }
  to_geographic(places);
  StoredBox all = nothing();
  Point2 step{};
  bool crosses = false;
  for (unsigned j = 0; j <= kBoundsSteps; ++j) {
    for (unsigned i = 0; i <= kBoundsSteps; ++i) {
      const Point2& p = places[j * (kBoundsSteps + 1) + i];
      if (!std::isfinite(p[0]) || !std::isfinite(p[1])) continue;
      include(all, p);
      const auto step_to = [&](const Point2& next, double& shortest) {
        if (!std::isfinite(next[0])) return;
        const double wide = std::abs(next[0] - p[0]);
        // Neighbours more than half of the globe apart have the antimeridian between them.
        if (wide > 180.0) {
          crosses = true;
          return;
        }
        const double tall = std::abs(next[1] - p[1]);
        step = {std::max(step[0], wide), std::max(step[1], tall)};
        const double length = std::max(wide, tall);
        if (length > 0.0) shortest = std::min(shortest, length);
      };
      if (i < kBoundsSteps) step_to(places[j * (kBoundsSteps + 1) + i + 1], shortest_steps_[0]);
      if (j < kBoundsSteps) step_to(places[(j + 1) * (kBoundsSteps + 1) + i], shortest_steps_[1]);
    }
  }
  if (!(all.min[0] <= all.max[0]) || (is_lattice && !std::isfinite(lattice_spacing()))) {
    throw stream::Error(
        file, fmt::format("cannot be converted to longitude and latitude with {}", crs_.title()))
        .remedy(stream::message("rebuild the store with the right {crs}"));
  }
  // Between the sampled places, the border of a projected box may bulge by part of a step.
  if (!crs_.is_geographic()) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double bulge = std::min(0.5 * step[axis], 1.0) + kMarginDegrees;
      all.min[axis] -= bulge;
      all.max[axis] += bulge;
    }
    // A pole inside has all longitudes around it.
    for (const double pole : {-90.0, 90.0}) {
      const Point2 at = stored_place(placement_, crs_.from_geographic(Point2{0.0, pole}));
      bool inside = true;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        inside = inside && at[axis] >= stored_.min[axis] - margin_[axis] &&
                 at[axis] <= stored_.max[axis] + margin_[axis];
      }
      if (!inside) continue;
      (pole < 0.0 ? all.min[1] : all.max[1]) = pole;
      crosses = true;
    }
  }
  if (crosses) {
    all.min[0] = -180.0;
    all.max[0] = 180.0;
  }
  bounds_ = {std::max(-180.0, all.min[0]), std::max(-90.0, all.min[1]), std::min(180.0, all.max[0]),
             std::min(90.0, all.max[1])};
}

double StoredPlaces::in_turn(double longitude) const {
  const double first = first_longitude_, last = last_longitude_;
  const double after = longitude - turn_ * std::floor((longitude - first) / turn_);
  return after > last && after - last > first + turn_ - after ? after - turn_ : after;
}

std::vector<StoredBox> StoredPlaces::windows(const GeographicBox& box) const {
  // Only where the points are, because far away a projection may be undefined.
  const Point2 low{std::max(box.west, bounds_.west), std::max(box.south, bounds_.south)};
  const Point2 high{std::min(box.east, bounds_.east), std::min(box.north, bounds_.north)};
  std::vector<StoredBox> windows;
  if (!(low[0] <= high[0] && low[1] <= high[1])) return windows;
  const auto add = [&](StoredBox around, const Point2& bulge) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double margin = margin_[axis] + bulge[axis];
      around.min[axis] = std::max(around.min[axis] - margin, stored_.min[axis]);
      around.max[axis] = std::min(around.max[axis] + margin, stored_.max[axis]);
      if (!(around.min[axis] <= around.max[axis])) return;
    }
    windows.push_back(around);
  };
  if (crs_.is_geographic()) {
    // Only turns that may reach the store matter. If it goes around several times, the first turns
    // suffice.
    constexpr int kMaxTurns = 5;
    const double first = std::floor(first_longitude_ / turn_ - 0.5),
                 last = std::ceil(last_longitude_ / turn_ + 0.5);
    for (int i = 0; i < kMaxTurns && first + i <= last; ++i) {
      const double turn = first + i;
      std::array<Point2, 4> places;
      for (unsigned k = 0; k < 4; ++k) {
        places[k] = between(low, high, k & 1, k >> 1, 1);
      }
      crs_.from_geographic(places);
      StoredBox around = nothing();
      for (const Point2& p : places) {
        include(around, stored_place(placement_, {p[0] + turn_ * turn, p[1]}));
      }
      add(around, {0.0, 0.0});
    }
    return windows;
  }
  const Point2 size{high[0] - low[0], high[1] - low[1]};
  const double longest = std::max(size[0], size[1]);
  for (const bool few : {true, false}) {
    if (few && longest > kMayBeSmooth) continue;
    // Steps of similar length, and at least two, so that there is a second difference.
    const auto steps = [&](double length) {
      if (length == 0.0) return 1U;
      const double share = std::ceil((few ? kSmallSteps : kPlaceSteps) * length / longest);
      return std::max(2U, static_cast<unsigned>(share));
    };
    const PlaceGrid grid{low, high, {steps(size[0]), steps(size[1])}};
    std::vector<Point2> places = grid.places();
    from_geographic(places);
    StoredBox around = nothing();
    for (Point2& p : places) {
      p = stored_place(placement_, p);
      if (std::isfinite(p[0]) && std::isfinite(p[1])) include(around, p);
    }
    const Point2 range{around.max[0] - around.min[0], around.max[1] - around.min[1]};
    // Allow for the bulge between the sampled places.
    Point2 bulge{range[0] / kPlaceSteps, range[1] / kPlaceSteps};
    if (few) {
      const double most = longest <= kSmall ? kFarPlace : std::max(bulge[0], bulge[1]);
      bulge = {2.0 * grid.second_difference(places, 0), 2.0 * grid.second_difference(places, 1)};
      if (!(std::max(bulge[0], bulge[1]) <= most)) continue;
    }
    if (!(around.min[0] <= around.max[0])) break;
    const Point2 turned = stored_place(placement_, {turn_, 0}),
                 origin = stored_place(placement_, {});
    for (const int turn : goes_around_ ? std::vector{-1, 0, 1} : std::vector{0}) {
      StoredBox there = around;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        there.min[axis] += turn * (turned[axis] - origin[axis]);
        there.max[axis] += turn * (turned[axis] - origin[axis]);
      }
      add(there, bulge);
    }
    break;
  }
  return windows;
}

void StoredPlaces::to_geographic(std::span<Point2> places) const {
  for (Point2& p : places) p = world(p);
  if (geography_) {
    (*geography_)(places);
  } else {
    crs_.to_geographic(places);
  }
  for (Point2& p : places) p[0] = wrapped_longitude(p[0]);
}

void StoredPlaces::to_stored(std::span<Point2> places) const {
  // The result for places without an image in the store's CRS: a corner beyond every outline and
  // its rim.
  constexpr double kFarAway = 1e9;
  for (Point2& p : places) {
    // The meridian of 180 degrees has two numbers; use one, as tiles on both sides request it.
    const double turned = wrapped_longitude(p[0]);
    p = {turned == 180.0 ? -180.0 : turned, std::clamp(p[1], -90.0, 90.0)};
  }
  from_geographic(places);
  for (Point2& p : places) {
    if (crs_.is_geographic() || goes_around_) p[0] = in_turn(p[0]);
    p = stored_place(placement_, p);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) {
      p = {stored_.min[0] - kFarAway, stored_.min[1] - kFarAway};
    }
  }
}

}  // namespace terrace::terrain
