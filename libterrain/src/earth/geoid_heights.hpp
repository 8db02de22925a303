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

/// Metres above the ellipsoid that no geoid leaves.
inline constexpr double kLowestGeoid = -110.0, kHighestGeoid = 90.0;

/// How far a geoid lies above the ellipsoid, from a grid in GeographicLib's format (egm96-5.pgm,
/// egm2008-2_5.pgm, ...), interpolated by its cubic of 12 samples. The whole grid is held in
/// memory. Const members may be called by several threads at once.
class GeoidGrid {
 public:
  /// file: with its folder and ending. Throws: stream::Error if it cannot be read, is damaged, or
  /// would take more than `memory_bytes`.
  GeoidGrid(const std::string& file, std::uint64_t memory_bytes);
  ~GeoidGrid();
  GeoidGrid(GeoidGrid&&) noexcept;
  GeoidGrid& operator=(GeoidGrid&&) noexcept;

  /// Metres at longitude, latitude in degrees; NaN for a place that is none.
  [[nodiscard]] double undulation(const Point2& place) const;

 private:
  std::unique_ptr<const GeographicLib::Geoid> geoid_;
};

/// Heights of a store as heights above the ellipsoid in metres, which globes want.
class EllipsoidalHeights {
 public:
  /// geoid: a file with a grid, which goes before PROJ's operations, or empty. area: where the
  /// store lies, by which an operation is chosen. Throws: UsageError if the store's heights are not
  /// ellipsoidal and neither was given, or if the options contradict the store or one another;
  /// stream::Error as GeoidGrid, and naming the grid that PROJ lacks.
  EllipsoidalHeights(const stream::StoreSchema& schema, HeightReference vertical,
                     const std::string& geoid, std::uint64_t memory_bytes,
                     const std::optional<GeographicArea>& area = std::nullopt);

  /// Metres: what a height may be off among many.
  static constexpr double kTolerance = 1e-5;

  /// heights in the store's vertical unit at places in WGS 84 degrees, to metres above the
  /// ellipsoid, in place. Sizes are equal.
  void convert(std::span<const Point2> places, std::span<double> heights) const;
  /// The second half of that: heights in metres get what the geoid lies above the ellipsoid. Does
  /// nothing unless has_geoid(). Ask for many places at once: see add_smooth_offsets().
  void add_geoid(std::span<const Point2> places, std::span<double> heights) const;

  /// Metres in a unit of the store's heights.
  [[nodiscard]] double metres_per_unit() const { return metres_per_unit_; }
  /// Whether a geoid is added: heights then depend on the place.
  [[nodiscard]] bool has_geoid() const { return geoid_ || operation_; }
  /// All that the conversion depends on but the bytes of a geoid file: unit, and PROJ's operation.
  void add_to(Digest& digest) const;
  /// What the user should know: an unknown unit, heights that were not converted. May be empty.
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
