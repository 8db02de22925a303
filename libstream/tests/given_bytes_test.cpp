// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/given_bytes.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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

// Oracle: a set of single bytes. Exactly the given bytes can be read, in any pieces.
TEST(GivenBytes, ReadsGivenBytesInAnyPieces) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const std::size_t size = 1 + random() % 200;
    const std::vector<std::byte> expected = random_bytes(size, random);
    GivenBytes files;
    files.add_file("a", size);
    const auto source = files.open()("a");
    ASSERT_EQ(source->size(), size);
    std::set<std::size_t> given_offsets;
    for (int round = 0; round < 60; ++round) {
      const std::size_t begin = random() % size, length = random() % (size - begin + 1);
      if (random() % 2 == 0) {
        files.give("a", begin, std::span(expected).subspan(begin, length));
        for (std::size_t i = 0; i < length; ++i) given_offsets.insert(begin + i);
        ASSERT_EQ(files.bytes(), given_offsets.size());
        continue;
      }
      bool is_given = true;
      for (std::size_t i = 0; i < length; ++i) is_given &= given_offsets.contains(begin + i);
      EXPECT_EQ(files.has({"a", begin, length}), is_given);
      EXPECT_FALSE(files.has({"b", begin, length}));
      std::vector<std::byte> out(length);
      try {
        source->read(begin, out);
        EXPECT_TRUE(is_given);
        EXPECT_TRUE(
            std::equal(out.begin(), out.end(), expected.begin() + static_cast<long>(begin)));
      } catch (const MissingBytes& missing) {
        EXPECT_FALSE(is_given);
        EXPECT_EQ(missing.ranges(), (std::vector<ByteRange>{{"a", begin, length}}));
      }
    }
  }
}

TEST(GivenBytes, KeepsItsLimitAndDropsTheLeastRecentlyUsed) {
  GivenBytes files(30);
  files.add_file("a", 100);
  const std::vector<std::byte> ten(10);
  const auto source = files.open()("a");
  std::vector<std::byte> out(10);
  for (const std::uint64_t offset : {0u, 20u, 40u}) files.give("a", offset, ten);
  source->read(0, out);  // now the bytes at 20 are the least recently used
  files.give("a", 60, ten);
  EXPECT_EQ(files.bytes(), 30u);
  EXPECT_NO_THROW(source->read(0, out));
  EXPECT_THROW(source->read(20, out), MissingBytes);
  files.forget("a");
  EXPECT_EQ(files.bytes(), 0u);
  EXPECT_THROW(source->read(60, out), MissingBytes);
}

// The last part is kept even if it exceeds the limit. If some of its bytes were held before, only
// its last piece is kept.
TEST(GivenBytes, KeepsTheLastPieceWhateverItsSize) {
  GivenBytes files(30);
  files.add_file("a", 100);
  const std::vector<std::byte> whole(100);
  files.give("a", 0, whole);
  EXPECT_EQ(files.bytes(), 100u);
  EXPECT_TRUE(files.has({"a", 0, 100}));

  files.forget("a");
  files.give("a", 50, std::vector<std::byte>(10));
  files.give("a", 0, whole);  // adds the bytes before 50, then the bytes from 60 on
  EXPECT_EQ(files.bytes(), 40u);
  EXPECT_TRUE(files.has({"a", 60, 40}));
  EXPECT_FALSE(files.has({"a", 0, 60}));
}

TEST(GivenBytes, RefusesImpossibleParts) {
  GivenBytes files;
  files.add_file("a", 10);
  EXPECT_NO_THROW(files.add_file("a", 10));
  EXPECT_THROW(files.add_file("a", 11), Error);
  EXPECT_THROW(files.give("b", 0, {}), Error);
  const std::vector<std::byte> two(2);
  EXPECT_THROW(files.give("a", 9, two), Error);
  EXPECT_THROW(files.give("a", UINT64_MAX, two), Error);
  EXPECT_THROW(files.open()("b"), Error);
}

// A store can be opened and read by giving the bytes that it asks for, each of them once.
TEST(GivenBytes, ReadsAStoreFromItsMissingBytes) {
  const std::string folder = std::string(TERRACE_TEST_DATA) + "/stores/grid/";
  const Store expected = Store::open(folder);
  GivenBytes files;
  std::map<std::string, std::vector<std::byte>> contents;
  std::vector<std::string> names{"manifest.json"};
  for (unsigned level = 0; level <= expected.top(); ++level) {
    names.push_back("level-" + std::to_string(level) + ".0.clusters");
    names.push_back("level-" + std::to_string(level) + ".0.index");
  }
  for (const std::string& name : names) {
    std::ifstream in(folder + name, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    ASSERT_FALSE(text.empty()) << name;
    auto& bytes = contents[name];
    bytes.resize(text.size());
    std::transform(text.begin(), text.end(), bytes.begin(),
                   [](char c) { return static_cast<std::byte>(c); });
    files.add_file(name, bytes.size());
  }
  std::set<std::pair<std::string, std::uint64_t>> requested;
  // Repeats `work`, and gives the bytes that it misses, until it returns.
  const auto with_missing_bytes = [&](auto&& work) {
    for (int round = 0; round < 100; ++round) {
      try {
        return work();
      } catch (const MissingBytes& missing) {
        for (const ByteRange& range : missing.ranges()) {
          EXPECT_TRUE(requested.emplace(range.file, range.offset).second)
              << range.file << " requested twice";
          files.give(range.file, range.offset,
                     std::span(contents[range.file])
                         .subspan(static_cast<std::size_t>(range.offset),
                                  static_cast<std::size_t>(range.bytes)));
        }
      }
    }
    throw std::runtime_error("still misses bytes after 100 rounds");
  };
  const Store store = with_missing_bytes([&] { return Store::open("given", files.open()); });
  EXPECT_EQ(store.checksum(), expected.checksum());
  for (unsigned level = 0; level <= store.top(); ++level) {
    for (std::uint64_t i = 0; i < store.levels()[level].clusters; ++i) {
      ClusterPoints a, b;
      expected.read(cluster_id(level, i), a);
      with_missing_bytes([&] { store.read(cluster_id(level, i), b); });
      ASSERT_EQ(a.positions, b.positions);
    }
  }
  EXPECT_GT(requested.size(), 3u);
}

}  // namespace
}  // namespace terrace::stream
