// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/dendrogram.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "linkage_laws.hpp"

namespace terrace::cluster {
namespace {

using inputs::kInfinity;
using inputs::kNaN;
using laws::message_of;
using Labels = std::vector<std::uint32_t>;

/// Makes a random tree over the points. Heights are coarse, so that many are equal.
std::vector<Link> random_links(std::size_t count, std::mt19937_64& random) {
  std::vector<Link> links;
  for (std::uint32_t i = 1; i < count; ++i) {
    const auto j = static_cast<std::uint32_t>(random() % i);
    links.push_back({i, j, std::floor(8 * inputs::uniform(random))});
  }
  laws::shuffle(links, random);
  return links;
}

/// Returns labels of the components of the links up to a height, by brute force.
Labels components(std::size_t count, const std::vector<Link>& links, double height) {
  Labels label(count);
  for (std::uint32_t i = 0; i < count; ++i) label[i] = i;
  for (const Link& link : links) {
    if (link.height > height) continue;
    const std::uint32_t from = label[link.i];
    const std::uint32_t to = label[link.j];
    for (std::uint32_t& l : label) l = l == from ? to : l;
  }
  Labels number(count, 0xffffffffu);
  std::uint32_t next = 0;
  for (std::uint32_t& l : label) {
    if (number[l] == 0xffffffffu) number[l] = next++;
    l = number[l];
  }
  return label;
}

TEST(Dendrogram, FollowsSciPyConvention) {
  // scipy.cluster.hierarchy.linkage([[0], [1], [3], [7], [7.5]], 'single')
  const Dendrogram dendrogram =
      make_dendrogram(5, std::vector<Link>{{2, 1, 2.0}, {4, 3, 0.5}, {0, 1, 1.0}, {3, 2, 4.0}});
  const std::vector<Merge> expected{{3, 4, 0.5, 2}, {0, 1, 1.0, 2}, {2, 6, 2.0, 3}, {5, 7, 4.0, 5}};
  EXPECT_EQ(dendrogram.merges, expected);
  EXPECT_EQ(dendrogram_fault(dendrogram), "");
  EXPECT_EQ(cut_height(dendrogram, 1.0), (Labels{0, 0, 1, 2, 2}));
  EXPECT_EQ(cut_height(dendrogram, 0.999), (Labels{0, 1, 2, 3, 3}));
  EXPECT_EQ(cut_count(dendrogram, 2), (Labels{0, 0, 0, 1, 1}));
  EXPECT_EQ(cut_count(dendrogram, 5), (Labels{0, 1, 2, 3, 4}));
}

TEST(Dendrogram, CutsAreComponents) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const std::size_t count = 1 + seed * 3 % 50;
    const std::vector<Link> links = random_links(count, random);
    const Dendrogram dendrogram = make_dendrogram(count, links);
    ASSERT_EQ(dendrogram_fault(dendrogram), "");
    for (const double height : {-1.0, 0.0, 2.5, 3.0, 6.0, kInfinity}) {
      ASSERT_EQ(cut_height(dendrogram, height), components(count, links, height));
    }
    for (std::size_t k = 1; k <= count; ++k) {
      const Labels labels = cut_count(dendrogram, k);
      const std::size_t clusters = *std::max_element(labels.begin(), labels.end()) + 1u;
      ASSERT_LE(clusters, k);
      // Finds the lowest cut that leaves no more. Just below the last merge's height there are
      // more.
      double height = -1.0;
      for (const double h : {-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0}) {
        const Labels cut = components(count, links, h);
        if (*std::max_element(cut.begin(), cut.end()) + 1u <= k) {
          height = h;
          break;
        }
        height = h;
      }
      ASSERT_EQ(labels, components(count, links, height));
    }
  }
}

TEST(Dendrogram, HandlesFewerThanTwoPoints) {
  for (const std::size_t count : {0u, 1u}) {
    const Dendrogram dendrogram = make_dendrogram(count, {});
    EXPECT_EQ(dendrogram_fault(dendrogram), "");
    EXPECT_EQ(cut_height(dendrogram, 1.0), Labels(count, 0));
    EXPECT_THROW((void)cut_count(dendrogram, count + 1), std::invalid_argument);
  }
  EXPECT_EQ(cut_count(make_dendrogram(1, {}), 1), Labels{0});
}

