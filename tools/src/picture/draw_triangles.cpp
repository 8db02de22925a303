// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/vector.hpp"
#include "cli/interrupt.hpp"
#include "picture/draw.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// A projected vertex: position in samples, depth, brightness.
struct Projected {
  float x, y, depth, shade;
};

/// Half the width of an edge, and the distance over which it fades out, in samples.
constexpr float kEdge = 0.55F * Canvas::kOversampling;
constexpr float kEdgeFade = 0.7F * Canvas::kOversampling;
/// Triangles lower than this, in samples, get no edges: nothing but edges would show.
constexpr float kSmallestTriangle = 3.0F * Canvas::kOversampling;
constexpr std::array<float, 3> kEdgeColour{0.10F, 0.12F, 0.16F};

struct ScreenCorner {
  Projected p;
  std::array<float, 3> colour;
};

/// Fills the samples of one triangle in rows [first_row, last_row).
void fill(const std::array<ScreenCorner, 3>& t, bool wire, std::uint32_t first_row,
          std::uint32_t last_row, Canvas& canvas) {
  const Projected &a = t[0].p, &b = t[1].p, &c = t[2].p;
  const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area == 0 || !std::isfinite(area)) return;
  const float top = std::min({a.y, b.y, c.y}), bottom = std::max({a.y, b.y, c.y});
  const float left = std::min({a.x, b.x, c.x}), right = std::max({a.x, b.x, c.x});
  // Sample centres have half-integer coordinates.
  const float width = static_cast<float>(canvas.width());
  const auto x0 = static_cast<std::uint32_t>(std::clamp(std::ceil(left - 0.5F), 0.0F, width));
  const auto x1 = static_cast<std::uint32_t>(std::clamp(std::floor(right - 0.5F) + 1, 0.0F, width));
  const auto y0 = static_cast<std::uint32_t>(std::clamp(
      std::ceil(top - 0.5F), static_cast<float>(first_row), static_cast<float>(last_row)));
  const auto y1 = static_cast<std::uint32_t>(std::clamp(
      std::floor(bottom - 0.5F) + 1, static_cast<float>(first_row), static_cast<float>(last_row)));
  if (x0 >= x1 || y0 >= y1) return;

  // The heights over the three edges convert barycentric coordinates into distances.
  const auto length = [](const Projected& p, const Projected& q) {
    const float x = q.x - p.x, y = q.y - p.y;
    return std::sqrt(x * x + y * y);
  };
  const float twice = std::abs(area);
  const std::array<float, 3> height{twice / length(b, c), twice / length(c, a),
                                    twice / length(a, b)};
  const float smallest = std::min({height[0], height[1], height[2]});
  const float edge_strength =
      wire ? 0.85F * std::clamp(smallest / kSmallestTriangle - 0.35F, 0.0F, 1.0F) : 0.0F;

  const float scale = 1.0F / area;
  for (std::uint32_t y = y0; y < y1; ++y) {
    check_interrupt();
    const float py = static_cast<float>(y) + 0.5F;
    for (std::uint32_t x = x0; x < x1; ++x) {
      const float px = static_cast<float>(x) + 0.5F;
      const float u = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) * scale;
      const float v = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) * scale;
      const float w = 1.0F - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const float depth = u * a.depth + v * b.depth + w * c.depth;
      float& old_depth = canvas.depth(x, y);
      if (!(depth > old_depth)) continue;
      old_depth = depth;
      const float shade = u * a.shade + v * b.shade + w * c.shade;
      std::array<float, 3>& out = canvas.colour(x, y);
      for (std::size_t i = 0; i < 3; ++i) {
        const float base = u * t[0].colour[i] + v * t[1].colour[i] + w * t[2].colour[i];
        // Above 1 a slope is brighter than flat ground, so blend the tint towards white.
        out[i] = shade <= 1 ? base * shade : base + (1 - base) * std::min(shade - 1, 1.0F);
      }
      if (edge_strength > 0) {
        const float distance = std::min({u * height[0], v * height[1], w * height[2]});
        const float cover =
            edge_strength * std::clamp((kEdge + kEdgeFade - distance) / kEdgeFade, 0.0F, 1.0F);
        for (std::size_t i = 0; i < 3; ++i) out[i] += cover * (kEdgeColour[i] - out[i]);
      }
    }
  }
}

}  // namespace

void draw_triangles(const TriangleMesh& mesh, const std::vector<Rgb>& colours, const Camera& camera,
                    const Light& light, const DrawOptions& options, Canvas& canvas) {
  std::vector<Projected> vertices;
  vertices.reserve(mesh.positions.size());
  const std::vector<std::array<float, 3>> normals =
      options.wire ? std::vector<std::array<float, 3>>() : vertex_normals(mesh, check_interrupt);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    check_interrupt();
    const auto [x, y, depth] = camera.project(mesh.positions[i]);
    vertices.push_back(
        {static_cast<float>(x), static_cast<float>(y), static_cast<float>(depth), 1.0F});
    if (!normals.empty()) {
      vertices.back().shade =
          light.shade({normals[i][0], normals[i][1], normals[i][2]}, camera.toward);
    }
  }

  parallel_bands(
      canvas.height(), options.threads, [&](std::uint32_t first_row, std::uint32_t last_row) {
        for (const auto& t : mesh.triangles) {
          check_interrupt();
          const float y0 = vertices[t[0]].y, y1 = vertices[t[1]].y, y2 = vertices[t[2]].y;
          if (std::max({y0, y1, y2}) < static_cast<float>(first_row) ||
              std::min({y0, y1, y2}) > static_cast<float>(last_row)) {
            continue;
          }
          std::array<ScreenCorner, 3> corners{};
          for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = {.p = vertices[t[k]], .colour = as_floats(colours[t[k]])};
          }
          if (options.wire) {
            const float shade = light.shade(unit(area_vector(mesh, t)), camera.toward);
            for (ScreenCorner& corner : corners) corner.p.shade = shade;
          }
          fill(corners, options.wire, first_row, last_row, canvas);
        }
      });
}

void fit(Camera& camera, const std::vector<stream::Point3>& positions, const Canvas& canvas) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double left = kInfinity, right = -kInfinity, bottom = kInfinity, top = -kInfinity;
  for (const stream::Point3& p : positions) {
    check_interrupt();
    const double x = dot(p, camera.right), y = dot(p, camera.up);
    left = std::min(left, x);
    right = std::max(right, x);
    bottom = std::min(bottom, y);
    top = std::max(top, y);
  }
  camera.width = canvas.width();
  camera.height = canvas.height();
  if (!(left <= right)) return;
  camera.centre_x = 0.5 * (left + right);
  camera.centre_y = 0.5 * (bottom + top);
  constexpr double kMargin = 0.96;
  const double smallest = 1e-12 * (1 + std::abs(left) + std::abs(top));
  camera.scale = kMargin * std::min(camera.width / std::max(right - left, smallest),
                                    camera.height / std::max(top - bottom, smallest));
}

}  // namespace terrace::tools
