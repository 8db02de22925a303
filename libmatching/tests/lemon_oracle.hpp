// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

/// LEMON's blossom algorithm as an oracle. LEMON's headers do not compile as C++20, so this header
/// hides them and lemon_oracle.cpp is compiled as C++17.
class LemonOracle {
 public:
  struct Edge {
    std::uint32_t i, j;
    std::int64_t weight;
  };

  LemonOracle(std::uint32_t vertex_count, const std::vector<Edge>& edges);
  ~LemonOracle();
  LemonOracle(const LemonOracle&) = delete;
  LemonOracle& operator=(const LemonOracle&) = delete;

  /// Returns whether there is a perfect matching and, if so, stores its least weight in `cost`.
  bool solve(std::int64_t& cost);

 private:
  struct Graph;
  std::unique_ptr<Graph> graph_;
};
