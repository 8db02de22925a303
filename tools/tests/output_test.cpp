// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/output.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/xattr.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/geotiff_writer.hpp"
#include "terrace/stream/mesh_writer.hpp"
#include "terrace/stream/png.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

namespace fs = std::filesystem;

class MayReplace : public ::testing::Test {
 protected:
  void write(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  [[nodiscard]] std::string text() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void expect_ours(const std::string& what) const {
    EXPECT_NO_THROW(EXPECT_TRUE(may_replace(path_, true).replace)) << what;
  }
  void expect_foreign(const std::string& what) const {
    EXPECT_THROW(may_replace(path_, true), stream::Error) << what;
  }
  /// Expects that the file counts as ours, and no longer does once its mark is misspelt, even if
  /// the word occurs elsewhere.
  void expect_ours_by_mark(const std::string& mark, const std::string& what) const {
    expect_ours(what);
    std::string bytes = text();
    const std::size_t at = bytes.find(mark);
    ASSERT_NE(at, std::string::npos) << what;
    bytes[at + mark.size() - 1] ^= 1;
    write(bytes + " terrace, written by terrace\n# written by terrace\n");
    expect_foreign(what);
  }
  void write_points(const std::string& format,
                    std::vector<std::string> comments = {kWriterMark}) const {
    const auto writer = stream::open_point_writer(
        path_,
        {.attributes = {{.name = "small", .type = stream::ScalarType::f32},
                        {.name = "large", .type = stream::ScalarType::u64}},
         .comments = std::move(comments)},
        {.format = format, .replace = true});
    const std::vector<float> small{0.1F, 16777217000.0F, std::numeric_limits<float>::denorm_min(),
                                   -0.0F, std::numeric_limits<float>::max()};
    const std::vector<std::uint64_t> large{0, 9007199254740993, ~std::uint64_t{0}, 7, 10};
    stream::PointBlock block;
    block.positions = {{0, -0.0, 1e300}, {0.1, 1.0 / 3, 1e21}, {1e-7, 123456789, 1e15}, {}, {}};
    for (std::size_t i = 0; i < small.size(); ++i) {
      const auto bytes = std::as_bytes(std::span(&small[i], 1));
      const auto more = std::as_bytes(std::span(&large[i], 1));
      block.payload.insert(block.payload.end(), bytes.begin(), bytes.end());
      block.payload.insert(block.payload.end(), more.begin(), more.end());
    }
    writer->append(block);
    writer->finish();
  }
  void write_mesh(const std::string& format) const {
    const auto writer = stream::open_mesh_writer(
        path_,
        {.vertices = 3, .triangles = 1, .attributes = {}, .comments = {kWriterMark}, .bounds = {}},
        {.format = format, .replace = true});
    writer->add_vertices(std::vector<stream::Point3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {});
    writer->add_triangles(std::vector<stream::TriangleIndices>{{0, 1, 2}});
    writer->finish();
  }

  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "output";
};

TEST_F(MayReplace, AllowsNewNames) { EXPECT_FALSE(may_replace(path_, false).replace); }

TEST_F(MayReplace, RejectsAnExistingFileWithoutForce) {
  write_points("ply");
  EXPECT_THROW(may_replace(path_, false), stream::Error);
  EXPECT_TRUE(may_replace(path_, true).replace);
}

TEST_F(MayReplace, ForceDependsOnTheMarkOfEachFormat) {
  for (const char* format : {"ply", "ply-ascii"}) {
    write_points(format);
    expect_ours_by_mark("comment written by terrace", format);
  }
  for (const auto& [format, mark] :
       {std::pair{"ply", "comment written by terrace"}, std::pair{"obj", "# written by terrace"},
        std::pair{"glb", "\"generator\":\"terrace\""}}) {
    write_mesh(format);
    expect_ours_by_mark(mark, format);
  }
  const std::array<std::uint8_t, 3> pixel{1, 2, 3};
  stream::write_png(path_, 1, 1, 3, pixel, true);
  expect_ours_by_mark(std::string("Software\0terrace", 16), "png");
  stream::GeoTiffOptions tiff;
  tiff.columns = tiff.rows = 16;
  tiff.sample = {.name = "height", .type = stream::ScalarType::i16};
  tiff.replace = true;
  {
    stream::GeoTiffWriter writer(path_, tiff);
    writer.write_rows(std::vector<std::byte>(512));
    writer.commit();
  }
  expect_ours_by_mark("terrace", "tiff");
}

/// BigTIFF stores a value of up to eight bytes in the entry itself, and other programs may write
/// the opposite byte order.
TEST_F(MayReplace, FindsTheTagInAllKindsOfTiff) {
  const auto tiff = [](bool big_endian, bool big_tiff, std::uint64_t tag, const std::string& name) {
    std::string bytes = big_endian ? "MM" : "II";
    const auto append_number = [&](std::uint64_t number, std::size_t size) {
      for (std::size_t i = 0; i < size; ++i) {
        bytes += static_cast<char>(number >> 8 * (big_endian ? size - 1 - i : i));
      }
    };
    const std::size_t word = big_tiff ? 8 : 4;
    append_number(big_tiff ? 43 : 42, 2);
    if (big_tiff) append_number(8, 2), append_number(0, 2);
    append_number(big_tiff ? 16 : 8, word);  // offset of the directory
    append_number(4, big_tiff ? 8 : 2);
    constexpr std::uint64_t kGeoKeys = 34735;
    const auto put_geo_keys = [&] {
      for (const std::uint64_t number : {1U, 1U, 1U, 0U}) append_number(number, 2);
    };
    for (const std::uint64_t entry : {std::uint64_t{256}, tag, std::uint64_t{322}, kGeoKeys}) {
      append_number(entry, 2);
      append_number(entry == tag ? 2 : 3, 2);
      append_number(entry == tag ? name.size() : entry == kGeoKeys ? 4U : 1U, word);
      if (entry != tag && entry != kGeoKeys) {
        append_number(big_endian ? std::uint64_t{16} << 8 * (word - 2) : 16, word);
      } else if (!big_tiff) {
        append_number(8 + 2 + 48 + 4 + (entry == tag ? 0U : 8U), word);
      } else if (entry == tag) {
        bytes += name;
      } else {
        put_geo_keys();
      }
    }
    append_number(0, word);
    if (!big_tiff) {
      bytes += name;
      put_geo_keys();
    }
    return bytes;
  };
  const std::string our_name("terrace\0", 8), foreign_name("terrain\0", 8);
  for (const bool big_endian : {false, true}) {
    for (const bool big_tiff : {false, true}) {
      const std::string bytes = tiff(big_endian, big_tiff, 305, our_name);
      write(bytes);
      expect_ours("TIFF");
      write(tiff(big_endian, big_tiff, 305, foreign_name));
      expect_foreign("of another program");
      write(tiff(big_endian, big_tiff, 270, our_name));
      expect_foreign("in its description");
      write(bytes + "tile");
      expect_foreign("with the directory before the tiles, as GDAL writes it");
      for (std::size_t size = 1; size < bytes.size(); ++size) {
        write(bytes.substr(0, size));
        expect_foreign(std::to_string(size));
      }
    }
  }
}

/// Text files have no mark, and other programs may write the same text, so extended attributes
/// identify ours.
TEST_F(MayReplace, ForceReplacesUnchangedText) {
  write("");
  expect_ours("empty");
  if (::setxattr(path_.c_str(), "user.terrace", "", 0, 0) != 0 && errno == ENOTSUP) {
    GTEST_SKIP() << "the file system has no extended attributes";
  }
  const auto write_ours = [&](const std::string& content) {
    stream::AtomicFile file(path_, true);
    file.write(content);
    file.commit();
  };
  for (const char* content : {"0\n-1\n12\n", "a,b,distance\n0,1,2.5\n", "a,b,height,size\n",
                              "distance,x,y,height\n0,1,2,\n", "x,y,z\n1,2,3\n", "1 2 3\n",
                              "name;x;y;height;gradient;slope;aspect\nhere;1;2;;;;\n"}) {
    write_ours(content);
    expect_ours(content);
    fs::rename(path_, path_ + ".moved");
    fs::rename(path_ + ".moved", path_);
    expect_ours(content);
    // Another program writes the same text into the file, or creates a new file.
    write(content);
    fs::last_write_time(path_, fs::last_write_time(path_) - std::chrono::hours(1));
    expect_foreign(content);
    fs::remove(path_);
    write(content);
    expect_foreign(content);
    write_ours(content);
    std::ofstream(path_, std::ios::app) << "1 2 3\n";
    expect_foreign(content);
  }
  for (const char* format : {"xyz", "csv"}) {
    write_points(format);
    expect_ours(format);
  }
}

TEST_F(MayReplace, ForceKeepsFilesThatOnlyContainTheWord) {
  for (const char* foreign :
       {"terrace\n", "The terrace is 3 m wide.\n", "ply\nformat ascii 1.0\ncomment terrace\n",
        "ply\nformat ascii 1.0\nend_header\ncomment written by terrace\n",
        "ply\nformat ascii 1.0\ncomment not written by terrace\nend_header\n",
        "# a mesh of the terrace\nv 1 2 3\n", "v 1 2 3\n# written by terrace\n",
        "{\"type\":\"FeatureCollection\",\"name\":\"terrace\",\"generator\":\"terrace contour\"}\n",
        "# vtk DataFile Version 3.0\nthe terrace, written by hand\n", "#!/bin/sh\nterrace info\n",
        "\x7F"
        "ELF terrace",
        "\x89PNG\r\n\x1a\n terrace", "glTF terrace", "II*", "MM", "Dear diary,\ntoday 1 2 3\n",
        // Tables from other programs.
        "x,y,z\n1.50,2,3\n", "x,y,z\n1,2\n", "1.0 2.0 3.0\n", "1 2 3\r\n", "1  2 3\n", "1\t2\t3\n",
        "1,2,3\n", "+1 2 3\n", "01 2 3\n", "1 2 3\n1 2\n", "1 2 3\n\n", "1e5 2 3\n", "x,y\n1,2\n",
        "# points\n1 2 3\n", "\n", "height,gradient,slope\n"}) {
    write(foreign);
    expect_foreign(foreign);
  }
  write(std::string(200000, '1'));
  expect_foreign("one long line");
  std::string binary(200000, '\xFF');
  binary += "terrace";
  write(binary);
  expect_foreign("the word at the end");
}

TEST_F(MayReplace, FollowsLinks) {
  const std::string link = scratch_.path() / "link";
  fs::create_symlink("output", link);
  EXPECT_FALSE(may_replace(link, false).replace) << "the target does not exist yet";
  write("a letter\n");
  EXPECT_THROW(may_replace(link, true), stream::Error);
  write("");
  EXPECT_THROW(may_replace(link, false), stream::Error);
  EXPECT_TRUE(may_replace(link, true).replace);
  fs::remove(link);
  fs::create_symlink("link", link);
  EXPECT_THROW(may_replace(link, true), stream::Error) << "in a circle";
}

TEST_F(MayReplace, RejectsFolders) {
  EXPECT_THROW(may_replace(scratch_.path(), true), stream::Error);
}

}  // namespace
}  // namespace terrace::tools
