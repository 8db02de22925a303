// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace terrace::stream::net {

/// The parts of a URL, as written.
struct Url {
  std::string scheme{};       ///< in lower case: http, https, s3
  std::string credentials{};  ///< "user:password", or empty
  std::string host{};         ///< with the port, if any; for s3 the bucket
  std::string path{};         ///< without slashes at its end; empty or begins with a slash
  std::string query{};        ///< without the question mark

  /// The URL of a file below this one, with the same query; this URL if `name` is empty.
  [[nodiscard]] std::string with(std::string_view name) const;
};

/// Splits a URL; a fragment is dropped. Keys of s3 may contain every character, so they have
/// neither query nor fragment. Throws: Error if it has no host, another scheme, or characters that
/// no URL has.
Url parse_url(std::string_view url);

}  // namespace terrace::stream::net
