// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <pybind11/pybind11.h>

/// The compiled half of the Python module, which only converts and calls. One source per concept
/// adds its functions to the module. The package in python/terrace is the public interface.

namespace terrace::python {

namespace py = pybind11;

/// Decodes text like os.fsdecode(), because it may contain file names that are not UTF-8.
py::str text_of(std::string_view text);

void bind_names(py::module_& module);
void bind_build(py::module_& module);
void bind_store(py::module_& module);
void bind_heights(py::module_& module);
void bind_mesh(py::module_& module);
void bind_tiles(py::module_& module);
void bind_view(py::module_& module);
void bind_delaunay(py::module_& module);
void bind_samples(py::module_& module);
void bind_shape(py::module_& module);
void bind_tin(py::module_& module);
void bind_trees(py::module_& module);
void bind_cluster(py::module_& module);
void bind_hierarchy(py::module_& module);
void bind_crs(py::module_& module);
void bind_model(py::module_& module);
void bind_points(py::module_& module);
void bind_matching(py::module_& module);

}  // namespace terrace::python
