// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/source.hpp>

#include "base/units.hpp"
#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// Collects what of the input is damaged and left out, to be told at the end.
class DamageReport {
 public:
  /// For SourceOptions::on_damage; the report must outlive the source.
  [[nodiscard]] auto taker() {
    return [this](const stream::Error& damage, std::uint64_t points) {
      const std::lock_guard lock(mutex_);
      ++parts_;
      if (lines_.size() == kMostLines) return;
      const stream::Error::Parts& parts = damage.parts();
      lines_.push_back(parts.file + ": " + (parts.where.empty() ? "" : parts.where + ": ") +
                       parts.cause + " (" + with_commas(points) + " points left out)");
    };
  }

  void tell(const Context& context) const {
    const std::lock_guard lock(mutex_);
    for (const std::string& line : lines_) context.say(line);
    if (parts_ > lines_.size()) {
      context.say("and " + with_commas(parts_ - lines_.size()) + " more damaged parts");
    }
  }

 private:
  static constexpr std::size_t kMostLines = 10;

  mutable std::mutex mutex_;
  std::size_t parts_ = 0;
  std::vector<std::string> lines_;
};

}  // namespace terrace::terrain
