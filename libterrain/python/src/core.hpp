// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <pybind11/pybind11.h>

/// The compiled half of the Python module: conversions and calls only. One source per concept adds
/// its functions to the module; python/terrace has what users see.

namespace terrace::python {

namespace py = pybind11;

/// Text that may name files, whose bytes need not be UTF-8: others become what os.fsdecode() makes
/// of them.
py::str text_of(std::string_view text);
/// A message of the libraries, whose parameters are called as users of the module know them.
py::str message_of(std::string text);

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
