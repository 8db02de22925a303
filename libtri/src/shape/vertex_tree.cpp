// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/vertex_tree.hpp"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "collapse_order.hpp"
#include "shrinking_surface.hpp"

namespace terrace::tri {
namespace {

constexpr std::uint32_t kNone = VertexClusters::kNone;

void check_clusters(const VertexClusters& in, std::size_t vertices) {
  if (in.leaf.size() != vertices) {
    throw std::invalid_argument("there are clusters for " + std::to_string(in.leaf.size()) +
                                " vertices, but the surface has " + std::to_string(vertices));
  }
  for (std::size_t c = 0; c < in.clusters.size(); ++c) {
    const auto& [parent, representative, level] = in.clusters[c];
    if ((parent != kNone &&
         (parent >= in.clusters.size() || in.clusters[parent].level != level + 1)) ||
        (representative != kNone && representative >= vertices)) {
      throw std::invalid_argument("cluster " + std::to_string(c) +
                                  " has an impossible parent or representative");
    }
  }
  for (const std::uint32_t leaf : in.leaf) {
    if (leaf >= in.clusters.size() || in.clusters[leaf].level != 0) {
      throw std::invalid_argument("a vertex is not in a cluster of level 0");
    }
  }
}

class TreeBuilder final : public shape::CollapseRule {
 public:
  TreeBuilder(const Surface& surface, const VertexClusters& clusters)
      : clusters_(clusters.clusters),
        cluster_(clusters.leaf),
        members_(clusters_.size()),
        waiting_(clusters_.size(), 0),
        unfinished_(clusters_.size(), 0),
        finished_(clusters_.size(), false),
        tree_{std::vector<std::uint32_t>(surface.points.size(), kNone),
              std::vector<double>(surface.points.size(), std::numeric_limits<double>::infinity()),
              std::vector<std::uint8_t>(surface.points.size(), 0)} {
    for (std::uint32_t v = 0; v < cluster_.size(); ++v) members_[cluster_[v]].push_back(v);
    for (std::uint32_t c = static_cast<std::uint32_t>(clusters_.size()); c-- > 0;) {
      if (clusters_[c].parent != kNone) ++unfinished_[clusters_[c].parent];
      idle_.push_back(c);
    }
  }

  [[nodiscard]] bool allows(std::uint32_t vertex, std::uint32_t target) const override {
    const std::uint32_t at = cluster_[vertex];
    if (clusters_[at].representative == vertex) return false;
    std::uint32_t c = cluster_[target];
    // A representative will take part in the clusters above, even if it does not yet.
    while (c != at && clusters_[c].representative == target && clusters_[c].parent != kNone) {
      c = clusters_[c].parent;
    }
    return c == at;
  }

  void waits(std::uint32_t vertex, bool waiting) override {
    const std::uint32_t c = cluster_[vertex];
    if (waiting) {
      ++waiting_[c];
    } else if (--waiting_[c] == 0) {
      idle_.push_back(c);
    }
  }

  VertexTree run(shape::CollapseOrder& order) {
    for (;;) {
      finish_idle(order);
      const auto step = order.next();
      if (step) {
        tree_.parents[step->vertex] = step->target;
        tree_.errors[step->vertex] = step->error;
        tree_.levels[step->vertex] = clusters_[cluster_[step->vertex]].level;
      } else if (idle_.empty()) {
        break;
      }
    }
    for (std::uint32_t v = 0; v < cluster_.size(); ++v) {
      if (tree_.parents[v] == kNone) tree_.levels[v] = clusters_[cluster_[v]].level;
    }
    return std::move(tree_);
  }

 private:
  void finish_idle(shape::CollapseOrder& order) {
    while (!idle_.empty()) {
      const std::uint32_t c = idle_.back();
      idle_.pop_back();
      if (finished_[c] || waiting_[c] > 0 || unfinished_[c] > 0) continue;
      finished_[c] = true;
      const std::uint32_t parent = clusters_[c].parent;
      if (parent != kNone) move_up(c, parent, order);
    }
  }

