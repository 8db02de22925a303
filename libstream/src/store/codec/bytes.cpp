// SPDX-License-Identifier: Apache-2.0
#include "store/codec/bytes.hpp"

#include <array>

#ifdef TERRACE_STREAM_PORTABLE_CRC
// Computed at startup, because in a module that is downloaded the tables would be bytes that do not
// compress.
#define TERRACE_CONSTANT
#else
#include <libdeflate.h>
#define TERRACE_CONSTANT constexpr
#endif

namespace terrace::stream::store {
namespace {

/// Returns the tables of a CRC that takes the most significant bit first. Entry [k][b] is the
/// register after byte b and k zero bytes, so that eight bytes are processed at once ("slicing by
/// eight").
template <class Register>
TERRACE_CONSTANT std::array<std::array<Register, 256>, 8> crc_tables(unsigned polynomial) {
  constexpr unsigned kBits = 8 * sizeof(Register), kTop = 1u << (kBits - 1);
  std::array<std::array<Register, 256>, 8> tables{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte << (kBits - 8);
    for (std::size_t k = 0; k < 8; ++k) {
      for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & kTop) != 0 ? polynomial : 0u);
      tables[k][byte] = static_cast<Register>(crc);
    }
  }
  return tables;
}
TERRACE_CONSTANT const auto kCrc16Tables = crc_tables<std::uint16_t>(0x11021);
TERRACE_CONSTANT const auto kCrc8Tables = crc_tables<std::uint8_t>(0x107);

/// Returns the same tables of CRC-32, which takes the least significant bit first.
TERRACE_CONSTANT std::array<std::array<std::uint32_t, 256>, 8> crc32_tables() {
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (std::size_t k = 0; k < 8; ++k) {
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
      tables[k][byte] = crc;
    }
  }
  return tables;
}
TERRACE_CONSTANT const auto kCrc32Tables = crc32_tables();

}  // namespace

std::uint32_t crc32(std::uint32_t crc, const void* data, std::size_t size) {
#ifdef TERRACE_STREAM_PORTABLE_CRC
  return portable_crc32(crc, data, size);
#else
  return libdeflate_crc32(crc, data, size);
#endif
}

std::uint32_t portable_crc32(std::uint32_t crc, const void* data, std::size_t size) {
  crc = ~crc;
  const auto* next = static_cast<const std::uint8_t*>(data);
  for (; size >= 8; size -= 8, next += 8) {
    crc ^= load<std::uint32_t>(next);
    std::uint32_t next_crc = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      next_crc ^= kCrc32Tables[7 - k][crc >> (8 * k) & 0xFF] ^ kCrc32Tables[3 - k][next[4 + k]];
    }
    crc = next_crc;
  }
  for (; size > 0; --size, ++next) crc = (crc >> 8) ^ kCrc32Tables[0][(crc ^ *next) & 0xFF];
  return ~crc;
}

std::uint16_t crc16(ByteView bytes) {
  unsigned crc = 0xFFFF;
  const std::uint8_t* next = bytes.data();
  std::size_t remaining = bytes.size();
  for (; remaining >= 8; remaining -= 8, next += 8) {
    crc ^= static_cast<unsigned>(next[0] << 8 | next[1]);
    crc = kCrc16Tables[7][crc >> 8] ^ kCrc16Tables[6][crc & 0xFF];
    for (std::size_t k = 2; k < 8; ++k) crc ^= kCrc16Tables[7 - k][next[k]];
  }
  for (; remaining > 0; --remaining, ++next) {
    crc = ((crc << 8) & 0xFFFF) ^ kCrc16Tables[0][(crc >> 8) ^ *next];
  }
  return static_cast<std::uint16_t>(crc ^ 0xFFFF);
}

std::uint8_t crc8(ByteView bytes) {
  std::uint8_t crc = 0;
  const std::uint8_t* next = bytes.data();
  std::size_t remaining = bytes.size();
  for (; remaining >= 8; remaining -= 8, next += 8) {
    std::uint8_t next_crc = kCrc8Tables[7][crc ^ next[0]];
    for (std::size_t k = 1; k < 8; ++k) next_crc ^= kCrc8Tables[7 - k][next[k]];
    crc = next_crc;
  }
  for (; remaining > 0; --remaining, ++next) crc = kCrc8Tables[0][crc ^ *next];
  return crc;
}

}  // namespace terrace::stream::store
