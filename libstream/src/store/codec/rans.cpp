// SPDX-License-Identifier: Apache-2.0
#include "store/codec/rans.hpp"

#include <algorithm>
#include <cassert>

namespace terrace::stream::store {

EncodeTable encode_table(const Frequencies& frequencies) {
  EncodeTable table;
  unsigned start = 0;
  for (unsigned s = 0; s < kSymbols; ++s) {
    table.entries[s] = {frequencies[s], static_cast<std::uint16_t>(start)};
    start += frequencies[s];
  }
  assert(start == kScale);
  return table;
}

void fill_decode_table(const Frequencies& frequencies, DecodeTable& table) {
  unsigned start = 0;
  for (unsigned s = 0; s < kSymbols; ++s) {
    table.ranges[s] = {frequencies[s], static_cast<std::uint16_t>(start)};
    std::fill_n(table.symbols.begin() + start, frequencies[s], static_cast<std::uint8_t>(s));
    start += frequencies[s];
  }
  assert(start == kScale);
}

void SymbolDecoder::throw_bad_symbol() {
  throw Damage("a cluster has a symbol that does not exist");
}

void SymbolEncoder::finish(Bytes& out, std::uint32_t last) {
  if (tables_.empty()) return;
  assert(last < kLow);
  // rANS is last in, first out: the symbols go in backwards. The initial state is the decoder's
  // final one, so it carries 16 bits for nothing.
  std::uint32_t state = kLow + last;
  words_.clear();
  for (std::size_t i = used_; i-- > 0;) {
    const EncodeTable::Entry entry = tables_[symbols_[i] >> 8].entries[symbols_[i] & 0xff];
    const std::uint32_t frequency = entry.frequency;
    if (state >= static_cast<std::uint64_t>(frequency) << (32 - kScaleBits)) {
      words_.push_back(static_cast<std::uint16_t>(state));
      state >>= 16;
    }
    state = ((state / frequency) << kScaleBits) + state % frequency + entry.start;
  }
  put(out, state);
  for (std::size_t i = words_.size(); i-- > 0;) put(out, words_[i]);
  bits_.append_reversed(out);
}

}  // namespace terrace::stream::store
