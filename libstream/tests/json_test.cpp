// SPDX-License-Identifier: Apache-2.0
#include "store/json.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "store/codec/bytes.hpp"

namespace terrace::stream::store {
namespace {

/// Checks that each value is the same as nlohmann-json's.
void expect_same(const JsonValue& json, const nlohmann::json& expected) {
  if (expected.is_object()) {
    ASSERT_EQ(json.kind(), JsonValue::Kind::object);
    for (const auto& [key, value] : expected.items()) expect_same(json.at(key), value);
  } else if (expected.is_array()) {
    ASSERT_EQ(json.items().size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) expect_same(json.items()[i], expected[i]);
  } else if (expected.is_string()) {
    EXPECT_EQ(json.string(), expected.get<std::string>());
  } else if (expected.is_boolean()) {
    EXPECT_EQ(json.boolean(), expected.get<bool>());
  } else if (expected.is_null()) {
    EXPECT_EQ(json.kind(), JsonValue::Kind::null);
  } else {
    EXPECT_EQ(json.number(), expected.get<double>());
    if (expected.is_number_unsigned()) {
      EXPECT_EQ(json.count(), expected.get<std::uint64_t>());
    } else {
      EXPECT_THROW(static_cast<void>(json.count()), Damage);
    }
  }
}

std::vector<std::string> texts() {
  std::vector<std::string> texts{
      R"( { "a" : [ 1 , -2.5e+3 , 0.1E-7, true, false, null ], "" : { } , "b":[] } )",
      R"(["\u0041\u00e9\u20ac\ud83d\ude00", "\"\\\/\b\f\n\r\t", "Š€😀", "ÿ߿ࠀ퟿"])",
      R"({"a": 1, "b": 2, "a": "the last"})",
      "[18446744073709551615, 18446744073709551616, -9223372036854775808, 9007199254740993, -0, 0]",
      "[1e308, 1e-308, 5e-324, 2.4703282292062327e-324, 1e-400, 0e999, 1.7976931348623157e308]",
      "3.14",
      "\"\"",
      "\t[\r\n]"};
  for (const auto& folder :
       std::filesystem::directory_iterator(std::filesystem::path(TERRACE_TEST_DATA) / "stores")) {
    std::ifstream in(folder.path() / "manifest.json", std::ios::binary);
    if (in)
      texts.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return texts;
}

TEST(StoreJson, AgreesWithNlohmannJsonOnTextsAndDamagedOnes) {
  constexpr std::uint64_t kSeed = 20;
  std::mt19937_64 random(kSeed);
  const std::vector<std::string> all = texts();
  const std::string alphabet =
      "{}[]\",:\\u0123456789.-+eEtrfnal \n\x01\x7f\x80\xbf\xc0\xc2\xe0\xed\xf0\xf4\xff";
  std::size_t read = 0, refused = 0;
  for (std::size_t round = 0; round < 200'000 / TERRACE_TEST_SHARE; ++round) {
    std::string text = all[round % all.size()];
    if (text.size() > 400) {  // a part that is likely to be a value
      const std::size_t begin = text.find('{', random() % text.size());
      text = begin == text.npos ? text : text.substr(begin, text.find('}', begin) - begin + 1);
    }
    for (std::size_t change = round < all.size() ? 0 : random() % 4; change > 0; --change) {
      const std::size_t at = random() % (text.size() + 1);
      switch (random() % 3) {
        case 0:
          text.insert(at, 1, alphabet[random() % alphabet.size()]);
          break;
        case 1:
          text.erase(at, random() % 3);
          break;
        default:
          text.insert(at, text.substr(random() % (text.size() + 1), random() % 6));
          break;
      }
    }
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", round " + std::to_string(round) + ": " +
                 text);
    try {
      const nlohmann::json expected = nlohmann::json::parse(text);
      ++read;
      ASSERT_NO_THROW(expect_same(JsonValue::parse(text), expected));
    } catch (const nlohmann::json::parse_error&) {
      ++refused;
      EXPECT_THROW(JsonValue::parse(text), Damage);
    } catch (const nlohmann::json::out_of_range&) {
      // A number too large for a double, which JsonValue refuses only when it is read.
    }
  }
  EXPECT_GT(read, 20'000u / TERRACE_TEST_SHARE);
  EXPECT_GT(refused, 20'000u / TERRACE_TEST_SHARE);
}

TEST(StoreJson, RefusesTextsThatWouldTakeMuchMemory) {
  const std::string deep(100'000, '['), closed = std::string(17, '[') + std::string(17, ']');
  EXPECT_THROW(JsonValue::parse(deep), Damage);
  EXPECT_THROW(JsonValue::parse(closed), Damage);
  EXPECT_NO_THROW(JsonValue::parse(std::string_view(closed).substr(1, 32)));
  std::string long_array = "[0";
  for (std::size_t i = 0; i < 1 << 20; ++i) long_array += ",0";
  EXPECT_THROW(JsonValue::parse(long_array + "]"), Damage);
}

TEST(StoreJson, RefusesOtherKindsAndNumbersThatAreTooLarge) {
  const JsonValue json = JsonValue::parse(R"([1e309, 1.5, -1, "1", {"a": 1}])");
  EXPECT_THROW(static_cast<void>(json.items()[0].number()), Damage);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_THROW(static_cast<void>(json.items()[i].count()), Damage);
  EXPECT_THROW(static_cast<void>(json.items()[3].number()), Damage);
  EXPECT_THROW(static_cast<void>(json.items()[3].boolean()), Damage);
  EXPECT_THROW(static_cast<void>(json.items()[4].items()), Damage);
  EXPECT_THROW(static_cast<void>(json.items()[4].at("b")), Damage);
  EXPECT_THROW(static_cast<void>(json.at("a")), Damage);
  EXPECT_THROW(static_cast<void>(json.string()), Damage);
}

}  // namespace
}  // namespace terrace::stream::store
