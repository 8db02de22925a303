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
#include <utility>
#include <variant>

#include <fmt/core.h>

#include "earth/crs/geo_keys.hpp"
#include "earth/crs/proj_reader.hpp"
#include "earth/crs/projection_names.hpp"
#include "earth/ground.hpp"

namespace terrace::terrain {
namespace {

/// The longest definition that is read, in bytes.
constexpr std::size_t kMaxCrsText = std::size_t{64} << 10;

/// Common codes that are not in the EPSG dataset.
int alias_of(int code) {
  constexpr std::array<int, 3> kWebMercator{900913, 102100, 102113};
  return std::find(kWebMercator.begin(), kWebMercator.end(), code) != kWebMercator.end() ? 3857
                                                                                         : code;
}

/// Throws: CrsError for text that is longer, has more parts or is nested more deeply than any real
/// definition. PROJ looks up many parts in its database, and its time and memory grow with the
/// square of the depth.
void check_extent(std::string_view text) {
  constexpr int kDeepest = 32, kMaxParts = 512;
  const stream::Message remedy = remedy_by_code();
  if (text.size() > kMaxCrsText) {
    throw CrsError("the definition is longer than 64 KiB", remedy);
  }
  const bool json = text.starts_with('{');
  bool quoted = false;
  int depth = 0, parts = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"') {
      quoted = !quoted;
    } else if (quoted) {
      if (json && c == '\\') ++i;
    } else if (c == '[' || c == '(' || c == '{') {
      if (++depth > kDeepest) throw CrsError("the definition is nested too deeply", remedy);
      if (++parts > kMaxParts) throw CrsError("the definition has too many parts", remedy);
    } else if (c == ']' || c == ')' || c == '}') {
      --depth;
    }
  }
}

/// Parses the number at the start of `rest` and removes it; 0 if there is no number.
int leading_code(std::string_view& rest) {
  int value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc{} || value <= 0) return 0;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value;
}

/// Parses "EPSG:n" or "EPSG:n+m"; nullopt for other text.
std::optional<AnyCrs> crs_of_codes(std::string_view text) {
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
  AnyCrs system = crs_of_epsg(horizontal);
  auto* const definition = std::get_if<CrsDefinition>(&system);
  if (definition != nullptr && vertical != 0) set_vertical_epsg(*definition, vertical);
  return system;
}

/// Parses "ESRI:54030", "OGC:CRS84", "urn:ogc:def:crs:EPSG::4326" or
/// "http://www.opengis.net/def/crs/EPSG/0/4326"; null for other text.
ProjObject crs_of_authority(const std::string& text) {
  if (text.starts_with("urn:")) {
    ProjObject object(proj_create(proj_context(), text.c_str()));
    check_proj_database();
    return object;
  }
  constexpr std::string_view kPath = "opengis.net/def/crs/";
  if (const std::size_t at = text.find(kPath); text.starts_with("http") && at != text.npos) {
    const std::string rest = text.substr(at + kPath.size());
    const std::size_t first = rest.find('/'), last = rest.rfind('/');
    if (first == rest.npos || first == last) return nullptr;
    return proj_crs_of_code(rest.substr(0, first), rest.substr(last + 1));
  }
  const std::size_t colon = text.find(':');
  if (colon == text.npos || colon == 0) return nullptr;
  std::string authority = text.substr(0, colon), code = text.substr(colon + 1);
  if (authority == "EPSGA") authority = "EPSG";
  if (authority == "CRS") {  // WMS writes it this way
    authority = "OGC";
    code = "CRS" + code;
  }
  return proj_crs_of_code(authority, code);
}

/// Returns the system of exactly this name, ignoring case. Throws: CrsError if there are several.
ProjObject crs_of_name(const std::string& text) {
  PJ_CONTEXT* const context = proj_context();
  const std::array<PJ_TYPE, 4> types{PJ_TYPE_GEOGRAPHIC_2D_CRS, PJ_TYPE_GEOGRAPHIC_3D_CRS,
                                     PJ_TYPE_PROJECTED_CRS, PJ_TYPE_COMPOUND_CRS};
  constexpr std::size_t kMost = 50;
  const ProjOwned<PJ_OBJ_LIST> list(proj_create_from_name(
      context, nullptr, text.c_str(), types.data(), types.size(), 0, kMost, nullptr));
  check_proj_database();
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
    // A system with two axes takes precedence over a system with heights, and EPSG's systems over
    // others.
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

/// Removes a byte order mark, and white space and zeros at both ends.
std::string without_padding(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF", kPadding(" \t\r\n\0", 5);
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const std::size_t first = text.find_first_not_of(kPadding);
  if (first == text.npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kPadding) - first + 1));
}

