// SPDX-License-Identifier: Apache-2.0 Files next to a raster: world files and FILE.aux.xml,
// compared with GDAL.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "gdal_tools.hpp"
#include "point_files.hpp"
#include "temp_folder.hpp"
#include "tiff_writing.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

class Sidecars : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }
  std::string put(const std::string& name, const std::string& text) const {
    return write_text(path(name), text);
  }
  /// Heights 1 to 9 in 3 x 3 cells, without georeferencing, nodata value or CRS.
  void put_plain() const {
    write_tiff(path("a.tif"), small(), samples());
    put("b.hdr", "ncols 3\nnrows 3\nnbits 16\npixeltype unsignedint\nbyteorder I\n");
    std::string raw;
    for (char i = 1; i <= 9; ++i) raw += std::string{i, '\0'};
    put("b.bil", raw);
    put("g.asc", "ncols 3\nnrows 3\nxllcorner 1\nyllcorner 2\ncellsize 2\n1 2 3 4 5 6 7 8 9\n");
    put("h.asc",
        "ncols 3\nnrows 3\nxllcorner 1\nyllcorner 2\ncellsize 2\nNODATA_value 4\n"
        "1 2 3 4 5 6 7 8 9\n");
  }
  /// The same with georeferencing, nodata value and CRS that differ from the sidecar's.
  void put_full() const {
    const auto place = placed_at(100, 200, 10);
    TiffSpec spec = small();
    spec.more = [&](TIFF* tiff) {
      place(tiff);
      const std::array<std::uint16_t, 16> keys{1,    1, 0, 3, 1024, 0, 1, 1,
                                               1025, 0, 1, 1, 3072, 0, 1, 32632};
      TIFFSetField(tiff, 34735, static_cast<int>(keys.size()), keys.data());
      TIFFSetField(tiff, 42113, "4");
      TIFFSetField(tiff, 42112,
                   "<GDALMetadata><Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1</Item>"
                   "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">2</Item></GDALMetadata>");
    };
    write_tiff(path("f.tif"), spec, samples());
  }
  [[nodiscard]] static TiffSpec small() {
    TiffSpec spec;
    spec.columns = spec.rows = 3;
    spec.type = ScalarType::u16;
    return spec;
  }
  [[nodiscard]] static std::vector<std::byte> samples() {
    return as_samples(std::vector<std::uint16_t>{1, 2, 3, 4, 5, 6, 7, 8, 9});
  }
  static void expect_as_gdal(const std::string& file) {
    SCOPED_TRACE(file);
    const nlohmann::json gdal = gdalinfo(file);
    const SourceInfo info = read_file(file).info;
    const std::vector<double> place =
        gdal.value("geoTransform", std::vector<double>{0.5, 1, 0, 0.5, 0, -1});
    const std::array<double, 6> world{place[1], place[2], place[0] + (place[1] + place[2]) / 2,
                                      place[4], place[5], place[3] + (place[4] + place[5]) / 2};
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(info.world.xy[i], world[i], 1e-9) << i;
    const nlohmann::json& band = gdal["bands"][0];
    if (band.contains("noDataValue")) {
      ASSERT_TRUE(info.nodata.has_value());
      EXPECT_EQ(*info.nodata, band["noDataValue"].get<double>());
    }
    EXPECT_EQ(info.coordinates[2].scale, band.value("scale", 1.0));
    EXPECT_EQ(info.coordinates[2].offset, band.value("offset", 0.0));
    EXPECT_EQ(info.coordinates[2].unit, band.value("unit", "") == "ft" ? "foot" : "");
  }
  void remove(const std::string& name) const { fs::remove(path(name)); }

  TempFolder folder_;
};

