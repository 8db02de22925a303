// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "hole.hpp"
#include "samples.hpp"
#include "tin/refinement.hpp"

namespace terrace::tri::tin::points {

using PointRefinement = Refinement<PointSamples>;

struct Measured {
  TinErrors errors;         ///< covered: samples listed and vertices; uncovered: samples outside
  std::size_t above = 0;    ///< samples beyond the bound
  std::size_t to_mend = 0;  ///< samples beyond the bound that may become vertices
  /// The triangles with samples to insert, neighbours close to each other.
  std::vector<std::uint32_t> waiting;
};

/// Rebuilds all lists from the samples 0, step, 2 * step, ... that are not vertices, each in the
/// triangle that contains it (exact), and measures them. `place` and `error` of a triangle become
/// those of its worst sample that is beyond the bound and not stuck; `error` is 0 if there is none.
Measured list_samples(PointRefinement& refinement, std::uint32_t step);

/// Gives the same result for all samples from lists that are complete, several times as fast: each
/// sample is checked exactly against the triangle that lists it.
Measured measure_lists(PointRefinement& refinement);

/// Passes once over the samples 0, step, 2 * step, ... in their order. Each sample that is beyond
/// the bound when its turn comes becomes a vertex, if it can. This is several times as fast as
/// refine() per vertex, as no lists are kept, and makes more vertices; removal leaves about as
/// many. Later vertices may move the surface away from samples that were passed. The lists must be
/// rebuilt afterwards.
void sweep(PointRefinement& refinement, std::uint32_t step);

}  // namespace terrace::tri::tin::points
