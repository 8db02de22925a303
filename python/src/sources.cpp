// SPDX-License-Identifier: Apache-2.0
#include "sources.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/stream/input.hpp>
#include <terrace/stream/memory_source.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/region.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"

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

stream::MemoryPoints points_of_columns(const py::dict& arguments) {
  stream::MemoryPoints points;
  points.info.files = {arguments["name"].cast<std::string>()};
  points.info.format = "array";
  const auto columns = arguments["columns"].cast<std::vector<py::dict>>();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    points.info.coordinates[axis] = channel_of(columns.at(axis));
    points.coordinates[axis] = column_of(columns[axis]);
  }
  // The transform holds the scale and offset of x and y.
  auto& xy = points.info.world.xy;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    stream::Channel& channel = points.info.coordinates[axis];
    xy[axis * 4] = channel.scale;
    xy[axis * 3 + 2] = channel.offset;
  }
  points.count = static_cast<std::uint64_t>(columns[0]["array"].cast<py::array>().shape(0));
  for (const py::dict& attribute : arguments["attributes"].cast<std::vector<py::dict>>()) {
    points.info.attributes.push_back(channel_of(attribute));
    points.attributes.push_back(column_of(attribute));
  }
  return points;
}

stream::MemoryRaster raster_of_samples(const py::dict& arguments) {
  stream::MemoryRaster raster;
  const auto samples = arguments["samples"].cast<py::array>();
  raster.info.files = {arguments["name"].cast<std::string>()};
  raster.info.format = "array";
  raster.info.rows = static_cast<std::uint64_t>(samples.shape(0));
  raster.info.columns = static_cast<std::uint64_t>(samples.shape(1));
  raster.info.sample = {.name = "sample",
                        .type = scalar_type(samples.dtype(), "the raster"),
                        .scale = arguments["scale"].cast<double>(),
                        .offset = arguments["offset"].cast<double>()};
  raster.info.world.xy = arguments["transform"].cast<std::array<double, 6>>();
  raster.info.nodata = arguments["nodata"].cast<std::optional<double>>();
  raster.first = static_cast<const std::byte*>(samples.data());
  raster.row_stride = samples.strides(0);
  raster.column_stride = samples.strides(1);
  return raster;
}

bool opens_twice(const py::object& source) {
  if (!py::isinstance<py::list>(source)) return true;
  const auto names = source.cast<std::vector<std::string>>();
  return std::none_of(names.begin(), names.end(), stream::reads_once);
}

/// Reads where, keep, drop, resolution and region.
stream::Selection selection_of(const py::object& source, const py::dict& arguments,
                               const stream::SourceOptions& options) {
  stream::Selection selection;
  take_option(arguments, "where", selection.where);
  take_option(arguments, "keep", selection.keep);
  take_option(arguments, "drop", selection.drop);
  take_option(arguments, "resolution", selection.resolution);
  if (!arguments.contains("region")) return selection;
  auto region = region_of(arguments["region"]);
  if (region && terrain::RegionConversion::may_turn(*region) && opens_twice(source)) {
    const OpenSource open = opener_of(source);
    const auto info = released([&] { return open(options)->info(); });
    region = to_data_crs(*region, terrain::RegionConversion(info));
  }
  if (region) region->restrict(selection);
  return selection;
}

}  // namespace

OpenSource opener_of(const py::object& source) {
  if (py::isinstance<py::list>(source)) {
    return [names = source.cast<std::vector<std::string>>()](stream::SourceOptions options) {
      options.same_crs = &terrain::same_crs;
      return stream::open_source(names, options);
    };
  }
  const auto input = source.cast<py::dict>();
  if (input.contains("samples")) {
    return [raster = raster_of_samples(input)](const stream::SourceOptions& options) {
      return stream::open_memory(raster, options);
    };
  }
  return [points = points_of_columns(input)](const stream::SourceOptions& options) {
    return stream::open_memory(points, options);
  };
}

stream::SourceOptions reading_of(const py::object& source, const py::dict& arguments,
                                 unsigned threads, std::stop_token stop) {
  stream::SourceOptions options;
  const auto set = [&](const char* name, auto& to) { take_option(arguments, name, to); };
  set("input_format", options.format);
  set("block_points", options.block_points);
  set("band", options.band);
  set("cell", options.cell);
  if (options.block_points < 1) throw py::value_error("`block_points` must be positive");
  if (options.band < 1) throw py::value_error("`band` counts from 1");
  if (arguments.contains("crs")) {
    options.crs = terrain::crs_named(arguments["crs"].cast<std::string>());
  }
  bool skip_damaged = false;
  set("skip_damaged", skip_damaged);
  if (skip_damaged) options.on_damage = [](const stream::Error&, std::uint64_t) {};
  take_named(arguments, "entities", options.entities);
  take_named(arguments, "heights_of_colour", options.heights_of_colour);
  options.threads = threads;
  options.stop = std::move(stop);
  options.selection = selection_of(source, arguments, options);
  return options;
}

}  // namespace terrace::python
