// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// In Vertex::incident during bulk construction: the point was there already, the other bits are
/// the vertex that stands for it.
inline constexpr std::uint32_t kAlias = kFreeVertexBit;

/// Inserts vertex slots `going` (sorted, then in any order) of begin, ..., end - 1, which follow
/// each other along a curve, by at most two threads at once. The result, slots included, does not
/// depend on their number.
template <class Kernel>
void insert_in_parts(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end,
                     std::span<std::uint32_t> going, unsigned threads);

/// Inserts one, near mesh.last_vertex.
template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex);

}  // namespace terrace::tri::spatial
