// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the simplification of a bumpy sphere, compared with CGAL's edge collapses with the costs
// of Lindstrom and Turk down to as many vertices. Those place vertices anywhere and have no bound.
// Distances are shares of the bound: "from_full" is the largest from the vertices of the full
// surface, "to_full" the largest from 15 places on each triangle, and "area_999" the one that 99.9
// % of the simplified area does not exceed. "volume" is relative to the full surface's. If
// TERRACE_DATA is set, does the same for scans in its subfolder `scan`, except in small runs
// (TERRACE_BENCH_SMALL).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <benchmark/benchmark.h>

#include "../tests/scan_file.hpp"
#include "shape/surface_distance.hpp"
#include "terrace/tri/surface_simplification.hpp"

namespace {

using namespace terrace::tri;
namespace cgal = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

/// A closed surface without coincident points.
Surface bumpy_sphere() {
  const std::uint32_t rings = kSmall ? 12 : 250, around = 2 * rings;
  Surface surface;
  const auto place = [](double u, double v) {
    const double r = 1.0 + 0.05 * std::sin(9 * u) * std::sin(7 * v) * std::sin(v);
    return Point3{r * std::cos(u) * std::sin(v), r * std::sin(u) * std::sin(v), r * std::cos(v)};
  };
  surface.points = {place(0, 0), place(0, std::numbers::pi)};
  for (std::uint32_t i = 1; i < rings; ++i) {
    for (std::uint32_t k = 0; k < around; ++k) {
      surface.points.push_back(
          place(2 * std::numbers::pi * k / around, std::numbers::pi * i / rings));
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t k) {
    return i == 0 ? 0 : i == rings ? 1 : 2 + (i - 1) * around + k % around;
  };
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t k = 0; k < around; ++k) {
      if (i > 0) surface.faces.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
      if (i + 1 < rings) surface.faces.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
    }
  }
  return surface;
}

double diagonal(const Surface& surface) {
  Box3 box;
  for (const Point3& p : surface.points) box.include(p);
  return std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]);
}

/// Distances of places on a surface, with the area that each stands for.
struct Distances {
  std::vector<std::pair<double, double>> of_area{};  ///< distance and area
  double area = 0.0;

  [[nodiscard]] double largest() const { return exceeded_by(0.0); }
  /// The distance that only this share of the area exceeds.
  [[nodiscard]] double exceeded_by(double share) const {
    auto sorted = of_area;
    std::sort(sorted.begin(), sorted.end());
    double left = share * area;
    for (std::size_t i = sorted.size(); i-- > 0;) {
      left -= sorted[i].second;
      if (left < 0.0 || i == 0) return sorted[i].first;
    }
    return 0.0;
  }
};

/// From 15 places on each face of a surface to another one.
Distances distances(const Surface& from, const Surface& to) {
  const shape::SurfaceDistance distance(to.points, to.faces);
  Distances out;
  for (const auto& [a, b, c] : from.faces) {
    const auto normal = shape::cross(shape::minus(from.points[b], from.points[a]),
                                     shape::minus(from.points[c], from.points[a]));
    const double area = std::sqrt(shape::dot(normal, normal)) / 30.0;
    for (int i = 0; i <= 4; ++i) {
      for (int k = 0; i + k <= 4; ++k) {
        Point3 p{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          p[axis] = (i * from.points[a][axis] + k * from.points[b][axis] +
                     (4 - i - k) * from.points[c][axis]) /
                    4;
        }
        out.of_area.emplace_back(
            std::sqrt(distance.square(p, std::numeric_limits<double>::infinity())), area);
        out.area += area;
      }
    }
  }
  return out;
}

/// The largest distance of a vertex of a face of `from`.
double largest_of_vertices(const Surface& from, const Surface& to) {
  const shape::SurfaceDistance distance(to.points, to.faces);
  double square = 0.0;
  for (const auto& face : from.faces) {
    for (const std::uint32_t v : face) {
      square = std::max(square,
                        distance.square(from.points[v], std::numeric_limits<double>::infinity()));
    }
  }
  return std::sqrt(square);
}

void report(benchmark::State& state, const Surface& full, const Surface& result, double bound) {
  const Distances to_full = distances(result, full);
  state.counters["vertices"] = static_cast<double>(result.points.size());
  state.counters["from_full"] = largest_of_vertices(full, result) / bound;
  state.counters["to_full"] = to_full.largest() / bound;
  state.counters["area_999"] = to_full.exceeded_by(0.001) / bound;
  state.counters["volume"] = measure(result).volume / measure(full).volume;
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(measure(full).vertices));
}

Surface by_cgal(const Surface& full, std::size_t vertices) {
  Mesh mesh;
  std::map<std::uint32_t, Mesh::Vertex_index> index;
  for (const auto& face : full.faces) {
    std::array<Mesh::Vertex_index, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [at, is_new] = index.try_emplace(face[k]);
      const Point3& p = full.points[face[k]];
      if (is_new) at->second = mesh.add_vertex({p[0], p[1], p[2]});
      corners[k] = at->second;
    }
    mesh.add_face(corners[0], corners[1], corners[2]);
  }
  // Each collapse removes one vertex and, away from the border, three edges.
  const std::size_t edges = std::size_t{3} * vertices;
  cgal::edge_collapse(mesh, cgal::Count_stop_predicate<Mesh>(edges));
  mesh.collect_garbage();
  Surface out;
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    out.points.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> corners{};
    std::size_t k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) {
      corners[k++] = static_cast<std::uint32_t>(v);
    }
    out.faces.push_back(corners);
  }
  return out;
}

void simplify(benchmark::State& state, const Surface& full, double share) {
  const double bound = share * diagonal(full);
  SimplifiedSurface result;
  for (auto _ : state) result = simplify_surface(full, {.max_error = bound});
  report(state, full, result.surface, bound);
}

void collapse_by_cgal(benchmark::State& state, const Surface& full, double share) {
  const double bound = share * diagonal(full);
  const std::size_t vertices = simplify_surface(full, {.max_error = bound}).surface.points.size();
  Surface result;
  for (auto _ : state) result = by_cgal(full, vertices);
  report(state, full, result, bound);
}

void add(const std::string& name, const Surface& surface) {
  // Must outlive the benchmarks.
  static std::map<std::string, Surface> surfaces;
  const Surface& full = surfaces[name] = surface;
  const std::vector<std::pair<double, std::string>> shares{
      {0.001, "0.1%"}, {0.01, "1%"}, {0.03, "3%"}};
  for (const auto& [share, text] : shares) {
    const std::string what = name + "/" + text;
    const auto register_one = [&](const std::string& kind, auto* run) {
      benchmark::RegisterBenchmark((kind + "/" + what).c_str(), [&full, share = share,
                                                                 run](auto& state) {
        run(state, full, share);
      })->Unit(benchmark::kMillisecond);
    };
    register_one("simplify_surface", simplify);
    register_one("cgal", collapse_by_cgal);
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  add("sphere", bumpy_sphere());
  if (const char* data = std::getenv("TERRACE_DATA"); data != nullptr && !kSmall) {
    // Manifold files only, as CGAL's mesh requires.
    for (const std::string name : {"bun_zipper.ply", "horse.ply", "lucy_100k.ply"}) {
      const std::filesystem::path path = std::filesystem::path(data) / "scan" / name;
      if (std::filesystem::exists(path)) add(name, read_scan(path));
    }
  }
  benchmark::RunSpecifiedBenchmarks();
}
