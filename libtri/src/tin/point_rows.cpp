// SPDX-License-Identifier: GPL-3.0-or-later
#include "point_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "lattice.hpp"
#include "point_rows_surface.hpp"

namespace terrace::tri {
namespace {

/// Ascending at distances that are equal but for a thousandth.
bool regular(std::span<const double> places) {
  const double first = places.front();
  const double step = (places.back() - first) / static_cast<double>(places.size() - 1);
  if (!(step > 0.0 && std::isfinite(step))) return places.size() == 1 && std::isfinite(first);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!(std::abs(places[i] - (first + static_cast<double>(i) * step)) <= 1e-3 * step))
      return false;
  return true;
}

/// Whether a RowSurface does what is asked for.
bool has_surface(const SampleRows& samples, std::span<const Point3> frame,
                 const PointTinOptions& options) {
  const auto few = [](std::span<const double> places) {
    return !places.empty() && places.size() <= tin::rows::kMostRows;
  };
  return options.lattice && options.max_points == 0 && few(samples.x) && few(samples.y) &&
         options.quality != PointTinQuality::kFitted && regular(samples.x) && regular(samples.y) &&
         tin::rows::is_rectangle(frame);
}

PointTin tin_of_points(const SampleRows& samples, std::span<const Point3> frame,
                       const PointTinOptions& options) {
  std::vector<double> x, y, z;
  std::vector<std::uint32_t> number;
  for (std::size_t i = 0; i < samples.z.size(); ++i) {
    if (std::isnan(samples.z[i])) continue;
    x.push_back(samples.x[i % samples.x.size()]);
    y.push_back(samples.y[i / samples.x.size()]);
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

PointTin make_tin(const SampleRows& samples, std::span<const Point3> frame,
                  const PointTinOptions& options, RowPath path) {
  points::check_options(options, frame);
  if (samples.x.size() * samples.y.size() != samples.z.size())
    throw std::invalid_argument("point_tin: not a height for each row and column");
  if (samples.z.size() > std::size_t{1} << 29)
    throw std::length_error("point_tin: more than 2^29 samples");
  if (!has_surface(samples, frame, options)) return tin_of_points(samples, frame, options);
  RowSurface surface(samples, frame, options, path);
  surface.refine();
  if (options.quality != PointTinQuality::kGreedy) {
    surface.arrange();
    surface.remove();
  }
  return surface.result();
}

}  // namespace tin::rows

PointTin point_tin(const SampleRows& samples, std::span<const Point3> frame,
                   const PointTinOptions& options) {
  return tin::rows::make_tin(samples, frame, options, tin::rows::best_row_path());
}

}  // namespace terrace::tri
