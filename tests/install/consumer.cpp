// SPDX-License-Identifier: GPL-3.0-or-later
// A program outside the workspace that finds the libraries through pkg-config alone. It clusters a
// small terrain into a store, reads it back, triangulates the top level and solves an assignment.
// Usage: consumer FOLDER, where the store is created.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/matching/assignment.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/terrain/store_sink.hpp>
#include <terrace/tri/delaunay2.hpp>

using namespace terrace;

namespace {

int fail(const char* what) {
  std::fprintf(stderr, "consumer: %s\n", what);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return fail("usage: consumer FOLDER");
  const std::filesystem::path path = std::filesystem::path(argv[1]) / "consumer.store";

  stream::StoreSchema schema;
  schema.coordinates = {stream::Channel{"x"}, stream::Channel{"y"}, stream::Channel{"z"}};
  stream::StoreWriter writer(path, schema);
  terrain::StoreSink sink(writer);
  cluster::HierarchyOptions options;
  options.block_size = 400;
  options.threads = 2;
  cluster::HierarchyBuilder builder(options, sink);
  constexpr int kSide = 100;
  std::vector<cluster::Point3> points;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      const double height = std::round(20 * std::sin(0.1 * column) * std::cos(0.07 * row));
      points.push_back({double(column), double(row), height});
    }
  }
  builder.push(points);
  if (builder.finish().points != points.size()) return fail("the hierarchy lost points");

  const stream::Store store = stream::Store::open(path);
  if (store.points() != points.size()) return fail("the store lost points");
  if (!store.verify([](const stream::Problem& p) { std::fprintf(stderr, "%s\n", p.what.c_str()); }))
    return fail("the store is damaged");

  stream::ClusterPoints top;
  store.read(store.root(), top);
  std::vector<std::array<std::int32_t, 2>> cells;
  for (const stream::Point3& p : top.positions) {
    cells.push_back({static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1])});
  }
  tri::Delaunay2<std::int32_t> triangulation;
  triangulation.build(cells);
  if (triangulation.vertex_count() != cells.size()) return fail("the triangulation lost points");

  const std::vector<double> costs{4, 1, 3, 9, 2, 0, 5, 9, 3, 2, 2, 9};
  if (matching::assign(costs, 3, 4).cost != 5) return fail("the assignment is not optimal");

  std::printf("%zu points, %zu at the top, %zu triangles\n", points.size(), cells.size(),
              triangulation.triangle_count());
  return 0;
}
