// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/chain.hpp"
#include "format/mesh/parser.hpp"
#include "format/mesh/triangles.hpp"
#include "format/missing.hpp"
#include "format/packed_column.hpp"
#include "format/ply/header.hpp"
#include "format/registry.hpp"
#include "io/line_reader.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// Upper limit of the bytes decoded at once.
constexpr std::size_t kChunkBytes = 128u << 10;

/// A property of the vertices and the destination of its values: a coordinate or an attribute;
/// lists are skipped.
struct Field {
  PlyProperty property;
  std::size_t offset = 0;  ///< in a row of fixed size
  int axis = -1;
  int attribute = -1;  ///< its offset in a point's record
};

/// Delivers the vertices of a PLY file. next_triangles() then reads its faces and strips.
class PlySource final : public PointSource {
 public:
  /// keeps_missing: also delivers vertices with a coordinate that is NaN, because faces count them.
  PlySource(const std::string& file, const SourceOptions& options, bool keeps_missing)
      : input_(file, options.stop),
        lines_(input_),
        header_(read_ply_header(input_)),
        block_points_(options.block_points),
        keeps_missing_(keeps_missing) {
    const auto vertex = std::find_if(header_.elements.begin(), header_.elements.end(),
                                     [](const PlyElement& e) { return e.name == "vertex"; });
    if (vertex == header_.elements.end()) {
      throw fault("there is no element 'vertex'")
          .at("header")
          .remedy("name a PLY file of points or of a mesh");
    }
    count_ = vertex->count;
    stride_ = vertex->binary_bytes();
    has_lists_ = vertex->has_lists();
    swap_ = (header_.encoding == PlyEncoding::big_endian) ==
            (std::endian::native == std::endian::little);
    info_.format = "ply";
    info_.files = {file};
    info_.points = count_;
    info_.faces = has_faces();
    info_.comments = header_.comments;
    if (options.crs) info_.crs = *options.crs;
    make_fields(*vertex);
    find_face_properties();
    for (auto element = header_.elements.begin(); element != vertex; ++element) {
      skip_element(*element);
    }
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    do {
      read_block(block);
    } while (block.empty() && read_ < count_);
    return !block.empty();
  }

