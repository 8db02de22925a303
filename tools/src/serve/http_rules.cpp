// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/http_rules.hpp"

#include <algorithm>
#include <charconv>

#include <fmt/core.h>

namespace terrace::tools {
namespace {

std::optional<unsigned> hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a' + 10);
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A' + 10);
  return {};
}

/// Parses a text of digits only. Numbers that are too large become UINT64_MAX.
std::optional<std::uint64_t> decimal(std::string_view text) {
  if (text.empty() || text.find_first_not_of("0123456789") != std::string_view::npos) return {};
  std::uint64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc() ? value : UINT64_MAX;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// Returns whether a list of entity tags contains `tag`, by weak comparison.
bool contains_tag(std::string_view tags, std::string_view tag) {
  if (trimmed(tags) == "*") return true;
  while (!tags.empty()) {
    const std::size_t comma = std::min(tags.find(','), tags.size());
    std::string_view one = trimmed(tags.substr(0, comma));
    if (one.starts_with("W/")) one.remove_prefix(2);
    if (one == tag) return true;
    tags.remove_prefix(std::min(comma + 1, tags.size()));
  }
  return false;
}

/// Returns whether a Host header names the loopback interface at this port.
bool names_this_server(std::string_view host, std::uint16_t port) {
  const std::string ending = fmt::format(":{}", port);
  if (host.ends_with(ending)) {
    host.remove_suffix(ending.size());
  } else if (port != 80) {  // the only port that browsers omit
    return false;
  }
  std::string name(host);
  for (char& c : name) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return name == "127.0.0.1" || name == "localhost" || name == "[::1]";
}

/// Compares texts of one length in a time that does not depend on their contents, so that a token
/// cannot be guessed byte by byte.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned>(static_cast<unsigned char>(b[i]));
  }
  return difference == 0;
}

/// Returns the reason phrase of a status line.
const char* reason_phrase(unsigned status) {
  switch (status) {
    case 200:
      return "OK";
    case 206:
      return "Partial Content";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 413:
      return "Content Too Large";
    case 416:
      return "Range Not Satisfiable";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

}  // namespace

std::optional<std::string> decoded_path(std::string_view target) {
  target = target.substr(0, target.find_first_of("?#"));
  if (!target.starts_with('/')) return {};
  std::string path;
  for (std::size_t i = 1; i < target.size(); ++i) {
    char c = target[i];
    if (c == '%') {
      if (i + 2 >= target.size()) return {};
      const auto high = hexadecimal_digit(target[i + 1]), low = hexadecimal_digit(target[i + 2]);
      if (!high || !low) return {};
      c = static_cast<char>(*high * 16 + *low);
      i += 2;
    }
    if (c == '\0') return {};
    path += c;
  }
  return path;
}

RangeKind parse_range(std::string_view text, std::uint64_t size, ByteSpan& span) {
  text = trimmed(text);
  if (!text.starts_with("bytes=")) return RangeKind::none;
  text.remove_prefix(6);
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos || text.find(',') != std::string_view::npos) {
    return RangeKind::none;
  }
  const std::string_view first_text = trimmed(text.substr(0, dash)),
                         last_text = trimmed(text.substr(dash + 1));
  if (first_text.empty()) {
    const auto last = decimal(last_text);  // the number of final bytes
    if (!last) return RangeKind::none;
    if (*last == 0 || size == 0) return RangeKind::unsatisfiable;
    span.length = std::min(*last, size);
    span.first = size - span.length;
    return RangeKind::single;
  }
  const auto first = decimal(first_text);
  const auto last = last_text.empty() ? UINT64_MAX : decimal(last_text);
  if (!first || !last || *last < *first) return RangeKind::none;
  if (*first >= size) return RangeKind::unsatisfiable;
  span.first = *first;
  span.length = std::min(*last, size - 1) - *first + 1;
  return RangeKind::single;
}

