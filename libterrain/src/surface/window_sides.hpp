// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace terrace::terrain {

/// A vertex on a side of a window.
struct SideVertex {
  double at = 0.0;  ///< position along the side
  double height = 0.0;
};
/// Ascending, the ends of the side included.
using SideVertices = std::vector<SideVertex>;

/// The vertices on the sides of windows, which are the same for the windows on both sides. Computes
/// them on first use. Thread-safe.
template <class Key>
class WindowSides {
 public:
  /// With a limit, at most twice `max_vertices` and two sides are kept; the oldest are dropped.
  explicit WindowSides(std::size_t max_vertices = std::numeric_limits<std::size_t>::max())
      : max_vertices_(max_vertices) {}

  /// Returns the vertices of a side. If they are unknown, settle() returns them. It must depend
  /// only on the side, because several threads may call it at once.
  template <class Settle>
  std::shared_ptr<const SideVertices> vertices(const Key& side, const Settle& settle) {
    if (auto cached = find(side)) return cached;
    auto settled = std::make_shared<const SideVertices>(settle());
    const std::lock_guard lock(mutex_);
    if (vertices_ > max_vertices_) {
      older_ = std::exchange(recent_, {});
      vertices_ = 0;
    }
    const auto [cached, fresh] = recent_.try_emplace(side, std::move(settled));
    if (fresh) vertices_ += cached->second->size();
    return cached->second;
  }
  /// Returns null for an unknown side.
  [[nodiscard]] std::shared_ptr<const SideVertices> find(const Key& side) const {
    const std::lock_guard lock(mutex_);
    for (const Sides* sides : {&recent_, &older_}) {
      if (const auto cached = sides->find(side); cached != sides->end()) return cached->second;
    }
    return nullptr;
  }
  /// Drops a side that no window needs any more.
  void drop(const Key& side) {
    const std::lock_guard lock(mutex_);
    if (const auto cached = recent_.find(side); cached != recent_.end()) {
      vertices_ -= cached->second->size();
      recent_.erase(cached);
    }
    older_.erase(side);
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    recent_.clear();
    older_.clear();
    vertices_ = 0;
  }

 private:
  using Sides = std::map<Key, std::shared_ptr<const SideVertices>>;
  std::size_t max_vertices_;
  mutable std::mutex mutex_;
  Sides recent_, older_;
  std::size_t vertices_ = 0;  ///< number of vertices in recent_
};

}  // namespace terrace::terrain
