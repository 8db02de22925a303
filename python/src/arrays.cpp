// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <limits>
#include <optional>
#include <stop_token>
#include <utility>

#include <pybind11/stl.h>

#include "call.hpp"
#include "names.hpp"

namespace terrace::python {
namespace {

constexpr std::array<std::string_view, 10> kTypeNames{"i1", "u1", "i2", "u2", "i4",
                                                      "u4", "i8", "u8", "f4", "f8"};

}  // namespace

std::string type_name(stream::ScalarType type) {
  return std::string(kTypeNames[static_cast<std::size_t>(type)]);
}

stream::ScalarType scalar_type(const py::dtype& type, const std::string& what) {
  const std::string name = type.kind() + std::to_string(type.itemsize());
  for (std::size_t i = 0; i < kTypeNames.size(); ++i) {
    if (kTypeNames[i] == name && type.byteorder() != '>') return static_cast<stream::ScalarType>(i);
  }
  throw py::type_error(what + " has the type " +
                       std::string(py::str(static_cast<const py::object&>(type))) +
                       "; numbers of 8 to 64 bits in native byte order are needed");
}

py::dtype record_type(const stream::Schema& schema, const std::vector<std::string>& more) {
  py::list fields;
  for (const char* name : {"x", "y", "z"}) fields.append(py::make_tuple(name, "f8"));
  for (const stream::Channel& attribute : schema.attributes) {
    // numpy needs unique names: append underscores to duplicates and to names of coordinates.
    std::string name = attribute.name;
    const auto taken = [&] {
      for (const py::handle field : fields) {
        if (field.cast<py::tuple>()[0].cast<std::string>() == name) return true;
      }
      return name.empty();
    };
    while (taken()) name += '_';
    fields.append(py::make_tuple(name, type_name(attribute.type)));
  }
  for (const std::string& name : more) fields.append(py::make_tuple(name, "f8"));
  return py::dtype::from_args(fields);
}

py::dtype attributes_type(const stream::Schema& schema) {
  py::list fields = py::list(record_type(schema).attr("descr"));
  return py::dtype::from_args(fields[py::slice(3, static_cast<py::ssize_t>(fields.size()), 1)]);
}

py::list attributes_info(const stream::Schema& schema) {
  py::list attributes;
  const py::list fields = record_type(schema).attr("names");
  for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
    const stream::Channel& channel = schema.attributes[i];
    py::dict attribute;
    attribute["name"] = fields[3 + i];
    attribute["dtype"] = type_name(channel.type);
    attribute["scale"] = channel.scale;
    attribute["offset"] = channel.offset;
    attribute["unit"] = channel.unit;
    attributes.append(attribute);
  }
  return attributes;
}

py::dict crs_info(const stream::Crs& crs) {
  py::dict result;
  result["epsg"] = crs.epsg;
  result["vertical_epsg"] = crs.vertical_epsg;
  result["name"] = crs.name;
  result["wkt"] = crs.wkt;
  result["geographic"] = crs.geographic;
  result["unit"] = crs.horizontal_unit;
  result["vertical_unit"] = crs.vertical_unit;
  return result;
}

py::array to_records(std::vector<std::byte>&& bytes, const py::dtype& type) {
  auto* const owned = new std::vector<std::byte>(std::move(bytes));
  const py::capsule owner(owned, [](void* p) { delete static_cast<std::vector<std::byte>*>(p); });
  return {type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(owned->size()) / type.itemsize()},
          std::vector<py::ssize_t>{type.itemsize()}, owned->data(), owner};
}

std::vector<std::array<double, 3>> points3_of(const Array<double>& input) {
  if (input.ndim() == 2 && input.shape(1) == 2) {
    std::vector<std::array<double, 3>> points;
    points.reserve(static_cast<std::size_t>(input.shape(0)));
    for (const auto& p : rows_of<2>(input, "points")) points.push_back({p[0], p[1], 0});
    return points;
  }
  if (input.ndim() != 2 || input.shape(1) != 3) {
    throw py::value_error("points must have the shape (n, 2) or (n, 3)");
  }
  const auto rows = rows_of<3>(input, "points");
  return {rows.begin(), rows.end()};
}

void log_note(const stream::Message& line) {
  py::module_::import("terrace._call").attr("notes").attr("info")("%s", message_of(line));
}

terrain::Region to_data_crs(const terrain::Region& region, terrain::RegionConversion conversion) {
  conversion.on_note(log_note);
  return conversion(region);
}

std::optional<terrain::Region> region_of(const py::object& value, const stream::Store& store) {
  std::optional<terrain::Region> region = region_of(value);
  if (region) region = to_data_crs(*region, terrain::RegionConversion(store));
  return region;
}

std::optional<terrain::Region> region_of(const py::object& argument) {
  if (argument.is_none()) return std::nullopt;
  if (py::isinstance<py::tuple>(argument)) {
    stream::Box3 box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = argument.cast<py::tuple>()[axis].cast<double>();
      box.max[axis] = argument.cast<py::tuple>()[3 + axis].cast<double>();
    }
    return terrain::Region::of_box(box);
  }
  const auto geojson = argument.cast<py::dict>();
  std::vector<terrain::Polygon> polygons;
  for (const py::handle polygon : geojson["polygons"].cast<py::list>()) {
    terrain::Polygon& rings = polygons.emplace_back();
    for (const py::handle ring : polygon) {
      const auto array = ring.cast<Array<double>>();
      const auto places = rows_of<2>(array, "a ring");
      rings.emplace_back(places.begin(), places.end());
    }
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto name = geojson["name"].cast<std::string>();
  const terrain::Region region =
      released([&](const std::stop_token& stop) -> std::optional<terrain::Region> {
        return terrain::Region::of_polygons(std::move(polygons), -kInfinity, kInfinity, name, stop);
      }).value();
  const auto crs = geojson["crs"].cast<std::optional<std::string>>();
  if (!crs) return region;
  return region.in_crs(terrain::PlacesCrs{.name = *crs, .file = name});
}

}  // namespace terrace::python
