// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <terrace/base/portable_math.hpp>
#include <terrace/tri/grid_tin.hpp>

#include "earth/ground.hpp"
#include "surface/bounded/bounded_surface.hpp"
#include "surface/bounded/lattice_plan.hpp"
#include "surface/bounded/lattice_samples.hpp"

namespace terrace::terrain {
namespace {

/// Memory of a window per sample in the worst case: every sample is a vertex.
constexpr std::uint64_t kBytesPerWindowSample = 448;

LatticePlan plan_of(const stream::Store& store, std::int64_t window_cells) {
  return LatticePlan({0, 0, static_cast<std::int64_t>(store.schema().columns),
                      static_cast<std::int64_t>(store.schema().rows)},
                     window_cells);
}

/// Returns the memory of the largest window, or slightly more.
std::uint64_t window_bytes(const LatticePlan& plan) {
  const LatticeWindow window = plan.window(0);
  return kBytesPerWindowSample * static_cast<std::uint64_t>(window.columns + 1) *
         static_cast<std::uint64_t>(window.rows + 1);
}

class BoundedRaster final : public BoundedSurface {
 public:
  BoundedRaster(const stream::Store& store, double bound, std::int64_t window_cells)
      : BoundedSurface(store, window_bytes(plan_of(store, window_cells))),
        plan_(plan_of(store, window_cells)) {
    const GroundMap ground = Ground(store.schema()).map(store.bounds());
    const bool mirrored = ground[0] * ground[4] - ground[1] * ground[3] < 0.0;
    options_.max_error = bound;
    options_.column_step = base::hypot(ground[0], ground[3]);
    options_.row_step = (mirrored ? -1.0 : 1.0) * base::hypot(ground[1], ground[4]);
    options_.measure = false;
    options_.check_stop = [this] { store_.check_stop(); };
  }

  [[nodiscard]] std::size_t size() const override { return plan_.size(); }

  [[nodiscard]] StoredBox box(std::size_t window) const override {
    const LatticeWindow w = plan_.window(window);
    return {
        {static_cast<double>(w.column), static_cast<double>(w.row)},
        {static_cast<double>(w.column + w.columns - 1), static_cast<double>(w.row + w.rows - 1)}};
  }

  void append_windows_at(const Point2& place, std::vector<std::uint32_t>& out) const override {
    plan_.append_windows_at(place, out);
  }

  [[nodiscard]] BoundedPart mesh(std::size_t window) const override {
    StoreWindow reader(store_);
    return reader.float_is_exact() ? mesh_as<float>(reader, window)
                                   : mesh_as<double>(reader, window);
  }

 private:
  template <class T>
  [[nodiscard]] BoundedPart mesh_as(StoreWindow& reader, std::size_t number) const {
    const LatticeWindow window = plan_.window(number);
    const auto samples =
        LatticeSamples<T>::read(reader, window, [](std::int64_t, std::int64_t, T&) {});
    const tri::GridTin tin =
        tri::grid_tin<T>(samples.grid(), samples.sides(options_.max_error), options_);
    std::vector<SurfaceCorner> vertices;
    std::vector<std::uint32_t> last;
    vertices.reserve(tin.vertices.size());
    last.reserve(tin.vertices.size());
    for (const tri::GridVertex& v : tin.vertices) {
      vertices.push_back(
          {{static_cast<double>(window.column + v.column), static_cast<double>(window.row + v.row)},
           v.height});
      last.push_back(static_cast<std::uint32_t>(plan_.sample(number, v.column, v.row).last));
    }
    return {std::move(vertices), tin.triangles, std::move(last)};
  }

  LatticePlan plan_;
  tri::GridTinOptions options_;
};

}  // namespace

std::unique_ptr<BoundedSurface> bounded_raster(const stream::Store& store, double bound,
                                               std::int64_t window_cells) {
  return std::make_unique<BoundedRaster>(store, bound, window_cells);
}

}  // namespace terrace::terrain
