// SPDX-License-Identifier: Apache-2.0
#include "store/manifest.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "io/text.hpp"
#include "store/codec/bytes.hpp"
#include "store/codec/layout.hpp"
#include "store/json.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

std::uint32_t from_hexadecimal(const std::string& text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.size() != 8 || error != std::errc() || end != text.data() + 8) {
    throw Damage("a checksum is not eight hexadecimal digits");
  }
  return value;
}

/// JSON has no infinities and NaN, so they are words.
double number(const JsonValue& json) {
  if (json.kind() != JsonValue::Kind::string) return json.number();
  const std::string& word = json.string();
  if (word == "inf") return std::numeric_limits<double>::infinity();
  if (word == "-inf") return -std::numeric_limits<double>::infinity();
  if (word == "nan") return std::numeric_limits<double>::quiet_NaN();
  throw Damage("\"" + word + "\" is not a number");
}

int code_of(const JsonValue& json) {
  const std::uint64_t value = json.count();
  if (value > INT32_MAX) throw Damage("an EPSG code is out of range");
  return static_cast<int>(value);
}

const std::vector<JsonValue>& items(const JsonValue& json, std::size_t count,
                                    const char* otherwise) {
  if (json.items().size() != count) throw Damage(otherwise);
  return json.items();
}

Channel channel_of(const JsonValue& json) {
  Channel channel;
  channel.name = json.at("name").string();
  const auto type = scalar_type_of(json.at("type").string());
  if (!type) throw Damage("a channel has an unknown type");
  channel.type = *type;
  channel.scale = number(json.at("scale"));
  channel.offset = number(json.at("offset"));
  channel.unit = json.at("unit").string();
  return channel;
}

Point3 point_of(const JsonValue& json) {
  const std::vector<JsonValue>& xyz = items(json, 3, "a point does not have three coordinates");
  return {number(xyz[0]), number(xyz[1]), number(xyz[2])};
}

Box3 box_of(const JsonValue& json) { return {point_of(json.at("min")), point_of(json.at("max"))}; }

FileEntry file_of(const JsonValue& json) {
  FileEntry file{json.at("file").string(), json.at("bytes").count(),
                 from_hexadecimal(json.at("crc32").string())};
  // A name must not lead out of the folder.
  if (file.name.empty() || file.name.find('/') != std::string::npos || file.name[0] == '.') {
    throw Damage("a file name is not allowed");
  }
  return file;
}

Crs crs_of(const JsonValue& json) {
  Crs crs;
  crs.epsg = code_of(json.at("epsg"));
  crs.vertical_epsg = code_of(json.at("vertical_epsg"));
  crs.name = json.at("name").string();
  crs.geographic = json.at("geographic").boolean();
  crs.horizontal_unit = json.at("horizontal_unit").string();
  crs.vertical_unit = json.at("vertical_unit").string();
  crs.wkt = json.at("wkt").string();
  return crs;
}

/// manifest: with its bounds and the levels below.
SegmentEntry segment_of(const JsonValue& json, const Manifest& manifest) {
  SegmentEntry segment;
  segment.clusters = json.at("clusters").count();
  segment.data = file_of(json.at("data"));
  segment.index = file_of(json.at("index"));
  segment.directory_bytes = json.at("directory_bytes").count();
  segment.bounds = json.has("bounds") ? box_of(json.at("bounds")) : manifest.bounds;
  segment.base.assign(manifest.levels.size(), 0);
  if (json.has("base")) {
    const auto& base = items(json.at("base"), manifest.levels.size(),
                             "a segment does not have a base for each level below");
    for (std::size_t l = 0; l < base.size(); ++l) segment.base[l] = base[l].count();
  }
  if (json.has("shift")) {
    const auto& shift = items(json.at("shift"), 3, "a shift does not have three numbers");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double by = shift[axis].number();
      if (!(std::abs(by) <= static_cast<double>(kMaxShift)) || by != std::floor(by)) {
        throw Damage("a segment has an impossible shift");
      }
      segment.shift[axis] = static_cast<std::int64_t>(by);
    }
  }
  return segment;
}

