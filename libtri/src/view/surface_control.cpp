// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/surface_control.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "columns.hpp"

namespace terrace::tri {
namespace {

/// Vertices of a block, which is measured as a whole first.
constexpr std::size_t kBlock = 128;
/// Vertices that change between two readings of the clock.
constexpr std::size_t kAtOnce = 32;
/// Changes that are sorted at once.
constexpr std::size_t kSorted = 2048;
/// Below all demands.
constexpr double kNever = -1.0;

/// A vertex to be activated or deactivated, and its demand.
struct Change {
  double demand = 0.0;
  std::uint32_t vertex = 0;
  std::uint32_t entry = 0;
};
/// Those of the greatest demand first, parents before their children.
bool activates_before(const Change& a, const Change& b) {
  return a.demand != b.demand ? a.demand > b.demand : a.vertex < b.vertex;
}
bool deactivates_before(const Change& a, const Change& b) { return activates_before(b, a); }

/// A list of changes of which the first are sorted when they are needed.
template <class Before>
class Queue {
 public:
  explicit Queue(Before before) : before_(before) {}
  void clear() {
    changes_.clear();
    next_ = sorted_ = 0;
  }
  void push(const Change& change) { changes_.push_back(change); }
  [[nodiscard]] std::size_t size() const { return changes_.size() - next_; }
  [[nodiscard]] const Change& front() {
    if (next_ == sorted_) {
      const auto begin = changes_.begin() + static_cast<std::ptrdiff_t>(sorted_);
      sorted_ = std::min(changes_.size(), sorted_ + kSorted);
      const auto end = changes_.begin() + static_cast<std::ptrdiff_t>(sorted_);
      if (end != changes_.end()) std::nth_element(begin, end, changes_.end(), before_);
      std::sort(begin, end, before_);
    }
    return changes_[next_];
  }
  void pop() { ++next_; }

 private:
  Before before_;
  std::vector<Change> changes_;
  std::size_t next_ = 0, sorted_ = 0;
};

enum class Pin : std::uint8_t { none, active, inactive };

/// The demand that a vertex must exceed to be active at all, and its error where demands are equal.
struct Limit {
  double keep = kNever, error = kNever;
  [[nodiscard]] bool allows(double demand, double of_error) const {
    return demand != keep ? demand > keep : of_error > error;
  }
};

}  // namespace

struct SurfaceControl::Impl {
  Impl(const Surface& surface, const VertexTree& tree, const ViewOptions& options);

  void measure_blocks(const View& view);
  void apply_pins(std::size_t block);
  void find_limit();
  void find_changes();
  void perform_changes();
  template <class Queue, class Perform>
  bool perform(Queue& queue, std::size_t most, std::size_t kind, const Perform& perform);

  /// One more than the last entry of a block.
  [[nodiscard]] std::size_t end_of(std::size_t block) const {
    return std::min(vertices.size(), (block + 1) * kBlock);
  }
  /// Whether the vertex of an entry is wanted, apart from the lack of room.
  [[nodiscard]] bool wanted(std::size_t entry) const { return demand.want[entry] > 1.0; }
  [[nodiscard]] bool has_room(std::size_t entry, double demanded) const {
    return limit.allows(demanded, columns.error(entry));
  }
  /// The demand to compare with the limit, such that a vertex that just became active may stay.
  [[nodiscard]] double lowered(double want) const {
    return want < ViewDemand::kForced ? want * options.collapse_below : want;
  }
  [[nodiscard]] bool stays(std::size_t entry) const {
    return demand.keep[entry] >= options.collapse_below && has_room(entry, demand.keep[entry]);
  }

  ViewOptions options;
  SurfaceFront front;
  // The vertices that are not in every cut, by entry: those of similar error together, and of these
  // those close to each other in the tree. kBlock entries are a block.
  std::vector<std::uint32_t> vertices;
  std::vector<bool> active;
  ViewColumns columns;
  ViewDemand demand;      ///< of measured blocks
  std::vector<Pin> pins;  ///< empty without any
  // By block.
  std::vector<std::uint32_t> active_in;
  std::vector<bool> pinned_in;  ///< whether any vertex is pinned active
  std::vector<bool> measured;
  ViewColumns bounds;
  ViewDemand bound_demand;

