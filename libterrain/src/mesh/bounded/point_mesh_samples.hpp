// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "mesh/bounded/point_mesh_cuts.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {

/// Samples in the CRS's coordinates.
struct MeshSamples {
  std::vector<double> x, y, z;

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void reserve(std::size_t count) {
    for (std::vector<double>* axis : {&x, &y, &z}) axis->reserve(count);
  }
  void add(const stream::Point3& p) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
};

/// The height that stands for several samples at one place, as tri::point_tin() takes it. With
/// kError that of the first, with kAll the middle of the lowest and the highest. heights: in order,
/// not empty.
double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates);

/// What is known of places that several samples share.
struct SharedPlaces {
  std::uint64_t places = 0;
  double range = 0.0;  ///< the largest difference of heights at one of them
  Point2 widest{};     ///< where that is

  /// Adds those of more samples, none of which shares a place with earlier ones. O(n log n).
  void add(const MeshSamples& samples);
};

/// The samples of a region, dealt to the cells of the plane: on disk, beside the file that is made,
/// as clusters may reach over many cells. What is kept goes with the object. Reading: by several
/// threads at once.
class PointMeshSamples {
 public:
  /// One pass over the store. path: of the mesh. Throws: stream::Error on a damaged store, or if
  /// the disk is full or the like. Memory: 16 MiB, and 4 bytes per 40 samples or more.
  PointMeshSamples(const stream::Store& store, const Detail& detail, const PointMeshCuts& cuts,
                   const std::string& path);

  [[nodiscard]] std::size_t count(std::uint32_t first_cell, std::uint32_t cells) const;
  /// Appends the samples of some cells that lie in the box, by cells, of each in the order of the
  /// store: of its levels from the top down, in each by id.
  void read(std::uint32_t first_cell, std::uint32_t cells, const PlaneBox& box, MeshSamples& out);

 private:
  void deal(std::size_t cell, const stream::Point3& p);
  void read_cell(std::size_t cell, const PlaneBox& box, MeshSamples& out);

  const PointMeshCuts& cuts_;
  stream::AtomicFile file_;
  std::size_t chunk_points_;
  std::vector<std::size_t> counts_;
  std::vector<std::vector<stream::Point3>> waiting_;  ///< until they make a chunk; then the rest
  std::vector<std::vector<std::uint32_t>> chunks_;    ///< numbers, per cell
  std::uint32_t written_ = 0;
  std::mutex mutex_;
};

}  // namespace terrace::terrain
