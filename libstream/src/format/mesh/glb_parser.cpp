// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "format/mesh/glb.hpp"
#include "format/mesh/parser.hpp"
#include "io/bounded_json.hpp"
#include "io/bytes.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr const char* kGlbRemedy = "the file is damaged: export it again";
constexpr const char* kTruncatedRemedy = "the file is truncated: download it again";
constexpr const char* kInfinite = "has a vertex with an infinite coordinate";
constexpr const char* kPlainRemedy = "export it as plain glTF 2.0 in one .glb file";

/// A linear map and a translation: three rows of four numbers.
using Transform = std::array<double, 12>;
constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// Returns the transform that applies b, then a.
Transform product(const Transform& a, const Transform& b) {
  Transform out{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      double& sum = out[4 * row + column];
      for (std::size_t k = 0; k < 3; ++k) sum += a[4 * row + k] * b[4 * k + column];
      if (column == 3) sum += a[4 * row + 3];
    }
  }
  return out;
}

double determinant(const Transform& t) {
  return t[0] * (t[5] * t[10] - t[6] * t[9]) - t[1] * (t[4] * t[10] - t[6] * t[8]) +
         t[2] * (t[4] * t[9] - t[5] * t[8]);
}

/// An array of numbers or vectors in the binary chunk.
struct Accessor {
  std::uint64_t begin = 0, count = 0, stride = 0, bytes = 0;  ///< `bytes`: of one element
};

/// Reads the elements of an accessor in order, through a window.
class Elements {
 public:
  Elements() = default;
  Elements(const ByteSource& source, const Accessor& accessor)
      : source_(&source), accessor_(accessor) {}

  /// Returns the bytes of the next element; nullptr after the last. Valid until the next call.
  const char* next() {
    if (done_ == accessor_.count) return nullptr;
    if (done_ == end_) fill();
    return window_.data() + (done_++ - begin_) * accessor_.stride;
  }

 private:
  static constexpr std::uint64_t kWindowBytes = std::uint64_t{64} << 10;

  void fill() {
    begin_ = end_;
    end_ = std::min(accessor_.count, begin_ + kWindowBytes / accessor_.stride + 1);
    window_.resize((end_ - begin_ - 1) * accessor_.stride + accessor_.bytes);
    source_->read(accessor_.begin + begin_ * accessor_.stride,
                  std::as_writable_bytes(std::span(window_)));
  }

  const ByteSource* source_ = nullptr;
  Accessor accessor_;
  std::uint64_t begin_ = 0, end_ = 0, done_ = 0;  ///< elements: of the window, and delivered
  std::vector<char> window_;
};

/// Reads the primitives of the meshes of a scene's nodes, in the order of the tree. Section numbers
/// are those of the specification.
class GlbParser final : public MeshParser {
 public:
  GlbParser(Input& input, bool faces)
      : input_(&input), wants_faces_(faces), numbers_(input.name()) {
    read_chunks();
    refuse_extensions();
    read_scene();
    json_ = {};
  }

  const char* format() const override { return "glb"; }
  const Input& input() const override { return *input_; }
  std::optional<std::uint64_t> stated_vertices() const override { return vertices_; }
  ScalarType coordinate_type() const override {
    return has_transforms_ ? ScalarType::f64 : ScalarType::f32;
  }

  Item next() override {
    for (; at_ < parts_.size(); ++at_, begun_ = false) {
      if (!begun_) begin(parts_[at_]);
      if (read_position()) return Item::vertex;
      if (wants_faces_ && read_face()) return Item::face;
    }
    return Item::end;
  }

 private:
  using Json = nlohmann::json;

  static constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;
  /// Limit of the primitives that nodes use, counting each use.
  static constexpr std::size_t kMaxParts = std::size_t{1} << 20;

  /// A primitive (3.7.2.1).
  struct Part {
    Transform transform = kIdentity;
    bool mirrored = false;    ///< the transform flips the orientation of triangles
    Accessor positions;       ///< count 0: an earlier part has delivered them
    std::uint64_t first = 0;  ///< the number of the first of its vertices
    std::uint64_t vertices = 0;
    std::optional<Accessor> indices;
    std::uint64_t corners = 0, mode = glb::kTriangles;
  };

