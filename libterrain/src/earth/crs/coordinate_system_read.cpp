// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>

#include "base/units.hpp"
#include "earth/crs/coordinate_system.hpp"
#include "earth/crs/crs_geo_keys.hpp"
#include "earth/crs/epsg_table.hpp"
#include "earth/crs/wkt.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// "n" or "n+m" behind "EPSG:"; nothing if the text is not that.
std::optional<CrsDefinition> definition_of_codes(std::string_view text) {
  std::string_view rest = text;
  if (rest.size() < 5 || plain_name(rest.substr(0, 4)) != "epsg" || rest[4] != ':') {
    return std::nullopt;
  }
  rest.remove_prefix(5);
  const auto code = [&rest]() -> std::optional<int> {
    int value = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc{} || value <= 0) return std::nullopt;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return value;
  };
  const auto horizontal = code();
  if (!horizontal) return std::nullopt;
  std::optional<int> vertical;
  if (rest.starts_with('+')) {
    rest.remove_prefix(1);
    vertical = code();
    if (!vertical) return std::nullopt;
  }
  if (!rest.empty()) return std::nullopt;
  CrsDefinition definition = definition_of_epsg(*horizontal);
  if (vertical) set_vertical_epsg(definition, *vertical);
  return definition;
}

/// A definition without a code gets the one that means the same, if there is exactly one.
void find_code(CrsDefinition& definition) {
  if (definition.epsg != 0 || !definition.method || definition.base_epsg == 0 || definition.shift) {
    return;
  }
  const EpsgProjected* only = nullptr;
  for (const EpsgProjected& row : epsg_tables().projected) {
    if (row.base != definition.base_epsg || row.metres_per_unit != definition.metres_per_unit) {
      continue;
    }
    const EpsgConversion& conversion = *epsg_conversion(row.conversion);
    if (conversion.method != *definition.method ||
        !nearly_equal(conversion.parameters, definition.parameters)) {
      continue;
    }
    if (only != nullptr) return;
    only = &row;
  }
  if (only != nullptr) definition.epsg = only->code;
}

std::string file_text(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  std::string text;
  constexpr std::size_t kMost = 1 << 20;
  text.resize(kMost);
  file.read(text.data(), kMost);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

}  // namespace

CoordinateSystem CoordinateSystem::parse(const std::string& text,
                                         const std::optional<DatumShift>& shift) {
  try {
    std::optional<CrsDefinition> definition = definition_of_codes(text);
    if (!definition) {
      const bool wkt = text.find('[') != text.npos || text.find('(') != text.npos;
      std::error_code ignored;
      if (!wkt && !std::ifstream(text)) {
        throw UsageError("'" + text +
                         "' is not a CRS; write EPSG:n, like EPSG:32632, or name a file with WKT "
                         "(.prj)");
      }
      definition = definition_of_wkt(wkt ? text : file_text(text));
      find_code(*definition);
    }
    if (shift && definition->uncertainty < 0) definition->shift = shift;
    return CoordinateSystem(*definition);
  } catch (const CrsError& error) {
    throw UsageError("'" + text.substr(0, 80) + "': " + error.what() + "; " + error.remedy());
  }
}

std::optional<CrsDefinition> definition_of(const stream::Crs& crs) {
  CrsDefinition definition;
  constexpr std::string_view kEsri = "ESRI PE String = ";
  const std::string wkt = !crs.wkt.empty()              ? crs.wkt
                          : crs.name.starts_with(kEsri) ? crs.name.substr(kEsri.size())
                                                        : std::string();
  const bool has_keys =
      std::any_of(crs.geo_keys.begin(), crs.geo_keys.end(), [](const stream::GeoKey& key) {
        return key.key >= 2048 && key.key < 4096 && !key.values.empty();
      });
  if (!wkt.empty()) {
    definition = definition_of_wkt(wkt);
    if (crs.epsg != 0 && definition.epsg != 0 &&
        definition_of_epsg(crs.epsg).epsg != definition.epsg) {
      throw ContradictoryCrs("its CRS is EPSG:" + std::to_string(crs.epsg) +
                                 " by code and EPSG:" + std::to_string(definition.epsg) + " by WKT",
                             "say which is meant with --crs EPSG:n");
    }
  } else if (crs.epsg != 0) {
    definition = definition_of_epsg(crs.epsg);
    if (!crs.geo_keys.empty()) check_geo_keys(crs, definition);
  } else if (has_keys) {
    definition = definition_of_geo_keys(crs);
  } else {
    return std::nullopt;
  }
  find_code(definition);
  if (crs.vertical_epsg != 0) set_vertical_epsg(definition, crs.vertical_epsg);
  const auto unit = metres_in_unit(crs.horizontal_unit);
  if (definition.method && unit && std::abs(*unit / definition.metres_per_unit - 1) > 1e-9) {
    throw ContradictoryCrs("its CRS " +
                               (definition.epsg != 0 ? "EPSG:" + std::to_string(definition.epsg)
                                                     : '"' + definition.name + '"') +
                               " contradicts its unit, " + crs.horizontal_unit,
                           "say what is meant with --crs EPSG:n");
  }
  if (const auto height = metres_in_unit(crs.vertical_unit)) {
    definition.metres_per_height = *height;
  }
  return definition;
}

std::optional<CoordinateSystem> CoordinateSystem::of(const stream::Crs& crs,
                                                     const std::string& file) {
  try {
    const std::optional<CrsDefinition> definition = definition_of(crs);
    if (!definition) return std::nullopt;
    return CoordinateSystem(*definition);
  } catch (const CrsError& error) {
    throw stream::Error(
        {.file = file, .where = {}, .cause = error.what(), .remedy = error.remedy()});
  }
}

DatumShift parse_datum_shift(const std::string& text) {
  const std::vector<double> numbers = parse_numbers(text, "--towgs84");
  if (numbers.size() != 3 && numbers.size() != 7) {
    throw UsageError("--towgs84 takes three or seven numbers, dx,dy,dz[,rx,ry,rz,ds], not " +
                     std::to_string(numbers.size()));
  }
  DatumShift shift{};
  std::copy(numbers.begin(), numbers.end(), shift.begin());
  return shift;
}

}  // namespace terrace::terrain
