// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cassert>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "format/mesh/glb.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/sink.hpp"

/// Writes GLB. The JSON precedes the positions but contains their bounds, so room is left for it
/// and it is written at the end.

namespace terrace::stream {
namespace {

constexpr std::size_t kGlbPieceBytes = 64u << 10;
constexpr std::size_t kMaxStride = 252;  // of a vertex buffer, by the specification

/// From z up to y up: a rotation, so that triangles keep their orientation.
template <class Number>
std::array<Number, 3> y_up(const std::array<Number, 3>& p) {
  return {p[0], p[2], -p[1]};
}

/// Returns the name of an application-specific attribute: it must begin with an underscore, and is
/// upper case by convention.
std::string attribute_name(const std::string& name) {
  std::string out = "_";
  for (const char c : name) {
    const bool lower = c >= 'a' && c <= 'z';
    const bool plain = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    out += lower ? static_cast<char>(c - 'a' + 'A') : plain ? c : '_';
  }
  return out;
}

/// Writes binary glTF; see MeshWriter for its coordinates.
class GlbWriter final : public MeshWriter {
 public:
  GlbWriter(const std::string& path, const MeshHeader& header, const WriterOptions& options)
      : header_(header),
        frame_(header.frame.value_or(MeshFrame{})),
        counts_(header),
        normals_(normals_in(header.attributes)),
        stride_(4 * (3 + header.attributes.size())) {
    const auto refused = [&](const char* cause) {
      return Error(path, cause).remedy("write PLY, or a smaller part");
    };
    if (stride_ > kMaxStride) throw refused("GLB holds at most 60 attributes");
    // Check two sizes that cannot overflow first, then the sum.
    constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
    if (header.vertices >= kMax / stride_ || header.triangles >= kMax / 12 ||
        glb::kHeaderBytes + 2 * glb::kChunkHeaderBytes + 4096 * (1 + header.attributes.size()) +
                8 * frame_.crs.size() + binary_bytes() >
            kMax) {
      throw refused("GLB holds at most 4 GiB");
    }
    if (header.bounds && !header.bounds->empty()) {
      origin_ = glb_origin(*header.bounds);
      origin_known_ = true;
    }
    // The longest numbers show how much room the JSON may need; blanks fill the rest.
    constexpr double kLongest = -1.2345678901234567e-300;
    constexpr std::array<double, 3> kAny{kLongest, kLongest, kLongest};
    json_bytes_ = json(kAny, kAny, kAny, kAny).size() + 36;
    json_bytes_ += (4 - json_bytes_ % 4) % 4;
    sink_.emplace(path, options.replace, options.stop);
    std::string text;
    append_little_endian(text, glb::kMagic);
    append_little_endian(text, glb::kVersion);
    append_little_endian(
        text, static_cast<std::uint32_t>(glb::kHeaderBytes + glb::kChunkHeaderBytes + json_bytes_ +
                                         binary_chunk_bytes()));
    append_little_endian(text, static_cast<std::uint32_t>(json_bytes_));
    append_little_endian(text, glb::kJson);
    text.append(json_bytes_, ' ');
    if (header_.vertices > 0) {
      append_little_endian(text, static_cast<std::uint32_t>(binary_bytes()));
      append_little_endian(text, glb::kBinary);
    }
    sink_->write(text);
  }

  void add_vertices(std::span<const Point3> positions, std::span<const float> attributes) override {
    counts_.add_vertices(positions, attributes);
    if (!origin_known_ && !positions.empty()) {
      origin_ = positions.front();
      origin_known_ = true;
    }
    const std::size_t columns = header_.attributes.size();
    for (std::size_t v = 0; v < positions.size(); ++v) {
      const Point3& p = positions[v];
      std::array<float, 3> local{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        local[axis] = glb_coordinate(p[axis], origin_[axis], frame_.metres[axis]);
      }
      local = y_up(local);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float stored = local[axis];
        if (stored < min_[axis]) min_[axis] = stored;
        if (stored > max_[axis]) max_[axis] = stored;
        append_little_endian(piece_, stored);
      }
      append_attributes(attributes.subspan(v * columns, columns));
      flush_if_full();
    }
    flush();
  }

