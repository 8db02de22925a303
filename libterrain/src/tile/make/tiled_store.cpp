// SPDX-License-Identifier: Apache-2.0
#include "tile/make/tiled_store.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/base/portable_math.hpp>

#include "earth/ground.hpp"

namespace terrace::terrain {

double TiledStore::rim_of_outline() const {
  const stream::StoreSchema& schema = store.schema();
  const stream::Box3 box = world_box(schema, store.bounds());
  const double fall = vertical.metres_per_unit() * std::max(std::abs(box.min[2] - height_beyond()),
                                                            std::abs(box.max[2] - height_beyond()));
  const GroundMap metres = Ground(schema).map(store.bounds());
  const double unit =
      std::min(base::hypot(metres[0], metres[3]), base::hypot(metres[1], metres[4]));
  const double share = unit > 0.0 ? fall / (8 * unit) : 0.0;
  const double rim = schema.grid ? std::max(1.5, share) : share;
  if (!(rim > 0.0) || !std::isfinite(rim)) return 0.0;
  // A power of four, so that tiles rarely have to be rebuilt when other heights change.
  int exponent = 0;
  const double mantissa = std::frexp(rim, &exponent);
  if (mantissa == 0.5) --exponent;
  return std::ldexp(1.0, exponent + (exponent % 2 != 0 ? 1 : 0));
}

}  // namespace terrace::terrain
