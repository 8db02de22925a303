// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

#include <terrace/stream/store.hpp>

/// Parts of a store at full resolution, or at a level: what works on a store window by window reads
/// through this.

namespace terrace::terrain {

/// A rectangle of a raster's lattice. It may hang over the raster's borders or lie outside.
struct LatticeWindow {
  std::int64_t column = 0, row = 0;    ///< of its first sample
  std::int64_t columns = 0, rows = 0;  ///< its size

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
};

/// A rectangle of stored coordinates, closed.
struct StoredBox {
  std::array<double, 2> min{}, max{};

  [[nodiscard]] bool meets(const StoredBox& other) const {
    return min[0] <= other.max[0] && max[0] >= other.min[0] && min[1] <= other.max[1] &&
           max[1] >= other.min[1];
  }
  [[nodiscard]] bool contains(const stream::Point3& p) const {
    return p[0] >= min[0] && p[0] <= max[0] && p[1] >= min[1] && p[1] <= max[1];
  }
};

/// Points of a store in the order: higher levels first, within a level by id. So of points at equal
/// x,y the first stands for all.
struct WindowPoints {
  std::vector<stream::Point3> positions;  ///< stored coordinates
  std::vector<std::uint8_t> levels;       ///< the highest level of each

  void clear() {
    positions.clear();
    levels.clear();
  }
};

/// Reads windows of one store. One object per thread; any number of them share a Store.
///
/// A window costs what the clusters whose boxes meet it cost to read and decode, about 25 ns per
/// point, and what is kept of earlier windows costs a tenth of that. The way down to the clusters
/// is by their records: nothing else of the store is read.
///
/// All functions throw stream::Error on a damaged store and stream::Stopped if the store is to
/// stop.
class StoreWindow {
 public:
  /// cache_bytes: decoded clusters of level 0 to keep, those used last: for users that ask for near
  /// places again. Without it, windows that do not overlap are read fastest. What leads to them
  /// is kept anyhow: the root and 4 MiB of the clusters above level 0.
  explicit StoreWindow(const stream::Store& store, std::uint64_t cache_bytes = 0);
  StoreWindow(const StoreWindow&) = delete;
  StoreWindow& operator=(const StoreWindow&) = delete;

  /// The heights of a raster's samples (Schema::grid) of `level` and above by rows, in the store's
  /// vertical unit (scale and offset of the channel applied); NaN where there is no sample. At
  /// level 0 NaN is where the raster has no data. Requires out.size() == window.size().
  void heights(const LatticeWindow& window, std::span<double> out, unsigned level = 0);
  /// The same in half the memory; requires float_is_exact().
  void heights(const LatticeWindow& window, std::span<float> out, unsigned level = 0);
  /// Whether floats hold every height of the store exactly: the sample's type fits and it has
  /// neither scale nor offset.
  [[nodiscard]] bool float_is_exact() const;

  /// Replaces `out` by the points of `level` and above in the box.
  void points(const StoredBox& box, WindowPoints& out, unsigned level = 0);

  /// A decoded cluster and where the clusters are that its members head.
  struct Node {
    stream::ClusterId id{};
    std::uint64_t bytes = 0;
    std::vector<stream::Point3> positions;
    std::vector<std::uint64_t> children;  ///< as in stream::ClusterPoints
    std::vector<StoredBox> boxes;         ///< of the children, in parallel
  };
  /// One cluster, for those that find their own way down. Valid until the next call of anything.
  const Node& node(stream::ClusterId id);

 private:
  using Nodes = std::list<Node>;

  /// Nodes up to a number of bytes, the one used last in front.
  struct Cache {
    std::uint64_t most_bytes = 0, held_bytes = 0;
    Nodes nodes{};
    std::unordered_map<std::uint64_t, Nodes::iterator> by_id{};

    /// Takes out the node that was not used for longest and puts it into `to`.
    void drop(Nodes& to);
  };

  void fill(Node& node, stream::ClusterId id);
  template <class Visit>
  void descend(const StoredBox& box, unsigned level, const Visit& visit);
  template <class Height>
  void scatter(const LatticeWindow& window, std::span<Height> out, unsigned level);

  const stream::Store& store_;
  Node root_, passing_;  ///< passing: what is not kept
  Cache leaves_, inner_;
  stream::ClusterPoints points_;
  std::vector<std::vector<std::uint64_t>> wanted_;  ///< per level, ordinals on the way down
};

}  // namespace terrace::terrain
