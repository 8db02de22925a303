// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "serve/site.hpp"

/// What to answer to a request, without a socket (RFC 9110).

namespace terrace::tools {

struct Request {
  std::string_view method, target;
  std::string_view range{}, if_range{}, if_none_match{};  ///< empty: not given
  std::string_view host{};                                ///< likewise
  std::size_t hosts = 1;                                  ///< header lines with a Host
  bool trusted = false;                                   ///< needs no token
};

/// Who may ask: web pages of other origins and other users of the machine can reach the port too.
struct Access {
  std::uint16_t port = 0;  ///< the server's own
  std::string token{};     ///< `token` in the query of a request that has the printed address
};

struct Answer {
  unsigned status = 200;
  bool close = false;    ///< the connection ends with it
  std::string reason{};  ///< of an error, for people; the body if there are no bytes
  std::string type{}, tag{};
  std::shared_ptr<const stream::ByteSource> bytes{};  ///< null: none
  std::uint64_t first = 0, length = 0;                ///< the part of them that is sent
  std::uint64_t size = 0;                             ///< of all of them; for 206 and 416
};

/// A path as it was before it was encoded, without the slash at the front; nullopt for what is no
/// path or has a null byte in it.
std::optional<std::string> decoded_path(std::string_view target);

struct ByteSpan {
  std::uint64_t first = 0, length = 0;
};
enum class RangeKind : std::uint8_t { none, single, unsatisfiable };
/// A header Range against a body of `size` bytes. none: not one range of bytes, so it is ignored.
RangeKind parse_range(std::string_view text, std::uint64_t size, ByteSpan& span);

/// The value of a parameter in the query of a target; empty if it is not there.
std::string_view query_value(std::string_view target, std::string_view name);

/// Refuses (400) several header lines Host, of which servers on the way may take another one;
/// (403) a Host that does not name this server, as a page has that a name server has led
/// here (DNS rebinding), and a request without the token for anything but the viewer's own files.
Answer answer_to(const Request& request, const Site& site, const Access& access);

/// What the viewer may load and run: its own files, WebAssembly, an icon within the page. The page
/// says the same, for other servers (tools/viewer/src/index.html).
inline constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src "
    "'self'; "
    "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'";
/// Status line and header fields, and the reason as the body where there are no bytes.
std::string header_of(const Answer& answer);

}  // namespace terrace::tools
