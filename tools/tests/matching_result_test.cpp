// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/matching_result.hpp"

#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "picture/draw.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr const char* kPairs = "a,b,distance\n";
constexpr const char* kTree = "a,b,distance,size,level\n";

class MatchingResultFile : public ::testing::Test {
 protected:
  void write_file(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  /// Returns the error for a file with this text.
  [[nodiscard]] stream::Error::Parts error_of(const std::string& text, std::size_t points) const {
    write_file(text);
    try {
      (void)read_matching_result(path_, points);
    } catch (const stream::Error& error) {
      return error.parts();
    }
    ADD_FAILURE() << text << " was accepted";
    return {};
  }

  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "matching.csv";
};

TEST_F(MatchingResultFile, IsRecognisedByItsFirstLine) {
  for (const char* text : {"a,b,distance", "a,b,distance\n", "a,b,distance\r\n0,1,2\r\n",
                           "a,b,distance,size,level\n0,1,nonsense"}) {
    write_file(text);
    EXPECT_TRUE(is_matching_result(path_)) << text;
  }
  for (const char* text : {"", "a", "a,b,distances\n", "a,b,distance \n", "a,b,height,size\n",
                           "a,b,distance,size\n", "x,y,z\n1,2,3\n", "\n\na,b,distance\n"}) {
    write_file(text);
    EXPECT_FALSE(is_matching_result(path_)) << text;
  }
  write_file(std::string("a,b,distance\0\n", 14));
  EXPECT_FALSE(is_matching_result(path_));
  EXPECT_FALSE(is_matching_result(scratch_.path()));
  EXPECT_FALSE(is_matching_result(path_ + ".none"));
}

TEST_F(MatchingResultFile, ReadsPairs) {
  write_file(std::string(kPairs) + "0,3,1.5\r\n\n4,1,0\n");
  const MatchingResult result = read_matching_result(path_, 5);
  EXPECT_FALSE(result.tree);
  EXPECT_EQ(result.top, 1u);
  ASSERT_EQ(result.lines.size(), 2u);
  EXPECT_EQ(result.lines[1].a, 4u);
  EXPECT_EQ(result.lines[1].b, 1u);
  write_file(kPairs);
  EXPECT_EQ(read_matching_result(path_, 1).top, 0u);
}

TEST_F(MatchingResultFile, ReadsTrees) {
  // Rows need not be sorted by level, because clusters follow one another.
  write_file(std::string(kTree) + "0,1,1,2,1\n2,5,1,3,2\n3,4,1,2,1\n6,7,9,5,3");
  const MatchingResult result = read_matching_result(path_, 5);
  EXPECT_TRUE(result.tree);
  EXPECT_EQ(result.top, 3u);
  EXPECT_EQ(result.lines.back().b, 7u);
  write_file(kTree);
  EXPECT_EQ(read_matching_result(path_, 1).lines.size(), 0u);
}

TEST_F(MatchingResultFile, RejectsMalformedPairs) {
  for (const char* row : {"0,1", "0,1,2,3", "0;1;2", "-1,1,2", "0,1,x", "0,1,nan", "0,1,inf",
                          "0,1,-1", "0,0,1", "0,4,1", "4294967296,1,1", "0,1,1 ", " 0,1,1"}) {
    const auto parts = error_of(std::string(kPairs) + "2,3,1\n" + row + "\n", 4);
    EXPECT_EQ(parts.where, "line 3") << row;
  }
  EXPECT_EQ(error_of(std::string(kPairs) + "0,1,1\n1,2,1\n", 4).where, "line 3");
  EXPECT_EQ(error_of(std::string(kPairs) + "0,1,1\n2,3,1\n", 3).where, "line 3");
  EXPECT_EQ(error_of(std::string(kPairs) + "0,1,1\n", 0).where, "line 2");
  EXPECT_NE(error_of(std::string(kPairs) + "0,9,1\n", 5).cause.text().find("there are 5 points"),
            std::string::npos);
}

TEST_F(MatchingResultFile, RejectsMalformedTrees) {
  const std::string first = std::string(kTree) + "0,1,1,2,1\n";
  for (const char* row : {"2,3,1,2", "2,3,1", "2,3,1,2,1,1", "2,3,1,3,1", "2,4,1,2,2", "2,4,1,3,1",
                          "2,5,1,2,1", "2,6,1,2,1", "2,7,1,2,1", "1,2,1,2,1", "2,2,1,2,1",
                          "2,3,nan,2,1", "2,3,1,2,0", "2,3,1,2,-1", "2,3,1,2,99999999999"}) {
    EXPECT_EQ(error_of(first + row + "\n", 4).where, "line 3") << row;
  }
  EXPECT_NE(error_of(first + "2,5,1,2,1\n", 4).cause.text().find("before"), std::string::npos);
  // A tree has exactly one row fewer than points.
  EXPECT_NE(error_of(first + "2,3,1,2,1\n", 4).cause.text().find("has 2 rows"), std::string::npos);
  EXPECT_EQ(error_of(first + "2,3,1,3,2\n", 2).where, "line 3");
}

TEST_F(MatchingResultFile, RejectsEndlessLines) {
  const auto parts = error_of(kPairs + std::string(100000, '1'), 4);
  EXPECT_EQ(parts.where, "line 2");
  EXPECT_NE(parts.cause.text().find("longer"), std::string::npos);
}

TEST_F(MatchingResultFile, PlacesNodesAtTheMeanOfTheirPoints) {
  const std::string points = path_ + ".points.csv";
  std::ofstream(points) << "x,y,z\n0,0,0\n3,0,0\n0,9,3\n3,3,3\n";
  write_file(std::string(kTree) + "0,1,3,2,1\n2,4,1,3,2\n3,5,1,4,3\n");
  MatchingPicture picture = read_matching_picture(path_, points, {});
  ASSERT_EQ(picture.positions.size(), 7u);
  const auto offset = [&](std::size_t node, std::size_t axis) {
    return picture.positions[node][axis] - picture.positions[0][axis];
  };
  for (const std::size_t axis : {0u, 1u, 2u}) {
    const auto mean = [&](std::initializer_list<std::size_t> nodes) {
      double sum = 0;
      for (const std::size_t node : nodes) sum += offset(node, axis);
      return sum / static_cast<double>(nodes.size());
    };
    EXPECT_NEAR(offset(4, axis), mean({0, 1}), 1e-12);
    EXPECT_NEAR(offset(5, axis), mean({0, 1, 2}), 1e-12);
    EXPECT_NEAR(offset(6, axis), mean({0, 1, 2, 3}), 1e-12);
  }
  for (const char* level : {"4", "x", "-1", "1.5", "1 "}) {
    EXPECT_THROW(picture.keep_levels(level), UsageError) << level;
  }
  picture.keep_levels("top");
  EXPECT_EQ(picture.result.lines.size(), 3u);
  picture.keep_levels("1");
  ASSERT_EQ(picture.result.lines.size(), 1u);
  EXPECT_EQ(picture.result.lines.front().b, 1u);
  picture.keep_levels("0");
  EXPECT_TRUE(picture.result.lines.empty());
}

/// Four points on a line, 100 apart, drawn from above at one sample per metre.
class DrawMatching : public ::testing::Test {
 protected:
  DrawMatching() {
    camera_.width = canvas_.width();
    camera_.height = canvas_.height();
    camera_.scale = 1;
    for (const double x : {-150.0, -50.0, 50.0, 150.0}) picture_.positions.push_back({x, 0, 0});
    picture_.result.points = 4;
  }
  std::array<float, 3> at(double x, double y) {
    draw_matching(picture_, camera_, {}, canvas_);
    return canvas_.colour(static_cast<std::uint32_t>(200 + x), static_cast<std::uint32_t>(100 - y));
  }

