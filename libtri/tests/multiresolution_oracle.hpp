// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "multiresolution_hierarchy.hpp"
#include "terrace/tri/multiresolution.hpp"

/// The specification of the model, as simple as possible.

namespace terrace::tri::test {

/// The tree of all clusters of a hierarchy, as parents by child, without the root.
class WholeTree {
 public:
  explicit WholeTree(MemorySource& source) : source_(&source) {
    walk(cluster_id(source.top(), 0), {});
  }
  std::map<ClusterId, ClusterId> parents;

  [[nodiscard]] bool is_below(ClusterId cluster, ClusterId ancestor) const {
    for (auto it = parents.find(cluster); it != parents.end(); it = parents.find(it->second)) {
      if (it->second == ancestor) return true;
    }
    return false;
  }

 private:
  void walk(ClusterId id, const std::vector<std::uint64_t>& head_children) {
    const unsigned level = level_of(id);
    if (level == 0) return;
    const MemorySource::Cluster& cluster = source_->at(id);
    const auto descend = [&](const std::vector<std::uint64_t>& ordinals) {
      const ClusterId child = cluster_id(level - 1, ordinals[level - 1]);
      parents[child] = id;
      walk(child, ordinals);
    };
    for (std::size_t i = 0; i < cluster.positions.size(); ++i) {
      const auto* first = cluster.children.data() + i * level;
      descend(std::vector<std::uint64_t>(first, first + level));
    }
    if (level < source_->top()) descend(head_children);
  }
  MemorySource* source_;
};

using ClusterSet = std::set<ClusterId>;

/// The clusters that a detail requests, by its definition.
inline ClusterSet wanted(const WholeTree& tree, MemorySource& source, const Detail& detail) {
  ClusterSet result;
  for (const auto& [id, parent] : tree.parents) {
    bool is_wanted = level_of(id) >= detail.level;
    for (std::size_t i = 0; i < detail.focuses.size(); ++i) {
      const Focus& focus = detail.focuses[i];
      const Box3& box = source.at(id).record.box;
      if (level_of(id) >= focus.level && focus.box.intersects(box) &&
          (!detail.needs || detail.needs(i, box))) {
        is_wanted = true;
      }
    }
    if (is_wanted) result.insert(id);
  }
  return result;
}

inline ClusterSet refined(const WholeTree& tree, MemorySource& source, ClusterSet set,
                          const Box3& box, unsigned level) {
  set.merge(wanted(tree, source, {Detail::kTop, {{box, level}}}));
  return set;
}

inline ClusterSet coarsened(const WholeTree& tree, MemorySource& source, const ClusterSet& set,
                            const Box3& box, unsigned level) {
  ClusterSet result = set;
  for (const ClusterId id : set) {
    if (level_of(id) >= level || !box.covers(source.at(id).record.box)) continue;
    std::erase_if(result, [&](ClusterId other) { return other == id || tree.is_below(other, id); });
  }
  return result;
}

template <class Point>
struct Expectation {
  struct Vertex {
    PointId id;
    double height = 0.0;
    std::multiset<ClusterId> heads;
  };
  std::map<Point, Vertex> vertices;
  std::size_t points = 0;
};

template <class Point>
Expectation<Point> expect(MemorySource& source, const ClusterSet& expanded) {
  Expectation<Point> result;
  const auto add = [&](ClusterId id) {
    const MemorySource::Cluster& cluster = source.at(id);
    const unsigned level = level_of(id);
    for (std::uint32_t i = 0; i < cluster.positions.size(); ++i) {
      const Point3& p = cluster.positions[i];
      const Point point{static_cast<typename Point::value_type>(p[0]),
                        static_cast<typename Point::value_type>(p[1])};
      const PointId point_id{id, i};
      const auto [at, fresh] = result.vertices.try_emplace(point);
      if (fresh || takes_precedence(point_id, at->second.id)) {
        at->second.id = point_id;
        at->second.height = p[2];
      }
      for (unsigned l = 0; l < level; ++l) {
        at->second.heads.insert(cluster_id(l, cluster.children[i * level + l]));
      }
      ++result.points;
    }
  };
  add(cluster_id(source.top(), 0));
  for (const ClusterId id : expanded) add(id);
  return result;
}

/// Compares everything that a model reports with the expected values, and its triangles with those
/// made from scratch.
template <class T>
void check_model(const MultiresolutionModel<T>& model, MemorySource& source,
                 const ClusterSet& expanded) {
  using Point = typename T::Point;
  const std::vector<ClusterId> ids = model.expanded();
  ASSERT_EQ(ClusterSet(ids.begin(), ids.end()), expanded);
  ASSERT_EQ(ids.size(), expanded.size());
  ASSERT_EQ(model.expanded_count(), expanded.size());

  const Expectation<Point> expectation = expect<Point>(source, expanded);
  ASSERT_EQ(model.point_count(), expectation.points);
  ASSERT_EQ(model.triangulation().vertex_count(), expectation.vertices.size());
  std::vector<Point> points;
  for (const auto& [point, vertex] : expectation.vertices) points.push_back(point);
  std::size_t seen = 0;
  std::vector<ClusterId> heads;
  for (const VertexId vertex : model.triangulation().all_vertices()) {
    const auto at = expectation.vertices.find(model.triangulation().point(vertex));
    ASSERT_NE(at, expectation.vertices.end());
    ASSERT_EQ(model.point_id(vertex), at->second.id);
    ASSERT_EQ(model.height(vertex), at->second.height);
    ASSERT_EQ(model.level(vertex), level_of(at->second.id.cluster));
    model.heads(vertex, heads);
    ASSERT_EQ(std::multiset<ClusterId>(heads.begin(), heads.end()), at->second.heads);
    if (model.level(vertex) > 0) {
      ASSERT_EQ(heads.front(),
                cluster_id(model.level(vertex) - 1,
                           source.at(at->second.id.cluster)
                               .children[(at->second.id.index + 1) * model.level(vertex) - 1]));
    }
    ++seen;
  }
  ASSERT_EQ(seen, points.size());

  T fresh;
  fresh.build(points);
  ASSERT_EQ(model.triangulation().hash(), fresh.hash());
}

/// A consumer that reads the whole model once and only deltas from then on.
template <class T>
class Consumer {
 public:
  explicit Consumer(const MultiresolutionModel<T>& model) : model_(&model) { look(*this); }

