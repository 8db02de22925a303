// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/point_tin.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

py::dict measures(double max_error, double rms_error, std::size_t samples, std::size_t uncovered) {
  py::dict result;
  result["max_error"] = max_error;
  result["rms_error"] = rms_error;
  result["samples"] = samples;
  result["uncovered"] = uncovered;
  return result;
}

/// Returns (vertices, triangles, measures). max_points: 0 for no limit.
py::tuple tin_of_points(const Array<double>& x, const Array<double>& y, const Array<double>& z,
                        double max_error, std::size_t max_points, const std::string& quality,
                        const std::string& duplicates, double min_angle,
                        const Array<double>& frame) {
  tri::PointTinOptions options;
  options.max_error = max_error;
  options.max_points = max_points;
  options.min_angle_degrees = min_angle;
  options.quality = named<tri::TinQuality>(quality);
  options.duplicates = named<tri::PointDuplicates>(duplicates);
  const auto corners = rows_of<3>(frame, "frame");
  const auto xs = numbers_of(x, "x"), ys = numbers_of(y, "y"), zs = numbers_of(z, "z");
  tri::PointTin result = released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    return tri::point_tin(xs, ys, zs, corners, options);
  });
  const tri::TinErrors& errors = result.errors;
  return py::make_tuple(
      to_array(std::move(result.vertices)), to_array(std::move(result.triangles)),
      measures(errors.largest, errors.rms, errors.covered + errors.uncovered, errors.uncovered));
}

/// The same for a grid, in which NaN is not a sample. Vertices are (column, row, height).
template <class T>
py::tuple tin_of_grid(const py::array_t<T, py::array::c_style>& heights, double column_step,
                      double row_step, double max_error, std::size_t max_points,
                      const std::string& quality) {
  if (heights.ndim() != 2) throw py::value_error("a raster must have two dimensions");
  constexpr py::ssize_t kMost = 65535;
  if (heights.shape(0) > kMost || heights.shape(1) > kMost) {
    throw py::value_error("the raster has more than 65,535 rows or columns: build a store of it");
  }
  const tri::GridWindow<T> window{
      .columns = static_cast<std::uint32_t>(heights.shape(1)),
      .rows = static_cast<std::uint32_t>(heights.shape(0)),
      .heights = {heights.data(), static_cast<std::size_t>(heights.size())}};
  tri::GridTinOptions options{.max_error = max_error,
                              .quality = named<tri::TinQuality>(quality),
                              .column_step = column_step,
                              .row_step = row_step,
                              .measure = true};
  std::vector<tri::Point3> vertices;
  tri::GridTin result = released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    tri::GridTin tin = max_points > 0 ? grid_tin_of_points(window, max_points, options)
                                      : grid_tin(window, settle_sides(window, max_error), options);
    vertices.reserve(tin.vertices.size());
    for (const tri::GridVertex& v : tin.vertices) {
      vertices.push_back({static_cast<double>(v.column), static_cast<double>(v.row), v.height});
    }
    return tin;
  });
  const tri::GridTinCheck& check = result.check;
  return py::make_tuple(to_array(std::move(vertices)), to_array(std::move(result.triangles)),
                        measures(check.max_error, check.rms_error, check.samples, check.uncovered));
}

/// Returns (the sample of each vertex, the largest error).
py::tuple simplify_line(const Array<double>& t, const Array<double>& heights, double max_error) {
  const auto along = numbers_of(t, "t"), values = numbers_of(heights, "heights");
  double largest = 0;
  auto samples = released([&](const std::stop_token& stop) {
    const tri::SimplifiedLine result =
        tri::simplify_line(along, values, max_error, {}, stop_check(stop));
    largest = result.largest_error;
    std::vector<std::int64_t> kept;
    for (const tri::LineVertex& vertex : result.vertices) kept.push_back(vertex.sample);
    return kept;
  });
  return py::make_tuple(to_array(std::move(samples)), largest);
}

/// Measures columns of samples against any surface.
py::dict measure_surface(const Array<double>& x, const Array<double>& y, const Array<double>& z,
                         const Array<double>& vertices, const Array<std::uint32_t>& triangles) {
  const auto xs = numbers_of(x, "x"), ys = numbers_of(y, "y"), zs = numbers_of(z, "z");
  const auto places = rows_of<3>(vertices, "vertices");
  const auto corners = rows_of<3>(triangles, "triangles");
  const tri::TinErrors solution = released([&](const std::stop_token& stop) {
    return tri::measure_surface(xs, ys, zs, places, corners, stop_check(stop));
  });
  py::dict result = measures(solution.largest, solution.rms, solution.covered + solution.uncovered,
                             solution.uncovered);
  result["worst"] =
      solution.largest_at == tri::kNoSample ? std::int64_t{-1} : std::int64_t{solution.largest_at};
  return result;
}

}  // namespace

void bind_tin(py::module_& module) {
  module.def("tin_of_points", &tin_of_points);
  module.def("simplify_line", &simplify_line);
  module.def("measure_surface", &measure_surface);
  module.def("tin_of_grid", &tin_of_grid<float>, py::arg().noconvert(), py::arg(), py::arg(),
             py::arg(), py::arg(), py::arg());
  module.def("tin_of_grid", &tin_of_grid<double>, py::arg().noconvert(), py::arg(), py::arg(),
             py::arg(), py::arg(), py::arg());
}

}  // namespace terrace::python
