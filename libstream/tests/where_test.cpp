// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/where.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

/// Points with attributes of several types, some of which are NaN.
struct Cloud {
  Schema schema;
  std::vector<Point3> positions;
  std::vector<std::byte> records;

  explicit Cloud(std::size_t count, std::uint64_t seed) {
    schema.world.xy = {0.5, 0, 100, 0, 2, -7};
    schema.coordinates[2].scale = 0.25;
    schema.coordinates[2].offset = 3;
    schema.attributes = {{.name = "classification", .type = ScalarType::u8},
                         {.name = "number_of_returns", .type = ScalarType::u8},
                         {.name = "angle", .type = ScalarType::i16, .scale = 0.006},
                         {.name = "a b", .type = ScalarType::f32},
                         {.name = "time", .type = ScalarType::f64, .offset = 1e6}};
    std::mt19937_64 random(seed);
    const auto append = [&](auto value) {
      std::array<std::byte, sizeof value> bytes{};
      std::memcpy(bytes.data(), &value, sizeof value);
      records.insert(records.end(), bytes.begin(), bytes.end());
    };
    for (std::size_t i = 0; i < count; ++i) {
      const auto below = [&](std::uint64_t end) { return static_cast<double>(random() % end); };
      positions.push_back({below(9), below(9) - 4, below(9)});
      append(static_cast<std::uint8_t>(random() % 5));
      append(static_cast<std::uint8_t>(random() % 5));
      append(static_cast<std::int16_t>(below(9) - 4));
      append(random() % 7 == 0 ? NAN : static_cast<float>(below(4)));
      append(below(5) - 2);
    }
  }
  [[nodiscard]] double attribute(std::size_t point, std::size_t column) const {
    const Channel& channel = schema.attributes[column];
    return to_double(channel.type, records.data() + point * schema.payload_size() +
                                       schema.attribute_offset(column)) *
               channel.scale +
           channel.offset;
  }
  [[nodiscard]] std::vector<std::uint8_t> matches(const std::string& text) const {
    std::vector<std::uint8_t> out(positions.size(), 7);
    Where(text, schema).test(positions, records, out);
    return out;
  }
};

bool truth(double value) { return !std::isnan(value) && value != 0.0; }

/// An expression as text and as a function.
struct Expression {
  std::string text;
  unsigned precedence;  ///< of the outermost operator; 9 for an operand
  std::function<double(std::size_t)> value;
};

class RandomExpressions {
 public:
  RandomExpressions(const Cloud& cloud, std::uint64_t seed) : cloud_(cloud), random_(seed) {}

  Expression make(int depth) {
    if (depth == 0 || below(6) == 0) return operand();
    if (below(6) == 0) {
      const Expression inner = make(depth - 1);
      const std::string text = inner.precedence < 8 ? "(" + inner.text + ")" : inner.text;
      if (below(2) == 0) {
        return {"-" + text, 8, [f = inner.value](std::size_t i) { return -f(i); }};
      }
      return {(below(2) == 0 ? "!" : "not ") + text, 8,
              [f = inner.value](std::size_t i) { return truth(f(i)) ? 0.0 : 1.0; }};
    }
    struct Operator {
      const char* sign;
      unsigned precedence;
      double (*apply)(double, double);
    };
    static constexpr std::array<Operator, 14> kOperators{
        {{"||", 1, [](double a, double b) { return truth(a) || truth(b) ? 1.0 : 0.0; }},
         {" or ", 1, [](double a, double b) { return truth(a) || truth(b) ? 1.0 : 0.0; }},
         {"&&", 2, [](double a, double b) { return truth(a) && truth(b) ? 1.0 : 0.0; }},
         {" and ", 2, [](double a, double b) { return truth(a) && truth(b) ? 1.0 : 0.0; }},
         {"==", 3, [](double a, double b) { return a == b ? 1.0 : 0.0; }},
         {"!=", 3, [](double a, double b) { return a != b ? 1.0 : 0.0; }},
         {"<", 4, [](double a, double b) { return a < b ? 1.0 : 0.0; }},
         {"<=", 4, [](double a, double b) { return a <= b ? 1.0 : 0.0; }},
         {">", 4, [](double a, double b) { return a > b ? 1.0 : 0.0; }},
         {">=", 4, [](double a, double b) { return a >= b ? 1.0 : 0.0; }},
         {"+", 5, [](double a, double b) { return a + b; }},
         {" - ", 5, [](double a, double b) { return a - b; }},
         {"*", 6, [](double a, double b) { return a * b; }},
         {"/", 6, [](double a, double b) { return a / b; }}}};
    const Operator& op = kOperators[below(kOperators.size())];
    const Expression a = make(depth - 1), b = make(depth - 1);
    // Parentheses where needed, and sometimes elsewhere.
    const bool compares = op.precedence == 3 || op.precedence == 4;
    const auto side = [&](const Expression& e, bool right) {
      const bool needs_parentheses =
          e.precedence < op.precedence || (e.precedence == op.precedence && (right || compares));
      return needs_parentheses || below(5) == 0 ? "( " + e.text + " )" : e.text;
    };
    return {
        side(a, false) + op.sign + side(b, true), op.precedence,
        [f = a.value, g = b.value, apply = op.apply](std::size_t i) { return apply(f(i), g(i)); }};
  }

