// SPDX-License-Identifier: GPL-3.0-or-later
// The cost of reading and expanding a store: the one that TERRACE_BENCH_STORE names, or else one
// made here from a fractal elevation model. Expansions are compared with CGAL's Delaunay
// triangulation, given the same points in the same order.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <benchmark/benchmark.h>
#include <terrace/stream/store.hpp>
#include <terrace/tri/delaunay2.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "cli/cli.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_source.hpp"

namespace {

using terrace::stream::ClusterId;
using terrace::stream::ClusterPoints;
using terrace::stream::Store;

bool small() { return std::getenv("TERRACE_BENCH_SMALL") != nullptr; }

const Store& store() {
  static const terrace::tests::TemporaryFolder folder;
  static const Store opened = [] {
    if (const char* given = std::getenv("TERRACE_BENCH_STORE")) return Store::open(given);
    const std::string dem = (folder.path() / "dem.tif").string();
    const std::array<const char*, 7> synth{
        "terrace", "synth", "dem", "--size", small() ? "256x256" : "4096x4096", "-o", dem.c_str()};
    if (terrace::tools::run_command_line(static_cast<int>(synth.size()), synth.data()) != 0)
      std::exit(1);
    terrace::terrain::BuildRequest request;
    request.inputs = {dem};
    request.store = folder.path() / "dem.store";
    terrace::terrain::build_store(request, {.threads = 2});
    return Store::open(request.store);
  }();
  return opened;
}

void read_everything(benchmark::State& state) {
  const Store& source = store();  // make the store before the clock starts
  std::int64_t points = 0;
  for (auto _ : state) {
    for (unsigned level = 0; level <= source.top(); ++level) {
      source.for_each(level, [&](ClusterId, const terrace::stream::ClusterRecord&,
                                 const ClusterPoints& cluster) {
        points += static_cast<std::int64_t>(cluster.size());
        benchmark::DoNotOptimize(cluster.positions.data());
      });
    }
  }
  state.SetItemsProcessed(points);
}
BENCHMARK(read_everything)->Unit(benchmark::kMillisecond);

void random_cluster(benchmark::State& state) {
  const std::uint64_t clusters = store().levels()[0].clusters;
  std::mt19937_64 random(1);
  ClusterPoints points;
  for (auto _ : state) {
    const ClusterId id =
        terrace::stream::cluster_id(0, random() % std::max<std::uint64_t>(1, clusters));
    benchmark::DoNotOptimize(store().record(id));
    store().read(id, points);
  }
}
BENCHMARK(random_cluster)->Unit(benchmark::kMicrosecond);

/// The members of 500 clusters of level 0 spread over the store, and the points of level 1 and
/// above as the base in which they are expanded.
struct Expansion {
  std::vector<std::array<std::int32_t, 2>> base;
  std::vector<std::vector<std::array<std::int32_t, 2>>> clusters;
  std::vector<std::array<std::int32_t, 2>> heads;
  std::int64_t points = 0;
};

std::array<std::int32_t, 2> column_row(const terrace::stream::Point3& p) {
  return {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1])};
}

const Expansion& expansion() {
  static const Expansion made = [] {
    Expansion e;
    for (unsigned level = 1; level <= store().top(); ++level) {
      store().for_each(level, [&](ClusterId, const terrace::stream::ClusterRecord&,
                                  const ClusterPoints& cluster) {
        for (const auto& p : cluster.positions) e.base.push_back(column_row(p));
      });
    }
    const std::uint64_t clusters = store().levels()[0].clusters;
    ClusterPoints points;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(500, clusters); ++i) {
      store().read(terrace::stream::cluster_id(0, i * clusters / 500 % clusters), points);
      e.clusters.emplace_back();
      for (const auto& p : points.positions) e.clusters.back().push_back(column_row(p));
      e.heads.push_back(column_row(points.representative));
      e.points += static_cast<std::int64_t>(points.size());
    }
    return e;
  }();
  return made;
}

void expand_terrace(benchmark::State& state) {
  const Expansion& e = expansion();
  std::vector<terrace::tri::Delaunay2<std::int32_t>::Insertion> inserted;
  for (auto _ : state) {
    state.PauseTiming();
    auto triangulation = std::make_unique<terrace::tri::Delaunay2<std::int32_t>>();
    triangulation->build(e.base);
    std::vector<terrace::tri::VertexId> heads;
    for (const auto& head : e.heads) heads.push_back(triangulation->nearest(head));
    // Allocate memory first, as in a session that has run for a while.
    std::vector<std::vector<terrace::tri::VertexId>> sets(e.clusters.size());
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      inserted.resize(e.clusters[c].size());
      triangulation->insert(e.clusters[c], inserted, heads[c]);
      for (const auto& i : inserted) sets[c].push_back(i.vertex);
    }
    for (const auto& set : sets) triangulation->remove(set);
    state.ResumeTiming();
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      inserted.resize(e.clusters[c].size());
      triangulation->insert(e.clusters[c], inserted, heads[c]);
    }
    state.PauseTiming();
    triangulation.reset();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * e.points);
}
BENCHMARK(expand_terrace)->Unit(benchmark::kMillisecond);

