// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/base/random.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "tile/make/raster_surface.hpp"
#include "tile/make/tiled_raster.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// A raster somewhere on the globe.
struct Frame {
  const char* name;
  int epsg;
  std::array<double, 6> world;
};

class RasterDigest : public ::testing::TestWithParam<Frame> {
 protected:
  static constexpr std::int64_t kColumns = 210, kRows = 160;
  static constexpr float kNodata = -9999.0F;

  void SetUp() override {
    for (std::int64_t i = 0; i < kColumns * kRows; ++i) {
      const double column = static_cast<double>(i % kColumns),
                   row = static_cast<double>(i / kColumns);
      const bool there = std::hypot(column - 150.0, row - 60.0) > 25.0 && random() < 0.99;
      const double hills = 300 * std::sin(column / 30) + 40 * random();
      heights_.push_back(there ? static_cast<float>(random() < 0.05 ? 77.0 : hills) : kNodata);
    }
  }

  double random() {
    seed_ = base::splitmix64(seed_);
    return base::unit_interval(seed_);
  }

  /// A tiled raster and a surface of it.
  struct Tiled {
    stream::Store store;
    TiledRaster raster;
    RasterTileSurface surface;

    explicit Tiled(const fs::path& path)
        : store(stream::Store::open(path)),
          raster(store, CoordinateSystem::of(store.schema().crs, "test").value(),
                 EllipsoidalHeights(store.schema(), HeightReference::ellipsoidal, "", 0), 2),
          surface(raster) {}
  };
  std::unique_ptr<Tiled> tiled(const std::string& name, std::uint64_t block_points = 3000) {
    stream::GeoTiffOptions tiff;
    tiff.columns = kColumns;
    tiff.rows = kRows;
    tiff.sample.name = "height";
    tiff.sample.type = stream::ScalarType::f32;
    tiff.world.xy = GetParam().world;
    tiff.nodata = static_cast<double>(kNodata);
    tiff.crs.epsg = GetParam().epsg;
    tiff.crs.geographic = GetParam().epsg == 4326;
    stream::GeoTiffWriter writer(folder_ / (name + ".tif"), tiff);
    writer.write_rows(std::as_bytes(std::span(heights_)));
    writer.commit();
    BuildRequest request;
    request.inputs = {(folder_ / (name + ".tif")).string()};
    request.store = folder_ / (name + ".terrace");
    request.block_points = block_points;
    build_store(request);
    return std::make_unique<Tiled>(request.store);
  }

  void fill(std::int64_t column, std::int64_t row, std::int64_t size, float height) {
    for (std::int64_t r = row; r < row + size; ++r) {
      for (std::int64_t c = column; c < column + size; ++c) {
        heights_[static_cast<std::size_t>(r * kColumns + c)] = height;
      }
    }
  }

  /// Returns a box of any size in and around the raster, sometimes far from it or all around the
  /// globe.
  GeographicBox box(const GeographicBox& bounds) {
    const double wide = bounds.east - bounds.west > 300.0 ? 4.0 : bounds.east - bounds.west;
    const double high = std::min(bounds.north - bounds.south, 4.0);
    double west = bounds.west + (1.4 * random() - 0.2) * (bounds.east - bounds.west);
    if (wide == 4.0) west = 180.0 + 8.0 * (random() - 0.5);
    const double south = bounds.south + (1.4 * random() - 0.2) * (bounds.north - bounds.south);
    const double share = std::exp2(-7.0 * random());
    GeographicBox box{west, south, west + share * wide, south + share * high};
    const double kind = random();
    if (kind < 0.05) box = {-180.01, -90.01, 0.01, 90.01};
    if (kind > 0.97) box = {box.west - 100.0, box.south, box.west - 99.5, box.north};
    if (kind > 0.95 && kind < 0.97) box.east += 30.0;
    return box;
  }

  /// Whether both give the same answers in the box, as far as they are compared.
  bool alike(Tiled& a, Tiled& b, const GeographicBox& box) {
    SurfaceSamples left, right;
    a.surface.samples(box, left);
    b.surface.samples(box, right);
    if (left.longitude != right.longitude || left.height != right.height) return false;
    const SurfacePart own = a.surface.part(box), other_part = b.surface.part(box);
    if (own.index() != other_part.index()) return false;
    const auto same = [](double p, double q) { return p == q || (std::isnan(p) && std::isnan(q)); };
    if (const auto* const lines = std::get_if<SurfaceRows>(&own)) {
      const auto& others = std::get<SurfaceRows>(other_part);
      if (lines->longitude != others.longitude || lines->latitude != others.latitude ||
          !std::equal(lines->height.begin(), lines->height.end(), others.height.begin(),
                      others.height.end(), same)) {
        return false;
      }
    }
    for (int part = 0; part < 4; ++part) {
      const double x = random(), y = random();
      const GeographicBox inner{box.west + 0.5 * x * (box.east - box.west),
                                box.south + 0.5 * y * (box.north - box.south),
                                box.east - 0.3 * x * (box.east - box.west),
                                box.north - 0.3 * y * (box.north - box.south)};
      const auto p = a.surface.range(inner), q = b.surface.range(inner);
      if (p.has_value() != q.has_value()) return false;
      if (p && (p->low != q->low || p->high != q->high || p->certain != q->certain)) return false;
    }
    std::vector<double> longitude, latitude;
    for (int i = 0; i < 400; ++i) {
      longitude.push_back(box.west + random() * (box.east - box.west));
      latitude.push_back(box.south + random() * (box.north - box.south));
    }
    std::vector<double> high(longitude.size()), other(high);
    a.surface.heights(longitude, latitude, high);
    b.surface.heights(longitude, latitude, other);
    std::vector<std::uint8_t> wet(longitude.size()), damp(wet);
    a.surface.water(longitude, latitude, wet);
    b.surface.water(longitude, latitude, damp);
    return high == other && wet == damp;
  }

