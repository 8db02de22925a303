// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The attributes of a stream as columns of an output file.
class OutputColumns {
 public:
  explicit OutputColumns(std::span<const Channel> attributes);

  [[nodiscard]] std::size_t size() const { return columns_.size(); }
  /// Returns the type in the file: the attribute's type, or float64 if it has a scale or offset.
  [[nodiscard]] ScalarType type(std::size_t column) const { return columns_[column].file_type; }
  /// Returns a name suitable for a header: unique, not empty, without spaces or control characters,
  /// and not x, y or z in lower or upper case.
  [[nodiscard]] const std::string& name(std::size_t column) const { return columns_[column].name; }

  /// Asserts that the payload has the size of these columns.
  void assert_matches(const PointBlock& block) const;
  /// Appends the values of point `i` as text, `separator` before each.
  void append_text(std::string& out, const PointBlock& block, std::size_t i, char separator) const;
  /// Returns the number of bytes that put_bytes() writes.
  [[nodiscard]] std::size_t written_bytes() const { return file_bytes_; }
  /// Writes the values of point `i` to `at` as little-endian bytes. Returns the position after
  /// them.
  char* put_bytes(char* at, const PointBlock& block, std::size_t i) const;

 private:
  struct OutputColumn {
    std::string name;
    ScalarType stored_type, file_type;
    double scale, offset;
    bool is_scaled;  ///< whether scale and offset are applied
  };
  std::vector<OutputColumn> columns_;
  std::size_t stored_bytes_ = 0, file_bytes_ = 0;
};

}  // namespace terrace::stream
