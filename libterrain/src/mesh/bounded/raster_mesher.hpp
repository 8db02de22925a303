// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <terrace/stream/store.hpp>

#include "mesh/bounded/bounded_mesher.hpp"
#include "mesh/bounded/raster_window_tin.hpp"
#include "surface/store_fill.hpp"
#include "surface/store_window.hpp"

namespace terrace::terrain {

/// Meshes a raster store. Windows share their sides, and the vertices on a side depend only on the
/// samples there.
class RasterMesher final : public BoundedMesher {
 public:
  /// Throws: stream::Error if memory does not suffice, UsageError.
  RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
               const Context& context);

  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices) override;
  [[nodiscard]] double estimate(double max_error) const override;
  /// Whether the sampled windows are a small part of all.
  [[nodiscard]] bool can_estimate() const override;

 private:
  [[nodiscard]] WindowTinOptions window_options(double max_error) const;
  [[nodiscard]] std::vector<std::unique_ptr<WindowMesher>> meshers(double max_error) const;
  /// Measured on some windows; depends only on data and bound.
  struct Sample {
    double vertices_per_sample = 0.0;
    double reading_seconds = 0.0, meshing_seconds = 0.0;
  };
  [[nodiscard]] Sample sample(double max_error, tri::TinQuality quality, std::size_t across,
                              std::size_t down) const;

  /// Returns the largest size of a window along each axis, in cells, at which a straight edge in
  /// the file is within kMostBend of the samples along it. Requires a conversion.
  [[nodiscard]] std::int64_t straight_cells() const;

  LatticeWindow whole_;
  std::int64_t most_cells_ = std::numeric_limits<std::int64_t>::max();  ///< of a window, along each
                                                                        ///< axis
  unsigned threads_ = 1;
  std::shared_ptr<const StoreFill> fill_;
};

}  // namespace terrace::terrain
