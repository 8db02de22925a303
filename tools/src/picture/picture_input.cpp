// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/picture_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>

#include <CLI/CLI.hpp>

#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "earth/ground.hpp"
#include "mesh/height_grid.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/scan_surface.hpp"

namespace terrace::tools {
namespace {

/// Moves positions in stored coordinates to metres on the ground about their middle, and keeps the
/// heights as the source has them.
void put_on_ground(PictureInput& input, const stream::Placement& placement, const Ground& ground) {
  stream::Box3 box;
  for (const stream::Point3& p : input.mesh.positions) box.include(p);
  const GroundMap map = ground.map(box);
  const stream::Point3 middle{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1]),
                              0.5 * (box.min[2] + box.max[2])};
  input.heights.reserve(input.mesh.positions.size());
  for (stream::Point3& p : input.mesh.positions) {
    input.heights.push_back(world_point(placement, p)[2]);
    p = apply(map, {p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]});
  }
  input.assumption = ground.assumption();
}

/// Mesh files rarely name their CRS. x and y that could be degrees, beside heights that could not,
/// are taken for longitude and latitude.
bool looks_geographic(const stream::MeshFile& file) {
  for (const std::string& comment : file.info.comments) {
    if (comment.find("EPSG:4326") != std::string::npos) return true;
  }
  stream::Box3 box;
  for (const stream::Point3& p : file.vertices.positions) box.include(p);
  if (box.empty()) return false;
  const double extent = std::max(box.max[0] - box.min[0], box.max[1] - box.min[1]);
  return box.min[0] >= -360 && box.max[0] <= 360 && box.min[1] >= -90 && box.max[1] <= 90 &&
         box.max[2] - box.min[2] > 5 * extent;
}

PictureInput from_mesh(stream::MeshFile file) {
  PictureInput input;
  stream::Placement placement;
  const bool geographic = looks_geographic(file);
  placement.crs.geographic = geographic;
  placement.crs.horizontal_unit = geographic ? "degree" : "metre";
  input.mesh = triangle_mesh_of(std::move(file));
  put_on_ground(input, placement, Ground(placement));
  if (geographic) input.guess = "x and y are taken for longitude and latitude";
  return input;
}

/// Memory of a point of a cloud until it is drawn.
constexpr std::uint64_t kPictureBytesPerPoint = 100;

PictureInput from_source(const std::string& path, stream::HeightsOfColour colours,
                         std::uint64_t most_cells, const CommonOptions& common) {
  const std::array<std::string, 1> files{path};
  const std::unique_ptr<stream::PointSource> source =
      stream::open_source(files, {.memory_bytes = common.reading_memory(),
                                  .heights_of_colour = colours,
                                  .stop = stop_token()});
  const stream::SourceInfo& info = source->info();
  const std::uint64_t memory = common.memory_or(0);

  PictureInput input;
  std::optional<HeightGrid> grid;
  if (info.grid) grid.emplace(info.columns, info.rows, most_cells);
  ProgressMeter meter(common.progress, "points");
  stream::PointBlock block;
  while (source->next(block)) {
    check_interrupt();
    if (grid) {
      for (const stream::Point3& p : block.positions) grid->add(p);
    } else {
      append_points(input.mesh, info, block);
      if (input.mesh.positions.size() > memory / kPictureBytesPerPoint) {
        throw stream::Error(
            {.file = path,
             .where = {},
             .cause = "has more points than " + readable_bytes(memory) + " can hold",
             .remedy = "build a store and render that, or raise --memory"});
      }
    }
    const stream::Progress progress = source->progress();
    meter.update(progress.points, progress.fraction);
  }
  if (grid) {
    input.mesh = grid->mesh();
    input.terrain = true;
  }
  const stream::Placement& placement = info;
  put_on_ground(input, placement, Ground(placement));
  return input;
}

/// All cells of a raster's store, reduced.
TriangleMesh grid_of_store(const stream::Store& store, std::uint64_t most_cells,
                           ProgressMode progress) {
  const stream::StoreSchema& schema = store.schema();
  HeightGrid grid(schema.columns, schema.rows, most_cells);
  ProgressMeter meter(progress, "points");
  std::uint64_t points = 0;
  for (const stream::LevelInfo& level : store.levels()) {
    store.for_each(level.level, [&](stream::ClusterId, const stream::ClusterRecord&,
                                    const stream::ClusterPoints& cluster) {
      check_interrupt();
      for (const stream::Point3& p : cluster.positions) grid.add(p);
      points += cluster.size();
      meter.update(points, static_cast<double>(points) / static_cast<double>(store.points()));
    });
  }
  return grid.mesh();
}

