// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/quality.hpp>
#include <terrace/tri/smoothing.hpp>

#include "delaunay.hpp"
#include "names.hpp"

/// Functions of a triangulation and the heights of its vertices, given by slot.

namespace terrace::python {
namespace {

/// Returns the heights of vertices. Throws: ValueError unless there is one for each slot.
template <class Mesh>
std::span<const double> heights_of(std::span<const double> values, const Mesh& mesh) {
  if (values.size() >= mesh.vertex_slots()) return values;
  throw py::value_error("there are " + std::to_string(values.size()) + " `values` for " +
                        std::to_string(mesh.vertex_slots()) +
                        " vertex numbers; use by_vertex() to order them");
}

py::array heights(SharedDelaunay2& shared, const Array<double>& input, const Array<double>& places,
                  const std::string& method, unsigned threads) {
  const tri::Interpolation interpolation = named<tri::Interpolation>(method);
  const auto values = numbers_of(input, "values");
  const auto queries = rows_of<2>(places, "places");
  return to_array(shared.read(queries.size(), [&](const auto& mesh) {
    return heights_at(mesh, heights_of(values, mesh), queries, interpolation, threads);
  }));
}

/// Returns compressed rows, one per place: weights, vertices, the offset of each row.
py::tuple weights(SharedDelaunay2& shared, const Array<double>& places, const std::string& method) {
  const tri::Interpolation interpolation = named<tri::Interpolation>(method);
  const auto queries = rows_of<2>(places, "places");
  std::vector<double> shares;
  std::vector<std::int32_t> vertices;
  auto begins = shared.read(queries.size(), [&](const auto& mesh) {
    // All weights in the order of the walk, and the offset of each place's weights.
    std::vector<tri::VertexWeight> all, found;
    std::vector<std::size_t> first(queries.size());
    std::vector<std::int64_t> rows(queries.size() + 1, 0);
    tri::VertexId near = tri::kNoVertex;
    for (const std::size_t i : near_order(queries)) {
      if (!finite(queries[i])) {
        throw std::invalid_argument("place " + std::to_string(i) + " is not finite");
      }
      weights_at(mesh, queries[i], interpolation, found, near);
      if (!found.empty()) near = found.front().vertex;
      first[i] = all.size();
      rows[i + 1] = static_cast<std::int64_t>(found.size());
      all.insert(all.end(), found.begin(), found.end());
    }
    shares.reserve(all.size());
    vertices.reserve(all.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
      for (std::size_t k = first[i]; k < first[i] + static_cast<std::size_t>(rows[i + 1]); ++k) {
        shares.push_back(all[k].weight);
        vertices.push_back(static_cast<std::int32_t>(all[k].vertex));
      }
      rows[i + 1] += rows[i];
    }
    return rows;
  });
  return py::make_tuple(to_array(std::move(shares)), to_array(std::move(vertices)),
                        to_array(std::move(begins)));
}

/// Returns rows of min angle, aspect, area, surface area, volume above, volume below.
py::array triangle_quality(SharedDelaunay2& shared, const Array<double>& input, double datum) {
  const auto values = numbers_of(input, "values");
  return to_array(shared.read(0, [&](const auto& mesh) {
    (void)heights_of(values, mesh);
    std::vector<std::array<double, 6>> rows;
    for (const tri::TriangleId t : mesh.all_triangles()) {
      const tri::TriangleQuality of = tri::triangle_quality(mesh, values, t, datum);
      rows.push_back({of.min_angle_degrees, of.aspect, of.area, of.surface_area, of.volume_above,
                      of.volume_below});
    }
    return rows;
  }));
}

py::dict distances(SharedDelaunay2& shared, const Array<double>& array, const Array<double>& points,
                   const std::string& method, unsigned threads) {
  const tri::Interpolation interpolation = named<tri::Interpolation>(method);
  const auto values = numbers_of(array, "values");
  const auto samples = rows_of<3>(points, "samples");
  const tri::VerticalDistances solution = shared.read(samples.size(), [&](const auto& mesh) {
    return vertical_distances(mesh, heights_of(values, mesh), samples, interpolation, threads);
  });
  py::dict result;
  result["count"] = solution.count;
  result["outside"] = solution.outside;
  result["max"] = solution.max;
  result["mean"] = solution.mean;
  result["rms"] = solution.rms;
  result["bias"] = solution.bias;
  result["worst"] = solution.count > 0 ? static_cast<std::int64_t>(solution.worst) : -1;
  return result;
}

py::array gradients(SharedDelaunay2& shared, const Array<double>& input,
                    const Array<double>& places, const std::string& method, unsigned threads) {
  const auto source = named<tri::GradientFrom>(method);
  const auto values = numbers_of(input, "values");
  const auto queries = rows_of<2>(places, "places");
  return to_array(shared.read(queries.size(), [&](const auto& mesh) {
    std::vector<std::array<double, 2>> rows;
    rows.reserve(queries.size());
    for (const tri::Gradient& g :
         gradients_at(mesh, heights_of(values, mesh), queries, source, threads)) {
      rows.push_back({g.x, g.y});
    }
    return rows;
  }));
}

/// Returns all heights after smoothing. vertices: those that may move, or None for all.
py::array smooth(SharedDelaunay2& shared, const Array<double>& input,
                 const std::optional<Array<std::int32_t>>& vertices, const std::string& method,
                 unsigned iterations, double strength, double pass_band, double edge_height) {
  tri::SmoothingOptions options{.method = named<tri::Smoothing>(method),
                                .iterations = iterations,
                                .strength = strength,
                                .pass_band = pass_band,
                                .edge_height = edge_height};
  const auto values = numbers_of(input, "values");
  std::span<const std::int32_t> only;
  if (vertices) only = numbers_of(*vertices, "vertices");
  return to_array(shared.read(values.size() * iterations, [&](const auto& mesh,
                                                              const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    std::vector<tri::VertexId> region;
    if (!vertices) {
      for (const tri::VertexId vertex : mesh.all_vertices()) region.push_back(vertex);
    } else {
      region = shared.checked(only);
    }
    std::vector<double> result(values.begin(), values.end());
    for (const auto& [vertex, height] : smooth(mesh, heights_of(values, mesh), region, options)) {
      result[slot(vertex)] = height;
    }
    return result;
  }));
}

py::dict quality(SharedDelaunay2& shared, const Array<double>& array, double datum,
                 std::size_t bins) {
  const auto values = numbers_of(array, "values");
  const tri::MeshQuality solution = shared.read(0, [&](const auto& mesh) {
    return mesh_quality(mesh, heights_of(values, mesh), datum, bins);
  });
  py::dict result;
  result["triangles"] = solution.triangles;
  result["min_angle"] = solution.min_angle_degrees;
  result["mean_min_angle"] = solution.mean_min_angle_degrees;
  result["max_aspect"] = solution.max_aspect;
  result["mean_aspect"] = solution.mean_aspect;
  result["edges"] = solution.edges;
  result["min_edge"] = solution.min_edge;
  result["max_edge"] = solution.max_edge;
  result["mean_edge"] = solution.mean_edge;
  result["edge_histogram"] = to_array(
      std::vector<std::int64_t>(solution.edge_histogram.begin(), solution.edge_histogram.end()));
  result["area"] = solution.area;
  result["surface_area"] = solution.surface_area;
  result["volume_above"] = solution.volume_above;
  result["volume_below"] = solution.volume_below;
  return result;
}

}  // namespace

void bind_samples(py::module_& module) {
  module.def("heights_at", &heights);
  module.def("gradients_at", &gradients);
  module.def("smooth", &smooth);
  module.def("weights_at", &weights);
  module.def("vertical_distances", &distances);
  module.def("triangle_quality", &triangle_quality);
  module.def("mesh_quality", &quality);
}

}  // namespace terrace::python
