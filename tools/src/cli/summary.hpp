// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "base/stopwatch.hpp"

namespace terrace::tools {

using namespace terrain;

/// How a verb ends: one JSON object for programs (plain numbers, SI units, bytes, seconds) and a
/// text for people. With --json the object goes to standard output; else the text to standard
/// error, or to standard output where it is what was asked for (`info`).
struct Summary {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  std::string text;  ///< lines, each ended by '\n'
  bool text_is_result = false;
  int exit_code = 0;  ///< 1 where a check found a fault
};

/// Largest resident set of this process so far.
std::uint64_t peak_rss_bytes();

}  // namespace terrace::tools
