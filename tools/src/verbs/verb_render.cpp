// SPDX-License-Identifier: GPL-3.0-or-later
// render: a picture of a raster, a mesh, a cloud of points, a dendrogram or a matching.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/tri/interpolation.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_values.hpp"
#include "cli/output.hpp"
#include "cli/selection_options.hpp"
#include "earth/ground.hpp"
#include "mesh/height_grid.hpp"
#include "mesh/scene.hpp"
#include "picture/camera.hpp"
#include "picture/color.hpp"
#include "picture/draw.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/matching_result.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/png.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/detail_lines.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "terrace/terrain/scan_surface.hpp"
#include "terrace/terrain/undeclared_voids.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// The part of an input that a picture shows.
struct PictureSelection {
  std::string level;   ///< empty: as much detail as a picture can show
  std::string region;  ///< empty: everywhere
  std::string where;   ///< empty: all points
  std::vector<std::string> focuses;
  stream::HeightsOfColour colours = stream::HeightsOfColour::none;
  bool triangles = false;  ///< read triangles, not points or cells
};

/// The objects to draw, in ground coordinates.
struct PictureInput {
  TriangleMesh mesh;                 ///< positions in metres from the centre
  std::vector<double> heights;       ///< of the vertices, in the source's unit
  std::vector<LineSet::Line> lines;  ///< between vertices, instead of triangles
  bool terrain = false;    ///< known to be a height field; otherwise decided from the mesh
  std::string guess;       ///< a guess that the picture depends on
  std::string assumption;  ///< an assumption about units
};

/// Converts positions from stored coordinates to metres on the ground around their centre, and
/// keeps the heights in the source's unit.
void put_on_ground(PictureInput& input, const stream::Placement& placement, const Ground& ground) {
  stream::Box3 box;
  for (const stream::Point3& p : input.mesh.positions) {
    check_interrupt();
    box.include(p);
  }
  const GroundMap map = ground.map(box);
  const stream::Point3 middle{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1]),
                              0.5 * (box.min[2] + box.max[2])};
  input.heights.reserve(input.mesh.positions.size());
  for (stream::Point3& p : input.mesh.positions) {
    check_interrupt();
    input.heights.push_back(world_point(placement, p)[2]);
    p = apply(map, {p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]});
  }
  input.assumption = ground.assumption();
}

/// Mesh files rarely name their CRS. If x and y could be degrees and the heights could not, x and y
/// are taken for longitude and latitude.
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

/// Peak bytes per pixel: colours, depths and radii of its samples, two smoothing passes, and the
/// pixel itself.
constexpr std::uint64_t kBytesPerPixel = 4 * (16 + 12) + 3;
/// Peak bytes per point of a cloud, or per vertex with its two triangles, while drawing.
constexpr std::uint64_t kDrawnBytesPerPoint = 112;
/// Peak bytes per row of a dendrogram, while reading or drawing.
constexpr std::uint64_t kBytesPerMerge = 88;
/// Memory for reading a file, in bytes.
constexpr std::uint64_t kReadingBytes = std::uint64_t{64} << 20;

/// Returns the memory left for the points of a picture after the program and the pixels. Throws
/// stream::Error, which names the file, if that is less than `bytes`.
std::uint64_t memory_for_points(const std::string& path, const ImageSize& size, std::uint64_t bytes,
                                const CommonOptions& common) {
  const std::uint64_t fixed = kProgramMemory + size.width * size.height * kBytesPerPixel;
  const std::uint64_t memory = common.memory_or(0);
  if (fixed + bytes <= memory) return memory - fixed;
  throw stream::Error(
      path, fmt::format("drawing it with {} x {} pixels needs {} MiB, --memory is {}", size.width,
                        size.height, ((fixed + bytes) >> 20) + 1, readable_bytes(memory)))
      .remedy("give a smaller --size, a coarser --level, or more --memory");
}

