// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <fstream>
#include <memory>
#include <optional>

#include <sys/resource.h>

#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_names.hpp"
#include "cli/progress.hpp"
#include "cli/terminal.hpp"

// Separate from cli.cpp, which depends on all verbs.
namespace terrace::tools {

using namespace terrain;

std::uint64_t peak_rss_bytes() {
  // ru_maxrss is the last resort: it survives exec and so includes the parent program's peak.
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

void Summary::add_cost(const Stopwatch& watch) {
  json["seconds"] = watch.seconds();
  json["peak_rss_bytes"] = peak_rss_bytes();
}

std::uint64_t CommonOptions::memory_or(std::uint64_t default_bytes) const {
  return Context{.memory_bytes = memory_bytes}.memory_or(default_bytes);
}

std::uint64_t CommonOptions::reading_memory(std::uint64_t divisor) const {
  constexpr std::uint64_t kMinMemoryOfSource = std::uint64_t{64} << 20;
  const std::uint64_t memory = memory_or(0);
  return std::max(kMinMemoryOfSource, (memory - std::min(memory, kProgramMemory)) / divisor);
}

void CommonOptions::say(const stream::Message& line) const {
  if (!quiet) print_message(option_text(line));
}

void CommonOptions::say_verbose(const std::string& line) const {
  if (verbose && !quiet) print_message(line);
}

Context CommonOptions::context() const {
  const auto show = [mode = progress, meter = std::make_shared<std::optional<ProgressMeter>>()](
                        const Progress& now) {
    if (now.ended) {
      meter->reset();
    } else {
      if (!*meter) meter->emplace(mode, std::string(now.what));
      (*meter)->update(now.count, now.fraction);
    }
  };
  return {.threads = threads,
          .memory_bytes = memory_bytes,
          .stop = stop_token(),
          .progress = show,
          .note = [this](const stream::Message& line) { say(line); }};
}

}  // namespace terrace::tools
