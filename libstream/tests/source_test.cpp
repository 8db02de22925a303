// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

const char* const kPly =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\n"
    "property double z\nend_header\n7 8 9\n";

class Source : public ::testing::Test {
 protected:
  std::string put(const std::string& name, std::string_view text) {
    return write_text(folder_.path() / name, text);
  }
  std::string refusal(const std::vector<std::string>& files, const SourceOptions& options = {}) {
    return error_of([&] { read_all(files, options); });
  }

  TempFolder folder_;
};

/// Redirects standard input or output for the lifetime of the object.
class Redirected {
 public:
  Redirected(int standard, int fd) : standard_(standard), saved_(dup(standard)) {
    dup2(fd, standard);
  }
  ~Redirected() {
    dup2(saved_, standard_);
    close(saved_);
  }
  Redirected(const Redirected&) = delete;
  Redirected& operator=(const Redirected&) = delete;

 private:
  int standard_, saved_;
};

TEST_F(Source, RecognisesFormatsByContentBeforeEnding) {
  EXPECT_EQ(read_all({put("a.txt", kPly)}).info.format, "ply");
  EXPECT_EQ(read_all({put("a.ply", "1 2 3\n")}).info.format, "xyz");
  EXPECT_EQ(read_all({put("noending", "1;2;3\n")}).info.format, "xyz");
  EXPECT_NE(refusal({put("b.PLY", "plx")}).find("does not begin with 'ply'"), std::string::npos);
  EXPECT_NE(refusal({put("c.csv", "hello, world\n")}).find("no points"), std::string::npos);
}

TEST_F(Source, ExpandsFoldersListsAndPatterns) {
  namespace fs = std::filesystem;
  fs::create_directories(folder_.path() / "survey" / "b");
  const std::string one = put("survey/1.xyz", "1 0 0\n"), two = put("survey/b/2.csv", "2 0 0\n"),
                    three = put("survey/z.XYZ", "3 0 0\n");
  put("survey/.hidden.xyz", "9 0 0\n");
  put("survey/notes.md", "none of ours");
  const std::string survey = (folder_.path() / "survey").string();
  const auto heads = [](const std::vector<std::string>& names, const SourceOptions& options = {}) {
    std::string out;
    for (const Point3& p : read_all(names, options).points.positions) {
      out += std::to_string(static_cast<int>(p[0]));
    }
    return out;
  };
  EXPECT_EQ(heads({survey}), "123");
  EXPECT_EQ(read_all({survey}).info.files, (std::vector<std::string>{one, two, three}));
  EXPECT_EQ(heads({survey + "/*.[xX]*"}), "13");
  EXPECT_EQ(heads({survey + "/?.xyz", two}), "12");
  const std::string list =
      put("survey/list.lst", "# of a survey\n\n  z.XYZ \r\nb\n" + one + "\n1*.xyz");
  // The last line names a file for the second time.
  EXPECT_EQ(heads({"@" + put("survey/short.lst", "# of a survey\n\n  z.XYZ \r\nb\n" + one)}),
            "321");
  EXPECT_EQ(heads({"@" + list}), "3211");

  // A name that exists is that file, whatever it looks like.
  put("survey/[1].xyz", "7 0 0\n");
  EXPECT_EQ(heads({survey + "/[1].xyz"}), "7");
  fs::remove(survey + "/[1].xyz");

  put("survey/cloud.ply", kPly);
  EXPECT_NE(refusal({survey}).find("is ply, but"), std::string::npos) << refusal({survey});
  EXPECT_EQ(heads({survey}, {.format = "xyz"}), "123");
  EXPECT_EQ(heads({survey}, {.format = "ply"}), "7");

  for (const auto& [name, words] : std::vector<std::pair<std::string, std::string>>{
           {survey + "/*.las", "no file matches"},
           {(folder_.path() / "survey" / "none.xyz").string(), "none.xyz"},
           {"@" + put("empty.lst", "# nothing\n"), "names no file"},
           {"@" + put("wrong.lst", "survey\nsurvey/none.xyz\n"), "line 2"},
           {"@" + put("nested.lst", "@other.lst\n"), "a list cannot contain lists"},
           {"@" + (folder_.path() / "none.lst").string(), "none.lst"}}) {
    EXPECT_NE(refusal({name}).find(words), std::string::npos) << refusal({name});
  }
  fs::create_directory(folder_.path() / "void");
  EXPECT_NE(refusal({(folder_.path() / "void").string()}).find("folder without a file"),
            std::string::npos);
  put("void/manifest.json", "{}");
  EXPECT_NE(refusal({(folder_.path() / "void").string()}).find("is a store, not a file of points"),
            std::string::npos);
}

