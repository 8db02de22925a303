// SPDX-License-Identifier: Apache-2.0
// Checks the statements of FORMAT.md one by one: a store that violates one of them, with good
// checksums, is refused when it is opened or read, or reported by verify.
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store/codec/column.hpp"
#include "store/codec/form.hpp"
#include "store/read/cluster_decoder.hpp"
#include "store_inputs.hpp"
#include "store_mending.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

using nlohmann::ordered_json;
using store::Entry;
using testing::OwnedBlock;
using testing::StoreFiles;
using testing::TemporaryFolder;

constexpr std::uint64_t kColumns = 60, kRows = 50;

StoreSchema small_grid() {
  StoreSchema schema = testing::grid_schema(ScalarType::i16);
  schema.columns = kColumns;
  schema.rows = kRows;
  return schema;
}

const testing::StandInHierarchy::Options kOptions{.block_points = 200, .cluster_points = 8};

std::vector<testing::Block> small_blocks() {
  return testing::grid_blocks(ScalarType::i16, testing::Relief::fractal, kColumns, kRows, 12, 1);
}

/// Returns the store of a raster with three levels, and several pages on level 0.
const StoreFiles& grid_files() {
  static const StoreFiles files = [] {
    const TemporaryFolder folder;
    testing::write_store(folder.path() / "s", small_grid(), small_blocks(), kOptions);
    return testing::read_files(folder.path() / "s");
  }();
  return files;
}

const StoreFiles& cloud_files() {
  static const StoreFiles files = [] {
    const TemporaryFolder folder;
    testing::write_store(folder.path() / "s", testing::cloud_schema(),
                         testing::cloud_blocks(testing::Numbers::mixed, 3000, 200, 1), kOptions);
    return testing::read_files(folder.path() / "s");
  }();
  return files;
}

