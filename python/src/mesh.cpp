// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/stream/mesh_reader.hpp>
#include <terrace/terrain/bounded_mesh.hpp>
#include <terrace/terrain/detail_lines.hpp>
#include <terrace/terrain/detail_mesh.hpp>
#include <terrace/terrain/output_kinds.hpp>
#include <terrace/terrain/scan_surface.hpp>
#include <terrace/tri/shape.hpp>
#include <terrace/tri/surface_smoothing.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

/// Returns units as a tuple for units_from(), with bytes because names may not be UTF-8.
py::tuple to_python(const terrain::MeshUnits& units) {
  const stream::Crs& crs = units.crs;
  return py::make_tuple(crs.epsg, crs.geographic, py::bytes(crs.name), py::bytes(crs.wkt),
                        py::bytes(crs.horizontal_unit), py::bytes(crs.vertical_unit),
                        py::bytes(units.height_unit));
}

terrain::MeshUnits units_from(const py::object& units) {
  terrain::MeshUnits result;
  if (units.is_none()) return result;
  const auto fields = units.cast<py::tuple>();
  result.crs.epsg = fields[0].cast<int>();
  result.crs.geographic = fields[1].cast<bool>();
  std::size_t next = 2;
  for (std::string* text : {&result.crs.name, &result.crs.wkt, &result.crs.horizontal_unit,
                            &result.crs.vertical_unit, &result.height_unit}) {
    *text = fields[next++].cast<std::string>();
  }
  return result;
}

/// Returns (vertices, triangles, levels, units).
py::tuple arrays_of(terrain::TriangleMesh&& mesh, const py::object& units = py::none()) {
  py::object levels = py::none();
  if (!mesh.levels.empty()) levels = to_array(std::move(mesh.levels));
  return py::make_tuple(to_array(std::move(mesh.positions)), to_array(std::move(mesh.triangles)),
                        levels, units);
}

/// Returns the conversion to the CRS with a name; an empty name changes nothing.
terrain::PlaceConversion places_to(const stream::Store& store, const std::string& crs) {
  const auto to = change_to(store, crs);
  return to ? terrain::PlaceConversion(*to, store) : terrain::PlaceConversion();
}

/// heights: a dict with "smoothing" (method, iterations, strength, pass band, edge height), the
/// files "overlay" and "save", and "replace".
py::tuple mesh(const OpenStore& open, unsigned level, const py::object& region,
               const py::list& focuses, const std::string& where,
               const std::optional<std::pair<unsigned, std::uint64_t>>& cluster,
               const std::string& metric, const py::dict& heights, const std::string& crs,
               const py::tuple& settings) {
  const stream::Store store = open.get(where);
  terrain::Detail detail = detail_of(store, level, region, focuses);
  if (cluster) detail.cluster = cluster_of(store, cluster->first, cluster->second);
  terrain::DetailMeshOptions options;
  options.metric = terrain::MetricChoice::parse(metric);
  if (heights.contains("smoothing")) {
    const auto [method, iterations, strength, pass_band, edge_height] =
        heights["smoothing"].cast<std::tuple<std::string, unsigned, double, double, double>>();
    options.heights.smoothing = {.method = named<tri::Smoothing>(method),
                                 .iterations = iterations,
                                 .strength = strength,
                                 .pass_band = pass_band,
                                 .edge_height = edge_height};
  }
  std::string overlay_path, save_path;
  bool replace = false;
  take_option(heights, "overlay", overlay_path);
  take_option(heights, "save", save_path);
  take_option(heights, "replace", replace);
  if (!save_path.empty()) check_output_name(terrain::outputs::kOverlayFile, save_path);
  terrain::MeshUnits units;
  terrain::TriangleMesh result = Call(settings).run([&](const terrain::Context& context) {
    note_idle_focuses(store, detail, context);
    std::optional<stream::Overlay> overlay;
    if (!overlay_path.empty()) {
      options.heights.overlay = &overlay.emplace(terrain::open_height_overlay(overlay_path, store));
    }
    std::optional<stream::OverlayWriter> writer;
    if (!save_path.empty()) {
      options.heights.save =
          &writer.emplace(save_path, store, store.schema().coordinates[2].name, replace);
    }
    terrain::TriangleMesh mesh = detail_mesh(store, detail, options, context);
    if (writer) writer->finish();
    const terrain::PlaceConversion places = places_to(store, crs);
    places(mesh.positions, [&] { context.check_stop(); });
    units = terrain::MeshUnits(store, places);
    return mesh;
  });
  return arrays_of(std::move(result), to_python(units));
}

