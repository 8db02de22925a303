// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <sys/xattr.h>
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

TEST(AtomicFile, AppearsOnlyWithCommit) {
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

TEST(AtomicFile, ReplacesAnExistingTargetOnlyIfAsked) {
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

TEST(AtomicFile, WritesAndReadsAtAnyOffset) {
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

TEST(AtomicFile, TwoWritersOfOneTargetAreIndependent) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  AtomicFile first(target), second(target);
  first.write("first");
  second.write("second");
  first.commit();
  EXPECT_THROW(second.commit(), Error);
  EXPECT_EQ(content(target), "first");
}

TEST(AtomicFile, RemovesFilesOfADeadWriter) {
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

TEST(AtomicFile, FollowsLinks) {
  const TempFolder folder;
  fs::create_directory(folder.path() / "elsewhere");
  const fs::path link = folder.path() / "link", real = folder.path() / "elsewhere" / "out.bin";
  fs::create_symlink("elsewhere/out.bin", link);
  for (const char* text : {"first", "second"}) {
    AtomicFile file(link, std::string(text) == "second");
    file.write(text);
    file.commit();
    EXPECT_EQ(content(real), text);
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_EQ(entries(folder.path() / "elsewhere"), 1);
  }
  EXPECT_THROW(AtomicFile{link}, Error);
  fs::create_symlink("round", folder.path() / "round");
  EXPECT_THROW(AtomicFile(folder.path() / "round", true), Error);
  fs::create_symlink("nowhere/out.bin", folder.path() / "dangling");
  EXPECT_THROW(AtomicFile(folder.path() / "dangling", true), Error);
}

TEST(AtomicFile, ReportsAFileSizeLimitAndLeavesNothing) {
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
      code = error.parts().cause.text().find("File too large") != std::string::npos ? 0 : 2;
    }
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFile, AcceptsTheLongestFileName) {
  const TempFolder folder;
  const std::filesystem::path path = folder.path() / std::string(255, 'f');
  AtomicFile file(path);
  file.write("whole");
  file.commit();
  EXPECT_EQ(std::filesystem::file_size(path), 5u);
}

TEST(AtomicFile, RefusesADevice) { EXPECT_THROW(AtomicFile("/dev/null", true), Error); }

/// Replaces only files and folders that begin with "ours".
Naming if_ours() {
  return {[](const fs::path& there) {
    return content(fs::is_directory(there) ? there / "mark" : there).starts_with("ours");
  }};
}

TEST(AtomicFile, ChecksAgainWhatItReplaces) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.bin";
  std::ofstream(target) << "ours, old";
  {
    AtomicFile file(target, if_ours());
    file.write("ours, new");
    std::ofstream(target) << "a stranger's";
    EXPECT_THROW(file.commit(), Error);
    EXPECT_EQ(content(target), "a stranger's");
  }
  AtomicFile again(target, if_ours());
  again.write("ours, new");
  fs::remove(target);
  fs::create_directory(target);
  EXPECT_THROW(again.commit(), Error);
  EXPECT_TRUE(fs::is_directory(target));
  fs::remove(target);
  again = AtomicFile(target, if_ours());
  again.write("ours, new");
  std::ofstream(target) << "ours, meanwhile";
  again.commit();
  EXPECT_EQ(content(target), "ours, new");
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(OutputGroup, PublishesAllFilesOrNone) {
  const TempFolder folder;
  const fs::path a = folder.path() / "a", b = folder.path() / "b", c = folder.path() / "c";
  const auto write = [&](bool stranger) {
    OutputGroup group;
    for (const fs::path& target : {a, b, c}) {
      Naming naming = if_ours();
      naming.group = &group;
      AtomicFile file(target, naming);
      file.write("ours, new");
      file.commit();
    }
    if (stranger) std::ofstream(c) << "a stranger's";
    group.commit();
  };
  std::ofstream(b) << "ours, old";
  EXPECT_THROW(write(true), Error);
  EXPECT_FALSE(fs::exists(a));
  EXPECT_EQ(content(b), "ours, old");
  EXPECT_EQ(content(c), "a stranger's");
  EXPECT_EQ(entries(folder.path()), 2);
  fs::remove(c);
  write(false);
  for (const fs::path& target : {a, b, c}) EXPECT_EQ(content(target), "ours, new");
  EXPECT_EQ(entries(folder.path()), 3);
}

TEST(OutputGroup, LeavesNothingWithoutCommit) {
  const TempFolder folder;
  {
    OutputGroup group;
    Naming naming;
    naming.group = &group;
    AtomicFile file(folder.path() / "a", naming);
    file.write("new");
    file.commit();
    EXPECT_EQ(entries(folder.path()), 1);
  }
  EXPECT_EQ(entries(folder.path()), 0);
}

TEST(AtomicFolder, KeepsFoldersThatContainForeignFiles) {
  const TempFolder scratch;
  const fs::path target = scratch.path() / "out";
  const Naming naming([](const fs::path& there) {
    return ownership_of_entries(there, [](const fs::directory_entry& entry) {
      return entry.path().filename() == "mark" ? Ownership(true) : Ownership(false);
    });
  });
  const auto write = [&](const std::string& text) {
    AtomicFolder folder(target, "mark", naming);
    std::ofstream(folder.folder() / "mark") << text;
    folder.commit();
  };
  write("old");
  write("new");
  EXPECT_EQ(content(target / "mark"), "new");
  for (const char* name : {"notes.txt", "letter.txt"}) std::ofstream(target / name) << "mine";
  try {
    write("newer");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("contains letter.txt, which terrace did not write"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(content(target / "mark"), "new");
  EXPECT_EQ(content(target / "notes.txt"), "mine");
  EXPECT_EQ(entries(scratch.path()), 1);
}

TEST(AtomicFile, DetectsChangesToItsOutput) {
  const TempFolder folder;
  const fs::path target = folder.path() / "out.txt";
  const auto write = [&] {
    AtomicFile file(target, true);
    file.write("1 2 3\n");
    file.commit();
  };
  EXPECT_FALSE(is_unchanged_output(target));
  write();
  if (::getxattr(target.c_str(), "user.terrace", nullptr, 0) < 0) {
    GTEST_SKIP() << "the file system has no extended attributes";
  }
  EXPECT_TRUE(is_unchanged_output(target));
  fs::rename(target, folder.path() / "moved");
  EXPECT_TRUE(is_unchanged_output(folder.path() / "moved"));
  fs::rename(folder.path() / "moved", target);
  std::ofstream(target, std::ios::app) << "more\n";
  EXPECT_FALSE(is_unchanged_output(target));
  write();
  EXPECT_TRUE(is_unchanged_output(target));
  // The same bytes, but an hour older.
  std::ofstream(target) << "1 2 3\n";
  fs::last_write_time(target, fs::last_write_time(target) - std::chrono::hours(1));
  EXPECT_FALSE(is_unchanged_output(target));
  fs::remove(target);
  std::ofstream(target) << "1 2 3\n";
  EXPECT_FALSE(is_unchanged_output(target));
  EXPECT_FALSE(is_unchanged_output(folder.path()));
}

TEST(AtomicFolder, AppearsCompleteAndReplacesOnlyOurFolders) {
  const TempFolder parent;
  const fs::path target = parent.path() / "site";
  const auto write = [&](const std::string& text) {
    AtomicFolder folder(target, "mark", if_ours());
    fs::create_directories(folder.folder() / "deep" / "deeper");
    std::ofstream(folder.folder() / "deep" / "deeper" / "file") << text;
    std::ofstream(folder.folder() / "mark") << "ours";
    EXPECT_NE(folder.folder(), target);
    folder.commit();
  };
  write("first");
  write("second");
  EXPECT_EQ(content(target / "deep" / "deeper" / "file"), "second");
  EXPECT_EQ(entries(parent.path()), 1);
  std::ofstream(target / "mark") << "a stranger's";
  EXPECT_THROW(write("third"), Error);
  EXPECT_EQ(content(target / "deep" / "deeper" / "file"), "second");
  EXPECT_EQ(entries(parent.path()), 1);
}

}  // namespace
}  // namespace terrace::stream
