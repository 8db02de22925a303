// SPDX-License-Identifier: Apache-2.0
#include "format/copc/octree_builder.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>

#include <fmt/core.h>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Cells along a side, as powers of two: of the finest lattice, and of a node's grid.
constexpr unsigned kCellBits = 30, kSpanBits = 7;
static_assert(OctreeBuilder::kSpan == 1U << kSpanBits);
constexpr unsigned kDeepestLeaf = kCellBits - kSpanBits;
/// Depths that are distributed in one pass, to 64 buckets.
constexpr unsigned kDepthsAtOnce = 2;
constexpr std::size_t kChildren = 8;

/// Returns the number of the child that contains the cell, in a node at `depth`.
std::size_t child_of(const std::array<std::uint32_t, 3>& cell, unsigned depth) {
  const unsigned shift = kCellBits - 1 - depth;
  return ((cell[0] >> shift) & 1U) | ((cell[1] >> shift) & 1U) << 1U |
         ((cell[2] >> shift) & 1U) << 2U;
}

OctreeNode child(const OctreeNode& node, std::size_t number) {
  OctreeNode child{.depth = node.depth + 1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    child.position[axis] =
        2 * node.position[axis] + static_cast<std::uint32_t>((number >> axis) & 1U);
  }
  return child;
}

/// Hash of the coordinates (with the finaliser of MurmurHash3 by A. Appleby).
std::uint64_t hash_of(const std::array<std::int32_t, 3>& place) {
  std::uint64_t hash = 0;
  for (const std::int32_t coordinate : place) {
    hash = (hash ^ static_cast<std::uint32_t>(coordinate)) * 0x9e3779b97f4a7c15U;
    hash = (hash ^ (hash >> 33U)) * 0xff51afd7ed558ccdU;
    hash = (hash ^ (hash >> 33U)) * 0xc4ceb9fe1a85ec53U;
    hash ^= hash >> 33U;
  }
  return hash;
}

}  // namespace

/// A point on its way to a node.
struct OctreeBuilder::Item {
  std::array<std::uint32_t, 3> cell{};
  std::uint32_t index = 0;  ///< of its record in NodePoints::records
  std::uint64_t rank = 0;   ///< the lowest-ranked point of a cell is promoted
  std::uint64_t number = 0;

  [[nodiscard]] bool precedes(const Item& other) const {
    return std::tie(rank, number) < std::tie(other.rank, other.number);
  }
};

/// The points that a node has before its parent takes some of them.
struct OctreeBuilder::NodePoints {
  OctreeNode node{};
  std::vector<Item> items{};  ///< in Morton order
  std::vector<std::byte> records{};

  void add(Item item, std::span<const std::byte> record) {
    item.index = static_cast<std::uint32_t>(items.size());
    items.push_back(item);
    records.insert(records.end(), record.begin(), record.end());
  }
};

/// A subtree that one thread builds.
struct OctreeBuilder::Subtree {
  OctreeNode node{};
  std::span<const Item> items{};
  NodePoints points{};  ///< of the node
  std::vector<std::pair<OctreeNode, std::vector<std::byte>>> written{};
};

std::span<const std::byte> OctreeBuilder::record_of(const NodePoints& points,
                                                    const Item& item) const {
  return std::span(points.records)
      .subspan(std::size_t{item.index} * numbered_bytes_, numbered_bytes_);
}

std::uint64_t OctreeBuilder::bytes_with(std::size_t record_bytes, std::size_t batch_records) {
  // The unwritten tails of 64 buckets for each pass; ten billion points take three or four passes.
  constexpr std::uint64_t kBuckets = 8u << 20;
  const std::uint64_t item_bytes = record_bytes + sizeof(std::uint64_t) + sizeof(Item);
  // Unfinished nodes hold copies of the records in memory, in vectors with spare capacity, and wait
  // to be written. A node, its child and the bytes being written for it come on top.
  return kBuckets + batch_records * (3 * item_bytes + record_bytes) +
         kChildren * kMaxPromoted * (2 * item_bytes + record_bytes);
}

