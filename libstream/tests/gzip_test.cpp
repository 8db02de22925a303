// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/gzip.hpp"

#include <cstdlib>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

std::vector<std::byte> some_bytes(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random() % 7);
  return bytes;
}

TEST(Gzip, RoundTrips) {
  for (const std::size_t size : {0U, 1U, 2U, 1000U, 100000U}) {
    for (const int level : {1, 6, 12}) {
      const auto bytes = some_bytes(size, static_cast<unsigned>(size));
      const auto packed = gzip(bytes, level);
      EXPECT_TRUE(is_gzip(packed));
      EXPECT_EQ(gunzip(packed, size, "test"), bytes);
      EXPECT_EQ(gzip(bytes, level), packed);
    }
  }
}

TEST(Gzip, RefusesDamage) {
  const auto bytes = some_bytes(5000, 1);
  const auto packed = gzip(bytes);
  EXPECT_THROW(gunzip(packed, bytes.size() - 1, "test"), Error);
  for (std::size_t size = 0; size < packed.size(); ++size) {
    EXPECT_THROW(gunzip(std::span(packed).first(size), 1 << 20, "test"), Error) << size;
  }
  // Every changed byte is detected after the header, whose time and system are arbitrary.
  for (std::size_t at = 10; at < packed.size(); ++at) {
    auto damaged = packed;
    damaged[at] ^= std::byte{0x10};
    EXPECT_THROW(gunzip(damaged, 1 << 20, "test"), Error) << at;
  }
  auto longer = packed;
  longer.push_back(std::byte{0});
  EXPECT_THROW(gunzip(longer, 1 << 20, "test"), Error);
}

TEST(Gzip, IsReadByAnotherProgram) {
  if (std::system("command -v gzip >/dev/null") != 0) GTEST_SKIP() << "no gzip installed";
  const TempFolder folder;
  const auto packed = gzip(some_bytes(100000, 2));
  const auto path = folder.path() / "bytes.gz";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(packed.data()),
             static_cast<std::streamsize>(packed.size()));
  EXPECT_EQ(std::system(("gzip -t '" + path.string() + "'").c_str()), 0);
}

}  // namespace
}  // namespace terrace::stream
