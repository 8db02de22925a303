// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

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

/// where, keep, drop, resolution and region.
stream::Selection selection_of(const py::dict& options);
stream::HeightsOfColour colours_of(const py::dict& options);
stream::Entities entities_of(const py::dict& options);

}  // namespace terrace::python
