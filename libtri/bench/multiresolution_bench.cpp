// SPDX-License-Identifier: Apache-2.0
// Measures how the time of expanding and collapsing is divided between the triangulation, its
// journal, the source and the model's own bookkeeping. Times are in microseconds per cluster (for
// the moving focus, per step). `own/tri` is the model's own share relative to the triangulation's,
// which the project keeps below 1.
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <tuple>

#include <benchmark/benchmark.h>

#include "model/multiresolution.hpp"
#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/multiresolution.hpp"

namespace terrace::tri::bench {
namespace {

using Triangulation = Timed<Delaunay2<std::int32_t>>;
using Model = MultiresolutionModel<Triangulation>;

enum Kind { kGrid, kRandom };

int side() { return std::getenv("TERRACE_BENCH_SMALL") ? 128 : 2048; }

/// Clusters of about 140 points, two levels of them below the root.
ArraySource& source(Kind kind) {
  static std::map<Kind, ArraySource> hierarchies;
  const auto found = hierarchies.find(kind);
  if (found != hierarchies.end()) return found->second;
  std::mt19937_64 random(1);
  const std::size_t count = static_cast<std::size_t>(side()) * static_cast<std::size_t>(side());
  return hierarchies[kind] = make_hierarchy(
             kind == kGrid ? grid_points(side()) : random_points(count, random), 2, 140.0, random);
}

/// Collects the shares over all iterations of a benchmark.
class Shares {
 public:
  Shares(benchmark::State& state, ArraySource& source) : state_(state), source_(source) {}
  /// Runs a step and records its time. Returns the number of points added or removed.
  template <class Step>
  void run(const Model& model, Step&& step) {
    const double tri = Triangulation::seconds(), journal = Triangulation::journal_seconds();
    const double src = source_.seconds;
    const std::size_t points = model.point_count(), clusters = model.expanded_count();
    double total = 0.0;
    {
      const Lap lap(total);
      step();
    }
    total_ += total;
    tri_ += Triangulation::seconds() - tri;
    journal_ += Triangulation::journal_seconds() - journal;
    src_ += source_.seconds - src;
    points_ += difference(points, model.point_count());
    clusters_ += difference(clusters, model.expanded_count());
  }
  /// Counts a step instead of clusters, for steps that both add and remove.
  void count_step(double points) {
    ++steps_;
    step_points_ += points;
  }
  void report() const {
    const double counted = steps_ > 0 ? steps_ : clusters_;
    const double per = 1e6 / std::max(counted, 1.0);
    const double own = total_ - tri_ - journal_ - src_;
    state_.SetItemsProcessed(static_cast<std::int64_t>(steps_ > 0 ? step_points_ : points_));
    state_.counters["count"] = counted / static_cast<double>(state_.iterations());
    state_.counters["tri_us"] = tri_ * per;
    state_.counters["journal_us"] = journal_ * per;
    state_.counters["source_us"] = src_ * per;
    state_.counters["own_us"] = own * per;
    state_.counters["own/tri"] = own / tri_;
  }
  [[nodiscard]] double total() const { return total_; }