  /// Appends the triangles of the next polygon or strip, after all vertices have been read. Returns
  /// false after the last.
  bool next_triangles(std::vector<TriangleIndices>& triangles) {
    for (; element_ < header_.elements.size(); ++element_, item_ = 0) {
      const PlyElement& element = header_.elements[element_];
      const PlyProperty* const corners = corners_of(element);
      if (element.name == "vertex") {
        after_vertices_ = true;
      } else if (corners == nullptr) {
        if (after_vertices_) skip_element(element);
      } else if (!after_vertices_) {
        throw fault("the element " + in_quotes(element.name) + " precedes the vertices")
            .at("header")
            .remedy("export the file with the vertices first");
      } else if (item_ < element.count) {
        read_corners(element, *corners, item_++);
        if (element.name == "tristrips") {
          add_strips(triangles);
        } else {
          add_fan(triangles);
        }
        return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool has_faces() const {
    return std::any_of(header_.elements.begin(), header_.elements.end(),
                       [](const PlyElement& e) { return e.count > 0 && corners_of(e) != nullptr; });
  }

  [[nodiscard]] const Input& input() const { return input_; }

  /// Returns the scalar properties that all elements of faces and strips have, with the same type.
  [[nodiscard]] const std::vector<Channel>& face_properties() const { return face_properties_; }
  /// Returns those of the polygon or strip that next_triangles() read last, packed.
  [[nodiscard]] std::span<const std::byte> face_record() const { return face_record_; }

  Progress progress() const override {
    return {
        .points = read_ - nodata_,
        .nodata = nodata_,
        .fraction = count_ == 0 ? 1.0 : static_cast<double>(read_) / static_cast<double>(count_)};
  }

 private:
  [[nodiscard]] Error fault(std::string cause) const { return {input_.name(), std::move(cause)}; }
  [[nodiscard]] Error early_end(const std::string& element, std::uint64_t item) const {
    return fault(fmt::format("the file ends in item {} of element {}", item, in_quotes(element)))
        .at_byte(input_.offset())
        .remedy("the file is truncated or its header is wrong: download it again");
  }

  void make_fields(const PlyElement& vertex) {
    std::array<bool, 3> found{};
    std::size_t offset = 0;
    for (const PlyProperty& property : vertex.properties) {
      Field field{.property = property, .offset = offset};
      offset += size_of(property.list ? property.count_type : property.type);
      if (!property.list) {
        const std::size_t axis = std::string_view("xyz").find(property.name);
        if (property.name.size() == 1 && axis != std::string_view::npos) {
          if (size_of(property.type) == 8 && property.type != ScalarType::f64) {
            throw fault("the coordinate " + in_quotes(property.name) + " is a 64-bit integer")
                .at("header")
                .remedy("store it as double");
          }
          field.axis = static_cast<int>(axis);
          found[axis] = true;
          info_.coordinates[axis] = {.name = property.name, .type = property.type};
        } else {
          field.attribute = static_cast<int>(record_bytes_);
          record_bytes_ += size_of(property.type);
          info_.attributes.push_back({.name = property.name, .type = property.type});
        }
      }
      fields_.push_back(std::move(field));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!found[axis]) {
        throw fault(fmt::format("the vertices have no property '{}'", "xyz"[axis]))
            .at("header")
            .remedy("name a PLY file of points or of a mesh");
      }
    }
  }

  void find_face_properties() {
    bool first = true;
    for (const PlyElement& element : header_.elements) {
      if (corners_of(element) == nullptr) continue;
      std::vector<Channel> scalars;
      for (const PlyProperty& property : element.properties) {
        if (!property.list) scalars.push_back({.name = property.name, .type = property.type});
      }
      if (std::exchange(first, false)) {
        face_properties_ = std::move(scalars);
        continue;
      }
      std::erase_if(face_properties_, [&](const Channel& channel) {
        return std::find(scalars.begin(), scalars.end(), channel) == scalars.end();
      });
    }
    std::size_t bytes = 0;
    for (const Channel& channel : face_properties_) bytes += size_of(channel.type);
    face_record_.resize(bytes);
  }

  /// Stores the value of a property of a face, if all faces have it.
  void store_face_value(const PlyProperty& property, const std::byte* raw) {
    std::size_t offset = 0;
    for (const Channel& channel : face_properties_) {
      if (channel.name == property.name) {
        std::copy_n(raw, size_of(channel.type),
                    face_record_.begin() + static_cast<std::ptrdiff_t>(offset));
        return;
      }
      offset += size_of(channel.type);
    }
  }

  void skip_element(const PlyElement& element) {
    if (element.properties.empty()) return;
    if (header_.encoding == PlyEncoding::ascii) {
      for (std::uint64_t i = 0; i < element.count; ++i) {
        if (!lines_.skip()) throw early_end(element.name, i);
      }
    } else if (!element.has_lists()) {
      const std::uint64_t bytes = element.binary_bytes();
      if (element.count > std::numeric_limits<std::uint64_t>::max() / bytes ||
          !input_.skip(element.count * bytes)) {
        throw early_end(element.name, 0);
      }
    } else {
      for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const PlyProperty& property : element.properties) {
          const bool good = property.list ? skip_list(property, element.name, i)
                                          : input_.skip(size_of(property.type));
          if (!good) throw early_end(element.name, i);
        }
      }
    }
  }

  /// Reads the next value of a binary file to `raw`; false if the file ends before it.
  bool read_scalar(ScalarType type, std::byte* raw) {
    const std::size_t bytes = size_of(type);
    const std::string_view window = input_.fill(bytes);
    if (window.size() < bytes) return false;
    decode_values({.rows = window.data(), .stride = bytes, .count = 1, .type = type, .swap = swap_},
                  raw, bytes);
    input_.consume(bytes);
    return true;
  }

  bool skip_list(const PlyProperty& property, const std::string& element, std::uint64_t item) {
    std::array<std::byte, 8> raw{};
    if (!read_scalar(property.count_type, raw.data())) return false;
    const std::int64_t length = to_integer(raw.data(), property.count_type);
    if (length < 0) {
      throw fault(fmt::format("list {} in item {} of element {} has the length {}",
                              in_quotes(property.name), item, in_quotes(element), length))
          .at_byte(input_.offset())
          .remedy("the file is damaged: export it again");
    }
    const auto size = static_cast<std::uint64_t>(size_of(property.type));
    const auto items = static_cast<std::uint64_t>(length);
    return items <= std::numeric_limits<std::uint64_t>::max() / size && input_.skip(items * size);
  }

