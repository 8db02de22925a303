// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The attributes of a stream being written to a file.
class OutputColumns {
 public:
  explicit OutputColumns(std::span<const Channel> attributes);

  [[nodiscard]] std::size_t size() const { return columns_.size(); }
  /// Returns the type in the file: the column's own, or float64 if real values are written.
  [[nodiscard]] ScalarType type(std::size_t column) const { return columns_[column].written; }
  /// Returns a name suitable for a header: unique, not empty, not x, y or z in either case, without
  /// blanks and control characters.
  [[nodiscard]] const std::string& name(std::size_t column) const { return columns_[column].name; }

  /// Asserts that the block has records of these columns.
  void check(const PointBlock& block) const;
  /// Appends the values of point `i` as text, `separator` before each.
  void append_text(std::string& out, const PointBlock& block, std::size_t i, char separator) const;
  /// Returns the number of bytes that put_bytes() writes.
  [[nodiscard]] std::size_t written_bytes() const { return written_bytes_; }
  /// Writes the values of point `i` to `at` as little-endian bytes; returns their end.
  char* put_bytes(char* at, const PointBlock& block, std::size_t i) const;

 private:
  struct OutputColumn {
    std::string name;
    ScalarType stored, written;
    double scale, offset;
    bool real;  ///< whether scale and offset are applied
  };
  std::vector<OutputColumn> columns_;
  std::size_t record_bytes_ = 0, written_bytes_ = 0;
};

}  // namespace terrace::stream
