// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>

#include <terrace/stream/source.hpp>

#include "base/units.hpp"

namespace terrace::terrain {

/// Counts heights that no place has, such as -3.4e38: they are values for no data that their file
/// does not declare. They are kept, and a note says so.
class UndeclaredVoids {
 public:
  /// info: of the source, which must outlive this.
  explicit UndeclaredVoids(const stream::SourceInfo& info) : info_(info) {}

  /// Heights of a block in stored coordinates. May be called by several threads.
  void add(const stream::PointBlock& block) {
    const double scale = info_.coordinates[2].scale, offset = info_.coordinates[2].offset;
    std::uint64_t count = 0;
    double value = 0;
    for (const stream::Point3& point : block.positions) {
      const double height = point[2] * scale + offset;
      if (std::abs(height) <= kMost) continue;
      ++count;
      value = point[2];
    }
    if (count == 0) return;
    count_ += count;
    value_ = value;
  }

  /// Empty if there are none.
  [[nodiscard]] std::string note() const {
    if (count_ == 0) return {};
    const std::string value = plain_number(value_);
    const std::string file = info_.files.size() == 1 ? info_.files.front() : "FILE";
    std::string remedy;
    if (!info_.grid) {
      remedy =
          std::string("leave them out: `where` ") + (value_ < 0 ? "'z > -1e30'" : "'z < 1e30'");
    } else if (info_.format == "ascii-grid" || info_.format == "binary-grid") {
      remedy = "declare the value in the header: NODATA_value " + value;
    } else {
      remedy = "declare the value: gdal_edit.py -a_nodata " + value + " " + file;
    }
    return (info_.files.size() == 1 ? file + ": " : std::string()) +
           counted(count_, info_.grid ? "cell" : "point", "has a height", "have heights") +
           " beyond 1e30, such as " + value + (count_ == 1 ? ", and is" : ", and are") +
           " kept; if these mean no data, " + remedy;
  }

 private:
  static constexpr double kMost = 1e30;

  const stream::SourceInfo& info_;
  std::atomic<std::uint64_t> count_ = 0;
  std::atomic<double> value_ = 0;
};

}  // namespace terrace::terrain
