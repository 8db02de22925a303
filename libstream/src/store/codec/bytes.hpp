// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace terrace::stream::store {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

static_assert(std::endian::native == std::endian::little,
              "multi-byte values are copied as they are; a big-endian machine needs swaps here");

/// Thrown for damaged bytes in a store. States what is wrong, but not where; callers that know file
/// and offset turn it into an Error.
class Damage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Converts a number of bytes of a file to a size in memory, which may have only 32 bits. Throws:
/// Damage if it is too large.
inline std::size_t memory_size(std::uint64_t bytes) {
  if (bytes > SIZE_MAX / 2)
    throw Damage("a part of the file is too large for this machine's memory");
  return static_cast<std::size_t>(bytes);
}

/// Returns zlib's CRC-32, continued from `crc` (initially 0).
std::uint32_t crc32(std::uint32_t crc, const void* data, std::size_t size);
/// Computes crc32() without libdeflate, more slowly. crc32() calls it if
/// TERRACE_STREAM_PORTABLE_CRC is defined, as for WebAssembly.
std::uint32_t portable_crc32(std::uint32_t crc, const void* data, std::size_t size);
inline std::uint32_t crc32(ByteView bytes) { return crc32(0, bytes.data(), bytes.size()); }

/// Returns the CRC-16 with the polynomial 0x1021, from 0xFFFF, most significant bit first, inverted
/// at the end ("CRC-16/GENIBUS"; 0xD64E of "123456789").
/// Detects every error of one or two bits, or within 16 adjacent bits, in 4 KiB.
std::uint16_t crc16(ByteView bytes);
/// Returns the CRC-8 with the polynomial 0x07, from 0, most significant bit first ("CRC-8/SMBUS";
/// 0xF4 of "123456789"). Detects every error of an odd number of bits, or within 8 adjacent bits.
std::uint8_t crc8(ByteView bytes);

template <class T>
T load(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

template <class T>
void put(Bytes& out, T value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(out.data() + at, &value, sizeof value);
}

/// Appends an unsigned number, 7 bits per byte, low bits first; the top bit of a byte is set if
/// more bytes follow.
inline void put_varint(Bytes& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<std::uint8_t>(value | 0x80));
  out.push_back(static_cast<std::uint8_t>(value));
}

/// Maps 0, -1, 1, -2, ... to 0, 1, 2, 3, ..., so that small magnitudes become small numbers.
constexpr std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
constexpr std::int64_t unzigzag(std::uint64_t value) {
  return static_cast<std::int64_t>((value >> 1) ^ (std::uint64_t{0} - (value & 1)));
}

/// Reads the values written by put() and put_varint(), never past the end.
class ByteReader {
 public:
  explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

  [[nodiscard]] std::size_t offset() const { return at_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - at_; }

  template <class T>
  T get() {
    const T value = load<T>(take(sizeof(T)).data());
    return value;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = get<std::uint8_t>();
      if (shift == 63 && byte > 1) break;
      value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
    throw Damage("a number has too many bytes");
  }
  ByteView take(std::size_t size) {
    if (size > remaining()) throw Damage("the data end too early");
    const ByteView part = bytes_.subspan(at_, size);
    at_ += size;
    return part;
  }

 private:
  ByteView bytes_;
  std::size_t at_ = 0;
};

}  // namespace terrace::stream::store
