// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "net/aws_signature.hpp"
#include "net/http_client.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream::net {

/// The settings of AWS that a program finds in its environment and in ~/.aws, and the credentials,
/// which it renews before they expire. Thread-safe. Source: docs.aws.amazon.com, "AWS SDKs and
/// Tools Reference Guide: Standardized credential providers".
class AwsAccount {
 public:
  /// client: for credentials from a server; must outlive this.
  AwsAccount(HttpClient& client, const NetworkOptions& options);

  [[nodiscard]] const std::string& region() const { return region_; }
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }  ///< empty: that of AWS
  /// Whether the bucket is part of the path.
  [[nodiscard]] bool bucket_in_path(const std::string& bucket) const;
  [[nodiscard]] bool requester_pays() const { return requester_pays_; }

  /// Returns the credentials, or nullopt for anonymous requests. May wait for a server, at most 1 s
  /// for that of the machine. Throws: Error if configured credentials cannot be used.
  std::optional<AwsCredentials> credentials();

 private:
  struct Temporary {
    AwsCredentials credentials;
    std::optional<std::chrono::system_clock::time_point> expires;
  };
  using Profile = std::map<std::string, std::string>;

  [[nodiscard]] std::string setting(const char* variable, const char* key) const;
  [[nodiscard]] std::optional<Temporary> find();
  [[nodiscard]] Temporary from_web_identity(const std::string& token_file, const std::string& role);
  [[nodiscard]] std::optional<Temporary> from_container();
  [[nodiscard]] std::optional<Temporary> from_machine();
  HttpAnswer ask(HttpRequest request, std::chrono::milliseconds deadline);

  HttpClient& client_;
  std::string profile_name_;
  Profile profile_;
  std::string region_, endpoint_;
  NetworkOptions::Buckets buckets_;
  bool anonymous_, requester_pays_;

  std::mutex mutex_;
  bool searched_ = false;
  std::optional<Temporary> found_;
};

}  // namespace terrace::stream::net