/// Returns the maximum number of raster cells in a picture.
std::uint64_t cells_of(const ImageSize& size) { return 2 * size.width * size.height; }

PictureInput from_source(const std::string& path, stream::HeightsOfColour colours,
                         const ImageSize& size, const CommonOptions& common) {
  const std::uint64_t most_cells = cells_of(size);
  memory_for_points(path, size, kReadingBytes, common);
  const std::array<std::string, 1> files{path};
  const std::unique_ptr<stream::PointSource> source = stream::open_source(
      files, {.memory_bytes = kReadingBytes, .heights_of_colour = colours, .stop = stop_token()});
  const stream::SourceInfo& info = source->info();
  std::uint64_t known = 0;
  if (info.grid) {
    known = HeightGrid::cells(info.columns, info.rows, most_cells);
  } else if (info.points) {
    known = *info.points;
  }
  const std::uint64_t memory =
      memory_for_points(path, size, kReadingBytes + known * kDrawnBytesPerPoint, common) -
      kReadingBytes;

  PictureInput input;
  std::optional<HeightGrid> grid;
  if (info.grid) grid.emplace(info.columns, info.rows, most_cells, check_interrupt);
  UndeclaredVoids voids(info);
  for_each_block(*source, common, [&](const stream::PointBlock& block) {
    voids.add(block);
    if (grid) {
      for (const stream::Point3& p : block.positions) grid->add(p);
    } else {
      append_points(input.mesh, info, block);
      if (input.mesh.positions.size() > memory / kDrawnBytesPerPoint) {
        throw stream::Error(path, "has more points than " + readable_bytes(memory) + " can hold")
            .remedy("build a store and render that, or raise --memory");
      }
    }
  });
  if (const stream::Message note = voids.note(); !note.empty()) common.say(note);
  if (grid) {
    input.mesh = grid->mesh();
    input.terrain = true;
  }
  const stream::Placement& placement = info;
  put_on_ground(input, placement, Ground(placement));
  return input;
}

/// Returns the finest level that has no more points than a picture needs, counted in clusters that
/// reach into the region.
std::string finest_level(const stream::Store& store, const std::string& region) {
  const RegionConversion regions(store);
  constexpr std::uint64_t kMost = 4000000;
  if (region.empty()) return fmt::format("{}", level_within(store, kMost));
  for (unsigned level = 0; level < store.top(); ++level) {
    const Detail detail = parse_detail(store, fmt::format("{}", level), region, {}, regions);
    if (wanted_points(store, detail) <= kMost) return fmt::format("{}", level);
  }
  return "top";
}

