// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "facility/matrix/client_order.hpp"

namespace terrace::cluster {

/// Erlenkotter's procedure, which improves feasible duals.
class DualAscent {
 public:
  /// Starts from the least cost of each client. Takes O(facilities * clients).
  DualAscent(const ClientOrder& order, const MatrixRows& costs);

  /// Raises the duals of these clients in turn until none can be raised. Like adjust(), throws
  /// whatever the stop check of the costs throws.
  void raise(std::span<const std::uint32_t> clients);
  /// Makes one round of dual adjustment. Returns whether the sum of the duals has grown.
  bool adjust();

  [[nodiscard]] const std::vector<double>& duals() const { return duals_; }
  [[nodiscard]] double total() const;

 private:
  struct State {
    std::vector<double> duals, slack;
    std::vector<std::uint32_t> reach;
  };

  bool raise_one(std::uint32_t client);
  void lower_one(std::uint32_t client);
  void find_support();
  [[nodiscard]] std::uint32_t payments(std::uint32_t client, std::uint32_t (&two)[2]) const;

  const ClientOrder* order_;
  const MatrixRows* costs_;
  std::vector<double> duals_;
  std::vector<double> slack_;         // opening cost minus payments, by facility
  std::vector<std::uint32_t> reach_;  // per client: number of facilities that cost at most its dual
  std::vector<std::uint32_t> all_;
  std::vector<char> tight_;    // by facility: its slack is used up
  std::vector<char> support_;  // by facility: in a small tight set that reaches every client
};

}  // namespace terrace::cluster