  std::uint64_t seed_ = 31;
  std::vector<float> heights_;
  tests::TemporaryFolder scratch_;
  const fs::path& folder_ = scratch_.path();
};

TEST_P(RasterDigest, EqualDigestsGiveEqualAnswers) {
  const auto before = tiled("before");
  fill(40, 30, 1, 700.0F);
  fill(100, 110, 9, 500.0F);
  fill(60, 130, 6, kNodata);
  fill(205, 80, 3, 410.0F);
  fill(140, 55, 4, 90.0F);
  const auto after = tiled("after");
  int equal = 0, changed = 0, needless = 0;
  for (int round = 0; round < 500; ++round) {
    const GeographicBox asked = box(before->raster.places.bounds());
    SCOPED_TRACE(testing::Message() << "round " << round << ": " << asked.west << "," << asked.south
                                    << " " << asked.east << "," << asked.north);
    const bool same = before->surface.digest(asked) == after->surface.digest(asked);
    const bool right = alike(*before, *after, asked);
    EXPECT_TRUE(right || !same);
    ++(same ? equal : right ? needless : changed);
  }
  EXPECT_GT(equal, 60);
  EXPECT_GT(changed, 20);
  // The outline matters some way beyond the data.
  EXPECT_GT(equal, needless / 4);
}

TEST_P(RasterDigest, DependsOnClustersOnlyThroughFill) {
  const auto one = tiled("one"), other = tiled("other", 700);
  one->raster.flat_fill = other->raster.flat_fill = 12.0;
  for (int round = 0; round < 100; ++round) {
    const GeographicBox asked = box(one->raster.places.bounds());
    EXPECT_EQ(one->surface.digest(asked), other->surface.digest(asked));
  }
}

TEST_P(RasterDigest, DependsOnSurfaceOptions) {
  const auto one = tiled("one");
  const GeographicBox all = one->raster.places.bounds();
  const std::uint64_t plain = one->surface.digest(all);
  one->raster.flat_fill = 12.0;
  const std::uint64_t flat = one->surface.digest(all);
  one->raster.flat_fill = 13.0;
  const std::uint64_t higher = one->surface.digest(all);
  one->raster.water_height = 0.0;
  EXPECT_NE(plain, flat);
  EXPECT_NE(flat, higher);
  EXPECT_NE(higher, one->surface.digest(all));
}

// Masks are computed part by part, so they may differ from single places if a place is between two
// samples.
TEST_P(RasterDigest, MasksMatchSinglePlaces) {
  const auto one = tiled("one");
  for (const std::optional<double>& height :
       {std::optional<double>{}, std::optional<double>{77.0}}) {
    one->raster.water_height = height;
    int cells = 0, wet = 0, other = 0;
    for (int round = 0; round < 40; ++round) {
      const GeographicBox asked = box(one->raster.places.bounds());
      constexpr std::size_t kSide = 48;
      std::vector<double> longitude, latitude;
      for (std::size_t i = 0; i < kSide * kSide; ++i) {
        longitude.push_back(asked.west + (asked.east - asked.west) *
                                             (static_cast<double>(i % kSide) + 0.5) / kSide);
        latitude.push_back(asked.north - (asked.north - asked.south) *
                                             (static_cast<double>(i / kSide) + 0.5) / kSide);
      }
      std::vector<std::uint8_t> mask(longitude.size()), single(mask);
      one->surface.water(longitude, latitude, mask);
      // No longer in rows and columns.
      std::reverse(longitude.begin() + 1, longitude.end());
      std::reverse(latitude.begin() + 1, latitude.end());
      one->surface.water(longitude, latitude, single);
      std::reverse(single.begin() + 1, single.end());
      for (std::size_t i = 0; i < mask.size(); ++i) {
        ++cells;
        wet += mask[i];
        other += mask[i] != single[i] ? 1 : 0;
      }
    }
    EXPECT_LE(other, cells / 500);
    if (!height) {
      EXPECT_GT(wet, cells / 20);
      EXPECT_LT(wet, cells);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Frames, RasterDigest,
    testing::Values(Frame{"degrees", 4326, {0.001, 0, 10.13, 0, -0.001, 46.71}},
                    Frame{"beyond180", 4326, {0.001, 0, 179.9, 0, -0.001, -16.2}},
                    Frame{"globe", 4326, {360.0 / 210, 0, -180.0, 0, -1.0, 80.0}},
                    Frame{"turned", 4326, {0.0008, 0.0006, 10.13, 0.0006, -0.0008, 46.71}},
                    Frame{"utm", 32632, {90, 0, 652000, 0, -90, 5210000}},
                    Frame{"utm60", 32660, {90, 0, 820000, 0, -90, 5210000}},
                    Frame{"polar", 3413, {900, 0, -90000, 0, -900, 70000}},
                    Frame{"wide", 3035, {9000, 0, 3300000, 0, -9000, 3900000}}),
    [](const auto& frame) { return std::string(frame.param.name); });

}  // namespace
}  // namespace terrace::terrain
