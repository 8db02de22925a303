// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "tile/format/address.hpp"

namespace terrace::terrain {

/// Places in degrees with heights in metres above the ellipsoid.
struct SurfaceSamples {
  std::vector<double> longitude, latitude, height;

  [[nodiscard]] std::size_t size() const { return height.size(); }
  void clear() {
    longitude.clear();
    latitude.clear();
    height.clear();
  }
};

/// Equally spaced samples in rows along parallels and columns along meridians.
struct SurfaceRows {
  std::vector<double> longitude;  ///< longitudes of the columns, ascending
  std::vector<double> latitude;   ///< latitudes of the rows, ascending
  std::vector<double> height;     ///< in metres above the ellipsoid, row by row; NaN: no sample
};

/// Samples on an approximately regular grid, row by row: sample row * columns + column.
struct SurfaceGrid {
  std::size_t columns = 0;
  std::vector<double> longitude, latitude;
  std::vector<double> height;  ///< NaN: no sample, or outside the requested box
};

/// The samples of a box.
using SurfacePart = std::variant<SurfaceSamples, SurfaceRows, SurfaceGrid>;

/// Bounds on the heights of samples, which need not be tight.
struct HeightRange {
  double low = 0.0, high = 0.0;  ///< in metres above the ellipsoid
  bool certain = false;          ///< whether there certainly is a sample
};

/// The source of tiles: samples that they must approximate, and a surface through them with a
/// height everywhere on the globe. One object per thread; all objects of one store give the same
/// answers, in any order of queries.
class TileSurface {
 public:
  virtual ~TileSurface() = default;

  /// Throws: stream::Stopped if a stop was requested. Call it in loops that may not read the store.
  virtual void check_stop() const {}
  /// A box around all samples.
  [[nodiscard]] virtual GeographicBox bounds() const = 0;
  /// The smallest spacing of samples along a parallel or meridian, in degrees.
  [[nodiscard]] virtual double spacing() const = 0;
  /// Announces a box whose samples and heights will be requested next, so that they are read once.
  virtual void expect(const GeographicBox& box) = 0;
  /// Boxes that meet bounds() and are wider than this (degrees) are quartered before their samples
  /// are requested.
  [[nodiscard]] virtual double widest_part() const { return 512.0 * spacing(); }
  /// Whether a box must be divided, however narrow it is, because it may have too many samples to
  /// hold at once. Depends only on the samples and the box.
  virtual bool crowded(const GeographicBox& /*box*/) { return false; }
  /// Whether the sides of tiles pass through the samples on them instead of along the surface,
  /// which need not pass through samples at its border.
  [[nodiscard]] virtual bool sides_take_samples() const { return false; }
  /// Replaces `out` by the samples in the box, borders included, in any order.
  virtual void samples(const GeographicBox& box, SurfaceSamples& out) = 0;
  /// Returns the same samples in the form that is fastest to read and mesh.
  virtual SurfacePart part(const GeographicBox& box) {
    SurfaceSamples all;
    samples(box, all);
    return all;
  }
  /// Returns the range of the samples' heights in the box, without reading them; nullopt if there
  /// is no sample.
  virtual std::optional<HeightRange> range(const GeographicBox& box) = 0;
  /// The height beyond the outline of all samples.
  [[nodiscard]] virtual double height_beyond() const { return 0.0; }
  /// Returns the range of the samples' heights in the box and of the surface over it, without
  /// reading them; nullopt if unknown. It saves reading and does not change any tile.
  virtual std::optional<HeightRange> surface_range(const GeographicBox& /*box*/) { return {}; }
  /// Computes the surface's heights at places, filled where there are no samples: never NaN.
  virtual void heights(std::span<const double> longitude, std::span<const double> latitude,
                       std::span<double> out) = 0;
  /// Computes whether there is water at each place, for a water mask.
  virtual void water(std::span<const double> longitude, std::span<const double> latitude,
                     std::span<std::uint8_t> out) = 0;

  /// Returns a hash of everything that the answers above depend on in the box, which may extend
  /// beyond 180 degrees and the poles: bounds(), spacing(), and the samples, ranges, heights and
  /// water there. Surfaces of two stores with equal hashes give equal answers in the box, so tiles
  /// made from one are valid for the other. Hashing the whole store is correct but invalidates
  /// every box on any change. Cheap compared with reading the samples.
  virtual std::uint64_t digest(const GeographicBox& box) = 0;
};

}  // namespace terrace::terrain
