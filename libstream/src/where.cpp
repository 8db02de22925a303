// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/where.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "with_type.hpp"

namespace terrace::stream {

enum class Where::Operation : std::uint8_t {
  constant,
  axis,
  attribute,
  negate,
  invert,
  multiply,
  divide,
  add,
  subtract,
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  both,
  either,
};

/// Precedence climbing: operands and operators are emitted in postfix order.
class Where::Parser {
 public:
  Parser(Where& where, const Schema& schema)
      : where_(&where), schema_(&schema), text_(where.text_) {}

  void parse() {
    constexpr std::size_t kMostCharacters = 4096;
    if (text_.size() > kMostCharacters) {
      throw fault("is longer than " + counted(kMostCharacters, "character"));
    }
    expression(0);
    if (at_ < text_.size()) {
      throw fault("an operator is expected, not " + in_quotes(text_.substr(at_)))
          .remedy(text_[at_] == '=' ? "for equality write ==" : "");
    }
  }

 private:
  struct Binary {
    std::string_view sign;
    Operation operation;
    unsigned precedence;
  };
  // Longer operators come before their prefixes.
  static constexpr std::array<Binary, 14> kBinary{{{"||", Operation::either, 1},
                                                   {"or", Operation::either, 1},
                                                   {"&&", Operation::both, 2},
                                                   {"and", Operation::both, 2},
                                                   {"==", Operation::equal, 3},
                                                   {"!=", Operation::not_equal, 3},
                                                   {"<=", Operation::less_equal, 4},
                                                   {">=", Operation::greater_equal, 4},
                                                   {"<", Operation::less, 4},
                                                   {">", Operation::greater, 4},
                                                   {"+", Operation::add, 5},
                                                   {"-", Operation::subtract, 5},
                                                   {"*", Operation::multiply, 6},
                                                   {"/", Operation::divide, 6}}};
  static constexpr unsigned kMostNested = 64;

  [[nodiscard]] Error fault(std::string cause) const {
    return Error("the condition " + in_quotes(text_), std::move(cause))
        .at(fmt::format("character {}", at_ + 1));
  }

  static bool is_letter(char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
  }
  static bool is_in_word(char c) {
    return is_letter(c) || std::isdigit(static_cast<unsigned char>(c)) != 0;
  }

  void skip_blanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  /// Moves past a given operator or word.
  bool take(std::string_view sign) {
    skip_blanks();
    if (!text_.substr(at_).starts_with(sign)) return false;
    const std::size_t end = at_ + sign.size();
    if (is_letter(sign.front()) && end < text_.size() && is_in_word(text_[end])) return false;
    at_ = end;
    return true;
  }

  void emit(const Step& step, int operands) {
    where_->steps_.push_back(step);
    held_ = static_cast<std::size_t>(static_cast<int>(held_) + 1 - operands);
    where_->depth_ = std::max(where_->depth_, held_);
  }

  void expression(unsigned least) {
    operand();
    unsigned compared = 0;
    while (true) {
      const std::size_t before = at_;
      const auto* const found = std::find_if(kBinary.begin(), kBinary.end(),
                                             [&](const Binary& b) { return take(b.sign); });
      if (found == kBinary.end()) return;
      if (found->precedence < least) {
        at_ = before;
        return;
      }
      if (found->precedence == compared) {
        throw fault("comparisons cannot be chained").remedy("join two with &&: a < b && b < c");
      }
      if (found->precedence == 3 || found->precedence == 4) compared = found->precedence;
      expression(found->precedence + 1);
      emit({.operation = found->operation}, 2);
    }
  }

  void operand() {
    if (++nested_ > kMostNested)
      throw fault("is nested too deeply").remedy("write it with fewer parentheses");
    skip_blanks();
    if (at_ == text_.size()) throw fault("ends where a number or a name is expected");
    if (take("-")) {
      operand();
      emit({.operation = Operation::negate}, 1);
    } else if (take("!") || take("not")) {
      operand();
      emit({.operation = Operation::invert}, 1);
    } else if (take("(")) {
      expression(0);
      if (!take(")")) throw fault("a ')' is missing");
    } else if (text_[at_] == '"' || is_letter(text_[at_])) {
      name();
    } else {
      number();
    }
    --nested_;
  }

