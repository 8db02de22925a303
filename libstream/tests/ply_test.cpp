// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

/// Makes PLY files by hand, independently of the reader.
class PlyText {
 public:
  explicit PlyText(std::string encoding) : encoding_(std::move(encoding)) {
    text_ = "ply\nformat " + encoding_ + " 1.0\n";
  }
  PlyText& header(const std::string& line) {
    text_ += line + "\n";
    return *this;
  }
  template <class T>
  PlyText& value(T v) {
    if (encoding_ == "ascii") {
      std::string digits = std::to_string(v);
      text_ += digits + " ";
      return *this;
    }
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &v, sizeof(T));
    const bool big = encoding_ == "binary_big_endian";
    if (big == (std::endian::native == std::endian::little)) {
      std::reverse(bytes.begin(), bytes.end());
    }
    text_.append(bytes.data(), bytes.size());
    return *this;
  }
  PlyText& end_row() {
    if (encoding_ == "ascii") text_.back() = '\n';
    return *this;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string encoding_, text_;
};

const std::vector<std::string> kEncodings{"ascii", "binary_little_endian", "binary_big_endian"};

class Ply : public ::testing::Test {
 protected:
  AllPoints read(std::string_view text, const SourceOptions& options = {}) {
    return read_file(write_text(folder_.path() / "points.ply", text), options);
  }
  std::string refusal(std::string_view text) {
    return error_of([&] { read(text, {.format = "ply"}); });
  }

  TempFolder folder_;
};

TEST_F(Ply, ReadsEveryTypeInEveryEncoding) {
  for (const std::string& encoding : kEncodings) {
    for (const bool old_names : {false, true}) {
      SCOPED_TRACE(encoding);
      PlyText ply(encoding);
      ply.header("comment made  here").header("obj_info num_cols 512").header("element vertex 2");
      ply.header("property float x").header("property int16 y").header("property double z");
      const std::vector<std::string> types =
          old_names ? std::vector<std::string>{"char", "uchar", "short",  "ushort", "int",
                                               "uint", "int64", "uint64", "float",  "double"}
                    : std::vector<std::string>{"int8",   "uint8", "int16",  "uint16",  "int32",
                                               "uint32", "int64", "uint64", "float32", "float64"};
      for (const std::string& type : types) ply.header("property " + type + " a_" + type);
      ply.header("end_header");
      for (const int row : {0, 1}) {
        ply.value(1.5f + static_cast<float>(row)).value(static_cast<std::int16_t>(-300 + row));
        ply.value(2.25);
        ply.value(static_cast<std::int8_t>(-128 + row));
        ply.value(static_cast<std::uint8_t>(255 - row));
        ply.value(static_cast<std::int16_t>(-32768 + row));
        ply.value(static_cast<std::uint16_t>(65535 - row));
        ply.value(std::numeric_limits<std::int32_t>::min() + row);
        ply.value(std::numeric_limits<std::uint32_t>::max() - static_cast<std::uint32_t>(row));
        ply.value(std::numeric_limits<std::int64_t>::min() + row);
        ply.value(std::numeric_limits<std::uint64_t>::max() - static_cast<std::uint64_t>(row));
        ply.value(0.5f * static_cast<float>(row)).value(-0.125 * row).end_row();
      }
      const AllPoints all = read(ply.text());
      EXPECT_EQ(all.info.format, "ply");
      EXPECT_EQ(all.info.points, 2u);
      EXPECT_EQ(all.info.comments,
                (std::vector<std::string>{"made  here", "obj_info num_cols 512"}));
      EXPECT_EQ(all.info.coordinates[0].type, ScalarType::f32);
      EXPECT_EQ(all.info.coordinates[1].type, ScalarType::i16);
      EXPECT_EQ(all.info.coordinates[2].type, ScalarType::f64);
      EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1.5, -300, 2.25}, {2.5, -299, 2.25}}));
      ASSERT_EQ(all.info.attributes.size(), 10u);
      for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_EQ(all.info.attributes[i].name, "a_" + types[i]);
        EXPECT_EQ(all.info.attributes[i].type, static_cast<ScalarType>(i));
      }
      EXPECT_EQ(all.values<std::int8_t>(0)[1], -127);
      EXPECT_EQ(all.values<std::uint8_t>(1)[0], 255);
      EXPECT_EQ(all.values<std::int16_t>(2)[0], -32768);
      EXPECT_EQ(all.values<std::uint16_t>(3)[1], 65534);
      EXPECT_EQ(all.values<std::int32_t>(4)[0], std::numeric_limits<std::int32_t>::min());
      EXPECT_EQ(all.values<std::uint32_t>(5)[0], std::numeric_limits<std::uint32_t>::max());
      EXPECT_EQ(all.values<std::int64_t>(6)[1], std::numeric_limits<std::int64_t>::min() + 1);
      EXPECT_EQ(all.values<std::uint64_t>(7)[0], std::numeric_limits<std::uint64_t>::max());
      EXPECT_EQ(all.values<float>(8)[1], 0.5f);
      EXPECT_EQ(all.values<double>(9)[1], -0.125);
    }
  }
}

