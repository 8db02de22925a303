// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/picture_input.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "base/stored_entities.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "earth/ground.hpp"
#include "mesh/height_grid.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/scan_surface.hpp"
#include "terrace/terrain/undeclared_voids.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Converts positions from stored coordinates to metres on the ground around their centre. Sets
/// `heights` to the heights in the source's unit.
void convert_to_ground(PictureInput& input, const stream::Placement& placement,
                       const Ground& ground) {
  stream::Box3 box;
  for (const stream::Point3& p : input.mesh.positions) {
    check_interrupt();
    box.include(p);
  }
  const GroundMap map = ground.map(box);
  const stream::Point3 centre{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1]),
                              0.5 * (box.min[2] + box.max[2])};
  input.heights.reserve(input.mesh.positions.size());
  for (stream::Point3& p : input.mesh.positions) {
    check_interrupt();
    input.heights.push_back(world_point(placement, p)[2]);
    p = apply(map, {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]});
  }
  input.assumption = ground.assumption();
}

/// In a mesh in degrees, the height range exceeds the larger extent by more than this factor,
/// because heights in metres span far more than degrees.
constexpr double kMinReliefRatio = 5;

/// Returns whether x and y of a mesh file are probably longitude and latitude: a comment names
/// EPSG:4326, or x and y fit into degrees but the height range is far larger. Mesh files rarely
/// name their CRS.
bool looks_geographic(const stream::MeshFile& file) {
  for (const std::string& comment : file.info.comments) {
    if (comment.find("EPSG:4326") != std::string::npos) return true;
  }
  stream::Box3 box;
  for (const stream::Point3& p : file.vertices.positions) {
    check_interrupt();
    box.include(p);
  }
  if (box.empty()) return false;
  const double extent = std::max(box.max[0] - box.min[0], box.max[1] - box.min[1]);
  return box.min[0] >= -360 && box.max[0] <= 360 && box.min[1] >= -90 && box.max[1] <= 90 &&
         box.max[2] - box.min[2] > kMinReliefRatio * extent;
}

PictureInput input_from_mesh(stream::MeshFile file) {
  PictureInput input;
  stream::Placement placement;
  const bool geographic = looks_geographic(file);
  placement.crs.geographic = geographic;
  placement.crs.horizontal_unit = geographic ? "degree" : "metre";
  input.mesh = triangle_mesh_of(std::move(file));
  convert_to_ground(input, placement, Ground(placement));
  if (geographic) input.guess = "assuming that x and y are longitude and latitude";
  return input;
}

/// Samples of a pixel, and their bytes: a colour and a depth; for smoothing, a radius and the
/// depths after each of two passes.
constexpr std::uint64_t kSamplesPerPixel = 4, kCanvasBytes = 16, kSmoothingBytes = 12;
/// Bytes of a pixel of the picture.
constexpr std::uint64_t kColourBytes = 3;
/// Peak bytes per pixel.
constexpr std::uint64_t kBytesPerPixel =
    kSamplesPerPixel * (kCanvasBytes + kSmoothingBytes) + kColourBytes;
/// Peak bytes per point of a cloud, or per vertex with its two triangles, while drawing.
constexpr std::uint64_t kBytesPerPoint = 112;
/// Memory for reading a file, in bytes.
constexpr std::uint64_t kReadingBytes = std::uint64_t{64} << 20;

/// Returns the maximum number of raster cells in a picture.
std::uint64_t max_cells(const ImageSize& size) { return 2 * size.width * size.height; }

