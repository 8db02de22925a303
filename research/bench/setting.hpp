// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "report.hpp"

/// The tables and figures of the thesis that thesis_bench.cpp repeats. Each is in the file of its
/// name, reports its results, and throws std::runtime_error if a result is invalid.

namespace terrace::research {

/// The size of the runs, and the report of their results.
struct Setting {
  enum class Size { small, standard, full };  ///< small: as a test, in a second or two
  Size size;
  unsigned threads;  ///< used where the thesis used four; does not change results
  Report& report;

  [[nodiscard]] bool is_small() const { return size == Size::small; }
  [[nodiscard]] bool is_full() const { return size == Size::full; }
  /// Returns the number of points that a set of the thesis has here.
  [[nodiscard]] std::uint64_t points(std::uint64_t thesis_size) const {
    if (is_full()) return thesis_size;
    return std::min<std::uint64_t>(thesis_size, is_small() ? 3000 : 1'000'000);
  }
  /// Returns the number of points that a block of the thesis has here.
  [[nodiscard]] std::size_t block(std::size_t thesis_size) const {
    return is_small() ? thesis_size / 25 : thesis_size;
  }
};

void table_7_1(Setting& setting);    ///< block size: time, memory, clusters
void table_7_4(Setting& setting);    ///< where the plain search spends its time
void table_7_5(Setting& setting);    ///< the short search compared with the long one
void table_7_6(Setting& setting);    ///< space partitioning
void table_7_7(Setting& setting);    ///< threads
void table_7_8(Setting& setting);    ///< complete linkage on CPU and GPU
void table_8_1(Setting& setting);    ///< removal of clusters from a triangulation
void section_8_2(Setting& setting);  ///< removal in space by ears
void figure_7_5(Setting& setting);   ///< order of the stream
void figure_7_6(Setting& setting);   ///< memory as a function of block size
void figure_7_12(Setting& setting);  ///< wrongly assigned points
void figure_7_13(Setting& setting);  ///< share of positive gains
void figure_7_14(Setting& setting);  ///< share of vertices inspected
void figure_7_21(Setting& setting);  ///< time of an assignment
void figure_7_22(Setting& setting);  ///< costs of the first iterations of the Monte Carlo matching
void figure_7_23(Setting& setting);  ///< its least cost over the iterations
void figure_7_24(Setting& setting);  ///< how much each new least cost is below the one before

}  // namespace terrace::research