  void move_up(std::uint32_t c, std::uint32_t parent, shape::CollapseOrder& order) {
    std::vector<std::uint32_t> remaining;
    for (const std::uint32_t v : members_[c]) {
      if (tree_.parents[v] == kNone) remaining.push_back(v);
    }
    std::vector<std::uint32_t>().swap(members_[c]);
    for (const std::uint32_t v : remaining) {
      cluster_[v] = parent;
      members_[parent].push_back(v);
    }
    for (const std::uint32_t v : remaining) order.reconsider(v);
    if (--unfinished_[parent] == 0) idle_.push_back(parent);
  }

  const std::vector<VertexClusters::Cluster>& clusters_;
  std::vector<std::uint32_t> cluster_;               ///< in which each vertex takes part
  std::vector<std::vector<std::uint32_t>> members_;  ///< which take part, and removed ones
  std::vector<std::uint32_t> waiting_;               ///< number of these that wait
  std::vector<std::uint32_t> unfinished_;            ///< number of clusters below
  std::vector<bool> finished_;
  std::vector<std::uint32_t> idle_;  ///< clusters that may be finished
  VertexTree tree_;
};

}  // namespace

VertexTree vertex_tree(const Surface& surface, const VertexClusters& clusters,
                       const base::StopCheck& check_stop) {
  shape::check_shrinkable(surface);
  check_clusters(clusters, surface.points.size());
  TreeBuilder builder(surface, clusters);
  shape::CollapseOrder order(surface, std::numeric_limits<double>::infinity(), builder, check_stop);
  return builder.run(order);
}

double error_of_points(const VertexTree& tree, std::size_t max_points) {
  std::vector<double> errors = tree.errors;
  std::sort(errors.begin(), errors.end(), std::greater<>());
  const auto finite =
      std::find_if(errors.begin(), errors.end(), [](double e) { return std::isfinite(e); });
  const std::size_t removed =
      std::max(max_points, static_cast<std::size_t>(finite - errors.begin()));
  return removed < errors.size() ? errors[removed] : 0.0;
}

std::vector<bool> cut_by_error(const VertexTree& tree, double max_error) {
  std::vector<bool> active(tree.errors.size());
  for (std::size_t v = 0; v < active.size(); ++v) {
    active[v] = tree.parents[v] == kNone || tree.errors[v] > max_error;
  }
  return active;
}

std::vector<bool> cut_by_level(const VertexTree& tree, unsigned level) {
  std::vector<bool> active(tree.levels.size());
  for (std::size_t v = 0; v < active.size(); ++v) {
    active[v] = tree.parents[v] == kNone || tree.levels[v] >= level;
  }
  return active;
}

SurfaceOfCut surface_of_cut(const Surface& surface, const std::vector<std::uint32_t>& parents,
                            const std::vector<bool>& active) {
  const std::size_t vertices = surface.points.size();
  if (parents.size() != vertices || active.size() != vertices) {
    throw std::invalid_argument("the cut is not one of the surface's vertices");
  }
  shape::check_faces(surface);
  std::vector<std::uint32_t> nearest(vertices, kNone);  // active ancestor
  std::vector<std::uint32_t> path;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    std::uint32_t at = v;
    path.clear();
    while (nearest[at] == kNone && !active[at]) {
      path.push_back(at);
      at = parents[at];
      if (at >= vertices || path.size() > vertices) {
        throw std::invalid_argument("vertex " + std::to_string(v) + " has no active ancestor");
      }
    }
    const std::uint32_t found = active[at] ? at : nearest[at];
    nearest[v] = found;
    for (const std::uint32_t passed : path) nearest[passed] = found;
  }
  SurfaceOfCut out;
  std::vector<std::uint32_t> number(vertices, kNone);
  for (const auto& face : surface.faces) {
    const std::array<std::uint32_t, 3> corners{nearest[face[0]], nearest[face[1]],
                                               nearest[face[2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    out.surface.faces.push_back(corners);
    for (const std::uint32_t v : corners) number[v] = 0;
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (number[v] == kNone) continue;
    number[v] = static_cast<std::uint32_t>(out.input.size());
    out.input.push_back(v);
    out.surface.points.push_back(surface.points[v]);
  }
  for (auto& face : out.surface.faces) {
    for (std::uint32_t& v : face) v = number[v];
  }
  return out;
}

}  // namespace terrace::tri
