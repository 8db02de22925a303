// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/source.hpp>

#include "base/units.hpp"
#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// Notes that the input was spooled to disk, if it was.
inline void note_spooled(const stream::SourceInfo& info, const Context& context) {
  if (info.spooled_bytes == 0) return;
  context.say("the input cannot be read from a pipe or out of gzip: " +
              readable_bytes(info.spooled_bytes) + " were copied to a temporary file");
}

/// Collects the damaged parts of the input, which are skipped, for a report at the end.
class DamageReport {
 public:
  /// For SourceOptions::on_damage; the report must outlive the source.
  [[nodiscard]] auto handler() {
    return [this](const stream::Error& damage, std::uint64_t points) {
      const stream::Error::Parts& parts = damage.parts();
      std::string line = parts.file + ": " + (parts.where.empty() ? "" : parts.where + ": ") +
                         parts.cause.text() + " (" + counted(points, "point") + " left out)";
      const std::lock_guard lock(mutex_);
      // Each of several files is opened twice, first to check that they agree and then to read it.
      if (std::find(lines_.begin(), lines_.end(), line) != lines_.end()) return;
      ++parts_;
      if (lines_.size() < kMaxLines) lines_.push_back(std::move(line));
    };
  }

  void note(const Context& context) const {
    const std::lock_guard lock(mutex_);
    for (const std::string& line : lines_) context.say(line);
    if (parts_ > lines_.size()) {
      context.say("and " + counted(parts_ - lines_.size(), "more damaged part"));
    }
  }

 private:
  static constexpr std::size_t kMaxLines = 10;

  mutable std::mutex mutex_;
  std::size_t parts_ = 0;
  std::vector<std::string> lines_;
};

}  // namespace terrace::terrain
