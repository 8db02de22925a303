// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the laws of surfaces within a bound: the error at every sample, the same gaps and hull as
// at level 0, and results that depend on the place alone.
#include "surface/bounded/bounded_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "../../libterrain/tests/test_raster.hpp"
#include "cloud_case.hpp"
#include "contour/parts.hpp"
#include "sample/samplers.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"

namespace terrace::bounded_test {
namespace {

using terrain::BoundedSurface;
using terrain::Point2;
using terrain::SurfacePoint;
using tests::Random;
using tests::same_bits;

constexpr std::int16_t kNothing = -9999;

/// A raster of hills; with_voids: with lakes, single missing samples and single samples in lakes.
stream::Store hills(const std::filesystem::path& folder, std::uint64_t seed, bool with_voids,
                    std::uint32_t columns = 130, std::uint32_t rows = 100) {
  Random random(seed);
  std::vector<std::array<double, 3>> lakes;
  for (int i = 0; i < 5; ++i) {
    lakes.push_back({random(0, columns), random(0, rows), random(1, 14)});
  }
  stream::GeoTiffOptions options;
  options.columns = columns;
  options.rows = rows;
  options.world.xy = {10, 0, 500000, 0, -10, 5200000};
  options.crs.epsg = 32633;
  options.nodata = kNothing;
  tests::write_test_raster(folder / "hills.tif", options, [&](std::uint32_t c, std::uint32_t r) {
    const double x = c, y = r;
    const bool is_lake = std::any_of(lakes.begin(), lakes.end(), [&](const auto& lake) {
      return std::hypot(x - lake[0], y - lake[1]) < lake[2];
    });
    if (with_voids && is_lake != (random.below(150) == 0)) return double{kNothing};
    return 400 + 60 * std::sin(x / 9) * std::cos(y / 7) + random(-2, 2);
  });
  terrain::BuildRequest request;
  request.inputs = {(folder / "hills.tif").string()};
  request.store = folder / "hills.store";
  request.block_points = 1000;
  terrain::build_store(request);
  return stream::Store::open(request.store);
}

std::unique_ptr<terrain::HeightSampler> sampler_of(
    const stream::Store& store, const std::shared_ptr<const BoundedSurface>& surface,
    const terrain::Context& context = {}) {
  constexpr std::size_t kKept = std::size_t{1} << 22;
  return terrain::make_bounded_sampler(
      store, std::make_shared<terrain::BoundedParts>(surface, kKept), {.max_error = 1}, context);
}

std::vector<SurfacePoint> sampled(const stream::Store& store,
                                  const std::shared_ptr<const BoundedSurface>& surface,
                                  const std::vector<Point2>& places,
                                  const terrain::Context& context = {}) {
  std::vector<SurfacePoint> out(places.size());
  sampler_of(store, surface, context)->sample(places, out);
  return out;
}

std::vector<SurfacePoint> sampled_at_level_0(const stream::Store& store,
                                             const std::vector<Point2>& places) {
  std::vector<SurfacePoint> out(places.size());
  terrain::make_sampler(store)->sample(places, out);
  return out;
}

/// Checks that neither threads, memory, order nor other places change a bit.
void expect_same_anyhow(const stream::Store& store,
                        const std::shared_ptr<const BoundedSurface>& surface,
                        const std::vector<Point2>& places, const std::vector<SurfacePoint>& found) {
  const auto same = [](const SurfacePoint& a, const SurfacePoint& b) {
    return same_bits(a.height, b.height) && same_bits(a.per_column, b.per_column) &&
           same_bits(a.per_row, b.per_row);
  };
  std::vector<Point2> backwards(places.rbegin(), places.rend());
  const auto again =
      sampled(store, surface, backwards, {.threads = 3, .memory_bytes = std::uint64_t{1} << 30});
  const auto alone = sampler_of(store, surface);
  for (std::size_t i = 0; i < places.size(); ++i) {
    ASSERT_TRUE(same(found[i], again[places.size() - 1 - i])) << "place " << i;
    if (i % 97 != 0) continue;
    SurfacePoint one;
    alone->sample({&places[i], 1}, {&one, 1});
    ASSERT_TRUE(same(found[i], one)) << "place " << i;
  }
}

/// Counts how often each window is meshed.
class CountingSurface final : public BoundedSurface {
 public:
  CountingSurface(const stream::Store& store, std::shared_ptr<const BoundedSurface> counted)
      : BoundedSurface(store, 1), counted_(std::move(counted)) {}

