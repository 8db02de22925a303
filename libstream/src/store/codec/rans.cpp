// SPDX-License-Identifier: Apache-2.0
#include "store/codec/rans.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <optional>
#include <utility>

namespace terrace::stream::store {
namespace {

/// 2^64 / frequency, rounded up except for the first two.
constexpr std::array<std::uint64_t, kScale + 1> kReciprocals = [] {
  std::array<std::uint64_t, kScale + 1> reciprocals{};
  for (std::uint32_t f = 2; f <= kScale; ++f) reciprocals[f] = UINT64_MAX / f + 1;
  return reciprocals;
}();

/// Returns state / frequency, exactly, because the reciprocal is too large by less than 2^-32 of
/// its value.
inline std::uint32_t divided(std::uint32_t state, std::uint32_t frequency) {
  if (frequency == 1) [[unlikely]]
    return state;
  __extension__ using Wide = unsigned __int128;
  return static_cast<std::uint32_t>((Wide{state} * kReciprocals[frequency]) >> 64);
}

}  // namespace

void EncodeTables::append(const Frequencies& frequencies) {
  unsigned start = 0;
  for (const std::uint16_t frequency : frequencies) {
    entries_.push_back(frequency > 0 ? start << 16 | frequency : 0);
    start += frequency;
  }
  assert(start == kScale);
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

void SymbolDecoder::throw_bad_symbol() { throw Damage("coded bytes have an unknown symbol"); }

void BitWriter::append_reversed(Bytes& out) const {
  std::uint64_t rest = hold_;
  unsigned remaining = held_;
  if (remaining % 8 != 0) {
    rest <<= 8 - remaining % 8;
    remaining += 8 - remaining % 8;
  }
  for (; remaining > 0; remaining -= 8, rest >>= 8) out.push_back(static_cast<std::uint8_t>(rest));
  const std::size_t end = out.size();
  out.resize(end + used_ * sizeof(std::uint32_t));
  std::uint8_t* to = out.data() + end;
  for (std::size_t i = used_; i-- > 0; to += sizeof(std::uint32_t)) {
    std::memcpy(to, &words_[i], sizeof(std::uint32_t));
  }
}

void SymbolCounter::numbers(unsigned first, std::span<const std::uint64_t> numbers,
                            const std::uint8_t* classes, const std::uint32_t* slots) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    ++counts_[first + slots[i] / kSymbols][classes[i]];
    raw_bits_ += kClassRange[classes[i]].bits;
  }
}

void SymbolEncoder::grow(std::size_t more) {
  symbols_.resize(2 * used_ + more + 1024);
  room_ = symbols_.size();
}

void SymbolEncoder::numbers(unsigned first, std::span<const std::uint64_t> numbers,
                            const std::uint8_t* classes, const std::uint32_t* slots) {
  const std::size_t n = numbers.size();
  if (room_ - used_ < n) grow(n);
  const Entry* const entries = entries_ + std::size_t{first} * kSymbols;
  Entry* const out = symbols_.data() + used_;
  bool escape = false;
  std::uint64_t all_bits = 0;
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = entries[slots[i]];
    escape |= out[i] == 0;
    all_bits |= numbers[i];
  }
  used_ += n;
  if (all_bits < 16 && !escape) return;  // no raw bits
  BitWriter bits = std::move(bits_);     // a copy, which the compiler can keep in registers
  const auto open_bits = [&](std::size_t i) -> RawBits {
    const ClassRange& range = kClassRange[classes[i]];
    return {numbers[i] - range.base, range.bits};
  };
  std::size_t i = 0;
  if (all_bits >> 17 == 0 && !escape) {
    for (; i + 1 < n; i += 2) {  // the bits of two are at most 32
      const RawBits one = open_bits(i), other = open_bits(i + 1);
      bits.put_short(one.value << other.bits | other.value, one.bits + other.bits);
    }
  }
  for (; i < n; ++i) {
    if (out[i] == 0) [[unlikely]] {
      out[i] = entries[slots[i] - classes[i] + kEscape];
      bits.put(classes[i], kEscapeBits);
    }
    const RawBits coded = open_bits(i);
    bits.put(coded.value, coded.bits);
  }
  bits_ = std::move(bits);
}

