// SPDX-License-Identifier: Apache-2.0
#include "samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <terrace/base/simd.hpp>

namespace terrace::tri::tin {
namespace {

/// Larger triangles are tested coarsely first. Most samples need not be visited until triangles are
/// small, and the result tends to have fewer triangles. 256 and 1024 were measured and are worse.
constexpr std::int64_t kCoarseArea = 400;

constexpr double kTangent = 0.08748866352592401;  // tangent of 5 degrees

constexpr std::size_t round_up(std::size_t n, std::size_t unit) {
  return (n + unit - 1) / unit * unit;
}

template <class T>
T rounded_down(double value) {
  const auto near = static_cast<T>(value);
  return static_cast<double>(near) > value ? std::nextafter(near, T{0}) : near;
}

template <class T>
bool have_data(const GridCorner<T>& a, const GridCorner<T>& b, const GridCorner<T>& c) {
  return !std::isnan(a.z) && !std::isnan(b.z) && !std::isnan(c.z);
}

struct PreciseWorst {
  double error = 0;
  double slack = 0;  ///< bound of the rounding error of `error`
  std::uint32_t place = 0;
  bool missing = false;  ///< a sample has no data
};

/// Computes in double what the scans compute in floats, for triangles whose planes are too steep
/// for floats. Corners do not count.
template <class T>
PreciseWorst precise_worst(const GridSamples<T>& samples, const GridCorner<T>& a,
                           const GridCorner<T>& b, const GridCorner<T>& c) {
  PreciseWorst worst;
  const auto base = static_cast<double>(a.z);
  const double bz = static_cast<double>(b.z) - base, cz = static_cast<double>(c.z) - base;
  const double bx = b.x - a.x, by = b.y - a.y, cx = c.x - a.x, cy = c.y - a.y;
  const auto area = static_cast<double>(turn(a, b, c));
  const double slope_x = (bz * cy - cz * by) / area, slope_y = (cz * bx - bz * cx) / area;
  const double width = std::max({std::fabs(bx), std::fabs(cx), std::fabs(bx - cx)});
  const double height = std::max({std::fabs(by), std::fabs(cy), std::fabs(by - cy)});
  worst.slack = 0x1p-50 * (std::fabs(slope_x) * width + std::fabs(slope_y) * height +
                           (std::fabs(bz) + std::fabs(cz)) * (1 + 2 * width * height / area));
  const auto is_at = [](const GridCorner<T>& corner, std::int32_t x, std::int32_t y) {
    return corner.x == x && corner.y == y;
  };
  visit_rows(a, b, c, [&](std::int32_t y, std::int32_t first, std::int32_t last) {
    if (y < samples.first_y || y > samples.last_y) return true;
    const T* const row = samples.heights + static_cast<std::size_t>(y) * samples.stride;
    for (std::int32_t x = std::max(first, samples.first_x); x <= std::min(last, samples.last_x);
         ++x) {
      const double rise = slope_x * (x - a.x) + slope_y * (y - a.y);
      const double error = std::fabs(static_cast<double>(row[x]) - base - rise);
      worst.missing |= !(error >= 0);
      if (!(error > worst.error) || is_at(a, x, y) || is_at(b, x, y) || is_at(c, x, y)) continue;
      worst.error = error;
      worst.place = place_at(x, y);
    }
    return !worst.missing;
  });
  return worst;
}

}  // namespace

template <class T>
template <class Height>
RasterSamples<T>::RasterSamples(const GridWindow<Height>& window, const GridTinOptions& options,
                                bool sides_fixed, base::SimdPath set)
    : LatticeSamples<RasterSamples<T>, GridCorner<T>>(Ground(
          options.column_step, options.row_step, std::max(window.columns, window.rows), kTangent)),
      columns_(static_cast<std::int32_t>(window.columns)),
      rows_(static_cast<std::int32_t>(window.rows)),
      sides_fixed_(sides_fixed),
      bound_(options.max_error),
      scan_bound_(rounded_down<T>(options.max_error)),
      scan_(grid_scans<T>(set)) {
  const std::size_t stride = round_up(window.columns + kScanPadRight, 16);
  heights_.resize((window.rows + kScanPadBelow) * stride);
  bool gaps = false;
  for (std::size_t y = 0; y < window.rows; ++y) {
    const Height* const from = window.heights.data() + y * window.columns;
    T* const to = heights_.data() + y * stride;
    for (std::size_t x = 0; x < window.columns; ++x) {
      const bool data = std::isfinite(from[x]);
      to[x] = data ? static_cast<T>(from[x]) : std::numeric_limits<T>::quiet_NaN();
      gaps |= !data;
    }
  }
  const std::int32_t rim = sides_fixed ? 1 : 0;
  samples_ = {heights_.data(), stride, rim, rim, columns_ - 1 - rim, rows_ - 1 - rim};
  if (gaps) gaps_.emplace(samples_, columns_, rows_);
}

template <class T>
void RasterSamples<T>::judge_coarsely_first() {
  const auto count = [](std::int32_t n) {
    return static_cast<std::size_t>((n + kGridCoarse - 1) / kGridCoarse);
  };
  const std::size_t columns = count(columns_), rows = count(rows_);
  const std::size_t stride = round_up(columns + kScanPadRight, 16);
  coarse_heights_.resize((rows + kScanPadBelow) * stride);
  for (std::size_t y = 0; y < rows; ++y) {
    const T* const from = heights_.data() + y * kGridCoarse * samples_.stride;
    T* const to = coarse_heights_.data() + y * stride;
    for (std::size_t x = 0; x < columns; ++x) to[x] = from[x * kGridCoarse];
  }
  coarse_ = {coarse_heights_.data(),
             stride,
             samples_.first_x,
             samples_.first_y,
             samples_.last_x / kGridCoarse,
             samples_.last_y / kGridCoarse};
}

template <class T>
WorstSample<T> RasterSamples<T>::worst(const Vertex& a, const Vertex& b, const Vertex& c) const {
  const WorstSample<T> sample = scan_.worst(samples_, a, b, c, scan_bound_);
  if (sample.error != T{kUnsure}) return sample;
  const PreciseWorst precise = precise_worst(samples_, a, b, c);
  if (precise.missing) return {std::numeric_limits<T>::infinity(), 0};
  if (precise.error <= std::max(bound_ - precise.slack, precise.slack)) return {0, 0};
  return {std::max(static_cast<T>(precise.error), std::numeric_limits<T>::min()), precise.place};
}

template <class T>
WorstSample<T> RasterSamples<T>::worst_to_insert(const Vertex& a, const Vertex& b,
                                                 const Vertex& c) const {
  if (!coarse_heights_.empty() && turn(a, b, c) > 2 * kCoarseArea) {
    const WorstSample<T> sample = scan_.coarse(coarse_, a, b, c, scan_bound_);
    if (sample.error > 0 && sample.error < std::numeric_limits<T>::infinity()) return sample;
  }
  return worst(a, b, c);
}

template <class T>
void RasterSamples<T>::set_error(RasterMesh& mesh, std::uint32_t t) const {
  Triangle& triangle = mesh.triangles[t];
  const Vertex &a = mesh.vertex(triangle, 0), &b = mesh.vertex(triangle, 1),
               &c = mesh.vertex(triangle, 2);
  if (!gaps_ || have_data(a, b, c)) {
    const WorstSample<T> sample = worst_to_insert(a, b, c);
    if (sample.error == 0) {
      triangle.error = 0;
      return;
    }
    if (sample.error < std::numeric_limits<T>::infinity()) {
      triangle.place = sample.place;
      triangle.error = static_cast<float>(std::clamp<double>(
          sample.error, std::numeric_limits<float>::min(), std::numeric_limits<float>::max()));
      return;
    }
  } else if (!gaps_->mixed(a, b, c)) {
    triangle.error = 0;
    return;
  }
  triangle.place = gaps_->sample_to_insert(samples_, this->ground(), a, b, c);
  triangle.error = triangle.place == kNone ? 0 : std::numeric_limits<float>::infinity();
}

template <class T>
bool RasterSamples<T>::open(std::uint32_t place) const {
  return !gaps_ || !gaps_->is_vertex(place);
}

template <class T>
GridCorner<T> RasterSamples<T>::take(std::uint32_t place) {
  if (gaps_) gaps_->take(place);
  return sample_of({column_of(place), row_of(place), T{}});
}

template <class T>
std::uint32_t RasterSamples<T>::place_of(const Vertex& vertex) const {
  return place_at(vertex.x, vertex.y);
}

template <class T>
GridCorner<T> RasterSamples<T>::sample_of(const Vertex& vertex) const {
  const auto row = static_cast<std::size_t>(vertex.y) * samples_.stride;
  return {vertex.x, vertex.y, heights_[row + static_cast<std::size_t>(vertex.x)]};
}

template <class T>
bool RasterSamples<T>::within(const Vertex& a, const Vertex& b, const Vertex& c) const {
  const int result = scan_.within(samples_, a, b, c, scan_bound_);
  if (result != kUnsure) return result != 0;
  const PreciseWorst precise = precise_worst(samples_, a, b, c);
  return !precise.missing && precise.error <= std::max(bound_ - precise.slack, precise.slack);
}

template <class T>
bool RasterSamples<T>::fits(const Vertex& a, const Vertex& b, const Vertex& c,
                            const Sample& removed) const {
  if (gaps_ && !have_data(a, b, c)) return !gaps_->mixed(a, b, c);
  return within_at(a, b, c, removed, bound_) && within(a, b, c);
}

/// A sample at which the vertex has weight w allows the vertex to rise by (error - bound) / w to
/// (error + bound) / w.
template <class T>
void RasterSamples<T>::narrow(std::uint32_t, const Vertex& v, const Vertex& b, const Vertex& c,
                              Interval& rises) const {
  if (!have_data(v, b, c)) return;
  const auto area = static_cast<double>(turn(v, b, c));
  const double bz = static_cast<double>(b.z) - static_cast<double>(v.z);
  const double cz = static_cast<double>(c.z) - static_cast<double>(v.z);
  const double allowed = bound_ * (1 - 0x1p-20) - 0x1p-40 * (std::fabs(bz) + std::fabs(cz));
  visit_rows(v, b, c, [&](std::int32_t y, std::int32_t from, std::int32_t to) {
    const T* const row = heights_.data() + static_cast<std::size_t>(y) * samples_.stride;
    for (std::int32_t x = from; x <= to; ++x) {
      const Vertex p{x, y, T{}};
      const auto weight = static_cast<double>(turn(p, b, c));
      if (weight == 0) continue;
      const double rise =
          (bz * static_cast<double>(turn(v, p, c)) + cz * static_cast<double>(turn(v, b, p))) /
          area;
      const double error = static_cast<double>(row[x]) - static_cast<double>(v.z) - rise;
      const double part = area / weight;
      rises.low = std::max(rises.low, (error - allowed) * part);
      rises.high = std::min(rises.high, (error + allowed) * part);
    }
    return true;
  });
}

template <class T>
bool RasterSamples<T>::raise(Vertex& v, const Interval& rises) const {
  if (!(rises.low <= rises.high) || !std::isfinite(rises.low) || !std::isfinite(rises.high))
    return false;
  const auto height = static_cast<T>(static_cast<double>(v.z) + (rises.low + rises.high) / 2);
  const double rise = static_cast<double>(height) - static_cast<double>(v.z);
  if (!(rises.low <= rise && rise <= rises.high)) return false;
  v.z = height;
  return true;
}

template <class T>
bool RasterSamples<T>::covers(const Vertex& a, const Vertex& b, const Vertex& c) const {
  return !gaps_ || (have_data(a, b, c) && !precise_worst(samples_, a, b, c).missing);
}

template <class T>
void RasterSamples<T>::publish(const Vertex& vertex, GridTin& tin) const {
  tin.vertices.push_back({static_cast<std::uint32_t>(vertex.x),
                          static_cast<std::uint32_t>(vertex.y), static_cast<double>(vertex.z)});
}

template class RasterSamples<float>;
template class RasterSamples<double>;
template RasterSamples<float>::RasterSamples(const GridWindow<float>&, const GridTinOptions&, bool,
                                             base::SimdPath);
template RasterSamples<float>::RasterSamples(const GridWindow<double>&, const GridTinOptions&, bool,
                                             base::SimdPath);
template RasterSamples<double>::RasterSamples(const GridWindow<float>&, const GridTinOptions&, bool,
                                              base::SimdPath);
template RasterSamples<double>::RasterSamples(const GridWindow<double>&, const GridTinOptions&,
                                              bool, base::SimdPath);

}  // namespace terrace::tri::tin
