// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

#include "serve/http_rules.hpp"
#include "serve/site.hpp"

namespace terrace::tools {

struct ServerLimits {
  /// For more, those that have waited longest for a request end; if none waits, they are told to
  /// come later (503).
  std::size_t connections = 256;
  std::size_t header_bytes = 8 * 1024;        ///< of a request; larger ones are refused (431)
  std::chrono::milliseconds request{30'000};  ///< for a request to come, the wait for it included
  std::chrono::milliseconds piece{30'000};    ///< for a client to take 64 KiB
};

/// Serves a site on 127.0.0.1 by HTTP/1.1: GET and HEAD, single ranges, entity tags, to requests
/// that have the token or come from programs of this process's session. One thread, and no client
/// holds it: all waiting is for the operating system.
class Server {
 public:
  /// site: asked for each request. port 0: any that is free. Throws: stream::Error if it is taken,
  /// or without random numbers for the token.
  Server(std::function<const Site&()> site, std::uint16_t port, const ServerLimits& limits = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const Access& access() const;
  /// Serves until `stopped` returns true, which is asked a few times a second.
  void run(const std::function<bool()>& stopped);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tools
