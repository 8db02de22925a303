// SPDX-License-Identifier: Apache-2.0
#include "tile/make/sides.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <terrace/base/portable_math.hpp>

#include "tile/format/ellipsoid.hpp"
#include "tile/format/quantized_mesh.hpp"

namespace terrace::terrain {
namespace {

/// A leaf has at least this many units along each axis.
constexpr unsigned kDeepestLeaf = 8;
/// The most places at which a side of a leaf is sampled.
constexpr double kMaxSidePlaces = 4096.0;
/// Share of the bound for sides. Samples so close to a side that no vertex fits in between have the
/// error of the side.
constexpr double kSideShare = 0.75;

/// Returns the width of a tile's part at a depth; exact.
double width_at(unsigned zoom, unsigned depth) {
  return std::ldexp(180.0, -static_cast<int>(zoom + depth));
}

bool boxes_meet(const GeographicBox& a, const GeographicBox& b) {
  return a.west <= b.east && b.west <= a.east && a.south <= b.north && b.south <= a.north;
}

}  // namespace

ZoomPlan plan_zoom(unsigned zoom, double max_error, double range, const TileSurface& surface) {
  ZoomPlan plan;
  plan.zoom = zoom;
  // All heights of a tile must fit in 32767 steps and be exact as floats. A step is at least half a
  // millimetre.
  plan.height_step = 0x1p-11;
  while (plan.height_step * (kTileUnits - 2) < range) plan.height_step *= 2.0;
  // The range of a tile is divided into 32767 parts, and vertices are rounded to the nearest. So
  // they move by at most half a step.
  plan.max_error = std::max(max_error - 0.5 * plan.height_step, 0.5 * max_error);
  // A chord of angle a is at most R a^2 / 8 below its arc: half of the error that clients expect at
  // the zoom.
  plan.longest_edge =
      std::sqrt(8.0 * 0.5 * expected_error(zoom) / kEquatorialRadius) / base::kRadiansPerDegree;
  plan.widest_leaf = surface.widest_part();
  return plan;
}

std::uint32_t leaf_unit(std::uint32_t k, unsigned depth) {
  return (std::uint32_t{kTileUnits} * k + (1U << depth) / 2) >> depth;
}

double tile_width(unsigned zoom) { return std::ldexp(180.0, -static_cast<int>(zoom)); }

double longitude_at(const TileAddress& tile, double units) {
  return -180.0 + tile_width(tile.zoom) * (tile.x + units / kTileUnits);
}

double latitude_at(const TileAddress& tile, double units) {
  return -90.0 + tile_width(tile.zoom) * (tile.y + units / kTileUnits);
}

GeographicBox box_of(const TileAddress& tile, const TileLeaf& leaf) {
  return {longitude_at(tile, leaf_unit(leaf.x, leaf.depth)),
          latitude_at(tile, leaf_unit(leaf.y, leaf.depth)),
          longitude_at(tile, leaf_unit(leaf.x + 1, leaf.depth)),
          latitude_at(tile, leaf_unit(leaf.y + 1, leaf.depth))};
}

std::vector<TileLeaf> leaves_of(const TileAddress& tile, const ZoomPlan& plan,
                                TileSurface& surface) {
  const GeographicBox data = surface.bounds();
  std::vector<TileLeaf> leaves, open{{}};
  while (!open.empty()) {
    surface.check_stop();
    const TileLeaf leaf = open.back();
    open.pop_back();
    const auto wide = [&] {
      const double width = width_at(tile.zoom, leaf.depth);
      if (width > plan.longest_edge) return true;
      const GeographicBox box = box_of(tile, leaf);
      return (width > plan.widest_leaf && boxes_meet(box, data)) || surface.crowded(box);
    };
    if (leaf.depth == kDeepestLeaf || !wide()) {
      leaves.push_back(leaf);
      continue;
    }
    for (unsigned quarter = 4; quarter-- > 0;) {
      open.push_back({leaf.depth + 1, 2 * leaf.x + (quarter & 1), 2 * leaf.y + (quarter >> 1)});
    }
  }
  return leaves;
}

TileSides::TileSides(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
                     SharedSides* shared)
    : tile_(tile),
      plan_(plan),
      surface_(surface),
      border_(shared != nullptr ? *shared : inner_),
      data_(surface.bounds()) {}

bool TileSides::is_cut(const Side& side) const {
  if (side.depth == kDeepestLeaf) return false;
  // A leaf next to the side is within its length on either side of it, and is divided if this is
  // true. So the side is divided wherever a leaf of its length is.
  const double width = width_at(tile_.zoom, side.depth);
  if (width > plan_.longest_edge) return true;
  // Use slightly more than the length, because units are rounded.
  if (width > plan_.widest_leaf && is_near_data(side, 1.01 * width)) return true;
  return is_crowded(side);
}

bool TileSides::is_crowded(const Side& side) const {
  const std::uint32_t parts = 1U << side.depth;
  const std::uint32_t columns = tile_columns(tile_.zoom), rows = tile_rows(tile_.zoom);
  for (const bool before : {true, false}) {
    // With the numbers in the leaf's own tile.
    TileAddress tile = tile_;
    TileLeaf leaf{side.depth, side.k, side.k};
    std::uint32_t& across = side.along_parallel ? leaf.y : leaf.x;
    std::uint32_t& place = side.along_parallel ? tile.y : tile.x;
    if (before && side.line == 0) {
      if (side.along_parallel && place == 0) continue;
      place = place == 0 ? columns - 1 : place - 1;
      across = parts - 1;
    } else if (!before && side.line == parts) {
      if (side.along_parallel && place == rows - 1) continue;
      place = !side.along_parallel && place == columns - 1 ? 0 : place + 1;
      across = 0;
    } else {
      across = before ? side.line - 1 : side.line;
    }
    if (surface_.crowded(box_of(tile, leaf))) return true;
  }
  return false;
}

bool TileSides::is_near_data(const Side& side, double reach) const {
  const double from = leaf_unit(side.k, side.depth), to = leaf_unit(side.k + 1, side.depth);
  const double line = leaf_unit(side.line, side.depth);
  GeographicBox box;
  if (side.along_parallel) {
    const double latitude = latitude_at(tile_, line);
    box = {longitude_at(tile_, from), latitude - reach, longitude_at(tile_, to), latitude + reach};
  } else {
    const double longitude = longitude_at(tile_, line);
    box = {longitude - reach, latitude_at(tile_, from), longitude + reach, latitude_at(tile_, to)};
    // The meridian of 180 degrees has two numbers, and tiles on both sides.
    if (std::abs(longitude) == 180.0) {
      const GeographicBox other{-longitude - reach, box.south, -longitude + reach, box.north};
      if (boxes_meet(other, data_)) return true;
    }
  }
  return boxes_meet(box, data_);
}

GeographicBox TileSides::band_around(const Side& side) const {
  const double from = leaf_unit(side.k, side.depth), to = leaf_unit(side.k + 1, side.depth);
  const double line = leaf_unit(side.line, side.depth);
  const double unit = tile_width(tile_.zoom) / kTileUnits;
  if (side.along_parallel) {
    const double latitude = latitude_at(tile_, line);
    return {longitude_at(tile_, from), latitude - unit, longitude_at(tile_, to), latitude + unit};
  }
  const double longitude = longitude_at(tile_, line);
  return {longitude - unit, latitude_at(tile_, from), longitude + unit, latitude_at(tile_, to)};
}

bool TileSides::is_flat(const GeographicBox& band) const {
  const std::optional<HeightRange> range = surface_.surface_range(band);
  // Heights of the ends are rounded to steps.
  return range && range->high - range->low + plan_.height_step <= kSideShare * plan_.max_error;
}

SideVertices TileSides::settle(const Side& side) {
  if (is_cut(side)) {
    const Side first{side.along_parallel, side.depth + 1, 2 * side.line, 2 * side.k};
    Side second = first;
    ++second.k;
    SideVertices all = *vertices(first);
    const auto rest = vertices(second);
    all.insert(all.end(), rest->begin() + 1, rest->end());
    return all;
  }
  const std::uint32_t from = leaf_unit(side.k, side.depth);
  const std::uint32_t to = leaf_unit(side.k + 1, side.depth);
  const std::uint32_t across = leaf_unit(side.line, side.depth);

  // Use two places per sample, at equal distances. Far from all samples, and where heights are
  // nearly equal, the ends suffice.
  const double length = width_at(tile_.zoom, side.depth);
  const double unit = tile_width(tile_.zoom) / kTileUnits;
  const bool looked_at =
      is_near_data(side, 2.0 * (unit + surface_.spacing())) && !is_flat(band_around(side));
  const double count =
      looked_at ? std::min(2.0 * length / surface_.spacing(), kMaxSidePlaces) : 1.0;
  const auto parts =
      static_cast<std::size_t>(std::clamp(std::ceil(count), 1.0, static_cast<double>(to - from)));
  std::vector<double> t, longitude, latitude, height;
  for (std::size_t i = 0; i <= parts; ++i) {
    const double at =
        from + static_cast<double>(to - from) * static_cast<double>(i) / static_cast<double>(parts);
    t.push_back(at);
    longitude.push_back(longitude_at(tile_, side.along_parallel ? at : across));
    latitude.push_back(latitude_at(tile_, side.along_parallel ? across : at));
  }
  SamplesAt samples;
  if (looked_at) samples = add_samples(side, t, longitude, latitude);
  for (const std::size_t end : {std::size_t{0}, t.size() - 1}) {
    if (const auto corner = samples_at_corner(longitude[end], latitude[end])) {
      samples[t[end]] = *corner;
    }
  }
  height.resize(t.size());
  surface_.heights(longitude, latitude, height);
  for (const auto& [at, between] : samples) {
    const auto place = std::lower_bound(t.begin(), t.end(), at) - t.begin();
    // Use the middle of the range, to minimise the largest distance.
    height[static_cast<std::size_t>(place)] = between.low + 0.5 * (between.high - between.low);
  }
  const tri::SimplifiedLine line = tri::simplify_line(t, height, kSideShare * plan_.max_error,
                                                      tri::TinLattice{0.0, plan_.height_step});
  SideVertices vertices;
  for (const tri::LineVertex& vertex : line.vertices) {
    vertices.push_back({vertex.t, vertex.height});
  }
  return vertices;
}

std::shared_ptr<const SideVertices> TileSides::vertices(const Side& side) {
  const std::uint64_t parts = std::uint64_t{1} << side.depth;
  const auto [across, along] =
      side.along_parallel ? std::pair(tile_.y, tile_.x) : std::pair(tile_.x, tile_.y);
  const TileSideKey key{side.along_parallel, side.depth, across * parts + side.line,
                        along * parts + side.k};
  const bool on_border = side.line == 0 || side.line == parts;
  return (on_border ? border_ : inner_).vertices(key, [&] { return settle(side); });
}

std::vector<TileVertex> TileSides::around(const TileLeaf& leaf) {
  std::vector<TileVertex> ring;
  const auto add = [&](const Side& side, bool backward) {
    const auto side_vertices = vertices(side);
    const std::uint32_t across = leaf_unit(side.line, side.depth);
    // The last vertex is the first of the next side.
    for (std::size_t i = 0; i + 1 < side_vertices->size(); ++i) {
      const SideVertex& vertex = (*side_vertices)[backward ? side_vertices->size() - 1 - i : i];
      const auto at = static_cast<std::uint32_t>(vertex.at);
      ring.push_back({side.along_parallel ? at : across, side.along_parallel ? across : at,
                      std::llround(vertex.height / plan_.height_step)});
    }
  };
  add({true, leaf.depth, leaf.y, leaf.x}, false);
  add({false, leaf.depth, leaf.x + 1, leaf.y}, false);
  add({true, leaf.depth, leaf.y + 1, leaf.x}, true);
  add({false, leaf.depth, leaf.x, leaf.y}, true);
  return ring;
}

void TileSides::Samples::add(double height, double units) {
  // Samples that round to the side's own places cannot become vertices elsewhere, so they take
  // precedence.
  const bool on_side = units <= 0.5;
  if (!any || (on_side && !on)) {
    *this = {height, height, true, on_side};
  } else if (on_side == on) {
    low = std::min(low, height);
    high = std::max(high, height);
  }
}

TileSides::SamplesAt TileSides::add_samples(const Side& side, std::vector<double>& t,
                                            std::vector<double>& longitude,
                                            std::vector<double>& latitude) {
  SamplesAt samples;
  // Tiles on both sides of 180 degrees see different samples, unless both request those of both
  // sides.
  const bool on_180 = !side.along_parallel && std::abs(longitude.front()) == 180.0;
  if (on_180 && !surface_.sides_take_samples()) return samples;
  const double unit = tile_width(tile_.zoom) / kTileUnits;
  const std::size_t before = t.size();
  const double from = t.front(), to = t.back();
  const std::optional<SurfaceSamples> near = samples_near(band_around(side));
  if (!near) {
    // The smallest leaves have few places.
    for (double at = from + 1.0; at < to; at += 1.0) t.push_back(at);
  } else {
    for (std::size_t i = 0; i < near->size(); ++i) {
      const double east = on_180 ? (180.0 - std::abs(near->longitude[i])) / unit
                                 : (near->longitude[i] - longitude[0]) / unit;
      const double north = (near->latitude[i] - latitude[0]) / unit;
      // Vertices can only be at integers.
      const double shifted = from + std::round(side.along_parallel ? east : north);
      if (!(shifted > from && shifted < to)) continue;
      t.push_back(shifted);
      if (surface_.sides_take_samples()) {
        samples[shifted].add(near->height[i], std::abs(side.along_parallel ? north : east));
      }
    }
  }
  std::sort(t.begin(), t.end());
  t.erase(std::unique(t.begin(), t.end()), t.end());
  if (t.size() == before) return samples;
  const double across = leaf_unit(side.line, side.depth);
  longitude.clear();
  latitude.clear();
  for (const double at : t) {
    longitude.push_back(longitude_at(tile_, side.along_parallel ? at : across));
    latitude.push_back(latitude_at(tile_, side.along_parallel ? across : at));
  }
  return samples;
}

std::optional<SurfaceSamples> TileSides::samples_near(const GeographicBox& box) {
  SurfaceSamples all, part_samples;
  const auto add = [&](const GeographicBox& part) {
    if (surface_.crowded(part)) return false;
    surface_.samples(part, part_samples);
    all.longitude.insert(all.longitude.end(), part_samples.longitude.begin(),
                         part_samples.longitude.end());
    all.latitude.insert(all.latitude.end(), part_samples.latitude.begin(),
                        part_samples.latitude.end());
    all.height.insert(all.height.end(), part_samples.height.begin(), part_samples.height.end());
    return true;
  };
  // Beyond 180 degrees the globe continues at the other end, for tiles on both sides.
  const bool beyond_east = box.east > 180.0, beyond_west = box.west < -180.0;
  const double reach = beyond_east ? box.east - 180.0 : -180.0 - box.west;
  bool added = false;
  if (beyond_east || beyond_west) {
    added = add({180.0 - reach, box.south, 180.0, box.north}) &&
            add({-180.0, box.south, -180.0 + reach, box.north});
  } else {
    added = add(box);
  }
  if (!added) return std::nullopt;
  return all;
}

std::optional<TileSides::Samples> TileSides::samples_at_corner(double longitude, double latitude) {
  if (!surface_.sides_take_samples()) return std::nullopt;
  const auto [entry, fresh] = corners_.try_emplace({longitude, latitude}, std::nullopt);
  if (!fresh) return entry->second;
  const double unit = tile_width(tile_.zoom) / kTileUnits;
  const std::optional<SurfaceSamples> near =
      samples_near({longitude - unit, latitude - unit, longitude + unit, latitude + unit});
  if (!near || near->size() == 0) return std::nullopt;
  Samples samples;
  for (std::size_t i = 0; i < near->size(); ++i) {
    const double east = std::abs(longitude) == 180.0 ? 180.0 - std::abs(near->longitude[i])
                                                     : near->longitude[i] - longitude;
    const double north = near->latitude[i] - latitude;
    samples.add(near->height[i], std::max(std::abs(east), std::abs(north)) / unit);
  }
  entry->second = samples;
  return entry->second;
}

}  // namespace terrace::terrain
