// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>
#include <vector>

#include <terrace/cluster/dendrogram.hpp>

#include "cli/interrupt.hpp"
#include "picture/color.hpp"
#include "picture/draw.hpp"

namespace terrace::tools {
namespace {

using cluster::Dendrogram;
using cluster::Merge;

/// Returns the position of each point along the row of leaves, in leaf spacings. Uses a stack,
/// because a tree may be as deep as it is wide.
std::vector<double> leaf_positions(const Dendrogram& tree) {
  std::vector<double> place(tree.points, 0.0);
  const auto points = static_cast<std::uint32_t>(tree.points);
  std::vector<std::uint32_t> stack{
      static_cast<std::uint32_t>(tree.points + tree.merges.size() - 1)};
  double next = 0.5;
  while (!stack.empty()) {
    check_interrupt();
    const std::uint32_t node = stack.back();
    stack.pop_back();
    if (node < points) {
      place[node] = next;
      next += 1.0;
      continue;
    }
    const Merge& merge = tree.merges[node - points];
    stack.push_back(merge.b);
    stack.push_back(merge.a);
  }
  return place;
}

/// Returns the colour number of each merge: one per subtree below the threshold, -1 above it.
std::vector<std::int64_t> groups_below(const Dendrogram& tree, double threshold) {
  std::vector<std::int64_t> group(tree.merges.size(), -1);
  std::int64_t next = 0;
  const auto points = static_cast<std::uint32_t>(tree.points);
  for (std::size_t r = tree.merges.size(); r > 0; --r) {
    check_interrupt();
    const Merge& merge = tree.merges[r - 1];
    if (merge.height < threshold && group[r - 1] < 0) group[r - 1] = next++;
    for (const std::uint32_t child : {merge.a, merge.b}) {
      if (child >= points && group[r - 1] >= 0) group[child - points] = group[r - 1];
    }
  }
  return group;
}

/// Fills a rectangle of samples; its part outside the canvas moves to the border.
void fill(double x0, double y0, double x1, double y1, const Rgb& rgb, Canvas& canvas) {
  const auto left = static_cast<std::uint32_t>(std::clamp(x0, 0.0, canvas.width() - 1.0));
  const auto right = static_cast<std::uint32_t>(std::clamp(x1, 0.0, canvas.width() - 1.0));
  const auto top = static_cast<std::uint32_t>(std::clamp(y0, 0.0, canvas.height() - 1.0));
  const auto bottom = static_cast<std::uint32_t>(std::clamp(y1, 0.0, canvas.height() - 1.0));
  for (std::uint32_t y = top; y <= bottom; ++y) {
    for (std::uint32_t x = left; x <= right; ++x) {
      canvas.colour(x, y) = as_floats(rgb);
      canvas.depth(x, y) = 0.0F;
    }
  }
}

}  // namespace

void draw_dendrogram(const Dendrogram& tree, Canvas& canvas) {
  if (tree.merges.empty()) return;
  const double margin = 0.03 * std::min(canvas.width(), canvas.height());
  const double plot_width = canvas.width() - 2 * margin, plot_height = canvas.height() - 2 * margin;
  // Any merge may be the highest: an inversion is lower than its parts, even the last merge.
  double top = 0.0;
  for (const Merge& merge : tree.merges) top = std::max(top, merge.height);
  // The height is 0 if all points are equal.
  const double scale = top > 0 ? plot_height / top : 0.0;
  const double step = plot_width / static_cast<double>(tree.points);
  // A pixel has two samples across; crowded lines are one sample wide.
  const double half = step >= 8 ? 1.0 : 0.5;
  const auto row_of_height = [&](double height) {
    return canvas.height() - margin - scale * height;
  };

  const std::vector<double> leaf = leaf_positions(tree);
  // The same threshold as SciPy's.
  const std::vector<std::int64_t> group = groups_below(tree, 0.7 * top);
  std::vector<double> middle(tree.merges.size());
  const auto points = static_cast<std::uint32_t>(tree.points);
  for (std::size_t r = 0; r < tree.merges.size(); ++r) {
    check_interrupt();
    const Merge& merge = tree.merges[r];
    const Rgb colour = group[r] < 0 ? Rgb{60, 60, 65} : category_colour(group[r]);
    const auto place = [&](std::uint32_t node) {
      return node < points ? margin + step * leaf[node] : middle[node - points];
    };
    const auto height = [&](std::uint32_t node) {
      return node < points ? 0.0 : tree.merges[node - points].height;
    };
    const double a = place(merge.a), b = place(merge.b), y = row_of_height(merge.height);
    middle[r] = 0.5 * (a + b);
    for (const auto& [x, node] : {std::pair{a, merge.a}, std::pair{b, merge.b}}) {
      const double end = row_of_height(height(node));
      fill(x - half, std::min(y, end), x + half, std::max(y, end), colour, canvas);
    }
    fill(std::min(a, b) - half, y - half, std::max(a, b) + half, y + half, colour, canvas);
  }
}

}  // namespace terrace::tools
