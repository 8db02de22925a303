// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/source.hpp>

#include "base/stored_entities.hpp"
#include "build/joined_longitudes.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/context.hpp"
#include "terrace/terrain/input_triangles.hpp"

namespace terrace::terrain {

/// Reads the triangles of a build's input, in a second pass after the points.
class MeshInput {
 public:
  /// info: of the points. placement: of the store. middle: see JoinedLongitudes. Throws:
  /// stream::Error if triangles are required and there are none, or if they cannot be read because
  /// the input is a pipe. The request and the context must outlive the object.
  MeshInput(const BuildRequest& request, const stream::SourceInfo& info,
            const stream::Placement& placement, std::optional<double> middle,
            const Context& context);

  /// Returns what BuildRequest::surface is called with; it must not outlive the object.
  [[nodiscard]] InputTriangles triangles();
  /// Returns the number of triangles that have been read.
  [[nodiscard]] std::uint64_t read() const { return read_; }

 private:
  [[nodiscard]] bool next(std::vector<InputTriangles::Triangle>& triangles);
  void open();

  const BuildRequest& request_;
  const Context& context_;
  std::string file_;
  bool has_faces_;
  JoinedLongitudes longitudes_;
  std::unique_ptr<stream::PointSource> source_;
  std::optional<CornerReader> corners_;
  stream::PointBlock block_;
  std::uint64_t read_ = 0, missing_ = 0;
};

}  // namespace terrace::terrain
