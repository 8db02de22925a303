// SPDX-License-Identifier: Apache-2.0
#include "sample/store_probe.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

#include <terrace/stream/given_bytes.hpp>

#include "base/vector.hpp"
#include "sample/lattice_crossings.hpp"
#include "surface/lattice_surface.hpp"

namespace terrace::terrain {
namespace {

using stream::Box3;
using stream::Point3;

/// Places on a raster need little data.
constexpr std::uint64_t kAll = UINT64_MAX;

/// Copies the attributes of a member, `bytes` bytes.
void copy_record(const stream::ClusterPoints& points, std::size_t member, std::size_t bytes,
                 std::vector<std::byte>& record) {
  record.resize(bytes);
  std::copy_n(points.payload.data() + member * bytes, bytes, record.data());
}

/// The space between two parallel planes in stored coordinates.
struct Slab {
  Point3 normal{};
  double low = 0, high = 0;

  /// Also true for boxes that are outside only by rounding.
  [[nodiscard]] bool meets(const Box3& box) const {
    double middle = 0, half = 0, size = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      middle += normal[k] * (box.min[k] + box.max[k]) / 2;
      half += std::abs(normal[k]) * (box.max[k] - box.min[k]) / 2;
      size += std::abs(normal[k]) * (std::abs(box.min[k]) + std::abs(box.max[k]));
    }
    half += 1e-12 * size;
    return middle + half >= low && middle - half <= high;
  }
  [[nodiscard]] bool holds(const Point3& p) const {
    const double at = dot(normal, p);
    return at >= low && at <= high;
  }
};

/// Returns the vector in stored coordinates whose product with a stored difference equals that of
/// `direction` with the difference in metres.
Point3 in_stored(const stream::LinearMap& ground, const Point3& direction) {
  Point3 result{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t row = 0; row < 3; ++row) result[k] += direction[row] * ground[3 * row + k];
  }
  return result;
}

/// A line across a raster's lattice.
struct Way {
  Point2 from{}, to{};

  [[nodiscard]] Point2 at(double t) const {
    return {from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])};
  }
  /// Returns the part of the line at most a cell from samples of the box; begin > end if there is
  /// none.
  [[nodiscard]] std::array<double, 2> part_near(const std::array<double, 2>& min,
                                                const std::array<double, 2>& max) const {
    double begin = 0, end = 1;
    for (std::size_t k = 0; k < 2; ++k) {
      const double step = to[k] - from[k], low = min[k] - 1 - from[k], high = max[k] + 1 - from[k];
      if (step == 0) {
        if (low > 0 || high < 0) return {1, 0};
        continue;
      }
      begin = std::max(begin, std::min(low / step, high / step));
      end = std::min(end, std::max(low / step, high / step));
    }
    return {begin, end};
  }
};

}  // namespace

/// The known samples of a raster, with at() as in LatticeView.
class StoreProbe::SomeSamples {
 public:
  explicit SomeSamples(const stream::Channel& heights) : heights_(heights) {}

  void add(const Point3& p) { samples_.push_back({p[1], p[0], p[2]}); }
  /// Heap sort is half as fast as std::sort() but a quarter of the code, which browsers download.
  void sort() {
    std::make_heap(samples_.begin(), samples_.end());
    std::sort_heap(samples_.begin(), samples_.end());
  }
  [[nodiscard]] double at(std::int64_t column, std::int64_t row) const {
    const Sample target{static_cast<double>(row), static_cast<double>(column),
                        -std::numeric_limits<double>::infinity()};
    const auto sample = std::lower_bound(samples_.begin(), samples_.end(), target);
    if (sample == samples_.end() || (*sample)[0] != target[0] || (*sample)[1] != target[1]) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return (*sample)[2] * heights_.scale + heights_.offset;
  }
  [[nodiscard]] double height(const Point2& place) const {
    const double left = std::floor(place[0]), top = std::floor(place[1]);
    const double u = place[0] - left, v = place[1] - top;
    const auto column = static_cast<std::int64_t>(left), row = static_cast<std::int64_t>(top);
    if (u == 0 || v == 0 || u + v == 1) return linear_on_lines(*this, column, row, u, v).height;
    return triangles_at(
               {at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)},
               u, v)
        .first.height;
  }

 private:
  using Sample = std::array<double, 3>;  ///< row, column, stored height

  const stream::Channel& heights_;
  std::vector<Sample> samples_;
};

