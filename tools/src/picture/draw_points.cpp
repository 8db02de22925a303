// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>
#include <vector>

#include <terrace/base/filled.hpp>
#include <terrace/base/portable_math.hpp>

#include "base/parallel.hpp"
#include "base/point_spacing.hpp"
#include "base/vector.hpp"
#include "cli/interrupt.hpp"
#include "picture/draw.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// The disc that represents a point: position and radius in samples, depth in metres.
struct Splat {
  float x, y, depth, radius;
};

/// Radius of the disc at each sample of the canvas, 0 where there is none.
using Radii = std::vector<float>;

/// Returns the depth step between samples above which they belong to different surfaces.
float max_depth_step(float radius, const Camera& camera) {
  return 4 * (radius + 1) / static_cast<float>(camera.scale);
}

/// Returns the number of samples that the cloud covers, including the gaps between its points.
/// Counts the cells of a grid so coarse that a covered cell contains several points.
double covered_area(const std::vector<Splat>& splats, const Canvas& canvas) {
  double area = 1;
  for (std::uint32_t cell = 2; cell <= 256; cell *= 2) {
    check_interrupt();
    const std::size_t columns = canvas.width() / cell + 1;
    std::vector<std::uint8_t> taken =
        base::filled(columns * (canvas.height() / cell + 1), std::uint8_t{0}, check_interrupt);
    std::size_t count = 0, points = 0;
    for (const Splat& s : splats) {
      check_interrupt();
      if (!(s.x >= 0 && s.y >= 0 && s.x < static_cast<float>(canvas.width()) &&
            s.y < static_cast<float>(canvas.height()))) {
        continue;
      }
      std::uint8_t& mark = taken[static_cast<std::size_t>(s.y) / cell * columns +
                                 static_cast<std::size_t>(s.x) / cell];
      count += mark == 0 ? 1 : 0;
      mark = 1;
      ++points;
    }
    area = std::max(static_cast<double>(count) * cell * cell, 1.0);
    if (points >= 6 * count) break;
  }
  return area;
}

/// Returns a splat of radius 0 for each position.
std::vector<Splat> splats_of(const std::vector<stream::Point3>& positions, const Camera& camera) {
  std::vector<Splat> splats;
  splats.reserve(positions.size());
  for (const stream::Point3& position : positions) {
    check_interrupt();
    const auto [x, y, depth] = camera.project(position);
    splats.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(depth), 0});
  }
  return splats;
}

/// Returns the radius of the discs for points scattered evenly over the covered area. Discs of
/// radius r leave a share of exp(-points * pi * r^2 / area) uncovered. That is nothing of a
/// terrain, and half a percent of a closed body, because half of its points are on its back.
double even_radius(const std::vector<Splat>& splats, const Canvas& canvas) {
  constexpr double kCover = 1.9;
  const double per_point = covered_area(splats, canvas) / static_cast<double>(splats.size());
  return std::clamp(kCover * std::sqrt(per_point), 1.0, 60.0);
}

/// Sets the radii for a cloud with coarser parts, large enough for each part. They follow from the
/// distances to a few neighbours among points of the same coarseness, and are limited by the median
/// distance among these points.
void set_radii(const TriangleMesh& cloud, const Camera& camera, const Canvas& canvas,
               const DrawOptions& options, std::vector<Splat>& splats) {
  constexpr unsigned kRank = 8;
  // Radius per distance, for the points of one side of a body. Scattered points get the same
  // coverage as by even_radius(). Representatives keep a distance from each other, so they need
  // less.
  const double scattered = 1.34 * std::sqrt(std::numbers::pi / kRank);
  const double spaced = 0.8 * std::sqrt(std::numbers::pi / kRank);
  // Discs larger than a tenth of the picture would hide the shape.
  const double max_radius = std::max(1.0, 0.1 * std::min(canvas.width(), canvas.height()));
  std::array<std::vector<std::uint32_t>, 256> groups;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    check_interrupt();
    groups[cloud.left_out[i]].push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<stream::Point3> positions;
  for (std::size_t coarseness = 0; coarseness < groups.size(); ++coarseness) {
    const std::vector<std::uint32_t>& group = groups[coarseness];
    if (group.size() < 2) continue;
    const double radius_per_distance = coarseness > 0 ? spaced : scattered;
    positions.clear();
    for (const std::uint32_t i : group) {
      check_interrupt();
      positions.push_back(cloud.positions[i]);
    }
    const std::vector<float> distances =
        neighbour_distances(positions, kRank, options.threads, stop_token());
    std::vector<float> sorted = distances;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    for (std::size_t k = 0; k < group.size(); ++k) {
      check_interrupt();
      const double distance = std::min(distances[k], 1.5F * *middle);
      splats[group[k]].radius = static_cast<float>(
          std::clamp(radius_per_distance * distance * camera.scale, 1.0, max_radius));
    }
  }
}

