// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/grid_tin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <terrace/base/simd.hpp>

#include "samples.hpp"
#include "tin/instruction_set.hpp"
#include "tin/lattice.hpp"
#include "tin/options.hpp"

namespace terrace::tri::tin {
namespace {

constexpr double kMaxHeight = 1e150;
constexpr std::uint32_t kMaxSamples = 65'535;

void check_bound(double max_error, const std::string& function) {
  if (!(max_error >= 0 && max_error <= kMaxHeight))
    throw std::invalid_argument(function + ": max_error must be in [0, 1e150]");
}

void check_options(const GridTinOptions& options) {
  check_bound(options.max_error, "grid_tin");
  for (const double step : {options.column_step, options.row_step})
    if (!(std::isfinite(step) && step != 0))
      throw std::invalid_argument("grid_tin: column_step and row_step must be finite and not 0");
}

template <class T>
void check_sides(const GridWindow<T>& window, const GridSides& sides, const std::string& function) {
  const auto check = [&](const std::vector<std::uint32_t>& side, std::uint32_t count,
                         const char* name) {
    bool ascending = !side.empty() && side.front() == 0 && side.back() == count - 1;
    for (std::size_t i = 1; i < side.size(); ++i) ascending &= side[i - 1] < side[i];
    if (!ascending)
      throw std::invalid_argument(function + ": sides." + name + " must ascend from 0 to " +
                                  std::to_string(count - 1));
  };
  check(sides.first_row, window.columns, "first_row");
  check(sides.last_row, window.columns, "last_row");
  check(sides.first_column, window.rows, "first_column");
  check(sides.last_column, window.rows, "last_column");
}

/// The range of heights, which determines the number type of the computation.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  std::size_t data = 0;
  bool floats = true;  ///< all heights are floats of moderate size
};

template <class T>
Range range_of(const GridWindow<T>& window, const std::string& function) {
  Range range;
  T least = std::numeric_limits<T>::infinity(), greatest = -least;
  for (std::size_t i = 0; i < window.heights.size(); ++i) {
    const T z = window.heights[i];
    if (!std::isfinite(z)) continue;
    ++range.data;
    least = z < least ? z : least;
    greatest = z > greatest ? z : greatest;
    if constexpr (std::is_same_v<T, double>)
      range.floats &= std::fabs(z) <= 1e30 && static_cast<double>(static_cast<float>(z)) == z;
  }
  range.least = static_cast<double>(least);
  range.greatest = static_cast<double>(greatest);
  if (range.data > 0 && std::max(-range.least, range.greatest) > kMaxHeight)
    throw std::invalid_argument(function + ": a height is beyond 1e150");
  return range;
}

template <class T>
Range check_window(const GridWindow<T>& window, const std::string& function) {
  check_shape(window, function);
  if (window.columns > kMaxSamples || window.rows > kMaxSamples)
    throw std::invalid_argument(function + ": a window of more than 65,535 columns or rows");
  return range_of(window, function);
}

/// True if floats are precise enough for most triangles. Errors of the others are recomputed.
bool floats_suffice(const Range& range, double bound) {
  return range.floats && std::max(-range.least, range.greatest) <= 1e30 && bound >= 1e-30 &&
         bound <= 1e30 && bound >= (range.greatest - range.least) * 0x1p-17;
}

template <class T>
void measure(const GridWindow<T>& window, const GridTinOptions& options, std::size_t data,
             GridTin& tin) {
  if (!options.measure) {
    tin.check.samples = data;
    return;
  }
  std::vector<Point3> points;
  points.reserve(tin.vertices.size());
  for (const GridVertex& vertex : tin.vertices)
    points.push_back(
        {static_cast<double>(vertex.column), static_cast<double>(vertex.row), vertex.height});
  tin.check = check_grid_tin<T>(window, points, tin.triangles, 0, options.check_stop);
}

/// The vertices on the sides of the window, its corners first.
template <class T>
std::vector<GridCorner<T>> frame_of(RasterSamples<T>& samples, const GridSides& sides) {
  const std::int32_t right = samples.columns() - 1, last = samples.rows() - 1;
  std::vector<GridCorner<T>> frame{samples.take(place_at(0, 0)), samples.take(place_at(right, 0)),
                                   samples.take(place_at(right, last)),
                                   samples.take(place_at(0, last))};
  const auto add_side = [&](const std::vector<std::uint32_t>& side, const auto& place_of) {
    for (std::size_t i = 1; i + 1 < side.size(); ++i)
      frame.push_back(samples.take(place_of(static_cast<std::int32_t>(side[i]))));
  };
  add_side(sides.first_row, [&](std::int32_t x) { return place_at(x, 0); });
  add_side(sides.last_column, [&](std::int32_t y) { return place_at(right, y); });
  add_side(sides.last_row, [&](std::int32_t x) { return place_at(x, last); });
  add_side(sides.first_column, [&](std::int32_t y) { return place_at(0, y); });
  return frame;
}

/// Makes triangles counter-clockwise on the ground.
template <class T>
GridTin result_of(const Refinement<RasterSamples<T>>& refinement, const GridTinOptions& options) {
  GridTin tin;
  refinement.publish(tin);
  if ((options.column_step < 0) != (options.row_step < 0))
    for (auto& triangle : tin.triangles) std::swap(triangle[1], triangle[2]);
  return tin;
}

/// The mesh of the vertices on the sides. S: RasterSamples or CanonicalSamples.
template <class S, class T>
Refinement<S> start(const GridWindow<T>& window, const GridSides& sides,
                    const GridTinOptions& options, base::SimdPath set) {
  S samples(window, options, true, set);
  samples.judge_coarsely_first();
  std::vector<typename S::Vertex> frame = frame_of(samples, sides);
  return start_in_rectangle(std::move(samples), std::move(frame), options.check_stop);
}

template <class Real, class T>
GridTin make(const GridWindow<T>& window, const GridSides& sides, const GridTinOptions& options,
             base::SimdPath set) {
  auto refinement = start<RasterSamples<Real>>(window, sides, options, set);
  refine_to_bound(refinement, options.quality, 0);
  return result_of(refinement, options);
}

template <class Real, class T>
std::vector<std::uint32_t> select(const GridWindow<T>& window, const GridSides& sides,
                                  const GridTinOptions& options, base::SimdPath set) {
  auto refinement = start<CanonicalSamples<Real>>(window, sides, options, set);
  refine_to_bound(refinement, TinQuality::greedy, 0);
  refinement.remove(std::numeric_limits<std::size_t>::max());
  const auto& [vertices, triangles] = refinement.mesh();
  const std::vector<std::uint32_t> triangle_of = triangle_of_vertices(triangles, vertices.size());
  std::vector<std::uint32_t> selected;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (triangle_of[v] != kNone)
      selected.push_back(static_cast<std::uint32_t>(vertices[v].y) * window.columns +
                         static_cast<std::uint32_t>(vertices[v].x));
  std::sort(selected.begin(), selected.end());
  return selected;
}

/// Numbers of the samples on the sides, row by row, ascending.
template <class T>
std::vector<std::uint32_t> samples_on(const GridWindow<T>& window, const GridSides& sides) {
  std::vector<std::uint32_t> numbers;
  const auto add = [&](std::uint32_t column, std::uint32_t row) {
    numbers.push_back(row * window.columns + column);
  };
  for (const std::uint32_t x : sides.first_row) add(x, 0);
  for (const std::uint32_t x : sides.last_row) add(x, window.rows - 1);
  for (const std::uint32_t y : sides.first_column) add(0, y);
  for (const std::uint32_t y : sides.last_column) add(window.columns - 1, y);
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

}  // namespace

template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, base::SimdPath set) {
  const Range range = check_window(window, "grid_tin");
  check_options(options);
  check_sides(window, sides, "grid_tin");
  GridTin tin;
  if (window.columns > 1 && window.rows > 1 && range.data > 0)
    tin = floats_suffice(range, options.max_error) ? make<float>(window, sides, options, set)
                                                   : make<double>(window, sides, options, set);
  measure(window, options, range.data, tin);
  return tin;
}

