// SPDX-License-Identifier: Apache-2.0
#include "base/units.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "base/decimal_multiples.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

TEST(ParseMemory, TakesPowersOf1024) {
  EXPECT_EQ(parse_memory("256M"), 256u << 20);
  EXPECT_EQ(parse_memory("256MiB"), 256u << 20);
  EXPECT_EQ(parse_memory("2G"), std::uint64_t{2} << 30);
  EXPECT_EQ(parse_memory("1.5k"), 1536u);
  EXPECT_EQ(parse_memory("4096"), 4096u);
  EXPECT_EQ(parse_memory("4096B"), 4096u);
  EXPECT_EQ(parse_memory("0"), 0u);
}

TEST(ParseMemory, RejectsInvalidAmounts) {
  for (const char* text : {"", "M", "-1M", "12X", "1e30", "256 M", "nan", "inf", "12MM", "iB"}) {
    EXPECT_THROW(parse_memory(text), UsageError) << text;
  }
}

TEST(ParseCount, TakesPowersOf1000AndBigIntegers) {
  EXPECT_EQ(parse_count("250000"), 250000u);
  EXPECT_EQ(parse_count("10k"), 10000u);
  EXPECT_EQ(parse_count("2.5M"), 2500000u);
  EXPECT_EQ(parse_count("9007199254740993"), 9007199254740993u);  // not a double
  for (const char* text : {"", "-3", "1.5", "k", "10kk", "0x10"}) {
    EXPECT_THROW(parse_count(text), UsageError) << text;
  }
}

TEST(ParseSize, NeedsTwoPositiveNumbers) {
  EXPECT_EQ(parse_size("1600x1200"), (ImageSize{1600, 1200}));
  for (const char* text : {"", "1600", "x", "0x5", "5x0", "5x", "5x6x7", "-5x5", "5x99999999999"}) {
    EXPECT_THROW(parse_size(text), UsageError) << text;
  }
}

TEST(ParseNumbers, AcceptsSignsAndRejectsGaps) {
  EXPECT_EQ(parse_numbers("-1.5,2e3,+4", "x"), (std::vector<double>{-1.5, 2000, 4}));
  for (const char* text : {"", "1,", ",1", "1,,2", "1;2", "1,nan", "1,inf", "1 2"}) {
    EXPECT_THROW(parse_numbers(text, "x"), UsageError) << text;
  }
}

TEST(Readable, FormatsBriefly) {
  EXPECT_EQ(with_commas(0), "0");
  EXPECT_EQ(with_commas(999), "999");
  EXPECT_EQ(with_commas(1000), "1,000");
  EXPECT_EQ(with_commas(12345678), "12,345,678");
  EXPECT_EQ(counted(0, "tile"), "0 tiles");
  EXPECT_EQ(counted(1, "tile"), "1 tile");
  EXPECT_EQ(counted(1234, "level"), "1,234 levels");
  EXPECT_EQ(counted(1, "vertex") + " of " + counted(2, "vertex"), "1 vertex of 2 vertices");
  EXPECT_EQ(counted(4, "tetrahedron"), "4 tetrahedra");
  EXPECT_EQ(counted(2, "entry"), "2 entries");
  EXPECT_EQ(counted(1, "sample", "is", "are") + " here", "1 sample is here");
  EXPECT_EQ(counted(0, "sample", "is", "are"), "0 samples are");
  EXPECT_EQ(readable_bytes(12), "12 bytes");
  EXPECT_EQ(readable_bytes(256u << 20), "256 MiB");
  EXPECT_EQ(readable_bytes((std::uint64_t{3} << 30) + (std::uint64_t{1} << 28)), "3.25 GiB");
  EXPECT_EQ(readable_rate(12.3e6), "12.3 M/s");
  EXPECT_EQ(readable_rate(999.9), "1 k/s");
  EXPECT_EQ(readable_number(2.9912345678), "2.99");
  EXPECT_EQ(readable_number(-1834.68), "-1,835");
  EXPECT_EQ(readable_number(999.6), "1,000");
  EXPECT_EQ(readable_number(0.000123456), "0.000123");
  EXPECT_EQ(readable_number(0), "0");
  EXPECT_EQ(readable_number(4345.678912, 6), "4345.68");
  EXPECT_EQ(readable_number(405204, 6), "405,204");
  EXPECT_EQ(readable_number(-1e20), "-1e+20");
  EXPECT_EQ(readable_number(5195200.125, 10), "5195200.125");
  EXPECT_EQ(readable_number(12345678901.6, 10), "12345678902");
  EXPECT_EQ(readable_bound(2.9801), "2.99");
  EXPECT_EQ(readable_bound(2.99), "2.99");
  EXPECT_EQ(readable_bound(2.9999), "3");
  EXPECT_EQ(readable_bound(0.0001231), "0.000124");
  EXPECT_EQ(readable_bound(1234.2), "1,235");
  EXPECT_EQ(readable_bound(0), "0");
  EXPECT_EQ(readable_seconds(0.84), "0.8 s");
  EXPECT_EQ(readable_seconds(245), "4:05");
  EXPECT_EQ(readable_seconds(3723), "1:02:03");
}

TEST(PlainNumber, AvoidsExponents) {
  EXPECT_EQ(plain_number(5e5), "500000");
  EXPECT_EQ(plain_number(-1.5e-5), "-0.000015");
  EXPECT_EQ(plain_number(0.1), "0.1");
  EXPECT_EQ(plain_number(0), "0");
  EXPECT_EQ(plain_number(123456789.125), "123456789.125");
  EXPECT_EQ(plain_number(1e300), "1e+300");
  EXPECT_EQ(plain_number(-3e38), "-3e+38");
  EXPECT_EQ(plain_number(NAN), "nan");
}

TEST(NumberText, ReadsBackAsTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3.0, 1e300, -2.5e-308, 123456789.125}) {
    EXPECT_EQ(std::stod(number_text(value)), value);
  }
}

// Oracle: the decimal text of the product, read as a double.
TEST(DecimalMultiples, AreNearestDoublesToDecimalProducts) {
  EXPECT_EQ(number_text(DecimalMultiples(0.1)(std::int64_t{3})), "0.3");
  EXPECT_EQ(number_text(DecimalMultiples(0.1)(std::int64_t{-6})), "-0.6");
  EXPECT_EQ(number_text(DecimalMultiples(0.7)(std::int64_t{3})), "2.1");
  EXPECT_EQ(number_text(DecimalMultiples(1e-22)(std::int64_t{7})), "7e-22");
  for (std::int64_t i = -2000; i <= 2000; ++i) {
    EXPECT_EQ(DecimalMultiples(0.01)(i), std::stod(std::to_string(i) + "e-2"));
    EXPECT_EQ(DecimalMultiples(0.00025)(i), std::stod(std::to_string(25 * i) + "e-5"));
    EXPECT_EQ(DecimalMultiples(12.35)(i), std::stod(std::to_string(1235 * i) + "e-2"));
  }
  // For steps without a short decimal, integers and huge counts, the result is the product of the
  // doubles.
  for (const double step : {1.0 / 3.0, 20.0, 1e300, 5e-324, 2.5e18}) {
    EXPECT_EQ(DecimalMultiples(step)(std::int64_t{1}), step);
    EXPECT_EQ(DecimalMultiples(step)(std::int64_t{5}), 5 * step);
  }
  EXPECT_EQ(DecimalMultiples(0.1)(0x1p53), 0x1p53 * 0.1);
}

}  // namespace
}  // namespace terrace::terrain
