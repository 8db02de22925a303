// SPDX-License-Identifier: Apache-2.0
// Grows, shrinks and expands one alternating tree, in order of time (delta), until it reaches an
// exposed node.
#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "blossom/solver.hpp"

namespace terrace::matching::blossom {
namespace {

constexpr std::uint32_t kGrow = 0xFFFFFFFFu, kExpand = 0xFFFFFFFEu;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

Solver::Outcome Solver::search(std::uint32_t root, std::int64_t limit) {
  const auto later = [](const Event& x, const Event& y) {
    return std::tie(x.time, x.b, x.a) > std::tie(y.time, y.b, y.a);
  };
  delta_ = 0;
  bound_ = limit == kNever ? kNever : limit + 1;
  dropped_events_ = false;
  label_plus(root);
  scan_queue();
  constexpr std::size_t kTicksOfEvent = 64;
  while (!heap_.empty()) {
    ticks_(kTicksOfEvent);
    const Event event = heap_.front();
    std::pop_heap(heap_.begin(), heap_.end(), later);
    heap_.pop_back();
    if (event.b == kGrow) {
      const Vertex& v = vertices_[event.a];
      // Skip events that a better edge, or another way into the tree, has made obsolete.
      if (v.label != Label::free || v.key - v.potential != event.time) continue;
      delta_ = event.time;
      if (nodes_[top(event.a)].mate == kNone) {
        augment(v.key_from, event.a);
        dissolve_tree();
        return Outcome::augmented;
      }
      grow(event.a);
    } else if (event.b == kExpand) {
      const Node& x = nodes_[event.a];
      if (x.parent != kNone || x.label != Label::minus || x.dual != event.time) continue;
      delta_ = event.time;
      expand(event.a);
    } else if (vertices_[event.a].set != vertices_[event.b].set) {
      delta_ = event.time;
      shrink(event.a, event.b);
    }
    scan_queue();
  }
  if (dropped_events_) {
    delta_ = limit;
    dissolve_tree();
    return Outcome::stopped;
  }
  collect_witness();
  dissolve_tree();
  return Outcome::impossible;
}

void Solver::push(std::int64_t time, std::uint32_t a, std::uint32_t b) {
  if (time >= bound_) {
    dropped_events_ = true;
    return;
  }
  if (time > kLimit) {
    throw std::overflow_error("matching: the duals overflow 64 bits; use smaller weights");
  }
  heap_.push_back({time, a, b});
  std::push_heap(heap_.begin(), heap_.end(), [](const Event& x, const Event& y) {
    return std::tie(x.time, x.b, x.a) > std::tie(y.time, y.b, y.a);
  });
}

void Solver::label_plus(std::uint32_t node) {
  Node& x = nodes_[node];
  x.label = Label::plus;
  x.dual -= delta_;
  labelled_.push_back(node);
  for (std::uint32_t v = x.first;; v = vertices_[v].next) {
    vertices_[v].potential -= delta_;
    vertices_[v].label = Label::plus;
    queue_.push_back(v);
    if (v == x.last) break;
  }
}

void Solver::label_minus(std::uint32_t node, std::uint32_t from, std::uint32_t to) {
  const Node& x = nodes_[node];
  for (std::uint32_t v = x.first;; v = vertices_[v].next) {
    vertices_[v].potential += delta_;
    vertices_[v].label = Label::minus;
    if (v == x.last) break;
  }
  stay_minus(node, from, to);
}

void Solver::push_expansion(std::uint32_t node) { push(nodes_[node].dual, node, kExpand); }

void Solver::scan_queue() {
  for (std::size_t k = 0; k < queue_.size(); ++k) scan(queue_[k]);
  queue_.clear();
}

void Solver::scan(std::uint32_t vertex) {
  ticks_(4 * (arc_begin_[vertex + std::size_t{1}] - arc_begin_[vertex]));
  const Vertex& u = vertices_[vertex];
  for (std::size_t k = arc_begin_[vertex]; k < arc_begin_[vertex + std::size_t{1}]; ++k) {
    const Arc& arc = arcs_[k];
    Vertex& w = vertices_[arc.to];
    const std::int64_t key = arc.cost - u.potential;
    if (w.label == Label::plus) {
      // Both potentials rise. The difference is even, because tree edges are tight and costs are
      // even.
      if (w.set != u.set) push((key - w.potential) / 2, vertex, arc.to);
      continue;
    }
    if (key >= w.key) continue;
    if (w.key == kNever) keyed_.push_back(arc.to);
    w.key = key;
    w.key_from = vertex;
    if (w.label == Label::free) schedule_grow(arc.to);
  }
}

// Schedules the time at which a free vertex's best edge becomes tight, so that the tree can grow.
void Solver::schedule_grow(std::uint32_t vertex) {
  const Vertex& w = vertices_[vertex];
  const std::int64_t time = w.key - w.potential;
  push(time, vertex, kGrow);
  if (time < bound_ && nodes_[top(vertex)].mate == kNone) bound_ = time;
}

void Solver::grow(std::uint32_t vertex) {
  const std::uint32_t node = top(vertex);
  label_minus(node, vertices_[vertex].key_from, vertex);
  label_plus(top(nodes_[node].mate));
}

void Solver::augment(std::uint32_t from, std::uint32_t to) {
  Node& end = nodes_[top(to)];
  end.base = to;
  end.mate = from;
  std::uint32_t u = from, v = to;
  while (true) {
    Node& plus = nodes_[top(u)];
    const std::uint32_t old = plus.mate;
    plus.base = u;
    plus.mate = v;
    if (old == kNone) break;
    Node& minus = nodes_[top(old)];
    minus.base = v = minus.enter_to;
    minus.mate = u = minus.enter_from;
  }
}

void Solver::dissolve_tree() {
  for (const std::uint32_t node : labelled_) {
    Node& x = nodes_[node];
    if (x.parent != kNone || x.label == Label::free) continue;
    const std::int64_t change = x.label == Label::plus ? delta_ : -delta_;
    x.label = Label::free;
    x.dual = node < n_ ? 0 : x.dual + change;
    for (std::uint32_t v = x.first;; v = vertices_[v].next) {
      Vertex& vertex = vertices_[v];
      vertex.label = Label::free;
      vertex.potential += change;
      if (vertex.potential > kLimit || vertex.potential < -kLimit) {
        throw std::overflow_error("matching: the duals overflow 64 bits; use smaller weights");
      }
      if (v == x.last) break;
    }
  }
  for (const std::uint32_t v : keyed_) vertices_[v].key = kNever;
  labelled_.clear();
  keyed_.clear();
  heap_.clear();
}

// No event is left. Every minus node is a vertex, and removing the minus nodes makes each plus node
// an odd component. There is one more plus node than minus nodes.
void Solver::collect_witness() {
  witness_.clear();
  for (const std::uint32_t node : labelled_) {
    if (nodes_[node].parent == kNone && nodes_[node].label == Label::minus) {
      witness_.push_back(node);
    }
  }
  std::sort(witness_.begin(), witness_.end());
  witness_.erase(std::unique(witness_.begin(), witness_.end()), witness_.end());
}

}  // namespace terrace::matching::blossom
