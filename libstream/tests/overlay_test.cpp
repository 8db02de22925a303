// SPDX-License-Identifier: Apache-2.0
// Tests of overlays: written values are read back, and nothing else is accepted as an overlay of
// the store.
#include "terrace/stream/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stand_in_hierarchy.hpp"
#include "store/codec/bytes.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;
using testing::bytes_of;
using testing::contains;
using testing::write_bytes;
using Values = std::map<std::pair<ClusterId, std::uint32_t>, double>;

Store make_store(const fs::path& path, int side, std::uint64_t seed) {
  testing::write_store(
      path, testing::grid_schema(ScalarType::i16),
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, side, side, 20, seed),
      {.block_points = 400, .cluster_points = 10, .scale = {1, 1, 1}});
  return Store::open(path);
}

/// Returns values for a random part of the points.
Values some_values(const Store& store, double part, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Values values;
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](ClusterId id, const ClusterRecord&, const ClusterPoints& points) {
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (testing::uniform(random) >= part) continue;
        values[{id, i}] = (testing::uniform(random) - 0.5) * std::pow(10, i % 300);
      }
    });
  }
  return values;
}

std::uint64_t write(const fs::path& path, const Store& store, const Values& values) {
  OverlayWriter writer(path, store, "height");
  for (const auto& [point, value] : values) writer.add(point.first, point.second, value);
  EXPECT_EQ(writer.values(), values.size());
  return writer.finish();
}

Values values_of(Overlay& overlay) {
  Values values;
  ClusterId last{};
  overlay.for_each([&](ClusterId cluster, std::span<const OverlayValue> of_cluster) {
    EXPECT_FALSE(of_cluster.empty());
    EXPECT_TRUE(values.empty() || cluster > last);
    last = cluster;
    for (const OverlayValue& value : of_cluster) {
      EXPECT_TRUE(values.emplace(std::pair(cluster, value.index), value.value).second);
    }
  });
  return values;
}

