// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/raster_mesher.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include <terrace/base/ordered_work.hpp>
#include <terrace/base/portable_math.hpp>

#include "earth/ground.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Smallest and largest size of a window along each axis, in cells; the largest is for small
/// meshes.
constexpr std::int64_t kWindowCells = 512, kWidestCells = 2048;
/// Target for the vertices per window, so that few of them are on sides, where they cannot be
/// removed.
constexpr double kVerticesPerWindow = 3000.0;
/// Size along each axis, in cells, of the windows that estimates are made from.
constexpr std::int64_t kSampleCells = 256;
/// Worst case per thread: a window of kWindowCells with every sample a vertex, or one of
/// kWidestCells with few, and the waiting results.
constexpr std::uint64_t kBytesPerThread = std::uint64_t{112} << 20;
constexpr std::uint64_t kRasterBytesBeside = std::uint64_t{48} << 20;
constexpr std::uint64_t kFillBytes = std::uint64_t{32} << 20;
/// Limit, in cells, for the distance of an edge that is straight in the file from the samples along
/// it: less than half, so that no sample next to a window's side moves to the other side of it.
constexpr double kMostBend = 0.125;

/// Returns the size of windows, from the vertices per sample of greedy insertion.
std::int64_t window_cells(double per_sample) {
  std::int64_t cells = kWindowCells;
  while (per_sample * static_cast<double>(cells * cells) < kVerticesPerWindow &&
         cells < kWidestCells) {
    cells *= 2;
  }
  return cells;
}

/// Returns the samples of a raster store that a region needs: those inside and the next ones
/// outside, so that every triangle of neighbouring samples that reaches inside has its corners.
/// Without a region, returns all samples; empty if the region misses the raster.
LatticeWindow lattice_of(const stream::Store& store, const std::optional<Region>& region) {
  const stream::StoreSchema& schema = store.schema();
  assert(schema.grid);
  const auto columns = static_cast<std::int64_t>(schema.columns);
  const auto rows = static_cast<std::int64_t>(schema.rows);
  if (!region) return {0, 0, columns, rows};
  const stream::Placement& placement = schema;
  stream::Box3 box;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const Point2 stored =
        stored_place(placement, {((corner & 1) != 0 ? region->box().max : region->box().min)[0],
                                 ((corner & 2) != 0 ? region->box().max : region->box().min)[1]});
    box.include(stream::Point3{stored[0], stored[1], 0.0});
  }
  const auto first = [](double low, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::floor(low) - 1.0, 0.0, static_cast<double>(count)));
  };
  const auto last = [](double high, std::int64_t count) {
    return static_cast<std::int64_t>(
        std::clamp(std::ceil(high) + 1.0, -1.0, static_cast<double>(count - 1)));
  };
  const std::int64_t c0 = first(box.min[0], columns), c1 = last(box.max[0], columns);
  const std::int64_t r0 = first(box.min[1], rows), r1 = last(box.max[1], rows);
  // If it is more than a sample outside, nothing of it is inside.
  const bool missed = box.empty() || box.max[0] < 0.0 || box.max[1] < 0.0 ||
                      box.min[0] > static_cast<double>(columns - 1) ||
                      box.min[1] > static_cast<double>(rows - 1) || c1 < c0 || r1 < r0;
  if (missed) return {};
  return {c0, r0, c1 - c0 + 1, r1 - r0 + 1};
}

std::vector<std::int64_t> cut(std::int64_t first, std::int64_t samples, std::int64_t cells) {
  const std::int64_t total = samples - 1;
  const std::int64_t parts = std::max<std::int64_t>(1, (total + cells / 2) / cells);
  std::vector<std::int64_t> sides;
  for (std::int64_t i = 0; i <= parts; ++i) sides.push_back(first + total * i / parts);
  return sides;
}

/// A rectangle of samples divided into windows that share their sides: the last column of one is
/// the first of the next.
class LatticePlan {
 public:
  /// whole: at least 1 sample along each axis. cells: the target size of a window along each axis;
  /// windows are equal to within one cell and at most 1.5 times as large.
  LatticePlan(const LatticeWindow& whole, std::int64_t cells);

  [[nodiscard]] const LatticeWindow& whole() const { return whole_; }
  [[nodiscard]] std::size_t across() const { return columns_.size() - 1; }
  [[nodiscard]] std::size_t down() const { return rows_.size() - 1; }
  [[nodiscard]] std::size_t size() const { return across() * down(); }
  /// Window i, counted along rows from the first row on.
  [[nodiscard]] LatticeWindow window(std::size_t i) const;

