// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "refinement.hpp"
#include "samples.hpp"
#include "terrace/tri/least_error.hpp"
#include "tin/error_queue.hpp"
#include "tin/options.hpp"

namespace terrace::tri {

void tin::check_point_options(const PointTinOptions& options, std::span<const Point3> frame) {
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

constexpr double kMaxInteger = 0x1p15;
constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

/// Makes the mesh, for one bound after another.
class Maker {
 public:
  Maker(SampleList& samples, std::span<const Point3> frame, const PointTinOptions& options)
      : samples_(samples.all), frame_(frame), options_(options) {}

  /// Returns false if there is no surface.
  bool make(double bound, std::size_t max_vertices, TinQuality quality) {
    refinement_.reset();
    for (Sample& sample : span_of(samples_)) {
      sample.next = kUnlisted;
      sample.id = number(sample);
    }
    tin::points::PointMesh mesh =
        frame_.empty() ? start_with_hull(samples_) : start_with_frame(frame_);
    if (mesh.triangles.empty()) return false;
    const std::size_t fixed = mesh.vertices.size();
    // Reserves so much that reallocation, which briefly takes twice the memory, is rare. Unused
    // capacity costs only address space.
    mesh.vertices.reserve(fixed + samples_.size());
    mesh.triangles.reserve(mesh.triangles.size() + 2 * std::size_t{samples_.size()});
    const bool integers =
        options_.lattice && std::all_of(frame_.begin(), frame_.end(), [](const Point3& p) {
          return p[0] <= kMaxInteger && p[1] <= kMaxInteger;
        });
    PointSamples samples(samples_, bound, options_, !frame_.empty(), integers, mesh.triangles);
    PointRefinement& refinement =
        refinement_.emplace(std::move(samples), std::move(mesh), options_.check_stop);
    insert(refinement, max_vertices, quality != TinQuality::greedy);
    removed_ = 0;
    if (quality == TinQuality::greedy) {
      insert_missed(refinement, max_vertices);
      inserted_ = refinement.mesh().vertices.size() - fixed;
      return true;
    }
    inserted_ = refinement.mesh().vertices.size() - fixed;
    refinement.stop_delaunay();
    removed_ += refinement.remove();
    if (quality == TinQuality::fitted) {
      // The moved vertices have errors at their own samples.
      for (Sample& sample : span_of(samples_))
        if (sample.next == kIsVertex) sample.next = kUnlisted;
      list_samples(refinement, 1);
      refinement.fit();
      removed_ += refinement.remove();
    }
    insert_missed(refinement, max_vertices);
    return true;
  }

  [[nodiscard]] const Measured& measured() const { return measured_; }
  [[nodiscard]] std::size_t vertices() { return refinement_->mesh().vertices.size() - removed_; }

  /// The difference between the lowest and the highest of the samples and the frame.
  [[nodiscard]] double height_range() const {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto include = [&](double z) { low = std::min(low, z), high = std::max(high, z); };
    for (const Sample& sample : span_of(samples_)) include(sample.z);
    for (const Point3& vertex : frame_) include(vertex[2]);
    return high - low;
  }

  /// Moves the mesh into the result and leaves it empty.
  void publish(PointTin& result) {
    result.errors = measured_.errors;
    result.stuck = measured_.above - measured_.insertable;
    result.inserted = inserted_;
    result.removed = removed_;
    // Frees the memory of the samples before allocating the result.
    for (Vertex& vertex : span_of(refinement_->mesh().vertices))
      vertex.sample = vertex.sample == kNone ? kNoSample : number(samples_[vertex.sample]);
    samples_.release();
    refinement_->samples().heads().release();
    result.sample.reserve(vertices());
    refinement_->publish(result);
    refinement_.reset();
  }

 private:
  /// Inserts vertices. While triangles are large, a few of their samples choose the vertices as
  /// well as all would, and need not be redistributed each time. sweeps: true if vertices are
  /// removed later and therefore need not be chosen well.
  void insert(PointRefinement& refinement, std::size_t max_vertices, bool sweeps) {
    constexpr std::uint32_t kSteps[] = {64, 8, 1};
    constexpr std::size_t kSamplesPerTriangle = 3;
    // Few enough samples for them and their triangles to stay in the cache.
    constexpr std::size_t kPartSize = 8192;
    for (const std::uint32_t step : kSteps) {
      const std::size_t list_size = samples_.size() / step;
      if (step > 1 && list_size < 1024) continue;
      if (sweeps) sweep(refinement, step);
      if (sweeps && step > 1) continue;
      const bool last = step == 1 && max_vertices == kUnlimited;
      refine(refinement, list_samples(refinement, step).triangles_to_refine,
             last ? kPartSize : samples_.size(),
             {max_vertices, step > 1 ? list_size / kSamplesPerTriangle : kUnlimited});
    }
  }

  /// Measures, and inserts the very rare samples that rounding hid from the lists.
  void insert_missed(PointRefinement& refinement, std::size_t max_vertices) {
    measured_ = measure_lists(refinement);
    while (measured_.insertable > 0 && refinement.mesh().vertices.size() < max_vertices) {
      refine(refinement, measured_.triangles_to_refine, samples_.size(),
             {.vertices = max_vertices});
      measured_ = measure_lists(refinement);
    }
  }

  /// Starts with the triangles that have an error. `part_size`: see ErrorParts.
  void refine(PointRefinement& refinement, const std::vector<std::uint32_t>& triangles_to_refine,
              std::size_t part_size, const tin::RefinementLimits& limits) {
    constexpr float kLeastError = 1e-30F;
    tin::ErrorParts queue(kLeastError, samples_.size(), part_size);
    for (const std::uint32_t t : triangles_to_refine) queue.push(refinement.mesh().triangles[t], t);
    refinement.refine(queue, limits);
  }

  Pool<Sample>& samples_;
  std::span<const Point3> frame_;
  const PointTinOptions& options_;
  std::optional<PointRefinement> refinement_;
  Measured measured_;
  std::size_t inserted_ = 0;
  std::size_t removed_ = 0;
};

/// Makes the mesh with the least bound that leaves at most max_points. Removal leaves about 0.6 of
/// the vertices that greedy insertion needs for a bound, and their number is about linear in the
/// bound's inverse.
bool make_of_points(Maker& maker, const PointTinOptions& options) {
  const std::size_t limit = options.max_points;
  if (!maker.make(options.max_error, limit, TinQuality::greedy)) return false;
  // The fixed vertices alone may exceed the limit.
  if (options.quality == TinQuality::greedy || maker.vertices() > limit) return true;
  const double vertices_times_bound =
      0.6 * static_cast<double>(limit) * maker.measured().errors.largest;
  const bool found = least_error({.max_vertices = limit,
                                  .least = options.max_error,
                                  .range = std::max(options.max_error, maker.height_range()),
                                  .estimate =
                                      [vertices_times_bound](double bound) {
                                        return vertices_times_bound /
                                               std::max(bound, std::numeric_limits<double>::min());
                                      },
                                  .run =
                                      [&](double bound) {
                                        maker.make(bound, kUnlimited, options.quality);
                                        return static_cast<double>(maker.vertices());
                                      }});
  // Sweeps insert more vertices than greedy insertion, and removal may leave more.
  return found || maker.make(options.max_error, limit, TinQuality::greedy);
}

}  // namespace

PointTin point_tin(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                   std::span<const Point3> frame, const PointTinOptions& options) {
  tin::check_point_options(options, frame);
  SampleList samples = prepare_samples(x, y, z, options.duplicates);
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
