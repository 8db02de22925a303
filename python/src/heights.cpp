// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/raster.hpp>
#include <terrace/terrain/contours.hpp>
#include <terrace/terrain/error.hpp>
#include <terrace/terrain/heights.hpp>
#include <terrace/terrain/latitudes.hpp>
#include <terrace/terrain/output_kinds.hpp>
#include <terrace/terrain/profile.hpp>
#include <terrace/terrain/raster.hpp>

#include "arrays.hpp"
#include "call.hpp"
#include "names.hpp"
#include "store.hpp"

namespace terrace::python {
namespace {

terrain::SamplerOptions sampler_of(const std::string& method, const terrain::Detail& detail,
                                   std::optional<double> max_error,
                                   std::optional<double> max_edge) {
  return {.method = named<tri::Interpolation>(method),
          .level = detail.level,
          .focuses = detail.focuses,
          .max_error = max_error,
          .max_edge = max_edge};
}

/// Returns rows of height and the gradient to east and north.
py::array sample(const OpenStore& open, const Array<double>& xy, const std::string& method,
                 unsigned level, const py::list& focuses, std::optional<double> max_error,
                 std::optional<double> max_edge, const std::string& crs,
                 const py::tuple& settings) {
  const stream::Store store = open.get();
  const auto input = rows_of<2>(xy, "xy");
  const terrain::Detail detail = detail_of(store, level, py::none(), focuses);
  const terrain::SamplerOptions options = sampler_of(method, detail, max_error, max_edge);
  std::vector<terrain::GroundPoint> found =
      Call(settings).run([&](const terrain::Context& context) {
        note_idle_focuses(store, detail, context);
        const auto change = change_to(store, crs);
        if (!change) return sample_places(store, input, options, context);
        std::vector<terrain::Point2> places(input.begin(), input.end());
        terrain::check_latitudes(places, change->to().most_latitude(), "`xy`");
        change->reverse(places);
        return sample_places(store, places, options, context);
      });
  auto* const owned = new std::vector<terrain::GroundPoint>(std::move(found));
  const py::capsule owner(
      owned, [](void* p) { delete static_cast<std::vector<terrain::GroundPoint>*>(p); });
  static_assert(sizeof(terrain::GroundPoint) == 3 * sizeof(double));
  return py::array_t<double>({static_cast<py::ssize_t>(owned->size()), py::ssize_t{3}},
                             reinterpret_cast<const double*>(owned->data()), owner);
}

/// Returns rows of metres, x, y, height.
/// crs: the CRS of GeoJSON as in terrain::PlacesCrs, or None if the line is in the store's CRS.
py::array profile(const OpenStore& open, const Array<double>& line,
                  const std::optional<std::string>& crs, std::optional<double> step,
                  const std::string& method, unsigned level, const py::list& focuses,
                  std::optional<double> max_error, std::optional<double> max_edge,
                  const py::tuple& settings) {
  const stream::Store store = open.get();
  const terrain::Detail detail = detail_of(store, level, py::none(), focuses);
  terrain::ProfileRequest request;
  request.sampler = sampler_of(method, detail, max_error, max_edge);
  const auto places = rows_of<2>(line, "line");
  request.line.assign(places.begin(), places.end());
  if (crs) {
    terrain::RegionConversion conversion(store);
    conversion.on_note(log_note);
    stream::Box3 box;
    for (const terrain::Point2& p : request.line) box.include(stream::Point3{p[0], p[1], 0});
    request.to_line = conversion.to_places({.name = *crs, .file = "`line`"}, box);
  }
  if (step && !(*step > 0)) throw py::value_error("`step` must be positive");
  request.step = step;
  return to_array(Call(settings).run([&](const terrain::Context& context) {
    note_idle_focuses(store, detail, context);
    std::vector<std::array<double, 4>> rows;
    // A growing vector needs its old and its new memory at once.
    const std::uint64_t most = context.memory_or(0) / (3 * sizeof rows[0]);
    terrain::profile(
        store, request,
        [&](std::span<const terrain::ProfilePoint> points) {
          if (rows.size() + points.size() > most) {
            throw terrain::UsageError("the profile would have more than " + std::to_string(most) +
                                      " points, which do not fit into memory");
          }
          for (const terrain::ProfilePoint& p : points) {
            rows.push_back({p.metres, p.place[0], p.place[1], p.height});
          }
        },
        context);
    return rows;
  }));
}

bool reaches_wgs84(const stream::Store& store) {
  const stream::StoreSchema& schema = store.schema();
  const auto system = terrain::CoordinateSystem::of(schema.crs, store.path().string());
  return system && system->over(world_box(schema, store.bounds())).reaches_wgs84();
}

/// Returns (GeoJSON, whether it is in the store's CRS).
py::tuple contours(const OpenStore& open, double interval, unsigned level, const py::list& focuses,
                   std::optional<double> max_error, std::optional<double> max_edge,
                   const py::object& region, std::optional<bool> lonlat,
                   const py::tuple& settings) {
  const stream::Store store = open.get();
  if (!(interval > 0)) throw py::value_error("`interval` must be positive");
  const terrain::Detail detail = detail_of(store, level, region, focuses);
  const terrain::ContourRequest request{.interval = interval,
                                        .level = detail.level,
                                        .focuses = detail.focuses,
                                        .max_error = max_error,
                                        .max_edge = max_edge,
                                        .region = detail.region,
                                        .own_crs = !(lonlat ? *lonlat : reaches_wgs84(store))};
  const std::string text = Call(settings).run([&](const terrain::Context& context) {
    note_idle_focuses(store, detail, context);
    std::string lines;
    // The growing text needs its old and its new memory at once, and Python copies the result.
    const std::uint64_t most = context.memory_or(0) / 4;
    write_contours(
        store, request,
        [&](std::string_view more) {
          if (lines.size() + more.size() > most) {
            throw terrain::UsageError("the contours would take more than " + std::to_string(most) +
                                      " bytes of text, which do not fit into memory; pass a "
                                      "larger `interval`");
          }
          lines += more;
        },
        context);
    return lines;
  });
  return py::make_tuple(text, request.own_crs);
}

void write_raster(const OpenStore& open, const std::string& path, const std::string& value,
                  std::optional<double> cell, const std::string& align, const py::object& region,
                  const std::string& crs, const std::string& method, unsigned level,
                  const py::list& focuses, std::optional<double> max_error,
                  std::optional<double> max_edge, bool replace, const py::tuple& settings) {
  check_output_name(terrain::outputs::kRasterFile, path);
  const stream::Store store = open.get();
  const terrain::Detail detail = detail_of(store, level, region, focuses);
  terrain::RasterRequest request{.value = named<terrain::RasterValue>(value),
                                 .sampler = sampler_of(method, detail, max_error, max_edge),
                                 .cell = cell,
                                 .align = align,
                                 .region = detail.region,
                                 .output = path,
                                 .replace = replace};
  if (cell && !(*cell > 0)) throw py::value_error("`cell` must be positive");
  Call(settings).run([&](const terrain::Context& context) {
    note_idle_focuses(store, detail, context);
    request.to = change_to(store, crs);
    terrain::write_raster(store, request, context);
  });
}

/// Returns a name of the CRS for CoordinateSystem::parse(), or an empty text.
std::string name_of_crs(const stream::Crs& crs, const std::string& file) {
  if (crs.epsg != 0) return "EPSG:" + std::to_string(crs.epsg);
  const auto system = terrain::CoordinateSystem::of(crs, file);
  return system ? system->crs().wkt : std::string();
}

/// Reads a GeoTIFF. Returns (samples, which of them are valid, transform to cell centres, CRS).
py::tuple read_geotiff(const std::string& path) {
  const std::unique_ptr<stream::Raster> raster =
      released([&] { return stream::open_geotiff(path); });
  const stream::RasterInfo& info = raster->info();
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(info.rows),
                                       static_cast<py::ssize_t>(info.columns)};
  py::array samples(py::dtype(type_name(info.sample.type)), shape);
  py::array_t<std::uint8_t> valid(shape);
  std::fill_n(valid.mutable_data(), valid.size(), std::uint8_t{0});
  std::fill_n(static_cast<std::byte*>(samples.mutable_data()), samples.nbytes(), std::byte{0});
  auto* const cells = static_cast<std::byte*>(samples.mutable_data());
  std::uint8_t* const are_valid = valid.mutable_data();
  const auto size = static_cast<std::size_t>(samples.itemsize());
  released([&](const std::stop_token& stop) {
    constexpr std::uint64_t kRows = 256;
    for (std::uint64_t row = 0; row < info.rows; row += kRows) {
      if (stop.stop_requested()) throw stream::Stopped();
      const std::size_t at = row * info.columns;
      raster->read_over(
          {.column = 0,
           .row = row,
           .columns = info.columns,
           .rows = std::min(kRows, info.rows - row)},
          {.samples = cells + at * size, .valid = are_valid + at, .stride = info.columns});
    }
  });
  return py::make_tuple(samples, valid, py::cast(info.world.xy), name_of_crs(info.crs, path));
}

}  // namespace

void bind_heights(py::module_& module) {
  module.def("sample", &sample);
  module.def("profile", &profile);
  module.def("contours", &contours);
  module.def("write_raster", &write_raster);
  module.def("read_geotiff", &read_geotiff);
}

}  // namespace terrace::python
