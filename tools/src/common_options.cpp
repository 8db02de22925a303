// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli.hpp"
#include "terminal.hpp"
#include "units.hpp"

// Apart from the command line, which needs all verbs: libraries of the tools speak by these.
namespace terrace::tools {

std::uint64_t CommonOptions::memory_or(std::uint64_t standard) const {
  if (memory_bytes) return *memory_bytes;
  return standard != 0 ? standard : machine_memory_bytes() / 2;
}

void CommonOptions::say(const std::string& line) const {
  if (!quiet) print_message(line);
}

void CommonOptions::explain(const std::string& line) const {
  if (verbose && !quiet) print_message(line);
}

}  // namespace terrace::tools
