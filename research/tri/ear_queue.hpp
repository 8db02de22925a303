// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <terrace/tri/delaunay3.hpp>

namespace terrace::research {

/// Removes a vertex and fills its hole by cutting ears, see ear_queue.cpp. The result equals that
/// of Delaunay3::remove(). Coord is std::int32_t or double.
template <class Coord>
void remove_by_ears(tri::Delaunay3<Coord>& triangulation, tri::VertexId vertex);

}  // namespace terrace::research
