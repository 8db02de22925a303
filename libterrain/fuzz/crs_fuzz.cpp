// SPDX-License-Identifier: Apache-2.0
// Coordinate reference systems. The first line says how they are given: "text" as for --crs (WKT or
// codes), "wkt" as in a source, "keys" as GeoKeys, one per line (number=values or number="text"),
// "shift" as for --towgs84. A known CRS must convert places without failing, and survive being
// stored and read back.
#include <charconv>
#include <cmath>
#include <vector>

#include "fuzz_target.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain::fuzz {

namespace {

stream::Crs crs_of_keys(std::string_view text) {
  stream::Crs crs;
  while (!text.empty() && crs.geo_keys.size() < 100) {
    std::string_view line = take_line(text);
    stream::GeoKey key;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), key.key);
    if (error != std::errc{} || end == line.data() + line.size() || *end != '=') continue;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()) + 1);
    if (line.starts_with('"')) {
      key.text = line.substr(1, line.find('"', 1) - 1);
    } else {
      for (double value = 0; !line.empty();) {
        const auto number = std::from_chars(line.data(), line.data() + line.size(), value);
        if (number.ec != std::errc{}) break;
        key.values.push_back(value);
        line.remove_prefix(static_cast<std::size_t>(number.ptr - line.data()));
        if (line.starts_with(',')) line.remove_prefix(1);
      }
    }
    if (key.key == 1026 || key.key == 3073) crs.name = key.text;
    crs.geo_keys.push_back(std::move(key));
  }
  return crs;
}

/// Converts places to places or NaN.
void use(const CoordinateSystem& system) {
  std::vector<Point2> places{{0, 0},      {10, 50},   {500000, 5e6}, {-180, 90},
                             {1e7, -1e7}, {1e300, 1}, {360, -90.001}};
  std::vector<Point2> back = places;
  system.to_own_geographic(places);
  system.from_own_geographic(places);
  try {
    if (system.reaches_wgs84()) system.to_geographic(back);
  } catch (const stream::Error&) {
    // PROJ cannot compute every valid shift.
  }
  require(!system.title().empty(), "a title");
  // A store keeps its CRS as WKT.
  const stream::Crs kept = system.crs();
  const auto again = CoordinateSystem::of(kept, "kept.wkt");
  require(again.has_value(), "the CRS of a store is read back");
  require(again->is_geographic() == system.is_geographic(), "of the same kind");
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  std::string_view text = text_of(data, size);
  const std::string_view how = take_line(text);
  std::optional<CoordinateSystem> system;
  try {
    if (how == "text") {
      // Must not be the name of a file on this machine.
      if (text.find_first_of("[(:") == std::string_view::npos) return false;
      if (text.find('/') < text.find_first_of("[(:")) return false;
      system = CoordinateSystem::parse(std::string(text));
    } else if (how == "wkt") {
      stream::Crs crs;
      crs.wkt = text;
      system = CoordinateSystem::of(crs, "fuzz.wkt");
    } else if (how == "keys") {
      system = CoordinateSystem::of(crs_of_keys(text), "fuzz.tif");
    } else if (how == "shift") {
      const DatumShift shift = parse_datum_shift(std::string(text)).value_or(DatumShift{});
      for (const double value : shift) require(std::isfinite(value), "finite numbers of a shift");
      system = CoordinateSystem::parse("EPSG:4277", shift);
    }
  } catch (const UsageError&) {
    return false;
  } catch (const stream::Error&) {
    return false;
  }
  if (!system) return false;
  use(*system);
  return true;
}

}  // namespace terrace::terrain::fuzz
