// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/tri/point_tin.hpp>

#include "surface/window_sides.hpp"
#include "tile/format/address.hpp"
#include "tile/make/surface.hpp"

namespace terrace::terrain {

/// The parameters that all tiles of a zoom share.
struct ZoomPlan {
  unsigned zoom = 0;
  double max_error = 0.0;     ///< in metres, minus what the tile's encoding may add
  double height_step = 0.0;   ///< a power of two; heights of vertices are multiples of it
  double longest_edge = 0.0;  ///< in degrees; longer ones would cut off too much of the Earth's
                              ///< curve
  double widest_leaf = 0.0;   ///< in degrees; wider parts of a tile with samples are quartered
};
/// surface: provides the spacing of the samples. range: the largest range of heights within a tile
/// of the zoom, in metres.
ZoomPlan plan_zoom(unsigned zoom, double max_error, double range, const TileSurface& surface);

/// A square part of a tile whose width is 1 / 2^depth of the tile's. x and y count such parts from
/// the tile's south-west corner.
struct TileLeaf {
  unsigned depth = 0;
  std::uint32_t x = 0, y = 0;
};
/// Returns the units of the tile's lattice at k / 2^depth of its width.
std::uint32_t leaf_unit(std::uint32_t k, unsigned depth);
/// In degrees; exact.
double tile_width(unsigned zoom);
/// Return the meridian and the parallel at `units` of a tile's lattice. On a border they are the
/// same numbers for both tiles.
double longitude_at(const TileAddress& tile, double units);
double latitude_at(const TileAddress& tile, double units);
GeographicBox box_of(const TileAddress& tile, const TileLeaf& leaf);

/// Returns the parts in which a tile is meshed, so that no edge is too long and no part has too
/// many samples, except possibly the smallest parts.
std::vector<TileLeaf> leaves_of(const TileAddress& tile, const ZoomPlan& plan,
                                TileSurface& surface);

/// A vertex in units of a tile and multiples of the height step.
struct TileVertex {
  std::uint32_t u = 0, v = 0;
  std::int64_t height = 0;
};

/// A side of a leaf, which is the same for the tiles on both sides: from part k to k + 1 along a
/// line. Lines and parts are 1 / 2^depth of a tile apart and are counted from -180, -90 degrees.
struct TileSideKey {
  bool along_parallel = false;  ///< from west to east; otherwise from south to north
  unsigned depth = 0;
  std::uint64_t line = 0, k = 0;
  friend auto operator<=>(const TileSideKey&, const TileSideKey&) = default;
};

/// Sides on the borders of a zoom's tiles, kept for the neighbouring tile. Positions are in units
/// of a tile, heights in metres.
using SharedSides = WindowSides<TileSideKey>;
/// Limit for SharedSides, at 16 bytes each.
inline constexpr std::size_t kMaxSharedVertices = std::size_t{1} << 16;

/// Computes the vertices on the sides of a tile's leaves. They depend only on the zoom's plan and
/// on the surface along the side, not on the tile or leaf that requests them. So shared sides are
/// equal, and leaves of different sizes match, because a side is divided wherever a leaf next to it
/// is.
class TileSides {
 public:
  /// shared: of the zoom; may be null.
  TileSides(const TileAddress& tile, const ZoomPlan& plan, TileSurface& surface,
            SharedSides* shared = nullptr);

  /// Returns the vertices counter-clockwise from the south-west corner, each once.
  std::vector<TileVertex> around(const TileLeaf& leaf);

 private:
  /// A side: from place k to k + 1 of 2^depth along `line` of 2^depth.
  struct Side {
    bool along_parallel = false;  ///< from west to east; otherwise from south to north
    unsigned depth = 0;
    std::uint32_t line = 0, k = 0;
  };
  std::shared_ptr<const SideVertices> vertices(const Side& side);
  SideVertices settle(const Side& side);
  /// The lowest and highest samples within a unit of a place on a side. If any are within half a
  /// unit, only these count.
  struct Samples {
    double low = 0.0, high = 0.0;
    bool any = false, on = false;

    void add(double height, double units);
  };
  using SamplesAt = std::map<double, Samples>;
  /// Adds the places of samples on a side to the places at which it is sampled. Returns the heights
  /// of these samples if the surface needs sides to pass through them.
  SamplesAt add_samples(const Side& side, std::vector<double>& t, std::vector<double>& longitude,
                        std::vector<double>& latitude);
  /// Returns the samples in a box around places on a side or at its end, which are the same for all
  /// tiles there. Returns nullopt if there may be too many.
  std::optional<SurfaceSamples> samples_near(const GeographicBox& box);
  /// Returns the samples at the end of a side, the same for all sides and tiles that meet there.
  std::optional<Samples> samples_at_corner(double longitude, double latitude);
  /// Returns the box around a side that both tiles can query: its ends, and a unit to either side.
  [[nodiscard]] GeographicBox band_around(const Side& side) const;
  /// Whether heights in a band differ by so little that the ends of the side suffice.
  [[nodiscard]] bool is_flat(const GeographicBox& band) const;
  [[nodiscard]] bool is_cut(const Side& side) const;
  /// Whether a leaf next to a side has too many samples; the same for both tiles.
  [[nodiscard]] bool is_crowded(const Side& side) const;
  /// Whether there may be samples within `reach` (degrees) of a side; the same for both tiles.
  [[nodiscard]] bool is_near_data(const Side& side, double reach) const;

  TileAddress tile_;
  const ZoomPlan& plan_;
  TileSurface& surface_;
  WindowSides<TileSideKey> inner_;  ///< within the tile
  WindowSides<TileSideKey>& border_;
  GeographicBox data_;
  std::map<std::pair<double, double>, std::optional<Samples>> corners_;
};

}  // namespace terrace::terrain
