// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

namespace terrace::tri {

/// Number of vertices of a mesh with this bound. It decreases, at least nearly, as the bound grows.
using VertexCount = std::function<double(double bound)>;

struct LeastErrorSearch {
  std::uint64_t max_vertices = 0;
  double least = 0.0;  ///< smallest bound that is tried
  double range = 0.0;  ///< of heights, >= least. Greater bounds make no difference
  /// A quick estimate. It may be wrong by a factor, as long as that factor varies little. Optional.
  VertexCount estimate;
  /// Makes the mesh. May stop and return an estimate once there are more than `max_vertices`
  /// vertices.
  VertexCount run;
};

/// Searches for the least error bound whose mesh has at most `max_vertices` vertices. The last call
/// of run() uses the bound that was found. Its mesh has at least 98 % of `max_vertices` vertices,
/// or the search has tried a bound at most 0.2 % smaller that gave more. Usually takes two or three
/// runs with a good estimate, about six without. Returns false if even the flattest mesh has too
/// many vertices.
bool least_error(const LeastErrorSearch& search);

}  // namespace terrace::tri
