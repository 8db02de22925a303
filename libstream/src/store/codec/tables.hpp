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

/// How often each symbol came in each context.
using Counts = std::vector<std::array<std::uint32_t, kSymbols>>;

/// Bits that the symbols of a context take, coded with a table of their own ...
[[nodiscard]] std::uint64_t entropy_of(const std::array<std::uint32_t, kSymbols>& counts);
/// ... and what the classes leave open.
[[nodiscard]] std::uint64_t open_bits_of(const std::array<std::uint32_t, kSymbols>& counts);
/// Frequencies for `counts`, every symbol seen kept codable, the escape too.
Frequencies normalised(const std::array<std::uint32_t, kSymbols>& counts);

/// What a segment of a level's clusters is coded with: height predictor and symbol frequencies.
struct Tables {
  Predictor predictor;
  std::vector<ColumnKind> kinds;         ///< one per column; none in version 1
  std::vector<Frequencies> frequencies;  ///< one per context

  void write(Bytes& out) const;
  /// Throws: Damage.
  static Tables read(ByteView bytes, const Layout& layout);
  /// More bytes than this no tables have.
  static std::uint64_t most_bytes(const Layout& layout) {
    constexpr std::uint64_t kVarint = 10;
    return 8 + kVarint * kPatterns * kNeighbours + layout.columns() +
           std::uint64_t{layout.contexts()} * kVarint * (1 + 2 * kClasses);
  }
};

/// Tables made ready for encoding.
struct EncodingTables {
  Predictor predictor;
  std::vector<ColumnKind> kinds;
  std::vector<EncodeTable> tables;

  explicit EncodingTables(const Tables& from);
};

/// Tables made ready for decoding; contexts that nothing was seen in share one table.
struct DecodingTables {
  Predictor predictor;
  std::vector<ColumnKind> kinds;
  std::vector<const DecodeTable*> tables;

  explicit DecodingTables(const Tables& from);
  DecodingTables(const DecodingTables&) = delete;
  DecodingTables& operator=(const DecodingTables&) = delete;

 private:
  std::vector<DecodeTable> storage_;
};

}  // namespace terrace::stream::store