  void read_block(PointBlock& block) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_points_, count_ - read_));
    block.positions.resize(count);
    block.payload.resize(count * record_bytes_);
    if (header_.encoding == PlyEncoding::ascii) {
      for (std::size_t i = 0; i < count; ++i) read_line(block, i);
    } else if (has_lists_) {
      for (std::size_t i = 0; i < count; ++i) read_row(block, i);
    } else {
      read_rows(block, count);
    }
    if (!is_finite(block)) {
      check_infinite(block);
      if (!keeps_missing_) nodata_ += remove_missing(block, record_bytes_);
    }
    read_ += count;
  }

  /// Reads vertices of fixed size in a binary file.
  void read_rows(PointBlock& block, std::size_t count) {
    for (std::size_t first = 0; first < count;) {
      const std::size_t rows =
          std::min(count - first, std::max<std::size_t>(1, kChunkBytes / stride_));
      const std::string_view window = input_.fill(rows * stride_);
      if (window.size() < rows * stride_) {
        throw early_end("vertex", read_ + first + window.size() / stride_);
      }
      for (const Field& field : fields_) {
        const PackedColumn column{.rows = window.data() + field.offset,
                                  .stride = stride_,
                                  .count = rows,
                                  .type = field.property.type,
                                  .swap = swap_};
        if (field.axis >= 0) {
          decode_coordinate(column, block.positions.data() + first,
                            static_cast<std::size_t>(field.axis));
        } else {
          decode_values(column, attribute_at(block, field, first), record_bytes_);
        }
      }
      input_.consume(rows * stride_);
      first += rows;
    }
  }

  /// Reads a vertex with lists in a binary file.
  void read_row(PointBlock& block, std::size_t i) {
    std::array<std::byte, 8> raw{};
    for (const Field& field : fields_) {
      const bool good = field.property.list ? skip_list(field.property, "vertex", read_ + i)
                                            : read_scalar(field.property.type, raw.data());
      if (!good) throw early_end("vertex", read_ + i);
      store(block, field, i, raw.data());
    }
  }

  /// Reads a vertex in an ASCII file: the next line that is not blank.
  void read_line(PointBlock& block, std::size_t i) {
    std::string_view line;
    do {
      if (!lines_.next(line)) throw early_end("vertex", read_ + i);
      line = trim_left(line);
    } while (line.empty());
    std::array<std::byte, 8> raw{};
    for (const Field& field : fields_) {
      const PlyProperty& property = field.property;
      read_word(line, property.list ? property.count_type : property.type, property, raw.data());
      if (property.list) {
        const std::int64_t length = to_integer(raw.data(), property.count_type);
        // Each item takes at least two bytes of the line, except the last, which may take one.
        if (length < 0 || static_cast<std::uint64_t>(length) > line.size()) {
          throw line_fault(
              fmt::format("list {} has the length {}", in_quotes(property.name), length));
        }
        for (std::int64_t n = 0; n < length; ++n) {
          read_word(line, property.type, property, raw.data());
        }
      } else {
        store(block, field, i, raw.data());
      }
    }
    if (!line.empty()) throw line_fault("has more values than the vertex has properties");
  }

  /// Returns the property with the vertices of an element's items; null if they are not faces or
  /// strips.
  static const PlyProperty* corners_of(const PlyElement& element) {
    if (element.name != "face" && element.name != "tristrips") return nullptr;
    for (const PlyProperty& p : element.properties) {
      if (p.list && (p.name == "vertex_indices" || p.name == "vertex_index")) return &p;
    }
    return nullptr;
  }

  /// Reads a face or a strip; stores its property `selected` in corners_.
  void read_corners(const PlyElement& element, const PlyProperty& selected, std::uint64_t item) {
    const bool is_ascii = header_.encoding == PlyEncoding::ascii;
    std::string_view line;
    while (is_ascii && line.empty()) {
      if (!lines_.next(line)) throw early_end(element.name, item);
      line = trim_left(line);
    }
    std::array<std::byte, 8> raw{};
    const auto next = [&](ScalarType type, const PlyProperty& property) {
      if (is_ascii) {
        read_word(line, type, property, raw.data());
      } else if (!read_scalar(type, raw.data())) {
        throw early_end(element.name, item);
      }
    };
    for (const PlyProperty& property : element.properties) {
      next(property.list ? property.count_type : property.type, property);
      if (!property.list) {
        store_face_value(property, raw.data());
        continue;
      }
      const std::int64_t length = to_integer(raw.data(), property.count_type);
      if (length < 0) {
        throw fault(fmt::format("list {} has the length {}", in_quotes(property.name), length))
            .at(fmt::format("{} {}", element.name, item))
            .remedy("the file is damaged: export it again");
      }
      const bool is_selected = &property == &selected;
      if (is_selected) corners_.clear();
      for (std::int64_t k = 0; k < length; ++k) {
        next(property.type, property);
        if (is_selected) corners_.push_back(corner(property.type, raw.data(), element, item));
      }
    }
    if (!line.empty())
      throw line_fault("has more values than the " + element.name + " has properties");
  }

  /// Returns the number of a vertex; negative ones end a strip.
  std::int64_t corner(ScalarType type, const std::byte* raw, const PlyElement& element,
                      std::uint64_t item) const {
    const double number = to_double(type, raw);
    if (number == std::trunc(number) && number < static_cast<double>(count_) &&
        (number >= 0.0 || element.name == "tristrips") &&
        number < std::numeric_limits<std::uint32_t>::max()) {
      return number < 0.0 ? -1 : static_cast<std::int64_t>(number);
    }
    throw fault("names a vertex that does not exist")
        .at(fmt::format("{} {}", element.name, item))
        .remedy("the file is damaged: export it again");
  }

  void add_triangle(std::vector<TriangleIndices>& triangles, std::size_t a, std::size_t b,
                    std::size_t c) const {
    triangles.push_back({static_cast<std::uint32_t>(corners_[a]),
                         static_cast<std::uint32_t>(corners_[b]),
                         static_cast<std::uint32_t>(corners_[c])});
  }
  void add_fan(std::vector<TriangleIndices>& triangles) const {
    for (std::size_t k = 2; k < corners_.size(); ++k) add_triangle(triangles, 0, k - 1, k);
  }
  /// Appends the triangles of strips; every second triangle has the opposite orientation.
  void add_strips(std::vector<TriangleIndices>& triangles) const {
    std::size_t start = 0;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      if (corners_[k] < 0) {
        start = k + 1;
      } else if (k >= start + 2) {
        const std::size_t odd = (k - start) % 2;
        add_triangle(triangles, k - 2 + odd, k - 1 - odd, k);
      }
    }
  }

  [[nodiscard]] Error line_fault(std::string cause) const {
    return fault(std::move(cause))
        .at_line(header_.lines + lines_.number())
        .remedy("the file is damaged or its header is wrong: export it again");
  }

  /// Reads the first word of `line` as a value of `type`; removes it and the blanks after it.
  void read_word(std::string_view& line, ScalarType type, const PlyProperty& property,
                 std::byte* raw) const {
    const char* const end = line.data() + line.size();
    const char* const rest = parse_scalar(line.data(), end, type, raw);
    if (rest == nullptr) {
      const std::string_view word = line.substr(0, line.find_first_of(" \t"));
      throw line_fault(word.empty()
                           ? "the line ends before property " + in_quotes(property.name)
                           : fmt::format("{} is not of type {} for property {}", in_quotes(word),
                                         name_of(type), in_quotes(property.name)));
    }
    line = trim_left({rest, static_cast<std::size_t>(end - rest)});
  }

  std::byte* attribute_at(PointBlock& block, const Field& field, std::size_t i) const {
    return block.payload.data() + i * record_bytes_ + static_cast<std::size_t>(field.attribute);
  }

  void store(PointBlock& block, const Field& field, std::size_t i, const std::byte* raw) const {
    if (field.axis >= 0) {
      block.positions[i][static_cast<std::size_t>(field.axis)] =
          to_double(field.property.type, raw);
    } else if (field.attribute >= 0) {
      std::copy_n(raw, size_of(field.property.type), attribute_at(block, field, i));
    }
  }

  static bool is_finite(const PointBlock& block) {
    // A number minus itself is zero unless it is infinite or NaN, and a sum of zeros stays zero.
    double sum = 0.0;
    for (const Point3& p : block.positions) sum += (p[0] - p[0]) + (p[1] - p[1]) + (p[2] - p[2]);
    return sum == 0.0;
  }
  void check_infinite(const PointBlock& block) const {
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (!is_infinite(block.positions[i])) continue;
      throw fault("a coordinate is infinite")
          .at(fmt::format("vertex {}", read_ + i))
          .remedy("leave such vertices out");
    }
  }

  Input input_;
  LineReader lines_;  ///< the lines after the header
  PlyHeader header_;
  std::size_t block_points_;
  SourceInfo info_;
  std::vector<Field> fields_;
  std::uint64_t count_ = 0, read_ = 0, nodata_ = 0;
  std::size_t stride_ = 0, record_bytes_ = 0;
  bool has_lists_ = false, swap_ = false, keeps_missing_;
  std::vector<std::int64_t> corners_;  ///< of one face
  std::vector<Channel> face_properties_;
  std::vector<std::byte> face_record_;  ///< of the same face
  std::size_t element_ = 0;             ///< the element read by next_triangles()
  std::uint64_t item_ = 0;
  bool after_vertices_ = false;  ///< element_ follows the vertices
};

