// SPDX-License-Identifier: Apache-2.0
#include "store/manifest.hpp"

#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>

#include "store/codec/bytes.hpp"
#include "store/codec/layout.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormatName = "terrace-store";
/// The text ends with this, eight hexadecimal digits, and the closing below. The checksum is the
/// CRC-32 of the whole text with zeros for its digits.
constexpr std::string_view kChecksumKey = "\"checksum\": \"";
constexpr std::string_view kClosing = "\"\n}\n";
constexpr std::string_view kZeros = "00000000";

std::uint32_t from_hexadecimal(const std::string& text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.size() != 8 || error != std::errc() || end != text.data() + 8) {
    throw Damage("a checksum is not eight hexadecimal digits");
  }
  return value;
}

/// JSON has no infinities and no NaN; they are rare enough to be words.
Json number(double value) {
  if (std::isfinite(value)) return value;
  return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

double number(const Json& json) {
  if (!json.is_string()) return json.get<double>();
  const auto word = json.get<std::string>();
  if (word == "inf") return std::numeric_limits<double>::infinity();
  if (word == "-inf") return -std::numeric_limits<double>::infinity();
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  throw Damage("\"" + word + "\" is not a number");
}

/// The library's own conversions would round, wrap or cut what is no such integer.
std::uint64_t count_of(const Json& json) {
  if (!json.is_number_unsigned()) throw Damage("a count is not an integer from 0 up");
  return json.get<std::uint64_t>();
}

int code_of(const Json& json) {
  if (!json.is_number_integer()) throw Damage("an EPSG code is not an integer");
  const auto value = json.get<std::int64_t>();
  if (value < 0 || value > INT32_MAX) throw Damage("an EPSG code is out of range");
  return static_cast<int>(value);
}

Json channel_json(const Channel& channel) {
  return {{"name", channel.name},
          {"type", std::string(name_of(channel.type))},
          {"scale", number(channel.scale)},
          {"offset", number(channel.offset)},
          {"unit", channel.unit}};
}

Channel channel_of(const Json& json) {
  Channel channel;
  channel.name = json.at("name").get<std::string>();
  const auto type = scalar_type_of(json.at("type").get<std::string>());
  if (!type) throw Damage("a channel has an unknown type");
  channel.type = *type;
  channel.scale = number(json.at("scale"));
  channel.offset = number(json.at("offset"));
  channel.unit = json.at("unit").get<std::string>();
  return channel;
}

Json point_json(const Point3& p) { return Json::array({number(p[0]), number(p[1]), number(p[2])}); }

Point3 point_of(const Json& json) {
  if (!json.is_array() || json.size() != 3) throw Damage("a point does not have three coordinates");
  return {number(json[0]), number(json[1]), number(json[2])};
}

Json file_json(const FileEntry& file) {
  return {{"file", file.name}, {"bytes", file.bytes}, {"crc32", hexadecimal(file.checksum)}};
}

FileEntry file_of(const Json& json) {
  FileEntry file{json.at("file").get<std::string>(), count_of(json.at("bytes")),
                 from_hexadecimal(json.at("crc32").get<std::string>())};
  // A name, not a way out of the folder.
  if (file.name.empty() || file.name.find('/') != std::string::npos || file.name[0] == '.') {
    throw Damage("a file name is not allowed");
  }
  return file;
}

Json crs_json(const Crs& crs) {
  return {{"epsg", crs.epsg},
          {"vertical_epsg", crs.vertical_epsg},
          {"name", crs.name},
          {"geographic", crs.geographic},
          {"horizontal_unit", crs.horizontal_unit},
          {"vertical_unit", crs.vertical_unit},
          {"wkt", crs.wkt}};
}

Crs crs_of(const Json& json) {
  Crs crs;
  crs.epsg = code_of(json.at("epsg"));
  crs.vertical_epsg = code_of(json.at("vertical_epsg"));
  crs.name = json.at("name").get<std::string>();
  crs.geographic = json.at("geographic").get<bool>();
  crs.horizontal_unit = json.at("horizontal_unit").get<std::string>();
  crs.vertical_unit = json.at("vertical_unit").get<std::string>();
  crs.wkt = json.at("wkt").get<std::string>();
  return crs;
}

Json to_json(const Manifest& m) {
  Json json;
  json["format"] = kFormatName;
  json["version"] = m.version;
  json["kind"] = m.schema.grid ? "grid" : "cloud";
  json["source"] = m.schema.format;
  json["points"] = m.points;
  json["nodata"] = m.schema.nodata;
  json["columns"] = m.schema.columns;
  json["rows"] = m.schema.rows;
  json["bounds"] = m.bounds.empty()
                       ? Json(nullptr)
                       : Json{{"min", point_json(m.bounds.min)}, {"max", point_json(m.bounds.max)}};
  json["mean_height"] = number(m.mean_height);
  json["coordinates"] = Json::array();
  for (const Channel& channel : m.schema.coordinates) {
    json["coordinates"].push_back(channel_json(channel));
  }
  json["attributes"] = Json::array();
  for (const Channel& channel : m.schema.attributes) {
    json["attributes"].push_back(channel_json(channel));
  }
  json["world"] = Json::array();
  for (const double c : m.schema.world.xy) json["world"].push_back(number(c));
  json["crs"] = crs_json(m.schema.crs);
  json["vertical"] = m.schema.vertical;
  json["parameters"] = Json::array();
  for (const auto& [name, value] : m.schema.parameters) {
    json["parameters"].push_back({{"name", name}, {"value", value}});
  }
  json["levels"] = Json::array();
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const LevelEntry& level = m.levels[l];
    const Json segment = {{"clusters", level.clusters},
                          {"data", file_json(level.data)},
                          {"index", file_json(level.index)},
                          {"directory_bytes", level.directory_bytes}};
    json["levels"].push_back({{"level", l},
                              {"points", level.points},
                              {"members", level.members},
                              {"clusters", level.clusters},
                              {"segments", Json::array({segment})}});
  }
  return json;
}

