// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <charconv>
#include <string>
#include <system_error>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/crs_names.hpp"

namespace terrace::terrain {
namespace {

constexpr double kDegreeInRadians = 0.0174532925199432958;

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + '"';
}

/// In full, never with an exponent, which not every reader takes.
std::string plain(double value) {
  std::array<char, 400> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
  return error == std::errc{} ? std::string(text.data(), end) : std::string("0");
}

std::string ellipsoid_name(const Ellipsoid& ellipsoid) {
  if (ellipsoid == Ellipsoid{}) return "WGS 84";
  return ellipsoid == Ellipsoid{6378137, 298.257222101} ? "GRS 1980" : "unnamed";
}

std::string id(int code) { return code == 0 ? "" : ",ID[\"EPSG\"," + std::to_string(code) + "]"; }

std::string length_unit(double metres) {
  const std::string name = metres == 1                           ? "metre"
                           : metres == 0.3048                    ? "foot"
                           : metres > 0.3048 && metres < 0.30481 ? "US survey foot"
                                                                 : "unknown";
  return "LENGTHUNIT[" + quoted(name) + "," + plain(metres) + "]";
}

std::string angle_unit(double degrees) {
  const std::string name = degrees == 1 ? "degree" : degrees == 0.9 ? "grad" : "unknown";
  return "ANGLEUNIT[" + quoted(name) + "," + plain(degrees * kDegreeInRadians) + "]";
}

std::string datum_of(const CrsDefinition& d) {
  std::string text = "DATUM[" + quoted(d.datum) + ",ELLIPSOID[" +
                     quoted(ellipsoid_name(d.ellipsoid)) + "," + plain(d.ellipsoid.semi_major) +
                     "," + plain(d.ellipsoid.inverse_flattening) + "," + length_unit(1) + "]]";
  if (d.prime_meridian != 0) {
    text += ",PRIMEM[\"unknown\"," + plain(d.prime_meridian) + "," + angle_unit(1) + "]";
  }
  return text;
}

std::string geographic(const CrsDefinition& d) {
  const std::string unit = angle_unit(d.degrees_per_unit);
  const bool height = d.heights == Heights::ellipsoidal && d.vertical_epsg == 0;
  std::string text = "GEOGCRS[" + quoted(d.name) + "," + datum_of(d) + ",CS[ellipsoidal," +
                     (height ? "3" : "2") + "],AXIS[\"latitude\",north,ORDER[1]," + unit +
                     "],AXIS[\"longitude\",east,ORDER[2]," + unit + "]";
  if (height) text += ",AXIS[\"ellipsoidal height\",up,ORDER[3]," + length_unit(1) + "]";
  return text + id(d.epsg) + "]";
}

std::string projected(const CrsDefinition& d) {
  const MethodName& method = method_name(*d.method);
  std::string text = "PROJCRS[" + quoted(d.name) + ",BASEGEOGCRS[" + quoted(d.base_name) + "," +
                     datum_of(d) + id(d.base_epsg) + "],CONVERSION[" +
                     quoted(d.conversion.empty() ? "unnamed" : d.conversion) + ",METHOD[" +
                     quoted(method.name) + id(method.code) + "]";
  for (const ParameterName& p : method.parameters) {
    const std::string unit = p.kind == ParameterName::Kind::angle    ? angle_unit(1)
                             : p.kind == ParameterName::Kind::length ? length_unit(1)
                                                                     : "SCALEUNIT[\"unity\",1]";
    text += ",PARAMETER[" + quoted(p.name) + "," + plain(d.parameters.*p.member) + "," + unit +
            id(p.code) + "]";
  }
  const std::string unit = length_unit(d.metres_per_unit);
  return text + "],CS[Cartesian,2],AXIS[\"(E)\",east,ORDER[1]," + unit +
         "],AXIS[\"(N)\",north,ORDER[2]," + unit + "]" + id(d.epsg) + "]";
}

/// With a shift: a bound system, the shift as a position vector transformation.
std::string bound(const CrsDefinition& d, const std::string& text) {
  static constexpr const char* kNames[] = {
      "X-axis translation", "Y-axis translation", "Z-axis translation", "X-axis rotation",
      "Y-axis rotation",    "Z-axis rotation",    "Scale difference"};
  std::string result =
      "BOUNDCRS[SOURCECRS[" + text +
      "],TARGETCRS[GEOGCRS[\"WGS 84\",DATUM[\"World Geodetic System 1984\",ELLIPSOID[\"WGS 84\","
      "6378137,298.257223563,LENGTHUNIT[\"metre\",1]]],CS[ellipsoidal,2],AXIS[\"latitude\",north,"
      "ORDER[1]],AXIS[\"longitude\",east,ORDER[2]],ANGLEUNIT[\"degree\",0.0174532925199433],"
      "ID[\"EPSG\",4326]]],ABRIDGEDTRANSFORMATION[\"to WGS 84\",METHOD[\"Position Vector "
      "transformation (geog2D domain)\",ID[\"EPSG\",9606]]";
  for (std::size_t i = 0; i < 7; ++i) {
    // As a scale the difference is 1 + it; an abridged transformation has no units of its own.
    const double value = (*d.shift)[i];
    result += std::string(",PARAMETER[\"") + kNames[i] + "\"," +
              plain(i == 6 ? 1 + value * 1e-6 : value) + id(8605 + static_cast<int>(i)) + "]";
  }
  return result + "]]";
}

}  // namespace

std::string wkt_of(const CrsDefinition& definition) {
  std::string text = definition.method ? projected(definition) : geographic(definition);
  if (definition.shift) text = bound(definition, text);
  if (definition.heights != Heights::orthometric || definition.vertical_name.empty()) return text;
  const std::string& name = definition.vertical_name;
  const double unit = definition.metres_per_height;
  return "COMPOUNDCRS[" + quoted(definition.name + " + " + name) + "," + text + ",VERTCRS[" +
         quoted(name) + ",VDATUM[" + quoted(name) +
         "],CS[vertical,1],AXIS[\"gravity-related height (H)\",up," +
         length_unit(unit == 0 ? 1 : unit) + "]" + id(definition.vertical_epsg) + "]]";
}

}  // namespace terrace::terrain
