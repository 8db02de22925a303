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
/// Operands are numbers, names of attributes (in double quotes if the name is not a plain word), x,
/// y and z in the CRS, `first` (1) and `last` (the attribute number_of_returns). The operators and
/// their precedence are those of C: unary - and !, then * and /, + and -, < <= > and >=, == and !=,
/// &&, ||. Parentheses are allowed, and `not`, `and`, `or` as words.
///
/// Scale and offset of attributes are applied. Values are computed as doubles. If the condition
/// names 64-bit integers, they are computed in extended precision, in which these are exact.
/// Comparisons give 1 or 0. A point meets the condition if its value is a number other than 0.
///
/// Several threads may call const members at once.
class Where {
 public:
  /// text: at most 4096 characters. Throws: Error that names the character if `text` is not a
  /// condition on points of this schema.
  Where(const std::string& text, const Schema& schema);

  [[nodiscard]] const std::string& text() const { return text_; }
  /// Whether the condition names this attribute of the schema.
  [[nodiscard]] bool uses(std::size_t attribute) const;

  /// Sets matches[i] to 1 for points that meet the condition, otherwise to 0. positions: in stored
  /// coordinates; records: packed, one per point. Cost: about 1 ns per operand and point.
  void test(std::span<const Point3> positions, std::span<const std::byte> records,
            std::span<std::uint8_t> matches) const;

  /// False if no point in `box` (in the CRS) with attributes in these ranges can meet the
  /// condition. attributes: one range per attribute, or empty if unknown.
  [[nodiscard]] bool possible(const Box3& box, std::span<const ValueRange> attributes) const;

 private:
  enum class Operation : std::uint8_t;
  struct Step {
    Operation operation{};
    std::uint8_t operands = 0;  ///< taken from the stack
    long double number = 0.0;   ///< for a constant
    std::size_t index = 0;      ///< for an axis or an attribute
  };
  class Parser;
  /// Leaves the value of the condition in stack[0]. Domain: the operands' type and the operations.
  template <class Domain>
  void evaluate(const Domain& domain, std::span<typename Domain::Operand> stack) const;
  template <class Number>
  void test_in(std::span<const Point3> positions, std::span<const std::byte> records,
               std::span<std::uint8_t> matches) const;

  std::string text_;
  Schema schema_;
  std::vector<Step> steps_;  ///< in postfix order
  std::size_t depth_ = 0;    ///< maximum number of operands on the stack
  bool extended_ = false;    ///< whether to compute in extended precision
};

}  // namespace terrace::stream
