// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <terrace/base/ordered_work.hpp>
#include <terrace/stream/point.hpp>

/// Meshes a large region window by window. Neighbours have the same vertices on the side between
/// them (see WindowSides), so their meshes fit together.

namespace terrace::terrain {

/// A vertex on a side of a window, which its neighbours there may also have.
struct SharedVertex {
  std::uint32_t vertex = 0;  ///< index in the window's mesh
  std::uint64_t place = 0;   ///< names the vertex in all windows that share it
  /// The last window that may have it.
  std::size_t last = std::numeric_limits<std::size_t>::max();
};

/// The mesh of one window.
template <class Vertex>
struct WindowMesh {
  std::vector<Vertex> vertices;
  std::vector<SharedVertex> shared;  ///< ascending by vertex, each once
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Measurements of the mesh of one window, as a reader of its file, if any, decodes it.
struct WindowMeasures {
  double max_error = 0.0, rms_error = 0.0;
  std::uint64_t covered = 0;    ///< samples on triangles
  std::uint64_t samples = 0;    ///< counted in this window
  std::uint64_t uncovered = 0;  ///< of these, those on no triangle of any window
  std::uint64_t duplicates = 0;
  std::uint64_t work = 0;  ///< the window's share of the whole work
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// The mesh of one window, in the coordinates of its samples, measured.
struct BoundedWindow : WindowMesh<stream::Point3> {
  WindowMeasures measures;
};

/// Joins the meshes of windows into one mesh, in which a shared vertex is one vertex.
class WindowJoiner {
 public:
  /// Bound for a shared vertex that a later window may have.
  static constexpr std::uint64_t kBytesPerShared = 112;

  /// Changes the mesh of a window into its part of the joined mesh: drops the vertices of earlier
  /// windows and numbers the corners of triangles in the joined mesh. Windows come in order.
  template <class Vertex>
  void join(std::size_t window, WindowMesh<Vertex>& mesh) {
    std::vector<std::uint32_t> numbers;
    numbers.reserve(mesh.vertices.size());
    std::size_t kept = 0;
    auto shared = mesh.shared.begin();
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      auto number = static_cast<std::uint32_t>(vertices_ + kept);
      bool fresh = true;
      if (shared != mesh.shared.end() && shared->vertex == i) {
        const auto entry = open_.try_emplace(shared->place, Open{shared->last, number});
        number = entry.first->second.number;
        fresh = entry.second;
        ++shared;
      }
      numbers.push_back(number);
      if (fresh) mesh.vertices[kept++] = mesh.vertices[i];
    }
    mesh.vertices.resize(kept);
    mesh.shared.clear();
    for (auto& triangle : mesh.triangles) {
      for (std::uint32_t& corner : triangle) corner = numbers[corner];
    }
    vertices_ += kept;
    forget_until(window);
  }

 private:
  struct Open {
    std::size_t last = 0;
    std::uint32_t number = 0;
  };

  /// Drops vertices that no window after this one has, whenever they may be half of all.
  void forget_until(std::size_t window) {
    if (open_.size() < max_open_) return;
    std::erase_if(open_, [&](const auto& vertex) { return vertex.second.last <= window; });
    max_open_ = std::max(kFewOpen, 2 * open_.size());
  }

  static constexpr std::size_t kFewOpen = 4096;
  std::uint64_t vertices_ = 0;
  std::unordered_map<std::uint64_t, Open> open_;  ///< by place
  std::size_t max_open_ = kFewOpen;
};

/// Meshes windows with several threads and joins them in order. make(worker, i) returns the mesh of
/// window i. take(i, mesh) receives its part of the joined mesh, and may return false to end the
/// work. check_stop() is called before each window and ends the work by an exception.
template <class CheckStop, class Make, class Take>
void mesh_windows(std::size_t windows, unsigned threads, const CheckStop& check_stop,
                  const Make& make, const Take& take) {
  WindowJoiner joiner;
  base::in_order(
      windows, threads,
      [&](unsigned worker, std::size_t i) {
        check_stop();
        return make(worker, i);
      },
      [&](std::size_t i, auto&& mesh) {
        joiner.join(i, mesh);
        return take(i, std::forward<decltype(mesh)>(mesh));
      });
}

}  // namespace terrace::terrain