  std::size_t always = 0;  ///< vertices that are in every cut
  // State of the current step.
  Limit limit;
  std::vector<std::pair<double, double>> keeps;
  Queue<decltype(&activates_before)> to_activate{&activates_before};
  Queue<decltype(&deactivates_before)> to_deactivate{&deactivates_before};
  StepMeter meter;
  SurfaceFront::Changes changes;
  Step result;
};

SurfaceControl::Impl::Impl(const Surface& surface, const VertexTree& tree,
                           const ViewOptions& view_options)
    : options(view_options), front(surface, tree), always(front.vertex_count()) {
  check(options);
  const std::size_t n = front.size();
  if (tree.errors.size() != n || tree.levels.size() != n) {
    throw std::invalid_argument("the tree is not one of the surface's vertices");
  }
  // Boxes of the vertices and their neighbours, then of all that move onto them.
  std::vector<std::uint32_t> number(n);
  for (std::uint32_t v = 0; v < n; ++v) number[front.input()[v]] = v;
  std::vector<Box3> boxes(n);
  for (std::uint32_t v = 0; v < n; ++v) boxes[v].include(front.point(VertexId{v}));
  for (const auto& face : surface.faces) {
    for (const std::uint32_t at : face) {
      for (const std::uint32_t corner : face) boxes[number[at]].include(surface.points[corner]);
    }
  }
  for (std::uint32_t v = static_cast<std::uint32_t>(n); v-- > 0;) {
    const VertexId parent = front.parent(VertexId{v});
    if (parent != kNoVertex) boxes[slot(parent)].include(boxes[v]);
  }
  const auto error = [&](std::uint32_t v) { return tree.errors[front.input()[v]]; };
  vertices.reserve(n);
  for (std::uint32_t v = 0; v < n; ++v) {
    if (front.parent(VertexId{v}) != kNoVertex) vertices.push_back(v);
  }
  const auto magnitude = [&](std::uint32_t v) {
    return error(v) > 0.0 ? std::ilogb(error(v)) : std::numeric_limits<int>::min();
  };
  std::stable_sort(vertices.begin(), vertices.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return magnitude(a) > magnitude(b); });
  columns.resize(vertices.size());
  demand.resize(vertices.size());
  active.resize(vertices.size());
  const std::size_t blocks = (vertices.size() + kBlock - 1) / kBlock;
  active_in.resize(blocks);
  measured.resize(blocks);
  bounds.resize(blocks);
  bound_demand.resize(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    ClusterRecord bound;
    unsigned highest = 0;
    for (std::size_t i = b * kBlock; i < end_of(b); ++i) {
      const std::uint32_t v = vertices[i];
      const unsigned level = tree.levels[front.input()[v]];
      columns.set(i, {boxes[v], error(v), 1}, level);
      bound.box.include(boxes[v]);
      bound.error = std::max(bound.error, error(v));
      highest = std::max(highest, level);
    }
    bounds.set(b, bound, highest);
  }
  front.start_journal();
}

// Measures the blocks, and the vertices of those that matter.
void SurfaceControl::Impl::measure_blocks(const View& view) {
  measure(view, options, bounds, 0, bounds.size(), bound_demand);
  for (std::size_t b = 0; b < bounds.size(); ++b) {
    measured[b] = active_in[b] > 0 || bound_demand.keep[b] >= options.collapse_below ||
                  bound_demand.want[b] > 1.0 || (!pins.empty() && pinned_in[b]);
    if (!measured[b]) continue;
    measure(view, options, columns, b * kBlock, end_of(b), demand);
    if (!pins.empty()) apply_pins(b);
  }
}

void SurfaceControl::Impl::apply_pins(std::size_t block) {
  for (std::size_t i = block * kBlock; i < end_of(block); ++i) {
    if (pins[i] == Pin::none) continue;
    demand.want[i] = demand.keep[i] = pins[i] == Pin::active ? ViewDemand::kForced : kNever;
  }
}

// Finds the demand above which there are at most as many vertices as there is room for.
void SurfaceControl::Impl::find_limit() {
  limit = {};
  const std::size_t room = options.max_points - std::min(options.max_points, always);
  if (vertices.size() <= room) return;
  keeps.clear();
  for (std::size_t b = 0; b < bounds.size(); ++b) {
    if (!measured[b]) continue;
    for (std::size_t i = b * kBlock; i < end_of(b); ++i) {
      if (demand.keep[i] < options.collapse_below) continue;
      keeps.emplace_back(demand.keep[i], columns.error(i));
    }
  }
  if (keeps.size() <= room) return;
  const auto first_without = keeps.begin() + static_cast<std::ptrdiff_t>(room);
  std::nth_element(keeps.begin(), first_without, keeps.end(), std::greater<>());
  limit = {first_without->first, first_without->second};
}

void SurfaceControl::Impl::find_changes() {
  to_activate.clear();
  to_deactivate.clear();
  for (std::size_t b = 0; b < bounds.size(); ++b) {
    if (!measured[b]) continue;
    for (std::size_t i = b * kBlock; i < end_of(b); ++i) {
      const auto entry = static_cast<std::uint32_t>(i);
      if (active[i]) {
        if (!stays(i)) to_deactivate.push({demand.keep[i], vertices[i], entry});
      } else if (wanted(i)) {
        if (has_room(i, lowered(demand.want[i]))) {
          to_activate.push({demand.want[i], vertices[i], entry});
        } else {
          ++result.blocked;
          result.worst = std::max(result.worst, demand.want[i]);
        }
      }
    }
  }
}

