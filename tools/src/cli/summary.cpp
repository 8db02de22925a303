// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/summary.hpp"

#include <fstream>

#include <sys/resource.h>

namespace terrace::tools {

std::uint64_t peak_rss_bytes() {
  // Not ru_maxrss where it can be helped: that one survives exec and so includes the caller's.
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace terrace::tools
