// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "temporary_folder.hpp"
#include "tile/set/journal.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

class TileJournalFile : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / TileJournal::kName; }
  [[nodiscard]] std::string text() const {
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::string& text) const { std::ofstream(path(), std::ios::binary) << text; }

  static FinishedTile tile(unsigned i) {
    return {100 + i, 0xFFFFFFFFFFFFFFF0u + i, 0x9E3779B97F4A7C15u * (i + 1), 0.1 * i};
  }
  static TileAddress address(unsigned i) { return {9 - i / 3, 500 + i, 380}; }
  static bool same(const FinishedTile* found, unsigned i) {
    return found != nullptr && *found == tile(i);
  }

  tests::TemporaryFolder scratch_;
  const fs::path& folder_ = scratch_.path();
};

constexpr unsigned kTiles = 7;

TEST_F(TileJournalFile, FindsFinishedTiles) {
  {
    TileJournal journal(folder_.string());
    for (unsigned i = 0; i < kTiles; ++i) journal.add(address(i), tile(i));
    // Only the work of an earlier run counts.
    EXPECT_EQ(journal.find(address(0)), nullptr);
  }
  const TileJournal journal(folder_.string());
  for (unsigned i = 0; i < kTiles; ++i) EXPECT_TRUE(same(journal.find(address(i)), i)) << i;
  EXPECT_EQ(journal.find({9, 499, 380}), nullptr);
}

TEST_F(TileJournalFile, RestartsForAnotherVersion) {
  {
    TileJournal journal(folder_.string());
    journal.add(address(0), tile(0));
  }
  const std::string good = text();
  const std::string line = good.substr(good.find('\n') + 1);
  for (const char* head : {"terrace tiles a b\n", "terrace tiles 2 0.0.0\n", "\n", "{}\n", ""}) {
    write(head + line);
    const TileJournal journal(folder_.string());
    EXPECT_EQ(journal.find(address(0)), nullptr);
    EXPECT_EQ(text(), good.substr(0, good.find('\n') + 1));
  }
}

TEST_F(TileJournalFile, UsesLastLineOfATile) {
  {
    TileJournal journal(folder_.string());
    for (unsigned i = 0; i < kTiles; ++i) journal.add(address(0), tile(i));
  }
  {
    TileJournal journal(folder_.string());
    EXPECT_TRUE(same(journal.find(address(0)), kTiles - 1));
    journal.add(address(0), tile(2));
  }
  EXPECT_TRUE(same(TileJournal(folder_.string()).find(address(0)), 2));
}

TEST_F(TileJournalFile, FinishedJournalListsExistingTiles) {
  std::vector<TileJournal::Record> records;
  for (unsigned i = 0; i < kTiles; ++i) records.emplace_back(address(i), tile(i));
  {
    TileJournal journal(folder_.string());
    for (unsigned i = 0; i < kTiles; ++i) journal.add(address(i), tile(i + 1));
    journal.finish(records);
  }
  std::vector<TileJournal::Record> sorted(records.rbegin(), records.rend());
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  EXPECT_EQ(read_tile_records(folder_.string()), sorted);
  const std::string whole = text();
  // Records may be in any order. The file is not written if nothing changed.
  const auto time = fs::last_write_time(path());
  {
    TileJournal journal(folder_.string());
    journal.finish({records.rbegin(), records.rend()});
  }
  EXPECT_EQ(text(), whole);
  EXPECT_EQ(fs::last_write_time(path()), time);
  {
    TileJournal journal(folder_.string());
    journal.add(address(3), tile(9));
    records.pop_back();
    journal.finish(records);
  }
  EXPECT_EQ(read_tile_records(folder_.string()).size(), records.size());
  EXPECT_TRUE(same(TileJournal(folder_.string()).find(address(3)), 3));
  EXPECT_TRUE(read_tile_records((folder_ / "none").string()).empty());
}

TEST_F(TileJournalFile, FinishedJournalIsSortedAfterInterruption) {
  std::vector<TileJournal::Record> records;
  for (unsigned i = 0; i < kTiles; ++i) records.emplace_back(address(i), tile(i));
  const auto add_all = [&](TileJournal& journal) {
    for (const auto& [address, finished] : records) journal.add(address, finished);
  };
  {
    TileJournal journal(folder_.string());
    add_all(journal);
    journal.finish(records);
  }
  const std::string whole = text();
  fs::remove(path());
  {
    TileJournal killed(folder_.string());
    add_all(killed);
  }
  EXPECT_NE(text(), whole);
  TileJournal(folder_.string()).finish(records);
  EXPECT_EQ(text(), whole);
}

TEST_F(TileJournalFile, TruncatedLineEndsRecords) {
  {
    TileJournal journal(folder_.string());
    for (unsigned i = 0; i < kTiles; ++i) journal.add(address(i), tile(i));
  }
  const std::string whole = text();
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    SCOPED_TRACE(length);
    write(whole.substr(0, length));
    std::size_t lines = 0;
    for (std::size_t i = 0; i < length; ++i) lines += whole[i] == '\n' ? 1 : 0;
    {
      TileJournal journal(folder_.string());
      for (unsigned i = 0; i < kTiles; ++i) {
        const FinishedTile* found = journal.find(address(i));
        // The first line is the header.
        if (i + 1 < lines) {
          EXPECT_TRUE(same(found, i)) << i;
        } else {
          EXPECT_EQ(found, nullptr) << i;
        }
      }
      journal.add({3, 1, 1}, tile(1));
    }
    // Records added after the truncation are read again.
    const TileJournal again(folder_.string());
    EXPECT_TRUE(same(again.find({3, 1, 1}), 1));
    if (lines > 1) {
      EXPECT_TRUE(same(again.find(address(0)), 0));
    }
  }
}

TEST_F(TileJournalFile, DamagedLineEndsRecords) {
  {
    TileJournal journal(folder_.string());
    for (unsigned i = 0; i < kTiles; ++i) journal.add(address(i), tile(i));
  }
  std::string damaged = text();
  // In the third line of tiles.
  std::size_t at = 0;
  for (int line = 0; line < 3; ++line) at = damaged.find('\n', at) + 1;
  damaged[at] = 'x';
  write(damaged);
  const TileJournal journal(folder_.string());
  EXPECT_TRUE(same(journal.find(address(1)), 1));
  EXPECT_EQ(journal.find(address(2)), nullptr);
  EXPECT_EQ(journal.find(address(3)), nullptr);
}

TEST(TileChecksum, IsFnv1a) {
  const auto sum = [](const std::string& text) {
    return checksum_of(std::as_bytes(std::span(text)));
  };
  // Test vectors of the algorithm's authors.
  EXPECT_EQ(sum(""), 0xCBF29CE484222325u);
  EXPECT_EQ(sum("a"), 0xAF63DC4C8601EC8Cu);
  EXPECT_EQ(sum("foobar"), 0x85944171F73967E8u);
}

}  // namespace
}  // namespace terrace::terrain
