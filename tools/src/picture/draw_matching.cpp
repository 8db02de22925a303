// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "base/parallel.hpp"
#include "cli/interrupt.hpp"
#include "picture/draw.hpp"
#include "tables/matching_result.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

using Colour = std::array<float, 3>;

constexpr Colour kPaper{1.0F, 1.0F, 1.0F}, kDot{0.13F, 0.15F, 0.2F};

/// Draws shapes whose edges fade over one sample, within a rectangle of samples.
class Brush {
 public:
  Brush(Canvas& canvas, std::uint32_t first_row, std::uint32_t last_row)
      : canvas_(canvas), first_(first_row), last_(last_row) {}

  /// Paints all samples within `radius` of the line from a to b (in samples from the left and the
  /// top).
  void stroke(const std::array<double, 3>& a, const std::array<double, 3>& b, double radius,
              const Colour& colour) {
    const double reach = radius + 0.5;
    const double dx = b[0] - a[0], dy = b[1] - a[1], square = dx * dx + dy * dy;
    // Skip NaN and positions far outside the picture.
    if (!(square < 1e18 && std::abs(a[0]) + std::abs(a[1]) < 1e9)) return;
    const double top = std::max(std::floor(std::min(a[1], b[1]) - reach), double{0.0} + first_);
    const double bottom = std::min(std::ceil(std::max(a[1], b[1]) + reach), double{0.0} + last_);
    for (double y = top; y < bottom; ++y) {
      check_interrupt();
      // Examine only the part of the line near this row.
      double from = 0, to = 1;
      if (dy != 0) {
        const double s = (y + 0.5 - reach - a[1]) / dy, t = (y + 0.5 + reach - a[1]) / dy;
        from = std::clamp(std::min(s, t), 0.0, 1.0);
        to = std::clamp(std::max(s, t), 0.0, 1.0);
      }
      const double x0 = a[0] + from * dx, x1 = a[0] + to * dx;
      const double left = std::max(std::floor(std::min(x0, x1) - reach), 0.0);
      const double right =
          std::min(std::ceil(std::max(x0, x1) + reach), double{0.0} + canvas_.width());
      for (double x = left; x < right; ++x) {
        const double px = x + 0.5 - a[0], py = y + 0.5 - a[1];
        const double along = square > 0 ? std::clamp((px * dx + py * dy) / square, 0.0, 1.0) : 0.0;
        const double ex = px - along * dx, ey = py - along * dy;
        blend(x, y, reach - std::sqrt(ex * ex + ey * ey), colour);
      }
    }
  }
  /// Paints a disc.
  void dot(const std::array<double, 3>& centre, double radius, const Colour& colour) {
    stroke(centre, centre, radius, colour);
  }

 private:
  /// Mixes `colour` into a sample by the covered share of its area.
  void blend(double x, double y, double coverage, const Colour& colour) {
    if (coverage <= 0) return;
    Colour& sample = canvas_.colour(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    const auto share = static_cast<float>(std::min(coverage, 1.0));
    for (std::size_t c = 0; c < 3; ++c) sample[c] += share * (colour[c] - sample[c]);
  }

  Canvas& canvas_;
  std::uint32_t first_, last_;
};

void fill_with_paper(Canvas& canvas, std::uint32_t first_row, std::uint32_t last_row) {
  for (std::uint32_t y = first_row; y < last_row; ++y) {
    check_interrupt();
    for (std::uint32_t x = 0; x < canvas.width(); ++x) canvas.colour(x, y) = kPaper;
  }
}

/// Returns Camera::project() of each position.
std::vector<std::array<double, 3>> project_all(const std::vector<stream::Point3>& positions,
                                               const Camera& camera) {
  std::vector<std::array<double, 3>> projected;
  projected.reserve(positions.size());
  for (const stream::Point3& p : positions) {
    check_interrupt();
    projected.push_back(camera.project(p));
  }
  return projected;
}

/// Returns the colour of a level: red at the bottom, black at the top.
Colour level_colour(std::uint32_t level, std::uint32_t top) {
  const float share = top > 1 ? static_cast<float>(level - 1) / static_cast<float>(top - 1) : 0.0F;
  const float light = 1.0F - share;
  return {0.87F * light, 0.11F * light * light, 0.10F * light * light};
}

/// Returns half the width of a line, which is `lowest` for level 1. Higher levels have fewer lines
/// and room for wider ones: distances grow by a factor of sqrt(2) per level.
double half_width_of_level(std::uint32_t level, double lowest) {
  const double highest = std::max(4.6, 1.8 * lowest);
  double width = lowest;
  while (--level > 0 && width < highest) width *= 1.2;
  return std::min(width, highest);
}

/// Returns the indices of the lines in drawing order, with higher levels first or last.
std::vector<std::uint32_t> drawing_order(const std::vector<MatchingLine>& lines,
                                         bool higher_first) {
  std::vector<std::uint32_t> order(lines.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    check_interrupt();
    return higher_first ? lines[i].level > lines[j].level : lines[i].level < lines[j].level;
  });
  return order;
}

