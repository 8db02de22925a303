// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "laz/bytes.hpp"
#include "laz/models.hpp"

/// The arithmetic coder: an interval of 32 bits that is narrowed symbol by symbol and emitted byte
/// by byte. SymbolDecoder and SymbolEncoder have the same functions, so one template codes in both
/// directions: the encoder's functions return their argument, the decoder's the decoded value.
/// Source: A. Said, Introduction to arithmetic coding, HPL-2004-76.

namespace terrace::stream::laz {

/// reserve() must be called at least once per this many coded bytes. A symbol or bit takes at most
/// 2, raw bits at most 3 per 19.
inline constexpr std::size_t kReserve = 64;
/// Bytes added at the end of a stream, as many as a decoder reads ahead.
inline constexpr std::size_t kStreamEnds = 4;

inline constexpr std::uint32_t kMaxLength = 0xffffffff;
inline constexpr std::uint32_t kMinLength = 1u << 24;

/// The bytes read by a decoder. Its inner loop does not check for their end. Near the end,
/// reserve() switches to a copy of the last bytes followed by zeros.
struct CodedBytes {
  std::span<const std::uint8_t> stream;
  std::uint64_t origin = 0;  ///< offset of the stream in the chunk, for errors
  bool at_tail = false;
  std::size_t tail_offset = 0;  ///< of the copy in `stream`
  std::array<std::uint8_t, 2 * kReserve> tail{};
};

/// Decodes a stream. Inner loops work on a copy of it, which the compiler can keep in registers;
/// `bytes` stays in place.
class SymbolDecoder {
 public:
  static constexpr bool kDecoding = true;
  using Record = std::uint8_t*;

  /// Begins a stream. Throws: Corrupt unless it has 4 bytes.
  void begin(CodedBytes& bytes, std::span<const std::uint8_t> stream, std::uint64_t origin,
             ChunkNumber chunk);
  /// Continues the stream in other memory, from offset() on.
  void resume(CodedBytes& bytes, std::span<const std::uint8_t> stream, std::uint64_t origin);
  /// Number of consumed bytes of the current span; more than its size if they did not suffice.
  [[nodiscard]] std::size_t offset() const { return offset(*bytes_, next_); }
  /// Throws Corrupt unless all bytes are consumed; with `open`, only if they did not suffice.
  void check_used(bool open) const;
  /// True if `size` bytes are left. Requires size >= kReserve.
  [[nodiscard]] bool has(std::size_t size) const {
    return !bytes_->at_tail && limit_ - next_ >= static_cast<std::ptrdiff_t>(size - kReserve);
  }

  TERRACE_LAZ_INLINE void reserve() {
    if (next_ > limit_) [[unlikely]]
      use(to_tail(*bytes_, next_));
  }

  template <unsigned Capacity>
  TERRACE_LAZ_INLINE unsigned symbol(SymbolModel<Capacity>& model, unsigned /*value*/,
                                     unsigned symbols = Capacity) {
    if (model.initialised_in != chunk_) [[unlikely]]
      model.begin(chunk_, symbols);
    const std::uint32_t unit = length_ >> kSymbolBits;
    // Many values hardly ever change, so the likeliest symbol is tried first, without a division
    // and with a branch that the processor predicts well.
    unsigned symbol = model.most_frequent;
    std::uint32_t begin = model.start[symbol] * unit;
    std::uint32_t end = symbol + 1 == symbols ? length_ : model.start[symbol + 1] * unit;
    if (value_ - begin >= end - begin) {
      symbol = model.find(value_ / unit);
      begin = model.start[symbol] * unit;
      end = symbol + 1 == symbols ? length_ : model.start[symbol + 1] * unit;
    }
    value_ -= begin;
    length_ = end - begin;
    refill();
    ++model.count[symbol];
    if (--model.countdown == 0) [[unlikely]]
      model.update(symbols);
    return symbol;
  }

  TERRACE_LAZ_INLINE unsigned bit(BitModel& model, unsigned /*value*/) {
    if (model.initialised_in != chunk_) [[unlikely]]
      model.begin(chunk_);
    const std::uint32_t middle = model.zero * (length_ >> kBitBits);
    const bool bit = value_ >= middle;
    value_ -= bit ? middle : 0;
    length_ = bit ? length_ - middle : middle;
    refill();
    model.zeros += bit ? 0 : 1;
    if (--model.countdown == 0) [[unlikely]]
      model.update();
    return bit ? 1 : 0;
  }

  /// Throws: Corrupt, for a symbol that encoders do not write.
  [[noreturn]] TERRACE_LAZ_INLINE void refuse() const { refuse(*bytes_, next_); }

  /// Requires 1 <= bits <= 32.
  TERRACE_LAZ_INLINE std::uint32_t raw(unsigned bits, std::uint32_t /*value*/) {
    if (bits < 20) return short_raw(bits);
    const std::uint32_t low = short_raw(16);
    return low | short_raw(bits - 16) << 16;
  }

