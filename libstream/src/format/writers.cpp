// SPDX-License-Identifier: Apache-2.0
#include "format/writers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <fmt/core.h>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

// Longer endings come first: ".copc.laz" also ends in ".laz".
constexpr std::array<WriterFormat, 7> kPointFormats{{{"xyz", ".xyz", ".txt", true},
                                                     {"csv", ".csv", "", true},
                                                     {"ply", ".ply", "", false},
                                                     {"ply-ascii", "", "", false},
                                                     {"las", ".las", "", false},
                                                     {"copc", ".copc.laz", "", false},
                                                     {"laz", ".laz", "", false}}};
constexpr std::array kPointOpeners{&open_xyz_writer,       &open_csv_writer, &open_ply_writer,
                                   &open_ply_ascii_writer, &open_las_writer, &open_copc_writer,
                                   &open_laz_writer};

constexpr std::array<WriterFormat, 4> kMeshFormats{{{"obj", ".obj", "", true},
                                                    {"ply", ".ply", "", false},
                                                    {"ply-ascii", "", "", true},
                                                    {"glb", ".glb", "", false}}};
constexpr std::array kMeshOpeners{&open_obj_writer, &open_ply_mesh_writer,
                                  &open_ply_ascii_mesh_writer, &open_glb_writer};

/// Returns the names of the formats with their endings.
std::string format_list(std::span<const WriterFormat> table) {
  std::string out;
  for (const WriterFormat& row : table) {
    if (!out.empty()) out += ", ";
    out += row.name;
    if (!row.ending.empty()) out.append(" (").append(row.ending);
    if (!row.second_ending.empty()) out.append(", ").append(row.second_ending);
    if (!row.ending.empty()) out += ")";
  }
  return out;
}

/// True if a file's name, in lower case, has the ending and something before it.
bool has_ending(const std::string& name, std::string_view ending) {
  return !ending.empty() && name.size() > ending.size() && name.ends_with(ending);
}

}  // namespace

std::size_t choose_format(std::span<const WriterFormat> table, const std::string& path,
                          const WriterOptions& options) {
  const bool to_stdout = path == kStandardStream;
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (std::size_t i = 0; i < table.size(); ++i) {
    const WriterFormat& row = table[i];
    if (!options.format.empty()) {
      if (row.name != options.format) continue;
    } else if (to_stdout) {
      if (!row.streams) continue;
    } else if (!has_ending(name, row.ending) && !has_ending(name, row.second_ending)) {
      continue;
    }
    if (to_stdout && !row.streams) {
      throw Error("standard output", fmt::format("{} cannot be written to a pipe", row.name))
          .remedy("name a file");
    }
    return i;
  }
  if (!options.format.empty()) {
    throw std::invalid_argument(fmt::format("unknown output format '{}'; known are {}",
                                            options.format, format_list(table)));
  }
  throw Error(path, "no output format has its ending").remedy("known are " + format_list(table));
}

std::unique_ptr<PointWriter> open_point_writer(const std::string& path, const PointHeader& header,
                                               const WriterOptions& options) {
  return kPointOpeners[choose_format(kPointFormats, path, options)](path, header, options);
}

std::unique_ptr<MeshWriter> open_mesh_writer(const std::string& path, const MeshHeader& header,
                                             const WriterOptions& options) {
  return kMeshOpeners[choose_format(kMeshFormats, path, options)](path, header, options);
}

std::optional<std::size_t> normals_in(std::span<const std::string> attributes) {
  for (std::size_t i = 0; i + 2 < attributes.size(); ++i) {
    if (attributes[i] == "nx" && attributes[i + 1] == "ny" && attributes[i + 2] == "nz") return i;
  }
  return std::nullopt;
}

std::string mesh_format(const std::string& path, const WriterOptions& options) {
  return std::string(kMeshFormats[choose_format(kMeshFormats, path, options)].name);
}

MeshRounding::MeshRounding(const std::string& path, const Box3& bounds,
                           const WriterOptions& options, const std::optional<MeshFrame>& frame) {
  if (mesh_format(path, options) != "glb" || bounds.empty()) return;
  origin_ = glb_origin(bounds);
  if (frame) metres_ = frame->metres;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Half a unit in the last of 24 bits, and the rounding of doubles when the origin is subtracted
    // and added back and when units are converted.
    const double half =
        std::max(bounds.max[axis] - (*origin_)[axis], (*origin_)[axis] - bounds.min[axis]);
    const double doubles = metres_[axis] == 1.0 ? 0x1p-51 : 0x1p-50;
    largest_[axis] = half * 0x1p-24 + (half + std::abs((*origin_)[axis])) * doubles;
  }
}

Point3 MeshRounding::operator()(const Point3& p) const {
  if (!origin_) return p;
  Point3 read;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double origin = (*origin_)[axis], metres = metres_[axis];
    read[axis] = origin + static_cast<double>(glb_coordinate(p[axis], origin, metres)) / metres;
  }
  return read;
}

void to_world(const Placement& placement, PointBlock& block) {
  const std::array<double, 6>& m = placement.world.xy;
  // Without a transform, coordinates must keep every bit (1 * -0.0 + 0 would not).
  if (placement.world != WorldTransform{}) {
    for (Point3& p : block.positions) {
      const double x = p[0] * m[0] + p[1] * m[1] + m[2];
      const double y = p[0] * m[3] + p[1] * m[4] + m[5];
      p[0] = x;
      p[1] = y;
    }
  }
  const Channel& height = placement.coordinates[2];
  if (height.scale != 1.0 || height.offset != 0.0) {
    for (Point3& p : block.positions) p[2] = p[2] * height.scale + height.offset;
  }
}

}  // namespace terrace::stream
