// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/raster_window_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/tri/point_tin.hpp>

#include "base/stopwatch.hpp"
#include "base/units.hpp"

namespace terrace::terrain {
namespace {

/// Twice the area of a triangle, positive if it is counter-clockwise.
double twice_area(std::span<const tri::Point3> points, const std::array<std::uint32_t, 3>& t) {
  const tri::Point3 &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Makes triangles counter-clockwise by swapping an edge of each that is not. Returns whether all
/// are.
bool turn_back(std::span<const tri::Point3> points,
               std::vector<std::array<std::uint32_t, 3>>& triangles) {
  constexpr int kMaxRounds = 16;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<std::uint32_t> turned;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      if (!(twice_area(points, triangles[i]) > 0.0)) turned.push_back(i);
    }
    if (turned.empty()) return true;
    // The triangle to the left of each edge.
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> left;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) left[{triangles[i][k], triangles[i][(k + 1) % 3]}] = i;
    }
    std::vector<bool> changed(triangles.size(), false);
    bool any = false;
    for (const std::uint32_t i : turned) {
      for (std::size_t k = 0; k < 3 && !changed[i]; ++k) {
        const std::uint32_t a = triangles[i][k], b = triangles[i][(k + 1) % 3];
        const auto mate = left.find({b, a});
        if (mate == left.end() || changed[mate->second]) continue;
        const std::uint32_t c = triangles[i][(k + 2) % 3];
        std::array<std::uint32_t, 3>& other = triangles[mate->second];
        const std::uint32_t d = other[0] + other[1] + other[2] - a - b;
        const std::array<std::uint32_t, 3> one{a, d, c}, two{d, b, c};
        if (!(twice_area(points, one) > 0.0 && twice_area(points, two) > 0.0)) continue;
        changed[i] = changed[mate->second] = any = true;
        triangles[i] = one;
        other = two;
      }
    }
    if (!any) return false;
  }
  return false;
}

}  // namespace

/// The mesh of one window.
struct WindowMesher::WindowTin {
  LatticeWindow window;
  std::vector<tri::GridVertex> vertices;  ///< columns and rows relative to the window
  std::vector<stream::Point3> positions;  ///< vertex positions in the CRS of the file
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Measured on the mesh as a reader decodes it; coverage is determined on the lattice.
  tri::GridTinCheck check;
  /// Number of samples with data, before filling and inside the region; those on the first row and
  /// column count in the previous window.
  std::uint64_t samples = 0;
  /// Indices in the window of samples with data that are on no triangle of it, including those on
  /// the first row and column.
  std::vector<std::uint32_t> uncovered;
  double reading_seconds = 0.0, meshing_seconds = 0.0;

  void keep_what_touches(const Region& region);
  /// Orders vertices by their first use in triangles, and drops unused ones.
  void order_by_use();
  /// Bounds the rounding of an error of 0 in these triangles: their gradients are sums of products
  /// divided by the area, multiplied by the size of the triangle's box.
  [[nodiscard]] double rounding_of_errors() const;
};

void WindowMesher::WindowTin::keep_what_touches(const Region& region) {
  std::erase_if(triangles, [&](const std::array<std::uint32_t, 3>& t) {
    return !region.touches({positions[t[0]], positions[t[1]], positions[t[2]]});
  });
}

void WindowMesher::WindowTin::order_by_use() {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> numbers(vertices.size(), kNone);
  std::vector<tri::GridVertex> ordered;
  std::vector<stream::Point3> used_positions;
  ordered.reserve(vertices.size());
  used_positions.reserve(vertices.size());
  for (auto& triangle : triangles) {
    for (std::uint32_t& vertex : triangle) {
      std::uint32_t& number = numbers[vertex];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(ordered.size());
        ordered.push_back(vertices[vertex]);
        used_positions.push_back(positions[vertex]);
      }
      vertex = number;
    }
  }
  vertices = std::move(ordered);
  positions = std::move(used_positions);
}