  [[nodiscard]] std::size_t size() const override { return counted_->size(); }
  [[nodiscard]] terrain::StoredBox box(std::size_t window) const override {
    return counted_->box(window);
  }
  void append_windows_at(const Point2& place, std::vector<std::uint32_t>& out) const override {
    counted_->append_windows_at(place, out);
  }
  [[nodiscard]] terrain::BoundedPart mesh(std::size_t window) const override {
    ++times[window];
    return counted_->mesh(window);
  }

  mutable std::map<std::size_t, int> times;

 private:
  std::shared_ptr<const BoundedSurface> counted_;
};

TEST(BoundedSurface, KeepsTheWindowsOfEarlierCalls) {
  const tests::TemporaryFolder folder;
  const stream::Store store = hills(folder.path(), 7, false);
  const auto surface =
      std::make_shared<CountingSurface>(store, terrain::bounded_raster(store, 1, 64));
  const auto sampler = sampler_of(store, surface, {.threads = 1});
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    const Point2 place{random(0, 129), random(0, 99)};
    SurfacePoint found;
    sampler->sample({&place, 1}, {&found, 1});
  }
  EXPECT_GT(surface->times.size(), 1u);
  for (const auto& [window, times] : surface->times) EXPECT_EQ(times, 1) << "window " << window;
}

TEST(BoundedSurface, OfARasterIsWithinTheBoundAndHasTheGapsOfLevel0) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const tests::TemporaryFolder folder;
    const stream::Store store = hills(folder.path(), seed, seed % 3 != 0);
    Random random(seed);
    std::vector<Point2> places;
    for (double row = 0; row < 100; ++row) {
      for (double column = 0; column < 130; ++column) places.push_back({column, row});
    }
    const std::size_t samples = places.size();
    for (int i = 0; i < 3000; ++i) {
      places.push_back({random(-1, 131), random(-1, 101)});
      // On lines of the lattice, which sides of windows are too.
      places.push_back({std::round(random(0, 129)), random(0, 99)});
      places.push_back({random(0, 129), std::round(random(0, 99))});
    }
    const auto exact = sampled_at_level_0(store, places);
    for (const double bound : {0.0, 0.5, 4.0, 30.0, 1e6}) {
      SCOPED_TRACE("bound " + std::to_string(bound));
      const std::shared_ptr<const BoundedSurface> surface =
          terrain::bounded_raster(store, bound, 24);
      ASSERT_GT(surface->size(), 12U);
      const auto found = sampled(store, surface, places);
      std::size_t vertices = 0;
      for (std::size_t i = 0; i < places.size(); ++i) {
        ASSERT_EQ(std::isnan(found[i].height), std::isnan(exact[i].height)) << "place " << i;
        if (i >= samples || std::isnan(exact[i].height)) continue;
        ASSERT_LE(std::abs(found[i].height - exact[i].height), bound + 1e-9) << "sample " << i;
        if (found[i].height == exact[i].height) ++vertices;
      }
      if (bound == 30) {
        EXPECT_LT(vertices, samples / 2);
      }
      expect_same_anyhow(store, surface, places, found);
    }
  }
}

TEST(BoundedSurface, HasNoStepsAtTheSidesOfWindows) {
  const tests::TemporaryFolder folder;
  const stream::Store store = hills(folder.path(), 5, false);
  const std::shared_ptr<const BoundedSurface> surface = terrain::bounded_raster(store, 8, 24);
  Random random(5);
  std::vector<Point2> on, near;
  for (std::size_t window = 0; window < surface->size(); ++window) {
    const terrain::StoredBox box = surface->box(window);
    for (int i = 0; i < 20; ++i) {
      const double y = random(box.min[1], box.max[1]);
      on.push_back({box.max[0], y});
      near.push_back({box.max[0] - 1e-7, y});
      on.push_back({box.min[0], y});
      near.push_back({box.min[0] + 1e-7, y});
    }
  }
  const auto at = sampled(store, surface, on), around = sampled(store, surface, near);
  for (std::size_t i = 0; i < on.size(); ++i) {
    ASSERT_NEAR(at[i].height, around[i].height, 1e-4) << "place " << i;
  }
}

