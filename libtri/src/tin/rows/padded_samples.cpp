// SPDX-License-Identifier: Apache-2.0
#include "padded_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <terrace/base/box.hpp>

#include "tin/options.hpp"

namespace terrace::tri::tin::rows {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
/// Maximum deviation of columns and rows from equal spacing, in spacings.
constexpr double kMaxUnevenness = 1e-3;
/// Maximum distance of samples from a lattice, in spacings. Larger ones would make scans slow.
constexpr double kMaxDeviation = 4.0;

base::Box2 region_of(std::span<const Point3> frame) {
  base::Box2 region;
  for (const Point3& p : frame) region.include(base::Point2{p[0], p[1]});
  return region;
}

/// True if the places ascend at approximately equal spacing.
bool regular(std::span<const double> places) {
  if (places.empty() || places.size() > kMaxRows || !std::isfinite(places.front())) return false;
  if (places.size() == 1) return true;
  const double first = places.front();
  const double step = (places.back() - first) / static_cast<double>(places.size() - 1);
  if (!(step > 0.0 && std::isfinite(step))) return false;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!(std::abs(places[i] - (first + static_cast<double>(i) * step)) <= kMaxUnevenness * step))
      return false;
  return true;
}

/// Adds the padding that scans require before and after the places.
std::vector<double> pad(std::span<const double> places) {
  std::vector<double> all{-kInfinity};
  all.reserve(places.size() + 1 + kRowPad);
  all.insert(all.end(), places.begin(), places.end());
  all.insert(all.end(), kRowPad, kInfinity);
  return all;
}

double per_unit(std::span<const double> places) {
  const double extent = places.back() - places.front();
  return extent > 0.0 ? static_cast<double>(places.size() - 1) / extent : 0.0;
}

/// Copies rows of `columns` numbers into rows of `stride`, and fills the rest, and one more row,
/// with kMissing.
std::vector<double> pad_rows(std::span<const double> from, std::size_t columns,
                             std::size_t stride) {
  const std::size_t rows = from.size() / columns;
  std::vector<double> to((rows + 1) * stride);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto start = to.begin() + static_cast<std::ptrdiff_t>(row * stride);
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(row * columns), columns, start);
    std::fill_n(start + static_cast<std::ptrdiff_t>(columns), stride - columns, kMissing);
  }
  std::fill_n(to.end() - static_cast<std::ptrdiff_t>(stride), stride, kMissing);
  return to;
}

/// Copies the heights, with kMissing for samples outside the frame, and counts all samples that
/// have one. `place_of(row, column)` returns x and y. Throws as point_tin() does.
template <class PlaceOf>
void copy_heights(std::span<const double> from, std::size_t columns, const base::Box2& region,
                  const PlaceOf& place_of, PaddedSamples& out) {
  const std::size_t stride = out.layout.stride;
  out.z = pad_rows(from, columns, stride);
  for (std::size_t row = 0; row * columns < from.size(); ++row) {
    double* const to = out.z.data() + row * stride;
    for (std::size_t column = 0; column < columns; ++column) {
      if (std::isnan(to[column])) continue;
      if (!(std::abs(to[column]) < kLargest))
        throw std::invalid_argument("point_tin: z of sample " +
                                    std::to_string(row * columns + column) +
                                    " is not finite or too large");
      ++out.known;
      if (!region.contains(place_of(row, column))) to[column] = kMissing;
    }
  }
}

/// Finds the affine map from places to columns and rows by least squares over 8 x 8 samples.
/// Returns false if they are on one line or not finite.
bool find_lattice(const SampleGrid& samples, std::size_t rows, RowSamples& layout) {
  constexpr std::size_t kSamplesPerAxis = 8;
  const auto spread = [](std::size_t i, std::size_t count) {
    return i * (count - 1) / (kSamplesPerAxis - 1);
  };
  const double middle_column = static_cast<double>(samples.columns - 1) / 2;
  const double middle_row = static_cast<double>(rows - 1) / 2;
  std::array<double, 2> mean{}, by_column{}, by_row{};
  double columns_squared = 0, rows_squared = 0;
  for (std::size_t j = 0; j < kSamplesPerAxis; ++j) {
    for (std::size_t i = 0; i < kSamplesPerAxis; ++i) {
      // Mirrored, so that rounding keeps the chosen samples symmetric about the middle.
      const std::size_t column =
          i < kSamplesPerAxis / 2
              ? spread(i, samples.columns)
              : samples.columns - 1 - spread(kSamplesPerAxis - 1 - i, samples.columns);
      const std::size_t row = j < kSamplesPerAxis / 2
                                  ? spread(j, rows)
                                  : rows - 1 - spread(kSamplesPerAxis - 1 - j, rows);
      const std::size_t at = row * samples.columns + column;
      const double c = static_cast<double>(column) - middle_column;
      const double r = static_cast<double>(row) - middle_row;
      const std::array<double, 2> place{samples.x[at], samples.y[at]};
      for (std::size_t k = 0; k < 2; ++k) {
        mean[k] += place[k] / (kSamplesPerAxis * kSamplesPerAxis);
        by_column[k] += c * place[k];
        by_row[k] += r * place[k];
      }
      columns_squared += c * c;
      rows_squared += r * r;
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    by_column[k] /= columns_squared;
    by_row[k] /= rows_squared;
  }
  const double determinant = by_column[0] * by_row[1] - by_column[1] * by_row[0];
  if (!(std::abs(determinant) > 0.0 && std::isfinite(determinant))) return false;
  layout.mirrored = determinant < 0.0;
  layout.column_x = by_row[1] / determinant;
  layout.column_y = -by_row[0] / determinant;
  layout.row_x = -by_column[1] / determinant;
  layout.row_y = by_column[0] / determinant;
  layout.column_0 = middle_column - (layout.column_x * mean[0] + layout.column_y * mean[1]);
  layout.row_0 = middle_row - (layout.row_x * mean[0] + layout.row_y * mean[1]);
  return true;
}

/// The greatest deviation of samples from the lattice, in columns or rows, or infinite if one has a
/// height but no place.
double deviation_from_lattice(const SampleGrid& samples, const RowSamples& layout) {
  double largest = 0.0;
  for (std::size_t i = 0; i < samples.z.size(); ++i) {
    if (std::isnan(samples.z[i])) continue;
    const double column = static_cast<double>(i % samples.columns);
    const double row = static_cast<double>(i / samples.columns);
    const double x = samples.x[i], y = samples.y[i];
    const double column_error =
        layout.column_0 + (layout.column_x * x + layout.column_y * y) - column;
    const double row_error = layout.row_0 + (layout.row_x * x + layout.row_y * y) - row;
    const double deviation = std::max(std::abs(column_error), std::abs(row_error));
    if (!(std::abs(column_error) + std::abs(row_error) < kInfinity)) return kInfinity;
    largest = std::max(largest, deviation);
  }
  return largest;
}

}  // namespace

