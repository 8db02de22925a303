// SPDX-License-Identifier: GPL-3.0-or-later
#include "height_sampler.hpp"

#include "error.hpp"

namespace terrace::tools {

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
  if (store.schema().grid && options.level == 0) return make_lattice_sampler(store, options);
  throw UsageError(store.schema().grid
                       ? "heights between the points of a coarser level are not available yet: "
                         "leave --level out"
                       : "heights between points are not available yet, only those of rasters");
}

}  // namespace terrace::tools
