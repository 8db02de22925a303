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
  /// Maximum number of open connections. A further one ends the connection that has waited longest
  /// for a request. If none waits, it is refused (503).
  std::size_t connections = 256;
  std::size_t header_bytes = 8 * 1024;  ///< request header limit; larger ones are refused (431)
  std::chrono::milliseconds request{30'000};  ///< time for a request to arrive, including the wait
  std::chrono::milliseconds chunk{30'000};    ///< time for a client to receive 64 KiB
};

/// Serves a site on 127.0.0.1 by HTTP/1.1: GET and HEAD, single ranges, and entity tags. Answers
/// requests that have the token or come from a program of this process's session. Uses one thread
/// with asynchronous I/O, so no client can block others.
class Server {
 public:
  /// Opens the port; 0 means any free one. `site` is called for each request. Throws stream::Error
  /// if the port is taken or there are no random numbers for the token.
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
