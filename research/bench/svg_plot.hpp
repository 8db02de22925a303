// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

/// Makes line and scatter plots as SVG text.

namespace terrace::research {

struct Series {
  enum class Mark { line, dashes, dots };
  std::string name;  ///< in the legend; empty: not listed
  std::vector<double> x = {}, y = {};
  Mark mark = Mark::line;
  double size = 1.6;        ///< stroke width of lines, radius of dots, in pixels
  std::string colour = {};  ///< empty: the next colour of the palette
};

struct Axis {
  std::string label;
  bool log = false;
  std::optional<double> low = {}, high = {};  ///< if not set, determined from the data
};

struct Plot {
  std::string title;
  Axis x, y;
  std::vector<Series> series = {};
  bool legend_left = false;   ///< in the upper left corner instead of the right one
  bool equal_scales = false;  ///< a unit of x is as long as a unit of y
};

/// Returns a plot as SVG text. On a logarithmic axis, values that are not positive break lines. A
/// plot without data shows only its frame.
[[nodiscard]] std::string svg(const Plot& plot);

}  // namespace terrace::research
