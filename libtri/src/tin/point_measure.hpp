// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "point_mesh.hpp"

namespace terrace::tri::tin {

struct Measured {
  TinErrors errors;         ///< uncovered: 0
  std::size_t above = 0;    ///< samples beyond the bound
  std::size_t to_mend = 0;  ///< of these, such as can become vertices
};

/// Measures all listed samples; those that rounding dealt to the wrong triangle are first put into
/// the lists of the right ones (exact). Samples that are vertices count as without error.
Measured measure_lists(Mesh& mesh, double bound);

}  // namespace terrace::tri::tin