Manifest from_json(const Json& json) {
  Manifest m;
  m.version = json.at("version").get<int>();
  const auto kind = json.at("kind").get<std::string>();
  if (kind != "grid" && kind != "cloud") throw Damage("the kind is unknown");
  m.schema.grid = kind == "grid";
  m.schema.format = json.at("source").get<std::string>();
  m.points = count_of(json.at("points"));
  m.schema.nodata = count_of(json.at("nodata"));
  m.schema.columns = count_of(json.at("columns"));
  m.schema.rows = count_of(json.at("rows"));
  if (const Json& bounds = json.at("bounds"); !bounds.is_null()) {
    m.bounds = {point_of(bounds.at("min")), point_of(bounds.at("max"))};
  }
  m.mean_height = number(json.at("mean_height"));
  const Json& coordinates = json.at("coordinates");
  if (!coordinates.is_array() || coordinates.size() != 3) {
    throw Damage("there are not three coordinates");
  }
  for (std::size_t i = 0; i < 3; ++i) m.schema.coordinates[i] = channel_of(coordinates[i]);
  for (const Json& channel : json.at("attributes")) {
    m.schema.attributes.push_back(channel_of(channel));
  }
  if (m.schema.attributes.size() > kMostAttributes) throw Damage("there are too many attributes");
  const Json& world = json.at("world");
  if (!world.is_array() || world.size() != 6)
    throw Damage("the world transform is not six numbers");
  for (std::size_t i = 0; i < 6; ++i) m.schema.world.xy[i] = number(world[i]);
  m.schema.crs = crs_of(json.at("crs"));
  m.schema.vertical = json.at("vertical").get<std::string>();
  for (const Json& parameter : json.at("parameters")) {
    m.schema.parameters.emplace_back(parameter.at("name").get<std::string>(),
                                     parameter.at("value").get<std::string>());
  }
  for (const Json& level : json.at("levels")) {
    const Json& segments = level.at("segments");
    if (!segments.is_array() || segments.size() != 1) {
      throw Damage("a level does not have one segment");
    }
    if (count_of(level.at("level")) != m.levels.size()) {
      throw Damage("the levels do not follow one another from 0 up");
    }
    LevelEntry entry;
    entry.points = count_of(level.at("points"));
    entry.members = count_of(level.at("members"));
    entry.clusters = count_of(level.at("clusters"));
    if (count_of(segments[0].at("clusters")) != entry.clusters) {
      throw Damage("a level's segment does not have the level's clusters");
    }
    entry.data = file_of(segments[0].at("data"));
    entry.index = file_of(segments[0].at("index"));
    entry.directory_bytes = count_of(segments[0].at("directory_bytes"));
    m.levels.push_back(std::move(entry));
  }
  return m;
}

