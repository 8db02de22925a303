// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/terrain/build.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/merge.hpp>
#include <terrace/terrain/output_kinds.hpp>
#include <terrace/terrain/scan_surface.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"
#include "sources.hpp"

namespace terrace::python {
namespace {

terrain::BuildRequest request_of(const py::object& source, const std::string& path,
                                 const py::dict& options) {
  terrain::BuildRequest request;
  if (py::isinstance<py::list>(source)) {
    request.inputs = source.cast<std::vector<std::string>>();
  } else {
    request.open = opener_of(source);
    if (const auto arrays = source.cast<py::dict>(); arrays.contains("triangles")) {
      request.open_triangles = opener_of(arrays["triangles"]);
    }
  }
  check_output_name(terrain::outputs::kStore, path);
  request.store = path;
  const auto set = [&](const char* name, auto& to) { take_option(options, name, to); };
  set("replace", request.replace);
  set("append", request.append);
  set("input_format", request.input_format);
  set("skip_damaged", request.skip_damaged);
  set("vertical", request.vertical);
  set("block_points", request.block_points);
  set("facility_cost", request.facility_cost);
  set("k", request.k);
  set("batch", request.batch);
  set("search_threads", request.search_threads);
  set("z_weight", request.z_weight);
  set("channels", request.channels);
  set("outlier_price", request.outlier_price);
  set("band", request.band);
  set("cell", request.cell);
  set("seed", request.seed);
  set("datum_shift", request.datum_shift);
  if (options.contains("crs")) {
    request.crs = terrain::crs_named(options["crs"].cast<std::string>());
  }
  if (options.contains("metric")) {
    request.metric = terrain::MetricChoice::parse(options["metric"].cast<std::string>());
  }
  request.selection = reading_of(source, options).selection;
  take_named(options, "effort", request.effort);
  take_named(options, "method", request.strategy);
  take_named(options, "order", request.order);
  take_named(options, "heights_of_colour", request.heights_of_colour);
  take_named(options, "entities", request.entities);
  if (request.block_points < 2 || request.block_points > 1'000'000) {
    throw py::value_error("`block_points` must be between 2 and 1000000");
  }
  if (!(request.facility_cost > 0)) throw py::value_error("`facility_cost` must be positive");
  if (request.k > 0 && options.contains("facility_cost")) {
    throw py::value_error("give either `k` or `facility_cost`");
  }
  if (!(request.z_weight >= 0)) throw py::value_error("`z_weight` must not be negative");
  if (request.band < 1) throw py::value_error("`band` counts from 1");
  return request;
}

}  // namespace

void bind_build(py::module_& module) {
  module.def("build", [](const py::object& source, const std::string& path, const py::dict& options,
                         const py::tuple& settings) {
    terrain::BuildRequest request = request_of(source, path, options);
    bool surface = options.contains("surface") && py::isinstance<py::str>(options["surface"]);
    if (surface) {
      take_named(options, "surface", request.surface_origin);
    } else {
      take_option(options, "surface", surface);
    }
    if (surface && request.entities != stream::Entities::points) {
      throw py::value_error("`surface` is for points, not for other `entities`");
    }
    const terrain::BuildOutcome outcome = Call(settings).run([&](const terrain::Context& context) {
      if (surface) {
        request.surface = [&context](const stream::Store& store, const stream::ClusterOrder& order,
                                     const terrain::InputTriangles& triangles) {
          return terrain::surface_to_store(store, order, context, triangles);
        };
      }
      return terrain::build_store(request, context);
    });
    py::dict result;
    result["points"] = outcome.points;
    result["store_points"] = outcome.store_points;
    result["nodata"] = outcome.nodata;
    result["excluded"] = outcome.excluded;
    result["lost"] = outcome.lost;
    result["empty_values"] = outcome.empty_values;
    result["withheld"] = outcome.withheld;
    result["outliers"] = outcome.outliers;
    result["bytes"] = outcome.store_bytes;
    result["input_triangles"] = outcome.input_triangles;
    result["reordered"] = outcome.order.reordered;
    return result;
  });
  module.def("merge", [](const std::vector<std::string>& stores, const std::string& path,
                         bool replace, const py::tuple& settings) {
    check_output_name(terrain::outputs::kStore, path);
    terrain::MergeRequest request;
    request.stores.assign(stores.begin(), stores.end());
    request.store = path;
    request.replace = replace;
    Call(settings).run(
        [&](const terrain::Context& context) { return terrain::merge_stores(request, context); });
  });
}

}  // namespace terrace::python