/// Method, iterations and limit.
using SurfaceSmoothingArguments = std::tuple<std::string, unsigned, std::optional<double>>;

tri::SurfaceSmoothingOptions surface_smoothing(const SurfaceSmoothingArguments& arguments) {
  const auto& [method, iterations, limit] = arguments;
  return {.method = named<tri::SurfaceSmoothing>(method), .iterations = iterations, .limit = limit};
}

/// Returns the surface as arrays_of() does, or (vertices, tetrahedra inside it).
py::tuple surface(const OpenStore& open, unsigned level, const py::object& region,
                  const std::string& where,
                  const std::optional<std::pair<unsigned, std::uint64_t>>& cluster, bool tetrahedra,
                  const std::optional<SurfaceSmoothingArguments>& smoothing,
                  std::optional<double> max_error, std::optional<std::size_t> max_points,
                  bool stored, const py::tuple& settings) {
  const stream::Store store = open.get(where);
  terrain::Detail detail = detail_of(store, level, region, py::list());
  if (cluster) detail.cluster = cluster_of(store, cluster->first, cluster->second);
  terrain::ScanSurfaceOptions options;
  options.stored = stored;
  options.tetrahedra = tetrahedra;
  if (smoothing) options.smoothing = surface_smoothing(*smoothing);
  options.max_error = max_error;
  options.max_points = max_points;
  terrain::ScanSurface result = Call(settings).run([&](const terrain::Context& context) {
    return scan_surface(store, detail, options, context);
  });
  if (!tetrahedra) {
    return arrays_of(std::move(result.mesh), to_python(terrain::MeshUnits(store)));
  }
  return py::make_tuple(to_array(std::move(result.mesh.positions)),
                        to_array(std::move(result.tetrahedra)));
}

tri::Surface surface_of_rows(const Array<double>& vertices, const Array<std::uint32_t>& triangles) {
  const auto places = rows_of<3>(vertices, "vertices");
  const auto corners = rows_of<3>(triangles, "triangles");
  return {{places.begin(), places.end()}, {corners.begin(), corners.end()}};
}

/// Returns the vertices after smoothing.
py::array smoothed(const Array<double>& vertices, const Array<std::uint32_t>& triangles,
                   const SurfaceSmoothingArguments& arguments, unsigned threads) {
  const tri::Surface surface = surface_of_rows(vertices, triangles);
  tri::SurfaceSmoothingOptions options = surface_smoothing(arguments);
  options.threads = threads;
  return to_array(released([&](const std::stop_token& stop) {
    options.check_stop = stop_check(stop);
    return tri::smooth(surface, options).points;
  }));
}

py::array vertex_normals(const Array<double>& vertices, const Array<std::uint32_t>& triangles,
                         unsigned threads) {
  const tri::Surface surface = surface_of_rows(vertices, triangles);
  return to_array(released([&] { return tri::vertex_normals(surface, threads); }));
}

/// Returns (vertices, the offset of each line and the total, the number of each line, the
/// properties: a dict of names and arrays).
py::tuple lines(const OpenStore& open, unsigned level, const py::object& region,
                const py::list& focuses, const std::string& where, const py::tuple& settings) {
  const stream::Store store = open.get(where);
  const terrain::Detail detail = detail_of(store, level, region, focuses);
  terrain::LineSet result = Call(settings).run([&](const terrain::Context& context) {
    note_idle_focuses(store, detail, context);
    return detail_lines(store, detail, context);
  });
  std::vector<std::int64_t> begins{0}, numbers;
  for (const terrain::LineSet::Line& line : result.lines) {
    begins.push_back(static_cast<std::int64_t>(line.end));
    numbers.push_back(line.number);
  }
  py::dict properties;
  const std::size_t count = result.property_names.size();
  for (std::size_t p = 0; p < count; ++p) {
    std::vector<double> values;
    for (std::size_t i = p; i < result.properties.size(); i += count) {
      values.push_back(result.properties[i]);
    }
    properties[text_of(result.property_names[p])] = to_array(std::move(values));
  }
  return py::make_tuple(to_array(std::move(result.vertices)), to_array(std::move(begins)),
                        to_array(std::move(numbers)), properties);
}

