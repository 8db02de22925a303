// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_cells.hpp"
#include "mesh/bounded/point_windows.hpp"

namespace terrace::terrain {

/// How to mesh irregular samples. Heights are in the store's vertical unit.
struct PointMeshOptions {
  double bound = 0.0;  ///< limit for readers of the file
  /// tin.max_error and first_aim: the targets of Aim. first_aim is tried first, inside windows.
  tri::PointTinOptions tin;
  double first_aim = 0.0;
};

/// The mesh of one window.
struct PointWindowTin {
  /// The side or the knot that a shared vertex belongs to, if any.
  struct Shared {
    std::uint32_t knot = kNoNumber;
    std::uint32_t side = kNoNumber, place = 0;  ///< place: index in PointMeshSides::vertices()
  };
  std::vector<tri::Point3> vertices;
  std::vector<Shared> shared;  ///< of the first vertices; the others belong only to this window
  std::vector<std::array<std::uint32_t, 3>> triangles;
  tri::TinErrors errors;  ///< of the mesh as a reader decodes it
  std::size_t samples = 0, duplicates = 0;
  std::size_t uncovered = 0;  ///< samples on no triangle
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// Thrown if several samples share a place although that is refused, or differ by more than the
/// bound.
struct SamplesShareAPlace {};

/// Meshes samples and measures what a reader of the file decodes. frame: as in tri::point_tin();
/// box: the frame's straight sides are on its finite sides. Throws: SamplesShareAPlace;
/// stream::Error if the bound is missed.
PointWindowTin mesh_samples(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                            const PlaneBox& box, const PointMeshOptions& options,
                            const stream::MeshRounding& rounding, const std::string& source);

/// Meshes the windows of a plan. Thread-safe.
class PointWindowMesher {
 public:
  /// source: named in errors.
  PointWindowMesher(const PointMeshPlan& plan, PointMeshSamples& samples, PointMeshSides& sides,
                    const PointMeshOptions& options, const stream::MeshRounding& rounding,
                    std::string source);

  [[nodiscard]] PointWindowTin mesh(std::size_t window) const;

 private:
  const PointMeshPlan& plan_;
  PointMeshSamples& samples_;
  PointMeshSides& sides_;
  const PointMeshOptions& options_;
  const stream::MeshRounding& rounding_;
  std::string source_;
};

}  // namespace terrace::terrain
