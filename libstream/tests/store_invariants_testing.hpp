// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "store_editing.hpp"
#include "store_inputs.hpp"
#include "store_testing.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

/// Small sound stores, and expectations about copies of them that violate FORMAT.md.

namespace terrace::stream::testing {

/// The size of the raster in the tests of invariants.
inline constexpr std::uint64_t kSmallColumns = 60, kSmallRows = 50;

inline StoreSchema small_grid() {
  StoreSchema schema = grid_schema(ScalarType::i16);
  schema.columns = kSmallColumns;
  schema.rows = kSmallRows;
  return schema;
}

inline const StandInHierarchy::Options kSmallOptions{.block_points = 200, .cluster_points = 8};

inline std::vector<PushedBlock> small_blocks() {
  return grid_blocks(ScalarType::i16, ReliefKind::fractal, kSmallColumns, kSmallRows, 12, 1);
}

/// Returns the store of a raster with three levels, and several pages on level 0.
inline const StoreFiles& grid_files() {
  static const StoreFiles files = [] {
    const TempFolder folder;
    write_store(folder.path() / "s", small_grid(), small_blocks(), kSmallOptions);
    return read_files(folder.path() / "s");
  }();
  return files;
}

/// Returns the store of a small cloud.
inline const StoreFiles& cloud_files() {
  static const StoreFiles files = [] {
    const TempFolder folder;
    write_store(folder.path() / "s", cloud_schema(),
                cloud_blocks(CoordinateKind::mixed, 3000, 200, 1), kSmallOptions);
    return read_files(folder.path() / "s");
  }();
  return files;
}

/// Returns the message of the Error that Store::open() throws; empty if it does not throw.
inline std::string error_of_opening(const std::filesystem::path& path) {
  try {
    Store::open(path);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// Returns the problems that verify reports, one per line. Expects the same ones, in the same
/// order, for any number of threads.
inline std::string problems_of(const Store& store) {
  std::string problems, by_threads;
  store.verify([&](const Problem& problem) { problems += problem.what + "\n"; });
  store.verify([&](const Problem& problem) { by_threads += problem.what + "\n"; }, 3);
  EXPECT_EQ(by_threads, problems);
  return problems;
}

/// Expects that the store opens, that reading all of it throws `expected`, and that verify reports
/// it too.
inline void expect_unreadable(const StoreFiles& files, const std::string& expected) {
  const TempFolder folder;
  write_files(folder.path(), files);
  const Store store = Store::open(folder.path());
  std::string refused;
  try {
    all_points(store);
  } catch (const Error& error) {
    refused = error.what();
  }
  EXPECT_NE(refused.find(expected), refused.npos) << refused << "\nexpected: " << expected;
  const std::string problems = problems_of(store);
  EXPECT_NE(problems.find(expected), problems.npos) << problems << "\nexpected: " << expected;
}

/// Expects that verify reports a problem that contains `expected`.
inline void expect_problem(const StoreFiles& files, const std::string& expected) {
  const TempFolder folder;
  write_files(folder.path(), files);
  const std::string problems = problems_of(Store::open(folder.path()));
  EXPECT_NE(problems.find(expected), problems.npos) << problems << "\nexpected: " << expected;
}

/// Expects that opening the store throws an Error that contains `expected`.
inline void expect_refused(const StoreFiles& files, const std::string& expected) {
  const TempFolder folder;
  write_files(folder.path(), files);
  const std::string refused = error_of_opening(folder.path());
  EXPECT_NE(refused.find(expected), refused.npos) << refused << "\nexpected: " << expected;
}

}  // namespace terrace::stream::testing