template <class T>
std::vector<std::uint32_t> select_samples_with(const GridWindow<T>& window, const GridSides& sides,
                                               double max_error, base::SimdPath set,
                                               const base::StopCheck& check_stop) {
  const Range range = check_window(window, "select_samples");
  check_bound(max_error, "select_samples");
  check_sides(window, sides, "select_samples");
  if (window.columns < 2 || window.rows < 2 || range.data == 0) return samples_on(window, sides);
  GridTinOptions options;
  options.max_error = max_error;
  options.check_stop = check_stop;
  if constexpr (std::is_same_v<T, float>) {
    if (floats_suffice(range, max_error)) return select<float>(window, sides, options, set);
  }
  return select<double>(window, sides, options, set);
}

template GridTin make_grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&,
                               base::SimdPath);
template GridTin make_grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&,
                               base::SimdPath);
template std::vector<std::uint32_t> select_samples_with(const GridWindow<float>&, const GridSides&,
                                                        double, base::SimdPath,
                                                        const base::StopCheck&);
template std::vector<std::uint32_t> select_samples_with(const GridWindow<double>&, const GridSides&,
                                                        double, base::SimdPath,
                                                        const base::StopCheck&);

}  // namespace terrace::tri::tin

namespace terrace::tri {

template <class T>
GridTin grid_tin(const GridWindow<T>& window, const GridSides& sides,
                 const GridTinOptions& options) {
  return tin::make_grid_tin(window, sides, options, base::best_simd_path());
}

template <class T>
GridTin grid_tin_of_points(const GridWindow<T>& window, std::size_t max_points,
                           const GridTinOptions& options) {
  const tin::Range range = tin::check_window(window, "grid_tin");
  tin::check_options(options);
  if (max_points < 4) throw std::invalid_argument("grid_tin_of_points: max_points is less than 4");
  GridTin result;
  if (window.columns > 1 && window.rows > 1 && range.data > 0) {
    tin::RasterSamples<double> samples(window, options, false, base::best_simd_path());
    auto frame = tin::frame_of(samples, {});
    tin::Refinement refinement =
        tin::start_in_rectangle(std::move(samples), std::move(frame), options.check_stop);
    tin::ErrorHeap queue;
    refinement.judge_all(queue);
    refinement.refine(queue, {.vertices = max_points});
    result = tin::result_of(refinement, options);
  }
  tin::measure(window, options, range.data, result);
  return result;
}

template <class T>
std::vector<std::uint32_t> select_samples(const GridWindow<T>& window, const GridSides& sides,
                                          double max_error, const base::StopCheck& check_stop) {
  return tin::select_samples_with(window, sides, max_error, base::best_simd_path(), check_stop);
}

template GridTin grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<float>&, std::size_t, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<double>&, std::size_t, const GridTinOptions&);
template std::vector<std::uint32_t> select_samples(const GridWindow<float>&, const GridSides&,
                                                   double, const base::StopCheck&);
template std::vector<std::uint32_t> select_samples(const GridWindow<double>&, const GridSides&,
                                                   double, const base::StopCheck&);

}  // namespace terrace::tri
