// SPDX-License-Identifier: Apache-2.0
// A small set of points with the results of scipy.cluster.hierarchy 1.10.1: linkage() and
// fcluster(), whose labels are renumbered by first appearance.
#include <gtest/gtest.h>

#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

using Labels = std::vector<std::uint32_t>;

const std::vector<Point3> kPoints{
    {0.5, 1.25, -2},   {3, 4, 0.25},    {-1.5, 2, 1},    {2.5, 3.75, 0}, {7, -1, 2},
    {6.5, -1.5, 2.25}, {0.25, 0, -1.5}, {-2, 2.5, 1.75}, {3.5, -2, 4},   {1, 1, 1}};

void expect_rows(const Dendrogram& dendrogram, const std::vector<Merge>& expected,
                 double tolerance) {
  ASSERT_EQ(dendrogram_fault(dendrogram), "");
  ASSERT_EQ(dendrogram.merges.size(), expected.size());
  for (std::size_t r = 0; r < expected.size(); ++r) {
    const Merge& merge = dendrogram.merges[r];
    EXPECT_EQ(merge.a, expected[r].a) << "row " << r;
    EXPECT_EQ(merge.b, expected[r].b) << "row " << r;
    EXPECT_EQ(merge.size, expected[r].size) << "row " << r;
    EXPECT_NEAR(merge.height, expected[r].height, tolerance * expected[r].height) << "row " << r;
  }
}

TEST(LinkageVectors, Single) {
  const Dendrogram dendrogram = single_linkage(kPoints);
  expect_rows(dendrogram,
              {{1, 3, 0.61237243569579447, 2},
               {4, 5, 0.75, 2},
               {2, 7, 1.0307764064044151, 2},
               {0, 6, 1.3693063937629153, 2},
               {9, 12, 2.6925824035672519, 3},
               {13, 14, 2.7950849718747373, 5},
               {10, 15, 3.2882366094914763, 7},
               {8, 11, 3.5089172119045497, 3},
               {16, 17, 4.924428900898052, 10}},
              1e-12);
  EXPECT_EQ(cut_count(dendrogram, 3), (Labels{0, 0, 0, 0, 1, 1, 0, 0, 2, 0}));
  EXPECT_EQ(cut_count(dendrogram, 5), (Labels{0, 1, 2, 1, 3, 3, 0, 2, 4, 2}));
  EXPECT_EQ(cut_height(dendrogram, 2.0), (Labels{0, 1, 2, 1, 3, 3, 0, 2, 4, 5}));
  EXPECT_EQ(cut_height(dendrogram, 4.0), (Labels{0, 0, 0, 0, 1, 1, 0, 0, 1, 0}));
}

TEST(LinkageVectors, Complete) {
  const std::vector<Merge> expected{
      {1, 3, 0.61237243569579447, 2},  {4, 5, 0.75, 2},
      {2, 7, 1.0307764064044151, 2},   {0, 6, 1.3693063937629153, 2},
      {9, 13, 3.0516389039334255, 3},  {8, 11, 4.1533119314590374, 3},
      {12, 14, 4.677071733467427, 5},  {10, 16, 5.4313902456001077, 7},
      {15, 17, 9.6598395431808282, 10}};
  const Dendrogram dendrogram = complete_linkage(kPoints);
  expect_rows(dendrogram, expected, 1e-12);
  expect_rows(complete_linkage(kPoints, {.entry = MatrixEntry::float32}), expected, 1e-7);
  EXPECT_EQ(cut_count(dendrogram, 3), (Labels{0, 1, 0, 1, 2, 2, 0, 0, 2, 0}));
  EXPECT_EQ(cut_count(dendrogram, 5), (Labels{0, 1, 2, 1, 3, 3, 0, 2, 4, 0}));
  EXPECT_EQ(cut_height(dendrogram, 2.0), (Labels{0, 1, 2, 1, 3, 3, 0, 2, 4, 5}));
  EXPECT_EQ(cut_height(dendrogram, 4.0), (Labels{0, 1, 2, 1, 3, 3, 0, 2, 4, 0}));
}

TEST(LinkageVectors, Methods) {
  struct Case {
    LinkageMethod method;
    std::vector<Merge> rows;
    Labels three, below_four;  ///< labels of cuts into three clusters and below height 4
  };
  const std::vector<Case> cases{
      {LinkageMethod::average,
       {{1, 3, 0.61237243569579447, 2},
        {4, 5, 0.75, 2},
        {2, 7, 1.0307764064044151, 2},
        {0, 6, 1.3693063937629153, 2},
        {9, 13, 2.9233619379040814, 3},
        {12, 14, 3.8025029145357756, 5},
        {8, 11, 3.8311145716817938, 3},
        {10, 15, 4.4752880463901068, 7},
        {16, 17, 7.4041051210418329, 10}},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0}},
      {LinkageMethod::weighted,
       {{1, 3, 0.61237243569579447, 2},
        {4, 5, 0.75, 2},
        {2, 7, 1.0307764064044151, 2},
        {0, 6, 1.3693063937629153, 2},
        {9, 13, 2.9233619379040814, 3},
        {12, 14, 3.618066457749848, 5},
        {8, 11, 3.8311145716817938, 3},
        {10, 15, 4.4751909092847972, 7},
        {16, 17, 7.1642198794037419, 10}},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0}},
      {LinkageMethod::ward,
       {{1, 3, 0.61237243569579447, 2},
        {4, 5, 0.75, 2},
        {2, 7, 1.0307764064044151, 2},
        {0, 6, 1.3693063937629153, 2},
        {9, 13, 3.2850672240711702, 3},
        {8, 11, 4.4182387139371873, 3},
        {12, 14, 5.4927983153701661, 5},
        {10, 16, 6.7593850100645785, 7},
        {15, 17, 13.938342116348736, 10}},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0},
       {0, 1, 2, 1, 3, 3, 0, 2, 4, 0}},
      {LinkageMethod::centroid,
       {{1, 3, 0.61237243569579447, 2},
        {4, 5, 0.75, 2},
        {2, 7, 1.0307764064044151, 2},
        {0, 6, 1.3693063937629153, 2},
        {9, 13, 2.8449516691852605, 3},
        {12, 14, 3.5455860665841348, 5},
        {8, 11, 3.8263069662534916, 3},
        {10, 15, 3.9989061004229645, 7},
        {16, 17, 6.8012145440631704, 10}},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0},
       {0, 0, 0, 0, 1, 1, 0, 0, 1, 0}},
      {LinkageMethod::median,
       {{1, 3, 0.61237243569579447, 2},
        {4, 5, 0.75, 2},
        {2, 7, 1.0307764064044151, 2},
        {0, 6, 1.3693063937629153, 2},
        {9, 13, 2.8449516691852605, 3},
        {12, 14, 3.3272079135515411, 5},
        {8, 11, 3.8263069662534916, 3},
        {10, 15, 4.0497395749603449, 7},
        {16, 17, 6.5130952822947403, 10}},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0},
       {0, 1, 0, 1, 2, 2, 0, 0, 2, 0}},
  };
  for (const Case& expected : cases) {
    SCOPED_TRACE(testing::Message() << "method " << static_cast<int>(expected.method));
    const Dendrogram dendrogram = linkage(kPoints, expected.method);
    expect_rows(dendrogram, expected.rows, 1e-12);
    EXPECT_EQ(cut_count(dendrogram, 3), expected.three);
    EXPECT_EQ(cut_height(dendrogram, 4.0), expected.below_four);
  }
}

}  // namespace
}  // namespace terrace::cluster
