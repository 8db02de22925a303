// SPDX-License-Identifier: Apache-2.0
#include "block/linear_block.hpp"

#include <algorithm>
#include <limits>

#include "facility/points/search_frame.hpp"
#include "scaling.hpp"

namespace terrace::cluster {

void run_linear(BlockClusterer& clusterer, const FacilityPoints& problem, BlockOptions options,
                BlockClustering& result) {
  const SearchFrame frame = make_frame(problem);
  // The clusterer multiplies the facility cost by the diagonal of the box of the mapped points. The
  // problem means the diagonal of the mapped box, which is longer if the map rotates.
  const Scaling scaling(frame.points);
  if (scaling.diagonal > 0.0) {
    options.facility_cost = std::clamp(frame.facility_cost / scaling.unscaled(scaling.diagonal),
                                       std::numeric_limits<double>::min(), 0x1p1000);
  }
  clusterer.run(frame.points, frame.weights, options, result);
}

}  // namespace terrace::cluster
