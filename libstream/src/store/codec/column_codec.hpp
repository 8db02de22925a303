// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

#include "store/codec/coding.hpp"
#include "store/codec/numbers.hpp"

/// What travels with the points of a cluster, in the order in which their positions are coded:
/// attributes, column by column, and on levels above 0 the ordinals of the clusters that each point
/// heads. Every value is coded as a difference to the one before. So are, of points that come in
/// the order in which they were read, the coordinates.

namespace terrace::stream::store {

/// The last class of each step but the greatest.
inline constexpr std::array<unsigned, 7> kStepEnds{0, 2, 4, 8, 15, 21, 29};
inline constexpr std::array<std::uint8_t, kClasses> kDifferenceSteps = [] {
  std::array<std::uint8_t, kClasses> steps{};
  for (unsigned c = 0; c < kClasses; ++c) {
    for (const unsigned end : kStepEnds) {
      if (c > end) ++steps[c];
    }
  }
  return steps;
}();
/// Coarse logarithm of a class, 0 to 7: the context of the next difference.
constexpr unsigned difference_step(unsigned number_class) { return kDifferenceSteps[number_class]; }

template <class Coder>
unsigned code_difference(Coder& coder, unsigned context, std::int64_t previous,
                         std::int64_t& value) {
  std::uint64_t number = 0;
  if constexpr (!Coder::kDecoding) {
    number = zigzag(static_cast<std::int64_t>(static_cast<std::uint64_t>(value) -
                                              static_cast<std::uint64_t>(previous)));
  }
  const unsigned number_class = code_number(coder, context, number);
  if constexpr (Coder::kDecoding) {
    value = static_cast<std::int64_t>(static_cast<std::uint64_t>(previous) +
                                      static_cast<std::uint64_t>(unzigzag(number)));
  }
  return number_class;
}

/// One attribute of a store of version 1. `form` is coded for floating point only.
template <class Coder>
void code_old_column(Coder& coder, unsigned attribute, bool floating, NumberForm& form,
                     std::int64_t* values, std::uint32_t n) {
  const unsigned first = context::kAttribute + context::kPerAttribute * attribute;
  if (floating) {
    unsigned symbol = form;
    code_symbol(coder, first, symbol);
    if (symbol >= kNumberForms) throw Damage("an attribute has an unknown number form");
    form = static_cast<NumberForm>(symbol);
  }
  std::int64_t previous = 0;
  unsigned context = first + 1;
  for (std::uint32_t i = 0; i < n; ++i) {
    context = first + 2 + difference_step(code_difference(coder, context, previous, values[i]));
    previous = values[i];
  }
}

/// Differences that came last, the latest first: pulses of a scanner are a few intervals apart.
class RecentDifferences {
 public:
  static constexpr unsigned kCount = 3;

  [[nodiscard]] std::int64_t operator[](unsigned i) const { return recent_[i]; }
  /// Its place among them; kCount if it is none of them.
  [[nodiscard]] unsigned find(std::int64_t difference) const {
    const unsigned last = recent_[2] == difference ? 2 : kCount;
    const unsigned later = recent_[1] == difference ? 1 : last;
    return recent_[0] == difference ? 0 : later;
  }
  /// Moves the difference that lies at `place`, or a new one (kCount), to the front.
  void move_to_front(unsigned place, std::int64_t difference) {
    recent_[2] = place >= 2 ? recent_[1] : recent_[2];
    recent_[1] = place >= 1 ? recent_[0] : recent_[1];
    recent_[0] = difference;
  }

 private:
  std::array<std::int64_t, kCount> recent_{0, 1, -1};
};

constexpr std::int64_t wrapped_sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
constexpr std::int64_t wrapped_difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

constexpr std::int64_t wrapped_product(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) * static_cast<std::uint64_t>(b));
}

template <class Coder>
TERRACE_STORE_INLINE unsigned code_signed(Coder& coder, unsigned context, std::int64_t& value) {
  std::uint64_t number = 0;
  if constexpr (!Coder::kDecoding) number = zigzag(value);
  const unsigned number_class = code_number(coder, context, number);
  if constexpr (Coder::kDecoding) value = unzigzag(number);
  return number_class;
}

/// What all differences are multiples of: 1 if of nothing more, 0 if they are all 0. Colours of 8
/// bits in fields of 16 are multiples of 256 or 257.
inline std::uint64_t common_divisor(const std::int64_t* differences, std::uint32_t n) {
  std::uint64_t divisor = 0;
  for (std::uint32_t i = 0; i < n && divisor != 1; ++i) {
    const auto bits = static_cast<std::uint64_t>(differences[i]);
    const std::uint64_t magnitude = differences[i] < 0 ? -bits : bits;
    if (divisor == 0 || magnitude % divisor != 0) divisor = std::gcd(divisor, magnitude);
  }
  return divisor >> 63 != 0 ? 1 : divisor;
}

