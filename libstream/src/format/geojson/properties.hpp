// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "format/geojson/geometry.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The numeric properties of features as columns of doubles. The columns are known before the first
/// entity: they are the properties that occur in the head of the file. One that occurs only later
/// is an error, unless the selection names it.
class PropertyColumns {
 public:
  PropertyColumns() = default;
  /// numbers_lines: see GeoJsonItems.
  PropertyColumns(std::string file, const SourceOptions& options, bool numbers_lines);

  /// Adds the properties of a feature in the head. Throws: Error if there are more than 256.
  void add(std::span<const GeoJsonProperty> properties);
  void add(const std::string& name);
  /// Ends the head. complete: it is the whole file. shape: the other columns, whose names
  /// properties cannot have. Returns the channels of the properties: an equal name gets a number.
  std::vector<Channel> finish(bool complete, std::span<const Channel> shape);

  /// The names in the file, in the order of their columns.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Replaces `values` by those of a feature, NaN where it has none. Returns how many it has not.
  /// offset: of the feature, for messages. Throws: Error for a number without a column.
  std::size_t read(std::span<const GeoJsonProperty> properties, std::uint64_t offset,
                   std::vector<double>& values) const;

 private:
  [[nodiscard]] bool is_ignored(const std::string& name) const;

  std::string file_;
  Entities entities_ = Entities::points;
  Selection selection_;
  bool numbers_lines_ = false;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t, std::less<>> columns_;
};

}  // namespace terrace::stream
