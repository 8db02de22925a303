// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "terrace/tri/shape.hpp"

/// Surfaces of known bodies for tests of smoothing and normals, and noise for them.

namespace terrace::tri::noisy_bodies {

inline Point3 minus(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const Point3& a, const Point3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point3 cross(const Point3& a, const Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Point3& a) { return std::sqrt(dot(a, a)); }

/// Twice the area of a face times its unit normal.
inline Point3 doubled_normal(const Surface& surface, const std::array<std::uint32_t, 3>& face) {
  const Point3& a = surface.points[face[0]];
  return cross(minus(surface.points[face[1]], a), minus(surface.points[face[2]], a));
}

/// A cube from 0 to `side` along each axis, with a grid of unit cells on its faces. Diagonals
/// alternate.
inline Surface cube(int side) {
  Surface out;
  std::map<Point3, std::uint32_t> numbers;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool far : {false, true}) {
      const auto corner = [&](int i, int j) {
        Point3 p{};
        p[axis] = far ? side : 0;
        p[(axis + 1) % 3] = i;
        p[(axis + 2) % 3] = j;
        const auto [at, added] = numbers.emplace(p, static_cast<std::uint32_t>(out.points.size()));
        if (added) out.points.push_back(p);
        return at->second;
      };
      const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (far) {
          out.faces.push_back({a, b, c});
        } else {
          out.faces.push_back({a, c, b});
        }
      };
      for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
          const std::uint32_t a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                              d = corner(i, j + 1);
          if ((i + j) % 2 == 0) {
            add(a, b, c);
            add(a, c, d);
          } else {
            add(a, b, d);
            add(b, c, d);
          }
        }
      }
    }
  }
  return out;
}

/// A sphere about the origin: an octahedron, each side halved `depth` times.
inline Surface sphere(double radius, int depth) {
  Surface out{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int i = 0; i < depth; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> halves;
    const auto half = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, added] =
          halves.emplace(std::minmax(a, b), static_cast<std::uint32_t>(out.points.size()));
      if (added) {
        Point3 p{};
        for (std::size_t k = 0; k < 3; ++k) p[k] = out.points[a][k] + out.points[b][k];
        const double l = length(p);
        for (double& x : p) x /= l;
        out.points.push_back(p);
      }
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : out.faces) {
      const std::uint32_t ab = half(a, b), bc = half(b, c), ca = half(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    out.faces = std::move(finer);
  }
  for (Point3& p : out.points)
    for (double& x : p) x *= radius;
  return out;
}

/// A torus around the z axis.
inline Surface torus(double radius, double tube, std::uint32_t around, std::uint32_t across) {
  Surface out;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across;
      const double r = radius + tube * std::cos(v);
      out.points.push_back({r * std::cos(u), r * std::sin(u), tube * std::sin(v)});
    }
  }
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const std::uint32_t next = (i + 1) % around * across, side = (j + 1) % across;
      out.faces.push_back({i * across + j, next + j, next + side});
      out.faces.push_back({i * across + j, next + side, i * across + side});
    }
  }
  return out;
}

/// An open grid over x and y whose inner points are shifted by up to 0.3, at height(x, y).
template <class Height>
Surface sheet(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed, Height height) {
  std::mt19937_64 random(seed);
  const auto shift = [&] { return 0.6 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5); };
  Surface out;
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const double x = i + shift(), y = j + shift();
      out.points.push_back({x, y, height(x, y)});
      if (i == 0 || j == 0) continue;
      const std::uint32_t d = j * columns + i, c = d - 1, b = d - columns, a = b - 1;
      out.faces.push_back({a, b, d});
      out.faces.push_back({a, d, c});
    }
  }
  return out;
}

/// Adds Gaussian noise to every coordinate.
inline Surface with_noise(Surface surface, double sigma, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  for (Point3& p : surface.points)
    for (double& x : p) x += noise(random);
  return surface;
}

}  // namespace terrace::tri::noisy_bodies
