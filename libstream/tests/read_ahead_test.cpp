// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

/// Blocks of one point each, numbered; then the end, or an Error.
class Counting final : public PointSource {
 public:
  Counting(int blocks, bool fails, std::atomic<int>* made = nullptr)
      : blocks_(blocks), fails_(fails), made_(made) {
    info_.format = "counting";
  }
  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  bool next(PointBlock& block) override {
    block.clear();
    if (next_ == blocks_) {
      if (fails_) throw Error({.file = "x", .where = {}, .cause = "broken", .remedy = {}});
      return false;
    }
    block.positions.push_back({static_cast<double>(next_++), 0, 0});
    if (made_ != nullptr) *made_ = next_;
    return true;
  }
  [[nodiscard]] Progress progress() const override {
    return {.points = static_cast<std::uint64_t>(next_)};
  }

 private:
  int blocks_, next_ = 0;
  bool fails_;
  std::atomic<int>* made_;
  SourceInfo info_;
};

TEST(ReadAhead, DeliversTheSameStream) {
  for (const std::size_t ahead : {0u, 1u, 2u, 8u, 1000u}) {
    for (const int blocks : {0, 1, 7, 500}) {
      const auto source = read_ahead(std::make_unique<Counting>(blocks, false), ahead);
      EXPECT_EQ(source->info().format, "counting");
      PointBlock block;
      for (int i = 0; i < blocks; ++i) {
        ASSERT_TRUE(source->next(block));
        ASSERT_EQ(block.size(), 1u);
        ASSERT_EQ(block.positions[0][0], i);
        ASSERT_EQ(source->progress().points, static_cast<std::uint64_t>(i) + 1);
      }
      for (int again = 0; again < 3; ++again) {
        EXPECT_FALSE(source->next(block));
        EXPECT_TRUE(block.empty());
      }
    }
  }
}

TEST(ReadAhead, AnErrorComesInItsPlace) {
  const auto source = read_ahead(std::make_unique<Counting>(5, true), 3);
  PointBlock block;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(source->next(block));
  EXPECT_THROW(source->next(block), Error);
  EXPECT_THROW(source->next(block), Error);
}

TEST(ReadAhead, ReadsNoFurtherThanAskedAndStopsAtOnce) {
  std::atomic<int> made = 0;
  {
    const auto source = read_ahead(std::make_unique<Counting>(1 << 30, false, &made), 4);
    PointBlock block;
    ASSERT_TRUE(source->next(block));
  }
  EXPECT_LE(made, 1 + 4 + 1);
}

}  // namespace
}  // namespace terrace::stream