/// Whether the text is WKT (with brackets or parentheses), PROJJSON or a PROJ string. No name of a
/// system or file looks like these.
bool is_formal(std::string_view text) {
  if (text.starts_with('+') || text.find_first_of("[{") != text.npos) return true;
  // "NAD83(HARN)" is a name.
  const std::size_t open = text.find('(');
  const std::size_t next = open == text.npos ? open : text.find_first_not_of(" \t\r\n", open + 1);
  return next != text.npos && text[next] == '"';
}

/// Converts a formal definition to the form that PROJ reads.
std::string proj_text(std::string text) {
  constexpr std::string_view kEsri = "ESRI::";
  if (text.starts_with(kEsri)) text.erase(0, kEsri.size());
  if (text.starts_with('+'))
    return text.find("+type=crs") == text.npos ? text + " +type=crs" : text;
  // PROJ reads only brackets, but ISO 19162 also allows parentheses.
  if (text.find_first_of("[({") < text.size() && text[text.find_first_of("[({")] == '(') {
    bool quoted = false;
    for (char& c : text) {
      if (c == '"') quoted = !quoted;
      if (!quoted && c == '(') c = '[';
      if (!quoted && c == ')') c = ']';
    }
  }
  return text;
}

/// ArcInfo's .prj format, older than WKT: lines of a key and a value. GTOPO30 and many ASCII grids
/// use it.
constexpr std::string_view kArcInfoKey = "projection";

bool is_arcinfo(std::string_view text) {
  return plain_name(text.substr(0, kArcInfoKey.size())) == kArcInfoKey;
}

/// Throws: CrsError for anything but longitudes and latitudes in degrees, and UTM in metres.
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
    int geographic, north, south;  ///< EPSG codes; the UTM codes are for zone 0
  };
  constexpr std::array<Datum, 4> kDatums{{{"wgs84", 4326, 32600, 32700},
                                          {"wgs72", 4322, 32200, 32300},
                                          {"nad83", 4269, 26900, 0},
                                          {"nad27", 4267, 26700, 0}}};
  const auto word = [&](const char* key) { return plain_name(values[key]); };
  // Text that is not a number becomes NaN, which is refused like an unknown number.
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
  throw CrsError("of ArcInfo's old format only GEOGRAPHIC in DD and UTM in METERS are supported",
                 remedy_by_code());
}

}  // namespace

void set_vertical_epsg(CrsDefinition& definition, int code) {
  // GeoTIFF 1.0 identified the heights of Newlyn, NGVD 29, NAVD 88, the Yellow Sea, the Baltic and
  // the Caspian by their datums, and laser scans still do.
  constexpr std::array<int, 6> kOfDatums{5701, 5702, 5703, 5736, 5705, 5706};
  constexpr int kFirstDatum = 5101;
  if (code >= kFirstDatum && code < kFirstDatum + static_cast<int>(kOfDatums.size())) {
    code = kOfDatums[static_cast<std::size_t>(code - kFirstDatum)];
  }
  const ProjObject vertical = proj_crs_of_code("EPSG", fmt::format("{}", code));
  const PJ_TYPE type = vertical == nullptr ? PJ_TYPE_UNKNOWN : proj_get_type(vertical.get());
  // GeoTIFF 1.0 used these codes for heights above ellipsoids; 5030 is WGS 84's. GeoTIFF 1.1 uses
  // the geographic system with heights as third axis, such as 4979.
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
    throw CrsError(
        fmt::format("the vertical CRS EPSG:{} is not known", code),
        stream::message("name a known one, or say what heights refer to with {vertical}"));
  }
  forget_heights(definition);
  read_vertical_crs(vertical.get(), definition);
}

void forget_heights(CrsDefinition& definition) {
  if (definition.heights == Heights::ellipsoidal && definition.geographic &&
      !definition.height_wkt.empty() && definition.base_epsg != 0) {
    definition.code = fmt::format("{}", definition.base_epsg);
  }
  definition.heights = Heights::unknown;
  definition.height_wkt.clear();
  definition.vertical_name.clear();
  definition.vertical_epsg = 0;
  definition.metres_per_height = 0;
}

AnyCrs crs_of_epsg(int code) {
  const ProjObject crs = proj_crs_of_code("EPSG", fmt::format("{}", alias_of(code)));
  if (crs == nullptr) {
    throw CrsError(fmt::format("the CRS EPSG:{} is not known", code),
                   "give another code, or the system's definition as a WKT or PRJ file");
  }
  return read_crs(crs.get());
}

