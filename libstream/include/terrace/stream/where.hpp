// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// A condition on points, such as `classification == 2 && return_number == last`.
///
/// Operands are numbers, attributes by name (in double quotes if the name is not a plain word), x,
/// y and z in the CRS, `first` (1) and `last` (the attribute number_of_returns). Operators, from
/// tightest to loosest: - and !; * and /; + and -; <, <=, > and >=; == and !=; &&; ||; with
/// parentheses as usual, and `not`, `and`, `or` as words. Everything is computed in doubles, or,
/// where integers of 64 bits are named, in extended precision, which holds them all; attributes
/// with their scale and offset. Comparisons give 1 or 0, and a point meets the condition if its
/// value is a number other than 0.
///
/// Const members may be called by several threads at once.
class Where {
 public:
  /// text: up to 4096 characters. Throws: Error that names the character if it is not a condition
  /// on points of this schema.
  Where(const std::string& text, const Schema& schema);

  [[nodiscard]] const std::string& text() const { return text_; }
  /// Whether the condition names this attribute of the schema.
  [[nodiscard]] bool uses(std::size_t attribute) const;

  /// Sets matches[i] to 1 for points that meet the condition, otherwise to 0. positions: in stored
  /// coordinates; records: packed, one per point. About 1 ns per operand and point.
  void test(std::span<const Point3> positions, std::span<const std::byte> records,
            std::span<std::uint8_t> matches) const;

  /// Whether points in `box` (in the CRS) with attributes in these ranges may meet the condition;
  /// false means that none does. attributes: one per attribute, or empty if unknown.
  [[nodiscard]] bool possible(const Box3& box, std::span<const ValueRange> attributes) const;

 private:
  enum class Operation : std::uint8_t;
  struct Step {
    Operation operation{};
    long double number = 0.0;  ///< for a constant
    std::size_t index = 0;     ///< for an axis or an attribute
  };
  class Parser;
  template <class Number>
  void test_in(std::span<const Point3> positions, std::span<const std::byte> records,
               std::span<std::uint8_t> matches) const;

  std::string text_;
  Schema schema_;
  std::vector<Step> steps_;  ///< in postfix order
  std::size_t depth_ = 0;    ///< maximum number of operands at a time
  bool extended_ = false;    ///< doubles do not hold all values
};

}  // namespace terrace::stream