/// Returns a file with everything that must be skipped: elements of fixed size and with lists
/// before the vertices, a list among the vertices' properties, and faces after them.
std::string crowded(const std::string& encoding) {
  PlyText ply(encoding);
  ply.header("element camera 2").header("property float fov").header("property uchar id");
  ply.header("element nothing 3");
  ply.header("element strip 2").header("property list uchar int items").header("property short n");
  ply.header("element vertex 3").header("property double x");
  ply.header("property list ushort uchar tags").header("property double y");
  ply.header("property double z").header("property uchar red");
  ply.header("element face 1").header("property list uchar int vertex_indices");
  ply.header("end_header");
  for (std::uint8_t i = 0; i < 2; ++i) ply.value(45.0f).value(i).end_row();
  ply.value(std::uint8_t{3}).value(7).value(8).value(9).value(std::int16_t{-1}).end_row();
  ply.value(std::uint8_t{0}).value(std::int16_t{-2}).end_row();
  for (std::uint8_t i = 0; i < 3; ++i) {
    ply.value(i + 0.5).value(std::uint16_t{i});
    for (std::uint8_t k = 0; k < i; ++k) ply.value(k);
    ply.value(i * 2.0).value(i * -3.0).value(static_cast<std::uint8_t>(100 + i)).end_row();
  }
  ply.value(std::uint8_t{3}).value(0).value(1).value(2).end_row();
  return ply.text();
}

const std::vector<Point3> kCrowdedPoints{{0.5, 0, -0.0}, {1.5, 2, -3}, {2.5, 4, -6}};

TEST_F(Ply, SkipsListsAndOtherElements) {
  for (const std::string& encoding : kEncodings) {
    SCOPED_TRACE(encoding);
    for (const std::size_t block_points : {1u, 2u, 100u}) {
      const AllPoints all = read(crowded(encoding), {.block_points = block_points});
      EXPECT_TRUE(same_bits(all.points.positions, kCrowdedPoints));
      ASSERT_EQ(all.info.attributes.size(), 1u);
      EXPECT_EQ(all.values<std::uint8_t>(0)[2], 102);
    }
  }
}

TEST_F(Ply, RejectsTruncationAtAnyByteOrReadsAllVertices) {
  for (const std::string& encoding : kEncodings) {
    SCOPED_TRACE(encoding);
    const std::string text = crowded(encoding);
    std::size_t refused = 0;
    for (std::size_t length = 0; length < text.size(); ++length) {
      const std::string_view cut = std::string_view(text).substr(0, length);
      AllPoints all;
      const std::string error = error_of([&] { all = read(cut, {.format = "ply"}); });
      if (error.empty()) {
        // Only the faces are truncated: all vertices are complete. In ASCII, missing last digits of
        // a number may go unnoticed.
        EXPECT_EQ(all.points.size(), 3u);
        if (encoding != "ascii") {
          EXPECT_TRUE(same_bits(all.points.positions, kCrowdedPoints));
        }
      } else {
        EXPECT_NE(error.find("points.ply"), std::string::npos);
        ++refused;
      }
    }
    EXPECT_GT(refused, text.size() * 8 / 10);
  }
}

