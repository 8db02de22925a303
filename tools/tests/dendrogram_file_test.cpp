// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/dendrogram_file.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "picture/draw.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

class DendrogramFile : public ::testing::Test {
 protected:
  void write_file(const std::string& text) const { std::ofstream(path_) << text; }

  tests::TemporaryFolder scratch_;
  std::string path_ = scratch_.path() / "dendrogram.csv";
};

const cluster::Dendrogram kDendrogram{4, {{0, 1, 0.1, 2}, {2, 3, 1.0 / 3.0, 2}, {4, 5, 1e20, 4}}};

TEST_F(DendrogramFile, RoundTripsExactly) {
  write_dendrogram(path_, kDendrogram, true);
  const auto result = read_dendrogram(path_);
  ASSERT_TRUE(result);
  EXPECT_EQ(*result, kDendrogram);
}

TEST_F(DendrogramFile, IgnoresOtherFiles) {
  for (const char* text :
       {"", "a", "a,b,height", "a,b,height,sizes\n0,1,2,2\n", "x,y,z\n1,2,3\n"}) {
    write_file(text);
    EXPECT_FALSE(read_dendrogram(path_)) << text;
  }
  EXPECT_FALSE(read_dendrogram(scratch_.path()));
  EXPECT_FALSE(read_dendrogram(path_ + ".none"));
}

TEST_F(DendrogramFile, AcceptsAllLineEnds) {
  write_file("a,b,height,size\r\n0,1,2.5,2\r\n\r\n");
  const auto tree = read_dendrogram(path_);
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->merges.front().height, 2.5);
}

TEST_F(DendrogramFile, RejectsMalformedDendrograms) {
  for (const char* rows : {"0,1,2", "0,1,2,2,3", "0,1,x,2", "0;1;2;2", "-1,1,2,2", "0,1,nan,2",
                           "0,1,-1,2", "0,2,1,2", "0,1,1,3", "0,0,1,2", "0,1,1,2\n0,2,2,3"}) {
    write_file(std::string("a,b,height,size\n") + rows + "\n");
    EXPECT_THROW(read_dendrogram(path_), stream::Error) << rows;
  }
  try {
    write_file("a,b,height,size\n0,1,1,2\nnonsense\n");
    (void)read_dendrogram(path_);
    FAIL();
  } catch (const stream::Error& error) {
    EXPECT_EQ(error.parts().where, "line 3");
  }
}

TEST(DrawDendrogram, LinesRiseFromTheLeavesToTheRoot) {
  const auto is_drawn = [](Canvas& canvas, double x, double y) {
    return std::isfinite(canvas.depth(static_cast<std::uint32_t>(x * canvas.width()),
                                      static_cast<std::uint32_t>(y * canvas.height())));
  };
  Canvas canvas(400, 200);
  draw_dendrogram({4, {{0, 1, 1.0, 2}, {2, 3, 2.0, 2}, {4, 5, 4.0, 4}}}, canvas);
  // The margin is 12 samples of 800 x 400; leaves are at 1/8, 3/8, 5/8 and 7/8 of the inside.
  const auto x_of = [](double share) { return (12 + share * 776) / 800; };
  const auto y_of = [](double share) { return (388 - share * 376) / 400; };
  for (const double leaf : {0.125, 0.375, 0.625, 0.875})
    EXPECT_TRUE(is_drawn(canvas, x_of(leaf), y_of(0.1)));
  EXPECT_TRUE(is_drawn(canvas, x_of(0.25), y_of(0.25)));   // across the first pair
  EXPECT_FALSE(is_drawn(canvas, x_of(0.25), y_of(0.2)));   // nothing is below it
  EXPECT_TRUE(is_drawn(canvas, x_of(0.25), y_of(0.6)));    // its stem
  EXPECT_FALSE(is_drawn(canvas, x_of(0.375), y_of(0.4)));  // a leaf ends at its merge
  EXPECT_TRUE(is_drawn(canvas, x_of(0.875), y_of(0.4)));
  EXPECT_TRUE(is_drawn(canvas, x_of(0.5), y_of(1.0)));  // the root
}

TEST(DrawDendrogram, DrawsDeepAndFlatTrees) {
  cluster::Dendrogram chain{2000, {}};
  for (std::uint32_t r = 0; r < 1999; ++r) {
    chain.merges.push_back({r == 0 ? 0 : r + 1, r == 0 ? 1 : 1999 + r, 0.0, r + 2});
  }
  Canvas canvas(64, 64);
  draw_dendrogram(chain, canvas);
  // Without a height, everything is on the bottom line, 3 % of 128 samples from the edge.
  EXPECT_TRUE(std::isfinite(canvas.depth(64, 124)));
  Canvas empty(64, 64);
  draw_dendrogram({1, {}}, empty);
  EXPECT_FALSE(std::isfinite(empty.depth(64, 124)));
}

}  // namespace
}  // namespace terrace::tools
