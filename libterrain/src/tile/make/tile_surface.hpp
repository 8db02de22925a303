// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tile/format/tile_address.hpp"

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

/// Samples in rows along parallels and columns along meridians, at equal distances.
struct SurfaceRows {
  std::vector<double> longitude;  ///< of the columns, ascending
  std::vector<double> latitude;   ///< of the rows, ascending
  std::vector<double> height;     ///< metres above the ellipsoid, row by row; NaN: no sample
};

/// Samples that stand about in rows and columns: number row * columns + column.
struct SurfaceGrid {
  std::size_t columns = 0;
  std::vector<double> longitude, latitude;
  std::vector<double> height;  ///< NaN: no sample
};

/// Bounds on the heights of samples, not always reached.
struct HeightRange {
  double low = 0.0, high = 0.0;  ///< metres above the ellipsoid
  bool certain = false;          ///< that there is a sample at all
};

/// What tiles are made of: samples that they must not miss, and a surface through them that has a
/// height everywhere on the globe. One object per thread; all of one store answer alike, whatever
/// they were asked before.
class TileSurface {
 public:
  virtual ~TileSurface() = default;

  /// Around all samples.
  [[nodiscard]] virtual GeographicBox bounds() const = 0;
  /// The smallest distance of neighbouring samples along a parallel or meridian, degrees.
  [[nodiscard]] virtual double spacing() const = 0;
  /// Says that samples and heights in the box will be asked for next: they are read once then.
  virtual void expect(const GeographicBox& box) = 0;
  /// Boxes that meet bounds() and are wider (degrees) are cut in four before their samples are
  /// asked for.
  [[nodiscard]] virtual double widest_part() const { return 512.0 * spacing(); }
  /// Whether a box is to be cut however narrow it is, because it may hold too many samples to be
  /// taken at once. Depends on the samples and the box alone.
  virtual bool crowded(const GeographicBox& /*box*/) { return false; }
  /// Whether the sides of tiles go through the samples on them rather than along the surface: it
  /// need not go through those at its border.
  [[nodiscard]] virtual bool sides_take_samples() const { return false; }
  /// Replaces `out` by the samples in the box, borders included.
  virtual void samples(const GeographicBox& box, SurfaceSamples& out) = 0;
  /// The same where samples stand in rows and columns, which is faster; false where they do not.
  virtual bool rows(const GeographicBox& box, SurfaceRows& out) {
    static_cast<void>(box);
    static_cast<void>(out);
    return false;
  }
  /// The same where they do so about, as in another projection; what lies outside the box is no
  /// sample.
  virtual bool grid(const GeographicBox& box, SurfaceGrid& out) {
    static_cast<void>(box);
    static_cast<void>(out);
    return false;
  }
  /// The range of the samples' heights in the box, cheaply. Nothing if there is no sample.
  virtual std::optional<HeightRange> range(const GeographicBox& box) = 0;
  /// The surface's heights at places, filled where there are no samples: never NaN.
  virtual void heights(std::span<const double> longitude, std::span<const double> latitude,
                       std::span<double> out) = 0;
  /// What a water mask shows: whether there is water at each place.
  virtual void water(std::span<const double> longitude, std::span<const double> latitude,
                     std::span<std::uint8_t> out) = 0;

  /// A number of all that the answers above depend on for places in the box, which may reach beyond
  /// 180 degrees and the poles: bounds(), spacing(), and samples, ranges, heights and water there.
  /// Surfaces of two stores that have the same number answer alike in the box, so that what was
  /// made of one need not be made again of the other. A number of the whole store is right, but
  /// says of every change that it is everywhere. Cheap beside reading the samples.
  virtual std::uint64_t digest(const GeographicBox& box) = 0;
};

}  // namespace terrace::terrain
