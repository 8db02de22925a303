// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/grid_tin.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "make.hpp"
#include "surface.hpp"
#include "tin/check/window.hpp"
#include "tin/error_queue.hpp"

namespace terrace::tri::tin {
namespace {

constexpr double kGreatest = 1e150;
constexpr std::uint32_t kMostSamples = 65'535;

void check_options(const GridTinOptions& options) {
  if (!(options.max_error >= 0 && options.max_error <= kGreatest))
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

/// What the range of heights says about the type to compute in.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  std::size_t data = 0;
  bool floats = true;  ///< all heights are
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
  if (range.data > 0 && std::max(-range.least, range.greatest) > kGreatest)
    throw std::invalid_argument("grid_tin: a height beyond 1e150");
  return range;
}

template <class T>
Range check_window(const GridWindow<T>& window) {
  check_shape(window, "grid_tin");
  if (window.columns > kMostSamples || window.rows > kMostSamples)
    throw std::invalid_argument("grid_tin: a window of more than 65,535 columns or rows");
  return range_of(window);
}

/// Whether floats are precise enough for most triangles; for the others errors are computed again.
bool floats_suffice(const Range& range, double bound) {
  return range.floats && std::max(-range.least, range.greatest) <= 1e30 && bound >= 1e-30 &&
         bound <= 1e30 && bound >= (range.greatest - range.least) * 0x1p-17;
}

template <class T>
void measure(const GridWindow<T>& window, bool wanted, std::size_t data, GridTin& tin) {
  if (!wanted) {
    tin.check.samples = data;
    return;
  }
  std::vector<Point3> points;
  points.reserve(tin.vertices.size());
  for (const GridVertex& vertex : tin.vertices)
    points.push_back(
        {static_cast<double>(vertex.column), static_cast<double>(vertex.row), vertex.height});
  tin.check = check_grid_tin<T>(window, points, tin.triangles);
}

template <class Real, class T>
GridTin make(const GridWindow<T>& window, const GridSides& sides, const GridTinOptions& options,
             GridPath path) {
  GridSurface<Real> surface(window, options, true, path);
  surface.insert_sides(sides);
  surface.template refine<ErrorBuckets>(std::numeric_limits<std::size_t>::max());
  if (options.quality != TinQuality::kGreedy) {
    surface.arrange();
    surface.remove();
  }
  if (options.quality == TinQuality::kFitted) {
    surface.fit();
    surface.remove();
  }
  return surface.result();
}

}  // namespace

template <class T>
GridTin make_grid_tin(const GridWindow<T>& window, const GridSides& sides,
                      const GridTinOptions& options, GridPath path) {
  const Range range = check_window(window);
  check_options(options);
  check_side(sides.first_row, window.columns, "first_row");
  check_side(sides.last_row, window.columns, "last_row");
  check_side(sides.first_column, window.rows, "first_column");
  check_side(sides.last_column, window.rows, "last_column");
  GridTin tin;
  if (window.columns > 1 && window.rows > 1 && range.data > 0)
    tin = floats_suffice(range, options.max_error) ? make<float>(window, sides, options, path)
                                                   : make<double>(window, sides, options, path);
  measure(window, options.measure, range.data, tin);
  return tin;
}

template GridTin make_grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&,
                               GridPath);
template GridTin make_grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&,
                               GridPath);

}  // namespace terrace::tri::tin

namespace terrace::tri {

template <class T>
GridTin grid_tin(const GridWindow<T>& window, const GridSides& sides,
                 const GridTinOptions& options) {
  return tin::make_grid_tin(window, sides, options, tin::best_grid_path());
}

template <class T>
GridTin grid_tin_of_points(const GridWindow<T>& window, std::size_t max_points,
                           const GridTinOptions& options) {
  const tin::Range range = tin::check_window(window);
  tin::check_options(options);
  if (max_points < 4) throw std::invalid_argument("grid_tin_of_points: max_points is less than 4");
  GridTin result;
  if (window.columns > 1 && window.rows > 1 && range.data > 0) {
    tin::GridSurface<double> surface(window, options, false, tin::best_grid_path());
    surface.refine<tin::ErrorHeap>(max_points);
    result = surface.result();
  }
  tin::measure(window, options.measure, range.data, result);
  return result;
}

template GridTin grid_tin(const GridWindow<float>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin(const GridWindow<double>&, const GridSides&, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<float>&, std::size_t, const GridTinOptions&);
template GridTin grid_tin_of_points(const GridWindow<double>&, std::size_t, const GridTinOptions&);

}  // namespace terrace::tri