  Canvas canvas_{200, 100};
  Camera camera_{parse_view("top")};
  MatchingPicture picture_;
};

TEST_F(DrawMatching, PairsAreRedLinesBetweenDarkDots) {
  picture_.result.lines = {{0, 1, 1}, {2, 3, 1}};
  picture_.result.top = 1;
  EXPECT_GT(at(-100, 0)[0], 0.8F);
  EXPECT_LT(at(-100, 0)[1], 0.2F);
  EXPECT_EQ(at(0, 0)[1], 1.0F);      // background between the pairs
  EXPECT_EQ(at(-100, 20)[1], 1.0F);  // and next to a pair
  EXPECT_LT(at(150, 0)[0], 0.2F);    // a point
  picture_.result.lines.pop_back();
  EXPECT_GT(at(150, 0)[0], 0.95F);  // a ring without a partner
  EXPECT_EQ(at(100, 0)[1], 1.0F);
}

TEST_F(DrawMatching, LevelsGoFromRedToBlackWithLowerOnesOnTop) {
  picture_.positions.insert(picture_.positions.end(), {{-100, 0, 0}, {100, 0, 0}, {0, 0, 0}});
  picture_.result.lines = {{0, 1, 1}, {2, 3, 1}, {4, 5, 2}};
  picture_.result.tree = true;
  picture_.result.top = 2;
  EXPECT_GT(at(-75, 0)[0], 0.8F);  // the pair, over the line to the other pair
  EXPECT_LT(at(20, 0)[0], 0.05F);
  // Without the upper level, the rest stays as it was.
  picture_.result.lines.pop_back();
  EXPECT_GT(at(-75, 0)[0], 0.8F);
  EXPECT_EQ(at(20, 0)[0], 1.0F);
}

TEST_F(DrawMatching, CrowdedPicturesPutHigherLevelsOnTopWithoutDots) {
  picture_.positions = {{-103, 0, 0}, {-97, 0, 0}, {97, 0, 0}, {103, 0, 0},
                        {-100, 0, 0}, {100, 0, 0}, {0, 0, 0}};
  picture_.result.lines = {{0, 1, 1}, {2, 3, 1}, {4, 5, 2}};
  picture_.result.tree = true;
  picture_.result.top = 2;
  EXPECT_LT(at(-98, 0)[0], 0.2F);
  EXPECT_GT(at(-102.5, 0)[0], 0.8F);
  EXPECT_LT(at(-102.5, 0)[1], 0.6F);
  // Without any lines, all points are solid dots.
  picture_.result.lines.clear();
  EXPECT_LT(at(100, 0)[0], 1.0F);
  EXPECT_LT(at(97, 0)[0], 0.2F);
}

TEST_F(DrawMatching, ThreadsDoNotChangeThePictureAndDrawingStaysInside) {
  constexpr double kHuge = std::numeric_limits<double>::max();
  picture_.positions = {{-1e6, -1e6, 0},    {1e6, 1e6, 0},      {0, 0, 0},   {0, 0, 0},
                        {-kHuge, kHuge, 0}, {kHuge, -kHuge, 0}, {3, -90, 7}, {kHuge, 0, kHuge / 2}};
  picture_.result.points = 8;
  picture_.result.lines = {{0, 1, 1}, {2, 3, 4294967295u}, {4, 5, 7}, {6, 7, 3}};
  picture_.result.top = 4294967295u;
  draw_matching(picture_, camera_, {.threads = 1}, canvas_);
  Canvas other(200, 100);
  draw_matching(picture_, camera_, {.threads = 3}, other);
  EXPECT_EQ(canvas_.resolve(), other.resolve());
  EXPECT_LT(canvas_.colour(250, 50)[1], 0.9F);  // on the line through the whole picture
}

}  // namespace
}  // namespace terrace::tools
