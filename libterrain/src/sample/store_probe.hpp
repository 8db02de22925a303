// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "view/view_frame.hpp"

namespace terrace::terrain {

/// Answers questions about single places of a store, whatever detail is drawn of it: for a viewer,
/// whose surface is coarser than the store.
///
/// Bytes of the store may be missing (stream::GivenBytes). Then each function throws
/// stream::MissingBytes, which names all bytes that it can tell it lacks and not only the first; it
/// gives its answer once they are there. Answers depend on the store and the arguments alone. All
/// throw stream::Error on damage. One object per thread.
class StoreProbe {
 public:
  /// ground: the linear map from stored coordinates to metres. The store must outlive this.
  StoreProbe(const stream::Store& store, const stream::LinearMap& ground)
      : store_(store), frame_(store, ground) {}

  struct Found {
    stream::Point3 stored{};
    stream::Point3 place{};            ///< the same in metres, see ViewFrame
    std::vector<double> attributes{};  ///< stored values
    unsigned level = 0;                ///< the points of it and above were looked at
  };
  /// A place on the surface of a raster as HeightSampler has it at level 0, and the attributes of
  /// the sample whose cell holds it; nothing where there is no surface.
  std::optional<Found> on_raster(double column, double row);
  /// The point nearest to a place (stored) of those within `reach` metres; of several the one of
  /// smaller coordinates. Reads at most about kMostRead points: where there are more, those of a
  /// coarser level.
  std::optional<Found> nearest(const stream::Point3& place, double reach);

  struct Profile {
    /// Over ground, by the map to metres: perpendicular to the axis that is upward.
    double metres = 0;
    /// The share of the way, 0 to 1, and the height there in the unit of the store. Of a raster its
    /// surface, NaN where there is none; else points, in no order.
    std::vector<std::array<double, 2>> points{};
    unsigned level = 0;  ///< as above
    bool sampled =
        false;  ///< of a raster, at places of equal distance, as the way crosses too many cells
  };
  /// The profile between two places (stored). Of a raster at every place where the way crosses a
  /// column, a row or a diagonal, at most kMostCrossings; of points those of a strip, kStrip times
  /// as wide as long. axis: the coordinate that is upward, 1 or 2; of rasters 2.
  Profile profile(const stream::Point3& from, const stream::Point3& to, std::size_t axis);

  static constexpr std::uint64_t kMostRead = 1u << 18;
  static constexpr double kMostCrossings = 8192, kSamples = 1024, kStrip = 0.02;

 private:
  class SomeSamples;

  /// Visits all clusters that may have points for which wants(box) is true,
  /// from the root down, as long as these have at most `most` points; returns the level reached.
  unsigned descend(std::uint64_t most, const std::function<bool(const stream::Box3&)>& wants,
                   const std::function<void(const stream::ClusterPoints&)>& visit);
  Profile of_raster(const stream::Point3& from, const stream::Point3& to);
  Profile of_points(const stream::Point3& from, const stream::Point3& to, std::size_t axis);
  [[nodiscard]] Found found(const stream::Point3& stored, const std::vector<std::byte>& record,
                            unsigned level) const;

  const stream::Store& store_;
  ViewFrame frame_;
  stream::ClusterPoints points_;
};

}  // namespace terrace::terrain
