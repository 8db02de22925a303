// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/definition.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include <fmt/core.h>

#include "earth/crs/proj_reader.hpp"
#include "earth/crs/projection_engine.hpp"

namespace terrace::terrain {
namespace {

std::string wkt_name(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

/// Writes all digits and no exponent, because some readers do not support exponents.
std::string wkt_number(double value) {
  std::array<char, 400> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return error == std::errc{} ? std::string(text.data(), end) : std::string("0");
}

/// Returns a bound CRS with the shift as a position vector transformation.
std::string bound(const std::string& text, const DatumShift& shift) {
  static constexpr std::array<const char*, 7> kNames{
      "X-axis translation", "Y-axis translation", "Z-axis translation", "X-axis rotation",
      "Y-axis rotation",    "Z-axis rotation",    "Scale difference"};
  const ProjObject wgs84 = proj_crs_of_code("EPSG", "4326");
  std::string result = "BOUNDCRS[SOURCECRS[" + text + "],TARGETCRS[" + wkt_of(wgs84.get()) +
                       "],ABRIDGEDTRANSFORMATION[\"to WGS 84\",METHOD[\"Position Vector "
                       "transformation (geog2D domain)\",ID[\"EPSG\",9606]]";
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    // WKT writes the scale as 1 + the difference, because an abridged transformation has no units.
    const double value = i == 6 ? 1 + shift[i] * 1e-6 : shift[i];
    result +=
        fmt::format(R"(,PARAMETER["{}",{},ID["EPSG",{}]])", kNames[i], wkt_number(value), 8605 + i);
  }
  return result + "]]";
}

/// Whether the WKT defines a vertical system.
bool is_vertical(const std::string& wkt) { return wkt.starts_with("VERT"); }

std::string compound(const std::string& name, const std::string& wkt,
                     const std::string& vertical_name, const std::string& vertical_wkt) {
  return "COMPOUNDCRS[" + wkt_name(name + " + " + vertical_name) + "," + wkt + "," + vertical_wkt +
         "]";
}

std::string length_name(double metres) {
  const std::string name = unit_name(metres);
  return name.empty() ? "unknown" : name;
}

/// Returns the WKT of a vertical system with only a name and a unit.
std::string vertical_wkt(const std::string& name, double metres) {
  return "VERTCRS[" + wkt_name(name) +
         ",VDATUM[\"unknown\"],CS[vertical,1],AXIS[\"height (H)\",up]," + "LENGTHUNIT[" +
         wkt_name(length_name(metres)) + "," + wkt_number(metres) + "]]";
}

bool near(const Ellipsoid& a, const Ellipsoid& b) {
  return std::abs(a.semi_major / b.semi_major - 1) < 1e-9 &&
         std::abs(a.flattening() - b.flattening()) < 1e-9;
}

/// Whether both projections have equal parameters or, failing that, equal PROJ strings.
bool same_projection(const CrsDefinition& a, const CrsDefinition& b) {
  if (a.method && a.method == b.method) return nearly_equal(a.parameters, b.parameters);
  return proj_pipeline_of(a) == proj_pipeline_of(b);
}

}  // namespace

std::string name_of(Heights heights) {
  switch (heights) {
    case Heights::ellipsoidal:
      return "ellipsoidal";
    case Heights::orthometric:
      return "orthometric";
    case Heights::unknown:
      break;
  }
  return {};
}

int CrsDefinition::epsg() const { return authority == "EPSG" ? std::atoi(code.c_str()) : 0; }

std::string CrsDefinition::title() const {
  if (code.empty()) return name.empty() ? "without a name" : '"' + name + '"';
  return authority + ":" + code + (name.empty() ? "" : " (" + name + ")");
}

CrsDefinition on_earth(AnyCrs system) {
  if (auto* const definition = std::get_if<CrsDefinition>(&system)) return std::move(*definition);
  const LocalCrs& local = std::get<LocalCrs>(system);
  const std::string name = fmt::format("the CRS \"{}\"", local.crs.name);
  if (local.is_geocentric) {
    throw CrsError(
        fmt::format("{} is geocentric, with x, y and z from the centre of the earth", name),
        stream::message("convert the points with cs2cs, or pass the right CRS: {crs} EPSG:n"));
  }
  throw CrsError(fmt::format("{} is a local one, without a place on the earth", name),
                 "name a CRS on the earth: EPSG:n");
}

std::string wkt_of(const CrsDefinition& definition) {
  const bool vertical = is_vertical(definition.height_wkt);
  std::string text =
      vertical || definition.height_wkt.empty() ? definition.wkt : definition.height_wkt;
  if (definition.shift) text = bound(text, *definition.shift);
  if (!vertical) return text;
  return compound(definition.name, text, definition.vertical_name, definition.height_wkt);
}

void write_height_unit(CrsDefinition& definition, double metres) {
  const bool same = std::abs(definition.metres_per_height / metres - 1) < 1e-9;
  if (same && !definition.height_wkt.empty()) return;
  definition.metres_per_height = metres;
  if (is_vertical(definition.height_wkt)) {
    const ProjObject system = proj_crs_of_text(definition.height_wkt);
    const ProjObject changed(proj_crs_alter_cs_linear_unit(
        proj_context(), system.get(), length_name(metres).c_str(), metres, nullptr, nullptr));
    check_proj_database();
    definition.height_wkt = changed != nullptr ? wkt_of(changed.get()) : std::string();
    return;
  }
  const bool ellipsoidal = definition.heights == Heights::ellipsoidal;
  definition.vertical_name = ellipsoidal ? "Ellipsoidal height" : kUnknownHeights;
  definition.height_wkt = vertical_wkt(definition.vertical_name, metres);
}

std::string with_height_unit(const stream::Crs& local, double metres) {
  return compound(local.name, local.wkt, kUnknownHeights, vertical_wkt(kUnknownHeights, metres));
}

bool mean_the_same(const std::string& wkt, const std::string& other) {
  try {
    const CrsDefinition a = definition_of_contents(wkt), b = definition_of_contents(other);
    return a.epsg() == b.epsg() && a.heights == b.heights &&
           std::abs(a.metres_per_height - b.metres_per_height) <= 1e-9 * a.metres_per_height &&
           same_places(a, b);
  } catch (const CrsError&) {
    return false;
  }
}

std::string wkt1_of(const CrsDefinition& definition) {
  const std::string wkt = wkt_of(definition);
  const ProjObject crs = proj_crs_of_text(wkt);
  if (crs == nullptr) return {};
  // GDAL omits axes, which matter unless they point east and north (as in Krovak's projection).
  for (const char* const axes : {"OUTPUT_AXIS=AUTO", "OUTPUT_AXIS=YES"}) {
    const std::array<const char*, 3> options{"MULTILINE=NO", axes, nullptr};
    const std::string text =
        text_of(proj_as_wkt(proj_context(), crs.get(), PJ_WKT1_GDAL, options.data()));
    check_proj_database();
    if (!text.empty() && mean_the_same(text, wkt)) return text;
  }
  return {};
}

bool same_datum(const CrsDefinition& a, const CrsDefinition& b) {
  if (a.shift != b.shift || !near(a.ellipsoid, b.ellipsoid)) return false;
  if (a.base_epsg != 0 && a.base_epsg == b.base_epsg) return true;
  if (a.prime_meridian != b.prime_meridian) return false;
  const ProjObject one = proj_crs_of_text(a.base_wkt), other = proj_crs_of_text(b.base_wkt);
  return one != nullptr && other != nullptr &&
         proj_is_equivalent_to_with_ctx(proj_context(), one.get(), other.get(),
                                        PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) != 0;
}

bool same_places(const CrsDefinition& a, const CrsDefinition& b) {
  const auto same_unit = [](double x, double y) { return std::abs(x / y - 1) < 1e-9; };
  if (a.geographic != b.geographic || a.prime_meridian != b.prime_meridian) return false;
  if (!same_unit(a.degrees_per_unit, b.degrees_per_unit) && a.geographic) return false;
  if (!a.geographic && !same_unit(a.metres_per_unit, b.metres_per_unit)) return false;
  if (!same_datum(a, b)) return false;
  return a.geographic || a.wkt == b.wkt || same_projection(a, b);
}

}  // namespace terrace::terrain
