// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "greedy.hpp"
#include "lists.hpp"
#include "removal.hpp"
#include "samples.hpp"
#include "start.hpp"
#include "terrace/tri/least_error.hpp"
#include "tin/lattice.hpp"
#include "tin/rows/point_rows.hpp"

namespace terrace::tri {

void tin::points::check_options(const PointTinOptions& options, std::span<const Point3> frame) {
  if (!(options.max_error >= 0) || !std::isfinite(options.max_error))
    throw std::invalid_argument("point_tin: max_error must be at least 0");
  if (!(options.min_angle_degrees >= 0 && options.min_angle_degrees <= 30))
    throw std::invalid_argument("point_tin: min_angle_degrees must be from 0 to 30");
  if (!options.lattice) return;
  if (!tin::valid(*options.lattice))
    throw std::invalid_argument("point_tin: the lattice's step must be positive");
  if (frame.empty()) throw std::invalid_argument("point_tin: a lattice needs a frame");
  for (std::size_t i = 0; i < frame.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k)
      if (!(frame[i][k] >= 0 && frame[i][k] < 0x1p30 && frame[i][k] == std::floor(frame[i][k])))
        throw std::invalid_argument("point_tin: vertex " + std::to_string(i) +
                                    " of the frame is not on the lattice");
}

namespace {

using namespace tin::points;
using tin::kNone;

constexpr double kMostWhole = 0x1p15;
constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

/// Makes the mesh, for one bound after another.
class Maker {
 public:
  Maker(Samples& samples, std::span<const Point3> frame, const PointTinOptions& options)
      : samples_(samples.all), frame_(frame), options_(options) {}

  /// Returns false if there is no surface.
  bool make(double bound, std::size_t max_vertices, TinQuality quality) {
    mesh_ = {};
    mesh_.samples = &samples_;
    mesh_.whole =
        options_.lattice && std::all_of(frame_.begin(), frame_.end(), [](const Point3& p) {
          return p[0] <= kMostWhole && p[1] <= kMostWhole;
        });
    for (Sample& sample : span_of(samples_)) {
      sample.next = kUnlisted;
      sample.id = number(sample);
    }
    if (frame_.empty()) {
      start_with_hull(mesh_);
    } else {
      start_with_frame(mesh_, frame_);
    }
    if (mesh_.triangles.empty()) return false;
    const std::size_t fixed = mesh_.vertices.size();
    // Reserves so much that reallocation, which briefly takes twice the memory, is rare. Unused
    // capacity costs only address space.
    mesh_.vertices.reserve(fixed + samples_.size());
    mesh_.triangles.reserve(mesh_.triangles.size() + 2 * std::size_t{samples_.size()});
    mesh_.heads.reserve(mesh_.triangles.size() + 2 * std::size_t{samples_.size()});
    Greedy greedy(mesh_, bound, !frame_.empty(), options_.lattice);
    const bool sweeps = quality != TinQuality::kGreedy;
    insert(greedy, bound, max_vertices, sweeps);
    removed_ = 0;
    if (quality == TinQuality::kGreedy) {
      mend(greedy, bound, max_vertices);
      inserted_ = mesh_.vertices.size() - fixed;
      return true;
    }
    inserted_ = mesh_.vertices.size() - fixed;
    greedy.stop_delaunay();
    const auto remove = [&] {
      removed_ += remove_vertices(mesh_, fixed, bound, options_.min_angle_degrees);
    };
    remove();
    if (quality == TinQuality::kFitted) {
      // The moved vertices have errors at their own samples.
      for (Sample& sample : span_of(samples_))
        if (sample.next == kIsVertex) sample.next = kUnlisted;
      list_samples(mesh_, 1, bound);
      fit_heights(mesh_, fixed, bound, options_.lattice);
      remove();
    }
    mend(greedy, bound, max_vertices);
    return true;
  }

  [[nodiscard]] const Measured& measured() const { return measured_; }
  [[nodiscard]] std::size_t vertices() const { return mesh_.vertices.size() - removed_; }

  /// The difference between the lowest and the highest of the samples and the frame.
  [[nodiscard]] double height_range() const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto take = [&](double z) { low = std::min(low, z), high = std::max(high, z); };
    for (const Sample& sample : span_of(samples_)) take(sample.z);
    for (const Point3& vertex : frame_) take(vertex[2]);
    return high - low;
  }

