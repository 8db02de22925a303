// SPDX-License-Identifier: Apache-2.0
#include "io/gzip_stream.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "io/peek.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/gzip.hpp"
#include "terrace/stream/input.hpp"

/// Decompression of gzip as a stream, compared with libdeflate.

namespace terrace::stream {
namespace {

std::string packed(const std::string& text, int level = 6) {
  const std::vector<std::byte> bytes = gzip(std::as_bytes(std::span(text)), level);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string some_text(std::size_t size, std::mt19937_64& random) {
  std::string text;
  while (text.size() < size) {
    text += random() % 3 == 0 ? std::string(random() % 300, 'a') : std::to_string(random());
  }
  text.resize(size);
  return text;
}

// Decompresses `bytes`, given in pieces of random lengths up to max_in and requested in pieces of
// up to max_out.
std::string unpacked(const std::string& bytes, std::size_t max_in, std::size_t max_out,
                     std::mt19937_64& random) {
  std::size_t offset = std::min<std::size_t>(bytes.size(), random() % 30);
  GzipStream stream("x.gz", std::string_view(bytes).substr(0, offset));
  const auto read_more = [&](char* to, std::size_t max_bytes) {
    const std::size_t count = std::min({max_bytes, bytes.size() - offset, 1 + random() % max_in});
    std::memcpy(to, bytes.data() + offset, count);
    offset += count;
    return count;
  };
  std::string out;
  std::vector<char> room(max_out);
  for (;;) {
    const std::size_t got = stream.read(room.data(), 1 + random() % max_out, read_more);
    if (got == 0) return out;
    out.append(room.data(), got);
  }
}

TEST(GzipStream, DecompressesInAnyPieces) {
  const std::uint64_t seed = 20;
  std::mt19937_64 random(seed);
  for (int round = 0; round < 200 / TERRACE_TEST_SHARE; ++round) {
    SCOPED_TRACE("seed 20, round " + std::to_string(round));
    std::string text, bytes;
    for (std::size_t member = 0; member <= random() % 4; ++member) {
      // Some are empty, like the last one of bgzip.
      const std::string part = some_text(random() % 5 == 0 ? 0 : random() % 200'000, random);
      text += part;
      bytes += packed(part, 1 + static_cast<int>(random() % 12));
    }
    const std::size_t max_in = random() % 2 == 0 ? 7 : 100'000;
    const std::size_t max_out = random() % 2 == 0 ? 50 : 300'000;
    EXPECT_EQ(unpacked(bytes, max_in, max_out, random), text);
  }
}

TEST(GzipStream, DetectsEveryTruncation) {
  std::mt19937_64 random(21);
  const std::string one = packed(some_text(700, random));
  const std::string bytes = one + packed(some_text(300, random));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (size == one.size()) continue;  // complete members
    const std::string cut = bytes.substr(0, size);
    try {
      unpacked(cut, 100, 100, random);
      ADD_FAILURE() << size << " bytes of " << bytes.size() << " were taken for the complete data";
    } catch (const Error& error) {
      EXPECT_EQ(error.parts().file, "x.gz");
      EXPECT_NE(error.parts().where.find("byte " + std::to_string(size)), std::string::npos)
          << error.what();
    }
  }
}

// Every changed byte is detected, except in the header, which is not used.
TEST(GzipStream, DetectsDamage) {
  std::mt19937_64 random(22);
  const std::string text = some_text(500, random);
  const std::string bytes = packed(text);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    try {
      EXPECT_EQ(unpacked(damaged, 100, 100, random), text);
      EXPECT_TRUE(at >= 3 && at < 10) << at;
    } catch (const Error&) {
    }
  }
  EXPECT_THROW(unpacked(bytes + "hello", 100, 100, random), Error);
  EXPECT_THROW(unpacked(bytes + std::string(9, '\0'), 100, 100, random), Error);
}

class GzipInput : public ::testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& content) const {
    const std::string path = (folder_.path() / name).string();
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  TempFolder folder_;
};

TEST_F(GzipInput, GivesThePointsOfTheText) {
  std::mt19937_64 random(23);
  const std::string text = some_text(900'000, random);
  const std::string file = put("text.gz", packed(text));
  EXPECT_TRUE(is_rereadable(file));
  EXPECT_FALSE(is_seekable(file));
  EXPECT_TRUE(is_seekable(put("text", text)));
  Input input(file, {}, 1000);
  EXPECT_FALSE(input.size().has_value());
  EXPECT_EQ(input.fill(300'000).substr(0, 300'000), text.substr(0, 300'000));
  ASSERT_TRUE(input.skip(500'000));
  EXPECT_EQ(input.offset(), 500'000U);
  EXPECT_EQ(input.fill(1'000'000), text.substr(500'000));
  EXPECT_FALSE(input.skip(400'001));
  Input as_it_is(file, {}, 1000, Input::Packed::as_it_is);
  EXPECT_EQ(as_it_is.fill(1'000'000), packed(text));
  const std::vector<char> head = peek_head(file, 100, {});
  EXPECT_EQ(std::string(head.begin(), head.end()), text.substr(0, 100));
}

TEST_F(GzipInput, IsReadFromPipes) {
  std::mt19937_64 random(24);
  for (const std::string& text :
       {some_text(300'000, random), std::string("a"), std::string("\x1f"), std::string()}) {
    for (const bool gzipped : {false, true}) {
      const std::string pipe = (folder_.path() / "pipe").string();
      ::remove(pipe.c_str());
      ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
      // The first byte arrives alone.
      const std::string bytes = gzipped ? packed(text) : text;
      std::thread writer([&] {
        std::ofstream out(pipe, std::ios::binary);
        out << bytes.substr(0, 1) << std::flush << (bytes.empty() ? "" : bytes.substr(1));
      });
      const std::vector<char> head = peek_head(pipe, 50, {});
      EXPECT_EQ(std::string(head.begin(), head.end()), text.substr(0, 50));
      Input input(pipe);
      EXPECT_EQ(input.fill(1'000'000), text);
      writer.join();
      drop_heads();
    }
  }
}

}  // namespace
}  // namespace terrace::stream