/// The finest level with no more points, in clusters that reach into the region, than a picture
/// needs.
std::string finest_level(const stream::Store& store, const std::string& region) {
  constexpr std::uint64_t kMost = 4000000;
  if (region.empty()) return std::to_string(level_within(store, kMost));
  for (unsigned level = 0; level < store.top(); ++level) {
    const Detail detail = parse_detail(store, std::to_string(level), region, {});
    std::uint64_t points = 0;
    for_each_wanted_record(
        store, detail,
        [&](stream::ClusterId, const stream::ClusterRecord& record) { points += record.points; });
    if (points <= kMost) return std::to_string(level);
  }
  return "top";
}

PictureInput from_store(const std::string& path, const PictureSelection& selection,
                        std::uint64_t most_cells, const CommonOptions& common) {
  const stream::Store store = open_store(path);
  const bool whole = selection.focuses.empty() && selection.region.empty();
  const stream::Placement& stored = store.schema();
  PictureInput input;
  input.terrain = store.schema().grid || store.schema().crs.epsg != 0;

  // Reading more than this for one picture takes too long to be a default.
  constexpr std::uint64_t kMostCells = std::uint64_t{1} << 27;
  const bool all_cells =
      selection.level == "0" || (selection.level.empty() && store.points() <= kMostCells);
  if (store.schema().grid && whole && all_cells && !selection.triangles) {
    input.mesh = grid_of_store(store, most_cells, common.progress);
    put_on_ground(input, stored, Ground(stored));
    return input;
  }
  const bool chosen = !selection.level.empty() || !selection.focuses.empty();
  const std::string level = chosen ? selection.level : finest_level(store, selection.region);
  const Detail detail = parse_detail(store, level, selection.region, selection.focuses);
  // These positions are in the CRS already.
  stream::Placement world;
  world.crs = stored.crs;
  world.coordinates[0].unit = stored.coordinates[0].unit;
  world.coordinates[2].unit = stored.coordinates[2].unit;
  const Ground ground(world);
  if (!store.schema().grid && !selection.triangles) {
    input.mesh = detail_points(store, detail);
    put_on_ground(input, world, ground);
    return input;
  }
  input.mesh = detail_mesh(store, detail, {}, common.context());
  put_on_ground(input, world, ground);
  if (input.terrain || !mostly_steep(input.mesh)) return input;
  input = {};
  input.mesh = scan_surface(store, detail, {}, common.context()).mesh;
  input.guess = "no height field: the surface is that of 'terrace surface'";
  put_on_ground(input, world, ground);
  return input;
}

}  // namespace

void define_picture_input(CLI::App& app, PictureSelection& selection) {
  app.add_option("--level", selection.level,
                 "store: detail, a number or top (default: all cells, or about 4 M points); tree: "
                 "lines up to level L (default: all)")
      ->type_name("L");
  app.add_option("--region", selection.region,
                 "store: only what is inside (triangles: what reaches inside): a box, "
                 "minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file")
      ->type_name("BOX");
  app.add_option("--focus", selection.focuses,
                 "store: BOX:L, all points of level L inside the box; repeatable (the rest: top)")
      ->allow_extra_args(false)
      ->type_name("BOX:L");
  add_heights_of_colour(app, selection.colours);
}

PictureInput read_picture_input(const std::string& path, const PictureSelection& selection,
                                const ImageSize& size, const CommonOptions& common) {
  const std::uint64_t most_cells = 2 * size.width * size.height;
  const auto no_colours = [&] {
    if (selection.colours == stream::HeightsOfColour::none) return;
    throw UsageError("'" + path + "' is not a PNG: --rgb does not apply");
  };
  if (std::filesystem::is_directory(path) || stream::Store::recover(path)) {
    no_colours();
    return from_store(path, selection, most_cells, common);
  }
  if (!selection.level.empty() || !selection.region.empty() || !selection.focuses.empty()) {
    throw UsageError("'" + path + "' is not a store: --level, --region and --focus do not apply");
  }
  if (auto file = stream::read_mesh(path, {.stop = stop_token()})) {
    no_colours();
    return from_mesh(std::move(*file));
  }
  return from_source(path, selection.colours, most_cells, common);
}

}  // namespace terrace::tools