/// Averages depths over a square somewhat larger than the disc, first along rows, then along
/// columns. Excludes neighbours on other surfaces (max_depth_step()). Without smoothing, the
/// normals would be those of the discs.
void smooth_depths(Canvas& canvas, const Radii& radii, const Camera& camera, unsigned threads) {
  using Floats __attribute__((vector_size(16))) = float;
  constexpr int kLanes = 4;
  const std::uint32_t width = canvas.width(), height = canvas.height();
  // Copy rows and columns to lines with some samples without depth at the end, so that all lanes
  // can be read.
  const std::size_t row_size = width + kLanes, column_size = height + kLanes;
  std::vector<float> rows = base::filled(row_size * height, -HUGE_VALF, check_interrupt);
  std::vector<float> columns = base::filled(column_size * width, -HUGE_VALF, check_interrupt);
  const auto smooth = [&](const float* line, std::uint32_t size, std::uint32_t index, float disc) {
    const float centre = line[index];
    if (!std::isfinite(centre)) return centre;
    const float per_max_step = 1 / max_depth_step(disc, camera);
    const int radius = std::max(1, static_cast<int>(std::lround(1.2F * disc)));
    const int at = static_cast<int>(index), first = std::max(at - radius, 0);
    const int last = std::min(at + radius, static_cast<int>(size) - 1);
    Floats sum{}, weight{}, offset = static_cast<float>(first - at) + Floats{0, 1, 2, 3};
    for (int i = first; i <= last; i += kLanes, offset += static_cast<float>(kLanes)) {
      Floats difference;
      std::memcpy(&difference, line + i, sizeof difference);
      difference -= centre;
      const Floats steps = difference * per_max_step, depth_weight = 1 - steps * steps;
      const Floats distance_weight =
          static_cast<float>(radius + 1) - (offset < 0 ? -offset : offset);
      const auto near = (depth_weight > 0) & (distance_weight > 0);
      const Floats w = near ? distance_weight * depth_weight * depth_weight : Floats{};
      sum += near ? w * difference : Floats{};
      weight += w;
    }
    return centre +
           (sum[0] + sum[1] + sum[2] + sum[3]) / (weight[0] + weight[1] + weight[2] + weight[3]);
  };
  parallel_bands(height, threads, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t y = first; y < last; ++y) {
      check_interrupt();
      float* const row = rows.data() + y * row_size;
      for (std::uint32_t x = 0; x < width; ++x) row[x] = canvas.depth(x, y);
      for (std::uint32_t x = 0; x < width; ++x)
        columns[x * column_size + y] = smooth(row, width, x, radii[std::size_t{y} * width + x]);
    }
  });
  parallel_bands(width, threads, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t x = first; x < last; ++x) {
      check_interrupt();
      for (std::uint32_t y = 0; y < height; ++y)
        canvas.depth(x, y) =
            smooth(columns.data() + x * column_size, height, y, radii[std::size_t{y} * width + x]);
    }
  });
}

/// Returns the slope of the depths at a sample along one axis, in metres per sample. Differences
/// larger than max_step are between two surfaces and do not count.
float slope(float before, float here, float after, float max_step) {
  const float back = here - before, ahead = after - here;
  const bool back_valid = std::abs(back) <= max_step, ahead_valid = std::abs(ahead) <= max_step;
  if (back_valid && ahead_valid) return 0.5F * (back + ahead);
  if (back_valid) return back;
  if (ahead_valid) return ahead;
  return 0;
}