  /// Moves the mesh into the result and leaves it empty.
  void publish(PointTin& result) {
    result.errors = measured_.errors;
    result.stuck = measured_.above - measured_.to_mend;
    result.inserted = inserted_;
    result.removed = removed_;
    // Frees the memory of the samples before allocating the result.
    for (Vertex& vertex : span_of(mesh_.vertices))
      vertex.sample = vertex.sample == kNone ? kNoSample : number(samples_[vertex.sample]);
    samples_.release();
    mesh_.heads.release();
    std::vector<std::uint32_t> number_of =
        tin::triangle_of_vertices(mesh_.triangles, mesh_.vertices.size());
    result.vertices.reserve(vertices());
    result.sample.reserve(vertices());
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (number_of[v] == kNone) continue;
      number_of[v] = static_cast<std::uint32_t>(result.vertices.size());
      const Vertex& vertex = mesh_.vertices[v];
      result.vertices.push_back({vertex.x, vertex.y, vertex.z});
      result.sample.push_back(vertex.sample);
    }
    result.triangles.reserve(2 * vertices());
    for (const tin::Triangle& t : mesh_.triangles)
      if (t.live())
        result.triangles.push_back(
            {number_of[t.corner[0]], number_of[t.corner[1]], number_of[t.corner[2]]});
  }

 private:
  /// Inserts vertices. While triangles are large, a few of their samples choose the vertices as
  /// well as all would, and need not be redistributed each time. sweeps: true if vertices are
  /// removed later and therefore need not be chosen well.
  void insert(Greedy& greedy, double bound, std::size_t max_vertices, bool sweeps) {
    constexpr std::uint32_t kSteps[] = {64, 8, 1};
    constexpr std::size_t kSamplesPerTriangle = 3;
    // Few enough samples for them and their triangles to stay in the cache.
    constexpr std::size_t kTogether = 8192;
    for (const std::uint32_t step : kSteps) {
      const std::size_t listed = samples_.size() / step;
      if (step > 1 && listed < 1024) continue;
      if (sweeps) greedy.sweep(step);
      if (sweeps && step > 1) continue;
      const bool last = step == 1 && max_vertices == kUnlimited;
      greedy.start(list_samples(mesh_, step, bound).waiting, last ? kTogether : samples_.size());
      greedy.run(max_vertices, step > 1 ? listed / kSamplesPerTriangle : kUnlimited);
    }
  }

  /// Measures, and inserts the very rare samples that rounding hid from the lists.
  void mend(Greedy& greedy, double bound, std::size_t max_vertices) {
    measured_ = measure_lists(mesh_, bound);
    while (measured_.to_mend > 0 && mesh_.vertices.size() < max_vertices) {
      greedy.start(measured_.waiting, samples_.size());
      greedy.run(max_vertices, kUnlimited);
      measured_ = measure_lists(mesh_, bound);
    }
  }

  Pool<Sample>& samples_;
  std::span<const Point3> frame_;
  const PointTinOptions& options_;
  Mesh mesh_;
  Measured measured_;
  std::size_t inserted_ = 0;
  std::size_t removed_ = 0;
};

/// Makes the mesh with the least bound that leaves at most max_points. Removal leaves about 0.6 of
/// the vertices that greedy insertion needs for a bound, and their number is about linear in the
/// bound's inverse.
bool make_of_points(Maker& maker, const PointTinOptions& options) {
  const std::size_t limit = options.max_points;
  if (!maker.make(options.max_error, limit, TinQuality::kGreedy)) return false;
  // The fixed vertices alone may exceed the limit.
  if (options.quality == TinQuality::kGreedy || maker.vertices() > limit) return true;
  const double left = 0.6 * static_cast<double>(limit) * maker.measured().errors.largest;
  const bool found =
      least_error({.most = limit,
                   .least = options.max_error,
                   .range = std::max(options.max_error, maker.height_range()),
                   .estimate =
                       [left](double bound) {
                         return left / std::max(bound, std::numeric_limits<double>::min());
                       },
                   .run =
                       [&](double bound) {
                         maker.make(bound, kUnlimited, options.quality);
                         return static_cast<double>(maker.vertices());
                       }});
  // Sweeps insert more vertices than greedy insertion, and removal may leave more.
  return found || maker.make(options.max_error, limit, TinQuality::kGreedy);
}

}  // namespace

PointTin point_tin(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                   std::span<const Point3> frame, const PointTinOptions& options) {
  check_options(options, frame);
  Samples samples = take_samples(x, y, z, options.duplicates);
  PointTin result;
  result.duplicates = samples.duplicates;
  result.duplicate_range = samples.duplicate_range;
  result.errors.uncovered = samples.all.size();
  Maker maker(samples, frame, options);
  if (options.max_points == 0 ? maker.make(options.max_error, kUnlimited, options.quality)
                              : make_of_points(maker, options))
    maker.publish(result);
  return result;
}

}  // namespace terrace::tri
