// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "report.hpp"

namespace terrace::cluster::thesis {

/// One pass over the scan that stands in for Lucy, with m ceil(log10 m) candidates per block and
/// the partition by facilities.
struct BlockSizeRun {
  std::size_t block = 0;
  double seconds = 0.0;
  std::size_t peak_bytes = 0;
  std::vector<std::uint64_t> level_points = {};
  std::vector<double> costs = {};  ///< costs of the blocks of level 0
};

/// How large to run, and where to report the results.
struct Setting {
  enum class Size { small, standard, full };  ///< small: as a test, in a second or two
  Size size;
  unsigned threads;  ///< used where the thesis used four
  Report& report;
  std::vector<BlockSizeRun> block_size_runs = {};  ///< see block_size_runs()

  [[nodiscard]] bool is_small() const { return size == Size::small; }
  /// Returns the number of points that a set of the thesis has here.
  [[nodiscard]] std::uint64_t points(std::uint64_t of_thesis) const {
    if (size == Size::full) return of_thesis;
    return std::min<std::uint64_t>(of_thesis, is_small() ? 3000 : 1'000'000);
  }
  [[nodiscard]] std::size_t block(std::size_t of_thesis) const {
    return is_small() ? of_thesis / 25 : of_thesis;
  }
};

/// Returns the runs for the six block sizes of tables 7.1 and 7.5, which share them. Computed on
/// first use.
const std::vector<BlockSizeRun>& block_size_runs(Setting& setting);

}  // namespace terrace::cluster::thesis
