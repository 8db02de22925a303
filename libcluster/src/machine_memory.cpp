// SPDX-License-Identifier: Apache-2.0
#include "machine_memory.hpp"

#include <limits>

#include <unistd.h>

namespace terrace::cluster {

std::uint64_t memory_of_machine() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return std::numeric_limits<std::uint64_t>::max();
  return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
}

}  // namespace terrace::cluster
