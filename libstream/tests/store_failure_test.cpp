// SPDX-License-Identifier: Apache-2.0
// Tests that half-written stores do not open, that damage is detected, and that other programs'
// files are kept.
#include <csignal>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "point_files.hpp"
#include "stand_in_hierarchy.hpp"
#include "store_inputs.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/file_lock.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;
using testing::bytes_of;
using testing::contains;
using testing::StandInHierarchy;
using testing::write_bytes;

/// Overwrites one byte in place. Rewriting complete files would wait for the disk each time.
void overwrite(const fs::path& file, std::size_t at, char byte) {
  std::fstream out(file, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(static_cast<std::streamoff>(at));
  out.put(byte);
}

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files[entry.path().filename().string()] = bytes_of(entry.path());
  }
  return files;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

void write_small(const fs::path& path, std::uint64_t seed, bool replace = false) {
  StoreWriter writer(path, testing::grid_schema(ScalarType::i16), replace);
  StandInHierarchy hierarchy(writer,
                             {.block_points = 100, .cluster_points = 10, .scale = {1, 1, 1}});
  for (const auto& block :
       testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 24, 20, 10, seed)) {
    hierarchy.push(block.positions);
  }
  hierarchy.finish();
}

TEST(StoreDamage, FindsEveryFlippedBit) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 1);
  for (const auto& [name, bytes] : files_of(path)) {
    // Every bit of the first and last part, and one bit of every byte between them.
    for (std::size_t at = 0; at < bytes.size(); at += TERRACE_TEST_SHARE) {
      const bool edge = at < 200 || at + 200 > bytes.size();
      for (unsigned bit = edge ? 0 : at % 8; bit < (edge ? 8 : at % 8 + 1); ++bit) {
        const char damaged = static_cast<char>(bytes[at] ^ (1 << bit));
        overwrite(path / name, at, damaged);
        bool is_detected = false;
        try {
          const Store store = Store::open(path);
          std::size_t problems = 0;
          const bool good = store.verify([&](const Problem& problem) {
            ++problems;
            EXPECT_FALSE(problem.file.empty());
            EXPECT_FALSE(problem.what.empty());
          });
          EXPECT_EQ(good, problems == 0);
          is_detected = !good;
        } catch (const Error&) {
          is_detected = true;
        }
        ASSERT_TRUE(is_detected) << name << ", byte " << at << ", bit " << bit;
      }
      overwrite(path / name, at, bytes[at]);
    }
  }
  EXPECT_TRUE(Store::open(path).verify(testing::fail_on_problem));
}

TEST(StoreDamage, ThrowsWhenReadingDamagedClusters) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 2);
  const auto file = path / "level-0.0.clusters";
  const std::string bytes = bytes_of(file);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    overwrite(file, at, static_cast<char>(bytes[at] ^ 0x10));
    const Store store = Store::open(path);
    EXPECT_TRUE(contains(error_of([&] { testing::all_points(store); }), "checksum")) << at;
    overwrite(file, at, bytes[at]);
  }
}

TEST(StoreDamage, NamesTruncatedAndMissingFiles) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 3);
  for (const auto& [name, bytes] : files_of(path)) {
    if (bytes.empty()) continue;
    write_bytes(path / name, bytes.substr(0, bytes.size() / 2));
    EXPECT_TRUE(contains(error_of([&] { Store::open(path); }), name)) << name;
    fs::remove(path / name);
    EXPECT_FALSE(error_of([&] { Store::open(path); }).empty()) << name;
    write_bytes(path / name, bytes);
  }
  EXPECT_TRUE(contains(error_of([&] { Store::open(folder.path()); }), "no store"));
}

TEST(StoreDamage, ReportsStoresOfANewerVersion) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 4);
  std::string text = bytes_of(path / "manifest.json");
  const std::size_t at = text.find("\"version\": 1");
  ASSERT_NE(at, std::string::npos);
  // Development versions before the first release wrote 2 to 5.
  for (const char digit : {'2', '5', '9'}) {
    text[at + 11] = digit;
    write_bytes(path / "manifest.json", text);
    const std::string words = error_of([&] { Store::open(path); });
    EXPECT_TRUE(contains(words, "newer terrace")) << words;
    EXPECT_TRUE(contains(words, "development version before the first release")) << words;
    EXPECT_TRUE(contains(words, "update, or rebuild the store from its source")) << words;
  }
  text[at + 11] = '0';
  write_bytes(path / "manifest.json", text);
  const std::string words = error_of([&] { Store::open(path); });
  EXPECT_TRUE(contains(words, "the version is impossible")) << words;
}

