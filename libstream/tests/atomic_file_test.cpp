// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::ptrdiff_t entries(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

TEST(AtomicFile, AppearsWithCommitOnly) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  AtomicFile file(target);
  file.write("hello ");
  file.write("world");
  EXPECT_EQ(file.size(), 11u);
  EXPECT_FALSE(fs::exists(target));
  EXPECT_EQ(entries(folder.path()), 1);
  file.commit();
  EXPECT_EQ(content(target), "hello world");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, LeavesNothingWithoutCommit) {
  const TempFolder folder;
  {
    AtomicFile file(folder.path() / "out.bin");
    file.write(std::string(3u << 20, 'x'));
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFile, RefusesAnExistingTargetUnlessItReplaces) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  std::ofstream(target) << "old";
  EXPECT_THROW(AtomicFile{target}, Error);
  {
    AtomicFile file(target, true);
    file.write("new");
    EXPECT_EQ(content(target), "old");
    file.commit();
  }
  EXPECT_EQ(content(target), "new");
  EXPECT_THROW(AtomicFile(folder.path(), true), Error);
  EXPECT_THROW(AtomicFile(folder.path() / "no" / "folder"), Error);
}

TEST(AtomicFile, KeepsATargetThatAppearedMeanwhile) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  {
    AtomicFile file(target);
    file.write("mine");
    std::ofstream(target) << "theirs";
    EXPECT_THROW(file.commit(), Error);
  }
  EXPECT_EQ(content(target), "theirs");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, WritesAndReadsAnywhere) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  AtomicFile file(target);
  file.write("0123456789");
  const std::array<std::byte, 2> patch{std::byte{'a'}, std::byte{'b'}};
  file.write_at(3, patch);
  file.write_at(12, patch);  // leaves a gap
  file.write("end");
  std::array<std::byte, 64> back{};
  EXPECT_EQ(file.read_at(2, back), 15u);
  EXPECT_EQ(back[1], std::byte{'a'});
  EXPECT_EQ(file.size(), 17u);
  file.commit();
  EXPECT_EQ(content(target), std::string("012ab56789\0\0abend", 17));
}

TEST(AtomicFile, TwoWritersOfOneTargetDoNotMeet) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  AtomicFile first(target), second(target);
  first.write("first");
  second.write("second");
  first.commit();
  EXPECT_THROW(second.commit(), Error);
  EXPECT_EQ(content(target), "first");
}

TEST(AtomicFile, RemovesWhatADeadWriterLeft) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    AtomicFile file(target);
    file.write("half");
    _exit(0);  // no destructors
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(entries(folder.path()), 1);
  AtomicFile file(target);
  file.write("whole");
  file.commit();
  EXPECT_EQ(entries(folder.path()), 1);
  EXPECT_EQ(content(target), "whole");
}

TEST(AtomicFile, AFileSizeLimitIsAnErrorAndLeavesNothing) {
  const TempFolder folder;
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const rlimit limit{100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      AtomicFile file(folder.path() / "out.bin");
      for (int i = 0; i < 100; ++i) file.write(std::string(10000, 'x'));
      file.commit();
    } catch (const Error& error) {
      code = error.parts().cause.find("File too large") != std::string::npos ? 0 : 2;
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFile, AFileMayHaveTheLongestName) {
  const TempFolder folder;
  const std::filesystem::path path = folder.path() / std::string(255, 'f');
  AtomicFile file(path);
  file.write("whole");
  file.commit();
  EXPECT_EQ(std::filesystem::file_size(path), 5u);
}

TEST(AtomicFile, RefusesADevice) { EXPECT_THROW(AtomicFile("/dev/null", true), Error); }

}  // namespace
}  // namespace terrace::stream
