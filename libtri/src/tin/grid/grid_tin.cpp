// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/grid_tin.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
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

void check_options(const GridTinOptions& options) {
  if (!(options.max_error >= 0 && options.max_error <= kMaxHeight))
    throw std::invalid_argument("grid_tin: max_error must be in [0, 1e150]");
  for (const double step : {options.column_step, options.row_step})
    if (!(std::isfinite(step) && step != 0))
      throw std::invalid_argument("grid_tin: column_step and row_step must be finite and not 0");
}

void check_side(const std::vector<std::uint32_t>& side, std::uint32_t count, const char* name) {
  bool ascending = !side.empty() && side.front() == 0 && side.back() == count - 1;
  for (std::size_t i = 1; i < side.size(); ++i) ascending &= side[i - 1] < side[i];
  if (!ascending)
    throw std::invalid_argument(std::string("grid_tin: sides.") + name + " must ascend from 0 to " +
                                std::to_string(count - 1));
}

/// The range of heights, which determines the number type of the computation.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  std::size_t data = 0;
  bool floats = true;  ///< all heights are floats of moderate size
};

template <class T>
Range range_of(const GridWindow<T>& window) {
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
    throw std::invalid_argument("grid_tin: a height is beyond 1e150");
  return range;
}

template <class T>
Range check_window(const GridWindow<T>& window) {
  check_shape(window, "grid_tin");
  if (window.columns > kMaxSamples || window.rows > kMaxSamples)
    throw std::invalid_argument("grid_tin: a window of more than 65,535 columns or rows");
  return range_of(window);
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

template <class Real, class T>
GridTin make(const GridWindow<T>& window, const GridSides& sides, const GridTinOptions& options,
             base::SimdPath set) {
  RasterSamples<Real> samples(window, options, true, set);
  samples.judge_coarsely_first();
  std::vector<GridCorner<Real>> frame = frame_of(samples, sides);
  Refinement refinement =
      start_in_rectangle(std::move(samples), std::move(frame), options.check_stop);
  refine_to_bound(refinement, options.quality, 0);
  return result_of(refinement, options);
}

}  // namespace

template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, base::SimdPath set) {
  const Range range = check_window(window);
  check_options(options);
  check_side(sides.first_row, window.columns, "first_row");
  check_side(sides.last_row, window.columns, "last_row");
  check_side(sides.first_column, window.rows, "first_column");
  check_side(sides.last_column, window.rows, "last_column");
  GridTin tin;
  if (window.columns > 1 && window.rows > 1 && range.data > 0)
    tin = floats_suffice(range, options.max_error) ? make<float>(window, sides, options, set)
                                                   : make<double>(window, sides, options, set);
  measure(window, options, range.data, tin);
  return tin;
}

template GridTin make_grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&,
                               base::SimdPath);
template GridTin make_grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&,
                               base::SimdPath);

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
  const tin::Range range = tin::check_window(window);
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

template GridTin grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<float>&, std::size_t, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<double>&, std::size_t, const GridTinOptions&);

}  // namespace terrace::tri