 private:
  std::uint64_t below(std::uint64_t end) { return random_() % end; }

  Expression operand() {
    const std::uint64_t kind = below(9);
    if (kind < 3) {
      return {std::string(1, "xyz"[kind]), 9, [this, kind](std::size_t i) {
                return world_point(cloud_.schema, cloud_.positions[i])[kind];
              }};
    }
    if (kind < 8) {
      const std::size_t column = kind - 3;
      const std::string& name = cloud_.schema.attributes[column].name;
      std::string text = column == 3 ? "\"" + name + "\"" : name;
      if (column == 1 && below(2) == 0) text = "last";
      return {text, 9, [this, column](std::size_t i) { return cloud_.attribute(i, column); }};
    }
    const double number = static_cast<double>(below(9)) / 2;
    return {std::to_string(number), 9, [number](std::size_t) { return number; }};
  }

  const Cloud& cloud_;
  std::mt19937_64 random_;
};

TEST(Where, EvaluatesRandomConditions) {
  std::size_t met = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    // Points for one block of lanes, or for several.
    const Cloud cloud(seed % 2 == 0 ? 40 : 700, seed);
    RandomExpressions expressions(cloud, seed);
    const Expression expression = expressions.make(5);
    SCOPED_TRACE(expression.text);
    const std::vector<std::uint8_t> matches = cloud.matches(expression.text);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      ASSERT_EQ(matches[i], truth(expression.value(i)) ? 1 : 0) << "point " << i;
      met += matches[i];
    }
    all += matches.size();
  }
  EXPECT_GT(met, all / 10);
  EXPECT_LT(met, all - all / 10);
}

// If a point meets the condition, possible() must be true for its box and the ranges of its
// attributes; otherwise it is often false.
TEST(Where, ExcludesByRangesOnlyWhatIsImpossible) {
  std::size_t excluded = 0, none = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cloud cloud(1 + seed % 5, seed);
    RandomExpressions expressions(cloud, seed);
    const Expression expression = expressions.make(static_cast<int>(seed % 5));
    SCOPED_TRACE(expression.text);
    const std::vector<std::uint8_t> matches = cloud.matches(expression.text);
    const bool any = std::find(matches.begin(), matches.end(), 1) != matches.end();
    Box3 box;
    std::vector<ValueRange> ranges(cloud.schema.attributes.size(), {INFINITY, -INFINITY, false});
    for (std::size_t i = 0; i < matches.size(); ++i) {
      box.include(world_point(cloud.schema, cloud.positions[i]));
      for (std::size_t a = 0; a < ranges.size(); ++a) {
        const double value = cloud.attribute(i, a);
        if (std::isnan(value)) {
          ranges[a] = {};
        } else if (!ranges[a].nan) {
          ranges[a] = {std::min(ranges[a].low, value), std::max(ranges[a].high, value), false};
        }
      }
    }
    const Where where(expression.text, cloud.schema);
    const bool possible = where.possible(box, ranges);
    ASSERT_TRUE(possible || !any);
    ASSERT_TRUE(where.possible(box, {}) || !possible);
    none += any ? 0 : 1;
    excluded += possible ? 0 : 1;
  }
  EXPECT_GT(none, 500u);
  EXPECT_GT(excluded, none / 2);
}

