// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "store/codec/bytes.hpp"
#include "store/codec/layout.hpp"
#include "store/codec/predictor.hpp"
#include "store/codec/rans.hpp"

namespace terrace::stream::store {

/// The number of occurrences of each symbol in each context.
using Counts = std::vector<std::array<std::uint32_t, kSymbols>>;

/// Returns the bits of the symbols of a context if coded with their own table.
[[nodiscard]] std::uint64_t entropy_of(const std::array<std::uint32_t, kSymbols>& counts);
/// Returns the raw bits of the symbols' classes.
[[nodiscard]] std::uint64_t open_bits_of(const std::array<std::uint32_t, kSymbols>& counts);
/// Returns frequencies for `counts`. Every symbol stays codable: those that occur less often than
/// `min_count` by the escape.
Frequencies normalised(const std::array<std::uint32_t, kSymbols>& counts,
                       std::uint32_t min_count = 1);

/// Writes the frequencies of contexts; see "Tables" of FORMAT.md.
void write_frequencies(std::span<const Frequencies> frequencies, Bytes& out);
/// Reads them. Throws: Damage.
std::vector<Frequencies> read_frequencies(ByteReader& in, unsigned contexts);

/// The attribute that shows where scan lines begin, the time of the pulses.
struct Guide {
  static constexpr unsigned kNone = UINT32_MAX;

  unsigned attribute = kNone;
  std::uint64_t min_jump = 0;  ///< a difference of at least this begins a line; not stored

  [[nodiscard]] bool exists() const { return attribute != kNone; }
};

/// The tables of a range of a level's clusters: height predictor and symbol frequencies.
struct Tables {
  Predictor predictor;
  Guide guide;
  std::vector<ColumnKind> kinds;         ///< one per column
  std::vector<Frequencies> frequencies;  ///< one per context

  void write(Bytes& out) const;
  /// Parses tables. Throws: Damage.
  static Tables read(ByteView bytes, const Layout& layout);
};

/// Tables prepared for encoding.
struct EncodingTables {
  Predictor predictor;
  Guide guide;
  std::vector<ColumnKind> kinds;
  EncodeTables tables;

  explicit EncodingTables(const Tables& source);
};

/// Tables prepared for decoding. Contexts without symbols share one table.
struct DecodingTables {
  Predictor predictor;
  Guide guide;
  std::vector<ColumnKind> kinds;
  std::vector<const DecodeTable*> tables;

  explicit DecodingTables(const Tables& source);
  DecodingTables(const DecodingTables&) = delete;
  DecodingTables& operator=(const DecodingTables&) = delete;

 private:
  std::vector<DecodeTable> storage_;
};

}  // namespace terrace::stream::store
