// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/bounded_mesh.hpp"

#include <optional>
#include <stop_token>
#include <string>

#include <terrace/stream/error.hpp>

#include "base/store_checks.hpp"
#include "mesh/bounded/least_error.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/point_mesher.hpp"
#include "mesh/bounded/raster_mesher.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

BoundedMeshResult mesh_by(BoundedMesher&& mesher, const BoundedMeshOptions& options,
                          const std::stop_token& stop) {
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  std::optional<MeshSpool> spool;
  const auto run = [&](double bound, std::uint64_t most) {
    spool.reset();  // its files have the names of the next one's
    spool.emplace(options.path);
    result = mesher.run(bound, *spool, most);
    return static_cast<double>(result.vertices);
  };
  if (options.max_points == 0 || mesher.limits_points()) {
    run(options.max_error / metres, ~std::uint64_t{0});
  } else {
    LeastErrorSearch search;
    search.most = options.max_points;
    search.range = mesher.bounds().max[2] - mesher.bounds().min[2];
    if (mesher.can_estimate()) {
      search.estimate = [&](double bound) { return mesher.estimate(bound); };
    }
    search.run = [&](double bound) { return run(bound, options.max_points); };
    if (!least_error(search)) {
      throw stream::Error({.file = options.path,
                           .where = {},
                           .cause = "`max_points` " + std::to_string(options.max_points) +
                                    " is too few even for a flat mesh of this region",
                           .remedy = "allow more points"});
    }
  }
  stream::WriterOptions writer = options.writer;
  writer.stop = stop;
  spool->write(options.path, writer, mesher.bounds());
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace

BoundedMeshResult write_bounded_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const Context& context) {
  need_points(store, "a bounded mesh");
  const stream::Store source = store.with_stop(context.stop);
  if (store.schema().grid) {
    return mesh_by(RasterMesher(source, options, context), options, context.stop);
  }
  if (options.fill != Fill::none) {
    throw UsageError("`fill` is for rasters: irregular points have no cells without data");
  }
  return mesh_by(PointMesher(source, options, context), options, context.stop);
}

}  // namespace terrace::terrain