double WindowMesher::WindowTin::rounding_of_errors() const {
  double bound = 0.0;
  for (const auto& [i, j, k] : triangles) {
    const tri::GridVertex &a = vertices[i], &b = vertices[j], &c = vertices[k];
    const auto [left, right] = std::minmax({a.column, b.column, c.column});
    const auto [top, bottom] = std::minmax({a.row, b.row, c.row});
    const double bx = static_cast<double>(b.column) - a.column;
    const double by = static_cast<double>(b.row) - a.row;
    const double cx = static_cast<double>(c.column) - a.column;
    const double cy = static_cast<double>(c.row) - a.row;
    const double box = static_cast<double>(right - left) * static_cast<double>(bottom - top);
    const double rise = std::fabs(b.height - a.height) + std::fabs(c.height - a.height);
    bound = std::max(bound, 0x1p-48 * rise * box / std::fabs(bx * cy - by * cx));
  }
  return bound;
}

WindowMesher::WindowMesher(const stream::Store& store, WindowTinOptions options,
                           const stream::MeshRounding& rounding)
    : store_(store),
      options_(std::move(options)),
      rounding_(rounding),
      placement_(store.schema()),
      reader_(store, std::uint64_t{8} << 20) {}

bool WindowMesher::in_region(const LatticeWindow& window, std::int64_t column, std::int64_t row,
                             double height) const {
  if (!options_.region) return true;
  stream::Point3 p = world_point(placement_, {static_cast<double>(window.column + column),
                                              static_cast<double>(window.row + row), 0.0});
  p[2] = height;
  return options_.region->contains(p);
}

template <class T>
LatticeSamples<T> WindowMesher::read(const LatticeWindow& window, std::uint64_t& with_data) {
  const std::int64_t own_column = window.column == options_.lattice.column ? 0 : 1;
  const std::int64_t own_row = window.row == options_.lattice.row ? 0 : 1;
  const auto counts = [&](std::int64_t c, std::int64_t r) {
    return c >= own_column && r >= own_row && c < window.columns && r < window.rows;
  };
  return LatticeSamples<T>::read(reader_, window, [&](std::int64_t c, std::int64_t r, T& height) {
    const bool data = std::isfinite(height);
    if (data && counts(c, r) && in_region(window, c, r, static_cast<double>(height))) {
      ++with_data;
    }
    if (!data && options_.fill) {
      height = static_cast<T>(options_.fill(window.column + c, window.row + r));
    }
  });
}

std::vector<stream::Point3> WindowMesher::positions(const WindowTin& tin) const {
  std::vector<stream::Point3> positions;
  positions.reserve(tin.vertices.size());
  for (const tri::GridVertex& vertex : tin.vertices) {
    stream::Point3 p =
        world_point(placement_, {static_cast<double>(tin.window.column + vertex.column),
                                 static_cast<double>(tin.window.row + vertex.row), 0.0});
    p[2] = vertex.height;
    positions.push_back(p);
  }
  return positions;
}

void WindowMesher::measure_as_read(
    WindowTin& tin,
    const std::function<tri::GridTinCheck(std::span<const tri::Point3>, double)>& measure) const {
  const stream::Point3& moved = rounding_.largest();
  const bool exact = moved == stream::Point3{};
  const bool moves = options_.places.has_effect();  // the converted mesh is measured later
  std::vector<tri::Point3> read;
  read.reserve(tin.vertices.size());
  for (std::size_t i = 0; i < tin.vertices.size(); ++i) {
    const tri::GridVertex& vertex = tin.vertices[i];
    tri::Point3 p{static_cast<double>(vertex.column), static_cast<double>(vertex.row),
                  vertex.height};
    if (!exact && !moves) {
      const stream::Point3 decoded = rounding_(tin.positions[i]);
      const std::array<double, 2> stored = stored_place(placement_, {decoded[0], decoded[1]});
      p = {stored[0] - static_cast<double>(tin.window.column),
           stored[1] - static_cast<double>(tin.window.row), decoded[2]};
    }
    read.push_back(p);
  }
  const std::array<double, 6>& m = placement_.world.xy;
  const double cell = std::min(base::hypot(m[0], m[3]), base::hypot(m[1], m[4]));
  const double tolerance =
      moves ? 0.0 : std::min(1.0, 2.0 * base::hypot(moved[0], moved[1]) / cell);
  tin.check = measure(read, tolerance);
}