TEST(BoundedSurface, OfPointsIsWithinTheBoundOnTheHullOfLevel0) {
  for (const char* kind :
       {"random", "lattice", "duplicates", "voids", "clusters", "turned", "winding",
        "straight borders", "circle", "far", "line", "nearly a line", "one", "one place"}) {
    SCOPED_TRACE(kind);
    const tests::TemporaryFolder folder;
    const stream::Store store =
        stream::Store::open(tests::cloud_store(folder.path(), tests::points_of(kind)));
    const tests::Points points = tests::Whole::points_in(store, 0);
    std::map<Point2, double> first;
    for (const stream::Point3& p : points) first.try_emplace({p[0], p[1]}, p[2]);
    std::vector<Point2> places;
    for (const auto& [place, height] : first) places.push_back(place);
    Random random(11);
    const stream::Box3& box = store.bounds();
    for (int i = 0; i < 1000; ++i) {
      Point2 place{};
      for (std::size_t k = 0; k < 2; ++k) {
        place[k] = box.min[k] + random(-0.1, 1.1) * (box.max[k] - box.min[k]);
      }
      places.push_back(place);
    }
    const auto exact = sampled_at_level_0(store, places);
    const bool is_flat = terrain::PointHull(store, 0).is_flat();
    for (const double bound : {0.0, 0.5, 4.0, 20.0}) {
      SCOPED_TRACE("bound " + std::to_string(bound));
      const std::shared_ptr<const BoundedSurface> surface =
          terrain::bounded_cloud(store, bound, 400);
      const auto found = sampled(store, surface, places);
      for (std::size_t i = 0; i < places.size(); ++i) {
        if (is_flat) {
          ASSERT_TRUE(std::isnan(found[i].height));
          continue;
        }
        ASSERT_EQ(std::isnan(found[i].height), std::isnan(exact[i].height)) << "place " << i;
        if (i >= first.size()) continue;
        ASSERT_LE(std::abs(found[i].height - first.at(places[i])), bound * (1 + 1e-9) + 1e-9)
            << "sample " << i;
      }
      expect_same_anyhow(store, surface, places, found);
    }
  }
}

struct Lines {
  std::vector<terrain::ContourLine> all;
  std::string text;
};

Lines contours(const stream::Store& store, const terrain::ContourRequest& request,
               unsigned threads = 1) {
  Lines lines;
  terrain::draw_bounded_contours(
      {.store = store,
       .request = request,
       .threads = threads,
       .emit = [&](const terrain::ContourLine& line) { lines.all.push_back(line); },
       .limit = {},
       .progress = [](double) {}});
  terrain::write_contours(store, request, [&](std::string_view more) { lines.text += more; },
                          {.threads = threads});
  return lines;
}

void expect_contours(bool with_voids) {
  constexpr double kInterval = 7.123;  // no vertex is at a level
  const tests::TemporaryFolder folder;
  const stream::Store store = hills(folder.path(), 3, with_voids, 1100, 150);
  const terrain::ContourRequest request{.interval = kInterval, .max_error = 6, .own_crs = true};
  const Lines lines = contours(store, request);
  std::set<std::pair<Point2, Point2>> edges;
  std::size_t expected = 0;
  const auto surface = terrain::bounded_surface(store, 6);
  ASSERT_EQ(surface->size(), 2U);
  for (std::size_t window = 0; window < surface->size(); ++window) {
    const terrain::BoundedPart part = surface->mesh(window);
    for (const auto& t : part.triangles()) {
      const terrain::SurfaceTriangle corners = part.corners(t);
      for (std::size_t i = 0; i < 3; ++i) {
        const terrain::SurfaceCorner &a = corners[i], &b = corners[(i + 1) % 3];
        if (!edges.insert(std::minmax(a.place, b.place)).second) continue;
        const auto [low, high] = std::minmax(a.height, b.height);
        expected +=
            static_cast<std::size_t>(std::floor(high / kInterval) - std::floor(low / kInterval));
      }
    }
  }
  std::size_t points = 0;
  std::vector<Point2> places;
  std::vector<double> heights;
  for (const terrain::ContourLine& line : lines.all) {
    points += line.points.size() - (line.closed ? 1 : 0);
    for (const Point2& p : line.points) {
      places.push_back(p);
      heights.push_back(static_cast<double>(line.level) * kInterval);
    }
  }
  EXPECT_EQ(points, expected);
  std::vector<SurfacePoint> on(places.size());
  terrain::make_sampler(store, {.max_error = 6})->sample(places, on);
  std::size_t met = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    // Next to gaps, rounding leads to the surface of level 0.
    if (with_voids || std::isnan(on[i].height)) continue;
    ASSERT_NEAR(on[i].height, heights[i], 1e-6);
    ++met;
  }
  EXPECT_GE(met, with_voids ? 0 : places.size() * 9 / 10);
  EXPECT_EQ(contours(store, request, 3).text, lines.text);
  // Lines of a region are parts of these.
  std::set<std::pair<std::int64_t, Point2>> all;
  for (const auto& line : lines.all) {
    for (const Point2& p : line.points) all.insert({line.level, p});
  }
  terrain::ContourRequest part = request;
  part.region = terrain::Region::parse("503000,5198700,508000,5199800");
  const Lines within = contours(store, part);
  ASSERT_FALSE(within.all.empty());
  for (const auto& line : within.all) {
    for (const Point2& p : line.points) EXPECT_TRUE(all.contains({line.level, p}));
  }
}

