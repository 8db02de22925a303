// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <vector>

#include "mesh.hpp"

namespace terrace::tri::spatial {

/// Enumerates the tetrahedra around a vertex, including ghosts, breadth-first. It keeps marks in
/// its own hash table, so that concurrent readers can each have one.
template <class Kernel>
class Star {
 public:
  Star() = default;
  Star(const Mesh<Kernel>& mesh, std::uint32_t vertex) { start(mesh, vertex); }

  /// Starts at another vertex and reuses the memory.
  void start(const Mesh<Kernel>& mesh, std::uint32_t vertex) {
    mesh_ = &mesh;
    vertex_ = vertex;
    at_ = 0;
    found_.clear();
    table_.assign(64, kNone);
    add(mesh.vertex[vertex].incident);
  }

  /// The next tetrahedron, or kNone after the last.
  std::uint32_t next() {
    if (at_ == found_.size()) return kNone;
    const std::uint32_t t = found_[at_++];
    const Tetrahedron& tetrahedron = mesh_->tetrahedron[t];
    for (std::size_t i = 0; i < 4; ++i)
      if (tetrahedron.corner[i] != vertex_) add(tetrahedron_of(tetrahedron.mate[i]));
    return t;
  }

 private:
  void add(std::uint32_t t) {
    if (!enter(t)) return;
    found_.push_back(t);
    if (2 * found_.size() < table_.size()) return;
    table_.assign(2 * table_.size(), kNone);
    for (const std::uint32_t again : found_) enter(again);
  }
  bool enter(std::uint32_t t) {
    const std::size_t mask = table_.size() - 1;
    std::size_t i = t * 0x9E3779B1u >> 7 & mask;
    for (; table_[i] != kNone; i = (i + 1) & mask)
      if (table_[i] == t) return false;
    table_[i] = t;
    return true;
  }

  const Mesh<Kernel>* mesh_ = nullptr;
  std::uint32_t vertex_ = kNone;
  std::vector<std::uint32_t> found_;
  std::vector<std::uint32_t> table_;
  std::size_t at_ = 0;
};

}  // namespace terrace::tri::spatial
