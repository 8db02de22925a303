// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analytic_surface.hpp"
#include "temporary_folder.hpp"
#include "tile/set/inputs.hpp"

namespace terrace::terrain {

namespace {

/// Records a box around all queries.
class Spy final : public TileSurface {
 public:
  explicit Spy(AnalyticSurface& asked) : asked_(asked) {}

  [[nodiscard]] GeographicBox bounds() const override { return asked_.bounds(); }
  [[nodiscard]] double spacing() const override { return asked_.spacing(); }
  void expect(const GeographicBox& box) override { note(box); }
  void samples(const GeographicBox& box, SurfaceSamples& out) override {
    note(box);
    asked_.samples(box, out);
  }
  SurfacePart part(const GeographicBox& box) override {
    note(box);
    return asked_.part(box);
  }
  std::optional<HeightRange> range(const GeographicBox& box) override {
    note(box);
    return asked_.range(box);
  }
  void heights(std::span<const double> longitude, std::span<const double> latitude,
               std::span<double> out) override {
    note(longitude, latitude);
    asked_.heights(longitude, latitude, out);
  }
  void water(std::span<const double> longitude, std::span<const double> latitude,
             std::span<std::uint8_t> out) override {
    note(longitude, latitude);
    asked_.water(longitude, latitude, out);
  }
  std::uint64_t digest(const GeographicBox& box) override { return asked_.digest(box); }

  GeographicBox seen{1e9, 1e9, -1e9, -1e9};

 private:
  void note(const GeographicBox& box) {
    seen = {std::min(seen.west, box.west), std::min(seen.south, box.south),
            std::max(seen.east, box.east), std::max(seen.north, box.north)};
  }
  void note(std::span<const double> longitude, std::span<const double> latitude) {
    for (std::size_t i = 0; i < longitude.size(); ++i) {
      note({longitude[i], latitude[i], longitude[i], latitude[i]});
    }
  }

  AnalyticSurface& asked_;
};

TEST(TileInputs, QueriesStayWithinReach) {
  struct Place {
    double west, south, step;
  };
  for (const Place& place : {Place{10.13, 45.91, 0.0031}, Place{-180.0, -17.0, 0.01},
                             Place{179.5, 60.0, 0.004}, Place{20.0, 89.2, 0.005}}) {
    AnalyticSurface hilly{place.west, place.south, place.step, 120, 120, hills};
    for (const bool in_rows : {false, true}) {
      hilly.in_rows = in_rows;
      for (const unsigned zoom : {0U, 5U, 8U, 10U, 13U}) {
        SCOPED_TRACE(testing::Message() << place.west << "," << place.south << " zoom " << zoom);
        const ZoomPlan plan = plan_zoom(zoom, zoom < 9 ? 40.0 : 4.0, 2000, hilly);
        const TileRange range = tiles_in(hilly.bounds(), zoom);
        // At the raster's corners and in its middle.
        const std::uint32_t x = range.x0 + (range.x1 - range.x0) / 2;
        const std::uint32_t y = range.y0 + (range.y1 - range.y0) / 2;
        for (const TileAddress& tile : std::set<TileAddress>{
                 {zoom, range.x0, range.y0}, {zoom, range.x1, range.y1}, {zoom, x, y}}) {
          Spy spy(hilly);
          make_tile(tile, plan, spy, {.normals = true, .water = true});
          const GeographicBox box = box_of(tile), reach = input_box(tile, hilly);
          EXPECT_LE(spy.seen.west, box.west);
          EXPECT_GE(spy.seen.west, reach.west);
          EXPECT_GE(spy.seen.south, reach.south);
          EXPECT_LE(spy.seen.east, reach.east);
          EXPECT_LE(spy.seen.north, reach.north);
        }
      }
    }
  }
}

TEST(TileInputs, DigestDependsOnAllInputs) {
  AnalyticSurface hilly{10.13, 45.91, 0.01, 50, 50, hills};
  AnalyticSurface other{10.13, 45.91, 0.01, 50, 50, [](double lon, double lat) {
                          return hills(lon, lat) + (lon > 10.5 && lat > 46.2 ? 1.0 : 0.0);
                        }};
  const TileAddress tile{6, 67, 48};
  const ZoomPlan plan = plan_zoom(6, 10.0, 2000, hilly);
  const TileInputs inputs;
  std::vector<std::uint64_t> seen{digest_of(tile, plan, inputs, hilly)};
  EXPECT_EQ(digest_of(tile, plan, inputs, hilly), seen.front());
  const auto with_plan = [&](const std::function<void(ZoomPlan&)>& change) {
    ZoomPlan changed = plan;
    change(changed);
    seen.push_back(digest_of(tile, changed, inputs, hilly));
  };
  with_plan([](ZoomPlan& p) { p.max_error = 11.0; });
  with_plan([](ZoomPlan& p) { p.height_step *= 2.0; });
  with_plan([](ZoomPlan& p) { p.longest_edge *= 2.0; });
  with_plan([](ZoomPlan& p) { p.widest_leaf *= 2.0; });
  const auto with_inputs = [&](const std::function<void(TileInputs&)>& change) {
    TileInputs changed = inputs;
    change(changed);
    seen.push_back(digest_of(tile, plan, changed, hilly));
  };
  with_inputs([](TileInputs& i) { i.mesh.quality = tri::TinQuality::fitted; });
  with_inputs([](TileInputs& i) { i.mesh.normals = true; });
  with_inputs([](TileInputs& i) { i.mesh.water = true; });
  with_inputs([](TileInputs& i) { i.gzip = true; });
  with_inputs([](TileInputs& i) { i.source_options = std::string(1, 'a'); });
  with_inputs([](TileInputs& i) { i.metadata = std::string(1, 'a'); });
  seen.push_back(digest_of({6, 66, 48}, plan, inputs, hilly));
  seen.push_back(digest_of({6, 67, 47}, plan, inputs, hilly));
  seen.push_back(digest_of({7, 67, 48}, plan, inputs, hilly));
  seen.push_back(digest_of(tile, plan, inputs, other));
  EXPECT_EQ(std::set(seen.begin(), seen.end()).size(), seen.size());
}

TEST(TileInputs, FileDigestDependsOnBytes) {
  const tests::TemporaryFolder scratch;
  const std::string path = scratch.path() / "inputs";
  const auto digest = [&](const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    return digest_of_file(path);
  };
  const std::string large(3'000'000, 'x');
  std::string changed = large;
  changed[2'500'000] = 'y';
  EXPECT_EQ(digest(large), digest(large));
  EXPECT_EQ(std::set({digest(large), digest(changed), digest(large + "x"), digest("")}).size(), 4U);
  std::filesystem::remove(path);
  EXPECT_ANY_THROW(static_cast<void>(digest_of_file(path)));
}

}  // namespace
}  // namespace terrace::terrain
