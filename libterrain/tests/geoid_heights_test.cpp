// SPDX-License-Identifier: Apache-2.0
#include "earth/geoid_heights.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "temporary_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;

class GeoidTest : public testing::Test {
 protected:
  /// Writes a grid in GeographicLib's format, with a spacing of 5 degrees and heights of 20
  /// sin(latitude) + 50, which is smooth, so the interpolation's error is small.
  std::string write_grid(const std::string& name) const {
    constexpr int kWidth = 72, kHeight = 37;
    const std::string file = (folder_ / name).string();
    std::ofstream out(file, std::ios::binary);
    out << "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n"
        << "# Description test\n# DateTime 2020-01-01 00:00:00\n# MaxBilinearError 0.1\n"
        << "# RMSBilinearError 0.1\n# MaxCubicError 0.1\n# RMSCubicError 0.1\n"
        << "# Offset -100\n# Scale 0.003\n"
        << kWidth << ' ' << kHeight << "\n65535\n";
    for (int row = 0; row < kHeight; ++row) {
      const double height = undulation(90.0 - 5.0 * row);
      const auto raw = static_cast<unsigned>(std::lround((height + 100) / 0.003));
      for (int column = 0; column < kWidth; ++column) {
        out.put(static_cast<char>(raw >> 8));
        out.put(static_cast<char>(raw & 255));
      }
    }
    return file;
  }
  static double undulation(double latitude) {
    return 50 + 20 * std::sin(latitude * 3.14159265358979 / 180);
  }

  tests::TemporaryFolder scratch_;
  const std::filesystem::path& folder_ = scratch_.path();
};

TEST_F(GeoidTest, InterpolatesTheGrid) {
  const GeoidGrid geoid(write_grid("test.pgm"), kMemory);
  for (double latitude = -80; latitude <= 80; latitude += 3.7) {
    for (double longitude = -180; longitude < 360; longitude += 31) {
      EXPECT_NEAR(geoid.undulation({longitude, latitude}), undulation(latitude), 0.01);
    }
  }
  EXPECT_TRUE(std::isnan(geoid.undulation({NAN, 10})));
}

TEST_F(GeoidTest, RejectsInvalidGrids) {
  const std::string file = write_grid("good.pgm");
  EXPECT_THROW(GeoidGrid((folder_ / "none.pgm").string(), kMemory), stream::Error);
  EXPECT_THROW(GeoidGrid((folder_ / "good.tif").string(), kMemory), stream::Error);
  EXPECT_THROW(GeoidGrid(file, 100), stream::Error);
  std::filesystem::resize_file(file, 2000);
  EXPECT_THROW(GeoidGrid(file, kMemory), stream::Error);
  std::ofstream(folder_ / "text.pgm") << "hello";
  EXPECT_THROW(GeoidGrid((folder_ / "text.pgm").string(), kMemory), stream::Error);
}

stream::StoreSchema schema_with(const std::string& vertical, const std::string& unit) {
  stream::StoreSchema schema;
  schema.vertical = vertical;
  schema.coordinates[2].unit = unit;
  return schema;
}

double converted(const EllipsoidalHeights& heights, const Point2& place, double height) {
  heights.convert(std::span(&place, 1), std::span(&height, 1));
  return height;
}

TEST_F(GeoidTest, ConvertsToEllipsoidalMetres) {
  const std::string file = write_grid("test.pgm");
  const EllipsoidalHeights plain(schema_with("ellipsoidal", "metre"), HeightReference::recorded, "",
                                 kMemory);
  EXPECT_EQ(converted(plain, {8, 47}, 500), 500);
  EXPECT_EQ(plain.note(), "");
  const EllipsoidalHeights feet(schema_with("orthometric", "foot"), HeightReference::recorded, file,
                                kMemory);
  EXPECT_NEAR(converted(feet, {8, 45}, 1000), 304.8 + undulation(45), 0.01);
  EXPECT_TRUE(feet.has_geoid());
  const EllipsoidalHeights ignored(schema_with("orthometric", "metre"), HeightReference::ignore, "",
                                   kMemory);
  EXPECT_EQ(converted(ignored, {8, 47}, 500), 500);
  EXPECT_NE(ignored.note(), "");
  const EllipsoidalHeights said(schema_with("", "metre"), HeightReference::ellipsoidal, "",
                                kMemory);
  EXPECT_EQ(converted(said, {8, 47}, 500), 500);
  const EllipsoidalHeights unknown(schema_with("", ""), HeightReference::recorded, file, kMemory);
  EXPECT_NE(unknown.note().find("unit"), std::string::npos);
  EXPECT_NE(unknown.note().find("orthometric"), std::string::npos);
}

