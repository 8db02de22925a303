// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/input.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/schema.hpp"

/// Parsers that read meshes from front to back. GLB, OBJ, OFF and STL have one each, used by
/// read_mesh(), by the point source of vertices and by the triangle reader. PLY's, in
/// ply/source.cpp, serves only the triangle reader.

namespace terrace::stream {

/// Vertices and faces in the order of the file. Holds a line or a face, never the mesh.
class MeshParser {
 public:
  enum class Item : std::uint8_t { end, vertex, face };

  virtual ~MeshParser() = default;
  /// Returns the next item, to be read by vertex() or face(). Throws: Error naming file and
  /// position, Stopped.
  virtual Item next() = 0;

  /// Returns the current vertex; its coordinates are finite or NaN (see is_missing()).
  [[nodiscard]] const Point3& vertex() const { return vertex_; }
  /// Returns the current face: three or more indices, from 0, of vertices that have been read.
  [[nodiscard]] const std::vector<std::uint32_t>& face() const { return face_; }
  /// Returns the format's name in the registry.
  [[nodiscard]] virtual const char* format() const = 0;
  /// Returns the input, for its name and progress.
  [[nodiscard]] virtual const Input& input() const = 0;
  /// True if each face has its own vertices, so that coincident ones are merged (STL).
  [[nodiscard]] virtual bool is_soup() const { return false; }
  /// Returns the number of vertices, if the file states it before them.
  [[nodiscard]] virtual std::optional<std::uint64_t> stated_vertices() const {
    return std::nullopt;
  }
  /// Returns the type that coordinates have in the file; f64 for text and after transformations.
  [[nodiscard]] virtual ScalarType coordinate_type() const { return ScalarType::f64; }
  /// Returns the scalar properties of faces, with the names in the file.
  [[nodiscard]] virtual std::vector<Channel> face_properties() const { return {}; }
  /// Returns the properties of the current face, packed.
  [[nodiscard]] virtual std::span<const std::byte> face_record() const { return {}; }
  /// Returns the comments read so far.
  [[nodiscard]] const std::vector<std::string>& comments() const { return comments_; }

 protected:
  Point3 vertex_{};
  std::vector<std::uint32_t> face_;
  std::vector<std::string> comments_;
};

/// Reads the next coordinates of a line and moves past them; false unless there are three numbers,
/// none of them infinite.
bool read_vertex(std::string_view& text, Point3& vertex);

/// `input`: positioned at its first byte; must outlive the parser. `faces`: whether to parse faces.
/// The parser of GLB copies the binary chunk to a temporary file.
std::unique_ptr<MeshParser> glb_parser(Input& input, bool faces);
std::unique_ptr<MeshParser> obj_parser(Input& input, bool faces);
std::unique_ptr<MeshParser> off_parser(Input& input, bool faces);
std::unique_ptr<MeshParser> stl_parser(Input& input, bool faces);

/// See Format::recognise.
bool recognise_glb(std::span<const std::byte> head);
bool recognise_obj(std::span<const std::byte> head);
bool recognise_off(std::span<const std::byte> head);
/// Recognises only the text form: the binary one has no signature.
bool recognise_stl(std::span<const std::byte> head);

/// Like read_mesh() for PLY, whose vertices may have attributes.
std::optional<MeshFile> read_ply_mesh(const std::string& file, const SourceOptions& options);

}  // namespace terrace::stream
