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

/// How irregular samples are meshed. Heights in the store's vertical unit.
struct PointMeshOptions {
  double bound = 0.0;  ///< what readers of the file may see
  /// tin.max_error and first_aim: the targets of Aim. first_aim is tried first, inside windows.
  tri::PointTinOptions tin;
  double first_aim = 0.0;
};

/// The mesh of one window.
struct PointWindowTin {
  /// The side or the knot that a shared vertex belongs to, if any.
  struct Shared {
    std::uint32_t knot = kNoNumber;
    std::uint32_t side = kNoNumber, place = 0;  ///< place: which of PointMeshSides::vertices()
  };
  std::vector<tri::Point3> vertices;
  std::vector<Shared> shared;  ///< of the first vertices; the others belong to this window alone
  std::vector<std::array<std::uint32_t, 3>> triangles;
  tri::TinErrors errors;  ///< of the mesh that a reader gets back
  std::size_t samples = 0, duplicates = 0;
  std::size_t uncovered = 0;  ///< of the samples, those that lie on no triangle
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// Thrown where several samples have one place and must not, or differ by more than the bound.
struct SamplesShareAPlace {};

/// Meshes samples and measures what a reader of the file gets back. frame: as in tri::point_tin();
/// box: the frame's straight sides lie on its finite sides.
/// Throws: SamplesShareAPlace; stream::Error where the bound is missed.
PointWindowTin mesh_samples(const MeshSamples& samples, const std::vector<tri::Point3>& frame,
                            const PlaneBox& box, const PointMeshOptions& options,
                            const stream::MeshRounding& rounding, const std::string& source);

/// Meshes the windows of a plan, by any number of threads at once.
class PointWindowMesher {
 public:
  /// source: what errors name.
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
