// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/store_query.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <iterator>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "io/text.hpp"
#include "store/read/view.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kInnerBytes = std::uint64_t{6} << 20;
constexpr double kFar = std::numeric_limits<double>::infinity();
/// Upper bound of the rounding of a sum of three products, relative to the sum of their magnitudes.
constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();

/// Returns the length of a vector, without overflow or underflow of squares; infinite if a double
/// cannot represent it.
double norm(const Point3& v) {
  const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  if (largest > 1e-140 && largest < 1e140)
    return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (largest == 0.0) return 0.0;
  if (!(largest < kFar)) return kFar;
  int exponent = 0;
  static_cast<void>(std::frexp(largest, &exponent));
  double square = 0;
  for (const double c : v) {
    const double scaled = std::ldexp(c, -exponent);
    square += scaled * scaled;
  }
  return std::ldexp(std::sqrt(square), exponent);
}

/// Returns half of a - b, which is finite for finite numbers.
Point3 half_way(const Point3& a, const Point3& b) {
  return {0.5 * a[0] - 0.5 * b[0], 0.5 * a[1] - 0.5 * b[1], 0.5 * a[2] - 0.5 * b[2]};
}

double distance_of(const LinearMap& map, const Point3& a, const Point3& b) {
  const Point3 half = half_way(a, b);
  Point3 mapped;
  for (std::size_t row = 0; row < 3; ++row) {
    mapped[row] = map[3 * row] * half[0] + map[3 * row + 1] * half[1] + map[3 * row + 2] * half[2];
    if (std::isnan(mapped[row])) mapped[row] = kFar;  // if terms are infinite
  }
  return 2 * norm(mapped);
}

/// Returns a lower bound of distance_of() from `place` to any point in the box, including rounding:
/// the distance to the box around the mapped box.
double min_distance(const LinearMap& map, const Point3& place, const Box3& box) {
  const Point3 low = half_way(box.min, place), high = half_way(box.max, place);
  Point3 out;
  for (std::size_t row = 0; row < 3; ++row) {
    double lower = 0, upper = 0, terms = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double a = map[3 * row + axis] * low[axis], b = map[3 * row + axis] * high[axis];
      lower += std::min(a, b);
      upper += std::max(a, b);
      terms += std::max(std::abs(a), std::abs(b));
    }
    const double slack = kRounding * terms;
    const double gap = std::max(lower - slack, -(upper + slack));
    out[row] = gap > 0.0 ? gap : 0.0;  // also if infinite terms give NaN
  }
  // Finite, so that a box is not skipped because its distance overflows.
  return std::min(2 * norm(out) * (1 - kRounding), std::numeric_limits<double>::max());
}

bool is_nearer(const FoundPoint& a, const FoundPoint& b) {
  if (a.distance != b.distance) return a.distance < b.distance;
  if (a.position != b.position) return a.position < b.position;
  return a.cluster != b.cluster ? a.cluster < b.cluster : a.member < b.member;
}

/// Returns the share of `other` that is inside `box`; 1 if `other` has no extent. Requires that
/// they intersect.
double share_inside(const Box3& box, const Box3& other) {
  double share = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Halves, because the whole length may overflow.
    const double length = 0.5 * other.max[axis] - 0.5 * other.min[axis];
    const double inside = 0.5 * std::min(box.max[axis], other.max[axis]) -
                          0.5 * std::max(box.min[axis], other.min[axis]);
    if (length > 0.0) share *= inside / length;
  }
  return share;
}

}  // namespace

StoreQuery::StoreQuery(const Store& store, std::uint64_t leaf_bytes)
    : store_(store),
      leaves_{.max_bytes = leaf_bytes},
      inner_{.max_bytes = kInnerBytes},
      wanted_(store.top() + 1) {
  for (const LevelInfo& level : store.levels()) clusters_ += level.clusters;
  fill(root_, store.root());
}

void StoreQuery::check_traversal(std::uint64_t clusters) const {
  if (clusters <= clusters_) return;
  throw Error(store_.path().string(),
              "the hierarchy is damaged: clusters are headed by several points")
      .remedy("restore the files or rebuild the store");
}

