// SPDX-License-Identifier: Apache-2.0
// Checks the statements of FORMAT.md about levels and the index one by one: a store that violates
// one of them, with good checksums, is refused when it is opened or read, or reported by verify.
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "store_invariants_testing.hpp"

namespace terrace::stream {
namespace {

using nlohmann::ordered_json;
using store::Entry;
using testing::StoreFiles;

/// A store whose manifest has fewer columns than its points is refused by every way of reading.
TEST(StoreInvariants, RefusesPointsOutsideTheRaster) {
  for (const char* const side : {"columns", "rows"}) {
    StoreFiles files = testing::grid_files();
    testing::edit_manifest(files, [&](ordered_json& m) {
      m[side] = 20;
      m["bounds"]["max"][side == std::string("columns") ? 0 : 1] = 19;
    });
    testing::expect_unreadable(files, "a point is outside the bounds of the store");
  }
  StoreFiles files = testing::cloud_files();
  testing::edit_manifest(files, [](ordered_json& m) { m["bounds"]["max"][2] = 1; });
  testing::expect_unreadable(files, "a point is outside the bounds of the store");
}

TEST(StoreInvariants, RefusesLevelsWithWrongNumbersOfMembers) {
  for (const int more : {-1, 1}) {
    StoreFiles files = testing::grid_files();
    testing::edit_manifest(files, [&](ordered_json& m) {
      ordered_json& level = m["levels"][0];
      m["points"] = level["points"] = level["points"].get<int>() + more;
      level["members"] = level["members"].get<int>() + more;
    });
    const TempFolder folder;
    testing::write_files(folder.path(), files);
    const Store store = Store::open(folder.path());
    std::uint64_t members = 0;
    EXPECT_THROW(store.for_each(0, [&](ClusterId, const ClusterRecord&,
                                       const ClusterPoints& points) { members += points.size(); }),
                 Error);
    EXPECT_LE(members, store.levels()[0].members);
    EXPECT_NE(testing::problems_of(store).find("members, not"), std::string::npos);
  }
}

struct EntryCase {
  const char* expected;
  std::function<void(Entry&)> edit;
  unsigned level = 0;
};

TEST(StoreInvariants, RefusesInvalidIndexEntries) {
  constexpr store::NumberForm kCents = 2;
  const std::vector<EntryCase> grid{
      {"an index entry has no points", [](Entry& e) { e.points = 0; }},
      {"more points than possible", [](Entry& e) { e.points = 3001; }},
      {"an index entry is out of range", [](Entry& e) { e.points = (1u << 20) + 1; }},
      {"an empty box", [](Entry& e) { e.size[1] = 0; }},
      {"an impossible box", [](Entry& e) { e.low[2] = INT64_MAX; }},
      {"an impossible box", [](Entry& e) { e.size[0] = UINT64_MAX; }},
      {"columns or rows that are not integers", [](Entry& e) { e.forms[1] = kCents; }},
      {"descendants", [](Entry& e) { e.descendants = e.points; }},
      {"descendants", [](Entry& e) { e.descendants = e.points - 1u; }, 1},
      {"descendants", [](Entry& e) { e.descendants = 3001; }, 1},
      {"an unknown number form", [](Entry& e) { e.forms[0] = store::kNumberForms; }},
      {"out of range", [](Entry& e) { e.error = 0xffe1; }},
      {"cluster 0/3", [](Entry& e) { e.points += 1; }},
      {"cluster 0/3", [](Entry& e) { e.points -= 1; }},
      {"cluster 0/3", [](Entry& e) { e.size[0] -= 1, e.size[1] -= 1; }},
  };
  for (const EntryCase& c : grid) {
    SCOPED_TRACE(c.expected);
    StoreFiles files = testing::grid_files();
    testing::edit_page(files, c.level, 0,
                       [&](auto& entries, std::uint64_t&) { c.edit(entries[3]); });
    testing::expect_unreadable(files, c.expected);
  }
  const auto bits = [](double value) { return store::ordered_bits(value); };
  const std::vector<EntryCase> cloud{
      {"an impossible box",
       [&](Entry& e) {
         e.forms[0] = store::kDoubleBits;
         e.low[0] = bits(std::numeric_limits<double>::infinity());
       }},
      {"an impossible box",
       [&](Entry& e) {
         e.forms[0] = store::kDoubleBits;
         e.low[0] = bits(1.0);
         e.size[0] = static_cast<std::uint64_t>(INT64_MAX - bits(1.0));
       }},
      {"an impossible box",
       [](Entry& e) {
         e.forms[0] = store::kFloatBits;
         e.low[0] = std::int64_t{1} << 40;
       }},
  };
  for (const EntryCase& c : cloud) {
    SCOPED_TRACE(c.expected);
    StoreFiles files = testing::cloud_files();
    testing::edit_page(files, c.level, 0,
                       [&](auto& entries, std::uint64_t&) { c.edit(entries[3]); });
    testing::expect_unreadable(files, c.expected);
  }
}

TEST(StoreInvariants, FindsClustersThatAreNotContiguous) {
  StoreFiles files = testing::grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { ++offset; });
  testing::expect_problem(files, "its bytes are not contiguous");
  files = testing::grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { offset = UINT64_MAX - 9; });
  testing::expect_unreadable(files, "an index entry is out of range");
  files = testing::grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { offset = 1u << 30; });
  testing::expect_unreadable(files, "beyond the end of the file");
  files = testing::grid_files();
  files["level-0.0.clusters"] += "more";
  testing::update_checksums(files);
  testing::expect_problem(files, "the clusters do not end where the file does");
}