unsigned StoreProbe::descend(std::uint64_t max_points,
                             const std::function<bool(const stream::Box3&)>& wants,
                             const std::function<void(const stream::ClusterPoints&)>& visit) {
  std::vector<stream::ByteRange> missing;
  const auto have = [&missing](const auto& read) {
    try {
      read();
      return true;
    } catch (const stream::MissingBytes& lacked) {
      for (const stream::ByteRange& range : lacked.ranges()) {
        // Records of one page lack the same bytes, and are consecutive.
        const auto last = missing.end() - std::min<std::ptrdiff_t>(16, std::ssize(missing));
        if (std::find(last, missing.end(), range) == missing.end()) missing.push_back(range);
      }
      return false;
    }
  };
  const unsigned top = store_.top();
  struct Level {
    std::vector<std::uint64_t> ordinals;
    std::uint64_t points = 0;
  };
  std::vector<Level> levels(top + 1);
  levels[top].ordinals = {0};
  std::uint64_t read = 0;
  unsigned level = top + 1;
  while (level > 0) {
    Level& current = levels[level - 1];
    read += current.points;
    if (read > max_points) break;
    --level;
    std::sort(current.ordinals.begin(), current.ordinals.end());
    std::uint64_t last = UINT64_MAX;
    for (const std::uint64_t ordinal : current.ordinals) {
      if (ordinal == std::exchange(last, ordinal)) continue;  // only if the store is damaged
      if (!have([&] { store_.read(stream::cluster_id(level, ordinal), points_); })) continue;
      visit(points_);
      for (std::size_t i = 0; i < points_.children.size(); i += level) {
        // A point's cluster on one level is within its cluster on the level above.
        for (unsigned below = level; below-- > 0;) {
          const std::uint64_t child = points_.children[i + below];
          const stream::ClusterId id = stream::cluster_id(below, child);
          bool in = wants(store_.coarse_box(id));
          const bool known = !in || have([&] {
            in = wants(store_.page_box(id));
            if (!in) return;
            const stream::ClusterRecord record = store_.record(id);
            in = wants(record.summary.box);
            if (!in) return;
            levels[below].ordinals.push_back(child);
            levels[below].points += record.points;
          });
          if (known && !in) break;
        }
      }
    }
  }
  if (!missing.empty()) throw stream::MissingBytes(std::move(missing));
  return level;
}

StoreProbe::Found StoreProbe::found(const Point3& stored, const std::vector<std::byte>& record,
                                    unsigned level) const {
  Found result{.stored = stored, .place = frame_(stored), .level = level};
  const stream::StoreSchema& schema = store_.schema();
  for (std::size_t i = 0; i < schema.attributes.size() && !record.empty(); ++i) {
    result.attributes.push_back(
        stream::to_double(schema.attributes[i].type, record.data() + schema.attribute_offset(i)));
  }
  return result;
}

std::optional<StoreProbe::Found> StoreProbe::on_raster(double column, double row) {
  const Way place{{column, row}, {column, row}};
  const std::size_t bytes = store_.schema().payload_size();
  const stream::Channel& channel = store_.schema().coordinates[2];
  SomeSamples samples(channel);
  std::vector<std::byte> record;
  descend(
      kAll,
      [&](const Box3& box) {
        return place.part_near({box.min[0], box.min[1]}, {box.max[0], box.max[1]})[1] == 1;
      },
      [&](const stream::ClusterPoints& points) {
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Point3& p = points.positions[i];
          if (std::abs(p[0] - column) > 1 || std::abs(p[1] - row) > 1) continue;
          samples.add(p);
          if (p[0] != std::floor(column + 0.5) || p[1] != std::floor(row + 0.5)) continue;
          copy_record(points, i, bytes, record);
        }
      });
  samples.sort();
  const double height = samples.height({column, row});
  if (std::isnan(height)) return std::nullopt;
  return found({column, row, (height - channel.offset) / channel.scale}, record, 0);
}

std::optional<StoreProbe::Found> StoreProbe::nearest(const Point3& place, double reach) {
  const stream::LinearMap& ground = frame_.ground();
  std::array<Slab, 3> around;
  for (std::size_t k = 0; k < 3; ++k) {
    Point3 axis{};
    axis[k] = 1;
    around[k].normal = in_stored(ground, axis);
    const double at = dot(around[k].normal, place);
    around[k].low = at - reach;
    around[k].high = at + reach;
  }
  const std::size_t bytes = store_.schema().payload_size();
  const Point3 centre = frame_(place);
  double best = std::numeric_limits<double>::infinity();
  Point3 stored{};
  std::vector<std::byte> record;
  const unsigned level = descend(
      kMaxRead,
      [&](const Box3& box) {
        return around[0].meets(box) && around[1].meets(box) && around[2].meets(box);
      },
      [&](const stream::ClusterPoints& points) {
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Point3& p = points.positions[i];
          const Point3 at = frame_(p);
          const Point3 way{at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]};
          const double square = dot(way, way);
          if (square > best || (square == best && stored < p)) continue;
          best = square;
          stored = p;
          copy_record(points, i, bytes, record);
        }
      });
  if (!(best <= reach * reach)) return std::nullopt;
  return found(stored, record, level);
}

