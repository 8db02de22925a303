// SPDX-License-Identifier: Apache-2.0
#include "surface/bounded/point_window_tin.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>
#include <terrace/tri/predicates.hpp>

#include "base/stopwatch.hpp"
#include "base/streaming_hull.hpp"
#include "base/units.hpp"

namespace terrace::terrain {
namespace {

/// A sample on a side of the hull.
struct Along {
  double at = 0.0;
  tri::Point3 sample{};
};

/// A side of the frame on the hull.
struct OuterSide {
  Point2 from{}, to{};
  std::vector<Along> samples;  ///< samples on the side, without its ends

  [[nodiscard]] double least() const { return std::min(from[0], to[0]); }
  [[nodiscard]] double greatest() const { return std::max(from[0], to[0]); }
};

/// The outer sides of a frame, sorted by x to find the sides that samples are on. Keeps the upper
/// and the lower sides separately.
class OuterSides {
 public:
  void add(const Point2& from, const Point2& to) {
    chain(from, to).push_back(OuterSide{from, to, {}});
  }
  void sort() {
    for (std::vector<OuterSide>& sides : chains_) {
      std::sort(sides.begin(), sides.end(),
                [](const OuterSide& a, const OuterSide& b) { return a.least() < b.least(); });
    }
  }
  [[nodiscard]] bool empty() const {
    return chains_[0].empty() && chains_[1].empty() && chains_[2].empty() && chains_[3].empty();
  }
  /// Returns the side that a place is on, including its ends; null if there is none.
  OuterSide* find(const Point2& p) {
    for (std::vector<OuterSide>& sides : chains_) {
      auto after = std::upper_bound(sides.begin(), sides.end(), p[0],
                                    [](double x, const OuterSide& s) { return x < s.least(); });
      if (after == sides.begin()) continue;
      OuterSide& side = *(after - 1);
      if (p[0] > side.greatest() || p[1] < std::min(side.from[1], side.to[1]) ||
          p[1] > std::max(side.from[1], side.to[1])) {
        continue;
      }
      if (tri::orientation(side.from, side.to, p) == 0) return &side;
    }
    return nullptr;
  }
  OuterSide& between(const Point2& from, const Point2& to) {
    std::vector<OuterSide>& sides = chain(from, to);
    return *std::find_if(sides.begin(), sides.end(),
                         [&](const OuterSide& s) { return s.from == from && s.to == to; });
  }

 private:
  std::vector<OuterSide>& chain(const Point2& from, const Point2& to) {
    if (from[0] == to[0]) return chains_[from[1] < to[1] ? 2 : 3];
    return chains_[from[0] < to[0] ? 0 : 1];
  }

