// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/bytes.hpp"
#include "store/codec/symbols.hpp"

/// The entropy coder: static rANS with a 32-bit state and 16-bit words from the front of a byte
/// string, raw bits from its back.
/// Source: J. Duda, Asymmetric numeral systems, arXiv:1311.2540; F. Giesen, Interleaved entropy
/// coders, arXiv:1402.3392.

/// A decoder that is not inlined keeps its state in memory, which halves the speed.
#if defined(__GNUC__)
#define TERRACE_STORE_INLINE [[gnu::always_inline]] inline
#else
#define TERRACE_STORE_INLINE inline
#endif

namespace terrace::stream::store {

inline constexpr unsigned kScaleBits = 11;
inline constexpr std::uint32_t kScale = 1u << kScaleBits;
/// Between symbols the state is in [kLow, 2^32), and below kLow only if no words are left.
inline constexpr std::uint32_t kLow = 1u << 16;

/// Frequencies of a context, adding up to kScale. Symbols of frequency 0 are coded with the escape,
/// whose frequency is positive.
using Frequencies = std::array<std::uint16_t, kSymbols>;

/// The tables of all contexts as the encoder uses them.
class EncodeTables {
 public:
  /// The frequency in the lower 16 bits and the start above; 0 for symbols coded with the escape.
  using Entry = std::uint32_t;

  /// Appends the table of the next context.
  void append(const Frequencies& frequencies);
  /// Returns the entries, indexed by *slot*: context * kSymbols + symbol.
  [[nodiscard]] const Entry* entries() const { return entries_.data(); }
  [[nodiscard]] std::size_t contexts() const { return entries_.size() / kSymbols; }

 private:
  std::vector<Entry> entries_;
};

/// A context's table as the decoder uses it. Two small arrays instead of one of 32-bit slots, so
/// that a set of tables stays in the nearest caches even if clusters are read at random.
struct DecodeTable {
  struct Range {
    std::uint16_t frequency = 0, start = 0;
  };
  std::array<std::uint8_t, kScale> symbols{};  ///< by slot
  std::array<Range, kSymbols> ranges{};        ///< by symbol
};

void fill_decode_table(const Frequencies& frequencies, DecodeTable& table);

/// Bits that represent a number.
struct RawBits {
  std::uint64_t value = 0;
  unsigned bits = 0;
};

/// Writes bits, most significant first. append_reversed() appends the bytes in reverse, so that the
/// first bit is in the last byte.
class BitWriter {
 public:
  void clear() {
    used_ = 0;
    hold_ = 0;
    held_ = 0;
  }
  /// Requires value < 2^bits, bits <= 64.
  TERRACE_STORE_INLINE void put(std::uint64_t value, unsigned bits) {
    if (bits > 32) [[unlikely]] {
      put_short(value >> 32, bits - 32);
      value &= 0xffffffff;
      bits = 32;
    }
    put_short(value, bits);
  }
  void append_reversed(Bytes& out) const;
  [[nodiscard]] bool empty() const { return used_ == 0 && held_ == 0; }
  /// Like put(), but requires bits <= 32. Always writes the next word, full or not, because a
  /// branch would be unpredictable.
  TERRACE_STORE_INLINE void put_short(std::uint64_t value, unsigned bits) {
    if (used_ == words_.size()) words_.resize(2 * used_ + 64);
    hold_ = hold_ << bits | value;
    held_ += bits;
    words_[used_] = static_cast<std::uint32_t>(hold_ >> ((held_ - 32) & 63));
    used_ += held_ >> 5;
    held_ &= 31;
  }

 private:
  std::vector<std::uint32_t> words_;  ///< the first used_
  std::size_t used_ = 0;
  std::uint64_t hold_ = 0;  ///< the lower held_ (< 32) bits are not written yet
  unsigned held_ = 0;
};

/// Counts the symbols of clusters for training instead of encoding them.
class SymbolCounter {
 public:
  static constexpr bool kDecoding = false;
  using Local = SymbolCounter&;

  /// counts: occurrences by context and symbol, which are increased.
  explicit SymbolCounter(std::span<std::array<std::uint32_t, kSymbols>> counts) : counts_(counts) {}

  /// Number of raw bits, including those of classes.
  [[nodiscard]] std::uint64_t raw_bits() const { return raw_bits_; }

  TERRACE_STORE_INLINE void symbol(unsigned context, unsigned symbol) {
    ++counts_[context][symbol];
  }
  TERRACE_STORE_INLINE void raw(std::uint64_t /*value*/, unsigned bits) { raw_bits_ += bits; }
  /// See SymbolEncoder.
  void numbers(unsigned first, std::span<const std::uint64_t> numbers, const std::uint8_t* classes,
               const std::uint32_t* slots);

 private:
  std::span<std::array<std::uint32_t, kSymbols>> counts_;
  std::uint64_t raw_bits_ = 0;
};

/// Collects the symbols of one cluster.
class SymbolEncoder {
 public:
  static constexpr bool kDecoding = false;
  using Local = SymbolEncoder&;

  /// `tables` must outlive the encoder.
  explicit SymbolEncoder(const EncodeTables& tables) : entries_(tables.entries()) {}

