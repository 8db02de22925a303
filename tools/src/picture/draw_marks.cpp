// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "base/portable_math.hpp"
#include "picture/draw.hpp"

namespace terrace::tools {
namespace {

/// Whether all of a disc is behind what has been drawn. One sample that is not will do: on a steep
/// slope most of the disc is.
bool is_hidden(Canvas& canvas, double cx, double cy, double radius, double depth) {
  const auto inside = [](double value, std::uint32_t size) {
    return static_cast<std::uint32_t>(std::clamp(value, 0.0, size - 1.0));
  };
  for (std::uint32_t y = inside(cy - radius, canvas.height());
       y <= inside(cy + radius, canvas.height()); ++y) {
    for (std::uint32_t x = inside(cx - radius, canvas.width());
         x <= inside(cx + radius, canvas.width()); ++x) {
      // Beside the outline there is nothing.
      if (std::isfinite(canvas.depth(x, y)) && canvas.depth(x, y) <= depth) return false;
    }
  }
  return true;
}

}  // namespace

void draw_marks(const std::vector<stream::Point3>& positions, const Camera& camera,
                const DrawOptions& options, Canvas& canvas) {
  if (positions.empty()) return;
  // As large as they can be without merging, up to a few pixels.
  const double share =
      static_cast<double>(canvas.width()) * canvas.height() / static_cast<double>(positions.size());
  const double radius = std::clamp(0.14 * std::sqrt(share), 1.0, 8.0);
  const double core = 0.6 * radius;
  constexpr std::array<float, 3> kRim{1.0F, 1.0F, 1.0F}, kCore{0.1F, 0.1F, 0.12F};
  double nearest = -std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (const stream::Point3& position : positions) {
    const double depth = camera.project(position)[2];
    nearest = std::max(nearest, depth);
    farthest = std::min(farthest, depth);
  }
  // What lies just in front is the disc of the point itself or of its neighbours. A share of the
  // whole, as heights may be in another unit than what the scale is for.
  const double behind = std::max(12.0 / camera.scale, 0.02 * (nearest - farthest));
  for_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    for (const stream::Point3& position : positions) {
      const auto [cx, cy, depth] = camera.project(position);
      const double y0 = std::max(std::floor(cy - radius), static_cast<double>(first));
      const double y1 = std::min(std::ceil(cy + radius), static_cast<double>(last));
      const double x0 = std::max(std::floor(cx - radius), 0.0);
      const double x1 = std::min(std::ceil(cx + radius), static_cast<double>(canvas.width()));
      if (!(y0 < y1 && x0 < x1)) continue;
      if (is_hidden(canvas, cx, cy, radius, depth + behind)) continue;
      for (auto y = static_cast<std::uint32_t>(y0); y < static_cast<std::uint32_t>(y1); ++y) {
        for (auto x = static_cast<std::uint32_t>(x0); x < static_cast<std::uint32_t>(x1); ++x) {
          const double distance = portable_hypot(x + 0.5 - cx, y + 0.5 - cy);
          if (distance <= radius) canvas.colour(x, y) = distance <= core ? kCore : kRim;
        }
      }
    }
  });
}

}  // namespace terrace::tools