TEST(Where, EvaluatesUsualConditions) {
  const Cloud cloud(500, 9);
  for (const auto& [text, same] : std::vector<std::pair<std::string, std::string>>{
           {"classification == 2 && number_of_returns == last", "classification==2"},
           {"not (classification == 2 or z < 4)", "classification != 2 && z >= 4"},
           {"-z < - 4", "z > 4"},
           {"first", "1"},
           {"1e0 == 1.0", "1"}}) {
    EXPECT_EQ(cloud.matches(text), cloud.matches(same)) << text;
  }
  // NaN does not meet a condition.
  EXPECT_EQ(cloud.matches("\"a b\" - \"a b\""), std::vector<std::uint8_t>(500, 0));
  EXPECT_EQ(cloud.matches("0 / 0"), std::vector<std::uint8_t>(500, 0));
}

TEST(Where, NamesTheFaultAndItsPosition) {
  const Cloud cloud(1, 1);
  for (const auto& [text, where, cause] : std::vector<std::array<std::string, 3>>{
           {"", "character 1", "ends"},
           {"   ", "character 4", "ends"},
           {"classification = 2", "character 16", "operator"},
           {"class == 2", "character 1", "no 'class'"},
           {"classification == ", "character 19", "ends"},
           {"classification == ground", "character 19", "no 'ground'"},
           {"(z > 1", "character 7", "')' is missing"},
           {"z > 1)", "character 6", "operator"},
           {"1 < z < 3", "character 8", "chained"},
           {"\"a b == 1", "character 1", "closing quote"},
           {"z > +3", "character 5", "number"},
           {"z ? 1", "character 3", "operator"},
           {std::string(100, '('), "character 65", "nested"},
           {std::string(5000, ' '), "character 1", "longer"}}) {
    try {
      Where(text, cloud.schema);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.parts().where, where) << text;
      EXPECT_NE(error.parts().cause.text().find(cause), std::string::npos) << error.what();
    }
  }
}

/// Returns a PLY of points with four attributes.
std::string made_ply(std::size_t count) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                     "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar a\n"
                     "property ushort b\nproperty float c\nproperty uchar withheld\nend_header\n";
  for (std::size_t i = 0; i < count; ++i) {
    const std::string n = std::to_string(i);
    text += n + " 0 " + std::to_string(i % 10) + " " + std::to_string(i % 7) + " " +
            std::to_string(i * 3) + " 0.5 " + std::to_string(i % 2) + "\n";
  }
  return text;
}

TEST(Selection, LeavesPointsAndAttributesOut) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.ply").string();
  std::ofstream(file) << made_ply(1000);
  for (const std::size_t block_points : {1u, 7u, 100u, 5000u}) {
    SourceOptions options{.block_points = block_points};
    options.selection.where = "a >= 5 && z != 3";
    options.selection.keep = {"withheld", "b", "a"};
    options.selection.drop = {"a"};
    const auto source = open_source(std::span(&file, 1), options);
    const SourceInfo& info = source->info();
    ASSERT_EQ(info.attributes.size(), 2u);
    EXPECT_EQ(info.attributes[0].name, "b");  // in the order of the file
    EXPECT_EQ(info.attributes[1].name, "withheld");
    EXPECT_FALSE(info.points);
    std::vector<std::size_t> expected, found;
    std::uint64_t withheld = 0;
    for (std::size_t i = 0; i < 1000; ++i) {
      if (i % 7 < 5 || i % 10 == 3) continue;
      expected.push_back(i);
      withheld += i % 2;
    }
    PointBlock block;
    while (source->next(block)) {
      ASSERT_FALSE(block.empty());
      // Every block but the last is full.
      const bool last = found.size() + block.size() == expected.size();
      ASSERT_TRUE(block.size() == block_points || (last && block.size() < block_points));
      ASSERT_EQ(block.payload.size(), block.size() * 3);
      const auto b = info.view<std::uint16_t>(block.payload, 0);
      const auto marks = info.view<std::uint8_t>(block.payload, 1);
      for (std::size_t i = 0; i < block.size(); ++i) {
        const auto number = static_cast<std::size_t>(block.positions[i][0]);
        found.push_back(number);
        ASSERT_EQ(b[i], number * 3);
        ASSERT_EQ(marks[i], number % 2);
      }
    }
    EXPECT_TRUE(block.empty());
    EXPECT_EQ(found, expected);
    const Progress progress = source->progress();
    EXPECT_EQ(progress.points, expected.size());
    EXPECT_EQ(progress.excluded, 1000 - expected.size());
    EXPECT_EQ(progress.withheld, withheld);
  }
}