void StoreQuery::fill(Node& node, ClusterId id) {
  const unsigned level = level_of(id);
  node.id = id;
  node.store_ = &store_;
  node.members_.clear();
  node.branches_.clear();
  if (level == 0 && !store_.may_match(id)) {
    node.positions.clear();
    node.bytes = sizeof(Node) + 64;
    return;
  }
  store_.read(id, points_);
  if (points_.matches.empty()) {
    // Swapped, not copied: the next cluster is read into the node's former memory.
    std::swap(node.positions, points_.positions);
  } else {
    node.positions.clear();
    for (std::uint32_t i = 0; i < points_.size(); ++i) node.members_.push_back(i);
    const auto others = std::stable_partition(node.members_.begin(), node.members_.end(),
                                              [this](std::uint32_t i) { return points_.match(i); });
    for (auto i = node.members_.begin(); i != others; ++i) {
      node.positions.push_back(points_.positions[*i]);
    }
    if (level == 0) node.members_.erase(others, node.members_.end());
  }
  const std::size_t heads = level == 0 ? 0 : points_.children.size() / level;
  for (std::size_t i = 0; i < heads; ++i) {
    for (unsigned below = 0; below < level; ++below) {
      const std::uint64_t ordinal = points_.children[node.member(i) * level + below];
      node.branches_.push_back({store_.coarse_box(cluster_id(below, ordinal)), ordinal, 0});
    }
  }
  // Includes the node itself and its entries in the list and the map.
  node.bytes = node.positions.capacity() * sizeof(Point3) +
               node.members_.capacity() * sizeof(std::uint32_t) +
               node.branches_.capacity() * sizeof(Branch) + sizeof(Node) + 64;
}

void StoreQuery::Cache::drop(Nodes& to) {
  by_id.erase(static_cast<std::uint64_t>(nodes.back().id));
  held_bytes -= nodes.back().bytes;
  to.splice(to.begin(), nodes, std::prev(nodes.end()));
}

void StoreQuery::Node::look_up(Branch& branch, unsigned below) const {
  const ClusterSummary summary = store_->record(cluster_id(below, branch.ordinal)).summary;
  branch.box = summary.box;
  branch.descendants = summary.descendants;
}

const StoreQuery::Node& StoreQuery::node(ClusterId id) {
  if (id == root_.id) return root_;
  Cache& cache = level_of(id) == 0 ? leaves_ : inner_;
  if (cache.max_bytes == 0) {
    fill(uncached_, id);
    return uncached_;
  }
  const auto key = static_cast<std::uint64_t>(id);
  if (const auto entry = cache.by_id.find(key); entry != cache.by_id.end()) {
    cache.nodes.splice(cache.nodes.begin(), cache.nodes, entry->second);
    return cache.nodes.front();
  }
  // The memory of a dropped node is reused for the new one. The new node is not in a map until it
  // is complete, so damage leaves no trace.
  Nodes new_nodes, dropped;
  if (cache.held_bytes >= cache.max_bytes && !cache.nodes.empty()) {
    cache.drop(new_nodes);
  } else {
    new_nodes.emplace_front();
  }
  fill(new_nodes.front(), id);
  cache.held_bytes += new_nodes.front().bytes;
  cache.nodes.splice(cache.nodes.begin(), new_nodes);
  cache.by_id[key] = cache.nodes.begin();
  while (cache.held_bytes > cache.max_bytes && cache.nodes.size() > 1) cache.drop(dropped);
  return cache.nodes.front();
}

std::vector<std::byte> StoreQuery::attributes(std::span<const FoundPoint> found) const {
  const std::size_t size = store_.schema().payload_size();
  std::vector<std::byte> values(found.size() * size);
  if (values.empty()) return values;
  std::vector<std::size_t> by_cluster(found.size());
  std::iota(by_cluster.begin(), by_cluster.end(), std::size_t{0});
  std::sort(by_cluster.begin(), by_cluster.end(),
            [&](std::size_t a, std::size_t b) { return found[a].cluster < found[b].cluster; });
  ClusterPoints points;
  std::optional<ClusterId> read;
  for (const std::size_t i : by_cluster) {
    if (read != found[i].cluster) store_.read(found[i].cluster, points);
    read = found[i].cluster;
    std::memcpy(values.data() + i * size, points.payload.data() + found[i].member * size, size);
  }
  return values;
}

std::vector<FoundPoint> StoreQuery::in_box(const Box3& box, unsigned level) {
  std::vector<FoundPoint> points;
  descend(
      level, [&](unsigned, const Branch& branch) { return box.intersects(branch.box); },
      [&](const Node& node) {
        for (std::size_t i = 0; i < node.positions.size(); ++i) {
          if (!box.contains(node.positions[i])) continue;
          points.push_back(
              {.position = node.positions[i], .cluster = node.id, .member = node.member(i)});
        }
      });
  return points;
}

std::vector<FoundPoint> StoreQuery::within(const Point3& place, double radius,
                                           const LinearMap& metric, unsigned level) {
  assert(radius - radius == 0.0);
  std::vector<FoundPoint> points;
  descend(
      level,
      [&](unsigned, const Branch& branch) {
        return min_distance(metric, place, branch.box) <= radius;
      },
      [&](const Node& node) {
        for (std::size_t i = 0; i < node.positions.size(); ++i) {
          const double distance = distance_of(metric, node.positions[i], place);
          if (!(distance <= radius)) continue;
          points.push_back({.position = node.positions[i],
                            .cluster = node.id,
                            .member = node.member(i),
                            .distance = distance});
        }
      });
  std::sort(points.begin(), points.end(), is_nearer);
  return points;
}