TEST(BoundedSurface, ContoursCrossEveryEdgeOfTheTrianglesOnce) {
  expect_contours(false);
  expect_contours(true);
}

void expect_exact_profile(const stream::Store& store, double max_error,
                          const std::vector<Point2>& line) {
  const terrain::SamplerOptions options{.max_error = max_error};
  std::vector<terrain::ProfilePoint> rows;
  terrain::profile(store, {.sampler = options, .line = line},
                   [&](std::span<const terrain::ProfilePoint> points) {
                     rows.insert(rows.end(), points.begin(), points.end());
                   });
  std::vector<Point2> places, middles;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    places.push_back(rows[i].place);
    if (i == 0) continue;
    const Point2 &a = rows[i - 1].place, &b = rows[i].place;
    middles.push_back({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2});
  }
  ASSERT_GT(rows.size(), 20U);
  const auto at = terrain::sample_places(store, places, options);
  const auto between = terrain::sample_places(store, middles, options);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!std::isnan(at[i].height)) {
      EXPECT_NEAR(rows[i].height, at[i].height, 1e-6);
    }
    if (i == 0 || std::isnan(between[i - 1].height)) continue;
    EXPECT_NEAR((rows[i - 1].height + rows[i].height) / 2, between[i - 1].height, 1e-6);
  }
}

TEST(BoundedSurface, ProfilesHaveARowWhereverTheSurfaceBends) {
  const tests::TemporaryFolder folder;
  expect_exact_profile(hills(folder.path(), 9, false, 700, 90), 5,
                       {{500100.5, 5199900}, {506800, 5199211}, {500013, 5199500}});
  const tests::TemporaryFolder other;
  expect_exact_profile(
      stream::Store::open(tests::cloud_store(other.path(), tests::points_of("random"))), 2,
      {{-10, 20}, {900, 650}, {400.5, 100}});
}

TEST(BoundedSurface, ExcludesOtherChoicesOfASurface) {
  const tests::TemporaryFolder folder;
  const stream::Store store = hills(folder.path(), 2, false, 40, 30);
  const terrain::FinerRegion focus{terrain::Region::parse("500000,5199800,500100,5199900"), 0};
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const terrain::SamplerOptions& options : std::vector<terrain::SamplerOptions>{
           {.level = 1, .max_error = 1},
           {.focuses = {focus}, .max_error = 1},
           {.max_error = 1, .max_edge = 100},
           {.method = tri::Interpolation::natural_neighbour, .max_error = 1},
           {.method = tri::Interpolation::nearest, .max_error = 1},
           {.max_error = -1},
           {.max_error = kNaN}}) {
    EXPECT_THROW(terrain::make_sampler(store, options), terrain::UsageError);
  }
  for (const terrain::ContourRequest& request :
       std::vector<terrain::ContourRequest>{{.interval = 1, .level = 1, .max_error = 1},
                                            {.interval = 1, .max_error = 1, .max_edge = 100},
                                            {.interval = 1, .max_error = -1}}) {
    EXPECT_THROW(terrain::write_contours(store, request, [](std::string_view) {}),
                 terrain::UsageError);
  }
  const tests::TemporaryFolder other;
  EXPECT_THROW(terrain::make_sampler(hills(other.path(), 2, false, 700, 90), {.max_error = 1},
                                     {.memory_bytes = std::uint64_t{80} << 20}),
               stream::Error);
}

}  // namespace
}  // namespace terrace::bounded_test
