// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {

/// How files are read over the network.
struct NetworkOptions {
  /// Limit of the time that one read takes, including its repetitions after failures.
  std::chrono::milliseconds deadline = std::chrono::seconds(120);
  /// Limit of the bytes kept in memory for all files of one store.
  std::uint64_t cache_bytes = std::uint64_t{64} << 20;

  // The rest is for s3:// only. Empty fields are taken from the environment, then from the profile
  // AWS_PROFILE in ~/.aws.
  std::string endpoint{};  ///< "https://host:port" (AWS_ENDPOINT_URL); empty: that of AWS
  std::string region{};    ///< AWS_REGION or AWS_DEFAULT_REGION; otherwise us-east-1
  /// Whether the bucket is part of the path instead of the host name. As required with an endpoint
  /// or a bucket with dots, unless AWS_VIRTUAL_HOSTING is TRUE or FALSE.
  enum class Buckets : std::uint8_t { as_required, in_path, in_host };
  Buckets buckets = Buckets::as_required;
  bool anonymous = false;       ///< sends no signature (AWS_NO_SIGN_REQUEST=YES)
  bool requester_pays = false;  ///< AWS_REQUEST_PAYER=requester
};

/// Whether a name is a URL that begins with http://, https:// or s3://.
[[nodiscard]] bool is_url(std::string_view name);

/// Returns a URL for people: without user name, password, query and fragment.
[[nodiscard]] std::string shown_url(std::string_view url);

/// Returns the function that opens the files below a URL for Store::open(). Their bytes are
/// requested when they are read, as HTTP ranges. Files must not change while they are open: each
/// answer is compared with the first. The files share connections and a cache, are thread-safe and
/// may outlive the function.
///
/// Credentials for s3:// come from the environment (AWS_ACCESS_KEY_ID, ...), the profile in ~/.aws,
/// a web identity, or the metadata of the container or machine, in this order; without any,
/// requests are anonymous.
///
/// Throws: Error if this build has no network, or the URL is malformed. Files throw Error for an
/// object that does not exist or may not be read, one that has changed, a server that ignores
/// ranges, and a connection that keeps failing until the deadline. Errors contain no secrets.
[[nodiscard]] OpenByName files_at_url(const std::string& url, const NetworkOptions& options = {});

}  // namespace terrace::stream