 private:
  struct Window {
    const std::uint8_t *next, *limit;
  };
  static Window to_tail(CodedBytes& bytes, const std::uint8_t* next);
  static Window copy_tail(CodedBytes& bytes, std::span<const std::uint8_t> rest);
  static std::size_t offset(const CodedBytes& bytes, const std::uint8_t* next) {
    return bytes.at_tail ? bytes.tail_offset + static_cast<std::size_t>(next - bytes.tail.data())
                         : static_cast<std::size_t>(next - bytes.stream.data());
  }
  [[noreturn]] static void refuse(const CodedBytes& bytes, const std::uint8_t* next);

  TERRACE_LAZ_INLINE void use(Window window) {
    next_ = window.next;
    limit_ = window.limit;
  }
  TERRACE_LAZ_INLINE std::uint32_t short_raw(unsigned bits) {
    length_ >>= bits;
    const std::uint32_t value = value_ / length_;
    // The length need not be a multiple of 2^bits; encoders leave the remainder unused.
    if (value >> bits != 0) [[unlikely]]
      refuse();
    value_ -= value * length_;
    refill();
    return value;
  }
  TERRACE_LAZ_INLINE void refill() {
    while (length_ < kMinLength) {
      value_ = value_ << 8 | *next_++;
      length_ <<= 8;
    }
  }

  const std::uint8_t* next_ = nullptr;
  const std::uint8_t* limit_ = nullptr;  ///< from here on reserve() must copy
  std::uint32_t value_ = 0, length_ = 0;
  ChunkNumber chunk_ = 0;
  CodedBytes* bytes_ = nullptr;
};

/// Encodes a stream; inner loops work on a copy of it, as with SymbolDecoder.
class SymbolEncoder {
 public:
  static constexpr bool kDecoding = false;
  using Record = const std::uint8_t*;

  /// Begins a stream, whose bytes replace those in `bytes`.
  void begin(std::vector<std::uint8_t>& bytes, ChunkNumber chunk);
  /// Ends the stream; `bytes` then has its size.
  void finish();

  TERRACE_LAZ_INLINE void reserve() {
    if (next_ > limit_) [[unlikely]] {
      const Window window = grow(*bytes_, next_);
      next_ = window.next;
      limit_ = window.limit;
    }
  }

  template <unsigned Capacity>
  TERRACE_LAZ_INLINE unsigned symbol(SymbolModel<Capacity>& model, unsigned symbol,
                                     unsigned symbols = Capacity) {
    if (model.initialised_in != chunk_) [[unlikely]]
      model.begin(chunk_, symbols);
    const std::uint32_t unit = length_ >> kSymbolBits;
    const std::uint32_t begin = model.start[symbol] * unit;
    const std::uint32_t end = symbol + 1 == symbols ? length_ : model.start[symbol + 1] * unit;
    narrow(begin, end - begin);
    ++model.count[symbol];
    if (--model.countdown == 0) [[unlikely]]
      model.update(symbols);
    return symbol;
  }

  TERRACE_LAZ_INLINE unsigned bit(BitModel& model, unsigned bit) {
    if (model.initialised_in != chunk_) [[unlikely]]
      model.begin(chunk_);
    const std::uint32_t middle = model.zero * (length_ >> kBitBits);
    narrow(bit != 0 ? middle : 0, bit != 0 ? length_ - middle : middle);
    model.zeros += 1 - bit;
    if (--model.countdown == 0) [[unlikely]]
      model.update();
    return bit;
  }

  TERRACE_LAZ_INLINE std::uint32_t raw(unsigned bits, std::uint32_t value) {
    if (bits < 20) {
      short_raw(bits, value);
    } else {
      short_raw(16, value & 0xffff);
      short_raw(bits - 16, value >> 16);
    }
    return value;
  }

 private:
  struct Window {
    std::uint8_t *next, *limit;
  };
  static Window grow(std::vector<std::uint8_t>& bytes, const std::uint8_t* next);

  TERRACE_LAZ_INLINE void short_raw(unsigned bits, std::uint32_t value) {
    const std::uint32_t unit = length_ >> bits;
    narrow(value * unit, unit);
  }
  TERRACE_LAZ_INLINE void narrow(std::uint32_t begin, std::uint32_t length) {
    base_ += begin;
    if (base_ < begin) carry(next_);
    length_ = length;
    while (length_ < kMinLength) {
      *next_++ = static_cast<std::uint8_t>(base_ >> 24);
      base_ <<= 8;
      length_ <<= 8;
    }
  }
  /// Adds one to the number formed by the bytes before `next`; it cannot overflow.
  TERRACE_LAZ_INLINE static void carry(std::uint8_t* next) {
    do --next;
    while (++*next == 0);
  }

  std::uint8_t* next_ = nullptr;
  std::uint8_t* limit_ = nullptr;
  std::uint32_t base_ = 0, length_ = 0;
  ChunkNumber chunk_ = 0;
  std::vector<std::uint8_t>* bytes_ = nullptr;
};

}  // namespace terrace::stream::laz
