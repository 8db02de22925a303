// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The keys and values of an Esri grid's header, which may be a separate file. Keys are in lower
/// case.
class GridHeader {
 public:
  /// file: named in errors.
  explicit GridHeader(std::string file) : file_(std::move(file)) {}

  /// Sets the value of a key, unless it already has one.
  void set(std::string_view key, std::string_view value);

  [[nodiscard]] bool has(const std::string& key) const { return values_.contains(key); }
  /// Returns the value, or an empty string if the key is missing.
  [[nodiscard]] std::string text(const std::string& key) const;
  /// Returns the value as a number, or nullopt if the key is missing. Accepts a comma as decimal
  /// point. Throws: Error if the value is not a finite number.
  [[nodiscard]] std::optional<double> number(const std::string& key) const;
  /// Returns the value as an integer, or `default_value` if the key is missing. Throws: Error if
  /// the value is not an integer below 2^53, or if it is missing and there is no default.
  [[nodiscard]] std::uint64_t count(const std::string& key,
                                    std::optional<std::uint64_t> default_value = {}) const;
  /// Returns the transform to the centres of cells, from the lower left corner (xllcorner,
  /// yllcorner), the lower left cell (xllcenter, yllcenter) or the upper left cell (ulxmap,
  /// ulymap), and from the cell size (xdim and ydim, dx and dy, or cellsize). Without a position,
  /// returns kPlainWorld and adds kNoGeoreferencing to `comments`. Throws: Error if only x or only
  /// y is given, or if the cell size is not positive.
  [[nodiscard]] WorldTransform world(std::uint64_t rows, std::vector<std::string>& comments) const;

  /// Returns an error about this header, with its remedy.
  [[nodiscard]] Error fault(std::string cause) const;

 private:
  std::string file_;
  std::map<std::string, std::string> values_;
};

}  // namespace terrace::stream
