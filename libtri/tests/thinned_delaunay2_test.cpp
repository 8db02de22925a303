// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/thinned_delaunay2.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace {

using namespace terrace::tri;
using Point = ThinnedDelaunay2::Point;
using Step = ThinnedDelaunay2::Step;
using Triangle = std::array<Point, 3>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

enum class Gaps { none, holes, coast, single };

struct Raster {
  std::int32_t columns, rows;
  std::vector<double> heights;  ///< NaN: no data
  [[nodiscard]] double at(const Point& p) const {
    return heights[static_cast<std::size_t>(p[1]) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(p[0])];
  }
  [[nodiscard]] bool has(std::int32_t x, std::int32_t y) const {
    return x >= 0 && y >= 0 && x < columns && y < rows && !std::isnan(at({x, y}));
  }
};

Raster make_raster(std::int32_t columns, std::int32_t rows, Gaps gaps, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Raster raster{columns, rows, {}};
  const double phase = 6 * unit(random);
  for (std::int32_t y = 0; y < rows; ++y) {
    for (std::int32_t x = 0; x < columns; ++x) {
      // Hills, a cliff, and a plane with noise.
      double z = 200 * std::sin(x / 31.0 + phase) * std::cos(y / 23.0) + 0.3 * x;
      if (x + 2 * y > columns + rows) z += 90;
      z = std::round(z + 4 * unit(random));
      bool data = true;
      if (gaps == Gaps::holes) data = std::hypot(x % 61 - 30.0, y % 47 - 20.0) > 9;
      if (gaps == Gaps::coast) data = x + 15 * std::sin(y / 9.0) < 0.7 * columns;
      if (gaps == Gaps::single) data = (x * 7 + y * 13) % 211 != 0;
      raster.heights.push_back(data ? z : kNaN);
    }
  }
  return raster;
}

/// A thinned triangulation of all or some samples of a raster.
class Subject {
 public:
  explicit Subject(const Raster& raster)
      : raster_(&raster), thinned_({raster.columns - 1, raster.rows - 1}) {}

  /// One sample in 64 is of level 1.
  static unsigned level_of(const Point& p) { return p[0] % 8 == 3 && p[1] % 8 == 5 ? 1 : 0; }

