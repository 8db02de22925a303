// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/output_kinds.hpp"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

void expect_refused(const OutputKind& kind, const std::string& path, const std::string& format,
                    const std::string& words) {
  try {
    check_output_name(kind, path, format);
    ADD_FAILURE() << path << " " << format;
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

TEST(OutputKinds, EndingSelectsFormat) {
  EXPECT_EQ(format_of_output(outputs::kPointFile, "a.b/x.TXT"), "xyz");
  EXPECT_EQ(format_of_output(outputs::kPointFile, "x.csv"), "csv");
  EXPECT_EQ(format_of_output(outputs::kPointOrLineFile, "x.geojson"), "geojson");
  EXPECT_EQ(format_of_output(outputs::kRasterFile, "x.tiff"), "tif");
  EXPECT_EQ(format_of_output(outputs::kRasterFile, "x"), "tif");
  EXPECT_EQ(format_of_output(outputs::kContourFile, "-"), "geojson");
}

TEST(OutputKinds, RejectsOtherFormatsAndListsChoices) {
  expect_refused(outputs::kRasterFile, "x.png", {}, "ends in .tif or .tiff");
  expect_refused(outputs::kPictureFile, "x.jpg", {}, "ends in .png");
  expect_refused(outputs::kContourFile, "c.gpkg", {}, "ends in .geojson or .json");
  expect_refused(outputs::kMeshFile, "m.stl", {}, "ends in .ply, .obj or .glb");
  expect_refused(outputs::kMeshFile, "m", {}, "has no ending");
  expect_refused(outputs::kPointFile, "p.geojson", {}, ".copc.laz");
  expect_refused(outputs::kLabelFile, "l.png", {}, "cannot be written as .png");
  expect_refused(outputs::kStore, "s.LAS", {}, "name a folder");
  expect_refused(outputs::kTileSet, "t.mbtiles", {}, "name a folder");
  expect_refused(outputs::kRasterFile, "-", {}, "standard output");
}

TEST(OutputKinds, FreeNamesAllowUnknownEndings) {
  for (const char* name : {"s", "s.terrace", "s.v2", "s.2024-11", ".s"}) {
    EXPECT_NO_THROW(check_output_name(outputs::kStore, name)) << name;
    EXPECT_NO_THROW(check_output_name(outputs::kOverlayFile, name)) << name;
  }
}

TEST(OutputKinds, RejectsInputsOfOtherFormats) {
  for (const char* name : {"-", "places", "places.dat", "p.CSV", "/dev/stdin"}) {
    EXPECT_NO_THROW(check_input_name(outputs::kPlaceTable, name)) << name;
  }
  EXPECT_THROW(check_input_name(outputs::kPlaceTable, "p.geojson"), UsageError);
}

TEST(OutputKinds, FormatMustMatchEnding) {
  EXPECT_EQ(format_of_output(outputs::kPointFile, "x.dat", "csv"), "csv");
  EXPECT_EQ(format_of_output(outputs::kPointFile, "x.txt", "csv"), "csv");
  EXPECT_EQ(format_of_output(outputs::kMeshFile, "x.ply", "ply-ascii"), "ply-ascii");
  expect_refused(outputs::kPointFile, "x.las", "csv", "`output_format` csv");
  expect_refused(outputs::kPointFile, "x.xyz", "foo", "can be xyz, csv");
}

}  // namespace
}  // namespace terrace::terrain
