// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <terrace/stream/message.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/region.hpp>

#include "core.hpp"

/// Conversions between numpy arrays and the library's spans and vectors.

namespace terrace::python {

/// A contiguous array; arguments of another type or layout are converted.
template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// Returns a view of an array of shape (n, N); valid while the array lives.
/// Throws: ValueError, which names `what`, for another shape.
template <std::size_t N, class T>
std::span<const std::array<T, N>> rows_of(const Array<T>& array, const char* what) {
  if (array.ndim() != 2 || array.shape(1) != static_cast<py::ssize_t>(N)) {
    throw py::value_error(std::string(what) + " must have the shape (n, " + std::to_string(N) +
                          ")");
  }
  return {reinterpret_cast<const std::array<T, N>*>(array.data()),
          static_cast<std::size_t>(array.shape(0))};
}

/// Returns points of shape (n, 3), or of shape (n, 2) with z = 0. Throws: ValueError for others.
std::vector<std::array<double, 3>> points3_of(const Array<double>& input);

/// Returns a view of a one-dimensional array; valid while the array lives.
/// Throws: ValueError, which names `what`, for another shape.
template <class T>
std::span<const T> numbers_of(const Array<T>& array, const char* what) {
  if (array.ndim() != 1) throw py::value_error(std::string(what) + " must have one dimension");
  return {array.data(), static_cast<std::size_t>(array.shape(0))};
}

/// Returns an array that takes over the vector's memory.
template <class T>
py::array_t<T> to_array(std::vector<T>&& values) {
  auto* const owned = new std::vector<T>(std::move(values));
  const py::capsule owner(owned, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>({static_cast<py::ssize_t>(owned->size())}, owned->data(), owner);
}
template <class T, std::size_t N>
py::array_t<T> to_array(std::vector<std::array<T, N>>&& values) {
  auto* const owned = new std::vector<std::array<T, N>>(std::move(values));
  const py::capsule owner(owned,
                          [](void* p) { delete static_cast<std::vector<std::array<T, N>>*>(p); });
  return py::array_t<T>({static_cast<py::ssize_t>(owned->size()), static_cast<py::ssize_t>(N)},
                        reinterpret_cast<const T*>(owned->data()), owner);
}

/// Returns the numbers with -1 in place of `missing`.
inline py::array_t<std::int64_t> mark_missing(std::span<const std::uint32_t> numbers,
                                              std::uint32_t missing) {
  std::vector<std::int64_t> result(numbers.begin(), numbers.end());
  std::replace(result.begin(), result.end(), std::int64_t{missing}, std::int64_t{-1});
  return to_array(std::move(result));
}

/// Sets `value` to an option if it is given. Throws: TypeError for a value of another type.
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

/// Returns numpy's name of a type, such as "u1" or "f8".
std::string type_name(stream::ScalarType type);
/// Returns the library's type for a numpy type. Throws: TypeError, which names `what`, unless it is
/// a number of 8 to 64 bits in native byte order.
stream::ScalarType scalar_type(const py::dtype& type, const std::string& what);

/// Returns numpy's structured type for points, packed: x, y, z as doubles, then the attributes in
/// their stored types, then a double for each name in `more`.
py::dtype record_type(const stream::Schema& schema, const std::vector<std::string>& more = {});
/// Returns the part of record_type() with only the attributes.
py::dtype attributes_type(const stream::Schema& schema);
/// Returns a dict with name, dtype, scale, offset and unit for each attribute.
py::list attributes_info(const stream::Schema& schema);
/// Returns a dict that describes a CRS.
py::dict crs_info(const stream::Crs& crs);
/// Returns packed records of a structured type as an array.
py::array to_records(std::vector<std::byte>&& bytes, const py::dtype& type);

/// Converts a region from the package: None; a box as a tuple of six numbers; or a dict with
/// polygons (each a list of arrays (n, 2)), crs (None, or a name as in terrain::PlacesCrs) and name
/// (for messages).
std::optional<terrain::Region> region_of(const py::object& value);
/// Writes a line to the package's log.
void log_note(const stream::Message& line);
/// Converts a region to the CRS of the data and logs assumptions.
terrain::Region to_data_crs(const terrain::Region& region, terrain::RegionConversion conversion);
/// Converts a region from the package to the CRS of a store.
std::optional<terrain::Region> region_of(const py::object& value, const stream::Store& store);

}  // namespace terrace::python