 private:
  LatticeWindow whole_;
  std::vector<std::int64_t> columns_, rows_;  ///< of the sides
};

LatticePlan::LatticePlan(const LatticeWindow& whole, std::int64_t cells)
    : whole_(whole),
      columns_(cut(whole.column, whole.columns, cells)),
      rows_(cut(whole.row, whole.rows, cells)) {
  assert(whole.columns > 0 && whole.rows > 0 && cells > 0);
}

LatticeWindow LatticePlan::window(std::size_t i) const {
  assert(i < size());
  const std::size_t x = i % across(), y = i / across();
  return {columns_[x], rows_[y], columns_[x + 1] - columns_[x] + 1, rows_[y + 1] - rows_[y] + 1};
}

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// Joins the meshes of a plan's windows into one mesh, in which a vertex on a side of several
/// windows is one vertex. Memory: 4 bytes per column of the raster, samples on sides next to cells
/// without data, and the spool.
class WindowJoiner {
 public:
  WindowJoiner(const LatticePlan& plan, MeshSpool& spool);

  /// Adds window i; windows come in order.
  WindowMeasures add(std::size_t i, WindowTin&& tin);

 private:
  /// Returns the number of samples on the sides and inside of this window that are on no triangle.
  /// A shared sample counts once all windows that share it have been added.
  std::uint64_t uncovered(const WindowTin& tin);
  [[nodiscard]] std::uint32_t* shared(const WindowTin& tin, const tri::GridVertex& vertex);

  const LatticePlan& plan_;
  MeshSpool& spool_;
  // Numbers of the vertices on the lines of sides above and below the current row of windows, and
  // on the left and right side of the window.
  std::vector<std::uint32_t> above_, below_, left_, right_;
  /// By row and column, the number of windows that do not cover a sample on their sides. It is
  /// uncovered if all the windows that share it do not cover it.
  std::map<std::pair<std::int64_t, std::int64_t>, unsigned> on_sides_;
};

WindowJoiner::WindowJoiner(const LatticePlan& plan, MeshSpool& spool)
    : plan_(plan),
      spool_(spool),
      above_(static_cast<std::size_t>(plan.whole().columns), kNoVertex),
      below_(above_) {}

std::uint32_t* WindowJoiner::shared(const WindowTin& tin, const tri::GridVertex& vertex) {
  // A corner belongs to two sides. The line above or below contains it in any case, the left or
  // right side only if it is in between.
  const std::int64_t column = tin.window.column - plan_.whole().column + vertex.column;
  if (vertex.row == 0) return &above_[static_cast<std::size_t>(column)];
  if (vertex.row + 1 == tin.window.rows) return &below_[static_cast<std::size_t>(column)];
  if (vertex.column == 0) return &left_[vertex.row];
  if (vertex.column + 1 == tin.window.columns) return &right_[vertex.row];
  return nullptr;
}

std::uint64_t WindowJoiner::uncovered(const WindowTin& tin) {
  std::uint64_t uncovered = 0;
  const LatticeWindow &window = tin.window, &whole = plan_.whole();
  for (const std::uint32_t at : tin.uncovered) {
    const std::int64_t column = at % window.columns, row = at / window.columns;
    const auto between = [](std::int64_t place, std::int64_t first, std::int64_t count,
                            std::int64_t whole_first, std::int64_t whole_count) {
      return (place == 0 && first > whole_first) ||
             (place + 1 == count && first + count < whole_first + whole_count);
    };
    const unsigned windows =
        (between(column, window.column, window.columns, whole.column, whole.columns) ? 2U : 1U) *
        (between(row, window.row, window.rows, whole.row, whole.rows) ? 2U : 1U);
    if (windows == 1) {
      ++uncovered;
      continue;
    }
    const auto known = on_sides_.try_emplace({window.row + row, window.column + column}, 0U).first;
    if (++known->second < windows) continue;
    ++uncovered;
    on_sides_.erase(known);
  }
  return uncovered;
}

