// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/mesh_reader.hpp"

#include <span>
#include <vector>

#include "format/formats.hpp"
#include "format/mesh_formats.hpp"
#include "io/peek.hpp"

namespace terrace::stream {

std::optional<MeshFile> read_mesh(const std::string& file, const SourceOptions& options) {
  const std::string& format = options.format;
  if (format == "obj" || (format.empty() && file.ends_with(".obj"))) {
    return read_obj_mesh(file, options);
  }
  if (format.empty()) {
    // What a pipe has given would be missing where the file is read as a cloud.
    if (!is_rereadable(file)) return std::nullopt;
    const std::vector<char> head = peek_head(file, 4, options.stop);
    if (!ply_format().recognise(std::as_bytes(std::span(head)))) return std::nullopt;
  } else if (format != "ply") {
    return std::nullopt;
  }
  return read_ply_mesh(file, options);
}

}  // namespace terrace::stream
