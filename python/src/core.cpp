// SPDX-License-Identifier: Apache-2.0
#include "core.hpp"

#include <exception>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <terrace/stream/error.hpp>
#include <terrace/terrain/error.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "names.hpp"

namespace terrace::python {
namespace {

py::handle error_type;  // terrace.Error

/// Translates the library's errors to Python's: failed system calls to OSError, bad data to
/// terrace.Error, invalid values to ValueError.
void translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const stream::Error& error) {
    if (error.parts().error_number != 0) {
      const py::tuple arguments =
          py::make_tuple(error.parts().error_number, message_of(error.message()));
      PyErr_SetObject(PyExc_OSError, arguments.ptr());
    } else {
      PyErr_SetObject(error_type.ptr(), message_of(error.message()).ptr());
    }
  } catch (const tri::HierarchyError& error) {
    PyErr_SetObject(error_type.ptr(), text_of(error.what()).ptr());
  } catch (const terrain::UsageError& error) {
    PyErr_SetObject(PyExc_ValueError, message_of(error.message()).ptr());
  } catch (const std::filesystem::filesystem_error& error) {
    const py::tuple arguments = py::make_tuple(error.code().value(), text_of(error.what()));
    PyErr_SetObject(PyExc_OSError, arguments.ptr());
  } catch (const py::cast_error&) {
    PyErr_SetString(PyExc_TypeError, "an argument has a type that cannot be used here");
  } catch (const stream::Stopped&) {
    PyErr_SetString(PyExc_KeyboardInterrupt, "stopped");
  }
}

}  // namespace

py::str text_of(std::string_view text) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "surrogateescape"));
}

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled half of terrace; use the package terrace.";
  error_type = py::object(py::module_::import("terrace._errors").attr("Error")).release();
  py::register_exception_translator(&translate);
  bind_names(module);
  bind_build(module);
  bind_store(module);
  bind_heights(module);
  bind_mesh(module);
  bind_tiles(module);
  bind_view(module);
  bind_delaunay(module);
  bind_samples(module);
  bind_shape(module);
  bind_tin(module);
  bind_trees(module);
  bind_cluster(module);
  bind_hierarchy(module);
  bind_crs(module);
  bind_model(module);
  bind_points(module);
  bind_matching(module);
}

}  // namespace terrace::python
