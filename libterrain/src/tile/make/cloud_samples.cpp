// SPDX-License-Identifier: Apache-2.0
#include "tile/make/cloud_samples.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "base/parallel.hpp"
#include "base/point_spacing.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kSeeds = 32;
constexpr double kMaxPointsAround = 3000;
constexpr unsigned kRank = 8;
/// In a view, boxes grow until they contain this many points.
constexpr std::size_t kFewestPointsAround = 200;

/// A point, and a box around nearby points.
struct Seed {
  stream::Point3 at;
  StoredBox box;
};

/// Picks seeds from clusters of level 0, evenly over the store, or from its points if it is a
/// single block. Seeds of a view are points of the view.
std::vector<Seed> some_seeds(const stream::Store& store, const StoredPlaces& places) {
  std::vector<Seed> seeds;
  stream::ClusterPoints points;
  if (store.top() == 0) store.read(store.root(), points);
  const std::uint64_t all = store.top() == 0 ? points.size() : store.levels()[0].clusters;
  const std::uint64_t count = std::min(all, kSeeds);
  const auto is_seed = [&](std::uint64_t number) {
    if (store.top() == 0) {
      if (!points.match(number)) return false;
      seeds.push_back({points.positions[number], places.stored_bounds()});
      return true;
    }
    const stream::ClusterId id = stream::cluster_id(0, number);
    if (!store.may_match(id)) return false;
    store.read(id, points);
    stream::Point3 at = points.representative;
    if (store.condition() != nullptr) {
      const auto match = std::find(points.matches.begin(), points.matches.end(), 1);
      if (match == points.matches.end()) return false;
      at = points.positions[static_cast<std::size_t>(match - points.matches.begin())];
    }
    seeds.push_back({at, flat(store.record(id).summary.box)});
    return true;
  };
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t each = all / count;
    for (std::uint64_t k = 0; k < each && !is_seed(i * each + (each / 2 + k) % each); ++k) {
    }
  }
  return seeds;
}

StoredBox grown(StoredBox box) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double more = 0.5 * (box.max[axis] - box.min[axis]);
    box.min[axis] -= more;
    box.max[axis] += more;
  }
  return box;
}

/// Returns the box enlarged on all sides, even if it has no size.
StoredBox widened(StoredBox box, const stream::Box3& store) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double more =
        0.25 * (box.max[axis] - box.min[axis]) + 1e-3 * (store.max[axis] - store.min[axis]);
    box.min[axis] -= more;
    box.max[axis] += more;
  }
  return box;
}

bool holds(const StoredBox& outer, const stream::Box3& inner) { return outer.covers(flat(inner)); }

/// Returns the seed's box, or a smaller one around the seed if it has too many points.
StoredBox box_of(const Seed& seed, stream::StoreQuery& query) {
  constexpr unsigned kHalvings = 60;
  StoredBox box = seed.box;
  for (unsigned i = 0;
       i < kHalvings && query.estimate(tall(grown(box)), kMaxPointsAround) > kMaxPointsAround;
       ++i) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double quarter = 0.25 * (box.max[axis] - box.min[axis]);
      box.min[axis] = seed.at[axis] - quarter;
      box.max[axis] = seed.at[axis] + quarter;
    }
  }
  return box;
}

/// Returns the distinct places of a store, in degrees of latitude.
std::vector<stream::Point3> on_the_ground(const WindowPoints& points, const StoredPlaces& places,
                                          std::vector<Point2>& stored) {
  stored.clear();
  for (const stream::Point3& p : points.positions) stored.push_back({p[0], p[1]});
  std::sort(stored.begin(), stored.end());
  stored.erase(std::unique(stored.begin(), stored.end()), stored.end());
  std::vector<Point2> on_globe = stored;
  places.to_geographic(on_globe);
  std::vector<stream::Point3> ground;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < on_globe.size(); ++i) {
    const Point2& p = on_globe[i];
    if (!std::isfinite(p[0]) || !std::isfinite(p[1])) continue;
    // Within one turn, so that neighbours across the antimeridian stay neighbours.
    const double east = wrapped_longitude(p[0] - on_globe.front()[0]);
    ground.push_back({east * base::cos_degrees(p[1]), p[1], 0.0});
    stored[kept++] = stored[i];
  }
  stored.resize(kept);
  return ground;
}

}  // namespace

