// SPDX-License-Identifier: Apache-2.0
// Measures shape restoration, from scratch and after a change, on a noisy torus of 200,000 points,
// and the smoothing and the normals of its surface.
// If TERRACE_DATA is set, prints a table of times and quality for the scans in its subfolder `scan`
// too, except in small runs (TERRACE_BENCH_SMALL).
//
// Times exclude building the triangulation. "collapse" is the change after the removal of the 100
// points nearest to one of them, "expand" that after their reinsertion.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include <benchmark/benchmark.h>

#include "../tests/scan_file.hpp"
#include "terrace/tri/shape.hpp"
#include "terrace/tri/surface_smoothing.hpp"

namespace {

using namespace terrace::tri;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::size_t kCount = kSmall ? 2'000 : 200'000;

const std::vector<Point3>& torus() {
  static const std::vector<Point3> points = [] {
    std::mt19937_64 random(1);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    std::vector<Point3> result;
    while (result.size() < kCount) {
      const double a = 2 * std::numbers::pi * unit(), b = 2 * std::numbers::pi * unit();
      if (unit() * 1.4 > 1 + 0.4 * std::cos(b)) continue;  // uniform by area
      const double tube = 0.4 + 0.001 * (2 * unit() - 1);
      const double radius = 1 + tube * std::cos(b);
      result.push_back({radius * std::cos(a), radius * std::sin(a), tube * std::sin(b)});
    }
    return result;
  }();
  return points;
}

template <class Coord>
std::vector<std::array<Coord, 3>> points_of(const std::vector<Point3>& points, double& step) {
  if constexpr (std::is_same_v<Coord, double>) {
    step = 1.0;
    return points;
  } else {
    return quantised(points, step);
  }
}

template <class Coord>
struct Torus {
  Torus() {
    double step = 0.0;
    triangulation.build(points_of<Coord>(torus(), step));
  }
  Delaunay3<Coord> triangulation;
};

template <class Coord>
void restore(benchmark::State& state, const ShapeOptions& options) {
  static const Torus<Coord> torus;
  Shape3<Coord> shape(options);
  for (auto _ : state) shape.restore(torus.triangulation);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kCount));
  state.counters["kept"] = static_cast<double>(shape.kept_count());
  state.counters["rescued"] = static_cast<double>(shape.rescued_count());
}

const Surface& restored_torus() {
  static const Surface surface = restore_surface(torus()).surface;
  return surface;
}

void smooth_torus(benchmark::State& state, SurfaceSmoothing method) {
  const Surface& surface = restored_torus();
  for (auto _ : state) benchmark::DoNotOptimize(smooth(surface, {.method = method}));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kCount));
}

void normals_of_torus(benchmark::State& state) {
  const Surface& surface = restored_torus();
  for (auto _ : state) benchmark::DoNotOptimize(vertex_normals(surface));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kCount));
}

double seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The 100 points nearest to one of them, breadth-first.
template <class Triangulation>
std::vector<VertexId> nearest(const Triangulation& triangulation, VertexId seed) {
  std::vector<VertexId> cluster{seed}, around;
  for (std::size_t i = 0; cluster.size() < 100; ++i) {
    triangulation.adjacent(cluster[i], around);
    for (const VertexId v : around)
      if (cluster.size() < 100 && std::find(cluster.begin(), cluster.end(), v) == cluster.end())
        cluster.push_back(v);
  }
  return cluster;
}

/// Seconds that the shape takes to follow the expansion and the collapse of a cluster, whose new
/// vertices it stores in the cluster.
template <class Coord>
std::array<double, 2> take_out_and_put_back(Delaunay3<Coord>& triangulation, Shape3<Coord>& shape,
                                            std::vector<VertexId>& cluster) {
  std::vector<std::array<Coord, 3>> points;
  for (const VertexId v : cluster) points.push_back(triangulation.point(v));
  std::vector<typename Delaunay3<Coord>::Insertion> inserted(points.size());
  typename Delaunay3<Coord>::Changes changes;
  const auto follow = [&] {
    triangulation.take_changes(changes);
    return seconds([&] { shape.update_nearby(triangulation, changes); });
  };
  triangulation.remove(cluster);
  const double collapse = follow();
  triangulation.insert(points, inserted);
  for (std::size_t i = 0; i < cluster.size(); ++i) cluster[i] = inserted[i].vertex;
  return {follow(), collapse};
}

