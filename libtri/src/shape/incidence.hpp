// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "gabriel.hpp"
#include "terrace/tri/shape.hpp"

/// The parts of a surface that work on its points needs: the faces at each point, and positions
/// that are safe to compute with.

namespace terrace::tri::shape {

/// Points or faces that one thread works on at a time.
inline constexpr std::size_t kSurfaceBlock = 4096;

/// Throws std::invalid_argument naming a face with a corner that is not the index of a point.
inline void check_corners(const Surface& surface) {
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    for (const std::uint32_t corner : surface.faces[f]) {
      if (corner >= surface.points.size()) {
        throw std::invalid_argument("face " + std::to_string(f) + ": corner " +
                                    std::to_string(corner) + ", but there are only " +
                                    std::to_string(surface.points.size()) + " points");
      }
    }
  }
}

/// Throws as check_corners() does, and for a face with two equal corners.
inline void check_faces(const Surface& surface) {
  check_corners(surface);
  for (std::size_t f = 0; f < surface.faces.size(); ++f) {
    const auto& face = surface.faces[f];
    for (std::size_t i = 0; i < 3; ++i) {
      if (face[i] == face[(i + 1) % 3]) {
        throw std::invalid_argument("face " + std::to_string(f) + ": corner " +
                                    std::to_string(face[i]) +
                                    " occurs twice; leave such faces out");
      }
    }
  }
}

inline bool has_three_corners(const std::array<std::uint32_t, 3>& face) {
  return face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
}

/// The faces at each point, in ascending order. Faces with two equal corners are left out.
struct Incidence {
  std::vector<std::size_t> begin{};  ///< start of point v in `face`; one extra at the end
  std::vector<std::uint32_t> face{};

  explicit Incidence(const Surface& surface) : begin(surface.points.size() + 1) {
    const auto for_each_corner = [&](auto work) {
      for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
        if (!has_three_corners(surface.faces[f])) continue;
        for (const std::uint32_t corner : surface.faces[f]) work(corner, f);
      }
    };
    for_each_corner([&](std::uint32_t corner, std::uint32_t) { ++begin[corner + 1]; });
    for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
    face.resize(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for_each_corner([&](std::uint32_t corner, std::uint32_t f) { face[next[corner]++] = f; });
  }

  [[nodiscard]] std::span<const std::uint32_t> faces_at(std::size_t v) const {
    return std::span(face).subspan(begin[v], begin[v + 1] - begin[v]);
  }
};

/// Converts positions to a cube of side 2 about the middle of their box, by a shift and a power of
/// two, so that products neither overflow nor, for faces that are not tiny in it, underflow.
class SurfaceFrame {
 public:
  /// Throws std::invalid_argument naming the first point that is not finite.
  explicit SurfaceFrame(std::span<const Point3> points) {
    Point3 min{}, max{};
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double x = points[i][k];
        if (!std::isfinite(x)) {
          throw std::invalid_argument("point " + std::to_string(i) +
                                      ": a coordinate is not finite; leave such points out");
        }
        min[k] = i == 0 ? x : std::min(min[k], x);
        max[k] = i == 0 ? x : std::max(max[k], x);
      }
    }
    double extent = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      middle_[k] = min[k] / 2 + max[k] / 2;
      extent = std::max(extent, max[k] / 2 - min[k] / 2);
    }
    if (extent > 0.0) exponent_ = std::max(std::ilogb(extent) + 1, -1000);
  }

  [[nodiscard]] Vector3 local(const Point3& p) const {
    Vector3 out{};
    for (std::size_t k = 0; k < 3; ++k) out[k] = to_local(p[k] - middle_[k]);
    return out;
  }
  /// Convert lengths, exactly except beyond the range of doubles.
  [[nodiscard]] double to_local(double length) const { return std::ldexp(length, -exponent_); }
  [[nodiscard]] double from_local(double length) const { return std::ldexp(length, exponent_); }

 private:
  Point3 middle_{};
  int exponent_ = 0;
};

inline double length(const Vector3& a) { return std::sqrt(dot(a, a)); }

/// Twice the area, and the unit normal; both zero for a face without area.
struct FaceNormal {
  Vector3 unit{};
  double area2 = 0.0;
};
inline FaceNormal face_normal(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 n = cross(minus(b, a), minus(c, a));
  const double area2 = length(n);
  if (!(area2 > std::numeric_limits<double>::min())) return {};
  return {{n[0] / area2, n[1] / area2, n[2] / area2}, area2};
}

}  // namespace terrace::tri::shape
