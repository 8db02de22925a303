// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// The keys and values of an Esri grid's header, which may be a separate file. Keys are in lower
/// case.
class GridHeader {
 public:
  /// file: for messages.
  explicit GridHeader(std::string file) : file_(std::move(file)) {}

  /// Sets the value of a key, unless it already has one.
  void set(std::string_view key, std::string_view value);

  [[nodiscard]] bool has(const std::string& key) const { return values_.contains(key); }
  /// Empty if there is none.
  [[nodiscard]] std::string text(const std::string& key) const;
  /// Accepts a comma as decimal point. Throws: Error if the value is not a finite number.
  [[nodiscard]] std::optional<double> number(const std::string& key) const;
  /// Throws: Error if the value is not an integer below 2^53, or if it is missing and there is no
  /// `otherwise`.
  [[nodiscard]] std::uint64_t count(const std::string& key,
                                    std::optional<std::uint64_t> otherwise = {}) const;
  /// Returns the transform to the centres of cells, from the lower left corner (xllcorner), the
  /// lower left cell (xllcenter) or the upper left cell (ulxmap). Without any of these it is
  /// kPlainWorld, which is added to the comments. Throws: Error if only x or only y is given, or if
  /// the cell size is not positive.
  [[nodiscard]] WorldTransform world(std::uint64_t rows, std::vector<std::string>& comments) const;

  [[nodiscard]] Error fault(std::string cause) const;

 private:
  std::string file_;
  std::map<std::string, std::string> values_;
};

}  // namespace terrace::stream
