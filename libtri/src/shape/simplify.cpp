// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <stdexcept>
#include <string>

#include "collapse_order.hpp"
#include "shrinking_surface.hpp"
#include "terrace/tri/surface_simplification.hpp"

namespace terrace::tri {

SimplifiedSurface simplify_surface(const Surface& surface, const SimplificationOptions& options) {
  if (!(options.max_error >= 0.0)) {
    throw std::invalid_argument("max_error is " + std::to_string(options.max_error) +
                                ", but must not be negative");
  }
  shape::check_shrinkable(surface);
  shape::CollapseRule rule;
  shape::CollapseOrder order(surface, options.max_error, rule, options.check_stop);
  double largest = 0.0;
  while (order.surface().vertices() > options.max_points) {
    const auto step = order.next();
    if (!step) break;
    largest = step->error;
  }
  SimplifiedSurface out = order.surface().result(surface);
  out.max_distance = std::min(largest, options.max_error);
  return out;
}

}  // namespace terrace::tri
