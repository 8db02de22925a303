// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/grid_tin.hpp>

#include "mesh/bounded/mesher.hpp"
#include "surface/bounded/lattice_plan.hpp"
#include "surface/bounded/lattice_samples.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/region.hpp"

namespace terrace::terrain {

/// Options for meshing the windows of a raster. Heights are in the store's vertical unit.
struct WindowTinOptions {
  double bound = 0.0;  ///< limit for readers of the file
  /// The targets of Aim. The inside of a window is meshed to first_aim, and to the smaller `aim` if
  /// that misses the bound. Sides are always meshed to `aim`.
  double first_aim = 0.0, aim = 0.0;
  tri::GridTinOptions tin;
  LatticeWindow lattice;  ///< the window that contains all others
  /// If set, meshes have only the triangles that reach into it.
  std::optional<Region> region;
  /// Converts to the CRS of the file.
  PlaceConversion places;
  /// Returns the height of a sample without data; empty: it stays without data.
  std::function<double(std::int64_t column, std::int64_t row)> fill;
};

/// The mesh of one window. Vertices are in the order in which triangles first use them.
struct RasterWindow : BoundedWindow {
  /// A sample on a side that the window shares with a neighbour.
  struct SideSample {
    std::uint64_t place = 0;  ///< as in LatticePlan::Sample
    unsigned windows = 0;     ///< how many windows share it
  };
  /// Samples on shared sides, with data and inside the region, that are on no triangle of this
  /// window. The measures do not count them.
  std::vector<SideSample> uncovered;
};

struct WindowCount {
  std::size_t vertices = 0;
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// Meshes windows of one raster store. One object per thread.
class WindowMesher {
 public:
  WindowMesher(const stream::Store& store, WindowTinOptions options,
               const stream::MeshRounding& rounding);

  /// Meshes window i of a plan. The vertices on a side depend only on the samples on it and next to
  /// it, so two windows that share it have the same vertices there. Throws: stream::Error on a
  /// damaged store, and if rounded positions break the bound.
  RasterWindow mesh(const LatticePlan& plan, std::size_t i);
  /// Returns the number of vertices, unchecked, and the time to compute it.
  WindowCount count(const LatticeWindow& window, tri::TinQuality quality);

 private:
  struct WindowTin;
  /// with_data: adds the samples with data, before filling and inside the region; those on the
  /// first row and column count in the previous window.
  template <class T>
  LatticeSamples<T> read(const LatticeWindow& window, std::uint64_t& with_data);
  template <class T>
  WindowTin mesh_as(const LatticeWindow& window, tri::TinQuality quality, bool checked);
  /// Whether a sample of the window is in the region, if there is one.
  [[nodiscard]] bool in_region(const LatticeWindow& window, std::int64_t column, std::int64_t row,
                               double height) const;
  /// Returns the positions of the vertices in the CRS of the store.
  [[nodiscard]] std::vector<stream::Point3> positions(const WindowTin& tin) const;
  void measure_as_read(WindowTin& tin,
                       const std::function<tri::GridTinCheck(std::span<const tri::Point3>,
                                                             double tolerance)>& measure) const;
  /// Measures a valid mesh of the lattice at its converted positions, and swaps edges of thin
  /// triangles that would be inverted there.
  template <class T>
  void measure_moved(const LatticeSamples<T>& samples, WindowTin& tin) const;
  /// Throws: stream::Error.
  [[nodiscard]] stream::Error fault(const WindowTin& tin, std::string cause) const;
  /// Throws: stream::Error if a reader of the file would see an error beyond the bound, or a hole.
  void require_sound(const WindowTin& tin) const;
  void require_no_holes(const WindowTin& tin) const;

  const stream::Store& store_;
  WindowTinOptions options_;
  const stream::MeshRounding& rounding_;
  stream::Placement placement_;
  StoreWindow reader_;
};

}  // namespace terrace::terrain
