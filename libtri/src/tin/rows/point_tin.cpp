// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/point_tin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include <terrace/base/simd.hpp>

#include "padded_samples.hpp"
#include "tin/instruction_set.hpp"
#include "tin/lattice.hpp"
#include "tin/options.hpp"
#include "tin/scan.hpp"

namespace terrace::tri {
namespace {

/// True if samples in rows and columns can be meshed with these options.
bool is_supported(std::span<const Point3> frame, const PointTinOptions& options) {
  return options.lattice && options.max_points == 0 && tin::rows::is_rectangle(frame);
}

std::array<double, 2> place_of(const SampleRows& samples, std::size_t i) {
  return {samples.x[i % samples.x.size()], samples.y[i / samples.x.size()]};
}
std::array<double, 2> place_of(const SampleGrid& samples, std::size_t i) {
  return {samples.x[i], samples.y[i]};
}

void check_sizes(const SampleRows& samples) {
  if (samples.x.size() * samples.y.size() != samples.z.size())
    throw std::invalid_argument("point_tin: z needs a height for each row and column");
}
void check_sizes(const SampleGrid& samples) {
  if (samples.x.size() != samples.z.size() || samples.y.size() != samples.z.size())
    throw std::invalid_argument("point_tin: x, y and z must have equal lengths");
  if (samples.columns == 0 ? !samples.z.empty() : samples.z.size() % samples.columns != 0)
    throw std::invalid_argument("point_tin: z needs a height for each row and column");
}

template <class Samples>
PointTin tin_of_points(const Samples& samples, std::span<const Point3> frame,
                       const PointTinOptions& options) {
  std::vector<double> x, y, z;
  std::vector<std::uint32_t> number;
  for (std::size_t i = 0; i < samples.z.size(); ++i) {
    if (std::isnan(samples.z[i])) continue;
    const std::array<double, 2> place = place_of(samples, i);
    x.push_back(place[0]);
    y.push_back(place[1]);
    z.push_back(samples.z[i]);
    number.push_back(static_cast<std::uint32_t>(i));
  }
  PointTin tin = point_tin(x, y, z, frame, options);
  for (std::uint32_t& sample : tin.sample)
    if (sample != kNoSample) sample = number[sample];
  if (tin.errors.largest_at != kNoSample) tin.errors.largest_at = number[tin.errors.largest_at];
  return tin;
}

}  // namespace

namespace tin::rows {
namespace {

struct PlacedVertex {
  std::int32_t x, y;
  double z;
  std::uint32_t sample;  ///< place_at() of the sample, or kNone for a vertex of the frame
};

RowCorner corner(const PlacedVertex& vertex) {
  return {static_cast<double>(vertex.x), static_cast<double>(vertex.y), vertex.z};
}

/// Samples in rows and columns at given places.
class PlacedSamples : public LatticeSamples<PlacedSamples, PlacedVertex> {
 public:
  using Sample = RowCorner;
  using PlacedMesh = Mesh<std::vector<Vertex>>;
  static constexpr bool kMovesVertices = true;
  static constexpr Fills kFills = Fills::wide_or_delaunay;

  PlacedSamples(PaddedSamples padded, const PointTinOptions& options, base::SimdPath set);

  std::int32_t columns() const { return samples_.columns; }
  std::int32_t rows() const { return samples_.rows; }
  float least_error() const;

  static bool border_fixed() { return true; }

  void set_error(PlacedMesh& mesh, std::uint32_t t) const;
  bool open(std::uint32_t place) const;
  Vertex take(std::uint32_t place) const;
  void give_up(std::uint32_t place);
  void restore();
  static bool counts(const Vertex&) { return true; }
  std::uint32_t place_of(const Vertex& vertex) const {
    return vertex.sample == kNone ? 0 : vertex.sample;
  }
  Sample sample_of(const Vertex& vertex) const { return sample(place_of(vertex)); }
  bool within(const PlacedMesh&, std::uint32_t, const Vertex& a, const Vertex& b,
              const Vertex& c) const {
    return within(a, b, c);
  }
  bool fits(const Vertex& a, const Vertex& b, const Vertex& c, const Sample& removed) const;
  void narrow(std::uint32_t t, const Vertex& v, const Vertex& b, const Vertex& c,
              Interval& rises) const;
  bool raise(Vertex& v, const Interval& rises) const;
  static bool covers(const Vertex&, const Vertex&, const Vertex&) { return true; }
  void publish(const Vertex& vertex, PointTin& tin) const;

