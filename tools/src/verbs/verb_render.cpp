// SPDX-License-Identifier: GPL-3.0-or-later
// render: a picture of a raster, a mesh, a cloud of points, a dendrogram or a matching.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <CLI/CLI.hpp>
#include <terrace/tri/interpolation.hpp>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "earth/ground.hpp"
#include "picture/camera.hpp"
#include "picture/color.hpp"
#include "picture/draw.hpp"
#include "picture/picture_input.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/matching_result.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/png.hpp"
#include "terrace/terrain/error.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {
namespace {

/// Square root of the mean squared slope (rise over run) of the triangles, weighed by area.
double rms_slope(const TriangleMesh& mesh) {
  double sum = 0, area = 0;
  for (const auto& t : mesh.triangles) {
    const stream::Point3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]],
                         &c = mesh.positions[t[2]];
    const stream::Point3 u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const stream::Point3 v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const double nx = u[1] * v[2] - u[2] * v[1], ny = u[2] * v[0] - u[0] * v[2];
    const double nz = std::abs(u[0] * v[1] - u[1] * v[0]);
    if (nz <= 0) continue;
    sum += (nx * nx + ny * ny) / nz;
    area += nz;
  }
  return area > 0 ? std::sqrt(sum / area) : 0;
}

/// Degrees of slope at a vertex with that normal.
double slope_degrees(const std::array<float, 3>& normal) {
  const double up = std::abs(static_cast<double>(normal[2]));
  if (up == 0.0) return normal[0] == 0.0f && normal[1] == 0.0f ? 0.0 : 90.0;
  return tri::slope_degrees({normal[0] / up, normal[1] / up});
}

