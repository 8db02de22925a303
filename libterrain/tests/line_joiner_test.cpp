// SPDX-License-Identifier: Apache-2.0
// Compares lines joined from segments in any order with the lines that the segments were cut from.
#include "contour/line_joiner.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace terrace::terrain {
namespace {

struct Crossing {
  std::int64_t level = 0;
  std::uint64_t edge = 0;
  friend bool operator==(const Crossing&, const Crossing&) = default;
};
/// A hash with few values, so that most crossings collide.
struct FewValues {
  std::size_t operator()(const Crossing& c) const { return c.edge % 7 * 0x10001U; }
};

Point2 place_of(std::uint64_t edge) { return {static_cast<double>(edge), 0.5}; }

struct JoinerSegment {
  Crossing from, to;
};

/// Makes lines of some edges each, closed or open, and returns their segments, shuffled.
std::vector<JoinerSegment> shuffled_segments(std::mt19937_64& random,
                                             std::vector<ContourLine>& lines) {
  std::vector<JoinerSegment> segments;
  std::uint64_t edge = 0;
  for (int i = 0; i < 60; ++i) {
    ContourLine line{static_cast<std::int64_t>(random() % 3), random() % 2 == 0, {}};
    const std::uint64_t first = edge, count = 1 + random() % 30 + (line.closed ? 1 : 0);
    for (std::uint64_t k = 0; k < count; ++k, ++edge) {
      line.points.push_back(place_of(edge));
      const bool last = k + 1 == count;
      segments.push_back(
          {{line.level, edge}, {line.level, last && line.closed ? first : edge + 1}});
    }
    line.points.push_back(place_of(line.closed ? first : edge++));
    lines.push_back(line);
  }
  std::shuffle(segments.begin(), segments.end(), random);
  return segments;
}

/// Rotates a closed line to start at its least point.
ContourLine turned(ContourLine line) {
  if (!line.closed) return line;
  line.points.pop_back();
  std::rotate(line.points.begin(), std::min_element(line.points.begin(), line.points.end()),
              line.points.end());
  line.points.push_back(line.points.front());
  return line;
}

TEST(LineJoiner, JoinsSegmentsInAnyOrder) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::vector<ContourLine> lines;
    const std::vector<JoinerSegment> segments = shuffled_segments(random, lines);
    std::map<Point2, ContourLine> expected;
    for (const ContourLine& line : lines) expected[line.points.front()] = line;
    std::uint64_t points = 0;
    LineJoiner<Crossing, FewValues> joiner([&](ContourLine&& given) {
      const ContourLine line = turned(std::move(given));
      const auto found = expected.find(line.points.front());
      ASSERT_NE(found, expected.end());
      EXPECT_EQ(line.level, found->second.level);
      EXPECT_EQ(line.closed, found->second.closed);
      EXPECT_EQ(line.points, found->second.points);
      points += line.points.size();
      expected.erase(found);
    });
    // Emit some lines early: those without an end in the later half.
    std::map<std::uint64_t, int> later;
    const std::size_t half = segments.size() / 2;
    for (std::size_t i = half; i < segments.size(); ++i) {
      ++later[segments[i].from.edge];
      ++later[segments[i].to.edge];
    }
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const JoinerSegment& s = segments[i];
      joiner.add(s.from, place_of(s.from.edge), s.to, place_of(s.to.edge));
      if (i + 1 == half) {
        joiner.emit_complete([&](const Crossing& c) { return later.contains(c.edge); });
      }
    }
    joiner.emit_complete([](const Crossing&) { return false; });
    EXPECT_TRUE(expected.empty());
    EXPECT_EQ(joiner.open_points(), 0U);
    EXPECT_EQ(joiner.segments(), segments.size());
    EXPECT_EQ(points, segments.size() + lines.size());
  }
}

TEST(LineJoiner, EmitsOpenLinesInOrderOfFirstSegments) {
  std::vector<double> first;
  LineJoiner<Crossing, FewValues> joiner(
      [&](ContourLine&& line) { first.push_back(line.points.front()[0]); });
  const auto add = [&](std::uint64_t from, std::uint64_t to) {
    joiner.add({0, from}, place_of(from), {0, to}, place_of(to));
  };
  // A closed line in between frees a slot for the third line.
  add(10, 11);
  add(20, 21);
  add(21, 20);
  add(30, 31);
  add(1, 2);
  add(2, 3);
  add(3, 10);  // joins the last to the first, which keeps its number
  joiner.emit_complete([](const Crossing&) { return false; });
  EXPECT_EQ(first, (std::vector<double>{20, 1, 30}));
}