PictureInput input_from_source(const std::string& path, stream::HeightsOfColour colours,
                               const ImageSize& size, const CommonOptions& common) {
  const std::uint64_t cell_limit = max_cells(size);
  check_picture_memory(path, size, kReadingBytes, common);
  const std::array<std::string, 1> files{path};
  const std::unique_ptr<stream::PointSource> source = stream::open_source(
      files, {.memory_bytes = kReadingBytes, .heights_of_colour = colours, .stop = stop_token()});
  const stream::SourceInfo& info = source->info();
  std::uint64_t expected_points = 0;
  if (info.grid) {
    expected_points = HeightGrid::cells(info.columns, info.rows, cell_limit);
  } else if (info.points) {
    expected_points = *info.points;
  }
  const std::uint64_t memory =
      memory_for_points(path, size, kReadingBytes + expected_points * kBytesPerPoint, common) -
      kReadingBytes;

  PictureInput input;
  std::optional<HeightGrid> grid;
  if (info.grid) grid.emplace(info.columns, info.rows, cell_limit, check_interrupt);
  UndeclaredVoids voids(info);
  for_each_block(*source, common, [&](const stream::PointBlock& block) {
    voids.add(block);
    if (grid) {
      for (const stream::Point3& p : block.positions) grid->add(p);
    } else {
      append_points(input.mesh, info, block);
      if (input.mesh.positions.size() > memory / kBytesPerPoint) {
        throw stream::Error(
            path, fmt::format("has too many points for {} of memory", readable_bytes(memory)))
            .remedy("build a store and render that, or raise --memory");
      }
    }
  });
  if (const stream::Message note = voids.note(); !note.empty()) common.say(note);
  if (grid) {
    input.mesh = grid->mesh();
    input.height_field = true;
  }
  const stream::Placement& placement = info;
  convert_to_ground(input, placement, Ground(placement));
  return input;
}

/// Returns the finest level with no more points than a picture needs. Counts all points of clusters
/// that intersect the region.
std::string finest_level(const stream::Store& store, const std::string& region) {
  const RegionConversion regions(store);
  constexpr std::uint64_t kMaxPoints = 4000000;
  if (region.empty()) return fmt::format("{}", level_within(store, kMaxPoints));
  for (unsigned level = 0; level < store.top(); ++level) {
    const Detail detail = parse_detail(store, fmt::format("{}", level), region, {}, regions);
    if (wanted_points(store, detail) <= kMaxPoints) return fmt::format("{}", level);
  }
  return "top";
}

/// Reads the triangles of a part of a store. For points that are not a height field, reads the scan
/// surface instead.
PictureInput input_from_triangles(const stream::Store& store, const Detail& detail,
                                  bool height_field, const stream::Placement& crs_placement,
                                  const CommonOptions& common) {
  const Ground ground(crs_placement);
  PictureInput input;
  input.height_field = height_field;
  input.mesh = detail_mesh(store, detail, {}, common.context());
  convert_to_ground(input, crs_placement, ground);
  // Draw the triangles of a mesh unchanged.
  const bool is_mesh = entities_of(store.schema()) == stream::Entities::triangles;
  if (height_field || is_mesh || !mostly_steep(input.mesh, check_interrupt)) return input;
  input = {};
  input.mesh = scan_surface(store, detail, {}, common.context()).mesh;
  input.guess = "not a height field: drawn as a scan surface, as 'terrace surface' does";
  convert_to_ground(input, crs_placement, ground);
  return input;
}

