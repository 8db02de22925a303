// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/atomic_file.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/point_tin.hpp>

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/region.hpp"

/// Scans the samples of a region and distributes them to the cells of a kd-like division of the
/// plane.

namespace terrace::terrain {

inline constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();

/// A half-open rectangle of the plane, with its lower borders but without its upper ones, so that
/// each sample is in one cell. May be infinite.
struct PlaneBox {
  Point2 min{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Point2 max{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool contains(const Point2& p) const {
    return p[0] >= min[0] && p[0] < max[0] && p[1] >= min[1] && p[1] < max[1];
  }
  [[nodiscard]] bool meets(const PlaneBox& other) const {
    return min[0] < other.max[0] && other.min[0] < max[0] && min[1] < other.max[1] &&
           other.min[1] < max[1];
  }
};

/// The plane, divided repeatedly by lines of equal x or y until every cell has few samples.
struct PointMeshCuts {
  /// A line and its two sides.
  struct Node {
    unsigned axis = 0;  ///< 0: a line of equal x
    double line = 0.0;
    std::array<std::uint32_t, 2> next{};      ///< nodes, or kCell + a cell
    std::uint32_t first_cell = 0, cells = 0;  ///< cells on both sides
  };
  struct Cell {
    PlaneBox box;
    Point2 low{}, high{};  ///< approximate bounds of its samples
    double samples = 0.0;  ///< approximate
    double spacing = 0.0;  ///< approximate distance of neighbours
  };
  static constexpr std::uint32_t kCell = 0x80000000U;
  std::vector<Node> nodes;
  std::vector<Cell> cells;  ///< neighbours are mostly close in this order
  std::uint32_t root = kCell;

  [[nodiscard]] std::uint32_t cell_of(const Point2& p) const {
    std::uint32_t at = root;
    while (at < kCell) {
      const Node& node = nodes[at];
      at = node.next[p[node.axis] < node.line ? 0 : 1];
    }
    return at - kCell;
  }
};

/// Divides the plane into cells of slightly fewer than `max_per_cell` samples, unless too many
/// share a place. sample: every `period`-th sample of all.
///
/// Where possible, lines are between the given samples, in the widest gap near the ideal position.
/// Other samples may be on a line; they belong to the cell above. Depends only on the arguments.
/// O(n log n) for n given samples.
PointMeshCuts cut_for_point_mesh(std::vector<Point2> sample, std::uint64_t period,
                                 std::size_t max_per_cell);

/// Returns a number with few binary digits strictly between a and b, not close to either; a if
/// there is none between. Requires a < b.
double number_between(double a, double b);

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

/// Returns the height that represents several samples at one place, as in tri::point_tin(). With
/// `error` it is that of the first, with `all` the middle between the lowest and the highest.
/// heights: in order, not empty.
double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates);

/// The places shared by several samples.
struct SharedPlaces {
  std::uint64_t places = 0;
  double range = 0.0;  ///< largest difference of heights at a place
  Point2 widest{};     ///< the place with that difference

  /// Adds the shared places of more samples, none of which shares a place with earlier samples. O(n
  /// log n).
  void add(const MeshSamples& samples);
};

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
