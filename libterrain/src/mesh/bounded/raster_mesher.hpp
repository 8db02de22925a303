// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>

#include "mesh/bounded/mesh_spool.hpp"
#include "mesh/bounded/window_tin.hpp"
#include "surface/store_fill.hpp"
#include "surface/store_window.hpp"
#include "terrace/terrain/bounded_mesh.hpp"

namespace terrace::terrain {

/// Meshes a raster store at one bound or another, window by window.
class RasterMesher {
 public:
  /// All must outlive it. Throws: stream::Error if the memory does not suffice, UsageError.
  RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
               const Context& context);

  /// Meshes into the spool. max_error in the vertical unit. Stops once there are more than
  /// `most_vertices` and returns about how many there would be.
  BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t most_vertices);
  /// About how many vertices there are, from some windows here and there; worth it only if they
  /// are a small part of all.
  [[nodiscard]] double estimate(double max_error) const;
  [[nodiscard]] bool can_estimate() const;
  /// Whether run() keeps to options.max_points by itself.
  [[nodiscard]] static bool limits_points() { return false; }

  [[nodiscard]] double metres_vertical() const;
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }

 private:
  [[nodiscard]] unsigned threads_within_memory() const;
  [[nodiscard]] WindowTinOptions window_options(double max_error) const;
  [[nodiscard]] std::vector<std::unique_ptr<WindowMesher>> meshers(double max_error) const;
  /// What some windows have, by data and bound alone.
  struct Sample {
    double vertices_per_sample = 0.0;
    double reading_seconds = 0.0, meshing_seconds = 0.0;
  };
  [[nodiscard]] Sample sample(double max_error, tri::TinQuality quality, std::size_t across,
                              std::size_t down) const;
  /// How large windows should be, from the vertices per sample of greedy insertion.
  static std::int64_t window_cells(double per_sample);

  const stream::Store& store_;
  const BoundedMeshOptions& options_;
  const Context& context_;
  stream::Placement placement_;
  LatticeWindow whole_;
  stream::Box3 bounds_;
  stream::MeshRounding rounding_;
  unsigned threads_ = 1;
  std::shared_ptr<const StoreFill> fill_;
};

}  // namespace terrace::terrain
