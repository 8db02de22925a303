// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdint>
#include <optional>
#include <string>

#include <terrace/stream/error.hpp>

#include "mesh/bounded/bounded_mesh.hpp"
#include "mesh/bounded/keep_memory.hpp"
#include "mesh/bounded/least_error.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/point_mesher.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

BoundedMeshResult bounded_point_mesh(const stream::Store& given, const BoundedMeshOptions& options,
                                     const Context& context) {
  if (options.fill != Fill::none) {
    throw UsageError("--fill is for rasters: irregular points have no cells without data");
  }
  keep_freed_memory();
  const stream::Store store = given.with_stop(context.stop);
  PointMesher mesher(store, options, context);
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  std::optional<MeshSpool> spool;
  const auto run = [&](double bound, std::uint64_t most) {
    spool.reset();  // its files have the names of the next one's
    spool.emplace(options.path);
    result = mesher.run(bound, *spool, most);
    return result.vertices;
  };
  if (options.max_points == 0 || mesher.single()) {
    run(options.max_error / metres, ~std::uint64_t{0});
  } else {
    LeastErrorSearch search;
    search.most = options.max_points;
    search.range = mesher.bounds().max[2] - mesher.bounds().min[2];
    if (mesher.can_estimate()) {
      search.estimate = [&](double bound) { return mesher.estimate(bound); };
    }
    search.run = [&](double bound) { return static_cast<double>(run(bound, options.max_points)); };
    if (!least_error(search)) {
      throw stream::Error({.file = options.path,
                           .where = {},
                           .cause = "--max-points " + std::to_string(options.max_points) +
                                    " is too few even for a flat mesh of this region",
                           .remedy = "allow more points"});
    }
  }
  spool->write(options.path, options.writer, mesher.bounds());
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace terrace::terrain