py::dict bounded_mesh(const OpenStore& open, const std::string& path, const py::dict& arguments,
                      const py::tuple& settings) {
  const stream::Store store = open.get(arguments["where"].cast<std::string>());
  check_output_name(terrain::outputs::kMeshFile, path);
  terrain::BoundedMeshOptions options;
  options.path = path;
  const auto set = [&](const char* name, auto& to) { take_option(arguments, name, to); };
  set("max_error", options.max_error);
  set("max_points", options.max_points);
  set("replace", options.writer.replace.replace);
  options.region = region_of(arguments["region"], store);
  take_named(arguments, "quality", options.quality);
  take_named(arguments, "duplicates", options.duplicates);
  take_named(arguments, "fill", options.fill);
  const auto crs = arguments["crs"].cast<std::string>();
  const terrain::BoundedMeshResult outcome =
      Call(settings).run([&](const terrain::Context& context) {
        options.places = places_to(store, crs);
        return write_bounded_mesh(store, options, context);
      });
  py::dict result;
  result["units"] = to_python(terrain::MeshUnits(store, options.places));
  result["note"] = message_of(outcome.coordinates.note);
  result["triangles"] = outcome.triangles;
  result["max_error"] = outcome.max_error;
  result["rms_error"] = outcome.rms_error;
  result["samples"] = outcome.samples;
  result["uncovered"] = outcome.uncovered;
  return result;
}

/// normals: whether the file gets the normals of the vertices. Returns the note on its coordinates.
py::str write_mesh(const std::string& path, const Array<double>& vertices,
                   const Array<std::uint32_t>& triangles, bool normals, bool replace,
                   const py::object& given_units) {
  check_output_name(terrain::outputs::kMeshFile, path);
  const terrain::MeshUnits units = units_from(given_units);
  terrain::TriangleMesh mesh;
  const auto positions = rows_of<3>(vertices, "vertices");
  const auto corners = rows_of<3>(triangles, "triangles");
  mesh.positions.assign(positions.begin(), positions.end());
  mesh.triangles.assign(corners.begin(), corners.end());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (const std::uint32_t corner : corners[i]) {
      if (corner >= positions.size()) {
        throw py::value_error("triangle " + std::to_string(i) + " has a corner " +
                              std::to_string(corner) + ", but there are " +
                              std::to_string(positions.size()) + " vertices");
      }
    }
  }
  return message_of(released([&](const std::stop_token& stop) {
    const stream::WriterOptions writer{.replace = replace, .stop = stop};
    if (normals) set_normals(mesh, path, writer, units);
    return terrain::write_mesh(path, mesh, writer, units).note;
  }));
}

}  // namespace

void bind_mesh(py::module_& module) {
  module.def("mesh", &mesh);
  module.def("surface", &surface);
  module.def("smoothed", &smoothed);
  module.def("vertex_normals", &vertex_normals);
  module.def("lines", &lines);
  module.def("bounded_mesh", &bounded_mesh);
  module.def("read_mesh", [](const std::string& path) {
    auto file = released(
        [&](const std::stop_token& stop) { return stream::read_mesh(path, {.stop = stop}); });
    if (!file) throw py::value_error(path + " is not a mesh");
    return arrays_of(terrain::triangle_mesh_of(std::move(*file)));
  });
  module.def("write_mesh", &write_mesh);
  module.def("units",
             [](const OpenStore& open) { return to_python(terrain::MeshUnits(open.get())); });
  // Units of longitude and latitude in WGS 84.
  module.def("lonlat_units", [] {
    terrain::MeshUnits units;
    units.crs.epsg = 4326;
    units.crs.geographic = true;
    units.crs.horizontal_unit = "degree";
    return to_python(units);
  });
  // The same rule as for .glb files, which are in metres.
  module.def("metres_per_unit", [](const py::object& units, double x0, double y0, double z0,
                                   double x1, double y1, double z1) {
    const auto frame =
        terrain::mesh_coordinates("mesh.glb", {}, units_from(units), {{x0, y0, z0}, {x1, y1, z1}})
            .frame;
    return frame ? frame->metres : stream::Point3{1, 1, 1};
  });
  module.def("level_within", [](const OpenStore& open, std::uint64_t most) {
    return terrain::level_within(open.get(), most);
  });
}

}  // namespace terrace::python
