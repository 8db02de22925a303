// SPDX-License-Identifier: Apache-2.0
#include "tile/make/point_surface.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/digest.hpp"
#include "tile/make/cloud_samples.hpp"

namespace terrace::terrain {
namespace {

/// The most samples to return at once.
constexpr double kMaxSamples = 1U << 18;
/// Margin to load around a part, in mean distances of points.
constexpr double kTileMargin = 8;
/// In degrees: a box this narrow is practically one place, so dividing it does not help.
constexpr double kNarrowest = 1e-9;
/// The most points to load at once if places need them.
constexpr double kMaxTogether = 1U << 15;
/// The number of boxes to remember as crowded or not.
constexpr std::size_t kMaxRemembered = 1U << 14;

}  // namespace

TiledCloud::TiledCloud(const stream::Store& tiled, CoordinateSystem system,
                       EllipsoidalHeights heights, std::uint64_t bytes, std::uint64_t all_bytes,
                       unsigned threads)
    : TiledStore(tiled, std::move(system), std::move(heights)),
      window_bytes(bytes),
      points(std::make_unique<PointCloud>(store, 0)) {
  spacing = cloud_spacing(tiled, places);
  rim = rim_of_outline();
  constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
  if (tiled.points() >= std::min(all_bytes / CloudSamples::kBytesPerPoint, kMost)) return;
  samples = std::make_unique<CloudSamples>(store, places, vertical, threads);
}

PointTileSurface::PointTileSurface(const TiledCloud& cloud)
    : cloud_(cloud),
      reader_(cloud.store, std::uint64_t{8} << 20),
      surface_(*cloud.points, TooLong{}, cloud.window_bytes),
      has_all_(cloud.samples && !cloud.samples->crowd()) {
  if (has_all_) surface_.share(cloud.samples->cells());
}

const std::vector<StoredBox>& PointTileSurface::windows(const GeographicBox& box) {
  if (!requested_ || *requested_ != box) {
    windows_ = cloud_.places.windows(box);
    requested_ = box;
  }
  return windows_;
}

void PointTileSurface::expect(const GeographicBox& box) {
  const std::vector<StoredBox>& all = windows(box);
  expected_.reset();
  if (all.size() == 1) expected_ = all.front();
}

bool PointTileSurface::crowded(const GeographicBox& box) {
  if (box.east - box.west < kNarrowest || box.north - box.south < kNarrowest) return false;
  // Adjacent leaves ask for the same sides.
  if (crowded_.size() > kMaxRemembered) crowded_.clear();
  const std::array<double, 4> key{box.west, box.south, box.east, box.north};
  if (const auto entry = crowded_.find(key); entry != crowded_.end()) return entry->second;
  const bool is_crowded = counts_as_crowded(box);
  crowded_[key] = is_crowded;
  return is_crowded;
}

bool PointTileSurface::counts_as_crowded(const GeographicBox& box) {
  double count = 0.0;
  for (const StoredBox& window : windows(box)) {
    count += estimate(window, kMaxSamples);
    if (count > kMaxSamples) return true;
  }
  return false;
}

void PointTileSurface::drop_duplicates() {
  constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();
  std::vector<stream::Point3>& positions = points_.positions;
  const std::size_t slots = std::bit_ceil(2 * positions.size() + 2);
  slots_.assign(slots, kFree);
  std::size_t kept = 0;
  for (const stream::Point3& p : positions) {
    // Zero has two signs.
    const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x + 0.0); };
    std::uint64_t mixed = bits(p[0]) * 0x9E3779B97F4A7C15U ^ std::rotl(bits(p[1]), 29);
    mixed *= 0xD6E8FEB86659FD93U;
    std::size_t at = (mixed ^ mixed >> 32) & (slots - 1);
    const auto same = [&] {
      const stream::Point3& other = positions[slots_[at]];
      return other[0] == p[0] && other[1] == p[1];
    };
    while (slots_[at] != kFree && !same()) at = (at + 1) & (slots - 1);
    if (slots_[at] != kFree) continue;
    slots_[at] = static_cast<std::uint32_t>(kept);
    positions[kept++] = p;
  }
  positions.resize(kept);
}

