// SPDX-License-Identifier: Apache-2.0
// What sides of leaves take from the samples on them.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tile/format/quantized_mesh.hpp"
#include "tile/make/tile_sides.hpp"

namespace terrace::terrain {

void TileSides::Samples::add(double height, double units) {
  // Those that round to the side's own places cannot become vertices elsewhere, so they count
  // first.
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
  SamplesAt found;
  // Tiles on both sides of 180 degrees do not see the same samples, unless both ask for those of
  // both.
  const bool on_180 = !side.along_parallel && std::abs(longitude.front()) == 180.0;
  if (on_180 && !surface_.sides_take_samples()) return found;
  // From what both tiles beside the side share: its ends, and a unit to either side.
  const double unit = tile_width(tile_.zoom) / kTileUnits;
  const double reach_longitude = side.along_parallel ? 0.0 : unit;
  const double reach_latitude = side.along_parallel ? unit : 0.0;
  const GeographicBox band{longitude.front() - reach_longitude, latitude.front() - reach_latitude,
                           longitude.back() + reach_longitude, latitude.back() + reach_latitude};
  const std::size_t before = t.size();
  const double from = t.front(), to = t.back();
  const std::optional<SurfaceSamples> near = samples_near(band);
  if (!near) {
    // The smallest leaves have few places.
    for (double at = from + 1.0; at < to; at += 1.0) t.push_back(at);
  } else {
    for (std::size_t i = 0; i < near->size(); ++i) {
      const double east = on_180 ? (180.0 - std::abs(near->longitude[i])) / unit
                                 : (near->longitude[i] - longitude[0]) / unit;
      const double north = (near->latitude[i] - latitude[0]) / unit;
      // A vertex can stand at whole numbers only.
      const double whole = from + std::round(side.along_parallel ? east : north);
      if (!(whole > from && whole < to)) continue;
      t.push_back(whole);
      if (surface_.sides_take_samples()) {
        found[whole].add(near->height[i], std::abs(side.along_parallel ? north : east));
      }
    }
  }
  std::sort(t.begin(), t.end());
  t.erase(std::unique(t.begin(), t.end()), t.end());
  if (t.size() == before) return found;
  const double across = leaf_unit(side.line, side.depth);
  longitude.clear();
  latitude.clear();
  for (const double at : t) {
    longitude.push_back(longitude_at(tile_, side.along_parallel ? at : across));
    latitude.push_back(latitude_at(tile_, side.along_parallel ? across : at));
  }
  return found;
}

std::optional<SurfaceSamples> TileSides::samples_near(const GeographicBox& box) {
  SurfaceSamples all, some;
  const auto add = [&](const GeographicBox& part) {
    if (surface_.crowded(part)) return false;
    surface_.samples(part, some);
    all.longitude.insert(all.longitude.end(), some.longitude.begin(), some.longitude.end());
    all.latitude.insert(all.latitude.end(), some.latitude.begin(), some.latitude.end());
    all.height.insert(all.height.end(), some.height.begin(), some.height.end());
    return true;
  };
  // Beyond the line of 180 degrees the globe goes on from the other end, for both tiles beside it.
  const bool beyond_east = box.east > 180.0, beyond_west = box.west < -180.0;
  const double reach = beyond_east ? box.east - 180.0 : -180.0 - box.west;
  bool taken = false;
  if (beyond_east || beyond_west) {
    taken = add({180.0 - reach, box.south, 180.0, box.north}) &&
            add({-180.0, box.south, -180.0 + reach, box.north});
  } else {
    taken = add(box);
  }
  if (!taken) return std::nullopt;
  return all;
}

std::optional<TileSides::Samples> TileSides::samples_at_corner(double longitude, double latitude) {
  if (!surface_.sides_take_samples()) return std::nullopt;
  const auto [known, fresh] = corners_.try_emplace({longitude, latitude}, std::nullopt);
  if (!fresh) return known->second;
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
  known->second = samples;
  return known->second;
}

}  // namespace terrace::terrain