TEST_F(Sidecars, WorldFilesGeoreferenceRastersThatAreNot) {
  if (!has_gdal()) GTEST_SKIP() << "no GDAL here";
  put_plain();
  ASSERT_EQ(std::system(("cd '" + path("") +
                         "' && gdal_translate -q -of PNG a.tif c.png && rm -f c.png.aux.xml && "
                         "cp a.tif d.tiff")
                            .c_str()),
            0);
  for (const auto& [file, endings] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"a.tif", {"tfw", "tifw", "wld", "TFW", "WLD"}},
           {"d.tiff", {"tfw", "tiffw", "wld"}},
           {"b.bil", {"blw", "bilw", "wld"}},
           {"c.png", {"pgw", "pngw", "wld", "PGW"}}}) {
    EXPECT_EQ(read_file(path(file)).info.world.xy, (std::array<double, 6>{1, 0, 0, 0, -1, 0}));
    for (const std::string& ending : endings) {
      const std::string name = file.substr(0, 2) + ending;
      for (const char* const numbers :
           {"10\n0\n0\n-10\n500005\n5200025\n", "8.66 \r\n5\r\n5\r\n-8.66\r\n1\r\n2",
            "0\n3\n-2\n0\n1\n2\n\n"}) {
        put(name, numbers);
        expect_as_gdal(path(file));
      }
      remove(name);
    }
  }
}

TEST_F(Sidecars, InternalGeoreferencingOverridesAWorldFile) {
  put_full();
  const std::array<double, 6> embedded{10, 0, 105, 0, -10, 195};
  put("f.tfw", "10\n0\n0\n-10\n105.0001\n195\n");
  EXPECT_EQ(read_file(path("f.tif")).info.world.xy, embedded);
  EXPECT_EQ(read_file(path("f.tif")).info.note, "");
  put("f.tfw", "10\n0\n0\n-10\n115\n195\n");
  EXPECT_EQ(read_file(path("f.tif")).info.world.xy, embedded);
  EXPECT_NE(read_file(path("f.tif")).info.note.find("f.tfw is ignored"), std::string::npos);
  // One that is ignored may be damaged.
  put("f.tfw", "10\n");
  EXPECT_EQ(read_file(path("f.tif")).info.world.xy, embedded);
}

TEST_F(Sidecars, RejectsADamagedWorldFileThatIsNeeded) {
  put_plain();
  for (const char* const text :
       {"", "1\n0\n0\n-1\n5\n", "1\n0\n0\n-1\n5\nx\n", "1\n0\n0\n-1\nnan\n5\n",
        "0\n0\n0\n0\n5\n5\n", "1\n1\n1\n1\n5\n5\n"}) {
    put("a.tfw", text);
    EXPECT_NE(error_of([&] { read_file(path("a.tif")); }).find("a.tfw"), std::string::npos) << text;
  }
  put("a.tfw", "1,5\n0\n0\n-1,5\n5\n5\n");
  EXPECT_EQ(read_file(path("a.tif")).info.world.xy[0], 1.5);
}

TEST_F(Sidecars, AWorldFileGeoreferencesARasterWithControlPoints) {
  TiffSpec spec = small();
  spec.more = [](TIFF* tiff) {
    const std::array<double, 12> ties{0, 0, 0, 1, 1, 0, 3, 3, 0, 5, 9, 0};
    TIFFSetField(tiff, 33922, 12, ties.data());
  };
  write_tiff(path("a.tif"), spec, samples());
  EXPECT_NE(error_of([&] { read_file(path("a.tif")); }).find("control points"), std::string::npos);
  put("a.tfw", "10\n0\n0\n-10\n5\n7\n");
  EXPECT_EQ(read_file(path("a.tif")).info.world.xy, (std::array<double, 6>{10, 0, 5, 0, -10, 7}));
}

constexpr char kPam[] =
    "<PAMDataset><SRS>EPSG:32633</SRS><GeoTransform> 1000,2,0,2000,0,-2</GeoTransform>"
    "<PAMRasterBand band=\"1\"><NoDataValue>5</NoDataValue><UnitType>ft</UnitType>"
    "<Offset>7</Offset><Scale>3</Scale></PAMRasterBand></PAMDataset>";

