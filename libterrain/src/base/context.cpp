// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/context.hpp"

#include <algorithm>

#include <terrace/stream/error.hpp>

#include "base/available_memory.hpp"

namespace terrace::terrain {

std::uint64_t Context::memory_or(std::uint64_t standard) const {
  if (memory_bytes) return *memory_bytes;
  const std::uint64_t available = available_memory_bytes();
  return standard != 0 ? std::min(standard, available) : available / 2;
}

void Context::check_stop() const {
  if (stop.stop_requested()) throw stream::Stopped();
}

void Context::say(const stream::Message& line) const {
  if (note) note(line);
}

}  // namespace terrace::terrain
