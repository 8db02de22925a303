// SPDX-License-Identifier: Apache-2.0
#include "net/origin.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/core.h>

namespace terrace::stream::net {
namespace {

bool is_region(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return c == '-' || std::isalnum(static_cast<unsigned char>(c)) != 0;
  });
}

std::string endpoint_of_aws(const std::string& region) {
  return fmt::format("https://s3.{}.amazonaws.com{}", region,
                     region.starts_with("cn-") ? ".cn" : "");
}

}  // namespace

Origin::Origin(const std::string& url, HttpClient& client, const NetworkOptions& options)
    : url_(parse_url(url)) {
  if (url_.scheme != "s3") return;
  account_ = std::make_unique<AwsAccount>(client, options);
  const std::string& endpoint = account_->endpoint();
  endpoint_ = parse_url(endpoint.empty() ? endpoint_of_aws(account_->region()) : endpoint);
  if (endpoint_.scheme == "s3") {
    throw Error(shown_url(endpoint), "the endpoint of S3 is not a URL of http or https")
        .remedy("check AWS_ENDPOINT_URL");
  }
  folder_ = endpoint_.path;
  if (account_->bucket_in_path(url_.host)) {
    folder_ += "/" + url_.host;
  } else {
    endpoint_.host = url_.host + "." + endpoint_.host;
  }
  folder_ += url_.path;
}

HttpRequest Origin::get(const std::string& file, std::map<std::string, std::string> headers) const {
  if (!account_) return {.url = url_.with(file), .headers = std::move(headers)};
  if (account_->requester_pays()) headers["x-amz-request-payer"] = "requester";
  AwsRequest request{.host = endpoint_.host,
                     .path = file.empty() ? folder_ : folder_ + "/" + file,
                     .headers = std::move(headers)};
  if (const auto credentials = account_->credentials()) {
    request.headers = signed_headers(request, *credentials, account_->region(),
                                     aws_time(std::chrono::system_clock::now()));
  }
  // A redirection leads to another region, for which the signature is not valid.
  return {.url = endpoint_.scheme + "://" + endpoint_.host + encoded_target(request),
          .headers = std::move(request.headers),
          .follow = false};
}

std::string Origin::shown(const std::string& file) const { return shown_url(url_.with(file)); }

Error Origin::refusal(const std::string& file, const HttpAnswer& answer, bool connected) const {
  const std::string name = shown(file);
  const std::string& region = answer.header("x-amz-bucket-region");
  if (account_ && is_region(region) && region != account_->region()) {
    return Error(name, "the bucket is in the region " + region).remedy("set AWS_REGION=" + region);
  }
  if (answer.status == 0 || !answer.failure.empty()) {
    return Error(name, "cannot read from the server: " + answer.failure)
        .remedy("check the URL and the connection");
  }
  switch (answer.status) {
    case 401:
    case 403:
      return Error(name, fmt::format("the server denies access (status {})", answer.status))
          .remedy(account_ ? "check the credentials of AWS, the bucket and the key"
                           : "check the URL and your permissions");
    case 404:
    case 410:
      return connected ? Error(name, "the server no longer has the file").remedy("open it again")
                       : Error(name, "the server has no such file").remedy("check the URL");
    default:
      break;
  }
  Error error(name, fmt::format("the server answers with status {}", answer.status));
  return answer.transient ? std::move(error).remedy("try again later") : error;
}

}  // namespace terrace::stream::net
