// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/region.hpp>

#include "core.hpp"

/// numpy's arrays and the library's spans and vectors.

namespace terrace::python {

/// Contiguous; what has another type or layout is converted.
template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// Rows of N numbers, without a copy. Throws: ValueError for another shape, naming `what`.
template <std::size_t N, class T>
std::span<const std::array<T, N>> rows_of(const Array<T>& array, const char* what) {
  if (array.ndim() != 2 || array.shape(1) != static_cast<py::ssize_t>(N)) {
    throw py::value_error(std::string(what) + " must have the shape (n, " + std::to_string(N) +
                          ")");
  }
  return {reinterpret_cast<const std::array<T, N>*>(array.data()),
          static_cast<std::size_t>(array.shape(0))};
}

/// Points of space, or of the plane, which get z = 0. Throws: ValueError for another shape.
std::vector<std::array<double, 3>> points3_of(const Array<double>& given);

/// A one-dimensional array. Throws: ValueError for another shape, naming `what`.
template <class T>
std::span<const T> numbers_of(const Array<T>& array, const char* what) {
  if (array.ndim() != 1) throw py::value_error(std::string(what) + " must have one dimension");
  return {array.data(), static_cast<std::size_t>(array.shape(0))};
}

/// The vector's own memory as an array.
template <class T>
py::array_t<T> to_array(std::vector<T>&& values) {
  auto* const kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>({static_cast<py::ssize_t>(kept->size())}, kept->data(), owner);
}
template <class T, std::size_t N>
py::array_t<T> to_array(std::vector<std::array<T, N>>&& values) {
  auto* const kept = new std::vector<std::array<T, N>>(std::move(values));
  const py::capsule owner(kept,
                          [](void* p) { delete static_cast<std::vector<std::array<T, N>>*>(p); });
  return py::array_t<T>({static_cast<py::ssize_t>(kept->size()), static_cast<py::ssize_t>(N)},
                        reinterpret_cast<const T*>(kept->data()), owner);
}

/// Numbers with -1 in place of `nobody`.
inline py::array_t<std::int64_t> with_nobody(std::span<const std::uint32_t> numbers,
                                             std::uint32_t nobody) {
  std::vector<std::int64_t> result(numbers.begin(), numbers.end());
  std::replace(result.begin(), result.end(), std::int64_t{nobody}, std::int64_t{-1});
  return to_array(std::move(result));
}

/// The value of a name. Throws: ValueError that lists the known ones.
template <class T>
T named(const std::string& name, const char* what,
        std::initializer_list<std::pair<std::string_view, T>> known) {
  std::string list;
  for (const auto& [text, value] : known) {
    if (text == name) return value;
    list += (list.empty() ? "" : ", ") + std::string(text);
  }
  throw py::value_error("`" + std::string(what) + "` is one of " + list + ", not '" + name + "'");
}

/// The value of an option, if it is given. Throws: TypeError for one of another type.
template <class T>
void take_option(const py::dict& options, const char* name, T& value) {
  if (!options.contains(name)) return;
  try {
    value = options[name].cast<T>();
  } catch (const py::cast_error&) {
    throw py::type_error("`" + std::string(name) + "` cannot be " +
                         std::string(py::repr(options[name])));
  }
}

/// numpy's name of a type: "u1", "f8".
std::string type_name(stream::ScalarType type);
/// Throws: TypeError for what is no number of 8 to 64 bits in the machine's byte order.
stream::ScalarType scalar_type(const py::dtype& type, const std::string& what);

/// Coordinates and attributes of points as numpy's structured type: x, y, z as doubles, then the
/// attributes as they are stored, packed; `more` doubles at the end.
py::dtype record_type(const stream::Schema& schema, const std::vector<std::string>& more = {});
/// The attributes alone, as records hold them.
py::dtype attributes_type(const stream::Schema& schema);
/// Dicts of name, dtype, scale, offset and unit; of what is known of a CRS.
py::list attributes_info(const stream::Schema& schema);
py::dict crs_info(const stream::Crs& crs);
/// Records of such a type.
py::array to_records(std::vector<std::byte>&& bytes, const py::dtype& type);

/// None; a tuple of six numbers: a box; a dict of polygons, each a list of arrays (n, 2), crs, None
/// or a name as of terrain::PlacesCrs, and name, for messages.
std::optional<terrain::Region> region_of(const py::object& given);
/// A line for the package's log.
void log_note(const std::string& line);
/// A region in the CRS of the data; what was assumed is logged.
terrain::Region converted(const terrain::Region& region, terrain::RegionConversion conversion);
/// Of `given`, for a store.
std::optional<terrain::Region> region_of(const py::object& given, const stream::Store& store);

}  // namespace terrace::python
