// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <pybind11/stl.h>
#include <terrace/terrain/tiles.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

terrain::TilesRequest tiles_request(const std::string& folder, const py::dict& given) {
  terrain::TilesRequest request{.folder = folder};
  const auto set = [&](const char* name, auto& to) { take_option(given, name, to); };
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
  const auto text = [&](const char* name, std::string value) {
    take_option(given, name, value);
    return value;
  };
  using tri::TinQuality, terrain::Fill, terrain::HeightReference;
  request.quality = named<TinQuality>(text("quality", "removal"), "quality",
                                      {{"greedy", TinQuality::kGreedy},
                                       {"removal", TinQuality::kRemoval},
                                       {"fitted", TinQuality::kFitted}});
  request.vertical = named<HeightReference>(text("vertical", "recorded"), "vertical",
                                            {{"recorded", HeightReference::recorded},
                                             {"ellipsoidal", HeightReference::ellipsoidal},
                                             {"orthometric", HeightReference::orthometric},
                                             {"ignore", HeightReference::ignore}});
  request.fill = named<Fill>(text("fill", "interpolate"), "fill",
                             {{"flat", Fill::flat}, {"interpolate", Fill::interpolate}});
  return request;
}

}  // namespace

void bind_tiles(py::module_& module) {
  module.def("write_tiles", [](const OpenStore& open, const std::string& folder,
                               const py::dict& given, const py::tuple& how) {
    const stream::Store store = open.get();
    const terrain::TilesRequest request = tiles_request(folder, given);
    const terrain::TilesOutcome outcome = Job(how).run([&](const terrain::Context& context) {
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