  /// Measures every sample in the triangles and sets errors and stuck.
  void measure(const PlacedMesh& mesh, PointTin& tin) const;

 private:
  bool within(const Vertex& a, const Vertex& b, const Vertex& c) const;
  std::size_t at(std::uint32_t place) const {
    return (place >> 16) * samples_.stride + (place & 0xFFFF);
  }
  Sample sample(std::uint32_t place) const;

  double bound_;
  TinLattice lattice_;
  PaddedSamples padded_;
  RowSamples samples_;
  const RowScan& scan_;
  std::vector<std::pair<std::size_t, double>> rejected_;  ///< with their heights
};

PlacedSamples::PlacedSamples(PaddedSamples padded, const PointTinOptions& options,
                             base::SimdPath set)
    : LatticeSamples(Ground(1, 1, static_cast<std::int64_t>(kMaxCoordinate),
                            tangent_of(options.min_angle_degrees))),
      bound_(options.max_error),
      lattice_(*options.lattice),
      padded_(std::move(padded)),
      samples_(padded_.view()),
      scan_(row_scans(set)[samples_.upright ? 1 : 0]) {}

float PlacedSamples::least_error() const {
  return static_cast<float>(std::clamp(bound_, 1e-30, 1e30));
}

void PlacedSamples::set_error(PlacedMesh& mesh, std::uint32_t t) const {
  Triangle& triangle = mesh.triangles[t];
  const WorstSample<double> worst =
      scan_.worst(samples_, corner(mesh.vertex(triangle, 0)), corner(mesh.vertex(triangle, 1)),
                  corner(mesh.vertex(triangle, 2)), bound_);
  triangle.error = worst.error > 0.0 ? rounded_up(worst.error) : 0.0F;
  triangle.place = worst.place;
}

bool PlacedSamples::open(std::uint32_t place) const { return !std::isnan(padded_.z[at(place)]); }

PlacedVertex PlacedSamples::take(std::uint32_t place) const {
  const Sample input = sample(place);
  return {static_cast<std::int32_t>(round_half_up(input.x)),
          static_cast<std::int32_t>(round_half_up(input.y)), on_lattice(lattice_, input.z), place};
}

void PlacedSamples::give_up(std::uint32_t place) {
  rejected_.emplace_back(at(place), padded_.z[at(place)]);
  padded_.z[at(place)] = std::numeric_limits<double>::quiet_NaN();
}

void PlacedSamples::restore() {
  for (const auto& [index, height] : rejected_) padded_.z[index] = height;
  rejected_.clear();
}

bool PlacedSamples::within(const Vertex& a, const Vertex& b, const Vertex& c) const {
  return scan_.within(samples_, corner(a), corner(b), corner(c), bound_) != 0;
}

bool PlacedSamples::fits(const Vertex& a, const Vertex& b, const Vertex& c,
                         const Sample& removed) const {
  return within_at(a, b, c, removed, bound_) && within(a, b, c);
}

void PlacedSamples::narrow(std::uint32_t, const Vertex& v, const Vertex& b, const Vertex& c,
                           Interval& rises) const {
  scan_.narrow(samples_, corner(v), corner(b), corner(c), bound_, rises);
}

bool PlacedSamples::raise(Vertex& v, const Interval& rises) const {
  // If no height satisfies all samples the vertex stays, because a compromise would break the
  // bound.
  if (!(rises.low < rises.high && std::isfinite(rises.high - rises.low))) return false;
  v.z = on_lattice(lattice_, v.z + (rises.low / 2 + rises.high / 2));
  return true;
}

void PlacedSamples::publish(const Vertex& vertex, PointTin& tin) const {
  tin.vertices.push_back({static_cast<double>(vertex.x), static_cast<double>(vertex.y), vertex.z});
  tin.sample.push_back(vertex.sample == kNone
                           ? kNoSample
                           : (vertex.sample >> 16) * static_cast<std::uint32_t>(samples_.columns) +
                                 (vertex.sample & 0xFFFF));
}

void PlacedSamples::measure(const PlacedMesh& mesh, PointTin& tin) const {
  std::vector<double> errors(padded_.z.size(), -1.0);
  for (const Triangle& t : mesh.triangles)
    if (t.live())
      scan_.measure(samples_, corner(mesh.vertex(t, 0)), corner(mesh.vertex(t, 1)),
                    corner(mesh.vertex(t, 2)), errors.data());
  TinErrors& all = tin.errors;
  double squares = 0;
  const auto columns = static_cast<std::size_t>(samples_.columns);
  for (std::size_t row = 0; row < static_cast<std::size_t>(samples_.rows); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const double error = errors[row * samples_.stride + column];
      if (!(error >= 0.0)) continue;
      ++all.covered;
      squares += error * error;
      if (error > bound_) ++tin.stuck;
      if (error > all.largest) {
        all.largest = error;
        all.largest_at = static_cast<std::uint32_t>(row * columns + column);
      }
    }
  }
  all.uncovered = padded_.known - all.covered;
  if (all.covered > 0) all.rms = std::sqrt(squares / static_cast<double>(all.covered));
}

RowCorner PlacedSamples::sample(std::uint32_t place) const {
  const std::size_t i = at(place);
  if (samples_.upright) return {samples_.x[place & 0xFFFF], samples_.y[place >> 16], samples_.z[i]};
  return {samples_.x[i], samples_.y[i], samples_.z[i]};
}

}  // namespace

template <class Samples>
PointTin make_tin(const Samples& samples, std::span<const Point3> frame,
                  const PointTinOptions& options, base::SimdPath set) {
  check_point_options(options, frame);
  check_sizes(samples);
  if (samples.z.size() > std::size_t{1} << 29)
    throw std::length_error("point_tin: more than 2^29 samples");
  if (!is_supported(frame, options)) return tin_of_points(samples, frame, options);
  std::optional<PaddedSamples> padded = padded_samples(samples, frame);
  if (!padded) return tin_of_points(samples, frame, options);
  std::vector<PlacedVertex> vertices;
  for (const Point3& p : frame)
    vertices.push_back(
        {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1]), p[2], kNone});
  Refinement refinement = start_in_rectangle(PlacedSamples(*std::move(padded), options, set),
                                             std::move(vertices), options.check_stop);
  refine_to_bound(refinement, options.quality, frame.size());
  PointTin tin;
  refinement.samples().measure(refinement.mesh(), tin);
  refinement.publish(tin);
  tin.inserted = refinement.mesh().vertices.size() - frame.size();
  tin.removed = refinement.mesh().vertices.size() - tin.vertices.size();
  return tin;
}

template PointTin make_tin(const SampleRows&, std::span<const Point3>, const PointTinOptions&,
                           base::SimdPath);
template PointTin make_tin(const SampleGrid&, std::span<const Point3>, const PointTinOptions&,
                           base::SimdPath);

}  // namespace tin::rows

PointTin point_tin(const SampleRows& samples, std::span<const Point3> frame,
                   const PointTinOptions& options) {
  return tin::rows::make_tin(samples, frame, options, base::best_simd_path());
}

PointTin point_tin(const SampleGrid& samples, std::span<const Point3> frame,
                   const PointTinOptions& options) {
  return tin::rows::make_tin(samples, frame, options, base::best_simd_path());
}

}  // namespace terrace::tri