  std::array<std::vector<OuterSide>, 4> chains_;
};

/// Returns the samples of `side` that must be vertices, in order, each once. level: whether all
/// samples of the window have one height.
std::vector<tri::Point3> simplify(OuterSide& side, double from_height, double to_height, bool level,
                                  const tri::PointTinOptions& options) {
  if (side.samples.empty()) return {};
  const unsigned axis =
      std::abs(side.to[0] - side.from[0]) >= std::abs(side.to[1] - side.from[1]) ? 0 : 1;
  const double sign = side.to[axis] > side.from[axis] ? 1.0 : -1.0;
  for (Along& along : side.samples) along.at = sign * along.sample[axis];
  std::stable_sort(side.samples.begin(), side.samples.end(),
                   [](const Along& a, const Along& b) { return a.at < b.at; });
  std::vector<double> at{sign * side.from[axis]}, height{from_height}, group;
  std::vector<tri::Point3> places{{side.from[0], side.from[1], from_height}};
  double apart = 0.0;  // for PointDuplicates::all: the largest distance of a sample from the middle
                       // of its place
  for (std::size_t i = 0; i < side.samples.size(); ++i) {
    const Along& along = side.samples[i];
    group.push_back(along.sample[2]);
    if (i + 1 < side.samples.size() && side.samples[i + 1].at == along.at) continue;
    at.push_back(along.at);
    height.push_back(merged_height(group, options.duplicates));
    if (options.duplicates == tri::PointDuplicates::all) {
      const double highest = *std::max_element(group.begin(), group.end());
      apart = std::max(apart, highest - height.back());
    }
    places.push_back({along.sample[0], along.sample[1], height.back()});
    group.clear();
  }
  at.push_back(sign * side.to[axis]);
  height.push_back(to_height);
  std::vector<tri::Point3> chosen;
  if (options.max_error > 0.0) {
    // Leave a small margin, because other code interpolates with different rounding.
    const double bound = std::max(0.0, options.max_error - apart) * (1.0 - 0x1p-20);
    const std::vector<tri::LineVertex> line = tri::simplify_line(at, height, bound).vertices;
    for (std::size_t i = 1; i + 1 < line.size(); ++i) chosen.push_back(places[line[i].sample]);
    return chosen;
  }
  // Samples that are not vertices would be off by a rounding error, unless all heights are equal.
  if (!level) chosen.assign(places.begin() + 1, places.end());
  return chosen;
}

bool on_border(const PlaneBox& box, const Point2& a, const Point2& b) {
  for (std::size_t k = 0; k < 2; ++k) {
    if (a[k] == b[k] && (a[k] == box.min[k] || a[k] == box.max[k])) return true;
  }
  return false;
}

/// Measures the mesh that a reader decodes from a format that rounds.
tri::TinErrors measure_rounded(const MeshSamples& samples, const PlaneBox& box,
                               const BoundedWindow& mesh, const stream::MeshRounding& rounding) {
  std::vector<tri::Point3> read;
  read.reserve(mesh.vertices.size());
  for (const tri::Point3& p : mesh.vertices) read.push_back(rounding(p));
  // The window's straight sides move as a whole. Samples that they pass then belong to the
  // neighbour, whose surface is the same at the side.
  const tri::Point3 low = rounding({box.min[0], box.min[1], 0.0});
  const tri::Point3 high = rounding({box.max[0], box.max[1], 0.0});
  MeshSamples moved = samples;
  for (double& x : moved.x) x = std::min(std::max(x, low[0]), high[0]);
  for (double& y : moved.y) y = std::min(std::max(y, low[1]), high[1]);
  return tri::measure_surface(moved.x, moved.y, moved.z, read, mesh.triangles);
}

/// Keeps one sample per place, with the height that represents it.
MeshSamples one_a_place(const MeshSamples& samples, tri::PointDuplicates duplicates) {
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto place = [&samples](std::size_t i) { return std::pair(samples.x[i], samples.y[i]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return place(a) < place(b); });
  MeshSamples result;
  result.reserve(samples.size());
  std::vector<double> heights;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    heights.push_back(samples.z[i]);
    if (k + 1 < order.size() && place(order[k + 1]) == place(i)) continue;
    result.add({samples.x[i], samples.y[i], merged_height(heights, duplicates)});
    heights.clear();
  }
  return result;
}

/// Removes the samples that the vertices of a frame represent; returns the number of their places.
/// Interpolation at a vertex has a rounding error, which matters if no error is allowed.
std::size_t take_out_vertices(const std::vector<tri::Point3>& frame,
                              tri::PointDuplicates duplicates, MeshSamples& samples) {
  std::map<Point2, std::vector<std::size_t>> at;
  for (const tri::Point3& v : frame) at.try_emplace({v[0], v[1]});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto entry = at.find({samples.x[i], samples.y[i]});
    if (entry != at.end()) entry->second.push_back(i);
  }
  std::vector<char> out(samples.size(), 0);
  std::size_t places = 0;
  std::vector<double> heights;
  for (const tri::Point3& v : frame) {
    const std::vector<std::size_t>& indices = at[{v[0], v[1]}];
    if (indices.empty()) continue;
    heights.clear();
    for (const std::size_t i : indices) heights.push_back(samples.z[i]);
    const bool differ = duplicates == tri::PointDuplicates::all &&
                        std::count(heights.begin(), heights.end(), v[2]) !=
                            static_cast<std::ptrdiff_t>(heights.size());
    if (differ || merged_height(heights, duplicates) != v[2]) continue;
    ++places;
    for (const std::size_t i : indices) out[i] = 1;
  }
  MeshSamples remaining;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (out[i] == 0) remaining.add({samples.x[i], samples.y[i], samples.z[i]});
  }
  samples = std::move(remaining);
  return places;
}

