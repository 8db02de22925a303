// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/detail_lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numeric>
#include <span>
#include <string>
#include <tuple>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "base/file_marks.hpp"
#include "base/geojson_crs.hpp"
#include "base/stored_entities.hpp"
#include "mesh/wanted_entities.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

struct Piece {
  std::uint32_t line = 0, part = 0;
  std::uint32_t begin = 0;  ///< index of the first vertex in reading order
  std::size_t order = 0;    ///< number of the piece in reading order
  std::uint8_t count = 0, dimensions = 0;
};

/// A piece, its place in order, and its vertices and properties twice while they are joined.
constexpr std::size_t bytes_per_piece(std::size_t max_vertices, std::size_t properties) {
  return sizeof(Piece) + sizeof(LineSet::Line) + 2 * max_vertices * sizeof(stream::Point3) +
         2 * properties * sizeof(double);
}

/// The properties of a store's lines.
class LineProperties {
 public:
  explicit LineProperties(const stream::StoreSchema& schema) {
    for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
      const stream::Channel& channel = schema.attributes[i];
      if (stream::is_shape_column(channel.name, entities_of(schema))) continue;
      channels_.push_back(channel);
      offsets_.push_back(schema.attribute_offset(i));
    }
  }

  [[nodiscard]] std::size_t size() const { return channels_.size(); }
  [[nodiscard]] const std::string& name(std::size_t i) const { return channels_[i].name; }
  /// Appends the values in a record.
  void read(std::span<const std::byte> record, std::vector<double>& values) const {
    for (std::size_t i = 0; i < size(); ++i) {
      const stream::Channel& channel = channels_[i];
      values.push_back(stream::to_double(channel.type, record.data() + offsets_[i]) *
                           channel.scale +
                       channel.offset);
    }
  }

 private:
  std::vector<stream::Channel> channels_;
  std::vector<std::size_t> offsets_;
};

/// The offsets of the columns that every line has.
struct LineColumns {
  std::size_t line, part, dimensions;

  explicit LineColumns(const stream::Store& store)
      : line(offset(store, "line", stream::ScalarType::u32)),
        part(offset(store, "part", stream::ScalarType::u32)),
        dimensions(offset(store, "dimensions", stream::ScalarType::u8)) {}

  static std::size_t offset(const stream::Store& store, std::string_view name,
                            stream::ScalarType type) {
    const std::vector<stream::Channel>& attributes = store.schema().attributes;
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      if (attributes[i].name == name && attributes[i].type == type) {
        return store.schema().attribute_offset(i);
      }
    }
    throw stream::Error(store.path().string(), fmt::format("its lines have no column \"{}\"", name))
        .remedy(stream::message("keep all columns: leave {keep} and {drop} out"));
  }
};

void append_number(std::string& text, double value) {
  if (value == 0 && std::signbit(value)) {
    text += "-0.0";  // as an integer it would lose its sign
    return;
  }
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// Returns a name as a string of JSON.
std::string quoted(const std::string& name) {
  using nlohmann::json;
  return json(name).dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

bool holds_lines(const stream::StoreSchema& schema) {
  const stream::Entities entities = entities_of(schema);
  return entities == stream::Entities::segments || entities == stream::Entities::polylines;
}

LineSet detail_lines(const stream::Store& input, const Detail& detail, const Context& context) {
  const stream::Store store = input.with_stop(context.stop);
  if (!holds_lines(store.schema())) throw UsageError(store.path().string() + " contains no lines");
  const LineColumns columns(store);
  const bool segments = entities_of(store.schema()) == stream::Entities::segments;
  const LineProperties properties(store.schema());
  std::vector<Piece> pieces;
  std::vector<stream::Point3> read;
  std::vector<double> values;
  for_each_wanted_entity(
      store, detail, context.memory_or(0),
      bytes_per_piece(segments ? 2 : stream::kPolylineVertices, properties.size()),
      [&](std::span<const std::byte> record, std::span<const stream::Point3> vertices) {
        Piece piece{.begin = static_cast<std::uint32_t>(read.size()),
                    .order = pieces.size(),
                    .count = static_cast<std::uint8_t>(vertices.size()),
                    .dimensions = static_cast<std::uint8_t>(record[columns.dimensions])};
        std::memcpy(&piece.line, record.data() + columns.line, sizeof piece.line);
        std::memcpy(&piece.part, record.data() + columns.part, sizeof piece.part);
        properties.read(record, values);
        pieces.push_back(piece);
        read.insert(read.end(), vertices.begin(), vertices.end());
      });
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    return std::tie(a.line, a.part) < std::tie(b.line, b.part);
  });

  LineSet set;
  for (std::size_t i = 0; i < properties.size(); ++i) {
    set.property_names.push_back(properties.name(i));
  }
  set.vertices.reserve(read.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    const stream::Point3* const first = read.data() + piece.begin;
    const bool follows = i > 0 && piece.line == pieces[i - 1].line &&
                         piece.part == pieces[i - 1].part + 1 && set.vertices.back() == *first;
    set.vertices.insert(set.vertices.end(), first + (follows ? 1 : 0), first + piece.count);
    if (!follows) {
      set.lines.push_back({.begin = set.vertices.size() - piece.count,
                           .end = 0,
                           .number = piece.line,
                           .dimensions = piece.dimensions});
      const auto own =
          values.begin() + static_cast<std::ptrdiff_t>(piece.order * properties.size());
      set.properties.insert(set.properties.end(), own,
                            own + static_cast<std::ptrdiff_t>(properties.size()));
    }
    set.lines.back().end = set.vertices.size();
  }
  return set;
}

void write_geojson(const LineSet& lines, const stream::Crs& crs,
                   const std::function<void(std::string_view)>& write) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 20;
  const bool has_crs = crs != stream::Crs{};
  if (has_crs && crs.epsg == 0) {
    throw UsageError(stream::message(
        "GeoJSON names its CRS by an EPSG code, which the CRS of these lines does not have; pass "
        "{to_crs} EPSG:4326, which needs none"));
  }
  std::string text = std::string(kLinesHead) + geojson_crs_member(crs) + "\"features\":[";
  std::vector<std::string> names;
  for (const std::string& name : lines.property_names) names.push_back(quoted(name));
  for (std::size_t i = 0; i < lines.lines.size(); ++i) {
    const LineSet::Line& line = lines.lines[i];
    text += i == 0 ? "\n" : ",\n";
    text += fmt::format(R"({{"type":"Feature","properties":{{"line":{})", line.number);
    for (std::size_t p = 0; p < names.size(); ++p) {
      text.append(",").append(names[p]).append(":");
      const double value = lines.properties[i * names.size() + p];
      if (std::isfinite(value)) {
        append_number(text, value);
      } else {
        text += "null";  // JSON has no NaN
      }
    }
    text += R"(},"geometry":{"type":"LineString","coordinates":[)";
    for (std::size_t v = line.begin; v < line.end; ++v) {
      text += v == line.begin ? "[" : ",[";
      for (std::size_t axis = 0; axis < line.dimensions; ++axis) {
        if (axis > 0) text += ',';
        append_number(text, lines.vertices[v][axis]);
      }
      text += ']';
      if (text.size() < kAtOnce) continue;
      write(text);
      text.clear();
    }
    text += "]}}";
  }
  text += "\n]}\n";
  write(text);
}

}  // namespace terrace::terrain