TEST_F(Sidecars, AuxXmlAppliesAsInGdal) {
  if (!has_gdal()) GTEST_SKIP() << "no GDAL here";
  put_plain();
  put_full();
  for (const char* const name : {"a.tif", "f.tif", "b.bil", "g.asc", "h.asc"}) {
    put(std::string(name) + ".aux.xml", kPam);
    expect_as_gdal(path(name));
  }
  // A world file overrides the sidecar of all but a GeoTIFF.
  put("b.wld", "10\n0\n0\n-10\n5\n7\n");
  put("a.wld", "10\n0\n0\n-10\n5\n7\n");
  expect_as_gdal(path("b.bil"));
  expect_as_gdal(path("a.tif"));
  EXPECT_EQ(read_file(path("f.tif")).info.crs.epsg, 32633);
  EXPECT_EQ(read_file(path("b.bil")).info.crs.epsg, 32633);
}

TEST_F(Sidecars, NodataOfAuxXmlOverridesThatOfAGeoTiff) {
  put_full();
  EXPECT_EQ(read_file(path("f.tif")).points.size(), 8U);
  put("f.tif.aux.xml", kPam);
  const AllPoints all = read_file(path("f.tif"));
  std::vector<double> heights;
  for (const Point3& p : all.points.positions) heights.push_back(p[2]);
  std::sort(heights.begin(), heights.end());
  EXPECT_EQ(heights, (std::vector<double>{1, 2, 3, 4, 6, 7, 8, 9}));
  // Notes name all differences.
  for (const char* const words : {"its nodata value overrides", "its georeferencing overrides",
                                  "its CRS overrides", "its scale is ignored"}) {
    EXPECT_NE(all.info.note.find(words), std::string::npos) << words << ": " << all.info.note;
  }
  put("f.tif.aux.xml",
      "<PAMDataset><SRS>EPSG:32632</SRS><GeoTransform>100,10,0,200,0,-10</GeoTransform>"
      "<PAMRasterBand band='1'><NoDataValue>4</NoDataValue><Offset>1</Offset><Scale>2</Scale>"
      "</PAMRasterBand></PAMDataset>");
  EXPECT_EQ(read_file(path("f.tif")).info.note, "");
  EXPECT_EQ(read_file(path("f.tif")).points.size(), 8U);
}

TEST_F(Sidecars, OtherFormatsOverrideAuxXml) {
  put_plain();
  put("h.asc.aux.xml", kPam);
  const AllPoints all = read_file(path("h.asc"));
  EXPECT_EQ(all.points.size(), 8U);
  EXPECT_EQ(all.info.nodata, 4);
  EXPECT_NE(all.info.note.find("its nodata value is ignored"), std::string::npos) << all.info.note;
  EXPECT_NE(all.info.note.find("the file has its own"), std::string::npos) << all.info.note;
  // Values that the file lacks are added without a note.
  put("g.asc.aux.xml",
      "<PAMDataset><PAMRasterBand band='1'><NoDataValue>5</NoDataValue>"
      "</PAMRasterBand></PAMDataset>");
  EXPECT_EQ(read_file(path("g.asc")).points.size(), 8U);
  EXPECT_EQ(read_file(path("g.asc")).info.note, "");
  // A virtual raster's sidecar is ignored.
  put("v.vrt",
      "<VRTDataset rasterXSize='3' rasterYSize='3'><VRTRasterBand dataType='UInt16' band='1'>"
      "<SimpleSource><SourceFilename relativeToVRT='1'>a.tif</SourceFilename></SimpleSource>"
      "</VRTRasterBand></VRTDataset>");
  put("v.vrt.aux.xml", kPam);
  EXPECT_EQ(read_file(path("v.vrt")).points.size(), 9U);
  EXPECT_EQ(read_file(path("v.vrt")).info.coordinates[2].scale, 1);
}

}  // namespace
}  // namespace terrace::stream
