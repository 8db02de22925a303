// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrace::stream::net {

/// The keys of an account or role of AWS or of a server that speaks S3.
struct AwsCredentials {
  std::string key_id, secret;
  std::string token{};  ///< of temporary credentials; otherwise empty
};

/// A request to a service of AWS, before it is signed.
struct AwsRequest {
  std::string method = "GET";
  std::string host;        ///< with the port, if it is not the scheme's own
  std::string path = "/";  ///< not percent-encoded
  std::vector<std::pair<std::string, std::string>> query{};  ///< not percent-encoded
  std::map<std::string, std::string> headers{};              ///< names in lower case
  std::string body{};
};

/// Percent-encodes every byte except letters, digits, "-_.~" and those of `keep`.
std::string percent_encoded(std::string_view text, std::string_view keep = {});

/// Returns path and query of a request, percent-encoded as its signature requires.
std::string encoded_target(const AwsRequest& request);

/// Returns a time as AWS writes it, "20261128T120000Z".
std::string aws_time(std::chrono::system_clock::time_point time);

/// Returns the headers of the request with those that sign it, by Signature Version 4 of AWS for
/// service "s3": the given ones, date, hash of the body, token and authorization. The host is
/// signed and not returned, because HTTP clients set it. time: see aws_time(). Source:
/// docs.aws.amazon.com, "Authenticating Requests (AWS Signature Version 4)".
std::map<std::string, std::string> signed_headers(const AwsRequest& request,
                                                  const AwsCredentials& credentials,
                                                  const std::string& region,
                                                  const std::string& time);

}  // namespace terrace::stream::net
