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
  /// Beyond this, the connections that have waited longest for a request end. If none waits, new
  /// ones are refused for now (503).
  std::size_t connections = 256;
  std::size_t header_bytes = 8 * 1024;  ///< request header limit; larger ones are refused (431)
  std::chrono::milliseconds request{30'000};  ///< time for a request to arrive, including the wait
  std::chrono::milliseconds piece{30'000};    ///< time for a client to receive 64 KiB
};

/// Serves a site on 127.0.0.1 by HTTP/1.1: GET and HEAD, single ranges, and entity tags. It answers
/// requests that have the token or come from programs of this process's session. It uses one thread
/// with asynchronous I/O, so no client can block it.
class Server {
 public:
  /// Calls `site` for each request. Port 0 means any free port. Throws stream::Error if the port is
  /// taken or there are no random numbers for the token.
  Server(std::function<const Site&()> site, std::uint16_t port, const ServerLimits& limits = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const Access& access() const;
  /// Serves until `stopped`, which is called a few times a second, returns true.
  void run(const std::function<bool()>& stopped);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tools
