// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include <terrace/stream/source.hpp>

#include "core.hpp"

/// Point sources given by Python, and the options that select points.

namespace terrace::python {

using OpenSource =
    std::function<std::unique_ptr<stream::PointSource>(const stream::SourceOptions&)>;

/// Returns a function that opens a source: a list of file names, or a dict of arrays, which must
/// outlive the source. Points are {"name", "columns": 3 coordinates, "attributes"}, with columns as
/// dicts of array, name, scale and offset. A raster is {"name", "samples": 2D, "transform": six
/// numbers to a sample's place, "nodata", "scale", "offset"}. Points of a mesh also have
/// "triangles", points of the same form with the other corners as attributes, which this function
/// ignores.
OpenSource opener_of(const py::object& source);

/// Returns the options for reading `source`, with the region moved to the data's range of
/// longitudes.
stream::SourceOptions reading_of(const py::object& source, const py::dict& options,
                                 unsigned threads = 1, std::stop_token stop = {});

}  // namespace terrace::python
