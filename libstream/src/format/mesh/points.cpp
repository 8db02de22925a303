// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "format/chain.hpp"
#include "format/mesh/parser.hpp"
#include "format/mesh/triangles.hpp"
#include "format/missing.hpp"
#include "format/registry.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

/// Reads the vertices or triangles of meshes as points.

namespace terrace::stream {
namespace {

using MakeParser = std::unique_ptr<MeshParser> (*)(Input& input, bool faces);

/// Delivers the vertices of a mesh as points, and ignores its faces.
class MeshPoints final : public PointSource {
 public:
  MeshPoints(const std::string& file, const SourceOptions& options, MakeParser make)
      : input_(file, options.stop),
        parser_(make(input_, false)),
        block_points_(options.block_points) {
    info_.format = parser_->format();
    info_.files = {file};
    info_.points = parser_->stated_vertices();
    info_.faces = true;  // known only at the end
    constexpr std::array kNames{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      info_.coordinates[axis] = {.name = kNames[axis], .type = parser_->coordinate_type()};
    }
    if (options.crs) info_.crs = *options.crs;
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    block.clear();
    while (block.size() < block_points_ && parser_->next() == MeshParser::Item::vertex) {
      if (is_missing(parser_->vertex())) {
        ++nodata_;
      } else {
        block.positions.push_back(parser_->vertex());
      }
    }
    delivered_ += block.size();
    return !block.empty();
  }

  Progress progress() const override {
    Progress progress{.points = delivered_, .nodata = nodata_};
    if (input_.size() && *input_.size() > 0) {
      progress.fraction =
          std::min(1.0, static_cast<double>(input_.offset()) / static_cast<double>(*input_.size()));
    }
    return progress;
  }

 private:
  Input input_;
  std::unique_ptr<MeshParser> parser_;
  std::size_t block_points_;
  SourceInfo info_;
  std::uint64_t delivered_ = 0, nodata_ = 0;
};

template <MakeParser kMake>
std::unique_ptr<PointSource> open_one_mesh(const std::string& file, const SourceOptions& options) {
  if (options.entities == Entities::points) {
    return std::make_unique<MeshPoints>(file, options, kMake);
  }
  OpenMesh mesh{std::make_unique<Input>(file, options.stop), nullptr};
  mesh.parser = kMake(*mesh.input, true);
  return triangles_of(std::move(mesh), options);
}

template <MakeParser kMake>
std::unique_ptr<PointSource> open_meshes(std::span<const std::string> files,
                                         const SourceOptions& options) {
  return open_in_sequence(files, options, &open_one_mesh<kMake>);
}

}  // namespace

const Format& glb_format() {
  static const Format format{.name = "glb",
                             .endings = {".glb"},
                             .streams = true,
                             .recognise = &recognise_glb,
                             .open = &open_meshes<&glb_parser>,
                             .triangles = true};
  return format;
}

const Format& obj_format() {
  static const Format format{.name = "obj",
                             .endings = {".obj"},
                             .streams = true,
                             .recognise = &recognise_obj,
                             .open = &open_meshes<&obj_parser>,
                             .triangles = true};
  return format;
}

const Format& off_format() {
  static const Format format{.name = "off",
                             .endings = {".off", ".coff", ".noff"},
                             .streams = true,
                             .recognise = &recognise_off,
                             .open = &open_meshes<&off_parser>,
                             .triangles = true};
  return format;
}

const Format& stl_format() {
  static const Format format{.name = "stl",
                             .endings = {".stl"},
                             .streams = true,
                             .recognise = &recognise_stl,
                             .open = &open_meshes<&stl_parser>,
                             .triangles = true};
  return format;
}

}  // namespace terrace::stream