  void start() {
    used_ = 0;
    bits_.clear();
  }
  TERRACE_STORE_INLINE void symbol(unsigned context, unsigned symbol) {
    const Entry* const table = entries_ + std::size_t{context} * kSymbols;
    Entry entry = table[symbol];
    if (entry == 0) [[unlikely]] {
      entry = table[kEscape];
      bits_.put(symbol, kEscapeBits);
    }
    if (used_ == room_) [[unlikely]]
      grow(1);
    symbols_[used_++] = entry;
  }
  TERRACE_STORE_INLINE void raw(std::uint64_t value, unsigned bits) { bits_.put(value, bits); }
  /// Adds many numbers with their classes, faster than symbol() and raw() for each. slots: the
  /// classes' slots, counted from the first slot of context `first`.
  void numbers(unsigned first, std::span<const std::uint64_t> numbers, const std::uint8_t* classes,
               const std::uint32_t* slots);
  /// Appends the byte string. last: a number below 2^16 that the decoder finds in its final state,
  /// which is kLow + last. Without raw bits the state is `last` itself, because the end of the
  /// string shows that no words are left.
  void finish(std::uint32_t last, Bytes& out) { finish({this, 1}, {&last, 1}, out); }
  /// Number of clusters that are best finished together.
  static constexpr std::size_t kBatch = 4;
  /// Appends the strings of up to kBatch clusters, one after another. Faster than one by one,
  /// because each step of rANS waits for the previous one. last: one per cluster; replaced by the
  /// bytes of its string.
  static void finish(std::span<SymbolEncoder> coders, std::span<std::uint32_t> last, Bytes& out);

 private:
  using Entry = EncodeTables::Entry;
  class Words;
  template <std::size_t kLanes>
  static void finish_lanes(std::array<Words*, kBatch>& lanes);
  void grow(std::size_t more);

  const Entry* entries_;
  std::vector<Entry> symbols_;  ///< the first used_
  std::size_t used_ = 0, room_ = 0;
  std::vector<std::uint16_t> words_;
  BitWriter bits_;
};

/// Bytes that must be readable before and after a cluster's byte string.
inline constexpr std::size_t kPadding = 16;

/// Decodes the output of SymbolEncoder. Reads at most kPadding bytes beyond either end, even of a
/// damaged string; finish() checks that the string was consumed exactly.
class SymbolDecoder {
 public:
  static constexpr bool kDecoding = true;
  /// Inner loops work on a copy, which the compiler can keep in registers.
  using Local = SymbolDecoder;

  SymbolDecoder(std::span<const DecodeTable* const> tables, ByteView bytes)
      : tables_(tables.data()),
        next_(bytes.data()),
        end_(bytes.data() + bytes.size()),
        limit_bits_(bytes.size() * 8) {
    if (bytes.empty()) throw Damage("a cluster or an index page has no bytes");
    state_ = load<std::uint32_t>(next_);
    if (bytes.size() < 4) state_ &= (1u << 8 * bytes.size()) - 1;
    next_ += std::min<std::size_t>(bytes.size(), 4);
  }

  TERRACE_STORE_INLINE unsigned symbol(unsigned context) {
    const DecodeTable& table = *tables_[context];
    const std::uint32_t slot = state_ & (kScale - 1);
    const unsigned symbol = table.symbols[slot];
    const DecodeTable::Range range = table.ranges[symbol];
    state_ = range.frequency * (state_ >> kScaleBits) + slot - range.start;
    const std::uint32_t refilled = state_ << 16 | load<std::uint16_t>(next_);
    // Without a branch, which would be unpredictable.
    const bool low = (state_ < kLow) & (next_ < end_);
    state_ = low ? refilled : state_;
    next_ += low ? 2 : 0;
    if (symbol == kEscape) [[unlikely]]
      return escaped();
    return symbol;
  }
  TERRACE_STORE_INLINE std::uint64_t raw(unsigned bits) {
    if (bits > 56) [[unlikely]] {
      const std::uint64_t high = short_raw(bits - 32);
      return high << 32 | short_raw(32);
    }
    return short_raw(bits);
  }
  /// Returns the encoder's `last`. Throws: Damage unless both ends have met, with zero bits between
  /// them.
  std::uint32_t finish() const {
    const bool met = next_ == end_ - (used_bits_ + 7) / 8;
    if (!met || (used_bits_ % 8 != 0 && (*next_ & (0xff >> used_bits_ % 8)) != 0) ||
        state_ >= 2 * kLow || (state_ < kLow) != (used_bits_ == 0)) {
      throw Damage("coded bytes do not end after their last number");
    }
    return state_ % kLow;
  }

 private:
  /// Requires bits <= 56.
  TERRACE_STORE_INLINE std::uint64_t short_raw(unsigned bits) {
    const std::uint64_t hold = load<std::uint64_t>(end_ - 8 - (used_bits_ >> 3));
    const std::uint64_t value = (hold << (used_bits_ & 7)) >> 1 >> (63 - bits);
    used_bits_ += bits;
    used_bits_ = used_bits_ > limit_bits_ ? limit_bits_ : used_bits_;
    return value;
  }
  TERRACE_STORE_INLINE unsigned escaped() {
    const std::uint64_t symbol = short_raw(kEscapeBits);
    if (symbol >= kClasses) throw_bad_symbol();
    return static_cast<unsigned>(symbol);
  }
  [[noreturn]] static void throw_bad_symbol();

  const DecodeTable* const* tables_;
  const std::uint8_t* next_;
  const std::uint8_t* end_;
  std::size_t limit_bits_;
  std::size_t used_bits_ = 0;
  std::uint32_t state_;
};

}  // namespace terrace::stream::store