/// As mesh_samples(), with the target options.tin.max_error. may_miss: allows a result beyond the
/// bound.
BoundedWindow mesh_to_aim(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                          const PlaneBox& box, const PointMeshOptions& options,
                          const stream::MeshRounding& rounding, const stream::Store& store,
                          bool may_miss) {
  store.check_stop();
  const bool refuse = options.tin.duplicates == tri::PointDuplicates::error;
  MeshSamples remaining;
  const MeshSamples* used = &samples;
  std::size_t vertex_places = 0;
  if (!frame.empty() && options.tin.max_error == 0.0) {
    remaining = samples;
    vertex_places = take_out_vertices(frame, options.tin.duplicates, remaining);
    if (refuse && samples.size() - remaining.size() > vertex_places) throw SamplesShareAPlace{};
    used = &remaining;
  }
  tri::PointTin tin;
  try {
    tin = tri::point_tin(used->x, used->y, used->z, frame, options.tin);
  } catch (const std::invalid_argument& error) {
    SharedPlaces shared;
    if (refuse) shared.add(samples);
    if (shared.places > 0) throw SamplesShareAPlace{};
    throw stream::Error(store.path().string(), error.what()).remedy("check the store's points");
  }
  const bool all = options.tin.duplicates == tri::PointDuplicates::all;
  if (all && tin.duplicate_range > options.tin.max_error) throw SamplesShareAPlace{};
  // The removed samples have no error.
  tin.errors.rms *=
      std::sqrt(static_cast<double>(tin.errors.covered) /
                std::max(1.0, static_cast<double>(tin.errors.covered + vertex_places)));
  tin.errors.covered += vertex_places;
  tin.duplicates += samples.size() - used->size() - vertex_places;
  BoundedWindow out;
  out.vertices = std::move(tin.vertices);
  out.triangles = std::move(tin.triangles);
  tri::TinErrors errors = tin.errors;
  const bool exact = rounding.largest() == stream::Point3{};
  if (!exact) {
    const bool some_count = tin.duplicates > 0 && !all;
    errors = measure_rounded(some_count ? one_a_place(samples, options.tin.duplicates) : samples,
                             box, out, rounding);
  }
  out.measures = {.max_error = errors.largest,
                  .rms_error = errors.rms,
                  .covered = errors.covered,
                  .samples = samples.size(),
                  .uncovered = out.triangles.empty() ? samples.size() : errors.uncovered,
                  .duplicates = tin.duplicates,
                  .work = samples.size()};
  const bool missed = exact && tin.errors.uncovered > 0 && !out.triangles.empty();
  const bool beyond = errors.largest > options.bound;
  if (missed || (beyond && !may_miss)) {
    throw stream::Error(
        store.path().string(),
        missed ? "the mesh leaves out samples"
               : fmt::format("the mesh misses its bound: {} of {}", plain_number(errors.largest),
                             plain_number(options.bound)))
        .remedy(exact ? "this is a fault of terrace, please report it"
                      : "write PLY, which is exact");
  }
  return out;
}

/// The border of a window, counter-clockwise: the vertices on its sides inside the hull and, along
/// the hull, the corners and the samples that the bound needs.
struct PointMeshFrame {
  std::vector<tri::Point3> vertices;
  std::vector<SharedVertex> shared;
};