TEST_F(Ply, RejectsHostileHeaders) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string ascii = "ply\nformat ascii 1.0\n";
  const std::string binary = "ply\nformat binary_little_endian 1.0\n";
  const std::pair<std::string, std::string_view> cases[] = {
      {"", "the file is empty"},
      {"plx\n", "does not begin with 'ply'"},
      {"ply\n", "ends before end_header"},
      {ascii + "element vertex 1\n" + xyz, "ends before end_header"},
      {"ply\nelement vertex 0\n" + xyz + "end_header\n", "no format line"},
      {"ply\nformat ascii 2.0\nend_header\n", "line 2: not a format of PLY 1.0"},
      {"ply\nformat binary 1.0\nend_header\n", "line 2: unknown format 'binary'"},
      {ascii + "format ascii 1.0\n", "a second format line"},
      {ascii + "end_header\n", "no element 'vertex'"},
      {ascii + "element vertex\n", "line 3: not 'element NAME COUNT'"},
      {ascii + "element vertex -1\n", "'-1' is not a number of items"},
      {ascii + "element vertex 1e3\n", "'1e3' is not a number of items"},
      {ascii + "element vertex 99999999999999999999999\n", "is not a number of items"},
      {ascii + "property float x\n", "a property before the first element"},
      {ascii + "element vertex 1\nproperty half x\n", "unknown type 'half'"},
      {ascii + "element vertex 1\nproperty float\n", "line 4: not 'property"},
      {ascii + "element vertex 1\nproperty list float int l\n",
       "the length of a list is not an integer"},
      {ascii + "element vertex 1\nproperty float x\nproperty float x\n", "a second property 'x'"},
      {ascii + "element vertex 1\nelement vertex 1\n", "a second element 'vertex'"},
      {ascii + "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
       "no property 'z'"},
      {ascii + "element vertex 1\nproperty list uchar float x\nproperty float y\n"
               "property float z\nend_header\n1 1 2 3\n",
       "no property 'x'"},
      {ascii + "element vertex 1\nproperty int64 x\nproperty float y\nproperty float z\n"
               "end_header\n1 2 3\n",
       "'x' is a 64-bit integer"},
      {ascii + "nonsense\n", "unknown keyword 'nonsense'"},
      {binary + "element vertex 1000000000000000000\n" + xyz + "end_header\n0123456789ab",
       "promises 1000000000000000000 items of 'vertex' of at least 12 bytes, but only 12"},
      {binary + "element vertex 18446744073709551615\n" + xyz + "end_header\n0123456789ab",
       "promises 18446744073709551615 items"},
      {ascii + "element vertex 1000000000000000000\n" + xyz + "end_header\n1 2 3\n", "promises"},
      {binary + "element vertex 1\n" + xyz +
           "element face 1000000000000000000\n"
           "property list uchar int i\nend_header\n0123456789ab",
       "items of 'face'"},
      {ascii + "comment " + std::string(2 << 20, 'c') + "\n", "longer than 65536 bytes"},
      {ascii + "element e 0\n" +
           [] {
             std::string properties;
             for (int i = 0; i < 2000; ++i)
               properties += "property int p" + std::to_string(i) + "\n";
             return properties;
           }(),
       "more than 1000 properties"},
      {ascii +
           [] {
             std::string comments;
             for (int i = 0; i < 20000; ++i) comments += "comment " + std::string(100, 'c') + "\n";
             return comments;
           }(),
       "the header is longer than"},
  };
  for (const auto& [text, message] : cases) {
    SCOPED_TRACE(text.substr(0, 200));
    const std::string error = refusal(text);
    EXPECT_NE(error.find(message), std::string::npos) << error;
  }
}

TEST_F(Ply, RejectsDamagedBodies) {
  const std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
      "property float z\nproperty uchar red\nend_header\n";
  const std::pair<std::string, std::string_view> cases[] = {
      {"1 2 3 4\n5 6 7\n0000\n", "line 10: the line ends before property 'red'"},
      {"1 2 3 4\n5 6 7 8 9\n", "line 10: has more values"},
      {"1 2 3 4\n5 6 7 256\n", "line 10: '256' is not of type uint8 for property 'red'"},
      {"1 2 3 4\n5 6 7 -1\n", "line 10: '-1' is not of type uint8"},
      {"1 2 3 4\n5 6 7 1.5\n", "line 10: '1.5' is not of type uint8"},
      {"1 2 3 4\n5 abc 7 8\n", "line 10: 'abc' is not of type float32 for property 'y'"},
      {"1 2 3 4\n5 1e39 7 8\n", "'1e39' is not of type float32"},
      {"1 2 3 4\n5 inf 7 8\n", "vertex 1: a coordinate is infinite"},
      {"1 2 3 4\n\n\n\n\n\n\n\n\n\n\n", "the file ends in item 1 of element 'vertex'"},
  };
  for (const auto& [body, message] : cases) {
    SCOPED_TRACE(body);
    const std::string error = refusal(ascii + body);
    EXPECT_NE(error.find(message), std::string::npos) << error;
  }
  EXPECT_EQ(read(ascii + "1 2 3 4\n5 6 7 8.0\n").values<std::uint8_t>(0)[1], 8);

  const auto lists = [](const std::string& type, const std::string& count) {
    return "ply\nformat binary_big_endian 1.0\nelement strip 1\nproperty list " + type +
           " double l\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\n"
           "end_header\n" +
           count + "abcdefgh123";
  };
  EXPECT_EQ(read(lists("uchar", "\1")).points.positions, (std::vector<Point3>{{49, 50, 51}}));
  EXPECT_NE(refusal(lists("char", "\xff")).find("has the length -1"), std::string::npos);
  EXPECT_NE(refusal(lists("uchar", "\xff")).find("ends in item 0 of element 'strip'"),
            std::string::npos);
  EXPECT_NE(refusal(lists("uint", "\xff\xff\xff\xff")).find("ends in item 0"), std::string::npos);
  EXPECT_NE(refusal(lists("uint64", "\x7f\xff\xff\xff\xff\xff\xff\xff")).find("ends in item 0"),
            std::string::npos);
}