std::string_view query_value(std::string_view target, std::string_view name) {
  target = target.substr(0, target.find('#'));
  std::size_t at = target.find('?');
  while (at < target.size()) {
    const std::size_t end = std::min(target.find('&', at + 1), target.size());
    const std::string_view one = target.substr(at + 1, end - at - 1);
    if (one.starts_with(name) && one.substr(name.size()).starts_with('=')) {
      return one.substr(name.size() + 1);
    }
    at = end;
  }
  return {};
}

Answer answer_to(const Request& request, const Site& site, const Access& access) {
  if (request.hosts > 1) {
    return {.status = 400, .close = true, .reason = "several Host headers"};
  }
  if (!names_this_server(request.host, access.port)) {
    return {.status = 403, .close = true, .reason = "the Host header names another server"};
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return {.status = 405, .close = true, .reason = "only GET and HEAD are supported"};
  }
  auto path = decoded_path(request.target);
  if (!path) return {.status = 400, .reason = "invalid path"};
  if (path->empty()) path = "index.html";
  const auto at = site.find(*path);
  if (at == site.end() || !at->second.open_to_all) {
    if (!request.trusted &&
        !equal_in_constant_time(query_value(request.target, "token"), access.token)) {
      return {.status = 403, .reason = "no token"};
    }
    if (at == site.end()) return {.status = 404, .reason = "not found"};
  }
  const Resource& resource = at->second;
  const std::uint64_t size = resource.bytes->size();
  Answer answer{.type = resource.type, .tag = resource.tag, .size = size};
  if (!request.if_none_match.empty() && contains_tag(request.if_none_match, resource.tag)) {
    answer.status = 304;
    return answer;
  }
  answer.bytes = resource.bytes;
  answer.length = size;
  ByteSpan span;
  const bool range_applies = request.if_range.empty() || trimmed(request.if_range) == resource.tag;
  const RangeKind kind = request.range.empty() || !range_applies
                             ? RangeKind::none
                             : parse_range(request.range, size, span);
  if (kind == RangeKind::single) {
    answer.status = 206;
    answer.first = span.first;
    answer.length = span.length;
  } else if (kind == RangeKind::unsatisfiable) {
    answer.status = 416;
    answer.bytes = nullptr;
    answer.reason = "the file ends before this range";
  }
  return answer;
}

std::string header_of(const Answer& answer) {
  const bool bodiless = answer.status == 304;
  const std::string body =
      answer.bytes || bodiless || answer.reason.empty() ? "" : answer.reason + "\n";
  std::string text = fmt::format("HTTP/1.1 {} {}\r\n", answer.status, reason_phrase(answer.status));
  const auto field = [&](std::string_view name, const std::string& value) {
    text.append(name).append(": ").append(value).append("\r\n");
  };
  if (!bodiless) {
    field("Content-Length", fmt::format("{}", answer.bytes ? answer.length : body.size()));
    field("Content-Type", answer.bytes ? answer.type : "text/plain; charset=utf-8");
  }
  if (answer.status == 206) {
    field("Content-Range", fmt::format("bytes {}-{}/{}", answer.first,
                                       answer.first + answer.length - 1, answer.size));
  }
  if (answer.status == 416) field("Content-Range", fmt::format("bytes */{}", answer.size));
  if (!answer.tag.empty()) field("ETag", answer.tag);
  if (answer.status == 405) field("Allow", "GET, HEAD");
  field("Accept-Ranges", "bytes");
  field("Cache-Control", "no-cache");
  // These fields keep pages of other origins from reading or using the stores, and the token on
  // this page.
  field("Content-Security-Policy", kContentPolicy);
  field("Cross-Origin-Resource-Policy", "same-origin");
  field("Referrer-Policy", "no-referrer");
  field("X-Content-Type-Options", "nosniff");
  if (answer.close) field("Connection", "close");
  return text + "\r\n" + body;
}

}  // namespace terrace::tools
