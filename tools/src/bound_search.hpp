// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>

namespace terrace::tools {

/// What is looked for: the smallest bound with at most `most` vertices.
struct BoundSearch {
  std::uint64_t most = 0;
  double range = 0.0;  ///< of heights: a larger bound cannot need fewer
  double start = 0.0;  ///< a guess
};

/// A bound whose mesh has at most search.most vertices and, where it can, 98 % of them. run(bound)
/// makes the mesh and returns its number of vertices, or any number above `most` if it has more.
/// The last call of it was with the bound that is returned. Negative: `most` are too few for any
/// bound. Up to 24 runs, about five from a good guess.
double search_bound(const BoundSearch& search,
                    const std::function<std::uint64_t(double bound)>& run);

}  // namespace terrace::tools