/// Returns the message of the Error that opening and reading throw, or an empty string.
std::string refusal(const fs::path& path, const Store& store) {
  try {
    Overlay overlay = Overlay::open(path, store);
    std::uint64_t values = 0;
    overlay.for_each([&](ClusterId, std::span<const OverlayValue> of_cluster) {
      values += of_cluster.size();
      for (std::size_t i = 1; i < of_cluster.size(); ++i) {
        if (of_cluster[i].index <= of_cluster[i - 1].index) ADD_FAILURE() << "out of order";
      }
    });
    EXPECT_EQ(values, overlay.values());
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(StoreOverlay, RoundTrips) {
  const TempFolder folder;
  const Store store = make_store(folder.path() / "s", 110, 1);
  int number = 0;
  for (const double part : {0.0, 0.0005, 0.03, 0.6, 1.0}) {
    SCOPED_TRACE("part " + std::to_string(part));
    const Values values = some_values(store, part, 77 + static_cast<std::uint64_t>(number));
    const auto path = folder.path() / std::to_string(number++);
    const std::uint64_t size = write(path, store, values);
    EXPECT_EQ(size, fs::file_size(path));
    Overlay overlay = Overlay::open(path, store);
    EXPECT_EQ(overlay.path(), path);
    EXPECT_EQ(overlay.channel(), "height");
    EXPECT_EQ(overlay.values(), values.size());
    EXPECT_EQ(values_of(overlay), values);
    // By cluster, including those without values, first in ascending order, then in random order.
    std::vector<ClusterId> clusters;
    for (unsigned level = 0; level <= store.top(); ++level) {
      for (std::uint64_t c = 0; c < store.levels()[level].clusters; ++c) {
        clusters.push_back(cluster_id(level, c));
      }
    }
    for (int turn = 0; turn < 2; ++turn) {
      for (const ClusterId cluster : clusters) {
        std::vector<OverlayValue> expected;
        for (auto at = values.lower_bound({cluster, 0});
             at != values.end() && at->first.first == cluster; ++at) {
          expected.push_back({at->first.second, at->second});
        }
        const auto overlay_values = overlay.find(cluster);
        ASSERT_EQ(std::vector<OverlayValue>(overlay_values.begin(), overlay_values.end()),
                  expected);
      }
      std::shuffle(clusters.begin(), clusters.end(), std::mt19937_64(5));
      clusters.resize(std::min<std::size_t>(clusters.size(), 50));
    }
  }
  // The last one has several pages, so the search among them was exercised.
  EXPECT_GT(store.points(), 2 * 4096u);
}

TEST(StoreOverlay, IsEmptyForAnEmptyStore) {
  const TempFolder folder;
  testing::write_store(folder.path() / "s", testing::cloud_schema(), {},
                       {.block_points = 400, .cluster_points = 10, .scale = {1, 1, 1}});
  const Store store = Store::open(folder.path() / "s");
  write(folder.path() / "o", store, {});
  Overlay overlay = Overlay::open(folder.path() / "o", store);
  EXPECT_EQ(overlay.values(), 0u);
  EXPECT_TRUE(overlay.find(store.root()).empty());
  OverlayWriter writer(folder.path() / "p", store, "z");
  EXPECT_THROW(writer.add(store.root(), 0, 1.0), std::invalid_argument);
}

TEST(StoreOverlay, WriterRefusesInvalidValuesAndContinues) {
  const TempFolder folder;
  const auto path = folder.path() / "o";
  const Store store = make_store(folder.path() / "s", 24, 1);
  OverlayWriter writer(path, store, "height");
  const auto refuses = [&](ClusterId cluster, std::uint32_t index, double value) {
    EXPECT_THROW(writer.add(cluster, index, value), std::invalid_argument);
  };
  const ClusterId one = cluster_id(0, 1), two = cluster_id(0, 2);
  ASSERT_GE(store.record(one).points, 3u);
  const std::uint32_t members = store.record(one).points;
  writer.add(one, 1, 10);
  refuses(one, 1, 11);
  refuses(one, 0, 11);
  refuses(cluster_id(0, 0), 0, 11);
  refuses(one, members, 11);
  refuses(two, store.record(two).points, 11);
  refuses(cluster_id(0, store.levels()[0].clusters), 0, 11);
  refuses(cluster_id(store.top() + 1, 0), 0, 11);
  refuses(one, 2, std::numeric_limits<double>::quiet_NaN());
  refuses(one, 2, std::numeric_limits<double>::infinity());
  writer.add(one, 2, 12);
  writer.add(store.root(), 0, -3);
  EXPECT_FALSE(fs::exists(path));
  writer.finish();
  Overlay overlay = Overlay::open(path, store);
  EXPECT_EQ(values_of(overlay), (Values{{{one, 1}, 10}, {{one, 2}, 12}, {{store.root(), 0}, -3}}));
  EXPECT_THROW(OverlayWriter(folder.path() / "p", store, std::string(65536, 'n')),
               std::invalid_argument);
}

TEST(StoreOverlay, AppearsCompleteOrNotAtAll) {
  const TempFolder folder;
  const auto path = folder.path() / "o";
  const Store store = make_store(folder.path() / "s", 24, 1);
  { OverlayWriter(path, store, "height").add(store.root(), 0, 1); }
  EXPECT_FALSE(fs::exists(path));
  write(path, store, {{{store.root(), 0}, 1}});
  EXPECT_THROW(OverlayWriter(path, store, "height"), Error);
  OverlayWriter again(path, store, "other", true);
  again.add(store.root(), 0, 2);
  EXPECT_EQ(Overlay::open(path, store).channel(), "height");
  again.finish();
  EXPECT_EQ(Overlay::open(path, store).channel(), "other");
}

TEST(StoreOverlay, NamesBothChecksumsIfMadeForAnotherStore) {
  const TempFolder folder;
  const Store one = make_store(folder.path() / "one", 24, 1);
  const Store two = make_store(folder.path() / "two", 24, 2);
  const Store same = make_store(folder.path() / "same", 24, 1);
  write(folder.path() / "o", one, some_values(one, 0.5, 1));
  EXPECT_EQ(refusal(folder.path() / "o", same), "");
  const std::string text = refusal(folder.path() / "o", two);
  for (const Store* store : {&one, &two}) {
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08x", store->checksum());
    EXPECT_TRUE(contains(text, digits)) << text;
    EXPECT_TRUE(contains(bytes_of(store->path() / "manifest.json"), digits));
  }
  EXPECT_TRUE(contains(text, "two")) << text;
  // Files that are not overlays.
  EXPECT_TRUE(contains(refusal(folder.path() / "none", one), "there is no overlay"));
  EXPECT_TRUE(contains(refusal(folder.path() / "one", one), "there is no overlay"));
  EXPECT_TRUE(contains(refusal(one.path() / "manifest.json", one), "the file is not an overlay"));
  std::string newer = bytes_of(folder.path() / "o");
  newer[16] = 2;
  write_bytes(folder.path() / "newer", newer);
  EXPECT_TRUE(contains(refusal(folder.path() / "newer", one), "newer terrace"));
}

TEST(StoreOverlay, FindsFlippedBytesAndTruncations) {
  const TempFolder folder;
  const auto path = folder.path() / "o";
  const Store store = make_store(folder.path() / "s", 24, 1);
  write(path, store, some_values(store, 0.1, 1));
  const std::string good = bytes_of(path);
  ASSERT_EQ(refusal(path, store), "");
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ (1 << (at % 8)));
    write_bytes(path, bad);
    ASSERT_NE(refusal(path, store), "") << "byte " << at;
    write_bytes(path, good.substr(0, at));
    ASSERT_NE(refusal(path, store), "") << at << " bytes";
  }
  write_bytes(path, good + '\0');
  EXPECT_NE(refusal(path, store), "");
}