  void add_triangles(std::span<const TriangleIndices> triangles) override {
    counts_.add_triangles(triangles);
    for (const TriangleIndices& triangle : triangles) {
      for (const std::uint32_t index : triangle) append_little_endian(piece_, index);
      flush_if_full();
    }
    flush();
  }

  void finish() override {
    assert(counts_.complete());
    const auto widened = [](const std::array<float, 3>& v) {
      return std::array<double, 3>{v[0], v[1], v[2]};
    };
    // The local origin in the scene, and the origin of the scene in the coordinates.
    Point3 place{}, scene{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (frame_.local && axis < 2) {
        scene[axis] = origin_[axis];
      } else {
        place[axis] = origin_[axis] * frame_.metres[axis];
      }
    }
    const std::string text = json(y_up(place), scene, widened(min_), widened(max_));
    assert(text.size() <= json_bytes_);
    sink_->write_at(glb::kHeaderBytes + glb::kChunkHeaderBytes, text);
    sink_->commit();
  }

 private:
  using Json = nlohmann::ordered_json;

  /// Appends the attributes of one vertex, its normal with y up.
  void append_attributes(std::span<const float> values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i != normals_) {
        append_little_endian(piece_, values[i]);
        continue;
      }
      std::array<float, 3> normal{values[i], values[i + 1], values[i + 2]};
      if (normal == std::array<float, 3>{}) normal[2] = 1;
      for (const float value : y_up(normal)) append_little_endian(piece_, value);
      i += 2;
    }
  }

  [[nodiscard]] std::uint64_t binary_bytes() const {
    return header_.vertices * stride_ + header_.triangles * 12;
  }
  [[nodiscard]] std::uint64_t binary_chunk_bytes() const {
    return header_.vertices == 0 ? 0 : glb::kChunkHeaderBytes + binary_bytes();
  }

  [[nodiscard]] std::string json(const std::array<double, 3>& translation, const Point3& origin,
                                 const std::array<double, 3>& min,
                                 const std::array<double, 3>& max) const {
    Json out;
    out["asset"] = {{"version", "2.0"}, {"generator", "terrace"}};
    if (header_.frame) out["asset"]["extras"] = placement(origin);
    out["scene"] = 0;
    if (header_.vertices == 0) {
      out["scenes"] = Json::array({Json::object()});
      return text_of(out);
    }
    out["scenes"] = Json::array({{{"nodes", {0}}}});
    out["nodes"] = Json::array({{{"mesh", 0}, {"translation", translation}}});
    out["meshes"] = Json::array({{{"primitives", Json::array({primitive()})}}});
    // The default material of glTF is shiny metal, which is dark in most viewers.
    out["materials"] =
        Json::array({{{"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
                      {"doubleSided", true}}});
    out["accessors"] = accessors(min, max);
    out["bufferViews"] = buffer_views();
    out["buffers"] = Json::array({{{"byteLength", binary_bytes()}}});
    return text_of(out);
  }

  [[nodiscard]] Json placement(const Point3& origin) const {
    Json extras;
    extras["crs"] = frame_.crs;
    extras["origin"] = origin;
    extras["metres_per_unit"] = frame_.metres;
    extras["coordinates"] =
        "x = origin[0] + X / metres_per_unit[0], y = origin[1] - Z / metres_per_unit[1], "
        "z = Y / metres_per_unit[2] of a vertex at X, Y, Z in the scene";
    return extras;
  }

  /// An accessor of vertices: an attribute, or three that are normals.
  struct VertexColumn {
    std::string name;
    const char* type;
    std::size_t offset;  ///< in a vertex, in bytes
  };
  [[nodiscard]] std::vector<VertexColumn> columns() const {
    std::vector<VertexColumn> out;
    for (std::size_t i = 0; i < header_.attributes.size(); ++i) {
      const std::size_t offset = 12 + 4 * i;
      if (i == normals_) {
        out.push_back({"NORMAL", "VEC3", offset});
        i += 2;
      } else {
        out.push_back({attribute_name(header_.attributes[i]), "SCALAR", offset});
      }
    }
    return out;
  }

  /// Names accessors by their numbers: 0 for positions, then columns(), then the corners of
  /// triangles.
  [[nodiscard]] Json primitive() const {
    Json out;
    std::size_t accessor = 0;
    out["attributes"]["POSITION"] = accessor++;
    for (const VertexColumn& column : columns()) out["attributes"][column.name] = accessor++;
    if (header_.triangles > 0) out["indices"] = accessor;
    out["mode"] = header_.triangles > 0 ? glb::kTriangles : glb::kPoints;
    out["material"] = 0;
    return out;
  }

  [[nodiscard]] Json accessors(const std::array<double, 3>& min,
                               const std::array<double, 3>& max) const {
    Json out = Json::array();
    out.push_back({{"bufferView", 0},
                   {"componentType", glb::kFloat},
                   {"count", header_.vertices},
                   {"type", "VEC3"},
                   {"min", min},
                   {"max", max}});
    for (const VertexColumn& column : columns()) {
      out.push_back({{"bufferView", 0},
                     {"byteOffset", column.offset},
                     {"componentType", glb::kFloat},
                     {"count", header_.vertices},
                     {"type", column.type}});
    }
    if (header_.triangles == 0) return out;
    out.push_back({{"bufferView", 1},
                   {"componentType", glb::kUnsignedInt},
                   {"count", header_.triangles * 3},
                   {"type", "SCALAR"}});
    return out;
  }

  /// Returns the vertices, then the corners of triangles.
  [[nodiscard]] Json buffer_views() const {
    const std::uint64_t vertex_bytes = header_.vertices * stride_;
    Json out = Json::array();
    out.push_back({{"buffer", 0},
                   {"byteLength", vertex_bytes},
                   {"byteStride", stride_},
                   {"target", glb::kArrayBuffer}});
    if (header_.triangles == 0) return out;
    out.push_back({{"buffer", 0},
                   {"byteOffset", vertex_bytes},
                   {"byteLength", header_.triangles * 12},
                   {"target", glb::kElementArrayBuffer}});
    return out;
  }

  /// The JSON as text. Names of reference systems may have bytes that are not UTF-8.
  static std::string text_of(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

  void flush_if_full() {
    if (piece_.size() >= kGlbPieceBytes) flush();
  }
  void flush() {
    sink_->write(piece_);
    piece_.clear();
  }

  MeshHeader header_;
  MeshFrame frame_;
  MeshCounts counts_;
  std::optional<std::size_t> normals_;  ///< index of nx
  std::size_t stride_;
  std::optional<Sink> sink_;
  Point3 origin_{};
  bool origin_known_ = false;
  std::array<float, 3> min_{kInfinity, kInfinity, kInfinity};
  std::array<float, 3> max_{-kInfinity, -kInfinity, -kInfinity};
  std::size_t json_bytes_ = 0;
  std::string piece_;

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
};

}  // namespace

Point3 glb_origin(const Box3& bounds) {
  Point3 origin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    origin[axis] = bounds.min[axis] * 0.5 + bounds.max[axis] * 0.5;
  }
  return origin;
}

float glb_coordinate(double coordinate, double origin, double metres) {
  return static_cast<float>((coordinate - origin) * metres);
}

std::unique_ptr<MeshWriter> open_glb_writer(const std::string& path, const MeshHeader& header,
                                            const WriterOptions& options) {
  return std::make_unique<GlbWriter>(path, header, options);
}

}  // namespace terrace::stream
