// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "facility/matrix/cost_rows.hpp"
#include "facility/points/fast_distances.hpp"
#include "facility/points/search_frame.hpp"
#include "facility/points/search_space.hpp"
#include "facility/points/space_choice.hpp"

namespace terrace::cluster {

/// Returns how far costs of the frame, summed over all clients, may differ from those of the given
/// coordinates. Scaling and mapping coordinates rounds by units in the last place of the box, even
/// if a distance is short.
[[nodiscard]] double rounding_of_frame(const FacilityPoints& problem, const SearchFrame& frame);

/// Weighted distances, computed row by row and capped at each client's outlier price.
template <class Space>
class PointRows final : public CostRows {
 public:
  PointRows(const Space& space, std::span<const double> weights, double price,
            const base::StopCheck& check_stop)
      : CostRows(weights.size(), weights.size(), check_stop),
        space_(&space),
        distances_(space),
        weights_(weights),
        price_(price) {}

  const double* row(std::size_t facility, std::vector<double>& scratch) const override {
    check_stop();
    const auto count = static_cast<std::uint32_t>(clients());
    scratch.resize(count);
    distances_.row(static_cast<std::uint32_t>(facility)).fill(count, scratch.data());
    for (std::uint32_t i = 0; i < count; ++i) {
      scratch[i] = weights_[i] * std::min(scratch[i], price_);
    }
    return scratch.data();
  }
  void gather(std::size_t facility, std::span<const std::uint32_t> clients,
              double* out) const override {
    check_stop();
    const auto row = space_->row(static_cast<std::uint32_t>(facility));
    for (std::size_t k = 0; k < clients.size(); ++k) {
      out[k] = weights_[clients[k]] * std::min(row(clients[k]), price_);
    }
  }

 private:
  const Space* space_;
  FastDistances<Space> distances_;
  std::span<const double> weights_;
  double price_;
};

}  // namespace terrace::cluster
