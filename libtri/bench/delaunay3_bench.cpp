// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the spatial triangulation with CGAL's Delaunay_triangulation_3 with EPICK, in one run on
// the same points, all in random order. Cube: 200,000 uniform points of 21 bits. Torus: as many on
// a torus of radii 1 and 0.4 with radial noise of 0.001, rounded to 21 bits. Grid: 60^3, where
// every cube is cospherical. Clusters: 200 compact ones, each the 100 points nearest to a random
// point.
//
// items_per_second counts points and is a median of 5 rounds (CGAL's removal: 1). A round of a
// cluster row removes or inserts all clusters once. Restoring the state afterwards is not timed.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <benchmark/benchmark.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "terrace/tri/delaunay3.hpp"

namespace {

using terrace::tri::Delaunay3;
using terrace::tri::VertexId;
using Cells = std::array<std::int32_t, 3>;  // any input point

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::uint32_t kSide = kSmall ? 12 : 60;
const std::size_t kCount = kSmall ? 2000 : 200'000;
const std::size_t kClusters = kSmall ? 4 : 200;
const std::size_t kClusterSize = kSmall ? 20 : 100;

enum Input { kCube, kTorus, kGrid };

std::vector<Cells> make_points(Input input) {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto cell = [](double c) { return static_cast<std::int32_t>(c * 0x1p21); };
  std::vector<Cells> points;
  if (input == kGrid) {
    for (std::uint32_t i = 0; i < kSide * kSide * kSide; ++i)
      points.push_back({static_cast<std::int32_t>(i % kSide),
                        static_cast<std::int32_t>(i / kSide % kSide),
                        static_cast<std::int32_t>(i / kSide / kSide)});
  }
  while (points.size() < kCount) {
    if (input == kCube) {
      points.push_back({cell(unit()), cell(unit()), cell(unit())});
      continue;
    }
    // The noise is normal, by the Box-Muller transform. Rejection makes the points uniform in area.
    const double u = 2 * M_PI * unit();
    const double v = 2 * M_PI * unit();
    if (unit() * 1.4 > 1 + 0.4 * std::cos(v)) continue;
    const double noise = std::sqrt(-2 * std::log(1 - unit())) * std::cos(2 * M_PI * unit());
    const double r = 0.4 + 0.001 * noise;
    const double ring = 1 + r * std::cos(v);
    points.push_back({cell((ring * std::cos(u) + 1.5) / 3), cell((ring * std::sin(u) + 1.5) / 3),
                      cell((r * std::sin(v) + 1.5) / 3)});
  }
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

const std::vector<Cells>& input_points(Input input) {
  static std::map<Input, std::vector<Cells>> cache;
  std::vector<Cells>& points = cache[input];
  if (points.empty()) points = make_points(input);
  return points;
}

/// Indices of the points of each cluster, in random order, and of a point near the cluster that is
/// not in any.
struct Cluster {
  std::vector<std::uint32_t> members;
  std::uint32_t outside = 0;
};

std::vector<Cluster> find_clusters(const std::vector<Cells>& points) {
  Delaunay3<std::int32_t> triangulation;
  const std::vector<VertexId> vertices = triangulation.build(points);
  std::vector<std::uint32_t> point_of(triangulation.vertex_slots());
  for (std::uint32_t i = 0; i < points.size(); ++i) point_of[slot(vertices[i])] = i;
  std::mt19937_64 random(2);
  std::vector<Cluster> clusters;
  std::vector<char> used(triangulation.vertex_slots());  // 1: in a list, 2: in a cluster or next to
                                                         // one
  std::vector<VertexId> neighbours;
  while (clusters.size() < kClusters) {
    const VertexId centre = vertices[random() % vertices.size()];
    const auto distance = [&](VertexId v) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double d = triangulation.point(v)[k] - triangulation.point(centre)[k];
        square += d * d;
      }
      return square;
    };
    // Breadth-first, far enough to include the nearest points.
    std::vector<VertexId> found{centre};
    for (std::size_t k = 0; k < found.size() && found.size() < 8 * kClusterSize; ++k) {
      triangulation.adjacent(found[k], neighbours);
      for (const VertexId v : neighbours)
        if (std::find(found.begin(), found.end(), v) == found.end()) found.push_back(v);
    }
    std::sort(found.begin(), found.end(), [&](VertexId a, VertexId b) {
      return std::pair(distance(a), slot(a)) < std::pair(distance(b), slot(b));
    });
    found.resize(kClusterSize + 1);
    if (std::any_of(found.begin(), found.end(), [&](VertexId v) { return used[slot(v)] != 0; }))
      continue;
    for (const VertexId v : found) used[slot(v)] = 1;
    Cluster cluster;
    cluster.outside = point_of[slot(found.back())];
    found.pop_back();
    for (const VertexId v : found) cluster.members.push_back(point_of[slot(v)]);
    std::shuffle(cluster.members.begin(), cluster.members.end(), random);
    clusters.push_back(std::move(cluster));
  }
  return clusters;
}

