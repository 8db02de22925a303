// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <cstddef>
#include <optional>
#include <string>

#include "format/writers.hpp"
#include "io/number.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kObjTextBytes = 64u << 10;

/// Writes Wavefront OBJ: "v x y z" per vertex, "f a b c" per triangle, vertices counted from 1.
/// With normals "vn x y z" follows each vertex, and a corner is "a//a".
class ObjWriter final : public MeshWriter {
 public:
  ObjWriter(const std::string& path, const MeshHeader& header, const WriterOptions& options)
      : sink_(path, options.replace, options.stop),
        counts_(header),
        attributes_(header.attributes.size()),
        normals_(normals_in(header.attributes)) {
    for (const std::string& comment : header.comments) {
      text_ += "# ";
      for (const char c : comment) text_ += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
      text_ += '\n';
    }
    flush();
  }

  void add_vertices(std::span<const Point3> positions, std::span<const float> attributes) override {
    counts_.add_vertices(positions, attributes);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      text_ += 'v';
      for (const double value : positions[i]) {
        text_ += ' ';
        append_number(text_, value);
      }
      end_line();
      if (!normals_) continue;
      text_ += "vn";
      for (const float value : attributes.subspan(i * attributes_ + *normals_, 3)) {
        text_ += ' ';
        append_number(text_, value);
      }
      end_line();
    }
    flush();
  }

  void add_triangles(std::span<const TriangleIndices> triangles) override {
    counts_.add_triangles(triangles);
    for (const TriangleIndices& triangle : triangles) {
      text_ += 'f';
      for (const std::uint32_t index : triangle) {
        text_ += ' ';
        append_number(text_, std::uint64_t{index} + 1);
        if (!normals_) continue;
        text_ += "//";
        append_number(text_, std::uint64_t{index} + 1);
      }
      end_line();
    }
    flush();
  }

  void finish() override {
    assert(counts_.complete());
    sink_.commit();
  }

 private:
  void end_line() {
    text_ += '\n';
    if (text_.size() >= kObjTextBytes) flush();
  }
  void flush() {
    sink_.write(text_);
    text_.clear();
  }

  Sink sink_;
  MeshCounts counts_;
  std::size_t attributes_;
  std::optional<std::size_t> normals_;  ///< index of nx
  std::string text_;
};

}  // namespace

std::unique_ptr<MeshWriter> open_obj_writer(const std::string& path, const MeshHeader& header,
                                            const WriterOptions& options) {
  return std::make_unique<ObjWriter>(path, header, options);
}

}  // namespace terrace::stream