/// Joins segments first, second, ... of `segments` to stretches, and adds these.
template <class Joiner>
void add_as_stretches(Joiner& joiner, std::span<const JoinerSegment> segments) {
  std::map<std::uint64_t, std::size_t> begins, ends;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    begins[segments[i].from.edge] = i;
    ends[segments[i].to.edge] = i;
  }
  struct Found {
    std::vector<std::size_t> segments;
    bool closed = false;
    std::size_t first = 0, last = 0;
    std::uint32_t number = 0;
  };
  std::vector<Found> all;
  std::vector<bool> done(segments.size(), false);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (done[i]) continue;
    Found found;
    std::size_t at = i;
    while (ends.contains(segments[at].from.edge) && !found.closed) {
      at = ends[segments[at].from.edge];
      found.closed = at == i;
    }
    found.first = found.last = at;
    while (!done[at]) {
      done[at] = true;
      found.segments.push_back(at);
      found.first = std::min(found.first, at);
      found.last = std::max(found.last, at);
      if (begins.contains(segments[at].to.edge)) at = begins[segments[at].to.edge];
    }
    all.push_back(found);
  }
  std::sort(all.begin(), all.end(),
            [](const Found& a, const Found& b) { return a.first < b.first; });
  std::uint32_t open = 0;
  for (Found& found : all) {
    if (!found.closed) found.number = open++;
  }
  std::sort(all.begin(), all.end(), [](const Found& a, const Found& b) { return a.last < b.last; });
  for (Found& found : all) {
    const auto last = std::find(found.segments.begin(), found.segments.end(), found.last);
    const auto behind = static_cast<std::size_t>(last - found.segments.begin()) + 1;
    if (found.closed) {
      std::rotate(found.segments.begin(), last + 1, found.segments.end());
    }
    const JoinerSegment &begin = segments[found.segments.front()],
                        &end = segments[found.segments.back()];
    std::vector<Point2> points{place_of(begin.from.edge)};
    for (const std::size_t k : found.segments) points.push_back(place_of(segments[k].to.edge));
    if (found.closed) {
      joiner.pass_closed(begin.from.level, points);
    } else {
      joiner.add({begin.from, end.to, points, found.number, behind});
    }
  }
  joiner.end_of_stretches(open);
}

TEST(LineJoiner, StretchesMatchTheirSegments) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::vector<ContourLine> lines;
    const std::vector<JoinerSegment> segments = shuffled_segments(random, lines);
    std::vector<ContourLine> one_by_one, as_stretches;
    LineJoiner<Crossing, FewValues> singly(
        [&](ContourLine&& line) { one_by_one.push_back(std::move(line)); });
    LineJoiner<Crossing, FewValues> together(
        [&](ContourLine&& line) { as_stretches.push_back(std::move(line)); });
    for (std::size_t begin = 0, end = 0; begin < segments.size(); begin = end) {
      end = std::min(begin + 1 + random() % 200, segments.size());
      for (std::size_t i = begin; i < end; ++i) {
        singly.add(segments[i].from, place_of(segments[i].from.edge), segments[i].to,
                   place_of(segments[i].to.edge));
      }
      add_as_stretches(together, std::span(segments).subspan(begin, end - begin));
      // Lines without an end in later segments are complete.
      std::map<std::uint64_t, int> later;
      for (std::size_t i = end; i < segments.size(); ++i) {
        ++later[segments[i].from.edge];
        ++later[segments[i].to.edge];
      }
      const auto goes_on = [&](const Crossing& c) { return later.contains(c.edge); };
      singly.emit_complete(goes_on);
      together.emit_complete(goes_on);
      ASSERT_EQ(together.open_points(), singly.open_points());
      ASSERT_EQ(together.segments(), singly.segments());
    }
    ASSERT_EQ(one_by_one.size(), lines.size());
    ASSERT_EQ(as_stretches.size(), lines.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      EXPECT_EQ(as_stretches[i].level, one_by_one[i].level);
      EXPECT_EQ(as_stretches[i].closed, one_by_one[i].closed);
      EXPECT_EQ(as_stretches[i].points, one_by_one[i].points);
    }
  }
}

TEST(LineJoiner, ReportsTooManyPoints) {
  LineJoiner<Crossing, FewValues> joiner(
      [](ContourLine&&) {},
      {.points = 100, .exceeded = [] { throw std::length_error("too many"); }});
  const auto add_all = [&] {
    for (std::uint64_t edge = 0; edge < 1000; edge += 2) {
      joiner.add({0, edge}, place_of(edge), {0, edge + 1}, place_of(edge + 1));
    }
  };
  EXPECT_THROW(add_all(), std::length_error);
  EXPECT_EQ(joiner.open_points(), 102U);
}

}  // namespace
}  // namespace terrace::terrain
