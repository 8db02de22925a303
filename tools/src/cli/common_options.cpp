// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <memory>
#include <optional>

#include "cli/cli.hpp"
#include "cli/interrupt.hpp"
#include "cli/option_names.hpp"
#include "cli/terminal.hpp"

// Apart from the command line, which needs all verbs: libraries of the tools speak by these.
namespace terrace::tools {

using namespace terrain;

std::uint64_t CommonOptions::memory_or(std::uint64_t standard) const {
  return terrain::Context{.memory_bytes = memory_bytes}.memory_or(standard);
}

std::uint64_t CommonOptions::reading_memory(std::uint64_t parts) const {
  constexpr std::uint64_t kLeast = std::uint64_t{64} << 20, kProgram = std::uint64_t{32} << 20;
  const std::uint64_t memory = memory_or(0);
  return std::max(kLeast, (memory - std::min(memory, kProgram)) / parts);
}

void CommonOptions::say(const std::string& line) const {
  if (!quiet) print_message(with_option_names(line));
}

void CommonOptions::explain(const std::string& line) const {
  if (verbose && !quiet) print_message(line);
}

terrain::Context CommonOptions::context() const {
  const auto show = [mode = progress, meter = std::make_shared<std::optional<ProgressMeter>>()](
                        const terrain::Progress& now) {
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
          .note = [this](const std::string& line) { say(line); }};
}

}  // namespace terrace::tools