/// Returns the store of a raster after edit(level 0) and updating the checksums.
StoreFiles with_edited_index(const std::function<void(testing::LevelBytes&)>& edit) {
  StoreFiles files = testing::grid_files();
  auto manifest = ordered_json::parse(files["manifest.json"]);
  bool done = false;
  testing::for_each_level(files, manifest, [&](testing::LevelBytes& level, ordered_json& segment) {
    if (std::exchange(done, true)) return;
    edit(level);
    segment["directory_bytes"] = level.directory_bytes;
  });
  files["manifest.json"] = manifest.dump(2) + "\n";
  testing::update_checksums(files);
  return files;
}

/// Returns the store of a raster after edit(parts of the index of level 0) and updating the
/// checksums.
StoreFiles with_edited_parts(const std::function<void(testing::IndexParts&)>& edit) {
  return with_edited_index([&](testing::LevelBytes& level) {
    testing::IndexParts parts(level);
    edit(parts);
    parts.assemble(level);
  });
}

TEST(StoreInvariants, RefusesInvalidDirectories) {
  using Edit = std::function<void(testing::LevelBytes&)>;
  // The fields for one chapter: bytes of its pages, bytes of its contents, its box, number of sets,
  // the first set's ordinal and bytes.
  enum Field { kPages, kContents, kSets, kOrdinal };
  /// Replaces the first byte of a field.
  const auto put = [](Field field, char byte) -> Edit {
    return [field, byte](testing::LevelBytes& level) {
      store::ByteReader in(level.bytes({level.directory(), level.index.size()}));
      if (field > kPages) in.varint();
      if (field > kContents) in.varint();
      if (field > kContents) in.take(testing::kChapterBoxBytes);
      if (field > kSets) in.varint();
      level.index[level.directory() + in.offset()] = byte;
    };
  };
  const auto parts = [](const std::function<void(testing::IndexParts&)>& edit) -> Edit {
    return [edit](testing::LevelBytes& level) {
      testing::IndexParts index(level);
      edit(index);
      index.assemble(level);
    };
  };
  const auto more = [](std::size_t bytes) -> Edit {
    return [bytes](testing::LevelBytes& level) {
      level.index.insert(level.index.size() - 4, bytes, '\0');
      level.directory_bytes += bytes;
    };
  };
  const std::vector<std::pair<const char*, Edit>> cases{
      {"the contents of a chapter have an impossible size", put(kPages, '\xff')},
      {"the contents of a chapter have an impossible size", put(kContents, '\x0a')},
      {"the level has no tables", parts([](auto& index) { index.sets.clear(); })},
      {"the data end too early", put(kSets, '\x02')},
      {"the tables are not in the order of their clusters", put(kOrdinal, '\x01')},
      {"the tables do not end where the directory begins",
       [](auto& level) { level.index.insert(0, "more"); }},
      {"bytes follow the directory", more(1)},
      {"too large for the level's clusters", more(4u << 20)},
  };
  for (const auto& [expected, edit] : cases) {
    SCOPED_TRACE(expected);
    testing::expect_refused(with_edited_index(edit), expected);
  }
}

TEST(StoreInvariants, RefusesInvalidContentsOfChapters) {
  for (const int more : {-1, 1}) {
    const StoreFiles files = with_edited_index([&](testing::LevelBytes& level) {
      char& size_of_first = level.index[level.chapters[0].begin];
      size_of_first = static_cast<char>(size_of_first + more);
    });
    testing::expect_unreadable(files, "the sizes of a chapter's pages do not add up");
  }
}

/// Adds a second set of tables to level 0, used from cluster `first` on.
StoreFiles with_second_tables(std::uint64_t first, bool damaged) {
  return with_edited_parts([&](testing::IndexParts& index) {
    index.sets.emplace_back(first, index.sets.front().second);
    if (damaged) index.sets.back().second.back() = '\x7f';
  });
}

TEST(StoreInvariants, ReadsClustersWithTheirSetOfTables) {
  const TempFolder folder;
  testing::write_files(folder.path(), with_second_tables(100, false));
  EXPECT_EQ(testing::problems_of(Store::open(folder.path())), "");
  testing::expect_refused(with_second_tables(0, false),
                          "the tables are not in the order of their clusters");
  testing::expect_refused(with_second_tables(1000, false), "clusters that do not exist");
  testing::expect_unreadable(with_second_tables(100, true), "table");
}

TEST(StoreInvariants, FindsBoxesOfPagesThatExcludeClusters) {
  for (std::size_t place = 0; place < 6; ++place) {
    // The second page's box, with a low end raised or a high end lowered.
    testing::expect_problem(with_edited_parts([&](testing::IndexParts& index) {
                              char& end = index.pages[1].box[place];
                              end = static_cast<char>(end + (place % 2 == 0 ? 8 : -8));
                            }),
                            "the box exceeds its page's");
    // The box of its chapter.
    testing::expect_problem(with_edited_parts([&](testing::IndexParts& index) {
                              char& end = index.chapter_boxes[0][2 * place + 1];
                              end = static_cast<char>(end + (place % 2 == 0 ? 8 : -8));
                            }),
                            "the box exceeds its page's");
  }
}

}  // namespace
}  // namespace terrace::stream