OctreeBuilder::OctreeBuilder(const std::string& name, const std::filesystem::path& folder,
                             std::size_t record_bytes, std::size_t batch_records,
                             std::uint64_t max_deep_points, unsigned threads)
    : name_(name),
      record_bytes_(record_bytes),
      numbered_bytes_(record_bytes + sizeof(std::uint64_t)),
      batch_records_(std::max(batch_records, kLeafPoints)),
      max_deep_points_(std::max<std::uint64_t>(max_deep_points, batch_records_)),
      file_(name, folder, numbered_bytes_),
      numbered_(numbered_bytes_),
      team_(threads) {}

void OctreeBuilder::add(std::span<const std::byte> records) {
  assert(records.size() % record_bytes_ == 0);
  for (; !records.empty(); records = records.subspan(record_bytes_)) {
    std::copy_n(records.begin(), record_bytes_, numbered_.begin());
    std::memcpy(numbered_.data() + record_bytes_, &points_, sizeof points_);
    file_.append(all_, numbered_);
    ++points_;
  }
}

void OctreeBuilder::build(const Octree& octree, const Lattice& lattice, const Write& write) {
  lattice_ = lattice;
  const Box3 cube = octree.box(OctreeNode{});
  corner_ = cube.min;
  side_ = 2 * octree.half_size;
  write_ = &write;
  if (points_ == 0) return;
  NodePoints root = build(OctreeNode{}, std::move(all_));
  this->write(root, write);
}

std::array<std::uint32_t, 3> OctreeBuilder::cell_of(const std::byte* record) const {
  constexpr double kCells = 1U << kCellBits;
  std::array<std::uint32_t, 3> cell{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int32_t step = 0;
    std::memcpy(&step, record + axis * sizeof step, sizeof step);
    const double coordinate = step * lattice_.scale[axis] + lattice_.offset[axis];
    const double at = (coordinate - corner_[axis]) / side_ * kCells;
    cell[axis] = static_cast<std::uint32_t>(std::clamp(at, 0.0, kCells - 1));
  }
  return cell;
}

OctreeBuilder::NodePoints OctreeBuilder::build(const OctreeNode& node, Bucket bucket) {
  if (file_.records(bucket) <= batch_records_ || node.depth == kDeepestLeaf) {
    return build_in_memory(node, std::move(bucket));
  }
  const unsigned depths = std::min(kDepthsAtOnce, kDeepestLeaf - node.depth);
  std::vector<Bucket> buckets(std::size_t{1} << (3 * depths));
  std::vector<std::byte> records;
  while (file_.records(bucket) > 0) {
    file_.take(bucket, batch_records_ / 8, records);
    for (std::size_t at = 0; at < records.size(); at += numbered_bytes_) {
      const auto cell = cell_of(records.data() + at);
      std::size_t index = 0;
      for (unsigned depth = node.depth; depth < node.depth + depths; ++depth) {
        index = index * kChildren + child_of(cell, depth);
      }
      file_.append(buckets[index], std::span(records).subspan(at, numbered_bytes_));
    }
  }
  return visit(node, buckets);
}

/// buckets: one for each of the node's descendants at some depth, in Morton order.
OctreeBuilder::NodePoints OctreeBuilder::visit(const OctreeNode& node, std::span<Bucket> buckets) {
  if (buckets.size() == 1) return build(node, std::move(buckets.front()));
  const auto records = [this](std::span<const Bucket> child_buckets) {
    std::uint64_t sum = 0;
    for (const Bucket& bucket : child_buckets) sum += file_.records(bucket);
    return sum;
  };
  if (records(buckets) <= batch_records_) {
    Bucket merged;
    for (Bucket& bucket : buckets) merged.append(std::move(bucket));
    return build_in_memory(node, std::move(merged));
  }
  Bucket promoted;
  const std::size_t each = buckets.size() / kChildren;
  for (std::size_t i = 0; i < kChildren; ++i) {
    const std::span<Bucket> child_buckets = buckets.subspan(i * each, each);
    if (records(child_buckets) == 0) continue;
    promote(
        visit(child(node, i), child_buckets), *write_,
        [&](const Item&, std::span<const std::byte> record) { file_.append(promoted, record); });
  }
  // The promoted points are in Morton order, because the children are.
  return load(node, std::move(promoted));
}