class RenderCommand : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("input", input_,
                   "Store, raster, mesh (PLY, OBJ, OFF, STL), cloud of points, dendrogram (CSV), "
                   "or pairs or "
                   "tree of 'match' (CSV)")
        ->required()
        ->type_name("FILE");
    add_output(app, output_, "The picture (PNG); - is standard output");
    app.add_option("--size", size_, "Size of the picture in pixels")
        ->capture_default_str()
        ->type_name("WxH");
    app.add_option("--color", color_, "height, slope, level, rgb, class, cluster or grey")
        ->check(CLI::IsMember({"height", "slope", "level", "rgb", "class", "cluster", "grey"}))
        ->type_name("WHAT");
    app.add_flag("--wire", wire_, "Draw the edges of the triangles");
    app.add_option("--view", view_, "top, or where the viewer stands: AZIMUTH,ELEVATION in degrees")
        ->capture_default_str()
        ->type_name("VIEW");
    add_number(app, "--exaggerate", exaggerate_,
               "Multiply heights (default: as much as the relief needs to be seen)", kFactor)
        ->type_name("FACTOR");
    define_picture_input(app, selection_);
    app.add_option("--points", points_file_,
                   "pairs, tree: the file of points that they were made from")
        ->type_name("FILE");
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    const ImageSize size = parse_size(size_);
    if (size.width > 20000 || size.height > 20000) {
      throw UsageError("pictures of more than 20000 pixels on a side are not drawn");
    }
    const ViewDirection view = parse_view(view_);
    const bool replace = may_replace(output_, common.force);

    if (is_matching_result(input_)) return render_matching(size, view, replace, common, watch);
    if (!points_file_.empty()) {
      throw UsageError("--points is for what 'terrace match' wrote; '" + input_ +
                       "' is something else");
    }
    if (const auto tree = read_dendrogram(input_)) return render_tree(*tree, size, replace, watch);
    selection_.triangles = wire_;
    PictureInput input = read_picture_input(input_, selection_, size, common);
    if (!input.guess.empty()) common.say(input_ + ": " + input.guess);
    if (!input.assumption.empty()) common.explain(input_ + ": " + input.assumption);
    check_interrupt();
    TriangleMesh& mesh = input.mesh;
    if (mesh.positions.empty()) {
      throw stream::Error({.file = input_,
                           .where = {},
                           .cause = "holds no points",
                           .remedy = "there is nothing to draw"});
    }
    const bool terrain = input.terrain || is_height_field(mesh);
    const std::vector<Rgb> colours = colours_of(mesh, input.heights, terrain);
    const double factor = exaggerate(mesh, terrain, view);

    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    Camera camera(view);
    fit(camera, mesh.positions, canvas);
    const Light light = terrain ? Light::for_terrain(view, relief_) : Light::beside(camera);
    const DrawOptions options{.wire = wire_, .threads = common.threads};
    if (mesh.triangles.empty()) {
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
    summary.json["exaggeration"] = factor;
    summary.add_cost(watch);
    summary.text += with_commas(mesh.positions.size()) + " points, " +
                    with_commas(mesh.triangles.size()) + " triangles";
    if (factor != 1) summary.text += ", heights x " + readable_number(factor);
    summary.text += ", " + readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

 private:
  /// Writes the picture. The summary begins with its size.
  [[nodiscard]] Summary write(const Canvas& canvas, const ImageSize& size, bool replace) const {
    check_interrupt();
    stream::write_png(output_, size.width, size.height, 3, canvas.resolve(), replace, stop_token());
    Summary summary;
    summary.json = {{"width", size.width}, {"height", size.height}};
    summary.text = output_ + ": " + std::to_string(size.width) + " x " +
                   std::to_string(size.height) + " pixels, ";
    return summary;
  }

  Summary render_tree(const cluster::Dendrogram& tree, const ImageSize& size, bool replace,
                      const Stopwatch& watch) {
    Canvas canvas(static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height));
    draw_dendrogram(tree, canvas);
    Summary summary = write(canvas, size, replace);
    summary.json["points"] = tree.points;
    summary.json["merges"] = tree.merges.size();
    summary.add_cost(watch);
    summary.text += "a dendrogram of " + with_commas(tree.points) + " points, " +
                    readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

  Summary render_matching(const ImageSize& size, const ViewDirection& view, bool replace,
                          const CommonOptions& common, const Stopwatch& watch) {
    if (points_file_.empty()) {
      throw UsageError("'" + input_ +
                       "' says which points belong together, not where they are: "
                       "name the file that it was made from with --points FILE");
    }
    if (wire_ || !color_.empty() || !selection_.region.empty() || !selection_.focuses.empty()) {
      throw UsageError(
          "--wire, --color, --region and --focus do not apply to what 'terrace match' wrote");
    }
    MatchingPicture picture = read_matching_picture(input_, points_file_, common);
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
        with_commas(result.lines.size()) + (result.tree ? " lines of a tree of " : " pairs of ") +
        with_commas(result.points) + " points, " + readable_seconds(watch.seconds()) + '\n';
    return summary;
  }

  static std::vector<Rgb> rgb_of(const TriangleMesh& mesh) {
    std::uint16_t brightest = 0;
    for (const auto& colour : mesh.colours) {
      brightest = std::max({brightest, colour[0], colour[1], colour[2]});
    }
    // Else all would be black.
    const int full = brightest <= 255 ? 1 : 257;
    std::vector<Rgb> colours;
    colours.reserve(mesh.colours.size());
    for (const auto& colour : mesh.colours) {
      Rgb& rgb = colours.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) rgb[k] = static_cast<std::uint8_t>(colour[k] / full);
    }
    return colours;
  }

  /// One colour per vertex. heights: in the source's own unit.
  [[nodiscard]] std::vector<Rgb> colours_of(const TriangleMesh& mesh,
                                            const std::vector<double>& heights,
                                            bool terrain) const {
    std::string by = color_;
    if (by.empty()) {
      // Formats with fields for colours are often written without any.
      using Colour = std::array<std::uint16_t, 3>;
      const bool coloured = std::any_of(mesh.colours.begin(), mesh.colours.end(),
                                        [](const Colour& c) { return c != Colour{}; });
      by = coloured                        ? "rgb"
           : !mesh.representatives.empty() ? "cluster"
           : terrain                       ? "height"
                                           : "grey";
    }
    const auto lacks = [&](const std::string& what) {
      throw UsageError("--color " + by + ": '" + input_ + "' has no " + what);
    };
    std::vector<Rgb> colours(mesh.positions.size(), Rgb{205, 205, 200});
    if (by == "rgb") {
      if (mesh.colours.empty()) lacks("colours");
      return rgb_of(mesh);
    }
    if (by == "level" && mesh.levels.empty()) lacks("levels");
    if ((by == "class" || by == "cluster") && mesh.classes.empty()) lacks(by);
    if (by == "slope" && mesh.triangles.empty()) lacks("triangles to have a slope");
    const HeightTint tint =
        by == "height" ? HeightTint::of(shown_heights(mesh, heights, terrain)) : HeightTint{};
    const auto normals = by == "slope" ? vertex_normals(mesh) : std::vector<std::array<float, 3>>();
    for (std::size_t i = 0; i < colours.size(); ++i) {
      if (by == "height") colours[i] = tint.colour(heights[i]);
      if (by == "slope") colours[i] = slope_colour(slope_degrees(normals[i]));
      if (by == "level") colours[i] = category_colour(mesh.levels[i]);
      if (by == "class") colours[i] = category_colour(mesh.classes[i]);
      if (by == "cluster") colours[i] = cluster_colour(mesh.classes[i]);
    }
    return colours;
  }

  /// Multiplies the heights and chooses the relief of the light. Returns the factor for heights.
  double exaggerate(TriangleMesh& mesh, bool terrain, const ViewDirection& view) {
    // An RMS slope that gives clear light and shadow.
    constexpr double kPleasant = 0.45;
    const double slope = terrain ? rms_slope(mesh) : 0;
    const double wanted = slope > 0 ? std::clamp(kPleasant / slope, 1.0, 25.0) : 1.0;
    double factor = 1;
    if (exaggerate_) {
      factor = *exaggerate_;
    } else if (std::abs(view.elevation) < 89) {
      // Seen from the side the shape itself is stretched, but not as far as the light.
      factor = std::round(10 * std::sqrt(wanted)) / 10;
    }
    relief_ = exaggerate_ ? 1.0 : std::max(1.0, wanted / factor);
    for (stream::Point3& p : mesh.positions) p[2] *= factor;
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
