// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "base/units.hpp"
#include "cli/cli.hpp"
#include "mesh/scene.hpp"

namespace terrace::tools {

/// The part of an input that a picture shows.
struct PictureSelection {
  std::string level;   ///< empty: as much as a picture can show
  std::string region;  ///< empty: everywhere
  std::vector<std::string> focuses;
  stream::HeightsOfColour colours = stream::HeightsOfColour::none;
  bool triangles = false;  ///< triangles are wanted, not points or cells
};

/// Adds --level, --region, --focus and --rgb.
void define_picture_input(CLI::App& app, PictureSelection& selection);

/// What is to be drawn, on the ground.
struct PictureInput {
  TriangleMesh mesh;            ///< positions in metres about the middle of the whole
  std::vector<double> heights;  ///< of the vertices, in the source's unit
  bool terrain = false;         ///< certainly a height field; else judged by the mesh
  std::string guess;            ///< a guess that the picture depends on
  std::string assumption;       ///< an assumption about units
};

/// Reads a store, a raster (reduced to about four cells per pixel), a mesh, or a cloud of points.
/// Throws: stream::Error, UsageError, Interrupted.
PictureInput read_picture_input(const std::string& path, const PictureSelection& selection,
                                const ImageSize& size, const CommonOptions& common);

}  // namespace terrace::tools