/// Parses the vertices, without their attributes, and then the triangles.
class PlyParser final : public MeshParser {
 public:
  PlyParser(const std::string& file, const SourceOptions& options)
      : source_(file, options, /*keeps_missing=*/true) {}

  const char* format() const override { return "ply"; }
  const Input& input() const override { return source_.input(); }
  std::optional<std::uint64_t> stated_vertices() const override { return source_.info().points; }
  ScalarType coordinate_type() const override {
    const auto& coordinates = source_.info().coordinates;
    return std::all_of(coordinates.begin(), coordinates.end(),
                       [](const Channel& c) { return c.type == ScalarType::f32; })
               ? ScalarType::f32
               : ScalarType::f64;
  }

  std::vector<Channel> face_properties() const override { return source_.face_properties(); }
  std::span<const std::byte> face_record() const override { return source_.face_record(); }

  Item next() override {
    if (!vertices_done_) {
      if (vertex_at_ == block_.size()) {
        vertex_at_ = 0;
        vertices_done_ = !source_.next(block_);
      }
      if (!vertices_done_) {
        vertex_ = block_.positions[vertex_at_++];
        return Item::vertex;
      }
    }
    while (triangle_at_ == triangles_.size()) {
      triangles_.clear();
      triangle_at_ = 0;
      if (!source_.next_triangles(triangles_)) return Item::end;
    }
    const TriangleIndices& triangle = triangles_[triangle_at_++];
    face_.assign(triangle.begin(), triangle.end());
    return Item::face;
  }

