// SPDX-License-Identifier: Apache-2.0
#include "point_rows.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <terrace/base/simd.hpp>

#include "samples.hpp"
#include "tin/lattice_surface.hpp"

namespace terrace::tri {
namespace {

/// True if a LatticeSurface supports these options.
bool has_surface(std::span<const Point3> frame, const PointTinOptions& options) {
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

template <class Samples>
PointTin make_tin(const Samples& samples, std::span<const Point3> frame,
                  const PointTinOptions& options, base::SimdPath set) {
  points::check_options(options, frame);
  check_sizes(samples);
  if (samples.z.size() > std::size_t{1} << 29)
    throw std::length_error("point_tin: more than 2^29 samples");
  if (!has_surface(frame, options)) return tin_of_points(samples, frame, options);
  std::optional<PaddedSamples> padded = padded_samples(samples, frame);
  if (!padded) return tin_of_points(samples, frame, options);
  std::vector<PlacedSamples::Vertex> vertices;
  for (const Point3& p : frame)
    vertices.push_back(
        {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1]), p[2], kNone});
  LatticeSurface surface(PlacedSamples(*std::move(padded), options, set), std::move(vertices));
  surface.make(options.quality, frame.size());
  PointTin tin;
  surface.samples().measure(surface.vertices(), surface.triangles(), tin);
  surface.publish(tin);
  tin.inserted = surface.vertices().size() - frame.size();
  tin.removed = surface.vertices().size() - tin.vertices.size();
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
