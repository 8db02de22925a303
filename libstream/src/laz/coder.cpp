// SPDX-License-Identifier: Apache-2.0
#include "laz/coder.hpp"

#include <algorithm>

#include "terrace/stream/laz.hpp"

namespace terrace::stream::laz {
namespace {

constexpr const char* kTooShort = "the coded bytes end too early";
constexpr const char* kNotEncoded = "the coded bytes cannot come from an encoder";

}  // namespace

void SymbolDecoder::begin(CodedBytes& bytes, std::span<const std::uint8_t> stream,
                          std::uint64_t origin, ChunkNumber chunk) {
  if (stream.size() < kStreamEnds) throw Corrupt(kTooShort, origin + stream.size());
  chunk_ = chunk;
  length_ = kMaxLength;
  value_ = 0;
  for (std::size_t i = 0; i < kStreamEnds; ++i) value_ = value_ << 8 | stream[i];
  // The value is outside the interval.
  if (value_ == kMaxLength) throw Corrupt(kNotEncoded, origin);
  resume(bytes, stream, origin);
  next_ += kStreamEnds;
}

void SymbolDecoder::resume(CodedBytes& bytes, std::span<const std::uint8_t> stream,
                           std::uint64_t origin) {
  bytes_ = &bytes;
  bytes.stream = stream;
  bytes.origin = origin;
  bytes.at_tail = false;
  if (stream.size() >= kReserve) {
    use({stream.data(), stream.data() + stream.size() - kReserve});
  } else {
    use(copy_tail(bytes, stream));
  }
}

SymbolDecoder::Window SymbolDecoder::to_tail(CodedBytes& bytes, const std::uint8_t* next) {
  if (bytes.at_tail) throw Corrupt(kTooShort, bytes.origin + bytes.stream.size());
  // At most kReserve bytes have been read since the last call.
  return copy_tail(bytes, bytes.stream.subspan(offset(bytes, next)));
}

SymbolDecoder::Window SymbolDecoder::copy_tail(CodedBytes& bytes,
                                               std::span<const std::uint8_t> rest) {
  bytes.at_tail = true;
  bytes.tail_offset = bytes.stream.size() - rest.size();
  const auto end = std::copy(rest.begin(), rest.end(), bytes.tail.begin());
  std::fill(end, bytes.tail.end(), std::uint8_t{0});
  return {bytes.tail.data(), bytes.tail.data() + rest.size()};
}

void SymbolDecoder::refuse(const CodedBytes& bytes, const std::uint8_t* next) {
  throw Corrupt(kNotEncoded, bytes.origin + std::min(offset(bytes, next), bytes.stream.size()));
}

void SymbolDecoder::check_used(bool open) const {
  const std::size_t used = offset(), size = bytes_->stream.size();
  if (used > size) throw Corrupt(kTooShort, bytes_->origin + size);
  if (used < size && !open)
    throw Corrupt("bytes follow the last point of the chunk", bytes_->origin + used);
}

void SymbolEncoder::begin(std::vector<std::uint8_t>& bytes, ChunkNumber chunk) {
  chunk_ = chunk;
  base_ = 0;
  length_ = kMaxLength;
  bytes_ = &bytes;
  if (bytes.size() < 2 * kReserve) bytes.resize(2 * kReserve);
  next_ = bytes.data();
  limit_ = bytes.data() + bytes.size() - kReserve;
}

SymbolEncoder::Window SymbolEncoder::grow(std::vector<std::uint8_t>& bytes,
                                          const std::uint8_t* next) {
  const auto used = static_cast<std::size_t>(next - bytes.data());
  bytes.resize(2 * bytes.size());
  return {bytes.data() + used, bytes.data() + bytes.size() - kReserve};
}

void SymbolEncoder::finish() {
  reserve();
  // Writes the shortest number in the interval, and zeros for the bytes that a decoder reads ahead.
  const bool wide = length_ > 2 * kMinLength;
  narrow(wide ? kMinLength : kMinLength >> 1, wide ? kMinLength >> 1 : kMinLength >> 9);
  for (int i = 0; i < (wide ? 3 : 2); ++i) *next_++ = 0;
  bytes_->resize(static_cast<std::size_t>(next_ - bytes_->data()));
}

}  // namespace terrace::stream::laz
