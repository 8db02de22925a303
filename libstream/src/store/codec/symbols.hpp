// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace terrace::stream::store {

/// An unsigned number is coded as a *class*, by the entropy coder, and the bits that the class
/// leaves open, as they are. Numbers below 16 are classes of their own; above, a class is the
/// exponent and the first bit after it, so that 64-bit numbers need 136 classes.
inline constexpr unsigned kClasses = 136;
/// Announces a class that its context has never seen in training: eight raw bits name it.
inline constexpr unsigned kEscape = kClasses;
inline constexpr unsigned kSymbols = kClasses + 1;
inline constexpr unsigned kEscapeBits = 8;

struct ClassRange {
  std::uint64_t base = 0;
  std::uint8_t bits = 0;
};

constexpr unsigned class_of(std::uint64_t value) {
  const unsigned exponent = static_cast<unsigned>(std::bit_width(value | 8)) - 1;
  const unsigned large = 2 * exponent + 6 + static_cast<unsigned>(value >> (exponent - 1));
  return value < 16 ? static_cast<unsigned>(value) : large;
}

/// By symbol, the escape (0 bits, base 0) included.
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

/// How the differences of a column are coded: as they are; as one of those that came last, else as
/// they are; less that of the column before (colours change together); less the one before it along
/// the line; less the median of the three before it. The latter five also: from the beginning of
/// the last line where a line begins.
enum class ColumnKind : std::uint8_t {
  plain,
  recent,
  beside,
  trend,
  median,
  line,
  line_recent,
  line_beside,
  line_trend,
  line_median
};
inline constexpr unsigned kColumnKinds = 10;
/// Those before version 3.
inline constexpr unsigned kUnguidedKinds = 3;
/// Where lines begin aside.
constexpr ColumnKind along_line(ColumnKind kind) {
  return static_cast<ColumnKind>(static_cast<unsigned>(kind) % 5);
}
constexpr bool from_line(ColumnKind kind) { return kind >= ColumnKind::line; }

/// Contexts: each has a table of frequencies of its own. Attribute contexts follow the fixed ones.
namespace context {
inline constexpr unsigned kForm = 0;      ///< grid or k-d, own box or not
inline constexpr unsigned kRunCount = 1;  ///< by the runs of the row above: 0, 1, more
inline constexpr unsigned kRunStart = 4;  ///< by the last step of this border, -2 to 2; first row
inline constexpr unsigned kRunEnd =
    10;  ///< likewise; from version 5 on, of both the first row only
inline constexpr unsigned kRunGap = 16;     ///< of second and further runs
inline constexpr unsigned kRunLength = 17;  ///< likewise
inline constexpr unsigned kInset = 18;      ///< six: low and high side of each axis
inline constexpr unsigned kChild = 24;      ///< six: level below, levels further down; by magnitude
inline constexpr unsigned kSplit = 30;      ///< k-d counts of 2 to 31 points, then by bit width
inline constexpr unsigned kSplitDirect = 32;
inline constexpr unsigned kSplitWide = kSplit + kSplitDirect - 2;
inline constexpr unsigned kHeight = kSplitWide + 24;
inline constexpr unsigned kHeightSteps = 32;
inline constexpr unsigned kAttribute = kHeight + 2 * kHeightSteps;
/// Head (number form, several values or one), first value, eight by magnitude; of
/// ColumnKind::recent four by place and four by magnitude. From version 3 on four more for
/// differences between lines and four for points of one pulse; of the guide, three of these for its
/// steps.
inline constexpr unsigned kPerAttribute = 18;
inline constexpr unsigned kPerAttributeBefore3 = 10;
inline constexpr unsigned kBetweenLines = 10;
inline constexpr unsigned kWithinPulse = 14;

// From version 5 on, behind those of the attributes:
/// Steps of either border of a raster's cluster: by the half of its rows, the last step (-2 to 2)
/// and the columns left to the side of the box (0 to 4).
inline constexpr unsigned kBorderSteps = 5, kBorderRooms = 5;
inline constexpr unsigned kBorders = 2 * kBorderSteps * kBorderRooms;
/// Columns of the index, eight each, by magnitude; their shifts; and for each attribute the ends of
/// its range.
inline constexpr unsigned kIndexColumns = 12;
inline constexpr unsigned kIndexSteps = 8;
inline constexpr unsigned kIndexShift = kIndexColumns * kIndexSteps;
inline constexpr unsigned kIndexRange = kIndexShift + 1;
}  // namespace context

}  // namespace terrace::stream::store