enum class Change { expand, collapse };

template <class Coord>
void update(benchmark::State& state, const ShapeOptions& options, Change timed) {
  Torus<Coord> torus;
  auto& triangulation = torus.triangulation;
  Shape3<Coord> shape(options);
  triangulation.start_journal();
  shape.restore(triangulation);
  std::vector<VertexId> cluster = nearest(triangulation, *triangulation.all_vertices().begin());
  for (auto _ : state) {
    const auto times = take_out_and_put_back(triangulation, shape, cluster);
    state.SetIterationTime(times[static_cast<std::size_t>(timed)]);
  }
}

struct Scan {
  const char* file;
  const char* name;
};
constexpr Scan kScans[] = {
    {"bun_zipper.ply", "bunny"},
    {"armadillo_libigl.obj", "armadillo"},
    {"dragon_vrip_res2.ply.gz", "dragon"},
    {"lucy_100k.ply", "Lucy"},
    {"horse.ply", "horse"},
    {"igea.ply", "igea"},
    {"fandisk.obj", "fandisk"},
    {"armadillo_tm.ply", "armadillo 2"},
};

/// The mean of 40 clusters spread over a scan, see take_out_and_put_back().
template <class Coord>
std::array<double, 2> mean_of_clusters(Delaunay3<Coord>& triangulation, Shape3<Coord>& shape) {
  constexpr std::size_t kClusters = 40;
  triangulation.start_journal();
  std::vector<VertexId> seeds;
  for (const VertexId v : triangulation.all_vertices()) seeds.push_back(v);
  std::array<double, 2> sum{};
  for (std::size_t i = 0; i < kClusters; ++i) {
    const VertexId seed = seeds[i * seeds.size() / kClusters];
    if (!triangulation.alive(seed)) continue;
    std::vector<VertexId> cluster = nearest(triangulation, seed);
    const auto times = take_out_and_put_back(triangulation, shape, cluster);
    for (std::size_t k = 0; k < 2; ++k) sum[k] += times[k] / kClusters;
  }
  return sum;
}

void print_row(const char* name, const char* label, double build, double shape_time,
               const SurfaceMeasures& m, std::size_t lost, std::size_t rescued, double scale,
               const SurfaceMeasures& original, double volume,
               const std::array<double, 2>& follow) {
  std::printf("%-12s %-14s %6.3f %6.4f %7zu %6lld %5zu %6zu %6zu %6zu", name, label, build,
              shape_time, m.faces, static_cast<long long>(m.euler_characteristic), m.components,
              m.non_manifold_edges, lost, rescued);
  if (original.faces > 0)
    std::printf(" %7.4f %7.4f", m.area * scale * scale / original.area,
                m.volume * scale * scale * scale / volume);
  if (follow[0] > 0) std::printf(" %6.2f %6.2f", 1e3 * follow[0], 1e3 * follow[1]);
  std::printf("%s\n", m.closed ? "" : " open");
}

