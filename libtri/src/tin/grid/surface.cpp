// SPDX-License-Identifier: Apache-2.0
#include "surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "careful.hpp"

namespace terrace::tri::tin {
namespace {

/// In larger triangles a sample of every few columns and rows that is beyond the bound is bad
/// enough to be inserted: until triangles are small nearly all samples need not be looked at, and
/// no more triangles come out in the end, rather fewer. Measured: 256 and 1024 are not as good.
constexpr std::int64_t kCoarseArea = 400;

constexpr std::size_t round_up(std::size_t n, std::size_t unit) {
  return (n + unit - 1) / unit * unit;
}

template <class T>
T rounded_down(double value) {
  const auto near = static_cast<T>(value);
  return static_cast<double>(near) > value ? std::nextafter(near, T{0}) : near;
}

}  // namespace

template <class T>
template <class Sample>
GridSurface<T>::GridSurface(const GridWindow<Sample>& window, const GridTinOptions& options,
                            bool sides_fixed, GridPath path)
    : columns_(static_cast<std::int32_t>(window.columns)),
      rows_(static_cast<std::int32_t>(window.rows)),
      rows_turned_((options.column_step < 0) != (options.row_step < 0)),
      sides_fixed_(sides_fixed),
      tiles_(columns_, rows_),
      bound_(options.max_error),
      scan_bound_(rounded_down<T>(options.max_error)),
      ground_(options.column_step, options.row_step, std::max(columns_, rows_)),
      scan_(grid_scan<T>(path)) {
  const std::size_t stride = round_up(window.columns + kScanPadRight, 16);
  heights_.resize((window.rows + kScanPadBelow) * stride);
  bool gaps = false;
  for (std::size_t y = 0; y < window.rows; ++y) {
    const Sample* const from = window.heights.data() + y * window.columns;
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
  for (const auto& [x, y] :
       {std::pair{0, 0}, {columns_ - 1, 0}, {columns_ - 1, rows_ - 1}, {0, rows_ - 1}})
    add_vertex(x, y);
  triangles_ = {{{0, 1, 2}, {kNone, 1, kNone}, 0, 0.0F}, {{0, 2, 3}, {kNone, kNone, 0}, 0, 0.0F}};
}

template <class T>
void GridSurface<T>::make_coarse() {
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
std::uint32_t GridSurface<T>::add_vertex(std::int32_t x, std::int32_t y) {
  const auto row = static_cast<std::size_t>(y) * samples_.stride;
  corners_.push_back({x, y, heights_[row + static_cast<std::size_t>(x)]});
  if (gaps_) gaps_->take(x, y);
  return static_cast<std::uint32_t>(corners_.size() - 1);
}

template <class T>
std::uint32_t GridSurface<T>::locate(std::int32_t x, std::int32_t y, std::uint32_t t) const {
  const Corner p{x, y, T{}};
  for (unsigned side = 0; side < 3;) {
    const Triangle& triangle = triangles_[t];
    if (turn(corner(triangle, after(side)), corner(triangle, before(side)), p) < 0) {
      t = triangle.next[side];
      side = 0;
    } else {
      ++side;
    }
  }
  return t;
}

template <class T>
void GridSurface<T>::insert(std::int32_t x, std::int32_t y, std::uint32_t t) {
  const std::uint32_t vertex = add_vertex(x, y);
  const Corner p = corners_[vertex];
  cavity_.dig(triangles_, t, [&](const Triangle& triangle) {
    return ground_.in_circle(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2), p);
  });
  cavity_.fill(triangles_, vertex, [&](std::uint32_t a, std::uint32_t b) {
    return turn(corners_[a], corners_[b], p) == 0;
  });
}

template <class T>
void GridSurface<T>::insert_sides(const GridSides& sides) {
  std::uint32_t near = 0;
  const auto along = [&](const std::vector<std::uint32_t>& side, std::int32_t x, std::int32_t y,
                         bool row) {
    for (std::size_t i = 1; i + 1 < side.size(); ++i) {
      const auto at = static_cast<std::int32_t>(side[i]);
      const std::int32_t column = row ? at : x, line = row ? y : at;
      near = locate(column, line, near);
      insert(column, line, near);
      near = cavity_.created().front();
    }
  };
  along(sides.first_row, 0, 0, true);
  along(sides.last_column, columns_ - 1, 0, false);
  along(sides.last_row, 0, rows_ - 1, true);
  along(sides.first_column, 0, 0, false);
}

template <class T>
GridWorst<T> GridSurface<T>::worst(const Corner& a, const Corner& b, const Corner& c) const {
  const GridWorst<T> found = scan_.worst(samples_, a, b, c, scan_bound_);
  if (found.error != T{kUnsure}) return found;
  const CarefulWorst sure = careful_worst(samples_, a, b, c);
  if (sure.missing) return {std::numeric_limits<T>::infinity(), 0};
  if (sure.error <= std::max(bound_ - sure.slack, sure.slack)) return {0, 0};
  return {std::max(static_cast<T>(sure.error), std::numeric_limits<T>::min()), sure.place};
}

template <class T>
GridWorst<T> GridSurface<T>::worst_to_insert(const Corner& a, const Corner& b,
                                             const Corner& c) const {
  if (coarse_first_ && turn(a, b, c) > 2 * kCoarseArea) {
    const GridWorst<T> found = scan_.coarse(coarse_, a, b, c, scan_bound_);
    if (found.error > 0 && found.error < std::numeric_limits<T>::infinity()) return found;
  }
  return worst(a, b, c);
}

template <class T>
bool GridSurface<T>::fits(const Corner& a, const Corner& b, const Corner& c,
                          const Corner& removed) const {
  const std::int64_t twice = turn(a, b, c);
  if (twice <= 0 || !ground_.wide(a, b, c, twice)) return false;
  if (gaps_ && !sees_all(a, b, c)) return !gaps_->mixed(a, b, c);
  // Most that fail do so at the very vertex.
  const std::int64_t at_a = turn(b, c, removed), at_b = turn(c, a, removed);
  const std::int64_t at_c = twice - at_a - at_b;
  if ((at_a | at_b | at_c) >= 0) {
    const T own = heights_[static_cast<std::size_t>(removed.y) * samples_.stride +
                           static_cast<std::size_t>(removed.x)];
    const double sum = static_cast<double>(at_a) * static_cast<double>(a.z - own) +
                       static_cast<double>(at_b) * static_cast<double>(b.z - own) +
                       static_cast<double>(at_c) * static_cast<double>(c.z - own);
    if (!(std::fabs(sum) <= bound_ * static_cast<double>(twice))) return false;
  }
  const int found = scan_.within(samples_, a, b, c, scan_bound_);
  if (found != kUnsure) return found != 0;
  const CarefulWorst sure = careful_worst(samples_, a, b, c);
  return !sure.missing && sure.error <= std::max(bound_ - sure.slack, sure.slack);
}

template <class T>
void GridSurface<T>::judge(Triangle& triangle) const {
  const Corner &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
  if (!gaps_ || sees_all(a, b, c)) {
    const GridWorst<T> found = worst_to_insert(a, b, c);
    if (found.error == 0) {
      triangle.error = 0;
      return;
    }
    if (found.error < std::numeric_limits<T>::infinity()) {
      triangle.place = found.place;
      triangle.error = static_cast<float>(std::clamp<double>(
          found.error, std::numeric_limits<float>::min(), std::numeric_limits<float>::max()));
      return;
    }
  } else if (!gaps_->mixed(a, b, c)) {
    triangle.error = 0;
    return;
  }
  triangle.place = gaps_->cure(samples_, ground_, a, b, c);
  triangle.error = triangle.place == kNone ? 0 : std::numeric_limits<float>::infinity();
}

template <class T>
GridTin GridSurface<T>::result() const {
  GridTin tin;
  std::vector<std::uint32_t> number(corners_.size(), kNone);
  std::size_t live = 0;
  for (const Triangle& triangle : triangles_) live += triangle.live() ? 1 : 0;
  tin.triangles.reserve(live);
  for (const Triangle& triangle : triangles_) {
    if (!triangle.live()) continue;
    const Corner &a = corner(triangle, 0), &b = corner(triangle, 1), &c = corner(triangle, 2);
    if (gaps_ && (!sees_all(a, b, c) || careful_worst(samples_, a, b, c).missing)) continue;
    tin.triangles.push_back(triangle.corner);
    if (rows_turned_) std::swap(tin.triangles.back()[1], tin.triangles.back()[2]);
    for (const std::uint32_t vertex : triangle.corner) number[vertex] = 0;
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (number[i] == kNone) continue;
    number[i] = static_cast<std::uint32_t>(tin.vertices.size());
    const Corner& p = corners_[i];
    tin.vertices.push_back({static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                            static_cast<double>(p.z)});
  }
  for (auto& triangle : tin.triangles)
    for (std::uint32_t& vertex : triangle) vertex = number[vertex];
  return tin;
}

template class GridSurface<float>;
template class GridSurface<double>;
template GridSurface<float>::GridSurface(const GridWindow<float>&, const GridTinOptions&, bool,
                                         GridPath);
template GridSurface<float>::GridSurface(const GridWindow<double>&, const GridTinOptions&, bool,
                                         GridPath);
template GridSurface<double>::GridSurface(const GridWindow<float>&, const GridTinOptions&, bool,
                                          GridPath);
template GridSurface<double>::GridSurface(const GridWindow<double>&, const GridTinOptions&, bool,
                                          GridPath);

}  // namespace terrace::tri::tin
