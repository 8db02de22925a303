// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "mesh/bounded/bounded_mesher.hpp"
#include "mesh/bounded/point_mesh_cells.hpp"
#include "mesh/bounded/point_window_tin.hpp"
#include "mesh/bounded/point_windows.hpp"

namespace terrace::terrain {

/// Meshes the irregular samples of a store: in one piece if they are few, otherwise distributed to
/// the cells of a division of the plane.
class PointMesher final : public BoundedMesher {
 public:
  PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
              const Context& context);

  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices) override;
  [[nodiscard]] double estimate(double max_error) const override;
  [[nodiscard]] bool can_estimate() const override { return samples_.has_value(); }

 private:
  [[nodiscard]] bool single() const { return scan_.whole.has_value(); }
  [[nodiscard]] PointMeshOptions mesh_options(double max_error) const;
  /// Describes the samples at one place: how many places there are, and how much the heights
  /// differ.
  [[nodiscard]] stream::Error shared_places_error() const;
  BoundedMeshResult run_whole(const PointMeshOptions& options, MeshSpool& spool) const;
  BoundedMeshResult run_plan(const PointMeshOptions& options, MeshSpool& spool,
                             std::uint64_t most_vertices) const;
  [[nodiscard]] PointMeshPlan plan_for(double max_error) const;
  /// The number of threads for windows that need `each` bytes.
  [[nodiscard]] unsigned threads_for(std::uint64_t each, std::uint64_t points) const;

  PointMeshScan scan_;
  PointMeshCuts cuts_;
  // Locks internally.
  mutable std::optional<PointMeshSamples> samples_;
  unsigned cell_threads_ = 1;
  double reading_seconds_ = 0.0;
};

}  // namespace terrace::terrain