  /// Applies a delta as documented and checks each claim. `several`: the delta combines several
  /// steps.
  void apply(const typename MultiresolutionModel<T>::Delta& delta, bool several = false) {
    for (const TriangleId t : delta.changes.removed_triangles) {
      ASSERT_EQ(triangles_.erase(t), 1u) << "removed a triangle that did not exist";
    }
    for (const VertexId v : delta.changes.removed_vertices) {
      ASSERT_EQ(vertices_.erase(v), 1u) << "removed a vertex that did not exist";
    }
    for (const VertexId v : delta.changes.added_vertices) {
      ASSERT_TRUE(vertices_.emplace(v, vertex(v)).second) << "added a vertex twice";
    }
    for (const VertexId v : delta.reassigned) {
      const auto at = vertices_.find(v);
      ASSERT_NE(at, vertices_.end()) << "reassigned a vertex that did not exist";
      if (!several) {
        ASSERT_NE(at->second.id, model_->point_id(v)) << "reassigned to the point it had";
      }
      at->second = vertex(v);
    }
    for (const TriangleId t : delta.changes.added_triangles) {
      ASSERT_TRUE(triangles_.emplace(t, model_->triangulation().vertices(t)).second)
          << "added a triangle twice";
    }
  }
  /// Compares with the current model.
  void check() const {
    Consumer now(*model_);
    ASSERT_EQ(vertices_, now.vertices_);
    ASSERT_EQ(triangles_, now.triangles_);
  }

 private:
  struct Vertex {
    typename T::Point point;
    double height;
    PointId id;
    bool operator==(const Vertex&) const = default;
  };
  static void look(Consumer& consumer) {
    for (const VertexId v : consumer.model_->triangulation().all_vertices()) {
      consumer.vertices_.emplace(v, consumer.vertex(v));
    }
    for (const TriangleId t : consumer.model_->triangulation().all_triangles()) {
      consumer.triangles_.emplace(t, consumer.model_->triangulation().vertices(t));
    }
  }
  [[nodiscard]] Vertex vertex(VertexId v) const {
    return {model_->triangulation().point(v), model_->height(v), model_->point_id(v)};
  }
  const MultiresolutionModel<T>* model_;
  std::map<VertexId, Vertex> vertices_;
  std::map<TriangleId, std::array<VertexId, 3>> triangles_;
};

}  // namespace terrace::tri::test
