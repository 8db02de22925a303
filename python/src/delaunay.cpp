// SPDX-License-Identifier: Apache-2.0
#include "delaunay.hpp"

#include <optional>
#include <tuple>

#include <pybind11/stl.h>

namespace terrace::python {
namespace {

/// Binds the methods that triangulations and surfaces share.
template <class Shared>
auto bind_mesh_of_points(py::module_& module, const char* name) {
  return py::class_<Shared>(module, name)
      .def("insert", &Shared::insert)
      .def("remove", &Shared::remove)
      .def("points", &Shared::points)
      .def("vertices", &Shared::vertices)
      .def("simplices", &Shared::simplices)
      .def("size", &Shared::size)
      .def("count", &Shared::count)
      .def("hash", &Shared::hash)
      .def("start_journal", &Shared::start_journal)
      .def("take_changes", &Shared::take_changes);
}

template <std::size_t N, class Metric>
auto bind_triangulation(py::module_& module, const char* name) {
  using Shared = SharedDelaunay<N, Metric>;
  return bind_mesh_of_points<Shared>(module, name)
      .def("neighbours", &Shared::neighbours)
      .def("adjacent", &Shared::adjacent)
      .def("find_simplex", &Shared::find_simplex)
      .def("nearest", &Shared::nearest);
}

/// Boxes (lower corner, upper corner) and the map in each.
template <std::size_t N>
using MetricRegions =
    std::vector<std::tuple<std::array<double, N>, std::array<double, N>, tri::LinearMap<N>>>;

template <std::size_t N>
tri::MetricField<N> field_of(const MetricRegions<N>& input) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<typename tri::MetricField<N>::Region> regions;
  for (const auto& [lower, upper, map] : input) {
    auto& region = regions.emplace_back();
    region.box.min.fill(-kInfinity);
    region.box.max.fill(kInfinity);
    std::copy(lower.begin(), lower.end(), region.box.min.begin());
    std::copy(upper.begin(), upper.end(), region.box.max.begin());
    region.map = map;
  }
  return tri::MetricField<N>(std::move(regions));
}

template <class Id, std::size_t N>
std::vector<std::array<std::int32_t, N>> numbers_of_corners(
    const std::vector<std::array<Id, N>>& simplices) {
  std::vector<std::array<std::int32_t, N>> rows(simplices.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < N; ++k) {
      rows[i][k] = static_cast<std::int32_t>(simplices[i][k]);
    }
  }
  return rows;
}

/// Returns the triangles adapted to a metric for each region.
py::array adapted2(SharedDelaunay2& shared, const MetricRegions<2>& regions) {
  const tri::MetricField2 field = field_of<2>(regions);
  return to_array(shared.read(0, [&](const auto& mesh, const std::stop_token& stop) {
    return numbers_of_corners(
        metric_triangles(mesh, field, tri::TriangleFilter(), stop_check(stop)));
  }));
}

/// Returns (tetrahedra, the number of facets that cannot be flipped).
py::tuple adapted3(SharedDelaunay3& shared, const MetricRegions<3>& regions) {
  const tri::MetricField3 field = field_of<3>(regions);
  const tri::MetricTetrahedra result =
      shared.read(0, [&](const auto& mesh, const std::stop_token& stop) {
        return metric_tetrahedra(mesh, field, stop_check(stop));
      });
  return py::make_tuple(to_array(numbers_of_corners(result.tetrahedra)), result.stuck);
}

}  // namespace

void bind_delaunay(py::module_& module) {
  bind_triangulation<2, tri::Euclidean>(module, "SharedDelaunay2")
      .def(py::init<>())
      .def("adapted", &adapted2)
      .def("build_grid", [](SharedDelaunay2& shared, double x0, double y0, double step,
                            std::uint32_t columns, std::uint32_t rows) {
        const tri::VertexId first =
            shared.change(std::size_t{columns} * rows, [&](tri::Delaunay2<double>& mesh) {
              return mesh.build_grid(x0, y0, step, columns, rows);
            });
        return slot(first);
      });
  bind_triangulation<3, tri::Euclidean>(module, "SharedDelaunay3")
      .def(py::init<>())
      .def("adapted", &adapted3);
  bind_triangulation<2, tri::EllipticalMetric2>(module, "EllipticalDelaunay2")
      .def(py::init([](const tri::LinearMap2& map) {
        return std::make_unique<SharedDelaunay<2, tri::EllipticalMetric2>>(map);
      }));
  bind_triangulation<3, tri::EllipticalMetric3>(module, "EllipticalDelaunay3")
      .def(py::init([](const tri::LinearMap3& map) {
        return std::make_unique<SharedDelaunay<3, tri::EllipticalMetric3>>(map);
      }));
  bind_mesh_of_points<SharedSurface>(module, "SharedSurface")
      .def(py::init<>())
      .def("restore", [](SharedSurface& shared, unsigned threads) {
        shared.change(0, [&](auto& surface) {
          surface.restore(threads);
          return 0;
        });
      });
  module.def("ellipse_map", py::overload_cast<double, double, double>(&tri::ellipse_map));
  module.def("ellipsoid_map", &tri::ellipsoid_map);
}

}  // namespace terrace::python