void PointTileSurface::samples(const GeographicBox& box, SurfaceSamples& out) {
  out.clear();
  if (cloud_.samples) {
    for (const StoredBox& window : windows(box)) cloud_.samples->add(window, box, out);
    return;
  }
  WindowPoints more;
  points_.clear();
  for (const StoredBox& window : windows(box)) {
    reader_.points(window, points_.positions.empty() ? points_ : more);
    points_.positions.insert(points_.positions.end(), more.positions.begin(), more.positions.end());
    more.clear();
  }
  drop_duplicates();
  std::vector<Point2> places;
  places.reserve(points_.positions.size());
  for (const stream::Point3& p : points_.positions) places.push_back({p[0], p[1]});
  cloud_.places.to_geographic(places);
  const stream::Channel& channel = cloud_.store.schema().coordinates[2];
  std::size_t kept = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Point2 p = places[i];
    const double height = points_.positions[i][2] * channel.scale + channel.offset;
    // Comparisons with NaN are false, so it is outside.
    const bool inside = p[0] >= box.west && p[0] <= box.east && p[1] >= box.south &&
                        p[1] <= box.north && std::isfinite(height);
    if (!inside) continue;
    places[kept++] = p;
    out.longitude.push_back(p[0]);
    out.latitude.push_back(p[1]);
    out.height.push_back(height);
  }
  places.resize(kept);
  cloud_.vertical.convert(places, out.height);
}

std::optional<HeightRange> PointTileSurface::range(const GeographicBox& box) {
  std::optional<HeightRange> range;
  const stream::Channel& channel = cloud_.store.schema().coordinates[2];
  for (const StoredBox& window : windows(box)) {
    const auto cluster_range = cluster_heights(reader_.query(), window);
    if (!cluster_range) continue;
    const auto metres = [&](double stored) {
      return (stored * channel.scale + channel.offset) * cloud_.vertical.metres_per_unit();
    };
    const auto [low, high] = std::minmax({metres(cluster_range->low), metres(cluster_range->high)});
    if (!range) range = HeightRange{low, high, false};
    range->low = std::min(range->low, low);
    range->high = std::max(range->high, high);
    std::vector<Point2> places;
    for (const stream::Point3& p : cluster_range->examples) {
      if (std::isfinite(p[2])) places.push_back({p[0], p[1]});
    }
    cloud_.places.to_geographic(places);
    range->certain =
        range->certain || std::any_of(places.begin(), places.end(), [&](Point2 p) {
          return p[0] >= box.west && p[0] <= box.east && p[1] >= box.south && p[1] <= box.north;
        });
  }
  if (range && cloud_.vertical.has_geoid()) {
    range->low += kLowestGeoid;
    range->high += kHighestGeoid;
  }
  return range;
}

bool PointTileSurface::holds(const StoredBox& box) const { return loaded_ && loaded_->covers(box); }

void PointTileSurface::part_heights(std::span<const Point2> stored, std::span<std::uint32_t> part,
                                    std::span<double> out) {
  if (part.empty()) return;
  StoredBox box;
  for (const std::uint32_t i : part) box.include(stored[i]);
  if (!holds(box)) {
    const auto within = [&](const StoredBox& all) { return all.covers(box); };
    std::optional<StoredBox> needed;
    if (expected_ && within(*expected_) && estimate(*expected_, kMaxTogether) <= kMaxTogether) {
      needed = expected_;
    } else if (box.min == box.max || estimate(box, kMaxTogether) <= kMaxTogether) {
      needed = box;
    }
    if (!needed) {
      const std::size_t axis = box.max[0] - box.min[0] < box.max[1] - box.min[1] ? 1 : 0;
      const double middle = box.min[axis] + 0.5 * (box.max[axis] - box.min[axis]);
      const auto split = std::stable_partition(
          part.begin(), part.end(), [&](std::uint32_t i) { return stored[i][axis] < middle; });
      const auto first = static_cast<std::size_t>(split - part.begin());
      // There may be no number between two places.
      if (first == 0 || first == part.size()) {
        for (std::uint32_t& i : part) part_heights(stored, std::span(&i, 1), out);
        return;
      }
      part_heights(stored, part.first(first), out);
      part_heights(stored, part.subspan(first), out);
      return;
    }
    load(*needed);
  }
  for (const std::uint32_t i : part) out[i] = surface_.linear(stored[i]).height;
}