/// Lights every sample by a normal computed from its depth and those of its neighbours.
void light_by_depth(const Camera& camera, const Light& light, const Radii& radii, unsigned threads,
                    Canvas& canvas) {
  parallel_bands(canvas.height(), threads, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t y = first; y < last; ++y) {
      check_interrupt();
      for (std::uint32_t x = 0; x < canvas.width(); ++x) {
        const float here = canvas.depth(x, y);
        if (!std::isfinite(here)) continue;
        const float step = max_depth_step(radii[std::size_t{y} * canvas.width() + x], camera);
        const float left = canvas.depth(x == 0 ? x : x - 1, y);
        const float right = canvas.depth(std::min(x + 1, canvas.width() - 1), y);
        const float above = canvas.depth(x, y == 0 ? y : y - 1);
        const float below = canvas.depth(x, std::min(y + 1, canvas.height() - 1));
        // Metres of depth per metre along right and up.
        const double along = slope(left, here, right, step) * camera.scale;
        const double upward = -slope(above, here, below, step) * camera.scale;
        stream::Point3 normal{};
        for (std::size_t i = 0; i < 3; ++i) {
          normal[i] = camera.toward[i] - along * camera.right[i] - upward * camera.up[i];
        }
        const float shade = light.shade(unit(normal), camera.toward);
        for (float& c : canvas.colour(x, y)) {
          c = shade <= 1 ? c * shade : c + (1 - c) * std::min(shade - 1, 1.0F);
        }
      }
    }
  });
}

/// Returns whether drawn samples nearer than `depth` hide the whole disc. A single visible sample
/// is enough, because on a steep slope most of the disc is hidden.
bool is_hidden(Canvas& canvas, double cx, double cy, double radius, double depth) {
  const auto inside = [](double value, std::uint32_t size) {
    return static_cast<std::uint32_t>(std::clamp(value, 0.0, size - 1.0));
  };
  for (std::uint32_t y = inside(cy - radius, canvas.height());
       y <= inside(cy + radius, canvas.height()); ++y) {
    for (std::uint32_t x = inside(cx - radius, canvas.width());
         x <= inside(cx + radius, canvas.width()); ++x) {
      // Empty samples are outside the cloud and do not count as visible.
      if (std::isfinite(canvas.depth(x, y)) && canvas.depth(x, y) <= depth) return false;
    }
  }
  return true;
}

/// Draws the splats with a depth buffer, lit by the points' normals if they have any. Returns the
/// radii of the visible discs.
Radii draw_splats(const TriangleMesh& cloud, const std::vector<Rgb>& colours,
                  const std::vector<Splat>& splats, const Camera& camera, const Light& light,
                  const DrawOptions& options, Canvas& canvas) {
  const bool has_normals = cloud.normals.size() == cloud.positions.size();
  Radii radii = base::filled(std::size_t{canvas.width()} * canvas.height(), 0.0F, check_interrupt);
  parallel_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    for (std::size_t i = 0; i < splats.size(); ++i) {
      check_interrupt();
      const Splat& s = splats[i];
      const float radius = s.radius;
      const float y0 = std::max(std::ceil(s.y - radius - 0.5F), static_cast<float>(first));
      const float y1 = std::min(std::floor(s.y + radius - 0.5F) + 1, static_cast<float>(last));
      const float x0 = std::max(std::ceil(s.x - radius - 0.5F), 0.0F);
      const float x1 =
          std::min(std::floor(s.x + radius - 0.5F) + 1, static_cast<float>(canvas.width()));
      if (!(y0 < y1 && x0 < x1)) continue;
      float shade = 1;
      if (has_normals) {
        const auto& n = cloud.normals[i];
        shade = light.shade({n[0], n[1], n[2]}, camera.toward);
      }
      std::array<float, 3> colour = as_floats(colours[i]);
      for (float& c : colour) c *= shade;
      for (auto y = static_cast<std::uint32_t>(y0); y < static_cast<std::uint32_t>(y1); ++y) {
        check_interrupt();
        for (auto x = static_cast<std::uint32_t>(x0); x < static_cast<std::uint32_t>(x1); ++x) {
          const float dx = static_cast<float>(x) + 0.5F - s.x;
          const float dy = static_cast<float>(y) + 0.5F - s.y;
          const float square = (dx * dx + dy * dy) / (radius * radius);
          if (square > 1) continue;
          // Discs are slightly domed, so that overlapping ones meet halfway between their centres.
          const float depth = s.depth - square * radius * 0.1F / static_cast<float>(camera.scale);
          if (!(depth > canvas.depth(x, y))) continue;
          canvas.depth(x, y) = depth;
          canvas.colour(x, y) = colour;
          radii[std::size_t{y} * canvas.width() + x] = radius;
        }
      }
    }
  });
  return radii;
}

}  // namespace