std::string opening(const std::filesystem::path& path) {
  try {
    Store::open(path);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// Checks that the problems are the same, in the same order, for any number of threads.
std::string problems_of(const Store& store) {
  std::string problems, by_threads;
  store.verify([&](const Problem& problem) { problems += problem.what + "\n"; });
  store.verify([&](const Problem& problem) { by_threads += problem.what + "\n"; }, 3);
  EXPECT_EQ(by_threads, problems);
  return problems;
}

/// Expects that the store opens, that reading all of it throws `expected`, and that verify reports
/// it too.
void expect_unreadable(const StoreFiles& files, const std::string& expected) {
  const TemporaryFolder folder;
  testing::write_files(folder.path(), files);
  const Store store = Store::open(folder.path());
  std::string refused;
  try {
    testing::all_points(store);
  } catch (const Error& error) {
    refused = error.what();
  }
  EXPECT_NE(refused.find(expected), refused.npos) << refused << "\nexpected: " << expected;
  const std::string problems = problems_of(store);
  EXPECT_NE(problems.find(expected), problems.npos) << problems << "\nexpected: " << expected;
}

void expect_problem(const StoreFiles& files, const std::string& expected) {
  const TemporaryFolder folder;
  testing::write_files(folder.path(), files);
  const std::string problems = problems_of(Store::open(folder.path()));
  EXPECT_NE(problems.find(expected), problems.npos) << problems << "\nexpected: " << expected;
}

void expect_refused(const StoreFiles& files, const std::string& expected) {
  const TemporaryFolder folder;
  testing::write_files(folder.path(), files);
  const std::string refused = opening(folder.path());
  EXPECT_NE(refused.find(expected), refused.npos) << refused << "\nexpected: " << expected;
}

TEST(StoreInvariants, MendingASoundStoreChangesNothing) {
  for (StoreFiles files : {grid_files(), cloud_files()}) {
    const StoreFiles before = files;
    testing::mend(files);
    EXPECT_TRUE(files == before);
    testing::edit_page(files, 0, 1, [](std::vector<Entry>&, std::uint64_t&) {});
    EXPECT_TRUE(files == before);
    const TemporaryFolder folder;
    testing::write_files(folder.path(), files);
    EXPECT_EQ(problems_of(Store::open(folder.path())), "");
  }
}

struct ManifestCase {
  const char* expected;
  std::function<void(ordered_json&)> edit;
};

TEST(StoreInvariants, RefusesManifestsWithInvalidCounts) {
  const auto level = [](ordered_json& m, std::size_t l) -> ordered_json& { return m["levels"][l]; };
  const std::vector<ManifestCase> cases{
      {"the points of level 0", [](auto& m) { m["points"] = 1; }},
      {"a count is not an unsigned", [](auto& m) { m["points"] = -1; }},
      {"a count is not an unsigned", [](auto& m) { m["points"] = 2500.5; }},
      {"a count is not an unsigned", [](auto& m) { m["nodata"] = 1e30; }},
      {"more points than possible", [](auto& m) { m["nodata"] = std::uint64_t{1} << 60; }},
      {"the number of levels", [](auto& m) { m["levels"] = ordered_json::array(); }},
      {"the levels are not numbered", [&](auto& m) { level(m, 1)["level"] = 2; }},
      {"the members of level 0", [&](auto& m) { level(m, 0)["members"] = 5; }},
      {"the members of level 0", [&](auto& m) { level(m, 1)["points"] = 100000; }},
      {"does not have the level's clusters", [&](auto& m) { level(m, 0)["clusters"] = 5; }},
      {"the clusters of level 0",
       [&](auto& m) {
         level(m, 0)["clusters"] = 5;
         level(m, 0)["segments"][0]["clusters"] = 5;
       }},
      {"does not have one segment",
       [&](auto& m) { level(m, 0)["segments"].push_back(level(m, 0)["segments"][0]); }},
      // A number of clusters that is only possible if products wrap.
      {"more points than possible",
       [&](auto& m) {
         const std::uint64_t many = std::numeric_limits<std::uint64_t>::max();
         m["points"] = level(m, 0)["points"] = many;
         level(m, 1)["points"] = level(m, 0)["clusters"] = many;
         level(m, 0)["segments"][0]["clusters"] = many;
         level(m, 0)["members"] = 0;
       }},
      {"more clusters than its index",
       [&](auto& m) {
         const std::uint64_t many = std::uint64_t{1} << 40;
         m["points"] = level(m, 0)["points"] = 2 * many;
         level(m, 1)["points"] = level(m, 0)["clusters"] = many;
         level(m, 0)["segments"][0]["clusters"] = many;
         level(m, 0)["members"] = many;
       }},
      {"more points than its clusters",
       [&](auto& m) {
         const std::uint64_t clusters = level(m, 0)["clusters"];
         m["points"] = level(m, 0)["points"] = std::uint64_t{1} << 40;
         level(m, 0)["members"] = (std::uint64_t{1} << 40) - clusters;
       }},
      {"a store without points has clusters",
       [&](auto& m) {
         m["points"] = 0;
         m["bounds"] = nullptr;
         for (auto& l : m["levels"]) l["points"] = l["members"] = 0;
       }},
      {"a file name is not allowed",
       [&](auto& m) { level(m, 0)["segments"][0]["data"]["file"] = "../x"; }},
      {"a file name is not allowed",
       [&](auto& m) { level(m, 0)["segments"][0]["data"]["file"] = ".x"; }},
      {"smaller than its directory",
       [&](auto& m) { level(m, 0)["segments"][0]["directory_bytes"] = std::uint64_t{1} << 62; }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = grid_files();
    testing::edit_manifest(files, c.edit);
    expect_refused(files, c.expected);
  }
}

TEST(StoreInvariants, RefusesManifestsWithInvalidPlaces) {
  const std::vector<ManifestCase> cases{
      {"the bounds are missing or empty", [](auto& m) { m["bounds"] = nullptr; }},
      {"the bounds are missing or empty", [](auto& m) { m["bounds"]["min"][2] = "nan"; }},
      {"the bounds are missing or empty", [](auto& m) { m["bounds"]["min"][2] = 1e9; }},
      {"the bounds are not finite", [](auto& m) { m["bounds"]["max"][2] = "inf"; }},
      {"not finite in the CRS", [](auto& m) { m["coordinates"][2]["scale"] = 1e308; }},
      {"on the raster's columns", [](auto& m) { m["columns"] = 20; }},
      {"on the raster's columns", [](auto& m) { m["rows"] = 49; }},
      {"on the raster's columns", [](auto& m) { m["bounds"]["min"][0] = -1; }},
      {"on the raster's columns", [](auto& m) { m["bounds"]["max"][1] = 48.5; }},
      {"number of columns", [](auto& m) { m["columns"] = 0; }},
      {"number of columns", [](auto& m) { m["rows"] = std::uint64_t{1} << 32; }},
      {"a cloud has columns", [](auto& m) { m["kind"] = "cloud"; }},
      {"scale or offset", [](auto& m) { m["coordinates"][2]["scale"] = 0; }},
      {"scale or offset", [](auto& m) { m["coordinates"][2]["scale"] = "nan"; }},
      {"scale or offset", [](auto& m) { m["coordinates"][0]["offset"] = "-inf"; }},
      {"the world transform", [](auto& m) { m["world"][0] = 0; }},
      {"the world transform", [](auto& m) { m["world"][5] = "nan"; }},
      {"an EPSG code", [](auto& m) { m["crs"]["epsg"] = std::uint64_t{1} << 31; }},
      {"a count", [](auto& m) { m["crs"]["epsg"] = 1e300; }},
      {"a count", [](auto& m) { m["crs"]["vertical_epsg"] = -5; }},
      {"an unknown type", [](auto& m) { m["coordinates"][0]["type"] = "int3"; }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = grid_files();
    testing::edit_manifest(files, c.edit);
    expect_refused(files, c.expected);
  }
}

TEST(StoreInvariants, RefusesManifestsWithUnknownWords) {
  const auto parameter = [](ordered_json& m, const char* value) {
    m["parameters"].push_back({{"name", "entities"}, {"value", value}});
  };
  const std::vector<ManifestCase> cases{
      {"the kind is unknown", [](auto& m) { m["kind"] = "<b>grid</b>"; }},
      {"unknown type", [](auto& m) { m["coordinates"][2]["type"] = "int24"; }},
      {"the kind of heights", [](auto& m) { m["vertical"] = "<b>ellipsoidal</b>"; }},
      {"the entities are unknown", [&](auto& m) { parameter(m, "<img src=x onerror=alert(1)>"); }},
      {"the entities are unknown", [&](auto& m) { parameter(m, "triangle"); }},
      {"the entities are unknown", [&](auto& m) { parameter(m, ""); }},
  };
  for (const ManifestCase& c : cases) {
    SCOPED_TRACE(c.expected);
    StoreFiles files = cloud_files();
    testing::edit_manifest(files, c.edit);
    expect_refused(files, c.expected);
  }
  for (const Entities known :
       {Entities::points, Entities::triangles, Entities::segments, Entities::polylines}) {
    StoreFiles files = cloud_files();
    testing::edit_manifest(
        files, [&](ordered_json& m) { parameter(m, std::string(name_of(known)).c_str()); });
    const TemporaryFolder folder;
    testing::write_files(folder.path(), files);
    EXPECT_EQ(opening(folder.path()), "") << name_of(known);
  }
}

TEST(StoreInvariants, VerifyFindsManifestsWithWrongKeysOrSummaries) {
  const char* const order = "keys or their order are wrong";
  const std::vector<ManifestCase> cases{
      {order,
       [](auto& m) {
         ordered_json other{{"more", 1}};
         other.update(m);
         m = other;
       }},
      {order, [](auto& m) { m["levels"][0]["more"] = 1; }},
      {order,
       [](auto& m) {
         ordered_json other{{"kind", m["kind"]}};
         other.update(m);
         m = other;
       }},
      {order, [](auto& m) { m["coordinates"][0]["type"] = "int"; }},  // PLY's name of int32
      {"the bounds are not those of the points", [](auto& m) { m["bounds"]["min"][2] = -1e6; }},
      {"the mean height", [](auto& m) { m["mean_height"] = 0; }},
      {"the mean height", [](auto& m) { m["mean_height"] = "nan"; }},
  };
  for (const ManifestCase& c : cases) {
    StoreFiles files = grid_files();
    testing::edit_manifest(files, c.edit);
    expect_problem(files, c.expected);
  }
  // mend() recomputes these, so they are changed as text.
  StoreFiles files = grid_files();
  std::string& text = files["manifest.json"];
  const std::size_t at = text.find("\"crc32\": \"") + 10;
  std::transform(text.begin() + static_cast<std::ptrdiff_t>(at),
                 text.begin() + static_cast<std::ptrdiff_t>(at + 8),
                 text.begin() + static_cast<std::ptrdiff_t>(at),
                 [](char c) { return static_cast<char>(std::toupper(c)); });
  ASSERT_NE(text, grid_files().at("manifest.json"));
  text.replace(text.size() - 12, 8, "00000000");
  const std::string checksum = store::hexadecimal(testing::crc32_of(text, 0, text.size()));
  text.replace(text.size() - 12, 8, checksum);
  expect_problem(files, order);
}

/// A store whose manifest has fewer columns than its points is refused by every way of reading.
TEST(StoreInvariants, RefusesPointsOutsideTheRaster) {
  for (const char* const side : {"columns", "rows"}) {
    StoreFiles files = grid_files();
    testing::edit_manifest(files, [&](ordered_json& m) {
      m[side] = 20;
      m["bounds"]["max"][side == std::string("columns") ? 0 : 1] = 19;
    });
    expect_unreadable(files, "a point is outside the bounds of the store");
  }
  StoreFiles files = cloud_files();
  testing::edit_manifest(files, [](ordered_json& m) { m["bounds"]["max"][2] = 1; });
  expect_unreadable(files, "a point is outside the bounds of the store");
}

TEST(StoreInvariants, RefusesLevelsWithWrongNumbersOfMembers) {
  for (const int more : {-1, 1}) {
    StoreFiles files = grid_files();
    testing::edit_manifest(files, [&](ordered_json& m) {
      ordered_json& level = m["levels"][0];
      m["points"] = level["points"] = level["points"].get<int>() + more;
      level["members"] = level["members"].get<int>() + more;
    });
    const TemporaryFolder folder;
    testing::write_files(folder.path(), files);
    const Store store = Store::open(folder.path());
    std::uint64_t members = 0;
    EXPECT_THROW(store.for_each(0, [&](ClusterId, const ClusterRecord&,
                                       const ClusterPoints& points) { members += points.size(); }),
                 Error);
    EXPECT_LE(members, store.levels()[0].members);
    EXPECT_NE(problems_of(store).find("members, not"), std::string::npos);
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
    StoreFiles files = grid_files();
    testing::edit_page(files, c.level, 0,
                       [&](auto& entries, std::uint64_t&) { c.edit(entries[3]); });
    expect_unreadable(files, c.expected);
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
    StoreFiles files = cloud_files();
    testing::edit_page(files, c.level, 0,
                       [&](auto& entries, std::uint64_t&) { c.edit(entries[3]); });
    expect_unreadable(files, c.expected);
  }
}

TEST(StoreInvariants, FindsClustersThatAreNotContiguous) {
  StoreFiles files = grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { ++offset; });
  expect_problem(files, "its bytes are not contiguous");
  files = grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { offset = UINT64_MAX - 9; });
  expect_unreadable(files, "an index entry is out of range");
  files = grid_files();
  testing::edit_page(files, 0, 1, [](auto&, std::uint64_t& offset) { offset = 1u << 30; });
  expect_unreadable(files, "beyond the end of the file");
  files = grid_files();
  files["level-0.0.clusters"] += "more";
  testing::mend(files);
  expect_problem(files, "the clusters do not end where the file does");
}

/// Returns the store of a raster after edit(level 0) and mending.
StoreFiles with_edited_index(const std::function<void(testing::LevelBytes&)>& edit) {
  StoreFiles files = grid_files();
  auto manifest = ordered_json::parse(files["manifest.json"]);
  bool done = false;
  testing::for_each_level(files, manifest, [&](testing::LevelBytes& level, ordered_json& segment) {
    if (std::exchange(done, true)) return;
    edit(level);
    segment["directory_bytes"] = level.directory_bytes;
  });
  files["manifest.json"] = manifest.dump(2) + "\n";
  testing::mend(files);
  return files;
}

/// Returns the store of a raster after edit(parts of the index of level 0) and mending.
StoreFiles with_edited_parts(const std::function<void(testing::IndexParts&)>& edit) {
  return with_edited_index([&](testing::LevelBytes& level) {
    testing::IndexParts parts(level);
    edit(parts);
    parts.put_together(level);
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
      if (field > kContents) in.take(12);
      if (field > kSets) in.varint();
      level.index[level.directory() + in.offset()] = byte;
    };
  };
  const auto parts = [](const std::function<void(testing::IndexParts&)>& edit) -> Edit {
    return [edit](testing::LevelBytes& level) {
      testing::IndexParts found(level);
      edit(found);
      found.put_together(level);
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
    expect_refused(with_edited_index(edit), expected);
  }
}

TEST(StoreInvariants, RefusesInvalidContentsOfChapters) {
  for (const int more : {-1, 1}) {
    const StoreFiles files = with_edited_index([&](testing::LevelBytes& level) {
      char& size_of_first = level.index[level.contents[0].begin];
      size_of_first = static_cast<char>(size_of_first + more);
    });
    expect_unreadable(files, "the sizes of a chapter's pages do not add up");
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
  const TemporaryFolder folder;
  testing::write_files(folder.path(), with_second_tables(100, false));
  EXPECT_EQ(problems_of(Store::open(folder.path())), "");
  expect_refused(with_second_tables(0, false), "the tables are not in the order of their clusters");
  expect_refused(with_second_tables(1000, false), "clusters that do not exist");
  expect_unreadable(with_second_tables(100, true), "table");
}

TEST(StoreInvariants, FindsBoxesOfPagesThatExcludeClusters) {
  for (std::size_t place = 0; place < 6; ++place) {
    // The second page's box, with a low end raised or a high end lowered.
    expect_problem(with_edited_parts([&](testing::IndexParts& index) {
                     char& end = index.pages[1].box[place];
                     end = static_cast<char>(end + (place % 2 == 0 ? 8 : -8));
                   }),
                   "the box exceeds its page's");
    // The box of its chapter.
    expect_problem(with_edited_parts([&](testing::IndexParts& index) {
                     char& end = index.chapter_boxes[0][2 * place + 1];
                     end = static_cast<char>(end + (place % 2 == 0 ? 8 : -8));
                   }),
                   "the box exceeds its page's");
  }
}

/// Returns tables in which every symbol can be coded, so that any cluster can be written.
store::Tables even_tables(const store::Layout& layout, store::ColumnKind kind) {
  store::Tables tables;
  tables.kinds.assign(layout.columns(), kind);
  std::array<std::uint32_t, store::kSymbols> counts{};
  for (unsigned s = 0; s < 40; ++s) counts[s] = 40;
  tables.frequencies.assign(layout.contexts(), store::normalised(counts));
  return tables;
}

/// Decodes a cluster of `points` points in the box (0, 0, 0) to (width - 1, 7, 7). Returns the
/// error, or "read".
std::string decoding(bool grid, std::uint32_t points, std::uint32_t last,
                     const std::function<void(store::SymbolEncoder&)>& write,
                     const std::function<void(store::Bytes&)>& change = {},
                     store::ColumnKind kind = store::ColumnKind::plain, std::uint64_t width = 8) {
  StoreSchema schema;
  schema.grid = grid;
  const store::Layout layout(schema, 0);
  const store::Tables tables = even_tables(layout, kind);
  const store::EncodingTables encoding(tables);
  const store::DecodingTables decoding(tables);
  store::SymbolEncoder encoder(encoding.tables);
  encoder.start();
  write(encoder);
  store::Bytes bytes(store::kPadding);
  encoder.finish(last, bytes);
  if (change) change(bytes);
  Entry entry;
  entry.points = points;
  entry.size = {width, 8, 8};
  entry.bytes = static_cast<std::uint32_t>(bytes.size() - store::kPadding);
  bytes.resize(bytes.size() + store::kPadding);
  store::ClusterDecoder decoder;
  ClusterPoints out;
  try {
    decoder.decode(layout, decoding, entry,
                   store::ByteView(bytes).subspan(store::kPadding, entry.bytes), false, out);
  } catch (const store::Damage& damage) {
    return damage.what();
  }
  EXPECT_EQ(out.size() + 1, points);
  return "read";
}

TEST(StoreInvariants, RefusesClustersThatBreakTheRules) {
  using store::SymbolEncoder;
  namespace context = store::context;
  const auto number = [](SymbolEncoder& coder, unsigned where, std::uint64_t value) {
    store::code_number(coder, where, value);
  };
  const auto one_point = [&](SymbolEncoder& coder) {
    coder.symbol(context::kForm, store::kSplitForm);
    for (std::uint64_t axis = 0; axis < 3; ++axis) store::code_uniform(coder, axis, 8);
  };
  const auto own_box = [&](SymbolEncoder& coder, std::uint64_t below, std::uint64_t above) {
    coder.symbol(context::kForm, store::kSplitForm | store::kOwnBoxForm);
    for (unsigned side = 0; side < 6; ++side) {
      number(coder, context::kInset + side, side == 0 ? below : side == 1 ? above : 7 * (side % 2));
    }
  };
  const auto run = [&](SymbolEncoder& coder, std::uint64_t begin, std::uint64_t length) {
    coder.symbol(context::kForm, 0);
    number(coder, context::kRunCount, 1);
    number(coder, context::kRunStart, begin);
    number(coder, context::kRunEnd, length - 1);
    for (unsigned row = 1; row < 8; ++row) number(coder, context::kRunCount + (row == 1), 0);
  };
  // A correct cluster is read.
  EXPECT_EQ(decoding(false, 1, 0, one_point), "read");
  EXPECT_EQ(decoding(false, 1, 0, [&](auto& coder) { own_box(coder, 3, 4); }), "read");
  const auto flat_run = [&](SymbolEncoder& coder) {
    run(coder, 2, 1);
    number(coder, context::kHeight + 63, 4);
  };
  EXPECT_EQ(decoding(true, 1, 0, flat_run), "read");

  EXPECT_EQ(decoding(false, 1, 1, one_point),
            "a cluster's representative is not one of its points");
  EXPECT_EQ(decoding(false, 1, 0, [](auto& coder) { coder.symbol(context::kForm, 4); }),
            "a cluster has an unknown form");
  EXPECT_EQ(decoding(false, 1, 0, [&](auto& coder) { own_box(coder, 4, 4); }),
            "a cluster's own box is not inside its index entry's");
  EXPECT_EQ(decoding(true, 1, 0, flat_run, {}, store::ColumnKind::plain, 100000),
            "a cluster's box does not fit its form");
  EXPECT_EQ(decoding(true, 1, 0, [&](auto& coder) { run(coder, 8, 1); }),
            "a run is outside its cluster");
  EXPECT_EQ(decoding(true, 1, 0, [&](auto& coder) { run(coder, 2, 2); }),
            "a run is outside its cluster");
  EXPECT_EQ(decoding(true, 2, 0, [&](auto& coder) { run(coder, 2, 1); }),
            "a cluster has too few cells");
  EXPECT_EQ(decoding(true, 1, 0,
                     [&](auto& coder) {
                       run(coder, 2, 1);
                       number(coder, context::kHeight + 63, 10);
                     }),
            "a height is outside its cluster's box");
  EXPECT_EQ(decoding(false, 2, 0,
                     [](auto& coder) {
                       coder.symbol(context::kForm, store::kSplitForm);
                       coder.symbol(context::kSplit, 3);
                     }),
            "a part of a cluster has more points than the whole");
  // Nine raw bits are followed by seven bits of padding.
  const char* const ends = "coded bytes do not end after their last number";
  EXPECT_EQ(
      decoding(false, 1, 0, one_point, [](store::Bytes& bytes) { bytes[bytes.size() - 2] ^= 1; }),
      ends);
  EXPECT_EQ(decoding(false, 1, 0, one_point,
                     [](store::Bytes& bytes) { bytes.insert(bytes.end() - 2, 1, 0); }),
            ends);
  // 2^20 points at one place take a few bytes; more are refused.
  const auto same_place = [&](SymbolEncoder& coder) {
    coder.symbol(context::kForm, store::kSplitForm | store::kOwnBoxForm);
    for (unsigned side = 0; side < 6; ++side) number(coder, context::kInset + side, 7 * (side % 2));
    coder.raw(0, 16);
  };
  EXPECT_EQ(decoding(false, 1u << 20, 0, same_place), "read");
  EXPECT_EQ(decoding(false, (1u << 20) + 1, 0, same_place), "a cluster has too many points");
}

TEST(StoreInvariants, RefusesColumnsThatBreakTheRules) {
  using store::ColumnKind;
  using store::SymbolEncoder;
  constexpr unsigned kAxis = store::context::kAttribute, kNext = store::context::kPerAttribute;
  const auto number = [](SymbolEncoder& coder, unsigned where, std::uint64_t value) {
    store::code_number(coder, where, value);
  };
  // Writes the places of two points: `first` writes the column of x; y and z are 5 for both.
  const auto places = [number](const std::function<void(SymbolEncoder&)>& first) {
    return [first, number](SymbolEncoder& coder) {
      coder.symbol(store::context::kForm, 0);
      first(coder);
      for (unsigned axis = 1; axis < 3; ++axis) {
        coder.symbol(kAxis + kNext * axis, 0);
        number(coder, kAxis + kNext * axis + 1, 10);
      }
    };
  };
  const auto column = [number](unsigned head, const std::vector<std::uint64_t>& numbers) {
    return [head, numbers, number](SymbolEncoder& coder) {
      coder.symbol(kAxis, head);
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        // The first value and the divisor, then a difference in the context of the first value's
        // class.
        const bool last = head != 0 && i + 1 == numbers.size();
        const unsigned step = store::difference_step(store::class_of(numbers[0]));
        number(coder, last ? kAxis + 2 + step : kAxis + 1, numbers[i]);
      }
    };
  };
  EXPECT_EQ(decoding(false, 2, 0, places(column(0, {14}))), "read");
  EXPECT_EQ(decoding(false, 2, 0, places(column(1, {4, 10}))), "read");
  EXPECT_EQ(decoding(false, 2, 0, places(column(2, {4, 5, 2}))), "read");

  const char* const outside = "a point is outside its cluster's box";
  EXPECT_EQ(decoding(false, 2, 0, places(column(0, {16}))), outside);
  EXPECT_EQ(decoding(false, 2, 0, places(column(0, {1}))), outside);
  EXPECT_EQ(decoding(false, 2, 0, places(column(1, {4, 12}))), outside);
  EXPECT_EQ(decoding(false, 2, 0, places(column(2, {4, 6, 2}))), outside);
  EXPECT_EQ(decoding(false, 2, 0, places(column(3, {4, 10}))), "a column has an unknown head");
  EXPECT_EQ(decoding(false, 2, 0, places(column(2, {4, 1, 2}))), "a column has a divisor below 2");
  const auto recent = [number](unsigned place) {
    return [place, number](SymbolEncoder& coder) {
      coder.symbol(kAxis, 1);
      number(coder, kAxis + 1, 4);
      coder.symbol(kAxis + 2, place);
    };
  };
  EXPECT_EQ(decoding(false, 2, 0, places(recent(1)), {}, ColumnKind::recent), "read");
  EXPECT_EQ(decoding(false, 2, 0, places(recent(4)), {}, ColumnKind::recent),
            "a column has an unknown difference");
}

TEST(StoreInvariants, RefusesUnknownKindsOfColumns) {
  StoreSchema schema;
  schema.attributes = {{.name = "a", .type = ScalarType::u8},
                       {.name = "b", .type = ScalarType::f32},
                       {.name = "c", .type = ScalarType::u16},
                       {.name = "d", .type = ScalarType::i64}};
  const store::Layout layout(schema, 0);
  for (std::size_t column = 0; column < layout.columns(); ++column) {
    store::Tables tables = even_tables(layout, store::ColumnKind::plain);
    tables.kinds[column] = store::ColumnKind::preceding;
    store::Bytes bytes;
    tables.write(bytes);
    if (column == 3) {
      EXPECT_EQ(store::Tables::read(bytes, layout).kinds, tables.kinds);
    } else {
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    }
    const std::size_t kind = 9 + column, guide = 8;
    bytes[kind] = 3;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    // With a guide there are more kinds, except for the guide itself.
    bytes[guide] = 4;
    if (column == 3) {
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage);
      bytes[kind] = 2;
      EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage);
      bytes[kind] = 1;
    }
    EXPECT_EQ(store::Tables::read(bytes, layout).guide.attribute, 3u);
    bytes[kind] = 10;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
    bytes[kind] = 0;
    bytes[guide] = 5;
    EXPECT_THROW(store::Tables::read(bytes, layout), store::Damage) << column;
  }
}

/// Clusters that would take much memory are neither written nor read, however few bytes they have.
TEST(StoreInvariants, RefusesClustersThatTakeMuchMemory) {
  StoreSchema schema = testing::cloud_schema();
  for (int i = 0; i < 4096; ++i) {
    schema.attributes.push_back(testing::channel(std::to_string(i)));
  }
  const std::uint64_t most = store::Layout(schema, 0).max_points();
  EXPECT_LE(most * schema.payload_size(), std::uint64_t{1} << 28);
  const TemporaryFolder folder;
  StoreWriter writer(folder.path() / "s", schema);
  const std::vector<Point3> positions(most + 1);
  std::vector<std::uint32_t> order(most + 1);
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const std::vector<std::byte> payload(positions.size() * schema.payload_size());
  const std::vector<std::uint32_t> first{0, static_cast<std::uint32_t>(most + 1)},
      none{kNoRepresentative};
  EXPECT_THROW(writer.finish({.level = 0,
                              .positions = positions,
                              .payload = payload,
                              .children = {},
                              .first = first,
                              .order = order,
                              .representatives = none,
                              .summaries = {}}),
               Error);
}

/// Returns the store of small_blocks(), written from its hierarchy after `edit`.
StoreFiles rewritten(const std::function<void(std::vector<OwnedBlock>&)>& edit) {
  std::vector<std::vector<Point3>> blocks;
  for (const auto& block : small_blocks()) blocks.push_back(block.positions);
  std::vector<OwnedBlock> recorded = testing::recorded_hierarchy(blocks, kOptions);
  edit(recorded);
  const TemporaryFolder folder;
  StoreWriter writer(folder.path() / "s", small_grid());
  for (const OwnedBlock& block : recorded) {
    if (block.representatives[0] == kNoRepresentative) {
      writer.finish(block.view());
    } else {
      writer.append(writer.encode(block.view()));
    }
  }
  return testing::read_files(folder.path() / "s");
}

OwnedBlock& block_of(std::vector<OwnedBlock>& blocks, unsigned level) {
  return *std::find_if(blocks.begin(), blocks.end(),
                       [&](const OwnedBlock& block) { return block.level == level; });
}

TEST(StoreInvariants, VerifyFindsInvalidHierarchies) {
  EXPECT_TRUE(rewritten([](auto&) {}) == grid_files());
  // Returns a point of the first block of level 1 that does not represent a cluster there.
  const auto plain_member = [](const OwnedBlock& block) {
    std::uint32_t point = 0;
    while (std::find(block.representatives.begin(), block.representatives.end(), point) !=
           block.representatives.end()) {
      ++point;
    }
    return point;
  };
  expect_problem(rewritten([&](auto& blocks) {
                   OwnedBlock& block = block_of(blocks, 1);
                   const std::uint32_t point = plain_member(block);
                   block.children[point] = block.children[point + 1];
                 }),
                 "is headed twice");
  expect_problem(rewritten([&](auto& blocks) {
                   OwnedBlock& block = block_of(blocks, 1);
                   const std::uint32_t point = plain_member(block);
                   block.children[point] = block.children[point + 1];
                 }),
                 "no point above heads it");
  expect_unreadable(rewritten([&](auto& blocks) {
                      OwnedBlock& block = block_of(blocks, 1);
                      block.children[plain_member(block)] = 1000000;
                    }),
                    "heads a cluster that does not exist");
  expect_problem(rewritten([&](auto& blocks) {
                   OwnedBlock& block = block_of(blocks, 1);
                   block.positions[plain_member(block)][2] += 1;
                 }),
                 "are not the points above that head its clusters");
  // A representative whose children differ from those of the point above.
  expect_problem(rewritten([](auto& blocks) {
                   OwnedBlock& block = block_of(blocks, 1);
                   std::swap(block.children[block.representatives[0]],
                             block.children[block.representatives[1]]);
                 }),
                 "are not the points above that head its clusters");
  expect_problem(rewritten([](auto& blocks) { --block_of(blocks, 1).summaries[0].descendants; }),
                 "the descendants do not add up");
  expect_problem(rewritten([](auto& blocks) {
                   OwnedBlock& block = block_of(blocks, 1);
                   const Point3 at = block.positions[block.representatives[0]];
                   block.summaries[0].box = {at, at};
                 }),
                 "a cluster below exceeds its box");
}

/// Boxes of 32 columns from a multiple of 32 on look as if they had been enlarged to that size. The
/// box above must still contain the points themselves.
TEST(StoreInvariants, VerifyFindsBoxesThatMissOnePoint) {
  for (const int missed : {0, 1, 31}) {
    const TemporaryFolder folder;
    StoreWriter writer(folder.path() / "s", testing::grid_schema(ScalarType::i16));
    std::vector<Point3> positions;
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < 64; ++i) {
      positions.push_back({32.0 + i, 0, 0});
      order.push_back(i);
    }
    const std::vector<std::uint32_t> first{0, 32, 64}, heads{31, 60}, all{0, 2},
        none{kNoRepresentative};
    const std::vector<ClusterSummary> summaries{{{positions[0], positions[31]}, 40, 32},
                                                {{positions[32], positions[63]}, 40, 32}};
    const std::vector<Point3> top{positions[31], positions[60]};
    const std::vector<std::uint64_t> children{0, 1};
    const auto low = static_cast<std::size_t>(missed);
    const std::vector<ClusterSummary> root{{{positions[low], positions[63]}, 40, 64}};
    writer.append(writer.encode({.level = 0,
                                 .positions = positions,
                                 .payload = {},
                                 .children = {},
                                 .first = first,
                                 .order = order,
                                 .representatives = heads,
                                 .summaries = summaries}));
    writer.finish({.level = 1,
                   .positions = top,
                   .payload = {},
                   .children = children,
                   .first = all,
                   .order = std::span(order).first(2),
                   .representatives = none,
                   .summaries = root});
    const std::string problems = problems_of(Store::open(folder.path() / "s"));
    if (missed == 0) {
      EXPECT_EQ(problems, "");
    } else {
      EXPECT_EQ(problems, "cluster 1/0: a cluster below exceeds its box\n");
    }
  }
}

}  // namespace
}  // namespace terrace::stream
