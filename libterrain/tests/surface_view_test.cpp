// SPDX-License-Identifier: Apache-2.0
// Compares views of a stored surface with cuts of it.
#include "terrace/terrain/surface_view.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <string>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/view.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/scan_surface.hpp"
#include "terrace/terrain/store_view.hpp"

namespace terrace::terrain {
namespace {

/// An ellipsoid with an attribute that is a function of the position.
class SurfaceViewTest : public testing::Test {
 protected:
  static constexpr int kPoints = 4000 / TERRACE_TEST_SHARE;

  /// The tests share a store, because the surface takes longer to restore than a test to run.
  static void SetUpTestSuite() {
    folder_ = std::make_unique<tests::TemporaryFolder>();
    const std::filesystem::path text = folder_->path() / "ellipsoid.csv";
    std::mt19937_64 random(5);
    {
      std::ofstream file(text);
      file << "x,y,z,mark\n";
      const auto part = [&] { return 2.0 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1.0; };
      for (int i = 0; i < kPoints;) {
        const stream::Point3 p{part(), part(), part()};
        const double length = std::hypot(p[0], p[1], p[2]);
        if (length < 0.1 || length > 1.0) continue;
        std::array<char, 120> line{};
        const double x = 30 * p[0] / length, y = 20 * p[1] / length, z = 10 * p[2] / length;
        std::snprintf(line.data(), line.size(), "%.4f,%.4f,%.4f,%.0f\n", x, y, z,
                      std::round(100 * x));
        file << line.data();
        ++i;
      }
    }
    BuildRequest request;
    request.inputs = {text.string()};
    request.store = folder_->path() / "store";
    request.block_points = 400;
    request.surface = [](const stream::Store& points, const stream::ClusterOrder& order,
                         const InputTriangles&) { return surface_to_store(points, order); };
    build_store(request);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  [[nodiscard]] static stream::Store store() {
    return stream::Store::open(folder_->path() / "store");
  }

  static void settle(SurfaceView& view, const tri::View& wish) {
    for (int i = 0; i < 10000; ++i) {
      view.frame(wish, 1.0);
      if (view.settled()) return;
    }
    FAIL() << "the view does not settle";
  }
  static tri::View from(const tri::Point3& eye) {
    tri::View view;
    view.camera = tri::perspective_camera(
        {.position = eye, .direction = {-eye[0], -eye[1], -eye[2]}, .up = {0, 0, 1}}, 50.0, 1.5,
        700.0);
    return view;
  }

  static inline std::unique_ptr<tests::TemporaryFolder> folder_;
};

TEST_F(SurfaceViewTest, UniformErrorGivesTheCutOfTheStoredSurface) {
  const stream::Store opened = store();
  ASSERT_TRUE(SurfaceView::serves(opened));
  SurfaceView view(opened, {.collapse_below = 1.0});
  for (const double error : {0.0, 0.2, 1.0, 0.05}) {
    SCOPED_TRACE(error);
    tri::View wish;
    wish.ground_error = error;
    settle(view, wish);
    const ScanSurface cut = scan_surface(opened, {.level = 0}, {.max_error = error});
    EXPECT_TRUE(cut.stored);
    EXPECT_EQ(view.surface().triangle_count(), cut.mesh.triangles.size());
    std::set<stream::Point3> of_view, of_cut;
    for (const tri::VertexId v : view.surface().all_vertices()) {
      of_view.insert(world_point(opened.schema(), view.stored(v)));
    }
    for (const stream::Point3& p : cut.mesh.positions) of_cut.insert(p);
    EXPECT_EQ(of_view, of_cut);
  }
}

TEST_F(SurfaceViewTest, VerticesHaveTheirPlacesAndAttributes) {
  const stream::Store opened = store();
  SurfaceView view(opened);
  const StoreView<tri::PointCloud> points(opened);
  settle(view, from({40, 10, 5}));
  EXPECT_GT(view.surface().vertex_count(), 100U);
  EXPECT_LT(view.surface().vertex_count(), std::size_t{kPoints});
  for (const tri::VertexId v : view.surface().all_vertices()) {
    const stream::Point3 p = world_point(opened.schema(), view.stored(v));
    EXPECT_NEAR(p[0] * p[0] / 900 + p[1] * p[1] / 400 + p[2] * p[2] / 100, 1.0, 1e-3);
    EXPECT_EQ(view.in_view_frame(v), points.in_view_frame(view.stored(v)));
    const std::span<const std::byte> record = view.attributes(v);
    ASSERT_EQ(record.size(), opened.schema().payload_size());
    const stream::Channel& mark = opened.schema().attributes.front();
    EXPECT_EQ(mark.name, "mark");
    const double raw = stream::to_double(mark.type, record.data());
    EXPECT_NEAR(raw * mark.scale + mark.offset, std::round(100 * p[0]), 1.0 + 1e-6);
  }
}

TEST_F(SurfaceViewTest, PinsHoldClusters) {
  const stream::Store opened = store();
  SurfaceView view(opened);
  tri::View coarse;
  coarse.ground_error = 2.0;
  settle(view, coarse);
  const std::size_t before = view.surface().vertex_count();
  const tri::ClusterId cluster = tri::cluster_id(0, 0);
  view.pin(cluster, tri::ViewPin::expanded);
  settle(view, coarse);
  const std::size_t pinned = view.surface().vertex_count();
  EXPECT_GT(pinned, before);
  tri::View fine;
  fine.ground_error = 0.0;
  settle(view, fine);
  const std::size_t all = view.surface().vertex_count();
  view.pin(cluster, tri::ViewPin::collapsed);
  settle(view, fine);
  EXPECT_LT(view.surface().vertex_count(), all);
  view.unpin(cluster);
  settle(view, fine);
  EXPECT_EQ(view.surface().vertex_count(), all);
}

TEST_F(SurfaceViewTest, NeedsASurfaceAndMemory) {
  EXPECT_THROW(SurfaceView(store(), {}, {.memory_bytes = 1 << 20}), stream::Error);
  BuildRequest request;
  request.inputs = {(folder_->path() / "ellipsoid.csv").string()};
  request.store = folder_->path() / "plain";
  build_store(request);
  const stream::Store plain = stream::Store::open(request.store);
  EXPECT_FALSE(SurfaceView::serves(plain));
  EXPECT_THROW(SurfaceView{plain}, stream::Error);
}

}  // namespace
}  // namespace terrace::terrain