/// Returns the typical distance between neighbours in samples: the median length of pairs, or the
/// spacing of evenly spread points if that is less.
double typical_spacing(const std::vector<MatchingLine>& lines,
                       const std::vector<std::array<double, 3>>& projected, std::size_t points,
                       const Canvas& canvas) {
  std::vector<double> lengths;
  for (const MatchingLine& line : lines) {
    check_interrupt();
    const auto &a = projected[line.a], &b = projected[line.b];
    const double length = base::hypot(a[0] - b[0], a[1] - b[1]);
    if (line.level == 1 && std::isfinite(length)) lengths.push_back(length);
  }
  double spacing = 0.4 * std::sqrt(static_cast<double>(canvas.width()) * canvas.height() /
                                   static_cast<double>(std::max<std::size_t>(points, 1)));
  if (!lengths.empty()) {
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    spacing = std::min(spacing, *middle);
  }
  return spacing;
}

}  // namespace

void draw_lines(const std::vector<stream::Point3>& positions,
                const std::vector<LineSet::Line>& lines, const std::vector<Rgb>& colours,
                const Camera& camera, const DrawOptions& options, Canvas& canvas) {
  constexpr double kRadius = 1.0;
  const std::vector<std::array<double, 3>> projected = project_all(positions, camera);
  parallel_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    fill_with_paper(canvas, first, last);
    Brush brush(canvas, first, last);
    for (const LineSet::Line& line : lines) {
      check_interrupt();
      for (std::size_t i = line.begin; i + 1 < line.end; ++i) {
        check_interrupt();
        Colour colour = kDot;
        for (std::size_t c = 0; c < 3 && !colours.empty(); ++c) {
          colour[c] = static_cast<float>(colours[i][c]) / 255.0F;
        }
        brush.stroke(projected[i], projected[i + 1], kRadius, colour);
      }
    }
  });
}

void draw_matching(const MatchingPicture& picture, const Camera& camera, const DrawOptions& options,
                   Canvas& canvas) {
  const std::vector<MatchingLine>& lines = picture.result.lines;
  const std::size_t points = picture.result.points;
  const std::vector<std::array<double, 3>> projected = project_all(picture.positions, camera);
  std::vector<bool> matched(points, false);
  for (const MatchingLine& line : lines) {
    check_interrupt();
    if (line.a < points) matched[line.a] = true;
    if (line.b < points) matched[line.b] = true;
  }
  const double spacing = typical_spacing(lines, projected, points, canvas);
  // Pairs do not overlap, so they may be wider than the lowest lines of a crowded tree.
  const double half_width = std::clamp(0.055 * spacing, picture.result.top > 1 ? 0.75 : 1.0, 4.0);
  // In a crowded picture, dots would hide the lines, and small lines the large ones.
  const bool crowded = spacing < 14;
  const std::vector<std::uint32_t> order = drawing_order(lines, !crowded);
  const double dot = std::max(2.1 * half_width, 1.5);

  parallel_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    fill_with_paper(canvas, first, last);
    Brush brush(canvas, first, last);
    for (const std::uint32_t i : order) {
      check_interrupt();
      const MatchingLine& line = lines[i];
      const double radius = half_width_of_level(line.level, half_width);
      const Colour colour = level_colour(line.level, picture.result.top);
      brush.stroke(projected[line.a], projected[line.b], radius, colour);
      for (const std::uint32_t node : {line.a, line.b}) {
        if (node >= points) brush.dot(projected[node], 1.6 * radius, colour);
      }
    }
    for (std::size_t i = 0; i < points; ++i) {
      check_interrupt();
      if (matched[i] && crowded) continue;
      brush.dot(projected[i], dot, kDot);
      if (!matched[i] && !lines.empty()) brush.dot(projected[i], 0.55 * dot, kPaper);
    }
  });
}

}  // namespace terrace::tools
