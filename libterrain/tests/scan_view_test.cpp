// SPDX-License-Identifier: Apache-2.0 Checks stores of scans seen by a camera, with generated scans
// and those in the data folder TERRACE_DATA.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/store_view.hpp"

namespace terrace::terrain {
namespace {

using ScanSurface3 = tri::DynamicSurface<std::int32_t>;
using ScanView = StoreView<ScanSurface3>;

/// The corners of triangles as they were when they were added, as a renderer keeps them.
class DrawnSurface {
 public:
  using Corners = std::array<ScanSurface3::Point, 3>;

  explicit DrawnSurface(const ScanSurface3& surface) : surface_(surface), drawn_(now()) {}
  void apply(const ScanSurface3::Changes& changes) {
    for (const tri::TriangleId t : changes.removed_triangles) ASSERT_EQ(drawn_.erase(t), 1u);
    for (const tri::TriangleId t : changes.added_triangles)
      ASSERT_TRUE(drawn_.emplace(t, corners(t)).second);
  }
  void check() const {
    ASSERT_EQ(drawn_.size(), surface_.triangle_count());
    ASSERT_EQ(drawn_, now());
  }

 private:
  [[nodiscard]] Corners corners(tri::TriangleId t) const {
    const auto [a, b, c] = surface_.vertices(t);
    return {surface_.point(a), surface_.point(b), surface_.point(c)};
  }
  [[nodiscard]] std::map<tri::TriangleId, Corners> now() const {
    std::map<tri::TriangleId, Corners> all;
    for (const tri::TriangleId t : surface_.all_triangles()) all.emplace(t, corners(t));
    return all;
  }
  const ScanSurface3& surface_;
  std::map<tri::TriangleId, Corners> drawn_;
};

class ScanViews : public testing::Test {
 protected:
  stream::Store build(const std::string& input) {
    BuildRequest request{.inputs = {input}, .store = folder_.path() / "store", .replace = true};
    request.block_points = 1000;
    build_store(request);
    return stream::Store::open(request.store);
  }
  /// Returns the name of a file of points: of the vertices of an OBJ, or the file itself.
  std::string points_of(const std::filesystem::path& file) {
    if (file.extension() != ".obj") return file.string();
    const std::filesystem::path text = folder_.path() / "vertices.xyz";
    std::ifstream in(file);
    std::ofstream out(text);
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("v ")) out << line.substr(2) << '\n';
    }
    return text.string();
  }
  /// Builds a store of a bumpy body of about 100 m, scanned in this many points.
  stream::Store bumpy(int count, std::uint64_t seed) {
    const std::filesystem::path text = folder_.path() / "points.xyz";
    std::mt19937_64 random(seed);
    const auto part = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
    {
      std::ofstream file(text);
      for (int i = 0; i < count;) {
        const stream::Point3 p{part(), part(), part()};
        const double length = std::hypot(p[0], p[1], p[2]);
        if (length < 0.1 || length > 1.0) continue;
        const double radius =
            50.0 * (1.0 + 0.2 * std::sin(4 * p[0] / length) * std::cos(5 * p[2] / length));
        std::array<char, 100> line{};
        std::snprintf(line.data(), line.size(), "%.6f %.6f %.6f\n",
                      400'000.0 + radius * p[0] / length, 5'200'000.0 + radius * p[1] / length,
                      700.0 + radius * p[2] / length);
        file << line.data();
        ++i;
      }
    }
    return build(text.string());
  }

  tests::TemporaryFolder folder_;
};

/// A flight around the body, close to it and looking ahead.
class Round {
 public:
  explicit Round(const stream::Store& store) {
    const StoreView<tri::PointCloud> view(store);
    const stream::Point3 low = view.in_view_frame(store.bounds().min);
    const stream::Point3 high = view.in_view_frame(store.bounds().max);
    for (std::size_t k = 0; k < 3; ++k) {
      middle_[k] = 0.5 * (low[k] + high[k]);
      radius_ = std::max(radius_, 0.55 * (high[k] - low[k]));
    }
  }
  [[nodiscard]] tri::View view(double turns, double pixel_error) const {
    const double angle = 6.283185307179586 * turns, c = std::cos(angle), s = std::sin(angle);
    const tri::Pose pose{{middle_[0] + radius_ * c, middle_[1] + radius_ * s, middle_[2]},
                         {-c - 0.5 * s, 0.5 * c - s, -0.1},
                         {0, 0, 1}};
    tri::View view;
    view.camera = tri::perspective_camera(pose, 50.0, 1.5, 720.0);
    view.pixel_error = pixel_error;
    return view;
  }

