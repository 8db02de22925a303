// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <random>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <libdeflate.h>

#include "store/codec/bytes.hpp"

namespace terrace::stream::store {
namespace {

/// Computes the CRC bit by bit from the definition of the polynomial.
std::uint16_t crc16_by_bits(ByteView bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<unsigned>(byte) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x8000) != 0 ? 0x11021u : 0u);
  }
  return static_cast<std::uint16_t>(crc ^ 0xFFFF);
}

TEST(Crc16, HasThePublishedCheckValue) {
  constexpr std::string_view kText = "123456789";
  EXPECT_EQ(crc16({reinterpret_cast<const std::uint8_t*>(kText.data()), kText.size()}), 0xD64E);
  EXPECT_EQ(crc16({}), 0);
}

TEST(Crc16, EqualsTheDefinitionForEveryLength) {
  std::mt19937_64 random(1);
  for (std::size_t size = 0; size < 100; ++size) {
    SCOPED_TRACE(size);
    std::vector<std::uint8_t> bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    EXPECT_EQ(crc16(bytes), crc16_by_bits(bytes));
  }
}

TEST(Crc8, HasThePublishedCheckValueAndEqualsTheDefinition) {
  constexpr std::string_view kText = "123456789";
  EXPECT_EQ(crc8({reinterpret_cast<const std::uint8_t*>(kText.data()), kText.size()}), 0xF4);
  std::mt19937_64 random(3);
  for (std::size_t size = 0; size < 100; ++size) {
    SCOPED_TRACE(size);
    std::vector<std::uint8_t> bytes(size);
    unsigned crc = 0;
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(random());
      crc ^= byte;
      for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x80) != 0 ? 0x107u : 0u);
    }
    EXPECT_EQ(crc8(bytes), crc);
  }
}

TEST(Crc32, PortableEqualsTheLibrarysAtOnceAndInParts) {
  std::mt19937_64 random(2);
  for (std::size_t size = 1; size < 300; ++size) {
    SCOPED_TRACE(size);
    std::vector<std::uint8_t> bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const auto start = static_cast<std::uint32_t>(random());
    EXPECT_EQ(portable_crc32(start, bytes.data(), size),
              libdeflate_crc32(start, bytes.data(), size));
    const std::size_t cut = random() % size;
    EXPECT_EQ(portable_crc32(portable_crc32(0, bytes.data(), cut), bytes.data() + cut, size - cut),
              crc32(bytes));
  }
  EXPECT_EQ(portable_crc32(0, "123456789", 9), 0xCBF43926u);
}

}  // namespace
}  // namespace terrace::stream::store
