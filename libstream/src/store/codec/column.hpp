// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "store/codec/coding.hpp"
#include "store/codec/numbers.hpp"

/// Codes the attributes of a cluster's points, column by column, in the order in which their
/// positions are coded, and on levels above 0 the ordinals of the clusters that each point heads.
/// Every value is coded as a difference from the previous one. Coordinates are coded likewise if
/// points are in the order in which they were read.

namespace terrace::stream::store {

// Passes over the values of a column before they are coded. They are vectorised.

/// Sets differences[i] to values[i] - values[i - 1] for 1 <= i < n. Also subtracts the same
/// difference of the preceding column, `preceding`, unless that is null. Returns false if all
/// values are equal.
bool find_differences(const std::int64_t* values, const std::int64_t* preceding,
                      std::int64_t* differences, std::uint32_t n);

/// Zigzag-encodes n differences into `numbers`, and sets the size class of each in `classes`.
void classify(const std::int64_t* differences, std::uint64_t* numbers, std::uint8_t* classes,
              std::uint32_t n);

/// Lowest and highest value; low > high if there are no values.
struct Extent {
  std::int64_t low = INT64_MAX, high = INT64_MIN;
};
Extent extent_of(std::span<const std::int64_t> values);

/// The last class of each step except the highest.
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
/// Returns a coarse logarithm of a class, 0 to 7, which is the context of the next difference.
constexpr unsigned difference_step(unsigned number_class) { return kDifferenceSteps[number_class]; }

template <class Coder>
TERRACE_STORE_INLINE unsigned code_difference(Coder& coder, unsigned context, std::int64_t previous,
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

/// The most recent differences, latest first. The intervals between a scanner's pulses have few
/// different lengths.
template <unsigned kSize>
class RecentDifferences {
 public:
  static constexpr unsigned kCount = kSize;

  [[nodiscard]] std::int64_t operator[](unsigned i) const { return recent_[i]; }
  /// Returns the index of a difference in the list; kCount if it is not in it.
  [[nodiscard]] unsigned find(std::int64_t difference) const {
    unsigned index = kCount;
    for (unsigned i = kCount; i-- > 0;) index = recent_[i] == difference ? i : index;
    return index;
  }
  /// Moves the difference at `index`, or a new one (kCount), to the front.
  void move_to_front(unsigned index, std::int64_t difference) {
    for (unsigned i = kCount; i-- > 1;) recent_[i] = index >= i ? recent_[i - 1] : recent_[i];
    recent_[0] = difference;
  }

 private:
  std::array<std::int64_t, kCount> recent_ = [] {
    // 0, 1, -1, 2, -2, ...
    std::array<std::int64_t, kCount> first{};
    for (unsigned i = 1; i < kCount; ++i) first[i] = i % 2 == 1 ? 1 - first[i - 1] : -first[i - 1];
    return first;
  }();
};
/// Number of recent differences kept by the guide and by every other column.
inline constexpr unsigned kGuideRecent = 7, kColumnRecent = 3;

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

/// Returns the greatest common divisor of the differences: 0 if all are 0, 1 if it is 2^63. Colours
/// of 8 bits in fields of 16 are multiples of 256 or 257.
inline std::uint64_t common_divisor(const std::int64_t* differences, std::uint32_t n) {
  std::uint64_t divisor = 0;
  for (std::uint32_t i = 0; i < n && divisor != 1; ++i) {
    const auto bits = static_cast<std::uint64_t>(differences[i]);
    const std::uint64_t magnitude = differences[i] < 0 ? -bits : bits;
    if (divisor == 0 || magnitude % divisor != 0) divisor = std::gcd(divisor, magnitude);
  }
  return divisor >> 63 != 0 ? 1 : divisor;
}

/// The step from each point of a cluster to the next, given by the guide, mostly the times of a
/// scanner's pulses.
class Lines {
 public:
  /// A point further along the line, of the same pulse, or at the beginning of a line.
  enum Step : std::uint8_t { kAlong, kSame, kJump, kSteps };

  /// Sets the steps from the guide's differences. The first difference does not count.
  void find_steps(const std::int64_t* differences, std::uint64_t min_jump, std::uint32_t n) {
    steps_.resize(n);
    for (std::uint32_t i = 1; i < n; ++i) {
      const auto bits = static_cast<std::uint64_t>(differences[i]);
      const std::uint64_t magnitude = differences[i] < 0 ? -bits : bits;
      steps_[i] = magnitude >= min_jump ? kJump : magnitude == 0 ? kSame : kAlong;
    }
    find_references();
  }
  void resize(std::uint32_t n) { steps_.assign(n, kSame); }
  void set_step(std::uint32_t i, unsigned step) { steps_[i] = static_cast<Step>(step); }
  void find_references() {
    references_.resize(steps_.size());
    std::uint32_t start = 0;
    for (std::uint32_t i = 1; i < steps_.size(); ++i) {
      references_[i] = steps_[i] == kJump ? start : i - 1;
      if (steps_[i] == kJump) start = i;
    }
  }

  [[nodiscard]] Step operator[](std::uint32_t i) const { return steps_[i]; }
  [[nodiscard]] const Step* steps() const { return steps_.data(); }
  /// Returns the previous point or, where a line begins, the first point of the previous line.
  [[nodiscard]] std::uint32_t reference(std::uint32_t i) const { return references_[i]; }

 private:
  std::vector<Step> steps_;
  std::vector<std::uint32_t> references_;
};

/// By Lines::Step: the contexts of numbers, and how far the step of a difference is shifted.
inline constexpr std::array<unsigned, Lines::kSteps> kStepContexts{2, context::kWithinPulse,
                                                                   context::kBetweenLines};
inline constexpr std::array<unsigned, Lines::kSteps> kStepShifts{0, 1, 1};

/// Codes the head of a column and its first value. Returns false if all values equal the first.
/// form: coded unless null. divisor: of the differences; 1 if they are not divided.
template <class Coder>
bool code_head(Coder& coder, unsigned first, NumberForm* form, std::int64_t& value, bool several,
               std::uint64_t& divisor, unsigned& number_class) {
  enum : unsigned { kOneValue, kSeveral, kMultiples, kHeads };
  const unsigned forms = form != nullptr ? kNumberForms : 1;
  unsigned head = 0;
  if constexpr (!Coder::kDecoding) {
    head = !several ? kOneValue : divisor > 1 ? kMultiples : kSeveral;
    head = head * forms + (form != nullptr ? *form : 0);
  }
  code_symbol(coder, first, head);
  if constexpr (Coder::kDecoding) {
    if (head >= kHeads * forms) throw Damage("a column has an unknown head");
    if (form != nullptr) *form = static_cast<NumberForm>(head % forms);
    divisor = 1;
  }
  number_class = code_signed(coder, first + 1, value);
  if (head / forms == kMultiples) {
    code_number(coder, first + 1, divisor);
    if (divisor < 2) throw Damage("a column has a divisor below 2");
  }
  return head / forms != kOneValue;
}

/// Codes a difference as an index in the list of recent ones, otherwise as a number.
template <class Coder, unsigned kCount>
class RecentCoder {
 public:
  TERRACE_STORE_INLINE void code(Coder& coder, unsigned first, std::int64_t& difference) {
    const unsigned context = first + 2 + std::min(index_, kColumnRecent);
    if constexpr (!Coder::kDecoding) index_ = recent_.find(difference);
    code_symbol(coder, context, index_);
    if (index_ > kCount) throw Damage("a column has an unknown difference");
    if (index_ == kCount) {
      step_ = difference_step(code_signed(coder, first + 6 + step_ / 2, difference));
    } else {
      difference = recent_[index_];
    }
    recent_.move_to_front(index_, difference);
  }

 private:
  RecentDifferences<kCount> recent_;
  unsigned index_ = 0, step_ = 0;
};

/// Predicts the next difference along a line.
class Trend {
 public:
  explicit Trend(ColumnKind kind) : kind_(along_line(kind)) {}

  [[nodiscard]] bool exists() const {
    return kind_ == ColumnKind::trend || kind_ == ColumnKind::median;
  }
  [[nodiscard]] std::int64_t expected() const {
    const auto [a, b, c] = last_;
    return kind_ == ColumnKind::trend ? a : std::max(std::min(a, b), std::min(std::max(a, b), c));
  }
  void add(std::int64_t difference) { last_ = {difference, last_[0], last_[1]}; }

 private:
  ColumnKind kind_;
  std::array<std::int64_t, 3> last_{};  ///< latest first
};

/// Replaces differences between successive points by the ones that `kind` codes.
inline void refer_to_lines(const Lines& lines, ColumnKind kind, std::int64_t* differences,
                           std::uint32_t n) {
  Trend trend(kind);
  if (!trend.exists() && !from_line(kind)) return;
  std::int64_t since_start = 0;
  for (std::uint32_t i = 1; i < n; ++i) {
    const std::int64_t difference = differences[i];
    since_start = wrapped_sum(since_start, difference);
    if (lines[i] == Lines::kJump) {
      if (from_line(kind)) differences[i] = since_start;
      since_start = 0;
    } else if (lines[i] == Lines::kAlong && trend.exists()) {
      differences[i] = wrapped_difference(difference, trend.expected());
      trend.add(difference);
    }
  }
}

/// Working memory for encoding columns.
struct ColumnScratch {
  std::vector<std::int64_t> differences;
  std::vector<std::uint64_t> numbers;  ///< the differences as numbers
  std::vector<std::uint8_t> classes;
  std::vector<std::uint32_t> slots;

  void resize(std::uint32_t n) {
    differences.resize(n);
    numbers.resize(n);
    classes.resize(n);
    slots.resize(n);
  }
};

/// By step and previous class: the first slot of a number's context, relative to the first slot of
/// the column's first context.
inline constexpr auto kStepSlots = [] {
  std::array<std::array<std::uint16_t, 256>, Lines::kSteps> slots{};
  for (unsigned step = 0; step < Lines::kSteps; ++step) {
    for (unsigned c = 0; c < kClasses; ++c) {
      const unsigned context = kStepContexts[step] + (difference_step(c) >> kStepShifts[step]);
      slots[step][c] = static_cast<std::uint16_t>(context * kSymbols);
    }
  }
  return slots;
}();

/// Does the same as code_differences() for kinds without recent differences, many at once.
template <bool kLined, class Coder>
void encode_differences(Coder& coder, unsigned first, const Lines* lines, ColumnScratch& scratch,
                        std::uint32_t n, unsigned number_class) {
  std::uint8_t* const classes = scratch.classes.data();
  classify(scratch.differences.data() + 1, scratch.numbers.data() + 1, classes + 1, n - 1);
  classes[0] = static_cast<std::uint8_t>(number_class);
  std::uint32_t* const slots = scratch.slots.data();
  const Lines::Step* const steps = kLined ? lines->steps() : nullptr;
  for (std::uint32_t i = 1; i < n; ++i) {
    const Lines::Step step = kLined ? steps[i] : Lines::kAlong;
    slots[i] = kStepSlots[step][classes[i - 1]] + classes[i];
  }
  coder.numbers(first, {scratch.numbers.data() + 1, n - 1}, classes + 1, slots + 1);
}

/// Codes the differences of a column; see code_column().
template <bool kLined, bool kRecent, class Coder>
void code_differences(Coder& coder, unsigned first, ColumnKind kind, const Lines* lines,
                      const std::int64_t* preceding, std::int64_t* values, ColumnScratch* scratch,
                      std::uint32_t n, std::int64_t signed_divisor, unsigned number_class) {
  if constexpr (!kRecent && !Coder::kDecoding) {
    return encode_differences<kLined>(coder, first, lines, *scratch, n, number_class);
  }
  RecentCoder<Coder, kColumnRecent> recent;
  Trend trend(kind);
  for (std::uint32_t i = 1; i < n; ++i) {
    Lines::Step step = Lines::kAlong;
    if constexpr (kLined) step = (*lines)[i];
    std::int64_t difference = 0;
    if constexpr (!Coder::kDecoding) difference = scratch->differences[i];
    if (kRecent && step == Lines::kAlong) {
      recent.code(coder, first, difference);
    } else {
      const unsigned shift = kLined ? kStepShifts[step] : 0;
      const unsigned context = first + (kLined ? kStepContexts[step] : kStepContexts[0]);
      number_class =
          code_signed(coder, context + (difference_step(number_class) >> shift), difference);
    }
    if constexpr (Coder::kDecoding) {
      const std::uint32_t reference = kLined && from_line(kind) ? lines->reference(i) : i - 1;
      const std::int64_t rise =
          preceding != nullptr ? wrapped_difference(preceding[i], preceding[reference]) : 0;
      if constexpr (kLined) {
        if (trend.exists() && step == Lines::kAlong) {
          difference = wrapped_sum(difference, trend.expected());
          trend.add(difference);
        }
      }
      values[i] = wrapped_sum(wrapped_sum(values[reference], rise),
                              wrapped_product(difference, signed_divisor));
    }
  }
}

/// Codes a column of values: the first value, then differences according to `kind`, divided by
/// their common divisor.
/// first: the first context. form: coded unless null. lines: null without a guide. preceding: the
/// preceding column, read only for the kinds that use it. scratch: of size n, for encoding only.
template <class Coder>
void code_column(Coder& shared, unsigned first, ColumnKind kind, NumberForm* form,
                 const Lines* lines, const std::int64_t* preceding, std::int64_t* values,
                 ColumnScratch* scratch, std::uint32_t n) {
  if (along_line(kind) != ColumnKind::preceding) preceding = nullptr;
  typename Coder::Local coder = shared;
  bool several = false;
  std::uint64_t divisor = 1;
  if constexpr (!Coder::kDecoding) {
    std::int64_t* const differences = scratch->differences.data();
    several = find_differences(values, preceding, differences, n);
    if (several) divisor = std::max<std::uint64_t>(common_divisor(differences + 1, n - 1), 1);
  }
  unsigned number_class = 0;
  if (!code_head(coder, first, form, values[0], several, divisor, number_class)) {
    if constexpr (Coder::kDecoding) {
      std::fill_n(values + 1, n - 1, values[0]);
      shared = coder;
    }
    return;
  }
  const auto signed_divisor = static_cast<std::int64_t>(divisor);
  if constexpr (!Coder::kDecoding) {
    std::int64_t* const differences = scratch->differences.data();
    for (std::uint32_t i = 1; signed_divisor != 1 && i < n; ++i) differences[i] /= signed_divisor;
    if (lines != nullptr) refer_to_lines(*lines, kind, differences, n);
  }
  const auto code = [&](auto lined, auto is_recent) {
    code_differences<decltype(lined)::value, decltype(is_recent)::value>(
        coder, first, kind, lines, preceding, values, scratch, n, signed_divisor, number_class);
  };
  const bool is_recent = along_line(kind) == ColumnKind::recent;
  if (lines != nullptr) {
    is_recent ? code(std::true_type(), std::true_type())
              : code(std::true_type(), std::false_type());
  } else {
    is_recent ? code(std::false_type(), std::true_type())
              : code(std::false_type(), std::false_type());
  }
  if constexpr (Coder::kDecoding) shared = coder;
}

/// Codes the column of the guide: the step of each point, and jumps minus the previous jump. Sets
/// `lines`. min_jump: for encoding only.
template <class Coder>
void code_guide(Coder& shared, unsigned first, ColumnKind kind, NumberForm* form, Lines& lines,
                std::uint64_t min_jump, std::int64_t* values, ColumnScratch* scratch,
                std::uint32_t n) {
  typename Coder::Local coder = shared;
  bool several = false;
  std::uint64_t divisor = 1;
  if constexpr (!Coder::kDecoding) {
    std::int64_t* const differences = scratch->differences.data();
    several = find_differences(values, nullptr, differences, n);
    if (several) divisor = std::max<std::uint64_t>(common_divisor(differences + 1, n - 1), 1);
    lines.find_steps(differences, min_jump, n);
  } else {
    lines.resize(n);
  }
  unsigned number_class = 0;
  if (!code_head(coder, first, form, values[0], several, divisor, number_class)) {
    if constexpr (Coder::kDecoding) {
      std::fill_n(values + 1, n - 1, values[0]);
      lines.find_references();
      shared = coder;
    }
    return;
  }
  const auto signed_divisor = static_cast<std::int64_t>(divisor);
  RecentCoder<Coder, kGuideRecent> recent;
  unsigned step = Lines::kAlong, jump_class = 0;
  std::int64_t last_jump = 0;
  for (std::uint32_t i = 1; i < n; ++i) {
    std::int64_t difference = 0;
    const unsigned context = first + context::kWithinPulse + step;
    if constexpr (!Coder::kDecoding) {
      step = lines[i];
      difference = scratch->differences[i] / signed_divisor;
    }
    code_symbol(coder, context, step);
    if (step >= Lines::kSteps) throw Damage("a guide has an unknown step");
    if (step == Lines::kJump) {
      std::int64_t residual = wrapped_difference(difference, last_jump);
      jump_class = code_signed(
          coder, first + context::kBetweenLines + difference_step(jump_class) / 2, residual);
      if constexpr (Coder::kDecoding) difference = wrapped_sum(residual, last_jump);
      last_jump = difference;
    } else if (step == Lines::kAlong && kind == ColumnKind::recent) {
      recent.code(coder, first, difference);
    } else if (step == Lines::kAlong) {
      number_class = code_signed(coder, first + 2 + difference_step(number_class), difference);
    }
    if constexpr (Coder::kDecoding) {
      lines.set_step(i, step);
      values[i] = wrapped_sum(values[i - 1], wrapped_product(difference, signed_divisor));
    }
  }
  if constexpr (Coder::kDecoding) {
    lines.find_references();
    shared = coder;
  }
}

/// Codes the ordinals of the clusters that n points head on `level` levels, nearest level first:
/// values[i + n * j] is that of point i on level j.
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
