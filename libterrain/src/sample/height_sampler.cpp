// SPDX-License-Identifier: GPL-3.0-or-later
#include "sample/height_sampler.hpp"

#include "base/units.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

tri::Interpolation parse_interpolation(const std::string& text) {
  if (text == "linear") return tri::Interpolation::kLinear;
  if (text == "natural") return tri::Interpolation::kNaturalNeighbour;
  if (text == "nearest") return tri::Interpolation::kNearest;
  throw UsageError("'" + text + "' is no --method; write linear, natural or nearest");
}

std::unique_ptr<HeightSampler> make_sampler(const stream::Store& store,
                                            const SamplerOptions& options) {
  if (options.level > store.top()) {
    throw UsageError("the store has no level " + std::to_string(options.level) +
                     ": its top is level " + std::to_string(store.top()));
  }
  if (!store.schema().grid || options.level > 0) return make_point_sampler(store, options);
  if (options.max_edge) {
    throw UsageError(
        "--max-edge is for irregular points and coarser levels: the samples of a "
        "raster say themselves where there is no data");
  }
  return make_lattice_sampler(store, options);
}

}  // namespace terrace::terrain
