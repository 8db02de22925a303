// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// A contour line; closed lines end where they begin.
struct ContourLine {
  std::int64_t level = 0;  ///< the height is level times the interval
  bool closed = false;
  std::vector<Point2> points;
};

/// Limits that end the joining of lines early.
struct OpenLineLimit {
  /// The most points of incomplete lines.
  std::uint64_t points = std::numeric_limits<std::uint64_t>::max();
  std::function<void()> exceeded{};  ///< called above the limit; must throw
  std::stop_token stop{};            ///< ends with stream::Stopped
};

/// Consecutive segments of a line. Segments have an order; a closed line begins after the last of
/// its segments in that order.
template <class Crossing>
struct LineStretch {
  Crossing from, to;
  std::span<const Point2> points;  ///< one more than segments
  std::uint32_t number = 0;        ///< stretches are numbered by their first segments
  std::size_t last = 0;            ///< index of the point at which the last segment ends
};

/// Joins directed segments to lines. A Crossing is where a segment begins or ends: a level (its
/// member `level`) on an edge. At most one segment begins there, and at most one ends. The order of
/// the lines depends only on the order of the segments.
///
/// Costs two hash look-ups per segment or stretch. Memory: the incomplete lines.
template <class Crossing, class Hash>
class LineJoiner {
 public:
  /// emit: receives every line when it is complete. Lines that shrink to a point are left out.
  explicit LineJoiner(std::function<void(ContourLine&&)> emit, OpenLineLimit limit = {})
      : emit_(std::move(emit)), limit_(std::move(limit)) {
    // Indices of points have 32 bits.
    limit_.points = std::min<std::uint64_t>(limit_.points, kNone - 4);
  }

  void add(const Crossing& from, Point2 from_place, const Crossing& to, Point2 to_place) {
    const std::array<Point2, 2> points{from_place, to_place};
    add({from, to, points, 0, 1});
    end_of_stretches(1);
  }

  /// Has the effect of adding the segments of some stretches one by one, in their order. Stretches
  /// must come in the order of their last segments, and be numbered from 0 in the order of their
  /// first ones. Call end_of_stretches(count) after the last stretch.
  void add(const LineStretch<Crossing>& stretch) {
    const std::span<const Point2> points = stretch.points;
    segments_ += points.size() - 1;
    if (limit_.stop.stop_requested()) throw stream::Stopped();
    if (open_points_ > limit_.points) limit_.exceeded();
    const std::uint64_t number = next_number_ + stretch.number;
    const std::uint32_t from_hash = hash_of(stretch.from), to_hash = hash_of(stretch.to);
    const std::uint32_t first = take(stretch.from, from_hash, kEnd);
    const std::uint32_t second = take(stretch.to, to_hash, kBegin);
    if (first == kNone && second == kNone) {
      const std::uint32_t fresh = new_line();
      lines_[fresh] = {stretch.from, stretch.to, number, 0, 0, 0};
      lines_[fresh].first = lines_[fresh].last = new_point(points[0]);
      lines_[fresh].count = 1;
      ++open_points_;
      append(fresh, points.subspan(1));
      put(from_hash, fresh, kBegin);
      put(to_hash, fresh, kEnd);
    } else if (second == kNone) {
      append(first, points.subspan(1));
      lines_[first].end = stretch.to;
      lines_[first].number = std::min(lines_[first].number, number);
      put(to_hash, first, kEnd);
    } else if (first == kNone) {
      for (std::size_t i = points.size() - 1; i-- > 0;) {
        const std::uint32_t added = new_point(points[i]);
        points_[added].next = lines_[second].first;
        lines_[second].first = added;
      }
      Line& line = lines_[second];
      line.begin = stretch.from;
      line.number = std::min(line.number, number);
      line.count += points.size() - 1;
      open_points_ += points.size() - 1;
      put(from_hash, second, kBegin);
    } else if (first == second) {
      append(first, points.subspan(1, stretch.last));
      const std::uint32_t last = lines_[first].last;
      append(first, points.subspan(stretch.last + 1));
      turn(lines_[first], last);
      emit(first, true);
    } else {
      append(first, points.subspan(1, points.size() - 2));
      // The line keeps the smallest number.
      Line& line = lines_[first];
      Line& rest = lines_[second];
      points_[line.last].next = rest.first;
      line.last = rest.last;
      line.end = rest.end;
      line.count += rest.count;
      line.number = std::min({line.number, rest.number, number});
      slot_of(second, kEnd)->end = first << 1 | kEnd;
      drop_line(second);
    }
  }
  void end_of_stretches(std::size_t count) { next_number_ += count; }