/// Recomputes the checksums of header, pages and directory, as far as they can be found.
void repair(std::string& bytes, std::size_t header, std::size_t directory,
            const std::vector<std::size_t>& pages) {
  const auto sign = [&](std::size_t begin, std::size_t end) {
    const std::uint32_t checksum = store::crc32(0, bytes.data() + begin, end - begin);
    std::memcpy(bytes.data() + end, &checksum, 4);
  };
  sign(0, header - 4);
  for (std::size_t p = 0; p < pages.size(); ++p) {
    sign(pages[p], (p + 1 < pages.size() ? pages[p + 1] : directory) - 4);
  }
  sign(directory, bytes.size() - 4);
}

TEST(StoreOverlay, DamageWithGoodChecksumsIsRefusedOrConsistent) {
  const TempFolder folder;
  const auto path = folder.path() / "o";
  const Store store = make_store(folder.path() / "s", 110, 1);
  write(path, store, some_values(store, 0.9, 1));
  const std::string good = bytes_of(path);
  const std::size_t header = 44 + std::strlen("height") + 4;
  std::uint64_t directory = 0;
  std::memcpy(&directory, good.data() + 32, 8);
  std::vector<std::size_t> pages;
  for (std::size_t at = directory; at + 4 < good.size(); at += 20) {
    std::uint64_t offset = 0;
    std::memcpy(&offset, good.data() + at + 8, 8);
    pages.push_back(offset);
  }
  ASSERT_EQ(pages.front(), header);
  ASSERT_GE(pages.size(), 2u);
  std::string same = good;
  repair(same, header, directory, pages);
  ASSERT_EQ(same, good);

  std::mt19937_64 random(11);
  std::size_t refused = 0;
  for (int turn = 0; turn < 600; ++turn) {
    SCOPED_TRACE("turn " + std::to_string(turn) + " of seed 11");
    // Mostly in counts and positions.
    const std::size_t at = turn % 3 == 0   ? 20 + random() % (header - 24)
                           : turn % 3 == 1 ? directory + random() % (good.size() - 4 - directory)
                                           : pages[random() % pages.size()] + random() % 64;
    std::string bad = good;
    bad[at] = static_cast<char>(turn % 2 == 0 ? static_cast<int>(random() % 256) : bad[at] + 1);
    repair(bad, header, directory, pages);
    write_bytes(path, bad);
    if (!refusal(path, store).empty()) ++refused;
  }
  EXPECT_GT(refused, 300u);
}

}  // namespace
}  // namespace terrace::stream
