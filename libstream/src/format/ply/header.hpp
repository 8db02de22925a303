// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

enum class PlyEncoding { ascii, little_endian, big_endian };

/// A property of an element: a value or a list of values.
struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::f32;  ///< type of the value, or of a list's items
  bool list = false;
  ScalarType count_type = ScalarType::u8;  ///< type of a list's length
};

/// An element, such as "vertex": items with the same properties.
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  [[nodiscard]] bool has_lists() const;
  /// Bytes of one item in a binary file, with empty lists.
  [[nodiscard]] std::size_t binary_bytes() const;
};

/// The header of a PLY file.
struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;
  std::uint64_t lines = 0;  ///< number of lines of the header
};

/// Reads the header and leaves `input` at the first byte after it. Throws: Error with the line if
/// it is not PLY 1.0, and if the elements promise more items than the rest of a regular file can
/// hold.
PlyHeader read_ply_header(Input& input);

/// Returns the name of a type in the header of a PLY file: the old names, which every reader
/// supports. PLY has no names for 64-bit integers; we write "int64" and "uint64".
std::string ply_type_name(ScalarType type);

/// "ply", the format and the comments: the first lines of a header.
std::string ply_preamble(bool ascii, std::span<const std::string> comments);

}  // namespace terrace::stream
