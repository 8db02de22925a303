// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace terrace::stream::store {

/// An unsigned number is coded as a *class*, by the entropy coder, and the remaining bits, raw.
/// Each number below 16 is a class; above, a class is the exponent and the first bit after it, so
/// that 64-bit numbers need 136 classes.
inline constexpr unsigned kClasses = 136;
/// Announces a class that did not occur in its context in training, and follows in eight raw bits.
inline constexpr unsigned kEscape = kClasses;
inline constexpr unsigned kSymbols = kClasses + 1;
inline constexpr unsigned kEscapeBits = 8;

/// The numbers of a class: base, plus a number of `bits` raw bits.
struct ClassRange {
  std::uint64_t base = 0;
  std::uint8_t bits = 0;
};

constexpr unsigned class_of(std::uint64_t value) {
  const unsigned exponent = static_cast<unsigned>(std::bit_width(value | 8)) - 1;
  const unsigned large = 2 * exponent + 6 + static_cast<unsigned>(value >> (exponent - 1));
  return value < 16 ? static_cast<unsigned>(value) : large;
}

/// By symbol, including the escape (0 bits, base 0).
inline constexpr std::array<ClassRange, kSymbols> kClassRange = [] {
  std::array<ClassRange, kSymbols> table{};
  for (unsigned c = 0; c < kClasses; ++c) {
    if (c < 16) {
      table[c] = {c, 0};
    } else {
      const unsigned exponent = 4 + (c - 16) / 2;
      table[c] = {(std::uint64_t{2} | (c & 1)) << (exponent - 1),
                  static_cast<std::uint8_t>(exponent - 1)};
    }
  }
  return table;
}();

/// How the differences of a column are coded.
enum class ColumnKind : std::uint8_t {
  plain,      ///< unchanged
  recent,     ///< as one of the most recent differences, otherwise unchanged
  preceding,  ///< minus the preceding column's difference, because colours change together
  trend,      ///< minus the previous difference along the line
  median,     ///< minus the median of the previous three differences along the line
  // The same, but the first difference of a line is relative to the start of the previous line.
  line,
  line_recent,
  line_preceding,
  line_trend,
  line_median
};
inline constexpr unsigned kColumnKinds = 10;
/// Number of kinds without a guide, the first ones.
inline constexpr unsigned kUnguidedKinds = 3;
/// Returns the kind with which differences along a line are coded.
constexpr ColumnKind along_line(ColumnKind kind) {
  return static_cast<ColumnKind>(static_cast<unsigned>(kind) % 5);
}
constexpr bool from_line(ColumnKind kind) { return kind >= ColumnKind::line; }

/// Contexts, each with its own table of frequencies. Attribute contexts follow the fixed ones.
namespace context {
inline constexpr unsigned kForm = 0;        ///< grid or k-d, own box or not
inline constexpr unsigned kRunCount = 1;    ///< by the runs of the row above: 0, 1, more
inline constexpr unsigned kRunStart = 9;    ///< in the first row that has cells; 4 to 8 are unused
inline constexpr unsigned kRunEnd = 15;     ///< likewise; 10 to 14 are unused
inline constexpr unsigned kRunGap = 16;     ///< gaps before second and further runs
inline constexpr unsigned kRunLength = 17;  ///< likewise
inline constexpr unsigned kInset = 18;      ///< six: low and high side per axis
inline constexpr unsigned kChild = 24;      ///< six: level below, levels further down; by magnitude
inline constexpr unsigned kSplit = 30;      ///< k-d counts of 2 to 31 points, then by bit width
inline constexpr unsigned kSplitDirect = 32;
inline constexpr unsigned kSplitWide = kSplit + kSplitDirect - 2;
inline constexpr unsigned kHeight = kSplitWide + 24;
inline constexpr unsigned kHeightSteps = 32;
inline constexpr unsigned kAttribute = kHeight + 2 * kHeightSteps;
/// Contexts of an attribute: its head (number form, several values or one), its first value, and
/// eight by magnitude. ColumnKind::recent uses four of these by position and four by magnitude.
/// Four more are for differences between lines and four for points of one pulse, of which the guide
/// uses three for its steps.
inline constexpr unsigned kPerAttribute = 18;
inline constexpr unsigned kBetweenLines = 10;
inline constexpr unsigned kWithinPulse = 14;

// After those of the attributes:
/// Steps of either border of a raster's cluster, by the half of its rows, the last step (-2 to 2)
/// and the columns left to the side of the box (0 to 4).
inline constexpr unsigned kBorderSteps = 5, kBorderRooms = 5;
inline constexpr unsigned kBorders = 2 * kBorderSteps * kBorderRooms;
/// Columns of the index, eight contexts each, by magnitude; then their shifts, and for each
/// attribute the ends of its range.
inline constexpr unsigned kIndexColumns = 12;
inline constexpr unsigned kIndexSteps = 8;
inline constexpr unsigned kIndexShift = kIndexColumns * kIndexSteps;
inline constexpr unsigned kIndexRange = kIndexShift + 1;
}  // namespace context

}  // namespace terrace::stream::store