void fit_discs(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas) {
  if (positions.empty()) return;
  // The radius may grow a little, because the area is measured in coarse cells.
  constexpr double kMargin = 0.02, kGrowth = 1.3;
  const double side = std::min(canvas.width(), canvas.height());
  const double overhang =
      kGrowth * even_radius(splats_of(positions, camera), canvas) - kMargin * side;
  if (overhang > 0) camera.scale *= std::max(0.5, 1 - 2 * overhang / ((1 - 2 * kMargin) * side));
}

void draw_points(const TriangleMesh& cloud, const std::vector<Rgb>& colours, const Camera& camera,
                 const Light& light, const DrawOptions& options, Canvas& canvas) {
  std::vector<Splat> splats = splats_of(cloud.positions, camera);
  if (splats.empty()) return;
  const auto even = static_cast<float>(even_radius(splats, canvas));
  const bool has_normals = cloud.normals.size() == cloud.positions.size();
  for (Splat& splat : splats) splat.radius = even;
  if (cloud.left_out.size() == splats.size()) set_radii(cloud, camera, canvas, options, splats);

  const Radii radii = draw_splats(cloud, colours, splats, camera, light, options, canvas);
  if (has_normals) return;
  // The second pass removes the edges that the squares of the first one leave.
  smooth_depths(canvas, radii, camera, options.threads);
  smooth_depths(canvas, radii, camera, options.threads);
  light_by_depth(camera, light, radii, options.threads, canvas);
}

void draw_marks(const std::vector<stream::Point3>& positions, const Camera& camera,
                const DrawOptions& options, Canvas& canvas) {
  if (positions.empty()) return;
  // Make the marks as large as possible without merging, up to a few pixels.
  const double area_per_mark =
      static_cast<double>(canvas.width()) * canvas.height() / static_cast<double>(positions.size());
  const double radius = std::clamp(0.14 * std::sqrt(area_per_mark), 1.0, 8.0);
  const double core = 0.6 * radius;
  constexpr std::array<float, 3> kRim{1.0F, 1.0F, 1.0F}, kCore{0.1F, 0.1F, 0.12F};
  double nearest = -std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (const stream::Point3& position : positions) {
    check_interrupt();
    const double depth = camera.project(position)[2];
    nearest = std::max(nearest, depth);
    farthest = std::min(farthest, depth);
  }
  // A surface just in front is the disc of the point itself or of a neighbour, which does not hide
  // the mark. The margin is a share of the depth range, because heights may be in another unit than
  // the scale.
  const double tolerance = std::max(12.0 / camera.scale, 0.02 * (nearest - farthest));
  parallel_bands(canvas.height(), options.threads, [&](std::uint32_t first, std::uint32_t last) {
    for (const stream::Point3& position : positions) {
      check_interrupt();
      const auto [cx, cy, depth] = camera.project(position);
      const double y0 = std::max(std::floor(cy - radius), static_cast<double>(first));
      const double y1 = std::min(std::ceil(cy + radius), static_cast<double>(last));
      const double x0 = std::max(std::floor(cx - radius), 0.0);
      const double x1 = std::min(std::ceil(cx + radius), static_cast<double>(canvas.width()));
      if (!(y0 < y1 && x0 < x1)) continue;
      if (is_hidden(canvas, cx, cy, radius, depth + tolerance)) continue;
      for (auto y = static_cast<std::uint32_t>(y0); y < static_cast<std::uint32_t>(y1); ++y) {
        for (auto x = static_cast<std::uint32_t>(x0); x < static_cast<std::uint32_t>(x1); ++x) {
          const double distance = base::hypot(x + 0.5 - cx, y + 0.5 - cy);
          if (distance <= radius) canvas.colour(x, y) = distance <= core ? kCore : kRim;
        }
      }
    }
  });
}

}  // namespace terrace::tools
