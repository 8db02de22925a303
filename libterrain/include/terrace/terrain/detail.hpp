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

/// The detail wanted at each place: `level` everywhere (or only inside `region`), and finer inside
/// the focuses. All regions are in the store's CRS.
struct Detail {
  unsigned level = 0;
  std::optional<Region> region{};
  std::vector<FinerRegion> focuses{};
  /// Restricts the detail to the points of `level` and above that this cluster represents, with its
  /// representative as its last member. Its level is `level` or coarser. Excludes region and
  /// focuses.
  std::optional<stream::ClusterId> cluster{};
  /// Distance in units of the CRS: places this far outside polygons are wanted too, if they are
  /// within the box around them.
  double margin = 0;

  /// Returns the finest level wanted anywhere.
  [[nodiscard]] unsigned finest() const;
  /// Whether a cluster of `cluster_level` with descendants inside `world_box` must be expanded.
  [[nodiscard]] bool wants(unsigned cluster_level, const stream::Box3& world_box) const;
  /// Whether a cluster with descendants inside `world_box` may have points that are wanted in
  /// `target`, which is `region` or the region of a focus.
  [[nodiscard]] bool reaches_into(const Region& target, const stream::Box3& world_box) const;
};

/// Returns the detail with the margin of a mesh: triangles that reach out of a polygon have corners
/// in the clusters next to it.
[[nodiscard]] Detail with_margin(const stream::Store& store, Detail detail);

/// Notes each focus that meets none of the store's points and so adds nothing.
void note_idle_focuses(const stream::Store& store, const Detail& detail, const Context& context);

/// Visits every cluster that `detail` wants: first the root (or `cluster`), then level by level
/// downward, in order of ordinals within a level. The parent of a wanted cluster is always wanted
/// too. In a view (stream::Store::where()), leaves out clusters of level 0 without any point that
/// can meet the condition. In the other clusters, stream::ClusterPoints::match() selects the points
/// that do. Memory: the ordinals of the wanted clusters of two levels where a level is wanted in
/// part, constant where it is wanted in full. Throws: stream::Error on a damaged store; UsageError
/// for a cluster that the store does not have or that is finer than the level.
void for_each_wanted(const stream::Store& store, const Detail& detail,
                     const stream::Store::VisitCluster& visit);

/// The result of some consecutive clusters, about 16,000 points.
class WantedPart {
 public:
  virtual ~WantedPart() = default;
  /// Called for each of its clusters, always by the same thread.
  virtual void add(stream::ClusterId id, const stream::ClusterRecord& record,
                   const stream::ClusterPoints& points) = 0;
  /// Called after the last cluster, by the same thread.
  virtual void end() {}
  /// Called after take() of all earlier parts, by one thread at a time.
  virtual void take() = 0;
};

/// Visits the wanted clusters with several threads, which read clusters and add them to parts
/// concurrently.
/// make(worker) returns a new part for the thread of that number, 0 to threads - 1. The effect does
/// not depend on the number of threads if only take() has effects. At most two parts per thread
/// wait.
void for_each_wanted(const stream::Store& store, const Detail& detail, unsigned threads,
                     const std::function<std::unique_ptr<WantedPart>(unsigned worker)>& make);

/// Visits the index entries of the wanted clusters. Clusters of level 0 are not read.
void for_each_wanted_record(
    const stream::Store& store, const Detail& detail,
    const std::function<void(stream::ClusterId, const stream::ClusterRecord&)>& visit);

/// Returns the number of points of the wanted clusters, from the index alone. In a view, counts the
/// points that meet its condition, which requires reading the clusters.
[[nodiscard]] std::uint64_t wanted_points(const stream::Store& store, const Detail& detail);

/// Selects the wanted points of a wanted cluster: those that meet the condition of a view and, with
/// a region, are inside it or a focus. Thread-safe. `detail` must outlive it.
class WantedPoints {
 public:
  WantedPoints(const stream::Store& store, const Detail& detail);
  /// Visits each point with its index in the cluster and its place in the CRS of the store.
  void operator()(const stream::ClusterRecord& record, const stream::ClusterPoints& points,
                  const std::function<void(std::size_t, const stream::Point3&)>& visit) const;

 private:
  const Detail& detail_;
  stream::Placement placement_;
};

/// Passes the places of all wanted points in the CRS of the store to `show`, in batches, in the
/// order of for_each_wanted(). `threads` threads read, and any of them may call `show`.
void for_each_wanted_place(const stream::Store& store, const Detail& detail, unsigned threads,
                           const std::function<void(std::span<const stream::Point3>)>& show);

/// Visits all wanted points in the order of for_each_wanted().
void for_each_wanted_point(const stream::Store& store, const Detail& detail,
                           const std::function<void(stream::ClusterId, const stream::ClusterPoints&,
                                                    std::size_t, const stream::Point3&)>& visit);

}  // namespace terrace::terrain
