// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "raster/nodata.hpp"
#include "raster_testing.hpp"

namespace terrace::stream {
namespace {

template <class T>
bool is_nodata(const std::string& text, ScalarType type, T sample) {
  const NodataRule rule = NodataRule::parse(text, type);
  T out{};
  std::uint8_t valid = 0;
  overlay_row(type, {reinterpret_cast<const std::byte*>(&sample), 1, 1}, rule,
              reinterpret_cast<std::byte*>(&out), &valid);
  if (valid != 0) {
    EXPECT_EQ(std::memcmp(&out, &sample, sizeof sample), 0);
  }
  return valid == 0;
}

TEST(Nodata, MatchesIntegersHoweverTheValueIsWritten) {
  for (const char* text : {"-32768", " -32768 ", "-32768.0", "-3.2768e4", "-32768\n"}) {
    EXPECT_TRUE(is_nodata<std::int16_t>(text, ScalarType::i16, -32768)) << text;
    EXPECT_FALSE(is_nodata<std::int16_t>(text, ScalarType::i16, -32767)) << text;
  }
  EXPECT_TRUE(is_nodata<std::uint8_t>("+255", ScalarType::u8, 255));
  EXPECT_TRUE(is_nodata<std::uint32_t>("4294967295", ScalarType::u32, 4294967295u));
}

TEST(Nodata, MatchesNothingIfTheTypeCannotHoldTheValue) {
  for (const char* text : {"-9999", "256", "0.5", "nan", "inf", "1e300", "-1"}) {
    const NodataRule rule = NodataRule::parse(text, ScalarType::u8);
    EXPECT_TRUE(rule.value.has_value()) << text;
    EXPECT_TRUE(rule.unmatched) << text;
    for (int v = 0; v < 256; ++v) {
      EXPECT_FALSE(is_nodata(text, ScalarType::u8, static_cast<std::uint8_t>(v))) << text << v;
    }
  }
  EXPECT_FALSE(is_nodata<std::int16_t>("65535", ScalarType::i16, -1));
}

TEST(Nodata, LargeIntegersAreExact) {
  EXPECT_TRUE(is_nodata<std::int64_t>("-9223372036854775808", ScalarType::i64,
                                      std::numeric_limits<std::int64_t>::min()));
  EXPECT_TRUE(is_nodata<std::int64_t>("9007199254740993", ScalarType::i64, 9007199254740993));
  EXPECT_FALSE(is_nodata<std::int64_t>("9007199254740993", ScalarType::i64, 9007199254740992));
  EXPECT_TRUE(is_nodata<std::uint64_t>("18446744073709551615", ScalarType::u64, UINT64_MAX));
  EXPECT_FALSE(is_nodata<std::uint64_t>("18446744073709551615", ScalarType::u64, UINT64_MAX - 1));
  EXPECT_FALSE(is_nodata<std::uint64_t>("-1", ScalarType::u64, UINT64_MAX));
}

TEST(Nodata, MatchesFloatsWithinTheirPrecision) {
  EXPECT_TRUE(is_nodata("-3.4028234663852886e+38", ScalarType::f32, -3.4028234663852886e+38f));
  EXPECT_TRUE(is_nodata("-3.40282306073710965e+38", ScalarType::f32, -3.4028234663852886e+38f));
  EXPECT_TRUE(is_nodata("-3.4e+38", ScalarType::f32, -3.4e+38f));
  EXPECT_FALSE(is_nodata("-3.4e+38", ScalarType::f32, -3.39e+38f));
  EXPECT_TRUE(is_nodata("-9999", ScalarType::f32, -9999.0f));
  EXPECT_FALSE(is_nodata("-9999", ScalarType::f32, -9998.9f));
  EXPECT_FALSE(is_nodata("-9999", ScalarType::f32, 9999.0f));
  EXPECT_TRUE(is_nodata("0", ScalarType::f32, -0.0f));
  EXPECT_FALSE(is_nodata("0", ScalarType::f32, 1e-45f));
  EXPECT_TRUE(is_nodata("1e-45", ScalarType::f32, 1e-45f));
  EXPECT_TRUE(is_nodata("1.7976931348623157e308", ScalarType::f64, 1.7976931348623157e308));
  EXPECT_FALSE(is_nodata("1.7976931348623157e308", ScalarType::f64, 1.7e308));
  EXPECT_TRUE(is_nodata("-9999", ScalarType::f64, -9999.0));
  EXPECT_FALSE(is_nodata("-9999", ScalarType::f64, -9999.0001));
}

TEST(Nodata, NaNAndInfinitiesAreNodataWithAnyValue) {
  for (const char* text :
       {"", "nan", "NaN", "-nan", "inf", "-Inf", "1.#QNAN", "-1.#IND", "-9999"}) {
    SCOPED_TRACE(text);
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(is_nodata(text, ScalarType::f32, std::nanf("")));
    EXPECT_TRUE(is_nodata(text, ScalarType::f32, infinity));
    EXPECT_TRUE(is_nodata(text, ScalarType::f32, -infinity));
    EXPECT_TRUE(is_nodata(text, ScalarType::f64, std::nan("")));
    EXPECT_FALSE(is_nodata(text, ScalarType::f32, std::numeric_limits<float>::max()));
    EXPECT_FALSE(is_nodata(text, ScalarType::f32, 1.0f));
  }
}

TEST(Nodata, IgnoresUnreadableText) {
  for (const char* text : {"", "  ", "none", "x", "-", "\xff\xfe"}) {
    EXPECT_FALSE(NodataRule::parse(text, ScalarType::i16).value.has_value()) << text;
  }
}

/// Compares the loops with the rule cell by cell, for all steps and for lengths around the chunk
/// size.
TEST(Overlay, CopiesValidCellsOverOthers) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 3000; ++round) {
    SCOPED_TRACE(round);
    const std::size_t cells = 1 + random() % 300, step = 1 + random() % 3;
    const std::uint64_t rare = 1 + random() % 100;
    std::vector<float> row(cells * step);
    for (float& v : row) {
      v = random() % rare == 0 ? -9999.0f : static_cast<float>(random() % 100);
      if (random() % (4 * rare) == 0) v = std::nanf("");
    }
    std::vector<float> out(cells, 7), expected = out;
    std::vector<std::uint8_t> valid(cells), expected_valid(cells);
    for (auto& v : valid) v = static_cast<std::uint8_t>(random() % 2);
    expected_valid = valid;
    bool any = false;
    for (std::size_t i = 0; i < cells; ++i) {
      const float v = row[i * step];
      if (std::isnan(v) || v == -9999.0f) continue;
      expected[i] = v;
      expected_valid[i] = 1;
      any = true;
    }
    const NodataRule rule = NodataRule::parse("-9999", ScalarType::f32);
    const bool got =
        overlay_row(ScalarType::f32, {reinterpret_cast<const std::byte*>(row.data()), step, cells},
                    rule, reinterpret_cast<std::byte*>(out.data()), valid.data());
    ASSERT_EQ(got, any);
    ASSERT_EQ(out, expected);
    ASSERT_EQ(valid, expected_valid);
  }
}

}  // namespace
}  // namespace terrace::stream
