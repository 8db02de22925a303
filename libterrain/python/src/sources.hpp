// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include <terrace/stream/source.hpp>

#include "core.hpp"

/// What Python reads points from, and which of them.

namespace terrace::python {

using OpenSource =
    std::function<std::unique_ptr<stream::PointSource>(const stream::SourceOptions&)>;

/// source: a list of names of files; or arrays as a dict, which must live as long as the source:
/// {"name", "columns": 3 coordinates, "attributes"} with columns as dicts of array, name, scale and
/// offset, or {"name", "samples": 2D, "transform": six numbers to a sample's place, "nodata",
/// "scale", "offset"}.
OpenSource opener_of(const py::object& source);

/// How `source` is read; the region is moved to where it lies.
stream::SourceOptions reading_of(const py::object& source, const py::dict& options,
                                 unsigned threads = 1, std::stop_token stop = {});
stream::HeightsOfColour colours_of(const py::dict& options);
stream::Entities entities_of(const py::dict& options);

}  // namespace terrace::python
