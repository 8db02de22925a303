// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/source.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/chain.hpp"
#include "format/geojson/geometry.hpp"
#include "format/geojson/items.hpp"
#include "format/geojson/properties.hpp"
#include "format/registry.hpp"
#include "io/peek.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

/// Reads the positions of GeoJSON as points, or its lines as segments or polylines.

namespace terrace::stream {
namespace {

constexpr std::array kAxes{"x", "y", "z"};

Error too_many_lines(const std::string& file) {
  return Error(file, "has more than 4,294,967,295 lines").remedy("build several stores");
}

class GeoJsonSource final : public PointSource {
 public:
  /// properties: names of further numeric properties, of other files.
  GeoJsonSource(const std::string& file, const SourceOptions& options,
                std::span<const std::string> properties = {})
      : input_(file, options.stop),
        items_(input_, item_bytes(options), !options.crs),
        block_points_(options.block_points),
        max_vertices_(vertices_of(options.entities)) {
    info_.format = "geojson";
    info_.files = {file};
    info_.crs = options.crs ? *options.crs : items_.crs();
    for (std::size_t axis = 0; axis < 3; ++axis) info_.coordinates[axis] = {.name = kAxes[axis]};
    if (max_vertices_ == 1) return;
    for (std::size_t vertex = 2; vertex <= max_vertices_; ++vertex) {
      for (const char* const axis : kAxes) {
        info_.attributes.push_back({.name = fmt::format("{}{}", axis, vertex)});
      }
    }
    info_.attributes.push_back({.name = "line", .type = ScalarType::u32});
    info_.attributes.push_back({.name = "part", .type = ScalarType::u32});
    info_.attributes.push_back({.name = "vertices", .type = ScalarType::u8});
    info_.attributes.push_back({.name = "dimensions", .type = ScalarType::u8});
    shape_bytes_ = info_.payload_size();
    properties_ = PropertyColumns(file, options, items_.numbers_lines());
    for (const std::string& name : properties) properties_.add(name);
    const bool complete = read_head();
    for (Channel& channel : properties_.finish(complete, info_.attributes)) {
      info_.attributes.push_back(std::move(channel));
    }
    record_.resize(info_.payload_size());
  }

  /// The names of the numeric properties of lines.
  [[nodiscard]] const std::vector<std::string>& properties() const { return properties_.names(); }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    block.clear();
    while (block.size() < block_points_) {
      if (!has_more()) {
        if (!read_item()) break;
      } else if (max_vertices_ == 1) {
        append_positions(block);
      } else {
        append_piece(block);
      }
    }
    progress_.points += block.size();
    return !block.empty();
  }

  Progress progress() const override {
    Progress progress = progress_;
    if (input_.size() && *input_.size() > 0) {
      progress.fraction =
          std::min(1.0, static_cast<double>(input_.offset()) / static_cast<double>(*input_.size()));
    }
    return progress;
  }

 private:
  /// A quarter of the memory for a feature's text: its parsed geometry takes at most as much, and
  /// vectors have spare capacity.
  static std::size_t item_bytes(const SourceOptions& options) {
    constexpr std::uint64_t kMin = 1u << 20;
    return static_cast<std::size_t>(std::max(kMin, options.memory_bytes / 4));
  }
  static std::size_t vertices_of(Entities entities) {
    if (entities == Entities::points) return 1;
    return entities == Entities::segments ? 2 : kPolylineVertices;
  }

  [[nodiscard]] bool has_more() const {
    return max_vertices_ == 1 ? vertex_ < geometry_.positions.size()
                              : line_ < geometry_.lines.size();
  }

  /// Reads the first features and their properties. Returns whether they are all.
  bool read_head() {
    constexpr std::size_t kHeadBytes = std::size_t{2} << 20;
    for (std::size_t bytes = 0; bytes < kHeadBytes;) {
      const std::optional<std::string_view> item = items_.next();
      if (!item) return true;
      bytes += item->size();
      GeoJsonGeometry& feature = head_.emplace_back();
      append_geometry(*item, input_.name(), items_.offset(), feature);
      if (!feature.lines.empty()) properties_.add(feature.properties);
    }
    return false;
  }

  bool read_item() {
    if (!head_.empty()) {
      geometry_ = std::move(head_.front());
      head_.pop_front();
    } else {
      const std::optional<std::string_view> item = items_.next();
      if (!item) return false;
      geometry_.clear();
      append_geometry(*item, input_.name(), items_.offset(), geometry_);
    }
    vertex_ = line_ = 0;
    if (max_vertices_ == 1) return true;
    if (!geometry_.lines.empty()) {
      progress_.empty_values += properties_.read(geometry_.properties, items_.offset(), values_);
    }
    std::uint64_t single = geometry_.positions.size();
    for (const GeoJsonGeometry::Line& line : geometry_.lines) single -= line.end - line.begin;
    progress_.excluded += single;
    begin_line();
    return true;
  }

  void append_positions(PointBlock& block) {
    const std::size_t count =
        std::min(block_points_ - block.size(), geometry_.positions.size() - vertex_);
    const auto begin = geometry_.positions.begin() + static_cast<std::ptrdiff_t>(vertex_);
    block.positions.insert(block.positions.end(), begin,
                           begin + static_cast<std::ptrdiff_t>(count));
    vertex_ += count;
  }

  void begin_line() {
    part_ = 0;
    if (line_ < geometry_.lines.size()) vertex_ = geometry_.lines[line_].begin;
  }

