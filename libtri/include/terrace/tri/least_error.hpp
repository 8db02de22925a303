// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

namespace terrace::tri {

/// How many vertices a mesh with this bound has. It falls, or nearly so, as the bound grows.
using VertexCount = std::function<double(double bound)>;

struct LeastErrorSearch {
  std::uint64_t most = 0;  ///< vertices
  double least = 0.0;      ///< no smaller bound is tried
  double range = 0.0;      ///< of heights, >= least: a greater bound makes no difference
  /// A quick estimate, which may be wrong by a factor as long as that varies little. Optional.
  VertexCount estimate;
  /// Makes the mesh. Beyond `most` it may stop and return an estimate.
  VertexCount run;
};

/// Searches the least error bound whose mesh has at most `most` vertices. The last call of run() is
/// that of the bound found: the mesh has at least 98 % of `most`, or the next smaller bound that
/// was tried, by 0.2 % at most, has more than `most`. Usually two or three runs with a good
/// estimate, else about six. Returns false if even the flattest mesh has more.
bool least_error(const LeastErrorSearch& search);

}  // namespace terrace::tri
