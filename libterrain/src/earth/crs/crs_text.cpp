// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>

#include "earth/crs/crs_geo_keys.hpp"
#include "earth/crs/crs_reading.hpp"
#include "earth/crs/projection_names.hpp"
#include "earth/ground.hpp"

namespace terrace::terrain {
namespace {

/// Codes that are not EPSG's but widespread.
int alias_of(int code) {
  constexpr std::array<int, 3> kWebMercator{900913, 102100, 102113};
  return std::find(kWebMercator.begin(), kWebMercator.end(), code) != kWebMercator.end() ? 3857
                                                                                         : code;
}

/// The number behind "EPSG:", of which `rest` is what follows; 0 if there is none.
int leading_code(std::string_view& rest) {
  int value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc{} || value <= 0) return 0;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value;
}

/// "EPSG:n" or "EPSG:n+m"; nothing if the text is not that.
std::optional<CrsDefinition> definition_of_codes(std::string_view text) {
  if (text.size() < 5 || plain_name(text.substr(0, 4)) != "epsg" || text[4] != ':') {
    return std::nullopt;
  }
  std::string_view rest = text.substr(5);
  const int horizontal = leading_code(rest);
  int vertical = 0;
  if (horizontal != 0 && rest.starts_with('+')) {
    rest.remove_prefix(1);
    vertical = leading_code(rest);
    if (vertical == 0) return std::nullopt;
  }
  if (horizontal == 0 || !rest.empty()) return std::nullopt;
  CrsDefinition definition = definition_of_epsg(horizontal);
  if (vertical != 0) set_vertical_epsg(definition, vertical);
  return definition;
}

/// "ESRI:54030", "OGC:CRS84", "urn:ogc:def:crs:EPSG::4326"; nothing if it is not such a text.
ProjObject crs_of_authority(const std::string& text) {
  if (text.starts_with("urn:ogc:def:crs:")) {
    return ProjObject(proj_create(proj_context(), text.c_str()));
  }
  const std::size_t colon = text.find(':');
  if (colon == text.npos || colon == 0) return nullptr;
  return proj_crs_of_code(text.substr(0, colon), text.substr(colon + 1));
}

/// The system of exactly that name (case aside). Throws: CrsError if several have it.
ProjObject crs_of_name(const std::string& text) {
  PJ_CONTEXT* const context = proj_context();
  const std::array<PJ_TYPE, 4> types{PJ_TYPE_GEOGRAPHIC_2D_CRS, PJ_TYPE_GEOGRAPHIC_3D_CRS,
                                     PJ_TYPE_PROJECTED_CRS, PJ_TYPE_COMPOUND_CRS};
  constexpr std::size_t kMost = 50;
  const ProjOwned<PJ_OBJ_LIST> list(proj_create_from_name(
      context, nullptr, text.c_str(), types.data(), types.size(), 0, kMost, nullptr));
  ProjObject only;
  std::string codes;
  const int count = list != nullptr ? proj_list_get_count(list.get()) : 0;
  for (int i = 0; i < count; ++i) {
    ProjObject found(proj_list_get(context, list.get(), i));
    if (plain_name(text_of(proj_get_name(found.get()))) != plain_name(text) ||
        proj_is_deprecated(found.get()) != 0) {
      continue;
    }
    const bool flat = proj_get_type(found.get()) != PJ_TYPE_GEOGRAPHIC_3D_CRS;
    const bool epsg = text_of(proj_get_id_auth_name(found.get(), 0)) == "EPSG";
    // A system of two axes goes before the one with heights, EPSG's before others.
    if (!flat || !epsg) {
      if (only == nullptr) only = std::move(found);
      continue;
    }
    codes += (codes.empty() ? "" : ", ") + ("EPSG:" + text_of(proj_get_id_code(found.get(), 0)));
    only = std::move(found);
  }
  if (codes.find(',') != codes.npos) {
    throw CrsError("several systems have that name: " + codes, "name one by its code");
  }
  return only;
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

/// ArcInfo's form of a .prj file, older than WKT: lines of a key and a value. GTOPO30 and many
/// ASCII grids have one.
constexpr std::string_view kArcInfoKey = "projection";

bool is_arcinfo(std::string_view text) {
  return plain_name(text.substr(0, kArcInfoKey.size())) == kArcInfoKey;
}

/// Throws: CrsError for all but longitudes and latitudes in degrees, and UTM in metres.
CrsDefinition definition_of_arcinfo(const std::string& text) {
  std::map<std::string, std::string> values;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key, value;
    words >> key >> value;
    values.emplace(plain_name(key), value);
  }
  struct Datum {
    const char* name;
    int geographic, north, south;  ///< codes; those of UTM are of zone 0
  };
  constexpr std::array<Datum, 4> kDatums{{{"wgs84", 4326, 32600, 32700},
                                          {"wgs72", 4322, 32200, 32300},
                                          {"nad83", 4269, 26900, 0},
                                          {"nad27", 4267, 26700, 0}}};
  const auto word = [&](const char* key) { return plain_name(values[key]); };
  // What is no number is refused like a number that is not known.
  const auto number = [&](const char* key) {
    const std::string& value = values[key];
    double parsed = 0;
    const char* const end = value.data() + value.size();
    return value.empty() || std::from_chars(value.data(), end, parsed).ptr == end ? parsed : NAN;
  };
  const auto datum = std::find_if(kDatums.begin(), kDatums.end(),
                                  [&](const Datum& one) { return word("datum") == one.name; });
  const std::string heights = word("zunits");
  if (datum != kDatums.end() && (heights.empty() || heights == "no" || heights == "meters") &&
      number("xshift") == 0) {
    const bool utm = word("projection") == "utm" && word("units") == "meters";
    constexpr double kSouth = -10000000;  // metres
    const double shift = number("yshift"), zone = number("zone");
    const int first = shift == 0 ? datum->north : shift == kSouth ? datum->south : 0;
    if (word("projection") == "geographic" && word("units") == "dd" && shift == 0) {
      return definition_of_epsg(datum->geographic);
    }
    if (utm && first != 0 && zone >= 1 && zone <= 60) {
      return definition_of_epsg(first + static_cast<int>(zone));
    }
  }
  throw CrsError("of ArcInfo's old form, only GEOGRAPHIC in DD and UTM in METERS are read",
                 "name the system by its code: `crs` EPSG:n");
}

}  // namespace

