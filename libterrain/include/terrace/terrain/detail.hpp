// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// All points of `level` and above inside `region`.
struct FinerRegion {
  Region region;
  unsigned level = 0;
};

/// Which detail is wanted where: `level` everywhere (or inside `region` only), finer inside the
/// focuses. All regions are in the store's CRS.
struct Detail {
  unsigned level = 0;
  std::optional<Region> region{};
  std::vector<FinerRegion> focuses{};
  /// Only the points of `level` and above that this cluster stands for, its representative as its
  /// last member; of its own level or a coarser one than `level`. Without region and focuses.
  std::optional<stream::ClusterId> cluster{};
  /// In units of the CRS: what lies so far outside polygons, but in the box around them, is wanted
  /// as well.
  double margin = 0;

  /// The finest level wanted anywhere.
  [[nodiscard]] unsigned finest() const;
  /// Whether a cluster of `cluster_level` whose descendants lie in `world_box` must be expanded.
  [[nodiscard]] bool wants(unsigned cluster_level, const stream::Box3& world_box) const;
  /// Whether a cluster whose descendants lie in `world_box` may have points that are wanted in
  /// `there`, which is `region` or that of a focus.
  [[nodiscard]] bool reaches_into(const Region& there, const stream::Box3& world_box) const;
};

/// Notes each focus that meets none of the store's points, so that it adds nothing.
void note_idle_focuses(const stream::Store& store, const Detail& detail, const Context& context);

/// Visits every cluster that `detail` wants, the root (or `cluster`) first, then level by level
/// downward; within a level in order of ordinals. A wanted cluster's parent is always wanted as
/// well. In a view (stream::Store::where()), clusters of level 0 of which no point can meet its
/// condition are left out; of others stream::ClusterPoints::match() tells which do. Memory: the
/// ordinals of the wanted clusters of two levels where only a part is wanted; constant where a
/// whole level is. Throws: stream::Error on a damaged store; UsageError for a cluster that the
/// store does not have or that is finer than the level.
void for_each_wanted(const stream::Store& store, const Detail& detail,
                     const stream::Store::VisitCluster& visit);

/// What is made of some clusters that follow one another, some 16,000 points.
class WantedPart {
 public:
  virtual ~WantedPart() = default;
  /// Called for each of its clusters, all by one thread.
  virtual void add(stream::ClusterId id, const stream::ClusterRecord& record,
                   const stream::ClusterPoints& points) = 0;
  /// Called behind the last, by the same thread.
  virtual void end() {}
  /// Called when all parts before have been taken, one at a time.
  virtual void take() = 0;
};

/// The same by several threads, which read clusters and add them to parts at once; make(worker)
/// gives a new part to the thread of that number, 0 to threads - 1. The effect does not depend on
/// their number if take() has all of it. At most two parts per thread wait.
void for_each_wanted(const stream::Store& store, const Detail& detail, unsigned threads,
                     const std::function<std::unique_ptr<WantedPart>(unsigned worker)>& make);

/// The same for the index entries alone: what lies in clusters of level 0 is not read.
void for_each_wanted_record(
    const stream::Store& store, const Detail& detail,
    const std::function<void(stream::ClusterId, const stream::ClusterRecord&)>& visit);

/// The number of points of the wanted clusters, from the index alone; of a view those that meet its
/// condition, for which the clusters are read.
[[nodiscard]] std::uint64_t wanted_points(const stream::Store& store, const Detail& detail);

/// The points of a wanted cluster that are wanted themselves: that meet the condition of a view
/// and, where there is a region, lie in it or in a focus. Any thread. `detail` must outlive it.
class WantedPoints {
 public:
  WantedPoints(const stream::Store& store, const Detail& detail);
  /// Visits each: its place among the points of the cluster, and where it lies in the CRS of the
  /// store.
  void operator()(const stream::ClusterRecord& record, const stream::ClusterPoints& points,
                  const std::function<void(std::size_t, const stream::Point3&)>& visit) const;

 private:
  const Detail& detail_;
  stream::Placement placement_;
};

/// Shows the places of all such points in the CRS of the store, some at a time, in the order of
/// for_each_wanted(); `threads` read, of which any shows.
void for_each_wanted_place(const stream::Store& store, const Detail& detail, unsigned threads,
                           const std::function<void(std::span<const stream::Point3>)>& show);

/// Visits all such points in the order of for_each_wanted().
void for_each_wanted_point(const stream::Store& store, const Detail& detail,
                           const std::function<void(stream::ClusterId, const stream::ClusterPoints&,
                                                    std::size_t, const stream::Point3&)>& visit);

}  // namespace terrace::terrain
