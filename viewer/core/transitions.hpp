// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <terrace/tri/geomorph.hpp>

#include "blocks.hpp"
#include "scene.hpp"

namespace terrace::viewer {

/// Removed triangles that are still drawn while their vertices slide onto their replacements, and
/// the replacements, which are hidden until then. Triangles that replace each other form a group.
///
/// Removed triangles are copied to spare slots before those of the model. Slot s of the model is
/// drawn at kVertices + s and kTriangles + s. Each step scans the lists of removed and hidden
/// triangles completely, in some tens of nanoseconds per triangle.
template <class Vertex>
class Transitions {
 public:
  static constexpr std::uint32_t kVertices = 1u << 14, kTriangles = 1u << 15;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  Transitions(Blocks<Vertex>& vertices, Blocks<SceneTriangle>& triangles)
      : vertices_(vertices), triangles_(triangles) {}

  [[nodiscard]] bool empty() const { return hidden_.empty() && triangles_drawn_.empty(); }
  [[nodiscard]] std::size_t vertex_room() const { return kVertices - anchors_.size(); }
  [[nodiscard]] std::size_t triangle_room() const { return kTriangles - triangles_drawn_.size(); }

  // ---- Groups, by numbers that are valid until sweep()

  /// Creates a group that lasts from `begin` to `end`, in seconds. Returns its number.
  [[nodiscard]] std::uint32_t open(double begin, double end) {
    groups_.push_back({begin, end, static_cast<std::uint32_t>(groups_.size()), false});
    return groups_.back().parent;
  }
  /// Merges two groups.
  void join(std::uint32_t a, std::uint32_t b) {
    Group &one = groups_[a = root(a)], &other = groups_[b = root(b)];
    one.begin = std::min(one.begin, other.begin);
    one.end = std::max(one.end, other.end);
    other.parent = a;
  }
  [[nodiscard]] double begin(std::uint32_t group) { return groups_[root(group)].begin; }
  /// Ends a group at the next sweep().
  void end(std::uint32_t group) { groups_[root(group)].ended = any_ended_ = true; }
  /// Ends the groups whose time is over at the next sweep().
  void end_until(double time) {
    for (std::uint32_t g = 0; g < groups_.size(); ++g) {
      if (groups_[g].parent == g && groups_[g].end <= time) end(g);
    }
  }
  /// Shows the hidden triangles of groups that have ended. Returns false if none has.
  bool sweep() {
    if (!any_ended_) return false;
    any_ended_ = false;
    std::vector<std::uint32_t> number(groups_.size(), kNone);
    std::vector<Group> remaining;
    const auto stays = [&](std::uint32_t& group) {
      const std::uint32_t g = root(group);
      if (groups_[g].ended) return false;
      if (number[g] == kNone) {
        number[g] = static_cast<std::uint32_t>(remaining.size());
        remaining.push_back(groups_[g]);
        remaining.back().parent = number[g];
      }
      group = number[g];
      return true;
    };
    std::size_t count = 0;
    for (Removed item : triangles_drawn_) {
      if (stays(item.group)) {
        triangles_drawn_[count++] = item;
      } else {
        triangles_.change(item.slot) = {};
        free_triangles_.put(item.slot);
      }
    }
    triangles_drawn_.resize(count);
    count = 0;
    for (std::size_t i = 0; i < anchors_.size(); ++i) {
      Removed item = vertices_drawn_[i];
      if (stays(item.group)) {
        anchors_[count] = anchors_[i];
        vertices_drawn_[count++] = item;
      } else {
        free_vertices_.put(item.slot);
      }
    }
    anchors_.resize(count);
    vertices_drawn_.resize(count);
    count = 0;
    for (Hidden hidden : hidden_) {
      if (hidden.slot == kNone) continue;
      if (stays(hidden.group)) {
        index_[hidden.slot] = static_cast<std::uint32_t>(count);
        hidden_[count++] = hidden;
      } else {
        index_[hidden.slot] = kNone;
        triangles_.change(hidden.slot) = hidden.corners;
      }
    }
    hidden_.resize(count);
    groups_ = std::move(remaining);
    return true;
  }