 private:
  PlySource source_;
  PointBlock block_;
  std::vector<TriangleIndices> triangles_;
  std::size_t vertex_at_ = 0, triangle_at_ = 0;
  bool vertices_done_ = false;
};

bool recognise_ply(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  return text.starts_with("ply\n") || text.starts_with("ply\r") || text.starts_with("ply ");
}

std::unique_ptr<PointSource> open_one_ply(const std::string& file, const SourceOptions& options) {
  assert(options.block_points > 0);
  if (options.entities == Entities::points) {
    return std::make_unique<PlySource>(file, options, /*keeps_missing=*/false);
  }
  return triangles_of({nullptr, std::make_unique<PlyParser>(file, options)}, options);
}

std::unique_ptr<PointSource> open_ply(std::span<const std::string> files,
                                      const SourceOptions& options) {
  return open_in_sequence(files, options, &open_one_ply);
}

}  // namespace

std::optional<MeshFile> read_ply_mesh(const std::string& file, const SourceOptions& options) {
  PlySource source(file, options, /*keeps_missing=*/true);
  if (!source.has_faces()) return std::nullopt;
  MeshFile mesh;
  mesh.info = source.info();
  for (PointBlock block; source.next(block);) {
    PointBlock& vertices = mesh.vertices;
    vertices.positions.insert(vertices.positions.end(), block.positions.begin(),
                              block.positions.end());
    vertices.payload.insert(vertices.payload.end(), block.payload.begin(), block.payload.end());
  }
  while (source.next_triangles(mesh.triangles)) {
  }
  return mesh;
}

const Format& ply_format() {
  static const Format format{.name = "ply",
                             .endings = {".ply"},
                             .streams = true,
                             .recognise = &recognise_ply,
                             .open = &open_ply,
                             .triangles = true};
  return format;
}

}  // namespace terrace::stream