Manifest from_json(const JsonValue& json) {
  Manifest m;
  m.version = static_cast<int>(json.at("version").count());
  const auto kind = json.at("kind").string();
  if (kind != "grid" && kind != "cloud") throw Damage("the kind is unknown");
  m.schema.grid = kind == "grid";
  m.schema.format = json.at("source").string();
  m.points = json.at("points").count();
  m.schema.nodata = json.at("nodata").count();
  m.schema.columns = json.at("columns").count();
  m.schema.rows = json.at("rows").count();
  if (const JsonValue& bounds = json.at("bounds"); bounds.kind() != JsonValue::Kind::null) {
    m.bounds = box_of(bounds);
  }
  m.mean_height = number(json.at("mean_height"));
  const auto& coordinates = items(json.at("coordinates"), 3, "there are not three coordinates");
  for (std::size_t i = 0; i < 3; ++i) m.schema.coordinates[i] = channel_of(coordinates[i]);
  for (const JsonValue& channel : json.at("attributes").items()) {
    m.schema.attributes.push_back(channel_of(channel));
  }
  if (m.schema.attributes.size() > kMaxAttributes) throw Damage("there are too many attributes");
  const auto& world = items(json.at("world"), 6, "the world transform is not six numbers");
  for (std::size_t i = 0; i < 6; ++i) m.schema.world.xy[i] = number(world[i]);
  m.schema.crs = crs_of(json.at("crs"));
  m.schema.vertical = json.at("vertical").string();
  for (const JsonValue& parameter : json.at("parameters").items()) {
    m.schema.parameters.emplace_back(parameter.at("name").string(), parameter.at("value").string());
  }
  for (const JsonValue& level : json.at("levels").items()) {
    if (level.at("level").count() != m.levels.size()) {
      throw Damage("the levels are not numbered from 0 up");
    }
    LevelEntry entry;
    entry.points = level.at("points").count();
    entry.members = level.at("members").count();
    entry.clusters = level.at("clusters").count();
    for (const JsonValue& segment : level.at("segments").items()) {
      entry.segments.push_back(segment_of(segment, m));
    }
    m.levels.push_back(std::move(entry));
  }
  if (json.has("surface")) {
    const JsonValue& surface = json.at("surface");
    m.surface = {.vertices = surface.at("vertices").count(),
                 .triangles = surface.at("triangles").count(),
                 .file = file_of(surface.at("data"))};
  }
  return m;
}

/// Throws Damage unless the counts are consistent with one another and with the sizes of the files.
/// Readers, and callers that size arrays by a manifest, rely on this: sums and products of its
/// counts do not wrap, and no count is out of proportion to the files.
void check_counts(const Manifest& m) {
  if (m.levels.empty() || m.levels.size() > 255) throw Damage("the number of levels is impossible");
  if (m.levels[0].points != m.points) throw Damage("the points of level 0 are not all points");
  if (m.points > kMaxStorePoints || m.schema.nodata > kMaxStorePoints) {
    throw Damage("the store has more points than possible");
  }
  if (m.points == 0 && (m.levels.size() > 1 || m.levels[0].data_bytes() > 0)) {
    throw Damage("a store without points has clusters");
  }
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const LevelEntry& level = m.levels[l];
    const bool top = l + 1 == m.levels.size();
    const std::uint64_t above = top ? 0 : m.levels[l + 1].points;
    if (level.points < above || level.members != level.points - above) {
      throw Damage("the members of level " + std::to_string(l) + " do not add up");
    }
    // Every cluster except the root is headed by a point of the next level.
    if (level.clusters != (top ? 1 : above)) {
      throw Damage("the clusters of level " + std::to_string(l) + " do not add up");
    }
    if (level.points / kMaxPoints > level.clusters) {
      throw Damage("level " + std::to_string(l) + " has more points than its clusters can hold");
    }
  }
}

void check_segments(const Manifest& m) {
  std::size_t segments = 0;
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const LevelEntry& level = m.levels[l];
    const std::string name = "level " + std::to_string(l);
    std::uint64_t clusters = 0;
    for (const SegmentEntry& segment : level.segments) {
      if (segment.clusters == 0 || segment.clusters > level.clusters - clusters) {
        throw Damage("the segments of " + name + " do not have the level's clusters");
      }
      clusters += segment.clusters;
      if (segment.clusters / kMaxPageClusters > segment.index.bytes / kMinPageBytes) {
        throw Damage(name + " has more clusters than its index can hold");
      }
      for (std::size_t below = 0; below < l; ++below) {
        if (segment.base[below] > m.levels[below].clusters) {
          throw Damage("a segment of " + name + " has an impossible base");
        }
      }
    }
    if (clusters != level.clusters) {
      throw Damage("the segments of " + name + " do not have the level's clusters");
    }
    segments += level.segments.size();
  }
  if (segments > kMaxSegments) throw Damage("there are too many segments");
}

void check_surface(const Manifest& m) {
  if (!m.surface) return;
  // A triangle takes at least a 64th of a byte.
  if (m.surface->vertices > m.points || m.surface->triangles / 64 > m.surface->file.bytes) {
    throw Damage("the surface has more vertices or triangles than possible");
  }
}