  [[nodiscard]] Error fault(std::string cause) const {
    return Error(input_->name(), std::move(cause)).remedy(kGlbRemedy);
  }
  [[nodiscard]] Error fault_here(std::string cause) const {
    return fault(std::move(cause)).at_byte(input_->offset());
  }

  // The chunks (4.4).

  std::uint32_t word(std::size_t at) const {
    return load_little_endian<std::uint32_t>(input_->window().data() + at);
  }

  void read_chunks() {
    constexpr std::size_t kHeaders = glb::kHeaderBytes + glb::kChunkHeaderBytes;
    if (input_->fill(kHeaders).size() < kHeaders) throw fault_here("is too short for GLB");
    if (word(0) != glb::kMagic) throw fault_here("does not begin with glTF");
    if (word(4) != glb::kVersion) {
      throw fault_here(fmt::format("is glTF of version {}, not 2", word(4))).remedy(kPlainRemedy);
    }
    const std::uint64_t file_bytes = word(8), json_bytes = word(12);
    if (input_->size() && *input_->size() < file_bytes) {
      throw fault_here(fmt::format("is truncated: its header promises {}, but it has {}",
                                   counted(file_bytes, "byte"), *input_->size()))
          .remedy(kTruncatedRemedy);
    }
    if (word(16) != glb::kJson) throw fault_here("its first chunk is not JSON");
    if (file_bytes < kHeaders + json_bytes) throw fault_here("its JSON is larger than the file");
    if (json_bytes > kMaxJsonBytes)
      throw fault_here("its JSON is larger than 64 MiB").remedy(kPlainRemedy);
    input_->consume(kHeaders);
    parse(input_->fill(json_bytes).substr(0, json_bytes), json_bytes);
    input_->consume(json_bytes);

    std::uint64_t remaining = file_bytes - kHeaders - json_bytes;
    if (remaining < glb::kChunkHeaderBytes) return;
    if (input_->fill(glb::kChunkHeaderBytes).size() < glb::kChunkHeaderBytes)
      throw fault_here("ends before its second chunk");
    std::uint64_t bytes = word(0);
    const bool binary = word(4) == glb::kBinary;
    input_->consume(glb::kChunkHeaderBytes);
    remaining -= glb::kChunkHeaderBytes;
    if (!binary) return;
    if (bytes > remaining) throw fault_here("its binary chunk is larger than the file");
    // Positions and corners may be in any order and are read in parallel, so keep them in a file.
    while (bytes > 0) {
      const std::string_view window = input_->fill(1);
      if (window.empty()) throw fault_here("ends within its binary chunk").remedy(kTruncatedRemedy);
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, window.size()));
      numbers_.append(std::as_bytes(std::span(window.data(), size)));
      input_->consume(size);
      bytes -= size;
    }
  }

  void parse(std::string_view text, std::uint64_t promised) {
    if (text.size() < promised) throw fault_here("ends within its JSON").remedy(kTruncatedRemedy);
    try {
      // Even a scene of many thousand nodes has far fewer than a million values, and a million fit
      // into memory.
      json_ = parse_bounded_json(
          text, {.depth = 16, .values = std::size_t{1} << 20},
          [this](const char* cause) { throw fault_here(cause).remedy(kPlainRemedy); });
    } catch (const Json::parse_error& error) {
      throw fault("is not JSON").at_byte(input_->offset() + error.byte);
    } catch (const Json::out_of_range&) {
      throw fault_here("its JSON has a number too large for a double");
    }
    if (!json_.is_object()) throw fault_here("its JSON is not an object");
  }

  // Access to the JSON.

  /// Returns the list of that name; an empty one if there is none.
  const Json& list(const Json& object, const char* name) const {
    static const Json none = Json::array();
    const auto entry = object.find(name);
    if (entry == object.end()) return none;
    if (!entry->is_array()) throw fault("is not a list").at(name);
    return *entry;
  }

  /// Returns entry `index` of a list at the top level. Throws: Error if it is not an object.
  const Json& entry(const char* name, std::uint64_t index) const {
    const Json& entries = list(json_, name);
    if (index >= entries.size() || !entries[index].is_object()) {
      throw fault("is missing").at(fmt::format("{} {}", name, index));
    }
    return entries[index];
  }

  static std::optional<std::uint64_t> unsigned_integer(const Json& value) {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMax) return std::nullopt;
    return value.get<std::uint64_t>();
  }

  std::optional<std::uint64_t> count(const Json& object, const char* name) const {
    const auto entry = object.find(name);
    if (entry == object.end()) return std::nullopt;
    const std::optional<std::uint64_t> value = unsigned_integer(*entry);
    if (!value) throw fault(fmt::format("is not a number from 0 to {}", kMax)).at(name);
    return value;
  }

  /// Reads a list of out.size() finite numbers; false if there is no such list.
  bool read_numbers(const Json& object, const char* name, std::span<double> out) const {
    if (!object.contains(name)) return false;
    const Json& numbers = list(object, name);
    if (numbers.size() != out.size()) {
      throw fault("does not have " + counted(out.size(), "number")).at(name);
    }
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (!numbers[i].is_number()) throw fault("is not a list of numbers").at(name);
      out[i] = numbers[i].get<double>();
      if (!std::isfinite(out[i])) throw fault("has a number that is not finite").at(name);
    }
    return true;
  }

  /// Returns an accessor (3.6.2). Throws: Error unless its elements are entirely in the binary
  /// chunk.
  Accessor accessor(std::uint64_t index, const char* type, std::uint64_t& component) const {
    const std::string where = fmt::format("accessors {}", index);
    const Json& json = entry("accessors", index);
    if (json.value("type", Json()) != type)
      throw fault(std::string("is not of type ") + type).at(where);
    component = count(json, "componentType").value_or(0);
    const std::uint64_t bytes = component == glb::kUnsignedByte                              ? 1
                                : component == glb::kUnsignedShort                           ? 2
                                : component == glb::kUnsignedInt || component == glb::kFloat ? 4
                                                                                             : 0;
    if (bytes == 0)
      throw fault("has a number type that is not supported").at(where).remedy(kPlainRemedy);
    const std::optional<std::uint64_t> view_index = count(json, "bufferView");
    if (json.contains("sparse") || !view_index) {
      throw fault("is sparse, which is not supported").at(where).remedy(kPlainRemedy);
    }
    const Json& view = entry("bufferViews", *view_index);
    const std::uint64_t buffer = count(view, "buffer").value_or(0);
    if (buffer != 0 || entry("buffers", 0).contains("uri")) {
      throw fault("is in another file, which is not supported").at(where).remedy(kPlainRemedy);
    }
    Accessor out;
    out.bytes = bytes * (std::string_view(type) == "VEC3" ? 3 : 1);
    out.stride = count(view, "byteStride").value_or(out.bytes);
    out.count = count(json, "count").value_or(0);
    const std::uint64_t offset = count(json, "byteOffset").value_or(0);
    const std::uint64_t view_bytes = count(view, "byteLength").value_or(0);
    out.begin = count(view, "byteOffset").value_or(0);
    if (out.stride < out.bytes) throw fault("has elements that overlap").at(where);
    if (out.begin > numbers_.size() || view_bytes > numbers_.size() - out.begin ||
        (out.count > 0 && offset + (out.count - 1) * out.stride + out.bytes > view_bytes)) {
      throw fault("extends beyond the binary chunk").at(where);
    }
    out.begin += offset;
    return out;
  }

  /// Throws: Error for required extensions, such as compressed geometry, except those that only
  /// concern colours.
  void refuse_extensions() const {
    for (const Json& extension : list(json_, "extensionsRequired")) {
      const std::string name = extension.is_string() ? extension.get<std::string>() : "?";
      const auto begins = [&](const char* text) { return name.starts_with(text); };
      if (begins("KHR_materials_") || begins("KHR_texture_") || begins("EXT_texture_")) continue;
      throw fault("needs the extension " + name + ", which is not supported").remedy(kPlainRemedy);
    }
  }

  // The scene (3.5).

  Transform transform_of(const Json& node) const {
    std::array<double, 16> columns{};
    if (read_numbers(node, "matrix", columns)) {
      Transform out{};
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column) {
          out[4 * row + column] = columns[4 * column + row];
        }
      }
      return out;
    }
    std::array<double, 3> move{}, scale{1, 1, 1};
    std::array<double, 4> turn{0, 0, 0, 1};
    read_numbers(node, "translation", move);
    read_numbers(node, "rotation", turn);
    read_numbers(node, "scale", scale);
    const auto [x, y, z, w] = turn;
    const Transform rotation{
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),     0,
        2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),     0,
        2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y), 0};
    Transform out{};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        out[4 * row + column] = rotation[4 * row + column] * scale[column];
      }
      out[4 * row + 3] = move[row];
    }
    return out;
  }

  /// Returns the root nodes: those of the default scene, or all without a parent if there are no
  /// scenes.
  std::vector<std::uint64_t> roots() const {
    std::vector<std::uint64_t> out;
    const auto add = [&](const Json& nodes) {
      for (const Json& node : nodes) {
        const std::optional<std::uint64_t> number = unsigned_integer(node);
        if (!number) throw fault("a node index is invalid").at("nodes");
        out.push_back(*number);
      }
    };
    if (!list(json_, "scenes").empty()) {
      add(list(entry("scenes", count(json_, "scene").value_or(0)), "nodes"));
      return out;
    }
    const Json& nodes = list(json_, "nodes");
    for (std::uint64_t i = 0; i < nodes.size(); ++i) add(list(entry("nodes", i), "children"));
    std::vector<std::uint64_t> children = std::move(out);
    std::sort(children.begin(), children.end());
    out.clear();
    for (std::uint64_t i = 0; i < nodes.size(); ++i) {
      if (!std::binary_search(children.begin(), children.end(), i)) out.push_back(i);
    }
    return out;
  }

  void read_scene() {
    std::vector<bool> visited(list(json_, "nodes").size());
    std::vector<std::pair<std::uint64_t, Transform>> stack;
    for (const std::uint64_t root : roots()) stack.emplace_back(root, kIdentity);
    std::reverse(stack.begin(), stack.end());
    while (!stack.empty()) {
      const auto [index, above] = stack.back();
      stack.pop_back();
      const Json& node = entry("nodes", index);
      if (visited[index]) throw fault("is in the scene twice").at(fmt::format("nodes {}", index));
      visited[index] = true;
      const Transform transform = product(above, transform_of(node));
      if (const auto mesh = count(node, "mesh")) add_mesh(*mesh, transform);
      const Json& children = list(node, "children");
      for (std::size_t i = children.size(); i-- > 0;) {
        const std::optional<std::uint64_t> child = unsigned_integer(children[i]);
        if (!child)
          throw fault("the index of a child is invalid").at(fmt::format("nodes {}", index));
        stack.emplace_back(*child, transform);
      }
    }
  }

  void add_mesh(std::uint64_t index, const Transform& transform) {
    // The first vertex of each accessor in this mesh: primitives may share their vertices.
    std::map<std::uint64_t, std::uint64_t> first_vertices;
    const std::string where = fmt::format("meshes {}", index);
    for (const Json& primitive : list(entry("meshes", index), "primitives")) {
      const auto attributes = primitive.find("attributes");
      const std::optional<std::uint64_t> positions =
          attributes == primitive.end() ? std::nullopt : count(*attributes, "POSITION");
      if (!positions) continue;  // it has nothing to draw (3.7.2.1)
      Part part;
      part.transform = transform;
      part.mirrored = determinant(transform) < 0;
      part.mode = count(primitive, "mode").value_or(glb::kTriangles);
      std::uint64_t component = 0;
      part.positions = accessor(*positions, "VEC3", component);
      if (component != glb::kFloat)
        throw fault("has positions that are not floats").at(where).remedy(kPlainRemedy);
      part.vertices = part.positions.count;
      part.first = vertices_;
      const auto [same, is_new] = first_vertices.emplace(*positions, vertices_);
      if (!is_new) {
        part.first = same->second;
        part.positions.count = 0;
      } else {
        vertices_ += part.vertices;
        if (vertices_ >= kMax) throw fault("has more vertices than can be numbered").at(where);
      }
      if (part.mode >= glb::kTriangles) add_corners(primitive, where, part);
      has_transforms_ = has_transforms_ || transform != kIdentity;
      if (parts_.size() == kMaxParts) {
        throw fault(fmt::format("is one of more than {} placed primitives", kMaxParts))
            .at(where)
            .remedy(kPlainRemedy);
      }
      parts_.push_back(part);
    }
  }

  void add_corners(const Json& primitive, const std::string& where, Part& part) const {
    if (part.mode > glb::kFan) throw fault("has a drawing mode that glTF does not have").at(where);
    part.corners = part.vertices;
    if (const auto indices = count(primitive, "indices")) {
      std::uint64_t component = 0;
      part.indices = accessor(*indices, "SCALAR", component);
      if (component == glb::kFloat) throw fault("has vertex indices that are floats").at(where);
      part.corners = part.indices->count;
    }
    if (part.mode == glb::kTriangles && part.corners % 3 != 0) {
      throw fault("has " + counted(part.corners, "corner") + ", not three for each triangle")
          .at(where);
    }
  }

  // The vertices and faces.

  void begin(const Part& part) {
    begun_ = true;
    positions_ = Elements(numbers_, part.positions);
    indices_ = Elements(numbers_, part.indices.value_or(Accessor()));
    corner_ = 0;
  }

  bool read_position() {
    const char* at = positions_.next();
    if (at == nullptr) return false;
    Point3 p;
    for (double& value : p) {
      value = std::bit_cast<float>(load_little_endian<std::uint32_t>(at));
      if (std::isinf(value)) throw fault(kInfinite);
      at += sizeof(float);
    }
    Point3 world;
    for (std::size_t row = 0; row < 3; ++row) {
      const double* const t = parts_[at_].transform.data() + 4 * row;
      world[row] = has_transforms_ ? t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[3] : p[row];
      if (std::isinf(world[row])) throw fault(kInfinite);
    }
    vertex_ = {world[0], 0.0 - world[2], world[1]};  // from y up to z up, without negative zero
    return true;
  }

  std::uint32_t read_corner() {
    const Part& part = parts_[at_];
    std::uint64_t vertex = corner_++;
    if (part.indices) {
      const char* const at = indices_.next();
      vertex = part.indices->bytes == 1   ? static_cast<unsigned char>(*at)
               : part.indices->bytes == 2 ? load_little_endian<std::uint16_t>(at)
                                          : load_little_endian<std::uint32_t>(at);
    }
    if (vertex >= part.vertices) {
      throw fault(fmt::format("a face names the vertex {}, which does not exist", vertex));
    }
    return static_cast<std::uint32_t>(part.first + vertex);
  }

  bool read_face() {
    const Part& part = parts_[at_];
    while (corner_ < part.corners) {
      if (part.mode == glb::kTriangles) {
        face_ = {read_corner(), 0, 0};
        face_[1] = read_corner();
        face_[2] = read_corner();
        if (part.mirrored) std::swap(face_[1], face_[2]);
        return true;
      }
      // Strips and fans begin with two corners; each further one makes a triangle.
      const std::uint64_t number = corner_;
      const std::uint32_t corner = read_corner();
      if (number < 2) {
        last_[number] = corner;
        continue;
      }
      // Every second triangle of a strip has the opposite orientation.
      face_ = {last_[0], last_[1], corner};
      const bool is_reversed = part.mode == glb::kStrip && number % 2 == 1;
      if (is_reversed != part.mirrored) std::swap(face_[1], face_[2]);
      if (part.mode == glb::kStrip) last_[0] = last_[1];
      last_[1] = corner;
      // Triangles without area connect strips; skip them.
      if (face_[0] != face_[1] && face_[1] != face_[2] && face_[2] != face_[0]) return true;
    }
    return false;
  }

  Input* input_;
  bool wants_faces_;
  Spool numbers_;  ///< the binary chunk
  Json json_;
  std::vector<Part> parts_;
  std::uint64_t vertices_ = 0;
  bool has_transforms_ = false;  ///< a node has a transform

  std::size_t at_ = 0;  ///< the current part
  bool begun_ = false;
  Elements positions_, indices_;
  std::uint64_t corner_ = 0;  ///< corners of the current part that have been read
  std::array<std::uint32_t, 2> last_{};
};

}  // namespace

bool recognise_glb(std::span<const std::byte> bytes) {
  return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size())
      .starts_with("glTF");
}

std::unique_ptr<MeshParser> glb_parser(Input& input, bool faces) {
  return std::make_unique<GlbParser>(input, faces);
}

}  // namespace terrace::stream