std::vector<FoundPoint> StoreQuery::nearest(const Point3& place, std::size_t count,
                                            const LinearMap& metric, unsigned level) {
  std::vector<FoundPoint> points;  // a heap with the farthest on top
  if (count == 0) return points;
  best_first(
      level, [&](unsigned, const Box3& box) { return min_distance(metric, place, box); },
      [&](const Node& node) {
        for (std::size_t i = 0; i < node.positions.size(); ++i) {
          const FoundPoint point{.position = node.positions[i],
                                 .cluster = node.id,
                                 .member = node.member(i),
                                 .distance = distance_of(metric, node.positions[i], place)};
          if (points.size() == count) {
            if (!is_nearer(point, points.front())) continue;
            std::pop_heap(points.begin(), points.end(), is_nearer);
            points.back() = point;
          } else {
            points.push_back(point);
          }
          std::push_heap(points.begin(), points.end(), is_nearer);
        }
        return points.size() < count ? kFar : points.front().distance;
      });
  std::sort_heap(points.begin(), points.end(), is_nearer);
  return points;
}

std::uint64_t StoreQuery::count(const Box3& box, unsigned level) {
  std::uint64_t sum = 0;
  if (level > 0 || store_.condition() != nullptr) {
    descend(
        level, [&](unsigned, const Branch& branch) { return box.intersects(branch.box); },
        [&](const Node& node) {
          for (const Point3& p : node.positions) sum += box.contains(p) ? 1 : 0;
        });
    return sum;
  }
  std::vector<std::uint64_t> border;
  cut(
      box,
      [&](const Point3* head, const Branch& branch) {
        if (box.contains(branch.box.min) && box.contains(branch.box.max)) {
          sum += branch.descendants;
          return true;
        }
        sum += box.contains(*head) ? 1 : 0;
        border.push_back(branch.ordinal);
        return true;
      },
      [](const Branch&) { return true; });
  std::sort(border.begin(), border.end());
  ClusterPoints points;
  for (std::span<const std::uint64_t> rest = border; !rest.empty();) {
    const std::size_t count = store_.prefetch(Store::Part::cluster, 0, rest);
    for (const std::uint64_t ordinal : rest.first(count)) {
      store_.read(cluster_id(0, ordinal), points);
      for (const Point3& p : points.positions) sum += box.contains(p) ? 1 : 0;
    }
    rest = rest.subspan(count);
  }
  return sum;
}

double StoreQuery::estimate(const Box3& box, double limit) {
  double sum = 0.0;
  cut(
      box,
      [&](const Point3*, const Branch& branch) {
        sum += static_cast<double>(branch.descendants) * share_inside(box, branch.box);
        return sum <= limit;
      },
      [](const Branch&) { return true; });
  return sum;
}

/// The view of the points that meet a condition.
class Store::ConditionView final : public Store::View {
 public:
  explicit ConditionView(Where condition) : condition_(std::move(condition)) {}

  const Where& condition() const override { return condition_; }

  void mark(ClusterPoints& points) const override {
    points.matches.resize(points.size());
    condition_.test(points.positions, points.payload, points.matches);
  }

  bool may_match(const Store& view, ClusterId id) const override {
    return condition_.possible(world_box(view.schema(), view.record(id).summary.box),
                               view.attribute_ranges(id));
  }

  const Box3& bounds(const Store& view) const override {
    std::call_once(once_, [&] { find_bounds(view); });
    if (bounds_.empty()) {
      throw Error(view.path().string(),
                  "no point meets the condition " + in_quotes(condition_.text()))
          .remedy(message("give another {where}"));
    }
    return bounds_;
  }

 private:
  void find_bounds(const Store& view) const {
    Box3 bounds;
    StoreQuery(view).descend(
        0,
        [&](unsigned, const StoreQuery::Branch& branch) {
          return !(bounds.contains(branch.box.min) && bounds.contains(branch.box.max));
        },
        [&](const StoreQuery::Node& node) {
          for (const Point3& p : node.positions) bounds.include(p);
        });
    bounds_ = bounds;
  }

  Where condition_;
  mutable std::once_flag once_;
  mutable Box3 bounds_;
};

Store Store::where(const std::string& condition) const {
  if (condition.empty()) return *this;
  Where parsed(condition, schema());
  if (view_)
    parsed = Where(fmt::format("({}) && ({})", view_->condition().text(), condition), schema());
  Store view = *this;
  view.view_ = std::make_shared<const ConditionView>(std::move(parsed));
  return view;
}

}  // namespace terrace::stream
