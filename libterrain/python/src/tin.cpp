// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/point_tin.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

tri::TinQuality quality_named(const std::string& name) {
  using tri::TinQuality;
  return named<TinQuality>(name, "quality",
                           {{"greedy", TinQuality::kGreedy},
                            {"removal", TinQuality::kRemoval},
                            {"fitted", TinQuality::kFitted}});
}

py::dict measures(double max_error, double rms_error, std::size_t samples, std::size_t uncovered) {
  py::dict result;
  result["max_error"] = max_error;
  result["rms_error"] = rms_error;
  result["samples"] = samples;
  result["uncovered"] = uncovered;
  return result;
}

/// (vertices, triangles, measures). max_points 0: no limit.
py::tuple tin_of_points(const Array<double>& x, const Array<double>& y, const Array<double>& z,
                        double max_error, std::size_t max_points, const std::string& quality,
                        const std::string& duplicates) {
  using tri::PointDuplicates;
  tri::PointTinOptions options;
  options.max_error = max_error;
  options.max_points = max_points;
  options.quality = quality_named(quality);
  options.duplicates = named<PointDuplicates>(duplicates, "duplicates",
                                              {{"all", PointDuplicates::kAll},
                                               {"min", PointDuplicates::kMin},
                                               {"max", PointDuplicates::kMax},
                                               {"mean", PointDuplicates::kMean},
                                               {"first", PointDuplicates::kFirst},
                                               {"error", PointDuplicates::kError}});
  const auto xs = numbers_of(x, "x"), ys = numbers_of(y, "y"), zs = numbers_of(z, "z");
  tri::PointTin made = released([&] { return tri::point_tin(xs, ys, zs, {}, options); });
  const tri::TinErrors& errors = made.errors;
  return py::make_tuple(
      to_array(std::move(made.vertices)), to_array(std::move(made.triangles)),
      measures(errors.largest, errors.rms, errors.covered + errors.uncovered, errors.uncovered));
}

/// The same of rows and columns, NaN: no sample. Vertices are column, row, height.
template <class T>
py::tuple tin_of_grid(const py::array_t<T, py::array::c_style>& heights, double column_step,
                      double row_step, double max_error, std::size_t max_points,
                      const std::string& quality) {
  if (heights.ndim() != 2) throw py::value_error("a raster has two dimensions");
  constexpr py::ssize_t kMost = 65535;
  if (heights.shape(0) > kMost || heights.shape(1) > kMost) {
    throw py::value_error("the raster has more than 65,535 rows or columns: build a store of it");
  }
  const tri::GridWindow<T> window{
      .columns = static_cast<std::uint32_t>(heights.shape(1)),
      .rows = static_cast<std::uint32_t>(heights.shape(0)),
      .heights = {heights.data(), static_cast<std::size_t>(heights.size())}};
  const tri::GridTinOptions options{.max_error = max_error,
                                    .quality = quality_named(quality),
                                    .column_step = column_step,
                                    .row_step = row_step,
                                    .measure = true};
  std::vector<tri::Point3> vertices;
  tri::GridTin made = released([&] {
    tri::GridTin tin = max_points > 0 ? grid_tin_of_points(window, max_points, options)
                                      : grid_tin(window, settle_sides(window, max_error), options);
    vertices.reserve(tin.vertices.size());
    for (const tri::GridVertex& v : tin.vertices) {
      vertices.push_back({static_cast<double>(v.column), static_cast<double>(v.row), v.height});
    }
    return tin;
  });
  const tri::GridTinCheck& check = made.check;
  return py::make_tuple(to_array(std::move(vertices)), to_array(std::move(made.triangles)),
                        measures(check.max_error, check.rms_error, check.samples, check.uncovered));
}

}  // namespace

void bind_tin(py::module_& module) {
  module.def("tin_of_points", &tin_of_points);
  module.def("tin_of_grid", &tin_of_grid<float>, py::arg().noconvert(), py::arg(), py::arg(),
             py::arg(), py::arg(), py::arg());
  module.def("tin_of_grid", &tin_of_grid<double>, py::arg().noconvert(), py::arg(), py::arg(),
             py::arg(), py::arg(), py::arg());
}

}  // namespace terrace::python
