// SPDX-License-Identifier: GPL-3.0-or-later
// Builds stores from files: the bytes do not depend on the number of threads, memory stays within
// the limit, and a failed build leaves nothing behind.
#include "terrace/terrain/build.hpp"

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/geotiff_writer.hpp>
#include <terrace/stream/store.hpp>
#include <unistd.h>

#include "../../libterrain/tests/temporary_folder.hpp"
#include "../../libterrain/tests/test_raster.hpp"

namespace terrace {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[entry.path().filename().string()] = bytes_of(entry.path());
  }
  return files;
}

class Build : public testing::Test {
 protected:
  static constexpr std::uint32_t kSize = 700;

  void SetUp() override {
    stream::GeoTiffOptions options;
    options.columns = options.rows = kSize;
    options.world.xy = {30, 0, 500000, 0, -30, 5200000};
    options.nodata = -1;
    tests::write_test_raster(dem(), options, [this](std::uint32_t column, std::uint32_t row) {
      if ((column / 90 + row / 70) % 7 == 0) return -1;  // a lake
      ++valid_;
      return static_cast<int>(400 + (column * row) % 61 + (column * 7 + row * 3) % 37);
    });
    request_.inputs = {dem().string()};
    request_.store = folder_.path() / "a.store";
  }

  [[nodiscard]] fs::path dem() const { return folder_.path() / "dem.tif"; }

  tests::TemporaryFolder folder_;
  terrain::BuildRequest request_;
  std::uint64_t valid_ = 0;
};

TEST_F(Build, StoresEveryValidCellOnceAndCountsTheOthers) {
  const terrain::BuildOutcome outcome = terrain::build_store(request_);
  EXPECT_EQ(outcome.points, valid_);
  EXPECT_EQ(outcome.points + outcome.nodata, std::uint64_t{kSize} * kSize);
  const stream::Store store = stream::Store::open(request_.store);
  EXPECT_EQ(store.schema().nodata, outcome.nodata);
  std::set<std::pair<double, double>> cells;
  for (unsigned level = 0; level <= store.top(); ++level) {
    store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                              const stream::ClusterPoints& points) {
      for (const stream::Point3& p : points.positions) {
        EXPECT_TRUE(cells.emplace(p[0], p[1]).second) << p[0] << ", " << p[1] << " twice";
      }
    });
  }
  EXPECT_EQ(cells.size(), valid_);
}

TEST_F(Build, GivesTheSameBytesForAnyNumberOfThreads) {
  terrain::build_store(request_);
  const auto one = files_of(request_.store);
  for (const unsigned threads : {2u, 3u, 8u}) {
    SCOPED_TRACE(threads);
    request_.store = folder_.path() / std::to_string(threads);
    terrain::build_store(request_, {.threads = threads});
    EXPECT_TRUE(files_of(request_.store) == one);
  }
}

TEST_F(Build, StoppingOneOfTwoBuildsLeavesTheOtherRunning) {
  terrain::build_store(request_);
  const auto expected = files_of(request_.store);
  std::stop_source stop;
  bool given_up = false;
  terrain::BuildRequest request = request_;
  request.store = folder_.path() / "given_up";
  std::thread other([&] {
    try {
      terrain::build_store(request, {.threads = 2,
                                     .stop = stop.get_token(),
                                     .progress = [&](const terrain::Progress& progress) {
                                       if (progress.count > 0) stop.request_stop();
                                     }});
    } catch (const stream::Stopped&) {
      given_up = true;
    }
  });
  request_.store = folder_.path() / "finished";
  terrain::build_store(request_, {.threads = 2});
  other.join();
  EXPECT_TRUE(given_up);
  EXPECT_TRUE(files_of(request_.store) == expected);
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    left.insert(entry.path().filename().string());
  }
  EXPECT_EQ(left, (std::set<std::string>{"a.store", "dem.tif", "finished"}));
}

TEST_F(Build, RejectsAnExistingOutputAndKeepsIt) {
  terrain::build_store(request_);
  const auto before = files_of(request_.store);
  EXPECT_THROW(terrain::build_store(request_), stream::Error);
  EXPECT_TRUE(files_of(request_.store) == before);
}

TEST_F(Build, ReportsTheMemoryItNeeds) {
  const terrain::Context little{.memory_bytes = std::uint64_t{8} << 20};
  try {
    terrain::build_store(request_, little);
    FAIL() << "8 MiB was enough";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("need"), std::string::npos) << error.what();
  }
}

TEST_F(Build, LeavesNothingBehindAtTheFileSizeLimit) {
  // A limit on file sizes simulates a full disk; it fails with EFBIG instead of ENOSPC.
  for (const rlim_t limit : {rlim_t{1}, rlim_t{5000}, rlim_t{60000}}) {
    SCOPED_TRACE(limit);
    const pid_t child = fork();
    if (child == 0) {
      const rlimit size{limit, limit};
      setrlimit(RLIMIT_FSIZE, &size);
      try {
        terrain::build_store(request_);
        _exit(2);
      } catch (const stream::Error&) {
        _exit(0);
      }
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    std::set<std::string> left;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      left.insert(entry.path().filename().string());
    }
    EXPECT_EQ(left, std::set<std::string>{"dem.tif"});
  }
}

TEST_F(Build, LeavesNothingBehindOnAFullDisk) {
  const fs::path disk = folder_.path() / "disk";
  fs::create_directory(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=128k") != 0) {
    GTEST_SKIP() << "mounting a small tmpfs needs privileges";
  }
  request_.store = disk / "a.store";
  try {
    terrain::build_store(request_);
    ADD_FAILURE() << "the store fits into 128 KiB";
  } catch (const stream::Error& error) {
    EXPECT_NE(std::string(error.what()).find("No space left"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(fs::is_empty(disk));
  EXPECT_EQ(umount(disk.c_str()), 0);
}

TEST_F(Build, RejectsARasterOfNodataOnly) {
  stream::GeoTiffOptions options;
  options.columns = options.rows = 20;
  options.sample.type = stream::ScalarType::u8;
  options.nodata = 0;
  options.replace = true;
  stream::GeoTiffWriter writer(dem(), options);
  writer.write_rows(std::vector<std::byte>(400));
  writer.commit();
  EXPECT_THROW(terrain::build_store(request_), stream::Error);
  EXPECT_FALSE(fs::exists(request_.store));
}

}  // namespace
}  // namespace terrace