const std::vector<Cluster>& input_clusters(Input input) {
  static std::map<Input, std::vector<Cluster>> cache;
  std::vector<Cluster>& clusters = cache[input];
  if (clusters.empty()) clusters = find_clusters(input_points(input));
  return clusters;
}

/// One interface for both triangulations. Points and handles of a cluster are contiguous.
template <class Coord>
struct Ours {
  static constexpr std::size_t kRounds = 5;
  using Point = std::array<Coord, 3>;
  struct Members {
    std::vector<Point> points;
    std::vector<VertexId> vertices;
    VertexId outside;
  };
  std::vector<Point> points;
  Delaunay3<Coord> triangulation;
  std::vector<VertexId> vertex;
  std::vector<Members> clusters;

  explicit Ours(const std::vector<Cells>& input) {
    for (const Cells& p : input)
      points.push_back(
          {static_cast<Coord>(p[0]), static_cast<Coord>(p[1]), static_cast<Coord>(p[2])});
  }
  void build() { vertex = triangulation.build(points); }
  void find(const std::vector<Cluster>& all) {
    for (const Cluster& cluster : all) {
      Members& members = clusters.emplace_back();
      members.outside = vertex[cluster.outside];
      for (const std::uint32_t i : cluster.members) {
        members.points.push_back(points[i]);
        members.vertices.push_back(vertex[i]);
      }
    }
  }
  void remove_one_by_one(Members& members) {
    for (const VertexId v : members.vertices) triangulation.remove(v);
  }
  void remove_set(Members& members) {
    triangulation.remove(std::span<const VertexId>(members.vertices));
  }
  void insert(Members& members) {
    VertexId hint = members.outside;
    for (std::size_t i = 0; i < members.points.size(); ++i)
      hint = members.vertices[i] = triangulation.insert(members.points[i], hint).vertex;
  }
};

struct Cgal {
  static constexpr std::size_t kRounds = 1;
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Base = CGAL::Triangulation_vertex_base_with_info_3<std::uint32_t, Kernel>;
  using Triangulation = CGAL::Delaunay_triangulation_3<
      Kernel,
      CGAL::Triangulation_data_structure_3<Base, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;
  using Vertex = Triangulation::Vertex_handle;
  struct Members {
    std::vector<Kernel::Point_3> points;
    std::vector<Vertex> vertices;
    Vertex outside;
  };
  std::vector<std::pair<Kernel::Point_3, std::uint32_t>> points;
  Triangulation triangulation;
  std::vector<Members> clusters;

  explicit Cgal(const std::vector<Cells>& input) {
    for (std::uint32_t i = 0; i < input.size(); ++i)
      points.emplace_back(Kernel::Point_3(input[i][0], input[i][1], input[i][2]), i);
  }
  void build() { triangulation.insert(points.begin(), points.end()); }
  void find(const std::vector<Cluster>& all) {
    std::vector<Vertex> vertex(points.size());
    for (const Vertex v : triangulation.finite_vertex_handles()) vertex[v->info()] = v;
    for (const Cluster& cluster : all) {
      Members& members = clusters.emplace_back();
      members.outside = vertex[cluster.outside];
      for (const std::uint32_t i : cluster.members) {
        members.points.push_back(points[i].first);
        members.vertices.push_back(vertex[i]);
      }
    }
  }
  void remove_one_by_one(Members& members) {
    for (const Vertex v : members.vertices) triangulation.remove(v);
  }
  void remove_set(Members& members) {
    triangulation.remove_cluster(members.vertices.begin(), members.vertices.end());
  }
  void insert(Members& members) {
    Vertex hint = members.outside;
    for (std::size_t i = 0; i < members.points.size(); ++i)
      hint = members.vertices[i] = triangulation.insert(members.points[i], hint);
  }
};

/// CPU time of the process, which has one thread. It is less affected by other load on the machine
/// than wall time.
class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC;
  }

 private:
  std::clock_t start_ = std::clock();
};

/// VmRSS or VmHWM in bytes, or 0 if there is no such file.
double resident(const std::string& key) {
  std::ifstream file("/proc/self/status");
  std::string word;
  while (file >> word)
    if (word == key + ":" && file >> word) return std::stod(word) * 1024;
  return 0;
}

