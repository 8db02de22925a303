// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/digest.hpp"
#include "earth/crs/proj_pipeline.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/height_reference.hpp"

namespace GeographicLib {
class Geoid;
}

namespace terrace::terrain {

/// Bounds of every geoid, in metres above the ellipsoid.
inline constexpr double kLowestGeoid = -110.0, kHighestGeoid = 90.0;

/// The height of the geoid above the ellipsoid, from a grid in GeographicLib's format (egm96-5.pgm,
/// egm2008-2_5.pgm, ...), interpolated with its 12-point cubic. The whole grid is in memory.
/// Several threads may call const members at once.
class GeoidGrid {
 public:
  /// file: path of the grid. Throws: stream::Error if it cannot be read, is damaged, or would use
  /// more than `memory_bytes`.
  GeoidGrid(const std::string& file, std::uint64_t memory_bytes);
  ~GeoidGrid();
  GeoidGrid(GeoidGrid&&) noexcept;
  GeoidGrid& operator=(GeoidGrid&&) noexcept;

  /// Returns metres at longitude, latitude in degrees; NaN for an invalid place.
  [[nodiscard]] double undulation(const Point2& place) const;

 private:
  std::unique_ptr<const GeographicLib::Geoid> geoid_;
};

/// Converts a store's heights to metres above the ellipsoid, which globes need.
class EllipsoidalHeights {
 public:
  /// geoid: a grid file, which overrides PROJ's operations, or empty. area: the store's area, for
  /// which an operation is chosen. Throws: UsageError if the store's heights are not ellipsoidal
  /// and neither option is given, or if the options contradict the store or each other;
  /// stream::Error as GeoidGrid, and naming the grid that PROJ lacks.
  EllipsoidalHeights(const stream::StoreSchema& schema, HeightReference vertical,
                     const std::string& geoid, std::uint64_t memory_bytes,
                     const std::optional<GeographicArea>& area = std::nullopt);

  /// Largest error of a height in metres when many are converted.
  static constexpr double kTolerance = 1e-5;

  /// Converts heights in the store's vertical unit, at places in WGS 84 degrees, to metres above
  /// the ellipsoid, in place. Sizes must be equal.
  void convert(std::span<const Point2> places, std::span<double> heights) const;
  /// Adds the height of the geoid above the ellipsoid to heights in metres. This is the second step
  /// of convert(). Does nothing unless has_geoid(). Pass many places at once: see
  /// add_smooth_offsets().
  void add_geoid(std::span<const Point2> places, std::span<double> heights) const;

  /// Metres per unit of the store's heights.
  [[nodiscard]] double metres_per_unit() const { return metres_per_unit_; }
  /// Whether a geoid is added, so that the conversion depends on the place.
  [[nodiscard]] bool has_geoid() const { return geoid_ || operation_; }
  /// Adds everything that the conversion depends on, except for the bytes of a geoid file: unit and
  /// PROJ's operation.
  void add_to(Digest& digest) const;
  /// Returns a note for the user on an unknown unit or unconverted heights. Empty if there is
  /// nothing to report.
  [[nodiscard]] const std::string& note() const { return note_; }

 private:
  void find_operation(const stream::StoreSchema& schema, const std::optional<GeographicArea>& area);
  void add_note(const std::string& what);

  double metres_per_unit_ = 1.0;
  std::optional<GeoidGrid> geoid_;
  std::optional<ProjPipeline> operation_;
  std::string note_;
};

}  // namespace terrace::terrain
