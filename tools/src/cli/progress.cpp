// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/units.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr std::chrono::milliseconds kInterval{100};

}  // namespace

ProgressMeter::ProgressMeter(ProgressMode mode, std::string what)
    : mode_(mode), what_(std::move(what)), start_(Clock::now()), last_(start_) {
  if (mode_ == ProgressMode::automatic && ::isatty(STDERR_FILENO) == 0) mode_ = ProgressMode::none;
}

ProgressMeter::~ProgressMeter() {
  if (line_shown_) std::fputs("\r\033[K", stderr);
}

void ProgressMeter::update(std::uint64_t count, double fraction) {
  if (mode_ == ProgressMode::none) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < kInterval) return;
  last_ = now;
  show(count, std::clamp(fraction, 0.0, 1.0), std::chrono::duration<double>(now - start_).count());
}

void ProgressMeter::show(std::uint64_t count, double fraction, double seconds) {
  const double rate = static_cast<double>(count) / seconds;
  const double remaining = fraction > 0 ? seconds * (1 - fraction) / fraction : -1;
  if (mode_ == ProgressMode::json) {
    nlohmann::ordered_json line;
    line["progress"] = fraction;
    line[what_] = count;
    line[what_ + "_per_second"] = rate;
    line["seconds"] = seconds;
    line["seconds_left"] =
        remaining < 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(remaining);
    std::fprintf(stderr, "%s\n", line.dump().c_str());
  } else {
    std::string text = fmt::format("{} {}, {}", with_commas(count), what_, readable_rate(rate));
    if (remaining >= 0) {
      text += fmt::format(", {} %, {} left", static_cast<int>(fraction * 100),
                          readable_seconds(remaining));
    }
    std::fprintf(stderr, "\r%s\033[K", text.c_str());
    line_shown_ = true;
  }
  std::fflush(stderr);
}

}  // namespace terrace::tools
