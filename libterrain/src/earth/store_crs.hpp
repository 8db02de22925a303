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

/// A store's CRS and another that the user names. `--towgs84` is the shift of the one whose datum
/// is not WGS 84's; of the named one if both are others.
struct SystemPair {
  CoordinateSystem store, named;
};
/// shift: the option's text, may be empty. Throws: UsageError for a CRS or a shift that is none,
/// stream::Error if the store has no CRS.
SystemPair systems_of(const stream::Store& store, const std::string& named,
                      const std::string& shift);

/// Regions of `--region-crs` as regions in the store's CRS; without the option as they are.
class RegionConversion {
 public:
  RegionConversion() = default;
  RegionConversion(const stream::Store& store, const SystemPair& systems);
  /// Throws: as region_in.
  [[nodiscard]] Region operator()(Region region) const;

 private:
  struct Systems {
    CoordinateSystem from, to;
    stream::Box3 bounds;
  };
  std::optional<Systems> systems_;
};

/// Places of the store's CRS in that of `--to-crs`; without the option as they are. Heights stay.
class PlaceConversion {
 public:
  PlaceConversion() = default;
  PlaceConversion(const CoordinateSystem& from, const CoordinateSystem& to);
  /// x and y in place. Throws: stream::Error for a point that has no place there.
  void operator()(std::span<stream::Point3> points) const;
  [[nodiscard]] bool has_effect() const { return systems_.has_value(); }

 private:
  struct Systems {
    CoordinateSystem from, to;
  };
  std::optional<Systems> systems_;
};

}  // namespace terrace::terrain
