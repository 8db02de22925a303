// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "terrace/cluster/hierarchy.hpp"

/// A sink that keeps the whole hierarchy in memory.

namespace terrace::cluster {

/// A ClusteredBlock that owns its data.
struct RecordedBlock {
  unsigned level = 0;
  std::uint64_t block = 0;
  std::vector<Point3> positions;
  std::vector<std::byte> payload;
  std::vector<std::uint64_t> children;
  std::vector<std::uint32_t> first, order, representatives;
  std::vector<ClusterSummary> summaries;

  RecordedBlock() = default;
  explicit RecordedBlock(const ClusteredBlock& b)
      : level(b.level),
        block(b.block),
        positions(b.positions.begin(), b.positions.end()),
        payload(b.payload.begin(), b.payload.end()),
        children(b.children.begin(), b.children.end()),
        first(b.first.begin(), b.first.end()),
        order(b.order.begin(), b.order.end()),
        representatives(b.representatives.begin(), b.representatives.end()),
        summaries(b.summaries.begin(), b.summaries.end()) {}

  friend bool operator==(const RecordedBlock&, const RecordedBlock&) = default;

  /// Returns the input index of point i, if payloads are those of numbered_payload().
  [[nodiscard]] std::uint64_t id(std::size_t i) const {
    std::uint64_t id = 0;
    std::memcpy(&id, payload.data() + sizeof id * i, sizeof id);
    return id;
  }
  [[nodiscard]] std::span<const std::uint32_t> members(std::size_t c) const {
    return std::span(order).subspan(first[c], first[c + 1] - first[c]);
  }
};

/// Returns eight bytes per point that hold its input index.
inline std::vector<std::byte> numbered_payload(std::size_t begin, std::size_t end) {
  std::vector<std::byte> payload((end - begin) * sizeof(std::uint64_t));
  for (std::uint64_t i = begin; i < end; ++i) {
    std::memcpy(payload.data() + sizeof i * (i - begin), &i, sizeof i);
  }
  return payload;
}

class RecordingSink : public HierarchySink {
 public:
  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    ++calls;
    auto copy = std::make_unique<Copy>();
    copy->block = RecordedBlock(block);
    return copy;
  }

  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override {
    ++calls;
    EXPECT_FALSE(committing_.exchange(true)) << "two commits ran at once";
    RecordedBlock& block = dynamic_cast<Copy&>(*prepared).block;
    EXPECT_EQ(block.level, level);
    if (levels.size() <= level) levels.resize(level + 1);
    EXPECT_EQ(block.block, levels[level].size()) << "blocks are out of order on level " << level;
    levels[level].push_back(std::move(block));
    committing_ = false;
  }

  void root(const ClusteredBlock& block) override {
    ++calls;
    EXPECT_FALSE(has_root) << "root() was called twice";
    has_root = true;
    top = RecordedBlock(block);
  }

  std::vector<std::vector<RecordedBlock>> levels;
  RecordedBlock top;
  bool has_root = false;
  std::atomic<int> calls = 0;

 private:
  struct Copy : Prepared {
    RecordedBlock block;
  };
  std::atomic<bool> committing_ = false;
};

}  // namespace terrace::cluster