  /// Appends the next piece of a line, which begins with the last vertex of the previous one.
  void append_piece(PointBlock& block) {
    const GeoJsonGeometry::Line& line = geometry_.lines[line_];
    const std::size_t count = std::min(max_vertices_, line.end - vertex_);
    block.positions.push_back(geometry_.positions[vertex_]);
    std::fill(record_.begin(), record_.end(), std::byte{0});
    std::memcpy(record_.data(), geometry_.positions.data() + vertex_ + 1,
                (count - 1) * sizeof(Point3));
    std::byte* const numbers = record_.data() + (max_vertices_ - 1) * sizeof(Point3);
    std::memcpy(numbers, &lines_, sizeof lines_);
    std::memcpy(numbers + sizeof lines_, &part_, sizeof part_);
    numbers[2 * sizeof lines_] = static_cast<std::byte>(count);
    numbers[2 * sizeof lines_ + 1] = static_cast<std::byte>(line.dimensions);
    const auto values = std::as_bytes(std::span(values_));
    std::copy(values.begin(), values.end(),
              record_.begin() + static_cast<std::ptrdiff_t>(shape_bytes_));
    block.payload.insert(block.payload.end(), record_.begin(), record_.end());
    vertex_ += count - 1;
    ++part_;
    if (vertex_ + 1 < line.end) return;
    ++line_;
    if (lines_++ == std::numeric_limits<std::uint32_t>::max()) throw too_many_lines(input_.name());
    begin_line();
  }

  Input input_;
  GeoJsonItems items_;
  std::size_t block_points_, max_vertices_;
  SourceInfo info_;
  PropertyColumns properties_;
  std::deque<GeoJsonGeometry> head_;  ///< features that were read before the first was delivered
  GeoJsonGeometry geometry_;          ///< of the feature being delivered
  std::vector<double> values_;        ///< its properties
  std::size_t shape_bytes_ = 0;       ///< of a record, before the properties
  std::size_t line_ = 0, vertex_ = 0;
  std::uint32_t lines_ = 0, part_ = 0;  ///< lines finished so far; number of the next piece
  std::vector<std::byte> record_;
  Progress progress_;
};

/// Numbers the lines of several files consecutively. A new file begins with part 0 of line 0.
class NumberedLines final : public PointSource {
 public:
  explicit NumberedLines(std::unique_ptr<PointSource> files)
      : files_(std::move(files)), line_at_(offset_of_line(files_->info())) {}

  const SourceInfo& info() const override { return files_->info(); }
  Progress progress() const override { return files_->progress(); }

  bool next(PointBlock& block) override {
    if (!files_->next(block)) return false;
    const std::size_t record = info().payload_size();
    for (std::size_t i = 0; i < block.size(); ++i) {
      std::byte* const number = block.payload.data() + i * record + line_at_;
      std::array<std::uint32_t, 2> line_and_part{};
      std::memcpy(line_and_part.data(), number, sizeof line_and_part);
      if (line_and_part == std::array<std::uint32_t, 2>{}) first_ = next_;
      const std::uint64_t line = first_ + line_and_part[0];
      if (line > std::numeric_limits<std::uint32_t>::max())
        throw too_many_lines(info().files.front());
      next_ = line + 1;
      line_and_part[0] = static_cast<std::uint32_t>(line);
      std::memcpy(number, line_and_part.data(), sizeof line_and_part[0]);
    }
    return true;
  }

 private:
  static std::size_t offset_of_line(const SourceInfo& info) {
    const auto line = std::find_if(info.attributes.begin(), info.attributes.end(),
                                   [](const Channel& channel) { return channel.name == "line"; });
    return info.attribute_offset(static_cast<std::size_t>(line - info.attributes.begin()));
  }

  std::unique_ptr<PointSource> files_;
  std::size_t line_at_;
  std::uint64_t first_ = 0, next_ = 0;
};

bool recognise_geojson(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t first = text.find_first_not_of(" \t\r\n\x1E\xEF\xBB\xBF");
  if (first == std::string_view::npos || text[first] != '{') return false;
  constexpr std::array kMarks{
      "\"Feature\"",         "\"FeatureCollection\"", "\"LineString\"",
      "\"MultiLineString\"", "\"Polygon\"",           "\"MultiPolygon\"",
      "\"Point\"",           "\"MultiPoint\"",        "\"GeometryCollection\""};
  return text.find("\"type\"") != std::string_view::npos &&
         std::any_of(kMarks.begin(), kMarks.end(),
                     [&](const char* mark) { return text.find(mark) != std::string_view::npos; });
}

std::unique_ptr<PointSource> open_one_geojson(const std::string& file,
                                              const SourceOptions& options) {
  assert(options.block_points > 0);
  return std::make_unique<GeoJsonSource>(file, options);
}

std::unique_ptr<PointSource> open_geojson(std::span<const std::string> files,
                                          const SourceOptions& options) {
  if (files.size() == 1 || options.entities == Entities::points) {
    return open_in_sequence(files, options, &open_one_geojson);
  }
  // A property of one file is a column of all.
  std::vector<std::string> properties;
  for (const std::string& file : files) {
    if (!is_rereadable(file)) continue;
    const GeoJsonSource source(file, options);
    for (const std::string& name : source.properties()) {
      if (std::find(properties.begin(), properties.end(), name) == properties.end()) {
        properties.push_back(name);
      }
    }
  }
  return std::make_unique<NumberedLines>(
      open_in_sequence(files, options,
                       [properties](const std::string& file,
                                    const SourceOptions& own) -> std::unique_ptr<PointSource> {
                         return std::make_unique<GeoJsonSource>(file, own, properties);
                       }));
}

}  // namespace

const Format& geojson_format() {
  static const Format format{.name = "geojson",
                             .endings = {".geojson", ".geojsonl", ".geojsons"},
                             .streams = true,
                             .recognise = &recognise_geojson,
                             .open = &open_geojson,
                             .lines = true};
  return format;
}

}  // namespace terrace::stream
