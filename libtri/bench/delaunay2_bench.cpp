// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the planar triangulation with CGAL's Delaunay_triangulation_2 with EPICK, in one run on
// the same points. Uniform: 1,000,000 points of 26 bits. Grid: 1000 x 1000, in random order.
// Clusters: 500 compact ones, each the 300 points nearest to a centre on a lattice.
//
// items_per_second counts points and is a median of 5 rounds. A round of a cluster row removes
// (collapse) or inserts (expand) all clusters once. Restoring the state afterwards is not timed.
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <benchmark/benchmark.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "terrace/tri/delaunay2.hpp"

namespace {

using terrace::tri::Delaunay2;
using terrace::tri::VertexId;
using Cells = std::array<std::int32_t, 2>;  // any input point

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;
const std::uint32_t kSide = kSmall ? 100 : 1000;
const std::uint32_t kClustersPerRow = kSmall ? 2 : 25;
const std::uint32_t kClustersPerColumn = kSmall ? 2 : 20;
const std::size_t kClusterSize = kSmall ? 30 : 300;

enum Input { kUniform, kGrid };

const std::vector<Cells>& input_points(Input input) {
  static std::map<Input, std::vector<Cells>> cache;
  std::vector<Cells>& points = cache[input];
  if (!points.empty()) return points;
  std::mt19937_64 random(1);
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kSide; ++i) {
      if (input == kGrid) {
        points.push_back({static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)});
      } else {
        points.push_back(
            {static_cast<std::int32_t>(random() >> 38), static_cast<std::int32_t>(random() >> 38)});
      }
    }
  }
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

/// Indices of the points of each cluster, along a Hilbert curve as in a store, and of a point near
/// the cluster that is not in any.
struct Cluster {
  std::vector<std::uint32_t> members;
  std::uint32_t outside = 0;
};

std::vector<Cluster> find_clusters(const std::vector<Cells>& points) {
  Delaunay2<std::int32_t> triangulation;
  const std::vector<VertexId> vertices = triangulation.build(points);
  std::vector<std::uint32_t> point_of(triangulation.vertex_slots());
  for (std::uint32_t i = 0; i < points.size(); ++i) point_of[slot(vertices[i])] = i;
  std::int64_t extent = 0;
  for (const Cells& p : points) extent = std::max<std::int64_t>(extent, p[0]);

  std::vector<Cluster> clusters;
  std::vector<char> used(triangulation.vertex_slots());
  std::vector<VertexId> neighbours;
  for (std::uint32_t j = 0; j < kClustersPerColumn; ++j) {
    for (std::uint32_t i = 0; i < kClustersPerRow; ++i) {
      const Cells centre{
          static_cast<std::int32_t>(extent * (2 * i + 1) / (2 * kClustersPerRow)),
          static_cast<std::int32_t>(extent * (2 * j + 1) / (2 * kClustersPerColumn))};
      const auto distance = [&](VertexId v) {
        const Cells p = triangulation.point(v);
        const std::int64_t x = p[0] - centre[0];
        const std::int64_t y = p[1] - centre[1];
        return x * x + y * y;
      };
      // Breadth-first, far enough to include the nearest points.
      std::vector<VertexId> found{triangulation.nearest(centre)};
      used[slot(found[0])] = 1;
      for (std::size_t k = 0; found.size() < 3 * kClusterSize; ++k) {
        triangulation.adjacent(found[k], neighbours);
        for (const VertexId v : neighbours) {
          if (used[slot(v)] == 0) found.push_back(v);
          used[slot(v)] = 1;
        }
      }
      for (const VertexId v : found) used[slot(v)] = 0;
      std::sort(found.begin(), found.end(), [&](VertexId a, VertexId b) {
        return std::pair(distance(a), slot(a)) < std::pair(distance(b), slot(b));
      });
      Cluster cluster;
      cluster.outside = point_of[slot(found[kClusterSize])];
      found.resize(kClusterSize);
      std::sort(found.begin(), found.end());
      for (const VertexId v : found) cluster.members.push_back(point_of[slot(v)]);
      clusters.push_back(std::move(cluster));
    }
  }
  std::mt19937_64 random(2);
  std::shuffle(clusters.begin(), clusters.end(), random);
  return clusters;
}

const std::vector<Cluster>& input_clusters(Input input) {
  static std::map<Input, std::vector<Cluster>> cache;
  std::vector<Cluster>& clusters = cache[input];
  if (clusters.empty()) clusters = find_clusters(input_points(input));
  return clusters;
}

enum Order { kHilbert, kRandom };

std::vector<Cluster> ordered_clusters(Input input, Order order) {
  std::vector<Cluster> clusters = input_clusters(input);
  std::mt19937_64 random(3);
  if (order == kRandom)
    for (Cluster& cluster : clusters)
      std::shuffle(cluster.members.begin(), cluster.members.end(), random);
  return clusters;
}

/// One interface for both triangulations. Points and handles of a cluster are contiguous, as a
/// store delivers them.
template <class Coord>
struct Ours {
  using Point = std::array<Coord, 2>;
  struct Members {
    std::vector<Point> points;
    std::vector<typename Delaunay2<Coord>::Insertion> vertices;
    VertexId outside;
  };
  std::vector<Point> points;
  Delaunay2<Coord> triangulation;
  std::vector<VertexId> vertex;
  std::vector<Members> clusters;
  std::vector<VertexId> set;

