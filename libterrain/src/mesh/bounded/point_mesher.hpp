// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <terrace/stream/error.hpp>
#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>

#include "earth/ground.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/point_mesh_cuts.hpp"
#include "mesh/bounded/point_mesh_plan.hpp"
#include "mesh/bounded/point_mesh_samples.hpp"
#include "mesh/bounded/point_mesh_scan.hpp"
#include "mesh/bounded/point_mesh_window.hpp"
#include "terrace/terrain/bounded_mesh.hpp"

namespace terrace::terrain {

/// Meshes the irregular samples of a store at one bound after another.
class PointMesher {
 public:
  PointMesher(const stream::Store& store, const BoundedMeshOptions& options,
              const Context& context);

  /// Meshes into the spool. max_error in the vertical unit. Stops early once there are more than
  /// `most_vertices`, and tells about how many there would be.
  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices);
  /// Whether run() keeps to options.max_points by itself: the samples fit into one window.
  [[nodiscard]] bool limits_points() const { return single(); }
  /// About how many vertices a bound takes, in the vertical unit, quickly.
  [[nodiscard]] double estimate(double max_error) const;
  [[nodiscard]] bool can_estimate() const { return samples_.has_value(); }
  [[nodiscard]] double metres_vertical() const {
    return Ground(placement_).map(store_.bounds())[8] / placement_.coordinates[2].scale;
  }
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }

 private:
  [[nodiscard]] bool single() const { return scan_.whole.has_value(); }
  [[nodiscard]] PointMeshOptions mesh_options(double max_error) const;
  /// Why samples at one place are refused: how many places, and how far apart.
  [[nodiscard]] stream::Error shared_places_error() const;
  BoundedMeshResult run_whole(const PointMeshOptions& options, MeshSpool& spool) const;
  BoundedMeshResult run_windows(const PointMeshOptions& options, MeshSpool& spool,
                                std::uint64_t most_vertices) const;
  [[nodiscard]] PointMeshPlan plan_for(double max_error) const;
  /// With windows that need `each` bytes.
  unsigned threads_within_memory(std::uint64_t each, std::uint64_t points) const;

  const stream::Store& store_;
  const BoundedMeshOptions& options_;
  const Context& context_;
  stream::Placement placement_;
  stream::Box3 bounds_;
  stream::MeshRounding rounding_;
  PointMeshScan scan_;
  PointMeshCuts cuts_;
  // Read under a lock.
  mutable std::optional<PointMeshSamples> samples_;
  unsigned cell_threads_ = 1;
  double reading_seconds_ = 0.0;
};

}  // namespace terrace::terrain