StoreProbe::Profile StoreProbe::profile(const Point3& from, const Point3& to, std::size_t axis) {
  return store_.schema().grid ? of_raster(from, to) : of_points(from, to, axis);
}

StoreProbe::Profile StoreProbe::of_raster(const Point3& from, const Point3& to) {
  const Way way{{from[0], from[1]}, {to[0], to[1]}};
  Profile profile;
  const Point3 a = frame_({from[0], from[1], 0}), b = frame_({to[0], to[1], 0});
  profile.metres = std::sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
  // Crossings with columns and rows, and with as many diagonals at most.
  const double cells = std::abs(to[0] - from[0]) + std::abs(to[1] - from[1]);
  profile.sampled = 2 * cells > kMaxCrossings;
  std::vector<Point2> places{way.from};
  profile.points.push_back({0, 0});
  if (profile.sampled) {
    for (double i = 1; i < kSamples; ++i) {
      places.push_back(way.at(i / kSamples));
      profile.points.push_back({i / kSamples, 0});
    }
  } else {
    for_lattice_crossings(way.from, way.to, [&](double t, const Point2& place) {
      places.push_back(place);
      profile.points.push_back({t, 0});
    });
  }
  places.push_back(way.to);
  profile.points.push_back({1, 0});

  const auto matters = [&](const std::array<double, 2>& min, const std::array<double, 2>& max) {
    const auto [begin, end] = way.part_near(min, max);
    if (!profile.sampled) return begin <= end;
    return std::ceil(begin * kSamples - 1e-6) <= std::floor(end * kSamples + 1e-6);
  };
  SomeSamples samples(store_.schema().coordinates[2]);
  descend(
      kAll,
      [&](const Box3& box) {
        return matters({box.min[0], box.min[1]}, {box.max[0], box.max[1]});
      },
      [&](const stream::ClusterPoints& points) {
        for (const Point3& p : points.positions) {
          if (matters({p[0], p[1]}, {p[0], p[1]})) samples.add(p);
        }
      });
  samples.sort();
  for (std::size_t i = 0; i < places.size(); ++i) profile.points[i][1] = samples.height(places[i]);
  return profile;
}

StoreProbe::Profile StoreProbe::of_points(const Point3& from, const Point3& to, std::size_t axis) {
  const stream::LinearMap& ground = frame_.ground();
  const Point3 a = frame_(from), b = frame_(to);
  Point3 ahead{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  ahead[axis] = 0;
  Profile profile;
  profile.metres = std::sqrt(dot(ahead, ahead));
  if (!(profile.metres > 0)) return profile;
  for (double& c : ahead) c /= profile.metres;
  const Point3 left = axis == 2 ? Point3{-ahead[1], ahead[0], 0} : Point3{ahead[2], 0, -ahead[0]};
  Slab along{in_stored(ground, ahead), 0, 0}, aside{in_stored(ground, left), 0, 0};
  along.low = dot(along.normal, from);
  along.high = along.low + profile.metres;
  const double middle = dot(aside.normal, from), reach = kStrip / 2 * profile.metres;
  aside.low = middle - reach;
  aside.high = middle + reach;
  const stream::StoreSchema& schema = store_.schema();
  const auto height = [&](const Point3& p) {
    const std::array<double, 6>& xy = schema.world.xy;
    if (axis == 1) return xy[3] * p[0] + xy[4] * p[1] + xy[5];
    return p[2] * schema.coordinates[2].scale + schema.coordinates[2].offset;
  };
  profile.level = descend(
      kMaxRead, [&](const Box3& box) { return along.meets(box) && aside.meets(box); },
      [&](const stream::ClusterPoints& points) {
        for (const Point3& p : points.positions) {
          if (!along.holds(p) || !aside.holds(p)) continue;
          profile.points.push_back(
              {(dot(along.normal, p) - along.low) / profile.metres, height(p)});
        }
      });
  return profile;
}

}  // namespace terrace::terrain
