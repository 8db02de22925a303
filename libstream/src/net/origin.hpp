// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>

#include "net/aws_account.hpp"
#include "net/http_client.hpp"
#include "net/url.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream::net {

/// Makes requests for the files below a URL, signed where the URL is of s3. Thread-safe.
class Origin {
 public:
  /// client: for credentials; must outlive this. Throws: Error for a malformed URL.
  Origin(const std::string& url, HttpClient& client, const NetworkOptions& options);

  /// Returns a GET of the file with further headers. Throws: Error if credentials fail.
  [[nodiscard]] HttpRequest get(const std::string& file,
                                std::map<std::string, std::string> headers) const;
  /// Returns the URL of the file for messages.
  [[nodiscard]] std::string shown(const std::string& file) const;
  /// Returns the Error for an answer that is not the file. connected: whether the file has been
  /// read before.
  [[nodiscard]] Error refusal(const std::string& file, const HttpAnswer& answer,
                              bool connected) const;

 private:
  Url url_;
  std::unique_ptr<AwsAccount> account_;  ///< for s3 only
  Url endpoint_{};                       ///< for s3: the host that is asked
  std::string folder_{};                 ///< for s3: the path of url_ at the endpoint
};

}  // namespace terrace::stream::net
