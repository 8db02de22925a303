// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

#include "view/frame.hpp"

namespace terrace::terrain {

/// Answers queries about single places of a store at full detail, for a viewer whose surface is
/// coarser than the store.
///
/// Bytes of the store may be missing (stream::GivenBytes). Then each function throws
/// stream::MissingBytes, which lists all missing bytes that it can determine, not only the first.
/// Call it again once they are available. Answers depend only on the store and the arguments. All
/// functions throw stream::Error on damage. One object per thread.
class StoreProbe {
 public:
  /// ground: the linear map from stored coordinates to metres. The store must outlive this object.
  StoreProbe(const stream::Store& store, const stream::LinearMap& ground)
      : store_(store), frame_(store, ground) {}

  struct Found {
    stream::Point3 stored{};
    stream::Point3 place{};            ///< the same in metres, see ViewFrame
    std::vector<double> attributes{};  ///< stored values
    unsigned level = 0;                ///< the level that was searched, with all levels above
  };
  /// Returns a place on the surface of a raster, as HeightSampler computes it at level 0, with the
  /// attributes of the sample whose cell contains it; nullopt where there is no surface.
  std::optional<Found> on_raster(double column, double row);
  /// Returns the point within `reach` metres that is nearest to a stored place, on ties the one
  /// with smaller coordinates. Reads at most about kMaxRead points. If there are more, it reads
  /// those of a coarser level.
  std::optional<Found> nearest(const stream::Point3& place, double reach);

  struct Profile {
    /// Length over ground, by the map to metres: perpendicular to the upward axis.
    double metres = 0;
    /// The position along the line, 0 to 1, and the height there in the unit of the store. For a
    /// raster the heights of its surface, NaN where there is none; otherwise points, unordered.
    std::vector<std::array<double, 2>> points{};
    unsigned level = 0;  ///< as in Found
    bool sampled =
        false;  ///< a raster sampled at equal distances, because the line crosses too many cells
  };
  /// Returns the profile between two stored places. For a raster it has the places where the line
  /// crosses a column, a row or a diagonal, at most kMaxCrossings. For other stores it has the
  /// points in a strip whose width is kStrip times its length. axis: the upward coordinate, 1 or 2;
  /// 2 for rasters.
  Profile profile(const stream::Point3& from, const stream::Point3& to, std::size_t axis);

  static constexpr std::uint64_t kMaxRead = 1u << 18;
  static constexpr double kMaxCrossings = 8192, kSamples = 1024, kStrip = 0.02;

 private:
  class SomeSamples;

  /// Visits all clusters that may have points with a box for which wants(box) is true, from the
  /// root down, as long as these have at most `max_points` points. Returns the level reached.
  unsigned descend(std::uint64_t max_points, const std::function<bool(const stream::Box3&)>& wants,
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
