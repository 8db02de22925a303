// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "store/read/store_impl.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/stored_surface.hpp"

namespace terrace::stream {
namespace {

class OrderReader {
 public:
  explicit OrderReader(const Store& store) : store_(store.whole()) {
    for (const LevelInfo& level : store.levels()) clusters_ += level.clusters;
    if (store.points() >= kNoNumber || clusters_ >= kNoNumber) {
      throw Error(store.path().string(), "its points are too many for a surface")
          .remedy("store a part of them");
    }
    points_.resize(store.top() + std::size_t{1});
  }

  ClusterOrder read() {
    add(store_.root(), kNoNumber);
    if (order_.clusters.size() != clusters_ || order_.points() != store_.points()) {
      throw damaged("clusters or points without a place in the hierarchy");
    }
    return std::move(order_);
  }

 private:
  void add(ClusterId id, std::uint32_t parent) {
    // A damaged hierarchy may have several ways to a cluster.
    if (order_.clusters.size() >= clusters_) throw damaged("clusters with two parents");
    const auto at = static_cast<std::uint32_t>(order_.clusters.size());
    const unsigned level = level_of(id);
    order_.clusters.push_back({.id = id, .parent = parent, .begin = end_});
    if (level == 0) {
      const std::uint64_t members = store_.record(id).points;
      if (members + (parent != kNoNumber ? 1 : 0) > store_.points() - end_) {
        throw damaged("clusters with more points than it has");
      }
      end_ += static_cast<std::uint32_t>(members);
      if (parent != kNoNumber) order_.clusters[at].representative = end_++;
    } else {
      ClusterPoints& points = points_[level];
      store_.read(id, points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        add(cluster_id(level - 1, points.children[i * level + level - 1]), at);
      }
      if (points.has_representative) {
        const auto last = static_cast<std::uint32_t>(order_.clusters.size());
        add(cluster_id(level - 1, points.representative_children[level - 1]), at);
        order_.clusters[at].representative = order_.clusters[last].representative;
      }
    }
    order_.clusters[at].end = end_;
    order_.clusters[at].next = static_cast<std::uint32_t>(order_.clusters.size());
  }

  [[nodiscard]] Error damaged(const std::string& what) const {
    return Error(store_.path().string(), "it has " + what)
        .remedy("restore the files or rebuild the store");
  }

  Store store_;
  std::uint64_t clusters_ = 0;
  std::uint32_t end_ = 0;
  std::vector<ClusterPoints> points_;  ///< of the clusters on the way, by level
  ClusterOrder order_;
};

}  // namespace

StoredSurface Store::read_surface(const ClusterOrder& order) const {
  if (!impl_->manifest.surface) {
    throw Error(path().string(), "the store has no surface");
  }
  const store::SurfaceEntry& entry = *impl_->manifest.surface;
  const auto file = store::open_listed(impl_->files, entry.file);
  std::vector<std::byte> bytes(store::memory_size(file->size()));
  file->read(0, bytes);
  check_stop();
  const std::uint32_t checksum = store::crc32(0, bytes.data(), bytes.size());
  if (checksum != entry.file.checksum) {
    throw Error(file->name(), "the checksum of the file is wrong")
        .remedy("restore the file or rebuild the store");
  }
  StoredSurface surface = decode_surface(order, bytes, file->name());
  const std::vector<bool> used = surface.on_surface();
  if (surface.triangles.size() != entry.triangles ||
      static_cast<std::uint64_t>(std::count(used.begin(), used.end(), true)) != entry.vertices) {
    throw Error(file->name(), "the vertices or triangles are not those that the manifest lists")
        .remedy("restore the file or rebuild the store");
  }
  return surface;
}

ClusterOrder cluster_order(const Store& store) { return OrderReader(store).read(); }

}  // namespace terrace::stream