/// sides: the vertices of window.sides, in parallel.
PointMeshFrame frame_of(const PointMeshPlan& plan, const PointMeshPlan::Window& window,
                        const std::vector<std::shared_ptr<const SideVertices>>& sides,
                        const MeshSamples& samples, const tri::PointTinOptions& options) {
  struct Vertex {
    double height = 0.0;
    std::optional<SharedVertex> shared;
    std::vector<double> samples;  ///< heights of the samples at a corner of the hull
  };
  std::map<Point2, Vertex> vertices;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const PointMeshPlan::Side& side = plan.sides[window.sides[i]];
    for (std::uint32_t k = 0; k < sides[i]->size(); ++k) {
      const SideVertex& v = (*sides[i])[k];
      const bool is_junction = k == 0 || k + 1 == sides[i]->size();
      const std::uint32_t junction = side.junctions[k == 0 ? 0 : 1];
      // Junctions are numbered first, then the vertices of one side after another.
      const SharedVertex shared =
          is_junction
              ? SharedVertex{0, junction, plan.junctions[junction].last_window}
              : SharedVertex{0, std::uint64_t{window.sides[i] + 1} << 32 | k, side.last_window()};
      const Point2 place =
          side.axis == 0 ? Point2{side.coordinate, v.at} : Point2{v.at, side.coordinate};
      vertices.try_emplace(place, Vertex{v.height, shared, {}});
    }
  }
  for (const Point2& corner : window.hull_corners) vertices.try_emplace(corner);

  std::vector<Point2> places;
  for (const auto& [place, vertex] : vertices) places.push_back(place);
  const std::vector<Point2> ring = convex_hull(std::move(places), true);
  const auto after = [&](std::size_t i) { return ring[i + 1 == ring.size() ? 0 : i + 1]; };
  OuterSides outer;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (!on_border(window.box, ring[i], after(i))) outer.add(ring[i], after(i));
  }
  outer.sort();
  if (!outer.empty()) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Point2 p{samples.x[i], samples.y[i]};
      OuterSide* const side = outer.find(p);
      if (side == nullptr) continue;
      if (p == side->from || p == side->to) {
        vertices[p].samples.push_back(samples.z[i]);
      } else {
        side->samples.push_back({0.0, {p[0], p[1], samples.z[i]}});
      }
    }
  }
  PointMeshFrame frame;
  const auto height_at = [&](const Point2& place) {
    const Vertex& v = vertices.at(place);
    assert(v.shared || !v.samples.empty());
    return v.shared ? v.height : merged_height(v.samples, options.duplicates);
  };
  const auto [low, high] = std::minmax_element(samples.z.begin(), samples.z.end());
  const bool level = low == high || *low == *high;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (std::optional<SharedVertex> shared = vertices.at(ring[i]).shared) {
      shared->vertex = static_cast<std::uint32_t>(frame.vertices.size());
      frame.shared.push_back(*shared);
    }
    frame.vertices.push_back({ring[i][0], ring[i][1], height_at(ring[i])});
    if (on_border(window.box, ring[i], after(i))) continue;
    OuterSide& side = outer.between(ring[i], after(i));
    for (const tri::Point3& p :
         simplify(side, height_at(ring[i]), height_at(after(i)), level, options)) {
      frame.vertices.push_back(p);
    }
  }
  return frame;
}

}  // namespace

BoundedWindow mesh_samples(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                           const PlaneBox& box, const PointMeshOptions& options,
                           const stream::MeshRounding& rounding, const stream::Store& store) {
  if (options.first_aim > options.tin.max_error) {
    PointMeshOptions first = options;
    first.tin.max_error = options.first_aim;
    BoundedWindow mesh = mesh_to_aim(samples, frame, box, first, rounding, store, true);
    if (!(mesh.measures.max_error > options.bound)) return mesh;
  }
  return mesh_to_aim(samples, frame, box, options, rounding, store, false);
}

PointWindowMesher::PointWindowMesher(const PointMeshPlan& plan, ReadCells read,
                                     PointMeshSides& sides, const PointMeshOptions& options,
                                     const stream::MeshRounding& rounding,
                                     const stream::Store& store)
    : plan_(plan),
      read_(std::move(read)),
      sides_(sides),
      options_(options),
      rounding_(rounding),
      store_(store) {}

BoundedWindow PointWindowMesher::mesh(std::size_t number) const {
  const PointMeshPlan::Window& window = plan_.windows[number];
  const Stopwatch reading;
  std::vector<std::shared_ptr<const SideVertices>> sides;
  for (const std::uint32_t side : window.sides) sides.push_back(sides_.vertices(side));
  MeshSamples samples;
  samples.reserve(static_cast<std::size_t>(1.125 * window.samples));
  read_(window.first_cell, window.cells, {}, samples);
  const double reading_seconds = reading.seconds();

  const Stopwatch meshing;
  PointMeshFrame frame = frame_of(plan_, window, sides, samples, options_.tin);
  BoundedWindow out =
      mesh_samples(samples, frame.vertices, window.box, options_, rounding_, store_);
  out.shared = std::move(frame.shared);
  out.measures.reading_seconds = reading_seconds;
  out.measures.meshing_seconds = meshing.seconds();
  return out;
}

}  // namespace terrace::terrain
