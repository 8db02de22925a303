// SPDX-License-Identifier: Apache-2.0
#include "store/codec/tables.hpp"

#include <algorithm>
#include <bit>
#include <cassert>

namespace terrace::stream::store {
namespace {

Frequencies escape_only() {
  Frequencies frequencies{};
  frequencies[kEscape] = kScale;
  return frequencies;
}

/// Bits after the point of log2(x), which is computed by squaring, so that it is the same on every
/// machine.
constexpr unsigned kFraction = 16;
std::uint64_t logarithm(std::uint64_t x) {
  const auto exponent = static_cast<unsigned>(std::bit_width(x)) - 1;
  std::uint64_t mantissa = exponent > 31 ? x >> (exponent - 31) : x << (31 - exponent);
  std::uint64_t result = exponent;
  for (unsigned i = 0; i < kFraction; ++i) {
    mantissa = mantissa * mantissa >> 31;
    const bool carry = mantissa >> 32 != 0;
    mantissa >>= carry ? 1 : 0;
    result = result << 1 | (carry ? 1 : 0);
  }
  return result;
}

}  // namespace

std::uint64_t entropy_of(const std::array<std::uint32_t, kSymbols>& counts) {
  std::uint64_t total = 0, known = 0;
  for (const std::uint64_t count : counts) {
    total += count;
    if (count > 0) known += count * logarithm(count);
  }
  return total == 0 ? 0 : (total * logarithm(total) - known) >> kFraction;
}

std::uint64_t open_bits_of(const std::array<std::uint32_t, kSymbols>& counts) {
  std::uint64_t bits = 0;
  for (unsigned s = 0; s < kSymbols; ++s) bits += std::uint64_t{counts[s]} * kClassRange[s].bits;
  return bits;
}

Frequencies normalised(const std::array<std::uint32_t, kSymbols>& counts, std::uint32_t min_count) {
  std::uint64_t total = 0, rare = 0;
  for (unsigned s = 0; s < kClasses; ++s) {
    if (counts[s] >= min_count) total += counts[s];
    if (counts[s] <= std::max(min_count - 1, 1u)) rare += counts[s];
  }
  if (total == 0) return escape_only();
  // The expected number of unseen symbols is the number of those seen once (Good-Turing).
  const std::uint64_t escape =
      std::clamp<std::uint64_t>(rare * kScale / (total + 1), 1, kScale / 16);
  const std::uint64_t available = kScale - escape;

  Frequencies frequencies{};
  frequencies[kEscape] = static_cast<std::uint16_t>(escape);
  std::uint64_t sum = 0;
  for (unsigned s = 0; s < kClasses; ++s) {
    if (counts[s] < std::max(min_count, 1u)) continue;
    const std::uint64_t share = std::max<std::uint64_t>(1, counts[s] * available / total);
    frequencies[s] = static_cast<std::uint16_t>(share);
    sum += share;
  }
  // The most frequent symbols absorb the rounding, because it costs them least.
  while (sum != available) {
    const auto largest = std::max_element(frequencies.begin(), frequencies.begin() + kClasses);
    if (sum < available) {
      *largest = static_cast<std::uint16_t>(*largest + (available - sum));
      sum = available;
    } else {
      const std::uint64_t excess = std::min<std::uint64_t>(sum - available, *largest / 8u + 1u);
      *largest = static_cast<std::uint16_t>(*largest - excess);
      sum -= excess;
    }
  }
  return frequencies;
}

void write_frequencies(std::span<const Frequencies> frequencies, Bytes& out) {
  std::uint64_t unused = 0;  // contexts without symbols, not yet written
  const auto put_unused = [&] {
    if (unused == 0) return;
    put_varint(out, 0);
    put_varint(out, unused - 1);
    unused = 0;
  };
  for (const Frequencies& context : frequencies) {
    const auto used = std::count_if(context.begin(), context.begin() + kClasses,
                                    [](std::uint16_t f) { return f != 0; });
    if (used == 0) {
      ++unused;
      continue;
    }
    put_unused();
    put_varint(out, static_cast<std::uint64_t>(used));
    unsigned previous = 0;
    for (unsigned s = 0; s < kClasses; ++s) {
      if (context[s] == 0) continue;
      put_varint(out, s - previous);
      put_varint(out, context[s]);
      previous = s;
    }
  }
  put_unused();
}

std::vector<Frequencies> read_frequencies(ByteReader& in, unsigned contexts) {
  std::vector<Frequencies> all;
  all.reserve(contexts);
  for (unsigned c = 0; c < contexts; ++c) {
    Frequencies frequencies{};
    std::uint64_t symbol = 0, remaining = kScale;
    const std::uint64_t used = in.varint();
    if (used == 0) {
      const std::uint64_t more = in.varint();
      if (more >= contexts - c) throw Damage("a table has too many contexts");
      all.resize(c + 1 + static_cast<std::size_t>(more), escape_only());
      c += static_cast<unsigned>(more);
      continue;
    }
    for (std::uint64_t i = 0; i < used; ++i) {
      const std::uint64_t step = in.varint();
      if (step >= kClasses || (i > 0 && step == 0) || symbol + step >= kClasses) {
        throw Damage("a table has an unknown symbol");
      }
      symbol += step;
      const std::uint64_t frequency = in.varint();
      if (frequency == 0 || frequency >= remaining)
        throw Damage("the frequencies of a table do not add up");
      frequencies[static_cast<std::size_t>(symbol)] = static_cast<std::uint16_t>(frequency);
      remaining -= frequency;
    }
    frequencies[kEscape] = static_cast<std::uint16_t>(remaining);
    all.push_back(frequencies);
  }
  return all;
}

void Tables::write(Bytes& out) const {
  predictor.write(out);
  put_varint(out, guide.exists() ? guide.attribute + std::uint64_t{1} : 0);
  for (const ColumnKind kind : kinds) out.push_back(static_cast<std::uint8_t>(kind));
  write_frequencies(frequencies, out);
}

Tables Tables::read(ByteView bytes, const Layout& layout) {
  ByteReader in(bytes);
  Tables tables;
  tables.predictor = Predictor::read(in);
  const std::uint64_t guide = in.varint();
  if (guide > layout.attributes.size()) throw Damage("a table's guide does not exist");
  if (guide > 0) tables.guide.attribute = static_cast<unsigned>(guide - 1);
  for (unsigned c = 0; c < layout.columns(); ++c) {
    const unsigned kind = in.get<std::uint8_t>();
    const bool lines = tables.guide.exists() && c != tables.guide.attribute;
    if (kind >= (lines ? kColumnKinds : kUnguidedKinds)) {
      throw Damage("a table has an unknown kind of columns");
    }
    tables.kinds.push_back(static_cast<ColumnKind>(kind));
    if (along_line(tables.kinds[c]) == ColumnKind::preceding &&
        !(layout.may_use_preceding(c) && c != tables.guide.attribute)) {
      throw Damage("a table predicts a column from one that is not an integer attribute");
    }
  }
  tables.frequencies = read_frequencies(in, layout.contexts());
  if (in.remaining() != 0) throw Damage("bytes follow the tables");
  return tables;
}

EncodingTables::EncodingTables(const Tables& source)
    : predictor(source.predictor), guide(source.guide), kinds(source.kinds) {
  for (const Frequencies& frequencies : source.frequencies) {
    tables.append(frequencies);
  }
}

DecodingTables::DecodingTables(const Tables& source)
    : predictor(source.predictor), guide(source.guide), kinds(source.kinds) {
  static const DecodeTable escape_table = [] {
    DecodeTable table;
    fill_decode_table(escape_only(), table);
    return table;
  }();
  const auto is_used = [](const Frequencies& f) { return f[kEscape] != kScale; };
  storage_.resize(static_cast<std::size_t>(
      std::count_if(source.frequencies.begin(), source.frequencies.end(), is_used)));
  std::size_t next = 0;
  for (const Frequencies& frequencies : source.frequencies) {
    if (is_used(frequencies)) {
      fill_decode_table(frequencies, storage_[next]);
      tables.push_back(&storage_[next++]);
    } else {
      tables.push_back(&escape_table);
    }
  }
}

}  // namespace terrace::stream::store