void set_vertical_epsg(CrsDefinition& definition, int code) {
  // GeoTIFF 1.0 numbered the heights of Newlyn, NGVD 29, NAVD 88, the Yellow Sea, the Baltic and
  // the Caspian by their datums: laser scans name them so to this day.
  constexpr std::array<int, 6> kOfDatums{5701, 5702, 5703, 5736, 5705, 5706};
  constexpr int kFirstDatum = 5101;
  if (code >= kFirstDatum && code < kFirstDatum + static_cast<int>(kOfDatums.size())) {
    code = kOfDatums[static_cast<std::size_t>(code - kFirstDatum)];
  }
  const ProjObject vertical = proj_crs_of_code("EPSG", std::to_string(code));
  const PJ_TYPE type = vertical == nullptr ? PJ_TYPE_UNKNOWN : proj_get_type(vertical.get());
  // GeoTIFF 1.0 numbered heights above ellipsoids so; 5030 is WGS 84's. GeoTIFF 1.1 names the
  // geographic system whose third axis they are: 4979.
  constexpr int kFirstEllipsoid = 5001, kLastEllipsoid = 5033;
  if ((code >= kFirstEllipsoid && code <= kLastEllipsoid) || type == PJ_TYPE_GEOGRAPHIC_3D_CRS) {
    forget_heights(definition);
    definition.heights = Heights::ellipsoidal;
    definition.vertical_epsg = code;
    definition.vertical_name = "height above the ellipsoid";
    definition.metres_per_height = 1;
    return;
  }
  if (type != PJ_TYPE_VERTICAL_CRS) {
    throw CrsError("the vertical CRS EPSG:" + std::to_string(code) + " is not known",
                   "name one that is, or say what heights refer to with `vertical`");
  }
  forget_heights(definition);
  read_vertical_crs(vertical.get(), definition);
}

void forget_heights(CrsDefinition& definition) {
  if (definition.heights == Heights::ellipsoidal && definition.geographic &&
      !definition.height_wkt.empty() && definition.base_epsg != 0) {
    definition.code = std::to_string(definition.base_epsg);
  }
  definition.heights = Heights::unknown;
  definition.height_wkt.clear();
  definition.vertical_name.clear();
  definition.vertical_epsg = 0;
  definition.metres_per_height = 0;
}

