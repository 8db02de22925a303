// SPDX-License-Identifier: Apache-2.0
#include "net/url.hpp"

#include <algorithm>
#include <cctype>

#include "terrace/stream/error.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream {
namespace {

constexpr std::string_view kSchemeEnd = "://";

std::string scheme_of(std::string_view name) {
  const std::size_t end = name.find(kSchemeEnd);
  std::string scheme(name.substr(0, end == name.npos ? 0 : end));
  for (char& c : scheme) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return scheme;
}

}  // namespace

bool is_url(std::string_view name) {
  const std::string scheme = scheme_of(name);
  return scheme == "http" || scheme == "https" || scheme == "s3";
}

std::string shown_url(std::string_view url) {
  url = url.substr(0, url.find_first_of("?#"));
  const std::size_t host = url.find(kSchemeEnd);
  if (host == url.npos) return std::string(url);
  const std::size_t begin = host + kSchemeEnd.size();
  const std::size_t at = url.substr(0, url.find('/', begin)).rfind('@');
  if (at == url.npos || at < begin) return std::string(url);
  return std::string(url.substr(0, begin)).append(url.substr(at + 1));
}

namespace net {

std::string Url::with(std::string_view name) const {
  std::string url = scheme + std::string(kSchemeEnd);
  if (!credentials.empty()) url += credentials + "@";
  url += host + path;
  if (!name.empty()) url.append("/").append(name);
  return query.empty() ? url : url + "?" + query;
}

Url parse_url(std::string_view url) {
  Url parts{.scheme = scheme_of(url)};
  if (!is_url(url)) {
    throw Error(shown_url(url), "is not a URL of http, https or s3");
  }
  const auto is_bad = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; };
  if (std::any_of(url.begin(), url.end(), is_bad)) {
    throw Error(parts.scheme + std::string(kSchemeEnd), "the URL contains a control character");
  }
  std::string_view rest = url.substr(parts.scheme.size() + kSchemeEnd.size());
  if (parts.scheme != "s3") {
    rest = rest.substr(0, rest.find('#'));
    const std::size_t mark = std::min(rest.find('?'), rest.size());
    parts.query = rest.substr(std::min(mark + 1, rest.size()));
    rest = rest.substr(0, mark);
  }
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  parts.host = rest.substr(0, slash);
  parts.path = rest.substr(slash);
  while (parts.path.ends_with('/')) parts.path.pop_back();
  if (const std::size_t at = parts.host.rfind('@'); at != parts.host.npos) {
    parts.credentials = parts.host.substr(0, at);
    parts.host.erase(0, at + 1);
  }
  if (parts.host.empty()) {
    throw Error(shown_url(url),
                parts.scheme == "s3" ? "the URL has no bucket" : "the URL has no host");
  }
  return parts;
}

}  // namespace net
}  // namespace terrace::stream
