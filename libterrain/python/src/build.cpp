// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/stream/memory_source.hpp>
#include <terrace/terrain/build.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/region.hpp>

#include "arrays.hpp"
#include "call.hpp"

namespace terrace::python {
namespace {

stream::Channel channel_of(const py::dict& column) {
  const auto array = column["array"].cast<py::array>();
  const auto name = column["name"].cast<std::string>();
  return {.name = name,
          .type = scalar_type(array.dtype(), name),
          .scale = column["scale"].cast<double>(),
          .offset = column["offset"].cast<double>()};
}

stream::MemoryColumn column_of(const py::dict& column) {
  const auto array = column["array"].cast<py::array>();
  return {static_cast<const std::byte*>(array.data()), array.strides(0)};
}

/// {"name", "columns": 3 coordinates, "attributes"}: dicts of array, name, scale and offset.
stream::MemoryPoints points_of_columns(const py::dict& given) {
  stream::MemoryPoints points;
  points.info.files = {given["name"].cast<std::string>()};
  points.info.format = "array";
  const auto columns = given["columns"].cast<std::vector<py::dict>>();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    points.info.coordinates[axis] = channel_of(columns.at(axis));
    points.coordinates[axis] = column_of(columns[axis]);
  }
  // Scale and offset of x and y are those of the transform.
  auto& xy = points.info.world.xy;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    stream::Channel& channel = points.info.coordinates[axis];
    xy[axis * 4] = channel.scale;
    xy[axis * 3 + 2] = channel.offset;
  }
  points.count = static_cast<std::uint64_t>(columns[0]["array"].cast<py::array>().shape(0));
  for (const py::dict& attribute : given["attributes"].cast<std::vector<py::dict>>()) {
    points.info.attributes.push_back(channel_of(attribute));
    points.attributes.push_back(column_of(attribute));
  }
  return points;
}

/// {"name", "samples": 2D, "transform": six numbers to a sample's place, "nodata", "scale",
/// "offset"}
stream::MemoryRaster raster_of_samples(const py::dict& given) {
  stream::MemoryRaster raster;
  const auto samples = given["samples"].cast<py::array>();
  raster.info.files = {given["name"].cast<std::string>()};
  raster.info.format = "array";
  raster.info.rows = static_cast<std::uint64_t>(samples.shape(0));
  raster.info.columns = static_cast<std::uint64_t>(samples.shape(1));
  raster.info.sample = {.name = "sample",
                        .type = scalar_type(samples.dtype(), "the raster"),
                        .scale = given["scale"].cast<double>(),
                        .offset = given["offset"].cast<double>()};
  raster.info.world.xy = given["transform"].cast<std::array<double, 6>>();
  raster.info.nodata = given["nodata"].cast<std::optional<double>>();
  raster.first = static_cast<const std::byte*>(samples.data());
  raster.row_stride = samples.strides(0);
  raster.column_stride = samples.strides(1);
  return raster;
}

void set_source(terrain::BuildRequest& request, const py::object& source) {
  if (py::isinstance<py::list>(source)) {
    request.inputs = source.cast<std::vector<std::string>>();
    return;
  }
  const auto given = source.cast<py::dict>();
  if (given.contains("samples")) {
    request.open = [raster = raster_of_samples(given)](const stream::SourceOptions& options) {
      return stream::open_memory(raster, options);
    };
  } else {
    request.open = [points = points_of_columns(given)](const stream::SourceOptions& options) {
      return stream::open_memory(points, options);
    };
  }
}

terrain::BuildRequest request_of(const py::object& source, const std::string& path,
                                 const py::dict& options) {
  terrain::BuildRequest request;
  set_source(request, source);
  request.store = path;
  const auto set = [&](const char* name, auto& to) { take_option(options, name, to); };
  set("replace", request.replace);
  set("input_format", request.input_format);
  set("skip_damaged", request.skip_damaged);
  set("vertical", request.vertical);
  set("block_points", request.block_points);
  set("facility_cost", request.facility_cost);
  set("z_weight", request.z_weight);
  set("channels", request.channels);
  set("outlier_price", request.outlier_price);
  set("band", request.band);
  set("cell", request.cell);
  set("seed", request.seed);
  set("datum_shift", request.datum_shift);
  set("where", request.selection.where);
  set("keep", request.selection.keep);
  set("drop", request.selection.drop);
  set("resolution", request.selection.resolution);
  if (options.contains("crs")) {
    request.crs = terrain::CoordinateSystem::parse(options["crs"].cast<std::string>()).crs();
  }
  if (options.contains("metric")) {
    request.metric = terrain::MetricChoice::parse(options["metric"].cast<std::string>());
  }
  if (options.contains("region")) {
    if (const auto region = region_of(options["region"])) region->restrict(request.selection);
  }
  const auto text = [&](const char* name, std::string value) {
    take_option(options, name, value);
    return value;
  };
  request.effort = named<cluster::Effort>(text("effort", "default"), "effort",
                                          {{"fast", cluster::Effort::fast},
                                           {"default", cluster::Effort::standard},
                                           {"fine", cluster::Effort::fine},
                                           {"full", cluster::Effort::full}});
  request.order = named<stream::Order>(text("order", "auto"), "order",
                                       {{"auto", stream::Order::automatic},
                                        {"stream", stream::Order::stream},
                                        {"spatial", stream::Order::spatial}});
  using stream::Entities;
  request.entities = named<Entities>(text("entities", "points"), "entities",
                                     {{"points", Entities::points},
                                      {"triangles", Entities::triangles},
                                      {"segments", Entities::segments},
                                      {"polylines", Entities::polylines}});
  if (request.block_points < 2 || request.block_points > 1'000'000) {
    throw py::value_error("`block_points` must be between 2 and 1000000");
  }
  if (!(request.facility_cost > 0)) throw py::value_error("`facility_cost` must be above 0");
  if (!(request.z_weight >= 0)) throw py::value_error("`z_weight` must not be negative");
  if (request.band < 1) throw py::value_error("`band` counts from 1");
  return request;
}

}  // namespace

void bind_build(py::module_& module) {
  module.def("build", [](const py::object& source, const std::string& path, const py::dict& options,
                         const py::tuple& how) {
    const terrain::BuildRequest request = request_of(source, path, options);
    const terrain::BuildOutcome outcome = Job(how).run(
        [&](const terrain::Context& context) { return terrain::build_store(request, context); });
    py::dict result;
    result["points"] = outcome.points;
    result["nodata"] = outcome.nodata;
    result["excluded"] = outcome.excluded;
    result["lost"] = outcome.lost;
    result["outliers"] = outcome.outliers;
    result["bytes"] = outcome.store_bytes;
    result["reordered"] = outcome.order.reordered;
    return result;
  });
}

}  // namespace terrace::python