/// What must hold whatever the files hold. Readers and all who size arrays by a manifest rely on
/// it: sums and products of its counts do not wrap, and no count is out of proportion to the files.
void check_counts(const Manifest& m) {
  if (m.levels.empty() || m.levels.size() > 255) throw Damage("the number of levels is impossible");
  if (m.levels[0].points != m.points) throw Damage("the points of level 0 are not all points");
  if (m.points > kMostStorePoints || m.schema.nodata > kMostStorePoints) {
    throw Damage("the store is said to have more points than one can have");
  }
  if (m.points == 0 && (m.levels.size() > 1 || m.levels[0].data.bytes > 0)) {
    throw Damage("a store without points has clusters");
  }
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const LevelEntry& level = m.levels[l];
    const bool top = l + 1 == m.levels.size();
    const std::uint64_t above = top ? 0 : m.levels[l + 1].points;
    if (level.points < above || level.members != level.points - above) {
      throw Damage("the members of level " + std::to_string(l) + " do not add up");
    }
    // Every cluster is headed by a point of the next level, but for the root.
    if (level.clusters != (top ? 1 : above)) {
      throw Damage("the clusters of level " + std::to_string(l) + " do not add up");
    }
    if (level.clusters / kMostPageClusters > level.index.bytes / kLeastPageBytes) {
      throw Damage("level " + std::to_string(l) + " has more clusters than its index can hold");
    }
    if (level.points / kMostPoints > level.clusters) {
      throw Damage("level " + std::to_string(l) + " has more points than its clusters can hold");
    }
  }
}

void check_places(const Manifest& m) {
  for (const Channel& channel : m.schema.coordinates) {
    if (!std::isfinite(channel.scale) || channel.scale == 0 || !std::isfinite(channel.offset)) {
      throw Damage("a coordinate has an impossible scale or offset");
    }
  }
  const auto& xy = m.schema.world.xy;
  const double determinant = xy[0] * xy[4] - xy[1] * xy[3];
  if (!std::isfinite(determinant) || determinant == 0 || !std::isfinite(xy[2]) ||
      !std::isfinite(xy[5])) {
    throw Damage("the world transform cannot be inverted");
  }
  if (m.bounds.empty() != (m.points == 0)) throw Damage("the bounds do not suit the points");
  for (std::size_t axis = 0; axis < 3 && m.points > 0; ++axis) {
    if (!std::isfinite(m.bounds.min[axis]) || !std::isfinite(m.bounds.max[axis])) {
      throw Damage("the bounds are not finite");
    }
  }
  if (!m.schema.grid) {
    if (m.schema.columns != 0 || m.schema.rows != 0) throw Damage("a cloud has columns or rows");
    return;
  }
  const std::array<std::uint64_t, 2> cells{m.schema.columns, m.schema.rows};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (cells[axis] < 1 || cells[axis] > kMostColumns) {
      throw Damage("the number of columns or rows is impossible");
    }
    const double low = m.bounds.min[axis], high = m.bounds.max[axis];
    if (m.points > 0 && !(low >= 0 && high < static_cast<double>(cells[axis]) &&
                          low == std::floor(low) && high == std::floor(high))) {
      throw Damage("the bounds do not lie on the raster's columns and rows");
    }
  }
}