WindowMeasures WindowJoiner::add(std::size_t i, WindowTin&& tin) {
  const WindowMeasures measures{.max_error = tin.check.max_error,
                                .rms_error = tin.check.rms_error,
                                .covered = tin.check.covered,
                                .samples = tin.samples,
                                .uncovered = uncovered(tin),
                                .work = tin.window.size(),
                                .reading_seconds = tin.reading_seconds,
                                .meshing_seconds = tin.meshing_seconds};
  const auto rows = static_cast<std::size_t>(tin.window.rows);
  if (i % plan_.across() == 0) {
    if (i > 0) above_ = std::exchange(below_, std::vector<std::uint32_t>(below_.size(), kNoVertex));
    left_.assign(rows, kNoVertex);
  } else {
    left_ = std::move(right_);
  }
  right_.assign(rows, kNoVertex);

  // Vertices that already exist make room for those after them.
  std::vector<std::uint32_t> numbers;
  numbers.reserve(tin.vertices.size());
  const auto first = static_cast<std::uint32_t>(spool_.vertices());
  std::uint32_t fresh = 0;
  for (std::size_t k = 0; k < tin.vertices.size(); ++k) {
    std::uint32_t* const at_side = shared(tin, tin.vertices[k]);
    if (at_side != nullptr && *at_side != kNoVertex) {
      numbers.push_back(*at_side);
      continue;
    }
    numbers.push_back(first + fresh);
    tin.positions[fresh++] = tin.positions[k];
    if (at_side != nullptr) *at_side = numbers.back();
  }
  for (auto& triangle : tin.triangles) {
    for (std::uint32_t& vertex : triangle) vertex = numbers[vertex];
  }
  spool_.add_vertices(std::span(tin.positions).first(fresh));
  spool_.add_triangles(tin.triangles);
  return measures;
}

}  // namespace

RasterMesher::RasterMesher(const stream::Store& store, const BoundedMeshOptions& options,
                           const Context& context)
    : BoundedMesher(store, options, context), whole_(lattice_of(store, options.region)) {
  if (whole_.columns < 2 || whole_.rows < 2) {
    if (options.region) {
      throw UsageError("`region`: it does not meet the raster of the store");
    }
    throw stream::Error({.file = store.path().string(),
                         .cause = "the raster is one line of samples, so it has no triangles",
                         .remedy = "use a profile or its points instead of a mesh"});
  }
  const bool interpolates = options.fill == Fill::interpolate;
  threads_ = threads_within_memory(
      kBytesPerThread, kRasterBytesBeside + 8 * static_cast<std::uint64_t>(whole_.columns) +
                           (interpolates ? kFillBytes : 0));
  if (interpolates) fill_ = std::make_shared<StoreFill>(store);
  if (options.places.has_effect()) most_cells_ = straight_cells();
}

