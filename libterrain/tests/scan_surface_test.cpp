// SPDX-License-Identifier: Apache-2.0
// Compares the surface of a scan with the sphere that its points are on.
#include "terrace/terrain/scan_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <stop_token>
#include <string>

#include <gtest/gtest.h>
#include <terrace/base/stop_check.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr double kRadius = 100.0;
constexpr stream::Point3 kCentre{400000.0, 5200000.0, 700.0};

class ScanSurfaceTest : public ::testing::Test {
 protected:
  /// Makes 3,000 random points on a sphere, in metres.
  ScanSurfaceTest() { build("store", 0.0); }

  /// Radii differ by up to `noise`. context: for storing the surface with the points.
  void build(const std::string& name, double noise, const Context* context = nullptr) {
    const std::filesystem::path text = folder_.path() / (name + ".xyz");
    std::mt19937_64 random(5);
    {
      std::ofstream file(text);
      const auto part = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
      for (int i = 0; i < 3000;) {
        const stream::Point3 p{part(), part(), part()};
        const double length = std::hypot(p[0], p[1], p[2]);
        if (length < 0.1 || length > 1.0) continue;
        const double radius = noise > 0.0 ? kRadius + noise * part() : kRadius;
        std::array<char, 100> line{};
        std::snprintf(line.data(), line.size(), "%.6f %.6f %.6f\n",
                      kCentre[0] + radius * p[0] / length, kCentre[1] + radius * p[1] / length,
                      kCentre[2] + radius * p[2] / length);
        file << line.data();
        ++i;
      }
    }
    BuildRequest request;
    request.inputs = {text.string()};
    request.store = folder_.path() / name;
    request.block_points = 500;
    if (context != nullptr) {
      request.surface = [context](const stream::Store& store, const stream::ClusterOrder& order,
                                  const InputTriangles&) {
        return surface_to_store(store, order, *context);
      };
    }
    const BuildOutcome outcome = build_store(request, context != nullptr ? *context : Context());
    EXPECT_EQ(outcome.surface.has_value(), context != nullptr);
  }
  /// The store with its surface.
  [[nodiscard]] stream::Store store_with_surface() {
    build("with", 0.0, &context_);
    return stream::Store::open(folder_.path() / "with");
  }

  [[nodiscard]] stream::Store store() const {
    return stream::Store::open(folder_.path() / "store");
  }
  /// A store of the sphere with noise along its radii, in metres. The points are about 6.5 apart.
  [[nodiscard]] stream::Store noisy_store(double noise) {
    build("noisy", noise);
    return stream::Store::open(folder_.path() / "noisy");
  }
  static double radius_of(const stream::Point3& p) {
    return std::hypot(p[0] - kCentre[0], p[1] - kCentre[1], p[2] - kCentre[2]);
  }

  tests::TemporaryFolder folder_;
  Context context_{};
};