  // ---- Removed and hidden triangles

  /// Returns the group that hides a triangle, or kNone.
  [[nodiscard]] std::uint32_t hiding(std::uint32_t triangle) const {
    if (triangle >= index_.size() || index_[triangle] == kNone) return kNone;
    return hidden_[index_[triangle]].group;
  }
  void hide(std::uint32_t group, std::uint32_t triangle, const SceneTriangle& corners) {
    if (triangle >= index_.size()) index_.resize(triangle + triangle / 8 + 1, kNone);
    index_[triangle] = static_cast<std::uint32_t>(hidden_.size());
    hidden_.push_back({triangle, group, corners});
  }
  /// Forgets a hidden triangle that has been removed as well.
  void forget(std::uint32_t triangle) {
    hidden_[index_[triangle]].slot = kNone;
    index_[triangle] = kNone;
  }
  /// Keeps drawing a removed vertex. Returns the slot at which it is drawn. Requires room.
  std::uint32_t keep(std::uint32_t group, const Vertex& vertex, const tri::Anchor& anchor) {
    const std::uint32_t slot = free_vertices_.take();
    vertices_.change(slot) = vertex;
    anchors_.push_back(anchor);
    vertices_drawn_.push_back({slot, group});
    return slot;
  }
  /// Keeps drawing a removed triangle. Requires room.
  void keep(std::uint32_t group, const SceneTriangle& corners) {
    const std::uint32_t slot = free_triangles_.take();
    triangles_.change(slot) = corners;
    triangles_drawn_.push_back({slot, group});
  }
  /// Calls visit(slot, group) for each removed triangle that is still drawn.
  template <class Visit>
  void for_each_triangle(const Visit& visit) {
    for (const Removed& item : triangles_drawn_) visit(item.slot, item.group);
  }
  /// The targets of the removed vertices that are still drawn; slot_of_anchor() gives their slots.
  [[nodiscard]] std::vector<tri::Anchor>& anchors() { return anchors_; }
  [[nodiscard]] std::uint32_t slot_of_anchor(std::size_t i) const {
    return vertices_drawn_[i].slot;
  }

 private:
  struct Group {
    double begin = 0.0, end = 0.0;
    std::uint32_t parent = 0;  ///< itself, or a group into which it was merged
    bool ended = false;
  };
  struct Removed {
    std::uint32_t slot, group;
  };
  struct Hidden {
    std::uint32_t slot, group;
    SceneTriangle corners;
  };
  std::uint32_t root(std::uint32_t group) {
    while (groups_[group].parent != group) {
      group = groups_[group].parent = groups_[groups_[group].parent].parent;
    }
    return group;
  }
  /// Free slots in the order in which they became free. So triangles that are removed together get
  /// slots close to each other, and few blocks change.
  class FreeSlots {
   public:
    explicit FreeSlots(std::uint32_t count) : ring_(count) {
      for (std::uint32_t i = 0; i < count; ++i) ring_[i] = i;
    }
    std::uint32_t take() { return ring_[next_++ % ring_.size()]; }
    void put(std::uint32_t slot) { ring_[last_++ % ring_.size()] = slot; }

   private:
    std::vector<std::uint32_t> ring_;
    std::size_t next_ = 0, last_ = 0;
  };

  Blocks<Vertex>& vertices_;
  Blocks<SceneTriangle>& triangles_;
  std::vector<Group> groups_;
  std::vector<Removed> triangles_drawn_,
      vertices_drawn_;  ///< the vertices are parallel to anchors_
  std::vector<tri::Anchor> anchors_;
  std::vector<Hidden> hidden_;
  std::vector<std::uint32_t> index_;  ///< index in hidden_, by drawn slot of a triangle
  FreeSlots free_vertices_{kVertices}, free_triangles_{kTriangles};
  bool any_ended_ = false;
};

}  // namespace terrace::viewer