  /// Adds a complete closed line, in its place among the stretches.
  void pass_closed(std::int64_t level, std::span<const Point2> points) {
    segments_ += points.size() - 1;
    ContourLine result{level, true, {}};
    result.points.reserve(points.size());
    std::unique_copy(points.begin(), points.end(), std::back_inserter(result.points));
    if (result.points.size() > 1) emit_(std::move(result));
  }

  /// Emits the lines with no end that continues. O(n log n) with n incomplete lines.
  template <class Continues>
  void emit_complete(const Continues& continues) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> complete;
    for (std::uint32_t i = 0; i < lines_.size(); ++i) {
      const Line& line = lines_[i];
      if (line.count > 0 && !continues(line.begin) && !continues(line.end)) {
        complete.emplace_back(line.number, i);
      }
    }
    std::sort(complete.begin(), complete.end());
    for (const auto& [number, i] : complete) {
      take(lines_[i].begin, hash_of(lines_[i].begin), kBegin);
      take(lines_[i].end, hash_of(lines_[i].end), kEnd);
      emit(i, false);
    }
  }

  /// Number of points of incomplete lines.
  [[nodiscard]] std::uint64_t open_points() const { return open_points_; }
  /// Number of segments added until now.
  [[nodiscard]] std::uint64_t segments() const { return segments_; }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::uint32_t kBegin = 0, kEnd = 1;
  struct Line {
    Crossing begin, end;
    std::uint64_t number = 0;  ///< the order in which lines are emitted
    std::uint32_t first = 0, last = 0;
    std::uint64_t count = 0;  ///< number of points; 0: unused, and `first` is the next unused line
  };
  struct Point {
    Point2 place{};
    std::uint32_t next = 0;
  };
  /// An end of a line, in a table with linear probing.
  struct Slot {
    std::uint32_t hash = 0;
    std::uint32_t end = kNone;  ///< a line's index << 1 | kBegin or kEnd; kNone: the slot is free
  };

  static std::uint32_t hash_of(const Crossing& crossing) {
    return static_cast<std::uint32_t>(Hash()(crossing));
  }
  [[nodiscard]] const Crossing& crossing_of(std::uint32_t end) const {
    const Line& line = lines_[end >> 1];
    return (end & 1U) == kBegin ? line.begin : line.end;
  }

  /// Removes the line that begins (or ends) at a crossing from the table and returns it; kNone if
  /// there is none.
  std::uint32_t take(const Crossing& crossing, std::uint32_t hash, std::uint32_t side) {
    for (std::size_t at = hash & mask_; slots_[at].end != kNone; at = (at + 1) & mask_) {
      const std::uint32_t end = slots_[at].end;
      if (slots_[at].hash != hash || (end & 1U) != side || !(crossing_of(end) == crossing))
        continue;
      erase(at);
      return end >> 1;
    }
    return kNone;
  }
  void erase(std::size_t hole) {
    // Entries that follow move up unless they are closer to their own slot than to the hole.
    for (std::size_t at = (hole + 1) & mask_; slots_[at].end != kNone; at = (at + 1) & mask_) {
      if (((at - slots_[at].hash) & mask_) < ((at - hole) & mask_)) continue;
      slots_[hole] = slots_[at];
      hole = at;
    }
    slots_[hole].end = kNone;
    --ends_;
  }
  void put(std::uint32_t hash, std::uint32_t line, std::uint32_t side) {
    if (2 * ++ends_ > slots_.size()) {
      std::vector<Slot> before(2 * slots_.size());
      before.swap(slots_);
      mask_ = slots_.size() - 1;
      for (const Slot& slot : before) {
        if (slot.end != kNone) *free_slot(slot.hash) = slot;
      }
    }
    *free_slot(hash) = {hash, line << 1 | side};
  }
  Slot* free_slot(std::uint32_t hash) {
    std::size_t at = hash & mask_;
    while (slots_[at].end != kNone) at = (at + 1) & mask_;
    return &slots_[at];
  }
  Slot* slot_of(std::uint32_t line, std::uint32_t side) {
    const std::uint32_t end = line << 1 | side;
    std::size_t at = hash_of(crossing_of(end)) & mask_;
    while (slots_[at].end != end) at = (at + 1) & mask_;
    return &slots_[at];
  }

  std::uint32_t new_point(const Point2& place) {
    if (free_point_ == kNone) {
      points_.push_back({place});
      return static_cast<std::uint32_t>(points_.size() - 1);
    }
    const std::uint32_t point = free_point_;
    free_point_ = points_[point].next;
    points_[point].place = place;
    return point;
  }
  std::uint32_t new_line() {
    if (free_line_ == kNone) {
      lines_.emplace_back();
      return static_cast<std::uint32_t>(lines_.size() - 1);
    }
    const std::uint32_t line = free_line_;
    free_line_ = lines_[line].first;
    return line;
  }
  void drop_line(std::uint32_t line) {
    lines_[line].count = 0;
    lines_[line].first = free_line_;
    free_line_ = line;
  }

  void append(std::uint32_t number, std::span<const Point2> points) {
    for (const Point2& p : points) {
      const std::uint32_t added = new_point(p);
      points_[lines_[number].last].next = added;
      lines_[number].last = added;
    }
    lines_[number].count += points.size();
    open_points_ += points.size();
  }

  /// Rotates a closed line so that it begins and ends at the given point.
  void turn(Line& line, std::uint32_t point) {
    if (point == line.last) return;
    // The first point, which equals the last, becomes the last.
    const std::uint32_t dropped = line.first;
    points_[line.last].next = points_[dropped].next;
    line.first = point;
    // point .. last, second .. before point, and a copy of point.
    std::uint32_t before = line.last;
    while (points_[before].next != point) before = points_[before].next;
    points_[dropped].place = points_[point].place;
    points_[before].next = dropped;
    line.last = dropped;
  }

  /// Requires that its ends are no longer in the table.
  void emit(std::uint32_t number, bool closed) {
    const Line& line = lines_[number];
    open_points_ -= line.count;
    ContourLine result{line.begin.level, closed, {}};
    result.points.reserve(line.count);
    std::uint32_t at = line.first;
    for (std::uint64_t i = 0; i < line.count; ++i, at = points_[at].next) {
      const Point2& p = points_[at].place;
      if (result.points.empty() || result.points.back() != p) result.points.push_back(p);
    }
    points_[line.last].next = free_point_;
    free_point_ = line.first;
    drop_line(number);
    if (result.points.size() > 1) emit_(std::move(result));
  }

  std::function<void(ContourLine&&)> emit_;
  OpenLineLimit limit_;
  std::uint64_t open_points_ = 0, segments_ = 0, next_number_ = 0;
  std::vector<Line> lines_;
  std::vector<Point> points_;  ///< linked from first to last in each line
  std::uint32_t free_line_ = kNone, free_point_ = kNone;
  std::vector<Slot> slots_{16};  ///< size is a power of two, at most half full
  std::size_t mask_ = 15, ends_ = 0;
};

}  // namespace terrace::terrain
