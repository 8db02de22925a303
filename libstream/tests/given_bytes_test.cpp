// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/given_bytes.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

std::vector<std::byte> random_bytes(std::size_t size, std::mt19937_64& random) {
  std::vector<std::byte> bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

// Compares with a map of single bytes: the given bytes are read, whatever the pieces, and no
// others.
TEST(GivenBytes, ReadsGivenBytesInAnyPieces) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const std::size_t size = 1 + random() % 200;
    const std::vector<std::byte> expected = random_bytes(size, random);
    GivenBytes partial;
    partial.add_file("a", size);
    const auto source = partial.open()("a");
    ASSERT_EQ(source->size(), size);
    std::set<std::size_t> there;
    for (int round = 0; round < 60; ++round) {
      const std::size_t begin = random() % size, length = random() % (size - begin + 1);
      if (random() % 2 == 0) {
        partial.give("a", begin, std::span(expected).subspan(begin, length));
        for (std::size_t i = 0; i < length; ++i) there.insert(begin + i);
        ASSERT_EQ(partial.bytes(), there.size());
        continue;
      }
      bool all = true;
      for (std::size_t i = 0; i < length; ++i) all &= there.contains(begin + i);
      EXPECT_EQ(partial.has({"a", begin, length}), all);
      EXPECT_FALSE(partial.has({"b", begin, length}));
      std::vector<std::byte> out(length);
      try {
        source->read(begin, out);
        EXPECT_TRUE(all);
        EXPECT_TRUE(
            std::equal(out.begin(), out.end(), expected.begin() + static_cast<long>(begin)));
      } catch (const MissingBytes& missing) {
        EXPECT_FALSE(all);
        EXPECT_EQ(missing.ranges(), (std::vector<ByteRange>{{"a", begin, length}}));
      }
    }
  }
}

TEST(GivenBytes, KeepsItsLimitAndDropsTheLeastRecentlyUsed) {
  GivenBytes partial(30);
  partial.add_file("a", 100);
  const std::vector<std::byte> ten(10);
  const auto source = partial.open()("a");
  std::vector<std::byte> out(10);
  for (const std::uint64_t at : {0u, 20u, 40u}) partial.give("a", at, ten);
  source->read(0, out);  // now 20 is the oldest
  partial.give("a", 60, ten);
  EXPECT_EQ(partial.bytes(), 30u);
  EXPECT_NO_THROW(source->read(0, out));
  EXPECT_THROW(source->read(20, out), MissingBytes);
  partial.give("a", 0, std::vector<std::byte>(100));
  EXPECT_LE(partial.bytes(), 100u);
  partial.forget("a");
  EXPECT_EQ(partial.bytes(), 0u);
  EXPECT_THROW(source->read(60, out), MissingBytes);
}

TEST(GivenBytes, RefusesImpossibleParts) {
  GivenBytes partial;
  partial.add_file("a", 10);
  EXPECT_NO_THROW(partial.add_file("a", 10));
  EXPECT_THROW(partial.add_file("a", 11), Error);
  EXPECT_THROW(partial.give("b", 0, {}), Error);
  const std::vector<std::byte> two(2);
  EXPECT_THROW(partial.give("a", 9, two), Error);
  EXPECT_THROW(partial.give("a", UINT64_MAX, two), Error);
  EXPECT_THROW(partial.open()("b"), Error);
}

// A store can be opened and read whatever the order of its bytes, and requests each byte once.
TEST(GivenBytes, ReadsAStoreFromItsMissingBytes) {
  const std::string folder = std::string(TERRACE_TEST_DATA) + "/stores/grid/";
  const Store expected = Store::open(folder);
  GivenBytes partial;
  std::map<std::string, std::vector<std::byte>> files;
  std::vector<std::string> names{"manifest.json"};
  for (unsigned level = 0; level <= expected.top(); ++level) {
    names.push_back("level-" + std::to_string(level) + ".0.clusters");
    names.push_back("level-" + std::to_string(level) + ".0.index");
  }
  for (const std::string& name : names) {
    std::ifstream in(folder + name, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ASSERT_FALSE(text.empty()) << name;
    auto& bytes = files[name];
    bytes.resize(text.size());
    std::transform(text.begin(), text.end(), bytes.begin(),
                   [](char c) { return static_cast<std::byte>(c); });
    partial.add_file(name, bytes.size());
  }
  std::set<std::pair<std::string, std::uint64_t>> requested;
  const auto brought = [&](auto&& work) {
    for (int turn = 0; turn < 100; ++turn) {
      try {
        return work();
      } catch (const MissingBytes& missing) {
        for (const ByteRange& range : missing.ranges()) {
          EXPECT_TRUE(requested.emplace(range.file, range.offset).second)
              << range.file << " requested twice";
          partial.give(range.file, range.offset,
                       std::span(files[range.file])
                           .subspan(static_cast<std::size_t>(range.offset),
                                    static_cast<std::size_t>(range.bytes)));
        }
      }
    }
    throw std::runtime_error("does not end");
  };
  const Store store = brought([&] { return Store::open("given", partial.open()); });
  EXPECT_EQ(store.checksum(), expected.checksum());
  for (unsigned level = 0; level <= store.top(); ++level) {
    for (std::uint64_t i = 0; i < store.levels()[level].clusters; ++i) {
      ClusterPoints a, b;
      expected.read(cluster_id(level, i), a);
      brought([&] {
        store.read(cluster_id(level, i), b);
        return 0;
      });
      ASSERT_EQ(a.positions, b.positions);
    }
  }
  EXPECT_GT(requested.size(), 3u);
}

}  // namespace
}  // namespace terrace::stream