PictureInput from_store(const std::string& path, const PictureSelection& selection,
                        const ImageSize& size, const CommonOptions& common) {
  const std::uint64_t most_cells = cells_of(size);
  const stream::Store store = open_store(path, selection.where);
  const bool whole = selection.focuses.empty() && selection.region.empty();
  const stream::Placement& stored = store.schema();
  PictureInput input;
  input.terrain = store.schema().grid || store.schema().crs.epsg != 0;

  // Reading more than this for one picture takes too long by default.
  constexpr std::uint64_t kMostCells = std::uint64_t{1} << 27;
  const bool all_cells =
      selection.level == "0" || (selection.level.empty() && store.points() <= kMostCells);
  if (store.schema().grid && whole && all_cells && !selection.triangles) {
    const std::uint64_t cells =
        HeightGrid::cells(store.schema().columns, store.schema().rows, most_cells);
    memory_for_points(path, size, cells * kDrawnBytesPerPoint, common);
    input.mesh = reduced_raster(store, most_cells, common.context());
    put_on_ground(input, stored, Ground(stored));
    return input;
  }
  const bool chosen = !selection.level.empty() || !selection.focuses.empty();
  const std::string level = chosen ? selection.level : finest_level(store, selection.region);
  RegionConversion regions(store);
  regions.on_note([&common](const std::string& line) { common.say(line); });
  const Detail detail = parse_detail(store, level, selection.region, selection.focuses, regions);
  note_idle_focuses(store, detail, common.context());
  memory_for_points(path, size, wanted_points(store, detail) * kDrawnBytesPerPoint, common);
  // These positions are already in the CRS.
  stream::Placement world;
  world.crs = stored.crs;
  world.coordinates[0].unit = stored.coordinates[0].unit;
  world.coordinates[2].unit = stored.coordinates[2].unit;
  const Ground ground(world);
  if (holds_lines(store.schema())) {
    LineSet set = detail_lines(store, detail, common.context());
    input.mesh.positions = std::move(set.vertices);
    input.lines = std::move(set.lines);
    put_on_ground(input, world, ground);
    return input;
  }
  // Triangles of a mesh are drawn unchanged.
  const bool stored_triangles = entities_of(store.schema()) == stream::Entities::triangles;
  if (!store.schema().grid && !selection.triangles && !stored_triangles) {
    input.mesh = detail_points(store, detail);
    put_on_ground(input, world, ground);
    return input;
  }
  input.mesh = detail_mesh(store, detail, {}, common.context());
  put_on_ground(input, world, ground);
  if (input.terrain || stored_triangles || !mostly_steep(input.mesh, check_interrupt)) return input;
  input = {};
  input.mesh = scan_surface(store, detail, {}, common.context()).mesh;
  input.guess = "not a height field: drawn as by 'terrace surface'";
  put_on_ground(input, world, ground);
  return input;
}

/// Adds --level, --region, --focus and --rgb.
void define_picture_input(CLI::App& app, PictureSelection& selection) {
  app.add_option("--level", selection.level,
                 "store: level, a number or top (default: all cells, or about 4 M points); tree: "
                 "lines up to level L (default: all)")
      ->type_name("L");
  app.add_option("--region", selection.region,
                 "store: only inside this area (all triangles that reach inside): a box, "
                 "minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file")
      ->type_name("BOX");
  app.add_option(
         "--focus", selection.focuses,
         "store: BOX:L, all points of level L inside the box, the top level elsewhere; repeatable")
      ->allow_extra_args(false)
      ->type_name("BOX:L");
  add_where(app, selection.where);
  add_heights_of_colour(app, selection.colours);
}

/// Reads a store, a raster (reduced to about four cells per pixel), a mesh, or a cloud of points.
/// Throws: stream::Error, UsageError, stream::Stopped.
PictureInput read_picture_input(const std::string& path, const PictureSelection& selection,
                                const ImageSize& size, const CommonOptions& common) {
  const auto no_colours = [&] {
    if (selection.colours == stream::HeightsOfColour::none) return;
    throw UsageError("'" + path + "' is not a PNG: --rgb does not apply");
  };
  if (std::filesystem::is_directory(path) || stream::Store::exists(path)) {
    no_colours();
    return from_store(path, selection, size, common);
  }
  if (!selection.level.empty() || !selection.region.empty() || !selection.focuses.empty() ||
      !selection.where.empty()) {
    throw UsageError("'" + path +
                     "' is not a store: --level, --region, --focus and --where do not apply");
  }
  if (auto file = stream::read_mesh(path, {.stop = stop_token()})) {
    no_colours();
    const std::size_t points =
        std::max(file->vertices.positions.size(), file->triangles.size() / 2);
    memory_for_points(path, size, points * kDrawnBytesPerPoint, common);
    if (file->nodata > 0) {
      common.context().say(counted(file->nodata, "triangle") +
                           " are left out: a coordinate of a corner is NaN");
    }
    return from_mesh(std::move(*file));
  }
  return from_source(path, selection.colours, size, common);
}

/// Returns the slope in degrees at a vertex with that normal.
double slope_degrees(const std::array<float, 3>& normal) {
  const double up = std::abs(static_cast<double>(normal[2]));
  if (up == 0.0) return normal[0] == 0.0f && normal[1] == 0.0f ? 0.0 : 90.0;
  return tri::slope_degrees({normal[0] / up, normal[1] / up});
}

