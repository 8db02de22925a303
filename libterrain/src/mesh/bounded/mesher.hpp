// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include <terrace/stream/mesh_writer.hpp>
#include <terrace/stream/store.hpp>

#include "base/progress_report.hpp"
#include "mesh/bounded/spool.hpp"
#include "surface/window_mesh.hpp"
#include "terrace/terrain/bounded_mesh.hpp"

namespace terrace::terrain {

/// Targets for the error of a mesh. They leave room for the rounding of the file, so that its
/// readers see at most the bound. Heights are rounded by a known amount. Rounded places add
/// slightly more, depending on the slope, and so do lines that are curves in the file. Both targets
/// equal the bound if the format is exact and the samples are not converted.
struct Aim {
  double first = 0.0;  ///< ignores rounded places: try it first, then check
  double sure = 0.0;   ///< use it where the first misses the bound or cannot be checked
  double bound = 0.0;  ///< limit for readers; infinite if a number of points was requested and the
                       ///< format or conversion is not exact; the actual error is then measured
};

/// Meshes the samples of a store window by window, possibly for several bounds in turn. Heights and
/// errors are in the store's vertical unit.
class BoundedMesher {
 public:
  virtual ~BoundedMesher() = default;
  BoundedMesher(const BoundedMesher&) = delete;
  BoundedMesher& operator=(const BoundedMesher&) = delete;

  /// Meshes into the spool. Stops early with more than `max_vertices` vertices, and then estimates
  /// their final number. Throws: as write_bounded_mesh().
  virtual BoundedMeshResult run(double max_error, MeshSpool& spool, std::uint64_t max_vertices) = 0;
  /// Estimates the number of vertices for a bound quickly, from some windows. Requires
  /// can_estimate().
  [[nodiscard]] virtual double estimate(double max_error) const = 0;
  [[nodiscard]] virtual bool can_estimate() const = 0;

  [[nodiscard]] double metres_vertical() const;
  /// The bounds of the file's vertices, in its CRS.
  [[nodiscard]] const stream::Box3& bounds() const { return bounds_; }
  [[nodiscard]] const MeshCoordinates& coordinates() const { return coordinates_; }

 protected:
  /// The arguments must outlive this object.
  BoundedMesher(const stream::Store& store, const BoundedMeshOptions& options,
                const Context& context);

  /// Throws: stream::Error if the rounding of the file's format is too coarse for the bound.
  [[nodiscard]] Aim aim_within(double bound) const;
  /// Returns how many threads the memory allows, with `each` bytes per window and `shared` bytes
  /// for all of them. purpose: follows the needed memory in the error, such as " for 5 points at a
  /// time". Throws: stream::Error if memory does not suffice for one thread.
  [[nodiscard]] unsigned threads_within_memory(std::uint64_t each, std::uint64_t shared,
                                               const std::string& purpose = {}) const;

  /// Makes windows with `threads` threads, joins them in order and spools them. make(worker, i)
  /// returns a BoundedWindow or a type derived from it. joined(i, window) is called in order and
  /// may correct the measures. total_work: of all windows.
  template <class Make, class Joined>
  BoundedMeshResult run_windows(std::size_t windows, unsigned threads, std::uint64_t total_work,
                                MeshSpool& spool, std::uint64_t max_vertices, const Make& make,
                                const Joined& joined) const {
    BoundedMeshResult result;
    ProgressReport report(context_, "samples");
    double squares = 0.0, covered = 0.0;
    std::uint64_t work = 0;
    mesh_windows(
        windows, threads, [&] { context_.check_stop(); }, make,
        [&](std::size_t i, auto&& mesh) {
          joined(i, mesh);
          spool.add_vertices(mesh.vertices);
          spool.add_triangles(mesh.triangles);
          const WindowMeasures& window = mesh.measures;
          work += window.work;
          if (spool.vertices() > max_vertices) return false;
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
          return true;
        });
    if (spool.vertices() > max_vertices) {
      const double part =
          std::clamp(static_cast<double>(work) / static_cast<double>(total_work), 1e-9, 1.0);
      result.vertices =
          std::max(static_cast<std::uint64_t>(static_cast<double>(spool.vertices()) / part),
                   max_vertices + 1);
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

/// Meshes a raster store. Windows share their sides, and the vertices on a side depend only on the
/// samples there. The arguments must outlive the result. Throws: stream::Error if memory does not
/// suffice, UsageError.
std::unique_ptr<BoundedMesher> make_raster_mesher(const stream::Store& store,
                                                  const BoundedMeshOptions& options,
                                                  const Context& context);
/// Meshes the irregular samples of a store: in one piece if they are few, otherwise distributed to
/// the cells of a division of the plane. Otherwise as make_raster_mesher().
std::unique_ptr<BoundedMesher> make_point_mesher(const stream::Store& store,
                                                 const BoundedMeshOptions& options,
                                                 const Context& context);

}  // namespace terrace::terrain
