// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>

#include <pybind11/stl.h>
#include <terrace/terrain/output_kinds.hpp>
#include <terrace/terrain/tile_check.hpp>
#include <terrace/terrain/tiles.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

terrain::TilesRequest tiles_request(const std::string& folder, const py::dict& arguments) {
  check_output_name(terrain::outputs::kTileSet, folder);
  terrain::TilesRequest request{.folder = folder};
  const auto set = [&](const char* name, auto& to) { take_option(arguments, name, to); };
  set("name", request.name);
  set("first_zoom", request.first_zoom);
  set("last_zoom", request.last_zoom);
  set("max_error", request.max_error);
  set("geoid", request.geoid);
  set("flat_height", request.flat_height);
  set("water", request.water);
  set("water_height", request.water_height);
  set("normals", request.normals);
  set("metadata", request.metadata);
  set("gzip", request.gzip);
  set("resume", request.resume);
  set("replace", request.replace);
  take_named(arguments, "quality", request.quality);
  take_named(arguments, "vertical", request.vertical);
  take_named(arguments, "fill", request.fill);
  if (request.fill == terrain::Fill::none)
    throw py::value_error("tiles cannot have holes: `fill` must be flat or interpolate");
  return request;
}

/// open: the store to compare heights with, or null.
py::dict check_tiles(const std::string& folder, const OpenStore* open,
                     std::optional<double> max_error, const std::string& vertical,
                     const std::string& geoid, const py::tuple& settings) {
  if (!terrain::is_tile_folder(folder)) throw py::value_error(folder + " holds no set of tiles");
  std::optional<stream::Store> store;
  if (open != nullptr) store = open->get();
  const terrain::TileCheckRequest request{.folder = folder,
                                          .max_error = max_error,
                                          .store = store ? &*store : nullptr,
                                          .vertical = named<terrain::HeightReference>(vertical),
                                          .geoid = geoid};
  const terrain::TileCheckResult solution = Call(settings).run(
      [&](const terrain::Context& context) { return terrain::check_tiles(request, context); });
  py::dict result;
  py::list faults, zooms;
  for (const stream::Problem& problem : solution.problems) faults.append(text_of(problem));
  for (const terrain::ZoomCheck& of : solution.zooms) {
    py::dict zoom;
    zoom["zoom"] = of.zoom;
    zoom["tiles"] = of.tiles;
    zoom["samples"] = of.samples;
    zoom["uncovered"] = of.uncovered;
    zoom["max_error"] = of.max_error;
    zooms.append(zoom);
  }
  result["faults"] = faults;
  result["tiles"] = solution.tiles;
  result["samples"] = solution.samples;
  result["torn"] = solution.torn;
  result["zooms"] = zooms;
  return result;
}

}  // namespace

void bind_tiles(py::module_& module) {
  module.def("check_tiles", &check_tiles);
  module.def("write_tiles", [](const OpenStore& open, const std::string& folder,
                               const py::dict& arguments, const py::tuple& settings) {
    const stream::Store store = open.get();
    const terrain::TilesRequest request = tiles_request(folder, arguments);
    const terrain::TilesOutcome outcome = Call(settings).run([&](const terrain::Context& context) {
      return terrain::write_tiles(store, request, context);
    });
    py::dict result;
    result["tiles"] = outcome.tiles;
    result["bytes"] = outcome.bytes;
    result["made"] = outcome.made;
    result["kept"] = outcome.kept;
    result["removed"] = outcome.removed;
    py::list zooms;
    for (const terrain::TileZoom& of : outcome.zooms) {
      py::dict zoom;
      zoom["zoom"] = of.zoom;
      zoom["tiles"] = of.tiles;
      zoom["max_error"] = of.max_error;
      zooms.append(zoom);
    }
    result["zooms"] = zooms;
    return result;
  });
}

}  // namespace terrace::python