/// Resets the peak of resident memory to the current value.
void start_peak() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// Times calls of round(), which returns seconds, and reports the median. Counters give the slowest
/// and the fastest, in points per second.
template <class Round>
void measure(benchmark::State& state, std::size_t points, std::size_t rounds, Round round) {
  std::vector<double> seconds(kSmall ? 1 : rounds);
  for (auto _ : state) {
    for (double& s : seconds) s = round();
    std::sort(seconds.begin(), seconds.end());
    state.SetIterationTime(seconds[seconds.size() / 2]);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(points));
  state.counters["slowest"] = static_cast<double>(points) / seconds.back();
  state.counters["fastest"] = static_cast<double>(points) / seconds.front();
}

template <class Engine>
void bulk(benchmark::State& state) {
  const auto& input = input_points(static_cast<Input>(state.range(0)));
  double peak = 0;
  double bytes_per_point = 0;
  measure(state, input.size(), 3, [&] {
    Engine engine(input);
    start_peak();
    const double before = resident("VmRSS");
    const Stopwatch watch;
    engine.build();
    const double seconds = watch.seconds();
    peak = std::max(peak, resident("VmHWM") - before);
    if constexpr (!std::is_same_v<Engine, Cgal>)
      bytes_per_point = static_cast<double>(engine.triangulation.memory_bytes()) /
                        static_cast<double>(engine.triangulation.vertex_count());
    return seconds;
  });
  state.counters["peak_B/pt"] = peak / static_cast<double>(input.size());
  if (bytes_per_point > 0) state.counters["held_B/pt"] = bytes_per_point;
}

/// Measures the wall time of bulk construction by one or two threads. Run it on two idle cores.
template <class Coord>
void bulk_by_threads(benchmark::State& state) {
  const auto& input = input_points(static_cast<Input>(state.range(0)));
  const Ours<Coord> points(input);
  measure(state, input.size(), 5, [&] {
    Delaunay3<Coord> triangulation;
    const auto start = std::chrono::steady_clock::now();
    triangulation.build(points.points, static_cast<unsigned>(state.range(1)));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  });
}

enum Action { kInsert, kRemoveSets, kRemoveOneByOne };

template <class Engine, Action kAction>
void clusters(benchmark::State& state) {
  const auto input = static_cast<Input>(state.range(0));
  const std::vector<Cluster>& all = input_clusters(input);
  Engine engine(input_points(input));
  engine.build();
  engine.find(all);
  const auto insert = [&] {
    for (auto& members : engine.clusters) engine.insert(members);
  };
  const auto remove = [&] {
    for (auto& members : engine.clusters) {
      if constexpr (kAction == kRemoveOneByOne) {
        engine.remove_one_by_one(members);
      } else {
        engine.remove_set(members);
      }
    }
  };
  // The first round is a warm-up, so that memory is allocated.
  remove();
  insert();
  measure(state, all.size() * kClusterSize, kAction == kInsert ? 3 : Engine::kRounds, [&] {
    const Stopwatch removal;
    remove();
    const double removing = removal.seconds();
    const Stopwatch insertion;
    insert();
    return kAction == kInsert ? insertion.seconds() : removing;
  });
}

void inputs(benchmark::internal::Benchmark* row) {
  row->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
  row->ArgName("input")->Arg(kCube)->Arg(kTorus)->Arg(kGrid);
}

void inputs_and_threads(benchmark::internal::Benchmark* row) {
  row->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
  row->ArgNames({"input", "threads"})->ArgsProduct({{kCube, kTorus, kGrid}, {1, 2}});
}

using OursInt = Ours<std::int32_t>;
using OursDouble = Ours<double>;

BENCHMARK(bulk<Cgal>)->Apply(inputs);
BENCHMARK(bulk<OursInt>)->Apply(inputs);
BENCHMARK(bulk<OursDouble>)->Apply(inputs);
BENCHMARK(bulk_by_threads<std::int32_t>)->Apply(inputs_and_threads);
BENCHMARK(bulk_by_threads<double>)->Apply(inputs_and_threads);
BENCHMARK(clusters<Cgal, kInsert>)->Apply(inputs);
BENCHMARK(clusters<OursInt, kInsert>)->Apply(inputs);
BENCHMARK(clusters<OursDouble, kInsert>)->Apply(inputs);
BENCHMARK(clusters<Cgal, kRemoveOneByOne>)->Apply(inputs);
BENCHMARK(clusters<OursInt, kRemoveOneByOne>)->Apply(inputs);
BENCHMARK(clusters<OursDouble, kRemoveOneByOne>)->Apply(inputs);
BENCHMARK(clusters<Cgal, kRemoveSets>)->Apply(inputs);
BENCHMARK(clusters<OursInt, kRemoveSets>)->Apply(inputs);
BENCHMARK(clusters<OursDouble, kRemoveSets>)->Apply(inputs);

}  // namespace

BENCHMARK_MAIN();
