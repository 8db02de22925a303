// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string>

#include "earth/crs/coordinate_system.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// The CRS of a store. Throws: stream::Error if it has none, or one that is not known.
CoordinateSystem system_of(const stream::Store& store);

/// From a store's CRS to another that the user names, by the operation that is best where the store
/// lies. shift: the text of `--towgs84`, may be empty: the shift of the one whose datum does not
/// count as WGS 84; of the named one if neither does. Throws: UsageError for a CRS or a shift that
/// is none, stream::Error if the store has no CRS, or if nothing leads from one datum to the other.
Transformation transformation_to(const stream::Store& store, const std::string& named,
                                 const std::string& shift);

/// Regions of `--region-crs` as regions in the store's CRS; without the option as they are.
class RegionConversion {
 public:
  RegionConversion() = default;
  /// to_regions: from the store's CRS to that of the regions.
  RegionConversion(const stream::Store& store, Transformation to_regions);
  /// Throws: as region_in.
  [[nodiscard]] Region operator()(Region region) const;

 private:
  std::optional<Transformation> to_regions_;
  stream::Box3 bounds_;
};

/// Places of the store's CRS in that of `--to-crs`; without the option as they are. Heights stay.
class PlaceConversion {
 public:
  PlaceConversion() = default;
  explicit PlaceConversion(Transformation change);
  /// x and y in place. Throws: stream::Error for a point that has no place there.
  void operator()(std::span<stream::Point3> points) const;
  [[nodiscard]] bool has_effect() const { return change_.has_value(); }

 private:
  std::optional<Transformation> change_;
};

}  // namespace terrace::terrain
