// SPDX-License-Identifier: GPL-3.0-or-later
// render: a picture of a raster, a mesh, a cloud of points, a dendrogram or a matching.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <terrace/tri/interpolation.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "cli/selection_options.hpp"
#include "mesh/scene.hpp"
#include "picture/camera.hpp"
#include "picture/color.hpp"
#include "picture/draw.hpp"
#include "picture/picture_input.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/matching_result.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/png.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Peak bytes per row of a dendrogram, while reading or drawing.
constexpr std::uint64_t kBytesPerMerge = 88;

/// Adds --level, --region, --focus, --where and --rgb.
void define_selection(CLI::App& app, PictureSelection& selection) {
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
  add_rgb_encoding(app, selection.colours);
}

/// Returns the slope in degrees at a vertex with this normal.
double slope_degrees(const std::array<float, 3>& normal) {
  const double up = std::abs(static_cast<double>(normal[2]));
  if (up == 0.0) return normal[0] == 0.0f && normal[1] == 0.0f ? 0.0 : 90.0;
  return tri::slope_degrees({normal[0] / up, normal[1] / up});
}

class RenderCommand final : public Command {
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
    define_selection(app, selection_);
    app.add_option("--points", points_file_, "pairs, tree: the point file that they were made from")
        ->type_name("FILE");
  }

  Summary run(const CommonOptions& common) override {
    check_output_name(outputs::kPictureFile, output_);
    const Stopwatch watch;
    const ImageSize size = parse_size(size_);
    if (size.width > 20000 || size.height > 20000) {
      throw UsageError("--size: at most 20000 pixels on a side");
    }
    const ViewDirection view = parse_view(view_);
    const stream::Naming replace = may_replace(output_, common.force);

    check_picture_memory(input_, size, 0, common);
    if (is_matching_result(input_)) return render_matching(size, view, replace, common, watch);
    if (!points_file_.empty()) {
      throw UsageError("--points applies to results of 'terrace match'; '" + input_ +
                       "' is something else");
    }
    const auto check_rows = [&](std::uint64_t rows) {
      check_picture_memory(input_, size, rows * kBytesPerMerge, common);
    };
    if (const auto tree = read_dendrogram(input_, check_rows)) {
      return render_tree(*tree, size, replace, watch);
    }
    return render_input(size, view, replace, common, watch);
  }

 private:
  /// Draws a store, a raster, a mesh, or a cloud of points.
  Summary render_input(const ImageSize& size, const ViewDirection& view,
                       const stream::Naming& replace, const CommonOptions& common,
                       const Stopwatch& watch) {
    selection_.triangles = wire_;
    PictureInput input = read_picture_input(input_, selection_, size, common);
    if (!input.guess.empty()) common.say(input_ + ": " + input.guess);
    if (!input.assumption.empty()) common.say_verbose(input_ + ": " + input.assumption);
    check_interrupt();
    TriangleMesh& mesh = input.mesh;
    if (mesh.positions.empty()) {
      throw stream::Error(input_, "there is nothing to draw: no point is selected")
          .remedy(selection_.where.empty() ? "check the file" : "give another --where");
    }
    const bool terrain = input.height_field || is_height_field(mesh, check_interrupt);
    std::vector<Rgb> colours;
    check_interrupt();
    if (input.lines.empty() || !color_.empty()) colours = colours_of(mesh, input.heights, terrain);
    check_interrupt();
    const double factor = exaggerate(mesh, terrain, view);
    check_interrupt();
    const Canvas canvas = drawing_of(input, colours, terrain, size, view, common);

    Summary summary = write(canvas, size, replace);
    summary.json["vertices"] = mesh.positions.size();
    summary.json["triangles"] = mesh.triangles.size();
    if (!input.lines.empty()) summary.json["lines"] = input.lines.size();
    summary.json["exaggeration"] = factor;
    summary.add_cost(watch);
    summary.text += counted(mesh.positions.size(), "point") + ", " +
                    (input.lines.empty() ? counted(mesh.triangles.size(), "triangle")
                                         : counted(input.lines.size(), "line"));
    if (factor != 1) summary.text += fmt::format(", heights x {}", readable_number(factor));
    summary.text += ", " + readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

  /// Returns the drawing of lines, points with marks at the representatives, or triangles.
  [[nodiscard]] Canvas drawing_of(const PictureInput& input, const std::vector<Rgb>& colours,
                                  bool terrain, const ImageSize& size, const ViewDirection& view,
                                  const CommonOptions& common) const {
    const TriangleMesh& mesh = input.mesh;
    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    Camera camera(view);
    fit(camera, mesh.positions, canvas);
    if (mesh.triangles.empty() && input.lines.empty()) fit_discs(camera, mesh.positions, canvas);
    const Light light = terrain ? Light::for_terrain(view, relief_) : Light::headlight(camera);
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
    return canvas;
  }

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
        [&](std::uint64_t bytes) { check_picture_memory(points_file_, size, bytes, common); });
    if (!picture.assumption.empty()) common.say_verbose(points_file_ + ": " + picture.assumption);
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

  /// Returns the colours of the file with 8 bits. Files may have 8 or 16 bits: 16-bit fields with
  /// values up to 255 count as 8 bits.
  static std::vector<Rgb> rgb_of(const TriangleMesh& mesh) {
    std::uint16_t brightest = 0;
    for (const auto& colour : mesh.colours) {
      check_interrupt();
      brightest = std::max({brightest, colour[0], colour[1], colour[2]});
    }
    const int divisor = brightest <= 255 ? 1 : 257;
    std::vector<Rgb> colours;
    colours.reserve(mesh.colours.size());
    for (const auto& colour : mesh.colours) {
      check_interrupt();
      Rgb& rgb = colours.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) rgb[k] = static_cast<std::uint8_t>(colour[k] / divisor);
    }
    return colours;
  }

  /// Returns one colour per vertex. `heights` are in the source's unit. Throws UsageError if the
  /// mesh lacks the data for --color.
  [[nodiscard]] std::vector<Rgb> colours_of(const TriangleMesh& mesh,
                                            const std::vector<double>& heights,
                                            bool terrain) const {
    std::string scheme = color_;
    if (scheme.empty()) {
      // Formats with colour fields are often written without colours.
      using Colour = std::array<std::uint16_t, 3>;
      const bool coloured = std::any_of(mesh.colours.begin(), mesh.colours.end(),
                                        [](const Colour& c) { return c != Colour{}; });
      scheme = coloured                        ? "rgb"
               : !mesh.representatives.empty() ? "cluster"
               : terrain                       ? "height"
                                               : "grey";
    }
    const auto fail_without = [&](const std::string& what) {
      throw UsageError(fmt::format("--color {}: '{}' has no {}", scheme, input_, what));
    };
    std::vector<Rgb> colours(mesh.positions.size(), Rgb{205, 205, 200});
    if (scheme == "rgb") {
      if (mesh.colours.empty()) fail_without("colours");
      return rgb_of(mesh);
    }
    if (scheme == "level" && mesh.levels.empty()) fail_without("levels");
    if ((scheme == "class" || scheme == "cluster") && mesh.classes.empty()) fail_without(scheme);
    if (scheme == "slope" && mesh.triangles.empty()) fail_without("triangles to have a slope");
    const HeightTint tint =
        scheme == "height" ? HeightTint::of(shown_heights(mesh, heights, terrain, check_interrupt))
                           : HeightTint{};
    const auto normals = scheme == "slope" ? vertex_normals(mesh, check_interrupt)
                                           : std::vector<std::array<float, 3>>();
    const unsigned top =
        scheme == "level" ? *std::max_element(mesh.levels.begin(), mesh.levels.end()) : 0;
    for (std::size_t i = 0; i < colours.size(); ++i) {
      check_interrupt();
      if (scheme == "height") colours[i] = tint.colour(heights[i]);
      if (scheme == "slope") colours[i] = slope_colour(slope_degrees(normals[i]));
      if (scheme == "level") colours[i] = store_level_colour(mesh.levels[i], top);
      if (scheme == "class") colours[i] = class_colour(mesh.classes[i]);
      if (scheme == "cluster") colours[i] = cluster_colour(mesh.classes[i]);
    }
    return colours;
  }

  /// Multiplies the heights and sets relief_. Returns the factor of the heights.
  double exaggerate(TriangleMesh& mesh, bool terrain, const ViewDirection& view) {
    // The RMS slope that gives clear light and shadow.
    constexpr double kClearSlope = 0.45;
    const double slope = terrain ? rms_slope(mesh, check_interrupt) : 0;
    const double light_factor = slope > 0 ? std::clamp(kClearSlope / slope, 1.0, 25.0) : 1.0;
    double factor = 1;
    if (exaggerate_) {
      factor = *exaggerate_;
    } else if (std::abs(view.elevation) < 89) {
      // From the side, stretch the shape too, but less than the light.
      factor = std::round(10 * std::sqrt(light_factor)) / 10;
    }
    relief_ = exaggerate_ ? 1.0 : std::max(1.0, light_factor / factor);
    for (stream::Point3& p : mesh.positions) {
      check_interrupt();
      p[2] *= factor;
    }
    return factor;
  }

  std::string input_, output_, points_file_, size_ = "1600x1200", color_, view_ = "top";
  bool wire_ = false;
  std::optional<double> exaggerate_;
  double relief_ = 1;  ///< factor of slopes in the light
  PictureSelection selection_;
};

}  // namespace

std::unique_ptr<Command> make_render() { return std::make_unique<RenderCommand>(); }

}  // namespace terrace::tools