/// The triangles as places, each from its least corner, in ascending order.
std::vector<std::array<stream::Point3, 3>> places_of(const ScanSurface& surface) {
  std::vector<std::array<stream::Point3, 3>> all;
  for (const auto& t : surface.mesh.triangles) {
    std::array<stream::Point3, 3> corners{
        surface.mesh.positions[t[0]], surface.mesh.positions[t[1]], surface.mesh.positions[t[2]]};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST_F(ScanSurfaceTest, TheStoredSurfaceIsTheRestoredOne) {
  const stream::Store with = store_with_surface();
  ASSERT_TRUE(with.surface());
  EXPECT_TRUE(with.verify([](const stream::Problem& p) { ADD_FAILURE() << p.file << p.what; }));
  const ScanSurface stored = scan_surface(with, {});
  const ScanSurface restored = scan_surface(with, {}, {.stored = false});
  EXPECT_TRUE(stored.stored);
  EXPECT_FALSE(restored.stored);
  EXPECT_EQ(places_of(stored), places_of(restored));
  EXPECT_EQ(with.surface()->vertices, restored.mesh.positions.size());
  EXPECT_EQ(with.surface()->triangles, restored.mesh.triangles.size());
  EXPECT_EQ(stored.samples_off, restored.samples_off);
  EXPECT_EQ(stored.measures.components, restored.measures.components);
  const auto sorted_levels = [](const ScanSurface& surface) {
    std::vector<std::pair<stream::Point3, int>> all;
    for (std::size_t i = 0; i < surface.mesh.positions.size(); ++i) {
      all.emplace_back(surface.mesh.positions[i], surface.mesh.levels[i]);
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  EXPECT_EQ(sorted_levels(stored), sorted_levels(restored));
  // Parts of the store, and other surfaces, are restored.
  EXPECT_FALSE(scan_surface(with.where("z > 700"), {}).stored);
  Detail part;
  part.region = Region::parse("399900,5199900,400050,5200050");
  EXPECT_FALSE(scan_surface(with, part).stored);
  ScanSurfaceOptions gabriel;
  gabriel.restore.shape.rule = tri::ShapeRule::published;
  EXPECT_FALSE(scan_surface(with, {}, gabriel).stored);
}

TEST_F(ScanSurfaceTest, CutsOfTheStoredSurfaceAreClosed) {
  const stream::Store with = store_with_surface();
  std::size_t vertices = 3001;
  for (const double error : {0.0, 1.0, 5.0, 20.0}) {
    const ScanSurface cut = scan_surface(with, {}, {.max_error = error});
    ASSERT_TRUE(cut.simplified);
    EXPECT_LE(cut.simplified->max_distance, error);
    EXPECT_EQ(cut.simplified->vertices, 3000U);
    EXPECT_TRUE(cut.measures.closed);
    EXPECT_EQ(cut.measures.euler_characteristic, 2);
    EXPECT_LE(cut.mesh.positions.size(), vertices);
    vertices = cut.mesh.positions.size();
  }
  EXPECT_LT(vertices, 100U);
  for (const std::size_t points : {1000U, 200U, 50U}) {
    const ScanSurface cut = scan_surface(with, {}, {.max_points = points});
    EXPECT_LE(cut.mesh.positions.size(), points);
    EXPECT_GE(cut.mesh.positions.size(), points * 9 / 10);
    EXPECT_TRUE(cut.measures.closed);
  }
  ASSERT_GE(with.top(), 1U);
  for (unsigned level = 0; level <= with.top(); ++level) {
    const ScanSurface cut = scan_surface(with, {.level = level});
    EXPECT_TRUE(cut.stored);
    EXPECT_TRUE(cut.measures.closed) << "level " << level;
    EXPECT_EQ(cut.mesh.positions.size(), cut.mesh.levels.size());
    Detail focus{.level = level};
    focus.focuses.push_back({Region::parse("399900,5199900,400000,5200000"), 0});
    const ScanSurface mixed = scan_surface(with, focus);
    EXPECT_TRUE(mixed.stored);
    EXPECT_TRUE(mixed.measures.closed) << "level " << level;
    EXPECT_GE(mixed.mesh.positions.size(), cut.mesh.positions.size());
    std::size_t inside = 0;
    for (const stream::Point3& p : mixed.mesh.positions) {
      inside += p[0] <= 400000.0 && p[1] <= 5200000.0 ? 1 : 0;
    }
    EXPECT_GT(inside, 600U);  // a quarter of all
  }
  const ScanSurface smoothed =
      scan_surface(with, {}, {.smoothing = tri::SurfaceSmoothingOptions{}, .max_points = 100});
  EXPECT_TRUE(smoothed.stored);
  EXPECT_EQ(smoothed.mesh.positions.size(), 100U);
  EXPECT_TRUE(smoothed.moves);
}

TEST_F(ScanSurfaceTest, StoringASurfaceNeedsOneAndMemory) {
  Context small;
  small.memory_bytes = std::uint64_t{128} << 20;
  small.threads = 2;
  build("small", 0.0, &small);
  build("same", 0.0, &context_);
  EXPECT_EQ(stream::Store::open(folder_.path() / "small").checksum(),
            stream::Store::open(folder_.path() / "same").checksum());
  // Points in a plane.
  const std::filesystem::path text = folder_.path() / "flat.xyz";
  {
    std::ofstream file(text);
    for (int i = 0; i < 100; ++i) file << i % 10 << ' ' << i / 10 << " 0\n";
  }
  BuildRequest request;
  request.inputs = {text.string()};
  request.store = folder_.path() / "flat";
  request.surface = [](const stream::Store& store, const stream::ClusterOrder& order,
                       const InputTriangles&) { return surface_to_store(store, order); };
  EXPECT_THROW(build_store(request), stream::Error);
  EXPECT_FALSE(std::filesystem::exists(request.store));
}

TEST_F(ScanSurfaceTest, SphereIsClosedWithCorrectAreaAndVolume) {
  const ScanSurface surface = scan_surface(store(), {});
  EXPECT_EQ(surface.mesh.positions.size(), 3000U);
  EXPECT_EQ(surface.mesh.levels.size(), 3000U);
  EXPECT_TRUE(surface.measures.closed);
  EXPECT_EQ(surface.measures.components, 1U);
  EXPECT_EQ(surface.measures.euler_characteristic, 2);
  EXPECT_NEAR(surface.measures.area, 4.0 * std::numbers::pi * kRadius * kRadius, 2e3);
  EXPECT_NEAR(surface.measures.volume, 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3), 6e4);
  for (const stream::Point3& p : surface.mesh.positions) EXPECT_NEAR(radius_of(p), kRadius, 1e-5);
}

TEST_F(ScanSurfaceTest, SimplifiesWithinABound) {
  const ScanSurface full = scan_surface(store(), {});
  const ScanSurface light = scan_surface(store(), {}, {.max_error = 5.0});
  ASSERT_TRUE(light.simplified);
  EXPECT_EQ(light.simplified->vertices, 3000U);
  EXPECT_EQ(light.simplified->triangles, full.mesh.triangles.size());
  EXPECT_EQ(light.simplified->volume, full.measures.volume);
  EXPECT_LE(light.simplified->max_distance, 5.0);
  EXPECT_LT(light.mesh.positions.size(), 300U);
  EXPECT_EQ(light.mesh.levels.size(), light.mesh.positions.size());
  EXPECT_EQ(light.samples_off, 0U);
  EXPECT_TRUE(light.measures.closed);
  EXPECT_EQ(light.measures.components, 1U);
  // Facets of a sphere within 5 m of a polyhedron within 1 m of the sphere.
  EXPECT_GT(light.measures.volume, 0.85 * full.measures.volume);
  EXPECT_LT(light.measures.volume, full.measures.volume);
  for (const stream::Point3& p : light.mesh.positions) EXPECT_NEAR(radius_of(p), kRadius, 1e-5);

  const ScanSurface few = scan_surface(store(), {}, {.max_points = 50});
  EXPECT_EQ(few.mesh.positions.size(), 50U);
  EXPECT_GT(few.simplified->max_distance, light.simplified->max_distance);

  EXPECT_THROW((void)scan_surface(store(), {}, {.max_error = -1.0}), UsageError);
  EXPECT_THROW((void)scan_surface(store(), {}, {.max_points = 0}), UsageError);
  EXPECT_THROW((void)scan_surface(store(), {}, {.max_points = 3}), UsageError);
  EXPECT_THROW((void)scan_surface(store(), {.level = 1}, {.max_error = 1.0}), UsageError);
  EXPECT_THROW((void)scan_surface(store(), {}, {.max_error = 1.0, .max_points = 10}), UsageError);
  EXPECT_THROW((void)scan_surface(store(), {}, {.tetrahedra = true, .max_error = 1.0}), UsageError);
}

TEST_F(ScanSurfaceTest, TetrahedraFillSurface) {
  ScanSurfaceOptions options;
  options.tetrahedra = true;
  const ScanSurface inside = scan_surface(store(), {}, options);
  EXPECT_TRUE(inside.mesh.triangles.empty());
  double volume = 0.0;
  for (const auto& t : inside.tetrahedra) {
    const auto edge = [&](std::size_t k, std::size_t axis) {
      return inside.mesh.positions[t[k]][axis] - inside.mesh.positions[t[0]][axis];
    };
    volume += std::abs(edge(1, 0) * (edge(2, 1) * edge(3, 2) - edge(2, 2) * edge(3, 1)) -
                       edge(1, 1) * (edge(2, 0) * edge(3, 2) - edge(2, 2) * edge(3, 0)) +
                       edge(1, 2) * (edge(2, 0) * edge(3, 1) - edge(2, 1) * edge(3, 0))) /
              6.0;
  }
  EXPECT_NEAR(volume, inside.measures.volume, 1e-6 * volume);
}

TEST_F(ScanSurfaceTest, MethodReturnsNewPointsUnlessItNamesInputs) {
  ScanSurfaceOptions options;
  std::size_t given = 0;
  options.method =
      SurfaceMethod{[&](std::span<const tri::Point3> points, const base::StopCheck&) {
                      given = points.size();
                      tri::RestoredSurface surface;
                      // In metres about the middle of the points.
                      surface.surface.points = {{0, 0, 0}, {kRadius, 0, 0}, {0, 0, kRadius}};
                      surface.surface.faces = {{0, 1, 2}};
                      return surface;
                    },
                    100};
  const ScanSurface made = scan_surface(store(), {}, options);
  EXPECT_EQ(given, 3000U);
  ASSERT_EQ(made.mesh.positions.size(), 3U);
  EXPECT_TRUE(made.mesh.levels.empty());
  EXPECT_LT(radius_of(made.mesh.positions[0]), 1.0);
  EXPECT_NEAR(radius_of(made.mesh.positions[1]), kRadius, 1.0);
  EXPECT_NEAR(made.mesh.positions[2][2] - made.mesh.positions[0][2], kRadius, 0.1);

  options.method->restore = [](std::span<const tri::Point3> points, const base::StopCheck&) {
    tri::RestoredSurface surface;
    surface.surface.points = {points[7], points[8], points[9]};
    surface.surface.faces = {{0, 1, 2}};
    surface.input = {7, 8, 9};
    return surface;
  };
  const ScanSurface named = scan_surface(store(), {}, options);
  ASSERT_EQ(named.mesh.positions.size(), 3U);
  for (const stream::Point3& p : named.mesh.positions) EXPECT_NEAR(radius_of(p), kRadius, 1e-5);
  EXPECT_EQ(named.samples_off, 2997U);
  options.tetrahedra = true;
  EXPECT_THROW(static_cast<void>(scan_surface(store(), {}, options)), UsageError);
}

TEST_F(ScanSurfaceTest, SmoothingMovesVerticesTowardsTheSphereAndKeepsTheLimit) {
  const stream::Store noisy = noisy_store(3.0);
  const ScanSurface rough = scan_surface(noisy, {});
  EXPECT_FALSE(rough.moves);
  const auto error_of = [](const ScanSurface& surface) {
    double sum = 0.0;
    for (const stream::Point3& p : surface.mesh.positions) {
      sum += std::abs(radius_of(p) - kRadius);
    }
    return sum / static_cast<double>(surface.mesh.positions.size());
  };
  for (const tri::SurfaceSmoothing method :
       {tri::SurfaceSmoothing::taubin, tri::SurfaceSmoothing::bilateral}) {
    for (const std::optional<double> limit : {std::optional<double>(), {0.5}, {0.0}}) {
      ScanSurfaceOptions options;
      options.smoothing = tri::SurfaceSmoothingOptions{.method = method, .limit = limit};
      const ScanSurface smooth = scan_surface(noisy, {}, options);
      ASSERT_TRUE(smooth.moves);
      EXPECT_EQ(smooth.mesh.triangles, rough.mesh.triangles);
      EXPECT_EQ(smooth.mesh.levels, rough.mesh.levels);
      double sum = 0.0, largest = 0.0;
      for (std::size_t v = 0; v < rough.mesh.positions.size(); ++v) {
        double square = 0.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double by = smooth.mesh.positions[v][axis] - rough.mesh.positions[v][axis];
          square += by * by;
        }
        // Exactly, although the coordinates are rounded to a nanometre.
        ASSERT_LE(std::sqrt(square), smooth.moves->limit);
        sum += std::sqrt(square);
        largest = std::max(largest, std::sqrt(square));
      }
      EXPECT_NEAR(smooth.moves->largest, largest, 1e-8);
      EXPECT_NEAR(smooth.moves->mean, sum / static_cast<double>(rough.mesh.positions.size()), 1e-8);
      if (limit == 0.0) {
        EXPECT_EQ(smooth.mesh.positions, rough.mesh.positions);
      } else if (limit) {
        EXPECT_EQ(smooth.moves->limit, 0.5);
        EXPECT_GT(smooth.moves->limited, 100U);
      } else {
        EXPECT_LT(error_of(smooth), 0.6 * error_of(rough));
        EXPECT_LT(smooth.measures.area, rough.measures.area);
      }
    }
  }
}

TEST_F(ScanSurfaceTest, SmoothsNewCornersOfAMethodAndNoTetrahedra) {
  ScanSurfaceOptions options;
  options.smoothing.emplace();
  options.tetrahedra = true;
  EXPECT_THROW(static_cast<void>(scan_surface(store(), {}, options)), UsageError);
  options.tetrahedra = false;
  // A tetrahedron, every corner of which moves towards the middle of the others.
  options.smoothing->iterations = 1;
  options.smoothing->limit = 1.0;
  options.method =
      SurfaceMethod{[&](std::span<const tri::Point3>, const base::StopCheck&) {
                      tri::RestoredSurface surface;
                      surface.surface.points = {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}, {0, 0, 50}};
                      surface.surface.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
                      return surface;
                    },
                    100};
  const ScanSurface made = scan_surface(store(), {}, options);
  ASSERT_EQ(made.mesh.positions.size(), 4U);
  EXPECT_EQ(made.moves->limited, 4U);
  EXPECT_NEAR(made.moves->largest, 1.0, 1e-12);
}

TEST_F(ScanSurfaceTest, RejectsTooManyPointsAndStops) {
  try {
    static_cast<void>(scan_surface(store(), {}, {}, {.memory_bytes = std::uint64_t{1} << 20}));
    FAIL() << "3,000 points do not fit into 1 MiB";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("`memory_bytes`"), std::string::npos) << error.what();
  }
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(static_cast<void>(scan_surface(store(), {}, {}, {.stop = stop.get_token()})),
               stream::Stopped);
}

}  // namespace
}  // namespace terrace::terrain
