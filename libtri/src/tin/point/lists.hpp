// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

struct Measured {
  TinErrors errors;         ///< of samples listed and of vertices; uncovered: those outside
  std::size_t above = 0;    ///< samples beyond the bound
  std::size_t to_mend = 0;  ///< of these, such as may become vertices
  /// The triangles with such samples, neighbours near each other.
  std::vector<std::uint32_t> waiting;
};

/// Makes all lists anew, of the samples 0, step, 2 * step, ... that are no vertices, each in the
/// triangle that contains it (exact), and measures them: `place` and `error` of a triangle become
/// those of its worst sample that is beyond the bound and not stuck (0: none).
Measured list_samples(Mesh& mesh, std::uint32_t step, double bound);

/// As Triangle::error: at least `error`, above 0, finite.
float rounded_up(double error);

}  // namespace terrace::tri::tin::points