template <class T>
void WindowMesher::measure_moved(const LatticeSamples<T>& samples, WindowTin& tin) const {
  std::vector<tri::Point3> read = tin.positions;
  options_.places(std::span<stream::Point3>(read));
  for (tri::Point3& p : read) p = rounding_(p);
  if (!turn_back(read, tin.triangles)) {
    throw fault(tin, "triangles would be inverted in the other CRS")
        .remedy(stream::message("write the mesh in the store's CRS, or choose another {to_crs}"));
  }
  std::vector<stream::Point3> moved;
  moved.reserve(samples.heights.size());
  for (std::int64_t row = 0; row < samples.rows; ++row) {
    for (std::int64_t column = 0; column < samples.columns; ++column) {
      const T height = samples.heights[static_cast<std::size_t>(row * samples.columns + column)];
      if (!std::isfinite(height)) continue;
      moved.push_back(world_point(placement_, {static_cast<double>(tin.window.column + column),
                                               static_cast<double>(tin.window.row + row), 0.0}));
      moved.back()[2] = static_cast<double>(height);
    }
  }
  options_.places(std::span<stream::Point3>(moved));
  std::vector<double> x, y, z;
  for (const auto& [axis, values] : {std::pair{0, &x}, std::pair{1, &y}, std::pair{2, &z}}) {
    values->reserve(moved.size());
    for (const stream::Point3& p : moved) values->push_back(p[static_cast<std::size_t>(axis)]);
  }
  const tri::TinErrors errors = tri::measure_surface(x, y, z, read, tin.triangles);
  // A sample that is now next to the mesh was on one of its sides. The next window measures it. At
  // the border of the raster, it counts as on the side, as it is on the lattice.
  if (errors.uncovered == 0) tin.check.max_error = 0.0;
  tin.check.max_error = std::max(tin.check.max_error, errors.largest);
  if (errors.covered > 0) tin.check.rms_error = errors.rms;
}

stream::Error WindowMesher::fault(const WindowTin& tin, std::string cause) const {
  return stream::Error(store_.path().string(), std::move(cause))
      .at(fmt::format("window at column {}, row {}", tin.window.column, tin.window.row));
}

void WindowMesher::require_sound(const WindowTin& tin) const {
  const bool exact = rounding_.largest() == stream::Point3{};
  if (options_.places.has_effect() && tin.check.max_error > options_.bound &&
      !(exact && tin.check.max_error <= tin.rounding_of_errors())) {
    throw fault(tin, fmt::format("the mesh misses its bound in the other CRS: {} of {}",
                                 plain_number(tin.check.max_error), plain_number(options_.bound)))
        .remedy(
            stream::message("allow a larger {max_error}, or write the mesh in the store's CRS"));
  }
  if (tin.check.max_error > options_.bound &&
      !(exact && tin.check.max_error <= tin.rounding_of_errors())) {
    if (exact) {
      throw fault(tin, fmt::format("the mesh misses its bound: {} of {}",
                                   plain_number(tin.check.max_error), plain_number(options_.bound)))
          .remedy("this is a fault of terrace, please report it");
    }
    throw fault(
        tin,
        "the numbers of the file's format are too coarse for this bound so far from its origin")
        .remedy(stream::message("write PLY, which is exact, or a smaller {region}"));
  }
  require_no_holes(tin);
}

void WindowMesher::require_no_holes(const WindowTin& tin) const {
  const bool exact = rounding_.largest() == stream::Point3{} || options_.places.has_effect();
  if (tin.check.nodata_covered > 0 || tin.check.uncovered_inner > 0 || tin.check.inverted > 0) {
    throw fault(tin, "the mesh covers cells without data, leaves out cells with data, or folds")
        .remedy(exact ? "this is a fault of terrace, please report it"
                      : stream::message("write PLY, which is exact, or a smaller {region}"));
  }
}

