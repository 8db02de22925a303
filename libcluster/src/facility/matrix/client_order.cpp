// SPDX-License-Identifier: Apache-2.0
#include "facility/matrix/client_order.hpp"

#include <algorithm>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>

namespace terrace::cluster {

ClientOrder::ClientOrder(const MatrixRows& costs) : facilities_(costs.facilities()) {
  const std::size_t m = facilities_, n = costs.clients();
  try {
    cost_.reserve(m * n);
    facility_.reserve(m * n);
  } catch (const std::bad_alloc&) {
    throw std::invalid_argument("facility costs sorted by client would need " +
                                std::to_string(12 * m * n) +
                                " bytes, more than available: cluster the points instead "
                                "(FacilityPoints), or in blocks");
  }
  std::vector<double> column(m);
  for (std::size_t i = 0; i < n; ++i) {
    costs.check_stop();
    for (std::size_t j = 0; j < m; ++j) column[j] = costs.cost(j, i);
    facility_.resize((i + 1) * m);
    std::uint32_t* const order = facility_.data() + i * m;
    std::iota(order, order + m, 0u);
    std::sort(order, order + m, [&](std::uint32_t a, std::uint32_t b) {
      return column[a] < column[b] || (column[a] == column[b] && a < b);
    });
    for (std::size_t r = 0; r < m; ++r) cost_.push_back(column[order[r]]);
  }
}

}  // namespace terrace::cluster