  void number() {
    const char* const begin = text_.data() + at_;
    double value = 0.0;
    const char* const rest = parse_real(begin, text_.data() + text_.size(), value);
    if (rest == nullptr || *begin == '+') {
      throw fault("a number or a name is expected, not " + in_quotes(text_.substr(at_)))
          .remedy(text_[at_] == '=' ? "for equality write ==" : "");
    }
    at_ += static_cast<std::size_t>(rest - begin);
    std::uint64_t whole = 0;
    const auto [end, error] = std::from_chars(begin, rest, whole);
    const bool is_whole = error == std::errc{} && end == rest;
    emit({.operation = Operation::constant,
          .number = is_whole ? static_cast<long double>(whole) : value},
         0);
  }

  void name() {
    const std::size_t begin = at_;
    std::string_view word;
    if (text_[at_] == '"') {
      const std::size_t end = text_.find('"', at_ + 1);
      if (end == text_.npos) throw fault("the name has no closing quote");
      word = text_.substr(at_ + 1, end - at_ - 1);
      at_ = end + 1;
    } else {
      while (at_ < text_.size() && is_in_word(text_[at_])) ++at_;
      word = text_.substr(begin, at_ - begin);
    }
    if (const auto attribute = attribute_named(word)) {
      return emit({.operation = Operation::attribute, .index = *attribute}, 0);
    }
    if (word == "x" || word == "y" || word == "z") {
      return emit({.operation = Operation::axis, .index = static_cast<std::size_t>(word[0] - 'x')},
                  0);
    }
    if (word == "first") return emit({.operation = Operation::constant, .number = 1.0}, 0);
    if (word == "last") {
      if (const auto returns = attribute_named("number_of_returns")) {
        return emit({.operation = Operation::attribute, .index = *returns}, 0);
      }
    }
    at_ = begin;
    std::string known = "x, y, z";
    for (const Channel& attribute : schema_->attributes) known += ", " + attribute.name;
    throw fault("the points have no " + in_quotes(word)).remedy("known are " + known);
  }

  [[nodiscard]] std::optional<std::size_t> attribute_named(std::string_view word) const {
    for (std::size_t i = 0; i < schema_->attributes.size(); ++i) {
      if (schema_->attributes[i].name == word) return i;
    }
    return std::nullopt;
  }