CloudSamples::CloudSamples(const stream::Store& store, const StoredPlaces& places,
                           const EllipsoidalHeights& vertical, unsigned threads) {
  constexpr std::size_t kConvertedAtOnce = std::size_t{1} << 16;
  crowd_ = !cells_.load_all(store, 0, threads);
  const std::span<const Point2> stored = cells_.positions();
  samples_ = large_array<Sample>(stored.size());
  const std::size_t pieces = (stored.size() + kConvertedAtOnce - 1) / kConvertedAtOnce;
  parallel_for(pieces, threads, [&](std::size_t piece) {
    store.check_stop();
    const std::size_t begin = piece * kConvertedAtOnce;
    const std::size_t count = std::min(kConvertedAtOnce, stored.size() - begin);
    const std::span<const Point2> part = stored.subspan(begin, count);
    const std::span<const double> part_heights = cells_.heights().subspan(begin, count);
    std::vector<Point2> globe(part.begin(), part.end());
    std::vector<double> heights(part_heights.begin(), part_heights.end());
    places.to_geographic(globe);
    vertical.convert(globe, heights);
    for (std::size_t k = 0; k < count; ++k) {
      // NaN for a point without a place or height on the globe, so that it is in no box.
      const bool is_placed = std::isfinite(heights[k]);
      samples_[begin + k] = {is_placed ? globe[k][0] : NAN, is_placed ? globe[k][1] : NAN,
                             heights[k]};
    }
  });
}

void CloudSamples::add(const StoredBox& window, const GeographicBox& box,
                       SurfaceSamples& out) const {
  cells_.visit_indices(cells_.cells_of(window), [&](std::uint32_t i) {
    const Sample& s = samples_[i];
    if (!(s.longitude >= box.west && s.longitude <= box.east && s.latitude >= box.south &&
          s.latitude <= box.north)) {
      return;
    }
    out.longitude.push_back(s.longitude);
    out.latitude.push_back(s.latitude);
    out.height.push_back(s.height);
  });
}

double cloud_spacing(const stream::Store& store, const StoredPlaces& places) {
  StoreWindow reader(store);
  std::vector<float> distances;
  WindowPoints points;
  std::vector<Point2> stored;
  for (const Seed& seed : some_seeds(store, places)) {
    StoredBox box = box_of(seed, reader.query()), around = grown(box);
    if (reader.query().estimate(tall(around), kMaxPointsAround) > kMaxPointsAround) continue;
    reader.points(around, points);
    // A view may have few points where the store has many.
    while (store.condition() != nullptr && points.positions.size() < kFewestPointsAround &&
           !holds(around, store.bounds())) {
      box = widened(box, store.bounds());
      around = grown(box);
      reader.points(around, points);
    }
    const std::vector<stream::Point3> ground = on_the_ground(points, places, stored);
    if (ground.size() < 2) continue;
    const auto rank = static_cast<unsigned>(std::min<std::size_t>(kRank, ground.size() - 1));
    const std::vector<float> spacings = neighbour_distances(ground, rank, 1);
    // A circle of this radius contains `rank` points.
    const auto share = static_cast<float>(std::sqrt(std::numbers::pi / rank));
    for (std::size_t i = 0; i < spacings.size(); ++i) {
      if (spacings[i] > 0.0F && box.contains(stored[i])) {
        distances.push_back(spacings[i] * share);
      }
    }
  }
  if (distances.empty()) return 180.0 / 64.0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return static_cast<double>(*middle);
}

}  // namespace terrace::terrain
