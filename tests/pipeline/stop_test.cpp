// SPDX-License-Identifier: GPL-3.0-or-later
// Every job of libterrain ends when its context requests a stop and leaves nothing behind; other
// jobs continue.
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "../../libterrain/tests/test_raster.hpp"
#include "terrace/terrain/bounded_mesh.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/contours.hpp"
#include "terrace/terrain/detail_mesh.hpp"
#include "terrace/terrain/heights.hpp"
#include "terrace/terrain/profile.hpp"
#include "terrace/terrain/raster.hpp"
#include "terrace/terrain/tiles.hpp"

namespace terrace {
namespace {

namespace fs = std::filesystem;

/// A raster of 700 x 700 cells in UTM.
class Stop : public testing::Test {
 protected:
  static constexpr std::uint32_t kSize = 700;

  void SetUp() override {
    stream::GeoTiffOptions options;
    options.columns = options.rows = kSize;
    options.world.xy = {30, 0, 500000, 0, -30, 5200000};
    options.crs.epsg = 32632;
    tests::write_test_raster(
        folder_.path() / "dem.tif", options, [](std::uint32_t column, std::uint32_t row) {
          return static_cast<int>(400 + column * row % 61 + (column * 7 + row * 3) % 37);
        });
    terrain::build_store(
        {.inputs = {(folder_.path() / "dem.tif").string()}, .store = folder_.path() / "a.store"});
    store_.emplace(stream::Store::open(folder_.path() / "a.store"));
  }

  using Job = std::function<void(const terrain::Context&)>;
  /// The jobs by name; those that write a file write `path`.
  [[nodiscard]] std::map<std::string, Job> jobs(const std::string& path) const {
    const stream::Store& store = *store_;
    const auto nowhere = [](std::string_view) {};
    return {
        {"bounded mesh",
         [=, &store](const terrain::Context& context) {
           write_bounded_mesh(store, {.max_error = 2.0, .path = path + ".ply"}, context);
         }},
        {"raster",
         [=, &store](terrain::Context context) {
           context.memory_bytes = std::uint64_t{64} << 20;  // splits the work into several parts
           terrain::RasterRequest request;
           request.output = path + ".tif";
           write_raster(store, request, context);
         }},
        {"heights",
         [=, &store](const terrain::Context& context) {
           const std::array<terrain::Point2, 2> places{{{1, 1}, {300, 200}}};
           std::array<terrain::SurfacePoint, 2> surface{};
           terrain::make_sampler(store, {}, context)->sample(places, surface);
         }},
        {"heights of a level",
         [=, &store](const terrain::Context& context) {
           const std::array<terrain::Point2, 2> places{{{1, 1}, {300, 200}}};
           std::array<terrain::SurfacePoint, 2> surface{};
           terrain::make_sampler(store, {.level = 1}, context)->sample(places, surface);
         }},
        {"profile",
         [=, &store](const terrain::Context& context) {
           write_profile(store, {.line = {{500100, 5199000}, {509000, 5191000}}}, nowhere, context);
         }},
        {"contours",
         [=, &store](const terrain::Context& context) {
           write_contours(store, {.interval = 10}, nowhere, context);
         }},
        {"contours of a level",
         [=, &store](const terrain::Context& context) {
           write_contours(store, {.interval = 10, .level = 1}, nowhere, context);
         }},
        {"tiles",
         [=, &store](const terrain::Context& context) {
           terrain::TilesRequest request{.folder = path + ".tiles", .last_zoom = 9};
           request.vertical = terrain::HeightReference::ignore;
           write_tiles(store, request, context);
         }},
    };
  }

  tests::TemporaryFolder folder_;
  std::optional<stream::Store> store_;
};

TEST_F(Stop, EndsEveryJobButNoOther) {
  std::stop_source stop, other;
  stop.request_stop();
  const std::string path = (folder_.path() / "out").string();
  for (const auto& [name, job] : jobs(path)) {
    SCOPED_TRACE(name);
    EXPECT_THROW(job({.stop = stop.get_token()}), stream::Stopped);
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      EXPECT_FALSE(entry.is_regular_file() && entry.path().string().starts_with(path))
          << entry.path();
    }
    fs::remove_all(path + ".tiles");
    EXPECT_NO_THROW(job({.stop = other.get_token()}));
    for (const char* ending : {".ply", ".tif", ".tiles"}) fs::remove_all(path + ending);
  }
}

TEST_F(Stop, EndsSmoothingThatWouldNeverFinish) {
  std::stop_source stop;
  terrain::DetailMeshOptions options;
  options.heights.smoothing =
      tri::SmoothingOptions{.method = tri::Smoothing::bilateral, .iterations = 1'000'000'000};
  // After the store has been read, unless the machine is slow.
  const std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    stop.request_stop();
  });
  EXPECT_THROW(static_cast<void>(detail_mesh(*store_, {}, options, {.stop = stop.get_token()})),
               stream::Stopped);
}

TEST_F(Stop, TakesEffectInTheMiddleOfAJob) {
  const std::string path = (folder_.path() / "out").string();
  const std::map<std::string, Job> all = jobs(path);
  // The other jobs do one part of work, so their first report is also the last.
  for (const char* name : {"bounded mesh", "contours", "raster", "tiles"}) {
    SCOPED_TRACE(name);
    std::stop_source stop;
    EXPECT_THROW(all.at(name)({.stop = stop.get_token(),
                               .progress = [&](const terrain::Progress&) { stop.request_stop(); }}),
                 stream::Stopped);
    EXPECT_TRUE(stop.stop_requested());
    for (const char* ending : {".ply", ".tif"}) EXPECT_FALSE(fs::exists(path + ending));
  }
}

}  // namespace
}  // namespace terrace