class RenderCommand : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_,
                   "store, raster, mesh (PLY, GLB, OBJ, OFF, STL), cloud of points, dendrogram "
                   "(CSV), or pairs or tree of 'match' (CSV)")
        ->required()
        ->type_name("FILE");
    add_output(app, output_, "the PNG file to write; - is standard output");
    app.add_option("--size", size_, "size of the picture in pixels")
        ->capture_default_str()
        ->type_name("WxH");
    app.add_option("--color", color_, "height, slope, level, rgb, class, cluster or grey")
        ->check(CLI::IsMember({"height", "slope", "level", "rgb", "class", "cluster", "grey"}))
        ->type_name("WHAT");
    app.add_flag("--wire", wire_, "draw the edges of the triangles");
    app.add_option("--view", view_, "top, or the viewer's position: AZIMUTH,ELEVATION in degrees")
        ->capture_default_str()
        ->type_name("VIEW");
    add_number(app, "--exaggerate", exaggerate_,
               "multiply heights by this factor (default: enough to show the relief)", kFactor)
        ->type_name("FACTOR");
    define_picture_input(app, selection_);
    app.add_option("--points", points_file_, "pairs, tree: the point file that they were made from")
        ->type_name("FILE");
  }

  Summary run(const CommonOptions& common) override {
    format_of_output(outputs::kPictureFile, output_);
    const Stopwatch watch;
    const ImageSize size = parse_size(size_);
    if (size.width > 20000 || size.height > 20000) {
      throw UsageError("--size: at most 20000 pixels on a side");
    }
    const ViewDirection view = parse_view(view_);
    const stream::Naming replace = may_replace(output_, common.force);

    memory_for_points(input_, size, 0, common);
    if (is_matching_result(input_)) return render_matching(size, view, replace, common, watch);
    if (!points_file_.empty()) {
      throw UsageError("--points applies to results of 'terrace match'; '" + input_ +
                       "' is something else");
    }
    const auto check_rows = [&](std::uint64_t rows) {
      memory_for_points(input_, size, rows * kBytesPerMerge, common);
    };
    if (const auto tree = read_dendrogram(input_, check_rows)) {
      return render_tree(*tree, size, replace, watch);
    }
    selection_.triangles = wire_;
    PictureInput input = read_picture_input(input_, selection_, size, common);
    if (!input.guess.empty()) common.say(input_ + ": " + input.guess);
    if (!input.assumption.empty()) common.explain(input_ + ": " + input.assumption);
    check_interrupt();
    TriangleMesh& mesh = input.mesh;
    if (mesh.positions.empty()) {
      throw stream::Error(input_, "there is nothing to draw: no point is selected")
          .remedy(selection_.where.empty() ? "check the file" : "give another --where");
    }
    const bool terrain = input.terrain || is_height_field(mesh, check_interrupt);
    std::vector<Rgb> colours;
    check_interrupt();
    if (input.lines.empty() || !color_.empty()) colours = colours_of(mesh, input.heights, terrain);
    check_interrupt();
    const double factor = exaggerate(mesh, terrain, view);
    check_interrupt();

    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    Camera camera(view);
    fit(camera, mesh.positions, canvas);
    if (mesh.triangles.empty() && input.lines.empty()) fit_discs(camera, mesh.positions, canvas);
    const Light light = terrain ? Light::for_terrain(view, relief_) : Light::beside(camera);
    const DrawOptions options{.wire = wire_, .threads = common.threads};
    if (!input.lines.empty()) {
      draw_lines(mesh.positions, input.lines, colours, camera, options, canvas);
    } else if (mesh.triangles.empty()) {
      draw_points(mesh, colours, camera, light, options, canvas);
      std::vector<stream::Point3> marks;
      for (const std::uint32_t i : mesh.representatives) marks.push_back(mesh.positions[i]);
      draw_marks(marks, camera, options, canvas);
    } else {
      draw_triangles(mesh, colours, camera, light, options, canvas);
    }
    Summary summary = write(canvas, size, replace);
    summary.json["vertices"] = mesh.positions.size();
    summary.json["triangles"] = mesh.triangles.size();
    if (!input.lines.empty()) summary.json["lines"] = input.lines.size();
    summary.json["exaggeration"] = factor;
    summary.add_cost(watch);
    summary.text += counted(mesh.positions.size(), "point") + ", " +
                    (input.lines.empty() ? counted(mesh.triangles.size(), "triangle")
                                         : counted(input.lines.size(), "line"));
    if (factor != 1) summary.text += ", heights x " + readable_number(factor);
    summary.text += ", " + readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

 private:
  /// Writes the picture. Returns a summary that starts with its size.
  [[nodiscard]] Summary write(const Canvas& canvas, const ImageSize& size,
                              const stream::Naming& replace) const {
    check_interrupt();
    stream::write_png(output_, size.width, size.height, 3, canvas.resolve(), replace, stop_token());
    Summary summary;
    summary.json = {{"width", size.width}, {"height", size.height}};
    summary.text = fmt::format("{}: {} x {} pixels, ", output_, size.width, size.height);
    return summary;
  }

  Summary render_tree(const cluster::Dendrogram& tree, const ImageSize& size,
                      const stream::Naming& replace, const Stopwatch& watch) {
    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    draw_dendrogram(tree, canvas);
    Summary summary = write(canvas, size, replace);
    summary.json["points"] = tree.points;
    summary.json["merges"] = tree.merges.size();
    summary.add_cost(watch);
    summary.text += fmt::format("a dendrogram of {}, {}\n", counted(tree.points, "point"),
                                readable_seconds(watch.seconds()));
    return summary;
  }

  Summary render_matching(const ImageSize& size, const ViewDirection& view,
                          const stream::Naming& replace, const CommonOptions& common,
                          const Stopwatch& watch) {
    if (points_file_.empty()) {
      throw UsageError(
          "'" + input_ +
          "' has no positions; pass the file that it was made from with --points FILE");
    }
    if (wire_ || !color_.empty() || !selection_.region.empty() || !selection_.focuses.empty()) {
      throw UsageError(
          "--wire, --color, --region and --focus do not apply to results of 'terrace match'");
    }
    MatchingPicture picture = read_matching_picture(
        input_, points_file_, common,
        [&](std::uint64_t bytes) { memory_for_points(points_file_, size, bytes, common); });
    if (!picture.assumption.empty()) common.explain(points_file_ + ": " + picture.assumption);
    picture.keep_levels(selection_.level);
    if (exaggerate_) {
      for (stream::Point3& p : picture.positions) p[2] *= *exaggerate_;
    }
    check_interrupt();
    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    Camera camera(view);
    fit(camera, picture.positions, canvas);
    draw_matching(picture, camera, {.threads = common.threads}, canvas);
    const MatchingResult& result = picture.result;
    Summary summary = write(canvas, size, replace);
    summary.json["points"] = result.points;
    summary.json["lines"] = result.lines.size();
    summary.json["levels"] = result.top;
    summary.add_cost(watch);
    summary.text +=
        fmt::format("{}{}{}, {}\n", counted(result.lines.size(), result.tree ? "line" : "pair"),
                    result.tree ? " of a tree of " : " of ", counted(result.points, "point"),
                    readable_seconds(watch.seconds()));
    return summary;
  }

  static std::vector<Rgb> rgb_of(const TriangleMesh& mesh) {
    std::uint16_t brightest = 0;
    for (const auto& colour : mesh.colours) {
      check_interrupt();
      brightest = std::max({brightest, colour[0], colour[1], colour[2]});
    }
    // Otherwise everything would be black.
    const int full = brightest <= 255 ? 1 : 257;
    std::vector<Rgb> colours;
    colours.reserve(mesh.colours.size());
    for (const auto& colour : mesh.colours) {
      check_interrupt();
      Rgb& rgb = colours.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) rgb[k] = static_cast<std::uint8_t>(colour[k] / full);
    }
    return colours;
  }

  /// Returns one colour per vertex. `heights` are in the source's unit.
  [[nodiscard]] std::vector<Rgb> colours_of(const TriangleMesh& mesh,
                                            const std::vector<double>& heights,
                                            bool terrain) const {
    std::string by = color_;
    if (by.empty()) {
      // Formats with colour fields are often written without colours.
      using Colour = std::array<std::uint16_t, 3>;
      const bool coloured = std::any_of(mesh.colours.begin(), mesh.colours.end(),
                                        [](const Colour& c) { return c != Colour{}; });
      by = coloured                        ? "rgb"
           : !mesh.representatives.empty() ? "cluster"
           : terrain                       ? "height"
                                           : "grey";
    }
    const auto fail_without = [&](const std::string& what) {
      throw UsageError(fmt::format("--color {}: '{}' has no {}", by, input_, what));
    };
    std::vector<Rgb> colours(mesh.positions.size(), Rgb{205, 205, 200});
    if (by == "rgb") {
      if (mesh.colours.empty()) fail_without("colours");
      return rgb_of(mesh);
    }
    if (by == "level" && mesh.levels.empty()) fail_without("levels");
    if ((by == "class" || by == "cluster") && mesh.classes.empty()) fail_without(by);
    if (by == "slope" && mesh.triangles.empty()) fail_without("triangles to have a slope");
    const HeightTint tint =
        by == "height" ? HeightTint::of(shown_heights(mesh, heights, terrain, check_interrupt))
                       : HeightTint{};
    const auto normals =
        by == "slope" ? vertex_normals(mesh, check_interrupt) : std::vector<std::array<float, 3>>();
    const unsigned top =
        by == "level" ? *std::max_element(mesh.levels.begin(), mesh.levels.end()) : 0;
    for (std::size_t i = 0; i < colours.size(); ++i) {
      check_interrupt();
      if (by == "height") colours[i] = tint.colour(heights[i]);
      if (by == "slope") colours[i] = slope_colour(slope_degrees(normals[i]));
      if (by == "level") colours[i] = store_level_colour(mesh.levels[i], top);
      if (by == "class") colours[i] = class_colour(mesh.classes[i]);
      if (by == "cluster") colours[i] = cluster_colour(mesh.classes[i]);
    }
    return colours;
  }

  /// Multiplies the heights and chooses the relief of the light. Returns the factor for heights.
  double exaggerate(TriangleMesh& mesh, bool terrain, const ViewDirection& view) {
    // RMS slope that gives clear light and shadow.
    constexpr double kPleasant = 0.45;
    const double slope = terrain ? rms_slope(mesh, check_interrupt) : 0;
    const double wanted = slope > 0 ? std::clamp(kPleasant / slope, 1.0, 25.0) : 1.0;
    double factor = 1;
    if (exaggerate_) {
      factor = *exaggerate_;
    } else if (std::abs(view.elevation) < 89) {
      // Seen from the side, the shape itself is stretched too, but less than the light.
      factor = std::round(10 * std::sqrt(wanted)) / 10;
    }
    relief_ = exaggerate_ ? 1.0 : std::max(1.0, wanted / factor);
    for (stream::Point3& p : mesh.positions) {
      check_interrupt();
      p[2] *= factor;
    }
    return factor;
  }

  std::string input_, output_, points_file_, size_ = "1600x1200", color_, view_ = "top";
  bool wire_ = false;
  std::optional<double> exaggerate_;
  double relief_ = 1;
  PictureSelection selection_;
};

}  // namespace

std::unique_ptr<Command> make_render() { return std::make_unique<RenderCommand>(); }

}  // namespace terrace::tools
