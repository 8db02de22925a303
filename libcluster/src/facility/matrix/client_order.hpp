// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "facility/matrix/cost_rows.hpp"

namespace terrace::cluster {

/// All facilities for every client by ascending cost, with ties by ascending number.
/// Throws: std::invalid_argument if memory cannot be allocated. The message gives the bytes needed.
class ClientOrder {
 public:
  explicit ClientOrder(const MatrixRows& costs);

  [[nodiscard]] std::size_t facilities() const { return facilities_; }
  [[nodiscard]] std::size_t clients() const { return cost_.size() / facilities_; }
  [[nodiscard]] const double* cost(std::size_t client) const {
    return cost_.data() + client * facilities_;
  }
  [[nodiscard]] const std::uint32_t* facility(std::size_t client) const {
    return facility_.data() + client * facilities_;
  }

 private:
  std::size_t facilities_;
  std::vector<double> cost_;
  std::vector<std::uint32_t> facility_;
};

}  // namespace terrace::cluster