TEST(StoreDamage, RefusesWrongOrdinalsAndLevels) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 5);
  const Store store = Store::open(path);
  ClusterPoints points;
  EXPECT_FALSE(error_of([&] {
                 static_cast<void>(store.record(cluster_id(0, store.levels()[0].clusters)));
               }).empty());
  EXPECT_FALSE(error_of([&] { store.read(cluster_id(store.top() + 1, 0), points); }).empty());
}

TEST(StoreWriting, RefusesExistingOutputs) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 6);
  const auto before = files_of(path);
  EXPECT_TRUE(contains(error_of([&] { write_small(path, 7); }), "exists"));
  EXPECT_EQ(files_of(path), before);
  write_small(path, 7, /*replace=*/true);
  EXPECT_NE(files_of(path), before);
  EXPECT_TRUE(Store::open(path).verify(testing::fail_on_problem));

  fs::create_directory(folder.path() / "other");
  write_bytes(folder.path() / "other" / "precious", "1");
  EXPECT_TRUE(contains(error_of([&] { write_small(folder.path() / "other", 7, true); }),
                       "not written by terrace"));
  write_bytes(folder.path() / "file", "1");
  EXPECT_TRUE(contains(error_of([&] { write_small(folder.path() / "file", 7, true); }),
                       "not written by terrace"));
  EXPECT_EQ(bytes_of(folder.path() / "other" / "precious"), "1");
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"file", "other", "s"}));
}

TEST(StoreWriting, OfTwoWritersTheFirstToFinishWins) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  StoreWriter first(path, testing::cloud_schema()), second(path, testing::cloud_schema());
  StandInHierarchy a(first, {}), b(second, {});
  a.push(std::vector<Point3>{{1, 2, 3}});
  b.push(std::vector<Point3>{{4, 5, 6}});
  b.finish();
  EXPECT_TRUE(contains(error_of([&] { a.finish(); }), "exists"));
  EXPECT_EQ(testing::all_points(Store::open(path)), (testing::PointBag{{{4, 5, 6}, {}}}));
}

TEST(StoreWriting, AbandonedWritersLeaveNothing) {
  const TempFolder folder;
  {
    StoreWriter writer(folder.path() / "s", testing::cloud_schema());
    StandInHierarchy hierarchy(writer, {});
    hierarchy.push(std::vector<Point3>{{1, 2, 3}});
    EXPECT_FALSE(names_in(folder.path()).empty());
  }
  EXPECT_TRUE(names_in(folder.path()).empty());
}

/// Writes a store in a process that dies before block `last`, if there are that many. Returns
/// whether the store was completed.
bool writes_until(const fs::path& path, std::size_t last,
                  const std::vector<testing::PushedBlock>& blocks) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      StoreWriter writer(path, testing::grid_schema(ScalarType::i16));
      StandInHierarchy hierarchy(writer,
                                 {.block_points = 100, .cluster_points = 10, .scale = {1, 1, 1}});
      for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (b == last) ::_exit(1);
        hierarchy.push(blocks[b].positions);
      }
      if (last == blocks.size()) ::_exit(1);
      hierarchy.finish();
    } catch (...) {
      ::_exit(2);
    }
    ::_exit(0);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2) << status;
  return WEXITSTATUS(status) == 0;
}

// tests/cli/crash_cli_test.py tests processes that die within a block, a sync or a rename.
TEST(StoreWriting, KilledWritersLeaveNothingThatOpensAndAreCleanedUp) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  const auto blocks =
      testing::grid_blocks(ScalarType::i16, testing::ReliefKind::fractal, 100, 60, 10, 9);
  ASSERT_GT(blocks.size(), 50U);
  for (std::size_t last = 0; last <= blocks.size(); ++last) {
    EXPECT_FALSE(writes_until(path, last, blocks)) << last;
    EXPECT_EQ(names_in(folder.path()).size(), 2u) << "a folder and its lock";
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_TRUE(writes_until(path, blocks.size() + 1, blocks));
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"s"}));
  EXPECT_TRUE(Store::open(path).verify(testing::fail_on_problem));
  fs::remove_all(path);
  // The next writer does not touch the files of a live one.
  EXPECT_FALSE(writes_until(path, 1, blocks));
  const StoreWriter living(path, testing::cloud_schema());
  const auto with_living = names_in(folder.path());
  EXPECT_EQ(with_living.size(), 2u);
  { const StoreWriter other(path, testing::cloud_schema()); }
  EXPECT_EQ(names_in(folder.path()), with_living);
}

