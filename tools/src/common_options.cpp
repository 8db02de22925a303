// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdio>

#include "available_memory.hpp"
#include "cli.hpp"
#include "terminal.hpp"
#include "units.hpp"

// Apart from the command line, which needs all verbs: libraries of the tools speak by these.
namespace terrace::tools {

std::uint64_t CommonOptions::memory_or(std::uint64_t standard) const {
  if (memory_bytes) return *memory_bytes;
  const std::uint64_t available = available_memory_bytes();
  return standard != 0 ? std::min(standard, available) : available / 2;
}

void CommonOptions::say(const std::string& line) const {
  if (!quiet) print_message(line);
}

void CommonOptions::explain(const std::string& line) const {
  if (verbose && !quiet) print_message(line);
}

}  // namespace terrace::tools
