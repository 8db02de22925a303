// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/quality.hpp>
#include <terrace/tri/smoothing.hpp>

#include "delaunay.hpp"

/// What is computed from heights of a triangulation's vertices, which are given by number of
/// vertex.

namespace terrace::python {
namespace {

py::array heights(SharedDelaunay2& shared, const Array<double>& given, const Array<double>& places,
                  const std::string& method, unsigned threads) {
  using tri::Interpolation;
  const auto how = named<Interpolation>(method, "method",
                                        {{"linear", Interpolation::kLinear},
                                         {"natural", Interpolation::kNaturalNeighbour},
                                         {"nearest", Interpolation::kNearest}});
  const auto values = numbers_of(given, "heights");
  const auto asked = rows_of<2>(places, "places");
  return to_array(shared.read(asked.size(), [&](const auto& mesh) {
    return heights_at(mesh, values, asked, how, threads);
  }));
}

py::array gradients(SharedDelaunay2& shared, const Array<double>& given,
                    const Array<double>& places, const std::string& method, unsigned threads) {
  using tri::GradientFrom;
  const auto how = named<GradientFrom>(
      method, "method",
      {{"linear", GradientFrom::kTriangles}, {"natural", GradientFrom::kNaturalNeighbours}});
  const auto values = numbers_of(given, "heights");
  const auto asked = rows_of<2>(places, "places");
  return to_array(shared.read(asked.size(), [&](const auto& mesh) {
    std::vector<std::array<double, 2>> rows;
    rows.reserve(asked.size());
    for (const tri::Gradient& g : gradients_at(mesh, values, asked, how, threads)) {
      rows.push_back({g.x, g.y});
    }
    return rows;
  }));
}

/// All heights, those that have moved and the others. vertices: those that may move, or None.
py::array smooth(SharedDelaunay2& shared, const Array<double>& given,
                 const std::optional<Array<std::int32_t>>& vertices, const std::string& method,
                 unsigned iterations, double strength, double pass_band, double edge_height) {
  using tri::Smoothing;
  const tri::SmoothingOptions options{
      .method = named<Smoothing>(method, "method",
                                 {{"laplacian", Smoothing::kLaplacian},
                                  {"taubin", Smoothing::kTaubin},
                                  {"bilateral", Smoothing::kBilateral}}),
      .iterations = iterations,
      .strength = strength,
      .pass_band = pass_band,
      .edge_height = edge_height};
  const auto values = numbers_of(given, "heights");
  std::span<const std::int32_t> only;
  if (vertices) only = numbers_of(*vertices, "vertices");
  return to_array(shared.read(values.size() * iterations, [&](const auto& mesh) {
    std::vector<tri::VertexId> region;
    if (!vertices) {
      for (const tri::VertexId vertex : mesh.all_vertices()) region.push_back(vertex);
    } else {
      region = shared.checked(only);
    }
    std::vector<double> result(values.begin(), values.end());
    for (const auto& [vertex, height] : smooth(mesh, values, region, options)) {
      result[slot(vertex)] = height;
    }
    return result;
  }));
}

py::dict quality(SharedDelaunay2& shared, const Array<double>& given, double datum) {
  const auto values = numbers_of(given, "heights");
  const tri::MeshQuality made =
      shared.read(0, [&](const auto& mesh) { return mesh_quality(mesh, values, datum); });
  py::dict result;
  result["triangles"] = made.triangles;
  result["min_angle"] = made.min_angle_degrees;
  result["mean_min_angle"] = made.mean_min_angle_degrees;
  result["max_aspect"] = made.max_aspect;
  result["mean_aspect"] = made.mean_aspect;
  result["edges"] = made.edges;
  result["min_edge"] = made.min_edge;
  result["max_edge"] = made.max_edge;
  result["mean_edge"] = made.mean_edge;
  result["area"] = made.area;
  result["surface_area"] = made.surface_area;
  result["volume_above"] = made.volume_above;
  result["volume_below"] = made.volume_below;
  return result;
}

}  // namespace

void bind_samples(py::module_& module) {
  module.def("heights_at", &heights);
  module.def("gradients_at", &gradients);
  module.def("smooth", &smooth);
  module.def("mesh_quality", &quality);
}

}  // namespace terrace::python
