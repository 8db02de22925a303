// SPDX-License-Identifier: Apache-2.0
#include "base/store_checks.hpp"

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

void need_points(const stream::Store& store, const std::string& what) {
  const stream::Entities entities = entities_of(store.schema());
  if (entities == stream::Entities::points) return;
  throw stream::Error(store.path().string(),
                      fmt::format("holds {}, and {} needs points", stream::name_of(entities), what))
      .remedy(stream::message("build a store of the vertices: leave {entities} out"));
}

bool is_geocentric(const stream::Crs& recorded) {
  // In the WKT 2 that PROJ writes; a geographic system starts with GEOGCRS instead.
  return recorded.wkt.starts_with("GEODCRS[");
}

void need_terrain(const stream::Store& store, const std::string& what) {
  need_points(store, what);
  const stream::Crs& crs = store.schema().crs;
  if (!is_geocentric(crs)) return;
  throw stream::Error(store.path().string(), "has the geocentric CRS \"" + crs.name +
                                                 "\", in which z is not a height, and " + what +
                                                 " needs heights")
      .remedy(
          "convert the points to a projected CRS and build a store of "
          "them, or make a surface of the scan");
}

void need_level(const stream::Store& store, unsigned level) {
  if (level <= store.top()) return;
  throw UsageError(
      fmt::format("the store has no level {}: its top is level {}", level, store.top()));
}

void need_all_points(const stream::Store& store, unsigned level, std::uint64_t points) {
  const std::uint64_t expected = store.levels()[level].points;
  if (points == expected) return;
  throw stream::Error(store.path().string(),
                      fmt::format("the clusters have {} instead of the {} in the manifest",
                                  counted(points, "point"), expected))
      .at(fmt::format("level {}", level))
      .remedy("restore the files or rebuild the store");
}

void need_memory_for_surface(const stream::Store& store, std::uint64_t points,
                             std::uint64_t bytes_per_point, std::uint64_t memory_bytes,
                             const stream::Message& remedy) {
  // Of the program, and for reading the store.
  constexpr std::uint64_t kOtherBytes = std::uint64_t{48} << 20;
  const std::uint64_t needed = kOtherBytes + points * bytes_per_point;
  if (needed <= memory_bytes) return;
  throw stream::Error(store.path().string(),
                      stream::message("a surface of {} needs {}, {memory_bytes} allows {}",
                                      counted(points, "point"), readable_bytes(needed),
                                      readable_bytes(memory_bytes)))
      .remedy(remedy);
}

std::string extent_text(const stream::Store& store) {
  const stream::Box3 box = world_box(store.schema(), store.bounds());
  std::string out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out += std::string(axis > 0 ? ", " : "") + "xyz"[axis] + " from " +
           readable_number(box.min[axis], 10) + " to " + readable_number(box.max[axis], 10);
  }
  return out;
}

void throw_none_inside(const stream::Store& store, const std::string& what) {
  throw stream::Error(
      store.path().string(),
      fmt::format("no {} is in the region; the points have {}", what, extent_text(store)))
      .remedy(stream::message(
          "give a {region} that contains some of them: boxes are in their CRS or in {region_crs}, "
          "GeoJSON is in the CRS that it names, by default longitude and latitude"));
}

}  // namespace terrace::terrain
