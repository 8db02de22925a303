// SPDX-License-Identifier: Apache-2.0
#include "store/codec/bytes.hpp"

#include <array>

#include <libdeflate.h>

namespace terrace::stream::store {
namespace {

using Crc16Table = std::array<std::uint16_t, 256>;

/// kCrc16Tables[k][b]: what byte b followed by k zero bytes leaves in the register, so that eight
/// bytes are taken at once ("slicing by eight").
constexpr std::array<Crc16Table, 8> kCrc16Tables = [] {
  std::array<Crc16Table, 8> tables{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << 8;
    for (std::size_t k = 0; k < 8; ++k) {
      for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x8000) != 0 ? 0x11021u : 0u);
      tables[k][byte] = static_cast<std::uint16_t>(crc);
    }
  }
  return tables;
}();

}  // namespace

std::uint32_t crc32(std::uint32_t crc, const void* data, std::size_t size) {
  return libdeflate_crc32(crc, data, size);
}

std::uint16_t crc16(ByteView bytes) {
  unsigned crc = 0xFFFF;
  const std::uint8_t* next = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= 8; left -= 8, next += 8) {
    crc ^= static_cast<unsigned>(next[0] << 8 | next[1]);
    crc = kCrc16Tables[7][crc >> 8] ^ kCrc16Tables[6][crc & 0xFF];
    for (std::size_t k = 2; k < 8; ++k) crc ^= kCrc16Tables[7 - k][next[k]];
  }
  for (; left > 0; --left, ++next) {
    crc = ((crc << 8) & 0xFFFF) ^ kCrc16Tables[0][(crc >> 8) ^ *next];
  }
  return static_cast<std::uint16_t>(crc ^ 0xFFFF);
}

}  // namespace terrace::stream::store
