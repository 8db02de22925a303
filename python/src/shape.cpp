// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <terrace/tri/shape.hpp>

#include "delaunay.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

/// Returns (corners of the kept tetrahedra, corners of the surface's triangles, volume, whether
/// lids were left out, components, Euler characteristic).
template <class Metric>
py::tuple shape(SharedDelaunay<3, Metric>& shared, const std::string& rule,
                const std::string& criterion, double edge_factor, bool keep_vertices, bool lids,
                unsigned threads) {
  const tri::ShapeOptions options{.rule = named<tri::ShapeRule>(rule),
                                  .criterion = named<tri::ShapeCriterion>(criterion),
                                  .edge_factor = edge_factor,
                                  .keep_vertices = keep_vertices};
  std::vector<std::array<std::int32_t, 4>> kept;
  std::vector<std::array<std::int32_t, 3>> faces;
  tri::ShapeParts parts;
  bool open = false;
  const double volume = shared.read(0, [&](const auto& mesh, const std::stop_token& stop) {
    tri::Shape3<double, Metric> result(options);
    result.restore(mesh, threads, stop_check(stop));
    for (const tri::TetrahedronId t : result.kept_tetrahedra()) {
      auto& row = kept.emplace_back();
      const auto corners = mesh.vertices(t);
      for (std::size_t i = 0; i < 4; ++i) row[i] = static_cast<std::int32_t>(corners[i]);
    }
    const tri::ShapeSurface surface =
        lids ? result.surface(mesh) : result.surface_without_lids(mesh);
    for (const auto& face : surface.surface.faces) {
      auto& row = faces.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) {
        row[i] = static_cast<std::int32_t>(surface.vertices[face[i]]);
      }
    }
    open = surface.open;
    parts = result.parts(mesh, surface);
    return result.volume(mesh);
  });
  return py::make_tuple(to_array(std::move(kept)), to_array(std::move(faces)), volume, open,
                        parts.components, parts.euler_characteristic);
}

tri::Surface surface_of(const Array<double>& vertices, const Array<std::uint32_t>& triangles) {
  const auto places = rows_of<3>(vertices, "vertices");
  const auto corners = rows_of<3>(triangles, "triangles");
  return {{places.begin(), places.end()}, {corners.begin(), corners.end()}};
}

py::dict measure(const Array<double>& vertices, const Array<std::uint32_t>& triangles) {
  const tri::Surface surface = surface_of(vertices, triangles);
  const tri::SurfaceMeasures solution = released([&] { return tri::measure(surface); });
  py::dict result;
  result["faces"] = solution.faces;
  result["vertices"] = solution.vertices;
  result["edges"] = solution.edges;
  result["area"] = solution.area;
  result["volume"] = solution.volume;
  result["components"] = solution.components;
  result["euler_characteristic"] = solution.euler_characteristic;
  result["border_edges"] = solution.border_edges;
  result["non_manifold_edges"] = solution.non_manifold_edges;
  result["closed"] = solution.closed;
  return result;
}

/// Returns the triangles with components of negative volume turned inside out.
py::array turned_outward(const Array<double>& vertices, const Array<std::uint32_t>& triangles) {
  tri::Surface surface = surface_of(vertices, triangles);
  released([&] { tri::turn_outward(surface); });
  return to_array(std::move(surface.faces));
}

}  // namespace

void bind_shape(py::module_& module) {
  module.def("shape", &shape<tri::Euclidean>);
  module.def("shape", &shape<tri::EllipticalMetric3>);
  module.def("measure", &measure);
  module.def("turned_outward", &turned_outward);
}

}  // namespace terrace::python
