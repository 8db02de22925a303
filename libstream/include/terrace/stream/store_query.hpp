// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

#include "terrace/stream/store.hpp"

namespace terrace::stream {

/// A linear map, row-major. As a metric, the length of a vector v is |map v|: a scale to metres
/// measures distances on the ground, a row of zeros ignores a coordinate.
using LinearMap = std::array<double, 9>;

inline constexpr LinearMap kIdentityMap{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// A point found by a query: member number `member` of a cluster, so that Store::read() gives its
/// attributes.
struct FoundPoint {
  Point3 position{};  ///< stored coordinates
  ClusterId cluster{};
  std::uint32_t member = 0;
  double distance = 0.0;  ///< from the query's place, in the metric; 0 for a box
};

/// Spatial queries (range, radius, nearest points, count), and the traversals of the hierarchy on
/// which they are built. All boxes and places are in stored coordinates.
///
/// A query reads the clusters whose boxes may matter, about 25 ns per point, and their index
/// entries. The root and 6 MiB of decoded clusters above level 0 are cached, so nearby queries cost
/// a tenth of that. In a view (see Store::where()) only points that meet its condition are found
/// and counted, and clusters of level 0 without such points are not read if the index shows it.
///
/// Not thread-safe, but any number of objects may share a Store, which must outlive them. All
/// functions throw Error for a damaged store, and Stopped if the store is stopped.
class StoreQuery {
 public:
  /// A cluster headed by a point, as described by the index. All its descendants are in its box.
  struct Branch {
    Box3 box;
    std::uint64_t ordinal = 0;
    /// Number of level-0 points below, including the representative; 0 if its index entry has not
    /// been read yet. The box is then Store::coarse_box() or page_box().
    std::uint64_t descendants = 0;
  };
  /// A decoded cluster and the clusters that its members head. In a view, members that do not meet
  /// the condition have no position, but are still heads, numbered after the others.
  class Node {
   public:
    ClusterId id{};
    std::vector<Point3> positions;  ///< of the members; in a view, of those that meet the condition
    std::uint64_t bytes = 0;

    [[nodiscard]] unsigned level() const { return level_of(id); }
    /// The number of the member at position i.
    [[nodiscard]] std::uint32_t member(std::size_t i) const {
      return members_.empty() ? static_cast<std::uint32_t>(i) : members_[i];
    }
    /// The number of heads: the members, or 0 on level 0. Head i is the point at positions[i], if i
    /// is less than positions.size().
    [[nodiscard]] std::size_t heads() const {
      return level() == 0 ? 0 : branches_.size() / level();
    }
    /// The cluster that a head has on a level below this node's. Throws: Error.
    [[nodiscard]] const Branch& branch(std::size_t head, unsigned below) const {
      Branch& branch = branches_[head * level() + below];
      if (branch.descendants == 0) look_up(branch, below);
      return branch;
    }
    /// Like branch(), but does not read the index entry; the box may be its page's. Throws: Error.
    [[nodiscard]] const Branch& near_branch(std::size_t head, unsigned below) const {
      Branch& branch = branches_[head * level() + below];
      if (branch.descendants == 0) {
        branch.box = store_->page_box(cluster_id(below, branch.ordinal));
      }
      return branch;
    }
    /// Like branch(), but reads nothing; the box may be Store::coarse_box().
    [[nodiscard]] const Branch& known_branch(std::size_t head, unsigned below) const {
      return branches_[head * level() + below];
    }

   private:
    friend class StoreQuery;
    void look_up(Branch& branch, unsigned below) const;

    const Store* store_ = nullptr;
    std::vector<std::uint32_t> members_;    ///< in a view, the member number of each head
    mutable std::vector<Branch> branches_;  ///< level() per head, level 0 first
  };

  /// leaf_bytes: size of an LRU cache of decoded clusters of level 0, for callers that query nearby
  /// places repeatedly. Ranges that do not overlap are read fastest without it.
  explicit StoreQuery(const Store& store, std::uint64_t leaf_bytes = 0);
  StoreQuery(const StoreQuery&) = delete;
  StoreQuery& operator=(const StoreQuery&) = delete;

  [[nodiscard]] const Store& store() const { return store_; }

  /// Returns the points of `level` and above in the box, higher levels first, within a level by id.
  [[nodiscard]] std::vector<FoundPoint> in_box(const Box3& box, unsigned level = 0);
  /// Returns the points of `level` and above whose distance is at most `radius`, nearest first;
  /// ties are in ascending order of coordinates. Requires finite arguments.
  [[nodiscard]] std::vector<FoundPoint> within(const Point3& place, double radius,
                                               const LinearMap& metric = kIdentityMap,
                                               unsigned level = 0);
  /// Returns the `count` nearest points of `level` and above, or all if there are fewer, in the
  /// order of within(). Distances are computed in doubles. Cost: O(n log n) for n = count + points
  /// read.
  [[nodiscard]] std::vector<FoundPoint> nearest(const Point3& place, std::size_t count,
                                                const LinearMap& metric = kIdentityMap,
                                                unsigned level = 0);
  /// Returns the attributes of found points, in their order, Schema::payload_size() bytes each.
  /// Reads each of their clusters once.
  [[nodiscard]] std::vector<std::byte> attributes(std::span<const FoundPoint> found) const;
  /// Returns the number of points of `level` and above in the box. For level 0, except in a view,
  /// reads only clusters that cross the border of the box.
  [[nodiscard]] std::uint64_t count(const Box3& box, unsigned level = 0);
  /// Returns an estimate of count() from the index alone, ignoring the condition of a view. A
  /// cluster that crosses the border counts by the share of its box that is inside. Stops early and
  /// returns any number above `limit` once it is exceeded.
  [[nodiscard]] double estimate(const Box3& box,
                                double limit = std::numeric_limits<double>::infinity());

  /// Returns one cluster, for custom traversals. Valid until the next call of any member.
  const Node& node(ClusterId id);

  /// Visits the root and then, level by level down to `level` and within a level by id, each
  /// cluster for which wants(level, branch) is true. A branch is tested only if the same point's
  /// branch on the level above was wanted, because it is inside that one. wants() is called with
  /// larger boxes first, so it must be true for a box if it is true for one inside it.
  template <class Wants, class Visit>
  void descend(unsigned level, const Wants& wants, const Visit& visit);

  /// Visits the root and then clusters of `level` and above in ascending order of least(level,
  /// box), as long as it does not exceed the last result of visit(node). least: returns a lower
  /// bound for any point in the box around a cluster of that level, or infinity to skip it.
  template <class Least, class Visit>
  void best_first(unsigned level, const Least& least, const Visit& visit);

  /// Cuts the hierarchy below the root at the border of a box. Calls take(head, branch) for
  /// clusters that are completely inside and for those of level 0 on the border, until it returns
  /// false. `head` is null if the point does not meet the condition of a view. Opens a cluster on
  /// the border only if opens(branch) is true. In a store of one block, every point is a branch
  /// without other descendants.
  template <class Take, class Opens>
  void cut(const Box3& box, const Take& take, const Opens& opens);

 private:
  using Nodes = std::list<Node>;

  /// Nodes up to a total size, most recently used first.
  struct Cache {
    std::uint64_t max_bytes = 0, held_bytes = 0;
    Nodes nodes{};
    std::unordered_map<std::uint64_t, Nodes::iterator> by_id{};

    /// Moves the least recently used node to `to`.
    void drop(Nodes& to);
  };
  struct Open {
    double least = 0;
    ClusterId id{};
  };

  void fill(Node& node, ClusterId id);
  /// Requests from a server the index entries of the clusters below some of a level that
  /// wants(below, box) selects, down to `level`. wants: see descend().
  template <class Wants>
  void prefetch_below(unsigned at, std::span<const std::uint64_t> ordinals, unsigned level,
                      const Wants& wants);
  /// Throws Error if a traversal has opened more clusters than exist. Each cluster has one head, so
  /// that only happens in a damaged store, where the traversal could otherwise run almost forever.
  void check_traversal(std::uint64_t clusters) const;

  const Store& store_;
  std::uint64_t clusters_ = 0;  ///< number of clusters on all levels
  Node root_, uncached_;        ///< uncached_: the last node that is not cached
  Cache leaves_, inner_;
  ClusterPoints points_;
  std::vector<std::vector<std::uint64_t>> wanted_;  ///< per level, ordinals on the way down
  std::vector<std::vector<std::uint64_t>> ahead_;   ///< as wanted_, of prefetch_below()
  std::vector<Open> open_;                          ///< a heap with the smallest on top
  std::vector<ClusterId> crossing_;
};

template <class Wants>
void StoreQuery::prefetch_below(unsigned at, std::span<const std::uint64_t> ordinals,
                                unsigned level, const Wants& wants) {
  for (const Store::Part part : {Store::Part::page_box, Store::Part::record}) {
    ahead_.assign(at, {});
    for (const std::uint64_t ordinal : ordinals) {
      const Node& node = this->node(cluster_id(at, ordinal));
      for (std::size_t i = 0; i < node.heads(); ++i) {
        for (unsigned below = at; below-- > level;) {
          const Branch& branch = node.known_branch(i, below);
          if (!wants(below, branch.box)) break;
          if (branch.descendants > 0) continue;
          if (part == Store::Part::record && !wants(below, node.near_branch(i, below).box)) break;
          ahead_[below].push_back(branch.ordinal);
        }
      }
    }
    for (unsigned below = level; below < at; ++below) {
      std::sort(ahead_[below].begin(), ahead_[below].end());
      store_.prefetch(part, below, ahead_[below]);
    }
  }
}

template <class Wants, class Visit>
void StoreQuery::descend(unsigned level, const Wants& wants, const Visit& visit) {
  for (std::vector<std::uint64_t>& ordinals : wanted_) ordinals.clear();
  const auto deliver = [&](const Node& node) {
    visit(node);
    const unsigned at = node.level();
    if (at <= level) return;
    for (std::size_t i = 0; i < node.heads(); ++i) {
      for (unsigned below = at; below-- > level;) {
        const Branch& branch = node.known_branch(i, below);
        const bool known = branch.descendants > 0;
        if (!wants(below, branch)) break;
        if (!known &&
            !(wants(below, node.near_branch(i, below)) && wants(below, node.branch(i, below)))) {
          break;
        }
        wanted_[below].push_back(branch.ordinal);
      }
    }
  };
  if (level > store_.top()) return;
  const bool remote = store_.is_remote();
  // Number of nodes whose index entries are requested together; their nodes stay in the cache.
  constexpr std::size_t kNodesAtOnce = 128;
  const auto wants_box = [&](unsigned below, const Box3& box) {
    return wants(below, Branch{.box = box, .ordinal = 0, .descendants = 0});
  };
  constexpr std::uint64_t kRoot = 0;
  if (remote) prefetch_below(store_.top(), {&kRoot, 1}, level, wants_box);
  deliver(root_);
  for (unsigned at = store_.top(); at-- > level;) {
    // By ordinal, which is the order of the bytes in the file.
    std::sort(wanted_[at].begin(), wanted_[at].end());
    // Duplicates exist only in a damaged store.
    wanted_[at].erase(std::unique(wanted_[at].begin(), wanted_[at].end()), wanted_[at].end());
    for (std::span<const std::uint64_t> rest = wanted_[at]; !rest.empty();) {
      std::size_t count = rest.size();
      if (remote) {
        if (at > level) count = std::min(count, kNodesAtOnce);
        count = store_.prefetch(Store::Part::cluster, at, rest.first(count));
        if (at > level) prefetch_below(at, rest.first(count), level, wants_box);
      }
      for (const std::uint64_t ordinal : rest.first(count)) deliver(node(cluster_id(at, ordinal)));
      rest = rest.subspan(count);
    }
  }
}

template <class Least, class Visit>
void StoreQuery::best_first(unsigned level, const Least& least, const Visit& visit) {
  const auto later = [](const Open& a, const Open& b) { return a.least > b.least; };
  open_.clear();
  double bound = 0;
  const bool remote = store_.is_remote();
  const auto look_into = [&](const ClusterId id) {
    const Node* read = &this->node(id);
    bound = visit(*read);
    if (remote && level_of(id) > level) {
      const std::uint64_t ordinal = ordinal_of(id);
      prefetch_below(level_of(id), {&ordinal, 1}, level,
                     [&](unsigned below, const Box3& box) { return !(least(below, box) > bound); });
      read = &this->node(id);
    }
    const Node& node = *read;
    const unsigned at = node.level();
    for (std::size_t i = 0; i < node.heads(); ++i) {
      for (unsigned below = level; below < at; ++below) {
        const auto beyond = [bound](double distance) {
          return distance > bound || distance == std::numeric_limits<double>::infinity();
        };
        if (beyond(least(below, node.known_branch(i, below).box))) continue;
        if (beyond(least(below, node.near_branch(i, below).box))) continue;
        const Branch& branch = node.branch(i, below);
        const double distance = least(below, branch.box);
        if (beyond(distance)) continue;
        open_.push_back({distance, cluster_id(below, branch.ordinal)});
        std::push_heap(open_.begin(), open_.end(), later);
      }
    }
  };
  if (level > store_.top()) return;
  look_into(root_.id);
  for (std::uint64_t opened = 0; !open_.empty(); ++opened) {
    check_traversal(opened);
    std::pop_heap(open_.begin(), open_.end(), later);
    const Open next = open_.back();
    open_.pop_back();
    if (next.least > bound) break;
    look_into(next.id);
  }
}

template <class Take, class Opens>
void StoreQuery::cut(const Box3& box, const Take& take, const Opens& opens) {
  if (root_.level() == 0) {
    for (const Point3& p : root_.positions) {
      if (!box.contains(p)) continue;
      if (!take(&p, Branch{.box = {p, p}, .ordinal = 0, .descendants = 1})) return;
    }
    return;
  }
  const bool remote = store_.is_remote();
  crossing_.assign(1, root_.id);
  for (std::uint64_t opened = 0; !crossing_.empty(); ++opened) {
    check_traversal(opened);
    const ClusterId id = crossing_.back();
    crossing_.pop_back();
    if (remote) {
      const std::uint64_t ordinal = ordinal_of(id);
      prefetch_below(level_of(id), {&ordinal, 1}, 0,
                     [&](unsigned, const Box3& other) { return box.intersects(other); });
    }
    const Node& at = node(id);
    for (std::size_t i = 0; i < at.heads(); ++i) {
      // The cluster that a point heads on a level is inside the one on the level above.
      for (unsigned below = at.level(); below-- > 0;) {
        if (!box.intersects(at.known_branch(i, below).box)) break;
        if (!box.intersects(at.near_branch(i, below).box)) break;
        const Branch& branch = at.branch(i, below);
        if (!box.intersects(branch.box)) break;
        if (below == 0 || (box.contains(branch.box.min) && box.contains(branch.box.max))) {
          if (!take(i < at.positions.size() ? &at.positions[i] : nullptr, branch)) return;
          break;
        }
        if (!opens(branch)) break;
        crossing_.push_back(cluster_id(below, branch.ordinal));
      }
    }
  }
}

}  // namespace terrace::stream
