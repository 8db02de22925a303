// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream::net {

/// The contents of the header Content-Range.
struct ContentRange {
  std::uint64_t first = 0, end = 0;  ///< of the bytes in the body; both 0 if it has none
  std::uint64_t total = 0;           ///< size of the file

  /// Returns nullopt for texts that are not valid or do not state the size of the file.
  static std::optional<ContentRange> parse(std::string_view text);
};

struct HttpRequest {
  std::string url;
  std::string method = "GET";
  std::map<std::string, std::string> headers{};  ///< names in lower case
  std::string body{};
  bool follow = true;  ///< follows redirections
};

struct HttpAnswer {
  int status = 0;                                ///< 0: the connection failed
  std::map<std::string, std::string> headers{};  ///< names in lower case
  std::vector<std::byte> body{};
  bool too_long = false;   ///< the body has more bytes than requested; it was cut off
  std::string failure{};   ///< what went wrong with the connection, if anything
  bool transient = false;  ///< whether the failure may go away

  /// The value of a header, or an empty text.
  [[nodiscard]] const std::string& header(const std::string& name) const;
};

/// A request of a batch. It may be sent several times.
struct HttpTask {
  std::function<HttpRequest()> make;  ///< called for each attempt, because signatures expire
  std::size_t max_bytes = 0;          ///< the body is cut off beyond them
  HttpAnswer answer{};                ///< the last one
};

/// Sends HTTP requests over connections that are kept. Thread-safe.
class HttpClient {
 public:
  HttpClient();
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  /// Sends requests, at most 8 at a time over all threads. Repeats a request after a wait that
  /// doubles, for statuses 408, 429 and 5xx, for bodies that are cut short and for lost
  /// connections, until the deadline has passed since the call. Does not throw for failures: the
  /// answers have them.
  void send(std::span<HttpTask> tasks, std::chrono::milliseconds deadline);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream::net
