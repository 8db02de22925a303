// SPDX-License-Identifier: Apache-2.0
#include "store/codec/rans.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

namespace terrace::stream::store {
namespace {

/// 2^64 / frequency, rounded up but for the first two.
constexpr std::array<std::uint64_t, kScale + 1> kReciprocals = [] {
  std::array<std::uint64_t, kScale + 1> reciprocals{};
  for (std::uint32_t f = 2; f <= kScale; ++f) reciprocals[f] = UINT64_MAX / f + 1;
  return reciprocals;
}();

/// state / frequency: exact, as the reciprocal is too large by less than 2^-32 of itself.
inline std::uint32_t divided(std::uint32_t state, std::uint32_t frequency) {
  if (frequency == 1) [[unlikely]]
    return state;
  __extension__ using Wide = unsigned __int128;
  return static_cast<std::uint32_t>((Wide{state} * kReciprocals[frequency]) >> 64);
}

}  // namespace

EncodeTable encode_table(const Frequencies& frequencies) {
  EncodeTable table;
  unsigned start = 0;
  for (unsigned s = 0; s < kSymbols; ++s) {
    if (frequencies[s] > 0) table.entries[s] = start << 16 | frequencies[s];
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
  throw Damage("coded bytes have a symbol that does not exist");
}

void BitWriter::append_reversed(Bytes& out) const {
  std::uint64_t rest = hold_;
  unsigned left = held_;
  if (left % 8 != 0) {
    rest <<= 8 - left % 8;
    left += 8 - left % 8;
  }
  for (; left > 0; left -= 8, rest >>= 8) out.push_back(static_cast<std::uint8_t>(rest));
  const std::size_t end = out.size();
  out.resize(end + used_ * sizeof(std::uint32_t));
  std::uint8_t* to = out.data() + end;
  for (std::size_t i = used_; i-- > 0; to += sizeof(std::uint32_t)) {
    std::memcpy(to, &words_[i], sizeof(std::uint32_t));
  }
}

void SymbolEncoder::grow() {
  symbols_.resize(2 * used_ + 1024);
  room_ = symbols_.size();
}

/// The rANS stream of an encoder's symbols. rANS is last in, first out: the symbols go in
/// backwards, and the words come out from the last to the first.
class SymbolEncoder::Words {
 public:
  /// The initial state is the decoder's final one, so it carries 16 bits for nothing.
  Words(SymbolEncoder& encoder, std::uint32_t last)
      : left(encoder.used_),
        symbols_(encoder.symbols_.data()),
        alone_(encoder.bits_.empty()),
        state_(alone_ ? last : kLow + last) {
    assert(last < kLow);
    if (encoder.words_.size() <= left) encoder.words_.resize(2 * left + 64);
    end_ = next_ = encoder.words_.data() + encoder.words_.size();
  }

  std::size_t left;  ///< symbols to go in

  TERRACE_STORE_INLINE void step() {
    const EncodeTable::Entry entry = symbols_[--left];
    const std::uint32_t frequency = entry & 0xffff, begin = entry >> 16;
    // Written whether it counts or not: a branch upon that is often guessed wrong.
    next_[-1] = static_cast<std::uint16_t>(state_);
    const unsigned full = state_ >> (32 - kScaleBits) >= frequency ? 1 : 0;
    next_ -= full;
    state_ >>= 16 * full;
    state_ = divided(state_, frequency) * (kScale - frequency) + state_ + begin;
  }
  void write(Bytes& out) const {
    const auto bytes = static_cast<std::size_t>(end_ - next_) * sizeof(std::uint16_t);
    // Where it is all there is, no more of its bytes than it needs.
    std::size_t of_state = sizeof state_;
    while (alone_ && bytes == 0 && of_state > 1 && state_ >> (8 * of_state - 8) == 0) --of_state;
    const std::size_t start = out.size();
    out.resize(start + of_state + bytes);
    std::memcpy(out.data() + start, &state_, of_state);
    std::memcpy(out.data() + start + of_state, next_, bytes);
  }

 private:
  const EncodeTable::Entry* symbols_;
  std::uint16_t *next_, *end_;
  bool alone_;  ///< no raw bits follow
  std::uint32_t state_;
};

void SymbolEncoder::finish(std::uint32_t last, Bytes& out) {
  Words words(*this, last);
  while (words.left > 0) words.step();
  words.write(out);
  bits_.append_reversed(out);
}

std::size_t SymbolEncoder::finish_both(SymbolEncoder& first, std::uint32_t last_of_first,
                                       SymbolEncoder& second, std::uint32_t last_of_second,
                                       Bytes& out) {
  Words a(first, last_of_first), b(second, last_of_second);
  for (std::size_t both = std::min(a.left, b.left); both > 0; --both) {
    a.step();
    b.step();
  }
  while (a.left > 0) a.step();
  while (b.left > 0) b.step();
  const std::size_t start = out.size();
  a.write(out);
  first.bits_.append_reversed(out);
  const std::size_t middle = out.size();
  b.write(out);
  second.bits_.append_reversed(out);
  return middle - start;
}

}  // namespace terrace::stream::store
