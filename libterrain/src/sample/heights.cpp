// SPDX-License-Identifier: Apache-2.0
#include "base/stored_entities.hpp"
#include "sample/samplers.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

std::unique_ptr<HeightSampler> make_sampler(const stream::Store& given,
                                            const SamplerOptions& options, const Context& context) {
  need_points(given, "the height of a place");
  const stream::Store store = given.with_stop(context.stop);
  if (options.level > store.top()) {
    throw UsageError("the store has no level " + std::to_string(options.level) +
                     ": its top is level " + std::to_string(store.top()));
  }
  if (!store.schema().grid || options.level > 0) return make_point_sampler(store, options, context);
  if (options.max_edge) {
    throw UsageError(
        "`max_edge` is for irregular points and coarser levels: rasters mark missing data "
        "explicitly");
  }
  return make_lattice_sampler(store, options, context);
}

}  // namespace terrace::terrain