void collapse_terrace(benchmark::State& state) {
  const Expansion& e = expansion();
  for (auto _ : state) {
    state.PauseTiming();
    auto triangulation = std::make_unique<terrace::tri::Delaunay2<std::int32_t>>();
    triangulation->build(e.base);
    std::vector<std::vector<terrace::tri::VertexId>> sets(e.clusters.size());
    std::vector<terrace::tri::Delaunay2<std::int32_t>::Insertion> inserted;
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      inserted.resize(e.clusters[c].size());
      triangulation->insert(e.clusters[c], inserted);
      for (const auto& i : inserted) sets[c].push_back(i.vertex);
    }
    state.ResumeTiming();
    for (const auto& set : sets) triangulation->remove(set);
    state.PauseTiming();
    triangulation.reset();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * e.points);
}
BENCHMARK(collapse_terrace)->Unit(benchmark::kMillisecond);

using Cgal = CGAL::Delaunay_triangulation_2<CGAL::Exact_predicates_inexact_constructions_kernel>;

Cgal::Point cgal_point(const std::array<std::int32_t, 2>& p) {
  return {double(p[0]), double(p[1])};
}

std::unique_ptr<Cgal> cgal_base() {
  std::vector<Cgal::Point> points;
  for (const auto& p : expansion().base) points.push_back(cgal_point(p));
  return std::make_unique<Cgal>(points.begin(), points.end());
}

void expand_cgal(benchmark::State& state) {
  const Expansion& e = expansion();
  for (auto _ : state) {
    state.PauseTiming();
    auto triangulation = cgal_base();
    std::vector<Cgal::Vertex_handle> heads;
    for (const auto& head : e.heads)
      heads.push_back(triangulation->nearest_vertex(cgal_point(head)));
    std::vector<Cgal::Vertex_handle> members;
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      Cgal::Face_handle hint = heads[c]->face();
      for (const auto& p : e.clusters[c]) {
        members.push_back(triangulation->insert(cgal_point(p), hint));
        hint = members.back()->face();
      }
    }
    for (const Cgal::Vertex_handle v : members) triangulation->remove(v);
    state.ResumeTiming();
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      Cgal::Face_handle hint = heads[c]->face();
      for (const auto& p : e.clusters[c]) hint = triangulation->insert(cgal_point(p), hint)->face();
    }
    state.PauseTiming();
    triangulation.reset();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * e.points);
}
BENCHMARK(expand_cgal)->Unit(benchmark::kMillisecond);

void collapse_cgal_one_by_one(benchmark::State& state) {
  const Expansion& e = expansion();
  for (auto _ : state) {
    state.PauseTiming();
    auto triangulation = cgal_base();
    std::vector<std::vector<Cgal::Vertex_handle>> sets(e.clusters.size());
    for (std::size_t c = 0; c < e.clusters.size(); ++c) {
      Cgal::Face_handle hint;
      for (const auto& p : e.clusters[c]) {
        const Cgal::Vertex_handle v = triangulation->insert(cgal_point(p), hint);
        hint = v->face();
        sets[c].push_back(v);
      }
    }
    state.ResumeTiming();
    for (const auto& set : sets) {
      for (const Cgal::Vertex_handle v : set) triangulation->remove(v);
    }
    state.PauseTiming();
    triangulation.reset();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * e.points);
}
BENCHMARK(collapse_cgal_one_by_one)->Unit(benchmark::kMillisecond);

/// The whole model, reading included: expands 500 clusters of level 0 and collapses them again.
void model_expand_and_collapse(benchmark::State& state) {
  terrace::terrain::StoreSource source(store());
  if (store().top() == 0) return state.SkipWithError("the store has one level");
  terrace::tri::Multiresolution2<std::int32_t> model(source, {.level = 1, .focuses = {}});
  const std::uint64_t clusters = store().levels()[0].clusters;
  std::int64_t points = 0;
  for (auto _ : state) {
    std::vector<terrace::tri::ClusterId> expanded;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(500, clusters); ++i) {
      const auto id = terrace::tri::cluster_id(0, i * clusters / 500 % clusters);
      if (!model.can_expand(id)) continue;
      const std::size_t before = model.point_count();
      model.expand(id);
      points += static_cast<std::int64_t>(model.point_count() - before);
      expanded.push_back(id);
    }
    for (const auto id : expanded) model.collapse(id);
  }
  state.SetItemsProcessed(points);
}
BENCHMARK(model_expand_and_collapse)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