OctreeBuilder::NodePoints OctreeBuilder::load(const OctreeNode& node, Bucket bucket) {
  NodePoints points{.node = node};
  const std::uint64_t count = file_.records(bucket);
  file_.take(bucket, count, points.records);
  assert(points.records.size() == count * numbered_bytes_);
  points.items.resize(count);
  constexpr std::size_t kEach = 16384;
  team_.run((count + kEach - 1) / kEach, [&](std::size_t part, std::size_t) {
    for (std::size_t i = part * kEach; i < std::min(count, (part + 1) * kEach); ++i) {
      const std::byte* const record = points.records.data() + i * numbered_bytes_;
      Item& item = points.items[i];
      std::array<std::int32_t, 3> place{};
      std::memcpy(place.data(), record, sizeof place);
      item = {
          .cell = cell_of(record), .index = static_cast<std::uint32_t>(i), .rank = hash_of(place)};
      std::memcpy(&item.number, record + record_bytes_, sizeof item.number);
    }
  });
  return points;
}

OctreeBuilder::NodePoints OctreeBuilder::build_in_memory(const OctreeNode& node, Bucket bucket) {
  const std::uint64_t count = file_.records(bucket);
  if (count > max_deep_points_) {
    throw Error(
        name_,
        fmt::format("{} are in one place, more than a node of COPC can have in this memory: {}",
                    counted(count, "point"), max_deep_points_))
        .remedy(message("raise {memory_bytes}, leave them out, or write LAZ"));
  }
  NodePoints points = load(node, std::move(bucket));
  sort(points.items, node.depth);
  // One thread builds each subtree below the next depths.
  const unsigned lowest = std::min(node.depth + kDepthsAtOnce, kDeepestLeaf);
  const auto is_leaf = [](const OctreeNode& at, std::span<const Item> items) {
    return items.size() <= kLeafPoints || at.depth == kDeepestLeaf;
  };
  const auto is_task = [&](const OctreeNode& at, std::span<const Item> items) {
    return at.depth == lowest || is_leaf(at, items);
  };
  std::vector<Subtree> tasks;
  plan(node, points.items, is_task, tasks);
  team_.run(tasks.size(), [&](std::size_t i, std::size_t) {
    Subtree& task = tasks[i];
    const auto copied = [&](const OctreeNode& at, std::span<const Item> items) {
      NodePoints leaf{.node = at};
      leaf.items.reserve(items.size());
      leaf.records.reserve(items.size() * numbered_bytes_);
      for (const Item& item : items) leaf.add(item, record_of(points, item));
      return leaf;
    };
    task.points = combine(task.node, task.items, is_leaf, copied,
                          [&task](const OctreeNode& at, std::span<const std::byte> records) {
                            task.written.emplace_back(
                                at, std::vector<std::byte>(records.begin(), records.end()));
                          });
  });
  std::size_t next = 0;
  const auto built = [&](const OctreeNode&, std::span<const Item>) {
    Subtree task = std::move(tasks[next++]);
    for (const auto& [at, records] : task.written) (*write_)(at, records);
    return std::move(task.points);
  };
  return combine(node, points.items, is_task, built, *write_);
}

