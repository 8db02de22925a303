// SPDX-License-Identifier: Apache-2.0
#include "contour/part_lines.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace terrace::terrain {
namespace {

/// Returns the corner opposite to the edge at which a level leaves a triangle (or enters it), given
/// the levels at its corners, as in ContourLevels::cross().
std::size_t crossed_side(const std::array<std::int64_t, 3>& levels, std::int64_t level,
                         bool leaves) {
  const std::array<bool, 3> above{levels[0] > level, levels[1] > level, levels[2] > level};
  const std::size_t alone = above[1] == above[2] ? 0 : above[0] == above[2] ? 1 : 2;
  return (alone + (above[alone] == leaves ? 1 : 2)) % 3;
}

}  // namespace

Point2 PartTracer::place(std::uint32_t entry, std::size_t corner) const {
  const auto vertices = triangulation_.vertices(triangles_[entry]);
  return triangulation_.point(vertices[(entries_[entry].smallest + corner) % 3]);
}

bool PartTracer::is_before(std::uint32_t s, const Point2& s_place, std::uint32_t t,
                           const Point2& t_place) const {
  if (s_place != t_place) return s_place < t_place;
  const Point2 s_second = place(s, 1), t_second = place(t, 1);
  if (s_second != t_second) return s_second < t_second;
  return place(s, 2) < place(t, 2);
}

void PartTracer::count(std::uint32_t entry, std::ptrdiff_t at, Ends& ends) const {
  const Point2 smallest = place(entry, 0);
  if (is_before(entry, smallest, ends.first, ends.first_place)) {
    ends.first = entry;
    ends.first_place = smallest;
  } else if (is_before(ends.last, ends.last_place, entry, smallest)) {
    ends.last = entry;
    ends.last_place = smallest;
    ends.last_at = at;
  }
}

bool PartTracer::go(std::uint32_t start, std::int64_t level, bool forwards, Ends& ends,
                    std::vector<Point2>& points, ContourCrossing& end) {
  std::uint32_t at = start;
  for (std::ptrdiff_t step = forwards ? 1 : -1;; step += forwards ? 1 : -1) {
    const tri::TriangleId triangle = triangles_[at];
    const auto vertices = triangulation_.vertices(triangle);
    const std::size_t side =
        crossed_side({level_of_[tri::slot(vertices[0])], level_of_[tri::slot(vertices[1])],
                      level_of_[tri::slot(vertices[2])]},
                     level, forwards);
    const tri::VertexId p = vertices[(side + 1) % 3], q = vertices[(side + 2) % 3];
    const Point2 p_place = triangulation_.point(p), q_place = triangulation_.point(q);
    points.push_back(
        levels_.place(level, p_place, heights_[tri::slot(p)], q_place, heights_[tri::slot(q)]));
    const tri::TriangleId next = triangulation_.neighbours(triangle)[side];
    at = next == tri::kNoTriangle ? kNone : number_of_[tri::slot(next)];
    if (at == kNone) {
      end = {level, p_place, q_place, std::min(part_of_[tri::slot(p)], part_of_[tri::slot(q)])};
      return false;
    }
    if (at == start) return true;
    const Entry& entry = entries_[at];
    done_[entry.first + static_cast<std::size_t>(level - entry.low)] = true;
    count(at, step, ends);
  }
}

void PartTracer::follow(std::uint32_t start, std::int64_t level, PartLines& lines) {
  done_[entries_[start].first + static_cast<std::size_t>(level - entries_[start].low)] = true;
  const Point2 smallest = place(start, 0);
  Ends ends{
      static_cast<std::uint32_t>(lines.lines.size()), level, start, start, smallest, smallest, 0};
  forwards_.clear();
  backwards_.clear();
  PartLines::Line line{level, lines.points.size()};
  PartLines::Open open;
  if (go(start, level, true, ends, forwards_, open.to)) {
    // Point i is where segment i ends.
    const auto last = forwards_.begin() + ends.last_at;
    lines.points.insert(lines.points.end(), last, forwards_.end());
    lines.points.insert(lines.points.end(), forwards_.begin(), last + 1);
  } else {
    go(start, level, false, ends, backwards_, open.from);
    lines.points.insert(lines.points.end(), backwards_.rbegin(), backwards_.rend());
    lines.points.insert(lines.points.end(), forwards_.begin(), forwards_.end());
    open.last =
        static_cast<std::size_t>(static_cast<std::ptrdiff_t>(backwards_.size()) + ends.last_at);
    line.open = static_cast<std::uint32_t>(lines.open.size());
    lines.open.push_back(open);
  }
  line.end = lines.points.size();
  lines.lines.push_back(line);
  ends_.push_back(ends);
}

PartLines PartTracer::trace(std::span<const tri::TriangleId> triangles) {
  PartLines lines;
  triangles_ = triangles;
  entries_.clear();
  ends_.clear();
  std::size_t segments = 0;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const auto v = triangulation_.vertices(triangles[i]);
    const std::array<Point2, 3> corner{triangulation_.point(v[0]), triangulation_.point(v[1]),
                                       triangulation_.point(v[2])};
    const auto smallest = std::min_element(corner.begin(), corner.end()) - corner.begin();
    const auto [low, high] = std::minmax(
        {level_of_[tri::slot(v[0])], level_of_[tri::slot(v[1])], level_of_[tri::slot(v[2])]});
    entries_.push_back({low, segments, static_cast<std::uint32_t>(smallest)});
    segments += static_cast<std::size_t>(high - low);
    number_of_[tri::slot(triangles[i])] = i;
  }
  done_.assign(segments, false);
  lines.points.reserve(segments + segments / 4);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const std::size_t end = i + 1 < triangles.size() ? entries_[i + 1].first : segments;
    for (std::size_t k = entries_[i].first; k < end; ++k) {
      if (!done_[k]) {
        follow(i, entries_[i].low + static_cast<std::int64_t>(k - entries_[i].first), lines);
      }
    }
  }
  for (const tri::TriangleId t : triangles) number_of_[tri::slot(t)] = kNone;

  std::sort(ends_.begin(), ends_.end(), [&](const Ends& s, const Ends& t) {
    if (s.first == t.first) return s.level < t.level;
    return is_before(s.first, s.first_place, t.first, t.first_place);
  });
  std::uint32_t number = 0;
  for (const Ends& ends : ends_) {
    const std::uint32_t open = lines.lines[ends.line].open;
    if (open != PartLines::kClosed) lines.open[open].number = number++;
  }
  std::sort(ends_.begin(), ends_.end(), [&](const Ends& s, const Ends& t) {
    if (s.last == t.last) return s.level < t.level;
    return is_before(s.last, s.last_place, t.last, t.last_place);
  });
  std::vector<PartLines::Line> sorted;
  sorted.reserve(lines.lines.size());
  for (const Ends& ends : ends_) sorted.push_back(lines.lines[ends.line]);
  lines.lines = std::move(sorted);
  return lines;
}

}  // namespace terrace::terrain
