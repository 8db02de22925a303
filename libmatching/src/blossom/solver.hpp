// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/matching.hpp"

namespace terrace::matching::blossom {

/// Bound of all potentials, chosen so that sums of three fit into 64 bits.
inline constexpr std::int64_t kLimit = std::int64_t{1} << 60;

/// An edge with its integer weight doubled, so that all duals are integers.
struct Edge {
  std::uint32_t i, j;
  std::int64_t cost;
};

/// Minimum-weight perfect matching by the primal-dual blossom method on a sparse graph, one
/// alternating tree at a time. Edges may be added between two solutions.
///
/// A *node* is a vertex (id below n) or a blossom (id n and above). A node without a parent is a
/// *top* node. Only top nodes are matched, labelled and in the tree. The *potential* of a vertex is
/// its own dual plus the duals of all blossoms around it. So between different top nodes the slack
/// of an edge is cost - potential(i) - potential(j), whatever the nesting.
///
/// While a tree exists, the potential of a vertex labelled plus is stored minus `delta_`, and that
/// of a vertex labelled minus is stored plus `delta_`. The duals of labelled blossoms are stored in
/// the same way. A dual change of the whole tree is then one addition to `delta_`.
class Solver {
 public:
  /// Takes n vertices and edges (ends below n, i != j, |cost| below kLimit / 4). Vertex
  /// `last_vertex`, if given, may have edges to all others. It is matched last, so that its many
  /// edges are not scanned repeatedly.
  Solver(std::uint32_t n, std::vector<Edge> edges, std::uint32_t last_vertex = kNone,
         base::StopTicks ticks = {});

  /// Computes a perfect matching of least weight.
  /// Returns: kNone, or an exposed vertex that cannot be matched (then witness() proves it).
  /// Throws: std::overflow_error if a potential exceeds kLimit, and whatever the stop check of
  /// `ticks` throws. After either, the solver can only be destroyed.
  std::uint32_t solve();

  /// Adds edges and repairs the duals that they violate, which may expose vertices.
  void add(std::span<const Edge> edges);

  /// After a failed solve(): a set of vertices whose removal leaves more odd components than the
  /// set has vertices.
  const std::vector<std::uint32_t>& witness() const { return witness_; }

  /// The partner of each vertex, or kNone where exposed.
  std::vector<std::uint32_t> mates();

  std::uint32_t vertex_count() const { return n_; }
  std::uint32_t node_count() const { return static_cast<std::uint32_t>(nodes_.size()); }
  std::int64_t potential(std::uint32_t vertex) const { return vertices_[vertex].potential; }
  std::uint32_t parent(std::uint32_t node) const { return nodes_[node].parent; }
  /// Returns the dual of a blossom in use, or 0 for vertices.
  std::int64_t blossom_dual(std::uint32_t node) const { return nodes_[node].dual; }
  bool in_use(std::uint32_t node) const { return nodes_[node].first != kNone; }
  std::size_t edge_count() const { return edges_.size(); }

 private:
  enum class Label : std::uint8_t { free, plus, minus };

  struct Vertex {
    std::int64_t potential = 0;
    std::int64_t key = 0;  // least cost - stored potential over the edges from plus vertices
    std::uint32_t key_from = kNone;  // the plus end of that edge
    std::uint32_t set = kNone;       // sets_[set] is the top node
    std::uint32_t next = kNone;      // within the list of the top node
    Label label = Label::free;
  };

  struct Node {
    std::int64_t dual = 0;
    std::uint32_t parent = kNone;
    std::uint32_t place = 0;                              // among the parent's parts
    std::uint32_t first = kNone, last = kNone, size = 1;  // the list of its vertices
    std::uint32_t set = kNone;
    std::uint32_t base = kNone, mate = kNone;  // the matched edge: inside, outside
    std::uint32_t enter_from = kNone,
                  enter_to = kNone;  // of a minus node: the edge from its parent
    std::uint32_t stamp = 0;
    Label label = Label::free;
  };

  /// A part of a blossom and the edge to the next part around the cycle.
  struct Part {
    std::uint32_t node, from, to;
  };

  /// The meaning of a and b depends on the event. Grow: a is a vertex. Expand: a is a node. Shrink:
  /// a and b are the ends of an edge.
  struct Event {
    std::int64_t time;
    std::uint32_t a, b;
  };

  std::uint32_t top(std::uint32_t vertex) const { return sets_[vertices_[vertex].set]; }
  std::vector<Part>& parts(std::uint32_t blossom) { return parts_[blossom - n_]; }

  void index_arcs();
  void start_duals();
  std::int64_t first_limit() const;

  enum class Outcome : std::uint8_t { augmented, stopped, impossible };
  Outcome search(std::uint32_t root, std::int64_t limit);
  void push(std::int64_t time, std::uint32_t a, std::uint32_t b);
  void label_plus(std::uint32_t node);
  void label_minus(std::uint32_t node, std::uint32_t from, std::uint32_t to);
  void push_expansion(std::uint32_t node);
  void stay_minus(std::uint32_t node, std::uint32_t from, std::uint32_t to);
  void leave_minus(std::uint32_t node);
  void scan(std::uint32_t vertex);
  void scan_queue();
  void schedule_grow(std::uint32_t vertex);
  void grow(std::uint32_t vertex);
  void augment(std::uint32_t from, std::uint32_t to);
  void dissolve_tree();
  void collect_witness();

  void shrink(std::uint32_t u, std::uint32_t v);
  std::uint32_t tree_parent(std::uint32_t plus) const;
  std::uint32_t common_ancestor(std::uint32_t u, std::uint32_t v);
  void form(std::uint32_t blossom, std::uint32_t apex);
  void expand(std::uint32_t blossom);

  std::uint32_t new_blossom();
  void match_parts(std::uint32_t blossom, std::uint32_t exit);
  void release_parts(std::uint32_t blossom);
  void uncover(std::uint32_t vertex);
  void repair(const Edge& edge);
  void unmatch(std::uint32_t node);
  std::int64_t shared_duals(std::uint32_t i, std::uint32_t j) const;

  struct Arc {
    std::int64_t cost;
    std::uint32_t to;
  };

  std::uint32_t n_, last_vertex_;
  base::StopTicks ticks_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> arc_begin_;
  std::vector<Arc> arcs_;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> sets_;
  std::vector<Node> nodes_;
  std::vector<std::vector<Part>> parts_;
  std::vector<std::uint32_t> spare_;  // blossoms not in use
  bool has_duals_ = false;

  // The current tree.
  std::int64_t delta_ = 0;
  // Events at or after this delta are dropped: an augmentation or the limit comes first.
  // dropped_events_ records whether any event was dropped.
  std::int64_t bound_ = 0;
  bool dropped_events_ = false;
  std::vector<Event> heap_;
  std::vector<std::uint32_t> labelled_, keyed_, queue_;
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> witness_;
};

/// Converts the solver's result to the public type: partners and duals, with blossoms numbered from
/// 0. Leaves cost and exponent to the caller.
Matching proof_of(Solver& solver);

/// Returns the error message for a vertex that solve() could not match.
std::string unmatchable_message(const Solver& solver, std::uint32_t vertex);

}  // namespace terrace::matching::blossom
