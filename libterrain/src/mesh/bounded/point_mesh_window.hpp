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

#include "mesh/bounded/point_mesh_plan.hpp"
#include "mesh/bounded/point_mesh_samples.hpp"
#include "mesh/bounded/point_mesh_sides.hpp"

namespace terrace::terrain {

/// How irregular samples are meshed. Heights in the store's vertical unit.
struct PointMeshOptions {
  double bound = 0.0;  ///< what readers of the file may see
  /// Its max_error: what is meshed to, less where the file rounds positions. first_aim: tried
  /// before, inside windows; not less.
  tri::PointTinOptions tin;
  double first_aim = 0.0;
};

/// The mesh of one window.
struct PointWindowTin {
  /// What windows share: a vertex of a side, or of a knot; or neither.
  struct Shared {
    std::uint32_t knot = kNoNumber;
    std::uint32_t side = kNoNumber, place = 0;  ///< place: which of PointMeshSides::vertices()
  };
  std::vector<tri::Point3> vertices;
  std::vector<Shared> shared;  ///< of the first vertices; the others belong to this window alone
  std::vector<std::array<std::uint32_t, 3>> triangles;
  tri::TinErrors errors;  ///< of what a reader gets back
  std::size_t samples = 0, duplicates = 0;
  std::size_t uncovered = 0;  ///< of the samples, those that lie on no triangle
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// Thrown where several samples have one place and must not, or differ by more than the bound.
struct SamplesShareAPlace {};

/// Meshes samples and measures what a reader of the file gets back. frame: as in tri::point_tin();
/// box: what the frame's straight sides lie on, as far as it is finite.
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
