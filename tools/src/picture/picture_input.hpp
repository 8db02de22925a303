// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <terrace/stream/source.hpp>

#include "base/units.hpp"
#include "cli/cli.hpp"
#include "mesh/scene.hpp"
#include "terrace/terrain/detail_lines.hpp"

/// Reads a store or a file as the objects of a picture.

namespace terrace::tools {

/// The part of an input that a picture shows.
struct PictureSelection {
  std::string level;   ///< empty: as much detail as a picture can show
  std::string region;  ///< empty: everywhere
  std::string where;   ///< empty: all points
  std::vector<std::string> focuses;
  stream::HeightsOfColour colours = stream::HeightsOfColour::none;
  bool triangles = false;  ///< read triangles, not points or cells
};

/// The objects to draw, in ground coordinates.
struct PictureInput {
  terrain::TriangleMesh mesh;                 ///< positions in metres from the centre
  std::vector<double> heights;                ///< heights of the vertices, in the source's unit
  std::vector<terrain::LineSet::Line> lines;  ///< between vertices, instead of triangles
  bool height_field = false;                  ///< the input is one; otherwise the mesh decides
  std::string guess;                          ///< a guess that the picture depends on
  std::string assumption;                     ///< an assumption about units
};

/// Returns the memory in bytes that remains for the points of a picture after the program and the
/// pixels. Throws stream::Error, which names the file, if that is less than `bytes`.
std::uint64_t memory_for_points(const std::string& path, const terrain::ImageSize& size,
                                std::uint64_t bytes, const CommonOptions& common);
/// Checks that memory_for_points() is at least `bytes`. Throws stream::Error, which names the file.
void check_picture_memory(const std::string& path, const terrain::ImageSize& size,
                          std::uint64_t bytes, const CommonOptions& common);

/// Reads a store, a raster (reduced to about four cells per pixel), a mesh, or a cloud of points.
/// Throws: stream::Error, UsageError, stream::Stopped.
PictureInput read_picture_input(const std::string& path, const PictureSelection& selection,
                                const terrain::ImageSize& size, const CommonOptions& common);

}  // namespace terrace::tools