TEST(StoreWriting, FollowsLinks) {
  const TempFolder folder;
  fs::create_directory(folder.path() / "elsewhere");
  fs::create_symlink("elsewhere/s", folder.path() / "link");
  write_small(folder.path() / "link", 1);
  const auto before = files_of(folder.path() / "elsewhere" / "s");
  write_small(folder.path() / "link", 2, /*replace=*/true);
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
  EXPECT_NE(files_of(folder.path() / "elsewhere" / "s"), before);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"elsewhere", "link"}));
  EXPECT_EQ(names_in(folder.path() / "elsewhere"), (std::vector<std::string>{"s"}));
}

/// Overlays belong to the store. Any other file prevents replacement, and the message names it.
TEST(StoreWriting, KeepsStoresThatContainForeignFiles) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 1);
  write_bytes(path / "smooth.overlay", "terrace overlay\nand more");
  write_small(path, 2, /*replace=*/true);
  const auto before = files_of(path);
  for (const std::string name : {"notes.txt", "level-9.0.index", ".hidden"}) {
    write_bytes(path / name, "terrace");
    write_bytes(path / "zeal", "terrace");
    EXPECT_TRUE(
        contains(error_of([&] { write_small(path, 3, true); }), "contains " + name + ", which"));
    fs::remove(path / name);
    fs::remove(path / "zeal");
    EXPECT_EQ(files_of(path), before);
  }
  fs::create_symlink("manifest.json", path / "link");
  EXPECT_TRUE(contains(error_of([&] { write_small(path, 3, true); }), "contains link, which"));
  fs::remove(path / "link");
  fs::create_directory(path / "photos");
  EXPECT_TRUE(contains(error_of([&] { write_small(path, 3, true); }), "contains photos, which"));
  fs::remove(path / "photos");
  write_small(path, 3, /*replace=*/true);
  EXPECT_NE(files_of(path), before);
}

/// A writer may die between the two renames of a replacement.
TEST(StoreWriting, RestoresAStoreThatWasMovedAside) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  const auto aside = folder.path() / ".s.tmp-1-old";
  write_small(path, 1);
  const auto files = files_of(path);
  fs::rename(path, aside);
  {
    // A live writer is about to finish.
    const FileLock lock(folder.path() / ".s.tmp-1.lock");
    EXPECT_THROW(Store::open(path), Error);
    const StoreWriter writer(path, testing::cloud_schema());
    EXPECT_EQ(files_of(aside), files);
  }
  EXPECT_NO_THROW(Store::open(path));
  EXPECT_EQ(files_of(path), files);
  // A writer also restores the store, before it refuses to replace it.
  fs::rename(path, aside);
  EXPECT_TRUE(contains(error_of([&] { write_small(path, 2); }), "exists"));
  EXPECT_EQ(files_of(path), files);
  // Next to a complete store it is the replaced one, and without a manifest it is not a store.
  fs::copy(path, aside);
  write_small(path, 2, /*replace=*/true);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"s"}));
  fs::rename(path, aside);
  fs::remove(aside / "manifest.json");
  EXPECT_THROW(Store::open(path), Error);
  write_small(path, 3);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"s"}));
}

TEST(StoreWriting, TrialsLeaveNothing) {
  const TempFolder folder;
  StoreWriter writer(folder.path() / "s", testing::cloud_schema());
  const std::vector<Point3> points{{1, 2, 3}};
  const std::vector<std::uint32_t> first{0, 1}, order{0}, representatives{kNoRepresentative};
  EXPECT_GT(writer.finish({.level = 0,
                           .positions = points,
                           .payload = {},
                           .children = {},
                           .first = first,
                           .order = order,
                           .representatives = representatives,
                           .summaries = {}},
                          /*publish=*/false),
            0u);
  EXPECT_FALSE(fs::exists(folder.path() / "s"));
}

TEST(StoreWriting, KeepsFilesOfOtherNames) {
  const TempFolder folder;
  const auto name_of_a_dead_writer = [&](const char* store) {
    const StoreWriter writer(folder.path() / store, testing::cloud_schema());
    const std::string name = names_in(folder.path()).front();
    return name.substr(0, name.rfind('-') + 1) + "1";
  };
  const std::string others = name_of_a_dead_writer("other"), ours = name_of_a_dead_writer("s");
  fs::create_directory(folder.path() / others);
  fs::create_directory(folder.path() / ours);
  write_small(folder.path() / "s", 10);
  EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{others, "s"}));
}

