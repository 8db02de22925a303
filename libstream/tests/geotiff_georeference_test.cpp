// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "format/geotiff/georeference.hpp"
#include "format/geotiff/keys.hpp"
#include "gdal_tools.hpp"
#include "raster_testing.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/raster.hpp"
#include "tiff_writing.hpp"

namespace terrace::stream {
namespace {

RasterInfo info_with(const std::function<void(TIFF*)>& more) {
  const TempFolder folder;
  const std::string path = (folder.path() / "x.tif").string();
  TiffSpec spec;
  spec.columns = 4;
  spec.rows = 3;
  spec.more = more;
  write_tiff(path, spec, std::vector<std::byte>(24));
  return open_geotiff(path)->info();
}

void set_keys(TIFF* tiff, std::vector<std::uint16_t> keys, const char* ascii = nullptr) {
  std::vector<std::uint16_t> all{1, 1, 0, static_cast<std::uint16_t>(keys.size() / 4)};
  all.insert(all.end(), keys.begin(), keys.end());
  TIFFSetField(tiff, 34735, static_cast<int>(all.size()), all.data());
  if (ascii != nullptr) TIFFSetField(tiff, 34737, ascii);
}

TEST(GeoReference, PixelsAreAreasUnlessTheKeysSayPoints) {
  const auto place = placed_at(100, 200, 10);
  EXPECT_EQ(info_with(place).world, (WorldTransform{{10, 0, 105, 0, -10, 195}}));
  const auto point = [&](TIFF* tiff) {
    place(tiff);
    set_keys(tiff, {1025, 0, 1, 2});
  };
  EXPECT_EQ(info_with(point).world, (WorldTransform{{10, 0, 100, 0, -10, 200}}));
}

TEST(GeoReference, ReadsATiePointInsideTheRaster) {
  const auto set = [](TIFF* tiff) {
    const std::array<double, 3> scale{2, 4, 0};
    const std::array<double, 6> tie{3, 1, 0, 100, 200, 0};
    TIFFSetField(tiff, 33550, 3, scale.data());
    TIFFSetField(tiff, 33922, 6, tie.data());
  };
  EXPECT_EQ(info_with(set).world, (WorldTransform{{2, 0, 95, 0, -4, 202}}));
}

TEST(GeoReference, ReadsAMatrixWithRotation) {
  const auto set = [](TIFF* tiff) {
    const std::array<double, 16> m{2, 1, 0, 100, -1, 2, 0, 200, 0, 0, 0, 0, 0, 0, 0, 1};
    TIFFSetField(tiff, 34264, 16, m.data());
  };
  EXPECT_EQ(info_with(set).world, (WorldTransform{{2, 1, 101.5, -1, 2, 200.5}}));
}

TEST(GeoReference, IsAPlainGridWithoutGeoreferencing) {
  const RasterInfo info = info_with({});
  EXPECT_EQ(info.world, (WorldTransform{{1, 0, 0, 0, -1, 0}}));
  ASSERT_EQ(info.comments.size(), 1u);
  EXPECT_EQ(info.crs, Crs{});
}

TEST(GeoReference, RejectsControlPointsAndDegenerateTransforms) {
  EXPECT_THROW(info_with([](TIFF* tiff) {
                 const std::array<double, 12> ties{0, 0, 0, 1, 2, 0, 3, 3, 0, 5, 6, 0};
                 TIFFSetField(tiff, 33922, 12, ties.data());
               }),
               Error);
  EXPECT_THROW(info_with([](TIFF* tiff) {
                 const std::array<double, 16> m{1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
                 TIFFSetField(tiff, 34264, 16, m.data());
               }),
               Error);
  for (const double bad : {0.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(info_with(placed_at(0, 0, bad)), Error) << bad;
  }
}

TEST(GeoReference, ReadsProjectedAndVerticalKeys) {
  const RasterInfo info = info_with([](TIFF* tiff) {
    set_keys(tiff, {1024, 0,     1,    1, 1026, 34737, 6,    0, 2054, 0,    1,    9102, 3072, 0,
                    1,    32632, 3076, 0, 1,    9003,  4096, 0, 1,    5773, 4099, 0,    1,    9002},
             "UTM 32|");
  });
  EXPECT_EQ(info.crs.epsg, 32632);
  EXPECT_FALSE(info.crs.geographic);
  EXPECT_EQ(info.crs.name, "UTM 32");
  EXPECT_EQ(info.crs.horizontal_unit, "US survey foot");
  EXPECT_EQ(info.crs.vertical_epsg, 5773);
  EXPECT_EQ(info.crs.vertical_unit, "foot");
  EXPECT_EQ(info.sample.unit, "foot");
}

TEST(GeoReference, ReadsGeographicAndUserDefinedKeys) {
  const RasterInfo geographic = info_with([](TIFF* tiff) {
    set_keys(tiff, {1024, 0, 1, 2, 2048, 0, 1, 4326, 2054, 0, 1, 9102});
  });
  EXPECT_EQ(geographic.crs.epsg, 4326);
  EXPECT_TRUE(geographic.crs.geographic);
  EXPECT_EQ(geographic.crs.horizontal_unit, "degree");
  const RasterInfo own = info_with([](TIFF* tiff) {
    set_keys(tiff, {1024, 0, 1, 1, 3072, 0, 1, 32767, 3073, 34737, 8, 0}, "my grid|");
  });
  EXPECT_EQ(own.crs.epsg, 0);
  EXPECT_EQ(own.crs.name, "my grid");
  // GDAL writes projections without GeoKeys like this.
  const RasterInfo esri = info_with([](TIFF* tiff) {
    set_keys(tiff, {1024, 0, 1, 32767, 2048, 0, 1, 4326, 3073, 34737, 13, 0, 3076, 0, 1, 9001},
             "ESRI PE = X |");
  });
  EXPECT_FALSE(esri.crs.geographic);
  EXPECT_EQ(esri.crs.epsg, 0);
  EXPECT_EQ(esri.crs.name, "ESRI PE = X ");
  EXPECT_EQ(esri.crs.horizontal_unit, "metre");
  const RasterInfo site = info_with([](TIFF* tiff) {
    set_keys(tiff, {1026, 34737, 5, 0, 3076, 0, 1, 9003}, "site|");
  });
  EXPECT_EQ(site.crs.name, "site");
  EXPECT_EQ(site.crs.horizontal_unit, "US survey foot");
}

TEST(GeoReference, DeliversKeysOfTheCrsUnchanged) {
  const GeoKeys keys(
      std::vector<std::uint16_t>{1,    1,     0, 5, 1024, 0,     1, 1, 3072, 0,     1, 32767,
                                 3080, 34736, 1, 1, 3092, 34736, 1, 0, 3073, 34737, 4, 0},
      std::vector<double>{0.9996, 9.0}, "own|");
  const std::vector<GeoKey> geo_keys = crs_of(keys).geo_keys;
  ASSERT_EQ(geo_keys.size(), 5u);
  EXPECT_EQ(geo_keys[0], (GeoKey{1024, {1}, ""}));
  EXPECT_EQ(geo_keys[1], (GeoKey{3072, {32767}, ""}));
  EXPECT_EQ(geo_keys[2], (GeoKey{3073, {}, "own"}));
  EXPECT_EQ(geo_keys[3], (GeoKey{3080, {9.0}, ""}));
  EXPECT_EQ(geo_keys[4], (GeoKey{3092, {0.9996}, ""}));
  const GeoKeys cut(std::vector<std::uint16_t>{1, 1, 0, 1, 3080, 34736, 2, 1},
                    std::vector<double>{1.0, 2.0}, "");
  EXPECT_EQ(cut.faults().size(), 1u);
  EXPECT_TRUE(crs_of(cut).geo_keys.empty());
}

TEST(GeoReference, IgnoresKeysThatPointOutsideTheirArrays) {
  const GeoKeys keys(
      std::vector<std::uint16_t>{1, 1, 0, 500, 1026, 34737, 100, 0, 3072, 0, 1, 32632}, {},
      "short|");
  EXPECT_EQ(keys.text(1026), "");
  EXPECT_EQ(keys.number(3072), 32632);
  EXPECT_EQ(keys.faults().size(), 2u);
  EXPECT_EQ(GeoKeys(std::vector<std::uint16_t>{1, 1}, {}, "").faults().size(), 1u);
  EXPECT_TRUE(GeoKeys({}, {}, "").faults().empty());
}

TEST(GeoReference, ReadsScaleOffsetAndUnitOfABand) {
  const std::string xml =
      "<GDALMetadata>\n"
      "  <Item name=\"OFFSET\" sample=\"0\" role=\"offset\"> -100 </Item>\n"
      "  <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.25</Item>\n"
      "  <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">m</Item>\n"
      "  <Item name=\"SCALE\" sample=\"1\" role=\"scale\">7</Item>\n"
      "</GDALMetadata>";
  EXPECT_EQ(band_metadata(xml, 0).scale, 0.25);
  EXPECT_EQ(band_metadata(xml, 0).offset, -100);
  EXPECT_EQ(band_metadata(xml, 0).unit, "metre");
  EXPECT_EQ(band_metadata(xml, 1).scale, 7);
  EXPECT_EQ(band_metadata(xml, 1).offset, std::nullopt);
  // truncated anywhere
  for (std::size_t n = 0; n < xml.size(); ++n) band_metadata(xml.substr(0, n), 0);
  EXPECT_THROW(info_with([](TIFF* tiff) {
                 TIFFSetField(tiff, 42112,
                              "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">0</Item>");
               }),
               Error);
}

/// GDAL gives the outer corner of the first cell, we the position of its sample.
TEST(GeoReference, AgreesWithGdalOnRealFiles) {
  const auto folder = real_data();
  if (!folder) GTEST_SKIP() << "needs TERRACE_DATA";
  if (!has_gdal()) GTEST_SKIP() << "needs gdalinfo";
  std::size_t compared = 0, codes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder / "dem")) {
    const std::string path = entry.path().string();
    if (entry.path().extension() != ".tif" || path.find("hostile") != path.npos) continue;
    // A few of the many encodings of one place suffice: gdalinfo is slow.
    const std::string name = entry.path().filename().string();
    const bool alike = path.find("/encodings/") != path.npos || name.starts_with("float") ||
                       name.starts_with("uint") || name.starts_with("int") ||
                       name.starts_with("byte_");
    if (alike && name != "byte_point.tif" && name != "i16_scale_offset.tif") continue;
    SCOPED_TRACE(path);
    const nlohmann::json gdal = gdalinfo(path);
    ASSERT_FALSE(gdal.is_discarded());
    const RasterInfo info = open_geotiff(path)->info();
    EXPECT_EQ(gdal["size"][0], info.columns);
    EXPECT_EQ(gdal["size"][1], info.rows);
    if (gdal.contains("geoTransform")) {
      const auto g = gdal["geoTransform"].get<std::vector<double>>();
      const auto& m = info.world.xy;
      const double tolerance = 1e-9 * (std::abs(g[0]) + std::abs(g[3]) + std::abs(g[1]));
      EXPECT_NEAR(m[0], g[1], tolerance);
      EXPECT_NEAR(m[1], g[2], tolerance);
      EXPECT_NEAR(m[2], g[0] + 0.5 * (g[1] + g[2]), tolerance);
      EXPECT_NEAR(m[3], g[4], tolerance);
      EXPECT_NEAR(m[4], g[5], tolerance);
      EXPECT_NEAR(m[5], g[3] + 0.5 * (g[4] + g[5]), tolerance);
      ++compared;
    }
    if (gdal.contains("stac") && gdal["stac"].contains("proj:epsg") &&
        gdal["stac"]["proj:epsg"].is_number() && info.crs.epsg != 0) {
      EXPECT_EQ(gdal["stac"]["proj:epsg"], info.crs.epsg);
      ++codes;
    }
    const auto& band = gdal["bands"][0];
    EXPECT_EQ(band.value("scale", 1.0), info.sample.scale);
    EXPECT_EQ(band.value("offset", 0.0), info.sample.offset);
  }
  EXPECT_GT(compared, 30u);
  EXPECT_GT(codes, 15u);
}

}  // namespace
}  // namespace terrace::stream
