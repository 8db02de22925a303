// SPDX-License-Identifier: Apache-2.0
// Builds a store of a raster or a point file, shows its coarsest mesh, expands a part of it to full
// detail, and collapses it again. Usage: expand_region INPUT STORE
#include <cstdio>

#include <terrace/stream/store.hpp>
#include <terrace/terrain/build.hpp>
#include <terrace/terrain/store_source.hpp>
#include <terrace/tri/multiresolution.hpp>

using namespace terrace;

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: expand_region INPUT STORE\n"), 2;
  terrain::build_store({.inputs = {argv[1]}, .store = argv[2], .replace = true}, {.threads = 2});

  const stream::Store store = stream::Store::open(argv[2]);
  terrain::StoreSource source(store);
  tri::Multiresolution2<double> model(source);
  const std::uint64_t coarse = model.triangulation().hash();
  std::printf("top: %zu of %llu points\n", model.point_count(), 1ULL * store.points());

  // In stored coordinates: columns and rows for a raster.
  const stream::Box3& box = store.bounds();
  const auto at = [&box](std::size_t axis, double part) {
    return box.min[axis] + part * (box.max[axis] - box.min[axis]);
  };
  const tri::Box3 middle = tri::box2(at(0, 0.45), at(1, 0.45), at(0, 0.55), at(1, 0.55));
  const auto& finer = model.refine(middle, 0).changes;
  std::printf("the middle: %zu triangles added, %zu removed\n", finer.added_triangles.size(),
              finer.removed_triangles.size());

  model.set_level(model.top());
  return model.triangulation().hash() == coarse ? 0 : 1;
}