template <class Coord>
void scan_rows(const char* name, const Surface& original, const SurfaceMeasures& measures,
               double volume) {
  double step = 0.0;
  const auto points = points_of<Coord>(original.points, step);
  double build = 1e9;
  Delaunay3<Coord> triangulation;
  for (int round = 0; round < 3; ++round) {
    Delaunay3<Coord> fresh;
    build = std::min(build, seconds([&] { fresh.build(points); }));
    triangulation = std::move(fresh);
  }
  struct Method {
    const char* name;
    ShapeOptions options;
  };
  Method methods[] = {{"poles", {}}, {"flood", {}}, {"no guard", {}}, {"published", {}}};
  for (Method* flood : {&methods[1], &methods[2]}) flood->options.rule = ShapeRule::flood;
  methods[2].options.keep_vertices = false;
  methods[3].options.rule = ShapeRule::published;
  for (const Method& method : methods) {
    Shape3<Coord> shape(method.options);
    double time = 1e9;
    for (int round = 0; round < 3; ++round)
      time = std::min(time, seconds([&] { shape.restore(triangulation); }));
    const std::string label =
        std::string(method.name) + (std::is_same_v<Coord, double> ? " d" : " i");
    const ShapeSurface surface = shape.surface(triangulation);
    SurfaceMeasures found = measure(surface.surface);
    const ShapeParts parts = shape.parts(triangulation, surface);
    found.components = parts.components;
    found.euler_characteristic = parts.euler_characteristic;
    const std::size_t lost = shape.lost_vertices().size(), rescued = shape.rescued_count();
    // This comes last, as labels that follow changes may differ from those from scratch.
    std::array<double, 2> follow{};
    if (method.options.rule == ShapeRule::poles) follow = mean_of_clusters(triangulation, shape);
    print_row(name, label.c_str(), build, time, found, lost, rescued, step, measures, volume,
              follow);
  }
}

void print_table(const std::filesystem::path& folder) {
  std::printf(
      "Scans, points alone; build and restoring in seconds, best of 3; i: integers of 24 bits, d:\n"
      "doubles; area and volume over the original's, its openings closed; following the expansion "
      "and\n"
      "the collapse of 100 points in milliseconds, mean of 40 clusters.\n"
      "%-12s %-14s %6s %6s %7s %6s %5s %6s %6s %6s %7s %7s %6s %6s\n",
      "", "", "build", "shape", "faces", "chi", "comp", "nonman", "lost", "put b.", "area",
      "volume", "expand", "coll.");
  for (const Scan& scan : kScans) {
    if (!std::filesystem::exists(folder / scan.file)) continue;
    const Surface original = read_scan(folder / scan.file);
    SurfaceMeasures measures;
    double volume = 1.0;
    if (!original.faces.empty()) {
      measures = measure(original);
      volume = measure(with_openings_closed(original)).volume;
    }
    scan_rows<std::int32_t>(scan.name, original, measures, volume);
    scan_rows<double>(scan.name, original, measures, volume);
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data != nullptr && !kSmall) print_table(std::filesystem::path(data) / "scan");
  ShapeOptions flood, no_guard, published, edges;
  flood.rule = no_guard.rule = edges.rule = ShapeRule::flood;
  no_guard.keep_vertices = false;
  published.rule = ShapeRule::published;
  edges.criterion = ShapeCriterion::edge_length;
  edges.edge_factor = 1.0;
  const auto add = [](const char* name, auto function) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond);
  };
  add("poles/integers", [](auto& state) { restore<std::int32_t>(state, {}); });
  add("poles/doubles", [](auto& state) { restore<double>(state, {}); });
  add("flood/integers", [=](auto& state) { restore<std::int32_t>(state, flood); });
  add("flood/doubles", [=](auto& state) { restore<double>(state, flood); });
  add("flood/no guard", [=](auto& state) { restore<std::int32_t>(state, no_guard); });
  add("flood/edge length", [=](auto& state) { restore<std::int32_t>(state, edges); });
  add("published", [=](auto& state) { restore<std::int32_t>(state, published); });
  add("smooth/taubin", [](auto& state) { smooth_torus(state, SurfaceSmoothing::taubin); });
  add("smooth/bilateral", [](auto& state) { smooth_torus(state, SurfaceSmoothing::bilateral); });
  add("vertex normals", normals_of_torus);
  const auto add_update = [&](const std::string& name, const ShapeOptions& options) {
    for (const Change change : {Change::expand, Change::collapse}) {
      const std::string of = change == Change::expand ? "/expand" : "/collapse";
      for (auto* function : {&update<std::int32_t>, &update<double>}) {
        const bool integers = function == &update<std::int32_t>;
        benchmark::RegisterBenchmark((name + of + (integers ? "/integers" : "/doubles")).c_str(),
                                     [=](auto& state) { function(state, options, change); })
            ->Unit(benchmark::kMillisecond)
            ->UseManualTime();
      }
    }
  };
  add_update("poles", {});
  add_update("flood", flood);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