template <class T>
WindowMesher::WindowTin WindowMesher::mesh_as(const LatticeWindow& window, tri::TinQuality quality,
                                              bool checked) {
  const Stopwatch reading;
  WindowTin out;
  out.window = window;
  const LatticeSamples<T> samples = read<T>(window, out.samples);
  out.reading_seconds = reading.seconds();

  const Stopwatch meshing;
  const tri::GridSides sides = samples.sides(options_.aim);
  const tri::GridWindow<T> grid = samples.grid();
  tri::GridTinOptions options = options_.tin;
  options.quality = quality;
  options.measure = false;  // the decoded mesh is checked instead
  const auto mesh_to = [&](double aim) {
    store_.check_stop();
    options.max_error = aim;
    tri::GridTin tin = tri::grid_tin<T>(grid, sides, options);
    out.vertices = std::move(tin.vertices);
    out.triangles = std::move(tin.triangles);
    if (!checked) return;
    out.positions = positions(out);
    measure_as_read(out, [&](std::span<const tri::Point3> points, double tolerance) {
      return tri::check_grid_tin<T>(grid, points, out.triangles, tolerance);
    });
    if (options_.places.has_effect()) {
      require_no_holes(out);
      measure_moved(samples, out);
    }
  };
  mesh_to(options_.first_aim);
  if (checked) {
    if (out.check.max_error > options_.bound && options_.aim < options_.first_aim) {
      mesh_to(options_.aim);
    }
    // Curved lines have no known share of the bound.
    for (const double share : {0.5, 0.25}) {
      if (!options_.places.has_effect() || !(out.check.max_error > options_.bound)) break;
      mesh_to(share * options_.aim);
    }
    require_sound(out);
    // Samples in the region are on triangles that reach into it, which are kept.
    for (const std::uint32_t at : out.check.uncovered_at) {
      if (in_region(window, at % window.columns, at / window.columns,
                    static_cast<double>(samples.heights[at]))) {
        out.uncovered.push_back(at);
      }
    }
    if (options_.region) out.keep_what_touches(*options_.region);
    out.order_by_use();
    options_.places(std::span<stream::Point3>(out.positions));
  }
  out.meshing_seconds = meshing.seconds();
  return out;
}

RasterWindow WindowMesher::mesh(const LatticePlan& plan, std::size_t i) {
  const LatticeWindow window = plan.window(i);
  RasterWindow out;
  out.measures.work = window.size();
  if (options_.region) {
    constexpr double kAnyHeight = std::numeric_limits<double>::infinity();
    const stream::Box3 box{
        {static_cast<double>(window.column), static_cast<double>(window.row), -kAnyHeight},
        {static_cast<double>(window.column + window.columns - 1),
         static_cast<double>(window.row + window.rows - 1), kAnyHeight}};
    if (options_.region->overlap(world_box(placement_, box)) == Overlap::none) return out;
  }
  const tri::TinQuality quality = options_.tin.quality;
  WindowTin tin = reader_.float_is_exact() ? mesh_as<float>(window, quality, true)
                                           : mesh_as<double>(window, quality, true);
  out.measures.max_error = tin.check.max_error;
  out.measures.rms_error = tin.check.rms_error;
  out.measures.covered = tin.check.covered;
  out.measures.samples = tin.samples;
  out.measures.reading_seconds = tin.reading_seconds;
  out.measures.meshing_seconds = tin.meshing_seconds;
  for (const std::uint32_t at : tin.uncovered) {
    const auto sample = plan.sample(i, at % window.columns, at / window.columns);
    if (sample.windows == 1) {
      ++out.measures.uncovered;
    } else {
      out.uncovered.push_back({sample.place, sample.windows});
    }
  }
  for (std::uint32_t k = 0; k < tin.vertices.size(); ++k) {
    const auto sample = plan.sample(i, tin.vertices[k].column, tin.vertices[k].row);
    if (sample.windows > 1) out.shared.push_back({k, sample.place, sample.last});
  }
  out.vertices = std::move(tin.positions);
  out.triangles = std::move(tin.triangles);
  return out;
}

WindowCount WindowMesher::count(const LatticeWindow& window, tri::TinQuality quality) {
  const WindowTin tin = reader_.float_is_exact() ? mesh_as<float>(window, quality, false)
                                                 : mesh_as<double>(window, quality, false);
  return {tin.vertices.size(), tin.reading_seconds, tin.meshing_seconds};
}

}  // namespace terrace::terrain
