// SPDX-License-Identifier: Apache-2.0
#include <cassert>
#include <limits>
#include <string>

#include <fmt/core.h>

#include "format/output_columns.hpp"
#include "format/ply/header.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMeshPieceBytes = 64u << 10;

std::vector<Channel> float_channels(const std::vector<std::string>& names) {
  std::vector<Channel> channels;
  channels.reserve(names.size());
  for (const std::string& name : names) {
    channels.push_back({.name = name, .type = ScalarType::f32});
  }
  return channels;
}

/// Writes a mesh as PLY, binary or ASCII.
class PlyMeshWriter final : public MeshWriter {
 public:
  PlyMeshWriter(const std::string& path, const MeshHeader& header, const WriterOptions& options,
                bool ascii)
      : sink_(path, options.replace, options.stop),
        counts_(header),
        attributes_(header.attributes.size()),
        ascii_(ascii) {
    std::string text = ply_preamble(ascii, header.comments);
    text +=
        fmt::format("element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
                    header.vertices);
    const OutputColumns columns(float_channels(header.attributes));
    for (std::size_t i = 0; i < columns.size(); ++i) {
      text += "property float " + columns.name(i) + "\n";
    }
    // Most programs expect signed indices, so those are written wherever they suffice.
    const bool fits = header.vertices <= std::numeric_limits<std::int32_t>::max();
    text += fmt::format("element face {}\nproperty list uchar {} vertex_indices\nend_header\n",
                        header.triangles, fits ? "int" : "uint");
    sink_.write(text);
  }

  void add_vertices(std::span<const Point3> positions, std::span<const float> attributes) override {
    counts_.add_vertices(positions, attributes);
    const float* values = attributes.data();
    for (const Point3& p : positions) {
      for (std::size_t axis = 0; axis < 3; ++axis) append(p[axis]);
      for (std::size_t i = 0; i < attributes_; ++i) append(*values++);
      end_row();
    }
    flush();
  }

  void add_triangles(std::span<const TriangleIndices> triangles) override {
    counts_.add_triangles(triangles);
    for (const TriangleIndices& triangle : triangles) {
      if (ascii_) {
        piece_ += "3 ";
      } else {
        piece_ += '\3';
      }
      for (const std::uint32_t index : triangle) append(index);
      end_row();
    }
    flush();
  }

  void finish() override {
    assert(counts_.complete());
    sink_.commit();
  }

 private:
  template <class T>
  void append(T value) {
    if (ascii_) {
      append_number(piece_, value);
      piece_ += ' ';
    } else {
      append_little_endian(piece_, value);
    }
  }
  void end_row() {
    if (ascii_) piece_.back() = '\n';
    if (piece_.size() >= kMeshPieceBytes) flush();
  }
  void flush() {
    sink_.write(piece_);
    piece_.clear();
  }

  Sink sink_;
  MeshCounts counts_;
  std::size_t attributes_;
  bool ascii_;
  std::string piece_;
};

}  // namespace

std::unique_ptr<MeshWriter> open_ply_mesh_writer(const std::string& path, const MeshHeader& header,
                                                 const WriterOptions& options) {
  return std::make_unique<PlyMeshWriter>(path, header, options, /*ascii=*/false);
}

std::unique_ptr<MeshWriter> open_ply_ascii_mesh_writer(const std::string& path,
                                                       const MeshHeader& header,
                                                       const WriterOptions& options) {
  return std::make_unique<PlyMeshWriter>(path, header, options, /*ascii=*/true);
}

}  // namespace terrace::stream