PictureInput input_from_store(const std::string& path, const PictureSelection& selection,
                              const ImageSize& size, const CommonOptions& common) {
  const std::uint64_t cell_limit = max_cells(size);
  const stream::Store store = open_store(path, selection.where);
  const stream::StoreSchema& schema = store.schema();
  const stream::Placement& store_placement = schema;
  PictureInput input;
  input.height_field = schema.grid || schema.crs.epsg != 0;

  // Reading more cells than this for one picture takes too long by default.
  constexpr std::uint64_t kMaxCellsRead = std::uint64_t{1} << 27;
  const bool whole_area = selection.focuses.empty() && selection.region.empty();
  const bool read_all_cells =
      selection.level == "0" || (selection.level.empty() && store.points() <= kMaxCellsRead);
  if (schema.grid && whole_area && read_all_cells && !selection.triangles) {
    const std::uint64_t cells = HeightGrid::cells(schema.columns, schema.rows, cell_limit);
    check_picture_memory(path, size, cells * kBytesPerPoint, common);
    input.mesh = reduced_raster(store, cell_limit, common.context());
    convert_to_ground(input, store_placement, Ground(store_placement));
    return input;
  }
  // With focuses, an empty level means the top level outside them.
  const bool level_chosen = !selection.level.empty() || !selection.focuses.empty();
  const std::string level = level_chosen ? selection.level : finest_level(store, selection.region);
  RegionConversion regions(store);
  regions.on_note([&common](const std::string& line) { common.say(line); });
  const Detail detail = parse_detail(store, level, selection.region, selection.focuses, regions);
  note_idle_focuses(store, detail, common.context());
  check_picture_memory(path, size, wanted_points(store, detail) * kBytesPerPoint, common);
  // The functions below return positions in the CRS, not stored coordinates.
  stream::Placement crs_placement;
  crs_placement.crs = store_placement.crs;
  crs_placement.coordinates[0].unit = store_placement.coordinates[0].unit;
  crs_placement.coordinates[2].unit = store_placement.coordinates[2].unit;
  if (holds_lines(schema)) {
    LineSet set = detail_lines(store, detail, common.context());
    input.mesh.positions = std::move(set.vertices);
    input.lines = std::move(set.lines);
    convert_to_ground(input, crs_placement, Ground(crs_placement));
    return input;
  }
  const bool is_mesh = entities_of(schema) == stream::Entities::triangles;
  if (!schema.grid && !selection.triangles && !is_mesh) {
    input.mesh = detail_points(store, detail);
    convert_to_ground(input, crs_placement, Ground(crs_placement));
    return input;
  }
  return input_from_triangles(store, detail, input.height_field, crs_placement, common);
}

}  // namespace

std::uint64_t memory_for_points(const std::string& path, const ImageSize& size, std::uint64_t bytes,
                                const CommonOptions& common) {
  const std::uint64_t fixed = kProgramMemory + size.width * size.height * kBytesPerPixel;
  const std::uint64_t memory = common.memory_or(0);
  if (fixed + bytes <= memory) return memory - fixed;
  throw stream::Error(
      path, fmt::format("drawing {} x {} pixels needs {} MiB, but --memory is {}", size.width,
                        size.height, ((fixed + bytes) >> 20) + 1, readable_bytes(memory)))
      .remedy("give a smaller --size, a coarser --level, or more --memory");
}

void check_picture_memory(const std::string& path, const ImageSize& size, std::uint64_t bytes,
                          const CommonOptions& common) {
  static_cast<void>(memory_for_points(path, size, bytes, common));
}

PictureInput read_picture_input(const std::string& path, const PictureSelection& selection,
                                const ImageSize& size, const CommonOptions& common) {
  const auto check_no_rgb = [&] {
    if (selection.colours == stream::HeightsOfColour::none) return;
    throw UsageError(fmt::format("'{}' is not a PNG: --rgb does not apply", path));
  };
  if (std::filesystem::is_directory(path) || stream::Store::exists(path)) {
    check_no_rgb();
    return input_from_store(path, selection, size, common);
  }
  if (!selection.level.empty() || !selection.region.empty() || !selection.focuses.empty() ||
      !selection.where.empty()) {
    throw UsageError(fmt::format(
        "'{}' is not a store: --level, --region, --focus and --where do not apply", path));
  }
  if (auto file = stream::read_mesh(path, {.stop = stop_token()})) {
    check_no_rgb();
    const std::size_t points =
        std::max(file->vertices.positions.size(), file->triangles.size() / 2);
    check_picture_memory(path, size, points * kBytesPerPoint, common);
    if (file->nodata > 0) {
      common.context().say(fmt::format("{} skipped: a corner has a NaN coordinate",
                                       counted(file->nodata, "triangle")));
    }
    return input_from_mesh(std::move(*file));
  }
  return input_from_source(path, selection.colours, size, common);
}

}  // namespace terrace::tools
