// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "serve/site.hpp"

/// Answers to HTTP requests, independent of sockets (RFC 9110).

namespace terrace::tools {

/// The parts of a request that the answer depends on.
struct Request {
  std::string_view method, target;
  std::string_view range{}, if_range{}, if_none_match{};  ///< empty: not given
  std::string_view host{};                                ///< empty: not given
  std::size_t hosts = 1;                                  ///< number of Host header lines
  bool trusted = false;                                   ///< comes from a program of this session
};

/// Requirements for requests. Web pages of other origins and other users of the machine can reach
/// the port too, and must not read the stores.
struct Access {
  std::uint16_t port = 0;  ///< port of the server
  std::string token{};     ///< value of `token` in the printed address
};

/// The status, header fields and body of a response.
struct Answer {
  unsigned status = 200;
  bool close = false;         ///< closes the connection after it
  std::string reason{};       ///< error text; the body if there are no bytes
  std::string type{}, tag{};  ///< media type and entity tag, see Resource
  std::shared_ptr<const stream::ByteSource> bytes{};  ///< null if there is no body
  std::uint64_t first = 0, length = 0;                ///< range of the bytes to send
  std::uint64_t size = 0;                             ///< total size; for 206 and 416
};

/// Returns the decoded path without its leading slash; nullopt if it is not a valid path or
/// contains a null byte.
std::optional<std::string> decoded_path(std::string_view target);

/// A range of bytes.
struct ByteSpan {
  std::uint64_t first = 0, length = 0;
};
enum class RangeKind : std::uint8_t { none, single, unsatisfiable };
/// Parses a Range header for a body of `size` bytes. Returns `none`, so that it is ignored, if it
/// is not a single range of bytes.
RangeKind parse_range(std::string_view text, std::uint64_t size, ByteSpan& span);

/// Returns the value of a query parameter of a target; empty if it is absent.
std::string_view query_value(std::string_view target, std::string_view name);

/// Answers a request. Rejects several Host headers (400), because a proxy on the way may have used
/// another one. Rejects a Host that does not name this server (403), because pages that reach it by
/// DNS rebinding send such a Host. Rejects requests for anything but the viewer's own files if they
/// are neither trusted nor have the token (403).
Answer answer_to(const Request& request, const Site& site, const Access& access);

/// Content security policy of the viewer: it may load and run its own files, WebAssembly, and icons
/// embedded in the page. The page repeats this for other servers (viewer/src/index.html).
inline constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src "
    "'self'; "
    "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'";
/// Returns the status line and header fields, followed by the reason as the body if there are no
/// bytes.
std::string header_of(const Answer& answer);

}  // namespace terrace::tools