 private:
  stream::Point3 middle_{};
  double radius_ = 0.0;
};

struct Flown {
  std::size_t triangles = 0, expanded = 0, collapsed = 0;
  std::size_t differed_first = 0, differed = 0;  ///< triangles that restore() removed
};

/// Settles before the first frame, flies around once in `frames` frames, and settles again. Both
/// times the tetrahedra must be those of the points, the deltas must add up to the surface, and the
/// surface from scratch must be that of the points.
void fly(ScanView& view, const Round& round, int frames, double pixel_error, double seconds,
         Flown& flown) {
  const ScanSurface3& surface = view.model().triangulation();
  DrawnSurface drawn(surface);
  const auto take = [&](double turns) {
    const ScanView::Step& step = view.frame(round.view(turns, pixel_error), seconds);
    flown.expanded += step.expanded;
    flown.collapsed += step.collapsed;
    ASSERT_TRUE(step.faults.empty());
    ASSERT_NO_FATAL_FAILURE(drawn.apply(step.delta->changes));
  };
  const auto settle = [&](double turns, std::size_t& differed) {
    for (int frame = 0; frame == 0 || !view.settled(); ++frame) {
      ASSERT_LT(frame, 20000);
      ASSERT_NO_FATAL_FAILURE(take(turns));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_NO_FATAL_FAILURE(drawn.check());
    std::vector<ScanSurface3::Point> points;
    for (const tri::VertexId v : surface.all_vertices()) points.push_back(surface.point(v));
    ScanSurface3 fresh;
    fresh.build(points);
    ASSERT_EQ(surface.tetrahedra().hash(), fresh.tetrahedra().hash());
    const auto& rest = view.restore(2);
    differed = rest.changes.removed_triangles.size();
    ASSERT_NO_FATAL_FAILURE(drawn.apply(rest.changes));
    ASSERT_NO_FATAL_FAILURE(drawn.check());
    ASSERT_EQ(surface.hash(), fresh.hash());
  };
  ASSERT_NO_FATAL_FAILURE(settle(0.0, flown.differed_first));
  for (int frame = 0; frame < frames; ++frame) {
    ASSERT_NO_FATAL_FAILURE(take(static_cast<double>(frame) / frames));
  }
  ASSERT_NO_FATAL_FAILURE(settle(1.0, flown.differed));
  flown.triangles = surface.triangle_count();
}

TEST_F(ScanViews, FollowCameraToSameResultWithAnyReader) {
  const stream::Store store = bumpy(20'000, 3);
  const Round round(store);
  std::array<std::uint64_t, 2> hashes{};
  for (const ScanView::Reader reader : {ScanView::Reader::thread, ScanView::Reader::in_frame}) {
    ScanView view(store, {}, reader);
    Flown flown;
    ASSERT_NO_FATAL_FAILURE(fly(view, round, 60, 4.0, 0.03, flown));
    EXPECT_GT(flown.expanded, 50u);
    EXPECT_GT(flown.collapsed, 20u);
    EXPECT_LE(flown.differed_first + flown.differed, flown.triangles / 500);
    // At full detail.
    tri::View all;
    all.ground_error = 0.0;
    for (int frame = 0; frame < 20000 && (frame == 0 || !view.settled()); ++frame) {
      view.frame(all, 0.01);
    }
    EXPECT_EQ(view.model().point_count(), 20'000u);
    view.restore();
    EXPECT_EQ(view.model().triangulation().triangle_count(), 2 * 20'000u - 4);
    hashes[static_cast<std::size_t>(reader)] = view.model().triangulation().hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(ScanViews, PlaceVerticesAtStoredPoints) {
  const stream::Store store = bumpy(3000, 4);
  ScanView view(store, {}, ScanView::Reader::in_frame);
  tri::View all;
  all.ground_error = 0.0;
  for (int frame = 0; frame < 20000 && (frame == 0 || !view.settled()); ++frame) {
    view.frame(all, 0.01);
  }
  std::vector<stream::Point3> expected, found;
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& points) {
      expected.insert(expected.end(), points.positions.begin(), points.positions.end());
    });
  }
  ASSERT_EQ(expected.size(), 3000u);
  for (const tri::VertexId v : view.model().triangulation().all_vertices()) {
    found.push_back(view.stored(v));
    const stream::Point3 there = view.in_view_frame(v);
    const stream::Point3 again = view.in_view_frame(found.back());
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(there[k], again[k], 1e-8);
    EXPECT_LT(std::hypot(there[0], there[1]), 70.0);  // the middle is the origin
  }
  // Coordinates differ by more than the lattice's spacing, so the order is the same.
  std::sort(expected.begin(), expected.end());
  std::sort(found.begin(), found.end());
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(found[i][k], expected[i][k], 1e-6);
}

TEST_F(ScanViews, ExpandAndCollapseRegions) {
  const stream::Store store = bumpy(10'000, 5);
  ScanView view(store, {}, ScanView::Reader::in_frame);
  const std::size_t coarse = view.model().point_count();
  const auto settle = [&](const tri::View& wish) {
    for (int frame = 0; frame < 20000; ++frame) {
      view.frame(wish, 0.01);
      if (view.settled()) return true;
    }
    return false;
  };
  tri::View half;
  half.focuses.push_back({{{0.0, -1000.0, -10'000.0}, {1000.0, 1000.0, 10'000.0}}, 0});
  ASSERT_TRUE(settle(half));
  std::size_t east = 0;
  for (const tri::VertexId v : view.model().triangulation().all_vertices())
    east += view.in_view_frame(v)[0] >= 0.0;
  std::size_t expected = 0;
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& points) {
      for (const stream::Point3& p : points.positions) expected += view.in_view_frame(p)[0] >= 0.0;
    });
  }
  EXPECT_NEAR(static_cast<double>(east), static_cast<double>(expected), 2.0);
  EXPECT_LT(view.model().point_count(), 8000u);
  ASSERT_TRUE(settle({}));
  EXPECT_EQ(view.model().point_count(), coarse);
}

/// The surface of the steps may differ from that from scratch in weakly determined pockets. For the
/// bunny and the armadillo, less than a thousandth of the triangles differ. Lucy has large pockets
/// that depend on a distant angle (between the robe's folds, between arm and face), and her coarse
/// points decide differently. After refining directly from the coarsest level, up to a tenth of the
/// triangles differ until restore(); after that, a flight changes less than a hundredth.
TEST_F(ScanViews, FollowCameraOnRealScans) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  struct Scan {
    const char* file;
    std::size_t first, later;  ///< limits of differing triangles per thousand
  };
  const Scan scans[] = {
      {"bun_zipper.ply", 1, 1}, {"armadillo_libigl.obj", 1, 1}, {"lucy_100k.ply", 150, 10}};
  for (std::size_t i = 0; i < std::size(scans); i += TERRACE_TEST_SHARE) {
    const Scan& scan = scans[i];
    SCOPED_TRACE(scan.file);
    const stream::Store store = build(points_of(std::filesystem::path(data) / "scan" / scan.file));
    const Round round(store);
    ScanView view(store, {}, ScanView::Reader::in_frame);
    EXPECT_TRUE(is_scan(store, view.ground()));
    Flown flown;
    ASSERT_NO_FATAL_FAILURE(fly(view, round, 150, 5.0, 0.03, flown));
    std::printf(
        "%s: %zu points, %zu triangles, %zu clusters came and %zu went; %zu, %zu differed\n",
        scan.file, view.model().point_count(), flown.triangles, flown.expanded, flown.collapsed,
        flown.differed_first, flown.differed);
    EXPECT_GT(flown.collapsed, 50u);
    EXPECT_LE(1000 * flown.differed_first, scan.first * flown.triangles);
    EXPECT_LE(1000 * flown.differed, scan.later * flown.triangles);
  }
}

TEST_F(ScanViews, RecogniseBodiesButNotGroundOrClassifiedPoints) {
  constexpr stream::LinearMap kMetres{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const stream::Store body = bumpy(5000, 7);
  EXPECT_TRUE(is_scan(body, kMetres));
  // Stretched to a hundred times its width, it is ground.
  EXPECT_FALSE(is_scan(body, {100, 0, 0, 0, 100, 0, 0, 0, 1}));
  const std::filesystem::path text = folder_.path() / "points.csv";
  std::mt19937_64 random(8);
  const auto part = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (const bool classified : {false, true}) {
    for (const double height : {0.3, 90.0}) {
      {
        std::ofstream file(text);
        file << (classified ? "x,y,z,classification\n" : "x,y,z\n");
        for (int i = 0; i < 5000; ++i) {
          file << 100 * part() << ',' << 100 * part() << ',' << height * part()
               << (classified ? ",2\n" : "\n");
        }
      }
      EXPECT_EQ(is_scan(build(text.string()), kMetres), height > 1 && !classified) << height;
    }
  }
}

}  // namespace
}  // namespace terrace::terrain