/// Sorts items in Morton order. depth: of the node that contains all of them.
void OctreeBuilder::sort(std::vector<Item>& items, unsigned depth) {
  const unsigned depths = std::min(kDepthsAtOnce, kDeepestLeaf - depth);
  const auto part_of = [&](const Item& item) {
    std::size_t part = 0;
    for (unsigned at = depth; at < depth + depths; ++at) {
      part = part * kChildren + child_of(item.cell, at);
    }
    return part;
  };
  std::vector<std::size_t> begins((std::size_t{1} << (3 * depths)) + 1, 0);
  for (const Item& item : items) ++begins[part_of(item) + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<Item> parted(items.size());
  std::vector<std::size_t> next(begins.begin(), begins.end() - 1);
  for (const Item& item : items) parted[next[part_of(item)]++] = item;
  items.swap(parted);
  team_.run(begins.size() - 1, [&](std::size_t part, std::size_t) {
    const auto at = [&](std::size_t i) { return items.begin() + static_cast<std::ptrdiff_t>(i); };
    std::sort(at(begins[part]), at(begins[part + 1]), [](const Item& a, const Item& b) {
      // The axis whose cells differ in the highest bit decides; in a tie z, then y.
      std::uint32_t highest_difference = 0;
      bool less = a.number < b.number;
      for (const std::size_t axis : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
        const std::uint32_t differ = a.cell[axis] ^ b.cell[axis];
        if (highest_difference < differ && highest_difference < (differ ^ highest_difference)) {
          highest_difference = differ;
          less = a.cell[axis] < b.cell[axis];
        }
      }
      return less;
    });
  });
}

/// Calls visit(child, items) for each child of a node that contains some of its items.
template <class Item, class Visit>
void for_each_child(const OctreeNode& node, std::span<const Item> items, const Visit& visit) {
  for (std::size_t i = 0; i < kChildren; ++i) {
    const auto end = std::partition_point(items.begin(), items.end(), [&](const Item& item) {
      return child_of(item.cell, node.depth) <= i;
    });
    const auto count = static_cast<std::size_t>(end - items.begin());
    if (count > 0) visit(child(node, i), items.first(count));
    items = items.subspan(count);
  }
}

template <class Stop>
void OctreeBuilder::plan(const OctreeNode& node, std::span<const Item> items, const Stop& stop,
                         std::vector<Subtree>& tasks) const {
  if (stop(node, items)) {
    tasks.push_back({.node = node, .items = items});
    return;
  }
  for_each_child(node, items, [&](const OctreeNode& child, std::span<const Item> child_items) {
    plan(child, child_items, stop, tasks);
  });
}

template <class Stop, class Leaf>
OctreeBuilder::NodePoints OctreeBuilder::combine(const OctreeNode& node,
                                                 std::span<const Item> items, const Stop& stop,
                                                 const Leaf& leaf, const Write& write) const {
  if (stop(node, items)) return leaf(node, items);
  NodePoints points{.node = node};
  for_each_child(node, items, [&](const OctreeNode& child, std::span<const Item> child_items) {
    promote(combine(child, child_items, stop, leaf, write), write,
            [&](Item item, std::span<const std::byte> record) { points.add(item, record); });
  });
  return points;
}

/// Promotes one point of each of the parent's cells to the parent, and writes the child's rest.
template <class Add>
void OctreeBuilder::promote(NodePoints child, const Write& write, const Add& add) const {
  const unsigned shift = kCellBits - kSpanBits - (child.node.depth - 1);
  std::vector<Item>& items = child.items;
  const auto same_cell = [shift](const Item& a, const Item& b) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((a.cell[axis] >> shift) != (b.cell[axis] >> shift)) return false;
    }
    return true;
  };
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i == 0 || !same_cell(items[i - 1], items[i])) {
      chosen.push_back(i);
    } else if (items[i].precedes(items[chosen.back()])) {
      chosen.back() = i;
    }
  }
  if (chosen.size() > kMaxPromoted) {
    const auto end = chosen.begin() + static_cast<std::ptrdiff_t>(kMaxPromoted);
    std::nth_element(chosen.begin(), end, chosen.end(),
                     [&](std::size_t a, std::size_t b) { return items[a].precedes(items[b]); });
    chosen.erase(end, chosen.end());
    std::sort(chosen.begin(), chosen.end());
  }
  std::size_t item_bytes = 0, next = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (next < chosen.size() && chosen[next] == i) {
      add(items[i], record_of(child, items[i]));
      ++next;
    } else {
      items[item_bytes++] = items[i];
    }
  }
  items.resize(item_bytes);
  this->write(child, write);
}

void OctreeBuilder::write(NodePoints& node, const Write& write) const {
  std::sort(node.items.begin(), node.items.end(),
            [](const Item& a, const Item& b) { return a.number < b.number; });
  std::vector<std::byte> records;
  records.reserve(node.items.size() * record_bytes_);
  for (const Item& item : node.items) {
    const auto record = record_of(node, item).first(record_bytes_);
    records.insert(records.end(), record.begin(), record.end());
  }
  node.node.points = node.items.size();
  write(node.node, records);
}

}  // namespace terrace::stream