TEST(Selection, NamesUnknownAttributes) {
  const TempFolder folder;
  const std::string file = (folder.path() / "a.ply").string();
  std::ofstream(file) << made_ply(3);
  const auto open = [&](const SourceOptions& options) {
    return open_source(std::span(&file, 1), options);
  };
  EXPECT_THROW(static_cast<void>(open({.selection = {.where = "d == 1"}})), Error);
  EXPECT_THROW(static_cast<void>(open({.selection = {.keep = std::vector<std::string>{"d"}}})),
               Error);
  EXPECT_THROW(static_cast<void>(open({.selection = {.drop = {"a", "d"}}})), Error);
  // No attribute is kept and no point is left; an empty stream is valid.
  const auto none = open({.selection = {.where = "z > 100", .keep = std::vector<std::string>{}}});
  EXPECT_EQ(none->info().payload_size(), 0u);
  PointBlock block;
  EXPECT_FALSE(none->next(block));
}

// 64-bit integers are compared exactly, and clusters that have matches are not excluded.
TEST(Where, ComparesLargeIntegersExactly) {
  Schema schema;
  schema.attributes = {{.name = "i", .type = ScalarType::i64},
                       {.name = "u", .type = ScalarType::u64}};
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    // Within a few units of one another, where doubles are 1 to 2048 apart.
    const std::uint64_t base = (std::uint64_t{1} << (52 + random() % 11)) + random() % 3000;
    const auto near = [&] { return base + random() % 5; };
    std::vector<std::int64_t> values;
    std::vector<std::byte> records;
    for (int k = 0; k < 4; ++k) {
      const std::uint64_t value = near();
      values.push_back(-static_cast<std::int64_t>(value));
      std::array<std::byte, 16> bytes{};
      std::memcpy(bytes.data(), &values.back(), 8);
      std::memcpy(bytes.data() + 8, &value, 8);
      records.insert(records.end(), bytes.begin(), bytes.end());
    }
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const ValueRange range{static_cast<double>(*low), static_cast<double>(*high), false};
    const ValueRange opposite{-range.high, -range.low, false};
    const std::int64_t number = -static_cast<std::int64_t>(near());
    const auto check = [&](const std::string& sign, const std::function<bool(std::int64_t)>& holds,
                           const std::string& turned) {
      const std::string digits = std::to_string(number).substr(1);
      for (const std::string& text :
           {"i " + sign + " -" + digits, "u " + turned + " " + digits, digits + sign + "u"}) {
        SCOPED_TRACE(text);
        const Where where(text, schema);
        std::vector<std::uint8_t> matches(values.size());
        where.test(std::vector<Point3>(values.size()), records, matches);
        bool any = false;
        for (std::size_t k = 0; k < values.size(); ++k) {
          EXPECT_EQ(matches[k] != 0, holds(values[k])) << values[k];
          any = any || holds(values[k]);
        }
        if (any) {
          EXPECT_TRUE(where.possible({}, std::array{range, opposite}));
        }
      }
    };
    check(
        "<", [&](std::int64_t v) { return v < number; }, ">");
    check(
        "<=", [&](std::int64_t v) { return v <= number; }, ">=");
    check(
        "==", [&](std::int64_t v) { return v == number; }, "==");
    check(
        "!=", [&](std::int64_t v) { return v != number; }, "!=");
    check(
        ">", [&](std::int64_t v) { return v > number; }, "<");
  }
}

}  // namespace
}  // namespace terrace::stream
