// SPDX-License-Identifier: GPL-3.0-or-later
#include "sample/height_sampler.hpp"

#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

std::unique_ptr<HeightSampler> make_sampler(const stream::Store& store,
                                            const SamplerOptions& options) {
  if (options.level > store.top()) {
    throw UsageError("the store has no level " + std::to_string(options.level) +
                     ": its top is level " + std::to_string(store.top()));
  }
  if (!store.schema().grid || options.level > 0) return make_point_sampler(store, options);
  if (options.max_edge) {
    throw UsageError(
        "`max_edge` is for irregular points and coarser levels: rasters mark missing data "
        "explicitly");
  }
  return make_lattice_sampler(store, options);
}

}  // namespace terrace::terrain