/// Loads the points of a box and as far around it as most circles extend.
void PointTileSurface::load(const StoredBox& box) {
  loaded_.reset();  // so that nothing is held if reading fails
  const StoredBox all = cloud_.places.stored_bounds();
  const double area = (all.max[0] - all.min[0]) * (all.max[1] - all.min[1]);
  const double margin = kTileMargin * std::sqrt(area / static_cast<double>(cloud_.store.points()));
  const std::size_t max_points = cloud_.window_bytes / PointCells::kBytesPerPoint;
  // Without points in memory, each place reads the points that it needs.
  if (!surface_.load(box.widened(margin), max_points, true)) surface_.load(box, max_points, true);
  loaded_ = box;
}

void PointTileSurface::surface_heights(std::span<const Point2> stored, std::span<double> out) {
  std::fill(out.begin(), out.end(), std::numeric_limits<double>::quiet_NaN());
  std::vector<std::uint32_t> within;
  for (std::uint32_t i = 0; i < stored.size(); ++i) {
    if (cloud_.places.stored_bounds().contains(stored[i])) within.push_back(i);
  }
  if (!has_all_) return part_heights(stored, within, out);
  for (const std::uint32_t i : within) out[i] = surface_.linear(stored[i]).height;
}

void PointTileSurface::heights(std::span<const double> longitude, std::span<const double> latitude,
                               std::span<double> out) {
  std::vector<Point2> places(longitude.size());
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = {longitude[i], latitude[i]};
  std::vector<Point2> stored = places;
  cloud_.places.to_stored(stored);
  surface_heights(stored, out);
  for (std::size_t i = 0; i < places.size(); ++i) {
    // The meridian of 180 degrees has two numbers, and tiles on both sides.
    if (places[i][0] == 180.0) places[i][0] = -180.0;
    if (std::isnan(out[i]) && !cloud_.flat_fill &&
        cloud_.points->hull.distance(stored[i]) <= cloud_.rim) {
      out[i] = cloud_.fill.height(stored[i][0], stored[i][1]);
    }
  }
  cloud_.vertical.convert(places, out);
  for (double& height : out) {
    if (std::isnan(height)) height = cloud_.height_beyond();
  }
}

void PointTileSurface::water(std::span<const double> longitude, std::span<const double> latitude,
                             std::span<std::uint8_t> out) {
  std::fill(out.begin(), out.end(), std::uint8_t{0});
  if (!cloud_.water_height) return;
  std::vector<Point2> stored(longitude.size());
  for (std::size_t i = 0; i < stored.size(); ++i) stored[i] = {longitude[i], latitude[i]};
  cloud_.places.to_stored(stored);
  std::vector<double> heights(stored.size());
  surface_heights(stored, heights);
  // Values between three points of equal height may be rounded.
  const double level = *cloud_.water_height, slack = 1e-9 * std::max(1.0, std::abs(level));
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = std::abs(heights[i] - level) <= slack ? 1 : 0;
  }
}

std::uint64_t PointTileSurface::digest(const GeographicBox& /*box*/) {
  Digest digest;
  digest.add(std::uint64_t{cloud_.store.checksum()});
  digest.add(cloud_.store.points());
  if (const stream::Where* condition = cloud_.store.condition()) digest.add(condition->text());
  cloud_.add_to(digest);
  return digest.value();
}

}  // namespace terrace::terrain
