// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/aim_within.hpp"

#include <terrace/stream/error.hpp>

#include "base/units.hpp"

namespace terrace::terrain {

Aim aim_within(double bound, const stream::MeshRounding& rounding, const std::string& path) {
  const stream::Point3& moved = rounding.largest();
  if (moved == stream::Point3{}) return {bound, bound};
  const double sure = bound * (15.0 / 16.0) - moved[2];
  if (!(sure >= 0.0)) {
    throw stream::Error({.file = path,
                         .where = {},
                         .cause = "its format rounds heights by up to " +
                                  readable_number(moved[2]) + ", too much for this `max_error`",
                         .remedy = "write PLY, which is exact"});
  }
  return {bound * (255.0 / 256.0) - moved[2], sure};
}

}  // namespace terrace::terrain