  explicit Ours(const std::vector<Cells>& input) {
    for (const Cells& p : input)
      points.push_back({static_cast<Coord>(p[0]), static_cast<Coord>(p[1])});
  }
  void build() { vertex = triangulation.build(points); }
  void find(const std::vector<Cluster>& all) {
    for (const Cluster& cluster : all) {
      Members& members = clusters.emplace_back();
      members.outside = vertex[cluster.outside];
      for (const std::uint32_t i : cluster.members) {
        members.points.push_back(points[i]);
        members.vertices.push_back({vertex[i], true});
      }
    }
  }
  void remove_one_by_one(const Members& members) {
    for (const auto& insertion : members.vertices) triangulation.remove(insertion.vertex);
  }
  void remove_set(const Members& members) {
    set.clear();
    for (const auto& insertion : members.vertices) set.push_back(insertion.vertex);
    triangulation.remove(std::span<const VertexId>(set));
  }
  void insert(Members& members) {
    triangulation.insert(members.points, members.vertices, members.outside);
  }
};

struct Cgal {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Triangulation = CGAL::Delaunay_triangulation_2<Kernel>;
  using Vertex = Triangulation::Vertex_handle;
  struct Members {
    std::vector<Kernel::Point_2> points;
    std::vector<Vertex> vertices;
    Vertex outside;
  };
  std::vector<Kernel::Point_2> points;
  Triangulation triangulation;
  std::vector<Members> clusters;

  explicit Cgal(const std::vector<Cells>& input) {
    for (const Cells& p : input) points.emplace_back(p[0], p[1]);
  }
  void build() { triangulation.insert(points.begin(), points.end()); }
  void find(const std::vector<Cluster>& all) {
    const auto find_vertex = [&](std::uint32_t i) {
      return triangulation.nearest_vertex(points[i], clusters.back().outside == Vertex()
                                                         ? Triangulation::Face_handle()
                                                         : clusters.back().outside->face());
    };
    for (const Cluster& cluster : all) {
      Members& members = clusters.emplace_back();
      members.outside = find_vertex(cluster.outside);
      for (const std::uint32_t i : cluster.members) {
        members.points.push_back(points[i]);
        members.vertices.push_back(find_vertex(i));
      }
    }
  }
  void remove_one_by_one(const Members& members) {
    for (const Vertex v : members.vertices) triangulation.remove(v);
  }
  void insert(Members& members) {
    Vertex hint = members.outside;
    for (std::size_t i = 0; i < members.points.size(); ++i)
      hint = members.vertices[i] = triangulation.insert(members.points[i], hint->face());
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

/// Times `rounds` calls of round(), which returns seconds, and reports the median. Counters give
/// the slowest and the fastest, in points per second.
template <class Round>
void measure(benchmark::State& state, std::size_t points, Round round) {
  std::vector<double> seconds(kSmall ? 1 : 5);
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
  measure(state, input.size(), [&] {
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

template <class Coord>
void complete_grid(benchmark::State& state) {
  measure(state, std::size_t{kSide} * kSide, [] {
    Delaunay2<Coord> triangulation;
    const Stopwatch watch;
    triangulation.build_grid(0, 0, 1, kSide, kSide);
    return watch.seconds();
  });
}

enum Action { kExpand, kCollapseSets, kCollapseOneByOne };

template <class Engine, Action kAction>
void clusters(benchmark::State& state) {
  const auto input = static_cast<Input>(state.range(0));
  const std::vector<Cluster> all = ordered_clusters(input, static_cast<Order>(state.range(1)));
  Engine engine(input_points(input));
  engine.build();
  engine.find(all);
  const auto insert = [&] {
    for (auto& members : engine.clusters) engine.insert(members);
  };
  const auto remove = [&] {
    for (const auto& members : engine.clusters) {
      if constexpr (kAction == kCollapseSets) {
        engine.remove_set(members);
      } else {
        engine.remove_one_by_one(members);
      }
    }
  };
  // The first round is a warm-up, so that memory is allocated.
  remove();
  insert();
  measure(state, all.size() * kClusterSize, [&] {
    const Stopwatch removal;
    remove();
    const double removing = removal.seconds();
    const Stopwatch insertion;
    insert();
    return kAction == kExpand ? insertion.seconds() : removing;
  });
}

void once(benchmark::internal::Benchmark* row) {
  row->UseManualTime()->Iterations(1)->Unit(benchmark::kMillisecond);
}
void inputs(benchmark::internal::Benchmark* row) {
  once(row);
  row->ArgName("grid")->Arg(kUniform)->Arg(kGrid);
}
void inputs_and_orders(benchmark::internal::Benchmark* row) {
  once(row);
  row->ArgNames({"grid", "random_order"})->ArgsProduct({{kUniform, kGrid}, {kHilbert, kRandom}});
}

using OursInt = Ours<std::int32_t>;
using OursDouble = Ours<double>;

BENCHMARK(bulk<Cgal>)->Apply(inputs);
BENCHMARK(bulk<OursInt>)->Apply(inputs);
BENCHMARK(bulk<OursDouble>)->Apply(inputs);
BENCHMARK(complete_grid<std::int32_t>)->Apply(once);
BENCHMARK(complete_grid<double>)->Apply(once);
BENCHMARK(clusters<Cgal, kExpand>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursInt, kExpand>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursDouble, kExpand>)->Apply(inputs_and_orders);
BENCHMARK(clusters<Cgal, kCollapseOneByOne>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursInt, kCollapseOneByOne>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursInt, kCollapseSets>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursDouble, kCollapseOneByOne>)->Apply(inputs_and_orders);
BENCHMARK(clusters<OursDouble, kCollapseSets>)->Apply(inputs_and_orders);

}  // namespace

BENCHMARK_MAIN();