std::string contents_of_file(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  std::string text(kMaxCrsText + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return without_padding(text);
}

namespace {

stream::Message remedy_for_text() {
  return stream::message("correct the text, or name the system by its code: {crs} EPSG:n");
}

/// Returns nullopt for a text that is not the definition or name of a CRS. Throws: CrsError.
std::optional<AnyCrs> find_crs(const std::string& text) {
  std::string plain = without_padding(text);
  // Spellings of codes that PROJ does not support.
  constexpr std::string_view kInit = "+init=";
  if (plain.starts_with(kInit) && plain.find(' ') == plain.npos) plain.erase(0, kInit.size());
  if (plain == "WGS72") plain = "EPSG:4322";
  if (plain.empty()) throw CrsError("the definition is empty", remedy_for_text());
  check_extent(plain);
  if (is_arcinfo(plain)) return definition_of_arcinfo(plain);
  proj_complaint();
  if (!is_formal(plain)) {
    if (auto system = crs_of_codes(plain)) return system;
    ProjObject crs = crs_of_authority(plain);
    if (crs == nullptr) crs = crs_of_name(plain);
    if (crs == nullptr) return std::nullopt;
    return read_crs(crs.get());
  }
  const ProjObject crs = proj_crs_of_text(proj_text(plain));
  if (crs == nullptr) return std::nullopt;
  AnyCrs system = read_crs(crs.get());
  if (auto* const definition = std::get_if<CrsDefinition>(&system)) settle_code(*definition);
  return system;
}

}  // namespace

AnyCrs crs_of_contents(const std::string& text) {
  if (auto system = find_crs(text)) return *std::move(system);
  const std::string reason = proj_complaint();
  throw CrsError("the definition cannot be read" + (reason.empty() ? "" : ": " + reason),
                 remedy_for_text());
}

AnyCrs crs_of_text(const std::string& text) {
  if (is_formal(text)) return crs_of_contents(text);
  if (auto system = crs_of_codes(text)) return *std::move(system);
  if (std::ifstream(text)) return crs_of_contents(contents_of_file(text));
  if (!text.empty() && plain_name(text.substr(0, 5)) != "epsg") {
    if (auto system = find_crs(text)) return *std::move(system);
  }
  throw CrsError(
      "is not a CRS",
      "write EPSG:n, like EPSG:32632, a code of another authority, the system's name, or "
      "name a file with WKT or PROJJSON (.prj)");
}

std::optional<AnyCrs> crs_of_record(const stream::Crs& crs) {
  CrsDefinition definition;
  constexpr std::string_view kEsri = "ESRI PE String = ";
  const std::string wkt = !crs.wkt.empty()              ? crs.wkt
                          : crs.name.starts_with(kEsri) ? crs.name.substr(kEsri.size())
                                                        : std::string();
  // Keys of units alone describe a local system, which has no place on the earth.
  constexpr std::array<int, 3> kUnits{2052, 2054, 3076};
  const bool has_keys =
      std::any_of(crs.geo_keys.begin(), crs.geo_keys.end(), [&](const stream::GeoKey& key) {
        return key.key >= 2048 && key.key < 4096 && !key.values.empty() &&
               std::find(kUnits.begin(), kUnits.end(), key.key) == kUnits.end();
      });
  if (!wkt.empty()) {
    AnyCrs system = crs_of_contents(wkt);
    if (std::holds_alternative<LocalCrs>(system)) return system;
    definition = on_earth(std::move(system));
    if (crs.epsg != 0 && definition.epsg() != 0 && alias_of(crs.epsg) != definition.epsg()) {
      throw ContradictoryCrs(
          fmt::format("its CRS is EPSG:{} by code and EPSG:{} by WKT", crs.epsg, definition.epsg()),
          stream::message("say which is meant with {crs} EPSG:n"));
    }
  } else if (crs.epsg != 0) {
    AnyCrs system = crs_of_epsg(crs.epsg);
    if (std::holds_alternative<LocalCrs>(system)) return system;
    definition = on_earth(std::move(system));
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
        fmt::format("its CRS {} contradicts its unit, {}", definition.title(), crs.horizontal_unit),
        stream::message("say what is meant with {crs} EPSG:n"));
  }
  if (const auto height = metres_in_unit(crs.vertical_unit)) {
    definition.metres_per_height = *height;
  }
  return definition;
}

std::optional<CrsDefinition> definition_of(const stream::Crs& crs) {
  std::optional<AnyCrs> system = crs_of_record(crs);
  if (!system || !std::holds_alternative<CrsDefinition>(*system)) return std::nullopt;
  return std::get<CrsDefinition>(*std::move(system));
}

std::optional<LocalCrs> local_crs_of(const stream::Crs& crs) {
  std::optional<AnyCrs> system = crs_of_record(crs);
  if (!system || !std::holds_alternative<LocalCrs>(*system)) return std::nullopt;
  return std::get<LocalCrs>(*std::move(system));
}

}  // namespace terrace::terrain
