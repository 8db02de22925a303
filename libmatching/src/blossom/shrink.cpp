// SPDX-License-Identifier: Apache-2.0
// Blossoms in the tree: shrinks odd cycles of tight edges and expands minus blossoms of dual 0.
#include <algorithm>

#include "blossom/solver.hpp"

namespace terrace::matching::blossom {

std::uint32_t Solver::new_blossom() {
  if (spare_.empty()) {
    spare_.push_back(node_count());
    nodes_.emplace_back();
    parts_.emplace_back();
  }
  const std::uint32_t blossom = spare_.back();
  spare_.pop_back();
  parts(blossom).clear();
  return blossom;
}

// The part that contains the base, `exit`, gets the blossom's matched edge. The other parts are
// paired around the cycle.
void Solver::match_parts(std::uint32_t blossom, std::uint32_t exit) {
  const std::vector<Part>& cycle = parts(blossom);
  const std::uint32_t count = static_cast<std::uint32_t>(cycle.size());
  nodes_[cycle[exit].node].base = nodes_[blossom].base;
  nodes_[cycle[exit].node].mate = nodes_[blossom].mate;
  for (std::uint32_t step = 1; step < count; step += 2) {
    const Part& part = cycle[(exit + step) % count];
    Node& x = nodes_[part.node];
    Node& y = nodes_[cycle[(exit + step + 1) % count].node];
    x.base = y.mate = part.from;
    x.mate = y.base = part.to;
  }
}

// Afterwards top() returns the part that contains a vertex. (Walking up from the vertex would take
// time proportional to the nesting depth.) Base and mate of the blossom stay readable.
void Solver::release_parts(std::uint32_t blossom) {
  Node& b = nodes_[blossom];
  for (const Part& part : parts(blossom)) {
    Node& x = nodes_[part.node];
    x.parent = kNone;
    sets_[x.set] = part.node;
    if (x.set == b.set) continue;
    for (std::uint32_t v = x.first;; v = vertices_[v].next) {
      vertices_[v].set = x.set;
      if (v == x.last) break;
    }
  }
  b.label = Label::free;
  b.first = b.last = kNone;
  b.dual = 0;
  spare_.push_back(blossom);
}

std::uint32_t Solver::tree_parent(std::uint32_t plus) const {
  const std::uint32_t mate = nodes_[plus].mate;
  return mate == kNone ? kNone : top(nodes_[top(mate)].enter_from);
}

// The two walks alternate, which bounds the work by the length of the shorter path.
std::uint32_t Solver::common_ancestor(std::uint32_t u, std::uint32_t v) {
  ++stamp_;
  std::uint32_t a = top(u), b = top(v);
  while (true) {
    if (a != kNone) {
      if (nodes_[a].stamp == stamp_) return a;
      nodes_[a].stamp = stamp_;
      a = tree_parent(a);
    }
    std::swap(a, b);
  }
}

void Solver::shrink(std::uint32_t u, std::uint32_t v) {
  const std::uint32_t apex = common_ancestor(u, v);
  const std::uint32_t blossom = new_blossom();
  std::vector<Part>& cycle = parts(blossom);
  // Collected from u up to the apex, then reversed, because links point down the tree.
  std::uint32_t x = top(u), from = u, to = v;
  while (x != apex) {
    cycle.push_back({x, from, to});
    const Node& plus = nodes_[x];
    const std::uint32_t minus = top(plus.mate);
    cycle.push_back({minus, plus.mate, plus.base});
    from = nodes_[minus].enter_from;
    to = nodes_[minus].enter_to;
    x = top(from);
  }
  cycle.push_back({apex, from, to});
  std::reverse(cycle.begin(), cycle.end());
  for (x = top(v); x != apex;) {
    const Node& plus = nodes_[x];
    const std::uint32_t minus = top(plus.mate);
    cycle.push_back({x, plus.base, plus.mate});
    cycle.push_back({minus, nodes_[minus].enter_to, nodes_[minus].enter_from});
    x = top(nodes_[minus].enter_from);
  }
  form(blossom, apex);
}

void Solver::form(std::uint32_t blossom, std::uint32_t apex) {
  Node& b = nodes_[blossom];
  b.label = Label::plus;
  b.dual = -delta_;
  b.parent = kNone;
  b.base = nodes_[apex].base;
  b.mate = nodes_[apex].mate;
  b.size = 0;
  std::uint32_t largest = apex;
  for (const Part& part : parts(blossom)) {
    if (nodes_[part.node].size > nodes_[largest].size) largest = part.node;
  }
  b.set = nodes_[largest].set;
  std::uint32_t last = kNone, place = 0;
  for (const Part& part : parts(blossom)) {
    Node& x = nodes_[part.node];
    const bool rises = x.label == Label::minus;
    if (part.node >= n_) x.dual += rises ? -delta_ : delta_;
    x.label = Label::free;
    x.parent = blossom;
    x.place = place++;
    b.size += x.size;
    if (rises || x.set != b.set) {
      for (std::uint32_t v = x.first;; v = vertices_[v].next) {
        Vertex& vertex = vertices_[v];
        vertex.set = b.set;
        if (rises) {
          vertex.potential -= 2 * delta_;
          vertex.label = Label::plus;
          queue_.push_back(v);
        }
        if (v == x.last) break;
      }
    }
    // Parts stay contiguous in the list, so that they can be split off again.
    if (last == kNone) {
      b.first = x.first;
    } else {
      vertices_[last].next = x.first;
    }
    last = x.last;
  }
  b.last = last;
  sets_[b.set] = blossom;
  labelled_.push_back(blossom);
}

void Solver::stay_minus(std::uint32_t node, std::uint32_t from, std::uint32_t to) {
  Node& x = nodes_[node];
  x.label = Label::minus;
  x.dual += delta_;
  x.enter_from = from;
  x.enter_to = to;
  labelled_.push_back(node);
  if (node >= n_) push_expansion(node);
}

void Solver::leave_minus(std::uint32_t node) {
  const Node& x = nodes_[node];
  for (std::uint32_t v = x.first;; v = vertices_[v].next) {
    vertices_[v].potential -= delta_;
    vertices_[v].label = Label::free;
    if (v == x.last) break;
  }
}

void Solver::expand(std::uint32_t blossom) {
  const Node b = nodes_[blossom];
  const std::uint32_t count = static_cast<std::uint32_t>(parts(blossom).size());
  const std::vector<Part> cycle = parts(blossom);
  release_parts(blossom);
  const std::uint32_t entry = nodes_[top(b.enter_to)].place;
  const std::uint32_t exit = nodes_[top(b.base)].place;
  match_parts(blossom, exit);
  // The parts on the even path from the entry to the exit stay in the tree. Parts that stay minus
  // are not updated vertex by vertex, because in a deep nest the next expansion would repeat the
  // work.
  const std::uint32_t ahead = (entry + count - exit) % count;
  const bool forward = ahead % 2 == 1;
  std::uint32_t k = entry, from = b.enter_from, to = b.enter_to;
  std::vector<bool> stays(count, false);
  while (true) {
    stay_minus(cycle[k].node, from, to);
    stays[k] = true;
    if (k == exit) break;
    for (int step = 0; step < 2; ++step) {
      const std::uint32_t next = forward ? (k + 1) % count : (k + count - 1) % count;
      from = forward ? cycle[k].from : cycle[next].to;
      to = forward ? cycle[k].to : cycle[next].from;
      k = next;
      stays[k] = true;
      if (step == 0) {
        leave_minus(cycle[k].node);
        label_plus(cycle[k].node);
      }
    }
  }
  for (std::uint32_t p = 0; p < count; ++p) {
    if (stays[p]) continue;
    leave_minus(cycle[p].node);
    const Node& x = nodes_[cycle[p].node];
    for (std::uint32_t v = x.first;; v = vertices_[v].next) {
      if (vertices_[v].key != std::numeric_limits<std::int64_t>::max()) schedule_grow(v);
      if (v == x.last) break;
    }
  }
}

}  // namespace terrace::matching::blossom
