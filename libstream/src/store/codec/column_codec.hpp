// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "store/codec/coding.hpp"
#include "store/codec/numbers.hpp"

/// What travels with the points of a cluster, in the order in which their positions are coded:
/// attributes, column by column, and on levels above 0 the ordinals of the clusters that each point
/// heads. Every value is coded as the difference to the one before.

namespace terrace::stream::store {

/// Coarse logarithm of a class, 0 to 7: the context of the next difference.
constexpr unsigned difference_step(unsigned number_class) {
  constexpr std::array<std::uint8_t, 16> kSmall{0, 1, 1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4};
  if (number_class < 16) return kSmall[number_class];
  return number_class < 22 ? 5 : number_class < 30 ? 6 : 7;
}

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

/// One attribute. `form` is coded for floating point only.
template <class Coder>
void code_column(Coder& coder, unsigned attribute, bool floating, NumberForm& form,
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