TEST_F(Source, RejectsUnknownFormats) {
  const std::string prose = put("readme", "This is a text of 3 lines\nwith 1 2 3\nin it\n");
  EXPECT_NE(refusal({prose}).find("neither content nor name"), std::string::npos);
  EXPECT_NE(refusal({put("x.gtx", std::string(50, '\1'))}).find("gdal_translate"),
            std::string::npos);
  EXPECT_NE(refusal({put("empty", "")}).find("empty: the file is empty; download"),
            std::string::npos);
  EXPECT_NE(refusal({put("e.csv", "")}).find("e.csv: the file is empty"), std::string::npos);
  EXPECT_THROW(refusal({prose}, {.format = "lax"}), std::invalid_argument);
  EXPECT_NE(refusal({(folder_.path() / "none.xyz").string()}).find("No such file"),
            std::string::npos);
  EXPECT_NE(refusal({folder_.path().string()}).find("e.csv: the file is empty"), std::string::npos);
}

TEST_F(Source, NamesUnsupportedFormatsAndARemedy) {
  using std::string_literals::operator""s;
  std::string tar(512, '\0');
  tar.replace(257, 5, "ustar");
  std::string geopackage = "SQLite format 3" + std::string(85, '\0');
  geopackage.replace(68, 4, "GPKG");
  const std::vector<std::array<std::string, 3>> by_content{
      {"ASTM-E57\1\0"s, "is E57", "PLY"},
      {"# .PCD v0.7\nFIELDS x y z\n", "is PCD", "pcl_pcd2ply"},
      {"\x89HDF\r\n\x1a\n"s, "HDF5", "gdalinfo"},
      {"CDF\1"s, "NetCDF", "gdal_translate"},
      {"\0\0\0\x0cjP  \r\n"s, "JPEG 2000", "gdal_translate"},
      {"NITF02.10", "NITF", "gdal_translate"},
      {"binterr1.3", "VTP", "gdal_translate"},
      {"\0\0\x27\x0a\0\0\0\0"s, "shapefile", "ogr2ogr"},
      {geopackage, "GeoPackage", "gdal_translate"},
      {"\n<!DOCTYPE HTML>", "HTML", "download"},
      {"\xfd"
       "7zXZ\0"s,
       "by xz", "xz -dk"},
      {"\x28\xb5\x2f\xfd"s, "zstd", "zstd -d"},
      {"PK\3\4", "zip archive", "unzip"},
      {"7z\xbc\xaf\x27\x1c", "7z archive", "7z x"},
      {tar, "tar archive", "tar xf"},
      {"version https://git-lfs.github.com/spec/v1\n", "Git LFS", "git lfs pull"}};
  for (const auto& [content, name, remedy] : by_content) {
    // With any name.
    for (const char* file : {"a.tif", "b.xyz", "noending"}) {
      const std::string text = refusal({put(file, content)});
      EXPECT_NE(text.find(name), std::string::npos) << text;
      EXPECT_NE(text.find(remedy), std::string::npos) << text;
    }
  }
  const std::string binary("\1\2\3\4\0\0", 6);
  for (const auto& [file, name] :
       std::vector<std::pair<std::string, std::string>>{{"b.stl", "too short for STL"},
                                                        {"c.laz", "LASF"},
                                                        {"d.img", "ERDAS"},
                                                        {"e.gltf", "GLB"},
                                                        {"f.geojson", "GeoJSON"}}) {
    const std::string text = refusal({put(file, binary)});
    EXPECT_NE(text.find(name), std::string::npos) << text;
  }
  // A readable file is read whatever its name.
  EXPECT_EQ(read_all({put("h.laz", "1 2 3\n")}).info.format, "xyz");
}

TEST_F(Source, RefusesOptionsThatTheFormatDoesNotSupport) {
  const std::string file = put("a.xyz", "1 2 3\n");
  const auto expect_refusal = [&](const SourceOptions& options, const std::string& text) {
    EXPECT_NE(refusal({file}, options).find(text), std::string::npos) << refusal({file}, options);
  };
  expect_refusal({.cell = 1}, "xyz is not a raster format");
  expect_refusal({.band = 2},
                 "name a raster (geotiff, vrt, hgt, ascii-grid, usgs-dem, png, binary-grid)");
  expect_refusal({.heights_of_colour = HeightsOfColour::mapbox},
                 "name an image (png), or leave `heights_of_colour` out");
  expect_refusal({.selection = {.resolution = 1}},
                 "name a COPC file or EPT (las, ept), or leave `resolution` out");
  expect_refusal({.entities = Entities::triangles},
                 "name a mesh (ply, glb, obj, off, stl), or leave `entities` out");
  expect_refusal({.entities = Entities::polylines},
                 "name a file of lines (geojson), or leave `entities` out");
}

