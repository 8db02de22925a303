// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_window.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/stopwatch.hpp"
#include "base/units.hpp"
#include "mesh/bounded/point_mesh_frame.hpp"

namespace terrace::terrain {
namespace {

/// Errors on what a reader gets back from a format that rounds.
tri::TinErrors measure_rounded(const MeshSamples& samples, const PlaneBox& box,
                               const PointWindowTin& tin, const stream::MeshRounding& rounding) {
  std::vector<tri::Point3> read;
  read.reserve(tin.vertices.size());
  for (const tri::Point3& p : tin.vertices) read.push_back(rounding(p));
  // The window's straight sides move as a whole. Samples that they pass over belong to the
  // neighbour then, whose surface is the same at the side.
  const tri::Point3 low = rounding({box.min[0], box.min[1], 0.0});
  const tri::Point3 high = rounding({box.max[0], box.max[1], 0.0});
  MeshSamples moved = samples;
  for (double& x : moved.x) x = std::min(std::max(x, low[0]), high[0]);
  for (double& y : moved.y) y = std::min(std::max(y, low[1]), high[1]);
  return tri::measure_surface(moved.x, moved.y, moved.z, read, tin.triangles);
}

/// Takes out the samples that the vertices of a frame stand for; returns the number of their
/// places. In triangles at a vertex its own sample is off by a rounding error, which counts where
/// no error is allowed.
std::size_t take_out_vertices(const std::vector<tri::Point3>& frame,
                              tri::PointDuplicates duplicates, MeshSamples& samples) {
  std::map<Point2, std::vector<std::size_t>> at;
  for (const tri::Point3& v : frame) at.try_emplace({v[0], v[1]});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto found = at.find({samples.x[i], samples.y[i]});
    if (found != at.end()) found->second.push_back(i);
  }
  std::vector<char> out(samples.size(), 0);
  std::size_t places = 0;
  std::vector<double> heights;
  for (const tri::Point3& v : frame) {
    const std::vector<std::size_t>& own = at[{v[0], v[1]}];
    if (own.empty()) continue;
    heights.clear();
    for (const std::size_t i : own) heights.push_back(samples.z[i]);
    const bool differ = duplicates == tri::PointDuplicates::kAll &&
                        std::count(heights.begin(), heights.end(), v[2]) !=
                            static_cast<std::ptrdiff_t>(heights.size());
    if (differ || merged_height(heights, duplicates) != v[2]) continue;
    ++places;
    for (const std::size_t i : own) out[i] = 1;
  }
  MeshSamples left;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (out[i] == 0) left.add({samples.x[i], samples.y[i], samples.z[i]});
  }
  samples = std::move(left);
  return places;
}

/// As mesh_samples(), to options.tin.max_error. may_miss: then the result may be beyond the bound.
PointWindowTin mesh_to_aim(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                           const PlaneBox& box, const PointMeshOptions& options,
                           const stream::MeshRounding& rounding, const std::string& source,
                           bool may_miss) {
  const auto fail = [&](const std::string& cause, const std::string& remedy) {
    throw stream::Error({.file = source, .where = {}, .cause = cause, .remedy = remedy});
  };
  const bool refuse = options.tin.duplicates == tri::PointDuplicates::kError;
  MeshSamples left;
  const MeshSamples* taken = &samples;
  std::size_t vertex_places = 0;
  if (!frame.empty() && options.tin.max_error == 0.0) {
    left = samples;
    vertex_places = take_out_vertices(frame, options.tin.duplicates, left);
    if (refuse && samples.size() - left.size() > vertex_places) throw SamplesShareAPlace{};
    taken = &left;
  }
  tri::PointTin tin;
  try {
    tin = tri::point_tin(taken->x, taken->y, taken->z, frame, options.tin);
  } catch (const std::invalid_argument& error) {
    SharedPlaces shared;
    if (refuse) shared.add(samples);
    if (shared.places > 0) throw SamplesShareAPlace{};
    fail(error.what(), "look at the store's points");
  }
  const bool all = options.tin.duplicates == tri::PointDuplicates::kAll;
  if (all && tin.duplicate_range > options.tin.max_error) throw SamplesShareAPlace{};
  // Those taken out have no error.
  tin.errors.rms *=
      std::sqrt(static_cast<double>(tin.errors.covered) /
                std::max(1.0, static_cast<double>(tin.errors.covered + vertex_places)));
  tin.errors.covered += vertex_places;
  tin.duplicates += samples.size() - taken->size() - vertex_places;
  PointWindowTin out;
  out.samples = samples.size();
  out.duplicates = tin.duplicates;
  out.vertices = std::move(tin.vertices);
  out.triangles = std::move(tin.triangles);
  out.errors = tin.errors;
  const bool exact = rounding.largest() == stream::Point3{};
  if (!exact) {
    if (tin.duplicates > 0 && !all) {
      fail(
          "the format of the mesh rounds positions, so the error where several samples have one "
          "place and not all of them count cannot be verified",
          "write PLY, which is exact, or leave out `duplicates`");
    }
    out.errors = measure_rounded(samples, box, out, rounding);
  }
  out.uncovered = out.triangles.empty() ? samples.size() : out.errors.uncovered;
  const bool missed = exact && tin.errors.uncovered > 0 && !out.triangles.empty();
  const bool beyond = options.tin.max_points == 0 && out.errors.largest > options.bound;
  if (missed || (beyond && !may_miss)) {
    fail(missed ? "the mesh leaves out samples"
                : "the mesh misses its bound: " + number_text(out.errors.largest) + " of " +
                      number_text(options.bound),
         exact ? "this is a fault of terrace, please report it" : "write PLY, which is exact");
  }
  return out;
}

}  // namespace

PointWindowTin mesh_samples(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                            const PlaneBox& box, const PointMeshOptions& options,
                            const stream::MeshRounding& rounding, const std::string& source) {
  if (options.first_aim > options.tin.max_error) {
    PointMeshOptions first = options;
    first.tin.max_error = options.first_aim;
    PointWindowTin tin = mesh_to_aim(samples, frame, box, first, rounding, source, true);
    if (!(tin.errors.largest > options.bound)) return tin;
  }
  return mesh_to_aim(samples, frame, box, options, rounding, source, false);
}

PointWindowMesher::PointWindowMesher(const PointMeshPlan& plan, PointMeshSamples& samples,
                                     PointMeshSides& sides, const PointMeshOptions& options,
                                     const stream::MeshRounding& rounding, std::string source)
    : plan_(plan),
      samples_(samples),
      sides_(sides),
      options_(options),
      rounding_(rounding),
      source_(std::move(source)) {}

PointWindowTin PointWindowMesher::mesh(std::size_t number) const {
  const PointMeshPlan::Window& window = plan_.windows[number];
  const Stopwatch reading;
  std::vector<std::shared_ptr<const SideVertices>> sides;
  for (const std::uint32_t side : window.sides) sides.push_back(sides_.vertices(side));
  MeshSamples samples;
  samples.reserve(samples_.count(window.first_cell, window.cells));
  samples_.read(window.first_cell, window.cells, {}, samples);
  const double reading_seconds = reading.seconds();

  const Stopwatch meshing;
  PointMeshFrame frame = frame_of(plan_, window, sides, samples, options_.tin);
  PointWindowTin out =
      mesh_samples(samples, frame.vertices, window.box, options_, rounding_, source_);
  out.shared = std::move(frame.shared);
  out.reading_seconds = reading_seconds;
  out.meshing_seconds = meshing.seconds();
  return out;
}

}  // namespace terrace::terrain
