// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>

#include <terrace/stream/message.hpp>

namespace terrace::terrain {

/// How far a task has got.
struct Progress {
  std::string_view what;    ///< the things counted, such as "tiles"
  std::uint64_t count = 0;  ///< done until now
  double fraction = 0.0;    ///< share of the whole task, from 0 to 1; 0 if unknown
  bool ended = false;       ///< the last report of this task, completed or abandoned
};

/// The resources and callbacks of a job. Every long-running function of this library takes a
/// context and only reads it. Jobs that run at the same time need separate contexts.
struct Context {
  unsigned threads = 1;                         ///< upper limit; results do not depend on it
  std::optional<std::uint64_t> memory_bytes{};  ///< upper limit, if set
  std::stop_token stop{};                       ///< ends the work with stream::Stopped
  /// Called from time to time, by one thread at a time; an exception from it ends the work.
  std::function<void(const Progress&)> progress{};
  /// Receives what the user should know about the result, such as an assumption that was made.
  std::function<void(const stream::Message&)> note{};

  /// Returns memory_bytes if set. Otherwise returns `standard` bytes, limited to the available
  /// memory, or half of the available memory if `standard` is 0.
  [[nodiscard]] std::uint64_t memory_or(std::uint64_t standard) const;
  /// Calls note, if it is set.
  void say(const stream::Message& line) const;
  /// Throws: stream::Stopped if a stop was requested.
  void check_stop() const;
};

}  // namespace terrace::terrain