TEST_F(Source, ChainsFilesOfOneFormat) {
  const std::vector<std::string> files{put("1.xyz", "1 2 3 4\n5 6 7 8\n"), put("2.xyz", "9 9 9 9"),
                                       put("3.xyz", "# c\n0 0 0 0\n")};
  const AllPoints all = read_all(files);
  EXPECT_EQ(all.info.files, files);
  EXPECT_EQ(all.points.positions,
            (std::vector<Point3>{{1, 2, 3}, {5, 6, 7}, {9, 9, 9}, {0, 0, 0}}));
  EXPECT_EQ(all.values<double>(0)[3], 0.0);

  const std::string ply = put("a.ply", kPly);
  const AllPoints two = read_all({ply, ply});
  EXPECT_EQ(two.info.points, 2u);
  EXPECT_EQ(two.points.size(), 2u);
}

TEST_F(Source, ChainedFilesMustAgree) {
  const std::string three = put("3.xyz", "1 2 3\n"), four = put("4.xyz", "1 2 3 4\n");
  EXPECT_NE(refusal({three, four}).find("4.xyz: it has attributes that "), std::string::npos);
  EXPECT_NE(refusal({three, put("p.ply", kPly)}).find("p.ply: is ply, but "), std::string::npos);
  EXPECT_NE(refusal({three, put("g.csv", "lon,lat,height\n1,2,3\n")}).find("g.csv: "),
            std::string::npos);
  EXPECT_NE(refusal({"-", "-"}, {.format = "xyz"}).find("named twice"), std::string::npos);
}

TEST_F(Source, ChainedFilesMustAgreeOnlyInKeptAttributes) {
  const std::vector<std::string> files{put("a.csv", "x,y,z,a,b\n1,2,3,4,5\n"),
                                       put("b.csv", "x,y,z,c,a\n6,7,8,9,10\n"),
                                       put("c.csv", "x,y,z,b,a\n1,1,1,2,20\n")};
  EXPECT_NE(refusal(files).find("b.csv: it has the attributes float64 c where "),
            std::string::npos);
  const AllPoints swapped = read_all({files[0], files[2]});
  EXPECT_EQ(swapped.info.attributes[1].name, "b");
  EXPECT_EQ(swapped.values<double>(0)[1], 20.0);
  EXPECT_EQ(swapped.values<double>(1)[1], 2.0);
  for (const Selection& selection : {Selection{.keep = std::vector<std::string>{"a"}},
                                     Selection{.where = "a != 7", .drop = {"b", "c"}}}) {
    const AllPoints all = read_all(files, {.selection = selection});
    ASSERT_EQ(all.info.attributes.size(), 1u);
    EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1, 2, 3}, {6, 7, 8}, {1, 1, 1}}));
    EXPECT_EQ(all.values<double>(0)[0], 4.0);
    EXPECT_EQ(all.values<double>(0)[1], 10.0);
    EXPECT_EQ(all.values<double>(0)[2], 20.0);
  }
  EXPECT_NE(refusal(files, {.selection = {.where = "b > 0", .drop = {"b", "c"}}}).find("no 'b'"),
            std::string::npos);
  EXPECT_NE(refusal(files, {.selection = {.drop = {"b", "c", "d"}}}).find("no attribute 'd'"),
            std::string::npos);
}

TEST_F(Source, ReadsStandardInputAndPipes) {
  std::string text = "x,y,z,i\n";
  for (int i = 0; i < 50000; ++i) text += std::to_string(i) + ",1,2," + std::to_string(i) + "\n";
  for (const SourceOptions& options : {SourceOptions{}, SourceOptions{.format = "xyz"}}) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    std::thread writer([&] {
      for (std::string_view unwritten = text; !unwritten.empty();) {
        const ssize_t n =
            ::write(ends[1], unwritten.data(), std::min<std::size_t>(unwritten.size(), 777));
        if (n <= 0) break;
        unwritten.remove_prefix(static_cast<std::size_t>(n));
      }
      close(ends[1]);
    });
    {
      const Redirected input(STDIN_FILENO, ends[0]);
      const AllPoints all = read_all(std::vector<std::string>{"-"}, options);
      EXPECT_EQ(all.points.size(), 50000u);
      EXPECT_EQ(all.points.positions[49999][0], 49999.0);
      EXPECT_EQ(all.values<double>(0)[4097], 4097.0);
    }
    writer.join();
    close(ends[0]);
  }
  // A file as standard input, and a named pipe.
  const std::string file = put("f.csv", text);
  const int fd = open(file.c_str(), O_RDONLY);
  {
    const Redirected input(STDIN_FILENO, fd);
    EXPECT_EQ(read_all(std::vector<std::string>{"-"}).points.size(), 50000u);
  }
  close(fd);
  const std::string fifo = (folder_.path() / "fifo").string();
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::thread writer([&] { write_text(fifo, text); });
  EXPECT_EQ(read_all({file, fifo}).points.size(), 100000u);
  writer.join();
}