void check_coordinates(const Manifest& m) {
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
  if (m.bounds.empty() != (m.points == 0)) {
    throw Damage(m.points == 0 ? "a store without points has bounds"
                               : "the bounds are missing or empty");
  }
  for (std::size_t axis = 0; axis < 3 && m.points > 0; ++axis) {
    if (!std::isfinite(m.bounds.min[axis]) || !std::isfinite(m.bounds.max[axis])) {
      throw Damage("the bounds are not finite");
    }
  }
  if (m.points > 0 && !is_finite_in_crs(m.schema, m.bounds)) {
    throw Damage("the bounds are not finite in the CRS");
  }
  for (const LevelEntry& level : m.levels) {
    for (const SegmentEntry& segment : level.segments) {
      const Box3 box = shifted(segment.bounds, segment.shift);
      if (m.points > 0 && !(m.bounds.contains(box.min) && m.bounds.contains(box.max))) {
        throw Damage("a segment exceeds the bounds of the store");
      }
    }
  }
  if (!m.schema.grid) {
    if (m.schema.columns != 0 || m.schema.rows != 0) throw Damage("a cloud has columns or rows");
    return;
  }
  const std::array<std::uint64_t, 2> cells{m.schema.columns, m.schema.rows};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (cells[axis] < 1 || cells[axis] > kMaxColumns) {
      throw Damage("the number of columns or rows is impossible");
    }
    const double low = m.bounds.min[axis], high = m.bounds.max[axis];
    if (m.points > 0 && !(low >= 0 && high < static_cast<double>(cells[axis]) &&
                          low == std::floor(low) && high == std::floor(high))) {
      throw Damage("the bounds are not on the raster's columns and rows");
    }
  }
}

/// Throws Damage for a word unless it is one of the few that the format defines. Programs compare
/// these words and show them unchanged.
void check_words(const Manifest& m) {
  const auto check = [](const std::string& word, std::initializer_list<const char*> known,
                        const char* otherwise) {
    if (std::find(known.begin(), known.end(), word) == known.end()) throw Damage(otherwise);
  };
  check(m.schema.vertical, {"", "ellipsoidal", "orthometric"}, "the kind of heights is unknown");
  for (const auto& [name, value] : m.schema.parameters) {
    if (name != "entities") continue;
    // The names of the enumeration Entities.
    check(value, {"points", "triangles", "segments", "polylines"}, "the entities are unknown");
  }
}

Error damaged(const std::string& file, const std::string& cause) {
  return Error(file, "damaged manifest: " + cause).remedy("restore the file or rebuild the store");
}

}  // namespace

std::uint64_t LevelEntry::data_bytes() const {
  std::uint64_t bytes = 0;
  for (const SegmentEntry& segment : segments) bytes += segment.data.bytes;
  return bytes;
}

std::uint64_t LevelEntry::index_bytes() const {
  std::uint64_t bytes = 0;
  for (const SegmentEntry& segment : segments) bytes += segment.index.bytes;
  return bytes;
}

Box3 shifted(Box3 box, const std::array<std::int64_t, 3>& shift) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] += static_cast<double>(shift[axis]);
    box.max[axis] += static_cast<double>(shift[axis]);
  }
  return box;
}

bool is_finite_in_crs(const Placement& placement, const Box3& stored) {
  const Box3 box = world_box(placement, stored);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(box.min[axis]) || !std::isfinite(box.max[axis])) return false;
  }
  return true;
}

std::string hexadecimal(std::uint32_t value) {
  std::string text(8, '0');
  for (std::size_t i = 8; i-- > 0; value >>= 4) text[i] = "0123456789abcdef"[value & 15];
  return text;
}

std::string read_manifest(const ByteSource& file) {
  if (file.size() > kMaxManifestBytes) {
    throw Error(file.name(), "the manifest has " + counted(file.size(), "byte") +
                                 ", more than the limit of " + std::to_string(kMaxManifestBytes))
        .remedy("restore the file or rebuild the store");
  }
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

Manifest parse_manifest(const std::string& text, const std::string& file) {
  try {
    const JsonValue json = JsonValue::parse(text);
    if (json.at("format").string() != kFormatName) {
      throw damaged(file, "its format is not terrace-store");
    }
    // Checked before anything that may differ in a newer version.
    const auto version = json.at("version").count();
    // Development versions before the first release also wrote higher numbers.
    if (version > kVersion) {
      throw Error(file, "store version " + std::to_string(version) +
                            " was written by a newer terrace, or by a development version before "
                            "the first release; this one reads version " +
                            std::to_string(kVersion))
          .remedy("update, or rebuild the store from its source");
    }
    if (version < 1) throw damaged(file, "the version is impossible");

    const std::size_t tail = kChecksumKey.size() + kZeros.size() + kClosing.size();
    if (text.size() < tail) throw damaged(file, "it is too short");
    const std::size_t at = text.size() - kClosing.size() - kZeros.size();
    std::string zeroed = text;
    zeroed.replace(at, kZeros.size(), kZeros);
    const std::uint32_t checksum = crc32(0, zeroed.data(), zeroed.size());
    if (text.compare(text.size() - tail, kChecksumKey.size(), kChecksumKey) != 0 ||
        text.substr(at, kZeros.size()) != hexadecimal(checksum)) {
      throw damaged(file, "its checksum is wrong");
    }
    Manifest manifest = from_json(json);
    check_segments(manifest);
    check_counts(manifest);
    check_surface(manifest);
    check_coordinates(manifest);
    check_words(manifest);
    manifest.checksum = checksum;
    return manifest;
  } catch (const Damage& error) {
    throw damaged(file, error.what());
  }
}

}  // namespace terrace::stream::store