/// Performs up to `most` changes while there is time. Returns false if there is none left.
template <class Queue, class Perform>
bool SurfaceControl::Impl::perform(Queue& queue, std::size_t most, std::size_t kind,
                                   const Perform& perform) {
  for (most = std::min(most, queue.size()); most > 0;) {
    const std::size_t now = std::min(most, kAtOnce);
    if (!meter.has_time(now, kind)) return false;
    for (std::size_t i = 0; i < now; ++i) {
      perform(queue.front());
      queue.pop();
    }
    meter.spend(now, kind);
    most -= now;
  }
  return true;
}

// Vertices to be deactivated give way where there is no room, and first of all if they are many.
void SurfaceControl::Impl::perform_changes() {
  const auto activate = [&](const Change& change) {
    front.activate(VertexId{change.vertex});
    active[change.entry] = true;
    ++active_in[change.entry / kBlock];
    ++result.activated;
  };
  const auto deactivate = [&](const Change& change) {
    front.deactivate(VertexId{change.vertex});
    active[change.entry] = false;
    --active_in[change.entry / kBlock];
    ++result.deactivated;
  };
  const auto remove = [&](std::size_t most) {
    return perform(to_deactivate, most, StepMeter::kCollapse, deactivate);
  };
  const std::size_t many = front.vertex_count() / 4;
  bool has_time = to_deactivate.size() <= many || remove(to_deactivate.size() - many);
  while (has_time && to_activate.size() > 0) {
    const std::size_t room =
        options.max_points - std::min(options.max_points, front.vertex_count());
    has_time = room > 0 ? perform(to_activate, room, StepMeter::kExpand, activate)
                        : to_deactivate.size() > 0 && remove(kAtOnce);
  }
  if (has_time) remove(to_deactivate.size());
  result.pending = to_activate.size();
  if (to_activate.size() > 0) result.worst = std::max(result.worst, to_activate.front().demand);
  result.settled =
      to_activate.size() + to_deactivate.size() == 0 && result.activated + result.deactivated == 0;
}

SurfaceControl::SurfaceControl(const Surface& surface, const VertexTree& tree,
                               const ViewOptions& options)
    : impl_(std::make_unique<Impl>(surface, tree, options)) {}
SurfaceControl::~SurfaceControl() = default;

const SurfaceFront& SurfaceControl::front() const { return impl_->front; }

auto SurfaceControl::step(const View& view, const StepBudget& budget) -> const Step& {
  Impl& i = *impl_;
  check(view);
  i.meter.start(budget);
  i.result = {};
  i.measure_blocks(view);
  i.find_limit();
  i.find_changes();
  i.meter.end_fixed_work();
  i.perform_changes();
  i.front.take_changes(i.changes);
  i.meter.end();
  i.result.changes = &i.changes;
  return i.result;
}

void SurfaceControl::pin(std::span<const VertexId> active, std::span<const VertexId> inactive) {
  Impl& i = *impl_;
  std::vector<Pin> of(i.front.size(), Pin::none);
  for (VertexId v : active) {
    for (; v != kNoVertex && of[slot(v)] == Pin::none; v = i.front.parent(v)) {
      of[slot(v)] = Pin::active;
    }
  }
  for (const VertexId v : inactive) {
    const auto begin = of.begin();
    std::fill(begin + slot(v), begin + i.front.end_of_descendants(v), Pin::inactive);
  }
  i.pins.assign(i.vertices.size(), Pin::none);
  i.pinned_in.assign(i.bounds.size(), false);
  for (std::size_t entry = 0; entry < i.vertices.size(); ++entry) {
    i.pins[entry] = of[i.vertices[entry]];
    if (i.pins[entry] == Pin::active) i.pinned_in[entry / kBlock] = true;
  }
  if (active.empty() && inactive.empty()) i.pins.clear();
}

std::size_t SurfaceControl::memory_bytes() const {
  const Impl& i = *impl_;
  std::size_t bytes = i.columns.memory() + i.bounds.memory() +
                      (i.vertices.capacity() + i.active_in.capacity()) * sizeof(std::uint32_t) +
                      (i.active.capacity() + i.measured.capacity() + i.pinned_in.capacity()) / 8 +
                      i.pins.capacity() + i.keeps.capacity() * sizeof(i.keeps[0]);
  for (const ViewDemand* demand : {&i.demand, &i.bound_demand}) {
    bytes += 3 * demand->want.capacity() * sizeof(double);
  }
  return bytes;
}

}  // namespace terrace::tri
