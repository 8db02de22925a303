// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// Set in Vertex::incident during bulk construction if the point is a duplicate. The other bits are
/// the vertex that represents it.
inline constexpr std::uint32_t kAlias = kFreeVertexBit;

/// Vertices begin, ..., end - 1 follow each other along a curve. Of these begin + step, begin + 2
/// step, ... are present or about to be inserted.
struct Curve {
  std::uint32_t begin, end, step;
};

/// Inserts vertex slots `going` (sorted; afterwards in any order) of a curve, with at most two
/// concurrent threads. The result, slots included, does not depend on the number of threads.
template <class Kernel>
void insert_in_parts(Mesh<Kernel>& mesh, const Curve& curve, std::span<std::uint32_t> going,
                     unsigned threads);

/// Inserts one vertex, walking from the vertex `hint`.
template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t hint);

}  // namespace terrace::tri::spatial
