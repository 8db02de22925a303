// SPDX-License-Identifier: Apache-2.0
#include "build/mesh_input.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <terrace/stream/error.hpp>
#include <terrace/stream/input.hpp>

#include "base/units.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

bool is_missing(const InputTriangles::Triangle& triangle) {
  return std::any_of(triangle.begin(), triangle.end(), [](const stream::Point3& corner) {
    return std::isnan(corner[0]) || std::isnan(corner[1]) || std::isnan(corner[2]);
  });
}

}  // namespace

MeshInput::MeshInput(const BuildRequest& request, const stream::SourceInfo& info,
                     const stream::Placement& placement, std::optional<double> middle,
                     const Context& context)
    : request_(request),
      context_(context),
      file_(info.files.empty() ? std::string() : info.files.front()),
      has_faces_(request.surface && request.surface_origin != SurfaceOrigin::restored &&
                 (request.open ? request.open_triangles != nullptr : info.faces)),
      longitudes_(placement, middle) {
  if (!request.surface) return;
  if (!has_faces_ && request.surface_origin == SurfaceOrigin::input) {
    throw stream::Error(file_, "has no faces, so it has no triangles")
        .remedy(
            stream::message("to restore a surface from the points, pass {surface_from} restored"));
  }
  if (!has_faces_ || request.open) return;
  const auto once = std::find_if(request.inputs.begin(), request.inputs.end(), &stream::reads_once);
  if (once == request.inputs.end()) return;
  throw stream::Error(file_, "its triangles are read after its points, but a pipe can be read once")
      .remedy(stream::message(
          "pass a file, or restore a surface from the points: {surface_from} restored"));
}

InputTriangles MeshInput::triangles() {
  if (!has_faces_) return {};
  const stream::Selection& selection = request_.selection;
  return {.next = [this](std::vector<InputTriangles::Triangle>& out) { return next(out); },
          .required = request_.surface_origin == SurfaceOrigin::input,
          .selected = !selection.where.empty() || selection.region};
}

void MeshInput::open() {
  stream::SourceOptions options;
  options.format = request_.input_format;
  options.entities = stream::Entities::triangles;
  options.needs_faces = false;
  // Files of one input may differ in the properties of their faces.
  options.selection.keep.emplace();
  options.crs = request_.crs;
  options.same_crs = &same_crs;
  options.stop = context_.stop;
  source_ = request_.open ? request_.open_triangles(options)
                          : stream::open_source(request_.inputs, options);
  corners_.emplace(source_->info(), stream::Entities::triangles, file_);
}

bool MeshInput::next(std::vector<InputTriangles::Triangle>& triangles) {
  triangles.clear();
  if (!source_) open();
  if (!source_->next(block_)) {
    if (const std::uint64_t missing = missing_ + source_->progress().nodata; missing > 0) {
      context_.say(counted(missing, "triangle", "has", "have") +
                   " a corner without a coordinate and " + (missing == 1 ? "is" : "are") +
                   " left out of the surface");
    }
    return false;
  }
  const std::size_t record = source_->info().payload_size();
  for (std::size_t i = 0; i < block_.size(); ++i) {
    InputTriangles::Triangle triangle{block_.positions[i]};
    (*corners_)(std::span(block_.payload).subspan(i * record, record), triangle);
    if (is_missing(triangle)) {
      ++missing_;
      continue;
    }
    longitudes_(triangle);
    triangles.push_back(triangle);
  }
  read_ += triangles.size();
  return true;
}

}  // namespace terrace::terrain
