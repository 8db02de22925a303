// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "surface/bounded/point_mesh_cells.hpp"
#include "surface/bounded/point_windows.hpp"
#include "surface/window_mesh.hpp"

namespace terrace::terrain {

/// Options for meshing irregular samples. Heights are in the store's vertical unit.
struct PointMeshOptions {
  double bound = 0.0;  ///< limit for readers of the file
  /// tin.max_error and first_aim: the targets of Aim. first_aim is tried first, inside windows.
  tri::PointTinOptions tin;
  double first_aim = 0.0;
};

/// Thrown if several samples share a place, and the options refuse that or their heights differ by
/// more than the bound.
struct SamplesShareAPlace {};

/// Meshes samples and measures what a reader of the file decodes. frame: as in tri::point_tin(),
/// the first vertices of the mesh. box: its finite sides contain the straight sides of the frame.
/// store: named in errors. Throws: SamplesShareAPlace; stream::Error if the bound is missed;
/// stream::Stopped.
BoundedWindow mesh_samples(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                           const PlaneBox& box, const PointMeshOptions& options,
                           const stream::MeshRounding& rounding, const stream::Store& store);

/// Meshes the windows of a plan. Thread-safe.
class PointWindowMesher {
 public:
  /// store: named in errors.
  PointWindowMesher(const PointMeshPlan& plan, ReadCells read, PointMeshSides& sides,
                    const PointMeshOptions& options, const stream::MeshRounding& rounding,
                    const stream::Store& store);

  [[nodiscard]] BoundedWindow mesh(std::size_t window) const;

 private:
  const PointMeshPlan& plan_;
  ReadCells read_;
  PointMeshSides& sides_;
  const PointMeshOptions& options_;
  const stream::MeshRounding& rounding_;
  const stream::Store& store_;
};

}  // namespace terrace::terrain
