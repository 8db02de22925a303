// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/base/thread_team.hpp>

#include "format/octree.hpp"
#include "order/point_buckets.hpp"
#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"

namespace terrace::stream {

/// Distributes any number of points among the nodes of an octree, through a temporary file.
///
/// A node with few points in its cube keeps them all. Any other node keeps one point for each cell
/// of a grid, kSpan cells along a side; the rest go deeper. The nodes down to any depth are thus a
/// cloud as even as the points allow. A hash of the coordinates chooses the point of a cell: the
/// octree depends on the points and their order, not on how much fits into memory.
///
/// Time O(points * depth). Memory: bytes_with().
class OctreeBuilder {
 public:
  static constexpr unsigned kSpan = 128;
  /// Nodes with at most this many points in and below them are leaves.
  static constexpr std::size_t kLeafPoints = std::size_t{1} << 15;
  /// Upper limit of the points that a child promotes to its parent, which gets at most eight times
  /// as many. Surfaces promote fewer; only clouds that fill space reach the limit.
  static constexpr std::size_t kMaxPromoted = std::size_t{1} << 14;

  /// Upper bound of the memory held, in bytes, with `batch_records` records in memory.
  static std::uint64_t bytes_with(std::size_t record_bytes, std::size_t batch_records);

  /// Receives a node and its records, if any, in the order in which they were added. Children come
  /// before their parents.
  using Write = std::function<void(const OctreeNode& node, std::span<const std::byte> records)>;

  /// Records begin with x, y and z as int32. name: of the output, for messages. folder: for the
  /// temporary file. batch_records: the number of records in memory, at least kLeafPoints.
  /// max_deep_points: limit of the points in one of the deepest nodes. threads: how many work on
  /// the records in memory. Results depend neither on batch_records nor on threads.
  OctreeBuilder(const std::string& name, const std::filesystem::path& folder,
                std::size_t record_bytes, std::size_t batch_records, std::uint64_t max_deep_points,
                unsigned threads = 1);

  /// Throws: Error, mostly if the disk is full.
  void add(std::span<const std::byte> records);
  /// Builds the nodes. Called once, after all points. The cube of `octree` must enclose them.
  /// Throws: Error if one of the deepest nodes has more than `max_deep_points` points; what `write`
  /// throws.
  void build(const Octree& octree, const Lattice& lattice, const Write& write);

 private:
  struct Item;
  struct NodePoints;
  struct Subtree;

  [[nodiscard]] std::array<std::uint32_t, 3> cell_of(const std::byte* record) const;
  /// Returns the record of an item, followed by its number.
  [[nodiscard]] std::span<const std::byte> record_of(const NodePoints& points,
                                                     const Item& item) const;
  /// Takes the records out of a bucket and computes their items.
  NodePoints load(const OctreeNode& node, Bucket bucket);
  NodePoints build(const OctreeNode& node, Bucket bucket);
  NodePoints visit(const OctreeNode& node, std::span<Bucket> buckets);
  NodePoints build_in_memory(const OctreeNode& node, Bucket bucket);
  void sort(std::vector<Item>& items, unsigned depth);
  /// Appends to `tasks` the topmost nodes where stop(node, items) is true.
  template <class Stop>
  void plan(const OctreeNode& node, std::span<const Item> items, const Stop& stop,
            std::vector<Subtree>& tasks) const;
  /// Returns the node's points after its descendants have got theirs. Where stop(node, items) is
  /// true, leaf(node, items) makes them.
  template <class Stop, class Leaf>
  NodePoints combine(const OctreeNode& node, std::span<const Item> items, const Stop& stop,
                     const Leaf& leaf, const Write& write) const;
  template <class Add>
  void promote(NodePoints child, const Write& write, const Add& add) const;
  void write(NodePoints& node, const Write& write) const;

  std::string name_;
  std::size_t record_bytes_, numbered_bytes_, batch_records_;
  std::uint64_t max_deep_points_;
  BucketFile file_;
  Bucket all_;
  std::uint64_t points_ = 0;
  std::vector<std::byte> numbered_;  ///< a record and its number
  Lattice lattice_;
  Point3 corner_{};
  double side_ = 1.0;
  const Write* write_ = nullptr;
  base::ThreadTeam team_;
};

}  // namespace terrace::stream
