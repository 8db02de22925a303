// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/bounded_mesh.hpp"

#include <optional>
#include <stop_token>
#include <string>

#include <terrace/stream/error.hpp>
#include <terrace/tri/least_error.hpp>

#include "base/store_checks.hpp"
#include "earth/ground.hpp"
#include "mesh/bounded/mesher.hpp"
#include "mesh/bounded/spool.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// remedy: for a mesh that should have fewer points than its border.
BoundedMeshResult mesh_by(BoundedMesher& mesher, const stream::Store& store,
                          const BoundedMeshOptions& options, const stream::Message& remedy,
                          const std::stop_token& stop) {
  const double metres = mesher.metres_vertical();
  BoundedMeshResult result;
  std::optional<MeshSpool> spool;
  const auto run = [&](double bound, std::uint64_t max_vertices) {
    spool.reset();  // its files have the same names as the next one's
    spool.emplace(options.path);
    result = mesher.run(bound, *spool, max_vertices);
    return static_cast<double>(result.vertices);
  };
  if (options.max_points == 0) {
    run(options.max_error / metres, ~std::uint64_t{0});
  } else {
    tri::LeastErrorSearch search;
    search.max_vertices = options.max_points;
    search.range = mesher.bounds().max[2] - mesher.bounds().min[2];
    if (mesher.can_estimate()) {
      search.estimate = [&](double bound) { return mesher.estimate(bound); };
    }
    search.run = [&](double bound) { return run(bound, options.max_points); };
    if (!tri::least_error(search)) {
      run(search.range, ~std::uint64_t{0});
      throw stream::Error(options.path,
                          stream::message("{max_points} {} is too few: even a flat mesh of this "
                                          "region, with its border, takes {}",
                                          options.max_points, result.vertices))
          .remedy(remedy);
    }
  }
  if (result.samples == 0 && (options.region || store.condition() != nullptr))
    throw_none_inside(store, "sample");
  stream::WriterOptions writer = options.writer;
  writer.stop = stop;
  spool->write(options.path, writer, mesher.bounds(), mesher.coordinates().frame);
  result.coordinates = mesher.coordinates();
  result.max_error *= metres;
  result.rms_error *= metres;
  return result;
}

}  // namespace

BoundedMeshResult write_bounded_mesh(const stream::Store& store, const BoundedMeshOptions& options,
                                     const Context& context) {
  need_terrain(store, "a bounded mesh");
  say_unknown_height_unit(Ground(store.schema()), context);
  const stream::Store source = store.with_stop(context.stop);
  if (store.schema().grid) {
    const stream::Message remedy =
        options.fill == Fill::none
            ? stream::message("allow more points, or {fill} cells without data")
            : "allow more points";
    return mesh_by(*make_raster_mesher(source, options, context), store, options, remedy,
                   context.stop);
  }
  if (options.fill != Fill::none) {
    throw UsageError(
        stream::message("{fill} is for rasters: irregular points have no cells without data"));
  }
  return mesh_by(*make_point_mesher(source, options, context), store, options, "allow more points",
                 context.stop);
}

}  // namespace terrace::terrain
