// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/store.hpp>

#include "surface/bounded/point_mesh_cells.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

/// Scans the samples of a region and distributes them to the cells of a division of the plane.

namespace terrace::terrain {

/// The samples of a region, distributed to the cells of the plane. They are kept in a file next to
/// the output, as clusters may overlap many cells. The file is removed with the object. Several
/// threads may read at once.
class PointMeshSamples {
 public:
  /// Makes one pass over the store. path: of the mesh. places: converts samples, as in
  /// scan_point_mesh(). Throws: stream::Error on a damaged store, or if the file cannot be written.
  /// Memory: 16 MiB, plus 4 bytes per 40 samples or more.
  PointMeshSamples(const stream::Store& store, const Detail& detail, const PointMeshCuts& cuts,
                   const std::string& path, unsigned threads, const PlaceConversion& places = {});

  [[nodiscard]] std::size_t count(std::uint32_t first_cell, std::uint32_t cells) const;
  /// Appends the samples of some cells that are in the box, cell by cell. Within a cell they are in
  /// the order of the store: by level from the top down, in each level by id. Throws:
  /// stream::Error, stream::Stopped.
  void read(std::uint32_t first_cell, std::uint32_t cells, const PlaneBox& box, MeshSamples& out);

 private:
  void deal(std::size_t cell, const stream::Point3& p);
  void read_cell(std::size_t cell, const PlaneBox& box, MeshSamples& out);

  const stream::Store& store_;
  const PointMeshCuts& cuts_;
  stream::AtomicFile file_;
  std::size_t chunk_points_;
  std::vector<std::size_t> counts_;
  std::vector<std::vector<stream::Point3>> waiting_;  ///< samples that do not fill a chunk yet; in
                                                      ///< the end, the rest
  std::vector<std::vector<std::uint32_t>> chunks_;    ///< numbers of chunks, per cell
  std::uint32_t written_ = 0;
  std::mutex mutex_;
};

/// The result of one pass over the samples of a region.
struct PointMeshScan {
  std::uint64_t samples = 0;
  std::optional<MeshSamples> all;  ///< all samples, if they are few
  // Otherwise:
  std::vector<Point2> sample;  ///< every `period`-th place
  std::uint64_t period = 1;
  std::vector<Point2> hull;  ///< convex_hull() of all samples
};

/// Reads all samples once, in the order of the store. few: the most samples to keep. places:
/// converts samples before anything else. Memory: for `few` samples, up to a million places, and
/// the hull. Throws: stream::Error on a damaged store, and for a sample without an image in the
/// other CRS.
PointMeshScan scan_point_mesh(const stream::Store& store, const Detail& detail, std::size_t few,
                              unsigned threads, const PlaceConversion& places = {});

}  // namespace terrace::terrain
