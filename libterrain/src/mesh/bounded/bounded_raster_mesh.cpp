// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <string>

#include <terrace/stream/error.hpp>

#include "mesh/bounded/bounded_mesh.hpp"
#include "mesh/bounded/keep_memory.hpp"
#include "mesh/bounded/least_error.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/raster_mesher.hpp"

namespace terrace::terrain {
namespace {

/// The mesh with the smallest bound that has at most max_points vertices.
BoundedMeshResult best_of_points(RasterMesher& mesher, const BoundedMeshOptions& options) {
  BoundedMeshResult result;
  std::unique_ptr<MeshSpool> spool;
  LeastErrorSearch search;
  search.most = options.max_points;
  search.range = mesher.bounds().max[2] - mesher.bounds().min[2];
  if (mesher.can_estimate()) {
    search.estimate = [&](double bound) { return mesher.estimate(bound); };
  }
  search.run = [&](double bound) {
    spool.reset();  // its files have the names of the next one's
    spool = std::make_unique<MeshSpool>(options.path);
    result = mesher.run(bound, *spool, options.max_points);
    return static_cast<double>(result.vertices);
  };
  if (!least_error(search)) {
    throw stream::Error({.file = options.path,
                         .where = {},
                         .cause = "--max-points " + std::to_string(options.max_points) +
                                  " is too few even for a flat mesh of this region",
                         .remedy = "allow more points"});
  }
  spool->write(options.path, options.writer, mesher.bounds());
  return result;
}

}  // namespace

BoundedMeshResult bounded_raster_mesh(const stream::Store& given, const BoundedMeshOptions& options,
                                      const Context& context) {
  keep_freed_memory();
  const stream::Store store = given.with_stop(context.stop);
  RasterMesher mesher(store, options, context);
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  if (options.max_points == 0) {
    MeshSpool spool(options.path);
    result = mesher.run(options.max_error / metres, spool, ~std::uint64_t{0});
    spool.write(options.path, options.writer, mesher.bounds());
  } else {
    result = best_of_points(mesher, options);
  }
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace terrace::terrain
