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

/// Distributes points of any number among the nodes of an octree, through a temporary file.
///
/// A node whose cube has few points keeps them all. Of others each keeps one point of every cell,
/// kSpan of which make up its side; the rest lies deeper. So the nodes down to a depth are a cloud
/// that is as even as the points allow. Which of a cell's points it is, a hash of the coordinates
/// says: the octree depends on the points and their order, not on what fits into memory.
///
/// Time O(points * depth). Memory: bytes_with().
class OctreeBuilder {
 public:
  static constexpr unsigned kSpan = 128;
  /// Nodes with at most so many points below and in them are leaves.
  static constexpr std::size_t kLeafPoints = std::size_t{1} << 15;
  /// Points that a child gives to its parent at most, which so has eight times as many. Surfaces
  /// have fewer; only clouds that fill space reach it.
  static constexpr std::size_t kMostPromoted = std::size_t{1} << 14;

  /// The most that is held with so many records in memory at once.
  static std::uint64_t bytes_with(std::size_t record_bytes, std::size_t at_once);

  /// Takes a node and its records, in the order in which they were added; there may be none.
  /// Children come before their parents.
  using Write = std::function<void(const OctreeNode& node, std::span<const std::byte> records)>;

  /// Records begin with x, y and z as int32. name, folder: of the temporary file.
  /// at_once: the records in memory, of which results do not depend; kLeafPoints at least.
  /// most_together: of points that the deepest node cannot part. threads: that work on what is in
  /// memory; results do not depend on them either.
  OctreeBuilder(const std::string& name, const std::filesystem::path& folder,
                std::size_t record_bytes, std::size_t at_once, std::uint64_t most_together,
                unsigned threads = 1);

  /// Throws: Error, if the disk is full above all.
  void add(std::span<const std::byte> records);
  /// Once, after all points. The cube of `octree` is to enclose them. Throws: Error for more
  /// points than `most_together` that the deepest node cannot part; what `write` throws.
  void build(const Octree& octree, const Lattice& lattice, const Write& write);

 private:
  struct Item;
  struct NodePoints;
  struct Subtree;

  [[nodiscard]] std::array<std::uint32_t, 3> cell_of(const std::byte* record) const;
  /// With its number.
  [[nodiscard]] std::span<const std::byte> record_of(const NodePoints& points,
                                                     const Item& item) const;
  /// The records of a bucket, taken out of it, and what they are.
  NodePoints load(const OctreeNode& node, Bucket bucket);
  NodePoints build(const OctreeNode& node, Bucket bucket);
  NodePoints visit(const OctreeNode& node, std::span<Bucket> buckets);
  NodePoints build_in_memory(const OctreeNode& node, Bucket bucket);
  void sort(std::vector<Item>& items, unsigned depth);
  /// The nodes where stop(node, items) is true.
  template <class Stop>
  void plan(const OctreeNode& node, std::span<const Item> items, const Stop& stop,
            std::vector<Subtree>& tasks) const;
  /// The node's points once its descendants have theirs. Where stop(node, items) is true,
  /// leaf(node, items) makes them.
  template <class Stop, class Leaf>
  NodePoints combine(const OctreeNode& node, std::span<const Item> items, const Stop& stop,
                     const Leaf& leaf, const Write& write) const;
  template <class Add>
  void promote(NodePoints child, const Write& write, const Add& add) const;
  void write(NodePoints& node, const Write& write) const;

  std::string name_;
  std::size_t record_bytes_, numbered_bytes_, at_once_;
  std::uint64_t most_together_;
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