TEST_F(GeoidTest, DigestDependsOnOperation) {
  const auto digest_of = [](HeightReference vertical, const std::string& geoid) {
    Digest digest;
    EllipsoidalHeights(schema_with("orthometric", "metre"), vertical, geoid, kMemory)
        .add_to(digest);
    return digest.value();
  };
  const std::uint64_t egm96 = digest_of(HeightReference::orthometric, "");
  EXPECT_EQ(egm96, digest_of(HeightReference::orthometric, ""));
  EXPECT_NE(egm96, digest_of(HeightReference::recorded, write_grid("test.pgm")));
  EXPECT_NE(egm96, digest_of(HeightReference::ignore, ""));
}

TEST_F(GeoidTest, RejectsMissingAndContradictoryOptions) {
  const std::string file = write_grid("test.pgm");
  const auto refused = [](const stream::StoreSchema& schema, HeightReference vertical,
                          const std::string& geoid) {
    EXPECT_THROW(EllipsoidalHeights(schema, vertical, geoid, kMemory), UsageError);
  };
  refused(schema_with("orthometric", "metre"), HeightReference::recorded, "");
  refused(schema_with("", "metre"), HeightReference::recorded, "");
  refused(schema_with("ellipsoidal", "metre"), HeightReference::recorded, file);
  refused(schema_with("orthometric", "metre"), HeightReference::ignore, file);
}

// The heights of EGM96 in its 15' grid, as computed by cs2cs of PROJ 9.1.1.
TEST(EllipsoidalHeightsTest, DefaultsToProjGridOfEgm96) {
  const EllipsoidalHeights sea(schema_with("", "metre"), HeightReference::orthometric, "", kMemory);
  EXPECT_TRUE(sea.has_geoid());
  EXPECT_NEAR(converted(sea, {8, 46}, 1000), 1051.852947, 1e-5);
  EXPECT_NE(sea.note().find("EGM96"), std::string::npos) << sea.note();
  const EllipsoidalHeights feet(schema_with("orthometric", "foot"), HeightReference::orthometric,
                                "", kMemory);
  EXPECT_NEAR(converted(feet, {8, 46}, 1000), 304.8 + 51.852947, 1e-5);
  EXPECT_THROW(EllipsoidalHeights(schema_with("ellipsoidal", "metre"), HeightReference::orthometric,
                                  "", kMemory),
               UsageError);
}

TEST(EllipsoidalHeightsTest, BatchesMatchSinglePlaces) {
  const EllipsoidalHeights sea(schema_with("", "metre"), HeightReference::orthometric, "", kMemory);
  constexpr int kSide = 120;
  for (const double step : {1.0 / 1200, 0.02, 1.5}) {
    std::vector<Point2> places;
    for (int i = 0; i < kSide * kSide; ++i) {
      places.push_back({7.93 + i % kSide * step, -89.0 + i / kSide * step});
    }
    std::vector<double> heights(places.size(), 100.0);
    sea.convert(places, heights);
    for (std::size_t i = 0; i < places.size(); ++i) {
      EXPECT_NEAR(heights[i], converted(sea, places[i], 100.0), EllipsoidalHeights::kTolerance)
          << places[i][0] << "," << places[i][1];
    }
  }
}

TEST(EllipsoidalHeightsTest, StoresVerticalCrsOverridesDefault) {
  stream::StoreSchema schema = schema_with("orthometric", "metre");
  schema.crs.vertical_epsg = 5773;
  EXPECT_NEAR(
      converted(EllipsoidalHeights(schema, HeightReference::orthometric, "", kMemory), {8, 46}, 0),
      51.852947, 1e-5);
  // Debian has no grid of EGM2008; other systems may.
  schema.crs.vertical_epsg = 3855;
  try {
    const EllipsoidalHeights egm2008(schema, HeightReference::orthometric, "", kMemory);
    EXPECT_NE(egm2008.note().find("EGM2008"), std::string::npos);
  } catch (const stream::Error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("us_nga_egm08_25.tif"), std::string::npos) << what;
    EXPECT_NE(what.find("`geoid`"), std::string::npos) << what;
  }
}

TEST(EllipsoidalHeightsTest, UsesGroundsAssumptionForUnknownUnit) {
  stream::StoreSchema schema;
  schema.vertical = "ellipsoidal";
  schema.crs.horizontal_unit = "foot";
  const EllipsoidalHeights feet(schema, {}, {}, kMemory);
  EXPECT_EQ(feet.metres_per_unit(), 0.3048);
  EXPECT_NE(feet.note().find("that of x and y"), std::string::npos) << feet.note();
  schema.crs.horizontal_unit = "metre";
  EXPECT_EQ(EllipsoidalHeights(schema, {}, {}, kMemory).metres_per_unit(), 1.0);
  schema.coordinates[2].unit = "foot";
  EXPECT_EQ(EllipsoidalHeights(schema, {}, {}, kMemory).metres_per_unit(), 0.3048);
}

}  // namespace
}  // namespace terrace::terrain
