// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/mesh_writer.hpp>

#include "base/units.hpp"
#include "surface/bounded/bounded_surface.hpp"
#include "surface/bounded/point_mesh_cells.hpp"
#include "surface/bounded/point_window_tin.hpp"
#include "surface/bounded/point_windows.hpp"
#include "surface/point_hull.hpp"
#include "surface/window_tree.hpp"

namespace terrace::terrain {
namespace {

/// The number of points in a window is estimated from a coarser level, so a window may have up to
/// this many times as many as it should.
constexpr std::size_t kMostCrowded = 4;
/// A sample, its lists and the memory of removal.
constexpr std::uint64_t kBytesPerBoundedPoint = 264;
/// Limit of the side vertices that are kept.
constexpr std::size_t kMaxSideVertices = std::size_t{1} << 18;

class BoundedCloud final : public BoundedSurface {
 public:
  BoundedCloud(const stream::Store& store, double bound, std::size_t window_points)
      : BoundedSurface(
            store, std::min<std::uint64_t>(store.whole().points(), kMostCrowded * window_points) *
                       kBytesPerBoundedPoint),
        max_points_(kMostCrowded * window_points) {
    options_.bound = options_.first_aim = options_.tin.max_error = bound;
    options_.tin.check_stop = [this] { store_.check_stop(); };
    const PointHull hull(store_, 0);
    if (hull.is_flat()) return;
    CoarsePlaces coarse = coarse_places(store_, 0);
    const auto period = static_cast<std::uint64_t>(std::max(1.0, std::round(coarse.each)));
    cuts_ = cut_for_point_mesh(std::move(coarse.places), period, window_points);
    // Window i is cell i, because none are merged.
    plan_ =
        plan_point_mesh(cuts_, hull.corners(), [](std::uint32_t, std::uint32_t) { return false; });
    const ReadCells read = [this](std::uint32_t first_cell, std::uint32_t cells,
                                  const PlaneBox& box, MeshSamples& out) {
      for (std::uint32_t cell = first_cell; cell < first_cell + cells; ++cell) {
        read_cell(cell, box, out);
      }
    };
    sides_ = std::make_unique<PointMeshSides>(plan_, read, options_.tin.duplicates, bound,
                                              kMaxSideVertices);
    mesher_ = std::make_unique<PointWindowMesher>(plan_, read, *sides_, options_, exact_, store_);
  }

  [[nodiscard]] std::size_t size() const override { return plan_.windows.size(); }

  [[nodiscard]] StoredBox box(std::size_t window) const override {
    StoredBox box = flat(store_.bounds());
    for (std::size_t k = 0; k < 2; ++k) {
      box.min[k] = std::max(box.min[k], plan_.windows[window].box.min[k]);
      box.max[k] = std::min(box.max[k], plan_.windows[window].box.max[k]);
    }
    return box;
  }

  void append_windows_at(const Point2& place, std::vector<std::uint32_t>& out) const override {
    if (size() > 0) append_at(cuts_.root, place, out);
  }

  [[nodiscard]] BoundedPart mesh(std::size_t window) const override {
    BoundedWindow mesh = mesher_->mesh(window);
    std::vector<SurfaceCorner> vertices;
    vertices.reserve(mesh.vertices.size());
    for (const stream::Point3& v : mesh.vertices) vertices.push_back({flat(v), v[2]});
    std::vector<std::uint32_t> last(vertices.size(), static_cast<std::uint32_t>(window));
    for (const SharedVertex& shared : mesh.shared) {
      last[shared.vertex] = static_cast<std::uint32_t>(shared.last);
    }
    return {std::move(vertices), std::move(mesh.triangles), std::move(last)};
  }

 private:
  void append_at(std::uint32_t at, const Point2& place, std::vector<std::uint32_t>& out) const {
    if (at >= PointMeshCuts::kCell) return out.push_back(at - PointMeshCuts::kCell);
    const PointMeshCuts::Node& node = cuts_.nodes[at];
    if (place[node.axis] <= node.line) append_at(node.next[0], place, out);
    if (place[node.axis] >= node.line) append_at(node.next[1], place, out);
  }

  void read_cell(std::uint32_t cell, const PlaneBox& box, MeshSamples& out) const {
    const PlaneBox& own = cuts_.cells[cell].box;
    if (!own.meets(box)) return;
    StoredBox both;
    for (std::size_t k = 0; k < 2; ++k) {
      both.min[k] = std::max(own.min[k], box.min[k]);
      both.max[k] = std::min(own.max[k], box.max[k]);
    }
    StoreWindow reader(store_);
    WindowPoints points;
    reader.points(both, points);
    if (points.positions.size() > max_points_) {
      throw stream::Error(
          store_.path().string(),
          stream::message("{} are close together, too many for a surface within {max_error}",
                          counted(points.positions.size(), "point")))
          .remedy(stream::message("choose a coarser {level} instead"));
    }
    const stream::Channel& z = store_.schema().coordinates[2];
    for (const stream::Point3& p : points.positions) {
      if (own.contains(flat(p)) && box.contains(flat(p))) {
        out.add({p[0], p[1], p[2] * z.scale + z.offset});
      }
    }
  }

  std::size_t max_points_;
  PointMeshOptions options_;
  stream::MeshRounding exact_;
  PointMeshCuts cuts_;
  PointMeshPlan plan_;
  std::unique_ptr<PointMeshSides> sides_;
  std::unique_ptr<PointWindowMesher> mesher_;
};

}  // namespace

std::unique_ptr<BoundedSurface> bounded_cloud(const stream::Store& store, double bound,
                                              std::size_t window_points) {
  return std::make_unique<BoundedCloud>(store, bound, window_points);
}

}  // namespace terrace::terrain