  void add(std::vector<Point> points, std::mt19937& random) {
    std::shuffle(points.begin(), points.end(), random);
    std::vector<ThinnedDelaunay2::Insertion> results(points.size());
    thinned_.insert(points, results);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_TRUE(results[i].created);
      thinned_.assign(results[i].vertex, raster_->at(points[i]), level_of(points[i]));
      samples_[points[i]] = results[i].vertex;
    }
  }
  void remove(std::span<const Point> points) {
    std::vector<VertexId> samples;
    for (const Point& p : points) {
      samples.push_back(samples_.at(p));
      samples_.erase(p);
    }
    thinned_.remove(samples);
  }
  [[nodiscard]] std::vector<Point> all() const {
    std::vector<Point> points;
    for (std::int32_t y = 0; y < raster_->rows; ++y)
      for (std::int32_t x = 0; x < raster_->columns; ++x)
        if (raster_->has(x, y)) points.push_back({x, y});
    return points;
  }
  [[nodiscard]] bool has_all(const ThinnedDelaunay2::Window& window) const {
    for (std::int32_t y = window.low[1]; y <= window.high[1]; ++y)
      for (std::int32_t x = window.low[0]; x <= window.high[0]; ++x)
        if (raster_->has(x, y) && samples_.count({x, y}) == 0) return false;
    return true;
  }
  void mark_complete() {
    for (std::uint32_t i = 0; i < thinned_.window_slots(); ++i) {
      const auto* window = thinned_.window(i);
      if (window == nullptr) continue;
      const bool all = has_all(*window);
      EXPECT_TRUE(all || !window->complete);
      if (all && !window->complete) thinned_.set_complete(i);
    }
  }
  /// Thins every complete window to steps.at(its low corner).
  void thin(const std::map<Point, Step>& steps, std::mt19937& random, std::size_t at_once) {
    std::vector<ThinnedDelaunay2::Target> targets;
    for (std::uint32_t i = 0; i < thinned_.window_slots(); ++i) {
      const auto* window = thinned_.window(i);
      if (window != nullptr && window->complete) targets.push_back({i, steps.at(window->low)});
    }
    std::shuffle(targets.begin(), targets.end(), random);
    for (std::size_t i = 0; i < targets.size(); i += at_once) {
      thinned_.thin(std::span(targets).subspan(i, std::min(at_once, targets.size() - i)));
    }
  }
  [[nodiscard]] const ThinnedDelaunay2& get() const { return thinned_; }
  ThinnedDelaunay2& get() { return thinned_; }

  /// Tests every sample in every triangle by brute force.
  void check() const {
    std::map<Point, const ThinnedDelaunay2::Window*> windows;
    for (std::uint32_t i = 0; i < thinned_.window_slots(); ++i) {
      const auto* window = thinned_.window(i);
      if (window != nullptr && window->thinned) windows[window->low] = window;
    }
    std::set<Point> covered;
    std::size_t triangles = 0;
    for (const TriangleId t : thinned_.all_triangles()) {
      ++triangles;
      const auto ids = thinned_.vertices(t);
      const Triangle c{thinned_.point(ids[0]), thinned_.point(ids[1]), thinned_.point(ids[2])};
      Point low = c[0], high = c[0];
      for (const Point& p : c) {
        EXPECT_TRUE(raster_->has(p[0], p[1]));
        for (std::size_t k = 0; k < 2; ++k) {
          low[k] = std::min(low[k], p[k]);
          high[k] = std::max(high[k], p[k]);
        }
      }
      const auto found = windows.find({low[0] / Windowed::kCells * Windowed::kCells,
                                       low[1] / Windowed::kCells * Windowed::kCells});
      if (found == windows.end() || high[0] > found->second->high[0] ||
          high[1] > found->second->high[1])
        continue;
      const Step step = found->second->step;
      const double tolerance = ThinnedDelaunay2::tolerance_of(step);
      const auto turn = [](const Point& a, const Point& b, const Point& p) {
        return std::int64_t{b[0] - a[0]} * (p[1] - a[1]) -
               std::int64_t{b[1] - a[1]} * (p[0] - a[0]);
      };
      const std::int64_t twice = turn(c[0], c[1], c[2]);
      ASSERT_GT(twice, 0);
      for (std::int32_t y = low[1]; y <= high[1]; ++y) {
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
          const Point p{x, y};
          const std::array<std::int64_t, 3> w{turn(c[1], c[2], p), turn(c[2], c[0], p),
                                              turn(c[0], c[1], p)};
          if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
          // With every sample a vertex, triangles over gaps are recognised by others.
          if (!raster_->has(x, y)) {
            ASSERT_EQ(step, ThinnedDelaunay2::kEverySample) << x << ", " << y;
            continue;
          }
          covered.insert(p);
          double sum = 0;
          for (std::size_t k = 0; k < 3; ++k)
            sum += static_cast<double>(w[k]) * (raster_->at(c[k]) - raster_->at(p));
          ASSERT_LE(std::abs(sum) / static_cast<double>(twice), tolerance * (1 + 1e-12))
              << x << ", " << y;
        }
      }
    }
    EXPECT_EQ(triangles, thinned_.triangle_count());
    for (const auto& [corner, window] : windows) {
      for (std::int32_t y = window->low[1]; y <= window->high[1]; ++y) {
        for (std::int32_t x = window->low[0]; x <= window->high[0]; ++x) {
          bool inner = true;
          for (std::int32_t v = std::max(y - 1, window->low[1]);
               v <= std::min(y + 1, window->high[1]); ++v)
            for (std::int32_t u = std::max(x - 1, window->low[0]);
                 u <= std::min(x + 1, window->high[0]); ++u)
              inner = inner && raster_->has(u, v);
          if (inner) {
            ASSERT_TRUE(covered.count({x, y})) << x << ", " << y;
          }
        }
      }
    }
  }

 private:
  const Raster* raster_;
  ThinnedDelaunay2 thinned_;
  std::map<Point, VertexId> samples_;
};

std::map<Point, Step> random_steps(const Raster& raster, std::mt19937& random) {
  constexpr std::array<Step, 7> kSteps{ThinnedDelaunay2::kEverySample, 0, 40, 64, 70, 104,
                                       ThinnedDelaunay2::kFewest};
  std::map<Point, Step> steps;
  for (std::int32_t y = 0; y < raster.rows; y += Windowed::kCells)
    for (std::int32_t x = 0; x < raster.columns; x += Windowed::kCells)
      steps[{x, y}] = kSteps[random() % kSteps.size()];
  return steps;
}