TEST_F(Source, TextGoesToStandardOutput) {
  PointBlock block;
  for (int i = 0; i < 20000; ++i) block.positions.push_back({1.0 * i, 0.5, -1});
  for (const std::string format : {"", "csv"}) {
    const auto path = folder_.path() / ("out" + format);
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
    std::fflush(stdout);
    {
      const Redirected output(STDOUT_FILENO, fd);
      const auto writer = open_point_writer("-", {}, {.format = format});
      writer->append(block);
      writer->finish();
    }
    close(fd);
    EXPECT_TRUE(same_bits(read_file(path).points.positions, block.positions));
  }
  EXPECT_NE(error_of([] { open_point_writer("-", {}, {.format = "ply"}); }).find("to a pipe"),
            std::string::npos);
  EXPECT_NE(error_of([&] {
              open_point_writer((folder_.path() / "p.tif").string(), {});
            }).find("known are xyz (.xyz, .txt), csv (.csv), ply (.ply), ply-ascii"),
            std::string::npos);
}

TEST_F(Source, DoesNotTrustCountsInAPipe) {
  // Nothing is known about the bytes to come, so no memory may be allocated for them.
  const std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000000000\n"
      "property double x\nproperty double y\nproperty double z\nend_header\n" +
      std::string(48, '\0');
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  const Redirected input(STDIN_FILENO, ends[0]);
  close(ends[0]);
  const std::string error = refusal({"-"});
  EXPECT_NE(error.find("standard input: byte"), std::string::npos) << error;
  EXPECT_NE(error.find("ends in item 2 of element 'vertex'"), std::string::npos) << error;
}

TEST_F(Source, TheCallersCrsOverridesThatOfTheFiles) {
  Crs crs;
  crs.epsg = 32632;
  const AllPoints all = read_all({put("g.csv", "lon,lat,height\n1,2,3\n")}, {.crs = crs});
  EXPECT_EQ(all.info.crs, crs);
}

TEST(ToWorld, AppliesTheTransformAndTheScaleOfHeights) {
  SourceInfo info;
  info.world.xy = {2, 1, 100, 0, -3, 200};
  info.coordinates[2].scale = 0.5;
  info.coordinates[2].offset = -1;
  PointBlock block;
  block.positions = {{1, 2, 3}, {0, 0, 0}};
  to_world(info, block);
  EXPECT_EQ(block.positions, (std::vector<Point3>{{104, 194, 0.5}, {100, 200, -1}}));
}

TEST(ToWorld, LeavesPointsWithoutTransformBitForBit) {
  PointBlock block;
  block.positions = {{-0.0, 1e308, 5e-324}, {1, -0.0, -0.0}};
  const auto before = block.positions;
  to_world({}, block);
  EXPECT_TRUE(same_bits(block.positions, before));
}

TEST(OpenSource, RejectsMissingNamesAndEmptyBlocks) {
  EXPECT_THROW((void)open_source({}), std::invalid_argument);
  SourceOptions options;
  options.block_points = 0;
  EXPECT_THROW((void)open_source(std::vector<std::string>{"points.xyz"}, options),
               std::invalid_argument);
}

TEST(Formats, HaveNamesReadersAndDistinctEndings) {
  std::vector<std::string> names, endings;
  for (const Format& format : formats()) {
    names.push_back(format.name);
    endings.insert(endings.end(), format.endings.begin(), format.endings.end());
    EXPECT_NE(format.recognise, nullptr);
    EXPECT_NE(format.open, nullptr);
    EXPECT_FALSE(format.recognise({})) << format.name;
  }
  for (auto* list : {&names, &endings}) {
    std::sort(list->begin(), list->end());
    EXPECT_EQ(std::adjacent_find(list->begin(), list->end()), list->end());
  }
  EXPECT_NE(std::find(names.begin(), names.end(), "ply"), names.end());
}

}  // namespace
}  // namespace terrace::stream