/// Fills `differences` from the second on with those of neighbours in the column, less those of the
/// column before unless that is null. False if all values are one.
inline bool find_differences(const std::int64_t* values, const std::int64_t* beside,
                             std::int64_t* differences, std::uint32_t n) {
  std::uint64_t several = 0;
  for (std::uint32_t i = 1; i < n; ++i) {
    several |= static_cast<std::uint64_t>(values[i]) ^ static_cast<std::uint64_t>(values[0]);
    differences[i] = wrapped_difference(values[i], values[i - 1]);
  }
  for (std::uint32_t i = 1; beside != nullptr && i < n; ++i) {
    differences[i] =
        wrapped_difference(differences[i], wrapped_difference(beside[i], beside[i - 1]));
  }
  return several != 0;
}

/// A column of values: the first, then differences as `kind` says, divided by what is common to
/// them.
/// number: of the column, attributes first, then the axes. form: coded where it is not null.
/// beside: the column before, for ColumnKind::beside alone. scratch: room for n differences.
template <class Coder>
void code_column(Coder& shared, unsigned number, ColumnKind kind, NumberForm* form,
                 const std::int64_t* beside, std::int64_t* values, std::int64_t* scratch,
                 std::uint32_t n) {
  enum : unsigned { kOneValue, kSeveral, kMultiples, kHeads };
  const unsigned first = context::kAttribute + context::kPerAttribute * number;
  const unsigned forms = form != nullptr ? kNumberForms : 1;
  if (kind != ColumnKind::beside) beside = nullptr;
  typename Coder::Local coder = shared;
  unsigned head = kSeveral;
  std::uint64_t divisor = 1;
  if constexpr (!Coder::kDecoding) {
    const bool several = find_differences(values, beside, scratch, n);
    if (several) divisor = std::max<std::uint64_t>(common_divisor(scratch + 1, n - 1), 1);
    head = !several ? kOneValue : divisor > 1 ? kMultiples : kSeveral;
    head = head * forms + (form != nullptr ? *form : 0);
  }
  code_symbol(coder, first, head);
  if constexpr (Coder::kDecoding) {
    if (head >= kHeads * forms) throw Damage("a column has an unknown head");
    if (form != nullptr) *form = static_cast<NumberForm>(head % forms);
  }
  unsigned number_class = code_signed(coder, first + 1, values[0]);
  if (head / forms == kOneValue) {
    if constexpr (Coder::kDecoding) {
      std::fill_n(values + 1, n - 1, values[0]);
      shared = coder;
    }
    return;
  }
  if (head / forms == kMultiples) {
    code_number(coder, first + 1, divisor);
    if (divisor < 2) throw Damage("a column has differences that are multiples of nothing");
  }
  const auto by = static_cast<std::int64_t>(divisor);
  if constexpr (!Coder::kDecoding) {
    for (std::uint32_t i = 1; by != 1 && i < n; ++i) scratch[i] /= by;
  }
  std::int64_t difference = 0;
  const auto begin = [&](std::uint32_t i) {
    if constexpr (!Coder::kDecoding) difference = scratch[i];
  };
  const auto end = [&](std::uint32_t i) {
    if constexpr (Coder::kDecoding) {
      const std::int64_t rise =
          beside != nullptr ? wrapped_difference(beside[i], beside[i - 1]) : 0;
      values[i] = wrapped_sum(wrapped_sum(values[i - 1], rise), wrapped_product(difference, by));
    }
  };
  if (kind == ColumnKind::recent) {
    RecentDifferences recent;
    unsigned place = 0, step = 0;
    for (std::uint32_t i = 1; i < n; ++i) {
      begin(i);
      const unsigned context = first + 2 + place;
      if constexpr (!Coder::kDecoding) place = recent.find(difference);
      code_symbol(coder, context, place);
      if (place > RecentDifferences::kCount) throw Damage("a column has an unknown difference");
      if (place == RecentDifferences::kCount) {
        step = difference_step(code_signed(coder, first + 6 + step / 2, difference));
      } else {
        difference = recent[place];
      }
      recent.move_to_front(place, difference);
      end(i);
    }
  } else {
    for (std::uint32_t i = 1; i < n; ++i) {
      begin(i);
      number_class = code_signed(coder, first + 2 + difference_step(number_class), difference);
      end(i);
    }
  }
  if constexpr (Coder::kDecoding) shared = coder;
}

/// The ordinals that n points head on `level` levels, nearest level first: values[i + n * j] is
/// point i's on level j.
template <class Coder>
void code_children(Coder& coder, unsigned level, std::int64_t* values, std::uint32_t n) {
  for (unsigned j = level; j-- > 0;) {
    std::int64_t* const column = values + std::size_t{j} * n;
    const bool nearest = j + 1 == level;
    std::int64_t previous = 0;
    unsigned context = context::kChild;
    for (std::uint32_t i = 0; i < n; ++i) {
      const unsigned step = difference_step(code_difference(coder, context, previous, column[i]));
      context = context::kChild + (nearest ? 1 + (step > 4) + (step > 5) : 4 + (step > 6));
      previous = column[i];
    }
  }
}

}  // namespace terrace::stream::store
