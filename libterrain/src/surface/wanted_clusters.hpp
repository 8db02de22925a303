// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <terrace/stream/store.hpp>

#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The clusters of a store whose points a surface passes through: those of a level and above and,
/// in focuses, those of finer levels. A cluster is wanted if Detail::wants() is true for it, with
/// the margin of a mesh, so the surface has the vertices of detail_mesh(). Copies share the
/// focuses. Several threads may call const members at once.
class WantedClusters {
 public:
  /// The clusters of a level and above. Implicit: a level alone is such a choice.
  WantedClusters(unsigned level)  // NOLINT(google-explicit-constructor)
      : level_(level), finest_(level) {}
  /// Ignores focuses that are not finer than the level, because they add nothing. Throws:
  /// UsageError for a level that the store does not have; stream::Error on a damaged store.
  WantedClusters(const stream::Store& store, unsigned level, std::span<const FinerRegion> focuses);

  /// The level wanted everywhere, and the finest level wanted anywhere.
  [[nodiscard]] unsigned level() const { return level_; }
  [[nodiscard]] unsigned finest() const { return finest_; }
  /// Whether there are focuses.
  [[nodiscard]] bool is_mixed() const { return focuses_ != nullptr; }
  /// Returns the finest level wanted at a stored place, at any height.
  [[nodiscard]] unsigned finest_at(const Point2& stored) const;

  /// Whether a cluster of this level is wanted. box: in stored coordinates, around the cluster and
  /// all clusters below it. If this is true for a box, it is true for any box around it on the same
  /// level or above.
  [[nodiscard]] bool operator()(unsigned cluster_level, const stream::Box3& box) const {
    return cluster_level >= level_ || (is_mixed() && in_focus(cluster_level, box));
  }
  /// Returns the approximate number of points; exact without focuses and conditions.
  [[nodiscard]] double points(const stream::Store& store) const;
  /// For rasters: whether the surface around a stored place is that of level 0, because the part of
  /// the raster within `cells` columns and rows is inside one focus of level 0.
  [[nodiscard]] bool has_all_samples(const Point2& stored, double cells) const;

 private:
  struct Focuses;
  [[nodiscard]] bool in_focus(unsigned cluster_level, const stream::Box3& box) const;

  unsigned level_, finest_;
  std::shared_ptr<const Focuses> focuses_;  ///< null: none
};

}  // namespace terrace::terrain