 private:
  static double difference(std::size_t a, std::size_t b) {
    return static_cast<double>(a < b ? b - a : a - b);
  }
  benchmark::State& state_;
  ArraySource& source_;
  double total_ = 0, tri_ = 0, journal_ = 0, src_ = 0, points_ = 0, clusters_ = 0;
  double steps_ = 0, step_points_ = 0;
};

/// 500 scattered clusters of level 0, each in its own step, on top of a model of level 1.
void expand_one_by_one(benchmark::State& state, Kind kind, bool deltas, bool measure_collapse) {
  ArraySource& src = source(kind);
  Model model(src, {1, {}}, {deltas});
  std::mt19937_64 random(2);
  std::vector<ClusterId> ids;
  const std::size_t all = static_cast<std::size_t>(src.cluster_count(0));
  for (std::size_t i = 0; i < std::min<std::size_t>(500, all); ++i) {
    ids.push_back(
        cluster_id(0, static_cast<std::uint64_t>(unit(random) * static_cast<double>(all))));
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (std::size_t i = ids.size(); i > 1; --i) {
    std::swap(ids[i - 1], ids[static_cast<std::size_t>(unit(random) * static_cast<double>(i))]);
  }
  Shares shares(state, src);
  for (auto _ : state) {
    const double before = shares.total();
    const auto expand = [&] {
      for (const ClusterId id : ids) benchmark::DoNotOptimize(&model.expand(id));
    };
    const auto collapse = [&] {
      for (const ClusterId id : ids) benchmark::DoNotOptimize(&model.collapse(id));
    };
    if (measure_collapse) {
      expand();
      shares.run(model, collapse);
    } else {
      shares.run(model, expand);
      collapse();
    }
    state.SetIterationTime(shares.total() - before);
  }
  shares.report();
}

/// The whole hierarchy in one step, starting from the root alone.
void whole_level(benchmark::State& state, Kind kind, bool deltas, bool measure_collapse) {
  ArraySource& src = source(kind);
  Model model(src, {}, {deltas});
  Shares shares(state, src);
  for (auto _ : state) {
    const double before = shares.total();
    const auto down = [&] { benchmark::DoNotOptimize(&model.set_level(0)); };
    const auto up = [&] { benchmark::DoNotOptimize(&model.set_level(Detail::kTop)); };
    if (measure_collapse) {
      down();
      shares.run(model, up);
    } else {
      shares.run(model, down);
      up();
    }
    state.SetIterationTime(shares.total() - before);
  }
  shares.report();
}

/// A square focus of about 40,000 points of level 0 that moves by a quarter of its side per step.
void moving_focus(benchmark::State& state, Kind kind) {
  ArraySource& src = source(kind);
  Model model(src, {1, {}});
  const double extent = kind == kGrid ? side() : 0x1p26;
  const double size = std::min(200.0 / side(), 0.5) * extent;
  double at = 0.0;
  Shares shares(state, src);
  for (auto _ : state) {
    const double before = shares.total();
    at = at + size > extent ? 0.0 : at + size / 4;
    const Detail detail{1, {{box2(at, extent / 3, at + size, extent / 3 + size), 0}}};
    const Model::Delta* delta = nullptr;
    shares.run(model, [&] { delta = &model.set_detail(detail); });
    shares.count_step(static_cast<double>(delta->changes.added_vertices.size() +
                                          delta->changes.removed_vertices.size()));
    state.SetIterationTime(shares.total() - before);
  }
  state.counters["vertices"] = static_cast<double>(model.triangulation().vertex_count());
  shares.report();
}

/// Builds from scratch, with all points in bulk. Reports the bytes per vertex of model and
/// triangulation.
void start(benchmark::State& state, Kind kind) {
  ArraySource& src = source(kind);
  for (auto _ : state) {
    double total = 0.0, before = Triangulation::seconds(), before_source = src.seconds;
    std::unique_ptr<Model> model;
    {
      const Lap lap(total);
      model = std::make_unique<Model>(src, Detail{0, {}}, ModelOptions{false});
    }
    state.SetIterationTime(total);
    const double vertices = static_cast<double>(model->triangulation().vertex_count());
    const double tri = Triangulation::seconds() - before;
    state.counters["own/tri"] = (total - tri - (src.seconds - before_source)) / tri;
    state.counters["model_B/vertex"] = static_cast<double>(model->memory_bytes()) / vertices;
    state.counters["tri_B/vertex"] =
        static_cast<double>(model->triangulation().inner().memory_bytes()) / vertices;
    state.SetItemsProcessed(state.items_processed() + static_cast<std::int64_t>(vertices));
  }
}

#define TERRACE_BENCH(name, ...) \
  BENCHMARK_CAPTURE(__VA_ARGS__)->Name(name)->UseManualTime()->Unit(benchmark::kMillisecond)

TERRACE_BENCH("expand/grid", expand_one_by_one, g, kGrid, true, false);
TERRACE_BENCH("expand/random", expand_one_by_one, r, kRandom, true, false);
TERRACE_BENCH("expand/grid/no_deltas", expand_one_by_one, gn, kGrid, false, false);
TERRACE_BENCH("collapse/grid", expand_one_by_one, g, kGrid, true, true);
TERRACE_BENCH("collapse/random", expand_one_by_one, r, kRandom, true, true);
TERRACE_BENCH("collapse/grid/no_deltas", expand_one_by_one, gn, kGrid, false, true);
TERRACE_BENCH("set_level_0/grid", whole_level, g, kGrid, true, false);
TERRACE_BENCH("set_level_0/random", whole_level, r, kRandom, true, false);
TERRACE_BENCH("set_level_top/grid", whole_level, g, kGrid, true, true);
TERRACE_BENCH("set_level_top/random", whole_level, r, kRandom, true, true);
TERRACE_BENCH("moving_focus/grid", moving_focus, g, kGrid);
TERRACE_BENCH("moving_focus/random", moving_focus, r, kRandom);
TERRACE_BENCH("start_level_0/grid", start, g, kGrid);
TERRACE_BENCH("start_level_0/random", start, r, kRandom);

}  // namespace
}  // namespace terrace::tri::bench

BENCHMARK_MAIN();