/// Produces the rANS stream of an encoder's symbols. rANS is last in, first out, so symbols are
/// taken in reverse order and words are produced from the last to the first.
class SymbolEncoder::Words {
 public:
  /// The initial state is the decoder's final one, so it holds 16 bits at no cost.
  Words(SymbolEncoder& encoder, std::uint32_t last)
      : remaining(encoder.used_),
        symbols_(encoder.symbols_.data()),
        without_raw_bits_(encoder.bits_.empty()),
        state_(without_raw_bits_ ? last : kLow + last) {
    assert(last < kLow);
    if (encoder.words_.size() <= remaining) encoder.words_.resize(2 * remaining + 64);
    end_ = next_ = encoder.words_.data() + encoder.words_.size();
  }

  std::size_t remaining;  ///< symbols not yet taken

  TERRACE_STORE_INLINE void step() {
    const Entry entry = symbols_[--remaining];
    const std::uint32_t frequency = entry & 0xffff, begin = entry >> 16;
    // Always written, even if it does not count, because a branch is often mispredicted.
    next_[-1] = static_cast<std::uint16_t>(state_);
    const unsigned full = state_ >> (32 - kScaleBits) >= frequency ? 1 : 0;
    next_ -= full;
    state_ >>= 16 * full;
    state_ = divided(state_, frequency) * (kScale - frequency) + state_ + begin;
  }
  void write(Bytes& out) const {
    const auto bytes = static_cast<std::size_t>(end_ - next_) * sizeof(std::uint16_t);
    // If the string is only the state, it has only the bytes that the state needs.
    std::size_t of_state = sizeof state_;
    while (without_raw_bits_ && bytes == 0 && of_state > 1 && state_ >> (8 * of_state - 8) == 0)
      --of_state;
    const std::size_t start = out.size();
    out.resize(start + of_state + bytes);
    std::memcpy(out.data() + start, &state_, of_state);
    std::memcpy(out.data() + start + of_state, next_, bytes);
  }

 private:
  const Entry* symbols_;
  std::uint16_t *next_, *end_;
  bool without_raw_bits_;  ///< no raw bits follow
  std::uint32_t state_;
};

/// Codes the lanes in parallel until one has no symbols left, then continues with the others as
/// long as there are two.
template <std::size_t kLanes>
void SymbolEncoder::finish_lanes(std::array<Words*, kBatch>& lanes) {
  std::sort(lanes.begin(), lanes.begin() + kLanes,
            [](const Words* a, const Words* b) { return a->remaining > b->remaining; });
  const auto finish_shortest = [&]<std::size_t... kLane>(std::index_sequence<kLane...>) {
    std::array<Words, kLanes> words{*lanes[kLane]...};  // which the compiler can keep in registers
    for (std::size_t steps = words.back().remaining; steps > 0; --steps) (words[kLane].step(), ...);
    ((*lanes[kLane] = words[kLane]), ...);
  };
  finish_shortest(std::make_index_sequence<kLanes>());
  if constexpr (kLanes > 2) finish_lanes<kLanes - 1>(lanes);
}

void SymbolEncoder::finish(std::span<SymbolEncoder> coders, std::span<std::uint32_t> last,
                           Bytes& out) {
  assert(coders.size() <= kBatch && last.size() == coders.size());
  std::array<std::optional<Words>, kBatch> words;
  std::array<Words*, kBatch> lanes{};
  for (std::size_t i = 0; i < coders.size(); ++i) lanes[i] = &words[i].emplace(coders[i], last[i]);
  if (coders.size() == kBatch) finish_lanes<kBatch>(lanes);
  for (std::size_t i = 0; i < coders.size(); ++i) {
    while (words[i]->remaining > 0) words[i]->step();
  }
  for (std::size_t i = 0; i < coders.size(); ++i) {
    const std::size_t start = out.size();
    words[i]->write(out);
    coders[i].bits_.append_reversed(out);
    last[i] = static_cast<std::uint32_t>(out.size() - start);
  }
}

}  // namespace terrace::stream::store
