// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// A contour line; closed ones end where they begin.
struct ContourLine {
  std::int64_t level = 0;  ///< its height is level times the interval
  bool closed = false;
  std::vector<Point2> points;
};

/// How many points lines that are not whole may have.
struct OpenLineLimit {
  std::uint64_t points = std::numeric_limits<std::uint64_t>::max();
  std::function<void()> exceeded{};  ///< called beyond; must throw
};

/// Joins directed segments to lines. Crossing says where a segment begins or ends: a level (its
/// member `level`) on an edge; at most one segment begins there and at most one ends. Lines come
/// out in an order that depends on the order of the segments alone.
///
/// Some hash look-ups per segment. Memory: the lines that are not whole.
template <class Crossing, class Hash>
class LineJoiner {
 public:
  /// emit: takes every line once it is whole. Lines that shrink to a point are left out.
  explicit LineJoiner(std::function<void(ContourLine&&)> emit, OpenLineLimit limit = {})
      : emit_(std::move(emit)), limit_(std::move(limit)) {}

  void add(const Crossing& from, Point2 from_place, const Crossing& to, Point2 to_place) {
    ++segments_;
    if (open_points_ > limit_.points) limit_.exceeded();
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

  /// Emits the lines of which no end goes on. O(lines that are not whole).
  template <class GoesOn>
  void emit_whole(const GoesOn& goes_on) {
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

  /// Points of lines that are not whole yet.
  [[nodiscard]] std::uint64_t open_points() const { return open_points_; }
  /// Segments added so far.
  [[nodiscard]] std::uint64_t segments() const { return segments_; }

 private:
  struct Line {
    Crossing begin, end;
    std::deque<Point2> points;
  };

  void emit(Line& line, bool closed) {
    open_points_ -= line.points.size();
    ContourLine result{line.begin.level, closed, {}};
    for (const Point2& p : line.points) {
      if (result.points.empty() || result.points.back() != p) result.points.push_back(p);
    }
    if (result.points.size() > 1) emit_(std::move(result));
  }

  std::function<void(ContourLine&&)> emit_;
  OpenLineLimit limit_;
  std::uint64_t open_points_ = 0, segments_ = 0, next_line_ = 0;
  std::map<std::uint64_t, Line> lines_;  ///< by number: an order that does not depend on hashing
  std::unordered_map<Crossing, std::uint64_t, Hash> begins_, ends_;
};

}  // namespace terrace::terrain