bool is_rectangle(std::span<const Point3> frame) {
  if (frame.size() < 4) return false;
  for (const Point3& p : frame) {
    if (!(std::abs(p[2]) < kLargest)) return false;
    for (std::size_t k = 0; k < 2; ++k)
      if (!(p[k] >= 0.0 && p[k] < kMaxCoordinate && p[k] == std::floor(p[k]))) return false;
  }
  const auto region = region_of(frame);
  const auto &low = region.min, &high = region.max;
  const double width = high[0] - low[0], height = high[1] - low[1];
  if (!(width > 0.0 && height > 0.0)) return false;
  // Distances along the sides, from the south-west corner.
  const double perimeter = 2.0 * (width + height);
  const auto boundary_distance = [&](const Point3& p) {
    if (p[1] == low[1]) return p[0] - low[0];
    if (p[0] == high[0]) return width + (p[1] - low[1]);
    if (p[1] == high[1]) return width + height + (high[0] - p[0]);
    return p[0] == low[0] ? 2.0 * width + height + (high[1] - p[1]) : -1.0;
  };
  unsigned corners = 0, turns = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double here = boundary_distance(frame[i]),
                 next = boundary_distance(frame[i + 1 == frame.size() ? 0 : i + 1]);
    if (here < 0.0 || here >= perimeter || here == next) return false;
    turns += next < here ? 1 : 0;
    corners +=
        here == 0.0 || here == width || here == width + height || here == 2.0 * width + height ? 1
                                                                                               : 0;
  }
  return corners == 4 && turns == 1;
}

RowSamples PaddedSamples::view() const {
  RowSamples all = layout;
  all.x = x.data() + (all.upright ? 1 : 0);
  all.y = y.data() + (all.upright ? 1 : 0);
  all.z = z.data();
  return all;
}

std::optional<PaddedSamples> padded_samples(const SampleRows& samples,
                                            std::span<const Point3> frame) {
  if (!regular(samples.x) || !regular(samples.y)) return std::nullopt;
  const std::size_t columns = samples.x.size();
  PaddedSamples out;
  RowSamples& layout = out.layout;
  layout.stride = columns + kRowPad;
  layout.columns = static_cast<std::int32_t>(columns);
  layout.rows = static_cast<std::int32_t>(samples.y.size());
  layout.upright = true;
  layout.column_x = per_unit(samples.x);
  layout.row_y = per_unit(samples.y);
  layout.column_0 = -samples.x[0] * layout.column_x;
  layout.row_0 = -samples.y[0] * layout.row_y;
  layout.deviation = kMaxUnevenness;
  copy_heights(
      samples.z, columns, region_of(frame),
      [&](std::size_t row, std::size_t column) {
        return std::array<double, 2>{samples.x[column], samples.y[row]};
      },
      out);
  out.x = pad(samples.x);
  out.y = pad(samples.y);
  return out;
}

std::optional<PaddedSamples> padded_samples(const SampleGrid& samples,
                                            std::span<const Point3> frame) {
  const std::size_t columns = samples.columns;
  const std::size_t rows = columns == 0 ? 0 : samples.z.size() / columns;
  if (columns < 2 || rows < 2 || columns > kMaxRows || rows > kMaxRows) return std::nullopt;
  PaddedSamples out;
  RowSamples& layout = out.layout;
  layout.stride = columns + kRowPad;
  layout.columns = static_cast<std::int32_t>(columns);
  layout.rows = static_cast<std::int32_t>(rows);
  if (!find_lattice(samples, rows, layout)) return std::nullopt;
  // Adds a margin for rounding.
  layout.deviation = deviation_from_lattice(samples, layout) + 1e-6;
  if (!(layout.deviation <= kMaxDeviation)) return std::nullopt;
  copy_heights(
      samples.z, columns, region_of(frame),
      [&](std::size_t row, std::size_t column) {
        const std::size_t i = row * columns + column;
        return std::array<double, 2>{samples.x[i], samples.y[i]};
      },
      out);
  out.x = pad_rows(samples.x, columns, layout.stride);
  out.y = pad_rows(samples.y, columns, layout.stride);
  return out;
}

}  // namespace terrace::tri::tin::rows
