// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/crs.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

using Shift = std::optional<terrain::DatumShift>;

/// shift: for the system whose datum is not WGS 84, or for `to` if neither is.
/// box: the extent of the data in `from`.
terrain::Transformation transformation(const std::string& from, const std::string& to,
                                       const Shift& shift, const py::object& box) {
  auto own = terrain::CoordinateSystem::parse(from);
  const auto other = terrain::CoordinateSystem::parse(to, shift);
  if (shift && other.counts_as_wgs84()) own = terrain::CoordinateSystem::parse(from, shift);
  if (const auto area = region_of(box)) own = own.over(area->box());
  return {own, other};
}

/// Returns a region of another CRS as polygons in the store's CRS, and the name of the latter.
std::pair<std::vector<terrain::Polygon>, std::string> own_region(const OpenStore& open,
                                                                 const py::object& region,
                                                                 const std::string& crs) {
  const stream::Store store = open.get();
  const auto input = region_of(region);
  const terrain::Region result =
      released([&]() -> std::optional<terrain::Region> {
        return terrain::RegionConversion(store,
                                         terrain::transformation_to(store, crs))(input.value());
      }).value();
  const stream::Box3& box = result.box();
  std::vector<terrain::Polygon> polygons = result.polygons();
  if (polygons.empty()) {
    polygons = {{{{box.min[0], box.min[1]},
                  {box.max[0], box.min[1]},
                  {box.max[0], box.max[1]},
                  {box.min[0], box.max[1]}}}};
  }
  const stream::Crs& own = store.schema().crs;
  return {std::move(polygons), own.epsg != 0 ? "EPSG:" + std::to_string(own.epsg) : own.wkt};
}

}  // namespace

void bind_crs(py::module_& module) {
  using terrain::Transformation;
  py::class_<Transformation>(module, "Transformation")
      .def(py::init(&transformation))
      .def("convert",
           [](const Transformation& change, const Array<double>& array, bool back) {
             const auto places = rows_of<2>(array, "places");
             return to_array(released([&] {
               std::vector<terrain::Point2> result(places.begin(), places.end());
               back ? change.reverse(result) : change.forward(result);
               return result;
             }));
           })
      .def("note", &Transformation::note)
      .def("from_title", [](const Transformation& change) { return change.from().title(); })
      .def("to_title", [](const Transformation& change) { return change.to().title(); });
  module.def("own_region", &own_region);
}

}  // namespace terrace::python
