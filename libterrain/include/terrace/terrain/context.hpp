// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

namespace terrace::terrain {

/// How far a piece of work has come.
struct Progress {
  std::string_view what;    ///< what is counted, as in "tiles"
  std::uint64_t count = 0;  ///< done so far
  double fraction = 0.0;    ///< of the whole, from 0 to 1; 0 if that is unknown
  bool ended = false;       ///< the last report of this piece, whether it is done or given up
};

/// How a job runs: passed to everything in this library that takes long. A job reads it and never
/// changes it; whoever starts two jobs at once gives each its own.
struct Context {
  unsigned threads = 1;                         ///< at most; results do not depend on it
  std::optional<std::uint64_t> memory_bytes{};  ///< at most, if given
  std::stop_token stop{};                       ///< ends the work with stream::Stopped
  /// Called now and then, by one thread at a time; what it throws ends the work.
  std::function<void(const Progress&)> progress{};
  /// What the user should know of the result: an assumption that was made, and the like.
  std::function<void(const std::string&)> note{};

  /// memory_bytes, or else `standard` bytes as far as the machine has them available; without a
  /// standard (0) half of what is available.
  [[nodiscard]] std::uint64_t memory_or(std::uint64_t standard) const;
  /// Calls note, if there is one.
  void say(const std::string& line) const;
  /// Throws: stream::Stopped if the job is to end.
  void check_stop() const;
};

}  // namespace terrace::terrain
