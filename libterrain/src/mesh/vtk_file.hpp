// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "terrace/stream/point.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::terrain {

/// Writes tetrahedra as a binary legacy VTK file: an unstructured grid with a "level" per point.
/// The file is either complete or absent. levels: one per position. Throws: stream::Error,
/// stream::Stopped.
void write_vtk(const std::string& path, std::span<const stream::Point3> positions,
               std::span<const std::uint8_t> levels,
               std::span<const std::array<std::uint32_t, 4>> tetrahedra,
               const stream::WriterOptions& options);

}  // namespace terrace::terrain