std::int64_t RasterMesher::straight_cells() const {
  constexpr int kPlaces = 8;  // along each axis
  constexpr std::array<Point2, 4> kWays{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  const double half = 0.5 * static_cast<double>(std::min<std::int64_t>(
                                kWindowCells, std::max(whole_.columns, whole_.rows) - 1));
  double bend = 0.0;  // of an edge of twice `half` cells along a row or column
  for (int i = 0; i <= kPlaces; ++i) {
    for (int j = 0; j <= kPlaces; ++j) {
      const auto at = [](std::int64_t first, std::int64_t count, int step) {
        return static_cast<double>(first) + static_cast<double>((count - 1) * step) / kPlaces;
      };
      const Point2 middle{at(whole_.column, whole_.columns, i), at(whole_.row, whole_.rows, j)};
      for (const Point2& way : kWays) {
        std::array<Point2, 3> places{};
        for (std::size_t k = 0; k < 3; ++k) {
          const double step = half * (static_cast<double>(k) - 1.0);
          const stream::Point3 p =
              world_point(placement_, {middle[0] + step * way[0], middle[1] + step * way[1], 0.0});
          places[k] = {p[0], p[1]};
        }
        options_.places(std::span<Point2>(places));
        const auto& [a, m, b] = places;
        const double cells = 2.0 * half * base::hypot(way[0], way[1]);
        const double off = base::hypot(0.5 * (a[0] + b[0]) - m[0], 0.5 * (a[1] + b[1]) - m[1]);
        const double length = base::hypot(b[0] - a[0], b[1] - a[1]);
        // A sample without an image there is refused when it becomes a vertex.
        if (!std::isfinite(off) || !(length > 0.0)) continue;
        // In cells along this direction, scaled to the length along a row.
        bend = std::max(bend, off / (length / cells) / (way[0] * way[0] + way[1] * way[1]));
      }
    }
  }
  // Bends grow as the square of the length; the longest edge is the diagonal of the largest window.
  constexpr double kLongest = 1.5 * 1.4143;
  const double cells = 2.0 * half * std::sqrt(kMostBend / std::max(bend, 1e-9)) / kLongest;
  return static_cast<std::int64_t>(std::clamp(cells, 1.0, static_cast<double>(kWidestCells)));
}

double RasterMesher::estimate(double max_error) const {
  return sample(max_error, options_.quality, 4, 2).vertices_per_sample *
         static_cast<double>(whole_.size());
}

bool RasterMesher::can_estimate() const {
  return whole_.size() >= std::size_t{24} * kSampleCells * kSampleCells;
}

std::vector<std::unique_ptr<WindowMesher>> RasterMesher::meshers(double max_error) const {
  const WindowTinOptions options = window_options(max_error);
  std::vector<std::unique_ptr<WindowMesher>> result;
  for (unsigned i = 0; i < threads_; ++i) {
    result.push_back(std::make_unique<WindowMesher>(store_, options, rounding_));
  }
  return result;
}

WindowTinOptions RasterMesher::window_options(double max_error) const {
  WindowTinOptions out;
  const Aim aim = aim_within(max_error);
  out.bound = aim.bound;
  out.first_aim = aim.first;
  out.aim = aim.sure;
  out.whole = whole_;
  out.region = options_.region;
  out.places = options_.places;
  out.tin.quality = options_.quality;
  out.tin.check_stop = [this] { context_.check_stop(); };
  const GroundMap ground = Ground(placement_).map(store_.bounds());
  const bool mirrored = ground[0] * ground[4] - ground[1] * ground[3] < 0.0;
  out.tin.column_step = base::hypot(ground[0], ground[3]);
  out.tin.row_step = (mirrored ? -1.0 : 1.0) * base::hypot(ground[1], ground[4]);
  if (options_.fill == Fill::flat) {
    const double lowest = bounds_.min[2];
    out.fill = [lowest](std::int64_t, std::int64_t) { return lowest; };
  } else if (fill_) {
    out.fill = [fill = fill_](std::int64_t column, std::int64_t row) {
      return fill->height(static_cast<double>(column), static_cast<double>(row));
    };
  }
  return out;
}

RasterMesher::Sample RasterMesher::sample(double max_error, tri::TinQuality quality,
                                          std::size_t across, std::size_t down) const {
  const LatticePlan plan(whole_, kSampleCells);
  std::vector<std::size_t> windows;
  for (std::size_t y = 0; y < down; ++y) {
    for (std::size_t x = 0; x < across; ++x) {
      windows.push_back(plan.down() * (2 * y + 1) / (2 * down) * plan.across() +
                        plan.across() * (2 * x + 1) / (2 * across));
    }
  }
  std::sort(windows.begin(), windows.end());
  windows.erase(std::unique(windows.begin(), windows.end()), windows.end());
  const auto meshers = this->meshers(max_error);
  Sample sample;
  double vertices = 0.0, cells = 0.0;
  base::in_order(
      windows.size(), threads_,
      [&](unsigned worker, std::size_t i) {
        context_.check_stop();
        return meshers[worker]->count(plan.window(windows[i]), quality);
      },
      [&](std::size_t i, const WindowCount& count) {
        vertices += static_cast<double>(count.vertices);
        cells += static_cast<double>(plan.window(windows[i]).size());
        sample.reading_seconds += count.reading_seconds;
        sample.meshing_seconds += count.meshing_seconds;
      });
  sample.vertices_per_sample = vertices / cells;
  return sample;
}

BoundedMeshResult RasterMesher::run(double max_error, MeshSpool& spool,
                                    std::uint64_t most_vertices) {
  std::int64_t cells = kWindowCells;
  Sample sample;
  if (LatticePlan(whole_, cells).size() > 1) {
    sample = this->sample(max_error, tri::TinQuality::kGreedy, 2, 2);
    cells = window_cells(sample.vertices_per_sample);
  }
  const LatticePlan plan(whole_, std::min(cells, most_cells_));
  const auto meshers = this->meshers(max_error);
  WindowJoiner joiner(plan, spool);
  BoundedMeshResult result = run_windows(
      plan.size(), threads_, whole_.size(), spool, most_vertices,
      [&](unsigned worker, std::size_t i) { return meshers[worker]->mesh(plan.window(i)); },
      [&](std::size_t i, WindowTin&& tin) { return joiner.add(i, std::move(tin)); });
  result.reading_seconds += sample.reading_seconds;
  result.meshing_seconds += sample.meshing_seconds;
  return result;
}

}  // namespace terrace::terrain
