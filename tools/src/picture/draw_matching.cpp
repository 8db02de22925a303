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
    // Skip NaN and places far outside the picture.
    if (!(square < 1e18 && std::abs(a[0]) + std::abs(a[1]) < 1e9)) return;
    const double top = std::max(std::floor(std::min(a[1], b[1]) - reach), double{0.0} + first_);
    const double bottom = std::min(std::ceil(std::max(a[1], b[1]) + reach), double{0.0} + last_);
    for (double y = top; y < bottom; ++y) {
      check_interrupt();
      // The part of the line near this row.
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
  void dot(const std::array<double, 3>& centre, double radius, const Colour& colour) {
    stroke(centre, centre, radius, colour);
  }

 private:
  void blend(double x, double y, double cover, const Colour& colour) {
    if (cover <= 0) return;
    Colour& sample = canvas_.colour(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    const auto share = static_cast<float>(std::min(cover, 1.0));
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

/// Returns the colour of a level: red at the bottom, black at the top.
Colour level_colour(std::uint32_t level, std::uint32_t top) {
  const float share = top > 1 ? static_cast<float>(level - 1) / static_cast<float>(top - 1) : 0.0F;
  const float light = 1.0F - share;
  return {0.87F * light, 0.11F * light * light, 0.10F * light * light};
}

/// Returns half the width of a line. Higher levels have fewer lines and room for wider ones:
/// distances grow by a factor of sqrt(2) per level.
double width_of_level(std::uint32_t level, double thin) {
  const double thick = std::max(4.6, 1.8 * thin);
  double width = thin;
  while (--level > 0 && width < thick) width *= 1.2;
  return std::min(width, thick);
}

/// Returns the lines in drawing order, with higher levels first or last.
std::vector<std::uint32_t> by_level(const std::vector<MatchingLine>& lines, bool higher_first) {
  std::vector<std::uint32_t> order(lines.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    check_interrupt();
    return higher_first ? lines[i].level > lines[j].level : lines[i].level < lines[j].level;
  });
  return order;
}

/// Returns the usual distance between neighbours in samples: the median length of pairs, or the
/// spacing of evenly spread points if that is less.
double usual_distance(const std::vector<MatchingLine>& lines,
                      const std::vector<std::array<double, 3>>& places, std::size_t points,
                      const Canvas& canvas) {
  std::vector<double> lengths;
  for (const MatchingLine& line : lines) {
    check_interrupt();
    const auto &a = places[line.a], &b = places[line.b];
    const double length = base::hypot(a[0] - b[0], a[1] - b[1]);
    if (line.level == 1 && std::isfinite(length)) lengths.push_back(length);
  }
  double usual = 0.4 * std::sqrt(static_cast<double>(canvas.width()) * canvas.height() /
                                 static_cast<double>(std::max<std::size_t>(points, 1)));
  if (!lengths.empty()) {
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    usual = std::min(usual, *middle);
  }
  return usual;
}

}  // namespace

void draw_lines(const std::vector<stream::Point3>& positions,
                const std::vector<LineSet::Line>& lines, const std::vector<Rgb>& colours,
                const Camera& camera, const DrawOptions& options, Canvas& canvas) {
  constexpr double kRadius = 1.0;
  std::vector<std::array<double, 3>> places;
  places.reserve(positions.size());
  for (const stream::Point3& p : positions) {
    check_interrupt();
    places.push_back(camera.project(p));
  }
  for_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
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
        brush.stroke(places[i], places[i + 1], kRadius, colour);
      }
    }
  });
}

void draw_matching(const MatchingPicture& picture, const Camera& camera, const DrawOptions& options,
                   Canvas& canvas) {
  const std::vector<MatchingLine>& lines = picture.result.lines;
  const std::size_t points = picture.result.points;
  std::vector<std::array<double, 3>> places;
  places.reserve(picture.positions.size());
  for (const stream::Point3& p : picture.positions) {
    check_interrupt();
    places.push_back(camera.project(p));
  }
  std::vector<bool> reached(points, false);
  for (const MatchingLine& line : lines) {
    check_interrupt();
    if (line.a < points) reached[line.a] = true;
    if (line.b < points) reached[line.b] = true;
  }
  const double usual = usual_distance(lines, places, points, canvas);
  // Pairs do not overlap; the lowest lines of a crowded tree leave room for the others.
  const double thin = std::clamp(0.055 * usual, picture.result.top > 1 ? 0.75 : 1.0, 4.0);
  // In a crowded picture, dots would hide the lines, and small lines the large ones.
  const bool crowded = usual < 14;
  const std::vector<std::uint32_t> order = by_level(lines, !crowded);
  const double dot = std::max(2.1 * thin, 1.5);

  for_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    fill_with_paper(canvas, first, last);
    Brush brush(canvas, first, last);
    for (const std::uint32_t i : order) {
      check_interrupt();
      const MatchingLine& line = lines[i];
      const double radius = width_of_level(line.level, thin);
      const Colour colour = level_colour(line.level, picture.result.top);
      brush.stroke(places[line.a], places[line.b], radius, colour);
      for (const std::uint32_t node : {line.a, line.b}) {
        if (node >= points) brush.dot(places[node], 1.6 * radius, colour);
      }
    }
    for (std::size_t i = 0; i < points; ++i) {
      check_interrupt();
      if (reached[i] && crowded) continue;
      brush.dot(places[i], dot, kDot);
      if (!reached[i] && !lines.empty()) brush.dot(places[i], 0.55 * dot, kPaper);
    }
  });
}

}  // namespace terrace::tools
