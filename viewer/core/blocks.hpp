// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene.hpp"

namespace terrace::viewer {

/// An array that tracks which blocks of slots have changed.
template <class Value>
class Blocks {
 public:
  void reserve(std::size_t slots) { values_.reserve(slots); }
  /// Grows to at least `slots`. Added blocks count as changed.
  void grow(std::size_t slots) {
    const std::size_t blocks = (slots + SceneChanges::kBlock - 1) / SceneChanges::kBlock;
    if (blocks * SceneChanges::kBlock <= values_.size()) return;
    values_.resize(blocks * SceneChanges::kBlock);
    for (std::size_t b = marked_.size(); b < blocks; ++b)
      changed_.push_back(static_cast<std::uint32_t>(b));
    marked_.resize(blocks, true);
  }
  Value& change(std::uint32_t slot) {
    const std::size_t block = slot / SceneChanges::kBlock;
    if (!marked_[block]) {
      marked_[block] = true;
      changed_.push_back(static_cast<std::uint32_t>(block));
    }
    return values_[slot];
  }
  const Value& operator[](std::uint32_t slot) const { return values_[slot]; }
  [[nodiscard]] std::size_t size() const { return values_.size(); }
  void take(std::vector<std::uint32_t>& blocks, std::vector<Value>& values) {
    std::sort(changed_.begin(), changed_.end());
    blocks.clear();
    values.clear();
    for (const std::uint32_t block : changed_) {
      marked_[block] = false;
      blocks.push_back(block);
      const auto begin =
          values_.begin() + static_cast<std::ptrdiff_t>(block * SceneChanges::kBlock);
      values.insert(values.end(), begin, begin + SceneChanges::kBlock);
    }
    changed_.clear();
  }

 private:
  std::vector<Value> values_;
  std::vector<bool> marked_;
  std::vector<std::uint32_t> changed_;
};

}  // namespace terrace::viewer