[[noreturn]] void damaged(const std::string& file, const std::string& cause) {
  throw Error({.file = file,
               .where = {},
               .cause = "damaged manifest: " + cause,
               .remedy = "restore the file or build the store anew"});
}

}  // namespace

std::string hexadecimal(std::uint32_t value) {
  std::string text(8, '0');
  for (std::size_t i = 8; i-- > 0; value >>= 4) text[i] = "0123456789abcdef"[value & 15];
  return text;
}

std::string to_text(const Manifest& manifest) {
  Json json = to_json(manifest);
  json["checksum"] = kZeros;
  std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  const std::uint32_t checksum = crc32(0, text.data(), text.size());
  const std::size_t at = text.size() - kClosing.size() - kZeros.size();
  text.replace(at, kZeros.size(), hexadecimal(checksum));
  return text;
}

std::string read_manifest(const ByteSource& file) {
  if (file.size() > kMostManifestBytes) {
    throw Error({.file = file.name(), .where = {}, .cause = "the file is too large", .remedy = {}});
  }
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

Manifest parse_manifest(const std::string& text, const std::string& file) {
  Json json;
  try {
    json = Json::parse(text);
    if (!json.is_object() || json.at("format") != kFormatName) {
      damaged(file, "it does not say that this is a store");
    }
    // Before anything that a newer version may do otherwise.
    const auto version = json.at("version").get<std::int64_t>();
    if (version > kVersion) {
      throw Error({.file = file,
                   .where = {},
                   .cause = "store version " + std::to_string(version) +
                            " was written by a newer terrace; this one reads up to version " +
                            std::to_string(kVersion),
                   .remedy = "update"});
    }
    if (version == kDroppedVersion) {
      throw Error({.file = file,
                   .where = {},
                   .cause = "store version " + std::to_string(version) + " was never released",
                   .remedy = "build the store anew"});
    }
    if (version < 1) damaged(file, "the version is impossible");

    const std::size_t tail = kChecksumKey.size() + kZeros.size() + kClosing.size();
    if (text.size() < tail) damaged(file, "it is too short");
    const std::size_t at = text.size() - kClosing.size() - kZeros.size();
    std::string zeroed = text;
    zeroed.replace(at, kZeros.size(), kZeros);
    const std::uint32_t checksum = crc32(0, zeroed.data(), zeroed.size());
    if (text.compare(text.size() - tail, kChecksumKey.size(), kChecksumKey) != 0 ||
        text.substr(at, kZeros.size()) != hexadecimal(checksum)) {
      damaged(file, "its checksum is wrong");
    }
    Manifest manifest = from_json(json);
    check_counts(manifest);
    check_places(manifest);
    manifest.checksum = checksum;
    return manifest;
  } catch (const Json::exception& error) {
    damaged(file, error.what());
  } catch (const Damage& error) {
    damaged(file, error.what());
  }
}

bool is_as_written(const std::string& text, const Manifest& manifest) {
  Json json = to_json(manifest);
  json["checksum"] = hexadecimal(manifest.checksum);
  // Objects of this kind of JSON are equal only if their keys have the same order.
  return Json::parse(text, nullptr, /*allow_exceptions=*/false) == json;
}

bool looks_like_store(const std::filesystem::path& folder) {
  std::error_code error;
  const auto path = folder / kManifestName;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  try {
    const Json json = Json::parse(read_manifest(*open_file(path)), nullptr, false);
    const auto format = json.is_object() ? json.find("format") : json.end();
    return format != json.end() && *format == kFormatName;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace terrace::stream::store
