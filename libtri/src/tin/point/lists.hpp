// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

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
Measured list_samples(Mesh& mesh, std::uint32_t step, double bound);

/// Gives the same result for all samples from lists that are complete, several times as fast: each
/// sample is checked exactly against the triangle that lists it.
Measured measure_lists(Mesh& mesh, double bound);

}  // namespace terrace::tri::tin::points
