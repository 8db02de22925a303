// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "facility/matrix/cost_rows.hpp"

namespace terrace::cluster {

/// The nearest and the second nearest open facility of every client. The cost of closing a facility
/// is then a sum of differences.
class NearestOpen {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  explicit NearestOpen(const CostRows& costs);

  /// Opens exactly these facilities. Takes O(clients * open).
  void reset(std::span<const std::uint32_t> open);
  /// Requires: the facility is closed. Takes O(clients).
  void open(std::uint32_t facility);
  /// Requires: the facility is open. Takes O(clients + clients for which it was one of the two *
  /// open).
  void close(std::uint32_t facility);

  [[nodiscard]] bool is_open(std::uint32_t facility) const { return position_[facility] != kNone; }
  [[nodiscard]] std::span<const std::uint32_t> facilities() const { return open_; }
  /// One value per client; kNone and infinity if too few facilities are open.
  [[nodiscard]] std::span<const std::uint32_t> first() const { return first_; }
  [[nodiscard]] std::span<const double> first_cost() const { return first_cost_; }
  [[nodiscard]] std::span<const double> second_cost() const { return second_cost_; }
  [[nodiscard]] double connection_cost() const;

 private:
  void take(std::uint32_t facility);

  const CostRows* costs_;
  std::vector<std::uint32_t> open_;
  std::vector<std::uint32_t> position_;  // by facility: position in open_
  std::vector<std::uint32_t> first_, second_;
  std::vector<double> first_cost_, second_cost_;
  std::vector<double> scratch_, gathered_;
  std::vector<std::uint32_t> orphans_;
};

}  // namespace terrace::cluster