CrsDefinition definition_of_epsg(int code) {
  const ProjObject crs = proj_crs_of_code("EPSG", std::to_string(alias_of(code)));
  if (crs == nullptr) {
    throw CrsError("the CRS EPSG:" + std::to_string(code) + " is not known",
                   "give another code, or the system's definition as a WKT or PRJ file");
  }
  return read_crs(crs.get());
}

CrsDefinition definition_of_wkt(const std::string& text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  const std::string plain = text.starts_with(kByteOrderMark) ? text.substr(3) : text;
  if (is_arcinfo(plain)) return definition_of_arcinfo(plain);
  proj_complaint();
  const ProjObject crs = proj_crs_of_text(
      plain.starts_with('+') && plain.find("+type=crs") == plain.npos ? plain + " +type=crs"
                                                                      : plain);
  if (crs == nullptr) {
    const std::string why = proj_complaint();
    throw CrsError("the definition cannot be read" + (why.empty() ? "" : ": " + why),
                   "correct the text, or name the system by its code: `crs` EPSG:n");
  }
  CrsDefinition definition = read_crs(crs.get());
  settle_code(definition);
  return definition;
}

CrsDefinition definition_of_text(const std::string& text) {
  if (std::optional<CrsDefinition> definition = definition_of_codes(text)) return *definition;
  if (text.find_first_of("[{") != text.npos || text.starts_with('+')) {
    return definition_of_wkt(text);
  }
  if (std::ifstream(text)) return definition_of_wkt(file_text(text));
  if (!text.empty() && plain_name(text.substr(0, 5)) != "epsg") {
    ProjObject crs = crs_of_authority(text);
    if (crs == nullptr) crs = crs_of_name(text);
    if (crs != nullptr) return read_crs(crs.get());
  }
  throw CrsError(
      "is not a CRS",
      "write EPSG:n, like EPSG:32632, a code of another authority, the system's name, or "
      "name a file with WKT or PROJJSON (.prj)");
}

std::optional<stream::Crs> local_crs_named(const std::string& text) {
  try {
    definition_of_text(text);
  } catch (const LocalCrs& local) {
    return local.crs();
  } catch (const CrsError&) {
    // Said by whoever uses the text.
  }
  return std::nullopt;
}

std::optional<CrsDefinition> definition_of(const stream::Crs& crs) {
  CrsDefinition definition;
  constexpr std::string_view kEsri = "ESRI PE String = ";
  const std::string wkt = !crs.wkt.empty()              ? crs.wkt
                          : crs.name.starts_with(kEsri) ? crs.name.substr(kEsri.size())
                                                        : std::string();
  // Units alone are those of a local system, which has no place on the earth.
  constexpr std::array<int, 3> kUnits{2052, 2054, 3076};
  const bool has_keys =
      std::any_of(crs.geo_keys.begin(), crs.geo_keys.end(), [&](const stream::GeoKey& key) {
        return key.key >= 2048 && key.key < 4096 && !key.values.empty() &&
               std::find(kUnits.begin(), kUnits.end(), key.key) == kUnits.end();
      });
  if (!wkt.empty()) {
    try {
      definition = definition_of_wkt(wkt);
    } catch (const LocalCrs&) {
      return std::nullopt;
    }
    if (crs.epsg != 0 && definition.epsg() != 0 && alias_of(crs.epsg) != definition.epsg()) {
      throw ContradictoryCrs("its CRS is EPSG:" + std::to_string(crs.epsg) + " by code and EPSG:" +
                                 std::to_string(definition.epsg()) + " by WKT",
                             "say which is meant with `crs` EPSG:n");
    }
  } else if (crs.epsg != 0) {
    definition = definition_of_epsg(crs.epsg);
    if (!crs.geo_keys.empty()) check_geo_keys(crs, definition);
  } else if (has_keys) {
    definition = definition_of_geo_keys(crs);
  } else {
    return std::nullopt;
  }
  if (crs.vertical_epsg != 0 && crs.vertical_epsg != definition.vertical_epsg) {
    set_vertical_epsg(definition, crs.vertical_epsg);
  }
  const auto unit = metres_in_unit(crs.horizontal_unit);
  if (!definition.geographic && unit && std::abs(*unit / definition.metres_per_unit - 1) > 1e-8) {
    throw ContradictoryCrs(
        "its CRS " + definition.title() + " contradicts its unit, " + crs.horizontal_unit,
        "say what is meant with `crs` EPSG:n");
  }
  if (const auto height = metres_in_unit(crs.vertical_unit)) {
    definition.metres_per_height = *height;
  }
  return definition;
}

}  // namespace terrace::terrain
