// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "terrace/matching/halving.hpp"
#include "terrace/matching/point.hpp"

/// The figures of section 7.5.2 of the thesis, each as a CSV file and a few lines on stdout.

namespace terrace::matching::thesis {

/// One search shown in figures 7.23 and 7.24.
struct SearchRun {
  std::string set;  ///< "100a"
  std::size_t points = 0;
  std::uint64_t iterations = 0;
  double optimum = 0.0;
  HalvingMatching monte_carlo, monotone;

  /// Returns how many per cent the cost is above the optimum after this many iterations.
  [[nodiscard]] double gap_after(std::uint64_t iterations_done, const HalvingMatching& of) const;
};

/// How large to run, and where to write the results.
struct Setting {
  enum class Size { small, standard, full };  ///< small: as a test, in a second or two
  Size size = Size::standard;
  unsigned threads = 1;
  std::optional<std::filesystem::path> out =
      {};                            ///< an existing folder; nullopt: no files, stdout only
  std::vector<SearchRun> runs = {};  ///< see search_runs()

  [[nodiscard]] bool is_small() const { return size == Size::small; }
};

/// A table written row by row. Numbers are written as the shortest decimals that round-trip.
class Csv {
 public:
  using Cell = std::variant<std::string, std::uint64_t, double>;

  /// Writes nothing if the setting has no output folder.
  Csv(const Setting& setting, const std::string& name, const std::string& header);
  void row(std::initializer_list<Cell> cells);
  /// Throws: std::runtime_error if the file could not be written.
  void close();

 private:
  std::filesystem::path path_;
  std::ofstream out_;
};

/// Returns uniform random points in the unit square, with z = 0.
std::vector<Point3> uniform_points(std::size_t count, std::uint64_t seed);
/// Returns the processor, the number of cores and the compiler.
std::string machine();
/// Formats a number with this many decimals: fixed(12.3456, 2) is "12.35".
std::string fixed(double value, int digits);

/// Measures the running time of the assignment against n.
void figure_7_21(Setting& setting);
/// Records the cost of each of the first 100 iterations of the Monte Carlo method.
void figure_7_22(Setting& setting);
/// Records the least cost so far against iterations.
void figure_7_23(Setting& setting);
/// Records by how many per cent each new least cost is below the previous one.
void figure_7_24(Setting& setting);

}  // namespace terrace::matching::thesis