  Where* where_;
  const Schema* schema_;
  std::string_view text_;
  std::size_t at_ = 0, held_ = 0;
  unsigned nested_ = 0;
};

namespace {

/// Points that are evaluated together; few enough that the operands stay in the first-level cache.
constexpr std::size_t kLanes = 256;
template <class Number>
using Lanes = std::array<Number, kLanes>;

template <class Number>
bool holds(Number value) {
  return value < 0 || value > 0;
}

bool is_wide(const Channel& channel) {
  return channel.type == ScalarType::i64 || channel.type == ScalarType::u64;
}

/// Loads the values of an attribute of `count` records from `first` on.
template <class Number>
void load(const Channel& channel, const std::byte* first, std::size_t stride, std::size_t count,
          Lanes<Number>& out) {
  with_type(channel.type, [&](auto tag) {
    for (std::size_t i = 0; i < count; ++i) {
      decltype(tag) value;
      std::memcpy(&value, first + i * stride, sizeof value);
      out[i] = static_cast<Number>(value);
    }
  });
  if (channel.scale == 1.0 && channel.offset == 0.0) return;
  for (std::size_t i = 0; i < count; ++i) out[i] = out[i] * channel.scale + channel.offset;
}

template <class Number, class Function>
void combine(Lanes<Number>& a, const Lanes<Number>& b, const Function& function) {
  for (std::size_t i = 0; i < kLanes; ++i) a[i] = static_cast<Number>(function(a[i], b[i]));
}

/// Widens a range of 64-bit integers whose ends were rounded to doubles, so that it contains the
/// exact values.
ValueRange before_rounding(ValueRange range) {
  constexpr double kExact = 0x1p53, kInfinity = std::numeric_limits<double>::infinity();
  if (std::abs(range.low) >= kExact) range.low = std::nextafter(range.low, -kInfinity);
  if (std::abs(range.high) >= kExact) range.high = std::nextafter(range.high, kInfinity);
  return range;
}

/// Interval arithmetic. Every operation on doubles, including its rounding, is monotonic in each
/// operand, so the ends of the result come from ends of the operands. If one is not finite, any
/// result is possible.
ValueRange hull(std::initializer_list<double> ends, bool nan) {
  ValueRange range{std::min(ends), std::max(ends), nan};
  for (const double end : ends) {
    if (!(end - end == 0.0)) return {};
  }
  return range;
}
constexpr ValueRange truth(bool may_be_false, bool may_be_true) {
  return {may_be_false ? 0.0 : 1.0, may_be_true ? 1.0 : 0.0, false};
}
bool may_hold(const ValueRange& v) { return v.low != 0.0 || v.high != 0.0; }
bool may_fail(const ValueRange& v) { return v.nan || (v.low <= 0.0 && v.high >= 0.0); }
bool is_one(const ValueRange& v) { return !v.nan && v.low == v.high; }

/// sure: the comparison is true for all pairs of values; never: for none. A NaN compares false.
ValueRange comparison(const ValueRange& a, const ValueRange& b, bool sure, bool never) {
  return truth(!sure || a.nan || b.nan, !never);
}

}  // namespace

Where::Where(const std::string& text, const Schema& schema) : text_(text), schema_(schema) {
  Parser(*this, schema_).parse();
  for (std::size_t i = 0; i < schema_.attributes.size(); ++i) {
    extended_ = extended_ || (is_wide(schema_.attributes[i]) && uses(i));
  }
}

bool Where::uses(std::size_t attribute) const {
  return std::any_of(steps_.begin(), steps_.end(), [&](const Step& step) {
    return step.operation == Operation::attribute && step.index == attribute;
  });
}

void Where::test(std::span<const Point3> positions, std::span<const std::byte> records,
                 std::span<std::uint8_t> matches) const {
  extended_ ? test_in<long double>(positions, records, matches)
            : test_in<double>(positions, records, matches);
}

template <class Number>
void Where::test_in(std::span<const Point3> positions, std::span<const std::byte> records,
                    std::span<std::uint8_t> matches) const {
  assert(matches.size() == positions.size());
  const std::size_t stride = schema_.payload_size();
  assert(records.size() == positions.size() * stride);
  std::vector<Lanes<Number>> stack(depth_);
  for (std::size_t begin = 0; begin < positions.size(); begin += kLanes) {
    const std::size_t count = std::min(kLanes, positions.size() - begin);
    std::size_t held = 0;
    for (const Step& step : steps_) {
      switch (step.operation) {
        case Operation::constant:
          stack[held++].fill(static_cast<Number>(step.number));
          continue;
        case Operation::axis:
          for (std::size_t i = 0; i < count; ++i) {
            stack[held][i] = world_point(schema_, positions[begin + i])[step.index];
          }
          ++held;
          continue;
        case Operation::attribute:
          load(schema_.attributes[step.index],
               records.data() + begin * stride + schema_.attribute_offset(step.index), stride,
               count, stack[held++]);
          continue;
        case Operation::negate:
          for (Number& value : stack[held - 1]) value = -value;
          continue;
        case Operation::invert:
          for (Number& value : stack[held - 1]) value = holds(value) ? 0 : 1;
          continue;
        default:
          break;
      }
      Lanes<Number>& a = stack[held - 2];
      const Lanes<Number>& b = stack[held - 1];
      --held;
      switch (step.operation) {
        case Operation::multiply:
          combine(a, b, [](Number p, Number q) { return p * q; });
          break;
        case Operation::divide:
          combine(a, b, [](Number p, Number q) { return p / q; });
          break;
        case Operation::add:
          combine(a, b, [](Number p, Number q) { return p + q; });
          break;
        case Operation::subtract:
          combine(a, b, [](Number p, Number q) { return p - q; });
          break;
        case Operation::less:
          combine(a, b, [](Number p, Number q) { return p < q; });
          break;
        case Operation::less_equal:
          combine(a, b, [](Number p, Number q) { return p <= q; });
          break;
        case Operation::greater:
          combine(a, b, [](Number p, Number q) { return p > q; });
          break;
        case Operation::greater_equal:
          combine(a, b, [](Number p, Number q) { return p >= q; });
          break;
        case Operation::equal:
          combine(a, b, [](Number p, Number q) { return p == q; });
          break;
        case Operation::not_equal:
          combine(a, b, [](Number p, Number q) { return p != q; });
          break;
        case Operation::both:
          combine(a, b, [](Number p, Number q) { return holds(p) && holds(q); });
          break;
        default:
          combine(a, b, [](Number p, Number q) { return holds(p) || holds(q); });
          break;
      }
    }
    for (std::size_t i = 0; i < count; ++i) matches[begin + i] = holds(stack[0][i]) ? 1 : 0;
  }
}

bool Where::possible(const Box3& box, std::span<const ValueRange> attributes) const {
  assert(attributes.empty() || attributes.size() == schema_.attributes.size());
  std::vector<ValueRange> stack;
  for (const Step& step : steps_) {
    switch (step.operation) {
      case Operation::constant:
        stack.push_back(
            {static_cast<double>(step.number), static_cast<double>(step.number), false});
        continue;
      case Operation::axis:
        stack.push_back(hull({box.min[step.index], box.max[step.index]}, false));
        continue;
      case Operation::attribute:
        stack.push_back(attributes.empty() ? ValueRange{} : attributes[step.index]);
        if (is_wide(schema_.attributes[step.index])) stack.back() = before_rounding(stack.back());
        continue;
      case Operation::negate:
        stack.back() = {-stack.back().high, -stack.back().low, stack.back().nan};
        continue;
      case Operation::invert:
        stack.back() = truth(may_hold(stack.back()), may_fail(stack.back()));
        continue;
      default:
        break;
    }
    const ValueRange b = stack.back();
    stack.pop_back();
    const ValueRange a = stack.back();
    const bool nan = a.nan || b.nan;
    switch (step.operation) {
      case Operation::multiply:
        stack.back() = hull({a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high}, nan);
        break;
      case Operation::divide:
        stack.back() =
            b.low <= 0.0 && b.high >= 0.0
                ? ValueRange{}
                : hull({a.low / b.low, a.low / b.high, a.high / b.low, a.high / b.high}, nan);
        break;
      case Operation::add:
        stack.back() = hull({a.low + b.low, a.high + b.high}, nan);
        break;
      case Operation::subtract:
        stack.back() = hull({a.low - b.high, a.high - b.low}, nan);
        break;
      case Operation::less:
        stack.back() = comparison(a, b, a.high < b.low, a.low >= b.high);
        break;
      case Operation::less_equal:
        stack.back() = comparison(a, b, a.high <= b.low, a.low > b.high);
        break;
      case Operation::greater:
        stack.back() = comparison(a, b, a.low > b.high, a.high <= b.low);
        break;
      case Operation::greater_equal:
        stack.back() = comparison(a, b, a.low >= b.high, a.high < b.low);
        break;
      case Operation::equal:
        stack.back() = comparison(a, b, is_one(a) && is_one(b) && a.low == b.low,
                                  a.high < b.low || a.low > b.high);
        break;
      case Operation::not_equal: {
        const bool apart = a.high < b.low || a.low > b.high;
        stack.back() = truth(!apart, !(is_one(a) && is_one(b) && a.low == b.low));
        break;
      }
      case Operation::both:
        stack.back() = truth(may_fail(a) || may_fail(b), may_hold(a) && may_hold(b));
        break;
      default:
        stack.back() = truth(may_fail(a) && may_fail(b), may_hold(a) || may_hold(b));
        break;
    }
  }
  return may_hold(stack.back());
}

}  // namespace terrace::stream