TEST(Dendrogram, RejectsLinksThatAreNotATree) {
  const auto error = [](std::size_t count, const std::vector<Link>& links) {
    return message_of([&] { (void)make_dendrogram(count, links); });
  };
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, 1}}), "1 links for 3 points");
  EXPECT_PRED2(laws::contains, error(0, {{0, 1, 1}}), "1 links for 0 points");
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, 1}, {1, 0, 2}}), "link 1");
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, 1}, {2, 2, 2}}), "link 1");
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, 1}, {2, 3, 2}}), "link 1");
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, -1}, {2, 1, 2}}), "link 0");
  EXPECT_PRED2(laws::contains, error(3, {{0, 1, 1}, {2, 1, kNaN}}), "link 1");
  EXPECT_PRED2(laws::contains, error(kMostDendrogramPoints + 1, {}), "2^31");
}

TEST(Dendrogram, RejectsInvalidCuts) {
  const Dendrogram dendrogram = make_dendrogram(3, std::vector<Link>{{0, 1, 1}, {1, 2, 2}});
  EXPECT_THROW((void)cut_height(dendrogram, kNaN), std::invalid_argument);
  EXPECT_THROW((void)cut_count(dendrogram, 0), std::invalid_argument);
  EXPECT_THROW((void)cut_count(dendrogram, 4), std::invalid_argument);
}

/// An equilateral triangle by centroids: the third point is nearer to the middle of the others than
/// they are to each other.
TEST(Dendrogram, CutsHandleInversions) {
  const std::vector<Link> links{{0, 1, 1.0}, {1, 2, 0.866}, {3, 4, 0.9}, {0, 4, 3.0}};
  const Dendrogram dendrogram = make_dendrogram_in_order(5, links);
  const std::vector<Merge> expected{
      {0, 1, 1.0, 2}, {2, 5, 0.866, 3}, {3, 4, 0.9, 2}, {6, 7, 3.0, 5}};
  EXPECT_EQ(dendrogram.merges, expected);
  EXPECT_EQ(dendrogram_fault(dendrogram), "");
  EXPECT_EQ(cut_height(dendrogram, 0.88), (Labels{0, 1, 2, 3, 4}));
  EXPECT_EQ(cut_height(dendrogram, 0.95), (Labels{0, 1, 2, 3, 3}));
  EXPECT_EQ(cut_height(dendrogram, 1.0), (Labels{0, 0, 0, 1, 1}));
  EXPECT_EQ(cut_count(dendrogram, 1), (Labels{0, 0, 0, 0, 0}));
  EXPECT_EQ(cut_count(dendrogram, 2), (Labels{0, 0, 0, 1, 1}));
  // Three clusters are not possible, because both merges of the triangle have the height 1.
  EXPECT_EQ(cut_count(dendrogram, 3), (Labels{0, 0, 0, 1, 1}));
  EXPECT_EQ(cut_count(dendrogram, 4), (Labels{0, 1, 2, 3, 3}));
  EXPECT_EQ(cut_count(dendrogram, 5), (Labels{0, 1, 2, 3, 4}));
  EXPECT_THROW((void)make_dendrogram_in_order(3, std::vector<Link>{{0, 1, 1}, {1, 0, 2}}),
               std::invalid_argument);
}

TEST(Dendrogram, FindsFaults) {
  const Dendrogram good = make_dendrogram(4, std::vector<Link>{{0, 1, 1}, {2, 3, 2}, {1, 2, 3}});
  ASSERT_EQ(dendrogram_fault(good), "");
  const auto broken = [&](const std::function<void(std::vector<Merge>&)>& change) {
    Dendrogram dendrogram = good;
    change(dendrogram.merges);
    return dendrogram_fault(dendrogram);
  };
  using Rows = std::vector<Merge>;
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows.pop_back(); }), "2 rows");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { std::swap(rows[0].a, rows[0].b); }),
               "row 0");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows[1].b = 5; }), "row 1");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows[1].a = 0; }), "row 1");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows[2].size = 3; }), "row 2");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows[0].height = -1; }), "row 0");
  EXPECT_PRED2(laws::contains, broken([](Rows& rows) { rows[2].height = kNaN; }), "row 2");
}

}  // namespace
}  // namespace terrace::cluster