/// Scanners write NaN for rays without a return.
TEST_F(Ply, SkipsAndCountsVerticesWithNaN) {
  const std::string types = "property float x\nproperty float y\nproperty float z\n";
  std::string body;
  for (const float value : {NAN, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, NAN, NAN, NAN, 6.0f, 7.0f, NAN}) {
    body.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  const std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\n" + types + "end_header\n" + body;
  const std::string ascii = "ply\nformat ascii 1.0\nelement vertex 4\n" + types +
                            "property uchar red\nend_header\n"
                            "nan 1 2 7\n3 4 5 8\nNaN nan -nan 9\n6 7 nan 10\n";
  for (const std::string& text : {binary, ascii}) {
    // Blocks of one point: some are empty before the end.
    for (const std::size_t block_points : {1u, 100u}) {
      const std::string file = write_text(folder_.path() / "holes.ply", text);
      const auto source = open_source(std::array{file, file}, {.block_points = block_points});
      const AllPoints all = read_all(*source);
      EXPECT_EQ(all.points.positions, (std::vector<Point3>{{3, 4, 5}, {3, 4, 5}}));
      if (text == ascii) {
        EXPECT_EQ(all.values<std::uint8_t>(0)[1], 8);
      }
      EXPECT_EQ(source->progress().nodata, 6u);
      EXPECT_EQ(source->progress().points, 2u);
    }
  }
}

TEST_F(Ply, ReadsHeadersOfOtherPrograms) {
  const AllPoints all = read(
      "ply\r\nformat ascii 1.0\r\ncomment CR LF\r\nelement vertex 0002   \r\n"
      "property float32 x\r\nproperty float32 y\r\nproperty float32 z\r\nend_header\r\n"
      "0.1 0.2 0.3 \r\n\r\n  1 2 3\r\n");
  const auto f = [](float v) { return static_cast<double>(v); };
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{f(0.1f), f(0.2f), f(0.3f)}, {1, 2, 3}}));
  EXPECT_EQ(read("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                 "property float z\nend_header\n")
                .points.size(),
            0u);
}

/// Coordinates and columns of every type are read back bit for bit.
TEST_F(Ply, WritesWhatItReadsBitForBit) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    PointHeader header{.attributes = {}, .comments = {"two\nlines", "seed"}};
    for (int type = 0; type < 10; ++type) {
      header.attributes.push_back(
          {.name = "column " + std::to_string(type), .type = static_cast<ScalarType>(type)});
    }
    std::vector<PointBlock> blocks(random() % 4);
    AllPoints expected;
    for (PointBlock& block : blocks) {
      const std::size_t count = random() % 3000;
      for (std::size_t i = 0; i < count; ++i) {
        block.positions.push_back({any_double(random), any_double(random), any_double(random)});
      }
      for (std::size_t i = 0; i < count; ++i) {
        for (const Channel& channel : header.attributes) {
          append_any(block.payload, channel.type, random);
        }
      }
      expected.points.positions.insert(expected.points.positions.end(), block.positions.begin(),
                                       block.positions.end());
      expected.points.payload.insert(expected.points.payload.end(), block.payload.begin(),
                                     block.payload.end());
    }
    for (const std::string format : {"ply", "ply-ascii"}) {
      SCOPED_TRACE(format);
      const auto path = folder_.path() / (format + ".ply");
      const auto writer = open_point_writer(path, header, {.format = format, .replace = true});
      for (const PointBlock& block : blocks) writer->append(block);
      writer->finish();
      const AllPoints all = read_file(path);
      EXPECT_EQ(all.info.points, expected.points.size());
      EXPECT_EQ(all.info.comments, (std::vector<std::string>{"two lines", "seed"}));
      EXPECT_TRUE(same_bits(all.points.positions, expected.points.positions));
      for (std::size_t c = 0; c < 10; ++c) {
        EXPECT_EQ(all.info.attributes[c].name, "column_" + std::to_string(c));
        EXPECT_EQ(all.info.attributes[c].type, header.attributes[c].type);
      }
      EXPECT_EQ(all.points.payload, expected.points.payload);
    }
  }
}

TEST_F(Ply, AnAbandonedWriterLeavesNothing) {
  const auto path = folder_.path() / "gone.ply";
  {
    const auto writer = open_point_writer(path, {});
    PointBlock block;
    block.positions = {{1, 2, 3}};
    writer->append(block);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace terrace::stream
