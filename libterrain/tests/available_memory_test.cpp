// SPDX-License-Identifier: Apache-2.0
#include "base/available_memory.hpp"

#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// Folders like those in /proc and of cgroups.
class CgroupMemory : public testing::Test {
 protected:
  CgroupMemory() {
    std::string name = (fs::temp_directory_path() / "terrace-cgroup-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for the test");
    root_ = name;
  }
  ~CgroupMemory() override { fs::remove_all(root_); }

  void write(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << '\n';
  }
  /// Returns a line of mountinfo for the folder "cg".
  [[nodiscard]] std::string mount(const std::string& shown, const std::string& type) const {
    return "30 23 0:26 / / rw - ext4 /dev/sda rw\n31 23 0:26 " + shown + " " +
           (root_ / "cg").string() + " rw,nosuid shared:4 - " + type;
  }
  [[nodiscard]] std::optional<std::uint64_t> limit() const {
    return cgroup_memory_limit(root_ / "proc");
  }

  fs::path root_;
};

TEST_F(CgroupMemory, IsUnlimitedWithoutCgroups) { EXPECT_EQ(limit(), std::nullopt); }

TEST_F(CgroupMemory, ReadsSmallestLimitOfVersion2Ancestors) {
  write("proc/cgroup", "0::/slice/job/step");
  write("proc/mountinfo", mount("/", "cgroup2 cgroup2 rw,nsdelegate"));
  write("cg/slice/job/step/memory.max", "max");
  EXPECT_EQ(limit(), std::nullopt);
  write("cg/slice/memory.max", "3000000000");
  EXPECT_EQ(limit(), 3000000000u);
  write("cg/slice/job/memory.max", "2000000000");
  EXPECT_EQ(limit(), 2000000000u);
  write("cg/slice/job/step/memory.max", "2500000000");
  EXPECT_EQ(limit(), 2000000000u);
  write("cg/slice/job/step/memory.high", "1500000000");
  EXPECT_EQ(limit(), 1500000000u);
}

TEST_F(CgroupMemory, ReadsMemoryControllerOfVersion1) {
  write("proc/cgroup", "5:cpu,cpuacct:/other\n4:memory:/job/step\n0::/");
  write("proc/mountinfo", mount("/", "cgroup cgroup rw,memory"));
  write("cg/job/step/memory.limit_in_bytes", "9223372036854771712");
  write("cg/job/memory.limit_in_bytes", "1000000000");
  write("cg/other/memory.limit_in_bytes", "5");
  EXPECT_EQ(limit(), 1000000000u);
}

/// The mount shows the container's own cgroup, while /proc names it from the host's root.
TEST_F(CgroupMemory, ReadsLimitInsideContainerMount) {
  write("proc/cgroup", "4:memory:/docker/abc/step");
  write("proc/mountinfo", mount("/docker/abc", "cgroup cgroup rw,memory"));
  write("cg/memory.limit_in_bytes", "700000000");
  write("cg/step/memory.limit_in_bytes", "800000000");
  EXPECT_EQ(limit(), 700000000u);
  write("cg/step/memory.limit_in_bytes", "600000000");
  EXPECT_EQ(limit(), 600000000u);
}

TEST(AvailableMemory, RespectsProcessLimits) {
#ifdef __has_feature
#if __has_feature(thread_sanitizer) || __has_feature(address_sanitizer)
  GTEST_SKIP() << "the sanitizer's own memory exceeds the limits that are set here";
#endif
#endif
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    constexpr rlim_t kLimit = rlim_t{123} << 30;
    constexpr rlim_t kSmall = rlim_t{1} << 30;
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      rlimit limit{};
      getrlimit(resource, &limit);
      limit.rlim_cur = std::min(limit.rlim_max, kLimit);
      setrlimit(resource, &limit);
      const std::uint64_t large = available_memory_bytes();
      limit.rlim_cur = std::min(limit.rlim_max, kSmall);
      setrlimit(resource, &limit);
      _exit(large <= kLimit && available_memory_bytes() <= kSmall && large > 0 ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << resource;
  }
}

}  // namespace
}  // namespace terrace::terrain
