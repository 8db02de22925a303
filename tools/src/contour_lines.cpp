// SPDX-License-Identifier: GPL-3.0-or-later
#include "contour_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "portable_math.hpp"

namespace terrace::tools {
namespace {

constexpr std::uint64_t kHorizontal = 0, kVertical = 1, kFalling = 2, kRising = 3;

}  // namespace

ContourLines::ContourLines(std::int64_t columns, double interval,
                           std::function<void(const ContourLine&)> emit)
    : columns_(columns), interval_(interval), emit_(std::move(emit)) {}

std::size_t ContourLines::Hash::operator()(const Crossing& c) const {
  return scramble(c.edge ^ scramble(static_cast<std::uint64_t>(c.level)));
}

std::int64_t ContourLines::level_of(double height) const {
  auto level = static_cast<std::int64_t>(std::ceil(height / interval_));
  // The quotient is rounded; level * interval, as it is written, decides.
  while (static_cast<double>(level) * interval_ < height) ++level;
  while (static_cast<double>(level - 1) * interval_ >= height) --level;
  return level;
}

ContourLines::Crossing ContourLines::crossing(std::int64_t level, const Corner& a,
                                              const Corner& b) const {
  const std::int64_t column = std::min(a.column, b.column), row = std::min(a.row, b.row);
  const std::uint64_t kind = a.row == b.row                             ? kHorizontal
                             : a.column == b.column                     ? kVertical
                             : (a.column < b.column) == (a.row < b.row) ? kFalling
                                                                        : kRising;
  return {level, static_cast<std::uint64_t>(row * columns_ + column) * 4 + kind};
}

Point2 ContourLines::place(std::int64_t level, const Corner& a, const Corner& b) const {
  // Always from the same end, so that both triangles at an edge find the same place.
  const bool first = std::pair(a.row, a.column) < std::pair(b.row, b.column);
  const Corner &from = first ? a : b, &to = first ? b : a;
  const double t =
      (static_cast<double>(level) * interval_ - from.height) / (to.height - from.height);
  return {static_cast<double>(from.column) + t * static_cast<double>(to.column - from.column),
          static_cast<double>(from.row) + t * static_cast<double>(to.row - from.row)};
}

void ContourLines::triangle(const Corner& a, const Corner& b, const Corner& c) {
  const std::array<const Corner*, 3> corner{&a, &b, &c};
  const auto [low, high] = std::minmax({a.level, b.level, c.level});
  for (std::int64_t level = low; level < high; ++level) {
    // The one that is alone on its side of the level.
    const std::array<bool, 3> above{a.level > level, b.level > level, c.level > level};
    const std::size_t alone = above[1] == above[2] ? 0 : above[0] == above[2] ? 1 : 2;
    const Corner& apex = *corner[alone];
    const Corner* next = corner[(alone + 1) % 3];
    const Corner* previous = corner[(alone + 2) % 3];
    if (!above[alone]) std::swap(next, previous);
    segment(crossing(level, apex, *next), place(level, apex, *next),
            crossing(level, apex, *previous), place(level, apex, *previous));
  }
}

void ContourLines::segment(const Crossing& from, Point2 from_place, const Crossing& to,
                           Point2 to_place) {
  ++segments_;
  const auto before = ends_.find(from);
  const auto after = begins_.find(to);
  if (before == ends_.end() && after == begins_.end()) {
    lines_[next_line_] = {from, to, {from_place, to_place}};
    begins_[from] = ends_[to] = next_line_++;
    open_points_ += 2;
    return;
  }
  if (after == begins_.end()) {
    const std::uint64_t number = before->second;
    Line& line = lines_[number];
    line.points.push_back(to_place);
    line.end = to;
    ends_.erase(before);
    ends_[to] = number;
    ++open_points_;
    return;
  }
  if (before == ends_.end()) {
    const std::uint64_t number = after->second;
    Line& line = lines_[number];
    line.points.push_front(from_place);
    line.begin = from;
    begins_.erase(after);
    begins_[from] = number;
    ++open_points_;
    return;
  }
  const std::uint64_t first = before->second, second = after->second;
  ends_.erase(before);
  begins_.erase(after);
  Line& line = lines_[first];
  if (first == second) {
    line.points.push_back(to_place);
    ++open_points_;
    emit(line, true);
    lines_.erase(first);
    return;
  }
  // The shorter one moves; the line keeps the smaller number.
  Line& rest = lines_[second];
  if (rest.points.size() > line.points.size()) {
    rest.points.insert(rest.points.begin(), line.points.begin(), line.points.end());
    line.points.swap(rest.points);
  } else {
    line.points.insert(line.points.end(), rest.points.begin(), rest.points.end());
  }
  line.end = rest.end;
  const std::uint64_t kept = std::min(first, second);
  begins_[line.begin] = ends_[line.end] = kept;
  if (kept != first) lines_[kept] = std::move(line);
  lines_.erase(std::max(first, second));
}

void ContourLines::emit(Line& line, bool closed) {
  open_points_ -= line.points.size();
  ContourLine result{line.begin.level, closed, {}};
  for (const Point2& p : line.points) {
    if (result.points.empty() || result.points.back() != p) result.points.push_back(p);
  }
  if (result.points.size() > 1) emit_(result);
}

void ContourLines::emit_whole(std::int64_t last_row, bool all) {
  const auto goes_on = [&](const Crossing& c) {
    return !all && c.edge % 4 == kHorizontal &&
           c.edge / 4 / static_cast<std::uint64_t>(columns_) ==
               static_cast<std::uint64_t>(last_row);
  };
  for (auto at = lines_.begin(); at != lines_.end();) {
    Line& line = at->second;
    if (goes_on(line.begin) || goes_on(line.end)) {
      ++at;
      continue;
    }
    begins_.erase(line.begin);
    ends_.erase(line.end);
    emit(line, false);
    at = lines_.erase(at);
  }
}

void ContourLines::add(std::span<const double> heights, std::int64_t rows,
                       const std::function<bool(std::int64_t, std::int64_t)>& wanted) {
  levels_.resize(heights.size());
  for (std::size_t i = 0; i < heights.size(); ++i) {
    levels_[i] = std::isnan(heights[i]) ? 0 : level_of(heights[i]);
  }
  const auto corner = [&](std::int64_t column, std::int64_t row) {
    const auto at = static_cast<std::size_t>(row * columns_ + column);
    return Corner{column, row_ + row, heights[at], levels_[at]};
  };
  for (std::int64_t row = 0; row + 1 < rows; ++row) {
    for (std::int64_t column = 0; column + 1 < columns_; ++column) {
      const auto at = static_cast<std::size_t>(row * columns_ + column);
      const auto below = at + static_cast<std::size_t>(columns_);
      const std::int64_t level = levels_[at];
      if (levels_[at + 1] == level && levels_[below] == level && levels_[below + 1] == level) {
        continue;
      }
      if (wanted && !wanted(column, row_ + row)) continue;
      const Corner c00 = corner(column, row), c10 = corner(column + 1, row),
                   c01 = corner(column, row + 1), c11 = corner(column + 1, row + 1);
      const auto data = [](const Corner& c) { return !std::isnan(c.height); };
      // As lattice_surface.hpp has it.
      if (data(c10) && data(c01)) {
        if (data(c00)) triangle(c00, c10, c01);
        if (data(c11)) triangle(c11, c01, c10);
      } else if (data(c00) && data(c11)) {
        if (data(c01)) triangle(c00, c11, c01);
        if (data(c10)) triangle(c00, c10, c11);
      }
    }
  }
  row_ += rows - 1;
  emit_whole(row_, false);
}

void ContourLines::finish() { emit_whole(row_, true); }

}  // namespace terrace::tools
