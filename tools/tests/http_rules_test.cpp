// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/http_rules.hpp"

#include <gtest/gtest.h>

namespace terrace::tools {
namespace {

constexpr std::uint64_t kMany = UINT64_MAX;

struct RangeCase {
  const char* text;
  std::uint64_t size;
  RangeKind kind;
  std::uint64_t first, length;
};

// The rules of RFC 9110, section 14.
TEST(HttpRange, FollowsTheStandard) {
  using enum RangeKind;
  for (const RangeCase& c : {
           RangeCase{"bytes=0-0", 10, single, 0, 1},
           {"bytes=2-5", 10, single, 2, 4},
           {"bytes=2-", 10, single, 2, 8},
           {"bytes=9-99", 10, single, 9, 1},
           {"bytes=-3", 10, single, 7, 3},
           {"bytes=-30", 10, single, 0, 10},
           {" bytes= 2 - 5 ", 10, single, 2, 4},
           {"bytes=0-18446744073709551615", 10, single, 0, 10},
           {"bytes=0-99999999999999999999999", 10, single, 0, 10},
           {"bytes=5-", kMany, single, 5, kMany - 5},
           {"bytes=10-", 10, unsatisfiable, 0, 0},
           {"bytes=99999999999999999999999-", 10, unsatisfiable, 0, 0},
           {"bytes=-0", 10, unsatisfiable, 0, 0},
           {"bytes=0-", 0, unsatisfiable, 0, 0},
           {"bytes=-5", 0, unsatisfiable, 0, 0},
           {"bytes=5-2", 10, none, 0, 0},
           {"bytes=0-1,3-4", 10, none, 0, 0},
           {"bytes=", 10, none, 0, 0},
           {"bytes=-", 10, none, 0, 0},
           {"bytes=a-b", 10, none, 0, 0},
           {"bytes=--5", 10, none, 0, 0},
           {"bytes=+1-2", 10, none, 0, 0},
           {"bytes=0x1-2", 10, none, 0, 0},
           {"lines=0-1", 10, none, 0, 0},
           {"Bytes 0-1", 10, none, 0, 0},
       }) {
    SCOPED_TRACE(c.text);
    ByteSpan span;
    EXPECT_EQ(parse_range(c.text, c.size, span), c.kind);
    if (c.kind != single) continue;
    EXPECT_EQ(span.first, c.first);
    EXPECT_EQ(span.length, c.length);
  }
}

TEST(HttpPath, DecodesOnce) {
  EXPECT_EQ(decoded_path("/a/b"), "a/b");
  EXPECT_EQ(decoded_path("/"), "");
  EXPECT_EQ(decoded_path("/a%20b%2Fc?x=1#y"), "a b/c");
  EXPECT_EQ(decoded_path("/%252e"), "%2e");
  for (const char* bad : {"", "a", "http://x/a", "*", "/%", "/%2", "/%zz", "/a%00b"}) {
    EXPECT_FALSE(decoded_path(bad)) << bad;
  }
}

class HttpAnswers : public testing::Test {
 protected:
  HttpAnswers() {
    site_["index.html"] = {stream::bytes_in_memory("i", std::vector<std::byte>(7)), "text/html",
                           "\"i\"", true};
    site_["stores/a/data"] = {stream::bytes_in_memory("d", std::vector<std::byte>(100)),
                              "application/octet-stream", "\"t\""};
  }
  /// Answers a request that has the token.
  [[nodiscard]] Answer get(const std::string& target, const char* range = "",
                           const char* if_range = "", const char* if_none_match = "") const {
    return answer_to(
        {.method = "GET",
         .target = target + (target.find('?') == target.npos ? "?" : "&") + "token=abc",
         .range = range,
         .if_range = if_range,
         .if_none_match = if_none_match,
         .host = "localhost:8000"},
        site_, access_);
  }
  [[nodiscard]] unsigned status(const char* target, const char* host = "localhost:8000",
                                const char* method = "GET") const {
    return answer_to({.method = method, .target = target, .host = host}, site_, access_).status;
  }
  Site site_;
  Access access_{8000, "abc"};
};

TEST_F(HttpAnswers, ServeOnlyFilesOfTheSite) {
  EXPECT_EQ(get("/").length, 7u);
  EXPECT_EQ(get("/index.html?x").status, 200u);
  EXPECT_EQ(get("/stores/a/%64ata").status, 200u);
  for (const char* path :
       {"/stores/a/", "/stores/a", "/stores/a/../a/data", "/../index.html", "//index.html",
        "/./index.html", "/stores/a/data/", "/stores%2Fa%2F..%2F..%2Findex.html", "/etc/passwd",
        "/..%2f..%2fetc/passwd", "/INDEX.HTML", "/%252e%252e/index.html"}) {
    EXPECT_EQ(get(path).status, 404u) << path;
  }
  EXPECT_EQ(get("index.html").status, 400u);
  EXPECT_EQ(status("/", "localhost:8000", "POST"), 405u);
  EXPECT_EQ(status("/", "localhost:8000", "OPTIONS"), 405u);
}

TEST(HttpQuery, MatchesFullParameterNames) {
  EXPECT_EQ(query_value("/a?token=x", "token"), "x");
  EXPECT_EQ(query_value("/a?b=1&token=x&c", "token"), "x");
  EXPECT_EQ(query_value("/a?token=x&token=y#z", "token"), "x");
  for (const char* without : {"", "/", "/a", "/a?", "/a?token", "/a?token=", "/a?tokens=x",
                              "/a?xtoken=x", "/a?x=token=y", "/token=x", "/a#?token=x"}) {
    EXPECT_EQ(query_value(without, "token"), "") << without;
  }
}

TEST_F(HttpAnswers, RequireTheTokenForStores) {
  EXPECT_EQ(status("/stores/a/data?token=abc"), 200u);
  for (const char* target : {"/stores/a/data", "/stores/a/data?token=", "/stores/a/data?token=ab",
                             "/stores/a/data?token=abcd", "/stores/a/data?token=abd", "/nothing"}) {
    EXPECT_EQ(status(target), 403u) << target;
  }
  EXPECT_EQ(status("/nothing?token=abc"), 404u);
  EXPECT_EQ(status("/"), 200u);
}

TEST_F(HttpAnswers, RequireAHostOfThisServer) {
  for (const char* host : {"127.0.0.1:8000", "localhost:8000", "LOCALHOST:8000", "[::1]:8000"}) {
    EXPECT_EQ(status("/", host), 200u) << host;
  }
  for (const char* host :
       {"", "localhost", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:80000", "evil.example:8000",
        "localhost.evil:8000", "x@localhost:8000", ":8000"}) {
    EXPECT_EQ(status("/", host), 403u) << host;
  }
  // Browsers omit only port 80.
  EXPECT_EQ(
      answer_to({.method = "GET", .target = "/", .host = "localhost"}, site_, {80, "abc"}).status,
      200u);
}

TEST_F(HttpAnswers, RejectSeveralHosts) {
  Request request{.method = "GET", .target = "/", .host = "localhost:8000", .hosts = 2};
  EXPECT_EQ(answer_to(request, site_, {8000, "abc"}).status, 400u);
  request.host = "evil.example";
  EXPECT_EQ(answer_to(request, site_, {8000, "abc"}).status, 400u);
}

TEST_F(HttpAnswers, GrantNothingToOtherOrigins) {
  for (const Answer& answer : {get("/"), get("/stores/a/data", "bytes=0-1"), get("/nothing")}) {
    const std::string header = header_of(answer);
    EXPECT_EQ(header.find("Access-Control-"), header.npos) << header;
    EXPECT_NE(header.find("Cross-Origin-Resource-Policy: same-origin\r\n"), header.npos);
    EXPECT_NE(header.find("Content-Security-Policy: default-src 'none';"), header.npos);
  }
}

TEST_F(HttpAnswers, SendRangesIfTheTagMatches) {
  const Answer part = get("/stores/a/data", "bytes=10-19");
  EXPECT_EQ(part.status, 206u);
  EXPECT_EQ(part.first, 10u);
  EXPECT_EQ(part.length, 10u);
  const std::string header = header_of(part);
  EXPECT_NE(header.find("Content-Range: bytes 10-19/100\r\n"), std::string::npos);
  EXPECT_NE(header.find("Content-Length: 10\r\n"), std::string::npos);
  EXPECT_NE(header.find("ETag: \"t\"\r\n"), std::string::npos);
  EXPECT_EQ(get("/stores/a/data", "bytes=10-19", "\"t\"").status, 206u);
  EXPECT_EQ(get("/stores/a/data", "bytes=10-19", "\"other\"").status, 200u);
  EXPECT_EQ(get("/stores/a/data", "bytes=10-19", "W/\"t\"").status, 200u);
  EXPECT_EQ(get("/stores/a/data", "bytes=100-").status, 416u);
  EXPECT_NE(header_of(get("/stores/a/data", "bytes=100-")).find("Content-Range: bytes */100\r\n"),
            std::string::npos);
  EXPECT_EQ(get("/stores/a/data", "", "", "\"t\"").status, 304u);
  EXPECT_EQ(get("/stores/a/data", "", "", "\"x\", W/\"t\"").status, 304u);
  EXPECT_EQ(get("/stores/a/data", "", "", "*").status, 304u);
  EXPECT_EQ(get("/stores/a/data", "", "", "\"x\"").status, 200u);
}

}  // namespace
}  // namespace terrace::tools