TEST(StoreWriting, AcceptsTheLongestName) {
  const TempFolder folder;
  const fs::path path = folder.path() / std::string(255, 's');
  write_small(path, 10);
  EXPECT_TRUE(Store::open(path).verify(testing::fail_on_problem));
}

/// Writes a store in a process whose files may not grow beyond `limit`. Returns whether it threw an
/// Error.
bool throws_under_limit(rlim_t limit, const fs::path& path) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit r{limit, limit};
    ::setrlimit(RLIMIT_FSIZE, &r);
    int code = 2;
    try {
      write_small(path, 11);
      code = 0;
    } catch (const Error& error) {
      code = contains(error.what(), "cannot") ? 1 : 3;
    } catch (...) {
    }
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2) << "exit status " << status;
  return WEXITSTATUS(status) == 1;
}

TEST(StoreWriting, ReportsFullDisksAndLeavesNothing) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  write_small(path, 11);
  std::uint64_t largest = 0;
  for (const auto& [name, bytes] : files_of(path))
    largest = std::max<std::uint64_t>(largest, bytes.size());
  fs::remove_all(path);
  for (const rlim_t limit :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{100}, largest / 2, largest - 1}) {
    EXPECT_TRUE(throws_under_limit(limit, path)) << limit;
    EXPECT_TRUE(names_in(folder.path()).empty()) << limit;
  }
  EXPECT_FALSE(throws_under_limit(largest, path));
  EXPECT_TRUE(fs::exists(path));
}

TEST(StoreWriting, RefusesCoordinatesThatAreNotFinite) {
  const TempFolder folder;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const std::string words = error_of([&] {
      StoreWriter writer(folder.path() / "s", testing::cloud_schema());
      StandInHierarchy hierarchy(writer, {});
      hierarchy.push(std::vector<Point3>{{1, bad, 3}});
      hierarchy.finish();
    });
    EXPECT_TRUE(contains(words, "not finite")) << words;
  }
}

/// Returns the files of a store whose blocks are encoded by one thread in order, or by several
/// ahead of their turn.
std::map<std::string, std::string> files_for_threads(const StoreSchema& schema,
                                                     const std::vector<store::RawBlock>& blocks,
                                                     unsigned ahead) {
  const TempFolder folder;
  const auto path = folder.path() / "s";
  StoreWriter writer(path, schema);
  for (std::size_t start = 0; start < blocks.size(); start += ahead) {
    const std::size_t end = std::min<std::size_t>(blocks.size(), start + ahead);
    std::vector<StoreWriter::EncodedPtr> encoded(end - start);
    std::vector<std::thread> threads;
    for (unsigned t = 0; t < std::min(ahead, 4u); ++t) {
      threads.emplace_back([&, t] {
        for (std::size_t b = start + t; b < end; b += std::min(ahead, 4u)) {
          if (blocks[b].representatives[0] != kNoRepresentative) {
            encoded[b - start] = writer.encode(blocks[b].view());
          }
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (std::size_t b = start; b < end; ++b) {
      if (encoded[b - start] != nullptr) {
        writer.append(std::move(encoded[b - start]));
      } else {
        writer.finish(blocks[b].view());
      }
    }
  }
  return files_of(path);
}

TEST(StoreWriting, BytesDoNotDependOnWhenBlocksAreEncoded) {
  // More blocks than a segment has, so that some are encoded with tables that become obsolete, and
  // with cells that occur twice, whose order must be preserved.
  std::mt19937_64 random(12);
  std::vector<std::vector<Point3>> blocks;
  for (int b = 0; b < 1200; ++b) {
    std::vector<Point3> block;
    const double x0 = 8.0 * (b % 40), y0 = 8.0 * (b / 40), rough = b < 900 ? 3 : 50;
    for (int i = 0; i < 64; ++i) {
      block.push_back({x0 + i % 8, y0 + i / 8, std::floor(rough * testing::uniform(random))});
      if (random() % 100 == 0) block.push_back(block.back());
    }
    blocks.push_back(std::move(block));
  }
  const auto recorded = testing::recorded_hierarchy(
      blocks, {.block_points = 70, .cluster_points = 16, .scale = {1, 1, 1}});
  // A cloud's rows are coded as columns, which preserve the order of the points.
  for (const StoreSchema& schema :
       {testing::grid_schema(ScalarType::i16), testing::cloud_schema()}) {
    const auto expected = files_for_threads(schema, recorded, 1);
    for (const unsigned ahead : {7u, 200u, 1500u}) {
      EXPECT_TRUE(files_for_threads(schema, recorded, ahead) == expected)
          << ahead << " blocks ahead";
    }
  }
}

}  // namespace
}  // namespace terrace::stream
