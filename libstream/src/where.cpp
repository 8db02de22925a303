// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/where.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
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
    constexpr std::size_t kMaxCharacters = 4096;
    if (text_.size() > kMaxCharacters) {
      throw fault("is longer than " + counted(kMaxCharacters, "character"));
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
  static constexpr unsigned kMaxNested = 64;

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

  void emit(const Step& step) {
    where_->steps_.push_back(step);
    stack_depth_ = stack_depth_ + 1 - step.operands;
    where_->depth_ = std::max(where_->depth_, stack_depth_);
  }

  void expression(unsigned least) {
    operand();
    unsigned compared = 0;
    while (true) {
      const std::size_t before = at_;
      const auto* const binary = std::find_if(kBinary.begin(), kBinary.end(),
                                              [&](const Binary& b) { return take(b.sign); });
      if (binary == kBinary.end()) return;
      if (binary->precedence < least) {
        at_ = before;
        return;
      }
      if (binary->precedence == compared) {
        throw fault("comparisons cannot be chained").remedy("join two with &&: a < b && b < c");
      }
      if (binary->precedence == 3 || binary->precedence == 4) compared = binary->precedence;
      expression(binary->precedence + 1);
      emit({.operation = binary->operation, .operands = 2});
    }
  }

  void operand() {
    if (++nested_ > kMaxNested)
      throw fault("is nested too deeply").remedy("write it with fewer parentheses");
    skip_blanks();
    if (at_ == text_.size()) throw fault("ends where a number or a name is expected");
    if (take("-")) {
      operand();
      emit({.operation = Operation::negate, .operands = 1});
    } else if (take("!") || take("not")) {
      operand();
      emit({.operation = Operation::invert, .operands = 1});
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
    std::uint64_t integer = 0;
    const auto [end, error] = std::from_chars(begin, rest, integer);
    const bool is_whole = error == std::errc{} && end == rest;
    emit({.operation = Operation::constant,
          .number = is_whole ? static_cast<long double>(integer) : value});
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
      return emit({.operation = Operation::attribute, .index = *attribute});
    }
    if (word == "x" || word == "y" || word == "z") {
      return emit({.operation = Operation::axis, .index = static_cast<std::size_t>(word[0] - 'x')});
    }
    if (word == "first") return emit({.operation = Operation::constant, .number = 1.0});
    if (word == "last") {
      if (const auto returns = attribute_named("number_of_returns")) {
        return emit({.operation = Operation::attribute, .index = *returns});
      }
    }
    at_ = begin;
    std::string names = "x, y, z";
    for (const Channel& attribute : schema_->attributes) names += ", " + attribute.name;
    throw fault("the points have no " + in_quotes(word)).remedy("known are " + names);
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
  std::size_t at_ = 0, stack_depth_ = 0;
  unsigned nested_ = 0;
};

namespace {

bool is_wide(const Channel& channel) {
  return channel.type == ScalarType::i64 || channel.type == ScalarType::u64;
}

/// Points that are evaluated together; few enough that the operands stay in the first-level cache.
constexpr std::size_t kLanes = 256;

/// The operations on the values of up to kLanes points. Those of two operands replace the first.
template <class Number>
class Values {
 public:
  using Operand = std::array<Number, kLanes>;

  /// records: the packed records of these points.
  Values(const Schema& schema, std::span<const Point3> positions,
         std::span<const std::byte> records)
      : schema_(schema), positions_(positions), records_(records) {}

  void constant(Operand& out, long double number) const { out.fill(static_cast<Number>(number)); }
  void axis(Operand& out, std::size_t index) const {
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      out[i] = world_point(schema_, positions_[i])[index];
    }
  }
  void attribute(Operand& out, std::size_t index) const {
    const Channel& channel = schema_.attributes[index];
    const std::byte* const first = records_.data() + schema_.attribute_offset(index);
    const std::size_t count = positions_.size(), stride = records_.size() / count;
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

  static void negate(Operand& a) {
    for (Number& value : a) value = -value;
  }
  static void invert(Operand& a) {
    for (Number& value : a) value = holds(value) ? 0 : 1;
  }
  static void multiply(Operand& a, const Operand& b) { combine(a, b, std::multiplies<>()); }
  static void divide(Operand& a, const Operand& b) { combine(a, b, std::divides<>()); }
  static void add(Operand& a, const Operand& b) { combine(a, b, std::plus<>()); }
  static void subtract(Operand& a, const Operand& b) { combine(a, b, std::minus<>()); }
  static void less(Operand& a, const Operand& b) { combine(a, b, std::less<>()); }
  static void less_equal(Operand& a, const Operand& b) { combine(a, b, std::less_equal<>()); }
  static void greater(Operand& a, const Operand& b) { combine(a, b, std::greater<>()); }
  static void greater_equal(Operand& a, const Operand& b) { combine(a, b, std::greater_equal<>()); }
  static void equal(Operand& a, const Operand& b) { combine(a, b, std::equal_to<>()); }
  static void not_equal(Operand& a, const Operand& b) { combine(a, b, std::not_equal_to<>()); }
  static void both(Operand& a, const Operand& b) {
    combine(a, b, [](Number p, Number q) { return holds(p) && holds(q); });
  }
  static void either(Operand& a, const Operand& b) {
    combine(a, b, [](Number p, Number q) { return holds(p) || holds(q); });
  }

  static bool holds(Number value) { return value < 0 || value > 0; }

 private:
  template <class Function>
  static void combine(Operand& a, const Operand& b, const Function& function) {
    for (std::size_t i = 0; i < kLanes; ++i) a[i] = static_cast<Number>(function(a[i], b[i]));
  }

  const Schema& schema_;
  std::span<const Point3> positions_;
  std::span<const std::byte> records_;
};

/// Performs the operations on ranges of values, by interval arithmetic. Every operation on doubles,
/// including its rounding, is monotonic in each operand, so the ends of the result come from ends
/// of the operands.
class Ranges {
 public:
  using Operand = ValueRange;

  Ranges(const Schema& schema, const Box3& box, std::span<const ValueRange> attributes)
      : schema_(schema), box_(box), attributes_(attributes) {}

  static void constant(Operand& out, long double number) {
    out = {static_cast<double>(number), static_cast<double>(number), false};
  }
  void axis(Operand& out, std::size_t index) const {
    out = hull({box_.min[index], box_.max[index]}, false);
  }
  void attribute(Operand& out, std::size_t index) const {
    out = attributes_.empty() ? ValueRange{} : attributes_[index];
    if (is_wide(schema_.attributes[index])) out = before_rounding(out);
  }

  static void negate(Operand& a) { a = {-a.high, -a.low, a.nan}; }
  static void invert(Operand& a) { a = truth(may_hold(a), may_fail(a)); }
  static void multiply(Operand& a, const Operand& b) {
    a = hull({a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high}, a.nan || b.nan);
  }
  static void divide(Operand& a, const Operand& b) {
    const bool by_zero = b.low <= 0.0 && b.high >= 0.0;
    a = by_zero ? ValueRange{}
                : hull({a.low / b.low, a.low / b.high, a.high / b.low, a.high / b.high},
                       a.nan || b.nan);
  }
  static void add(Operand& a, const Operand& b) {
    a = hull({a.low + b.low, a.high + b.high}, a.nan || b.nan);
  }
  static void subtract(Operand& a, const Operand& b) {
    a = hull({a.low - b.high, a.high - b.low}, a.nan || b.nan);
  }
  static void less(Operand& a, const Operand& b) {
    a = comparison(a, b, a.high < b.low, a.low >= b.high);
  }
  static void less_equal(Operand& a, const Operand& b) {
    a = comparison(a, b, a.high <= b.low, a.low > b.high);
  }
  static void greater(Operand& a, const Operand& b) {
    a = comparison(a, b, a.low > b.high, a.high <= b.low);
  }
  static void greater_equal(Operand& a, const Operand& b) {
    a = comparison(a, b, a.low >= b.high, a.high < b.low);
  }
  static void equal(Operand& a, const Operand& b) {
    a = comparison(a, b, are_same(a, b), are_apart(a, b));
  }
  static void not_equal(Operand& a, const Operand& b) {
    a = truth(!are_apart(a, b), !are_same(a, b));
  }
  static void both(Operand& a, const Operand& b) {
    a = truth(may_fail(a) || may_fail(b), may_hold(a) && may_hold(b));
  }
  static void either(Operand& a, const Operand& b) {
    a = truth(may_fail(a) && may_fail(b), may_hold(a) || may_hold(b));
  }

  static bool may_hold(const ValueRange& v) { return v.low != 0.0 || v.high != 0.0; }

 private:
  static bool may_fail(const ValueRange& v) { return v.nan || (v.low <= 0.0 && v.high >= 0.0); }
  static bool is_one(const ValueRange& v) { return !v.nan && v.low == v.high; }
  static bool are_same(const ValueRange& a, const ValueRange& b) {
    return is_one(a) && is_one(b) && a.low == b.low;
  }
  static bool are_apart(const ValueRange& a, const ValueRange& b) {
    return a.high < b.low || a.low > b.high;
  }

  static constexpr ValueRange truth(bool may_be_false, bool may_be_true) {
    return {may_be_false ? 0.0 : 1.0, may_be_true ? 1.0 : 0.0, false};
  }
  /// sure: the comparison is true for all pairs of values; never: for none. A NaN compares false.
  static ValueRange comparison(const ValueRange& a, const ValueRange& b, bool sure, bool never) {
    return truth(!sure || a.nan || b.nan, !never);
  }
  /// Returns the smallest range with these ends; any value if one of them is not finite.
  static ValueRange hull(std::initializer_list<double> ends, bool nan) {
    ValueRange range{std::min(ends), std::max(ends), nan};
    for (const double end : ends) {
      if (!(end - end == 0.0)) return {};
    }
    return range;
  }
  /// Widens a range of 64-bit integers whose ends were rounded to doubles, so that it contains the
  /// exact values.
  static ValueRange before_rounding(ValueRange range) {
    constexpr double kExact = 0x1p53, kInfinity = std::numeric_limits<double>::infinity();
    if (std::abs(range.low) >= kExact) range.low = std::nextafter(range.low, -kInfinity);
    if (std::abs(range.high) >= kExact) range.high = std::nextafter(range.high, kInfinity);
    return range;
  }

  const Schema& schema_;
  const Box3& box_;
  std::span<const ValueRange> attributes_;
};

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

template <class Domain>
void Where::evaluate(const Domain& domain, std::span<typename Domain::Operand> stack) const {
  std::size_t depth = 0;
  for (const Step& step : steps_) {
    depth = depth + 1 - step.operands;
    typename Domain::Operand* const a = &stack[depth - 1];  // the first operand, then the result
    const typename Domain::Operand* const b = a + 1;
    switch (step.operation) {
      case Operation::constant:
        domain.constant(*a, step.number);
        break;
      case Operation::axis:
        domain.axis(*a, step.index);
        break;
      case Operation::attribute:
        domain.attribute(*a, step.index);
        break;
      case Operation::negate:
        domain.negate(*a);
        break;
      case Operation::invert:
        domain.invert(*a);
        break;
      case Operation::multiply:
        domain.multiply(*a, *b);
        break;
      case Operation::divide:
        domain.divide(*a, *b);
        break;
      case Operation::add:
        domain.add(*a, *b);
        break;
      case Operation::subtract:
        domain.subtract(*a, *b);
        break;
      case Operation::less:
        domain.less(*a, *b);
        break;
      case Operation::less_equal:
        domain.less_equal(*a, *b);
        break;
      case Operation::greater:
        domain.greater(*a, *b);
        break;
      case Operation::greater_equal:
        domain.greater_equal(*a, *b);
        break;
      case Operation::equal:
        domain.equal(*a, *b);
        break;
      case Operation::not_equal:
        domain.not_equal(*a, *b);
        break;
      case Operation::both:
        domain.both(*a, *b);
        break;
      case Operation::either:
        domain.either(*a, *b);
        break;
    }
  }
}

template <class Number>
void Where::test_in(std::span<const Point3> positions, std::span<const std::byte> records,
                    std::span<std::uint8_t> matches) const {
  assert(matches.size() == positions.size());
  const std::size_t stride = schema_.payload_size();
  assert(records.size() == positions.size() * stride);
  std::vector<typename Values<Number>::Operand> stack(depth_);
  for (std::size_t begin = 0; begin < positions.size(); begin += kLanes) {
    const std::size_t count = std::min(kLanes, positions.size() - begin);
    const Values<Number> values(schema_, positions.subspan(begin, count),
                                records.subspan(begin * stride, count * stride));
    evaluate(values, stack);
    for (std::size_t i = 0; i < count; ++i) {
      matches[begin + i] = Values<Number>::holds(stack[0][i]) ? 1 : 0;
    }
  }
}

bool Where::possible(const Box3& box, std::span<const ValueRange> attributes) const {
  assert(attributes.empty() || attributes.size() == schema_.attributes.size());
  std::vector<ValueRange> stack(depth_);
  evaluate(Ranges(schema_, box, attributes), stack);
  return Ranges::may_hold(stack[0]);
}

}  // namespace terrace::stream