TEST(ThinnedDelaunay2, SixteenStepsDoubleTheTolerance) {
  EXPECT_EQ(ThinnedDelaunay2::tolerance_of(0), 1.0);
  EXPECT_EQ(ThinnedDelaunay2::tolerance_of(32), 4.0);
  EXPECT_EQ(ThinnedDelaunay2::tolerance_of(-32), 0.25);
  EXPECT_EQ(ThinnedDelaunay2::step_of(0.0), ThinnedDelaunay2::kEverySample);
  EXPECT_EQ(ThinnedDelaunay2::step_of(std::numeric_limits<double>::infinity()),
            ThinnedDelaunay2::kFewest);
  for (Step step = -300; step < 300; ++step) {
    const double tolerance = ThinnedDelaunay2::tolerance_of(step);
    EXPECT_DOUBLE_EQ(tolerance, std::exp2(step / 16.0));
    EXPECT_EQ(ThinnedDelaunay2::step_of(tolerance), step);
    EXPECT_EQ(ThinnedDelaunay2::step_of(1.02 * tolerance), step);
    EXPECT_EQ(ThinnedDelaunay2::step_of(0.99 * tolerance), step - 1);
  }
}

TEST(ThinnedDelaunay2, IsWithinToleranceAtAnyMixOfSteps) {
  for (const Gaps gaps : {Gaps::none, Gaps::holes, Gaps::coast, Gaps::single}) {
    for (unsigned seed = 1; seed <= (TERRACE_TEST_SHARE > 1 ? 1 : 3); ++seed) {
      SCOPED_TRACE("gaps " + std::to_string(static_cast<int>(gaps)) + ", seed " +
                   std::to_string(seed));
      std::mt19937 random(seed);
      const Raster raster = make_raster(300, 257 + static_cast<int>(seed), gaps, seed);
      Subject subject(raster);
      subject.add(subject.all(), random);
      subject.mark_complete();
      for (int round = 0; round < 3; ++round) {
        subject.thin(random_steps(raster, random), random, 3);
        subject.check();
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST(ThinnedDelaunay2, IsAFunctionOfSamplesAndSteps) {
  for (const Gaps gaps : {Gaps::none, Gaps::coast}) {
    std::mt19937 random(7);
    const Raster raster = make_raster(400, 260, gaps, 7);
    Subject wanderer(raster);
    wanderer.add(wanderer.all(), random);
    wanderer.mark_complete();
    for (int round = 0; round < 4 / TERRACE_TEST_SHARE; ++round) {
      const auto steps = random_steps(raster, random);
      wanderer.thin(steps, random, 1 + random() % 5);
      // Part of the samples leave and come back.
      std::vector<Point> part;
      const auto column = static_cast<std::int32_t>(random() % 300);
      for (const Point& p : wanderer.all())
        if (p[0] > column && p[0] < column + 90) part.push_back(p);
      wanderer.remove(part);
      if (round % 2 == 0) wanderer.get().thin({});
      wanderer.add(part, random);
      wanderer.mark_complete();
      wanderer.thin(steps, random, 2);

      Subject fresh(raster);
      fresh.add(fresh.all(), random);
      fresh.mark_complete();
      fresh.thin(steps, random, 100);
      EXPECT_EQ(wanderer.get().hash(), fresh.get().hash());
      EXPECT_EQ(wanderer.get().vertex_count(), fresh.get().vertex_count());
      EXPECT_EQ(wanderer.get().triangle_count(), fresh.get().triangle_count());
    }
  }
}

// A viewer that applies all changes has the vertices and triangles of the triangulation.
TEST(ThinnedDelaunay2, ChangesAddUp) {
  std::mt19937 random(11);
  const Raster raster = make_raster(280, 270, Gaps::holes, 11);
  Subject subject(raster);
  std::vector<Point> points = subject.all();
  std::map<std::uint32_t, Point> vertices;
  std::map<std::uint32_t, std::array<std::uint32_t, 3>> triangles;
  ThinnedDelaunay2& thinned = subject.get();
  thinned.start_journal();
  ThinnedDelaunay2::Changes changes;
  const auto follow = [&] {
    thinned.take_changes(changes);
    for (std::size_t i = 0; i < changes.removed_triangles.size(); ++i) {
      const auto found = triangles.find(slot(changes.removed_triangles[i]));
      ASSERT_NE(found, triangles.end());
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(found->second[k], slot(changes.removed_corners[i][k]));
      triangles.erase(found);
    }
    for (std::size_t i = 0; i < changes.removed_vertices.size(); ++i) {
      const auto found = vertices.find(slot(changes.removed_vertices[i]));
      ASSERT_NE(found, vertices.end());
      EXPECT_EQ(found->second, changes.removed_points[i]);
      vertices.erase(found);
    }
    for (const VertexId v : changes.added_vertices)
      EXPECT_TRUE(vertices.emplace(slot(v), thinned.point(v)).second);
    for (const TriangleId t : changes.added_triangles) {
      const auto c = thinned.vertices(t);
      EXPECT_TRUE(
          triangles.emplace(slot(t), std::array{slot(c[0]), slot(c[1]), slot(c[2])}).second);
    }
    std::size_t count = 0;
    for (const VertexId v : thinned.all_vertices()) {
      ++count;
      EXPECT_EQ(vertices.count(slot(v)), 1u);
    }
    EXPECT_EQ(count, vertices.size());
    EXPECT_EQ(count, thinned.vertex_count());
    EXPECT_EQ(triangles.size(), thinned.triangle_count());
    count = 0;
    for (const TriangleId t : thinned.all_triangles()) {
      ++count;
      EXPECT_EQ(triangles.count(slot(t)), 1u);
      for (const TriangleId n : thinned.neighbours(t))
        EXPECT_TRUE(n == kNoTriangle || triangles.count(slot(n)) == 1u);
    }
    EXPECT_EQ(count, triangles.size());
  };
  follow();
  const std::vector<Point> half(points.begin(),
                                points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2));
  subject.add(half, random);
  follow();
  subject.mark_complete();
  subject.thin(random_steps(raster, random), random, 2);
  follow();
  subject.add({points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2), points.end()},
              random);
  subject.mark_complete();
  follow();
  for (int round = 0; round < 6; ++round) {
    subject.thin(random_steps(raster, random), random, 3);
    if (round % 3 == 1) {
      subject.remove(half);
      subject.add(half, random);
      subject.mark_complete();
      subject.thin(random_steps(raster, random), random, 3);
    }
    follow();
  }
  subject.check();
  std::vector<VertexId> ring;
  for (const VertexId v : thinned.all_vertices()) {
    const TriangleId t = thinned.triangle_at(v);
    thinned.adjacent(v, ring);
    std::set<std::uint32_t> expected;
    for (const auto& [number, corners] : triangles) {
      if (std::find(corners.begin(), corners.end(), slot(v)) == corners.end()) continue;
      for (const std::uint32_t c : corners)
        if (c != slot(v)) expected.insert(c);
    }
    EXPECT_EQ(t == kNoTriangle, expected.empty());
    for (const std::uint32_t c : expected)
      EXPECT_NE(std::find(ring.begin(), ring.end(), VertexId{c}), ring.end());
    if (slot(v) > 2000) break;
  }
  subject.remove(subject.all());
  follow();
  EXPECT_EQ(thinned.vertex_count(), 0u);
  EXPECT_EQ(thinned.sample_count(), 0u);
}

TEST(ThinnedDelaunay2, WindowsThatAreNotThinnedShowLevelOneAndAbove) {
  std::mt19937 random(3);
  const Raster raster = make_raster(200, 140, Gaps::none, 3);
  Subject subject(raster);
  subject.add(subject.all(), random);
  subject.get().thin({});
  std::size_t coarse = 0;
  for (const Point& p : subject.all()) coarse += Subject::level_of(p);
  EXPECT_EQ(subject.get().vertex_count(), coarse);
  EXPECT_EQ(subject.get().sample_count(), 200u * 140u);
}

TEST(ThinnedDelaunay2, RastersOfOneRowShowEverySample) {
  std::mt19937 random(5);
  const Raster raster = make_raster(300, 1, Gaps::none, 5);
  Subject subject(raster);
  subject.add(subject.all(), random);
  subject.get().thin({});
  EXPECT_EQ(subject.get().vertex_count(), 300u);
  EXPECT_EQ(subject.get().triangle_count(), 0u);
}

TEST(ThinnedDelaunay2, RejectsPointsOutsideTheRaster) {
  ThinnedDelaunay2 thinned({10, 20});
  const std::array<Point, 2> points{Point{3, 4}, Point{3, 21}};
  EXPECT_THROW(thinned.insert(points, {}), std::invalid_argument);
  EXPECT_EQ(thinned.sample_count(), 0u);
}

}  // namespace
