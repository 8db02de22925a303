// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>

#include "base/ordered_work.hpp"
#include "base/progress_report.hpp"
#include "mesh/bounded/mesh_spool.hpp"
#include "terrace/terrain/bounded_mesh.hpp"

namespace terrace::terrain {

/// Targets for the error of a mesh such that, after the file's rounding, a reader sees no more than
/// the bound. Heights are rounded by a known amount; rounded places add a little more, depending on
/// the slope, and so do lines that are curves in the file. Both targets are the bound if the format
/// is exact and the samples are not moved.
struct Aim {
  double first = 0.0;  ///< ignores rounded places: to be tried, and checked
  double sure = 0.0;   ///< where the first misses the bound, or cannot be checked
  double bound = 0.0;  ///< what readers may see: infinite if a number of points was asked for, not
                       ///< a bound, and the two differ; what they do see is measured then
};

/// What was measured on the mesh of one window, as a reader of the file gets it back.
struct WindowMeasures {
  double max_error = 0.0, rms_error = 0.0;
  std::uint64_t covered = 0;    ///< samples that lie on triangles
  std::uint64_t samples = 0;    ///< counted in this window
  std::uint64_t uncovered = 0;  ///< of these, those that lie on no triangle of any window
  std::uint64_t duplicates = 0;
  std::uint64_t work = 0;  ///< the window's part of the whole work
  double reading_seconds = 0.0, meshing_seconds = 0.0;
};

/// Meshes the samples of a store at one bound after another, window by window. Heights and errors
/// are in the store's vertical unit.
class BoundedMesher {
 public:
  virtual ~BoundedMesher() = default;
  BoundedMesher(const BoundedMesher&) = delete;
  BoundedMesher& operator=(const BoundedMesher&) = delete;

  /// Meshes into the spool. Stops early once there are more than `most_vertices`, with an
  /// estimate of how many there would be. Throws: as write_bounded_mesh().
  virtual BoundedMeshResult run(double max_error, MeshSpool& spool,
                                std::uint64_t most_vertices) = 0;
  /// A quick estimate of the vertices that a bound takes, from some windows. Requires
  /// can_estimate().
  [[nodiscard]] virtual double estimate(double max_error) const = 0;
  [[nodiscard]] virtual bool can_estimate() const = 0;

  [[nodiscard]] double metres_vertical() const;
  /// The bounds of the file's vertices, in its CRS.
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }
  [[nodiscard]] const MeshCoordinates& coordinates() const { return coordinates_; }

 protected:
  /// All must outlive it.
  BoundedMesher(const stream::Store& store, const BoundedMeshOptions& options,
                const Context& context);

  /// Throws: stream::Error if the file's format rounds too coarsely for the bound.
  [[nodiscard]] Aim aim_within(double bound) const;
  /// How many threads the memory allows, with `each` bytes per window and `beside` bytes in all.
  /// purpose: follows the needed memory in the error, as in " for 5 points at a time".
  /// Throws: stream::Error if it does not suffice for one.
  [[nodiscard]] unsigned threads_within_memory(std::uint64_t each, std::uint64_t beside,
                                               const std::string& purpose = {}) const;

  /// Makes windows by `threads` threads and joins them in order: make(worker, i) gives a window's
  /// mesh, join(i, mesh) spools it and returns its WindowMeasures. total_work: of all windows.
  template <class Make, class Join>
  BoundedMeshResult run_windows(std::size_t windows, unsigned threads, std::uint64_t total_work,
                                MeshSpool& spool, std::uint64_t most_vertices, const Make& make,
                                const Join& join) const {
    BoundedMeshResult result;
    ProgressReport report(context_, "samples");
    double squares = 0.0, covered = 0.0;
    std::uint64_t work = 0;
    struct Enough {};
    try {
      in_order(
          windows, threads,
          [&](unsigned worker, std::size_t i) {
            context_.check_stop();
            return make(worker, i);
          },
          [&](std::size_t i, auto&& mesh) {
            const WindowMeasures window = join(i, std::forward<decltype(mesh)>(mesh));
            work += window.work;
            if (spool.vertices() > most_vertices) throw Enough{};
            result.max_error = std::max(result.max_error, window.max_error);
            const auto count = static_cast<double>(window.covered);
            squares += window.rms_error * window.rms_error * count;
            covered += count;
            result.samples += window.samples;
            result.uncovered += window.uncovered;
            result.duplicates += window.duplicates;
            result.reading_seconds += window.reading_seconds;
            result.meshing_seconds += window.meshing_seconds;
            report.update(work, static_cast<double>(work) / static_cast<double>(total_work));
          });
    } catch (const Enough&) {
      const double part =
          std::clamp(static_cast<double>(work) / static_cast<double>(total_work), 1e-9, 1.0);
      result.vertices =
          std::max(static_cast<std::uint64_t>(static_cast<double>(spool.vertices()) / part),
                   most_vertices + 1);
      return result;
    }
    result.vertices = spool.vertices();
    result.triangles = spool.triangles();
    result.rms_error = covered > 0.0 ? std::sqrt(squares / covered) : 0.0;
    return result;
  }

  const stream::Store& store_;
  const BoundedMeshOptions& options_;
  const Context& context_;
  stream::Placement placement_;
  stream::Box3 bounds_;
  MeshCoordinates coordinates_;
  stream::MeshRounding rounding_;

 private:
  /// Whether lines of a raster's samples are curves in the file.
  [[nodiscard]] bool bends() const { return store_.schema().grid && options_.places.has_effect(); }
};

}  // namespace terrace::terrain
